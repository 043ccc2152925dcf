!> The surfaces of a deck: found by name or made of a set of nodes where a card names one, their
!> faces and nodes found when something needs them.
module surface_list_mod
  use cards_mod, only: note, reader_t, report
  use cells_mod, only: cells
  use connectivity_mod, only: nodes_of_element
  use diagnostics_mod, only: guess, quoted
  use find_faces_mod, only: find_outer_faces
  use kinds_mod, only: i8
  use lookup_mod, only: find_name, name_lookup_t
  use mesh_draft_mod, only: has_label, is_line, labelled_faces, mesh_draft_t, solids
  use sets_mod, only: find_set, model_t
  use sorting_mod, only: sort_unique
  use surfaces_mod, only: all_nodes_of, bare_nodes, surface_t
  use text_mod, only: string_t, to_text
  implicit none
  private

  public :: surface_list_t, add_surface, add_faces, add_surface_of_faces, add_surface_of_sides
  public :: add_surface_of_node
  public :: check_side
  public :: find_nodes, drop_unused
  public :: find_surface, find_surface_or_set, find_faces_of_nodes, has_facets, sides_t

  !> Elements looked at to find the faces of nodes, for all surfaces together: likewise.
  integer(i8), parameter :: max_search = 1000000000

  !> Sides of facets of rigid bodies.
  type :: sides_t
    integer, allocatable :: facet(:, :)
    !! (2,n) index into the skipped elements, 1: SPOS or 2: SNEG; not allocated: none
  end type sides_t

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
    integer, allocatable :: faced(:)  !! of a surface of nodes the one of its faces alone; 0: none
    integer(i8) :: work = 0 !! elements looked at to find faces
    type(sides_t), allocatable :: sides(:)   !! of the first ones
    integer, allocatable :: obstacle(:)
    !! of the first ones: index of the obstacle that those of facets make; 0: none
  end type surface_list_t

contains

  !> Whether a surface consists of facets of a rigid body.
  pure logical function has_facets(surfaces, index)
    type(surface_list_t), intent(in) :: surfaces
    integer, intent(in) :: index

    has_facets = .false.
    if (index < 1 .or. .not. allocated(surfaces%sides)) return
    if (index <= size(surfaces%sides)) has_facets = allocated(surfaces%sides(index)%facet)
  end function has_facets

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
    surfaces%list(index)%faces = labelled_faces(mesh, elements, face)
    call find_nodes(mesh, surfaces%list(index))
  end subroutine add_surface_of_sides

  !> Add the surface of one node; `index` is its index.
  subroutine add_surface_of_node(surfaces, name, node, index)
    type(surface_list_t), intent(inout) :: surfaces
    character(*), intent(in) :: name
    integer, intent(in) :: node
    integer, intent(out) :: index

    call add_unnamed(surfaces)
    index = surfaces%n
    surfaces%list(index)%name = name
    surfaces%list(index)%nodes = [node]
  end subroutine add_surface_of_node

  !> Report an element that has no such face.
  subroutine check_side(reader, mesh, elements, face, position, ok)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(in) :: mesh
    integer, intent(in) :: elements(:)
    integer, intent(in) :: face      !! 1..6
    integer, intent(in) :: position  !! in the deck
    logical, intent(out) :: ok       !! all have it
    integer :: i

    do i = 1, size(elements)
      ok = has_label(mesh, elements(i), face)
      if (ok) then
        if (is_line(mesh, elements(i), face)) call note(reader, 'faces of elements that name a '// &
          'node twice are left out of surfaces and loads if they are lines (the first: '// &
          'element '//to_text(mesh%element_id(elements(i)))//')')
        cycle
      end if
      associate (cell => cells(mesh%connectivity%cell(elements(i))))
        if (mesh%plane /= solids) then
          call report(reader, position, 'element '//to_text(mesh%element_id(elements(i)))// &
            ' is a triangle: it has no edge '//to_text(face - 2))
          return
        end if
        call report(reader, position, 'element '//to_text(mesh%element_id(elements(i)))// &
          ' is a '//trim(cell%name)//': it has no face '//to_text(face))
        return
      end associate
    end do
    ok = .true.
  end subroutine check_side

  !> Add a surface of faces that no card names.
  subroutine add_faces(mesh, name, faces, surfaces, index)
    type(mesh_draft_t), intent(in) :: mesh
    character(*), intent(in) :: name     !! what messages and results call it
    integer, intent(in) :: faces(:, :)   !! (2,n_faces) element, face 1..6
    type(surface_list_t), intent(inout) :: surfaces
    integer, intent(out) :: index

    call add_unnamed(surfaces)
    index = surfaces%n
    surfaces%list(index)%name = name
    surfaces%list(index)%faces = faces
    call find_nodes(mesh, surfaces%list(index))
  end subroutine add_faces

  !> Add the surface of the faces that a surface of nodes has, once; `index` is its index.
  subroutine add_surface_of_faces(mesh, whole, surfaces, index)
    type(mesh_draft_t), intent(in) :: mesh
    integer, intent(in) :: whole         !! the surface of nodes
    type(surface_list_t), intent(inout) :: surfaces
    integer, intent(out) :: index
    character(:), allocatable :: name
    integer, allocatable :: longer(:), faces(:, :)
    integer :: of

    of = whole
    if (.not. allocated(surfaces%faced)) allocate (surfaces%faced(0))
    if (size(surfaces%faced) < of) then
      allocate (longer(of), source=0)
      longer(:size(surfaces%faced)) = surfaces%faced
      call move_alloc(longer, surfaces%faced)
    end if
    index = surfaces%faced(of)
    if (index > 0) return
    name = surfaces%list(of)%name
    faces = surfaces%list(of)%faces
    call add_faces(mesh, name, faces, surfaces, index)
    surfaces%faced(of) = index
  end subroutine add_surface_of_faces

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
    if (allocated(model%twins)) then
      ! Of a node that was doubled a set has only the one, and not the faces on the other side.
      n = findloc([(any(model%twins(2, :) == surfaces%list(index)%nodes(n)), n=1, &
        size(surfaces%list(index)%nodes))], .true., dim=1)
      if (n > 0) then
        call report(reader, 0, 'surface '//quoted(surfaces%list(index)%name)//' is made of '// &
          'nodes, of which node '//to_text(model%mesh%node_id(surfaces%list(index)%nodes(n)))// &
          ' is on a *PRE-TENSION SECTION', 'make it of faces: *SURFACE, TYPE=ELEMENT')
        return
      end if
    end if
    call find_outer_faces(model%mesh, surfaces%list(index)%nodes, faces)
    call move_alloc(faces, surfaces%list(index)%faces)
    call add_middles(reader, model, surfaces%list(index))
    n = size(bare_nodes(surfaces%list(index), model%mesh%connectivity, model%mesh%n_nodes))
    if (n > 0 .and. n < size(surfaces%list(index)%nodes)) call note(reader, 'surface '// &
      quoted(surfaces%list(index)%name)//': '//to_text(n)//' of its nodes are on no outer face '// &
      'that lies in it with all of its corners: they carry no area')
    call note_lone_middles(reader, model, surfaces%list(index))
  end subroutine find_faces_of_nodes

  !> Note mid-side nodes of a surface of nodes that has no corner of their edges.
  subroutine note_lone_middles(reader, model, surface)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(surface_t), intent(in) :: surface
    logical :: has(model%mesh%n_nodes), is_lone(model%mesh%n_nodes)
    integer :: e, i

    has = .false.
    has(surface%nodes) = .true.
    is_lone = .false.
    do e = 1, model%mesh%n_elements
      associate (cell => cells(model%mesh%connectivity%cell(e)), &
                 nodes => nodes_of_element(model%mesh%connectivity, e))
        do i = cell%n_corners + 1, cell%n_nodes
          is_lone(nodes(i)) = has(nodes(i)) .and. .not. any(has(nodes(cell%edge(:, i - &
            cell%n_corners))))
        end do
      end associate
    end do
    if (.not. any(is_lone)) return
    call note(reader, 'surface '//quoted(surface%name)//' has '//to_text(count(is_lone))// &
      ' mid-side nodes without the corners of their edges (the first: node '// &
      to_text(model%mesh%node_id(findloc(is_lone, .true., dim=1)))//'): these alone are in '// &
      'contact, without pressures, and the corners beside them may pass through the master; '// &
      'name the corners too, or make the surface of faces')
  end subroutine note_lone_middles

  !> Give a surface of nodes all mid-side nodes of the faces whose corners it has: without them a
  !> face has neither area nor contact between its corners.
  subroutine add_middles(reader, model, surface)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(surface_t), intent(inout) :: surface
    type(surface_t) :: of_faces
    logical :: has(model%mesh%n_nodes)
    integer, allocatable :: missing(:)

    of_faces%faces = surface%faces
    call find_nodes(model%mesh, of_faces)
    has = .false.
    has(surface%nodes) = .true.
    missing = pack(of_faces%nodes, .not. has(of_faces%nodes))
    if (size(missing) == 0) return
    call note(reader, 'surface '//quoted(surface%name)//' has all corners of faces without all '// &
      'of their mid-side nodes; added: '//to_text(size(missing))//' (the first: node '// &
      to_text(model%mesh%node_id(missing(1)))//')')
    surface%nodes = [surface%nodes, missing]
    call sort_unique(surface%nodes)
  end subroutine add_middles

  !> The nodes of the faces of a surface, ascending, each once.
  subroutine find_nodes(mesh, surface)
    type(mesh_draft_t), intent(in) :: mesh
    type(surface_t), intent(inout) :: surface
    integer, allocatable :: faces(:, :)

    faces = all_nodes_of(surface%faces, mesh%connectivity)
    if (allocated(surface%nodes)) deallocate (surface%nodes)
    allocate (surface%nodes, source=pack(faces, faces > 0))
    call sort_unique(surface%nodes)
  end subroutine find_nodes

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
  pure integer function find_surface(surfaces, name) result(found)
    type(surface_list_t), intent(in) :: surfaces
    character(*), intent(in) :: name !! upper case

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
      call report(reader, position, 'surface '//quoted(name)//' is not defined', &
        guess(name, surfaces%names(:surfaces%n_named)))
    else if (allocated(model%node_sets%list(set)%members)) then
      call add_node_surface(reader, model, set, surfaces, index)
    end if
  end subroutine find_surface_or_set

end module surface_list_mod
