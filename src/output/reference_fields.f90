!> The fields of reference nodes: what moves or carries forces beside the elements, each a history.
module reference_fields_mod
  use dataset_kinds_mod, only: of_real, of_long
  use scene_mod, only: scene_t, reference_nodes, has_rotations
  use output_field_mod, only: field_t, field_list_t, add_field, get_fields, &
    compute_field, every_time, at_start, everywhere, of_references
  use nodal_fields_mod, only: node_id, coordinates, displacement, reaction_force, applied_force, &
    rotation, reaction_moment, applied_moment
  implicit none
  private

  public :: list_reference_fields

contains

  !> The fields of the reference nodes; none where the scene has no such nodes.
  subroutine list_reference_fields(scene, fields)
    type(scene_t), intent(in) :: scene
    type(field_t), allocatable, intent(out) :: fields(:)
    type(field_list_t) :: list

    associate (n => size(reference_nodes(scene)), asked => scene%output)
      if (n > 0) then
        call add_field(list, field_t('node_id', of_long, [n], 'number', &
          'ids of the nodes in the deck', at_start, everywhere, of_references, compute=node_id))
        call add_field(list, field_t('coordinates', of_real, [3, n], 'length', &
          'where the nodes are in the deck, x, y, z', at_start, everywhere, of_references, &
          compute=coordinates))
        call vector('displacement', 'length', 'from there, x, y, z', displacement)
        call vector('reaction_force', 'force', 'of the supports, x, y, z', reaction_force)
        if (asked%loads) call vector('applied_force', 'force', 'of the loads, x, y, z', &
          applied_force)
      end if
      if (has_rotations(scene)) then
        call vector('rotation', 'angle', 'rotation vectors, x, y, z', rotation)
        call vector('reaction_moment', 'moment', 'of the supports on obstacles that turn and '// &
          'on coupled faces, about the nodes, x, y, z', reaction_moment)
        if (asked%loads .and. allocated(scene%rotations)) call vector('applied_moment', 'moment', &
          'of the loads on coupled faces, about the nodes, x, y, z', applied_moment)
      end if
    end associate
    call get_fields(list, fields)

  contains

    subroutine vector(name, quantity, description, compute)
      character(*), intent(in) :: name, quantity, description
      procedure(compute_field) :: compute

      call add_field(list, field_t(name, of_real, [3, size(reference_nodes(scene))], quantity, &
        description, every_time, everywhere, of_references, compute=compute))
    end subroutine vector

  end subroutine list_reference_fields

end module reference_fields_mod
