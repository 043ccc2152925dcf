!> How a cell is cut into equal parts along its edges.
!>
!> The nodes of the pieces lie on a grid: a cell is a product of simplices, and its pieces are the
!> products of the pieces of these. A line has one piece a part. A triangle has upright pieces, its
!> own shape, and between them inverted ones. A tetrahedron has both kinds, and octahedra between
!> them, of which each is cut into four tetrahedra around one of its three diagonals, the same of
!> all. So pieces of a tetrahedron have two shapes beside its own, however many they are.
!>
!> A piece that has a part of a face of the cell has it as its face of the same number.
!> docs/theory.md, section 8.
module cell_cuts_mod
  use cells_mod, only: cell_t, cells, has_middles, most_faces
  use kinds_mod, only: wp
  implicit none
  private

  public :: cell_cut_t, cut_cell, can_be_cut, is_simplex, shortest_diagonal, most_variants

  integer, parameter :: most_variants = 3 !! beside that which is 0

  !> The pieces of a cell.
  type :: cell_cut_t
    integer :: steps(3) = 0 !! of the grid along each natural coordinate
    integer, allocatable :: corner(:, :)    !! (3,n_corners) of the cell, on the grid
    integer, allocatable :: node(:, :)      !! (3,n_nodes) of the cell, on the grid
    integer, allocatable :: piece(:, :, :)  !! (3,n_nodes,n_pieces) of the pieces, on the grid
    logical, allocatable :: is_outer(:, :)
    !! (6,n_pieces) whether the face of a piece is a part of the cell's face of this number
    logical, allocatable :: is_used(:, :, :) !! (0:,0:,0:) places of the grid that pieces have
  end type cell_cut_t

contains

  !> Whether a cell can be cut: the cone over a square is none of these products.
  pure elemental logical function can_be_cut(cell)
    integer, intent(in) :: cell !! row of the table

    can_be_cut = all(cells(cell)%factor > 0)
  end function can_be_cut

  !> Whether a cell is a tetrahedron.
  pure elemental logical function is_simplex(cell)
    integer, intent(in) :: cell !! row of the table

    is_simplex = all(cells(cell)%factor == 1)
  end function is_simplex

  !> The inner diagonal of a tetrahedron between the middles of opposite edges that is the shortest:
  !> 1 from edge 1-2 to 3-4, 2 from 1-3 to 2-4, 3 from 1-4 to 2-3. Of equal ones it is that which
  !> joins the node of the lowest number to the lowest, so that rounding does not choose.
  pure integer function shortest_diagonal(x, nodes) result(diagonal)
    real(wp), intent(in) :: x(:, :)  !! (3,4) corners [length]
    integer, intent(in) :: nodes(:)  !! (4) their numbers
    real(wp), parameter :: equal = 1.0e-9_wp !! digits of decks [-]
    ! The corner that each one has on an edge with each diagonal's edges.
    integer, parameter :: partner(4, 3) = reshape([2, 1, 4, 3,  3, 4, 1, 2,  4, 3, 2, 1], [4, 3])
    real(wp) :: length(3)
    integer :: lowest, i

    do i = 1, 3
      associate (other => pack([2, 3, 4], [2, 3, 4] /= i + 1))
        length(i) = norm2(x(:, 1) + x(:, i + 1) - x(:, other(1)) - x(:, other(2)))
      end associate
    end do
    lowest = minloc(nodes, dim=1)
    diagonal = 0
    do i = 1, 3
      if (length(i) > (1.0_wp + equal)*minval(length)) cycle
      if (diagonal > 0) then
        if (nodes(partner(lowest, i)) > nodes(partner(lowest, diagonal))) cycle
      end if
      diagonal = i
    end do
  end function shortest_diagonal

  !> The places of nodes on a grid.
  pure function grid_of(cell, steps) result(at)
    type(cell_t), intent(in) :: cell
    integer, intent(in) :: steps(3) !! along each natural coordinate
    integer :: at(3, cell%n_nodes)
    integer :: i

    do i = 1, 3
      if (count(cell%factor == cell%factor(i)) == 1) then
        at(i, :) = nint(0.5_wp*(1.0_wp + cell%place(i, :cell%n_nodes))*steps(i))
      else
        at(i, :) = nint(cell%place(i, :cell%n_nodes)*steps(i))
      end if
    end do
  end function grid_of

  !> Cut a cell.
  pure type(cell_cut_t) function cut_cell(row, parts, variant) result(cut)
    integer, intent(in) :: row     !! of the table of cells
    integer, intent(in) :: parts   !! of every edge, 2 or more
    integer, intent(in) :: variant
    !! of a tetrahedron: its inner diagonal, 1 to 3; of others: the coordinate along which it is not
    !! cut, 0: there is none
    integer :: along(3), order, n_pieces, of_others, f, i, k, a

    order = merge(2, 1, has_middles(row))
    along = parts
    if (variant > 0 .and. .not. is_simplex(row)) along(variant) = 1
    associate (cell => cells(row))
      cut%steps = order*along
      allocate (cut%node, source=grid_of(cell, cut%steps))
      cut%corner = cut%node(:, :cell%n_corners)
      n_pieces = product(along)
      allocate (cut%piece(3, cell%n_nodes, n_pieces), cut%is_outer(most_faces, n_pieces))
      cut%piece = 0
      of_others = 1
      ! The pieces of the first simplex follow each other.
      do f = 1, maxval(cell%factor)
        associate (mine => pack([1, 2, 3], cell%factor == f))
          associate (simplex => simplices(size(mine), along(mine(1)), variant))
            do k = 1, n_pieces
              i = 1 + mod((k - 1)/of_others, size(simplex, 3))
              do a = 1, cell%n_corners
                cut%piece(mine, a, k) = order*simplex(:, vertex(cell, mine, a), i)
              end do
            end do
            of_others = of_others*size(simplex, 3)
          end associate
        end associate
      end do
      do a = cell%n_corners + 1, cell%n_nodes
        cut%piece(:, a, :) = (cut%piece(:, cell%edge(1, a - cell%n_corners), :) + &
          cut%piece(:, cell%edge(2, a - cell%n_corners), :))/2
      end do
      do k = 1, n_pieces
        do i = 1, most_faces
          cut%is_outer(i, k) = i <= cell%n_faces
          if (i <= cell%n_faces) cut%is_outer(i, k) = has_part(cell, cut, i, cut%piece(:, :, k))
        end do
      end do
    end associate
    allocate (cut%is_used(0:cut%steps(1), 0:cut%steps(2), 0:cut%steps(3)), source=.false.)
    do k = 1, n_pieces
      do a = 1, size(cut%piece, 2)
        associate (x => cut%piece(:, a, k))
          cut%is_used(x(1), x(2), x(3)) = .true.
        end associate
      end do
    end do
  end function cut_cell

  !> Which vertex of a simplex a corner of the cell is.
  pure integer function vertex(cell, mine, corner)
    type(cell_t), intent(in) :: cell
    integer, intent(in) :: mine(:) !! coordinates of the simplex
    integer, intent(in) :: corner
    integer :: i

    vertex = 1
    do i = 1, size(mine)
      if (cell%place(mine(i), corner) > 0.5_wp) vertex = i + 1
    end do
  end function vertex

  !> Whether a face of a piece is a part of that of the cell: the barycentric coordinate that is 0
  !> on the one is 0 on the other.
  pure logical function has_part(cell, cut, face, piece)
    type(cell_t), intent(in) :: cell
    type(cell_cut_t), intent(in) :: cut
    integer, intent(in) :: face
    integer, intent(in) :: piece(:, :) !! (3,n_nodes)
    integer :: f, v

    has_part = .false.
    associate (corners => cell%face(:cell%n_face_corners(face), face))
      do f = 1, maxval(cell%factor)
        associate (mine => pack([1, 2, 3], cell%factor == f))
          do v = 1, size(mine) + 1
            if (all(barycentric(cut%corner(mine, corners), v, cut%steps(mine(1))) == 0)) has_part &
              = all(barycentric(piece(mine, corners), v, cut%steps(mine(1))) == 0)
          end do
        end associate
      end do
    end associate
  end function has_part

  !> A barycentric coordinate of places in a simplex, in steps.
  pure function barycentric(x, vertex, steps) result(b)
    integer, intent(in) :: x(:, :)
    integer, intent(in) :: vertex, steps
    integer :: b(size(x, 2))

    b = steps - sum(x, dim=1)
    if (vertex > 1) b = x(vertex - 1, :)
  end function barycentric

  !> The pieces of a line, a triangle or a tetrahedron.
  pure function simplices(dimensions, parts, diagonal) result(simplex)
    integer, intent(in) :: dimensions !! 1 to 3
    integer, intent(in) :: parts
    integer, intent(in) :: diagonal   !! of a tetrahedron
    integer :: simplex(dimensions, dimensions + 1, parts**dimensions)
    integer, parameter :: triangle(2, 3) = reshape([0, 0,  1, 0,  0, 1], [2, 3])
    integer, parameter :: tetrahedron(3, 4) = reshape([0, 0, 0,  1, 0, 0,  0, 1, 0,  0, 0, 1], &
      [3, 4])
    ! What is cut off from the far corner of a square or cube, right side out.
    integer, parameter :: inverted(3, 4) = reshape([1, 1, 1,  0, 1, 1,  1, 1, 0,  1, 0, 1], [3, 4])
    integer :: i, j, k, n, m

    n = 0
    select case (dimensions)
    case (1)
      do i = 1, parts
        simplex(1, :, i) = [i - 1, i]
      end do
    case (2)
      do j = 0, parts - 1
        do i = 0, parts - 1 - j
          call add(simplex, n, [i, j], triangle)
          if (i + j < parts - 1) call add(simplex, n, [i + 1, j + 1], -triangle)
        end do
      end do
    case default
      do k = 0, parts - 1
        do j = 0, parts - 1 - k
          do i = 0, parts - 1 - j - k
            call add(simplex, n, [i, j, k], tetrahedron)
            if (i + j + k < parts - 1) then
              do m = 1, 4
                call add(simplex, n, [i, j, k], quarter(diagonal, m))
              end do
            end if
            if (i + j + k < parts - 2) call add(simplex, n, [i, j, k], inverted)
          end do
        end do
      end do
    end select
  end function simplices

  pure subroutine add(simplex, n, at, shape)
    integer, intent(inout) :: simplex(:, :, :)
    integer, intent(inout) :: n !! those that are there
    integer, intent(in) :: at(:), shape(:, :)

    n = n + 1
    simplex(:, :, n) = shape + spread(at, 2, size(shape, 2))
  end subroutine add

  !> One of the four tetrahedra around a diagonal of the octahedron in the corner of a cube, its
  !> face that is parallel to one of the tetrahedron in that corner having the same number as that.
  pure function quarter(diagonal, m) result(corner)
    integer, intent(in) :: diagonal !! 1 to 3
    integer, intent(in) :: m        !! 1 to 4
    integer :: corner(3, 4)
    integer, parameter :: unit(3, 3) = reshape([1, 0, 0,  0, 1, 0,  0, 0, 1], [3, 3])
    integer :: nodes(3, 4), around(3, 5), height(4), i, k

    ! The middles of edges 1-2, 1-3 and 1-4 are the units, opposite to them the sums of the others.
    associate (other => pack([1, 2, 3], [1, 2, 3] /= diagonal))
      around(:, [1, 5]) = spread(unit(:, other(1)), 2, 2)
      around(:, 2) = unit(:, other(2))
      around(:, 3) = 1 - around(:, 1)
      around(:, 4) = 1 - around(:, 2)
    end associate
    nodes = reshape([unit(:, diagonal), 1 - unit(:, diagonal), around(:, m:m + 1)], [3, 4])
    ! Three of them have a barycentric coordinate of 0, that of the vertex opposite to the face.
    corner = nodes
    do i = 1, 4
      height = barycentric(nodes, i, 2)
      if (count(height == 0) /= 3) cycle
      corner(:, i) = nodes(:, maxloc(height, dim=1))
      associate (left => pack([1, 2, 3, 4], [1, 2, 3, 4] /= i), &
                 foot => pack([1, 2, 3, 4], height == 0))
        corner(:, left) = nodes(:, foot)
        k = volume(corner)
        if (k < 0) corner(:, left([1, 2])) = nodes(:, foot([2, 1]))
      end associate
    end do
  end function quarter

  !> Six times the volume of a tetrahedron.
  pure integer function volume(x)
    integer, intent(in) :: x(3, 4)
    integer :: a(3), b(3), c(3)

    a = x(:, 2) - x(:, 1)
    b = x(:, 3) - x(:, 1)
    c = x(:, 4) - x(:, 1)
    volume = a(1)*(b(2)*c(3) - b(3)*c(2)) + a(2)*(b(3)*c(1) - b(1)*c(3)) + &
      a(3)*(b(1)*c(2) - b(2)*c(1))
  end function volume

end module cell_cuts_mod
