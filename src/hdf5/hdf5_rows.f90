!> Datasets that grow by one row at a time, as long as a run goes on.
module hdf5_rows_mod
  use, intrinsic :: iso_c_binding, only: c_ptr, c_loc
  use hdf5, only: hid_t, hsize_t, h5dcreate_f, h5dget_create_plist_f, h5dget_space_f, &
    h5dopen_f, h5dset_extent_f, h5dwrite_f, h5pclose_f, h5pcreate_f, h5pget_chunk_f, &
    h5pset_chunk_f, h5pset_deflate_f, h5pset_fletcher32_f, h5pset_shuffle_f, h5sclose_f, &
    h5screate_simple_f, h5sget_simple_extent_dims_f, h5sget_simple_extent_ndims_f, &
    h5sselect_hyperslab_f, h5sset_extent_simple_f, H5P_DATASET_CREATE_F, H5S_SELECT_SET_F, &
    H5S_UNLIMITED_F
  use checksum_mod, only: checksum_of, extended
  use dataset_kinds_mod, only: of_real, of_integer, of_long, bytes_of
  use errors_mod, only: error_t, raise, exit_machine
  use hdf5_attributes_mod, only: describe
  use hdf5_failures_mod, only: fail
  use hdf5_files_mod, only: hdf5_file_t, exists, fail_to_read, fail_to_write, flush_file, &
    flush_object
  use hdf5_types_mod, only: no_id, type_in_file, type_in_memory, new_space
  use kinds_mod, only: wp, i1, i4, i8
  use text_mod, only: to_text
  implicit none
  private

  public :: rows_t, create_rows, create_list, create_stack, create_dense_stack, keep_rows, &
    cut_rows, append_row, append_list, append_and_flush, add_checksum, checksum_of_row

  !> An open dataset that grows by one row at a time along its last extent.
  type :: rows_t
    private
    integer(hid_t) :: id = no_id
    integer(hid_t) :: in_file = no_id, in_memory = no_id
    !! spaces of all rows and of what is appended, open as long as the dataset: making them each
    !! time takes as long as writing a short row
    integer :: kind = of_real                 !! of its numbers in the file
    integer(hsize_t), allocatable :: fixed(:) !! extents before the one that grows
    integer(hsize_t) :: step = 1              !! how far a row reaches along the one that grows
    integer(hsize_t) :: length = 0            !! how far it has grown
    integer(hsize_t) :: of_chunk = 1          !! how far a chunk reaches
    logical :: is_squeezed = .true.           !! whether its chunks are shuffled and deflated
    character(:), allocatable :: name         !! for messages
  end type rows_t

  !> Add the checksum that a row of one number has which is written at another time.
  interface add_checksum
    module procedure add_checksum_of_real, add_checksum_of_long
  end interface add_checksum

  !> Append a row, and add its checksum to a sum: `append_row(rows, values, checksum, error)`. What
  !> are whole numbers in the file are given as reals.
  interface append_row
    module procedure append_number, append_list_of_numbers, append_columns, append_longs
  end interface append_row

contains

  !> Make a dataset whose rows are arrays of `row` extents: it grows along one more extent.
  !>
  !> Reals are kept as they are, codes are squeezed.
  !>
  !> Of a run that is continued: open the one that is there, with all its rows (`keep_rows`).
  subroutine create_rows(file, path, kind, row, description, quantity, rows, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer, intent(in) :: kind   !! of_real, of_integer, of_long or of_byte
    integer, intent(in) :: row(:) !! extents of a row, none for one number
    character(*), intent(in) :: description, quantity
    type(rows_t), intent(out) :: rows
    type(error_t), allocatable, intent(inout) :: error

    rows%fixed = int(row, hsize_t)
    rows%step = 1
    rows%is_squeezed = kind /= of_real
    call create_growing(file, path, kind, rows, error)
    call describe(file, path, description, quantity, error)
  end subroutine create_rows

  !> Make a dataset of one real a row, of which `n_rows` fit into one chunk: the file does not
  !> become longer with any of them but the first.
  subroutine create_list(file, path, n_rows, description, quantity, rows, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer, intent(in) :: n_rows
    character(*), intent(in) :: description, quantity
    type(rows_t), intent(out) :: rows
    type(error_t), allocatable, intent(inout) :: error

    allocate (rows%fixed(0))
    rows%of_chunk = n_rows
    call create_growing(file, path, of_real, rows, error)
    call describe(file, path, description, quantity, error)
  end subroutine create_list

  !> Make a dataset whose rows are stacked along their own last extent, as VTKHDF wants fields; or
  !> open the one that is there. It is squeezed, as most of its numbers are 0.
  subroutine create_stack(file, path, kind, row, description, quantity, rows, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer, intent(in) :: kind   !! as above
    integer, intent(in) :: row(:) !! extents of a row, one at least
    character(*), intent(in) :: description, quantity
    type(rows_t), intent(out) :: rows
    type(error_t), allocatable, intent(inout) :: error

    call stack_rows(row, rows)
    call create_growing(file, path, kind, rows, error)
    call describe(file, path, description, quantity, error)
  end subroutine create_stack

  !> The same for reals that vary from place to place: three quarters of their digits are noise to a
  !> compressor, which would take most of the time of writing. So they are kept as they are.
  subroutine create_dense_stack(file, path, row, description, quantity, rows, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer, intent(in) :: row(:) !! extents of a row, one at least
    character(*), intent(in) :: description, quantity
    type(rows_t), intent(out) :: rows
    type(error_t), allocatable, intent(inout) :: error

    call stack_rows(row, rows)
    rows%is_squeezed = .false.
    call create_growing(file, path, of_real, rows, error)
    call describe(file, path, description, quantity, error)
  end subroutine create_dense_stack

  !> Rows that are stacked along their last extent.
  pure subroutine stack_rows(row, rows)
    integer, intent(in) :: row(:) !! extents of a row, one at least
    type(rows_t), intent(inout) :: rows

    rows%fixed = int(row(:size(row) - 1), hsize_t)
    rows%step = row(size(row))
  end subroutine stack_rows

  !> One row is one chunk, shuffled and deflated where it is worth it: a chunk that fits into a page
  !> takes longer to deflate than to write. It bears a checksum, Fletcher's, that every reader
  !> checks. Rows of a few bytes share a chunk of 4 KB: it is not filtered, so that it is always
  !> written again in its own place, and what of it was written before survives a kill.
  subroutine create_growing(file, path, kind, rows, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer, intent(in) :: kind
    type(rows_t), intent(inout) :: rows
    type(error_t), allocatable, intent(inout) :: error
    integer, parameter :: small_row = 64, page = 4096 ! bytes
    integer(hid_t) :: space, creation
    integer(hsize_t) :: start(size(rows%fixed) + 1), chunk(size(rows%fixed) + 1)
    integer(hsize_t) :: limit(size(rows%fixed) + 1), row_bytes
    integer :: rank, status, ignored

    if (allocated(error)) return
    rows%name = path
    rows%kind = kind
    if (exists(file, path)) then
      call open_growing(file, path, rows, error)
      return
    end if
    rank = size(start)
    start = [rows%fixed, 0_hsize_t]
    chunk = max(1_hsize_t, [rows%fixed, rows%step])
    ! A chunk may not be larger than a fixed extent, and not be 0: what is empty may grow.
    limit = merge(start, H5S_UNLIMITED_F, start > 0)
    row_bytes = product(chunk)*bytes_of(kind)
    if (row_bytes <= small_row) chunk(rank) = max(chunk(rank)*(page/row_bytes), rows%of_chunk)
    rows%of_chunk = chunk(rank)
    call h5screate_simple_f(rank, start, space, status, limit)
    call h5pcreate_f(H5P_DATASET_CREATE_F, creation, status)
    call h5pset_chunk_f(creation, rank, chunk, status)
    if (row_bytes > page .and. rows%is_squeezed) then
      if (bytes_of(kind) > 1) call h5pset_shuffle_f(creation, status)
      call h5pset_deflate_f(creation, 1, status)
    end if
    if (row_bytes > small_row) call h5pset_fletcher32_f(creation, status)
    call h5dcreate_f(file%id, path, type_in_file(kind), space, rows%id, status, creation)
    if (status < 0) then
      rows%id = no_id
      call fail_to_write(error, file, path)
    end if
    call h5pclose_f(creation, ignored)
    call h5sclose_f(space, ignored)
    call begin_table(rows, error)
  end subroutine create_growing

  !> Make the table of a dataset's chunks now, by a row that is taken back.
  !>
  !> HDF5 makes it with the first row, and says where it is before it writes it: should the program
  !> be killed in between, nobody could write the dataset any more.
  subroutine begin_table(rows, error)
    type(rows_t), intent(inout) :: rows
    type(error_t), allocatable, intent(inout) :: error
    integer(hid_t) :: memory, space
    integer(hsize_t) :: origin(size(rows%fixed) + 1)
    integer :: status, ignored
    integer(i8), target :: zero
    type(c_ptr) :: address

    if (allocated(error) .or. any(rows%fixed < 1)) return
    zero = 0
    address = c_loc(zero)
    origin = 0
    call h5dset_extent_f(rows%id, [rows%fixed, rows%step], status)
    if (status >= 0) then
      memory = new_space([integer(hsize_t) ::])
      call h5dget_space_f(rows%id, space, status)
      call h5sselect_hyperslab_f(space, H5S_SELECT_SET_F, origin, 0*origin + 1, status)
      call h5dwrite_f(rows%id, type_in_memory(rows%kind), address, status, memory, space)
      call h5sclose_f(space, ignored)
      call h5sclose_f(memory, ignored)
    end if
    if (status >= 0) call h5dset_extent_f(rows%id, [rows%fixed, 0_hsize_t], status)
    if (status < 0) call fail(error, "cannot write '"//rows%name//"'")
  end subroutine begin_table

  subroutine open_growing(file, path, rows, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    type(rows_t), intent(inout) :: rows
    type(error_t), allocatable, intent(inout) :: error
    integer(hid_t) :: space
    integer(hsize_t) :: found(size(rows%fixed) + 1), limits(size(rows%fixed) + 1)
    integer(hsize_t) :: chunk(size(rows%fixed) + 1)
    integer(hid_t) :: creation
    integer :: rank, status, ignored

    call h5dopen_f(file%id, path, rows%id, status)
    if (status < 0) then
      rows%id = no_id
      call fail_to_read(error, file, path)
      return
    end if
    call h5dget_space_f(rows%id, space, status)
    call h5sget_simple_extent_ndims_f(space, rank, status)
    found = -1
    if (rank == size(found)) call h5sget_simple_extent_dims_f(space, found, limits, status)
    call h5sclose_f(space, ignored)
    if (any(found(:size(rows%fixed)) /= rows%fixed) .or. found(size(found)) < 0) then
      call raise(error, exit_machine, "'"//path//"' in '"//file%path// &
        "' has other extents than "// &
        'this run gives it')
      return
    end if
    rows%length = found(size(found))
    chunk = 1
    call h5dget_create_plist_f(rows%id, creation, status)
    if (status >= 0) call h5pget_chunk_f(creation, rank, chunk, status) ! the rank, or -1
    if (status < 0) call fail_to_read(error, file, path)
    call h5pclose_f(creation, ignored)
    rows%of_chunk = chunk(rank)
  end subroutine open_growing

  !> Cut what is there to its first `n` rows.
  subroutine keep_rows(rows, n, error)
    type(rows_t), intent(inout) :: rows
    integer, intent(in) :: n
    type(error_t), allocatable, intent(inout) :: error
    integer(hsize_t) :: length

    if (allocated(error)) return
    length = n*rows%step
    if (n < 0 .or. rows%length < length) then
      call raise(error, exit_machine, "'"//rows%name//"' has "//to_text(rows%length/rows%step)// &
        ' rows, not the '//to_text(n)//' that are said to be finished: the file is damaged')
      return
    end if
    if (rows%length == length) return
    call cut_rows(rows, n, error)
  end subroutine keep_rows

  !> Cut what this program has written to its first `n` rows.
  subroutine cut_rows(rows, n, error)
    type(rows_t), intent(inout) :: rows
    integer, intent(in) :: n
    type(error_t), allocatable, intent(inout) :: error
    integer(hsize_t) :: length
    integer :: status

    length = n*rows%step
    if (allocated(error) .or. rows%length <= length) return
    call h5dset_extent_f(rows%id, [rows%fixed, length], status)
    if (status < 0) call fail(error, "cannot cut '"//rows%name//"'")
    rows%length = length
  end subroutine cut_rows

  !> A row of one number.
  subroutine append_number(rows, value, checksum, error)
    type(rows_t), intent(inout) :: rows
    real(wp), intent(in) :: value
    integer(i8), intent(inout) :: checksum
    type(error_t), allocatable, intent(inout) :: error

    call append_numbers(rows, [value], 1, checksum, error)
  end subroutine append_number

  subroutine append_list_of_numbers(rows, values, checksum, error)
    type(rows_t), intent(inout) :: rows
    real(wp), intent(in), contiguous :: values(:)
    integer(i8), intent(inout) :: checksum
    type(error_t), allocatable, intent(inout) :: error

    call append_numbers(rows, values, size(values), checksum, error)
  end subroutine append_list_of_numbers

  subroutine append_columns(rows, values, checksum, error)
    type(rows_t), intent(inout) :: rows
    real(wp), intent(in), contiguous :: values(:, :)
    integer(i8), intent(inout) :: checksum
    type(error_t), allocatable, intent(inout) :: error

    call append_numbers(rows, values, size(values), checksum, error)
  end subroutine append_columns

  !> A row of n numbers, as the kind that the dataset has.
  subroutine append_numbers(rows, values, n, checksum, error)
    type(rows_t), intent(inout) :: rows
    integer, intent(in) :: n
    real(wp), intent(in), target :: values(n)
    integer(i8), intent(inout) :: checksum
    type(error_t), allocatable, intent(inout) :: error
    integer(i4), allocatable, target :: integers(:)
    integer(i8), allocatable, target :: longs(:)
    integer(i1), allocatable, target :: bytes(:)

    select case (rows%kind)
    case (of_real)
      call append(rows, c_loc(values), n, error, checksum=checksum)
    case (of_integer)
      integers = int(values, i4)
      call append(rows, c_loc(integers), n, error, checksum=checksum)
    case (of_long)
      longs = int(values, i8)
      call append(rows, c_loc(longs), n, error, checksum=checksum)
    case default
      bytes = int(values, i1)
      call append(rows, c_loc(bytes), n, error, checksum=checksum)
    end select
  end subroutine append_numbers

  !> A row of whole numbers that no real number need hold.
  subroutine append_longs(rows, values, checksum, error)
    type(rows_t), intent(inout) :: rows !! of_long
    integer(i8), intent(in), contiguous, target :: values(:)
    integer(i8), intent(inout) :: checksum
    type(error_t), allocatable, intent(inout) :: error

    call append(rows, c_loc(values), size(values), error, checksum=checksum)
  end subroutine append_longs

  !> Append numbers, one a row, and hand them to the operating system; where it can be, them alone.
  subroutine append_and_flush(file, rows, values, error)
    type(hdf5_file_t), intent(in) :: file
    type(rows_t), intent(inout) :: rows
    real(wp), intent(in), contiguous, target :: values(:)
    type(error_t), allocatable, intent(inout) :: error
    integer(hsize_t) :: left !! of the chunk that was begun

    left = modulo(-rows%length, rows%of_chunk)
    call append(rows, c_loc(values), size(values), error, size(values))
    if (size(values) > left) then
      ! A new chunk makes the file longer, which only a flush of the whole tells.
      call flush_file(file, error)
    else
      call flush_object(file, rows%name, rows%id, error)
    end if
  end subroutine append_and_flush

  !> Append many rows of one number.
  subroutine append_list(rows, values, error)
    type(rows_t), intent(inout) :: rows
    integer(i8), intent(in), contiguous, target :: values(:)
    type(error_t), allocatable, intent(inout) :: error

    call append(rows, c_loc(values), size(values), error, size(values))
  end subroutine append_list

  subroutine append(rows, address, n, error, n_rows, checksum)
    type(rows_t), intent(inout) :: rows
    type(c_ptr), intent(in) :: address
    integer, intent(in) :: n !! numbers at the address
    type(error_t), allocatable, intent(inout) :: error
    integer, intent(in), optional :: n_rows !! that they are; 1 if absent
    integer(i8), intent(inout), optional :: checksum !! to which theirs is added
    integer(hsize_t) :: start(size(rows%fixed) + 1), count(size(rows%fixed) + 1), longer
    integer :: status

    if (allocated(error)) return
    longer = rows%step
    if (present(n_rows)) longer = n_rows*rows%step
    count = [rows%fixed, longer]
    start = 0
    start(size(start)) = rows%length
    if (product(count) /= n) then
      call raise(error, exit_machine, "internal error: rows of '"//rows%name//"' have "// &
                 to_text(product(count))//' numbers, not '//to_text(n))
      return
    end if
    call h5dset_extent_f(rows%id, [rows%fixed, rows%length + longer], status)
    if (status >= 0 .and. n > 0) then
      if (rows%in_file == no_id) then
        rows%in_memory = new_space(count)
        rows%in_file = new_space([rows%fixed, rows%length + longer])
      else
        call h5sset_extent_simple_f(rows%in_memory, size(count), count, count, status)
        call h5sset_extent_simple_f(rows%in_file, size(count), start + count, start + count, &
          status)
      end if
      call h5sselect_hyperslab_f(rows%in_file, H5S_SELECT_SET_F, start, count, status)
      call h5dwrite_f(rows%id, type_in_memory(rows%kind), address, status, rows%in_memory, &
        rows%in_file)
    end if
    if (status < 0) call fail(error, "cannot write '"//rows%name//"'")
    rows%length = rows%length + longer
    if (present(checksum)) checksum = checksum + checksum_of_row(rows%name, address, &
      int(n, i8)*bytes_of(rows%kind))
  end subroutine append

  ! ------------------------------------------------------------------ checksums

  !> The checksum of a row: of the dataset's path and the bytes of the numbers.
  integer(i8) function checksum_of_row(path, address, bytes) result(checksum)
    character(*), intent(in) :: path
    type(c_ptr), intent(in) :: address
    integer(i8), intent(in) :: bytes

    checksum = extended(checksum_of(path), address, bytes)
  end function checksum_of_row

  subroutine add_checksum_of_real(rows, value, checksum)
    type(rows_t), intent(in) :: rows
    real(wp), intent(in), target :: value
    integer(i8), intent(inout) :: checksum

    checksum = checksum + checksum_of_row(rows%name, c_loc(value), int(bytes_of(of_real), i8))
  end subroutine add_checksum_of_real

  subroutine add_checksum_of_long(rows, value, checksum)
    type(rows_t), intent(in) :: rows
    integer(i8), intent(in), target :: value
    integer(i8), intent(inout) :: checksum

    checksum = checksum + checksum_of_row(rows%name, c_loc(value), int(bytes_of(of_long), i8))
  end subroutine add_checksum_of_long

end module hdf5_rows_mod
