!> Friction coefficients that fall with the rate of slip. docs/theory.md (3.14).
!>
!> Contact is solved with coefficients that are held, and again with those that belong to the slips
!> found, until they agree. That contracts where the bodies resist slip by more than friction falls
!> with it: where they do not, a body jerks, and no static path follows it.
module friction_by_rate_mod
  use kinds_mod, only: wp
  use contact_points_mod, only: contact_points_t
  use friction_laws_mod, only: falls_with_rate, share_at_rate
  use condensed_contact_mod, only: condensed_contact_t
  use increment_report_mod, only: contact_fields_t
  implicit none
  private

  public :: depends_on_rate, find_coefficients, give_coefficients

contains

  !> Whether any pair has such friction in the step.
  pure logical function depends_on_rate(points) result(depends)
    type(contact_points_t), intent(in) :: points

    depends = allocated(points%laws)
    if (depends) depends = any(falls_with_rate(points%laws))
  end function depends_on_rate

  !> The coefficients that belong to the slips of an increment, and how far those of points that
  !> press are from the ones that these were found with, as a part of the largest.
  pure subroutine find_coefficients(points, largest, contact, duration, apart)
    type(contact_points_t), intent(inout) :: points !! its coefficients
    real(wp), intent(in) :: largest(:)              !! (n_points) those at rest [-]
    type(contact_fields_t), intent(in) :: contact   !! its reactions and slips
    real(wp), intent(in) :: duration                !! of the increment, > 0 [time]
    real(wp), intent(out) :: apart                  !! [-]
    real(wp) :: mu
    integer :: i

    apart = 0.0_wp
    do i = 1, points%n
      if (.not. largest(i) > 0.0_wp) cycle
      mu = largest(i)*share_at_rate(points%laws(points%pair(i)), &
        norm2(contact%slip_increment(:, i))/duration)
      if (contact%reaction(1, i) > 0.0_wp) apart = max(apart, abs(mu - points%mu(i))/largest(i))
      points%mu(i) = mu
    end do
  end subroutine find_coefficients

  !> Let the contact problems have the coefficients of the points. Those of a placement yet to be
  !> found will have them.
  pure subroutine give_coefficients(points, contact)
    type(contact_points_t), intent(in) :: points
    type(condensed_contact_t), intent(inout) :: contact
    integer :: k

    if (.not. allocated(contact%group)) return
    do k = 1, size(contact%group)
      associate (group => contact%group(k))
        if (allocated(group%active)) group%problem%mu = points%mu(group%active)
      end associate
    end do
  end subroutine give_coefficients

end module friction_by_rate_mod
