!> Sparse matrices as FCLIB's files hold them, and the checks that make a file's numbers usable.
!>
!> A group with the datasets m, n, nzmax, nz, p, i, x; indices from 0. nz >= 0: that many triplets;
!> -1: compressed columns; -2: compressed rows. Triplets come in two habits: `i` rows and `p`
!> columns (Siconos, CSparse) or the reverse (FCLIB's own header). The shape decides; where both
!> fit, the first is taken, and for a symmetric matrix it is the same.
module fclib_matrix_mod
  use kinds_mod, only: wp, i4, i8
  use errors_mod, only: error_t, raise, exit_wrong_input
  use text_mod, only: to_text
  use hdf5_files_mod, only: hdf5_file_t, create_group, exists
  use hdf5_datasets_mod, only: dataset_extents, read_dataset, write_dataset
  implicit none
  private

  public :: sparse_matrix_t, read_matrix, write_matrix, sparse_of, read_numbers, read_count, &
            blame, times, transposed_times, is_usable, most_rows

  integer, parameter :: compressed_columns = -1
  integer, parameter :: compressed_rows = -2
  integer(i8), parameter :: most_rows = 10000000_i8
  !> Deflate packs no tighter than this: a dataset that claims more numbers is not in the file.
  integer(i8), parameter :: most_packed = 1032

  !> A matrix as a list of entries; those at one place add up.
  type :: sparse_matrix_t
    integer :: m = 0                  !! rows
    integer :: n = 0                  !! columns
    integer,  allocatable :: row(:)   !! from 1
    integer,  allocatable :: column(:)
    real(wp), allocatable :: value(:)
  end type sparse_matrix_t

contains

  ! ------------------------------------------------------------------ reading

  !> Read a matrix and check everything about it.
  subroutine read_matrix(file, path, matrix, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path !! of its group
    type(sparse_matrix_t), intent(out) :: matrix
    type(error_t), allocatable, intent(inout) :: error
    integer, allocatable :: p(:), i(:)
    integer :: nz, k

    call read_count(file, path//'/m', 1_i8, most_rows, matrix%m, error)
    call read_count(file, path//'/n', 1_i8, most_rows, matrix%n, error)
    call read_count(file, path//'/nz', -2_i8, int(huge(nz), i8), nz, error)
    call read_indices(file, path//'/p', p, error)
    call read_indices(file, path//'/i', i, error)
    call read_numbers(file, path//'/x', matrix%value, error)
    if (allocated(error)) return
    select case (nz)
    case (compressed_columns)
      call expand(file, path, p, i, matrix%n, matrix, error)
      if (allocated(error)) return
      matrix%row = i(:size(matrix%value)) + 1
      matrix%column = owners(p, matrix%n)
    case (compressed_rows)
      call expand(file, path, p, i, matrix%m, matrix, error)
      if (allocated(error)) return
      matrix%column = i(:size(matrix%value)) + 1
      matrix%row = owners(p, matrix%m)
    case default
      if (min(size(p), size(i), size(matrix%value)) < nz) then
        call blame(error, file, path//' has '//to_text(nz)//' triplets, but only '// &
          to_text(min(size(p), size(i), size(matrix%value)))//' of them are in the file')
        return
      end if
      matrix%value = matrix%value(:nz)
      matrix%row = i(:nz)
      matrix%column = p(:nz)
      if (.not. (inside(matrix%row, matrix%m) .and. inside(matrix%column, matrix%n))) then
        matrix%row = p(:nz)
        matrix%column = i(:nz)
      end if
      ! Not beyond the largest integer: what is outside is found below.
      matrix%row = min(matrix%row, huge(k) - 1) + 1
      matrix%column = min(matrix%column, huge(k) - 1) + 1
    end select
    do k = 1, size(matrix%value)
      if (matrix%row(k) >= 1 .and. matrix%row(k) <= matrix%m .and. matrix%column(k) >= 1 .and. &
          matrix%column(k) <= matrix%n) cycle
      call blame(error, file, path//': entry '//to_text(k)//' lies outside the '// &
        to_text(matrix%m)//' x '//to_text(matrix%n)//' matrix')
      return
    end do
  end subroutine read_matrix

  !> Check the pointers of a compressed matrix, and cut its entries to those there are.
  subroutine expand(file, path, p, i, n_lines, matrix, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer, intent(in) :: p(:), i(:)
    integer, intent(in) :: n_lines   !! rows or columns that the pointers count
    type(sparse_matrix_t), intent(inout) :: matrix
    type(error_t), allocatable, intent(inout) :: error
    integer :: n
    logical :: sound

    sound = size(p) > n_lines
    if (sound) sound = p(1) == 0 .and. all(p(:n_lines) <= p(2:n_lines + 1))
    n = 0
    if (sound) n = p(n_lines + 1)
    if (sound) sound = n <= min(size(i), size(matrix%value))
    if (sound) sound = all(i(:n) < huge(n))
    if (.not. sound) then
      call blame(error, file, path//": the pointers 'p' do not describe a compressed matrix of "// &
        to_text(matrix%m)//' x '//to_text(matrix%n))
      return
    end if
    matrix%value = matrix%value(:n)
  end subroutine expand

  !> The line of each entry.
  pure function owners(p, n_lines) result(line)
    integer, intent(in) :: p(:), n_lines
    integer :: line(p(n_lines + 1))
    integer :: k

    do k = 1, n_lines
      line(p(k) + 1:p(k + 1)) = k
    end do
  end function owners

  pure logical function inside(index, n)
    integer, intent(in) :: index(:) !! from 0
    integer, intent(in) :: n

    inside = all(index >= 0 .and. index < n)
  end function inside

  !> Read one whole number within bounds.
  subroutine read_count(file, path, least, most, value, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer(i8), intent(in) :: least, most
    integer, intent(out) :: value
    type(error_t), allocatable, intent(inout) :: error
    integer(i8), allocatable :: values(:)

    value = 0
    call check_extents(file, path, error)
    if (allocated(error)) return
    call read_dataset(file, path, values, error)
    call make_wrong_input(file, error)
    if (allocated(error)) return
    if (size(values) /= 1) then
      call blame(error, file, path//' holds '//to_text(size(values))//' numbers instead of one')
    else if (values(1) < least .or. values(1) > most) then
      call blame(error, file, path//' is '//to_text(values(1))//', which is not between '// &
        to_text(least)//' and '//to_text(most))
    else
      value = int(values(1))
    end if
  end subroutine read_count

  subroutine read_indices(file, path, values, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer(i4), allocatable, intent(out) :: values(:)
    type(error_t), allocatable, intent(inout) :: error

    allocate (values(0))
    call check_extents(file, path, error)
    if (allocated(error)) return
    call read_dataset(file, path, values, error)
    call make_wrong_input(file, error)
  end subroutine read_indices

  !> Read real numbers that are finite and of usable size.
  subroutine read_numbers(file, path, values, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    real(wp), allocatable, intent(out) :: values(:)
    type(error_t), allocatable, intent(inout) :: error
    integer :: k

    allocate (values(0))
    call check_extents(file, path, error)
    if (allocated(error)) return
    call read_dataset(file, path, values, error)
    call make_wrong_input(file, error)
    if (allocated(error)) return
    do k = 1, size(values)
      if (is_usable(values(k))) cycle
      call blame(error, file, path//': number '//to_text(k)//' is not finite, or larger than 1e40')
      return
    end do
  end subroutine read_numbers

  !> Refuse a dataset that is missing, or larger than its file can hold.
  subroutine check_extents(file, path, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    type(error_t), allocatable, intent(inout) :: error
    integer(i8), allocatable :: extents(:)
    integer(i8) :: bytes

    if (allocated(error)) return
    if (.not. exists(file, path)) then
      call blame(error, file, path//' is missing')
      return
    end if
    call dataset_extents(file, path, extents, error)
    call make_wrong_input(file, error)
    if (allocated(error)) return
    inquire (file=file%path, size=bytes)
    if (product(real(extents, wp)) > min(real(most_packed, wp)*real(bytes, wp), &
        real(huge(1), wp))) call blame(error, file, path// &
        ' claims more numbers than the file holds')
  end subroutine check_extents

  !> Say whether a number is finite and at most 1e40 in size, so that no product of a few overflows.
  !>
  !> By its bits: a comparison with NaN would be an exception of its own.
  elemental logical function is_usable(x) result(usable)
    real(wp), intent(in) :: x
    integer(i8), parameter :: bias = 1023, largest = 132 ! 2**133 = 1.1e40

    usable = iand(shiftr(transfer(x, 0_i8), 52), 2047_i8) <= bias + largest
  end function is_usable

  !> Raise an error about a file's contents.
  subroutine blame(error, file, what)
    type(error_t), allocatable, intent(inout) :: error
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: what

    if (.not. allocated(error)) call raise(error, exit_wrong_input, file%path//': error: '//what)
  end subroutine blame

  !> What cannot be read is the file's fault: it was opened, and its extents are in order.
  subroutine make_wrong_input(file, error)
    type(hdf5_file_t), intent(in) :: file
    type(error_t), allocatable, intent(inout) :: error

    if (.not. allocated(error)) return
    error%exit_status = exit_wrong_input
    error%message = file%path//': error: '//error%message
  end subroutine make_wrong_input

  ! ------------------------------------------------------------------ writing

  !> Write a matrix by compressed rows, which all readers take alike.
  subroutine write_matrix(file, path, matrix, description, quantity, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    type(sparse_matrix_t), intent(in) :: matrix
    character(*), intent(in) :: description, quantity
    type(error_t), allocatable, intent(inout) :: error
    integer(i4), allocatable :: p(:), i(:)
    real(wp), allocatable :: x(:)
    integer :: position(matrix%m), k, n

    n = size(matrix%value)
    allocate (p(matrix%m + 1), source=0)
    do k = 1, n
      p(matrix%row(k) + 1) = p(matrix%row(k) + 1) + 1
    end do
    do k = 1, matrix%m
      p(k + 1) = p(k) + p(k + 1)
    end do
    position = p(:matrix%m)
    allocate (i(n), x(n))
    do k = 1, n
      associate (next => position(matrix%row(k)))
        next = next + 1
        i(next) = matrix%column(k) - 1
        x(next) = matrix%value(k)
      end associate
    end do
    call create_group(file, path, error)
    call write_dataset(file, path//'/m', [matrix%m], 'rows', 'count', error)
    call write_dataset(file, path//'/n', [matrix%n], 'columns', 'count', error)
    call write_dataset(file, path//'/nzmax', [n], 'entries', 'count', error)
    call write_dataset(file, path//'/nz', [compressed_rows], '-2: compressed rows', 'code', error)
    call write_dataset(file, path//'/p', p, 'first entry of each row, from 0', 'index', error)
    call write_dataset(file, path//'/i', i, 'column of each entry, from 0', 'index', error)
    call write_dataset(file, path//'/x', x, description, quantity, error)
  end subroutine write_matrix

  !> The entries of a dense matrix that are not 0, row by row.
  pure type(sparse_matrix_t) function sparse_of(a) result(matrix)
    real(wp), intent(in) :: a(:, :)
    integer :: row, column, n

    n = count(abs(a) > 0.0_wp)
    matrix%m = size(a, 1)
    matrix%n = size(a, 2)
    allocate (matrix%row(n), matrix%column(n), matrix%value(n))
    n = 0
    do row = 1, matrix%m
      do column = 1, matrix%n
        if (.not. abs(a(row, column)) > 0.0_wp) cycle
        n = n + 1
        matrix%row(n) = row
        matrix%column(n) = column
        matrix%value(n) = a(row, column)
      end do
    end do
  end function sparse_of

  ! ------------------------------------------------------------------ products

  !> A v.
  pure function times(a, v) result(product)
    type(sparse_matrix_t), intent(in) :: a
    real(wp), intent(in) :: v(:)  !! (n)
    real(wp) :: product(a%m)
    integer :: k

    product = 0.0_wp
    do k = 1, size(a%value)
      product(a%row(k)) = product(a%row(k)) + a%value(k)*v(a%column(k))
    end do
  end function times

  !> A^T v.
  pure function transposed_times(a, v) result(product)
    type(sparse_matrix_t), intent(in) :: a
    real(wp), intent(in) :: v(:)  !! (m)
    real(wp) :: product(a%n)

    product = times(sparse_matrix_t(m=a%n, n=a%m, row=a%column, column=a%row, value=a%value), v)
  end function transposed_times

end module fclib_matrix_mod
