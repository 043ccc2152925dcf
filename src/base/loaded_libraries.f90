!> Which shared libraries the process runs with.
module loaded_libraries_mod
  implicit none
  private

  public :: loaded_libraries

contains

  !> The files of the libraries whose names contain one of `words`, without their folders, in the
  !> order of the words; empty where the system does not tell.
  !>
  !> Behind its links a library's file bears its version.
  function loaded_libraries(words) result(list)
    character(*), intent(in) :: words(:)
    character(:), allocatable :: list !! separated by a comma and a blank
    character(4096) :: line
    character(:), allocatable :: name
    integer :: unit, status, i

    list = ''
    do i = 1, size(words)
      open (newunit=unit, file='/proc/self/maps', action='read', status='old', iostat=status)
      if (status /= 0) return
      do
        read (unit, '(a)', iostat=status) line
        if (status /= 0) exit
        name = trim(line(index(line, '/', back=.true.) + 1:))
        if (index(name, '.so') == 0 .or. index(name, trim(words(i))) == 0) cycle
        if (index(', '//list//',', ', '//name//',') > 0) cycle
        if (list /= '') list = list//', '
        list = list//name
      end do
      close (unit)
    end do
  end function loaded_libraries

end module loaded_libraries_mod
