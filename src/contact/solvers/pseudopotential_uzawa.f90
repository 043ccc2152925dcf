!> Pseudo-potential, Uzawa: a predictor-corrector for the normal part, then one for the tangential
!> part.
module pseudopotential_uzawa_mod
  use kinds_mod, only: wp
  use law_mod, only: project_normal, project_on_disc
  use local_point_mod, only: local_point_t, find_radius
  implicit none
  private

  public :: solve_pseudopotential_uzawa

contains

  !> r_n <- max(0, r_n - rho_n x_n), of any sign where the point stays closed, then
  !> r_t <- P_D(r_t - rho_t x_t) with x_t evaluated again after r_n.
  !>
  !> [JFT07] eqs. (5) to (8) and (12), docs/theory.md (4.2).
  pure subroutine solve_pseudopotential_uzawa(point, r, iterations, converged)
    type(local_point_t), intent(in) :: point
    real(wp), intent(inout) :: r(3)       !! reaction [force]
    integer,  intent(out)   :: iterations !! 1
    logical,  intent(out)   :: converged  !! true: one visit is all it does
    real(wp) :: x_n, x_t(2), p(2), radius, slope
    logical :: inside

    x_n = dot_product(point%w(1, :), r) + point%x_loc(1)
    r(1) = project_normal(point%stays, r(1) - point%rho_n*x_n)
    x_t = matmul(point%w(2:, :), r) + point%x_loc(2:)
    call find_radius(point, r(1), radius, slope)
    call project_on_disc(radius, r(2:) - point%rho_t*x_t, p, inside)
    r(2:) = p
    iterations = 1
    converged = .true.
  end subroutine solve_pseudopotential_uzawa

end module pseudopotential_uzawa_mod
