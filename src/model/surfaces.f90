!> Surfaces: faces of elements, or nodes.
module surfaces_mod
  use cells_mod, only: face_corners, face_nodes, has_middles
  use connectivity_mod, only: all_nodes_of_face, connectivity_t, nodes_of_face
  implicit none
  private

  public :: surface_t, nodes_of, all_nodes_of, bare_nodes, are_of_second_order

  !> A surface, named or of loaded faces. Made of faces: the nodes are theirs; made of nodes: the
  !> faces are those whose corners it has, and there may be none.
  type :: surface_t
    character(:), allocatable :: name
    integer, allocatable :: faces(:, :) !! (2, n_faces) element, face 1..6
    integer, allocatable :: nodes(:)    !! (n_nodes) node numbers, ascending, each once
  end type surface_t

contains

  !> The corners of faces, anticlockwise from outside.
  pure function nodes_of(faces, connectivity) result(nodes)
    integer, intent(in) :: faces(:, :)        !! (2,n_faces) element, face 1..6
    type(connectivity_t), intent(in) :: connectivity
    integer :: nodes(face_corners, size(faces, 2)) !! as of nodes_of_face
    integer :: f

    do f = 1, size(faces, 2)
      nodes(:, f) = nodes_of_face(connectivity, faces(1, f), faces(2, f))
    end do
  end function nodes_of

  !> All nodes of faces: the corners, then the middles of edges.
  pure function all_nodes_of(faces, connectivity) result(nodes)
    integer, intent(in) :: faces(:, :)        !! (2,n_faces) element, face 1..6
    type(connectivity_t), intent(in) :: connectivity
    integer :: nodes(face_nodes, size(faces, 2)) !! as of all_nodes_of_face
    integer :: f

    do f = 1, size(faces, 2)
      nodes(:, f) = all_nodes_of_face(connectivity, faces(1, f), faces(2, f))
    end do
  end function all_nodes_of

  !> Whether some faces have nodes in the middles of their edges.
  pure logical function are_of_second_order(faces, connectivity)
    integer, intent(in) :: faces(:, :)        !! (2,n_faces) element, face 1..6
    type(connectivity_t), intent(in) :: connectivity

    are_of_second_order = any(has_middles(connectivity%cell(faces(1, :))))
  end function are_of_second_order

  !> The nodes of a surface that none of its faces has.
  pure function bare_nodes(surface, connectivity, n_nodes) result(nodes)
    type(surface_t), intent(in) :: surface
    type(connectivity_t), intent(in) :: connectivity
    integer, intent(in) :: n_nodes  !! of the mesh
    integer, allocatable :: nodes(:)
    logical :: on_face(0:n_nodes)
    integer :: f

    on_face = .false.
    do f = 1, size(surface%faces, 2)
      on_face(all_nodes_of_face(connectivity, surface%faces(1, f), surface%faces(2, f))) = .true.
    end do
    nodes = pack(surface%nodes, .not. on_face(surface%nodes))
  end function bare_nodes

end module surfaces_mod
