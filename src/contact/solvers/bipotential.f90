!> The bi-potential formulation: contact and friction in one projection.
module bipotential_mod
  use kinds_mod, only: wp
  use law_mod, only: project_prediction, cone_derivative, pull_derivative, augmented_gap, &
    change_with_coefficient
  use increment_report_mod, only: status_open
  use local_point_mod, only: local_point_t, find_coefficient
  implicit none
  private

  public :: bipotential_residual

contains

  !> Z = r - P_K(y), y = r - rho x*, and its derivatives I - P' and rho P' (I + mu n s^T), s = (0,
  !> x_t/|x_t|).
  !>
  !> The coefficient is the one that belongs to r_n. [JFT07] eqs. (9) and (10), docs/theory.md
  !> (3.4), (3.13) and (4.5).
  pure subroutine bipotential_residual(point, r, x, z, dz_dr, dz_dx)
    type(local_point_t), intent(in) :: point
    real(wp), intent(in)  :: r(3)        !! reaction [force]
    real(wp), intent(in)  :: x(3)        !! gap and slip increment [length]
    real(wp), intent(out) :: z(3)        !! [force]
    real(wp), intent(out) :: dz_dr(3, 3) !! [-]
    real(wp), intent(out) :: dz_dx(3, 3) !! [force/length]
    real(wp) :: y(3), p(3), x_t, mu, change
    integer :: status, i

    call find_coefficient(point, r(1), mu, change)
    y = r - point%rho*augmented_gap(mu, x)
    call project_prediction(mu, point%stays, point%rho, r, x, p, status)
    z = r - p
    if (point%stays .and. status == status_open) then
      dz_dx = pull_derivative(mu, y)
    else
      dz_dx = cone_derivative(mu, y, status)
    end if
    dz_dr = -dz_dx
    do i = 1, 3
      dz_dr(i, i) = dz_dr(i, i) + 1.0_wp
    end do
    if (abs(change) > 0.0_wp) dz_dr(:, 1) = dz_dr(:, 1) - change*change_with_coefficient(mu, &
      point%stays, point%rho, r, x, p, status)
    x_t = norm2(x(2:))
    if (x_t > 0.0_wp) then
      do i = 2, 3
        dz_dx(:, i) = dz_dx(:, i) + (mu*x(i)/x_t)*dz_dx(:, 1)
      end do
    end if
    dz_dx = point%rho*dz_dx
  end subroutine bipotential_residual

end module bipotential_mod
