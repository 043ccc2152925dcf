!> Gaps, normals, slips and local reactions before planes, spheres and cylinders, from where nodes
!> and obstacles are. docs/theory.md sections 6 and 9.
module obstacle_gaps_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: cross
  use obstacles_mod, only: obstacle_t, obstacle_plane, obstacle_sphere, obstacle_cylinder
  use scene_mod, only: scene_t
  use sectors_mod, only: without_turn
  use contact_points_mod, only: contact_points_t, is_pair_removed
  use state_mod, only: state_t
  use increment_report_mod, only: contact_fields_t
  use turned_slips_mod, only: orientation
  use edge_middles_mod, only: edge_middles_t, find_edge_middles, at_point, vector_at_point
  implicit none
  private

  public :: face_obstacles, find_closest, frame_of, has_closest_point, rounding_of_places, &
    rounding_at_rest

contains

  !> Replace frames, gaps, reactions and slips of the points before these obstacles by the
  !> certificate's own. Points before facets and surfaces stay as they are.
  pure subroutine face_obstacles(scene, points, old, new, contact)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(state_t), intent(in) :: old, new
    type(contact_fields_t), intent(inout) :: contact
    type(edge_middles_t) :: middles
    real(wp) :: axes(3, 3), place(3), along(3), moved(3), way(3), gap, normal(3), rounding
    integer :: pair, i

    rounding = rounding_at_rest(scene)
    call find_edge_middles(scene, points, contact%weights, middles)
    do pair = 1, size(scene%pairs)
      if (scene%pairs(pair)%master == 0 .or. is_pair_removed(points, pair)) cycle
      associate (obstacle => scene%obstacles(scene%pairs(pair)%master), &
                 turn => new%rotation(:, scene%pairs(pair)%master))
        if (.not. has_closest_point(obstacle)) cycle
        place = obstacle%point
        along = obstacle%normal
        moved = 0.0_wp
        way = 0.0_wp
        if (obstacle%ref_node > 0) then
          associate (pivot => scene%mesh%coordinates(:, obstacle%ref_node))
            moved = new%displacement(:, obstacle%ref_node)
            way = moved - old%displacement(:, obstacle%ref_node)
            if (any(abs(turn) > 0.0_wp)) then
              axes = orientation(turn)
              place = pivot + matmul(axes, place - pivot)
              along = matmul(axes, along)
            end if
          end associate
        end if
        do i = points%first(pair), points%first(pair + 1) - 1
          associate (node => points%node(i), frame => contact%frame(:, :, i))
            normal = along
            if (obstacle%kind /= obstacle_plane) normal = frame(:, 1)
            call find_closest(obstacle, along, scene%mesh%coordinates(:, node) - place, &
              new%displacement(:, node) - moved, rounding, gap, normal)
            frame = frame_of(normal)
            contact%gap(i) = gap + points%extra_gap(i)
            contact%reaction(:, i) = matmul(new%reaction(:, i), frame)
            contact%slip_increment(:, i) = matmul(without_turn(scene%mesh, node, .false., &
              vector_at_point(middles, node, i, new%displacement) - vector_at_point(middles, &
              node, i, old%displacement) - way), frame(:, 2:))
          end associate
        end do
      end associate
    end do
    if (.not. middles%is_any) return
    do i = 1, points%n
      if (points%on_surface(i)) cycle
      if (middles%a(i) > 0.0_wp) contact%gap(i) = at_point(middles%a(i), contact%gap(i), &
        contact%gap(middles%ends(1, i)), contact%gap(middles%ends(2, i)))
    end do
  end subroutine face_obstacles

  !> Whether a node has a gap by itself: facets give means over the faces about it.
  elemental logical function has_closest_point(obstacle)
    type(obstacle_t), intent(in) :: obstacle

    has_closest_point = obstacle%kind == obstacle_plane .or. obstacle%kind == obstacle_sphere .or. &
      obstacle%kind == obstacle_cylinder
  end function has_closest_point

  !> The signed distance of a point from an obstacle, and the unit normal towards it. At a centre or
  !> on an axis any normal will do: the one that was there stays.
  !>
  !> It is that of the mesh, of which rounding is none, and what motion changes it by: so small
  !> motions keep their digits. docs/theory.md (12.4).
  pure subroutine find_closest(obstacle, axis, arm, way, rounding, gap, normal)
    type(obstacle_t), intent(in) :: obstacle
    real(wp), intent(in) :: axis(3)   !! normal of a plane, axis of a cylinder, as turned [-]
    real(wp), intent(in) :: arm(3)    !! from the obstacle's point to that of the mesh [length]
    real(wp), intent(in) :: way(3)    !! motion beside the obstacle's [length]
    real(wp), intent(in) :: rounding  !! of distances in the mesh [length]
    real(wp), intent(out) :: gap      !! [length]
    real(wp), intent(inout) :: normal(3) !! [-]
    real(wp) :: from(3), across(3), far, distance, inwards, change

    inwards = merge(-1.0_wp, 1.0_wp, obstacle%inner)
    select case (obstacle%kind)
    case (obstacle_plane)
      inwards = 1.0_wp
      gap = dot_product(axis, arm)
      change = dot_product(axis, way)
    case default
      from = arm
      across = way
      if (obstacle%kind == obstacle_cylinder) then
        from = from - dot_product(axis, from)*axis
        across = across - dot_product(axis, across)*axis
      end if
      far = norm2(from)
      distance = norm2(from + across)
      gap = far - obstacle%radius
      change = distance - far
      if (distance > 0.0_wp) then
        change = dot_product(across, 2.0_wp*from + across)/(distance + far)
        normal = inwards*((from + across)/distance)
      end if
    end select
    if (abs(gap) <= rounding) gap = 0.0_wp
    gap = inwards*(gap + change)
  end subroutine find_closest

  !> A normal with two tangents.
  pure function frame_of(normal) result(frame)
    real(wp), intent(in) :: normal(3)  !! unit vector
    real(wp) :: frame(3, 3)            !! columns
    real(wp) :: axis(3)

    axis = 0.0_wp
    axis(minloc(abs(normal), dim=1)) = 1.0_wp
    frame(:, 1) = normal
    frame(:, 2) = cross(normal, axis)
    frame(:, 2) = frame(:, 2)/norm2(frame(:, 2))
    frame(:, 3) = cross(normal, frame(:, 2))
  end function frame_of

  !> How much gaps are rounded by [length]: they are differences of coordinates.
  pure real(wp) function rounding_of_places(scene, u) result(rounding)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: u(:, :)      !! (3,n_nodes) [length]

    rounding = 8.0_wp*epsilon(1.0_wp)*max(maxval(abs(scene%mesh%coordinates)) + maxval(abs(u)), &
      farthest_obstacle(scene))
  end function rounding_of_places

  !> Gaps that are none in the mesh [length]: coordinates are rounded.
  pure real(wp) function rounding_at_rest(scene) result(rounding)
    type(scene_t), intent(in) :: scene

    rounding = 16.0_wp*epsilon(1.0_wp)*max(maxval(abs(scene%mesh%coordinates)), &
      farthest_obstacle(scene))
  end function rounding_at_rest

  !> How far places on obstacles are from the origin [length].
  pure real(wp) function farthest_obstacle(scene) result(far)
    type(scene_t), intent(in) :: scene
    integer :: i

    far = 0.0_wp
    do i = 1, size(scene%obstacles)
      associate (obstacle => scene%obstacles(i))
        far = max(far, maxval(abs(obstacle%point)) + obstacle%radius)
        if (allocated(obstacle%corner)) far = max(far, maxval(abs(obstacle%corner)))
      end associate
    end do
  end function farthest_obstacle

end module obstacle_gaps_mod
