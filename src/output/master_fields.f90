!> What a contact pair's points stand before, as the deck places it: an obstacle's shape, or the
!> nodes of a surface. It does not change: an obstacle moves with its reference node.
module master_fields_mod
  use kinds_mod, only: wp
  use errors_mod, only: raise, exit_machine
  use dataset_kinds_mod, only: of_real, of_long
  use mesh_mod, only: element_rows
  use obstacle_shapes_mod, only: is_meshed, shape_code, shape_codes
  use contact_points_mod, only: n_sides
  use scene_mod, only: scene_t, reference_nodes
  use output_field_mod, only: field_t, field_list_t, field_source_t, add_field, at_start
  implicit none
  private

  public :: add_master_fields

contains

  !> Add the fields of the master of pair i.
  subroutine add_master_fields(scene, i, list)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: i
    type(field_list_t), intent(inout) :: list

    if (scene%pairs(i)%master == 0) then
      call add_field(list, field_t('master_node', of_long, &
        [size(scene%surfaces(scene%pairs(i)%master_surface)%nodes)], 'number', &
        'nodes of the master: index into Points, from 0', at_start, compute=of_master))
      return
    end if
    call add_field(list, field_t('obstacle_shape', of_long, [1], 'code', shape_codes, at_start, &
      compute=of_master))
    call add_field(list, field_t('obstacle_inner', of_long, [1], 'code', &
      '1: a sphere or cylinder in which the body lies, else 0', at_start, compute=of_master))
    call add_field(list, field_t('obstacle_node', of_long, [1], 'number', &
      'reference node, with which the obstacle moves and about which it turns: index into '// &
      '/reference_nodes, from 0; -1: it is at rest', at_start, compute=of_master))
    call add_field(list, field_t('obstacle_point', of_real, [3], 'length', &
      'a point of the plane, the centre of the sphere, a point of the cylinder''s axis, in the '// &
      'deck', at_start, compute=of_master))
    call add_field(list, field_t('obstacle_direction', of_real, [3], 'ratio', &
      'unit normal of the plane towards the body, unit vector along the cylinder''s axis; else 0', &
      at_start, compute=of_master))
    call add_field(list, field_t('obstacle_radius', of_real, [1], 'length', &
      'of the sphere or cylinder; else 0', at_start, compute=of_master))
    associate (obstacle => scene%obstacles(scene%pairs(i)%master))
      if (.not. is_meshed(obstacle)) return
      call add_field(list, field_t('obstacle_corners', of_real, shape(obstacle%corner), 'length', &
        'corners of the facets, in the deck', at_start, compute=of_master))
      call add_field(list, field_t('obstacle_connectivity', of_long, [size(obstacle%facet)], &
        'number', 'four corners a facet, anticlockwise from the side of the body: index into '// &
        'obstacle_corners, from 0; the fourth of a triangle is -1', at_start, &
        compute=of_master))
      call add_field(list, field_t('obstacle_side', of_long, [size(obstacle%facet, 2)], 'number', &
        'of each facet the side of the obstacle, from 1, as in master_side', at_start, &
        compute=of_master))
    end associate
  end subroutine add_master_fields

  !> A field of the master of the source's pair, by its name.
  subroutine of_master(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! a column a node, corner or facet; or one
    integer :: row(source%scene%mesh%n_nodes)

    associate (pair => source%scene%pairs(source%pair), mesh => source%scene%mesh)
      if (source%name == 'master_node') then
        row = element_rows(mesh)
        values(1, :) = row(source%scene%surfaces(pair%master_surface)%nodes) - 1
        return
      end if
      associate (obstacle => source%scene%obstacles(pair%master))
        select case (source%name)
        case ('obstacle_shape')
          values = shape_code(obstacle)
        case ('obstacle_inner')
          values = merge(1.0_wp, 0.0_wp, obstacle%inner)
        case ('obstacle_node')
          values = findloc(reference_nodes(source%scene), obstacle%ref_node, dim=1) - 1
        case ('obstacle_point')
          values(1, :) = obstacle%point + mesh%origin
        case ('obstacle_direction')
          values(1, :) = obstacle%normal
        case ('obstacle_radius')
          values = obstacle%radius
        case ('obstacle_corners')
          values = obstacle%corner + spread(mesh%origin, 2, size(values, 2))
        case ('obstacle_connectivity')
          values(1, :) = reshape(obstacle%facet, [size(obstacle%facet)]) - 1
        case ('obstacle_side')
          values = 1.0_wp
          if (n_sides(source%points, source%pair) > 1) values(1, :) = &
            source%points%sides(source%pair)%of_face
        case default
          call raise(source%error, exit_machine, 'internal error: '//source%name//' of a master')
        end select
      end associate
    end associate
  end subroutine of_master

end module master_fields_mod
