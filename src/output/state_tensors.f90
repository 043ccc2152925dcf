!> Stresses and strains of a state wherever the deck asks for them, which several fields share.
module state_tensors_mod
  use connectivity_mod, only: first_points
  use scene_mod, only: scene_t
  use step_fields_mod, only: tensor_field_t
  use mesh_fields_mod, only: fill_tensors_of, fill_undeformed_tensors
  use output_field_mod, only: field_source_t
  implicit none
  private

  public :: make_tensors, make_undeformed_tensors

contains

  !> Stress and strain wherever the deck asks for them, in one sweep over the elements.
  subroutine make_tensors(source)
    type(field_source_t), intent(inout) :: source

    if (is_made(source%stress) .or. is_made(source%strain)) return
    associate (scene => source%scene)
      associate (asked => scene%output)
        if (asked%stress .or. asked%mises .or. asked%principal_stress) then
          call allocate_tensors(scene, source%stress)
        end if
        if (asked%strain .or. asked%principal_strain) then
          call allocate_tensors(scene, source%strain)
        end if
      end associate
      call fill_tensors_of(scene, source%state, source%strain, source%stress)
    end associate
  end subroutine make_tensors

  !> The same of those that refer to the undeformed body.
  subroutine make_undeformed_tensors(source)
    type(field_source_t), intent(inout) :: source

    if (is_made(source%pk2) .or. is_made(source%green)) return
    if (source%scene%output%pk2_stress) call allocate_tensors(source%scene, source%pk2)
    if (source%scene%output%green_strain) call allocate_tensors(source%scene, source%green)
    call fill_undeformed_tensors(source%scene, source%state, source%green, source%pk2)
  end subroutine make_undeformed_tensors

  pure logical function is_made(field)
    type(tensor_field_t), intent(in) :: field

    is_made = allocated(field%at_centroids) .or. allocated(field%at_gauss_points) .or. &
      allocated(field%at_nodes)
  end function is_made

  !> Room for a tensor wherever the deck wants it.
  subroutine allocate_tensors(scene, field)
    type(scene_t), intent(in) :: scene
    type(tensor_field_t), intent(inout) :: field

    associate (mesh => scene%mesh, output => scene%output)
      if (output%at_centroids) allocate (field%at_centroids(6, mesh%n_elements))
      if (output%at_gauss_points) then
        associate (first => first_points(mesh%connectivity))
          allocate (field%at_gauss_points(6, first(size(first)) - 1))
        end associate
      end if
      if (output%at_nodes) allocate (field%at_nodes(6, mesh%n_nodes))
    end associate
  end subroutine allocate_tensors

end module state_tensors_mod
