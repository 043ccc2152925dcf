!> What flat faces that stand for arcs make of the mean gaps between two surfaces: polygons of other
!> facets on one arc overlap or gape, and the bodies that they stand for do not.
!>
!> docs/theory.md (10.31).
module facet_rises_mod
  use kinds_mod, only: wp
  use cells_mod, only: face_corners
  use small_matrix_mod, only: cross, solve_small
  use face_overlap_mod, only: plane_t, plane_of_face, outward_normal, opposite_weights
  use face_grid_mod, only: face_grid_t, make_face_grid, faces_near
  use surfaces_mod, only: nodes_of, all_nodes_of
  use obstacles_mod, only: obstacle_t
  use obstacle_shapes_mod, only: is_before_faces, shift_of
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t, is_pair_removed, n_sides, faces_of_side, &
    find_side_points
  use placement_mod, only: as_turned, no_gap
  use state_mod, only: state_t
  use smooth_faces_mod, only: smooth_faces_t, smooth_faces_of, bulge_at, shape_at
  implicit none
  private

  public :: gaps_of_arcs, mean_rises

  integer, parameter :: n_line = 4 !! points of a face along each of its directions
  real(wp), parameter :: on_line(n_line) = [-0.8611363115940526_wp, -0.3399810435848563_wp, &
    0.3399810435848563_wp, 0.8611363115940526_wp]
  real(wp), parameter :: line_weight(n_line) = [0.3478548451374538_wp, 0.6521451548625461_wp, &
    0.6521451548625461_wp, 0.3478548451374538_wp]
  real(wp), parameter :: xi_node(face_corners) = [-1, 1, 1, -1]
  real(wp), parameter :: eta_node(face_corners) = [-1, -1, 1, 1]
  real(wp), parameter :: rounding = 1.0e-6_wp !! of half an edge: a rise that is none [-]

contains

  !> How much larger the mean gaps of the points would be between the arcs that flat faces stand
  !> for: those of the mesh, 0 of points whose gap the deck has closed in the mean (ADJUST), or
  !> given (*CLEARANCE), and beyond them those that the bodies have bent to.
  subroutine gaps_of_arcs(scene, points, first_gap, state, of_mesh, of_bending)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: first_gap(:) !! (n_points) of the undeformed mesh [length]
    type(state_t), intent(in) :: state   !! where the surfaces are
    real(wp), intent(out) :: of_mesh(:), of_bending(:) !! (n_points) [length]
    type(smooth_faces_t) :: slave, master, bent_slave, bent_master
    type(obstacle_t) :: now
    real(wp), allocatable :: places(:, :)
    integer, allocatable :: corners(:, :), of_side(:), rows(:)
    real(wp) :: largest, at_first(points%n), x(3, scene%mesh%n_nodes)
    integer :: pair, side, first, last, i

    of_mesh = 0.0_wp
    of_bending = 0.0_wp
    x = scene%mesh%coordinates + state%displacement
    ! What *CONTACT GAP adds is of the bodies, not of their faces.
    at_first = first_gap - points%extra_gap
    if (allocated(points%constant_gap)) at_first = first_gap - points%constant_gap
    do pair = 1, size(scene%pairs)
      associate (of => scene%pairs(pair))
        if (.not. is_before_faces(of, scene%obstacles)) cycle
        if (is_pair_removed(points, pair)) cycle
        corners = flat_faces(scene, of%surface)
        slave = smooth_faces_of(corners, scene%mesh%coordinates)
        bent_slave = smooth_faces_of(corners, x, slave%normal)
        if (of%master == 0) then
          corners = flat_faces(scene, of%master_surface)
          master = smooth_faces_of(corners, scene%mesh%coordinates)
          places = x
          bent_master = smooth_faces_of(corners, places, master%normal)
        else
          corners = scene%obstacles(of%master)%facet
          now = as_turned(scene, of%master, state%rotation)
          places = now%corner + spread(shift_of(now, state%displacement), 2, size(now%corner, 2))
          master = smooth_faces_of(corners, places)
          bent_master = master
        end if
        largest = max(largest_rise(slave), largest_rise(master))
        do side = 1, n_sides(points, pair)
          call faces_of_side(points, pair, side, of_side)
          if (.not. allocated(of_side)) of_side = [(i, i=1, size(corners, 2))]
          call find_side_points(points, pair, side, first, last)
          rows = spread(0, 1, scene%mesh%n_nodes)
          rows(points%node(first:last)) = [(i, i=1, last - first + 1)]
          associate (n => last - first + 1)
            of_mesh(first:last) = mean_rises(slave, x, rows, n, part_of(master, of_side), places)
            of_bending(first:last) = mean_rises(bent_slave, x, rows, n, part_of(bent_master, &
              of_side), places) - of_mesh(first:last)
          end associate
          where (abs(at_first(first:last)) <= rounding*largest .or. first_gap(first:last) >= &
            no_gap .or. of%has_clearance) of_mesh(first:last) = 0.0_wp
        end do
      end associate
    end do
  end subroutine gaps_of_arcs

  !> The faces of a surface that are flat: none where they have mid-side nodes, which say how they
  !> bend.
  pure function flat_faces(scene, surface) result(corners)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: surface !! of the scene's
    integer, allocatable :: corners(:, :)

    associate (faces => scene%surfaces(surface)%faces, connectivity => scene%mesh%connectivity)
      corners = nodes_of(faces, connectivity)
      if (size(corners) == 0) return
      associate (nodes => all_nodes_of(faces, connectivity))
        if (any(nodes(face_corners + 1:, :) > 0)) corners = corners(:, :0)
      end associate
    end associate
  end function flat_faces

  !> Some of the faces; none where none are flat.
  pure type(smooth_faces_t) function part_of(faces, chosen) result(part)
    type(smooth_faces_t), intent(in) :: faces
    integer, intent(in) :: chosen(:)

    part = faces
    if (size(faces%nodes) == 0) return
    part%nodes = faces%nodes(:, chosen)
    part%normal = faces%normal(:, chosen)
    part%bulge = faces%bulge(:, :, chosen)
    part%half = faces%half(:, chosen)
  end function part_of

  pure real(wp) function largest_rise(faces) result(largest)
    type(smooth_faces_t), intent(in) :: faces

    largest = 0.0_wp
    if (size(faces%nodes) == 0) return
    largest = maxval(norm2(faces%bulge, dim=1), mask=norm2(faces%bulge, dim=1) > &
      rounding*faces%half)
    largest = max(largest, 0.0_wp)
  end function largest_rise

  !> The means, by the dual functions of the slave's nodes, of how much farther apart two smooth
  !> surfaces are than their flat faces: both rises taken off. Where the master does not cover all
  !> of a face its nodes' own functions make the mean of what it does.
  function mean_rises(slave, x, row, n, master, places) result(mean)
    type(smooth_faces_t), intent(in) :: slave, master
    real(wp), intent(in) :: x(:, :)      !! (3,:) of the slave's nodes [length]
    integer, intent(in) :: row(:)        !! the entry of `mean` of each
    integer, intent(in) :: n
    real(wp), intent(in) :: places(:, :) !! (3,:) of the master's nodes [length]
    real(wp) :: mean(n)                  !! [length]
    type(face_grid_t) :: grid
    real(wp) :: area(n)
    integer, allocatable :: near(:)
    integer :: f

    mean = 0.0_wp
    area = 0.0_wp
    if (size(master%nodes) == 0 .or. size(slave%nodes) == 0) return
    grid = make_face_grid(master%nodes, places)
    do f = 1, size(slave%nodes, 2)
      call add_face(f)
    end do
    where (area > 0.0_wp) mean = mean/area

  contains

    subroutine add_face(f)
      integer, intent(in) :: f
      real(wp), dimension(face_corners, face_corners) :: mass
      real(wp), dimension(face_corners) :: lumped, rises, shape, fit
      real(wp) :: corner(3, face_corners), along(3), across(3), weight, rise, reach
      type(plane_t) :: plane
      integer :: i, j, m
      logical :: is_hit, is_whole, regular

      associate (nodes => slave%nodes(:, f))
        m = merge(3, 4, nodes(3) == nodes(4))
        corner = x(:, nodes)
        plane = plane_of_face(corner(:, :m))
        reach = maxval(norm2(corner - spread(corner(:, 1), 2, face_corners), dim=1))
        call faces_near(grid, minval(corner, 2) - reach, maxval(corner, 2) + reach, near)
        if (size(near) == 0) return
        mass = 0.0_wp
        lumped = 0.0_wp
        rises = 0.0_wp
        is_whole = .true.
        do j = 1, n_line
          do i = 1, n_line
            associate (xi => on_line(i), eta => on_line(j))
              shape = shape_at(xi, eta)
              call look_at_master(plane, matmul(corner, shape), rise, is_hit)
              is_whole = is_whole .and. is_hit
              if (.not. is_hit) cycle
              rise = -rise - dot_product(slave%normal(:, f), bulge_at(slave, f, xi, eta))
              along = 0.5_wp*matmul(corner, shape_at(1.0_wp, eta) - shape_at(-1.0_wp, eta))
              across = 0.5_wp*matmul(corner, shape_at(xi, 1.0_wp) - shape_at(xi, -1.0_wp))
              weight = line_weight(i)*line_weight(j)*norm2(cross(along, across))
              if (m == 3) shape(3) = shape(3) + shape(4)
              lumped = lumped + weight*shape
              rises = rises + weight*shape*rise
              mass = mass + weight*spread(shape, 2, face_corners)*spread(shape, 1, face_corners)
            end associate
          end do
        end do
        if (.not. sum(lumped(:m)) > 0.0_wp) return
        if (is_whole) then
          call solve_small(mass(:m, :m), rises(:m), fit(:m), regular)
          if (regular) rises(:m) = lumped(:m)*fit(:m)
        end if
        do i = 1, m
          if (row(nodes(i)) == 0) cycle
          mean(row(nodes(i))) = mean(row(nodes(i))) + rises(i)
          area(row(nodes(i))) = area(row(nodes(i))) + lumped(i)
        end do
      end associate
    end subroutine add_face

    !> The rise of the master's face that lies opposite a place of the slave's, the nearest.
    pure subroutine look_at_master(of_face, place, rise, is_hit)
      type(plane_t), intent(in) :: of_face
      real(wp), intent(in) :: place(3)   !! [length]
      real(wp), intent(out) :: rise      !! outwards [length]
      logical, intent(out) :: is_hit
      real(wp), parameter :: beside = 1.0e-6_wp !! edges, of a face [-]
      type(plane_t) :: plane
      real(wp) :: shape(face_corners), distance, least
      integer :: k, m

      plane = of_face
      plane%corner(:, 1) = matmul(place - plane%origin, plane%axis(:, :2))
      is_hit = .false.
      rise = 0.0_wp
      least = huge(least)
      do k = 1, size(near)
        associate (nodes => master%nodes(:, near(k)))
          m = merge(3, 4, nodes(3) == nodes(4))
          if (dot_product(plane%axis(:, 3), outward_normal(places(:, nodes(:m)))) > 0.0_wp) cycle
          shape = opposite_weights(plane, 1, places(:, nodes(:m)))
          if (minval(shape(:m)) < -beside) cycle
          distance = norm2(matmul(places(:, nodes(:m)), shape(:m)) - place)
          if (distance >= least) cycle
          least = distance
          is_hit = .true.
          if (m == 3) shape(4) = 0.0_wp
          rise = rise_of(near(k), shape, m == 3)
        end associate
      end do
    end subroutine look_at_master

    pure real(wp) function rise_of(k, shape, is_triangle) result(rise)
      integer, intent(in) :: k
      real(wp), intent(in) :: shape(face_corners)
      logical, intent(in) :: is_triangle
      real(wp) :: xi, eta

      if (is_triangle) then
        ! The quadrilateral whose third and fourth node are one.
        eta = 2.0_wp*shape(3) - 1.0_wp
        xi = 0.0_wp
        if (eta < 1.0_wp) xi = 2.0_wp*(shape(2) - shape(1))/(1.0_wp - eta)
      else
        xi = dot_product(shape, xi_node)
        eta = dot_product(shape, eta_node)
      end if
      rise = dot_product(master%normal(:, k), bulge_at(master, k, xi, eta))
    end function rise_of

  end function mean_rises

end module facet_rises_mod
