!> The table of a run's contact pairs beside its result, as text: NAME.contact.csv.
!>
!> It is made from the result file when the run ends, so that a continued run has all of it.
module contact_table_mod
  use kinds_mod, only: wp, i4, i8
  use errors_mod, only: error_t, raise, exit_machine
  use text_mod, only: string_t, to_text
  use fresh_file_mod, only: delete_file
  use hdf5_files_mod, only: hdf5_file_t, exists
  use hdf5_datasets_mod, only: read_dataset
  implicit none
  private

  public :: contact_table_path, list_contact_table, write_contact_table

  integer, parameter :: longest = 1000 !! half of a line
  character(*), parameter :: head = 'step,increment,time [time],pair,resultant x [force],'// &
    'resultant y [force],resultant z [force],moment x [moment],moment y [moment],'// &
    'moment z [moment],torque x [moment],torque y [moment],torque z [moment],'// &
    'contact area [area],largest pressure [pressure],largest slip [length]'

contains

  !> NAME.contact.csv for NAME.vtkhdf.
  pure function contact_table_path(result_path) result(path)
    character(*), intent(in) :: result_path
    character(:), allocatable :: path
    character(*), parameter :: ending = '.vtkhdf'
    integer :: n

    n = len(result_path)
    if (n > len(ending)) then
      if (result_path(n - len(ending) + 1:) == ending) n = n - len(ending)
    end if
    path = result_path(:n)//'.contact.csv'
  end function contact_table_path

  !> The lines of the table, an increment and pair each; none where the deck does not ask for it.
  subroutine list_contact_table(file, groups, n_rows, lines, error)
    type(hdf5_file_t), intent(in) :: file
    type(string_t), intent(in) :: groups(:) !! paths of the pairs
    integer, intent(in) :: n_rows           !! increments that are complete
    type(string_t), allocatable, intent(out) :: lines(:)
    type(error_t), allocatable, intent(inout) :: error
    integer(i4), allocatable :: step(:), increment(:)
    real(wp), allocatable :: time(:)
    integer :: i, k

    allocate (lines(0))
    if (allocated(error) .or. size(groups) == 0) return
    if (.not. exists(file, groups(1)%text//'/contact_area')) return
    call read_dataset(file, '/history/step', step, error)
    call read_dataset(file, '/history/increment', increment, error)
    call read_dataset(file, '/history/time', time, error)
    if (allocated(error)) return
    deallocate (lines)
    allocate (lines(1 + n_rows*size(groups)))
    lines(1)%text = head
    do i = 1, size(groups)
      call read_pair(i)
      if (allocated(error)) return
    end do

  contains

    subroutine read_pair(i)
      integer, intent(in) :: i
      real(wp), allocatable :: resultant(:), moment(:), torque(:), area(:), pressure(:), slip(:)
      character(:), allocatable :: group
      integer :: row
      character(longest) :: start, ending
      character(2*longest) :: line
      logical :: has_torque

      group = groups(i)%text
      has_torque = exists(file, group//'/torque')
      call read_dataset(file, group//'/resultant', resultant, error)
      call read_dataset(file, group//'/moment', moment, error)
      if (has_torque) call read_dataset(file, group//'/torque', torque, error)
      call read_dataset(file, group//'/contact_area', area, error)
      call read_dataset(file, group//'/largest_pressure', pressure, error)
      call read_dataset(file, group//'/largest_slip', slip, error)
      if (allocated(error)) return
      do k = 1, n_rows
        write (start, '(2(i0,","),g0,",""",a,"""",6(",",g0))') step(k), increment(k), time(k), &
          group(index(group, '/', back=.true.) + 1:), resultant(3*k - 2:3*k), moment(3*k - 2:3*k)
        if (has_torque) then
          write (ending, '(6(",",g0))') torque(3*k - 2:3*k), area(k), pressure(k), slip(k)
        else
          write (ending, '(",,,",3(",",g0))') area(k), pressure(k), slip(k)
        end if
        row = 1 + (k - 1)*size(groups) + i
        line = trim(start)//ending
        allocate (character(len_trim(line)) :: lines(row)%text)
        lines(row)%text(:) = line(:len_trim(line))
      end do
    end subroutine read_pair

  end subroutine list_contact_table

  !> Write the table; without lines there is none.
  subroutine write_contact_table(path, lines, error)
    character(*), intent(in) :: path
    type(string_t), intent(in) :: lines(:)
    type(error_t), allocatable, intent(out) :: error
    character(200) :: reason
    integer(i8) :: given, written
    integer :: unit, status, closed, i

    if (size(lines) == 0) return
    reason = ''
    given = 0
    open (newunit=unit, file=path, access='stream', form='formatted', action='write', &
      status='replace', iostat=status, iomsg=reason)
    if (status == 0) then
      do i = 1, size(lines)
        if (status /= 0) exit
        write (unit, '(a)', iostat=status, iomsg=reason) lines(i)%text
        given = given + len(lines(i)%text) + 1
      end do
      close (unit, iostat=closed)
      if (status == 0) status = closed
      ! The run-time library does not tell of a disk that is full at the end.
      inquire (file=path, size=written)
      if (status == 0 .and. written /= given) then
        status = 1
        reason = to_text(written)//' of '//to_text(given)//' bytes reached the disk'
      end if
      if (status /= 0) call delete_file(path)
    end if
    if (status /= 0) call raise(error, exit_machine, "cannot write '"//path//"': "//trim(reason))
  end subroutine write_contact_table

end module contact_table_mod
