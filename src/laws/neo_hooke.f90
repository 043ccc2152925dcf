!> Compressible neo-Hookean law, as Abaqus has it:
!>
!>     W = C10 (I1 J^(-2/3) - 3) + (J - 1)^2/D1,      2 C10 = G,   2/D1 = K
!>
!> docs/theory.md (8.20), (8.21).
module neo_hooke_mod
  use kinds_mod, only: wp
  use elasticity_mod, only: elasticity_t
  use small_matrix_mod, only: determinant, inverse
  use strain_measures_mod, only: deformation_of, growth_of
  implicit none
  private

  public :: first_piola, energy, tangent, elastic_part

contains

  !> P = tau F^-T, tau = 2 C10 J^(-2/3) dev(b) + (2/D1) (J - 1) J I. All from H = F - I, so that
  !> small strains lose no digits.
  pure function first_piola(h, constants) result(p)
    real(wp), intent(in) :: h(3, 3)       !! du_i/dX_j [-]
    real(wp), intent(in) :: constants(:)  !! C10 [force/length^2], D1 [length^2/force]
    real(wp) :: p(3, 3)                   !! [force/length^2]
    real(wp) :: tau(3, 3), mean, growth
    integer :: i

    ! b - I has b's deviator.
    tau = h + transpose(h) + matmul(h, transpose(h))
    mean = (tau(1, 1) + tau(2, 2) + tau(3, 3))/3.0_wp
    growth = growth_of(h)
    do i = 1, 3
      tau(i, i) = tau(i, i) - mean
    end do
    tau = (2.0_wp*constants(1)*(1.0_wp + growth)**(-2.0_wp/3.0_wp))*tau
    do i = 1, 3
      tau(i, i) = tau(i, i) + 2.0_wp/constants(2)*growth*(1.0_wp + growth)
    end do
    p = matmul(tau, transpose(inverse(deformation_of(h))))
  end function first_piola

  !> W. I1 J^(-2/3) - 3 is 3 ((1 - x)^(-1/3) - 1), x of the second order in the strains: with
  !> C = m I + D, m a third of its trace, J^2 = m^3 (1 - x) and x = D:D/(2 m^2) - det(D)/m^3.
  pure real(wp) function energy(h, constants) result(w)
    real(wp), intent(in) :: h(3, 3)       !! du_i/dX_j [-]
    real(wp), intent(in) :: constants(:)  !! C10 [force/length^2], D1 [length^2/force]
    real(wp) :: d(3, 3), m, x, root, growth
    integer :: i

    d = h + transpose(h) + matmul(transpose(h), h)
    m = (d(1, 1) + d(2, 2) + d(3, 3))/3.0_wp
    do i = 1, 3
      d(i, i) = d(i, i) - m
    end do
    m = 1.0_wp + m
    x = sum(d**2)/(2.0_wp*m**2) - determinant(d)/m**3
    growth = growth_of(h)
    root = (1.0_wp - x)**(1.0_wp/3.0_wp)
    w = constants(1)*3.0_wp*x/((1.0_wp + root + root**2)*root) + growth**2/constants(2)
  end function energy

  !> What P changes by as F does. With B = F^-T, whose change is -B dF^T B,
  !>
  !>     P = 2 C10 J^(-2/3) (F - I1/3 B) + (2/D1) (J - 1) J B
  pure function tangent(h, constants) result(a)
    real(wp), intent(in) :: h(3, 3)       !! du_i/dX_j [-]
    real(wp), intent(in) :: constants(:)  !! C10 [force/length^2], D1 [length^2/force]
    real(wp) :: a(3, 3, 3, 3)             !! dP_ij/dF_kl: (i,j,k,l) [force/length^2]
    real(wp) :: f(3, 3), b(3, 3), turned(3, 3), third, jacobian, shear, bulk
    integer :: i, k, l

    f = deformation_of(h)
    b = transpose(inverse(f))
    jacobian = 1.0_wp + growth_of(h)
    third = sum(f**2)/3.0_wp
    shear = 2.0_wp*constants(1)*jacobian**(-2.0_wp/3.0_wp)
    bulk = 2.0_wp/constants(2)*jacobian
    do l = 1, 3
      do k = 1, 3
        ! B dF^T B of dF = e_k (x) e_l.
        do i = 1, 3
          turned(i, :) = b(i, l)*b(k, :)
        end do
        a(:, :, k, l) = shear*(third*turned - 2.0_wp/3.0_wp*(b(k, l)*(f - third*b) + f(k, l)*b)) + &
          bulk*((2.0_wp*jacobian - 1.0_wp)*b(k, l)*b - (jacobian - 1.0_wp)*turned)
        a(k, l, k, l) = a(k, l, k, l) + shear
      end do
    end do
  end function tangent

  !> The law at small strain.
  pure type(elasticity_t) function elastic_part(constants) result(elastic)
    real(wp), intent(in) :: constants(:)  !! C10 [force/length^2], D1 [length^2/force]

    elastic%shear = 2.0_wp*constants(1)
    elastic%lambda = 2.0_wp/constants(2) - 2.0_wp*elastic%shear/3.0_wp
  end function elastic_part

end module neo_hooke_mod
