!> Whether an equilibrium at finite strain jumps within an increment: whether energy is lost that is
!> neither work nor friction, however small the increment. docs/theory.md (6.8).
module jumps_mod
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t
  use scene_mod, only: scene_t
  use bodies_mod, only: is_linear
  use warming_mod, only: warms
  use interference_mod, only: has_interference
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t, modes_t, keep_tangent
  use increment_report_mod, only: increment_report_t, has_converged
  use increments_mod, only: increment_t, next_increment
  use finite_forces_mod, only: finite_strain_energy
  use placement_mod, only: placement_t, place_state
  use transfer_mod, only: relative_motion
  use step_solver_mod, only: step_solver_t, take_tangent
  use load_step_error_mod, only: begins_with_jump, have_switched
  use path_balance_mod, only: largest_switch_energy
  use trial_mod, only: goal_t
  use advance_mod, only: advance
  implicit none
  private

  public :: find_jump

  real(wp), parameter :: doubtful = 0.01_wp
  !! of the strain energy: work that is missing, or too much of it, to look into [-]
  real(wp), parameter :: lost_at_once = 0.01_wp
  !! of the strain energy, in the smallest increments. A path that is smooth leaves an eighth in a
  !! half, one on which friction begins to act as much as the part is. Nodes that a round tool with
  !! much friction comes to have been seen to lose 0.003 [-]
  integer, parameter :: halvings = 12 !! down to the smallest increment that is solved
  integer, parameter :: retaken = -1 !! a factor of a part: no state of the run has it
  real(wp), parameter :: nothing = 1.0e-8_wp !! a strain that has no shape to snap to [-]

contains

  !> The energy that is lost in the smallest part of an increment that loses much; 0 where none
  !> does, and where that is not known.
  subroutine find_jump(scene, points, solver, old, new, increment, lost)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(inout) :: solver    !! as of `advance`
    type(state_t), intent(in) :: old, new
    type(increment_t), intent(in) :: increment      !! between them
    real(wp), intent(out) :: lost                   !! [energy]
    type(state_t) :: from, middle, to, beyond
    type(modes_t) :: no_modes
    real(wp) :: whole, first, second, strain_energy
    real(wp) :: beside !! what the other halves lose at most [energy]
    integer(i8) :: length
    integer :: k
    type(error_t), allocatable :: error
    logical :: ok

    lost = 0.0_wp
    if (is_linear(scene) .or. warms(scene)) return
    if (has_interference(scene) .or. any(scene%obstacles%turns)) return
    whole = lost_between(scene, points, solver, old, new)
    strain_energy = max(old%strain_energy, new%strain_energy)
    if (.not. abs(whole) > doubtful*strain_energy) return
    if (.not. strain_energy > finite_strain_energy(scene%mesh, scene%materials, &
      spread(0.0_wp, 1, scene%mesh%n_elements), nothing*scene%mesh%coordinates, no_modes)) return
    if (increment%first_of_step) then
      if (begins_with_jump(scene, points, solver, old)) return
    end if
    beside = 0.0_wp
    from = old
    to = new
    length = increment%position - increment%start
    do k = 1, halvings
      length = length/2
      call follow(from, middle)
      ! Where a part is not solved, though the whole is, one that is shorter may be.
      if (.not. ok) then
        first = 0.0_wp
        second = lost_between(scene, points, solver, from, to)
        cycle
      end if
      first = lost_between(scene, points, solver, from, middle)
      ! From the middle: what halves and the whole make of friction is the error by the load steps.
      call follow(middle, beyond)
      if (ok) to = beyond
      second = lost_between(scene, points, solver, middle, to)
      beside = max(beside, min(first, second))
      if (first > second) then
        to = middle
      else
        from = middle
      end if
      if (.not. max(first, second) > lost_at_once*strain_energy) return
    end do
    lost = max(first, second)
    if (.not. lost > lost_at_once*strain_energy) then
      lost = 0.0_wp
    else if (have_switched(from, to)) then
      ! A law of the discretisation, (6.9), if nothing else is missing.
      if (lost <= largest_switch_energy(scene, points, solver%undeformed, from, to) .and. &
        beside <= lost_at_once*strain_energy) lost = 0.0_wp
    end if

  contains

    !> With the factor as it is; where that does not do, with that of the tangent where the part
    !> begins. What follows takes its own again.
    subroutine follow(a, b)
      type(state_t), intent(inout) :: a
      type(state_t), intent(out) :: b
      logical :: is_taken

      call try(a, b)
      if (ok .or. solver%choices%precision%renews_tangent) return
      if (a%tangent_of == retaken .and. a%tangent_position == a%position) return
      call keep_tangent(a)
      a%tangent_of = retaken
      call take_tangent(scene, points, a, solver, is_taken, error)
      if (.not. allocated(error)) call try(a, b)
    end subroutine follow

    subroutine try(a, b)
      type(state_t), intent(in) :: a
      type(state_t), intent(out) :: b
      type(increment_report_t) :: report

      call advance(scene, points, solver, a, goal_t(next_increment(scene%steps, a, length), &
        solver%choices%tolerance), b, report, error)
      ok = .not. allocated(error)
      if (ok) ok = has_converged(report)
    end subroutine try

  end subroutine find_jump

  !> Work less strain energy less dissipation from one equilibrium straight to another.
  !> docs/theory.md (6.8).
  real(wp) function lost_between(scene, points, solver, from, to) result(lost)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    type(state_t), intent(in) :: from, to
    type(placement_t) :: ended
    real(wp) :: slid(3)
    integer :: i

    lost = 0.5_wp*sum((to%displacement - from%displacement)*(from%external_force + &
      from%support_force + to%external_force + to%support_force)) - (to%strain_energy - &
      from%strain_energy)
    call place_state(scene, points, solver%undeformed, to, ended)
    do i = 1, points%n
      slid = relative_motion(points, ended%weights, i, to%displacement - from%displacement)
      associate (tangents => ended%frame(:, 2:, i))
        lost = lost + dot_product(matmul(to%reaction(:, i), tangents), matmul(slid, tangents))
      end associate
    end do
  end function lost_between

end module jumps_mod
