!> Internal forces of elements at finite strain, of the first Piola-Kirchhoff stress P of a law.
!>
!> Displacement gradients H = du/dX are used and not F = I + H, which would lose the digits of small
!> strains. Forces are those that a displacement of its nodes does work on, f_a = int P g_a, and are
!> objective. At small strain they are those of elements_mod. docs/theory.md (8.14) to (8.17).
module finite_strain_mod
  use kinds_mod, only: wp
  use strain_measures_mod, only: growth_of, deformation_of
  use material_law_mod, only: law_t, finite_stress
  use mesh_mod, only: kind_c3d8i, kind_c3d8b
  use small_matrix_mod, only: inverse
  use hexahedron8_mod, only: shape_gradients, centre_shape_gradients, centre_gradient, &
    displacement_gradients
  use c3d8i_mod, only: mode_gradients
  implicit none
  private

  public :: finite_force, force_of_stress

contains

  !> Internal force of an element, and with incompatible modes theirs; det F > 0 is required of
  !> C3D8B.
  pure subroutine finite_force(kind, x, u, modes, law, f, of_modes)
    integer,  intent(in) :: kind             !! kind_c3d8 or its kin
    real(wp), intent(in) :: x(3, 8), u(3, 8) !! nodes and their displacements [length]
    real(wp), intent(in) :: modes(3, 3)
    !! amplitudes of C3D8I's modes: component, mode; of no other kind [length]
    type(law_t), intent(in) :: law
    real(wp), intent(out) :: f(3, 8)         !! [force]
    real(wp), intent(out) :: of_modes(3, 3)  !! on the amplitudes, 0 of other kinds [force]
    real(wp) :: gradient(3, 8, 8), weight(8), inverse_jacobian(3, 3, 8), h(3, 3, 8)
    real(wp) :: stress(3, 3, 8)
    integer :: g

    if (kind == kind_c3d8i) then
      call force_with_modes(x, u, modes, law, f, of_modes)
      return
    end if
    of_modes = 0.0_wp
    call shape_gradients(x, gradient, weight, inverse_jacobian)
    h = displacement_gradients(inverse_jacobian, u)
    if (kind == kind_c3d8b) then
      stress = mean_dilatation_stress(h, weight, law)
    else
      do g = 1, 8
        stress(:, :, g) = finite_stress(law, h(:, :, g))
      end do
    end if
    f = force_of_stress(gradient, weight, stress)
  end subroutine finite_force

  !> C3D8I with transposed modes, F = F_u + F_0 sum m_k (x) beta_k, F_0 that of the centre: on the
  !> left, so that it turns with the element. docs/theory.md (8.17).
  pure subroutine force_with_modes(x, u, beta, law, f, of_modes)
    real(wp), intent(in) :: x(3, 8), u(3, 8), beta(3, 3) !! as of finite_force
    type(law_t), intent(in) :: law
    real(wp), intent(out) :: f(3, 8), of_modes(3, 3)
    real(wp) :: gradient(3, 8, 8), weight(8), inverse_jacobian(3, 3, 8), h(3, 3, 8), mode(3, 3, 8)
    real(wp) :: h_0(3, 3), m(3, 3), p(3, 3, 8), of_centre(3, 3), back(3, 3)
    integer :: g

    call shape_gradients(x, gradient, weight, inverse_jacobian)
    call mode_gradients(x, weight, mode)
    h = displacement_gradients(inverse_jacobian, u)
    h_0 = centre_gradient(x, u)
    of_centre = 0.0_wp
    of_modes = 0.0_wp
    do g = 1, 8
      m = matmul(mode(:, :, g), transpose(beta))
      p(:, :, g) = finite_stress(law, h(:, :, g) + m + matmul(h_0, m))
      ! What P does on u through F_0, and on beta_k through F_0 m_k.
      of_centre = of_centre + weight(g)*matmul(p(:, :, g), transpose(m))
      back = p(:, :, g) + matmul(transpose(h_0), p(:, :, g))
      of_modes = of_modes + weight(g)*matmul(transpose(back), mode(:, :, g))
    end do
    f = force_of_stress(gradient, weight, p) + matmul(of_centre, centre_shape_gradients(x))
  end subroutine force_with_modes

  !> C3D8B: the stress that belongs to the energy of F_b = (theta/J)^(1/3) F, theta the mean of J
  !> over the element. docs/theory.md (8.15), (8.16).
  pure function mean_dilatation_stress(h, weight, law) result(stress)
    real(wp), intent(in) :: h(3, 3, 8), weight(8)
    type(law_t), intent(in) :: law
    real(wp) :: stress(3, 3, 8)        !! P at the Gauss points [force/length^2]
    real(wp) :: growth(8), mean, b, h_b(3, 3), p_b(3, 3, 8), back(3, 3, 8), pressure(8)
    integer :: g, i

    do g = 1, 8
      growth(g) = growth_of(h(:, :, g))
    end do
    mean = dot_product(weight, growth)/sum(weight)
    do g = 1, 8
      b = ((1.0_wp + mean)/(1.0_wp + growth(g)))**(1.0_wp/3.0_wp)
      h_b = b*h(:, :, g)
      do i = 1, 3
        ! b - 1 without the loss of its digits: b^3 - 1 is known.
        h_b(i, i) = h_b(i, i) + (mean - growth(g))/(1.0_wp + growth(g))/(b**2 + b + 1.0_wp)
      end do
      p_b(:, :, g) = finite_stress(law, h_b)
      ! P_b : F_b
      pressure(g) = sum(p_b(:, :, g)*h_b) + p_b(1, 1, g) + p_b(2, 2, g) + p_b(3, 3, g)
      p_b(:, :, g) = b*p_b(:, :, g)
      back(:, :, g) = transpose(inverse(deformation_of(h(:, :, g))))
    end do
    associate (common => dot_product(weight, pressure)/(3.0_wp*(1.0_wp + mean)*sum(weight)))
      do g = 1, 8
        stress(:, :, g) = p_b(:, :, g) + (common*(1.0_wp + growth(g)) - pressure(g)/3.0_wp)* &
          back(:, :, g)
      end do
    end associate
  end function mean_dilatation_stress

  !> int P g_a.
  pure function force_of_stress(gradient, weight, stress) result(f)
    real(wp), intent(in) :: gradient(3, 8, 8) !! of the shape functions [1/length]
    real(wp), intent(in) :: weight(8)         !! [length^3]
    real(wp), intent(in) :: stress(3, 3, 8)   !! P at the Gauss points [force/length^2]
    real(wp) :: f(3, 8)                       !! [force]
    real(wp) :: p(3, 3)
    integer :: g, a

    f = 0.0_wp
    do g = 1, 8
      p = weight(g)*stress(:, :, g)
      do a = 1, 8
        f(:, a) = f(:, a) + p(:, 1)*gradient(1, a, g) + p(:, 2)*gradient(2, a, g) + &
          p(:, 3)*gradient(3, a, g)
      end do
    end do
  end function force_of_stress

end module finite_strain_mod
