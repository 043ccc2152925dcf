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
    do i = 1, size(candidate, 2)
      key(:, i) = nodes_of_face(mesh%connectivity, candidate(1, i), candidate(2, i))
      call sort_ascending(key(:, i))
    end do

    call drop_divided(mesh, key, outer)
    ! Two elements that meet in a face both have it among the candidates: then it is inside.
    call order_of_columns(key, order)
    do i = 2, size(order)
      if (any(key(:, order(i)) /= key(:, order(i - 1)))) cycle
      outer(order(i - 1:i)) = .false.
    end do
    allocate (faces(2, count(outer)))
    n = 0
    do i = 1, size(outer)
      if (.not. outer(i)) cycle
      n = n + 1
      faces(:, n) = candidate(:, i)
    end do
  end subroutine find_outer_faces

  !> Faces that are not outside since smaller ones lie on their other side, and these: their middle
  !> is a node that hangs.
  pure subroutine drop_divided(mesh, key, outer)
    type(mesh_draft_t), intent(in) :: mesh
    integer, intent(in) :: key(:, :)     !! (4,n) nodes, ascending; the first of a triangle is 0
    logical, intent(out) :: outer(:)     !! (n)
    integer, allocatable :: middle(:, :), order(:), both(:, :)
    logical :: in_middle(0:mesh%n_nodes)
    integer :: i, n, node

    outer = .true.
    if (.not. allocated(mesh%hangs)) return
    in_middle = .false.
    n = 0
    allocate (middle(face_corners, 0))
    do i = 1, size(mesh%hangs) - mesh%n_given
      node = mesh%n_given + i
      if (.not. mesh%hangs(node) .or. mesh%between(3, i) == 0) cycle
      in_middle(node) = .true.
      call append(middle, n, mesh%between(:face_corners, i))
      call sort_ascending(middle(:, n))
    end do
    do i = 1, size(outer)
      outer(i) = .not. any(in_middle(key(:, i)))
    end do
    both = reshape([middle(:, :n), key], [face_corners, n + size(key, 2)])
    call order_of_columns(both, order)
    do i = 2, size(order)
      if (order(i) <= n) cycle
      if (order(i - 1) > n) cycle
      if (all(both(:, order(i)) == both(:, order(i - 1)))) outer(order(i) - n) = .false.
    end do
  end subroutine drop_divided

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
