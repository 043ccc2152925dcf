!> The certificate of a contact problem that stands alone: how true (r, u) is.
!>
!> As the certificate of a step, it shares nothing with the solvers: no compliance, no projection.
!> docs/theory.md section 6.
module certify_problem_mod
  use kinds_mod, only: wp
  use step_report_mod, only: certificate_t, worst_entry
  implicit none
  private

  public :: certify_problem

contains

  !> Judge reactions and the gaps and slips that belong to them.
  !>
  !> Scales: F the largest reaction, U the largest of |u| and of |q|, u without reactions (all may
  !> stick: then |u| is rounding). 0/0 = 0. There is no body, and so no entry `equilibrium` but what
  !> the caller has measured.
  pure function certify_problem(mu, r, u, q, imbalance, tolerance) result(certificate)
    real(wp), intent(in) :: mu(:)    !! (n_points) [-]
    real(wp), intent(in) :: r(:, :)  !! (3,n_points) n, t1, t2 [force]
    real(wp), intent(in) :: u(:, :)  !! (3,n_points) [length]
    real(wp), intent(in) :: q(:, :)  !! (3,n_points) [length]
    real(wp), intent(in) :: imbalance !! of a global problem, relative to its forces [-]
    real(wp), intent(in) :: tolerance !! contact tolerance [-]
    type(certificate_t) :: certificate
    real(wp) :: force, length, defect, total
    integer :: i

    force = 0.0_wp
    length = 0.0_wp
    defect = 0.0_wp
    total = 0.0_wp
    do i = 1, size(mu)
      force = max(force, norm2(r(:, i)))
      length = max(length, norm2(u(:, i)), norm2(q(:, i)))
      certificate%penetration = max(certificate%penetration, -u(1, i))
      certificate%adhesion = max(certificate%adhesion, -r(1, i))
      certificate%complementarity = max(certificate%complementarity, abs(u(1, i)*r(1, i)))
      certificate%cone = max(certificate%cone, norm2(r(2:, i)) - mu(i)*r(1, i))
      defect = defect + abs(mu(i)*r(1, i)*norm2(u(2:, i)) + dot_product(u(:, i), r(:, i)))
      total = total + norm2(r(:, i))
    end do
    certificate%penetration = ratio(certificate%penetration, length)
    certificate%adhesion = ratio(certificate%adhesion, force)
    certificate%complementarity = ratio(ratio(certificate%complementarity, force), length)
    certificate%cone = ratio(certificate%cone, force)
    certificate%law = ratio(ratio(defect, total), length)
    certificate%equilibrium = imbalance
    certificate%certified = worst_entry(certificate) <= 10.0_wp*tolerance
  end function certify_problem

  !> a/b with 0/0 = 0; something over nothing is infinitely wrong.
  pure function ratio(a, b) result(quotient)
    real(wp), intent(in) :: a, b !! a >= 0, b >= 0
    real(wp) :: quotient

    if (a <= 0.0_wp) then
      quotient = 0.0_wp
    else if (b > 0.0_wp .and. a < b*1.0e100_wp) then
      quotient = a/b
    else
      quotient = huge(1.0_wp)
    end if
  end function ratio

end module certify_problem_mod
