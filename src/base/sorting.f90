!> Sorting whole numbers, and finding them.
module sorting_mod
  implicit none
  private

  public :: order_of, order_of_columns, sort_ascending, sort_unique, count_below

contains

  !> The order that sorts `keys`, equal keys by index: bottom-up merge sort.
  pure subroutine order_of(keys, order)
    integer, intent(in) :: keys(:)
    integer, allocatable, intent(out) :: order(:)
    integer, allocatable :: from(:)
    integer :: n, width, left, middle, right, i, j, k

    n = size(keys)
    allocate (order(n))
    do i = 1, n
      order(i) = i
    end do
    width = 1
    do while (width < n)
      from = order
      left = 1
      do while (left <= n)
        middle = min(left + width, n + 1)
        right = min(middle + width, n + 1)
        i = left
        j = middle
        do k = left, right - 1
          if (j >= right) then
            order(k) = from(i)
            i = i + 1
          else if (i >= middle) then
            order(k) = from(j)
            j = j + 1
          else if (keys(from(j)) < keys(from(i))) then
            order(k) = from(j)
            j = j + 1
          else
            order(k) = from(i)
            i = i + 1
          end if
        end do
        left = right
      end do
      width = 2*width
    end do
  end subroutine order_of

  !> The order that sorts columns by their first, second, ... entry, equal ones by index.
  pure subroutine order_of_columns(key, order)
    integer, intent(in) :: key(:, :)
    integer, allocatable, intent(out) :: order(:)
    integer, allocatable :: of_entry(:)
    integer :: i

    allocate (order(size(key, 2)))
    order(:) = [(i, i=1, size(order))]
    ! The last entry first: each sort keeps the order of equal entries.
    do i = size(key, 1), 1, -1
      call order_of(key(i, order), of_entry)
      order(:) = order(of_entry)
    end do
  end subroutine order_of_columns

  !> Sort a short list, of a few dozen entries at most: insertion sort.
  pure subroutine sort_ascending(list)
    integer, intent(inout) :: list(:)
    integer :: i, j, value

    do i = 2, size(list)
      value = list(i)
      j = i - 1
      do while (j >= 1)
        if (list(j) <= value) exit
        list(j + 1) = list(j)
        j = j - 1
      end do
      list(j + 1) = value
    end do
  end subroutine sort_ascending

  !> Sort a list of positive numbers and keep each once.
  pure subroutine sort_unique(list)
    integer, allocatable, intent(inout) :: list(:)
    integer, parameter :: a_few = 64
    !! nodes of some faces: sorted by insertion, which needs no other arrays
    logical, allocatable :: present_in(:)
    integer, allocatable :: order(:)
    integer :: i, n, highest

    if (all(list(2:) > list(:size(list) - 1))) return
    n = 0
    highest = maxval(list)
    if (size(list) > a_few .and. highest/4 <= size(list)) then
      ! Dense: one pass over the values that there can be.
      allocate (present_in(highest))
      present_in = .false.
      present_in(list) = .true.
      do i = 1, highest
        if (.not. present_in(i)) cycle
        n = n + 1
        list(n) = i
      end do
    else
      if (size(list) <= a_few) then
        call sort_ascending(list)
      else
        call order_of(list, order)
        list(:) = list(order)
      end if
      do i = 1, size(list)
        if (n > 0) then
          if (list(n) == list(i)) cycle
        end if
        n = n + 1
        list(n) = list(i)
      end do
    end if
    if (n < size(list)) list = list(:n)
  end subroutine sort_unique

  !> How many numbers of an ascending list are below a value.
  pure integer function count_below(value, list) result(n)
    integer, intent(in) :: value, list(:)
    integer :: high, middle

    n = 0
    high = size(list)
    do while (n < high)
      middle = n + (high - n)/2
      if (list(middle + 1) < value) then
        n = middle + 1
      else
        high = middle
      end if
    end do
  end function count_below

end module sorting_mod
