!> What inertia makes of an increment of time: one of statics with more in its stiffness, and with
!> forces of inertia among its loads. docs/theory.md, section 13.
module inertia_mod
  use kinds_mod, only: wp
  use mass_matrix_mod, only: mass_t, times_mass
  implicit none
  private

  public :: inertia_t, new_inertia, inertial_force

  !> The scheme of Hilber, Hughes and Taylor on increments of one length, divided by 1 + alpha: so
  !> stiffness, loads and reactions stand as they do in statics.
  type :: inertia_t
    type(mass_t) :: mass
    real(wp) :: alpha = 0.0_wp      !! -1/2 to 0 [-]
    real(wp) :: beta = 0.25_wp, gamma = 0.5_wp !! of Newmark's formulas [-]
    real(wp) :: dt = 1.0_wp         !! length of the increments [time]
    real(wp) :: factor = 0.0_wp     !! 1/((1 + alpha) beta dt^2): of M in the stiffness [1/time^2]
  end type inertia_t

contains

  !> The scheme of a mass.
  pure type(inertia_t) function new_inertia(mass, alpha, dt) result(inertia)
    type(mass_t), intent(in) :: mass
    real(wp), intent(in) :: alpha, dt !! as of inertia_t

    inertia%mass = mass
    inertia%alpha = alpha
    inertia%beta = 0.25_wp*(1.0_wp - alpha)**2
    inertia%gamma = 0.5_wp - alpha
    inertia%dt = dt
    inertia%factor = 1.0_wp/((1.0_wp + alpha)*inertia%beta*dt**2)
  end function new_inertia

  !> The force of inertia of displacements that are not those of the predictor, as a part of the
  !> internal force.
  pure function inertial_force(inertia, u, predictor) result(f)
    type(inertia_t), intent(in) :: inertia
    real(wp), intent(in) :: u(:, :), predictor(:, :) !! (3,n_nodes) [length]
    real(wp) :: f(3, size(u, 2))                     !! [force]

    f = inertia%factor*times_mass(inertia%mass, u - predictor)
  end function inertial_force

end module inertia_mod
