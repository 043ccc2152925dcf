!> What the compiler's run-time library and the system would end the program for, met in the
!> program's own way.
!>
!> - ALLOCATE without STAT=, automatic arrays and temporaries call the library's procedure
!>   `os_error_at` where there is no memory; it would end the program with exit status 1, which
!>   stands for a wrong deck. The procedures of that name below take its place: one sentence on
!>   standard error, exit status 3. What the result file has counted is in it.
!> - A file that grows past the limit on files (ulimit -f) makes the system send SIGXFSZ, which
!>   would kill the program. Ignored, the write itself fails, as on a full disk.
!> - HDF5 does not survive every failed allocation of its own: before it is called there must be
!>   room for what it asks.
module runtime_failures_mod
  use, intrinsic :: iso_c_binding, only: c_char, c_int, c_intptr_t, c_size_t
  use errors_mod, only: error_t, raise, exit_machine
  use kinds_mod, only: i8
  use standard_streams_mod, only: write_to, standard_error
  implicit none
  private

  public :: meet_runtime_failures, check_library_room

  integer(c_int), parameter :: sigxfsz = 25     !! on Linux
  integer(c_intptr_t), parameter :: sig_ign = 1

  interface
    !> C: what is done at a signal; the handler as an address.
    function c_signal(number, handler) result(before) bind(c, name='signal')
      import :: c_int, c_intptr_t
      implicit none
      integer(c_int), value :: number
      integer(c_intptr_t), value :: handler
      integer(c_intptr_t) :: before
    end function c_signal

    !> POSIX: end the process now, without cleaning up, which would need memory.
    subroutine c_exit_now(status) bind(c, name='_exit')
      import :: c_int
      implicit none
      integer(c_int), value :: status
    end subroutine c_exit_now

    pure function c_length(text) result(length) bind(c, name='strlen')
      import :: c_char, c_size_t
      implicit none
      character(c_char), intent(in) :: text(*)
      integer(c_size_t) :: length
    end function c_length
  end interface

contains

  !> To be called first of all.
  subroutine meet_runtime_failures()
    integer(c_intptr_t) :: before

    before = c_signal(sigxfsz, sig_ign)
    if (before == sig_ign) return
  end subroutine meet_runtime_failures

  !> Refuse to go on where a limit (ulimit -v, ulimit -d) leaves libraries no memory to work in.
  subroutine check_library_room(bytes, error)
    integer(i8), intent(in) :: bytes !! that they may ask for
    type(error_t), allocatable, intent(out) :: error !! no memory
    character(c_char), allocatable :: probe(:)
    integer :: status

    allocate (probe(bytes), stat=status)
    if (status /= 0) call raise(error, exit_machine, 'bipot: error: not enough memory to write '// &
      'the result file: the limits of the process (ulimit -v, ulimit -d) are reached')
  end subroutine check_library_room

  !> In the place of the run-time library's procedure: a failed ALLOCATE. Does not return.
  subroutine os_error_at(place, message, bytes) bind(c, name='_gfortran_os_error_at')
    character(c_char), intent(in) :: place(*)   !! "In file '...', around line ..."
    character(c_char), intent(in) :: message(*) !! 'Error allocating %lu bytes'
    integer(c_size_t), value :: bytes           !! that were asked for
    character(20) :: number
    integer(c_size_t) :: left
    integer :: first

    if (place(1) == message(1)) continue ! the compiler's words say nothing to a user
    number = ''
    first = len(number) + 1
    left = max(bytes, 1_c_size_t)
    do while (left > 0 .and. first > 1)
      first = first - 1
      number(first:first) = achar(iachar('0') + int(mod(left, 10_c_size_t)))
      left = left/10_c_size_t
    end do
    call begin_message()
    call write_to(standard_error, 'not enough memory (')
    call write_to(standard_error, number(first:))
    call write_to(standard_error, ' bytes were asked for); increments that were written are in '// &
      'the result file')
    call end_program()
  end subroutine os_error_at

  !> In the place of the run-time library's procedure: an ALLOCATE of more bytes than can be
  !> counted. Does not return.
  subroutine runtime_error(message) bind(c, name='_gfortran_runtime_error')
    character(c_char), intent(in) :: message(*)
    integer :: i

    call begin_message()
    do i = 1, int(c_length(message))
      call write_to(standard_error, message(i))
    end do
    call end_program()
  end subroutine runtime_error

  ! Texts are written piece by piece: putting them together would take memory.

  subroutine begin_message()
    call write_to(standard_error, new_line('a'))
    call write_to(standard_error, 'bipot: error: ')
  end subroutine begin_message

  subroutine end_program()
    call write_to(standard_error, new_line('a'))
    call c_exit_now(int(exit_machine, c_int))
  end subroutine end_program

end module runtime_failures_mod
