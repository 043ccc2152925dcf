!> Rigid bodies: of facets, whose surfaces make obstacles (rigid_facets.f90), and of solid elements
!> or their nodes, which go with a reference node as those of a kinematic coupling do.
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
  use cards_mod, only: reader_t, report
  use connectivity_mod, only: nodes_of_element
  use diagnostics_mod, only: quoted
  use face_couplings_mod, only: add_rotation_node, coupling_t
  use fields_mod, only: node_option
  use lookup_mod, only: find_id
  use mesh_draft_mod, only: add_node_beside, is_connector, solids
  use options_mod, only: allow_no_data, allow_options, card_t, has_option, name_option, open_card, &
    option_position
  use obstacles_mod, only: obstacle_t
  use read_obstacles_mod, only: analytical_surface
  use sets_mod, only: extend_marks, find_set, model_t, report_unknown
  use text_mod, only: to_text
  implicit none
  private

  public :: rigid_bodies_t, read_rigid_bodies, join_rigid_bodies, find_rigid_nodes

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
  subroutine read_rigid_bodies(reader, model, obstacles, bodies)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(inout) :: model
    !! nodes for reference nodes that are left out are added; nodes of facets, reference nodes and
    !! those of rotations are marked
    type(obstacle_t), intent(in) :: obstacles(:) !! among them those of analytical surfaces
    type(rigid_bodies_t), intent(out) :: bodies
    type(card_t) :: card
    integer :: k, node, first, last, i

    allocate (bodies%list(0))
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'RIGID BODY') cycle
      call open_card(reader, k, card)
      first = size(bodies%list) + 1
      call read_options(reader, card, obstacles, bodies)
      if (first > size(bodies%list)) cycle
      call read_nodes(reader, card, model, bodies%list(first))
      do i = first + 1, size(bodies%list)
        bodies%list(i)%ref_node = bodies%list(first)%ref_node
        bodies%list(i)%ref_position = bodies%list(first)%ref_position
        bodies%list(i)%has_ref = bodies%list(first)%has_ref
      end do
    end do
    if (size(bodies%list) == 0) return
    associate (mesh => model%mesh)
      do k = 1, mesh%n_skipped
        if (is_connector(mesh%skipped_kind(k))) cycle
        last = mesh%n_skipped_nodes
        if (k < mesh%n_skipped) last = mesh%skipped_first(k + 1) - 1
        do i = mesh%skipped_first(k), last
          node = find_id(mesh%nodes, mesh%node_id, mesh%skipped_nodes(i))
          if (node > 0) model%rigid(node) = .true.
        end do
      end do
    end associate
  end subroutine read_rigid_bodies

  !> The sets of a card, an entry each.
  subroutine read_options(reader, card, obstacles, bodies)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(obstacle_t), intent(in) :: obstacles(:)
    type(rigid_bodies_t), intent(inout) :: bodies !! gets no entry after some mistakes
    character(*), parameter :: options(4) = [character(8) :: 'ELSET', 'NSET', 'PIN NSET', &
      'TIE NSET']
    type(rigid_body_t) :: body
    integer :: i
    logical :: ok, any_set

    call allow_options(reader, card)
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
    if (has_option(card, analytical_surface)) then
      call check_analytical()
      return
    end if
    call report(reader, card%position, '*RIGID BODY needs ELSET= (of facets or of solid '// &
      'elements) or NSET=')
    body%set = ''
    bodies%list = [bodies%list, body]

  contains

    !> ANALYTICAL SURFACE=name: its obstacle has taken the reference node.
    subroutine check_analytical()
      character(:), allocatable :: name

      call name_option(reader, card, analytical_surface, .true., name, ok)
      if (ok) ok = any([(obstacles(i)%name == name, i=1, size(obstacles))])
      if (ok) return
      reader%lacks_elements = .true. ! nothing is known of its reference node
      call report(reader, option_position(card, analytical_surface), 'analytical surface '// &
        quoted(name)//' is not defined')
    end subroutine check_analytical

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
        'elements of a plane: a rigid body there consists of such elements or is a profile', &
        '*SURFACE, TYPE=SEGMENTS has the lines of the profile, and ANALYTICAL SURFACE= of '// &
        '*RIGID BODY moves it')
    else if (.not. body%has_ref) then
      call report(reader, body%card_position, '*RIGID BODY needs REF NODE= if it consists '// &
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

end module read_rigid_bodies_mod
