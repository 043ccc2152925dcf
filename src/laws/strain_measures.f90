!> What follows from a displacement gradient H = du/dX without the loss of digits at small strains.
module strain_measures_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: determinant
  use dense_mod, only: symmetric_eigenvectors
  implicit none
  private

  public :: deformation_of, growth_of, green_strain, logarithmic_strain

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
      (h(1, 1)*h(3, 3) - h(1, 3)*h(3, 1)) + determinant(h)
  end function growth_of

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

  !> Hencky's strain ln(V) = ln(F F^T)/2, from the eigenvalues of F F^T - I.
  function logarithmic_strain(h) result(e)
    real(wp), intent(in) :: h(3, 3) !! det(I + H) > 0 [-]
    real(wp) :: e(3, 3)             !! [-]
    real(wp) :: v(3, 3), change(3)
    logical :: ok
    integer :: i

    v = h + transpose(h) + matmul(h, transpose(h))
    ! What is finite has eigenvalues: LAPACK's iteration on three rows always converges.
    call symmetric_eigenvectors(v, change, ok)
    e = 0.0_wp
    do i = 1, 3
      e = e + 0.5_wp*log(1.0_wp + change(i))*spread(v(:, i), 2, 3)*spread(v(:, i), 1, 3)
    end do
  end function logarithmic_strain

end module strain_measures_mod
