!> A centre of the search for free rigid motions: its proximal problem solved, and what that leaves
!> out of balance.
!>
!>     x = (W_c + theta Q Q^T) r + x' + Q (c + theta q),   e(c) = Q^T r(c) + q
!>
!> docs/theory.md section 9.
module floating_centre_mod
  use kinds_mod, only: wp
  use blas_mod, only: dgemm
  use controls_mod, only: contact_controls_t, solver_auto, solver_global_newton
  use compliance_mod, only: is_map
  use increment_report_mod, only: not_ended
  use problem_mod, only: contact_problem_t, contact_report_t, pack_rows
  use global_newton_mod, only: response_to_shifts
  use floating_mod, only: floating_t
  use solve_mod, only: solve_contact
  implicit none
  private

  public :: drift_t, centre_t, solve_at_centre, sees_nothing, find_resistance, excusable

  real(wp), parameter :: excusable = 1.0e-3_wp !! of a load along a motion, beside large reactions
  real(wp), parameter :: tightest = 1.0e-14_wp !! tolerance of the proximal problems [-]
  real(wp), parameter :: closely = 1.0e-10_wp
  !! the same, which Newton's method soon reaches from looser ones [-]

  !> How far the motions go, and why.
  type :: drift_t
    real(wp), allocatable :: load(:)       !! (n) work of the loads on a unit of each motion [force]
    real(wp), allocatable :: rounding(:)   !! (n) that this work carries [force]
    real(wp), allocatable :: a(:)          !! (n) start in, how far they go out [length]
    real(wp), allocatable :: unbalanced(:) !! (n) out: direction in which nothing balances the loads
    real(wp), allocatable :: turned(:)
    !! (k) out: what turned normals leave on the neutral motions [force]
  end type drift_t

  !> A centre, and what its proximal problem says.
  type :: centre_t
    real(wp), allocatable :: centre(:)     !! (n_seen) [length]
    real(wp), allocatable :: r(:, :)       !! (3,n_points) reactions [force]
    real(wp), allocatable :: e(:)          !! (n_seen) out of balance [force]
    real(wp), allocatable :: left(:)       !! (n) out of balance, along each motion [force]
    real(wp), allocatable :: left_seen(:)  !! (n) of it, what contact sees [force]
    real(wp), allocatable :: turned(:)     !! (k) as of drift_t [force]
    real(wp), allocatable :: small(:)      !! (n) what counts as balance of each motion [force]
    logical  :: is_solved = .false.        !! the contact problem is
  end type centre_t

contains

  !> Solve the proximal problem at a centre, and see what it leaves out of balance.
  subroutine solve_at_centre(problem, floating, x_free, controls, drift, is_leap, now, report)
    type(contact_problem_t), intent(in) :: problem
    type(floating_t), intent(in) :: floating
    real(wp), intent(in) :: x_free(:)              !! (n_rows) there [length]
    type(contact_controls_t), intent(in) :: controls
    type(drift_t), intent(in) :: drift             !! its load and what that is rounded by
    logical, intent(in) :: is_leap                 !! may fail: global Newton is all there is
    type(centre_t), intent(inout) :: now
    !! its reactions to start from in, what the proximal problem says out
    type(contact_report_t), intent(inout) :: report !! gets the counts; converged: it balances
    type(contact_controls_t) :: first_choice
    type(contact_report_t) :: here
    real(wp) :: packed(problem%n_rows), on_motions(floating%n), largest

    first_choice = controls
    if (is_leap .and. controls%solver == solver_auto) first_choice%solver = solver_global_newton
    call solve_contact(problem, x_free, first_choice, now%r, here, is_trial=is_leap)
    call weigh()
    ! The balance of whole bodies sums up what single points leave over: it is asked whether that
    ! is all. With a hundred times as much, eleven scenes took 0 to 5 % more products with W, and
    ! where it was asked always up to 28 %.
    if (here%converged() .and. problem%n_points > 0 .and. &
      all(abs(now%left) <= controls%tolerance*sum(abs(packed)))) then
      call solve_more_closely(problem, x_free, first_choice, now%r, here)
      call weigh()
    end if
    call add_up(here, report)
    now%is_solved = here%converged()
    report%ending = here%ending
    if (now%is_solved .and. .not. all(abs(now%left) <= now%small)) report%ending = not_ended

  contains

    !> What the reactions leave out of balance, and what counts as balance.
    subroutine weigh()
      packed = pack_rows(problem, now%r)
      now%e = matmul(packed, floating%q) + matmul(drift%load, floating%back)
      on_motions = matmul(packed, floating%g)
      now%turned = matmul(on_motions, floating%neutral)
      now%left = on_motions - matmul(floating%neutral, now%turned) + drift%load
      now%left_seen = matmul(matmul(floating%q, now%e), floating%g)
      largest = 0.0_wp
      if (problem%n_points > 0) largest = maxval(norm2(now%r, dim=1))
      now%small = spread(controls%tolerance*largest, 1, floating%n)
      ! Reactions without bound must not make their own balance small: what a load does along a
      ! motion is to be balanced, whatever else presses.
      where (abs(drift%load) > drift%rounding) now%small = min(now%small, &
        excusable*abs(drift%load))
      now%small = max(now%small, 1.0e-14_wp*sum(abs(packed)), drift%rounding)
    end subroutine weigh

  end subroutine solve_at_centre

  !> What is out of balance there, contact does not see.
  pure logical function sees_nothing(centre)
    type(centre_t), intent(in) :: centre

    sees_nothing = all(abs(centre%left_seen) <= centre%small)
  end function sees_nothing

  !> Solve a proximal problem that is solved to the tolerance, as far below it as the same solver
  !> gets without others.
  subroutine solve_more_closely(problem, x_free, controls, r, report)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: x_free(:)       !! (n_rows) [length]
    type(contact_controls_t), intent(in) :: controls
    real(wp), intent(inout) :: r(:, :)      !! (3,n_points) solution in, a closer one out [force]
    type(contact_report_t), intent(inout) :: report !! gets the counts, and the residual
    type(contact_controls_t) :: closer
    type(contact_report_t) :: polish

    closer = controls
    if (closer%solver == solver_auto) closer%solver = solver_global_newton
    closer%tolerance = 0.01_wp*controls%tolerance
    if (closer%solver == solver_global_newton .and. .not. is_map(problem%compliance)) then
      closer%tolerance = min(closely, closer%tolerance)
    end if
    closer%tolerance = max(tightest, closer%tolerance)
    call solve_contact(problem, x_free, closer, r, polish, briefly=.true.)
    report%iterations = report%iterations + polish%iterations
    report%local_iterations = report%local_iterations + polish%local_iterations
    report%products = report%products + polish%products
    report%residual = polish%residual
    report%worst_point = polish%worst_point
  end subroutine solve_more_closely

  !> How the reactions answer the centre, dr/dc, and the balance: -Q^T dr/dc.
  subroutine find_resistance(problem, floating, x_free, controls, r, response, resistance)
    type(contact_problem_t), intent(in) :: problem
    type(floating_t), intent(in) :: floating
    real(wp), intent(in) :: x_free(:)          !! (n_rows) [length]
    type(contact_controls_t), intent(in) :: controls
    real(wp), intent(in) :: r(:, :)            !! (3,n_points) solution at the centre [force]
    real(wp), contiguous, intent(inout) :: response(:, :)   !! (n_rows,n_seen) out [force/length]
    real(wp), contiguous, intent(inout) :: resistance(:, :) !! (n_seen,n_seen) out [force/length]

    call response_to_shifts(problem, x_free, controls, r, floating%q, response)
    associate (q => floating%q, n => problem%n_rows, m => floating%n_seen)
      if (m > 0) call dgemm('T', 'N', m, m, n, -1.0_wp, q, max(1, n), response, max(1, n), &
        0.0_wp, resistance, m)
    end associate
  end subroutine find_resistance

  !> The counts of one proximal problem, added to those before; its state in their place.
  pure subroutine add_up(here, report)
    type(contact_report_t), intent(in) :: here
    type(contact_report_t), intent(inout) :: report

    report%solver = here%solver
    report%residual = here%residual
    report%worst_point = here%worst_point
    report%iterations = report%iterations + here%iterations
    report%local_iterations = report%local_iterations + here%local_iterations
    report%products = report%products + here%products
    report%stages = max(report%stages, here%stages)
    report%wants_exact = report%wants_exact .or. here%wants_exact
  end subroutine add_up

end module floating_centre_mod
