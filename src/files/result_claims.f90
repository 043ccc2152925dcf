!> Who may write a result file: a new run beside the place it is to take, or a run that goes on.
!>
!> One run at a time may look at what is there and claim the name: it locks the folder for that
!> long. A run that has begun holds a lock on its file, wherever that stands: first where it begins,
!> then in its place.
module result_claims_mod
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t, raise, exit_wrong_input
  use text_mod, only: to_text, upper
  use scene_mod, only: scene_t
  use hdf5_files_mod, only: hdf5_file_t, look_at_file, create_file, open_file, close_file, exists, &
    file_absent, file_readable, file_locked, file_foreign
  use hdf5_attributes_mod, only: read_attribute
  use hdf5_datasets_mod, only: read_text
  use fresh_file_mod, only: beginning_of, delete_file, folder_lock_t, lock_folder, unlock_folder, &
    is_locked
  use result_state_mod, only: slots_t, read_state
  use result_run_mod, only: provenance_t, program_name, run_finished, text_of
  implicit none
  private

  public :: claim_place, claim_unfinished

  character(*), parameter :: in_use = 'is in use by another program, perhaps a run that writes it'
  character(*), parameter :: not_a_result = 'is not a result of '//program_name

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
    character(:), allocatable :: matter

    select case (look_at_file(path))
    case (file_absent)
      return
    case (file_locked)
      ! Not even --overwrite takes it from a run that is alive.
      call raise(error, exit_wrong_input, "'"//path//"' "//in_use)
      return
    case (file_foreign)
      matter = not_a_result
    case (file_readable)
      matter = matter_with_result(path, scene)
      if (matter == '') return
    case default
      matter = 'cannot be read'
    end select
    if (overwrite) return
    call raise(error, exit_wrong_input, "'"//path//"' "//matter//' (--overwrite replaces it)')
  end subroutine check_replaceable

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
          matter = "is the result of another deck, '"//deck//"'"
        else if (maker == program_name .and. status /= run_finished) then
          matter = 'is an unfinished result ('//to_text(n_rows)//' increments, '//status// &
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

  !> Open the file of a run that did not finish, if `provenance` may go on with it.
  subroutine claim_unfinished(path, scene, provenance, hdf5, error)
    character(*), intent(in) :: path
    type(scene_t), intent(in) :: scene
    type(provenance_t), intent(in) :: provenance !! of the program that goes on
    type(hdf5_file_t), intent(out) :: hdf5       !! open for writing
    type(error_t), allocatable, intent(out) :: error
    !! in use, foreign, damaged; another deck, overrides or version; finished
    type(folder_lock_t) :: lock

    lock = lock_folder(path)
    call look_before_reopening(path, scene, provenance, error)
    if (.not. allocated(error)) call open_file(path, .true., hdf5, error)
    call unlock_folder(lock)
  end subroutine claim_unfinished

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
    integer(i8) :: n_rows

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
    call check_same_run(hdf5, path, scene, provenance, error)
    call read_attribute(hdf5, '/history', 'finished', n_rows, error)
    call read_state(hdf5, n_rows, slots, state, error)
    call close_file(hdf5, error)
  end subroutine look_before_reopening

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
      call raise(error, exit_wrong_input, "'"//path//"' "//not_a_result)
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

  !> "with --set n=1 --accuracy 0.01", or "without --set".
  pure function with_parameters(overrides) result(words)
    character(*), intent(in) :: overrides !! one a line
    character(:), allocatable :: words, line
    integer :: first

    words = 'without --set'
    if (overrides == '') return
    words = 'with'
    first = 1
    do while (first <= len(overrides))
      call take_line(overrides, first, line)
      if (index(line, '--') /= 1) line = '--set '//line
      words = words//' '//line
    end do
  end function with_parameters

  !> Whether two lists of overrides mean the same: in any order, of one name the last counts.
  pure logical function same_overrides(a, b)
    character(*), intent(in) :: a, b !! one a line

    same_overrides = all_in(a, b)
    if (same_overrides) same_overrides = all_in(b, a)

  contains

    !> Whether all names of one list have the same value in the other.
    pure logical function all_in(list, other)
      character(*), intent(in) :: list, other
      character(:), allocatable :: line
      integer :: first

      all_in = .true.
      first = 1
      do while (first <= len(list) .and. all_in)
        call take_line(list, first, line)
        all_in = value_of(list, name_in(line)) == value_of(other, name_in(line))
      end do
    end function all_in

    !> `=value` of the last line with this name, empty where there is none.
    pure function value_of(list, name) result(value)
      character(*), intent(in) :: list, name
      character(:), allocatable :: value, line
      integer :: first

      value = ''
      first = 1
      do while (first <= len(list))
        call take_line(list, first, line)
        if (name_in(line) == name) value = '='//trim(adjustl(line(split(line) + 1:)))
      end do
    end function value_of

    !> NAME in `name=value` or `--name value`.
    pure function name_in(line) result(name)
      character(*), intent(in) :: line
      character(:), allocatable :: name

      name = trim(adjustl(upper(line(:split(line) - 1))))
    end function name_in

    pure integer function split(line)
      character(*), intent(in) :: line

      split = index(line, '=')
      if (index(line, '--') == 1) split = index(line, ' ')
      if (split == 0) split = len(line) + 1
    end function split

  end function same_overrides

  !> The line of a text that begins at `first`, which moves to the one behind it.
  pure subroutine take_line(text, first, line)
    character(*), intent(in) :: text
    integer, intent(inout) :: first
    character(:), allocatable, intent(out) :: line

    line = text(first:first + index(text(first:)//new_line('a'), new_line('a')) - 2)
    first = first + len(line) + 1
  end subroutine take_line

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

end module result_claims_mod
