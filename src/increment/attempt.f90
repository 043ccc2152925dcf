!> What an increment is solved with: its loads, where it begins, and the reactions that answer.
module attempt_mod
  use kinds_mod, only: wp
  use system_mod, only: wall_seconds
  use scene_mod, only: scene_t
  use controls_mod, only: contact_controls_t, is_exact, solver_sweeps
  use contact_points_mod, only: contact_points_t
  use increments_mod, only: increment_t
  use state_mod, only: state_t
  use step_report_mod, only: step_report_t, ended_unbalanced
  use certificate_mod, only: step_forces_t
  use problem_mod, only: contact_problem_t, contact_report_t, pack_rows, unpack_gaps, &
    relative_gaps, add_driven_friction
  use rigid_modes_mod, only: generalised_loads, add_motions
  use solve_mod, only: solve_contact
  use floating_mod, only: drift_t, solve_floating, resisting_rows
  use motion_words_mod, only: free_in_words, motion_in_words, unresisted_part
  use follow_points_mod, only: locate_at, relative, nodal
  use step_loads_mod, only: pattern_factors
  use stiffness_inverse_mod, only: answer_of_interface, at_interface
  use operators_mod, only: operators_t
  implicit none
  private

  public :: attempt_t, begin_attempt, displacement_of, solve_reactions, expected_reactions, &
    trend_of, sum_patterns

  real(wp), parameter :: continuous = 1.0e-12_wp !! loads that differ by no more go on as they were

  !> What an increment is solved with.
  type :: attempt_t
    type(contact_controls_t) :: controls !! the deck's, with the residual that is asked for now
    logical :: is_foreseen = .false. !! its first reactions and what they cause are there
    type(step_forces_t) :: forces
    real(wp), allocatable :: u_free(:, :)
    !! (3,n_nodes) displacement without contact and free motions [length]
    real(wp), allocatable :: pressed(:, :)
    !! (3,n_nodes) displacement by the reactions, K^-1 B^T r [length]
    real(wp), allocatable :: applied(:, :)     !! (3,n_points) those reactions, x, y, z [force]
    real(wp), allocatable :: motion(:)         !! (n) how far the free motions have gone [length]
    real(wp), allocatable :: turned(:)
    !! (k) what turned normals leave on neutral motions [force]
    real(wp), allocatable :: start(:, :)
    !! (3,n_nodes) displacement where curved obstacles are linearised [length]
  end type attempt_t

contains

  !> The loads of an increment, and the displacement under them without contact.
  subroutine begin_attempt(scene, points, operators, old, increment, now)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(operators_t), intent(in) :: operators
    type(state_t), intent(in) :: old
    type(increment_t), intent(in) :: increment
    type(attempt_t), intent(out) :: now
    integer :: i

    call sum_patterns(scene, operators, increment%share, increment%step_time, now%u_free, &
      now%forces%external)
    now%forces%prescribed = operators%prescribed
    now%forces%displacement = prescribed_displacement(scene, operators, increment)
    allocate (now%forces%internal, mold=old%displacement)
    now%controls = scene%contact
    now%motion = [(old%displacement(operators%motions%dof(i), operators%motions%node(i)), &
      i=1, operators%motions%n)]
    call carry_over(scene, points, operators, old, increment, now)
    ! Obstacles are where they will be, nodes where they were.
    now%start = old%displacement
    where (now%forces%prescribed) now%start = now%u_free
  end subroutine begin_attempt

  !> Begin with the reactions of the increment before, where the factor is not exact: what it makes
  !> of them was refined there, and only what changes has to be refined again.
  !>
  !> Not where loads or supports jump as a *STEP begins (an amplitude that is not 0 at its start):
  !> the displacement there is no answer to the patterns of this *STEP.
  subroutine carry_over(scene, points, operators, old, increment, now)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(operators_t), intent(in) :: operators
    type(state_t), intent(in) :: old
    type(increment_t), intent(in) :: increment
    type(attempt_t), intent(inout) :: now      !! its displacements and applied reactions
    real(wp), allocatable :: loaded(:, :), external(:, :)

    allocate (now%pressed(3, scene%mesh%n_nodes), now%applied(3, points%n), source=0.0_wp)
    if (is_exact(scene%precision)) return
    call sum_patterns(scene, operators, increment%begin, &
      increment%begin*scene%steps(increment%step)%period, loaded, external)
    if (jump(external, old%external_force) .or. jump(merge(loaded, 0.0_wp, operators%prescribed), &
      merge(old%displacement, 0.0_wp, operators%prescribed))) return
    call add_motions(operators%motions, scene%mesh, now%motion, loaded)
    now%applied = old%reaction
    ! On the interface u_free must be what the contact problem adds W r to.
    now%pressed = at_interface(operators%inverse, answer_of_interface(operators%inverse, &
      nodal(points, now%applied, scene%mesh%n_nodes)), scene%mesh%n_nodes)
    now%u_free = now%u_free + (old%displacement - loaded) - now%pressed
  end subroutine carry_over

  !> Whether two fields differ by more than rounding.
  pure logical function jump(one, other)
    real(wp), intent(in) :: one(:, :), other(:, :) !! (3,n_nodes)

    jump = maxval(abs(one - other)) > continuous*max(maxval(abs(one)), maxval(abs(other)))
  end function jump

  !> The displacement under the loads, the reactions and the free motions; what supports prescribe
  !> is as they prescribe it, to the last bit.
  pure function displacement_of(scene, operators, now, pressed) result(u)
    type(scene_t), intent(in) :: scene
    type(operators_t), intent(in) :: operators
    type(attempt_t), intent(in) :: now
    real(wp), intent(in) :: pressed(:, :)  !! (3,n_nodes) by the reactions [length]
    real(wp) :: u(3, size(pressed, 2))     !! [length]

    u = now%u_free + pressed
    call add_motions(operators%motions, scene%mesh, now%motion, u)
    where (now%forces%prescribed) u = now%forces%displacement
  end function displacement_of

  !> The reactions to start from: the last ones, carried on as they went in the increment before;
  !> none where that pulls, by the normals where the increment begins: those of `operators` may be
  !> of a trial since. Sweeps start from the last ones, as in the paper.
  pure function expected_reactions(scene, points, operators, old, increment) result(reaction)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(operators_t), intent(in) :: operators
    type(state_t), intent(in) :: old
    type(increment_t), intent(in) :: increment
    real(wp) :: reaction(3, points%n) !! x, y, z [force]
    real(wp) :: frame(3, 3), gap
    integer :: i

    reaction = old%reaction
    if (scene%contact%solver == solver_sweeps .or. operators%motions%n > 0) return
    if (increment%begin <= 0.0_wp) return ! another *STEP leads elsewhere
    do i = 1, points%n
      reaction(:, i) = reaction(:, i) + (increment%share - increment%begin)*old%trend(:, i)
      frame = operators%frame(:, :, i)
      if (operators%is_curved(i)) call locate_at(scene, points, i, old%displacement, gap, frame)
      if (dot_product(reaction(:, i), frame(:, 1)) <= 0.0_wp) reaction(:, i) = 0.0_wp
    end do
  end function expected_reactions

  !> How the reactions went in an increment, as they would in its whole *STEP.
  pure function trend_of(increment, before, after) result(trend)
    type(increment_t), intent(in) :: increment
    real(wp), intent(in) :: before(:, :), after(:, :)        !! (3,n_points) reactions [force]
    real(wp) :: trend(size(before, 1), size(before, 2))      !! [force]

    trend = (after - before)/(increment%share - increment%begin)
  end function trend_of

  !> Displacement without contact and loads at a share of the *STEP, from its patterns.
  subroutine sum_patterns(scene, operators, share, step_time, u_free, external)
    type(scene_t), intent(in) :: scene
    type(operators_t), intent(in) :: operators
    real(wp), intent(in) :: share, step_time             !! as of increment_t [-], [time]
    real(wp), allocatable, intent(out) :: u_free(:, :)   !! (3,n_nodes) [length]
    real(wp), allocatable, intent(out) :: external(:, :) !! (3,n_nodes) [force]
    real(wp) :: factor(operators%loads%n_patterns)
    integer :: g

    factor = pattern_factors(scene, operators%loads, share, step_time)
    allocate (u_free(3, scene%mesh%n_nodes), external(3, scene%mesh%n_nodes), source=0.0_wp)
    do g = 1, operators%loads%n_patterns
      u_free = u_free + factor(g)*operators%response(:, :, g)
      external = external + factor(g)*operators%loads%force(:, :, g)
    end do
  end subroutine sum_patterns

  !> What the supports prescribe at the end of an increment, from the loads alone: the certificate
  !> holds displacements against it, so nothing of it comes from a solution.
  pure function prescribed_displacement(scene, operators, increment) result(u)
    type(scene_t), intent(in) :: scene
    type(operators_t), intent(in) :: operators
    type(increment_t), intent(in) :: increment
    real(wp) :: u(3, scene%mesh%n_nodes)  !! 0 where nothing is prescribed [length]
    real(wp) :: factor(operators%loads%n_patterns)
    integer :: g

    factor = pattern_factors(scene, operators%loads, increment%share, increment%step_time)
    u = 0.0_wp
    do g = 1, operators%loads%n_patterns
      u = u + factor(g)*operators%loads%displacement(:, :, g)
    end do
  end function prescribed_displacement

  !> The contact problem of the increment: gaps and slips that u_free would give, then the
  !> reactions, and the free motions.
  subroutine solve_reactions(scene, points, operators, old, now, reaction, report)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(operators_t), intent(inout) :: operators
    type(state_t), intent(in) :: old
    type(attempt_t), intent(inout) :: now        !! gets how far the motions go
    real(wp), intent(inout) :: reaction(:, :)    !! (3,n_points) x, y, z; warm start in [force]
    type(step_report_t), intent(inout) :: report
    real(wp), dimension(3, size(operators%active)) :: x, r
    type(drift_t) :: drift
    real(wp), allocatable :: resisting(:, :)
    type(contact_report_t) :: contact
    real(wp) :: clock
    integer :: i, k

    clock = wall_seconds()
    do k = 1, size(operators%active)
      i = operators%active(k)
      x(:, k) = matmul(relative(points, i, now%u_free) - relative(points, i, old%displacement), &
        operators%frame(:, :, i))
      x(1, k) = operators%gap(i) + dot_product(operators%frame(:, 1, i), &
        relative(points, i, now%u_free) - operators%place(:, i))
      r(:, k) = matmul(reaction(:, i), operators%frame(:, :, i))
    end do
    report%x_free = pack_rows(operators%problem, x)
    operators%problem%driven = driven_slips(scene, operators%problem, x, now%u_free - &
      old%displacement, now%controls%tolerance)
    if (operators%motions%n == 0) then
      call solve_contact(operators%problem, report%x_free, now%controls, r, contact)
    else
      call generalised_loads(operators%motions, scene%mesh, now%forces%external, drift%load, &
        drift%rounding)
      drift%a = now%motion
      call solve_floating(operators%problem, operators%floating, report%x_free, now%controls, &
        drift, r, contact)
      now%motion = drift%a
      now%turned = drift%turned
      resisting = resisting_rows(operators%problem, operators%floating, r, report%x_free, &
        contact%converged)
      if (contact%ending == ended_unbalanced) report%unbalanced = motion_in_words(scene%mesh, &
        operators%motions, unresisted_part(resisting, drift%unbalanced))
      if (contact%converged) call free_in_words(scene%mesh, operators%motions, resisting, &
        report%n_unheld, report%unheld)
    end if
    if (any(abs(operators%problem%driven) > 0.0_wp)) then
      x = unpack_gaps(operators%problem, relative_gaps(operators%problem, report%x_free, &
        pack_rows(operators%problem, r)))
      call add_driven_friction(operators%problem, x, r)
    end if
    reaction = 0.0_wp
    do k = 1, size(operators%active)
      i = operators%active(k)
      reaction(:, i) = matmul(operators%frame(:, :, i), r(:, k))
    end do
    report%converged = contact%converged
    report%solver = contact%solver
    report%contact_iterations = report%contact_iterations + contact%iterations
    report%local_iterations = report%local_iterations + contact%local_iterations
    report%compliance_products = report%compliance_products + contact%products
    report%solver_stages = max(report%solver_stages, contact%stages, 1)
    report%ending = contact%ending
    report%residual = contact%residual
    report%worst_point = 0
    if (contact%worst_point > 0) report%worst_point = operators%active(contact%worst_point)
    report%contact_time = report%contact_time + wall_seconds() - clock
  end subroutine solve_reactions

  !> The slips by which supports drive points along tangents that cannot move; none where places are
  !> rounded by as much, or where it is nothing beside what moves. docs/theory.md section 3.
  pure function driven_slips(scene, problem, x, way, tolerance) result(driven)
    type(scene_t), intent(in) :: scene
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: x(:, :)     !! (3,n_active) gaps and slips without reactions [length]
    real(wp), intent(in) :: way(:, :)   !! (3,n_nodes) without reactions [length]
    real(wp), intent(in) :: tolerance   !! contact tolerance [-]
    real(wp) :: driven(2, problem%n_points) !! [length]
    real(wp) :: least

    driven = 0.0_wp
    if (problem%n_points == 0) return
    where (problem%row(2:, :) == 0 .and. spread(problem%mu > 0.0_wp, 1, 2)) driven = x(2:, :)
    least = max(8.0_wp*epsilon(1.0_wp)*maxval(abs(scene%mesh%coordinates)), &
      tolerance*maxval(norm2(way, dim=1)))
    where (spread(norm2(driven, dim=1) <= least, 1, 2)) driven = 0.0_wp
  end function driven_slips

end module attempt_mod
