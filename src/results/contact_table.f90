!> The table of a run's contact pairs beside its result, as text: NAME.contact.csv.
!>
!> It is made from the result file when the run ends, so that a continued run has all of it.
module contact_table_mod
  use kinds_mod, only: wp, i4
  use errors_mod, only: error_t
  use text_mod, only: string_t
  use hdf5_files_mod, only: hdf5_file_t, exists
  use hdf5_datasets_mod, only: read_dataset
  use sidecar_mod, only: sidecar_t, sidecar_path, open_sidecar, write_line, close_sidecar
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

    path = sidecar_path(result_path, '.contact.csv')
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
    type(sidecar_t) :: table
    integer :: i

    if (size(lines) == 0) return
    call open_sidecar(path, table)
    do i = 1, size(lines)
      call write_line(table, lines(i)%text)
    end do
    call close_sidecar(table, error)
  end subroutine write_contact_table

end module contact_table_mod
