!> Semi-smooth Newton on all contact points at once, with a line search on the residual.
!>
!> 1. Residual Z of the pseudo-potential at every point, branch and derivative of every projection.
!>   2. Points that project to 0: their correction is -r. The others: J dr = -Z.
!>   3. Line search: halve the step until |Z| decreases.
!>
!> docs/theory.md section 4.
module global_newton_mod
  use kinds_mod, only: wp
  use progress_line_mod, only: show_progress
  use controls_mod, only: contact_controls_t, solver_global_newton
  use increment_report_mod, only: ended_well, ended_at_limit, ended_stalled
  use compliance_mod, only: is_map
  use problem_mod, only: contact_problem_t, contact_report_t, relative_gaps, product_with_w, &
    pack_rows, unpack_rows, measure
  use newton_iterate_mod, only: iterate_t, start_at, evaluate, forcing_term
  use newton_correction_mod, only: find_corrections
  implicit none
  private

  public :: solve_by_global_newton, response_to_shifts

  integer,  parameter :: max_iterations = 60
  !! ends a cycle; half as many give the same forces in 370 random decks of the judge
  integer,  parameter :: exact_response = 3000  !! rows up to which responses are factorised
  real(wp), parameter :: tightest_inner = 1.0e-3_wp  !! residuals of GMRES, relative [-]
  real(wp), parameter :: loosest_inner = 1.0e-1_wp
  real(wp), parameter :: shortest_step = 1.0e-3_wp
  real(wp), parameter :: worth_judging = 3.0_wp !! times the tolerance: of iterates of a map
  integer,  parameter :: max_stalled = 12       !! iterations without a tenth of progress
  !! after which other stages follow: with 6 one more of 370 decks needs them, and three get other
  !! reactions where friction leaves several
  integer,  parameter :: trial_stalled = 6      !! the same, of a trial that may fail
  real(wp), parameter :: poor = 0.5_wp          !! of |Z|, left by an iteration that gains little
  real(wp), parameter :: most_wasted = 0.1_wp
  !! products in such iterations, beside the rows: then systems are factorised [-]

contains

  !> Iterate from the warm start until the scaled natural map is at the tolerance.
  !>
  !> Not converging is no error: the report says so and r is the best iterate.
  subroutine solve_by_global_newton(problem, x_free, controls, r, report, is_trial, &
    is_patient)
    type(contact_problem_t), target, intent(in) :: problem
    real(wp), intent(in) :: x_free(:)       !! (n_rows) [length]
    type(contact_controls_t), intent(in) :: controls
    real(wp), intent(inout) :: r(:, :)      !! (3,n_points) warm start in, solution out [force]
    type(contact_report_t), intent(out) :: report
    logical, intent(in), optional :: is_trial   !! may fail, and is given up earlier
    logical, intent(in), optional :: is_patient !! is not given up before the last iteration
    type(iterate_t), target :: now, trial
    type(contact_report_t) :: here
    real(wp) :: r_start(3, problem%n_points), projected(problem%n_rows)
    real(wp) :: dr(problem%n_rows, 1)
    real(wp) :: forcing, last_merit
    integer :: stalled, most_stalled, wasted, before
    logical :: is_rough !! measured before its projection
    logical :: gmres_failed

    last_merit = 0.0_wp
    r_start = r
    now = start_at(problem, x_free, r)
    trial = now
    report%residual = huge(report%residual)
    stalled = 0
    gmres_failed = .false.
    wasted = 0
    most_stalled = max_stalled
    if (present(is_trial)) most_stalled = merge(trial_stalled, max_stalled, is_trial)
    if (present(is_patient)) most_stalled = merge(max_iterations, most_stalled, is_patient)
    newton: do
      ! Judged is what is returned: the projections, on the cone to rounding, 0 where open.
      projected = now%r - now%z
      is_rough = is_map(problem%compliance)
      if (is_rough) then
        ! A product that only tells of an iterate how bad it is can be saved.
        call measure(problem, x_free, now%x, now%r, r_start, here)
        is_rough = here%residual > worth_judging*controls%tolerance
      end if
      if (.not. is_rough) then
        call measure(problem, x_free, relative_gaps(problem, x_free, projected), projected, &
          r_start, here)
        report%products = report%products + 1
      end if
      if (controls%shows_progress) call show_progress('contact iteration', report%iterations, &
        here%residual)
      stalled = stalled + 1
      if (here%residual < 0.9_wp*report%residual) stalled = 0
      if (here%residual < report%residual) then
        report%residual = here%residual
        report%worst_point = here%worst_point
        r = unpack_rows(problem, projected)
      end if
      if (report%residual <= controls%tolerance .and. .not. is_rough) report%ending = ended_well
      if (report%converged() .or. stalled > most_stalled .or. &
        report%iterations >= max_iterations) exit newton

      forcing = forcing_term(now%merit, last_merit, controls%tolerance/report%residual, &
        tightest_inner, loosest_inner)
      last_merit = now%merit
      before = report%products
      call find_corrections(problem, now, reshape(now%z, shape(dr)), controls, forcing, &
        gmres_failed, dr, report%products)
      call search_line(problem, now, dr(:, 1), trial)
      report%products = report%products + 1
      report%iterations = report%iterations + 1
      ! Where bodies are slender a small residual of GMRES says little of the correction's error.
      if (trial%merit > poor*now%merit) wasted = wasted + report%products - before
      if (wasted > most_wasted*problem%n_rows) gmres_failed = .true.
      report%wants_exact = gmres_failed
      now%r = trial%r
      now%x = trial%x
      call evaluate(problem, now)
    end do newton
    if (.not. report%converged()) report%ending = merge(ended_at_limit, ended_stalled, &
      report%iterations >= max_iterations)
    report%solver = solver_global_newton
  end subroutine solve_by_global_newton

  !> How the reactions of a solved problem answer small changes of x_free: dr/dx_free times `q`.
  subroutine response_to_shifts(problem, x_free, controls, r, q, response)
    type(contact_problem_t), target, intent(in) :: problem
    real(wp), intent(in) :: x_free(:)           !! (n_rows) [length]
    type(contact_controls_t), intent(in) :: controls
    real(wp), intent(in) :: r(:, :)             !! (3,n_points) the solution [force]
    real(wp), intent(in) :: q(:, :)             !! (n_rows,m) changes [-]
    real(wp), intent(out) :: response(:, :)     !! (n_rows,m) [force/length]
    type(iterate_t), target :: at

    at = start_at(problem, x_free, r)
    call find_responses(problem, at, exact_controls(problem, controls), q, response)
  end subroutine response_to_shifts

  !> How the Newton step there answers changes of x_free.
  subroutine find_responses(problem, at, controls, q, response)
    type(contact_problem_t), target, intent(in) :: problem
    type(iterate_t), target, intent(in) :: at
    type(contact_controls_t), intent(in) :: controls
    real(wp), intent(in) :: q(:, :)             !! (n_rows,m) changes [-]
    real(wp), intent(out) :: response(:, :)     !! (n_rows,m) [force/length]
    real(wp) :: change(3, problem%n_points), z(problem%n_rows, size(q, 2))
    integer :: i, j, products
    logical :: gmres_failed

    products = 0
    gmres_failed = .false.
    do j = 1, size(q, 2)
      change = unpack_rows(problem, q(:, j))
      do i = 1, problem%n_points
        change(:, i) = matmul(at%dz_dx(:, :, i), change(:, i))
      end do
      z(:, j) = pack_rows(problem, change)
    end do
    call find_corrections(problem, at, z, controls, tightest_inner, gmres_failed, response, &
      products)
  end subroutine find_responses

  !> The same controls, with factorised responses where these can be paid for.
  pure type(contact_controls_t) function exact_controls(problem, controls) result(exactly)
    type(contact_problem_t), intent(in) :: problem
    type(contact_controls_t), intent(in) :: controls

    exactly = controls
    if (problem%n_rows <= exact_response) exactly%factorises = .true.
  end function exact_controls

  !> Halve the step until |Z| decreases.
  subroutine search_line(problem, now, dr, trial)
    type(contact_problem_t), intent(in) :: problem
    type(iterate_t), intent(in) :: now
    real(wp), intent(in) :: dr(:)            !! (n_rows) full step [force]
    type(iterate_t), intent(inout) :: trial
    real(wp) :: dx(problem%n_rows), step

    dx = product_with_w(problem, dr)
    step = 1.0_wp
    do
      trial%r = now%r + step*dr
      trial%x = now%x + step*dx
      call evaluate(problem, trial)
      if (trial%merit <= (1.0_wp - 1.0e-4_wp*step)*now%merit .or. step < shortest_step) exit
      step = 0.5_wp*step
    end do
  end subroutine search_line

end module global_newton_mod
