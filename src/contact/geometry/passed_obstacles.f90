!> Obstacles that pass contact points within an increment, so that the closest point flips to their
!> far side and a reaction would pull. docs/theory.md (9.10).
module passed_obstacles_mod
  use kinds_mod, only: wp
  use connectivity_mod, only: corners_in
  use face_overlap_mod, only: doubled_area
  use obstacles_mod, only: obstacle_t
  use obstacle_shapes_mod, only: shift_of, turned, has_meshed_master
  use surfaces_mod, only: nodes_of
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t
  use placement_mod, only: placement_t, place
  implicit none
  private

  public :: find_passed, part_that_would_do

  real(wp), parameter :: behind = 0.2_wp
  !! cosine of the angle between a face's outward normal and a contact normal from behind it [-]
  real(wp), parameter :: hardly = 0.1_wp !! a turn of a normal that takes it behind no face [rad]

contains

  !> The first point that presses before a curved obstacle and that this pushes out of its body,
  !> while it pushed it inwards when the increment began (where a surface has no faces: whose
  !> contact normal turns by more than 90 degrees); 0: there is none.
  !>
  !> Normals that change gradually are followed: a rim may slide below an obstacle. In a hollow a
  !> point comes from one side to the other without contact, and must not begin to press there.
  pure integer function find_passed(scene, points, placement, old, new) result(passed)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(placement_t), intent(in) :: placement !! at the displacement of `new`
    type(state_t), intent(in) :: old, new      !! the increment's beginning and end
    real(wp) :: outward(3, scene%mesh%n_nodes, 2) !! then and now, 0 without faces [-]
    type(placement_t) :: before                !! at the displacement of `old`
    integer :: pair, i
    logical :: is_inner, presses_anew, has_normals

    passed = 0
    do pair = 1, size(scene%pairs)
      associate (master => scene%pairs(pair)%master, &
                 first => points%first(pair), last => points%first(pair + 1) - 1)
        if (master == 0) cycle
        if (.not. any(points%is_curved(first:last)) .or. has_meshed_master(scene, pair)) cycle
        if (.not. any(abs(new%reaction(:, first:last)) > 0.0_wp)) cycle
        is_inner = scene%obstacles(master)%inner
        if (.not. allocated(before%gap)) before = placement
        call place(scene, points, pair, old%displacement, before, old%rotation)
        has_normals = .false.
        do i = first, last
          if (.not. any(abs(new%reaction(:, i)) > 0.0_wp)) cycle
          associate (node => points%node(i), now => placement%frame(:, 1, i), &
                     then => before%frame(:, 1, i))
            presses_anew = is_inner .and. .not. any(abs(old%reaction(:, i)) > 0.0_wp)
            if (norm2(now - then) <= hardly .and. .not. presses_anew) cycle
            if (.not. has_normals) then
              has_normals = .true.
              outward(:, :, 1) = outward_normals(scene, pair, old%displacement)
              outward(:, :, 2) = outward_normals(scene, pair, new%displacement)
            end if
            if (any(abs(outward(:, node, 2)) > 0.0_wp)) then
              if (dot_product(now, outward(:, node, 2)) <= behind) cycle
              if (dot_product(then, outward(:, node, 1)) > 0.0_wp .and. .not. presses_anew) cycle
            else if (is_inner .or. dot_product(then, now) >= 0.0_wp) then
              cycle
            end if
          end associate
          passed = i
          return
        end do
      end associate
    end do
  end function find_passed

  !> Unit normals of a pair's slave surface at its nodes, means over their faces; 0 elsewhere.
  pure function outward_normals(scene, pair, u) result(outward)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: pair
    real(wp), intent(in) :: u(:, :)             !! (3,n_nodes) [length]
    real(wp) :: outward(3, scene%mesh%n_nodes)  !! [-]
    real(wp) :: normal(3)
    integer, allocatable :: faces(:, :)
    integer :: f, k

    outward = 0.0_wp
    associate (surface => scene%surfaces(scene%pairs(pair)%surface))
      if (.not. allocated(surface%faces)) return
      faces = nodes_of(surface%faces, scene%mesh%connectivity)
      do f = 1, size(faces, 2)
        associate (nodes => faces(:corners_in(faces(:, f)), f))
          normal = doubled_area(scene%mesh%coordinates(:, nodes) + u(:, nodes))
          do k = 1, size(nodes)
            outward(:, nodes(k)) = outward(:, nodes(k)) + normal
          end do
        end associate
      end do
      do k = 1, size(surface%nodes)
        associate (at => outward(:, surface%nodes(k)))
          if (norm2(at) > 0.0_wp) at = at/norm2(at)
        end associate
      end do
    end associate
  end function outward_normals

  !> The part of an increment in which a point moves half the radius of the obstacle that it passes,
  !> relative to it.
  pure real(wp) function part_that_would_do(scene, points, passed, old, new) result(part)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: passed          !! the point
    type(state_t), intent(in) :: old, new
    real(wp) :: way(3), at_old(3), at_new(3), radius
    type(obstacle_t) :: obstacle

    associate (master => scene%pairs(points%pair(passed))%master, node => points%node(passed))
      obstacle = scene%obstacles(master)
      radius = obstacle%radius
      at_old = obstacle%point
      at_new = obstacle%point
      if (obstacle%turns) then
        obstacle = turned(scene%obstacles(master), old%rotation(:, master), &
          scene%mesh%coordinates(:, obstacle%ref_node))
        at_old = obstacle%point
        obstacle = turned(scene%obstacles(master), new%rotation(:, master), &
          scene%mesh%coordinates(:, obstacle%ref_node))
        at_new = obstacle%point
      end if
      way = at_new + shift_of(obstacle, new%displacement) - new%displacement(:, node) - &
        (at_old + shift_of(obstacle, old%displacement) - old%displacement(:, node))
      part = min(0.5_wp, 0.5_wp*radius/max(norm2(way), tiny(1.0_wp)))
    end associate
  end function part_that_would_do

end module passed_obstacles_mod
