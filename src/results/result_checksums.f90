!> The group /checksums of a result file: what was written, so that damage is noticed.
!>
!> Of every increment there is the sum of the checksums of its rows, a row's being the CRC-32 of its
!> dataset's path followed by the bytes of its numbers: whatever the order in which they are
!> written and read, the sum is the same. Beside it stands how many increments with fields there
!> were by then, which says which of the fields are the increment's. What does not change has one
!> sum for all of it.
module result_checksums_mod
  use kinds_mod, only: i8
  use errors_mod, only: error_t, raise, exit_wrong_input
  use dataset_kinds_mod, only: of_long
  use text_mod, only: string_t
  use hdf5_files_mod, only: hdf5_file_t, exists, flush_file, list_members
  use hdf5_attributes_mod, only: write_attribute, read_attribute, describe_group
  use hdf5_contents_mod, only: checksum_of_contents
  use hdf5_datasets_mod, only: read_dataset, dataset_kind
  use hdf5_rows_mod, only: rows_t, create_rows, keep_rows, append_row
  use hdf5_read_rows_mod, only: read_through, is_growing
  implicit none
  private

  public :: checksums_t, create_checksums, append_checksum, seal_contents, has_checksums, &
    check_contents, read_increments, steps_until

  character(*), parameter :: group = '/checksums', table = group//'/increments'
  character, parameter :: nl = new_line('a')
  ! What a run changes in its file but by rows that it appends.
  character(*), parameter :: changing = '/run@status'//nl//'/run@continued'//nl// &
    '/run/counters'//nl//'/history@finished'//nl// &
    '/history/error@small_strain_is'//nl//'/VTKHDF/Steps@NSteps'//nl// &
    '/state/slot_1@row'//nl//'/state/slot_1@length'//nl//'/state/slot_1@bits'//nl// &
    '/state/slot_2@row'//nl//'/state/slot_2@length'//nl//'/state/slot_2@bits'//nl// &
    '/checksums@contents'//nl//'/accuracy@reached'//nl//'/accuracy@mesh'//nl// &
    '/accuracy@load_steps'//nl//'/accuracy@mesh_and_load_steps'//nl// &
    '/accuracy@others'//nl//'/accuracy@small_strain'//nl//'/accuracy/element_size'//nl// &
    '/accuracy/divisions'//nl//'/accuracy/elements'//nl//'/accuracy/processor_time'//nl// &
    '/accuracy/values'//nl//'/accuracy/extrapolated'//nl//'/accuracy/error'//nl// &
    '/accuracy/order'//nl//'/accuracy/scale'//nl//'/accuracy/cuts'//nl// &
    '/accuracy/extrapolated_error'

  !> The open table.
  type :: checksums_t
    private
    type(rows_t) :: rows
  end type checksums_t

contains

  ! ------------------------------------------------------------------ writing

  !> Make the group, or open that of a run that is continued.
  subroutine create_checksums(file, n_rows, checksums, error)
    type(hdf5_file_t), intent(in) :: file
    integer, intent(in) :: n_rows !! that the file has already, of a run that is continued
    type(checksums_t), intent(out) :: checksums
    type(error_t), allocatable, intent(inout) :: error

    call describe_group(file, group, 'what was written, so that damage is noticed', error)
    call create_rows(file, table, of_long, [2], 'of each increment: the sum of the CRC-32 of '// &
      'each of its rows, path and bytes; increments with fields so far', 'number', &
      checksums%rows, error)
    call keep_rows(checksums%rows, n_rows, error)
  end subroutine create_checksums

  !> Append what an increment adds up to.
  subroutine append_checksum(checksums, checksum, n_steps, error)
    type(checksums_t), intent(inout) :: checksums
    integer(i8), intent(in) :: checksum !! the sum over all rows that it wrote
    integer, intent(in) :: n_steps      !! increments with fields, this one included
    type(error_t), allocatable, intent(inout) :: error
    integer(i8) :: unused

    unused = 0
    call append_row(checksums%rows, [checksum, int(n_steps, i8)], unused, error)
  end subroutine append_checksum

  !> Say what does not change from here on: when all groups and datasets have been made.
  subroutine seal_contents(file, error)
    type(hdf5_file_t), intent(in) :: file
    type(error_t), allocatable, intent(inout) :: error
    integer(i8) :: sum

    call write_attribute(file, group, 'contents', 0_i8, error)
    call flush_file(file, error)
    call checksum_of_contents(file, changing, sum, error)
    call write_attribute(file, group, 'contents', sum, error)
  end subroutine seal_contents

  ! ------------------------------------------------------------------ checking

  logical function has_checksums(file)
    type(hdf5_file_t), intent(in) :: file

    has_checksums = exists(file, table)
  end function has_checksums

  !> Refuse a file in which something is not as it was made that should never change.
  subroutine check_contents(file, error)
    type(hdf5_file_t), intent(in) :: file
    type(error_t), allocatable, intent(inout) :: error
    type(error_t), allocatable :: unread
    integer(i8) :: sum, expected

    call read_attribute(file, group, 'contents', expected, unread)
    if (allocated(unread)) then
      call raise(error, exit_wrong_input, "'"//file%path//"' is damaged: its "// &
        'checksum cannot be read')
      return
    end if
    call checksum_of_contents(file, changing, sum, error)
    if (allocated(error)) return
    if (sum /= expected) call raise(error, exit_wrong_input, "'"//file%path//"' is damaged: "// &
      'its names, descriptions, mesh or deck are not what was written')
  end subroutine check_contents

  !> Read all increments, find how many from the first on are what was written, and copy them.
  !>
  !> Of increments that are copied it is the copy that is read when it is checked again.
  subroutine read_increments(file, n_rows, n_sound, error, copy)
    type(hdf5_file_t), intent(in) :: file
    integer, intent(in) :: n_rows   !! that are finished
    integer, intent(out) :: n_sound !! of them
    type(error_t), allocatable, intent(inout) :: error
    type(hdf5_file_t), intent(in), optional :: copy !! laid out, without rows
    integer(i8), allocatable :: sums(:), of_fields(:), unused(:)
    integer(i8), allocatable :: written(:, :) !! (2,n) sums, increments with fields
    integer :: n, n_steps, i

    n_sound = 0
    call read_table(file, written, error)
    if (allocated(error)) return
    n = min(n_rows, size(written, 2))
    ! Where that grows otherwise than by one now and then, what follows is of no increment.
    n_steps = 0
    do i = 1, n
      if (written(2, i) < n_steps .or. written(2, i) > n_steps + 1) exit
      n_steps = int(written(2, i))
    end do
    n = i - 1
    allocate (sums(n), of_fields(n_steps), unused(n), source=0_i8)
    call read_groups(file, '/history', n, sums, error, copy)
    call read_groups(file, '/contact', n, sums, error, copy)
    if (exists(file, '/reference_nodes')) call read_groups(file, '/reference_nodes', n, sums, &
      error, copy)
    if (exists(file, '/springs')) call read_groups(file, '/springs', n, sums, error, copy)
    if (exists(file, '/print')) call read_groups(file, '/print', n, sums, error, copy)
    if (exists(file, '/gauss')) call read_groups(file, '/gauss', n_steps, of_fields, error, copy)
    call read_groups(file, '/VTKHDF/Steps', n_steps, of_fields, error, copy)
    call read_fields(file, 'PointData', 'NumberOfPoints', n_steps, of_fields, error, copy)
    call read_fields(file, 'CellData', 'NumberOfCells', n_steps, of_fields, error, copy)
    if (present(copy)) call read_through(file, table, 1_i8, n, unused, error, copy)
    if (allocated(error)) return
    n_steps = 0
    do i = 1, n
      if (written(2, i) > n_steps) sums(i) = sums(i) + of_fields(written(2, i))
      n_steps = int(written(2, i))
      if (sums(i) /= written(1, i)) exit
    end do
    n_sound = i - 1
  end subroutine read_increments

  !> How many increments with fields there are among the first `n_rows`.
  subroutine steps_until(file, n_rows, n_steps, error)
    type(hdf5_file_t), intent(in) :: file
    integer, intent(in) :: n_rows
    integer, intent(out) :: n_steps
    type(error_t), allocatable, intent(inout) :: error
    integer(i8), allocatable :: written(:, :)

    n_steps = 0
    call read_table(file, written, error)
    if (n_rows >= 1 .and. n_rows <= size(written, 2)) n_steps = int(written(2, n_rows))
  end subroutine steps_until

  subroutine read_table(file, written, error)
    type(hdf5_file_t), intent(in) :: file
    integer(i8), allocatable, intent(out) :: written(:, :) !! (2,increments)
    type(error_t), allocatable, intent(inout) :: error
    integer(i8), allocatable :: values(:)

    call read_dataset(file, table, values, error)
    if (allocated(error)) values = [integer(i8) ::]
    written = reshape(values, [2, size(values)/2])
  end subroutine read_table

  !> Read every dataset that grows in a group and in the groups in it, a row of each a number.
  subroutine read_groups(file, path, n_rows, sums, error, copy)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer, intent(in) :: n_rows
    integer(i8), intent(inout) :: sums(:)
    type(error_t), allocatable, intent(inout) :: error
    type(hdf5_file_t), intent(in), optional :: copy
    type(string_t), allocatable :: names(:), inner(:)
    integer :: i, j

    call list_members(file, path, names, error)
    do i = 1, size(names)
      if (allocated(error)) return
      associate (member => path//'/'//names(i)%text)
        if (is_growing(file, member)) then
          call read_through(file, member, 1_i8, n_rows, sums, error, copy)
          cycle
        end if
        if (dataset_kind(file, member) /= 0) cycle ! it does not change
        call list_members(file, member, inner, error)
        do j = 1, size(inner)
          if (.not. is_growing(file, member//'/'//inner(j)%text)) cycle
          call read_through(file, member//'/'//inner(j)%text, 1_i8, n_rows, sums, error, copy)
        end do
      end associate
    end do
  end subroutine read_groups

  !> Read the fields of a group, each increment as many places of the mesh.
  subroutine read_fields(file, group, places, n_steps, sums, error, copy)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: group, places !! names in /VTKHDF
    integer, intent(in) :: n_steps
    integer(i8), intent(inout) :: sums(:)
    type(error_t), allocatable, intent(inout) :: error
    type(hdf5_file_t), intent(in), optional :: copy
    type(string_t), allocatable :: names(:)
    integer(i8), allocatable :: n(:)
    integer :: i

    call read_dataset(file, '/VTKHDF/'//places, n, error)
    call list_members(file, '/VTKHDF/'//group, names, error)
    do i = 1, size(names)
      associate (path => '/VTKHDF/'//group//'/'//names(i)%text)
        if (is_growing(file, path)) call read_through(file, path, n(1), n_steps, sums, error, copy)
      end associate
    end do
  end subroutine read_fields

end module result_checksums_mod
