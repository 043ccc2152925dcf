!> Which contact solver runs, and what follows when it does not reach the tolerance.
!>
!> AUTO, in this order, each from the best reactions found so far, until the tolerance is reached:
!>
!>   1. global Newton from the last increment's reactions; where W is singular a few
!>      accelerated sweeps, unless it is a narrow band or only twins make it so
!>   2. proximal steps by global Newton
!>   3. Newton from no reactions, with no friction at first and then more and more of it
!>   4. sweeps, exact local solutions, accelerated, for as long as they gain; beside them Newton
!>      again whenever they have gained much
!>   5. plain sweeps, neither relaxed nor accelerated, as many as MAX SWEEPS allows
!>
!> and all of it but 3. once more from no reactions, where those of the last increment led nowhere.
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
  use problem_mod, only: contact_problem_t, contact_report_t
  use compliance_mod, only: is_map
  use sweeps_mod, only: solve_by_sweeps
  use global_newton_mod, only: solve_by_global_newton
  use proximal_newton_mod, only: solve_by_proximal_newton, needs_proximal_steps, &
                                  may_take_proximal_steps, is_narrow_band
  use growing_friction_mod, only: solve_with_growing_friction
  implicit none
  private

  public :: solve_contact

  integer,  parameter :: first_sweeps = 100     !! of stage 1
  integer,  parameter :: round_of_sweeps = 500  !! of stage 4, before it is asked what they gained
  real(wp), parameter :: relaxation = 0.4_wp    !! keeps the count of sweeps flat in the mesh [-]
  real(wp), parameter :: gain = 0.5_wp          !! of the residual, in a round that is worth another
  real(wp), parameter :: much = 0.1_wp          !! of the residual, worth another try by Newton

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
    logical :: is_warm, is_alone

    is_warm = any(abs(r) > 0.0_wp)
    if (problem%n_points == 0) then
      report%converged = .true.
      return
    end if
    if (is_map(problem%compliance)) then
      ! Sweeps, proximal steps and all that may follow read W.
      call solve_by_global_newton(problem, x_free, controls, r, report)
      report%stages = 1
      if (report%converged .or. .not. is_warm) return
      call start_anew(problem, x_free, controls, r, report)
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
        if (report%converged .or. is_alone) return
        report%stages = 1
        call stage(problem, x_free, controls, by_proximal_newton, r, report)
      end if
    case (solver_auto)
      call solve_automatically(problem, x_free, controls, r, report, .true.)
      if (report%converged .or. .not. is_warm) return
      call start_anew(problem, x_free, controls, r, report)
    case (solver_sweeps)
      call solve_by_sweeps(problem, x_free, controls, r, report)
    case default
      r = undefined
    end select
  end subroutine solve_contact

  !> The stages of AUTO, or global Newton where it is all there is, once more from no reactions; the
  !> result stays only if it is better.
  subroutine start_anew(problem, x_free, controls, r, report)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: x_free(:)                 !! (n_rows) [length]
    type(contact_controls_t), intent(in) :: controls
    real(wp), intent(inout) :: r(:, :)                !! (3,n_points) [force]
    type(contact_report_t), intent(inout) :: report
    type(contact_report_t) :: here
    real(wp) :: trial(3, problem%n_points)

    trial = 0.0_wp
    if (is_map(problem%compliance)) then
      call solve_by_global_newton(problem, x_free, controls, trial, here)
      here%stages = 1
    else
      call solve_automatically(problem, x_free, controls, trial, here, .false.)
    end if
    if (here%residual < report%residual) r = trial
    call take_over(here, report)
  end subroutine start_anew

  !> The stages of AUTO.
  subroutine solve_automatically(problem, x_free, controls, r, report, is_first)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: x_free(:)
    type(contact_controls_t), intent(in) :: controls
    real(wp), intent(inout) :: r(:, :)
    type(contact_report_t), intent(out) :: report
    logical, intent(in) :: is_first !! what begins from nothing anyway has its turn once
    type(contact_controls_t) :: sweeps
    integer :: newton

    sweeps = controls
    sweeps%stop_rule = stop_at_residual
    sweeps%formulation = formulation_bipotential
    sweeps%local = local_exact
    newton = by_newton
    if (needs_proximal_steps(problem, r)) newton = by_proximal_newton
    if (newton == by_newton) then
      call stage(problem, x_free, sweeps, by_newton, r, report)
    else if (.not. (is_narrow_band(problem) .or. allocated(problem%twin))) then
      sweeps%acceleration = .true.
      sweeps%relaxation = 1.0_wp
      sweeps%max_sweeps = min(first_sweeps, controls%max_sweeps)
      call stage(problem, x_free, sweeps, by_sweeps, r, report)
    end if
    if (report%converged) return
    if (may_take_proximal_steps(problem)) then
      call stage(problem, x_free, sweeps, by_proximal_newton, r, report)
      if (report%converged) return
      if (is_first .and. any(problem%mu > 0.0_wp)) then
        call stage(problem, x_free, sweeps, by_growing_friction, r, report)
        if (report%converged) return
      end if
    end if
    sweeps%max_sweeps = controls%max_sweeps
    call sweep_and_try(problem, x_free, sweeps, newton, r, report)
    if (report%converged) return
    sweeps%max_sweeps = controls%max_sweeps
    sweeps%relaxation = 1.0_wp
    sweeps%acceleration = .false.
    call stage(problem, x_free, sweeps, by_sweeps, r, report)
  end subroutine solve_automatically

  !> Rounds of accelerated sweeps for as long as they gain, relaxed and, where that gains no more,
  !> not; Newton from where they have led.
  subroutine sweep_and_try(problem, x_free, controls, newton, r, report)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: x_free(:)
    type(contact_controls_t), intent(in) :: controls
    integer, intent(in) :: newton              !! which
    real(wp), intent(inout) :: r(:, :)
    type(contact_report_t), intent(inout) :: report
    type(contact_controls_t) :: sweeps
    real(wp) :: last, tried
    integer :: left

    sweeps = controls
    sweeps%acceleration = .true.
    sweeps%relaxation = relaxation
    left = controls%max_sweeps
    tried = huge(tried)
    rounds: do while (left > 0)
      last = report%residual
      sweeps%max_sweeps = min(round_of_sweeps, left)
      left = left - sweeps%max_sweeps
      call stage(problem, x_free, sweeps, by_sweeps, r, report)
      if (report%converged) return
      if (report%residual <= much*tried) then
        call stage(problem, x_free, controls, newton, r, report)
        if (report%converged) return
        tried = report%residual
      end if
      if (report%residual <= gain*last) cycle rounds
      if (sweeps%relaxation >= 1.0_wp) exit rounds
      sweeps%relaxation = 1.0_wp
    end do rounds
  end subroutine sweep_and_try

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
    report%converged = here%converged
    report%ending = here%ending
    report%stages = report%stages + here%stages
    report%iterations = report%iterations + here%iterations
    report%local_iterations = report%local_iterations + here%local_iterations
    report%products = report%products + here%products
    report%wants_exact = report%wants_exact .or. here%wants_exact
  end subroutine take_over

end module solve_mod
