!> The faces that a set of nodes means.
module find_faces_mod
  use growing_lists_mod, only: append
  use cells_mod, only: cells, face_corners
  use connectivity_mod, only: nodes_of_element, nodes_of_face
  use mesh_draft_mod, only: mesh_draft_t
  use sorting_mod, only: order_of_columns, sort_ascending
  implicit none
  private

  public :: find_outer_faces

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
