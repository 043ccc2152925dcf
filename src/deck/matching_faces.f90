!> Faces and edges of elements that meet: which do not match though their corners do, and how many
!> faces of an element have no neighbour.
module matching_faces_mod
  use cards_mod, only: note, reader_t, report
  use cells_mod, only: cells, face_corners, has_middles, hexahedron_20_of_14, &
    hexahedron_20_reduced, hexahedron_8
  use connectivity_mod, only: nodes_of_face
  use equal_columns_mod, only: number_columns
  use mesh_draft_mod, only: mesh_draft_t
  use sorting_mod, only: sort_ascending
  use text_mod, only: to_text
  implicit none
  private

  public :: check_matching, strengthen_reduced, outer_faces

contains

  !> Report what does not match: an edge with a node in its middle in one element and another or
  !> none in another element, and a quadrilateral beside two triangles, of which elements without
  !> mid-side nodes are noted.
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
  !> take 14 points: else chains of single elements have motions without strain.
  !> docs/theory.md section 8.
  subroutine strengthen_reduced(reader, mesh)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(inout) :: mesh
    ! Of an element in a chain. tests/cases/test_second_order.py has shapes that need it.
    integer, parameter :: many = 4
    integer, allocatable :: key(:, :), of_face(:, :)
    logical, allocatable :: is_outer(:)
    integer :: n_outer(mesh%n_elements), i

    if (mesh%n_elements == 0) return
    if (.not. any(mesh%connectivity%cell(:mesh%n_elements) == hexahedron_20_reduced)) return
    call list_faces(mesh, key, of_face, is_outer)
    n_outer = 0
    do i = 1, size(is_outer)
      if (is_outer(i)) n_outer(of_face(1, i)) = n_outer(of_face(1, i)) + 1
    end do
    associate (cell => mesh%connectivity%cell(:mesh%n_elements))
      i = count(cell == hexahedron_20_reduced .and. n_outer >= many)
      where (cell == hexahedron_20_reduced .and. n_outer >= many) cell = hexahedron_20_of_14
    end associate
    if (i > 0) call note(reader, to_text(i)//' elements of C3D20R have four faces or more '// &
      'without a neighbour: they take 14 points instead of 8, at which others may move '// &
      'without strain')
  end subroutine strengthen_reduced

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

  !> All faces, and which of them no two elements have.
  pure subroutine list_faces(mesh, key, of_face, is_outer)
    type(mesh_draft_t), intent(in) :: mesh
    integer, allocatable, intent(out) :: key(:, :)     !! (4,n) corners, ascending; 0 of a triangle
    integer, allocatable, intent(out) :: of_face(:, :) !! (2,n) element, face
    logical, allocatable, intent(out) :: is_outer(:)   !! (n)
    integer, allocatable :: number(:)
    integer :: e, f, n

    n = sum(cells(mesh%connectivity%cell(:mesh%n_elements))%n_faces)
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

  !> Edges whose middle is a node of its own in each element, or of one of them alone.
  subroutine check_edges(reader, mesh)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(in) :: mesh
    integer, allocatable :: ends(:, :), middle(:), element(:), number(:)
    integer :: e, k, n

    n = sum(cells(mesh%connectivity%cell(:mesh%n_elements))%n_edges)
    allocate (ends(2, n), middle(n), element(n))
    n = 0
    do e = 1, mesh%n_elements
      if (is_flawed(mesh, e)) cycle
      associate (cell => cells(mesh%connectivity%cell(e)), &
                 node => mesh%connectivity%node(mesh%connectivity%first(e):))
        do k = 1, cell%n_edges
          n = n + 1
          ends(:, n) = [minval(node(cell%edge(:, k))), maxval(node(cell%edge(:, k)))]
          middle(n) = 0
          if (has_middles(mesh%connectivity%cell(e))) middle(n) = node(cell%n_corners + k)
          element(n) = e
        end do
      end associate
    end do
    ends = ends(:, :n)
    call number_columns(ends, number)
    do k = 1, n
      if (middle(k) == middle(number(k))) cycle
      call report(reader, mesh%element_position(element(k)), 'elements '// &
        to_text(mesh%element_id(element(number(k))))//' and '// &
        to_text(mesh%element_id(element(k)))//' have the edge from node '// &
        to_text(mesh%node_id(ends(1, k)))//' to node '//to_text(mesh%node_id(ends(2, k)))// &
        ', but not the same node in its middle: join parts of first and second order by *TIE')
      return
    end do
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
    integer :: i, k, n_triangles
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
    do i = 1, size(quads)
      found = number(n_triangles + 4*i - 3:n_triangles + 4*i) <= n_triangles
      if (.not. (all(found(:2)) .or. all(found(3:)))) cycle
      associate (e => of_face(1, quads(i)))
        if (has_middles(mesh%connectivity%cell(e))) then
          call report(reader, mesh%element_position(e), 'face '//to_text(of_face(2, quads(i)))// &
            ' of element '//to_text(mesh%element_id(e))//' is a quadrilateral beside two '// &
            'triangles: they do not match; put pyramids between, or *TIE')
        else
          call note(reader, 'face '//to_text(of_face(2, quads(i)))//' of element '// &
            to_text(mesh%element_id(e))//' is a quadrilateral beside two triangles: between '// &
            'its edges they gape or overlap')
        end if
      end associate
      return
    end do
  end subroutine check_diagonals

end module matching_faces_mod
