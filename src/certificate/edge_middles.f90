!> Contact points of nodes in the middles of edges, for the certificate: what the ends of an edge
!> have part in, found from the elements. docs/theory.md (9.11).
!>
!> A point of such a node is q = (u_m - a (u_1 + u_2))/(1 - 2 a), with a = 1/4 where a slave face
!> with four corners has the edge, else 1/5. What is said of displacements is said of gaps and slips
!> too, and a reaction r on it is r/(1 - 2 a) on the node, and -a times that on either end.
module edge_middles_mod
  use kinds_mod, only: wp
  use cells_mod, only: cells
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t, weights_t, n_sides, find_side_points
  implicit none
  private

  public :: edge_middles_t, find_edge_middles, at_point, vector_at_point, spread_reaction

  !> Of each point the points at the ends of its edge, and a; 0 of other points. Lists are allocated
  !> where there is any.
  type :: edge_middles_t
    logical :: is_any = .false.
    integer,  allocatable :: ends(:, :) !! (2,n_points)
    integer,  allocatable :: nodes(:, :) !! (2,n_points) theirs
    real(wp), allocatable :: a(:)       !! (n_points) [-]
  end type edge_middles_t

contains

  !> Which points are such, as the elements behind slave faces say; which of them are alone is taken
  !> as it is said.
  pure subroutine find_edge_middles(scene, points, weights, middles)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(weights_t), intent(in) :: weights   !! those that are alone
    type(edge_middles_t), intent(out) :: middles
    integer :: ends(2, scene%mesh%n_nodes), point(scene%mesh%n_nodes)
    real(wp) :: a(scene%mesh%n_nodes)
    integer :: pair, i, obstacle, side, first, last

    if (.not. allocated(weights%alone)) return
    allocate (middles%ends(2, points%n), middles%nodes(2, points%n), source=0)
    allocate (middles%a(points%n), source=0.0_wp)
    ends = 0
    a = 0.0_wp
    do pair = 1, size(scene%pairs)
      if (.not. is_before_faces(points, pair)) call take_edges_of(pair, ends, a)
    end do
    do obstacle = 1, size(scene%obstacles)
      point = 0
      do pair = 1, size(scene%pairs)
        if (scene%pairs(pair)%master /= obstacle .or. is_before_faces(points, pair)) cycle
        do i = points%first(pair), points%first(pair + 1) - 1
          point(points%node(i)) = i
        end do
      end do
      do pair = 1, size(scene%pairs)
        if (scene%pairs(pair)%master /= obstacle .or. is_before_faces(points, pair)) cycle
        call take_points(points%first(pair), points%first(pair + 1) - 1, point, ends, a, middles)
      end do
    end do
    ! Each side of faces has points of its own, of one pair.
    do pair = 1, size(scene%pairs)
      if (.not. is_before_faces(points, pair)) cycle
      ends = 0
      a = 0.0_wp
      call take_edges_of(pair, ends, a)
      do side = 1, n_sides(points, pair)
        call find_side_points(points, pair, side, first, last)
        point = 0
        do i = first, last
          point(points%node(i)) = i
        end do
        call take_points(first, last, point, ends, a, middles)
      end do
    end do
    middles%is_any = any(middles%a > 0.0_wp)

  contains

    !> Points, where they are, that are such; those that are alone are none.
    pure subroutine take_points(first, last, point, ends, a, middles)
      integer, intent(in) :: first, last
      integer, intent(in) :: point(:)      !! (n_nodes) that of a node; 0: there is none
      integer, intent(in) :: ends(:, :)    !! (2,n_nodes)
      real(wp), intent(in) :: a(:)         !! (n_nodes) [-]
      type(edge_middles_t), intent(inout) :: middles
      integer :: i

      do i = first, last
        if (weights%alone(i)) cycle
        associate (node => points%node(i))
          if (ends(1, node) == 0) cycle
          if (any(point(ends(:, node)) == 0)) cycle
          middles%ends(:, i) = point(ends(:, node))
          middles%nodes(:, i) = ends(:, node)
          middles%a(i) = a(node)
        end associate
      end do
    end subroutine take_points

    !> The edges of the faces of a pair's slave.
    pure subroutine take_edges_of(pair, ends, a)
      integer, intent(in) :: pair
      integer, intent(inout) :: ends(:, :)  !! (2,n_nodes)
      real(wp), intent(inout) :: a(:)       !! (n_nodes) [-]
      integer :: f

      associate (faces => scene%surfaces(scene%pairs(pair)%surface)%faces)
        do f = 1, size(faces, 2)
          call take_edges(faces(1, f), faces(2, f), ends, a)
        end do
      end associate
    end subroutine take_edges_of

    !> The edges of an element that lie in one of its faces: their middles are nodes of that face.
    pure subroutine take_edges(element, face, ends, a)
      integer, intent(in) :: element, face
      integer, intent(inout) :: ends(:, :)  !! (2,n_nodes)
      real(wp), intent(inout) :: a(:)       !! (n_nodes) [-]
      integer :: k, local

      associate (cell => cells(scene%mesh%connectivity%cell(element)), &
                 first => scene%mesh%connectivity%first(element) - 1, &
                 node => scene%mesh%connectivity%node)
        do k = 1, cell%n_nodes - cell%n_corners
          local = cell%n_corners + k
          if (all(cell%face(:, face) /= local)) cycle
          ends(:, node(first + local)) = node(first + cell%edge(:, k))
          a(node(first + local)) = max(a(node(first + local)), merge(0.25_wp, 0.2_wp, &
            cell%n_face_corners(face) == 4))
        end do
      end associate
    end subroutine take_edges

  end subroutine find_edge_middles

  !> Whether a pair's points are before faces.
  pure logical function is_before_faces(points, pair)
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair

    associate (first => points%first(pair), last => points%first(pair + 1) - 1)
      is_before_faces = any(points%on_surface(first:last))
    end associate
  end function is_before_faces

  !> A quantity at a point from those at its node and at the ends of its edge.
  pure elemental real(wp) function at_point(a, own, one, other)
    real(wp), intent(in) :: a                !! of the point; 0: its node alone counts [-]
    real(wp), intent(in) :: own, one, other

    at_point = own
    if (a > 0.0_wp) at_point = (own - a*one - a*other)/(1.0_wp - 2.0_wp*a)
  end function at_point

  !> A displacement, or place, at a point from those of nodes.
  pure function vector_at_point(middles, node, i, v) result(q)
    type(edge_middles_t), intent(in) :: middles
    integer, intent(in) :: node, i       !! the point's, and the point
    real(wp), intent(in) :: v(:, :)      !! (3,n_nodes) [length]
    real(wp) :: q(3)                     !! [length]

    q = v(:, node)
    if (.not. middles%is_any) return
    if (middles%a(i) > 0.0_wp) q = at_point(middles%a(i), q, v(:, middles%nodes(1, i)), &
      v(:, middles%nodes(2, i)))
  end function vector_at_point

  !> Add the reaction of a point to the forces of nodes.
  pure subroutine spread_reaction(middles, node, i, reaction, force)
    type(edge_middles_t), intent(in) :: middles
    integer, intent(in) :: node, i            !! the point's, and the point
    real(wp), intent(in) :: reaction(3)       !! [force]
    real(wp), intent(inout) :: force(:, :)    !! (3,n_nodes) [force]
    real(wp) :: on_middle(3)
    integer :: k

    on_middle = reaction
    if (middles%is_any) then
      on_middle = reaction/(1.0_wp - 2.0_wp*middles%a(i))
      do k = 1, 2
        if (.not. middles%a(i) > 0.0_wp) exit
        associate (of_end => force(:, middles%nodes(k, i)))
          of_end = of_end - middles%a(i)*on_middle
        end associate
      end do
    end if
    force(:, node) = force(:, node) + on_middle
  end subroutine spread_reaction

end module edge_middles_mod
