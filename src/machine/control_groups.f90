!> The control groups that limit what a process may use: versions 1 and 2 of Linux.
module control_groups_mod
  use text_mod, only: string_t
  implicit none
  private

  public :: list_groups

contains

  !> The folders of the process's control groups and of all above them, a slash at the end of each:
  !> those of version 2, and those of version 1 that concern a controller. None where the system
  !> does not tell.
  subroutine list_groups(root, controller, of_version_2, of_version_1)
    character(*), intent(in) :: root       !! above /proc and /sys, '' but in tests
    character(*), intent(in) :: controller !! 'memory', 'cpu'
    type(string_t), allocatable, intent(out) :: of_version_2(:), of_version_1(:)
    character(1024) :: line
    integer :: unit, status, first, last

    allocate (of_version_2(0), of_version_1(0))
    open (newunit=unit, file=root//'/proc/self/cgroup', action='read', status='old', &
      iostat=status)
    if (status /= 0) return
    do
      read (unit, '(a)', iostat=status) line
      if (status /= 0) exit
      ! 0::/a/b, or 4:cpu,cpuacct:/job
      first = index(line, ':')
      last = first + index(line(first + 1:), ':')
      if (last <= first) cycle
      if (line(:last) == '0::') then
        call add_with_those_above('/sys/fs/cgroup', trim(line(last + 1:)), of_version_2)
      else if (index(','//line(first + 1:last - 1)//',', ','//controller//',') > 0) then
        call add_with_those_above('/sys/fs/cgroup/'//controller, trim(line(last + 1:)), &
          of_version_1)
      end if
    end do
    close (unit)

  contains

    subroutine add_with_those_above(mount, group, folders)
      character(*), intent(in) :: mount, group
      type(string_t), allocatable, intent(inout) :: folders(:)
      character(:), allocatable :: folder
      type(string_t) :: path ! by a name, for gfortran does not free one made in the list

      folder = group
      do
        path%text = root//mount//folder//'/'
        folders = [folders, path]
        if (folder == '') exit
        folder = folder(:index(folder, '/', back=.true.) - 1)
      end do
    end subroutine add_with_those_above

  end subroutine list_groups

end module control_groups_mod
