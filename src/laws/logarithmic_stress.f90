!> The stress that works on the logarithmic strain, and the energy of small changes of it.
!>
!> With F = R U and the first Piola-Kirchhoff stress P it is T = R^T tau R = U (F^-1 P) U, which is
!> Kirchhoff's stress, turned back with the body. Of an isotropic law dW = T : d(ln U). At small
!> strain T is the stress and ln U the strain. docs/theory.md (10.25).
module logarithmic_stress_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: determinant, inverse
  use dense_mod, only: symmetric_eigenvectors
  use strain_measures_mod, only: deformation_of, green_strain
  use elasticity_mod, only: complementary_energy
  use material_law_mod, only: law_t, finite_stress, finite_tangent
  implicit none
  private

  public :: logarithmic_stress, energy_of_change

  !> U = sum l_i v_i (x) v_i.
  type :: stretches_t
    real(wp) :: strain(3)  !! l_i - 1 [-]
    real(wp) :: axis(3, 3) !! columns v_i
  end type stretches_t

contains

  !> The principal stretches of a displacement gradient.
  type(stretches_t) function stretches_of(h) result(of)
    real(wp), intent(in) :: h(3, 3) !! det(I + H) > 0 [-]
    logical :: ok

    of%axis = 2.0_wp*green_strain(h)
    ! What is finite has eigenvalues: LAPACK's iteration on three rows always converges.
    call symmetric_eigenvectors(of%axis, of%strain, ok)
    of%strain = of%strain/(1.0_wp + sqrt(1.0_wp + of%strain))
  end function stretches_of

  !> T = U (F^-1 P) U.
  function logarithmic_stress(h, p) result(t)
    real(wp), intent(in) :: h(3, 3) !! det(I + H) > 0 [-]
    real(wp), intent(in) :: p(3, 3) !! first Piola-Kirchhoff [force/length^2]
    real(wp) :: t(3, 3)             !! [force/length^2]
    type(stretches_t) :: of
    real(wp) :: u(3, 3)
    integer :: i

    of = stretches_of(h)
    u = deformation_of(matmul(of%axis*spread(of%strain, 1, 3), transpose(of%axis)))
    t = matmul(u, matmul(matmul(inverse(deformation_of(h)), p), u))
    do i = 1, 3
      t(i, :i) = 0.5_wp*(t(i, :i) + t(:i, i))
      t(:i, i) = t(i, :i)
    end do
  end function logarithmic_stress

  !> Twice the energy of a small change of T, dT : (dT/d ln U)^-1 : dT. Where the law has no
  !> positive stiffness against ln U, or is not isotropic, that of small strain takes its place.
  function energy_of_change(law, h, change) result(energy)
    type(law_t), intent(in) :: law
    real(wp), intent(in) :: h(3, 3)      !! of which the tangent is, det(I + H) > 0 [-]
    real(wp), intent(in) :: change(3, 3) !! of T, symmetric [force/length^2]
    real(wp) :: energy                   !! [energy/length^3]
    real(wp), parameter :: equal = 1.0e-3_wp
    !! of two logarithmic strains: then their quotient of differences is a derivative, to 1e-7 [-]
    real(wp), dimension(3, 3) :: stretched, p, stiffness, principal
    real(wp) :: a(3, 3, 3, 3), stretch(3), t(3), twice_shear(3), apart
    type(stretches_t) :: of
    integer :: i, j, k

    if (.not. law%elastic%is_isotropic) then
      energy = energy_at_small_strain()
      return
    end if
    of = stretches_of(h)
    principal = matmul(transpose(of%axis), matmul(change, of%axis))
    stretched = 0.0_wp
    do i = 1, 3
      stretched(i, i) = of%strain(i)
    end do
    p = finite_stress(law, stretched)
    a = finite_tangent(law, stretched)
    stretch = 1.0_wp + of%strain
    do i = 1, 3
      t(i) = stretch(i)*p(i, i)
      do j = 1, 3
        stiffness(i, j) = stretch(i)*a(i, i, j, j)*stretch(j)
      end do
      stiffness(i, i) = stiffness(i, i) + t(i)
    end do
    do k = 1, 3
      i = 1 + mod(k, 3)
      j = 1 + mod(i, 3)
      apart = log(1.0_wp + (of%strain(i) - of%strain(j))/stretch(j))
      if (abs(apart) < equal) then
        twice_shear(k) = 0.5_wp*(stiffness(i, i) + stiffness(j, j)) - stiffness(i, j)
      else
        twice_shear(k) = (t(i) - t(j))/apart
      end if
    end do
    if (stiffness(1, 1) > 0.0_wp .and. stiffness(1, 1)*stiffness(2, 2) > stiffness(1, 2)**2 .and. &
      determinant(stiffness) > 0.0_wp .and. all(twice_shear > 0.0_wp)) then
      t = [principal(1, 1), principal(2, 2), principal(3, 3)]
      energy = dot_product(t, matmul(inverse(stiffness), t)) + 2.0_wp*sum([principal(2, 3), &
        principal(3, 1), principal(1, 2)]**2/twice_shear)
    else
      energy = energy_at_small_strain()
    end if

  contains

    real(wp) function energy_at_small_strain()
      energy_at_small_strain = complementary_energy(reshape([change(1, 1), change(2, 2), &
        change(3, 3), change(1, 2), change(2, 3), change(1, 3)], [6, 1]), [1.0_wp], [law%elastic])
    end function energy_at_small_strain

  end function energy_of_change

end module logarithmic_stress_mod
