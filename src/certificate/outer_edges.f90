!> The edges of outer faces: where they are looked at, and how far faces beside them stand out of a
!> hollow. docs/theory.md section 6.
module outer_edges_mod
  use kinds_mod, only: wp
  use hulls_mod, only: hulls_t, middle_of, normal_of
  implicit none
  private

  public :: edges_t, edges_of, way_inwards, rises, within

  !> The edges of outer faces.
  type :: edges_t
    integer, allocatable :: node(:, :) !! (2,n) the lower first
    integer, allocatable :: face(:, :) !! (2,n) outer faces that have it; the second may be 0
  end type edges_t

  real(wp), parameter :: within = 1.0e-6_wp
  !! so far within their bodies edges are looked at, and so deep nothing is inside, of the mesh; 370
  !! random decks end alike with 1e-7 to 1e-5 [-]

contains

  !> How far faces stand out of a hollow at most [length]: as chords of the arcs through the middles
  !> of neighbours that lean to each other by up to 40 degrees.
  pure function rises(hulls, edges) result(rise)
    type(hulls_t), intent(in) :: hulls
    type(edges_t), intent(in) :: edges
    real(wp) :: rise(size(hulls%piece))
    real(wp), parameter :: smooth = 0.766_wp !! cosine
    real(wp) :: way(3), normal(3, 2), middle(3, 2), half, bend
    integer :: e, k

    rise = 0.0_wp
    do e = 1, size(edges%node, 2)
      if (edges%face(2, e) == 0) cycle
      do k = 1, 2
        normal(:, k) = normal_of(hulls, edges%face(k, e))
        middle(:, k) = middle_of(hulls, edges%face(k, e))
      end do
      if (dot_product(normal(:, 1), normal(:, 2)) < smooth) cycle
      way = middle(:, 2) - middle(:, 1)
      if (dot_product(normal(:, 1) - normal(:, 2), way) < 0.0_wp) cycle
      bend = norm2(normal(:, 1) - normal(:, 2))/max(tiny(1.0_wp), norm2(way))
      do k = 1, 2
        half = norm2(middle(:, k) - 0.5_wp*sum(hulls%x(:, edges%node(:, e)), 2))
        rise(edges%face(k, e)) = max(rise(edges%face(k, e)), 0.5_wp*half**2*bend)
      end do
    end do
  end function rises

  !> The edges of faces; those that hanging nodes divide are there as a whole and in parts.
  pure type(edges_t) function edges_of(faces, n_nodes) result(edges)
    integer, intent(in) :: faces(:, :) !! (4,n) nodes; the fourth is 0 in a triangle
    integer, intent(in) :: n_nodes
    integer :: first(n_nodes + 1), f, k, n, m, pass, low, high, at

    ! Room for those of each node whose other end has a higher number, whichever way they go.
    allocate (edges%node(2, 4*size(faces, 2)), source=0)
    allocate (edges%face(2, 4*size(faces, 2)), source=0)
    first = 0
    do pass = 1, 2
      do f = 1, size(faces, 2)
        n = count(faces(:, f) > 0)
        do k = 1, n
          low = minval(faces([k, 1 + mod(k, n)], f))
          high = maxval(faces([k, 1 + mod(k, n)], f))
          if (low == high) cycle
          if (pass == 1) then
            first(low + 1) = first(low + 1) + 1
            cycle
          end if
          do at = first(low), first(low + 1) - 1
            if (edges%node(1, at) == 0 .or. edges%node(2, at) == high) exit
          end do
          edges%node(:, at) = [low, high]
          edges%face(merge(1, 2, edges%face(1, at) == 0), at) = f
        end do
      end do
      if (pass == 2) exit
      first(1) = 1
      do m = 2, n_nodes + 1
        first(m) = first(m) + first(m - 1)
      end do
    end do
    n = 0
    do at = 1, size(edges%node, 2)
      if (edges%node(1, at) == 0) cycle
      n = n + 1
      edges%node(:, n) = edges%node(:, at)
      edges%face(:, n) = edges%face(:, at)
    end do
    edges%node = edges%node(:, :n)
    edges%face = edges%face(:, :n)
  end function edges_of

  !> The way from an edge into its body: inwards from its faces, and towards their middles, as an
  !> edge may lie in a plane of symmetry, or at the side of a slice.
  pure function way_inwards(hulls, nodes, faces) result(way)
    type(hulls_t), intent(in) :: hulls
    integer, intent(in) :: nodes(2), faces(2) !! the second may be 0
    real(wp) :: way(3), to_middle(3)
    integer :: k

    way = 0.0_wp
    do k = 1, 2
      if (faces(k) == 0) cycle
      to_middle = middle_of(hulls, faces(k)) - 0.5_wp*sum(hulls%x(:, nodes), 2)
      way = way + to_middle/max(tiny(1.0_wp), norm2(to_middle)) - normal_of(hulls, faces(k))
    end do
    way = 0.5_wp*within*hulls%extent*way
  end function way_inwards

end module outer_edges_mod
