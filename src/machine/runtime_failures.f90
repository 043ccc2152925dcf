!> What the compiler's run-time library and the system would end the program for, met in the
!> program's own way.
!>
!> - Where there is no memory, compiled Fortran either ends the program with exit status 1, which
!>   stands for a wrong deck (ALLOCATE), or writes to address 0 (an assignment that makes its left
!>   side grow, a temporary). So the linker puts the procedures below in the place of malloc,
!>   realloc and calloc for the program's own code (--wrap in src/CMakeLists.txt): a request that
!>   is refused ends the program with one sentence on standard error and exit status 3. What the
!>   result file has counted is in it. Who can do better asks `has_memory` first.
!> - An ALLOCATE whose bytes cannot be counted calls the library's procedure `runtime_error`, which
!>   would end the program with exit status 2, an increment that was not solved.
!> - A file that grows past the limit on files (ulimit -f) makes the system send SIGXFSZ, which
!>   would kill the program. Ignored, the write itself fails, as on a full disk.
!> - Text to a pipe that nobody reads any more (`| head -1`) makes it send SIGPIPE, which would kill
!>   the program between two increments. Ignored, the write fails, and the run goes on without a
!>   console.
module runtime_failures_mod
  use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_int, c_intptr_t, c_loc, c_ptr, &
    c_size_t
  use errors_mod, only: exit_machine
  use libc_mod, only: c_exit_at_once, c_signal, c_strlen, real_calloc, real_malloc, real_realloc, &
    sig_ign, sigpipe, sigxfsz
  use standard_streams_mod, only: write_to, standard_error
  implicit none
  private

  public :: meet_runtime_failures

contains

  !> To be called before anything else but the opening of the standard streams.
  subroutine meet_runtime_failures()
    integer(c_intptr_t) :: before

    before = c_signal(sigpipe, sig_ign)
    before = c_signal(sigxfsz, sig_ign)
    if (before == sig_ign) return
  end subroutine meet_runtime_failures

  !> In the place of C's malloc, for the program's own code.
  type(c_ptr) function checked_malloc(bytes) result(address) bind(c, name='__wrap_malloc')
    integer(c_size_t), value :: bytes

    address = real_malloc(bytes)
    if (.not. c_associated(address)) call refuse(bytes)
  end function checked_malloc

  !> In the place of C's realloc.
  type(c_ptr) function checked_realloc(old, bytes) result(address) bind(c, name='__wrap_realloc')
    type(c_ptr), value :: old
    integer(c_size_t), value :: bytes

    address = real_realloc(old, bytes)
    if (.not. c_associated(address) .and. bytes > 0) call refuse(bytes)
  end function checked_realloc

  !> In the place of C's calloc.
  type(c_ptr) function checked_calloc(n, bytes) result(address) bind(c, name='__wrap_calloc')
    integer(c_size_t), value :: n, bytes

    address = real_calloc(n, bytes)
    if (.not. c_associated(address)) call refuse(n*bytes)
  end function checked_calloc

  !> No memory. Does not return; allocates nothing.
  subroutine refuse(bytes)
    integer(c_size_t), intent(in) :: bytes !! that were asked for
    character(20) :: number
    integer(c_size_t) :: left
    integer :: first

    number = ''
    first = len(number) + 1
    left = max(bytes, 1_c_size_t)
    do while (left > 0 .and. first > 1)
      first = first - 1
      number(first:first) = achar(iachar('0') + int(mod(left, 10_c_size_t)))
      left = left/10_c_size_t
    end do
    call begin_message()
    call write_to(standard_error, 'not enough memory: ')
    call write_to(standard_error, number(first:))
    call write_to(standard_error, ' bytes were refused (increments written before are kept)')
    call end_program()
  end subroutine refuse

  !> In the place of the run-time library's procedure: an ALLOCATE of more bytes than can be
  !> counted. Does not return.
  subroutine runtime_error(message) bind(c, name='_gfortran_runtime_error')
    character(c_char), target, intent(in) :: message(*)
    integer :: i

    call begin_message()
    do i = 1, int(c_strlen(c_loc(message)))
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
    call c_exit_at_once(int(exit_machine, c_int))
  end subroutine end_program

end module runtime_failures_mod
