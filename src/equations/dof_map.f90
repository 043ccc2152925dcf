!> Which degrees of freedom are unknowns, and their numbers. Nothing else knows the numbers of nodal
!> values: vectors go from nodes to equations and back here.
!>
!> What depends on others by constraints has no equation: forces on it go to the equations of its
!> masters (T^T f), and it moves as they do (T q). docs/theory.md (11.10).
!>
!> Bodies that have turned may be solved for with the factor of where they stood: equations are
!> along axes that have turned with the body, nodal values along x, y, z. docs/theory.md (8.36).
module dof_map_mod
  use kinds_mod, only: wp
  use lists_mod, only: lists_t, lists_by_key
  use constraints_mod, only: constraints_t, constraint_of, follow_masters, give_to_masters, &
    some_constraints
  implicit none
  private

  public :: dof_map_t, make_dof_map, map_of_numbers, map_of_matrix, part_of_map, numbers_of, &
    equations_of, interface_equations_of, interface_terms_of, is_unknown, to_equations, &
    unknowns_of, to_nodes, can_turn, turn_nodes, stop_turning, is_turned, turn_of

  !> Equations 1 .. n_free - n_interface are interior, the last n_interface are of the interface.
  type :: dof_map_t
    integer :: n_free = 0
    integer :: n_interface = 0
    integer, allocatable, private :: equation(:, :)
    !! (3,n_nodes) number of each unknown, 0 where prescribed or unused
    integer, allocatable :: node(:)         !! (n_free) node of each equation
    integer, allocatable :: body_first(:)
    !! (n_blocks+1) where each body begins on the interface, counted from there; made with a mesh
    type(constraints_t) :: constraints      !! active ones, chains substituted
    integer, allocatable, private :: constraint(:, :) !! (3,n_nodes) where there are any
    integer, allocatable, private :: turned_by(:) !! (n_nodes) which of the turns, 0: none
    real(wp), allocatable, private :: turn(:, :, :) !! (3,3,n) columns: axes of the equations [-]
  end type dof_map_t

  !> The interface by its nodes, or by its degrees of freedom.
  interface make_dof_map
    module procedure map_of_nodes, map_of_dofs
  end interface make_dof_map

contains

  !> Every degree of freedom of some nodes on the interface.
  pure type(dof_map_t) function map_of_nodes(body, prescribed, interface_nodes, active) result(map)
    integer, intent(in) :: body(:)             !! (n_nodes) 0 where no element uses the node
    logical, intent(in) :: prescribed(:, :)    !! (3,n_nodes)
    integer, intent(in) :: interface_nodes(:)  !! in any order, repeats allowed
    type(constraints_t), intent(in), optional :: active !! none where left out
    logical :: on_interface(3, size(body))

    on_interface = .false.
    on_interface(:, interface_nodes) = .true.
    map = map_of_dofs(body, prescribed, on_interface, active)
  end function map_of_nodes

  !> Number the unknowns in the order of the nodes, interior first, interface last, there one body
  !> after the other. What depends on others is on the interface by its masters.
  pure type(dof_map_t) function map_of_dofs(body, prescribed, on_interface, active) result(map)
    integer, intent(in) :: body(:)             !! (n_nodes) 0 where no element uses the node
    logical, intent(in) :: prescribed(:, :)    !! (3,n_nodes)
    logical, intent(in) :: on_interface(:, :)  !! (3,n_nodes)
    type(constraints_t), intent(in), optional :: active
    !! of degrees of freedom that are not prescribed, chains substituted; none where left out

    if (present(active)) then
      if (active%n > 0) then
        call number_unknowns(body, prescribed, on_interface .or. masters_of(active, &
          on_interface), constraint_of(active, size(body)) > 0, map)
        map%constraints = active
        allocate (map%constraint(3, size(body)), source=constraint_of(active, size(body)))
        return
      end if
    end if
    call number_unknowns(body, prescribed, on_interface, spread(spread(.false., 1, 3), 2, &
      size(body)), map)
  end function map_of_dofs

  !> The masters of what is on the interface and depends.
  pure function masters_of(active, on_interface) result(is_master)
    type(constraints_t), intent(in) :: active
    logical, intent(in) :: on_interface(:, :)
    logical :: is_master(3, size(on_interface, 2))
    integer :: c, k

    is_master = .false.
    do c = 1, active%n
      if (.not. on_interface(active%dof(c), active%node(c))) cycle
      do k = active%first(c), active%first(c + 1) - 1
        is_master(active%master_dof(k), active%master(k)) = .true.
      end do
    end do
  end function masters_of

  pure subroutine number_unknowns(body, prescribed, on_interface, depends, map)
    integer, intent(in) :: body(:)             !! (n_nodes)
    logical, intent(in), dimension(:, :) :: prescribed, on_interface, depends !! (3,n_nodes)
    type(dof_map_t), intent(out) :: map
    logical :: wanted
    type(lists_t) :: bodies
    integer :: pass, node, i, k

    allocate (map%equation(3, size(body)), source=0)
    ! The nodes of body 0, then of body 1, and so on, each in their order.
    bodies = lists_by_key(body + 1, maxval(body) + 1)
    do pass = 1, 2
      wanted = pass == 2
      do k = 1, size(body)
        node = k
        if (wanted) node = bodies%item(k)
        if (body(node) == 0) cycle
        do i = 1, 3
          if (prescribed(i, node) .or. (on_interface(i, node) .neqv. wanted)) cycle
          if (depends(i, node)) cycle
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
    associate (of => body(map%node(map%n_free - map%n_interface + 1:)))
      map%body_first = [pack([(i, i=1, size(of))], [(i == 1 .or. of(i) /= of(max(1, i - 1)), &
        i=1, size(of))]), size(of) + 1]
    end associate
  end subroutine number_unknowns

  !> A map of `numbers_of` another, as it is sent to other ranks: equations without nodes.
  pure type(dof_map_t) function map_of_numbers(numbers, n_free, n_interface, active) result(map)
    integer, intent(in) :: numbers(:, :)         !! (3,n_nodes)
    integer, intent(in) :: n_free, n_interface   !! of the whole map
    type(constraints_t), intent(in), optional :: active !! of these nodes, none where left out

    map%n_free = n_free
    map%n_interface = n_interface
    map%equation = numbers
    if (.not. present(active)) return
    if (active%n == 0) return
    map%constraints = active
    allocate (map%constraint(3, size(numbers, 2)), source=constraint_of(active, size(numbers, 2)))
  end function map_of_numbers

  !> The map of a matrix that has no mesh: every equation is a node of its own.
  pure type(dof_map_t) function map_of_matrix(n) result(map)
    integer, intent(in) :: n
    integer :: i

    map%n_free = n
    map%node = [(i, i=1, n)]
    allocate (map%equation(3, n), source=0)
    map%equation(1, :) = map%node
  end function map_of_matrix

  !> The map of some of the nodes, equations numbered as of all. Masters of nodes that depend are
  !> among them.
  pure type(dof_map_t) function part_of_map(map, nodes) result(part)
    type(dof_map_t), intent(in) :: map
    integer, intent(in) :: nodes(:)
    integer :: number(size(map%equation, 2)), k

    number = 0
    number(nodes) = [(k, k=1, size(nodes))]
    part = map_of_numbers(map%equation(:, nodes), map%n_free, map%n_interface, &
      some_constraints(map%constraints, number))
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

  !> What a degree of freedom is on the interface, as a sum of coefficients times unknowns there:
  !> its own, those of its masters, or none.
  pure subroutine interface_terms_of(map, node, dof, equations, coefficients)
    type(dof_map_t), intent(in) :: map
    integer, intent(in) :: node, dof
    integer, allocatable, intent(out) :: equations(:) !! counted from the first of the interface
    real(wp), allocatable, intent(out) :: coefficients(:)
    integer :: k, n, c

    c = 0
    if (allocated(map%constraint)) c = map%constraint(dof, node)
    n = map%n_free - map%n_interface
    if (is_turned(map, node)) then
      coefficients = pack(map%turn(dof, :, map%turned_by(node)), map%equation(:, node) > n)
      equations = pack(map%equation(:, node) - n, map%equation(:, node) > n)
      return
    end if
    if (c == 0) then
      k = count(map%equation(dof:dof, node) > n)
      allocate (equations(k), source=map%equation(dof, node) - n)
      allocate (coefficients(k), source=1.0_wp)
      return
    end if
    associate (all => map%constraints, first => map%constraints%first(c), &
               last => map%constraints%first(c + 1) - 1)
      allocate (equations(last - first + 1), coefficients(last - first + 1))
      do k = first, last
        equations(k - first + 1) = map%equation(all%master_dof(k), all%master(k)) - n
        coefficients(k - first + 1) = all%weight(k)
      end do
    end associate
    coefficients = pack(coefficients, equations > 0)
    equations = pack(equations, equations > 0)
  end subroutine interface_terms_of

  !> Which degrees of freedom are unknowns.
  pure function is_unknown(map) result(unknown)
    type(dof_map_t), intent(in) :: map
    logical, allocatable :: unknown(:, :) !! (3,n_nodes)

    unknown = map%equation > 0
  end function is_unknown

  !> Whether equations of some nodes can turn: each has all three, alike on the interface or not, or
  !> none, and depends on no others, nor others on it.
  pure logical function can_turn(map, nodes)
    type(dof_map_t), intent(in) :: map
    integer, intent(in) :: nodes(:)
    integer :: k

    can_turn = .true.
    do k = 1, size(nodes)
      associate (equations => map%equation(:, nodes(k)), n => map%n_free - map%n_interface)
        can_turn = can_turn .and. (all(equations > n) .or. all(equations > 0 .and. equations <= n) &
          .or. all(equations == 0))
      end associate
    end do
    if (map%constraints%n == 0 .or. .not. can_turn) return
    associate (part => map%constraints)
      do k = 1, size(nodes)
        can_turn = can_turn .and. all(map%constraint(:, nodes(k)) == 0) .and. .not. &
          any(part%master(:part%first(part%n + 1) - 1) == nodes(k))
      end do
    end associate
  end function can_turn

  !> Turn the equations of nodes of which that can be.
  pure subroutine turn_nodes(map, nodes, turn)
    type(dof_map_t), intent(inout) :: map
    integer, intent(in) :: nodes(:)
    real(wp), intent(in) :: turn(3, 3) !! of the body since its factor was made
    real(wp), allocatable :: turns(:, :, :)
    integer :: n

    if (.not. allocated(map%turned_by)) allocate (map%turned_by(size(map%equation, 2)), source=0)
    n = 0
    if (allocated(map%turn)) n = size(map%turn, 3)
    allocate (turns(3, 3, n + 1))
    if (n > 0) turns(:, :, :n) = map%turn
    turns(:, :, n + 1) = turn
    call move_alloc(turns, map%turn)
    map%turned_by(nodes) = merge(n + 1, 0, map%equation(1, nodes) > 0)
  end subroutine turn_nodes

  !> Equations along x, y, z again.
  pure subroutine stop_turning(map)
    type(dof_map_t), intent(inout) :: map

    if (allocated(map%turned_by)) deallocate (map%turned_by, map%turn)
  end subroutine stop_turning

  !> Whether the equations of a node are along axes of their own; without a node, any.
  pure logical function is_turned(map, node)
    type(dof_map_t), intent(in) :: map
    integer, intent(in), optional :: node

    is_turned = allocated(map%turned_by)
    if (is_turned .and. present(node)) is_turned = map%turned_by(node) > 0
  end function is_turned

  !> These axes, in columns.
  pure function turn_of(map, node) result(turn)
    type(dof_map_t), intent(in) :: map
    integer, intent(in) :: node
    real(wp) :: turn(3, 3)

    turn = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [3, 3])
    if (is_turned(map, node)) turn = map%turn(:, :, map%turned_by(node))
  end function turn_of

  !> From nodes to equations, T^T; what is prescribed is left out.
  pure subroutine to_equations(map, nodal, b)
    type(dof_map_t), intent(in) :: map
    real(wp), intent(in) :: nodal(:, :)   !! (3,n_nodes) forces
    real(wp), intent(out) :: b(:)         !! (n_free)
    real(wp), allocatable :: given(:, :)

    if (map%constraints%n == 0) then
      call pick(map, nodal, b)
    else
      allocate (given(3, size(nodal, 2)), source=nodal)
      call give_to_masters(map%constraints, given)
      call pick(map, given, b)
    end if
  end subroutine to_equations

  !> Displacements of the nodes as those of the equations; what depends on others is left out.
  pure function unknowns_of(map, nodal) result(unknowns)
    type(dof_map_t), intent(in) :: map
    real(wp), intent(in) :: nodal(:, :)   !! (3,n_nodes)
    real(wp) :: unknowns(map%n_free)

    call pick(map, nodal, unknowns)
  end function unknowns_of

  !> The values that have an equation.
  pure subroutine pick(map, nodal, b)
    type(dof_map_t), intent(in) :: map
    real(wp), intent(in) :: nodal(:, :)
    real(wp), intent(out) :: b(:)
    integer :: node, i

    do node = 1, size(nodal, 2)
      if (is_turned(map, node)) then
        b(map%equation(:, node)) = matmul(nodal(:, node), turn_of(map, node))
        cycle
      end if
      do i = 1, 3
        if (map%equation(i, node) > 0) b(map%equation(i, node)) = nodal(i, node)
      end do
    end do
  end subroutine pick

  !> From equations to nodes, T; 0 along prescribed directions.
  pure subroutine to_nodes(map, b, nodal)
    type(dof_map_t), intent(in) :: map
    real(wp), intent(in) :: b(:)          !! (n_free)
    real(wp), intent(out) :: nodal(:, :)  !! (3,n_nodes)
    integer :: node, i

    nodal = 0.0_wp
    do node = 1, size(nodal, 2)
      if (is_turned(map, node)) then
        nodal(:, node) = matmul(turn_of(map, node), b(map%equation(:, node)))
        cycle
      end if
      do i = 1, 3
        if (map%equation(i, node) > 0) nodal(i, node) = b(map%equation(i, node))
      end do
    end do
    if (map%constraints%n > 0) call follow_masters(map%constraints, nodal)
  end subroutine to_nodes

end module dof_map_mod
