!> A deck on one mesh: plan, result file, increments, and how it went.
module run_mesh_mod
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t, raise, exit_not_solved, exit_machine, exit_signal, &
    exit_wrong_input
  use text_mod, only: string_t, to_text, percent
  use system_mod, only: wall_seconds, cpu_seconds, catch_signals
  use fresh_file_mod, only: beginning_of
  use resource_limits_mod, only: check_library_room
  use controls_mod, only: accuracy_of_energy
  use scene_mod, only: scene_t
  use step_contact_mod, only: set_contact_of_step
  use choices_mod, only: choices_t
  use plan_mod, only: plan_t, find_breaches, bound_fixed
  use plan_table_mod, only: add_line
  use mirror_scene_mod, only: planes_in_words, part_in_words
  use make_plan_mod, only: make_plan
  use choose_threads_mod, only: choose_threads
  use estimate_costs_mod, only: estimate_costs
  use amounts_mod, only: time_in_words
  use rigid_alternatives_mod, only: describe_rigid_alternatives
  use fit_machine_mod, only: exceeds_machine, exceeds_time
  use initial_overlaps_mod, only: overlaps
  use held_normals_mod, only: held_normals, kept_overlaps
  use sparse_factor_mod, only: sparse_factor_t
  use linearisation_mod, only: begin_linearisation
  use step_solver_mod, only: step_solver_t
  use contact_zone_mod, only: balls_about, share_near
  use mesh_sequence_mod, only: mesh_sequence_t, mesh_run_t, planned_t, add_run, has_bound, &
    is_spoiled_by_theory
  use sequence_error_mod, only: sequence_error_t, estimate_sequence
  use increments_mod, only: done_of_deck
  use foreseen_costs_mod, only: note_plan
  use next_run_mod, only: choice_t, is_reached
  use end_with_run_mod, only: is_to_be_written
  use run_within_mod, only: choose_next, judge_plan
  use prepare_scene_mod, only: result_path
  use result_run_mod, only: run_finished, run_settled, run_not_solved, run_stopped, run_failed
  use result_claims_mod, only: take_arithmetic
  use result_file_mod, only: result_file_t, open_result, open_nothing, reopen_result, &
    count_appended, keep_accuracy, finish_result
  use command_line_mod, only: options_t, resume_command
  use tally_mod, only: tally_t, note_sizes, list_counters, theory_of
  use export_problems_mod, only: exports_t, choose_rows
  use console_mod, only: console_t, say, print_lines, print_warning, clear_bar
  use provenance_mod, only: make_provenance
  use checkpoint_mod, only: progress_t, not_known, start_run, restore_checkpoint, &
    save_checkpoint, how_to_continue
  use run_increments_mod, only: run_increments, room_to_write
  use name_knob_mod, only: name_knob
  use close_run_mod, only: close_run
  use print_summary_mod, only: print_summary
  implicit none
  private

  public :: run_mesh, goes_on

contains

  !> Plan the scene, and unless only the plan is wanted, run it.
  !>
  !> Where the sequence has bounds, a mesh may turn out too fine for them, or too coarse to use
  !> them, once it is planned: then nothing is run, and the choice is another.
  subroutine run_mesh(options, scene, choices, console, error, sequence, choice, tally)
    type(options_t), intent(in) :: options
    type(scene_t), intent(in) :: scene
    type(choices_t), intent(in) :: choices !! with which it was read
    type(console_t), intent(inout) :: console
    type(error_t), allocatable, intent(out) :: error !! nothing solved, or the machine failed
    type(mesh_sequence_t), intent(inout), optional :: sequence
    !! the runs before this one, on other meshes or with other increments; gets this one
    type(choice_t), intent(inout), optional :: choice !! that led to it; there with a sequence
    type(tally_t), intent(inout), optional :: tally
    !! what the run adds up to, which the caller prints where there is a sequence
    type(plan_t) :: plan
    type(exports_t) :: exports
    type(step_solver_t) :: solver
    type(progress_t) :: progress
    type(string_t), allocatable :: more(:) ! notes, by a name: gfortran does not free a result
    logical :: is_first, continues, is_known_to_fit

    call make_plan(scene, choices, plan, error)
    if (allocated(error)) return
    continues = goes_on(options, scene)
    if (continues) call take_arithmetic(result_path(options, scene), plan%choices%precision, &
      plan%choices%compliance)
    call begin_linearisation(solver%body)
    call estimate_costs(scene, result_path(options, scene), options%exported /= '', plan, &
      solver%body%inverse%factor, error)
    if (allocated(error)) return
    if (options%plan .and. .not. present(sequence)) then
      call describe_symmetry(scene, plan)
      call describe_rigid_alternatives(scene, result_path(options, scene), choices, plan)
    end if
    is_first = .not. continues
    is_known_to_fit = .false.
    if (present(sequence)) then
      ! A run that is made again for its result to be kept, and one that was begun in an earlier
      ! session of the search: what a process holds besides is not the same twice.
      is_known_to_fit = sequence%repeated > 0.0_wp .or. continues
      is_first = is_first .and. size(sequence%runs) == 0
      call note_costs(scene, plan, sequence)
      call judge_plan(sequence, merge(huge(1.0_wp), real(plan%memory_left, wp), options%force), &
        options%plan, choice)
      if (choice%is_replaced) return
    end if
    ! Of the time that is allowed other threads would use up an unknown part.
    if (.not. continues .and. scene%accuracy%time <= 0.0_wp) call choose_threads(console%began, &
      plan)
    call choose_rows(options%exported, plan%n_increments, options%overwrite, exports, error)
    if (options%exported /= '' .and. any(scene%pairs%no_separation)) call raise(error, &
      exit_wrong_input, 'bipot: error: --export-fclib: points of such a file may open, and '// &
      'those of *SURFACE BEHAVIOR, NO SEPARATION may not')
    if (allocated(error)) return
    if (present(choice) .and. console%verbose .and. .not. options%plan) then
      if (.not. is_first .and. has_bound(sequence)) call say(foreseen_in_words(scene, choice))
    end if
    if (options%plan .or. console%verbose) then
      call print_lines(console, plan%lines)
    else if (.not. present(sequence)) then
      call print_lines(console, plan%brief)
    end if
    call set_contact_of_step(scene, 1, plan%points)
    plan%notes = overlaps(scene, plan%points)
    more = held_normals(scene, plan%points)
    plan%notes = [plan%notes, more]
    more = kept_overlaps(scene, plan%points)
    plan%notes = [plan%notes, more]
    call print_lines(console, plan%notes, 'note: ')
    if (.not. is_known_to_fit) call refuse_misfit(scene, plan, is_first, options%force, console, &
      error)
    if (allocated(error) .or. options%plan) return
    if (present(sequence)) sequence%writes = continues .or. is_to_be_written(sequence, choice, &
      plan%seconds)
    call start_run(scene, plan, progress)
    if (present(sequence)) call begin_values(sequence, scene%mesh%n_nodes, progress)
    call run_scene(options, scene, plan, exports, solver, console, progress, error)
    if (allocated(error)) return
    progress%tally%precision = solver%choices%precision
    if (present(tally)) tally = progress%tally
    if (present(sequence)) then
      sequence = progress%sequence
    else
      call print_summary(result_path(options, scene), scene, console)
      call name_knob(scene, progress, console)
      call close_run(scene, console, progress%tally, result_path(options, scene))
    end if
    if (progress%tally%missed > 0) call raise(error, exit_not_solved, 'accuracy '// &
      percent(scene%accuracy%wanted)//' was not reached at the end of '// &
      to_text(progress%tally%missed)//' of '//to_text(size(scene%steps))// &
      ' steps; the result is otherwise complete')
  end subroutine run_mesh

  !> A line of the plan on planes of symmetry.
  subroutine describe_symmetry(scene, plan)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(inout) :: plan
    character(:), allocatable :: planes

    planes = planes_in_words(scene)
    if (planes /= '') call add_line(plan, 'symmetry', bound_fixed, 'about '//planes// &
      ': --symmetry runs a '//part_in_words(planes))
  end subroutine describe_symmetry

  !> Whether there is a result to go on with.
  logical function goes_on(options, scene)
    type(options_t), intent(in) :: options
    type(scene_t), intent(in) :: scene

    inquire (file=result_path(options, scene), exist=goes_on)
    goes_on = goes_on .and. options%continues
  end function goes_on

  !> Refuse a run that memory, disk or the time allowed will not hold before it has begun; forced,
  !> only say so.
  subroutine refuse_misfit(scene, plan, is_first, forced, console, error)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    logical, intent(in) :: is_first !! it begins, and no run before it says how long it will take
    logical, intent(in) :: forced
    type(console_t), intent(in) :: console
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: reasons

    reasons = exceeds_machine(scene, plan)
    if (reasons == '' .and. is_first) reasons = exceeds_time(scene%accuracy, plan)
    if (reasons == '') return
    if (forced) then
      call print_warning(console, reasons)
    else
      call raise(error, exit_machine, 'bipot: error: '//reasons//new_line('a')// &
        '  nothing was run (--force runs it anyway)')
    end if
  end subroutine refuse_misfit

  !> Keep in the sequence what the plan says and what it took to make. What the disk does not hold
  !> is taken for a mesh without end.
  subroutine note_costs(scene, plan, sequence)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(mesh_sequence_t), intent(inout) :: sequence
    type(planned_t) :: planned
    real(wp) :: now

    now = sequence%earlier + cpu_seconds()
    planned = planned_t(plan%choices%mesh_size, plan%start_seconds, &
      (plan%seconds - plan%start_seconds)/plan%choices%divisions, now - sequence%spent, &
      plan%more_memory)
    if (exceeds_machine(scene, plan) /= '') planned%memory = max(planned%memory, &
      2.0_wp*real(plan%memory_left, wp))
    sequence%spent = now
    call note_plan(sequence, planned)
  end subroutine note_costs

  !> What comes of the run that is about to begin.
  function foreseen_in_words(scene, choice) result(words)
    type(scene_t), intent(in) :: scene
    type(choice_t), intent(in) :: choice
    character(:), allocatable :: words

    words = 'next run        '//to_text(scene%mesh%n_elements)//' elements'
    if (choice%divisions > 1) words = words//', increments in '//to_text(choice%divisions)
    if (choice%error >= 0.0_wp) words = words//': error '//percent(choice%error)
    words = words//merge(', ', ': ', choice%error >= 0.0_wp)//time_in_words(choice%seconds)// &
      ' of CPU time with all runs before'
    if (scene%accuracy%time > 0.0_wp) words = words//', of '//time_in_words(scene%accuracy%time)
  end function foreseen_in_words

  !> Open the file, go through the increments, close the file whatever happened.
  subroutine run_scene(options, scene, plan, exports, solver, console, progress, error)
    type(options_t), intent(in) :: options
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(inout) :: plan
    type(exports_t), intent(in) :: exports
    type(step_solver_t), intent(inout) :: solver !! its factor holds the symbolic analysis
    type(console_t), intent(inout) :: console
    type(progress_t), intent(inout) :: progress
    !! the beginning, and the end; its sequence, where there is one, gets this run when it is done
    type(error_t), allocatable, intent(out) :: error
    type(result_file_t) :: file
    type(error_t), allocatable :: closing
    character(:), allocatable :: path, status
    integer(i8) :: written
    real(wp) :: began
    logical :: in_place, continues

    began = cpu_seconds()
    path = result_path(options, scene)
    continues = goes_on(options, scene) ! later any run has a file
    call check_library_room(3*room_to_write(scene, plan), 'begin the result file', error)
    if (allocated(error)) return
    call catch_signals(beginning_of(path))
    solver%choices = plan%choices
    progress%tally%read_time = wall_seconds() - console%started ! deck and plan
    file%is_kept = .true.
    if (allocated(progress%sequence)) file%is_kept = progress%sequence%writes
    if (file%is_kept) then
      call begin_file(options, scene, plan, solver%body%inverse%factor, file, progress, error)
    else
      call open_nothing(path, scene, options%overwrite, file, error)
    end if
    if (allocated(error)) return
    if (progress%state%increments_done > 0 .and. .not. console%quiet) call say( &
      'continued       behind increment '//to_text(progress%state%increments_done))
    if (file%n_damaged == 1) call say('note: increment '//to_text(file%n_rows + 1)// &
      ' was damaged in the file and is computed again')
    if (file%n_damaged > 1) call say('note: increments '//to_text(file%n_rows + 1)//' to '// &
      to_text(file%n_rows + file%n_damaged)//' were damaged in the file and are computed again')
    console%of_energy = scene%accuracy%of == accuracy_of_energy .or. plan%points%n == 0
    call run_increments(scene, plan, exports, solver, file, console, progress, error)
    progress%tally%total_time = progress%tally%earlier_time + wall_seconds() - console%started
    call note_sizes(solver, progress%tally)
    if (file%is_kept) then
      call count_appended(file, closing)
      if (allocated(closing) .and. .not. allocated(error)) error = closing
      inquire (file=path, size=written)
      progress%tally%file_bytes = real(max(0_i8, written), wp)
    end if

    if (allocated(progress%sequence) .and. .not. allocated(error)) call end_values(scene, plan, &
      cpu_seconds() - began, continues, file, progress, error)
    status = run_finished
    if (progress%state%ends_run) status = run_settled
    if (allocated(error)) then
      status = run_failed
      if (error%exit_status == exit_not_solved) status = run_not_solved
      if (error%exit_status > exit_signal) status = run_stopped
    end if
    call end_file(status, progress%tally, plan, file, console, closing)
    if (allocated(error)) then
      inquire (file=path, exist=in_place)
      if (file%n_rows > 0 .and. in_place .and. (status == run_not_solved .or. status == &
        run_stopped)) call print_summary(path, scene, console)
      if (status == run_stopped .and. .not. file%is_kept) then
        error%message = error%message//': it was expected to be short, and is not kept'
      else if (status == run_stopped) then
        error%message = error%message//': '//how_to_continue(path, file%n_rows > 0, &
          int(done_of_deck(scene%steps, progress%state%step, progress%state%position)), &
          plan%n_increments, resume_command())
      else if (file%n_rows > 0 .and. in_place) then
        error%kept = to_text(file%n_rows)//' increments before it are kept in '//path
      end if
      return
    end if
    if (allocated(closing)) call move_alloc(closing, error)
  end subroutine run_scene

  !> Room for what an accuracy is of.
  subroutine begin_values(sequence, n_nodes, progress)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: n_nodes
    type(progress_t), intent(inout) :: progress

    progress%sequence = sequence
    allocate (progress%values(sum(sequence%list%n), sequence%n_increments), source=0.0_wp)
    allocate (progress%latest(sum(sequence%list%n), 1), source=0.0_wp)
    allocate (progress%touched(1, n_nodes), source=0.0_wp)
  end subroutine begin_values

  !> Add the run to the sequence, and keep what that says of it.
  subroutine end_values(scene, plan, seconds, was_continued, file, progress, error)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    real(wp), intent(in) :: seconds !! of the processor, in this session [s]
    logical, intent(in) :: was_continued !! the seconds are not those of the whole run
    type(result_file_t), intent(inout) :: file
    type(progress_t), intent(inout) :: progress
    type(error_t), allocatable, intent(out) :: error
    type(sequence_error_t) :: errors, of_choice
    type(choice_t) :: choice
    real(wp), allocatable :: balls(:, :)

    allocate (balls(0, 0))
    balls = balls_about(scene%mesh, progress%touched, plan%choices%mesh_size%across)
    associate (sequence => progress%sequence, worst => progress%worst_errors)
      call add_run(sequence, mesh_run_t(plan%choices%mesh_size, plan%choices%divisions, &
        scene%mesh%n_elements, real(plan%n_equations, wp), plan%more_memory, &
        seconds + sequence%repeated, merge(-1.0_wp, worst(1), worst(1) >= not_known), worst(2), &
        worst(3), progress%values, merge(0.0_wp, plan%seconds, was_continued), &
        balls, share_near(scene%mesh, balls, plan%choices%mesh_size%across), file%is_kept, &
        theory_of(progress%tally), progress%in_double, progress%geometry, &
        progress%alone))
      sequence%repeated = 0.0_wp
      sequence%spent = sequence%earlier + cpu_seconds()
      sequence%room = real(plan%memory_left, wp)
      call choose_next(sequence, sequence%room, of_choice, choice)
      call estimate_sequence(sequence, errors)
      call keep_accuracy(file, sequence, errors, (choice%outcome == is_reached .and. &
        choice%of_run == size(sequence%runs) .and. .not. is_spoiled_by_theory(sequence)) .or. &
        sequence%asked <= 0.0_wp, error)
    end associate
  end subroutine end_values

  !> Open the result file, that of a run to be continued where there is one.
  subroutine begin_file(options, scene, plan, factor, file, progress, error)
    type(options_t), intent(in) :: options
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(inout) :: plan
    type(sparse_factor_t), intent(in) :: factor !! analysed
    type(result_file_t), intent(inout) :: file
    type(progress_t), intent(inout) :: progress
    type(error_t), allocatable, intent(out) :: error
    type(error_t), allocatable :: ignored
    character(:), allocatable :: path
    real(wp), allocatable :: kept(:)

    path = result_path(options, scene)
    if (goes_on(options, scene)) then
      call reopen_result(path, scene, plan, make_provenance(factor), file, kept, error)
      if (allocated(error)) return
      call restore_checkpoint(kept, scene, plan, file, progress, error)
    else
      call open_result(path, scene, plan, make_provenance(factor), options%overwrite, file, &
        error, progress%sequence)
      if (allocated(error)) return
      call save_checkpoint(progress, file, error)
      if (allocated(error)) call finish_result(file, run_failed, [real(wp) ::], ignored)
    end if
  end subroutine begin_file

  !> Close the file with what the run adds up to; if all of it was run, say where it did not keep to
  !> its plan.
  subroutine end_file(status, tally, plan, file, console, error)
    character(*), intent(in) :: status !! run_finished, run_not_solved, ...
    type(tally_t), intent(in) :: tally
    type(plan_t), intent(in) :: plan
    type(result_file_t), intent(inout) :: file
    type(console_t), intent(inout) :: console
    type(error_t), allocatable, intent(out) :: error !! the file could not be finished
    type(string_t), allocatable :: names(:)
    real(wp), allocatable :: counters(:)

    call list_counters(tally, names, counters)
    call finish_result(file, status, counters, error)
    call clear_bar(console)
    if (status /= run_finished .or. allocated(error)) return
    call tell_breaches(console, find_breaches(plan, names, counters))
  end subroutine end_file

  !> Say where the run did not keep to its plan.
  subroutine tell_breaches(console, breaches)
    type(console_t), intent(in) :: console
    type(string_t), intent(in) :: breaches(:)
    integer :: i

    do i = 1, size(breaches)
      call print_warning(console, breaches(i)%text)
    end do
  end subroutine tell_breaches

end module run_mesh_mod
