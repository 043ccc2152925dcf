!> Text to the standard streams, past the run-time library: its FLUSH says nothing where a disk is
!> full, and what a full disk did not take is lost without a word.
module standard_streams_mod
  use, intrinsic :: iso_c_binding, only: c_char, c_int, c_intptr_t, c_size_t
  implicit none
  private

  public :: write_to, standard_output, standard_error

  integer, parameter :: standard_output = 1, standard_error = 2

  interface
    !> POSIX.
    function c_write(descriptor, bytes, length) result(written) bind(c, name='write')
      import :: c_int, c_char, c_size_t, c_intptr_t
      implicit none
      integer(c_int), value :: descriptor
      character(c_char), intent(in) :: bytes(*)
      integer(c_size_t), value :: length
      integer(c_intptr_t) :: written
    end function c_write
  end interface

contains

  !> Write `text` as it is. What standard output does not take (a full disk, a closed stream) goes
  !> to standard error. Allocates nothing.
  subroutine write_to(stream, text)
    integer, intent(in) :: stream      !! standard_output or standard_error
    character(*), intent(in) :: text
    integer, parameter :: patience = 100 !! writes that take nothing, as signals may cause
    integer(c_intptr_t) :: written
    integer :: first, to, failures

    to = stream
    first = 1
    failures = 0
    do while (first <= len(text))
      written = c_write(int(to, c_int), text(first:), len(text(first:), c_size_t))
      if (written > 0) then
        first = first + int(written)
      else
        failures = failures + 1
        if (failures < patience) cycle
        if (to == standard_error) return
        to = standard_error
        failures = 0
      end if
    end do
  end subroutine write_to

end module standard_streams_mod
