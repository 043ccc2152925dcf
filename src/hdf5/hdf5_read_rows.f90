!> Reading the rows of datasets that grow: to check what was written, and to copy it.
module hdf5_read_rows_mod
  use, intrinsic :: iso_c_binding, only: c_ptr, c_loc
  use hdf5, only: hid_t, hsize_t, h5dclose_f, h5dget_space_f, h5dopen_f, h5dread_f, &
    h5dset_extent_f, h5dwrite_f, h5sclose_f, h5sget_simple_extent_dims_f, &
    h5sget_simple_extent_ndims_f, h5sselect_hyperslab_f, H5S_SELECT_SET_F, H5S_UNLIMITED_F
  use dataset_kinds_mod, only: bytes_of
  use errors_mod, only: error_t, raise, exit_wrong_input
  use hdf5_datasets_mod, only: dataset_kind
  use hdf5_files_mod, only: hdf5_file_t, fail_to_read, fail_to_write, fail_to_hold
  use hdf5_rows_mod, only: checksum_of_row
  use hdf5_types_mod, only: no_id, type_in_memory, new_space
  use kinds_mod, only: i1, i8
  use resource_limits_mod, only: has_memory
  use text_mod, only: to_text
  implicit none
  private

  public :: read_through, is_growing

  integer, parameter :: longest_rank = 32 !! of HDF5

contains

  !> Whether a path is that of a dataset that grows.
  logical function is_growing(file, path) result(growing)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer(hsize_t) :: extents(longest_rank), limits(longest_rank)
    integer(hid_t) :: dataset, space
    integer :: rank, status, ignored

    growing = .false.
    if (dataset_kind(file, path) == 0) return
    call h5dopen_f(file%id, path, dataset, status)
    if (status < 0) return
    call h5dget_space_f(dataset, space, status)
    call h5sget_simple_extent_ndims_f(space, rank, status)
    if (status >= 0 .and. rank > 0) then
      call h5sget_simple_extent_dims_f(space, extents(:rank), limits(:rank), status)
      growing = status >= 0 .and. limits(rank) == H5S_UNLIMITED_F
    end if
    call h5sclose_f(space, ignored)
    call h5dclose_f(dataset, ignored)
  end function is_growing

  !> Read the first `n` rows of a dataset, as many as there are, and add the checksum of row i to
  !> sums(i); of a row that cannot be read nothing is added. With `copy`, write them there, too.
  subroutine read_through(file, path, step, n, sums, error, copy)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer(i8), intent(in) :: step       !! how far a row reaches along the extent that grows
    integer, intent(in) :: n
    integer(i8), intent(inout) :: sums(:) !! (n) or more
    type(error_t), allocatable, intent(inout) :: error
    !! no such dataset, no room for a row; the copy cannot be written
    type(hdf5_file_t), intent(in), optional :: copy
    !! a file in which the dataset is there, and has no rows
    integer(i8), parameter :: at_once = 1000000_i8 !! bytes
    integer(i8), parameter :: most_beyond = 1000   !! rows that do not count
    integer(i1), allocatable, target :: bytes(:)
    integer(hsize_t), allocatable :: extents(:), limits(:)
    integer(hid_t) :: dataset, space, other
    integer(i8) :: of_row
    integer :: rank, kind, status, ignored, first, last, i, n_there, n_at_once

    if (allocated(error)) return
    other = no_id
    call h5dopen_f(file%id, path, dataset, status)
    if (status < 0) then
      call fail_to_read(error, file, path)
      return
    end if
    kind = dataset_kind(file, path)
    call h5dget_space_f(dataset, space, status)
    call h5sget_simple_extent_ndims_f(space, rank, status)
    allocate (extents(max(rank, 1)), limits(max(rank, 1)), source=0_hsize_t)
    if (rank > 0) call h5sget_simple_extent_dims_f(space, extents, limits, status)
    n_there = int(min(int(n, i8), extents(size(extents))/max(1_i8, step)))
    if (extents(size(extents))/max(1_i8, step) > n + most_beyond) call raise(error, &
      exit_wrong_input, "'"//file%path//"' is damaged: '"//path//"' reaches to "// &
      to_text(extents(size(extents))))
    extents(size(extents)) = step
    of_row = 0
    if (status >= 0 .and. kind > 0) of_row = bytes_of(kind)*product(extents)
    n_at_once = int(max(1_i8, at_once/max(1_i8, of_row)))
    if (.not. allocated(error)) then
      if (.not. has_memory(n_at_once*of_row)) call fail_to_hold(error, file, path)
    end if
    if (.not. allocated(error) .and. n_there > 0 .and. kind > 0) then
      allocate (bytes(max(1_i8, n_at_once*of_row)))
      if (present(copy)) call open_copy()
      do first = 1, n_there, n_at_once
        if (allocated(error)) exit
        last = min(n_there, first + n_at_once - 1)
        call transfer_bytes(dataset, space, first, last, .false., status)
        if (status >= 0) then
          call take_rows(first, last)
        else ! one at a time, to find those that cannot be read
          do i = first, last
            call transfer_bytes(dataset, space, i, i, .false., status)
            if (status >= 0) call take_rows(i, i)
          end do
        end if
      end do
    end if
    if (other /= no_id) call h5dclose_f(other, ignored)
    call h5sclose_f(space, ignored)
    call h5dclose_f(dataset, ignored)

  contains

    subroutine open_copy()
      integer(hsize_t) :: longer(size(extents))

      longer = extents
      longer(size(longer)) = n_there*step
      call h5dopen_f(copy%id, path, other, status)
      if (status < 0) other = no_id
      if (status >= 0) call h5dset_extent_f(other, longer, status)
      if (status < 0) call fail_to_write(error, copy, path)
    end subroutine open_copy

    !> Rows a to b of a dataset, read or written.
    subroutine transfer_bytes(id, all_of_it, a, b, writes, status)
      integer(hid_t), intent(in) :: id, all_of_it !! the dataset, its space
      integer, intent(in) :: a, b
      logical, intent(in) :: writes
      integer, intent(out) :: status
      integer(hsize_t) :: start(size(extents)), count(size(extents))
      integer(hid_t) :: memory
      type(c_ptr) :: address

      status = 0
      if (of_row == 0) return
      start = 0
      start(size(start)) = (a - 1)*step
      count = extents
      count(size(count)) = (b - a + 1)*step
      memory = new_space(count)
      address = c_loc(bytes)
      call h5sselect_hyperslab_f(all_of_it, H5S_SELECT_SET_F, start, count, status)
      if (status >= 0 .and. writes) then
        call h5dwrite_f(id, type_in_memory(kind), address, status, memory, all_of_it)
      else if (status >= 0) then
        call h5dread_f(id, type_in_memory(kind), address, status, memory, all_of_it)
      end if
      call h5sclose_f(memory, ignored)
    end subroutine transfer_bytes

    subroutine take_rows(a, b)
      integer, intent(in) :: a, b
      integer(hid_t) :: there
      integer :: i

      do i = a, b
        sums(i) = sums(i) + checksum_of_row(path, c_loc(bytes(1 + (i - a)*of_row)), of_row)
      end do
      if (other == no_id .or. allocated(error)) return
      call h5dget_space_f(other, there, status)
      if (status >= 0) then
        call transfer_bytes(other, there, a, b, .true., status)
        call h5sclose_f(there, ignored)
      end if
      if (status < 0) call fail_to_write(error, copy, path)
    end subroutine take_rows

  end subroutine read_through

end module hdf5_read_rows_mod
