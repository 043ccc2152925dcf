!> Whether an equilibrium at finite strain is stable: no motion that contact allows lowers the
!> energy. docs/theory.md (8.28), (8.29).
!>
!> With B the rows of the points that press (the normal, and all three of one that sticks), and the
!> curvature of contact in K, motions that B lets through lower it as often as
!>
!>     negative eigenvalues of [K B^T; B 0], less the rows of B
!>
!> Bodies and obstacles that supports do not hold are free in K: what the solver pins is not. Free
!> obstacles have unknowns of their own behind those of the mesh, without stiffness.
!>
!> A rigid motion that contact does not see at all releases no energy where no force turns with it:
!> it has a row of its own, for what iterations leave out of balance would count as its stiffness.
!>
!> The gap of a point in the middle of an edge is made of those of three nodes, (9.11): its row and
!> its curvature are.
!>
!> Where points slide with friction K is not symmetric. Motions that do not move these along their
!> obstacles do no work of friction: where one of them lowers the energy no friction holds it. Those
!> that move a point across the way that it slides lose mu r_n (|v| - v.s), of first order, and gain
!> no more than of second: none of them begins. Where only motions along the slip lower the energy
!> that is a hint, and so it is where the work of pressures depends on the path. The curvature of
!> masters that are surfaces is not in K. It has no effect either where no point moves along its
!> master: then the gap does not change to second order.
module stability_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t
  use cells_mod, only: hexahedron_20, hexahedron_20_reduced
  use growing_lists_mod, only: enlarge
  use small_matrix_mod, only: cross
  use linked_nodes_mod, only: coupled_nodes
  use scene_mod, only: scene_t
  use obstacles_mod, only: obstacle_t
  use mesh_mod, only: kind_c3d8b
  use candidate_points_mod, only: take_deformed_areas
  use contact_points_mod, only: contact_points_t, contact_nodes, law_at, list_slave
  use friction_laws_mod, only: bound_friction
  use state_mod, only: state_t, modes_t
  use dof_map_mod, only: dof_map_t, make_dof_map, equations_of, interface_terms_of
  use rigid_modes_mod, only: free_motions_t
  use grips_mod, only: is_turning
  use turning_couplings_mod, only: has_turning, turned_constraints
  use stiffen_couplings_mod, only: stiffen_couplings
  use constraints_mod, only: constraints_t, active_constraints
  use transfer_mod, only: nodal_forces
  use finite_forces_mod, only: tangent_t
  use bodies_mod, only: is_linear, tangent_at, find_internal_force
  use assembly_mod, only: triplets_t, assemble_stiffness, diagonal_of
  use ordering_mod, only: order_equations
  use sparse_factor_mod, only: count_negative
  use definiteness_mod, only: is_surely_positive
  use obstacle_shapes_mod, only: bend_of_gap, shift_of, has_fixed_normals
  use placement_mod, only: placement_t, place_state, as_turned
  use condensed_contact_mod, only: neutral_motions
  use step_solver_mod, only: step_solver_t
  use load_stiffness_mod, only: loaded_nodes, load_stiffnesses, mean_stiffnesses, &
    add_load_stiffness
  use loads_mod, only: following_t
  implicit none
  private

  public :: stability_t, find_stability, is_hint

  real(wp), parameter :: neutral = 1.0e-9_wp
  !! of the diagonal of K: rounding, no instability; 370 random decks end alike with 1e-10 to 1e-8
  !! [-]
  real(wp), parameter :: softest = 1.0e-6_wp
  !! of the largest: a diagonal that is a scale; that of free rigid bodies is rounding [-]
  real(wp), parameter :: cone = 1.0e-6_wp
  !! of friction's limit: what is so near it slides; 370 random decks end alike with 1e-7 to 1e-5
  !! [-]
  real(wp), parameter :: tilt = 1.0e-2_wp
  !! of a post that is not plumb, which friction below it does not hold; 1/200 to 1/500 is built [-]
  real(wp), parameter :: independent = 1.0e-6_wp
  !! of a row: what it gives way by, and what is none of it [-]

  type :: stability_t
    logical :: is_known = .false.  !! the matrix could be factorised
    integer :: n_unstable = 0      !! independent motions that lower the energy
    ! No more than a hint:
    logical :: slides = .false.    !! all these move points along their slip
    logical :: follows = .false.   !! pressures do, and have no energy; nor have moments
    logical :: bends = .false.     !! likewise on surfaces of bodies: their curvature is left out
    logical :: by_element = .false. !! C3D8B, or modes of C3D8I, may be the reason
    integer :: n_hourglass = 0
    !! motions that lower it as elements with reduced integration see them, and not with full
    !! integration; they are not counted above
  end type stability_t

  !> The contact points where they are.
  type :: pressed_t
    type(placement_t) :: placement
    real(wp), allocatable :: normal_force(:) !! (n_points) [force]
    logical, allocatable :: presses(:), sticks(:) !! (n_points)
    real(wp), allocatable :: across(:, :)
    !! (3,n_points) direction across the slip that friction holds [-]; 0: none
  end type pressed_t

  !> The rows of B in the unknowns.
  type :: rows_t
    integer :: n = 0
    integer :: n_entries = 0
    type(triplets_t) :: entries !! row, equation, coefficient
  end type rows_t

contains

  !> Whether what is left out may hold motions that seem unstable.
  pure logical function is_hint(stability)
    type(stability_t), intent(in) :: stability

    is_hint = stability%slides .or. stability%follows .or. stability%bends
  end function is_hint

  !> Stability at the end of an increment, or where the next one begins. At small strain bodies are
  !> stable.
  !>
  !> Reduced integration sees no strain in some motions of an element (hourglass modes), so that the
  !> stresses alone say what energy these have. Where motions seem to lower it those count that do
  !> so with full integration. docs/theory.md (8.29).
  subroutine find_stability(scene, points, solver, state, following, stability)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver      !! its unknowns and constraints
    type(state_t), intent(in) :: state
    type(following_t), intent(in) :: following     !! loads there
    type(stability_t), intent(out) :: stability
    type(scene_t) :: fully
    type(stability_t) :: with_full

    call find_as_integrated(scene, points, solver, state, following, stability)
    if (stability%n_unstable == 0) return
    if (.not. any(scene%mesh%connectivity%cell == hexahedron_20_reduced)) return
    fully = scene
    where (fully%mesh%connectivity%cell == hexahedron_20_reduced) &
      fully%mesh%connectivity%cell = hexahedron_20
    call find_as_integrated(fully, points, solver, state, following, with_full)
    if (.not. with_full%is_known) return
    with_full%n_hourglass = max(0, stability%n_unstable - with_full%n_unstable)
    stability = with_full
  end subroutine find_stability

  !> The same with the points of integration that the mesh has.
  subroutine find_as_integrated(scene, points, solver, state, following, stability)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver      !! its unknowns and constraints
    type(state_t), intent(in) :: state
    type(following_t), intent(in) :: following     !! loads there
    type(stability_t), intent(out) :: stability
    type(tangent_t) :: tangent
    type(triplets_t) :: k
    type(dof_map_t) :: map
    type(constraints_t) :: active
    type(pressed_t) :: contact
    type(error_t), allocatable :: error
    integer, allocatable :: start(:), neighbours(:), position(:)
    real(wp), allocatable :: d(:), unturned(:, :), unanswered(:, :)
    integer :: held, i
    logical :: has_energy, is_dead

    stability%is_known = is_linear(scene)
    if (stability%is_known) return
    contact = pressed_points(scene, points, solver, state)
    tangent = tangent_at(scene, state%displacement, state%step, state%position, &
      projection=0.0_wp, modes=state%modes)
    active = solver%body%constraints
    if (has_turning(scene)) active = active_constraints(turned_constraints(scene, &
      solver%body%prescribed, state%displacement), solver%body%prescribed)
    associate (motions => solver%body%motions)
      map = make_dof_map(scene%mesh%body, solver%body%prescribed, [contact_nodes(points), &
        loaded_nodes(scene, following)], active)
      call coupled_nodes(scene%mesh, active, start, neighbours)
      call assemble_stiffness(scene%mesh, scene%materials, map, start, neighbours, k, &
        tangent=tangent)
      k%n = map%n_free + motions%n
      call add_curvature(scene, points, map, motions, state, contact, k)
      unanswered = unanswered_forces(scene, points, state, contact)
      call add_load_stiffness(map, [load_stiffnesses(scene, following, state%displacement), &
        mean_stiffnesses(scene, state%displacement, unanswered, size(k%value))], k, has_energy)
      call add_coupling_stiffness(scene, solver, state, unanswered, map, k, is_dead)
      ! Without the rows there are more motions: where none of them lowers the energy no other does.
      if (motions%n == 0 .and. k%n_negative == 0) stability%is_known = is_surely_positive(k, map, &
        scene%mesh%n_nodes, solver%body%inverse)
      if (stability%is_known .or. solver%choices%precision%iterative) return
      call order_equations(map, start, neighbours, position, error, 0)
      if (allocated(error)) return
      position = [position, (i, i=map%n_free + 1, k%n)]
      ! Of rigid bodies the diagonal is rounding, or the part of forces that turn: no scale.
      d = abs(diagonal_of(k))
      d = scale(1.0_wp, -exponent(max(d, softest*maxval(d)))/2)
      k%value = d(k%row)*k%value*d(k%column)
      ! What is negative by less is rounding.
      k%row = [k%row, (i, i=1, k%n)]
      k%column = [k%column, (i, i=1, k%n)]
      k%value = [k%value, (neutral, i=1, k%n)]
    end associate
    unturned = unturned_motions(scene, points, solver, state, contact%placement)
    stability%n_unstable = count_unstable()
    if (allocated(error)) return
    if (stability%n_unstable > 0) then
      stability%slides = any(contact%presses .and. .not. contact%sticks .and. points%mu > 0.0_wp)
      stability%bends = any(contact%presses .and. points%on_surface)
    end if
    if (stability%slides .or. stability%bends) then
      contact%sticks = contact%presses .and. (points%mu > 0.0_wp .or. points%on_surface)
      held = count_unstable()
      if (held > 0) stability%n_unstable = held
      stability%slides = stability%slides .and. held == 0
      stability%bends = stability%bends .and. held == 0
      if (stability%slides) then
        contact = pressed_points(scene, points, solver, state)
        call hold_across(points, state, contact)
        stability%n_unstable = count_unstable()
      end if
    end if
    stability%is_known = .true.
    stability%follows = is_dead .or. .not. has_energy
    stability%by_element = k%n_negative > 0 .or. any(scene%mesh%element_kind == kind_c3d8b)

  contains

    !> With the rows of the points as they stick; 0 where there is an error.
    integer function count_unstable() result(n)
      type(rows_t) :: rows
      type(triplets_t) :: bordered
      integer, allocatable :: at(:)

      call find_rows(scene, points, map, solver%body%motions, contact, unturned, rows)
      bordered = k
      at = position
      call border(rows, d, bordered, at)
      call count_negative(bordered, at, n, error)
      n = merge(0, n - rows%n + k%n_negative, allocated(error))
    end function count_unstable

  end subroutine find_as_integrated

  !> The points that press, or pull where they stay closed, by their reactions.
  pure type(pressed_t) function pressed_points(scene, points, solver, state) result(contact)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    type(state_t), intent(in) :: state
    real(wp) :: r(3), bound, slope
    integer :: i

    call place_state(scene, points, solver%undeformed, state, contact%placement)
    call take_deformed_areas(scene, points, state%displacement, contact%placement)
    allocate (contact%normal_force(points%n), source=0.0_wp)
    allocate (contact%presses(points%n), contact%sticks(points%n), source=.false.)
    allocate (contact%across(3, points%n), source=0.0_wp)
    do i = 1, points%n
      r = matmul(state%reaction(:, i), contact%placement%frame(:, :, i))
      contact%presses(i) = abs(r(1)) > 0.0_wp
      contact%normal_force(i) = r(1)
      call bound_friction(law_at(points, i, contact%placement%covered_area(i)), r(1), bound, slope)
      contact%sticks(i) = contact%presses(i) .and. norm2(r(2:)) < (1.0_wp - cone)*points%mu(i)*bound
    end do
  end function pressed_points

  !> Hold the points that slide with friction across their slip.
  pure subroutine hold_across(points, state, contact)
    type(contact_points_t), intent(in) :: points
    type(state_t), intent(in) :: state
    type(pressed_t), intent(inout) :: contact
    real(wp) :: friction(3)
    integer :: i

    do i = 1, points%n
      if (.not. contact%presses(i) .or. contact%sticks(i) .or. points%mu(i) < tilt) cycle
      associate (normal => contact%placement%frame(:, 1, i), reaction => state%reaction(:, i))
        friction = reaction - dot_product(normal, reaction)*normal
        if (norm2(friction) > 0.0_wp) contact%across(:, i) = cross(normal, friction/norm2(friction))
      end associate
    end do
  end subroutine hold_across

  !> The rows of the points that press, and those of neutral motions, at their pins.
  pure subroutine find_rows(scene, points, map, motions, contact, unturned, rows)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(dof_map_t), intent(in) :: map
    type(free_motions_t), intent(in) :: motions
    type(pressed_t), intent(in) :: contact
    real(wp), intent(in) :: unturned(:, :) !! as of unturned_motions
    type(rows_t), intent(out) :: rows
    integer, allocatable :: free(:)
    real(wp) :: direction(3), factor(3)
    integer :: i, j, k, axis, n_axes, first, n_slave, slave(3), equations(3), pin

    allocate (free(0))
    allocate (rows%entries%row(0), rows%entries%column(0), rows%entries%value(0))
    do i = 1, points%n
      if (.not. contact%presses(i)) cycle
      n_axes = merge(3, 2, contact%sticks(i))
      free = free_obstacle(scene, motions, points%pair(i))
      call list_slave(points, contact%placement%weights, i, n_slave, slave, factor)
      do axis = 1, n_axes
        direction = contact%placement%frame(:, axis, i)
        if (axis > 1 .and. .not. contact%sticks(i)) direction = contact%across(:, i)
        ! A point slides; or this is the way around the axis of a body of revolution.
        if (.not. any(abs(direction) > 0.0_wp)) cycle
        rows%n = rows%n + 1
        first = rows%n_entries + 1
        do k = 1, n_slave
          call add_entries(map, slave(k), factor(k)*direction, rows)
        end do
        associate (weights => contact%placement%weights)
          do k = weights%first(i), weights%first(i + 1) - 1
            call add_entries(map, weights%node(k), -weights%weight(k)*direction, rows)
          end do
        end associate
        call put(rows%entries, rows%n_entries, spread(rows%n, 1, size(free)), map%n_free + free, &
          [(-dot_product(motions%translation(:, free(j)), direction), j=1, size(free))])
        ! Where supports hold both sides in this direction there is no row.
        if (.not. any(abs(rows%entries%value(first:rows%n_entries)) > independent)) then
          rows%n = rows%n - 1
          rows%n_entries = first - 1
          cycle
        end if
      end do
    end do
    do k = 1, size(unturned, 2)
      rows%n = rows%n + 1
      do j = 1, motions%n
        pin = map%n_free + j
        if (motions%body(j) > 0) then
          equations = equations_of(map, motions%node(j))
          pin = equations(motions%dof(j))
        end if
        call put(rows%entries, rows%n_entries, [rows%n], [pin], unturned(j:j, k))
      end do
    end do
    rows%entries%row = rows%entries%row(:rows%n_entries)
    rows%entries%column = rows%entries%column(:rows%n_entries)
    rows%entries%value = rows%entries%value(:rows%n_entries)
  end subroutine find_rows

  !> The neutral motions with whose turns no force on their bodies would turn.
  function unturned_motions(scene, points, solver, state, placement) result(unturned)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    type(state_t), intent(in) :: state
    type(placement_t), intent(in) :: placement
    real(wp), allocatable :: unturned(:, :)    !! (n_motions,k) [-]
    real(wp), parameter :: along = 1.0e-9_wp   !! part of a force across the axis that is none [-]
    real(wp), allocatable :: force(:, :)
    logical, allocatable :: is_turned(:)
    real(wp) :: turn(3)
    integer :: i, k

    unturned = neutral_motions(solver%contact, solver%body%motions%n)
    if (size(unturned, 2) == 0) return
    allocate (is_turned(size(unturned, 2)), source=.false.)
    force = state%external_force + nodal_forces(points, placement%weights, state%reaction, &
      scene%mesh%n_nodes)
    associate (motions => solver%body%motions)
      do i = 1, scene%mesh%n_nodes
        if (.not. any(abs(force(:, i)) > 0.0_wp)) cycle
        do k = 1, size(unturned, 2)
          turn = turn_of(motions, unturned(:, k), i, scene%mesh%body(i))
          is_turned(k) = is_turned(k) .or. norm2(cross(turn, force(:, i))) > &
            along*norm2(turn)*norm2(force(:, i))
        end do
      end do
    end associate
    unturned = unturned(:, pack([(k, k=1, size(is_turned))], .not. is_turned))
  end function unturned_motions

  !> How a combination of free motions turns a node.
  pure function turn_of(motions, way, node, body) result(turn)
    type(free_motions_t), intent(in) :: motions
    real(wp), intent(in) :: way(:)      !! (n_motions) [-]
    integer, intent(in) :: node, body
    real(wp) :: turn(3)                 !! [1/length]

    if (allocated(motions%piece)) then
      if (motions%piece(node) > 0) then
        turn = matmul(motions%piece_rotation(:, motions%piece(node), :), way)
        return
      end if
    end if
    turn = matmul(motions%rotation, merge(way, 0.0_wp, motions%body == body))
  end function turn_of

  !> Put entries behind the first `n` of a list, which has room for more.
  pure subroutine put(list, n, row, column, value)
    type(triplets_t), intent(inout) :: list
    integer, intent(inout) :: n
    integer, intent(in) :: row(:), column(:)
    real(wp), intent(in) :: value(:)
    integer :: want

    want = n + size(row)
    if (want > size(list%row)) then
      want = max(want, 2*size(list%row))
      call enlarge(list%row, n, want)
      call enlarge(list%column, n, want)
      call enlarge(list%value, n, want)
    end if
    list%row(n + 1:n + size(row)) = row
    list%column(n + 1:n + size(row)) = column
    list%value(n + 1:n + size(row)) = value
    n = n + size(row)
  end subroutine put

  !> The motions of the obstacle of a pair; none where it is held, or where the master is a body.
  pure function free_obstacle(scene, motions, pair) result(free)
    type(scene_t), intent(in) :: scene
    type(free_motions_t), intent(in) :: motions
    integer, intent(in) :: pair
    integer, allocatable :: free(:)
    integer :: j

    allocate (free(0))
    if (motions%n == 0 .or. scene%pairs(pair)%master == 0) return
    associate (ref_node => scene%obstacles(scene%pairs(pair)%master)%ref_node)
      free = pack([(j, j=1, motions%n)], motions%body == 0 .and. motions%node == ref_node)
    end associate
  end function free_obstacle

  !> Add the unknowns of a node to the last row, those of its masters where it depends on others.
  pure subroutine add_entries(map, node, coefficient, rows)
    type(dof_map_t), intent(in) :: map
    integer, intent(in) :: node
    real(wp), intent(in) :: coefficient(3)
    type(rows_t), intent(inout) :: rows
    integer, allocatable :: equations(:)
    real(wp), allocatable :: weights(:)
    integer :: i

    do i = 1, 3
      call interface_terms_of(map, node, i, equations, weights)
      call put(rows%entries, rows%n_entries, spread(rows%n, 1, size(equations)), &
        map%n_free - map%n_interface + equations, coefficient(i)*weights)
    end do
  end subroutine add_entries

  !> Forces on nodes that stresses do not answer, as constraints hand them on; none where no
  !> coupling turns.
  function unanswered_forces(scene, points, state, contact) result(f)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(state_t), intent(in) :: state
    type(pressed_t), intent(in) :: contact
    real(wp) :: f(3, scene%mesh%n_nodes) !! [force]
    type(tangent_t) :: tangent
    type(modes_t) :: modes
    integer :: inverted

    f = 0.0_wp
    if (.not. has_turning(scene)) return
    tangent = tangent_at(scene, state%displacement, state%step, state%position, projection=0.0_wp)
    call find_internal_force(scene, tangent%free, state%displacement, modes, f, inverted)
    f = state%external_force + nodal_forces(points, contact%placement%weights, state%reaction, &
      size(f, 2)) - f
  end function unanswered_forces

  !> Add what forces on the nodes of turning couplings do as these turn, and say whether moments
  !> have no energy: they have one where the rotation is free about one axis.
  pure subroutine add_coupling_stiffness(scene, solver, state, f, map, k, is_dead)
    type(scene_t), intent(in) :: scene
    type(step_solver_t), intent(in) :: solver
    type(state_t), intent(in) :: state
    real(wp), intent(in) :: f(:, :)      !! (3,n_nodes) that stresses do not answer [force]
    type(dof_map_t), intent(in) :: map
    type(triplets_t), intent(inout) :: k
    logical, intent(out) :: is_dead
    integer :: i

    is_dead = .false.
    if (.not. has_turning(scene)) return
    call stiffen_couplings(scene, solver%body%prescribed, state%displacement, -f, 1.0_wp, map, k)
    do i = 1, size(scene%rotations)
      if (.not. is_turning(scene, i)) cycle
      associate (node => scene%rotations(i)%rotation_node)
        is_dead = is_dead .or. (count(equations_of(map, node) > 0) > 1 .and. &
          any(abs(state%external_force(:, node)) > 0.0_wp))
      end associate
    end do
  end subroutine add_coupling_stiffness

  !> Take r_n times the second derivative of the gap out of K at the points that press.
  pure subroutine add_curvature(scene, points, map, motions, state, contact, k)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(dof_map_t), intent(in) :: map
    type(free_motions_t), intent(in) :: motions
    type(state_t), intent(in) :: state
    type(pressed_t), intent(in) :: contact
    type(triplets_t), intent(inout) :: k
    type(obstacle_t) :: obstacle
    type(triplets_t) :: bends
    integer, allocatable :: free(:), equations(:)
    real(wp), allocatable :: way(:, :) !! (3,size(equations)) of the point before the obstacle [-]
    real(wp) :: bend(3, 3), factor(3)
    integer :: pair, i, j, l, m, n, n_slave, slave(3)

    n = 0
    allocate (bends%row(0), bends%column(0), bends%value(0), free(0), equations(0))
    do pair = 1, size(scene%pairs)
      if (scene%pairs(pair)%master == 0 .or. has_fixed_normals(scene, pair)) cycle
      obstacle = as_turned(scene, scene%pairs(pair)%master, state%rotation)
      free = free_obstacle(scene, motions, pair)
      way = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, &
        -motions%translation(:, free)], [3, 3 + size(free)])
      do i = points%first(pair), points%first(pair + 1) - 1
        if (.not. contact%presses(i)) cycle
        ! The gap of a point in the middle of an edge is made of those of three nodes.
        call list_slave(points, contact%placement%weights, i, n_slave, slave, factor)
        do m = 1, n_slave
          equations = [equations_of(map, slave(m)), map%n_free + free]
          bend = -factor(m)*contact%normal_force(i)*bend_of_gap(obstacle, shift_of(obstacle, &
            state%displacement), scene%mesh%coordinates(:, slave(m)) + &
            state%displacement(:, slave(m)))
          do j = 1, size(equations)
            do l = 1, j
              if (equations(j) == 0 .or. equations(l) == 0) cycle
              call put(bends, n, [max(equations(j), equations(l))], [min(equations(j), &
                equations(l))], [dot_product(way(:, j), matmul(bend, way(:, l)))])
            end do
          end do
        end do
      end do
    end do
    k%row = [k%row, bends%row(:n)]
    k%column = [k%column, bends%column(:n)]
    k%value = [k%value, bends%value(:n)]
  end subroutine add_curvature

  !> Put the rows, each near 1 in size, below the matrix, to be eliminated last. Rows may depend on
  !> each other, as those of many points before a rigid body: each gives way a little.
  pure subroutine border(rows, d, k, position)
    type(rows_t), intent(in) :: rows
    real(wp), intent(in) :: d(:)           !! (n) scales of the unknowns [sqrt(length/force)]
    type(triplets_t), intent(inout) :: k   !! scaled
    integer, allocatable, intent(inout) :: position(:)
    real(wp) :: largest(rows%n), value(size(rows%entries%value))
    integer :: i

    value = rows%entries%value*d(rows%entries%column)
    largest = 0.0_wp
    do i = 1, size(value)
      largest(rows%entries%row(i)) = max(largest(rows%entries%row(i)), abs(value(i)))
    end do
    associate (row => [(k%n + i, i=1, rows%n)])
      k%row = [k%row, k%n + rows%entries%row, row]
      k%column = [k%column, rows%entries%column, row]
    end associate
    k%value = [k%value, value/largest(rows%entries%row), spread(-independent, 1, rows%n)]
    position = [position, (k%n + i, i=1, rows%n)]
    k%n = k%n + rows%n
  end subroutine border

end module stability_mod
