!> The certificate of a contact problem that stands alone: how true (r, u) is.
!>
!> As the certificate of a step, it shares nothing with the solvers: no compliance, no projection.
!> docs/theory.md section 6.
module certify_problem_mod
  use kinds_mod, only: wp
  use increment_report_mod, only: certificate_t, worst_entry
  use certificate_mod, only: judge_contact
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
    real(wp) :: force, length
    integer :: i

    force = 0.0_wp
    length = 0.0_wp
    do i = 1, size(mu)
      force = max(force, norm2(r(:, i)))
      length = max(length, norm2(u(:, i)), norm2(q(:, i)))
    end do
    certificate = judge_contact(mu, r, u, spread(force, 1, size(mu)), spread(length, 1, size(mu)))
    certificate%equilibrium = imbalance
    certificate%certified = worst_entry(certificate) <= 10.0_wp*tolerance
  end function certify_problem

end module certify_problem_mod
