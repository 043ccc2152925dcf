!> Who may write a result file: a new run beside the place it is to take, or a run that goes on.
!>
!> One run at a time may look at what is there and claim the name: it locks the folder for that
!> long. A run that has begun holds a lock on its file, wherever that stands: first where it begins,
!> then in its place.
!>
!> A file that is there already is looked at in a child process, all of it where a run is to go on:
!> HDF5 may crash, or search for ever, in one that is damaged.
module result_claims_mod
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t, raise, exit_wrong_input
  use text_mod, only: printable, to_text
  use child_process_mod, only: child_t, begin_child, is_child, end_child, wait_for
  use controls_mod, only: precision_controls_t
  use mesh_size_mod, only: mesh_size_t
  use scene_mod, only: scene_t
  use hdf5_files_mod, only: hdf5_file_t, look_at_file, create_file, open_file, close_file, exists, &
    file_absent, file_readable, file_locked, file_foreign
  use hdf5_attributes_mod, only: read_attribute
  use hdf5_datasets_mod, only: read_text
  use fresh_file_mod, only: beginning_of, delete_file, folder_lock_t, lock_folder, unlock_folder, &
    is_locked
  use compare_runs_mod, only: first_difference, same_overrides, with_parameters
  use result_state_mod, only: slots_t, read_state
  use result_checksums_mod, only: has_checksums, check_contents, read_increments
  use result_run_mod, only: provenance_t, program_name, run_finished, run_settled, text_of, &
    read_arithmetic, read_mesh_size
  implicit none
  private

  public :: theory_in_file, is_result_of, take_arithmetic, take_mesh_size, claim_place, &
    check_place, open_unfinished, begin_look, clear_beginning, how_it_is_damaged

  character(*), parameter :: in_use = 'is in use by another program, perhaps a run that writes it'
  character(*), parameter :: not_a_result = 'is not a result of '//program_name
  character(*), parameter :: begins_anew = '; --overwrite starts the run again'
  character(*), parameter :: reader_ended = 'it ends whoever reads all of it'

contains

  ! ------------------------------------------------------------------ a new run

  !> Create the file of a new run where it begins, if it may take its place later.
  subroutine claim_place(path, scene, overwrite, n_rows, hdf5, error)
    character(*), intent(in) :: path   !! of the place
    type(scene_t), intent(in) :: scene !! what the deck and the command line say
    logical, intent(in) :: overwrite   !! replace whatever stands there and no run writes
    integer, intent(in) :: n_rows      !! increments that the file is to hold, at most
    type(hdf5_file_t), intent(out) :: hdf5
    type(error_t), allocatable, intent(out) :: error
    !! what stands there must stay, a run is about to write there, or the file cannot be created
    type(folder_lock_t) :: lock
    logical :: was_there

    lock = lock_folder(path)
    call clear_beginning(path, error)
    if (.not. allocated(error)) call check_replaceable(path, scene, overwrite, error)
    if (.not. allocated(error)) then
      inquire (file=beginning_of(path), exist=was_there)
      call create_file(beginning_of(path), n_rows, hdf5, error)
      ! On a full disk the file may be there all the same.
      if (allocated(error) .and. .not. was_there) call delete_file(beginning_of(path))
    end if
    call unlock_folder(lock)
  end subroutine claim_place

  !> Refuse to run where the result of the last run of a sequence could not take its place. Nothing
  !> is claimed.
  subroutine check_place(path, scene, overwrite, error)
    character(*), intent(in) :: path   !! of the place
    type(scene_t), intent(in) :: scene !! what the deck and the command line say
    logical, intent(in) :: overwrite   !! replace whatever stands there and no run writes
    type(error_t), allocatable, intent(out) :: error
    type(folder_lock_t) :: lock

    lock = lock_folder(path)
    call clear_beginning(path, error)
    if (.not. allocated(error)) call check_replaceable(path, scene, overwrite, error)
    call unlock_folder(lock)
  end subroutine check_place

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

  !> Refuse to replace anything but a finished result of the same deck with the same parameters.
  subroutine check_replaceable(path, scene, overwrite, error)
    character(*), intent(in) :: path
    type(scene_t), intent(in) :: scene
    logical, intent(in) :: overwrite     !! anything may be replaced
    type(error_t), allocatable, intent(out) :: error
    type(child_t) :: child
    character(:), allocatable :: matter, fate
    logical :: there

    inquire (file=path, exist=there)
    if (.not. there) return
    call begin_look(path, child)
    if (is_child(child)) call end_child(child, matter_with_file(path, scene))
    call wait_for(child, matter, fate)
    if (fate /= '') matter = 'is damaged: '//reader_ended//' ('//fate//')'
    ! Not even --overwrite takes it from a run that is alive.
    if (matter == '' .or. (overwrite .and. matter /= in_use)) return
    if (matter /= in_use) matter = matter//' (--overwrite replaces it)'
    call raise(error, exit_wrong_input, "'"//path//"' "//matter)
  end subroutine check_replaceable

  !> Why a file must not be replaced; empty where there is none, or a finished result of the same
  !> deck with the same parameters.
  function matter_with_file(path, scene) result(matter)
    character(*), intent(in) :: path
    type(scene_t), intent(in) :: scene
    character(:), allocatable :: matter

    select case (look_at_file(path))
    case (file_absent)
      matter = ''
    case (file_locked)
      matter = in_use
    case (file_foreign)
      matter = not_a_result
    case (file_readable)
      matter = matter_with_result(path, scene)
    case default
      matter = 'cannot be read'
    end select
  end function matter_with_file

  !> Start a child that looks at a file.
  subroutine begin_look(path, child)
    character(*), intent(in) :: path
    type(child_t), intent(out) :: child
    integer(i8), parameter :: slowest = 10000000_i8 !! [bytes/s]
    integer(i8), parameter :: room = 1000000000_i8  !! for HDF5's tables and chunks [bytes]
    integer, parameter :: patience = 20             !! [s]
    integer(i8) :: bytes

    inquire (file=path, size=bytes)
    bytes = max(0_i8, bytes)
    call begin_child(patience + int(min(bytes/slowest, 1000000_i8)), room + 4*bytes, child)
  end subroutine begin_look

  !> Why a readable HDF5 file must stay; empty for a finished result of the same deck with the same
  !> parameters.
  function matter_with_result(path, scene) result(matter)
    character(*), intent(in) :: path
    type(scene_t), intent(in) :: scene
    character(:), allocatable :: matter, maker, deck, status, overrides
    type(hdf5_file_t) :: file
    type(error_t), allocatable :: error, ignored
    integer(i8) :: n_rows

    matter = not_a_result
    call open_file(path, .false., file, error)
    if (allocated(error)) return
    if (exists(file, '/run')) then
      call read_attribute(file, '/run', 'program', maker, error)
      call read_attribute(file, '/run', 'name', deck, error)
      call read_attribute(file, '/run', 'status', status, error)
      call read_attribute(file, '/history', 'finished', n_rows, error)
      call read_text(file, '/run/overrides', overrides, error)
      if (.not. allocated(error)) then
        if (maker == program_name .and. deck /= scene%name) then
          matter = "is the result of another deck, '"//printable(deck)//"'"
        else if (maker == program_name .and. status /= run_finished .and. status /= &
          run_settled) then
          matter = 'is an unfinished result ('//to_text(n_rows)//' increments, '// &
            printable(status)// &
            '), which --continue goes on with'
        else if (maker == program_name .and. .not. same_overrides(overrides, &
                                                     text_of(scene%overrides))) then
          matter = 'was made '//with_parameters(overrides)//', not '// &
            with_parameters(text_of(scene%overrides))//': -o FILE writes another file'
        else if (maker == program_name) then
          matter = ''
        end if
      end if
    end if
    call close_file(file, ignored)
  end function matter_with_result

  ! ------------------------------------------------------------------ a run that goes on

  !> Choose the arithmetic in which a run began that is to be continued; nothing where the file does
  !> not tell, which is refused later.
  subroutine take_arithmetic(path, precision, compliance)
    character(*), intent(in) :: path
    type(precision_controls_t), intent(inout) :: precision
    integer, intent(inout) :: compliance !! compliance_dense, ...
    type(child_t) :: child
    character(:), allocatable :: answer, fate
    integer(i8) :: bits
    logical :: iterative, single, saves_time, out_of_core

    call begin_look(path, child)
    if (is_child(child)) call end_child(child, arithmetic_of(path, precision, compliance))
    call wait_for(child, answer, fate)
    if (answer == '') return
    read (answer, *) iterative, single, saves_time, out_of_core, bits, compliance, precision%threads
    precision%iterative = iterative
    precision%single_factor = single
    precision%saves_time = saves_time
    precision%out_of_core = out_of_core
    precision%block_low_rank = transfer(bits, 1.0_wp)
    precision%body_is_given = .true.
    precision%factor_is_given = .true.
    precision%low_rank_is_given = .true.
    precision%core_is_given = .true.
  end subroutine take_arithmetic

  !> Whether a file is the finished result of this deck, word by word, with the same parameters.
  logical function is_result_of(path, scene)
    character(*), intent(in) :: path
    type(scene_t), intent(in) :: scene
    type(child_t) :: child
    character(:), allocatable :: answer, fate

    call begin_look(path, child)
    if (is_child(child)) call end_child(child, merge('yes', 'no ', &
      is_made_of(path, scene)))
    call wait_for(child, answer, fate)
    is_result_of = fate == '' .and. answer == 'yes'
  end function is_result_of

  !> The same, in the child.
  logical function is_made_of(path, scene)
    character(*), intent(in) :: path
    type(scene_t), intent(in) :: scene
    character(:), allocatable :: deck
    type(hdf5_file_t) :: hdf5
    type(error_t), allocatable :: error, ignored

    is_made_of = .false.
    if (matter_with_file(path, scene) /= '') return
    call open_file(path, .false., hdf5, error)
    if (allocated(error)) return
    call read_text(hdf5, '/run/deck', deck, error)
    if (.not. allocated(error)) is_made_of = deck == text_of(scene%deck)
    call close_file(hdf5, ignored)
  end function is_made_of

  !> What the error of the theory is of in a file: bound, estimate, finite strain; empty where it
  !> cannot be read.
  function theory_in_file(path) result(theory)
    character(*), intent(in) :: path
    character(:), allocatable :: theory
    type(child_t) :: child
    character(:), allocatable :: fate

    call begin_look(path, child)
    if (is_child(child)) call end_child(child, theory_of(path))
    call wait_for(child, theory, fate)
  end function theory_in_file

  !> The same, in the child.
  function theory_of(path) result(theory)
    character(*), intent(in) :: path
    character(:), allocatable :: theory
    type(hdf5_file_t) :: hdf5
    type(error_t), allocatable :: error

    theory = ''
    call open_sound(path, hdf5, error)
    if (.not. allocated(error)) call read_attribute(hdf5, '/history/error', &
      'small_strain_is', theory, error)
    if (allocated(error)) theory = ''
  end function theory_of

  !> The arithmetic of a file's run for `take_arithmetic`; empty where it is damaged.
  function arithmetic_of(path, given, given_compliance) result(answer)
    character(*), intent(in) :: path
    type(precision_controls_t), intent(in) :: given
    integer, intent(in) :: given_compliance
    character(:), allocatable :: answer
    type(precision_controls_t) :: precision
    type(hdf5_file_t) :: hdf5
    type(error_t), allocatable :: error
    integer :: compliance
    character(80) :: line

    answer = ''
    precision = given
    call open_sound(path, hdf5, error)
    compliance = given_compliance
    call read_arithmetic(hdf5, precision, compliance, error)
    if (allocated(error)) return
    write (line, '(4(l1,1x),2(i0,1x),i0)') precision%iterative, precision%single_factor, &
      precision%saves_time, precision%out_of_core, transfer(precision%block_low_rank, 0_i8), &
      compliance, precision%threads
    answer = trim(line)
  end function arithmetic_of

  !> Choose the mesh and the divisions of increments with which a run began that is to be continued;
  !> nothing where the file does not tell, which is refused later.
  subroutine take_mesh_size(path, mesh_size, divisions, is_done)
    character(*), intent(in) :: path
    logical, intent(out) :: is_done
    !! the run is finished, and the accuracy that it is for not reached
    type(mesh_size_t), intent(inout) :: mesh_size
    integer, intent(inout) :: divisions
    type(child_t) :: child
    character(:), allocatable :: answer, fate
    type(hdf5_file_t) :: hdf5
    type(error_t), allocatable :: error

    call begin_look(path, child)
    if (is_child(child)) call end_child(child, mesh_size_of(path))
    call wait_for(child, answer, fate)
    is_done = .false.
    if (answer == '') return
    is_done = answer == 'T'
    ! What a child has read does no harm here.
    call open_file(path, .false., hdf5, error)
    call read_mesh_size(hdf5, mesh_size, divisions, error)
    call close_file(hdf5, error)
  end subroutine take_mesh_size

  !> Those of a file's run for `take_mesh_size`; empty where it is damaged.
  function mesh_size_of(path) result(answer)
    character(*), intent(in) :: path
    character(:), allocatable :: answer
    type(mesh_size_t) :: mesh_size
    type(hdf5_file_t) :: hdf5
    type(error_t), allocatable :: error
    character(:), allocatable :: status
    integer(i8) :: is_reached
    integer :: divisions

    answer = ''
    divisions = 1
    call open_sound(path, hdf5, error)
    call read_mesh_size(hdf5, mesh_size, divisions, error)
    call read_attribute(hdf5, '/run', 'status', status, error)
    call read_attribute(hdf5, '/accuracy', 'reached', is_reached, error)
    if (.not. allocated(error)) answer = merge('T', 'F', status == run_finished .and. &
      is_reached == 0)
  end function mesh_size_of

  !> Open the file of a run to take from it how to go on: that is not to be believed before what
  !> does not change in the file has been checked.
  subroutine open_sound(path, hdf5, error)
    character(*), intent(in) :: path
    type(hdf5_file_t), intent(out) :: hdf5
    type(error_t), allocatable, intent(out) :: error !! it cannot be opened, or is damaged

    if (look_at_file(path) == file_readable) then
      call open_file(path, .false., hdf5, error)
      call check_contents(hdf5, error)
    else
      call raise(error, exit_wrong_input, "'"//path//"' cannot be read")
    end if
  end subroutine open_sound

  !> Open the file of a run that did not finish, to read it, if `provenance` may go on with it. All
  !> of it is read: to be called in a child.
  subroutine open_unfinished(path, scene, provenance, hdf5, n_rows, n_sound, error)
    character(*), intent(in) :: path
    type(scene_t), intent(in) :: scene
    type(provenance_t), intent(in) :: provenance  !! of the program that goes on
    type(hdf5_file_t), intent(out) :: hdf5        !! to be closed, after an error too
    integer, intent(out) :: n_rows                !! finished increments
    integer, intent(out) :: n_sound               !! of them, from the first, as they were written
    type(error_t), allocatable, intent(out) :: error
    !! in use, foreign, damaged; another deck, overrides or version; finished

    n_rows = 0
    n_sound = 0
    select case (look_at_file(path))
    case (file_foreign)
      call raise(error, exit_wrong_input, "'"//path//"' "//not_a_result)
    case (file_locked)
      call raise(error, exit_wrong_input, "'"//path//"' "//in_use)
    case (file_readable)
      call open_file(path, .false., hdf5, error)
    case default
      call raise(error, exit_wrong_input, "'"//path//"' cannot be read: it is damaged or cut off")
    end select
    if (allocated(error)) return
    call check_maker(hdf5, path, provenance, error)
    if (allocated(error)) return
    call check_contents(hdf5, error)
    if (.not. allocated(error)) then
      call check_same_run(hdf5, path, scene, error)
      if (allocated(error)) return
      call check_increments(hdf5, path, n_rows, n_sound, error)
    end if
    if (allocated(error)) error%message = error%message//begins_anew
  end subroutine open_unfinished

  !> Why a file that ended the child which looked at it is not taken up.
  function how_it_is_damaged(path, fate) result(words)
    character(*), intent(in) :: path
    character(*), intent(in) :: fate !! of wait_for
    character(:), allocatable :: words

    words = "'"//path//"' is damaged: "//reader_ended//' ('//fate//')'//begins_anew
  end function how_it_is_damaged

  !> Refuse what another program or version has made.
  subroutine check_maker(hdf5, path, provenance, error)
    type(hdf5_file_t), intent(in) :: hdf5
    character(*), intent(in) :: path
    type(provenance_t), intent(in) :: provenance
    type(error_t), allocatable, intent(out) :: error
    type(error_t), allocatable :: unreadable
    character(:), allocatable :: maker, version

    maker = ''
    if (exists(hdf5, '/run')) call read_attribute(hdf5, '/run', 'program', maker, unreadable)
    if (maker /= program_name) then
      call raise(error, exit_wrong_input, "'"//path//"' "//not_a_result)
      return
    end if
    call read_attribute(hdf5, '/run', 'version', version, unreadable)
    if (allocated(unreadable)) then
      call raise(error, exit_wrong_input, "'"//path//"' is damaged: "//unreadable%message)
    else if (version /= text_of(provenance%version)) then
      call raise(error, exit_wrong_input, "'"//path//"' was begun by version "// &
        printable(version)//' of '// &
        program_name//', this is version '//text_of(provenance%version))
    else if (.not. has_checksums(hdf5)) then
      call raise(error, exit_wrong_input, "'"//path//"' has no checksums: it is damaged, or "// &
        'was begun by a build that wrote none'//begins_anew)
    end if
  end subroutine check_maker

  !> Find the increments that are what was written, from the first on; refuse where the run cannot
  !> go on behind them.
  subroutine check_increments(hdf5, path, n_rows, n_sound, error)
    type(hdf5_file_t), intent(in) :: hdf5
    character(*), intent(in) :: path
    integer, intent(out) :: n_rows, n_sound
    type(error_t), allocatable, intent(out) :: error
    type(error_t), allocatable :: unreadable
    type(slots_t) :: slots
    real(wp), allocatable :: state(:)
    integer(i8) :: finished

    n_rows = 0
    n_sound = 0
    call read_attribute(hdf5, '/history', 'finished', finished, error)
    if (allocated(error)) return
    if (finished < 1 .or. finished > huge(1)) then
      call raise(error, exit_wrong_input, "'"//path//"' is damaged: it counts "// &
        to_text(finished)//' increments')
      return
    end if
    n_rows = int(finished)
    call read_increments(hdf5, n_rows, n_sound, error)
    if (allocated(error)) return
    call read_state(hdf5, int(n_sound, i8), slots, state, unreadable)
    if (n_sound == n_rows) then
      if (allocated(unreadable)) call move_alloc(unreadable, error)
    else if (n_sound == 0 .or. allocated(unreadable)) then
      call raise(error, exit_wrong_input, "'"//path//"' is damaged: increment "// &
        to_text(n_sound + 1)//' of '//to_text(n_rows)//' is not what was written, and what it '// &
        'takes to do it again is gone; those before it can be read')
    end if
  end subroutine check_increments

  !> Refuse to continue anything but an unfinished run of this deck.
  subroutine check_same_run(hdf5, path, scene, error)
    type(hdf5_file_t), intent(in) :: hdf5
    character(*), intent(in) :: path
    type(scene_t), intent(in) :: scene
    type(error_t), allocatable, intent(out) :: error
    type(error_t), allocatable :: unreadable
    character(:), allocatable :: name, status, deck, overrides, matter

    call read_attribute(hdf5, '/run', 'name', name, unreadable)
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
    else if (status == run_settled .and. scene%stops_when_steady) then
      matter = 'ends with a load cycle that has settled: without --until-steady, --continue '// &
        'goes on with it'
    else if (.not. same_overrides(overrides, text_of(scene%overrides))) then
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

end module result_claims_mod
