!> Weights, normals and gaps before surfaces and facets, from where nodes are, held against those of
!> the increment. docs/theory.md sections 6 and 11.
!>
!> Where they differ by more than rules of quadrature do, those computed here take the place of what
!> was said, and reactions and displacements are judged by them.
module facing_surfaces_mod
  use kinds_mod, only: wp
  use scene_mod, only: scene_t
  use local_refinement_mod, only: parents_of
  use contact_points_mod, only: contact_points_t, is_pair_removed, weights_t, is_covered, &
    is_across, n_sides, find_side_points
  use pair_faces_mod, only: master_faces, slave_faces, touches_itself
  use sectors_mod, only: without_turn
  use surfaces_mod, only: all_nodes_of
  use state_mod, only: state_t
  use node_freedom_mod, only: can_move_along
  use increment_report_mod, only: contact_fields_t
  use obstacle_gaps_mod, only: frame_of
  use edge_middles_mod, only: edge_middles_t, find_edge_middles, vector_at_point
  use shared_faces_mod, only: two_sides_t, rows_t, put_together, integrate, place_of_entry
  implicit none
  private

  public :: face_surfaces, find_gaps

  real(wp), parameter :: of_quadrature = 1.0e-5_wp
  !! what weights and normals may differ by, and gaps beside the width of a node; quadratures in
  !! distorted faces differ by 1e-6 [-]
  real(wp), parameter :: compared = 0.05_wp
  !! of a node's area: where less is covered the mass of a face has lost digits; 370 random decks
  !! end alike with half and twice as much [-]
  real(wp), parameter :: uncovered = 1.0e30_wp !! gap of a point that nothing faces [length]

contains

  !> Hold all points before surfaces and facets against places.
  pure subroutine face_surfaces(scene, points, old, new, contact, folded_point, torn_point)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(state_t), intent(in) :: old, new
    type(contact_fields_t), intent(inout) :: contact
    integer, intent(out) :: folded_point, torn_point !! as of certificate_t
    type(two_sides_t) :: sides, sides_before
    type(rows_t) :: rows, rows_before
    integer :: pair, side

    folded_point = 0
    torn_point = 0
    do pair = 1, size(scene%pairs)
      if (points%first(pair + 1) == points%first(pair) .or. is_pair_removed(points, pair)) cycle
      if (.not. points%on_surface(points%first(pair))) cycle
      if (size(scene%surfaces(scene%pairs(pair)%surface)%faces, 2) == 0) cycle
      if (is_out_of_reach(scene, points, pair, new)) cycle
      do side = 1, n_sides(points, pair)
        if (.not. has_both(scene, points, pair, side)) then
          call open_points(points, pair, side, new, contact)
          cycle
        end if
        call put_together(scene, points, pair, side, new, sides)
        call integrate(sides, rows)
        if (folded_point == 0 .and. any(rows%folds)) folded_point = sides%first - 1 + &
          findloc(rows%folds, .true., dim=1)
        call compare(scene, points, old, new, sides, rows, contact, torn_point)
        if (scene%finite_strain .and. scene%pairs(pair)%master == 0) then
          call put_together(scene, points, pair, side, old, sides_before)
          call integrate(sides_before, rows_before)
          call compare_slips(scene, points, sides, rows, rows_before, contact)
        end if
      end do
    end do
  end subroutine face_surfaces

  !> Whether a pair has slave faces, and a side of its master faces: all but those of surfaces that
  !> touch themselves do.
  pure logical function has_both(scene, points, pair, side)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair, side

    has_both = .not. touches_itself(points, pair)
    if (.not. has_both) has_both = size(slave_faces(scene, points, pair)) > 0 .and. &
      size(master_faces(scene, points, pair, side)) > 0
  end function has_both

  !> What presses there faces nothing.
  pure subroutine open_points(points, pair, side, new, contact)
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair, side
    type(state_t), intent(in) :: new
    type(contact_fields_t), intent(inout) :: contact
    integer :: first, last, i

    call find_side_points(points, pair, side, first, last)
    do i = first, last
      if (any(abs(new%reaction(:, i)) > 0.0_wp)) contact%gap(i) = uncovered
    end do
  end subroutine open_points

  !> Whether two surfaces of bodies are so far apart that nothing of their rows matters: boxes about
  !> their nodes leave more than the diagonal of the larger one between them, beside what is added
  !> to gaps, and no point has a reaction.
  pure logical function is_out_of_reach(scene, points, pair, new)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair
    type(state_t), intent(in) :: new
    real(wp) :: box(3, 2, 2)     !! low and high, of slave and master [length]
    real(wp) :: least            !! of what is added to gaps, if below 0 [length]
    integer, allocatable :: of_faces(:, :), nodes(:)
    integer :: k

    is_out_of_reach = .false.
    associate (of => scene%pairs(pair), first => points%first(pair), &
               last => points%first(pair + 1) - 1)
      if (of%master /= 0 .or. of%small_sliding) return
      if (any(abs(new%reaction(:, first:last)) > 0.0_wp)) return
      of_faces = all_nodes_of(scene%surfaces(of%master_surface)%faces, scene%mesh%connectivity)
      nodes = pack(of_faces, of_faces > 0)
      least = 0.0_wp
      if (allocated(points%extra_gap)) least = min(0.0_wp, minval(points%extra_gap(first:last)))
      box(:, :, 1) = box_of(points%node(first:last))
      box(:, :, 2) = box_of(nodes)
    end associate
    associate (apart => max(box(:, 1, 1) - box(:, 2, 2), box(:, 1, 2) - box(:, 2, 1)))
      is_out_of_reach = maxval(apart) + least > maxval([(norm2(box(:, 2, k) - box(:, 1, k)), k=1, &
        2)])
    end associate

  contains

    !> Low and high of some nodes, where they are.
    pure function box_of(nodes) result(box)
      integer, intent(in) :: nodes(:)
      real(wp) :: box(3, 2)

      associate (x => scene%mesh%coordinates(:, nodes) + new%displacement(:, nodes))
        box(:, 1) = minval(x, dim=2)
        box(:, 2) = maxval(x, dim=2)
      end associate
    end function box_of

  end function is_out_of_reach

  !> The gaps of points before surfaces and facets in a state, where they differ from what was said
  !> by more than rules of quadrature do. Others stay as they are, and so do those of rows that are
  !> not compared, or that faces cover little.
  pure subroutine find_gaps(scene, points, state, contact, gap)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(state_t), intent(in) :: state
    type(contact_fields_t), intent(in) :: contact !! as of `is_left`
    real(wp), intent(inout) :: gap(:)             !! (n_points) [length]
    type(two_sides_t) :: sides
    type(rows_t) :: rows
    real(wp) :: normal(3), found
    type(edge_middles_t) :: middles
    logical, allocatable :: left(:)
    integer :: pair, side, i

    call find_edge_middles(scene, points, contact%weights, middles)
    do pair = 1, size(scene%pairs)
      if (points%first(pair + 1) == points%first(pair)) cycle
      if (.not. points%on_surface(points%first(pair))) cycle
      if (size(scene%surfaces(scene%pairs(pair)%surface)%faces, 2) == 0) cycle
      do side = 1, n_sides(points, pair)
        if (.not. has_both(scene, points, pair, side)) cycle
        call put_together(scene, points, pair, side, state, sides)
        call integrate(sides, rows)
        left = is_left(scene, points, sides, rows, contact)
        do i = sides%first, sides%last
          associate (here => i - sides%first + 1)
            if (left(here) .or. .not. rows%area(here) > compared*rows%whole(here)) cycle
            normal = rows%normal(:, here)
            where (is_across(points, i)) normal = 0.0_wp
            if (.not. norm2(normal) > compared*rows%area(here)) cycle
            found = dot_product(normal/norm2(normal), arm_of(sides, rows, here) + &
              lift_alone(points, sides, middles, i, state%displacement))
            found = found + lift_of_guess(rows, here, found, .false.) + points%extra_gap(i)
            if (abs(found - gap(i)) > of_quadrature*sqrt(rows%area(here))) gap(i) = found
          end associate
        end do
      end do
    end do
  end subroutine find_gaps

  !> By how much the gap of a node is above the mean: where what covers it is not turned to its
  !> faces, (11.35). Across a step, or a concave edge, a mean is none of contact: there a point that
  !> presses counts as open by its width, another one has the least gap.
  pure real(wp) function lift_of_guess(rows, here, mean, presses) result(lift)
    type(rows_t), intent(in) :: rows
    integer, intent(in) :: here
    real(wp), intent(in) :: mean    !! gap [length]
    logical, intent(in) :: presses
    real(wp), parameter :: aslant = 0.05_wp !! of what is covered: then all the way, (11.35)

    associate (above => rows%nearest(here) - mean)
      lift = (1.0_wp - rows%straight(here)/rows%area(here))/aslant
      lift = max(0.0_wp, min(1.0_wp, lift))*max(0.0_wp, above)
      if (rows%is_torn(here)) lift = merge(sqrt(rows%area(here)), above, presses)
    end associate
  end function lift_of_guess

  !> From the mean of what a row faces to its node.
  pure function arm_of(sides, rows, here) result(arm)
    type(two_sides_t), intent(in) :: sides
    type(rows_t), intent(in) :: rows
    integer, intent(in) :: here !! row
    real(wp) :: arm(3)          !! [length]
    integer :: k

    arm = sides%q(:, here)
    do k = rows%of_row%first(here), rows%of_row%first(here + 1) - 1
      associate (entry => rows%entry(rows%of_row%item(k)))
        arm = arm - entry%part/rows%area(here)*place_of_entry(sides, entry)
      end associate
    end do
  end function arm_of

  !> Points that are left as they are: by nodes that hang, by sides that cannot move apart, and by
  !> constraints rows are others than (11.2).
  pure function is_left(scene, points, sides, rows, contact) result(left)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(two_sides_t), intent(in) :: sides
    type(rows_t), intent(in) :: rows
    type(contact_fields_t), intent(in) :: contact
    logical :: left(size(sides%x, 2)), is_other(size(sides%x, 2))
    logical :: is_shared(scene%mesh%n_nodes) !! a node that hangs lies between it and others
    integer :: i, f

    is_other = .false.
    if (allocated(points%freedom)) is_other = .not. contact%weights%covers(sides%first:sides%last) &
      .and. may_have_no_multiplier(points, sides, rows)
    left = .false.
    do i = 1, size(left)
      associate (point => sides%first + i - 1)
        if (allocated(points%is_joined)) left(i) = points%is_joined(point)
        if (allocated(scene%mesh%hangs)) is_other(i) = is_other(i) .or. &
          scene%mesh%hangs(points%node(point))
      end associate
    end do
    do f = 1, size(sides%slave, 2)
      associate (row => sides%slave(:count(sides%slave(:, f) > 0), f))
        if (any(is_other(row))) left(row) = .true.
      end associate
    end do
    if (.not. allocated(scene%mesh%hangs)) return
    ! What a node has that hangs goes to nodes that other faces have, too.
    is_shared = .false.
    associate (nodes => points%node(sides%first:sides%last), mesh => scene%mesh)
      do i = 1, size(nodes)
        if (mesh%hangs(nodes(i))) is_shared(parents_of(mesh%between(:, nodes(i) - &
          mesh%n_given))) = .true.
      end do
      left = left .or. is_shared(nodes)
    end associate
  end function is_left

  !> Nodes to which (11.17) may leave no multiplier: the master covers some of them, and supports
  !> and constraints hold them along the normal, or let them move with the master.
  pure function may_have_no_multiplier(points, sides, rows) result(may)
    type(contact_points_t), intent(in) :: points
    type(two_sides_t), intent(in) :: sides
    type(rows_t), intent(in) :: rows
    logical :: may(size(sides%x, 2))
    real(wp), parameter :: turned = 0.2_wp
    !! of a unit normal: twice the 6 degrees within which the program's is that of the mesh [-]
    real(wp) :: normal(3, size(may))
    logical :: is_followed(size(points%freedom%is_bound)) !! the master, or a node that leads it
    integer :: i, c

    do i = 1, size(may)
      normal(:, i) = rows%normal(:, i)
      where (is_across(points, sides%first + i - 1)) normal(:, i) = 0.0_wp
      normal(:, i) = normal(:, i)/max(tiny(1.0_wp), norm2(normal(:, i)))
    end do
    associate (node => points%node(sides%first:sides%last), active => points%freedom%active)
      may = .not. can_move_along(active, points%freedom%can_move, node, normal, turned)
      is_followed = .false.
      if (allocated(sides%node)) is_followed(sides%node) = .true.
      do c = 1, active%n
        if (is_followed(active%node(c))) is_followed(masters_of(c)) = .true.
      end do
      may = may .or. is_followed(node)
      do c = 1, active%n
        if (any(is_followed(masters_of(c)))) may = may .or. node == active%node(c)
      end do
    end associate
    may = may .and. rows%area > 0.0_wp

  contains

    pure function masters_of(c) result(masters)
      integer, intent(in) :: c !! constraint
      integer, allocatable :: masters(:)

      masters = points%freedom%active%master(points%freedom%active%first(c): &
        points%freedom%active%first(c + 1) - 1)
    end function masters_of

  end function may_have_no_multiplier

  !> Hold the rows of a side against those of the increment.
  pure subroutine compare(scene, points, old, new, sides, rows, contact, torn_point)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(state_t), intent(in) :: old, new
    type(two_sides_t), intent(in) :: sides
    type(rows_t), intent(in) :: rows
    type(contact_fields_t), intent(inout) :: contact
    integer, intent(inout) :: torn_point !! as of certificate_t: the first one is kept
    type(weights_t) :: found
    type(edge_middles_t) :: middles
    real(wp) :: normal(3), arm(3), motion(3), gap, area, changed, weight(scene%mesh%n_nodes)
    real(wp) :: counts
    logical :: left(size(sides%x, 2)), differs(size(sides%x, 2)), presses
    integer :: first, last, i, n

    first = sides%first
    last = sides%last
    left = is_left(scene, points, sides, rows, contact)
    call find_edge_middles(scene, points, contact%weights, middles)
    ! With mid-side nodes what is covered less does not count, whatever the rules of quadrature.
    counts = compared
    if (any(sides%a > 0.0_wp)) counts = 2.0_wp*compared
    differs = .false.
    weight = 0.0_wp
    allocate (found%first(size(left) + 1), found%node(3*rows%n + size(left)), &
      found%weight(3*rows%n + size(left)))
    n = 0
    do i = first, last
      associate (here => i - first + 1, whole => rows%whole(i - first + 1))
        found%first(here) = n + 1
        area = rows%area(here)
        presses = any(abs(new%reaction(:, i)) > 0.0_wp)
        if (.not. whole > 0.0_wp) then
          ! Of a surface that touches itself it is no slave now.
          if (presses .and. touches_itself(points, sides%pair)) contact%gap(i) = uncovered
          cycle
        end if
        if (left(here)) then
          ! Across a step no mean is one of contact, whichever row makes it.
          if (.not. rows%is_torn(here) .or. area <= counts*whole .or. .not. is_covered(points, &
            contact%weights, i)) cycle
          if (allocated(points%is_joined)) then
            if (points%is_joined(i)) cycle
          end if
          if (presses) then
            contact%gap(i) = contact%gap(i) + sqrt(area)
          else if (.not. sides%stays) then
            contact%gap(i) = min(contact%gap(i), rows%nearest(here) + points%extra_gap(i))
          end if
          call note_torn(i, presses, contact%gap(i), torn_point)
          cycle
        end if
        normal = rows%normal(:, here)
        where (is_across(points, i)) normal = 0.0_wp
        if (is_covered(points, contact%weights, i)) then
          differs(here) = abs(area - contact%covered_area(i)) > of_quadrature*whole
        else
          differs(here) = area > counts*whole .and. norm2(normal) > compared*area
        end if
        if (.not. differs(here) .and. (area <= compared*whole .or. .not. is_covered(points, &
          contact%weights, i))) cycle
        if (.not. norm2(normal) > 0.0_wp) then
          contact%gap(i) = uncovered
          differs(here) = .false.
          cycle
        end if
        normal = normal/norm2(normal)
        call find_row(scene, points, sides, rows, here, found, n)
        found%first(here + 1) = n + 1
        arm = arm_of(sides, rows, here)
        motion = relative_motion(found, here, middles, i, points%node(i), new%displacement)
        if (.not. sides%stays) arm = arm + lift_alone(points, sides, middles, i, new%displacement)
        gap = dot_product(normal, arm)
        gap = gap + lift_of_guess(rows, here, gap, presses) + points%extra_gap(i)
        if (sides%stays) gap = gap + dot_product(normal, motion)
        if (rows%is_torn(here)) call note_torn(i, presses, gap, torn_point)
        call find_change(found, here, contact%weights, i, weight, changed)
        differs(here) = differs(here) .or. norm2(normal - contact%frame(:, 1, i)) > of_quadrature &
          .or. abs(gap - contact%gap(i)) > of_quadrature*sqrt(area) .or. &
          changed > of_quadrature*max(1.0_wp, sum(abs(found%weight(found%first(here):n))))
        if (.not. differs(here)) cycle
        motion = motion - relative_motion(found, here, middles, i, points%node(i), &
          old%displacement)
        contact%frame(:, :, i) = frame_of(normal)
        contact%gap(i) = gap
        contact%reaction(:, i) = matmul(new%reaction(:, i), contact%frame(:, :, i))
        contact%slip_increment(:, i) = matmul(without_turn(scene%mesh, 1, .true., motion), &
          contact%frame(:, 2:, i))
      end associate
    end do
    found%first(size(left) + 1) = n + 1
    if (any(differs)) call put_rows(first, differs, found, contact%weights)
  end subroutine compare

  !> Keep the first point to which a mean over a step matters.
  pure subroutine note_torn(i, presses, gap, torn_point)
    integer, intent(in) :: i             !! point
    logical, intent(in) :: presses
    real(wp), intent(in) :: gap          !! [length]
    integer, intent(inout) :: torn_point !! 0: none yet

    if (torn_point == 0 .and. (presses .or. gap < 0.0_wp)) torn_point = i
  end subroutine note_torn

  !> Hold slips at finite strain against how far what a point faces has gone over the master, at
  !> the places of the end. docs/theory.md (11.18).
  pure subroutine compare_slips(scene, points, sides, rows, rows_before, contact)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(two_sides_t), intent(in) :: sides           !! at the end of the increment
    type(rows_t), intent(in) :: rows, rows_before    !! there, and at its beginning
    type(contact_fields_t), intent(inout) :: contact
    logical :: left(size(sides%x, 2))
    real(wp) :: slip(2), gone(3)
    integer :: i

    left = is_left(scene, points, sides, rows, contact)
    do i = sides%first, sides%last
      associate (here => i - sides%first + 1)
        if (left(here) .or. .not. is_covered(points, contact%weights, i)) cycle
        if (min(rows%area(here), rows_before%area(here)) <= compared*rows%whole(here)) cycle
        gone = faced_place(sides, rows, here) - faced_place(sides, rows_before, here)
        where (is_across(points, i)) gone = 0.0_wp
        gone = without_turn(scene%mesh, 1, .true., gone)
        slip = matmul(gone, contact%frame(:, 2:, i))
        if (norm2(slip - contact%slip_increment(:, i)) <= of_quadrature*sqrt(rows%area(here))) cycle
        contact%slip_increment(:, i) = slip
      end associate
    end do
  end subroutine compare_slips

  !> The place on the master that a row makes, where `sides` are, from that of its slave node.
  pure function faced_place(sides, rows, here) result(place)
    type(two_sides_t), intent(in) :: sides
    type(rows_t), intent(in) :: rows
    integer, intent(in) :: here
    real(wp) :: place(3) !! [length]
    integer :: k

    place = 0.0_wp
    do k = rows%of_row%first(here), rows%of_row%first(here + 1) - 1
      associate (entry => rows%entry(rows%of_row%item(k)))
        place = place + entry%part/rows%area(here)*(place_of_entry(sides, entry) - &
          sides%q(:, here))
      end associate
    end do
  end function faced_place

  !> By how much the weights of two rows differ, summed over the nodes.
  pure subroutine find_change(one, i, other, j, weight, changed)
    type(weights_t), intent(in) :: one, other
    integer, intent(in) :: i, j          !! rows
    real(wp), intent(inout) :: weight(:) !! (n_nodes) 0 before and after
    real(wp), intent(out) :: changed     !! [-]
    integer :: k

    do k = one%first(i), one%first(i + 1) - 1
      weight(one%node(k)) = weight(one%node(k)) + one%weight(k)
    end do
    do k = other%first(j), other%first(j + 1) - 1
      weight(other%node(k)) = weight(other%node(k)) - other%weight(k)
    end do
    changed = 0.0_wp
    call take_out(one%node(one%first(i):one%first(i + 1) - 1), weight, changed)
    call take_out(other%node(other%first(j):other%first(j + 1) - 1), weight, changed)
  end subroutine find_change

  !> Add up what is left in `weight` at nodes, and take it out.
  pure subroutine take_out(nodes, weight, total)
    integer, intent(in) :: nodes(:)
    real(wp), intent(inout) :: weight(:) !! (n_nodes) [-]
    real(wp), intent(inout) :: total
    integer :: l

    do l = 1, size(nodes)
      total = total + abs(weight(nodes(l)))
      weight(nodes(l)) = 0.0_wp
    end do
  end subroutine take_out

  !> The weights of a row: of the master's nodes, or of the reference node that facets move with.
  pure subroutine find_row(scene, points, sides, rows, here, found, n)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(two_sides_t), intent(in) :: sides
    type(rows_t), intent(in) :: rows
    integer, intent(in) :: here
    type(weights_t), intent(inout) :: found
    integer, intent(inout) :: n !! entries so far
    real(wp) :: a, own
    integer :: k, l

    if (scene%pairs(sides%pair)%master > 0) then
      associate (ref_node => scene%obstacles(scene%pairs(sides%pair)%master)%ref_node)
        if (ref_node > 0) call add(ref_node, 1.0_wp, here, found, n)
      end associate
    end if
    do k = rows%of_row%first(here), rows%of_row%first(here + 1) - 1
      associate (entry => rows%entry(rows%of_row%item(k)))
        if (entry%place > 0) then
          if (.not. allocated(sides%node)) cycle
          call add(sides%node(entry%place), entry%part/rows%area(here), here, found, n)
          cycle
        end if
        associate (row => -entry%place, ends => sides%ends(:, -entry%place))
          a = 0.0_wp
          if (ends(1) > 0) a = sides%a(row)
          own = entry%part/rows%area(here)/(1.0_wp - 2.0_wp*a)
          call add(node_of(row), own, here, found, n)
          do l = 1, 2
            if (ends(1) > 0) call add(node_of(ends(l)), -a*own, here, found, n)
          end do
        end associate
      end associate
    end do

  contains

    pure integer function node_of(row)
      integer, intent(in) :: row

      node_of = points%node(sides%first - 1 + row)
    end function node_of
  end subroutine find_row

  !> Add to the weight of a node in the last row.
  pure subroutine add(node, weight, row, found, n)
    integer, intent(in) :: node, row
    real(wp), intent(in) :: weight          !! [-]
    type(weights_t), intent(inout) :: found !! of this row its first entry is known
    integer, intent(inout) :: n             !! entries so far
    integer :: l

    do l = found%first(row), n
      if (found%node(l) == node) exit
    end do
    if (l > n) then
      n = l
      found%node(n) = node
      found%weight(n) = 0.0_wp
    end if
    found%weight(l) = found%weight(l) + weight
  end subroutine add

  !> Displacement of a point less that of what it faces.
  pure function relative_motion(rows, here, middles, i, node, u) result(motion)
    type(weights_t), intent(in) :: rows
    integer, intent(in) :: here
    type(edge_middles_t), intent(in) :: middles
    integer, intent(in) :: i, node   !! the point, its node
    real(wp), intent(in) :: u(:, :)  !! (3,n_nodes) [length]
    real(wp) :: motion(3)            !! [length]
    integer :: k

    motion = vector_at_point(middles, node, i, u)
    do k = rows%first(here), rows%first(here + 1) - 1
      motion = motion - rows%weight(k)*u(:, rows%node(k))
    end do
  end function relative_motion

  !> What a node in the middle of an edge that is a point by itself has moved more than its place in
  !> the edge would have.
  pure function lift_alone(points, sides, middles, i, u) result(lift)
    type(contact_points_t), intent(in) :: points
    type(two_sides_t), intent(in) :: sides
    type(edge_middles_t), intent(in) :: middles
    integer, intent(in) :: i
    real(wp), intent(in) :: u(:, :)  !! (3,n_nodes) [length]
    real(wp) :: lift(3)              !! [length]

    lift = 0.0_wp
    associate (ends => sides%ends(:, i - sides%first + 1), a => sides%a(i - sides%first + 1))
      if (ends(1) == 0) return
      if (middles%a(i) > 0.0_wp) return
      associate (one => points%node(sides%first - 1 + ends(1)), &
                 other => points%node(sides%first - 1 + ends(2)))
        lift = a/(1.0_wp - 2.0_wp*a)*(u(:, one) + u(:, other) - 2.0_wp*u(:, points%node(i)))
      end associate
    end associate
  end function lift_alone

  !> Put rows that differ in the place of those that were said.
  pure subroutine put_rows(first, differs, found, weights)
    integer, intent(in) :: first              !! point
    logical, intent(in) :: differs(:)         !! (n) of the points from there
    type(weights_t), intent(in) :: found      !! (n) rows
    type(weights_t), intent(inout) :: weights !! of all points
    type(weights_t) :: before
    integer :: i, here, n
    logical :: is_found

    before = weights
    deallocate (weights%node, weights%weight)
    allocate (weights%node(size(before%node) + size(found%node)), &
      weights%weight(size(before%node) + size(found%node)))
    n = 0
    do i = 1, size(before%first) - 1
      here = i - first + 1
      weights%first(i) = n + 1
      is_found = here >= 1 .and. here <= size(differs)
      if (is_found) is_found = differs(here)
      if (is_found) then
        call copy_row(found, here, weights, n)
        weights%covers(i) = .true.
      else
        call copy_row(before, i, weights, n)
      end if
    end do
    weights%first(size(before%first)) = n + 1
  end subroutine put_rows

  !> Put a row behind `n` entries.
  pure subroutine copy_row(from, row, to, n)
    type(weights_t), intent(in) :: from
    integer, intent(in) :: row
    type(weights_t), intent(inout) :: to
    integer, intent(inout) :: n

    associate (first => from%first(row), last => from%first(row + 1) - 1)
      to%node(n + 1:n + last - first + 1) = from%node(first:last)
      to%weight(n + 1:n + last - first + 1) = from%weight(first:last)
      n = n + last - first + 1
    end associate
  end subroutine copy_row

end module facing_surfaces_mod
