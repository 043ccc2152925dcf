!> Text to the standard streams, past the run-time library: its FLUSH says nothing where a disk is
!> full, and what a full disk did not take is lost without a word.
module standard_streams_mod
  use, intrinsic :: iso_c_binding, only: c_associated, c_f_pointer, c_int, c_intptr_t, &
    c_null_char, c_ptr, c_size_t
  use libc_mod, only: c_errno_location, c_fclose, c_fileno, c_fopen, c_write
  implicit none
  private

  public :: open_standard_streams, write_to, write_most, standard_output, standard_error

  integer, parameter :: standard_output = 1, standard_error = 2
  integer(c_int), parameter :: epipe = 32 !! on Linux: nobody reads the pipe any more

contains

  !> Open /dev/null in the place of every standard stream that is closed (`>&- 2>&-`): a new file
  !> gets the lowest free descriptor, so the result file would become standard output and take the
  !> console's text. To be called before any file is opened.
  subroutine open_standard_streams()
    type(c_ptr) :: file
    integer(c_int) :: status

    do
      file = c_fopen('/dev/null'//c_null_char, 'r+'//c_null_char)
      if (.not. c_associated(file)) return
      if (c_fileno(file) <= standard_error) cycle
      exit
    end do
    status = c_fclose(file)
    if (status /= 0) return
  end subroutine open_standard_streams

  !> Write `text` as it is. What standard output does not take (a full disk) goes to standard error;
  !> what nobody reads any more (`| head -1`) is dropped. Allocates nothing.
  subroutine write_to(stream, text)
    integer, intent(in) :: stream      !! standard_output or standard_error
    character(*), intent(in) :: text
    integer :: written

    call write_most(stream, text, written)
    if (stream == standard_error) return
    call write_most(standard_error, text(written + 1:), written)
  end subroutine write_to

  !> Write `text` as far as a stream takes it; what nobody reads any more counts as written.
  subroutine write_most(stream, text, n_written)
    integer, intent(in) :: stream      !! standard_output or standard_error
    character(*), intent(in) :: text
    integer, intent(out) :: n_written  !! [byte]
    integer, parameter :: patience = 100 !! writes that take nothing, as signals may cause
    integer(c_intptr_t) :: written
    integer(c_int) :: error
    integer :: failures

    n_written = 0
    failures = 0
    do while (n_written < len(text) .and. failures < patience)
      written = c_write(int(stream, c_int), text(n_written + 1:), &
        int(len(text) - n_written, c_size_t))
      if (written > 0) then
        n_written = n_written + int(written)
      else
        error = 0
        if (written < 0) call get_last_error(error)
        if (error == epipe) n_written = len(text)
        failures = failures + 1
      end if
    end do
  end subroutine write_most

  !> The number of the error that the last call of the system ended with.
  subroutine get_last_error(number)
    integer(c_int), intent(out) :: number
    integer(c_int), pointer :: errno

    call c_f_pointer(c_errno_location(), errno)
    number = errno
  end subroutine get_last_error

end module standard_streams_mod
