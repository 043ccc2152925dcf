!> The groups /gauss/TYPE of a result file: what there is at the Gauss points of the elements.
module result_gauss_mod
  use errors_mod, only: error_t
  use text_mod, only: string_t
  use scene_mod, only: scene_t
  use output_field_mod, only: field_t, field_source_t
  use gauss_fields_mod, only: list_gauss_fields
  use gauss_types_mod, only: list_gauss_types
  use hdf5_files_mod, only: hdf5_file_t
  use hdf5_attributes_mod, only: describe_group
  use result_fields_mod, only: open_field_t, open_group
  implicit none
  private

  public :: create_gauss

  character(*), parameter :: group = '/gauss'

contains

  !> Make the groups where the deck asks for any, and write what does not change.
  subroutine create_gauss(file, scene, n_steps, opened, error)
    type(hdf5_file_t), intent(in) :: file
    type(scene_t), intent(in), target :: scene
    integer, intent(in) :: n_steps !! increments with fields that the file has already
    type(open_field_t), allocatable, intent(out) :: opened(:) !! none where the deck asks for none
    type(error_t), allocatable, intent(inout) :: error
    type(field_t), allocatable :: fields(:)
    type(field_source_t) :: source
    type(string_t), allocatable :: types(:)
    integer, allocatable :: of_element(:)
    integer :: k

    call list_gauss_fields(scene, fields)
    source%scene => scene
    if (size(fields) > 0) then
      call describe_group(file, group, 'Gauss points of the elements, a group a type', error)
      call list_gauss_types(scene%mesh, types, of_element)
      do k = 1, size(types)
        call describe_group(file, group//'/'//types(k)%text, 'a row an increment with fields', &
          error)
      end do
    end if
    call open_group(file, group, fields, source, n_steps, opened, error)
  end subroutine create_gauss

end module result_gauss_mod
