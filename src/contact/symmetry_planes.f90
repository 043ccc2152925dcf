!> Planes of symmetry of pairs before faces, found by their supports. docs/theory.md section 11.
!>
!> The weights of a point on such a plane reach nodes beside it, whose motion across the plane is
!> none of the plane's, and its normal is a mean over the faces of one side: across the plane the
!> normal has no part, and no friction acts.
module symmetry_planes_mod
  use kinds_mod, only: wp
  use mesh_mod, only: joined_nodes
  use obstacles_mod, only: obstacle_t
  use surfaces_mod, only: nodes_of
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use face_grid_mod, only: face_grid_t, make_face_grid, faces_near
  use obstacle_shapes_mod, only: is_before_faces
  implicit none
  private

  public :: find_symmetry_planes

  real(wp), parameter :: rounding = 1.0e-9_wp !! of the size of the mesh: nodes on one plane
  real(wp), parameter :: single = 1.0e-6_wp   !! of the size of both: corners of files [-]

contains

  !> Mark the points that lie on planes of symmetry, whether or not they can reach their masters.
  pure subroutine find_symmetry_planes(scene, points)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(inout) :: points !! gets across
    logical, allocatable :: held(:, :)
    logical :: is_single(scene%mesh%n_nodes) !! without bricks: its place says nothing
    integer, allocatable :: masters(:)       !! nodes of the pair's master; none of facets
    real(wp) :: side(2), close_by
    integer :: pair, axis, i, k

    points%across = .false.
    if (.not. any(points%on_surface)) return
    held = held_at_rest(scene)
    is_single = .false.
    if (scene%constraints%n_equations > 0) is_single = joined_nodes(scene%mesh)
    associate (x => scene%mesh%coordinates)
      close_by = rounding*maxval(maxval(x, dim=2) - minval(x, dim=2))
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
        is_mirrored(scene, pair, axis, place)
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

  !> Whether the facets of a pair end at a plane, on the side of the slave, or have their mirror
  !> images among them as far from it as the slave's faces there.
  pure logical function is_mirrored(scene, pair, axis, place)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: pair, axis
    real(wp), intent(in) :: place !! of the plane along the axis [length]
    integer, allocatable :: slave(:, :)
    real(wp) :: close_by, width, inwards
    integer :: f

    associate (x => scene%mesh%coordinates, obstacle => scene%obstacles(scene%pairs(pair)%master))
      allocate (slave, source=nodes_of(scene%surfaces(scene%pairs(pair)%surface)%faces, &
        scene%mesh%connectivity))
      close_by = single*max(maxval(maxval(x, dim=2) - minval(x, dim=2)), &
        maxval(maxval(obstacle%corner, dim=2) - minval(obstacle%corner, dim=2)))
      width = 0.0_wp
      inwards = 0.0_wp
      do f = 1, size(slave, 2)
        associate (way => x(axis, slave(:, f)) - place)
          if (minval(abs(way)) <= close_by) width = max(width, maxval(abs(way)))
          inwards = inwards + sum(way)
        end associate
      end do
      associate (way => sign(1.0_wp, inwards)*(obstacle%corner(axis, :) - place))
        if (minval(way) >= -close_by) then
          is_mirrored = minval(way) <= close_by
        else
          is_mirrored = has_images(obstacle, axis, place, width, close_by)
        end if
      end associate
    end associate
  end function is_mirrored

  !> Whether the corners of facets near a plane have corners as mirror images, and there are some.
  !> How quadrilaterals are cut into triangles need not be alike on both sides.
  pure logical function has_images(obstacle, axis, place, width, close_by)
    type(obstacle_t), intent(in) :: obstacle
    integer, intent(in) :: axis
    real(wp), intent(in) :: place       !! of the plane along the axis [length]
    real(wp), intent(in) :: width       !! from it on facets need none [length]
    real(wp), intent(in) :: close_by    !! how far an image may be off [length]
    type(face_grid_t) :: grid
    logical :: is_near(size(obstacle%corner, 2))
    real(wp) :: image(3)
    integer :: f, i, n

    is_near = .false.
    do f = 1, size(obstacle%facet, 2)
      n = count(obstacle%facet(:, f) > 0)
      associate (corners => obstacle%facet(:n, f))
        if (minval(obstacle%corner(axis, corners)) <= place + width .and. &
          maxval(obstacle%corner(axis, corners)) >= place - width) is_near(corners) = .true.
      end associate
    end do
    has_images = any(is_near)
    if (.not. has_images) return
    grid = make_face_grid(obstacle%facet, obstacle%corner)
    do i = 1, size(is_near)
      if (.not. is_near(i)) cycle
      image = obstacle%corner(:, i)
      image(axis) = 2.0_wp*place - image(axis)
      has_images = is_corner(obstacle, grid, image, close_by)
      if (.not. has_images) return
    end do
  end function has_images

  !> Whether a facet has a corner at a place.
  pure logical function is_corner(obstacle, grid, place, close_by)
    type(obstacle_t), intent(in) :: obstacle
    type(face_grid_t), intent(in) :: grid !! of its facets
    real(wp), intent(in) :: place(3)      !! [length]
    real(wp), intent(in) :: close_by      !! how far it may be off [length]
    integer, allocatable :: near(:)
    integer :: i, k

    is_corner = .true.
    call faces_near(grid, place - close_by, place + close_by, near)
    do i = 1, size(near)
      do k = 1, count(obstacle%facet(:, near(i)) > 0)
        if (maxval(abs(obstacle%corner(:, obstacle%facet(k, near(i))) - place)) <= close_by) return
      end do
    end do
    is_corner = .false.
  end function is_corner

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
