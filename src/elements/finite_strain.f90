!> Internal forces of bricks at finite strain, of St Venant-Kirchhoff's material: the linear law
!> between Green's strain and the second Piola-Kirchhoff stress.
!>
!>     H = du/dX,   F = I + H,   E = sym H + H^T H/2,   S = lambda tr(E) I + 2 G E,   P = F S
!>
!> Displacement gradients H are used and not F where F would lose the digits of small strains.
!> Forces are those that a displacement of its nodes does work on, f_a = int P g_a, and are
!> objective. At small strain they are those of elements_mod. docs/theory.md (8.14) to (8.17).
module finite_strain_mod
  use kinds_mod, only: wp
  use mesh_mod, only: kind_c3d8i, kind_c3d8b
  use small_matrix_mod, only: determinant, inverse
  use brick8_mod, only: shape_gradients, centre_shape_gradients, centre_gradient, &
    displacement_gradients
  use c3d8i_mod, only: mode_gradients
  implicit none
  private

  public :: finite_force

contains

  !> Internal force of a brick, and with incompatible modes theirs; det F > 0 is required of C3D8B.
  pure subroutine finite_force(kind, x, u, modes, lambda, shear, f, of_modes)
    integer,  intent(in) :: kind             !! kind_c3d8 or its kin
    real(wp), intent(in) :: x(3, 8), u(3, 8) !! nodes and their displacements [length]
    real(wp), intent(in) :: modes(3, 3)
    !! amplitudes of C3D8I's modes: component, mode; of no other kind [length]
    real(wp), intent(in) :: lambda, shear    !! Lame's constants [force/length^2]
    real(wp), intent(out) :: f(3, 8)         !! [force]
    real(wp), intent(out) :: of_modes(3, 3)  !! on the amplitudes, 0 of other kinds [force]
    real(wp) :: gradient(3, 8, 8), weight(8), inverse_jacobian(3, 3, 8), h(3, 3, 8)
    real(wp) :: stress(3, 3, 8)
    integer :: g

    if (kind == kind_c3d8i) then
      call force_with_modes(x, u, modes, lambda, shear, f, of_modes)
      return
    end if
    of_modes = 0.0_wp
    call shape_gradients(x, gradient, weight, inverse_jacobian)
    h = displacement_gradients(inverse_jacobian, u)
    if (kind == kind_c3d8b) then
      stress = mean_dilatation_stress(h, weight, lambda, shear)
    else
      do g = 1, 8
        stress(:, :, g) = first_piola(h(:, :, g), lambda, shear)
      end do
    end if
    f = force_of_stress(gradient, weight, stress)
  end subroutine finite_force

  !> C3D8I with transposed modes, F = F_u + F_0 sum m_k (x) beta_k, F_0 that of the centre: on the
  !> left, so that it turns with the brick. docs/theory.md (8.17).
  pure subroutine force_with_modes(x, u, beta, lambda, shear, f, of_modes)
    real(wp), intent(in) :: x(3, 8), u(3, 8), beta(3, 3), lambda, shear !! as of finite_force
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
      p(:, :, g) = first_piola(h(:, :, g) + m + matmul(h_0, m), lambda, shear)
      ! What P does on u through F_0, and on beta_k through F_0 m_k.
      of_centre = of_centre + weight(g)*matmul(p(:, :, g), transpose(m))
      back = p(:, :, g) + matmul(transpose(h_0), p(:, :, g))
      of_modes = of_modes + weight(g)*matmul(transpose(back), mode(:, :, g))
    end do
    f = force_of_stress(gradient, weight, p) + matmul(of_centre, centre_shape_gradients(x))
  end subroutine force_with_modes

  !> C3D8B: the stress that belongs to the energy of F_b = (theta/J)^(1/3) F, theta the mean of J
  !> over the brick. docs/theory.md (8.15), (8.16).
  pure function mean_dilatation_stress(h, weight, lambda, shear) result(stress)
    real(wp), intent(in) :: h(3, 3, 8), weight(8), lambda, shear
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
      p_b(:, :, g) = first_piola(h_b, lambda, shear)
      ! P_b : F_b
      pressure(g) = sum(p_b(:, :, g)*h_b) + p_b(1, 1, g) + p_b(2, 2, g) + p_b(3, 3, g)
      p_b(:, :, g) = b*p_b(:, :, g)
      back(:, :, g) = h(:, :, g)
      do i = 1, 3
        back(i, i, g) = back(i, i, g) + 1.0_wp
      end do
      back(:, :, g) = transpose(inverse(back(:, :, g)))
    end do
    associate (common => dot_product(weight, pressure)/(3.0_wp*(1.0_wp + mean)*sum(weight)))
      do g = 1, 8
        stress(:, :, g) = p_b(:, :, g) + (common*(1.0_wp + growth(g)) - pressure(g)/3.0_wp)* &
          back(:, :, g)
      end do
    end associate
  end function mean_dilatation_stress

  !> J - 1 = det(I + H) - 1.
  pure real(wp) function growth_of(h) result(growth)
    real(wp), intent(in) :: h(3, 3)

    growth = h(1, 1) + h(2, 2) + h(3, 3) + &
      (h(1, 1)*h(2, 2) - h(1, 2)*h(2, 1)) + (h(2, 2)*h(3, 3) - h(2, 3)*h(3, 2)) + &
      (h(1, 1)*h(3, 3) - h(1, 3)*h(3, 1)) + determinant(h)
  end function growth_of

  !> P = F S of a displacement gradient. docs/theory.md (8.14).
  pure function first_piola(h, lambda, shear) result(p)
    real(wp), intent(in) :: h(3, 3)       !! du_i/dX_j [-]
    real(wp), intent(in) :: lambda, shear !! Lame's constants [force/length^2]
    real(wp) :: p(3, 3)                   !! [force/length^2]
    real(wp) :: s(3, 3), trace
    integer :: i, j

    do j = 1, 3
      do i = 1, j
        s(i, j) = 0.5_wp*(h(i, j) + h(j, i) + dot_product(h(:, i), h(:, j)))
      end do
    end do
    trace = lambda*(s(1, 1) + s(2, 2) + s(3, 3))
    s(2, 1) = s(1, 2)
    s(3, 1) = s(1, 3)
    s(3, 2) = s(2, 3)
    s = 2.0_wp*shear*s
    do i = 1, 3
      s(i, i) = s(i, i) + trace
    end do
    do j = 1, 3
      p(:, j) = s(:, j) + h(:, 1)*s(1, j) + h(:, 2)*s(2, j) + h(:, 3)*s(3, j)
    end do
  end function first_piola

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
