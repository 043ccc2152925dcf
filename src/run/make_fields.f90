!> The fields of an increment that are made only where they are written, and what is looked for in
!> them.
module make_fields_mod
  use scene_mod, only: scene_t
  use state_mod, only: state_t
  use increments_mod, only: ends_step, asked_number
  use step_report_mod, only: step_report_t
  use step_fields_mod, only: step_fields_t, tensor_field_t, fields_due
  use mesh_fields_mod, only: fill_tensor_fields, find_largest_deformation
  use recovered_error_mod, only: estimate_mesh_error
  implicit none
  private

  public :: estimate_mesh, make_fields, measure_deformation

contains

  !> The error of the mesh: at the end of a step, and where the deck wants it as a field.
  subroutine estimate_mesh(scene, state, report, fields)
    type(scene_t), intent(in) :: scene
    type(state_t), intent(in) :: state
    type(step_report_t), intent(inout) :: report !! gets the error of the mesh, where it is due
    type(step_fields_t), intent(out) :: fields   !! nothing, or that of each brick
    logical :: is_last, due

    is_last = ends_step(scene%steps, state)
    due = scene%output%mesh_error
    if (due) due = fields_due(scene%output%frequency, asked_number(state%position), is_last)
    if (.not. (is_last .or. due)) return
    call estimate_mesh_error(scene%mesh, scene%materials, state%displacement, fields%mesh_error, &
      report%errors%mesh)
  end subroutine estimate_mesh

  !> How far the increment leaves linear theory: at the end of a step, and where fields are written.
  subroutine measure_deformation(scene, state, report)
    type(scene_t), intent(in) :: scene
    type(state_t), intent(in) :: state
    type(step_report_t), intent(inout) :: report !! gets the largest strain and rotation
    logical :: is_last

    is_last = ends_step(scene%steps, state)
    if (.not. (is_last .or. fields_due(scene%output%frequency, asked_number(state%position), &
      is_last))) return
    call find_largest_deformation(scene%mesh, state%displacement, report%largest_strain, &
      report%largest_rotation)
  end subroutine measure_deformation

  !> The fields that the state does not hold, where the increment's are due.
  subroutine make_fields(scene, state, fields)
    type(scene_t), intent(in) :: scene
    type(state_t), intent(in) :: state
    type(step_fields_t), intent(inout) :: fields
    logical :: due

    due = fields_due(scene%output%frequency, asked_number(state%position), &
      ends_step(scene%steps, state))
    if (.not. due) return
    if (scene%output%reaction) fields%reaction_force = state%support_force
    if (scene%output%stress) call allocate_tensors(scene, fields%stress)
    if (scene%output%strain) call allocate_tensors(scene, fields%strain)
    if (scene%output%stress .or. scene%output%strain) then
      call fill_tensor_fields(scene%mesh, scene%materials, state%displacement, fields%strain, &
        fields%stress)
    end if
  end subroutine make_fields

  !> Room for a tensor wherever the deck wants it.
  subroutine allocate_tensors(scene, field)
    type(scene_t), intent(in) :: scene
    type(tensor_field_t), intent(inout) :: field

    associate (mesh => scene%mesh, output => scene%output)
      if (output%at_centroids) allocate (field%at_centroids(6, mesh%n_elements))
      if (output%at_gauss_points) allocate (field%at_gauss_points(6, 8, mesh%n_elements))
      if (output%at_nodes) allocate (field%at_nodes(6, mesh%n_nodes))
    end associate
  end subroutine allocate_tensors

end module make_fields_mod
