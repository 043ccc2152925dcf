!> The reactions that answer the loads of an increment, and the free motions with them.
module solve_reactions_mod
  use kinds_mod, only: wp
  use system_mod, only: wall_seconds
  use scene_mod, only: scene_t
  use controls_mod, only: contact_controls_t, solver_none
  use contact_points_mod, only: contact_points_t, laws_of_points
  use state_mod, only: state_t
  use increment_report_mod, only: increment_report_t, ending_t, not_ended, ended_well, &
    ended_unbalanced, ended_stalled, ended_at_limit, ended_diverging
  use problem_mod, only: contact_problem_t, contact_report_t, pack_rows, unpack_rows, unpack_gaps, &
    relative_gaps, add_driven_friction, force_scale, measure
  use solve_mod, only: solve_contact
  use crowded_nodes_mod, only: has_crowded_nodes, solve_on_crowded_nodes
  use floating_mod, only: pressing_rows, resisting_rows
  use newton_correction_mod, only: largest_dense
  use floating_centre_mod, only: drift_t
  use floating_search_mod, only: solve_floating
  use describe_motions_mod, only: free_in_words, motion_in_words, unresisted_part
  use placement_mod, only: placement_t
  use pull_off_mod, only: pulls_off
  use follow_points_mod, only: rounding_of_places
  use transfer_mod, only: relative_motion, nodal_forces, gap_at
  use condensed_contact_mod, only: contact_group_t, count_points, count_rows
  use formed_compliance_mod, only: form_compliance, form_floating
  use compliance_mod, only: is_map
  use shared_nodes_mod, only: has_shared_nodes, share_nodes
  use dependent_rows_mod, only: points_of_rows
  use step_solver_mod, only: step_solver_t
  use closed_points_mod, only: stay_closed
  use trial_mod, only: trial_t, loads_on_motions
  use solve_on_bodies_mod, only: group_answer_t, solve_on_bodies
  implicit none
  private

  public :: solve_reactions, solve_for_least

  real(wp), parameter :: all_of_it = 1.0e-14_wp !! of loads or gaps is rounding, no more [-]
  real(wp), parameter :: no_part = 1.0e-3_wp !! of the tolerance: softness that counts for none [-]

contains

  !> The contact problem of the increment: gaps and slips that u_free would give, then the
  !> reactions, and the free motions, one group after the other.
  subroutine solve_reactions(scene, points, solver, old, tolerance, trial, reaction, report)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(inout) :: solver !! its contact, of the trial's placement
    type(state_t), intent(in) :: old
    real(wp), intent(in) :: tolerance            !! residual that is asked for [-]
    type(trial_t), intent(inout) :: trial        !! gets how far the motions go
    real(wp), intent(inout) :: reaction(:, :)    !! (3,n_points) x, y, z; warm start in [force]
    type(increment_report_t), intent(inout) :: report
    real(wp), allocatable :: start(:, :), load(:), rounding(:)
    logical :: stays(points%n)
    real(wp) :: unbalanced(solver%body%motions%n) !! direction that nothing balances
    real(wp) :: resisting(3*count_points(solver%contact), solver%body%motions%n)
    real(wp) :: pressing(count_points(solver%contact), solver%body%motions%n)
    type(contact_controls_t) :: controls
    type(contact_report_t) :: contact
    real(wp) :: clock
    integer :: i, n_resisting, n_pressing

    clock = wall_seconds()
    controls = scene%contact
    controls%tolerance = tolerance
    controls%shows_progress = trial%goal%shows_progress
    controls%factorises = trial%factorises
    start = reaction
    reaction = 0.0_wp
    stays = stay_closed(scene, points, solver%undeformed, old)
    unbalanced = 0.0_wp
    n_resisting = 0
    n_pressing = 0
    resisting = 0.0_wp
    pressing = 0.0_wp
    report%x_free = [real(wp) ::]
    trial%neutral_residual = [real(wp) ::]
    associate (motions => solver%body%motions)
      if (motions%n > 0) call loads_on_motions(scene, motions, trial, load, rounding)
      contact%ending = ended_well
      do i = 1, size(solver%contact%group)
        call solve_group(solver%contact%group(i))
      end do
      if (contact%ending == ended_unbalanced) then
        ! Where all is resisted, what the forces of a cone leave over stands across its edge: along
        ! the surfaces that press it is the sliding.
        unbalanced = unresisted_part(pressing(:n_pressing, :), &
          unresisted_part(resisting(:n_resisting, :), unbalanced))
        report%ending = ending_t(ended_unbalanced, motions=motion_in_words(scene%mesh, motions, &
          unbalanced), pulls_off=pulls_off(scene%mesh, points, trial%placement, motions, &
          unbalanced, trial%forces%external))
      else
        report%ending = ending_t(contact%ending)
      end if
      if (contact%converged() .and. motions%n > 0) call free_in_words(scene%mesh, motions, &
        resisting(:n_resisting, :), report%n_unheld, report%unheld)
    end associate
    report%solver = contact%solver
    report%contact_iterations = report%contact_iterations + contact%iterations
    report%local_iterations = report%local_iterations + contact%local_iterations
    report%compliance_products = report%compliance_products + contact%products
    report%solver_stages = max(report%solver_stages, contact%stages, 1)
    report%residual = contact%residual
    report%worst_point = contact%worst_point
    report%contact_time = report%contact_time + wall_seconds() - clock

  contains

    !> One group: its reactions, the motions it sees, and what they say of the whole.
    subroutine solve_group(group)
      type(contact_group_t), intent(inout) :: group
      real(wp), dimension(3, size(group%active)) :: x, r
      real(wp), allocatable :: x_free(:), gaps(:), rows(:, :), along_neutral(:)
      type(contact_report_t) :: of_group
      type(group_answer_t) :: answer
      type(drift_t) :: drift

      call gaps_without_contact(points, trial, old, group, start, x, r)
      if (allocated(solver%body%inertia)) call touch_without_force(scene, &
        trial, old, group%active, x(1, :))
      x_free = pack_rows(group%problem, x)
      group%problem%stays = stays(group%active)
      group%problem%began = norm2(old%reaction(:, group%active))
      call laws_of_points(points, group%active, trial%placement%covered_area, group%problem%law)
      group%problem%driven = driven_slips(scene, group%problem, x, max(maxval(norm2(trial%u_free - &
        old%displacement, dim=1)), maxval(norm2(trial%placement%drag, dim=1))), &
        tolerance)
      if (size(group%motion) > 0) then
        drift%load = load(group%motion)
        drift%rounding = rounding(group%motion)
        drift%a = trial%motion(group%motion)
        along_neutral = matmul(drift%load, group%floating%neutral)
        ! Loads may act along what contact does not see while a body that turns finds its place, but
        ! not where it begins.
        if (.not. solver%body%motions%are_finite .or. (.not. trial%has_begun .and. any( &
          abs(along_neutral) > tolerance/all_of_it*maxval(drift%rounding)))) then
          along_neutral = 0.0_wp
        end if
        drift%load = drift%load - matmul(group%floating%neutral, along_neutral)
      end if
      ! Another placement has another compliance.
      if (allocated(group%body) .and. trial%by_compliance) call form_floating(group, &
        trial%by_compliance)
      if (allocated(group%body) .and. .not. trial%by_compliance) then
        answer%x_free = x_free
        answer%r = r
        call solve_on_bodies(scene%mesh, solver, old, group, controls, trial, drift, answer)
        r = answer%r
        of_group = answer%report
        call move_alloc(answer%gaps, gaps)
      end if
      if (.not. allocated(group%body) .or. trial%by_compliance) then
        call solve_for_least(trial%goal%tolerance, group, controls, x_free, drift, r, gaps, &
          of_group)
      end if
      if (size(group%motion) > 0) then
        trial%motion(group%motion) = drift%a
        trial%neutral_residual = [trial%neutral_residual, drift%turned + along_neutral]
        rows = resisting_rows(group%problem, group%floating, r, gaps, of_group%converged())
        resisting(n_resisting + 1:n_resisting + size(rows, 1), group%motion) = rows
        n_resisting = n_resisting + size(rows, 1)
        rows = pressing_rows(group%problem, group%floating, r)
        pressing(n_pressing + 1:n_pressing + size(rows, 1), group%motion) = rows
        n_pressing = n_pressing + size(rows, 1)
        if (of_group%ending == ended_unbalanced) unbalanced(group%motion) = drift%unbalanced
      end if
      ! What GMRES does not do for this placement it will not do for the next.
      if (of_group%wants_exact .and. count_rows(solver%contact) <= largest_dense) then
        trial%factorises = .true.
        controls%factorises = .true.
      end if
      if (of_group%converged()) call share(group, x_free, gaps, r)
      if (any(abs(group%problem%driven) > 0.0_wp)) then
        x = unpack_gaps(group%problem, gaps)
        call add_driven_friction(group%problem, x, r)
      end if
      report%x_free = [report%x_free, x_free]
      call add_reactions(trial%placement, group, r, reaction)
      if (allocated(group%body) .and. .not. trial%by_compliance) then
        trial%applied_reaction = reaction
        trial%applied_force = nodal_forces(points, trial%placement%weights, reaction, &
          scene%mesh%n_nodes)
      end if
      call add_report(group, of_group, contact)
    end subroutine solve_group

    !> What each point takes where a node has several.
    subroutine share(group, x_free, gaps, r)
      type(contact_group_t), intent(in) :: group
      real(wp), intent(in) :: x_free(:)
      real(wp), allocatable, intent(in) :: gaps(:) !! where they are known
      real(wp), intent(inout) :: r(:, :)
      real(wp), dimension(3, size(group%active)) :: before, shared
      integer :: node(size(group%active)), i, k
      real(wp), allocatable :: x(:) !! [length]
      type(contact_report_t) :: of_shared
      real(wp), parameter :: no_worse = 2.0_wp !! than the tolerance

      do k = 1, size(group%active)
        i = group%active(k)
        associate (weights => trial%placement%weights)
          associate (master => weights%node(weights%first(i):weights%first(i + 1) - 1))
            node(k) = merge(points%node(i), 0, all(solver%body%prescribed(:, master)))
          end associate
        end associate
        before(:, k) = matmul(old%reaction(:, i), trial%placement%frame(:, :, i))
      end do
      if (.not. has_shared_nodes(group%problem, node, r)) return
      if (allocated(gaps)) then
        x = gaps
      else
        x = relative_gaps(group%problem, x_free, pack_rows(group%problem, r))
      end if
      shared = r
      associate (problem => group%problem)
        call share_nodes(problem, node, trial%placement%frame(:, :, group%active), &
          unpack_gaps(problem, x), before, tolerance*force_scale(problem, unpack_rows(problem, &
          x_free), r, r), shared)
        ! What wedges itself in may have pressed with any force, beside which it was a solution.
        call measure(problem, x_free, x, pack_rows(problem, shared), before, of_shared)
        if (of_shared%residual <= no_worse*tolerance) r = shared
      end associate
    end subroutine share

  end subroutine solve_reactions

  !> The reactions and motions of a group, of those that no body feels the least.
  !>
  !> W is a little soft along these, N N^T r, about no reaction at first. That decides which of the
  !> points that touch do not press: they are kept so from then on. Solutions about the reactions
  !> found follow until softness has no part in any gap. docs/theory.md (11.20).
  subroutine solve_for_least(tolerance, group, controls, x_free, drift, r, gaps, report)
    real(wp), intent(in) :: tolerance            !! as of solve_with_or_without [-]
    type(contact_group_t), intent(in) :: group
    type(contact_controls_t), intent(in) :: controls
    real(wp), intent(inout) :: x_free(:)         !! (n_rows) as of solve_floating [length]
    type(drift_t), intent(inout) :: drift
    real(wp), intent(inout) :: r(:, :)           !! (3,n_active) n, t1, t2 [force]
    real(wp), allocatable, intent(inout) :: gaps(:)
    !! (n_rows) where W alone does not give them: gaps and slips [length]
    type(contact_report_t), intent(out) :: report
    integer, parameter :: max_rounds = 20
    real(wp), parameter :: beyond = 10.0_wp    !! gaps there are: what keeps a point open [-]
    real(wp), parameter :: nothing = 10.0_wp   !! times the tolerance, beside what gives way [-]
    real(wp), dimension(size(group%null, 2)) :: centre, found
    real(wp), dimension(size(x_free)) :: x_start, away
    type(contact_report_t) :: of_round
    real(wp) :: last, slack
    integer :: i

    if (size(group%null, 2) == 0) then
      call solve_with_or_without(tolerance, group, controls, x_free, drift, r, report)
      if (size(group%motion) > 0 .or. any(abs(group%problem%driven) > 0.0_wp)) gaps = &
        relative_gaps(group%problem, x_free, pack_rows(group%problem, r))
      return
    end if
    x_start = x_free
    away = 0.0_wp
    centre = 0.0_wp
    slack = 0.0_wp
    last = huge(last)
    rounds: do i = 1, max_rounds
      x_free = x_start + away - group%softness*matmul(group%null, centre)
      call solve_with_or_without(tolerance, group, controls, x_free, drift, r, of_round)
      call add_round(of_round, report)
      found = matmul(pack_rows(group%problem, r), group%null)
      gaps = relative_gaps(group%problem, x_free, pack_rows(group%problem, r)) - away - &
        group%softness*matmul(group%null, found - centre)
      if (.not. report%converged()) exit rounds
      slack = nothing*controls%tolerance*group%flexibility*norm2(r)
      if (group%softness*norm2(found - centre) <= max(no_part*controls%tolerance, all_of_it)* &
        norm2(r)*group%flexibility) exit rounds
      if (i == 1) call keep_open(group, gaps, r, group%softness*norm2(found), beyond* &
        (maxval(abs(gaps)) + group%flexibility*norm2(r)), away)
      if (norm2(found - centre) >= last .or. i == max_rounds) then
        ! Gaps that an increment begins with may contradict each other by less than it is solved to:
        ! then these reactions grow by the same little in each round.
        if (.not. group%softness*norm2(found - centre) <= controls%tolerance* &
          group%flexibility*norm2(found)) report%ending = merge(ended_at_limit, ended_diverging, &
          norm2(found - centre) < last)
        exit rounds
      end if
      last = norm2(found - centre)
      centre = found
    end do rounds
    x_free = x_free - away
    if (report%converged() .and. any(away > 0.0_wp .and. gaps < -slack)) report%ending = &
      ended_at_limit
    ! What others come to, or what leaves whole bodies out of balance, is no least reaction: the
    ! certificate would not see that.
    if (any(report%ending == [ended_stalled, not_ended])) report%ending = ended_at_limit
  end subroutine solve_for_least

  !> Keep the points open that could take over what others carry, touch, and do not press.
  pure subroutine keep_open(group, gaps, r, touching, far, away)
    type(contact_group_t), intent(in) :: group
    real(wp), intent(in) :: gaps(:)        !! (n_rows) [length]
    real(wp), intent(in) :: r(:, :)        !! (3,n_active) [force]
    real(wp), intent(in) :: touching, far !! gaps: they touch up to one, the other opens [length]
    real(wp), intent(inout) :: away(:)     !! (n_rows) what is added to their gaps [length]
    logical :: has_part(size(r, 2))
    integer :: k

    has_part = points_of_rows(group%problem%row, group%null)
    do k = 1, size(r, 2)
      associate (row => group%problem%row(1, k))
        if (has_part(k) .and. r(1, k) <= 0.0_wp .and. gaps(row) <= touching .and. .not. &
          group%problem%stays(k)) away(row) = far
      end associate
    end do
  end subroutine keep_open

  !> What one more solution took, and how it came out.
  pure subroutine add_round(of_round, report)
    type(contact_report_t), intent(in) :: of_round
    type(contact_report_t), intent(inout) :: report
    type(contact_report_t) :: before

    before = report
    report = of_round
    report%iterations = report%iterations + before%iterations
    report%local_iterations = report%local_iterations + before%local_iterations
    report%products = report%products + before%products
    report%stages = max(report%stages, before%stages)
  end subroutine add_round

  !> The reactions and motions of a group. Where its W is known by its products, and these do not
  !> lead to the run's tolerance, W is formed for the other solvers if there is memory for it.
  subroutine solve_with_or_without(tolerance, group, controls, x_free, drift, r, report)
    real(wp), intent(in) :: tolerance            !! of the run; the controls' may be smaller [-]
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
    if (report%converged() .or. .not. is_map(group%problem%compliance)) return
    if (report%ending /= ended_unbalanced .and. report%residual <= tolerance) return
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
      type(contact_report_t) :: of_few !! points, on nodes that have many

      if (size(group%motion) == 0) then
        if (has_crowded_nodes(problem, group%node)) then
          call solve_on_crowded_nodes(problem, group%node, x_free, controls, r, &
            of_few)
          if (of_few%converged()) report = of_few
          if (of_few%converged()) return
        end if
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

  !> A body in flight may end an increment just at an obstacle: gaps of points without a reaction so
  !> far that are the rounding of as many solutions as there were are closed, and no force, which
  !> would be of rounding alone, answers them.
  pure subroutine touch_without_force(scene, trial, old, points, gap)
    type(scene_t), intent(in) :: scene
    type(trial_t), intent(in) :: trial
    type(state_t), intent(in) :: old
    integer, intent(in) :: points(:)  !! (n)
    real(wp), intent(inout) :: gap(:) !! (n) without contact [length]
    real(wp), parameter :: of_solution = 8.0_wp
    !! its rounding over that of a place: 1.6 of 976 nodes in flight, and more of more [-]

    where (abs(gap) <= of_solution*max(1, old%increments_done)*rounding_of_places(scene, &
      trial%u_free) .and. .not. maxval(abs(old%reaction(:, points)), dim=1) > 0.0_wp) &
      gap = 0.0_wp
  end subroutine touch_without_force

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
    if (.not. of_group%converged() .and. contact%ending /= ended_unbalanced) contact%ending = &
      merge(ended_stalled, of_group%ending, of_group%ending == not_ended)
    if (of_group%residual >= contact%residual) then
      contact%residual = of_group%residual
      contact%worst_point = 0
      if (of_group%worst_point > 0) contact%worst_point = group%active(of_group%worst_point)
    end if
  end subroutine add_report

  !> The slips by which supports drive points along tangents that cannot move; none where they are
  !> nothing beside what moves, or at finite strain where places are rounded by as much.
  !> docs/theory.md section 3.
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
    least = tolerance*way
    if (scene%finite_strain) least = max(least, 8.0_wp*epsilon(1.0_wp)*maxval(abs( &
      scene%mesh%coordinates)))
    where (spread(norm2(driven, dim=1) <= least, 1, 2)) driven = 0.0_wp
  end function driven_slips

end module solve_reactions_mod
