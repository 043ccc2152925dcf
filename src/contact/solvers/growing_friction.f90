!> Contact problems solved with little friction first, then with more and more.
!>
!> Without friction the reactions are those of a convex problem, which Newton's method finds from
!> anywhere. Its iteration fails where many points change between stick and slide at once; from the
!> reactions under a little less friction few of them do. docs/theory.md section 4.
module growing_friction_mod
  use kinds_mod, only: wp
  use controls_mod, only: contact_controls_t
  use problem_mod, only: contact_problem_t, contact_report_t
  use global_newton_mod, only: solve_by_global_newton
  use proximal_newton_mod, only: solve_by_proximal_newton, needs_proximal_steps
  implicit none
  private

  public :: solve_with_growing_friction, friction_shares

  real(wp), parameter :: friction_shares(0:8) = [0.0_wp, 0.125_wp, 0.25_wp, 0.375_wp, 0.5_wp, &
    0.625_wp, 0.75_wp, 0.875_wp, 1.0_wp] !! of the friction coefficients, one after the other [-]

contains

  !> Newton's method, or proximal steps by it where W is singular, with one share of the friction
  !> coefficients after the other, each from the reactions of the one before.
  !>
  !> A share that is not solved is passed over: what it came to may do to begin the next. The
  !> report is that of all the friction, with the counts of all shares.
  subroutine solve_with_growing_friction(problem, x_free, controls, r, report)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: x_free(:)       !! (n_rows) [length]
    type(contact_controls_t), intent(in) :: controls
    real(wp), intent(out) :: r(:, :)        !! (3,n_points) solution [force]
    type(contact_report_t), intent(out) :: report
    type(contact_problem_t) :: rougher
    type(contact_report_t) :: before
    integer :: k

    rougher = problem
    r = 0.0_wp
    do k = lbound(friction_shares, 1), ubound(friction_shares, 1)
      rougher%mu = friction_shares(k)*problem%mu
      before = report
      if (needs_proximal_steps(rougher, r)) then
        call solve_by_proximal_newton(rougher, x_free, controls, r, report)
      else
        call solve_by_global_newton(rougher, x_free, controls, r, report)
      end if
      report%iterations = report%iterations + before%iterations
      report%local_iterations = report%local_iterations + before%local_iterations
      report%products = report%products + before%products
    end do
  end subroutine solve_with_growing_friction

end module growing_friction_mod
