!> Gauss-Seidel sweeps over the contact points: each point solved in turn, the others frozen at
!> their newest.
module sweeps_mod
  use kinds_mod, only: wp
  use progress_line_mod, only: show_progress
  use undefined_mod, only: undefined
  use controls_mod, only: contact_controls_t, formulation_bipotential, local_uzawa, local_newton, &
                          local_newton6, local_exact, stop_at_change, solver_sweeps
  use law_mod, only: project_prediction, driven_friction
  use increment_report_mod, only: ended_well, ended_at_limit, ended_stalled, ended_diverging
  use problem_mod, only: contact_problem_t, contact_report_t, relative_gaps, measure, &
                         unpack_rows, pack_rows, force_scale, project_reactions, mu_at
  use compliance_mod, only: row_product, coupled_product
  use anderson_mod, only: anderson_t, new_anderson, accelerate, forget
  use local_point_mod, only: local_point_t, local_solver
  use bipotential_mod, only: bipotential_residual
  use pseudopotential_mod, only: pseudopotential_residual
  use bipotential_uzawa_mod, only: solve_bipotential_uzawa
  use pseudopotential_uzawa_mod, only: solve_pseudopotential_uzawa
  use local_newton_mod, only: solve_newton
  use local_newton6_mod, only: solve_newton6
  use local_exact_mod, only: solve_exact
  implicit none
  private

  public :: solve_by_sweeps

  !> What one sweep says of itself.
  type :: sweep_t
    real(wp) :: change = 0.0_wp        !! |r_new - r_old| [force]
    real(wp) :: seen_residual = 0.0_wp !! |Z| of each point as it was when visited [force]
    integer  :: local_iterations = 0
  end type sweep_t

  integer,  parameter :: anderson_depth = 10
  integer,  parameter :: check_every = 100        !! sweeps between exact residuals, at the latest
  integer,  parameter :: patience = 5000          !! sweeps without a tenth of progress
  real(wp), parameter :: exploded = 1.0e8_wp
  !! times the forces that would undo the gaps and slips one by one: diverging [-]

contains

  !> Sweep until the stopping rule holds. [JFT07] section 3, docs/theory.md sections 4 and 5.
  !>
  !> Not converging is no error: the report says so, and why; r is the best of the exactly measured
  !> iterates then.
  subroutine solve_by_sweeps(problem, x_free, controls, r, report)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: x_free(:)       !! (n_rows) [length]
    type(contact_controls_t), intent(in) :: controls
    real(wp), intent(inout) :: r(:, :)      !! (3,n_points) warm start in, solution out [force]
    type(contact_report_t), intent(out) :: report
    procedure(local_solver), pointer :: solve_point
    type(local_point_t) :: template
    type(anderson_t) :: memory
    type(sweep_t) :: sweep
    real(wp) :: old(problem%n_rows), new(problem%n_rows), r_start(3, problem%n_points)
    real(wp) :: scale, largest !! of residuals; beyond which forces diverge [force]

    call choose_local_solver(controls, template, solve_point)
    if (controls%acceleration) memory = new_anderson(problem%n_rows, anderson_depth)
    r_start = r
    old = pack_rows(problem, r)
    report%residual = huge(report%residual)
    call judge(problem, x_free, old, r_start, controls, r, report)
    scale = force_scale(problem, unpack_rows(problem, x_free), r_start, r_start)
    largest = exploded*max(scale, norm2(spread(problem%rho_map, 1, 3)*unpack_rows(problem, x_free)))

    iterate: do while (.not. report%converged())
      if (report%iterations >= controls%max_sweeps) then
        report%ending = ended_at_limit
        exit iterate
      end if
      new = old
      call sweep_points(problem, x_free, controls, template, solve_point, new, sweep)
      report%iterations = report%iterations + 1
      report%products = report%products + 1
      report%local_iterations = report%local_iterations + sweep%local_iterations
      if (scale <= 0.0_wp) scale = norm2(new)
      if (largest <= 0.0_wp) largest = exploded*norm2(new)
      if (.not. norm2(new) <= largest) then
        report%ending = ended_diverging
        exit iterate
      end if
      if (controls%stop_rule == stop_at_change) then
        if (sweep%change <= controls%tolerance*norm2(new)) then
          call judge(problem, x_free, new, r_start, controls, r, report)
          report%ending = ended_well
          exit iterate
        end if
        if (mod(report%iterations, check_every) == 0) then
          call judge(problem, x_free, new, r_start, controls, r, report)
          if (report%ending == ended_stalled) exit iterate
        end if
      else if (due(sweep, controls, norm2(new), scale, report%iterations)) then
        call judge(problem, x_free, new, r_start, controls, r, report)
        if (report%converged() .or. report%ending == ended_stalled) exit iterate
      end if
      if (controls%acceleration) then
        call next_start(problem, memory, sweep, new, old)
      else
        old = new
      end if
    end do iterate
    if (controls%stop_rule == stop_at_change .and. report%ending == ended_at_limit) then
      call judge(problem, x_free, new, r_start, controls, r, report)
    end if
    report%solver = solver_sweeps
  end subroutine solve_by_sweeps

  !> Whether the exact residual, a product with W, is worth its price: what the sweep saw in passing
  !> is small enough, or the last one is long ago.
  pure logical function due(sweep, controls, size_r, scale, iterations)
    type(sweep_t), intent(in) :: sweep
    type(contact_controls_t), intent(in) :: controls
    real(wp), intent(in) :: size_r, scale  !! |r| now, force scale at the start [force]
    integer, intent(in) :: iterations

    due = sweep%seen_residual <= controls%tolerance*max(size_r, scale) .or. &
      mod(iterations, check_every) == 0
  end function due

  !> Measure reactions exactly; keep them when they are the best so far, notice when nothing
  !> improves.
  subroutine judge(problem, x_free, packed, r_start, controls, r, report)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: x_free(:), packed(:)      !! (n_rows)
    real(wp), intent(in) :: r_start(:, :)             !! (3,n_points)
    type(contact_controls_t), intent(in) :: controls
    real(wp), intent(inout) :: r(:, :)                !! (3,n_points) best so far [force]
    type(contact_report_t), intent(inout) :: report
    type(contact_report_t) :: here

    call measure(problem, x_free, relative_gaps(problem, x_free, packed), packed, r_start, here)
    if (controls%shows_progress) call show_progress('sweep', report%iterations, here%residual)
    report%products = report%products + 1
    if (here%residual < 0.9_wp*report%lowest_residual) then
      report%lowest_residual = here%residual
      report%improved_at = report%iterations
    end if
    if (here%residual < report%residual .or. controls%stop_rule == stop_at_change) then
      report%residual = here%residual
      report%worst_point = here%worst_point
      r = unpack_rows(problem, packed)
    end if
    if (report%iterations - report%improved_at >= patience) report%ending = ended_stalled
    if (controls%stop_rule == stop_at_change) return
    if (report%residual <= controls%tolerance) report%ending = ended_well
  end subroutine judge

  !> Where the next sweep starts: Anderson's combination, made admissible; plainly at the last image
  !> when the combination has led away.
  subroutine next_start(problem, memory, sweep, image, r)
    type(contact_problem_t), intent(in) :: problem
    type(anderson_t), intent(inout) :: memory
    type(sweep_t), intent(in) :: sweep
    real(wp), intent(in) :: image(:)     !! (n_rows) where the sweep ended [force]
    real(wp), intent(inout) :: r(:)      !! (n_rows) where it started in, where the next starts out
    real(wp) :: next(size(r))

    if (memory%started) then
      if (sweep%change > 2.0_wp*norm2(memory%distance)) call forget(memory)
    end if
    call accelerate(memory, r, image, next)
    r = pack_rows(problem, project_reactions(problem, unpack_rows(problem, next)))
  end subroutine next_start

  !> The local solver and the formulation the deck has chosen.
  subroutine choose_local_solver(controls, template, solve_point)
    type(contact_controls_t), intent(in) :: controls
    type(local_point_t), intent(out) :: template
    procedure(local_solver), pointer, intent(out) :: solve_point
    logical :: bipotential

    bipotential = controls%formulation == formulation_bipotential
    if (bipotential) then
      template%residual => bipotential_residual
    else
      template%residual => pseudopotential_residual
    end if
    select case (controls%local)
    case (local_uzawa)
      solve_point => solve_pseudopotential_uzawa
      if (bipotential) solve_point => solve_bipotential_uzawa
    case (local_newton6)
      solve_point => solve_newton6
    case (local_exact)
      solve_point => solve_exact
    case (local_newton)
      solve_point => solve_newton
    case default
      solve_point => solve_nothing
    end select
  end subroutine choose_local_solver

  !> Of a local solver that is not known: its forces end the sweeps as diverging ones.
  pure subroutine solve_nothing(point, r, iterations, converged)
    type(local_point_t), intent(in) :: point
    real(wp), intent(inout) :: r(3)
    integer, intent(out) :: iterations
    logical, intent(out) :: converged

    r = undefined*point%w(:, 1)
    iterations = 1
    converged = .true. ! no other solver takes its place
  end subroutine solve_nothing

  !> One visit to every point, in the order of the points.
  subroutine sweep_points(problem, x_free, controls, template, solve_point, packed, sweep)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: x_free(:)
    type(contact_controls_t), intent(in) :: controls
    type(local_point_t), intent(in) :: template
    procedure(local_solver), pointer, intent(in) :: solve_point
    real(wp), contiguous, intent(inout) :: packed(:) !! (n_rows) reactions [force]
    type(sweep_t), intent(out) :: sweep
    type(local_point_t) :: point
    real(wp) :: r(3), r_old(3), x(3), p(3)
    integer :: i, a, row, status, iterations
    logical :: converged

    point = template
    do i = 1, problem%n_points
      call freeze(problem, x_free, packed, i, r_old, x)
      point%mu = problem%mu(i)
      if (allocated(problem%law)) point%law = problem%law(i)
      point%stays = problem%stays(i)
      point%w = problem%block(:, :, i)
      do a = 1, 2
        if (abs(problem%driven(a, i)) > 0.0_wp) point%w(1 + a, 1 + a) = 0.0_wp
      end do
      point%x_loc = x - matmul(point%w, r_old)
      point%rho = controls%rho*problem%rho(i)
      point%rho_n = controls%rho*problem%rho_n(i)
      point%rho_t = controls%rho*problem%rho_t(i)
      call project_prediction(mu_at(problem, i, r_old(1)), point%stays, problem%rho_map(i), r_old, &
        x, p, status)
      sweep%seen_residual = sweep%seen_residual + sum((r_old - p)**2)

      r = r_old
      ! What is driven cannot stick, and only the exact solution knows that.
      converged = .not. any(abs(problem%driven(:, i)) > 0.0_wp)
      iterations = 0
      if (converged) call solve_point(point, r, iterations, converged)
      sweep%local_iterations = sweep%local_iterations + iterations
      if (.not. converged) then
        ! Newton may cycle where the law has a kink: the exact solution never does.
        call solve_exact(point, r, iterations, converged)
        sweep%local_iterations = sweep%local_iterations + iterations
      end if
      ! A point projected to 0 is set to 0, unrelaxed: else lift-off never converges.
      if (abs(r(1)) > 0.0_wp) r = r_old + controls%relaxation*(r - r_old)
      do a = 1, 3
        row = problem%row(a, i)
        if (row > 0) packed(row) = r(a)
      end do
      sweep%change = sweep%change + sum((r - r_old)**2)
    end do
    sweep%change = sqrt(sweep%change)
    sweep%seen_residual = sqrt(sweep%seen_residual)
  end subroutine sweep_points

  !> Reaction and x of point i as they are now: one pass over its rows of W.
  subroutine freeze(problem, x_free, packed, i, r, x)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: x_free(:)
    real(wp), contiguous, intent(in) :: packed(:)
    integer, intent(in) :: i
    real(wp), intent(out) :: r(3), x(3)
    integer :: a, row

    r = 0.0_wp
    x = 0.0_wp
    do a = 1, 3
      row = problem%row(a, i)
      if (row == 0) then
        if (a > 1) x(a) = problem%driven(a - 1, i)
        cycle
      end if
      r(a) = packed(row)
      if (allocated(problem%couplings%other)) then
        x(a) = x_free(row) + coupled_product(problem%compliance, problem%couplings, &
          problem%row, i, row, packed)
      else
        x(a) = x_free(row) + row_product(problem%compliance, row, packed)
      end if
    end do
    do a = 1, 2
      if (abs(problem%driven(a, i)) > 0.0_wp) r(1 + a) = driven_friction(mu_at(problem, i, &
        r(1)), r(1), x(2:), a)
    end do
  end subroutine freeze

end module sweeps_mod
