!> C3D8I: the element with incompatible modes, for bending.
!>
!> Three parabolas that vanish at the nodes enrich each component of the displacement:
!>
!>     u = sum N_a u_a + sum M_i alpha_i,      M_1 = 1 - xi^2, M_2 = 1 - eta^2, M_3 = 1 - zeta^2
!>
!> The nine alpha belong to the element alone and are eliminated: their forces int sigma m_i vanish.
!> The gradients m_i use the Jacobian of the centre, so that their integral over the element is
!> zero, without which the patch test fails on distorted meshes. Source: E.L. Wilson et al. (1973),
!> R.L. Taylor, P.J. Beresford, E.L. Wilson (1976), docs/theory.md (8.4) to (8.7).
module c3d8i_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: determinant, inverse
  use elasticity_mod, only: elasticity_t, stress_of
  use hexahedron8_mod, only: shape_gradients, centre_jacobian, strain_of, mode_strain_of, &
    force_of, elastic_stiffness, xi_node, eta_node, zeta_node, gauss
  implicit none
  private

  public :: stiffness, relaxed_strain, mode_gradients, mode_amplitudes

contains

  !> Stiffness of the element, the incompatible modes condensed.
  pure function stiffness(x, elastic) result(k)
    real(wp), intent(in) :: x(3, 8)       !! nodes [length]
    type(elasticity_t), intent(in) :: elastic(:) !! one, or one a point
    real(wp) :: k(24, 24)                 !! node by node, x y z [force/length]
    real(wp) :: gradient(3, 8, 8), mode(3, 3, 8), all_gradients(3, 11, 8), weight(8)
    real(wp) :: full(33, 33)
    integer :: i, j

    call shape_gradients(x, gradient, weight)
    call mode_gradients(x, weight, mode)
    all_gradients(:, :3, :) = mode
    all_gradients(:, 4:, :) = gradient
    full = elastic_stiffness(11, 8, all_gradients, weight, elastic)
    do i = 1, 9
      do j = i + 1, 33
        full(i + 1:, j) = full(i + 1:, j) - full(i + 1:, i)*(full(i, j)/full(i, i))
      end do
    end do
    k = full(10:, 10:)
  end function stiffness

  !> The strain with the alpha for which the modes' forces vanish.
  pure function relaxed_strain(x, inverse_jacobian, weight, u, elastic) result(strain)
    real(wp), intent(in) :: x(3, 8), inverse_jacobian(3, 3, 8), weight(8), u(3, 8)
    type(elasticity_t), intent(in) :: elastic(:) !! one, or one a point
    real(wp) :: strain(6, 8)
    real(wp) :: mode(3, 3, 8)

    call mode_gradients(x, weight, mode)
    strain = strain_of(inverse_jacobian, u)
    strain = strain + mode_strain_of(3, mode, mode_amplitudes(mode, weight, strain, elastic))
  end function relaxed_strain

  !> The alpha for which the modes' forces vanish, docs/theory.md (8.6).
  pure function mode_amplitudes(mode, weight, strain, elastic) result(alpha)
    real(wp), intent(in) :: mode(3, 3, 8) !! as of mode_gradients [1/length]
    real(wp), intent(in) :: weight(8)     !! [length^3]
    real(wp), intent(in) :: strain(6, 8)  !! at the Gauss points, without the modes [-]
    type(elasticity_t), intent(in) :: elastic(:) !! one, or one a point
    real(wp) :: alpha(3, 3)               !! component, mode [length]
    real(wp) :: k(9, 9), b(9)

    b = -reshape(force_of(3, mode, weight, stress_of(strain, elastic)), [9])
    k = elastic_stiffness(3, 8, mode, weight, elastic)
    call solve_modes(k, b)
    alpha = reshape(b, [3, 3])
  end function mode_amplitudes

  !> m_i = (j_0/j) J_0^-T dM_i/dxi at the Gauss points, J_0 the Jacobian of the centre.
  pure subroutine mode_gradients(x, weight, mode)
    real(wp), intent(in)  :: x(3, 8)       !! nodes [length]
    real(wp), intent(in)  :: weight(8)     !! j, the Jacobian's determinants [length^3]
    real(wp), intent(out) :: mode(3, 3, 8) !! component, mode, point [1/length]
    real(wp) :: jacobian(3, 3), cofactors(3, 3)
    integer :: g

    jacobian = centre_jacobian(x)
    cofactors = determinant(jacobian)*transpose(inverse(jacobian))
    do g = 1, 8
      mode(:, 1, g) = (-2.0_wp*gauss*xi_node(g)/weight(g))*cofactors(:, 1)
      mode(:, 2, g) = (-2.0_wp*gauss*eta_node(g)/weight(g))*cofactors(:, 2)
      mode(:, 3, g) = (-2.0_wp*gauss*zeta_node(g)/weight(g))*cofactors(:, 3)
    end do
  end subroutine mode_gradients

  !> Solve k alpha = b by symmetric elimination; k is positive definite.
  pure subroutine solve_modes(k, alpha)
    real(wp), intent(inout) :: k(9, 9)   !! the modes' stiffness; its lower triangle is destroyed
    real(wp), intent(inout) :: alpha(9)  !! right-hand side in, solution out
    integer :: i, j

    do i = 1, 9
      do j = i + 1, 9
        k(j:, j) = k(j:, j) - k(j:, i)*(k(j, i)/k(i, i))
        alpha(j) = alpha(j) - k(j, i)/k(i, i)*alpha(i)
      end do
    end do
    do i = 9, 1, -1
      alpha(i) = (alpha(i) - dot_product(k(i + 1:, i), alpha(i + 1:)))/k(i, i)
    end do
  end subroutine solve_modes

end module c3d8i_mod
