!> A run: advance, append, report, increment by increment.
module run_mod
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t, raise, exit_not_solved, exit_machine
  use text_mod, only: string_t, to_text
  use system_mod, only: wall_seconds, peak_memory_bytes, utc_now, build_description
  use blas_core_mod, only: blas_core_name
  use parallel_mod, only: n_ranks, usage_t, usage_of_others
  use scene_mod, only: scene_t
  use controls_mod, only: stop_at_change, local_uzawa, solver_sweeps, precision_controls_t, &
    precision_in_words, is_exact
  use plan_mod, only: plan_t, find_breaches
  use increments_mod, only: increment_t, next_increment
  use state_mod, only: state_t, initial_state
  use step_report_mod, only: step_report_t, worst_entry, ended_at_limit, ended_stalled, &
    ended_unbalanced, ended_moving, ended_out_of_reach
  use step_fields_mod, only: step_fields_t, tensor_field_t, fields_due
  use read_deck_mod, only: read_deck
  use mesh_fields_mod, only: fill_tensor_fields
  use recovered_error_mod, only: estimate_mesh_error
  use make_plan_mod, only: make_plan, revise_plan
  use estimate_costs_mod, only: estimate_costs
  use fit_machine_mod, only: misfit
  use initial_overlaps_mod, only: overlaps
  use operators_mod, only: operators_t, make_operators, change_supports, prepare_step, &
    widen_interface
  use step_loads_mod, only: prescribed_dofs
  use advance_mod, only: advance
  use result_file_mod, only: result_file_t, provenance_t, open_result, append_increment, &
    finish_result, &
                             run_finished, run_not_solved, run_failed
  use command_line_mod, only: options_t, command_text
  use tally_mod, only: tally_t, add_increment, note_sizes, list_counters
  use export_problems_mod, only: exports_t, choose_rows, export_increment
  use console_mod, only: console_t, open_console, say, print_lines, print_increment, &
    print_warning, clear_bar, solver_name, &
                         seconds_in_words
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

    path = result_path(options, scene)
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
      if (tally%increments > 0) error%message = error%message//new_line('a')// &
        to_text(tally%increments)// &
        ' increments before it are in '//path
      return
    end if
    if (allocated(closing)) then
      call move_alloc(closing, error)
      return
    end if
    call tell_breaches(console, find_breaches(plan, names, counters))
    call close_run(scene, console, tally, operators, path)
  end subroutine run_scene

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
    type(increment_t) :: increment
    type(step_report_t) :: report
    type(step_fields_t) :: fields
    character(:), allocatable :: unheld !! motions that nothing held in the increment before
    real(wp) :: clock

    unheld = ''
    old = initial_state(scene%mesh%n_nodes, plan%points%n)
    increments: do
      increment = next_increment(scene%steps, old)
      if (increment%row == 0) exit increments
      if (increment%first_of_step) then
        call enter_step(scene, plan, increment%step, old, operators, error)
        if (allocated(error)) return
      end if
      call advance(scene, plan, operators, old, increment, new, report, error)
      if (allocated(error)) return
      if (report%ending == ended_out_of_reach) then
        call take_whole_surfaces(scene, increment, report, console, plan, operators, error)
        if (allocated(error)) return
        tally%plan_revisions = tally%plan_revisions + 1
        call advance(scene, plan, operators, old, increment, new, report, error)
        if (allocated(error)) return
      end if
      call note_sizes(operators, tally)
      ! Also where the increment is not solved: others may want to try.
      call export_increment(scene, operators, increment, old, report, exports, error)
      if (allocated(error)) return
      call refuse_unsolved(scene, plan, increment, report, operators%inverse%condition, error)
      if (allocated(error)) return
      call tell_unheld(console, increment, report, unheld)

      clock = wall_seconds()
      call make_fields(scene, new, report, fields)
      call append_increment(file, scene, plan, new, report, fields, error)
      if (allocated(error)) return
      tally%write_time = tally%write_time + wall_seconds() - clock
      call add_increment(increment, report, fields_due(scene%output%frequency, &
        increment%number, scene%steps(increment%step)%n_increments), tally)
      call print_increment(console, increment, plan%n_increments, report)
      old = new
    end do increments
  end subroutine go_through

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

  !> A step that did not converge or is not certified ends the run; only comparisons (STOP=CHANGE)
  !> go on past one that converged and is not certified.
  subroutine refuse_unsolved(scene, plan, increment, report, condition, error)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(increment_t), intent(in) :: increment
    type(step_report_t), intent(in) :: report
    real(wp), intent(in) :: condition !! of the stiffness, at least [-]
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: where_and_what

    if (report%converged .and. scene%contact%stop_rule == stop_at_change) return
    if (report%converged .and. report%certificate%certified) return
    where_and_what = 'step '//to_text(increment%step)//', increment '//to_text(increment%number)
    if (report%ending == ended_unbalanced) then
      where_and_what = where_and_what//': nothing balances the loads along '//report%unbalanced
    else if (report%ending == ended_moving) then
      where_and_what = where_and_what//': the contact points on curved obstacles do not settle '// &
        '(they still move by '//to_text(report%residual, 3)//'); smaller increments may help'
    else if (.not. report%converged) then
      where_and_what = where_and_what//': '//solver_name(report%solver)// &
        ' did not reach the tolerance '//to_text(scene%contact%tolerance)//' in '// &
        to_text(report%contact_iterations)//' iterations, '//ending_in_words(report%ending)// &
        ' (best residual '//to_text(report%residual, 3)
      if (report%worst_point > 0) where_and_what = where_and_what//', largest at node '// &
        to_text(scene%mesh%node_id(plan%points%node(report%worst_point)))
      where_and_what = where_and_what//'; condition of the stiffness at least '// &
        to_text(condition, 2)//')'
      if (scene%contact%local == local_uzawa .and. report%solver == solver_sweeps) then
        where_and_what = where_and_what//'; rho = '//to_text(scene%contact%rho)//' times its '// &
        'natural scale is outside the range in which Uzawa converges here: below 2, often less'
      end if
    else
      where_and_what = where_and_what//': not certified, '//certificate_in_words(report)// &
        ', allowed '// &
        to_text(10.0_wp*scene%contact%tolerance)//' (condition of the stiffness at least '// &
        to_text(condition, 2)//')'
      if (.not. is_exact(scene%precision)) then
        where_and_what = where_and_what//'; the factor ('// &
          precision_in_words(scene%precision)//') left '//to_text(report%unrefined, 2)// &
          ' out of balance, Newton-Raphson '//to_text(report%imbalance, 2)// &
          ': full rank and FACTOR=DOUBLE of *PRECISION hold more'
      else if (report%certificate%equilibrium >= worst_entry(report%certificate)) then
        where_and_what = where_and_what// &
          ': displacements in double precision do not hold these forces any closer'
      end if
    end if
    call raise(error, exit_not_solved, where_and_what)
  end subroutine refuse_unsolved

  !> Why a contact solver gave up.
  pure function ending_in_words(ending) result(words)
    integer, intent(in) :: ending
    character(:), allocatable :: words

    select case (ending)
    case (ended_at_limit)
      words = 'their limit'
    case (ended_stalled)
      words = 'without progress any more'
    case default
      words = 'the reactions growing without bound'
    end select
  end function ending_in_words

  pure function certificate_in_words(report) result(words)
    type(step_report_t), intent(in) :: report
    character(:), allocatable :: words

    associate (c => report%certificate)
      words = 'penetration '//to_text(c%penetration, 2)//', adhesion '//to_text(c%adhesion, 2)// &
        ', complementarity '//to_text(c%complementarity, 2)//', cone '//to_text(c%cone, 2)// &
        ', law '// &
        to_text(c%law, 2)//', equilibrium '//to_text(c%equilibrium, 2)
    end associate
  end function certificate_in_words

  !> The fields that the state does not hold, where the increment's are due.
  subroutine make_fields(scene, state, report, fields)
    type(scene_t), intent(in) :: scene
    type(state_t), intent(in) :: state
    type(step_report_t), intent(inout) :: report !! gets the error of the mesh, where it is due
    type(step_fields_t), intent(out) :: fields
    logical :: due
    integer :: last

    last = scene%steps(state%step)%n_increments
    due = fields_due(scene%output%frequency, state%increment, last)
    if (state%increment == last .or. (due .and. scene%output%mesh_error)) then
      call estimate_mesh_error(scene%mesh, scene%materials, state%displacement, &
        fields%mesh_error, report%mesh_error)
    end if
    if (.not. due) return
    if (scene%output%reaction) fields%reaction_force = state%support_force
    if (scene%output%stress) call allocate_tensors(scene, fields%stress)
    if (scene%output%strain) call allocate_tensors(scene, fields%strain)
    if (scene%output%stress .or. scene%output%strain) then
      call fill_tensor_fields(scene%mesh, scene%materials, state%displacement, fields%strain, &
        fields%stress)
    end if
  end subroutine make_fields

  !> Room for a tensor wherever the deck wants it.
  subroutine allocate_tensors(scene, field)
    type(scene_t), intent(in) :: scene
    type(tensor_field_t), intent(inout) :: field

    associate (mesh => scene%mesh, output => scene%output)
      if (output%at_centroids) allocate (field%at_centroids(6, mesh%n_elements))
      if (output%at_gauss_points) allocate (field%at_gauss_points(6, 8, mesh%n_elements))
      if (output%at_nodes) allocate (field%at_nodes(6, mesh%n_nodes))
    end associate
  end subroutine allocate_tensors

  !> Phases and memory, then the one sentence that says how it went.
  subroutine close_run(scene, console, tally, operators, path)
    type(scene_t), intent(in) :: scene
    type(console_t), intent(in) :: console
    type(tally_t), intent(in) :: tally
    type(operators_t), intent(in) :: operators
    character(*), intent(in) :: path
    type(usage_t) :: others

    others = usage_of_others()
    associate (s => operators%seconds)
      call print_lines(console, [ &
        string_t('time            read '//seconds(tally%read_time)//', assemble '// &
        seconds(s%assemble)//', order '// &
                 seconds(s%order)//', factorise '//seconds(s%factorise)//', condense '// &
                 seconds(s%condense)// &
                 ', loads '//seconds(s%loads)//','), &
        string_t('                contact '//seconds(tally%contact_time)//', recover '// &
                 seconds(tally%step_time - tally%contact_time)//', write '// &
                 seconds(tally%write_time)), &
        string_t('accuracy        '//accuracy_in_words(scene%precision, tally%unrefined, &
        tally%imbalance)), &
        string_t('memory          '//to_text(real(peak_memory_bytes() + others%peak, wp)/1.0e6_wp, &
        3)//' MB at most')])
    end associate
    if (tally%certified < tally%increments) then
      call print_warning(console, to_text(tally%increments - tally%certified)//' of '// &
        to_text(tally%increments)// &
        ' increments are not certified (STOP=CHANGE goes on past them)')
    end if
    call say(to_text(tally%certified)//' of '//to_text(tally%increments)// &
      ' increments certified to '// &
             to_text(10.0_wp*scene%contact%tolerance)//', worst error '//to_text(tally%worst, 2)// &
             ' (increment '// &
             to_text(tally%worst_row)//'), '//seconds_in_words(tally%total_time)//': '//path)
  end subroutine close_run

  !> In which arithmetic, and what was out of balance before and after Newton-Raphson.
  function accuracy_in_words(precision, before, after) result(words)
    type(precision_controls_t), intent(in) :: precision
    real(wp), intent(in) :: before, after !! largest out-of-balance force, of the largest force [-]
    character(:), allocatable :: words

    words = 'factor in '//precision_in_words(precision)//': out of balance by at most '// &
      or_rounding(before)//' as solved, '//or_rounding(after)//' as refined'
  end function accuracy_in_words

  pure function or_rounding(imbalance) result(text)
    real(wp), intent(in) :: imbalance !! 0 where it is no more than internal forces round [-]
    character(:), allocatable :: text

    text = 'rounding'
    if (imbalance > 0.0_wp) text = to_text(imbalance, 2)
  end function or_rounding

  pure function seconds(time) result(text)
    real(wp), intent(in) :: time
    character(:), allocatable :: text

    text = to_text(max(0.0_wp, time), 3)//' s'
  end function seconds

  !> Who makes the file.
  function provenance()
    type(provenance_t) :: provenance

    provenance%version = version
    provenance%build = build_description()
    provenance%ranks = n_ranks()
    provenance%libraries = 'MUMPS, METIS, LAPACK and BLAS (OpenBLAS), HDF5'
    provenance%command = command_text()
    provenance%blas_core = blas_core_name()
    provenance%started = utc_now()
  end function provenance

end module run_mod
