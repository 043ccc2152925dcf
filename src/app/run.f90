!> A run: advance, append, report, increment by increment.
module run_mod
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t, raise, exit_not_solved, exit_machine, exit_signal
  use text_mod, only: string_t, to_text
  use system_mod, only: wall_seconds, catch_signals
  use machine_room_mod, only: check_library_room
  use scene_mod, only: scene_t
  use plan_mod, only: plan_t, find_breaches
  use increments_mod, only: increment_t, next_increment
  use state_mod, only: state_t
  use step_report_mod, only: step_report_t, ended_out_of_reach
  use step_fields_mod, only: step_fields_t, fields_due
  use read_deck_mod, only: read_deck
  use make_plan_mod, only: make_plan, revise_plan
  use estimate_costs_mod, only: estimate_costs
  use fit_machine_mod, only: misfit
  use initial_overlaps_mod, only: overlaps
  use operators_mod, only: operators_t, widen_interface
  use advance_mod, only: advance_along
  use look_ahead_mod, only: ahead_t
  use load_step_error_mod, only: coarse_run_t, start_coarse, follow_coarsely
  use result_file_mod, only: result_file_t, open_result, reopen_result, append_increment, &
    finish_result, run_finished, run_not_solved, run_stopped, run_failed
  use command_line_mod, only: options_t, command_text
  use tally_mod, only: tally_t, add_increment, note_sizes, list_counters
  use export_problems_mod, only: exports_t, choose_rows, export_increment
  use console_mod, only: console_t, open_console, say, print_lines, print_increment, &
    print_warning, clear_bar
  use provenance_mod, only: make_provenance
  use continue_run_mod, only: progress_t, start_run, take_up_run, keep_progress, enter_step, &
    heed_signal, how_to_continue
  use make_fields_mod, only: make_fields
  use refuse_unsolved_mod, only: refuse_unsolved
  use close_run_mod, only: close_run
  use version_mod, only: version
  implicit none
  private

  public :: run_deck

contains

  !> Read the deck, plan, and unless only the plan is wanted, run.
  subroutine run_deck(options, error)
    type(options_t), intent(in) :: options
    type(error_t), allocatable, intent(out) :: error
    !! wrong deck, nothing solved, or the machine failed
    type(scene_t) :: scene
    type(plan_t) :: plan
    type(console_t) :: console
    type(tally_t) :: tally
    type(exports_t) :: exports
    type(operators_t) :: operators

    console = open_console(options%quiet)
    call read_deck(options%deck, options%overrides, scene, error)
    if (allocated(error)) return
    call make_plan(scene, plan, error)
    if (allocated(error)) return
    call estimate_costs(scene, result_path(options, scene), plan, operators%inverse%factor, error)
    if (allocated(error)) return
    call choose_rows(options%exported, plan%n_increments, options%overwrite, exports, error)
    if (allocated(error)) return
    tally%read_time = wall_seconds() - console%started
    call print_lines(console, [string_t('bipot '//version//': '//scene%title)])
    call print_lines(console, scene%notes)
    call print_lines(console, plan%lines)
    call print_lines(console, overlaps(scene, plan%points))
    call refuse_misfit(scene, plan, options%force, console, error)
    if (allocated(error) .or. options%plan) return
    call run_scene(options, scene, plan, exports, operators, console, tally, error)
  end subroutine run_deck

  !> Where the result goes.
  pure function result_path(options, scene) result(path)
    type(options_t), intent(in) :: options
    type(scene_t), intent(in) :: scene
    character(:), allocatable :: path

    path = options%output
    if (path == '') path = scene%name//'.vtkhdf'
  end function result_path

  !> Refuse a run that memory or disk will not hold before it has begun; forced, only say so.
  subroutine refuse_misfit(scene, plan, forced, console, error)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    logical, intent(in) :: forced
    type(console_t), intent(in) :: console
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: reasons

    reasons = misfit(scene, plan)
    if (reasons == '') return
    if (forced) then
      call print_warning(console, reasons)
    else
      call raise(error, exit_machine, 'bipot: error: '//reasons//new_line('a')// &
        '  nothing was run (--force runs it all the same)')
    end if
  end subroutine refuse_misfit

  !> Open the file, go through the increments, close the file whatever happened.
  subroutine run_scene(options, scene, plan, exports, operators, console, tally, error)
    type(options_t), intent(in) :: options
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(inout) :: plan
    type(exports_t), intent(in) :: exports
    type(operators_t), intent(inout) :: operators !! its factor holds the symbolic analysis
    type(console_t), intent(inout) :: console
    type(tally_t), intent(inout) :: tally
    type(error_t), allocatable, intent(out) :: error
    type(result_file_t) :: file
    type(progress_t) :: progress
    type(error_t), allocatable :: closing
    character(:), allocatable :: path, status
    type(string_t), allocatable :: names(:)
    real(wp), allocatable :: counters(:)
    integer(i8) :: written
    logical :: in_place

    path = result_path(options, scene)
    call check_library_room(3*room_to_write(scene), 'begin the result file', error)
    if (allocated(error)) return
    call catch_signals()
    call begin_file(options, path, scene, plan, operators, file, progress, tally, error)
    if (allocated(error)) return
    if (progress%state%row > 0) call print_lines(console, [string_t('continued       behind '// &
      'increment '//to_text(progress%state%row))])
    call go_through(scene, plan, exports, operators, file, console, progress, tally, error)
    tally%total_time = tally%earlier_time + wall_seconds() - console%started
    inquire (file=path, size=written)
    tally%file_bytes = real(max(0_i8, written), wp)
    call list_counters(tally, operators, names, counters)

    status = run_finished
    if (allocated(error)) then
      status = run_failed
      if (error%exit_status == exit_not_solved) status = run_not_solved
      if (error%exit_status > exit_signal) status = run_stopped
    end if
    call finish_result(file, status, names, counters, closing)
    call clear_bar(console)
    if (allocated(error)) then
      inquire (file=path, exist=in_place)
      if (status == run_stopped) then
        error%message = error%message//': '//how_to_continue(path, file%n_rows, &
          plan%n_increments, command_text())
      else if (tally%increments > 0 .and. in_place) then
        error%message = error%message//new_line('a')//to_text(tally%increments)// &
          ' increments before it are in '//path
      end if
      return
    end if
    if (allocated(closing)) then
      call move_alloc(closing, error)
      return
    end if
    call tell_breaches(console, find_breaches(plan, names, counters))
    call close_run(scene, console, tally, operators, path)
  end subroutine run_scene

  !> Memory that HDF5 may ask for while an increment is written: its tables, and a few copies of
  !> the longest row, which it shuffles and deflates.
  pure function room_to_write(scene) result(bytes)
    type(scene_t), intent(in) :: scene
    integer(i8) :: bytes
    integer(i8), parameter :: tables = 16000000_i8, copies = 4, tensor = 48, at_gauss_points = 8

    bytes = tensor*max(scene%mesh%n_nodes, scene%mesh%n_elements)
    if (scene%output%at_gauss_points) bytes = max(bytes, &
      at_gauss_points*tensor*scene%mesh%n_elements)
    bytes = tables + copies*bytes
  end function room_to_write

  !> Open the result file, that of a run to be continued where there is one.
  subroutine begin_file(options, path, scene, plan, operators, file, progress, tally, error)
    type(options_t), intent(in) :: options
    character(*), intent(in) :: path
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(inout) :: plan
    type(operators_t), intent(in) :: operators
    type(result_file_t), intent(inout) :: file
    type(progress_t), intent(inout) :: progress
    type(tally_t), intent(inout) :: tally
    type(error_t), allocatable, intent(out) :: error
    type(error_t), allocatable :: ignored
    real(wp), allocatable :: kept(:)
    logical :: continues

    call start_run(scene, plan, progress)
    inquire (file=path, exist=continues)
    continues = continues .and. options%continues
    if (continues) then
      call reopen_result(path, scene, plan, make_provenance(operators), file, kept, error)
      if (allocated(error)) return
      call take_up_run(kept, scene, plan, file, progress, tally, error)
    else
      call open_result(path, scene, plan, make_provenance(operators), options%overwrite, file, &
        error)
      if (allocated(error)) return
      call keep_progress(progress, tally, file, error)
      if (allocated(error)) call finish_result(file, run_failed, [string_t ::], [real(wp) ::], &
        ignored)
    end if
  end subroutine begin_file

  !> Say where the run did not keep to its plan.
  subroutine tell_breaches(console, breaches)
    type(console_t), intent(in) :: console
    type(string_t), intent(in) :: breaches(:)
    integer :: i

    do i = 1, size(breaches)
      call print_warning(console, breaches(i)%text)
    end do
  end subroutine tell_breaches

  !> The loop: advance, append, report.
  subroutine go_through(scene, plan, exports, operators, file, console, progress, tally, error)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(inout) :: plan
    type(exports_t), intent(in) :: exports
    type(operators_t), intent(inout) :: operators
    type(result_file_t), intent(inout) :: file
    type(console_t), intent(inout) :: console
    type(progress_t), intent(inout) :: progress
    type(tally_t), intent(inout) :: tally
    type(error_t), allocatable, intent(out) :: error
    type(state_t) :: new
    type(ahead_t) :: ahead
    type(increment_t) :: increment
    type(step_report_t) :: report
    type(step_fields_t) :: fields
    character(:), allocatable :: unheld !! motions that nothing held in the increment before
    real(wp) :: clock

    unheld = ''
    increments: do
      increment = next_increment(scene%steps, progress%state)
      if (increment%row == 0) exit increments
      if (increment%step /= progress%entered) then
        call enter_step(scene, plan, increment, progress, operators, error)
        if (allocated(error)) return
      end if
      call heed_signal(error)
      if (allocated(error)) return
      call advance_along(scene, plan, operators, progress%state, ahead, new, report, error)
      if (allocated(error)) return
      if (report%ending == ended_out_of_reach) then
        call take_whole_surfaces(scene, increment, report, console, plan, operators, error)
        if (allocated(error)) return
        tally%plan_revisions = tally%plan_revisions + 1
        progress%widened_in = increment%step
        call advance_along(scene, plan, operators, progress%state, ahead, new, report, error)
        if (allocated(error)) return
      end if
      call note_sizes(operators, tally)
      ! Also where the increment is not solved: others may want to try.
      call export_increment(scene, operators, increment, progress%state, report, exports, error)
      if (allocated(error)) return
      call refuse_unsolved(scene, plan, increment, report, operators%inverse%condition, error)
      if (allocated(error)) return
      call estimate_errors(scene, plan, operators, progress%state, new, progress%coarse, report)
      call tell_unheld(console, increment, report, unheld)

      clock = wall_seconds()
      call make_fields(scene, new, report, fields)
      call check_library_room(room_to_write(scene), 'write the result file', error)
      if (allocated(error)) return
      call append_increment(file, scene, plan, new, report, fields, error)
      if (allocated(error)) return
      call add_increment(increment, report, fields_due(scene%output%frequency, &
        increment%number, increment%last_of_step), tally)
      progress%state = new
      tally%total_time = tally%earlier_time + wall_seconds() - console%started
      call keep_progress(progress, tally, file, error)
      if (allocated(error)) return
      tally%write_time = tally%write_time + wall_seconds() - clock
      call print_increment(console, increment, plan%n_increments, report)
    end do increments
  end subroutine go_through

  !> How wrong the increment is, but for the mesh.
  subroutine estimate_errors(scene, plan, operators, old, new, coarse, report)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(operators_t), intent(inout) :: operators
    type(state_t), intent(in) :: old, new
    type(coarse_run_t), intent(inout) :: coarse
    type(step_report_t), intent(inout) :: report

    associate (c => report%certificate)
      report%errors%contact = max(c%penetration, c%adhesion, c%complementarity, c%cone, c%law)
    end associate
    report%errors%arithmetic = report%imbalance + epsilon(1.0_wp)*operators%inverse%condition
    call follow_coarsely(scene, plan, operators, old, new, coarse, report%errors%load_steps)
  end subroutine estimate_errors

  !> A node went further than the plan had it go: from here on every slave node is a candidate.
  subroutine take_whole_surfaces(scene, increment, report, console, plan, operators, error)
    type(scene_t), intent(in) :: scene
    type(increment_t), intent(in) :: increment
    type(step_report_t), intent(in) :: report
    type(console_t), intent(inout) :: console
    type(plan_t), intent(inout) :: plan
    type(operators_t), intent(inout) :: operators
    type(error_t), allocatable, intent(out) :: error

    associate (points => plan%points, i => report%worst_point)
      call clear_bar(console)
      call say('note: step '//to_text(increment%step)//', increment '//to_text(increment%number)// &
        ': node '//to_text(scene%mesh%node_id(points%node(i)))//' reaches '// &
        scene%obstacles(scene%pairs(points%pair(i))%obstacle)%name// &
        ', which the plan held to be '// &
        'out of its reach; the increment is repeated with the whole of the slave surfaces')
    end associate
    plan%points%in_reach = .true.
    call revise_plan(scene, plan, error)
    if (allocated(error)) return
    call widen_interface(scene, plan%points, operators, error)
  end subroutine take_whole_surfaces

  !> Say which rigid motions nothing holds, where that has changed.
  subroutine tell_unheld(console, increment, report, before)
    type(console_t), intent(inout) :: console
    type(increment_t), intent(in) :: increment
    type(step_report_t), intent(in) :: report
    character(:), allocatable, intent(inout) :: before
    character(:), allocatable :: now

    now = ''
    if (allocated(report%unheld)) now = report%unheld
    if (now == before) return
    before = now
    if (now == '') now = 'none any more'
    call clear_bar(console)
    call say('note: step '//to_text(increment%step)//', increment '//to_text(increment%number)// &
      ': motions that nothing holds and nothing drives stay where they are: '//now)
  end subroutine tell_unheld

end module run_mod
