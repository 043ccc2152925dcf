!> Every brick cut into eight: nodes between those that are there, on edges, faces and in bricks.
!>
!> A brick is trilinear in its nodes, and so are its eighths in theirs: they fill what it filled. Of
!> one edge or face all bricks share the new node, so a mesh stays a mesh.
module refine_bricks_mod
  use kinds_mod, only: wp
  use mesh_mod, only: mesh_t
  use sorting_mod, only: order_of_columns, sort_ascending
  use surfaces_mod, only: face_nodes
  implicit none
  private

  public :: refine_bricks, middle_of, fill_between, corner_faces

  integer, parameter :: edge_nodes(2, 12) = reshape([ &
    1, 2,  2, 3,  3, 4,  4, 1,  5, 6,  6, 7,  7, 8,  8, 5,  1, 5,  2, 6,  3, 7,  4, 8], [2, 12])
  integer, parameter :: corner(3, 8) = reshape([ &
    0, 0, 0,  1, 0, 0,  1, 1, 0,  0, 1, 0,  0, 0, 1,  1, 0, 1,  1, 1, 1,  0, 1, 1], [3, 8])
  !! of a unit cube, in the order of a brick's nodes

contains

  !> Cut bricks into eight.
  !>
  !> Brick `e` becomes the bricks 8 (e - 1) + 1 to 8 e, one at each of its corners in their order,
  !> its axes and the numbers of its faces kept. New nodes follow those that are there: first those
  !> on edges, then on faces, then inside, each in the order of the nodes that they lie between. So
  !> two sides of a mesh that correspond node by node, in ascending order, still do so.
  pure subroutine refine_bricks(n_nodes, bricks, fine, between)
    integer, intent(in) :: n_nodes
    integer, intent(in) :: bricks(:, :)                !! (8,n)
    integer, allocatable, intent(out) :: fine(:, :)    !! (8,8n)
    integer, allocatable, intent(out) :: between(:, :)
    !! (8,n_new) nodes that node n_nodes + i lies between: two or four in ascending order, or the
    !! eight of a brick in its own; else 0
    integer, allocatable :: edges(:, :), faces(:, :), on_edge(:), on_face(:)
    integer :: table(0:2, 0:2, 0:2), number(27), x(3), n, n_edges, n_faces, e, a, b

    n = size(bricks, 2)
    allocate (edges(2, 12*n), faces(4, 6*n))
    do e = 1, n
      do a = 1, 12
        edges(:, 12*(e - 1) + a) = bricks(edge_nodes(:, a), e)
        call sort_ascending(edges(:, 12*(e - 1) + a))
      end do
      do a = 1, 6
        faces(:, 6*(e - 1) + a) = bricks(face_nodes(:, a), e)
        call sort_ascending(faces(:, 6*(e - 1) + a))
      end do
    end do
    call number_columns(edges, on_edge, n_edges)
    call number_columns(faces, on_face, n_faces)
    allocate (fine(8, 8*n), between(8, n_edges + n_faces + n))
    between = 0
    table = places()
    do e = 1, n
      number(:8) = bricks(:, e)
      number(9:20) = n_nodes + on_edge(12*e - 11:12*e)
      number(21:26) = n_nodes + n_edges + on_face(6*e - 5:6*e)
      number(27) = n_nodes + n_edges + n_faces + e
      do a = 1, 12
        between(:2, number(8 + a) - n_nodes) = edges(:, 12*(e - 1) + a)
      end do
      do a = 1, 6
        between(:4, number(20 + a) - n_nodes) = faces(:, 6*(e - 1) + a)
      end do
      between(:, number(27) - n_nodes) = bricks(:, e)
      do a = 1, 8
        do b = 1, 8
          x = corner(:, a) + corner(:, b)
          fine(b, 8*(e - 1) + a) = number(table(x(1), x(2), x(3)))
        end do
      end do
    end do
  end subroutine refine_bricks

  !> Which of a brick's 27 nodes, its corners, middles of edges and of faces and its own, is at each
  !> place of a grid of three by three by three.
  pure function places() result(table)
    integer :: table(0:2, 0:2, 0:2)
    integer :: i, x(3)

    table(1, 1, 1) = 27
    do i = 1, 8
      x = 2*corner(:, i)
      table(x(1), x(2), x(3)) = i
    end do
    do i = 1, 12
      x = sum(corner(:, edge_nodes(:, i)), dim=2)
      table(x(1), x(2), x(3)) = 8 + i
    end do
    do i = 1, 6
      x = sum(corner(:, face_nodes(:, i)), dim=2)/2
      table(x(1), x(2), x(3)) = 20 + i
    end do
  end function places

  !> Number columns by their entries, equal ones alike, in ascending order of these.
  pure subroutine number_columns(columns, number, n)
    integer, intent(in) :: columns(:, :)
    integer, allocatable, intent(out) :: number(:)
    integer, intent(out) :: n !! different ones
    integer, allocatable :: order(:)
    integer :: i

    call order_of_columns(columns, order)
    allocate (number(size(order)))
    n = 0
    do i = 1, size(order)
      if (i == 1) then
        n = 1
      else if (any(columns(:, order(i)) /= columns(:, order(i - 1)))) then
        n = n + 1
      end if
      number(order(i)) = n
    end do
  end subroutine number_columns

  !> The mean of the values of the nodes that a new one lies between.
  !>
  !> Summed in pairs: of equal values it is that value to the last bit, so that what is flat stays
  !> flat.
  pure real(wp) function middle_of(values, between)
    real(wp), intent(in) :: values(:)   !! (n_nodes)
    integer, intent(in) :: between(8)   !! as of refine_bricks
    real(wp) :: pairs(4)
    integer :: i

    do i = 1, 4
      pairs(i) = 0.0_wp
      if (between(2*i) > 0) pairs(i) = 0.5_wp*(values(between(2*i - 1)) + values(between(2*i)))
    end do
    middle_of = pairs(1)
    if (between(4) > 0) middle_of = 0.5_wp*(pairs(1) + pairs(2))
    if (between(8) > 0) middle_of = 0.5_wp*(middle_of + 0.5_wp*(pairs(3) + pairs(4)))
  end function middle_of

  !> Give nodes that lie between the deck's the mean of the values of these.
  pure subroutine fill_between(mesh, values)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(inout) :: values(:) !! (n_nodes)
    integer :: i

    if (.not. allocated(mesh%between)) return
    ! A node that was put between others comes before those between it and others.
    do i = 1, size(mesh%between, 2)
      values(mesh%n_given + i) = middle_of(values, mesh%between(:, i))
    end do
  end subroutine fill_between

  !> The faces S1 to S6 of a brick that its eighth at a corner has a part of.
  pure function corner_faces(a) result(has)
    integer, intent(in) :: a !! 1..8
    logical :: has(6)

    has = any(face_nodes == a, dim=1)
  end function corner_faces

end module refine_bricks_mod
