!> Every element cut into equal parts along each of its edges, or along all but those of one of its
!> axes: nodes between those that are there, on edges, faces and in elements.
!>
!> New nodes lie where the shape functions of the element take them, and those of its pieces are
!> these functions again: pieces fill what the element filled, curved edges stay as curved. Of one
!> edge or face all elements share the new nodes, so a mesh stays a mesh.
module refine_elements_mod
  use cell_cuts_mod, only: cell_cut_t, cut_cell, is_simplex, most_variants, shortest_diagonal
  use cell_shapes_mod, only: shape_functions
  use cells_mod, only: cell_t, cells, face_corners, has_middles, hexahedron_20, hexahedron_8, &
    hexahedron_nodes, tetrahedron_4, tetrahedron_10
  use connectivity_mod, only: connectivity_t, make_connectivity
  use kinds_mod, only: wp
  use mesh_mod, only: mesh_t
  use sorting_mod, only: order_of_columns, sort_ascending
  implicit none
  private

  public :: division_t, divide_elements, pieces_t, refine_elements, widest, local_axis, &
    side_dimensions, side_weights, value_between, fill_between, edge_nodes, along_edge

  !> How elements are cut.
  type :: division_t
    integer :: parts = 2               !! into which edges are cut
    integer, allocatable :: variant(:) !! (elements) as of cut_cell
  end type division_t

  !> What the elements of a mesh are cut into, all or some of them.
  type :: pieces_t
    type(connectivity_t) :: connectivity !! new nodes behind those that there are
    integer, allocatable :: origin(:)    !! (n) ascending: the element that each is all or part of
    integer, allocatable :: number(:)    !! (n) which piece; 0: all of it
    logical, allocatable :: is_outer(:, :) !! (6,n) as of cut_cell
  end type pieces_t

  !> Local nodes of each edge of an 8-node hexahedron.
  integer, parameter :: edge_nodes(2, 12) = cells(hexahedron_8)%edge
  integer, parameter :: along_edge(12) = [1, 2, 1, 2, 1, 2, 1, 2, 3, 3, 3, 3]
  !! the local axis of each

contains

  !> How elements are cut: hexahedra of a slice not across it, tetrahedra by the shortest inner
  !> diagonal.
  pure function divide_elements(coordinates, connectivity, parts, across) result(division)
    real(wp), intent(in) :: coordinates(:, :)        !! (3,n_nodes) [length]
    type(connectivity_t), intent(in) :: connectivity !! no longer than its elements
    integer, intent(in) :: parts                     !! of every edge
    integer, intent(in) :: across                    !! the axis across the slice; 0: there is none
    type(division_t) :: division
    integer :: e

    division%parts = parts
    allocate (division%variant(size(connectivity%cell)), source=0)
    do e = 1, size(division%variant)
      associate (cell => connectivity%cell(e), nodes => connectivity%node( &
                 connectivity%first(e):connectivity%first(e + 1) - 1))
        if (is_simplex(cell)) then
          division%variant(e) = shortest_diagonal(coordinates(:, nodes(:cells(cell)%n_corners)), &
            nodes(:cells(cell)%n_corners))
        else if (across > 0) then
          ! Of wedges that stand on their triangles it is the third.
          division%variant(e) = 3
          if (cells(cell)%n_corners == hexahedron_nodes) division%variant(e) = &
            local_axis(coordinates(:, nodes), across)
        end if
      end associate
    end do
  end function divide_elements

  !> The local axis of an 8-node hexahedron that goes the farthest along an axis: 1 from its first
  !> node to the second, 2 to the fourth, 3 to the fifth.
  pure integer function local_axis(x, axis)
    real(wp), intent(in) :: x(:, :) !! (3,8) its nodes [length]
    integer, intent(in) :: axis

    local_axis = maxloc(abs(x(axis, [2, 4, 5]) - x(axis, 1)), 1)
  end function local_axis

  !> How many nodes a new one may lie between.
  pure integer function widest(connectivity)
    type(connectivity_t), intent(in) :: connectivity !! no longer than its elements

    widest = max(hexahedron_nodes, maxval([cells(connectivity%cell)%n_nodes]))
  end function widest

  !> Cut elements into pieces, `parts`**3 of each or in a slice `parts`**2.
  !>
  !> The pieces of an element follow each other, those along its first edge first, its axes and the
  !> numbers of its faces kept. New nodes follow those that are there: first those on edges, then on
  !> faces, then inside, each in the order of the nodes that they lie between. So two sides of a
  !> mesh that correspond node by node, in ascending order, still do so.
  subroutine refine_elements(n_nodes, connectivity, division, pieces, between, place)
    integer, intent(in) :: n_nodes
    type(connectivity_t), intent(in) :: connectivity !! no longer than its elements
    type(division_t), intent(in) :: division
    !! of hexahedra that meet, the same local axis across a slice
    type(pieces_t), intent(out) :: pieces
    integer, allocatable, intent(out) :: between(:, :)
    !! (widest,n_new) nodes that node n_nodes + i lies between: those of an edge, its middle last,
    !! of a face or of an element in the order of its cell; else 0
    real(wp), allocatable, intent(out) :: place(:, :)
    !! (3,n_new) where: along the first edge of a face or an element, from the first node to the
    !! last around the face, and in the element's third direction; 0 to 1 along each edge [-]
    type(cell_cut_t) :: cuts(size(cells), 0:most_variants)
    integer, allocatable :: edges(:, :), faces(:, :), on_edge(:), on_face(:), grid(:, :, :), fine(:)
    integer, allocatable :: steps_of_edge(:), places_of_face(:), edge_before(:), face_before(:)
    integer :: first_edge(size(connectivity%cell) + 1), first_face(size(connectivity%cell) + 1)
    integer :: n, n_pieces, n_new, n_inside, at, e, a, i, k

    n = size(connectivity%cell)
    n_pieces = 0
    n_inside = 0
    at = 0
    first_edge(1) = 0
    first_face(1) = 0
    do e = 1, n
      associate (row => connectivity%cell(e), cut => cuts(connectivity%cell(e), &
                 division%variant(e)))
        if (.not. allocated(cut%piece)) cut = cut_cell(row, division%parts, division%variant(e))
        n_pieces = n_pieces + size(cut%piece, 3)
        n_inside = n_inside + count_inside(cells(row), cut)
        at = at + size(cut%piece, 2)*size(cut%piece, 3)
        first_edge(e + 1) = first_edge(e) + cells(row)%n_edges
        first_face(e + 1) = first_face(e) + cells(row)%n_faces
      end associate
    end do
    allocate (edges(2, first_edge(n + 1)), faces(face_corners, first_face(n + 1)), source=0)
    allocate (steps_of_edge(size(edges, 2)), places_of_face(size(faces, 2)), source=0)
    do e = 1, n
      associate (cell => cells(connectivity%cell(e)), nodes => connectivity%node( &
                 connectivity%first(e):connectivity%first(e + 1) - 1), &
                 cut => cuts(connectivity%cell(e), division%variant(e)))
        do a = 1, cell%n_edges
          k = first_edge(e) + a
          edges(:, k) = nodes(cell%edge(:, a))
          call sort_ascending(edges(:, k))
          steps_of_edge(k) = maxval(abs(cut%corner(:, cell%edge(1, a)) - cut%corner(:, &
            cell%edge(2, a))))
          if (steps_of_edge(k) == 1) edges(:, k) = 0
        end do
        do a = 1, cell%n_faces
          k = first_face(e) + a
          places_of_face(k) = count_on_face(cell, cut, a)
          if (places_of_face(k) == 0) cycle
          associate (corners => cell%face(:cell%n_face_corners(a), a))
            faces(:size(corners), k) = nodes(corners)
          end associate
          call sort_ascending(faces(:, k))
        end do
      end associate
    end do
    call number_columns(edges, on_edge)
    call number_columns(faces, on_face)
    ! What has a node in its middle has two steps a part, and one new node less.
    associate (cell => connectivity%cell)
      call count_before(on_edge, steps_of_edge - 1 - merge(1, 0, [((has_middles(cell(e)), &
        a=1, cells(cell(e))%n_edges), e=1, n)]), 0, edge_before)
    end associate
    call count_before(on_face, places_of_face, edge_before(size(edge_before)), face_before)
    n_new = face_before(size(face_before)) + n_inside
    allocate (pieces%origin(n_pieces), pieces%number(n_pieces), pieces%is_outer(6, n_pieces))
    allocate (fine(at))
    allocate (between(widest(connectivity), n_new), source=0)
    allocate (place(3, n_new), source=0.0_wp)
    allocate (grid(0:0, 0:0, 0:0))
    n_pieces = 0
    at = 0
    n_inside = face_before(size(face_before))
    do e = 1, n
      associate (cell => cells(connectivity%cell(e)), nodes => connectivity%node( &
                 connectivity%first(e):connectivity%first(e + 1) - 1), &
                 cut => cuts(connectivity%cell(e), division%variant(e)))
        if (any(ubound(grid) /= cut%steps)) then
          deallocate (grid)
          allocate (grid(0:cut%steps(1), 0:cut%steps(2), 0:cut%steps(3)))
        end if
        grid = 0
        do a = 1, size(nodes)
          grid(cut%node(1, a), cut%node(2, a), cut%node(3, a)) = nodes(a)
        end do
        do a = 1, cell%n_edges
          k = first_edge(e) + a
          if (on_edge(k) > 0) call put_on_edge(cell, cut, nodes, cell%edge(:, a), &
            edge_before(on_edge(k)))
        end do
        do a = 1, cell%n_faces
          k = first_face(e) + a
          if (on_face(k) > 0) call put_on_face(cell, cut, nodes, &
            cell%face(:cell%n_face_corners(a), a), face_before(on_face(k)))
        end do
        call put_inside(cut, nodes, n_inside)
        do i = 1, size(cut%piece, 3)
          do a = 1, size(nodes)
            at = at + 1
            fine(at) = grid(cut%piece(1, a, i), cut%piece(2, a, i), cut%piece(3, a, i))
          end do
          n_pieces = n_pieces + 1
          pieces%origin(n_pieces) = e
          pieces%number(n_pieces) = i
          pieces%is_outer(:, n_pieces) = cut%is_outer(:, i)
        end do
      end associate
    end do
    pieces%connectivity = make_connectivity(connectivity%cell(pieces%origin), fine)

  contains

    !> The nodes on an edge, from its lower node on.
    subroutine put_on_edge(cell, cut, nodes, ends, before)
      type(cell_t), intent(in) :: cell
      type(cell_cut_t), intent(in) :: cut
      integer, intent(in) :: nodes(:)
      integer, intent(in) :: ends(2) !! of the element's nodes
      integer, intent(in) :: before  !! new nodes before these
      integer :: from, to, steps, x(3), i, k

      from = merge(ends(1), ends(2), nodes(ends(1)) < nodes(ends(2)))
      to = sum(ends) - from
      steps = maxval(abs(cut%corner(:, to) - cut%corner(:, from)))
      k = before
      do i = 1, steps - 1
        x = cut%corner(:, from) + i*((cut%corner(:, to) - cut%corner(:, from))/steps)
        if (grid(x(1), x(2), x(3)) > 0) cycle ! its middle
        k = k + 1
        grid(x(1), x(2), x(3)) = n_nodes + k
        between(:2, k) = nodes([from, to])
        if (size(nodes) > cell%n_corners) between(3, k) = nodes(middle(cell, from, to))
        place(1, k) = real(i, wp)/real(steps, wp)
      end do
    end subroutine put_on_edge

    !> The nodes in a face, from its lowest node on, towards the lower one beside it first.
    subroutine put_on_face(cell, cut, nodes, corners, before)
      type(cell_t), intent(in) :: cell
      type(cell_cut_t), intent(in) :: cut
      integer, intent(in) :: nodes(:)
      integer, intent(in) :: corners(:) !! of the element's nodes, around the face
      integer, intent(in) :: before
      integer :: around(2*size(corners)), x(3), d(3, 2), steps(2), n, i, j, k, m

      n = size(corners)
      around(:n) = cshift(corners, minloc(nodes(corners), dim=1) - 1)
      if (nodes(around(n)) < nodes(around(2))) around([2, n]) = around([n, 2])
      m = n
      if (size(nodes) > cell%n_corners) then
        do i = 1, n
          around(n + i) = middle(cell, around(i), around(1 + mod(i, n)))
        end do
        m = 2*n
      end if
      d(:, 1) = cut%corner(:, around(2)) - cut%corner(:, around(1))
      d(:, 2) = cut%corner(:, around(n)) - cut%corner(:, around(1))
      steps = maxval(abs(d), dim=1)
      d = d/spread(steps, 1, 3)
      k = before
      do j = 1, steps(2) - 1
        do i = 1, merge(steps(1) - j, steps(1), n == 3) - 1
          x = cut%corner(:, around(1)) + i*d(:, 1) + j*d(:, 2)
          if (.not. cut%is_used(x(1), x(2), x(3))) cycle
          k = k + 1
          grid(x(1), x(2), x(3)) = n_nodes + k
          between(:m, k) = nodes(around(:m))
          place(:2, k) = real([i, j], wp)/real(steps, wp)
        end do
      end do
    end subroutine put_on_face

    subroutine put_inside(cut, nodes, k)
      type(cell_cut_t), intent(in) :: cut
      integer, intent(in) :: nodes(:)
      integer, intent(inout) :: k !! new nodes before these, then with these
      integer :: x, y, z

      do z = 0, cut%steps(3)
        do y = 0, cut%steps(2)
          do x = 0, cut%steps(1)
            if (.not. cut%is_used(x, y, z) .or. grid(x, y, z) > 0) cycle
            k = k + 1
            grid(x, y, z) = n_nodes + k
            between(:size(nodes), k) = nodes
            place(:, k) = real([x, y, z], wp)/real(cut%steps, wp)
          end do
        end do
      end do
    end subroutine put_inside

  end subroutine refine_elements

  !> The mid-side node between two corners.
  pure integer function middle(cell, one, other)
    type(cell_t), intent(in) :: cell
    integer, intent(in) :: one, other

    do middle = 1, cell%n_edges
      if (all(cell%edge(:, middle) == [one, other]) .or. &
        all(cell%edge(:, middle) == [other, one])) exit
    end do
    middle = cell%n_corners + middle
  end function middle

  !> The new nodes in a face.
  pure integer function count_on_face(cell, cut, face) result(n)
    type(cell_t), intent(in) :: cell
    type(cell_cut_t), intent(in) :: cut
    integer, intent(in) :: face
    integer :: d(3, 2), x(3), last, steps(2), i, j

    last = cell%n_face_corners(face)
    associate (corner => cut%corner(:, cell%face(:last, face)))
      d(:, 1) = corner(:, 2) - corner(:, 1)
      d(:, 2) = corner(:, last) - corner(:, 1)
      n = 0
      steps = maxval(abs(d), dim=1)
      d = d/spread(steps, 1, 3)
      do j = 1, steps(2) - 1
        do i = 1, merge(steps(1) - j, steps(1), last == 3) - 1
          x = corner(:, 1) + i*d(:, 1) + j*d(:, 2)
          if (cut%is_used(x(1), x(2), x(3))) n = n + 1
        end do
      end do
    end associate
  end function count_on_face

  !> The new nodes in a cell.
  pure integer function count_inside(cell, cut) result(n)
    type(cell_t), intent(in) :: cell
    type(cell_cut_t), intent(in) :: cut
    integer :: a, i, steps

    n = count(cut%is_used) - size(cut%node, 2)
    do a = 1, cell%n_edges
      steps = maxval(abs(cut%corner(:, cell%edge(1, a)) - cut%corner(:, cell%edge(2, a))))
      n = n - (steps - 1)
      if (cell%n_nodes > cell%n_corners) n = n + 1
    end do
    do i = 1, cell%n_faces
      n = n - count_on_face(cell, cut, i)
    end do
  end function count_inside

  !> Number columns by their entries, equal ones alike, in ascending order of these.
  pure subroutine number_columns(columns, number)
    integer, intent(in) :: columns(:, :)           !! of zeros: not to be numbered
    integer, allocatable, intent(out) :: number(:) !! 0 of such
    integer, allocatable :: order(:)
    integer :: i, n

    call order_of_columns(columns, order)
    allocate (number(size(order)))
    n = 0
    do i = 1, size(order)
      if (all(columns(:, order(i)) == 0)) then
        n = 0
      else if (i == 1) then
        n = 1
      else if (any(columns(:, order(i)) /= columns(:, order(i - 1)))) then
        n = n + 1
      end if
      number(order(i)) = n
    end do
  end subroutine number_columns

  !> How many new nodes there are before those of each edge or face, and behind the last.
  pure subroutine count_before(number, n_of_each, n_before, before)
    integer, intent(in) :: number(:)    !! of number_columns
    integer, intent(in) :: n_of_each(:) !! of each column
    integer, intent(in) :: n_before     !! before the first
    integer, allocatable, intent(out) :: before(:)
    integer :: i, n, next

    allocate (before(max(0, maxval(number)) + 1), source=0)
    do i = 1, size(number)
      if (number(i) > 0) before(number(i)) = n_of_each(i)
    end do
    next = n_before
    do i = 1, size(before)
      n = before(i)
      before(i) = next
      next = next + n
    end do
  end subroutine count_before

  !> Whether a new node lies on an edge (1), in a face (2) or in an element (3).
  pure integer function side_dimensions(place)
    real(wp), intent(in) :: place(3) !! as of refine_elements

    side_dimensions = count(place > 0.0_wp)
  end function side_dimensions

  !> What a new node has of the nodes that it lies between: their shape functions there.
  pure function side_weights(n, place) result(weight)
    integer, intent(in) :: n         !! nodes that it lies between
    real(wp), intent(in) :: place(3) !! as of refine_elements
    real(wp) :: weight(n)
    integer :: row, i
    integer, allocatable :: nodes(:)

    ! A side is a part of a cell where the other natural coordinates are the least.
    nodes = [(i, i=1, n)]
    row = 0
    select case (10*side_dimensions(place) + min(n, 9))
    case (12) ! of an edge
      weight = [1.0_wp - place(1), place(1)]
      return
    case (13)
      row = tetrahedron_10
      nodes = [1, 2, 5]
    case (23) ! of a triangle
      row = tetrahedron_4
    case (26)
      row = tetrahedron_10
      nodes = [1, 2, 3, 5, 6, 7]
    case (24) ! of a quadrilateral
      row = hexahedron_8
    case (28)
      row = hexahedron_20
      nodes = [1, 2, 3, 4, 9, 10, 11, 12]
    case default
      do i = 1, size(cells)
        if (cells(i)%n_nodes == n) row = i
      end do
    end select
    associate (on_cell => shape_functions(cells(row), natural(cells(row), place)))
      weight = on_cell(nodes)
    end associate
  end function side_weights

  !> The natural coordinates of a place from 0 to 1 along each edge.
  pure function natural(cell, place) result(xi)
    type(cell_t), intent(in) :: cell
    real(wp), intent(in) :: place(3)
    real(wp) :: xi(3)
    integer :: i

    xi = place
    do i = 1, 3
      if (count(cell%factor == cell%factor(i)) == 1) xi(i) = 2.0_wp*place(i) - 1.0_wp
    end do
  end function natural

  !> The value at a new node of what the shape functions of the nodes that it lies between carry.
  !>
  !> Of equal values it is that value to the last bit, so that what is flat stays flat.
  pure real(wp) function value_between(values, between, place) result(value)
    real(wp), intent(in) :: values(:)   !! (n_nodes)
    integer, intent(in) :: between(:)   !! as of refine_elements
    real(wp), intent(in) :: place(3)    !! likewise
    integer :: n

    n = count(between > 0)
    if (n /= 2**side_dimensions(place)) then
      associate (first => values(between(1)))
        value = first + dot_product(side_weights(n, place), values(between(:n)) - first)
      end associate
    else if (n == 2) then
      value = along(values(between(1)), values(between(2)), place(1))
    else if (n == 4) then
      value = in_face(between(:4))
    else
      value = along(in_face(between(:4)), in_face(between(5:8)), place(3))
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

end module refine_elements_mod
