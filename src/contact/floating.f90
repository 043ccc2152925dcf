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
!> a contact problem like any other, whose centre c follows b until the forces balance. A motion
!> that contact does not see (in the null space of G) stays where it is; so does one that nothing
!> drives. Where b keeps growing at the same force out of balance, nothing balances the motion.
!> docs/theory.md section 8.
module floating_mod
  use kinds_mod, only: wp
  use dense_mod, only: singular_values
  use controls_mod, only: contact_controls_t
  use step_report_mod, only: ended_unbalanced
  use problem_mod, only: contact_problem_t, contact_report_t, pack_rows, add_rank
  use solve_mod, only: solve_contact
  implicit none
  private

  public :: floating_t, free_the_motions, solve_floating

  real(wp), parameter :: unseen = 1.0e-10_wp    !! of the largest singular value of G: not seen
  real(wp), parameter :: slow = 0.3_wp          !! contraction of the imbalance that is too slow
  real(wp), parameter :: steeper = 10.0_wp      !! factor of theta where it is
  integer,  parameter :: max_recentrings = 60
  integer,  parameter :: max_raises = 6
  integer,  parameter :: patience = 3           !! raises without effect: nothing balances

  !> What belongs to the motions of a contact problem, beside its compliance.
  type :: floating_t
    integer :: n = 0        !! motions
    integer :: n_seen = 0   !! independent ones that contact sees
    real(wp), allocatable :: g(:, :)     !! (n_rows,n) [-]
    real(wp), allocatable :: q(:, :)     !! (n_rows,n_seen) orthonormal [-]
    real(wp), allocatable :: back(:, :)  !! (n,n_seen) a = back b: G back = Q [-]
    real(wp), allocatable :: w_q(:, :)   !! (n_rows,n_seen) W_p Q [length/force]
    real(wp) :: theta = 0.0_wp           !! of the proximal term [length/force]
    logical  :: is_raised = .false.      !! the problem's W holds a larger theta: make it anew
  end type floating_t

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
    integer :: i, n
    logical :: ok

    n = size(g, 1)
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
    ! As compliant as the bodies themselves at their softest; of bodies that do not give, any.
    floating%theta = maxval(sum(abs(w), dim=1))
    if (floating%theta <= 0.0_wp) floating%theta = 1.0_wp
    call dgemm('N', 'T', n, n, floating%n_seen, floating%theta, floating%q, n, floating%q, n, &
      1.0_wp, w, n)
  end subroutine free_the_motions

  !> Reactions and motions together.
  !>
  !> Where nothing balances a motion the report says ended_unbalanced, and `imbalance` what is left.
  subroutine solve_floating(problem, floating, x_free, load, controls, a, r, imbalance, report)
    type(contact_problem_t), intent(inout) :: problem !! a larger theta may be left in its W
    type(floating_t), intent(inout) :: floating
    real(wp), intent(inout) :: x_free(:)
    !! (n_rows) at a = 0, in; that of the last proximal problem, out [length]
    real(wp), intent(in) :: load(:)         !! (n) work of the loads on a unit of each motion [force]
    type(contact_controls_t), intent(in) :: controls
    real(wp), intent(inout) :: a(:)         !! (n) start in, how far the motions go out [length]
    real(wp), intent(inout) :: r(:, :)      !! (3,n_points) warm start in, solution out [force]
    real(wp), intent(out) :: imbalance(:)   !! (n) G^T r + load [force]
    type(contact_report_t), intent(out) :: report
    real(wp), dimension(floating%n_seen) :: q, centre, e
    real(wp), dimension(problem%n_rows) :: x_start, packed
    type(contact_report_t) :: here
    real(wp) :: size_e, last, small
    integer :: i, raises, idle
    logical :: balanced

    q = matmul(load, floating%back)
    x_start = x_free + matmul(floating%g, a) - matmul(floating%w_q, q)
    packed = pack_rows(problem, r)
    centre = shift_of(floating, packed)
    last = huge(1.0_wp)
    raises = 0
    idle = 0
    recentre: do i = 1, max_recentrings
      x_free = x_start + matmul(floating%q, centre + floating%theta*q)
      call solve_contact(problem, x_free, controls, r, here)
      call add_up(here, report)
      packed = pack_rows(problem, r)
      e = matmul(packed, floating%q) + q
      imbalance = matmul(packed, floating%g) + load
      centre = centre + floating%theta*e
      small = 0.0_wp
      if (problem%n_points > 0) small = sqrt(maxval(sum(r**2, dim=1)))
      small = max(0.1_wp*controls%tolerance*small, 1.0e-14_wp*(sum(abs(packed)) + sum(abs(load))))
      balanced = all(abs(imbalance) <= small)
      report%converged = here%converged .and. balanced
      report%ending = here%ending
      if (balanced .or. .not. here%converged) exit recentre

      report%ending = ended_unbalanced ! unless this goes on
      ! Only motions that contact does not see are left: no iteration helps.
      if (all(abs(matmul(matmul(floating%q, e), floating%g)) <= small)) exit recentre
      size_e = norm2(e)
      if (size_e > slow*last .and. i > 2) then
        if (size_e > 0.99_wp*last) idle = idle + 1
        if (size_e <= 0.99_wp*last) idle = 0
        if (idle >= patience) exit recentre
        if (raises < max_raises) then
          call raise_theta(problem, floating)
          raises = raises + 1
        end if
      end if
      last = size_e
    end do recentre
    a = a + matmul(floating%back, centre - shift_of(floating, packed))
  end subroutine solve_floating

  !> Q^T W P r: by how much b differs from the motion proper.
  pure function shift_of(floating, packed) result(shift)
    type(floating_t), intent(in) :: floating
    real(wp), intent(in) :: packed(:)    !! (n_rows) reactions [force]
    real(wp) :: shift(floating%n_seen)   !! [length]

    shift = matmul(packed - matmul(floating%q, matmul(packed, floating%q)), floating%w_q)
  end function shift_of

  !> A weaker proximal term: fewer recentrings, a harder problem.
  subroutine raise_theta(problem, floating)
    type(contact_problem_t), intent(inout) :: problem
    type(floating_t), intent(inout) :: floating

    call add_rank(problem, floating%q, (steeper - 1.0_wp)*floating%theta)
    floating%theta = steeper*floating%theta
    floating%is_raised = .true.
  end subroutine raise_theta

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
