!> St Venant-Kirchhoff's law: linear elasticity between Green's strain and the second
!> Piola-Kirchhoff stress, what *ELASTIC means at finite strain.
!>
!>     H = du/dX,   F = I + H,   E = sym H + H^T H/2,   S = lambda tr(E) I + 2 G E,   P = F S
!>
!> docs/theory.md (8.12).
module st_venant_kirchhoff_mod
  use kinds_mod, only: wp
  use strain_measures_mod, only: green_strain, deformation_of
  implicit none
  private

  public :: first_piola, energy, tangent, usual_from, usual_to, beyond_usual

  real(wp), parameter :: usual_from = 0.9_wp, usual_to = 1.1_wp
  !! stretches beyond which forces differ by a fifth from those of Cauchy's stress over logarithmic
  !! strain, with the same constants [-]
  character(*), parameter :: beyond_usual = "*ELASTIC is St Venant-Kirchhoff's law with "// &
    "NLGEOM, as in CalculiX; forces of Abaqus's *ELASTIC differ by a fifth and more"

contains

  !> P of a displacement gradient. H is used and not F, which would lose the digits of small
  !> strains.
  pure function first_piola(h, constants) result(p)
    real(wp), intent(in) :: h(3, 3)       !! du_i/dX_j [-]
    real(wp), intent(in) :: constants(:)  !! lambda, G [force/length^2]
    real(wp) :: p(3, 3)                   !! [force/length^2]
    real(wp) :: s(3, 3)
    integer :: j

    s = second_piola(h, constants)
    do j = 1, 3
      p(:, j) = s(:, j) + h(:, 1)*s(1, j) + h(:, 2)*s(2, j) + h(:, 3)*s(3, j)
    end do
  end function first_piola

  !> S = lambda tr(E) I + 2 G E.
  pure function second_piola(h, constants) result(s)
    real(wp), intent(in) :: h(3, 3)       !! du_i/dX_j [-]
    real(wp), intent(in) :: constants(:)  !! lambda, G [force/length^2]
    real(wp) :: s(3, 3)                   !! [force/length^2]
    real(wp) :: trace
    integer :: i

    s = green_strain(h)
    trace = constants(1)*(s(1, 1) + s(2, 2) + s(3, 3))
    s = 2.0_wp*constants(2)*s
    do i = 1, 3
      s(i, i) = s(i, i) + trace
    end do
  end function second_piola

  !> W = lambda tr(E)^2/2 + G E : E.
  pure real(wp) function energy(h, constants) result(w)
    real(wp), intent(in) :: h(3, 3)       !! du_i/dX_j [-]
    real(wp), intent(in) :: constants(:)  !! lambda, G [force/length^2]
    real(wp) :: e(3, 3)

    e = green_strain(h)
    w = 0.5_wp*constants(1)*(e(1, 1) + e(2, 2) + e(3, 3))**2 + constants(2)*sum(e**2)
  end function energy

  !> What P changes by as F does: dP = dF S + F (lambda (F : dF) I + G (F^T dF + dF^T F)).
  pure function tangent(h, constants) result(a)
    real(wp), intent(in) :: h(3, 3)       !! du_i/dX_j [-]
    real(wp), intent(in) :: constants(:)  !! lambda, G [force/length^2]
    real(wp) :: a(3, 3, 3, 3)             !! dP_ij/dF_kl: (i,j,k,l) [force/length^2]
    real(wp) :: f(3, 3), s(3, 3), change(3, 3)
    integer :: i, k, l

    f = deformation_of(h)
    s = second_piola(h, constants)
    do l = 1, 3
      do k = 1, 3
        ! F^T dF of dF = e_k (x) e_l.
        change = 0.0_wp
        change(:, l) = f(k, :)
        change = constants(2)*(change + transpose(change))
        do i = 1, 3
          change(i, i) = change(i, i) + constants(1)*f(k, l)
        end do
        a(:, :, k, l) = matmul(f, change)
        a(k, :, k, l) = a(k, :, k, l) + s(l, :)
      end do
    end do
  end function tangent

end module st_venant_kirchhoff_mod
