!> Elements at finite strain: gradients, stresses, forces and energy of one element of any kind.
!>
!> Displacement gradients H = du/dX are used and not F = I + H, which would lose the digits of small
!> strains. Forces are those that a displacement of its nodes does work on, f_a = int P g_a, and are
!> objective. At small strain they are those of elements_mod. docs/theory.md (8.12) to (8.15).
module finite_strain_mod
  use kinds_mod, only: wp
  use undefined_mod, only: undefined
  use strain_measures_mod, only: growth_of, deformation_of
  use material_law_mod, only: law_t, finite_stress, finite_energy
  use mesh_mod, only: kind_c3d8, kind_c3d8i, kind_c3d8b
  use small_matrix_mod, only: inverse
  use hexahedron8_mod, only: shape_gradients, centre_shape_gradients, centre_gradient, &
    displacement_gradients
  use c3d8i_mod, only: mode_gradients
  implicit none
  private

  public :: finite_element_t, finite_element, is_inverted, gradients_of_law, stresses_of, &
    forces_on_nodes, forces_on_modes, energy_of
  public :: finite_force, mode_part

  !> An element, and the gradients of its displacement.
  type :: finite_element_t
    integer :: kind = 0            !! kind_c3d8 or its kin
    real(wp) :: corners(3, 8)      !! less the first [length]
    real(wp) :: inverse_jacobian(3, 3, 8) !! as of shape_gradients [1/length]
    real(wp) :: gradient(3, 8, 8)  !! of the shape functions, as of shape_gradients [1/length]
    real(wp) :: weight(8)          !! of the Gauss points [length^3]
    real(wp) :: h(3, 3, 8)         !! du/dX of the nodes' displacements [-]
    ! Of C3D8I alone.
    real(wp) :: mode(3, 3, 8)      !! m_k, as of mode_gradients [1/length]
    real(wp) :: at_centre(3, 8)    !! gradients of the shape functions there [1/length]
    real(wp) :: h_0(3, 3)          !! du/dX there [-]
  end type finite_element_t

contains

  !> An element as its nodes displace it. What it has of one that is congruent stays.
  pure subroutine finite_element(kind, x, u, element)
    integer,  intent(in) :: kind             !! kind_c3d8 or its kin
    real(wp), intent(in) :: x(3, 8), u(3, 8) !! nodes and their displacements [length]
    type(finite_element_t), intent(inout) :: element !! another one, or none

    if (.not. is_congruent(kind, x, element)) then
      element%kind = kind
      element%corners = x - spread(x(:, 1), 2, 8)
      call shape_gradients(x, element%gradient, element%weight, element%inverse_jacobian)
      if (kind == kind_c3d8i) then
        call mode_gradients(x, element%weight, element%mode)
        element%at_centre = centre_shape_gradients(x)
      end if
    end if
    element%h = displacement_gradients(element%inverse_jacobian, u)
    if (kind == kind_c3d8i) element%h_0 = centre_gradient(x, u)
  end subroutine finite_element

  !> Whether an element is of a kind and, but for rounding, of a shape.
  pure logical function is_congruent(kind, x, element)
    integer,  intent(in) :: kind
    real(wp), intent(in) :: x(3, 8)  !! [length]
    type(finite_element_t), intent(in) :: element
    real(wp) :: rounding
    integer :: a

    is_congruent = element%kind == kind
    if (.not. is_congruent) return
    rounding = 4.0_wp*epsilon(1.0_wp)*maxval(abs(x))
    do a = 7, 2, -1
      is_congruent = all(abs((x(:, a) - x(:, 1)) - element%corners(:, a)) <= rounding)
      if (.not. is_congruent) return
    end do
    is_congruent = all(abs((x(:, 8) - x(:, 1)) - element%corners(:, 8)) <= rounding)
  end function is_congruent

  !> Whether det F <= 0 at a Gauss point, of the displacements of the nodes.
  pure logical function is_inverted(element)
    type(finite_element_t), intent(in) :: element
    integer :: g

    is_inverted = any([(growth_of(element%h(:, :, g)) <= -1.0_wp, g=1, 8)])
  end function is_inverted

  !> The displacement gradients at the Gauss points that the law is asked at:
  !> C3D8B's F_b = (theta/J)^(1/3) F, theta the mean of J over the element, (8.13); C3D8I's
  !> F = F_u + F_0 sum m_k (x) beta_k, F_0 that of the centre, (8.15).
  pure function gradients_of_law(element, modes) result(h)
    type(finite_element_t), intent(in) :: element !! of C3D8B det F > 0
    real(wp), intent(in) :: modes(3, 3) !! as of finite_force
    real(wp) :: h(3, 3, 8)              !! [-]
    real(wp) :: growth(8), b(8), m(3, 3)
    integer :: g, i

    h = element%h
    select case (element%kind)
    case (kind_c3d8)
    case (kind_c3d8i)
      do g = 1, 8
        m = mode_part(element, modes, g)
        h(:, :, g) = h(:, :, g) + m + matmul(element%h_0, m)
      end do
    case (kind_c3d8b)
      call find_dilatation(element, growth, b)
      do g = 1, 8
        h(:, :, g) = b(g)*h(:, :, g)
        do i = 1, 3
          ! b - 1 without the loss of its digits: b^3 - 1 is known.
          h(i, i, g) = h(i, i, g) + (mean_of(element, growth) - growth(g))/(1.0_wp + growth(g))/ &
            (b(g)**2 + b(g) + 1.0_wp)
        end do
      end do
    case default
      h = undefined
    end select
  end function gradients_of_law

  !> sum m_k (x) beta_k at a Gauss point.
  pure function mode_part(element, modes, g) result(m)
    type(finite_element_t), intent(in) :: element !! C3D8I
    real(wp), intent(in) :: modes(3, 3)
    integer, intent(in) :: g
    real(wp) :: m(3, 3) !! [-]

    m = matmul(element%mode(:, :, g), transpose(modes))
  end function mode_part

  !> J - 1 at the Gauss points, and b = (theta/J)^(1/3).
  pure subroutine find_dilatation(element, growth, b)
    type(finite_element_t), intent(in) :: element
    real(wp), intent(out) :: growth(8), b(8)
    integer :: g

    do g = 1, 8
      growth(g) = growth_of(element%h(:, :, g))
    end do
    b = ((1.0_wp + mean_of(element, growth))/(1.0_wp + growth))**(1.0_wp/3.0_wp)
  end subroutine find_dilatation

  !> The mean over the element's volume.
  pure real(wp) function mean_of(element, values)
    type(finite_element_t), intent(in) :: element
    real(wp), intent(in) :: values(8)

    mean_of = dot_product(element%weight, values)/sum(element%weight)
  end function mean_of

  !> The first Piola-Kirchhoff stresses P at the Gauss points that belong to the element's energy:
  !> what it changes by as du/dX of the nodes does there. C3D8B: (8.14).
  pure function stresses_of(element, modes, law) result(stress)
    type(finite_element_t), intent(in) :: element !! det F > 0
    real(wp), intent(in) :: modes(3, 3) !! as of finite_force
    type(law_t), intent(in) :: law
    real(wp) :: stress(3, 3, 8)         !! [force/length^2]
    real(wp) :: h(3, 3, 8), growth(8), b(8), pressure(8), common
    integer :: g

    h = gradients_of_law(element, modes)
    do g = 1, 8
      stress(:, :, g) = finite_stress(law, h(:, :, g))
    end do
    if (element%kind /= kind_c3d8b) return
    call find_dilatation(element, growth, b)
    do g = 1, 8
      pressure(g) = sum(stress(:, :, g)*deformation_of(h(:, :, g))) ! P_b : F_b
    end do
    common = mean_of(element, pressure)/(3.0_wp*(1.0_wp + mean_of(element, growth)))
    do g = 1, 8
      stress(:, :, g) = b(g)*stress(:, :, g) + (common*(1.0_wp + growth(g)) - &
        pressure(g)/3.0_wp)*transpose(inverse(deformation_of(element%h(:, :, g))))
    end do
  end function stresses_of

  !> What the stresses do on the nodes: int P (g_a + M^T g_a0), M of the modes, g_a0 of the centre.
  pure function forces_on_nodes(element, modes, stress) result(f)
    type(finite_element_t), intent(in) :: element
    real(wp), intent(in) :: modes(3, 3)     !! as of finite_force
    real(wp), intent(in) :: stress(3, 3, 8) !! as of stresses_of [force/length^2]
    real(wp) :: f(3, 8)                     !! [force]
    real(wp) :: p(3, 3), of_centre(3, 3)
    integer :: g, a

    f = 0.0_wp
    of_centre = 0.0_wp
    do g = 1, 8
      p = element%weight(g)*stress(:, :, g)
      do a = 1, 8
        associate (d => element%gradient(:, a, g))
          f(:, a) = f(:, a) + p(:, 1)*d(1) + p(:, 2)*d(2) + p(:, 3)*d(3)
        end associate
      end do
      if (element%kind == kind_c3d8i) of_centre = of_centre + matmul(p, transpose(mode_part( &
        element, modes, g)))
    end do
    if (element%kind == kind_c3d8i) f = f + matmul(of_centre, element%at_centre)
  end function forces_on_nodes

  !> What the stresses do on the amplitudes of the modes: int P^T F_0 m_k.
  pure function forces_on_modes(element, stress) result(f)
    type(finite_element_t), intent(in) :: element !! C3D8I
    real(wp), intent(in) :: stress(3, 3, 8) !! as of stresses_of [force/length^2]
    real(wp) :: f(3, 3)                     !! component, mode [force]
    real(wp) :: back(3, 3)
    integer :: g

    f = 0.0_wp
    do g = 1, 8
      back = stress(:, :, g) + matmul(transpose(element%h_0), stress(:, :, g))
      f = f + element%weight(g)*matmul(transpose(back), element%mode(:, :, g))
    end do
  end function forces_on_modes

  !> The element's strain energy, int W dV.
  pure real(wp) function energy_of(element, modes, law) result(energy)
    type(finite_element_t), intent(in) :: element !! det F > 0
    real(wp), intent(in) :: modes(3, 3)  !! as of finite_force
    type(law_t), intent(in) :: law
    real(wp) :: h(3, 3, 8)
    integer :: g

    h = gradients_of_law(element, modes)
    energy = 0.0_wp
    do g = 1, 8
      energy = energy + element%weight(g)*finite_energy(law, h(:, :, g))
    end do
  end function energy_of

  !> Internal force of an element, and with incompatible modes theirs; det F > 0 is required of
  !> C3D8B.
  pure subroutine finite_force(kind, x, u, modes, law, f, of_modes)
    integer,  intent(in) :: kind             !! kind_c3d8 or its kin
    real(wp), intent(in) :: x(3, 8), u(3, 8) !! nodes and their displacements [length]
    real(wp), intent(in) :: modes(3, 3)
    !! beta: amplitudes of C3D8I's modes, component and mode; of no other kind [length]
    type(law_t), intent(in) :: law
    real(wp), intent(out) :: f(3, 8)         !! [force]
    real(wp), intent(out) :: of_modes(3, 3)  !! on the amplitudes, 0 of other kinds [force]
    type(finite_element_t) :: element
    real(wp) :: stress(3, 3, 8)

    call finite_element(kind, x, u, element)
    stress = stresses_of(element, modes, law)
    f = forces_on_nodes(element, modes, stress)
    of_modes = 0.0_wp
    if (kind == kind_c3d8i) of_modes = forces_on_modes(element, stress)
  end subroutine finite_force

end module finite_strain_mod
