!> Every element cut into equal parts along each of its edges, or along all but those of one of its
!> axes: nodes between those that are there, on edges, faces and in elements.
!>
!> An element is trilinear in its nodes, and so are its pieces in theirs: they fill what it filled.
!> Of one edge or face all elements share the new nodes, so a mesh stays a mesh.
module refine_elements_mod
  use kinds_mod, only: wp
  use mesh_mod, only: mesh_t
  use sorting_mod, only: order_of_columns, sort_ascending
  use cells_mod, only: cells, hexahedron_8
  implicit none
  private

  public :: pieces_t, refine_elements, n_pieces, local_axes, value_between, fill_between, &
    piece_faces, edge_nodes, face_nodes, along_edge

  !> What the elements of a mesh are cut into, all or some of them.
  type :: pieces_t
    integer, allocatable :: nodes(:, :) !! (8,n) new ones behind those that there are
    integer, allocatable :: origin(:)   !! (n) ascending: the element that each is all or part of
    integer, allocatable :: number(:)   !! (n) which piece, as of refine_elements; 0: all of it
    integer, allocatable :: uncut(:)    !! (elements before) as of refine_elements
    integer :: parts = 2                !! into which edges are cut
  end type pieces_t

  !> Local nodes of each edge and face of the element.
  integer, parameter :: edge_nodes(2, 12) = cells(hexahedron_8)%edge
  integer, parameter :: face_nodes(4, 6) = cells(hexahedron_8)%face(:4, :)
  integer, parameter :: along_edge(12) = [1, 2, 1, 2, 1, 2, 1, 2, 3, 3, 3, 3]
  !! the local axis of each
  integer, parameter :: across_face(6) = [3, 3, 2, 1, 2, 1] !! the local axis that each is across
  integer, parameter :: corner(3, 8) = reshape([ &
    0, 0, 0,  1, 0, 0,  1, 1, 0,  0, 1, 0,  0, 0, 1,  1, 0, 1,  1, 1, 1,  0, 1, 1], [3, 8])
  !! of a unit cube, in the order of an element's nodes

contains

  !> The local axis of elements across a slice: that which goes the farthest along it.
  pure function local_axes(coordinates, elements, across) result(axes)
    real(wp), intent(in) :: coordinates(:, :) !! (3,n_nodes) [length]
    integer, intent(in) :: elements(:, :)       !! (8,n)
    integer, intent(in) :: across             !! the axis across the slice; 0: there is none
    integer :: axes(size(elements, 2))
    integer :: e

    axes = 0
    if (across == 0) return
    do e = 1, size(elements, 2)
      axes(e) = local_axis(coordinates(:, elements(:, e)), across)
    end do
  end function local_axes

  !> The local axis of an element that goes the farthest along an axis: 1 from its first node to the
  !> second, 2 to the fourth, 3 to the fifth.
  pure integer function local_axis(x, axis)
    real(wp), intent(in) :: x(3, 8) !! its nodes [length]
    integer, intent(in) :: axis

    local_axis = maxloc(abs(x(axis, [2, 4, 5]) - x(axis, 1)), 1)
  end function local_axis

  !> Into how many pieces elements are cut.
  pure integer function n_pieces(parts, uncut)
    integer, intent(in) :: parts    !! as of refine_elements
    integer, intent(in) :: uncut(:) !! likewise

    n_pieces = parts**merge(2, 3, any(uncut > 0))
  end function n_pieces

  !> Cut elements into `n_pieces` pieces.
  !>
  !> Element `e` becomes the elements n_pieces (e - 1) + 1 to n_pieces e, those along its first edge
  !> first, its axes and the numbers of its faces kept. New nodes follow those that are there: first
  !> those on edges, then on faces, then inside, each in the order of the nodes that they lie
  !> between. So two sides of a mesh that correspond node by node, in ascending order, still do so.
  subroutine refine_elements(n_nodes, elements, parts, uncut, fine, between, place)
    integer, intent(in) :: n_nodes
    integer, intent(in) :: elements(:, :)                !! (8,n)
    integer, intent(in) :: parts                       !! 2 or more
    integer, intent(in) :: uncut(:)
    !! (n) local axis of each element whose edges are not cut, the same ones of elements that meet;
    !! of all elements 0: all edges are
    integer, allocatable, intent(out) :: fine(:, :)    !! (8,n_pieces n)
    integer, allocatable, intent(out) :: between(:, :)
    !! (8,n_new) nodes that node n_nodes + i lies between: the two of an edge, the four of a face
    !! one after the other, or the eight of an element; else 0
    real(wp), allocatable, intent(out) :: place(:, :)
    !! (3,n_new) where: along their first edge, from the first to the fourth, to the fifth, 0..1 [-]
    integer, allocatable :: edges(:, :), faces(:, :), on_edge(:), on_face(:)
    integer :: grid(0:parts, 0:parts, 0:parts), along(3), n, n_edges, n_faces, n_insides
    integer :: of_edges, of_faces, pieces, e, a

    n = size(elements, 2)
    pieces = n_pieces(parts, uncut)
    allocate (edges(2, 12*n), faces(4, 6*n), source=0)
    do e = 1, n
      do a = 1, 12
        if (along_edge(a) == uncut(e)) cycle
        edges(:, 12*(e - 1) + a) = elements(edge_nodes(:, a), e)
        call sort_ascending(edges(:, 12*(e - 1) + a))
      end do
      do a = 1, 6
        if (uncut(e) > 0 .and. across_face(a) /= uncut(e)) cycle
        faces(:, 6*(e - 1) + a) = elements(face_nodes(:, a), e)
        call sort_ascending(faces(:, 6*(e - 1) + a))
      end do
    end do
    call number_columns(edges, on_edge, n_edges)
    call number_columns(faces, on_face, n_faces)
    n_insides = merge(0, n, any(uncut > 0))
    of_edges = n_edges*(parts - 1)
    of_faces = n_faces*(parts - 1)**2
    allocate (fine(8, pieces*n), between(8, of_edges + of_faces + n_insides*(parts - 1)**3))
    allocate (place(3, size(between, 2)))
    between = 0
    place = 0.0_wp
    do e = 1, n
      along = merge(1, parts, [1, 2, 3] == uncut(e))
      do a = 1, 8
        grid(along(1)*corner(1, a), along(2)*corner(2, a), along(3)*corner(3, a)) = elements(a, e)
      end do
      do a = 1, 12
        if (along_edge(a) == uncut(e)) cycle
        call put_on_edge(edge_nodes(:, a), (on_edge(12*(e - 1) + a) - 1)*(parts - 1))
      end do
      do a = 1, 6
        if (uncut(e) > 0 .and. across_face(a) /= uncut(e)) cycle
        call put_on_face(face_nodes(:, a), of_edges + (on_face(6*(e - 1) + a) - 1)*(parts - 1)**2)
      end do
      if (uncut(e) == 0) call put_inside(of_edges + of_faces + (e - 1)*(parts - 1)**3)
      call cut(fine(:, pieces*(e - 1) + 1:pieces*e))
    end do

  contains

    !> The nodes on an edge, from its lower node on.
    subroutine put_on_edge(ends, before)
      integer, intent(in) :: ends(2) !! of the element's nodes
      integer, intent(in) :: before  !! new nodes before these
      integer :: from, to, x(3), i

      from = merge(ends(1), ends(2), elements(ends(1), e) < elements(ends(2), e))
      to = sum(ends) - from
      do i = 1, parts - 1
        x = along*corner(:, from) + i*(corner(:, to) - corner(:, from))
        grid(x(1), x(2), x(3)) = n_nodes + before + i
        between(:2, before + i) = [elements(from, e), elements(to, e)]
        place(1, before + i) = real(i, wp)/real(parts, wp)
      end do
    end subroutine put_on_edge

    !> The nodes in a face, from its lowest node on, towards the lower one beside it first.
    subroutine put_on_face(nodes, before)
      integer, intent(in) :: nodes(4) !! of the element's nodes, around the face
      integer, intent(in) :: before
      integer :: around(4), x(3), i, j, k

      around = cshift(nodes, minloc(elements(nodes, e), dim=1) - 1)
      if (elements(around(4), e) < elements(around(2), e)) around([2, 4]) = around([4, 2])
      k = before
      do j = 1, parts - 1
        do i = 1, parts - 1
          k = k + 1
          x = along*corner(:, around(1)) + i*(corner(:, around(2)) - corner(:, around(1))) + &
            j*(corner(:, around(4)) - corner(:, around(1)))
          grid(x(1), x(2), x(3)) = n_nodes + k
          between(:4, k) = elements(around, e)
          place(:2, k) = real([i, j], wp)/real(parts, wp)
        end do
      end do
    end subroutine put_on_face

    subroutine put_inside(before)
      integer, intent(in) :: before
      integer :: x, y, z, k

      k = before
      do z = 1, parts - 1
        do y = 1, parts - 1
          do x = 1, parts - 1
            k = k + 1
            grid(x, y, z) = n_nodes + k
            between(:, k) = elements(:, e)
            place(:, k) = real([x, y, z], wp)/real(parts, wp)
          end do
        end do
      end do
    end subroutine put_inside

    subroutine cut(pieces)
      integer, intent(out) :: pieces(:, :) !! (8,n_pieces)
      integer :: x, y, z, k, b

      k = 0
      do z = 0, along(3) - 1
        do y = 0, along(2) - 1
          do x = 0, along(1) - 1
            k = k + 1
            do b = 1, 8
              pieces(b, k) = grid(x + corner(1, b), y + corner(2, b), z + corner(3, b))
            end do
          end do
        end do
      end do
    end subroutine cut

  end subroutine refine_elements

  !> Number columns by their entries, equal ones alike, in ascending order of these.
  pure subroutine number_columns(columns, number, n)
    integer, intent(in) :: columns(:, :)           !! of zeros: not to be numbered
    integer, allocatable, intent(out) :: number(:) !! 0 of such
    integer, intent(out) :: n !! different ones
    integer, allocatable :: order(:)
    integer :: i

    call order_of_columns(columns, order)
    allocate (number(size(order)))
    n = 0
    do i = 1, size(order)
      if (columns(1, order(i)) == 0) then
        n = 0
      else if (i == 1) then
        n = 1
      else if (any(columns(:, order(i)) /= columns(:, order(i - 1)))) then
        n = n + 1
      end if
      number(order(i)) = n
    end do
  end subroutine number_columns

  !> The value at a new node of what is linear along every edge of those that it lies between.
  !>
  !> Of equal values it is that value to the last bit, so that what is flat stays flat.
  pure real(wp) function value_between(values, between, place) result(value)
    real(wp), intent(in) :: values(:)   !! (n_nodes)
    integer, intent(in) :: between(8)   !! as of refine_elements
    real(wp), intent(in) :: place(3)    !! likewise

    if (between(3) == 0) then
      value = along(values(between(1)), values(between(2)), place(1))
    else if (between(5) == 0) then
      value = in_face(between(:4))
    else
      value = along(in_face(between(:4)), in_face(between(5:)), place(3))
    end if

  contains

    pure real(wp) function in_face(nodes)
      integer, intent(in) :: nodes(4)

      in_face = along(along(values(nodes(1)), values(nodes(2)), place(1)), &
        along(values(nodes(4)), values(nodes(3)), place(1)), place(2))
    end function in_face

    !> From the nearer end: the middle is the mean, whichever end comes first.
    pure real(wp) function along(one, other, t)
      real(wp), intent(in) :: one, other, t

      if (t < 0.5_wp) then
        along = one + t*(other - one)
      else if (t > 0.5_wp) then
        along = other + (1.0_wp - t)*(one - other)
      else
        along = 0.5_wp*(one + other)
      end if
    end function along

  end function value_between

  !> Give nodes that lie between the deck's the values that are linear between these.
  pure subroutine fill_between(mesh, values)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(inout) :: values(:) !! (n_nodes)
    integer :: i

    if (.not. allocated(mesh%between)) return
    do i = 1, size(mesh%between, 2)
      values(mesh%n_given + i) = value_between(values, mesh%between(:, i), mesh%place(:, i))
    end do
  end subroutine fill_between

  !> The faces S1 to S6 of an element that its piece k has a part of.
  pure function piece_faces(k, parts, uncut) result(has)
    integer, intent(in) :: k     !! 1..n_pieces
    integer, intent(in) :: parts
    integer, intent(in) :: uncut !! its local axis, as of refine_elements
    logical :: has(6)
    integer :: along(3), at(3)

    along = merge(1, parts, [1, 2, 3] == uncut)
    at = [mod(k - 1, along(1)), mod((k - 1)/along(1), along(2)), (k - 1)/product(along(:2))]
    associate (first => at == 0, last => at == along - 1)
      has = [first(3), last(3), first(2), last(1), last(2), first(1)]
    end associate
  end function piece_faces

end module refine_elements_mod
