!> How far the contact points have moved about their masters.
module follow_points_mod
  use kinds_mod, only: wp
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t
  use obstacle_shapes_mod, only: extent_of
  use local_frame_mod, only: transport_tangent
  use placement_mod, only: placement_t
  implicit none
  private

  public :: rounding_of_places, measure_points, carried_slip

contains

  !> A gap is a difference of places, and rounded as they are.
  pure function rounding_of_places(scene, u) result(rounding)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: u(:, :)      !! (3,n_nodes) [length]
    real(wp) :: rounding                 !! [length]
    integer :: i

    rounding = maxval(abs(scene%mesh%coordinates)) + maxval(abs(u))
    do i = 1, size(scene%obstacles)
      rounding = max(rounding, extent_of(scene%obstacles(i)))
    end do
    rounding = 8.0_wp*epsilon(1.0_wp)*rounding
  end function rounding_of_places

  !> How far the contact on curved obstacles, facets among them, is from where it was linearised:
  !> gaps of points that press and penetrations beside the displacements, turns of their normals,
  !> and slips that obstacles which turn add.
  pure subroutine measure_points(scene, points, placement, now, old, new, moved)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(placement_t), intent(in) :: placement !! of the linearisation
    type(placement_t), intent(in) :: now       !! at the displacement of `new`
    type(state_t), intent(in) :: old, new
    real(wp), intent(out) :: moved            !! [-]
    real(wp) :: turn, length, dragged
    integer :: i

    moved = 0.0_wp
    if (.not. any(points%is_curved)) return
    turn = 0.0_wp
    dragged = maxval(norm2(now%drag, dim=1), mask=scene%pairs(points%pair)%master > 0)
    do i = 1, points%n
      if (.not. points%is_curved(i) .or. scene%pairs(points%pair(i))%master == 0) cycle
      if (any(abs(new%reaction(:, i)) > 0.0_wp)) then
        moved = max(moved, abs(now%gap(i)))
        if (dragged > 0.0_wp) turn = max(turn, norm2(now%drag(:, i) - placement%drag(:, i))/dragged)
        turn = max(turn, norm2(now%frame(:, 1, i) - placement%frame(:, 1, i)))
      else
        moved = max(moved, -now%gap(i))
      end if
    end do
    length = maxval(abs(new%displacement - old%displacement))
    ! Past what turns nothing may go any further: then what has gone counts, as far as turns go.
    length = max(length, min(dragged, maxval(abs(new%displacement))))
    if (length <= 0.0_wp) length = maxval(abs(new%displacement))
    if (length > 0.0_wp) moved = moved/length
    moved = max(moved, turn)
  end subroutine measure_points

  !> The slip before the increment, in the tangent planes of its end.
  pure function carried_slip(points, before, placement, slip) result(carried)
    type(contact_points_t), intent(in) :: points
    type(placement_t), intent(in) :: before    !! where the increment began
    type(placement_t), intent(in) :: placement !! at its end
    real(wp), intent(in) :: slip(:, :)         !! (2,n_points) along t1, t2 there [length]
    real(wp) :: carried(2, points%n)           !! along t1, t2 here [length]
    integer :: i

    carried = slip
    do i = 1, points%n
      if (.not. points%turns(i)) cycle
      associate (from => before%frame(:, :, i), to => placement%frame(:, :, i))
        carried(:, i) = matmul(transport_tangent(matmul(from(:, 2:), slip(:, i)), from(:, 1), &
          to(:, 1)), to(:, 2:))
      end associate
    end do
  end function carried_slip

end module follow_points_mod
