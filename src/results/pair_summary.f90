!> What comes of a run's contact pairs, as a table to be read: the forces at the end of each step,
!> the largest pressures and slips, each with its estimated error and in the digits that it leaves.
!>
!> It is made from the result file when the run has ended, so that a continued run has all of it.
module pair_summary_mod
  use kinds_mod, only: wp, i4, i8
  use errors_mod, only: error_t
  use text_mod, only: digits_where_unknown, string_t, to_text, in_known_digits
  use hdf5_files_mod, only: hdf5_file_t, open_file, close_file
  use hdf5_attributes_mod, only: read_attribute
  use hdf5_datasets_mod, only: read_dataset, read_row
  implicit none
  private

  public :: summarize_pairs, of_normal, of_friction, of_pressure, of_slip, n_errors

  !> Of what errors are known.
  integer, parameter :: of_normal = 1, of_friction = 2, of_pressure = 3, of_slip = 4
  integer, parameter :: n_errors = 4
  !> Friction of a frictionless pair is no more than this, of the force of the pair.
  real(wp), parameter :: of_rounding = 1.0e-9_wp

  !> A pair at the end of an increment.
  type :: pair_sums_t
    real(wp) :: normal(3) = 0.0_wp   !! sum of the normal reactions, x, y, z [force]
    real(wp) :: friction(3) = 0.0_wp !! sum of the friction [force]
    real(wp) :: pressure = 0.0_wp    !! the largest
    real(wp) :: slip = 0.0_wp        !! the longest
    real(wp) :: sum = 0.0_wp         !! of the magnitudes of the normal reactions [force]
    real(wp) :: moment(3) = 0.0_wp   !! of all reactions about the middle of the pair [moment]
    real(wp) :: extent = 0.0_wp      !! of its points from there [length]
  end type pair_sums_t

  integer, parameter :: n_columns = 12
  character(24), parameter :: heads(n_columns) = [character(24) :: 'step', 'pair', &
    'normal force (x, y, z)', 'error', 'friction (x, y, z)', 'error', 'largest pressure', 'error', &
    'largest slip', 'error', 'sum of normal forces', 'moment (x, y, z)']

contains

  !> The lines of the table: a head, one a step and pair, and what `-` means where there is one.
  !> None where there are no pairs. A step that is not complete has its last increment.
  subroutine summarize_pairs(path, groups, by_runs, lines, error)
    character(*), intent(in) :: path         !! of the result
    type(string_t), intent(in) :: groups(:)  !! of its pairs, as they are to follow
    real(wp), intent(in) :: by_runs(:, :)
    !! (n_errors,n_pairs) what several runs say of the errors; negative: nothing [force, pressure,
    !! length]
    type(string_t), allocatable, intent(out) :: lines(:)
    type(error_t), allocatable, intent(out) :: error !! the file cannot be read
    type(hdf5_file_t) :: file
    type(error_t), allocatable :: ignored

    allocate (lines(0))
    if (size(groups) == 0) return
    call open_file(path, .false., file, error)
    if (allocated(error)) return
    call list_lines(file, groups, by_runs, lines, error)
    call close_file(file, ignored)
  end subroutine summarize_pairs

  subroutine list_lines(file, groups, by_runs, lines, error)
    type(hdf5_file_t), intent(in) :: file
    type(string_t), intent(in) :: groups(:)
    real(wp), intent(in) :: by_runs(:, :)
    type(string_t), allocatable, intent(inout) :: lines(:)
    type(error_t), allocatable, intent(inout) :: error
    type(pair_sums_t) :: pairs(size(groups))
    type(string_t), allocatable :: cells(:, :)
    integer(i4), allocatable :: step(:)
    real(wp), allocatable :: total(:)
    integer, allocatable :: ends(:)
    integer(i8) :: n_rows, of_energy
    real(wp) :: of_forces
    integer :: i, j, k
    real(wp) :: errors(n_errors)

    call read_attribute(file, '/history', 'finished', n_rows, error)
    call read_attribute(file, '/history/error', 'of_energy', of_energy, error)
    call read_dataset(file, '/history/step', step, error)
    call read_dataset(file, '/history/error/total', total, error)
    if (allocated(error)) return
    associate (n => int(n_rows))
      ends = pack([(j, j=1, n)], [(step(j) /= step(min(j + 1, n)) .or. j == n, j=1, n)])
    end associate
    allocate (cells(n_columns, 0:size(ends)*size(groups)))
    do k = 1, n_columns
      cells(k, 0)%text = trim(heads(k))
    end do
    do j = 1, size(ends)
      do i = 1, size(groups)
        call read_pair(file, groups(i)%text, ends(j), pairs(i), error)
        if (allocated(error)) return
      end do
      of_forces = -1.0_wp
      if (total(ends(j)) >= 0.0_wp .and. of_energy == 0) of_forces = total(ends(j))* &
        maxval([(norm2(pairs(i)%normal + pairs(i)%friction), i=1, size(pairs))])
      do i = 1, size(groups)
        k = index(groups(i)%text, '/', back=.true.) + 1
        ! What several runs say, and else what the run says itself, which is of forces alone.
        errors = by_runs(:, i)
        where (errors(:of_friction) < 0.0_wp) errors(:of_friction) = of_forces
        call fill_cells(step(ends(j)), groups(i)%text(k:), pairs(i), errors, &
          cells(:, (j - 1)*size(groups) + i))
      end do
    end do
    call align(cells, lines)
  end subroutine list_lines

  !> What the file has of a pair in a row.
  subroutine read_pair(file, group, row, pair, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: group
    integer, intent(in) :: row
    type(pair_sums_t), intent(out) :: pair
    type(error_t), allocatable, intent(inout) :: error
    real(wp), allocatable :: forces(:), pressure(:), slip(:), reaction(:), moment(:), middle(:)
    real(wp), allocatable :: x(:)

    call read_row(file, group//'/forces', row, forces, error)
    call read_row(file, group//'/largest_pressure', row, pressure, error)
    call read_row(file, group//'/largest_slip', row, slip, error)
    call read_row(file, group//'/reaction', row, reaction, error)
    call read_row(file, group//'/moment', row, moment, error)
    call read_dataset(file, group//'/middle', middle, error)
    call read_dataset(file, group//'/coordinates', x, error)
    if (allocated(error)) return
    pair = pair_sums_t(forces(:3), forces(4:), pressure(1), slip(1), sum(reaction(1::3)))
    associate (force => forces(:3) + forces(4:))
      pair%moment = moment - (cshift(middle, 1)*cshift(force, -1) - cshift(middle, -1)* &
        cshift(force, 1))
    end associate
    pair%extent = maxval(abs(reshape(x, [3, size(x)/3]) - spread(middle, 2, size(x)/3)))
  end subroutine read_pair

  !> The cells of a line.
  pure subroutine fill_cells(step, name, pair, errors, cells)
    integer(i4), intent(in) :: step
    character(*), intent(in) :: name
    type(pair_sums_t), intent(in) :: pair
    real(wp), intent(in) :: errors(n_errors) !! negative: not known
    type(string_t), intent(inout) :: cells(:) !! (n_columns)
    real(wp) :: least
    integer :: k

    cells(1)%text = to_text(step)
    cells(2)%text = name
    least = of_rounding*max(pair%sum, norm2(pair%friction))
    cells(3)%text = vector(pair%normal, errors(of_normal), least)
    cells(5)%text = vector(pair%friction, errors(of_friction), least)
    cells(7)%text = rounded_to(pair%pressure, errors(of_pressure))
    cells(9)%text = rounded_to(pair%slip, errors(of_slip))
    cells(11)%text = rounded_to(pair%sum, errors(of_normal))
    cells(12)%text = vector(pair%moment, -1.0_wp, least*pair%extent)
    do k = 1, n_errors
      cells(2 + 2*k)%text = '-'
      ! In two digits.
      if (errors(k) >= 0.0_wp) cells(2 + 2*k)%text = in_known_digits(errors(k), 0.1_wp*errors(k))
    end do
  end subroutine fill_cells

  !> A number to the first digit of its error, but in two digits: less says nothing.
  pure function rounded_to(x, error) result(text)
    real(wp), intent(in) :: x, error
    character(:), allocatable :: text

    text = in_known_digits(x, min(error, 0.1_wp*abs(x)))
  end function rounded_to

  !> (0, 0, -12.3). Where the error is not known, all components are rounded as the largest is, and
  !> else to the first digit of the error, but the largest in two digits.
  pure function vector(x, error, least) result(text)
    real(wp), intent(in) :: x(3), error
    real(wp), intent(in) :: least !! what is rounding at most
    character(:), allocatable :: text
    real(wp) :: rounding

    rounding = min(error, 0.1_wp*maxval(abs(x)))
    if (error < 0.0_wp) rounding = 10.0_wp**(1 - digits_where_unknown)*maxval(abs(x))
    rounding = max(least, rounding)
    text = '('//in_known_digits(x(1), rounding)//', '//in_known_digits(x(2), rounding)//', '// &
      in_known_digits(x(3), rounding)//')'
  end function vector

  !> Columns below their heads, two blanks apart: numbers at their right end, the pairs at their
  !> left.
  subroutine align(cells, lines)
    type(string_t), intent(in) :: cells(:, 0:)
    type(string_t), allocatable, intent(inout) :: lines(:)
    character(*), parameter :: unknown = '      - error not estimated'
    character(:), allocatable :: line, blanks
    integer :: width(n_columns)
    integer :: k, row, last
    logical :: is_unknown

    width = [(maxval([(len(cells(k, row)%text), row=0, ubound(cells, 2))]), k=1, n_columns)]
    is_unknown = any([((cells(k, row)%text == '-', k=1, n_columns), row=1, ubound(cells, 2))])
    last = ubound(cells, 2) + merge(1, 0, is_unknown)
    deallocate (lines)
    allocate (lines(0:last))
    do row = 0, ubound(cells, 2)
      line = ''
      do k = 1, n_columns
        blanks = repeat(' ', width(k) - len(cells(k, row)%text))
        if (k > 1) line = line//'  '
        if (k == 2) then
          line = line//cells(k, row)%text//blanks
        else
          line = line//blanks//cells(k, row)%text
        end if
      end do
      lines(row)%text = line
    end do
    if (is_unknown) lines(last)%text = unknown
  end subroutine align

end module pair_summary_mod
