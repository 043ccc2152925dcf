!> The groups of a result file for what stands beside the elements: /reference_nodes and /springs.
module result_beside_mod
  use errors_mod, only: error_t
  use scene_mod, only: scene_t
  use output_field_mod, only: field_t, field_source_t
  use reference_fields_mod, only: list_reference_fields
  use spring_fields_mod, only: list_spring_fields
  use hdf5_files_mod, only: hdf5_file_t
  use hdf5_attributes_mod, only: describe_group
  use result_fields_mod, only: open_field_t, open_group
  implicit none
  private

  public :: create_references, create_springs

contains

  !> What moves or carries forces beside the elements.
  subroutine create_references(file, scene, n_rows, opened, error)
    type(hdf5_file_t), intent(in) :: file
    type(scene_t), intent(in), target :: scene
    integer, intent(in) :: n_rows !! that the file has already, of a run that is continued
    type(open_field_t), allocatable, intent(out) :: opened(:) !! none if the scene has no such nodes
    type(error_t), allocatable, intent(inout) :: error
    type(field_t), allocatable :: fields(:)

    call list_reference_fields(scene, fields)
    call create_group(file, scene, '/reference_nodes', &
      'nodes beside the elements that move or carry forces', fields, n_rows, opened, error)
  end subroutine create_references

  !> Forces and elongations of springs.
  subroutine create_springs(file, scene, n_rows, opened, error)
    type(hdf5_file_t), intent(in) :: file
    type(scene_t), intent(in), target :: scene
    integer, intent(in) :: n_rows !! that the file has already, of a run that is continued
    type(open_field_t), allocatable, intent(out) :: opened(:) !! none if the scene has no springs
    type(error_t), allocatable, intent(inout) :: error
    type(field_t), allocatable :: fields(:)

    call list_spring_fields(scene, fields)
    call create_group(file, scene, '/springs', 'springs of the deck', fields, n_rows, opened, error)
  end subroutine create_springs

  !> Make a group if it has fields, and write what does not change.
  subroutine create_group(file, scene, group, content, fields, n_rows, opened, error)
    type(hdf5_file_t), intent(in) :: file
    type(scene_t), intent(in), target :: scene
    character(*), intent(in) :: group, content !! its path, and what its rows are of
    type(field_t), intent(in) :: fields(:)
    integer, intent(in) :: n_rows              !! that the file has already
    type(open_field_t), allocatable, intent(out) :: opened(:) !! what grows
    type(error_t), allocatable, intent(inout) :: error
    type(field_source_t) :: source

    source%scene => scene
    if (size(fields) > 0) call describe_group(file, group, content//'; a row an increment', error)
    call open_group(file, group, fields, source, n_rows, opened, error)
  end subroutine create_group

end module result_beside_mod
