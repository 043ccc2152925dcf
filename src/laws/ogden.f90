!> Ogden's law, as Abaqus has it with D2 = D3 = 0:
!>
!>     W = sum_p 2 mu_p/alpha_p^2 (sum_i L_i^alpha_p - 3) + (J - 1)^2/D1,      L_i = l_i J^(-1/3)
!>
!>     sum_p mu_p = G,   2/D1 = K
!>
!> with the principal stretches l_i. docs/theory.md (8.45), (8.46).
module ogden_mod
  use kinds_mod, only: wp
  use dense_mod, only: symmetric_eigenvectors
  use elasticity_mod, only: elasticity_t
  use strain_measures_mod, only: deformation_of, green_strain, growth_of
  implicit none
  private

  public :: first_piola, energy, tangent, elastic_part, last

  integer, parameter :: last = 7 !! constant: D1, behind those of three terms

  !> What the law needs of a deformation: C = sum (1 + 2 e_i) N_i (x) N_i.
  type :: stretches_t
    real(wp) :: axis(3, 3) !! columns N_i
    real(wp) :: strain(3)  !! e_i, of Green [-]
    real(wp) :: log(3)     !! ln L_i [-]
    real(wp) :: growth     !! J - 1 [-]
  end type stretches_t

contains

  !> P = F S, where S = sum t_i/l_i^2 N_i (x) N_i and t_i are Kirchhoff's principal stresses.
  pure function first_piola(h, constants) result(p)
    real(wp), intent(in) :: h(3, 3)       !! du_i/dX_j [-]
    real(wp), intent(in) :: constants(:)
    !! mu_p [force/length^2] and alpha_p [-] in turn, 0 where there are fewer; D1 [length^2/force]
    real(wp) :: p(3, 3)                   !! [force/length^2]
    type(stretches_t) :: of
    real(wp) :: stress(3)

    of = stretches_of(h)
    stress = kirchhoff(of, constants)/(1.0_wp + 2.0_wp*of%strain)
    p = matmul(deformation_of(h), matmul(of%axis*spread(stress, 1, 3), transpose(of%axis)))
  end function first_piola

  !> W. The logarithms of L_i add up to 0, so that what is linear in them is left out.
  pure real(wp) function energy(h, constants) result(w)
    real(wp), intent(in) :: h(3, 3)       !! du_i/dX_j [-]
    real(wp), intent(in) :: constants(:)
    !! mu_p [force/length^2] and alpha_p [-] in turn, 0 where there are fewer; D1 [length^2/force]
    type(stretches_t) :: of
    integer :: p

    of = stretches_of(h)
    w = of%growth**2/constants(last)
    do p = 1, last - 1, 2
      w = w + 2.0_wp*constants(p)*sum(of%log**2*beyond_linear(constants(p + 1)*of%log))
    end do
  end function energy

  !> dP/dF. Among the axes N_i a change of E changes S_ii by that of the stretches, and S_ij,
  !> i /= j, by (s_i - s_j)/(e_i - e_j) dE_ij, where s = t/l^2.
  pure function tangent(h, constants) result(a)
    real(wp), intent(in) :: h(3, 3)       !! du_i/dX_j [-]
    real(wp), intent(in) :: constants(:)
    !! mu_p [force/length^2] and alpha_p [-] in turn, 0 where there are fewer; D1 [length^2/force]
    real(wp) :: a(3, 3, 3, 3)             !! dP_ij/dF_kl: (i,j,k,l) [force/length^2]
    type(stretches_t) :: of
    real(wp) :: t(3), squared(3), slope(3, 3), shear(3, 3), s(3, 3), f(3, 3), along(3, 3)
    real(wp) :: strain(3, 3), stress(3, 3)
    integer :: i, j, k, l

    of = stretches_of(h)
    t = kirchhoff(of, constants)
    squared = 1.0_wp + 2.0_wp*of%strain
    slope = kirchhoff_slopes(of, constants)
    do j = 1, 3
      slope(:, j) = slope(:, j)/(squared*squared(j))
      slope(j, j) = slope(j, j) - 2.0_wp*t(j)/squared(j)**2
    end do
    shear = shear_slopes(of, t, constants)
    f = deformation_of(h)
    s = matmul(of%axis*spread(t/squared, 1, 3), transpose(of%axis))
    ! F in the axes of the undeformed body: column i is F N_i.
    along = matmul(f, of%axis)
    do l = 1, 3
      do k = 1, 3
        ! dE of dF = e_k (x) e_l, in the axes.
        do j = 1, 3
          do i = 1, 3
            strain(i, j) = 0.5_wp*(of%axis(l, i)*along(k, j) + along(k, i)*of%axis(l, j))
          end do
        end do
        stress = shear*strain
        do i = 1, 3
          stress(i, i) = slope(i, 1)*strain(1, 1) + slope(i, 2)*strain(2, 2) + &
            slope(i, 3)*strain(3, 3)
        end do
        a(:, :, k, l) = matmul(along, matmul(stress, transpose(of%axis)))
        a(k, :, k, l) = a(k, :, k, l) + s(l, :)
      end do
    end do
  end function tangent

  !> The law at small strain.
  pure type(elasticity_t) function elastic_part(constants) result(elastic)
    real(wp), intent(in) :: constants(:)
    !! mu_p [force/length^2] and alpha_p [-] in turn, 0 where there are fewer; D1 [length^2/force]

    elastic%shear = sum(constants(:last - 1:2))
    elastic%lambda = 2.0_wp/constants(last) - 2.0_wp*elastic%shear/3.0_wp
  end function elastic_part

  !> The principal stretches of a displacement gradient. Of E, so that small strains lose no digits.
  pure type(stretches_t) function stretches_of(h) result(of)
    real(wp), intent(in) :: h(3, 3) !! det(I + H) > 0 [-]
    logical :: ok

    of%axis = green_strain(h)
    ! What is finite has eigenvalues: LAPACK's iteration on three rows always converges.
    call symmetric_eigenvectors(of%axis, of%strain, ok)
    of%log = of%strain*log_ratio(2.0_wp*of%strain)
    of%log = of%log - sum(of%log)/3.0_wp
    of%growth = growth_of(h)
  end function stretches_of

  !> t_i = dW/d ln l_i = sum_p 2 mu_p/alpha_p (L_i^alpha_p - mean) + (2/D1) J (J - 1).
  pure function kirchhoff(of, constants) result(t)
    type(stretches_t), intent(in) :: of
    real(wp), intent(in) :: constants(:)
    real(wp) :: t(3) !! [force/length^2]
    real(wp) :: power(3)
    integer :: p

    t = 2.0_wp/constants(last)*of%growth*(1.0_wp + of%growth)
    do p = 1, last - 1, 2
      power = 2.0_wp*constants(p)*of%log*exp_ratio(constants(p + 1)*of%log)
      t = t + power - sum(power)/3.0_wp
    end do
  end function kirchhoff

  !> dt_i/d ln l_j.
  pure function kirchhoff_slopes(of, constants) result(slope)
    type(stretches_t), intent(in) :: of
    real(wp), intent(in) :: constants(:)
    real(wp) :: slope(3, 3) !! (i,j) [force/length^2]
    real(wp) :: power(3)
    integer :: p, i, j

    slope = 2.0_wp/constants(last)*(1.0_wp + of%growth)*(1.0_wp + 2.0_wp*of%growth)
    do p = 1, last - 1, 2
      power = 2.0_wp*constants(p)*exp(constants(p + 1)*of%log)
      do j = 1, 3
        do i = 1, 3
          slope(i, j) = slope(i, j) + (sum(power)/3.0_wp - power(i) - power(j))/3.0_wp
        end do
        slope(j, j) = slope(j, j) + power(j)
      end do
    end do
  end function kirchhoff_slopes

  !> (s_i - s_j)/(e_i - e_j), in a form that holds where stretches are alike: with
  !> x = l_i^2/l_j^2 - 1 it is
  !>
  !>     (sum_p 2 mu_p L_j^alpha_p ((1 + x)^(alpha_p/2) - 1)/(alpha_p x/2) - 2 t_j)/(l_i l_j)^2
  pure function shear_slopes(of, t, constants) result(slope)
    type(stretches_t), intent(in) :: of
    real(wp), intent(in) :: t(3) !! Kirchhoff's principal stresses [force/length^2]
    real(wp), intent(in) :: constants(:)
    real(wp) :: slope(3, 3) !! (i,j), 0 where i = j [force/length^2]
    real(wp) :: squared(3), ratio, part, x
    integer :: p, i, j

    squared = 1.0_wp + 2.0_wp*of%strain
    slope = 0.0_wp
    do j = 1, 3
      do i = 1, 3
        if (i == j) cycle
        x = 2.0_wp*(of%strain(i) - of%strain(j))/squared(j)
        ratio = log_ratio(x)
        part = 0.0_wp
        do p = 1, last - 1, 2
          associate (mu => constants(p), alpha => constants(p + 1))
            part = part + 2.0_wp*mu*exp(alpha*of%log(j))*ratio*exp_ratio(0.5_wp*alpha*x*ratio)
          end associate
        end do
        slope(i, j) = (part - 2.0_wp*t(j))/(squared(i)*squared(j))
      end do
    end do
  end function shear_slopes

  !> ln(1 + x)/x, 1 at 0: the rounding of 1 + x is in both (W. Kahan).
  elemental real(wp) function log_ratio(x) result(ratio)
    real(wp), intent(in) :: x !! > -1
    real(wp) :: rounded

    rounded = 1.0_wp + x
    ratio = 1.0_wp
    if (abs(rounded - 1.0_wp) > 0.0_wp) ratio = log(rounded)/(rounded - 1.0_wp)
  end function log_ratio

  !> (exp(y) - 1)/y, 1 at 0.
  elemental real(wp) function exp_ratio(y) result(ratio)
    real(wp), intent(in) :: y

    ratio = 1.0_wp + y*beyond_linear(y)
  end function exp_ratio

  !> (exp(y) - 1 - y)/y^2, 1/2 at 0: by its series where the difference would lose digits.
  elemental real(wp) function beyond_linear(y) result(part)
    real(wp), intent(in) :: y
    integer, parameter :: n_terms = 18 ! 1/20! is beyond the rounding of 1/2
    integer :: k

    if (abs(y) > 1.0_wp) then
      part = (exp(y) - 1.0_wp - y)/y**2
    else
      part = 1.0_wp
      do k = n_terms, 3, -1
        part = 1.0_wp + part*y/k
      end do
      part = 0.5_wp*part
    end if
  end function beyond_linear

end module ogden_mod
