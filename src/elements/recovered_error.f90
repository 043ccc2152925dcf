!> How far the stresses of a mesh are from smooth ones.
!>
!> Smooth stresses recovered at the nodes (patch_recovery) are closer to the truth than those of the
!> bricks; the difference stands for the error. docs/theory.md section 10.
module recovered_error_mod
  use kinds_mod, only: wp
  use mesh_mod, only: mesh_t
  use scene_mod, only: material_t
  use brick8_mod, only: lame_constants, stress_of, jacobian_determinants, volume_mean, xi_node, &
    eta_node, zeta_node, gauss
  use elements_mod, only: gauss_strain
  use expansion_mod, only: thermal_energy
  use patch_recovery_mod, only: recover_at_nodes
  implicit none
  private

  public :: estimate_mesh_error

contains

  !> The error of the stresses in the energy norm, squared: of each brick, and of the whole beside
  !> the energy of the stresses.
  !>
  !> Source: O.C. Zienkiewicz, J.Z. Zhu, Int. J. Numer. Methods Engrg. 33 (1992) 1331-1364.
  subroutine estimate_mesh_error(mesh, materials, u, of_bricks, relative, thermal)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: u(:, :)        !! (3,n_nodes) displacement [length]
    real(wp), allocatable, intent(out) :: of_bricks(:)
    !! (n_elements) int d : C^-1 : d, d the stresses less the smooth ones [energy]
    real(wp), intent(out) :: relative      !! their sum over int sigma : C^-1 : sigma [-]
    real(wp), intent(in), optional :: thermal(:)
    !! (n_elements) as of find_thermal_stress [force/length^2]
    real(wp), parameter :: rounding = 1.0e-20_wp !! of the energy of thermal stresses: none left
    real(wp), allocatable :: stress(:, :, :), means(:, :), smooth(:, :)
    real(wp) :: weight(16), lambda, shear, energy
    integer :: material, e, nodes(8)

    allocate (stress(6, 8, mesh%n_elements), means(6, mesh%n_elements), smooth(6, mesh%n_nodes))
    allocate (of_bricks(mesh%n_elements), source=0.0_wp)
    energy = 0.0_wp
    do material = 1, size(materials)
      call lame_constants(materials(material)%young, materials(material)%poisson, lambda, shear)
      do e = 1, mesh%n_elements
        if (mesh%material(e) /= material) cycle
        nodes = mesh%connectivity(:, e)
        stress(:, :, e) = stress_of(gauss_strain(mesh%element_kind(e), mesh%coordinates(:, nodes), &
          u(:, nodes), lambda, shear), lambda, shear)
        if (present(thermal)) stress(:3, :, e) = stress(:3, :, e) - thermal(e)
        means(:, e) = volume_mean(mesh%coordinates(:, nodes), stress(:, :, e))
      end do
      call recover_at_nodes(mesh, material, means, smooth)
      do e = 1, mesh%n_elements
        if (mesh%material(e) /= material) cycle
        nodes = mesh%connectivity(:, e)
        weight = jacobian_determinants(mesh%coordinates(:, nodes))
        energy = energy + energy_of(stress(:, :, e), weight(:8), lambda, shear)
        of_bricks(e) = energy_of(interpolate(smooth(:, nodes)) - stress(:, :, e), weight(:8), &
          lambda, shear)
      end do
    end do
    relative = 0.0_wp
    if (present(thermal)) then
      if (energy <= rounding*thermal_energy(mesh, materials, thermal)) return
    end if
    if (energy > 0.0_wp) relative = sum(of_bricks)/energy
  end subroutine estimate_mesh_error

  !> Nodal values where the Gauss points are.
  pure function interpolate(at_nodes) result(values)
    real(wp), intent(in) :: at_nodes(6, 8)
    real(wp) :: values(6, 8)
    real(wp) :: factor(8)
    integer :: g

    do g = 1, 8
      factor = 0.125_wp*(1.0_wp + gauss*xi_node(g)*xi_node)*(1.0_wp + gauss*eta_node(g)*eta_node)* &
        (1.0_wp + gauss*zeta_node(g)*zeta_node)
      values(:, g) = matmul(at_nodes, factor)
    end do
  end function interpolate

  !> int s : C^-1 : s over a brick.
  pure function energy_of(s, weight, lambda, shear) result(energy)
    real(wp), intent(in) :: s(6, 8)          !! stresses at the Gauss points [force/length^2]
    real(wp), intent(in) :: weight(8)        !! volumes these stand for [length^3]
    real(wp), intent(in) :: lambda, shear    !! Lame's constants [force/length^2]
    real(wp) :: energy                       !! [energy]
    integer :: g

    energy = 0.0_wp
    do g = 1, 8
      energy = energy + weight(g)*(sum(s(:3, g)**2) + 2.0_wp*sum(s(4:, g)**2) - &
        lambda/(3.0_wp*lambda + 2.0_wp*shear)*sum(s(:3, g))**2)
    end do
    energy = energy/(2.0_wp*shear)
  end function energy_of

end module recovered_error_mod
