!> Steps 2 to 5 of an increment (advance_mod): the Newton-Raphson loop in which reactions,
!> displacement and the placement of the contact points come to agree.
!>
!> Before a surface each placement is made where Anderson's acceleration says (docs/theory.md
!> section 11). Placements settle by what the interface does; a solution for the whole body and the
!> balance of its forces come after that.
module equilibrate_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t
  use progress_line_mod, only: show_progress
  use scene_mod, only: scene_t
  use controls_mod, only: is_exact, solver_auto
  use contact_points_mod, only: contact_points_t
  use state_mod, only: modes_t, state_t
  use increment_report_mod, only: increment_report_t, ending_t, has_converged, ended_unbalanced, &
    ended_moving, ended_passed, ended_inverted, ended_out_of_balance, ended_indefinite
  use mesh_forces_mod, only: force_rounding
  use inertia_mod, only: rounding_of_inertia
  use finite_forces_mod, only: tangent_t
  use passed_obstacles_mod, only: find_passed, part_that_would_do
  use candidate_points_mod, only: areas_apart
  use placement_mod, only: placement_t, join_ends
  use follow_bodies_mod, only: farthest_point
  use closed_points_mod, only: keep_closed
  use step_solver_mod, only: step_solver_t
  use trial_mod, only: trial_t
  use renew_tangent_mod, only: renew_tangent
  use place_and_solve_mod, only: newton_raphson_t, begin_newton_raphson, follow_free_bodies, &
    place_points, find_reactions, check_covered
  use displace_mod, only: displace, displace_interface, correct, give_up_begun, take_failure
  use out_of_balance_mod, only: find_residual, leave_to_reactions
  use extrapolate_mod, only: update_forces
  use motions_at_rest_mod, only: is_turned, lead, rest
  use settled_places_mod, only: are_places_settled, settles_on_interface, look_at_places, &
    look_at_far_places
  implicit none
  private

  public :: equilibrate, refuse_passed

  real(wp), parameter :: roughly = 1.0e-4_wp
  !! how far points may still move when the body is solved for with a factor that is not exact: what
  !! is refined moves them again [-]

contains

  !> Newton-Raphson until the forces balance and the points on curved obstacles have settled:
  !> reactions and displacement from u_free. Nothing is certified.
  subroutine equilibrate(scene, points, solver, old, trial, new, report, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(inout) :: solver
    type(state_t), intent(in) :: old
    type(trial_t), intent(inout) :: trial            !! u_free takes the corrections
    type(state_t), intent(inout) :: new
    !! gets reaction, displacement, rotation, and which points are closed
    type(increment_report_t), intent(inout) :: report
    type(error_t), allocatable, intent(out) :: error !! MUMPS failed
    real(wp), dimension(3, size(trial%u_free, 2)) :: residual, pressed !! [force]
    type(newton_raphson_t) :: loop
    logical :: is_missed, is_first, is_followed, has_joined, was_foreseen
    integer :: inverted !! element that is inside out; 0: none

    new%rotation = trial%rotation
    if (allocated(trial%placement%weights%alone)) new%alone = trial%placement%weights%alone
    is_missed = .false.
    is_first = .true.
    inverted = 0
    loop = begin_newton_raphson(scene, points, solver, trial)
    loop%modes = old%modes
    newton_raphson: do while (loop%i < trial%goal%most_iterations)
      loop%i = loop%i + 1
      report%newton_raphson_iterations = report%newton_raphson_iterations + 1

      ! 2. and 3. Reactions, and the free motions with them
      call follow_free_bodies(scene, points, new%displacement, solver, trial, loop, is_followed)
      if (.not. is_followed) then
        loop%imbalance = 1.0_wp
        exit newton_raphson
      end if
      if (any(points%is_curved)) call place_points(scene, points, solver, old, new, trial, loop)
      call check_covered(points, solver, error)
      if (allocated(error)) return
      if (.not. trial%is_foreseen) call find_reactions(scene, points, solver, old, trial, new, &
        report, loop)
      was_foreseen = trial%is_foreseen
      trial%is_foreseen = .false.
      trial%has_begun = .true.
      call take_failure(solver, error)
      if (allocated(error)) return
      if (report%ending%cause == ended_unbalanced) then
        call give_up_begun(solver, trial)
        return
      end if

      ! 4. Displacement: of the interface alone until the points have settled.
      if (settles_on_interface(points, solver, trial, loop)) then
        call displace_interface(scene, points, solver, trial, new)
        call look_at_places(scene, points, solver, old, trial, new, loop, is_missed)
        if (is_missed .or. .not. are_places_settled(loop, merge(trial%tolerance, &
          max(roughly, trial%tolerance), is_exact(solver%choices%precision)))) then
          call lead(scene, points, solver, trial, new, loop)
          cycle newton_raphson
        end if
      end if
      call displace(scene, points, solver, trial, new, pressed, error)
      if (allocated(error)) return
      call rest(scene, points, solver, old, loop, trial, new)

      ! 5. Out-of-balance force, and how far the closest points have moved
      call update_forces(scene, solver, old, trial, new, loop, report, inverted)
      if (inverted > 0) exit newton_raphson
      if (was_foreseen) loop%modes = new%modes
      if (allocated(trial%support_force)) trial%support_force = merge(trial%forces%internal - &
        trial%forces%external - pressed, 0.0_wp, trial%forces%prescribed)
      trial%forces%rounding = force_rounding(scene%mesh, solver%body%of_elements, &
        max(abs(new%displacement), abs(old%displacement)))
      if (allocated(solver%body%inertia)) trial%forces%rounding = trial%forces%rounding + &
        rounding_of_inertia(solver%body%inertia, new%displacement)
      call find_residual(scene, solver%body%constraints, pressed, new%displacement, trial, &
        trial%tolerance < trial%goal%tolerance, residual, loop)
      if (is_first) report%unrefined = max(report%unrefined, loop%imbalance)
      is_first = .false.
      report%imbalance = loop%imbalance
      if (trial%goal%shows_progress) call show_progress('iteration', loop%i, loop%imbalance)
      report%without_contact = maxval(abs(trial%u_free))/max(tiny(1.0_wp), &
        maxval(abs(new%displacement)))
      call look_at_places(scene, points, solver, old, trial, new, loop, is_missed)
      if (is_settled(loop, trial, new%reaction) .and. &
        .not. is_missed .and. areas_apart(scene, points, new%displacement, trial%placement) <= &
        trial%tolerance) then
        if (solver%body%motions%n == 0) call look_at_far_places(scene, points, old, trial, new, &
          loop, is_missed)
        if (is_missed) cycle newton_raphson
        has_joined = .false.
        if (.not. loop%is_linear .and. allocated(trial%placement%weights%alone)) call &
          join_ends(points, new%reaction, trial%placement%weights%alone, has_joined)
        if (has_joined) then
          new%alone = trial%placement%weights%alone
          cycle newton_raphson
        end if
        exit newton_raphson
      end if
      call lead(scene, points, solver, trial, new, loop)
      if (solver%choices%precision%renews_tangent .and. loop%imbalance > trial%tolerance) then
        call renew_tangent(scene, points, solver, tangent_t(new%displacement, trial%free, &
          projection=0.0_wp, modes=modes_t()), trial, report, error)
        if (allocated(error) .or. report%ending%cause == ended_indefinite) return
      end if
      call correct(solver, residual, trial, loop, error)
      if (allocated(error)) return
    end do newton_raphson
    call give_up_begun(solver, trial)
    call keep_closed(scene, points, solver%undeformed, trial%placement%weights, old, new)
    if (inverted > 0) then
      report%ending = ending_t(ended_inverted, element=inverted)
      return
    end if
    if (loop%imbalance > max(trial%tolerance, trial%goal%tolerance) .and. .not. &
      loop%is_linear) then
      report%ending = ending_t(ended_out_of_balance, loop%imbalance)
      return
    end if
    report%moved = loop%moved
    report%moved_point = farthest_point(points, loop%follow, trial%placed_at, new%displacement)
    if (loop%moved <= loop%follow%allowed .and. .not. is_missed) then
      call refuse_passed(scene, points, trial%placement, old, new, report)
      if (report%ending%cause /= ended_passed .and. loop%imbalance > trial%tolerance) call &
        leave_to_reactions(scene%mesh, points, trial%placement, residual, new%reaction)
      return
    end if
    ! Points do not settle by reactions that the solver did not find.
    if (.not. has_converged(report) .and. scene%contact%solver /= solver_auto) return
    ! Nothing says that reactions found elsewhere hold here.
    report%ending = ending_t(ended_moving, report%moved, report%moved_point)
  end subroutine equilibrate

  !> Where an obstacle presses from inside a body, forces balance there, but nothing led there.
  subroutine refuse_passed(scene, points, placement, old, new, report)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(placement_t), intent(in) :: placement !! at the displacement of `new`
    type(state_t), intent(in) :: old, new      !! the increment's beginning and end
    type(increment_report_t), intent(inout) :: report
    integer :: point

    point = find_passed(scene, points, placement, old, new)
    if (point == 0) return
    report%ending = ending_t(ended_passed, point=point, part_to_try=part_that_would_do(scene, &
      points, point, old, new, placement))
  end subroutine refuse_passed

  !> Whether the forces balance and the points stay where they were placed, as far as either goes.
  !>
  !> Where the certificate asked for a closer balance than every increment must reach, that may be
  !> less than forces are rounded by: beyond the tenth iteration one that lowers the imbalance by
  !> less than a tenth is the last. (Plates of second order under pressure stay at 3e-12 to 1e-11.)
  pure logical function is_settled(loop, trial, reaction)
    type(newton_raphson_t), intent(in) :: loop
    type(trial_t), intent(in) :: trial
    real(wp), intent(in) :: reaction(:, :) !! (3,n_points) [force]

    ! Progress is that of the force: where nothing presses a body, all its forces are out of
    ! balance, and no part of them falls as they do.
    if (loop%is_linear) then
      is_settled = loop%left > 0.5_wp*loop%last_left .and. .not. is_turned(trial, reaction, &
        trial%tolerance)
    else
      is_settled = loop%imbalance <= trial%goal%tolerance .and. loop%left > &
        0.9_wp*loop%last_left .and. loop%i > 10
    end if
    is_settled = is_settled .or. loop%imbalance <= trial%tolerance
    is_settled = is_settled .and. are_places_settled(loop, trial%tolerance)
    ! Contact was solved for what acceleration has mixed, not for the mixture.
    is_settled = is_settled .and. loop%mixed <= trial%tolerance
  end function is_settled

end module equilibrate_mod
