!> Slices in plane strain: one element thick, held across, the same on both sides.
!>
!> What happens in a slice does not change across it, so it needs no more elements there.
module slice_axis_mod
  use cells_mod, only: hexahedron_8, hexahedron_nodes
  use connectivity_mod, only: nodes_of_hexahedron
  use kinds_mod, only: wp
  use loads_mod, only: load_step_t, nodal_value_t
  use obstacle_shapes_mod, only: is_same_along
  use refine_elements_mod, only: along_edge, edge_nodes, local_axis
  use scene_mod, only: scene_t
  use mesh_mod, only: deck_rounding, solids
  use surfaces_mod, only: surface_t, nodes_of
  implicit none
  private

  public :: axis_across

  real(wp), parameter :: rounding = 1.0e-9_wp !! of a length [-]

contains

  !> The axis across a scene that is a slice, 1 to 3; 0: it is none.
  !>
  !> All elements lie between two planes, their edges from one to the other are at right angles to
  !> these, and all nodes are held along the axis at 0 in every *STEP. What is given of a node is
  !> given of the one opposite. Obstacles are planes and cylinders along the axis, and turn about it
  !> alone. Forces on nodes of elements, constraints and local directions are not looked into: such
  !> a scene counts as none. Elements of a plane make slices and wedges, which are like one, along
  !> axis 3.
  pure integer function axis_across(scene) result(axis)
    type(scene_t), intent(in) :: scene !! of the deck as written
    integer, allocatable :: opposite(:)

    axis = 3
    if (scene%mesh%plane /= solids) return
    axis = 0
    allocate (opposite(0))
    if (scene%constraints%n > 0 .or. allocated(scene%rotations) .or. allocated(scene%local_axes) &
      .or. scene%mesh%n_elements == 0) return
    if (any(scene%mesh%connectivity%cell /= hexahedron_8)) return
    do axis = 3, 1, -1
      opposite = opposite_nodes(scene, axis)
      if (size(opposite) == 0) cycle
      if (.not. all(is_same_along(scene%obstacles, axis))) cycle
      if (any(scene%gaps%parabola)) cycle
      if (is_held(scene, axis, opposite > 0) .and. is_the_same_on_both_sides(scene, axis, &
        opposite)) return
    end do
  end function axis_across

  !> The node on the other side of every node of elements, 0 of others; empty where elements do not
  !> all reach from one plane at right angles to the axis to another.
  pure function opposite_nodes(scene, axis) result(opposite)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: axis
    integer, allocatable :: opposite(:)
    real(wp) :: low, high, close_by
    integer :: along, nodes(hexahedron_nodes), e, a
    logical :: is_slice

    associate (mesh => scene%mesh)
      low = minval(mesh%coordinates(axis, mesh%element_nodes))
      high = maxval(mesh%coordinates(axis, mesh%element_nodes))
      close_by = max(rounding*(high - low), 16.0_wp*deck_rounding(mesh%coordinates, mesh%origin))
      allocate (opposite(mesh%n_nodes), source=0)
      is_slice = .true.
      do e = 1, mesh%n_elements
        nodes = nodes_of_hexahedron(mesh%connectivity, e)
        along = local_axis(mesh%coordinates(:, nodes), axis)
        do a = 1, size(along_edge)
          if (along_edge(a) /= along) cycle
          associate (ends => nodes(edge_nodes(:, a)))
            is_slice = is_slice .and. are_opposite(mesh%coordinates(:, ends(1)), &
              mesh%coordinates(:, ends(2))) .and. all(opposite(ends) == 0 .or. opposite(ends) == &
              ends([2, 1]))
            opposite(ends) = ends([2, 1])
          end associate
        end do
        if (.not. is_slice) exit
      end do
      if (.not. is_slice) opposite = [integer ::]
    end associate

  contains

    !> Whether one is on one side, the other one right across.
    pure logical function are_opposite(one, other)
      real(wp), intent(in) :: one(3), other(3)
      real(wp) :: apart(3)

      apart = abs(other - one)
      apart(axis) = max(abs(min(one(axis), other(axis)) - low), abs(max(one(axis), other(axis)) - &
        high))
      are_opposite = all(apart <= close_by)
    end function are_opposite

  end function opposite_nodes

  !> Whether nodes are held at 0 along an axis in every *STEP, and nothing turns about another one.
  pure logical function is_held(scene, axis, of_elements)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: axis
    logical, intent(in) :: of_elements(:) !! (n_nodes) the nodes
    logical :: held(size(of_elements))
    integer :: step, i

    held = .false.
    is_held = .true.
    do step = 1, size(scene%steps)
      associate (now => scene%steps(step))
        if (now%replace_boundary) held = .false.
        do i = 1, size(now%boundary)
          associate (support => now%boundary(i))
            if (support%dof /= axis .or. support%fixed) cycle
            held(support%node) = .not. abs(support%value) > 0.0_wp
          end associate
        end do
        is_held = is_held .and. all(held .or. .not. of_elements) .and. .not. any(now%rotations%dof &
          /= axis .and. abs(now%rotations%value) > 0.0_wp)
      end associate
    end do
  end function is_held

  !> Whether all that is given of nodes of elements is given of those opposite, too.
  pure logical function is_the_same_on_both_sides(scene, axis, opposite) result(same)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: axis
    integer, intent(in) :: opposite(:) !! (n_nodes) 0: of no element
    real(wp) :: gap(size(opposite))
    integer :: i

    gap = 0.0_wp
    do i = 1, size(scene%gaps)
      associate (nodes => scene%gaps(i)%nodes)
        gap(nodes) = gap(nodes) + scene%gaps(i)%value
      end associate
    end do
    same = are_equal(gap, opposite)
    do i = 1, size(scene%pairs)
      same = same .and. faces_across(scene%surfaces(scene%pairs(i)%surface))
      associate (master => scene%pairs(i)%master_surface)
        if (master > 0) same = same .and. faces_across(scene%surfaces(master))
      end associate
    end do
    if (allocated(scene%first_temperature)) same = same .and. are_equal(scene%first_temperature, &
      opposite)
    do i = 1, size(scene%steps)
      same = same .and. same_in_step(scene%steps(i), opposite)
    end do

  contains

    !> Whether a surface has nodes of both sides, and no face lies in one of them.
    pure logical function faces_across(surface)
      type(surface_t), intent(in) :: surface
      integer, allocatable :: nodes(:, :)
      integer :: f

      faces_across = are_paired(surface%nodes, opposite)
      allocate (nodes, source=nodes_of(surface%faces, scene%mesh%connectivity))
      do f = 1, size(nodes, 2)
        associate (x => scene%mesh%coordinates(axis, nodes(:, f)))
          faces_across = faces_across .and. any(opposite(nodes(1, f)) == nodes(:, f)) .and. &
            maxval(x) > minval(x)
        end associate
      end do
    end function faces_across

  end function is_the_same_on_both_sides

  !> Whether of each node the one opposite is among the nodes too.
  pure logical function are_paired(nodes, opposite)
    integer, intent(in) :: nodes(:)
    integer, intent(in) :: opposite(:) !! (n_nodes) 0: of no element
    logical :: among(0:size(opposite))

    among = .false.
    among(nodes) = .true.
    among(0) = .true.
    are_paired = all(among(opposite(nodes)))
  end function are_paired

  !> Whether nodes opposite each other have the same values.
  pure logical function are_equal(values, opposite)
    real(wp), intent(in) :: values(:)  !! (n_nodes)
    integer, intent(in) :: opposite(:) !! (n_nodes) 0: of no element

    are_equal = all(abs(values - values(max(opposite, 1))) <= 0.0_wp .or. opposite == 0)
  end function are_equal

  !> Whether a *STEP says the same of nodes opposite each other.
  pure logical function same_in_step(step, opposite) result(same)
    type(load_step_t), intent(in) :: step
    integer, intent(in) :: opposite(:) !! (n_nodes) 0: of no element
    integer :: dof

    same = .not. any(opposite(step%forces%node) > 0) .and. all([(same_values(step%boundary, dof), &
      dof=1, 3)])
    if (allocated(step%temperatures)) same = same .and. same_values(step%temperatures, 1)

  contains

    !> Of one node the last value counts.
    pure logical function same_values(values, dof) result(alike)
      type(nodal_value_t), intent(in) :: values(:)
      integer, intent(in) :: dof
      integer :: last(size(opposite)), i

      last = 0
      do i = 1, size(values)
        if (values(i)%dof == dof) last(values(i)%node) = i
      end do
      alike = .true.
      do i = 1, size(last)
        if (opposite(i) == 0 .or. .not. alike) cycle
        associate (one => last(i), other => last(opposite(i)))
          alike = one > 0 .eqv. other > 0
          if (one > 0 .and. other > 0) alike = abs(values(one)%value - values(other)%value) <= &
            0.0_wp .and. values(one)%amplitude == values(other)%amplitude .and. &
            (values(one)%fixed .eqv. values(other)%fixed)
        end associate
      end do
    end function same_values

  end function same_in_step

end module slice_axis_mod
