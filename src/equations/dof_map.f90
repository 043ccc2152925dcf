!> Which degrees of freedom are unknowns, and their numbers. Nothing else knows the numbers of nodal
!> values: vectors go from nodes to equations and back here.
module dof_map_mod
  use kinds_mod, only: wp
  implicit none
  private

  public :: dof_map_t, make_dof_map, map_of_numbers, map_of_matrix, part_of_map, numbers_of, &
    equations_of, interface_equations_of, is_unknown, to_equations, to_nodes

  !> Equations 1 .. n_free - n_interface are interior, the last n_interface are of the interface.
  type :: dof_map_t
    integer :: n_free = 0
    integer :: n_interface = 0
    integer, allocatable, private :: equation(:, :)
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

  !> A map of `numbers_of` another, as it is sent to other ranks: equations without nodes.
  pure function map_of_numbers(numbers, n_free, n_interface) result(map)
    integer, intent(in) :: numbers(:, :)         !! (3,n_nodes)
    integer, intent(in) :: n_free, n_interface   !! of the whole map
    type(dof_map_t) :: map

    map%n_free = n_free
    map%n_interface = n_interface
    map%equation = numbers
  end function map_of_numbers

  !> The map of a matrix that has no mesh: every equation is a node of its own.
  pure function map_of_matrix(n) result(map)
    integer, intent(in) :: n
    type(dof_map_t) :: map
    integer :: i

    map%n_free = n
    map%node = [(i, i=1, n)]
    allocate (map%equation(3, n), source=0)
    map%equation(1, :) = map%node
  end function map_of_matrix

  !> The map of some of the nodes, equations numbered as of all.
  pure function part_of_map(map, nodes) result(part)
    type(dof_map_t), intent(in) :: map
    integer, intent(in) :: nodes(:)
    type(dof_map_t) :: part

    part = map_of_numbers(map%equation(:, nodes), map%n_free, map%n_interface)
  end function part_of_map

  !> Every number of the map, 0 where there is no unknown.
  pure function numbers_of(map) result(numbers)
    type(dof_map_t), intent(in) :: map
    integer, allocatable :: numbers(:, :) !! (3,n_nodes)

    numbers = map%equation
  end function numbers_of

  !> The equations of a node along x, y, z, 0 where it has none.
  pure function equations_of(map, node) result(equations)
    type(dof_map_t), intent(in) :: map
    integer, intent(in) :: node
    integer :: equations(3)

    equations = map%equation(:, node)
  end function equations_of

  !> The same counted from the first of the interface, 0 where none is on it.
  pure function interface_equations_of(map, node) result(equations)
    type(dof_map_t), intent(in) :: map
    integer, intent(in) :: node
    integer :: equations(3)

    equations = max(0, map%equation(:, node) - (map%n_free - map%n_interface))
  end function interface_equations_of

  !> Which degrees of freedom are unknowns.
  pure function is_unknown(map) result(unknown)
    type(dof_map_t), intent(in) :: map
    logical, allocatable :: unknown(:, :) !! (3,n_nodes)

    unknown = map%equation > 0
  end function is_unknown

  !> From nodes to equations; what is prescribed is left out.
  pure subroutine to_equations(map, nodal, b)
    type(dof_map_t), intent(in) :: map
    real(wp), intent(in) :: nodal(:, :)   !! (3,n_nodes)
    real(wp), intent(out) :: b(:)         !! (n_free)
    integer :: node, i

    do node = 1, size(nodal, 2)
      do i = 1, 3
        if (map%equation(i, node) > 0) b(map%equation(i, node)) = nodal(i, node)
      end do
    end do
  end subroutine to_equations

  !> From equations to nodes, 0 along prescribed directions.
  pure subroutine to_nodes(map, b, nodal)
    type(dof_map_t), intent(in) :: map
    real(wp), intent(in) :: b(:)          !! (n_free)
    real(wp), intent(out) :: nodal(:, :)  !! (3,n_nodes)
    integer :: node, i

    nodal = 0.0_wp
    do node = 1, size(nodal, 2)
      do i = 1, 3
        if (map%equation(i, node) > 0) nodal(i, node) = b(map%equation(i, node))
      end do
    end do
  end subroutine to_nodes

end module dof_map_mod
