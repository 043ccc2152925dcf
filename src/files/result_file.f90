!> The result file of a run: one HDF5 file, a VTKHDF picture and a plain history at once.
!>
!> docs/results.md describes it. A run is written in three kinds of calls:
!>
!>   1. `open_result`       after everything that can fail cheaply: deck, plan;
!>      `reopen_result`     instead, to go on with a run that did not finish
!>   2. `append_increment`  once an increment, then `keep_state`: what it takes to go on from there
!>   3. `finish_result`     however the run ends
!>
!> The file begins beside its place, as NAME.vtkhdf.new, and takes its place when the first
!> increment is complete in it. So a run that comes to nothing (a singular stiffness, too little
!> memory) leaves the result of an earlier run alone, and a reader never meets a file without
!> increments.
!>
!> Order within an increment: data, then a flush, then the count of the fields, a flush, the count
!> of the increments, a flush; the state last. So what a killed program leaves behind holds every
!> increment that was counted, its fields with it, and a state no later than those. Whoever goes on
!> from that state appends again what is there already, and nothing happens.
!>
!> Of a file that others may read nothing that they read is ever moved or made anew: counters and
!> the like are there from the beginning and get their values in place.
module result_file_mod
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t, raise, exit_wrong_input, exit_machine
  use text_mod, only: string_t, to_text
  use machine_room_mod, only: file_limit, no_limit
  use scene_mod, only: scene_t
  use plan_mod, only: plan_t, bound_in_words
  use state_mod, only: state_t
  use increments_mod, only: ends_step
  use step_report_mod, only: step_report_t
  use step_fields_mod, only: step_fields_t, fields_due
  use hdf5_files_mod, only: hdf5_file_t, look_at_file, create_file, open_file, keep_clear, &
    flush_file, close_file, is_open, create_group, exists, file_absent, file_readable, &
    file_locked, file_foreign
  use hdf5_attributes_mod, only: write_attribute, read_attribute
  use hdf5_datasets_mod, only: write_dataset, rewrite_dataset, write_text, read_text
  use hdf5_rows_mod, only: read_rows
  use result_history_mod, only: history_t, create_history, append_history, finish_row
  use result_contact_mod, only: pair_rows_t, nodal_contact_t, create_contact, append_contact, &
                                contact_at_nodes
  use result_view_mod, only: view_t, create_view, append_step, count_step
  use result_state_mod, only: slots_t, create_state, write_state, read_state
  use fresh_file_mod, only: beginning_of, take_place, delete_file, folder_lock_t, lock_folder, &
    unlock_folder, is_locked
  use xdmf_mod, only: write_xdmf, xdmf_path
  implicit none
  private

  public :: result_file_t, provenance_t
  public :: open_result, reopen_result, append_increment, keep_state, finish_result
  public :: run_finished, run_not_solved, run_stopped, run_failed

  ! What /run@status says. It is `running` until `finish_result`, and for ever if that never comes.
  character(*), parameter :: run_running = 'running'
  character(*), parameter :: run_finished = 'finished'     !! all increments are there
  character(*), parameter :: run_not_solved = 'not solved' !! an increment found no solution
  character(*), parameter :: run_stopped = 'stopped'       !! by a signal
  character(*), parameter :: run_failed = 'failed'         !! the machine: memory, a library
  integer, parameter :: longest_status = 16
  integer(i8), parameter :: empty_file = 2000000_i8 !! bytes before the first increment, about
  integer, parameter :: room_for_sessions = 1000 !! bytes, a line each time a run was continued

  character(*), parameter :: program_name = 'bipot'
  character(*), parameter :: in_use = 'is in use by another program, perhaps a run that writes it'

  !> Who made the file. What is not allocated is left empty.
  type :: provenance_t
    character(:), allocatable :: version   !! of the program
    character(:), allocatable :: build     !! compiler and its flags
    character(:), allocatable :: libraries !! names and versions
    character(:), allocatable :: command   !! the command line
    character(:), allocatable :: blas_core !! the kernels OpenBLAS runs
    character(:), allocatable :: started   !! date and time, ISO 8601
    integer :: ranks = 1                   !! processes that ran together
    type(string_t), allocatable :: counters(:) !! names of those that finish_result will get
  end type provenance_t

  !> An open result file.
  type :: result_file_t
    character(:), allocatable :: path !! its final place
    integer :: n_rows = 0             !! increments that are complete in it
    integer :: n_outputs = 0          !! increments with fields that were appended, or gone past
    type(hdf5_file_t), private :: hdf5
    type(history_t),   private :: history
    type(view_t),      private :: view
    type(pair_rows_t), private, allocatable :: pairs(:)
    type(slots_t),     private :: slots
    logical,           private :: is_broken = .false. !! something could not be written
  end type result_file_t

contains

  ! ------------------------------------------------------------------ opening

  !> Begin the result file of a run.
  subroutine open_result(path, scene, plan, provenance, overwrite, file, error)
    character(*), intent(in) :: path
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(provenance_t), intent(in) :: provenance
    logical, intent(in) :: overwrite !! replace whatever stands at `path` and no run writes
    type(result_file_t), intent(out) :: file
    type(error_t), allocatable, intent(out) :: error
    type(folder_lock_t) :: lock
    logical :: is_folder, was_there

    inquire (file=path//'/.', exist=is_folder)
    if (is_folder) then
      call raise(error, exit_wrong_input, "'"//path//"' is a folder")
      return
    end if
    call check_limit(beginning_of(path), empty_file, scene, plan, error)
    if (allocated(error)) return
    ! One run at a time may look at what is there and claim the name. A run that has begun holds a
    ! lock on its file, wherever that stands: first where it begins, then in its place.
    lock = lock_folder(path)
    call clear_beginning(path, error)
    if (.not. allocated(error)) then
      call check_replaceable(path, scene%name, overwrite, error)
    end if
    if (.not. allocated(error)) then
      inquire (file=beginning_of(path), exist=was_there)
      call create_file(beginning_of(path), rows_at_most(plan), file%hdf5, error)
      ! On a full disk the file may be there all the same.
      if (allocated(error) .and. .not. was_there) call delete_file(beginning_of(path))
    end if
    call unlock_folder(lock)
    if (allocated(error)) return
    file%path = path
    call write_run(file%hdf5, scene, plan, provenance, error)
    if (.not. allocated(error)) call lay_out(file, scene, plan, 0, error)
    call create_state(file%hdf5, 8*scene%mesh%n_nodes, error)
    call flush_file(file%hdf5, error)
    if (allocated(error)) call discard(file)
  end subroutine open_result

  !> Open the file of a run that did not finish, to go on with it.
  !>
  !> What a killed program was writing is cut off.
  subroutine reopen_result(path, scene, plan, provenance, file, state, error)
    character(*), intent(in) :: path
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(provenance_t), intent(in) :: provenance !! of the program that goes on
    type(result_file_t), intent(out) :: file
    real(wp), allocatable, intent(out) :: state(:) !! as it was given to keep_state
    type(error_t), allocatable, intent(out) :: error
    !! in use, foreign, damaged; another deck, overrides or version; finished
    type(error_t), allocatable :: ignored
    type(folder_lock_t) :: lock
    integer(i8) :: finished

    allocate (state(0))
    lock = lock_folder(path)
    call look_before_reopening(path, scene, provenance, error)
    if (.not. allocated(error)) call open_file(path, .true., file%hdf5, error)
    call unlock_folder(lock)
    if (allocated(error)) return
    file%path = path
    call read_state(file%hdf5, file%slots, state, error)
    if (.not. allocated(error)) then
      call keep_clear(file%hdf5, error)
      call read_attribute(file%hdf5, '/history', 'finished', finished, error)
      if (.not. allocated(error)) then
        if (finished < 0 .or. finished > huge(1)) call raise(error, exit_machine, &
          "'"//path//"' counts "//to_text(finished)//' increments: it is damaged')
      end if
      if (.not. allocated(error)) call lay_out(file, scene, plan, int(finished), error)
      call write_attribute(file%hdf5, '/run', 'status', padded(run_running), error)
      call note_session(file%hdf5, provenance, error)
      call flush_file(file%hdf5, error)
    end if
    if (allocated(error)) then
      call close_file(file%hdf5, ignored)
    else
      ! Its extents are those of the datasets as they were.
      call delete_file(xdmf_path(path))
    end if
  end subroutine reopen_result

  !> See whether a run can be continued; only to read: a file that was open for writing is another
  !> even if nothing was written.
  subroutine look_before_reopening(path, scene, provenance, error)
    character(*), intent(in) :: path
    type(scene_t), intent(in) :: scene
    type(provenance_t), intent(in) :: provenance
    type(error_t), allocatable, intent(out) :: error
    type(hdf5_file_t) :: hdf5
    type(slots_t) :: slots
    real(wp), allocatable :: state(:)

    select case (look_at_file(path))
    case (file_foreign)
      call raise(error, exit_wrong_input, "'"//path//"' is not a result of "//program_name)
    case (file_locked)
      call raise(error, exit_wrong_input, "'"//path//"' "//in_use)
    case (file_readable)
      call open_file(path, .false., hdf5, error)
    case default
      call raise(error, exit_wrong_input, "'"//path//"' cannot be read: it is damaged or cut off")
    end select
    if (allocated(error)) return
    call check_same_run(hdf5, path, scene, provenance, error)
    call read_state(hdf5, slots, state, error)
    call close_file(hdf5, error)
  end subroutine look_before_reopening

  !> Make the groups of a run, or open those of one that is continued.
  subroutine lay_out(file, scene, plan, n_rows, error)
    type(result_file_t), intent(inout) :: file
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    integer, intent(in) :: n_rows !! that are finished
    type(error_t), allocatable, intent(out) :: error
    integer :: n_steps

    file%n_rows = n_rows
    n_steps = 0
    if (n_rows > 0) call count_steps(file%hdf5, n_rows, n_steps, error)
    if (allocated(error)) return
    call create_history(file%hdf5, n_rows, file%history, error)
    if (allocated(error)) return
    call create_contact(file%hdf5, scene, plan%points, n_rows, file%pairs, error)
    if (allocated(error)) return
    call create_view(file%hdf5, scene%mesh, scene%output, plan%points%n > 0, n_steps, &
      file%view, error)
  end subroutine lay_out

  !> How many increments with fields are sure: the finished ones.
  !>
  !> The one after them may be counted, and the time of it not be written.
  subroutine count_steps(hdf5, n_rows, n_steps, error)
    type(hdf5_file_t), intent(in) :: hdf5
    integer, intent(in) :: n_rows !! that are finished
    integer, intent(out) :: n_steps
    type(error_t), allocatable, intent(inout) :: error
    real(wp), allocatable :: values(:), time(:)
    integer(i8) :: counted
    integer :: i

    n_steps = 0
    call read_attribute(hdf5, '/VTKHDF/Steps', 'NSteps', counted, error)
    call read_rows(hdf5, '/VTKHDF/Steps/Values', int(min(counted, int(huge(1), i8))), values, error)
    call read_rows(hdf5, '/history/time', n_rows, time, error)
    if (allocated(error)) return
    do i = 1, size(values)
      if (any(.not. abs(time - values(i)) > 0.0_wp)) n_steps = i
    end do
  end subroutine count_steps

  !> Refuse to continue anything but an unfinished run of this deck by this program.
  subroutine check_same_run(hdf5, path, scene, provenance, error)
    type(hdf5_file_t), intent(in) :: hdf5
    character(*), intent(in) :: path
    type(scene_t), intent(in) :: scene
    type(provenance_t), intent(in) :: provenance
    type(error_t), allocatable, intent(out) :: error
    type(error_t), allocatable :: unreadable
    character(:), allocatable :: maker, name, version, status, deck, overrides, matter

    maker = ''
    if (exists(hdf5, '/run')) call read_attribute(hdf5, '/run', 'program', maker, unreadable)
    if (maker /= program_name) then
      call raise(error, exit_wrong_input, "'"//path//"' is not a result of "//program_name)
      return
    end if
    call read_attribute(hdf5, '/run', 'name', name, unreadable)
    call read_attribute(hdf5, '/run', 'version', version, unreadable)
    call read_attribute(hdf5, '/run', 'status', status, unreadable)
    call read_text(hdf5, '/run/deck', deck, unreadable)
    call read_text(hdf5, '/run/overrides', overrides, unreadable)
    if (allocated(unreadable)) then
      call move_alloc(unreadable, error)
      return
    end if
    if (name /= scene%name) then
      matter = "is the result of another deck, '"//name//"'"
    else if (status == run_finished) then
      matter = 'is finished: there is nothing to continue'
    else if (version /= text_of(provenance%version)) then
      matter = 'was begun by version '//version//' of '//program_name//', this is version '// &
        text_of(provenance%version)
    else if (overrides /= text_of(scene%overrides)) then
      matter = 'was begun '//with_parameters(overrides)//', not '// &
        with_parameters(text_of(scene%overrides))
    else if (deck /= text_of(scene%deck)) then
      matter = 'was begun with a deck that was otherwise: '// &
        first_difference(deck, text_of(scene%deck))
    else
      return
    end if
    call raise(error, exit_wrong_input, "'"//path//"' "//matter)
  end subroutine check_same_run

  pure function with_parameters(overrides) result(words)
    character(*), intent(in) :: overrides !! name=value a line
    character(:), allocatable :: words
    integer :: i

    words = 'without --set'
    if (overrides == '') return
    words = "with --set "//overrides
    do i = 1, len(words)
      if (words(i:i) == new_line('a')) words(i:i) = ' '
    end do
  end function with_parameters

  !> In which line two texts first differ, and how.
  pure function first_difference(then, now) result(words)
    character(*), intent(in) :: then, now
    character(:), allocatable :: words
    character, parameter :: nl = new_line('a')
    integer :: i, line, first

    line = 1
    first = 1
    do i = 1, min(len(then), len(now)) + 1
      if (character_at(then) /= character_at(now)) exit
      if (character_at(then) /= nl) cycle
      line = line + 1
      first = i + 1
    end do
    words = 'line '//to_text(line)//" was '"//line_at(then)//"', is '"//line_at(now)//"'"

  contains

    !> The last line ends like the others.
    pure character function character_at(text)
      character(*), intent(in) :: text

      character_at = nl
      if (i <= len(text)) character_at = text(i:i)
    end function character_at

    pure function line_at(text) result(found)
      character(*), intent(in) :: text
      character(:), allocatable :: found

      found = text(min(first, len(text) + 1):)
      found = found(:index(found//nl, nl) - 1)
    end function line_at

  end function first_difference

  !> Add a line to the sessions that continued the run; where there is no room the oldest go.
  subroutine note_session(hdf5, provenance, error)
    type(hdf5_file_t), intent(in) :: hdf5
    type(provenance_t), intent(in) :: provenance
    type(error_t), allocatable, intent(inout) :: error
    character(:), allocatable :: sessions
    character(room_for_sessions) :: text

    call read_attribute(hdf5, '/run', 'continued', sessions, error)
    if (sessions /= '') sessions = sessions//new_line('a')
    sessions = sessions//text_of(provenance%started)//' '//text_of(provenance%command)
    do while (len(sessions) > room_for_sessions .and. index(sessions, new_line('a')) > 0)
      sessions = sessions(index(sessions, new_line('a')) + 1:)
    end do
    text = repeat(achar(0), room_for_sessions)
    text(:min(len(sessions), room_for_sessions)) = sessions
    call write_attribute(hdf5, '/run', 'continued', text, error)
  end subroutine note_session

  !> Refuse to replace anything but a finished result of the same deck.
  subroutine check_replaceable(path, name, overwrite, error)
    character(*), intent(in) :: path
    character(*), intent(in) :: name     !! of the deck
    logical, intent(in) :: overwrite     !! anything may be replaced
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: matter, advice

    advice = ' (--overwrite replaces it)'
    select case (look_at_file(path))
    case (file_absent)
      return
    case (file_locked)
      ! Not even --overwrite takes it from a run that is alive.
      call raise(error, exit_wrong_input, "'"//path//"' "//in_use)
      return
    case (file_foreign)
      matter = 'is not a result of '//program_name
    case (file_readable)
      matter = matter_with_result(path, name)
      if (matter == '') return
    case default
      matter = 'cannot be read'
    end select
    if (overwrite) return
    call raise(error, exit_wrong_input, "'"//path//"' "//matter//advice)
  end subroutine check_replaceable

  !> Why a readable HDF5 file must stay; empty for a finished result of the same deck.
  function matter_with_result(path, name) result(matter)
    character(*), intent(in) :: path, name
    character(:), allocatable :: matter, maker, deck, status
    type(hdf5_file_t) :: file
    type(error_t), allocatable :: error, ignored
    integer(i8) :: n_rows

    matter = 'is not a result of '//program_name
    call open_file(path, .false., file, error)
    if (allocated(error)) return
    if (exists(file, '/run')) then
      call read_attribute(file, '/run', 'program', maker, error)
      call read_attribute(file, '/run', 'name', deck, error)
      call read_attribute(file, '/run', 'status', status, error)
      call read_attribute(file, '/history', 'finished', n_rows, error)
      if (.not. allocated(error)) then
        if (maker == program_name .and. deck /= name) then
          matter = "is the result of another deck, '"//deck//"'"
        else if (maker == program_name .and. status /= run_finished) then
          matter = 'is an unfinished result ('//to_text(n_rows)//' increments, '//status// &
            '), which --continue goes on with'
        else if (maker == program_name) then
          matter = ''
        end if
      end if
    end if
    call close_file(file, ignored)
  end function matter_with_result

  !> Remove what a run left that was killed before its first increment.
  subroutine clear_beginning(path, error)
    character(*), intent(in) :: path
    type(error_t), allocatable, intent(out) :: error

    if (is_locked(beginning_of(path))) then
      ! Not even --overwrite: that run is alive, and would put its file in the place of ours.
      call raise(error, exit_wrong_input, "another run is about to write '"//path//"'")
    else
      call delete_file(beginning_of(path))
    end if
  end subroutine clear_beginning

  subroutine write_run(hdf5, scene, plan, provenance, error)
    type(hdf5_file_t), intent(in) :: hdf5
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(provenance_t), intent(in) :: provenance
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: table
    integer :: i

    call create_group(hdf5, '/run', error)
    call write_attribute(hdf5, '/run', 'description', 'what was run, by what, and how it ended', &
                         error)
    call write_attribute(hdf5, '/run', 'program', program_name, error)
    call write_attribute(hdf5, '/run', 'name', text_of(scene%name), error)
    call write_attribute(hdf5, '/run', 'version', text_of(provenance%version), error)
    call write_attribute(hdf5, '/run', 'build', text_of(provenance%build), error)
    call write_attribute(hdf5, '/run', 'libraries', text_of(provenance%libraries), error)
    call write_attribute(hdf5, '/run', 'blas_core', text_of(provenance%blas_core), error)
    call write_attribute(hdf5, '/run', 'ranks', int(provenance%ranks, i8), error)
    call write_attribute(hdf5, '/run', 'command', text_of(provenance%command), error)
    call write_attribute(hdf5, '/run', 'started', text_of(provenance%started), error)
    call write_attribute(hdf5, '/run', 'status', padded(run_running), error)
    call write_attribute(hdf5, '/run', 'continued', repeat(achar(0), room_for_sessions), error)
    if (allocated(provenance%counters)) call write_counters(hdf5, provenance%counters, &
      spread(0.0_wp, 1, size(provenance%counters)), error)

    call write_text(hdf5, '/run/deck', text_of(scene%deck), 'the deck as read, includes put in', &
                    error)
    call write_text(hdf5, '/run/overrides', text_of(scene%overrides), &
                    'parameters given on the command line, name=value a line', error)
    table = ''
    if (allocated(plan%lines)) then
      do i = 1, size(plan%lines)
        table = table//plan%lines(i)%text//new_line('a')
      end do
    end if
    call write_text(hdf5, '/run/plan', table, 'what the run was to do, decided before it began', &
                    error)
    if (allocated(plan%figures)) call write_estimates(hdf5, plan, error)
  end subroutine write_run

  !> The numbers of the plan, under the names that the counters have.
  subroutine write_estimates(hdf5, plan, error)
    type(hdf5_file_t), intent(in) :: hdf5
    type(plan_t), intent(in) :: plan
    type(error_t), allocatable, intent(inout) :: error
    type(string_t) :: names(size(plan%figures)), bounds(size(plan%figures))
    integer :: i

    do i = 1, size(plan%figures)
      names(i)%text = plan%figures(i)%name
      bounds(i)%text = bound_in_words(plan%figures(i)%bound)
    end do
    call write_dataset(hdf5, '/run/estimates', plan%figures%value, &
                       'numbers of the plan; their names are in the attribute "name", how they '// &
                       'are meant (fixed, at most, about) in "bound"', 'number', error)
    call write_attribute(hdf5, '/run/estimates', 'name', names, error)
    call write_attribute(hdf5, '/run/estimates', 'bound', bounds, error)
  end subroutine write_estimates

  !> The counters, or zeros where they are to come.
  subroutine write_counters(hdf5, names, counters, error)
    type(hdf5_file_t), intent(in) :: hdf5
    type(string_t), intent(in) :: names(:) !! (n)
    real(wp), intent(in) :: counters(:)    !! (n)
    type(error_t), allocatable, intent(inout) :: error

    call write_dataset(hdf5, '/run/counters', counters, &
                       'sizes, times in seconds and memory of the run; their names are in the '// &
                       'attribute "name"', 'number', error)
    call write_attribute(hdf5, '/run/counters', 'name', names, error)
  end subroutine write_counters

  ! ------------------------------------------------------------------ writing

  !> Append an increment and see it safely to the disk.
  !>
  !> Its histories always; its fields where `fields_due` says so. What the file of a continued run
  !> has already is not appended again.
  subroutine append_increment(file, scene, plan, state, report, fields, error)
    type(result_file_t), intent(inout) :: file
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(state_t), intent(in) :: state
    type(step_report_t), intent(in) :: report
    type(step_fields_t), intent(in) :: fields !! what is asked for, when fields are due
    type(error_t), allocatable, intent(out) :: error
    type(nodal_contact_t) :: nodal
    integer(i8) :: written
    integer :: worst_node
    logical :: due

    call check_in_place(file, error)
    if (allocated(error)) return
    inquire (file=file%hdf5%path, size=written)
    call check_limit(file%hdf5%path, written, scene, plan, error)
    if (allocated(error)) return
    worst_node = 0
    if (report%worst_point > 0) worst_node = plan%points%node(report%worst_point)
    due = fields_due(scene%output%frequency, state%increment, ends_step(scene%steps, state))

    if (due) file%n_outputs = file%n_outputs + 1
    due = due .and. file%n_outputs > file%view%n_steps
    if (due) then
      if (scene%output%contact .and. plan%points%n > 0) then
        nodal = contact_at_nodes(scene%mesh%n_nodes, plan%points, state, report%contact)
      end if
      call append_step(file%view, state, fields, nodal, error)
    end if
    if (state%row > file%n_rows) then
      call append_contact(file%pairs, state, report%contact, error)
      call append_history(file%history, state, report, worst_node, error)
    end if
    call flush_file(file%hdf5, error)

    if (due) call count_step(file%hdf5, state%time, file%view, error)
    if (state%row > file%n_rows) then
      call finish_row(file%hdf5, file%n_rows + 1, error)
      call flush_file(file%hdf5, error)
      if (.not. allocated(error) .and. file%n_rows == 0) call publish(file, error)
      if (.not. allocated(error)) file%n_rows = file%n_rows + 1
    end if
    file%is_broken = allocated(error)
  end subroutine append_increment

  !> Refuse to begin an increment that may not fit under a limit on files (ulimit -f).
  !>
  !> Where a write fails there HDF5 goes on to write where the file would have ended, and nobody
  !> could open it any more; on a full disk it ends there all the same, with a hole.
  subroutine check_limit(path, written, scene, plan, error)
    character(*), intent(in) :: path
    integer(i8), intent(in) :: written !! bytes that the file has
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(error_t), allocatable, intent(out) :: error !! it may not fit
    integer(i8), parameter :: megabyte = 1000000_i8
    integer(i8) :: limit, needed

    limit = file_limit()
    if (limit == no_limit) return
    needed = written + most_of_increment(scene, plan)
    if (needed <= limit) return
    call raise(error, exit_machine, "cannot write '"//path// &
      "': the limit on files (ulimit -f) is "// &
      to_text(real(limit, wp)/megabyte, 3)//' MB, and with an increment more it may take '// &
      to_text(real(needed, wp)/megabyte, 3)//' MB')
  end subroutine check_limit

  !> What an increment and its state take in the file, nothing squeezed [bytes].
  pure integer(i8) function most_of_increment(scene, plan) result(bytes)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    integer(i8), parameter :: tables = 1000000_i8 !! a chunk of 4 KB of every history, and so on
    integer(i8), parameter :: of_node = 81 + 240, of_brick = 8, of_point = 137 + 100, tensors = 2*48

    bytes = tables + of_node*scene%mesh%n_nodes + of_brick*scene%mesh%n_elements + &
      of_point*plan%points%n
    if (.not. (scene%output%stress .or. scene%output%strain)) return
    bytes = bytes + tensors*(scene%mesh%n_nodes + 9_i8*scene%mesh%n_elements)
  end function most_of_increment

  !> Refuse to write on into a file that has been deleted: what is written would go with the end of
  !> the program.
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

  !> Keep what it takes to go on from an increment that was appended, or from the start.
  subroutine keep_state(file, row, numbers, error)
    type(result_file_t), intent(inout) :: file
    integer, intent(in) :: row          !! of the increment; 0: the start
    real(wp), intent(in) :: numbers(:)
    type(error_t), allocatable, intent(out) :: error

    call write_state(file%hdf5, row, numbers, file%slots, error)
    call flush_file(file%hdf5, error)
    file%is_broken = allocated(error)
  end subroutine keep_state

  !> Put the file in its place, which may be that of an older one. It stays open.
  subroutine publish(file, error)
    type(result_file_t), intent(inout) :: file
    type(error_t), allocatable, intent(out) :: error

    call take_place(file%path, error)
    if (allocated(error)) return
    file%hdf5%path = file%path
    ! An older sidecar would lead readers beyond the end of the new file.
    call delete_file(xdmf_path(file%path))
  end subroutine publish

  !> Close the file, saying how the run ended, and write its XDMF sidecar.
  !>
  !> A file without a complete increment is removed. One that could not be written is left as it is,
  !> like that of a killed run: to close it HDF5 would write again, and where a limit on files keeps
  !> it from doing all of that nobody could open the file any more.
  subroutine finish_result(file, status, counter_names, counters, error)
    type(result_file_t), intent(inout) :: file
    character(*), intent(in) :: status             !! run_finished, run_not_solved, ...
    type(string_t), intent(in) :: counter_names(:) !! (n)
    real(wp), intent(in) :: counters(:)            !! (n) sizes, times [s], memory [bytes]
    type(error_t), allocatable, intent(out) :: error

    if (.not. is_open(file%hdf5)) return
    if (file%n_rows == 0) then
      call discard(file)
      return
    end if
    if (file%is_broken) return
    if (exists(file%hdf5, '/run/counters')) then
      call rewrite_dataset(file%hdf5, '/run/counters', counters, error)
    else
      call write_counters(file%hdf5, counter_names, counters, error)
    end if
    ! All else must be in the file before it calls itself finished.
    call flush_file(file%hdf5, error)
    call write_attribute(file%hdf5, '/run', 'status', padded(status), error)
    call close_file(file%hdf5, error)
    if (.not. allocated(error) .and. file%view%n_steps > 0) call write_xdmf(file%path, error)
  end subroutine finish_result

  ! ------------------------------------------------------------------ helpers

  !> Increments that the file is to hold: twice as many as planned, should some be cut.
  pure integer function rows_at_most(plan)
    type(plan_t), intent(in) :: plan

    rows_at_most = int(min(2_i8*plan%n_increments, int(huge(1), i8)))
  end function rows_at_most

  !> A status with room for the longest one: an attribute keeps the length it began with.
  pure function padded(status) result(text)
    character(*), intent(in) :: status
    character(longest_status) :: text

    text = repeat(achar(0), longest_status)
    text(:len(status)) = status
  end function padded

  !> Close and remove a file that has not taken its place.
  subroutine discard(file)
    type(result_file_t), intent(inout) :: file
    type(error_t), allocatable :: ignored

    call close_file(file%hdf5, ignored)
    call delete_file(beginning_of(file%path))
  end subroutine discard

  !> The text, or nothing.
  pure function text_of(text) result(given)
    character(*), intent(in), optional :: text !! may be an allocatable that is not allocated
    character(:), allocatable :: given

    given = ''
    if (present(text)) given = text
  end function text_of

end module result_file_mod
