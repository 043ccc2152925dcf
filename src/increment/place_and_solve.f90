!> Steps 2 and 3 of an increment (advance_mod), in each iteration of its Newton-Raphson loop: where
!> the contact points are placed, and the reactions there.
module place_and_solve_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t, raise, exit_not_solved
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t, modes_t
  use increment_report_mod, only: increment_report_t, has_converged
  use bodies_mod, only: is_linear
  use follow_points_mod, only: rounding_of_places
  use drag_points_mod, only: drag_points
  use surface_drag_mod, only: drag_along_surfaces
  use anderson_mod, only: anderson_t
  use candidate_points_mod, only: take_deformed_areas
  use placement_mod, only: placement_t, place_curved
  use follow_bodies_mod, only: follow_t, begin_following, next_place
  use rigid_modes_mod, only: free_motions_t, add_motions, follow_turns
  use condensed_contact_mod, only: condensed_contact_t, count_rows, is_on_bodies, &
    neutral_motions, are_left_out
  use condense_contact_mod, only: condense_contact
  use near_points_mod, only: near_points
  use neutral_motions_mod, only: led_t
  use step_loads_mod, only: any_follows
  use step_solver_mod, only: step_solver_t
  use trial_mod, only: trial_t, loads_on_motions, displacement_of
  use turning_couplings_mod, only: turned_constraints
  use solve_reactions_mod, only: solve_reactions
  implicit none
  private

  public :: newton_raphson_t, begin_newton_raphson, follow_free_bodies, place_points, &
    find_reactions, check_covered

  integer, parameter :: most_by_parts = 20 !! iterations in which points may be left out
  integer, parameter :: depth = 5 !! displacements that acceleration keeps
  real(wp), parameter :: nearly = 1.0e-2_wp !! of what has moved: a gap about to close [-]
  real(wp), parameter :: sharpest = 1.0e-12_wp !! residual below which nothing is asked for [-]

  !> The Newton-Raphson loop of an increment, as far as one iteration leaves something to the next.
  type :: newton_raphson_t
    integer :: i = 0                      !! iteration
    logical :: is_linear = .true.         !! internal forces are
    type(placement_t) :: undeformed
    !! of the undeformed mesh, before obstacles as they stand; where bodies turn the placement
    type(placement_t) :: looked
    !! the points placed where they were looked at last; it is that of the next iteration where this
    !! places them there
    real(wp), allocatable :: looked_at(:, :) !! (3,n_nodes) that displacement [length]
    type(follow_t) :: follow              !! of surfaces
    logical, allocatable :: near(:)       !! (n_points) that may touch, as far as is known
    real(wp) :: slack = 0.0_wp            !! gap that counts as none [length]
    real(wp) :: imbalance = 0.0_wp        !! of the worst node, beside its body's forces [-]
    real(wp) :: left = 0.0_wp, last_left = huge(1.0_wp) !! of that node, now and before [force]
    real(wp) :: moved = 0.0_wp, last_moved = huge(1.0_wp), least_moved = huge(1.0_wp)
    !! how far points are from where they were placed: now, before, and at best [-]
    integer :: idle = 0                   !! iterations in a row that gained nothing, near the end
    integer :: depth = 0                  !! displacements that acceleration keeps; 0: there is none
    type(anderson_t) :: memory            !! of these
    real(wp), allocatable :: at(:)
    !! (n_free+n_motions) where forces were asked for, there [length]
    real(wp) :: apart = 0.0_wp, last_apart = huge(1.0_wp)
    !! how far the displacement is from there, of its way, now and before [-]
    type(modes_t) :: modes
    !! where the increment began or was foreseen: far from the last iteration others lead there
    real(wp) :: mixed = 0.0_wp
    !! how far acceleration took the displacement from what contact was solved for, likewise [-]
    real(wp), allocatable :: led(:)       !! (n_motions) by steps along neutral motions [length]
    type(led_t) :: last_led               !! the last of them
  end type newton_raphson_t

contains

  !> The loop before its first iteration.
  type(newton_raphson_t) function begin_newton_raphson(scene, points, solver, trial) result(loop)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    type(trial_t), intent(in) :: trial

    allocate (loop%near, source=points%in_reach)
    loop%undeformed = turned_undeformed(scene, points, solver, trial)
    loop%is_linear = is_linear(scene)
    if (.not. loop%is_linear) then
      ! The tangent of an iteration leaves out what loads change by as they follow, and what moments
      ! on couplings do.
      if (.not. solver%choices%precision%renews_tangent .or. allocated(trial%turned_from) .or. &
        any_follows(solver%response%loads)) loop%depth = depth
    end if
    loop%follow = begin_following(scene, points, max(trial%tolerance, &
      trial%goal%tolerance))
    allocate (loop%led(solver%body%motions%n), source=0.0_wp)
  end function begin_newton_raphson

  !> The points of the undeformed mesh before obstacles as they stand at the end of the increment.
  pure type(placement_t) function turned_undeformed(scene, points, solver, trial) result(undeformed)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    type(trial_t), intent(in) :: trial
    real(wp) :: nothing(3, scene%mesh%n_nodes)

    undeformed = solver%undeformed
    if (.not. any(scene%obstacles%turns)) return
    nothing = 0.0_wp
    call place_curved(scene, points, nothing, undeformed, trial%rotation)
  end function turned_undeformed

  !> Take the rigid motions of free bodies that turn about where these are, and what they have moved
  !> so far with them.
  subroutine follow_free_bodies(scene, points, u, solver, trial, loop, ok)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: u(:, :)              !! (3,n_nodes) [length]
    type(step_solver_t), intent(inout) :: solver !! gets the motions, and contact that sees them
    type(trial_t), intent(inout) :: trial        !! its u_free takes the difference
    type(newton_raphson_t), intent(in) :: loop
    logical, intent(out) :: ok                   !! false: the pins hold a body no more

    ok = .true.
    associate (motions => solver%body%motions)
      if (.not. (motions%are_finite .and. any(motions%body > 0))) return
      call add_motions(motions, scene%mesh, trial%motion, trial%u_free)
      call follow_turns(scene%mesh, u, solver%body%prescribed, turned_constraints(scene, &
        solver%body%prescribed, u), motions, ok)
      if (.not. ok) return
      call add_motions(motions, scene%mesh, -trial%motion, trial%u_free)
    end associate
    ! Before curved obstacles points are placed anew after this.
    if (.not. all(points%is_curved)) call condense_contact(scene, trial%goal%tolerance, points, &
      solver%body, loop%undeformed, trial%placement, solver%contact)
  end subroutine follow_free_bodies

  !> Place the points before curved obstacles, and make the contact problem of those that may touch.
  subroutine place_points(scene, points, solver, old, new, trial, loop)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(inout) :: solver !! gets the contact problem
    type(state_t), intent(in) :: old, new
    type(trial_t), intent(inout) :: trial        !! gets the placement
    type(newton_raphson_t), intent(inout) :: loop !! gets the points that may touch, and the slack

    if (loop%i > 1) call next_place(loop%follow, loop%i - 1, loop%last_moved, new%displacement, &
      trial%placed_at)
    if (loop%i > most_by_parts) loop%near = points%in_reach
    ! What is not near has no row in the contact problem, and a place from the first iteration. Of
    ! bodies that are free all points may get rows, where the near ones see less of their motions.
    call place_there(scene, points, old, loop, loop%i > 1 .and. .not. loop%near .and. &
      solver%body%motions%n == 0, trial)
    ! Motions are about where the bodies are: what these see of them is exact there alone.
    if (loop%follow%with_bodies) loop%undeformed = trial%placement
    call note_pressing(scene, solver%body%motions, new%reaction, trial, solver%contact)
    loop%slack = 10.0_wp*trial%tolerance*maxval(abs(trial%placed_at)) + &
      rounding_of_places(scene, trial%placed_at)
    if (loop%i == 1) loop%near = first_near(scene, points, solver, old, trial, new%reaction, &
      loop%slack)
    call condense_contact(scene, trial%goal%tolerance, points, solver%body, loop%undeformed, &
      trial%placement, solver%contact, loop%near)
  end subroutine place_points

  !> Place the points, except those that are far.
  subroutine place_there(scene, points, old, loop, is_far, trial)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(state_t), intent(in) :: old
    type(newton_raphson_t), intent(in) :: loop
    logical, intent(in) :: is_far(:)      !! (n_points) they keep the places that they have
    type(trial_t), intent(inout) :: trial !! gets the placement

    if (are_looked_at(points, loop, trial%placed_at)) then
      trial%placement = loop%looked
    else
      call place_curved(scene, points, trial%placed_at, trial%placement, trial%rotation, &
        stay=loop%i > 1, is_far=is_far)
    end if
    call drag_points(scene, points, old, trial%placed_at, trial%rotation, trial%placement)
    call drag_along_surfaces(scene, points, trial%began, old, trial%placed_at, trial%placement)
  end subroutine place_there

  !> Whether the points were looked at where they are to be placed. Points in the middles of edges
  !> may have got their ends since.
  pure logical function are_looked_at(points, loop, u)
    type(contact_points_t), intent(in) :: points
    type(newton_raphson_t), intent(in) :: loop
    real(wp), intent(in) :: u(:, :)      !! (3,n_nodes) where they are to be placed [length]

    are_looked_at = allocated(loop%looked_at) .and. .not. allocated(points%alpha)
    if (are_looked_at) are_looked_at = .not. maxval(abs(u - loop%looked_at)) > 0.0_wp
  end function are_looked_at

  !> Which points pressed in the iteration before, or when the increment began.
  subroutine note_pressing(scene, motions, reaction, trial, contact)
    type(scene_t), intent(in) :: scene
    type(free_motions_t), intent(in) :: motions
    real(wp), intent(in) :: reaction(:, :) !! (3,n_points) [force]
    type(trial_t), intent(in) :: trial     !! its loads
    type(condensed_contact_t), intent(inout) :: contact
    real(wp), allocatable :: rounding(:)

    if (allocated(contact%presses)) deallocate (contact%presses)
    if (motions%n == 0) return
    contact%presses = any(abs(reaction) > 0.0_wp, dim=1)
    if (any(contact%presses)) contact%presses = contact%presses .or. trial%placement%gap < &
      nearly*maxval(abs(trial%placed_at))
    call loads_on_motions(scene, motions, trial, contact%load, rounding)
  end subroutine note_pressing

  !> The reactions, and the free motions with them: of the points that may touch, and of all in
  !> reach where those lead nowhere.
  subroutine find_reactions(scene, points, solver, old, trial, new, report, loop)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(inout) :: solver
    type(state_t), intent(in) :: old
    type(trial_t), intent(inout) :: trial
    type(state_t), intent(inout) :: new   !! gets reaction
    type(increment_report_t), intent(inout) :: report
    type(newton_raphson_t), intent(inout) :: loop
    real(wp) :: reaction(3, points%n)         !! that a solution began from [force]
    real(wp) :: motion(solver%body%motions%n) !! likewise [length]
    real(wp) :: tolerance                     !! that it is to reach [-]

    ! Where placements or displacements are followed, ten times sharper than asked for as far as
    ! that is within reach: what reactions leave open no placement can settle.
    tolerance = trial%tolerance
    if (size(loop%follow%node) > 0 .or. loop%follow%with_bodies) tolerance = min(tolerance, &
      max(sharpest, 0.1_wp*tolerance))
    reaction = new%reaction
    motion = trial%motion
    call take_deformed_areas(scene, points, new%displacement, trial%placement)
    call solve_reactions(scene, points, solver, old, tolerance, trial, new%reaction, report)
    if (has_converged(report)) return
    if (.not. any(are_left_out(solver%contact, points%n)) .and. .not. &
      allocated(solver%contact%presses)) return
    ! The others may be what holds the bodies.
    if (loop%i > 1 .and. any(points%is_curved)) call place_there(scene, points, old, loop, &
      loop%near, trial)
    loop%near = points%in_reach
    if (allocated(solver%contact%presses)) deallocate (solver%contact%presses)
    new%reaction = reaction
    trial%motion = motion
    call condense_contact(scene, trial%goal%tolerance, points, solver%body, loop%undeformed, &
      trial%placement, solver%contact, loop%near)
    call solve_reactions(scene, points, solver, old, tolerance, trial, new%reaction, report)
  end subroutine find_reactions

  !> The points that may touch, before anything is solved: by where they are, and by where the loads
  !> would take them without contact. All in reach, where bodies are solved for by iteration.
  pure function first_near(scene, points, solver, old, trial, reaction, slack) result(near)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    type(state_t), intent(in) :: old
    type(trial_t), intent(in) :: trial
    real(wp), intent(in) :: reaction(:, :) !! (3,n_points) to start from [force]
    real(wp), intent(in) :: slack          !! as of near_points [length]
    logical :: near(points%n)
    real(wp) :: no_contact(3, scene%mesh%n_nodes) !! what it displaces [length]

    near = points%in_reach
    if (allocated(solver%body%inverse%iterative) .or. trial%has_turned) return
    no_contact = 0.0_wp
    near = near_points(points, trial%placement, old, old%displacement, reaction, slack) .or. &
      near_points(points, trial%placement, old, displacement_of(scene, solver, trial, &
      no_contact), reaction, slack)
  end function first_near

  !> Refuse contact that a body solved for by iteration does not cover.
  subroutine check_covered(points, solver, error)
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    type(error_t), allocatable, intent(out) :: error

    if (.not. allocated(solver%body%inverse%iterative)) return
    if (count_rows(solver%contact) == 0) return
    if (is_on_bodies(solver%contact)) then
      if (any(points%is_curved .and. points%in_reach) .and. size(neutral_motions(solver%contact, &
        solver%body%motions%n), 2) > 0) call raise(error, exit_not_solved, &
        '*BODY SOLVER, TYPE=ITERATIVE does not cover bodies that are free to turn or slide on '// &
        'a round obstacle or on each other; TYPE=FACTOR does')
      return
    end if
    call raise(error, exit_not_solved, '*BODY SOLVER, TYPE=ITERATIVE does not cover points '// &
      'that depend on other nodes, that are slave and master of each other, or whose supports '// &
      'are oblique to the obstacle; TYPE=FACTOR does')
  end subroutine check_covered

end module place_and_solve_mod
