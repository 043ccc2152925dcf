!> Contact pairs of two surfaces, and of a surface and facets of an obstacle: what of them must
!> hold before anything may be computed.
module surface_pairs_mod
  use cards_mod, only: note, reader_t, report
  use cells_mod, only: face_corners
  use connectivity_mod, only: corners_in, nodes_of_element, nodes_of_face
  use diagnostics_mod, only: quoted
  use kinds_mod, only: wp
  use surface_reach_mod, only: reach_of_faces, reach_of_all, face_each_other, look_away
  use mortar_rows_mod, only: mortar_t, slave_t
  use mortar_mod, only: make_mortar
  use facet_mortar_mod, only: face_facets, facet_pair_t, facets_face, join_facets, &
    reach_of_all_facets, reach_of_facets
  use face_directions_mod, only: may_touch_itself
  use faces_mod, only: face_area_vectors
  use find_faces_mod, only: find_outer_faces, size_of_face
  use mesh_draft_mod, only: mesh_draft_t, solids
  use obstacle_shapes_mod, only: holds_turned_away, how_to_turn_round, is_meshed
  use obstacles_mod, only: obstacle_t
  use scene_mod, only: contact_pair_t
  use sets_mod, only: model_t
  use sorting_mod, only: sort_unique
  use surface_list_mod, only: add_faces, add_surface_of_faces, find_faces_of_nodes, surface_list_t
  use surfaces_mod, only: all_nodes_of, bare_nodes, nodes_of, surface_t
  use text_mod, only: counted, to_text
  implicit none
  private

  public :: check_surface_pair, check_obstacle_pair, check_general_pair, check_self_pair

  real(wp), parameter :: much_coarser = 1.5_wp !! edges of slave faces over those of the master [-]

contains

  !> Report what keeps two surfaces from being a pair: `pair` loses its master then.
  subroutine check_surface_pair(reader, model, surfaces, slave_position, master_position, pair)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(surface_list_t), intent(inout) :: surfaces !! faces of a surface of nodes are found
    integer, intent(in) :: slave_position, master_position !! of the names in the deck
    type(contact_pair_t), intent(inout) :: pair
    logical :: ok

    if (.not. allocated(surfaces%list(pair%surface)%faces)) return
    call find_faces_of_nodes(reader, model, surfaces, pair%master_surface)
    call take_faces_about(reader, model, surfaces, pair)
    call leave_out_bare_nodes(reader, model, surfaces, pair%surface, &
      surfaces%list(pair%master_surface)%name)
    associate (slave => surfaces%list(pair%surface), &
               master => surfaces%list(pair%master_surface), mesh => model%mesh)
      ok = .not. (surfaces%flawed(pair%surface) .or. surfaces%flawed(pair%master_surface))
      if (ok) then
        call check_faces(reader, model, slave, slave_position, &
          'the slave '//quoted(slave%name)//' of a pair of two surfaces', ok)
        call check_faces(reader, model, master, master_position, &
          'the master '//quoted(master%name)//' of a pair of two surfaces', ok)
      end if
      if (ok) then
        ok = any_of_its_own(slave%nodes, master%nodes, mesh%n_nodes)
        if (.not. ok) call report(reader, master_position, 'all nodes of '//quoted(slave%name)// &
          ' belong to '//quoted(master%name)//', too: the surfaces cannot move apart')
      end if
      if (ok) call check_sides(reader, model, slave, master, master_position, pair, ok)
    end associate
    if (.not. ok) pair%master_surface = 0
  end subroutine check_surface_pair

  !> Check a pair of a surface with itself, whose sides are found where nodes are in the run: it
  !> loses its master where no two faces are turned towards each other, which is reported; where it
  !> may fold this is but noted.
  subroutine check_self_pair(reader, model, surfaces, position, may_fold, pair)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(surface_list_t), intent(inout) :: surfaces
    integer, intent(in) :: position      !! of the name in the deck
    logical, intent(in) :: may_fold      !! the deck asks for finite strain
    type(contact_pair_t), intent(inout) :: pair
    logical :: ok

    call leave_out_bare_nodes(reader, model, surfaces, pair%surface, &
      surfaces%list(pair%surface)%name)
    pair%master_surface = 0
    associate (surface => surfaces%list(pair%surface))
      ok = .not. surfaces%flawed(pair%surface)
      if (ok) call check_faces(reader, model, surface, position, 'the surface '// &
        quoted(surface%name)//' of a pair with itself', ok)
      if (.not. ok) return
      ok = may_touch_itself(nodes_of(surface%faces, model%mesh%connectivity), &
        model%mesh%coordinates)
      if (ok .or. may_fold) pair%master_surface = pair%surface
      if (ok) return
      if (may_fold) then
        call note(reader, 'contact of '//surface%name//' with itself: no two faces are turned '// &
          'towards each other in the mesh')
      else
        call report(reader, position, 'no two faces of '//quoted(surface%name)// &
          ' are turned towards each other: it cannot touch itself')
      end if
    end associate
  end subroutine check_self_pair

  !> How deep the surfaces of a pair of general contact are in each other in the mesh. Report where
  !> there is no way out: `pair` loses its master then. Surfaces that never get to each other are no
  !> mistake. Mean gaps of faces that are apart may be below 0: nothing is to be moved there.
  subroutine check_general_pair(reader, model, surfaces, shapes, position, pair, may_overlap)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(surface_list_t), intent(in) :: surfaces
    type(obstacle_t), intent(in) :: shapes(:)
    integer, intent(in) :: position      !! of the card in the deck
    type(contact_pair_t), intent(inout) :: pair
    logical, intent(out) :: may_overlap  !! nodes are to be looked at, and moved out
    type(facet_pair_t) :: now
    type(mortar_t) :: mortar
    logical :: ok

    ok = .true.
    pair%overlap = 0.0_wp
    may_overlap = .false.
    associate (slave => surfaces%list(pair%surface), mesh => model%mesh)
      if (pair%master_surface > 0) then
        if (is_self(slave, surfaces%list(pair%master_surface))) return
        call find_overlap(model, slave, surfaces%list(pair%master_surface), pair%overlap, &
          mortar%trapped)
        may_overlap = pair%overlap > 0.0_wp
        ok = may_overlap .or. .not. mortar%trapped < huge(1.0_wp)
        if (ok) return
        call report(reader, position, quoted(slave%name)//' is inside '//quoted(surfaces%list( &
          pair%master_surface)%name)//' without a way out: no face there is opposite one of '// &
          'the other body by which they could part (opposite ones are '// &
          to_text(mortar%trapped, 3)//' deep or deeper)', &
          'name what may overlap by *CONTACT EXCLUSIONS')
        pair%master_surface = 0
      else if (is_meshed(shapes(pair%master))) then
        now = join_facets(slave_t(all_nodes_of(slave%faces, mesh%connectivity), slave%nodes), &
          mesh%coordinates(:, :mesh%n_nodes), shapes(pair%master), [0.0_wp, 0.0_wp, 0.0_wp])
        call face_facets(now, reach_of_facets(now), mortar, behind=0.999_wp*thickness(model, &
          [slave%nodes(1)]))
        if (any(mortar%area > 0.0_wp)) pair%overlap = max(0.0_wp, -minval(mortar%least_gap, &
          mask=mortar%area > 0.0_wp))
        may_overlap = pair%overlap > 0.0_wp
      else
        may_overlap = .true.
        call check_side(reader, model, slave, shapes(pair%master), position, ok)
        if (.not. ok) pair%master = 0
      end if
    end associate
  end subroutine check_general_pair

  !> How deep a surface is in another, at most, of the faces where the boxes of both meet.
  subroutine find_overlap(model, slave, master, overlap, trapped)
    type(model_t), intent(in) :: model
    type(surface_t), intent(in) :: slave, master
    real(wp), intent(out) :: overlap !! by faces that have a way out; 0: none [length]
    real(wp), intent(out) :: trapped !! by those that have none, at least; huge: none [length]
    real(wp), parameter :: rounding = 1.0e-12_wp !! of a length [-]
    integer, allocatable :: slaves(:, :), masters(:, :), nodes(:)
    type(mortar_t) :: mortar
    real(wp) :: low(3), high(3)
    integer :: i

    overlap = 0.0_wp
    trapped = huge(1.0_wp)
    associate (x => model%mesh%coordinates(:, :model%mesh%n_nodes))
      do i = 1, 3
        low(i) = max(minval(x(i, slave%nodes)), minval(x(i, master%nodes)))
        high(i) = min(maxval(x(i, slave%nodes)), maxval(x(i, master%nodes)))
      end do
      if (any(high - low <= rounding*maxval(abs([low, high])))) return
      slaves = meeting(slave)
      masters = meeting(master)
      if (size(slaves) == 0 .or. size(masters) == 0) return
      nodes = pack(slaves, slaves > 0)
      call sort_unique(nodes)
      call make_mortar(slave_t(slaves, nodes, skin=model%mesh%skin, piece=model%mesh%piece, &
        asks_way_out=.true.), masters, x, norm2(high - low), mortar)
      overlap = max(0.0_wp, -minval(mortar%least_gap))
      trapped = mortar%trapped
    end associate

  contains

    !> The faces of a surface that meet the box.
    function meeting(surface) result(faces)
      type(surface_t), intent(in) :: surface
      integer, allocatable :: faces(:, :)
      logical, allocatable :: meets(:)
      integer :: f

      faces = all_nodes_of(surface%faces, model%mesh%connectivity)
      allocate (meets(size(faces, 2)))
      do f = 1, size(faces, 2)
        associate (its => model%mesh%coordinates(:, faces(:count(faces(:, f) > 0), f)))
          meets(f) = all(maxval(its, 2) >= low .and. minval(its, 2) <= high)
        end associate
      end do
      faces = faces(:, pack([(f, f=1, size(meets))], meets))
    end function meeting

  end subroutine find_overlap

  !> Report what keeps a surface from being the slave before an obstacle: `pair` loses its master
  !> then.
  subroutine check_obstacle_pair(reader, model, surfaces, obstacle, slave_position, &
    master_position, pair)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(surface_list_t), intent(inout) :: surfaces !! one without nodes that have no face is added
    type(obstacle_t), intent(in) :: obstacle
    integer, intent(in) :: slave_position, master_position !! of the names in the deck
    type(contact_pair_t), intent(inout) :: pair
    logical :: ok

    ok = .not. surfaces%flawed(pair%surface)
    if (.not. is_meshed(obstacle)) then
      if (ok) call check_side(reader, model, surfaces%list(pair%surface), obstacle, &
        master_position, ok)
      if (.not. ok) pair%master = 0
      return
    end if
    call leave_out_bare_nodes(reader, model, surfaces, pair%surface, obstacle%name)
    associate (slave => surfaces%list(pair%surface))
      if (ok) call check_faces(reader, model, slave, slave_position, 'the slave '// &
        quoted(slave%name)//' before facets of an obstacle', ok)
      if (ok) call check_facet_sides(reader, model, slave, obstacle, master_position, pair, ok)
    end associate
    if (.not. ok) pair%master = 0
  end subroutine check_obstacle_pair

  !> Report a slave all of whose faces lie inside an obstacle, turned away from its surface.
  subroutine check_side(reader, model, slave, obstacle, position, ok)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(surface_t), intent(in) :: slave
    type(obstacle_t), intent(in) :: obstacle
    integer, intent(in) :: position         !! of the master in the deck
    logical, intent(inout) :: ok            !! false where it does
    integer, allocatable :: nodes(:, :) !! (4,n_faces)
    real(wp) :: normal(3)
    integer :: f

    if (.not. allocated(slave%faces)) return
    if (size(slave%faces, 2) == 0) return
    allocate (nodes, source=nodes_of(slave%faces, model%mesh%connectivity))
    do f = 1, size(slave%faces, 2)
      associate (corner => model%mesh%coordinates(:, nodes(:corners_in(nodes(:, f)), f)))
        normal = sum(face_area_vectors(corner), 2)
        if (.not. holds_turned_away(obstacle, corner, normal/norm2(normal))) return
      end associate
    end do
    ok = .false.
    call report(reader, position, quoted(slave%name)//' lies inside the obstacle '// &
      quoted(obstacle%name)//', turned away from its surface: the body is on the wrong side', &
      how_to_turn_round(obstacle))
  end subroutine check_side

  !> Nodes of a slave that are on none of its faces take no part in a pair that is placed by faces.
  !> Where some are left the pair gets a surface of these; other cards mean all of the nodes still.
  subroutine leave_out_bare_nodes(reader, model, surfaces, slave, master)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(surface_list_t), intent(inout) :: surfaces
    integer, intent(inout) :: slave      !! index of the surface
    character(*), intent(in) :: master   !! its name
    integer, allocatable :: bare(:)
    integer :: faced

    if (surfaces%flawed(slave)) return
    associate (surface => surfaces%list(slave))
      if (size(surface%faces, 2) == 0) return
      bare = bare_nodes(surface, model%mesh%connectivity, model%mesh%n_nodes)
      if (size(bare) == 0) return
      call note(reader, 'contact pair '//surface%name//':'//master//': '//to_text(size(bare))// &
        ' of '//to_text(size(surface%nodes))//' slave nodes are on none of the faces whose '// &
        'nodes the surface has, and are left out (the first: node '// &
        to_text(model%mesh%node_id(bare(1)))//')')
    end associate
    call add_surface_of_faces(model%mesh, slave, surfaces, faced)
    slave = faced
  end subroutine leave_out_bare_nodes

  !> A slave of nodes without faces before a surface gets the outer faces about these that are
  !> turned towards the master. The other nodes of the faces stay open.
  subroutine take_faces_about(reader, model, surfaces, pair)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(surface_list_t), intent(inout) :: surfaces
    type(contact_pair_t), intent(inout) :: pair
    integer, allocatable :: masters(:, :), faces(:, :), corner(:, :)
    character(:), allocatable :: name
    logical :: is_slave(model%mesh%n_nodes), is_near(model%mesh%n_nodes)
    logical, allocatable :: kept(:)
    integer :: e, f, node, index

    associate (slave => surfaces%list(pair%surface), master => &
               surfaces%list(pair%master_surface), mesh => model%mesh)
      if (size(slave%faces, 2) > 0 .or. size(master%faces, 2) == 0) return
      if (surfaces%flawed(pair%surface) .or. surfaces%flawed(pair%master_surface)) return
      is_slave = .false.
      is_slave(slave%nodes) = .true.
      is_near = .false.
      do e = 1, mesh%n_elements
        associate (its => nodes_of_element(mesh%connectivity, e))
          if (any(is_slave(its))) is_near(its) = .true.
        end associate
      end do
      call find_outer_faces(mesh, pack([(node, node=1, mesh%n_nodes)], is_near), faces)
      corner = all_nodes_of(faces, mesh%connectivity)
      masters = nodes_of(master%faces, mesh%connectivity)
      allocate (kept(size(faces, 2)))
      do f = 1, size(faces, 2)
        associate (its => pack(corner(:, f), corner(:, f) > 0))
          kept(f) = any(is_slave(its)) .and. size(its) == corners_in(corner(:4, f))
          if (kept(f)) kept(f) = face_each_other(corner(:4, f:f), masters, &
            mesh%coordinates(:, :mesh%n_nodes))
        end associate
      end do
      if (.not. any(kept)) return
      faces = faces(:, pack([(f, f=1, size(kept))], kept))
    end associate
    name = surfaces%list(pair%surface)%name
    call add_faces(model%mesh, name, faces, surfaces, index)
    associate (slave => surfaces%list(pair%surface), about => surfaces%list(index)%nodes)
      is_near = .false.
      is_near(about) = .true.
      if (.not. all(is_near(slave%nodes))) return
      pair%left_open = pack(about, .not. is_slave(about))
      call note(reader, 'contact pair '//slave%name//':'// &
        surfaces%list(pair%master_surface)%name//': the slave has nodes and no faces. Each '// &
        'stands for its share of the '//counted(size(faces, 2), 'face')// &
        ' about them that may touch, whose other nodes stay open')
    end associate
    pair%surface = index
  end subroutine take_faces_about

  !> A surface that is placed by its faces consists of faces, and all of its nodes are theirs.
  subroutine check_faces(reader, model, surface, position, what, ok)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(surface_t), intent(in) :: surface
    integer, intent(in) :: position
    character(*), intent(in) :: what  !! for the message
    logical, intent(inout) :: ok      !! false where it does not

    if (size(surface%faces, 2) > 0 .and. size(bare_nodes(surface, model%mesh%connectivity, &
      model%mesh%n_nodes)) == 0) then
      call check_outside(reader, model, surface, position, ok)
      return
    end if
    call report(reader, position, what//' has nodes without faces: it must consist of faces '// &
      '(*SURFACE, TYPE=ELEMENT)')
    ok = .false.
  end subroutine check_faces

  !> Report a surface all of whose faces lie between two elements, where nothing can touch, and note
  !> some that do: their numbers are wrong.
  subroutine check_outside(reader, model, surface, position, ok)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(surface_t), intent(in) :: surface
    integer, intent(in) :: position
    logical, intent(inout) :: ok      !! false where all do
    integer, allocatable :: outer(:, :)
    logical, allocatable :: is_outer(:, :) !! (6,n_elements)
    integer :: f, n

    call find_outer_faces(model%mesh, surface%nodes, outer)
    allocate (is_outer(6, model%mesh%n_elements), source=.false.)
    do f = 1, size(outer, 2)
      is_outer(outer(2, f), outer(1, f)) = .true.
    end do
    associate (faces => surface%faces)
      n = count([(.not. is_outer(faces(2, f), faces(1, f)), f=1, size(faces, 2))])
      if (n == 0) return
      ok = n < size(faces, 2)
    end associate
    if (ok) then
      call note(reader, counted(n, 'face')//' of '//surface%name//' between two elements, '// &
        'where nothing can touch: check their numbers (S1 to S6)')
    else
      call report(reader, position, 'all faces of '//quoted(surface%name)//' lie between two '// &
        'elements, where nothing can touch: check their numbers (S1 to S6)')
    end if
  end subroutine check_outside

  !> The same as `check_sides` where the master consists of facets of an obstacle.
  subroutine check_facet_sides(reader, model, slave, obstacle, position, pair, ok)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(surface_t), intent(in) :: slave
    type(obstacle_t), intent(in) :: obstacle
    integer, intent(in) :: position              !! of the master in the deck
    type(contact_pair_t), intent(inout) :: pair
    logical, intent(out) :: ok
    real(wp), parameter :: at_rest(3) = 0.0_wp
    type(facet_pair_t) :: now
    type(mortar_t) :: mortar
    real(wp) :: far

    now = join_facets(slave_t(all_nodes_of(slave%faces, model%mesh%connectivity), slave%nodes), &
      model%mesh%coordinates(:, :model%mesh%n_nodes), obstacle, at_rest)
    ok = facets_face(now)
    if (.not. ok) then
      call report(reader, position, 'no facet of '//quoted(obstacle%name)// &
        ' is turned towards a face of '//quoted(slave%name)//': these sides cannot touch')
      return
    end if
    far = reach_of_all_facets(now) + reach_of_facets(now)
    ! The body overlaps by less than it is thick.
    call face_facets(now, far, mortar, behind=0.999_wp*thickness(model, [slave%nodes(1)]))
    if (any(mortar%area > 0.0_wp)) then
      pair%overlap = max(0.0_wp, -minval(mortar%least_gap, mask=mortar%area > 0.0_wp))
      return
    end if
    call face_facets(now, far, mortar)
    ok = .not. any(mortar%area > 0.0_wp)
    if (ok) then
      call note(reader, 'contact pair '//slave%name//':'//obstacle%name// &
        ': no facet of the obstacle lies opposite a face of the slave in the undeformed mesh')
    else
      call report(reader, position, quoted(obstacle%name)//' lies behind '// &
        quoted(slave%name)//': facets must be turned towards the slave (*SURFACE: SPOS or '// &
        'SNEG; STL: the order of the corners)')
    end if
  end subroutine check_facet_sides

  !> Report surfaces that can never touch, as none of their faces is turned towards one of the
  !> other, or as one lies behind the other; note those of which nothing lies opposite yet. How deep
  !> one is in the other is kept.
  subroutine check_sides(reader, model, slave, master, position, pair, ok)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(surface_t), intent(in) :: slave, master
    integer, intent(in) :: position              !! of the master in the deck
    type(contact_pair_t), intent(inout) :: pair
    logical, intent(out) :: ok
    integer, allocatable :: slaves(:, :), masters(:, :)
    type(mortar_t) :: mortar
    logical :: has_slave(model%mesh%n_elements)
    real(wp) :: far

    allocate (slaves, source=all_nodes_of(slave%faces, model%mesh%connectivity))
    allocate (masters, source=all_nodes_of(master%faces, model%mesh%connectivity))
    has_slave = .false.
    has_slave(slave%faces(1, :)) = .true.
    associate (x => model%mesh%coordinates(:, :model%mesh%n_nodes), s => slave%nodes, &
               m => master%nodes)
      ok = face_each_other(slaves, masters, x)
      if (.not. ok) then
        call report(reader, position, 'no face of '//quoted(master%name)// &
          ' is turned towards one of '//quoted(slave%name)//': these sides cannot touch')
        return
      end if
      ! A surface before itself may go around an element.
      ok = is_self(slave, master) .or. .not. any(has_slave(master%faces(1, :)))
      if (.not. ok) then
        call report(reader, position, quoted(slave%name)//' and '//quoted(master%name)// &
          ' are two sides of the same elements: they cannot touch')
        return
      end if
      far = reach_of_all(s, m, x) + reach_of_faces(slaves, masters, x)
      call make_mortar(slave_t(slaves, s, skin=model%mesh%skin, piece=model%mesh%piece, &
        asks_way_out=.true.), masters, x, far, mortar)
      if (.not. is_self(slave, master)) pair%overlap = max(0.0_wp, -minval(mortar%least_gap))
      ok = pair%overlap > 0.0_wp .or. is_self(slave, master) .or. .not. mortar%trapped < &
        huge(1.0_wp)
      if (.not. ok) then
        call report(reader, position, quoted(slave%name)//' is inside '//quoted(master%name)// &
          ' without a way out: no face there is opposite one of the other surface by which '// &
          'they could part (opposite ones are '//to_text(mortar%trapped, 3)//' deep or deeper)')
        return
      end if
      if (any(mortar%area > 0.0_wp)) then
        if (.not. allocated(pair%left_open)) call note_coarse_slave(reader, model%mesh, slave, &
          master, mortar)
        return
      end if
      if (look_away(slaves, masters, x)) then
        call make_mortar(slave_t(slaves, s), masters, x, far, mortar)
        ok = .not. any(mortar%area > 0.0_wp)
      end if
    end associate
    if (ok) then
      call note(reader, 'contact pair '//slave%name//':'//master%name// &
        ': no face of the master lies opposite one of the slave in the undeformed mesh')
    else
      call report(reader, position, quoted(master%name)//' lies behind '// &
        quoted(slave%name)//': the surfaces of a contact pair must be turned towards each other')
    end if
  end subroutine check_sides

  !> Whether two surfaces are the sides of one: a body is not in itself in its mesh, and a place
  !> that looks to be in its own other side sees its back.
  pure logical function is_self(slave, master)
    type(surface_t), intent(in) :: slave, master

    is_self = slave%name == master%name
  end function is_self

  !> Note where the slave's faces are larger than those of the master that they lie opposite.
  subroutine note_coarse_slave(reader, mesh, slave, master, mortar)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(in) :: mesh
    type(surface_t), intent(in) :: slave, master
    type(mortar_t), intent(in) :: mortar
    logical :: takes_part(mesh%n_nodes)
    real(wp) :: slave_edge, master_edge

    takes_part = .false.
    takes_part(pack(slave%nodes, mortar%area > 0.0_wp)) = .true.
    takes_part(mortar%weights%node) = .true.
    slave_edge = mean_edge(slave%faces)
    master_edge = mean_edge(master%faces)
    if (slave_edge <= much_coarser*master_edge .or. .not. master_edge > 0.0_wp) return
    call note(reader, 'contact pair '//slave%name//':'//master%name//': the faces of the slave '// &
      'are larger than those of the master (edges of about '//to_text(slave_edge, 2)//' and '// &
      to_text(master_edge, 2)//'); the finer mesh is the better slave: '//master%name//', '// &
      slave%name)

  contains

    !> The edge of a square as large as the mean of the faces that take part with all nodes, of
    !> slices the mean edge in the plane; 0: none does.
    real(wp) function mean_edge(faces)
      integer, intent(in) :: faces(:, :) !! (2,n) element, face
      integer :: node(face_corners), f, n

      mean_edge = 0.0_wp
      n = 0
      do f = 1, size(faces, 2)
        node = nodes_of_face(mesh%connectivity, faces(1, f), faces(2, f))
        if (.not. all(takes_part(node(:corners_in(node))))) cycle
        mean_edge = mean_edge + size_of_face(mesh, faces(1, f), faces(2, f))
        n = n + 1
      end do
      mean_edge = mean_edge/max(n, 1)
      if (mesh%plane == solids) mean_edge = sqrt(mean_edge)
    end function mean_edge

  end subroutine note_coarse_slave

  !> The smallest extent of the bodies that some nodes belong to.
  pure real(wp) function thickness(model, nodes)
    type(model_t), intent(in) :: model
    integer, intent(in) :: nodes(:)
    real(wp) :: low(3), high(3)
    integer :: i, k

    thickness = huge(thickness)
    do k = 1, size(nodes)
      low = huge(low)
      high = -huge(high)
      do i = 1, model%mesh%n_nodes
        if (model%mesh%piece(i) /= model%mesh%piece(nodes(k))) cycle
        low = min(low, model%mesh%coordinates(:, i))
        high = max(high, model%mesh%coordinates(:, i))
      end do
      thickness = min(thickness, minval(high - low))
    end do
  end function thickness

  !> Whether a list has a node that another does not have.
  pure logical function any_of_its_own(nodes, others, n_nodes)
    integer, intent(in) :: nodes(:), others(:), n_nodes
    logical :: is_other(n_nodes)

    is_other = .false.
    is_other(others) = .true.
    any_of_its_own = .not. all(is_other(nodes))
  end function any_of_its_own

end module surface_pairs_mod
