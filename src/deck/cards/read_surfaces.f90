!> The cards of named surfaces.
!>
!>     *SURFACE, NAME=BOTTOM, TYPE=ELEMENT
!>     SKIN, S1                      a set of elements (or one element) and one of its faces
!>     *SURFACE, NAME=TIP, TYPE=NODE
!>     17                            nodes, or sets of nodes
!>     *SURFACE, NAME=DIE
!>     TOOL, SPOS                    facets of a rigid body and their side
!>
!> Every *BLOCK brings the surfaces of its six sides.
module read_surfaces_mod
  use read_analytical_mod, only: is_analytical
  use block_mesh_mod, only: block_face, face_zmax
  use cards_mod, only: note, reader_t, report
  use diagnostics_mod, only: quoted
  use fields_mod, only: any_number, field_position, field_text, fields_t, is_empty_field, &
    name_field, next_data_line, real_field, reference_field, reference_t
  use growing_lists_mod, only: append
  use kinds_mod, only: i8, wp
  use lookup_mod, only: find_id, make_name_lookup
  use matching_faces_mod, only: outer_faces
  use mesh_draft_mod, only: block_t, face_of_label, labelled_faces, mesh_draft_t, refined_faces, &
    solids
  use options_mod, only: allow_options, card_t, choice_option, has_option, name_option, &
    open_card
  use read_block_mod, only: side_name
  use sets_mod, only: find_set, model_t, referenced_elements, referenced_nodes
  use sorting_mod, only: sort_unique
  use surface_list_mod, only: add_surface, check_side, drop_unused, find_nodes, &
    find_surface, sides_t, surface_list_t
  use surfaces_mod, only: surface_t
  use text_mod, only: string_t, to_text, upper
  implicit none
  private

  public :: read_surfaces

  integer, parameter :: of_elements = 1, of_nodes = 2
  integer, parameter :: spos = 7, sneg = 8 !! sides of facets, behind the faces of solid elements

  !> Faces and nodes named by all surfaces of a deck together: more than any real deck needs.
  integer(i8), parameter :: max_work = 200000000

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
    allocate (surfaces%flawed(most), surfaces%sides(most))
    allocate (surfaces%obstacle(most), source=0)
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
      if (is_analytical(reader, k)) cycle
      call open_card(reader, k, card)
      call name_option(reader, card, 'NAME', .true., name, ok)
      if (.not. ok) cycle
      call add_surface(surfaces, name)
      position(surfaces%n) = card%position
      before = reader%diagnostics%n_mistakes
      flawed = .false.
      call read_surface(reader, model, card, surfaces, work, flawed)
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

  !> The faces of the elements on one side of a block, and their nodes.
  subroutine fill_block_side(mesh, block, side, surface)
    type(mesh_draft_t), intent(in) :: mesh
    type(block_t), intent(in) :: block
    integer, intent(in) :: side
    type(surface_t), intent(inout) :: surface
    integer, allocatable :: faces(:, :)

    if (any(block%n == 0)) return
    faces = block_face(block%n, side)
    faces(1, :) = faces(1, :) + block%first_element - 1
    surface%faces = refined_faces(mesh, faces)
    call find_nodes(mesh, surface)
  end subroutine fill_block_side

  !> *SURFACE, NAME=name[, TYPE=ELEMENT|NODE][, COMBINE=UNION]: the last of the list.
  subroutine read_surface(reader, model, card, surfaces, work, flawed)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(card_t), intent(in) :: card
    type(surface_list_t), intent(inout) :: surfaces
    integer(i8), intent(inout) :: work !! faces and nodes named so far
    logical, intent(inout) :: flawed   !! set where it names a set that is flawed
    integer :: kind
    logical :: ok

    call allow_options(reader, card)
    kind = of_elements
    call choice_option(reader, card, 'TYPE', kind, ok)
    associate (surface => surfaces%list(surfaces%n), nodes => surfaces%of_nodes(surfaces%n))
      nodes = kind == of_nodes .and. .not. has_option(card, 'COMBINE')
      if (has_option(card, 'COMBINE')) then
        call choice_option(reader, card, 'COMBINE', kind, ok)
        if (ok) call join_surfaces(reader, model, card, surfaces, work, flawed)
      else if (nodes) then
        call read_node_surface(reader, model, card, surface, work, flawed)
      else
        call read_face_surface(reader, model, card, surface, work, flawed, &
          surfaces%sides(surfaces%n), surfaces%names(:surfaces%n))
      end if
    end associate
    if (work > max_work) call report(reader, card%position, 'the surfaces have too many faces')
  end subroutine read_surface

  !> COMBINE=UNION: the faces of the surfaces that are named, which stand above.
  subroutine join_surfaces(reader, model, card, surfaces, work, flawed)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(card_t), intent(in) :: card
    type(surface_list_t), intent(inout) :: surfaces
    integer(i8), intent(inout) :: work
    logical, intent(inout) :: flawed
    type(fields_t) :: fields
    character(:), allocatable :: name
    integer, allocatable :: keys(:)
    integer :: i, k, n
    logical :: found, ok

    allocate (keys(0))
    n = 0
    do
      call next_data_line(reader, card, fields, found, any_number, 'surfaces')
      if (.not. found) exit
      do i = 1, fields%n
        if (is_empty_field(fields, i)) cycle
        call name_field(reader, fields, i, 'a surface', name, ok)
        if (.not. ok) return
        do k = surfaces%n - 1, 1, -1
          if (surfaces%names(k)%text == name) exit
        end do
        if (k == 0) then
          call report(reader, field_position(reader, fields, i), 'surface '//quoted(name)// &
            ' is not defined above')
        else if (surfaces%of_nodes(k) .or. allocated(surfaces%sides(k)%facet)) then
          call report(reader, field_position(reader, fields, i), 'surface '//quoted(name)// &
            ' is not of faces of solid elements: only these are joined')
        else
          flawed = flawed .or. surfaces%flawed(k)
          associate (faces => surfaces%list(k)%faces)
            work = work + size(faces, 2)
            if (work > max_work) return
            call append(keys, n, 6*(faces(1, :) - 1) + faces(2, :))
          end associate
        end if
      end do
    end do
    call set_faces(model, keys(:n), surfaces%list(surfaces%n))
  end subroutine join_surfaces

  !> Make a surface of faces, given as one number each.
  subroutine set_faces(model, keys, surface)
    type(model_t), intent(in) :: model
    integer, intent(in) :: keys(:) !! 6 (element - 1) + face, in any order
    type(surface_t), intent(inout) :: surface
    integer, allocatable :: sorted(:)
    integer :: i

    sorted = keys
    call sort_unique(sorted)
    deallocate (surface%faces)
    allocate (surface%faces(2, size(sorted)))
    do i = 1, size(sorted)
      surface%faces(:, i) = [(sorted(i) - 1)/6 + 1, mod(sorted(i) - 1, 6) + 1]
    end do
    call find_nodes(model%mesh, surface)
  end subroutine set_faces

  !> Lines `element or set, S1..S6`, or `SPOS|SNEG` where they are facets.
  subroutine read_face_surface(reader, model, card, surface, work, flawed, sides, above)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(card_t), intent(in) :: card
    type(surface_t), intent(inout) :: surface
    integer(i8), intent(inout) :: work
    logical, intent(inout) :: flawed
    type(sides_t), intent(inout) :: sides
    type(string_t), intent(in) :: above(:) !! names of the surfaces up to this one
    type(fields_t) :: fields
    type(reference_t) :: reference
    integer, allocatable :: keys(:), elements(:), facets(:), labels(:)
    logical, allocatable :: is_outer(:, :)
    integer :: face, i, n, n_facets
    logical :: found, ok

    allocate (keys(0), facets(0))
    n = 0
    n_facets = 0
    do
      call next_data_line(reader, card, fields, found, 2, &
        'an element or a set of elements, and one of S1..S6, SPOS, SNEG')
      if (.not. found) exit
      call reference_field(reader, fields, 1, 'an element or a set of elements', reference, ok)
      if (ok .and. is_empty_field(fields, 2)) call refuse_surface(reader, model, above, reference, &
        flawed, ok)
      if (is_empty_field(fields, 2)) then
        if (.not. ok) cycle
        call referenced_elements(reader, model, reference, elements, flawed)
        if (.not. allocated(is_outer)) is_outer = outer_faces(model%mesh)
        labels = [(face, face=1, 6)]
        ! Not those across the thickness of a plane.
        if (model%mesh%plane /= solids) labels = [(face_of_label(model%mesh, face), face=1, 4)]
        do i = 1, size(elements)
          call append(keys, n, pack(6*(elements(i) - 1) + labels, is_outer(labels, elements(i))))
        end do
        work = work + size(elements)
        if (work > max_work) return
        cycle
      end if
      call read_face(reader, fields, model%mesh%plane /= solids, face)
      if (face > 0 .and. face < spos) face = face_of_label(model%mesh, face)
      if (.not. ok) cycle
      call referenced_elements(reader, model, reference, elements, flawed)
      if (face == 0) cycle
      if (face >= spos) then
        call add_facets(reader, model, reference, elements, face - spos + 1, facets, n_facets)
        work = work + n_facets
        if (work > max_work) return
        cycle
      end if
      call check_side(reader, model%mesh, elements, face, field_position(reader, fields, 2), ok)
      if (.not. ok) cycle
      work = work + size(elements)
      if (work > max_work) return
      ! One number a face, to sort by element and drop repetitions.
      associate (faces => labelled_faces(model%mesh, elements, face))
        call append(keys, n, 6*(faces(1, :) - 1) + faces(2, :))
      end associate
    end do
    if (n_facets > 0) then
      if (n > 0) call report(reader, card%position, 'a surface has faces of solid elements '// &
        '(S1 to S6) or sides of facets (SPOS, SNEG), not both')
      facets = facets(:n_facets)
      call sort_unique(facets)
      allocate (sides%facet(2, size(facets)))
      sides%facet(1, :) = (facets - 1)/2 + 1
      sides%facet(2, :) = mod(facets - 1, 2) + 1
    end if
    call set_faces(model, keys(:n), surface)
  end subroutine read_face_surface

  !> Report a line that names a surface, and no set of elements.
  subroutine refuse_surface(reader, model, above, reference, flawed, ok)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(string_t), intent(in) :: above(:)   !! names of surfaces
    type(reference_t), intent(in) :: reference
    logical, intent(inout) :: flawed, ok     !! set, and false, where it does
    integer :: k

    if (reference%id > 0) return
    if (find_set(model%element_sets, reference%name) > 0) return
    if (.not. any([(above(k)%text == reference%name, k=1, size(above))])) return
    call report(reader, reference%position, quoted(reference%name)//' is a surface: the line '// &
      'has an element or a set of elements', 'COMBINE=UNION of *SURFACE joins surfaces')
    flawed = .true.
    ok = .false.
  end subroutine refuse_surface

  !> The facets that a reference means, as one number a side.
  subroutine add_facets(reader, model, reference, elements, side, keys, n)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(reference_t), intent(in) :: reference
    integer, intent(in) :: elements(:)  !! that it means, too
    integer, intent(in) :: side       !! 1: SPOS, 2: SNEG
    integer, allocatable, intent(inout) :: keys(:)
    integer, intent(inout) :: n
    integer, allocatable :: found(:)
    integer :: set

    if (size(elements) > 0) then
      call report(reader, reference%position, 'solid elements have no sides SPOS and SNEG, '// &
        'which are of facets: element '//to_text(model%mesh%element_id(elements(1)))//' is solid')
      return
    end if
    allocate (found(0))
    if (reference%id > 0) then
      set = find_id(model%mesh%skipped, model%mesh%skipped_id, reference%id)
      if (set > 0) found = [set]
    else
      set = find_set(model%element_sets, reference%name)
      if (set > 0) then
        associate (of_set => model%element_sets%list(set))
          if (of_set%n_skipped > 0) found = of_set%skipped(:of_set%n_skipped)
        end associate
      end if
    end if
    call append(keys, n, 2*(found - 1) + side)
  end subroutine add_facets

  !> S1..S6, SPOS or SNEG in the second field; 0 where it is something else.
  subroutine read_face(reader, fields, of_plane, face)
    type(reader_t), intent(inout) :: reader
    type(fields_t), intent(in) :: fields
    logical, intent(in) :: of_plane !! elements have edges in the place of faces
    integer, intent(out) :: face
    character(:), allocatable :: label

    face = 0
    label = field_text(reader, fields, 2)
    if (len(label) == 2) then
      if (upper(label(1:1)) == 'S') face = index('123456', label(2:2))
    end if
    if (of_plane .and. face > 4) then
      call report(reader, field_position(reader, fields, 2), 'elements of a plane have the '// &
        'edges S1 to S4')
      face = 0
      return
    end if
    if (upper(label) == 'SPOS') face = spos
    if (upper(label) == 'SNEG') face = sneg
    if (face == 0) then
      if (is_empty_field(fields, 2)) then
        call report(reader, field_position(reader, fields, 2), &
          'expected a face, S1 to S6, SPOS or SNEG')
      else
        call report(reader, field_position(reader, fields, 2), &
          'expected a face, S1 to S6, SPOS or SNEG, found '//quoted(label))
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

end module read_surfaces_mod
