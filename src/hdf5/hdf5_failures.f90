!> What HDF5 and the operating system say about a call that failed.
module hdf5_failures_mod
  use, intrinsic :: iso_c_binding, only: c_ptr, c_loc, c_char, c_int, c_int64_t, c_funptr, &
    c_funloc, c_f_pointer, c_associated
  use c_text_mod, only: text_at
  use errors_mod, only: error_t, raise, exit_machine
  implicit none
  private

  public :: fail, reason_t, text_of, why

  !> One entry of HDF5's error stack, as H5Epublic.h lays it out.
  type, bind(c) :: stack_entry_t
    integer(c_int64_t) :: class_id, major, minor
    integer(c_int)     :: line
    type(c_ptr)        :: function_name, file_name, description
  end type stack_entry_t

  !> The operating system's words in an error stack.
  type, bind(c) :: reason_t
    character(c_char) :: text(200)
    integer(c_int)    :: length  !! 0: it said nothing
    integer(c_int)    :: locked  !! 1: a lock was refused
  end type reason_t

  interface
    function walk_error_stack(stack, direction, visit, client) bind(c, name='H5Ewalk2')
      import :: c_int, c_int64_t, c_funptr, c_ptr
      implicit none
      integer(c_int64_t), value :: stack
      integer(c_int), value :: direction
      type(c_funptr), value :: visit
      type(c_ptr), value :: client
      integer(c_int) :: walk_error_stack
    end function walk_error_stack
  end interface

contains

  !> Raise a machine error with the operating system's reason, if it gave one. Of a file that is
  !> read, `without_reason` says that it is the file that is wrong where the system gave none.
  !>
  !> To be called before any other call of the library: each of them clears the reason.
  subroutine fail(error, message, without_reason)
    type(error_t), allocatable, intent(inout) :: error
    character(*), intent(in) :: message
    integer, intent(in), optional :: without_reason !! an exit status
    type(reason_t) :: reason

    reason = why()
    if (reason%locked == 1) then
      call raise(error, exit_machine, message//': another program has the file open')
    else if (reason%length > 0) then
      call raise(error, exit_machine, message//': '//text_of(reason%text(:reason%length)))
    else if (present(without_reason)) then
      call raise(error, without_reason, message)
    else
      call raise(error, exit_machine, message)
    end if
  end subroutine fail

  !> What the operating system said about the last failed call.
  function why() result(reason)
    type(reason_t), target :: reason
    integer(c_int64_t), parameter :: default_stack = 0
    integer(c_int), parameter :: from_the_cause = 0
    integer(c_int) :: ignored

    reason%length = 0
    reason%locked = 0
    reason%text = ' '
    ignored = walk_error_stack(default_stack, from_the_cause, c_funloc(find_reason), c_loc(reason))
  end function why

  !> Keep the system's words of one entry of the error stack: "..., error message = '<words>', ...".
  integer(c_int) function find_reason(depth, entry_address, client) result(status) bind(c)
    integer(c_int), value :: depth
    type(c_ptr), value :: entry_address, client
    character(*), parameter :: mark = "error message = '"
    type(stack_entry_t), pointer :: entry
    type(reason_t), pointer :: reason
    character(:), allocatable :: description
    integer :: first, n

    status = 0
    call c_f_pointer(client, reason)
    call c_f_pointer(entry_address, entry)
    if (depth < 0 .or. .not. c_associated(entry%description)) return
    description = text_at(entry%description)
    if (index(description, 'unable to lock file') > 0) reason%locked = 1
    first = index(description, mark)
    if (first == 0 .or. reason%length > 0) return
    description = description(first + len(mark):)
    n = min(index(description//"'", "'") - 1, size(reason%text))
    reason%text(:n) = transfer(description(:n), reason%text, n)
    reason%length = n
  end function find_reason

  !> The bytes as a text, without the NULs and blanks that pad it.
  pure function text_of(bytes) result(text)
    character(c_char), intent(in) :: bytes(:)
    character(:), allocatable :: text
    integer :: i, n

    do n = size(bytes), 1, -1
      if (bytes(n) /= achar(0) .and. bytes(n) /= ' ') exit
    end do
    allocate (character(n) :: text)
    do i = 1, n
      text(i:i) = bytes(i)
    end do
  end function text_of

end module hdf5_failures_mod
