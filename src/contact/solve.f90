!> Which contact solver runs, and what follows when it does not reach the tolerance.
!>
!> AUTO, in this order, each from the best reactions found so far, until the tolerance is reached:
!>
!>   1. global Newton from the last step's reactions
!>   2. sweeps, exact local solutions, relaxed and accelerated, then global Newton again
!>   3. plain sweeps, neither relaxed nor accelerated, as many as MAX SWEEPS allows
!>
!> docs/theory.md section 4.
module solve_mod
  use kinds_mod, only: wp
  use controls_mod, only: contact_controls_t, solver_auto, solver_global_newton, solver_sweeps, &
                          formulation_bipotential, local_exact, stop_at_residual
  use problem_mod, only: contact_problem_t, contact_report_t
  use sweeps_mod, only: solve_by_sweeps
  use global_newton_mod, only: solve_by_global_newton
  implicit none
  private

  public :: solve_contact

  integer,  parameter :: short_sweeps = 500     !! of stage 2
  real(wp), parameter :: relaxation = 0.4_wp    !! keeps the count of sweeps flat in the mesh [-]

contains

  !> Solve the condensed problem with the solver of the deck.
  !>
  !> Not converging is no error: the report says so, and r is the best that was found.
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
    case (solver_auto)
      call solve_automatically(problem, x_free, controls, r, report)
    case default
      call solve_by_sweeps(problem, x_free, controls, r, report)
    end select
  end subroutine solve_contact

  !> The stages of AUTO.
  subroutine solve_automatically(problem, x_free, controls, r, report)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: x_free(:)
    type(contact_controls_t), intent(in) :: controls
    real(wp), intent(inout) :: r(:, :)
    type(contact_report_t), intent(out) :: report
    type(contact_controls_t) :: newton, sweeps

    newton = controls
    newton%solver = solver_global_newton
    newton%stop_rule = stop_at_residual
    sweeps = newton
    sweeps%solver = solver_sweeps
    sweeps%formulation = formulation_bipotential
    sweeps%local = local_exact
    sweeps%relaxation = relaxation
    sweeps%acceleration = .true.

    call stage(problem, x_free, newton, r, report)
    if (report%converged) return
    sweeps%max_sweeps = min(short_sweeps, controls%max_sweeps)
    call stage(problem, x_free, sweeps, r, report)
    if (report%converged) return
    call stage(problem, x_free, newton, r, report)
    if (report%converged) return
    sweeps%max_sweeps = controls%max_sweeps
    sweeps%relaxation = 1.0_wp
    sweeps%acceleration = .false.
    call stage(problem, x_free, sweeps, r, report)
  end subroutine solve_automatically

  !> One stage: its counts add up, its reactions stay only if they are better.
  subroutine stage(problem, x_free, controls, r, report)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: x_free(:)
    type(contact_controls_t), intent(in) :: controls
    real(wp), intent(inout) :: r(:, :)
    type(contact_report_t), intent(inout) :: report
    type(contact_report_t) :: here
    real(wp) :: trial(3, problem%n_points)
    logical :: first

    first = report%stages == 0
    trial = r
    if (controls%solver == solver_global_newton) then
      call solve_by_global_newton(problem, x_free, controls, trial, here)
    else
      call solve_by_sweeps(problem, x_free, controls, trial, here)
    end if
    if (first .or. here%residual < report%residual) then
      r = trial
      report%residual = here%residual
      report%worst_point = here%worst_point
      report%solver = here%solver
    end if
    report%stages = report%stages + 1
    report%converged = here%converged
    report%ending = here%ending
    report%iterations = report%iterations + here%iterations
    report%local_iterations = report%local_iterations + here%local_iterations
    report%products = report%products + here%products
  end subroutine stage

end module solve_mod
