!> How much of the strain energy of first-order hexahedra is that of bending without the modes that
!> bending needs.
module bending_stiffness_mod
  use kinds_mod, only: wp
  use cells_mod, only: hexahedron_8
  use connectivity_mod, only: nodes_of_hexahedron
  use mesh_mod, only: mesh_t, kind_c3d8, kind_c3d8i
  use scene_mod, only: material_t
  use elasticity_mod, only: elasticity_t, stress_of
  use element_laws_mod, only: elasticity_at
  use hexahedron8_mod, only: jacobian_determinants
  use elements_mod, only: gauss_strain
  implicit none
  private

  public :: parasitic_share

contains

  !> The part of the strain energy of all C3D8 (CPE4 and its kin) that C3D8I would not have with the
  !> same displacements: 1 - E_i/E, E_i the least energy over the incompatible modes. 0 where there
  !> is no such element or no energy. docs/theory.md section 8, "C3D8I".
  pure real(wp) function parasitic_share(mesh, materials, u) result(share)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: u(:, :) !! (3,n_nodes) displacement [length]
    real(wp) :: energy(2)           !! with and without the modes
    integer :: e, nodes(8)

    energy = 0.0_wp
    do e = 1, mesh%n_elements
      if (mesh%element_kind(e) /= kind_c3d8 .or. mesh%connectivity%cell(e) /= hexahedron_8) cycle
      nodes = nodes_of_hexahedron(mesh%connectivity, e)
      energy = energy + energies_of(elasticity_at(mesh, materials, e), mesh%coordinates(:, nodes), &
        u(:, nodes))
    end do
    share = 0.0_wp
    if (energy(2) > 0.0_wp) share = max(0.0_wp, 1.0_wp - energy(1)/energy(2))
  end function parasitic_share

  !> Strain energy of a hexahedron with incompatible modes, and without.
  pure function energies_of(elastic, x, u) result(energy)
    type(elasticity_t), intent(in) :: elastic(:) !! one, or one a point
    real(wp), intent(in) :: x(3, 8), u(3, 8) !! nodes and their displacements [length]
    real(wp) :: energy(2)
    integer, parameter :: kinds(2) = [kind_c3d8i, kind_c3d8]
    real(wp) :: strain(6, 8), stress(6, 8), weight(16)
    integer :: i

    weight = jacobian_determinants(x)
    do i = 1, 2
      strain = gauss_strain(kinds(i), x, u, elastic)
      stress = stress_of(strain, elastic)
      energy(i) = 0.5_wp*dot_product(weight(:8), sum(stress(:3, :)*strain(:3, :), dim=1) + &
        2.0_wp*sum(stress(4:, :)*strain(4:, :), dim=1))
    end do
  end function energies_of

end module bending_stiffness_mod
