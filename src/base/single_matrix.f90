!> A symmetric matrix rounded to single precision, for products with vectors of which few digits
!> are needed: half the memory to read.
module single_matrix_mod
  use kinds_mod, only: wp, sp
  use blas_mod, only: ssymv
  use huge_pages_mod, only: prefer_huge_pages
  implicit none
  private

  public :: single_matrix_t, round_matrix, is_rounded, times_single

  !> The matrix over `unit`: whatever its unit, it neither overflows nor vanishes.
  type :: single_matrix_t
    real(wp) :: unit = 1.0_wp            !! power of two near the largest entry
    real(sp), allocatable :: a(:, :)     !! (n,n) both triangles
  end type single_matrix_t

contains

  !> Round a symmetric matrix.
  subroutine round_matrix(a, single)
    real(wp), intent(in) :: a(:, :) !! (n,n) both triangles
    type(single_matrix_t), intent(out) :: single
    real(wp) :: largest
    integer :: j

    largest = 0.0_wp
    do j = 1, size(a, 2)
      largest = max(largest, maxval(abs(a(:, j))))
    end do
    if (largest > 0.0_wp) single%unit = scale(1.0_wp, exponent(largest))
    allocate (single%a(size(a, 1), size(a, 2)))
    call prefer_huge_pages(single%a)
    do j = 1, size(a, 2)
      single%a(:, j) = real(a(:, j)/single%unit, sp)
    end do
  end subroutine round_matrix

  !> Whether there is a rounded matrix.
  pure logical function is_rounded(single)
    type(single_matrix_t), intent(in) :: single

    is_rounded = allocated(single%a)
  end function is_rounded

  !> The product with a vector, to the digits of single precision, in any unit. One triangle of the
  !> matrix is read.
  function times_single(single, v) result(product)
    type(single_matrix_t), intent(in) :: single !! rounded
    real(wp), intent(in) :: v(:)                !! (n)
    real(wp) :: product(size(v))
    real(sp) :: x(size(v)), y(size(v))
    real(wp) :: size_v

    product = 0.0_wp
    if (size(v) == 0) return
    size_v = maxval(abs(v))
    if (.not. size_v > 0.0_wp) return
    size_v = scale(1.0_wp, exponent(size_v))
    x = real(v/size_v, sp)
    y = 0.0_sp
    call ssymv('L', size(v), 1.0_sp, single%a, size(v), x, 1, 0.0_sp, y, 1)
    product = single%unit*size_v*real(y, wp)
  end function times_single

end module single_matrix_mod
