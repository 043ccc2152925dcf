!> What follows from a displacement gradient H = du/dX without the loss of digits at small strains.
module strain_measures_mod
  use kinds_mod, only: wp
  implicit none
  private

  public :: deformation_of, growth_of, transposed_inverse, green_strain, logarithmic_strain

contains

  !> F = I + H.
  pure function deformation_of(h) result(f)
    real(wp), intent(in) :: h(3, 3) !! [-]
    real(wp) :: f(3, 3)             !! [-]
    integer :: i

    f = h
    do i = 1, 3
      f(i, i) = f(i, i) + 1.0_wp
    end do
  end function deformation_of

  !> J - 1 = det(I + H) - 1.
  pure real(wp) function growth_of(h) result(growth)
    real(wp), intent(in) :: h(3, 3) !! [-]

    growth = h(1, 1) + h(2, 2) + h(3, 3) + &
      (h(1, 1)*h(2, 2) - h(1, 2)*h(2, 1)) + (h(2, 2)*h(3, 3) - h(2, 3)*h(3, 2)) + &
      (h(1, 1)*h(3, 3) - h(1, 3)*h(3, 1)) + &
      (h(1, 1)*(h(2, 2)*h(3, 3) - h(2, 3)*h(3, 2)) - h(1, 2)*(h(2, 1)*h(3, 3) - h(2, 3)*h(3, 1)) + &
      h(1, 3)*(h(2, 1)*h(3, 2) - h(2, 2)*h(3, 1)))
  end function growth_of

  !> F^-T, the cofactors over the determinant.
  pure function transposed_inverse(f) result(back)
    real(wp), intent(in) :: f(3, 3) !! not singular [-]
    real(wp) :: back(3, 3)          !! [-]

    back(1, :) = [f(2, 2)*f(3, 3) - f(2, 3)*f(3, 2), f(2, 3)*f(3, 1) - f(2, 1)*f(3, 3), &
      f(2, 1)*f(3, 2) - f(2, 2)*f(3, 1)]
    back(2, :) = [f(1, 3)*f(3, 2) - f(1, 2)*f(3, 3), f(1, 1)*f(3, 3) - f(1, 3)*f(3, 1), &
      f(1, 2)*f(3, 1) - f(1, 1)*f(3, 2)]
    back(3, :) = [f(1, 2)*f(2, 3) - f(1, 3)*f(2, 2), f(1, 3)*f(2, 1) - f(1, 1)*f(2, 3), &
      f(1, 1)*f(2, 2) - f(1, 2)*f(2, 1)]
    back = back/dot_product(f(1, :), back(1, :))
  end function transposed_inverse

  !> Green's strain (H + H^T + H^T H)/2.
  pure function green_strain(h) result(e)
    real(wp), intent(in) :: h(3, 3) !! [-]
    real(wp) :: e(3, 3)             !! [-]
    integer :: i, j

    do j = 1, 3
      do i = 1, j
        e(i, j) = 0.5_wp*(h(i, j) + h(j, i) + dot_product(h(:, i), h(:, j)))
        e(j, i) = e(i, j)
      end do
    end do
  end function green_strain

  !> Hencky's strain ln(V) = ln(F F^T)/2, by Jacobi's rotations of F F^T - I.
  pure function logarithmic_strain(h) result(e)
    real(wp), intent(in) :: h(3, 3) !! det(I + H) > 0 [-]
    real(wp) :: e(3, 3)             !! [-]
    integer, parameter :: sweeps = 12 !! far more than three rows need
    integer, parameter :: p(3) = [1, 1, 2], q(3) = [2, 3, 3]
    real(wp) :: a(3, 3), v(3, 3), turn(3, 3), t, theta
    integer :: sweep, i, k

    a = h + transpose(h) + matmul(h, transpose(h))
    v = 0.0_wp
    do i = 1, 3
      v(i, i) = 1.0_wp
    end do
    do sweep = 1, sweeps
      if (a(1, 2)**2 + a(1, 3)**2 + a(2, 3)**2 <= epsilon(1.0_wp)**2*sum(a**2)) exit
      do k = 1, 3
        if (.not. abs(a(p(k), q(k))) > 0.0_wp) cycle
        theta = 0.5_wp*(a(q(k), q(k)) - a(p(k), p(k)))/a(p(k), q(k))
        t = sign(1.0_wp, theta)/(abs(theta) + sqrt(1.0_wp + theta**2))
        turn = 0.0_wp
        do i = 1, 3
          turn(i, i) = 1.0_wp
        end do
        turn(p(k), p(k)) = 1.0_wp/sqrt(1.0_wp + t**2)
        turn(q(k), q(k)) = turn(p(k), p(k))
        turn(p(k), q(k)) = t*turn(p(k), p(k))
        turn(q(k), p(k)) = -turn(p(k), q(k))
        a = matmul(transpose(turn), matmul(a, turn))
        v = matmul(v, turn)
      end do
    end do
    e = 0.0_wp
    do i = 1, 3
      e = e + 0.5_wp*log(1.0_wp + a(i, i))*spread(v(:, i), 2, 3)*spread(v(:, i), 1, 3)
    end do
  end function logarithmic_strain

end module strain_measures_mod
