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
  use fields_mod, only: field_position, field_text, fields_t, is_empty_field, limit_fields, &
    next_data_line, real_field, reference_field, reference_t
  use kinds_mod, only: i8, wp
  use lookup_mod, only: find_id, find_name, make_name_lookup, name_lookup_t, sort_unique
  use mesh_draft_mod, only: block_t, mesh_draft_t
  use options_mod, only: allow_options, card_t, choice_option, name_option, open_card
  use read_block_mod, only: side_name
  use sets_mod, only: find_set, model_t, referenced_nodes, report_unknown
  use surfaces_mod, only: face_nodes, surface_t
  use text_mod, only: string_t, to_text, upper
  implicit none
  private

  public :: surface_list_t, read_surfaces, find_surface, add_node_surface, report_unknown_surface

  integer, parameter :: of_elements = 1, of_nodes = 2

  !> Faces and nodes named by all surfaces of a deck together: more than any real deck needs.
  integer(i8), parameter :: max_work = 200000000

  !> All surfaces. There may be more room in the arrays than surfaces.
  type :: surface_list_t
    type(surface_t), allocatable :: list(:)
    type(string_t), allocatable :: names(:)
    integer :: n = 0
    integer :: n_named = 0 !! the first ones: from *BLOCK and *SURFACE, found by name
    type(name_lookup_t) :: lookup
    logical, allocatable :: flawed(:) !! nodes are missing because of mistakes
    integer, allocatable :: of_set(:) !! for each set of nodes its surface; 0: none
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
    allocate (surfaces%names(most), position(most))
    ! A contact pair may make one more of a set of nodes.
    allocate (surfaces%list(most + count(reader%cards(:reader%n_cards)%keyword == 'CONTACT PAIR')))
    allocate (surfaces%flawed(size(surfaces%list)))
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
      call read_surface(reader, model, card, surfaces%list(surfaces%n), work, flawed)
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

    surfaces%n = surfaces%n + 1
    surfaces%names(surfaces%n)%text = name
    surfaces%list(surfaces%n)%name = name
    allocate (surfaces%list(surfaces%n)%faces(2, 0), surfaces%list(surfaces%n)%nodes(0))
  end subroutine add_surface

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
  subroutine read_surface(reader, model, card, surface, work, flawed)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(card_t), intent(in) :: card
    type(surface_t), intent(inout) :: surface
    integer(i8), intent(inout) :: work !! faces and nodes named so far
    logical, intent(inout) :: flawed   !! set where it names a set that is flawed
    integer :: kind
    logical :: ok

    call allow_options(reader, card, ['NAME', 'TYPE'], ['INTERNAL'])
    kind = of_elements
    call choice_option(reader, card, 'TYPE', ['ELEMENT', 'NODE   '], kind, ok)
    if (kind == of_nodes) then
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
      call next_data_line(reader, card, fields, found)
      if (.not. found) exit
      call limit_fields(reader, fields, 2, 'an element or a set of elements, and one of S1..S6')
      call reference_field(reader, fields, 1, 'an element or a set of elements', reference, ok)
      call read_face(reader, fields, face)
      if (.not. ok) cycle
      call referenced_elements(reader, model, reference, elements, flawed)
      if (face == 0) cycle
      work = work + size(elements)
      if (work > max_work) return
      call make_room(keys, n, size(elements))
      ! One number a face, to sort by element and drop repetitions.
      do i = 1, size(elements)
        keys(n + i) = 6*(elements(i) - 1) + face
      end do
      n = n + size(elements)
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

  subroutine make_room(list, n, more)
    integer, allocatable, intent(inout) :: list(:)
    integer, intent(in) :: n, more
    integer, allocatable :: larger(:)

    if (n + more <= size(list)) return
    allocate (larger(max(n + more, 2*size(list))))
    larger(:n) = list(:n)
    call move_alloc(larger, list)
  end subroutine make_room

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

  !> The numbers of the elements that a reference means; a mistake is reported where it means none.
  subroutine referenced_elements(reader, model, reference, elements, flawed)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(reference_t), intent(in) :: reference
    integer, allocatable, intent(out) :: elements(:)
    logical, intent(inout) :: flawed !! set where the set is flawed
    integer :: found

    if (reference%id > 0) then
      found = find_id(model%mesh%elements, model%mesh%element_id, reference%id)
      if (found > 0) then
        elements = [found]
      else if (find_id(model%mesh%skipped, model%mesh%skipped_id, reference%id) == 0) then
        call report(reader, reference%position, 'element '//to_text(reference%id)// &
          ' is not defined')
      end if
    else
      found = find_set(model%element_sets, reference%name)
      if (found == 0) call report_unknown(reader, model%element_sets, reference%position, &
        reference%name)
      if (found > 0) then
        if (model%element_sets%list(found)%flawed) flawed = .true.
        if (allocated(model%element_sets%list(found)%members)) then
          elements = model%element_sets%list(found)%members
        end if
      end if
    end if
    if (.not. allocated(elements)) allocate (elements(0))
  end subroutine referenced_elements

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
      call next_data_line(reader, card, fields, found)
      if (.not. found) exit
      call limit_fields(reader, fields, 2, 'a node or a set of nodes')
      call reference_field(reader, fields, 1, 'a node or a set of nodes', reference, ok)
      if (.not. is_empty_field(fields, 2)) then
        call real_field(reader, fields, 2, 'the area of a node', area, found)
        call note(reader, 'areas in *SURFACE, TYPE=NODE are ignored')
      end if
      if (.not. ok) cycle
      call referenced_nodes(reader, model, reference, nodes, flawed)
      work = work + size(nodes)
      if (work > max_work) return
      call make_room(surface%nodes, n, size(nodes))
      surface%nodes(n + 1:n + size(nodes)) = nodes
      n = n + size(nodes)
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
    surfaces%n = surfaces%n + 1
    index = surfaces%n
    surfaces%of_set(set) = index
    surfaces%flawed(index) = model%node_sets%list(set)%flawed
    surfaces%list(index)%name = model%node_sets%names(set)%text
    allocate (surfaces%list(index)%faces(2, 0))
    surfaces%list(index)%nodes = model%node_sets%list(set)%members
    call drop_unused(reader, model, surfaces%list(index))
  end subroutine add_node_surface

  subroutine report_unknown_surface(reader, surfaces, position, name)
    type(reader_t), intent(inout) :: reader
    type(surface_list_t), intent(in) :: surfaces
    integer, intent(in) :: position
    character(*), intent(in) :: name

    call report(reader, position, 'surface '//quoted(name)//' is not defined', &
      guess(name, surfaces%names(:surfaces%n_named)))
  end subroutine report_unknown_surface

end module read_surfaces_mod
