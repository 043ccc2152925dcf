!> Named surfaces.
!>
!>     *SURFACE, NAME=BOTTOM, TYPE=ELEMENT
!>     SKIN, S1                      a set of elements (or one element) and one of its faces
!>     *SURFACE, NAME=TIP, TYPE=NODE
!>     17                            nodes, or sets of nodes
!>
!> Every *BLOCK brings the surfaces of its six sides.
module read_surfaces_mod
  use block_mesh_mod, only: block_face, face_zmax
  use cards_mod, only: note, reader_t, report
  use diagnostics_mod, only: guess, quoted
  use find_faces_mod, only: find_outer_faces
  use fields_mod, only: field_position, field_text, fields_t, is_empty_field, &
    next_data_line, real_field, reference_field, reference_t
  use growing_lists_mod, only: append
  use kinds_mod, only: i8, wp
  use lookup_mod, only: find_name, make_name_lookup, name_lookup_t
  use mesh_draft_mod, only: block_t, mesh_draft_t
  use options_mod, only: allow_options, card_t, choice_option, name_option, open_card
  use read_block_mod, only: side_name
  use sets_mod, only: find_set, model_t, referenced_elements, referenced_nodes
  use sorting_mod, only: sort_unique
  use surfaces_mod, only: face_nodes, surface_t
  use text_mod, only: string_t, to_text, upper
  implicit none
  private

  public :: surface_list_t, read_surfaces, find_surface, add_surface_of_sides
  public :: find_faces_of_nodes, find_surface_or_set

  integer, parameter :: of_elements = 1, of_nodes = 2

  !> Faces and nodes named by all surfaces of a deck together: more than any real deck needs.
  integer(i8), parameter :: max_work = 200000000
  !> Elements looked at to find the faces of nodes, for all surfaces together: likewise.
  integer(i8), parameter :: max_search = 1000000000

  !> All surfaces. There may be more room in the arrays than surfaces.
  type :: surface_list_t
    type(surface_t), allocatable :: list(:)
    type(string_t), allocatable :: names(:)
    integer :: n = 0
    integer :: n_named = 0 !! the first ones: from *BLOCK and *SURFACE, found by name
    type(name_lookup_t) :: lookup
    logical, allocatable :: flawed(:) !! nodes are missing because of mistakes
    integer, allocatable :: of_set(:) !! for each set of nodes its surface; 0: none
    logical, allocatable :: of_nodes(:) !! made of nodes, and its faces are not found yet
    integer(i8) :: work = 0 !! elements looked at to find faces
  end type surface_list_t

contains

  !> Read all surfaces.
  subroutine read_surfaces(reader, model, surfaces)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(surface_list_t), intent(out) :: surfaces
    type(card_t) :: card
    character(:), allocatable :: name
    integer, allocatable :: position(:)
    integer :: b, side, k, most, before
    integer(i8) :: work
    logical :: ok, flawed

    most = 6*model%mesh%n_blocks + count(reader%cards(:reader%n_cards)%keyword == 'SURFACE')
    allocate (surfaces%names(most), position(most), surfaces%list(most), surfaces%of_nodes(most))
    allocate (surfaces%flawed(most))
    do b = 1, model%mesh%n_blocks
      do side = 1, face_zmax
        call add_surface(surfaces, side_name(model%mesh%blocks(b)%name, side))
        position(surfaces%n) = 0
        surfaces%flawed(surfaces%n) = any(model%mesh%blocks(b)%n == 0)
        call fill_block_side(model%mesh, model%mesh%blocks(b), side, surfaces%list(surfaces%n))
      end do
    end do
    allocate (surfaces%of_set(model%node_sets%n), source=0)
    work = 0
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'SURFACE') cycle
      call open_card(reader, k, card)
      call name_option(reader, card, 'NAME', .true., name, ok)
      if (.not. ok) cycle
      call add_surface(surfaces, name)
      position(surfaces%n) = card%position
      before = reader%diagnostics%n_mistakes
      flawed = .false.
      call read_surface(reader, model, card, surfaces%list(surfaces%n), work, flawed, &
        surfaces%of_nodes(surfaces%n))
      surfaces%flawed(surfaces%n) = flawed .or. reader%diagnostics%n_mistakes > before
    end do
    surfaces%n_named = surfaces%n
    call make_name_lookup(surfaces%names, surfaces%n_named, surfaces%lookup)
    do k = 1, surfaces%n
      if (position(k) > 0 .and. find_surface(surfaces, surfaces%names(k)%text) /= k) then
        call report(reader, position(k), 'duplicate surface '//quoted(surfaces%names(k)%text))
      end if
    end do
  end subroutine read_surfaces

  subroutine add_surface(surfaces, name)
    type(surface_list_t), intent(inout) :: surfaces
    character(*), intent(in) :: name

    call add_unnamed(surfaces)
    surfaces%names(surfaces%n)%text = name
    surfaces%list(surfaces%n)%name = name
    allocate (surfaces%list(surfaces%n)%nodes(0))
  end subroutine add_surface

  !> Make room for one more surface, without name and faces.
  subroutine add_unnamed(surfaces)
    type(surface_list_t), intent(inout) :: surfaces
    type(surface_t), allocatable :: larger(:)
    logical, allocatable :: flags(:)
    integer :: i

    if (surfaces%n == size(surfaces%list)) then
      allocate (larger(2*surfaces%n + 4), flags(2*surfaces%n + 4))
      do i = 1, surfaces%n
        larger(i)%name = surfaces%list(i)%name
        call move_alloc(surfaces%list(i)%faces, larger(i)%faces)
        call move_alloc(surfaces%list(i)%nodes, larger(i)%nodes)
      end do
      call move_alloc(larger, surfaces%list)
      flags = .false.
      flags(:surfaces%n) = surfaces%flawed
      surfaces%flawed = flags
      flags(:surfaces%n) = surfaces%of_nodes
      call move_alloc(flags, surfaces%of_nodes)
    end if
    surfaces%n = surfaces%n + 1
    surfaces%list(surfaces%n)%name = ''
    allocate (surfaces%list(surfaces%n)%faces(2, 0))
    surfaces%flawed(surfaces%n) = .false.
    surfaces%of_nodes(surfaces%n) = .false.
  end subroutine add_unnamed

  !> Add the surface of one and the same face of several elements; `index` is its index.
  subroutine add_surface_of_sides(mesh, elements, face, surfaces, index)
    type(mesh_draft_t), intent(in) :: mesh
    integer, intent(in) :: elements(:)
    integer, intent(in) :: face          !! 1..6
    type(surface_list_t), intent(inout) :: surfaces
    integer, intent(out) :: index

    call add_unnamed(surfaces)
    index = surfaces%n
    deallocate (surfaces%list(index)%faces)
    allocate (surfaces%list(index)%faces(2, size(elements)))
    surfaces%list(index)%faces(1, :) = elements
    surfaces%list(index)%faces(2, :) = face
    call find_nodes(mesh, surfaces%list(index))
  end subroutine add_surface_of_sides

  !> Find the faces of a surface of nodes, when something needs them.
  subroutine find_faces_of_nodes(reader, model, surfaces, index)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(surface_list_t), intent(inout) :: surfaces
    integer, intent(in) :: index
    integer, allocatable :: faces(:, :)
    integer :: n

    if (.not. surfaces%of_nodes(index)) return
    surfaces%of_nodes(index) = .false.
    surfaces%work = surfaces%work + model%mesh%n_elements
    if (surfaces%work > max_search) then
      call report(reader, 0, 'the deck uses too many surfaces of nodes')
      return
    end if
    call find_outer_faces(model%mesh, surfaces%list(index)%nodes, faces)
    call move_alloc(faces, surfaces%list(index)%faces)
    n = count_without_face(model%mesh, surfaces%list(index))
    if (n > 0 .and. n < size(surfaces%list(index)%nodes)) call note(reader, 'surface '// &
      quoted(surfaces%list(index)%name)//': '//to_text(n)//' of its nodes are on no outer face '// &
      'that lies in it with all four nodes: they carry no area')
  end subroutine find_faces_of_nodes

  !> How many nodes of a surface none of its faces has.
  pure function count_without_face(mesh, surface) result(n)
    type(mesh_draft_t), intent(in) :: mesh
    type(surface_t), intent(in) :: surface
    integer :: n, i
    logical, allocatable :: on_face(:)

    allocate (on_face(mesh%n_nodes))
    on_face = .false.
    do i = 1, size(surface%faces, 2)
      on_face(mesh%connectivity(face_nodes(:, surface%faces(2, i)), surface%faces(1, i))) = .true.
    end do
    n = count(.not. on_face(surface%nodes))
  end function count_without_face

  !> The faces of the bricks on one side of a block, and their nodes.
  subroutine fill_block_side(mesh, block, side, surface)
    type(mesh_draft_t), intent(in) :: mesh
    type(block_t), intent(in) :: block
    integer, intent(in) :: side
    type(surface_t), intent(inout) :: surface

    if (any(block%n == 0)) return
    surface%faces = block_face(block%n, side)
    surface%faces(1, :) = surface%faces(1, :) + block%first_element - 1
    call find_nodes(mesh, surface)
  end subroutine fill_block_side

  !> The nodes of the faces of a surface, ascending, each once.
  subroutine find_nodes(mesh, surface)
    type(mesh_draft_t), intent(in) :: mesh
    type(surface_t), intent(inout) :: surface
    integer :: i, n

    n = size(surface%faces, 2)
    if (allocated(surface%nodes)) deallocate (surface%nodes)
    allocate (surface%nodes(4*n))
    do i = 1, n
      surface%nodes(4*i - 3:4*i) = &
        mesh%connectivity(face_nodes(:, surface%faces(2, i)), surface%faces(1, i))
    end do
    call sort_unique(surface%nodes)
  end subroutine find_nodes

  !> *SURFACE, NAME=name[, TYPE=ELEMENT|NODE]
  subroutine read_surface(reader, model, card, surface, work, flawed, nodes)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(card_t), intent(in) :: card
    type(surface_t), intent(inout) :: surface
    integer(i8), intent(inout) :: work !! faces and nodes named so far
    logical, intent(inout) :: flawed   !! set where it names a set that is flawed
    logical, intent(out) :: nodes      !! it is made of nodes
    integer :: kind
    logical :: ok

    call allow_options(reader, card, ['NAME', 'TYPE'], ['INTERNAL'])
    kind = of_elements
    call choice_option(reader, card, 'TYPE', ['ELEMENT', 'NODE   '], kind, ok)
    nodes = kind == of_nodes
    if (nodes) then
      call read_node_surface(reader, model, card, surface, work, flawed)
    else
      call read_face_surface(reader, model, card, surface, work, flawed)
    end if
    if (work > max_work) call report(reader, card%position, 'the surfaces have too many faces')
  end subroutine read_surface

  !> Lines `element or set, S1..S6`.
  subroutine read_face_surface(reader, model, card, surface, work, flawed)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(card_t), intent(in) :: card
    type(surface_t), intent(inout) :: surface
    integer(i8), intent(inout) :: work
    logical, intent(inout) :: flawed
    type(fields_t) :: fields
    type(reference_t) :: reference
    integer, allocatable :: keys(:), elements(:)
    integer :: face, i, n
    logical :: found, ok

    allocate (keys(0))
    n = 0
    do
      call next_data_line(reader, card, fields, found, 2, &
        'an element or a set of elements, and one of S1..S6')
      if (.not. found) exit
      call reference_field(reader, fields, 1, 'an element or a set of elements', reference, ok)
      call read_face(reader, fields, face)
      if (.not. ok) cycle
      call referenced_elements(reader, model, reference, elements, flawed)
      if (face == 0) cycle
      work = work + size(elements)
      if (work > max_work) return
      ! One number a face, to sort by element and drop repetitions.
      call append(keys, n, 6*(elements - 1) + face)
    end do
    keys = keys(:n)
    call sort_unique(keys)
    deallocate (surface%faces)
    allocate (surface%faces(2, size(keys)))
    do i = 1, size(keys)
      surface%faces(:, i) = [(keys(i) - 1)/6 + 1, mod(keys(i) - 1, 6) + 1]
    end do
    call find_nodes(model%mesh, surface)
  end subroutine read_face_surface

  !> S1..S6 in the second field; 0 where it is something else.
  subroutine read_face(reader, fields, face)
    type(reader_t), intent(inout) :: reader
    type(fields_t), intent(in) :: fields
    integer, intent(out) :: face
    character(:), allocatable :: label

    face = 0
    label = field_text(reader, fields, 2)
    if (len(label) == 2) then
      if (upper(label(1:1)) == 'S') face = index('123456', label(2:2))
    end if
    if (face == 0) then
      if (is_empty_field(fields, 2)) then
        call report(reader, field_position(reader, fields, 2), 'expected a face, S1 to S6')
      else
        call report(reader, field_position(reader, fields, 2), &
          'expected a face, S1 to S6, found '//quoted(label))
      end if
    end if
  end subroutine read_face

  !> Lines `node or set`; an area behind it is ignored.
  subroutine read_node_surface(reader, model, card, surface, work, flawed)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(card_t), intent(in) :: card
    type(surface_t), intent(inout) :: surface
    integer(i8), intent(inout) :: work
    logical, intent(inout) :: flawed
    type(fields_t) :: fields
    type(reference_t) :: reference
    integer, allocatable :: nodes(:)
    integer :: n
    real(wp) :: area
    logical :: found, ok

    n = 0
    do
      call next_data_line(reader, card, fields, found, 2, &
        'a node or a set of nodes (and an area, which is ignored)')
      if (.not. found) exit
      call reference_field(reader, fields, 1, 'a node or a set of nodes', reference, ok)
      if (.not. is_empty_field(fields, 2)) then
        call real_field(reader, fields, 2, 'the area of a node', area, found)
        call note(reader, 'areas in *SURFACE, TYPE=NODE are ignored')
      end if
      if (.not. ok) cycle
      call referenced_nodes(reader, model, reference, nodes, flawed)
      work = work + size(nodes)
      if (work > max_work) return
      call append(surface%nodes, n, nodes)
    end do
    surface%nodes = surface%nodes(:n)
    call sort_unique(surface%nodes)
    call drop_unused(reader, model, surface)
  end subroutine read_node_surface

  !> Keep only the nodes that an element has: the others cannot touch anything.
  subroutine drop_unused(reader, model, surface)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(surface_t), intent(inout) :: surface
    integer, allocatable :: kept(:)

    allocate (kept(count(model%used(surface%nodes))))
    kept(:) = pack(surface%nodes, model%used(surface%nodes))
    if (size(kept) < size(surface%nodes)) call note(reader, 'surface '//quoted(surface%name)// &
      ': '//to_text(size(surface%nodes) - size(kept))//' of its nodes belong to no element')
    call move_alloc(kept, surface%nodes)
  end subroutine drop_unused

  !> The surface `name`: its index, 0 when there is none.
  pure function find_surface(surfaces, name) result(found)
    type(surface_list_t), intent(in) :: surfaces
    character(*), intent(in) :: name !! upper case
    integer :: found

    found = find_name(surfaces%lookup, surfaces%names, name)
  end function find_surface

  !> Make a surface of the nodes of a set, once; `index` is its index.
  subroutine add_node_surface(reader, model, set, surfaces, index)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    integer, intent(in) :: set  !! index into the sets of nodes
    type(surface_list_t), intent(inout) :: surfaces
    integer, intent(out) :: index

    index = surfaces%of_set(set)
    if (index > 0) return
    call add_unnamed(surfaces)
    index = surfaces%n
    surfaces%of_set(set) = index
    surfaces%of_nodes(index) = .true.
    surfaces%flawed(index) = model%node_sets%list(set)%flawed
    surfaces%list(index)%name = model%node_sets%names(set)%text
    surfaces%list(index)%nodes = model%node_sets%list(set)%members
    call drop_unused(reader, model, surfaces%list(index))
  end subroutine add_node_surface

  !> The surface `name`, or else the one of the nodes of the set `name`.
  subroutine find_surface_or_set(reader, model, position, name, surfaces, index)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    integer, intent(in) :: position
    character(*), intent(in) :: name
    type(surface_list_t), intent(inout) :: surfaces
    integer, intent(out) :: index !! 0: there is none
    integer :: set

    index = find_surface(surfaces, name)
    if (index > 0) return
    set = find_set(model%node_sets, name)
    if (set == 0) then
      call report_unknown_surface(reader, surfaces, position, name)
    else if (allocated(model%node_sets%list(set)%members)) then
      call add_node_surface(reader, model, set, surfaces, index)
    end if
  end subroutine find_surface_or_set

  subroutine report_unknown_surface(reader, surfaces, position, name)
    type(reader_t), intent(inout) :: reader
    type(surface_list_t), intent(in) :: surfaces
    integer, intent(in) :: position
    character(*), intent(in) :: name

    call report(reader, position, 'surface '//quoted(name)//' is not defined', &
      guess(name, surfaces%names(:surfaces%n_named)))
  end subroutine report_unknown_surface

end module read_surfaces_mod
