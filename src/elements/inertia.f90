!> What inertia makes of an increment of time: one of statics with more in its stiffness, and with
!> forces of inertia among its loads. docs/theory.md, section 13.
module inertia_mod
  use kinds_mod, only: wp
  use mesh_mod, only: mesh_t
  use mass_matrix_mod, only: mass_t, times_mass, diagonal_of
  use damping_mod, only: damping_t, damping_force
  implicit none
  private

  public :: inertia_t, in_motion_t, new_inertia, force_of_inertia, change_of_inertia, &
    rounding_of_inertia, mass_factors, earlier_part

  real(wp), parameter :: newest = 1.5_wp
  !! share of the last mean velocity in that of damping; the one before has the rest [-]

  !> The scheme of Hilber, Hughes and Taylor on increments of one length, divided by 1 + alpha: so
  !> stiffness, loads and reactions stand as they do in statics.
  type :: inertia_t
    type(mass_t) :: mass
    real(wp) :: alpha = 0.0_wp      !! -1/2 to 0 [-]
    real(wp) :: beta = 0.25_wp, gamma = 0.5_wp !! of Newmark's formulas [-]
    real(wp) :: dt = 1.0_wp         !! length of the increments [time]
    real(wp) :: factor = 0.0_wp     !! 1/((1 + alpha) beta dt^2): of M in the stiffness [1/time^2]
    real(wp) :: slope = 0.0_wp      !! velocity of damping by displacement: of C in it [1/time]
    type(damping_t) :: damping
  end type inertia_t

  !> What an increment of time has of its beginning, and of its supports.
  type :: in_motion_t
    real(wp), allocatable :: predictor(:, :)
    !! (3,n_nodes) where it would go without accelerations at its end [length]
    real(wp), allocatable :: left_over(:, :)
    !! (3,n_nodes) loads by forces of its beginning [force]
    real(wp), allocatable :: earlier(:, :)
    !! (3,n_nodes) what the velocities of damping are less than by its displacements [length/time]
    real(wp), allocatable :: speed(:, :) !! (3,n_nodes) of supports at its end [length/time]
    real(wp), allocatable :: force(:, :)
    !! (3,n_nodes) as of force_of_inertia, where it was asked for last [force]
  end type in_motion_t

contains

  !> The scheme of a mass.
  pure type(inertia_t) function new_inertia(mass, damping, alpha, dt) result(inertia)
    type(mass_t), intent(in) :: mass
    type(damping_t), intent(in) :: damping
    real(wp), intent(in) :: alpha, dt !! as of inertia_t

    inertia%mass = mass
    inertia%damping = damping
    inertia%alpha = alpha
    inertia%beta = 0.25_wp*(1.0_wp - alpha)**2
    inertia%gamma = 0.5_wp - alpha
    inertia%dt = dt
    inertia%factor = 1.0_wp/((1.0_wp + alpha)*inertia%beta*dt**2)
    inertia%slope = newest/dt
  end function new_inertia

  !> The forces of inertia and damping, less what is left of the beginning's, as a part of the
  !> internal force.
  pure function force_of_inertia(mesh, inertia, in_motion, u) result(f)
    type(mesh_t), intent(in) :: mesh
    type(inertia_t), intent(in) :: inertia
    type(in_motion_t), intent(in) :: in_motion
    real(wp), intent(in) :: u(:, :)         !! (3,n_nodes) [length]
    real(wp) :: f(3, size(u, 2))            !! [force]

    f = inertia%factor*times_mass(inertia%mass, u - in_motion%predictor) - in_motion%left_over + &
      damping_force(inertia%damping, mesh, inertia%mass, inertia%slope*u - in_motion%earlier)
  end function force_of_inertia

  !> What it changes by with displacements, where nothing is damped by its strains.
  pure function change_of_inertia(inertia, u) result(f)
    type(inertia_t), intent(in) :: inertia
    real(wp), intent(in) :: u(:, :)         !! (3,n_nodes) [length]
    real(wp) :: f(3, size(u, 2))            !! [force]

    f = spread(mass_factors(inertia), 1, 3)*times_mass(inertia%mass, u)
  end function change_of_inertia

  !> How well it is known, of places that are rounded.
  pure function rounding_of_inertia(inertia, u) result(rounding)
    type(inertia_t), intent(in) :: inertia
    real(wp), intent(in) :: u(:, :)         !! (3,n_nodes) [length]
    real(wp) :: rounding(size(u, 2))        !! [force]

    rounding = 8.0_wp*epsilon(1.0_wp)*inertia%factor*maxval(abs(u))*diagonal_of(inertia%mass)
  end function rounding_of_inertia

  !> What the mass of each node is multiplied by in the stiffness, with its part of the damping.
  pure function mass_factors(inertia) result(factor)
    type(inertia_t), intent(in) :: inertia
    real(wp) :: factor(size(inertia%mass%piece)) !! (n_nodes) [1/time^2]

    factor = inertia%factor
    if (allocated(inertia%damping%rate)) factor = factor + inertia%slope*inertia%damping%rate
  end function mass_factors

  !> The mean velocities that damping goes by, as a part that displacements at the end are taken
  !> from: it is `slope` times the displacement less this.
  pure function earlier_part(inertia, u, mean) result(part)
    type(inertia_t), intent(in) :: inertia
    real(wp), intent(in) :: u(:, :)    !! (3,n_nodes) as the increment begins [length]
    real(wp), intent(in) :: mean(:, :) !! (3,n_nodes) velocity of the one before [length/time]
    real(wp) :: part(3, size(u, 2))    !! [length/time]

    part = inertia%slope*u + (newest - 1.0_wp)*mean
  end function earlier_part

end module inertia_mod
