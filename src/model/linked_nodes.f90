!> Which nodes the stiffness couples: those that share an element or a spring, and with constraints
!> what these nodes depend on.
module linked_nodes_mod
  use sorting_mod, only: sort_ascending
  use growing_lists_mod, only: append
  use lists_mod, only: lists_t, lists_with
  use connectivity_mod, only: nodes_of_element
  use constraints_mod, only: constraints_t, constraint_of
  use mesh_mod, only: mesh_t
  use spring_elements_mod, only: spring_ends
  implicit none
  private

  public :: node_neighbours, coupled_nodes, nodes_with_constraints

contains

  !> Compressed lists of the nodes that share an element with each node, itself included, ascending.
  pure subroutine node_neighbours(mesh, start, neighbours)
    type(mesh_t), intent(in) :: mesh
    integer, allocatable, intent(out) :: start(:)      !! (n_nodes+1) first of each node's list
    integer, allocatable, intent(out) :: neighbours(:) !! the lists, one after the other

    call join_lists(mesh%n_nodes, mesh%connectivity%first, mesh%connectivity%node, start, &
      neighbours)
  end subroutine node_neighbours

  !> Compressed lists of the nodes that each node is coupled to, itself included, ascending.
  pure subroutine coupled_nodes(mesh, active, start, neighbours)
    type(mesh_t), intent(in) :: mesh
    type(constraints_t), intent(in) :: active          !! chains substituted
    integer, allocatable, intent(out) :: start(:)      !! (n_nodes+1) first of each node's list
    integer, allocatable, intent(out) :: neighbours(:) !! the lists, one after the other
    integer, allocatable :: of_element(:)
    integer :: number(3, mesh%n_nodes), first(mesh%n_elements + mesh%springs%n + 1), e, n

    if (active%n == 0 .and. mesh%springs%n == 0) then
      call node_neighbours(mesh, start, neighbours)
      return
    end if
    number = constraint_of(active, mesh%n_nodes)
    n = 0
    do e = 1, mesh%n_elements
      first(e) = n + 1
      call append(of_element, n, nodes_with_constraints(active, number, &
        nodes_of_element(mesh%connectivity, e)))
    end do
    do e = 1, mesh%springs%n
      first(mesh%n_elements + e) = n + 1
      call append(of_element, n, nodes_with_constraints(active, number, &
        spring_ends(mesh%springs, e)))
    end do
    first(size(first)) = n + 1
    call join_lists(mesh%n_nodes, first, of_element(:n), start, neighbours)
  end subroutine coupled_nodes

  !> Of each node all that stand with it in one of several lists, itself included, ascending.
  pure subroutine join_lists(n_nodes, first, list, start, neighbours)
    integer, intent(in) :: n_nodes
    integer, intent(in) :: first(:) !! of each list, then one past the last
    integer, intent(in) :: list(:)  !! the lists, one after the other; in each a node stands once
    integer, allocatable, intent(out) :: start(:)      !! (n_nodes+1) first of each list
    integer, allocatable, intent(out) :: neighbours(:)
    type(lists_t) :: at !! the lists that each node stands in
    integer :: marked(n_nodes), found(n_nodes)
    integer :: k, l, n, node, pass

    at = lists_with(first, list, n_nodes)
    ! Twice over the nodes: once to count, once to store.
    allocate (start(n_nodes + 1))
    do pass = 1, 2
      marked = 0
      start(1) = 1
      do node = 1, n_nodes
        n = 0
        do l = at%first(node), at%first(node + 1) - 1
          do k = first(at%item(l)), first(at%item(l) + 1) - 1
            if (marked(list(k)) == node) cycle
            marked(list(k)) = node
            n = n + 1
            found(n) = list(k)
          end do
        end do
        start(node + 1) = start(node) + n
        if (pass == 2) then
          call sort_ascending(found(:n))
          neighbours(start(node):start(node + 1) - 1) = found(:n)
        end if
      end do
      if (pass == 1) allocate (neighbours(start(n_nodes + 1) - 1))
    end do
  end subroutine join_lists

  !> The nodes of an element, then the masters of those that depend, each once.
  pure function nodes_with_constraints(active, number, nodes) result(all_nodes)
    type(constraints_t), intent(in) :: active
    integer, intent(in) :: number(:, :)  !! (3,n_nodes) of `constraint_of`
    integer, intent(in) :: nodes(:)
    integer, allocatable :: all_nodes(:)
    integer :: a, i, k, n

    n = 0
    call append(all_nodes, n, nodes)
    do a = 1, size(nodes)
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
  end function nodes_with_constraints

end module linked_nodes_mod
