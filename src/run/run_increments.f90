!> The increments of a run, one after the other: choose its size, advance, judge, append, report.
module run_increments_mod
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t
  use text_mod, only: string_t, to_text
  use system_mod, only: wall_seconds
  use resource_limits_mod, only: check_library_room
  use scene_mod, only: scene_t
  use plan_mod, only: plan_t
  use increments_mod, only: increment_t, next_increment, whole_increment, asked_number, is_extra
  use state_mod, only: state_t
  use increment_report_mod, only: increment_report_t, ended_out_of_reach
  use step_fields_mod, only: fields_due
  use output_field_mod, only: field_t, block_bytes
  use view_fields_mod, only: list_view_fields
  use make_plan_mod, only: revise_plan
  use body_solver_mod, only: solver_work_t
  use step_solver_mod, only: step_solver_t, widen_interface
  use advance_mod, only: advance, advance_along
  use kinks_mod, only: has_too_many, count_between
  use load_events_mod, only: first_touch, no_event
  use look_ahead_mod, only: forget => cut
  use load_step_error_mod, only: follow_coarsely
  use choose_increment_mod, only: choose_increment, cut_increment
  use smooth_faces_mod, only: smooth_faces_t
  use faces_between_nodes_mod, only: entries_t, face_entry_t, list_faces, find_entries
  use meet_accuracy_mod, only: set_contact_tolerance, accuracy_shortfall
  use contact_resolution_mod, only: small_contact_t, find_small_contacts
  use result_file_mod, only: result_file_t, append_increment
  use tally_mod, only: add_increment, note_sizes
  use export_problems_mod, only: exports_t, export_increment
  use console_mod, only: console_t, say, print_lines, print_increment, print_warning, clear_bar
  use checkpoint_mod, only: progress_t, save_checkpoint, enter_step, stop_if_signalled
  use measure_increment_mod, only: estimate_mesh, measure_deformation
  use refuse_unsolved_mod, only: refuse_unsolved, refuse_missed_contact, nodes_in_words, is_solved
  implicit none
  private

  public :: run_increments, room_to_write

contains

  !> From where the run stands to its end.
  subroutine run_increments(scene, plan, exports, solver, file, console, progress, error)
    type(scene_t), intent(inout) :: scene        !! its contact tolerance follows the accuracy
    type(plan_t), intent(inout) :: plan
    type(exports_t), intent(in) :: exports
    type(step_solver_t), intent(inout) :: solver
    type(result_file_t), intent(inout) :: file
    type(console_t), intent(inout) :: console
    type(progress_t), intent(inout) :: progress
    type(error_t), allocatable, intent(out) :: error
    type(state_t) :: new
    type(increment_t) :: increment
    type(increment_report_t) :: report
    logical :: is_cut
    logical :: is_plain !! so are the increments after it: one may look ahead
    character(:), allocatable :: missed !! accuracy, and by what
    type(smooth_faces_t), allocatable :: faces(:) !! (n_pairs)
    type(entries_t) :: entries
    type(face_entry_t) :: deepest !! of the *STEP, as far as this session has run it
    character(:), allocatable :: unheld !! motions that nothing held in the increment before

    unheld = ''
    call list_faces(scene, faces)
    scene%contact%tolerance = progress%tolerance
    increments: do
      increment = next_increment(scene%steps, progress%state)
      if (increment%row == 0) exit increments
      if (increment%step /= progress%entered) then
        call enter_step(scene, plan, increment, progress, solver, error)
        if (allocated(error)) return
      end if
      call stop_if_signalled(error)
      if (allocated(error)) return
      call choose_increment(scene, plan%points, solver, progress%state, progress%size, increment, &
        is_plain)
      call solve_increment()
      if (allocated(error)) return
      call note_sizes(solver, progress%tally)
      if (.not. is_solved(scene, report)) then
        call cut_increment(scene, increment, progress%size, is_cut)
        if (is_cut) then
          progress%tally%cuts = progress%tally%cuts + 1
          call clear_bar(console)
          call say('note: step '//to_text(increment%step)//', increment '// &
            to_text(increment%number)//' was not solved up to time '//to_text(increment%time)// &
            ': half of it is tried')
          cycle increments
        end if
      end if
      ! Also where the increment is not solved: others may want to try.
      call export_increment(scene, solver%contact, increment, progress%state, report, exports, &
        error)
      if (allocated(error)) return
      call refuse_unsolved(scene, plan, increment, report, solver%body%inverse%condition, error)
      if (allocated(error)) return
      call look_between_nodes()
      if (allocated(error)) return
      call estimate_errors(scene, plan, solver, new, progress, entries, report)
      call tell_unheld(console, increment, report, unheld)
      if (increment%last_of_step) call tell_small_contacts(console, scene, plan, increment, &
        solver%body%prescribed, report)
      if (increment%last_of_step) call tell_entries(console, scene, increment, deepest)
      call write_increment()
      if (allocated(error)) return
      call print_increment(console, increment, share_done(), report)
      if (missed /= '') call print_warning(console, missed)
    end do increments

  contains

    !> Advance by one increment; once more where the plan had to be revised.
    subroutine solve_increment()
      call advance_once()
      if (allocated(error) .or. report%ending /= ended_out_of_reach) return
      call take_whole_surfaces(scene, increment, report, console, plan, solver, &
        progress%tally%work, error)
      if (allocated(error)) return
      progress%tally%plan_revisions = progress%tally%plan_revisions + 1
      progress%widened_in = increment%step
      call advance_once()
    end subroutine solve_increment

    !> What is between the nodes, where they see nothing.
    subroutine look_between_nodes()
      real(wp) :: clock

      clock = wall_seconds()
      call find_entries(scene, plan%points, faces, progress%state, new, increment%last_of_step, &
        entries)
      progress%tally%estimate_time = progress%tally%estimate_time + wall_seconds() - clock
      report%face_penetration = entries%at_end%depth
      report%face_penetration_on_way = entries%on_way%depth
      if (entries%at_end%depth > deepest%depth) deepest = entries%at_end
      call refuse_missed_contact(scene, increment, entries, error)
    end subroutine look_between_nodes

    !> Ahead of increments that may yet be cut nobody looks.
    subroutine advance_once()
      if (is_plain) then
        call advance_along(scene, plan%points, solver, progress%state, progress%ahead, new, &
          report, error)
      else
        call forget(progress%ahead)
        call advance(scene, plan%points, solver, progress%state, increment, new, report, error)
      end if
    end subroutine advance_once

    !> Write the increment: from here on it is done.
    subroutine write_increment()
      real(wp) :: clock

      clock = wall_seconds()
      call check_library_room(room_to_write(scene, plan), 'write the result file', error)
      if (allocated(error)) return
      call append_increment(file, scene, plan, new, report, error)
      if (allocated(error)) return
      progress%tally%allowed = max(progress%tally%allowed, 10.0_wp*scene%contact%tolerance)
      missed = ''
      if (increment%last_of_step) then
        missed = accuracy_shortfall(scene, increment%step, report%errors, report%mesh_error)
        call set_contact_tolerance(scene, report%errors)
      end if
      if (missed /= '') progress%tally%missed = progress%tally%missed + 1
      call note_events(console, scene, plan, solver, increment, progress)
      call add_increment(increment, report, fields_due(scene%output%frequency, &
        asked_number(increment%position), increment%last_of_step), progress%tally)
      progress%state = new
      progress%tolerance = scene%contact%tolerance
      progress%tally%total_time = progress%tally%earlier_time + wall_seconds() - console%started
      call save_checkpoint(progress, file, error)
      progress%tally%write_time = progress%tally%write_time + wall_seconds() - clock
    end subroutine write_increment

    !> The part of the run that is done, 0 to 1.
    real(wp) function share_done()
      share_done = (real(sum(scene%steps(:increment%step - 1)%n_increments), wp) + &
        real(increment%position, wp)/real(whole_increment, wp))/real(plan%n_increments, wp)
    end function share_done

  end subroutine run_increments

  !> Count the events of the load path that the increment ends at or goes across; say what a *STEP
  !> goes across, the first time.
  subroutine note_events(console, scene, plan, solver, increment, progress)
    type(console_t), intent(inout) :: console
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(step_solver_t), intent(in) :: solver
    type(increment_t), intent(in) :: increment
    type(progress_t), intent(inout) :: progress !! before the increment; its tally counts
    character(:), allocatable :: of_step
    integer :: n_inside

    of_step = 'note: step '//to_text(increment%step)//': '
    associate (kinks => solver%response%loads%kinks, step => scene%steps(increment%step), &
      tally => progress%tally)
      if (is_extra(increment%position) .and. increment%position == progress%size%event) then
        tally%at_events = tally%at_events + 1
      end if
      n_inside = count_between(kinks, increment%start, increment%position)
      if (n_inside > 0 .and. .not. any(kinks <= increment%start)) then
        call clear_bar(console)
        if (step%direct) then
          call say(of_step//'kinks of amplitudes inside increments, which go straight across: '// &
            to_text(size(kinks))//'; without DIRECT increments end there')
        else if (has_too_many(kinks, step)) then
          call say(of_step//'kinks of amplitudes: '//to_text(size(kinks))//' in '// &
            to_text(step%n_increments)//' of the deck''s increments, too many for one to end '// &
            'at each; they go straight across')
        end if
      end if
      tally%kinks_inside = tally%kinks_inside + n_inside
      if (first_touch(scene, plan%points, solver, progress%state, increment%step, &
        increment%start, increment%position) == no_event) return
      tally%touches_inside = tally%touches_inside + 1
      if (progress%touched_in == increment%step) return
      progress%touched_in = increment%step
      call clear_bar(console)
      call say(of_step//'contact begins inside increment '//to_text(increment%number)// &
        ', whose loads go straight across; without DIRECT an increment ends there')
    end associate
  end subroutine note_events

  !> How wrong the increment is.
  subroutine estimate_errors(scene, plan, solver, new, progress, entries, report)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(step_solver_t), intent(inout) :: solver
    type(state_t), intent(in) :: new
    type(progress_t), intent(inout) :: progress
    type(entries_t), intent(in) :: entries !! of obstacles between the nodes
    type(increment_report_t), intent(inout) :: report
    real(wp) :: clock

    clock = wall_seconds()
    associate (c => report%certificate)
      report%errors%contact = max(c%penetration, c%adhesion, c%complementarity, c%cone, c%law)
    end associate
    report%errors%arithmetic = report%imbalance + epsilon(1.0_wp)*solver%body%inverse%condition
    call follow_coarsely(scene, plan%points, solver, progress%state, new, progress%coarse, report)
    call estimate_mesh(scene, new, report)
    ! docs/theory.md (10.8)
    if (report%errors%mesh >= 0.0_wp .and. report%energy%strain > 0.0_wp) report%errors%mesh = &
      max(report%errors%mesh, entries%work/(2.0_wp*report%energy%strain))
    call measure_deformation(scene, new, report)
    progress%tally%estimate_time = progress%tally%estimate_time + wall_seconds() - clock
  end subroutine estimate_errors

  !> A node went further than the plan had it go: from here on every slave node is a candidate.
  subroutine take_whole_surfaces(scene, increment, report, console, plan, solver, work, error)
    type(scene_t), intent(in) :: scene
    type(increment_t), intent(in) :: increment
    type(increment_report_t), intent(in) :: report
    type(console_t), intent(inout) :: console
    type(plan_t), intent(inout) :: plan
    type(step_solver_t), intent(inout) :: solver
    type(solver_work_t), intent(inout) :: work
    type(error_t), allocatable, intent(out) :: error

    associate (points => plan%points, i => report%worst_point)
      call clear_bar(console)
      call say('note: step '//to_text(increment%step)//', increment '//to_text(increment%number)// &
        ': node '//to_text(scene%mesh%node_id(points%node(i)))//' reaches '// &
        scene%obstacles(scene%pairs(points%pair(i))%master)%name// &
        ', which the plan held to be '// &
        'out of its reach; the increment is repeated with the whole of the slave surfaces')
    end associate
    plan%points%in_reach = .true.
    call revise_plan(scene, plan, error)
    if (allocated(error)) return
    call widen_interface(scene, plan%points, solver, work, error)
  end subroutine take_whole_surfaces

  !> Say which rigid motions nothing holds, where that has changed.
  subroutine tell_unheld(console, increment, report, before)
    type(console_t), intent(inout) :: console
    type(increment_t), intent(in) :: increment
    type(increment_report_t), intent(in) :: report
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

  !> Say, at the end of a step, how deep obstacles were in faces between their nodes.
  subroutine tell_entries(console, scene, increment, deepest)
    type(console_t), intent(inout) :: console
    type(scene_t), intent(in) :: scene
    type(increment_t), intent(in) :: increment
    type(face_entry_t), intent(inout) :: deepest !! of the step; the next begins with none
    type(string_t) :: line(1)

    if (deepest%depth > 0.0_wp) then
      line(1)%text = 'note: step '//to_text(increment%step)//': faces of '// &
        scene%surfaces(scene%pairs(deepest%pair)%surface)%name//' enter '// &
        scene%obstacles(scene%pairs(deepest%pair)%master)%name// &
        ' between their nodes by up to '//to_text(deepest%depth, 3)//', at '// &
        nodes_in_words(scene, deepest%nodes)
      if (.not. console%quiet) call clear_bar(console)
      call print_lines(console, line)
    end if
    deepest = face_entry_t()
  end subroutine tell_entries

  !> Say, at the end of a step, where a pressure is that of one node or two.
  subroutine tell_small_contacts(console, scene, plan, increment, prescribed, report)
    type(console_t), intent(inout) :: console
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(increment_t), intent(in) :: increment
    logical, intent(in) :: prescribed(:, :) !! (3,n_nodes)
    type(increment_report_t), intent(in) :: report
    type(small_contact_t) :: small(size(scene%pairs))
    character(:), allocatable :: words
    integer :: i

    small = find_small_contacts(scene, plan%points, prescribed, report%contact)
    do i = 1, size(small)
      if (small(i)%count == 0) cycle
      words = 'one point'
      if (small(i)%n_points == 2) words = 'two points'
      words = words//' at node '//to_text(scene%mesh%node_id(small(i)%node))
      if (small(i)%count > 1) words = words//', as '//to_text(small(i)%count - 1)// &
        ' more of its contacts on one or two'
      call clear_bar(console)
      call say('note: step '//to_text(increment%step)//': '//scene%pairs(i)%name//' rests on '// &
        words//': contact pressure is not resolved; bricks of about '// &
        to_text(small(i)%brick, 2)//' needed')
    end do
  end subroutine tell_small_contacts

  !> Memory that HDF5 may ask for while an increment is written: its tables, and a few copies of
  !> the longest row, of a field or of the state, which it shuffles and deflates.
  function room_to_write(scene, plan) result(bytes)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    integer(i8) :: bytes
    integer(i8), parameter :: tables = 16000000_i8, copies = 4, tensor = 48
    type(field_t), allocatable :: fields(:)
    integer :: i

    bytes = tensor*max(scene%mesh%n_nodes, scene%mesh%n_elements)
    call list_view_fields(scene, plan%points%n > 0, fields)
    do i = 1, size(fields)
      bytes = max(bytes, int(block_bytes(fields(i)), i8))
    end do
    bytes = tables + copies*bytes
  end function room_to_write

end module run_increments_mod
