!> One load increment: the Newton-Raphson loop of [JFT07] eq. (1) around the condensed contact
!> problem.
!>
!>   1. Loads of the increment; displacement u_free under them without contact.
!>   2. Closest points on curved obstacles; x_free: where the contact points would be.
!>   3. Reactions: the contact problem x = W r + x_free, with how far the free motions go.
!>   4. Displacement: u = u_free + K^-1 B^T r + free motions.
!>   5. Out-of-balance force; when too large, u_free takes its correction and 2 to 4 are done
!>      again; so they are while closest points move or turned normals drive a neutral motion.
!>   6. Certificate; should it ask for more than the residual did, 2 to 5 with a smaller residual.
!>   7. Energies.
module advance_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t, raise, exit_not_solved
  use text_mod, only: to_text
  use system_mod, only: wall_seconds
  use constraints_mod, only: active_constraints, give_to_masters
  use turning_couplings_mod, only: has_turning, end_turns, moments_on_constraints, &
    turned_constraints, work_of_turns
  use scene_mod, only: scene_t, master_name
  use controls_mod, only: stop_at_change, solver_auto
  use contact_points_mod, only: contact_points_t, master_nodes
  use increments_mod, only: increment_t, next_increment, mark_end, duration_of
  use state_mod, only: state_t
  use increment_report_mod, only: increment_report_t, ending_t, has_converged, worst_entry, &
    ended_well, ended_unbalanced, ended_moving, ended_out_of_reach, ended_passed, ended_inverted, &
    ended_stalled, ended_out_of_balance, ended_indefinite
  use certificate_mod, only: energy_balance
  use own_inertia_mod, only: balance_in_time, balance_bodies, keep_strains
  use certify_increment_mod, only: certify_increment
  use bodies_mod, only: is_linear, strain_energy, strain_energies, find_heat
  use turned_slips_mod, only: work_of_torques
  use candidate_points_mod, only: areas_at
  use edge_middles_mod, only: edge_middles_t, find_edge_middles
  use drag_points_mod, only: drag_points
  use surface_drag_mod, only: drag_along_surfaces
  use follow_points_mod, only: rounding_of_places, carried_slip
  use placement_mod, only: placement_t, place_curved, place_state, is_before_flat
  use transfer_mod, only: nodal_forces, movable, rows_of_points, gap_at
  use describe_contact_mod, only: describe_contact, find_redundant
  use interference_mod, only: has_interference
  use rigid_modes_mod, only: follow_turns
  use linearisation_mod, only: seconds_of
  use step_solver_mod, only: step_solver_t, take_duration
  use newmark_mod, only: by_inertia_t, begins_anew, begin_motion, begin_inertia, end_inertia, &
    error_in_time, watch_inertia, come_to_rest
  use trial_mod, only: goal_t, contact_alone, certified, from_before, as_foreseen, trial_t, &
    set_gaps, begin_trial, begin_near, begin_extrapolated, expected_reactions, trend_of
  use renew_tangent_mod, only: begin_with_tangent, begin_in_motion
  use turned_bodies_mod, only: begin_turned, end_turned
  use other_gaps_mod, only: x_free_of
  use friction_by_rate_mod, only: depends_on_rate, find_coefficients, give_coefficients
  use balance_together_mod, only: is_together, reach_balance
  use path_balance_mod, only: work_on_overlaps
  use look_ahead_mod, only: ahead_t, can_look_ahead, is_ahead, look_ahead, take_foreseen, &
    step_on_interface, forget_ahead
  implicit none
  private

  public :: advance, advance_along

  integer,  parameter :: max_attempts = 4                   !! with ever smaller residuals
  integer,  parameter :: most_again = 200                   !! for coefficients to settle
  real(wp), parameter :: settled = 0.1_wp                   !! of the tolerance: then they are
  real(wp), parameter :: smallest_tolerance = 1.0e-14_wp    !! that an attempt asks for [-]

contains

  !> Bring `old` to the end of the goal's increment, in `new`; `old` is never altered.
  subroutine advance(scene, points, solver, old, goal, new, report, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(inout) :: solver
    !! solutions with its factor; contact before curved obstacles follows the trial's placement
    type(state_t), intent(in) :: old
    type(goal_t), intent(in) :: goal
    type(state_t), intent(inout) :: new
    !! where to start from, if the goal says so; the end, as far as the goal wants it
    type(increment_report_t), intent(out) :: report
    !! not converged, not certified: no error, it is said here
    type(error_t), allocatable, intent(out) :: error
    !! MUMPS failed; a node is prescribed into an obstacle
    type(state_t), allocatable :: begun

    associate (increment => goal%increment)
      if (allocated(solver%body%inertia)) call take_duration(scene, points, old, duration_of( &
        scene%steps(increment%step), increment%position - increment%start), solver, error)
      if (allocated(error)) return
      if (begins_anew(scene, solver, old, increment)) then
        begun = old
        call begin_motion(scene, points, solver, increment, begun)
        call advance_from(scene, points, solver, begun, goal, new, report, error)
      else
        call advance_from(scene, points, solver, old, goal, new, report, error)
      end if
    end associate
  end subroutine advance

  !> The same, where bodies are in balance as the increment begins.
  subroutine advance_from(scene, points, solver, old, goal, new, report, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(inout) :: solver      !! as of `advance`
    type(state_t), intent(in) :: old
    type(goal_t), intent(in) :: goal
    type(state_t), intent(inout) :: new               !! the same
    type(increment_report_t), intent(out) :: report
    type(error_t), allocatable, intent(out) :: error  !! as of `advance`
    type(contact_points_t) :: now
    !! with the extra gaps at the end of the increment, and the coefficients that its slips have
    type(trial_t) :: trial
    type(by_inertia_t), allocatable :: inertia !! of a dynamic *STEP
    real(wp), dimension(3, points%n) :: reaction
    real(wp) :: answer(solver%body%inverse%map%n_interface) !! to the reactions [length]
    real(wp) :: clock, on_tangents
    logical :: is_held, is_in_motion

    clock = wall_seconds()
    on_tangents = seconds_of(solver%on_tangents)
    ! Where the pins do not hold bodies there, the first iteration finds so and ends.
    call follow_turns(scene%mesh, old%displacement, solver%body%prescribed, turned_constraints( &
      scene, solver%body%prescribed, old%displacement), solver%body%motions, is_held)
    call set_gaps(scene, points, goal%increment, now, solver)
    call begin_inertia(scene, points, solver, old, goal%increment, inertia, error)
    if (allocated(error)) return
    call begin_trial(scene, now, solver, old, goal, trial, inertia)
    is_in_motion = .false.
    if (goal%start /= from_before) then
      reaction = new%reaction
      call begin_near(scene, now, solver, new, trial)
    else
      reaction = expected_reactions(scene, points, solver, old, goal%increment)
      is_in_motion = allocated(solver%body%inertia) .and. .not. (is_linear(scene) .or. &
        is_together(scene, solver))
      if (is_in_motion) then
        call begin_in_motion(scene, now, solver, old, trial, error)
      else
        call begin_turned(scene, now, solver, old, trial, error)
      end if
      if (allocated(error)) return
      if (trial%has_turned) then
        reaction = trial%applied_reaction
      else if (.not. is_in_motion) then
        call begin_extrapolated(scene, now, solver, old, goal%increment, reaction, trial)
      end if
    end if
    if (goal%wanted == contact_alone .and. can_look_ahead(scene, points, solver)) then
      new = old
      call step_on_interface(scene, points, solver, trial, new, reaction, report, answer)
      return
    end if
    call begin_new(old, goal%increment, reaction, new)
    trial%is_foreseen = goal%start == as_foreseen
    if (trial%is_foreseen) report%ending = ending_t(ended_well)
    call complete(scene, now, solver, old, trial, new, report, error)
    if (trial%is_extrapolated .and. .not. allocated(error) .and. (has_no_result(report) .or. &
      (is_linear(scene) .and. .not. has_converged(report)))) then
      ! The path may have bent.
      call begin_trial(scene, now, solver, old, goal, trial, inertia)
      call begin_new(old, goal%increment, reaction, new)
      report = increment_report_t()
      now%mu = points%mu
      call complete(scene, now, solver, old, trial, new, report, error)
    end if
    call end_turned(scene, now, solver)
    new%trend = trend_of(goal%increment, old%reaction, new%reaction)
    if (any(points%is_curved) .or. .not. is_linear(scene)) new%displacement_trend = trend_of( &
      goal%increment, old%displacement, new%displacement)
    if (allocated(trial%by_iteration)) then
      if (allocated(trial%by_iteration%before)) new%displacement_trend = trend_of( &
        goal%increment, trial%by_iteration%before, new%displacement - trial%u_free)
    end if
    report%wall_time = wall_seconds() - clock - (seconds_of(solver%on_tangents) - on_tangents)
  end subroutine advance_from

  !> The same for the increment that follows `old` in the deck, with the help of `ahead`: where the
  !> interface is all that one increment needs of the one before, several are solved for at once.
  subroutine advance_along(scene, points, solver, old, ahead, new, report, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(inout) :: solver   !! as of `advance`
    type(state_t), intent(in) :: old
    type(ahead_t), intent(inout) :: ahead
    type(state_t), intent(inout) :: new
    type(increment_report_t), intent(out) :: report
    type(error_t), allocatable, intent(out) :: error
    type(contact_points_t) :: now
    type(goal_t) :: goal
    type(trial_t) :: trial
    real(wp) :: reaction(3, points%n)
    real(wp) :: clock

    goal = goal_t(next_increment(scene%steps, old), solver%choices%tolerance, &
      shows_progress=solver%choices%shows_progress)
    if (.not. can_look_ahead(scene, points, solver)) then
      call advance(scene, points, solver, old, goal, new, report, error)
      return
    end if
    if (.not. is_ahead(ahead, goal%increment)) then
      call look_ahead(scene, points, solver, old, ahead, error)
      if (allocated(error)) return
    end if
    clock = wall_seconds()
    now = points
    call begin_trial(scene, points, solver, old, goal, trial)
    call take_foreseen(points, ahead, goal%increment, solver, trial, reaction, report)
    call begin_new(old, goal%increment, reaction, new)
    call complete(scene, now, solver, old, trial, new, report, error)
    new%trend = trend_of(goal%increment, old%reaction, new%reaction)
    report%wall_time = report%wall_time + wall_seconds() - clock
    ! What was corrected was not what those after it began from.
    if (report%newton_raphson_iterations > 1 .or. .not. has_converged(report)) call &
      forget_ahead(ahead)
  end subroutine advance_along

  !> The end of an increment before it is sought.
  pure subroutine begin_new(old, increment, reaction, new)
    type(state_t), intent(in) :: old
    type(increment_t), intent(in) :: increment
    real(wp), intent(in) :: reaction(:, :) !! (3,n_points) to start from [force]
    type(state_t), intent(out) :: new

    new = old
    call mark_end(increment, new)
    new%reaction = reaction
  end subroutine begin_new

  !> From the loads of an increment, and perhaps its first reactions, to its end.
  subroutine complete(scene, points, solver, old, trial, new, report, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(inout) :: points !! coefficients at rest; those of the slips
    type(step_solver_t), intent(inout) :: solver
    type(state_t), intent(in) :: old
    type(trial_t), intent(inout) :: trial
    type(state_t), intent(inout) :: new
    type(increment_report_t), intent(inout) :: report
    type(error_t), allocatable, intent(out) :: error !! as of `advance`
    type(state_t) :: before
    type(increment_report_t) :: of_before
    real(wp) :: largest(points%n), apart, clock
    integer :: i, n_again

    largest = points%mu
    if (depends_on_rate(points) .and. trial%goal%wanted > contact_alone) call give_coefficients( &
      points, solver%contact)
    n_again = 0
    i = 0
    attempts: do while (i < max_attempts)
      i = i + 1
      ! 2. to 5. Equilibrium
      if (i == 1 .and. solver%choices%precision%renews_tangent .and. .not. is_together(scene, &
        solver)) call begin_with_tangent(scene, points, solver, old, trial, report, error)
      if (allocated(error)) return
      if (.not. has_no_result(report)) call reach_balance(scene, points, solver, old, trial, new, &
        report, error)
      if (allocated(error)) return
      if (allocated(trial%turned_from)) call end_turns(scene, trial%forces%prescribed, &
        trial%turned_from, new%displacement)
      if (trial%goal%wanted == contact_alone) then
        new%external_force = trial%forces%external
        return
      end if
      if (has_no_result(report)) then
        ! No result, but others may want to try the contact problem: with these frames.
        call describe_contact(scene, points, solver%contact, solver%undeformed, trial%placement, &
          old, new, report%contact)
        exit attempts
      end if

      ! 6. Certificate
      call place_curved(scene, points, new%displacement, trial%placement, new%rotation, &
        stay=.true., everywhere=.true.)
      call drag_points(scene, points, old, new%displacement, new%rotation, trial%placement)
      call drag_along_surfaces(scene, points, trial%began, old, new%displacement, trial%placement, &
        new%reaction)
      call describe_contact(scene, points, solver%contact, solver%undeformed, trial%placement, &
        old, new, report%contact)
      if (allocated(solver%body%inertia)) call end_inertia(scene, solver, old, trial%in_motion, &
        trial%forces%internal, nodal_forces(points, trial%placement%weights, new%reaction, &
        size(new%displacement, 2)), trial%forces%external, new)
      if (is_together(scene, solver)) report%x_free = x_free_of(solver%contact, report%contact)
      ! Pressures before obstacles are over the faces as they are deformed.
      if (.not. is_linear(scene)) then
        where (.not. points%on_surface) report%contact%covered_area = areas_at(scene, points, &
          new%displacement)
      end if
      if (depends_on_rate(points) .and. n_again < most_again) then
        call find_coefficients(points, largest, report%contact, trial%duration, apart)
        if (apart > settled*trial%tolerance) then
          call give_coefficients(points, solver%contact)
          trial%placed_at = new%displacement
          n_again = n_again + 1
          i = i - 1
          cycle attempts
        end if
      end if
      call find_redundant(solver%contact, 10.0_wp*trial%goal%tolerance* &
        maxval(abs(new%displacement)) + rounding_of_places(scene, new%displacement), report%contact)
      call watch_inactive(scene, points, solver, trial%goal%tolerance, new, report, error)
      if (allocated(error)) return
      if (report%ending%cause == ended_out_of_reach) return
      if (trial%goal%wanted < certified) exit attempts
      clock = wall_seconds()
      report%certificate = certify_increment(scene, points, trial%goal%tolerance, &
        report%contact, old, new, trial%forces%imposed_t, solver%own_mass)
      report%certify_time = report%certify_time + wall_seconds() - clock
      ! Where no solver gets any further the certificate judges what the best of them found.
      if (report%certificate%certified .and. report%ending%cause == ended_stalled .and. &
        scene%contact%solver == solver_auto) report%ending = ending_t(ended_well)
      if (i > 1 .and. .not. has_converged(report)) then
        ! More than double precision gives. Where it comes close enough that is a result; where not,
        ! what converged before, and was not certified, stands.
        if (report%certificate%certified) then
          report%ending = ending_t(ended_well)
        else
          new = before
          report = of_before
        end if
        exit attempts
      end if
      if (report%certificate%certified .or. .not. has_converged(report)) exit attempts
      if (scene%contact%stop_rule == stop_at_change) exit attempts
      ! The residual is measured by forces. Where these are large beside what they move (nearly
      ! incompressible bodies) the gaps need a smaller one.
      trial%tolerance = max(smallest_tolerance, trial%tolerance*max(1.0e-4_wp, &
        trial%goal%tolerance/worst_entry(report%certificate)))
      trial%placed_at = new%displacement
      before = new
      of_before = report
    end do attempts
    ! Points that still move where the certificate does not pass are why.
    if (trial%goal%wanted == certified .and. report%moved > 10.0_wp*trial%goal%tolerance .and. &
      has_converged(report) .and. .not. report%certificate%certified) report%ending = ending_t( &
      ended_moving, report%moved, report%moved_point)
    if (.not. has_no_result(report)) call finish(scene, points, solver, old, trial, new, report)
  end subroutine complete

  !> Whether an increment has ended without displacements to judge.
  pure logical function has_no_result(report)
    type(increment_report_t), intent(in) :: report

    has_no_result = any(report%ending%cause == [ended_unbalanced, ended_passed, ended_inverted, &
      ended_out_of_balance, ended_indefinite])
  end function has_no_result

  !> 7. Energies, and what the state keeps beside displacements and reactions.
  subroutine finish(scene, points, solver, old, trial, new, report)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    type(state_t), intent(in) :: old
    type(trial_t), intent(in) :: trial
    type(state_t), intent(inout) :: new
    type(increment_report_t), intent(inout) :: report
    type(placement_t) :: began
    real(wp) :: of_heat, surplus, of_others !! [energy]
    type(edge_middles_t) :: middles

    call find_edge_middles(scene, points, report%contact%weights, middles)
    call place_state(scene, points, solver%undeformed, old, began, everywhere=.true.)
    new%slip = carried_slip(points, began, trial%placement, old%slip) + &
      report%contact%slip_increment
    new%external_force = trial%forces%external
    new%support_force = trial%forces%internal - trial%forces%external &
      - nodal_forces(points, trial%placement%weights, new%reaction, size(new%displacement, 2))
    call leave_to_supports(scene, solver, new)
    call find_heat(scene, trial%free, old, new, of_heat, surplus)
    of_others = work_of_torques(scene, points, middles, began%weights, &
      report%contact%weights, old, new) + work_on_overlaps(scene, points, &
      solver%first_gap, began, trial%placement, old, new) + of_heat + work_of_turns( &
      scene, old%displacement, new%displacement, 0.5_wp*(old%external_force + &
      old%support_force + new%external_force + new%support_force))
    if (allocated(solver%own_mass)) then
      report%energy%external_work = of_others
      report%energy%strain = strain_energy(scene, trial%free, new, trial%forces%internal - &
        trial%in_motion%force)
      call balance_in_time(scene, points, solver%own_mass, report%contact, old, new, report%energy)
      ! What obstacles that turn and overlaps that are pressed out do is not known by body.
      if (.not. (any(scene%obstacles%turns) .or. has_interference(scene) .or. any( &
        solver%first_gap < -rounding_of_places(scene, new%displacement)))) call balance_bodies( &
        scene, points, solver%own_mass, report%contact, strain_energies(scene, trial%free, new, &
        report%certificate%strain), old, new, report%energy)
      report%in_time = error_in_time(solver, old, new)
      call watch_inertia(solver, trial%in_motion, trial%forces%internal, new)
      return
    end if
    call energy_balance(report%contact, old, new, strain_energy(scene, trial%free, new, &
      trial%forces%internal), report%energy, of_others, surplus)
    if (any(scene%steps%is_dynamic) .and. trial%goal%wanted == certified) call keep_strains( &
      strain_energies(scene, trial%free, new, report%certificate%strain), new)
    call come_to_rest(new)
  end subroutine finish

  !> Of all that is out of balance leave what supports hold. Where they hold a component of a
  !> coupling's rotation that is a moment in space, which may have all three.
  pure subroutine leave_to_supports(scene, solver, new)
    type(scene_t), intent(in) :: scene
    type(step_solver_t), intent(in) :: solver
    type(state_t), intent(inout) :: new !! its support forces
    logical :: is_held(3, scene%mesh%n_nodes)
    integer :: i

    is_held = solver%body%prescribed
    if (has_turning(scene)) then
      call give_to_masters(active_constraints(moments_on_constraints(scene, new%displacement), &
        is_held), new%support_force)
      do i = 1, size(scene%rotations)
        associate (node => scene%rotations(i)%rotation_node)
          is_held(:, node) = any(is_held(:, node))
        end associate
      end do
    else
      call give_to_masters(solver%body%constraints, new%support_force)
    end if
    where (.not. is_held) new%support_force = 0.0_wp
  end subroutine leave_to_supports

  !> A node that can have no reaction must not end inside its master (of the others the certificate
  !> judges): where its motion is prescribed that is an error; where it was taken to be out of
  !> reach, or beside its master where the points were placed last, the report says so. So it does
  !> where a point got to faces that were taken to be out of reach, and where flat facets cover
  !> others than in the undeformed mesh.
  subroutine watch_inactive(scene, points, solver, tolerance, new, report, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    real(wp), intent(in) :: tolerance !! of contact [-]
    type(state_t), intent(in) :: new
    type(increment_report_t), intent(inout) :: report
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: known !! how well gaps are [length]
    logical :: is_inside(points%n), is_stray(points%n)
    integer :: row(3, points%n), i

    if (points%n == 0) return
    known = 10.0_wp*tolerance*maxval(abs(new%displacement)) + rounding_of_places(scene, &
      new%displacement)
    is_inside = report%contact%gap + report%contact%kept_overlap < -known
    do i = 1, size(solver%contact%group)
      is_inside(solver%contact%group(i)%active) = .false.
      is_inside(solver%contact%group(i)%far) = .false.
    end do
    call find_strays(scene, points, solver, known, new%displacement, report, is_stray)
    if (.not. any(is_stray)) is_stray = is_inside .and. .not. points%in_reach
    if (any(is_stray)) then
      report%ending = ending_t(ended_out_of_reach, point=findloc(is_stray, .true., dim=1))
      return
    end if
    if (.not. any(is_inside)) return
    call rows_of_points(movable(scene, solver%body%prescribed), points, report%contact%weights, &
      report%contact%frame, row)
    if (any(is_inside .and. row(1, :) > 0)) then
      i = maxloc(-report%contact%gap, dim=1, mask=is_inside .and. row(1, :) > 0)
      report%ending = ending_t(ended_moving, -report%contact%gap(i)/maxval(abs( &
        new%displacement)), i)
      return
    end if
    i = findloc(is_inside, .true., dim=1)
    call raise(error, exit_not_solved, 'step '//to_text(new%step)//', increment '// &
      to_text(new%increment)// &
      ': node '//to_text(scene%mesh%node_id(points%node(i)))//' is prescribed to move '// &
      to_text(-report%contact%gap(i))//' into '// &
      master_name(scene, points%pair(i)))
  end subroutine watch_inactive

  !> Points whose master has nodes with weights that are not among its nodes in reach, and those
  !> that flat facets cover where they did not in the undeformed mesh, or no longer, or whose gap is
  !> not that of the plane of these: rows of what they cover in part change, (11.34).
  pure subroutine find_strays(scene, points, solver, known, u, report, is_stray)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    real(wp), intent(in) :: known       !! how well gaps are [length]
    real(wp), intent(in) :: u(:, :)     !! (3,n_nodes) [length]
    type(increment_report_t), intent(in) :: report
    logical, intent(out) :: is_stray(:) !! (n_points)
    logical :: in_reach(scene%mesh%n_nodes)
    integer :: pair, i

    is_stray = is_before_flat(points%turns, points%in_reach, points%is_curved)
    do i = 1, points%n
      if (.not. is_stray(i)) cycle
      is_stray(i) = report%contact%weights%covers(i) .neqv. solver%undeformed%weights%covers(i)
      if (is_stray(i) .or. .not. report%contact%weights%covers(i)) cycle
      is_stray(i) = abs(report%contact%gap(i) - gap_at(solver%undeformed, points, i, u)) > known
    end do
    if (.not. any(points%on_surface)) return
    associate (weights => report%contact%weights)
      do pair = 1, size(scene%pairs)
        if (scene%pairs(pair)%master > 0) cycle
        in_reach = .false.
        in_reach(master_nodes(points, pair)) = .true.
        ! A point stands for neighbours, too, that have no multiplier.
        associate (first => points%first(pair), last => points%first(pair + 1) - 1)
          in_reach(pack(points%node(first:last), points%in_reach(first:last))) = .true.
        end associate
        do i = points%first(pair), points%first(pair + 1) - 1
          is_stray(i) = points%in_reach(i) .and. .not. &
            all(in_reach(weights%node(weights%first(i):weights%first(i + 1) - 1)))
        end do
      end do
    end associate
  end subroutine find_strays

end module advance_mod
