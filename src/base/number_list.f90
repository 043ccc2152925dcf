!> Values put one behind the other into a list of numbers, or taken out of one, by the same calls.
!>
!> Whoever has something to keep writes one procedure that calls `archive` for each of its
!> components. With an empty list that fills it; with `list_of(values)` it gives the components
!> their values back, to the last bit.
module number_list_mod
  use kinds_mod, only: wp, i8
  implicit none
  private

  public :: number_list_t, list_of, numbers_in, is_used_up, archive

  !> The list, and how far it is filled or used.
  type :: number_list_t
    private
    real(wp), allocatable :: values(:)
    integer :: used = 0
    logical :: is_taken_from = .false.
    logical :: is_short = .false. !! more was taken than there is, or arrays of another shape
  end type number_list_t

  !> Put a value into the list, or take it out: `archive(list, value)`.
  !>
  !> Whole numbers below 2**53 in size. An array of which many columns are 0 costs no more than the
  !> others of its columns; it must have its shape before it is taken out, or not be allocated.
  interface archive
    module procedure carry_real, carry_integer, carry_long, carry_columns
  end interface archive

contains

  !> A list to take `values` out of.
  pure type(number_list_t) function list_of(values) result(list)
    real(wp), intent(in) :: values(:)

    allocate (list%values, source=values)
    list%is_taken_from = .true.
  end function list_of

  !> What has been put into the list.
  pure function numbers_in(list) result(values)
    type(number_list_t), intent(in) :: list
    real(wp), allocatable :: values(:)

    allocate (values(0))
    if (allocated(list%values)) values = list%values(:list%used)
  end function numbers_in

  !> Whether exactly what the list holds was taken out of it.
  pure logical function is_used_up(list)
    type(number_list_t), intent(in) :: list

    is_used_up = .not. list%is_short .and. list%used == size(list%values)
  end function is_used_up

  subroutine carry_real(list, value)
    type(number_list_t), intent(inout) :: list
    real(wp), intent(inout) :: value

    if (.not. list%is_taken_from) then
      call make_room(list, 1)
      list%values(list%used + 1) = value
    else if (list%used < size(list%values)) then
      value = list%values(list%used + 1)
    else
      list%is_short = .true.
      return
    end if
    list%used = list%used + 1
  end subroutine carry_real

  subroutine carry_integer(list, value)
    type(number_list_t), intent(inout) :: list
    integer, intent(inout) :: value
    integer(i8) :: long

    long = value
    call carry_long(list, long)
    if (abs(long) > huge(value)) list%is_short = .true.
    if (.not. list%is_short) value = int(long)
  end subroutine carry_integer

  subroutine carry_long(list, value)
    type(number_list_t), intent(inout) :: list
    integer(i8), intent(inout) :: value
    real(wp), parameter :: largest = 2.0_wp**53
    real(wp) :: number

    number = real(value, wp)
    call carry_real(list, number)
    if (.not. abs(number) < largest) list%is_short = .true.
    if (.not. list%is_short) value = nint(number, i8)
  end subroutine carry_long

  !> Extents, then the columns that are not 0: how many, which (unless all), their numbers.
  subroutine carry_columns(list, values)
    type(number_list_t), intent(inout) :: list
    real(wp), allocatable, intent(inout) :: values(:, :)
    integer, allocatable :: columns(:)
    integer :: extents(2), n_columns, i

    extents = -1
    if (allocated(values)) extents = shape(values)
    if (list%is_taken_from .or. extents(2) < 1) then
      allocate (columns(0))
    else
      columns = columns_with_bits(values)
    end if
    n_columns = size(columns)
    call carry_integer(list, extents(1))
    call carry_integer(list, extents(2))
    call carry_integer(list, n_columns)
    if (list%is_taken_from) call shape_for(list, extents, n_columns, values)
    if (list%is_short .or. n_columns == 0) return

    if (list%is_taken_from) then
      deallocate (columns)
      allocate (columns(n_columns), source=[(i, i=1, n_columns)])
    end if
    if (n_columns < extents(2)) then
      do i = 1, n_columns
        call carry_integer(list, columns(i))
      end do
      if (any(columns < 1) .or. any(columns > extents(2))) list%is_short = .true.
    end if
    if (list%is_taken_from) then
      if (list%used + extents(1)*n_columns > size(list%values)) list%is_short = .true.
    else
      call make_room(list, extents(1)*n_columns)
    end if
    if (list%is_short) return
    do i = 1, n_columns
      associate (first => list%used + 1, last => list%used + extents(1))
        if (list%is_taken_from) then
          values(:, columns(i)) = list%values(first:last)
        else
          list%values(first:last) = values(:, columns(i))
        end if
      end associate
      list%used = list%used + extents(1)
    end do
  end subroutine carry_columns

  !> The columns that are not 0.
  pure function columns_with_bits(values) result(columns)
    real(wp), intent(in) :: values(:, :)
    integer, allocatable :: columns(:)
    integer :: found(size(values, 2)), n, i

    n = 0
    do i = 1, size(values, 2)
      if (.not. has_bits(values(:, i))) cycle
      n = n + 1
      found(n) = i
    end do
    columns = found(:n)
  end function columns_with_bits

  !> Make room for an array to be taken out, all 0.
  subroutine shape_for(list, extents, n_columns, values)
    type(number_list_t), intent(inout) :: list
    integer, intent(in) :: extents(2), n_columns !! negative extents: not allocated
    real(wp), allocatable, intent(inout) :: values(:, :)
    integer :: left

    left = size(list%values) - list%used
    if (allocated(values)) then
      if (any(shape(values) /= extents)) list%is_short = .true.
    end if
    if (n_columns < 0 .or. n_columns > max(0, extents(2))) list%is_short = .true.
    if (list%is_short) return
    if (extents(1) < 0) return
    if (extents(1) > left/max(1, n_columns) .and. n_columns > 0) list%is_short = .true.
    if (list%is_short) return
    if (allocated(values)) deallocate (values)
    allocate (values(extents(1), extents(2)), source=0.0_wp)
  end subroutine shape_for

  !> Not 0 to the last bit: a negative zero counts.
  pure logical function has_bits(column)
    real(wp), intent(in) :: column(:)
    integer :: i

    has_bits = .false.
    do i = 1, size(column)
      if (transfer(column(i), 0_i8) == 0_i8) cycle
      has_bits = .true.
      return
    end do
  end function has_bits

  !> Let `n` more numbers fit.
  pure subroutine make_room(list, n)
    type(number_list_t), intent(inout) :: list
    integer, intent(in) :: n
    real(wp), allocatable :: longer(:)

    if (.not. allocated(list%values)) allocate (list%values(max(n, 64)))
    if (list%used + n <= size(list%values)) return
    allocate (longer(max(list%used + n, 2*size(list%values))))
    longer(:list%used) = list%values(:list%used)
    call move_alloc(longer, list%values)
  end subroutine make_room

end module number_list_mod
