!> The pseudo-potential formulation: one projection for contact, one for friction.
module pseudopotential_mod
  use kinds_mod, only: wp
  use law_mod, only: project_normal, project_on_disc, project_beside_driven
  use local_point_mod, only: local_point_t, find_radius
  implicit none
  private

  public :: pseudopotential_residual, residual_beside_driven

contains

  !> Z_n = r_n - max(0, y_n) and Z_t = r_t - P_D(y_t), y = r - (rho_n x_n, rho_t x_t), D of radius
  !> the largest friction at y_n. Where the point stays closed Z_n = r_n - y_n.
  !>
  !> The radius is Alart and Curnier's (1991), defined where r_n is not admissible yet.
  !> [JFT07] eqs. (5) to (8), docs/theory.md (3.7) and (4.6).
  pure subroutine pseudopotential_residual(point, r, x, z, dz_dr, dz_dx)
    type(local_point_t), intent(in) :: point
    real(wp), intent(in)  :: r(3)        !! reaction [force]
    real(wp), intent(in)  :: x(3)        !! gap and slip increment [length]
    real(wp), intent(out) :: z(3)        !! [force]
    real(wp), intent(out) :: dz_dr(3, 3) !! [-]
    real(wp), intent(out) :: dz_dx(3, 3) !! [force/length]
    real(wp) :: y(3), p(3), rho(3), radius, slope, t(2), derivative(3, 3)
    logical :: inside
    integer :: i

    rho = [point%rho_n, point%rho_t, point%rho_t]
    y = r - rho*x
    call find_radius(point, y(1), radius, slope)
    p(1) = project_normal(point%stays, y(1))
    call project_on_disc(radius, y(2:), p(2:), inside)
    z = r - p

    derivative = 0.0_wp
    if (point%stays .or. y(1) > 0.0_wp) derivative(1, 1) = 1.0_wp
    if (inside) then
      ! In the empty disc of an open point only y_t = 0 is inside: the tangential part does not
      ! move.
      if (y(1) > 0.0_wp) then
        derivative(2, 2) = 1.0_wp
        derivative(3, 3) = 1.0_wp
      end if
    else
      t = y(2:)/norm2(y(2:))
      do i = 1, 2
        derivative(2:, i + 1) = -(radius/norm2(y(2:)))*t(i)*t
        derivative(i + 1, i + 1) = derivative(i + 1, i + 1) + radius/norm2(y(2:))
      end do
      if (y(1) > 0.0_wp) derivative(2:, 1) = slope*t
    end if
    call through_prediction(rho, derivative, dz_dr, dz_dx)
  end subroutine pseudopotential_residual

  !> The same of a point that supports drive along one tangent, or both, by a known slip: what is
  !> driven has no row, and friction along the other follows (3.9).
  pure subroutine residual_beside_driven(point, driven, r, x, z, dz_dr, dz_dx)
    type(local_point_t), intent(in) :: point
    real(wp), intent(in)  :: driven(2)   !! slip of what is driven, else 0 [length]
    real(wp), intent(in)  :: r(3)        !! reaction, 0 along what is driven [force]
    real(wp), intent(in)  :: x(3)        !! gap and slip increment, 0 along what is driven [length]
    real(wp), intent(out) :: z(3)        !! 0 along what is driven [force]
    real(wp), intent(out) :: dz_dr(3, 3) !! [-]
    real(wp), intent(out) :: dz_dx(3, 3) !! [force/length]
    real(wp) :: y(3), p, rho(3), radius, slope, derivative(3, 3), dp_dradius
    integer :: a

    rho = [point%rho_n, point%rho_t, point%rho_t]
    y = r - rho*x
    z = 0.0_wp
    z(1) = r(1) - project_normal(point%stays, y(1))
    derivative = 0.0_wp
    if (point%stays .or. y(1) > 0.0_wp) derivative(1, 1) = 1.0_wp
    a = findloc(abs(driven) > 0.0_wp, .false., dim=1) + 1
    if (a > 1) then
      call find_radius(point, y(1), radius, slope)
      call project_beside_driven(radius, point%rho_t*norm2(driven), y(a), p, derivative(a, a), &
        dp_dradius)
      z(a) = r(a) - p
      if (y(1) > 0.0_wp) derivative(a, 1) = slope*dp_dradius
    end if
    call through_prediction(rho, derivative, dz_dr, dz_dx)
  end subroutine residual_beside_driven

  !> Z = r - p(r - rho x): from the derivative of p to those of Z.
  pure subroutine through_prediction(rho, derivative, dz_dr, dz_dx)
    real(wp), intent(in)  :: rho(3)           !! [force/length]
    real(wp), intent(in)  :: derivative(3, 3) !! [-]
    real(wp), intent(out) :: dz_dr(3, 3)      !! [-]
    real(wp), intent(out) :: dz_dx(3, 3)      !! [force/length]
    integer :: i

    do i = 1, 3
      dz_dx(:, i) = rho(i)*derivative(:, i)
      dz_dr(:, i) = -derivative(:, i)
      dz_dr(i, i) = dz_dr(i, i) + 1.0_wp
    end do
  end subroutine through_prediction

end module pseudopotential_mod
