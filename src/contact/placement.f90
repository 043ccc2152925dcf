!> Where the contact points stand before their obstacles: frames and gaps, about which contact is
!> linear until it is placed anew.
module placement_mod
  use kinds_mod, only: wp
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use follow_points_mod, only: locate_at, relative
  implicit none
  private

  public :: placement_t, place_undeformed, place_curved, gap_at

  !> Before a flat obstacle a placement holds wherever the point goes; before a curved one near the
  !> displacement that it was made for.
  type :: placement_t
    real(wp), allocatable :: frame(:, :, :)  !! (3,3,n_points) columns n, t1, t2
    real(wp), allocatable :: gap(:)          !! (n_points) at the reference [length]
    real(wp), allocatable :: reference(:, :)
    !! (3,n_points) displacement of the node less that of the obstacle there [length]
  end type placement_t

contains

  !> All points of the undeformed mesh.
  pure subroutine place_undeformed(scene, points, placement)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(placement_t), intent(out) :: placement
    real(wp) :: nothing(3, scene%mesh%n_nodes)
    integer :: i

    allocate (placement%frame(3, 3, points%n), placement%gap(points%n))
    allocate (placement%reference(3, points%n))
    nothing = 0.0_wp
    do i = 1, points%n
      call place(scene, points, i, nothing, placement)
    end do
  end subroutine place_undeformed

  !> The points before curved obstacles, where displacement `u` takes them.
  pure subroutine place_curved(scene, points, u, placement)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: u(:, :)      !! (3,n_nodes) [length]
    type(placement_t), intent(inout) :: placement
    integer :: i

    do i = 1, points%n
      if (points%is_curved(i)) call place(scene, points, i, u, placement)
    end do
  end subroutine place_curved

  !> One point.
  pure subroutine place(scene, points, i, u, placement)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: i
    real(wp), intent(in) :: u(:, :)      !! (3,n_nodes) [length]
    type(placement_t), intent(inout) :: placement

    call locate_at(scene, points, i, u, placement%gap(i), placement%frame(:, :, i))
    placement%reference(:, i) = relative(points, i, u)
  end subroutine place

  !> The gap of a point at displacement `u`, linear about the placement.
  pure real(wp) function gap_at(placement, points, i, u) result(gap)
    type(placement_t), intent(in) :: placement
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: i
    real(wp), intent(in) :: u(:, :)      !! (3,n_nodes) [length]

    gap = placement%gap(i) + dot_product(placement%frame(:, 1, i), relative(points, i, u) - &
      placement%reference(:, i))
  end function gap_at

end module placement_mod
