!> At finite strain: what slips before surfaces of bodies are more than the motion of a node against
!> its master by the weights of the end. docs/theory.md (11.18).
module surface_drag_mod
  use kinds_mod, only: wp
  use scene_mod, only: scene_t
  use bodies_mod, only: is_linear
  use contact_points_mod, only: contact_points_t, weights_t, is_covered, is_across, is_still
  use state_mod, only: state_t
  use placement_mod, only: placement_t, place_curved
  use transfer_mod, only: relative_motion
  implicit none
  private

  public :: place_beginning, drag_along_surfaces

contains

  !> The points where an increment begins, at finite strain those too of which masters cover next to
  !> nothing.
  pure subroutine place_beginning(scene, points, old, undeformed, began)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(state_t), intent(in) :: old
    type(placement_t), intent(in) :: undeformed
    type(placement_t), intent(out) :: began

    began = undeformed
    if (allocated(old%alone)) began%weights%alone = old%alone
    if (.not. is_linear(scene)) began%weights%covers = .true.
    call place_curved(scene, points, old%displacement, began, old%rotation, &
      stay=.not. is_linear(scene))
  end subroutine place_beginning

  !> The slip before surfaces, less the motion by the weights of `placement`. It is how far what a
  !> point faces goes over the master, at the places of the increment's end,
  !>
  !>     (P - P_0) x_m
  !>
  !> so that bodies which turn together do not slip (Puso and Laursen 2004). Points that face
  !> nothing in one of the placements slip by the weights of the end alone.
  pure subroutine drag_along_surfaces(scene, points, began, old, u, placement, reaction)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(placement_t), intent(in) :: began   !! where the increment began: P_0
    type(state_t), intent(in) :: old         !! there
    real(wp), intent(in) :: u(:, :)          !! (3,n_nodes) at its end [length]
    type(placement_t), intent(inout) :: placement !! at `u`: P; gets `drag`
    real(wp), intent(in), optional :: reaction(:, :)
    !! (3,n_points) at the end: points without one slip by the weights of the end, too, for what
    !! they face from afar goes far [force]
    integer :: pair, i

    if (is_linear(scene)) return
    do pair = 1, size(scene%pairs)
      if (scene%pairs(pair)%master > 0) cycle
      do i = points%first(pair), points%first(pair + 1) - 1
        associate (drag => placement%drag(:, i), now => placement%weights)
          drag = 0.0_wp
          if (present(reaction)) then
            if (.not. any(abs(reaction(:, i)) > 0.0_wp)) cycle
          end if
          if (.not. (is_covered(points, now, i) .and. is_covered(points, began%weights, i))) cycle
          drag = faced_place(scene, points, now, i, u) - faced_place(scene, points, &
            began%weights, i, u) - relative_motion(points, now, i, u - old%displacement)
          where (is_across(points, i) .or. is_still(now, i)) drag = 0.0_wp
        end associate
      end do
    end do
  end subroutine drag_along_surfaces

  !> The place on the master that a point faces by its weights, from that of its node.
  pure function faced_place(scene, points, weights, i, u) result(place)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(weights_t), intent(in) :: weights
    integer, intent(in) :: i         !! point
    real(wp), intent(in) :: u(:, :)  !! (3,n_nodes) [length]
    real(wp) :: place(3)             !! [length]
    integer :: k

    place = 0.0_wp
    associate (x => scene%mesh%coordinates, node => points%node(i))
      do k = weights%first(i), weights%first(i + 1) - 1
        associate (master => weights%node(k))
          place = place + weights%weight(k)*((x(:, master) - x(:, node)) + (u(:, master) - &
            u(:, node)))
        end associate
      end do
    end associate
  end function faced_place

end module surface_drag_mod
