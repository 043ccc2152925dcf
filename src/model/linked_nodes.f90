!> Which nodes the stiffness couples: those that share a brick, and with constraints what the nodes
!> of a brick depend on.
module linked_nodes_mod
  use sorting_mod, only: sort_ascending
  use growing_lists_mod, only: append
  use constraints_mod, only: constraints_t, constraint_of
  use mesh_mod, only: mesh_t, node_neighbours
  implicit none
  private

  public :: coupled_nodes, nodes_of_brick

contains

  !> Compressed lists of the nodes that each node is coupled to, itself included, ascending.
  pure subroutine coupled_nodes(mesh, active, start, neighbours)
    type(mesh_t), intent(in) :: mesh
    type(constraints_t), intent(in) :: active          !! chains substituted
    integer, allocatable, intent(out) :: start(:)      !! (n_nodes+1) first of each node's list
    integer, allocatable, intent(out) :: neighbours(:) !! the lists, one after the other
    integer, allocatable :: of_brick(:), first(:), at_node(:), bricks(:), list(:)
    integer :: number(3, mesh%n_nodes), marked(mesh%n_nodes), e, k, l, m, n, node, pass

    if (active%n == 0) then
      call node_neighbours(mesh, start, neighbours)
      return
    end if
    number = constraint_of(active, mesh%n_nodes)
    allocate (first(mesh%n_elements + 1))
    n = 0
    do e = 1, mesh%n_elements
      first(e) = n + 1
      call append(of_brick, n, nodes_of_brick(active, number, mesh%connectivity(:, e)))
    end do
    first(mesh%n_elements + 1) = n + 1

    ! Bricks at each node, then the nodes of these: twice, to count and to store.
    allocate (at_node(mesh%n_nodes + 1), source=0)
    do k = 1, n
      at_node(of_brick(k) + 1) = at_node(of_brick(k) + 1) + 1
    end do
    at_node(1) = 1
    do node = 1, mesh%n_nodes
      at_node(node + 1) = at_node(node) + at_node(node + 1)
    end do
    allocate (bricks(n))
    marked = at_node(:mesh%n_nodes)
    do e = 1, mesh%n_elements
      do k = first(e), first(e + 1) - 1
        bricks(marked(of_brick(k))) = e
        marked(of_brick(k)) = marked(of_brick(k)) + 1
      end do
    end do
    allocate (start(mesh%n_nodes + 1), list(mesh%n_nodes))
    do pass = 1, 2
      marked = 0
      start(1) = 1
      do node = 1, mesh%n_nodes
        m = 0
        do l = at_node(node), at_node(node + 1) - 1
          do k = first(bricks(l)), first(bricks(l) + 1) - 1
            if (marked(of_brick(k)) == node) cycle
            marked(of_brick(k)) = node
            m = m + 1
            list(m) = of_brick(k)
          end do
        end do
        start(node + 1) = start(node) + m
        if (pass == 2) then
          call sort_ascending(list(:m))
          neighbours(start(node):start(node + 1) - 1) = list(:m)
        end if
      end do
      if (pass == 1) allocate (neighbours(start(mesh%n_nodes + 1) - 1))
    end do
  end subroutine coupled_nodes

  !> The nodes of a brick, then the masters of those that depend, each once.
  pure function nodes_of_brick(active, number, nodes) result(all_nodes)
    type(constraints_t), intent(in) :: active
    integer, intent(in) :: number(:, :)  !! (3,n_nodes) of `constraint_of`
    integer, intent(in) :: nodes(8)
    integer, allocatable :: all_nodes(:)
    integer :: a, i, k, n

    n = 0
    call append(all_nodes, n, nodes)
    do a = 1, 8
      do i = 1, 3
        if (number(i, nodes(a)) == 0) cycle
        associate (c => number(i, nodes(a)))
          do k = active%first(c), active%first(c + 1) - 1
            if (any(all_nodes(:n) == active%master(k))) cycle
            call append(all_nodes, n, active%master(k))
          end do
        end associate
      end do
    end do
    all_nodes = all_nodes(:n)
  end function nodes_of_brick

end module linked_nodes_mod
