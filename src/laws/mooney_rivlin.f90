!> Compressible Mooney-Rivlin law, as Abaqus has it; neo-Hookean where C01 = 0:
!>
!>     W = C10 (I1 J^(-2/3) - 3) + C01 (I2 J^(-4/3) - 3) + (J - 1)^2/D1
!>
!>     2 (C10 + C01) = G,   2/D1 = K
!>
!> docs/theory.md (8.16), (8.17).
module mooney_rivlin_mod
  use kinds_mod, only: wp
  use elasticity_mod, only: elasticity_t
  use small_matrix_mod, only: determinant, inverse
  use strain_measures_mod, only: deformation_of, growth_of
  implicit none
  private

  public :: first_piola, energy, tangent, elastic_part

contains

  !> P = tau F^-T. With c = F F^T - I, whose deviator is that of F F^T,
  !>
  !>     tau = dev(2 C10 J^(-2/3) c + 2 C01 J^(-4/3) ((1 + tr c) c - c^2)) + (2/D1) (J - 1) J I
  !>
  !> All from H = F - I, so that small strains lose no digits.
  pure function first_piola(h, constants) result(p)
    real(wp), intent(in) :: h(3, 3)       !! du_i/dX_j [-]
    real(wp), intent(in) :: constants(:)
    !! C10, C01 [force/length^2], D1 [length^2/force]
    real(wp) :: p(3, 3)                   !! [force/length^2]
    real(wp) :: c(3, 3), tau(3, 3), a(3, 3), mean, growth, stretch
    integer :: i, j

    ! Products are written out: this is asked at every point in every iteration.
    do j = 1, 3
      do i = 1, j
        c(i, j) = h(i, j) + h(j, i) + (h(i, 1)*h(j, 1) + h(i, 2)*h(j, 2) + h(i, 3)*h(j, 3))
        c(j, i) = c(i, j)
      end do
    end do
    ! F^-T J by the columns of F = I + H, which are crossed; J - 1 by what they have beside 1.
    a(1, 1) = h(2, 2) + h(3, 3) + (h(2, 2)*h(3, 3) - h(3, 2)*h(2, 3))
    a(2, 2) = h(1, 1) + h(3, 3) + (h(1, 1)*h(3, 3) - h(1, 3)*h(3, 1))
    a(3, 3) = h(1, 1) + h(2, 2) + (h(1, 1)*h(2, 2) - h(2, 1)*h(1, 2))
    a(2, 1) = h(3, 2)*h(1, 3) - h(1, 2)*(1.0_wp + h(3, 3))
    a(3, 1) = h(1, 2)*h(2, 3) - (1.0_wp + h(2, 2))*h(1, 3)
    a(1, 2) = h(2, 3)*h(3, 1) - (1.0_wp + h(3, 3))*h(2, 1)
    a(3, 2) = h(2, 1)*h(1, 3) - h(2, 3)*(1.0_wp + h(1, 1))
    a(1, 3) = h(2, 1)*h(3, 2) - h(3, 1)*(1.0_wp + h(2, 2))
    a(2, 3) = h(3, 1)*h(1, 2) - (1.0_wp + h(1, 1))*h(3, 2)
    growth = h(1, 1) + a(1, 1)*(1.0_wp + h(1, 1)) + h(2, 1)*a(2, 1) + h(3, 1)*a(3, 1)
    do i = 1, 3
      a(i, i) = 1.0_wp + a(i, i)
    end do
    stretch = (1.0_wp + growth)**(-2.0_wp/3.0_wp)
    tau = (2.0_wp*constants(1)*stretch)*c
    if (abs(constants(2)) > 0.0_wp) tau = tau + (2.0_wp*constants(2)*stretch**2)* &
      ((1.0_wp + c(1, 1) + c(2, 2) + c(3, 3))*c - matmul(c, c))
    mean = (tau(1, 1) + tau(2, 2) + tau(3, 3))/3.0_wp - 2.0_wp/constants(3)*growth*(1.0_wp + growth)
    do i = 1, 3
      tau(i, i) = tau(i, i) - mean
    end do
    tau = tau/(1.0_wp + growth)
    do j = 1, 3
      p(:, j) = tau(:, 1)*a(1, j) + tau(:, 2)*a(2, j) + tau(:, 3)*a(3, j)
    end do
  end function first_piola

  !> W. With C = m I + D, m a third of its trace, I1 = 3 m, I2 = 3 m^2 (1 - y), J^2 = m^3 (1 - x),
  !> where y = D:D/(6 m^2) and x = 3 y - det(D)/m^3 are of the second order in the strains:
  !>
  !>     I1 J^(-2/3) - 3 = 3 ((1 - x)^(-1/3) - 1)
  !>     I2 J^(-4/3) - 3 = 3 ((1 - y) (1 - x)^(-2/3) - 1)
  pure real(wp) function energy(h, constants) result(w)
    real(wp), intent(in) :: h(3, 3)       !! du_i/dX_j [-]
    real(wp), intent(in) :: constants(:)
    !! C10, C01 [force/length^2], D1 [length^2/force]
    real(wp) :: d(3, 3), m, x, y, root, less, growth
    integer :: i

    d = h + transpose(h) + matmul(transpose(h), h)
    m = (d(1, 1) + d(2, 2) + d(3, 3))/3.0_wp
    do i = 1, 3
      d(i, i) = d(i, i) - m
    end do
    m = 1.0_wp + m
    y = sum(d**2)/(6.0_wp*m**2)
    x = 3.0_wp*y - determinant(d)/m**3
    growth = growth_of(h)
    root = (1.0_wp - x)**(1.0_wp/3.0_wp)
    less = x/(1.0_wp + root + root**2) ! 1 - root
    w = 3.0_wp*constants(1)*less/root + 3.0_wp*constants(2)*(less*(1.0_wp + root) - y)/root**2 + &
      growth**2/constants(3)
  end function energy

  !> What P changes by as F does. With B = F^-T, whose change is -B dF^T B,
  !>
  !>     P = 2 C10 J^(-2/3) (F - I1/3 B) + (2/D1) (J - 1) J B + C01 J^(-4/3) (G - 4/3 I2 B)
  !>
  !> and G = dI2/dF = 2 (I1 F - F F^T F).
  pure function tangent(h, constants) result(a)
    real(wp), intent(in) :: h(3, 3)       !! du_i/dX_j [-]
    real(wp), intent(in) :: constants(:)
    !! C10, C01 [force/length^2], D1 [length^2/force]
    real(wp) :: a(3, 3, 3, 3)             !! dP_ij/dF_kl: (i,j,k,l) [force/length^2]
    real(wp) :: f(3, 3), b(3, 3), turned(3, 3), third, jacobian, shear, bulk
    integer :: i, k, l

    f = deformation_of(h)
    b = transpose(inverse(f))
    jacobian = 1.0_wp + growth_of(h)
    third = sum(f**2)/3.0_wp
    shear = 2.0_wp*constants(1)*jacobian**(-2.0_wp/3.0_wp)
    bulk = 2.0_wp/constants(3)*jacobian
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
    if (abs(constants(2)) > 0.0_wp) call add_second(f, b, constants(2)* &
      jacobian**(-4.0_wp/3.0_wp), a)
  end function tangent

  !> Add the part of I2 J^(-4/3).
  pure subroutine add_second(f, b, factor, a)
    real(wp), intent(in) :: f(3, 3), b(3, 3)    !! F, F^-T [-]
    real(wp), intent(in) :: factor              !! C01 J^(-4/3) [force/length^2]
    real(wp), intent(inout) :: a(3, 3, 3, 3)    !! (i,j,k,l) [force/length^2]
    real(wp) :: left(3, 3), right(3, 3), g(3, 3), rest(3, 3), change(3, 3), first, third
    integer :: i, k, l

    left = matmul(f, transpose(f))
    right = matmul(transpose(f), f)
    first = sum(f**2)
    third = 2.0_wp/3.0_wp*(first**2 - sum(right**2)) ! 4/3 I2
    g = 2.0_wp*(first*f - matmul(left, f))
    rest = 4.0_wp/3.0_wp*(g - third*b)
    do l = 1, 3
      do k = 1, 3
        ! dG of dF = e_k (x) e_l, then what the factors and B change by.
        change = 4.0_wp*f(k, l)*f
        do i = 1, 3
          change(i, :) = change(i, :) - 2.0_wp*f(i, l)*f(k, :) + third*b(i, l)*b(k, :)
        end do
        change(k, l) = change(k, l) + 2.0_wp*first
        change(k, :) = change(k, :) - 2.0_wp*right(l, :)
        change(:, l) = change(:, l) - 2.0_wp*left(:, k)
        a(:, :, k, l) = a(:, :, k, l) + factor*(change - b(k, l)*rest - 4.0_wp/3.0_wp*g(k, l)*b)
      end do
    end do
  end subroutine add_second

  !> The law at small strain.
  pure type(elasticity_t) function elastic_part(constants) result(elastic)
    real(wp), intent(in) :: constants(:)
    !! C10, C01 [force/length^2], D1 [length^2/force]

    elastic%shear = 2.0_wp*(constants(1) + constants(2))
    elastic%lambda = 2.0_wp/constants(3) - 2.0_wp*elastic%shear/3.0_wp
  end function elastic_part

end module mooney_rivlin_mod
