!> Faces that are coupled to a reference node.
!>
!>     *COUPLING, CONSTRAINT NAME=GRIP, REF NODE=900, SURFACE=BODY-ZMAX
!>     *KINEMATIC
!>     1, 3                           first dof, last dof; no line: all
!>     *COUPLING, CONSTRAINT NAME=HANG, REF NODE=901, SURFACE=BODY-ZMIN
!>     *DISTRIBUTING
!>     1, 6
module read_couplings_mod
  use cards_mod, only: note, reader_t, report
  use face_couplings_mod, only: add_rotation_node, coupling_t
  use diagnostics_mod, only: any_mistakes, quoted
  use fields_mod, only: any_number, field_position, fields_t, integer_field, is_empty_field, &
    limit_fields, name_field, next_data_line, node_option, reference_field, reference_t
  use lookup_mod, only: find_id
  use options_mod, only: allow_no_data, allow_options, card_t, has_option, name_option, &
    open_card, option_position
  use sets_mod, only: model_t
  use surface_list_mod, only: find_faces_of_nodes, find_surface_or_set, surface_list_t
  use text_mod, only: to_text
  implicit none
  private

  public :: read_couplings, find_coupled_surfaces

  character(*), parameter :: instead_of_mpc = 'BEAM, a set of nodes, a reference node; TIE, '// &
    'PIN or LINK, two nodes or sets; *EQUATION joins dofs, *TIE surfaces'

contains

  !> Read all *COUPLING cards with the *KINEMATIC or *DISTRIBUTING below each, as far as they build
  !> on nodes alone: these get nodes for their rotations.
  subroutine read_couplings(reader, model, couplings)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(inout) :: model
    type(coupling_t), allocatable, intent(out) :: couplings(:)
    type(card_t) :: card
    type(coupling_t) :: coupling
    integer :: k
    logical :: below, ok

    allocate (couplings(0))
    below = .false.
    do k = 1, reader%n_cards
      select case (reader%cards(k)%keyword)
      case ('COUPLING')
        if (below) call report(reader, card%position, '*COUPLING needs a *KINEMATIC or a '// &
          '*DISTRIBUTING below it')
        call open_card(reader, k, card)
        call read_coupling(reader, card, model, coupling, ok)
        below = .true.
      case ('KINEMATIC', 'DISTRIBUTING')
        call open_card(reader, k, card)
        if (.not. below) then
          call report(reader, card%position, '*'//card%keyword//' must stand below a *COUPLING')
          cycle
        end if
        below = .false.
        coupling%distributes = card%keyword == 'DISTRIBUTING'
        call read_dofs(reader, card, coupling, ok)
        if (coupling%node == 0) cycle
        couplings = [couplings, coupling]
        call add_rotation_node(reader, model, couplings(size(couplings)))
      case ('KINEMATIC COUPLING', 'DISTRIBUTING COUPLING', 'MPC')
        call open_card(reader, k, card)
        call read_lines(reader, card, model, couplings)
      case default
        if (below) call report(reader, card%position, '*COUPLING needs a *KINEMATIC or a '// &
          '*DISTRIBUTING below it')
        below = .false.
      end select
    end do
    if (below) call report(reader, card%position, '*COUPLING needs a *KINEMATIC or a '// &
      '*DISTRIBUTING below it')
  end subroutine read_couplings

  !> *COUPLING, CONSTRAINT NAME=, REF NODE=, SURFACE=
  subroutine read_coupling(reader, card, model, coupling, ok)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(model_t), intent(in) :: model
    type(coupling_t), intent(out) :: coupling !! its node is 0 after a mistake
    logical, intent(out) :: ok
    integer :: id

    call allow_options(reader, card)
    call allow_no_data(reader, card)
    coupling%position = card%position
    call name_option(reader, card, 'CONSTRAINT NAME', .false., coupling%name, ok)
    call name_option(reader, card, 'SURFACE', .true., coupling%surface_name, ok)
    coupling%surface_position = option_position(card, 'SURFACE')
    coupling%node_position = option_position(card, 'REF NODE')
    id = 0
    call node_option(reader, card, 'REF NODE', id, ok)
    if (.not. has_option(card, 'REF NODE')) call report(reader, card%position, &
      '*COUPLING needs REF NODE=')
    if (.not. ok) return
    coupling%node = find_id(model%mesh%nodes, model%mesh%node_id, id)
    if (coupling%node == 0) call report(reader, coupling%node_position, 'node '//to_text(id)// &
      ' is not defined')
    if (len(coupling%name) == 0) coupling%name = 'coupling of '//coupling%surface_name
  end subroutine read_coupling

  !> *KINEMATIC COUPLING, *DISTRIBUTING COUPLING and *MPC with BEAM: each line couples a set of
  !> nodes or a surface.
  subroutine read_lines(reader, card, model, couplings)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(model_t), intent(inout) :: model
    type(coupling_t), allocatable, intent(inout) :: couplings(:)
    type(coupling_t) :: coupling
    type(fields_t) :: fields
    character(:), allocatable :: kind
    integer :: id, set, first, last, n_fields
    logical :: found, ok

    call allow_options(reader, card, 'USER')
    if (has_option(card, 'USER')) then
      call report(reader, option_position(card, 'USER'), '*'//card%keyword//', USER is not '// &
        'available', instead_of_mpc)
      return
    end if
    id = 0
    coupling%position = card%position
    coupling%node_position = card%position
    select case (card%keyword)
    case ('KINEMATIC COUPLING')
      coupling%node_position = option_position(card, 'REF NODE')
      call node_option(reader, card, 'REF NODE', id, ok)
      if (.not. has_option(card, 'REF NODE')) call report(reader, card%position, &
        '*KINEMATIC COUPLING needs REF NODE=')
      if (.not. ok) return
    case ('DISTRIBUTING COUPLING')
      coupling%distributes = .true.
      call find_element_node(reader, card, id)
      if (id == 0) return
      call note(reader, '*DISTRIBUTING COUPLING weighs nodes by the areas of their faces: its '// &
        'weights are ignored')
    case default ! each line of an *MPC names its reference node
    end select
    set = 1
    if (card%keyword == 'MPC') set = 2
    do
      n_fields = merge(2, 3, coupling%distributes)
      if (card%keyword == 'MPC') n_fields = any_number ! it depends on the kind
      call next_data_line(reader, card, fields, found, n_fields, 'a set of nodes and what it '// &
        'couples')
      if (.not. found) exit
      if (card%keyword == 'MPC') then
        call name_field(reader, fields, 1, 'the kind of a constraint', kind, ok)
        if (.not. ok) cycle
        if (kind == 'TIE' .or. kind == 'PIN' .or. kind == 'LINK') cycle ! equations
        if (kind /= 'BEAM') then
          call report(reader, fields%start, '*MPC: '//quoted(kind)//' is not available', &
            instead_of_mpc)
          cycle
        end if
        call limit_fields(reader, fields, 3, 'BEAM, a set of nodes, a reference node')
        call integer_field(reader, fields, 3, 'the reference node', 1, id, ok)
        if (.not. ok) cycle
        coupling%node_position = field_position(reader, fields, 3)
      end if
      call name_field(reader, fields, set, 'a set of nodes or a surface', coupling%surface_name, ok)
      if (.not. ok) cycle
      coupling%surface_position = field_position(reader, fields, set)
      coupling%name = 'coupling of '//coupling%surface_name
      coupling%dofs = .true.
      if (card%keyword == 'KINEMATIC COUPLING' .and. .not. is_empty_field(fields, 2)) then
        call integer_field(reader, fields, 2, 'the first dof', 1, first, ok)
        last = first
        if (ok .and. .not. is_empty_field(fields, 3)) call integer_field(reader, fields, 3, &
          'the last dof', 1, last, ok)
        if (.not. ok) cycle
        if (last > 6 .or. first > min(last, 3)) then
          call report(reader, field_position(reader, fields, 2), 'expected a first dof from 1 '// &
            'to 3 and a last one up to 6, found '//to_text(first)//' and '//to_text(last))
          cycle
        end if
        coupling%dofs = .false.
        coupling%dofs(first:last) = .true.
      end if
      coupling%node = find_id(model%mesh%nodes, model%mesh%node_id, id)
      if (coupling%node == 0) then
        call report(reader, coupling%node_position, 'node '//to_text(id)//' is not defined')
        cycle
      end if
      couplings = [couplings, coupling]
      call add_rotation_node(reader, model, couplings(size(couplings)))
    end do
  end subroutine read_lines

  !> The node of the only element of type DCOUP3D in the set of a *DISTRIBUTING COUPLING.
  subroutine find_element_node(reader, card, id)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    integer, intent(out) :: id !! 0: an error was reported
    type(card_t) :: other
    type(fields_t) :: fields
    character(:), allocatable :: set, name, kind
    integer :: k
    integer :: element
    logical :: ok, found, has_one

    id = 0
    has_one = .false.
    call name_option(reader, card, 'ELSET', .true., set, ok)
    if (.not. ok) return
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'ELEMENT') cycle
      call open_card(reader, k, other)
      call name_option(reader, other, 'TYPE', .false., kind, ok)
      if (kind /= 'DCOUP3D') cycle
      call name_option(reader, other, 'ELSET', .false., name, ok)
      fields = fields_t()
      do
        call next_data_line(reader, other, fields, found, 2, 'an id and the node of a coupling')
        if (.not. found) exit
        call integer_field(reader, fields, 1, 'the id of an element', 1, element, ok)
        if (.not. ok) cycle
        if (name /= set) then
          if (.not. names_element(reader, set, element)) cycle
        end if
        if (has_one) then
          call report(reader, fields%start, 'a *DISTRIBUTING COUPLING has one element')
          id = 0
          return
        end if
        has_one = .true.
        call integer_field(reader, fields, 2, 'the node of a coupling', 1, id, ok)
        if (.not. ok) id = 0
      end do
    end do
    if (.not. has_one) call report(reader, option_position(card, 'ELSET'), 'element set '// &
      quoted(set)//' has no element of TYPE=DCOUP3D, whose node is the reference node')
  end subroutine find_element_node

  !> Whether a card *ELSET of a name has the id of an element: sets are read later.
  logical function names_element(reader, set, id)
    type(reader_t), intent(inout) :: reader
    character(*), intent(in) :: set
    integer, intent(in) :: id
    type(card_t) :: card
    type(fields_t) :: fields
    type(reference_t) :: reference
    character(:), allocatable :: name
    integer :: k, i
    logical :: ok, found

    names_element = .false.
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'ELSET') cycle
      call open_card(reader, k, card)
      call name_option(reader, card, 'ELSET', .false., name, ok)
      if (name /= set) cycle
      fields = fields_t()
      do
        call next_data_line(reader, card, fields, found, any_number, '')
        if (.not. found) exit
        do i = 1, fields%n
          if (is_empty_field(fields, i)) cycle
          call reference_field(reader, fields, i, 'an element', reference, ok)
          names_element = names_element .or. (ok .and. reference%id == id)
        end do
      end do
    end do
  end function names_element

  !> Lines of first dof, last dof; no line: all.
  subroutine read_dofs(reader, card, coupling, ok)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(coupling_t), intent(inout) :: coupling
    logical, intent(out) :: ok
    type(fields_t) :: fields
    integer :: first, last
    logical :: found, any_line, both(2)

    call allow_options(reader, card)
    coupling%dofs = .false.
    any_line = .false.
    ok = .true.
    do
      call next_data_line(reader, card, fields, found, 2, 'a first and a last dof')
      if (.not. found) exit
      any_line = .true.
      call integer_field(reader, fields, 1, 'the first dof', 1, first, both(1))
      last = first
      both(2) = .true.
      if (.not. is_empty_field(fields, 2)) call integer_field(reader, fields, 2, 'the last dof', &
        1, last, both(2))
      ok = ok .and. all(both)
      if (.not. all(both)) cycle
      if (last > 6 .or. first > last) then
        ok = .false.
        call report(reader, field_position(reader, fields, 1), 'expected a first and a last '// &
          'dof from 1 to 6, found '//to_text(first)//' and '//to_text(last))
        cycle
      end if
      coupling%dofs(first:last) = .true.
    end do
    if (.not. any_line) coupling%dofs = .true.
    if (ok .and. .not. coupling%distributes .and. .not. any(coupling%dofs(:3))) then
      call report(reader, card%position, '*KINEMATIC couples none of dofs 1 to 3, and the '// &
        'nodes of elements have no others')
    end if
  end subroutine read_dofs

  !> Find the faces of every coupling.
  subroutine find_coupled_surfaces(reader, model, surfaces, couplings)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(surface_list_t), intent(inout) :: surfaces
    type(coupling_t), intent(inout) :: couplings(:)
    integer :: k

    do k = 1, size(couplings)
      associate (of => couplings(k), node => couplings(k)%node)
        if (.not. allocated(of%surface_name)) cycle ! a rigid body
        if (model%reference(node) .or. (model%rigid(node) .and. .not. model%used(node))) then
          call report(reader, of%node_position, 'node '//to_text(model%mesh%node_id(node))// &
            ' belongs to an obstacle or to facets: it cannot be the reference node of a coupling')
        end if
        if (len(of%surface_name) == 0) cycle
        call find_surface_or_set(reader, model, of%surface_position, of%surface_name, surfaces, &
          of%surface)
        if (of%surface == 0) cycle
        call find_faces_of_nodes(reader, model, surfaces, of%surface)
        if (surfaces%flawed(of%surface) .or. any_mistakes(reader%diagnostics)) cycle
        if (size(surfaces%list(of%surface)%nodes) == 0) then
          call report(reader, of%surface_position, 'surface '//quoted(of%surface_name)// &
            ' has no nodes to be coupled')
        else if (of%distributes .and. size(surfaces%list(of%surface)%faces, 2) == 0) then
          call report(reader, of%surface_position, 'surface '//quoted(of%surface_name)// &
            ' has no faces: *DISTRIBUTING weighs nodes by their areas')
        end if
        of%nodes = surfaces%list(of%surface)%nodes
      end associate
    end do
  end subroutine find_coupled_surfaces

end module read_couplings_mod
