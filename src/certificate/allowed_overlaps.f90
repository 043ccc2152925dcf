!> What *CONTACT INTERFERENCE allows, for the certificate: from the deck's cards and the places of
!> the mesh. docs/theory.md (2.3).
module allowed_overlaps_mod
  use kinds_mod, only: wp, i8
  use loads_mod, only: amplitude_value
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t
  use increment_report_mod, only: contact_fields_t
  use obstacle_gaps_mod, only: face_obstacles
  use facing_surfaces_mod, only: find_gaps
  implicit none
  private

  public :: add_allowed

  integer(i8), parameter :: parts = 2_i8**32 !! of an increment of the deck, in which states count

  !> What the cards up to a *STEP say of a pair.
  type :: said_t
    integer  :: step = 0          !! of its last card; 0: nothing is allowed
    real(wp) :: length = 0.0_wp   !! [length]
    logical  :: of_mesh = .false. !! each node's own overlap in place of the length
    integer  :: amplitude = 0
  end type said_t

contains

  !> Put what is allowed at the end of an increment into the extra gaps of the points.
  pure subroutine add_allowed(scene, new, contact, points)
    type(scene_t), intent(in) :: scene
    type(state_t), intent(in) :: new
    type(contact_fields_t), intent(in) :: contact    !! which points faces cover
    type(contact_points_t), intent(inout) :: points  !! their extra gaps
    type(said_t) :: said(size(scene%pairs))
    real(wp) :: part(size(scene%pairs)), gap(points%n)
    integer :: pair

    points%extra_gap = points%constant_gap
    said = said_up_to(scene, new%step)
    part = [(part_at(scene, said(pair), new), pair=1, size(scene%pairs))]
    gap = 0.0_wp
    if (any(said%of_mesh .and. part > 0.0_wp)) gap = gaps_at_rest(scene, points, contact, new)
    do pair = 1, size(scene%pairs)
      associate (first => points%first(pair), last => points%first(pair + 1) - 1)
        associate (extra => points%extra_gap(first:last))
          if (said(pair)%of_mesh) then
            extra = extra + part(pair)*max(0.0_wp, -gap(first:last))
          else
            extra = extra + part(pair)*said(pair)%length
          end if
        end associate
      end associate
    end do
  end subroutine add_allowed

  !> The cards in the order of the deck: a later one of a pair takes the place of an earlier one,
  !> and OP=NEW ends all.
  pure function said_up_to(scene, step) result(said)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    type(said_t) :: said(size(scene%pairs))
    integer :: k, i

    do k = 1, step
      if (scene%steps(k)%replace_interferences) said = said_t()
      if (.not. allocated(scene%steps(k)%interferences)) cycle
      do i = 1, size(scene%steps(k)%interferences)
        associate (card => scene%steps(k)%interferences(i))
          said(card%pair) = said_t(k, card%value, card%shrinks, card%amplitude)
        end associate
      end do
    end do
  end function said_up_to

  !> What part of it is allowed at the end of an increment; 0 where no card says anything.
  pure real(wp) function part_at(scene, said, new) result(part)
    type(scene_t), intent(in) :: scene
    type(said_t), intent(in) :: said
    type(state_t), intent(in) :: new
    real(wp) :: gone !! of the step of the card [-]

    part = 0.0_wp
    if (said%step == 0) return
    gone = 1.0_wp
    if (said%step == new%step) gone = real(new%position, wp)/real(parts* &
      scene%steps(new%step)%n_increments, wp)
    if (said%amplitude == 0) then
      part = 1.0_wp - gone
    else if (scene%amplitudes(said%amplitude)%total) then
      part = amplitude_value(scene%amplitudes(said%amplitude), new%time)
    else
      part = amplitude_value(scene%amplitudes(said%amplitude), gone*scene%steps(said%step)%period)
    end if
  end function part_at

  !> The gaps of the undeformed mesh with the constant extra gaps. Where faces cover little, and
  !> where rows are not compared, they are what the program says.
  pure function gaps_at_rest(scene, points, contact, new) result(gap)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points !! with these extra gaps
    type(contact_fields_t), intent(in) :: contact
    type(state_t), intent(in) :: new
    real(wp) :: gap(points%n) !! [length]
    type(contact_fields_t) :: at_rest
    type(state_t) :: rest

    rest = new
    rest%displacement = 0.0_wp
    rest%rotation = 0.0_wp
    at_rest = contact
    at_rest%gap = -points%overlap
    call face_obstacles(scene, points, rest, rest, at_rest)
    call find_gaps(scene, points, rest, contact, at_rest%gap)
    gap = at_rest%gap
  end function gaps_at_rest

end module allowed_overlaps_mod
