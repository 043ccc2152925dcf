!> How far the stresses of a mesh are from smooth ones.
!>
!> Smooth stresses recovered at the nodes (patch_recovery) are closer to the truth than those of the
!> elements; the difference stands for the error. At finite strain these are the stresses that work
!> on the logarithmic strain, which do not turn with the body. docs/theory.md section 10.
module recovered_error_mod
  use kinds_mod, only: wp
  use cells_mod, only: cells, has_middles
  use connectivity_mod, only: nodes_of_element, nodes_of_hexahedron
  use mesh_mod, only: mesh_t
  use scene_mod, only: material_t
  use elasticity_mod, only: stress_of, thermal_stress_of, complementary_energy
  use material_law_mod, only: law_t, finite_energy
  use logarithmic_stress_mod, only: energy_of_change
  use hexahedron8_mod, only: jacobian_determinants, volume_mean, xi_node, eta_node, zeta_node, gauss
  use elements_mod, only: gauss_strain
  use finite_forces_mod, only: logarithmic_stresses
  use expansion_mod, only: thermal_energy
  use patch_recovery_mod, only: recover_at_nodes
  use cell_shapes_mod, only: shape_functions
  use second_order_mod, only: second_order_t, second_order, strain_of
  implicit none
  private

  public :: estimate_mesh_error

contains

  !> The error of the stresses in the energy norm, squared: of each element, and of the whole beside
  !> the energy of the stresses; at finite strain to second order, beside twice the strain energy.
  !>
  !> Source: O.C. Zienkiewicz, J.Z. Zhu, Int. J. Numer. Methods Engrg. 33 (1992) 1331-1364.
  !> docs/theory.md (10.1), (10.25).
  subroutine estimate_mesh_error(mesh, materials, u, free, is_finite, of_elements, relative)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: u(:, :)        !! (3,n_nodes) displacement [length]
    real(wp), intent(in) :: free(:)        !! (n_elements) as of find_free_strain [-]
    logical, intent(in) :: is_finite       !! strain, of hexahedra: then det F > 0
    real(wp), allocatable, intent(out) :: of_elements(:)
    !! (n_elements) int d : C^-1 : d, d the stresses less the smooth ones [energy]
    real(wp), intent(out) :: relative      !! their sum over int sigma : C^-1 : sigma [-]
    real(wp), parameter :: rounding = 1.0e-20_wp !! of the energy of thermal stresses: none left
    real(wp), allocatable :: stress(:, :, :), means(:, :), smooth(:, :), gradient(:, :, :, :)
    type(second_order_t) :: element
    real(wp) :: weight(16), energy
    integer :: material, e, nodes(8), n

    n = max(8, maxval(cells(mesh%connectivity%cell(:mesh%n_elements))%n_points))
    allocate (stress(6, n, mesh%n_elements), means(6, mesh%n_elements), smooth(6, mesh%n_nodes))
    allocate (gradient(3, 3, 8, merge(mesh%n_elements, 0, is_finite)))
    allocate (of_elements(mesh%n_elements), source=0.0_wp)
    energy = 0.0_wp
    do material = 1, size(materials)
      associate (law => materials(material)%law)
        do e = 1, mesh%n_elements
          if (mesh%material(e) /= material) cycle
          if (has_middles(mesh%connectivity%cell(e))) then
            call make_element(e)
            associate (all_nodes => nodes_of_element(mesh%connectivity, e), &
                       w => element%weight(:element%n_points))
              stress(:, :size(w), e) = stress_of(strain_of(element, u(:, all_nodes)), &
                law%elastic)
              stress(:3, :size(w), e) = stress(:3, :size(w), e) - thermal_stress_of(free(e), &
                law%elastic)
              means(:, e) = matmul(stress(:, :size(w), e), w)/sum(w)
            end associate
            cycle
          end if
          nodes = nodes_of_hexahedron(mesh%connectivity, e)
          if (is_finite) then
            call logarithmic_stresses(mesh, materials, free(e), u, e, gradient(:, :, :, e), &
              stress(:, :8, e))
          else
            stress(:, :8, e) = stress_of(gauss_strain(mesh%element_kind(e), &
              mesh%coordinates(:, nodes), u(:, nodes), law%elastic), law%elastic)
            stress(:3, :8, e) = stress(:3, :8, e) - thermal_stress_of(free(e), law%elastic)
          end if
          means(:, e) = volume_mean(mesh%coordinates(:, nodes), stress(:, :8, e))
        end do
        call recover_at_nodes(mesh, material, means, smooth)
        do e = 1, mesh%n_elements
          if (mesh%material(e) /= material) cycle
          if (has_middles(mesh%connectivity%cell(e))) then
            call make_element(e)
            associate (w => element%weight(:element%n_points), smoothed => interpolate_in( &
                       element%cell, smooth(:, nodes_of_element(mesh%connectivity, e))))
              energy = energy + complementary_energy(stress(:, :size(w), e), w, law%elastic)
              of_elements(e) = complementary_energy(smoothed - stress(:, :size(w), e), w, &
                law%elastic)
            end associate
            cycle
          end if
          nodes = nodes_of_hexahedron(mesh%connectivity, e)
          weight = jacobian_determinants(mesh%coordinates(:, nodes))
          if (is_finite) then
            weight = (1.0_wp + free(e))**3*weight
            call add_finite_energies(law, gradient(:, :, :, e), weight(:8), &
              interpolate(smooth(:, nodes)) - stress(:, :8, e), energy, of_elements(e))
          else
            energy = energy + complementary_energy(stress(:, :8, e), weight(:8), law%elastic)
            of_elements(e) = complementary_energy(interpolate(smooth(:, nodes)) - &
              stress(:, :8, e), weight(:8), law%elastic)
          end if
        end do
      end associate
    end do
    relative = 0.0_wp
    if (energy > rounding*thermal_energy(mesh, materials, free)) relative = sum(of_elements)/energy

  contains

    subroutine make_element(e)
      integer, intent(in) :: e

      call second_order(mesh%connectivity%cell(e), mesh%coordinates(:, nodes_of_element( &
        mesh%connectivity, e)), element)
    end subroutine make_element

  end subroutine estimate_mesh_error

  !> Nodal values at the points of an element of second order.
  pure function interpolate_in(cell, at_nodes) result(values)
    integer,  intent(in) :: cell           !! row of the table of cells
    real(wp), intent(in) :: at_nodes(:, :) !! (6,n_nodes)
    real(wp) :: values(6, cells(cell)%n_points)
    integer :: g

    do g = 1, cells(cell)%n_points
      values(:, g) = matmul(at_nodes, shape_functions(cells(cell), cells(cell)%point(:, g)))
    end do
  end function interpolate_in

  !> Twice the strain energy of an element, and the energy of what its stresses change by.
  subroutine add_finite_energies(law, h, weight, change, energy, of_change)
    type(law_t), intent(in) :: law
    real(wp), intent(in) :: h(3, 3, 8)   !! at the Gauss points, det(I + H) > 0 [-]
    real(wp), intent(in) :: weight(8)    !! [length^3]
    real(wp), intent(in) :: change(6, 8) !! XX YY ZZ XY YZ XZ [force/length^2]
    real(wp), intent(inout) :: energy    !! takes the element's [energy]
    real(wp), intent(out) :: of_change   !! [energy]
    integer :: g

    of_change = 0.0_wp
    do g = 1, 8
      energy = energy + 2.0_wp*weight(g)*finite_energy(law, h(:, :, g))
      of_change = of_change + weight(g)*energy_of_change(law, h(:, :, g), &
        reshape(change([1, 4, 6, 4, 2, 5, 6, 5, 3], g), [3, 3]))
    end do
  end subroutine add_finite_energies

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

end module recovered_error_mod
