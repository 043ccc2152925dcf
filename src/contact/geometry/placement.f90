!> Where the contact points stand before their masters: frames, gaps and weights, about which
!> contact is linear until it is placed anew.
module placement_mod
  use kinds_mod, only: wp
  use obstacles_mod, only: obstacle_t
  use obstacle_shapes_mod, only: shift_of, turned, locate_point
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t, weights_t
  use local_frame_mod, only: local_frame
  implicit none
  private

  public :: placement_t, place, place_all, place_undeformed, place_curved

  !> Before a flat obstacle a placement holds wherever the point goes; before a curved one near the
  !> displacement that it was made for.
  type :: placement_t
    real(wp), allocatable :: frame(:, :, :)  !! (3,3,n_points) columns n, t1, t2
    real(wp), allocatable :: gap(:)          !! (n_points) at the reference [length]
    real(wp), allocatable :: reference(:, :)
    !! (3,n_points) displacement of the node less that of the master there [length]
    type(weights_t) :: weights               !! of the masters' nodes
    real(wp), allocatable :: drag(:, :)
    !! (3,n_points) what the turn of obstacles adds to the motion of the points about them in the
    !! increment (drag_points_mod), 0 where none turns [length]
  end type placement_t

contains

  !> All points of the undeformed mesh.
  pure subroutine place_undeformed(scene, points, placement)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(placement_t), intent(out) :: placement
    real(wp) :: nothing(3, scene%mesh%n_nodes)

    nothing = 0.0_wp
    call place_all(scene, points, nothing, placement)
  end subroutine place_undeformed

  !> All points where displacement `u` takes them.
  pure subroutine place_all(scene, points, u, placement, rotation)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: u(:, :)      !! (3,n_nodes) [length]
    type(placement_t), intent(out) :: placement
    real(wp), intent(in), optional :: rotation(:, :) !! as of `place`
    integer :: pair

    allocate (placement%frame(3, 3, points%n), placement%gap(points%n))
    allocate (placement%reference(3, points%n))
    allocate (placement%drag(3, points%n), source=0.0_wp)
    allocate (placement%weights%first(points%n + 1), source=1)
    allocate (placement%weights%node(0), placement%weights%weight(0))
    do pair = 1, size(scene%pairs)
      call place(scene, points, pair, u, placement, rotation)
    end do
  end subroutine place_all

  !> The points before curved masters, where displacement `u` takes them.
  pure subroutine place_curved(scene, points, u, placement, rotation)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: u(:, :)      !! (3,n_nodes) [length]
    type(placement_t), intent(inout) :: placement
    real(wp), intent(in), optional :: rotation(:, :) !! as of `place`
    integer :: pair

    do pair = 1, size(scene%pairs)
      associate (first => points%first(pair), last => points%first(pair + 1) - 1)
        if (any(points%is_curved(first:last))) call place(scene, points, pair, u, placement, &
          rotation)
      end associate
    end do
  end subroutine place_curved

  !> The points of one pair, all of them: weights may be integrals over both surfaces.
  pure subroutine place(scene, points, pair, u, placement, rotation)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair
    real(wp), intent(in) :: u(:, :)      !! (3,n_nodes) reference nodes of obstacles too [length]
    type(placement_t), intent(inout) :: placement
    real(wp), intent(in), optional :: rotation(:, :)
    !! (3,n_obstacles) rotation vectors; left out: obstacles stand as the deck has them [rad]
    type(obstacle_t) :: obstacle
    real(wp) :: shift(3), normal(3)
    integer :: i, n

    associate (master => scene%pairs(pair)%master, &
               first => points%first(pair), last => points%first(pair + 1) - 1)
      obstacle = scene%obstacles(master)
      if (obstacle%turns .and. present(rotation)) obstacle = turned(obstacle, rotation(:, master), &
        scene%mesh%coordinates(:, obstacle%ref_node))
      shift = shift_of(obstacle, u)
      n = merge(1, 0, obstacle%ref_node > 0)
      do i = first, last
        associate (node => points%node(i), gap => placement%gap(i))
          call locate_point(obstacle, shift, scene%mesh%coordinates(:, node) + u(:, node), gap, &
            normal)
          gap = gap + points%extra_gap(i)
          placement%frame(:, :, i) = local_frame(normal)
          placement%reference(:, i) = u(:, node) - shift
        end associate
      end do
      ! A rigid master moves as its reference node does.
      call replace_rows(placement%weights, first, [(1 + n*(i - first), i=first, last + 1)], &
        spread(obstacle%ref_node, 1, n*(last - first + 1)), &
        spread(1.0_wp, 1, n*(last - first + 1)))
    end associate
  end subroutine place

  !> Put other rows in the place of those of some points that stand together.
  pure subroutine replace_rows(weights, point, first, node, weight)
    type(weights_t), intent(inout) :: weights
    integer, intent(in) :: point              !! the first of them
    integer, intent(in) :: first(:)           !! (n+1) where each row begins, from 1
    integer, intent(in) :: node(:)            !! (n_entries)
    real(wp), intent(in) :: weight(:)         !! (n_entries) [-]
    integer :: before, n_old, behind

    behind = point + size(first) - 1 ! the first point behind them
    before = weights%first(point) - 1
    n_old = weights%first(behind) - 1 - before
    if (n_old /= size(node)) then
      weights%node = [weights%node(:before), node, weights%node(before + n_old + 1:)]
      weights%weight = [weights%weight(:before), weight, weights%weight(before + n_old + 1:)]
      weights%first(behind + 1:) = weights%first(behind + 1:) + size(node) - n_old
    else
      weights%node(before + 1:before + n_old) = node
      weights%weight(before + 1:before + n_old) = weight
    end if
    weights%first(point:behind) = before + first
  end subroutine replace_rows

end module placement_mod
