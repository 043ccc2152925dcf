!> Equilibrium by displacements and reactions together, for an increment's trial.
module balance_together_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t
  use scene_mod, only: scene_t
  use controls_mod, only: solver_auto
  use contact_points_mod, only: contact_points_t, laws_of_points
  use state_mod, only: state_t
  use increment_report_mod, only: increment_report_t, ending_t, has_converged, ended_unbalanced
  use bodies_mod, only: is_linear
  use inertia_mod, only: force_of_inertia
  use turning_couplings_mod, only: has_turning, has_turning_unknowns
  use transfer_mod, only: movable
  use rigid_modes_mod, only: free_motions_t
  use describe_motions_mod, only: motion_in_words, free_in_words
  use pull_off_mod, only: pulls_off
  use problem_mod, only: pack_rows
  use floating_mod, only: resisting_rows
  use condensed_contact_mod, only: count_points
  use condense_contact_mod, only: condense_contact
  use placement_mod, only: placement_t
  use follow_points_mod, only: rounding_of_places
  use near_points_mod, only: near_points
  use iterate_mod, only: task_t, iterate_t
  use find_equilibrium_mod, only: find_equilibrium
  use closed_points_mod, only: stay_closed, keep_closed
  use step_solver_mod, only: step_solver_t
  use trial_mod, only: trial_t, from_before
  use turned_bodies_mod, only: begin_where_turned
  use equilibrate_mod, only: equilibrate, refuse_passed
  implicit none
  private

  public :: is_together, keeps_tangent, reach_balance

contains

  !> Whether displacements and reactions are found together: at finite strain, with the tangent of
  !> every iteration, unless the deck names a contact solver.
  pure logical function is_together(scene, solver)
    type(scene_t), intent(in) :: scene
    type(step_solver_t), intent(in) :: solver

    is_together = solver%choices%precision%renews_tangent .and. scene%finite_strain .and. &
      scene%contact%solver == solver_auto
  end function is_together

  !> Whether increments are solved with a tangent's factor that is kept as long as it serves.
  pure logical function keeps_tangent(scene, solver)
    type(scene_t), intent(in) :: scene
    type(step_solver_t), intent(in) :: solver

    keeps_tangent = .not. is_linear(scene)
    if (solver%choices%precision%renews_tangent) keeps_tangent = is_together(scene, solver) .and. &
      .not. has_turning_unknowns(scene)
  end function keeps_tangent

  !> Displacement and reactions in balance, together or each in its turn.
  subroutine reach_balance(scene, points, solver, old, trial, new, report, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(inout) :: solver
    type(state_t), intent(in) :: old
    type(trial_t), intent(inout) :: trial
    type(state_t), intent(inout) :: new              !! as of `equilibrate`
    type(increment_report_t), intent(inout) :: report
    type(error_t), allocatable, intent(out) :: error !! MUMPS failed

    if (is_together(scene, solver)) then
      call balance_together(scene, points, solver, old, trial, new, report, error)
    else
      call equilibrate(scene, points, solver, old, trial, new, report, error)
    end if
  end subroutine reach_balance

  !> Displacement and reactions in balance, together.
  subroutine balance_together(scene, points, solver, old, trial, new, report, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(inout) :: solver     !! gets the contact problem there
    type(state_t), intent(in) :: old
    type(trial_t), intent(inout) :: trial            !! gets forces and placement
    type(state_t), intent(inout) :: new
    !! where to start from; the end, and which points are closed there
    type(increment_report_t), intent(inout) :: report
    type(error_t), allocatable, intent(out) :: error !! no memory
    type(task_t) :: task
    type(iterate_t) :: found
    real(wp) :: slack !! gap that counts as none [length]
    integer :: k

    task%forces = trial%forces
    task%free = trial%free
    task%of_elements = solver%body%of_elements
    task%rotation = trial%rotation
    if (has_turning(scene)) task%turned_from = trial%turned_from
    if (allocated(solver%body%inertia)) then
      task%inertia = solver%body%inertia
      task%in_motion = trial%in_motion
    end if
    task%began = trial%began
    if (allocated(trial%placement%weights%alone)) task%began%weights%alone = &
      trial%placement%weights%alone
    task%can_move = movable(scene, solver%body%prescribed)
    task%tolerance = trial%tolerance
    task%asked = trial%goal%tolerance
    task%old = old
    task%stays = stay_closed(scene, points, solver%undeformed, old)
    allocate (task%is_free(0:scene%mesh%n_bodies), source=.false.)
    task%is_free(solver%body%motions%body) = .true.
    new%rotation = trial%rotation
    if (trial%goal%start /= from_before) new%displacement = merge(task%forces%displacement, &
      trial%placed_at, task%forces%prescribed)
    call begin_where_turned(scene, points, task%forces, solver%body%motions, new, trial%has_turned)
    ! What turns does not go on along a line.
    if (trial%is_extrapolated .and. .not. trial%has_turned) new%displacement = merge( &
      task%forces%displacement, trial%placed_at, task%forces%prescribed)
    if (allocated(trial%placement%weights%alone)) new%alone = trial%placement%weights%alone
    call find_equilibrium(scene, points, task, solver%body, new, found, report, error)
    if (allocated(error)) return
    trial%forces = found%forces
    if (allocated(task%inertia)) trial%in_motion%force = force_of_inertia(scene%mesh, &
      task%inertia, task%in_motion, new%displacement)
    trial%placement = found%placement
    ! What the points did is described by the contact problem there.
    slack = 10.0_wp*trial%tolerance*maxval(abs(new%displacement)) + rounding_of_places( &
      scene, new%displacement)
    call condense_contact(scene, trial%goal%tolerance, points, solver%body, trial%placement, &
      trial%placement, solver%contact, near_points(points, trial%placement, old, &
      new%displacement, new%reaction, slack))
    do k = 1, size(solver%contact%group)
      associate (group => solver%contact%group(k))
        group%problem%stays = task%stays(group%active)
        call laws_of_points(points, group%active, trial%placement%covered_area, group%problem%law)
      end associate
    end do
    if (allocated(found%falls)) then
      call name_motion(scene, points, solver%body%motions, task, found, report)
      return
    end if
    call keep_closed(scene, points, solver%undeformed, trial%placement%weights, old, new)
    if (has_converged(report)) call refuse_passed(scene, points, trial%placement, old, new, report)
    if (has_converged(report) .and. solver%body%motions%n > 0) call name_unheld(scene, solver, &
      trial%placement, found, new, report)
  end subroutine balance_together

  !> Which motions nothing resists, for the notes.
  subroutine name_unheld(scene, solver, placement, found, new, report)
    type(scene_t), intent(in) :: scene
    type(step_solver_t), intent(in) :: solver        !! its contact problem is there
    type(placement_t), intent(in) :: placement
    type(iterate_t), intent(in) :: found
    type(state_t), intent(in) :: new
    type(increment_report_t), intent(inout) :: report
    real(wp) :: resisting(3*count_points(solver%contact), solver%body%motions%n)
    real(wp), allocatable :: x(:, :), r(:, :)
    integer :: i, k, n

    n = 0
    resisting = 0.0_wp
    do i = 1, size(solver%contact%group)
      associate (group => solver%contact%group(i))
        if (size(group%motion) == 0) cycle
        allocate (x(3, size(group%active)), r(3, size(group%active)))
        do k = 1, size(group%active)
          associate (point => group%active(k), frame => placement%frame(:, :, group%active(k)))
            r(:, k) = matmul(new%reaction(:, point), frame)
            x(:, k) = [found%x(1, point), matmul(found%slip(:, point), frame(:, 2:))]
          end associate
        end do
        associate (rows => resisting_rows(group%problem, group%floating, r, pack_rows( &
                   group%problem, x), .true.))
          resisting(n + 1:n + size(rows, 1), group%motion) = rows
          n = n + size(rows, 1)
        end associate
        deallocate (x, r)
      end associate
    end do
    call free_in_words(scene%mesh, solver%body%motions, resisting(:n, :), report%n_unheld, &
      report%unheld)
  end subroutine name_unheld

  !> Which motion nothing balances, for the message.
  subroutine name_motion(scene, points, motions, task, found, report)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(free_motions_t), intent(in) :: motions
    type(task_t), intent(in) :: task
    type(iterate_t), intent(in) :: found
    type(increment_report_t), intent(inout) :: report
    real(wp) :: coefficient(motions%n)
    integer :: i

    do i = 1, motions%n
      coefficient(i) = found%falls(motions%dof(i), motions%node(i))
    end do
    report%ending = ending_t(ended_unbalanced, motions=motion_in_words(scene%mesh, motions, &
      coefficient), pulls_off=pulls_off(scene%mesh, points, found%placement, motions, &
      coefficient, task%forces%external))
  end subroutine name_motion

end module balance_together_mod
