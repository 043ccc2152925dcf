!> What of the mesh takes part in contact, decided before anything is computed: which slave nodes
!> can reach their master, and along which degrees of freedom they are coupled to it.
module contact_interface_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t
  use loads_mod, only: interference_t, amplitude_range
  use obstacles_mod, only: ref_nodes
  use connectivity_mod, only: corners_in
  use pair_faces_mod, only: nodes_of_faces, touches_itself
  use surfaces_mod, only: all_nodes_of, nodes_of
  use obstacle_shapes_mod, only: least_gap, normal_along, turns_in_place, has_meshed_master
  use scene_mod, only: scene_t
  use step_contact_mod, only: most_friction
  use bodies_mod, only: is_linear
  use contact_points_mod, only: contact_points_t, master_nodes, contact_nodes, n_sides, &
    faces_of_side, find_side_points, face_one
  use rigid_modes_mod, only: free_motions_t, find_free_motions
  use face_directions_mod, only: are_before, directions_of, directions_t, looks_at
  use face_grid_mod, only: face_grid_t, make_face_grid, faces_near
  use face_overlap_mod, only: outward_normal
  use surface_reach_mod, only: reach_of_faces
  use candidate_points_mod, only: faces_towards, find_curved, list_master_nodes, may_turn_to
  use symmetry_planes_mod, only: find_symmetry_planes
  use local_frame_mod, only: straight
  use step_loads_mod, only: prescribed_dofs
  use constraints_mod, only: active_constraints
  use placement_mod, only: placement_t, place_undeformed, is_before_flat
  use dependent_rows_mod, only: find_dependent_rows, points_of_rows, uncarried_overlaps
  use transfer_mod, only: movable, rows_of_points
  implicit none
  private

  public :: find_reach, reach_everything, interface_dofs

contains

  !> Find which points can reach their master, and which of them planes of symmetry hold.
  subroutine find_reach(scene, points, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(inout) :: points  !! gets in_reach, across
    type(error_t), allocatable, intent(out) :: error !! LAPACK failed
    logical :: prescribed(3, scene%mesh%n_nodes), before(3, scene%mesh%n_nodes)
    logical :: loose_body(scene%mesh%n_bodies), loose_ref_node(scene%mesh%n_nodes)
    integer :: i
    type(free_motions_t) :: motions
    integer :: step

    loose_body = .false.
    loose_ref_node = .false.
    call mark_loaded(scene, loose_body)
    do step = 1, size(scene%steps)
      prescribed = prescribed_dofs(scene, step)
      if (step > 1) then
        if (all(prescribed .eqv. before)) cycle
      end if
      before = prescribed
      call find_free_motions(scene%mesh, prescribed, ref_nodes(scene%obstacles), &
        contact_nodes(points), motions, error, scene%constraints)
      if (allocated(error)) return
      loose_body(pack(motions%body, motions%body > 0)) = .true.
      loose_ref_node(pack(motions%node, motions%body == 0)) = .true.
    end do
    call mark_pushed(scene, points, loose_ref_node, loose_body)
    ! An obstacle that turns sweeps what no box of displacements holds.
    do i = 1, size(scene%obstacles)
      if (sweeps(scene, i)) loose_ref_node(scene%obstacles(i)%ref_node) = .true.
    end do
    call points_in_reach(scene, points, loose_body, loose_ref_node)
    call find_curved(scene, points)
    call follow_partly_covered(scene, points)
    call find_symmetry_planes(scene, points)
    call find_joined_points(scene, points)
  end subroutine find_reach

  !> Have points before flat facets placed in every iteration where these cover a node in part: its
  !> row changes as it moves along, (11.34).
  pure subroutine follow_partly_covered(scene, points)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(inout) :: points
    type(placement_t) :: undeformed
    logical :: is_flat(points%n)
    integer :: pair
    real(wp), parameter :: wholly = 1.0_wp - 1.0e-6_wp

    is_flat = is_before_flat(points%turns, points%in_reach, points%is_curved)
    if (.not. any(is_flat)) return
    call place_undeformed(scene, points, undeformed)
    do pair = 1, size(scene%pairs)
      associate (first => points%first(pair), last => points%first(pair + 1) - 1)
        if (any(is_flat(first:last) .and. undeformed%covered_area(first:last) < wholly* &
          undeformed%faced_area(first:last))) points%is_curved(first:last) = .true.
      end associate
    end do
  end subroutine follow_partly_covered

  !> The points before surfaces that constraints join to what they face in the undeformed mesh, with
  !> the supports of any step: where rows depend on each other, those of nodes that are nearly
  !> opposite to a node of the master taken to face that one alone. An overlap that no motion can
  !> part there is no part of their gaps.
  subroutine find_joined_points(scene, points)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(inout) :: points !! gets is_joined, uncarried; extra gaps grow
    type(placement_t) :: undeformed
    logical :: is_joined(points%n)
    real(wp) :: uncarried(points%n)
    integer :: i

    if (scene%constraints%n == 0) return
    call place_undeformed(scene, points, undeformed)
    associate (weights => undeformed%weights)
      do i = 1, points%n
        call face_one(weights%weight(weights%first(i):weights%first(i + 1) - 1))
      end do
    end associate
    call look_at_steps()
    if (.not. any(is_joined)) return
    if (any(is_joined .and. points%on_surface)) then
      points%is_joined = is_joined .and. points%on_surface
      call place_undeformed(scene, points, undeformed)
      call look_at_steps()
    end if
    if (.not. any(uncarried > 0.0_wp)) return
    points%uncarried = uncarried
    points%extra_gap = points%extra_gap + uncarried

  contains

    subroutine look_at_steps()
      type(contact_points_t) :: all_points
      logical, dimension(3, scene%mesh%n_nodes) :: prescribed, before, can_move
      integer :: row(3, points%n), step
      real(wp), allocatable :: null(:, :)

      all_points = points
      all_points%in_reach = .true.
      is_joined = .false.
      uncarried = 0.0_wp
      do step = 1, size(scene%steps)
        prescribed = prescribed_dofs(scene, step)
        if (step > 1) then
          if (all(prescribed .eqv. before)) cycle
        end if
        before = prescribed
        can_move = movable(scene, prescribed)
        call rows_of_points(can_move, all_points, undeformed%weights, undeformed%frame, row)
        call find_dependent_rows(points, undeformed%weights, undeformed%frame, row, can_move, &
          active_constraints(scene%constraints, prescribed), null)
        is_joined = is_joined .or. points_of_rows(row, null)
        uncarried = uncarried + merge(uncarried_overlaps(row, null, undeformed%gap + uncarried), &
          0.0_wp, points%on_surface .or. .not. points%turns)
      end do
    end subroutine look_at_steps

  end subroutine find_joined_points

  !> Take every point to reach its master, every face of a master to be reached, and no facets for a
  !> plane.
  pure subroutine reach_everything(scene, points)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(inout) :: points

    points%in_reach = .true.
    call find_curved(scene, points, follow_flat=.true.)
    call list_master_nodes(scene, points)
  end subroutine reach_everything

  !> Whether the surface of an obstacle does not stay in its place while it turns.
  pure logical function sweeps(scene, obstacle)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: obstacle
    logical :: about(3) !! axes
    integer :: step, i

    sweeps = .false.
    associate (turning => scene%obstacles(obstacle))
      if (.not. turning%turns) return
      about = .false.
      do step = 1, size(scene%steps)
        if (.not. allocated(scene%steps(step)%rotations)) cycle
        do i = 1, size(scene%steps(step)%rotations)
          associate (r => scene%steps(step)%rotations(i))
            if (r%node == turning%ref_node .and. abs(r%value) > 0.0_wp) about(r%dof) = .true.
          end associate
        end do
      end do
      sweeps = .not. turns_in_place(turning, scene%mesh%coordinates(:, turning%ref_node), &
        merge(1.0_wp, 0.0_wp, about .and. count(about) == 1))
    end associate
  end function sweeps

  !> The bodies on which loads act, or that become warmer: how far they go is not known before.
  pure subroutine mark_loaded(scene, loose_body)
    type(scene_t), intent(in) :: scene
    logical, intent(inout) :: loose_body(:)      !! (n_bodies)
    integer :: acts_on(scene%mesh%n_nodes), step, i

    acts_on = [(i, i=1, scene%mesh%n_nodes)]
    if (allocated(scene%local_axes)) acts_on(scene%local_axes%stand_in) = scene%local_axes%node
    do step = 1, size(scene%steps)
      associate (s => scene%steps(step), mesh => scene%mesh)
        do i = 1, size(s%forces)
          ! A force on a reference node drives its obstacle.
          associate (body => mesh%body(acts_on(s%forces(i)%node)))
            if (body > 0) loose_body(body) = .true.
          end associate
        end do
        do i = 1, size(s%pressures)
          loose_body(mesh%body(scene%surfaces(s%pressures(i)%surface)%nodes)) = .true.
        end do
        do i = 1, size(s%face_pressures)
          loose_body(mesh%body(scene%surfaces(s%face_pressures(i)%surface)%nodes)) = .true.
        end do
        do i = 1, size(s%gravity)
          loose_body(mesh%body(mesh%connectivity%node(mesh%connectivity%first( &
            scene%regions(s%gravity(i)%region)%elements)))) = .true.
        end do
        if (allocated(s%temperatures)) loose_body(mesh%body(s%temperatures%node)) = .true.
        if (.not. allocated(s%interferences)) cycle
        do i = 1, size(s%interferences)
          if (pushes(s%interferences(i))) loose_body(mesh%body(scene%surfaces(scene%pairs( &
            s%interferences(i)%pair)%surface)%nodes)) = .true.
        end do
      end associate
    end do

  contains

    !> Whether an interference below 0 pushes the two sides apart.
    pure logical function pushes(by)
      type(interference_t), intent(in) :: by

      pushes = by%value < 0.0_wp
      if (by%amplitude > 0) pushes = minval(by%value*amplitude_range(scene%amplitudes( &
        by%amplitude))) < 0.0_wp
    end function pushes

  end subroutine mark_loaded

  !> The bodies that may be pushed: by an obstacle under force, or by another body whose way is not
  !> known.
  pure subroutine mark_pushed(scene, points, loose_ref_node, loose_body)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    logical, intent(in) :: loose_ref_node(:)     !! (n_nodes)
    logical, intent(inout) :: loose_body(:)      !! (n_bodies)
    integer, allocatable :: masters(:), bodies(:) !! bodies: of the masters
    integer :: i, n_before

    n_before = -1
    do while (count(loose_body) /= n_before)
      n_before = count(loose_body)
      do i = 1, size(scene%pairs)
        masters = master_nodes(points, i)
        bodies = pack(scene%mesh%body(masters), scene%mesh%body(masters) > 0)
        associate (slaves => scene%surfaces(scene%pairs(i)%surface)%nodes, body => scene%mesh%body)
          if (any(loose_ref_node(masters)) .or. any(loose_body(bodies))) then
            loose_body(body(slaves)) = .true.
          end if
          if (any(loose_body(body(slaves)))) loose_body(bodies) = .true.
        end associate
      end do
    end do
  end subroutine mark_pushed

  !> Whether each point can reach its master.
  !>
  !> Where prescribed motions alone drive a body, its nodes are taken to move no further, in any
  !> direction, than the largest prescribed motion of the body and of the masters that face it
  !> together. That is a guess that a run must check: bodies may bulge by more.
  pure subroutine points_in_reach(scene, points, loose_body, loose_ref_node)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(inout) :: points !! gets in_reach; masters lose what is far away
    logical, intent(in) :: loose_body(:)      !! (n_bodies)
    logical, intent(in) :: loose_ref_node(:)  !! (n_nodes)
    real(wp) :: lowest(3, scene%mesh%n_nodes), highest(3, scene%mesh%n_nodes)
    real(wp) :: travel(size(loose_body)), gap, box(3, 2)
    integer, allocatable :: masters(:)
    logical :: is_turned(scene%mesh%n_nodes), is_loose, faced(scene%mesh%n_nodes, size(scene%pairs))
    integer :: i, node, pair, body

    call extremes_of_supports(scene, lowest, highest)
    travel = 0.0_wp
    do node = 1, scene%mesh%n_nodes
      body = scene%mesh%body(node)
      if (body > 0) travel(body) = max(travel(body), farthest(lowest(:, node), highest(:, node)))
    end do
    travel = travel + travel_of_masters(scene, points, lowest, highest, travel)

    if (.not. allocated(points%in_reach)) allocate (points%in_reach(points%n))
    faced = .true.
    do pair = 1, size(scene%pairs)
      masters = master_nodes(points, pair)
      if (scene%pairs(pair)%master == 0) then
        associate (first => points%first(pair), last => points%first(pair + 1) - 1)
          points%in_reach(first:last) = .true.
          if (any(loose_body(scene%mesh%body([points%node(first:last), masters])))) then
            if (touches_itself(points, pair)) call find_own_near(scene, points, pair, faced(:, &
              pair))
            cycle
          end if
        end associate
        call find_near(scene, points, pair, all_nodes_of(scene%surfaces(scene%pairs( &
          pair)%master_surface)%faces, scene%mesh%connectivity), scene%mesh%coordinates, travel, &
          points%in_reach, faced(:, pair))
        cycle
      end if
      is_loose = any(loose_ref_node(masters))
      if (has_meshed_master(scene, pair)) then
        associate (first => points%first(pair), last => points%first(pair + 1) - 1)
          points%in_reach(first:last) = .true.
          if (is_loose .or. any(loose_body(scene%mesh%body(points%node(first:last))))) cycle
          call find_near(scene, points, pair, scene%obstacles(scene%pairs(pair)%master)%facet, &
            scene%obstacles(scene%pairs(pair)%master)%corner, travel, points%in_reach)
        end associate
        cycle
      end if
      box(:, 1) = min(0.0_wp, minval(lowest(:, masters), dim=2))
      box(:, 2) = max(0.0_wp, maxval(highest(:, masters), dim=2))
      is_turned = .true.
      if (may_turn_to(scene, pair)) then
        is_turned = .false.
        is_turned(nodes_of_faces(scene, scene%surfaces(scene%pairs(pair)%surface)%faces(:, &
          faces_towards(scene, pair)))) = .true.
      end if
      do i = points%first(pair), points%first(pair + 1) - 1
        body = scene%mesh%body(points%node(i))
        points%in_reach(i) = loose_body(body) .or. is_loose
        ! Whether what looks away comes to turn is watched.
        points%in_reach(i) = points%in_reach(i) .and. is_turned(points%node(i))
        if (points%in_reach(i)) cycle
        gap = least_gap(scene%obstacles(scene%pairs(pair)%master), box, &
          scene%mesh%coordinates(:, points%node(i))) + points%extra_gap(i)
        points%in_reach(i) = gap <= travel(body)
      end do
    end do
    if (allocated(points%alpha)) call reach_along_edges(scene, travel, points)
    call list_master_nodes(scene, points, faced)
  end subroutine points_in_reach

  !> Which points of a surface that touches itself can reach it, however far they go: those of faces
  !> that have others before them, turned towards them. That is a guess, too: faces may turn.
  pure subroutine find_own_near(scene, points, pair, faced)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(inout) :: points !! gets in_reach of the pair
    integer, intent(in) :: pair
    logical, intent(out) :: faced(:)                !! (n_nodes) of these faces
    type(directions_t) :: by_direction
    integer, allocatable :: faces(:, :), corner(:, :)
    integer :: f

    faced = .false.
    associate (mesh => scene%mesh, its => scene%surfaces(scene%pairs(pair)%surface)%faces, &
               first => points%first(pair), last => points%first(pair + 1) - 1)
      faces = all_nodes_of(its, mesh%connectivity)
      corner = nodes_of(its, mesh%connectivity)
      by_direction = directions_of(corner, mesh%coordinates)
      do f = 1, size(faces, 2)
        if (looks_at(mesh%coordinates(:, corner(:corners_in(corner(:, f)), f)), by_direction, &
          0.0_wp)) faced(faces(:count(faces(:, f) > 0), f)) = .true.
      end do
      points%in_reach(first:last) = faced(points%node(first:last))
    end associate
  end subroutine find_own_near

  !> The point in the middle of an edge moves with the ends too: it is in reach where these are, or
  !> its own gap is, and the ends are where it is.
  pure subroutine reach_along_edges(scene, travel, points)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: travel(:)      !! (n_bodies) [length]
    type(contact_points_t), intent(inout) :: points !! its in_reach
    type(contact_points_t) :: whole
    type(placement_t) :: undeformed
    logical :: reached(points%n)
    integer :: i

    whole = points
    whole%is_held = .false.
    call place_undeformed(scene, whole, undeformed)
    reached = points%in_reach
    do i = 1, points%n
      if (points%on_surface(i) .or. .not. points%alpha(i) > 0.0_wp) cycle ! faces are in reach whole
      associate (ends => points%end_point(:, i), alpha => points%alpha(i))
        reached(i) = reached(i) .or. any(points%in_reach(ends)) .or. undeformed%gap(i) <= &
          travel(scene%mesh%body(points%node(i)))*(1.0_wp + 2.0_wp*alpha)/(1.0_wp - 2.0_wp*alpha)
      end associate
    end do
    points%in_reach = reached
    do i = 1, points%n
      if (points%on_surface(i)) cycle
      if (.not. (points%alpha(i) > 0.0_wp .and. reached(i))) cycle
      points%in_reach(points%end_point(:, i)) = .true.
    end do
  end subroutine reach_along_edges

  !> Which points before faces have a face that, made larger by the travel and by how deep the two
  !> are in each other, meets one of these, and the nodes of what lies opposite the faces of these
  !> points, which get weights.
  pure subroutine find_near(scene, points, pair, master, places, travel, near, faced)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair
    integer, intent(in) :: master(:, :)    !! (4,n_faces) or (8,n_faces), 0 behind the nodes
    real(wp), intent(in) :: places(:, :)   !! (3,n) that these name [length]
    real(wp), intent(in) :: travel(:)      !! (n_bodies) of the slave and its masters [length]
    logical, intent(inout) :: near(:)      !! (n_points) those of the pair are set
    logical, intent(out), optional :: faced(:) !! (n) of faces that are opposite
    type(face_grid_t) :: grid
    integer, allocatable :: slave(:, :), found(:), faces(:), of_side(:, :)
    integer :: point(scene%mesh%n_nodes), first, last, side, f, i, k
    real(wp) :: way, reach, along(3)
    real(wp) :: sides !! of the pair that move as the slave's body does
    logical :: is_own

    if (present(faced)) faced = .false.
    is_own = touches_itself(points, pair)
    sides = merge(2.0_wp, 1.0_wp, is_own)
    associate (mesh => scene%mesh, of => scene%pairs(pair))
      allocate (slave, source=all_nodes_of(scene%surfaces(of%surface)%faces, mesh%connectivity))
      do side = 1, n_sides(points, pair)
        call find_side_points(points, pair, side, first, last)
        call faces_of_side(points, pair, side, faces)
        of_side = master
        if (allocated(faces)) of_side = master(:, faces)
        grid = make_face_grid(of_side, places)
        point(points%node(first:last)) = [(i, i=first, last)]
        near(first:last) = .false.
        do f = 1, size(slave, 2)
          associate (x => mesh%coordinates(:, slave(:count(slave(:, f) > 0), f)), &
                     i => point(slave(:count(slave(:, f) > 0), f)))
            way = sides*travel(mesh%body(slave(1, f))) + of%overlap + max(0.0_wp, &
              -minval(points%extra_gap(i)))
            call faces_near(grid, minval(x, 2) - way, maxval(x, 2) + way, found)
            if (is_own) found = pack(found, [(faces_it(f, found(k)), k=1, size(found))])
            if (size(found) > 0) near(i) = .true.
          end associate
        end do
        if (.not. present(faced)) cycle
        reach = reach_of_faces(slave, of_side, places)
        do f = 1, size(slave, 2)
          associate (x => mesh%coordinates(:, slave(:count(slave(:, f) > 0), f)), &
                     i => point(slave(:count(slave(:, f) > 0), f)))
            if (.not. any(near(i))) cycle
            way = sides*travel(mesh%body(slave(1, f))) + of%overlap + max(0.0_wp, &
              -minval(points%extra_gap(i)))
            along = (reach + way)*abs(outward_normal(x(:, :corners_in(slave(:, f)))))
            call faces_near(grid, minval(x, 2) - way - along, maxval(x, 2) + way + along, found)
            if (is_own) found = pack(found, [(faces_it(f, found(k)), k=1, size(found))])
            do k = 1, size(found)
              faced(of_side(:count(of_side(:, found(k)) > 0), found(k))) = .true.
            end do
          end associate
        end do
      end do
    end associate

  contains

    !> Whether two faces of a surface that touches itself face each other: not those about a face,
    !> nor its back.
    pure logical function faces_it(slave_face, master_face)
      integer, intent(in) :: slave_face, master_face

      associate (one => slave(:, slave_face), other => of_side(:, master_face))
        faces_it = are_before(places(:, one(:corners_in(one))), places(:, &
          other(:corners_in(other))), 0.0_wp)
      end associate
    end function faces_it

  end subroutine find_near

  !> The least and the largest displacement that any step prescribes, 0 included.
  pure subroutine extremes_of_supports(scene, lowest, highest)
    type(scene_t), intent(in) :: scene
    real(wp), intent(out) :: lowest(:, :), highest(:, :) !! (3,n_nodes) [length]
    real(wp) :: values(2)
    integer :: step, i

    lowest = 0.0_wp
    highest = 0.0_wp
    do step = 1, size(scene%steps)
      do i = 1, size(scene%steps(step)%boundary)
        associate (b => scene%steps(step)%boundary(i))
          values = b%value
          if (b%amplitude > 0) values = b%from + b%value* &
            amplitude_range(scene%amplitudes(b%amplitude))
          lowest(b%dof, b%node) = min(lowest(b%dof, b%node), minval(values))
          highest(b%dof, b%node) = max(highest(b%dof, b%node), maxval(values))
        end associate
      end do
    end do
  end subroutine extremes_of_supports

  !> How far the masters that face each body go, of bodies as far as anything of them.
  pure function travel_of_masters(scene, points, lowest, highest, of_bodies) result(travel)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: lowest(:, :), highest(:, :) !! (3,n_nodes) [length]
    real(wp), intent(in) :: of_bodies(:)   !! (n_bodies) how far each goes [length]
    real(wp) :: travel(size(of_bodies))    !! [length]
    integer, allocatable :: masters(:)
    real(wp) :: way
    integer :: pair, i, k

    travel = 0.0_wp
    do pair = 1, size(scene%pairs)
      masters = master_nodes(points, pair)
      way = 0.0_wp
      do k = 1, size(masters)
        if (scene%mesh%body(masters(k)) > 0) then
          way = max(way, of_bodies(scene%mesh%body(masters(k))))
        else
          way = max(way, farthest(lowest(:, masters(k)), highest(:, masters(k))))
        end if
      end do
      do i = points%first(pair), points%first(pair + 1) - 1
        associate (of_body => travel(scene%mesh%body(points%node(i))))
          of_body = max(of_body, way)
        end associate
      end do
    end do
  end function travel_of_masters

  !> The longest way within a box that holds 0.
  pure real(wp) function farthest(lowest, highest)
    real(wp), intent(in) :: lowest(3), highest(3) !! [length]

    farthest = norm2(max(abs(lowest), abs(highest)))
  end function farthest

  !> The degrees of freedom that are condensed to: of the slave nodes in reach, and of the nodes of
  !> bodies that are masters of such, all where there is friction or the normal may turn, else those
  !> along which the normal has a part.
  pure function interface_dofs(scene, points) result(dofs)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    logical :: dofs(3, scene%mesh%n_nodes)
    logical :: wanted(3)
    real(wp) :: mu(size(scene%pairs))
    integer, allocatable :: nodes(:)
    integer :: pair, k

    dofs = .false.
    mu = most_friction(scene)
    do pair = 1, size(scene%pairs)
      associate (first => points%first(pair), last => points%first(pair + 1) - 1, &
                 of => scene%pairs(pair))
        if (.not. any(points%in_reach(first:last))) cycle
        wanted = .true.
        ! What turns with its body has all directions before a normal.
        if (of%master > 0 .and. is_linear(scene)) wanted = mu(pair) > 0.0_wp .or. &
          normal_along(scene%obstacles(of%master), straight)
        nodes = master_nodes(points, pair)
        nodes = [pack(points%node(first:last), points%in_reach(first:last)), &
          pack(nodes, scene%mesh%body(nodes) > 0)]
      end associate
      do k = 1, size(nodes)
        dofs(:, nodes(k)) = dofs(:, nodes(k)) .or. wanted
      end do
    end do
  end function interface_dofs

end module contact_interface_mod
