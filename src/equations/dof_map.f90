!> Which degrees of freedom are unknowns, and their numbers.
module dof_map_mod
  implicit none
  private

  public :: dof_map_t, make_dof_map

  !> Equations 1 .. n_free - n_interface are interior, the last n_interface belong to slave nodes.
  type :: dof_map_t
    integer :: n_free = 0
    integer :: n_interface = 0
    integer, allocatable :: equation(:, :)
    !! (3,n_nodes) number of each unknown, 0 where prescribed or unused
    integer, allocatable :: node(:)         !! (n_free) node of each equation
  end type dof_map_t

contains

  !> Number the unknowns in the order of the nodes, interior first, interface last.
  pure function make_dof_map(body, prescribed, interface_nodes) result(map)
    integer, intent(in) :: body(:)             !! (n_nodes) 0 where no element uses the node
    logical, intent(in) :: prescribed(:, :)    !! (3,n_nodes)
    integer, intent(in) :: interface_nodes(:)  !! slave nodes, in any order, repeats allowed
    type(dof_map_t) :: map
    logical :: on_interface(size(body)), wanted
    integer :: pass, node, i

    on_interface = .false.
    on_interface(interface_nodes) = .true.
    allocate (map%equation(3, size(body)), source=0)
    do pass = 1, 2
      wanted = pass == 2
      do node = 1, size(body)
        if (body(node) == 0 .or. (on_interface(node) .neqv. wanted)) cycle
        do i = 1, 3
          if (prescribed(i, node)) cycle
          map%n_free = map%n_free + 1
          map%equation(i, node) = map%n_free
        end do
      end do
      if (pass == 1) map%n_interface = map%n_free
    end do
    map%n_interface = map%n_free - map%n_interface
    allocate (map%node(map%n_free))
    do node = 1, size(body)
      do i = 1, 3
        if (map%equation(i, node) > 0) map%node(map%equation(i, node)) = node
      end do
    end do
  end function make_dof_map

end module dof_map_mod
