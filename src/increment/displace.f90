!> The displacement of an increment: what loads and reactions make of it, and the correction by
!> what is out of balance.
module displace_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t
  use turning_couplings_mod, only: settle_couplings
  use rigid_modes_mod, only: free_motions_t, add_motions
  use dof_map_mod, only: to_equations
  use stiffness_inverse_mod, only: begin_inverse, finish_inverse, abandon_inverse, &
    answer_of_interface, at_interface
  use transfer_mod, only: nodal_forces
  use condensed_contact_mod, only: is_on_bodies
  use step_solver_mod, only: step_solver_t
  use trial_mod, only: trial_t, displacement_of
  use place_and_solve_mod, only: newton_raphson_t
  implicit none
  private

  public :: displace, displace_interface, settle, correct, give_up_begun, take_failure

contains

  !> The displacement with the reactions of `new`.
  subroutine displace(scene, points, solver, trial, new, pressed, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(inout) :: solver
    type(trial_t), intent(inout) :: trial
    !! gets what contact has displaced, and the interior of what has begun
    type(state_t), intent(inout) :: new                !! gets displacement
    real(wp), intent(out) :: pressed(:, :)             !! (3,n_nodes) by contact [force]
    type(error_t), allocatable, intent(out) :: error   !! MUMPS failed
    real(wp) :: change(3, size(pressed, 2))            !! [force]
    real(wp) :: correction(3, size(pressed, 2))        !! [length]

    pressed = nodal_forces(points, trial%placement%weights, new%reaction, size(pressed, 2))
    change = change_of_force(points, trial, new%reaction)
    if (allocated(trial%on_interface) .or. any(abs(change) > 0.0_wp)) then
      ! Of the change alone: what an inexact factor makes of it gets less and less.
      call finish_inverse(solver%body%inverse, change, trial%on_interface, correction, error)
      if (allocated(error)) return
      trial%u_contact = trial%u_contact + correction
      trial%applied_reaction = new%reaction
      trial%applied_force = pressed
    end if
    new%displacement = displacement_of(scene, solver, trial, trial%u_contact)
    call settle(scene, solver%body%motions, trial, new%displacement)
  end subroutine displace

  !> The displacement of the interface with the reactions of `new`. The interior still has that of
  !> the reactions before.
  subroutine displace_interface(scene, points, solver, trial, new)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    type(trial_t), intent(in) :: trial
    type(state_t), intent(inout) :: new !! gets displacement

    new%displacement = displacement_of(scene, solver, trial, trial%u_contact + at_interface( &
      solver%body%inverse, answer_of_interface(solver%body%inverse, change_of_force(points, &
      trial, new%reaction)), scene%mesh%n_nodes))
  end subroutine displace_interface

  !> What contact's forces on nodes have changed by since u_contact was found: as the reactions
  !> have, and as the weights have.
  pure function change_of_force(points, trial, reaction) result(change)
    type(contact_points_t), intent(in) :: points
    type(trial_t), intent(in) :: trial
    real(wp), intent(in) :: reaction(:, :)               !! (3,n_points) now [force]
    real(wp) :: change(3, size(trial%applied_force, 2))  !! (3,n_nodes) [force]

    associate (weights => trial%placement%weights, n => size(change, 2))
      change = nodal_forces(points, weights, reaction - trial%applied_reaction, n) + &
        (nodal_forces(points, weights, trial%applied_reaction, n) - trial%applied_force)
    end associate
  end function change_of_force

  !> Put what turning couplings take along where it is, in u_free too: contact sees it there.
  subroutine settle(scene, motions, trial, u)
    type(scene_t), intent(in) :: scene
    type(free_motions_t), intent(in) :: motions
    type(trial_t), intent(inout) :: trial
    real(wp), intent(inout) :: u(:, :)  !! (3,n_nodes) [length]
    real(wp) :: by_others(3, size(u, 2)) !! than reactions and motions [length]
    integer :: c

    if (.not. allocated(trial%turned_from)) return
    call settle_couplings(scene, trial%forces%prescribed, trial%turned_from, u)
    by_others = u - trial%u_contact
    call add_motions(motions, scene%mesh, -trial%motion, by_others)
    do c = 1, scene%constraints%n
      associate (i => scene%constraints%dof(c), node => scene%constraints%node(c))
        trial%u_free(i, node) = by_others(i, node)
      end associate
    end do
  end subroutine settle

  !> Take in the force that is out of balance, as a load or in u_free.
  subroutine correct(solver, residual, trial, loop, error)
    type(step_solver_t), intent(inout) :: solver
    real(wp), intent(in) :: residual(:, :) !! (3,n_nodes) [force]
    type(trial_t), intent(inout) :: trial  !! gets the correction
    type(newton_raphson_t), intent(inout) :: loop
    type(error_t), allocatable, intent(out) :: error !! MUMPS failed
    real(wp) :: correction(3, size(residual, 2))       !! [length]
    real(wp) :: change(solver%body%inverse%map%n_free) !! of the load of iterations [force]
    integer :: j

    loop%last_left = loop%left
    if (loop%imbalance <= trial%tolerance) return
    if (is_on_bodies(solver%contact) .and. .not. trial%by_compliance) then
      ! What iteration has not solved is out of balance too, but no load.
      call to_equations(solver%body%inverse%map, residual, change)
      associate (motions => solver%body%motions, load_left => trial%by_iteration%load_left)
        load_left = load_left + [change, (residual(motions%dof(j), motions%node(j)), &
          j=1, motions%n)] + trial%by_iteration%unsolved
      end associate
      return
    end if
    ! Contact sees the correction of the interface. The interior is corrected when the reactions
    ! that follow from it are known, in one solution with the factor.
    call begin_inverse(solver%body%inverse, residual, trial%on_interface, correction, error)
    if (allocated(error)) return
    trial%u_free = trial%u_free + correction
  end subroutine correct

  !> Give up a correction whose interior is not asked for.
  subroutine give_up_begun(solver, trial)
    type(step_solver_t), intent(inout) :: solver
    type(trial_t), intent(inout) :: trial

    if (.not. allocated(trial%on_interface)) return
    call abandon_inverse(solver%body%inverse)
    deallocate (trial%on_interface)
  end subroutine give_up_begun

  !> How solutions for the bodies have failed, where they have.
  subroutine take_failure(solver, error)
    type(step_solver_t), intent(in) :: solver
    type(error_t), allocatable, intent(out) :: error

    associate (inverse => solver%body%inverse)
      if (allocated(inverse%failure)) then
        error = inverse%failure
      else if (allocated(inverse%iterative)) then
        if (allocated(inverse%iterative%failure)) error = inverse%iterative%failure
      end if
    end associate
  end subroutine take_failure

end module displace_mod
