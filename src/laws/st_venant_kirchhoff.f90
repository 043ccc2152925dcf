!> St Venant-Kirchhoff's law: linear elasticity between Green's strain and the second
!> Piola-Kirchhoff stress, what *ELASTIC means at finite strain.
!>
!>     H = du/dX,   F = I + H,   E = sym H + H^T H/2,   S = lambda tr(E) I + 2 G E,   P = F S
!>
!> docs/theory.md (8.14).
module st_venant_kirchhoff_mod
  use kinds_mod, only: wp
  implicit none
  private

  public :: first_piola

contains

  !> P of a displacement gradient. H is used and not F, which would lose the digits of small strains.
  pure function first_piola(h, constants) result(p)
    real(wp), intent(in) :: h(3, 3)       !! du_i/dX_j [-]
    real(wp), intent(in) :: constants(:)  !! lambda, G [force/length^2]
    real(wp) :: p(3, 3)                   !! [force/length^2]
    real(wp) :: s(3, 3), trace
    integer :: i, j

    do j = 1, 3
      do i = 1, j
        s(i, j) = 0.5_wp*(h(i, j) + h(j, i) + dot_product(h(:, i), h(:, j)))
      end do
    end do
    trace = constants(1)*(s(1, 1) + s(2, 2) + s(3, 3))
    s(2, 1) = s(1, 2)
    s(3, 1) = s(1, 3)
    s(3, 2) = s(2, 3)
    s = 2.0_wp*constants(2)*s
    do i = 1, 3
      s(i, i) = s(i, i) + trace
    end do
    do j = 1, 3
      p(:, j) = s(:, j) + h(:, 1)*s(1, j) + h(:, 2)*s(2, j) + h(:, 3)*s(3, j)
    end do
  end function first_piola

end module st_venant_kirchhoff_mod
