!> Isotropic linear elasticity: what every law is at small strain.
!>
!>     sigma = lambda tr(eps - g I) I + 2 G (eps - g I),        g the free strain of warmth
!>
!> Stresses and strains are ordered XX YY ZZ XY YZ XZ; shear strains are tensor components (half of
!> the engineering ones). docs/theory.md, section 8.
module elasticity_mod
  use kinds_mod, only: wp
  implicit none
  private

  public :: elasticity_t, elasticity_of, stress_of, thermal_stress_of, complementary_energy
  public :: young_modulus, bulk_modulus, constrained_modulus, plane_strain_modulus

  type :: elasticity_t
    real(wp) :: lambda = 0.0_wp !! Lame's first constant [force/length^2]
    real(wp) :: shear = 0.0_wp  !! shear modulus G > 0 [force/length^2]
  end type elasticity_t

contains

  !> Elasticity of Young's modulus and Poisson's ratio.
  pure elemental type(elasticity_t) function elasticity_of(young, poisson) result(elastic)
    real(wp), intent(in) :: young    !! E > 0 [force/length^2]
    real(wp), intent(in) :: poisson  !! -1 < nu < 0.5 [-]

    elastic%lambda = young*poisson/((1.0_wp + poisson)*(1.0_wp - 2.0_wp*poisson))
    elastic%shear = young/(2.0_wp*(1.0_wp + poisson))
  end function elasticity_of

  !> Stress of strains at several points, without thermal expansion.
  pure function stress_of(strain, elastic) result(stress)
    real(wp), intent(in) :: strain(:, :)               !! (6,points) [-]
    type(elasticity_t), intent(in) :: elastic
    real(wp) :: stress(size(strain, 1), size(strain, 2)) !! [force/length^2]
    integer :: g

    do g = 1, size(strain, 2)
      stress(:, g) = 2.0_wp*elastic%shear*strain(:, g)
      stress(:3, g) = stress(:3, g) + elastic%lambda*(strain(1, g) + strain(2, g) + strain(3, g))
    end do
  end function stress_of

  !> The pressure that takes back a free strain, (3 lambda + 2 G) g.
  pure elemental real(wp) function thermal_stress_of(free, elastic) result(stress)
    real(wp), intent(in) :: free  !! g [-]
    type(elasticity_t), intent(in) :: elastic

    stress = (3.0_wp*elastic%lambda + 2.0_wp*elastic%shear)*free
  end function thermal_stress_of

  !> E = 9 K G/(3 K + G).
  pure elemental real(wp) function young_modulus(elastic)
    type(elasticity_t), intent(in) :: elastic

    associate (bulk => bulk_modulus(elastic))
      young_modulus = 9.0_wp*bulk*elastic%shear/(3.0_wp*bulk + elastic%shear)
    end associate
  end function young_modulus

  !> K = lambda + 2 G/3.
  pure elemental real(wp) function bulk_modulus(elastic)
    type(elasticity_t), intent(in) :: elastic

    bulk_modulus = elastic%lambda + 2.0_wp*elastic%shear/3.0_wp
  end function bulk_modulus

  !> Twice the energy of stresses, sigma : C^-1 : sigma, summed over points.
  pure function complementary_energy(stress, weight, elastic) result(energy)
    real(wp), intent(in) :: stress(:, :)  !! (6,points) [force/length^2]
    real(wp), intent(in) :: weight(:)     !! volumes the points stand for [length^3]
    type(elasticity_t), intent(in) :: elastic
    real(wp) :: energy                    !! [energy]
    integer :: g

    energy = 0.0_wp
    do g = 1, size(weight)
      energy = energy + weight(g)*(sum(stress(:3, g)**2) + 2.0_wp*sum(stress(4:, g)**2) - &
        elastic%lambda/(3.0_wp*elastic%lambda + 2.0_wp*elastic%shear)*sum(stress(:3, g))**2)
    end do
    energy = energy/(2.0_wp*elastic%shear)
  end function complementary_energy

  !> The modulus that sizes of stiffness and rounding are measured by: |lambda| + 2 G.
  pure elemental real(wp) function constrained_modulus(elastic)
    type(elasticity_t), intent(in) :: elastic

    constrained_modulus = abs(elastic%lambda) + 2.0_wp*elastic%shear
  end function constrained_modulus

  !> E/(1 - nu^2), by which surfaces resist being pressed in: 4 G (lambda + G)/(lambda + 2 G).
  pure elemental real(wp) function plane_strain_modulus(elastic)
    type(elasticity_t), intent(in) :: elastic

    plane_strain_modulus = 4.0_wp*elastic%shear*(elastic%lambda + elastic%shear)/ &
      (elastic%lambda + 2.0_wp*elastic%shear)
  end function plane_strain_modulus

end module elasticity_mod
