!> Which points W couples, and an order of the points in which W is a band.
!>
!> Rigid bodies couple their own contact points alone. The W of an elastic body is full.
module couplings_mod
  use kinds_mod, only: wp
  implicit none
  private

  public :: couplings_t, find_couplings

  real(wp), parameter :: sparse = 0.3_wp !! fraction of blocks that are not 0, at most [-]

  !> Neighbours of each point; nothing is allocated where W is full.
  type :: couplings_t
    integer, allocatable :: start(:) !! (n_points+1) where the neighbours of each point begin
    integer, allocatable :: other(:) !! neighbours, the point itself among them, ascending
    integer, allocatable :: order(:) !! (n_points) the points, neighbours near each other
  end type couplings_t

contains

  !> Find the blocks of W that are not 0.
  pure subroutine find_couplings(row, w, couplings)
    integer, intent(in) :: row(:, :)     !! (3,n_points) row of each component, 0 where none
    real(wp), intent(in) :: w(:, :)      !! (n_rows,n_rows) symmetric [length/force]
    type(couplings_t), intent(out) :: couplings
    integer :: i, j, n, n_points, pass

    n_points = size(row, 2)
    if (n_points == 0) return
    allocate (couplings%start(n_points + 1))
    do pass = 1, 2
      n = 0
      do j = 1, n_points
        couplings%start(j) = n + 1
        do i = 1, n_points
          if (i /= j .and. .not. is_coupled(i, j)) cycle
          n = n + 1
          if (pass == 2) couplings%other(n) = i
        end do
        if (n > sparse*real(n_points, wp)**2) then
          deallocate (couplings%start)
          return
        end if
      end do
      couplings%start(n_points + 1) = n + 1
      if (pass == 1) allocate (couplings%other(n))
    end do
    call order_points(couplings)

  contains

    pure logical function is_coupled(i, j)
      integer, intent(in) :: i, j
      integer :: a, b

      is_coupled = .false.
      do b = 1, 3
        if (row(b, j) == 0) cycle
        do a = 1, 3
          if (row(a, i) == 0) cycle
          is_coupled = abs(w(row(a, i), row(b, j))) > 0.0_wp
          if (is_coupled) return
        end do
      end do
    end function is_coupled

  end subroutine find_couplings

  !> Reverse Cuthill-McKee: level by level from a point at the rim, those with few neighbours first.
  !>
  !> Source: E. Cuthill, J. McKee (1969), Reducing the bandwidth of sparse symmetric matrices,
  !> Proc. 24th ACM Nat. Conf., pp. 157-172.
  pure subroutine order_points(couplings)
    type(couplings_t), intent(inout) :: couplings
    integer, dimension(size(couplings%start) - 1) :: degree, queue
    logical, dimension(size(couplings%start) - 1) :: placed, seen
    integer :: n, first, filled, i, last_level

    n = size(degree)
    degree = couplings%start(2:) - couplings%start(:n)
    placed = .false.
    filled = 0
    do while (filled < n)
      first = minloc(degree, dim=1, mask=.not. placed)
      ! The rim: the last level seen from the last level seen from anywhere.
      do i = 1, 2
        seen = placed
        call run_increments(couplings, degree, first, filled, queue, seen, last_level)
        first = queue(last_level)
      end do
      i = filled
      call run_increments(couplings, degree, first, i, queue, placed, last_level)
      filled = count(placed)
    end do
    couplings%order = queue(n:1:-1)
  end subroutine order_points

  !> The points reached from one, level by level, put behind those in the queue.
  pure subroutine run_increments(couplings, degree, first, filled, queue, seen, last_level)
    type(couplings_t), intent(in) :: couplings
    integer, intent(in) :: degree(:)       !! (n_points)
    integer, intent(in) :: first, filled   !! point; entries of the queue that stay
    integer, intent(inout) :: queue(:)     !! (n_points)
    logical, intent(inout) :: seen(:)      !! (n_points)
    integer, intent(out) :: last_level     !! where in the queue the last level begins
    integer :: head, tail, end_of_level, begin, k, i, j

    queue(filled + 1) = first
    seen(first) = .true.
    head = filled
    tail = filled + 1
    last_level = tail
    do while (head < tail)
      last_level = head + 1
      end_of_level = tail
      do while (head < end_of_level)
        head = head + 1
        begin = tail + 1
        do k = couplings%start(queue(head)), couplings%start(queue(head) + 1) - 1
          j = couplings%other(k)
          if (seen(j)) cycle
          seen(j) = .true.
          ! Sorted in by its degree.
          i = tail
          do while (i >= begin)
            if (degree(queue(i)) <= degree(j)) exit
            queue(i + 1) = queue(i)
            i = i - 1
          end do
          queue(i + 1) = j
          tail = tail + 1
        end do
      end do
    end do
  end subroutine run_increments

end module couplings_mod
