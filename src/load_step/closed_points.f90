!> Points of pairs without separation: which of them are closed, and so stay closed.
!>
!> One is closed that touches in the mesh, and one that has pressed where an increment ended. Within
!> an increment that it begins open it may touch and part again.
!> docs/theory.md (3.10).
module closed_points_mod
  use kinds_mod, only: wp
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t, weights_t, is_covered
  use state_mod, only: state_t
  use placement_mod, only: placement_t
  use follow_points_mod, only: rounding_of_places
  implicit none
  private

  public :: may_stay_closed, stay_closed, keep_closed

contains

  !> Whether any pair is without separation.
  pure logical function may_stay_closed(scene)
    type(scene_t), intent(in) :: scene

    may_stay_closed = any(scene%pairs%no_separation)
  end function may_stay_closed

  !> The points that stay closed in the increment that begins at `state`.
  pure function stay_closed(scene, points, undeformed, state) result(stays)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(placement_t), intent(in) :: undeformed !! of the mesh
    type(state_t), intent(in) :: state
    logical :: stays(points%n)
    real(wp) :: nothing(3, 1)

    stays = scene%pairs(points%pair)%no_separation
    if (.not. any(stays)) return
    nothing = 0.0_wp
    if (allocated(state%closed)) then
      stays = stays .and. state%closed
    else
      stays = stays .and. undeformed%gap <= rounding_of_places(scene, nothing)
    end if
  end function stay_closed

  !> Keep which points are closed where an increment ends: those that were when it began, but for
  !> what has left its master, and those that press.
  pure subroutine keep_closed(scene, points, undeformed, weights, old, new)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(placement_t), intent(in) :: undeformed !! of the mesh
    type(weights_t), intent(in) :: weights      !! where it ends
    type(state_t), intent(in) :: old            !! where it began
    type(state_t), intent(inout) :: new         !! gets closed
    logical :: closed(points%n)
    integer :: i

    if (.not. may_stay_closed(scene)) return
    closed = stay_closed(scene, points, undeformed, old)
    do i = 1, points%n
      closed(i) = closed(i) .and. is_covered(points, weights, i)
      if (scene%pairs(points%pair(i))%no_separation) closed(i) = closed(i) .or. &
        any(abs(new%reaction(:, i)) > 0.0_wp)
    end do
    new%closed = closed
  end subroutine keep_closed

end module closed_points_mod
