!> Whether the contact points stay where they were placed, and what is known before the displacement
!> of the interior is.
module settled_places_mod
  use kinds_mod, only: wp
  use controls_mod, only: is_exact
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t
  use follow_points_mod, only: measure_points
  use drag_points_mod, only: drag_points
  use placement_mod, only: placement_t, place_curved
  use follow_bodies_mod, only: has_moved
  use condensed_contact_mod, only: neutral_motions, are_left_out
  use near_points_mod, only: near_points, is_any_missed
  use step_solver_mod, only: step_solver_t
  use trial_mod, only: trial_t
  use place_and_solve_mod, only: newton_raphson_t
  implicit none
  private

  public :: are_places_settled, settles_on_interface, look_at_places, look_at_far_places

contains

  !> Whether the points stay where they were placed, as far as that goes: iterations that gain
  !> nothing end it. At the top of a tower of bodies reactions move points by more than their own
  !> tolerance, for as long as it is asked for.
  pure logical function are_places_settled(loop, tolerance) result(are_settled)
    type(newton_raphson_t), intent(in) :: loop
    real(wp), intent(in) :: tolerance !! [-]

    are_settled = loop%moved <= tolerance .or. (loop%moved > 0.9_wp*loop%last_moved .and. &
      (loop%i > 10 .or. loop%idle > 0) .and. loop%moved <= loop%follow%allowed)
  end function are_places_settled

  !> Whether places are to settle before the interior is asked for: contact sees the interface
  !> alone, and what it does follows from the compliance, which takes far less than a solution with
  !> the factor. Not where a correction waits for its interior, nor where neutral motions come to
  !> rest by what all of their body does, nor where forces are not linear: iterations take
  !> placements along. Surfaces move again as an inexact factor is refined: that is done at once.
  pure logical function settles_on_interface(points, solver, trial, loop)
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    type(trial_t), intent(in) :: trial
    type(newton_raphson_t), intent(in) :: loop

    associate (inverse => solver%body%inverse, n => solver%body%motions%n)
      settles_on_interface = loop%is_linear .and. any(points%is_curved) .and. &
        inverse%is_condensed .and. &
        inverse%map%n_interface > 0 .and. loop%i < &
        trial%goal%most_iterations .and. .not. &
        (allocated(inverse%iterative) .or. allocated(trial%on_interface))
      if (.not. settles_on_interface .or. size(loop%follow%node) == 0) return
      settles_on_interface = is_exact(solver%choices%precision)
      if (settles_on_interface .and. n > 0) settles_on_interface = size(neutral_motions( &
        solver%contact, n), 2) == 0
    end associate
  end function settles_on_interface

  !> How far the points have moved from their places, which of them may touch, and whether one does
  !> that was left out.
  subroutine look_at_places(scene, points, solver, old, trial, new, loop, is_missed)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    type(state_t), intent(in) :: old
    type(trial_t), intent(in) :: trial
    type(state_t), intent(in) :: new
    type(newton_raphson_t), intent(inout) :: loop
    logical, intent(out) :: is_missed
    real(wp) :: moved !! of points before obstacles [-]

    call look(scene, points, trial%placement, old, new, loop, moved)
    loop%moved = max(moved, has_moved(scene%mesh, loop%follow, old%displacement, &
      trial%placed_at, new%displacement))
    is_missed = is_any_missed(points, trial%placement, are_left_out(solver%contact, points%n), &
      new%displacement, loop%slack)
    if (all(loop%near .or. .not. points%in_reach)) return
    if (loop%i == 1) loop%near = .false.
    loop%near = loop%near .or. near_points(points, trial%placement, old, new%displacement, &
      new%reaction, loop%slack)
  end subroutine look_at_places

  !> Whether a point that is not near, and has kept the place of the first iteration, touches its
  !> master where the displacement is now; it is near then, with those beside it.
  subroutine look_at_far_places(scene, points, old, trial, new, loop, is_missed)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(state_t), intent(in) :: old
    type(trial_t), intent(in) :: trial
    type(state_t), intent(in) :: new
    type(newton_raphson_t), intent(inout) :: loop
    logical, intent(out) :: is_missed
    type(placement_t) :: there

    is_missed = .false.
    if (loop%i == 1 .or. all(loop%near .or. .not. points%is_curved)) return
    there = trial%placement
    call place_curved(scene, points, new%displacement, there, trial%rotation, stay=.true., &
      is_far=loop%near)
    is_missed = is_any_missed(points, there, points%in_reach .and. .not. loop%near, &
      new%displacement, loop%slack)
    if (is_missed) loop%near = loop%near .or. near_points(points, there, old, new%displacement, &
      new%reaction, loop%slack)
  end subroutine look_at_far_places

  !> How far the points before curved obstacles are from where they were placed, as of
  !> `measure_points`.
  pure subroutine look(scene, points, placement, old, new, loop, moved)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(placement_t), intent(in) :: placement
    type(state_t), intent(in) :: old, new
    type(newton_raphson_t), intent(inout) :: loop !! gets the points placed where they are now
    real(wp), intent(out) :: moved                !! [-]

    moved = 0.0_wp
    if (.not. any(points%is_curved .and. scene%pairs(points%pair)%master > 0)) return
    loop%looked = placement
    loop%looked_at = new%displacement
    call place_curved(scene, points, new%displacement, loop%looked, new%rotation, stay=.true.)
    call drag_points(scene, points, old, new%displacement, new%rotation, loop%looked)
    call measure_points(scene, points, placement, loop%looked, old, new, moved)
  end subroutine look

end module settled_places_mod
