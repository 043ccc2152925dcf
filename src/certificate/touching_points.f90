!> Points that touch their masters in the mesh, as far as its coordinates are known: their gaps are
!> known as well as displacements are. docs/theory.md sections 6 and (12.4).
module touching_points_mod
  use kinds_mod, only: wp
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t
  use increment_report_mod, only: contact_fields_t
  use edge_middles_mod, only: edge_middles_t, vector_at_point
  use obstacle_gaps_mod, only: find_closest, has_closest_point, rounding_at_rest
  implicit none
  private

  public :: find_touching

contains

  !> Which points touch in the mesh. Where an obstacle has turned, or is made of facets, its places
  !> are sums, and none does.
  pure function find_touching(scene, points, middles, new, contact) result(touches)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(edge_middles_t), intent(in) :: middles
    type(state_t), intent(in) :: new
    type(contact_fields_t), intent(in) :: contact !! frames and weights
    logical :: touches(points%n)
    logical :: ends_touch(points%n)
    real(wp) :: rounding, gap, normal(3), apart(3)
    real(wp), parameter :: stays(3) = 0.0_wp
    integer :: i, k

    touches = .false.
    rounding = rounding_at_rest(scene)
    do i = 1, points%n
      associate (master => scene%pairs(points%pair(i))%master)
        if (master > 0) then
          associate (obstacle => scene%obstacles(master))
            if (.not. has_closest_point(obstacle) .or. any(abs(new%rotation(:, master)) > &
              0.0_wp)) cycle
            normal = contact%frame(:, 1, i)
            call find_closest(obstacle, obstacle%normal, scene%mesh%coordinates(:, &
              points%node(i)) - obstacle%point, stays, rounding, gap, normal)
            touches(i) = .not. abs(gap) > 0.0_wp
          end associate
        else
          associate (weights => contact%weights, x => scene%mesh%coordinates)
            apart = vector_at_point(middles, points%node(i), i, x)
            do k = weights%first(i), weights%first(i + 1) - 1
              apart = apart - weights%weight(k)*x(:, weights%node(k))
            end do
            touches(i) = abs(dot_product(contact%frame(:, 1, i), apart)) <= rounding* &
              sum(abs(weights%weight(weights%first(i):weights%first(i + 1) - 1)))
          end associate
        end if
      end associate
    end do
    if (.not. middles%is_any) return
    ends_touch = touches
    do i = 1, points%n
      if (.not. middles%a(i) > 0.0_wp .or. scene%pairs(points%pair(i))%master == 0) cycle
      touches(i) = touches(i) .and. all(ends_touch(middles%ends(:, i)))
    end do
  end function find_touching

end module touching_points_mod
