!> Local Newton on the six unknowns (r, x) of a point, as [JFT07] eq. (13) prints it.
module local_newton6_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: solve_small
  use local_point_mod, only: local_point_t, zero_level
  implicit none
  private

  public :: solve_newton6

  integer, parameter :: max_iterations = 30

contains

  !> Newton on f(r, x) = (x - W_ii r - x_loc, Z). [JFT07] eqs. (11) and (13), docs/theory.md (4.3).
  pure subroutine solve_newton6(point, r, iterations, converged)
    type(local_point_t), intent(in) :: point
    real(wp), intent(inout) :: r(3)       !! reaction [force]
    integer,  intent(out)   :: iterations !! evaluations of f
    logical,  intent(out)   :: converged  !! |Z| at its zero level; when not, r is the guess again
    real(wp) :: start(3), x(3), f(6), j(6, 6), d(6), dz_dr(3, 3), dz_dx(3, 3)
    logical :: regular
    integer :: i

    start = r
    x = matmul(point%w, r) + point%x_loc
    newton: do iterations = 1, max_iterations
      ! The first three equations are linear and hold from the start: Z alone decides.
      f(:3) = x - matmul(point%w, r) - point%x_loc
      call point%residual(point, r, x, f(4:), dz_dr, dz_dx)
      converged = norm2(f(4:)) <= zero_level(point, r)
      if (converged) exit newton
      j(:3, :3) = -point%w
      j(:3, 4:) = 0.0_wp
      do i = 1, 3
        j(i, i + 3) = 1.0_wp
      end do
      j(4:, :3) = dz_dr
      j(4:, 4:) = dz_dx
      call solve_small(j, -f, d, regular)
      if (.not. regular) exit newton
      r = r + d(:3)
      x = x + d(4:)
    end do newton
    iterations = min(iterations, max_iterations)
    r = merge(r - f(4:), start, converged)
  end subroutine solve_newton6

end module local_newton6_mod
