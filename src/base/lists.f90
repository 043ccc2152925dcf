!> Many short lists of numbers in one array, one behind the other: the elements at each node, the
!> nodes of each body.
module lists_mod
  implicit none
  private

  public :: lists_t, lists_by_key, lists_with, columns_with

  !> List i is item(first(i):first(i + 1) - 1).
  type :: lists_t
    integer, allocatable :: first(:) !! (n_lists+1)
    integer, allocatable :: item(:)
  end type lists_t

contains

  !> The places of each key in an array, ascending. Keys that are 0 are in no list.
  pure type(lists_t) function lists_by_key(key, n) result(lists)
    integer, intent(in) :: key(:)
    integer, intent(in) :: n      !! the largest key there may be: the number of lists
    integer :: next(0:n), i

    next = 0
    do i = 1, size(key)
      next(key(i)) = next(key(i)) + 1
    end do
    allocate (lists%first(n + 1))
    lists%first(1) = 1
    do i = 1, n
      lists%first(i + 1) = lists%first(i) + next(i)
    end do
    next(1:) = lists%first(:n)
    allocate (lists%item(lists%first(n + 1) - 1))
    do i = 1, size(key)
      if (key(i) == 0) cycle
      lists%item(next(key(i))) = i
      next(key(i)) = next(key(i)) + 1
    end do
  end function lists_by_key

  !> The inverse of lists: for each number from 1 to n the lists that have it, ascending.
  pure type(lists_t) function lists_with(first, item, n) result(lists)
    integer, intent(in) :: first(:), item(:) !! as of `lists_t`
    integer, intent(in) :: n
    integer :: owner(size(item)), i

    do i = 1, size(first) - 1
      owner(first(i):first(i + 1) - 1) = i
    end do
    lists = lists_by_key(item, n)
    lists%item = owner(lists%item)
  end function lists_with

  !> For each number from 1 to n the columns of a table that have it, ascending. Entries of the
  !> table that are 0 are none.
  pure type(lists_t) function columns_with(table, n) result(lists)
    integer, intent(in) :: table(:, :)
    integer, intent(in) :: n

    lists = lists_by_key(reshape(table, [size(table)]), n)
    lists%item = (lists%item - 1)/max(1, size(table, 1)) + 1
  end function columns_with

end module lists_mod
