!> Contact that must also hold bodies: their free rigid motions are unknowns beside the reactions.
!>
!>     x = W_p r + G a + x_free,      G^T r + load = 0
!>
!> W_p is the compliance with the bodies pinned, G what the motions do at the contact rows, a how
!> far they go. With Q an orthonormal basis of the range of G and P = I - Q Q^T this is
!>
!>     x = W_c r + Q b + x',   W_c = P W_p P,   Q^T r + q = 0
!>
!> where the pins have no influence any more. The motions are found by a proximal iteration,
!>
!>     b = c + theta (Q^T r + q),      so that x = (W_c + theta Q Q^T) r + x' + Q (c + theta q),
!>
!> a contact problem like any other. Its centre c follows b until the forces balance, or takes a
!> Newton step on Q^T r(c) + q = 0 with the derivative of the solved contact problem where that
!> balances more. A motion that contact does not see (in the null space of G) stays where it is; so
!> does one that nothing drives. Where the force out of balance stays whatever the motion, nothing
!> balances it.
!> docs/theory.md section 9.
module floating_mod
  use kinds_mod, only: wp
  use dense_mod, only: singular_values, solve_least_squares
  use controls_mod, only: contact_controls_t, solver_auto, solver_global_newton
  use step_report_mod, only: ended_unbalanced, ended_stalled
  use problem_mod, only: contact_problem_t, contact_report_t, pack_rows
  use global_newton_mod, only: response_to_shifts
  use solve_mod, only: solve_contact
  implicit none
  private

  public :: floating_t, drift_t, free_the_motions, solve_floating

  real(wp), parameter :: unseen = 1.0e-10_wp   !! of the largest singular value of G: not seen
  real(wp), parameter :: nearly = 10.0_wp      !! of what counts as balance: no drift yet
  integer,  parameter :: max_recentrings = 200
  real(wp), parameter :: stiffer = 1.0e-3_wp   !! of the pinned compliance: the least of theta
  integer,  parameter :: max_worse = 3         !! leaps out of free flight
  integer,  parameter :: patience = 40         !! recentrings that balance nothing
  real(wp), parameter :: longest_leap = 1000.0_wp !! of the way so far
  real(wp), parameter :: tightest = 1.0e-14_wp    !! tolerance of the proximal problems [-]
  real(wp), parameter :: least_damping = 1.0e-12_wp !! of the resistance of the proximal term
  real(wp), parameter :: most_damping = 1.0_wp

  !> What belongs to the motions of a contact problem, beside its compliance.
  type :: floating_t
    integer :: n = 0        !! motions
    integer :: n_seen = 0   !! independent ones that contact sees
    real(wp), allocatable :: g(:, :)     !! (n_rows,n) [-]
    real(wp), allocatable :: q(:, :)     !! (n_rows,n_seen) orthonormal [-]
    real(wp), allocatable :: back(:, :)  !! (n,n_seen) a = back b: G back = Q [-]
    real(wp), allocatable :: w_q(:, :)   !! (n_rows,n_seen) W_p Q [length/force]
    real(wp) :: theta = 0.0_wp           !! of the proximal term [length/force]
  end type floating_t

  !> How far the motions go, and why.
  type :: drift_t
    real(wp), allocatable :: load(:)       !! (n) work of the loads on a unit of each motion [force]
    real(wp), allocatable :: a(:)          !! (n) start in, how far they go out [length]
    real(wp), allocatable :: unbalanced(:) !! (n) out: direction in which nothing balances the loads
  end type drift_t

  interface
    !> BLAS: C = alpha op(A) op(B) + beta C.
    subroutine dgemm(transa, transb, m, n, k, alpha, a, lda, b, ldb, beta, c, ldc)
      import :: wp
      implicit none
      character, intent(in) :: transa, transb
      integer, intent(in) :: m, n, k, lda, ldb, ldc
      real(wp), intent(in) :: alpha, beta, a(lda, *), b(ldb, *)
      real(wp), intent(inout) :: c(ldc, *)
    end subroutine dgemm
  end interface

contains

  !> From the pinned compliance to that of the proximal problem.
  subroutine free_the_motions(g, w, floating)
    real(wp), intent(in) :: g(:, :)     !! (n_rows,n) what each motion does at the rows [-]
    real(wp), intent(inout) :: w(:, :)
    !! (n_rows,n_rows) W_p in, W_c + theta Q Q^T out, both triangles [length/force]
    type(floating_t), intent(out) :: floating
    real(wp) :: s(size(g, 2)), v(size(g, 2), size(g, 2))
    real(wp), allocatable :: q_w(:, :), both(:, :)
    real(wp) :: flexibility
    integer :: i, n
    logical :: ok

    n = size(g, 1)
    flexibility = 0.0_wp
    if (n > 0) flexibility = maxval(sum(abs(w), dim=1))
    floating%n = size(g, 2)
    floating%g = g
    call singular_values(g, s, v, ok)
    if (.not. ok) s = 0.0_wp
    if (floating%n > 0) floating%n_seen = count(s > unseen*s(1))
    associate (m => floating%n_seen)
      allocate (floating%back(floating%n, m), floating%q(n, m), floating%w_q(n, m))
      do i = 1, m
        floating%back(:, i) = v(:, i)/s(i)
      end do
      if (m == 0) return
      call dgemm('N', 'N', n, m, floating%n, 1.0_wp, g, n, floating%back, floating%n, 0.0_wp, &
        floating%q, n)
      call dgemm('N', 'N', n, m, n, 1.0_wp, w, n, floating%q, n, 0.0_wp, floating%w_q, n)
      ! P W P = W - Q (W Q)^T - (W Q) Q^T + Q (Q^T W Q) Q^T
      allocate (q_w(m, m), both(n, m))
      call dgemm('T', 'N', m, m, n, 1.0_wp, floating%q, n, floating%w_q, n, 0.0_wp, q_w, m)
      both = floating%w_q
      call dgemm('N', 'N', n, m, m, -0.5_wp, floating%q, n, q_w, m, 1.0_wp, both, n)
      call dgemm('N', 'T', n, n, m, -1.0_wp, floating%q, n, both, n, 1.0_wp, w, n)
      call dgemm('N', 'T', n, n, m, -1.0_wp, both, n, floating%q, n, 1.0_wp, w, n)
    end associate
    ! As compliant as the bodies themselves at their softest. Where statics alone determines the
    ! reactions W_c is 0 and the pinned bodies give the scale; of bodies that do not give, any.
    floating%theta = max(maxval(sum(abs(w), dim=1)), stiffer*flexibility)
    if (floating%theta <= 0.0_wp) floating%theta = 1.0_wp
    call dgemm('N', 'T', n, n, floating%n_seen, floating%theta, floating%q, n, floating%q, n, &
      1.0_wp, w, n)
  end subroutine free_the_motions

  !> Reactions and motions together.
  !>
  !> Where nothing balances a motion the report says ended_unbalanced, and `drift` along what.
  subroutine solve_floating(problem, floating, x_free, controls, drift, r, report)
    type(contact_problem_t), intent(in) :: problem
    type(floating_t), intent(in) :: floating
    real(wp), intent(inout) :: x_free(:)
    !! (n_rows) at a = 0, in; that of the last proximal problem, out [length]
    type(contact_controls_t), intent(in) :: controls
    type(drift_t), intent(inout) :: drift   !! load and start in, the motions out
    real(wp), intent(inout) :: r(:, :)      !! (3,n_points) warm start in, solution out [force]
    type(contact_report_t), intent(out) :: report
    real(wp), dimension(floating%n_seen) :: q, first, centre, image, best_centre, &
      best_e, e
    real(wp) :: resistance(floating%n_seen, floating%n_seen), damping
    real(wp) :: best_r(3, problem%n_points)
    real(wp), dimension(problem%n_rows) :: x_start, packed
    real(wp), dimension(floating%n) :: left, left_seen
    type(contact_report_t) :: here
    real(wp) :: best, small
    integer :: i, idle, since_best
    logical :: balanced, is_flying

    q = matmul(drift%load, floating%back)
    x_start = x_free + matmul(floating%g, drift%a) - matmul(floating%w_q, q)
    packed = pack_rows(problem, r)
    centre = shift_of(floating, packed)
    first = centre
    best = huge(1.0_wp)
    idle = 0
    since_best = 0
    is_flying = .false.
    damping = least_damping
    drift%unbalanced = 0.0_wp*drift%load
    recentre: do i = 1, max_recentrings
      x_free = x_start + matmul(floating%q, centre + floating%theta*q)
      call solve_closely(problem, x_free, controls, r, here)
      call add_up(here, report)
      packed = pack_rows(problem, r)
      e = matmul(packed, floating%q) + q
      image = centre + floating%theta*e
      left = matmul(packed, floating%g) + drift%load
      small = 0.0_wp
      if (problem%n_points > 0) small = sqrt(maxval(sum(r**2, dim=1)))
      small = max(controls%tolerance*small, 1.0e-14_wp*(sum(abs(packed)) + sum(abs(drift%load))))
      balanced = all(abs(left) <= small)
      report%converged = here%converged .and. balanced
      report%ending = here%ending
      if (balanced .or. .not. here%converged) exit recentre

      ! What contact does not see it cannot balance; what it sees it has not balanced yet.
      report%ending = ended_unbalanced
      if (all(abs(left) <= nearly*small)) report%ending = ended_stalled
      left_seen = matmul(matmul(floating%q, e), floating%g)
      if (norm2(e) < best .or. i == 1) then
        drift%unbalanced = left - left_seen
        if (all(abs(drift%unbalanced) <= small)) drift%unbalanced = matmul(floating%back, e)
      end if
      if (all(abs(left_seen) <= small)) exit recentre
      idle = idle + 1
      if (norm2(e) < 0.99_wp*best) idle = 0
      if (idle >= patience) exit recentre
      since_best = since_best + 1
      if (norm2(e) < best) then
        best = norm2(e)
        best_e = e
        best_centre = centre
        best_r = r
        since_best = 0
        damping = max(least_damping, damping/30.0_wp)
        call find_resistance(problem, floating, x_free, controls, r, resistance)
        is_flying = all(abs(resistance)*floating%theta <= 100.0_wp*least_damping)
      end if
      if (is_flying .and. since_best < max_worse) then
        ! From free flight the first leap goes too far into an obstacle; the next bring it back.
        if (since_best > 0) call find_resistance(problem, floating, x_free, controls, r, &
          resistance)
        centre = centre + damped_step(resistance, e, least_damping/floating%theta)
        if (norm2(centre - first) > longest_leap*norm2(image - first)) then
          centre = first + (centre - first)*(longest_leap*norm2(image - first)/ &
            norm2(centre - first))
        end if
      else
        ! Damped from the best so far, until it balances more: plain steps at the latest.
        if (since_best > 0) damping = min(most_damping, 10.0_wp*damping)
        centre = best_centre + damped_step(resistance, best_e, damping/floating%theta)
        r = best_r
      end if
    end do recentre
    drift%a = drift%a + matmul(floating%back, image - shift_of(floating, packed))
  end subroutine solve_floating

  !> Solve a proximal problem to the tolerance, and then as far below it as the same solver gets
  !> without others: the balance of whole bodies sums up what single points leave over.
  subroutine solve_closely(problem, x_free, controls, r, report)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: x_free(:)       !! (n_rows) [length]
    type(contact_controls_t), intent(in) :: controls
    real(wp), intent(inout) :: r(:, :)      !! (3,n_points) warm start in, solution out [force]
    type(contact_report_t), intent(out) :: report
    type(contact_controls_t) :: closer
    type(contact_report_t) :: polish

    call solve_contact(problem, x_free, controls, r, report)
    if (.not. report%converged .or. problem%n_points == 0) return
    closer = controls
    if (closer%solver == solver_auto) closer%solver = solver_global_newton
    closer%tolerance = max(tightest, 0.01_wp*controls%tolerance)
    call solve_contact(problem, x_free, closer, r, polish)
    report%iterations = report%iterations + polish%iterations
    report%local_iterations = report%local_iterations + polish%local_iterations
    report%products = report%products + polish%products
    report%residual = polish%residual
    report%worst_point = polish%worst_point
  end subroutine solve_closely

  !> How the balance answers the centre: -Q^T dr/dc.
  subroutine find_resistance(problem, floating, x_free, controls, r, resistance)
    type(contact_problem_t), intent(in) :: problem
    type(floating_t), intent(in) :: floating
    real(wp), intent(in) :: x_free(:)          !! (n_rows) [length]
    type(contact_controls_t), intent(in) :: controls
    real(wp), intent(in) :: r(:, :)            !! (3,n_points) solution at the centre [force]
    real(wp), intent(out) :: resistance(:, :)  !! (n_seen,n_seen) [force/length]
    real(wp) :: response(problem%n_rows, floating%n_seen)

    call response_to_shifts(problem, x_free, controls, r, floating%q, response)
    resistance = -matmul(transpose(floating%q), response)
  end subroutine find_resistance

  !> A Newton step on e(c) = 0, damped: never infinitely far where nothing resists.
  function damped_step(resistance, e, damping) result(step)
    real(wp), intent(in) :: resistance(:, :)  !! (n_seen,n_seen) [force/length]
    real(wp), intent(in) :: e(:)              !! (n_seen) out of balance [force]
    real(wp), intent(in) :: damping           !! [force/length]
    real(wp) :: step(size(e))                 !! [length]
    real(wp) :: damped(size(e), size(e))
    integer :: i

    damped = resistance
    do i = 1, size(e)
      damped(i, i) = damped(i, i) + damping
    end do
    step = solve_least_squares(damped, e)
  end function damped_step

  !> Q^T W P r: by how much b differs from the motion proper.
  pure function shift_of(floating, packed) result(shift)
    type(floating_t), intent(in) :: floating
    real(wp), intent(in) :: packed(:)    !! (n_rows) reactions [force]
    real(wp) :: shift(floating%n_seen)   !! [length]

    shift = matmul(packed - matmul(floating%q, matmul(packed, floating%q)), floating%w_q)
  end function shift_of

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
  end subroutine add_up

end module floating_mod
