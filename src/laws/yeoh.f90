!> Yeoh's law, as Abaqus has it with D2 = D3 = 0:
!>
!>     W = C10 x + C20 x^2 + C30 x^3 + (J - 1)^2/D1,      x = I1 J^(-2/3) - 3
!>
!> A neo-Hookean law at each deformation, whose C10 is dW/dx there. docs/theory.md (8.44).
module yeoh_mod
  use kinds_mod, only: wp
  use mooney_rivlin_mod, only: neo_hookean_stress => first_piola, &
    neo_hookean_energy => energy, neo_hookean_tangent => tangent
  implicit none
  private

  public :: first_piola, energy, tangent

  real(wp), parameter :: no_bulk = huge(1.0_wp) !! D1 of no bulk modulus

contains

  !> P.
  pure function first_piola(h, constants) result(p)
    real(wp), intent(in) :: h(3, 3)       !! du_i/dX_j [-]
    real(wp), intent(in) :: constants(:)
    !! C10, C20, C30 [force/length^2], D1 [length^2/force]
    real(wp) :: p(3, 3)                   !! [force/length^2]

    p = neo_hookean_stress(h, neo_hookean_at(stretching(h), constants))
  end function first_piola

  !> W.
  pure real(wp) function energy(h, constants) result(w)
    real(wp), intent(in) :: h(3, 3)       !! du_i/dX_j [-]
    real(wp), intent(in) :: constants(:)
    !! C10, C20, C30 [force/length^2], D1 [length^2/force]
    real(wp) :: x

    x = stretching(h)
    w = neo_hookean_energy(h, neo_hookean_at(0.0_wp, constants)) + &
      (constants(2) + constants(3)*x)*x**2
  end function energy

  !> What P changes by as F does: with C10 kept, and by C10, d2W/dx2 dx/dF (x) dx/dF.
  pure function tangent(h, constants) result(a)
    real(wp), intent(in) :: h(3, 3)       !! du_i/dX_j [-]
    real(wp), intent(in) :: constants(:)
    !! C10, C20, C30 [force/length^2], D1 [length^2/force]
    real(wp) :: a(3, 3, 3, 3)             !! dP_ij/dF_kl: (i,j,k,l) [force/length^2]
    real(wp) :: x, slope(3, 3)
    integer :: k, l

    x = stretching(h)
    a = neo_hookean_tangent(h, neo_hookean_at(x, constants))
    slope = neo_hookean_stress(h, [1.0_wp, 0.0_wp, no_bulk])
    do l = 1, 3
      do k = 1, 3
        a(:, :, k, l) = a(:, :, k, l) + ((2.0_wp*constants(2) + 6.0_wp*constants(3)*x)* &
          slope(k, l))*slope
      end do
    end do
  end function tangent

  !> C10, C01 and D1 of the neo-Hookean law that has its stress at a stretching.
  pure function neo_hookean_at(x, constants) result(of_law)
    real(wp), intent(in) :: x             !! >= 0 [-]
    real(wp), intent(in) :: constants(:)
    !! C10, C20, C30 [force/length^2], D1 [length^2/force]
    real(wp) :: of_law(3)

    of_law = [constants(1) + (2.0_wp*constants(2) + 3.0_wp*constants(3)*x)*x, 0.0_wp, constants(4)]
  end function neo_hookean_at

  !> x of H = du/dX.
  pure real(wp) function stretching(h) result(x)
    real(wp), intent(in) :: h(3, 3) !! [-]

    x = neo_hookean_energy(h, [1.0_wp, 0.0_wp, no_bulk])
  end function stretching

end module yeoh_mod
