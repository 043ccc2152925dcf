!> Surfaces: faces of bricks, or nodes.
module surfaces_mod
  implicit none
  private

  public :: surface_t, face_nodes, nodes_of

  !> A surface, named or of loaded faces. Made of faces: the nodes are theirs; made of nodes: the
  !> faces are those whose four nodes it has, and there may be none.
  type :: surface_t
    character(:), allocatable :: name
    integer, allocatable :: faces(:, :) !! (2, n_faces) element, face 1..6
    integer, allocatable :: nodes(:)    !! (n_nodes) node numbers, ascending, each once
  end type surface_t

  !> Local nodes of each face of the brick, S1..S6 of Abaqus, seen from outside anticlockwise.
  !>
  !>        8-------7
  !>       /|      /|     S1 = 1 4 3 2   S2 = 5 6 7 8   S3 = 1 2 6 5
  !>      5-------6 |     S4 = 2 3 7 6   S5 = 3 4 8 7   S6 = 4 1 5 8
  !>      | 4-----|-3
  !>      |/      |/
  !>      1-------2
  integer, parameter :: face_nodes(4, 6) = reshape([ &
    1, 4, 3, 2,  5, 6, 7, 8,  1, 2, 6, 5,  2, 3, 7, 6,  3, 4, 8, 7,  4, 1, 5, 8], [4, 6])

contains

  !> The nodes of faces, anticlockwise from outside.
  pure function nodes_of(faces, connectivity) result(nodes)
    integer, intent(in) :: faces(:, :)        !! (2,n_faces) element, face 1..6
    integer, intent(in) :: connectivity(:, :) !! (8,n_elements)
    integer :: nodes(4, size(faces, 2))
    integer :: f

    do f = 1, size(faces, 2)
      nodes(:, f) = connectivity(face_nodes(:, faces(2, f)), faces(1, f))
    end do
  end function nodes_of

end module surfaces_mod
