!> Slave nodes that lie inside their obstacle before anything has moved.
module initial_overlaps_mod
  use kinds_mod, only: wp
  use mesh_mod, only: deck_rounding
  use text_mod, only: string_t, to_text
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use placement_mod, only: placement_t, place_undeformed
  implicit none
  private

  public :: overlaps

  real(wp), parameter :: rounding = 1.0e-12_wp !! of the size of the coordinates: no overlap

contains

  !> A line a pair whose nodes overlap: how many, how far and where.
  pure function overlaps(scene, points) result(lines)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(string_t), allocatable :: lines(:)
    type(string_t) :: line
    type(placement_t) :: placement
    real(wp) :: deepest, least
    integer :: pair, i, n, node

    allocate (lines(0))
    call place_undeformed(scene, points, placement)
    least = max(rounding*maxval(abs(scene%mesh%coordinates)), 16.0_wp*deck_rounding( &
      scene%mesh%coordinates, scene%mesh%origin))
    do pair = 1, size(scene%pairs)
      n = 0
      node = 0
      deepest = least
      do i = points%first(pair), points%first(pair + 1) - 1
        associate (gap => placement%gap(i))
          if (-gap <= least) cycle
          n = n + 1
          if (-gap <= deepest) cycle
          deepest = -gap
          node = points%node(i)
        end associate
      end do
      if (n == 0) cycle
      line%text = 'note: '//to_text(n)//' nodes of '//scene%pairs(pair)%name// &
        ' overlap before the first step, by up to '//to_text(deepest, 4)//' at node '// &
        to_text(scene%mesh%node_id(node))//'; ADJUST= of *CONTACT PAIR closes overlaps'
      lines = [lines, line]
    end do
  end function overlaps

end module initial_overlaps_mod
