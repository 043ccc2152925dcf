!> The certificate of a contact problem without bodies (FCLIB): errors of reactions and gaps. Like
!> that of an increment it shares no code with the solvers. docs/theory.md section 6.
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
  !> Errors are relative to the largest reaction, and to the largest of |u| and |q|, q being u
  !> without reactions: where all points stick |u| is rounding.
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
