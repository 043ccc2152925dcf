!> What does not change between increments: unknowns, factor, compliance, contact problem, responses
!> to the loads.
module operators_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t, raise, exit_not_solved
  use text_mod, only: to_text
  use system_mod, only: wall_seconds
  use dense_mod, only: norm_1
  use mesh_mod, only: node_neighbours
  use obstacles_mod, only: is_flat, ref_nodes
  use controls_mod, only: is_exact, precision_in_words
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t
  use mesh_forces_mod, only: internal_force, force_rounding
  use dof_map_mod, only: make_dof_map
  use assembly_mod, only: triplets_t, diagonal_ratio
  use shares_mod, only: assemble_shares
  use ordering_mod, only: order_equations
  use sparse_factor_mod, only: factorise, is_analysed, analysed_order
  use stiffness_inverse_mod, only: stiffness_inverse_t, apply_inverse
  use rigid_modes_mod, only: free_motions_t, find_free_motions, hold_pins
  use compliance_mod, only: invert_schur, point_stiffness, rows_of_points, compliance_of_rows
  use near_stiffness_mod, only: near_stiffness_t, turn_near
  use problem_mod, only: contact_problem_t, make_problem, add_single_copy
  use floating_mod, only: floating_t, free_the_motions
  use contact_interface_mod, only: interface_dofs
  use follow_points_mod, only: locate_at, relative
  use point_motions_mod, only: motions_at_rows, undeformed_frames
  use step_loads_mod, only: step_loads_t, resolve_loads
  implicit none
  private

  public :: operators_t, make_operators, change_supports, prepare_step, widen_interface, &
    locate_points, update_contact

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
    type(stiffness_inverse_t) :: inverse          !! with the motions pinned
    type(near_stiffness_t) :: stiffness           !! of the Schur complement at the points, x, y, z
    logical, allocatable :: is_curved(:)          !! (n_points) the obstacle of the point is
    real(wp), allocatable :: frame(:, :, :)       !! (3,3,n_points) columns n, t1, t2
    real(wp), allocatable :: gap(:)               !! (n_points) where the frames hold [length]
    real(wp), allocatable :: place(:, :)
    !! (3,n_points) displacement of the node less that of the obstacle there [length]
    integer, allocatable :: active(:) !! points that have rows, in the order of the problem
    type(contact_problem_t) :: problem            !! over the active points
    type(floating_t) :: floating                  !! what the motions do to it
    type(step_loads_t) :: loads                   !! of the present *STEP
    real(wp), allocatable :: response(:, :, :)
    !! (3,n_nodes,n_patterns) displacements under each pattern [length]
    type(phase_seconds_t) :: seconds              !! summed over the run
    integer :: n_factorisations = 0
    integer :: n_stiffnesses = 0                  !! of bricks, computed
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
    operators%inverse%map = make_dof_map(scene%mesh%body, hold_pins(operators%motions, &
      operators%prescribed), interface_dofs(scene, points))
    call node_neighbours(scene%mesh, start, neighbours)
    call assemble_shares(scene%mesh, scene%materials, operators%inverse%map, start, neighbours, &
      k, n_stiffnesses)
    operators%n_stiffnesses = operators%n_stiffnesses + n_stiffnesses
    call lap(clock, operators%seconds%assemble)
    associate (inverse => operators%inverse)
      inverse%factor%precision = scene%precision
      if (is_analysed(inverse%factor, k, inverse%map%n_interface)) then
        place = analysed_order(inverse%factor) ! by the plan
      else
        call order_equations(inverse%map, start, neighbours, place, error)
        if (allocated(error)) return
      end if
    end associate
    call lap(clock, operators%seconds%order)
    call factorise(k, place, operators%inverse%map%n_interface, operators%inverse%factor, &
      operators%inverse%compliance, &
      error)
    if (allocated(error)) return
    operators%n_factorisations = operators%n_factorisations + 1
    call lap(clock, operators%seconds%factorise)
    operators%stiffness = point_stiffness(operators%inverse%map, points, &
      operators%inverse%compliance)
    condensed = norm_1(operators%inverse%compliance)
    call invert_schur(operators%inverse%compliance, error)
    if (allocated(error)) then
      if (.not. is_exact(scene%precision)) error%message = error%message//'; the factor ('// &
        precision_in_words(scene%precision)//') is not exact: full rank and FACTOR=DOUBLE of '// &
        '*PRECISION hold more'
      return
    end if
    operators%inverse%condition = max(diagonal_ratio(k), &
      condensed*norm_1(operators%inverse%compliance))
    call lap(clock, operators%seconds%condense)
  end subroutine make_factor

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
    real(wp), allocatable :: w(:, :)
    integer :: row(3, points%n), i

    call rows_of_points(operators%prescribed, points, operators%frame, row)
    call compliance_of_rows(operators%inverse%map, points, operators%frame, row, &
      operators%inverse%compliance, w)
    operators%active = pack([(i, i=1, points%n)], row(1, :) > 0)
    if (operators%motions%n > 0) then
      call free_the_motions( &
        motions_at_rows(scene, points, operators%motions, operators%frame, row), &
        motions_at_rows(scene, points, operators%motions, undeformed_frames(scene, points), row), &
        w, operators%floating)
    end if
    call make_problem(row(:, operators%active), points%mu(operators%active), w, &
      operators%problem, turn_near(operators%stiffness, operators%frame, operators%active))
    if (scene%precision%single_compliance) call add_single_copy(operators%problem)
    operators%problem%is_proximal = operators%motions%n > 0
  end subroutine update_contact

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
      call apply_inverse(operators%inverse, load, operators%response, error)
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
    real(wp) :: left, last, largest, enough
    integer :: i, g

    allocate (residual, source=load)
    last = huge(last)
    largest = maxval(abs(load), mask=spread(operators%inverse%map%equation > 0, 3, size(load, 3)))
    enough = 0.0_wp
    ! What Newton-Raphson would let pass.
    if (scene%accuracy%wanted > 0.0_wp) enough = 0.1_wp*scene%contact%tolerance*largest
    refinements: do i = 1, max_refinements
      left = 0.0_wp
      do g = 1, size(load, 3)
        call internal_force(scene%mesh, scene%materials, operators%response(:, :, g), &
          residual(:, :, g))
        residual(:, :, g) = merge(load(:, :, g) - residual(:, :, g), 0.0_wp, &
          operators%inverse%map%equation > 0)
        left = max(left, maxval(maxval(abs(residual(:, :, g)), dim=1) - force_rounding(scene%mesh, &
          scene%materials, operators%response(:, :, g))))
      end do
      if (left <= enough) return
      if (left > 0.5_wp*last) exit refinements
      last = left
      call apply_inverse(operators%inverse, residual, correction, error)
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

  !> Add the time since `clock` to `total` and start the clock again.
  subroutine lap(clock, total)
    real(wp), intent(inout) :: clock, total
    real(wp) :: now

    now = wall_seconds()
    total = total + now - clock
    clock = now
  end subroutine lap

end module operators_mod
