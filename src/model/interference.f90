!> *CONTACT INTERFERENCE: how far pairs may overlap at a time of the run. What is allowed is part of
!> the extra gap of the points. docs/theory.md (2.3).
module interference_mod
  use kinds_mod, only: wp, i8
  use loads_mod, only: interference_t, amplitude_value, start_of_step
  use increments_mod, only: whole_increment
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  implicit none
  private

  public :: has_interference, extra_gap_at, set_extra_gap, allowed_interference

contains

  !> Whether extra gaps change in the run.
  pure logical function has_interference(scene)
    type(scene_t), intent(in) :: scene
    integer :: step

    has_interference = .false.
    if (.not. allocated(scene%steps)) return
    do step = 1, size(scene%steps)
      if (allocated(scene%steps(step)%interferences)) has_interference = has_interference .or. &
        size(scene%steps(step)%interferences) > 0
    end do
  end function has_interference

  !> Give the points their extra gaps at a time of the run, where these change.
  pure subroutine set_extra_gap(scene, step, position, points)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step          !! 0 as 1: as the run begins
    integer(i8), intent(in) :: position  !! in the step, in parts of the deck's increments
    type(contact_points_t), intent(inout) :: points

    if (allocated(points%constant_gap)) points%extra_gap = extra_gap_at(scene, points, step, &
      position)
  end subroutine set_extra_gap

  !> The extra gaps of the points at a time of the run.
  pure function extra_gap_at(scene, points, step, position) result(extra)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: step          !! as of `set_extra_gap`
    integer(i8), intent(in) :: position  !! the same
    real(wp) :: extra(points%n)          !! [length]

    extra = points%extra_gap
    if (allocated(points%constant_gap)) extra = points%constant_gap + allowed_interference(scene, &
      points, step, position)
  end function extra_gap_at

  !> The interference that is allowed at the points, v a(t) or the overlap that the mesh has there.
  pure function allowed_interference(scene, points, step, position) result(allowed)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: step          !! as of `set_extra_gap`
    integer(i8), intent(in) :: position  !! the same
    real(wp) :: allowed(points%n)        !! [length]
    type(interference_t) :: card
    real(wp) :: share
    integer :: pair

    allowed = 0.0_wp
    if (.not. allocated(points%overlap)) return
    do pair = 1, size(scene%pairs)
      call find_share(scene, pair, max(1, step), position, card, share)
      if (card%pair == 0) cycle
      associate (first => points%first(pair), last => points%first(pair + 1) - 1)
        if (card%shrinks) then
          allowed(first:last) = share*points%overlap(first:last)
        else
          allowed(first:last) = share*card%value
        end if
      end associate
    end do
  end function allowed_interference

  !> The last card of a pair up to a time, and the share of its interference that is allowed there.
  !> Behind its *STEP the share is that of the step's end, but by an amplitude over the time of the
  !> run.
  pure subroutine find_share(scene, pair, step, position, card, share)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: pair, step
    integer(i8), intent(in) :: position
    type(interference_t), intent(out) :: card !! of pair 0: there is none
    real(wp), intent(out) :: share            !! [-]
    real(wp) :: fraction
    integer :: k, i, of_step

    share = 0.0_wp
    do of_step = step, 1, -1
      associate (from => scene%steps(of_step))
        if (allocated(from%interferences)) then
          do i = 1, size(from%interferences)
            if (from%interferences(i)%pair == pair) card = from%interferences(i)
          end do
        end if
        if (card%pair > 0) exit
        if (from%replace_interferences) return
      end associate
    end do
    if (card%pair == 0) return
    k = of_step
    if (card%amplitude > 0) then
      if (scene%amplitudes(card%amplitude)%total) k = step
    end if
    fraction = 1.0_wp
    if (k == step) fraction = real(position, wp)/(real(scene%steps(k)%n_increments, wp)* &
      real(whole_increment, wp))
    share = 1.0_wp - fraction
    if (card%amplitude > 0) share = amplitude_value(scene%amplitudes(card%amplitude), &
      fraction*scene%steps(k)%period, start_of_step(scene%steps, k))
  end subroutine find_share

end module interference_mod
