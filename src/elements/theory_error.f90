!> What finite strain would change of a small-strain solution, bounded by one internal force.
module theory_error_mod
  use kinds_mod, only: wp
  use cells_mod, only: has_middles
  use connectivity_mod, only: nodes_of_element, nodes_of_hexahedron
  use spring_elements_mod, only: spring_ends, spring_state, spring_state_t
  use mesh_mod, only: mesh_t, kind_c3d8i, kind_c3d8b
  use scene_mod, only: material_t
  use elasticity_mod, only: constrained_modulus, stress_of
  use element_laws_mod, only: law_at
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
  !>     |v . (f_finite(u) - f_linear(u))|,    v = u - u_free
  !>
  !> over the work that v . f_linear(v) is: of the body with the least, of those that a pair acts on
  !> (of all where none does), or W, what reactions do on what they move, where that is more; at
  !> most that of these bodies together. Bodies without strain energy are left out; 0 where none has
  !> any. docs/theory.md (8.32).
  pure subroutine estimate_theory_error(mesh, materials, u, free, is_pressed, contact_work, &
      error, u_free)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: u(:, :)        !! (3,n_nodes) displacement [length]
    real(wp), intent(in) :: free(:)        !! (n_elements) as of find_free_strain [-]
    logical, intent(in) :: is_pressed(:)   !! (n_bodies) whether a pair acts on the body
    real(wp), intent(in) :: contact_work   !! W, as of least_contact_work [energy]
    real(wp), intent(out) :: error         !! [-]
    real(wp), intent(in), optional :: u_free(:, :)
    !! (3,n_nodes) displacement without reactions; 0 in all of a body: v is u there [length]
    real(wp), parameter :: operations = 64.0_wp ! rounded ones in a displacement's difference
    real(wp) :: change(mesh%n_bodies), work(mesh%n_bodies), rounding(mesh%n_bodies)
    real(wp) :: of_change, of_work
    real(wp) :: v(3, mesh%n_nodes)
    logical :: is_strained(mesh%n_bodies), counts(mesh%n_bodies), is_moved(0:mesh%n_bodies)
    integer :: e, i, body, nodes(8)
    type(spring_state_t) :: linear, finite, by

    v = u
    is_moved = .false.
    if (present(u_free)) then
      v = u - u_free
      do i = 1, mesh%n_nodes
        is_moved(mesh%body(i)) = is_moved(mesh%body(i)) .or. any(abs(u_free(:, i)) > 0.0_wp)
      end do
    end if
    change = 0.0_wp
    work = 0.0_wp
    rounding = 0.0_wp
    do e = 1, mesh%n_elements
      nodes = nodes_of_hexahedron(mesh%connectivity, e)
      body = mesh%body(nodes(1))
      associate (law => law_at(mesh, materials, e))
        if (has_middles(mesh%connectivity%cell(e))) then
          associate (all_nodes => nodes_of_element(mesh%connectivity, e))
            call find_works_of_second_order(mesh%connectivity%cell(e), mesh%coordinates(:, &
              all_nodes), elastic(u, all_nodes, free(e)), elastic(v, all_nodes, &
              merge(0.0_wp, free(e), is_moved(body))), free(e), law, of_change, of_work)
          end associate
        else
          call find_works(mesh%element_kind(e), mesh%coordinates(:, nodes), elastic(u, nodes, &
            free(e)), elastic(v, nodes, merge(0.0_wp, free(e), is_moved(body))), free(e), law, &
            of_change, of_work)
        end if
        rounding(body) = rounding(body) + constrained_modulus(law%elastic)* &
          stiffness_length(mesh%coordinates(:, nodes))* &
          (operations*epsilon(1.0_wp)*maxval(abs(u(:, nodes))))**2
      end associate
      change(body) = change(body) + abs(of_change)
      work(body) = work(body) + of_work
    end do
    do i = 1, mesh%springs%n
      body = mesh%body(mesh%springs%node(mesh%springs%first(i)))
      linear = spring_state(mesh%springs, i, mesh%coordinates, u, .false.)
      finite = spring_state(mesh%springs, i, mesh%coordinates, u, .true.)
      by = spring_state(mesh%springs, i, mesh%coordinates, v, .false.)
      change(body) = change(body) + abs(finite%pull*sum(finite%direction*v(:, spring_ends( &
        mesh%springs, i))) - linear%pull*by%elongation)
      work(body) = work(body) + 2.0_wp*by%energy
    end do
    is_strained = work > rounding
    error = 0.0_wp
    if (.not. any(is_strained)) return
    counts = is_strained
    if (any(is_pressed .and. is_strained)) counts = is_pressed .and. is_strained
    error = 2.0_wp*sum(change, is_strained)/min(sum(work, counts), max(minval(work, counts), &
      contact_work))
    if (.not. error <= huge(error)) error = huge(error)

  contains

    !> Displacements of an element's nodes beside its first one, counted from its free expansion.
    pure function elastic(u, nodes, growth)
      real(wp), intent(in) :: u(:, :)
      integer, intent(in) :: nodes(:)
      real(wp), intent(in) :: growth
      real(wp) :: elastic(3, size(nodes))

      elastic = u(:, nodes) - growth*mesh%coordinates(:, nodes)
      elastic = elastic - spread(elastic(:, 1), 2, size(nodes))
    end function elastic

  end subroutine estimate_theory_error

  !> Work of an element's forces on displacements v: by how much that of finite strain differs from
  !> the linear one, and the linear one of v's own forces.
  !>
  !> An element that expands freely is the reference of its strains, F/(1 + growth), and
  !> displacements are counted from there. With incompatible modes, whose amplitudes are those of
  !> the linear solution, their forces do work on these: to first order that is what the forces of
  !> the nodes would be once the amplitudes had followed.
  pure subroutine find_works(kind, x, u, v, growth, law, change, work)
    integer,  intent(in) :: kind                      !! kind_c3d8 or its kin
    real(wp), intent(in) :: x(3, 8), u(3, 8), v(3, 8) !! nodes and their displacements [length]
    real(wp), intent(in) :: growth                    !! free expansion [-]
    type(law_t), intent(in) :: law
    real(wp), intent(out) :: change, work             !! [energy]
    real(wp) :: from(3, 8), finite(3, 8), modes(3, 3), of_modes(3, 3), by_modes(3, 3)
    real(wp) :: gradient(3, 8, 8), weight(8), inverse_jacobian(3, 3, 8), mode(3, 3, 8)
    real(wp), dimension(6, 8) :: strain, by_strain

    from = x - spread(x(:, 1), 2, 8)
    modes = 0.0_wp
    by_modes = 0.0_wp
    call shape_gradients(from, gradient, weight, inverse_jacobian)
    if (kind == kind_c3d8i) call mode_gradients(from, weight, mode)
    call find_strain(u, strain, modes)
    call find_strain(v, by_strain, by_modes)
    work = work_of(weight, stress_of(by_strain, [law%elastic]), by_strain)
    call finite_force(kind, (1.0_wp + growth)*from, u, modes, law, finite, of_modes)
    change = sum(v*finite) + sum(by_modes*of_modes) - work_of(weight, stress_of(strain, &
      [law%elastic]), by_strain)

  contains

    pure subroutine find_strain(u, strain, modes)
      real(wp), intent(in) :: u(3, 8)
      real(wp), intent(out) :: strain(6, 8)
      real(wp), intent(inout) :: modes(3, 3)

      strain = strain_of(inverse_jacobian, u)
      if (kind == kind_c3d8i) then
        modes = mode_amplitudes(mode, weight, strain, [law%elastic])
        strain = strain + mode_strain_of(3, mode, modes)
      else if (kind == kind_c3d8b) then
        strain = mean_dilatation_strain(inverse_jacobian, weight, u)
      end if
    end subroutine find_strain

  end subroutine find_works

  !> The same of an element of second order.
  pure subroutine find_works_of_second_order(cell, x, u, v, growth, law, change, work)
    integer,  intent(in) :: cell                      !! row of the table of cells
    real(wp), intent(in) :: x(:, :), u(:, :), v(:, :) !! (3,n) as of find_works [length]
    real(wp), intent(in) :: growth                    !! free expansion [-]
    type(law_t), intent(in) :: law
    real(wp), intent(out) :: change, work             !! [energy]
    type(second_order_t) :: element
    real(wp) :: from(3, size(x, 2))
    real(wp), allocatable, dimension(:, :, :) :: h, by
    real(wp), allocatable :: by_strain(:, :)
    integer :: g

    from = x - spread(x(:, 1), 2, size(x, 2))
    call second_order(cell, from, element)
    allocate (by_strain, source=strain_of_second_order(element, v))
    work = work_of(element%weight(:element%n_points), stress_of(by_strain, [law%elastic]), &
      by_strain)
    change = -work_of(element%weight(:element%n_points), stress_of(strain_of_second_order( &
      element, u), [law%elastic]), by_strain)
    call second_order(cell, (1.0_wp + growth)*from, element)
    allocate (h, source=displacement_gradients(element, u))
    allocate (by, source=displacement_gradients(element, v))
    do g = 1, element%n_points
      change = change + element%weight(g)*sum(finite_stress(law, h(:, :, g))*by(:, :, g))
    end do
  end subroutine find_works_of_second_order

  !> The work of stresses on strains, of which shear counts twice.
  pure real(wp) function work_of(weight, stress, strain) result(work)
    real(wp), intent(in) :: weight(:)               !! (n_points) [volume]
    real(wp), intent(in) :: stress(:, :), strain(:, :) !! (6,n_points)
    integer :: g

    work = 0.0_wp
    do g = 1, size(weight)
      work = work + weight(g)*(dot_product(stress(:3, g), strain(:3, g)) + &
        2.0_wp*dot_product(stress(4:, g), strain(4:, g)))
    end do
  end function work_of

end module theory_error_mod
