!> The stiffness of the contact points as far as it is near, without a Schur complement.
!>
!> The inverse of the interior's stiffness K_ii, which the Schur complement has on the interface c,
!> is taken for two terms of a polynomial in its diagonal D,
!>
!>     S ~ K_cc - a_1 E_1 - a_2 E_2,    E_1 = K_ci D^-1 K_ic,    E_2 = K_ci D^-1 K_ii D^-1 K_ic,
!>
!> which is sparse. The factors a are those with which S W leaves least of some random vectors.
!> docs/theory.md (4.14).
module near_elimination_mod
  use kinds_mod, only: wp, i8
  use near_stiffness_mod, only: near_stiffness_t, keep_near
  use assembly_mod, only: triplets_t, diagonal_of
  implicit none
  private

  public :: elimination_t, begin_elimination, test_forces, fit_elimination, blocks_nearby

  integer,  parameter :: n_tests = 3          !! random vectors
  integer,  parameter :: n_terms = 2          !! of the polynomial
  real(wp), parameter :: least_left = 0.05_wp !! of the diagonal of K_cc, in that of S [-]

  !> Rows of a sparse matrix.
  type :: rows_t
    integer,  allocatable :: first(:)   !! (n+1)
    integer,  allocatable :: column(:)
    real(wp), allocatable :: value(:)
  end type rows_t

  !> A sum of sparse vectors.
  type :: sum_t
    integer :: n = 0
    real(wp), allocatable :: value(:)     !! 0 where it is not listed
    logical,  allocatable :: is_listed(:)
    integer,  allocatable :: listed(:)    !! the first n
  end type sum_t

  !> The parts of K, and of S the row that is made at the moment.
  type :: elimination_t
    private
    type(rows_t) :: cc, ci, ic         !! K_cc, K_ci and its transpose
    type(rows_t) :: ii                 !! K_ii between unknowns that K_ic couples to the interface
    real(wp), allocatable :: d(:)      !! (n_interior) D [force/length]
    real(wp), allocatable :: sums(:)   !! (n_interior) of magnitudes in the rows of K_ii
    real(wp) :: factor(n_terms) = [1.0_wp, 0.0_wp] !! a
    logical :: is_fitted = .false.     !! else K_ii is taken for the diagonal of `sums`: too stiff
    type(sum_t) :: row                 !! of S, over the interface
    type(sum_t) :: beside              !! what stands before K_ic in it, over the interior
  end type elimination_t

contains

  !> Take what the elimination needs from the whole matrix.
  subroutine begin_elimination(k, n_interface, work)
    type(triplets_t), intent(in) :: k   !! with its values, not distributed
    integer, intent(in) :: n_interface  !! the last unknowns
    type(elimination_t), intent(out) :: work
    integer :: n_interior

    n_interior = k%n - n_interface
    call split(k, n_interface, work)
    allocate (work%row%value(n_interface), work%beside%value(n_interior), source=0.0_wp)
    allocate (work%row%is_listed(n_interface), work%beside%is_listed(n_interior), source=.false.)
    allocate (work%row%listed(n_interface), work%beside%listed(n_interior), source=0)
  end subroutine begin_elimination

  !> The forces whose displacements `fit_elimination` asks for.
  subroutine test_forces(work, force)
    type(elimination_t), intent(in) :: work
    real(wp), allocatable, intent(out) :: force(:, :)
    !! (n_interface,(1+n_terms)*n_tests) on the interface [force]
    real(wp) :: v(size(work%row%value), n_tests), u(size(work%d)), w(size(work%d))
    integer :: g

    call make_tests(v)
    allocate (force(size(v, 1), (1 + n_terms)*n_tests))
    do g = 1, n_tests
      force(:, g) = times(work%cc, v(:, g))
      u = times(work%ic, v(:, g))/work%d
      force(:, n_tests + g) = times(work%ci, u)
      w = times(work%ii, u)/work%d
      force(:, 2*n_tests + g) = times(work%ci, w)
    end do
  end subroutine test_forces

  !> Choose the factors. Errors are measured by the energy of K_cc less what is certainly too little
  !> for the interior, so that motions that take no force do not count.
  subroutine fit_elimination(work, moved)
    type(elimination_t), intent(inout) :: work
    real(wp), intent(in) :: moved(:, :) !! the interface under the forces of test_forces [length]
    real(wp) :: v(size(work%row%value), n_tests), weighted(size(v, 1))
    real(wp) :: matrix(n_terms, n_terms), rhs(n_terms), determinant
    integer :: g, i, j

    call make_tests(v)
    matrix = 0.0_wp
    rhs = 0.0_wp
    do g = 1, n_tests
      do i = 1, n_terms
        weighted = times_bound(work, moved(:, i*n_tests + g))
        rhs(i) = rhs(i) + dot_product(weighted, moved(:, g) - v(:, g))
        do j = 1, n_terms
          matrix(j, i) = matrix(j, i) + dot_product(weighted, moved(:, j*n_tests + g))
        end do
      end do
    end do
    determinant = matrix(1, 1)*matrix(2, 2) - matrix(1, 2)*matrix(2, 1)
    work%is_fitted = determinant > epsilon(1.0_wp)*matrix(1, 1)*matrix(2, 2)
    if (.not. work%is_fitted) return
    work%factor = [matrix(2, 2)*rhs(1) - matrix(1, 2)*rhs(2), &
      matrix(1, 1)*rhs(2) - matrix(2, 1)*rhs(1)]/determinant
  end subroutine fit_elimination

  !> The same vectors of 1 and -1 every time.
  pure subroutine make_tests(v)
    real(wp), intent(out) :: v(:, :) !! (n_interface,n_tests) [length]
    integer(i8), parameter :: multiplier = 16807, modulus = 2147483647
    integer(i8) :: seed
    integer :: i, g

    seed = 20071
    do g = 1, size(v, 2)
      do i = 1, size(v, 1)
        seed = mod(multiplier*seed, modulus)
        v(i, g) = merge(1.0_wp, -1.0_wp, 2*seed > modulus)
      end do
    end do
  end subroutine make_tests

  !> The blocks of S at the points, and how far each unknown of the interface gives way alone.
  subroutine blocks_nearby(work, index, near, flexibility)
    type(elimination_t), intent(inout) :: work
    integer, intent(in) :: index(:, :)
    !! (3,n_points) unknowns of the points, counted from the first of the interface, or 0
    type(near_stiffness_t), intent(out) :: near
    real(wp), allocatable, intent(out) :: flexibility(:) !! (n_interface) 1/S_ee [length/force]
    type(near_stiffness_t) :: all
    integer :: i, a, n, n_points, n_interface
    integer, allocatable :: head(:, :), next(:, :), position(:)

    n_points = size(index, 2)
    n_interface = size(work%row%value)
    allocate (flexibility(n_interface))
    do i = 1, n_interface
      call make_row(work, i)
      flexibility(i) = 1.0_wp/work%row%value(i)
      call clear(work%row)
    end do
    ! The points that have an unknown as their first, second or third.
    allocate (head(n_interface, 3), source=0)
    allocate (next(3, n_points), source=0)
    allocate (position(n_points), source=0)
    do i = n_points, 1, -1
      do a = 1, 3
        if (index(a, i) == 0) cycle
        next(a, i) = head(index(a, i), a)
        head(index(a, i), a) = i
      end do
    end do
    n = 30*n_points + 1
    allocate (all%start(n_points + 1), all%other(n), all%block(3, 3, n))
    n = 0
    do i = 1, n_points
      call add_point(i)
    end do
    all%start(n_points + 1) = n + 1
    call keep_near(all, near)

  contains

    subroutine add_point(point)
      integer, intent(in) :: point
      integer :: b, c, e, other

      all%start(point) = n + 1
      call take_block(point)
      do b = 1, 3
        if (index(b, point) == 0) cycle
        call make_row(work, index(b, point))
        do e = 1, work%row%n
          do c = 1, 3
            other = head(work%row%listed(e), c)
            do while (other > 0)
              ! Points that share unknowns hold each other in a way that no block says.
              if (other == point .or. .not. any(index(:, other) > 0 .and. &
                index(:, other) == index(:, point))) then
                if (position(other) < all%start(point)) call take_block(other)
                all%block(b, c, position(other)) = work%row%value(work%row%listed(e))
              end if
              other = next(c, other)
            end do
          end do
        end do
        call clear(work%row)
      end do
    end subroutine add_point

    !> One more block of the point.
    subroutine take_block(other)
      integer, intent(in) :: other
      integer, allocatable :: longer(:)
      real(wp), allocatable :: more(:, :, :)

      if (n == size(all%other)) then
        allocate (longer(2*n), more(3, 3, 2*n))
        longer(:n) = all%other
        more(:, :, :n) = all%block
        call move_alloc(longer, all%other)
        call move_alloc(more, all%block)
      end if
      n = n + 1
      all%other(n) = other
      all%block(:, :, n) = 0.0_wp
      position(other) = n
    end subroutine take_block

  end subroutine blocks_nearby

  !> What of K touches the interface, and the unknowns beside it.
  subroutine split(k, n_interface, work)
    type(triplets_t), intent(in) :: k
    integer, intent(in) :: n_interface
    type(elimination_t), intent(inout) :: work
    real(wp) :: diagonal(k%n)
    integer :: n_interior, pass, c, other
    logical :: is_beside(k%n - n_interface)
    integer(i8) :: entry

    n_interior = k%n - n_interface
    diagonal = diagonal_of(k)
    allocate (work%d(n_interior), source=diagonal(:n_interior))
    allocate (work%sums(n_interior), source=0.0_wp)
    is_beside = .false.
    call begin(work%cc, n_interface)
    call begin(work%ci, n_interface)
    call begin(work%ic, n_interior)
    call begin(work%ii, n_interior)
    do entry = 1, size(k%row, kind=i8)
      c = k%row(entry)
      other = k%column(entry)
      if (c > n_interior .and. other <= n_interior) is_beside(other) = .true.
      if (c > n_interior) cycle
      work%sums(c) = work%sums(c) + abs(k%value(entry))
      if (other /= c) work%sums(other) = work%sums(other) + abs(k%value(entry))
    end do
    do pass = 1, 2
      do entry = 1, size(k%row, kind=i8)
        c = k%row(entry)
        other = k%column(entry)
        if (c <= n_interior) then
          if (.not. (is_beside(c) .and. is_beside(other))) cycle
          call add(work%ii, c, other)
          if (other /= c) call add(work%ii, other, c)
        else if (other <= n_interior) then
          call add(work%ci, c - n_interior, other)
          call add(work%ic, other, c - n_interior)
        else
          call add(work%cc, c - n_interior, other - n_interior)
          if (other /= c) call add(work%cc, other - n_interior, c - n_interior)
        end if
      end do
      call next_pass(work%cc)
      call next_pass(work%ci)
      call next_pass(work%ic)
      call next_pass(work%ii)
    end do

  contains

    subroutine begin(rows, n)
      type(rows_t), intent(inout) :: rows
      integer, intent(in) :: n

      allocate (rows%first(n + 1), source=0)
    end subroutine begin

    !> Count an entry, then put it in its place.
    subroutine add(rows, row, column)
      type(rows_t), intent(inout) :: rows
      integer, intent(in) :: row, column

      if (pass == 2) then
        rows%column(rows%first(row)) = column
        rows%value(rows%first(row)) = k%value(entry)
      end if
      rows%first(row) = rows%first(row) + 1
    end subroutine add

    !> From counts to the beginnings of rows; from their ends to their beginnings.
    subroutine next_pass(rows)
      type(rows_t), intent(inout) :: rows
      integer :: position, n, j

      if (pass == 1) then
        position = 1
        do j = 1, size(rows%first)
          n = rows%first(j)
          rows%first(j) = position
          position = position + n
        end do
        allocate (rows%column(position - 1), rows%value(position - 1))
      else
        do j = size(rows%first), 2, -1
          rows%first(j) = rows%first(j - 1)
        end do
        rows%first(1) = 1
      end if
    end subroutine next_pass

  end subroutine split

  !> A row of S.
  subroutine make_row(work, c)
    type(elimination_t), intent(inout) :: work
    integer, intent(in) :: c
    integer :: k, l, j
    real(wp) :: of_diagonal

    call add(work%row, c, 0.0_wp)
    do k = work%cc%first(c), work%cc%first(c + 1) - 1
      call add(work%row, work%cc%column(k), work%cc%value(k))
    end do
    of_diagonal = work%row%value(c)
    do k = work%ci%first(c), work%ci%first(c + 1) - 1
      j = work%ci%column(k)
      if (.not. work%is_fitted) then
        call add(work%beside, j, work%ci%value(k)/work%sums(j))
        cycle
      end if
      call add(work%beside, j, work%factor(1)*work%ci%value(k)/work%d(j))
      do l = work%ii%first(j), work%ii%first(j + 1) - 1
        call add(work%beside, work%ii%column(l), work%factor(2)*work%ci%value(k)/work%d(j)* &
          work%ii%value(l)/work%d(work%ii%column(l)))
      end do
    end do
    do k = 1, work%beside%n
      j = work%beside%listed(k)
      do l = work%ic%first(j), work%ic%first(j + 1) - 1
        call add(work%row, work%ic%column(l), -work%beside%value(j)*work%ic%value(l))
      end do
    end do
    call clear(work%beside)
    work%row%value(c) = max(work%row%value(c), least_left*of_diagonal)
  end subroutine make_row

  pure subroutine add(sums, i, value)
    type(sum_t), intent(inout) :: sums
    integer, intent(in) :: i
    real(wp), intent(in) :: value

    if (.not. sums%is_listed(i)) then
      sums%n = sums%n + 1
      sums%listed(sums%n) = i
      sums%is_listed(i) = .true.
    end if
    sums%value(i) = sums%value(i) + value
  end subroutine add

  pure subroutine clear(sums)
    type(sum_t), intent(inout) :: sums

    sums%value(sums%listed(:sums%n)) = 0.0_wp
    sums%is_listed(sums%listed(:sums%n)) = .false.
    sums%n = 0
  end subroutine clear

  !> (K_cc - K_ci D^-1 K_ic) v with the sums of rows in D, which is positive definite.
  pure function times_bound(work, v) result(product)
    type(elimination_t), intent(in) :: work
    real(wp), intent(in) :: v(:)        !! (n_interface) [length]
    real(wp) :: product(size(v))        !! [force]

    product = times(work%cc, v) - times(work%ci, times(work%ic, v)/work%sums)
  end function times_bound

  pure function times(rows, v) result(product)
    type(rows_t), intent(in) :: rows
    real(wp), intent(in) :: v(:)
    real(wp) :: product(size(rows%first) - 1)
    real(wp) :: total
    integer :: i, k

    do i = 1, size(product)
      total = 0.0_wp
      do k = rows%first(i), rows%first(i + 1) - 1
        total = total + rows%value(k)*v(rows%column(k))
      end do
      product(i) = total
    end do
  end function times

end module near_elimination_mod
