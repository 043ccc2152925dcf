!> Work in a child process, so that a library that crashes or never ends over what it is given takes
!> the child with it and not the program.
!>
!>     call begin_child(seconds, bytes, child)
!>     if (is_child(child)) then
!>       ...                       ! whatever may go wrong
!>       call end_child(child, answer)
!>     end if
!>     call wait_for(child, answer, fate)
module child_process_mod
  use, intrinsic :: iso_c_binding, only: c_int, c_int64_t, c_intptr_t, c_loc, c_size_t
  use kinds_mod, only: i8
  use libc_mod, only: c_close, c_exit_at_once, c_fork, c_getrlimit, c_pipe, c_read, c_setrlimit, &
    c_signal, c_waitpid, c_write, sig_dfl, sig_ign, sigabrt, sigbus, sigfpe, sigill, sigint, &
    sigsegv, sigterm, sigxcpu
  implicit none
  private

  public :: child_t, begin_child, is_child, end_child, wait_for

  integer, parameter :: longest_answer = 4096 !! which a pipe takes at once

  !> A process that was started, or the child itself.
  type :: child_t
    private
    integer(c_int) :: process = -1 !! 0 in the child, -1 where there is none
    integer(c_int) :: ends(2) = -1 !! of the pipe: to read, to write
    integer :: seconds = 0
  end type child_t

contains

  !> Start a child that goes on here, too, with limits of its own. SIGINT and SIGTERM are the
  !> parent's to heed. A crash is the parent's to tell: the run-time library, which would write a
  !> backtrace first, does not hear of it.
  subroutine begin_child(seconds, bytes, child)
    integer, intent(in) :: seconds   !! that it may take of the processor
    integer(i8), intent(in) :: bytes !! of addresses that it may reserve beside what there is
    type(child_t), intent(out) :: child
    integer(c_int), parameter :: cpu_time = 0, core_size = 4, address_space = 9 ! of Linux
    integer(c_int), parameter :: crashes(*) = [sigill, sigabrt, sigbus, sigfpe, sigsegv, sigxcpu]
    integer(c_intptr_t) :: before
    integer :: i

    child%seconds = seconds
    if (c_pipe(child%ends) /= 0) return
    child%process = c_fork()
    if (child%process > 0) then
      call close_end(child%ends(2))
    else if (child%process < 0) then
      call close_end(child%ends(1))
      call close_end(child%ends(2))
    else
      before = c_signal(sigint, sig_ign)
      before = c_signal(sigterm, sig_ign)
      do i = 1, size(crashes)
        before = c_signal(crashes(i), sig_dfl)
      end do
      call lower_limit(cpu_time, int(seconds, i8))
      call lower_limit(core_size, 0_i8)
      if (reserved_bytes() > 0) call lower_limit(address_space, reserved_bytes() + bytes)
    end if
  end subroutine begin_child

  !> Whether this is the child.
  pure logical function is_child(child)
    type(child_t), intent(in) :: child

    is_child = child%process == 0
  end function is_child

  !> Give the parent the answer and end; does not return.
  subroutine end_child(child, answer)
    type(child_t), intent(in) :: child
    character(*), intent(in) :: answer !! of more than `longest_answer` bytes the first ones
    character(:), allocatable :: text
    integer(c_intptr_t) :: written

    text = answer(:min(len(answer), longest_answer - 1))//achar(0)
    written = c_write(child%ends(2), text, len(text, c_size_t))
    call c_exit_at_once(merge(0_c_int, 1_c_int, written == len(text)))
  end subroutine end_child

  !> Wait for the end of the child.
  subroutine wait_for(child, answer, fate)
    type(child_t), intent(inout) :: child
    character(:), allocatable, intent(out) :: answer !! empty where it gave none
    character(:), allocatable, intent(out) :: fate
    !! empty where it gave its answer, else what it ended with: "signal 11"
    character(longest_answer), target :: text
    character(4) :: number
    integer(c_intptr_t) :: got
    integer(c_int) :: status
    integer :: tries
    integer, parameter :: interruptions = 100

    answer = ''
    fate = 'it could not be started'
    if (child%process < 0) return
    status = 0
    do tries = 1, interruptions
      if (c_waitpid(child%process, status, 0_c_int) == child%process) exit
    end do
    got = c_read(child%ends(1), c_loc(text), len(text, c_size_t))
    call close_end(child%ends(1))
    child%process = -1
    fate = ''
    if (got > 0) then
      if (text(got:got) == achar(0)) answer = text(:got - 1)
      if (text(got:got) == achar(0)) return
    end if
    ! What waitpid tells: the signal in the lowest seven bits, the exit status in the next byte.
    if (iand(status, 127_c_int) == sigxcpu) then
      write (number, '(i0)') min(9999, child%seconds)
      fate = 'no end within '//trim(number)//' s'
    else if (iand(status, 127_c_int) > 0) then
      write (number, '(i0)') iand(status, 127_c_int)
      fate = 'signal '//trim(number)
    else
      write (number, '(i0)') ishft(status, -8)
      fate = 'exit status '//trim(number)
    end if
  end subroutine wait_for

  subroutine close_end(descriptor)
    integer(c_int), intent(inout) :: descriptor

    if (c_close(descriptor) == 0) descriptor = -1
  end subroutine close_end

  !> Lower a limit of this process, where it is higher.
  subroutine lower_limit(resource, value)
    integer(c_int), intent(in) :: resource
    integer(i8), intent(in) :: value
    integer(c_int64_t) :: limits(2)

    if (c_getrlimit(resource, limits) /= 0) return
    ! No limit is the largest number without a sign, which is negative here.
    if (limits(1) >= 0 .and. limits(1) <= value) return
    limits(1) = value
    if (c_setrlimit(resource, limits) /= 0) return
  end subroutine lower_limit

  !> Addresses that this process has reserved [bytes]; 0 where the system does not tell.
  integer(i8) function reserved_bytes() result(bytes)
    integer(i8), parameter :: page = 4096
    integer :: unit, status

    bytes = 0
    open (newunit=unit, file='/proc/self/statm', action='read', status='old', iostat=status)
    if (status /= 0) return
    read (unit, *, iostat=status) bytes
    if (status /= 0) bytes = 0
    bytes = page*bytes
    close (unit)
  end function reserved_bytes

end module child_process_mod
