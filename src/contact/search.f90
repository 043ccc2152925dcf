!> Where the slave nodes stand before their obstacles: local frames and gaps.
module search_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: cross
  use obstacles_mod, only: obstacle_t
  implicit none
  private

  public :: locate, local_frame

contains

  !> Gap and local frame of a point in space before an obstacle.
  pure subroutine locate(obstacle, x, gap, frame)
    type(obstacle_t), intent(in) :: obstacle
    real(wp), intent(in)  :: x(3)         !! the point [length]
    real(wp), intent(out) :: gap          !! signed distance, negative inside the obstacle [length]
    real(wp), intent(out) :: frame(3, 3)  !! columns n, t1, t2

    gap = dot_product(obstacle%normal, x - obstacle%point)
    frame = local_frame(obstacle%normal)
  end subroutine locate

  !> The local frame of a normal: t1 is the global x axis projected on the tangent plane (the y axis
  !> where the normal is within 45 degrees of x), t2 = n x t1.
  pure function local_frame(normal) result(frame)
    real(wp), intent(in) :: normal(3)  !! unit vector
    real(wp) :: frame(3, 3)            !! columns n, t1, t2
    real(wp) :: axis(3), t1(3)

    axis = [1.0_wp, 0.0_wp, 0.0_wp]
    if (2.0_wp*normal(1)**2 > 1.0_wp) axis = [0.0_wp, 1.0_wp, 0.0_wp]
    t1 = axis - dot_product(axis, normal)*normal
    t1 = t1/norm2(t1)
    frame(:, 1) = normal
    frame(:, 2) = t1
    frame(:, 3) = cross(normal, t1)
  end function local_frame

end module search_mod
