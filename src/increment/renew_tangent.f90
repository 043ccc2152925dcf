!> Newton-Raphson with the tangent of every iteration: equation [1] of [JFT07] as it stands.
!> docs/theory.md (8.25).
module renew_tangent_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t, exit_not_solved
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t, modes_t
  use increment_report_mod, only: increment_report_t, ending_t, ended_indefinite
  use constraints_mod, only: follow_masters
  use finite_forces_mod, only: tangent_t
  use bodies_mod, only: find_internal_force, tangent_at, find_tangent_force
  use turning_couplings_mod, only: turn_moments
  use rigid_modes_mod, only: add_motions
  use stiffness_inverse_mod, only: apply_inverse, moved_by
  use step_solver_mod, only: step_solver_t, linearise_at
  use inertia_mod, only: force_of_inertia
  use trial_mod, only: trial_t, apply_reactions
  implicit none
  private

  public :: begin_with_tangent, begin_in_motion, renew_tangent

contains

  !> The displacement without contact that an increment starts from: that of its beginning, and what
  !> its loads and supports add to it by the tangent there.
  subroutine begin_with_tangent(scene, points, solver, old, trial, report, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(inout) :: solver
    type(state_t), intent(in) :: old
    type(trial_t), intent(inout) :: trial              !! its displacements and applied reactions
    type(increment_report_t), intent(inout) :: report  !! as of renew_tangent
    type(error_t), allocatable, intent(out) :: error   !! MUMPS failed

    call apply_reactions(points, old, trial)
    call renew_tangent(scene, points, solver, tangent_at(scene, old%displacement, old%step, &
      old%position, projection=0.0_wp), trial, report, error)
    if (allocated(error) .or. report%ending%cause == ended_indefinite) return
    call add_loads(scene, solver, old, trial, error)
  end subroutine begin_with_tangent

  !> The same by the factor that there is, of an increment of a dynamic *STEP at finite strain: in
  !> balance with inertia nothing is yet where it begins.
  subroutine begin_in_motion(scene, points, solver, old, trial, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(inout) :: solver
    type(state_t), intent(in) :: old
    type(trial_t), intent(inout) :: trial              !! its displacements and applied reactions
    type(error_t), allocatable, intent(out) :: error   !! MUMPS failed

    call apply_reactions(points, old, trial)
    trial%u_contact = moved_by(solver%body%inverse, trial%applied_force)
    trial%u_free = old%displacement - trial%u_contact
    call add_loads(scene, solver, old, trial, error)
  end subroutine begin_in_motion

  !> What loads, supports and inertia add to the displacement of an increment's beginning.
  subroutine add_loads(scene, solver, old, trial, error)
    type(scene_t), intent(in) :: scene
    type(step_solver_t), intent(inout) :: solver
    type(state_t), intent(in) :: old
    type(trial_t), intent(inout) :: trial              !! its displacement without contact
    type(error_t), allocatable, intent(out) :: error   !! MUMPS failed
    real(wp), dimension(3, scene%mesh%n_nodes) :: moved, held, loads
    real(wp), allocatable :: correction(:, :, :)
    real(wp) :: added(3, scene%mesh%n_nodes, 1)
    type(modes_t) :: modes
    integer :: inverted

    moved = 0.0_wp
    where (trial%forces%prescribed) moved = trial%forces%displacement - old%displacement
    call follow_masters(solver%body%constraints, moved)
    modes = old%modes
    call find_internal_force(scene, trial%free, old%displacement, modes, held, inverted)
    call find_tangent_force(scene, reshape(moved, [shape(moved), 1]), added, solver%body%tangent)
    held = held + added(:, :, 1)
    if (allocated(solver%body%inertia)) held = held + force_of_inertia(scene%mesh, &
      solver%body%inertia, trial%in_motion, old%displacement + moved)
    loads = trial%forces%external
    call turn_moments(scene, trial%forces%prescribed, old%displacement, loads)
    call apply_inverse(solver%body%inverse, reshape(loads + trial%applied_force - held, &
      [shape(held), 1]), correction, error)
    if (allocated(error)) return
    trial%u_free = trial%u_free + moved + correction(:, :, 1)
  end subroutine add_loads

  !> Factor, compliance and contact problem of a tangent, from whose displacement the iteration
  !> goes on. One that is not positive definite ends the increment, as the report says:
  !> no compliance of contact follows from it.
  subroutine renew_tangent(scene, points, solver, tangent, trial, report, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(inout) :: solver
    type(tangent_t), intent(in) :: tangent             !! not projected
    type(trial_t), intent(inout) :: trial              !! its displacements
    type(increment_report_t), intent(inout) :: report  !! how it ends, where it does
    type(error_t), allocatable, intent(out) :: error   !! MUMPS failed

    call linearise_at(scene, points, tangent, solver, error)
    if (allocated(error)) then
      if (error%exit_status /= exit_not_solved) return
      report%ending = ending_t(ended_indefinite)
      deallocate (error)
      return
    end if
    ! On the interface u_free must be what the contact problem adds W r to.
    trial%u_contact = moved_by(solver%body%inverse, trial%applied_force)
    trial%u_free = tangent%at - trial%u_contact
    call add_motions(solver%body%motions, scene%mesh, -trial%motion, trial%u_free)
  end subroutine renew_tangent

end module renew_tangent_mod
