!> The compliance W of a contact problem. Its entries are private: whoever solves asks for products,
!> columns and blocks, for W may be no array: where it would be too large it is a map that says what
!> reactions do, and has neither blocks nor a diagonal. docs/theory.md section 4.
module compliance_mod
  use kinds_mod, only: wp
  use blas_mod, only: ddot, dgemm, dsyrk, dsyr2k
  use dense_mod, only: invert_spd, mirror_lower, times_symmetric, times_transposed
  use norm_estimate_mod, only: norm_estimate_t
  use single_panels_mod, only: single_panels_t, make_panels, times_panels
  use couplings_mod, only: couplings_t, find_couplings
  use compliance_map_mod, only: compliance_map_t
  implicit none
  private

  public :: compliance_t, take_matrix, take_map, take_compliance, are_same, is_map, &
    rows_worth_rounding
  public :: product_with, product_of_columns, rough_product, coupled_product, row_product
  public :: get_matrix, get_column, get_rows, block_of, diagonal_of, get_inverse, couplings_of, &
    largest_row_sum
  public :: add_square, add_symmetric, shift_diagonal, add_rough_copy, rough_rows

  integer, parameter :: rows_worth_rounding = 300 !! from here on a product waits for memory
  integer, parameter :: columns_at_once = 32      !! of a map that is asked for its columns

  !> Symmetric positive semi-definite, both triangles.
  type :: compliance_t
    private
    integer :: n = 0
    real(wp), allocatable :: w(:, :)          !! (n,n) [length/force]; or
    class(compliance_map_t), allocatable :: map
    !! W - left right^T, known by its products
    real(wp), allocatable :: left(:, :), right(:, :) !! (n,k) what was added to a map
    type(single_panels_t) :: rough
    !! the same in single precision, where it is large, for products of few digits
  end type compliance_t

contains

  !> Make it of an array.
  subroutine take_matrix(w, compliance)
    real(wp), allocatable, intent(inout) :: w(:, :)
    !! (n,n) both triangles, moved into the compliance [length/force]
    type(compliance_t), intent(out) :: compliance

    compliance%n = size(w, 1)
    call move_alloc(w, compliance%w)
  end subroutine take_matrix

  !> Make it of a map.
  subroutine take_map(map, n, compliance)
    class(compliance_map_t), allocatable, intent(inout) :: map !! moved into the compliance
    integer, intent(in) :: n                                   !! rows
    type(compliance_t), intent(out) :: compliance

    compliance%n = n
    call move_alloc(map, compliance%map)
    allocate (compliance%left(n, 0), compliance%right(n, 0))
  end subroutine take_map

  !> Move it, without its rough copy.
  subroutine take_compliance(from, to)
    type(compliance_t), intent(inout) :: from
    type(compliance_t), intent(out) :: to

    if (is_map(from)) then
      call take_map(from%map, from%n, to)
      call move_alloc(from%left, to%left)
      call move_alloc(from%right, to%right)
    else
      call take_matrix(from%w, to)
    end if
  end subroutine take_compliance

  !> Whether two are arrays, and the same to the bit.
  pure logical function are_same(one, other)
    type(compliance_t), intent(in) :: one, other

    are_same = allocated(one%w) .and. allocated(other%w) .and. one%n == other%n
    if (are_same) are_same = .not. any(abs(one%w - other%w) > 0.0_wp)
  end function are_same

  !> Whether it is known by its products alone.
  pure logical function is_map(compliance)
    type(compliance_t), intent(in) :: compliance

    is_map = allocated(compliance%map)
  end function is_map

  ! ------------------------------------------------------------------ products

  !> W v.
  function product_with(compliance, v) result(w_v)
    type(compliance_t), intent(in) :: compliance
    real(wp), contiguous, intent(in) :: v(:) !! (n) [force]
    real(wp) :: w_v(size(v))                 !! [length]

    if (is_map(compliance)) then
      w_v = mapped_product(compliance, v, .false.)
    else
      w_v = times_symmetric(compliance%w, v)
    end if
  end function product_with

  !> The same of a map.
  function mapped_product(compliance, v, roughly) result(w_v)
    type(compliance_t), intent(in) :: compliance
    real(wp), intent(in) :: v(:)             !! (n) [force]
    logical, intent(in) :: roughly           !! some digits are enough
    real(wp) :: w_v(size(v))                 !! [length]
    real(wp) :: column(size(v), 1), answer(size(v), 1)

    column(:, 1) = v
    call mapped_columns(compliance, column, roughly, answer)
    w_v = answer(:, 1)
  end function mapped_product

  subroutine mapped_columns(compliance, v, roughly, w_v)
    type(compliance_t), intent(in) :: compliance
    real(wp), intent(in) :: v(:, :)          !! (n,m) [force]
    logical, intent(in) :: roughly
    real(wp), intent(out) :: w_v(:, :)       !! (n,m) [length]
    real(wp) :: added(size(v, 1), size(v, 2)), along(size(compliance%left, 2), size(v, 2))

    call compliance%map%press(v, roughly, w_v)
    associate (n => size(v, 1), m => size(v, 2), k => size(along, 1))
      if (k == 0) return
      added = v
      call dgemm('T', 'N', k, m, n, 1.0_wp, compliance%right, n, added, n, 0.0_wp, along, k)
      call dgemm('N', 'N', n, m, k, 1.0_wp, compliance%left, n, along, k, 0.0_wp, added, n)
    end associate
    w_v = w_v + added
  end subroutine mapped_columns

  !> W V, several columns at once.
  subroutine product_of_columns(compliance, v, w_v)
    type(compliance_t), intent(in) :: compliance
    real(wp), contiguous, intent(in) :: v(:, :)    !! (n,m) [force]
    real(wp), contiguous, intent(inout) :: w_v(:, :) !! (n,m) out [length]

    if (is_map(compliance)) then
      call mapped_columns(compliance, v, .false., w_v)
      return
    end if
    associate (n => compliance%n)
      call times_transposed(n, n, size(v, 2), compliance%w, v, w_v)
    end associate
  end subroutine product_of_columns

  !> W v to the digits of single precision where W is large: for directions, not for residuals.
  function rough_product(compliance, v) result(w_v)
    type(compliance_t), intent(in) :: compliance
    real(wp), contiguous, intent(in) :: v(:) !! (n) [force]
    real(wp) :: w_v(size(v))                 !! [length]

    if (is_map(compliance)) then
      w_v = mapped_product(compliance, v, .true.)
    else if (compliance%rough%n > 0) then
      w_v = times_panels(compliance%rough, v)
    else
      w_v = product_with(compliance, v)
    end if
  end function rough_product

  !> A row times a vector.
  real(wp) function row_product(compliance, row, v)
    type(compliance_t), intent(in) :: compliance
    integer, intent(in) :: row
    real(wp), contiguous, intent(in) :: v(:) !! (n) [force]

    ! W is symmetric: its columns are its rows.
    row_product = ddot(compliance%n, compliance%w(:, row), 1, v, 1)
  end function row_product

  !> A row of a sparse W times a vector.
  pure function coupled_product(compliance, couplings, rows, i, row, v) result(w_v)
    type(compliance_t), intent(in) :: compliance
    type(couplings_t), intent(in) :: couplings
    integer, intent(in) :: rows(:, :)        !! (3,n_points) as of the problem
    integer, intent(in) :: i, row            !! point, and one of its rows
    real(wp), intent(in) :: v(:)             !! (n) [force]
    real(wp) :: w_v                          !! [length]
    integer :: k, b

    w_v = 0.0_wp
    do k = couplings%start(i), couplings%start(i + 1) - 1
      associate (other => rows(:, couplings%other(k)))
        do b = 1, 3
          if (other(b) > 0) w_v = w_v + compliance%w(other(b), row)*v(other(b))
        end do
      end associate
    end do
  end function coupled_product

  ! ------------------------------------------------------------------ parts

  !> All entries, as they are written to files; of a map they are found by as many products.
  subroutine get_matrix(compliance, w)
    type(compliance_t), intent(in) :: compliance
    real(wp), intent(out) :: w(:, :)          !! (n,n) [length/force]
    real(wp), allocatable :: units(:, :), columns(:, :)
    integer :: first, n, j

    if (.not. is_map(compliance)) then
      w = compliance%w
      return
    end if
    allocate (units(compliance%n, columns_at_once), columns(compliance%n, columns_at_once))
    do first = 1, compliance%n, columns_at_once
      n = min(columns_at_once, compliance%n - first + 1)
      units = 0.0_wp
      do j = 1, n
        units(first + j - 1, j) = 1.0_wp
      end do
      call mapped_columns(compliance, units(:, :n), .false., columns(:, :n))
      w(:, first:first + n - 1) = columns(:, :n)
    end do
    ! What rounding leaves of symmetry.
    do j = 1, compliance%n
      w(j, j + 1:) = 0.5_wp*(w(j, j + 1:) + w(j + 1:, j))
      w(j + 1:, j) = w(j, j + 1:)
    end do
  end subroutine get_matrix

  subroutine get_column(compliance, j, column)
    type(compliance_t), intent(in) :: compliance
    integer, intent(in) :: j
    real(wp), intent(out) :: column(:)        !! (n) [length/force]
    real(wp) :: unit(compliance%n)

    if (is_map(compliance)) then
      unit = 0.0_wp
      unit(j) = 1.0_wp
      column = mapped_product(compliance, unit, .false.)
    else
      column = compliance%w(:, j)
    end if
  end subroutine get_column

  !> W over some of its rows, where it is an array.
  subroutine get_rows(compliance, rows, w)
    type(compliance_t), intent(in) :: compliance
    integer, intent(in) :: rows(:)
    real(wp), allocatable, intent(out) :: w(:, :) !! (size(rows),size(rows)) [length/force]

    w = compliance%w(rows, rows)
  end subroutine get_rows

  !> The block of two points, 0 where a row or a column is missing.
  pure function block_of(compliance, row, column) result(block)
    type(compliance_t), intent(in) :: compliance
    integer, intent(in) :: row(3), column(3)  !! 0 where there is none
    real(wp) :: block(3, 3)                   !! [length/force]
    integer :: a, b

    block = 0.0_wp
    do b = 1, 3
      do a = 1, 3
        if (row(a) > 0 .and. column(b) > 0) block(a, b) = compliance%w(row(a), column(b))
      end do
    end do
  end function block_of

  pure function diagonal_of(compliance) result(diagonal)
    type(compliance_t), intent(in) :: compliance
    real(wp) :: diagonal(compliance%n)        !! [length/force]
    integer :: i

    diagonal = [(compliance%w(i, i), i=1, compliance%n)]
  end function diagonal_of

  !> W^-1, where W has a Cholesky factor.
  subroutine get_inverse(compliance, s, regular)
    type(compliance_t), intent(in) :: compliance
    real(wp), allocatable, intent(out) :: s(:, :) !! (n,n) nothing of use where not [force/length]
    logical, intent(out) :: regular

    allocate (s, source=compliance%w)
    call invert_spd(s, regular)
  end subroutine get_inverse

  !> Which points W couples, where it is sparse.
  pure subroutine couplings_of(compliance, rows, couplings)
    type(compliance_t), intent(in) :: compliance
    integer, intent(in) :: rows(:, :)         !! (3,n_points) 0 where there is none
    type(couplings_t), intent(out) :: couplings

    call find_couplings(rows, compliance%w, couplings)
  end subroutine couplings_of

  !> The largest sum of magnitudes in a row: how far unit forces can move one. Of a map it is
  !> estimated, from below, by some products.
  real(wp) function largest_row_sum(compliance) result(largest)
    type(compliance_t), intent(in) :: compliance
    type(norm_estimate_t) :: norm
    real(wp) :: v(compliance%n)

    largest = 0.0_wp
    if (compliance%n == 0) return
    if (.not. is_map(compliance)) then
      largest = maxval(sum(abs(compliance%w), dim=1))
      return
    end if
    ! Symmetric: the sums of rows are those of columns.
    do while (norm%goes_on(v))
      v = mapped_product(compliance, v, .true.)
    end do
    largest = norm%estimate
  end function largest_row_sum

  ! ------------------------------------------------------------------ changes

  !> W + factor A A^T.
  subroutine add_square(compliance, factor, a)
    type(compliance_t), intent(inout) :: compliance
    real(wp), intent(in) :: factor
    real(wp), contiguous, intent(in) :: a(:, :)       !! (n,m)

    if (is_map(compliance)) then
      call add_outer(compliance, factor, a, a)
      return
    end if
    associate (n => compliance%n)
      call dsyrk('L', 'N', n, size(a, 2), factor, a, n, 1.0_wp, compliance%w, n)
    end associate
    call mirror_lower(compliance%w)
  end subroutine add_square

  !> W + factor (A B^T + B A^T).
  subroutine add_symmetric(compliance, factor, a, b)
    type(compliance_t), intent(inout) :: compliance
    real(wp), intent(in) :: factor
    real(wp), contiguous, intent(in) :: a(:, :), b(:, :) !! (n,m)

    if (is_map(compliance)) then
      call add_outer(compliance, factor, a, b)
      call add_outer(compliance, factor, b, a)
      return
    end if
    associate (n => compliance%n)
      call dsyr2k('L', 'N', n, size(a, 2), factor, a, n, b, n, 1.0_wp, compliance%w, n)
    end associate
    call mirror_lower(compliance%w)
  end subroutine add_symmetric

  !> W + factor A B^T, of a map.
  subroutine add_outer(compliance, factor, a, b)
    type(compliance_t), intent(inout) :: compliance
    real(wp), intent(in) :: factor
    real(wp), contiguous, intent(in) :: a(:, :), b(:, :) !! (n,m)

    compliance%left = reshape([compliance%left, factor*a], [compliance%n, &
      size(compliance%left, 2) + size(a, 2)])
    compliance%right = reshape([compliance%right, b], [compliance%n, &
      size(compliance%right, 2) + size(b, 2)])
  end subroutine add_outer

  !> Make the diagonal that of another compliance and something more; its rough copy too.
  subroutine shift_diagonal(compliance, of, shift)
    type(compliance_t), intent(inout) :: compliance
    type(compliance_t), intent(in) :: of
    real(wp), intent(in) :: shift(:)          !! (n) [length/force]
    integer :: i

    do i = 1, compliance%n
      compliance%w(i, i) = of%w(i, i) + shift(i)
    end do
    if (compliance%rough%n > 0) call make_panels(compliance%w, compliance%rough)
  end subroutine shift_diagonal

  !> Round W for products of few digits, where it is large.
  subroutine add_rough_copy(compliance)
    type(compliance_t), intent(inout) :: compliance

    if (is_map(compliance)) return
    if (compliance%n >= rows_worth_rounding) call make_panels(compliance%w, compliance%rough)
  end subroutine add_rough_copy

  !> The rows of that copy, 0 where there is none.
  pure integer function rough_rows(compliance)
    type(compliance_t), intent(in) :: compliance

    rough_rows = compliance%rough%n
  end function rough_rows

end module compliance_mod
