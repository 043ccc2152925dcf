!> The faces that a set of nodes means.
module find_faces_mod
  use growing_lists_mod, only: append
  use cells_mod, only: cells, face_corners
  use connectivity_mod, only: corners_in, nodes_of_element, nodes_of_face
  use faces_mod, only: face_area_vectors
  use kinds_mod, only: wp
  use mesh_draft_mod, only: mesh_draft_t, solids
  use sorting_mod, only: order_of_columns, sort_ascending
  implicit none
  private

  public :: find_outer_faces, size_of_face

contains

  !> The faces of elements on the outside of the mesh whose corners are all among `nodes`.
  subroutine find_outer_faces(mesh, nodes, faces)
    type(mesh_draft_t), intent(in) :: mesh
    integer, intent(in) :: nodes(:)
    integer, allocatable, intent(out) :: faces(:, :) !! (2, n) element, face 1..6; by element
    integer, allocatable :: candidate(:, :), key(:, :), order(:)
    logical, allocatable :: outer(:)
    integer :: i, n

    call find_candidates(mesh, nodes, candidate)
    allocate (key(face_corners, size(candidate, 2)), outer(size(candidate, 2)))
    if (allocated(mesh%outside)) then
      outer = [(mesh%outside(candidate(2, i), candidate(1, i)), i=1, size(outer))]
    else
      ! Two elements that meet in a face both have it among the candidates: then it is inside.
      outer = .true.
      do i = 1, size(outer)
        key(:, i) = nodes_of_face(mesh%connectivity, candidate(1, i), candidate(2, i))
        call sort_ascending(key(:, i))
      end do
      call order_of_columns(key, order)
      do i = 2, size(order)
        if (any(key(:, order(i)) /= key(:, order(i - 1)))) cycle
        outer(order(i - 1:i)) = .false.
      end do
    end if
    allocate (faces(2, count(outer)))
    n = 0
    do i = 1, size(outer)
      if (.not. outer(i)) cycle
      n = n + 1
      faces(:, n) = candidate(:, i)
    end do
  end subroutine find_outer_faces

  !> The area of a face; of a slice the length of its edge in the plane, 0 of a face that is the
  !> plane's: how thick slices are says nothing of their mesh.
  pure real(wp) function size_of_face(mesh, element, face)
    type(mesh_draft_t), intent(in) :: mesh
    integer, intent(in) :: element, face
    integer :: node(face_corners), base(face_corners), ends(2), k

    node = nodes_of_face(mesh%connectivity, element, face)
    if (mesh%plane == solids) then
      size_of_face = norm2(sum(face_area_vectors(mesh%coordinates(:, node(:corners_in(node)))), 2))
      return
    end if
    size_of_face = 0.0_wp
    base = nodes_of_face(mesh%connectivity, element, 1)
    ends = pack(node, [(any(base == node(k)), k=1, face_corners)], [0, 0])
    if (all(ends > 0)) size_of_face = norm2(mesh%coordinates(:, ends(1)) - mesh%coordinates(:, &
      ends(2)))
  end function size_of_face

  !> All faces of elements whose corners are among `nodes`.
  subroutine find_candidates(mesh, nodes, faces)
    type(mesh_draft_t), intent(in) :: mesh
    integer, intent(in) :: nodes(:)
    integer, allocatable, intent(out) :: faces(:, :) !! (2, n) element, face 1..6
    logical, allocatable :: named(:)
    integer :: e, face, n

    allocate (named(0:mesh%n_nodes), faces(2, 64))
    named = .false.
    named(nodes) = .true.
    named(0) = .true. ! behind the corners of a triangle
    n = 0
    do e = 1, mesh%n_elements
      associate (cell => cells(mesh%connectivity%cell(e)))
        if (count(named(nodes_of_element(mesh%connectivity, e))) < minval(cell%n_face_corners( &
          :cell%n_faces))) cycle
        do face = 1, cell%n_faces
          if (.not. all(named(nodes_of_face(mesh%connectivity, e, face)))) cycle
          call append(faces, n, [e, face])
        end do
      end associate
    end do
    faces = faces(:, :n)
  end subroutine find_candidates

end module find_faces_mod
