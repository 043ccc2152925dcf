!> Which nodes the elements of a mesh have: a row an element, as long as its cell has nodes.
module connectivity_mod
  use growing_lists_mod, only: enlarge
  use cells_mod, only: cells, computed_as, face_corners, face_nodes, hexahedron_8, hexahedron_nodes
  implicit none
  private

  public :: connectivity_t, make_connectivity, make_hexahedra, add_elements, some_elements
  public :: nodes_of_element, nodes_of_hexahedron, nodes_of_face, corners_in, &
    all_nodes_of_face, first_points

  !> The nodes of element e are node(first(e):first(e + 1) - 1), in the order of its cell. There may
  !> be more room in the arrays.
  type :: connectivity_t
    integer, allocatable :: first(:) !! (n_elements+1)
    integer, allocatable :: node(:)
    integer, allocatable :: cell(:)  !! (n_elements) row of the table of cells
  end type connectivity_t

contains

  !> Rows of some cells, one after the other.
  pure type(connectivity_t) function make_connectivity(cell, node) result(connectivity)
    integer, intent(in) :: cell(:) !! (n_elements) row of the table of cells
    integer, intent(in) :: node(:) !! nodes of all, element by element
    integer :: e

    allocate (connectivity%cell, source=cell)
    allocate (connectivity%node, source=node)
    allocate (connectivity%first(size(cell) + 1))
    connectivity%first(1) = 1
    do e = 1, size(cell)
      connectivity%first(e + 1) = connectivity%first(e) + cells(cell(e))%n_nodes
    end do
  end function make_connectivity

  !> Rows of 8-node hexahedra alone.
  pure type(connectivity_t) function make_hexahedra(nodes) result(connectivity)
    integer, intent(in) :: nodes(:, :) !! (8,n_elements)

    connectivity = make_connectivity(spread(hexahedron_8, 1, size(nodes, 2)), &
      reshape(nodes, [size(nodes)]))
  end function make_hexahedra

  !> Put elements of one cell behind the first n, growing the lists as needed.
  pure subroutine add_elements(connectivity, n, cell, nodes)
    type(connectivity_t), intent(inout) :: connectivity !! not allocated: empty
    integer, intent(in) :: n           !! elements there are
    integer, intent(in) :: cell        !! row of the table of cells
    integer, intent(in) :: nodes(:, :) !! (nodes of the cell,more)
    integer :: have, more, e

    if (.not. allocated(connectivity%first)) connectivity = make_hexahedra(reshape([integer ::], &
      [hexahedron_nodes, 0]))
    more = size(nodes, 2)
    have = connectivity%first(n + 1) - 1
    if (n + more > size(connectivity%cell)) then
      call enlarge(connectivity%cell, n, max(n + more, n + n/2))
      call enlarge(connectivity%first, n + 1, size(connectivity%cell) + 1)
    end if
    if (have + size(nodes) > size(connectivity%node)) call enlarge(connectivity%node, have, &
      max(have + size(nodes), have + have/2))
    connectivity%cell(n + 1:n + more) = cell
    connectivity%first(n + 2:n + more + 1) = [(have + 1 + e*size(nodes, 1), e=1, more)]
    connectivity%node(have + 1:have + size(nodes)) = reshape(nodes, [size(nodes)])
  end subroutine add_elements

  !> Some of the elements.
  pure type(connectivity_t) function some_elements(connectivity, elements) result(some)
    type(connectivity_t), intent(in) :: connectivity
    integer, intent(in) :: elements(:)
    integer :: node(sum(cells(connectivity%cell(elements))%n_nodes)), i, n

    n = 0
    do i = 1, size(elements)
      associate (nodes => connectivity%node(connectivity%first(elements(i)): &
                 connectivity%first(elements(i) + 1) - 1))
        node(n + 1:n + size(nodes)) = nodes
        n = n + size(nodes)
      end associate
    end do
    some = make_connectivity(connectivity%cell(elements), node)
  end function some_elements

  !> The nodes of an element.
  pure function nodes_of_element(connectivity, e) result(nodes)
    type(connectivity_t), intent(in) :: connectivity
    integer, intent(in) :: e
    integer :: nodes(connectivity%first(e + 1) - connectivity%first(e))

    nodes = connectivity%node(connectivity%first(e):connectivity%first(e + 1) - 1)
  end function nodes_of_element

  !> The corners of an element as those of an 8-node hexahedron, for kernels. An element that has
  !> fewer repeats some: what is summed at nodes must be added one node after the other.
  pure function nodes_of_hexahedron(connectivity, e) result(nodes)
    type(connectivity_t), intent(in) :: connectivity
    integer, intent(in) :: e
    integer :: nodes(hexahedron_nodes)

    nodes = connectivity%node(connectivity%first(e) - 1 + cells(connectivity%cell(e))%as_hexahedron)
  end function nodes_of_hexahedron

  !> Where the points of quadrature of each element begin in a list of all, element by element;
  !> behind the last element, where they end.
  pure function first_points(connectivity) result(first)
    type(connectivity_t), intent(in) :: connectivity !! no longer than its elements
    integer :: first(size(connectivity%cell) + 1)
    integer :: e

    first(1) = 1
    do e = 1, size(connectivity%cell)
      first(e + 1) = first(e) + cells(computed_as(connectivity%cell(e)))%n_points
    end do
  end function first_points

  !> The corners of a face, anticlockwise from outside; zeros behind those of a triangle.
  pure function nodes_of_face(connectivity, element, face) result(nodes)
    type(connectivity_t), intent(in) :: connectivity
    integer, intent(in) :: element, face
    integer :: nodes(face_corners)
    integer :: k

    nodes = 0
    associate (cell => cells(connectivity%cell(element)))
      do k = 1, cell%n_face_corners(face)
        nodes(k) = connectivity%node(connectivity%first(element) - 1 + cell%face(k, face))
      end do
    end associate
  end function nodes_of_face

  !> All nodes of a face: its corners, then those in the middles of its edges, that between corners
  !> 1 and 2 first; zeros behind them.
  pure function all_nodes_of_face(connectivity, element, face) result(nodes)
    type(connectivity_t), intent(in) :: connectivity
    integer, intent(in) :: element, face
    integer :: nodes(face_nodes)
    integer :: k

    nodes = 0
    associate (cell => cells(connectivity%cell(element)))
      do k = 1, face_nodes
        if (cell%face(k, face) > 0) nodes(k) = connectivity%node(connectivity%first(element) - 1 + &
          cell%face(k, face))
      end do
    end associate
  end function all_nodes_of_face

  !> How many corners a face has.
  pure integer function corners_in(nodes) result(n)
    integer, intent(in) :: nodes(:) !! as of nodes_of_face or all_nodes_of_face

    n = count(nodes > 0)
    if (n > face_corners) n = n/2 ! as many are in the middles of edges
  end function corners_in

end module connectivity_mod
