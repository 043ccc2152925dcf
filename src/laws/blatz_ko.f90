!> Blatz and Ko's law of foam rubber, which *HYPERFOAM is for N = 1, alpha = -2, nu = 0.25:
!>
!>     W = mu/2 (tr(C^-1) + 2 J - 5),      lambda = G = mu at small strain
!>
!> docs/theory.md (8.18).
module blatz_ko_mod
  use kinds_mod, only: wp
  use elasticity_mod, only: elasticity_t
  use small_matrix_mod, only: determinant, inverse
  use strain_measures_mod, only: deformation_of, growth_of
  implicit none
  private

  public :: first_piola, energy, tangent, elastic_part

contains

  !> P = mu (J I - (F F^T)^-1) F^-T. With c = F F^T - I the bracket is (J - 1) I + (I + c)^-1 c.
  !> All from H = F - I, so that small strains lose no digits.
  pure function first_piola(h, constants) result(p)
    real(wp), intent(in) :: h(3, 3)       !! du_i/dX_j [-]
    real(wp), intent(in) :: constants(:)  !! mu [force/length^2]
    real(wp) :: p(3, 3)                   !! [force/length^2]
    real(wp) :: tau(3, 3), growth
    integer :: i

    tau = lost_of(h + transpose(h) + matmul(h, transpose(h)))
    growth = growth_of(h)
    do i = 1, 3
      tau(i, i) = tau(i, i) + growth
    end do
    p = constants(1)*matmul(tau, transpose(inverse(deformation_of(h))))
  end function first_piola

  !> W. With k = I - C^-1, of invariants i1, i2 and i3, J^-2 = 1 - s and s = i1 - i2 + i3:
  !>
  !>     tr(C^-1) + 2 J - 5 = s (2 J + 1) (J - 1)/(J + 1) - i2 + i3
  !>
  !> whose terms are of the second order in the strains.
  pure real(wp) function energy(h, constants) result(w)
    real(wp), intent(in) :: h(3, 3)       !! du_i/dX_j [-]
    real(wp), intent(in) :: constants(:)  !! mu [force/length^2]
    real(wp) :: k(3, 3), trace, second, third, growth

    k = lost_of(h + transpose(h) + matmul(transpose(h), h))
    trace = k(1, 1) + k(2, 2) + k(3, 3)
    second = 0.5_wp*(trace**2 - sum(k*transpose(k)))
    third = determinant(k)
    growth = growth_of(h)
    w = 0.5_wp*constants(1)*((trace - second + third)*(3.0_wp + 2.0_wp*growth)*growth/ &
      (2.0_wp + growth) - second + third)
  end function energy

  !> I - (I + c)^-1.
  pure function lost_of(c) result(lost)
    real(wp), intent(in) :: c(3, 3) !! symmetric [-]
    real(wp) :: lost(3, 3)          !! [-]

    lost = matmul(inverse(deformation_of(c)), c)
  end function lost_of

  !> What P = mu (J B - B B^T B) changes by as F does, with B = F^-T, whose change is -B dF^T B.
  pure function tangent(h, constants) result(a)
    real(wp), intent(in) :: h(3, 3)       !! du_i/dX_j [-]
    real(wp), intent(in) :: constants(:)  !! mu [force/length^2]
    real(wp) :: a(3, 3, 3, 3)             !! dP_ij/dF_kl: (i,j,k,l) [force/length^2]
    real(wp), dimension(3, 3) :: b, left, right, both
    real(wp) :: jacobian
    integer :: i, k, l

    b = transpose(inverse(deformation_of(h)))
    left = matmul(b, transpose(b))
    right = matmul(transpose(b), b)
    both = matmul(left, b)
    jacobian = 1.0_wp + growth_of(h)
    do l = 1, 3
      do k = 1, 3
        do i = 1, 3
          a(i, :, k, l) = jacobian*(b(k, l)*b(i, :) - b(i, l)*b(k, :)) + b(i, l)*both(k, :) + &
            left(i, k)*right(l, :) + both(i, l)*b(k, :)
        end do
      end do
    end do
    a = constants(1)*a
  end function tangent

  !> The law at small strain.
  pure type(elasticity_t) function elastic_part(constants) result(elastic)
    real(wp), intent(in) :: constants(:)  !! mu [force/length^2]

    elastic%shear = constants(1)
    elastic%lambda = constants(1)
  end function elastic_part

end module blatz_ko_mod
