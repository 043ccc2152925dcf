!> Symmetric matrices of blocks on the diagonal: what bodies that nothing joins do to themselves.
!>
!> Outside of its blocks a matrix is 0 and not kept. Of one block it is the dense matrix itself.
module block_diagonal_mod
  use kinds_mod, only: wp
  use blas_mod, only: daxpy
  use dense_mod, only: invert_spd, times_symmetric, norm_1
  implicit none
  private

  public :: block_diagonal_t, take_blocks, invert_blocks, times_blocks, norm_of_blocks, &
    entry_of, add_column, subtract_products, order_of, count_entries

  !> A block, all of it.
  type :: block_t
    real(wp), allocatable :: a(:, :)
  end type block_t

  !> Block k has the rows and columns first(k) to first(k+1) - 1.
  type :: block_diagonal_t
    private
    integer, allocatable :: first(:)        !! (n_blocks+1) ascending, from 1 to n + 1
    integer, allocatable :: block_of(:)     !! (n) of each row
    type(block_t), allocatable :: block(:)
  end type block_diagonal_t

contains

  !> The blocks of a dense matrix, which is spent: one block is not copied.
  subroutine take_blocks(a, first, blocks)
    real(wp), allocatable, intent(inout) :: a(:, :) !! (n,n) not allocated afterwards
    integer, intent(in) :: first(:)                 !! (n_blocks+1) as of block_diagonal_t
    type(block_diagonal_t), intent(out) :: blocks
    integer :: k

    blocks%first = first
    allocate (blocks%block(size(first) - 1), blocks%block_of(size(a, 1)))
    do k = 1, size(blocks%block)
      blocks%block_of(first(k):first(k + 1) - 1) = k
    end do
    if (size(blocks%block) == 1) then
      call move_alloc(a, blocks%block(1)%a)
      return
    end if
    do k = 1, size(blocks%block)
      associate (i => first(k), j => first(k + 1) - 1)
        allocate (blocks%block(k)%a(j - i + 1, j - i + 1))
        blocks%block(k)%a(:, :) = a(i:j, i:j)
      end associate
    end do
    deallocate (a)
  end subroutine take_blocks

  !> Replace a positive definite matrix by its inverse.
  subroutine invert_blocks(blocks, positive_definite)
    type(block_diagonal_t), intent(inout) :: blocks !! destroyed where not positive definite
    logical, intent(out) :: positive_definite       !! to working precision
    integer :: k

    positive_definite = .true.
    do k = 1, size(blocks%block)
      call invert_spd(blocks%block(k)%a, positive_definite)
      if (.not. positive_definite) return
    end do
  end subroutine invert_blocks

  !> A x.
  function times_blocks(blocks, x) result(y)
    type(block_diagonal_t), intent(in) :: blocks
    real(wp), contiguous, intent(in) :: x(:) !! (n)
    real(wp) :: y(size(x))
    integer :: k

    do k = 1, size(blocks%block)
      associate (i => blocks%first(k), j => blocks%first(k + 1) - 1)
        y(i:j) = times_symmetric(blocks%block(k)%a, x(i:j))
      end associate
    end do
  end function times_blocks

  !> The largest sum of the sizes of a column's entries.
  real(wp) function norm_of_blocks(blocks) result(norm)
    type(block_diagonal_t), intent(in) :: blocks
    integer :: k

    norm = 0.0_wp
    do k = 1, size(blocks%block)
      norm = max(norm, norm_1(blocks%block(k)%a))
    end do
  end function norm_of_blocks

  !> a_ij, 0 outside of the blocks.
  pure real(wp) function entry_of(blocks, i, j)
    type(block_diagonal_t), intent(in) :: blocks
    integer, intent(in) :: i, j

    entry_of = 0.0_wp
    associate (k => blocks%block_of(j))
      if (blocks%block_of(i) == k) entry_of = blocks%block(k)%a(i - blocks%first(k) + 1, &
        j - blocks%first(k) + 1)
    end associate
  end function entry_of

  !> y + factor times column j.
  subroutine add_column(blocks, j, factor, y)
    type(block_diagonal_t), intent(in) :: blocks
    integer, intent(in) :: j
    real(wp), intent(in) :: factor
    real(wp), contiguous, intent(inout) :: y(:) !! (n)

    associate (k => blocks%block_of(j))
      associate (first => blocks%first(k), last => blocks%first(k + 1) - 1)
        call daxpy(last - first + 1, factor, blocks%block(k)%a(:, j - first + 1), 1, &
          y(first:last), 1)
      end associate
    end associate
  end subroutine add_column

  !> Subtract Z C Z^T, with a symmetric C of each block.
  pure subroutine subtract_products(blocks, z, core)
    type(block_diagonal_t), intent(inout) :: blocks
    real(wp), intent(in) :: z(:, :)       !! (n,m)
    real(wp), intent(in) :: core(:, :, :) !! (m,m,n_blocks)
    integer :: k

    do k = 1, size(blocks%block)
      associate (of_block => z(blocks%first(k):blocks%first(k + 1) - 1, :))
        blocks%block(k)%a = blocks%block(k)%a - matmul(matmul(of_block, core(:, :, k)), &
          transpose(of_block))
      end associate
    end do
  end subroutine subtract_products

  !> Rows, and columns.
  pure integer function order_of(blocks)
    type(block_diagonal_t), intent(in) :: blocks

    order_of = size(blocks%block_of)
  end function order_of

  !> Entries that are kept; none before there are blocks.
  pure real(wp) function count_entries(blocks)
    type(block_diagonal_t), intent(in) :: blocks

    count_entries = 0.0_wp
    if (.not. allocated(blocks%first)) return
    count_entries = sum(real(blocks%first(2:) - blocks%first(:size(blocks%first) - 1), wp)**2)
  end function count_entries

end module block_diagonal_mod
