!> Planes of symmetry of pairs before faces, found by their supports. docs/theory.md section 11.
!>
!> The weights of a point on such a plane reach nodes beside it, whose motion across the plane is
!> none of the plane's, and its normal is a mean over the faces of one side: across the plane the
!> normal has no part, and no friction acts.
module symmetry_planes_mod
  use kinds_mod, only: wp
  use mesh_mod, only: deck_rounding, joined_nodes
  use surfaces_mod, only: nodes_of
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use obstacle_shapes_mod, only: is_before_faces
  use mirror_planes_mod, only: is_mirrored
  implicit none
  private

  public :: find_symmetry_planes

  real(wp), parameter :: rounding = 1.0e-9_wp !! of the size of the mesh: nodes on one plane

contains

  !> Mark the points that lie on planes of symmetry, whether or not they can reach their masters.
  pure subroutine find_symmetry_planes(scene, points)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(inout) :: points !! gets across
    logical, allocatable :: held(:, :)
    logical :: is_single(scene%mesh%n_nodes) !! without elements: its place says nothing
    integer, allocatable :: masters(:)       !! nodes of the pair's master; none of facets
    real(wp) :: side(2), close_by
    integer :: pair, axis, i, k

    points%across = .false.
    if (scene%mesh%sector_angle > 0.0_wp) call find_axis(scene, points)
    if (.not. any(points%on_surface)) return
    held = held_at_rest(scene)
    is_single = joined_nodes(scene%mesh)
    associate (x => scene%mesh%coordinates)
      close_by = max(rounding*maxval(maxval(x, dim=2) - minval(x, dim=2)), 16.0_wp* &
        deck_rounding(x, scene%mesh%origin))
      do pair = 1, size(scene%pairs)
        if (.not. is_before_faces(scene%pairs(pair), scene%obstacles)) cycle
        masters = masters_of(pair)
        do axis = 1, 3
          associate (nodes => [scene%surfaces(scene%pairs(pair)%surface)%nodes, masters])
            side = [minval(x(axis, nodes)), maxval(x(axis, nodes))]
          end associate
          do k = 1, 2
            if (.not. is_symmetric(pair, axis, side(k))) cycle
            do i = points%first(pair), points%first(pair + 1) - 1
              if (abs(x(axis, points%node(i)) - side(k)) <= close_by) points%across(axis, i) = &
                .true.
            end do
          end do
        end do
      end do
    end associate
    ! On the axis of a body of revolution all directions across it are alike.
    if (scene%mesh%sector_angle > 0.0_wp) points%across(3, :) = points%across(1, :)

  contains

    !> The nodes of a body's surface.
    pure function masters_of(pair) result(nodes)
      integer, intent(in) :: pair
      integer, allocatable :: nodes(:)

      nodes = [integer ::]
      if (scene%pairs(pair)%master == 0) nodes = scene%surfaces(scene%pairs(pair)% &
        master_surface)%nodes
    end function masters_of

    !> Whether all of both surfaces that lies on a plane is held across it, and not all of the slave
    !> surface is; and the same of the bodies. Facets are cut by the plane, or their own mirror
    !> image.
    pure logical function is_symmetric(pair, axis, place)
      integer, intent(in) :: pair, axis
      real(wp), intent(in) :: place !! of the plane along the axis [length]
      logical :: on_plane(scene%mesh%n_nodes), of_pair(scene%mesh%n_nodes)
      integer :: bodies(scene%mesh%n_bodies), j

      is_symmetric = .false.
      associate (slaves => scene%surfaces(scene%pairs(pair)%surface)%nodes, mesh => scene%mesh)
        if (all(held(axis, slaves))) return
        bodies = 0
        bodies(mesh%body(slaves)) = 1
        bodies(mesh%body(masters)) = 1
        of_pair = .false.
        do j = 1, mesh%n_nodes
          if (mesh%body(j) > 0 .and. .not. is_single(j)) of_pair(j) = bodies(mesh%body(j)) == 1
        end do
        on_plane = abs(mesh%coordinates(axis, :) - place) <= close_by .and. of_pair
        if (.not. all(held(axis, :) .or. .not. on_plane)) return
        if (.not. any(on_plane(slaves))) return
        if (size(masters) > 0 .and. .not. any(on_plane(masters))) return
        ! Bodies on one side of it.
        if (any(of_pair .and. mesh%coordinates(axis, :) < place - close_by) .and. &
          any(of_pair .and. mesh%coordinates(axis, :) > place + close_by)) return
      end associate
      is_symmetric = .true.
      if (scene%pairs(pair)%master > 0) is_symmetric = stays_on_plane(pair, axis) .and. &
        is_mirrored(nodes_of(scene%surfaces(scene%pairs(pair)%surface)%faces, &
        scene%mesh%connectivity), scene%mesh%coordinates, scene%obstacles(scene%pairs( &
        pair)%master), axis, place)
    end function is_symmetric

    !> Whether the obstacle of a pair is held across a plane, and turns about the normal of that at
    !> most.
    pure logical function stays_on_plane(pair, axis)
      integer, intent(in) :: pair, axis
      integer :: step, j

      stays_on_plane = .true.
      associate (node => scene%obstacles(scene%pairs(pair)%master)%ref_node)
        if (node == 0) return
        stays_on_plane = held(axis, node)
        do step = 1, size(scene%steps)
          if (.not. allocated(scene%steps(step)%rotations)) cycle
          do j = 1, size(scene%steps(step)%rotations)
            associate (r => scene%steps(step)%rotations(j))
              if (r%node == node .and. r%dof /= axis .and. abs(r%value) > 0.0_wp) stays_on_plane &
                = .false.
            end associate
          end do
        end do
      end associate
    end function stays_on_plane

  end subroutine find_symmetry_planes

  !> Mark the points before obstacles on the axis of a body of revolution: nothing slips there.
  pure subroutine find_axis(scene, points)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(inout) :: points
    real(wp), parameter :: close_by = 1.0e-6_wp
    !! of the largest radius: as far as nodes on the axis are moved off it, at most [-]
    real(wp) :: radius(scene%mesh%n_nodes)

    associate (x => scene%mesh%coordinates, origin => scene%mesh%origin)
      radius = hypot(x(1, :) + origin(1), x(3, :) + origin(3))
    end associate
    points%across(1, :) = .not. points%on_surface .and. radius(points%node) <= close_by* &
      maxval(radius, mask=scene%mesh%body > 0)
    points%across(3, :) = points%across(1, :)
  end subroutine find_axis

  !> The degrees of freedom that every *STEP holds at 0.
  pure function held_at_rest(scene) result(held)
    type(scene_t), intent(in) :: scene
    logical :: held(3, scene%mesh%n_nodes), here(3, scene%mesh%n_nodes)
    integer :: step, i

    held = .true.
    here = .false.
    do step = 1, size(scene%steps)
      if (scene%steps(step)%replace_boundary) here = .false.
      do i = 1, size(scene%steps(step)%boundary)
        associate (b => scene%steps(step)%boundary(i))
          if (b%fixed .and. step > 1) cycle ! it stays what it was
          here(b%dof, b%node) = .not. abs(b%value) > 0.0_wp
        end associate
      end do
      held = held .and. here
    end do
  end function held_at_rest

end module symmetry_planes_mod
