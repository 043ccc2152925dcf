!> Nodes and elements.
!>
!>     *NODE, NSET=ALL
!>     1, 0., 0., 0.
!>     *ELEMENT, TYPE=C3D8, ELSET=BODY
!>     1,  1, 2, 4, 3,  5, 6, 8, 7
module read_mesh_mod
  use cells_mod, only: cells, hexahedron_8, pyramid_13, pyramid_5, wedge_15, wedge_6
  use cards_mod, only: keep_reading, note, reader_t, report
  use collapse_elements_mod, only: collapse_elements, join_places
  use diagnostics_mod, only: guess, quoted
  use element_types_mod, only: element_types, plane_types, plane_type_called, taken_as, &
    type_called
  use fields_mod, only: any_number, fields_t, integer_field, is_empty_field, limit_fields, &
    looks_like_id, next_data_line, real_field
  use kinds_mod, only: wp
  use lookup_mod, only: find_id, id_lookup_t, make_id_lookup
  use mesh_draft_mod, only: add_early_set, add_element, add_node, add_skipped, add_skipped_node, &
    early_set_t, is_of_block, max_nodes, mesh_draft_t, names_of_planes, no_facet, &
    not_a_coordinate, refused_element, reserve_elements, reserve_nodes, rigid_facet, &
    gap_uni, set_of_elements, set_of_nodes, shell_facet, solids, spring_1, spring_2, spring_a
  use mesh_mod, only: kind_c3d8
  use order_middles_mod, only: order_middles
  use options_mod, only: allow_options, card_t, choice_option, has_option, name_option, &
    option_position
  use text_mod, only: as_list, one_of, string_t, to_text
  implicit none
  private

  public :: system_t, read_nodes, read_elements, connect_mesh, check_element_type

  !> The axes of *SYSTEM, in which the lines of *NODE are.
  type :: system_t
    logical :: is_set = .false.
    real(wp) :: origin(3) = 0.0_wp !! [length]
    real(wp) :: axis(3, 3) = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, &
      0.0_wp, 1.0_wp], [3, 3])     !! unit vectors, one a column
  end type system_t

  integer, parameter :: rectangular = 1, cylindrical = 2 !! SYSTEM= of *NODE

  ! What a type of element is to us, beside the kinds of elements.
  integer, parameter :: unknown_type = 0, skipped_type = -1
  integer, parameter :: of_coupling = -2 !! its node is the reference node of a coupling
  character(*), parameter :: no_inner_nodes = 'Mesh.SecondOrderIncomplete=1 leaves out nodes '// &
    'within faces and solids'

  integer, parameter :: max_wrong = 5     !! elements with undefined nodes told one by one

contains

  !> *NODE[, NSET=name][, SYSTEM=R|C]: id, x, y, z
  subroutine read_nodes(reader, card, system, draft)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(system_t), intent(in) :: system !! of the last *SYSTEM
    type(mesh_draft_t), intent(inout) :: draft
    type(fields_t) :: fields
    integer :: id, i, first, before, along
    real(wp) :: x(3)
    logical :: found, ok(4), room

    call allow_options(reader, card)
    along = merge(rectangular, 0, system%is_set)
    if (has_option(card, 'SYSTEM')) call choice_option(reader, card, 'SYSTEM', along, ok(1))
    first = draft%n_nodes + 1
    before = reader%diagnostics%n_mistakes
    do
      call next_data_line(reader, card, fields, found, 4, 'an id and three coordinates')
      if (.not. found) exit
      call integer_field(reader, fields, 1, 'the id of a node', 1, id, ok(1))
      x = 0.0_wp ! what is left out, as Abaqus has it
      ok(2:) = .true.
      do i = 1, 3
        if (is_empty_field(fields, i + 1)) then
          call note(reader, 'coordinates that lines of *NODE leave out are 0')
        else
          call real_field(reader, fields, i + 1, 'coordinate '//'xyz'(i:i), x(i), ok(i + 1))
        end if
      end do
      if (.not. ok(1)) cycle
      if (all(ok) .and. along > 0) x = in_space(system, along, x)
      if (repeats_last(id, x)) then
        call note(reader, 'a line of *NODE that is written twice is taken once')
        cycle
      end if
      call reserve_nodes(draft, 1, room)
      if (.not. room) then
        call report(reader, fields%start, 'too many nodes (at most '//to_text(max_nodes)// &
          ', memory permitting)')
        exit
      end if
      call add_node(draft, id, merge(x, not_a_coordinate, ok(2:)), fields%start)
    end do
    call add_option_set(reader, card, 'NSET', [first, draft%n_nodes], &
      reader%diagnostics%n_mistakes > before, draft)

  contains

    !> Whether a node is the one of the line before, at the same place: no other one is meant.
    logical function repeats_last(id, x)
      integer, intent(in) :: id
      real(wp), intent(in) :: x(3) !! [length]

      repeats_last = .false.
      if (draft%n_nodes < first .or. .not. all(ok)) return
      repeats_last = draft%node_id(draft%n_nodes) == id .and. .not. any(abs(x - &
        draft%coordinates(:, draft%n_nodes)) > 0.0_wp)
    end function repeats_last
  end subroutine read_nodes

  !> The place of coordinates of a system: along its axes, or a radius, an angle in degrees from its
  !> x axis and a height along its z axis.
  pure function in_space(system, along, x) result(place)
    type(system_t), intent(in) :: system
    integer, intent(in) :: along    !! rectangular, cylindrical
    real(wp), intent(in) :: x(3)
    real(wp) :: place(3), angle
    real(wp), parameter :: degree = acos(-1.0_wp)/180.0_wp

    place = x
    angle = x(2)*degree
    if (along == cylindrical) place(1:2) = x(1)*[cos(angle), sin(angle)]
    if (system%is_set) place = system%origin + matmul(system%axis, place)
  end function in_space

  !> *ELEMENT, TYPE=type[, ELSET=name]: id, nodes, over one line or more
  subroutine read_elements(reader, card, draft)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(mesh_draft_t), intent(inout) :: draft
    integer :: first, first_skipped, kind, cell, before

    call allow_options(reader, card)
    first = draft%n_elements + 1
    first_skipped = draft%n_skipped + 1
    before = reader%diagnostics%n_mistakes
    call check_element_type(reader, card, .true., kind, cell, draft%plane)
    if (kind > 0) then
      call read_solids(reader, card, kind, cell, draft)
      if (draft%n_elements < first .and. reader%diagnostics%n_mistakes == before) then
        draft%taken_out = .true.
        draft%empty_card = .true.
        call note(reader, '*ELEMENT without data: its elements are taken to have been removed')
      end if
    else if (kind == of_coupling) then
      call keep_ids(reader, card, draft)
    else
      call skip_elements(reader, card, draft)
    end if
    call add_option_set(reader, card, 'ELSET', [first, draft%n_elements], &
      reader%diagnostics%n_mistakes > before, draft, [first_skipped, draft%n_skipped])
  end subroutine read_elements

  !> Say what the TYPE= of a card is to us, reporting what is not available.
  subroutine check_element_type(reader, card, required, kind, cell, plane)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    logical, intent(in) :: required !! its absence is a mistake
    integer, intent(out) :: kind    !! of element (> 0), skipped_type or unknown_type
    integer, intent(out) :: cell    !! row of the table of cells
    integer, intent(in), optional :: plane !! what elements of a plane are, where not solids
    character(:), allocatable :: name
    integer :: facet, corners, row
    logical :: ok

    kind = unknown_type
    cell = hexahedron_8
    call name_option(reader, card, 'TYPE', required, name, ok)
    if (.not. ok) then
      if (.not. has_option(card, 'TYPE') .and. .not. required) kind = kind_c3d8
      return
    end if
    row = type_called(taken_as(name))
    if (row > 0) then
      kind = element_types(row)%kind
      cell = element_types(row)%cell
      if (element_types(row)%name /= name) call note(reader, name//' elements are taken as '// &
        trim(element_types(row)%name)//what_it_is(name))
      return
    end if
    if (present(plane)) then
      ! What they are is said by a card; Gmsh calls all of them CPS.
      if (plane /= solids) row = plane_type_called(in_plane(taken_as(name), plane))
      if (row > 0) then
        kind = plane_types(row)%kind
        cell = plane_types(row)%cell
        if (plane_types(row)%name /= name) call note(reader, name//' elements are taken as '// &
          trim(plane_types(row)%name)//what_it_is(name))
        return
      end if
    end if
    select case (name)
    case ('DCOUP3D')
      kind = of_coupling
    case ('SPRING1', 'SPRING2', 'SPRINGA', 'GAPUNI')
      kind = skipped_type ! read_springs and read_gap_elements take them
    case default
      if (is_skipped(name)) then
        kind = skipped_type
        call find_facet(name, facet, corners)
        ! Those that a rigid body takes are no longer skipped.
        if (facet == no_facet .or. (facet == shell_facet .and. .not. &
            any(reader%cards(:reader%n_cards)%keyword == 'RIGID BODY'))) call note(reader, name// &
          ' elements are skipped: only solids are supported')
      else
        reader%lacks_elements = .true.
        if (is_of_other_field(name)) then
          reader%other_field = .true.
          call report(reader, option_position(card, 'TYPE'), 'element type '//quoted(name)// &
            ': bipot solves static frictional contact of elastic solids')
          return
        end if
        call report(reader, option_position(card, 'TYPE'), 'element type '//quoted(name)// &
          ' is not available; use '//one_of(element_types%name), what_instead(name, &
          as_list(element_types%name)))
      end if
    end select
  end subroutine check_element_type

  !> A type of a plane with the beginning that plane elements of the deck have.
  pure function in_plane(name, plane) result(changed)
    character(*), intent(in) :: name
    integer, intent(in) :: plane
    character(:), allocatable :: changed

    changed = name
    if (any(index(name, names_of_planes) == 1)) changed = names_of_planes(plane)//name(4:)
  end function in_plane

  !> How the type that stands for another is computed.
  pure function what_it_is(name) result(words)
    character(*), intent(in) :: name !! that the deck has
    character(:), allocatable :: words

    words = ''
    if (index(name, 'H') == 0 .or. name == 'C3D8RH') then
      if (index(name, '8R') + index(name, '4R') > 0) words = ': full integration'
    else if (any(name(:4) == ['C3D8', 'CPE4', 'CAX4']) .and. index(name, 'I') == 0) then
      words = ': a mean dilatation in the place of a constant pressure'
    else
      words = ': displacements alone, without pressures of their own'
    end if
  end function what_it_is

  !> Whether a type is of fluids, heat, acoustics or networks, a damper, a mass, or one of the
  !> user's own.
  pure logical function is_of_other_field(name)
    character(*), intent(in) :: name !! upper case
    character(7), parameter :: beginnings(*) = [character(7) :: 'F3D', 'FC3D', 'DC', 'AC', &
      'SPRING', 'DASHPOT', 'GAP', 'MASS', 'ROTARYI', 'U', 'CONN', 'COH']
    integer :: i

    is_of_other_field = name == 'D' .or. name == 'F' .or. any([(index(name, trim(beginnings(i))) &
      == 1, i=1, size(beginnings))])
  end function is_of_other_field

  !> What to mesh with where elements have more nodes than their type: Gmsh writes wedges of 18 and
  !> pyramids of 14 nodes as types of first order.
  pure function what_of_gmsh(cell, n_fields) result(words)
    integer, intent(in) :: cell     !! row of the table of cells
    integer, intent(in) :: n_fields !! of a line
    character(:), allocatable :: words

    words = ''
    if (cell == wedge_6 .and. n_fields > cells(wedge_15)%n_nodes) words = 'C3D15'
    if (cell == pyramid_5 .and. n_fields > cells(pyramid_13)%n_nodes) words = 'C3D13'
    if (words /= '') words = '; '//words//' from Gmsh: '//no_inner_nodes
  end function what_of_gmsh

  !> What to mesh with where a type of elements is not available.
  pure function what_instead(name, known) result(hint)
    character(*), intent(in) :: name !! of the type that is not available
    type(string_t), intent(in) :: known(:)
    character(:), allocatable :: hint

    select case (name)
    case ('C3D27', 'C3D27R', 'C3D27H')
      hint = 'C3D20 from Gmsh: '//no_inner_nodes
    case ('C3D14')
      hint = 'C3D13 from Gmsh: '//no_inner_nodes
    case ('C3D10T')
      hint = 'C3D10 computes displacements'
    case ('C3D15V', 'C3D18')
      hint = 'C3D15 from Gmsh: '//no_inner_nodes
    case default
      hint = guess(name, known)
    end select
  end function what_instead

  !> Whether a type is one of facets, of which rigid bodies consist, and how many corners it has.
  pure subroutine find_facet(name, facet, corners)
    character(*), intent(in) :: name   !! upper case
    integer, intent(out) :: facet      !! no_facet and its kin
    integer, intent(out) :: corners    !! 0 where it is none

    facet = shell_facet
    corners = 3
    select case (name)
    case ('R3D3')
      facet = rigid_facet
    case ('R3D4')
      facet = rigid_facet
      corners = 4
    case ('S3', 'S3R')
      corners = 3
    case ('S4', 'S4R')
      corners = 4
    case default
      facet = no_facet
      corners = 0
    end select
  end subroutine find_facet

  !> Whether a type is of lines or faces, which mesh generators write beside the elements.
  pure logical function is_skipped(name) result(is)
    character(*), intent(in) :: name !! upper case
    character(4), parameter :: beginnings(*) = ['CPS ', 'CPE ', 'CAX ', 'CGAX', 'STRI', 'M3D ', &
      'SFM ', 'R2D ', 'R3D ', 'T2D ', 'T3D ', 'B2  ', 'B3  ', 'S3  ', 'S4  ', 'S6  ', 'S8  ', &
      'DS  ']
    integer :: i

    is = any([(index(name, trim(beginnings(i))) == 1, i=1, size(beginnings))])
  end function is_skipped

  !> Read the elements of a card. An id and nodes may go over several lines.
  subroutine read_solids(reader, card, kind, cell, draft)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    integer, intent(in) :: kind !! of element
    integer, intent(in) :: cell !! row of the table of cells
    type(mesh_draft_t), intent(inout) :: draft
    type(fields_t) :: fields
    integer :: entries(1 + size(nodes_in_deck(draft, cell))), have, i, position
    logical :: found, ok, all_ok, comma, room
    character(:), allocatable :: what

    what = 'an id and '//to_text(size(entries) - 1)//' nodes'
    have = 0
    position = 0
    comma = .false.
    all_ok = .true.
    do
      call next_data_line(reader, card, fields, found, any_number, what)
      if (.not. found) exit
      if (have > 0) then
        ! A line that cannot be the rest of this element begins the next one.
        if (fields%n > size(entries) - have .or. &
            (.not. comma .and. fields%n /= size(entries) - have)) then
          call too_few()
          have = 0
        end if
      end if
      if (have == 0) then
        position = fields%start
        all_ok = .true.
        call limit_fields(reader, fields, size(entries), what//what_of_gmsh(cell, fields%n))
      end if
      do i = 1, min(fields%n, size(entries) - have)
        if (have + i == 1) then
          call integer_field(reader, fields, i, 'the id of an element', 1, entries(1), ok)
        else
          call integer_field(reader, fields, i, 'the id of a node', 1, entries(have + i), ok)
        end if
        all_ok = all_ok .and. ok
      end do
      have = have + min(fields%n, size(entries) - have)
      comma = fields%pieces%ends_with_comma
      if (have < size(entries)) cycle
      have = 0
      if (.not. all_ok) cycle
      call reserve_elements(draft, 1, room)
      if (.not. room) then
        call report(reader, fields%start, 'too many elements (at most '//to_text(max_nodes)// &
          ', memory permitting)')
        return
      end if
      call add_element(draft, entries(1), kind, cell, in_all_places(draft, cell, entries(2:)), &
        position)
    end do
    if (have > 0) call too_few()

  contains

    subroutine too_few()
      if (all_ok) call report(reader, position, 'an element of this type has '//what// &
        ', found only '//to_text(have)//' numbers')
    end subroutine too_few

  end subroutine read_solids

  !> The places of a cell whose nodes the deck names, in its order: all, or those in the plane.
  pure function nodes_in_deck(draft, cell) result(places)
    type(mesh_draft_t), intent(in) :: draft
    integer, intent(in) :: cell !! row of the table of cells
    integer, allocatable :: places(:)
    integer :: k

    associate (of => cells(cell))
      places = [(k, k=1, of%n_nodes)]
      if (draft%plane == solids) return
      places = [(k, k=1, of%n_corners/2)]
      if (of%n_nodes > of%n_corners) places = [places, of%n_corners + places]
    end associate
  end function nodes_in_deck

  !> The nodes of a cell, those in the plane in the places of their copies, too.
  pure function in_all_places(draft, cell, nodes) result(all_nodes)
    type(mesh_draft_t), intent(in) :: draft
    integer, intent(in) :: cell     !! row of the table of cells
    integer, intent(in) :: nodes(:) !! as the deck names them
    integer, allocatable :: all_nodes(:)

    all_nodes = nodes
    if (draft%plane == solids) return
    associate (n => cells(cell)%n_corners/2)
      all_nodes = [nodes(:n), nodes(:n)]
      if (size(nodes) > n) all_nodes = [all_nodes, nodes(n + 1:), nodes(n + 1:), nodes(:n)]
    end associate
  end function in_all_places

  !> Keep the ids of elements that are not computed, so that sets may name them.
  subroutine skip_elements(reader, card, draft)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(mesh_draft_t), intent(inout) :: draft
    type(fields_t) :: fields
    character(:), allocatable :: name
    integer :: id, i, facet, corners, entries, have
    logical :: found, ok, continued

    call name_option(reader, card, 'TYPE', .false., name, ok)
    call find_facet(name, facet, corners)
    if (connector_kind(name) /= no_facet) then
      facet = connector_kind(name)
    else if (.not. is_skipped(name)) then
      facet = refused_element
    end if
    entries = 1 + nodes_of_type(name)
    have = 0
    continued = .false.
    do
      call next_data_line(reader, card, fields, found, any_number, 'an id and nodes')
      if (.not. found) exit
      if (.not. continued) then
        have = 0
        call integer_field(reader, fields, 1, 'the id of an element', 1, id, ok)
        if (ok) call add_skipped(draft, id, fields%start, facet, corners)
        do i = 2, min(fields%n, 9)
          if (entries == 1) exit ! networks have nodes 0
          if (.not. ok .or. .not. looks_like_id(reader, fields, i)) exit
          call integer_field(reader, fields, i, 'the id of a node', 1, id, ok)
          if (ok) call add_skipped_node(draft, id)
        end do
      end if
      have = have + fields%n
      continued = fields%pieces%ends_with_comma .and. have < entries
    end do
  end subroutine skip_elements

  !> Keep the ids of elements that *DISTRIBUTING COUPLING reads, so that sets may name them.
  subroutine keep_ids(reader, card, draft)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(mesh_draft_t), intent(inout) :: draft
    type(fields_t) :: fields
    integer :: id
    logical :: found, ok

    do
      call next_data_line(reader, card, fields, found, 2, 'an id and the node of a coupling')
      if (.not. found) exit
      call integer_field(reader, fields, 1, 'the id of an element', 1, id, ok)
      if (ok) call add_skipped(draft, id, fields%start, no_facet, 0)
    end do
  end subroutine keep_ids

  !> What springs and gaps of a type are, no_facet of other types.
  pure integer function connector_kind(name) result(kind)
    character(*), intent(in) :: name !! upper case

    select case (name)
    case ('SPRING1')
      kind = spring_1
    case ('SPRING2')
      kind = spring_2
    case ('SPRINGA')
      kind = spring_a
    case ('GAPUNI')
      kind = gap_uni
    case default
      kind = no_facet
    end select
  end function connector_kind

  !> How many nodes an element has, by the last number in the name of its type, as in S8R; beams
  !> have one more. 0: the name does not say it.
  pure integer function nodes_of_type(name) result(n)
    character(*), intent(in) :: name !! upper case
    integer, parameter :: most = 27
    integer :: first, last, status

    n = merge(2, 0, name == 'SPRINGA' .or. name == 'GAPUNI')
    last = scan(name, '0123456789', back=.true.)
    if (last == 0) return
    first = verify(name(:last), '0123456789', back=.true.) + 1
    if (name(1:1) == 'B') first = last
    read (name(first:last), *, iostat=status) n
    if (status /= 0 .or. n > most) n = 0
    if (name(1:1) == 'B') n = n + 1
  end function nodes_of_type

  !> Make the set that an option of *NODE or *ELEMENT names.
  subroutine add_option_set(reader, card, option, range, flawed, draft, skipped)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    character(*), intent(in) :: option  !! NSET or ELSET
    integer, intent(in) :: range(2)     !! first and last member
    logical, intent(in) :: flawed       !! there were mistakes in the card
    type(mesh_draft_t), intent(inout) :: draft
    integer, intent(in), optional :: skipped(2) !! first and last skipped element
    type(early_set_t) :: set
    logical :: ok

    call name_option(reader, card, option, .false., set%name, ok)
    if (.not. ok) return
    set%kind = set_of_elements
    if (option == 'NSET') set%kind = set_of_nodes
    set%position = card%position
    set%flawed = flawed
    set%first = range(1)
    set%last = range(2)
    if (present(skipped)) set%skipped = skipped
    call add_early_set(draft, set)
  end subroutine add_option_set

  !> When all cards are read: look-ups, duplicate ids, and node numbers in place of ids.
  subroutine connect_mesh(reader, draft)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(inout) :: draft
    integer :: e, k, node, n_wrong
    logical :: ok

    ! Lists that no card filled exist nevertheless.
    call reserve_nodes(draft, 1, ok)
    call reserve_elements(draft, 1, ok)
    if (.not. allocated(draft%skipped_id)) then
      allocate (draft%skipped_id(1), draft%skipped_position(1), draft%skipped_first(1))
      allocate (draft%skipped_kind(1), draft%skipped_corners(1))
    end if

    call make_id_lookup(draft%node_id(:draft%n_nodes), draft%nodes)
    call drop_repeated_nodes(reader, draft)
    call report_duplicates(reader, 'node', draft%node_id, draft%node_position, draft%nodes)
    call make_id_lookup(draft%element_id(:draft%n_elements), draft%elements)
    call report_duplicates(reader, 'element', draft%element_id, draft%element_position, &
      draft%elements)
    call make_id_lookup(draft%skipped_id(:draft%n_skipped), draft%skipped)
    call report_duplicates(reader, 'element', draft%skipped_id, draft%skipped_position, &
      draft%skipped)
    do k = 1, draft%n_skipped
      if (.not. keep_reading(reader)) exit
      if (find_id(draft%elements, draft%element_id, draft%skipped_id(k)) > 0) then
        call report(reader, draft%skipped_position(k), 'duplicate element '// &
        to_text(draft%skipped_id(k)))
      end if
    end do

    n_wrong = 0
    do e = 1, draft%n_elements
      ok = .true.
      associate (nodes => draft%connectivity%node(draft%connectivity%first(e): &
                 draft%connectivity%first(e + 1) - 1))
        do k = 1, size(nodes)
          node = find_id(draft%nodes, draft%node_id, nodes(k))
          if (node == 0 .and. ok .and. n_wrong < max_wrong) then
            call report(reader, draft%element_position(e), 'element '// &
              to_text(draft%element_id(e))//' names node '//to_text(nodes(k))// &
              ', which is not defined')
          end if
          ok = ok .and. node > 0
          nodes(k) = node
        end do
        if (.not. ok) n_wrong = n_wrong + 1
        if (.not. ok) nodes = min(1, draft%n_nodes)
      end associate
    end do
    if (n_wrong > max_wrong) call report(reader, draft%element_position(draft%n_elements), &
      to_text(n_wrong - max_wrong)//' more elements name nodes that are not defined')
    if (draft%n_nodes == 0) call drop_elements(draft)
    call join_places(reader, draft)
    call order_middles(draft)
    call collapse_elements(reader, draft)
  end subroutine connect_mesh

  !> Forget all elements: there is no node that they could have.
  subroutine drop_elements(draft)
    type(mesh_draft_t), intent(inout) :: draft
    integer :: i

    draft%n_elements = 0
    draft%elements%n = 0
    do i = 1, draft%n_sets
      if (draft%sets(i)%kind /= set_of_elements) cycle
      draft%sets(i)%last = draft%sets(i)%first - 1
      draft%sets(i)%flawed = .true.
    end do
  end subroutine drop_elements

  !> Nodes that are defined twice in the same place are one: the later ones get ids of their own,
  !> and sets that have them the first.
  subroutine drop_repeated_nodes(reader, draft)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(inout) :: draft
    integer :: first(draft%n_nodes), i, k, n, id

    if (.not. allocated(draft%nodes%order)) return
    first = [(i, i=1, draft%n_nodes)]
    n = 0
    id = 0
    do i = 2, draft%nodes%n
      associate (before => first(draft%nodes%order(i - 1)), now => draft%nodes%order(i))
        if (draft%node_id(now) /= draft%node_id(before)) cycle
        if (any(abs(draft%coordinates(:, now) - draft%coordinates(:, before)) > 0.0_wp)) cycle
        if (is_of_block(draft, now)) cycle
        if (n == 0) id = draft%node_id(now)
        n = n + 1
        first(now) = before
      end associate
    end do
    if (n == 0 .or. n > huge(n) - draft%highest_node) return
    do k = 1, draft%n_nodes
      if (first(k) == k) cycle
      draft%highest_node = draft%highest_node + 1
      draft%node_id(k) = draft%highest_node
    end do
    call note(reader, 'nodes that are defined twice in the same place are one: '//to_text(n)// &
      ' (the first: node '//to_text(id)//')')
    call make_id_lookup(draft%node_id(:draft%n_nodes), draft%nodes)
    draft%nodes%instead = first
  end subroutine drop_repeated_nodes

  subroutine report_duplicates(reader, what, ids, positions, lookup)
    type(reader_t), intent(inout) :: reader
    character(*), intent(in) :: what
    integer, intent(in) :: ids(:), positions(:)
    type(id_lookup_t), intent(in) :: lookup
    integer :: i

    if (.not. allocated(lookup%order)) return
    do i = 2, lookup%n
      if (ids(lookup%order(i)) /= ids(lookup%order(i - 1))) cycle
      if (.not. keep_reading(reader)) return
      call report(reader, positions(lookup%order(i)), 'duplicate '//what//' '// &
        to_text(ids(lookup%order(i))))
    end do
  end subroutine report_duplicates

end module read_mesh_mod
