!> The group /history of a result file: a row an increment, of numbers that concern the whole body.
module result_history_mod
  use kinds_mod, only: i8
  use errors_mod, only: error_t
  use mesh_mod, only: mesh_t
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t
  use increment_report_mod, only: increment_report_t
  use output_field_mod, only: field_t
  use history_fields_mod, only: list_history_fields, plan_history_fields
  use hdf5_files_mod, only: hdf5_file_t
  use hdf5_attributes_mod, only: write_attribute, write_and_flush, describe_group
  use hdf5_rows_mod, only: rows_t, create_rows, keep_rows, append_row
  implicit none
  private

  public :: history_t, create_history, say_what_small_strain_is, append_history, finish_row

  character(*), parameter :: group = '/history'

  !> The open datasets of the group, in the order of the table.
  type :: history_t
    private
    type(rows_t), allocatable :: rows(:)
    logical :: moves = .false. !! as of list_history_fields
  end type history_t

contains

  subroutine create_history(file, n_rows, of_energy, small_strain_is, moves, history, error)
    type(hdf5_file_t), intent(in) :: file
    integer, intent(in) :: n_rows !! that the file has already, of a run that is continued
    logical, intent(in) :: of_energy !! errors are parts of the energy, not of a resultant
    character(*), intent(in) :: small_strain_is
    !! error/small_strain: bound, estimate, finite strain
    logical, intent(in) :: moves  !! as of list_history_fields
    type(history_t), intent(out) :: history
    type(error_t), allocatable, intent(out) :: error
    type(field_t), allocatable :: fields(:)
    integer :: i

    call describe_group(file, group, 'a row an increment; rows beyond "finished" do not count', &
      error)
    call write_attribute(file, group, 'finished', int(n_rows, i8), error)
    call describe_group(file, group//'/certificate', &
      'errors found by a check that shares nothing with the solvers', error)
    call describe_group(file, group//'/energy', 'energies from the start of the run', error)
    call describe_group(file, group//'/error', 'estimated errors; -1 where there is no estimate', &
      error)
    call write_attribute(file, group//'/error', 'of_energy', merge(1_i8, 0_i8, of_energy), error)
    call say_what_small_strain_is(file, small_strain_is, error)
    history%moves = moves
    call plan_history_fields(fields, moves)
    allocate (history%rows(size(fields)))
    do i = 1, size(fields)
      call create_rows(file, group//'/'//fields(i)%name, fields(i)%kind, fields(i)%extents, &
        fields(i)%description, fields(i)%quantity, history%rows(i), error)
      call keep_rows(history%rows(i), n_rows, error)
    end do
  end subroutine create_history

  !> What error/small_strain is, which may change while the run goes.
  subroutine say_what_small_strain_is(file, words, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: words !! bound, estimate, finite strain
    type(error_t), allocatable, intent(inout) :: error
    character(len('finite strain')) :: text

    text = repeat(achar(0), len(text))
    text(:len(words)) = words
    call write_attribute(file, group//'/error', 'small_strain_is', text, error)
  end subroutine say_what_small_strain_is

  subroutine append_history(history, state, report, mesh, points, checksum, error)
    type(history_t), intent(inout) :: history
    type(state_t), intent(in) :: state
    type(increment_report_t), intent(in) :: report
    type(mesh_t), intent(in) :: mesh
    type(contact_points_t), intent(in) :: points
    integer(i8), intent(inout) :: checksum !! of the increment, to which that of every row is added
    type(error_t), allocatable, intent(inout) :: error
    type(field_t), allocatable :: fields(:)
    integer :: i

    call list_history_fields(state, report, mesh, points, fields, history%moves)
    do i = 1, size(fields)
      call append_row(history%rows(i), fields(i)%value, checksum, error)
    end do
  end subroutine append_history

  !> Tell readers that they may read this many rows: to be called when they are on disk.
  subroutine finish_row(file, n_rows, error)
    type(hdf5_file_t), intent(in) :: file
    integer, intent(in) :: n_rows
    type(error_t), allocatable, intent(inout) :: error

    call write_and_flush(file, group, 'finished', int(n_rows, i8), error)
  end subroutine finish_row

end module result_history_mod
