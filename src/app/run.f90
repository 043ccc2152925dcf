!> A run: advance, append, report, increment by increment.
module run_mod
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t, raise, exit_not_solved, exit_machine
  use text_mod, only: string_t, to_text
  use system_mod, only: wall_seconds, utc_now, build_description
  use machine_room_mod, only: check_library_room
  use blas_core_mod, only: blas_core_name
  use scene_mod, only: scene_t
  use plan_mod, only: plan_t, find_breaches
  use increments_mod, only: increment_t, next_increment
  use state_mod, only: state_t, initial_state
  use step_report_mod, only: step_report_t, ended_out_of_reach
  use step_fields_mod, only: step_fields_t, fields_due
  use read_deck_mod, only: read_deck
  use make_plan_mod, only: make_plan, revise_plan
  use estimate_costs_mod, only: estimate_costs
  use fit_machine_mod, only: misfit
  use initial_overlaps_mod, only: overlaps
  use operators_mod, only: operators_t, make_operators, change_supports, prepare_step, &
    widen_interface
  use step_loads_mod, only: prescribed_dofs
  use advance_mod, only: advance_along
  use look_ahead_mod, only: ahead_t
  use load_step_error_mod, only: coarse_run_t, start_coarse, follow_coarsely
  use result_file_mod, only: result_file_t, provenance_t, open_result, append_increment, &
    finish_result, run_finished, run_not_solved, run_failed
  use command_line_mod, only: options_t, command_text
  use tally_mod, only: tally_t, add_increment, note_sizes, list_counters
  use export_problems_mod, only: exports_t, choose_rows, export_increment
  use console_mod, only: console_t, open_console, say, print_lines, print_increment, &
    print_warning, clear_bar
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
    type(error_t), allocatable :: closing
    character(:), allocatable :: path, status
    type(string_t), allocatable :: names(:)
    real(wp), allocatable :: counters(:)
    integer(i8) :: written
    logical :: in_place

    path = result_path(options, scene)
    call check_library_room(3*room_to_write(scene), 'begin the result file', error)
    if (allocated(error)) return
    call open_result(path, scene, plan, provenance(), options%overwrite, file, error)
    if (allocated(error)) return
    call go_through(scene, plan, exports, operators, file, console, tally, error)
    tally%total_time = wall_seconds() - console%started
    inquire (file=path, size=written)
    tally%file_bytes = real(max(0_i8, written), wp)
    call list_counters(tally, operators, names, counters)

    status = run_finished
    if (allocated(error)) then
      status = run_failed
      if (error%exit_status == exit_not_solved) status = run_not_solved
    end if
    call finish_result(file, status, names, counters, closing)
    call clear_bar(console)
    if (allocated(error)) then
      inquire (file=path, exist=in_place)
      if (tally%increments > 0 .and. in_place) error%message = error%message//new_line('a')// &
        to_text(tally%increments)//' increments before it are in '//path
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
  subroutine go_through(scene, plan, exports, operators, file, console, tally, error)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(inout) :: plan
    type(exports_t), intent(in) :: exports
    type(operators_t), intent(inout) :: operators
    type(result_file_t), intent(inout) :: file
    type(console_t), intent(inout) :: console
    type(tally_t), intent(inout) :: tally
    type(error_t), allocatable, intent(out) :: error
    type(state_t) :: old, new
    type(ahead_t) :: ahead
    type(increment_t) :: increment
    type(step_report_t) :: report
    type(step_fields_t) :: fields
    type(coarse_run_t) :: coarse
    character(:), allocatable :: unheld !! motions that nothing held in the increment before
    real(wp) :: clock

    unheld = ''
    old = initial_state(scene%mesh%n_nodes, plan%points%n)
    call start_coarse(old, coarse)
    increments: do
      increment = next_increment(scene%steps, old)
      if (increment%row == 0) exit increments
      if (increment%first_of_step) then
        call enter_step(scene, plan, increment%step, old, operators, error)
        if (allocated(error)) return
      end if
      call advance_along(scene, plan, operators, old, ahead, new, report, error)
      if (allocated(error)) return
      if (report%ending == ended_out_of_reach) then
        call take_whole_surfaces(scene, increment, report, console, plan, operators, error)
        if (allocated(error)) return
        tally%plan_revisions = tally%plan_revisions + 1
        call advance_along(scene, plan, operators, old, ahead, new, report, error)
        if (allocated(error)) return
      end if
      call note_sizes(operators, tally)
      ! Also where the increment is not solved: others may want to try.
      call export_increment(scene, operators, increment, old, report, exports, error)
      if (allocated(error)) return
      call refuse_unsolved(scene, plan, increment, report, operators%inverse%condition, error)
      if (allocated(error)) return
      call estimate_errors(scene, plan, operators, old, new, coarse, report)
      call tell_unheld(console, increment, report, unheld)

      clock = wall_seconds()
      call make_fields(scene, new, report, fields)
      call check_library_room(room_to_write(scene), 'write the result file', error)
      if (allocated(error)) return
      call append_increment(file, scene, plan, new, report, fields, error)
      if (allocated(error)) return
      tally%write_time = tally%write_time + wall_seconds() - clock
      call add_increment(increment, report, fields_due(scene%output%frequency, &
        increment%number, increment%last_of_step), tally)
      call print_increment(console, increment, plan%n_increments, report)
      old = new
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

  !> New operators where a step holds other degrees of freedom than the one before; its loads in any
  !> case.
  subroutine enter_step(scene, plan, step, state, operators, error)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    integer, intent(in) :: step
    type(state_t), intent(in) :: state
    type(operators_t), intent(inout) :: operators
    type(error_t), allocatable, intent(out) :: error

    if (step == 1) then
      call make_operators(scene, plan%points, prescribed_dofs(scene, step), operators, error)
    else
      call change_supports(scene, plan%points, prescribed_dofs(scene, step), operators, error)
    end if
    if (allocated(error)) return
    call prepare_step(scene, step, state, operators, error)
  end subroutine enter_step

  !> Who makes the file.
  function provenance()
    type(provenance_t) :: provenance

    provenance%version = version
    provenance%build = build_description()
    provenance%libraries = 'MUMPS (sequential), METIS, LAPACK and BLAS (OpenBLAS), HDF5'
    provenance%command = command_text()
    provenance%blas_core = blas_core_name()
    provenance%started = utc_now()
  end function provenance

end module run_mod
