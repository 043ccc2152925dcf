!> Nodes and elements while they are read, by the deck's ids, growing as needed.
module mesh_draft_mod
  use growing_lists_mod, only: append, enlarge
  use kinds_mod, only: i8, wp
  use cells_mod, only: cells
  use collapsed_cells_mod, only: no_area
  use connectivity_mod, only: add_elements, connectivity_t
  use mesh_size_mod, only: blocks_t
  use lookup_mod, only: find_id, id_lookup_t
  use resource_limits_mod, only: has_memory
  use numbers_mod, only: largest_number
  use mesh_mod, only: solids, plane_strain, plane_stress, axisymmetric
  implicit none
  private

  public :: mesh_draft_t, block_t, early_set_t, reserve_nodes, add_node_beside, reserve_elements
  public :: add_node, add_element, add_early_set, add_skipped, add_skipped_node, add_block
  public :: max_nodes, not_a_coordinate
  public :: is_of_block, find_elements, has_label, is_line, labelled_faces, refined_faces, &
    given_nodes
  public :: solids, plane_strain, plane_stress, axisymmetric, names_of_planes, &
    with_copies, nodes_of_plane, face_of_label
  public :: set_of_nodes, set_of_elements, no_facet, shell_facet, rigid_facet, refused_element, &
    spring_1, spring_2, spring_a, gap_uni, is_spring, is_connector

  !> More nodes or elements are refused: far beyond what a direct solver can do.
  integer, parameter :: max_nodes = 20000000
  ! What a node and an element take, with the list that is being replaced. [byte]
  integer(i8), parameter :: bytes_of_node = 64_i8, bytes_of_element = 88_i8

  !> In the place of a coordinate that could not be read.
  real(wp), parameter :: not_a_coordinate = 2.0_wp*largest_number

  integer, parameter :: set_of_nodes = 1, set_of_elements = 2

  !> The types of plane strain, plane stress and axisymmetric elements begin so.
  character(3), parameter :: names_of_planes(3) = ['CPE', 'CPS', 'CAX']

  ! What a rigid body may make of an element that is skipped else: nothing, a facet of a type that
  ! other programs compute, or of one that is rigid by itself.
  integer, parameter :: no_facet = 0, shell_facet = 1, rigid_facet = 2
  integer, parameter :: refused_element = 3 !! its type is not available, which was reported
  integer, parameter :: spring_1 = 4, spring_2 = 5, spring_a = 6, gap_uni = 7

  !> A set that *NODE, *ELEMENT or *BLOCK makes beside its nodes or elements.
  type :: early_set_t
    character(:), allocatable :: name
    integer :: kind = set_of_nodes
    integer :: position = 0
    integer :: first = 1   !! first member (node or element number)
    integer :: last = 0    !! last member
    integer :: skipped(2) = [1, 0] !! first and last skipped element
    integer :: block = 0   !! > 0: the nodes on a side of this block instead
    integer :: side = 0    !! face_xmin .. face_zmax
    logical :: flawed = .false. !! members are missing because of mistakes
  end type early_set_t

  !> A *BLOCK.
  type :: block_t
    character(:), allocatable :: name
    integer :: position = 0
    integer :: n(3) = 1           !! elements along x, y, z
    integer :: first_node = 1     !! number of its first node
    integer :: first_element = 1  !! number of its first element
  end type block_t

  !> The mesh as far as it was read. Arrays may be longer than what counts.
  type :: mesh_draft_t
    integer :: n_nodes = 0
    integer,  allocatable :: node_id(:)
    integer,  allocatable :: node_position(:)    !! place in the deck
    real(wp), allocatable :: coordinates(:, :)   !! from `origin` [length]
    real(wp) :: origin(3) = 0.0_wp               !! in the deck [length]
    integer :: highest_node = 0                  !! highest id so far
    integer :: n_stand_ins = 0                   !! the last so many stand in for local directions
    integer :: n_elements = 0
    integer, allocatable :: element_id(:)        !! of a refined element that of the deck's
    integer, allocatable :: element_position(:)
    integer, allocatable :: element_kind(:)      !! kind_c3d8 and its kin
    type(connectivity_t) :: connectivity         !! ids, later numbers, of nodes
    integer :: highest_element = 0
    logical :: taken_out = .false.
    !! elements seem to have been taken out of the deck: what names them is not a mistake
    logical :: empty_card = .false.
    !! an *ELEMENT card without data says so: what loads their nodes is not a mistake either
    integer :: n_skipped = 0
    integer, allocatable :: skipped_id(:)        !! elements that are no solids
    integer, allocatable :: skipped_position(:)
    integer, allocatable :: skipped_kind(:)      !! (n_skipped) no_facet, spring_1 and their kin
    integer, allocatable :: skipped_corners(:)   !! (n_skipped) that a facet must have, else 0
    integer, allocatable :: skipped_first(:)     !! (n_skipped) where its nodes begin below
    integer, allocatable :: skipped_nodes(:)     !! ids of their nodes, for *NSET, ELSET=
    integer :: n_skipped_nodes = 0
    type(block_t), allocatable :: blocks(:)
    integer :: n_blocks = 0
    type(blocks_t) :: counts(3) !! NX, NY and NZ of the deck's blocks
    integer :: scale(2) = 1
    !! each has scale(1)/scale(2) times the elements along each axis that the deck says
    integer :: across = 0 !! but for this axis, as of mesh_size_t
    type(early_set_t), allocatable :: sets(:)
    integer :: n_sets = 0
    type(id_lookup_t) :: nodes, elements, skipped !! made when all are read
    ! Where some are wedges, pyramids or tetrahedra that the deck writes as other cells:
    integer, allocatable :: collapsed(:)     !! (n_elements) column of the list below; 0: others
    integer, allocatable :: faces_of(:, :)
    !! (6,:) the face that each of the written cell is, no_area, or -1: this has no such face
    ! Where they are elements of a plane, which are expanded to solids one element thick:
    integer :: plane = solids                !! or plane_strain and its kin
    real(wp) :: sector_angle = 0.0_wp        !! as of mesh_t
    real(wp) :: parts = 1.0_wp               !! likewise
    real(wp) :: thickness(2) = 1.0_wp        !! likewise
    logical :: is_thickness_given = .false.  !! likewise
    logical, allocatable :: on_axis(:)       !! (nodes of the plane) of axisymmetric elements
    integer, allocatable :: copies(:, :)
    !! (2,nodes of the plane) the node opposite and the one between; 0: none; not allocated: solids
    ! Where elements are refined:
    integer, allocatable :: first_piece(:)
    !! (n+1) of each element of the deck; its pieces follow each other
    integer, allocatable :: piece_id(:)          !! (n_elements) ids of pieces
    integer :: n_given = 0                       !! nodes of the deck
    integer, allocatable :: given_id(:)          !! ids of the deck's elements
    integer, allocatable :: between(:, :)        !! as of mesh_t
    real(wp), allocatable :: place(:, :)         !! likewise
    logical, allocatable :: hangs(:)             !! likewise
    logical, allocatable :: outer(:, :)
    !! (6,n_elements) whether a face is a part of that face of the deck's element
    logical, allocatable :: outside(:, :)
    !! (6,n_elements) whether it is, of a face that no other element of the deck has
    ! When surfaces are read:
    integer, allocatable :: skin(:, :)           !! as of mesh_t
    integer, allocatable :: piece(:)             !! likewise
  end type mesh_draft_t

contains

  !> Make room for `more` further nodes; `ok` is false when there is no memory for them.
  subroutine reserve_nodes(draft, more, ok)
    type(mesh_draft_t), intent(inout) :: draft
    integer, intent(in) :: more
    logical, intent(out) :: ok
    integer :: have, want

    if (.not. allocated(draft%node_id)) allocate (draft%node_id(0), draft%node_position(0), &
      draft%coordinates(3, 0))
    have = size(draft%node_id)
    ok = draft%n_nodes + int(more, i8) <= have
    if (ok) return
    want = new_size(have, draft%n_nodes, more)
    ok = want > 0
    if (ok) ok = has_memory(bytes_of_node*want)
    if (.not. ok) return
    call enlarge(draft%node_id, draft%n_nodes, want)
    call enlarge(draft%node_position, draft%n_nodes, want)
    call enlarge(draft%coordinates, draft%n_nodes, want)
  end subroutine reserve_nodes

  !> One more node, for which there is room.
  subroutine add_node(draft, id, x, position)
    type(mesh_draft_t), intent(inout) :: draft
    integer, intent(in) :: id
    real(wp), intent(in) :: x(3)
    integer, intent(in) :: position !! in the deck

    draft%n_nodes = draft%n_nodes + 1
    draft%node_id(draft%n_nodes) = id
    draft%node_position(draft%n_nodes) = position
    draft%coordinates(:, draft%n_nodes) = x
    draft%highest_node = max(draft%highest_node, id)
  end subroutine add_node

  !> One more element, for which there is room.
  subroutine add_element(draft, id, kind, cell, nodes, position)
    type(mesh_draft_t), intent(inout) :: draft
    integer, intent(in) :: id
    integer, intent(in) :: kind     !! kind_c3d8 and its kin
    integer, intent(in) :: cell     !! row of the table of cells
    integer, intent(in) :: nodes(:) !! ids
    integer, intent(in) :: position !! in the deck

    call add_elements(draft%connectivity, draft%n_elements, cell, reshape(nodes, [size(nodes), 1]))
    draft%n_elements = draft%n_elements + 1
    draft%element_id(draft%n_elements) = id
    draft%element_kind(draft%n_elements) = kind
    draft%element_position(draft%n_elements) = position
    draft%highest_element = max(draft%highest_element, id)
  end subroutine add_element

  !> One more node, behind all others, in the place of one that is there; `ok` is false when there
  !> is no room for it.
  subroutine add_node_beside(draft, node, position, ok)
    type(mesh_draft_t), intent(inout) :: draft
    integer, intent(in) :: node
    integer, intent(in) :: position !! of the card that needs it
    logical, intent(out) :: ok

    call reserve_nodes(draft, 1, ok)
    if (ok) ok = draft%highest_node < huge(draft%highest_node)
    if (.not. ok) return
    draft%highest_node = draft%highest_node + 1
    draft%n_nodes = draft%n_nodes + 1
    draft%node_id(draft%n_nodes) = draft%highest_node
    draft%node_position(draft%n_nodes) = position
    draft%coordinates(:, draft%n_nodes) = draft%coordinates(:, node)
  end subroutine add_node_beside

  !> Make room for `more` further elements; `ok` is false when there is no memory for them.
  subroutine reserve_elements(draft, more, ok)
    type(mesh_draft_t), intent(inout) :: draft
    integer, intent(in) :: more
    logical, intent(out) :: ok
    integer :: have, want

    if (.not. allocated(draft%element_id)) allocate (draft%element_id(0), &
      draft%element_position(0), draft%element_kind(0))
    have = size(draft%element_id)
    ok = draft%n_elements + int(more, i8) <= have
    if (ok) return
    want = new_size(have, draft%n_elements, more)
    ok = want > 0
    if (ok) ok = has_memory(bytes_of_element*want)
    if (.not. ok) return
    call enlarge(draft%element_id, draft%n_elements, want)
    call enlarge(draft%element_position, draft%n_elements, want)
    call enlarge(draft%element_kind, draft%n_elements, want)
  end subroutine reserve_elements

  !> Whether a node, by its number, is one of a block.
  pure logical function is_of_block(draft, node)
    type(mesh_draft_t), intent(in) :: draft
    integer, intent(in) :: node
    integer :: i

    is_of_block = .false.
    do i = 1, draft%n_blocks
      associate (block => draft%blocks(i))
        is_of_block = is_of_block .or. (node >= block%first_node .and. &
          node < block%first_node + product(block%n + 1))
      end associate
    end do
  end function is_of_block

  !> The elements that an id of the deck means; none where it is not one of an element.
  pure function find_elements(draft, id) result(elements)
    type(mesh_draft_t), intent(in) :: draft
    integer, intent(in) :: id
    integer, allocatable :: elements(:)
    integer :: found

    if (allocated(draft%given_id)) then
      found = find_id(draft%elements, draft%given_id, id)
    else
      found = find_id(draft%elements, draft%element_id, id)
    end if
    elements = [integer ::]
    if (found > 0) elements = pieces_of(draft, found)
  end function find_elements

  !> The elements that an element of the deck was cut into.
  pure function pieces_of(draft, element) result(pieces)
    type(mesh_draft_t), intent(in) :: draft
    integer, intent(in) :: element
    integer, allocatable :: pieces(:)
    integer :: i

    pieces = [element]
    if (allocated(draft%first_piece)) pieces = [(i, i=draft%first_piece(element), &
      draft%first_piece(element + 1) - 1)]
  end function pieces_of

  !> Nodes, and behind them those that an element of a plane has beside them.
  pure function with_copies(draft, nodes) result(all_nodes)
    type(mesh_draft_t), intent(in) :: draft
    integer, intent(in) :: nodes(:)
    integer, allocatable :: all_nodes(:)

    all_nodes = nodes
    if (.not. allocated(draft%copies)) return
    associate (of_plane => pack(nodes, nodes <= size(draft%copies, 2)))
      associate (more => reshape(draft%copies(:, of_plane), [2*size(of_plane)]))
        all_nodes = [nodes, pack(more, more > 0)]
      end associate
    end associate
  end function with_copies

  !> The face that a deck means by the number of a face, of elements of a plane by that of an edge:
  !> their faces 1 and 2 are the cross-sections.
  pure integer function face_of_label(draft, label) result(face)
    type(mesh_draft_t), intent(in) :: draft
    integer, intent(in) :: label !! 1 to 6

    face = label
    if (draft%plane /= solids) face = label + 2
  end function face_of_label

  !> Whether the element that the deck writes has a face.
  pure logical function has_label(draft, element, label)
    type(mesh_draft_t), intent(in) :: draft
    integer, intent(in) :: element
    integer, intent(in) :: label   !! as of face_of_label

    has_label = label <= cells(draft%connectivity%cell(element))%n_faces
    if (.not. allocated(draft%collapsed)) return
    if (draft%collapsed(element) > 0) has_label = &
      draft%faces_of(label, draft%collapsed(element)) >= no_area
  end function has_label

  !> Whether a face that an element has is a line or a point, as nodes of it are one.
  pure logical function is_line(draft, element, label)
    type(mesh_draft_t), intent(in) :: draft
    integer, intent(in) :: element
    integer, intent(in) :: label   !! as of face_of_label

    is_line = .false.
    if (.not. allocated(draft%collapsed)) return
    if (draft%collapsed(element) > 0) is_line = draft%faces_of(label, draft%collapsed(element)) &
      == no_area
  end function is_line

  !> The faces of elements that a face of the elements of the deck consists of.
  pure function labelled_faces(draft, elements, label) result(faces)
    type(mesh_draft_t), intent(in) :: draft
    integer, intent(in) :: elements(:)
    integer, intent(in) :: label       !! as of face_of_label, which all of them have
    integer, allocatable :: faces(:, :) !! (2,n) element, face 1..6
    integer :: face(size(elements)), i

    face = label
    if (allocated(draft%collapsed)) then
      do i = 1, size(elements)
        if (draft%collapsed(elements(i)) > 0) face(i) = draft%faces_of(label, &
          draft%collapsed(elements(i)))
      end do
    end if
    if (allocated(draft%outer)) then
      do i = 1, size(elements)
        if (face(i) == no_area) cycle
        if (.not. draft%outer(face(i), elements(i))) face(i) = no_area
      end do
    end if
    faces = transpose(reshape([pack(elements, face > no_area), pack(face, face > no_area)], &
      [count(face > no_area), 2]))
  end function labelled_faces

  !> The faces of solid elements that faces of the deck's elements consist of.
  pure function refined_faces(draft, faces) result(parts)
    type(mesh_draft_t), intent(in) :: draft
    integer, intent(in) :: faces(:, :)        !! (2,n) element of the deck, face 1..6
    integer, allocatable :: parts(:, :)       !! (2,m) likewise of the mesh
    integer :: i, k, n

    allocate (parts(2, size(faces, 2)))
    n = 0
    do i = 1, size(faces, 2)
      associate (pieces => labelled_faces(draft, pieces_of(draft, faces(1, i)), faces(2, i)))
        do k = 1, size(pieces, 2)
          call append(parts, n, pieces(:, k))
        end do
      end associate
    end do
    parts = parts(:, :n)
  end function refined_faces

  !> Those of nodes that are not beside the plane of an element.
  pure function nodes_of_plane(draft, nodes) result(of_plane)
    type(mesh_draft_t), intent(in) :: draft
    integer, intent(in) :: nodes(:)
    integer, allocatable :: of_plane(:)
    logical :: is_beside(0:draft%n_nodes)

    of_plane = nodes
    if (.not. allocated(draft%copies)) return
    is_beside = .false.
    is_beside([draft%copies]) = .true.
    of_plane = given_nodes(draft, pack(nodes, .not. is_beside(nodes)))
  end function nodes_of_plane

  !> Those of nodes that are the deck's.
  pure function given_nodes(draft, nodes) result(given)
    type(mesh_draft_t), intent(in) :: draft
    integer, intent(in) :: nodes(:)
    integer, allocatable :: given(:)

    given = nodes
    if (allocated(draft%between)) given = pack(nodes, nodes <= draft%n_given)
  end function given_nodes

  !> The next size of a list: at least half as long again; 0 when that is beyond the limit.
  pure integer function new_size(have, used, more) result(want)
    integer, intent(in) :: have, used, more
    integer(i8) :: wanted

    wanted = max(used + int(more, i8), have + have/2_i8, 1024_i8)
    want = 0
    if (used + int(more, i8) <= max_nodes) want = int(min(wanted, int(max_nodes, i8)))
  end function new_size

  !> Whether an element that is no solid is a spring.
  elemental logical function is_spring(kind)
    integer, intent(in) :: kind !! no_facet and its kin

    is_spring = any(kind == [spring_1, spring_2, spring_a])
  end function is_spring

  !> Whether an element that is no solid is a spring or a gap.
  elemental logical function is_connector(kind)
    integer, intent(in) :: kind !! no_facet and its kin

    is_connector = is_spring(kind) .or. kind == gap_uni
  end function is_connector

  !> Add an element of a type that is skipped, or a facet of a rigid body; its nodes follow.
  subroutine add_skipped(draft, id, position, kind, corners)
    type(mesh_draft_t), intent(inout) :: draft
    integer, intent(in) :: id, position
    integer, intent(in) :: kind    !! no_facet and its kin
    integer, intent(in) :: corners !! that a facet must have, else 0
    integer :: n(5)

    n = draft%n_skipped
    call append(draft%skipped_id, n(1), id)
    call append(draft%skipped_position, n(2), position)
    call append(draft%skipped_first, n(3), draft%n_skipped_nodes + 1)
    call append(draft%skipped_kind, n(4), kind)
    call append(draft%skipped_corners, n(5), corners)
    draft%n_skipped = n(1)
    draft%highest_element = max(draft%highest_element, id)
  end subroutine add_skipped

  !> Add a node to the last skipped element.
  subroutine add_skipped_node(draft, id)
    type(mesh_draft_t), intent(inout) :: draft
    integer, intent(in) :: id

    call append(draft%skipped_nodes, draft%n_skipped_nodes, id)
  end subroutine add_skipped_node

  subroutine add_block(draft, block)
    type(mesh_draft_t), intent(inout) :: draft
    type(block_t), intent(in) :: block

    if (.not. allocated(draft%blocks)) allocate (draft%blocks(4))
    if (draft%n_blocks == size(draft%blocks)) draft%blocks = [draft%blocks, draft%blocks]
    draft%n_blocks = draft%n_blocks + 1
    draft%blocks(draft%n_blocks) = block
  end subroutine add_block

  subroutine add_early_set(draft, set)
    type(mesh_draft_t), intent(inout) :: draft
    type(early_set_t), intent(in) :: set

    if (.not. allocated(draft%sets)) allocate (draft%sets(16))
    if (draft%n_sets == size(draft%sets)) draft%sets = [draft%sets, draft%sets]
    draft%n_sets = draft%n_sets + 1
    draft%sets(draft%n_sets) = set
  end subroutine add_early_set

end module mesh_draft_mod
