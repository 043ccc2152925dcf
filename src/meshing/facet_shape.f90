!> Whether a facet of an obstacle has a shape that normals can be made of.
module facet_shape_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: cross
  implicit none
  private

  public :: facet_is_flat

  real(wp), parameter :: least_height = 1.0e-10_wp !! of a facet, beside its longest edge [-]

contains

  !> Whether a facet has no area to speak of, or one of the corners of a quadrilateral is turned
  !> inwards.
  pure logical function facet_is_flat(x)
    real(wp), intent(in) :: x(:, :) !! (3,3) or (3,4) [length]
    real(wp) :: normal(3, size(x, 2)), mean(3), longest, flat(3, size(x, 2))
    integer :: i, n

    n = size(x, 2)
    longest = maxval(maxval(x, dim=2) - minval(x, dim=2))
    facet_is_flat = .not. longest > 0.0_wp
    if (facet_is_flat) return
    flat = (x - spread(x(:, 1), 2, n))/longest
    do i = 1, n
      normal(:, i) = cross(flat(:, 1 + mod(i, n)) - flat(:, i), &
        flat(:, 1 + mod(i + n - 2, n)) - flat(:, i))
    end do
    mean = sum(normal, 2)
    facet_is_flat = norm2(mean) <= least_height .or. &
      any(matmul(mean, normal) <= least_height*norm2(mean))
  end function facet_is_flat

end module facet_shape_mod
