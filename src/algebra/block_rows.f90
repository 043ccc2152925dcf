!> A symmetric sparse matrix of 3 x 3 blocks by its rows, of which the part below the diagonal is
!> kept, and its relaxation by blocks (Gauss-Seidel).
!>
!> Products and sweeps take each block from memory once: for its own row, and transposed for the
!> row of its column.
module block_rows_mod
  use kinds_mod, only: wp
  use sorting_mod, only: order_of_columns, count_below
  use small_matrix_mod, only: inverse
  implicit none
  private

  public :: block_rows_t, find_block, put_block, add_block, join_rows, times_rows, &
    relax_forwards, relax_backwards, take_off_from, stiffen_border

  !> The blocks, row by row.
  type :: block_rows_t
    integer, allocatable :: first(:)          !! (n+1) where each row begins
    integer, allocatable :: column(:)         !! (n_blocks) ascending in each row, less than the row
    real(wp), allocatable :: block(:, :, :)   !! (3,3,n_blocks)
    real(wp), allocatable :: own(:, :, :)     !! (3,3,n) on the diagonal
    real(wp), allocatable :: added(:, :)
    !! (3,n) to their diagonals where they are relaxed with, 0 where nothing is left out of a sweep
    real(wp), allocatable :: inverse(:, :, :) !! (3,3,n) of these, with what is added
  end type block_rows_t

contains

  !> Where a block below the diagonal stands that is in the pattern.
  pure integer function find_block(rows, row, column) result(place)
    type(block_rows_t), intent(in) :: rows
    integer, intent(in) :: row, column !! column < row

    associate (first => rows%first(row), last => rows%first(row + 1) - 1)
      place = first + count_below(column, rows%column(first:last))
    end associate
  end function find_block

  !> Change a block that is in the pattern; one on the diagonal is symmetric and regular.
  pure subroutine put_block(rows, row, column, block)
    type(block_rows_t), intent(inout) :: rows
    integer, intent(in) :: row, column
    real(wp), intent(in) :: block(3, 3)

    if (row == column) then
      rows%own(:, :, row) = block
      rows%added(:, row) = 0.0_wp
      rows%inverse(:, :, row) = inverse(block)
    else if (column < row) then
      rows%block(:, :, find_block(rows, row, column)) = block
    else
      rows%block(:, :, find_block(rows, column, row)) = transpose(block)
    end if
  end subroutine put_block

  !> Add to a block that is in the pattern; one on the diagonal stays symmetric and regular.
  pure subroutine add_block(rows, row, column, block)
    type(block_rows_t), intent(inout) :: rows
    integer, intent(in) :: row, column
    real(wp), intent(in) :: block(3, 3)

    if (row == column) then
      call put_block(rows, row, row, rows%own(:, :, row) + block)
    else if (column < row) then
      associate (here => rows%block(:, :, find_block(rows, row, column)))
        here = here + block
      end associate
    else
      associate (here => rows%block(:, :, find_block(rows, column, row)))
        here = here + transpose(block)
      end associate
    end if
  end subroutine add_block

  !> Take some blocks below the diagonal into the pattern, as zeros where they are new.
  subroutine join_rows(rows, row, column)
    type(block_rows_t), intent(inout) :: rows
    integer, intent(in) :: row(:), column(:) !! (m) of each, column < row; in any order, repeated
    integer, allocatable :: new(:, :), order(:), first(:), columns(:)
    real(wp), allocatable :: blocks(:, :, :)
    integer :: i, j, k, n

    k = count([(.not. is_there(rows, row(i), column(i)), i=1, size(row))])
    if (k == 0) return
    new = reshape([row, column], [2, size(row)], order=[2, 1])
    new = new(:, pack([(i, i=1, size(row))], [(.not. is_there(rows, row(i), column(i)), &
      i=1, size(row))]))
    call order_of_columns(new, order)
    new = new(:, order)
    new = new(:, pack([(i, i=1, k)], [.true., (any(new(:, i) /= new(:, i - 1)), i=2, k)]))
    allocate (first(size(rows%first)), columns(size(rows%column) + size(new, 2)))
    allocate (blocks(3, 3, size(columns)))
    n = 0
    j = 1
    do i = 1, size(first) - 1
      first(i) = n + 1
      do k = rows%first(i), rows%first(i + 1) - 1
        do while (j <= size(new, 2))
          if (new(1, j) /= i .or. new(2, j) > rows%column(k)) exit
          call begin_block(new(2, j))
        end do
        n = n + 1
        columns(n) = rows%column(k)
        blocks(:, :, n) = rows%block(:, :, k)
      end do
      do while (j <= size(new, 2))
        if (new(1, j) /= i) exit
        call begin_block(new(2, j))
      end do
    end do
    first(size(first)) = n + 1
    call move_alloc(first, rows%first)
    call move_alloc(columns, rows%column)
    call move_alloc(blocks, rows%block)

  contains

    subroutine begin_block(of_column)
      integer, intent(in) :: of_column

      n = n + 1
      columns(n) = of_column
      blocks(:, :, n) = 0.0_wp
      j = j + 1
    end subroutine begin_block

  end subroutine join_rows

  !> Whether a block below the diagonal is in the pattern.
  pure logical function is_there(rows, row, column)
    type(block_rows_t), intent(in) :: rows
    integer, intent(in) :: row, column !! column < row
    integer :: place

    place = find_block(rows, row, column)
    is_there = place < rows%first(row + 1)
    if (is_there) is_there = rows%column(place) == column
  end function is_there

  !> y = A x.
  pure subroutine times_rows(rows, x, y)
    type(block_rows_t), intent(in) :: rows
    real(wp), contiguous, intent(in) :: x(:, :)  !! (3,n)
    real(wp), contiguous, intent(out) :: y(:, :) !! (3,n)
    real(wp) :: sums(3), here(3)
    integer :: i, j, k

    do i = 1, size(x, 2)
      here = x(:, i)
      sums = rows%own(:, 1, i)*here(1) + rows%own(:, 2, i)*here(2) + rows%own(:, 3, i)*here(3)
      do k = rows%first(i), rows%first(i + 1) - 1
        j = rows%column(k)
        associate (a => rows%block)
          sums(1) = sums(1) + a(1, 1, k)*x(1, j) + a(1, 2, k)*x(2, j) + a(1, 3, k)*x(3, j)
          sums(2) = sums(2) + a(2, 1, k)*x(1, j) + a(2, 2, k)*x(2, j) + a(2, 3, k)*x(3, j)
          sums(3) = sums(3) + a(3, 1, k)*x(1, j) + a(3, 2, k)*x(2, j) + a(3, 3, k)*x(3, j)
          y(1, j) = y(1, j) + (a(1, 1, k)*here(1) + a(2, 1, k)*here(2) + a(3, 1, k)*here(3))
          y(2, j) = y(2, j) + (a(1, 2, k)*here(1) + a(2, 2, k)*here(2) + a(3, 2, k)*here(3))
          y(3, j) = y(3, j) + (a(1, 3, k)*here(1) + a(2, 3, k)*here(2) + a(3, 3, k)*here(3))
        end associate
      end do
      y(:, i) = sums
    end do
  end subroutine times_rows

  !> One sweep from x = 0, the first row to the last, and what it leaves, b - A x: what is above
  !> the diagonal. Where x has fewer rows than A the others are left out of it, here and backwards.
  pure subroutine relax_forwards(rows, b, x, left)
    type(block_rows_t), intent(in) :: rows
    real(wp), contiguous, intent(in) :: b(:, :)     !! (3,n)
    real(wp), contiguous, intent(out) :: x(:, :)    !! (3,n)
    real(wp), contiguous, intent(out) :: left(:, :) !! (3,n)
    real(wp) :: sums(3), here(3)
    integer :: i, j, k

    do i = 1, size(x, 2)
      sums = b(:, i)
      do k = rows%first(i), rows%first(i + 1) - 1
        j = rows%column(k)
        associate (a => rows%block)
          sums(1) = sums(1) - (a(1, 1, k)*x(1, j) + a(1, 2, k)*x(2, j) + a(1, 3, k)*x(3, j))
          sums(2) = sums(2) - (a(2, 1, k)*x(1, j) + a(2, 2, k)*x(2, j) + a(2, 3, k)*x(3, j))
          sums(3) = sums(3) - (a(3, 1, k)*x(1, j) + a(3, 2, k)*x(2, j) + a(3, 3, k)*x(3, j))
        end associate
      end do
      here = rows%inverse(:, 1, i)*sums(1) + rows%inverse(:, 2, i)*sums(2) + &
        rows%inverse(:, 3, i)*sums(3)
      x(:, i) = here
      left(:, i) = rows%added(:, i)*here
      call take_off(rows, i, here, left)
    end do
  end subroutine relax_forwards

  !> One sweep over all rows, the last to the first.
  pure subroutine relax_backwards(rows, b, x)
    type(block_rows_t), intent(in) :: rows
    real(wp), contiguous, intent(in) :: b(:, :)    !! (3,n)
    real(wp), contiguous, intent(inout) :: x(:, :) !! (3,n)
    real(wp) :: left(3, size(x, 2)), sums(3), here(3)
    integer :: i, j, k

    left = b
    do i = size(x, 2), 1, -1
      sums = left(:, i) + rows%added(:, i)*x(:, i)
      ! Memory is read ahead in one direction alone: blocks go backwards, too.
      do k = rows%first(i + 1) - 1, rows%first(i), -1
        j = rows%column(k)
        associate (a => rows%block)
          sums(1) = sums(1) - (a(1, 1, k)*x(1, j) + a(1, 2, k)*x(2, j) + a(1, 3, k)*x(3, j))
          sums(2) = sums(2) - (a(2, 1, k)*x(1, j) + a(2, 2, k)*x(2, j) + a(2, 3, k)*x(3, j))
          sums(3) = sums(3) - (a(3, 1, k)*x(1, j) + a(3, 2, k)*x(2, j) + a(3, 3, k)*x(3, j))
        end associate
      end do
      here = rows%inverse(:, 1, i)*sums(1) + rows%inverse(:, 2, i)*sums(2) + &
        rows%inverse(:, 3, i)*sums(3)
      x(:, i) = here
      call take_off(rows, i, here, left)
    end do
  end subroutine relax_backwards

  !> Take what a row's unknowns do off the rows before it.
  pure subroutine take_off(rows, i, here, left)
    type(block_rows_t), intent(in) :: rows
    integer, intent(in) :: i
    real(wp), intent(in) :: here(3)                   !! the row's unknowns
    real(wp), contiguous, intent(inout) :: left(:, :) !! (3,n)
    integer :: j, k

    do k = rows%first(i), rows%first(i + 1) - 1
      j = rows%column(k)
      associate (a => rows%block)
        left(1, j) = left(1, j) - (a(1, 1, k)*here(1) + a(2, 1, k)*here(2) + a(3, 1, k)*here(3))
        left(2, j) = left(2, j) - (a(1, 2, k)*here(1) + a(2, 2, k)*here(2) + a(3, 2, k)*here(3))
        left(3, j) = left(3, j) - (a(1, 3, k)*here(1) + a(2, 3, k)*here(2) + a(3, 3, k)*here(3))
      end associate
    end do
  end subroutine take_off

  !> Take what the unknowns of the rows from `first` on do off those before.
  pure subroutine take_off_from(rows, first, x, left)
    type(block_rows_t), intent(in) :: rows
    integer, intent(in) :: first                      !! no block joins those from it on
    real(wp), contiguous, intent(in) :: x(:, :)       !! (3,n)
    real(wp), contiguous, intent(inout) :: left(:, :) !! (3,first-1)
    integer :: i

    do i = first, size(x, 2)
      call take_off(rows, i, x(:, i), left)
    end do
  end subroutine take_off_from

  !> Let sweeps over the rows before `first`, which leave those from it on out, converge: half of
  !> the sums of what joins a row to these is added to its diagonal, in absolute values. With M what
  !> a sweep solves with, M + M^T - A is then no less than the diagonal. Baker, Falgout, Kolev and
  !> Yang, SIAM J. Sci. Comput. 33 (2011) 2864.
  pure subroutine stiffen_border(rows, first)
    type(block_rows_t), intent(inout) :: rows
    integer, intent(in) :: first !! no block joins those from it on
    integer :: i, k, a
    real(wp) :: own(3, 3)

    associate (border => rows%column(rows%first(first):))
      rows%added(:, border) = 0.0_wp
      do k = rows%first(first), size(rows%column)
        associate (of_row => rows%added(:, rows%column(k)))
          of_row = of_row + 0.5_wp*sum(abs(rows%block(:, :, k)), dim=1)
        end associate
      end do
      do k = 1, size(border)
        i = border(k)
        own = rows%own(:, :, i)
        do a = 1, 3
          own(a, a) = own(a, a) + rows%added(a, i)
        end do
        rows%inverse(:, :, i) = inverse(own)
      end do
    end associate
  end subroutine stiffen_border

end module block_rows_mod
