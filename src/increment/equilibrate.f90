!> Steps 2 to 5 of an increment (advance_mod): the Newton-Raphson loop in which reactions,
!> displacement and the placement of the contact points come to agree.
!>
!> Before a surface each placement is made where Anderson's acceleration says (docs/theory.md
!> section 11). Placements settle by what the interface does; a solution for the whole body and the
!> balance of its forces come after that.
module equilibrate_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t
  use constraints_mod, only: constraints_t, active_constraints, follow_masters, give_to_masters
  use mesh_mod, only: mesh_t
  use scene_mod, only: scene_t
  use controls_mod, only: is_exact, solver_auto
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t
  use increment_report_mod, only: increment_report_t, ended_unbalanced, ended_moving, &
    ended_passed, ended_inverted, ended_out_of_balance, ended_indefinite
  use mesh_forces_mod, only: force_rounding
  use finite_forces_mod, only: tangent_t
  use bodies_mod, only: find_internal_force
  use turning_couplings_mod, only: turned_constraints, settle_couplings, turn_moments
  use anderson_mod, only: new_anderson, accelerate, forget
  use rigid_modes_mod, only: free_motions_t, add_motions
  use dof_map_mod, only: dof_map_t, to_equations, to_nodes, unknowns_of
  use stiffness_inverse_mod, only: begin_inverse, finish_inverse, abandon_inverse, &
    answer_of_interface, at_interface
  use increment_forces_mod, only: increment_forces_t
  use follow_points_mod, only: measure_points
  use passed_obstacles_mod, only: find_passed, part_that_would_do
  use drag_points_mod, only: drag_points
  use placement_mod, only: placement_t, place_curved, join_ends
  use follow_bodies_mod, only: has_moved, farthest_point, largest_deformation
  use transfer_mod, only: nodal_forces, gap_at
  use condensed_contact_mod, only: contact_group_t, is_on_bodies, neutral_motions, &
    unpressed_motions, are_left_out
  use near_points_mod, only: near_points, is_any_missed
  use step_solver_mod, only: step_solver_t
  use load_response_mod, only: follow_surfaces
  use neutral_motions_mod, only: neutral_step, unturned_motions, way_to_rest
  use trial_mod, only: trial_t, displacement_of
  use renew_tangent_mod, only: renew_tangent
  use place_and_solve_mod, only: newton_raphson_t, begin_newton_raphson, follow_free_bodies, &
    place_points, find_reactions, check_covered
  implicit none
  private

  public :: equilibrate

  real(wp), parameter :: nearby = 1.0e-2_wp
  !! of the way of an increment: so near the modes of the last iteration lead to the next [-]
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
    type(state_t), intent(inout) :: new              !! gets reaction, displacement, rotation
    type(increment_report_t), intent(inout) :: report
    type(error_t), allocatable, intent(out) :: error !! MUMPS failed
    real(wp), dimension(3, size(trial%u_free, 2)) :: residual, pressed !! [force]
    type(newton_raphson_t) :: loop
    logical :: is_missed, is_first, is_followed, has_joined, was_foreseen

    new%rotation = trial%rotation
    if (allocated(trial%placement%weights%alone)) new%alone = trial%placement%weights%alone
    is_missed = .false.
    is_first = .true.
    loop = begin_newton_raphson(scene, points, solver, trial)
    loop%modes = old%modes
    newton_raphson: do while (loop%i < trial%most_iterations)
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
      if (report%ending == ended_unbalanced) then
        if (allocated(loop%begun)) call abandon_inverse(solver%body%inverse)
        return
      end if

      ! 4. Displacement: of the interface alone until the points have settled.
      if (settles_on_interface(points, solver, loop, trial%most_iterations)) then
        call displace_interface(scene, points, solver, trial, new)
        call look_at_places(scene, points, solver, old, trial, new, loop, is_missed)
        if (is_missed .or. .not. are_places_settled(loop, merge(trial%controls%tolerance, &
          max(roughly, trial%controls%tolerance), is_exact(solver%choices%precision)))) then
          call lead(scene, points, solver, trial, new, loop)
          cycle newton_raphson
        end if
      end if
      call displace(scene, points, solver, trial, new, loop%begun, pressed, error)
      if (allocated(error)) return
      call rest(scene, points, solver, old, loop, trial, new)

      ! 5. Out-of-balance force, and how far the closest points have moved
      call update_forces(scene, solver%body%inverse%map, solver%body%motions, old, trial, new, &
        loop, report)
      if (report%worst_element > 0) exit newton_raphson
      if (was_foreseen) loop%modes = new%modes
      if (allocated(trial%support_force)) trial%support_force = merge(trial%forces%internal - &
        trial%forces%external - pressed, 0.0_wp, trial%forces%prescribed)
      trial%forces%rounding = force_rounding(scene%mesh, scene%materials, &
        max(abs(new%displacement), abs(old%displacement)))
      call find_residual(scene, solver%body%constraints, pressed, new%displacement, trial, &
        trial%controls%tolerance < solver%choices%tolerance, residual, loop)
      if (is_first) report%unrefined = max(report%unrefined, loop%imbalance)
      is_first = .false.
      report%imbalance = loop%imbalance
      report%without_contact = maxval(abs(trial%u_free))/max(tiny(1.0_wp), &
        maxval(abs(new%displacement)))
      call look_at_places(scene, points, solver, old, trial, new, loop, is_missed)
      if (is_settled(loop, trial, new%reaction, solver%choices%tolerance) .and. &
        .not. is_missed) then
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
      if (solver%choices%precision%renews_tangent .and. loop%imbalance > &
        trial%controls%tolerance) then
        call renew_tangent(scene, points, solver, tangent_t(new%displacement, trial%free, &
          projection=0.0_wp), trial, report, error)
        if (allocated(error) .or. report%ending == ended_indefinite) return
      end if
      call correct(solver, residual, trial, loop, error)
      if (allocated(error)) return
    end do newton_raphson
    if (allocated(loop%begun)) call abandon_inverse(solver%body%inverse)
    if (report%worst_element > 0 .or. (loop%imbalance > max(trial%controls%tolerance, &
      solver%choices%tolerance) .and. .not. loop%is_linear)) then
      report%converged = .false.
      report%ending = merge(ended_inverted, ended_out_of_balance, report%worst_element > 0)
      report%residual = loop%imbalance
      return
    end if
    report%moved = loop%moved
    report%moved_point = farthest_point(points, loop%follow, trial%placed_at, new%displacement)
    if (loop%moved <= loop%follow%allowed .and. .not. is_missed) then
      report%passed_point = find_passed(scene, points, trial%placement, old, new)
      if (report%passed_point == 0) then
        if (loop%imbalance > trial%controls%tolerance) call leave_to_reactions(scene%mesh, points, &
          trial%placement, residual, new%reaction)
        return
      end if
      report%converged = .false.
      report%ending = ended_passed
      report%part_to_try = part_that_would_do(scene, points, report%passed_point, old, new, &
        trial%placement)
      return
    end if
    ! Points do not settle by reactions that the solver did not find.
    if (.not. report%converged .and. scene%contact%solver /= solver_auto) return
    ! Nothing says that reactions found elsewhere hold here.
    report%converged = .false.
    report%ending = ended_moving
    report%residual = loop%moved
  end subroutine equilibrate

  !> Whether the forces balance and the points stay where they were placed, as far as either goes.
  !>
  !> Where the certificate asked for a closer balance than `asked`, that may be less than forces are
  !> rounded by: beyond the tenth iteration one that lowers the imbalance by less than a tenth is
  !> the last. (Plates of second order under a pressure stay at 3e-12 to 1e-11.)
  pure logical function is_settled(loop, trial, reaction, asked)
    type(newton_raphson_t), intent(in) :: loop
    type(trial_t), intent(in) :: trial
    real(wp), intent(in) :: reaction(:, :) !! (3,n_points) [force]
    real(wp), intent(in) :: asked          !! balance that every increment must reach [-]

    ! Progress is that of the force: where nothing presses a body, all its forces are out of
    ! balance, and no part of them falls as they do.
    if (loop%is_linear) then
      is_settled = loop%left > 0.5_wp*loop%last_left .and. .not. is_turned(trial, reaction, &
        trial%controls%tolerance)
    else
      is_settled = loop%imbalance <= asked .and. loop%left > 0.9_wp*loop%last_left .and. &
        loop%i > 10
    end if
    is_settled = is_settled .or. loop%imbalance <= trial%controls%tolerance
    is_settled = is_settled .and. are_places_settled(loop, trial%controls%tolerance)
    ! Contact was solved for what acceleration has mixed, not for the mixture.
    is_settled = is_settled .and. loop%mixed <= trial%controls%tolerance
  end function is_settled

  !> The internal forces of the displacement, which is accelerated first where they are not linear,
  !> and pressures on surfaces where it takes them.
  subroutine update_forces(scene, map, motions, old, trial, new, loop, report)
    type(scene_t), intent(in) :: scene
    type(dof_map_t), intent(in) :: map
    type(free_motions_t), intent(in) :: motions
    type(state_t), intent(in) :: old
    type(trial_t), intent(inout) :: trial             !! gets the forces
    type(state_t), intent(inout) :: new               !! its displacement, as of `extrapolate`
    type(newton_raphson_t), intent(inout) :: loop
    type(increment_report_t), intent(inout) :: report !! gets an element that is inside out

    if (.not. loop%is_linear) then
      call extrapolate(scene, map, motions, old, trial, new, loop)
      ! Iterations far away may find modes of no use to the next.
      if (.not. loop%apart < nearby) new%modes = loop%modes
      report%force_evaluations = report%force_evaluations + 1
    end if
    call find_internal_force(scene, trial%free, new%displacement, new%modes, &
      trial%forces%internal, report%worst_element)
    call follow_surfaces(scene, new%displacement, trial%forces%imposed_t)
  end subroutine update_forces

  !> The displacement at which forces are asked for next. With a factor of another
  !> place an iteration is a map from displacements to displacements, whose fixed point Anderson's
  !> acceleration finds; with the tangent of each iteration, where no pressures follow, it keeps
  !> nothing, and changes nothing.
  !> docs/theory.md (8.21).
  subroutine extrapolate(scene, map, motions, old, trial, new, loop)
    type(scene_t), intent(in) :: scene
    type(dof_map_t), intent(in) :: map
    type(free_motions_t), intent(in) :: motions
    type(state_t), intent(in) :: old
    type(trial_t), intent(inout) :: trial  !! its u_free and motion take the difference
    type(state_t), intent(inout) :: new    !! gets displacement
    type(newton_raphson_t), intent(inout) :: loop
    real(wp), dimension(map%n_free + motions%n) :: image, next
    real(wp) :: step(3, size(new%displacement, 2)), way
    integer :: j

    image = [unknowns_of(map, new%displacement), trial%motion]
    if (.not. allocated(loop%at)) then
      loop%memory = new_anderson(size(image), loop%depth)
      loop%apart = huge(1.0_wp)
    else
      way = max(maxval(abs(new%displacement - old%displacement)), &
        largest_deformation(scene%mesh, new%displacement))
      associate (before => loop%last_apart)
        loop%apart = 0.0_wp
        if (way > 0.0_wp) loop%apart = maxval(abs(image - loop%at))/way
        if (0.5_wp*loop%apart > before) call forget(loop%memory)
        before = loop%apart
      end associate
      call accelerate(loop%memory, loop%at, image, next)
      if (way > 0.0_wp) loop%mixed = maxval(abs(next - image))/way
      call to_nodes(map, next(:map%n_free) - image(:map%n_free), step)
      associate (further => next(map%n_free + 1:) - image(map%n_free + 1:))
        do j = 1, motions%n
          step(motions%dof(j), motions%node(j)) = further(j)
        end do
        ! Nodes may go with a pin.
        if (map%constraints%n > 0) call follow_masters(map%constraints, step)
        new%displacement = new%displacement + step
        trial%motion = trial%motion + further
        call add_motions(motions, scene%mesh, -further, step)
      end associate
      trial%u_free = trial%u_free + step
      call settle(scene, motions, trial, new%displacement)
      image = next
    end if
    loop%at = image
  end subroutine extrapolate

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

  !> Whether the points stay where they were placed, as far as that goes.
  pure logical function are_places_settled(loop, tolerance) result(are_settled)
    type(newton_raphson_t), intent(in) :: loop
    real(wp), intent(in) :: tolerance !! [-]

    are_settled = loop%moved <= tolerance .or. (loop%moved > 0.9_wp*loop%last_moved .and. &
      loop%i > 10 .and. loop%moved <= loop%follow%allowed)
  end function are_places_settled

  !> Whether places are to settle before the interior is asked for: contact sees the interface
  !> alone, and what it does follows from the compliance, which takes far less than a solution with
  !> the factor. Not where a correction waits for its interior, nor where neutral motions come to
  !> rest by what all of their body does, nor where forces are not linear: iterations take
  !> placements along. Surfaces move again as an inexact factor is refined: that is done at once.
  pure logical function settles_on_interface(points, solver, loop, most)
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    type(newton_raphson_t), intent(in) :: loop
    integer, intent(in) :: most !! iterations

    associate (inverse => solver%body%inverse, n => solver%body%motions%n)
      settles_on_interface = loop%is_linear .and. any(points%is_curved) .and. &
        inverse%is_condensed .and. &
        inverse%map%n_interface > 0 .and. loop%i < most .and. .not. &
        (allocated(inverse%iterative) .or. allocated(loop%begun))
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

  !> Whether turned normals leave forces along neutral motions, beside the largest reaction.
  pure logical function is_turned(trial, reaction, allowed)
    type(trial_t), intent(in) :: trial
    real(wp), intent(in) :: reaction(:, :) !! (3,n_points) [force]
    real(wp), intent(in) :: allowed        !! [-]

    is_turned = .false.
    if (size(trial%motion) > 0) is_turned = any(abs(trial%neutral_residual) > &
      allowed*maxval(abs(reaction)))
  end function is_turned

  !> Take in what turned normals leave along neutral motions.
  subroutine lead(scene, points, solver, trial, new, loop)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    type(trial_t), intent(inout) :: trial  !! gets the way along them
    type(state_t), intent(inout) :: new    !! likewise
    type(newton_raphson_t), intent(inout) :: loop
    logical :: is_led

    loop%last_moved = loop%moved
    is_led = is_turned(trial, new%reaction, trial%controls%tolerance)
    ! What a placement that still moves leaves on them says nothing.
    if (size(loop%follow%node) > 0) is_led = is_led .and. is_turned(trial, new%reaction, loop%moved)
    if (.not. is_led) return
    call neutral_step(scene, points, solver%body%motions, neutral_motions(solver%contact, &
      solver%body%motions%n), trial%placement, new, trial%neutral_residual, loop%last_led)
    associate (step => loop%last_led%step)
      loop%led = loop%led + step
      trial%motion = trial%motion + step
      call add_motions(solver%body%motions, scene%mesh, step, new%displacement)
    end associate
  end subroutine lead

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
    if (loop%imbalance <= trial%controls%tolerance) return
    if (is_on_bodies(solver%contact) .and. .not. trial%by_compliance) then
      ! What iteration has not solved is out of balance too, but no load.
      call to_equations(solver%body%inverse%map, residual, change)
      associate (motions => solver%body%motions)
        trial%load_left = trial%load_left + [change, (residual(motions%dof(j), motions%node(j)), &
          j=1, motions%n)] + trial%unsolved
      end associate
      return
    end if
    ! Contact sees the correction of the interface; that of the interior comes with its answer.
    call begin_inverse(solver%body%inverse, residual, loop%begun, correction, error)
    if (allocated(error)) return
    trial%u_free = trial%u_free + correction
  end subroutine correct

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

  !> The displacement with the reactions of `new`.
  subroutine displace(scene, points, solver, trial, new, begun, pressed, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(inout) :: solver
    type(trial_t), intent(inout) :: trial              !! gets what contact has displaced
    type(state_t), intent(inout) :: new                !! gets displacement
    real(wp), allocatable, intent(inout) :: begun(:)   !! a correction by the factor, spent [length]
    real(wp), intent(out) :: pressed(:, :)             !! (3,n_nodes) by contact [force]
    type(error_t), allocatable, intent(out) :: error   !! MUMPS failed
    real(wp) :: change(3, size(pressed, 2))            !! [force]
    real(wp) :: correction(3, size(pressed, 2))        !! [length]

    pressed = nodal_forces(points, trial%placement%weights, new%reaction, size(pressed, 2))
    change = change_of_force(points, trial, new%reaction)
    if (allocated(begun) .or. any(abs(change) > 0.0_wp)) then
      ! Of the change alone: what an inexact factor makes of it gets less and less.
      call finish_inverse(solver%body%inverse, change, begun, correction, error)
      if (allocated(error)) return
      trial%u_contact = trial%u_contact + correction
      trial%applied_reaction = new%reaction
      trial%applied_force = pressed
    end if
    new%displacement = displacement_of(scene, solver, trial, trial%u_contact)
    call settle(scene, solver%body%motions, trial, new%displacement)
  end subroutine displace

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

  !> The displacement of the interface with the reactions of `new`; that of the interior is without
  !> what they have changed.
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

  !> Let motions that nothing which presses sees go where their bodies were when the increment
  !> began, but for what turned normals led them; neutral ones alone where others would close a gap,
  !> and where nothing presses as far as to where the first gap closes.
  !> Before round obstacles alone these are restricted to motions that turn no normal at a pressing
  !> point: turned normals decide where the others come to rest.
  subroutine rest(scene, points, solver, old, loop, trial, new)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    type(state_t), intent(in) :: old
    type(newton_raphson_t), intent(in) :: loop
    type(trial_t), intent(inout) :: trial !! gets its motion
    type(state_t), intent(inout) :: new   !! gets displacement
    real(wp) :: moved(3, scene%mesh%n_nodes), way(size(loop%led))
    integer :: i

    associate (motions => solver%body%motions)
      if (motions%n == 0) return
      moved = new%displacement - old%displacement
      call add_motions(motions, scene%mesh, -loop%led, moved)
      way = 0.0_wp
      do i = 1, size(solver%contact%group)
        if (size(solver%contact%group(i)%motion) > 0) call rest_group(solver%contact%group(i))
      end do
      if (all(abs(way) <= 0.0_wp)) return
      trial%motion = trial%motion + way
      call add_motions(motions, scene%mesh, way, new%displacement)
      call settle(scene, motions, trial, new%displacement)
    end associate

  contains

    subroutine rest_group(group)
      type(contact_group_t), intent(in) :: group
      real(wp), allocatable :: unpressed(:, :), neutral(:, :)
      real(wp) :: part

      allocate (unpressed(0, 0), neutral(0, 0))
      associate (motions => solver%body%motions, list => group%motion)
        unpressed = unpressed_motions(group, new%reaction)
        neutral = group%floating%neutral
        if (size(loop%follow%node) == 0 .and. any(points%is_curved)) then
          unpressed = unturned_motions(scene, points, motions, list, unpressed, trial%placement, &
            new)
          neutral = unturned_motions(scene, points, motions, list, neutral, trial%placement, new)
        end if
        if (size(unpressed, 2) == 0) return
        way(list) = way_to_rest(scene, motions, list, unpressed, moved)
        if (size(unpressed, 2) == size(neutral, 2)) return
        part = part_of_way(group, way(list))
        if (.not. part < 1.0_wp) return
        if (size(unpressed, 2) == size(list)) then
          way(list) = part*way(list)
        else
          way(list) = way_to_rest(scene, motions, list, neutral, moved)
        end if
      end associate
    end subroutine rest_group

    !> How much of a way the motions can go until a gap closes, 1 if they can go all of it.
    pure real(wp) function part_of_way(group, way) result(part)
      type(contact_group_t), intent(in) :: group
      real(wp), intent(in) :: way(:) !! of the group's motions [length]
      real(wp) :: change, gap
      integer :: k

      part = 1.0_wp
      do k = 1, size(group%active)
        if (group%problem%row(1, k) == 0) cycle
        change = dot_product(group%floating%g(group%problem%row(1, k), :), way)
        if (.not. change < 0.0_wp) cycle
        gap = gap_at(trial%placement, points, group%active(k), new%displacement)
        if (gap + change < 0.0_wp) part = min(part, max(0.0_wp, -gap/change))
      end do
    end function part_of_way

  end subroutine rest

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

  !> Leave what displacements cannot balance any closer to the reactions at the same nodes, where
  !> these press a fixed obstacle and do not slide: internal forces of displacements that are what
  !> they should be are known better than reactions from a compliance.
  pure subroutine leave_to_reactions(mesh, points, placement, residual, reaction)
    type(mesh_t), intent(in) :: mesh
    type(contact_points_t), intent(in) :: points
    type(placement_t), intent(in) :: placement
    real(wp), intent(in) :: residual(:, :)       !! (3,n_nodes) [force]
    real(wp), intent(inout) :: reaction(:, :)    !! (3,n_points) x, y, z [force]
    real(wp) :: r(3), part(3)
    integer :: i, n_pressed(mesh%n_nodes)

    if (allocated(points%alpha)) return ! forces on edges are of several points
    n_pressed = 0
    do i = 1, points%n
      if (any(abs(reaction(:, i)) > 0.0_wp)) n_pressed(points%node(i)) = n_pressed(points%node(i)) &
        + 1
    end do
    do i = 1, points%n
      if (points%on_surface(i) .or. n_pressed(points%node(i)) /= 1) cycle
      r = matmul(reaction(:, i), placement%frame(:, :, i))
      part = matmul(residual(:, points%node(i)), placement%frame(:, :, i))
      if (points%mu(i) <= 0.0_wp) part(2:) = 0.0_wp
      r = r - part
      if (.not. r(1) > 0.0_wp .or. norm2(r(2:)) > points%mu(i)*r(1)) cycle
      reaction(:, i) = matmul(placement%frame(:, :, i), r)
    end do
  end subroutine leave_to_reactions

  !> What is out of balance, as of `out_of_balance`, by the constraints where the bodies are.
  subroutine find_residual(scene, active, pressed, u, trial, closely, residual, loop)
    type(scene_t), intent(in) :: scene
    type(constraints_t), intent(in) :: active !! those of the factor, chains substituted
    real(wp), intent(in) :: pressed(:, :)     !! (3,n_nodes) by contact [force]
    real(wp), intent(in) :: u(:, :)           !! (3,n_nodes) [length]
    type(trial_t), intent(in) :: trial        !! its forces
    logical, intent(in) :: closely            !! as of `out_of_balance`
    real(wp), intent(out) :: residual(:, :)   !! (3,n_nodes) [force]
    type(newton_raphson_t), intent(inout) :: loop !! gets its imbalance, and what is left

    associate (forces => trial%forces)
      residual = forces%external
      if (allocated(trial%turned_from)) then
        call turn_moments(scene, forces%prescribed, u, residual)
        residual = residual + pressed - forces%internal
        call out_of_balance(scene%mesh, active_constraints(turned_constraints(scene, &
          forces%prescribed, u), forces%prescribed), forces, closely, residual, loop%imbalance, &
          loop%left)
      else
        residual = residual + pressed - forces%internal
        call out_of_balance(scene%mesh, active, forces, closely, residual, loop%imbalance, &
          loop%left)
      end if
    end associate
  end subroutine find_residual

  !> f_ext + B^T r - f_int on the free degrees of freedom, and the largest of a node beside the
  !> largest force of its body, less what rounding makes of it.
  !>
  !> Rounding of many nodes may add up in the balance of a body: where the certificate has not
  !> passed it is no excuse, and what is left is taken out as far as it goes.
  pure subroutine out_of_balance(mesh, active, forces, closely, residual, relative, left)
    type(mesh_t), intent(in) :: mesh
    type(constraints_t), intent(in) :: active               !! chains substituted
    type(increment_forces_t), intent(in) :: forces
    logical, intent(in) :: closely                          !! rounding is no excuse
    real(wp), intent(inout) :: residual(:, :)
    !! (3,n_nodes) of all nodes in; given to masters, 0 where prescribed out [force]
    real(wp), intent(out) :: relative                       !! [-]
    real(wp), intent(out) :: left                           !! of the same node [force]
    real(wp) :: scale(0:mesh%n_bodies), rounding(mesh%n_nodes)
    integer :: node, c, k

    call give_to_masters(active, residual)
    rounding = forces%rounding
    do c = 1, active%n
      do k = active%first(c), active%first(c + 1) - 1
        associate (of_master => rounding(active%master(k)))
          of_master = of_master + abs(active%weight(k))*forces%rounding(active%node(c))
        end associate
      end do
    end do
    where (forces%prescribed) residual = 0.0_wp
    scale = 0.0_wp
    if (allocated(forces%of_elements%largest)) scale = forces%of_elements%largest
    do node = 1, mesh%n_nodes
      associate (of_body => scale(mesh%body(node)))
        of_body = max(of_body, norm2(forces%internal(:, node)), norm2(forces%external(:, node)))
      end associate
    end do
    scale(0) = maxval(scale)
    where (scale <= 0.0_wp) scale = 1.0_wp
    relative = 0.0_wp
    left = 0.0_wp
    do node = 1, mesh%n_nodes
      associate (beyond => norm2(residual(:, node)) - merge(0.0_wp, rounding(node), closely), &
        of_body => scale(mesh%body(node)))
        if (beyond <= relative*of_body) cycle
        relative = beyond/of_body
        left = beyond
      end associate
    end do
  end subroutine out_of_balance

end module equilibrate_mod
