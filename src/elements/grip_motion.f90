!> What grips do to the nodes that they take along, and these to them.
!>
!>     x = x_ref + R(theta) (X - X_ref),
!>
!> R of the rotation vector theta by Rodrigues' formula: prescribed displacements, not linear in
!> theta. docs/theory.md (8.37).
module grip_motion_mod
  use kinds_mod, only: wp
  use rotations_mod, only: change_of_place
  use small_matrix_mod, only: cross
  use scene_mod, only: scene_t
  use grips_mod, only: is_grip, nodes_of_grip
  implicit none
  private

  public :: move_grips, held_by_references

contains

  !> Displacements of the nodes that grips take along, from those of the reference nodes.
  pure subroutine move_grips(scene, u)
    type(scene_t), intent(in) :: scene
    real(wp), intent(inout) :: u(:, :)  !! (3,n_nodes) [length]
    real(wp) :: arm(3)
    integer, allocatable :: nodes(:)
    integer :: i, k

    if (.not. scene%finite_strain .or. .not. allocated(scene%rotations)) return
    do i = 1, size(scene%rotations)
      if (.not. is_grip(scene, i)) cycle
      nodes = nodes_of_grip(scene, i)
      associate (of => scene%rotations(i), x => scene%mesh%coordinates)
        do k = 1, size(nodes)
          arm = x(:, nodes(k)) - x(:, of%node)
          u(:, nodes(k)) = u(:, of%node) + matmul(change_of_place(u(:, of%rotation_node)/ &
            of%length), arm)
        end do
      end associate
    end do
  end subroutine move_grips

  !> Forces of the supports, those on nodes that grips take along given to the reference nodes:
  !> their sum, and as that on the rotation their moment about where the reference node is.
  pure function held_by_references(scene, u, support) result(held)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: u(:, :)         !! (3,n_nodes) [length]
    real(wp), intent(in) :: support(:, :)   !! (3,n_nodes) [force]
    real(wp) :: held(3, size(support, 2))   !! [force]
    integer, allocatable :: nodes(:)
    integer :: i, k

    held = support
    if (.not. scene%finite_strain .or. .not. allocated(scene%rotations)) return
    do i = 1, size(scene%rotations)
      if (.not. is_grip(scene, i)) cycle
      nodes = nodes_of_grip(scene, i)
      associate (of => scene%rotations(i), x => scene%mesh%coordinates)
        do k = 1, size(nodes)
          held(:, of%node) = held(:, of%node) + held(:, nodes(k))
          held(:, of%rotation_node) = held(:, of%rotation_node) + cross(x(:, nodes(k)) + &
            u(:, nodes(k)) - x(:, of%node) - u(:, of%node), held(:, nodes(k)))/of%length
          held(:, nodes(k)) = 0.0_wp
        end do
      end associate
    end do
  end function held_by_references

end module grip_motion_mod
