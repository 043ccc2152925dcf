!> What does not change between increments: unknowns, factor, compliance, contact problem, responses
!> to the loads.
module operators_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t, raise, exit_not_solved
  use text_mod, only: to_text
  use system_mod, only: wall_seconds
  use dense_mod, only: solve_least_squares, times_symmetric
  use mesh_mod, only: node_neighbours
  use obstacles_mod, only: is_flat, ref_nodes
  use controls_mod, only: is_exact, precision_in_words
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t
  use mesh_forces_mod, only: internal_force, force_rounding
  use dof_map_mod, only: dof_map_t, make_dof_map
  use assembly_mod, only: triplets_t, assemble_stiffness
  use ordering_mod, only: order_equations
  use sparse_factor_mod, only: sparse_factor_t, factorise
  use rigid_modes_mod, only: free_motions_t, find_free_motions, hold_pins, motion_at, add_motions
  use compliance_mod, only: invert_schur, point_stiffness, rows_of_points, compliance_of_rows
  use problem_mod, only: contact_problem_t, make_problem, add_single_copy
  use floating_mod, only: floating_t, free_the_motions
  use contact_interface_mod, only: interface_dofs
  use follow_points_mod, only: locate_at, relative
  use step_loads_mod, only: step_loads_t, resolve_loads, prescribed_dofs
  implicit none
  private

  public :: operators_t, make_operators, change_supports, prepare_step, widen_interface, &
    apply_inverse, begin_inverse, finish_inverse, on_interface, &
    locate_points, update_contact, neutral_step

  real(wp), parameter :: difference = 1.0e-4_wp !! of the size of the mesh
  real(wp), parameter :: tolerable = 1.0e-6_wp  !! out of balance in a response, of the largest load
  integer,  parameter :: max_refinements = 30   !! of a response to loads

  !> Wall time of the phases [s].
  type :: phase_seconds_t
    real(wp) :: assemble = 0.0_wp
    real(wp) :: order = 0.0_wp
    real(wp) :: factorise = 0.0_wp !! Schur complement included
    real(wp) :: condense = 0.0_wp  !! inverse, rows
    real(wp) :: loads = 0.0_wp     !! responses to the load patterns
  end type phase_seconds_t

  !> Made once for as long as the same degrees of freedom are prescribed; `update_contact` follows
  !> points on curved obstacles.
  type :: operators_t
    logical, allocatable :: prescribed(:, :)      !! (3,n_nodes) reference nodes included
    type(free_motions_t) :: motions               !! rigid motions that supports leave free
    type(dof_map_t) :: map
    type(sparse_factor_t) :: factor               !! with the motions pinned
    real(wp), allocatable :: compliance(:, :)     !! (n_interface,n_interface) [length/force]
    real(wp), allocatable :: stiffness(:, :, :)
    !! (3,3,n_points) of the Schur complement at the points, x, y, z [force/length]
    logical, allocatable :: is_curved(:)          !! (n_points) the obstacle of the point is
    real(wp), allocatable :: frame(:, :, :)       !! (3,3,n_points) columns n, t1, t2
    real(wp), allocatable :: gap(:)               !! (n_points) where the frames hold [length]
    real(wp), allocatable :: place(:, :)
    !! (3,n_points) displacement of the node less that of the obstacle there [length]
    integer, allocatable :: active(:) !! points that have rows, in the order of the problem
    logical, allocatable :: has_friction(:, :)    !! (2,n_points) tangents along which the law acts
    type(contact_problem_t) :: problem            !! over the active points
    type(floating_t) :: floating                  !! what the motions do to it
    real(wp), allocatable :: begun(:)
    !! (n_interface) what `begin_inverse` has found, where `finish_inverse` is due [length]
    real(wp), allocatable :: pressed(:, :)
    !! (3,n_nodes) K^-1 B^T r of the last certified increment, refined [length]
    real(wp), allocatable :: applied(:, :)
    !! (3,n_points) its reactions, x, y, z, where the factor is not exact [force]
    type(step_loads_t) :: loads                   !! of the present *STEP
    real(wp), allocatable :: response(:, :, :)
    !! (3,n_nodes,n_patterns) displacements under each pattern [length]
    type(phase_seconds_t) :: seconds              !! summed over the run
    integer :: n_factorisations = 0
    integer :: n_stiffnesses = 0                  !! of bricks, computed
    real(wp) :: condition = 1.0_wp                !! of the stiffness, at least [-]
  end type operators_t

contains

  !> Make everything that depends only on which degrees of freedom are prescribed.
  subroutine make_operators(scene, points, prescribed, operators, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    logical, intent(in) :: prescribed(:, :)  !! (3,n_nodes)
    type(operators_t), intent(inout) :: operators
    type(error_t), allocatable, intent(out) :: error
    !! a singular matrix; no memory

    call find_free_motions(scene%mesh, prescribed, ref_nodes(scene%obstacles), points%node, &
      operators%motions, error)
    if (allocated(error)) return
    operators%prescribed = prescribed
    call make_factor(scene, points, operators, error)
    if (allocated(error)) return
    call make_contact(scene, points, operators)
  end subroutine make_operators

  !> Keep what still holds when a *STEP prescribes other degrees of freedom than the one before:
  !> all where there are none, the factor where they are those of obstacles alone.
  subroutine change_supports(scene, points, prescribed, operators, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    logical, intent(in) :: prescribed(:, :)  !! (3,n_nodes)
    type(operators_t), intent(inout) :: operators
    type(error_t), allocatable, intent(out) :: error !! as of make_operators
    logical :: changed(3, size(prescribed, 2))

    changed = prescribed .neqv. operators%prescribed
    if (.not. any(changed)) return
    if (any(changed .and. spread(scene%mesh%body > 0, 1, 3))) then
      call make_operators(scene, points, prescribed, operators, error)
      return
    end if
    operators%prescribed = prescribed
    call find_free_motions(scene%mesh, prescribed, ref_nodes(scene%obstacles), points%node, &
      operators%motions, error)
    if (allocated(error)) return
    call make_contact(scene, points, operators)
  end subroutine change_supports

  !> Locate the contact points on the undeformed mesh, and make their problem.
  subroutine make_contact(scene, points, operators)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(operators_t), intent(inout) :: operators
    logical :: all_points(points%n)
    real(wp) :: clock
    integer :: i

    clock = wall_seconds()
    all_points = .true.
    operators%is_curved = [(.not. is_flat(scene%obstacles(scene%pairs(points%pair(i))%obstacle)), &
      i=1, points%n)]
    call locate_points(scene, points, all_points, &
      spread([0.0_wp, 0.0_wp, 0.0_wp], 2, scene%mesh%n_nodes), operators)
    call update_contact(scene, points, operators)
    call lap(clock, operators%seconds%condense)
  end subroutine make_contact

  !> Factorise the stiffness and condense it to the contact nodes.
  subroutine make_factor(scene, points, operators, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(operators_t), intent(inout) :: operators
    type(error_t), allocatable, intent(out) :: error
    type(triplets_t) :: k
    integer, allocatable :: start(:), neighbours(:), place(:)
    real(wp) :: clock, condensed
    integer :: n_stiffnesses

    clock = wall_seconds()
    operators%map = make_dof_map(scene%mesh%body, hold_pins(operators%motions, &
      operators%prescribed), interface_dofs(scene, points))
    call node_neighbours(scene%mesh, start, neighbours)
    call assemble_stiffness(scene%mesh, scene%materials, operators%map, start, neighbours, k, &
      n_stiffnesses)
    operators%n_stiffnesses = operators%n_stiffnesses + n_stiffnesses
    call lap(clock, operators%seconds%assemble)
    call order_equations(operators%map, start, neighbours, place, error)
    if (allocated(error)) return
    call lap(clock, operators%seconds%order)
    operators%factor%precision = scene%precision
    if (allocated(operators%pressed)) deallocate (operators%pressed, operators%applied)
    call factorise(k, place, operators%map%n_interface, operators%factor, operators%compliance, &
      error)
    if (allocated(error)) return
    operators%n_factorisations = operators%n_factorisations + 1
    call lap(clock, operators%seconds%factorise)
    operators%stiffness = point_stiffness(operators%map, points, operators%compliance)
    condensed = norm_1(operators%compliance)
    call invert_schur(operators%compliance, error)
    operators%condition = max(diagonal_ratio(k), condensed*norm_1(operators%compliance))
    call lap(clock, operators%seconds%condense)
  end subroutine make_factor

  !> The largest sum of a column; 0 of an empty matrix.
  pure real(wp) function norm_1(a)
    real(wp), intent(in) :: a(:, :)
    integer :: j

    norm_1 = 0.0_wp
    do j = 1, size(a, 2)
      norm_1 = max(norm_1, sum(abs(a(:, j))))
    end do
  end function norm_1

  !> Largest over smallest diagonal entry: no condition is better.
  pure real(wp) function diagonal_ratio(k)
    type(triplets_t), intent(in) :: k
    logical :: on_diagonal(size(k%value))

    diagonal_ratio = 1.0_wp
    on_diagonal = k%row == k%column .and. k%value > 0.0_wp
    if (.not. any(on_diagonal)) return
    diagonal_ratio = maxval(k%value, mask=on_diagonal)/minval(k%value, mask=on_diagonal)
  end function diagonal_ratio

  !> Frames and gaps of some contact points where displacement `u` takes them.
  subroutine locate_points(scene, points, which, u, operators)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    logical, intent(in) :: which(:)      !! (n_points)
    real(wp), intent(in) :: u(:, :)      !! (3,n_nodes) [length]
    type(operators_t), intent(inout) :: operators
    integer :: i

    if (allocated(operators%frame)) then
      if (size(operators%gap) /= points%n) deallocate (operators%frame, operators%gap, &
        operators%place)
    end if
    if (.not. allocated(operators%frame)) then
      allocate (operators%frame(3, 3, points%n), operators%gap(points%n))
      allocate (operators%place(3, points%n))
    end if
    do i = 1, points%n
      if (.not. which(i)) cycle
      call locate_at(scene, points, i, u, operators%gap(i), operators%frame(:, :, i))
      operators%place(:, i) = relative(points, i, u)
    end do
  end subroutine locate_points

  !> Rows of the contact points as they are located, and the contact problem over those that have
  !> any.
  subroutine update_contact(scene, points, operators)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(operators_t), intent(inout) :: operators
    real(wp), allocatable :: w(:, :), stiffness(:, :, :)
    integer :: row(3, points%n), i, k

    call rows_of_points(operators%prescribed, points, operators%frame, row)
    call compliance_of_rows(operators%map, points, operators%frame, row, operators%compliance, w)
    operators%active = pack([(i, i=1, points%n)], row(1, :) > 0)
    operators%has_friction = row(2:, :) > 0
    allocate (stiffness(3, 3, size(operators%active)))
    do k = 1, size(operators%active)
      i = operators%active(k)
      associate (frame => operators%frame(:, :, i))
        stiffness(:, :, k) = matmul(transpose(frame), matmul(operators%stiffness(:, :, i), frame))
      end associate
    end do
    if (operators%motions%n > 0) then
      call free_the_motions(motions_at_rows(scene, points, operators, operators%frame, row), &
        motions_at_rows(scene, points, operators, undeformed_frames(scene, points, operators), &
        row), w, operators%floating)
    end if
    call make_problem(row(:, operators%active), points%mu(operators%active), w, &
      operators%problem, stiffness)
    if (operators%factor%precision%single_compliance) call add_single_copy(operators%problem)
    operators%problem%is_proximal = operators%motions%n > 0
  end subroutine update_contact

  !> What the free motions do at the rows of the contact points, G of docs/theory.md (9.2).
  pure function motions_at_rows(scene, points, operators, frame, row) result(g)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(operators_t), intent(in) :: operators
    real(wp), intent(in) :: frame(:, :, :)  !! (3,3,n_points)
    integer, intent(in) :: row(:, :)        !! (3,n_points) 0 where there is none
    real(wp), allocatable :: g(:, :)        !! (n_rows,n_motions) [-]
    real(wp) :: motion(3)
    integer :: i, j, a

    allocate (g(count(row > 0), operators%motions%n))
    do i = 1, points%n
      if (row(1, i) == 0) cycle
      do j = 1, operators%motions%n
        motion = motion_of_point(scene, points, operators, i, j)
        do a = 1, 3
          if (row(a, i) > 0) g(row(a, i), j) = dot_product(frame(:, a, i), motion)
        end do
      end do
    end do
  end function motions_at_rows

  !> What free motion `j` does to a point's node, less what it does to its obstacle.
  pure function motion_of_point(scene, points, operators, i, j) result(motion)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(operators_t), intent(in) :: operators
    integer, intent(in) :: i, j
    real(wp) :: motion(3) !! [-]

    motion = motion_at(operators%motions, scene%mesh, j, points%node(i))
    if (points%ref_node(i) > 0) motion = motion - motion_at(operators%motions, scene%mesh, j, &
      points%ref_node(i))
  end function motion_of_point

  !> Frames of the contact points before anything moved.
  pure function undeformed_frames(scene, points, operators) result(frame)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(operators_t), intent(in) :: operators
    real(wp) :: frame(3, 3, points%n)
    real(wp) :: gap, nothing(3, scene%mesh%n_nodes)
    integer :: i

    frame = operators%frame
    nothing = 0.0_wp
    do i = 1, points%n
      if (operators%is_curved(i)) call locate_at(scene, points, i, nothing, gap, frame(:, :, i))
    end do
  end function undeformed_frames

  !> How far the neutral motions go until what turned normals leave on them is 0: a Newton step, the
  !> derivative by a difference. Nothing where normals do not turn.
  function neutral_step(scene, points, operators, reaction, u, turned) result(a)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(operators_t), intent(in) :: operators
    real(wp), intent(in) :: reaction(:, :)  !! (3,n_points) x, y, z [force]
    real(wp), intent(in) :: u(:, :)         !! (3,n_nodes) [length]
    real(wp), intent(in) :: turned(:)       !! (k) as of drift_t [force]
    real(wp) :: a(operators%motions%n)      !! [length]
    real(wp) :: stiffness(size(turned), size(turned)), moved(3, scene%mesh%n_nodes)
    real(wp) :: local(3), force(3), frame(3, 3), gap, step
    integer :: i, j, k

    step = difference*maxval(maxval(scene%mesh%coordinates, dim=2) - minval( &
      scene%mesh%coordinates, dim=2))
    stiffness = 0.0_wp
    associate (neutral => operators%floating%neutral)
      do k = 1, size(turned)
        moved = u
        call add_motions(operators%motions, scene%mesh, step*neutral(:, k), moved)
        do i = 1, points%n
          if (.not. operators%is_curved(i) .or. .not. any(abs(reaction(:, i)) > 0.0_wp)) cycle
          call locate_at(scene, points, i, moved, gap, frame)
          local = matmul(reaction(:, i), operators%frame(:, :, i))
          force = (matmul(frame, local) - reaction(:, i))/step
          do j = 1, operators%motions%n
            stiffness(:, k) = stiffness(:, k) - dot_product(force, motion_of_point(scene, points, &
              operators, i, j))*neutral(j, :)
          end do
        end do
      end do
      a = matmul(neutral, solve_least_squares(stiffness, turned))
    end associate
  end function neutral_step

  !> At the start of a *STEP: its load patterns and the displacements they cause without contact.
  subroutine prepare_step(scene, step, state, operators, error)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    type(state_t), intent(in) :: state
    type(operators_t), intent(inout) :: operators
    type(error_t), allocatable, intent(out) :: error !! MUMPS failed

    call resolve_loads(scene, step, state%displacement, operators%loads)
    call respond(scene, operators, error)
  end subroutine prepare_step

  !> Take the whole of the slave surfaces into the interface, in the middle of a *STEP.
  subroutine widen_interface(scene, points, operators, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points !! all of them in reach
    type(operators_t), intent(inout) :: operators
    type(error_t), allocatable, intent(out) :: error !! as of make_operators
    logical :: prescribed(3, scene%mesh%n_nodes)

    prescribed = operators%prescribed
    call make_operators(scene, points, prescribed, operators, error)
    if (allocated(error)) return
    call respond(scene, operators, error)
  end subroutine widen_interface

  !> The displacements that the load patterns cause without contact.
  subroutine respond(scene, operators, error)
    type(scene_t), intent(in) :: scene
    type(operators_t), intent(inout) :: operators
    type(error_t), allocatable, intent(out) :: error
    !! MUMPS failed; the factor is too far from the stiffness
    real(wp), allocatable :: load(:, :, :)
    real(wp) :: clock
    integer :: g

    clock = wall_seconds()
    associate (loads => operators%loads)
      load = loads%force
      do g = 1, loads%n_patterns
        ! Prescribed displacements act through the forces they cause in an otherwise undeformed
        ! body.
        call internal_force(scene%mesh, scene%materials, loads%displacement(:, :, g), load(:, :, g))
        load(:, :, g) = loads%force(:, :, g) - load(:, :, g)
      end do
      call apply_inverse(operators, load, operators%response, error)
      if (allocated(error)) return
      if (.not. is_exact(scene%precision)) call refine(scene, load, operators, error)
      if (allocated(error)) return
      operators%response = operators%response + loads%displacement
    end associate
    call lap(clock, operators%seconds%loads)
  end subroutine respond

  !> Correct the responses with what is left out of balance, by internal forces in double precision,
  !> until that is rounding.
  subroutine refine(scene, load, operators, error)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: load(:, :, :)            !! (3,n_nodes,n_patterns) [force]
    type(operators_t), intent(inout) :: operators    !! its responses are corrected
    type(error_t), allocatable, intent(out) :: error
    !! MUMPS failed; nothing is gained any more before rounding is reached
    real(wp), allocatable :: residual(:, :, :), correction(:, :, :)
    real(wp) :: left, last, largest, rounding
    integer :: i, g

    allocate (residual, source=load)
    last = huge(last)
    largest = maxval(abs(load), mask=spread(operators%map%equation > 0, 3, size(load, 3)))
    rounding = 0.0_wp
    refinements: do i = 1, max_refinements
      do g = 1, size(load, 3)
        call internal_force(scene%mesh, scene%materials, operators%response(:, :, g), &
          residual(:, :, g))
        residual(:, :, g) = merge(load(:, :, g) - residual(:, :, g), 0.0_wp, &
          operators%map%equation > 0)
        rounding = max(rounding, force_rounding(scene%mesh, scene%materials, &
          abs(operators%response(:, :, g))))
      end do
      left = maxval(abs(residual))
      if (left <= rounding) return
      if (left > 0.5_wp*last) exit refinements
      last = left
      call apply_inverse(operators, residual, correction, error)
      if (allocated(error)) return
      operators%response = operators%response + correction
    end do refinements
    ! Newton-Raphson takes care of a little, and the certificate judges.
    if (left <= tolerable*largest) return
    call raise(error, exit_not_solved, 'the factor of the stiffness is too far from it ('// &
      precision_in_words(scene%precision)//'): responses to loads stay out of balance by '// &
      to_text(left/largest, 2)//' of the largest load, refined '//to_text(i)// &
      ' times; full rank and FACTOR=DOUBLE of *PRECISION hold more')
  end subroutine refine

  !> K^-1 f for nodal forces f, several at once; prescribed degrees of freedom stay 0.
  subroutine apply_inverse(operators, force, displacement, error)
    type(operators_t), intent(inout) :: operators
    real(wp), intent(in) :: force(:, :, :)                    !! (3,n_nodes,m) [force]
    real(wp), allocatable, intent(out) :: displacement(:, :, :) !! (3,n_nodes,m) [length]
    type(error_t), allocatable, intent(out) :: error          !! MUMPS failed
    real(wp), allocatable :: b(:, :), reduced(:, :)
    integer :: g

    associate (map => operators%map)
      allocate (b(map%n_free, size(force, 3)), reduced(map%n_interface, size(force, 3)))
      do g = 1, size(force, 3)
        call gather(map, force(:, :, g), b(:, g))
      end do
      if (map%n_interface == 0) then
        call operators%factor%solve(b, error)
      else
        call operators%factor%condense(b, reduced, error)
        if (allocated(error)) return
        do g = 1, size(reduced, 2)
          reduced(:, g) = times_symmetric(operators%compliance, reduced(:, g))
        end do
        call operators%factor%expand(reduced, b, error)
      end if
      if (allocated(error)) return
      allocate (displacement(3, size(force, 2), size(force, 3)))
      do g = 1, size(force, 3)
        call scatter(map, b(:, g), displacement(:, :, g))
      end do
    end associate
  end subroutine apply_inverse

  !> First half of K^-1 f: what f does to the interface; without one all of it.
  !>
  !> The rest is kept until `finish_inverse`, which must be the next use of the factor.
  subroutine begin_inverse(operators, force, shift, error)
    type(operators_t), intent(inout) :: operators
    real(wp), intent(in) :: force(:, :)              !! (3,n_nodes) [force]
    real(wp), intent(out) :: shift(:, :)             !! (3,n_nodes) [length]
    type(error_t), allocatable, intent(out) :: error !! MUMPS failed
    real(wp) :: b(operators%map%n_free, 1), reduced(operators%map%n_interface, 1)

    call gather(operators%map, force, b(:, 1))
    if (operators%map%n_interface == 0) then
      call operators%factor%solve(b, error)
    else
      call operators%factor%condense(b, reduced, error)
      if (allocated(error)) return
      operators%begun = times_symmetric(operators%compliance, reduced(:, 1))
      b = 0.0_wp
      b(operators%map%n_free - operators%map%n_interface + 1:, 1) = operators%begun
    end if
    if (allocated(error)) return
    call scatter(operators%map, b(:, 1), shift)
  end subroutine begin_inverse

  !> Second half, with forces that act on the interface alone: what they do to it, and what both do
  !> to the interior.
  subroutine finish_inverse(operators, force, displacement, error)
    type(operators_t), intent(inout) :: operators
    real(wp), intent(in) :: force(:, :)              !! (3,n_nodes) on the interface [force]
    real(wp), intent(out) :: displacement(:, :)      !! (3,n_nodes) [length]
    type(error_t), allocatable, intent(out) :: error !! MUMPS failed
    real(wp) :: b(operators%map%n_free, 1), answer(operators%map%n_interface), &
      reduced(operators%map%n_interface, 1), nothing(3, size(force, 2))

    displacement = 0.0_wp
    nothing = 0.0_wp
    if (operators%map%n_interface == 0) return
    associate (first => operators%map%n_free - operators%map%n_interface + 1)
      if (.not. allocated(operators%begun)) then
        call begin_inverse(operators, nothing, displacement, error)
        if (allocated(error)) return
      end if
      call gather(operators%map, force, b(:, 1))
      answer = times_symmetric(operators%compliance, b(first:, 1))
      reduced(:, 1) = operators%begun + answer
      deallocate (operators%begun)
      call operators%factor%expand(reduced, b, error)
      if (allocated(error)) return
      b(first:, 1) = answer
    end associate
    call scatter(operators%map, b(:, 1), displacement)
  end subroutine finish_inverse

  !> What forces on the interface do to it.
  function on_interface(operators, force) result(displacement)
    type(operators_t), intent(in) :: operators
    real(wp), intent(in) :: force(:, :)                 !! (3,n_nodes) on the interface [force]
    real(wp) :: displacement(3, size(force, 2))         !! 0 elsewhere [length]
    real(wp) :: b(operators%map%n_free), answer(operators%map%n_interface)

    call gather(operators%map, force, b)
    associate (first => operators%map%n_free - operators%map%n_interface + 1)
      answer = times_symmetric(operators%compliance, b(first:))
      b = 0.0_wp
      b(first:) = answer
    end associate
    call scatter(operators%map, b, displacement)
  end function on_interface

  !> From nodes to equations.
  pure subroutine gather(map, nodal, b)
    type(dof_map_t), intent(in) :: map
    real(wp), intent(in) :: nodal(:, :)   !! (3,n_nodes)
    real(wp), intent(out) :: b(:)         !! (n_free)
    integer :: node, i

    do node = 1, size(nodal, 2)
      do i = 1, 3
        if (map%equation(i, node) > 0) b(map%equation(i, node)) = nodal(i, node)
      end do
    end do
  end subroutine gather

  !> From equations to nodes, 0 along prescribed directions.
  pure subroutine scatter(map, b, nodal)
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
  end subroutine scatter

  !> Add the time since `clock` to `total` and start the clock again.
  subroutine lap(clock, total)
    real(wp), intent(inout) :: clock, total
    real(wp) :: now

    now = wall_seconds()
    total = total + now - clock
    clock = now
  end subroutine lap

end module operators_mod
