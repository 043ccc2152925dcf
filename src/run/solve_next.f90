!> The next increment of a run: how large it is, and its solution, sought again by other means where
!> it is not found. Nothing is printed or written here; what there is to say goes into notes.
module solve_next_mod
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t, exit_not_solved
  use system_mod, only: wall_seconds, stop_if_signalled
  use controls_mod, only: take_double
  use scene_mod, only: scene_t
  use plan_mod, only: plan_t
  use increments_mod, only: increment_t, next_increment, count_increments
  use state_mod, only: state_t, keep_tangent
  use increment_report_mod, only: increment_report_t, is_solved, ended_out_of_reach, ended_passed, &
    ended_unbalanced, ended_indefinite, cycle_settled
  use contact_interface_mod, only: reach_everything
  use make_plan_mod, only: revise_plan
  use load_response_mod, only: sum_patterns
  use linearisation_mod, only: invalidate
  use step_solver_mod, only: step_solver_t, place_first, widen_interface, take_tangent
  use balance_together_mod, only: is_together, keeps_tangent
  use trial_mod, only: goal_t, near_its_end
  use advance_mod, only: advance, advance_along
  use contact_points_mod, only: contact_points_t
  use look_ahead_mod, only: forget_ahead
  use choose_increment_mod, only: choose_increment, pass_touch, cut_increment, grow_in_time
  use increments_in_time_mod, only: is_too_long, shortest_in_time
  use faces_between_nodes_mod, only: find_entries
  use unfelt_overlaps_mod, only: find_entered_faces
  use passed_faces_mod, only: find_passed_faces
  use follow_points_mod, only: rounding_of_places
  use own_sides_mod, only: list_own_sides, renew_own_sides
  use step_loads_mod, only: prescribed_dofs
  use tally_mod, only: note_sizes
  use transfer_mod, only: note_freedom
  use settled_cycles_mod, only: follow_cycle
  use interference_mod, only: has_interference, set_extra_gap
  use checkpoint_mod, only: progress_t
  use enter_step_mod, only: enter_step
  use refuse_unsolved_mod, only: next_tolerance
  use increment_notes_mod, only: note_t, note_unsolved, note_started, note_widened, note_passed, &
    note_turn, note_double, note_too_long
  use judge_increment_mod, only: solved_t, watch_t, least_overlap
  implicit none
  private

  public :: solve_next

  integer, parameter :: few = 8, longer = 3
  !! evaluations of internal forces in an increment, and beyond the first with the same factor, from
  !! which on another factor pays: of the paper's block, a soft one, a ball and ironing

contains

  !> Solve the next increment, where there is one. Whether it is solved, the report says.
  !>
  !> Where it is not, or something passes within it, this is tried, in this order, and no more:
  !>
  !>   1. every slave node a candidate, where one got further than planned (`advance_or_widen`);
  !>   2. a factor in double precision;
  !>   3. at finite strain the tangent where the increment begins;
  !>   4. a later end, if it was to end where something touches first; else half of it;
  !>   5. an increment that the deck keeps whole, from where its parts lead.
  !>
  !> Within one try `advance` asks for a smaller residual where the certificate does, begins without
  !> extrapolation, and with all points in reach, where these lead nowhere. Which test needs what:
  !> docs/developers.md.
  subroutine solve_next(scene, plan, solver, progress, watch, solved, notes, error)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(inout) :: plan
    !! revised where a point gets further than it says, or for a factor in double precision
    type(step_solver_t), intent(inout) :: solver !! its precision, where single does not do
    type(progress_t), intent(inout) :: progress    !! its sizes, *STEP and tally
    type(watch_t), intent(in) :: watch
    type(solved_t), intent(out) :: solved
    type(note_t), allocatable, intent(inout) :: notes(:)
    type(error_t), allocatable, intent(out) :: error
    !! stopped by a signal; as of set_supports, prepare_step and advance
    logical :: is_plain !! so are the increments after it: one may look ahead
    logical :: is_another !! there is another way to try
    logical :: passes !! an obstacle does, a point or a face
    integer, parameter :: most_tries = 100 !! parts, tangents, precisions: more than there are
    integer :: tries

    associate (increment => solved%increment)
      increment = next_increment(scene%steps, progress%state)
      solved%found = increment%index > 0
      if (.not. solved%found) return
      if (increment%step /= progress%entered) then
        call enter_step(scene, plan, increment, progress, solver, error)
        call try_double(is_another)
        if (allocated(error)) return
        if (increment%first_of_step) call note_turn(scene, increment, notes)
      end if
      call follow_own_sides(scene, plan%points, increment%step, solver, progress)
      if (solver%body%made_after /= progress%state%tangent_of) call take_tangent(scene, &
        plan%points, progress%state, solver, is_another, error)
      if (allocated(error)) return
      do tries = 1, most_tries
        call stop_if_signalled(error)
        if (allocated(error)) return
        call choose_increment(scene, plan%points, solver, progress%state, progress%cycles, &
          progress%size, increment, is_plain)
        ! What looks at the end takes the gaps of the plan's points.
        call set_extra_gap(scene, increment%step, increment%position, plan%points)
        call advance_or_widen(scene, plan, solver, progress, is_plain, solved, notes, error)
        call try_double(is_another, solved%report)
        if (allocated(error)) return
        if (is_another) cycle
        call try_tangent(is_another)
        if (allocated(error)) return
        if (is_another) cycle
        call note_sizes(solver, progress%tally)
        passes = solved%report%ending%cause == ended_passed
        if (is_solved(scene, solved%report)) then
          call look_between_ends(scene, plan, solver%choices%tolerance, watch, progress, solved)
          passes = solved%entries%passed%depth > 0.0_wp
          if (.not. passes) then
            call follow_time(scene, plan, progress, solved, notes, is_another)
            if (is_another) cycle
            return
          end if
        end if
        call try_other_end(is_another)
        if (is_another) cycle
        if (.not. passes) call try_whole()
        return
      end do
    end associate

  contains

    !> Enter the *STEP again, with a factor in double precision for the rest of the run, where that
    !> may solve what is not solved.
    subroutine try_double(is_another, report)
      logical, intent(out) :: is_another
      type(increment_report_t), intent(in), optional :: report !! where an increment was tried

      is_another = needs_double(scene, solver, error, report)
      if (is_another) call turn_to_double(scene, plan, solved%increment, solver, progress, notes, &
        error)
    end subroutine try_double

    !> At finite strain another tangent's factor.
    subroutine try_tangent(is_another)
      logical, intent(out) :: is_another
      logical :: is_to_repeat

      is_another = .false.
      if (.not. keeps_tangent(scene, solver)) return
      call follow_tangent(scene, solver, progress%state, solved, is_to_repeat)
      if (is_to_repeat) call take_tangent(scene, plan%points, progress%state, solver, is_another, &
        error)
    end subroutine try_tangent

    !> Another end of the increment: later where it was to end at a first touch, or half of it.
    subroutine try_other_end(is_another)
      logical, intent(out) :: is_another
      logical :: is_later !! it goes beyond the first touch

      associate (increment => solved%increment)
        is_later = .false.
        if (.not. passes) call pass_touch(increment, progress%size, is_later)
        is_another = is_later
        if (.not. is_another) then
          if (fails_at_any_size(scene, plan%points, solver, progress%state, solved)) return
          call cut_increment(scene, increment, progress%size, is_another)
          if (.not. is_another) return
          progress%tally%cuts = progress%tally%cuts + 1
        end if
        if (passes) then
          call note_passed(scene, plan%points, increment, solved%report%ending%point, &
            solved%entries%passed, notes)
        else
          call note_unsolved(increment, is_later, notes)
        end if
      end associate
    end subroutine try_other_end

    !> What the deck keeps whole, from where its parts lead; else the tolerance that it would meet.
    subroutine try_whole()
      call start_from_parts(scene, plan, solver, progress%state, solved)
      if (is_solved(scene, solved%report)) then
        call look_between_ends(scene, plan, solver%choices%tolerance, watch, progress, solved)
        call note_started(solved%increment, notes)
      else
        call try_tolerance(scene, plan, solver, progress%state, solved)
      end if
    end subroutine try_whole

  end subroutine solve_next

  !> The end of an increment, as the run is to come to it.
  pure type(goal_t) function goal_of(solver, increment) result(goal)
    type(step_solver_t), intent(in) :: solver
    type(increment_t), intent(in) :: increment

    goal = goal_t(increment, solver%choices%tolerance, &
      shows_progress=solver%choices%shows_progress)
  end function goal_of

  !> The sides that surfaces which touch themselves have where the increment begins.
  subroutine follow_own_sides(scene, points, step, solver, progress)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(inout) :: points
    integer, intent(in) :: step
    type(step_solver_t), intent(inout) :: solver !! gets the points in the undeformed mesh
    type(progress_t), intent(inout) :: progress
    logical :: are_others

    if (.not. allocated(points%own_sides)) return
    call renew_own_sides(scene, points, progress%state%displacement, progress%state%reaction, &
      are_others)
    if (.not. are_others) return
    call note_freedom(scene, prescribed_dofs(scene, step), points)
    call place_first(scene, points, solver)
    call forget_ahead(progress%ahead)
    progress%own_sides = list_own_sides(points)
  end subroutine follow_own_sides

  !> In a dynamic *STEP: cut an increment that is solved, but too long; else say how long the next
  !> is to be.
  subroutine follow_time(scene, plan, progress, solved, notes, is_cut)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(progress_t), intent(inout) :: progress !! its sizes and tally
    type(solved_t), intent(in) :: solved
    type(note_t), allocatable, intent(inout) :: notes(:)
    logical, intent(out) :: is_cut

    is_cut = .false.
    associate (increment => solved%increment, error => solved%report%in_time)
      associate (step => scene%steps(increment%step))
        if (step%direct .or. .not. step%is_dynamic) return
      end associate
      if (is_too_long(error, plan%choices%divisions)) then
        if (increment%position - increment%start >= 2*shortest_in_time(scene, plan%points, &
          increment%step, plan%choices%divisions)) call cut_increment(scene, increment, &
          progress%size, is_cut)
        if (is_cut) then
          progress%tally%cuts = progress%tally%cuts + 1
          return
        end if
        if (progress%too_long_in /= increment%step) call note_too_long(scene, increment, error, &
          notes)
        progress%too_long_in = increment%step
      end if
      call grow_in_time(increment, error, plan%choices%divisions, progress%size)
    end associate
  end subroutine follow_time

  !> At finite strain: which tangent's factor serves. Where an increment is not solved with one of
  !> elsewhere, that of its beginning, with which it is to be solved again. Where it is, but took
  !> notably longer than the first one with the same factor, that of its end, for those that follow.
  !> Nothing is left out of a tangent as long as it is positive definite and leads somewhere.
  subroutine follow_tangent(scene, solver, old, solved, is_to_repeat)
    type(scene_t), intent(in) :: scene
    type(step_solver_t), intent(in) :: solver
    type(state_t), intent(inout) :: old       !! where the increment began
    type(solved_t), intent(inout) :: solved
    logical, intent(out) :: is_to_repeat

    is_to_repeat = .false.
    associate (report => solved%report, new => solved%state)
      if (.not. is_solved(scene, report)) then
        ! With tangents of its own it would fail as it did.
        if (is_together(scene, solver)) return
        is_to_repeat = report%ending%cause /= ended_passed .and. (old%tangent_of /= &
          old%increments_done .or. (old%tangent_of > 0 .and. old%tangent_projection < 1.0_wp))
        if (.not. is_to_repeat) return
        if (old%tangent_of == old%increments_done) old%tangent_projection = 1.0_wp
        call keep_tangent(old)
      else if (new%first_forces == 0) then
        new%first_forces = report%force_evaluations + min(report%products, few)
      else if (report%force_evaluations + report%products > max(few, new%first_forces + &
        longer)) then
        call keep_tangent(new)
        ! A run that is continued here begins with the deck's.
        if (allocated(solver%body%inertia)) new%tangent_dt = solver%body%inertia%dt
      end if
    end associate
  end subroutine follow_tangent

  !> What obstacles do to faces between the increment's ends, and at them.
  subroutine look_between_ends(scene, plan, tolerance, watch, progress, solved)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    real(wp), intent(in) :: tolerance !! of contact [-]
    type(watch_t), intent(in) :: watch
    type(progress_t), intent(inout) :: progress !! its tally
    type(solved_t), intent(inout) :: solved     !! gets the entries
    real(wp) :: clock

    clock = wall_seconds()
    call follow_cycle_end(scene, plan%points, tolerance, progress, solved)
    solved%entries%is_seen = progress%seen(1, :) > 0.0_wp
    call find_entries(scene, plan%points, watch%faces, tolerance, progress%state, solved%state, &
      solved%increment%last_of_step, solved%entries)
    call find_entered_faces(scene, plan%points, solved%report%contact, watch%fit, &
      least_overlap(scene, tolerance, solved%state%displacement), rounding_of_places(scene, &
      solved%state%displacement), solved%entries)
    call find_passed_faces(scene, plan%points, progress%state, solved%state, watch%fit, &
      least_overlap(scene, tolerance, solved%state%displacement), solved%entries)
    progress%tally%estimate_time = progress%tally%estimate_time + wall_seconds() - clock
    solved%report%face_penetration = solved%entries%at_end%depth
    solved%report%face_penetration_on_way = solved%entries%on_way%depth
  end subroutine look_between_ends

  !> Compare the end of a load cycle with that of the cycle before. Where it has settled, and the
  !> deck goes on with nothing else, a run that is to stop there ends with this increment.
  subroutine follow_cycle_end(scene, points, tolerance, progress, solved)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: tolerance !! of contact [-]
    type(progress_t), intent(in) :: progress
    type(solved_t), intent(inout) :: solved

    solved%cycle = progress%cycle
    call follow_cycle(scene, points, progress%cycles, tolerance, progress%state, solved%state, &
      solved%cycle, solved%report)
    if (.not. scene%stops_when_steady .or. solved%report%load_cycle /= cycle_settled) return
    associate (cycles => progress%cycles)
      if (cycles%last < count_increments(scene%steps)) return
      if (cycles%first + solved%cycle%n_ends*cycles%length >= cycles%last) return
    end associate
    solved%increment%last_of_step = .true.
    solved%state%ends_run = .true.
  end subroutine follow_cycle_end

  !> Whether parts of an increment would fail as it does.
  !>
  !> They do where an obstacle is inside the body already; and where loads and prescribed motions
  !> grow in proportion from an undeformed body, contact does not curve, and nothing overlaps: then
  !> a part of the loads has a part of the reactions.
  logical function fails_at_any_size(scene, points, solver, old, solved) result(fails)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    type(state_t), intent(in) :: old
    type(solved_t), intent(in) :: solved  !! not solved
    real(wp), allocatable, dimension(:, :) :: u, of_half, force, force_of_half
    real(wp) :: middle

    ! Or a tangent that is not positive definite where the increment begins.
    fails = solved%report%ending%cause == ended_indefinite .and. &
      solved%report%newton_raphson_iterations == 0
    if (solved%report%ending%cause == ended_passed) fails = &
      solved%report%ending%part_to_try >= 1.0_wp
    if (solved%report%ending%cause /= ended_unbalanced .or. any(points%is_curved)) return
    if (maxval(abs(old%displacement)) > 0.0_wp) return
    if (has_interference(scene) .or. any(solver%first_gap < 0.0_wp .and. points%in_reach)) return
    associate (response => solver%response, increment => solved%increment)
      middle = 0.5_wp*(increment%begin + increment%fraction)
      call sum_patterns(scene, response, increment%fraction, increment%step_time, u, force)
      call sum_patterns(scene, response, middle, middle*scene%steps(increment%step)%period, &
        of_half, force_of_half)
    end associate
    fails = is_half(of_half, u) .and. is_half(force_of_half, force)

  contains

    pure logical function is_half(half, all)
      real(wp), intent(in) :: half(:, :), all(:, :)

      is_half = maxval(abs(2.0_wp*half - all)) <= 64.0_wp*epsilon(1.0_wp)*maxval(abs(all))
    end function is_half

  end function fails_at_any_size

  !> Seek the solution of an increment that the deck keeps whole from where its parts lead.
  !>
  !> Where much slides or turns in one increment, contact placed where it begins may have no
  !> solution that is near. That of its parts is of another way, but near: a start, and no more.
  subroutine start_from_parts(scene, plan, solver, old, solved)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(step_solver_t), intent(inout) :: solver
    type(state_t), intent(in) :: old
    type(solved_t), intent(inout) :: solved  !! not solved; replaced where it is
    integer(i8), parameter :: most_parts = 16
    type(state_t) :: reached
    type(goal_t) :: goal
    type(solved_t) :: part
    type(increment_report_t) :: report
    type(error_t), allocatable :: failure
    integer(i8) :: length, left
    logical :: is_done, is_to_repeat, is_taken, is_kept

    associate (increment => solved%increment)
      if (.not. scene%steps(increment%step)%direct) return
      ! Parts of an increment in time have another scheme.
      if (scene%steps(increment%step)%is_dynamic) return
      if (solved%report%ending%cause == ended_out_of_reach) return
      ! What nothing balances may be a matter of where curved obstacles and surfaces were met.
      if (solved%report%ending%cause == ended_unbalanced .and. .not. &
        any(plan%points%is_curved)) return
      is_kept = keeps_tangent(scene, solver)
      left = increment%position - increment%start
      length = left/2
      reached = old
      do while (left > 0)
        call advance(scene, plan%points, solver, reached, goal_of(solver, next_increment( &
          scene%steps, reached, min(length, left))), part%state, part%report, failure)
        if (allocated(failure)) return
        is_done = is_solved(scene, part%report)
        if (is_kept) then
          call follow_tangent(scene, solver, reached, part, is_to_repeat)
          is_taken = .false.
          if (is_to_repeat) call take_tangent(scene, plan%points, reached, solver, is_taken, &
            failure)
          if (allocated(failure)) return
          if (is_taken) cycle
        end if
        if (is_done) then
          reached = part%state
          left = left - min(length, left)
          if (is_kept .and. solver%body%made_after /= reached%tangent_of) call &
            take_tangent(scene, plan%points, reached, solver, is_taken, failure)
          if (allocated(failure)) return
        else if (length*most_parts > increment%position - increment%start) then
          length = length/2
        else
          return
        end if
      end do
      solved%hint%parts = int((increment%position - increment%start - 1)/length) + 1
      if (is_kept) then
        ! Of where the solution is: slender bodies that turn in an increment want no other.
        call keep_tangent(reached)
        call take_tangent(scene, plan%points, reached, solver, is_taken, failure)
        if (allocated(failure)) return
      end if
      goal = goal_of(solver, increment)
      goal%start = near_its_end
      call advance(scene, plan%points, solver, old, goal, reached, report, failure)
      if (allocated(failure)) return
      if (.not. is_solved(scene, report)) return
      ! The parts have numbered their tangents as increments to come.
      if (is_kept) call keep_tangent(reached)
      solver%body%made_after = merge(-1, solver%body%made_after, is_kept)
      report%wall_time = report%wall_time + solved%report%wall_time
      solved%state = reached
      solved%report = report
    end associate
  end subroutine start_from_parts

  !> Whether the increment is solved with the tolerance that it seems to meet.
  subroutine try_tolerance(scene, plan, solver, old, solved)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(step_solver_t), intent(inout) :: solver
    type(state_t), intent(in) :: old
    type(solved_t), intent(inout) :: solved    !! gets the tolerance, if it is
    type(state_t) :: state
    type(increment_report_t) :: report
    type(error_t), allocatable :: failure
    type(goal_t) :: goal

    goal = goal_of(solver, solved%increment)
    goal%tolerance = next_tolerance(solved%report, solver%choices%tolerance)
    if (.not. goal%tolerance > 0.0_wp) return
    call advance(scene, plan%points, solver, old, goal, state, report, failure)
    if (allocated(failure)) return
    if (is_solved(scene, report)) solved%hint%tolerance = goal%tolerance
  end subroutine try_tolerance

  !> Whether something is not solved that a factor in double precision may solve.
  pure logical function needs_double(scene, solver, error, report)
    type(scene_t), intent(in) :: scene
    type(step_solver_t), intent(in) :: solver
    type(error_t), allocatable, intent(in) :: error
    type(increment_report_t), intent(in), optional :: report !! where there is no error

    needs_double = .false.
    if (.not. solver%choices%precision%saves_time) return
    if (allocated(error)) then
      needs_double = error%exit_status == exit_not_solved
    else if (present(report)) then
      needs_double = .not. (is_solved(scene, report) .or. any(report%ending%cause == &
        [ended_out_of_reach, ended_passed]))
    end if
  end function needs_double

  !> Enter the *STEP again, with a factor in double precision for the rest of the run.
  subroutine turn_to_double(scene, plan, increment, solver, progress, notes, error)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(inout) :: plan
    type(increment_t), intent(in) :: increment
    type(step_solver_t), intent(inout) :: solver !! its precision
    type(progress_t), intent(inout) :: progress
    type(note_t), allocatable, intent(inout) :: notes(:)
    type(error_t), allocatable, intent(inout) :: error !! of single precision; of double precision

    if (allocated(error)) deallocate (error)
    call take_double(solver%choices%precision)
    call note_double(increment, notes)
    call revise_plan(scene, plan, error)
    if (allocated(error)) return
    progress%tally%plan_revisions = progress%tally%plan_revisions + 1
    progress%in_double = 1
    progress%entered = 0
    call invalidate(solver%body)
    call enter_step(scene, plan, increment, progress, solver, error)
  end subroutine turn_to_double

  !> Advance by one increment; once more, with every slave node a candidate, where a node went
  !> further than the plan had it go.
  subroutine advance_or_widen(scene, plan, solver, progress, is_plain, solved, notes, error)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(inout) :: plan
    type(step_solver_t), intent(inout) :: solver
    type(progress_t), intent(inout) :: progress
    logical, intent(in) :: is_plain
    type(solved_t), intent(inout) :: solved
    type(note_t), allocatable, intent(inout) :: notes(:)
    type(error_t), allocatable, intent(out) :: error
    logical :: is_taken

    call advance_once()
    if (allocated(error) .or. solved%report%ending%cause /= ended_out_of_reach) return
    call note_widened(scene, plan%points, solved%increment, solved%report%ending%point, notes)
    call reach_everything(scene, plan%points)
    call revise_plan(scene, plan, error)
    if (allocated(error)) return
    call widen_interface(scene, plan%points, solver, progress%tally%work, error)
    if (allocated(error)) return
    progress%tally%plan_revisions = progress%tally%plan_revisions + 1
    progress%widened_in = solved%increment%step
    if (solver%body%made_after /= progress%state%tangent_of) call take_tangent(scene, plan%points, &
      progress%state, solver, is_taken, error)
    if (allocated(error)) return
    call advance_once()

  contains

    !> Ahead of increments that may yet be cut nobody looks.
    subroutine advance_once()
      if (is_plain) then
        call advance_along(scene, plan%points, solver, progress%state, progress%ahead, &
          solved%state, solved%report, error)
      else
        call forget_ahead(progress%ahead)
        call advance(scene, plan%points, solver, progress%state, goal_of(solver, &
          solved%increment), solved%state, solved%report, error)
      end if
    end subroutine advance_once

  end subroutine advance_or_widen

end module solve_next_mod
