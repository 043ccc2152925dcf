!> Linear elasticity: what every law is at small strain.
!>
!>     sigma = C : (eps - g I),                                 g the free strain of warmth
!>     sigma = lambda tr(eps - g I) I + 2 G (eps - g I)         where it is isotropic
!>
!> Stresses and strains are ordered XX YY ZZ XY YZ XZ; shear strains are tensor components (half of
!> the engineering ones). docs/theory.md, section 8.
module elasticity_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: solve_small
  implicit none
  private

  public :: elasticity_t, elasticity_of, anisotropic_elasticity, turned, matrix_of
  public :: stress_of, thermal_stress_of, complementary_energy
  public :: young_modulus, bulk_modulus, constrained_modulus, plane_strain_modulus

  type :: elasticity_t
    real(wp) :: lambda = 0.0_wp !! Lame's first constant [force/length^2]
    real(wp) :: shear = 0.0_wp  !! shear modulus G > 0 [force/length^2]
    logical :: is_isotropic = .true.
    !! else these two are those of the isotropic law that is closest, and C is
    real(wp) :: c(6, 6) = 0.0_wp
    !! of stresses by engineering strains, symmetric, positive definite [force/length^2]
  end type elasticity_t

  integer, parameter :: row(6) = [1, 2, 3, 1, 2, 1], column(6) = [1, 2, 3, 2, 3, 3]

contains

  !> Elasticity of Young's modulus and Poisson's ratio.
  pure elemental type(elasticity_t) function elasticity_of(young, poisson) result(elastic)
    real(wp), intent(in) :: young    !! E > 0 [force/length^2]
    real(wp), intent(in) :: poisson  !! -1 < nu < 0.5 [-]

    elastic%lambda = young*poisson/((1.0_wp + poisson)*(1.0_wp - 2.0_wp*poisson))
    elastic%shear = young/(2.0_wp*(1.0_wp + poisson))
  end function elasticity_of

  !> Elasticity of a matrix. Its two isotropic constants are Voigt's means over all directions.
  pure type(elasticity_t) function anisotropic_elasticity(c) result(elastic)
    real(wp), intent(in) :: c(6, 6) !! as of elasticity_t [force/length^2]
    real(wp) :: bulk, trace

    elastic%is_isotropic = .false.
    elastic%c = c
    bulk = sum(c(:3, :3))/9.0_wp
    trace = c(1, 1) + c(2, 2) + c(3, 3) + 2.0_wp*(c(4, 4) + c(5, 5) + c(6, 6)) ! C_ijij
    elastic%shear = (trace - 3.0_wp*bulk)/10.0_wp
    elastic%lambda = bulk - 2.0_wp*elastic%shear/3.0_wp
  end function anisotropic_elasticity

  !> The elasticity of a material whose axes are turned. docs/theory.md (8.50).
  pure type(elasticity_t) function turned(elastic, axes)
    type(elasticity_t), intent(in) :: elastic !! along the axes
    real(wp), intent(in) :: axes(3, 3)        !! columns: the material's axes along x, y, z [-]
    real(wp) :: k(6, 6)
    integer :: i, j

    turned = elastic
    if (elastic%is_isotropic) return
    ! Column j: the stress along x, y, z of the unit stress j along the axes.
    do j = 1, 6
      do i = 1, 6
        k(i, j) = axes(row(i), row(j))*axes(column(i), column(j))
        if (j > 3) k(i, j) = k(i, j) + axes(row(i), column(j))*axes(column(i), row(j))
      end do
    end do
    turned%c = matmul(k, matmul(elastic%c, transpose(k)))
  end function turned

  !> The matrix of stresses by engineering strains.
  pure function matrix_of(elastic) result(c)
    type(elasticity_t), intent(in) :: elastic
    real(wp) :: c(6, 6) !! [force/length^2]
    integer :: i

    c = elastic%c
    if (.not. elastic%is_isotropic) return
    c(:3, :3) = elastic%lambda
    do i = 1, 3
      c(i, i) = c(i, i) + 2.0_wp*elastic%shear
      c(3 + i, 3 + i) = elastic%shear
    end do
  end function matrix_of

  !> Stress of strains at several points, less that which takes back a free strain.
  pure function stress_of(strain, elastic, free) result(stress)
    real(wp), intent(in) :: strain(:, :)               !! (6,points) [-]
    type(elasticity_t), intent(in) :: elastic(:)       !! one, or one a point
    real(wp), intent(in), optional :: free             !! g; 0 where left out [-]
    real(wp) :: stress(size(strain, 1), size(strain, 2)) !! [force/length^2]
    integer :: g

    do g = 1, size(strain, 2)
      associate (of => elastic(min(g, size(elastic))))
        if (of%is_isotropic) then
          stress(:, g) = 2.0_wp*of%shear*strain(:, g)
          stress(:3, g) = stress(:3, g) + of%lambda*(strain(1, g) + strain(2, g) + strain(3, g))
        else
          stress(:, g) = matmul(of%c(:, :3), strain(:3, g)) + &
            2.0_wp*matmul(of%c(:, 4:), strain(4:, g))
        end if
        if (present(free)) stress(:, g) = stress(:, g) - thermal_stress_of(free, of)
      end associate
    end do
  end function stress_of

  !> The stress that takes back a free strain, C : I g; (3 lambda + 2 G) g I where isotropic.
  pure function thermal_stress_of(free, elastic) result(stress)
    real(wp), intent(in) :: free  !! g [-]
    type(elasticity_t), intent(in) :: elastic
    real(wp) :: stress(6)         !! [force/length^2]

    stress = 0.0_wp
    if (elastic%is_isotropic) then
      stress(:3) = (3.0_wp*elastic%lambda + 2.0_wp*elastic%shear)*free
    else
      stress = sum(elastic%c(:, :3), dim=2)*free
    end if
  end function thermal_stress_of

  !> E = 9 K G/(3 K + G), of the closest isotropic law where it is not isotropic.
  pure elemental real(wp) function young_modulus(elastic)
    type(elasticity_t), intent(in) :: elastic

    associate (bulk => bulk_modulus(elastic))
      young_modulus = 9.0_wp*bulk*elastic%shear/(3.0_wp*bulk + elastic%shear)
    end associate
  end function young_modulus

  !> K = lambda + 2 G/3, likewise.
  pure elemental real(wp) function bulk_modulus(elastic)
    type(elasticity_t), intent(in) :: elastic

    bulk_modulus = elastic%lambda + 2.0_wp*elastic%shear/3.0_wp
  end function bulk_modulus

  !> Twice the energy of stresses, sigma : C^-1 : sigma, summed over points.
  pure function complementary_energy(stress, weight, elastic) result(energy)
    real(wp), intent(in) :: stress(:, :)  !! (6,points) [force/length^2]
    real(wp), intent(in) :: weight(:)     !! volumes the points stand for [length^3]
    type(elasticity_t), intent(in) :: elastic(:) !! one, or one a point
    real(wp) :: energy                    !! [energy]
    real(wp) :: strain(6)
    logical :: is_regular
    integer :: g

    energy = 0.0_wp
    if (.not. elastic(1)%is_isotropic) then
      do g = 1, size(weight)
        call solve_small(elastic(min(g, size(elastic)))%c, stress(:, g), strain, is_regular)
        energy = energy + weight(g)*dot_product(stress(:, g), strain)
      end do
      return
    end if
    do g = 1, size(weight)
      energy = energy + weight(g)*(sum(stress(:3, g)**2) + 2.0_wp*sum(stress(4:, g)**2) - &
        elastic(1)%lambda/(3.0_wp*elastic(1)%lambda + 2.0_wp*elastic(1)%shear)* &
        sum(stress(:3, g))**2)
    end do
    energy = energy/(2.0_wp*elastic(1)%shear)
  end function complementary_energy

  !> The modulus that sizes of stiffness and rounding are measured by: |lambda| + 2 G; the largest
  !> of C's diagonal, which no other number of it exceeds.
  pure elemental real(wp) function constrained_modulus(elastic)
    type(elasticity_t), intent(in) :: elastic
    integer :: i

    constrained_modulus = abs(elastic%lambda) + 2.0_wp*elastic%shear
    if (elastic%is_isotropic) return
    constrained_modulus = 0.0_wp
    do i = 1, 6
      constrained_modulus = max(constrained_modulus, elastic%c(i, i))
    end do
  end function constrained_modulus

  !> E/(1 - nu^2), by which surfaces resist being pressed in: 4 G (lambda + G)/(lambda + 2 G); of
  !> the closest isotropic law where it is not isotropic.
  pure elemental real(wp) function plane_strain_modulus(elastic)
    type(elasticity_t), intent(in) :: elastic

    plane_strain_modulus = 4.0_wp*elastic%shear*(elastic%lambda + elastic%shear)/ &
      (elastic%lambda + 2.0_wp*elastic%shear)
  end function plane_strain_modulus

end module elasticity_mod
