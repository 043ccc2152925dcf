!> An iterate of Newton's method on all contact points at once: the residual of the pseudo-potential
!> and its derivatives at every point. docs/theory.md section 4.
module newton_iterate_mod
  use kinds_mod, only: wp
  use problem_mod, only: contact_problem_t, relative_gaps, pack_rows, unpack_rows
  use local_point_mod, only: local_point_t
  use pseudopotential_mod, only: pseudopotential_residual, residual_beside_driven
  implicit none
  private

  public :: iterate_t, start_at, evaluate, residual_at, forcing_term

  !> An iterate: reactions, gaps, residual and its derivative at every point.
  type :: iterate_t
    real(wp), allocatable :: r(:), x(:)            !! (n_rows) [force], [length]
    real(wp), allocatable :: z(:)                  !! (n_rows) [force]
    real(wp), allocatable :: dz_dr(:, :, :)        !! (3,3,n_points) [-]
    real(wp), allocatable :: dz_dx(:, :, :)        !! (3,3,n_points) [force/length]
    real(wp) :: merit = 0.0_wp                     !! |Z|
  end type iterate_t

contains

  !> The iterate at given reactions.
  type(iterate_t) function start_at(problem, x_free, r) result(at)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: x_free(:), r(:, :)

    allocate (at%r(problem%n_rows), at%x(problem%n_rows), at%z(problem%n_rows))
    allocate (at%dz_dr(3, 3, problem%n_points), at%dz_dx(3, 3, problem%n_points))
    at%r = pack_rows(problem, r)
    at%x = relative_gaps(problem, x_free, at%r)
    call evaluate(problem, at)
  end function start_at

  !> The residual Z at any reactions.
  function residual_at(problem, x_free, r) result(z)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: x_free(:)           !! (n_rows) [length]
    real(wp), intent(in) :: r(:, :)             !! (3,n_points) [force]
    real(wp) :: z(problem%n_rows)               !! [force]
    type(iterate_t) :: at

    at = start_at(problem, x_free, r)
    z = at%z
  end function residual_at

  !> Residual of the pseudo-potential at every point, and its derivatives.
  subroutine evaluate(problem, at)
    type(contact_problem_t), intent(in) :: problem
    type(iterate_t), intent(inout) :: at
    real(wp), dimension(3, problem%n_points) :: r, x, z
    type(local_point_t) :: point
    integer :: i

    r = unpack_rows(problem, at%r)
    x = unpack_rows(problem, at%x)
    do i = 1, problem%n_points
      point%mu = problem%mu(i)
      if (allocated(problem%law)) point%law = problem%law(i)
      point%stays = problem%stays(i)
      point%rho_n = problem%rho_global(1, i)
      point%rho_t = problem%rho_global(2, i)
      if (any(abs(problem%driven(:, i)) > 0.0_wp)) then
        call residual_beside_driven(point, problem%driven(:, i), r(:, i), x(:, i), z(:, i), &
          at%dz_dr(:, :, i), at%dz_dx(:, :, i))
      else
        call pseudopotential_residual(point, r(:, i), x(:, i), z(:, i), at%dz_dr(:, :, i), &
          at%dz_dx(:, :, i))
      end if
    end do
    at%z = pack_rows(problem, z)
    at%merit = norm2(at%z)
  end subroutine evaluate

  !> How exactly the next linear system has to be solved: as Newton's method has converged lately
  !> (Eisenstat and Walker, their second choice), no tighter than the tolerance needs.
  pure real(wp) function forcing_term(merit, last_merit, left, tightest, loosest)
    real(wp), intent(in) :: merit, last_merit !! |Z| now and an iteration before, 0 at first [force]
    real(wp), intent(in) :: left              !! tolerance over residual [-]
    real(wp), intent(in) :: tightest, loosest !! what it may be [-]
    real(wp), parameter :: fraction = 0.9_wp

    forcing_term = loosest
    if (last_merit > 0.0_wp) forcing_term = fraction*min(1.0_wp, merit/last_merit)**2
    forcing_term = min(loosest, max(tightest, forcing_term, 0.3_wp*left))
  end function forcing_term

end module newton_iterate_mod
