!> --export-fclib: the condensed contact problems of chosen increments, as files for other programs.
module export_problems_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t, raise, exit_wrong_input
  use text_mod, only: string_t, to_text
  use scene_mod, only: scene_t
  use state_mod, only: state_t
  use increments_mod, only: increment_t
  use increment_report_mod, only: increment_report_t
  use condensed_contact_mod, only: condensed_contact_t, count_points, whole_problem
  use problem_mod, only: contact_problem_t, mu_at
  use fclib_mod, only: export_fclib
  implicit none
  private

  public :: exports_t, choose_rows, export_increment

  !> Which increments are exported.
  type :: exports_t
    logical, allocatable :: chosen(:) !! (n_increments of the run)
    logical :: overwrite = .false.    !! files of another kind too
  end type exports_t

contains

  !> Read which increments of the run are meant: `1,15,30-32` or `all`; nothing for an empty text.
  subroutine choose_rows(text, n_increments, overwrite, exports, error)
    character(*), intent(in) :: text
    integer, intent(in) :: n_increments
    logical, intent(in) :: overwrite
    type(exports_t), intent(out) :: exports
    type(error_t), allocatable, intent(out) :: error !! not such a list, or outside the run
    integer :: first, last, i, comma, dash
    logical :: ok

    exports%overwrite = overwrite
    allocate (exports%chosen(n_increments), source=text == 'all')
    if (text == '' .or. text == 'all') return
    i = 1
    last = 0
    do while (i <= len(text) + 1)
      comma = index(text(i:)//',', ',') + i - 1
      associate (part => text(i:comma - 1))
        dash = index(part, '-')
        if (dash == 0) then
          call read_row(part, first, ok)
          last = first
        else
          call read_row(part(:dash - 1), first, ok)
          if (ok) call read_row(part(dash + 1:), last, ok)
        end if
        if (ok) ok = first <= last
        if (ok .and. last > n_increments) then
          call raise(error, exit_wrong_input, 'bipot: error: --export-fclib: the run has '// &
            to_text(n_increments)//" increments, so there is no '"//part//"'")
        else if (.not. ok) then
          call raise(error, exit_wrong_input, "bipot: error: --export-fclib: '"//part// &
            "' is not an increment or a range; expected is a list as 1,15,30-32, or all")
        end if
        if (allocated(error)) return
        exports%chosen(first:last) = .true.
      end associate
      i = comma + 1
    end do
  end subroutine choose_rows

  !> A whole number from 1 on, of at most nine digits.
  pure subroutine read_row(text, row, ok)
    character(*), intent(in) :: text
    integer, intent(out) :: row
    logical, intent(out) :: ok
    integer :: i

    row = 0
    ok = len(text) > 0 .and. len(text) < 10 .and. verify(text, '0123456789') == 0
    if (.not. ok) return
    do i = 1, len(text)
      row = 10*row + iachar(text(i:i)) - iachar('0')
    end do
    ok = row > 0
  end subroutine read_row

  !> Where an increment is chosen, write NAME-<row>.fclib.hdf5 in the working directory, with the
  !> start and the reactions found.
  subroutine export_increment(scene, condensed, increment, old, report, exports, error)
    type(scene_t), intent(in) :: scene
    type(condensed_contact_t), intent(in) :: condensed
    type(increment_t), intent(in) :: increment
    type(state_t), intent(in) :: old           !! whose reactions the solver started from
    type(increment_report_t), intent(in) :: report
    type(exports_t), intent(in) :: exports
    type(error_t), allocatable, intent(out) :: error
    real(wp), dimension(3, count_points(condensed)) :: start, reaction
    type(contact_problem_t) :: whole
    type(string_t) :: labels(2)
    character(:), allocatable :: path
    integer :: i, k, n

    ! Increments that were cut make more rows than the deck's: of all, these too.
    if (increment%index > size(exports%chosen)) then
      if (.not. all(exports%chosen)) return
    else if (.not. exports%chosen(increment%index)) then
      return
    end if
    path = scene%name//'-'//to_text(increment%index)//'.fclib.hdf5'
    if (count_points(condensed) == 0) then
      call raise(error, exit_wrong_input, 'bipot: error: --export-fclib: no contact point can '// &
        'have a reaction in increment '//to_text(increment%index))
      return
    end if
    n = 0
    do i = 1, size(condensed%group)
      do k = 1, size(condensed%group(i)%active)
        n = n + 1
        associate (point => condensed%group(i)%active(k), contact => report%contact)
          start(:, n) = matmul(old%reaction(:, point), contact%frame(:, :, point))
          reaction(:, n) = contact%reaction(:, point)
        end associate
      end do
    end do
    labels(1)%text = scene%title
    labels(2)%text = 'bipot: condensed contact problem of '//scene%name//', step '// &
      to_text(increment%step)//', increment '//to_text(increment%number)
    ! The format has coefficients: those that belong to the reactions have the same solution.
    whole = whole_problem(condensed)
    whole%mu = [((mu_at(condensed%group(i)%problem, k, report%contact%reaction(1, &
      condensed%group(i)%active(k))), k=1, size(condensed%group(i)%active)), i=1, &
      size(condensed%group))]
    call export_fclib(path, whole, report%x_free, start, reaction, labels, &
      exports%overwrite, error)
  end subroutine export_increment

end module export_problems_mod
