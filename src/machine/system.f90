!> What the program asks of the machine it runs on: clocks, memory, the terminal, signals.
module system_mod
  use, intrinsic :: iso_c_binding, only: c_char, c_funloc, c_int, c_intptr_t, &
    c_null_char, c_size_t
  use, intrinsic :: iso_fortran_env, only: compiler_version, compiler_options
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t, raise, exit_signal
  use libc_mod, only: c_alarm, c_exit_at_once, c_isatty, c_raise, c_setenv, c_signal, c_unlink, &
    c_usleep, c_write, sig_ign, sigalrm, sigint, sigterm
  implicit none
  private

  public :: wall_seconds, cpu_seconds, peak_memory_bytes, output_is_terminal, utc_now, &
    build_description, sleep_for, set_environment, processor_flags, catch_signals, &
    stop_if_signalled, pass_on_sigterm

  !> The first signal that came; 0: none.
  integer(c_int), volatile :: caught = 0
  !> File that is of no use unless it is complete, for the handler to remove.
  character(c_char) :: unfinished(4096) = c_null_char

contains

  !> Seconds on a clock that does not stop; only differences mean anything.
  real(wp) function wall_seconds() result(seconds)
    integer(i8) :: count, rate

    call system_clock(count, rate)
    seconds = real(count, wp)/real(rate, wp)
  end function wall_seconds

  !> Seconds of processor time used by the process so far, all threads.
  real(wp) function cpu_seconds() result(seconds)

    call cpu_time(seconds)
  end function cpu_seconds

  !> The first processor's flags, a blank before and behind each; empty where the system does not
  !> tell.
  function processor_flags() result(flags)
    character(:), allocatable :: flags
    character(8192) :: line
    integer :: unit, status

    flags = ''
    open (newunit=unit, file='/proc/cpuinfo', action='read', status='old', iostat=status)
    if (status /= 0) return
    do
      read (unit, '(a)', iostat=status) line
      if (status /= 0) exit
      if (line(:5) /= 'flags') cycle
      flags = ' '//trim(line(index(line, ':') + 1:))//' '
      exit
    end do
    close (unit)
  end function processor_flags

  !> Give a variable of the environment a value, for this process and what it starts.
  subroutine set_environment(name, value, replace, worked)
    character(*), intent(in) :: name, value
    logical, intent(in) :: replace !! a value that it has already
    logical, intent(out) :: worked

    worked = c_setenv(name//c_null_char, value//c_null_char, merge(1_c_int, 0_c_int, replace)) == 0
  end subroutine set_environment

  !> Leave the processor to others for a moment.
  subroutine sleep_for(seconds)
    real(wp), intent(in) :: seconds !! 0 to 0.9 [s]
    integer(c_int) :: status

    status = c_usleep(int(1.0e6_wp*max(0.0_wp, min(0.9_wp, seconds)), c_int))
    if (status /= 0) return ! a signal cuts it short
  end subroutine sleep_for

  !> The largest resident memory of the process so far; 0 where the system does not tell.
  integer(i8) function peak_memory_bytes() result(bytes)
    integer :: unit, status
    character(256) :: line

    bytes = 0
    open (newunit=unit, file='/proc/self/status', action='read', status='old', iostat=status)
    if (status /= 0) return
    do
      read (unit, '(a)', iostat=status) line
      if (status /= 0) exit
      if (line(:6) /= 'VmHWM:') cycle
      read (line(7:index(line, 'kB') - 1), *, iostat=status) bytes
      if (status /= 0) bytes = 0
      bytes = 1024*bytes
      exit
    end do
    close (unit)
  end function peak_memory_bytes

  !> Whether standard output goes to a terminal.
  logical function output_is_terminal() result(terminal)
    character(8) :: kind

    call get_environment_variable('TERM', kind)
    terminal = c_isatty(1_c_int) == 1 .and. kind /= '' .and. kind /= 'dumb'
  end function output_is_terminal

  !> Date and time as in 2026-03-01T12:00:00Z.
  function utc_now() result(text)
    character(20) :: text
    integer :: v(8), minutes, day_shift

    call date_and_time(values=v)
    ! v(4) is the zone in minutes: taken off, with at most one day of carry.
    minutes = 60*v(5) + v(6) - v(4)
    day_shift = (minutes - modulo(minutes, 1440))/1440
    minutes = minutes - 1440*day_shift
    call shift_day(v(1), v(2), v(3), day_shift)
    write (text, '(i4.4,2("-",i2.2),"T",i2.2,2(":",i2.2),"Z")') v(1:3), minutes/60, &
      mod(minutes, 60), v(7)
  end function utc_now

  !> Move a date of the Gregorian calendar by at most one day.
  pure subroutine shift_day(year, month, day, shift)
    integer, intent(inout) :: year, month, day
    integer, intent(in) :: shift !! -1, 0 or 1

    day = day + shift
    if (day > days_in(year, month)) then
      day = 1
      month = month + 1
    else if (day < 1) then
      month = month - 1
      day = days_in(year, modulo(month - 1, 12) + 1)
    end if
    if (month > 12) then
      month = 1
      year = year + 1
    else if (month < 1) then
      month = 12
      year = year - 1
    end if
  end subroutine shift_day

  pure integer function days_in(year, month) result(days)
    integer, intent(in) :: year, month
    integer, parameter :: common(12) = [31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31]

    days = common(month)
    if (month == 2 .and. (mod(year, 400) == 0 .or. (mod(year, 4) == 0 .and. &
      mod(year, 100) /= 0))) days = 29
  end function days_in

  !> The compiler and its options, as they made this program.
  function build_description() result(text)
    character(:), allocatable :: text

    text = compiler_version()//' '//compiler_options()
  end function build_description

  ! ------------------------------------------------------------------ signals

  !> From now on SIGINT and SIGTERM are noted, and stop_if_signalled says so. The process has a
  !> second to come to it; then it ends wherever it is, as at a second signal, with the status that
  !> a shell gives it. A signal that is ignored (nohup, jobs in the background) stays ignored.
  subroutine catch_signals(to_remove)
    character(*), intent(in), optional :: to_remove
    !! a file, on such an end; not present: another process tells this one when to stop
    integer(c_int), parameter :: numbers(2) = [sigint, sigterm]
    integer(c_intptr_t) :: before
    integer :: i

    unfinished(1) = c_null_char
    if (present(to_remove)) then
      if (len(to_remove) < size(unfinished)) unfinished(:len(to_remove) + 1) = transfer( &
        to_remove//c_null_char, unfinished)
      before = c_signal(sigalrm, transfer(c_funloc(end_at_once), before))
    else
      before = c_signal(sigalrm, sig_ign)
    end if
    do i = 1, size(numbers)
      before = c_signal(numbers(i), transfer(c_funloc(note_signal), before))
      if (before == sig_ign) before = c_signal(numbers(i), sig_ign)
    end do
  end subroutine catch_signals

  !> Where a signal was caught: an error that says so, and ends the run. It may take its time.
  subroutine stop_if_signalled(error)
    type(error_t), allocatable, intent(out) :: error
    integer(c_int) :: left

    if (caught == 0) return
    call raise(error, int(exit_signal + caught), 'stopped by '//trim(merge('SIGINT ', 'SIGTERM', &
      caught == sigint)))
    left = c_alarm(0_c_int)
    if (left /= 0) return
  end subroutine stop_if_signalled

  !> Send this process a SIGTERM that a library took for its own.
  subroutine pass_on_sigterm()
    integer(c_int) :: status

    status = c_raise(sigterm)
    if (status /= 0) return
  end subroutine pass_on_sigterm

  !> The handler. It may come at any moment, while it is at work too, so it does nothing but what
  !> signals allow.
  recursive subroutine note_signal(number) bind(c)
    integer(c_int), value :: number
    character(*), parameter :: words = new_line('a')//'bipot: stopping within a second; a '// &
      'second signal stops at once'//new_line('a')
    integer(c_int) :: left

    if (caught /= 0) call c_exit_at_once(exit_signal + number)
    caught = number
    call tell(words)
    left = c_alarm(1_c_int)
    if (left /= 0) return
  end subroutine note_signal

  !> The handler of what comes a second later, where nothing has stopped in order. Whatever is lost
  !> is what a kill would lose: an increment that is not in the file.
  recursive subroutine end_at_once(number) bind(c)
    integer(c_int), value :: number
    character(*), parameter :: some = 'bipot: stopped within an increment; those before it, if '// &
      'any, are in the file, and --continue goes on'//new_line('a')
    character(*), parameter :: none = 'bipot: stopped before an increment was finished'// &
      new_line('a')

    if (number /= sigalrm .or. caught == 0) return ! from elsewhere
    if (c_unlink(unfinished) == 0) then
      call tell(none)
    else
      call tell(some)
    end if
    call c_exit_at_once(exit_signal + caught)
  end subroutine end_at_once

  !> Say something from within a handler.
  recursive subroutine tell(words)
    character(*), intent(in) :: words
    integer(c_int), parameter :: standard_error = 2
    integer(c_intptr_t) :: written

    written = c_write(standard_error, words, int(len(words), c_size_t))
    if (written < 0) return
  end subroutine tell

end module system_mod
