!> A file as one text.
module whole_file_mod
  use kinds_mod, only: i8
  use resource_limits_mod, only: has_memory
  use text_mod, only: to_text
  implicit none
  private

  public :: read_whole_file

contains

  !> All bytes of the file at `path`; `problem` is allocated when they cannot be had.
  subroutine read_whole_file(path, most, raw, problem)
    character(*), intent(in) :: path
    integer, intent(in) :: most !! larger files are refused [byte]
    character(:), allocatable, intent(out) :: raw
    character(:), allocatable, intent(out) :: problem
    character(256) :: reason
    integer(i8) :: length
    integer :: unit, status
    logical :: exists

    inquire (file=path, exist=exists, size=length)
    if (.not. exists .or. len_trim(path) == 0) then
      problem = 'there is no such file'
    else if (length <= 0) then
      ! Also true of pipes, devices and folders, which must not even be opened: that may wait for
      ! ever.
      problem = 'the file is empty'
    else if (length > most) then
      problem = 'the file is larger than '//to_text(most/1000000)//' MB'
    else if (.not. has_memory(length)) then
      problem = 'there is no memory for it'
    end if
    if (allocated(problem)) return
    reason = ''
    open (newunit=unit, file=path, access='stream', form='unformatted', action='read', &
      status='old', iostat=status, iomsg=reason)
    if (status == 0) then
      allocate (character(length) :: raw)
      read (unit, iostat=status, iomsg=reason) raw
      close (unit)
    end if
    if (status /= 0) problem = 'the file cannot be read ('//trim(reason)//')'
  end subroutine read_whole_file

end module whole_file_mod
