!> A *STEP begins, or is taken up: its supports, contact and loads.
module enter_step_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t
  use step_contact_mod, only: set_contact_of_step
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use plan_mod, only: plan_t
  use state_mod, only: state_t
  use increments_mod, only: increment_t
  use step_loads_mod, only: prescribed_dofs
  use transfer_mod, only: note_freedom
  use dynamic_step_mod, only: are_alike
  use step_solver_mod, only: step_solver_t, set_supports, prepare_step
  use load_cycles_mod, only: load_cycles_t, cycles_of_step
  use checkpoint_mod, only: progress_t
  implicit none
  private

  public :: enter_step

contains

  !> A new solver where a step holds other degrees of freedom than the one before; its loads in any
  !> case. In a continued run also in the middle of a step.
  subroutine enter_step(scene, plan, increment, progress, solver, error)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(inout) :: plan !! its points get what supports leave to the nodes
    type(increment_t), intent(in) :: increment
    type(progress_t), intent(inout) :: progress
    type(step_solver_t), intent(inout) :: solver
    type(error_t), allocatable, intent(out) :: error
    type(state_t) :: begun
    integer :: step, first

    first = progress%entered + 1
    if (first == 1) first = last_factorised(scene, increment%step, progress%widened_in)
    do step = first, increment%step
      call set_contact_of_step(scene, step, plan%points)
      call note_freedom(scene, prescribed_dofs(scene, step), plan%points)
      call set_supports(scene, plan%points, step, prescribed_dofs(scene, step), solver, &
        progress%tally%work, error)
      if (allocated(error)) return
    end do
    progress%entered = increment%step
    if (increment%first_of_step) call release_removed(plan%points, progress)
    if (increment%first_of_step) progress%begun = merge(progress%state%displacement, 0.0_wp, &
      prescribed_dofs(scene, increment%step))
    begun%displacement = progress%begun
    call prepare_step(scene, increment%step, begun, solver, progress%tally%work, error)
    if (allocated(error)) return
    progress%cycles = load_cycles_t()
    if (.not. scene%steps(increment%step)%is_dynamic) progress%cycles = cycles_of_step(scene, &
      increment%step, solver%response%loads)
  end subroutine enter_step

  !> Pairs that a *STEP removes press no more from its beginning on.
  pure subroutine release_removed(points, progress)
    type(contact_points_t), intent(in) :: points
    type(progress_t), intent(inout) :: progress
    integer :: i

    if (.not. allocated(points%is_removed)) return
    call release(progress%state)
    call release(progress%coarse%state)
    if (size(progress%shadows) > 0) call release(progress%followed)
    do i = 1, size(progress%shadows)
      call release(progress%shadows(i)%state)
    end do

  contains

    pure subroutine release(state)
      type(state_t), intent(inout) :: state
      integer :: k

      if (.not. allocated(state%reaction)) return
      do k = 1, points%n
        if (.not. points%is_removed(points%pair(k))) cycle
        state%reaction(:, k) = 0.0_wp
        if (allocated(state%trend)) state%trend(:, k) = 0.0_wp
      end do
    end subroutine release

  end subroutine release_removed

  !> The latest step up to `step` that began with a new factor, or in which there was one because
  !> the interface was widened.
  pure integer function last_factorised(scene, step, widened_in) result(last)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step, widened_in
    logical, dimension(3, scene%mesh%n_nodes) :: before, now, of_bodies
    integer :: k

    of_bodies = spread(scene%mesh%body > 0, 1, 3)
    last = 1
    before = prescribed_dofs(scene, 1)
    do k = 2, step
      now = prescribed_dofs(scene, k)
      if (any((now .neqv. before) .and. of_bodies) .or. .not. are_alike(scene, k - 1, k)) last = k
      before = now
    end do
    last = max(last, widened_in)
  end function last_factorised

end module enter_step_mod
