!> Surfaces that overlap between nodes without a reaction: gaps before faces are means about the
!> nodes, and a master narrower than the slave's faces may pass between them. docs/theory.md
!> section 11.
module unfelt_overlaps_mod
  use kinds_mod, only: wp
  use connectivity_mod, only: corners_in
  use mesh_mod, only: mesh_t
  use surfaces_mod, only: surface_t, nodes_of
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t, is_pair_removed, n_sides, find_side_points
  use increment_report_mod, only: contact_fields_t
  use obstacle_shapes_mod, only: is_before_faces
  use placement_mod, only: no_gap
  use smooth_faces_mod, only: smooth_faces_t, make_smooth_faces
  use faces_between_nodes_mod, only: face_entry_t, entries_t, deepest_untouched
  implicit none
  private

  public :: find_unfelt_overlap, find_entered_faces, fits_of_pairs, turns_of_pairs

contains

  !> The deepest overlap of slave faces near which no node touches, of all pairs.
  !>
  !> It is a missed contact where it is deeper than flat faces stand out of a hollow there: by that
  !> much the meshes of a pin and its hole overlap, and the bodies do not.
  pure subroutine find_unfelt_overlap(scene, points, contact, places, allowed, deepest, is_missed)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(in) :: contact !! at the end of an increment
    real(wp), intent(in) :: places(:, :)          !! (3,n_nodes) of faces [length]
    real(wp), intent(in) :: allowed(:)            !! (n_pairs) what is no overlap [length]
    type(face_entry_t), intent(out) :: deepest    !! depth 0: there is none
    logical, intent(out) :: is_missed
    type(face_entry_t), allocatable :: dents(:)
    type(face_entry_t) :: found
    logical, allocatable :: near(:)
    integer :: pair, side

    is_missed = .false.
    do pair = 1, size(scene%pairs)
      associate (of => scene%pairs(pair))
        if (.not. is_before_faces(of, scene%obstacles)) cycle
        if (is_pair_removed(points, pair)) cycle
        do side = 1, n_sides(points, pair)
          call list_dents(scene, points, contact, allowed(pair), pair, side, dents, near)
          if (size(dents) == 0) cycle
          found = deepest_untouched(dents, near, dents%depth > allowed(pair) + hollows_at(scene, &
            points, contact, places, side, dents))
          if (found%depth > 0.0_wp) then
            if (.not. is_missed .or. found%depth > deepest%depth) deepest = found
            is_missed = .true.
          else if (.not. is_missed) then
            found = deepest_untouched(dents, near)
            if (found%depth > deepest%depth) deepest = found
          end if
        end do
      end associate
    end do
  end subroutine find_unfelt_overlap

  !> How far flat faces stand out of hollows where faces of a pair overlap: at the slave nodes of
  !> these faces and at the master nodes that these face, or anywhere on the master if they face
  !> none.
  pure function hollows_at(scene, points, contact, places, side, dents) result(hollow)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(in) :: contact
    real(wp), intent(in) :: places(:, :)    !! (3,n_nodes) of faces [length]
    integer, intent(in) :: side             !! of the pair's master
    type(face_entry_t), intent(in) :: dents(:) !! of one pair
    real(wp) :: hollow(size(dents))         !! [length]
    real(wp), dimension(scene%mesh%n_nodes) :: of_slave, of_master, faced !! [length]
    integer :: first, last, i, k

    associate (pair => scene%pairs(dents(1)%pair), rows => contact%weights)
      of_slave = rises_at(scene%mesh, scene%surfaces(pair%surface), places)
      of_master = 0.0_wp
      if (pair%master == 0) of_master = rises_at(scene%mesh, &
        scene%surfaces(pair%master_surface), places)
      call find_side_points(points, dents(1)%pair, side, first, last)
      faced = 0.0_wp
      do i = first, last
        faced(points%node(i)) = maxval(of_master)
        if (rows%first(i) < rows%first(i + 1)) faced(points%node(i)) = maxval(of_master( &
          rows%node(rows%first(i):rows%first(i + 1) - 1)))
      end do
    end associate
    do k = 1, size(dents)
      associate (nodes => dents(k)%nodes(:corners_in(dents(k)%nodes)))
        hollow(k) = maxval(of_slave(nodes)) + maxval(faced(nodes))
      end associate
    end do
  end function hollows_at

  !> Add the overlaps of faces between their nodes, in contact or not: the deepest, and the contact
  !> energy that they leave out. docs/theory.md (10.8).
  !>
  !> The overlap of two polygons that fit into each other, a pin and its hole, is taken off and has
  !> no energy. With small sliding overlaps are not followed.
  pure subroutine find_entered_faces(scene, points, contact, fit, allowed, rounding, entries)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(in) :: contact !! at the end of an increment
    real(wp), intent(in) :: fit(:)                !! (n_pairs) of `fits_of_pairs` [length]
    real(wp), intent(in) :: allowed               !! what is no overlap [length]
    real(wp), intent(in) :: rounding              !! of places: what has no depth [length]
    type(entries_t), intent(inout) :: entries     !! gets `at_end` and `work`
    type(face_entry_t), allocatable :: dents(:)
    logical, allocatable :: near(:)
    real(wp) :: beyond, work, deepest
    integer :: pair, side, i

    do pair = 1, size(scene%pairs)
      associate (of => scene%pairs(pair))
        if (of%small_sliding .or. .not. is_before_faces(of, scene%obstacles)) cycle
        if (is_pair_removed(points, pair)) cycle
      end associate
      deepest = 0.0_wp
      do side = 1, n_sides(points, pair)
        call list_dents(scene, points, contact, rounding + fit(pair), pair, side, dents, near)
        if (size(dents) == 0) cycle
        i = maxloc(dents%depth, dim=1)
        deepest = max(deepest, dents(i)%depth - fit(pair))
        if (dents(i)%depth > allowed + fit(pair) .and. dents(i)%depth - fit(pair) > &
          entries%at_end%depth) entries%at_end = face_entry_t(dents(i)%depth - fit(pair), pair, &
          dents(i)%nodes)
      end do
      if (.not. deepest > allowed) cycle
      if (fit(pair) > 0.0_wp) cycle
      work = 0.0_wp
      do i = points%first(pair), points%first(pair + 1) - 1
        beyond = -contact%least_gap(i)
        if (.not. (beyond > allowed .and. contact%covered_area(i) > 0.0_wp)) cycle
        ! The integral does not know extra gaps: the dent is as flat without them.
        work = work - max(0.0_wp, contact%reaction(1, i))/contact%covered_area(i)* &
          contact%entered(i)*min(1.0_wp, beyond/max(beyond + points%extra_gap(i), allowed))
      end do
      entries%work = entries%work + work
    end do
  end subroutine find_entered_faces

  !> The overlaps of a pair's faces with one side of its master, and which nodes are of faces with
  !> one that touches.
  pure subroutine list_dents(scene, points, contact, allowed, pair, side, dents, near)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(in) :: contact
    real(wp), intent(in) :: allowed !! what is no overlap [length]
    integer, intent(in) :: pair, side
    type(face_entry_t), allocatable, intent(out) :: dents(:)
    logical, allocatable, intent(out) :: near(:)  !! (n_nodes) not set where there are no dents
    integer, allocatable :: faces(:, :)
    real(wp), allocatable :: depth(:)           !! (n_nodes) in the faces about it [length]
    logical, allocatable :: on_it(:)            !! (n_nodes) touching
    real(wp) :: least                           !! depth [length]
    integer :: i, f, first, last

    allocate (dents(0))
    call find_side_points(points, pair, side, first, last)
    if (.not. any(min(contact%least_gap(first:last), contact%unplaced_gap(first:last)) < &
                  -allowed)) return
    allocate (depth(scene%mesh%n_nodes), source=no_gap)
    allocate (on_it(scene%mesh%n_nodes), source=.false.)
    do i = first, last
      if (contact%unplaced_gap(i) < 0.5_wp*no_gap) depth(points%node(i)) = -contact%unplaced_gap(i)
      if (.not. contact%gap(i) < 0.5_wp*no_gap) cycle
      depth(points%node(i)) = -contact%least_gap(i)
      ! On it without a force: about to touch, or held there.
      on_it(points%node(i)) = any(abs(contact%reaction(:, i)) > 0.0_wp) .or. &
        contact%gap(i) <= allowed
    end do
    faces = nodes_of(scene%surfaces(scene%pairs(pair)%surface)%faces, scene%mesh%connectivity)
    near = on_it
    do f = 1, size(faces, 2)
      associate (nodes => faces(:corners_in(faces(:, f)), f))
        if (any(on_it(nodes))) near(nodes) = .true.
        least = minval(depth(nodes))
      end associate
      ! A face is as deep as the shallowest of its nodes.
      if (least > allowed .and. least < 0.5_wp*no_gap) dents = [dents, face_entry_t(least, pair, &
        faces(:, f))]
    end do
  end subroutine list_dents

  !> How far the meshes of each pair overlap in contact, where one is hollow: as flat faces differ
  !> from the smooth surfaces; 0 of other pairs.
  pure function fits_of_pairs(scene) result(fit)
    type(scene_t), intent(in) :: scene
    real(wp) :: fit(size(scene%pairs)) !! [length]
    real(wp), parameter :: flat = 1.0e-3_wp !! hollowness of half an edge that is none [-]
    type(smooth_faces_t) :: faces
    integer :: pair

    fit = 0.0_wp
    do pair = 1, size(scene%pairs)
      associate (of => scene%pairs(pair), x => scene%mesh%coordinates)
        if (.not. is_before_faces(of, scene%obstacles)) cycle
        fit(pair) = maxval(rises_at(scene%mesh, scene%surfaces(of%surface), x))
        if (of%master == 0) fit(pair) = fit(pair) + maxval(rises_at(scene%mesh, &
          scene%surfaces(of%master_surface), x))
        if (.not. fit(pair) > 0.0_wp) cycle
        faces = make_smooth_faces(scene%mesh, scene%surfaces(of%surface))
        if (fit(pair) <= flat*maxval(faces%half)) then
          fit(pair) = 0.0_wp
          cycle
        end if
        fit(pair) = maxval(norm2(faces%bulge, dim=1))
        if (of%master > 0) cycle
        faces = make_smooth_faces(scene%mesh, scene%surfaces(of%master_surface))
        fit(pair) = fit(pair) + maxval(norm2(faces%bulge, dim=1))
      end associate
    end do
  end function fits_of_pairs

  !> How far displacements take the faces of each pair through each other by turning them, which is
  !> of second order: the largest displacement of its nodes times the most that an edge of a face
  !> turns or stretches. 0 of pairs that are not before faces.
  pure function turns_of_pairs(scene, u) result(turned)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: u(:, :)         !! (3,n_nodes) [length]
    real(wp) :: turned(size(scene%pairs)) !! [length]
    real(wp) :: moved, most
    integer :: pair

    turned = 0.0_wp
    do pair = 1, size(scene%pairs)
      associate (of => scene%pairs(pair))
        if (.not. is_before_faces(of, scene%obstacles)) cycle
        moved = 0.0_wp
        most = 0.0_wp
        call add_turns(scene%mesh, scene%surfaces(of%surface), u, moved, most)
        if (of%master == 0) call add_turns(scene%mesh, scene%surfaces(of%master_surface), u, &
          moved, most)
        turned(pair) = moved*most
      end associate
    end do
  end function turns_of_pairs

  !> The largest displacement of a surface's nodes, and the most that an edge turns or stretches.
  pure subroutine add_turns(mesh, surface, u, moved, most)
    type(mesh_t), intent(in) :: mesh
    type(surface_t), intent(in) :: surface
    real(wp), intent(in) :: u(:, :)         !! (3,n_nodes) [length]
    real(wp), intent(inout) :: moved, most  !! [length], [-]
    integer, allocatable :: faces(:, :)
    integer :: f, k, n

    faces = nodes_of(surface%faces, mesh%connectivity)
    do f = 1, size(faces, 2)
      n = corners_in(faces(:, f))
      associate (a => faces(:n, f), b => faces([(modulo(k, n) + 1, k=1, n)], f))
        moved = max(moved, maxval(norm2(u(:, a), dim=1)))
        most = max(most, maxval(norm2(u(:, a) - u(:, b), dim=1)/max(tiny(1.0_wp), &
          norm2(mesh%coordinates(:, a) - mesh%coordinates(:, b), dim=1)), mask=a /= b))
      end associate
    end do
  end subroutine add_turns

  !> How far the flat faces about each node stand out of a smooth hollow surface, at most; 0 of flat
  !> or convex ones.
  pure function rises_at(mesh, surface, places) result(rise)
    type(mesh_t), intent(in) :: mesh
    type(surface_t), intent(in) :: surface
    real(wp), intent(in) :: places(:, :)  !! (3,n_nodes) [length]
    real(wp) :: rise(mesh%n_nodes)        !! [length]
    type(smooth_faces_t) :: faces
    integer :: f

    faces = make_smooth_faces(mesh, surface, places)
    rise = 0.0_wp
    do f = 1, size(faces%nodes, 2)
      associate (nodes => faces%nodes(:corners_in(faces%nodes(:, f)), f))
        rise(nodes) = max(rise(nodes), -minval(matmul(faces%normal(:, f), faces%bulge(:, :, f))))
      end associate
    end do
  end function rises_at

end module unfelt_overlaps_mod
