!> Fields of the table (output_field) as datasets of an open file.
module result_fields_mod
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t, raise, exit_machine
  use dataset_kinds_mod, only: of_real, of_long
  use text_mod, only: string_t, to_text
  use output_field_mod, only: field_t, field_source_t, block_shape, fill_field, first_time, &
    at_start, everywhere
  use hdf5_files_mod, only: hdf5_file_t, exists
  use hdf5_datasets_mod, only: write_dataset
  use hdf5_rows_mod, only: rows_t, create_rows, create_stack, create_dense_stack, keep_rows, &
    append_row
  implicit none
  private

  public :: open_field_t, open_group, open_blocks, append_fields, write_at_start, free_path

  !> A field and its open dataset.
  type :: open_field_t
    type(field_t) :: field
    type(rows_t), private :: rows
    logical, private :: has_rows = .false.
  end type open_field_t

contains

  !> Make the datasets of a group: write what does not change, and open what grows by a row an
  !> increment.
  subroutine open_group(file, group, fields, source, n_rows, opened, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: group !! its path
    type(field_t), intent(in) :: fields(:)
    type(field_source_t), intent(inout) :: source !! of what does not change
    integer, intent(in) :: n_rows !! increments that the file has already, of a continued run
    type(open_field_t), allocatable, intent(out) :: opened(:) !! what grows
    type(error_t), allocatable, intent(inout) :: error
    integer :: i, n

    allocate (opened(count(fields%written /= at_start)))
    n = 0
    do i = 1, size(fields)
      if (fields(i)%written == at_start) then
        call write_at_start(file, group, fields(i), source, error)
      else
        n = n + 1
        call open_rows(file, group, fields(i), n_rows, opened(n), error)
      end if
    end do
  end subroutine open_group

  !> Make the dataset of a field whose rows stand one beneath the other, or open that of a run that
  !> is continued.
  subroutine open_rows(file, group, field, n_rows, opened, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: group !! its path
    type(field_t), intent(in) :: field
    integer, intent(in) :: n_rows !! increments that the file has already
    type(open_field_t), intent(out) :: opened
    type(error_t), allocatable, intent(inout) :: error

    opened%field = field
    call create_rows(file, group//'/'//field%name, field%kind, field%extents, field%description, &
      field%quantity, opened%rows, error)
    call keep_what_counts(n_rows, opened, error)
  end subroutine open_rows

  !> The same for a field over the mesh: its blocks stand one behind the other, as VTKHDF wants
  !> them.
  subroutine open_blocks(file, group, field, n_steps, opened, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: group !! its path
    type(field_t), intent(in) :: field
    integer, intent(in) :: n_steps !! increments with fields that the file has already
    type(open_field_t), intent(out) :: opened
    type(error_t), allocatable, intent(inout) :: error

    opened%field = field
    if (field%spread == everywhere .and. field%kind == of_real) then
      call create_dense_stack(file, group//'/'//field%name, field%extents, field%description, &
        field%quantity, opened%rows, error)
    else
      call create_stack(file, group//'/'//field%name, field%kind, field%extents, &
        field%description, field%quantity, opened%rows, error)
    end if
    call keep_what_counts(n_steps, opened, error)
  end subroutine open_blocks

  !> Cut what the file has beyond the increments that count.
  subroutine keep_what_counts(n_increments, opened, error)
    integer, intent(in) :: n_increments
    type(open_field_t), intent(inout) :: opened
    type(error_t), allocatable, intent(inout) :: error
    integer :: n

    n = n_increments
    if (opened%field%written == first_time) n = min(n, 1)
    call keep_rows(opened%rows, n, error)
    opened%has_rows = n > 0
  end subroutine keep_what_counts

  !> Compute a field and append it, if it is not one that has its only row already.
  subroutine append_field(opened, source, checksum, error)
    type(open_field_t), intent(inout) :: opened
    type(field_source_t), intent(inout) :: source
    integer(i8), intent(inout) :: checksum !! of the increment, to which that of every row is added
    type(error_t), allocatable, intent(inout) :: error
    real(wp), allocatable :: values(:, :)

    if (allocated(error)) return
    if (opened%field%written == first_time .and. opened%has_rows) return
    call compute_values(opened%field, source, values, error)
    call append_row(opened%rows, values, checksum, error)
    opened%has_rows = .true.
  end subroutine append_field

  !> Compute fields and append them.
  subroutine append_fields(opened, source, checksum, error)
    type(open_field_t), intent(inout) :: opened(:)
    type(field_source_t), intent(inout) :: source
    integer(i8), intent(inout) :: checksum !! as above
    type(error_t), allocatable, intent(inout) :: error
    integer :: i

    do i = 1, size(opened)
      call append_field(opened(i), source, checksum, error)
    end do
  end subroutine append_fields

  !> Write a field that does not grow, unless the file has it.
  subroutine write_at_start(file, group, field, source, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: group !! its path
    type(field_t), intent(in) :: field
    type(field_source_t), intent(inout) :: source
    type(error_t), allocatable, intent(inout) :: error
    real(wp), allocatable :: values(:, :)

    if (allocated(error) .or. field%written /= at_start) return
    associate (path => group//'/'//field%name)
      if (exists(file, path)) return
      call compute_values(field, source, values, error)
      if (field%kind == of_long .and. size(field%extents) == 1) then
        call write_dataset(file, path, int(values(1, :), i8), field%description, field%quantity, &
          error)
      else if (field%kind == of_real .and. size(field%extents) == 1) then
        call write_dataset(file, path, values(1, :), field%description, field%quantity, error)
      else if (field%kind == of_real .and. size(field%extents) == 2) then
        call write_dataset(file, path, values, field%description, field%quantity, error)
      else
        call raise(error, exit_machine, "internal error: '"//path// &
          "' is of a kind or rank that is not written at the start")
      end if
    end associate
  end subroutine write_at_start

  !> The path of what has a name of the deck: the name, made fit for HDF5 and unlike those before.
  pure function free_path(group, name, before) result(path)
    character(*), intent(in) :: group          !! its path, with a slash behind
    character(*), intent(in) :: name
    type(string_t), intent(in) :: before(:)    !! the paths that are taken
    character(:), allocatable :: path, plain
    integer :: i, n

    plain = name
    do i = 1, len(plain)
      if (plain(i:i) == '/') plain(i:i) = '_'
    end do
    if (plain == '.') plain = '_' ! HDF5's name of the group itself
    path = group//plain
    n = 1
    do while (any([(before(i)%text == path, i = 1, size(before))]))
      n = n + 1
      path = group//plain//'-'//to_text(n)
    end do
  end function free_path

  subroutine compute_values(field, source, values, error)
    type(field_t), intent(in) :: field
    type(field_source_t), intent(inout) :: source
    real(wp), allocatable, intent(out) :: values(:, :) !! of the field's block_shape
    type(error_t), allocatable, intent(inout) :: error
    integer :: n(2)

    n = block_shape(field)
    allocate (values(n(1), n(2)), source=0.0_wp)
    ! Of no points there may be no arrays either.
    if (size(values) > 0 .and. .not. allocated(error)) call fill_field(field, source, values)
    if (allocated(source%error)) call move_alloc(source%error, error)
  end subroutine compute_values

end module result_fields_mod
