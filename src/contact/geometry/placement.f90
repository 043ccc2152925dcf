!> Where the contact points stand before their masters: frames, gaps and weights, about which
!> contact is linear until it is placed anew.
module placement_mod
  use kinds_mod, only: wp
  use obstacles_mod, only: obstacle_t
  use obstacle_shapes_mod, only: shift_of, turned, locate_point, has_meshed_master
  use scene_mod, only: scene_t
  use local_refinement_mod, only: hanging_of
  use surfaces_mod, only: nodes_of
  use contact_points_mod, only: contact_points_t, weights_t, is_across, n_sides, faces_of_side, &
    find_side_points, face_one
  use local_frame_mod, only: local_frame, straight
  use mortar_mod, only: mortar_t, slave_t, make_mortar, reach_of_faces, reach_of_all, enough
  use fixed_points_mod, only: find_fixed, are_held
  use facet_mortar_mod, only: facet_pair_t, join_facets, corners_of, face_facets, reach_of_facets, &
    reach_of_all_facets
  implicit none
  private

  public :: placement_t, no_gap, place, place_all, place_undeformed, place_curved, &
    find_partly_covered

  real(wp), parameter :: no_gap = 1.0e30_wp !! of a point that its master does not cover [length]

  !> Before a flat obstacle a placement holds wherever the point goes; before a curved one, or
  !> faces, near the displacement that it was made for.
  !>
  !> A point that faces do not cover has an empty row of weights, no area and no gap.
  type :: placement_t
    real(wp), allocatable :: frame(:, :, :)  !! (3,3,n_points) columns n, t1, t2
    real(wp), allocatable :: gap(:)          !! (n_points) at the reference [length]
    real(wp), allocatable :: reference(:, :)
    !! (3,n_points) displacement of the node less that of the master there [length]
    type(weights_t) :: weights               !! of the masters' nodes
    real(wp), allocatable :: covered_area(:) !! (n_points) of the node's [length^2]
    real(wp), allocatable :: faced_area(:)
    !! (n_points) of the node's what is turned towards faces, 0 before other masters [length^2]
    real(wp), allocatable :: least_gap(:)
    !! (n_points) before faces: at points of the quadrature on the node's faces, the extra gap
    !! added; `no_gap` elsewhere [length]
    real(wp), allocatable :: unplaced_gap(:)
    !! (n_points) the same of a point that faces cover a little, but not enough for it to count;
    !! `no_gap` elsewhere [length]
    real(wp), allocatable :: entered(:)
    !! (n_points) before faces: integral of the gap, without the extra gap, where it is below 0,
    !! with the node's shape function; 0 elsewhere [length^3]
    real(wp), allocatable :: apart(:, :)
    !! (3,n_points) before facets of an obstacle: place of the node less that of what it faces; 0
    !! elsewhere [length]
    logical, allocatable :: is_fixed(:)
    !! (n_points) before a surface: the two sides cannot move apart along the normal; the point does
    !! not count as covered
    real(wp), allocatable :: driven_in(:)
    !! (n_points) how deep prescribed motion took such a point into its master [length]
    real(wp), allocatable :: drag(:, :)
    !! (3,n_points) what the turn of obstacles adds to the motion of the points about them in the
    !! increment (drag_points_mod), 0 where none turns [length]
  end type placement_t

  ! How much of its node's area a surface must cover for a point that counted in the same increment:
  ! else points at the edge of the master come and go.
  real(wp), parameter :: enough_to_stay = 1.0e-9_wp !! [-]
  ! By how much of the sum of its weights those of a joined point may differ from the ones that it
  ! keeps. Between sheets that slide on each other by a twentieth of an element those of the sheets
  ! differ by as much.
  real(wp), parameter :: joined = 0.05_wp !! [-]
  ! More than that no deck's digits make of edges that are flush.
  real(wp), parameter :: a_little = 1.0e-4_wp !! [-]

contains

  !> All points of the undeformed mesh.
  pure subroutine place_undeformed(scene, points, placement)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(placement_t), intent(out) :: placement
    real(wp) :: nothing(3, scene%mesh%n_nodes)

    nothing = 0.0_wp
    call place_all(scene, points, nothing, placement)
  end subroutine place_undeformed

  !> All points where displacement `u` takes them.
  pure subroutine place_all(scene, points, u, placement, rotation)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: u(:, :)      !! (3,n_nodes) [length]
    type(placement_t), intent(out) :: placement
    real(wp), intent(in), optional :: rotation(:, :) !! as of `place`
    integer :: pair

    allocate (placement%frame(3, 3, points%n), placement%gap(points%n))
    allocate (placement%reference(3, points%n))
    allocate (placement%covered_area(points%n), placement%least_gap(points%n))
    allocate (placement%unplaced_gap(points%n), source=no_gap)
    allocate (placement%faced_area(points%n), source=0.0_wp)
    allocate (placement%entered(points%n), source=0.0_wp)
    allocate (placement%drag(3, points%n), placement%apart(3, points%n), source=0.0_wp)
    allocate (placement%is_fixed(points%n), source=.false.)
    allocate (placement%driven_in(points%n), source=0.0_wp)
    allocate (placement%weights%first(points%n + 1), source=1)
    allocate (placement%weights%node(0), placement%weights%weight(0))
    allocate (placement%weights%covers(points%n), source=.true.)
    do pair = 1, size(scene%pairs)
      call place(scene, points, pair, u, placement, rotation)
    end do
  end subroutine place_all

  !> The points before curved masters, where displacement `u` takes them.
  pure subroutine place_curved(scene, points, u, placement, rotation, stay)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: u(:, :)      !! (3,n_nodes) [length]
    type(placement_t), intent(inout) :: placement
    real(wp), intent(in), optional :: rotation(:, :) !! as of `place`
    logical, intent(in), optional :: stay            !! the same
    integer :: pair

    do pair = 1, size(scene%pairs)
      associate (first => points%first(pair), last => points%first(pair + 1) - 1)
        if (any(points%is_curved(first:last))) call place(scene, points, pair, u, placement, &
          rotation, stay)
      end associate
    end do
  end subroutine place_curved

  !> The points of one pair, all of them: weights may be integrals over both surfaces.
  pure subroutine place(scene, points, pair, u, placement, rotation, stay)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair
    real(wp), intent(in) :: u(:, :)      !! (3,n_nodes) reference nodes of obstacles too [length]
    type(placement_t), intent(inout) :: placement
    real(wp), intent(in), optional :: rotation(:, :)
    !! (3,n_obstacles) rotation vectors; left out: obstacles stand as the deck has them [rad]
    logical, intent(in), optional :: stay
    !! points that count in `placement` do so while next to nothing of them is covered; default: no

    type(obstacle_t) :: obstacle
    logical :: stays
    integer :: side

    stays = .false.
    if (present(stay)) stays = stay
    if (has_meshed_master(scene, pair)) then
      obstacle = as_turned(scene, scene%pairs(pair)%master, rotation)
      do side = 1, n_sides(points, pair)
        call place_before_facets(scene, points, pair, side, u, stays, obstacle, placement)
      end do
    else if (scene%pairs(pair)%master > 0) then
      call place_before_obstacle(scene, points, pair, u, placement, rotation)
    else
      do side = 1, n_sides(points, pair)
        call place_before_surface(scene, points, pair, side, u, stays, placement)
      end do
    end if
  end subroutine place

  pure subroutine place_before_obstacle(scene, points, pair, u, placement, rotation)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair
    real(wp), intent(in) :: u(:, :)      !! (3,n_nodes) [length]
    type(placement_t), intent(inout) :: placement
    real(wp), intent(in), optional :: rotation(:, :) !! as of `place`
    type(obstacle_t) :: obstacle
    real(wp) :: shift(3), normal(3)
    integer :: i, n

    associate (master => scene%pairs(pair)%master, &
               first => points%first(pair), last => points%first(pair + 1) - 1)
      obstacle = as_turned(scene, master, rotation)
      shift = shift_of(obstacle, u)
      n = merge(1, 0, obstacle%ref_node > 0)
      do i = first, last
        associate (node => points%node(i), gap => placement%gap(i))
          call locate_point(obstacle, shift, scene%mesh%coordinates(:, node) + u(:, node), gap, &
            normal)
          gap = gap + points%extra_gap(i)
          placement%frame(:, :, i) = local_frame(normal)
          placement%reference(:, i) = u(:, node) - shift
        end associate
      end do
      placement%covered_area(first:last) = points%area(first:last)
      placement%least_gap(first:last) = no_gap
      ! A rigid master moves as its reference node does.
      call replace_rows(placement%weights, first, [(1 + n*(i - first), i=first, last + 1)], &
        spread(obstacle%ref_node, 1, n*(last - first + 1)), &
        spread(1.0_wp, 1, n*(last - first + 1)))
    end associate
  end subroutine place_before_obstacle

  !> An obstacle as it has turned.
  pure function as_turned(scene, master, rotation) result(obstacle)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: master
    real(wp), intent(in), optional :: rotation(:, :) !! as of `place`
    type(obstacle_t) :: obstacle

    obstacle = scene%obstacles(master)
    if (obstacle%turns .and. present(rotation)) obstacle = turned(obstacle, rotation(:, master), &
      scene%mesh%coordinates(:, obstacle%ref_node))
  end function as_turned

  !> Weights, normals and gaps of docs/theory.md (11.2) to (11.4), of the nodes where they are now;
  !> with small sliding of the undeformed mesh, from which gaps then grow linearly.
  pure subroutine place_before_surface(scene, points, pair, side, u, stay, placement)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair, side
    real(wp), intent(in) :: u(:, :)      !! (3,n_nodes) [length]
    logical, intent(in) :: stay
    type(placement_t), intent(inout) :: placement
    type(mortar_t) :: mortar
    type(weights_t) :: rows
    integer :: i, k, j, first, last

    call find_side_points(points, pair, side, first, last)
    call face_surface(scene, points, pair, side, u, mortar, placement)
    if (allocated(points%is_joined)) then
      if (any(points%is_joined(first:last))) call keep_joined(scene, points, pair, side, u, &
        placement, mortar)
    end if
    call place_covered(points, first, stay, mortar, placement)
    allocate (rows%first(last - first + 2), rows%node(size(mortar%weights%node)), &
      rows%weight(size(mortar%weights%node)))
    k = 0
    do i = first, last
      associate (here => i - first + 1)
        rows%first(here) = k + 1
        if (.not. placement%weights%covers(i)) cycle
        placement%reference(:, i) = u(:, points%node(i))
        do j = mortar%weights%first(here), mortar%weights%first(here + 1) - 1
          associate (node => mortar%weights%node(j), weight => mortar%weights%weight(j))
            if (.not. abs(weight) > 0.0_wp) cycle
            k = k + 1
            rows%node(k) = node
            rows%weight(k) = weight
            placement%reference(:, i) = placement%reference(:, i) - weight*u(:, node)
          end associate
        end do
        if (scene%pairs(pair)%small_sliding) placement%gap(i) = placement%gap(i) + &
          dot_product(mortar%normal(:, here), placement%reference(:, i))
      end associate
    end do
    rows%first(last - first + 2) = k + 1
    call replace_rows(placement%weights, first, rows%first, rows%node(:k), rows%weight(:k))
  end subroutine place_before_surface

  !> The same before facets of an obstacle, wherever it has turned and moved to: what covers a point
  !> moves as its reference node does, with weight 1.
  pure subroutine place_before_facets(scene, points, pair, side, u, stay, obstacle, placement)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair, side
    real(wp), intent(in) :: u(:, :)      !! (3,n_nodes) [length]
    logical, intent(in) :: stay
    type(obstacle_t), intent(in) :: obstacle !! as it has turned
    type(placement_t), intent(inout) :: placement
    type(mortar_t) :: mortar
    type(weights_t) :: rows
    real(wp) :: shift(3)
    integer :: i, k, first, last

    call find_side_points(points, pair, side, first, last)
    shift = shift_of(obstacle, u)
    call face_obstacle(scene, points, pair, side, u, obstacle, mortar)
    call place_covered(points, first, stay, mortar, placement)
    allocate (rows%first(last - first + 2))
    k = 1
    do i = first, last
      rows%first(i - first + 1) = k
      placement%apart(:, i) = 0.0_wp
      if (.not. placement%weights%covers(i)) cycle
      if (obstacle%ref_node > 0) k = k + 1
      placement%apart(:, i) = mortar%apart(:, i - first + 1)
      placement%reference(:, i) = u(:, points%node(i)) - shift
    end do
    rows%first(last - first + 2) = k
    call replace_rows(placement%weights, first, rows%first, spread(obstacle%ref_node, 1, k - 1), &
      spread(1.0_wp, 1, k - 1))
  end subroutine place_before_facets

  !> Normals, gaps and areas of the points that faces cover, and which these are.
  pure subroutine place_covered(points, first, stay, mortar, placement)
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: first            !! of these points
    logical, intent(in) :: stay             !! as of `place`
    type(mortar_t), intent(inout) :: mortar !! of these points; normals turn into planes
    type(placement_t), intent(inout) :: placement
    integer :: i
    logical :: counts

    do i = first, first + size(mortar%area) - 1
      associate (here => i - first + 1, covers => placement%weights%covers)
        counts = mortar%area(here) > enough*mortar%whole_area(here)
        if (stay .and. covers(i)) counts = mortar%area(here) > &
          enough_to_stay*mortar%whole_area(here)
        if (counts) call turn_into_plane(is_across(points, i), mortar%normal(:, here), counts)
        covers(i) = counts
        placement%unplaced_gap(i) = no_gap
        placement%entered(i) = merge(mortar%entered(here), 0.0_wp, counts)
        if (.not. counts .and. mortar%area(here) > a_little*mortar%whole_area(here)) then
          placement%unplaced_gap(i) = mortar%least_gap(here) + points%extra_gap(i)
        end if
        if (counts) then
          placement%frame(:, :, i) = local_frame(mortar%normal(:, here))
          placement%gap(i) = dot_product(mortar%normal(:, here), mortar%apart(:, here)) + &
            points%extra_gap(i)
          placement%least_gap(i) = mortar%least_gap(here) + points%extra_gap(i)
          placement%covered_area(i) = mortar%area(here)
          placement%faced_area(i) = mortar%faced_area(here)
        else
          placement%frame(:, :, i) = local_frame(-mortar%outward(:, here))
          placement%gap(i) = no_gap
          placement%least_gap(i) = no_gap
          placement%covered_area(i) = 0.0_wp
          placement%faced_area(i) = 0.0_wp
          placement%reference(:, i) = 0.0_wp
        end if
      end associate
    end do
  end subroutine place_covered

  !> Which points faces cover by less than half of what is turned towards them: a force there is
  !> one over little area. What other sides of the master cover of it does not count.
  pure function find_partly_covered(points, placement) result(partly)
    type(contact_points_t), intent(in) :: points
    type(placement_t), intent(in) :: placement
    logical :: partly(points%n)
    real(wp) :: faced
    integer :: i, side, first, last, other

    partly = .false.
    do i = 1, points%n
      if (.not. placement%faced_area(i) > 0.0_wp) cycle
      faced = placement%faced_area(i)
      associate (pair => points%pair(i), n => placement%frame(:, 1, :), &
                 covered => placement%covered_area)
        do side = 1, n_sides(points, pair)
          call find_side_points(points, pair, side, first, last)
          other = first + mod(i - points%first(pair), last - first + 1)
          if (other /= i) faced = faced - covered(other)*max(0.0_wp, dot_product(n(:, i), &
            n(:, other)))
        end do
        ! Edges that are flush leave half of their nodes.
        partly(i) = covered(i) < (0.5_wp - a_little)*faced
      end associate
    end do
  end function find_partly_covered

  !> What the nodes of a slave surface face of one side of an obstacle of facets where it stands.
  pure subroutine face_obstacle(scene, points, pair, side, u, obstacle, mortar)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair, side
    real(wp), intent(in) :: u(:, :)       !! (3,n_nodes) [length]
    type(obstacle_t), intent(in) :: obstacle !! as it has turned
    type(mortar_t), intent(out) :: mortar !! of the points before the side
    real(wp) :: x(3, scene%mesh%n_nodes), shift(3), reach
    real(wp), allocatable :: way(:, :)    !! (3,n) of the corners of the side [length]
    integer, allocatable :: facets(:)     !! of the side; not allocated: all
    type(facet_pair_t) :: now
    integer :: first, last

    call find_side_points(points, pair, side, first, last)
    call faces_of_side(points, pair, side, facets)
    shift = shift_of(obstacle, u)
    associate (of => scene%pairs(pair), mesh => scene%mesh, s => points%node(first:last))
      way = obstacle%corner + spread(shift, 2, size(obstacle%corner, 2)) - &
        scene%obstacles(of%master)%corner
      if (allocated(facets)) way = way(:, corners_of(obstacle%facet(:, facets)))
      ! What came to overlap has moved as far.
      x = 0.0_wp
      x(:, s) = mesh%coordinates(:, s) + u(:, s)
      now = join_facets(slave_t(nodes_of(scene%surfaces(of%surface)%faces, mesh%connectivity), s, &
        hanging_of(mesh%hangs, mesh%between, mesh%n_given, s)), x, obstacle, shift, facets)
      reach = reach_of_facets(now) + of%overlap + &
        norm2(max(maxval(u(:, s), 2) - minval(way, 2), maxval(way, 2) - minval(u(:, s), 2)))
      call face_facets(now, reach, mortar)
      ! What moves freely may fall any way.
      if (any(mortar%area > 0.0_wp)) return
      call face_facets(now, reach + reach_of_all_facets(now), mortar, behind=reach)
    end associate
  end subroutine face_obstacle

  !> What the nodes of a slave surface face of one side of a surface where `u` takes them, or with
  !> small sliding where they are in the mesh; a second time where some have no multiplier.
  pure subroutine face_surface(scene, points, pair, side, u, mortar, placement)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair, side
    real(wp), intent(in) :: u(:, :)       !! (3,n_nodes) [length]
    type(mortar_t), intent(out) :: mortar !! of the points before the side
    type(placement_t), intent(inout) :: placement !! gets is_fixed, driven_in, still
    real(wp) :: x(3, scene%mesh%n_nodes), reach, far
    type(slave_t) :: slave
    integer, allocatable :: master(:, :), faces(:), m(:)
    integer :: first, last

    call find_side_points(points, pair, side, first, last)
    call faces_of_side(points, pair, side, faces)
    associate (of => scene%pairs(pair), mesh => scene%mesh, &
               slave_nodes => points%node(first:last), &
               s => scene%surfaces(scene%pairs(pair)%surface)%nodes)
      slave = slave_t(nodes_of(scene%surfaces(of%surface)%faces, mesh%connectivity), slave_nodes, &
        hanging_of(mesh%hangs, mesh%between, mesh%n_given, slave_nodes))
      allocate (master, source=nodes_of(scene%surfaces(of%master_surface)%faces, &
        mesh%connectivity))
      m = scene%surfaces(of%master_surface)%nodes
      if (allocated(faces)) then
        master = master(:, faces)
        m = corners_of(master)
      end if
      x = 0.0_wp
      x(:, s) = mesh%coordinates(:, s)
      x(:, m) = mesh%coordinates(:, m)
      reach = reach_of_faces(slave%faces, master, x) + of%overlap
      if (.not. of%small_sliding) then
        ! What came to overlap has moved as far.
        reach = reach + norm2(max(maxval(u(:, s), 2) - minval(u(:, m), 2), &
          maxval(u(:, m), 2) - minval(u(:, s), 2)))
        x(:, s) = mesh%coordinates(:, s) + u(:, s)
        ! A node of both surfaces is displaced once.
        x(:, m) = mesh%coordinates(:, m) + u(:, m)
      end if
      if (allocated(points%freedom)) then
        slave%asks = points%freedom%is_bound(slave_nodes)
        if (allocated(mesh%hangs)) slave%asks = slave%asks .and. .not. mesh%hangs(slave_nodes)
        if (.not. any(slave%asks)) deallocate (slave%asks)
      end if
      far = reach + reach_of_all(s, m, x)
      call face_faces(slave, master, x, [reach, far], of%small_sliding, mortar)
      if (.not. allocated(mortar%opposite)) return
      call find_fixed_points(scene, points, first, u, mortar, placement)
      deallocate (slave%asks)
      allocate (slave%is_fixed(last - first + 1), source=.false.)
      ! With what neighbours get of others they may have nearly all weights on what is held.
      do
        if (any(placement%is_fixed(first:last) .neqv. slave%is_fixed)) then
          slave%is_fixed = placement%is_fixed(first:last)
          call face_faces(slave, master, x, [reach, far], of%small_sliding, mortar)
        end if
        call find_held_rows(scene, points, first, u, mortar, placement)
        if (all(placement%is_fixed(first:last) .eqv. slave%is_fixed)) exit
      end do
    end associate
  end subroutine face_surface

  !> What lies opposite within reach. What is placed once for all faces whatever lies opposite. So
  !> do bodies that are apart: what moves freely may fall any way.
  pure subroutine face_faces(slave, master, x, reach, is_placed_once, mortar)
    type(slave_t), intent(in) :: slave
    integer, intent(in) :: master(:, :)  !! (4,n_master)
    real(wp), intent(in) :: x(:, :)      !! (3,n_nodes) [length]
    real(wp), intent(in) :: reach(2)     !! near, and of everything [length]
    logical, intent(in) :: is_placed_once
    type(mortar_t), intent(out) :: mortar

    if (.not. is_placed_once) then
      call make_mortar(slave, master, x, reach(1), mortar)
      if (any(mortar%area > 0.0_wp)) return
    end if
    call make_mortar(slave, master, x, reach(2), mortar, behind=reach(1))
  end subroutine face_faces

  !> Which points before a surface have two sides that cannot move apart, along the normal or along
  !> an axis across it, and how deep prescribed motion took them in.
  pure subroutine find_fixed_points(scene, points, first, u, mortar, placement)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: first          !! of the points
    real(wp), intent(in) :: u(:, :)       !! (3,n_nodes) [length]
    type(mortar_t), intent(in) :: mortar  !! of these, with what lies opposite
    type(placement_t), intent(inout) :: placement
    real(wp) :: normal(3), frame(3, 3)
    logical :: still(3), counts
    integer :: i

    if (.not. allocated(placement%weights%still)) allocate (placement%weights%still(3, points%n), &
      source=.false.)
    do i = first, first + size(mortar%opposite) - 1
      associate (here => mortar%opposite(i - first + 1), node => points%node(i))
        placement%is_fixed(i) = .false.
        placement%driven_in(i) = 0.0_wp
        placement%weights%still(:, i) = .false.
        if (here%n == 0 .or. .not. mortar%area(i - first + 1) > 0.0_wp) cycle
        normal = mortar%normal(:, i - first + 1)
        call turn_into_plane(is_across(points, i), normal, counts)
        if (.not. counts) cycle
        call find_fixed(points%freedom, node, here, undeformed_normal(points, i, normal), still, &
          placement%is_fixed(i))
        if (placement%is_fixed(i)) then
          placement%driven_in(i) = depth_of_motion(scene, points, i, u, here%node(:here%n), &
            here%weight(:here%n), undeformed_normal(points, i, normal))
        else
          ! An axis that is a tangent.
          frame = local_frame(normal)
          placement%weights%still(:, i) = still .and. abs(normal) <= straight .and. &
            maxval(abs(frame(:, 2:)), dim=2) >= 1.0_wp - straight
        end if
      end associate
    end do
  end subroutine find_fixed_points

  !> Add the points whose node and nearly all of whose weights are held along the normal: what would
  !> press there acts on supports and constraints alone, but for a lever that makes it large.
  pure subroutine find_held_rows(scene, points, first, u, mortar, placement)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: first          !! of the points
    real(wp), intent(in) :: u(:, :)       !! (3,n_nodes) [length]
    type(mortar_t), intent(in) :: mortar  !! of these
    type(placement_t), intent(inout) :: placement
    real(wp) :: normal(3)
    logical :: counts
    integer :: i

    do i = first, first + size(mortar%area) - 1
      associate (here => i - first + 1, node => points%node(i), rows => mortar%weights)
        if (placement%is_fixed(i) .or. .not. mortar%area(here) > 0.0_wp) cycle
        if (.not. points%freedom%is_bound(node)) cycle
        normal = mortar%normal(:, here)
        call turn_into_plane(is_across(points, i), normal, counts)
        if (.not. counts) cycle
        normal = undeformed_normal(points, i, normal)
        associate (masters => rows%node(rows%first(here):rows%first(here + 1) - 1), &
                   weight => rows%weight(rows%first(here):rows%first(here + 1) - 1))
          if (.not. are_held(points%freedom, node, masters, weight, normal)) cycle
          placement%is_fixed(i) = .true.
          placement%driven_in(i) = depth_of_motion(scene, points, i, u, masters, weight, normal)
          placement%weights%still(:, i) = .false.
        end associate
      end associate
    end do
  end subroutine find_held_rows

  !> The normal of a point in the undeformed mesh, where that of now is nearly the same:
  !> inclination that deformation makes of flat faces is none, for it would come and go.
  pure function undeformed_normal(points, i, now) result(normal)
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: i
    real(wp), intent(in) :: now(3)
    real(wp) :: normal(3)
    real(wp), parameter :: same_faces = 0.995_wp !! cosine of normals then and now: 6 degrees

    normal = now
    if (dot_product(now, points%freedom%normal(:, i)) > same_faces) normal = &
      points%freedom%normal(:, i)
  end function undeformed_normal

  !> How deep prescribed motion takes a point that is fixed into its master, beyond what it is in
  !> there from the start [length].
  pure real(wp) function depth_of_motion(scene, points, i, u, masters, weight, normal) result(depth)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: i, masters(:)  !! the point; the nodes that it faces
    real(wp), intent(in) :: u(:, :)       !! (3,n_nodes) [length]
    real(wp), intent(in) :: weight(:)     !! of the masters [-]
    real(wp), intent(in) :: normal(3)
    real(wp) :: apart(3), moved(3)
    integer :: k

    associate (node => points%node(i), can_move => points%freedom%can_move)
      apart = scene%mesh%coordinates(:, node)
      moved = 0.0_wp
      do k = 1, size(masters)
        apart = apart - weight(k)*scene%mesh%coordinates(:, masters(k))
        where (.not. can_move(:, masters(k))) moved = moved + weight(k)*(u(:, node) - &
          u(:, masters(k)))
      end do
      where (can_move(:, node)) moved = 0.0_wp
      depth = max(0.0_wp, -dot_product(normal, moved) - max(0.0_wp, dot_product(normal, apart) + &
        points%extra_gap(i)))
    end associate
  end function depth_of_motion

  !> Have points that constraints join to what they face stay as they are in the undeformed mesh,
  !> where weights are nearly those of there.
  !>
  !> What joins them is linear in the displacements, with coefficients of the undeformed mesh. Were
  !> their weights and normals not, contact would contradict it by what these change: by forces of
  !> any size. docs/theory.md (11.20).
  pure subroutine keep_joined(scene, points, pair, side, u, placement, mortar)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair, side
    real(wp), intent(in) :: u(:, :)          !! (3,n_nodes) [length]
    type(placement_t), intent(in) :: placement
    type(mortar_t), intent(inout) :: mortar  !! of the points before the side, as u has them
    type(placement_t) :: at_rest
    type(mortar_t) :: undeformed
    integer, allocatable :: old(:), new(:)
    real(wp), dimension(3, size(u, 2)) :: nothing, moved
    real(wp), allocatable :: weights(:)
    real(wp) :: weight(size(u, 2)), changed
    integer :: i, k, first, last

    allocate (old(0), new(0))
    call find_side_points(points, pair, side, first, last)
    nothing = 0.0_wp
    weight = 0.0_wp
    if (scene%pairs(pair)%small_sliding) then
      undeformed = mortar
      moved = nothing
    else
      at_rest = placement
      call face_surface(scene, points, pair, side, nothing, undeformed, at_rest)
      moved = u
    end if
    do i = first, last
      if (.not. points%is_joined(i)) cycle
      associate (here => i - first + 1, before => undeformed%weights, &
                 now => mortar%weights)
        if (undeformed%area(here) <= enough*undeformed%whole_area(here)) cycle
        old = [(k, k=before%first(here), before%first(here + 1) - 1)]
        new = [(k, k=now%first(here), now%first(here + 1) - 1)]
        weight(now%node(new)) = now%weight(new)
        changed = sum(abs(before%weight(old) - weight(before%node(old))))
        weight(now%node(new)) = 0.0_wp
        if (changed > joined*sum(abs(before%weight(old)))) cycle
        mortar%normal(:, here) = undeformed%normal(:, here)
        mortar%area(here) = undeformed%area(here)
        weights = before%weight(old)
        call face_one(weights)
        ! Apart from each other places that are far from the origin, and motions, keep their digits.
        associate (x => scene%mesh%coordinates, node => points%node(i), masters => before%node(old))
          mortar%apart(:, here) = (x(:, node) - matmul(x(:, masters), weights)) + &
            (moved(:, node) - matmul(moved(:, masters), weights))
        end associate
        call replace_rows(now, here, [1, size(old) + 1], before%node(old), weights)
      end associate
    end do
  end subroutine keep_joined

  !> A normal on planes of symmetry lies in them. One that does not has no direction there.
  pure subroutine turn_into_plane(across, normal, is_in_plane)
    logical, intent(in) :: across(3)
    real(wp), intent(inout) :: normal(3)
    logical, intent(out) :: is_in_plane
    real(wp) :: length

    is_in_plane = .true.
    if (.not. any(across)) return
    where (across) normal = 0.0_wp
    length = norm2(normal)
    is_in_plane = length > 0.0_wp
    if (is_in_plane) normal = normal/length
  end subroutine turn_into_plane

  !> Put other rows in the place of those of some points that stand together.
  pure subroutine replace_rows(weights, point, first, node, weight)
    type(weights_t), intent(inout) :: weights
    integer, intent(in) :: point              !! the first of them
    integer, intent(in) :: first(:)           !! (n+1) where each row begins, from 1
    integer, intent(in) :: node(:)            !! (n_entries)
    real(wp), intent(in) :: weight(:)         !! (n_entries) [-]
    integer :: before, n_old, behind

    behind = point + size(first) - 1 ! the first point behind them
    before = weights%first(point) - 1
    n_old = weights%first(behind) - 1 - before
    if (n_old /= size(node)) then
      weights%node = [weights%node(:before), node, weights%node(before + n_old + 1:)]
      weights%weight = [weights%weight(:before), weight, weights%weight(before + n_old + 1:)]
      weights%first(behind + 1:) = weights%first(behind + 1:) + size(node) - n_old
    else
      weights%node(before + 1:before + n_old) = node
      weights%weight(before + 1:before + n_old) = weight
    end if
    weights%first(point:behind) = before + first
  end subroutine replace_rows

end module placement_mod
