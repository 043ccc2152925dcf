!> The fields over the mesh, which ParaView shows: entries, and how each is computed.
module view_fields_mod
  use kinds_mod, only: wp
  use errors_mod, only: raise, exit_machine
  use dataset_kinds_mod, only: of_real, of_byte, of_long
  use scene_mod, only: scene_t
  use local_refinement_mod, only: parents_of
  use contact_at_nodes_mod, only: add_contact_forces, add_contact_pressures
  use tensor_fields_mod, only: add_tensor_fields, asked_tensors, at_nodes, at_centroids
  use output_field_mod, only: field_t, field_list_t, field_source_t, add_field, get_fields, &
    every_time, at_start, at_supports, at_contact, of_elements
  use sectors_mod, only: turn_into_plane
  use nodal_fields_mod, only: node_id, displacement, velocity, acceleration, reaction_force, &
    applied_force
  implicit none
  private

  public :: list_view_fields

  character(*), parameter :: from_gauss_points = &
    '; extrapolated from the Gauss points, averaged over the elements at the node'
  integer, parameter :: no_contact = -1 !! status of a node without a contact point

contains

  !> The fields over the nodes (PointData) and the elements (CellData) that the deck asks for.
  subroutine list_view_fields(scene, has_contact, fields)
    type(scene_t), intent(in) :: scene
    logical, intent(in) :: has_contact !! the run has contact points
    type(field_t), allocatable, intent(out) :: fields(:)
    type(field_list_t) :: list
    integer :: i

    associate (n => size(scene%mesh%element_nodes), asked => scene%output)
      if (asked%displacement) call add_field(list, field_t('PointData/displacement', of_real, &
        [3, n], 'length', 'from the undeformed mesh, x, y, z', compute=displacement))
      if (any(scene%steps%is_dynamic)) then
        call add_field(list, field_t('PointData/velocity', of_real, [3, n], 'velocity', &
          'at the end of the increment, x, y, z', compute=velocity))
        call add_field(list, field_t('PointData/acceleration', of_real, [3, n], 'acceleration', &
          'at the end of the increment, x, y, z; 0 of nodes without mass', compute=acceleration))
      end if
      if (asked%reaction) call add_field(list, field_t('PointData/reaction_force', of_real, &
        [3, n], 'force', 'of the supports on the body, x, y, z', every_time, at_supports, &
        compute=reaction_force))
      if (asked%loads) call add_field(list, field_t('PointData/applied_force', of_real, [3, n], &
        'force', 'of the loads on the bodies, thermal expansion included, x, y, z', &
        compute=applied_force))
      if (asked%contact .and. has_contact) then
        call add_field(list, field_t('PointData/contact_force', of_real, [3, n], 'force', &
          'of contact on the bodies, x, y, z', every_time, at_contact, &
          compute=contact_force))
        call add_field(list, field_t('PointData/contact_pressure', of_real, [n], 'pressure', &
          'normal reaction over the area of the node', every_time, at_contact, &
          compute=contact_pressure))
        call add_field(list, field_t('PointData/contact_status', of_byte, [n], 'code', &
          '0: open, 1: stick, 2: slide, -1: no slave node', every_time, at_contact, &
          compute=contact_status))
      end if
      if (asked%penetration .and. has_contact) call add_field(list, &
        field_t('PointData/contact_penetration', of_real, [n], 'length', &
        'of the node, or the deepest of the faces about it before a master of faces; 0: none', &
        every_time, at_contact, compute=contact_penetration))
      if (asked%at_nodes) then
        call add_tensor_fields(list, asked_tensors(asked), 'PointData/', [n], at_nodes, &
          [character(80) :: from_gauss_points, '; of the average at the node'], 0)
      end if
      call add_field(list, field_t('PointData/node_id', of_long, [n], 'number', &
        'ids of the nodes in the deck', at_start, compute=node_id))
    end associate

    associate (n => scene%mesh%n_elements, asked => scene%output)
      if (asked%at_centroids) then
        call add_tensor_fields(list, asked_tensors(asked), 'CellData/', [n], at_centroids, &
          [character(30) :: '; mean of the element', '; of the mean of the element'], 0)
      end if
      if (asked%mesh_error) call add_field(list, field_t('CellData/mesh_error', of_real, [n], &
        'energy', 'error of the stresses in the energy norm, squared, by recovery', &
        compute=mesh_error))
      call add_field(list, field_t('CellData/element_id', of_long, [n], 'number', &
        'ids of the elements in the deck', at_start, compute=element_id))
    end associate
    call get_fields(list, fields)
    do i = 1, size(fields)
      if (index(fields(i)%name, 'PointData/') == 1) fields(i)%nodes = of_elements
    end do

  end subroutine list_view_fields

  subroutine contact_force(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (3, n_nodes)

    call add_contact_forces(source%scene, source%points, source%state, source%report%contact, &
      values)
    call turn_into_plane(source%scene%mesh, values)
  end subroutine contact_force

  !> Points that share a node add up. A node that hangs has none: between others, it has their mean.
  subroutine contact_pressure(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (1, n_nodes)
    integer :: i

    call add_contact_pressures(source%points, source%report%contact, values(1, :), .true.)
    associate (mesh => source%scene%mesh)
      if (.not. allocated(mesh%hangs)) return
      do i = mesh%n_given + 1, min(size(mesh%hangs), size(values, 2))
        if (.not. mesh%hangs(i)) cycle
        associate (parents => parents_of(mesh%between(:, i - mesh%n_given)))
          values(1, i) = sum(values(1, parents))/real(size(parents), wp)
        end associate
      end do
    end associate
  end subroutine contact_pressure

  !> The status of a node is that of its point which slides, else sticks, else is open.
  subroutine contact_status(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (1, n_nodes)
    integer :: i

    values = no_contact
    do i = 1, source%points%n
      associate (node => source%points%node(i))
        values(1, node) = max(values(1, node), real(source%report%contact%status(i), wp))
      end associate
    end do
  end subroutine contact_status

  !> Of points that share a node the deepest.
  subroutine contact_penetration(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (1, n_nodes)
    integer :: i

    do i = 1, source%points%n
      associate (node => source%points%node(i))
        values(1, node) = max(values(1, node), -source%report%contact%least_gap(i))
      end associate
    end do
  end subroutine contact_penetration

  !> The run estimates it wherever it is due, as it enters the report.
  subroutine mesh_error(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (1, n_elements)

    if (allocated(source%report%mesh_error)) then
      values(1, :) = source%report%mesh_error
    else
      call raise(source%error, exit_machine, 'internal error: mesh_error was not estimated')
    end if
  end subroutine mesh_error

  subroutine element_id(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (1, n_elements)

    values(1, :) = source%scene%mesh%element_id
  end subroutine element_id

end module view_fields_mod
