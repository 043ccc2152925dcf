!> The stiffness of the contact points, W^-1, as far as it matters near each of them.
!>
!> What holds a point is near it: the blocks of W^-1 fall with the third power of the distance,
!> those of W with the first. A few of them make a good approximate inverse.
module near_stiffness_mod
  use kinds_mod, only: wp
  implicit none
  private

  public :: near_stiffness_t, find_near, keep_near, turn_near, scale_near, times_near

  real(wp), parameter :: negligible = 0.01_wp !! of a block beside those of its two points alone [-]
  integer,  parameter :: most_blocks = 40     !! a point, on average

  !> The blocks that are kept, point by point; the first of each point is its own.
  type :: near_stiffness_t
    integer,  allocatable :: start(:)       !! (n_points+1) where those of each point begin
    integer,  allocatable :: other(:)       !! (n_blocks) the other point of each
    real(wp), allocatable :: block(:, :, :) !! (3,3,n_blocks) [force/length]
  end type near_stiffness_t

  integer, parameter :: doublings = 64 !! of the limit: no block is as large beside the own ones

contains

  !> Find the blocks of a stiffness that are not negligible.
  pure subroutine find_near(index, s, near)
    integer, intent(in) :: index(:, :)
    !! (3,n_points) row of each component in `s`, 0 where there is none
    real(wp), intent(in) :: s(:, :)          !! (n,n) symmetric positive definite [force/length]
    type(near_stiffness_t), intent(out) :: near
    real(wp) :: own(size(index, 2)), limit   !! roots of the sizes of the points' own blocks
    real(wp) :: of_block
    integer :: above(0:doublings)        !! blocks above so many doublings of the least limit
    integer :: i, j, k, n, n_points

    n_points = size(index, 2)
    own = [(sqrt(largest(s, index(:, i), index(:, i))), i=1, n_points)]
    allocate (near%start(n_points + 1))
    ! Where stiffness does not fall with the distance only the largest blocks are kept: at which
    ! limit is counted for all of them at once.
    above = 0
    do j = 1, n_points
      do i = 1, n_points
        if (share_rows(i, j)) cycle
        of_block = largest(s, index(:, i), index(:, j))
        limit = negligible*own(i)*own(j)
        do k = 0, doublings - 1
          if (.not. of_block > limit) exit
          limit = 2.0_wp*limit
        end do
        above(k) = above(k) + 1
      end do
    end do
    k = 0
    do while (n_points + sum(above(k + 1:)) > most_blocks*n_points)
      k = k + 1
    end do
    limit = negligible*2.0_wp**k
    n = n_points + sum(above(k + 1:))
    allocate (near%other(n), near%block(3, 3, n))
    n = 0
    do j = 1, n_points
      n = n + 1
      near%start(j) = n
      near%other(n) = j
      near%block(:, :, n) = block_of(s, index(:, j), index(:, j))
      do i = 1, n_points
        if (.not. is_near(i, j)) cycle
        n = n + 1
        near%other(n) = i
        near%block(:, :, n) = block_of(s, index(:, j), index(:, i))
      end do
    end do
    near%start(n_points + 1) = n + 1

  contains

    pure logical function is_near(i, j)
      integer, intent(in) :: i, j

      is_near = .not. share_rows(i, j)
      if (is_near) is_near = largest(s, index(:, i), index(:, j)) > limit*own(i)*own(j)
    end function is_near

    !> Points that share rows hold each other in a way that their common block does not say.
    pure logical function share_rows(i, j)
      integer, intent(in) :: i, j

      share_rows = any(index(:, i) > 0 .and. index(:, i) == index(:, j))
    end function share_rows

  end subroutine find_near

  !> Of some blocks those that are not negligible. The first of each point is its own.
  pure subroutine keep_near(all, near)
    type(near_stiffness_t), intent(in) :: all
    type(near_stiffness_t), intent(out) :: near
    real(wp) :: own(size(all%start) - 1), limit !! roots of the sizes of the points' own blocks
    integer :: i, k, n, pass, tried

    own = [(sqrt(maxval(abs(all%block(:, :, all%start(i))))), i=1, size(own))]
    allocate (near%start(size(own) + 1))
    limit = negligible
    pass = 1
    do tried = 1, doublings + 2
      n = 0
      do i = 1, size(own)
        near%start(i) = n + 1
        do k = all%start(i), all%start(i + 1) - 1
          if (k > all%start(i) .and. maxval(abs(all%block(:, :, k))) <= &
            limit*own(i)*own(all%other(k))) cycle
          n = n + 1
          if (pass == 1) cycle
          near%other(n) = all%other(k)
          near%block(:, :, n) = all%block(:, :, k)
        end do
      end do
      near%start(size(own) + 1) = n + 1
      if (pass == 2) return
      if (n <= most_blocks*size(own) .or. tried > doublings) then
        allocate (near%other(n), near%block(3, 3, n))
        pass = 2
      else
        limit = 2.0_wp*limit
      end if
    end do
  end subroutine keep_near

  !> The largest entry of a block.
  pure real(wp) function largest(s, row, column) result(size_of_largest)
    real(wp), intent(in) :: s(:, :)
    integer, intent(in) :: row(3), column(3) !! 0 where there is none
    integer :: a, b

    size_of_largest = 0.0_wp
    do b = 1, 3
      if (column(b) == 0) cycle
      do a = 1, 3
        if (row(a) > 0) size_of_largest = max(size_of_largest, abs(s(row(a), column(b))))
      end do
    end do
  end function largest

  !> A block, 0 where a row or a column is missing.
  pure function block_of(s, row, column) result(block)
    real(wp), intent(in) :: s(:, :)
    integer, intent(in) :: row(3), column(3) !! 0 where there is none
    real(wp) :: block(3, 3)
    integer :: a, b

    block = 0.0_wp
    do b = 1, 3
      do a = 1, 3
        if (row(a) > 0 .and. column(b) > 0) block(a, b) = s(row(a), column(b))
      end do
    end do
  end function block_of

  !> The same of some of the points, in frames of their own.
  pure type(near_stiffness_t) function turn_near(near, frame, kept) result(turned)
    type(near_stiffness_t), intent(in) :: near
    real(wp), intent(in) :: frame(:, :, :)   !! (3,3,n_points) columns n, t1, t2
    integer, intent(in) :: kept(:)           !! points
    integer :: position(size(frame, 3)), i, j, k, n

    position = 0
    position(kept) = [(i, i=1, size(kept))]
    allocate (turned%start(size(kept) + 1))
    n = 0
    do i = 1, size(kept)
      turned%start(i) = n + 1
      n = n + count(position(near%other(near%start(kept(i)):near%start(kept(i) + 1) - 1)) > 0)
    end do
    turned%start(size(kept) + 1) = n + 1
    allocate (turned%other(n), turned%block(3, 3, n))
    n = 0
    do i = 1, size(kept)
      do k = near%start(kept(i)), near%start(kept(i) + 1) - 1
        j = near%other(k)
        if (position(j) == 0) cycle
        n = n + 1
        turned%other(n) = position(j)
        turned%block(:, :, n) = matmul(transpose(frame(:, :, kept(i))), &
          matmul(near%block(:, :, k), frame(:, :, j)))
      end do
    end do
  end function turn_near

  !> Points that are held less than their blocks say: a block takes the root of both its factors.
  pure subroutine scale_near(near, factor)
    type(near_stiffness_t), intent(inout) :: near
    real(wp), intent(in) :: factor(:)        !! (n_points) > 0 [-]
    integer :: i, k

    do i = 1, size(factor)
      do k = near%start(i), near%start(i + 1) - 1
        near%block(:, :, k) = sqrt(factor(i)*factor(near%other(k)))*near%block(:, :, k)
      end do
    end do
  end subroutine scale_near

  !> The product with displacements of the points.
  pure function times_near(near, x) result(r)
    type(near_stiffness_t), intent(in) :: near
    real(wp), intent(in) :: x(:, :)           !! (3,n_points) [length]
    real(wp) :: r(3, size(x, 2))              !! [force]
    real(wp) :: sum_of_blocks(3)
    integer :: i, k

    do i = 1, size(x, 2)
      sum_of_blocks = 0.0_wp
      do k = near%start(i), near%start(i + 1) - 1
        associate (s => near%block(:, :, k), x_k => x(:, near%other(k)))
          sum_of_blocks = sum_of_blocks + s(:, 1)*x_k(1) + s(:, 2)*x_k(2) + s(:, 3)*x_k(3)
        end associate
      end do
      r(:, i) = sum_of_blocks
    end do
  end function times_near

end module near_stiffness_mod
