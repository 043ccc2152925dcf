!> Elements of a plane, expanded to solids one element thick.
!>
!> Plane strain: a slice between z = 0 and z = t, all of whose nodes are held along z. A body of
!> revolution about the y axis: a wedge between its half planes at the angles 0 and alpha, whose
!> nodes stay within theirs, which leaves u_z = tan(angle) u_x. What is the same on both sides of a
!> slice or wedge has a solution that is, too: the nodes beside those of the plane need not be tied
!> to them. docs/theory.md section 8.
module plane_mesh_mod
  use cells_mod, only: cells
  use connectivity_mod, only: nodes_of_element
  use equation_list_mod, only: add_equation, equation_list_t
  use kinds_mod, only: wp
  use loads_mod, only: load_step_t, nodal_value_t
  use mesh_draft_mod, only: add_node_beside, axisymmetric, mesh_draft_t
  use obstacle_shapes_mod, only: locate_point
  use obstacles_mod, only: obstacle_t
  use sectors_mod, only: n_sectors
  use sets_mod, only: model_t
  implicit none
  private

  public :: expand_plane, hold_plane, uneven_obstacle

  real(wp), parameter :: wedge_angle = 1.0_wp/180.0_wp*acos(-1.0_wp)
  !! 1 degree: with 0.2 rings in contact are refused (one lies behind the other), with 2 the chords
  !! of a bore on a rigid shaft make 1 % of its pressure [rad]

contains

  !> Put nodes beside those of the plane, and give them to the elements; `ok` is false where there
  !> is no room for them.
  subroutine expand_plane(draft, thickness, position, ok)
    type(mesh_draft_t), intent(inout) :: draft
    real(wp), intent(in) :: thickness !! of plane strain [length]
    integer, intent(in) :: position   !! in the deck, of what they are needed for
    logical, intent(out) :: ok
    logical :: needs(2, draft%n_nodes) !! a node opposite, one between
    integer :: e, k, node, n_plane

    needs = .false.
    do e = 1, draft%n_elements
      associate (n => cells(draft%connectivity%cell(e))%n_corners/2, &
                 nodes => nodes_of_element(draft%connectivity, e))
        needs(1, nodes) = .true.
        if (size(nodes) > 2*n) needs(2, nodes(:n)) = .true.
      end associate
    end do
    ok = .true.
    n_plane = draft%n_nodes
    if (draft%plane == axisymmetric) then
      ! Nodes between corners are on arcs, which are as long as the angle says, and chords its sine.
      draft%sector_angle = merge(asin(wedge_angle), wedge_angle, any(needs(2, :)))
      call open_axis(draft)
    end if
    allocate (draft%copies(2, n_plane), source=0)
    do k = 1, 2
      do node = 1, n_plane
        if (.not. needs(k, node)) cycle
        call add_node_beside(draft, node, position, ok)
        if (.not. ok) return
        draft%copies(k, node) = draft%n_nodes
        associate (x => draft%coordinates(:, draft%n_nodes), part => 1.0_wp/k)
          if (draft%plane == axisymmetric) then
            x = [x(1)*cos(part*wedge_angle), x(2), x(1)*sin(part*wedge_angle)]
          else
            x(3) = x(3) + part*thickness
          end if
        end associate
      end do
    end do
    do e = 1, draft%n_elements
      associate (n => cells(draft%connectivity%cell(e))%n_corners/2, first => &
                 draft%connectivity%first(e), last => draft%connectivity%first(e + 1) - 1)
        associate (nodes => draft%connectivity%node(first:last))
          nodes(n + 1:2*n) = draft%copies(1, nodes(:n))
          if (size(nodes) == 2*n) cycle
          nodes(3*n + 1:4*n) = draft%copies(1, nodes(2*n + 1:3*n))
          nodes(4*n + 1:) = draft%copies(2, nodes(:n))
        end associate
      end associate
    end do
  end subroutine expand_plane

  !> Move nodes on the axis off it, by so small a part of their elements that no result shows it:
  !> these keep all of their nodes.
  subroutine open_axis(draft)
    type(mesh_draft_t), intent(inout) :: draft
    real(wp), parameter :: hole = 1.0e-6_wp !! radius over that of the elements there [-]
    real(wp) :: radius(draft%n_nodes)
    integer :: e, node

    radius = 0.0_wp
    do e = 1, draft%n_elements
      associate (nodes => nodes_of_element(draft%connectivity, e))
        radius(nodes) = max(radius(nodes), maxval(draft%coordinates(1, nodes)))
      end associate
    end do
    allocate (draft%on_axis(draft%n_nodes), source=.false.)
    do node = 1, draft%n_nodes
      if (abs(draft%coordinates(1, node)) > hole*radius(node)) cycle
      if (.not. radius(node) > 0.0_wp) cycle
      draft%on_axis(node) = .true.
      draft%coordinates(1, node) = hole*radius(node)
    end do
  end subroutine open_axis

  !> The first obstacle that is not the same all along the thickness; 0: all are.
  pure integer function uneven_obstacle(draft, obstacles) result(uneven)
    type(mesh_draft_t), intent(in) :: draft
    type(obstacle_t), intent(in) :: obstacles(:)
    real(wp), parameter :: rounding = 1.0e-9_wp !! of the size of the bodies [-]
    real(wp), parameter :: at_rest(3) = 0.0_wp
    real(wp) :: gap(2), normal(3), size_of_all
    integer :: node

    size_of_all = maxval(abs(draft%coordinates(:, :draft%n_nodes)))
    do uneven = 1, size(obstacles)
      do node = 1, size(draft%copies, 2)
        if (draft%copies(1, node) == 0) cycle
        call locate_point(obstacles(uneven), at_rest, draft%coordinates(:, node), gap(1), normal)
        call locate_point(obstacles(uneven), at_rest, draft%coordinates(:, draft%copies(1, node)), &
          gap(2), normal)
        if (.not. abs(gap(2) - gap(1)) <= rounding*(size_of_all + abs(gap(1)))) return
      end do
    end do
    uneven = 0
  end function uneven_obstacle

  !> Hold the nodes of plane elements across the plane, and hand what the steps put on nodes of the
  !> plane to those beside them.
  subroutine hold_plane(model, equations, steps)
    type(model_t), intent(in) :: model
    type(equation_list_t), intent(inout) :: equations
    type(load_step_t), intent(inout) :: steps(:)
    integer, allocatable :: beside(:) !! (n_nodes) the node of the plane, the node itself there
    real(wp), allocatable :: angle(:) !! (n_nodes) [rad]
    logical, allocatable :: on_axis(:)
    integer :: step, node, k, n

    if (.not. allocated(model%mesh%copies)) return
    n = model%mesh%n_nodes
    allocate (beside(n), source=[(node, node=1, n)])
    allocate (angle(n), source=0.0_wp)
    allocate (on_axis(n), source=.false.)
    do node = 1, size(model%mesh%copies, 2)
      do k = 1, 2
        associate (copy => model%mesh%copies(k, node))
          if (copy == 0) cycle
          beside(copy) = node
          if (model%mesh%plane /= axisymmetric) cycle
          angle(copy) = wedge_angle/k
          on_axis([node, copy]) = model%mesh%on_axis(node)
        end associate
      end do
    end do
    where (on_axis) angle = 0.0_wp
    do step = 1, size(steps)
      call turn_supports(steps(step)%boundary, angle)
      if (step == 1 .or. steps(step)%replace_boundary) call hold_across(model, on_axis, angle, &
        steps(step)%boundary)
      call share_forces(model, beside, angle, steps(step)%forces)
    end do
    do node = 1, n
      if (abs(angle(node)) > 0.0_wp) call add_equation(equations, 0, [node, node], [3, 1], &
        [tan(angle(node))])
    end do
  end subroutine hold_plane

  !> Hold along z all nodes of elements but those that an equation keeps in their half plane, and
  !> reference nodes; of bodies of revolution also along x what is on the axis.
  subroutine hold_across(model, on_axis, angle, boundary)
    type(model_t), intent(in) :: model
    logical, intent(in) :: on_axis(:)
    real(wp), intent(in) :: angle(:) !! (n_nodes) [rad]
    type(nodal_value_t), allocatable, intent(inout) :: boundary(:)
    integer :: node

    associate (across => pack([(node, node=1, size(angle))], (model%used .or. model%reference) &
               .and. .not. abs(angle) > 0.0_wp), &
               along => pack([(node, node=1, size(angle))], on_axis .or. (model%reference .and. &
               model%mesh%plane == axisymmetric)))
      boundary = [boundary, [(nodal_value_t(node=across(node), dof=3), node=1, size(across))], &
        [(nodal_value_t(node=along(node), dof=1), node=1, size(along))]]
    end associate
  end subroutine hold_across

  !> Displacements along x of nodes at an angle are those of the radius; along z they follow.
  subroutine turn_supports(boundary, angle)
    type(nodal_value_t), allocatable, intent(inout) :: boundary(:)
    real(wp), intent(in) :: angle(:) !! (n_nodes) [rad]

    boundary = pack(boundary, boundary%dof /= 3 .or. .not. abs(angle(boundary%node)) > 0.0_wp)
    where (boundary%dof == 1) boundary%value = boundary%value*cos(angle(boundary%node))
  end subroutine turn_supports

  !> Forces on nodes of the plane act all along the thickness, each share so as the work of a
  !> displacement that is the same there has it: of a line of two nodes halves, of one of three
  !> 1/6, 4/6, 1/6. On a node between two corners the displacement of a face also has parts of
  !> theirs, -1/6, 2/6, -1/6 each.
  subroutine share_forces(model, beside, angle, forces)
    type(model_t), intent(in) :: model
    integer, intent(in) :: beside(:)
    real(wp), intent(in) :: angle(:) !! (n_nodes) [rad]
    type(nodal_value_t), allocatable, intent(inout) :: forces(:)
    type(nodal_value_t), allocatable :: shared(:)
    integer :: ends(2, size(beside)) !! corners beside a mid-side node of the plane
    integer :: e, i, k, m

    ends = 0
    do e = 1, merge(model%mesh%n_elements, 0, size(forces) > 0)
      associate (n => cells(model%mesh%connectivity%cell(e))%n_corners/2, &
                 nodes => nodes_of_element(model%mesh%connectivity, e))
        if (size(nodes) == 2*n) cycle
        do k = 1, n
          ends(:, nodes(2*n + k)) = nodes([k, mod(k, n) + 1])
        end do
      end associate
    end do
    allocate (shared(0))
    m = 0
    do i = 1, size(forces)
      associate (node => forces(i)%node)
        if (beside(node) /= node) cycle
        if (node > size(model%mesh%copies, 2)) then
          call put(node, 1.0_wp)
        else if (model%mesh%copies(1, node) == 0) then
          call put(node, 1.0_wp)
        else if (model%mesh%copies(2, node) > 0) then
          call put_along(node, 1.0_wp/6.0_wp)
        else
          call put(node, 0.5_wp)
          call put(model%mesh%copies(1, node), 0.5_wp)
          if (all(ends(:, node) > 0)) then
            call put_along(ends(1, node), -1.0_wp/6.0_wp, 1.0_wp/3.0_wp)
            call put_along(ends(2, node), -1.0_wp/6.0_wp, 1.0_wp/3.0_wp)
          end if
        end if
      end associate
    end do
    forces = shared

  contains

    !> Put shares on the three nodes of a corner.
    subroutine put_along(node, outer, middle)
      integer, intent(in) :: node
      real(wp), intent(in) :: outer            !! of the two outer ones
      real(wp), intent(in), optional :: middle !! left out: the rest

      call put(node, outer)
      call put(model%mesh%copies(1, node), outer)
      if (present(middle)) then
        call put(model%mesh%copies(2, node), middle)
      else
        call put(model%mesh%copies(2, node), 1.0_wp - 2.0_wp*outer)
      end if
    end subroutine put_along

    subroutine put(node, share)
      integer, intent(in) :: node
      real(wp), intent(in) :: share
      type(nodal_value_t) :: force

      force = forces(i)
      force%node = node
      force%value = share*force%value/n_sectors(model%mesh%sector_angle)
      if (force%dof == 1) then
        call add(force, cos(angle(node)))
        force%dof = 3
        if (abs(angle(node)) > 0.0_wp) call add(force, sin(angle(node)))
      else
        call add(force, 1.0_wp)
      end if
    end subroutine put

    subroutine add(force, share)
      type(nodal_value_t), intent(in) :: force
      real(wp), intent(in) :: share

      shared = [shared, force]
      shared(size(shared))%value = share*force%value
    end subroutine add

  end subroutine share_forces

end module plane_mesh_mod
