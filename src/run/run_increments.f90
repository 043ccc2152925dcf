!> The increments of a run, one after the other: solve, export, judge, write, print.
module run_increments_mod
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t
  use system_mod, only: wall_seconds
  use resource_limits_mod, only: check_library_room
  use controls_mod, only: take_double, accuracy_of_resultants
  use scene_mod, only: scene_t
  use plan_mod, only: plan_t, figure_of
  use increments_mod, only: done_of_deck, asked_number
  use step_fields_mod, only: fields_due
  use output_field_mod, only: field_t, block_bytes
  use view_fields_mod, only: list_view_fields
  use gauss_fields_mod, only: list_gauss_fields
  use step_solver_mod, only: step_solver_t
  use contact_zone_mod, only: mark_touched
  use quantity_values_mod, only: measure_quantities, add_in_time
  use meet_accuracy_mod, only: set_contact_tolerance, accuracy_shortfall
  use result_file_mod, only: result_file_t, append_increment
  use unseen_contact_mod, only: share_of_supports
  use tally_mod, only: add_increment
  use export_problems_mod, only: exports_t, export_increment
  use console_mod, only: console_t, count_from, say, print_increment, print_warning, clear_bar
  use checkpoint_mod, only: progress_t, not_known, save_checkpoint
  use increment_notes_mod, only: note_t
  use judge_increment_mod, only: solved_t, watch_t, begin_watch, judge_increment
  use solve_next_mod, only: solve_next
  use increment_report_mod, only: entered_beside_mesh
  implicit none
  private

  public :: run_increments, room_to_write

contains

  !> From where the run stands to its end.
  subroutine run_increments(scene, plan, exports, solver, file, console, progress, error)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(inout) :: plan
    type(exports_t), intent(in) :: exports
    type(step_solver_t), intent(inout) :: solver
    !! its tolerance follows the accuracy; its precision is double where single does not do
    type(result_file_t), intent(inout) :: file
    type(console_t), intent(inout) :: console
    type(progress_t), intent(inout) :: progress
    type(error_t), allocatable, intent(out) :: error
    type(watch_t) :: watch
    type(solved_t) :: solved
    integer :: n_tangents
    type(note_t), allocatable :: notes(:)
    character(:), allocatable :: missed !! accuracy, and by what

    call begin_watch(scene, watch)
    call count_from(console, done_of_deck(scene%steps, progress%state%step, &
      progress%state%position), plan%n_increments)
    if (.not. (console%counted > 0.0_wp .or. console%is_one_of)) console%planned = &
      figure_of(plan, 'cpu_seconds')
    if (progress%in_double > 0) call take_double(solver%choices%precision)
    increments: do
      solver%choices%tolerance = progress%tolerance
      allocate (notes(0))
      n_tangents = solver%on_tangents%n_factorisations
      solver%choices%shows_progress = console%terminal .and. .not. console%headed
      call solve_next(scene, plan, solver, progress, watch, solved, notes, error)
      if (solver%choices%shows_progress) call clear_bar(console)
      solved%report%tangents = solved%report%tangents + solver%on_tangents%n_factorisations - &
        n_tangents
      call print_notes(console, notes)
      if (allocated(error) .or. .not. solved%found) exit increments
      ! Also where the increment is not solved: others may want to try.
      call export_increment(scene, solver%contact, solved%increment, progress%state, &
        solved%report, exports, error)
      if (allocated(error)) exit increments
      call judge_increment(scene, plan, solver, progress, watch, solved, notes, error)
      call print_notes(console, notes)
      if (allocated(error)) exit increments
      call write_increment(scene, plan, solved, file, console%started, progress, missed, error)
      if (allocated(error)) exit increments
      call print_increment(console, solved%increment, done_of_deck(scene%steps, &
        solved%increment%step, solved%increment%position), solved%report)
      if (missed /= '') call print_warning(console, missed)
      deallocate (notes)
      if (progress%state%ends_run) exit increments
    end do increments
  end subroutine run_increments

  !> Print notes, and take them off the list.
  subroutine print_notes(console, notes)
    type(console_t), intent(in) :: console
    type(note_t), allocatable, intent(inout) :: notes(:)
    integer :: i

    do i = 1, size(notes)
      if (console%quiet .and. .not. notes(i)%even_if_quiet) cycle
      call clear_bar(console)
      call say(notes(i)%text)
    end do
    deallocate (notes)
    allocate (notes(0))
  end subroutine print_notes

  !> Write an increment: from here on it is done.
  subroutine write_increment(scene, plan, solved, file, started, progress, missed, error)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(solved_t), intent(in) :: solved
    type(result_file_t), intent(inout) :: file
    real(wp), intent(in) :: started             !! wall time at which the session began [s]
    type(progress_t), intent(inout) :: progress !! its tolerance follows the accuracy
    character(:), allocatable, intent(out) :: missed !! accuracy, and by what; '' where it is met
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: clock

    clock = wall_seconds()
    missed = ''
    call check_library_room(room_to_write(scene, plan), 'write the result file', error)
    if (allocated(error)) return
    associate (increment => solved%increment, report => solved%report)
      call append_increment(file, scene, plan, solved%state, report, error)
      if (allocated(error)) return
      progress%tally%allowed = max(progress%tally%allowed, 10.0_wp*progress%tolerance)
      if (increment%last_of_step) then
        missed = accuracy_shortfall(scene, increment%step, report%errors, report%mesh_error)
        call set_contact_tolerance(scene, plan%choices%divisions, progress%tolerance, report%errors)
      end if
      if (missed /= '') progress%tally%missed = progress%tally%missed + 1
      call add_increment(increment, report, fields_due(scene%output%frequency, &
        asked_number(increment%position), increment%last_of_step), progress%tally)
    end associate
    call note_errors(scene, plan, solved, progress)
    if (allocated(progress%sequence)) call note_values(scene, plan, solved, progress)
    progress%state = solved%state
    progress%cycle = solved%cycle
    progress%seen(1, :) = merge(1.0_wp, 0.0_wp, solved%entries%is_seen)
    progress%tally%total_time = progress%tally%earlier_time + wall_seconds() - started
    call save_checkpoint(progress, file, error)
    progress%tally%write_time = progress%tally%write_time + wall_seconds() - clock
  end subroutine write_increment

  !> Keep the worst errors.
  subroutine note_errors(scene, plan, solved, progress)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(solved_t), intent(in) :: solved
    type(progress_t), intent(inout) :: progress
    real(wp) :: of_supports

    associate (increment => solved%increment, errors => solved%report%errors)
      progress%worst_errors = max(progress%worst_errors, [errors%load_steps, errors%contact + &
        errors%arithmetic, errors%mesh])
      if (scene%steps(increment%step)%is_dynamic) then
        ! Of a mean in time one contact problem says nothing.
        progress%worst_errors(1) = not_known
        return
      end if
      if (.not. increment%last_of_step) return
      if (errors%load_steps < 0.0_wp) progress%worst_errors(1) = not_known
      progress%geometry = max(progress%geometry, [entered_beside_mesh(errors), errors%at_edges, &
        errors%of_facets])
      if (errors%geometry < 0.0_wp) progress%geometry = not_known
      of_supports = 0.0_wp
      if (scene%accuracy%of == accuracy_of_resultants) of_supports = share_of_supports( &
        plan%points, solved%report%contact, solved%state%displacement)
      progress%alone = max(progress%alone, errors%mesh + of_supports)
    end associate
  end subroutine note_errors

  !> Keep what the accuracy is of, at the end of an increment of the deck; of a dynamic *STEP the
  !> mean, for its end.
  subroutine note_values(scene, plan, solved, progress)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(solved_t), intent(in) :: solved
    type(progress_t), intent(inout) :: progress !! its values
    real(wp) :: now(size(progress%values, 1))
    integer :: asked

    associate (increment => solved%increment, step => scene%steps(solved%increment%step), &
      before => sum(scene%steps(:solved%increment%step - 1)%n_increments))
      call mark_touched(plan%points, solved%report%contact, progress%touched)
      asked = asked_number(increment%position)
      if (asked < 0 .and. .not. step%is_dynamic) return
      call measure_quantities(scene, plan%points, progress%sequence%list, solved%state, &
        solved%report, now)
      if (step%is_dynamic) then
        call add_in_time(progress%sequence%list, increment%fraction - increment%begin, &
          progress%latest(:, 1), now, progress%values(:, before + step%n_increments))
      else
        progress%values(:, before + asked) = now
      end if
      progress%latest(:, 1) = now
    end associate
  end subroutine note_values

  !> Memory that HDF5 may ask for while an increment is written: its tables, and a few copies of
  !> the longest row, of a field or of the state, which it shuffles and deflates.
  integer(i8) function room_to_write(scene, plan) result(bytes)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    integer(i8), parameter :: tables = 16000000_i8, copies = 4, tensor = 48
    type(field_t), allocatable :: fields(:), at_points(:)
    integer :: i

    bytes = tensor*max(scene%mesh%n_nodes, scene%mesh%n_elements)
    call list_view_fields(scene, plan%points%n > 0, fields)
    call list_gauss_fields(scene, at_points)
    do i = 1, size(fields)
      bytes = max(bytes, int(block_bytes(fields(i)), i8))
    end do
    do i = 1, size(at_points)
      bytes = max(bytes, int(block_bytes(at_points(i)), i8))
    end do
    bytes = tables + copies*bytes
  end function room_to_write

end module run_increments_mod
