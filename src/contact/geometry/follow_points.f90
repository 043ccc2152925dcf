!> Where the contact points are on their obstacles, as nodes and obstacles move.
module follow_points_mod
  use kinds_mod, only: wp
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t
  use search_mod, only: locate, transport_tangent
  implicit none
  private

  public :: locate_at, rounding_of_places, relative, nodal, measure_points, carried_slip

contains

  !> Gap and frame of one contact point where displacement `u` takes its node and its obstacle.
  pure subroutine locate_at(scene, points, i, u, gap, frame)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: i
    real(wp), intent(in) :: u(:, :)      !! (3,n_nodes) reference nodes of obstacles too [length]
    real(wp), intent(out) :: gap         !! *CONTACT GAP included [length]
    real(wp), intent(out) :: frame(3, 3) !! columns n, t1, t2
    real(wp) :: shift(3)

    shift = 0.0_wp
    if (points%ref_node(i) > 0) shift = u(:, points%ref_node(i))
    call locate(scene%obstacles(scene%pairs(points%pair(i))%master), shift, &
      scene%mesh%coordinates(:, points%node(i)) + u(:, points%node(i)), gap, frame)
    gap = gap + points%extra_gap(i)
  end subroutine locate_at

  !> A gap is a difference of places, and rounded as they are.
  pure function rounding_of_places(scene, u) result(rounding)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: u(:, :)      !! (3,n_nodes) [length]
    real(wp) :: rounding                 !! [length]
    integer :: i

    rounding = maxval(abs(scene%mesh%coordinates)) + maxval(abs(u))
    do i = 1, size(scene%obstacles)
      rounding = max(rounding, maxval(abs(scene%obstacles(i)%point)) + scene%obstacles(i)%radius)
    end do
    rounding = 8.0_wp*epsilon(1.0_wp)*rounding
  end function rounding_of_places

  !> Displacement of a point's node less that of its obstacle.
  pure function relative(points, i, u) result(d)
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: i
    real(wp), intent(in) :: u(:, :) !! (3,n_nodes) [length]
    real(wp) :: d(3)

    d = u(:, points%node(i))
    if (points%ref_node(i) > 0) d = d - u(:, points%ref_node(i))
  end function relative

  !> Reactions of the points as forces of the nodes.
  pure function nodal(points, reaction, n_nodes) result(force)
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: reaction(:, :) !! (3,n_points)
    integer, intent(in) :: n_nodes
    real(wp) :: force(3, n_nodes)
    integer :: i

    force = 0.0_wp
    do i = 1, points%n
      force(:, points%node(i)) = force(:, points%node(i)) + reaction(:, i)
      if (points%ref_node(i) == 0) cycle
      force(:, points%ref_node(i)) = force(:, points%ref_node(i)) - reaction(:, i)
    end do
  end function nodal

  !> How far the contact on curved obstacles is from where it was linearised: gaps of points that
  !> press and penetrations beside the displacements, and turns of their normals.
  subroutine measure_points(scene, points, frame, old, new, moved)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: frame(:, :, :)    !! (3,3,n_points) of the linearisation
    type(state_t), intent(in) :: old, new
    real(wp), intent(out) :: moved            !! [-]
    real(wp) :: gap, frame_now(3, 3), turn, length
    integer :: i

    moved = 0.0_wp
    if (.not. any(points%is_curved)) return
    turn = 0.0_wp
    do i = 1, points%n
      if (.not. points%is_curved(i)) cycle
      call locate_at(scene, points, i, new%displacement, gap, frame_now)
      if (any(abs(new%reaction(:, i)) > 0.0_wp)) then
        moved = max(moved, abs(gap))
        turn = max(turn, norm2(frame_now(:, 1) - frame(:, 1, i)))
      else
        moved = max(moved, -gap)
      end if
    end do
    length = maxval(abs(new%displacement - old%displacement))
    if (length <= 0.0_wp) length = maxval(abs(new%displacement))
    if (length > 0.0_wp) moved = moved/length
    moved = max(moved, turn)
  end subroutine measure_points

  !> The slip before the increment, in the tangent planes of its end.
  pure function carried_slip(scene, points, frame, old) result(slip)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: frame(:, :, :)    !! (3,3,n_points) at the end
    type(state_t), intent(in) :: old
    real(wp) :: slip(2, points%n)             !! along t1, t2 [length]
    real(wp) :: gap, before(3, 3)
    integer :: i

    slip = old%slip
    do i = 1, points%n
      if (.not. points%is_curved(i)) cycle
      call locate_at(scene, points, i, old%displacement, gap, before)
      slip(:, i) = matmul(transport_tangent(matmul(before(:, 2:), old%slip(:, i)), before(:, 1), &
        frame(:, 1, i)), frame(:, 2:, i))
    end do
  end function carried_slip

end module follow_points_mod
