!> Friction, removal and separation of pairs in a *STEP, for the certificate: by the cards, in their
!> order.
module pairs_of_step_mod
  use kinds_mod, only: wp
  use friction_laws_mod, only: friction_law_t
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t, is_covered
  use increments_mod, only: whole_increment
  use state_mod, only: state_t
  use increment_report_mod, only: contact_fields_t
  implicit none
  private

  public :: take_pairs, face_nothing, find_closed, weigh_friction

  real(wp), parameter :: nothing_there = 1.0e30_wp !! gap of a point that faces nothing [length]

contains

  !> Give the points the coefficients that hold in a *STEP, and the pairs that are removed in it.
  pure subroutine take_pairs(scene, step, points)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    type(contact_points_t), intent(inout) :: points
    integer :: i, k, card

    if (allocated(points%is_removed)) deallocate (points%is_removed)
    do i = 1, points%n
      points%mu(i) = scene%pairs(points%pair(i))%mu
    end do
    do k = 1, step
      associate (of => scene%steps(k))
        if (allocated(of%frictions)) then
          do card = 1, size(of%frictions)
            where (points%pair == of%frictions(card)%pair) points%mu = of%frictions(card)%mu
          end do
        end if
        if (.not. allocated(of%pair_changes)) cycle
        if (.not. allocated(points%is_removed)) allocate (points%is_removed(size(scene%pairs)), &
          source=.false.)
        do card = 1, size(of%pair_changes)
          points%is_removed(of%pair_changes(card)%pair) = of%pair_changes(card)%is_removed
        end do
      end associate
    end do
  end subroutine take_pairs

  !> Give the points the coefficients that belong to their reactions and slips, where cards make
  !> friction depend on the pressure, the force over the area of the point, or on the rate of slip,
  !> that of the increment over its part of the step's period.
  pure subroutine weigh_friction(scene, old, new, contact, points)
    type(scene_t), intent(in) :: scene
    type(state_t), intent(in) :: old, new         !! before and after the increment
    type(contact_fields_t), intent(in) :: contact !! its reactions, areas and slips
    type(contact_points_t), intent(inout) :: points
    type(friction_law_t) :: law
    real(wp) :: pressure, part, parts_of_period
    integer :: i, k, card

    parts_of_period = real(new%position, wp)
    if (old%step == new%step) parts_of_period = real(new%position - old%position, wp)
    do i = 1, points%n
      law = scene%pairs(points%pair(i))%law
      do k = 1, new%step
        if (.not. allocated(scene%steps(k)%frictions)) cycle
        associate (cards => scene%steps(k)%frictions)
          do card = 1, size(cards)
            if (cards(card)%pair == points%pair(i)) law = cards(card)%law
          end do
        end associate
      end do
      if (.not. contact%reaction(1, i) > 0.0_wp) cycle
      pressure = huge(1.0_wp)
      if (contact%covered_area(i) > 0.0_wp) pressure = contact%reaction(1, i)/ &
        contact%covered_area(i)
      part = 1.0_wp
      if (allocated(law%pressure)) then
        do k = 1, size(law%pressure)
          if (pressure >= law%pressure(k)) part = law%share(k)
        end do
        if (pressure < law%pressure(1)) part = law%share(1)
        do k = 2, size(law%pressure)
          associate (low => law%pressure(k - 1), high => law%pressure(k))
            if (pressure > low .and. pressure < high) part = (law%share(k - 1)*(high - pressure) + &
              law%share(k)*(pressure - low))/(high - low)
          end associate
        end do
      end if
      if (law%most < huge(1.0_wp)) part = min(part, law%most/pressure)
      if (law%decay > 0.0_wp) part = law%kinetic + (1.0_wp - law%kinetic)/exp(law%decay*norm2( &
        contact%slip_increment(:, i))*real(scene%steps(new%step)%n_increments, wp)* &
        real(whole_increment, wp)/(parts_of_period*scene%steps(new%step)%period))
      points%mu(i) = part*points%mu(i)
    end do
  end subroutine weigh_friction

  !> Points of pairs that are removed face nothing: what acts there is a violation.
  pure subroutine face_nothing(points, contact)
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(inout) :: contact !! gaps and slip increments
    integer :: i

    if (.not. allocated(points%is_removed)) return
    do i = 1, points%n
      if (.not. points%is_removed(points%pair(i))) cycle
      contact%gap(i) = nothing_there
      contact%slip_increment(:, i) = 0.0_wp
    end do
  end subroutine face_nothing

  !> Which points have to stay closed: of pairs without separation those that are said to, and those
  !> with a reaction when the increment began, unless they have left their master.
  pure subroutine find_closed(scene, points, old, contact)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(state_t), intent(in) :: old
    type(contact_fields_t), intent(inout) :: contact !! its `stays`
    logical :: is_said(points%n)
    integer :: i

    is_said = contact%stays
    do i = 1, points%n
      contact%stays(i) = scene%pairs(points%pair(i))%no_separation .and. (is_said(i) .or. &
        any(abs(old%reaction(:, i)) > 0.0_wp)) .and. is_covered(points, contact%weights, i)
      if (allocated(points%is_removed)) contact%stays(i) = contact%stays(i) .and. .not. &
        points%is_removed(points%pair(i))
    end do
  end subroutine find_closed

end module pairs_of_step_mod
