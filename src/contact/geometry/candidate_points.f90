!> The candidate contact points of a scene: every node of every slave surface, once an obstacle, and
!> once a side of the master of a pair of surfaces.
!>
!> Work and memory grow with the points and the nodes, not with their product with pairs or cards.
module candidate_points_mod
  use kinds_mod, only: wp
  use connectivity_mod, only: corners_in
  use face_directions_mod, only: add_what_continues
  use face_overlap_mod, only: outward_normal
  use obstacle_shapes_mod, only: has_fixed_normals, has_meshed_master, is_before_faces, &
    has_flat_facets, locate_point
  use refine_elements_mod, only: fill_between
  use mesh_mod, only: mesh_t
  use scene_mod, only: scene_t, contact_gap_t
  use step_contact_mod, only: find_laws, most_friction, removed_in
  use errors_mod, only: error_t, raise, exit_wrong_input
  use friction_laws_mod, only: friction_law_t, needs_area
  use text_mod, only: to_text
  use contact_points_mod, only: contact_points_t, find_side_points, n_sides
  use local_refinement_mod, only: fold_to_parents, hanging_of
  use mesh_forces_mod, only: add_nodal_areas
  use master_sides_mod, only: find_sides, area_of_face
  use own_sides_mod, only: find_own_sides
  use sorting_mod, only: sort_unique
  use surface_reach_mod, only: against
  use surfaces_mod, only: surface_t, all_nodes_of, find_middles, nodes_of, split_faces
  use placement_mod, only: placement_t, place_undeformed
  implicit none
  private

  public :: find_points, check_removed, check_areas, find_curved, list_master_nodes, areas_at
  public :: take_deformed_areas, areas_apart, may_turn_to, faces_towards

contains

  !> All points, pair by pair, with their areas and extra gaps.
  !>
  !> A node that several pairs bring before the same obstacle belongs to the first of them, but for
  !> obstacles of facets.
  subroutine find_points(scene, points)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(out) :: points
    real(wp) :: area(scene%mesh%n_nodes), mu(size(scene%pairs))
    logical, allocatable :: is_new(:)
    integer, allocatable :: ends(:, :)
    real(wp), allocatable :: alpha(:)
    integer :: pair, side, i, k, slot, begin
    logical :: is_bent

    allocate (points%first(size(scene%pairs) + 1))
    call find_own_sides(scene, points)
    call list_master_nodes(scene, points)
    call divide_masters(scene, points)
    call find_new(scene, is_new)
    points%n = count(is_new)
    do pair = 1, size(scene%pairs)
      points%n = points%n + (n_sides(points, pair) - 1)* &
        size(scene%surfaces(scene%pairs(pair)%surface)%nodes)
    end do
    allocate (points%pair(points%n), points%node(points%n))
    allocate (points%area(points%n), points%turns(points%n))
    allocate (points%on_surface(points%n), points%across(3, points%n), source=.false.)
    k = 0
    slot = 0
    do pair = 1, size(scene%pairs)
      points%first(pair) = k + 1
      associate (surface => scene%surfaces(scene%pairs(pair)%surface))
        call find_edges(scene, pair, ends, alpha)
        call find_areas(scene, scene%mesh, pair, ends, alpha, area)
        is_bent = has_fixed_normals(scene, pair) .and. .not. is_before_faces(scene%pairs(pair), &
          scene%obstacles)
        if (is_bent) is_bent = any_bent(scene%mesh%coordinates, surface%nodes, ends, &
          scene%obstacles(scene%pairs(pair)%master)%normal, scene%finite_strain)
        begin = slot
        do side = 1, n_sides(points, pair)
          slot = begin
          do i = 1, size(surface%nodes)
            slot = slot + 1
            if (.not. is_new(slot)) cycle
            k = k + 1
            points%pair(k) = pair
            points%node(k) = surface%nodes(i)
            points%area(k) = area(surface%nodes(i))
            points%turns(k) = .not. has_fixed_normals(scene, pair) .or. is_bent
            points%on_surface(k) = is_before_faces(scene%pairs(pair), scene%obstacles)
          end do
        end do
      end associate
    end do
    points%first(size(scene%pairs) + 1) = k + 1
    ! What a plan has rows for; each *STEP sets its own.
    mu = most_friction(scene)
    points%mu = mu(points%pair)
    call find_laws(scene, 0, points%laws)
    call find_curved(scene, points)
    call join_ends(scene, points)
    call find_extra_gaps(scene, points)
  end subroutine find_points

  !> Refuse pairs of which one alone is removed, where they share nodes before the same obstacle:
  !> the points of these belong to the first of them.
  pure subroutine check_removed(scene, error)
    type(scene_t), intent(in) :: scene
    type(error_t), allocatable, intent(out) :: error
    logical :: is_removed(size(scene%pairs)), is_slave(scene%mesh%n_nodes)
    integer :: step, pair, other

    do step = 1, size(scene%steps)
      if (.not. allocated(scene%steps(step)%pair_changes)) cycle
      is_removed = removed_in(scene, step)
      do pair = 1, size(scene%pairs)
        if (is_before_faces(scene%pairs(pair), scene%obstacles)) cycle
        is_slave = .false.
        is_slave(scene%surfaces(scene%pairs(pair)%surface)%nodes) = .true.
        do other = pair + 1, size(scene%pairs)
          if (scene%pairs(other)%master /= scene%pairs(pair)%master) cycle
          if (is_removed(pair) .eqv. is_removed(other)) cycle
          if (.not. any(is_slave(scene%surfaces(scene%pairs(other)%surface)%nodes))) cycle
          call raise(error, exit_wrong_input, "step "//to_text(step)//" removes one of the "// &
            "pairs '"//scene%pairs(pair)%name//"' and '"//scene%pairs(other)%name// &
            "' alone, which share nodes: remove both, or make surfaces without a common node")
          return
        end do
      end do
    end do
  end subroutine check_removed

  !> Which points are placed in every iteration: not those of a pair that has none in reach. Nor
  !> those before flat facets, whose normals and gaps are those of a plane for as long as these
  !> cover the same points, which is watched: then they turn, are in reach, and are not curved.
  pure subroutine find_curved(scene, points, follow_flat)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(inout) :: points
    logical, intent(in), optional :: follow_flat !! flat facets are facets like others; default no
    logical :: follows
    integer :: pair

    points%is_curved = points%turns
    if (.not. allocated(points%in_reach)) return
    follows = .false.
    if (present(follow_flat)) follows = follow_flat
    do pair = 1, size(points%first) - 1
      associate (first => points%first(pair), last => points%first(pair + 1) - 1)
        if (.not. any(points%in_reach(first:last))) then
          points%is_curved(first:last) = .false.
        else if (.not. follows) then
          if (has_flat_facets(scene, pair)) points%is_curved(first:last) = .false.
        end if
      end associate
    end do
  end subroutine find_curved

  !> The areas of all points where a displacement takes their faces.
  pure function areas_at(scene, points, u) result(areas)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: u(:, :)   !! (3,n_nodes) [length]
    real(wp) :: areas(points%n)       !! [length^2]
    integer,  allocatable :: ends(:, :)
    real(wp), allocatable :: alpha(:)
    type(mesh_t) :: mesh
    real(wp) :: of_node(scene%mesh%n_nodes)
    integer :: pair

    mesh = scene%mesh
    mesh%coordinates = mesh%coordinates + u
    do pair = 1, size(scene%pairs)
      call find_edges(scene, pair, ends, alpha)
      call find_areas(scene, mesh, pair, ends, alpha, of_node)
      associate (first => points%first(pair), last => points%first(pair + 1) - 1)
        areas(first:last) = of_node(points%node(first:last))
      end associate
    end do
  end function areas_at

  !> Take the areas of the deformed faces before obstacles where friction depends on the pressure at
  !> finite strain.
  pure subroutine take_deformed_areas(scene, points, u, placement)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: u(:, :)   !! (3,n_nodes) [length]
    type(placement_t), intent(inout) :: placement

    if (.not. (scene%finite_strain .and. allocated(points%laws))) return
    where (.not. points%on_surface) placement%covered_area = areas_at(scene, points, u)
  end subroutine take_deformed_areas

  !> How far areas that friction depends on are from those of a displacement.
  pure real(wp) function areas_apart(scene, points, u, placement) result(apart)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: u(:, :)   !! (3,n_nodes) [length]
    type(placement_t), intent(in) :: placement
    type(placement_t) :: there

    apart = 0.0_wp
    if (.not. (scene%finite_strain .and. allocated(points%laws))) return
    allocate (there%covered_area, source=placement%covered_area)
    call take_deformed_areas(scene, points, u, there)
    apart = maxval([0.0_wp, abs(there%covered_area - placement%covered_area)/max(tiny(1.0_wp), &
      there%covered_area)])
  end function areas_apart

  !> Refuse friction that depends on the pressure where points have no area.
  pure subroutine check_areas(scene, points, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(error_t), allocatable, intent(out) :: error
    type(friction_law_t), allocatable :: laws(:)
    integer :: step, i

    do step = 0, size(scene%steps)
      call find_laws(scene, step, laws)
      if (.not. allocated(laws)) return
      do i = 1, points%n
        if (points%area(i) > 0.0_wp .or. .not. needs_area(laws(points%pair(i)))) cycle
        call raise(error, exit_wrong_input, "the slaves of the contact pair '"//scene%pairs( &
          points%pair(i))%name//"' have no area where no face of them is, so no pressure: "// &
          "*FRICTION over the pressure or with TAUMAX needs slave surfaces of whole faces")
        return
      end do
    end do
  end subroutine check_areas

  !> The areas of the points of a pair, at the nodes of its slave; 0 at all others. Before a shape
  !> of general contact faces count that are turned towards it, and what continues them, where a
  !> node has any.
  pure subroutine find_areas(scene, mesh, pair, ends, alpha, area)
    type(scene_t), intent(in) :: scene
    type(mesh_t), intent(in) :: mesh      !! its mesh, where nodes are
    integer, intent(in) :: pair
    integer, intent(in) :: ends(:, :)     !! as of find_edges
    real(wp), intent(in) :: alpha(:)      !! the same
    real(wp), intent(out) :: area(:)      !! (n_nodes) [length^2]
    real(wp) :: of_turned(size(area))
    type(surface_t) :: surface
    logical, allocatable :: counts(:)
    integer :: f

    surface = scene%surfaces(scene%pairs(pair)%surface)
    area = 0.0_wp
    call add_nodal_areas(mesh, surface, area)
    if (may_turn_to(scene, pair)) then
      allocate (counts(size(surface%faces, 2)), source=.false.)
      counts(faces_towards(scene, pair)) = .true.
      call add_what_continues(nodes_of(surface%faces, mesh%connectivity), &
        scene%mesh%coordinates, counts)
      surface%faces = surface%faces(:, pack([(f, f=1, size(counts))], counts))
      of_turned = 0.0_wp
      call add_nodal_areas(mesh, surface, of_turned)
      where (of_turned > 0.0_wp) area = of_turned
    end if
    call share_areas(surface%nodes, ends, alpha, area)
    if (allocated(mesh%hangs)) call fold_to_parents(mesh%hangs, mesh%between, mesh%n_given, area)
  end subroutine find_areas

  !> Whether a pair is of all faces of a body before a plane, a sphere or a cylinder, towards which
  !> they may yet turn.
  pure logical function may_turn_to(scene, pair) result(may)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: pair

    associate (of => scene%pairs(pair))
      may = of%is_general .and. of%master > 0 .and. .not. has_meshed_master(scene, pair)
    end associate
  end function may_turn_to

  !> The faces of a pair's slave that are turned towards its obstacle in the mesh.
  pure function faces_towards(scene, pair) result(turned)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: pair
    integer, allocatable :: turned(:)
    real(wp), parameter :: at_rest(3) = 0.0_wp
    real(wp) :: away(3), gap
    integer, allocatable :: corner(:, :)
    logical, allocatable :: is_turned(:)
    integer :: f

    corner = nodes_of(scene%surfaces(scene%pairs(pair)%surface)%faces, scene%mesh%connectivity)
    allocate (is_turned(size(corner, 2)))
    do f = 1, size(corner, 2)
      associate (x => scene%mesh%coordinates(:, corner(:corners_in(corner(:, f)), f)))
        call locate_point(scene%obstacles(scene%pairs(pair)%master), at_rest, &
          sum(x, 2)/size(x, 2), gap, away)
        is_turned(f) = dot_product(outward_normal(x), away) <= against
      end associate
    end do
    turned = pack([(f, f=1, size(is_turned))], is_turned)
  end function faces_towards

  !> The nodes in the middles of the edges of slave faces: the ends of the edge, alpha of (9.11).
  !> What is before faces has points of its own; slaves before other obstacles share theirs.
  pure subroutine find_edges(scene, pair, ends, alpha)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: pair
    integer,  allocatable, intent(inout) :: ends(:, :) !! (2,n_nodes) 0 of other nodes
    real(wp), allocatable, intent(inout) :: alpha(:)   !! (n_nodes) 0 of other nodes [-]
    logical :: is_alone
    integer :: other

    is_alone = is_before_faces(scene%pairs(pair), scene%obstacles)
    if (pair > 1 .and. .not. is_alone) then
      if (.not. is_before_faces(scene%pairs(pair - 1), scene%obstacles)) return ! they are the same
    end if
    if (.not. allocated(ends)) allocate (ends(2, scene%mesh%n_nodes), alpha(scene%mesh%n_nodes))
    ends = 0
    alpha = 0.0_wp
    do other = 1, size(scene%pairs)
      if (is_alone .neqv. is_before_faces(scene%pairs(other), scene%obstacles)) cycle
      if (is_alone .and. other /= pair) cycle
      call find_middles(all_nodes_of(scene%surfaces(scene%pairs(other)%surface)%faces, &
        scene%mesh%connectivity), ends, alpha)
    end do
  end subroutine find_edges

  !> Whether an edge is bent: where its middle touches a plane its ends may not. At finite strain
  !> this asks for a bend along the plane's normal: a round rim is as flat as the plane.
  pure logical function any_bent(x, nodes, ends, normal, along_normal)
    real(wp), intent(in) :: x(:, :)      !! (3,n_nodes) [length]
    integer, intent(in) :: nodes(:)      !! of a surface
    integer, intent(in) :: ends(:, :)    !! as of find_edges
    real(wp), intent(in) :: normal(3)    !! of the plane [-]
    logical, intent(in) :: along_normal
    real(wp), parameter :: straight = 1.0e-9_wp !! digits of decks [-]
    real(wp) :: bend(3)                  !! [length]
    integer :: i

    any_bent = .false.
    do i = 1, size(nodes)
      if (ends(1, nodes(i)) == 0) cycle
      associate (one => x(:, ends(1, nodes(i))), other => x(:, ends(2, nodes(i))))
        bend = x(:, nodes(i)) - 0.5_wp*(one + other)
        if (along_normal) bend = dot_product(normal, bend)*normal
        any_bent = any_bent .or. norm2(bend) > straight*norm2(one - other)
      end associate
    end do
  end function any_bent

  !> The areas of the points from those of the nodes, int N dA: a node in the middle of an edge
  !> gives alpha of its own to each end. docs/theory.md (9.12).
  pure subroutine share_areas(nodes, ends, alpha, area)
    integer, intent(in) :: nodes(:)         !! of the surface
    integer, intent(in) :: ends(:, :)       !! as of find_edges
    real(wp), intent(in) :: alpha(:)
    real(wp), intent(inout) :: area(:)      !! (n_nodes) [length^2]
    integer :: i

    do i = 1, size(nodes)
      associate (middle => nodes(i))
        if (.not. alpha(middle) > 0.0_wp) cycle
        area(ends(:, middle)) = area(ends(:, middle)) + alpha(middle)*area(middle)
        area(middle) = (1.0_wp - 2.0_wp*alpha(middle))*area(middle)
      end associate
    end do
  end subroutine share_areas

  !> Let points know those at the ends of their edges, which are before the same obstacle, or the
  !> same side of the same faces.
  subroutine join_ends(scene, points)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(inout) :: points
    integer,  allocatable :: ends(:, :)
    real(wp), allocatable :: alpha(:)
    integer :: at(scene%mesh%n_nodes), pair, other, side, first, last

    do pair = 1, size(scene%pairs)
      call find_edges(scene, pair, ends, alpha)
      if (.not. any(alpha(scene%surfaces(scene%pairs(pair)%surface)%nodes) > 0.0_wp)) cycle
      if (.not. allocated(points%alpha)) then
        allocate (points%end_point(2, points%n), source=0)
        allocate (points%alpha(points%n), source=0.0_wp)
        allocate (points%is_held(points%n), source=.false.)
      end if
      at = 0
      if (is_before_faces(scene%pairs(pair), scene%obstacles)) then
        do side = 1, n_sides(points, pair)
          call find_side_points(points, pair, side, first, last)
          call note_points(first, last)
          call join(first, last)
        end do
      else
        do other = 1, size(scene%pairs)
          if (scene%pairs(other)%master == scene%pairs(pair)%master) call note_points( &
            points%first(other), points%first(other + 1) - 1)
        end do
        call join(points%first(pair), points%first(pair + 1) - 1)
      end if
    end do

  contains

    subroutine note_points(first, last)
      integer, intent(in) :: first, last
      integer :: i

      do i = first, last
        at(points%node(i)) = i
      end do
    end subroutine note_points

    subroutine join(first, last)
      integer, intent(in) :: first, last
      integer :: i

      do i = first, last
        associate (node => points%node(i))
          if (.not. alpha(node) > 0.0_wp) cycle
          points%end_point(:, i) = at(ends(:, node))
          if (all(points%end_point(:, i) > 0)) points%alpha(i) = alpha(node)
        end associate
      end do
    end subroutine join

  end subroutine join_ends

  !> Divide masters of faces into their sides.
  subroutine divide_masters(scene, points)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(inout) :: points
    integer, allocatable :: side(:), parts(:, :), whole(:)
    real(wp) :: area, longest
    integer :: pair

    allocate (points%sides(size(scene%pairs)))
    do pair = 1, size(scene%pairs)
      associate (of => scene%pairs(pair), sides => points%sides(pair))
        if (has_meshed_master(scene, pair)) then
          call measure_faces(scene, of%surface, area, longest)
          call find_sides(scene%obstacles(of%master)%facet, scene%obstacles(of%master)%corner, &
            side, area, longest)
        else if (of%master == 0) then
          ! Curved faces lean at their edges by less than their corners say. Of a face the last part
          ! is that in the middle.
          call split_faces(scene%surfaces(of%master_surface)%faces, scene%mesh%connectivity, &
            parts, whole)
          call measure_faces(scene, of%surface, area, longest)
          call find_sides(parts, scene%mesh%coordinates, side, area, longest)
          side = pack(side, [whole(:size(whole) - 1) /= whole(2:), .true.])
        else
          cycle
        end if
        if (size(side) > 0) sides%n = maxval(side)
        if (sides%n > 1) call move_alloc(side, sides%of_face)
      end associate
    end do
  end subroutine divide_masters

  !> The mean area of the faces of a surface, and the largest distance between two corners of one; 0
  !> where it has none.
  pure subroutine measure_faces(scene, surface, area, longest)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: surface
    real(wp), intent(out) :: area    !! [length^2]
    real(wp), intent(out) :: longest !! [length]
    integer, allocatable :: faces(:, :)
    integer :: f, k

    area = 0.0_wp
    longest = 0.0_wp
    faces = nodes_of(scene%surfaces(surface)%faces, scene%mesh%connectivity)
    do f = 1, size(faces, 2)
      associate (corner => scene%mesh%coordinates(:, faces(:corners_in(faces(:, f)), f)))
        area = area + area_of_face(corner)/size(faces, 2)
        do k = 1, size(corner, 2)
          longest = max(longest, maxval(norm2(corner - spread(corner(:, k), 2, size(corner, 2)), &
            dim=1)))
        end do
      end associate
    end do
  end subroutine measure_faces

  !> The nodes of every pair's master that may get weights.
  pure subroutine list_master_nodes(scene, points, faced)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(inout) :: points
    logical, intent(in), optional :: faced(:, :)
    !! (n_nodes,n_pairs) of surfaces those that a slave may get to; without it all
    logical :: wanted(scene%mesh%n_nodes)
    integer :: pair

    if (.not. allocated(points%first_master)) allocate (points%first_master(size(scene%pairs) + 1))
    points%master_node = [integer ::]
    wanted = .true.
    do pair = 1, size(scene%pairs)
      points%first_master(pair) = size(points%master_node) + 1
      associate (of => scene%pairs(pair))
        if (of%master == 0) then
          if (present(faced)) wanted = faced(:, pair)
          associate (nodes => scene%surfaces(of%master_surface)%nodes)
            points%master_node = [points%master_node, pack(nodes, wanted(nodes))]
          end associate
          ! A point may stand for nodes about it.
          associate (hanging => hanging_of(scene%mesh%hangs, scene%mesh%between, &
                     scene%mesh%n_given, scene%surfaces(of%surface)%nodes))
            points%master_node = [points%master_node, each_once([hanging])]
          end associate
        else if (scene%obstacles(of%master)%ref_node > 0) then
          points%master_node = [points%master_node, scene%obstacles(of%master)%ref_node]
        end if
      end associate
    end do
    points%first_master(size(scene%pairs) + 1) = size(points%master_node) + 1
  end subroutine list_master_nodes

  !> Numbers above 0, each once.
  pure function each_once(list) result(once)
    integer, intent(in) :: list(:)
    integer, allocatable :: once(:)

    once = pack(list, list > 0)
    call sort_unique(once)
  end function each_once

  !> Which slots (the nodes of the first pair's surface, then those of the second, ...) are points.
  !>
  !> Obstacle by obstacle, so that one mark a node is enough. Before faces every node is one:
  !> the weights of a pair are integrals over all of its faces. Else no node is one that hangs: it
  !> touches where those do that it lies between.
  pure subroutine find_new(scene, is_new)
    type(scene_t), intent(in) :: scene
    logical, allocatable, intent(out) :: is_new(:) !! (slots of all pairs)
    integer, dimension(size(scene%pairs)) :: first, next
    integer :: head(size(scene%obstacles)), marked(scene%mesh%n_nodes)
    integer :: pair, obstacle, i, n

    ! Lists of each obstacle's pairs, ascending.
    n = 0
    do pair = 1, size(scene%pairs)
      first(pair) = n
      n = n + size(scene%surfaces(scene%pairs(pair)%surface)%nodes)
    end do
    allocate (is_new(n), source=.true.)
    head = 0
    do pair = size(scene%pairs), 1, -1
      if (is_before_faces(scene%pairs(pair), scene%obstacles)) cycle
      next(pair) = head(scene%pairs(pair)%master)
      head(scene%pairs(pair)%master) = pair
    end do

    marked = 0
    do obstacle = 1, size(scene%obstacles)
      pair = head(obstacle)
      do while (pair > 0)
        associate (nodes => scene%surfaces(scene%pairs(pair)%surface)%nodes)
          do i = 1, size(nodes)
            is_new(first(pair) + i) = marked(nodes(i)) /= obstacle
            if (allocated(scene%mesh%hangs)) is_new(first(pair) + i) = is_new(first(pair) + i) &
              .and. .not. scene%mesh%hangs(nodes(i))
            marked(nodes(i)) = obstacle
          end do
        end associate
        pair = next(pair)
      end do
    end do
  end subroutine find_new

  !> *CONTACT GAP and *CLEARANCE: what each point is further away than the mesh says. A clearance
  !> takes the place of the gap that the row of the point has in the undeformed mesh; points that
  !> face no master there keep theirs.
  !>
  !> Constant gaps are the same before every obstacle: summed over the nodes, then handed out.
  subroutine find_extra_gaps(scene, points)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(inout) :: points
    integer :: head(scene%mesh%n_nodes), next(points%n), marked(scene%mesh%n_nodes), pair
    real(wp) :: constant(scene%mesh%n_nodes), extra(points%n)
    type(placement_t) :: placement !! of the undeformed mesh
    integer :: card, i, j

    ! Lists of each node's points.
    head = 0
    do i = points%n, 1, -1
      next(i) = head(points%node(i))
      head(points%node(i)) = i
    end do
    allocate (points%extra_gap(points%n), source=0.0_wp)
    if (any(scene%gaps%parabola) .or. any(scene%pairs%has_clearance)) call place_undeformed( &
      scene, points, placement)
    extra = 0.0_wp
    constant = 0.0_wp
    marked = 0
    do card = 1, size(scene%gaps)
      associate (given => scene%gaps(card))
        do j = 1, size(given%nodes)
          associate (node => given%nodes(j))
            if (marked(node) == card) cycle ! named twice by one card
            marked(node) = card
            if (.not. given%parabola) constant(node) = constant(node) + given%value
            i = 0
            if (given%parabola) i = head(node)
          end associate
          do while (i > 0)
            extra(i) = extra(i) + paraboloid(scene%mesh%coordinates(:, points%node(i)), &
              placement%frame(:, 1, i), given)
            i = next(i)
          end do
        end do
      end associate
    end do
    ! Between the deck's nodes they are bilinear, as the mesh is.
    call fill_between(scene%mesh, constant)
    do i = 1, points%n
      associate (pair => scene%pairs(points%pair(i)))
        if (.not. pair%has_clearance) cycle
        if (placement%weights%covers(i)) extra(i) = extra(i) + pair%clearance - placement%gap(i)
      end associate
    end do
    ! Nothing of the mesh is further apart than that.
    associate (x => scene%mesh%coordinates)
      do pair = 1, size(scene%pairs)
        if (.not. allocated(scene%pairs(pair)%left_open)) cycle
        marked = 0
        marked(scene%pairs(pair)%left_open) = 1
        do i = points%first(pair), points%first(pair + 1) - 1
          if (marked(points%node(i)) == 1) extra(i) = extra(i) + norm2(maxval(x, dim=2) - &
            minval(x, dim=2))
        end do
      end do
    end associate
    points%extra_gap = extra + constant(points%node)
  end subroutine find_extra_gaps

  !> Distance of a point from a paraboloid's apex plane, measured along its master's normal.
  pure real(wp) function paraboloid(node, normal, card) result(height)
    real(wp), intent(in) :: node(3)    !! where it is [length]
    real(wp), intent(in) :: normal(3)  !! unit vector
    type(contact_gap_t), intent(in) :: card
    real(wp) :: x(3)

    x = node - card%centre
    x = x - dot_product(x, normal)*normal
    height = sum(x**2)/(2.0_wp*card%radius)
  end function paraboloid

end module candidate_points_mod
