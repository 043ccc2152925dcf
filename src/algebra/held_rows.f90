!> A symmetric matrix of blocks in which directions at some rows are held: P K P in the place of K,
!> P the projection on what is left, with a diagonal along what is held. Springs may join rows, then
!> it is P (K + sum B^T D B) P. What K was there is kept.
module held_rows_mod
  use kinds_mod, only: wp
  use block_rows_mod, only: add_block, block_rows_t, join_rows, put_block
  use springs_mod, only: ends_of, joined_pairs, springs_t
  implicit none
  private

  public :: held_rows_t, keep_rows, hold_rows, project_rows, begin_product, end_product

  type :: held_rows_t
    integer :: n_own = 0                    !! no block joins the rows behind these
    integer, allocatable :: row(:)          !! (m) that may be held, then ends of springs
    integer, allocatable :: start(:)        !! (m+1) where the blocks of each begin
    integer, allocatable :: other(:)        !! column of each block
    real(wp), allocatable :: block(:, :, :) !! (3,3,n_blocks) of K
    real(wp), allocatable :: left(:, :, :)  !! (3,3,m) P
    type(springs_t) :: springs              !! between rows
  end type held_rows_t

contains

  !> Put K back, and keep the blocks of other rows, and of those that springs join.
  subroutine keep_rows(rows, held, row, springs, n_own)
    type(block_rows_t), intent(inout) :: rows
    type(held_rows_t), intent(inout) :: held !! may have nothing yet
    integer, intent(in) :: row(:)            !! distinct
    type(springs_t), intent(in) :: springs   !! between rows
    integer, intent(in) :: n_own             !! no block joins the rows behind these
    integer, allocatable :: member(:), n_blocks(:), higher(:), lower(:), ends(:)
    integer :: i, j, k

    if (allocated(held%row)) then
      do i = 1, size(held%row)
        do k = held%start(i), held%start(i + 1) - 1
          call put_block(rows, held%row(i), held%other(k), held%block(:, :, k))
        end do
      end do
      deallocate (held%start, held%other, held%block, held%left)
    end if
    held%n_own = n_own
    held%springs = springs
    call joined_pairs(springs, higher, lower)
    call join_rows(rows, pack(higher, lower <= n_own), pack(lower, lower <= n_own))
    allocate (member(size(rows%first) - 1), source=0)
    member(row) = 1
    ends = ends_of(springs)
    held%row = [row, pack(ends, member(ends) == 0)]
    member(held%row) = [(i, i=1, size(held%row))]
    allocate (n_blocks(size(held%row)), source=1)
    do i = 1, size(member)
      do k = rows%first(i), rows%first(i + 1) - 1
        if (member(i) > 0) n_blocks(member(i)) = n_blocks(member(i)) + 1
        j = member(rows%column(k))
        if (j > 0) n_blocks(j) = n_blocks(j) + 1
      end do
    end do
    allocate (held%start(size(held%row) + 1))
    held%start(1) = 1
    do i = 1, size(held%row)
      held%start(i + 1) = held%start(i) + n_blocks(i)
    end do
    allocate (held%other(sum(n_blocks)), held%block(3, 3, sum(n_blocks)))
    allocate (held%left(3, 3, size(held%row)), source=0.0_wp)
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

  !> Hold directions, and no others, and give the springs their stiffness.
  pure subroutine hold_rows(rows, held, along, stiffer, of_spring)
    type(block_rows_t), intent(inout) :: rows
    type(held_rows_t), intent(inout) :: held
    real(wp), intent(in) :: along(:, :, :)   !! (3,3,m) projection on what is held [-]
    real(wp), intent(in) :: stiffer(:, :, :) !! (3,3,m) what is added on the diagonal, 0 along it
    real(wp), intent(in) :: of_spring(:, :, :) !! (3,3,n_springs) D
    integer, allocatable :: member(:) !! of the rows that may be held, 0 elsewhere
    real(wp) :: block(3, 3), own(3, 3)
    integer :: i, k, a, m

    allocate (member(size(rows%first) - 1), source=0)
    member(held%row) = [(i, i=1, size(held%row))]
    m = size(along, 3)
    held%left = 0.0_wp
    held%left(:, :, :m) = -along
    do a = 1, 3
      held%left(a, a, :) = 1.0_wp + held%left(a, a, :)
    end do
    do i = 1, size(held%row)
      do k = held%start(i), held%start(i + 1) - 1
        associate (other => held%other(k))
          block = matmul(held%left(:, :, i), held%block(:, :, k))
          if (member(other) > 0) block = matmul(block, held%left(:, :, member(other)))
          if (other == held%row(i) .and. i <= m) then
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
    call stiffen_springs(rows, held, member, of_spring)
  end subroutine hold_rows

  !> Add P B^T D B P to the matrix.
  pure subroutine stiffen_springs(rows, held, member, of_spring)
    type(block_rows_t), intent(inout) :: rows
    type(held_rows_t), intent(in) :: held
    integer, intent(in) :: member(:)           !! of the rows that may be held
    real(wp), intent(in) :: of_spring(:, :, :) !! (3,3,n_springs) D
    real(wp) :: of_row(3, 3), of_column(3, 3)
    integer :: i, k, l

    associate (springs => held%springs)
      do i = 1, springs%n
        if (.not. any(abs(of_spring(:, :, i)) > 0.0_wp)) cycle
        do k = springs%first(i), springs%first(i + 1) - 1
          of_row = matmul(of_spring(:, :, i), matmul(springs%share(:, :, k), held%left(:, :, &
            member(springs%at(k)))))
          do l = springs%first(i), k
            if (min(springs%at(k), springs%at(l)) > held%n_own) cycle
            of_column = matmul(springs%share(:, :, l), held%left(:, :, member(springs%at(l))))
            call add_block(rows, springs%at(k), springs%at(l), matmul(transpose(of_row), of_column))
          end do
        end do
      end do
    end associate
  end subroutine stiffen_springs

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
