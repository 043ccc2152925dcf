!> Which contact solver runs, and what follows when it does not reach the tolerance.
!>
!> AUTO, in this order, each from the best reactions found so far, until the tolerance is reached:
!>
!>   1. global Newton from the last increment's reactions, unless W is singular
!>   2. proximal steps by global Newton
!>   3. Newton from no reactions, with no friction at first and then more and more of it
!>   4. sweeps, exact local solutions, relaxed and accelerated
!>
!> Global Newton alone takes proximal steps where W is singular. Where W is known by its products
!> alone global Newton is all there is; whoever can may form W then.
!>
!> docs/theory.md section 4.
module solve_mod
  use kinds_mod, only: wp
  use undefined_mod, only: undefined
  use controls_mod, only: contact_controls_t, solver_auto, solver_global_newton, &
                          solver_sweeps, formulation_bipotential, local_exact, stop_at_residual
  use increment_report_mod, only: ended_well
  use problem_mod, only: contact_problem_t, contact_report_t
  use compliance_mod, only: is_map
  use sweeps_mod, only: solve_by_sweeps
  use global_newton_mod, only: solve_by_global_newton
  use proximal_newton_mod, only: solve_by_proximal_newton, needs_proximal_steps, &
                                  may_take_proximal_steps
  use growing_friction_mod, only: solve_with_growing_friction
  implicit none
  private

  public :: solve_contact

  real(wp), parameter :: relaxation = 0.4_wp    !! keeps the count of sweeps flat in the mesh [-]

  !> What a stage of AUTO runs.
  integer, parameter :: by_newton = 1, by_proximal_newton = 2, by_sweeps = 3, &
    by_growing_friction = 4

contains

  !> Solve the condensed problem with the solver of the deck.
  !>
  !> Not converging is no error: the report says so, and r is the best that was found.
  subroutine solve_contact(problem, x_free, controls, r, report, is_trial, briefly)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: x_free(:)       !! (n_rows) [length]
    type(contact_controls_t), intent(in) :: controls
    real(wp), intent(inout) :: r(:, :)      !! (3,n_points) warm start in, solution out [force]
    type(contact_report_t), intent(out) :: report
    logical, intent(in), optional :: is_trial
    !! may fail: nothing follows global Newton, which is given up earlier
    logical, intent(in), optional :: briefly
    !! nothing follows global Newton, whose proximal steps end where one gains less than a half
    logical :: is_alone

    if (problem%n_points == 0) then
      report%ending = ended_well
      return
    end if
    if (is_map(problem%compliance)) then
      ! Sweeps, proximal steps and all that may follow read W.
      call solve_by_global_newton(problem, x_free, controls, r, report)
      return
    end if
    select case (controls%solver)
    case (solver_global_newton)
      if (needs_proximal_steps(problem, r)) then
        call solve_by_proximal_newton(problem, x_free, controls, r, report, briefly)
      else
        call solve_by_global_newton(problem, x_free, controls, r, report, is_trial)
        is_alone = .not. allocated(problem%twin)
        if (present(is_trial)) is_alone = is_alone .or. is_trial
        if (present(briefly)) is_alone = is_alone .or. briefly
        if (report%converged() .or. is_alone) return
        report%stages = 1
        call stage(problem, x_free, controls, by_proximal_newton, r, report)
      end if
    case (solver_auto)
      call solve_automatically(problem, x_free, controls, r, report)
    case (solver_sweeps)
      call solve_by_sweeps(problem, x_free, controls, r, report)
    case default
      r = undefined
    end select
  end subroutine solve_contact

  !> The stages of AUTO.
  subroutine solve_automatically(problem, x_free, controls, r, report)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: x_free(:)
    type(contact_controls_t), intent(in) :: controls
    real(wp), intent(inout) :: r(:, :)
    type(contact_report_t), intent(out) :: report
    type(contact_controls_t) :: sweeps

    if (.not. needs_proximal_steps(problem, r)) then
      call stage(problem, x_free, controls, by_newton, r, report)
      if (report%converged()) return
    end if
    if (may_take_proximal_steps(problem)) then
      call stage(problem, x_free, controls, by_proximal_newton, r, report)
      if (report%converged()) return
      if (any(problem%mu > 0.0_wp)) then
        call stage(problem, x_free, controls, by_growing_friction, r, report)
        if (report%converged()) return
      end if
    end if
    sweeps = controls
    sweeps%stop_rule = stop_at_residual
    sweeps%formulation = formulation_bipotential
    sweeps%local = local_exact
    sweeps%acceleration = .true.
    sweeps%relaxation = relaxation
    call stage(problem, x_free, sweeps, by_sweeps, r, report)
  end subroutine solve_automatically

  !> One stage: its counts add up, its reactions stay only if they are better.
  subroutine stage(problem, x_free, controls, kind, r, report)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: x_free(:)
    type(contact_controls_t), intent(in) :: controls
    integer, intent(in) :: kind                !! by_newton, ...
    real(wp), intent(inout) :: r(:, :)
    type(contact_report_t), intent(inout) :: report
    type(contact_report_t) :: here
    real(wp) :: trial(3, problem%n_points)

    trial = r
    select case (kind)
    case (by_newton)
      call solve_by_global_newton(problem, x_free, controls, trial, here)
    case (by_proximal_newton)
      call solve_by_proximal_newton(problem, x_free, controls, trial, here)
    case (by_growing_friction)
      call solve_with_growing_friction(problem, x_free, controls, trial, here)
    case (by_sweeps)
      call solve_by_sweeps(problem, x_free, controls, trial, here)
    case default
      trial = undefined
      here%residual = huge(1.0_wp)
    end select
    here%stages = 1
    if (report%stages == 0 .or. here%residual < report%residual) r = trial
    call take_over(here, report)
  end subroutine stage

  !> Add what one more try took; what it says of its result counts only if that is better.
  pure subroutine take_over(here, report)
    type(contact_report_t), intent(in) :: here
    type(contact_report_t), intent(inout) :: report

    if (report%stages == 0 .or. here%residual < report%residual) then
      report%residual = here%residual
      report%worst_point = here%worst_point
      report%solver = here%solver
    end if
    report%ending = here%ending
    report%stages = report%stages + here%stages
    report%iterations = report%iterations + here%iterations
    report%local_iterations = report%local_iterations + here%local_iterations
    report%products = report%products + here%products
    report%wants_exact = report%wants_exact .or. here%wants_exact
  end subroutine take_over

end module solve_mod
