!> Pure kernels on 3-vectors and small dense matrices.
module small_matrix_mod
  use kinds_mod, only: wp
  implicit none
  private

  public :: cross, perpendicular_to, determinant, inverse, solve_small, largest_eigenvalue

contains

  !> The vector product a x b.
  pure function cross(a, b) result(c)
    real(wp), intent(in) :: a(3), b(3)
    real(wp) :: c(3)

    c = [a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)]
  end function cross

  !> A unit vector perpendicular to another one; along an axis if that is possible.
  pure function perpendicular_to(axis) result(across)
    real(wp), intent(in) :: axis(3) !! unit vector [-]
    real(wp) :: across(3)           !! [-]
    integer :: i

    i = minloc(abs(axis), dim=1)
    across = -axis(i)*axis
    across(i) = across(i) + 1.0_wp
    across = across/norm2(across)
  end function perpendicular_to

  !> The determinant of a 3x3 matrix.
  pure real(wp) function determinant(a) result(d)
    real(wp), intent(in) :: a(3, 3)

    d = dot_product(a(:, 1), cross(a(:, 2), a(:, 3)))
  end function determinant

  !> The inverse of a 3x3 matrix by cofactors; its determinant must not be 0.
  pure function inverse(a) result(b)
    real(wp), intent(in) :: a(3, 3)
    real(wp) :: b(3, 3)

    b(1, :) = cross(a(:, 2), a(:, 3))
    b(2, :) = cross(a(:, 3), a(:, 1))
    b(3, :) = cross(a(:, 1), a(:, 2))
    b = b/determinant(a)
  end function inverse

  !> Solve A x = b by Gaussian elimination with scaled partial pivoting, for n of a handful.
  !>
  !> A call to LAPACK costs more than the elimination itself at n = 3, and is not pure.
  pure subroutine solve_small(a, b, x, regular)
    real(wp), intent(in)  :: a(:, :)  !! (n,n)
    real(wp), intent(in)  :: b(:)     !! (n)
    real(wp), intent(out) :: x(:)     !! (n), 0 where not regular
    logical,  intent(out) :: regular  !! no pivot vanished beside its row
    real(wp) :: m(size(b), size(b)), scale(size(b)), row(size(b)), factor, pivot_rhs
    integer :: n, i, k, pivot

    n = size(b)
    m = a
    x = b
    scale = maxval(abs(a), dim=2)
    regular = all(scale > 0.0_wp)
    eliminate: do k = 1, n
      if (.not. regular) exit eliminate
      pivot = k - 1 + maxloc(abs(m(k:, k))/scale(k:), dim=1)
      regular = abs(m(pivot, k)) > 8.0_wp*epsilon(1.0_wp)*scale(pivot)
      if (.not. regular) exit eliminate
      if (pivot /= k) then
        row = m(k, :)
        m(k, :) = m(pivot, :)
        m(pivot, :) = row
        pivot_rhs = x(pivot)
        x(pivot) = x(k)
        x(k) = pivot_rhs
        factor = scale(pivot)
        scale(pivot) = scale(k)
        scale(k) = factor
      end if
      do i = k + 1, n
        factor = m(i, k)/m(k, k)
        m(i, k + 1:) = m(i, k + 1:) - factor*m(k, k + 1:)
        x(i) = x(i) - factor*x(k)
      end do
    end do eliminate
    if (.not. regular) then
      x = 0.0_wp
      return
    end if
    do k = n, 1, -1
      x(k) = (x(k) - dot_product(m(k, k + 1:), x(k + 1:)))/m(k, k)
    end do
  end subroutine solve_small

  !> The largest eigenvalue of a symmetric 3x3 matrix, in closed form (trigonometric).
  pure function largest_eigenvalue(a) result(lambda)
    real(wp), intent(in) :: a(3, 3)  !! symmetric
    real(wp) :: lambda, mean, off, p, b(3, 3), half_det
    integer :: i

    mean = (a(1, 1) + a(2, 2) + a(3, 3))/3.0_wp
    b = a
    do i = 1, 3
      b(i, i) = b(i, i) - mean
    end do
    off = maxval(abs(b))
    lambda = mean
    if (off <= tiny(1.0_wp)) return
    ! Scaled by its largest entry, so that neither squares nor the determinant leave the range.
    b = b/off
    p = sqrt(sum(b**2)/6.0_wp)
    half_det = max(-1.0_wp, min(1.0_wp, determinant(b/p)/2.0_wp))
    lambda = mean + 2.0_wp*off*p*cos(acos(half_det)/3.0_wp)
  end function largest_eigenvalue

end module small_matrix_mod
