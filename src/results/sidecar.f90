!> Text files beside a result: written line by line, deleted where the disk does not hold them.
module sidecar_mod
  use kinds_mod, only: i8
  use errors_mod, only: error_t, raise, exit_machine
  use text_mod, only: to_text
  use fresh_file_mod, only: delete_file
  implicit none
  private

  public :: sidecar_t, sidecar_path, open_sidecar, write_line, close_sidecar

  !> An open file.
  type :: sidecar_t
    private
    character(:), allocatable :: path
    character(200) :: reason = ''
    integer :: unit = 0, status = 0
    logical :: is_open = .false.
    integer(i8) :: given = 0 !! bytes
  end type sidecar_t

contains

  !> NAME and an ending for NAME.vtkhdf.
  pure function sidecar_path(result_path, ending) result(path)
    character(*), intent(in) :: result_path
    character(*), intent(in) :: ending !! with its point
    character(:), allocatable :: path
    character(*), parameter :: of_result = '.vtkhdf'
    integer :: n

    n = len(result_path)
    if (n > len(of_result)) then
      if (result_path(n - len(of_result) + 1:) == of_result) n = n - len(of_result)
    end if
    path = result_path(:n)//ending
  end function sidecar_path

  !> Begin a file, in the place of an older one.
  subroutine open_sidecar(path, sidecar)
    character(*), intent(in) :: path
    type(sidecar_t), intent(out) :: sidecar
    integer :: status

    sidecar%path = path
    open (newunit=sidecar%unit, file=path, access='stream', form='formatted', action='write', &
      status='replace', iostat=status, iomsg=sidecar%reason)
    sidecar%is_open = status == 0
    sidecar%status = status
  end subroutine open_sidecar

  !> One more line; after a failure nothing happens.
  subroutine write_line(sidecar, line)
    type(sidecar_t), intent(inout) :: sidecar
    character(*), intent(in) :: line
    integer :: status

    if (sidecar%status /= 0) return
    write (sidecar%unit, '(a)', iostat=status, iomsg=sidecar%reason) line
    if (status /= 0) sidecar%status = status
    sidecar%given = sidecar%given + len(line) + 1
  end subroutine write_line

  !> Close a file; one that is not whole is deleted.
  subroutine close_sidecar(sidecar, error)
    type(sidecar_t), intent(inout) :: sidecar
    type(error_t), allocatable, intent(inout) :: error
    !! it could not be written; or what was to be written in it is not known, as it came in
    integer(i8) :: written
    integer :: closed

    if (sidecar%is_open) then
      close (sidecar%unit, iostat=closed)
      sidecar%is_open = .false.
      if (sidecar%status == 0) sidecar%status = closed
      ! The run-time library does not tell of a disk that is full at the end.
      inquire (file=sidecar%path, size=written)
      if (sidecar%status == 0 .and. written /= sidecar%given) then
        sidecar%status = 1
        sidecar%reason = to_text(written)//' of '//to_text(sidecar%given)// &
          ' bytes reached the disk'
      end if
      if (sidecar%status /= 0 .or. allocated(error)) call delete_file(sidecar%path)
    end if
    if (sidecar%status /= 0 .and. .not. allocated(error)) call raise(error, exit_machine, &
      "cannot write '"//sidecar%path//"': "//trim(sidecar%reason))
  end subroutine close_sidecar

end module sidecar_mod
