!> What is left over of the energy along the load path, by contact alone. docs/theory.md (6.5).
module path_balance_mod
  use kinds_mod, only: wp
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t
  use placement_mod, only: placement_t, place_curved
  use transfer_mod, only: relative_motion
  implicit none
  private

  public :: work_left_over, work_on_overlaps

contains

  !> Work less strain energy less dissipation, from one state to another that follows it.
  !>
  !> Forces that grow in proportion do the work that the strain energy grows by, so what is left is
  !> that of contact: what its reactions do to what moves across it, and have not dissipated.
  real(wp) function work_left_over(scene, points, undeformed, from, to) result(left)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(placement_t), intent(in) :: undeformed
    type(state_t), intent(in) :: from, to
    type(placement_t) :: began, ended
    real(wp) :: moved(3)
    integer :: i

    began = undeformed
    ended = undeformed
    call place_curved(scene, points, from%displacement, began, from%rotation)
    call place_curved(scene, points, to%displacement, ended, to%rotation)
    left = work_on_overlaps(points, undeformed, ended, from, to)
    do i = 1, points%n
      moved = relative_motion(points, began%weights, i, to%displacement) - relative_motion(points, &
        began%weights, i, from%displacement)
      left = left - 0.5_wp*dot_product(from%reaction(:, i), moved)
      moved = relative_motion(points, ended%weights, i, to%displacement) - relative_motion(points, &
        ended%weights, i, from%displacement)
      left = left - 0.5_wp*dot_product(to%reaction(:, i), moved)
      associate (tangents => ended%frame(:, 2:, i))
        left = left + dot_product(matmul(to%reaction(:, i), tangents), matmul(moved, tangents))
      end associate
    end do
  end function work_left_over

  !> What contact does while it removes the overlaps that the run begins with; 0 later on.
  pure real(wp) function work_on_overlaps(points, undeformed, ended, from, to) result(work)
    type(contact_points_t), intent(in) :: points
    type(placement_t), intent(in) :: undeformed, ended !! where the run begins, and at `to`
    type(state_t), intent(in) :: from, to
    integer :: i

    work = 0.0_wp
    if (from%increments_done > 0) return
    do i = 1, points%n
      work = work + 0.5_wp*max(0.0_wp, -undeformed%gap(i))*dot_product(ended%frame(:, 1, i), &
        to%reaction(:, i))
    end do
  end function work_on_overlaps

end module path_balance_mod
