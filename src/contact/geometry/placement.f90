!> Where the contact points stand before their masters: frames, gaps and weights, about which
!> contact is linear until it is placed anew.
module placement_mod
  use kinds_mod, only: wp
  use obstacles_mod, only: obstacle_t
  use obstacle_shapes_mod, only: shift_of, turned, follow_point, rounding_at_rest, &
    has_meshed_master
  use mesh_mod, only: mesh_t
  use scene_mod, only: scene_t
  use sectors_mod, only: no_slip_along
  use state_mod, only: state_t
  use contact_points_mod, only: contact_points_t, is_pair_removed, weights_t, is_across, &
    n_sides, find_side_points, is_in_middle, of_slave
  use local_frame_mod, only: local_frame
  use mortar_rows_mod, only: mortar_t, asked_t, lifted_gap
  use faced_side_mod, only: faced_side_t, face_surface, face_obstacle, keep_joined, &
    turn_into_plane, replace_rows
  implicit none
  private

  public :: placement_t, no_gap, place, place_all, place_undeformed, place_curved, place_state, &
    as_turned, find_partly_covered, leave_ends, join_ends, is_before_flat

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

  ! How much of what counts at all a surface must cover for a point that counted in the same
  ! increment: else points at the edge of the master come and go.
  real(wp), parameter :: part_to_stay = 0.2_wp !! [-]
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
    ! Where nothing of a pair is in reach no end can touch.
    if (allocated(points%alpha)) allocate (placement%weights%alone, source=points%is_held .or. &
      (points%turns .and. .not. points%is_curved .and. .not. points%on_surface))
    do pair = 1, size(scene%pairs)
      call place(scene, points, pair, u, placement, rotation)
    end do
  end subroutine place_all

  !> The points before curved masters, where displacement `u` takes them.
  pure subroutine place_curved(scene, points, u, placement, rotation, stay, everywhere, is_far)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: u(:, :)      !! (3,n_nodes) [length]
    type(placement_t), intent(inout) :: placement
    real(wp), intent(in), optional :: rotation(:, :) !! as of `place`
    logical, intent(in), optional :: stay            !! the same
    logical, intent(in), optional :: everywhere      !! those of pairs out of reach, too; default no
    logical, intent(in), optional :: is_far(:)       !! as of `place`
    logical :: is_wanted(points%n)
    integer :: pair

    is_wanted = points%is_curved
    if (present(everywhere)) is_wanted = is_wanted .or. (everywhere .and. points%turns)
    do pair = 1, size(scene%pairs)
      if (any(is_wanted(points%first(pair):points%first(pair + 1) - 1))) call place(scene, points, &
        pair, u, placement, rotation, stay, is_far)
    end do
  end subroutine place_curved

  !> The points at the displacement of a state, with the weights by which its reactions act.
  pure subroutine place_state(scene, points, undeformed, state, placement, everywhere)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(placement_t), intent(in) :: undeformed
    type(state_t), intent(in) :: state
    type(placement_t), intent(out) :: placement
    logical, intent(in), optional :: everywhere !! as of place_curved

    placement = undeformed
    if (allocated(state%alone)) placement%weights%alone = state%alone
    call place_curved(scene, points, state%displacement, placement, state%rotation, &
      everywhere=everywhere)
  end subroutine place_state

  !> The points of one pair, all of them: weights may be integrals over both surfaces.
  pure subroutine place(scene, points, pair, u, placement, rotation, stay, is_far)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair
    real(wp), intent(in) :: u(:, :)      !! (3,n_nodes) reference nodes of obstacles too [length]
    type(placement_t), intent(inout) :: placement
    real(wp), intent(in), optional :: rotation(:, :)
    !! (3,n_obstacles) rotation vectors; left out: obstacles stand as the deck has them [rad]
    logical, intent(in), optional :: stay
    !! points that count in `placement` do so while next to nothing of them is covered; default: no
    logical, intent(in), optional :: is_far(:)
    !! (n_points) these keep their places before faces, as far as those of others do not depend on
    !! them; left out: none
    type(obstacle_t) :: obstacle
    logical :: keeps(points%n)
    logical :: stays
    integer :: side

    stays = .false.
    if (present(stay)) stays = stay
    if (stays .and. allocated(points%in_reach)) then
      ! Flat facets cover what they do by where it is, not by what they did before.
      associate (first => points%first(pair), last => points%first(pair + 1) - 1)
        stays = .not. any(is_before_flat(points%turns(first:last), &
          points%in_reach(first:last), points%is_curved(first:last)))
      end associate
    end if
    keeps = .false.
    if (present(is_far)) then
      if (stands_alone(scene, points, pair, placement)) keeps = is_far
    end if
    if (has_meshed_master(scene, pair)) then
      obstacle = as_turned(scene, scene%pairs(pair)%master, rotation)
      call place_before_facets(scene, points, pair, u, stays, obstacle, keeps, placement)
    else if (scene%pairs(pair)%master > 0) then
      call place_before_obstacle(scene, points, pair, u, placement, rotation)
    else
      do side = 1, n_sides(points, pair)
        call place_before_surface(scene, points, pair, side, u, stays, keeps, placement)
      end do
    end if
    if (is_pair_removed(points, pair)) call leave_out(points, pair, placement)
  end subroutine place

  !> Whether each row of a pair before faces depends on its own node's faces alone: none has a part
  !> of neighbours that hang, have no multiplier, or are joined to what they face.
  pure logical function stands_alone(scene, points, pair, placement)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair
    type(placement_t), intent(in) :: placement

    associate (first => points%first(pair), last => points%first(pair + 1) - 1)
      stands_alone = .not. any(placement%is_fixed(first:last))
      if (stands_alone .and. allocated(scene%mesh%hangs)) stands_alone = .not. &
        any(scene%mesh%hangs(points%node(first:last)))
      if (stands_alone .and. allocated(points%is_joined)) stands_alone = .not. &
        any(points%is_joined(first:last))
    end associate
  end function stands_alone

  !> Whether a point is before flat facets that are taken for a plane: it turns, is in reach, and is
  !> not placed in every iteration.
  pure elemental logical function is_before_flat(turns, in_reach, is_curved)
    logical, intent(in) :: turns, in_reach, is_curved !! of the point

    is_before_flat = turns .and. in_reach .and. .not. is_curved
  end function is_before_flat

  !> Give the points of a removed pair no gap, weights or area.
  pure subroutine leave_out(points, pair, placement)
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair
    type(placement_t), intent(inout) :: placement
    integer :: i

    associate (first => points%first(pair), last => points%first(pair + 1) - 1)
      placement%gap(first:last) = no_gap
      placement%least_gap(first:last) = no_gap
      placement%unplaced_gap(first:last) = no_gap
      placement%covered_area(first:last) = 0.0_wp
      placement%faced_area(first:last) = 0.0_wp
      placement%entered(first:last) = 0.0_wp
      placement%driven_in(first:last) = 0.0_wp
      placement%is_fixed(first:last) = .false.
      placement%weights%covers(first:last) = .false.
      if (last >= first) call replace_rows(placement%weights, first, [(1, i=first, last + 1)], &
        [integer ::], [real(wp) ::])
    end associate
  end subroutine leave_out

  pure subroutine place_before_obstacle(scene, points, pair, u, placement, rotation)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair
    real(wp), intent(in) :: u(:, :)      !! (3,n_nodes) [length]
    type(placement_t), intent(inout) :: placement
    real(wp), intent(in), optional :: rotation(:, :) !! as of `place`
    type(obstacle_t) :: obstacle
    real(wp) :: shift(3), normal(3), along(3), rounding
    integer :: i, n
    logical :: counts

    associate (master => scene%pairs(pair)%master, &
               first => points%first(pair), last => points%first(pair + 1) - 1)
      obstacle = as_turned(scene, master, rotation)
      shift = shift_of(obstacle, u)
      rounding = rounding_at_rest(scene)
      n = merge(1, 0, obstacle%ref_node > 0)
      do i = first, last
        associate (node => points%node(i), gap => placement%gap(i))
          call follow_point(obstacle, shift, scene%mesh%coordinates(:, node), u(:, node), &
            rounding, gap, normal)
          gap = gap + points%extra_gap(i)
          along = normal ! of the axis, where the node is on that
          call turn_into_plane(is_across(points, i), along, counts)
          if (counts) normal = along
          placement%frame(:, :, i) = local_frame(normal, no_slip_along(scene%mesh, node, .false.))
          placement%reference(:, i) = of_slave(points, placement%weights, i, u) - shift
        end associate
      end do
      call combine_along_edges(points, placement%weights, first, last, placement%gap)
      placement%covered_area(first:last) = points%area(first:last)
      placement%least_gap(first:last) = no_gap
      ! A rigid master moves as its reference node does.
      call replace_rows(placement%weights, first, [(1 + n*(i - first), i=first, last + 1)], &
        spread(obstacle%ref_node, 1, n*(last - first + 1)), &
        spread(1.0_wp, 1, n*(last - first + 1)))
    end associate
  end subroutine place_before_obstacle

  !> Gaps of nodes in the middles of edges become those of their points, as displacements do: those
  !> of all nodes at their places, of which the ends of edges keep theirs. docs/theory.md (9.11).
  pure subroutine combine_along_edges(points, weights, first, last, gap)
    type(contact_points_t), intent(in) :: points
    type(weights_t), intent(in) :: weights
    integer, intent(in) :: first, last       !! of a pair
    real(wp), intent(inout) :: gap(:)        !! (n_points) [length]
    integer :: i

    if (.not. allocated(points%alpha)) return
    do i = first, last
      if (.not. is_in_middle(points, weights, i)) cycle
      associate (alpha => points%alpha(i), ends => points%end_point(:, i))
        gap(i) = (gap(i) - alpha*(gap(ends(1)) + gap(ends(2))))/(1.0_wp - 2.0_wp*alpha)
      end associate
    end do
  end subroutine combine_along_edges

  !> Leave the ends of edges out of the points in their middles where neither can touch: these would
  !> press at a distance. They cannot where nothing of them is inside the obstacle at a displacement
  !> that contact does not keep from entering. At finite strain no displacement is without contact:
  !> there they can where one presses as the increment begins, or presses after all (join_ends), and
  !> until the point presses no more: by itself it might press so that an end has to.
  !> docs/theory.md section 9.
  pure subroutine leave_ends(scene, points, u, rotation, old, placement)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: u(:, :)               !! (3,n_nodes) without contact [length]
    real(wp), intent(in) :: rotation(:, :)        !! as of `place`
    type(state_t), intent(in) :: old              !! where the increment begins
    type(placement_t), intent(inout) :: placement !! gets those that are alone
    type(placement_t) :: without
    logical, dimension(points%n) :: presses, can_touch, is_joined
    integer :: pair, i

    if (.not. allocated(points%alpha)) return
    presses = any(abs(old%reaction) > 0.0_wp, dim=1)
    is_joined = presses .and. scene%finite_strain .and. allocated(old%alone)
    if (allocated(old%alone)) is_joined = is_joined .and. .not. old%alone
    without = placement
    without%weights%alone = .true.
    do pair = 1, size(scene%pairs)
      associate (first => points%first(pair), last => points%first(pair + 1) - 1)
        if (any(points%is_curved(first:last) .and. .not. points%on_surface(first:last))) call &
          place(scene, points, pair, u, without, rotation)
      end associate
    end do
    can_touch = merge(presses, without%gap <= 0.0_wp, scene%finite_strain)
    do i = 1, points%n
      if (.not. (points%alpha(i) > 0.0_wp .and. points%is_curved(i))) cycle
      if (points%on_surface(i)) cycle
      placement%weights%alone(i) = points%is_held(i) .or. .not. (is_joined(i) .or. &
        any(can_touch(points%end_point(:, i))))
    end do
  end subroutine leave_ends

  !> At finite strain: give points in the middles of edges that were alone their ends where one of
  !> these presses after all. They never lose them within an increment, so that this ends.
  pure subroutine join_ends(points, reaction, alone, is_any)
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: reaction(:, :)  !! (3,n_points) [force]
    logical, intent(inout) :: alone(:)      !! (n_points) as of weights_t
    logical, intent(out) :: is_any          !! of them was alone and is no more
    integer :: i

    is_any = .false.
    do i = 1, points%n
      if (.not. alone(i) .or. points%is_held(i) .or. points%on_surface(i)) cycle
      if (.not. (points%alpha(i) > 0.0_wp .and. points%is_curved(i))) cycle
      alone(i) = .not. any(abs(reaction(:, points%end_point(:, i))) > 0.0_wp)
      is_any = is_any .or. .not. alone(i)
    end do
  end subroutine join_ends

  !> An obstacle as it has turned.
  pure type(obstacle_t) function as_turned(scene, master, rotation) result(obstacle)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: master
    real(wp), intent(in), optional :: rotation(:, :) !! as of `place`

    obstacle = scene%obstacles(master)
    if (obstacle%turns .and. present(rotation)) obstacle = turned(obstacle, rotation(:, master), &
      scene%mesh%coordinates(:, obstacle%ref_node))
  end function as_turned

  !> Weights, normals and gaps of docs/theory.md (11.2) to (11.4), of the nodes where they are now;
  !> with small sliding of the undeformed mesh, from which gaps then grow linearly.
  pure subroutine place_before_surface(scene, points, pair, side, u, stay, keeps, placement)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair, side
    real(wp), intent(in) :: u(:, :)      !! (3,n_nodes) [length]
    logical, intent(in) :: stay
    logical, intent(in) :: keeps(:)      !! (n_points) their places
    type(placement_t), intent(inout) :: placement
    type(faced_side_t) :: faced
    type(weights_t) :: rows
    real(wp) :: moved                    !! along the normal [length]
    integer :: i, k, first, last

    call find_side_points(points, pair, side, first, last)
    if (all(keeps(first:last))) return
    if (any(keeps(first:last))) then
      call face_surface(scene, points, pair, side, u, faced, asked_t(is_far=keeps))
      if (allocated(placement%weights%still)) faced%still = merge(placement%weights%still(:, &
        first:last), faced%still, spread(keeps(first:last), 1, 3))
      ! None of these was fixed, and of their faces some are left out.
      faced%is_fixed = faced%is_fixed .and. .not. keeps(first:last)
      where (keeps(first:last)) faced%driven_in = 0.0_wp
    else
      call face_surface(scene, points, pair, side, u, faced)
    end if
    placement%is_fixed(first:last) = faced%is_fixed
    placement%driven_in(first:last) = faced%driven_in
    associate (weights => placement%weights)
      if (any(faced%still) .and. .not. allocated(weights%still)) allocate (weights%still(3, &
        points%n), source=.false.)
      if (allocated(weights%still)) weights%still(:, first:last) = faced%still
    end associate
    if (allocated(points%is_joined)) then
      if (any(points%is_joined(first:last))) call keep_joined(scene, points, pair, side, u, &
        faced%mortar)
    end if
    call place_covered(scene%mesh, points, first, stay, keeps, faced%mortar, placement)
    associate (n => size(faced%mortar%weights%node) + placement%weights%first(last + 1) - &
               placement%weights%first(first))
      allocate (rows%first(last - first + 2), rows%node(n), rows%weight(n))
    end associate
    k = 0
    do i = first, last
      associate (here => i - first + 1, mortar => faced%mortar)
        rows%first(here) = k + 1
        if (.not. placement%weights%covers(i)) cycle
        if (keeps(i)) then
          call keep_row(placement%weights, i, rows, k)
          cycle
        end if
        placement%reference(:, i) = of_slave(points, placement%weights, i, u)
        associate (its => mortar%weights, last_one => mortar%weights%first(here + 1) - 1)
          call add_to_row(its%node(its%first(here):last_one), its%weight(its%first(here): &
            last_one), u, rows, k, placement%reference(:, i))
        end associate
        if (scene%pairs(pair)%small_sliding) then
          moved = dot_product(mortar%normal(:, here), placement%reference(:, i))
          placement%gap(i) = placement%gap(i) + moved
        else
          placement%gap(i) = placement%gap(i) + lift_alone(points, placement%weights, i, u, &
            mortar%normal(:, here))
        end if
        placement%gap(i) = lifted_gap(mortar, here, placement%gap(i) - points%extra_gap(i)) + &
          points%extra_gap(i)
      end associate
    end do
    rows%first(last - first + 2) = k + 1
    call replace_rows(placement%weights, first, rows%first, rows%node(:k), rows%weight(:k))
  end subroutine place_before_surface

  !> The same before facets of an obstacle, wherever it has turned and moved to: what covers a point
  !> moves as its reference node does, with weight 1, the last of its row.
  pure subroutine place_before_facets(scene, points, pair, u, stay, obstacle, keeps, placement)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair
    real(wp), intent(in) :: u(:, :)      !! (3,n_nodes) [length]
    logical, intent(in) :: stay
    type(obstacle_t), intent(in) :: obstacle !! as it has turned
    logical, intent(in) :: keeps(:)      !! (n_points) their places
    type(placement_t), intent(inout) :: placement
    integer :: side

    do side = 1, n_sides(points, pair)
      call place_side(side, placement)
    end do

  contains

    pure subroutine place_side(side, placement)
      integer, intent(in) :: side
      type(placement_t), intent(inout) :: placement
      type(mortar_t) :: mortar
      type(weights_t) :: rows
      real(wp) :: shift(3)
      integer :: i, k, first, last

      call find_side_points(points, pair, side, first, last)
      if (all(keeps(first:last))) return
      shift = shift_of(obstacle, u)
      if (any(keeps(first:last))) then
        call face_obstacle(scene, points, pair, side, u, obstacle, mortar, &
          asked_t(is_far=keeps))
      else
        call face_obstacle(scene, points, pair, side, u, obstacle, mortar)
      end if
      call place_covered(scene%mesh, points, first, stay, keeps, mortar, placement)
      associate (n => size(mortar%weights%node) + last - first + 1 + placement%weights%first( &
                 last + 1) - placement%weights%first(first))
        allocate (rows%first(last - first + 2), rows%node(n), rows%weight(n))
      end associate
      k = 0
      do i = first, last
        associate (here => i - first + 1)
          rows%first(here) = k + 1
          if (keeps(i)) then
            call keep_row(placement%weights, i, rows, k)
            cycle
          end if
          placement%apart(:, i) = 0.0_wp
          if (.not. placement%weights%covers(i)) cycle
          placement%apart(:, i) = mortar%apart(:, here)
          placement%gap(i) = lifted_gap(mortar, here, placement%gap(i) + lift_alone(points, &
            placement%weights, i, u, mortar%normal(:, here)) - points%extra_gap(i)) + &
            points%extra_gap(i)
          placement%reference(:, i) = of_slave(points, placement%weights, i, u) - shift
          associate (its => mortar%weights, last_one => mortar%weights%first(here + 1) - 1)
            call add_to_row(points%node(first - 1 + its%node(its%first(here):last_one)), &
              its%weight(its%first(here):last_one), u, rows, k, placement%reference(:, i))
          end associate
          if (obstacle%ref_node == 0) cycle
          k = k + 1
          rows%node(k) = obstacle%ref_node
          rows%weight(k) = 1.0_wp
        end associate
      end do
      rows%first(last - first + 2) = k + 1
      call replace_rows(placement%weights, first, rows%first, rows%node(:k), rows%weight(:k))
    end subroutine place_side

  end subroutine place_before_facets

  !> Append nodes with their weights to a row, and subtract their motion from the motion of the row.
  pure subroutine add_to_row(node, weight, u, rows, n, motion)
    integer, intent(in) :: node(:)
    real(wp), intent(in) :: weight(:)      !! [-]
    real(wp), intent(in) :: u(:, :)        !! (3,n_nodes) [length]
    type(weights_t), intent(inout) :: rows !! room for more
    integer, intent(inout) :: n            !! entries so far
    real(wp), intent(inout) :: motion(3)   !! [length]
    integer :: k

    do k = 1, size(node)
      if (.not. abs(weight(k)) > 0.0_wp) cycle
      n = n + 1
      rows%node(n) = node(k)
      rows%weight(n) = weight(k)
      motion = motion - weight(k)*u(:, node(k))
    end do
  end subroutine add_to_row

  !> Append the row of a point as it is.
  pure subroutine keep_row(weights, i, rows, n)
    type(weights_t), intent(in) :: weights
    integer, intent(in) :: i               !! the point
    type(weights_t), intent(inout) :: rows !! room for more
    integer, intent(inout) :: n            !! entries so far

    associate (from => weights%first(i), to => weights%first(i + 1) - 1)
      rows%node(n + 1:n + 1 + to - from) = weights%node(from:to)
      rows%weight(n + 1:n + 1 + to - from) = weights%weight(from:to)
      n = n + 1 + to - from
    end associate
  end subroutine keep_row

  !> How much further along the normal a node in the middle of an edge has moved than its point of
  !> (9.11), where it is one by itself; 0 of others.
  pure real(wp) function lift_alone(points, weights, i, u, normal) result(lift)
    type(contact_points_t), intent(in) :: points
    type(weights_t), intent(in) :: weights
    integer, intent(in) :: i
    real(wp), intent(in) :: u(:, :)      !! (3,n_nodes) [length]
    real(wp), intent(in) :: normal(3)

    lift = 0.0_wp
    if (.not. allocated(points%alpha)) return
    if (.not. (points%alpha(i) > 0.0_wp .and. weights%alone(i))) return
    associate (alpha => points%alpha(i), ends => points%node(points%end_point(:, i)))
      lift = alpha/(1.0_wp - 2.0_wp*alpha)*dot_product(normal, u(:, ends(1)) + u(:, ends(2)) - &
        2.0_wp*u(:, points%node(i)))
    end associate
  end function lift_alone

  !> Normals, gaps and areas of the points that faces cover, and which these are.
  pure subroutine place_covered(mesh, points, first, stay, keeps, mortar, placement)
    type(mesh_t), intent(in) :: mesh
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: first            !! of these points
    logical, intent(in) :: stay             !! as of `place`
    logical, intent(in) :: keeps(:)         !! (n_points) nothing changes
    type(mortar_t), intent(inout) :: mortar !! of these points; normals turn into planes
    type(placement_t), intent(inout) :: placement
    real(wp), parameter :: along_x(3) = [1.0_wp, 0.0_wp, 0.0_wp]
    real(wp) :: around(3), normal(3)
    integer :: i
    logical :: counts

    ! Both half planes have the same part in the faces.
    around = no_slip_along(mesh, 1, .true.)
    do i = first, first + size(mortar%area) - 1
      if (keeps(i)) cycle
      associate (here => i - first + 1, covers => placement%weights%covers)
        counts = mortar%area(here) > mortar%least(here)*mortar%whole_area(here)
        if (stay .and. covers(i)) counts = mortar%area(here) > part_to_stay*mortar%least(here)* &
          mortar%whole_area(here)
        if (counts) call turn_into_plane(is_across(points, i), mortar%normal(:, here), counts)
        covers(i) = counts
        placement%unplaced_gap(i) = no_gap
        placement%entered(i) = merge(mortar%entered(here), 0.0_wp, counts)
        if (.not. counts .and. mortar%area(here) > a_little*mortar%whole_area(here)) then
          placement%unplaced_gap(i) = mortar%least_gap(here) + points%extra_gap(i)
        end if
        if (counts) then
          placement%frame(:, :, i) = local_frame(mortar%normal(:, here), around)
          placement%gap(i) = dot_product(mortar%normal(:, here), mortar%apart(:, here)) + &
            points%extra_gap(i)
          placement%least_gap(i) = mortar%least_gap(here) + points%extra_gap(i)
          placement%covered_area(i) = mortar%area(here)
          placement%faced_area(i) = mortar%faced_area(here)
        else
          normal = -mortar%outward(:, here)
          ! No slave face has the node now.
          if (.not. norm2(normal) > 0.0_wp) normal = along_x
          placement%frame(:, :, i) = local_frame(normal, around)
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

end module placement_mod
