!> Surfaces and facets that slave faces pass within an increment: nothing touches as it begins or
!> ends, but they overlap in between. docs/theory.md section 10.
module passed_faces_mod
  use kinds_mod, only: wp
  use cells_mod, only: face_corners
  use obstacles_mod, only: obstacle_t
  use obstacle_shapes_mod, only: shift_of, turned, is_before_faces
  use connectivity_mod, only: corners_in
  use face_overlap_mod, only: outward_normal
  use pair_faces_mod, only: can_touch, touches_itself
  use self_contact_mod, only: look_along_normals
  use surfaces_mod, only: nodes_of
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t, is_pair_removed
  use state_mod, only: state_t
  use placement_mod, only: placement_t, place, place_undeformed
  use surface_reach_mod, only: reach_of_faces
  use faces_between_nodes_mod, only: face_entry_t, entries_t, take_passed
  implicit none
  private

  public :: find_passed_faces

  integer, parameter :: most_samples = 64 !! of the way in an increment

contains

  !> Add the deepest overlap on the way that is much deeper than at its ends, of pairs before faces
  !> in which nothing presses at the increment's end. Small sliding follows none.
  !>
  !> The way is looked at where the surfaces are no farther apart than they are long, at least once
  !> on each half of the smaller of their largest faces.
  subroutine find_passed_faces(scene, points, old, new, fit, allowed, entries)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(state_t), intent(in) :: old, new  !! the increment's beginning and end
    real(wp), intent(in) :: fit(:)      !! (n_pairs) what meshes alone overlap by [length]
    real(wp), intent(in) :: allowed        !! what is no overlap [length]
    type(entries_t), intent(inout) :: entries
    type(placement_t) :: between
    integer :: pair

    do pair = 1, size(scene%pairs)
      associate (of => scene%pairs(pair), first => points%first(pair), &
                 last => points%first(pair + 1) - 1)
        if (of%small_sliding .or. .not. is_before_faces(of, scene%obstacles)) cycle
        if (is_pair_removed(points, pair)) cycle
        if (touches_itself(points, pair)) call look_at_itself(pair)
        if (any(abs(new%reaction(:, first:last)) > 0.0_wp)) cycle
        call look_along_way(pair, any(abs(old%reaction(:, first:last)) > 0.0_wp))
      end associate
    end do

  contains

    subroutine look_along_way(pair, presses_before)
      integer, intent(in) :: pair
      logical, intent(in) :: presses_before
      real(wp), allocatable, dimension(:, :) :: slave_old, slave_new, master_old, master_new
      !! (3,n) [length]
      real(wp) :: way, step, near, s, deepest, at_ends
      integer :: n, k, worst, at

      call get_places(scene, points, pair, old%displacement, old%rotation, slave_old, master_old)
      call get_places(scene, points, pair, new%displacement, new%rotation, slave_new, master_new)
      associate (by_slave => slave_new - slave_old, by_master => master_new - master_old)
        way = norm2(max(maxval(by_slave, 2) - minval(by_master, 2), &
          maxval(by_master, 2) - minval(by_slave, 2)))
      end associate
      step = step_of(scene, pair, slave_old, master_old)
      if (.not. way > step) return
      n = min(most_samples, ceiling(way/step))
      near = min(extent(slave_old), extent(master_old))
      deepest = 0.0_wp
      worst = 0
      do k = 1, n
        s = real(k, wp)/real(n + 1, wp)
        if (are_apart(slave_old + s*(slave_new - slave_old), master_old + s*(master_new - &
          master_old), near)) cycle
        call look(old%displacement + s*(new%displacement - old%displacement), old%rotation + &
          s*(new%rotation - old%rotation), deepest, worst)
      end do
      if (worst == 0) return
      at_ends = 0.0_wp
      call look(old%displacement, old%rotation, at_ends, at)
      call look(new%displacement, new%rotation, at_ends, at)
      if (.not. deepest > 2.0_wp*at_ends + allowed) return
      call take_passed(face_entry_t(deepest, pair, face_of(worst)), .not. presses_before, entries)
    end subroutine look_along_way

    !> Faces of one side, or of none, that see each other on their way, meet before they are looked
    !> at again, and end behind each other: contact has no rows for them, as they did not see each
    !> other where the increment began.
    subroutine look_at_itself(pair)
      integer, intent(in) :: pair
      real(wp), dimension(3, scene%mesh%n_nodes) :: from, way, x !! [length]
      real(wp), allocatable, dimension(:, :) :: normal, at_end, middle, moved !! (3,n_faces)
      real(wp), allocatable :: distance(:)
      integer, allocatable :: corner(:, :), seen(:, :)
      type(face_entry_t) :: worst
      real(wp) :: step, depth
      integer :: k, n, i

      from = scene%mesh%coordinates + old%displacement
      way = new%displacement - old%displacement
      associate (nodes => scene%surfaces(scene%pairs(pair)%surface)%nodes)
        step = step_of(scene, pair, from(:, nodes), from(:, nodes))
        n = min(most_samples, floor(norm2(maxval(way(:, nodes), 2) - minval(way(:, nodes), &
          2))/step))
      end associate
      corner = nodes_of(scene%surfaces(scene%pairs(pair)%surface)%faces, scene%mesh%connectivity)
      if (n > 0) call find_planes(corner, from + way, at_end, middle)
      do k = 0, n - 1
        x = from + real(k, wp)/real(n, wp)*way
        call find_planes(corner, x, normal, moved)
        moved = (middle - moved)/real(n - k, wp)
        call look_along_normals(x, corner, normal, seen, distance)
        do i = 1, size(distance)
          associate (one => seen(1, i), other => seen(2, i))
            if (can_touch(points, pair, one, other)) cycle
            if (dot_product(normal(:, one), moved(:, one) - moved(:, other)) < distance(i)) cycle
            depth = dot_product(at_end(:, other), middle(:, other) - middle(:, one))
            if (depth > max(allowed, worst%depth)) worst = face_entry_t(depth, pair, &
              corner(:, one))
          end associate
        end do
      end do
      if (worst%depth > 0.0_wp) call take_passed(worst, .true., entries)
    end subroutine look_at_itself

    !> How deep the pair overlaps at one place of its way, where that is deeper than so far.
    subroutine look(u, rotation, deepest, worst)
      real(wp), intent(in) :: u(:, :)         !! (3,n_nodes) [length]
      real(wp), intent(in) :: rotation(:, :)  !! (3,n_obstacles) [rad]
      real(wp), intent(inout) :: deepest      !! [length]
      integer, intent(inout) :: worst         !! point
      integer :: i
      real(wp) :: depth

      if (.not. allocated(between%gap)) call place_undeformed(scene, points, between)
      call place(scene, points, pair, u, between, rotation)
      do i = points%first(pair), points%first(pair + 1) - 1
        depth = -min(between%least_gap(i), between%unplaced_gap(i)) - fit(pair)
        if (.not. depth > max(allowed, deepest)) cycle
        deepest = depth
        worst = i
      end do
    end subroutine look

    !> A slave face of a point.
    pure function face_of(point) result(nodes)
      integer, intent(in) :: point
      integer :: nodes(face_corners)
      integer, allocatable :: faces(:, :)
      integer :: f

      allocate (faces, source=nodes_of(scene%surfaces(scene%pairs(points%pair(point))% &
        surface)%faces, scene%mesh%connectivity))
      f = findloc(any(faces == points%node(point), 1), .true., dim=1)
      nodes = faces(:, f)
    end function face_of

  end subroutine find_passed_faces

  !> The normals and the middles of faces.
  pure subroutine find_planes(corner, x, normal, middle)
    integer, intent(in) :: corner(:, :) !! (4,n) the fourth is 0 in a triangle
    real(wp), intent(in) :: x(:, :)     !! (3,n_nodes) [length]
    real(wp), allocatable, intent(out) :: normal(:, :), middle(:, :) !! (3,n) [-], [length]
    integer :: f

    allocate (normal(3, size(corner, 2)), middle(3, size(corner, 2)))
    do f = 1, size(corner, 2)
      associate (its => corner(:corners_in(corner(:, f)), f))
        normal(:, f) = outward_normal(x(:, its))
        middle(:, f) = sum(x(:, its), 2)/size(its)
      end associate
    end do
  end subroutine find_planes

  !> Where the nodes of a pair's slave are, and those or the corners of its master.
  pure subroutine get_places(scene, points, pair, u, rotation, slave, master)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair
    real(wp), intent(in) :: u(:, :)         !! (3,n_nodes) [length]
    real(wp), intent(in) :: rotation(:, :)  !! (3,n_obstacles) [rad]
    real(wp), allocatable, intent(out) :: slave(:, :), master(:, :) !! (3,n) [length]
    type(obstacle_t) :: obstacle

    associate (of => scene%pairs(pair), x => scene%mesh%coordinates, &
               node => points%node(points%first(pair):points%first(pair + 1) - 1))
      slave = x(:, node) + u(:, node)
      if (of%master == 0) then
        associate (m => scene%surfaces(of%master_surface)%nodes)
          master = x(:, m) + u(:, m)
        end associate
      else
        obstacle = scene%obstacles(of%master)
        if (obstacle%turns) obstacle = turned(obstacle, rotation(:, of%master), &
          x(:, obstacle%ref_node))
        master = obstacle%corner + spread(shift_of(obstacle, u), 2, size(obstacle%corner, 2))
      end if
    end associate
  end subroutine get_places

  !> Half of the largest face of the slave or of the master, whichever is smaller.
  pure real(wp) function step_of(scene, pair, slave, master) result(step)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: pair
    real(wp), intent(in) :: slave(:, :), master(:, :) !! (3,n) [length]

    associate (of => scene%pairs(pair), mesh => scene%mesh)
      associate (faces => nodes_of(scene%surfaces(of%surface)%faces, mesh%connectivity))
        step = reach_of_faces(faces, faces, mesh%coordinates)
      end associate
      if (of%master == 0) then
        associate (faces => nodes_of(scene%surfaces(of%master_surface)%faces, mesh%connectivity))
          step = min(step, reach_of_faces(faces, faces, mesh%coordinates))
        end associate
      else
        associate (facet => scene%obstacles(of%master)%facet)
          step = min(step, reach_of_faces(facet, facet, master))
        end associate
      end if
    end associate
    ! Facets may be tiny: what they make up is not.
    step = max(step, min(extent(slave), extent(master))/real(most_samples, wp))

  end function step_of

  !> The longest edge of a box around places.
  pure real(wp) function extent(x)
    real(wp), intent(in) :: x(:, :) !! (3,n) [length]

    extent = maxval(maxval(x, 2) - minval(x, 2))
  end function extent

  !> Whether the boxes of two surfaces are farther apart along an axis than a distance.
  pure logical function are_apart(one, other, distance)
    real(wp), intent(in) :: one(:, :), other(:, :) !! (3,n) [length]
    real(wp), intent(in) :: distance               !! [length]

    are_apart = any(max(minval(one, 2) - maxval(other, 2), minval(other, 2) - maxval(one, 2)) > &
      distance)
  end function are_apart

end module passed_faces_mod
