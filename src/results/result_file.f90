!> The result file of a run: one HDF5 file, a VTKHDF picture and a plain history at once.
!>
!> docs/results.md describes it. A run is written in three kinds of calls:
!>
!>   1. `open_result`       after everything that can fail cheaply: deck, plan;
!>      `reopen_result`     instead, to go on with a run that did not finish
!>   2. `append_increment`  once an increment, then `count_increment`: with what it takes to go on
!>                          from there (`keep_state` does that for the start). Increments that take
!>                          less time than counting is worth are counted together
!>   3. `finish_result`     however the run ends
!>
!> The file begins beside its place, as NAME.vtkhdf.new, and takes its place when the first
!> increment is complete in it. So a run that comes to nothing (a singular stiffness, too little
!> memory) leaves the result of an earlier run alone, and a reader never meets a file without
!> increments.
!>
!> Order of counting: data and state, then a flush, then the count of the fields, a flush, the count
!> of the increments, a flush. So what a killed program leaves behind holds every
!> increment that was counted, its fields with it, and the state it ended in; a later state does not
!> hold. Only the first flush is one of the whole file. Where the last state is damaged and a run
!> goes on from the one before, it appends again what is there already, and nothing happens.
!>
!> Of a file that others may read nothing that they read is ever moved or made anew: counters and
!> the like are there from the beginning and get their values in place.
module result_file_mod
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t, raise, exit_ok, exit_wrong_input, exit_machine
  use system_mod, only: wall_seconds
  use child_process_mod, only: child_t, is_child, end_child, wait_for
  use text_mod, only: string_t, to_text
  use controls_mod, only: accuracy_of_energy
  use scene_mod, only: scene_t
  use plan_mod, only: plan_t
  use mesh_sequence_mod, only: mesh_sequence_t
  use sequence_error_mod, only: sequence_error_t
  use state_mod, only: state_t
  use increments_mod, only: ends_step, asked_number
  use increment_report_mod, only: increment_report_t
  use step_fields_mod, only: fields_due
  use output_field_mod, only: field_source_t
  use hdf5_files_mod, only: hdf5_file_t, create_file, open_file, copy_object, exists, &
    flush_file, close_file, is_open
  use hdf5_attributes_mod, only: read_attribute, write_attribute
  use hdf5_datasets_mod, only: read_dataset
  use result_history_mod, only: history_t, create_history, append_history, finish_row, &
    say_what_small_strain_is
  use result_contact_mod, only: pair_rows_t, create_contact, append_contact, pair_groups
  use result_view_mod, only: view_t, create_view, append_step, count_steps, finish_view
  use result_state_mod, only: slots_t, create_state, write_state, read_state
  use result_checksums_mod, only: checksums_t, create_checksums, append_checksum, seal_contents, &
    check_contents, read_increments, steps_until
  use result_run_mod, only: provenance_t, write_run, resume_run, end_run
  use result_accuracy_mod, only: create_accuracy, finish_accuracy
  use result_claims_mod, only: claim_place, check_place, open_unfinished, begin_look, &
    clear_beginning, how_it_is_damaged
  use fresh_file_mod, only: beginning_of, take_place, delete_file, settle, folder_lock_t, &
    lock_folder, unlock_folder
  use xdmf_mod, only: write_xdmf, xdmf_path
  use result_fields_mod, only: open_field_t, append_fields
  use result_limit_mod, only: check_limit
  use result_beside_mod, only: create_references, create_springs
  use result_gauss_mod, only: create_gauss
  use result_sets_mod, only: write_sets
  use result_print_mod, only: print_rows_t, create_prints, append_prints
  use print_table_mod, only: node_table_path, element_table_path, write_print_tables
  use contact_table_mod, only: contact_table_path, list_contact_table, write_contact_table
  implicit none
  private

  public :: result_file_t
  public :: open_result, open_nothing, reopen_result, append_increment, count_increment
  public :: count_appended, keep_state, keep_accuracy, finish_result
  public :: sidecars_of

  integer, parameter :: n_sidecars = 4
  real(wp), parameter :: may_be_lost = 0.2_wp !! by a kill, of increments that are done [s]

  !> An open result file.
  type :: result_file_t
    character(:), allocatable :: path !! its final place
    integer :: n_rows = 0             !! increments that are complete in it
    integer :: n_outputs = 0          !! increments with fields that were appended, or gone past
    integer :: n_damaged = 0          !! increments that were finished and are to be done again
    logical :: is_kept = .true.       !! else nothing is written, and no file made
    type(hdf5_file_t), private :: hdf5
    type(history_t),   private :: history
    type(view_t),      private :: view
    type(pair_rows_t), private, allocatable :: pairs(:)
    type(print_rows_t), private, allocatable :: prints(:)
    type(open_field_t), private, allocatable :: references(:), springs(:), gauss(:)
    type(slots_t),     private :: slots
    type(checksums_t), private :: checksums
    integer,           private :: mesh_size(3) = 0
    !! nodes, elements, numbers that a mixed mesh has in XDMF
    integer,           private :: cell = 0            !! of all elements; 0: they are several
    integer,           private :: row = 0             !! of the increment appended last
    real(wp), allocatable, private :: state(:)        !! it ended in, where it is not counted yet
    real(wp),          private :: counted_at = 0.0_wp !! wall time of the last count [s]
    logical,           private :: is_broken = .false. !! something could not be written
  end type result_file_t

contains

  ! ------------------------------------------------------------------ opening

  !> Begin the result file of a run.
  subroutine open_result(path, scene, plan, provenance, overwrite, file, error, sequence)
    character(*), intent(in) :: path
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(provenance_t), intent(in) :: provenance
    logical, intent(in) :: overwrite !! replace whatever stands at `path` and no run writes
    type(result_file_t), intent(out) :: file
    type(error_t), allocatable, intent(out) :: error
    type(mesh_sequence_t), intent(in), optional :: sequence !! that it goes on with a run

    call check_folder(path, error)
    if (allocated(error)) return
    call check_limit(beginning_of(path), scene, plan, error)
    if (allocated(error)) return
    call claim_place(path, scene, overwrite, rows_at_most(scene, plan), file%hdf5, error)
    if (allocated(error)) return
    file%path = path
    call write_run(file%hdf5, scene, plan, provenance, error)
    if (.not. allocated(error)) call lay_out(file, scene, plan, 0, error)
    if (present(sequence)) call create_accuracy(file%hdf5, sequence, error)
    call create_state(file%hdf5, 8*scene%mesh%n_nodes, error)
    call seal_contents(file%hdf5, error)
    call flush_file(file%hdf5, error)
    if (allocated(error)) call discard(file)
  end subroutine open_result

  !> Begin a run of a sequence whose result nobody will look at: it is not written. Only that the
  !> place is free for those that follow is seen to.
  subroutine open_nothing(path, scene, overwrite, file, error)
    character(*), intent(in) :: path
    type(scene_t), intent(in) :: scene
    logical, intent(in) :: overwrite !! as of open_result
    type(result_file_t), intent(out) :: file
    type(error_t), allocatable, intent(out) :: error

    file%path = path
    file%is_kept = .false.
    call check_folder(path, error)
    if (.not. allocated(error)) call check_place(path, scene, overwrite, error)
  end subroutine open_nothing

  !> Refuse a path that is a folder's.
  subroutine check_folder(path, error)
    character(*), intent(in) :: path
    type(error_t), allocatable, intent(out) :: error
    logical :: is_folder

    inquire (file=path//'/.', exist=is_folder)
    if (is_folder) call raise(error, exit_wrong_input, "'"//path//"' is a folder")
  end subroutine check_folder

  !> Open the file of a run that did not finish, to go on with it.
  !>
  !> What of it is sound is written anew beside it, in a child process, and takes its place: what a
  !> killed program or a failing disk left in the old one, in its tables too, is not written to. The
  !> last increment is left out where it is damaged and the state before it is there.
  subroutine reopen_result(path, scene, plan, provenance, file, state, error)
    character(*), intent(in) :: path
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(provenance_t), intent(in) :: provenance !! of the program that goes on
    type(result_file_t), intent(out) :: file
    real(wp), allocatable, intent(out) :: state(:) !! as it was given to keep_state
    type(error_t), allocatable, intent(out) :: error
    !! in use, foreign, damaged; another deck, overrides or version; finished; no room for the copy
    type(folder_lock_t) :: lock
    type(child_t) :: child
    character(:), allocatable :: answer, fate
    integer :: status, n_rows, n_sound

    allocate (state(0))
    file%path = path
    lock = lock_folder(path)
    call begin_look(path, child)
    if (is_child(child)) call end_child(child, written_anew(path, scene, plan, provenance))
    call wait_for(child, answer, fate)
    if (fate /= '') then
      call raise(error, exit_wrong_input, how_it_is_damaged(path, fate))
    else
      read (answer, *) status, n_rows, n_sound
      if (status /= exit_ok) call raise(error, status, answer(index(answer, new_line('a')) + 1:))
    end if
    if (.not. allocated(error)) then
      file%n_damaged = n_rows - n_sound
      call open_file(beginning_of(path), .true., file%hdf5, error)
      call read_state(file%hdf5, int(n_sound, i8), file%slots, state, error)
      if (.not. allocated(error)) call lay_out(file, scene, plan, n_sound, error)
      call resume_run(file%hdf5, provenance, error)
      call flush_file(file%hdf5, error)
      if (.not. allocated(error)) call settle(beginning_of(path))
      if (.not. allocated(error)) call publish(file, error)
      if (allocated(error)) call discard(file)
    end if
    call unlock_folder(lock)
  end subroutine reopen_result

  !> Write what is sound in the file of an unfinished run to a new one, where that begins: exit
  !> status, finished and sound increments in a line, then what went wrong. Nothing is left of a
  !> copy that was not made.
  function written_anew(path, scene, plan, provenance) result(answer)
    character(*), intent(in) :: path
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(provenance_t), intent(in) :: provenance
    character(:), allocatable :: answer
    type(hdf5_file_t) :: old
    type(result_file_t) :: new
    type(error_t), allocatable :: error, ignored
    integer :: n_rows, n_sound
    logical :: begun

    new%path = path
    begun = .false.
    call open_unfinished(path, scene, provenance, old, n_rows, n_sound, error)
    if (.not. allocated(error)) call clear_beginning(path, error)
    if (.not. allocated(error)) call check_limit(beginning_of(path), scene, plan, error)
    if (.not. allocated(error)) then
      call create_file(beginning_of(path), rows_at_most(scene, plan), new%hdf5, error)
      begun = .true.
    end if
    call copy_object(old, '/run', new%hdf5, error)
    if (exists(old, '/accuracy')) call copy_object(old, '/accuracy', new%hdf5, error)
    if (.not. allocated(error)) call lay_out(new, scene, plan, 0, error)
    call create_state(new%hdf5, 8*scene%mesh%n_nodes, error)
    if (.not. allocated(error)) call copy_increments(old, n_sound, new, error)
    call close_file(new%hdf5, error)
    if (allocated(error) .and. begun) call delete_file(beginning_of(path))
    call close_file(old, ignored)
    answer = to_text(exit_ok)//' '//to_text(n_rows)//' '//to_text(n_sound)
    if (allocated(error)) answer = to_text(error%exit_status)//' 0 0'//new_line('a')//error%message
  end function written_anew

  !> Copy the first increments of a file, and see that the copy is what was written.
  subroutine copy_increments(old, n_sound, new, error)
    type(hdf5_file_t), intent(in) :: old
    integer, intent(in) :: n_sound
    type(result_file_t), intent(inout) :: new
    type(error_t), allocatable, intent(inout) :: error
    type(slots_t) :: of_old
    real(wp), allocatable :: state(:)
    integer(i8) :: contents
    integer :: n_steps, n_copied, row

    call read_increments(old, n_sound, n_copied, error, new%hdf5)
    call steps_until(old, n_sound, n_steps, error)
    call write_attribute(new%hdf5, '/VTKHDF/Steps', 'NSteps', int(n_steps, i8), error)
    call finish_row(new%hdf5, n_sound, error)
    call read_state(old, int(n_sound, i8), of_old, state, error, row)
    call write_state(new%hdf5, row, state, new%slots, error)
    call read_attribute(old, '/checksums', 'contents', contents, error)
    call write_attribute(new%hdf5, '/checksums', 'contents', contents, error)
    call flush_file(new%hdf5, error)
    if (.not. allocated(error)) call check_contents(new%hdf5, error)
    call read_increments(new%hdf5, n_sound, n_copied, error)
    if (allocated(error)) return
    if (n_copied /= n_sound) call raise(error, exit_machine, "cannot write '"//new%hdf5%path// &
      "': increment "//to_text(n_copied + 1)//' is not read as it was written')
  end subroutine copy_increments

  !> What error/small_strain is of.
  pure function small_strain_is(scene, plan) result(words)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    character(:), allocatable :: words

    words = 'bound'
    if (scene%accuracy%follows_theory .and. .not. plan%choices%precision%iterative) words = &
      'estimate'
    if (scene%finite_strain) words = 'finite strain'
  end function small_strain_is

  !> Make the groups of a run, or open those of one that is continued.
  subroutine lay_out(file, scene, plan, n_rows, error)
    type(result_file_t), intent(inout) :: file
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    integer, intent(in) :: n_rows !! that are finished
    type(error_t), allocatable, intent(out) :: error
    integer :: n_steps

    file%n_rows = n_rows
    file%mesh_size = [size(scene%mesh%element_nodes), scene%mesh%n_elements, &
      scene%mesh%n_elements + size(scene%mesh%connectivity%node)]
    file%cell = minval(scene%mesh%connectivity%cell)
    if (any(scene%mesh%connectivity%cell /= file%cell)) file%cell = 0
    n_steps = 0
    if (n_rows > 0) call steps_until(file%hdf5, n_rows, n_steps, error)
    if (allocated(error)) return
    call create_history(file%hdf5, n_rows, scene%accuracy%of == accuracy_of_energy, &
      small_strain_is(scene, plan), any(scene%steps%is_dynamic), file%history, error)
    if (allocated(error)) return
    call create_contact(file%hdf5, scene, plan%points, n_rows, file%pairs, error)
    if (allocated(error)) return
    call create_references(file%hdf5, scene, n_rows, file%references, error)
    call create_springs(file%hdf5, scene, n_rows, file%springs, error)
    call create_prints(file%hdf5, scene, n_rows, file%prints, error)
    call write_sets(file%hdf5, scene, error)
    call create_gauss(file%hdf5, scene, n_steps, file%gauss, error)
    if (allocated(error)) return
    call create_view(file%hdf5, scene, plan%points%n > 0, rows_at_most(scene, plan), n_steps, &
      file%view, error)
    call create_checksums(file%hdf5, n_rows, file%checksums, error)
  end subroutine lay_out

  ! ------------------------------------------------------------------ writing

  !> Append an increment, which does not count yet.
  !>
  !> Its histories always; its fields where `fields_due` says so. What the file of a continued run
  !> has already is not appended again.
  subroutine append_increment(file, scene, plan, state, report, error)
    type(result_file_t), intent(inout) :: file
    type(scene_t), intent(in), target :: scene
    type(plan_t), intent(in), target :: plan
    type(state_t), intent(in), target :: state
    type(increment_report_t), intent(in), target :: report
    type(error_t), allocatable, intent(out) :: error
    type(field_source_t) :: source
    integer(i8) :: checksum
    logical :: due

    if (.not. file%is_kept) return
    call check_in_place(file, error)
    if (allocated(error)) return
    call check_limit(file%hdf5%path, scene, plan, error)
    if (allocated(error)) return
    checksum = 0
    source%scene => scene
    source%points => plan%points
    source%state => state
    source%report => report
    due = fields_due(scene%output%frequency, asked_number(state%position), &
      ends_step(scene%steps, state))

    if (due) file%n_outputs = file%n_outputs + 1
    due = due .and. file%n_outputs > file%view%n_steps
    if (due) call append_fields(file%gauss, source, checksum, error)
    if (due) call append_step(file%view, source, checksum, error)
    if (state%increments_done > file%n_rows) then
      call append_contact(file%pairs, source, checksum, error)
      call append_fields(file%references, source, checksum, error)
      call append_fields(file%springs, source, checksum, error)
      call append_prints(file%prints, source, checksum, error)
      call append_history(file%history, state, report, scene%mesh, plan%points, checksum, error)
      ! Shadow runs may begin while the run goes.
      if (report%errors%follows_theory .and. small_strain_is(scene, plan) == 'bound') call &
        say_what_small_strain_is(file%hdf5, 'estimate', error)
      call append_checksum(file%checksums, checksum, file%view%n_steps, error)
    end if
    file%row = state%increments_done
    file%is_broken = allocated(error)
  end subroutine append_increment

  !> Count the increment that was appended, with what it takes to go on from it; at once, where more
  !> than the time that a kill may cost has gone by since one was counted.
  subroutine count_increment(file, numbers, error)
    type(result_file_t), intent(inout) :: file
    real(wp), intent(in) :: numbers(:)
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: now

    if (.not. file%is_kept) return
    now = wall_seconds()
    file%state = numbers
    if (file%n_rows > 0 .and. now - file%counted_at < may_be_lost) return
    file%counted_at = now
    call count_appended(file, error)
  end subroutine count_increment

  !> See what was appended safely to the disk, and count it, where it is not counted.
  subroutine count_appended(file, error)
    type(result_file_t), intent(inout) :: file
    type(error_t), allocatable, intent(out) :: error

    if (.not. allocated(file%state)) return
    call write_state(file%hdf5, file%row, file%state, file%slots, error)
    deallocate (file%state)
    call flush_file(file%hdf5, error)
    call count_steps(file%hdf5, file%view, error)
    if (file%row > file%n_rows) then
      call finish_row(file%hdf5, file%row, error)
      if (.not. allocated(error) .and. file%n_rows == 0) call publish(file, error)
      if (.not. allocated(error)) file%n_rows = file%row
    end if
    file%is_broken = allocated(error)
  end subroutine count_appended

  !> Refuse to write on into a file that has been deleted, or beside it: what is written would go
  !> with the end of the program.
  subroutine check_in_place(file, error)
    type(result_file_t), intent(in) :: file
    type(error_t), allocatable, intent(out) :: error !! it is gone
    logical :: there

    if (file%n_rows == 0) return
    inquire (file=file%path, exist=there)
    if (.not. there) call raise(error, exit_machine, "'"//file%path//"' is no longer there: it "// &
      'was deleted, renamed or moved while the run wrote to it, with '//to_text(file%n_rows)// &
      ' increments')
  end subroutine check_in_place

  !> Keep what it takes to go on from the start.
  subroutine keep_state(file, numbers, error)
    type(result_file_t), intent(inout) :: file
    real(wp), intent(in) :: numbers(:)
    type(error_t), allocatable, intent(out) :: error

    if (.not. file%is_kept) return
    call write_state(file%hdf5, 0, numbers, file%slots, error)
    call flush_file(file%hdf5, error)
    file%is_broken = allocated(error)
  end subroutine keep_state

  !> Keep what the runs of a sequence say, when the last one is done.
  subroutine keep_accuracy(file, sequence, errors, is_reached, error)
    type(result_file_t), intent(inout) :: file
    type(mesh_sequence_t), intent(in) :: sequence
    type(sequence_error_t), intent(in) :: errors
    logical, intent(in) :: is_reached
    type(error_t), allocatable, intent(out) :: error

    if (.not. file%is_kept) return
    call finish_accuracy(file%hdf5, sequence, errors, is_reached, error)
    file%is_broken = allocated(error)
  end subroutine keep_accuracy

  !> The paths of all that may stand beside a result.
  pure function sidecars_of(path) result(sidecars)
    character(*), intent(in) :: path !! of the result
    type(string_t) :: sidecars(n_sidecars)

    sidecars(1)%text = xdmf_path(path)
    sidecars(2)%text = contact_table_path(path)
    sidecars(3)%text = node_table_path(path)
    sidecars(4)%text = element_table_path(path)
  end function sidecars_of

  !> Put the file in its place, which may be that of an older one. It stays open.
  subroutine publish(file, error)
    type(result_file_t), intent(inout) :: file
    type(error_t), allocatable, intent(out) :: error
    type(string_t) :: older(n_sidecars)
    integer :: i

    call take_place(file%path, error)
    if (allocated(error)) return
    file%hdf5%path = file%path
    ! An older sidecar would lead readers beyond the end of the new file.
    older = sidecars_of(file%path)
    do i = 1, size(older)
      call delete_file(older(i)%text)
    end do
  end subroutine publish

  !> Close the file, saying how the run ended, and write what stands beside it: the tables of text,
  !> the XDMF sidecar.
  !>
  !> A file without a complete increment is removed. One that could not be written is left as it is,
  !> like that of a killed run: to close it HDF5 would write again, and where a limit on files keeps
  !> it from doing all of that nobody could open the file any more.
  subroutine finish_result(file, status, counters, error)
    type(result_file_t), intent(inout) :: file
    character(*), intent(in) :: status  !! run_finished, run_not_solved, ...
    real(wp), intent(in) :: counters(:) !! in the order of their names: sizes, times [s], memory
    !! [bytes]; empty where the run began without
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: time(:)
    type(string_t), allocatable :: groups(:), table(:)

    if (.not. is_open(file%hdf5)) return
    if (file%n_rows == 0) then
      call discard(file)
      return
    end if
    if (.not. file%is_broken) call count_appended(file, error)
    if (file%is_broken) return
    call finish_view(file%view, error)
    call end_run(file%hdf5, status, counters, error)
    call read_dataset(file%hdf5, '/VTKHDF/Steps/Values', time, error)
    call pair_groups(file%pairs, groups)
    call list_contact_table(file%hdf5, groups, file%n_rows, table, error)
    if (.not. allocated(error)) call check_in_place(file, error)
    call write_print_tables(file%hdf5, file%path, file%prints, file%n_rows, error)
    call close_file(file%hdf5, error)
    if (allocated(error) .or. (size(table) == 0 .and. file%view%n_steps == 0)) return
    call check_in_place(file, error)
    if (allocated(error)) return
    call write_contact_table(contact_table_path(file%path), table, error)
    if (allocated(error) .or. file%view%n_steps == 0) return
    call write_xdmf(file%path, time, file%view%fields, file%mesh_size, file%cell, error)
  end subroutine finish_result

  ! ------------------------------------------------------------------ helpers

  !> Increments that the file is to hold: those of the plan; more where some may be cut.
  pure integer function rows_at_most(scene, plan)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    integer, parameter :: where_cut = 1024

    rows_at_most = plan%n_increments
    if (all(scene%steps%direct)) return
    rows_at_most = max(where_cut, int(min(2_i8*plan%n_increments, int(huge(1), i8))))
  end function rows_at_most

  !> Close and remove a file that has not taken its place.
  subroutine discard(file)
    type(result_file_t), intent(inout) :: file
    type(error_t), allocatable :: ignored

    call close_file(file%hdf5, ignored)
    call delete_file(beginning_of(file%path))
  end subroutine discard

end module result_file_mod
