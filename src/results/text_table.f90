!> Tables of text beside a result: written line by line, deleted where the disk does not hold them.
module text_table_mod
  use kinds_mod, only: i8
  use errors_mod, only: error_t, raise, exit_machine
  use text_mod, only: to_text
  use fresh_file_mod, only: delete_file
  implicit none
  private

  public :: text_table_t, table_path, open_table, write_line, close_table

  !> An open table.
  type :: text_table_t
    private
    character(:), allocatable :: path
    character(200) :: reason = ''
    integer :: unit = 0, status = 0
    integer(i8) :: given = 0 !! bytes
  end type text_table_t

contains

  !> NAME.kind.csv for NAME.vtkhdf.
  pure function table_path(result_path, kind) result(path)
    character(*), intent(in) :: result_path, kind
    character(:), allocatable :: path
    character(*), parameter :: ending = '.vtkhdf'
    integer :: n

    n = len(result_path)
    if (n > len(ending)) then
      if (result_path(n - len(ending) + 1:) == ending) n = n - len(ending)
    end if
    path = result_path(:n)//'.'//kind//'.csv'
  end function table_path

  !> Begin a table, in the place of an older one.
  subroutine open_table(path, table)
    character(*), intent(in) :: path
    type(text_table_t), intent(out) :: table
    integer :: status

    table%path = path
    open (newunit=table%unit, file=path, access='stream', form='formatted', action='write', &
      status='replace', iostat=status, iomsg=table%reason)
    if (status /= 0) table%status = status
  end subroutine open_table

  !> One more line; after a failure nothing happens.
  subroutine write_line(table, line)
    type(text_table_t), intent(inout) :: table
    character(*), intent(in) :: line
    integer :: status

    if (table%status /= 0) return
    write (table%unit, '(a)', iostat=status, iomsg=table%reason) line
    if (status /= 0) table%status = status
    table%given = table%given + len(line) + 1
  end subroutine write_line

  subroutine close_table(table, error)
    type(text_table_t), intent(inout) :: table
    type(error_t), allocatable, intent(inout) :: error !! it could not be written, and is deleted
    integer(i8) :: written
    integer :: closed

    close (table%unit, iostat=closed)
    if (table%status == 0) table%status = closed
    ! The run-time library does not tell of a disk that is full at the end.
    inquire (file=table%path, size=written)
    if (table%status == 0 .and. written /= table%given) then
      table%status = 1
      table%reason = to_text(written)//' of '//to_text(table%given)//' bytes reached the disk'
    end if
    if (table%status == 0) return
    call delete_file(table%path)
    call raise(error, exit_machine, "cannot write '"//table%path//"': "//trim(table%reason))
  end subroutine close_table

end module text_table_mod
