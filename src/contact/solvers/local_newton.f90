!> Local Newton: the point solved by the 3x3 system left when x is eliminated from [JFT07] eq. (13).
module local_newton_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: solve_small
  use local_point_mod, only: local_point_t, zero_level
  implicit none
  private

  public :: solve_newton

  integer, parameter :: max_iterations = 30

contains

  !> Iterate r <- r - J^-1 Z with J = dZ/dr + dZ/dx W_ii and x = W_ii r + x_loc. Docs/theory.md
  !> (4.4).
  pure subroutine solve_newton(point, r, iterations, converged)
    type(local_point_t), intent(in) :: point
    real(wp), intent(inout) :: r(3)       !! reaction [force]
    integer,  intent(out)   :: iterations !! evaluations of the residual
    logical,  intent(out)   :: converged  !! |Z| at its zero level; when not, r is the guess again
    real(wp) :: start(3), x(3), z(3), dz_dr(3, 3), dz_dx(3, 3), dr(3)
    logical :: regular

    start = r
    newton: do iterations = 1, max_iterations
      x = matmul(point%w, r) + point%x_loc
      call point%residual(point, r, x, z, dz_dr, dz_dx)
      converged = norm2(z) <= zero_level(point, r)
      if (converged) exit newton
      call solve_small(dz_dr + matmul(dz_dx, point%w), -z, dr, regular)
      if (.not. regular) exit newton
      r = r + dr
    end do newton
    iterations = min(iterations, max_iterations)
    ! r - Z is the projection: admissible to rounding, and 0 where the point opens.
    r = merge(r - z, start, converged)
  end subroutine solve_newton

end module local_newton_mod
