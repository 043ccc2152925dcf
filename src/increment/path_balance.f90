!> What is left over of the energy along the load path, by contact alone. docs/theory.md (6.5).
module path_balance_mod
  use kinds_mod, only: wp
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t
  use placement_mod, only: placement_t, place_state
  use interference_mod, only: has_interference, extra_gap_at
  use transfer_mod, only: relative_motion
  implicit none
  private

  public :: work_left_over, largest_switch_energy, work_on_overlaps

contains

  !> Work less strain energy less dissipation, from one state to another that follows it.
  !>
  !> Forces that grow in proportion do the work that the strain energy grows by, so what is left is
  !> that of contact: what its reactions do to what moves across it, and have not dissipated.
  real(wp) function work_left_over(scene, points, undeformed, first_gap, from, to) result(left)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(placement_t), intent(in) :: undeformed
    real(wp), intent(in) :: first_gap(:) !! (n_points) as of `work_on_overlaps` [length]
    type(state_t), intent(in) :: from, to
    type(placement_t) :: began, ended
    real(wp) :: moved(3)
    integer :: i

    call place_state(scene, points, undeformed, from, began)
    call place_state(scene, points, undeformed, to, ended)
    left = work_on_overlaps(scene, points, first_gap, began, ended, from, to)
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

  !> The most energy that is lost or gained where points in the middle of edges become ones by
  !> themselves, or are no more, under the same loads: what the reactions of those with the ends of
  !> their edges would do over the distances by which these act. docs/theory.md (6.9).
  real(wp) function largest_switch_energy(scene, points, undeformed, from, to) result(work)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(placement_t), intent(in) :: undeformed
    type(state_t), intent(in) :: from, to !! before and after
    type(placement_t) :: began, ended
    real(wp) :: moved(3)
    integer :: i

    call place_state(scene, points, undeformed, from, began)
    call place_state(scene, points, undeformed, to, ended)
    work = 0.0_wp
    do i = 1, points%n
      if (began%weights%alone(i) .neqv. ended%weights%alone(i)) then
        if (began%weights%alone(i)) then
          work = work + distance_work(ended, to, began)
        else
          work = work + distance_work(began, from, ended)
        end if
      end if
      moved = relative_motion(points, ended%weights, i, to%displacement - from%displacement)
      work = work + (norm2(tangential(began, from%reaction(:, i))) + &
        norm2(tangential(ended, to%reaction(:, i))))*norm2(tangential(ended, moved))
    end do

  contains

    !> Of the point i where its edge's ends have part in it, over the distance by which it enters
    !> where they have none.
    pure real(wp) function distance_work(with, pressed, without)
      type(placement_t), intent(in) :: with, without
      type(state_t), intent(in) :: pressed
      real(wp) :: distance

      associate (alpha => points%alpha(i), ends => points%end_point(:, i))
        distance = max(0.0_wp, alpha*sum(without%gap(ends)) - without%gap(i))/(1.0_wp - &
          2.0_wp*alpha)
      end associate
      distance_work = distance*dot_product(with%frame(:, 1, i), pressed%reaction(:, i))
    end function distance_work

    pure function tangential(placement, vector)
      type(placement_t), intent(in) :: placement
      real(wp), intent(in) :: vector(3)
      real(wp) :: tangential(2)

      tangential = matmul(vector, placement%frame(:, 2:, i))
    end function tangential

  end function largest_switch_energy

  !> What contact does while it removes the overlaps that the run begins with, and while the
  !> interference changes that is allowed. docs/theory.md (6.5).
  pure real(wp) function work_on_overlaps(scene, points, first_gap, began, ended, from, to) &
    result(work)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: first_gap(:)           !! (n_points) where the run begins [length]
    type(placement_t), intent(in) :: began, ended  !! at `from` and at `to`
    type(state_t), intent(in) :: from, to
    real(wp) :: change(points%n) !! of the gap, by what is allowed [length]
    integer :: i

    work = 0.0_wp
    if (from%increments_done == 0) then
      do i = 1, points%n
        work = work + 0.5_wp*max(0.0_wp, -first_gap(i))*dot_product(ended%frame(:, 1, i), &
          to%reaction(:, i))
      end do
    end if
    if (.not. has_interference(scene)) return
    change = extra_gap_at(scene, points, to%step, to%position) - extra_gap_at(scene, points, &
      from%step, from%position)
    do i = 1, points%n
      work = work - 0.5_wp*change(i)*(dot_product(began%frame(:, 1, i), from%reaction(:, i)) + &
        dot_product(ended%frame(:, 1, i), to%reaction(:, i)))
    end do
  end function work_on_overlaps

end module path_balance_mod
