!> Where the contact points stand before their masters: frames, gaps and weights, about which
!> contact is linear until it is placed anew.
module placement_mod
  use kinds_mod, only: wp
  use obstacles_mod, only: obstacle_t
  use obstacle_shapes_mod, only: shift_of, turned, locate_point, has_meshed_master
  use scene_mod, only: scene_t
  use local_refinement_mod, only: hanging_of
  use surfaces_mod, only: nodes_of
  use contact_points_mod, only: contact_points_t, weights_t, is_across, face_one
  use local_frame_mod, only: local_frame
  use mortar_mod, only: mortar_t, slave_t, make_mortar, reach_of_faces, reach_of_all, enough
  use facet_mortar_mod, only: facet_pair_t, join_facets, face_facets, reach_of_facets, &
    reach_of_all_facets
  implicit none
  private

  public :: placement_t, no_gap, place, place_all, place_undeformed, place_curved

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
    real(wp), allocatable :: least_gap(:)
    !! (n_points) before faces: at points of the quadrature on the node's faces, the extra gap
    !! added; `no_gap` elsewhere [length]
    real(wp), allocatable :: unplaced_gap(:)
    !! (n_points) the same of a point that faces cover a little, but not enough for it to count;
    !! `no_gap` elsewhere [length]
    real(wp), allocatable :: apart(:, :)
    !! (3,n_points) before facets of an obstacle: place of the node less that of what it faces; 0
    !! elsewhere [length]
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
    allocate (placement%drag(3, points%n), placement%apart(3, points%n), source=0.0_wp)
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

    logical :: stays

    stays = .false.
    if (present(stay)) stays = stay
    if (has_meshed_master(scene, pair)) then
      call place_before_facets(scene, points, pair, u, stays, placement, rotation)
    else if (scene%pairs(pair)%master > 0) then
      call place_before_obstacle(scene, points, pair, u, placement, rotation)
    else
      call place_before_surface(scene, points, pair, u, stays, placement)
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
  pure subroutine place_before_surface(scene, points, pair, u, stay, placement)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair
    real(wp), intent(in) :: u(:, :)      !! (3,n_nodes) [length]
    logical, intent(in) :: stay
    type(placement_t), intent(inout) :: placement
    type(mortar_t) :: mortar
    type(weights_t) :: rows
    integer :: i, k, j, n

    associate (first => points%first(pair), last => points%first(pair + 1) - 1)
      n = last - first + 1
      call face_surface(scene, points, pair, u, mortar)
      if (allocated(points%is_joined)) then
        if (any(points%is_joined(first:last))) call keep_joined(scene, points, pair, u, mortar)
      end if
      call place_covered(points, pair, stay, mortar, placement)
      allocate (rows%first(n + 1), rows%node(size(mortar%weights%node)), &
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
      rows%first(n + 1) = k + 1
      call replace_rows(placement%weights, first, rows%first, rows%node(:k), rows%weight(:k))
    end associate
  end subroutine place_before_surface

  !> The same before facets of an obstacle, wherever it has turned and moved to: what covers a point
  !> moves as its reference node does, with weight 1.
  pure subroutine place_before_facets(scene, points, pair, u, stay, placement, rotation)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair
    real(wp), intent(in) :: u(:, :)      !! (3,n_nodes) [length]
    logical, intent(in) :: stay
    type(placement_t), intent(inout) :: placement
    real(wp), intent(in), optional :: rotation(:, :) !! as of `place`
    type(obstacle_t) :: obstacle
    type(mortar_t) :: mortar
    type(weights_t) :: rows
    real(wp) :: shift(3)
    integer :: i, k

    associate (master => scene%pairs(pair)%master, &
               first => points%first(pair), last => points%first(pair + 1) - 1)
      obstacle = as_turned(scene, master, rotation)
      shift = shift_of(obstacle, u)
      call face_obstacle(scene, points, pair, u, obstacle, shift, mortar)
      call place_covered(points, pair, stay, mortar, placement)
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
    end associate
  end subroutine place_before_facets

  !> Normals, gaps and areas of the points that faces cover, and which these are.
  pure subroutine place_covered(points, pair, stay, mortar, placement)
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair
    logical, intent(in) :: stay            !! as of `place`
    type(mortar_t), intent(inout) :: mortar !! of the points of the pair; normals turn into planes
    type(placement_t), intent(inout) :: placement
    integer :: i
    logical :: counts

    do i = points%first(pair), points%first(pair + 1) - 1
      associate (here => i - points%first(pair) + 1, covers => placement%weights%covers)
        counts = mortar%area(here) > enough*mortar%whole_area(here)
        if (stay .and. covers(i)) counts = mortar%area(here) > &
          enough_to_stay*mortar%whole_area(here)
        if (counts) call turn_into_plane(is_across(points, i), mortar%normal(:, here), counts)
        covers(i) = counts
        placement%unplaced_gap(i) = no_gap
        if (.not. counts .and. mortar%area(here) > a_little*mortar%whole_area(here)) then
          placement%unplaced_gap(i) = mortar%least_gap(here) + points%extra_gap(i)
        end if
        if (counts) then
          placement%frame(:, :, i) = local_frame(mortar%normal(:, here))
          placement%gap(i) = dot_product(mortar%normal(:, here), mortar%apart(:, here)) + &
            points%extra_gap(i)
          placement%least_gap(i) = mortar%least_gap(here) + points%extra_gap(i)
          placement%covered_area(i) = mortar%area(here)
        else
          placement%frame(:, :, i) = local_frame(-mortar%outward(:, here))
          placement%gap(i) = no_gap
          placement%least_gap(i) = no_gap
          placement%covered_area(i) = 0.0_wp
          placement%reference(:, i) = 0.0_wp
        end if
      end associate
    end do
  end subroutine place_covered

  !> What the nodes of a slave surface face of an obstacle of facets where it stands.
  pure subroutine face_obstacle(scene, points, pair, u, obstacle, shift, mortar)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair
    real(wp), intent(in) :: u(:, :)       !! (3,n_nodes) [length]
    type(obstacle_t), intent(in) :: obstacle !! as it has turned
    real(wp), intent(in) :: shift(3)      !! [length]
    type(mortar_t), intent(out) :: mortar !! of the points of the pair
    real(wp) :: x(3, scene%mesh%n_nodes), reach
    real(wp), dimension(3, size(obstacle%corner, 2)) :: way
    type(facet_pair_t) :: now

    associate (of => scene%pairs(pair), mesh => scene%mesh, &
               s => points%node(points%first(pair):points%first(pair + 1) - 1))
      way = obstacle%corner + spread(shift, 2, size(way, 2)) - scene%obstacles(of%master)%corner
      ! What came to overlap has moved as far.
      x = 0.0_wp
      x(:, s) = mesh%coordinates(:, s) + u(:, s)
      now = join_facets(slave_t(nodes_of(scene%surfaces(of%surface)%faces, mesh%connectivity), s, &
        hanging_of(mesh%hangs, mesh%between, mesh%n_given, s)), x, obstacle, shift)
      reach = reach_of_facets(now) + of%overlap + &
        norm2(max(maxval(u(:, s), 2) - minval(way, 2), maxval(way, 2) - minval(u(:, s), 2)))
      call face_facets(now, reach, mortar)
      ! What moves freely may fall any way.
      if (any(mortar%area > 0.0_wp)) return
      call face_facets(now, reach + reach_of_all_facets(now), mortar, behind=reach)
    end associate
  end subroutine face_obstacle

  !> What the nodes of a slave surface face where `u` takes them, or with small sliding where they
  !> are in the mesh.
  pure subroutine face_surface(scene, points, pair, u, mortar)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair
    real(wp), intent(in) :: u(:, :)       !! (3,n_nodes) [length]
    type(mortar_t), intent(out) :: mortar !! of the points of the pair
    real(wp) :: x(3, scene%mesh%n_nodes), reach
    type(slave_t) :: slave
    integer, allocatable :: master(:, :)
    logical :: is_apart

    associate (of => scene%pairs(pair), mesh => scene%mesh, &
               slave_nodes => points%node(points%first(pair):points%first(pair + 1) - 1), &
               s => scene%surfaces(scene%pairs(pair)%surface)%nodes, &
               m => scene%surfaces(scene%pairs(pair)%master_surface)%nodes)
      slave = slave_t(nodes_of(scene%surfaces(of%surface)%faces, mesh%connectivity), slave_nodes, &
        hanging_of(mesh%hangs, mesh%between, mesh%n_given, slave_nodes))
      allocate (master, source=nodes_of(scene%surfaces(of%master_surface)%faces, &
        mesh%connectivity))
      x = 0.0_wp
      x(:, s) = mesh%coordinates(:, s)
      x(:, m) = mesh%coordinates(:, m)
      reach = reach_of_faces(slave%faces, master, x) + of%overlap
      if (.not. of%small_sliding) then
        ! What came to overlap has moved as far.
        reach = reach + norm2(max(maxval(u(:, s), 2) - minval(u(:, m), 2), &
          maxval(u(:, m), 2) - minval(u(:, s), 2)))
        x(:, s) = x(:, s) + u(:, s)
        x(:, m) = x(:, m) + u(:, m)
        call make_mortar(slave, master, x, reach, mortar)
      end if
      ! What is placed once for all faces whatever lies opposite. So do bodies that are apart: what
      ! moves freely may fall any way.
      is_apart = of%small_sliding
      if (.not. is_apart) is_apart = .not. any(mortar%area > 0.0_wp)
      if (.not. is_apart) return
      call make_mortar(slave, master, x, reach + reach_of_all(s, m, x), mortar, behind=reach)
    end associate
  end subroutine face_surface

  !> Have points that constraints join to what they face stay as they are in the undeformed mesh,
  !> where weights are nearly those of there.
  !>
  !> What joins them is linear in the displacements, with coefficients of the undeformed mesh. Were
  !> their weights and normals not, contact would contradict it by what these change: by forces of
  !> any size. docs/theory.md (11.20).
  pure subroutine keep_joined(scene, points, pair, u, mortar)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair
    real(wp), intent(in) :: u(:, :)          !! (3,n_nodes) [length]
    type(mortar_t), intent(inout) :: mortar  !! of the points of the pair, as u has them
    type(mortar_t) :: undeformed
    integer, allocatable :: old(:), new(:)
    real(wp), dimension(3, size(u, 2)) :: nothing, moved
    real(wp), allocatable :: weights(:)
    real(wp) :: weight(size(u, 2)), changed
    integer :: i, k

    nothing = 0.0_wp
    weight = 0.0_wp
    if (scene%pairs(pair)%small_sliding) then
      undeformed = mortar
      moved = nothing
    else
      call face_surface(scene, points, pair, nothing, undeformed)
      moved = u
    end if
    do i = points%first(pair), points%first(pair + 1) - 1
      if (.not. points%is_joined(i)) cycle
      associate (here => i - points%first(pair) + 1, before => undeformed%weights, &
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
