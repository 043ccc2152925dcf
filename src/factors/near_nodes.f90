!> The nodes of the interface, what is near each, and colours that keep them apart.
module near_nodes_mod
  use growing_lists_mod, only: append
  use sorting_mod, only: sort_ascending
  implicit none
  private

  public :: near_nodes_t, find_near_nodes

  !> The nodes of the interface, numbered from 1.
  type :: near_nodes_t
    integer :: n = 0
    integer, allocatable :: first(:)   !! (n+1) unknowns of each, a range of the interface's
    integer, allocatable :: start(:)   !! (n+1) of the lists of nodes near each, itself included
    integer, allocatable :: near(:)    !! ascending in each list
    integer, allocatable :: colour(:)  !! (n)
    integer :: n_colours = 0
  end type near_nodes_t

contains

  !> What is near each node, and colours: all nodes of one are more than twice `reach` apart.
  subroutine find_near_nodes(node, start, neighbours, reach, nodes)
    integer, intent(in) :: node(:)      !! (n_interface) mesh node of each unknown
    integer, intent(in) :: start(:), neighbours(:) !! of the mesh nodes, by elements they share
    integer, intent(in) :: reach        !! elements away
    type(near_nodes_t), intent(out) :: nodes
    integer, allocatable :: number(:), seen(:), found(:), barred(:)
    integer :: i, j, n, n_near, n_found

    nodes = find_nodes(node)
    allocate (number(size(start) - 1), source=0)
    allocate (seen(size(number)), source=0)
    allocate (barred(nodes%n + 1), source=0)
    allocate (found(size(number)), nodes%start(nodes%n + 1), nodes%near(25*nodes%n))
    allocate (nodes%colour(nodes%n), source=0)
    do i = 1, nodes%n
      number(node(nodes%first(i))) = i
    end do
    n = 0
    do i = 1, nodes%n
      nodes%start(i) = n + 1
      call spread_out(node(nodes%first(i)), i, n_near, n_found)
      do j = 1, n_found
        if (number(found(j)) == 0) cycle
        if (nodes%colour(number(found(j))) > 0) barred(nodes%colour(number(found(j)))) = i
        if (j <= n_near) call append(nodes%near, n, number(found(j)))
      end do
      call sort_ascending(nodes%near(nodes%start(i):n))
      nodes%colour(i) = findloc(barred(:nodes%n_colours + 1) /= i, .true., dim=1)
      nodes%n_colours = max(nodes%n_colours, nodes%colour(i))
    end do
    nodes%start(nodes%n + 1) = n + 1

  contains

    !> The mesh nodes within twice the reach of one, those within the reach first.
    subroutine spread_out(from, mark, n_near, n_found)
      integer, intent(in) :: from, mark
      integer, intent(out) :: n_near, n_found
      integer :: ring, begin, ending, a, b

      found(1) = from
      seen(from) = mark
      n_found = 1
      n_near = 1
      begin = 1
      do ring = 1, 2*reach
        ending = n_found
        do a = begin, ending
          do b = start(found(a)), start(found(a) + 1) - 1
            if (seen(neighbours(b)) == mark) cycle
            seen(neighbours(b)) = mark
            n_found = n_found + 1
            found(n_found) = neighbours(b)
          end do
        end do
        begin = ending + 1
        if (ring == reach) n_near = n_found
      end do
    end subroutine spread_out

  end subroutine find_near_nodes

  !> The nodes of the interface; the unknowns of one stand side by side.
  pure type(near_nodes_t) function find_nodes(node) result(nodes)
    integer, intent(in) :: node(:)      !! (n_interface) mesh node of each unknown
    integer :: first(size(node) + 1), i, n, before

    n = 0
    before = 0
    do i = 1, size(node)
      if (node(i) == before) cycle
      before = node(i)
      n = n + 1
      first(n) = i
    end do
    first(n + 1) = size(node) + 1
    nodes%n = n
    allocate (nodes%first(n + 1), source=first(:n + 1))
  end function find_nodes

end module near_nodes_mod
