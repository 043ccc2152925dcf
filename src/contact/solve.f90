!> Which contact solver runs.
module solve_mod
  use kinds_mod, only: wp
  use controls_mod, only: contact_controls_t, solver_global_newton
  use problem_mod, only: contact_problem_t, contact_report_t
  use sweeps_mod, only: solve_by_sweeps
  use global_newton_mod, only: solve_by_global_newton
  implicit none
  private

  public :: solve_contact

contains

  !> Solve the condensed problem as the deck asks; AUTO takes Gauss-Seidel sweeps with the deck's
  !> local solver.
  subroutine solve_contact(problem, x_free, controls, r, report)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: x_free(:)       !! (n_rows) [length]
    type(contact_controls_t), intent(in) :: controls
    real(wp), intent(inout) :: r(:, :)      !! (3,n_points) warm start in, solution out [force]
    type(contact_report_t), intent(out) :: report

    if (problem%n_points == 0) then
      report%converged = .true.
      return
    end if
    select case (controls%solver)
    case (solver_global_newton)
      call solve_by_global_newton(problem, x_free, controls, r, report)
    case default
      call solve_by_sweeps(problem, x_free, controls, r, report)
    end select
  end subroutine solve_contact

end module solve_mod
