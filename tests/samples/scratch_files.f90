!> Files that the tests make, spoil and remove.
module scratch_files
  use hdf5, only: hid_t, h5fclose_f, h5fopen_f, h5ldelete_f, h5open_f, H5F_ACC_RDWR_F
  implicit none
  private

  public :: remove, is_there, delete_in_hdf5

contains

  !> Remove a file if it is there.
  subroutine remove(name)
    character(*), intent(in) :: name
    integer :: unit, status

    open (newunit=unit, file=name, status='old', action='readwrite', iostat=status)
    if (status == 0) close (unit, status='delete')
  end subroutine remove

  function is_there(name) result(there)
    character(*), intent(in) :: name
    logical :: there

    inquire (file=name, exist=there)
  end function is_there

  !> Delete a group or a dataset of a closed HDF5 file; `worked` is false where that failed.
  subroutine delete_in_hdf5(name, path, worked)
    character(*), intent(in) :: name, path !! the file; the object in it
    logical, intent(out) :: worked
    integer(hid_t) :: file
    integer :: status, closed

    call h5open_f(status)
    call h5fopen_f(name, H5F_ACC_RDWR_F, file, status)
    worked = status == 0
    if (.not. worked) return
    call h5ldelete_f(file, path, status)
    call h5fclose_f(file, closed)
    worked = status == 0 .and. closed == 0
  end subroutine delete_in_hdf5

end module scratch_files
