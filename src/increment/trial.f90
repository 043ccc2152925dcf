!> What an increment is solved with: its loads, where it begins, and the reactions that answer.
module trial_mod
  use kinds_mod, only: wp
  use system_mod, only: wall_seconds
  use constraints_mod, only: follow_masters
  use scene_mod, only: scene_t
  use controls_mod, only: contact_controls_t, is_exact, solver_none, solver_sweeps
  use contact_points_mod, only: contact_points_t
  use increments_mod, only: increment_t
  use state_mod, only: state_t
  use increment_report_mod, only: increment_report_t, ended_unbalanced
  use increment_forces_mod, only: increment_forces_t
  use problem_mod, only: contact_problem_t, contact_report_t, pack_rows, unpack_gaps, &
    relative_gaps, add_driven_friction
  use rigid_modes_mod, only: generalised_loads, add_motions
  use solve_mod, only: solve_contact
  use whole_newton_mod, only: bodies_t, solve_with_body
  use floating_mod, only: resisting_rows
  use floating_search_mod, only: drift_t, solve_floating
  use describe_motions_mod, only: free_in_words, motion_in_words, unresisted_part
  use placement_mod, only: placement_t, place_curved
  use pull_off_mod, only: pulls_off
  use transfer_mod, only: relative_motion, nodal_forces, gap_at
  use condensed_contact_mod, only: contact_group_t, count_points, form_compliance
  use compliance_mod, only: is_map
  use dof_map_mod, only: to_nodes, unknowns_of
  use stiffness_inverse_mod, only: answer_of_interface, at_interface
  use load_response_mod, only: sum_patterns, prescribed_displacement
  use turns_mod, only: rotation_at
  use step_solver_mod, only: step_solver_t
  implicit none
  private

  public :: trial_t, begin_trial, displacement_of, solve_reactions, expected_reactions, trend_of

  real(wp), parameter :: continuous = 1.0e-12_wp !! loads that differ by no more go on as they were

  !> All that an increment's solution is made from; nothing of it outlives the trial.
  type :: trial_t
    type(contact_controls_t) :: controls !! the deck's, with the residual that is asked for now
    logical :: is_foreseen = .false. !! its first reactions and what they cause are there
    type(increment_forces_t) :: forces
    real(wp), allocatable :: u_free(:, :)
    !! (3,n_nodes) displacement without contact and free motions [length]
    real(wp), allocatable :: u_contact(:, :)
    !! (3,n_nodes) displacement by the reactions, K^-1 B^T r [length]
    real(wp), allocatable :: applied_reaction(:, :)
    !! (3,n_points) the reactions that u_contact answers, x, y, z [force]
    real(wp), allocatable :: applied_force(:, :)
    !! (3,n_nodes) of these, by the weights of their time [force]
    real(wp), allocatable :: guess(:, :)
    !! (3,n_nodes) of u_contact, where it is found together with the reactions [length]
    real(wp), allocatable :: left(:)
    !! (n_free) forces that it takes up beside theirs, there [force]
    real(wp), allocatable :: unsolved(:) !! (n_free) of all of these, what it does not [force]
    real(wp), allocatable :: motion(:)         !! (n) how far the free motions have gone [length]
    real(wp), allocatable :: neutral_residual(:)
    !! (k) what turned normals leave on neutral motions [force]
    real(wp), allocatable :: placed_at(:, :)
    !! (3,n_nodes) displacement where curved obstacles are linearised [length]
    real(wp), allocatable :: rotation(:, :)
    !! (3,n_obstacles) rotation vectors at the end of the increment [rad]
    type(placement_t) :: placement
  end type trial_t

contains

  !> The loads of an increment, and the displacement under them without contact.
  subroutine begin_trial(scene, points, solver, old, increment, trial)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    type(state_t), intent(in) :: old
    type(increment_t), intent(in) :: increment
    type(trial_t), intent(out) :: trial
    integer :: i

    call sum_patterns(scene, solver%response, increment%fraction, increment%step_time, &
      trial%u_free, trial%forces%external)
    trial%forces%prescribed = solver%body%prescribed
    trial%forces%constraints = scene%constraints
    trial%forces%displacement = prescribed_displacement(scene, solver%response%loads, increment)
    trial%rotation = rotation_at(scene, solver%response%loads%turns, increment%fraction, &
      increment%step_time)
    allocate (trial%forces%internal, mold=old%displacement)
    trial%controls = scene%contact
    associate (motions => solver%body%motions)
      trial%motion = [(old%displacement(motions%dof(i), motions%node(i)), i=1, motions%n)]
    end associate
    call carry_over(scene, points, solver, old, increment, trial)
    ! Obstacles are where they will be, nodes where they were.
    trial%placed_at = old%displacement
    where (trial%forces%prescribed) trial%placed_at = trial%u_free
    trial%placement = solver%undeformed
  end subroutine begin_trial

  !> Begin with the reactions of the increment before, where the factor is not exact: what it makes
  !> of them was refined there, and only what changes has to be refined again.
  !>
  !> Not where loads or supports jump as a *STEP begins (an amplitude that is not 0 at its start):
  !> the displacement there is no answer to the patterns of this *STEP.
  subroutine carry_over(scene, points, solver, old, increment, trial)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    type(state_t), intent(in) :: old
    type(increment_t), intent(in) :: increment
    type(trial_t), intent(inout) :: trial      !! its displacements and applied reactions
    type(placement_t) :: began
    real(wp), allocatable :: loaded(:, :), external(:, :)

    allocate (trial%u_contact(3, scene%mesh%n_nodes), trial%applied_reaction(3, points%n), &
      trial%applied_force(3, scene%mesh%n_nodes), source=0.0_wp)
    if (allocated(solver%body%inverse%iterative)) then
      allocate (trial%left(solver%body%inverse%map%n_free), source=0.0_wp)
      trial%unsolved = trial%left
      call sum_patterns(scene, solver%response, increment%begin, &
        increment%begin*scene%steps(increment%step)%period, loaded, external)
      trial%guess = old%displacement - loaded
      return
    end if
    if (is_exact(scene%precision) .or. .not. solver%body%inverse%is_condensed) return
    call sum_patterns(scene, solver%response, increment%begin, &
      increment%begin*scene%steps(increment%step)%period, loaded, external)
    associate (prescribed => solver%body%prescribed)
      if (jump(external, old%external_force) .or. jump(merge(loaded, 0.0_wp, prescribed), &
        merge(old%displacement, 0.0_wp, prescribed))) return
    end associate
    call add_motions(solver%body%motions, scene%mesh, trial%motion, loaded)
    began = solver%undeformed
    call place_curved(scene, points, old%displacement, began, old%rotation)
    trial%applied_reaction = old%reaction
    trial%applied_force = nodal_forces(points, began%weights, old%reaction, scene%mesh%n_nodes)
    ! On the interface u_free must be what the contact problem adds W r to.
    trial%u_contact = at_interface(solver%body%inverse, answer_of_interface(solver%body%inverse, &
      trial%applied_force), scene%mesh%n_nodes)
    trial%u_free = trial%u_free + (old%displacement - loaded) - trial%u_contact
  end subroutine carry_over

  !> Whether two fields differ by more than rounding.
  pure logical function jump(one, other)
    real(wp), intent(in) :: one(:, :), other(:, :) !! (3,n_nodes)

    jump = maxval(abs(one - other)) > continuous*max(maxval(abs(one)), maxval(abs(other)))
  end function jump

  !> The displacement under the loads, the reactions and the free motions; what supports prescribe
  !> is as they prescribe it, to the last bit.
  pure function displacement_of(scene, solver, trial, u_contact) result(u)
    type(scene_t), intent(in) :: scene
    type(step_solver_t), intent(in) :: solver
    type(trial_t), intent(in) :: trial
    real(wp), intent(in) :: u_contact(:, :)  !! (3,n_nodes) by the reactions [length]
    real(wp) :: u(3, size(u_contact, 2))     !! [length]

    u = trial%u_free + u_contact
    call add_motions(solver%body%motions, scene%mesh, trial%motion, u)
    where (trial%forces%prescribed) u = trial%forces%displacement
    call follow_masters(solver%body%constraints, u)
  end function displacement_of

  !> The reactions to start from: the last ones, carried on as they went in the increment before;
  !> none where that pulls, by the normals where the increment begins. Sweeps start from the last
  !> ones, as in the paper.
  pure function expected_reactions(scene, points, solver, old, increment) result(reaction)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    type(state_t), intent(in) :: old
    type(increment_t), intent(in) :: increment
    real(wp) :: reaction(3, points%n) !! x, y, z [force]
    type(placement_t) :: began
    integer :: i

    reaction = old%reaction
    if (scene%contact%solver == solver_sweeps .or. solver%body%motions%n > 0) return
    if (increment%begin <= 0.0_wp) return ! another *STEP leads elsewhere
    began = solver%undeformed
    call place_curved(scene, points, old%displacement, began, old%rotation)
    do i = 1, points%n
      reaction(:, i) = reaction(:, i) + (increment%fraction - increment%begin)*old%trend(:, i)
      if (dot_product(reaction(:, i), began%frame(:, 1, i)) <= 0.0_wp) reaction(:, i) = 0.0_wp
    end do
  end function expected_reactions

  !> How the reactions went in an increment, as they would in its whole *STEP.
  pure function trend_of(increment, before, after) result(trend)
    type(increment_t), intent(in) :: increment
    real(wp), intent(in) :: before(:, :), after(:, :)        !! (3,n_points) reactions [force]
    real(wp) :: trend(size(before, 1), size(before, 2))      !! [force]

    trend = (after - before)/(increment%fraction - increment%begin)
  end function trend_of

  !> The contact problem of the increment: gaps and slips that u_free would give, then the
  !> reactions, and the free motions, one group after the other.
  subroutine solve_reactions(scene, points, solver, old, trial, reaction, report)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(inout) :: solver !! its contact, of the trial's placement
    type(state_t), intent(in) :: old
    type(trial_t), intent(inout) :: trial        !! gets how far the motions go
    real(wp), intent(inout) :: reaction(:, :)    !! (3,n_points) x, y, z; warm start in [force]
    type(increment_report_t), intent(inout) :: report
    real(wp), allocatable :: start(:, :), load(:), rounding(:)
    real(wp) :: unbalanced(solver%body%motions%n) !! direction that nothing balances
    real(wp) :: resisting(3*count_points(solver%contact), solver%body%motions%n)
    type(contact_report_t) :: contact
    real(wp) :: clock
    integer :: i, n_resisting

    clock = wall_seconds()
    start = reaction
    reaction = 0.0_wp
    unbalanced = 0.0_wp
    n_resisting = 0
    resisting = 0.0_wp
    report%x_free = [real(wp) ::]
    trial%neutral_residual = [real(wp) ::]
    associate (motions => solver%body%motions)
      if (motions%n > 0) call generalised_loads(motions, scene%mesh, trial%forces%external, load, &
        rounding)
      contact%converged = .true.
      do i = 1, size(solver%contact%group)
        call solve_group(solver%contact%group(i))
      end do
      if (contact%ending == ended_unbalanced) then
        unbalanced = unresisted_part(resisting(:n_resisting, :), unbalanced)
        report%unbalanced = motion_in_words(scene%mesh, motions, unbalanced)
        report%pulls_off = pulls_off(scene%mesh, points, trial%placement, motions, unbalanced, &
          trial%forces%external)
      end if
      if (contact%converged .and. motions%n > 0) call free_in_words(scene%mesh, motions, &
        resisting(:n_resisting, :), report%n_unheld, report%unheld)
    end associate
    report%converged = contact%converged
    report%solver = contact%solver
    report%contact_iterations = report%contact_iterations + contact%iterations
    report%local_iterations = report%local_iterations + contact%local_iterations
    report%compliance_products = report%compliance_products + contact%products
    report%solver_stages = max(report%solver_stages, contact%stages, 1)
    report%ending = contact%ending
    report%residual = contact%residual
    report%worst_point = contact%worst_point
    report%contact_time = report%contact_time + wall_seconds() - clock

  contains

    !> One group: its reactions, the motions it sees, and what they say of the whole.
    subroutine solve_group(group)
      type(contact_group_t), intent(inout) :: group
      real(wp), dimension(3, size(group%active)) :: x, r
      real(wp), allocatable :: x_free(:), rows(:, :)
      type(contact_report_t) :: of_group
      type(drift_t) :: drift

      call gaps_without_contact(points, trial, old, group, start, x, r)
      x_free = pack_rows(group%problem, x)
      group%problem%driven = driven_slips(scene, group%problem, x, max(maxval(norm2(trial%u_free - &
        old%displacement, dim=1)), maxval(norm2(trial%placement%drag, dim=1))), &
        trial%controls%tolerance)
      if (size(group%motion) > 0) then
        drift%load = load(group%motion)
        drift%rounding = rounding(group%motion)
        drift%a = trial%motion(group%motion)
      end if
      if (allocated(group%body)) then
        call solve_on_bodies(solver, old, group, x_free, trial, r, of_group)
      else
        call solve_with_or_without(scene, group, trial%controls, x_free, drift, r, of_group)
      end if
      if (size(group%motion) > 0) then
        trial%motion(group%motion) = drift%a
        trial%neutral_residual = [trial%neutral_residual, drift%turned]
        rows = resisting_rows(group%problem, group%floating, r, x_free, of_group%converged)
        resisting(n_resisting + 1:n_resisting + size(rows, 1), group%motion) = rows
        n_resisting = n_resisting + size(rows, 1)
        if (of_group%ending == ended_unbalanced) unbalanced(group%motion) = drift%unbalanced
      end if
      if (any(abs(group%problem%driven) > 0.0_wp)) then
        x = unpack_gaps(group%problem, relative_gaps(group%problem, x_free, &
          pack_rows(group%problem, r)))
        call add_driven_friction(group%problem, x, r)
      end if
      report%x_free = [report%x_free, x_free]
      call add_reactions(trial%placement, group, r, reaction)
      if (allocated(group%body)) then
        trial%applied_reaction = reaction
        trial%applied_force = nodal_forces(points, trial%placement%weights, reaction, &
          scene%mesh%n_nodes)
      end if
      call add_report(group, of_group, contact)
    end subroutine solve_group

  end subroutine solve_reactions

  !> The reactions of a group together with the displacement that they and what was left out of
  !> balance cause.
  subroutine solve_on_bodies(solver, old, group, x_free, trial, r, report)
    type(step_solver_t), intent(in) :: solver
    type(state_t), intent(in) :: old
    type(contact_group_t), intent(in) :: group
    real(wp), intent(in) :: x_free(:)            !! (n_rows) [length]
    type(trial_t), intent(inout) :: trial        !! gets u_contact
    real(wp), intent(inout) :: r(:, :)           !! (3,n_active) n, t1, t2 [force]
    type(contact_report_t), intent(out) :: report
    type(bodies_t) :: bodies

    associate (map => solver%body%inverse%map)
      bodies%v = unknowns_of(map, trial%guess)
      bodies%load = trial%left
      bodies%largest = max(maxval(norm2(trial%forces%external, dim=1)), &
        maxval(norm2(old%support_force, dim=1)))
      call solve_with_body(group%problem, group%body, x_free, trial%controls, bodies, r, report)
      trial%unsolved = bodies%remains
      call to_nodes(map, bodies%v, trial%u_contact)
      trial%guess = trial%u_contact
    end associate
  end subroutine solve_on_bodies

  !> The reactions and motions of a group. Where its W is known by its products, and these do not
  !> lead to the deck's tolerance, W is formed for the other solvers if there is memory for it.
  subroutine solve_with_or_without(scene, group, controls, x_free, drift, r, report)
    type(scene_t), intent(in) :: scene
    type(contact_group_t), intent(in) :: group
    type(contact_controls_t), intent(in) :: controls
    real(wp), intent(inout) :: x_free(:)         !! (n_rows) as of solve_floating [length]
    type(drift_t), intent(inout) :: drift
    real(wp), intent(inout) :: r(:, :)           !! (3,n_active) n, t1, t2 [force]
    type(contact_report_t), intent(out) :: report
    type(contact_problem_t) :: dense
    type(drift_t) :: began
    real(wp), allocatable :: x_before(:), r_before(:, :)
    logical :: formed

    began = drift
    allocate (x_before, source=x_free)
    allocate (r_before, source=r)
    call solve(group%problem)
    if (report%converged .or. .not. is_map(group%problem%compliance)) return
    if (report%ending /= ended_unbalanced .and. report%residual <= scene%contact%tolerance) return
    call form_compliance(group%problem, dense, formed)
    if (.not. formed) return
    drift = began
    x_free = x_before
    r = r_before
    call solve(dense)
    report%stages = report%stages + 1

  contains

    subroutine solve(problem)
      type(contact_problem_t), intent(in) :: problem

      if (size(group%motion) == 0) then
        call solve_contact(problem, x_free, controls, r, report)
      else
        call solve_floating(problem, group%floating, x_free, controls, drift, r, report)
      end if
    end subroutine solve

  end subroutine solve_with_or_without

  !> Gaps and slips of a group that u_free alone would give, and the reactions to start from.
  pure subroutine gaps_without_contact(points, trial, old, group, start, x, r)
    type(contact_points_t), intent(in) :: points
    type(trial_t), intent(in) :: trial
    type(state_t), intent(in) :: old
    type(contact_group_t), intent(in) :: group
    real(wp), intent(in) :: start(:, :)          !! (3,n_points) x, y, z [force]
    real(wp), intent(out) :: x(:, :), r(:, :)    !! (3,n_active) n, t1, t2 [length], [force]
    integer :: i, k

    do k = 1, size(group%active)
      i = group%active(k)
      associate (frame => trial%placement%frame(:, :, i), weights => trial%placement%weights)
        x(:, k) = matmul(relative_motion(points, weights, i, trial%u_free) - &
          relative_motion(points, weights, i, old%displacement) + trial%placement%drag(:, i), frame)
        x(1, k) = gap_at(trial%placement, points, i, trial%u_free)
        r(:, k) = matmul(start(:, i), frame)
      end associate
    end do
  end subroutine gaps_without_contact

  !> The reactions of a group among those of all points.
  pure subroutine add_reactions(placement, group, r, reaction)
    type(placement_t), intent(in) :: placement
    type(contact_group_t), intent(in) :: group
    real(wp), intent(in) :: r(:, :)              !! (3,n_active) n, t1, t2 [force]
    real(wp), intent(inout) :: reaction(:, :)    !! (3,n_points) x, y, z [force]
    integer :: k

    do k = 1, size(group%active)
      associate (i => group%active(k))
        reaction(:, i) = matmul(placement%frame(:, :, i), r(:, k))
      end associate
    end do
  end subroutine add_reactions

  !> What the solver says of a group, into what it says of all. Groups are iterated side by side, so
  !> that iterations, and products with all of W, are those of the group with the most; the residual
  !> is the worst.
  pure subroutine add_report(group, of_group, contact)
    type(contact_group_t), intent(in) :: group
    type(contact_report_t), intent(in) :: of_group
    type(contact_report_t), intent(inout) :: contact

    if (of_group%solver /= solver_none) contact%solver = of_group%solver
    contact%iterations = max(contact%iterations, of_group%iterations)
    contact%products = max(contact%products, of_group%products)
    contact%stages = max(contact%stages, of_group%stages)
    contact%local_iterations = contact%local_iterations + of_group%local_iterations
    if (.not. of_group%converged .and. contact%ending /= ended_unbalanced) contact%ending = &
      of_group%ending
    contact%converged = contact%converged .and. of_group%converged
    if (of_group%residual >= contact%residual) then
      contact%residual = of_group%residual
      contact%worst_point = 0
      if (of_group%worst_point > 0) contact%worst_point = group%active(of_group%worst_point)
    end if
  end subroutine add_report

  !> The slips by which supports drive points along tangents that cannot move; none where places are
  !> rounded by as much, or where it is nothing beside what moves. docs/theory.md section 3.
  pure function driven_slips(scene, problem, x, way, tolerance) result(driven)
    type(scene_t), intent(in) :: scene
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: x(:, :)     !! (3,n_active) gaps and slips without reactions [length]
    real(wp), intent(in) :: way         !! the longest without reactions [length]
    real(wp), intent(in) :: tolerance   !! contact tolerance [-]
    real(wp) :: driven(2, problem%n_points) !! [length]
    real(wp) :: least

    driven = 0.0_wp
    if (problem%n_points == 0) return
    where (problem%row(2:, :) == 0 .and. spread(problem%mu > 0.0_wp, 1, 2)) driven = x(2:, :)
    least = max(8.0_wp*epsilon(1.0_wp)*maxval(abs(scene%mesh%coordinates)), &
      tolerance*way)
    where (spread(norm2(driven, dim=1) <= least, 1, 2)) driven = 0.0_wp
  end function driven_slips

end module trial_mod
