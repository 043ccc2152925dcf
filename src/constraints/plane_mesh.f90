!> Elements of a plane, expanded to solids one element thick.
!>
!> Plane strain: a slice between z = 0 and z = t, all of whose nodes are held along z. Plane stress:
!> one whose faces move along z, both as far from its middle. A body of revolution about the y axis:
!> a wedge between its half planes at the angles 0 and alpha, whose nodes stay within theirs, which
!> leaves u_z = tan(angle) u_x. What is the same on both sides of a
!> slice or wedge has a solution that is, too: the nodes beside those of the plane need not be tied
!> to them. docs/theory.md section 8.
module plane_mesh_mod
  use cells_mod, only: cells
  use constraints_mod, only: constraints_t
  use connectivity_mod, only: nodes_of_element
  use equation_list_mod, only: add_equation, equation_list_t
  use growing_lists_mod, only: enlarge
  use kinds_mod, only: wp
  use loads_mod, only: load_step_t, nodal_value_t
  use mesh_draft_mod, only: add_node_beside, axisymmetric, mesh_draft_t, plane_stress, solids
  use obstacle_shapes_mod, only: locate_point
  use obstacles_mod, only: obstacle_t
  use sets_mod, only: model_t
  use swept_profile_mod, only: facets_t, sweep_along
  implicit none
  private

  public :: across_plane, expand_plane, facets_beside_plane, spread_equations, hold_plane, &
    uneven_obstacle

  integer, parameter :: across_plane = 3 !! the axis along which elements are as thick as all are
  real(wp), parameter :: wedge_angle = 1.0_wp/180.0_wp*acos(-1.0_wp)
  !! 1 degree: with 0.2 rings in contact are refused (one lies behind the other), with 2 the chords
  !! of a bore on a rigid shaft make 1 % of its pressure [rad]

  !> Which nodes stand beside those of the plane.
  type :: lines_t
    integer, allocatable :: beside(:, :)  !! (2,n_nodes) the opposite one, that between; 0: none
    integer, allocatable :: ends(:, :)    !! (2,n_nodes) corners beside a mid-side node; else 0
    logical, allocatable :: is_beside(:)  !! (n_nodes) one of these, not of the plane
    integer, allocatable :: opposite(:)   !! (n_nodes) in plates, whose faces move; else 0
    logical, allocatable :: on_axis(:)    !! (n_nodes) of bodies of revolution
    real(wp), allocatable :: angle(:)     !! (n_nodes) of the half plane; 0 on the axis [rad]
  end type lines_t

  !> A sum of displacements, each degree of freedom once.
  type :: mean_t
    integer :: n = 0
    integer, allocatable :: node(:), dof(:)
    real(wp), allocatable :: weight(:)
  end type mean_t

contains

  !> Put nodes beside those of the plane, and give them to the elements; `ok` is false where there
  !> is no room for them.
  subroutine expand_plane(draft, thickness, position, ok)
    type(mesh_draft_t), intent(inout) :: draft
    real(wp), intent(in) :: thickness !! but of bodies of revolution [length]
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
      ! Chords leave sin(alpha)/alpha of the volume, and of the work of pressures along radii.
      draft%parts = 2.0_wp*acos(-1.0_wp)/sin(draft%sector_angle)
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
  !> these keep all of their nodes. All are moved alike: what touches there has one axis.
  subroutine open_axis(draft)
    type(mesh_draft_t), intent(inout) :: draft
    real(wp), parameter :: hole = 1.0e-6_wp !! radius over that of the least elements there [-]
    real(wp) :: radius(draft%n_nodes)
    integer :: e

    radius = 0.0_wp
    do e = 1, draft%n_elements
      associate (nodes => nodes_of_element(draft%connectivity, e))
        radius(nodes) = max(radius(nodes), maxval(draft%coordinates(1, nodes)))
      end associate
    end do
    associate (r => draft%coordinates(1, :draft%n_nodes))
      draft%on_axis = radius > 0.0_wp .and. abs(r) <= hole*radius
      where (draft%on_axis) r = hole*minval(radius, draft%on_axis)
    end associate
  end subroutine open_axis

  !> Facets of a profile in the plane, or of distances from the y axis and places along it: as wide
  !> as the thickest of the bodies, as another such body would be.
  pure type(facets_t) function facets_beside_plane(draft, polygon, origin, axes) result(swept)
    type(mesh_draft_t), intent(in) :: draft  !! expanded
    real(wp), intent(in) :: polygon(:, :)    !! (2,n) [length]
    real(wp), intent(in) :: origin(3), axes(3, 3) !! of the profile, in the mesh [length]
    real(wp) :: ends(2)
    integer :: i, n

    ends = ends_of_slice(draft)
    swept = sweep_along(polygon, [origin(:2), 0.0_wp], axes, ends(1), ends(2))
    if (draft%plane /= axisymmetric) return
    n = size(polygon, 2)
    do i = 1, n
      swept%corner(:, n + i) = origin + [polygon(1, i)*cos(wedge_angle), polygon(2, i), &
        polygon(1, i)*sin(wedge_angle)]
      swept%corner(:, i) = origin + [polygon(1, i), polygon(2, i), 0.0_wp]
      if (i == n) cycle
      if (.not. polygon(1, i + 1) > 0.0_wp) swept%facet(:, i) = [i, n + i, i + 1, 0]
      if (.not. polygon(1, i) > 0.0_wp) swept%facet(:, i) = [i, n + i + 1, i + 1, 0]
    end do
    swept%facet = swept%facet(:, pack([(i, i=1, n - 1)], polygon(1, :n - 1) + polygon(1, 2:) > &
      0.0_wp))
  end function facets_beside_plane

  !> Where the sides of the widest slice are along z.
  pure function ends_of_slice(draft) result(ends)
    type(mesh_draft_t), intent(in) :: draft !! expanded
    real(wp) :: ends(2)

    associate (of_plane => draft%copies(1, :) > 0)
      ends(1) = minval(draft%coordinates(3, :size(of_plane)), of_plane)
      ends(2) = maxval(draft%coordinates(3, pack(draft%copies(1, :), of_plane)))
    end associate
  end function ends_of_slice

  !> Whether points are on the sides of a slice, or of a wedge about the y axis.
  pure logical function are_beside(draft, point) result(are)
    type(mesh_draft_t), intent(in) :: draft !! expanded
    real(wp), intent(in) :: point(:, :)     !! (3,n) in the mesh [length]
    real(wp) :: sides(2, size(point, 2))
    integer :: i

    sides = spread(ends_of_slice(draft), 2, size(point, 2))
    if (draft%plane == axisymmetric) sides = reshape([(-draft%origin(3), (point(1, i) + &
      draft%origin(1))*tan(wedge_angle) - draft%origin(3), i=1, size(point, 2))], shape(sides))
    are = all(minval(abs(spread(point(3, :), 1, 2) - sides), dim=1) <= 1.0e-9_wp*maxval(abs(point)))
  end function are_beside

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
      if (allocated(obstacles(uneven)%facet)) then
        if (are_beside(draft, obstacles(uneven)%corner)) cycle
        return
      end if
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

  !> What equations say of nodes of the plane, said of all that they stand for: the displacement of
  !> such a node is the mean along the thickness, as the force on it acts all along that.
  subroutine spread_equations(model, equations)
    type(model_t), intent(in) :: model
    type(equation_list_t), intent(inout) :: equations !! of the deck, between nodes of the plane
    type(equation_list_t) :: given
    type(lines_t) :: lines
    type(mean_t) :: mean
    integer :: c, k

    if (model%mesh%plane == solids .or. equations%list%n == 0) return
    lines = lines_of(model)
    given = equations
    equations = equation_list_t(links=given%links, link_position=given%link_position)
    do c = 1, given%list%n
      associate (all => given%list)
        mean = mean_t()
        call add_mean(lines, all%node(c), all%dof(c), 1.0_wp, mean)
        do k = all%first(c), all%first(c + 1) - 1
          call add_mean(lines, all%master(k), all%master_dof(k), -all%weight(k), mean)
        end do
      end associate
      call add_equation(equations, given%position(c), mean%node(:mean%n), mean%dof(:mean%n), &
        -mean%weight(2:mean%n)/mean%weight(1))
    end do
  end subroutine spread_equations

  !> Hold the nodes of plane elements across the plane, and hand what the steps put on nodes of the
  !> plane to those beside them.
  subroutine hold_plane(model, constraints, equations, steps)
    type(model_t), intent(in) :: model
    type(constraints_t), intent(in) :: constraints !! of ties, and of nodes that hang
    type(equation_list_t), intent(inout) :: equations
    type(load_step_t), intent(inout) :: steps(:)
    type(lines_t) :: lines
    logical :: follows(model%mesh%n_nodes)
    !! across the plane a node follows others, which stay in their planes
    integer :: step, node

    if (model%mesh%plane == solids) return
    lines = lines_of(model)
    follows = .false.
    call mark_followers(constraints)
    call mark_followers(equations%list)
    do step = 1, size(steps)
      associate (boundary => steps(step)%boundary)
        where (boundary%dof == 1) boundary%value = boundary%value*cos(lines%angle(boundary%node))
      end associate
      if (step == 1 .or. steps(step)%replace_boundary) call hold_across(model, lines, follows, &
        steps(step)%boundary)
      call share_forces(lines, model%mesh%parts, steps(step)%forces)
    end do
    do node = 1, size(follows)
      if (follows(node)) cycle
      if (abs(lines%angle(node)) > 0.0_wp) call add_equation(equations, 0, [node, node], [3, 1], &
        [tan(lines%angle(node))])
      if (lines%opposite(node) > node) call add_equation(equations, 0, [lines%opposite(node), &
        node], [3, 3], [-1.0_wp])
    end do

  contains

    subroutine mark_followers(list)
      type(constraints_t), intent(in) :: list
      integer :: c

      do c = 1, list%n
        if (list%dof(c) == 3) follows(list%node(c)) = .true.
      end do
    end subroutine mark_followers

  end subroutine hold_plane

  !> Which nodes are beside those of the plane, from the elements as they are at last.
  pure type(lines_t) function lines_of(model) result(lines)
    type(model_t), intent(in) :: model
    integer :: e, k, node

    associate (mesh => model%mesh, n_nodes => model%mesh%n_nodes)
      allocate (lines%beside(2, n_nodes), lines%ends(2, n_nodes), source=0)
      allocate (lines%is_beside(n_nodes), lines%on_axis(n_nodes), source=.false.)
      allocate (lines%opposite(n_nodes), source=0)
      allocate (lines%angle(n_nodes), source=0.0_wp)
      do e = 1, mesh%n_elements
        associate (n => cells(mesh%connectivity%cell(e))%n_corners/2, &
                   nodes => nodes_of_element(mesh%connectivity, e))
          lines%beside(1, nodes(:n)) = nodes(n + 1:2*n)
          if (size(nodes) == 2*n) cycle
          lines%beside(1, nodes(2*n + 1:3*n)) = nodes(3*n + 1:4*n)
          lines%beside(2, nodes(:n)) = nodes(4*n + 1:)
          do k = 1, n
            lines%ends(:, nodes(2*n + k)) = nodes([k, mod(k, n) + 1])
          end do
        end associate
      end do
      do node = 1, n_nodes
        do k = 1, 2
          if (lines%beside(k, node) == 0) cycle
          lines%is_beside(lines%beside(k, node)) = .true.
          if (mesh%plane == axisymmetric) lines%angle(lines%beside(k, node)) = wedge_angle/k
        end do
        if (mesh%plane == plane_stress .and. lines%beside(1, node) > 0) lines%opposite([node, &
          lines%beside(1, node)]) = [lines%beside(1, node), node]
      end do
      if (mesh%plane /= axisymmetric) return
      lines%on_axis(:size(mesh%on_axis)) = mesh%on_axis
      do node = 1, n_nodes
        ! New nodes are behind those that they lie between, and those in whose place they are.
        if (allocated(mesh%between) .and. node > mesh%n_given) then
          if (node - mesh%n_given <= size(mesh%place, 2)) then
            associate (around => mesh%between(:, node - mesh%n_given))
              lines%on_axis(node) = all(lines%on_axis(pack(around, around > 0)))
            end associate
          end if
        end if
        if (allocated(model%twins)) then
          k = findloc(model%twins(1, :), node, dim=1)
          if (k > 0) lines%on_axis(node) = lines%on_axis(model%twins(2, k))
        end if
        if (.not. lines%on_axis(node)) cycle
        if (node <= size(mesh%copies, 2)) lines%on_axis(pack(mesh%copies(:, node), &
          mesh%copies(:, node) > 0)) = .true.
      end do
      where (lines%on_axis) lines%angle = 0.0_wp
    end associate
  end function lines_of

  !> Hold along z all nodes of elements but those that an equation keeps in their half plane, or as
  !> far from the middle of a plate as those opposite, and reference nodes, with their rotations
  !> about other axes; of bodies of revolution also along x what is on the axis.
  subroutine hold_across(model, lines, follows, boundary)
    type(model_t), intent(in) :: model
    type(lines_t), intent(in) :: lines
    logical, intent(in) :: follows(:) !! (n_nodes) as of hold_plane
    type(nodal_value_t), allocatable, intent(inout) :: boundary(:)
    logical, dimension(size(follows)) :: across, along
    integer :: i

    ! Behind the nodes of the model are those that stand in for local directions.
    across = .false.
    along = lines%on_axis .and. .not. follows
    associate (n => size(model%used))
      across(:n) = model%used .and. .not. (abs(lines%angle(:n)) > 0.0_wp .or. &
        lines%opposite(:n) > 0 .or. follows(:n)) .or. model%reference
      if (model%mesh%plane == axisymmetric) along(:n) = along(:n) .or. model%reference
    end associate
    if (allocated(model%rotation_of)) then
      across(model%rotation_of(1, :)) = .true.
      do i = 1, size(model%rotation_of, 2)
        boundary = [boundary, nodal_value_t(node=model%rotation_of(2, i), dof=1), &
          nodal_value_t(node=model%rotation_of(2, i), dof=2)]
      end do
    end if
    boundary = [boundary, held(across, 3), held(along, 1)]

  contains

    pure function held(nodes, dof) result(supports)
      logical, intent(in) :: nodes(:)
      integer, intent(in) :: dof
      type(nodal_value_t), allocatable :: supports(:)
      integer :: node

      supports = pack([(nodal_value_t(node=node, dof=dof), node=1, size(nodes))], nodes)
    end function held

  end subroutine hold_across

  !> Forces on nodes of the plane act all along the thickness, each share so as the work of the mean
  !> displacement has it.
  subroutine share_forces(lines, parts, forces)
    type(lines_t), intent(in) :: lines
    real(wp), intent(in) :: parts !! as of mesh_t
    type(nodal_value_t), allocatable, intent(inout) :: forces(:)
    type(nodal_value_t), allocatable :: shared(:)
    type(nodal_value_t) :: force
    type(mean_t) :: mean
    integer :: i, k

    allocate (shared(0))
    do i = 1, size(forces)
      force = forces(i)
      if (lines%is_beside(force%node)) cycle
      mean = mean_t()
      call add_mean(lines, force%node, force%dof, force%value/parts, mean)
      do k = 1, mean%n
        force%node = mean%node(k)
        force%dof = mean%dof(k)
        force%value = mean%weight(k)
        shared = [shared, force]
      end do
    end do
    forces = shared
  end subroutine share_forces

  !> Add to a sum of displacements, times a factor, the mean that one of a node of the plane is: of
  !> a line of two nodes halves, of one of three 1/6, 4/6, 1/6. At a node between two corners the
  !> displacement of a face also has parts of theirs, -1/6, 2/6, -1/6 each. Of other nodes it is
  !> their own.
  subroutine add_mean(lines, node, dof, factor, mean)
    type(lines_t), intent(in) :: lines
    integer, intent(in) :: node, dof
    real(wp), intent(in) :: factor
    type(mean_t), intent(inout) :: mean
    real(wp), parameter :: sixth = 1.0_wp/6.0_wp

    if (lines%beside(1, node) == 0) then
      call put(node, 1.0_wp)
    else if (lines%beside(2, node) > 0) then
      call put_along(node, sixth, 4.0_wp*sixth)
    else
      call put(node, 0.5_wp)
      call put(lines%beside(1, node), 0.5_wp)
      if (all(lines%ends(:, node) > 0)) then
        call put_along(lines%ends(1, node), -sixth, 2.0_wp*sixth)
        call put_along(lines%ends(2, node), -sixth, 2.0_wp*sixth)
      end if
    end if

  contains

    !> Put shares on the three nodes of a corner.
    subroutine put_along(node, outer, middle)
      integer, intent(in) :: node
      real(wp), intent(in) :: outer  !! of the two outer ones [-]
      real(wp), intent(in) :: middle !! [-]

      call put(node, outer)
      call put(lines%beside(1, node), outer)
      call put(lines%beside(2, node), middle)
    end subroutine put_along

    subroutine put(node, share)
      integer, intent(in) :: node
      real(wp), intent(in) :: share

      associate (angle => lines%angle(node))
        if (dof /= 1) call add(node, dof, share)
        if (dof == 1) call add(node, 1, share*cos(angle))
        if (dof == 1 .and. abs(angle) > 0.0_wp) call add(node, 3, share*sin(angle))
      end associate
    end subroutine put

    subroutine add(node, dof, share)
      integer, intent(in) :: node, dof
      real(wp), intent(in) :: share
      integer :: k

      do k = 1, mean%n
        if (mean%node(k) /= node .or. mean%dof(k) /= dof) cycle
        mean%weight(k) = mean%weight(k) + share*factor
        return
      end do
      call reserve(mean)
      mean%n = mean%n + 1
      mean%node(mean%n) = node
      mean%dof(mean%n) = dof
      mean%weight(mean%n) = share*factor
    end subroutine add

  end subroutine add_mean

  !> Make room for another term.
  pure subroutine reserve(mean)
    type(mean_t), intent(inout) :: mean
    integer :: n(2), want

    if (.not. allocated(mean%node)) allocate (mean%node(0), mean%dof(0), mean%weight(0))
    if (mean%n < size(mean%node)) return
    n = mean%n
    want = 2*mean%n + 8
    call enlarge(mean%node, n(1), want)
    call enlarge(mean%dof, n(2), want)
    call enlarge(mean%weight, mean%n, want)
  end subroutine reserve

end module plane_mesh_mod
