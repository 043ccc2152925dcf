!> The order of elimination: METIS's nested dissection of the nodes, the interface last.
!>
!> METIS works on the graph of nodes and is expanded to degrees of freedom: a third of the graph,
!> better orders. MUMPS gets the order as PERM_IN, because with a Schur complement its own orderings
!> become AMD.
module ordering_mod
  use errors_mod, only: error_t
  use dof_map_mod, only: dof_map_t, equations_of
  use metis_graph_mod, only: dissect
  implicit none
  private

  public :: order_equations

contains

  !> The position of every equation in the order of elimination.
  subroutine order_equations(map, start, neighbours, position, error, n_last)
    type(dof_map_t), intent(in) :: map
    integer, intent(in) :: start(:)      !! (n_nodes+1) lists of neighbours, as from node_neighbours
    integer, intent(in) :: neighbours(:)
    integer, allocatable, intent(out) :: position(:)
    !! (n_free) 1..n_free; the interface keeps the last ones, where it is last
    type(error_t), allocatable, intent(out) :: error !! METIS failed (memory)
    integer, intent(in), optional :: n_last
    !! how many are eliminated last, or not at all: those of the interface where it is left out
    integer, allocatable :: vertex(:), node_of(:), node_order(:)
    integer :: n_interior, node, i, n, next

    n_interior = map%n_free - map%n_interface
    if (present(n_last)) n_interior = map%n_free - n_last
    position = [(i, i=1, map%n_free)]

    ! Vertices: the nodes that own an interior equation.
    allocate (vertex(size(start) - 1), source=0)
    n = 0
    do i = 1, n_interior
      node = map%node(i)
      if (vertex(node) /= 0) cycle
      n = n + 1
      vertex(node) = n
    end do
    if (n < 2) return
    allocate (node_of(n), node_order(n))
    do node = 1, size(vertex)
      if (vertex(node) > 0) node_of(vertex(node)) = node
    end do

    call dissect(vertex, node_of, start, neighbours, node_order, error)
    if (allocated(error)) return
    next = 0
    do i = 1, n
      associate (equations => equations_of(map, node_of(node_order(i))))
        do node = 1, 3
          ! A node may have interior equations beside one on the interface.
          if (equations(node) == 0 .or. equations(node) > n_interior) cycle
          next = next + 1
          position(equations(node)) = next
        end do
      end associate
    end do
  end subroutine order_equations

end module ordering_mod
