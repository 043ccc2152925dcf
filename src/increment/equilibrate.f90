!> Steps 2 to 5 of an increment (advance_mod): the Newton-Raphson loop in which reactions,
!> displacement and the placement of the contact points come to agree.
!>
!> Before a surface each placement is made where Anderson's acceleration says (docs/theory.md
!> section 11).
module equilibrate_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t, raise, exit_not_solved
  use constraints_mod, only: constraints_t, give_to_masters
  use mesh_mod, only: mesh_t
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t
  use increment_report_mod, only: increment_report_t, ended_well, ended_unbalanced, &
    ended_moving
  use mesh_forces_mod, only: internal_force, force_rounding
  use rigid_modes_mod, only: add_motions
  use dof_map_mod, only: to_equations
  use stiffness_inverse_mod, only: begin_inverse, finish_inverse, abandon_inverse
  use increment_forces_mod, only: increment_forces_t
  use follow_points_mod, only: measure_points, rounding_of_places
  use drag_points_mod, only: drag_points
  use placement_mod, only: placement_t, place_curved
  use follow_bodies_mod, only: follow_t, begin_following, has_moved, next_place, &
    farthest_point
  use transfer_mod, only: nodal_forces
  use condensed_contact_mod, only: condense_contact, count_rows, is_on_bodies, neutral_motions, &
    are_left_out
  use near_points_mod, only: near_points, is_any_missed
  use step_solver_mod, only: step_solver_t
  use neutral_motions_mod, only: neutral_step, way_to_rest
  use trial_mod, only: trial_t, displacement_of
  use solve_reactions_mod, only: solve_reactions
  implicit none
  private

  public :: equilibrate

  integer, parameter :: max_newton_raphson = 40
  integer, parameter :: most_by_parts = 20 !! iterations in which points may be left out
  real(wp), parameter :: sharpest = 1.0e-12_wp !! residual below which nothing is asked for [-]

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
    real(wp) :: correction(3, size(trial%u_free, 2)) !! [length]
    real(wp) :: change(solver%body%inverse%map%n_free) !! of the load of iterations [force]
    real(wp) :: imbalance, left, last_left, moved, last_moved
    real(wp) :: step(solver%body%motions%n) !! of the neutral motions [length]
    real(wp) :: led(solver%body%motions%n)  !! by these steps so far [length]
    type(placement_t) :: undeformed
    integer :: i, j
    real(wp), dimension(3, points%n) :: reaction !! that a solution began from [force]
    real(wp) :: motion(solver%body%motions%n)    !! likewise [length]
    logical :: balanced, settled, is_turned
    real(wp), allocatable :: begun(:) !! a correction by the factor, its interior to come [length]
    type(follow_t) :: follow          !! of surfaces
    logical :: near(points%n)         !! points that may touch, as far as is known
    logical :: is_missed              !! one of the others touches
    real(wp) :: slack                 !! gap that counts as none [length]

    new%rotation = trial%rotation
    near = points%in_reach
    slack = 0.0_wp
    undeformed = turned_undeformed(scene, points, solver, trial)
    follow = begin_following(scene, points, trial%controls%tolerance)
    led = 0.0_wp
    last_left = huge(1.0_wp)
    last_moved = huge(1.0_wp)
    newton_raphson: do i = 1, max_newton_raphson
      report%newton_raphson_iterations = report%newton_raphson_iterations + 1

      ! 2. and 3. Reactions, and the free motions with them
      if (any(points%is_curved)) then
        if (i > 1) call next_place(follow, i - 1, last_moved, new%displacement, &
          trial%placed_at)
        call place_curved(scene, points, trial%placed_at, trial%placement, trial%rotation, &
          stay=i > 1)
        call drag_points(scene, points, old, trial%placed_at, trial%rotation, trial%placement)
        slack = 10.0_wp*trial%controls%tolerance*maxval(abs(trial%placed_at)) + &
          rounding_of_places(scene, trial%placed_at)
        if (i == 1) near = first_near(scene, points, solver, old, trial, new%reaction, slack)
        if (i > most_by_parts) near = points%in_reach
        call condense_contact(scene, points, solver%body, undeformed, trial%placement, .true., &
          near, solver%contact)
      end if
      call check_covered(points, solver, error)
      if (allocated(error)) return
      if (.not. trial%is_foreseen) then
        reaction = new%reaction
        motion = trial%motion
        call solve_sharply(scene, points, solver, old, size(follow%node) > 0, trial, &
          new%reaction, report)
        if (any(are_left_out(solver%contact, points%n)) .and. .not. report%converged) then
          ! The others may be what holds the bodies.
          near = points%in_reach
          new%reaction = reaction
          trial%motion = motion
          call condense_contact(scene, points, solver%body, undeformed, trial%placement, .true., &
            near, solver%contact)
          call solve_sharply(scene, points, solver, old, size(follow%node) > 0, trial, &
            new%reaction, report)
        end if
      end if
      trial%is_foreseen = .false.
      call take_failure(solver, error)
      if (allocated(error)) return
      if (report%ending == ended_unbalanced) then
        if (allocated(begun)) call abandon_inverse(solver%body%inverse)
        return
      end if

      ! 4. Displacement
      call displace(scene, points, solver, trial, new, begun, pressed, error)
      if (allocated(error)) return
      if (size(follow%node) > 0) call rest(scene, solver, old, led, trial, new)

      ! 5. Out-of-balance force, and how far the closest points have moved
      call internal_force(scene%mesh, scene%materials, new%displacement, trial%forces%internal)
      trial%forces%rounding = force_rounding(scene%mesh, scene%materials, &
        max(abs(new%displacement), abs(old%displacement)))
      call out_of_balance(scene%mesh, solver%body%constraints, pressed, trial%forces, &
        trial%controls%tolerance < scene%contact%tolerance, residual, imbalance, left)
      if (i == 1) report%unrefined = max(report%unrefined, imbalance)
      report%imbalance = imbalance
      moved = max(moved_from(scene, points, trial%placement, old, new), &
        has_moved(scene%mesh, follow, old%displacement, trial%placed_at, new%displacement))
      is_turned = .false.
      if (solver%body%motions%n > 0) is_turned = any(abs(trial%neutral_residual) > &
        trial%controls%tolerance*maxval(abs(new%reaction)))
      ! Progress is that of the force: where nothing presses a body, all its forces are out of
      ! balance, and no part of them falls as they do.
      balanced = imbalance <= trial%controls%tolerance .or. &
        (left > 0.5_wp*last_left .and. .not. is_turned)
      settled = moved <= trial%controls%tolerance .or. (moved > 0.9_wp*last_moved .and. &
        i > 10 .and. moved <= follow%allowed)
      is_missed = is_any_missed(points, trial%placement, are_left_out(solver%contact, points%n), &
        new%displacement, slack)
      if (balanced .and. settled .and. .not. is_missed) exit newton_raphson
      if (.not. all(near .or. .not. points%in_reach)) near = (near .and. i > 1) .or. near_points( &
        points, trial%placement, old, new%displacement, new%reaction, slack)
      last_left = left
      last_moved = moved
      ! What a placement that still moves leaves on them says nothing.
      if (size(follow%node) > 0) is_turned = is_turned .and. any(abs(trial%neutral_residual) > &
        moved*maxval(abs(new%reaction)))
      if (is_turned) then
        step = neutral_step(scene, points, solver%body%motions, neutral_motions(solver%contact, &
          solver%body%motions%n), trial%placement, new, trial%neutral_residual)
        led = led + step
        trial%motion = trial%motion + step
        call add_motions(solver%body%motions, scene%mesh, step, new%displacement)
      end if
      if (imbalance <= trial%controls%tolerance) cycle newton_raphson
      if (is_on_bodies(solver%contact) .and. .not. trial%by_compliance) then
        ! What iteration has not solved is out of balance too, but no load.
        call to_equations(solver%body%inverse%map, residual, change)
        associate (motions => solver%body%motions)
          trial%left = trial%left + [change, (residual(motions%dof(j), motions%node(j)), &
            j=1, motions%n)] + trial%unsolved
        end associate
        cycle newton_raphson
      end if
      ! Contact sees the correction of the interface; that of the interior comes with its answer.
      call begin_inverse(solver%body%inverse, residual, begun, correction, error)
      if (allocated(error)) return
      trial%u_free = trial%u_free + correction
    end do newton_raphson
    if (allocated(begun)) call abandon_inverse(solver%body%inverse)
    report%moved = moved
    report%moved_point = farthest_point(points, follow, trial%placed_at, new%displacement)
    if (moved <= follow%allowed .and. .not. is_missed) return
    ! Nothing says that reactions found elsewhere hold here.
    report%converged = .false.
    report%ending = ended_moving
    report%residual = moved
  end subroutine equilibrate

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
    if (allocated(solver%body%inverse%iterative)) return
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

    associate (weights => trial%placement%weights, n => size(pressed, 2))
      pressed = nodal_forces(points, weights, new%reaction, n)
      ! What the reactions have changed, and what the weights have.
      change = nodal_forces(points, weights, new%reaction - trial%applied_reaction, n) + &
        (nodal_forces(points, weights, trial%applied_reaction, n) - trial%applied_force)
    end associate
    if (allocated(begun) .or. any(abs(change) > 0.0_wp)) then
      ! Of the change alone: what an inexact factor makes of it gets less and less.
      call finish_inverse(solver%body%inverse, change, begun, correction, error)
      if (allocated(error)) return
      trial%u_contact = trial%u_contact + correction
      trial%applied_reaction = new%reaction
      trial%applied_force = pressed
    end if
    new%displacement = displacement_of(scene, solver, trial, trial%u_contact)
  end subroutine displace

  !> Let neutral motions go where their bodies were when the increment began, but for what turned
  !> normals led them.
  subroutine rest(scene, solver, old, led, trial, new)
    type(scene_t), intent(in) :: scene
    type(step_solver_t), intent(in) :: solver
    type(state_t), intent(in) :: old
    real(wp), intent(in) :: led(:)        !! (n_motions) [length]
    type(trial_t), intent(inout) :: trial !! gets its motion
    type(state_t), intent(inout) :: new   !! gets displacement
    real(wp) :: moved(3, scene%mesh%n_nodes), way(size(led))
    real(wp), allocatable :: neutral(:, :)

    associate (motions => solver%body%motions)
      if (motions%n == 0) return
      allocate (neutral, source=neutral_motions(solver%contact, motions%n))
      if (size(neutral, 2) == 0) return
      moved = new%displacement - old%displacement
      call add_motions(motions, scene%mesh, -led, moved)
      way = way_to_rest(scene, motions, neutral, moved)
      trial%motion = trial%motion + way
      call add_motions(motions, scene%mesh, way, new%displacement)
    end associate
  end subroutine rest

  !> The points of the undeformed mesh before obstacles as they stand at the end of the increment.
  pure function turned_undeformed(scene, points, solver, trial) result(undeformed)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    type(trial_t), intent(in) :: trial
    type(placement_t) :: undeformed
    real(wp) :: nothing(3, scene%mesh%n_nodes)

    undeformed = solver%undeformed
    if (.not. any(scene%obstacles%turns)) return
    nothing = 0.0_wp
    call place_curved(scene, points, nothing, undeformed, trial%rotation)
  end function turned_undeformed

  !> The reactions; where placements are followed, ten times sharper than asked for as far as that
  !> is within reach: what reactions leave open no placement can settle.
  subroutine solve_sharply(scene, points, solver, old, is_followed, trial, reaction, report)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(inout) :: solver
    type(state_t), intent(in) :: old
    logical, intent(in) :: is_followed
    type(trial_t), intent(inout) :: trial
    real(wp), intent(inout) :: reaction(:, :) !! (3,n_points) [force]
    type(increment_report_t), intent(inout) :: report
    real(wp) :: wanted

    wanted = trial%controls%tolerance
    if (is_followed) trial%controls%tolerance = min(wanted, max(sharpest, 0.1_wp*wanted))
    call solve_reactions(scene, points, solver, old, trial, reaction, report)
    trial%controls%tolerance = wanted
    if (report%converged .or. report%ending == ended_unbalanced) return
    if (.not. (is_followed .and. report%residual <= wanted)) return
    report%converged = .true.
    report%ending = ended_well
  end subroutine solve_sharply

  !> How far the points before curved obstacles are from where they were placed, as of
  !> `measure_points`.
  pure real(wp) function moved_from(scene, points, placement, old, new) result(moved)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(placement_t), intent(in) :: placement
    type(state_t), intent(in) :: old, new
    type(placement_t) :: now

    moved = 0.0_wp
    if (.not. any(points%is_curved .and. scene%pairs(points%pair)%master > 0)) return
    now = placement
    call place_curved(scene, points, new%displacement, now, new%rotation, stay=.true.)
    call drag_points(scene, points, old, new%displacement, new%rotation, now)
    call measure_points(scene, points, placement, now, old, new, moved)
  end function moved_from

  !> f_ext + B^T r - f_int on the free degrees of freedom, and the largest of a node beside the
  !> largest force of its body, less what rounding makes of it.
  !>
  !> Rounding of many nodes may add up in the balance of a body: where the certificate has not
  !> passed it is no excuse, and what is left is taken out as far as it goes.
  pure subroutine out_of_balance(mesh, active, pressed, forces, closely, residual, relative, left)
    type(mesh_t), intent(in) :: mesh
    type(constraints_t), intent(in) :: active               !! chains substituted
    real(wp), intent(in) :: pressed(:, :)                   !! (3,n_nodes) by contact [force]
    type(increment_forces_t), intent(in) :: forces
    logical, intent(in) :: closely                          !! rounding is no excuse
    real(wp), intent(out) :: residual(:, :)                 !! (3,n_nodes) [force]
    real(wp), intent(out) :: relative                       !! [-]
    real(wp), intent(out) :: left                           !! of the same node [force]
    real(wp) :: scale(0:mesh%n_bodies), rounding(mesh%n_nodes)
    integer :: node, c, k

    residual = forces%external + pressed - forces%internal
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
