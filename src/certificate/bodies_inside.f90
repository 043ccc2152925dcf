!> Bodies inside other bodies, or inside themselves, where no contact keeps them out.
!>
!> By code of its own, from moved places alone. docs/theory.md section 6.
module bodies_inside_mod
  use kinds_mod, only: wp
  use contact_points_mod, only: contact_points_t, is_pair_removed
  use increment_report_mod, only: contact_fields_t
  use box_tree_mod, only: list_pairs
  use hulls_mod, only: hulls_t, make_hulls, n_triangles, normal_of, triangle, times_inside, &
    depth_below, find_piercing
  use outer_edges_mod, only: edges_t, edges_of, way_inwards, rises, within
  use lists_mod, only: columns_with, lists_t
  use pair_faces_mod, only: touches_itself
  use scene_mod, only: scene_t
  use small_matrix_mod, only: cross
  use surfaces_mod, only: all_nodes_of
  implicit none
  private

  public :: inside_t, find_inside, fold_on_themselves

  !> A place inside a body.
  type :: inside_t
    integer :: node = 0            !! 0: there is none
    integer :: other_node = 0      !! the other end of the edge that it is on; 0: it is the node
    integer :: piece = 0           !! of the mesh, that it is in
    integer :: pair = 0            !! that has the faces there, and does not feel it; 0: none has
    real(wp) :: depth = 0.0_wp     !! to the nearest outer face [length]
  end type inside_t

  !> A state, and what does not count in it.
  type :: look_t
    type(hulls_t) :: hulls               !! where bodies are
    real(wp), allocatable :: u(:, :)     !! (3,n_nodes) [length]
    logical,  allocatable :: presses(:)  !! (0:n_nodes) whether a contact force acts on a slave
    logical,  allocatable :: beside(:)   !! (0:n_nodes) or on another of one of its faces
    real(wp), allocatable :: entered(:)
    !! (n_pairs) how deep faces of a pair that presses are in each other between nodes [length]
    real(wp), allocatable :: extra_gap(:)
    !! (0:n_nodes) that the deck adds to those of slaves [length]
    real(wp), allocatable :: rise(:)     !! (n_faces) of `rises` [length]
    integer,  allocatable :: skipped(:, :) !! (2,n) pieces that may be in each other
    logical :: is_first_enough = .false. !! any place will do
    logical,  allocatable :: folds(:)    !! (n_pieces) as of `fold_on_themselves`
    logical :: skips_found = .false.     !! pieces found in each other are skipped, and no place is
    type(inside_t) :: of_no_pair         !! the first place that is found so where no pair has faces
    real(wp) :: allowed = 0.0_wp         !! depth that is none [length]
    logical :: ends_step = .true.
  end type look_t

  real(wp), parameter :: beyond = 4.0_wp
  !! as deep may the corners of faces be as the deepest place that means are taken over;
  !! 370 random decks end alike with 2 to 8 [-]

contains

  !> The place that is deepest inside another body, or inside its own a second time, of nodes and
  !> edges of outer faces.
  !>
  !> Where a contact pair has the faces, edges alone count, at the end of a *STEP; near nodes that
  !> press they are allowed what is between nodes. Bodies that constraints join do not count, nor
  !> those that overlap in the mesh of the deck or may by *CONTACT EXCLUSIONS, nor those whose pair
  !> a *STEP has removed.
  pure subroutine find_inside(scene, points, contact, u, least, ends_step, deepest, in_mesh)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(in) :: contact !! at the end of the increment
    real(wp), intent(in) :: u(:, :)        !! (3,n_nodes) [length]
    real(wp), intent(in) :: least          !! depth that rounding and tolerance leave [length]
    logical, intent(in) :: ends_step
    type(inside_t), intent(out) :: deepest
    type(inside_t), intent(out) :: in_mesh !! a place of what the mesh has in each other, of no pair
    type(inside_t) :: none
    type(look_t) :: now, rest
    integer :: i

    if (.not. allocated(scene%mesh%skin)) return
    if (size(scene%mesh%skin) == 0) return
    now%u = u
    call make_hulls(scene%mesh, scene%mesh%coordinates + u, now%hulls)
    now%ends_step = ends_step
    now%allowed = least + within*now%hulls%extent
    now%folds = fold_on_themselves(scene, points)
    allocate (now%entered(size(scene%pairs)), source=0.0_wp)
    allocate (now%presses(0:scene%mesh%n_nodes), source=.false.)
    allocate (now%extra_gap(0:scene%mesh%n_nodes), source=0.0_wp)
    do i = 1, points%n
      if (scene%pairs(points%pair(i))%master > 0) cycle
      now%extra_gap(points%node(i)) = max(now%extra_gap(points%node(i)), points%extra_gap(i))
      if (.not. any(abs(contact%reaction(:, i)) > 0.0_wp)) cycle
      now%presses(points%node(i)) = .true.
      now%entered(points%pair(i)) = max(now%entered(points%pair(i)), -contact%least_gap(i))
    end do
    call find_neighbours(scene, now%presses, now%beside)
    now%skipped = removed_pieces(scene, points)
    now%is_first_enough = .true.
    call find_deepest(scene, now, deepest)
    if (deepest%node == 0) return
    ! Most scenes end here; what the deck's mesh has in each other is looked for in others alone.
    now%is_first_enough = .false.
    rest = now
    rest%u = 0.0_wp
    call make_hulls(scene%mesh, scene%mesh%coordinates, rest%hulls)
    rest%ends_step = .true.
    rest%presses = .false.
    rest%beside = .false.
    rest%skips_found = .true.
    if (allocated(rest%rise)) deallocate (rest%rise)
    call find_deepest(scene, rest, none)
    in_mesh = rest%of_no_pair
    now%skipped = rest%skipped
    call find_deepest(scene, now, deepest)
  end subroutine find_inside

  !> Beside what presses: all nodes of the slave faces that have one that does.
  pure subroutine find_neighbours(scene, presses, beside)
    type(scene_t), intent(in) :: scene
    logical, intent(in) :: presses(0:)
    logical, allocatable, intent(out) :: beside(:) !! (0:n_nodes)
    integer, allocatable :: faces(:, :)
    integer :: pair, f

    allocate (beside(0:size(presses) - 1))
    beside = presses
    do pair = 1, size(scene%pairs)
      if (scene%pairs(pair)%master_surface == 0) cycle
      faces = all_nodes_of(scene%surfaces(scene%pairs(pair)%surface)%faces, scene%mesh%connectivity)
      do f = 1, size(faces, 2)
        if (any(presses(faces(:, f)))) beside(faces(:, f)) = .true.
      end do
    end do
    beside(0) = .false.
  end subroutine find_neighbours

  !> Which bodies contact keeps from going through themselves: all where everything may touch, and
  !> those with a surface that touches itself, but for what the deck lets overlap or has removed.
  pure function fold_on_themselves(scene, points) result(fold)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    logical :: fold(scene%mesh%n_pieces)
    integer, allocatable :: free(:, :) !! (2,n)
    integer :: p, k

    fold = allocated(scene%may_overlap)
    do p = 1, size(scene%pairs)
      if (.not. touches_itself(points, p)) cycle
      associate (piece => scene%mesh%piece(scene%surfaces(scene%pairs(p)%surface)%nodes))
        fold = fold .or. [(any(piece == k), k=1, size(fold))]
      end associate
    end do
    free = removed_pieces(scene, points)
    do k = 1, size(free, 2)
      if (free(1, k) == free(2, k)) fold(free(1, k)) = .false.
    end do
  end function fold_on_themselves

  !> Pieces that the deck lets overlap, and those whose pair a *STEP has removed.
  pure function removed_pieces(scene, points) result(pieces)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, allocatable :: pieces(:, :) !! (2,n)
    logical :: has(scene%mesh%n_pieces, 2)
    integer :: p, one, other

    allocate (pieces(2, 0))
    if (allocated(scene%may_overlap)) pieces = scene%may_overlap
    do p = 1, size(scene%pairs)
      if (scene%pairs(p)%master_surface == 0 .or. .not. is_pair_removed(points, p)) cycle
      has = .false.
      has(scene%mesh%piece(scene%surfaces(scene%pairs(p)%surface)%nodes), 1) = .true.
      has(scene%mesh%piece(scene%surfaces(scene%pairs(p)%master_surface)%nodes), 2) = .true.
      pieces = reshape([pieces, ((pack([one, other], has(one, 1) .and. has(other, 2)), one=1, &
        size(has, 1)), other=1, size(has, 1))], [2, size(pieces, 2) + count(has(:, 1))* &
        count(has(:, 2))])
    end do
  end function removed_pieces

  !> The place that is deepest inside.
  pure subroutine find_deepest(scene, look, deepest)
    type(scene_t), intent(in) :: scene
    type(look_t), intent(inout) :: look  !! gets `rise` and `skipped` where they are asked for
    type(inside_t), intent(out) :: deepest
    logical :: is_outer(0:scene%mesh%n_nodes), is_suspect(0:size(look%hulls%piece))
    type(edges_t) :: edges
    integer, allocatable :: face(:)
    real(wp), allocatable :: part(:)
    real(wp) :: ends(3, 2)
    integer :: e, f, i, n

    call find_suspects(scene, look, is_suspect)
    if (any(is_suspect)) then
      edges = edges_of(look%hulls%face, scene%mesh%n_nodes)
      do e = 1, size(edges%node, 2)
        if (.not. any(is_suspect(edges%face(:, e)))) cycle
        associate (nodes => edges%node(:, e), faces => edges%face(:, e))
          ends = look%hulls%x(:, nodes) + spread(way_inwards(look%hulls, nodes, faces), 2, 2)
          call find_piercing(look%hulls, ends, own_nodes(look%hulls, faces), n, face, part)
        end associate
        if (n > 0) call judge_edge(scene, edges, e, ends, face(:n), part(:n), look, deepest)
        if (look%is_first_enough .and. deepest%node > 0) return
      end do
    end if
    if (any(look%folds)) call find_enclosed(scene, edges, look, deepest)
    if (look%is_first_enough .and. deepest%node > 0) return
    if (scene%mesh%n_pieces < 2) return
    is_outer = .false.
    do f = 1, size(look%hulls%piece)
      is_outer(look%hulls%face(:, f)) = .true.
    end do
    do i = 1, scene%mesh%n_nodes
      if (is_outer(i)) call judge_node(scene, i, look, deepest)
      if (look%is_first_enough .and. deepest%node > 0) return
    end do
  end subroutine find_deepest

  !> Edges may be inside their own body a second time and pierce nothing, where all around them is
  !> so, or what they pierce is beside nodes that press.
  pure subroutine find_enclosed(scene, edges, look, deepest)
    type(scene_t), intent(in) :: scene
    type(edges_t), intent(inout) :: edges  !! made where they are not yet
    type(look_t), intent(inout) :: look
    type(inside_t), intent(inout) :: deepest
    logical :: is_crease(0:scene%mesh%n_nodes)
    integer :: times(scene%mesh%n_pieces), pair, e, f
    integer, allocatable :: own(:)
    real(wp) :: place(3), depth, allowed

    if (.not. allocated(edges%node)) edges = edges_of(look%hulls%face, scene%mesh%n_nodes)
    is_crease = creases(look%hulls, scene%mesh%n_nodes)
    do e = 1, size(edges%node, 2)
      own = own_nodes(look%hulls, edges%face(:, e))
      if (any(is_crease(own))) cycle
      associate (node => edges%node(:, e), faces => edges%face(:, e))
        associate (piece => scene%mesh%piece(node(1)))
          if (.not. (look%folds(piece) .and. is_looked_at(look, piece, piece))) cycle
          place = 0.5_wp*sum(look%hulls%x(:, node), 2) + way_inwards(look%hulls, node, faces)
          call times_inside(look%hulls, place, times)
          if (times(piece) < 2) cycle
          pair = pair_of(scene, node, reshape([node, 0, 0], [4, 1]))
          allowed = allowed_at(scene, look, pair, faces)
          if (pair > 0) call add_rise(edges, [(f, f=1, size(look%hulls%piece))], look, allowed)
          depth = depth_below(look%hulls, piece, place, own, max(allowed, deepest%depth))
          if (depth > 0.0_wp) call note_place(look, piece, inside_t(node(1), node(2), piece, pair, &
            depth), deepest)
        end associate
      end associate
      if (look%is_first_enough .and. deepest%node > 0) return
    end do
  end subroutine find_enclosed

  !> The nodes of which two faces look against each other: what shares one may be in each other.
  pure function creases(hulls, n_nodes) result(is)
    type(hulls_t), intent(in) :: hulls
    integer, intent(in) :: n_nodes
    logical :: is(0:n_nodes)
    real(wp) :: normal(3, size(hulls%piece))
    type(lists_t) :: about
    integer :: f, i, k

    is = .false.
    do f = 1, size(hulls%piece)
      normal(:, f) = normal_of(hulls, f)
    end do
    about = columns_with(hulls%face, n_nodes)
    do i = 1, n_nodes
      associate (faces => about%item(about%first(i):about%first(i + 1) - 1))
        do k = 2, size(faces)
          is(i) = is(i) .or. any(matmul(normal(:, faces(k)), normal(:, faces(:k - 1))) < 0.0_wp)
        end do
      end associate
    end do
  end function creases

  !> Faces of which an edge may be inside: it ends deeper below the plane of another face that it
  !> reaches than it may.
  pure subroutine find_suspects(scene, look, is_suspect)
    type(scene_t), intent(in) :: scene
    type(look_t), intent(in) :: look
    logical, intent(out) :: is_suspect(0:) !! (0:n_faces)
    integer, allocatable :: pairs(:, :)
    integer :: i, n

    is_suspect = .false.
    call list_pairs(look%hulls%tree, n, pairs)
    do i = 1, n
      if (look%hulls%piece(pairs(1, i)) == look%hulls%piece(pairs(2, i))) then
        if (share_node(look%hulls%face(:, pairs(1, i)), look%hulls%face(:, pairs(2, i)))) cycle
      end if
      if (.not. is_suspect(pairs(1, i))) is_suspect(pairs(1, i)) = may_enter(scene, look, &
        pairs(1, i), pairs(2, i))
      if (.not. is_suspect(pairs(2, i))) is_suspect(pairs(2, i)) = may_enter(scene, look, &
        pairs(2, i), pairs(1, i))
    end do
  end subroutine find_suspects

  !> Whether an edge of a face may be deeper behind another one than it may.
  pure logical function may_enter(scene, look, one, other) result(may)
    type(scene_t), intent(in) :: scene
    type(look_t), intent(in) :: look
    integer, intent(in) :: one, other
    real(wp) :: c(3, 3), normal(3), height(4), lowest
    integer :: k, m, n, pair

    may = .false.
    associate (hulls => look%hulls)
      if (.not. is_looked_at(look, hulls%piece(one), hulls%piece(other))) return
      n = count(hulls%face(:, one) > 0)
      lowest = 0.0_wp
      do k = 1, n_triangles(hulls, other)
        c = triangle(hulls, other, k)
        normal = cross(c(:, 2) - c(:, 1), c(:, 3) - c(:, 1))
        normal = normal/max(tiny(1.0_wp), norm2(normal))
        height(:n) = [(dot_product(normal, hulls%x(:, hulls%face(m, one)) - c(:, 1)), m=1, n)]
        ! Edges that are below as a whole pierce nothing.
        if (maxval(height(:n)) >= -look%allowed) lowest = min(lowest, minval(height(:n)))
      end do
      if (lowest >= -look%allowed) return
      pair = pair_of(scene, hulls%face(:, one), hulls%face(:, [other]))
      may = is_deep(scene, look, pair, [one, other], -lowest)
    end associate
  end function may_enter

  !> Whether a depth is more than what is allowed whatever the surfaces are: what they are in each
  !> other between nodes where they press, gaps that the deck adds, and turning at small strain.
  pure logical function is_deep(scene, look, pair, faces, depth)
    type(scene_t), intent(in) :: scene
    type(look_t), intent(in) :: look
    integer, intent(in) :: pair, faces(:) !! 0 is none
    real(wp), intent(in) :: depth !! [length]

    is_deep = .false.
    if (pair > 0) then
      if (.not. look%ends_step .or. scene%pairs(pair)%small_sliding) return
    end if
    is_deep = depth > allowed_at(scene, look, pair, faces)
  end function is_deep

  !> Whether two faces have a node in common.
  pure logical function share_node(one, other)
    integer, intent(in) :: one(4), other(4) !! 0 is none
    integer :: k

    share_node = .false.
    do k = 1, 4
      share_node = share_node .or. (one(k) > 0 .and. any(other == one(k)))
    end do
  end function share_node

  !> A node may be inside other bodies of which no pair has faces together with its own.
  pure subroutine judge_node(scene, node, look, deepest)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: node
    type(look_t), intent(inout) :: look
    type(inside_t), intent(inout) :: deepest
    integer :: times(scene%mesh%n_pieces), p
    integer, parameter :: none(0) = 0
    real(wp) :: depth
    logical :: is_in_box

    is_in_box = .false.
    associate (x => look%hulls%x(:, node), piece => scene%mesh%piece(node))
      do p = 1, scene%mesh%n_pieces
        if (p == piece) cycle
        is_in_box = all(x > look%hulls%low(:, p) + look%allowed .and. x < look%hulls%high(:, p) - &
          look%allowed)
        if (is_in_box) exit
      end do
      if (.not. is_in_box) return
      call times_inside(look%hulls, x, times)
      do p = 1, scene%mesh%n_pieces
        if (p == piece .or. times(p) < 1) cycle
        if (.not. is_looked_at(look, piece, p)) cycle
        depth = depth_below(look%hulls, p, x, none, max(look%allowed, deepest%depth))
        if (.not. depth > 0.0_wp) cycle
        if (has_pair(scene, node, p)) cycle
        call note_place(look, piece, inside_t(node, 0, p, 0, depth), deepest)
      end do
    end associate
  end subroutine judge_node

  !> An edge may be inside a piece between the faces of that which it pierces.
  pure subroutine judge_edge(scene, edges, e, ends, face, part, look, deepest)
    type(scene_t), intent(in) :: scene
    type(edges_t), intent(in) :: edges
    integer, intent(in) :: e, face(:)
    real(wp), intent(in) :: ends(:, :), part(:) !! (3,2) [length], of `find_piercing`
    type(look_t), intent(inout) :: look
    type(inside_t), intent(inout) :: deepest
    integer :: piece, k
    logical :: its(size(face)), is_seen(size(face))
    real(wp) :: from, to

    piece = scene%mesh%piece(edges%node(1, e))
    is_seen = .false.
    do k = 1, size(face)
      if (is_seen(k)) cycle
      its = look%hulls%piece(face) == look%hulls%piece(face(k))
      is_seen = is_seen .or. its
      if (.not. is_looked_at(look, piece, look%hulls%piece(face(k)))) cycle
      from = 0.0_wp
      do
        to = min(1.0_wp, minval(part, mask=its .and. part > from))
        call judge_part(scene, edges, e, ends, [from, to], pack(face, its .and. part >= from .and. &
          part <= to), look, deepest)
        if (.not. to < 1.0_wp) exit
        from = to
      end do
    end do
  end subroutine judge_edge

  !> A part of an edge between faces: how deep is its middle, or its end where that is a node?
  pure subroutine judge_part(scene, edges, e, ends, part, face, look, deepest)
    type(scene_t), intent(in) :: scene
    type(edges_t), intent(in) :: edges
    integer, intent(in) :: e, face(:)
    real(wp), intent(in) :: ends(:, :), part(2) !! (3,2) [length], [-]
    type(look_t), intent(inout) :: look
    type(inside_t), intent(inout) :: deepest
    integer :: times(scene%mesh%n_pieces), k, pair
    integer, allocatable :: own(:)
    real(wp) :: at(3), place(3), depth, allowed

    associate (piece => scene%mesh%piece(edges%node(1, e)), other => look%hulls%piece(face(1)))
      at = [0.5_wp*sum(part), part]
      place = matmul(ends, [1.0_wp - at(1), at(1)])
      call times_inside(look%hulls, place, times)
      if (times(other) < merge(2, 1, piece == other)) return
      pair = pair_of(scene, edges%node(:, e), look%hulls%face(:, face))
      if (.not. is_deep(scene, look, pair, [edges%face(:, e), face], huge(1.0_wp))) return
      allowed = allowed_at(scene, look, pair, [edges%face(:, e), face])
      if (pair > 0) call add_rise(edges, [edges%face(:, e), face], look, allowed)
      allocate (own(0))
      if (piece == other) own = own_nodes(look%hulls, edges%face(:, e))
      do k = 1, 3
        if (k > 1 .and. at(k) > 0.0_wp .and. at(k) < 1.0_wp) cycle
        depth = depth_below(look%hulls, other, matmul(ends, [1.0_wp - at(k), at(k)]), own, &
          max(allowed, deepest%depth))
        if (depth > 0.0_wp) call note_place(look, piece, inside_t(edges%node(1, e), &
          edges%node(2, e), other, pair, depth), deepest)
      end do
    end associate
  end subroutine judge_part

  !> Keep a place that is deeper than those before it, or skip its pieces from here on.
  pure subroutine note_place(look, piece, found, deepest)
    type(look_t), intent(inout) :: look
    integer, intent(in) :: piece           !! of its node
    type(inside_t), intent(in) :: found
    type(inside_t), intent(inout) :: deepest

    if (look%skips_found) then
      if (look%of_no_pair%node == 0 .and. found%pair == 0) look%of_no_pair = found
      look%skipped = reshape([look%skipped, piece, found%piece], [2, size(look%skipped, 2) + 1])
    else
      deepest = found
    end if
  end subroutine note_place

  !> The nodes of an edge's faces: faces that share a node never meet.
  pure function own_nodes(hulls, faces) result(nodes)
    type(hulls_t), intent(in) :: hulls
    integer, intent(in) :: faces(2) !! the second may be 0
    integer, allocatable :: nodes(:)

    nodes = reshape(hulls%face(:, pack(faces, faces > 0)), [4*count(faces > 0)])
    nodes = pack(nodes, nodes > 0)
  end function own_nodes

  !> Whether one piece may not be in another.
  pure logical function is_looked_at(look, one, other) result(is)
    type(look_t), intent(in) :: look
    integer, intent(in) :: one, other
    integer :: k

    is = look%hulls%is_closed(other)
    if (one /= other) is = is .and. look%hulls%body(one) /= look%hulls%body(other)
    do k = 1, size(look%skipped, 2)
      is = is .and. any(look%skipped(:, k) /= [one, other]) .and. any(look%skipped(:, k) /= &
        [other, one])
    end do
  end function is_looked_at

  !> The pair that has nodes of an edge in one of its surfaces and of one of the faces in the other:
  !> at the rim of a surface the faces beside it get into what presses it; 0: none.
  pure integer function pair_of(scene, edge, faces) result(pair)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: edge(2), faces(:, :) !! (4,n) nodes
    integer :: f

    do pair = 1, size(scene%pairs)
      associate (of => scene%pairs(pair))
        if (of%master_surface == 0) cycle
        associate (slave => scene%surfaces(of%surface)%nodes, &
                   master => scene%surfaces(of%master_surface)%nodes)
          do f = 1, size(faces, 2)
            if (has_one(slave, edge) .and. has_one(master, faces(:, f))) return
            if (has_one(master, edge) .and. has_one(slave, faces(:, f))) return
          end do
        end associate
      end associate
    end do
    pair = 0
  end function pair_of

  !> Whether a pair has a node in one of its surfaces, and nodes of a piece in the other.
  pure logical function has_pair(scene, node, piece) result(has)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: node, piece
    integer :: p

    has = .false.
    do p = 1, size(scene%pairs)
      if (scene%pairs(p)%master_surface == 0) cycle
      associate (slave => scene%surfaces(scene%pairs(p)%surface)%nodes, &
                 master => scene%surfaces(scene%pairs(p)%master_surface)%nodes)
        has = has_one(slave, [node]) .and. any(scene%mesh%piece(master) == piece)
        if (.not. has) has = has_one(master, [node]) .and. any(scene%mesh%piece(slave) == piece)
      end associate
      if (has) return
    end do
  end function has_pair

  !> Whether an ascending list has one of some nodes.
  pure logical function has_one(list, nodes)
    integer, intent(in) :: list(:), nodes(:)
    integer :: i, low, high, middle

    has_one = .false.
    if (size(list) == 0) return
    do i = 1, size(nodes)
      low = 1
      high = size(list)
      do while (low < high)
        middle = (low + high)/2
        if (list(middle) < nodes(i)) then
          low = middle + 1
        else
          high = middle
        end if
      end do
      has_one = has_one .or. list(low) == nodes(i)
    end do
  end function has_one

  !> Whether some faces have one of some nodes.
  pure logical function have_any(look, faces, are_some)
    type(look_t), intent(in) :: look
    integer, intent(in) :: faces(:) !! 0 is none
    logical, intent(in) :: are_some(0:) !! (0:n_nodes)
    integer :: k

    have_any = .false.
    do k = 1, size(faces)
      if (faces(k) > 0) have_any = have_any .or. any(are_some(look%hulls%face(:, faces(k))))
    end do
  end function have_any

  !> How deep faces may be in each other, whatever they are parts of [length]: anything where their
  !> nodes press, as then the pair feels it; beside them as deep as faces of the pair are between
  !> nodes; gaps that the deck adds to those of the mesh; at small strain as turning takes them.
  pure real(wp) function allowed_at(scene, look, pair, faces) result(allowed)
    type(scene_t), intent(in) :: scene
    type(look_t), intent(in) :: look
    integer, intent(in) :: pair, faces(:) !! 0 is none
    real(wp) :: extra
    integer :: k

    allowed = look%allowed
    extra = 0.0_wp
    if (pair > 0) then
      if (have_any(look, faces, look%presses)) then
        allowed = huge(1.0_wp)
        return
      end if
      if (have_any(look, faces, look%beside)) allowed = allowed + beyond*look%entered(pair)
      do k = 1, size(faces)
        if (faces(k) > 0) extra = max(extra, maxval(look%extra_gap(look%hulls%face(:, faces(k)))))
      end do
      allowed = allowed + extra
    end if
    if (.not. scene%finite_strain) allowed = allowed + turned_by(scene, look, faces)
  end function allowed_at

  !> Faces of a pair may be in each other as far as the flat faces of a hollow stand out of it.
  pure subroutine add_rise(edges, faces, look, allowed)
    type(edges_t), intent(in) :: edges
    integer, intent(in) :: faces(:) !! 0 is none
    type(look_t), intent(inout) :: look
    real(wp), intent(inout) :: allowed !! [length]

    if (.not. allocated(look%rise)) look%rise = rises(look%hulls, edges)
    allowed = allowed + maxval(look%rise(pack(faces, faces > 0)))
  end subroutine add_rise

  !> How far displacements take faces through each other at small strain by turning them, which is
  !> of second order: the most that a node moves times the most that an edge turns or stretches
  !> [length].
  pure real(wp) function turned_by(scene, look, faces) result(turned)
    type(scene_t), intent(in) :: scene
    type(look_t), intent(in) :: look
    integer, intent(in) :: faces(:) !! 0 is none
    real(wp) :: moved
    integer :: k, m, n, a, b

    moved = 0.0_wp
    turned = 0.0_wp
    do k = 1, size(faces)
      if (faces(k) == 0) cycle
      n = count(look%hulls%face(:, faces(k)) > 0)
      do m = 1, n
        a = look%hulls%face(m, faces(k))
        b = look%hulls%face(1 + mod(m, n), faces(k))
        moved = max(moved, norm2(look%u(:, a)))
        if (a /= b) turned = max(turned, norm2(look%u(:, a) - look%u(:, b))/max(tiny(1.0_wp), &
          norm2(scene%mesh%coordinates(:, a) - scene%mesh%coordinates(:, b))))
      end do
    end do
    turned = moved*turned
  end function turned_by

end module bodies_inside_mod
