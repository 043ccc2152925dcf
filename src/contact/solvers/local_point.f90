!> One contact point with the others frozen: x = W_ii r + x_loc.
!>
!> Every local solver has the same arguments, so that the sweeps take any of them; every formulation
!> gives its residual in the same way, so that Newton takes either.
module local_point_mod
  use kinds_mod, only: wp
  use friction_laws_mod, only: friction_law_t, bound_friction, share_of_friction
  implicit none
  private

  public :: local_point_t, local_solver, zero_level, find_radius, find_coefficient

  real(wp), parameter :: local_tolerance = 1.0e-12_wp
  !! to which an iterated local solver solves its point [-]

  !> What a local solver is given.
  type :: local_point_t
    real(wp) :: mu = 0.0_wp     !! friction coefficient, the largest [-]
    type(friction_law_t) :: law !! what the normal reaction makes of it
    logical  :: stays = .false. !! closed: the normal reaction may pull
    real(wp) :: w(3, 3)         !! W_ii, symmetric positive definite [length/force]
    real(wp) :: x_loc(3)        !! x without this point's own reaction [length]
    real(wp) :: rho = 0.0_wp    !! of the bi-potential [force/length]
    real(wp) :: rho_n = 0.0_wp  !! of the pseudo-potential, normal [force/length]
    real(wp) :: rho_t = 0.0_wp  !! of the pseudo-potential, tangential [force/length]
    procedure(local_residual), pointer, nopass :: residual => null() !! of the formulation
  end type local_point_t

  abstract interface
    !> A formulation's residual Z(r, x) at a point, and its two derivatives.
    pure subroutine local_residual(point, r, x, z, dz_dr, dz_dx)
      import :: local_point_t, wp
      implicit none
      type(local_point_t), intent(in) :: point
      real(wp), intent(in)  :: r(3)        !! reaction [force]
      real(wp), intent(in)  :: x(3)        !! gap and slip increment [length]
      real(wp), intent(out) :: z(3)        !! r - projection: zero at the law [force]
      real(wp), intent(out) :: dz_dr(3, 3) !! [-]
      real(wp), intent(out) :: dz_dx(3, 3) !! [force/length]
    end subroutine local_residual
  end interface

  abstract interface
    !> Improve the reaction of one point.
    pure subroutine local_solver(point, r, iterations, converged)
      import :: local_point_t, wp
      implicit none
      type(local_point_t), intent(in) :: point
      real(wp), intent(inout) :: r(3)       !! reaction: a guess in, the new value out [force]
      integer,  intent(out)   :: iterations !! evaluations of the law
      logical,  intent(out)   :: converged
      !! when false r is the guess; always true for solvers that do one visit
    end subroutine local_solver
  end interface

contains

  !> The largest friction at a normal reaction, and its slope. docs/theory.md (3.12).
  pure subroutine find_radius(point, r_n, radius, slope)
    type(local_point_t), intent(in) :: point
    real(wp), intent(in)  :: r_n    !! normal reaction [force]
    real(wp), intent(out) :: radius !! [force]
    real(wp), intent(out) :: slope  !! [-]

    call bound_friction(point%law, r_n, radius, slope)
    radius = point%mu*radius
    slope = point%mu*slope
  end subroutine find_radius

  !> The coefficient that belongs to a normal reaction, and what it changes by. docs/theory.md
  !> (3.12).
  pure subroutine find_coefficient(point, r_n, mu, change)
    type(local_point_t), intent(in) :: point
    real(wp), intent(in)  :: r_n    !! normal reaction [force]
    real(wp), intent(out) :: mu     !! [-]
    real(wp), intent(out) :: change !! [1/force]

    call share_of_friction(point%law, r_n, mu, change)
    mu = point%mu*mu
    change = point%mu*change
  end subroutine find_coefficient

  !> The |Z| below which a point counts as solved.
  !>
  !> Measured by its reaction, or by the force that would close its gap; Z scales with rho where rho
  !> is small, and what is asked of it must, too.
  pure function zero_level(point, r) result(level)
    type(local_point_t), intent(in) :: point
    real(wp), intent(in) :: r(3) !! reaction [force]
    real(wp) :: level            !! [force]
    real(wp) :: mean_w, rho

    mean_w = (point%w(1, 1) + point%w(2, 2) + point%w(3, 3))/3.0_wp
    rho = min(point%rho, point%rho_n, point%rho_t)
    level = local_tolerance*min(1.0_wp, rho*mean_w)*max(norm2(r), norm2(point%x_loc)/mean_w)
  end function zero_level

end module local_point_mod
