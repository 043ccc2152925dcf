!> What an increment is solved with: its loads, and where it begins.
module trial_mod
  use kinds_mod, only: wp, i8
  use constraints_mod, only: follow_masters
  use scene_mod, only: scene_t
  use controls_mod, only: is_exact, solver_sweeps, solver_auto
  use contact_points_mod, only: contact_points_t
  use increments_mod, only: increment_t
  use kinks_mod, only: count_between
  use interference_mod, only: has_interference, set_extra_gap
  use state_mod, only: state_t
  use increment_forces_mod, only: increment_forces_t, imposed_t
  use rigid_modes_mod, only: free_motions_t, generalised_loads, add_motions
  use placement_mod, only: placement_t, place_state, place_undeformed, leave_ends
  use surface_drag_mod, only: place_beginning
  use transfer_mod, only: nodal_forces
  use stiffness_inverse_mod, only: moved_by
  use bodies_mod, only: is_linear, forces_of_heat
  use inertia_mod, only: in_motion_t
  use newmark_mod, only: by_inertia_t
  use expansion_mod, only: find_free_strain
  use load_response_mod, only: sum_patterns, prescribed_displacement, impose_loads
  use turns_mod, only: rotation_at
  use turning_couplings_mod, only: has_turning, settle_couplings
  use step_solver_mod, only: step_solver_t
  implicit none
  private

  public :: contact_alone, with_energies, certified, from_before, near_its_end, as_foreseen
  public :: goal_t, trial_t, set_gaps, begin_trial, begin_near, begin_extrapolated, &
    apply_reactions, loads_on_motions, displacement_of, expected_reactions, trend_of

  real(wp), parameter :: continuous = 1.0e-12_wp !! loads that differ by no more go on as they were

  ! How much of an increment's end is wanted.
  integer, parameter :: contact_alone = 1 !! reactions, and of the displacement what contact sees
  integer, parameter :: with_energies = 2 !! all of the displacement, forces and energies
  integer, parameter :: certified = 3     !! the same, and the certificate's judgement

  ! From where an increment is sought.
  integer, parameter :: from_before = 1   !! from the increment before, carried on as it went
  integer, parameter :: near_its_end = 2
  !! from displacements and reactions that the solution comes with
  integer, parameter :: as_foreseen = 3   !! the same: these reactions are the first iteration's

  !> What an increment is to come to, and from where it is sought.
  type :: goal_t
    type(increment_t) :: increment
    real(wp) :: tolerance               !! of contact [-]
    real(wp) :: sharp_enough = 0.0_wp   !! residual of what only an estimate needs; 0: another [-]
    integer :: most_iterations = 40     !! of Newton-Raphson
    integer :: wanted = certified
    integer :: start = from_before
    logical :: shows_progress = .false. !! iterations, on a terminal
  end type goal_t

  !> Of bodies solved for by iteration, with the reactions.
  type :: by_iteration_t
    real(wp), allocatable :: start(:, :)  !! (3,n_nodes) of u_contact [length]
    real(wp), allocatable :: before(:, :)
    !! (3,n_nodes) u_contact of the increment before; not allocated: supports hold no body [length]
    real(wp), allocatable :: load_left(:)
    !! (n_free+n) forces that u_contact and the motions take up beside theirs [force]
    real(wp), allocatable :: unsolved(:) !! (n_free+n) of all of these, what they do not [force]
  end type by_iteration_t

  !> All that an increment's solution is made from; nothing of it outlives the trial.
  type :: trial_t
    type(goal_t) :: goal
    real(wp) :: tolerance = 0.0_wp  !! residual that is asked for in this attempt [-]
    logical :: factorises = .false. !! Newton's systems, since GMRES has not done one
    real(wp) :: duration = 0.0_wp !! of the increment [time]
    logical :: has_turned = .false. !! bodies, with the factor, as the increment begins
    logical :: is_extrapolated = .false. !! from the increment before, as this one begins
    logical :: has_begun = .false. !! a placement has been solved
    logical :: is_foreseen = .false. !! its first reactions and what they cause are there
    type(increment_forces_t) :: forces
    type(in_motion_t), allocatable :: in_motion !! of a dynamic *STEP; not allocated in statics
    real(wp), allocatable :: free(:)
    !! (n_elements) strain by free expansion [-]
    real(wp), allocatable :: summed_loads(:, :)
    !! (3,n_nodes) the magnitudes that the external forces sum up [force]
    real(wp), allocatable :: support_force(:, :)
    !! (3,n_nodes) at finite strain: motions of deformed bodies may move what supports hold, where
    !! they do not in the mesh [force]
    real(wp), allocatable :: u_free(:, :)
    !! (3,n_nodes) displacement without contact and free motions [length]
    real(wp), allocatable :: on_interface(:)
    !! (n_interface) a part of u_free that the interface alone has yet; its interior comes with what
    !! reactions do to it. Not allocated: there is none [length]
    real(wp), allocatable :: u_contact(:, :)
    !! (3,n_nodes) displacement by the reactions, K^-1 B^T r [length]
    real(wp), allocatable :: applied_reaction(:, :)
    !! (3,n_points) the reactions that u_contact answers, x, y, z [force]
    real(wp), allocatable :: applied_force(:, :)
    !! (3,n_nodes) of these, by the weights of their time [force]
    logical :: by_compliance = .false. !! not together with the reactions: that led nowhere
    type(by_iteration_t), allocatable :: by_iteration !! of bodies solved for by iteration
    real(wp), allocatable :: motion(:)         !! (n) how far the free motions have gone [length]
    real(wp), allocatable :: neutral_residual(:)
    !! (k) what turned normals leave on neutral motions [force]
    real(wp), allocatable :: placed_at(:, :)
    !! (3,n_nodes) displacement where curved obstacles are linearised [length]
    real(wp), allocatable :: rotation(:, :)
    !! (3,n_obstacles) rotation vectors at the end of the increment [rad]
    real(wp), allocatable :: turned_from(:, :)
    !! (3,n) rotations of couplings where the increment begins, as of scene_t [length]
    type(placement_t) :: began
    !! the points where the increment begins; empty at small strain with an exact factor
    type(placement_t) :: placement
  end type trial_t

contains

  !> Points and placement of the undeformed mesh with the extra gaps that the end of an increment
  !> has, where these change.
  subroutine set_gaps(scene, points, increment, now, solver)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(increment_t), intent(in) :: increment
    type(contact_points_t), intent(out) :: now
    type(step_solver_t), intent(inout) :: solver

    now = points
    if (.not. has_interference(scene)) return
    call set_extra_gap(scene, increment%step, increment%position, now)
    call place_undeformed(scene, now, solver%undeformed)
  end subroutine set_gaps

  !> The loads of an increment, and the displacement under them without contact.
  subroutine begin_trial(scene, points, solver, old, goal, trial, inertia)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    type(state_t), intent(in) :: old
    type(goal_t), intent(in) :: goal
    type(trial_t), intent(out) :: trial
    type(by_inertia_t), intent(in), optional :: inertia !! of a dynamic *STEP
    integer :: i

    trial%goal = goal
    trial%tolerance = max(goal%tolerance, goal%sharp_enough)
    associate (increment => goal%increment)
      call sum_patterns(scene, solver%response, increment%fraction, increment%step_time, &
        trial%u_free, trial%forces%external, trial%summed_loads)
      if (present(inertia)) then
        trial%in_motion = inertia%in_motion
        if (allocated(inertia%u)) trial%u_free = trial%u_free + inertia%u
        if (allocated(inertia%on_interface)) trial%on_interface = inertia%on_interface
      end if
      call impose_loads(scene, solver%response%loads, increment%fraction, increment%step_time, &
        old%displacement, trial%forces%imposed_t)
      allocate (trial%free(scene%mesh%n_elements))
      call find_free_strain(scene, increment%step, increment%position, trial%free)
      trial%forces%of_elements%largest = forces_of_heat(scene, trial%free)
      trial%duration = (increment%fraction - increment%begin)*scene%steps(increment%step)%period
      trial%forces%prescribed = solver%body%prescribed
      trial%forces%constraints = scene%constraints
      if (has_turning(scene)) trial%turned_from = old%displacement(:, scene%rotations%rotation_node)
      trial%forces%displacement = prescribed_displacement(scene, solver%response%loads, increment)
      trial%rotation = rotation_at(scene, solver%response%loads%turns, increment%fraction, &
        increment%step_time)
    end associate
    allocate (trial%forces%internal, mold=old%displacement)
    associate (motions => solver%body%motions)
      trial%motion = [(old%displacement(motions%dof(i), motions%node(i)), i=1, motions%n)]
    end associate
    if (solver%body%motions%n > 0 .and. .not. is_linear(scene)) trial%support_force = &
      old%support_force
    call carry_over(scene, points, solver, old, goal%increment, trial)
    ! Obstacles are where they will be, nodes where they were.
    trial%placed_at = old%displacement
    where (trial%forces%prescribed) trial%placed_at = trial%u_free
    trial%placement = solver%undeformed
    if (.not. allocated(points%alpha) .or. any(solver%body%motions%body >= 0)) return
    call leave_ends(scene, points, trial%u_free, trial%rotation, old, trial%placement)
  end subroutine begin_trial

  !> Begin with the reactions of the increment before, where the factor is not exact or forces not
  !> linear: what it makes of them was refined there, and only what changes has to be refined again.
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
    type(imposed_t) :: began_with
    real(wp), allocatable :: loaded(:, :)

    allocate (trial%u_contact(3, scene%mesh%n_nodes), trial%applied_reaction(3, points%n), &
      trial%applied_force(3, scene%mesh%n_nodes), source=0.0_wp)
    if (allocated(solver%body%inverse%iterative)) then
      call carry_displacements(scene, solver, old, increment, trial)
      return
    end if
    if (is_linear(scene) .and. (is_exact(solver%choices%precision) .or. .not. &
      solver%body%inverse%is_condensed)) return
    call place_beginning(scene, points, old, solver%undeformed, trial%began)
    associate (time => increment%begin*scene%steps(increment%step)%period)
      call sum_patterns(scene, solver%response, increment%begin, time, loaded, &
        began_with%external)
      call impose_loads(scene, solver%response%loads, increment%begin, time, old%displacement, &
        began_with)
    end associate
    associate (prescribed => solver%body%prescribed)
      if (jump(began_with%external, old%external_force) .or. jump(merge(loaded, 0.0_wp, &
        prescribed), merge(old%displacement, 0.0_wp, prescribed))) return
    end associate
    call add_motions(solver%body%motions, scene%mesh, trial%motion, loaded)
    call apply_reactions(points, old, trial)
    ! On the interface u_free must be what the contact problem adds W r to.
    trial%u_contact = moved_by(solver%body%inverse, trial%applied_force)
    trial%u_free = trial%u_free + (old%displacement - loaded) - trial%u_contact
  end subroutine carry_over

  !> Begin near the end: from other displacements and reactions than those of the increment before.
  subroutine begin_near(scene, points, solver, start, trial)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    type(state_t), intent(in) :: start
    type(trial_t), intent(inout) :: trial      !! its displacements and applied reactions
    integer :: i

    associate (motions => solver%body%motions)
      trial%motion = [(start%displacement(motions%dof(i), motions%node(i)), i=1, motions%n)]
    end associate
    if (allocated(start%alone)) trial%placement%weights%alone = start%alone
    if (is_linear(scene)) then
      where (.not. trial%forces%prescribed) trial%placed_at = start%displacement
      if (.not. allocated(trial%by_iteration)) return
      trial%by_iteration%start = start%displacement - trial%u_free
      call add_motions(solver%body%motions, scene%mesh, -trial%motion, trial%by_iteration%start)
    else
      call begin_from(scene, points, solver, start, trial)
    end if
  end subroutine begin_near

  !> The same at finite strain, where forces follow from displacements.
  subroutine begin_from(scene, points, solver, start, trial)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    type(state_t), intent(in) :: start
    type(trial_t), intent(inout) :: trial      !! its displacements and applied reactions

    trial%applied_reaction = start%reaction
    trial%applied_force = nodal_forces(points, trial%began%weights, start%reaction, &
      scene%mesh%n_nodes)
    trial%u_contact = moved_by(solver%body%inverse, trial%applied_force)
    trial%u_free = start%displacement - trial%u_contact
    call add_motions(solver%body%motions, scene%mesh, -trial%motion, trial%u_free)
    where (.not. trial%forces%prescribed) trial%placed_at = start%displacement
  end subroutine begin_from

  !> Begin with displacements extrapolated from the increment before: where the points are placed
  !> first, and at finite strain with the reactions to start from. Not behind a breakpoint of the
  !> loads, nor where a *STEP begins. docs/theory.md (8.21).
  subroutine begin_extrapolated(scene, points, solver, old, increment, reaction, trial)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    type(state_t), intent(in) :: old
    type(increment_t), intent(in) :: increment
    real(wp), intent(in) :: reaction(:, :)     !! (3,n_points) [force]
    type(trial_t), intent(inout) :: trial      !! gets is_extrapolated, as of begin_from
    type(state_t) :: start
    integer(i8) :: before !! where the increment before began, if it was as long

    if (increment%begin <= 0.0_wp .or. .not. allocated(old%displacement_trend)) return
    if (allocated(trial%by_iteration)) then
      if (allocated(trial%by_iteration%before)) return
    end if
    if (solver%choices%precision%renews_tangent .and. scene%contact%solver /= solver_auto) return
    before = increment%start - (increment%position - increment%start)
    if (count_between(solver%response%loads%kinks, before, increment%position) > 0) return
    start = old
    start%displacement = old%displacement + (increment%fraction - increment%begin)* &
      old%displacement_trend
    start%reaction = reaction
    if (is_linear(scene)) then
      where (.not. trial%forces%prescribed) trial%placed_at = start%displacement
    else if (solver%body%motions%n > 0) then
      return
    else
      call begin_from(scene, points, solver, start, trial)
    end if
    trial%is_extrapolated = .true.
  end subroutine begin_extrapolated

  !> Apply the reactions of the increment before.
  pure subroutine apply_reactions(points, old, trial)
    type(contact_points_t), intent(in) :: points
    type(state_t), intent(in) :: old
    type(trial_t), intent(inout) :: trial !! placed where it begins

    trial%applied_reaction = old%reaction
    trial%applied_force = nodal_forces(points, trial%began%weights, old%reaction, &
      size(old%displacement, 2))
  end subroutine apply_reactions

  !> The same where solutions are by iteration, for displacements to start from: what contact did,
  !> carried on as it went. Bodies that move freely start from where they are.
  subroutine carry_displacements(scene, solver, old, increment, trial)
    type(scene_t), intent(in) :: scene
    type(step_solver_t), intent(in) :: solver
    type(state_t), intent(in) :: old
    type(increment_t), intent(in) :: increment
    type(trial_t), intent(inout) :: trial
    type(by_iteration_t) :: by
    real(wp), allocatable :: load(:), rounding(:)
    logical :: is_free(0:scene%mesh%n_bodies)

    associate (motions => solver%body%motions)
      allocate (by%load_left(solver%body%inverse%map%n_free + motions%n), source=0.0_wp)
      allocate (by%unsolved, source=by%load_left)
      is_free = .false.
      is_free(motions%body) = .true.
      if (motions%n > 0) then
        ! Pins hold nothing: what loads do along free motions is taken up there.
        call generalised_loads(motions, scene%mesh, trial%forces%external, trial%summed_loads, &
          load, rounding)
        by%load_left(size(by%load_left) - motions%n + 1:) = load
        by%start = old%displacement - trial%u_free
        call add_motions(motions, scene%mesh, -trial%motion, by%start)
      end if
    end associate
    if (.not. all(is_free(1:))) call begin_held()
    trial%by_iteration = by

  contains

    !> What contact did to bodies that supports hold, and will do if it goes on.
    subroutine begin_held()
      real(wp), allocatable :: loaded(:, :), external(:, :)
      real(wp) :: of_held(3, scene%mesh%n_nodes)

      call sum_patterns(scene, solver%response, increment%begin, &
        increment%begin*scene%steps(increment%step)%period, loaded, external)
      by%before = old%displacement - loaded
      of_held = by%before
      if (allocated(old%displacement_trend) .and. increment%begin > 0.0_wp) of_held = of_held + &
        (increment%fraction - increment%begin)*old%displacement_trend
      if (.not. allocated(by%start)) allocate (by%start, mold=of_held)
      where (.not. spread(is_free(scene%mesh%body), 1, 3)) by%start = of_held
    end subroutine begin_held

  end subroutine carry_displacements

  !> Whether two fields differ by more than rounding.
  pure logical function jump(one, other)
    real(wp), intent(in) :: one(:, :), other(:, :) !! (3,n_nodes)

    jump = maxval(abs(one - other)) > continuous*max(maxval(abs(one)), maxval(abs(other)))
  end function jump

  !> The work that loads, and supports that see a motion, do on a unit of every free motion.
  subroutine loads_on_motions(scene, motions, trial, load, rounding)
    type(scene_t), intent(in) :: scene
    type(free_motions_t), intent(in) :: motions
    type(trial_t), intent(in) :: trial
    real(wp), allocatable, intent(out) :: load(:), rounding(:) !! (n) as of generalised_loads

    if (allocated(trial%support_force)) then
      call generalised_loads(motions, scene%mesh, trial%forces%external + trial%support_force, &
        trial%summed_loads + abs(trial%support_force), load, rounding)
    else
      call generalised_loads(motions, scene%mesh, trial%forces%external, trial%summed_loads, load, &
        rounding)
    end if
  end subroutine loads_on_motions

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
    if (allocated(trial%turned_from)) call settle_couplings(scene, trial%forces%prescribed, &
      trial%turned_from, u)
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
    call place_state(scene, points, solver%undeformed, old, began)
    do i = 1, points%n
      reaction(:, i) = reaction(:, i) + (increment%fraction - increment%begin)*old%trend(:, i)
      if (dot_product(reaction(:, i), began%frame(:, 1, i)) <= 0.0_wp) reaction(:, i) = 0.0_wp
    end do
  end function expected_reactions

  !> How reactions, or displacements, went in an increment, as they would in its whole *STEP.
  pure function trend_of(increment, before, after) result(trend)
    type(increment_t), intent(in) :: increment
    real(wp), intent(in) :: before(:, :), after(:, :)        !! (3,n) [force or length]
    real(wp) :: trend(size(before, 1), size(before, 2))      !! [force or length]

    trend = (after - before)/(increment%fraction - increment%begin)
  end function trend_of

end module trial_mod
