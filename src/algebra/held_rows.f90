!> A symmetric matrix of blocks in which directions at some rows are held: P K P in the place of K,
!> P the projection on what is left, with a diagonal along what is held. What K was there is kept.
module held_rows_mod
  use kinds_mod, only: wp
  use block_rows_mod, only: block_rows_t, put_block
  implicit none
  private

  public :: held_rows_t, keep_rows, hold_rows, project_rows, begin_product, end_product

  type :: held_rows_t
    integer, allocatable :: row(:)          !! (m) that may be held
    integer, allocatable :: start(:)        !! (m+1) where the blocks of each begin
    integer, allocatable :: other(:)        !! column of each block
    real(wp), allocatable :: block(:, :, :) !! (3,3,n_blocks) of K
    real(wp), allocatable :: left(:, :, :)  !! (3,3,m) P
  end type held_rows_t

contains

  !> Put K back, and keep the blocks of other rows.
  subroutine keep_rows(rows, held, row)
    type(block_rows_t), intent(inout) :: rows
    type(held_rows_t), intent(inout) :: held !! may have nothing yet
    integer, intent(in) :: row(:)            !! distinct
    integer, allocatable :: member(:), n_blocks(:)
    integer :: i, j, k

    if (allocated(held%row)) then
      do i = 1, size(held%row)
        do k = held%start(i), held%start(i + 1) - 1
          call put_block(rows, held%row(i), held%other(k), held%block(:, :, k))
        end do
      end do
      deallocate (held%start, held%other, held%block, held%left)
    end if
    held%row = row
    allocate (member(size(rows%first) - 1), source=0)
    member(row) = [(i, i=1, size(row))]
    allocate (n_blocks(size(row)), source=1)
    do i = 1, size(member)
      do k = rows%first(i), rows%first(i + 1) - 1
        if (member(i) > 0) n_blocks(member(i)) = n_blocks(member(i)) + 1
        j = member(rows%column(k))
        if (j > 0) n_blocks(j) = n_blocks(j) + 1
      end do
    end do
    held%start = [1, (1 + sum(n_blocks(:i)), i=1, size(row))]
    allocate (held%other(sum(n_blocks)), held%block(3, 3, sum(n_blocks)))
    allocate (held%left(3, 3, size(row)), source=0.0_wp)
    n_blocks = 0
    do i = 1, size(member)
      if (member(i) > 0) call add(member(i), i, rows%own(:, :, i))
      do k = rows%first(i), rows%first(i + 1) - 1
        if (member(i) > 0) call add(member(i), rows%column(k), rows%block(:, :, k))
        j = member(rows%column(k))
        if (j > 0) call add(j, i, transpose(rows%block(:, :, k)))
      end do
    end do

  contains

    subroutine add(i, other, block)
      integer, intent(in) :: i, other
      real(wp), intent(in) :: block(3, 3)

      associate (at => held%start(i) + n_blocks(i))
        held%other(at) = other
        held%block(:, :, at) = block
      end associate
      n_blocks(i) = n_blocks(i) + 1
    end subroutine add

  end subroutine keep_rows

  !> Hold directions, and no others.
  pure subroutine hold_rows(rows, held, along, stiffer)
    type(block_rows_t), intent(inout) :: rows
    type(held_rows_t), intent(inout) :: held
    real(wp), intent(in) :: along(:, :, :)   !! (3,3,m) projection on what is held [-]
    real(wp), intent(in) :: stiffer(:, :, :) !! (3,3,m) what is added on the diagonal, 0 along it
    integer, allocatable :: member(:) !! of the rows that may be held, 0 elsewhere
    real(wp) :: block(3, 3), own(3, 3)
    integer :: i, k, a

    allocate (member(size(rows%first) - 1), source=0)
    member(held%row) = [(i, i=1, size(held%row))]
    held%left = -along
    do a = 1, 3
      held%left(a, a, :) = 1.0_wp + held%left(a, a, :)
    end do
    do i = 1, size(held%row)
      do k = held%start(i), held%start(i + 1) - 1
        associate (other => held%other(k))
          block = matmul(held%left(:, :, i), held%block(:, :, k))
          if (member(other) > 0) block = matmul(block, held%left(:, :, member(other)))
          if (other == held%row(i)) then
            own = 0.0_wp
            do a = 1, 3
              own(a, a) = held%block(a, a, k)
            end do
            block = block + matmul(along(:, :, i), matmul(own, along(:, :, i))) + stiffer(:, :, i)
          end if
          call put_block(rows, held%row(i), other, block)
        end associate
      end do
    end do
  end subroutine hold_rows

  !> P x.
  pure subroutine project_rows(held, x)
    type(held_rows_t), intent(in) :: held
    real(wp), intent(inout) :: x(:, :) !! (3,n)
    integer :: i

    do i = 1, size(held%row)
      associate (own => x(:, held%row(i)))
        own = matmul(held%left(:, :, i), own)
      end associate
    end do
  end subroutine project_rows

  !> What the matrix as it is shall be multiplied with for a product with K: P x.
  pure subroutine begin_product(held, x, along)
    type(held_rows_t), intent(in) :: held
    real(wp), intent(inout) :: x(:, :)               !! (3,n) x in, P x out
    real(wp), intent(out) :: along(3, size(held%row)) !! what P takes off
    integer :: i

    do i = 1, size(held%row)
      along(:, i) = x(:, held%row(i))
    end do
    call project_rows(held, x)
    do i = 1, size(held%row)
      along(:, i) = along(:, i) - x(:, held%row(i))
    end do
  end subroutine begin_product

  !> From that product to K x.
  pure subroutine end_product(held, x, along, y)
    type(held_rows_t), intent(in) :: held
    real(wp), intent(in) :: x(:, :)     !! (3,n) P x
    real(wp), intent(in) :: along(:, :) !! (3,m) what P took off
    real(wp), intent(inout) :: y(:, :)  !! (3,n)
    real(wp) :: sums(3)
    integer :: i, k

    do i = 1, size(held%row)
      sums = 0.0_wp
      do k = held%start(i), held%start(i + 1) - 1
        sums = sums + matmul(held%block(:, :, k), x(:, held%other(k)))
      end do
      y(:, held%row(i)) = sums
    end do
    do i = 1, size(held%row)
      do k = held%start(i), held%start(i + 1) - 1
        associate (of_other => y(:, held%other(k)))
          of_other = of_other + matmul(along(:, i), held%block(:, :, k))
        end associate
      end do
    end do
  end subroutine end_product

end module held_rows_mod
