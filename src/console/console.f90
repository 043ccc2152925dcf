!> What a run prints: the plan, a line an increment, the closing sentence. On a terminal also a
!> progress bar.
module console_mod
  use kinds_mod, only: wp, i8
  use text_mod, only: string_t, to_text, percent
  use standard_streams_mod, only: write_to, standard_output
  use system_mod, only: output_is_terminal, wall_seconds
  use parallel_mod, only: has_launcher
  use increments_mod, only: increment_t
  use controls_mod, only: solver_sweeps, solver_global_newton
  use increment_report_mod, only: increment_report_t, error_parts_t, worst_entry, status_open, &
    status_stick, status_slide
  implicit none
  private

  public :: console_t, open_console, say, print_lines, print_increment, print_warning, clear_bar, &
    seconds_in_words, solver_name

  !> Where and how to print.
  type :: console_t
    logical  :: quiet = .false.
    logical  :: terminal = .false.
    real(wp) :: started = 0.0_wp
    logical  :: headed = .false.
  end type console_t

  integer, parameter :: bar_width = 30

contains

  !> A console for a run that starts now.
  function open_console(quiet) result(console)
    logical, intent(in) :: quiet
    type(console_t) :: console

    console%quiet = quiet
    console%started = wall_seconds()
    if (quiet) return
    console%terminal = output_is_terminal()
    ! mpirun gives its processes a terminal of their own, wherever it writes itself.
    if (has_launcher()) console%terminal = .false.
  end function open_console

  !> Print one line, even when quiet.
  subroutine say(text)
    character(*), intent(in) :: text

    call write_to(standard_output, text//new_line('a'))
  end subroutine say

  !> Print lines unless quiet.
  subroutine print_lines(console, lines)
    type(console_t), intent(in) :: console
    type(string_t), intent(in) :: lines(:)
    integer :: i

    if (console%quiet) return
    do i = 1, size(lines)
      call say(lines(i)%text)
    end do
  end subroutine print_lines

  !> Print a warning; never suppressed.
  subroutine print_warning(console, text)
    type(console_t), intent(in) :: console
    character(*), intent(in) :: text

    call clear_bar(console)
    call say('warning: '//text)
  end subroutine print_warning

  !> One line for an increment and, on a terminal, the bar with the time left.
  subroutine print_increment(console, increment, done, report)
    type(console_t), intent(inout) :: console
    type(increment_t), intent(in) :: increment
    real(wp), intent(in) :: done  !! of the run, 0 to 1
    type(increment_report_t), intent(in) :: report
    character(160) :: line
    real(wp) :: elapsed

    if (console%quiet) return
    call clear_bar(console)
    if (.not. console%headed) call say( &
      'step   inc        time    open   stick   slide  iterations   residual  worst error'// &
      '      s  solver')
    console%headed = .true.
    associate (status => report%contact%status)
      write (line, '(i4,i6,a12,3i8,i12,2es11.1,f11.2)') increment%step, increment%number, &
        to_text(increment%time), count(status == status_open), count(status == status_stick), &
        count(status == status_slide), report%contact_iterations, report%residual, &
        worst_entry(report%certificate), report%wall_time
    end associate
    line = trim(line)//'  '//solver_name(report%solver)
    if (report%solver_stages == 2) line = trim(line)//', after one that missed the tolerance'
    if (report%solver_stages > 2) line = trim(line)//', after '// &
      to_text(report%solver_stages - 1)//' that missed the tolerance'
    if (.not. report%certificate%certified) line = trim(line)//'  not certified'
    call say(trim(line))
    if (report%errors%mesh >= 0.0_wp) call say('      estimated error: '// &
      errors_in_words(report%errors))
    if (.not. console%terminal .or. done >= 1.0_wp) return
    elapsed = wall_seconds() - console%started
    call draw_bar(done, elapsed*(1.0_wp - done)/done)
  end subroutine print_increment

  !> Mesh 0.6 %, load steps 0.01 %, contact 2e-10, arithmetic 1e-12.
  pure function errors_in_words(errors) result(words)
    type(error_parts_t), intent(in) :: errors
    character(:), allocatable :: words

    words = 'mesh '//percent(errors%mesh)
    if (errors%load_steps >= 0.0_wp) words = words//', load steps '//percent(errors%load_steps)
    words = words//', contact '//percent(errors%contact)//', arithmetic '// &
      percent(errors%arithmetic)
  end function errors_in_words

  !> A contact solver as the console calls it.
  pure function solver_name(solver) result(name)
    integer, intent(in) :: solver !! as in /history/solver
    character(:), allocatable :: name

    select case (solver)
    case (solver_sweeps)
      name = 'sweeps'
    case (solver_global_newton)
      name = 'global Newton'
    case default
      name = 'none'
    end select
  end function solver_name

  subroutine draw_bar(fraction, left)
    real(wp), intent(in) :: fraction !! done, 0 to 1
    real(wp), intent(in) :: left  !! [s]
    integer :: done

    done = int(fraction*bar_width)
    call write_to(standard_output, '['//repeat('#', done)//repeat('.', bar_width - done)//'] '// &
      to_text(int(100.0_wp*fraction))//' %, '//seconds_in_words(left)//' left')
  end subroutine draw_bar

  !> Wipe the bar off the terminal's last line.
  subroutine clear_bar(console)
    type(console_t), intent(in) :: console

    if (.not. console%terminal) return
    call write_to(standard_output, achar(13)//achar(27)//'[K')
  end subroutine clear_bar

  !> 0.32 s, 12 s, 3 min 20 s, 2 h 5 min.
  pure function seconds_in_words(seconds) result(words)
    real(wp), intent(in) :: seconds
    character(:), allocatable :: words
    integer(i8) :: whole

    whole = nint(max(0.0_wp, seconds), i8)
    if (seconds < 9.995_wp) then
      words = to_text(max(0.0_wp, seconds), 2)//' s'
    else if (whole < 60) then
      words = to_text(whole)//' s'
    else if (whole < 3600) then
      words = to_text(whole/60)//' min '//to_text(mod(whole, 60_i8))//' s'
    else
      words = to_text(whole/3600)//' h '//to_text(mod(whole, 3600_i8)/60)//' min'
    end if
  end function seconds_in_words

end module console_mod
