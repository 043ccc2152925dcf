!> Surfaces: faces of elements, or nodes.
module surfaces_mod
  use kinds_mod, only: wp
  use cells_mod, only: face_corners, face_nodes
  use connectivity_mod, only: all_nodes_of_face, connectivity_t, nodes_of_face
  implicit none
  private

  public :: surface_t, nodes_of, all_nodes_of, bare_nodes, split_faces, &
    cut_at_middles, find_middles

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

  !> Faces as those of their corners; with mid-side nodes cut into parts between all of their nodes.
  pure subroutine split_faces(faces, connectivity, nodes, whole)
    integer, intent(in) :: faces(:, :)        !! (2,n_faces) element, face 1..6
    type(connectivity_t), intent(in) :: connectivity
    integer, allocatable, intent(out) :: nodes(:, :) !! (4,n) as of nodes_of_face
    integer, allocatable, intent(out) :: whole(:)    !! (n) which of the faces each is of

    call cut_at_middles(all_nodes_of(faces, connectivity), nodes, whole)
  end subroutine split_faces

  !> Cut faces with mid-side nodes into parts between all of their nodes, which are as many as the
  !> corners, and the middle; parts of a face follow each other.
  pure subroutine cut_at_middles(faces, nodes, whole)
    integer, intent(in) :: faces(:, :)    !! (4,n_faces) or (8,n_faces) as of all_nodes_of
    integer, allocatable, intent(out) :: nodes(:, :) !! (4,n) as of nodes_of_face
    integer, allocatable, intent(out) :: whole(:)    !! (n) which of the faces each is of
    integer :: f, k, n, all_nodes, corners

    n = size(faces, 2)
    if (size(faces, 1) > face_corners) then
      do f = 1, size(faces, 2)
        all_nodes = count(faces(:, f) > 0)
        if (all_nodes > face_corners) n = n + all_nodes/2
      end do
    end if
    allocate (nodes(face_corners, n), whole(n), source=0)
    n = 0
    do f = 1, size(faces, 2)
      all_nodes = count(faces(:, f) > 0)
      if (all_nodes <= face_corners) then
        n = n + 1
        nodes(:, n) = faces(:face_corners, f)
        whole(n) = f
        cycle
      end if
      corners = all_nodes/2
      do k = 1, corners
        nodes(:3, n + k) = faces([k, corners + k, corners + 1 + modulo(k - 2, corners)], f)
      end do
      n = n + corners + 1
      nodes(:corners, n) = faces(corners + 1:all_nodes, f)
      whole(n - corners:n) = f
    end do
  end subroutine cut_at_middles

  !> The nodes in the middles of the edges of slave faces: the ends of the edge, alpha of (9.11).
  !> Other nodes stay as they are.
  pure subroutine find_middles(faces, ends, alpha)
    integer,  intent(in) :: faces(:, :)      !! (4,n_faces) or (8,n_faces) as of all_nodes_of
    integer,  intent(inout) :: ends(:, :)    !! (2,n_nodes)
    real(wp), intent(inout) :: alpha(:)      !! (n_nodes) [-]
    ! Of edges of triangles, and of edges that a quadrilateral has: areas of points are positive.
    real(wp), parameter :: of_triangle = 0.2_wp, of_quadrilateral = 0.25_wp
    integer :: f, k, n, corners

    if (size(faces, 1) == face_corners) return
    do f = 1, size(faces, 2)
      n = count(faces(:, f) > 0)
      if (n <= face_corners) cycle
      corners = n/2
      do k = 1, corners
        associate (middle => faces(corners + k, f))
          ends(:, middle) = faces([k, 1 + modulo(k, corners)], f)
          alpha(middle) = max(alpha(middle), merge(of_triangle, of_quadrilateral, corners == 3))
        end associate
      end do
    end do
  end subroutine find_middles

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
