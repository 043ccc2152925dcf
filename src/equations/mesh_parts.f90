!> The stiffness in parts: every rank assembles the elements that live there.
!>
!> A part is some elements with the nodes that they use; here a run of elements in the order of the
!> deck, the same number for every rank. An entry to which elements of several ranks contribute has
!> a part on each of them; MUMPS adds the parts.
module mesh_parts_mod
  use kinds_mod, only: wp, i8
  use constraints_mod, only: constraints_t
  use connectivity_mod, only: make_connectivity, nodes_of_element, some_elements
  use mesh_mod, only: mesh_t
  use linked_nodes_mod, only: coupled_nodes
  use spring_elements_mod, only: add_spring_element, some_springs, spring_elements_t, &
    spring_ends
  use scene_mod, only: material_t
  use parallel_mod, only: n_ranks, announce, task_pattern, task_stiffness, send_integers, &
    send_reals, receive_integers, receive_reals, sum_over_ranks
  use finite_forces_mod, only: tangent_t
  use dof_map_mod, only: dof_map_t, map_of_numbers, part_of_map, numbers_of
  use assembly_mod, only: triplets_t, assemble_stiffness, list_pattern, diagonal_of
  implicit none
  private

  public :: assemble_parts, list_parts, assemble_own_part, list_own_part
  public :: elements_of_rank, cut_part, send_part, receive_part

  integer, parameter :: n_sizes = 8
  integer, parameter :: numbers_of_material = 51
  !! nodes, elements, unknowns of the whole mesh, materials, constraints and their masters, nodes of
  !! elements, springs

contains

  ! ------------------------------------------------------------------ host

  !> Assemble the stiffness, on all ranks where there are several; `k` gets this rank's part.
  subroutine assemble_parts(mesh, materials, map, start, neighbours, k, n_computed, tangent)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    type(dof_map_t), intent(in) :: map
    integer, intent(in) :: start(:)      !! (n_nodes+1) lists of neighbours, as from coupled_nodes
    integer, intent(in) :: neighbours(:)
    type(triplets_t), intent(out) :: k
    integer, intent(out) :: n_computed   !! element stiffnesses that were computed, by all ranks
    type(tangent_t), intent(in), optional :: tangent !! as of assemble_stiffness, by this rank alone
    type(mesh_t) :: part
    type(dof_map_t) :: part_map
    logical :: is_whole

    is_whole = .not. are_worth_it(mesh, map)
    if (present(tangent) .or. is_whole) then
      call assemble_stiffness(mesh, materials, map, start, neighbours, k, n_computed, tangent)
      return
    end if
    call announce(task_stiffness)
    call distribute_parts(mesh, materials, map, part, part_map)
    call assemble_part(part, materials, part_map, k, n_computed)
  end subroutine assemble_parts

  !> The pattern that `assemble_parts` fills.
  subroutine list_parts(mesh, materials, map, start, neighbours, k)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    type(dof_map_t), intent(in) :: map
    integer, intent(in) :: start(:)      !! (n_nodes+1) lists of neighbours, as from coupled_nodes
    integer, intent(in) :: neighbours(:)
    type(triplets_t), intent(out) :: k   !! without values
    type(mesh_t) :: part
    type(dof_map_t) :: part_map

    if (.not. are_worth_it(mesh, map)) then
      call list_pattern(map, start, neighbours, k)
      return
    end if
    call announce(task_pattern)
    call distribute_parts(mesh, materials, map, part, part_map)
    call list_part(part, part_map, k)
  end subroutine list_parts

  !> Whether there are parts at all: what is all interface never comes to MUMPS.
  logical function are_worth_it(mesh, map)
    type(mesh_t), intent(in) :: mesh
    type(dof_map_t), intent(in) :: map
    integer :: ranks

    ranks = n_ranks()
    are_worth_it = ranks > 1 .and. ranks <= mesh%n_elements .and. map%n_interface < map%n_free
  end function are_worth_it

  !> Send every other rank its part, and cut the host's own.
  subroutine distribute_parts(mesh, materials, map, part, part_map)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    type(dof_map_t), intent(in) :: map
    type(mesh_t), intent(out) :: part
    type(dof_map_t), intent(out) :: part_map
    integer :: rank, s

    do rank = n_ranks() - 1, 0, -1
      call cut_part(mesh, map, elements_of_rank(mesh%n_elements, rank, n_ranks()), &
        [(s, s=1, merge(mesh%springs%n, 0, rank == 0))], part, part_map)
      if (rank > 0) call send_part(part, materials, part_map, rank)
    end do
  end subroutine distribute_parts

  !> The run of elements of a rank.
  pure function elements_of_rank(n_elements, rank, ranks) result(elements)
    integer, intent(in) :: n_elements
    integer, intent(in) :: rank                !! 0 to ranks - 1
    integer, intent(in) :: ranks               !! how many there are
    integer, allocatable :: elements(:)
    integer :: e

    elements = [(e, e=int(int(rank, i8)*n_elements/ranks) + 1, &
      int(int(rank + 1, i8)*n_elements/ranks))]
  end function elements_of_rank

  !> Some elements and springs, their nodes and what these depend on, in the order of the whole
  !> mesh.
  pure subroutine cut_part(mesh, map, elements, springs, part, part_map, nodes)
    type(mesh_t), intent(in) :: mesh
    type(dof_map_t), intent(in) :: map
    integer, intent(in) :: elements(:)          !! ascending
    integer, intent(in) :: springs(:)
    type(mesh_t), intent(out) :: part         !! without ids and bodies
    type(dof_map_t), intent(out) :: part_map  !! equations of its nodes, numbered as of all
    integer, allocatable, intent(out), optional :: nodes(:) !! its nodes, ascending
    integer :: before, c, e, k, node, number(mesh%n_nodes)
    integer, allocatable :: used(:)

    number = 0
    do e = 1, size(elements)
      number(nodes_of_element(mesh%connectivity, elements(e))) = 1
    end do
    do e = 1, size(springs)
      number(spring_ends(mesh%springs, springs(e))) = 1
    end do
    associate (active => map%constraints)
      before = -1
      do while (active%n > 0 .and. sum(number) /= before)
        before = sum(number)
        do c = 1, active%n
          if (number(active%node(c)) > 0) number(active%master(active%first(c): &
            active%first(c + 1) - 1)) = 1
        end do
      end do
    end associate
    used = pack([(node, node=1, mesh%n_nodes)], number > 0)
    number(used) = [(k, k=1, size(used))]
    part%n_nodes = size(used)
    part%n_elements = size(elements)
    part%coordinates = mesh%coordinates(:, used)
    part%origin = mesh%origin
    part%sector_angle = mesh%sector_angle
    part%connectivity = some_elements(mesh%connectivity, elements)
    part%connectivity%node = number(part%connectivity%node)
    part%element_kind = mesh%element_kind(elements)
    part%material = mesh%material(elements)
    part%springs = some_springs(mesh%springs, springs, number)
    part_map = part_of_map(map, used)
    if (present(nodes)) call move_alloc(used, nodes)
  end subroutine cut_part

  subroutine send_part(part, materials, part_map, rank)
    type(mesh_t), intent(in) :: part
    type(material_t), intent(in) :: materials(:)
    type(dof_map_t), intent(in) :: part_map
    integer, intent(in) :: rank
    integer :: i, n, n_masters

    n = part_map%constraints%n
    n_masters = 0
    if (n > 0) n_masters = part_map%constraints%first(n + 1) - 1
    call send_integers(n_sizes, [part%n_nodes, part%n_elements, part_map%n_free, &
      size(materials), n, n_masters, size(part%connectivity%node), part%springs%n], rank)
    call send_integers(part%n_elements, part%connectivity%cell, rank)
    call send_integers(size(part%connectivity%node), part%connectivity%node, rank)
    call send_integers(part%n_elements, part%element_kind, rank)
    call send_integers(part%n_elements, part%material, rank)
    call send_integers(3*part%n_nodes, numbers_of(part_map), rank)
    call send_reals(3*part%n_nodes, part%coordinates, rank)
    call send_reals(4, [part%origin, part%sector_angle], rank)
    do i = 1, size(materials)
      call send_reals(numbers_of_material, numbers_of_its_law(materials(i)), rank)
    end do
    if (part%springs%n > 0) then
      associate (springs => part%springs)
        call send_integers(springs%n + 1, springs%first(:springs%n + 1), rank)
        call send_integers(springs%first(springs%n + 1) - 1, springs%node, rank)
        call send_reals(3*(springs%first(springs%n + 1) - 1), springs%direction, rank)
        call send_reals(springs%n, springs%stiffness(:springs%n), rank)
      end associate
    end if
    if (n == 0) return
    associate (active => part_map%constraints)
      call send_integers(n, active%node(:n), rank)
      call send_integers(n, active%dof(:n), rank)
      call send_integers(n + 1, active%first(:n + 1), rank)
      call send_integers(n_masters, active%master(:n_masters), rank)
      call send_integers(n_masters, active%master_dof(:n_masters), rank)
      call send_reals(n_masters, active%weight(:n_masters), rank)
    end associate
  end subroutine send_part

  ! ------------------------------------------------------------------ other ranks

  !> Receive a part and assemble it: task_stiffness.
  subroutine assemble_own_part(k)
    type(triplets_t), intent(out) :: k
    type(mesh_t) :: part
    type(material_t), allocatable :: materials(:)
    type(dof_map_t) :: part_map
    integer :: n_computed

    call receive_part(part, materials, part_map)
    call assemble_part(part, materials, part_map, k, n_computed)
  end subroutine assemble_own_part

  !> Receive a part and list its entries: task_pattern.
  subroutine list_own_part(k)
    type(triplets_t), intent(out) :: k !! without values
    type(mesh_t) :: part
    type(material_t), allocatable :: materials(:)
    type(dof_map_t) :: part_map

    call receive_part(part, materials, part_map)
    call list_part(part, part_map, k)
  end subroutine list_own_part

  subroutine receive_part(part, materials, part_map)
    type(mesh_t), intent(out) :: part
    type(material_t), allocatable, intent(out) :: materials(:)
    type(dof_map_t), intent(out) :: part_map
    integer :: sizes(n_sizes)
    type(constraints_t) :: active
    integer, allocatable :: equation(:, :), cell(:), node(:)
    real(wp) :: numbers(numbers_of_material)
    integer :: i

    call receive_integers(n_sizes, sizes)
    part%n_nodes = sizes(1)
    part%n_elements = sizes(2)
    allocate (cell(part%n_elements), node(sizes(7)), part%element_kind(part%n_elements), &
      part%material(part%n_elements), equation(3, part%n_nodes), &
      part%coordinates(3, part%n_nodes), materials(sizes(4)))
    call receive_integers(part%n_elements, cell)
    call receive_integers(size(node), node)
    part%connectivity = make_connectivity(cell, node)
    call receive_integers(part%n_elements, part%element_kind)
    call receive_integers(part%n_elements, part%material)
    call receive_integers(3*part%n_nodes, equation)
    call receive_reals(3*part%n_nodes, part%coordinates)
    call receive_reals(4, numbers(:4))
    part%origin = numbers(:3)
    part%sector_angle = numbers(4)
    do i = 1, size(materials)
      call receive_reals(numbers_of_material, numbers)
      call take_law(numbers, materials(i))
    end do
    if (sizes(8) > 0) call receive_springs(sizes(8), part%springs)
    if (sizes(5) > 0) then
      associate (n => sizes(5), n_masters => sizes(6))
        active%n = n
        allocate (active%node(n), active%dof(n), active%first(n + 1), active%master(n_masters), &
          active%master_dof(n_masters), active%weight(n_masters))
        call receive_integers(n, active%node)
        call receive_integers(n, active%dof)
        call receive_integers(n + 1, active%first)
        call receive_integers(n_masters, active%master)
        call receive_integers(n_masters, active%master_dof)
        call receive_reals(n_masters, active%weight)
      end associate
    end if
    part_map = map_of_numbers(equation, sizes(3), 0, active)
  end subroutine receive_part

  !> What stiffness needs of a material.
  pure function numbers_of_its_law(material) result(numbers)
    type(material_t), intent(in) :: material
    real(wp) :: numbers(numbers_of_material)

    associate (elastic => material%law%elastic, orientation => material%orientation)
      numbers = [elastic%lambda, elastic%shear, merge(1.0_wp, 0.0_wp, elastic%is_isotropic), &
        reshape(elastic%c, [size(elastic%c)]), real([orientation%kind, &
        orientation%turned_about], wp), orientation%angle, orientation%a, orientation%b, &
        orientation%origin]
    end associate
  end function numbers_of_its_law

  !> Take what these numbers say.
  pure subroutine take_law(numbers, material)
    real(wp), intent(in) :: numbers(numbers_of_material)
    type(material_t), intent(inout) :: material

    associate (elastic => material%law%elastic, orientation => material%orientation)
      elastic%lambda = numbers(1)
      elastic%shear = numbers(2)
      elastic%is_isotropic = numbers(3) > 0.5_wp
      elastic%c = reshape(numbers(4:39), [6, 6])
      orientation%kind = nint(numbers(40))
      orientation%turned_about = nint(numbers(41))
      orientation%angle = numbers(42)
      orientation%a = numbers(43:45)
      orientation%b = numbers(46:48)
      orientation%origin = numbers(49:51)
    end associate
  end subroutine take_law

  subroutine receive_springs(n, springs)
    integer, intent(in) :: n
    type(spring_elements_t), intent(out) :: springs
    integer :: first(n + 1), s
    integer, allocatable :: node(:)
    real(wp), allocatable :: direction(:, :)
    real(wp) :: stiffness(n)

    call receive_integers(n + 1, first)
    allocate (node(first(n + 1) - 1), direction(3, first(n + 1) - 1))
    call receive_integers(size(node), node)
    call receive_reals(size(direction), direction)
    call receive_reals(n, stiffness)
    do s = 1, n
      call add_spring_element(springs, 0, node(first(s):first(s + 1) - 1), &
        direction(:, first(s):first(s + 1) - 1), stiffness(s))
    end do
  end subroutine receive_springs

  ! ------------------------------------------------------------------ all ranks

  subroutine assemble_part(part, materials, part_map, k, n_computed)
    type(mesh_t), intent(in) :: part
    type(material_t), intent(in) :: materials(:)
    type(dof_map_t), intent(in) :: part_map
    type(triplets_t), intent(out) :: k
    integer, intent(out) :: n_computed !! on all ranks
    integer, allocatable :: start(:), neighbours(:)
    real(wp), allocatable :: diagonal(:)
    real(wp) :: total(1)

    call coupled_nodes(part, part_map%constraints, start, neighbours)
    call assemble_stiffness(part, materials, part_map, start, neighbours, k, n_computed)
    k%is_distributed = .true.
    diagonal = diagonal_of(k)
    call sum_over_ranks(diagonal)
    call move_alloc(diagonal, k%diagonal)
    total = n_computed
    call sum_over_ranks(total)
    n_computed = nint(total(1))
  end subroutine assemble_part

  subroutine list_part(part, part_map, k)
    type(mesh_t), intent(in) :: part
    type(dof_map_t), intent(in) :: part_map
    type(triplets_t), intent(out) :: k
    integer, allocatable :: start(:), neighbours(:)

    call coupled_nodes(part, part_map%constraints, start, neighbours)
    call list_pattern(part_map, start, neighbours, k)
    k%is_distributed = .true.
  end subroutine list_part

end module mesh_parts_mod
