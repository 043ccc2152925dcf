!> Graphs of nodes as METIS orders and divides them.
module metis_graph_mod
  use, intrinsic :: iso_c_binding, only: c_int, c_ptr, c_null_ptr
  use errors_mod, only: error_t, raise, exit_machine
  use text_mod, only: to_text
  use system_mod, only: pass_on_sigterm, stop_if_signalled
  implicit none
  private

  public :: dissect, divide

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

    function metis_partgraphkway(nvtxs, ncon, xadj, adjncy, vwgt, vsize, adjwgt, nparts, tpwgts, &
      ubvec, options, objval, part) result(status) bind(c, name='METIS_PartGraphKway')
      import :: c_int, c_ptr
      implicit none
      integer(c_int), intent(in) :: nvtxs, ncon, xadj(*), adjncy(*), nparts
      type(c_ptr), value :: vwgt, vsize, adjwgt, tpwgts, ubvec, options
      integer(c_int), intent(out) :: objval, part(*)
      integer(c_int) :: status
    end function metis_partgraphkway
  end interface

  integer(c_int), parameter :: metis_ok = 1, metis_error = -4

contains

  !> Nested dissection of the graph of `vertex`: the vertices in their order of elimination.
  subroutine dissect(vertex, node_of, start, neighbours, order, error)
    integer, intent(in) :: vertex(:)   !! (n_nodes) vertex of each node, 0 for none
    integer, intent(in) :: node_of(:)  !! (n) node of each vertex
    integer, intent(in) :: start(:), neighbours(:) !! lists of the nodes, as from node_neighbours
    integer, intent(out) :: order(:)   !! (n)
    type(error_t), allocatable, intent(out) :: error !! METIS failed (memory)
    integer(c_int), allocatable :: xadj(:), adjncy(:), perm(:), iperm(:)
    integer :: n, i

    n = size(node_of)
    call list_edges(vertex, node_of, start, neighbours, xadj, adjncy)
    if (xadj(n + 1) == 0) then ! METIS does not take a graph without edges
      order = [(i, i=1, n)]
      return
    end if
    allocate (perm(n), iperm(n))
    call check(metis_nodend(n, xadj, adjncy, c_null_ptr, c_null_ptr, perm, iperm), &
      'order the equations', error)
    if (.not. allocated(error)) order = perm + 1
  end subroutine dissect

  !> Parts of about as many vertices, with few edges from one to the other.
  subroutine divide(vertex, node_of, start, neighbours, n_parts, part, error)
    integer, intent(in) :: vertex(:)   !! (n_nodes) vertex of each node, 0 for none
    integer, intent(in) :: node_of(:)  !! (n) node of each vertex
    integer, intent(in) :: start(:), neighbours(:) !! lists of the nodes, as from node_neighbours
    integer, intent(in) :: n_parts
    integer, intent(out) :: part(:)    !! (n) of each vertex, 1 to n_parts; a part may be empty
    type(error_t), allocatable, intent(out) :: error !! METIS failed (memory)
    integer(c_int), allocatable :: xadj(:), adjncy(:)
    integer(c_int) :: n_cut
    integer :: n

    n = size(node_of)
    part = 1
    call list_edges(vertex, node_of, start, neighbours, xadj, adjncy)
    if (n_parts == 1 .or. n < n_parts .or. xadj(n + 1) == 0) return
    call check(metis_partgraphkway(n, 1_c_int, xadj, adjncy, c_null_ptr, c_null_ptr, c_null_ptr, &
      n_parts, c_null_ptr, c_null_ptr, c_null_ptr, n_cut, part), 'divide the nodes', error)
    if (.not. allocated(error)) part = part + 1
  end subroutine divide

  !> The graph as METIS takes it, vertices from 0.
  pure subroutine list_edges(vertex, node_of, start, neighbours, xadj, adjncy)
    integer, intent(in) :: vertex(:), node_of(:), start(:), neighbours(:)
    integer(c_int), allocatable, intent(out) :: xadj(:), adjncy(:)
    integer :: i, k, m, other

    allocate (xadj(size(node_of) + 1), adjncy(size(neighbours)))
    m = 0
    do i = 1, size(node_of)
      xadj(i) = m
      do k = start(node_of(i)), start(node_of(i) + 1) - 1
        other = vertex(neighbours(k))
        if (other == 0 .or. other == i) cycle
        m = m + 1
        adjncy(m) = other - 1
      end do
    end do
    xadj(size(node_of) + 1) = m
  end subroutine list_edges

  !> METIS's status as an error.
  subroutine check(status, what, error)
    integer(c_int), intent(in) :: status
    character(*), intent(in) :: what
    type(error_t), allocatable, intent(out) :: error

    ! METIS catches SIGTERM while it works and takes it for an error of its own: given on to whom it
    ! was meant for, it ends the program, or is remembered.
    if (status == metis_error) then
      call pass_on_sigterm()
      call stop_if_signalled(error)
      if (allocated(error)) return
    end if
    if (status /= metis_ok) call raise(error, exit_machine, 'METIS could not '//what// &
      ' (status '//to_text(int(status))//')')
  end subroutine check

end module metis_graph_mod
