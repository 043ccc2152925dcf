!> What finite strain would change of a small-strain solution, bounded by one internal force.
module theory_error_mod
  use kinds_mod, only: wp
  use cells_mod, only: has_middles
  use connectivity_mod, only: nodes_of_element, nodes_of_hexahedron
  use mesh_mod, only: mesh_t, kind_c3d8i, kind_c3d8b
  use scene_mod, only: material_t
  use elasticity_mod, only: constrained_modulus, stress_of
  use material_law_mod, only: law_t, finite_stress
  use hexahedron8_mod, only: shape_gradients, strain_of, mode_strain_of, stiffness_length
  use c3d8b_mod, only: mean_dilatation_strain
  use c3d8i_mod, only: mode_gradients, mode_amplitudes
  use finite_strain_mod, only: finite_force
  use second_order_mod, only: second_order_t, second_order, displacement_gradients, &
    strain_of_second_order => strain_of
  implicit none
  private

  public :: estimate_theory_error

contains

  !> The error of the forces by the theory, as a part of them: twice the sum over the elements of
  !>
  !>     |u . (f_finite - f_linear)|
  !>
  !> over the work that u . f_linear is: of the body with the least, of those that a pair acts on
  !> (of all where none does), or W, what reactions do on what they move, where that is more; at
  !> most that of these bodies together. Bodies without strain energy are left out; 0 where none has
  !> any. docs/theory.md (8.32).
  pure subroutine estimate_theory_error(mesh, materials, u, free, is_pressed, contact_work, &
      error)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: u(:, :)        !! (3,n_nodes) displacement [length]
    real(wp), intent(in) :: free(:)        !! (n_elements) as of find_free_strain [-]
    logical, intent(in) :: is_pressed(:)   !! (n_bodies) whether a pair acts on the body
    real(wp), intent(in) :: contact_work   !! W, as of least_contact_work [energy]
    real(wp), intent(out) :: error         !! [-]
    real(wp), parameter :: operations = 64.0_wp ! rounded ones in a displacement's difference
    real(wp) :: change(mesh%n_bodies), work(mesh%n_bodies), rounding(mesh%n_bodies)
    real(wp) :: of_change, of_work
    logical :: is_strained(mesh%n_bodies), counts(mesh%n_bodies)
    integer :: e, body, nodes(8)

    change = 0.0_wp
    work = 0.0_wp
    rounding = 0.0_wp
    do e = 1, mesh%n_elements
      nodes = nodes_of_hexahedron(mesh%connectivity, e)
      body = mesh%body(nodes(1))
      associate (law => materials(mesh%material(e))%law)
        if (has_middles(mesh%connectivity%cell(e))) then
          associate (all_nodes => nodes_of_element(mesh%connectivity, e))
            call find_works_of_second_order(mesh%connectivity%cell(e), mesh%coordinates(:, &
              all_nodes), u(:, all_nodes), free(e), law, of_change, of_work)
          end associate
        else
          call find_works(mesh%element_kind(e), mesh%coordinates(:, nodes), u(:, nodes), free(e), &
            law, of_change, of_work)
        end if
        rounding(body) = rounding(body) + constrained_modulus(law%elastic)* &
          stiffness_length(mesh%coordinates(:, nodes))* &
          (operations*epsilon(1.0_wp)*maxval(abs(u(:, nodes))))**2
      end associate
      change(body) = change(body) + abs(of_change)
      work(body) = work(body) + of_work
    end do
    is_strained = work > rounding
    error = 0.0_wp
    if (.not. any(is_strained)) return
    counts = is_strained
    if (any(is_pressed .and. is_strained)) counts = is_pressed .and. is_strained
    error = 2.0_wp*sum(change, is_strained)/min(sum(work, counts), max(minval(work, counts), &
      contact_work))
    if (.not. error <= huge(error)) error = huge(error)
  end subroutine estimate_theory_error

  !> Work of an element's forces on its displacements: by how much that of finite strain differs
  !> from the linear one, and the linear one.
  !>
  !> An element that expands freely is the reference of its strains, F/(1 + growth), and
  !> displacements are counted from there. With incompatible modes, whose amplitudes are those of
  !> the linear solution, their forces do work on these: to first order that is what the forces of
  !> the nodes would be once the amplitudes had followed.
  pure subroutine find_works(kind, x, u, growth, law, change, work)
    integer,  intent(in) :: kind             !! kind_c3d8 or its kin
    real(wp), intent(in) :: x(3, 8), u(3, 8) !! nodes and their displacements [length]
    real(wp), intent(in) :: growth           !! free expansion [-]
    type(law_t), intent(in) :: law
    real(wp), intent(out) :: change, work    !! [energy]
    real(wp) :: from(3, 8), strained(3, 8), finite(3, 8), modes(3, 3), of_modes(3, 3)
    real(wp) :: gradient(3, 8, 8), weight(8), inverse_jacobian(3, 3, 8), mode(3, 3, 8)
    real(wp) :: strain(6, 8), stress(6, 8)
    integer :: g

    from = x - spread(x(:, 1), 2, 8)
    strained = u - spread(u(:, 1), 2, 8) - growth*from
    modes = 0.0_wp
    call shape_gradients(from, gradient, weight, inverse_jacobian)
    strain = strain_of(inverse_jacobian, strained)
    if (kind == kind_c3d8i) then
      call mode_gradients(from, weight, mode)
      modes = mode_amplitudes(mode, weight, strain, law%elastic)
      strain = strain + mode_strain_of(3, mode, modes)
    else if (kind == kind_c3d8b) then
      strain = mean_dilatation_strain(inverse_jacobian, weight, strained)
    end if
    stress = stress_of(strain, law%elastic)
    work = 0.0_wp
    do g = 1, 8
      work = work + weight(g)*(dot_product(stress(:3, g), strain(:3, g)) + &
        2.0_wp*dot_product(stress(4:, g), strain(4:, g)))
    end do
    call finite_force(kind, (1.0_wp + growth)*from, strained, modes, law, finite, of_modes)
    change = sum(strained*finite) + sum(modes*of_modes) - work
  end subroutine find_works

  !> The same of an element of second order.
  pure subroutine find_works_of_second_order(cell, x, u, growth, law, change, work)
    integer,  intent(in) :: cell             !! row of the table of cells
    real(wp), intent(in) :: x(:, :), u(:, :) !! (3,n) nodes and their displacements [length]
    real(wp), intent(in) :: growth           !! free expansion [-]
    type(law_t), intent(in) :: law
    real(wp), intent(out) :: change, work    !! [energy]
    type(second_order_t) :: element
    real(wp) :: from(3, size(x, 2)), strained(3, size(x, 2))
    real(wp), allocatable :: h(:, :, :), strain(:, :), stress(:, :)
    integer :: g

    from = x - spread(x(:, 1), 2, size(x, 2))
    strained = u - spread(u(:, 1), 2, size(u, 2)) - growth*from
    call second_order(cell, from, element)
    allocate (strain, source=strain_of_second_order(element, strained))
    allocate (stress, source=stress_of(strain, law%elastic))
    work = 0.0_wp
    do g = 1, element%n_points
      work = work + element%weight(g)*(dot_product(stress(:3, g), strain(:3, g)) + &
        2.0_wp*dot_product(stress(4:, g), strain(4:, g)))
    end do
    call second_order(cell, (1.0_wp + growth)*from, element)
    allocate (h, source=displacement_gradients(element, strained))
    change = -work
    do g = 1, element%n_points
      change = change + element%weight(g)*sum(finite_stress(law, h(:, :, g))*h(:, :, g))
    end do
  end subroutine find_works_of_second_order

end module theory_error_mod
