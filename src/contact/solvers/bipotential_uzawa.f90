!> Bi-potential, Uzawa: one predictor and one corrector a visit.
module bipotential_uzawa_mod
  use kinds_mod, only: wp
  use law_mod, only: project_prediction
  use local_point_mod, only: local_point_t, find_coefficient
  implicit none
  private

  public :: solve_bipotential_uzawa

contains

  !> r <- P_K(r - rho x*(r)). [JFT07] eq. (12), docs/theory.md (4.1).
  pure subroutine solve_bipotential_uzawa(point, r, iterations, converged)
    type(local_point_t), intent(in) :: point
    real(wp), intent(inout) :: r(3)       !! reaction [force]
    integer,  intent(out)   :: iterations !! 1
    logical,  intent(out)   :: converged  !! true: one visit is all it does
    real(wp) :: x(3), p(3), mu, change
    integer :: status

    x = matmul(point%w, r) + point%x_loc
    call find_coefficient(point, r(1), mu, change)
    call project_prediction(mu, point%stays, point%rho, r, x, p, status)
    r = p
    iterations = 1
    converged = .true.
  end subroutine solve_bipotential_uzawa

end module bipotential_uzawa_mod
