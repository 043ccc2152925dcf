!> Obstacles that press from inside a body: they passed a point within an increment, so that the
!> closest point flipped to their far side, or came by another way. docs/theory.md (9.10).
module passed_obstacles_mod
  use kinds_mod, only: wp
  use connectivity_mod, only: corners_in
  use face_overlap_mod, only: doubled_area
  use obstacles_mod, only: obstacle_t
  use obstacle_shapes_mod, only: shift_of, turned, has_meshed_master
  use surfaces_mod, only: split_faces
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t
  use placement_mod, only: placement_t, place
  implicit none
  private

  public :: find_passed, part_that_would_do

  real(wp), parameter :: behind = 0.2_wp
  !! cosine of the angle between a face's outward normal and a contact normal from behind it,
  !! (9.10): at the rim of a block that is pressed from its side it is 0, or a little more [-]

contains

  !> The first point on which an obstacle presses from inside the body: the contact normal points
  !> out of the faces there, or, where a surface has none, turns by more than 90 degrees in the
  !> increment. 0: there is no such point.
  pure integer function find_passed(scene, points, placement, old, new) result(passed)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(placement_t), intent(in) :: placement !! at the displacement of `new`
    type(state_t), intent(in) :: old, new      !! the increment's beginning and end
    real(wp), allocatable :: outward(:, :)     !! (3,n_nodes) 0 without faces [-]
    real(wp), allocatable :: first_normal(:, :) !! (3,n_points) of the pair, when it begins [-]
    integer :: pair, i

    passed = 0
    allocate (outward(3, 0))
    do pair = 1, size(scene%pairs)
      associate (first => points%first(pair), last => points%first(pair + 1) - 1)
        if (scene%pairs(pair)%master == 0 .or. has_meshed_master(scene, pair)) cycle
        if (.not. any(abs(new%reaction(:, first:last)) > 0.0_wp)) cycle
        outward = outward_normals(scene, pair, new%displacement)
        if (allocated(first_normal)) deallocate (first_normal)
        do i = first, last
          if (.not. any(abs(new%reaction(:, i)) > 0.0_wp)) cycle
          associate (normal => placement%frame(:, 1, i), out => outward(:, points%node(i)))
            if (any(abs(out) > 0.0_wp)) then
              if (dot_product(normal, out) <= behind) cycle
            else if (scene%obstacles(scene%pairs(pair)%master)%inner) then
              cycle
            else
              if (.not. allocated(first_normal)) first_normal = normals_in(scene, points, pair, &
                old, placement)
              if (dot_product(normal, first_normal(:, i)) >= 0.0_wp) cycle
            end if
          end associate
          passed = i
          return
        end do
      end associate
    end do
  end function find_passed

  !> The contact normals of a pair in another state than that of a placement.
  pure function normals_in(scene, points, pair, state, placement) result(normals)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair
    type(state_t), intent(in) :: state
    type(placement_t), intent(in) :: placement
    real(wp) :: normals(3, points%n)  !! those of other pairs are the placement's [-]
    type(placement_t) :: there

    there = placement
    call place(scene, points, pair, state%displacement, there, state%rotation)
    normals = there%frame(:, 1, :)
  end function normals_in

  !> A pair's obstacle as it has turned.
  pure type(obstacle_t) function as_it_stands(scene, pair, state) result(obstacle)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: pair
    type(state_t), intent(in) :: state

    associate (master => scene%pairs(pair)%master)
      obstacle = scene%obstacles(master)
      if (obstacle%turns) obstacle = turned(scene%obstacles(master), state%rotation(:, master), &
        scene%mesh%coordinates(:, obstacle%ref_node))
    end associate
  end function as_it_stands

  !> Unit normals of a pair's slave surface at its nodes, means over their faces; 0 elsewhere.
  pure function outward_normals(scene, pair, u) result(outward)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: pair
    real(wp), intent(in) :: u(:, :)             !! (3,n_nodes) [length]
    real(wp) :: outward(3, scene%mesh%n_nodes)  !! [-]
    real(wp) :: normal(3)
    integer, allocatable :: faces(:, :), whole(:)
    integer :: f, k

    outward = 0.0_wp
    associate (surface => scene%surfaces(scene%pairs(pair)%surface))
      if (.not. allocated(surface%faces)) return
      call split_faces(surface%faces, scene%mesh%connectivity, faces, whole)
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
  !> relative to it; 1 where parts help no more, as the obstacle is inside the body when it begins.
  pure real(wp) function part_that_would_do(scene, points, passed, old, new, placement) &
    result(part)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: passed          !! the point
    type(state_t), intent(in) :: old, new
    type(placement_t), intent(in) :: placement !! at the displacement of `new`
    real(wp) :: outward(3, scene%mesh%n_nodes), first_normal(3, points%n), way(3)
    type(obstacle_t) :: at_old, at_new

    associate (pair => points%pair(passed), node => points%node(passed))
      outward = outward_normals(scene, pair, old%displacement)
      part = 1.0_wp
      first_normal = normals_in(scene, points, pair, old, placement)
      if (dot_product(first_normal(:, passed), outward(:, node)) > behind .and. &
        dot_product(first_normal(:, passed), placement%frame(:, 1, passed)) > 0.0_wp) return
      part = 0.5_wp
      at_old = as_it_stands(scene, pair, old)
      at_new = as_it_stands(scene, pair, new)
      if (.not. at_new%radius > 0.0_wp) return
      way = at_new%point + shift_of(at_new, new%displacement) - new%displacement(:, node) - &
        (at_old%point + shift_of(at_old, old%displacement) - old%displacement(:, node))
      part = min(part, 0.5_wp*at_new%radius/max(norm2(way), tiny(1.0_wp)))
    end associate
  end function part_that_would_do

end module passed_obstacles_mod
