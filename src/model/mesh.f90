!> The mesh: nodes, elements, the bodies they form.
module mesh_mod
  use kinds_mod, only: wp
  use lists_mod, only: lists_t, lists_with
  use connectivity_mod, only: connectivity_t
  use constraints_mod, only: constraints_t
  use spring_elements_mod, only: spring_elements_t
  implicit none
  private

  public :: solids, plane_strain, plane_stress, axisymmetric
  public :: mesh_t, find_bodies, deck_rounding, joined_nodes, elements_at_nodes, shown_nodes, &
    element_rows, moved_mesh, kind_c3d8, kind_c3d8i, kind_c3d8b

  !> What the elements of a deck are.
  integer, parameter :: solids = 0, plane_strain = 1, plane_stress = 2, axisymmetric = 3

  integer, parameter :: kind_c3d8 = 1  !! full integration
  integer, parameter :: kind_c3d8i = 2 !! incompatible modes
  integer, parameter :: kind_c3d8b = 3 !! B-bar: the mean dilatation of the element

  !> Nodes and elements, numbered from 1 in the order of the deck; the deck's own ids beside them.
  type :: mesh_t
    real(wp), allocatable :: coordinates(:, :)  !! (3, n_nodes) from `origin` [length]
    real(wp) :: origin(3) = 0.0_wp
    !! in the deck: places within the program are counted from it, files have those of the deck
    !! [length]
    integer,  allocatable :: node_id(:)         !! (n_nodes) the deck's ids
    type(connectivity_t) :: connectivity        !! node numbers of each element
    integer,  allocatable :: element_id(:)      !! (n_elements) the deck's ids
    integer,  allocatable :: element_kind(:)    !! (n_elements) kind_c3d8 and its kin
    integer,  allocatable :: material(:)        !! (n_elements) index into the scene's materials
    type(spring_elements_t) :: springs          !! between nodes, and to the ground
    integer,  allocatable :: body(:)
    !! (n_nodes) body of each node, 0 where no element uses it and no constraint joins it to one
    integer,  allocatable :: piece(:)
    !! (n_nodes) what elements alone connect, 0 where none uses the node
    integer,  allocatable :: skin(:, :)
    !! (4,n) the outside of all bodies, faces in parts between all of their nodes; the fourth is 0
    !! in a triangle; not allocated: not known
    integer,  allocatable :: between(:, :)
    !! (:,n) nodes that node `n_given` + i lies between, as of refine_elements; not allocated where
    !! no element was refined
    real(wp), allocatable :: place(:, :)  !! (3,n) where it lies there, as of refine_elements [-]
    logical,  allocatable :: hangs(:)
    !! (n_nodes) whether a node lies in the middle of an edge or a face of an element that has no
    !! node there, and moves as those that it lies between; not allocated: none does
    integer,  allocatable :: element_nodes(:)
    !! (n of them) nodes that elements use, ascending: the points of a result's mesh
    real(wp) :: sector_angle = 0.0_wp
    !! of a wedge about the y axis that stands for a body of revolution; 0: none [rad]
    integer :: plane = solids     !! or plane_strain and its kin: in slices nothing slips along z
    real(wp) :: thickness(2) = 1.0_wp !! of slices, in the deck: the least and the largest [length]
    logical :: is_thickness_given = .false.
    real(wp) :: parts = 1.0_wp    !! so many slices or wedges have the forces of the deck
    integer :: n_nodes = 0
    integer :: n_given = 0 !! the first so many are the deck's
    integer :: n_stand_ins = 0
    !! the last so many nodes hold values along local directions of others: no file has them
    integer :: n_elements = 0
    integer :: n_bodies = 0
    integer :: n_pieces = 0
  end type mesh_t

contains

  !> Nodes, bodies and pieces where displacements take them; without elements.
  pure type(mesh_t) function moved_mesh(mesh, u) result(moved)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: u(:, :) !! (3,n_nodes) [length]

    moved%coordinates = mesh%coordinates + u
    moved%node_id = mesh%node_id
    moved%body = mesh%body
    moved%piece = mesh%piece
    moved%n_nodes = mesh%n_nodes
    moved%n_given = mesh%n_given
    moved%n_stand_ins = mesh%n_stand_ins
    moved%n_bodies = mesh%n_bodies
    moved%n_pieces = mesh%n_pieces
    moved%springs = mesh%springs
  end function moved_mesh

  !> Number the pieces of the mesh that elements connect in `mesh%piece`, and the bodies (pieces
  !> connected through constraints and springs, with the nodes that these join to them) in
  !> `mesh%body`; list the nodes that elements use.
  pure subroutine find_bodies(mesh, constraints)
    type(mesh_t), intent(inout) :: mesh
    type(constraints_t), intent(in), optional :: constraints !! none where left out
    integer :: parent(mesh%n_nodes), e, k, c, node

    parent = [(node, node = 1, mesh%n_nodes)]
    do e = 1, mesh%n_elements
      associate (first => mesh%connectivity%first, node_of => mesh%connectivity%node)
        do k = first(e) + 1, first(e + 1) - 1
          call join(parent, node_of(first(e)), node_of(k))
        end do
      end associate
    end do
    call number_trees(mesh, parent, mesh%piece, mesh%n_pieces)
    mesh%element_nodes = pack([(node, node = 1, mesh%n_nodes)], mesh%piece > 0)
    if (present(constraints)) then
      do c = 1, constraints%n
        do k = constraints%first(c), constraints%first(c + 1) - 1
          call join(parent, constraints%node(c), constraints%master(k))
        end do
      end do
    end if
    do e = 1, mesh%springs%n
      associate (first => mesh%springs%first, node_of => mesh%springs%node)
        do k = first(e) + 1, first(e + 1) - 1
          call join(parent, node_of(first(e)), node_of(k))
        end do
      end associate
    end do
    call number_trees(mesh, parent, mesh%body, mesh%n_bodies)
    do e = 1, mesh%springs%n
      do k = mesh%springs%first(e), mesh%springs%first(e + 1) - 1
        call find_root(parent, mesh%springs%node(k), node)
        mesh%body(mesh%springs%node(k)) = mesh%body(node)
      end do
    end do
    if (.not. present(constraints)) return
    do c = 1, constraints%n
      call find_root(parent, constraints%node(c), node)
      mesh%body(constraints%node(c)) = mesh%body(node)
      do k = constraints%first(c), constraints%first(c + 1) - 1
        mesh%body(constraints%master(k)) = mesh%body(node)
      end do
    end do
  end subroutine find_bodies

  !> Number the trees that have elements, in the order of these.
  pure subroutine number_trees(mesh, parent, number, n)
    type(mesh_t), intent(in) :: mesh
    integer, intent(inout) :: parent(:)              !! (n_nodes) paths are made shorter
    integer, allocatable, intent(inout) :: number(:) !! (n_nodes) made anew
    integer, intent(out) :: n
    integer :: e, k, node, root

    if (allocated(number)) deallocate (number)
    allocate (number(mesh%n_nodes), source=0)
    n = 0
    do e = 1, mesh%n_elements
      do k = mesh%connectivity%first(e), mesh%connectivity%first(e + 1) - 1
        node = mesh%connectivity%node(k)
        call find_root(parent, node, root)
        if (number(root) == 0) then
          n = n + 1
          number(root) = n
        end if
        number(node) = number(root)
      end do
    end do
  end subroutine number_trees

  !> By how much the deck rounds coordinates: epsilon times the largest.
  pure real(wp) function deck_rounding(coordinates, origin) result(rounding)
    real(wp), intent(in) :: coordinates(:, :) !! (3,n) from the origin [length]
    real(wp), intent(in) :: origin(3)         !! in the deck [length]
    integer :: i

    rounding = 0.0_wp
    do i = 1, 3
      rounding = max(rounding, epsilon(1.0_wp)*maxval(abs(coordinates(i, :) + origin(i))))
    end do
  end function deck_rounding

  !> How many nodes the deck has: the first.
  pure integer function shown_nodes(mesh)
    type(mesh_t), intent(in) :: mesh

    shown_nodes = mesh%n_nodes - mesh%n_stand_ins
  end function shown_nodes

  !> The place of each node among those that elements use, 0 of others.
  pure function element_rows(mesh) result(row)
    type(mesh_t), intent(in) :: mesh !! of find_bodies
    integer :: row(mesh%n_nodes), i

    row = 0
    do i = 1, size(mesh%element_nodes)
      row(mesh%element_nodes(i)) = i
    end do
  end function element_rows

  !> Nodes that no element has and that equations join to a body.
  pure function joined_nodes(mesh) result(joined)
    type(mesh_t), intent(in) :: mesh !! of find_bodies
    logical :: joined(mesh%n_nodes)

    joined = mesh%body > 0 .and. mesh%piece == 0
  end function joined_nodes

  pure subroutine join(parent, a, b)
    integer, intent(inout) :: parent(:)
    integer, intent(in) :: a, b
    integer :: root_a, root_b

    call find_root(parent, a, root_a)
    call find_root(parent, b, root_b)
    parent(max(root_a, root_b)) = min(root_a, root_b)
  end subroutine join

  !> Follow the parents of `node` to its root, halving the path on the way.
  pure subroutine find_root(parent, node, root)
    integer, intent(inout) :: parent(:)
    integer, intent(in) :: node
    integer, intent(out) :: root

    root = node
    do while (parent(root) /= root)
      parent(root) = parent(parent(root))
      root = parent(root)
    end do
  end subroutine find_root

  !> The elements that meet at each node, ascending.
  pure type(lists_t) function elements_at_nodes(mesh, counts) result(at)
    type(mesh_t), intent(in) :: mesh
    logical, intent(in) :: counts(:) !! (n_elements) those that are listed
    integer :: counted(size(mesh%connectivity%node)) !! 0 of elements that are not listed
    integer :: e

    counted = mesh%connectivity%node
    do e = 1, mesh%n_elements
      if (.not. counts(e)) counted(mesh%connectivity%first(e): &
        mesh%connectivity%first(e + 1) - 1) = 0
    end do
    at = lists_with(mesh%connectivity%first, counted, mesh%n_nodes)
  end function elements_at_nodes

end module mesh_mod
