!> What a run prints: the plan, a line an increment, the closing sentence. Progress and the time
!> left stand below the lines on a terminal, with a bar, and else at their ends. There are no
!> colours.
module console_mod
  use kinds_mod, only: wp, i8
  use text_mod, only: string_t, to_text, percent
  use idle_processors_mod, only: processor_time_t, processor_time
  use standard_streams_mod, only: write_to, standard_output
  use progress_line_mod, only: wipe_line
  use system_mod, only: output_is_terminal, wall_seconds, cpu_seconds
  use parallel_mod, only: has_launcher
  use increments_mod, only: increment_t
  use controls_mod, only: solver_sweeps, solver_global_newton
  use increment_report_mod, only: increment_report_t, error_parts_t, worst_entry, told_theory, &
    status_open, &
    status_stick, status_slide
  implicit none
  private

  public :: console_t, open_console, count_from, say, print_lines, print_increment, &
    print_warning, clear_bar, seconds_in_words, solver_name, theory_in_words, &
    theory_worth_naming, theory_part, corrected_plan

  !> Where and how to print.
  type :: console_t
    logical  :: quiet = .false.
    logical  :: verbose = .false.
    logical  :: is_one_of = .false.    !! of several runs, which have one table
    logical  :: terminal = .false.
    logical  :: of_energy = .false.    !! they are of the energy, not of the contact force
    real(wp) :: started = 0.0_wp
    type(processor_time_t) :: began    !! what processors had done then
    logical  :: headed = .false.
    integer  :: total = 0              !! increments of the deck, over the run
    real(wp) :: counted = 0.0_wp       !! of them done where the time left is counted from
    real(wp) :: counted_at = 0.0_wp    !! on the clock [s]
    real(wp) :: processor_at = 0.0_wp  !! time of the processor then [s]
    real(wp) :: planned = 0.0_wp       !! the same at the end by the plan, 0: not known [s]
  end type console_t

  integer, parameter :: bar_width = 30
  real(wp), parameter :: enough = 2.0_wp !! increments behind the first that tell how long all take

contains

  !> A console for a run that starts now.
  type(console_t) function open_console(quiet, verbose) result(console)
    logical, intent(in) :: quiet, verbose

    console%quiet = quiet
    console%verbose = verbose
    console%started = wall_seconds()
    console%began = processor_time()
    if (quiet) return
    console%terminal = output_is_terminal()
    ! mpirun gives its processes a terminal of their own, wherever it writes itself.
    if (has_launcher()) console%terminal = .false.
  end function open_console

  !> Count the time left from here.
  subroutine count_from(console, done, total)
    type(console_t), intent(inout) :: console
    real(wp), intent(in) :: done !! increments of the deck
    integer, intent(in) :: total !! of them in the run

    console%total = total
    console%counted = done
    console%counted_at = wall_seconds()
    console%processor_at = cpu_seconds()
  end subroutine count_from

  !> Print one line, even when quiet.
  subroutine say(text)
    character(*), intent(in) :: text

    call write_to(standard_output, text//new_line('a'))
  end subroutine say

  !> Print lines unless quiet.
  subroutine print_lines(console, lines, before)
    type(console_t), intent(in) :: console
    type(string_t), intent(in) :: lines(:)
    character(*), intent(in), optional :: before !! what each of them begins with
    integer :: i

    if (console%quiet) return
    do i = 1, size(lines)
      if (present(before)) then
        call say(before//lines(i)%text)
      else
        call say(lines(i)%text)
      end if
    end do
  end subroutine print_lines

  !> Print a warning; never suppressed.
  subroutine print_warning(console, text)
    type(console_t), intent(in) :: console
    character(*), intent(in) :: text

    call clear_bar(console)
    call say('warning: '//text)
  end subroutine print_warning

  !> One line for an increment, how much of the run is done, and the time left. One of several runs
  !> only shows how far it is, on a terminal.
  subroutine print_increment(console, increment, done, report)
    type(console_t), intent(inout) :: console
    type(increment_t), intent(in) :: increment
    real(wp), intent(in) :: done  !! increments of the deck, over the run
    type(increment_report_t), intent(in) :: report
    character(160) :: line
    character(:), allocatable :: progress, words

    if (console%quiet) return
    call clear_bar(console)
    ! The first one has the factorisation in it, which those that follow do not: it tells no time.
    if (.not. console%headed) call count_from(console, done, console%total)
    progress = progress_in_words(console, done)
    if (console%verbose .or. .not. console%is_one_of) then
      if (.not. console%headed) call say( &
        'step   inc        time    open   stick   slide  iterations  worst error      s'// &
        trim(merge('   residual  solver', repeat(' ', 19), console%verbose)))
      associate (status => report%contact%status)
        write (line, '(i4,i6,a12,3i8,i12,es13.1,f7.2)') increment%step, increment%number, &
          to_text(increment%time), count(status == status_open), count(status == status_stick), &
          count(status == status_slide), report%contact_iterations, &
          worst_entry(report%certificate), report%wall_time
      end associate
      if (console%verbose) line = trim(line)//solver_in_words(report)
      if (.not. report%certificate%certified) line = trim(line)//'  not certified'
      if (.not. console%terminal) line = trim(line)//'  '//progress
      call say(trim(line))
    end if
    console%headed = .true.
    if (report%errors%mesh >= 0.0_wp .and. .not. console%is_one_of) call say( &
      '      estimated error of the '//trim(merge('energy       ', 'contact force', &
      console%of_energy))//': '//errors_in_words(report%errors))
    if (done >= console%counted + enough) then
      words = corrected_plan(console, done, cpu_seconds())
      if (words /= '') call say(words)
      console%planned = 0.0_wp
    end if
    if (console%terminal .and. done < console%total) call draw_bar(done/console%total, progress)
  end subroutine print_increment

  !> How long the run will take by its first increments, where the plan is off by more than a factor
  !> 2; '' where it is not.
  pure function corrected_plan(console, done, now) result(words)
    type(console_t), intent(in) :: console
    real(wp), intent(in) :: done !! increments of the deck, over the run
    real(wp), intent(in) :: now  !! time of the processor [s]
    character(:), allocatable :: words
    real(wp), parameter :: off = 2.0_wp    !! [-]
    real(wp), parameter :: brief = 2.0_wp  !! of no account [s]
    real(wp) :: foreseen

    words = ''
    if (.not. console%planned > 0.0_wp .or. done >= console%total) return
    foreseen = now + (now - console%processor_at)*(console%total - done)/(done - console%counted)
    if (max(foreseen, console%planned) <= brief .or. max(foreseen/console%planned, &
      console%planned/foreseen) <= off) return
    words = 'note: by the first increments the run takes about '//seconds_in_words(foreseen)// &
      ' of CPU time, not the plan''s '//seconds_in_words(console%planned)
  end function corrected_plan

  !> The residual of contact, and the solver that reached it.
  function solver_in_words(report) result(words)
    type(increment_report_t), intent(in) :: report
    character(:), allocatable :: words
    character(11) :: residual

    write (residual, '(es11.1)') report%residual
    words = residual//'  '//solver_name(report%solver)
    if (report%solver_stages == 2) words = words//', after one that missed the tolerance'
    if (report%solver_stages > 2) words = words//', after '// &
      to_text(report%solver_stages - 1)//' that missed the tolerance'
  end function solver_in_words

  !> 7 of 50, 3 min 20 s left.
  function progress_in_words(console, done) result(words)
    type(console_t), intent(in) :: console
    real(wp), intent(in) :: done !! increments of the deck
    character(:), allocatable :: words

    words = to_text(int(done))//' of '//to_text(console%total)
    if (done >= console%total .or. done <= console%counted) return
    words = words//', '//seconds_in_words((wall_seconds() - console%counted_at)* &
      (console%total - done)/(done - console%counted))//' left'
  end function progress_in_words

  !> Mesh 0.6 %, load steps 0.01 %, contact 2e-10, arithmetic 1e-12.
  pure function errors_in_words(errors) result(words)
    type(error_parts_t), intent(in) :: errors
    character(:), allocatable :: words

    words = 'mesh '//percent(errors%mesh)
    if (errors%geometry < 0.0_wp) then
      words = words//', geometry not known'
    else if (errors%geometry > 0.0_wp) then
      words = words//', geometry '//percent(errors%geometry)
    end if
    if (errors%load_steps >= 0.0_wp) words = words//', load steps '//percent(errors%load_steps)
    words = words//', contact '//percent(errors%contact)//', arithmetic '// &
      percent(errors%arithmetic)
    if (errors%theory > 0.0_wp .or. errors%follows_theory) words = words//'; small strain: '// &
      theory_part(errors%theory, errors%follows_theory, errors%of_law)
  end function errors_in_words

  !> At most 5.7 %; 2.1 %; 6.5 %, or 3.1 % by neo-Hooke's law.
  pure function theory_part(error, is_estimate, of_law) result(words)
    real(wp), intent(in) :: error       !! of small strain, as of error_parts_t [-]
    logical, intent(in) :: is_estimate  !! else a bound
    real(wp), intent(in), optional :: of_law(2)
    !! estimates with the deck's law and, not negative, another one: told in its place [-]
    character(:), allocatable :: words

    words = or_not_known(told_theory(error, is_estimate))
    if (.not. is_estimate .and. told_theory(error, .false.) < huge(1.0_wp)) words = 'at most '// &
      words
    if (.not. (is_estimate .and. present(of_law))) return
    words = or_not_known(of_law(1))
    if (of_law(2) >= 0.0_wp .and. minval(of_law) < huge(1.0_wp)) words = words//', or '// &
      or_not_known(of_law(2))//' by neo-Hooke''s law'

  contains

    pure function or_not_known(error) result(part)
      real(wp), intent(in) :: error
      character(:), allocatable :: part

      part = 'not known'
      if (error < huge(1.0_wp)) part = percent(error)
    end function or_not_known

  end function theory_part

  !> The error of small strain where it is worth naming: large, or more than the accuracy asked for,
  !> which is that of the small-strain solution; else 0.
  pure real(wp) function theory_worth_naming(error, wanted) result(named)
    real(wp), intent(in) :: error  !! [-]
    real(wp), intent(in) :: wanted !! accuracy, 0: none [-]
    real(wp), parameter :: large = 0.1_wp !! within which engineers take small strain for granted
    real(wp) :: allowed

    allowed = large
    if (wanted > 0.0_wp) allowed = min(large, wanted)
    named = merge(error, 0.0_wp, error > allowed)
  end function theory_worth_naming

  !> What goes behind a promise of a small-strain solution; '' where small strain is not in doubt.
  pure function theory_in_words(error, is_estimate) result(words)
    real(wp), intent(in) :: error !! of small strain, 0: not worth naming [-]
    logical, intent(in) :: is_estimate !! else a bound
    character(:), allocatable :: words

    words = ''
    if (.not. error > 0.0_wp) return
    words = ' at small strain, whose error is not known here'
    if (told_theory(error, is_estimate) < huge(1.0_wp)) words = ' at small strain, which '// &
      trim(merge('is    ', 'may be', is_estimate))//' off by '//percent(error)//' here'
  end function theory_in_words

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

  subroutine draw_bar(fraction, words)
    real(wp), intent(in) :: fraction !! done, 0 to 1
    character(*), intent(in) :: words !! that follow the bar
    integer :: done

    done = int(fraction*bar_width)
    call write_to(standard_output, '['//repeat('#', done)//repeat('.', bar_width - done)//'] '// &
      words)
  end subroutine draw_bar

  !> Wipe the bar off the terminal's last line.
  subroutine clear_bar(console)
    type(console_t), intent(in) :: console

    if (.not. console%terminal) return
    call write_to(standard_output, wipe_line)
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
