!> Surfaces: faces of bricks, or nodes.
module surfaces_mod
  use cells_mod, only: face_corners
  use connectivity_mod, only: connectivity_t, nodes_of_face
  implicit none
  private

  public :: surface_t, nodes_of

  !> A surface, named or of loaded faces. Made of faces: the nodes are theirs; made of nodes: the
  !> faces are those whose four nodes it has, and there may be none.
  type :: surface_t
    character(:), allocatable :: name
    integer, allocatable :: faces(:, :) !! (2, n_faces) element, face 1..6
    integer, allocatable :: nodes(:)    !! (n_nodes) node numbers, ascending, each once
  end type surface_t

contains

  !> The nodes of faces, anticlockwise from outside.
  pure function nodes_of(faces, connectivity) result(nodes)
    integer, intent(in) :: faces(:, :)        !! (2,n_faces) element, face 1..6
    type(connectivity_t), intent(in) :: connectivity
    integer :: nodes(face_corners, size(faces, 2)) !! as of nodes_of_face
    integer :: f

    do f = 1, size(faces, 2)
      nodes(:, f) = nodes_of_face(connectivity, faces(1, f), faces(2, f))
    end do
  end function nodes_of

end module surfaces_mod
