!> A file that is written beside its place, and takes it when it is complete.
!>
!> So a program that fails or is killed leaves what stood there alone.
module fresh_file_mod
  use, intrinsic :: iso_c_binding, only: c_char, c_int, c_null_char
  use errors_mod, only: error_t, raise, exit_machine
  implicit none
  private

  public :: beginning_of, take_place, delete_file

  interface
    function c_rename(old, new) result(status) bind(c, name='rename')
      import :: c_char, c_int
      implicit none
      character(c_char), intent(in) :: old(*), new(*)
      integer(c_int) :: status
    end function c_rename
  end interface

contains

  !> Where a file for `path` stands until it is complete.
  pure function beginning_of(path) result(beginning)
    character(*), intent(in) :: path
    character(:), allocatable :: beginning

    beginning = path//'.new'
  end function beginning_of

  !> Move the file to its place, which may be that of an older one.
  subroutine take_place(path, error)
    character(*), intent(in) :: path
    type(error_t), allocatable, intent(out) :: error !! the folder does not let it

    if (c_rename(beginning_of(path)//c_null_char, path//c_null_char) /= 0) then
      call raise(error, exit_machine, "cannot rename '"//beginning_of(path)//"' to '"//path//"'")
    end if
  end subroutine take_place

  !> Delete a file if it is there. That it cannot be deleted shows when its name is used again.
  subroutine delete_file(path)
    character(*), intent(in) :: path
    integer :: unit, status

    open (newunit=unit, file=path, status='old', action='readwrite', iostat=status)
    if (status /= 0) return
    close (unit, status='delete', iostat=status)
    if (status /= 0) close (unit)
  end subroutine delete_file

end module fresh_file_mod
