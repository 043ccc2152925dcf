!> How far the stresses of a mesh are from smooth ones.
!>
!> Smooth stresses recovered at the nodes (patch_recovery) are closer to the truth than those of the
!> elements; the difference stands for the error. At finite strain these are the stresses that work
!> on the logarithmic strain, which do not turn with the body. docs/theory.md section 10.
module recovered_error_mod
  use kinds_mod, only: wp
  use cells_mod, only: cells, has_middles, hexahedron_8, hexahedron_20, hexahedron_nodes, &
    pyramid_5, tetrahedron_10, wedge_6
  use connectivity_mod, only: nodes_of_element, nodes_of_hexahedron
  use mesh_mod, only: mesh_t
  use scene_mod, only: material_t
  use elasticity_mod, only: stress_of, complementary_energy
  use small_matrix_mod, only: determinant
  use strain_measures_mod, only: growth_of
  use element_laws_mod, only: elasticity_at, elasticity_at_points, law_at
  use material_law_mod, only: law_t, finite_stress, finite_energy
  use logarithmic_stress_mod, only: logarithmic_stress, energy_of_change
  use hexahedron8_mod, only: jacobian_determinants, volume_mean, gradient_in_middle, xi_node, &
    eta_node, zeta_node, gauss
  use elements_mod, only: gauss_strain
  use finite_forces_mod, only: logarithmic_stresses
  use expansion_mod, only: thermal_energy
  use patch_recovery_mod, only: recover_at_nodes, samples_t
  use cell_shapes_mod, only: shape_functions, shape_gradients_at
  use second_order_mod, only: second_order_t, make_at_points, strain_of, displacement_gradients
  implicit none
  private

  public :: estimate_mesh_error

  integer, parameter :: n_dense = cells(hexahedron_20)%n_points
  integer, parameter :: least_quadrature(size(cells)) = [0, hexahedron_8, 0, tetrahedron_10, 0, &
    wedge_6, 0, hexahedron_8, hexahedron_8, pyramid_5]
  !! the cell that has it: 2 x 2 x 2 points, 4 of a tetrahedron, 3 x 2 of a wedge; 0: no mid-side
  !! nodes

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
    logical, intent(in) :: is_finite       !! strain: then det F > 0
    real(wp), allocatable, intent(out) :: of_elements(:)
    !! (n_elements) int d : C^-1 : d, d the stresses less the smooth ones [energy]
    real(wp), intent(out) :: relative      !! their sum over int sigma : C^-1 : sigma [-]
    real(wp), parameter :: rounding = 1.0e-20_wp !! of the energy of thermal stresses: none left
    real(wp), allocatable :: stress(:, :, :), means(:, :), smooth(:, :), h(:, :, :, :), &
      slopes(:, :, :)
    type(samples_t) :: samples
    real(wp) :: weight(16), energy
    integer :: material, e, nodes(8)

    allocate (stress(6, 8, mesh%n_elements), means(6, mesh%n_elements), smooth(6, mesh%n_nodes))
    allocate (slopes(3, 6, mesh%n_elements), source=0.0_wp)
    allocate (h(3, 3, 8, merge(mesh%n_elements, 0, is_finite)))
    allocate (of_elements(mesh%n_elements), source=0.0_wp)
    call make_samples(mesh, materials, u, free, is_finite, samples)
    energy = 0.0_wp
    do material = 1, size(materials)
      do e = 1, mesh%n_elements
        if (mesh%material(e) /= material .or. has_middles(mesh%connectivity%cell(e))) cycle
        associate (elastic => elasticity_at(mesh, materials, e))
          nodes = nodes_of_hexahedron(mesh%connectivity, e)
          if (is_finite) then
            call logarithmic_stresses(mesh, materials, free(e), u, e, h(:, :, :, e), &
              stress(:, :8, e))
          else
            stress(:, :8, e) = stress_of(gauss_strain(mesh%element_kind(e), &
              mesh%coordinates(:, nodes), u(:, nodes), elastic), elastic, free(e))
          end if
          means(:, e) = volume_mean(mesh%coordinates(:, nodes), stress(:, :8, e))
          slopes(:, :, e) = gradient_in_middle(mesh%coordinates(:, nodes), stress(:, :8, e))
        end associate
      end do
      call recover_at_nodes(mesh, material, means, slopes, smooth, samples)
      do e = 1, mesh%n_elements
        if (mesh%material(e) /= material) cycle
        associate (law => law_at(mesh, materials, e), elastic => elasticity_at(mesh, materials, e))
          if (has_middles(mesh%connectivity%cell(e))) then
            call add_second_order(e, law)
            cycle
          end if
          nodes = nodes_of_hexahedron(mesh%connectivity, e)
          weight = jacobian_determinants(mesh%coordinates(:, nodes))
          if (is_finite) then
            weight = (1.0_wp + free(e))**3*weight
            call add_finite_energies(law, h(:, :, :, e), weight(:8), &
              interpolate(smooth(:, nodes)) - stress(:, :8, e), energy, of_elements(e))
          else
            energy = energy + complementary_energy(stress(:, :8, e), weight(:8), elastic)
            of_elements(e) = complementary_energy(interpolate(smooth(:, nodes)) - &
              stress(:, :8, e), weight(:8), elastic)
          end if
        end associate
      end do
    end do
    relative = 0.0_wp
    if (energy > rounding*thermal_energy(mesh, materials, free)) relative = sum(of_elements)/energy

  contains

    !> Of an element of second order. At its own points the stresses may be better than anywhere
    !> else: the difference is integrated by more.
    subroutine add_second_order(e, law)
      integer, intent(in) :: e
      type(law_t), intent(in) :: law
      real(wp) :: point(3, n_dense), dense_weight(n_dense), smoothed(6, n_dense)
      real(wp) :: h(3, 3, n_dense), found(6, n_dense)
      type(second_order_t) :: element
      integer :: g

      associate (its => nodes_of_element(mesh%connectivity, e), &
                 cell => mesh%connectivity%cell(e))
        call dense_quadrature(cell, point, dense_weight)
        call make_at_points(cell, mesh%coordinates(:, its), point, dense_weight, element)
        do g = 1, n_dense
          smoothed(:, g) = matmul(smooth(:, its), shape_functions(cells(cell), point(:, g)))
        end do
        if (is_finite) then
          call find_logarithmic(element, mesh%coordinates(:, its), u(:, its), free(e), law, h, &
            found)
          call add_finite_energies(law, h, (1.0_wp + free(e))**3*element%weight(:n_dense), &
            smoothed - found, energy, of_elements(e))
        else
          associate (elastic => elasticity_at_points(mesh, materials, e, point))
            found = stress_of(strain_of(element, u(:, its)), elastic, free(e))
            energy = energy + complementary_energy(found, element%weight, elastic)
            of_elements(e) = complementary_energy(smoothed - found, element%weight, elastic)
          end associate
        end if
      end associate
    end subroutine add_second_order

  end subroutine estimate_mesh_error

  !> The stresses of elements of second order where they are most accurate: at the points of the
  !> quadrature that has no more than it needs to hold the element.
  !>
  !> Source: J. Barlow, Int. J. Numer. Methods Engrg. 10 (1976) 243-251.
  subroutine make_samples(mesh, materials, u, free, is_finite, samples)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: u(:, :)  !! (3,n_nodes) displacement [length]
    real(wp), intent(in) :: free(:)  !! (n_elements) as of find_free_strain [-]
    logical, intent(in) :: is_finite !! strain
    type(samples_t), intent(out) :: samples
    type(second_order_t) :: element
    real(wp) :: h(3, 3, n_dense)
    integer :: e, g

    allocate (samples%first(mesh%n_elements + 1))
    samples%first(1) = 1
    do e = 1, mesh%n_elements
      samples%first(e + 1) = samples%first(e)
      if (has_middles(mesh%connectivity%cell(e))) samples%first(e + 1) = samples%first(e) + &
        cells(least_quadrature(mesh%connectivity%cell(e)))%n_points
    end do
    associate (n => samples%first(mesh%n_elements + 1) - 1)
      allocate (samples%place(3, n), samples%stress(6, n))
    end associate
    do e = 1, mesh%n_elements
      if (.not. has_middles(mesh%connectivity%cell(e))) cycle
      associate (cell => mesh%connectivity%cell(e), its => nodes_of_element(mesh%connectivity, e), &
                 n => samples%first(e + 1) - samples%first(e), before => samples%first(e) - 1, &
                 rule => least_quadrature(mesh%connectivity%cell(e)))
        call make_at_points(cell, mesh%coordinates(:, its), cells(rule)%point(:, :n), &
          cells(rule)%weight(:n), element)
        if (is_finite) then
          call find_logarithmic(element, mesh%coordinates(:, its), u(:, its), free(e), &
            law_at(mesh, materials, e), h(:, :, :n), samples%stress(:, before + 1:before + n))
        else
          samples%stress(:, before + 1:before + n) = stress_of(strain_of(element, u(:, its)), &
            elasticity_at_points(mesh, materials, e, cells(rule)%point(:, :n)), free(e))
        end if
        do g = 1, n
          samples%place(:, before + g) = matmul(mesh%coordinates(:, its), &
            shape_functions(cells(cell), cells(rule)%point(:, g)))
        end do
      end associate
    end do
  end subroutine make_samples

  !> Gauss's 3 x 3 x 3 points in the hexahedron that a cell is where some corners are one.
  pure subroutine dense_quadrature(cell, point, weight)
    integer, intent(in) :: cell              !! row of the table of cells
    real(wp), intent(out) :: point(:, :)     !! (3,27) natural coordinates [-]
    real(wp), intent(out) :: weight(:)       !! (27) [-]
    real(wp) :: corner(3, hexahedron_nodes)
    integer :: g

    corner = cells(cell)%place(:, cells(cell)%as_hexahedron)
    associate (cube => cells(hexahedron_8), rule => cells(hexahedron_20))
      do g = 1, n_dense
        point(:, g) = matmul(corner, shape_functions(cube, rule%point(:, g)))
        weight(g) = rule%weight(g)*determinant(matmul(corner, transpose(shape_gradients_at(cube, &
          rule%point(:, g)))))
      end do
    end associate
  end subroutine dense_quadrature

  !> At the points of an element of second order: the gradients of its displacement from where it
  !> has expanded freely, and the stresses that work on its logarithmic strains. Between nodes and
  !> the points of its own quadrature it may be inside out: there it counts as undeformed.
  subroutine find_logarithmic(element, x, u, free, law, h, stress)
    type(second_order_t), intent(in) :: element
    real(wp), intent(in) :: x(:, :), u(:, :)  !! (3,n_nodes) nodes, their displacements [length]
    real(wp), intent(in) :: free              !! strain by free expansion [-]
    type(law_t), intent(in) :: law
    real(wp), intent(out) :: h(:, :, :)       !! (3,3,n_points) [-]
    real(wp), intent(out) :: stress(:, :)     !! (6,n_points) [force/length^2]
    real(wp) :: t(3, 3)
    integer :: g

    ! The gradients on expanded places are those on the others, divided by 1 + free.
    h = displacement_gradients(element, u - free*(x - spread(x(:, 1), 2, size(x, 2))))/(1.0_wp + &
      free)
    do g = 1, size(h, 3)
      if (growth_of(h(:, :, g)) <= -1.0_wp) h(:, :, g) = 0.0_wp
      t = logarithmic_stress(h(:, :, g), finite_stress(law, h(:, :, g)))
      stress(:, g) = [t(1, 1), t(2, 2), t(3, 3), t(1, 2), t(2, 3), t(1, 3)]
    end do
  end subroutine find_logarithmic

  !> Twice the strain energy of an element, and the energy of what its stresses change by.
  subroutine add_finite_energies(law, h, weight, change, energy, of_change)
    type(law_t), intent(in) :: law
    real(wp), intent(in) :: h(:, :, :)   !! (3,3,n_points) det(I + H) > 0 [-]
    real(wp), intent(in) :: weight(:)    !! (n_points) [length^3]
    real(wp), intent(in) :: change(:, :) !! (6,n_points) XX YY ZZ XY YZ XZ [force/length^2]
    real(wp), intent(inout) :: energy    !! takes the element's [energy]
    real(wp), intent(out) :: of_change   !! [energy]
    integer :: g

    of_change = 0.0_wp
    do g = 1, size(weight)
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
