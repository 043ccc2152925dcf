!> Datasets of fixed extents, each with its description, and reading datasets.
module hdf5_datasets_mod
  use, intrinsic :: iso_c_binding, only: c_ptr, c_loc, c_char, c_null_ptr
  use hdf5, only: hid_t, hsize_t, size_t, h5dclose_f, h5dcreate_f, h5dget_space_f, &
    h5dget_type_f, h5dopen_f, h5dread_f, h5dwrite_f, h5pclose_f, h5pcreate_f, h5pset_chunk_f, &
    h5pset_deflate_f, h5pset_fletcher32_f, h5pset_shuffle_f, h5sclose_f, &
    h5sget_simple_extent_dims_f, h5sget_simple_extent_ndims_f, h5sselect_hyperslab_f, &
    h5tclose_f, h5tget_size_f, h5tis_variable_str_f, H5P_DATASET_CREATE_F, H5S_SELECT_SET_F
  use dataset_kinds_mod, only: of_real, of_integer, of_long, of_unsigned_byte, bytes_of
  use errors_mod, only: error_t
  use hdf5_attributes_mod, only: describe
  use hdf5_failures_mod, only: text_of
  use hdf5_files_mod, only: hdf5_file_t, fail_to_write, fail_to_read, fail_to_hold
  use hdf5_types_mod, only: no_id, type_in_file, kind_of_type, type_in_memory, text_type, is_text, &
    new_space
  use kinds_mod, only: wp, i1, i4, i8
  use resource_limits_mod, only: has_memory
  implicit none
  private

  public :: write_dataset, write_squeezed, rewrite_dataset, write_text
  public :: dataset_extents, dataset_kind, read_dataset, read_row, read_text

  !> Write a dataset of fixed extents:
  !> `write_dataset(file, path, values, description, quantity, error)`.
  interface write_dataset
    module procedure write_reals_1, write_reals_2, write_reals_3, write_integers, &
      write_longs, write_bytes
  end interface write_dataset

  !> Read a whole dataset, flat, first index fastest: `read_dataset(file, path, values, error)`.
  interface read_dataset
    module procedure read_reals, read_integers, read_longs
  end interface read_dataset

contains

  subroutine write_reals_1(file, path, values, description, quantity, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    real(wp), intent(in), contiguous, target :: values(:)
    character(*), intent(in) :: description, quantity
    type(error_t), allocatable, intent(inout) :: error
    type(c_ptr) :: address

    ! No values may be nowhere.
    address = c_null_ptr
    if (size(values) > 0) address = c_loc(values)
    call create_fixed(file, path, of_real, [size(values)], address, error)
    call describe(file, path, description, quantity, error)
  end subroutine write_reals_1

  subroutine write_reals_2(file, path, values, description, quantity, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    real(wp), intent(in), contiguous, target :: values(:, :)
    character(*), intent(in) :: description, quantity
    type(error_t), allocatable, intent(inout) :: error

    call create_fixed(file, path, of_real, shape(values), c_loc(values), error)
    call describe(file, path, description, quantity, error)
  end subroutine write_reals_2

  subroutine write_reals_3(file, path, values, description, quantity, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    real(wp), intent(in), contiguous, target :: values(:, :, :)
    character(*), intent(in) :: description, quantity
    type(error_t), allocatable, intent(inout) :: error
    type(c_ptr) :: address

    address = c_null_ptr
    if (size(values) > 0) address = c_loc(values)
    call create_fixed(file, path, of_real, shape(values), address, error)
    call describe(file, path, description, quantity, error)
  end subroutine write_reals_3

  subroutine write_integers(file, path, values, description, quantity, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer(i4), intent(in), contiguous, target :: values(:)
    character(*), intent(in) :: description, quantity
    type(error_t), allocatable, intent(inout) :: error

    call create_fixed(file, path, of_integer, shape(values), c_loc(values), error)
    call describe(file, path, description, quantity, error)
  end subroutine write_integers

  !> Write integers shuffled and deflated, where they take more than a page, with a checksum that
  !> every reader checks.
  subroutine write_squeezed(file, path, values, extents, description, quantity, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer(i4), intent(in), contiguous, target :: values(:) !! flat, first index fastest
    integer, intent(in) :: extents(:)
    character(*), intent(in) :: description, quantity
    type(error_t), allocatable, intent(inout) :: error
    integer, parameter :: page = 4096 !! [byte]

    call create_fixed(file, path, of_integer, extents, c_loc(values), error, &
      bytes_of(of_integer)*size(values, kind=i8) > page)
    call describe(file, path, description, quantity, error)
  end subroutine write_squeezed

  subroutine write_longs(file, path, values, description, quantity, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer(i8), intent(in), contiguous, target :: values(:)
    character(*), intent(in) :: description, quantity
    type(error_t), allocatable, intent(inout) :: error

    call create_fixed(file, path, of_long, shape(values), c_loc(values), error)
    call describe(file, path, description, quantity, error)
  end subroutine write_longs

  !> Give a dataset other numbers, as many as it has.
  subroutine rewrite_dataset(file, path, values, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    real(wp), intent(in), contiguous, target :: values(:)
    type(error_t), allocatable, intent(inout) :: error
    integer(hid_t) :: dataset
    integer(i8), allocatable :: extents(:)
    integer :: status

    call open_dataset(file, path, dataset, extents, error)
    if (allocated(error)) return
    status = -1
    if (product(extents) == size(values)) then
      call h5dwrite_f(dataset, type_in_memory(of_real), c_loc(values), status)
    end if
    if (status < 0) call fail_to_write(error, file, path)
    call close_dataset(dataset)
  end subroutine rewrite_dataset

  !> Bytes are unsigned in the file: VTK wants its cell types so.
  subroutine write_bytes(file, path, values, description, quantity, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer(i1), intent(in), contiguous, target :: values(:) !! 0 to 127
    character(*), intent(in) :: description, quantity
    type(error_t), allocatable, intent(inout) :: error

    call create_fixed(file, path, of_unsigned_byte, shape(values), c_loc(values), error)
    call describe(file, path, description, quantity, error)
  end subroutine write_bytes

  !> A whole text as one value, UTF-8.
  subroutine write_text(file, path, text, description, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    character(*), intent(in) :: text
    character(*), intent(in) :: description
    type(error_t), allocatable, intent(inout) :: error
    character(c_char), allocatable, target :: bytes(:)
    integer(hid_t) :: type_id
    integer :: i, ignored

    if (allocated(error)) return
    allocate (bytes(max(1, len(text))), source=achar(0))
    do i = 1, len(text)
      bytes(i) = text(i:i)
    end do
    type_id = text_type(size(bytes), ascii=.false.)
    call put_dataset(file, path, [type_id, type_id], [integer ::], c_loc(bytes), error)
    call h5tclose_f(type_id, ignored)
    call describe(file, path, description, 'text', error)
  end subroutine write_text

  subroutine create_fixed(file, path, kind, extents, address, error, squeezed)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer, intent(in) :: kind
    integer, intent(in) :: extents(:)
    type(c_ptr), intent(in) :: address
    type(error_t), allocatable, intent(inout) :: error
    logical, intent(in), optional :: squeezed !! left out: as it is

    if (allocated(error)) return
    call put_dataset(file, path, [type_in_file(kind), type_in_memory(kind)], extents, address, &
                     error, squeezed)
  end subroutine create_fixed

  subroutine put_dataset(file, path, types, extents, address, error, squeezed)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer(hid_t), intent(in) :: types(2) !! in the file, in memory
    integer, intent(in) :: extents(:)      !! none: a scalar
    type(c_ptr), intent(in) :: address
    type(error_t), allocatable, intent(inout) :: error
    logical, intent(in), optional :: squeezed !! in one chunk, of numbers of several bytes
    integer(hid_t) :: space, dataset, creation
    integer :: status, ignored

    space = new_space(int(extents, hsize_t))
    call h5pcreate_f(H5P_DATASET_CREATE_F, creation, status)
    if (present(squeezed)) then
      if (squeezed) then
        call h5pset_chunk_f(creation, size(extents), int(extents, hsize_t), status)
        call h5pset_shuffle_f(creation, status)
        call h5pset_deflate_f(creation, 1, status)
        call h5pset_fletcher32_f(creation, status)
      end if
    end if
    call h5dcreate_f(file%id, path, types(1), space, dataset, status, creation)
    if (status >= 0) then
      if (all(extents > 0)) call h5dwrite_f(dataset, types(2), address, status)
      if (status < 0) call fail_to_write(error, file, path)
      call h5dclose_f(dataset, ignored)
    else
      call fail_to_write(error, file, path)
    end if
    call h5pclose_f(creation, ignored)
    call h5sclose_f(space, ignored)
  end subroutine put_dataset


  ! ------------------------------------------------------------------ reading

  !> The extents of a dataset, Fortran's way round; none for a scalar.
  subroutine dataset_extents(file, path, extents, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer(i8), allocatable, intent(out) :: extents(:)
    type(error_t), allocatable, intent(inout) :: error
    integer(hid_t) :: dataset

    call open_dataset(file, path, dataset, extents, error)
    call close_dataset(dataset)
  end subroutine dataset_extents

  !> What the numbers of a dataset are: of_real, ...; 0 for anything else.
  function dataset_kind(file, path) result(kind)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer :: kind, status, ignored
    integer(hid_t) :: dataset, type_id

    call h5dopen_f(file%id, path, dataset, status)
    if (status >= 0) then
      call h5dget_type_f(dataset, type_id, status)
      kind = kind_of_type(type_id)
      call h5tclose_f(type_id, ignored)
      call h5dclose_f(dataset, ignored)
    else
      kind = 0
    end if
  end function dataset_kind

  !> Read a row of a dataset that grows, as real numbers, flat, first index fastest; of one with
  !> fewer rows the last.
  subroutine read_row(file, path, row, values, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer, intent(in) :: row !! from 1
    real(wp), allocatable, intent(out), target :: values(:)
    type(error_t), allocatable, intent(inout) :: error !! no such dataset, or no row in it
    integer(hid_t) :: dataset, space, memory
    integer(i8), allocatable :: extents(:)
    integer(hsize_t), allocatable :: start(:), count(:)
    type(c_ptr) :: address
    integer :: status, ignored

    call open_dataset(file, path, dataset, extents, error)
    count = extents
    allocate (start(size(count)), source=0_hsize_t)
    associate (n => size(extents))
      if (.not. allocated(error)) then
        start(n) = min(int(row, i8), extents(n)) - 1
        count(n) = 1
        if (start(n) < 0) call fail_to_read(error, file, path)
        if (.not. has_memory(bytes_for(count, of_real))) call fail_to_hold(error, file, path)
      end if
    end associate
    if (allocated(error)) count = 0
    allocate (values(product(count)))
    if (size(values) > 0) then
      address = c_loc(values)
      call h5dget_space_f(dataset, space, status)
      memory = new_space(count)
      call h5sselect_hyperslab_f(space, H5S_SELECT_SET_F, start, count, status)
      if (status >= 0) call h5dread_f(dataset, type_in_memory(of_real), address, status, memory, &
        space)
      if (status < 0) call fail_to_read(error, file, path)
      call h5sclose_f(memory, ignored)
      call h5sclose_f(space, ignored)
    end if
    call close_dataset(dataset)
  end subroutine read_row

  subroutine read_reals(file, path, values, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    real(wp), allocatable, intent(out), target :: values(:)
    type(error_t), allocatable, intent(inout) :: error
    integer(hid_t) :: dataset
    integer(i8) :: n

    call open_to_read(file, path, of_real, dataset, n, error)
    allocate (values(n))
    call get_values(file, path, dataset, of_real, c_loc(values), error)
  end subroutine read_reals

  subroutine read_integers(file, path, values, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer(i4), allocatable, intent(out), target :: values(:)
    type(error_t), allocatable, intent(inout) :: error
    integer(hid_t) :: dataset
    integer(i8) :: n

    call open_to_read(file, path, of_integer, dataset, n, error)
    allocate (values(n))
    call get_values(file, path, dataset, of_integer, c_loc(values), error)
  end subroutine read_integers

  subroutine read_longs(file, path, values, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer(i8), allocatable, intent(out), target :: values(:)
    type(error_t), allocatable, intent(inout) :: error
    integer(hid_t) :: dataset
    integer(i8) :: n

    call open_to_read(file, path, of_long, dataset, n, error)
    allocate (values(n))
    call get_values(file, path, dataset, of_long, c_loc(values), error)
  end subroutine read_longs

  !> Open a dataset whose numbers memory can hold.
  subroutine open_to_read(file, path, kind, dataset, n, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer, intent(in) :: kind
    integer(hid_t), intent(out) :: dataset
    integer(i8), intent(out) :: n !! of numbers; 0 after an error
    type(error_t), allocatable, intent(inout) :: error
    integer(i8), allocatable :: extents(:)

    call open_dataset(file, path, dataset, extents, error)
    n = 0
    if (has_memory(bytes_for(extents, kind))) then
      n = product(extents)
    else
      call fail_to_hold(error, file, path)
    end if
  end subroutine open_to_read

  !> What so many numbers take; more than there can be where they cannot be counted.
  pure integer(i8) function bytes_for(extents, kind) result(bytes)
    integer(i8), intent(in) :: extents(:)
    integer, intent(in) :: kind

    bytes = huge(bytes)
    if (product(real(extents, wp)) < 1.0e15_wp) bytes = bytes_of(kind)*product(extents)
  end function bytes_for

  !> Read a text written by `write_text`.
  subroutine read_text(file, path, text, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    character(:), allocatable, intent(out) :: text
    type(error_t), allocatable, intent(inout) :: error
    character(c_char), allocatable, target :: bytes(:)
    integer(hid_t) :: dataset, type_id
    integer(i8), allocatable :: extents(:)
    integer(size_t) :: length
    integer :: status, ignored
    logical :: variable
    type(c_ptr) :: address

    text = ''
    call open_dataset(file, path, dataset, extents, error)
    if (allocated(error)) return
    call h5dget_type_f(dataset, type_id, status)
    call h5tis_variable_str_f(type_id, variable, status)
    if (is_text(type_id) .and. .not. variable .and. product(extents) == 1) then
      call h5tget_size_f(type_id, length, status)
      if (status >= 0) status = merge(0, -1, has_memory(int(length, i8)))
      if (status == 0) allocate (bytes(length))
      if (status == 0) address = c_loc(bytes)
      if (status == 0) call h5dread_f(dataset, type_id, address, status)
      if (status == 0) text = text_of(bytes)
    else
      status = -1
    end if
    if (status /= 0) call fail_to_read(error, file, path)
    call h5tclose_f(type_id, ignored)
    call close_dataset(dataset)
  end subroutine read_text

  !> Open a dataset; what it holds is `extents` values a direction, none after an error.
  subroutine open_dataset(file, path, dataset, extents, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer(hid_t), intent(out) :: dataset
    integer(i8), allocatable, intent(out) :: extents(:)
    type(error_t), allocatable, intent(inout) :: error
    integer(hid_t) :: space
    integer(hsize_t), allocatable :: limits(:), found(:)
    integer :: rank, status, ignored

    dataset = no_id
    extents = [0_i8]
    if (allocated(error)) return
    call h5dopen_f(file%id, path, dataset, status)
    if (status < 0) then
      dataset = no_id
      call fail_to_read(error, file, path)
      return
    end if
    call h5dget_space_f(dataset, space, status)
    call h5sget_simple_extent_ndims_f(space, rank, status)
    allocate (found(rank), limits(rank))
    if (rank > 0) call h5sget_simple_extent_dims_f(space, found, limits, status)
    call h5sclose_f(space, ignored)
    extents = found
  end subroutine open_dataset

  subroutine get_values(file, path, dataset, kind, address, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer(hid_t), intent(in) :: dataset
    integer, intent(in) :: kind
    type(c_ptr), intent(in) :: address
    type(error_t), allocatable, intent(inout) :: error
    integer :: status
    type(c_ptr) :: buffer

    buffer = address
    if (.not. allocated(error)) then
      call h5dread_f(dataset, type_in_memory(kind), buffer, status)
      if (status < 0) call fail_to_read(error, file, path)
    end if
    call close_dataset(dataset)
  end subroutine get_values

  subroutine close_dataset(dataset)
    integer(hid_t), intent(in) :: dataset
    integer :: ignored

    if (dataset /= no_id) call h5dclose_f(dataset, ignored)
  end subroutine close_dataset

end module hdf5_datasets_mod
