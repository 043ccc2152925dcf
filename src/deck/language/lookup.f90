!> Finding ids and names among many: sorted once, then by bisection.
!>
!> Worst cases are n log n, so no choice of ids or names in a deck can make reading slow.
module lookup_mod
  use sorting_mod, only: order_of
  use text_mod, only: string_t
  implicit none
  private

  public :: id_lookup_t, name_lookup_t, make_id_lookup, make_name_lookup
  public :: find_id, find_name

  !> From ids to their index in a list.
  type :: id_lookup_t
    integer, allocatable :: order(:) !! (n) indices by ascending id; not allocated when consecutive
    integer :: first_id = 1
    integer :: n = 0
    integer, allocatable :: instead(:)
    !! (n) the index that an id means in the place of its own; not allocated: its own
  end type id_lookup_t

  !> From names to the first entry of a list that has it.
  type :: name_lookup_t
    integer, allocatable :: order(:) !! (n) indices by name, equal names by index
    integer :: n = 0
  end type name_lookup_t

contains

  !> Prepare the look-up of `ids`.
  subroutine make_id_lookup(ids, lookup)
    integer, intent(in) :: ids(:)
    type(id_lookup_t), intent(out) :: lookup
    integer :: i
    logical :: consecutive

    lookup%n = size(ids)
    if (lookup%n == 0) return
    consecutive = .true.
    do i = 2, size(ids)
      ! Written so that no sum can overflow.
      if (ids(i) <= ids(i - 1)) then
        consecutive = .false.
      else if (ids(i) - 1 /= ids(i - 1)) then
        consecutive = .false.
      end if
      if (.not. consecutive) exit
    end do
    lookup%first_id = ids(1)
    if (consecutive) return
    call order_of(ids, lookup%order)
  end subroutine make_id_lookup

  !> The index of `id` in the list of the look-up; 0 when it is not there.
  pure function find_id(lookup, ids, id) result(found)
    type(id_lookup_t), intent(in) :: lookup
    integer, intent(in) :: ids(:) !! as given to make_id_lookup
    integer, intent(in) :: id     !! >= 0
    integer :: found, low, high, middle

    found = 0
    if (lookup%n == 0) return
    if (.not. allocated(lookup%order)) then
      if (id >= lookup%first_id .and. id - lookup%first_id < lookup%n) then
        found = id - lookup%first_id + 1
        if (allocated(lookup%instead)) found = lookup%instead(found)
      end if
      return
    end if
    low = 1
    high = lookup%n
    do while (low < high)
      middle = low + (high - low)/2
      if (ids(lookup%order(middle)) < id) then
        low = middle + 1
      else
        high = middle
      end if
    end do
    if (ids(lookup%order(low)) /= id) return
    found = lookup%order(low)
    if (allocated(lookup%instead)) found = lookup%instead(found)
  end function find_id

  !> Prepare the look-up of `names`.
  subroutine make_name_lookup(names, n, lookup)
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: n !! the first n count
    type(name_lookup_t), intent(out) :: lookup
    integer, allocatable :: from(:)
    integer :: width, left, middle, right, i, j, k

    lookup%n = n
    allocate (lookup%order(n))
    do i = 1, n
      lookup%order(i) = i
    end do
    width = 1
    do while (width < n)
      from = lookup%order
      left = 1
      do while (left <= n)
        middle = min(left + width, n + 1)
        right = min(middle + width, n + 1)
        i = left
        j = middle
        do k = left, right - 1
          if (takes_right(i, j, middle, right)) then
            lookup%order(k) = from(j)
            j = j + 1
          else
            lookup%order(k) = from(i)
            i = i + 1
          end if
        end do
        left = right
      end do
      width = 2*width
    end do

  contains

    pure logical function takes_right(i, j, middle, right) result(takes)
      integer, intent(in) :: i, j, middle, right

      takes = .false.
      if (j >= right) return
      takes = .true.
      if (i >= middle) return
      takes = llt(names(from(j))%text, names(from(i))%text)
    end function takes_right

  end subroutine make_name_lookup

  !> The first entry of the list with this name; 0 when there is none.
  pure function find_name(lookup, names, name) result(found)
    type(name_lookup_t), intent(in) :: lookup
    type(string_t), intent(in) :: names(:) !! as given to make_name_lookup
    character(*), intent(in) :: name
    integer :: found, low, high, middle

    found = 0
    if (lookup%n == 0) return
    low = 1
    high = lookup%n
    do while (low < high)
      middle = low + (high - low)/2
      if (llt(names(lookup%order(middle))%text, name)) then
        low = middle + 1
      else
        high = middle
      end if
    end do
    if (names(lookup%order(low))%text == name) found = lookup%order(low)
  end function find_name

end module lookup_mod
