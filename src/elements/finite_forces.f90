!> Internal forces of the whole mesh at finite strain, element by element, with the strain energy.
module finite_forces_mod
  use kinds_mod, only: wp
  use dense_mod, only: symmetric_eigenvectors
  use connectivity_mod, only: nodes_of_hexahedron
  use mesh_mod, only: mesh_t
  use scene_mod, only: material_t
  use small_matrix_mod, only: inverse
  use strain_measures_mod, only: growth_of, deformation_of, green_strain, logarithmic_strain
  use material_law_mod, only: finite_stress, finite_energy, finite_tangent
  use hexahedron8_mod, only: shape_gradients, displacement_gradients
  use finite_strain_mod, only: force_of_stress
  use expansion_mod, only: expand_freely
  implicit none
  private

  public :: tangent_t, element_tangent, add_tangent_force
  public :: finite_internal_force, finite_strain_energy, finite_tensors, undeformed_tensors, &
    work_of_heat

  !> Where a tangent is taken.
  type :: tangent_t
    real(wp), allocatable :: at(:, :) !! (3,n_nodes) displacement, det F > 0 [length]
    real(wp), allocatable :: free(:)  !! (n_elements) strain by free expansion there [-]
    logical :: is_projected = .true.  !! of each element, without what is negative in it
  end type tangent_t

contains

  !> f_a = int P g_a, summed over the elements (C3D8), and an element with det F <= 0 at a Gauss
  !> point, or that would shrink to nothing, whose stress no law gives: then forces are 0.
  pure subroutine finite_internal_force(mesh, materials, free, u, f, inverted)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: free(:)    !! (n_elements) strain by free expansion [-]
    real(wp), intent(in) :: u(:, :)    !! (3,n_nodes) displacement [length]
    real(wp), intent(out) :: f(:, :)   !! (3,n_nodes) [force]
    integer, intent(out) :: inverted   !! element, 0: there is none
    real(wp) :: gradient(3, 8, 8), weight(8), inverse_jacobian(3, 3, 8), h(3, 3, 8), p(3, 3, 8)
    real(wp), dimension(3, 8) :: force, x, moved
    integer :: e, g, a, nodes(8)

    f = 0.0_wp
    inverted = findloc(free <= -1.0_wp, .true., dim=1)
    if (inverted > 0) return
    do e = 1, mesh%n_elements
      nodes = nodes_of_hexahedron(mesh%connectivity, e)
      x = mesh%coordinates(:, nodes)
      moved = u(:, nodes)
      call expand_freely(free(e), x, moved)
      call shape_gradients(x, gradient, weight, inverse_jacobian)
      h = displacement_gradients(inverse_jacobian, moved)
      associate (law => materials(mesh%material(e))%law)
        do g = 1, 8
          if (growth_of(h(:, :, g)) <= -1.0_wp) then
            inverted = e
            f = 0.0_wp
            return
          end if
          p(:, :, g) = finite_stress(law, h(:, :, g))
        end do
      end associate
      force = force_of_stress(gradient, weight, p)
      do a = 1, 8
        f(:, nodes(a)) = f(:, nodes(a)) + force(:, a)
      end do
    end do
  end subroutine finite_internal_force

  !> The strain energy of all elements, int W dV.
  pure real(wp) function finite_strain_energy(mesh, materials, free, u) result(energy)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: free(:)    !! (n_elements) strain by free expansion [-]
    real(wp), intent(in) :: u(:, :)    !! (3,n_nodes) displacement, det F > 0 [length]
    real(wp) :: gradient(3, 8, 8), weight(8), inverse_jacobian(3, 3, 8), h(3, 3, 8)
    real(wp) :: x(3, 8), moved(3, 8)
    integer :: e, g, nodes(8)

    energy = 0.0_wp
    do e = 1, mesh%n_elements
      nodes = nodes_of_hexahedron(mesh%connectivity, e)
      x = mesh%coordinates(:, nodes)
      moved = u(:, nodes)
      call expand_freely(free(e), x, moved)
      call shape_gradients(x, gradient, weight, inverse_jacobian)
      h = displacement_gradients(inverse_jacobian, moved)
      do g = 1, 8
        energy = energy + weight(g)*finite_energy(materials(mesh%material(e))%law, h(:, :, g))
      end do
    end do
  end function finite_strain_energy

  !> What the strain energy changes by as elements expand further, (1 + free)^3 W(F/(1 + free)) at
  !> the same F: of an element W less a third of P : F, times the growth of its free volume.
  pure real(wp) function work_of_heat(mesh, materials, free, u, further) result(work)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: free(:)    !! (n_elements) strain by free expansion [-]
    real(wp), intent(in) :: u(:, :)    !! (3,n_nodes) displacement, det F > 0 [length]
    real(wp), intent(in) :: further(:) !! (n_elements) by how much more they expand [-]
    real(wp) :: gradient(3, 8, 8), weight(8), inverse_jacobian(3, 3, 8), h(3, 3, 8)
    real(wp) :: x(3, 8), moved(3, 8), of_element
    integer :: e, g, nodes(8)

    work = 0.0_wp
    do e = 1, mesh%n_elements
      if (.not. abs(further(e)) > 0.0_wp) cycle
      nodes = nodes_of_hexahedron(mesh%connectivity, e)
      x = mesh%coordinates(:, nodes)
      moved = u(:, nodes)
      call expand_freely(free(e), x, moved)
      call shape_gradients(x, gradient, weight, inverse_jacobian)
      h = displacement_gradients(inverse_jacobian, moved)
      of_element = 0.0_wp
      associate (law => materials(mesh%material(e))%law)
        do g = 1, 8
          of_element = of_element + weight(g)*(finite_energy(law, h(:, :, g)) - &
            sum(finite_stress(law, h(:, :, g))*deformation_of(h(:, :, g)))/3.0_wp)
        end do
      end associate
      work = work + 3.0_wp*further(e)/(1.0_wp + free(e))*of_element
    end do
  end function work_of_heat

  !> Tangent of an element, K_ab = int A : g_a (x) g_b, A = dP/dF. docs/theory.md (8.23).
  !>
  !> Projected: without what is negative in it, the next positive semi-definite matrix. A soft body
  !> that is pressed has a tangent that is none, and a compliance of which contact problems have
  !> several solutions.
  subroutine element_tangent(mesh, materials, tangent, e, k)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    type(tangent_t), intent(in) :: tangent
    integer, intent(in) :: e           !! element
    real(wp), intent(out) :: k(24, 24) !! node by node, x y z [force/length]
    real(wp) :: gradient(3, 8, 8), weight(8), inverse_jacobian(3, 3, 8), h(3, 3, 8)
    real(wp) :: a(3, 3, 3, 3), along(3, 8, 3, 3), vectors(24, 24), values(24)
    real(wp) :: x(3, 8), u(3, 8)
    integer :: g, i, m, l, b, nodes(8)
    logical :: ok

    nodes = nodes_of_hexahedron(mesh%connectivity, e)
    x = mesh%coordinates(:, nodes)
    u = tangent%at(:, nodes)
    call expand_freely(tangent%free(e), x, u)
    call shape_gradients(x, gradient, weight, inverse_jacobian)
    h = displacement_gradients(inverse_jacobian, u)
    k = 0.0_wp
    do g = 1, 8
      a = weight(g)*finite_tangent(materials(mesh%material(e))%law, h(:, :, g))
      do l = 1, 3
        do m = 1, 3
          along(:, :, m, l) = matmul(a(:, :, m, l), gradient(:, :, g))
        end do
      end do
      do b = 1, 8
        do m = 1, 3
          i = 3*(b - 1) + m
          k(:, i) = k(:, i) + reshape(along(:, :, m, 1)*gradient(1, b, g) + along(:, :, m, 2)* &
            gradient(2, b, g) + along(:, :, m, 3)*gradient(3, b, g), [24])
        end do
      end do
    end do
    if (.not. tangent%is_projected) return
    vectors = 0.5_wp*(k + transpose(k))
    call symmetric_eigenvectors(vectors, values, ok)
    if (.not. ok .or. values(1) >= 0.0_wp) return
    do i = 1, 24
      if (values(i) >= 0.0_wp) exit
      k = k - values(i)*spread(vectors(:, i), 2, 24)*spread(vectors(:, i), 1, 24)
    end do
  end subroutine element_tangent

  !> Add K v of the tangent to nodal forces.
  subroutine add_tangent_force(mesh, materials, tangent, v, f)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    type(tangent_t), intent(in) :: tangent
    real(wp), intent(in) :: v(:, :)    !! (3,n_nodes) displacement [length]
    real(wp), intent(inout) :: f(:, :) !! (3,n_nodes) [force]
    real(wp) :: k(24, 24)
    integer :: e, nodes(8)

    do e = 1, mesh%n_elements
      nodes = nodes_of_hexahedron(mesh%connectivity, e)
      if (.not. any(abs(v(:, nodes)) > 0.0_wp)) cycle
      call element_tangent(mesh, materials, tangent, e, k)
      f(:, nodes) = f(:, nodes) + reshape(matmul(k, reshape(v(:, nodes), [24])), [3, 8])
    end do
  end subroutine add_tangent_force

  !> Logarithmic strain, that by expansion included, and Cauchy stress of an element at its Gauss
  !> points: sigma = P F^T/J.
  subroutine finite_tensors(material, free, x, u, strain, stress)
    type(material_t), intent(in) :: material
    real(wp), intent(in) :: free                         !! strain by free expansion [-]
    real(wp), intent(in) :: x(3, 8), u(3, 8)             !! nodes and displacements [length]
    real(wp), intent(out) :: strain(6, 8), stress(6, 8)  !! XX YY ZZ XY YZ XZ [-], [force/length^2]
    real(wp) :: gradient(3, 8, 8), weight(8), inverse_jacobian(3, 3, 8), h(3, 3, 8), t(3, 3)
    real(wp) :: from(3, 8), moved(3, 8)
    integer :: g

    from = x
    moved = u
    call expand_freely(free, from, moved)
    call shape_gradients(from, gradient, weight, inverse_jacobian)
    h = displacement_gradients(inverse_jacobian, moved)
    do g = 1, 8
      strain(:, g) = six_of(logarithmic_strain(h(:, :, g)))
      ! F is free of stress times (1 + free).
      strain(:3, g) = strain(:3, g) + log(1.0_wp + free)
      t = matmul(finite_stress(material%law, h(:, :, g)), transpose(deformation_of(h(:, :, g))))
      stress(:, g) = six_of(t/(1.0_wp + growth_of(h(:, :, g))))
    end do
  end subroutine finite_tensors

  !> Green's strain, that by expansion included, and second Piola-Kirchhoff stress of an element at
  !> its Gauss points: S = F^-1 P, both of the volume and the places before any expansion.
  pure subroutine undeformed_tensors(material, free, x, u, strain, stress)
    type(material_t), intent(in) :: material
    real(wp), intent(in) :: free                         !! strain by free expansion [-]
    real(wp), intent(in) :: x(3, 8), u(3, 8)             !! nodes and displacements [length]
    real(wp), intent(out) :: strain(6, 8), stress(6, 8)  !! XX YY ZZ XY YZ XZ [-], [force/length^2]
    real(wp) :: gradient(3, 8, 8), weight(8), inverse_jacobian(3, 3, 8), h(3, 3, 8), f(3, 3)
    real(wp) :: from(3, 8), moved(3, 8)
    integer :: g

    from = x
    moved = u
    call expand_freely(free, from, moved)
    call shape_gradients(from, gradient, weight, inverse_jacobian)
    h = displacement_gradients(inverse_jacobian, moved)
    do g = 1, 8
      ! F = (1 + free) F_e, and P = (1 + free)^2 P_e on the faces before the expansion.
      f = deformation_of(h(:, :, g))
      stress(:, g) = (1.0_wp + free)*six_of(matmul(inverse(f), finite_stress(material%law, &
        h(:, :, g))))
      strain(:, g) = (1.0_wp + free)**2*six_of(green_strain(h(:, :, g)))
      strain(:3, g) = strain(:3, g) + free*(1.0_wp + 0.5_wp*free)
    end do
  end subroutine undeformed_tensors

  !> The six components of a symmetric tensor.
  pure function six_of(t) result(six)
    real(wp), intent(in) :: t(3, 3)
    real(wp) :: six(6)

    six = [t(1, 1), t(2, 2), t(3, 3), t(1, 2), t(2, 3), t(1, 3)]
  end function six_of

end module finite_forces_mod
