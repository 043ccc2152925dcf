!> What steps change of contact: friction coefficients (*CHANGE FRICTION), and which pairs there are
!> (*MODEL CHANGE). What a step says holds from its beginning until a later one says otherwise.
module step_contact_mod
  use kinds_mod, only: wp
  use contact_points_mod, only: contact_points_t
  use friction_laws_mod, only: friction_law_t, is_constant, least_share
  use scene_mod, only: scene_t
  implicit none
  private

  public :: changes_friction, changes_pairs, changes_at, set_contact_of_step, friction_in, &
    find_laws, removed_in, added_in, most_friction, least_friction

contains

  !> Whether any step changes friction coefficients.
  pure logical function changes_friction(scene)
    type(scene_t), intent(in) :: scene
    integer :: k

    changes_friction = any([(allocated(scene%steps(k)%frictions), k=1, size(scene%steps))])
  end function changes_friction

  !> Whether pairs are removed in any step.
  pure logical function changes_pairs(scene)
    type(scene_t), intent(in) :: scene
    integer :: k

    changes_pairs = any([(allocated(scene%steps(k)%pair_changes), k=1, size(scene%steps))])
  end function changes_pairs

  !> Whether a step begins with other contact than the one before ended with.
  pure logical function changes_at(scene, step)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step

    changes_at = allocated(scene%steps(step)%frictions) .or. &
      allocated(scene%steps(step)%pair_changes)
  end function changes_at

  !> Give the points the coefficients of a step, and which pairs are removed in it.
  pure subroutine set_contact_of_step(scene, step, points)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    type(contact_points_t), intent(inout) :: points
    real(wp) :: mu(size(scene%pairs))

    if (changes_friction(scene)) then
      mu = friction_in(scene, step)
      points%mu = mu(points%pair)
    end if
    call find_laws(scene, step, points%laws)
    if (changes_pairs(scene)) points%is_removed = removed_in(scene, step)
  end subroutine set_contact_of_step

  !> The coefficient of each pair in a step.
  pure function friction_in(scene, step) result(mu)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    real(wp) :: mu(size(scene%pairs)) !! [-]
    integer :: k

    mu = scene%pairs%mu
    do k = 1, step
      if (allocated(scene%steps(k)%frictions)) mu(scene%steps(k)%frictions%pair) = &
        scene%steps(k)%frictions%mu
    end do
  end function friction_in

  !> What pressure makes of the friction of each pair in a step; not allocated where it makes
  !> nothing of any in all steps.
  pure subroutine find_laws(scene, step, laws)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    type(friction_law_t), allocatable, intent(inout) :: laws(:)
    logical :: are_constant
    integer :: k, i

    if (allocated(laws)) deallocate (laws)
    are_constant = all(is_constant(scene%pairs%law))
    do k = 1, size(scene%steps)
      if (allocated(scene%steps(k)%frictions)) are_constant = are_constant .and. all(is_constant( &
        scene%steps(k)%frictions%law))
    end do
    if (are_constant) return
    allocate (laws(size(scene%pairs)))
    do i = 1, size(scene%pairs)
      laws(i) = scene%pairs(i)%law
    end do
    do k = 1, step
      if (.not. allocated(scene%steps(k)%frictions)) cycle
      do i = 1, size(scene%steps(k)%frictions)
        laws(scene%steps(k)%frictions(i)%pair) = scene%steps(k)%frictions(i)%law
      end do
    end do
  end subroutine find_laws

  !> Which pairs are removed in a step.
  pure function removed_in(scene, step) result(is_removed)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    logical :: is_removed(size(scene%pairs))
    integer :: k

    is_removed = .false.
    do k = 1, step
      if (allocated(scene%steps(k)%pair_changes)) is_removed(scene%steps(k)%pair_changes%pair) = &
        scene%steps(k)%pair_changes%is_removed
    end do
  end function removed_in

  !> Which pairs a step adds again.
  pure function added_in(scene, step) result(is_added)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    logical :: is_added(size(scene%pairs))

    is_added = .false.
    if (step > 1) is_added = removed_in(scene, step - 1) .and. .not. removed_in(scene, step)
  end function added_in

  !> The largest coefficient that each pair has in any step.
  pure function most_friction(scene) result(mu)
    type(scene_t), intent(in) :: scene
    real(wp) :: mu(size(scene%pairs)) !! [-]
    integer :: k

    mu = scene%pairs%mu
    do k = 1, size(scene%steps)
      mu = max(mu, friction_in(scene, k))
    end do
  end function most_friction

  !> The least coefficient that is not 0, of all pairs and steps, and 1 at most; of those that
  !> depend on pressure or rate the least.
  pure real(wp) function least_friction(scene) result(least)
    type(scene_t), intent(in) :: scene
    real(wp) :: mu(size(scene%pairs))
    type(friction_law_t), allocatable :: laws(:)
    integer :: k

    least = 1.0_wp
    do k = 0, size(scene%steps)
      mu = friction_in(scene, k)
      call find_laws(scene, k, laws)
      if (allocated(laws)) mu = mu*least_share(laws)
      least = min(least, minval(mu, mask=mu > 0.0_wp))
    end do
  end function least_friction

end module step_contact_mod
