!> Which degrees of freedom are unknowns, and their numbers.
module dof_map_mod
  implicit none
  private

  public :: dof_map_t, make_dof_map

  !> Equations 1 .. n_free - n_interface are interior, the last n_interface are of the interface.
  type :: dof_map_t
    integer :: n_free = 0
    integer :: n_interface = 0
    integer, allocatable :: equation(:, :)
    !! (3,n_nodes) number of each unknown, 0 where prescribed or unused
    integer, allocatable :: node(:)         !! (n_free) node of each equation
  end type dof_map_t

  !> The interface by its nodes, or by its degrees of freedom.
  interface make_dof_map
    module procedure map_of_nodes, map_of_dofs
  end interface make_dof_map

contains

  !> Every degree of freedom of some nodes on the interface.
  pure function map_of_nodes(body, prescribed, interface_nodes) result(map)
    integer, intent(in) :: body(:)             !! (n_nodes) 0 where no element uses the node
    logical, intent(in) :: prescribed(:, :)    !! (3,n_nodes)
    integer, intent(in) :: interface_nodes(:)  !! in any order, repeats allowed
    type(dof_map_t) :: map
    logical :: on_interface(3, size(body))

    on_interface = .false.
    on_interface(:, interface_nodes) = .true.
    map = map_of_dofs(body, prescribed, on_interface)
  end function map_of_nodes

  !> Number the unknowns in the order of the nodes, interior first, interface last.
  pure function map_of_dofs(body, prescribed, on_interface) result(map)
    integer, intent(in) :: body(:)             !! (n_nodes) 0 where no element uses the node
    logical, intent(in) :: prescribed(:, :)    !! (3,n_nodes)
    logical, intent(in) :: on_interface(:, :)  !! (3,n_nodes)
    type(dof_map_t) :: map
    logical :: wanted
    integer :: pass, node, i

    allocate (map%equation(3, size(body)), source=0)
    do pass = 1, 2
      wanted = pass == 2
      do node = 1, size(body)
        if (body(node) == 0) cycle
        do i = 1, 3
          if (prescribed(i, node) .or. (on_interface(i, node) .neqv. wanted)) cycle
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
  end function map_of_dofs

end module dof_map_mod
