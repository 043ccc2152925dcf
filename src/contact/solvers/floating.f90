!> What free rigid motions of bodies make of a contact problem: its compliance without pins.
!>
!>     x = W_p r + G a + x_free,      G^T r + load = 0
!>
!> W_p is the compliance with the bodies pinned, G what the motions do at the contact rows, a how
!> far they go. With Q an orthonormal basis of the range of G and P = I - Q Q^T this is
!>
!>     x = W_c r + Q b + x',   W_c = P W_p P,   Q^T r + q = 0
!>
!> where the pins have no influence any more. A motion that contact does not see (in the null space
!> of G) stays where it is.
!>
!> A motion is neutral that contact does not see where the undeformed bodies are. About the axis of
!> a round obstacle it is seen a little once normals have turned, which is of second order: neither
!> does it move the contact then, nor is it balanced by it.
!> docs/theory.md section 9.
module floating_mod
  use kinds_mod, only: wp
  use blas_mod, only: dgemm
  use dense_mod, only: singular_values, null_space, range_basis
  use increment_report_mod, only: status_stick, status_slide
  use compliance_mod, only: compliance_t, product_of_columns, largest_row_sum, add_symmetric, &
    add_square
  use problem_mod, only: contact_problem_t, unpack_rows, natural_map
  implicit none
  private

  public :: floating_t, see_motions, sees_less, free_the_motions, shift_of, part_points, &
    resisting_rows, pressing_rows

  real(wp), parameter :: unseen = 1.0e-10_wp   !! of the largest singular value of G: not seen
  real(wp), parameter :: stiffer = 1.0e-3_wp   !! of the pinned compliance: the least of theta

  !> What belongs to the motions of a contact problem, beside its compliance.
  type :: floating_t
    integer :: n = 0        !! motions
    integer :: n_seen = 0   !! independent ones that contact sees
    real(wp), allocatable :: g(:, :)     !! (n_rows,n) [-]
    real(wp), allocatable :: neutral(:, :) !! (n,k) orthonormal motions that contact cannot see [-]
    real(wp), allocatable :: q(:, :)     !! (n_rows,n_seen) orthonormal [-]
    real(wp), allocatable :: back(:, :)  !! (n,n_seen) a = back b: G back = Q [-]
    real(wp), allocatable :: w_q(:, :)   !! (n_rows,n_seen) W_p Q [length/force]
    real(wp) :: theta = 0.0_wp           !! of the proximal term [length/force]
  end type floating_t

contains

  !> What contact sees of the motions, and no more.
  subroutine see_motions(g, undeformed_g, floating)
    real(wp), intent(in) :: g(:, :)     !! (n_rows,n) what each motion does at the rows [-]
    real(wp), intent(in) :: undeformed_g(:, :)
    !! (m,n) the same before anything moved, at all rows that there may be [-]
    type(floating_t), intent(out) :: floating

    floating%n = size(g, 2)
    floating%g = g
    floating%neutral = null_space(undeformed_g, unseen)
  end subroutine see_motions

  !> Whether rows see motions much worse than all rows did before anything moved, or not at all.
  logical function sees_less(g, undeformed_g)
    real(wp), intent(in) :: g(:, :)            !! (n_rows,n) what each motion does there [-]
    real(wp), intent(in) :: undeformed_g(:, :) !! (m,n) as of see_motions [-]
    real(wp), parameter :: much = 0.01_wp      !! of how well all rows do [-]
    real(wp) :: here(size(g, 2)), before(size(g, 2)), v(size(g, 2), size(g, 2))
    real(wp), allocatable :: neutral(:, :)
    logical :: ok
    integer :: n

    sees_less = .true.
    call singular_values(undeformed_g, before, v, ok)
    if (.not. ok) return
    n = count(before > unseen*before(1))
    if (n == 0 .or. size(g, 1) < n) return
    neutral = v(:, n + 1:)
    call singular_values(g - matmul(matmul(g, neutral), transpose(neutral)), here, v, ok)
    if (ok) sees_less = here(n)*before(1) < much*before(n)*here(1)
  end function sees_less

  !> From the pinned compliance to that of the proximal problem.
  subroutine free_the_motions(g, undeformed_g, compliance, floating)
    real(wp), intent(in) :: g(:, :)     !! (n_rows,n) what each motion does at the rows [-]
    real(wp), intent(in) :: undeformed_g(:, :) !! (m,n) as of see_motions [-]
    type(compliance_t), intent(inout) :: compliance
    !! over the rows, W_p in, W_c + theta Q Q^T out [length/force]
    type(floating_t), intent(out) :: floating
    real(wp), allocatable :: q_w(:, :), both(:, :)
    real(wp) :: flexibility
    integer :: n

    n = size(g, 1)
    flexibility = largest_row_sum(compliance)
    call see_motions(g, undeformed_g, floating)
    call range_basis(g - matmul(matmul(g, floating%neutral), transpose(floating%neutral)), unseen, &
      floating%q, floating%back)
    floating%n_seen = size(floating%q, 2)
    associate (m => floating%n_seen)
      allocate (floating%w_q(n, m))
      if (m == 0) return
      call product_of_columns(compliance, floating%q, floating%w_q)
      ! P W P = W - Q (W Q)^T - (W Q) Q^T + Q (Q^T W Q) Q^T
      allocate (q_w(m, m), both(n, m))
      call dgemm('T', 'N', m, m, n, 1.0_wp, floating%q, n, floating%w_q, n, 0.0_wp, q_w, m)
      both = floating%w_q
      call dgemm('N', 'N', n, m, m, -0.5_wp, floating%q, n, q_w, m, 1.0_wp, both, n)
      call add_symmetric(compliance, -1.0_wp, floating%q, both)
    end associate
    ! As compliant as the bodies themselves at their softest. Where statics alone determines the
    ! reactions W_c is 0 and the pinned bodies give the scale; of bodies that do not give, any.
    floating%theta = max(largest_row_sum(compliance), stiffer*flexibility)
    if (floating%theta <= 0.0_wp) floating%theta = 1.0_wp
    call add_square(compliance, floating%theta, floating%q)
  end subroutine free_the_motions

  !> Q^T W P r: by how much b differs from the motion proper.
  pure function shift_of(floating, packed) result(shift)
    type(floating_t), intent(in) :: floating
    real(wp), intent(in) :: packed(:)    !! (n_rows) reactions [force]
    real(wp) :: shift(floating%n_seen)   !! [length]

    shift = matmul(packed - matmul(floating%q, matmul(packed, floating%q)), floating%w_q)
  end function shift_of

  !> Move a centre to a place where no point overlaps its obstacle: each that does is mirrored in
  !> it, along the motions, until none does.
  pure subroutine part_points(gap, q, centre, is_parted)
    real(wp), intent(in) :: gap(:)        !! (n) normal gaps at centre 0 [length]
    real(wp), intent(in) :: q(:, :)       !! (n,n_seen) what the motions do to them [-]
    real(wp), intent(inout) :: centre(:)  !! (n_seen) [length]
    logical, intent(out) :: is_parted     !! else none was found
    integer, parameter :: most_rounds = 100
    real(wp) :: overlap
    integer :: round, i

    do round = 1, most_rounds
      is_parted = .true.
      do i = 1, size(gap)
        overlap = -gap(i) - dot_product(q(i, :), centre)
        if (overlap <= 0.0_wp .or. .not. norm2(q(i, :)) > 0.0_wp) cycle
        centre = centre + 2.0_wp*overlap/dot_product(q(i, :), q(i, :))*q(i, :)
        is_parted = .false.
      end do
      if (is_parted) return
    end do
  end subroutine part_points

  !> What the free motions do where there is resistance: a row a direction in which a point presses
  !> or sticks, and, where asked for, in which one that slides would slide another way.
  function resisting_rows(problem, floating, r, gaps, with_sliding) result(resisting)
    type(contact_problem_t), intent(in) :: problem
    type(floating_t), intent(in) :: floating
    real(wp), intent(in) :: r(:, :)         !! (3,n_points) n, t1, t2 [force]
    real(wp), intent(in) :: gaps(:)         !! (n_rows) gaps and slips [length]
    logical, intent(in) :: with_sliding
    real(wp), allocatable :: resisting(:, :) !! (m,n) [-]
    real(wp), dimension(3, problem%n_points) :: x, z
    real(wp) :: rows(problem%n_rows, floating%n)
    integer :: status(problem%n_points), i, a, n

    x = unpack_rows(problem, gaps)
    call natural_map(problem, x, r, z, status)
    n = 0
    do i = 1, problem%n_points
      if (.not. (any(abs(r(:, i)) > 0.0_wp) .or. problem%stays(i))) cycle
      associate (row => problem%row(:, i), g => floating%g)
        n = n + 1
        rows(n, :) = g(row(1), :)
        if (status(i) == status_slide .and. all(row > 0) .and. with_sliding) then
          n = n + 1
          rows(n, :) = (r(2, i)*g(row(3), :) - r(3, i)*g(row(2), :))/ &
            max(norm2(r(2:, i)), tiny(1.0_wp))
        else if (status(i) == status_stick) then
          do a = 2, 3
            if (row(a) == 0) cycle
            n = n + 1
            rows(n, :) = g(row(a), :)
          end do
        end if
      end associate
    end do
    resisting = rows(:n, :) - matmul(matmul(rows(:n, :), floating%neutral), &
      transpose(floating%neutral))
  end function resisting_rows

  !> What the motions do along the normals of points that press.
  pure function pressing_rows(problem, floating, r) result(pressing)
    type(contact_problem_t), intent(in) :: problem
    type(floating_t), intent(in) :: floating
    real(wp), intent(in) :: r(:, :)         !! (3,n_points) n, t1, t2 [force]
    real(wp), allocatable :: pressing(:, :) !! (m,n) [-]
    integer :: i

    associate (rows => floating%g(pack(problem%row(1, :), [(any(abs(r(:, i)) > 0.0_wp), i=1, &
               problem%n_points)]), :))
      pressing = rows - matmul(matmul(rows, floating%neutral), transpose(floating%neutral))
    end associate
  end function pressing_rows

end module floating_mod
