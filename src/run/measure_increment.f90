!> What is looked for in an increment only at the end of a step and where fields are written: the
!> error of the mesh, the largest strain and rotation.
module measure_increment_mod
  use kinds_mod, only: wp
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t
  use increments_mod, only: ends_step, asked_number
  use increment_report_mod, only: increment_report_t
  use step_fields_mod, only: fields_due
  use expansion_mod, only: find_thermal_stress
  use mesh_fields_mod, only: find_largest_deformation
  use recovered_error_mod, only: estimate_mesh_error
  use unseen_contact_mod, only: unseen_error
  implicit none
  private

  public :: estimate_mesh, measure_deformation

contains

  !> The error of the mesh: at the end of a step, and where the deck wants it as a field.
  !> Where an accuracy is asked of this mesh alone, with what recovery does not see of contact.
  subroutine estimate_mesh(scene, points, state, report)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(state_t), intent(in) :: state
    type(increment_report_t), intent(inout) :: report !! gets the error of the mesh, where it is due
    real(wp), allocatable :: thermal(:) !! (n_elements) [force/length^2]
    logical :: is_last, due

    is_last = ends_step(scene%steps, state)
    due = scene%output%mesh_error
    if (due) due = fields_due(scene%output%frequency, asked_number(state%position), is_last)
    if (.not. (is_last .or. due)) return
    call find_thermal_stress(scene, state%step, state%position, thermal)
    call estimate_mesh_error(scene%mesh, scene%materials, state%displacement, report%mesh_error, &
      report%errors%mesh, thermal)
    if (scene%accuracy%wanted > 0.0_wp .and. scene%accuracy%keeps_mesh) report%errors%mesh = &
      report%errors%mesh + unseen_error(scene, points, report%contact, report%energy%strain)
  end subroutine estimate_mesh

  !> How far the increment leaves linear theory: at the end of a step, and where fields are written.
  subroutine measure_deformation(scene, state, report)
    type(scene_t), intent(in) :: scene
    type(state_t), intent(in) :: state
    type(increment_report_t), intent(inout) :: report !! gets the largest strain and rotation
    logical :: is_last

    is_last = ends_step(scene%steps, state)
    if (.not. (is_last .or. fields_due(scene%output%frequency, asked_number(state%position), &
      is_last))) return
    call find_largest_deformation(scene%mesh, state%displacement, report%largest_strain, &
      report%largest_rotation)
  end subroutine measure_deformation

end module measure_increment_mod
