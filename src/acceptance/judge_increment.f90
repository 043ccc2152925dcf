!> Whether an increment that has been sought may stand, how wrong it may be, and what there is to
!> say of it. Nothing is printed or written here; what there is to say goes into notes.
module judge_increment_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t
  use system_mod, only: wall_seconds
  use controls_mod, only: allowed_error
  use scene_mod, only: scene_t
  use step_contact_mod, only: added_in
  use placement_mod, only: placement_t, place_all
  use plan_mod, only: plan_t
  use cells_mod, only: hexahedron_20_of_14, hexahedron_20_reduced
  use mesh_mod, only: mesh_t, kind_c3d8
  use mesh_size_mod, only: relative_size
  use increments_mod, only: increment_t, is_extra, smallest_increment
  use state_mod, only: state_t
  use increment_report_mod, only: increment_report_t, ended_out_of_balance, ended_inverted
  use step_solver_mod, only: step_solver_t
  use jumps_mod, only: find_jump
  use step_loads_mod, only: following_at
  use stability_mod, only: stability_t, find_stability, is_hint
  use kinks_mod, only: count_between
  use settled_cycles_mod, only: followed_cycle_t
  use load_events_mod, only: first_touch, no_event
  use load_step_error_mod, only: follow_coarsely
  use choose_increment_mod, only: may_grow, grow_increments
  use geometry_error_mod, only: estimate_geometry
  use shadow_run_mod, only: shadow_solver_t, begin_shadows, is_due, follow_shadows, &
    compare_shadows, look_at_stability, is_first_due, not_unstable, is_unstable, may_be_unstable, &
    unknown_stability
  use smooth_faces_mod, only: smooth_faces_t
  use faces_between_nodes_mod, only: entries_t, face_entry_t, list_faces
  use nodes_behind_mod, only: find_node_behind
  use bodies_inside_mod, only: find_inside, fold_on_themselves, inside_t
  use passed_walls_mod, only: passed_wall
  use unfelt_overlaps_mod, only: find_unfelt_overlap, fits_of_pairs, turns_of_pairs
  use initial_overlaps_mod, only: find_deep_overlap
  use sequence_error_mod, only: says_of_steps
  use inverted_elements_mod, only: find_reach, find_inverted
  use expansion_mod, only: find_free_strain
  use bodies_mod, only: is_linear
  use law_limits_mod, only: stretched_t, find_limits, find_stretched
  use follow_points_mod, only: rounding_of_places
  use checkpoint_mod, only: progress_t, start_shadows
  use measure_increment_mod, only: is_mesh_told, estimate_mesh, measure_deformation, &
    measure_stress, bound_theory
  use refuse_unsolved_mod, only: hint_t, refuse_unsolved
  use refuse_contact_mod, only: refuse_missed_contact, refuse_unfelt_overlap, refuse_inside, &
    refuse_folded_through, refuse_deep_overlap, nearest_in_words
  use refuse_shapes_mod, only: refuse_inverted, refuse_folded, refuse_lost_law
  use refuse_energy_mod, only: refuse_lost_energy, refuse_gained_energy, refuse_jump
  use refuse_unstable_mod, only: refuse_unstable, unstable_in_words, meshes_that_buckle
  use increment_notes_mod, only: note_t, note_unheld, note_entries, note_unfelt, note_apart, &
    note_inside, note_node_behind, note_small_contacts, note_kinks, note_touch, note_redundant, &
    note_opposed_reactions, note_unusual, note_unstable, note_hourglass, note_coincident, &
    note_unknown_stability, note_lost_shadow, note_followed, note_settled, note_yielded, &
    note_past_side, note_past_table, note_grown, note_energy, note_jump, note_slow, note_turning, &
    note_given
  use yielded_bodies_mod, only: yielded_t, find_yielded
  use sector_slips_mod, only: find_past_sides
  implicit none
  private

  public :: solved_t, watch_t, begin_watch, judge_increment, least_overlap

  !> An increment and its solution.
  type :: solved_t
    type(increment_t) :: increment
    type(state_t) :: state
    type(increment_report_t) :: report
    type(entries_t) :: entries !! of obstacles into faces, where it is solved
    logical :: found = .false. !! there is such an increment: the run is not complete
    type(followed_cycle_t) :: cycle !! of loads, where it is solved
    type(hint_t) :: hint !! where it is not solved
  end type solved_t

  !> What is watched from increment to increment, for notes alone.
  type :: watch_t
    type(smooth_faces_t), allocatable :: faces(:) !! (n_pairs) slave faces
    real(wp), allocatable :: reach(:, :)
    !! (3,n_elements) of the elements' edges, as of find_reach [1/length]
    real(wp), allocatable :: limit(:)
    !! (n_materials) as of find_limits, at finite strain [-]
    real(wp), allocatable :: fit(:) !! (n_pairs) what meshes overlap by where they press [length]
    type(face_entry_t) :: deepest !! entry of the *STEP, as far as this session has run it
    character(:), allocatable :: unheld !! motions that nothing held in the increment before
    real(wp) :: most_strained = 0.0_wp
    !! largest strain energy, as far as this session has run the deck [energy]
    logical :: is_unusual = .false.     !! stretches were beyond the usual ones of a law
    type(shadow_solver_t) :: shadow     !! of the runs at finite strain beside this one
  end type watch_t

contains

  subroutine begin_watch(scene, watch)
    type(scene_t), intent(in) :: scene
    type(watch_t), intent(out) :: watch

    watch%unheld = ''
    call list_faces(scene, watch%faces)
    watch%reach = find_reach(scene%mesh)
    if (.not. is_linear(scene)) watch%limit = find_limits(scene%materials)
    call begin_shadows(scene, watch%shadow)
    watch%fit = fits_of_pairs(scene)
  end subroutine begin_watch

  !> Whether the increment may stand, how wrong it may be, and what there is to say of it.
  subroutine judge_increment(scene, plan, solver, progress, watch, solved, notes, error)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(step_solver_t), intent(inout) :: solver
    type(progress_t), intent(inout) :: progress
    type(watch_t), intent(inout) :: watch
    type(solved_t), intent(inout) :: solved     !! its report gets the errors
    type(note_t), allocatable, intent(inout) :: notes(:)
    type(error_t), allocatable, intent(out) :: error
    !! not solved, not certified, contact that the nodes do not see
    type(yielded_t), allocatable :: yielded(:)
    real(wp) :: clock
    logical :: is_dynamic

    associate (increment => solved%increment, report => solved%report, entries => solved%entries)
      call refuse_unsolved(scene, plan, solver%choices, increment, report, &
        solver%body%inverse%condition, solved%hint, error)
      is_dynamic = scene%steps(increment%step)%is_dynamic
      if (allocated(error) .and. .not. is_dynamic) call explain_by_instability(scene, plan, &
        solver, progress, solved, error)
      if (allocated(error)) return
      call refuse_folded(scene, plan%points, increment, report%certificate%folded_point, error)
      if (allocated(error)) return
      clock = wall_seconds()
      call judge_shape(scene, plan, solver%first_gap, watch%reach, progress%state, solved, error)
      if (.not. allocated(error)) call judge_laws(scene, watch, solved, notes, error)
      progress%tally%estimate_time = progress%tally%estimate_time + wall_seconds() - clock
      if (allocated(error)) return
      if (entries%at_end%depth > watch%deepest%depth) watch%deepest = entries%at_end
      call refuse_missed_contact(scene, increment, entries, error)
      if (allocated(error)) return
      call judge_overlap(scene, plan, solver%choices%tolerance, progress%state, solved, notes, &
        error)
      if (allocated(error)) return
      if (is_dynamic) call refuse_gained_energy(scene%mesh, increment, report, error)
      if (allocated(error)) return
      call estimate_errors(scene, plan, solver, solved%state, progress, entries, &
        increment%last_of_step, report)
      if (.not. is_dynamic) call measure_theory(scene, plan, solver, solved, progress, &
        watch%shadow, notes)
      call refuse_lost_energy(increment, report, error)
      if (allocated(error)) return
      if (.not. is_dynamic) call judge_path(scene, plan, solver, progress, solved, error)
      if (allocated(error)) return
      if (.not. is_dynamic) call judge_stability(scene, plan, solver, progress, solved, notes, &
        error)
      if (allocated(error)) return
      if (solved%cycle%settled > progress%cycle%settled) call note_settled(scene, increment, &
        progress%cycles, solved%cycle, report%load_cycle_change, solved%state%ends_run, notes)
      call note_unheld(increment, report, watch%unheld, notes)
      watch%most_strained = max(watch%most_strained, report%energy%strain)
      if (increment%last_of_step) then
        if (is_dynamic) then
          call note_energy(increment, report%energy, solved%state%largest_energy, notes)
          call note_slow(increment, solved%state, notes)
          if (scene%finite_strain) call note_turning(increment, solver%own_mass, &
            report%energy%turned, notes)
        else if (scene%finite_strain) then
          call note_given(increment, report%energy, watch%most_strained, notes)
        end if
        call note_redundant(scene, plan%points, increment, report, notes)
        call note_coincident(scene, plan%points, solver%choices%tolerance, increment, &
          solver%body%prescribed, solved%state, report, notes)
        if (.not. is_dynamic) call note_opposed_reactions(scene, plan%points, solver%first_gap, &
          increment, solved%state, report, notes)
        call note_small_contacts(scene, plan%points, increment, solver%body%prescribed, report, &
          notes)
        call note_entries(scene, increment, watch%deepest, notes)
        call note_grown(scene, increment, notes)
        call note_apart(scene, plan%points, increment, report, least_overlap(scene, &
          solver%choices%tolerance, solved%state%displacement), notes)
        if (scene%finite_strain) call note_past_side(scene, plan%points, increment, &
          find_past_sides(scene, plan%points, solved%state%displacement), notes)
        call note_past_table(scene, increment, solved%state%displacement, notes)
        call note_node_behind(scene, increment, find_node_behind(scene, plan%points, &
          solved%state, least_overlap(scene, solver%choices%tolerance, &
          solved%state%displacement)), notes)
        watch%deepest = face_entry_t()
        if (any(scene%materials%yield > 0.0_wp)) then
          call find_yielded(scene, solved%state, yielded)
          call note_yielded(scene, increment, yielded, notes)
        end if
      end if
      call count_events(scene, plan, solver, increment, progress, notes)
    end associate
  end subroutine judge_increment

  !> Elements that are inside out end the run, and so do bodies that are deeper in one another than
  !> an element as the run begins, or as a pair is added.
  subroutine judge_shape(scene, plan, first_gap, reach, old, solved, error)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    real(wp), intent(in) :: first_gap(:) !! (n_points) of the undeformed mesh [length]
    real(wp), intent(in) :: reach(:, :)  !! as of watch_t
    type(state_t), intent(in) :: old     !! where the increment begins
    type(solved_t), intent(in) :: solved
    type(error_t), allocatable, intent(out) :: error
    type(placement_t) :: began
    logical :: is_added(size(scene%pairs))
    real(wp) :: gap(size(first_gap)), least
    integer :: element, point

    call find_inverted(scene%mesh, reach, solved%state%displacement, element, least)
    if (element > 0) then
      call refuse_inverted(scene, solved%increment, element, least, error)
      return
    end if
    if (solved%increment%index == 1) then
      gap = first_gap
      ! What is allowed of it for a time is an overlap all the same.
      if (allocated(plan%points%overlap)) gap = min(gap, -plan%points%overlap)
    else if (solved%increment%first_of_step .and. any(added_in(scene, solved%increment%step))) then
      call place_all(scene, plan%points, old%displacement, began, old%rotation)
      is_added = added_in(scene, solved%increment%step)
      gap = merge(began%gap, 0.0_wp, is_added(plan%points%pair))
    else
      return
    end if
    associate (mesh_size => plan%choices%mesh_size)
      call find_deep_overlap(scene, plan%points, solved%report%contact, gap, &
        relative_size(mesh_size)*0.5_wp**mesh_size%zone%times, point, element)
    end associate
    if (point > 0) call refuse_deep_overlap(scene, plan%points, solved%increment, point, &
      -gap(point), element, error)
  end subroutine judge_shape

  !> A law that has lost its ellipticity ends the run; of stretches that it is not used for there is
  !> something to say, the first time.
  subroutine judge_laws(scene, watch, solved, notes, error)
    type(scene_t), intent(in) :: scene
    type(watch_t), intent(inout) :: watch
    type(solved_t), intent(in) :: solved
    type(note_t), allocatable, intent(inout) :: notes(:)
    type(error_t), allocatable, intent(out) :: error
    type(stretched_t) :: lost, unusual
    real(wp) :: free(scene%mesh%n_elements)

    if (.not. allocated(watch%limit)) return
    call find_free_strain(scene, solved%state%step, solved%state%position, free)
    call find_stretched(scene%mesh, scene%materials, watch%limit, watch%reach, free, &
      solved%state%displacement, lost, unusual)
    if (lost%element > 0) then
      call refuse_lost_law(scene, solved%increment, lost, error)
    else if (unusual%element > 0 .and. .not. watch%is_unusual) then
      watch%is_unusual = .true.
      call note_unusual(scene, solved%increment, unusual, notes)
    end if
  end subroutine judge_laws

  !> Surfaces that overlap, or bodies inside each other, where nothing presses: a contact that is
  !> missed, or something to say.
  subroutine judge_overlap(scene, plan, tolerance, old, solved, notes, error)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    real(wp), intent(in) :: tolerance !! of contact [-]
    type(state_t), intent(in) :: old  !! where the increment began
    type(solved_t), intent(in) :: solved
    type(note_t), allocatable, intent(inout) :: notes(:)
    type(error_t), allocatable, intent(out) :: error
    type(face_entry_t) :: unfelt
    type(inside_t) :: inside, in_mesh
    real(wp), allocatable :: places(:, :) !! (3,n_nodes) of faces [length]
    real(wp) :: allowed(size(scene%pairs)) !! [length]
    real(wp) :: least                      !! [length]
    logical :: is_missed, folds(scene%mesh%n_pieces)
    integer :: passed !! node

    associate (u => solved%state%displacement, increment => solved%increment)
      least = least_overlap(scene, tolerance, u)
      ! Within a *STEP surfaces may be on their way to each other's nodes.
      if (increment%last_of_step) then
        places = scene%mesh%coordinates
        allowed = least
        if (is_linear(scene)) then
          allowed = allowed + turns_of_pairs(scene, u)
        else
          places = places + u
        end if
        call find_unfelt_overlap(scene, plan%points, solved%report%contact, places, allowed, &
          unfelt, is_missed)
        if (is_missed) then
          call refuse_unfelt_overlap(scene, increment, unfelt, error)
          return
        end if
        call note_unfelt(scene, increment, unfelt, notes)
      end if
      ! Within a *STEP none is on its way where everything may touch, or a body itself: what is
      ! inside has passed a surface.
      folds = fold_on_themselves(scene, plan%points)
      if (any(folds)) then
        passed = passed_wall(scene%mesh, old%displacement, u, folds)
        if (passed > 0) then
          call refuse_folded_through(scene, increment, passed, error)
          return
        end if
      end if
      if (.not. (any(folds) .or. allocated(scene%may_overlap) .or. increment%last_of_step)) return
      call find_inside(scene, plan%points, solved%report%contact, u, least, &
        increment%last_of_step, inside, in_mesh)
      if (increment%step == 1 .and. increment%last_of_step .and. in_mesh%node > 0) call &
        note_inside(scene, increment, in_mesh, notes, ', in the mesh of the deck already')
      if (inside%node == 0) return
      if (allocated(scene%may_overlap) .or. inside%pair > 0 .or. (folds(inside%piece) .and. &
        scene%mesh%piece(inside%node) == inside%piece)) then
        call refuse_inside(scene, increment, inside, error)
      else if (increment%last_of_step) then
        call note_inside(scene, increment, inside, notes)
      end if
    end associate
  end subroutine judge_overlap

  !> An overlap that is more than what tolerance and rounding leave.
  pure real(wp) function least_overlap(scene, tolerance, u) result(allowed)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: tolerance !! of contact [-]
    real(wp), intent(in) :: u(:, :) !! (3,n_nodes) [length]

    allowed = 10.0_wp*tolerance*maxval(abs(u)) + rounding_of_places(scene, u)
  end function least_overlap

  !> What was not solved may have had no stable equilibrium to begin with.
  subroutine explain_by_instability(scene, plan, solver, progress, solved, error)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(step_solver_t), intent(in) :: solver
    type(progress_t), intent(in) :: progress !! before the increment
    type(solved_t), intent(in) :: solved
    type(error_t), allocatable, intent(inout) :: error
    real(wp), parameter :: rolled_in = 0.1_wp !! of the distance in the mesh, that is left [-]
    type(stability_t) :: stability
    character(:), allocatable :: is, what

    associate (begin => solved%increment%begin)
      call find_stability(scene, plan%points, solver, progress%state, following_at(scene, &
        solver%response%loads, begin, begin*scene%steps(solved%increment%step)%period), stability)
    end associate
    is = 'is'
    if (is_hint(stability)) is = 'may be'
    if (stability%n_unstable > 0) then
      error%message = error%message//new_line('a')// &
        '  The equilibrium where this increment begins '//is//' unstable'// &
        unstable_in_words(stability)
      if (.not. is_hint(stability)) error%n_meshes = meshes_that_buckle(scene%mesh)
    else if (.not. is_linear(scene) .and. any(solved%report%ending%cause == [ended_out_of_balance, &
      ended_inverted]) .and. is_extra(solved%increment%position)) then
      what = 'there is'
      if (stability%slides) what = 'friction leaves'
      error%message = error%message//new_line('a')// &
        '  If smaller increments do not help, '//what//' no equilibrium nearby, and the '// &
        'body would jump to another one'
      error%message = error%message//nearest_in_words(scene, find_node_behind(scene, &
        plan%points, progress%state, rounding_of_places(scene, progress%state%displacement), &
        near=rolled_in))
      error%n_meshes = 2
    end if
  end subroutine explain_by_instability

  !> At finite strain a solution that jumps within the increment ends the run.
  subroutine judge_path(scene, plan, solver, progress, solved, error)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(step_solver_t), intent(inout) :: solver
    type(progress_t), intent(inout) :: progress !! before the increment; its tally
    type(solved_t), intent(in) :: solved
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: lost, clock

    clock = wall_seconds()
    call find_jump(scene, plan%points, solver, progress%state, solved%state, solved%increment, &
      lost)
    progress%tally%estimate_time = progress%tally%estimate_time + wall_seconds() - clock
    if (abs(lost) > 0.0_wp) call refuse_jump(solved%increment, lost, solved%report%energy%strain, &
      error)
  end subroutine judge_path

  !> An equilibrium that is unstable at the end of a *STEP ends the run; it is a note where what is
  !> left out of the tangent may hold it.
  subroutine judge_stability(scene, plan, solver, progress, solved, notes, error)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(step_solver_t), intent(in) :: solver
    type(progress_t), intent(inout) :: progress !! its tally
    type(solved_t), intent(in) :: solved
    type(note_t), allocatable, intent(inout) :: notes(:)
    type(error_t), allocatable, intent(out) :: error
    type(stability_t) :: stability
    real(wp) :: clock

    if (.not. solved%increment%last_of_step) return
    clock = wall_seconds()
    call find_stability(scene, plan%points, solver, solved%state, following_at(scene, &
      solver%response%loads, solved%increment%fraction, solved%increment%step_time), stability)
    progress%tally%estimate_time = progress%tally%estimate_time + wall_seconds() - clock
    if (.not. stability%is_known) call note_unknown_stability(solved%increment, notes)
    if (stability%n_hourglass > 0) call note_hourglass(solved%increment, stability, notes)
    if (stability%n_unstable == 0) return
    if (is_hint(stability)) then
      call note_unstable(solved%increment, stability, notes)
    else
      call refuse_unstable(scene%mesh, solved%increment, stability, error)
    end if
  end subroutine judge_stability

  !> Count the events of the load path that the increment ends at or goes across; note what a *STEP
  !> goes across, the first time.
  subroutine count_events(scene, plan, solver, increment, progress, notes)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(step_solver_t), intent(in) :: solver
    type(increment_t), intent(in) :: increment
    type(progress_t), intent(inout) :: progress !! before the increment; its tally counts
    type(note_t), allocatable, intent(inout) :: notes(:)
    integer :: n_inside

    if (scene%steps(increment%step)%is_dynamic) then
      if (count_between(solver%response%loads%jumps, increment%start + smallest_increment, &
        increment%position - smallest_increment) == 0) return
      if (progress%touched_in /= increment%step) call note_jump(increment, notes)
      progress%touched_in = increment%step
      return
    end if
    associate (kinks => solver%response%loads%kinks, tally => progress%tally)
      if (is_extra(increment%position) .and. increment%position == progress%size%event) then
        tally%at_events = tally%at_events + 1
      end if
      n_inside = count_between(kinks, increment%start, increment%position)
      if (n_inside > 0 .and. .not. any(kinks <= increment%start)) call note_kinks(scene, &
        increment, kinks, notes)
      tally%kinks_inside = tally%kinks_inside + n_inside
      if (first_touch(scene, plan%points, solver, progress%state, increment%step, &
        increment%start, increment%position) == no_event) return
      tally%touches_inside = tally%touches_inside + 1
      if (progress%touched_in == increment%step) return
      progress%touched_in = increment%step
      call note_touch(increment, scene%steps(increment%step)%direct, notes)
    end associate
  end subroutine count_events

  !> How wrong the increment is.
  subroutine estimate_errors(scene, plan, solver, new, progress, entries, is_last, report)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(step_solver_t), intent(inout) :: solver
    type(state_t), intent(in) :: new
    type(progress_t), intent(inout) :: progress
    type(entries_t), intent(in) :: entries !! of obstacles between the nodes
    logical, intent(in) :: is_last         !! of its *STEP
    type(increment_report_t), intent(inout) :: report
    real(wp) :: clock
    logical :: says_it, is_told, is_compared

    clock = wall_seconds()
    associate (c => report%certificate)
      report%errors%contact = max(c%penetration, c%adhesion, c%complementarity, c%cone, c%law)
    end associate
    report%errors%arithmetic = report%imbalance + epsilon(1.0_wp)*solver%body%inverse%condition
    ! Contact alone says nothing of what increments of other lengths would do with inertia.
    says_it = scene%accuracy%estimates .and. .not. scene%steps(new%step)%is_dynamic
    ! The contact problem is the increment's own until runs go beside it.
    if (says_it .and. is_last) call estimate_geometry(scene, plan%points, solver, new, &
      entries, report)
    if (allocated(progress%sequence)) says_it = says_it .and. says_of_steps(progress%sequence)
    if (says_it) call follow_coarsely(scene, plan%points, solver, progress%state, new, &
      progress%coarse, report)
    is_told = is_mesh_told(scene, new)
    is_compared = may_grow(scene, new%step) .and. report%errors%load_steps > 0.0_wp
    if (is_told .or. is_compared) call estimate_mesh(scene, plan%points, new, report)
    if (is_told .and. is_conforming(scene%mesh)) report%errors%too_stiff = report%errors%mesh
    ! docs/theory.md (10.8)
    if (report%errors%mesh >= 0.0_wp .and. report%energy%strain > 0.0_wp) report%errors%mesh = &
      max(report%errors%mesh, entries%work/(2.0_wp*report%energy%strain))
    call grow_increments(scene, new%step, report%errors, progress%size)
    if (.not. is_told) report%errors%mesh = -1.0_wp
    call measure_deformation(scene, new, report)
    progress%tally%estimate_time = progress%tally%estimate_time + wall_seconds() - clock
  end subroutine estimate_errors

  !> Whether displacements are continuous and energies fully integrated: no element is softer than
  !> its body then.
  pure logical function is_conforming(mesh)
    type(mesh_t), intent(in) :: mesh

    is_conforming = all(mesh%element_kind == kind_c3d8 .and. mesh%connectivity%cell /= &
      hexahedron_20_reduced .and. mesh%connectivity%cell /= hexahedron_20_of_14)
  end function is_conforming

  !> How far small strain is from finite strain, at the end of a *STEP: bounded, or by runs that go
  !> beside this one.
  subroutine measure_theory(scene, plan, solver, solved, progress, shadow, notes)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(step_solver_t), intent(inout) :: solver
    type(solved_t), intent(inout) :: solved      !! its report gets the error
    type(progress_t), intent(inout) :: progress  !! before the increment; its shadow runs follow
    type(shadow_solver_t), intent(inout) :: shadow
    type(note_t), allocatable, intent(inout) :: notes(:)
    real(wp) :: clock
    integer :: k

    clock = wall_seconds()
    shadow%stability = not_unstable
    shadow%begun = progress%begun
    call begin_late()
    associate (report => solved%report, is_last => solved%increment%last_of_step, &
        wanted => scene%accuracy%wanted)
      if (size(progress%shadows) > 0) then
        if (is_due(scene, solver, progress%state, solved%state)) call follow_shadows(scene, &
          plan%points, progress%state, solved%state, progress%followed, solver, shadow, &
          progress%shadows)
        do k = 1, size(progress%shadows)
          if (progress%shadows(k)%lost_in /= solved%increment%index) cycle
          call note_lost_shadow(solved%increment, shadow%stability, k > 1, notes)
          if (any(shadow%stability == [is_unstable, may_be_unstable])) exit ! all are
        end do
        if (is_last) call compare_shadows(plan%points, progress%followed, report%energy%strain, &
          progress%shadows, report%errors)
        if (is_last) call measure_stress(scene, solved%state, report)
      else if (is_linear(scene)) then
        if (is_last) call bound_theory(scene, plan%points, solver, solved%increment, &
          solved%state, report, report%errors%theory)
        ! A bound that an accuracy is to count is one of a stable equilibrium.
        if (is_last .and. scene%accuracy%chooses_theory .and. report%errors%theory <= &
          allowed_error(wanted)) then
          call look_at_stability(plan%points, solver, solved%state, solved%increment, shadow)
          if (any(shadow%stability == [is_unstable, may_be_unstable])) then
            report%errors%theory = huge(1.0_wp)
            call note_lost_shadow(solved%increment, shadow%stability, .false., notes)
          end if
        end if
      else if (is_last) then
        report%errors%theory = 0.0_wp
      end if
    end associate
    if (shadow%stability == unknown_stability) call note_unknown_stability(solved%increment, notes)
    progress%tally%estimate_time = progress%tally%estimate_time + wall_seconds() - clock

  contains

    !> Let shadow runs begin where they are cheap, and the bound foretells that small strain will be
    !> far off at the end of the first *STEP: from there on an estimate takes its place.
    subroutine begin_late()
      real(wp), parameter :: far_off = 0.2_wp
      real(wp) :: bound

      if (.not. plan%may_follow_theory .or. size(progress%shadows) > 0) return
      if (.not. is_first_due(scene, solver, progress%state, solved%state)) return
      call bound_theory(scene, plan%points, solver, solved%increment, solved%state, solved%report, &
        bound)
      if (bound <= far_off*solved%increment%fraction) return
      call start_shadows(scene, plan%points%n, size(shadow%law, 2), progress)
      call note_followed(solved%increment, far_off, notes)
    end subroutine begin_late

  end subroutine measure_theory

end module judge_increment_mod
