!> How far the stresses of a mesh are from smooth ones.
!>
!> Smooth stresses recovered at the nodes (patch_recovery) are closer to the truth than those of the
!> elements; the difference stands for the error. docs/theory.md section 10.
module recovered_error_mod
  use kinds_mod, only: wp
  use cells_mod, only: cells, has_middles
  use connectivity_mod, only: nodes_of_element, nodes_of_hexahedron
  use mesh_mod, only: mesh_t
  use scene_mod, only: material_t
  use elasticity_mod, only: stress_of, thermal_stress_of, complementary_energy
  use hexahedron8_mod, only: jacobian_determinants, volume_mean, xi_node, eta_node, zeta_node, gauss
  use elements_mod, only: gauss_strain
  use expansion_mod, only: thermal_energy
  use patch_recovery_mod, only: recover_at_nodes
  use cell_shapes_mod, only: shape_functions
  use second_order_mod, only: second_order_t, second_order, strain_of
  implicit none
  private

  public :: estimate_mesh_error

contains

  !> The error of the stresses in the energy norm, squared: of each element, and of the whole beside
  !> the energy of the stresses.
  !>
  !> Source: O.C. Zienkiewicz, J.Z. Zhu, Int. J. Numer. Methods Engrg. 33 (1992) 1331-1364.
  subroutine estimate_mesh_error(mesh, materials, u, free, of_elements, relative)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: u(:, :)        !! (3,n_nodes) displacement [length]
    real(wp), intent(in) :: free(:)        !! (n_elements) as of find_free_strain [-]
    real(wp), allocatable, intent(out) :: of_elements(:)
    !! (n_elements) int d : C^-1 : d, d the stresses less the smooth ones [energy]
    real(wp), intent(out) :: relative      !! their sum over int sigma : C^-1 : sigma [-]
    real(wp), parameter :: rounding = 1.0e-20_wp !! of the energy of thermal stresses: none left
    real(wp), allocatable :: stress(:, :, :), means(:, :), smooth(:, :)
    type(second_order_t) :: element
    real(wp) :: weight(16), energy
    integer :: material, e, nodes(8), n

    n = max(8, maxval(cells(mesh%connectivity%cell(:mesh%n_elements))%n_points))
    allocate (stress(6, n, mesh%n_elements), means(6, mesh%n_elements), smooth(6, mesh%n_nodes))
    allocate (of_elements(mesh%n_elements), source=0.0_wp)
    energy = 0.0_wp
    do material = 1, size(materials)
      associate (elastic => materials(material)%law%elastic)
        do e = 1, mesh%n_elements
          if (mesh%material(e) /= material) cycle
          if (has_middles(mesh%connectivity%cell(e))) then
            call make_element(e)
            associate (all_nodes => nodes_of_element(mesh%connectivity, e), &
                       w => element%weight(:element%n_points))
              stress(:, :size(w), e) = stress_of(strain_of(element, u(:, all_nodes)), elastic)
              stress(:3, :size(w), e) = stress(:3, :size(w), e) - thermal_stress_of(free(e), &
                elastic)
              means(:, e) = matmul(stress(:, :size(w), e), w)/sum(w)
            end associate
            cycle
          end if
          nodes = nodes_of_hexahedron(mesh%connectivity, e)
          stress(:, :8, e) = stress_of(gauss_strain(mesh%element_kind(e), &
            mesh%coordinates(:, nodes), u(:, nodes), elastic), elastic)
          stress(:3, :8, e) = stress(:3, :8, e) - thermal_stress_of(free(e), elastic)
          means(:, e) = volume_mean(mesh%coordinates(:, nodes), stress(:, :8, e))
        end do
        call recover_at_nodes(mesh, material, means, smooth)
        do e = 1, mesh%n_elements
          if (mesh%material(e) /= material) cycle
          if (has_middles(mesh%connectivity%cell(e))) then
            call make_element(e)
            associate (w => element%weight(:element%n_points), smoothed => interpolate_in( &
                       element%cell, smooth(:, nodes_of_element(mesh%connectivity, e))))
              energy = energy + complementary_energy(stress(:, :size(w), e), w, elastic)
              of_elements(e) = complementary_energy(smoothed - stress(:, :size(w), e), w, elastic)
            end associate
            cycle
          end if
          nodes = nodes_of_hexahedron(mesh%connectivity, e)
          weight = jacobian_determinants(mesh%coordinates(:, nodes))
          energy = energy + complementary_energy(stress(:, :8, e), weight(:8), elastic)
          of_elements(e) = complementary_energy(interpolate(smooth(:, nodes)) - stress(:, :8, e), &
            weight(:8), elastic)
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
