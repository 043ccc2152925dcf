!> Faces and edges of elements that meet: which do not match though their corners do, and how many
!> faces of an element have no neighbour.
module matching_faces_mod
  use cards_mod, only: note, reader_t, report
  use cells_mod, only: cells, face_corners, face_nodes, has_middles, hexahedron_20_of_14, &
    hexahedron_20_reduced, hexahedron_8
  use connectivity_mod, only: all_nodes_of_face, nodes_of_face
  use equal_columns_mod, only: number_columns
  use kinds_mod, only: wp
  use loads_mod, only: load_step_t
  use mesh_mod, only: deck_rounding, find_bodies, mesh_t
  use constraints_mod, only: constraint_of, constraints_t
  use mesh_draft_mod, only: mesh_draft_t, plane_strain, solids
  use surfaces_mod, only: split_faces
  use sorting_mod, only: sort_ascending
  use text_mod, only: to_text
  implicit none
  private

  public :: check_matching, strengthen_reduced, outer_faces, find_skin, skin_faces, &
    held_throughout

contains

  !> Report what does not match: an edge with a node in its middle in one element and another or
  !> none in another element, or that is half of another's, and a quadrilateral beside two
  !> triangles, of which elements without mid-side nodes are noted.
  subroutine check_matching(reader, mesh)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(in) :: mesh
    integer, allocatable :: key(:, :), of_face(:, :)
    logical, allocatable :: is_outer(:)

    if (mesh%n_elements == 0) return
    associate (cell => mesh%connectivity%cell(:mesh%n_elements))
      if (all(cell == hexahedron_8)) return
      if (any(has_middles(cell))) call check_edges(reader, mesh)
    end associate
    call list_faces(mesh, key, of_face, is_outer)
    call check_diagonals(reader, mesh, key, of_face, is_outer)
  end subroutine check_matching

  !> The 20-node hexahedra with reduced integration that have four faces or more without neighbour
  !> take 14 points: else chains of single elements have motions without strain. What is beyond a
  !> plane of symmetry is a neighbour, and so is what all nodes of a face are tied to.
  !> docs/theory.md section 8.
  subroutine strengthen_reduced(reader, mesh, steps, ties)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(inout) :: mesh
    type(load_step_t), intent(in) :: steps(:)
    type(constraints_t), intent(in) :: ties
    ! Of an element in a chain. tests/cases/test_second_order.py has shapes that need it.
    integer, parameter :: many = 4
    logical, allocatable :: is_outer(:, :), held(:, :)
    integer :: n_outer(mesh%n_elements), e, f, n, nodes(face_nodes)
    logical :: is_tied(0:mesh%n_nodes)
    real(wp) :: rounding !! [length]

    if (mesh%n_elements == 0) return
    if (.not. any(mesh%connectivity%cell(:mesh%n_elements) == hexahedron_20_reduced)) return
    is_outer = outer_faces(mesh)
    held = held_throughout(steps, mesh%n_nodes)
    rounding = deck_rounding(mesh%coordinates(:, :mesh%n_nodes), mesh%origin)
    is_tied(0) = .true. ! behind the nodes of a face
    is_tied(1:) = all(constraint_of(ties, mesh%n_nodes) > 0, dim=1)
    n_outer = 0
    do e = 1, mesh%n_elements
      do f = 1, size(is_outer, 1)
        if (.not. is_outer(f, e)) cycle
        nodes = all_nodes_of_face(mesh%connectivity, e, f)
        is_outer(f, e) = .not. (all(is_tied(nodes)) .or. is_on_mirror(f, nodes))
      end do
      n_outer(e) = count(is_outer(:, e))
    end do
    associate (cell => mesh%connectivity%cell(:mesh%n_elements))
      n = count(cell == hexahedron_20_reduced .and. n_outer >= many)
      where (cell == hexahedron_20_reduced .and. n_outer >= many) cell = hexahedron_20_of_14
    end associate
    if (n > 0) call note(reader, to_text(n)//' elements of C3D20R have four faces or more '// &
      'without a neighbour: they take 14 points instead of 8, at which others may move '// &
      'without strain')

  contains

    !> Whether a face lies across an axis along which all of its nodes are held, or they are held
    !> along all. Plane strain is held across its first two faces; a plate is not, it grows thick,
    !> and eight points do not integrate arcs of bodies of revolution.
    pure logical function is_on_mirror(face, nodes)
      integer, intent(in) :: face
      integer, intent(in) :: nodes(:) !! as of all_nodes_of_face
      integer, allocatable :: of_face(:)
      integer :: axis

      of_face = pack(nodes, nodes > 0)
      is_on_mirror = all(held(:, of_face)) .or. (face <= 2 .and. mesh%plane == plane_strain)
      do axis = 1, 3
        if (.not. all(held(axis, of_face))) cycle
        is_on_mirror = is_on_mirror .or. maxval(mesh%coordinates(axis, of_face)) - &
          minval(mesh%coordinates(axis, of_face)) <= rounding
      end do
    end function is_on_mirror

  end subroutine strengthen_reduced

  !> The degrees of freedom that are held where they are in all steps.
  pure function held_throughout(steps, n_nodes) result(held)
    type(load_step_t), intent(in) :: steps(:)
    integer, intent(in) :: n_nodes
    logical, allocatable :: held(:, :) !! (3,n_nodes)
    logical :: now(3, n_nodes)
    integer :: k, i

    allocate (held(3, n_nodes), source=size(steps) > 0)
    now = .false.
    do k = 1, size(steps)
      if (steps(k)%replace_boundary) now = .false.
      do i = 1, size(steps(k)%boundary)
        associate (b => steps(k)%boundary(i))
          now(b%dof, b%node) = .not. abs(b%value) > 0.0_wp
        end associate
      end do
      held = held .and. now
    end do
  end function held_throughout

  !> The faces that no two elements have.
  pure function outer_faces(mesh) result(is_outer)
    type(mesh_draft_t), intent(in) :: mesh
    logical, allocatable :: is_outer(:, :) !! (6,n_elements)
    integer, allocatable :: key(:, :), of_face(:, :)
    logical, allocatable :: of_list(:)
    integer :: i

    allocate (is_outer(6, mesh%n_elements), source=.false.)
    call list_faces(mesh, key, of_face, of_list)
    do i = 1, size(of_list)
      is_outer(of_face(2, i), of_face(1, i)) = of_list(i)
    end do
  end function outer_faces

  !> Find the outside of all bodies, in parts between all nodes of its faces, and which these are.
  !> The ends of slices are none.
  pure subroutine find_skin(draft)
    type(mesh_draft_t), intent(inout) :: draft !! gets skin, piece
    type(mesh_t) :: mesh
    integer, allocatable :: whole(:)

    if (draft%n_elements == 0) return
    call split_faces(skin_faces(draft), draft%connectivity, draft%skin, whole)
    mesh%n_nodes = draft%n_nodes
    mesh%n_elements = draft%n_elements
    mesh%connectivity = draft%connectivity
    call find_bodies(mesh)
    call move_alloc(mesh%piece, draft%piece)
  end subroutine find_skin

  !> The outer faces of all bodies, by element: those of the deck's elements, of a plane without its
  !> two sides.
  pure function skin_faces(draft) result(faces)
    type(mesh_draft_t), intent(in) :: draft
    integer, allocatable :: faces(:, :)     !! (2,n) element, face 1..6
    logical, allocatable :: is_outer(:, :)  !! (6,n_elements)
    integer :: e, f

    if (allocated(draft%outside)) then
      is_outer = draft%outside(:, :draft%n_elements)
    else
      is_outer = outer_faces(draft)
    end if
    if (draft%plane /= solids) is_outer(:2, :) = .false.
    faces = reshape([((pack([e, f], is_outer(f, e)), f=1, 6), e=1, draft%n_elements)], &
      [2, count(is_outer)])
  end function skin_faces

  !> All faces, and which of them no two elements have.
  pure subroutine list_faces(mesh, key, of_face, is_outer)
    type(mesh_draft_t), intent(in) :: mesh
    integer, allocatable, intent(out) :: key(:, :)     !! (4,n) corners, ascending; 0 of a triangle
    integer, allocatable, intent(out) :: of_face(:, :) !! (2,n) element, face
    logical, allocatable, intent(out) :: is_outer(:)   !! (n)
    integer, allocatable :: number(:)
    integer :: e, f, n

    n = 0 ! a draft without elements has no connectivity
    if (mesh%n_elements > 0) n = sum(cells(mesh%connectivity%cell(:mesh%n_elements))%n_faces)
    allocate (key(face_corners, n), of_face(2, n))
    n = 0
    do e = 1, mesh%n_elements
      if (is_flawed(mesh, e)) cycle
      do f = 1, cells(mesh%connectivity%cell(e))%n_faces
        n = n + 1
        key(:, n) = nodes_of_face(mesh%connectivity, e, f)
        call sort_ascending(key(:, n))
        of_face(:, n) = [e, f]
      end do
    end do
    key = key(:, :n)
    of_face = of_face(:, :n)
    call number_columns(key, number)
    allocate (is_outer(n), source=.true.)
    do f = 1, n
      if (number(f) == f) cycle
      is_outer(f) = .false.
      is_outer(number(f)) = .false.
    end do
  end subroutine list_faces

  !> Whether an element names undefined nodes, which was reported: it was given one node throughout.
  pure logical function is_flawed(mesh, e)
    type(mesh_draft_t), intent(in) :: mesh
    integer, intent(in) :: e

    associate (first => mesh%connectivity%first(e), node => mesh%connectivity%node)
      is_flawed = node(first) == node(first + 1)
    end associate
  end function is_flawed

  !> Edges whose middle is a node of its own in each element, or of one of them alone, and edges of
  !> one element that are halves of another's.
  subroutine check_edges(reader, mesh)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(in) :: mesh
    integer, parameter :: of_half = -1
    integer, allocatable :: ends(:, :), middle(:), element(:), number(:)
    integer :: e, k, m, n

    n = sum(cells(mesh%connectivity%cell(:mesh%n_elements))%n_edges)
    allocate (ends(2, 3*n), middle(3*n), element(3*n))
    n = 0
    do e = 1, mesh%n_elements
      if (is_flawed(mesh, e)) cycle
      associate (cell => cells(mesh%connectivity%cell(e)), &
                 node => mesh%connectivity%node(mesh%connectivity%first(e):))
        do k = 1, cell%n_edges
          m = 0
          if (has_middles(mesh%connectivity%cell(e))) m = node(cell%n_corners + k)
          call add(node(cell%edge(1, k)), node(cell%edge(2, k)), m)
          if (m == 0) cycle
          call add(node(cell%edge(1, k)), m, of_half)
          call add(m, node(cell%edge(2, k)), of_half)
        end do
      end associate
    end do
    ends = ends(:, :n)
    call number_columns(ends, number)
    do k = 1, n
      if (middle(k) == middle(number(k))) cycle
      associate (pair => [number(k), k])
        if (any(middle(pair) == of_half)) then
          associate (whole => merge(pair(1), pair(2), middle(pair(2)) == of_half), &
                     half => merge(pair(2), pair(1), middle(pair(2)) == of_half))
            call report(reader, mesh%element_position(element(whole)), 'the edge of element '// &
              to_text(mesh%element_id(element(whole)))//' from '//both_ends(k)// &
              ' is half of an edge of element '//to_text(mesh%element_id(element(half)))// &
              ': join parts of first and second order by *TIE')
          end associate
        else
          call report(reader, mesh%element_position(element(k)), 'elements '// &
            to_text(mesh%element_id(element(number(k))))//' and '// &
            to_text(mesh%element_id(element(k)))//' have the edge from '//both_ends(k)// &
            ', but not the same node in its middle: join parts of first and second order by *TIE')
        end if
      end associate
      return
    end do

  contains

    subroutine add(one, other, m)
      integer, intent(in) :: one, other !! nodes
      integer, intent(in) :: m          !! the one between them; 0: none

      n = n + 1
      ends(:, n) = [min(one, other), max(one, other)]
      middle(n) = m
      element(n) = e
    end subroutine add

    function both_ends(k) result(words)
      integer, intent(in) :: k
      character(:), allocatable :: words

      words = 'node '//to_text(mesh%node_id(ends(1, k)))//' to node '// &
        to_text(mesh%node_id(ends(2, k)))
    end function both_ends

  end subroutine check_edges

  !> Quadrilaterals on the outside whose corners lie on two triangles there.
  subroutine check_diagonals(reader, mesh, key, of_face, is_outer)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(in) :: mesh
    integer, intent(in) :: key(:, :), of_face(:, :) !! as of list_faces
    logical, intent(in) :: is_outer(:)
    ! The corners that a triangle has of a quadrilateral, in their order around it: two halves, by
    ! either diagonal.
    integer, parameter :: half(3, 4) = reshape([1, 2, 3, 1, 3, 4, 1, 2, 4, 2, 3, 4], [3, 4])
    integer, allocatable :: candidate(:, :), number(:)
    integer :: corners(face_corners), quads(count(is_outer .and. key(1, :) > 0))
    integer :: triangles(count(is_outer .and. key(1, :) == 0))
    integer :: i, k, n, n_triangles, first
    logical :: found(4)

    quads = pack([(i, i=1, size(is_outer))], is_outer .and. key(1, :) > 0)
    triangles = pack([(i, i=1, size(is_outer))], is_outer .and. key(1, :) == 0)
    n_triangles = size(triangles)
    if (size(quads) == 0 .or. n_triangles == 0) return
    allocate (candidate(3, n_triangles + 4*size(quads)))
    candidate(:, :n_triangles) = key(2:, triangles)
    do i = 1, size(quads)
      corners = nodes_of_face(mesh%connectivity, of_face(1, quads(i)), of_face(2, quads(i)))
      do k = 1, 4
        associate (here => candidate(:, n_triangles + 4*(i - 1) + k))
          here = corners(half(:, k))
          call sort_ascending(here)
        end associate
      end do
    end do
    call number_columns(candidate, number)
    first = 0
    n = 0
    do i = 1, size(quads)
      found = number(n_triangles + 4*i - 3:n_triangles + 4*i) <= n_triangles
      if (.not. (all(found(:2)) .or. all(found(3:)))) cycle
      associate (e => of_face(1, quads(i)))
        if (has_middles(mesh%connectivity%cell(e))) then
          call report(reader, mesh%element_position(e), face_in_words(quads(i))// &
            ' is a quadrilateral beside two triangles: they do not match; put pyramids '// &
            'between, or *TIE')
          return
        end if
      end associate
      n = n + 1
      if (first == 0) first = quads(i)
    end do
    if (n == 1) call note(reader, face_in_words(first)//' is a quadrilateral beside two '// &
      'triangles: between its edges they gape or overlap')
    if (n > 1) call note(reader, to_text(n)//' quadrilaterals are beside two triangles, '// &
      face_in_words(first)//' first: between their edges they gape or overlap')

  contains

    function face_in_words(k) result(words)
      integer, intent(in) :: k !! of of_face
      character(:), allocatable :: words

      words = 'face '//to_text(of_face(2, k))//' of element '// &
        to_text(mesh%element_id(of_face(1, k)))
    end function face_in_words

  end subroutine check_diagonals

end module matching_faces_mod
