!> One load increment: the Newton-Raphson loop of [JFT07] eq. (1) around the condensed contact
!> problem.
!>
!>   1. Loads of the increment; displacement u_free under them without contact.
!>   2. Closest points on curved obstacles; x_free: where the contact points would be.
!>   3. Reactions: the contact problem x = W r + x_free, with how far the free motions go.
!>   4. Displacement: u = u_free + K^-1 B^T r + free motions.
!>   5. Out-of-balance force; when too large, u_free takes its correction and 2 to 4 are done
!>      again; so they are while closest points move or turned normals drive a neutral motion.
!>   6. Certificate; should it ask for more than the residual did, 2 to 5 with a smaller residual.
!>   7. Energies.
module advance_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t, raise, exit_not_solved
  use text_mod, only: to_text
  use system_mod, only: wall_seconds
  use mesh_mod, only: mesh_t
  use scene_mod, only: scene_t
  use controls_mod, only: stop_at_change, solver_auto
  use contact_points_mod, only: contact_points_t
  use increments_mod, only: increment_t, next_increment, mark_end
  use plan_mod, only: plan_t
  use state_mod, only: state_t
  use step_report_mod, only: step_report_t, contact_fields_t, worst_entry, &
                             status_open, status_slide, ended_unbalanced, ended_moving, &
                             ended_out_of_reach, ended_stalled
  use mesh_forces_mod, only: internal_force, force_rounding, nodal_stiffness
  use certificate_mod, only: certify, energy_balance, step_forces_t
  use problem_mod, only: natural_map
  use rigid_modes_mod, only: add_motions
  use follow_points_mod, only: rounding_of_places, relative, nodal, measure_points, carried_slip
  use stiffness_inverse_mod, only: begin_inverse, finish_inverse
  use operators_mod, only: operators_t, locate_points, update_contact
  use neutral_motions_mod, only: neutral_step
  use attempt_mod, only: attempt_t, begin_attempt, displacement_of, solve_reactions, &
    expected_reactions, trend_of
  use look_ahead_mod, only: ahead_t, can_look_ahead, is_ahead, look_ahead, take_foreseen, cut
  implicit none
  private

  public :: advance, advance_along, equilibrate

  integer,  parameter :: max_newton_raphson = 40
  integer,  parameter :: max_attempts = 4                   !! with ever smaller residuals
  real(wp), parameter :: smallest_tolerance = 1.0e-14_wp    !! that an attempt asks for [-]

contains

  !> Bring `old` to the end of `increment`, in `new`; `old` is never altered.
  subroutine advance(scene, plan, operators, old, increment, new, report, error)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(operators_t), intent(inout) :: operators
    !! where and how points on curved obstacles touch follows the iteration; MUMPS works in its own
    !! memory
    type(state_t), intent(in) :: old
    type(increment_t), intent(in) :: increment
    type(state_t), intent(out) :: new
    type(step_report_t), intent(out) :: report
    !! not converged, not certified: no error, it is said here
    type(error_t), allocatable, intent(out) :: error
    !! MUMPS failed; a node is prescribed into an obstacle
    type(attempt_t) :: now
    real(wp) :: clock

    clock = wall_seconds()
    call begin_attempt(scene, plan%points, operators, old, increment, now)
    new = old
    call mark_end(increment, new)
    new%reaction = expected_reactions(scene, plan%points, operators, old, increment)
    call complete(scene, plan%points, operators, old, now, new, report, error)
    new%trend = trend_of(increment, old%reaction, new%reaction)
    report%wall_time = wall_seconds() - clock
  end subroutine advance

  !> The same for the increment that follows `old` in the deck, with the help of `ahead`: where the
  !> interface is all that one increment needs of the one before, several are solved for at once.
  subroutine advance_along(scene, plan, operators, old, ahead, new, report, error)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(operators_t), intent(inout) :: operators  !! as of `advance`
    type(state_t), intent(in) :: old
    type(ahead_t), intent(inout) :: ahead
    type(state_t), intent(out) :: new
    type(step_report_t), intent(out) :: report
    type(error_t), allocatable, intent(out) :: error
    type(increment_t) :: increment
    type(attempt_t) :: now
    real(wp) :: clock

    increment = next_increment(scene%steps, old)
    if (.not. can_look_ahead(scene, operators)) then
      call advance(scene, plan, operators, old, increment, new, report, error)
      return
    end if
    if (.not. is_ahead(ahead, increment)) then
      call look_ahead(scene, plan%points, operators, old, ahead, error)
      if (allocated(error)) return
    end if
    clock = wall_seconds()
    call begin_attempt(scene, plan%points, operators, old, increment, now)
    new = old
    call mark_end(increment, new)
    call take_foreseen(ahead, increment, operators, now, new%reaction, report)
    call complete(scene, plan%points, operators, old, now, new, report, error)
    new%trend = trend_of(increment, old%reaction, new%reaction)
    report%wall_time = report%wall_time + wall_seconds() - clock
    ! What was corrected was not what those after it began from.
    if (report%newton_raphson_iterations > 1 .or. .not. report%converged) call cut(ahead)
  end subroutine advance_along

  !> From the loads of an increment, and perhaps its first reactions, to its end.
  subroutine complete(scene, points, operators, old, now, new, report, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(operators_t), intent(inout) :: operators
    type(state_t), intent(in) :: old
    type(attempt_t), intent(inout) :: now
    type(state_t), intent(inout) :: new
    type(step_report_t), intent(inout) :: report
    type(error_t), allocatable, intent(out) :: error !! as of `advance`
    type(state_t) :: before
    type(step_report_t) :: of_before
    integer :: i

    attempts: do i = 1, max_attempts
      ! 2. to 5. Equilibrium
      call equilibrate(scene, points, operators, old, now, new, report, error)
      if (allocated(error)) return
      if (report%ending == ended_unbalanced) exit attempts
      if (i > 1 .and. .not. report%converged) then
        ! More than double precision gives: what converged before, and was not certified, stands.
        new = before
        report = of_before
        exit attempts
      end if

      ! 6. Certificate
      call locate_points(scene, points, operators%is_curved, new%displacement, operators)
      call describe_contact(points, operators, old, new, report%contact)
      call watch_inactive(scene, points, operators, new, report, error)
      if (allocated(error)) return
      if (report%ending == ended_out_of_reach) return
      now%forces%rounding_of_gaps = rounding_of_places(scene, new%displacement)
      if (.not. allocated(now%forces%stiffness)) now%forces%stiffness = nodal_stiffness( &
        scene%mesh, scene%materials)
      report%certificate = certify(scene%mesh, points, report%contact, old, new, &
        now%forces, scene%contact%tolerance)
      ! Where no solver gets any further the certificate judges what the best of them found.
      if (report%certificate%certified .and. report%ending == ended_stalled .and. &
        now%controls%solver == solver_auto) report%converged = .true.
      if (report%certificate%certified .or. .not. report%converged) exit attempts
      if (now%controls%stop_rule == stop_at_change) exit attempts
      ! The residual is measured by forces. Where these are large beside what they move (nearly
      ! incompressible bodies) the gaps need a smaller one.
      now%controls%tolerance = max(smallest_tolerance, now%controls%tolerance*max(1.0e-4_wp, &
        scene%contact%tolerance/worst_entry(report%certificate)))
      now%start = new%displacement
      before = new
      of_before = report
    end do attempts
    ! Points that still move where the certificate does not pass are why.
    if (report%moved > 10.0_wp*scene%contact%tolerance .and. report%converged .and. &
      .not. report%certificate%certified) then
      report%converged = .false.
      report%ending = ended_moving
      report%residual = report%moved
    end if
    if (report%ending /= ended_unbalanced) call finish(scene, points, operators, old, now, &
      new, report)
  end subroutine complete

  !> 7. Energies, and what the state keeps beside displacements and reactions.
  subroutine finish(scene, points, operators, old, now, new, report)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(operators_t), intent(in) :: operators
    type(state_t), intent(in) :: old
    type(attempt_t), intent(in) :: now
    type(state_t), intent(inout) :: new
    type(step_report_t), intent(inout) :: report

    new%slip = carried_slip(scene, points, operators%is_curved, operators%frame, old) + &
      report%contact%slip_increment
    new%external_force = now%forces%external
    new%support_force = now%forces%internal - now%forces%external &
      - nodal(points, new%reaction, size(new%displacement, 2))
    where (.not. now%forces%prescribed) new%support_force = 0.0_wp
    call energy_balance(report%contact, old, new, now%forces%internal, report%energy)
  end subroutine finish

  !> Newton-Raphson until the forces balance and the points on curved obstacles have settled:
  !> reactions and displacement from u_free. Nothing is certified.
  subroutine equilibrate(scene, points, operators, old, now, new, report, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(operators_t), intent(inout) :: operators
    type(state_t), intent(in) :: old
    type(attempt_t), intent(inout) :: now            !! u_free takes the corrections
    type(state_t), intent(inout) :: new              !! gets reaction and displacement
    type(step_report_t), intent(inout) :: report
    type(error_t), allocatable, intent(out) :: error !! MUMPS failed
    real(wp), dimension(3, size(now%u_free, 2)) :: residual, correction !! [force], [length]
    real(wp) :: imbalance, last_imbalance, moved, last_moved
    real(wp) :: step(operators%motions%n) !! of the neutral motions [length]
    integer :: i
    logical :: balanced, settled, is_turned
    real(wp), allocatable :: begun(:) !! a correction by the factor, its interior to come [length]

    last_imbalance = huge(1.0_wp)
    last_moved = huge(1.0_wp)
    newton_raphson: do i = 1, max_newton_raphson
      report%newton_raphson_iterations = report%newton_raphson_iterations + 1

      ! 2. and 3. Reactions, and the free motions with them
      if (any(operators%is_curved)) then
        if (i > 1) now%start = new%displacement
        call locate_points(scene, points, operators%is_curved, now%start, operators)
        call update_contact(scene, points, operators)
      end if
      if (.not. now%is_foreseen) call solve_reactions(scene, points, operators, old, now, &
        new%reaction, report)
      now%is_foreseen = .false.
      if (report%ending == ended_unbalanced) return

      ! 4. Displacement
      if (allocated(begun) .or. any(abs(new%reaction - now%applied) > 0.0_wp)) then
        ! By what the reactions have changed: what an inexact factor makes of it gets less and less.
        call finish_inverse(operators%inverse, nodal(points, new%reaction - now%applied, &
          size(now%u_free, 2)), begun, correction, error)
        if (allocated(error)) return
        now%pressed = now%pressed + correction
        now%applied = new%reaction
      end if
      new%displacement = displacement_of(scene, operators, now, now%pressed)

      ! 5. Out-of-balance force, and how far the closest points have moved
      call internal_force(scene%mesh, scene%materials, new%displacement, now%forces%internal)
      now%forces%rounding = force_rounding(scene%mesh, scene%materials, &
        max(abs(new%displacement), abs(old%displacement)))
      call out_of_balance(scene%mesh, points, new%reaction, now%forces, &
        now%controls%tolerance < scene%contact%tolerance, residual, imbalance)
      if (i == 1) report%unrefined = max(report%unrefined, imbalance)
      report%imbalance = imbalance
      call measure_points(scene, points, operators%is_curved, operators%frame, old, new, moved)
      is_turned = .false.
      if (operators%motions%n > 0) is_turned = any(abs(now%turned) > now%controls%tolerance* &
        maxval(abs(new%reaction)))
      balanced = imbalance <= now%controls%tolerance .or. &
        (imbalance > 0.5_wp*last_imbalance .and. .not. is_turned)
      settled = moved <= now%controls%tolerance .or. (moved > 0.9_wp*last_moved .and. i > 10)
      if (balanced .and. settled) exit newton_raphson
      last_imbalance = imbalance
      last_moved = moved
      if (is_turned) then
        step = neutral_step(scene, points, operators, new%reaction, new%displacement, now%turned)
        now%motion = now%motion + step
        call add_motions(operators%motions, scene%mesh, step, new%displacement)
      end if
      if (imbalance <= now%controls%tolerance) cycle newton_raphson
      ! Contact sees the correction of the interface; that of the interior comes with its answer.
      call begin_inverse(operators%inverse, residual, begun, correction, error)
      if (allocated(error)) return
      now%u_free = now%u_free + correction
    end do newton_raphson
    report%moved = moved
  end subroutine equilibrate

  !> f_ext + B^T r - f_int on the free degrees of freedom, and the largest of a node beside the
  !> largest force of its body, less what rounding makes of it.
  !>
  !> Rounding of many nodes may add up in the balance of a body: where the certificate has not
  !> passed it is no excuse, and what is left is taken out as far as it goes.
  pure subroutine out_of_balance(mesh, points, reaction, forces, closely, residual, relative)
    type(mesh_t), intent(in) :: mesh
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: reaction(:, :)
    type(step_forces_t), intent(in) :: forces
    logical, intent(in) :: closely                          !! rounding is no excuse
    real(wp), intent(out) :: residual(:, :)                 !! (3,n_nodes) [force]
    real(wp), intent(out) :: relative                       !! [-]
    real(wp) :: scale(0:mesh%n_bodies)
    integer :: node

    residual = forces%external + nodal(points, reaction, size(forces%internal, 2)) - &
      forces%internal
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
    do node = 1, mesh%n_nodes
      relative = max(relative, (norm2(residual(:, node)) - merge(0.0_wp, &
        forces%rounding(node), closely))/scale(mesh%body(node)))
    end do
  end subroutine out_of_balance

  !> Gaps, slips, reactions and status from the displacements as they came out.
  pure subroutine describe_contact(points, operators, old, new, contact)
    type(contact_points_t), intent(in) :: points
    type(operators_t), intent(in) :: operators
    type(state_t), intent(in) :: old, new
    type(contact_fields_t), intent(out) :: contact
    real(wp) :: z(3, size(operators%active)), x(3, size(operators%active))
    integer :: status(size(operators%active)), i

    contact%frame = operators%frame
    allocate (contact%reaction(3, points%n), contact%gap(points%n), contact%slip_increment(2, &
      points%n))
    allocate (contact%status(points%n), source=status_open)
    do i = 1, points%n
      contact%slip_increment(:, i) = matmul(relative(points, i, new%displacement) &
        - relative(points, i, old%displacement), contact%frame(:, 2:, i))
      contact%gap(i) = operators%gap(i) + dot_product(contact%frame(:, 1, i), &
        relative(points, i, new%displacement) - operators%place(:, i))
      contact%reaction(:, i) = matmul(new%reaction(:, i), contact%frame(:, :, i))
    end do
    x(1, :) = contact%gap(operators%active)
    x(2:, :) = contact%slip_increment(:, operators%active)
    call natural_map(operators%problem, x, contact%reaction(:, operators%active), z, status)
    where (status /= status_open .and. operators%problem%mu <= 0.0_wp) status = status_slide
    contact%status(operators%active) = status
  end subroutine describe_contact

  !> A node without a reaction must not end inside its obstacle: where its motion is prescribed that
  !> is an error; where it was taken to be out of reach the report says so.
  subroutine watch_inactive(scene, points, operators, new, report, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(operators_t), intent(in) :: operators
    type(state_t), intent(in) :: new
    type(step_report_t), intent(inout) :: report
    type(error_t), allocatable, intent(out) :: error
    logical :: is_inside(points%n)
    integer :: i

    if (points%n == 0) return
    is_inside = report%contact%gap < -10.0_wp*scene%contact%tolerance* &
      maxval(abs(new%displacement)) - rounding_of_places(scene, new%displacement)
    is_inside(operators%active) = .false.
    if (.not. any(is_inside)) return
    i = findloc(is_inside, .true., dim=1)
    if (any(is_inside .and. .not. points%in_reach)) then
      report%converged = .false.
      report%ending = ended_out_of_reach
      report%worst_point = findloc(is_inside .and. .not. points%in_reach, .true., dim=1)
      return
    end if
    call raise(error, exit_not_solved, 'step '//to_text(new%step)//', increment '// &
      to_text(new%increment)// &
      ': node '//to_text(scene%mesh%node_id(points%node(i)))//' is prescribed to move '// &
      to_text(-report%contact%gap(i))//' into '// &
      scene%obstacles(scene%pairs(points%pair(i))%obstacle)%name)
  end subroutine watch_inactive

end module advance_mod
