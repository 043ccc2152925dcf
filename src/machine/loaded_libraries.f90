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
    character(:), allocatable :: names, name
    integer :: i, first, last

    list = ''
    names = loaded_names()
    do i = 1, size(words)
      first = 1
      do while (first <= len(names))
        last = first + index(names(first:), '/') - 2
        name = names(first:last)
        first = last + 2
        if (index(name, trim(words(i))) == 0) cycle
        if (index(', '//list//',', ', '//name//',') > 0) cycle
        if (list /= '') list = list//', '
        list = list//name
      end do
    end do
  end function loaded_libraries

  !> The files of all shared libraries, each once and with a slash behind it.
  function loaded_names() result(names)
    character(:), allocatable :: names
    character(4096) :: line
    integer :: unit, status, length, first

    names = ''
    open (newunit=unit, file='/proc/self/maps', action='read', status='old', iostat=status)
    if (status /= 0) return
    do
      read (unit, '(a)', advance='no', size=length, iostat=status) line
      if (.not. is_iostat_eor(status)) exit
      first = index(line(:length), '/', back=.true.)
      if (index(line(first + 1:length), '.so') == 0) cycle
      if (index('/'//names, '/'//line(first + 1:length)//'/') > 0) cycle
      names = names//line(first + 1:length)//'/'
    end do
    close (unit)
  end function loaded_names

end module loaded_libraries_mod
