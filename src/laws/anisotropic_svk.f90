!> St Venant-Kirchhoff's law of a body that is not isotropic: linear elasticity between Green's
!> strain about the undeformed axes and the second Piola-Kirchhoff stress.
!>
!>     H = du/dX,   F = I + H,   E = sym H + H^T H/2,   S = C : E,   P = F S
!>
!> docs/theory.md (8.12), (8.50).
module anisotropic_svk_mod
  use kinds_mod, only: wp
  use elasticity_mod, only: elasticity_t
  use strain_measures_mod, only: green_strain, deformation_of
  implicit none
  private

  public :: first_piola, energy, tangent, constants_of

  integer, parameter :: number(3, 3) = reshape([1, 4, 6, 4, 2, 5, 6, 5, 3], [3, 3])
  !! of a component, as stresses are ordered

contains

  !> The 21 constants: the upper triangle of C, column by column.
  pure function constants_of(elastic) result(constants)
    type(elasticity_t), intent(in) :: elastic !! not isotropic
    real(wp) :: constants(21)                 !! [force/length^2]
    integer :: j

    do j = 1, 6
      constants(j*(j - 1)/2 + 1:j*(j + 1)/2) = elastic%c(:j, j)
    end do
  end function constants_of

  !> P of a displacement gradient.
  pure function first_piola(h, constants) result(p)
    real(wp), intent(in) :: h(3, 3)       !! du_i/dX_j [-]
    real(wp), intent(in) :: constants(:)  !! as of constants_of [force/length^2]
    real(wp) :: p(3, 3)                   !! [force/length^2]
    real(wp) :: s(3, 3)

    s = stress_of(green_strain(h), constants)
    p = s + matmul(h, s)
  end function first_piola

  !> S = C : E.
  pure function stress_of(e, constants) result(s)
    real(wp), intent(in) :: e(3, 3)       !! symmetric [-]
    real(wp), intent(in) :: constants(:)  !! as of constants_of [force/length^2]
    real(wp) :: s(3, 3)                   !! [force/length^2]
    real(wp) :: strain(6), stress(6)
    integer :: i, j

    strain = [e(1, 1), e(2, 2), e(3, 3), 2.0_wp*e(1, 2), 2.0_wp*e(2, 3), 2.0_wp*e(1, 3)]
    stress = 0.0_wp
    do j = 1, 6
      associate (c => constants(j*(j - 1)/2 + 1:j*(j + 1)/2))
        do i = 1, j - 1
          stress(i) = stress(i) + c(i)*strain(j)
          stress(j) = stress(j) + c(i)*strain(i)
        end do
        stress(j) = stress(j) + c(j)*strain(j)
      end associate
    end do
    do j = 1, 3
      s(:, j) = stress(number(:, j))
    end do
  end function stress_of

  !> W = E : C : E/2.
  pure real(wp) function energy(h, constants) result(w)
    real(wp), intent(in) :: h(3, 3)       !! du_i/dX_j [-]
    real(wp), intent(in) :: constants(:)  !! as of constants_of [force/length^2]
    real(wp) :: e(3, 3)

    e = green_strain(h)
    w = 0.5_wp*sum(e*stress_of(e, constants))
  end function energy

  !> What P changes by as F does: dP = dF S + F (C : sym(F^T dF)).
  pure function tangent(h, constants) result(a)
    real(wp), intent(in) :: h(3, 3)       !! du_i/dX_j [-]
    real(wp), intent(in) :: constants(:)  !! as of constants_of [force/length^2]
    real(wp) :: a(3, 3, 3, 3)             !! dP_ij/dF_kl: (i,j,k,l) [force/length^2]
    real(wp) :: f(3, 3), s(3, 3), change(3, 3)
    integer :: k, l

    f = deformation_of(h)
    s = stress_of(green_strain(h), constants)
    do l = 1, 3
      do k = 1, 3
        ! F^T dF of dF = e_k (x) e_l.
        change = 0.0_wp
        change(:, l) = f(k, :)
        change = 0.5_wp*(change + transpose(change))
        a(:, :, k, l) = matmul(f, stress_of(change, constants))
        a(k, :, k, l) = a(k, :, k, l) + s(l, :)
      end do
    end do
  end function tangent

end module anisotropic_svk_mod
