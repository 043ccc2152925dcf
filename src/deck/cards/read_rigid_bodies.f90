!> Rigid bodies: of facets, whose surfaces make obstacles, and of solid elements or their nodes,
!> which go with a reference node as those of a kinematic coupling do.
!>
!>     *ELEMENT, TYPE=R3D4, ELSET=TOOL
!>     1, 11, 12, 14, 13
!>     *RIGID BODY, ELSET=TOOL, REF NODE=900
!>     *SURFACE, NAME=DIE
!>     TOOL, SPOS                    the side to which the normal points (SNEG: the other)
!>     *RIGID BODY, NSET=GRIP, REF NODE=901, ROT NODE=902
!>
!> The cards are read before the sets, for they say which nodes of the deck mean something; what
!> they name is looked up when there are sets and surfaces.
module read_rigid_bodies_mod
  use cards_mod, only: keep_reading, note, reader_t, report, report_missing_element
  use diagnostics_mod, only: quoted
  use connectivity_mod, only: nodes_of_element
  use face_couplings_mod, only: add_rotation_node, coupling_t
  use facet_shape_mod, only: facet_is_flat
  use fields_mod, only: node_option
  use lookup_mod, only: find_id
  use mesh_draft_mod, only: add_node_beside, mesh_draft_t, no_facet, not_a_coordinate, &
    refused_element, rigid_facet, shell_facet, solids
  use obstacles_mod, only: obstacle_of_facets, obstacle_t
  use options_mod, only: allow_no_data, allow_options, card_t, has_option, name_option, open_card, &
    option_position
  use sets_mod, only: extend_marks, find_set, model_t, report_unknown
  use surface_list_mod, only: has_facets, surface_list_t
  use text_mod, only: to_text
  implicit none
  private

  public :: rigid_bodies_t, read_rigid_bodies, join_rigid_bodies, find_rigid_nodes
  public :: find_facets, make_obstacles

  integer, parameter :: max_wrong = 5 !! facets with a mistake that are told one by one

  !> What a *RIGID BODY says of a set; it may name several.
  type :: rigid_body_t
    character(:), allocatable :: set      !! empty: a mistake was reported
    logical :: of_nodes = .false.         !! NSET= or its kin, else ELSET=
    logical :: is_solid = .false.         !! of solid elements or their nodes, else of facets
    integer :: ref_node = 0               !! 0: a mistake was reported
    logical :: has_ref = .false.          !! the deck names it
    integer :: coupling = 0               !! of one that is solid: its number, 0 after a mistake
    integer :: position = 0               !! of the set in the deck
    integer :: card_position = 0, ref_position = 0
    logical :: is_seen = .false.          !! a surface has facets of it
  end type rigid_body_t

  !> All of them, and their facets.
  type :: rigid_bodies_t
    type(rigid_body_t), allocatable :: list(:)
    integer, allocatable :: of_facet(:)   !! (n_skipped) rigid body of the element; 0: none
    integer, allocatable :: node(:, :)    !! (4,n_skipped) of those that have one
  end type rigid_bodies_t

contains

  !> *RIGID BODY, ELSET=name, REF NODE=id[, ROT NODE=id]
  !> *RIGID BODY, NSET=name[, REF NODE=id][, ROT NODE=id]
  subroutine read_rigid_bodies(reader, model, bodies)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(inout) :: model
    !! nodes for reference nodes that are left out are added; nodes of facets, reference nodes and
    !! those of rotations are marked
    type(rigid_bodies_t), intent(out) :: bodies
    type(card_t) :: card
    integer :: k, node, first, i

    allocate (bodies%list(0))
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'RIGID BODY') cycle
      call open_card(reader, k, card)
      first = size(bodies%list) + 1
      call read_options(reader, card, bodies)
      if (first > size(bodies%list)) cycle
      call read_nodes(reader, card, model, bodies%list(first))
      do i = first + 1, size(bodies%list)
        bodies%list(i)%ref_node = bodies%list(first)%ref_node
        bodies%list(i)%ref_position = bodies%list(first)%ref_position
        bodies%list(i)%has_ref = bodies%list(first)%has_ref
      end do
    end do
    if (size(bodies%list) == 0) return
    do k = 1, model%mesh%n_skipped_nodes
      node = find_id(model%mesh%nodes, model%mesh%node_id, model%mesh%skipped_nodes(k))
      if (node > 0) model%rigid(node) = .true.
    end do
  end subroutine read_rigid_bodies

  !> The sets of a card, an entry each.
  subroutine read_options(reader, card, bodies)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(rigid_bodies_t), intent(inout) :: bodies !! gets no entry after some mistakes
    character(*), parameter :: options(4) = [character(8) :: 'ELSET', 'NSET', 'PIN NSET', &
      'TIE NSET']
    character(*), parameter :: analytical = 'ANALYTICAL SURFACE'
    type(rigid_body_t) :: body
    integer :: i
    logical :: ok, any_set

    call allow_options(reader, card, [character(len(analytical)) :: options, 'REF NODE', &
      'ROT NODE', analytical], ['ISOTHERMAL'])
    if (has_option(card, analytical)) call report(reader, option_position(card, analytical), &
      "unknown parameter 'ANALYTICALSURFACE' of *RIGID BODY", '*OBSTACLE, NAME=, TYPE=PLANE, '// &
      'SPHERE or CYLINDER, REF NODE= is a rigid surface that moves with a node')
    call allow_no_data(reader, card)
    any_set = .false.
    do i = 1, size(options)
      if (.not. has_option(card, options(i))) cycle
      any_set = .true.
      body%of_nodes = i > 1
      body%card_position = card%position
      body%position = option_position(card, options(i))
      call name_option(reader, card, trim(options(i)), .true., body%set, ok)
      if (.not. ok) body%set = ''
      bodies%list = [bodies%list, body]
    end do
    if (any_set) return
    if (has_option(card, analytical)) then
      reader%lacks_elements = .true. ! nothing is known of its reference node
      return
    end if
    call report(reader, card%position, '*RIGID BODY needs ELSET= (of facets or of solid '// &
      'elements) or NSET=')
    body%set = ''
    bodies%list = [bodies%list, body]
  end subroutine read_options

  !> REF NODE= and ROT NODE=.
  subroutine read_nodes(reader, card, model, body)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(model_t), intent(inout) :: model
    type(rigid_body_t), intent(inout) :: body
    integer :: rotation
    logical :: ok

    body%ref_position = option_position(card, 'REF NODE')
    body%has_ref = has_option(card, 'REF NODE')
    if (body%has_ref) then
      call find_node(reader, card, model, 'REF NODE', body%ref_node)
    else if (model%mesh%n_nodes > 0) then
      call add_node_beside(model%mesh, 1, card%position, ok)
      if (ok) then
        body%ref_node = model%mesh%n_nodes
        model%n_added = model%n_added + 1
        call extend_marks(model, 1, .false.)
      else
        call report(reader, card%position, 'there is no room for a reference node')
      end if
    end if
    if (body%ref_node > 0) model%joined(body%ref_node) = .not. model%used(body%ref_node)
    if (.not. has_option(card, 'ROT NODE')) return
    call find_node(reader, card, model, 'ROT NODE', rotation)
    if (rotation == 0 .or. body%ref_node == 0) return
    associate (position => option_position(card, 'ROT NODE'), &
               words => 'node '//to_text(model%mesh%node_id(rotation)))
      if (model%used(rotation)) then
        call report(reader, position, words//' belongs to an element: the ROT NODE of a rigid '// &
          'body must be a node by itself')
      else if (rotation == body%ref_node) then
        call report(reader, position, words//' is the REF NODE, too: leave ROT NODE out, or '// &
          'name another', 'dofs 4 to 6 of the REF NODE are its rotations')
      else if (model%turned(rotation) > 0 .and. model%turned(rotation) /= body%ref_node) then
        call report(reader, position, words//' is the ROT NODE of another rigid body, whose '// &
          'REF NODE is another', 'a ROT NODE for each, joined dof by dof by *EQUATION, turns '// &
          'both alike')
      else if (model%rotation_node(rotation) > 0 .or. model%reference(rotation)) then
        call report(reader, position, words//' is the reference node of a coupling or an '// &
          'obstacle: the ROT NODE of a rigid body must be a node by itself')
      else
        model%turned(rotation) = body%ref_node
      end if
    end associate
  end subroutine read_nodes

  !> A node that an option names.
  subroutine find_node(reader, card, model, option, node)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(model_t), intent(in) :: model
    character(*), intent(in) :: option
    integer, intent(out) :: node !! 0: a mistake was reported
    integer :: id
    logical :: ok

    node = 0
    call node_option(reader, card, option, id, ok)
    if (.not. ok) return
    node = find_id(model%mesh%nodes, model%mesh%node_id, id)
    if (node == 0) call report(reader, option_position(card, option), 'node '//to_text(id)// &
      ' is not defined')
  end subroutine find_node

  !> Join rigid bodies of solid elements to their reference nodes, and mark the reference nodes of
  !> those of facets: sets have been read, and mean elements and nodes of the deck.
  subroutine join_rigid_bodies(reader, model, bodies, couplings)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(inout) :: model    !! nodes that stand for rotations are added
    type(rigid_bodies_t), intent(inout) :: bodies
    type(coupling_t), allocatable, intent(inout) :: couplings(:)
    type(coupling_t) :: coupling
    integer, allocatable :: nodes(:)
    integer :: b, set

    allocate (nodes(0))
    do b = 1, size(bodies%list)
      associate (body => bodies%list(b))
        if (len(body%set) == 0) cycle
        if (body%of_nodes) then
          set = find_set(model%node_sets, body%set)
          if (set == 0) call report_unknown(reader, model%node_sets, body%position, body%set)
          body%is_solid = .true.
        else
          set = find_set(model%element_sets, body%set)
          if (set > 0) body%is_solid = model%element_sets%list(set)%n > 0 .and. &
            model%element_sets%list(set)%n_skipped == 0
        end if
        if (.not. body%is_solid) then
          call mark_tool(reader, model, body)
        else if (body%ref_node > 0 .and. set > 0) then
          coupling%node = body%ref_node
          coupling%node_position = body%ref_position
          coupling%position = body%card_position
          call add_rotation_node(reader, model, coupling)
          couplings = [couplings, coupling]
          body%coupling = size(couplings)
          nodes = solid_nodes(model, body, set)
          if (.not. body%has_ref .and. size(nodes) > 0) model%mesh%coordinates(:, body%ref_node) &
            = sum(model%mesh%coordinates(:, nodes), dim=2)/size(nodes)
        end if
      end associate
    end do
  end subroutine join_rigid_bodies

  !> The reference node of a rigid body of facets: it moves an obstacle.
  subroutine mark_tool(reader, model, body)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(inout) :: model
    type(rigid_body_t), intent(in) :: body

    if (model%mesh%plane /= solids) then
      call report(reader, body%card_position, '*RIGID BODY of facets is not available with '// &
        'elements of a plane: an obstacle is a plane or a cylinder (*OBSTACLE), or a rigid '// &
        'body of elements of a plane')
    else if (.not. body%has_ref) then
      call report(reader, body%card_position, '*RIGID BODY needs REF NODE= where it consists '// &
        'of facets')
    else if (body%ref_node > 0) then
      if (model%used(body%ref_node)) then
        call report(reader, body%ref_position, 'node '//to_text(model%mesh%node_id( &
          body%ref_node))//' belongs to an element: the reference node of a rigid body of '// &
          'facets must be a node by itself')
      else
        model%joined(body%ref_node) = .false.
        model%reference(body%ref_node) = .true.
      end if
    end if
  end subroutine mark_tool

  !> The nodes of solid elements that a set means, but for the reference node.
  pure function solid_nodes(model, body, set) result(nodes)
    type(model_t), intent(in) :: model
    type(rigid_body_t), intent(in) :: body
    integer, intent(in) :: set !! of nodes or of elements, in the model
    integer, allocatable :: nodes(:)
    logical :: has(model%mesh%n_nodes)
    integer :: i

    has = .false.
    if (body%of_nodes) then
      associate (of_set => model%node_sets%list(set))
        if (allocated(of_set%members)) has(of_set%members) = .true.
      end associate
    else
      associate (of_set => model%element_sets%list(set))
        do i = 1, of_set%n
          has(nodes_of_element(model%mesh%connectivity, of_set%members(i))) = .true.
        end do
      end associate
    end if
    has = has .and. model%used
    has(body%ref_node) = .false.
    nodes = pack([(i, i=1, size(has))], has)
  end function solid_nodes

  !> Find the nodes of each rigid body of solid elements, once the mesh has been cut.
  subroutine find_rigid_nodes(reader, model, bodies, couplings)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(rigid_bodies_t), intent(in) :: bodies
    type(coupling_t), intent(inout) :: couplings(:)
    integer :: owner(model%mesh%n_nodes) !! the reference node that each goes with
    integer, allocatable :: nodes(:)
    integer :: b, set, i

    owner = 0
    allocate (nodes(0))
    do b = 1, size(bodies%list)
      associate (body => bodies%list(b))
        if (body%coupling == 0) cycle
        if (model%reference(body%ref_node) .or. (model%rigid(body%ref_node) .and. .not. &
          model%used(body%ref_node))) then
          call report(reader, body%ref_position, 'node '//to_text(model%mesh%node_id( &
            body%ref_node))//' belongs to an obstacle or to facets: it cannot be the reference '// &
            'node of solid elements, too')
          cycle
        end if
        if (body%of_nodes) then
          set = find_set(model%node_sets, body%set)
        else
          set = find_set(model%element_sets, body%set)
        end if
        nodes = solid_nodes(model, body, set)
        if (size(nodes) == 0 .and. .not. model%used(body%ref_node)) then
          call report(reader, body%position, 'set '//quoted(body%set)//' has no nodes of solid '// &
            'elements that could be rigid')
          cycle
        end if
        i = findloc(owner(nodes) > 0 .and. owner(nodes) /= body%ref_node, .true., dim=1)
        if (i > 0) then
          call report(reader, body%position, 'node '//to_text(model%mesh%node_id(nodes(i)))// &
            ' belongs to two rigid bodies, of reference nodes '//to_text(model%mesh%node_id( &
            owner(nodes(i))))//' and '//to_text(model%mesh%node_id(body%ref_node)))
          cycle
        end if
        if (body%of_nodes .and. allocated(model%twins)) then
          i = findloc([(any(model%twins == nodes(i)), i=1, size(nodes))], .true., dim=1)
          if (i > 0) then
            call report(reader, body%position, 'node '//to_text(model%mesh%node_id(nodes(i)))// &
              ' of set '//quoted(body%set)//' is on a *PRE-TENSION SECTION', &
              'name the elements on one side of it: *RIGID BODY, ELSET=')
            cycle
          end if
        end if
        couplings(body%coupling)%nodes = pack(nodes, owner(nodes) == 0)
        owner(nodes) = body%ref_node
      end associate
    end do
  end subroutine find_rigid_nodes

  !> Find the facets of each rigid body, when sets are read.
  subroutine find_facets(reader, model, bodies)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(rigid_bodies_t), intent(inout) :: bodies
    integer :: b, set, n_wrong

    allocate (bodies%of_facet(model%mesh%n_skipped), source=0)
    allocate (bodies%node(4, model%mesh%n_skipped), source=0)
    n_wrong = 0
    do b = 1, size(bodies%list)
      associate (body => bodies%list(b))
        if (len(body%set) == 0 .or. body%is_solid) cycle
        set = find_set(model%element_sets, body%set)
        if (set == 0) then
          call report_unknown(reader, model%element_sets, body%position, body%set)
          cycle
        end if
        associate (of_set => model%element_sets%list(set))
          if (of_set%n > 0) then
            call report(reader, body%position, 'element set '//quoted(body%set)// &
              ' has solid elements (element '//to_text(model%mesh%element_id(of_set%members(1)))// &
              ') and others: a rigid body consists of solid elements or of facets (R3D3, R3D4, '// &
              'S3, S4)')
            if (of_set%n_skipped > 0) bodies%of_facet(of_set%skipped(:of_set%n_skipped)) = b
          else if (of_set%n_skipped == 0) then
            if (.not. of_set%flawed) call report(reader, body%position, 'element set '// &
              quoted(body%set)//' has no elements')
          else
            call take_facets(reader, model, of_set%skipped(:of_set%n_skipped), b, bodies, n_wrong)
          end if
        end associate
      end associate
    end do
    call report_left(reader, model%mesh, bodies)
  end subroutine find_facets

  !> Give a rigid body its facets.
  subroutine take_facets(reader, model, facets, b, bodies, n_wrong)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    integer, intent(in) :: facets(:)      !! indices into the skipped elements
    integer, intent(in) :: b
    type(rigid_bodies_t), intent(inout) :: bodies
    integer, intent(inout) :: n_wrong     !! facets with a mistake so far
    character(:), allocatable :: problem
    integer :: i

    problem = ''
    do i = 1, size(facets)
      associate (f => facets(i), draft => model%mesh)
        if (bodies%of_facet(f) == b) cycle ! named twice
        if (bodies%of_facet(f) > 0) then
          problem = 'belongs to the rigid bodies of '// &
            quoted(bodies%list(bodies%of_facet(f))%set)//' and '//quoted(bodies%list(b)%set)
        else
          call check_facet(model, f, bodies%node(:, f), problem)
        end if
        bodies%of_facet(f) = b
        if (problem == '') cycle
        n_wrong = n_wrong + 1
        if (n_wrong > max_wrong .or. .not. keep_reading(reader)) return
        call report(reader, draft%skipped_position(f), 'element '//to_text(draft%skipped_id(f))// &
          ' '//problem)
      end associate
    end do
  end subroutine take_facets

  !> The nodes of a facet; `problem` is empty unless they make none.
  subroutine check_facet(model, f, node, problem)
    type(model_t), intent(in) :: model
    integer, intent(in) :: f              !! index into the skipped elements
    integer, intent(out) :: node(4)
    character(:), allocatable, intent(out) :: problem
    integer :: last, n, i, k

    node = 0
    problem = ''
    associate (draft => model%mesh)
      if (draft%skipped_kind(f) == refused_element) return
      n = draft%skipped_corners(f)
      if (draft%skipped_kind(f) == no_facet) then
        problem = 'is no facet of a rigid body: R3D3, R3D4, S3 and S4 are'
        return
      end if
      last = draft%n_skipped_nodes
      if (f < draft%n_skipped) last = draft%skipped_first(f + 1) - 1
      if (last - draft%skipped_first(f) + 1 /= n) then
        problem = 'has '//to_text(n)//' nodes, found '// &
          to_text(last - draft%skipped_first(f) + 1)
        return
      end if
      do i = 1, n
        associate (id => draft%skipped_nodes(draft%skipped_first(f) + i - 1))
          k = find_id(draft%nodes, draft%node_id, id)
          if (k == 0) then
            problem = 'names node '//to_text(id)//', which is not defined'
          else if (any(node(:i - 1) == k)) then
            problem = 'names node '//to_text(id)//' twice'
          else if (model%used(k)) then
            problem = 'is a facet of a rigid body, and its node '//to_text(id)// &
              ' belongs to a solid element: a rigid body shares no nodes with others'
          end if
          if (problem /= '') return
          node(i) = k
        end associate
      end do
      if (any(draft%coordinates(:, node(:n)) >= not_a_coordinate)) return
      if (facet_is_flat(draft%coordinates(:, node(:n)))) problem = 'is flat or folded: its '// &
        'normal does not point to one side, or it has no area'
    end associate
  end subroutine check_facet

  !> Report rigid elements that no rigid body takes; shells are skipped then.
  subroutine report_left(reader, draft, bodies)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(in) :: draft
    type(rigid_bodies_t), intent(in) :: bodies
    integer :: f, n_rigid, n_shells, first

    n_rigid = 0
    n_shells = 0
    first = 0
    do f = 1, draft%n_skipped
      if (bodies%of_facet(f) > 0) cycle
      if (draft%skipped_kind(f) == shell_facet) n_shells = n_shells + 1
      if (draft%skipped_kind(f) /= rigid_facet) cycle
      n_rigid = n_rigid + 1
      if (first == 0) first = f
    end do
    if (n_shells > 0 .and. size(bodies%list) > 0) call note(reader, to_text(n_shells)// &
      ' elements of shells that no *RIGID BODY takes are skipped: only solids are supported')
    if (n_rigid == 0 .or. any(bodies%list%ref_node == 0)) return
    call report(reader, draft%skipped_position(first), to_text(n_rigid)//' rigid elements '// &
      '(R3D3, R3D4) belong to no *RIGID BODY, ELSET=, REF NODE= (the first: element '// &
      to_text(draft%skipped_id(first))//')')
  end subroutine report_left

  !> Make an obstacle of each surface of facets, behind those that are there.
  subroutine make_obstacles(reader, model, bodies, surfaces, obstacles)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(rigid_bodies_t), intent(inout) :: bodies
    type(surface_list_t), intent(inout) :: surfaces !! get their obstacles
    type(obstacle_t), allocatable, intent(inout) :: obstacles(:)
    type(obstacle_t), allocatable :: all(:)
    integer :: k, n, i, b
    logical :: ok

    n = 0
    do k = 1, surfaces%n
      if (has_facets(surfaces, k)) n = n + 1
    end do
    allocate (all(size(obstacles) + n))
    n = size(obstacles)
    do i = 1, n
      all(i) = obstacles(i)
    end do
    do k = 1, surfaces%n
      if (.not. has_facets(surfaces, k)) cycle
      call find_body(reader, model, bodies, surfaces, k, b, ok)
      n = n + 1
      if (.not. ok) then
        all(n)%name = surfaces%list(k)%name
        cycle
      end if
      bodies%list(b)%is_seen = .true.
      surfaces%obstacle(k) = n
      all(n) = obstacle_of_sides(model%mesh, bodies, surfaces, k, bodies%list(b)%ref_node)
      i = size(surfaces%sides(k)%facet, 2) - size(all(n)%facet, 2)
      if (i > 0) call note(reader, to_text(i)//' facets of surface '// &
        quoted(surfaces%list(k)%name)//' repeat others and count once')
    end do
    call move_alloc(all, obstacles)
    do b = 1, size(bodies%list)
      if (bodies%list(b)%is_seen .or. len(bodies%list(b)%set) == 0 .or. &
        bodies%list(b)%is_solid) cycle
      if (.not. any(bodies%of_facet == b)) cycle ! was reported
      if (any(surfaces%flawed(:surfaces%n))) cycle
      call report(reader, bodies%list(b)%position, 'no *SURFACE has facets of rigid body '// &
        quoted(bodies%list(b)%set)//': it can touch nothing', &
        'a surface of a rigid body: *SURFACE, NAME=name with the line '//bodies%list(b)%set// &
        ', SPOS')
    end do
  end subroutine make_obstacles

  !> The rigid body whose facets a surface has.
  subroutine find_body(reader, model, bodies, surfaces, k, b, ok)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(rigid_bodies_t), intent(in) :: bodies
    type(surface_list_t), intent(inout) :: surfaces !! becomes flawed where there is not one
    integer, intent(in) :: k          !! the surface
    integer, intent(out) :: b
    logical, intent(out) :: ok        !! false: a mistake was reported
    integer :: i

    b = 0
    associate (facets => surfaces%sides(k)%facet(1, :), draft => model%mesh)
      ok = size(facets) > 0
      do i = 1, size(facets)
        if (i == 1) b = bodies%of_facet(facets(i))
        ok = bodies%of_facet(facets(i)) == b .and. b > 0
        if (ok) cycle
        if (bodies%of_facet(facets(i)) == 0) then
          ! Rigid elements without a rigid body were reported, and facets of cards with mistakes.
          if (draft%skipped_kind(facets(i)) /= rigid_facet .and. .not. &
              any(bodies%list%ref_node == 0)) call report_missing_element(reader, &
            draft%skipped_position(facets(i)), 'element '// &
            to_text(draft%skipped_id(facets(i)))//' of surface '// &
            quoted(surfaces%list(k)%name)//' belongs to no *RIGID BODY')
        else
          call report(reader, bodies%list(bodies%of_facet(facets(i)))%position, 'surface '// &
            quoted(surfaces%list(k)%name)//' has facets of two rigid bodies: element '// &
            to_text(draft%skipped_id(facets(i)))//' is of another than element '// &
            to_text(draft%skipped_id(facets(1))))
        end if
        exit
      end do
    end associate
    if (.not. ok) surfaces%flawed(k) = .true.
  end subroutine find_body

  !> The facets of a surface, turned to its side, with corners of their own.
  type(obstacle_t) function obstacle_of_sides(draft, bodies, surfaces, k, ref_node) result(obstacle)
    type(mesh_draft_t), intent(in) :: draft
    type(rigid_bodies_t), intent(in) :: bodies
    type(surface_list_t), intent(in) :: surfaces
    integer, intent(in) :: k          !! the surface
    integer, intent(in) :: ref_node
    integer, allocatable :: corner_of(:), nodes(:), facet(:, :)
    integer :: i, a, n, corners, node(4)

    associate (sides => surfaces%sides(k)%facet)
      allocate (corner_of(draft%n_nodes), source=0)
      allocate (nodes(4*size(sides, 2)))
      allocate (facet(4, size(sides, 2)), source=0)
      n = 0
      do i = 1, size(sides, 2)
        node = bodies%node(:, sides(1, i))
        corners = count(node > 0)
        if (sides(2, i) == 2) node(:corners) = node(corners:1:-1)
        do a = 1, corners
          if (corner_of(node(a)) == 0) then
            n = n + 1
            nodes(n) = node(a)
            corner_of(node(a)) = n
          end if
          facet(a, i) = corner_of(node(a))
        end do
      end do
    end associate
    obstacle = obstacle_of_facets(surfaces%list(k)%name, draft%coordinates(:, nodes(:n)), facet, &
      ref_node)
  end function obstacle_of_sides

end module read_rigid_bodies_mod
