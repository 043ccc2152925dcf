!> Surfaces: faces of elements, or nodes.
module surfaces_mod
  use cells_mod, only: cells, face_corners, face_nodes, has_middles
  use connectivity_mod, only: all_nodes_of_face, connectivity_t, nodes_of_face
  implicit none
  private

  public :: surface_t, nodes_of, all_nodes_of, bare_nodes, are_of_second_order, split_faces

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

  !> Faces as those of their corners; with mid-side nodes cut into parts between all of their nodes,
  !> which are as many as the corners, and the middle.
  pure subroutine split_faces(faces, connectivity, nodes, whole)
    integer, intent(in) :: faces(:, :)        !! (2,n_faces) element, face 1..6
    type(connectivity_t), intent(in) :: connectivity
    integer, allocatable, intent(out) :: nodes(:, :) !! (4,n) as of nodes_of_face
    integer, allocatable, intent(out) :: whole(:)    !! (n) which of the faces each is of
    integer :: of_face(face_nodes), f, k, n, corners

    n = 0
    do f = 1, size(faces, 2)
      n = n + 1
      if (has_middles(connectivity%cell(faces(1, f)))) n = n + cells(connectivity%cell( &
        faces(1, f)))%n_face_corners(faces(2, f))
    end do
    allocate (nodes(face_corners, n), whole(n), source=0)
    n = 0
    do f = 1, size(faces, 2)
      of_face = all_nodes_of_face(connectivity, faces(1, f), faces(2, f))
      corners = 0
      if (has_middles(connectivity%cell(faces(1, f)))) corners = count(of_face > 0)/2
      do k = 1, corners
        nodes(:3, n + k) = of_face([k, corners + k, corners + 1 + modulo(k - 2, corners)])
      end do
      n = n + corners + 1
      nodes(:, n) = of_face(:face_corners)
      if (corners > 0) nodes(:corners, n) = of_face(corners + 1:2*corners)
      if (corners == 3) nodes(4, n) = 0
      whole(n - corners:n) = f
    end do
  end subroutine split_faces

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
