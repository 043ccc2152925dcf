!> The stiffness matrix of the free degrees of freedom.
module assembly_mod
  use kinds_mod, only: wp, i8
  use constraints_mod, only: constraints_t, constraint_of
  use cells_mod, only: has_middles, hexahedron_nodes
  use connectivity_mod, only: nodes_of_element, nodes_of_hexahedron
  use mesh_mod, only: mesh_t, deck_rounding
  use linked_nodes_mod, only: nodes_with_constraints
  use scene_mod, only: material_t
  use element_laws_mod, only: elasticity_at, varies
  use elements_mod, only: stiffness
  use second_order_mod, only: stiffness_of_second_order => stiffness
  use finite_forces_mod, only: tangent_t, element_tangent
  use spring_elements_mod, only: spring_ends
  use spring_forces_mod, only: spring_tangent
  use inertia_mod, only: inertia_t, mass_factors
  use sorting_mod, only: count_below
  use dof_map_mod, only: dof_map_t, equations_of
  implicit none
  private

  public :: triplets_t, assemble_stiffness, add_mass, list_pattern, diagonal_of, diagonal_ratio, &
    scales_of

  real(wp), parameter :: negligible = 1.0e-13_wp !! of an element, in its shape [-]
  integer, parameter :: n_freedoms = 3*hexahedron_nodes !! of an element
  integer, parameter :: n_remembered = 64 !! shapes: a row of a graded block has no more

  !> Elements whose stiffness is known.
  type :: known_elements_t
    integer :: n = 0                   !! shapes kept
    integer :: next = 1                !! place of the next one
    integer :: n_computed = 0          !! stiffnesses computed so far
    real(wp) :: rounding = 0.0_wp      !! of the largest coordinate of the mesh [length]
    integer :: kind(n_remembered) = 0
    integer :: material(n_remembered) = 0
    real(wp), allocatable :: shape(:, :, :) !! (3,8,n_remembered) corners less the first [length]
    real(wp), allocatable :: ke(:, :, :)    !! (n_freedoms,n_freedoms,n_remembered) [force/length]
  end type known_elements_t

  !> One triangle of a symmetric matrix, each entry once.
  !>
  !> Or the part of one of several ranks, whose sum is the matrix.
  type :: triplets_t
    integer :: n = 0
    logical :: is_distributed = .false.    !! other ranks hold the rest
    integer :: n_negative = 0              !! pivots that the modes of C3D8I have in tangents
    integer,  allocatable :: row(:)   !! row >= column
    integer,  allocatable :: column(:)
    real(wp), allocatable :: value(:) !! [force/length]; not allocated in a pattern
    real(wp), allocatable :: diagonal(:)
    !! (n) of the whole matrix; allocated where it is distributed and has values [force/length]
  end type triplets_t

contains

  !> Sum the element stiffnesses into 3x3 blocks over pairs of nodes, then list the free entries. Of
  !> elements with nodes that depend on others it is T^T K T that is summed.
  !>
  !> At finite strain the tangents at a displacement take their place.
  subroutine assemble_stiffness(mesh, materials, map, start, neighbours, k, n_computed, tangent)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    type(dof_map_t), intent(in) :: map
    integer, intent(in) :: start(:)      !! (n_nodes+1) lists of neighbours, as from coupled_nodes
    integer, intent(in) :: neighbours(:)
    type(triplets_t), intent(out) :: k
    integer, intent(out), optional :: n_computed !! element stiffnesses that were computed
    type(tangent_t), intent(in), optional :: tangent
    integer,  allocatable :: lower_start(:)
    real(wp), allocatable :: blocks(:, :, :)
    type(known_elements_t) :: known
    real(wp) :: ke(n_freedoms, n_freedoms)
    integer, allocatable :: constraint(:, :)
    integer :: e, nodes(hexahedron_nodes), negative, of_element

    negative = 0
    allocate (constraint(3, mesh%n_nodes), source=constraint_of(map%constraints, mesh%n_nodes))
    lower_start = lower_lists(start, neighbours)
    allocate (blocks(3, 3, lower_start(mesh%n_nodes + 1) - 1), source=0.0_wp)

    allocate (known%shape(3, hexahedron_nodes, n_remembered), &
      known%ke(n_freedoms, n_freedoms, n_remembered))
    known%rounding = 4.0_wp*deck_rounding(mesh%coordinates, mesh%origin)
    do e = 1, mesh%n_elements
      if (has_middles(mesh%connectivity%cell(e))) then
        known%n_computed = known%n_computed + 1
        call add_second_order(nodes_of_element(mesh%connectivity, e))
        cycle
      end if
      nodes = nodes_of_hexahedron(mesh%connectivity, e)
      if (present(tangent)) then
        call element_tangent(mesh, materials, tangent, e, ke, of_element)
        negative = negative + of_element
        known%n_computed = known%n_computed + 1
      else
        call find_stiffness(mesh, materials, e, known, ke)
      end if
      call add_element(nodes, ke)
    end do
    call add_springs()
    call list_free_entries(map, start, neighbours, lower_start, k, blocks)
    if (present(n_computed)) n_computed = known%n_computed
    k%n_negative = negative

  contains

    subroutine add_springs()
      real(wp) :: at(3, mesh%n_nodes), projection
      integer :: s

      if (mesh%springs%n == 0) return
      at = 0.0_wp
      projection = 0.0_wp
      if (present(tangent)) then
        at = tangent%at
        projection = tangent%projection
      end if
      do s = 1, mesh%springs%n
        call add_element(spring_ends(mesh%springs, s), spring_tangent(mesh, s, at, &
          present(tangent), projection))
      end do
    end subroutine add_springs

    subroutine add_second_order(nodes)
      integer, intent(in) :: nodes(:)
      real(wp) :: ke(3*size(nodes), 3*size(nodes))

      if (present(tangent)) then
        call element_tangent(mesh, materials, tangent, e, ke)
      else
        ke = stiffness_of_second_order(mesh%connectivity%cell(e), mesh%coordinates(:, nodes), &
          elasticity_at(mesh, materials, e))
      end if
      call add_element(nodes, ke)
    end subroutine add_second_order

    subroutine add_element(nodes, ke)
      integer,  intent(in) :: nodes(:)
      real(wp), intent(in) :: ke(:, :) !! [force/length]

      call add_blocks(map%constraints, constraint, nodes, ke, start, neighbours, lower_start, &
        blocks)
    end subroutine add_element

  end subroutine assemble_stiffness

  !> Add the mass of a dynamic *STEP to the stiffness, but for what puts right the inertia of rigid
  !> motions, which is no matrix of few entries.
  subroutine add_mass(mesh, inertia, map, start, neighbours, k)
    type(mesh_t), intent(in) :: mesh
    type(inertia_t), intent(in) :: inertia
    type(dof_map_t), intent(in) :: map
    integer, intent(in) :: start(:), neighbours(:) !! of the stiffness
    type(triplets_t), intent(inout) :: k
    type(triplets_t) :: mass
    integer,  allocatable :: lower_start(:), constraint(:, :)
    real(wp), allocatable :: blocks(:, :, :)
    real(wp) :: pair(6, 6), factor(mesh%n_nodes)
    integer :: node, l, i

    factor = mass_factors(inertia)
    allocate (constraint(3, mesh%n_nodes), source=constraint_of(map%constraints, mesh%n_nodes))
    lower_start = lower_lists(start, neighbours)
    allocate (blocks(3, 3, lower_start(mesh%n_nodes + 1) - 1), source=0.0_wp)
    do node = 1, mesh%n_nodes
      do l = inertia%mass%first(node), inertia%mass%first(node + 1) - 1
        associate (m => factor(node)*inertia%mass%value(l), other => inertia%mass%other(l))
          if (other > node .or. .not. abs(m) > 0.0_wp) cycle
          pair = 0.0_wp
          do i = 1, 3
            pair(i, i) = merge(m, 0.0_wp, other == node)
            pair(i, 3 + i) = m
            pair(3 + i, i) = m
          end do
          if (other == node) then
            call add_blocks(map%constraints, constraint, [node], pair(:3, :3), start, &
              neighbours, lower_start, blocks)
          else
            call add_blocks(map%constraints, constraint, [node, other], pair, start, neighbours, &
              lower_start, blocks)
          end if
        end associate
      end do
    end do
    call list_free_entries(map, start, neighbours, lower_start, mass, blocks)
    k%value = k%value + mass%value
  end subroutine add_mass

  !> Add the matrix of some nodes.
  pure subroutine add_blocks(active, constraint, nodes, ke, start, neighbours, lower_start, blocks)
    type(constraints_t), intent(in) :: active
    integer, intent(in) :: constraint(:, :)  !! (3,n_nodes) of `constraint_of`
    integer, intent(in) :: nodes(:)
    real(wp), intent(in) :: ke(:, :)         !! [force/length]
    integer, intent(in) :: start(:), neighbours(:), lower_start(:)
    real(wp), intent(inout) :: blocks(:, :, :) !! (3,3,entries) [force/length]
    integer :: a, b, entry

    if (any(constraint(:, nodes) > 0)) then
      call add_linked(active, constraint, nodes, ke, start, neighbours, lower_start, blocks)
      return
    end if
    do a = 1, size(nodes)
      do b = 1, size(nodes)
        if (nodes(b) > nodes(a)) cycle
        entry = 1 + count_below(nodes(b), neighbours(start(nodes(a)):start(nodes(a) + 1) - 1))
        entry = lower_start(nodes(a)) + entry - 1
        blocks(:, :, entry) = blocks(:, :, entry) + ke(3*a - 2:3*a, 3*b - 2:3*b)
      end do
    end do
  end subroutine add_blocks

  !> Add T^T K T of an element with nodes that depend on others.
  pure subroutine add_linked(active, constraint, nodes, ke, start, neighbours, lower_start, blocks)
    type(constraints_t), intent(in) :: active
    integer, intent(in) :: constraint(:, :)  !! (3,n_nodes) of `constraint_of`
    integer, intent(in) :: nodes(:)
    real(wp), intent(in) :: ke(:, :)         !! [force/length]
    integer, intent(in) :: start(:), neighbours(:), lower_start(:)
    real(wp), intent(inout) :: blocks(:, :, :) !! (3,3,entries) [force/length]
    integer, allocatable :: linked(:)
    real(wp), allocatable :: kt(:, :), k(:, :) !! K T and T^T K T
    integer :: a, b, i, l, c, entry

    allocate (linked, source=nodes_with_constraints(active, constraint, nodes))
    allocate (kt(3*size(nodes), 3*size(linked)), k(3*size(linked), 3*size(linked)), source=0.0_wp)
    ! T has few entries: a 1 a row of what depends on nothing.
    do a = 1, size(nodes)
      do i = 1, 3
        c = constraint(i, nodes(a))
        if (c == 0) then
          kt(:, at(a, i)) = kt(:, at(a, i)) + ke(:, at(a, i))
          cycle
        end if
        do l = active%first(c), active%first(c + 1) - 1
          b = at(findloc(linked, active%master(l), dim=1), active%master_dof(l))
          kt(:, b) = kt(:, b) + active%weight(l)*ke(:, at(a, i))
        end do
      end do
    end do
    do a = 1, size(nodes)
      do i = 1, 3
        c = constraint(i, nodes(a))
        if (c == 0) then
          k(at(a, i), :) = k(at(a, i), :) + kt(at(a, i), :)
          cycle
        end if
        do l = active%first(c), active%first(c + 1) - 1
          b = at(findloc(linked, active%master(l), dim=1), active%master_dof(l))
          k(b, :) = k(b, :) + active%weight(l)*kt(at(a, i), :)
        end do
      end do
    end do
    do a = 1, size(linked)
      do b = 1, size(linked)
        if (linked(b) > linked(a)) cycle
        entry = 1 + count_below(linked(b), neighbours(start(linked(a)): &
          start(linked(a) + 1) - 1))
        entry = lower_start(linked(a)) + entry - 1
        blocks(:, :, entry) = blocks(:, :, entry) + k(3*a - 2:3*a, 3*b - 2:3*b)
      end do
    end do

  contains

    pure integer function at(node, direction)
      integer, intent(in) :: node, direction !! of a list of nodes

      at = 3*(node - 1) + direction
    end function at

  end subroutine add_linked

  !> Rows and columns of the triplets that `assemble_stiffness` would give, in the same order.
  pure subroutine list_pattern(map, start, neighbours, k)
    type(dof_map_t), intent(in) :: map
    integer, intent(in) :: start(:)      !! (n_nodes+1) lists of neighbours, as from coupled_nodes
    integer, intent(in) :: neighbours(:)
    type(triplets_t), intent(out) :: k   !! without values

    call list_free_entries(map, start, neighbours, lower_lists(start, neighbours), k)
  end subroutine list_pattern

  !> Where the list of each node begins when only neighbours up to the node itself are kept: the
  !> lists ascend, so these come first.
  pure function lower_lists(start, neighbours) result(lower_start)
    integer, intent(in) :: start(:), neighbours(:)
    integer :: lower_start(size(start)) !! (n_nodes+1)
    integer :: node

    lower_start(1) = 1
    do node = 1, size(start) - 1
      lower_start(node + 1) = lower_start(node) + count(neighbours(start(node):start(node + 1) - &
        1) <= node)
    end do
  end function lower_lists

  !> The stiffness of an element: congruent elements of one kind and material have one, as far as
  !> the rounding of their coordinates tells.
  pure subroutine find_stiffness(mesh, materials, e, known, ke)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    integer, intent(in) :: e
    type(known_elements_t), intent(inout) :: known
    real(wp), intent(out) :: ke(n_freedoms, n_freedoms) !! [force/length]
    real(wp) :: x(3, hexahedron_nodes), shape(3, hexahedron_nodes), rounding
    integer :: i

    x = mesh%coordinates(:, nodes_of_hexahedron(mesh%connectivity, e))
    shape = x - spread(x(:, 1), 2, hexahedron_nodes)
    ! Elements near the origin carry the rounding of edges far away; not so much that it is felt.
    rounding = 4.0_wp*epsilon(1.0_wp)*maxval(abs(x))
    rounding = max(rounding, min(known%rounding, negligible*maxval(abs(shape))))
    if (varies(mesh, materials(mesh%material(e)))) then
      ke = stiffness(mesh%element_kind(e), x, elasticity_at(mesh, materials, e))
      known%n_computed = known%n_computed + 1
      return
    end if
    do i = 1, known%n
      if (known%kind(i) /= mesh%element_kind(e)) cycle
      if (known%material(i) /= mesh%material(e)) cycle
      if (any(abs(known%shape(:, :, i) - shape) > rounding)) cycle
      ke = known%ke(:, :, i)
      return
    end do
    ke = stiffness(mesh%element_kind(e), x, elasticity_at(mesh, materials, e))
    known%n_computed = known%n_computed + 1
    i = known%next
    known%n = max(known%n, i)
    known%next = mod(i, n_remembered) + 1
    known%kind(i) = mesh%element_kind(e)
    known%material(i) = mesh%material(e)
    known%shape(:, :, i) = shape
    known%ke(:, :, i) = ke
  end subroutine find_stiffness

  !> Turn blocks into triplets, twice over them: once to count, once to store. Without blocks their
  !> rows and columns only.
  pure subroutine list_free_entries(map, start, neighbours, lower_start, k, blocks)
    type(dof_map_t), intent(in) :: map
    integer, intent(in) :: start(:), neighbours(:), lower_start(:)
    type(triplets_t), intent(out) :: k
    real(wp), intent(in), optional :: blocks(:, :, :) !! (3,3,entries) [force/length]
    integer :: pass, node, entry, other, i, j, row, column, rows(3), columns(3)
    integer(i8) :: n !! beyond 17 million nodes a default integer does not count them

    do pass = 1, 2
      n = 0
      do node = 1, size(lower_start) - 1
        rows = equations_of(map, node)
        do entry = lower_start(node), lower_start(node + 1) - 1
          other = neighbours(start(node) + entry - lower_start(node))
          columns = equations_of(map, other)
          do j = 1, 3
            column = columns(j)
            if (column == 0) cycle
            do i = 1, 3
              row = rows(i)
              if (row == 0) cycle
              if (other == node .and. j > i) cycle
              n = n + 1
              if (pass == 1) cycle
              k%row(n) = max(row, column)
              k%column(n) = min(row, column)
              if (present(blocks)) k%value(n) = blocks(i, j, entry)
            end do
          end do
        end do
      end do
      if (pass == 1) allocate (k%row(n), k%column(n))
      if (pass == 1 .and. present(blocks)) allocate (k%value(n))
    end do
    k%n = map%n_free
  end subroutine list_free_entries

  !> The diagonal of the whole matrix.
  pure function diagonal_of(k) result(diagonal)
    type(triplets_t), intent(in) :: k
    real(wp) :: diagonal(k%n)
    integer :: i

    if (allocated(k%diagonal)) then
      diagonal = k%diagonal
      return
    end if
    diagonal = 0.0_wp
    do i = 1, size(k%value)
      if (k%row(i) == k%column(i)) diagonal(k%row(i)) = diagonal(k%row(i)) + k%value(i)
    end do
  end function diagonal_of

  !> Largest over smallest diagonal entry: no condition is better.
  pure real(wp) function diagonal_ratio(k)
    type(triplets_t), intent(in) :: k
    real(wp) :: diagonal(k%n)

    diagonal_ratio = 1.0_wp
    diagonal = diagonal_of(k)
    if (.not. any(diagonal > 0.0_wp)) return
    diagonal_ratio = maxval(diagonal)/minval(diagonal, mask=diagonal > 0.0_wp)
  end function diagonal_ratio

  !> Powers of two near 1/sqrt(diagonal).
  pure function scales_of(k) result(d)
    type(triplets_t), intent(in) :: k
    real(wp) :: d(k%n) !! [sqrt(length/force)]
    real(wp) :: diagonal(k%n)

    diagonal = diagonal_of(k)
    d = 1.0_wp
    where (diagonal > 0.0_wp) d = scale(1.0_wp, -exponent(diagonal)/2)
  end function scales_of

end module assembly_mod
