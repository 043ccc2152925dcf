!> What finite strain changes of a small-strain solution, by a run beside it: the shadow run.
!>
!> Beside the linear run a second state goes along the same path at finite strain, in longer
!> increments, with the factor and the compliance of the linear run, which it gives back as they
!> were. A third one does so at small strain: the difference of the two is the theory's, whatever
!> the increments' size makes of friction. Each of its increments begins with the change that small
!> strain has made. Where it does not settle, or where what it finds is unstable, how far
!> small strain is off is not known.
!> docs/theory.md (8.39).
module shadow_run_mod
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t
  use scene_mod, only: scene_t, material_t
  use material_law_mod, only: law_t
  use new_law_mod, only: other_law
  use finite_strain_limits_mod, only: beyond_finite_strain
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t
  use increments_mod, only: increment_t, next_increment, ends_step, &
    whole_increment
  use increment_report_mod, only: increment_report_t, has_converged, error_parts_t, &
    ended_out_of_balance
  use bodies_mod, only: strain_energy
  use expansion_mod, only: find_free_strain
  use rigid_modes_mod, only: free_motions_t
  use step_loads_mod, only: step_loads_t, resolve_loads, following_at
  use load_response_mod, only: load_response_t, respond_to_loads
  use linearisation_mod, only: solver_work_t
  use step_solver_mod, only: step_solver_t
  use stability_mod, only: stability_t, find_stability, is_hint
  use trial_mod, only: goal_t, contact_alone, with_energies, from_before, near_its_end, as_foreseen
  use turned_bodies_mod, only: condense_flat
  use advance_mod, only: advance
  implicit none
  private

  public :: shadow_run_t, shadow_solver_t, has_no_shadow, count_shadows, begin_shadows, &
    is_due, follow_shadows, compare_shadows, look_at_stability
  public :: laws_at_finite_strain, take_laws, is_first_due
  public :: not_unstable, is_unstable, may_be_unstable, unknown_stability

  ! At the end of a *STEP, at finite strain.
  integer, parameter :: not_unstable = 0
  integer, parameter :: is_unstable = 1
  integer, parameter :: may_be_unstable = 2 !! friction or curved surfaces may yet hold it
  integer, parameter :: unknown_stability = 3

  real(wp), parameter :: least = 1.0e-5_wp, part = 0.01_wp
  !! what iterations may leave out of balance, of the largest force of a body: that, or that part of
  !! what the theory changes. Resultants are a hundredth of the change off at most then [-]
  integer, parameter :: most_iterations = 12 !! of an increment
  real(wp), parameter :: sharp_enough = 1.0e-6_wp !! residual of small strain beside them [-]
  real(wp), parameter :: tenth = 0.1_wp
  !! of what the theory changes: what may be left out of balance when these are spent [-]

  !> Where a shadow run is.
  type :: shadow_run_t
    type(state_t) :: state
    integer :: lost_in = 0 !! increment of the run that it did not follow; 0: none
  end type shadow_run_t

  !> What shadow runs are solved with, beside the solver of the linear run.
  type :: shadow_solver_t
    type(scene_t) :: finite           !! the scene at finite strain
    type(law_t), allocatable :: law(:, :) !! (n_materials,n_laws) as of laws_at_finite_strain
    type(load_response_t) :: response !! of the *STEP
    integer :: step = 0               !! that the response is of; 0: none yet
    real(wp), allocatable :: begun(:, :)
    !! (3,n_nodes) prescribed displacements as the *STEP of the linear run begins [length]
    integer :: stability = not_unstable !! what was found in the last increment, if anything
  end type shadow_solver_t

contains

  !> Why no run at finite strain can go beside the linear one, in words; empty: one can.
  function has_no_shadow(scene) result(why)
    type(scene_t), intent(in) :: scene !! at small strain
    character(:), allocatable :: why
    type(scene_t) :: finite

    finite = at_finite_strain(scene)
    why = beyond_finite_strain(finite)
    ! Finite strain holds other nodes of these.
    if (why == '' .and. allocated(scene%rotations)) why = 'couplings whose reference node turns'
  end function has_no_shadow

  !> How many shadow runs are asked for: one for each law that the cards leave open, as *ELASTIC
  !> does; none where finite strain is no theory beside the run, but its own.
  integer function count_shadows(scene) result(n)
    type(scene_t), intent(in) :: scene

    n = 0
    if (scene%accuracy%follows_theory .and. .not. scene%finite_strain) n = &
      size(laws_at_finite_strain(scene%materials), 2)
  end function count_shadows

  !> The laws that finite strain may have: the deck's, and where a card leaves the law open the
  !> other one of the same constants.
  function laws_at_finite_strain(materials) result(law)
    type(material_t), intent(in) :: materials(:)
    type(law_t), allocatable :: law(:, :) !! (n_materials,1 or 2)
    integer :: i, n

    n = 1
    do i = 1, size(materials)
      if (materials(i)%law%is_open) n = 2
    end do
    allocate (law(size(materials), n))
    do i = 1, size(materials)
      law(i, :) = materials(i)%law
      if (materials(i)%law%is_open) law(i, n) = other_law(materials(i)%law)
    end do
  end function laws_at_finite_strain

  !> Begin what shadow runs are solved with, and what stability is looked at with where a bound is
  !> to do.
  subroutine begin_shadows(scene, shadow)
    type(scene_t), intent(in) :: scene
    type(shadow_solver_t), intent(out) :: shadow

    shadow%finite = at_finite_strain(scene)
    shadow%law = laws_at_finite_strain(scene%materials)
  end subroutine begin_shadows

  !> The same scene at finite strain.
  type(scene_t) function at_finite_strain(scene) result(finite)
    type(scene_t), intent(in) :: scene

    finite = scene
    finite%finite_strain = .true.
  end function at_finite_strain

  !> Whether shadow runs are to catch up with the linear run: in the middle and at the end of a
  !> *STEP, and where amplitudes bend or obstacles turn.
  pure logical function is_due(scene, solver, old, new)
    type(scene_t), intent(in) :: scene
    type(step_solver_t), intent(in) :: solver
    type(state_t), intent(in) :: old, new !! of the linear run: its last increment
    integer(i8) :: start

    start = merge(old%position, 0_i8, old%step == new%step)
    associate (kinks => solver%response%loads%kinks, middle => whole_increment* &
      scene%steps(new%step)%n_increments/2)
      is_due = ends_step(scene%steps, new) .or. any(scene%obstacles%turns) .or. &
        any(start < [middle, kinks] .and. [middle, kinks] <= new%position)
    end associate
  end function is_due

  !> Whether this is the first time that shadow runs are due, in the first *STEP: those that begin
  !> here have missed nothing.
  pure logical function is_first_due(scene, solver, old, new)
    type(scene_t), intent(in) :: scene
    type(step_solver_t), intent(in) :: solver
    type(state_t), intent(in) :: old, new !! as of is_due

    is_first_due = new%step == 1 .and. .not. any([whole_increment*scene%steps(1)%n_increments/2, &
      solver%response%loads%kinks] <= old%position)
    if (is_first_due) is_first_due = is_due(scene, solver, old, new)
  end function is_first_due

  !> Let the shadow runs follow the linear run to where it is, and look at the end of a *STEP
  !> whether the first is stable: that of the deck's law. The solver is given back as it came.
  subroutine follow_shadows(scene, points, before, new, followed, solver, shadow, runs)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(state_t), intent(in) :: before, new !! of the linear run: its last increment
    type(state_t), intent(inout) :: followed
    !! of small strain in the increments of the shadow runs
    type(step_solver_t), intent(inout) :: solver
    type(shadow_solver_t), intent(inout) :: shadow
    type(shadow_run_t), intent(inout) :: runs(:)
    type(free_motions_t) :: motions
    type(increment_t) :: increment
    type(state_t) :: old
    integer :: k
    logical :: ok, is_settled

    if (all(runs%lost_in > 0)) return
    old = followed
    increment = next_increment(scene%steps, old, new%position - merge(old%position, 0_i8, &
      old%step == new%step))
    call follow_linearly(scene, points, before, new, increment, solver, followed)
    motions = solver%body%motions
    solver%body%motions%are_finite = .true.
    call exchange_responses(solver, shadow)
    ok = .true.
    if (shadow%step /= new%step) call enter_step(ok)
    do k = 1, size(runs)
      if (runs(k)%lost_in > 0) cycle
      call take_laws(shadow%law(:, k), shadow%finite%materials)
      is_settled = .false.
      if (ok) call follow(shadow%finite, points, old, followed, increment, solver, &
        runs(k)%state, is_settled)
      if (.not. is_settled) runs(k)%lost_in = new%increments_done
      if (k > 1 .or. .not. increment%last_of_step .or. runs(k)%lost_in > 0) cycle
      call look_at_stability(points, solver, runs(k)%state, increment, shadow)
      ! So it is with any law of the same constants.
      if (any(shadow%stability == [is_unstable, may_be_unstable])) runs%lost_in = &
        new%increments_done
    end do
    call exchange_responses(solver, shadow)
    solver%body%motions = motions
    if (any(motions%body > 0)) call condense_flat(scene, points, solver)

  contains

    subroutine enter_step(ok)
      logical, intent(out) :: ok
      type(solver_work_t) :: work
      type(error_t), allocatable :: error

      call resolve_loads(shadow%finite, new%step, shadow%begun, solver%response%loads)
      call respond_to_loads(shadow%finite, solver%choices%tolerance, solver%body, solver%response, &
        work, error)
      ok = .not. allocated(error)
      shadow%step = new%step
    end subroutine enter_step

  end subroutine follow_shadows

  !> Look whether the equilibrium at the end of an increment is unstable at finite strain: that of a
  !> shadow run, or that of the linear run in its place.
  subroutine look_at_stability(points, solver, state, increment, shadow)
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    type(state_t), intent(in) :: state
    type(increment_t), intent(in) :: increment
    type(shadow_solver_t), intent(inout) :: shadow !! gets what is found
    type(step_loads_t) :: loads
    type(stability_t) :: found

    call resolve_loads(shadow%finite, increment%step, shadow%begun, loads)
    call find_stability(shadow%finite, points, solver, state, following_at(shadow%finite, loads, &
      increment%fraction, increment%step_time), found)
    shadow%stability = not_unstable
    if (.not. found%is_known) shadow%stability = unknown_stability
    ! Friction alone holds a body that is free.
    if (found%n_unstable == 0 .or. (is_hint(found) .and. any(solver%body%motions%body > 0))) return
    shadow%stability = merge(may_be_unstable, is_unstable, is_hint(found))
  end subroutine look_at_stability

  !> Small strain in an increment of the shadow runs, which several of the linear run's may make:
  !> what their size makes of friction is in both then, and not of the theory.
  subroutine follow_linearly(scene, points, before, new, increment, solver, state)
    type(scene_t), intent(in) :: scene       !! at small strain
    type(contact_points_t), intent(in) :: points
    type(state_t), intent(in) :: before, new !! of the linear run: its last increment
    type(increment_t), intent(in) :: increment
    type(step_solver_t), intent(inout) :: solver
    type(state_t), intent(inout) :: state    !! that of the linear run, where it is not solved
    type(state_t) :: old
    type(increment_report_t) :: report
    type(error_t), allocatable :: error
    logical :: is_same

    is_same = state%increments_done == before%increments_done .and. .not. any(abs( &
      state%reaction - before%reaction) > 0.0_wp)
    old = state
    state = new
    if (is_same) return
    call advance(scene, points, solver, old, goal_t(increment, solver%choices%tolerance, &
      sharp_enough, wanted=with_energies, start=near_its_end), state, report, error)
    if (.not. allocated(error) .and. has_converged(report)) then
      state%increments_done = new%increments_done
      state%increment = new%increment
    else
      state = new
    end if
  end subroutine follow_linearly

  !> Give materials other laws.
  subroutine take_laws(law, materials)
    type(law_t), intent(in) :: law(:)
    type(material_t), intent(inout) :: materials(:)
    integer :: i

    do i = 1, size(materials)
      materials(i)%law = law(i)
    end do
  end subroutine take_laws

  !> Put the response of the one in the place of that of the other.
  subroutine exchange_responses(solver, shadow)
    type(step_solver_t), intent(inout) :: solver
    type(shadow_solver_t), intent(inout) :: shadow
    type(load_response_t) :: response

    response = solver%response
    solver%response = shadow%response
    shadow%response = response
  end subroutine exchange_responses

  !> One increment of a shadow run. Its first iteration is foreseen: displacements and reactions
  !> change as those of the linear run.
  subroutine follow(scene, points, old, new, increment, solver, state, ok)
    type(scene_t), intent(in) :: scene        !! at finite strain, with the laws of the run
    type(contact_points_t), intent(in) :: points
    type(state_t), intent(in) :: old, new     !! of the linear run
    type(increment_t), intent(in) :: increment
    type(step_solver_t), intent(inout) :: solver
    type(state_t), intent(inout) :: state     !! of the shadow run
    logical, intent(out) :: ok                !! it has settled
    type(goal_t) :: goal
    type(state_t) :: to
    type(increment_report_t) :: report
    type(error_t), allocatable :: error
    real(wp) :: free(scene%mesh%n_elements) !! strain by free expansion [-]

    goal = goal_t(increment, solver%choices%tolerance, max(least, min(0.1_wp, part*apart(points, &
      old%reaction, old%strain_energy, state))), most_iterations, contact_alone)
    ! Where bodies are free the reactions are not those of the place that they are at.
    if (solver%body%motions%n == 0) then
      goal%start = as_foreseen
    else if (.not. any(solver%body%motions%body > 0)) then
      goal%start = near_its_end
    end if
    if (goal%start /= from_before) then
      to = state
      to%displacement = state%displacement + (new%displacement - old%displacement)
      to%reaction = state%reaction + (new%reaction - old%reaction)
    end if
    call advance(scene, points, solver, state, goal, to, report, error)
    ok = .not. allocated(error)
    if (ok) ok = has_converged(report) .or. (report%ending%cause == ended_out_of_balance .and. &
      report%imbalance <= tenth*apart(points, new%reaction, new%strain_energy, to))
    if (.not. ok) return
    to%increments_done = new%increments_done
    to%increment = new%increment
    if (increment%last_of_step) then
      call find_free_strain(scene, increment%step, increment%position, free)
      to%strain_energy = strain_energy(scene, free, to, to%external_force)
    end if
    state = to
  end subroutine follow

  !> How far shadow runs are from the linear one, at the end of a *STEP.
  !>
  !> Of two sets of resultants of the pairs the largest difference, beside the largest of finite
  !> strain; where nothing presses in either, of the strain energies. Huge where a run was lost.
  pure subroutine compare_shadows(points, new, strain, runs, errors)
    type(contact_points_t), intent(in) :: points
    type(state_t), intent(in) :: new          !! of the linear run
    real(wp), intent(in) :: strain            !! its energy [energy]
    type(shadow_run_t), intent(in) :: runs(:)
    type(error_parts_t), intent(inout) :: errors !! gets those by theory and law
    integer :: k

    errors%follows_theory = .true.
    do k = 1, size(runs)
      errors%of_law(k) = huge(1.0_wp)
      if (runs(k)%lost_in == 0) errors%of_law(k) = apart(points, new%reaction, strain, &
        runs(k)%state)
    end do
    errors%theory = maxval(errors%of_law)
    if (size(runs) < 2) return
    errors%law = huge(1.0_wp)
    if (any(runs%lost_in > 0)) return
    errors%law = max(apart(points, runs(1)%state%reaction, runs(1)%state%strain_energy, &
      runs(2)%state), apart(points, runs(2)%state%reaction, runs(2)%state%strain_energy, &
      runs(1)%state))
  end subroutine compare_shadows

  !> How far reactions are from those of a shadow run, as a part of these.
  pure real(wp) function apart(points, reaction, strain, shadow)
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: reaction(:, :)    !! (3,n_points) x, y, z [force]
    real(wp), intent(in) :: strain            !! strain energy beside them [energy]
    type(state_t), intent(in) :: shadow
    real(wp) :: largest, change
    integer :: i

    change = 0.0_wp
    largest = 0.0_wp
    do i = 1, size(points%first) - 1
      associate (a => points%first(i), b => points%first(i + 1) - 1)
        change = max(change, norm2(sum(reaction(:, a:b) - shadow%reaction(:, a:b), dim=2)))
        largest = max(largest, norm2(sum(shadow%reaction(:, a:b), dim=2)))
      end associate
    end do
    if (max(largest, change) > 0.0_wp) then
      apart = share(change, largest)
    else
      apart = share(abs(strain - shadow%strain_energy), shadow%strain_energy)
    end if
  end function apart

  !> A part of a whole; 0 where neither is there, huge where there is no whole.
  pure real(wp) function share(part, whole)
    real(wp), intent(in) :: part, whole

    share = 0.0_wp
    if (part > 0.0_wp) share = huge(1.0_wp)
    if (whole > part*epsilon(1.0_wp)) share = part/whole
  end function share

end module shadow_run_mod
