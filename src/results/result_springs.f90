!> The group /springs of a result file: forces and elongations of springs.
module result_springs_mod
  use errors_mod, only: error_t
  use scene_mod, only: scene_t
  use output_field_mod, only: field_t, field_source_t
  use spring_fields_mod, only: list_spring_fields
  use hdf5_files_mod, only: hdf5_file_t
  use hdf5_attributes_mod, only: describe_group
  use result_fields_mod, only: open_field_t, open_group
  implicit none
  private

  public :: create_springs

  character(*), parameter :: group = '/springs'

contains

  !> Make the group where the scene has springs, and write what does not change.
  subroutine create_springs(file, scene, n_rows, opened, error)
    type(hdf5_file_t), intent(in) :: file
    type(scene_t), intent(in), target :: scene
    integer, intent(in) :: n_rows !! that the file has already, of a run that is continued
    type(open_field_t), allocatable, intent(out) :: opened(:) !! none where the scene has none
    type(error_t), allocatable, intent(inout) :: error
    type(field_t), allocatable :: fields(:)
    type(field_source_t) :: source

    call list_spring_fields(scene, fields)
    source%scene => scene
    if (size(fields) > 0) call describe_group(file, group, &
      'springs of the deck; a row an increment', error)
    call open_group(file, group, fields, source, n_rows, opened, error)
  end subroutine create_springs

end module result_springs_mod
