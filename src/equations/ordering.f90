!> The order of elimination: METIS's nested dissection of the nodes, the interface last.
!>
!> METIS works on the graph of nodes and is expanded to degrees of freedom: a third of the graph,
!> better orders. MUMPS gets the order as PERM_IN, because with a Schur complement its own orderings
!> become AMD.
module ordering_mod
  use, intrinsic :: iso_c_binding, only: c_int, c_ptr, c_null_ptr
  use errors_mod, only: error_t, raise, exit_machine
  use text_mod, only: to_text
  use system_mod, only: pass_on_sigterm
  use dof_map_mod, only: dof_map_t, equations_of
  implicit none
  private

  public :: order_equations

  interface
    !> METIS 5, idx_t of 32 bits.
    function metis_nodend(nvtxs, xadj, adjncy, vwgt, options, perm, iperm) result(status) &
      bind(c, name='METIS_NodeND')
      import :: c_int, c_ptr
      implicit none
      integer(c_int), intent(in) :: nvtxs, xadj(*), adjncy(*)
      type(c_ptr), value :: vwgt, options
      integer(c_int), intent(out) :: perm(*), iperm(*)
      integer(c_int) :: status
    end function metis_nodend
  end interface

  integer(c_int), parameter :: metis_ok = 1, metis_error = -4

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

  !> Nested dissection of the graph of `vertex`: the vertices in their order of elimination.
  subroutine dissect(vertex, node_of, start, neighbours, order, error)
    integer, intent(in) :: vertex(:)   !! (n_nodes) vertex of each node, 0 for none
    integer, intent(in) :: node_of(:)  !! (n) node of each vertex
    integer, intent(in) :: start(:), neighbours(:)
    integer, intent(out) :: order(:)   !! (n)
    type(error_t), allocatable, intent(out) :: error
    integer(c_int), allocatable :: xadj(:), adjncy(:), perm(:), iperm(:)
    integer :: n, i, k, m, other
    integer(c_int) :: status

    n = size(node_of)
    allocate (xadj(n + 1), perm(n), iperm(n))
    allocate (adjncy(size(neighbours)))
    m = 0
    do i = 1, n
      xadj(i) = m
      do k = start(node_of(i)), start(node_of(i) + 1) - 1
        other = vertex(neighbours(k))
        if (other == 0 .or. other == i) cycle
        m = m + 1
        adjncy(m) = other - 1
      end do
    end do
    xadj(n + 1) = m
    if (m == 0) then ! METIS does not take a graph without edges
      order = [(i, i=1, n)]
      return
    end if
    status = metis_nodend(n, xadj, adjncy, c_null_ptr, c_null_ptr, perm, iperm)
    ! METIS catches SIGTERM while it works and takes it for an error of its own: given on to whom it
    ! was meant for, it ends the program, or is remembered.
    if (status == metis_error) call pass_on_sigterm()
    if (status /= metis_ok) then
      call raise(error, exit_machine, 'METIS could not order the equations (status '// &
        to_text(int(status))//')')
      return
    end if
    order = perm + 1
  end subroutine dissect

end module ordering_mod
