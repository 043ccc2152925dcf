!> The stiffness by nodes: of one rank's nodes all rows that they have.
!>
!> A part is the elements that act on some nodes, with all that these elements use. What is not the
!> rank's own among that are ghosts: its rows reach them, their own rows are other ranks'. An
!> element between two parts is summed on both.
!>
!> Rows are counted by nodes, three unknowns each whether they are free or not, the first rank's
!> before the second's; a rank's own are in the order of the mesh.
module node_parts_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t
  use lists_mod, only: lists_t, lists_by_key
  use constraints_mod, only: constraint_of
  use connectivity_mod, only: nodes_of_element
  use mesh_mod, only: mesh_t
  use linked_nodes_mod, only: coupled_nodes, nodes_with_constraints
  use spring_elements_mod, only: spring_ends
  use scene_mod, only: material_t
  use parallel_mod, only: announce, n_ranks, receive_integers, send_integers, sum_over_ranks, &
    task_rows
  use dof_map_mod, only: dof_map_t, is_unknown, numbers_of
  use assembly_mod, only: assemble_stiffness, diagonal_of, triplets_t
  use metis_graph_mod, only: divide
  use mesh_parts_mod, only: cut_part, receive_part, send_part
  implicit none
  private

  public :: node_part_t, assemble_node_parts, assemble_own_nodes, number_rows, list_acting

  integer, parameter :: n_sizes = 3 !! all rows, those before, own ones

  !> Rows of some nodes.
  type :: node_part_t
    integer :: n_rows = 0   !! of all parts
    integer :: before = 0   !! of those of the ranks before
    integer :: n_own = 0    !! of this one
    integer, allocatable :: row(:)              !! (n) of the part's nodes, 0 without unknowns
    integer, allocatable :: equation(:, :)      !! (3,n) 0 where there is no unknown
    real(wp), allocatable :: coordinates(:, :)  !! (3,n) [length]
    integer, allocatable :: start(:), neighbours(:) !! of the nodes, as of coupled_nodes
    type(triplets_t) :: k
    !! what the part's elements sum to: all there is wherever one of the two rows is its own
  end type node_part_t

contains

  !> Sum the stiffness, on all ranks where there are several; `part` is the host's.
  ! allow(too-many-arguments)
  subroutine assemble_node_parts(mesh, materials, map, start, neighbours, row, part, n_computed, &
    error)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    type(dof_map_t), intent(in) :: map
    integer, allocatable, intent(inout) :: start(:), neighbours(:)
    !! of the nodes, as of coupled_nodes; a part that is all of it takes them over
    integer, allocatable, intent(out) :: row(:)  !! (n_nodes) of each node, 0 without unknowns
    type(node_part_t), intent(out) :: part
    integer, intent(out) :: n_computed   !! element stiffnesses that were computed, by all ranks
    type(error_t), allocatable, intent(out) :: error !! METIS failed
    type(mesh_t) :: piece
    type(dof_map_t) :: piece_map
    integer, allocatable :: first(:), nodes(:), elements(:), springs(:)
    integer :: rank

    call number_rows(map, start, neighbours, n_ranks(), row, first, error)
    if (allocated(error)) return
    part%n_rows = first(size(first)) - 1
    if (n_ranks() == 1) then
      part%n_own = part%n_rows
      part%row = row
      part%equation = numbers_of(map)
      part%coordinates = mesh%coordinates(:, :mesh%n_nodes)
      call assemble_stiffness(mesh, materials, map, start, neighbours, part%k, n_computed)
      call move_alloc(start, part%start)
      call move_alloc(neighbours, part%neighbours)
      return
    end if
    call announce(task_rows)
    do rank = n_ranks() - 1, 0, -1
      part%before = first(rank + 1) - 1
      part%n_own = first(rank + 2) - first(rank + 1)
      call list_acting(mesh, map, row, first(rank + 1), first(rank + 2), elements, springs)
      call cut_part(mesh, map, elements, springs, piece, piece_map, nodes)
      part%row = row(nodes)
      if (rank == 0) exit
      call send_part(piece, materials, piece_map, rank)
      call send_integers(n_sizes, [part%n_rows, part%before, part%n_own], rank)
      call send_integers(size(nodes), part%row, rank)
    end do
    call assemble_nodes(piece, materials, piece_map, part, n_computed)
  end subroutine assemble_node_parts

  !> Receive a part and sum its stiffness: task_rows.
  subroutine assemble_own_nodes(part)
    type(node_part_t), intent(out) :: part
    type(mesh_t) :: piece
    type(material_t), allocatable :: materials(:)
    type(dof_map_t) :: piece_map
    integer :: sizes(n_sizes), n_computed

    call receive_part(piece, materials, piece_map)
    call receive_integers(n_sizes, sizes)
    part%n_rows = sizes(1)
    part%before = sizes(2)
    part%n_own = sizes(3)
    allocate (part%row(piece%n_nodes))
    call receive_integers(piece%n_nodes, part%row)
    call assemble_nodes(piece, materials, piece_map, part, n_computed)
  end subroutine assemble_own_nodes

  !> The rows of the nodes, rank by rank.
  subroutine number_rows(map, start, neighbours, ranks, row, first, error)
    type(dof_map_t), intent(in) :: map
    integer, intent(in) :: start(:), neighbours(:) !! of the nodes, as of coupled_nodes
    integer, intent(in) :: ranks
    integer, allocatable, intent(out) :: row(:)    !! (n_nodes) 0 without unknowns
    integer, allocatable, intent(out) :: first(:)  !! (ranks+1) row of each rank
    type(error_t), allocatable, intent(out) :: error !! METIS failed
    integer, allocatable :: node_of(:), owner(:)
    type(lists_t) :: of_rank
    integer :: i, n

    node_of = pack([(i, i=1, size(start) - 1)], any(is_unknown(map), dim=1))
    allocate (row(size(start) - 1), source=0)
    n = size(node_of)
    row(node_of) = [(i, i=1, n)]
    allocate (first(ranks + 1), source=n + 1)
    first(1) = 1
    if (ranks == 1) return
    allocate (owner(n))
    call divide(row, node_of, start, neighbours, ranks, owner, error)
    if (allocated(error)) return
    of_rank = lists_by_key(owner, ranks)
    first(:) = of_rank%first
    row(node_of(of_rank%item)) = [(i, i=1, n)]
  end subroutine number_rows

  !> The elements and springs that act on some rows.
  pure subroutine list_acting(mesh, map, row, first, next, elements, springs)
    type(mesh_t), intent(in) :: mesh
    type(dof_map_t), intent(in) :: map
    integer, intent(in) :: row(:)      !! (n_nodes) of each node, 0 without unknowns
    integer, intent(in) :: first, next !! row, and one behind the last
    integer, allocatable, intent(out) :: elements(:), springs(:) !! ascending
    integer :: constraint(3, merge(mesh%n_nodes, 0, map%constraints%n > 0)), e
    logical :: is_own(size(row)), acts(mesh%n_elements), spring_acts(mesh%springs%n)

    is_own = row >= first .and. row < next
    if (map%constraints%n > 0) constraint = constraint_of(map%constraints, mesh%n_nodes)
    do e = 1, mesh%n_elements
      acts(e) = do_act(nodes_of_element(mesh%connectivity, e))
    end do
    do e = 1, mesh%springs%n
      spring_acts(e) = do_act(spring_ends(mesh%springs, e))
    end do
    elements = pack([(e, e=1, mesh%n_elements)], acts)
    springs = pack([(e, e=1, mesh%springs%n)], spring_acts)

  contains

    !> Whether nodes, or what they depend on, have a row.
    pure logical function do_act(nodes)
      integer, intent(in) :: nodes(:)

      do_act = any(is_own(nodes))
      if (map%constraints%n == 0 .or. do_act) return
      if (all(constraint(:, nodes) == 0)) return
      do_act = any(is_own(nodes_with_constraints(map%constraints, constraint, nodes)))
    end function do_act

  end subroutine list_acting

  !> What all ranks do with their elements.
  subroutine assemble_nodes(piece, materials, piece_map, part, n_computed)
    type(mesh_t), intent(in) :: piece
    type(material_t), intent(in) :: materials(:)
    type(dof_map_t), intent(in) :: piece_map
    type(node_part_t), intent(inout) :: part
    integer, intent(out) :: n_computed !! on all ranks
    real(wp) :: total(1)

    call coupled_nodes(piece, piece_map%constraints, part%start, part%neighbours)
    part%equation = numbers_of(piece_map)
    part%coordinates = piece%coordinates
    call assemble_stiffness(piece, materials, piece_map, part%start, part%neighbours, part%k, &
      n_computed)
    call share_diagonal(part)
    total = n_computed
    call sum_over_ranks(total)
    n_computed = nint(total(1))
  end subroutine assemble_nodes

  !> The diagonal of all rows, on all ranks.
  subroutine share_diagonal(part)
    type(node_part_t), intent(inout) :: part
    real(wp), allocatable :: diagonal(:)
    integer :: i, a

    diagonal = diagonal_of(part%k)
    do i = 1, size(part%row)
      if (part%row(i) > part%before .and. part%row(i) <= part%before + part%n_own) cycle
      do a = 1, 3
        if (part%equation(a, i) > 0) diagonal(part%equation(a, i)) = 0.0_wp
      end do
    end do
    call sum_over_ranks(diagonal)
    call move_alloc(diagonal, part%k%diagonal)
    part%k%is_distributed = .true.
  end subroutine share_diagonal

end module node_parts_mod
