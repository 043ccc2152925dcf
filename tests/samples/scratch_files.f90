!> Files that the tests of this folder make and remove.
module scratch_files
  implicit none
  private

  public :: remove, is_there

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

end module scratch_files
