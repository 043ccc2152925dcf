!> Datasets that are written again and again in their own place.
module hdf5_store_mod
  use, intrinsic :: iso_c_binding, only: c_loc
  use hdf5, only: hid_t, hsize_t, h5dclose_f, h5dcreate_f, h5dget_space_f, h5dopen_f, &
    h5dset_extent_f, h5dwrite_f, h5pclose_f, h5pcreate_f, h5pset_chunk_f, h5sclose_f, &
    h5screate_simple_f, h5sget_simple_extent_dims_f, h5sselect_hyperslab_f, &
    H5P_DATASET_CREATE_F, H5S_SELECT_SET_F, H5S_UNLIMITED_F
  use dataset_kinds_mod, only: of_real
  use errors_mod, only: error_t
  use hdf5_attributes_mod, only: describe
  use hdf5_files_mod, only: hdf5_file_t, fail_to_write
  use hdf5_types_mod, only: no_id, type_in_file, type_in_memory, new_space
  use kinds_mod, only: wp
  implicit none
  private

  public :: create_store, write_store

contains

  !> Make a list of numbers that may grow and is never compressed, so that it keeps its place.
  subroutine create_store(file, path, room, description, quantity, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer, intent(in) :: room !! numbers that it will hold, about; more is no error
    character(*), intent(in) :: description, quantity
    type(error_t), allocatable, intent(inout) :: error
    integer, parameter :: smallest_chunk = 512, chunks = 4 ! too large to be kept in memory
    integer(hid_t) :: space, creation, dataset
    integer :: status, ignored

    if (allocated(error)) return
    call h5screate_simple_f(1, [0_hsize_t], space, status, [H5S_UNLIMITED_F])
    call h5pcreate_f(H5P_DATASET_CREATE_F, creation, status)
    call h5pset_chunk_f(creation, 1, [int(max(smallest_chunk, room/chunks), hsize_t)], status)
    call h5dcreate_f(file%id, path, type_in_file(of_real), space, dataset, status, creation)
    if (status < 0) then
      call fail_to_write(error, file, path)
    else
      call h5dclose_f(dataset, ignored)
    end if
    call h5pclose_f(creation, ignored)
    call h5sclose_f(space, ignored)
    call describe(file, path, description, quantity, error)
  end subroutine create_store

  !> Write the first numbers of the list. It never becomes shorter: giving room back would move what
  !> is written next.
  subroutine write_store(file, path, values, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    real(wp), intent(in), contiguous, target :: values(:)
    type(error_t), allocatable, intent(inout) :: error
    integer(hid_t) :: dataset, memory, space
    integer(hsize_t) :: n(1), limits(1)
    integer :: status, ignored

    if (allocated(error)) return
    dataset = no_id
    memory = new_space([size(values, kind=hsize_t)])
    call h5dopen_f(file%id, path, dataset, status)
    if (status >= 0) then
      call h5dget_space_f(dataset, space, status)
      call h5sget_simple_extent_dims_f(space, n, limits, status)
      call h5sclose_f(space, ignored)
      if (status >= 0) call h5dset_extent_f(dataset, max(n, size(values, kind=hsize_t)), status)
      if (status >= 0) call h5dget_space_f(dataset, space, status)
      if (status >= 0) then
        call h5sselect_hyperslab_f(space, H5S_SELECT_SET_F, [0_hsize_t], &
                                   [size(values, kind=hsize_t)], status)
        call h5dwrite_f(dataset, type_in_memory(of_real), c_loc(values), status, memory, space)
      end if
      if (status < 0) call fail_to_write(error, file, path)
      call h5sclose_f(space, ignored)
      call h5dclose_f(dataset, ignored)
    else
      call fail_to_write(error, file, path)
    end if
    call h5sclose_f(memory, ignored)
  end subroutine write_store

end module hdf5_store_mod
