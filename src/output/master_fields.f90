!> What a contact pair's points stand before, as the deck places it: an obstacle's shape, or the
!> nodes of a surface. It does not change: an obstacle moves with its reference node.
module master_fields_mod
  use kinds_mod, only: wp
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
        'nodes of the master: index into Points, from 0', at_start, compute=master_node))
      return
    end if
    call add_field(list, field_t('obstacle_shape', of_long, [1], 'code', shape_codes, at_start, &
      compute=code))
    call add_field(list, field_t('obstacle_inner', of_long, [1], 'code', &
      '1: a sphere or cylinder in which the body lies, else 0', at_start, compute=inner))
    call add_field(list, field_t('obstacle_node', of_long, [1], 'number', &
      'reference node, with which the obstacle moves and about which it turns: index into '// &
      '/reference_nodes, from 0; -1: it is at rest', at_start, compute=node))
    call add_field(list, field_t('obstacle_point', of_real, [3], 'length', &
      'a point of the plane, the centre of the sphere, a point of the cylinder''s axis, in the '// &
      'deck', at_start, compute=point))
    call add_field(list, field_t('obstacle_direction', of_real, [3], 'ratio', &
      'unit normal of the plane towards the body, unit vector along the cylinder''s axis; else 0', &
      at_start, compute=direction))
    call add_field(list, field_t('obstacle_radius', of_real, [1], 'length', &
      'of the sphere or cylinder; else 0', at_start, compute=radius))
    associate (obstacle => scene%obstacles(scene%pairs(i)%master))
      if (.not. is_meshed(obstacle)) return
      call add_field(list, field_t('obstacle_corners', of_real, shape(obstacle%corner), 'length', &
        'corners of the facets, in the deck', at_start, compute=corners))
      call add_field(list, field_t('obstacle_connectivity', of_long, [size(obstacle%facet)], &
        'number', 'four corners a facet, anticlockwise from the side of the body: index into '// &
        'obstacle_corners, from 0; the fourth of a triangle is -1', at_start, &
        compute=connectivity))
      call add_field(list, field_t('obstacle_side', of_long, [size(obstacle%facet, 2)], 'number', &
        'of each facet the side of the obstacle, from 1, as in master_side', at_start, &
        compute=facet_side))
    end associate
  end subroutine add_master_fields

  !> The obstacle of the source's pair.
  pure integer function master_of(source)
    type(field_source_t), intent(in) :: source

    master_of = source%scene%pairs(source%pair)%master
  end function master_of

  subroutine master_node(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (1, nodes of the surface)
    integer :: row(source%scene%mesh%n_nodes)

    row = element_rows(source%scene%mesh)
    values(1, :) = row(source%scene%surfaces(source%scene%pairs(source%pair)% &
      master_surface)%nodes) - 1
  end subroutine master_node

  subroutine code(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (1, 1)

    values = shape_code(source%scene%obstacles(master_of(source)))
  end subroutine code

  subroutine inner(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (1, 1)

    values = merge(1.0_wp, 0.0_wp, source%scene%obstacles(master_of(source))%inner)
  end subroutine inner

  subroutine node(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (1, 1)

    values = findloc(reference_nodes(source%scene), source%scene%obstacles(master_of( &
      source))%ref_node, dim=1) - 1
  end subroutine node

  subroutine point(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (1, 3)

    values(1, :) = source%scene%obstacles(master_of(source))%point + &
      source%scene%mesh%origin
  end subroutine point

  subroutine direction(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (1, 3)

    values(1, :) = source%scene%obstacles(master_of(source))%normal
  end subroutine direction

  subroutine radius(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (1, 1)

    values = source%scene%obstacles(master_of(source))%radius
  end subroutine radius

  subroutine corners(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (3, corners)

    values = source%scene%obstacles(master_of(source))%corner + spread(source%scene%mesh%origin, &
      2, size(values, 2))
  end subroutine corners

  subroutine connectivity(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (1, 4 of each facet)

    associate (obstacle => source%scene%obstacles(master_of(source)))
      values(1, :) = reshape(obstacle%facet, [size(obstacle%facet)]) - 1
    end associate
  end subroutine connectivity

  subroutine facet_side(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (1, facets)

    values = 1.0_wp
    if (n_sides(source%points, source%pair) > 1) values(1, :) = &
      source%points%sides(source%pair)%of_face
  end subroutine facet_side

end module master_fields_mod
