!> What obstacles that turn do to the slip of the points before them. docs/theory.md (9.8).
module drag_points_mod
  use kinds_mod, only: wp
  use rotations_mod, only: rotation_matrix, turn_between
  use pair_faces_mod, only: is_of_slave
  use scene_mod, only: scene_t, pair_turns
  use contact_points_mod, only: contact_points_t, of_row
  use state_mod, only: state_t
  use placement_mod, only: placement_t
  implicit none
  private

  public :: drag_points

contains

  !> The motion of each point about an obstacle that turns, in an increment that takes it to
  !> displacement `u`, less the motion of its node against the reference node.
  !>
  !> As the obstacle sees it, the point goes from one place of its material to another, along the
  !> chord. In space the chord is drawn as the obstacle stands halfway: so what sticks does not
  !> slip, and what stays in place slips against the motion of the material there.
  pure subroutine drag_points(scene, points, old, u, rotation, placement)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(state_t), intent(in) :: old        !! where the increment began
    real(wp), intent(in) :: u(:, :)         !! (3,n_nodes) at its end [length]
    real(wp), intent(in) :: rotation(:, :)  !! (3,n_obstacles) at its end [rad]
    type(placement_t), intent(inout) :: placement !! gets `drag`
    real(wp) :: half(3, 3), arm(3), before(3), after(3)
    logical :: is_own(size(u, 2))
    integer :: pair, i

    do pair = 1, size(scene%pairs)
      if (.not. pair_turns(scene, pair)) cycle
      associate (obstacle => scene%obstacles(scene%pairs(pair)%master), &
                 before_turn => old%rotation(:, scene%pairs(pair)%master), &
                 after_turn => rotation(:, scene%pairs(pair)%master))
        is_own = is_of_slave(scene, points, pair)
        half = rotation_matrix(0.5_wp*turn_between(before_turn, after_turn))
        do i = points%first(pair), points%first(pair + 1) - 1
          associate (ref_node => obstacle%ref_node)
            arm = of_row(points, placement%weights, i, is_own, &
              scene%mesh%coordinates) - &
              scene%mesh%coordinates(:, ref_node)
            before = arm + of_row(points, placement%weights, i, is_own, old%displacement) - &
              old%displacement(:, ref_node)
            after = arm + of_row(points, placement%weights, i, is_own, u) - u(:, ref_node)
            placement%drag(:, i) = (matmul(after, half) - after) - (matmul(half, before) - before)
          end associate
        end do
      end associate
    end do
  end subroutine drag_points

end module drag_points_mod
