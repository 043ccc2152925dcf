!> C3D8B: the element with the mean dilatation (B-bar), for nearly incompressible material.
!>
!> The dilatation at every Gauss point is replaced by its average over the element,
!>
!>     tr(eps) -> sum u_a . mean_a,      mean_a = int g_a dV / V
!>
!> so that an element has one volume to keep, not eight. Source: J.C. Nagtegaal, D.M. Parks, J.R.
!> Rice (1974), T.J.R. Hughes (1980), docs/theory.md (8.8) to (8.10).
module c3d8b_mod
  use kinds_mod, only: wp
  use elasticity_mod, only: elasticity_t, bulk_modulus, matrix_of
  use hexahedron8_mod, only: shape_gradients, strain_of, force_of, elastic_stiffness, strain_matrix
  implicit none
  private

  public :: stiffness, mean_dilatation_force, mean_dilatation_strain

contains

  !> Stiffness of the element: deviatoric part as in C3D8, volumetric part of the mean dilatation.
  !> Where the material is not isotropic the two go together.
  pure function stiffness(x, elastic) result(k)
    real(wp), intent(in) :: x(3, 8)       !! nodes [length]
    type(elasticity_t), intent(in) :: elastic(:) !! one, or one a point
    real(wp) :: k(24, 24)                 !! node by node, x y z [force/length]
    real(wp) :: gradient(3, 8, 8), weight(8), mean(24), bulk, c(6, 6), strain(6, 24)
    integer :: g, j

    call shape_gradients(x, gradient, weight)
    mean = reshape(mean_gradient(gradient, weight), [24])
    if (.not. elastic(1)%is_isotropic) then
      k = 0.0_wp
      do g = 1, 8
        strain = strain_matrix(8, gradient(:, :, g))
        strain(:3, :) = strain(:3, :) + spread((mean - reshape(gradient(:, :, g), [24]))/3.0_wp, &
          1, 3)
        c = weight(g)*matrix_of(elastic(min(g, size(elastic))))
        k = k + matmul(transpose(strain), matmul(c, strain))
      end do
      return
    end if
    ! With lambda = -2 G/3 the isotropic material resists the deviator alone.
    k = elastic_stiffness(8, 8, gradient, weight, [elasticity_t( &
      -2.0_wp*elastic(1)%shear/3.0_wp, elastic(1)%shear)])
    bulk = bulk_modulus(elastic(1))*sum(weight)
    do j = 1, 24
      k(:, j) = k(:, j) + bulk*mean(j)*mean
    end do
  end function stiffness

  !> The forces of stresses at the Gauss points: their mean acts on the mean dilatation.
  pure function mean_dilatation_force(gradient, weight, stress) result(f)
    real(wp), intent(in) :: gradient(3, 8, 8), weight(8)
    real(wp), intent(in) :: stress(6, 8) !! [force/length^2]
    real(wp) :: f(3, 8)                  !! [force]
    real(wp) :: deviator(6, 8), pressure(8)
    integer :: g

    deviator = stress
    do g = 1, 8
      pressure(g) = (stress(1, g) + stress(2, g) + stress(3, g))/3.0_wp
      deviator(:3, g) = stress(:3, g) - pressure(g)
    end do
    f = force_of(8, gradient, weight, deviator) + sum(weight*pressure)* &
      mean_gradient(gradient, weight)
  end function mean_dilatation_force

  !> Gradients of the shape functions averaged over the volume.
  pure function mean_gradient(gradient, weight) result(mean)
    real(wp), intent(in) :: gradient(3, 8, 8), weight(8)
    real(wp) :: mean(3, 8) !! [1/length]
    integer :: g

    mean = 0.0_wp
    do g = 1, 8
      mean = mean + weight(g)*gradient(:, :, g)
    end do
    mean = mean/sum(weight)
  end function mean_gradient

  !> C3D8's strain with the dilatation exchanged.
  pure function mean_dilatation_strain(inverse_jacobian, weight, u) result(strain)
    real(wp), intent(in) :: inverse_jacobian(3, 3, 8), weight(8), u(3, 8)
    real(wp) :: strain(6, 8)
    real(wp) :: dilatation(8), mean
    integer :: g

    strain = strain_of(inverse_jacobian, u)
    ! sum u_a . mean_a is the mean of the points' dilatations, which have lost no digits.
    dilatation = sum(strain(:3, :), dim=1)
    mean = dot_product(weight, dilatation)/sum(weight)
    do g = 1, 8
      strain(:3, g) = strain(:3, g) + (mean - dilatation(g))/3.0_wp
    end do
  end function mean_dilatation_strain

end module c3d8b_mod
