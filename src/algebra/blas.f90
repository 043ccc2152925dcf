!> Interfaces of the BLAS that the program calls.
module blas_mod
  use kinds_mod, only: wp
  implicit none
  private

  public :: ddot, dasum, daxpy, dsymv, dsbmv, dgemm, dsyrk, dsyr2k, dtrsm

  interface
    !> BLAS: scalar product.
    function ddot(n, x, incx, y, incy) result(product)
      import :: wp
      implicit none
      integer, intent(in) :: n, incx, incy
      real(wp), intent(in) :: x(*), y(*)
      real(wp) :: product
    end function ddot

    !> BLAS: sum of |x|.
    function dasum(n, x, incx) result(total)
      import :: wp
      implicit none
      integer, intent(in) :: n, incx
      real(wp), intent(in) :: x(*)
      real(wp) :: total
    end function dasum

    !> BLAS: y = alpha x + y.
    subroutine daxpy(n, alpha, x, incx, y, incy)
      import :: wp
      implicit none
      integer, intent(in) :: n, incx, incy
      real(wp), intent(in) :: alpha, x(*)
      real(wp), intent(inout) :: y(*)
    end subroutine daxpy

    !> BLAS: y = alpha A x + beta y, A symmetric.
    subroutine dsymv(uplo, n, alpha, a, lda, x, incx, beta, y, incy)
      import :: wp
      implicit none
      character, intent(in) :: uplo
      integer, intent(in) :: n, lda, incx, incy
      real(wp), intent(in) :: alpha, beta, a(lda, *), x(*)
      real(wp), intent(inout) :: y(*)
    end subroutine dsymv

    !> BLAS: y = alpha A x + beta y, A symmetric with k diagonals beside the main one.
    subroutine dsbmv(uplo, n, k, alpha, a, lda, x, incx, beta, y, incy)
      import :: wp
      implicit none
      character, intent(in) :: uplo
      integer, intent(in) :: n, k, lda, incx, incy
      real(wp), intent(in) :: alpha, beta, a(lda, *), x(*)
      real(wp), intent(inout) :: y(*)
    end subroutine dsbmv

    !> BLAS: C = alpha op(A) op(B) + beta C.
    subroutine dgemm(transa, transb, m, n, k, alpha, a, lda, b, ldb, beta, c, ldc)
      import :: wp
      implicit none
      character, intent(in) :: transa, transb
      integer, intent(in) :: m, n, k, lda, ldb, ldc
      real(wp), intent(in) :: alpha, beta, a(lda, *), b(ldb, *)
      real(wp), intent(inout) :: c(ldc, *)
    end subroutine dgemm

    !> BLAS: a triangle of C = alpha A A^T + beta C, or what `trans` says.
    subroutine dsyrk(uplo, trans, n, k, alpha, a, lda, beta, c, ldc)
      import :: wp
      implicit none
      character, intent(in) :: uplo, trans
      integer, intent(in) :: n, k, lda, ldc
      real(wp), intent(in) :: alpha, beta, a(lda, *)
      real(wp), intent(inout) :: c(ldc, *)
    end subroutine dsyrk

    !> BLAS: a triangle of C = alpha (A B^T + B A^T) + beta C, or what `trans` says.
    subroutine dsyr2k(uplo, trans, n, k, alpha, a, lda, b, ldb, beta, c, ldc)
      import :: wp
      implicit none
      character, intent(in) :: uplo, trans
      integer, intent(in) :: n, k, lda, ldb, ldc
      real(wp), intent(in) :: alpha, beta, a(lda, *), b(ldb, *)
      real(wp), intent(inout) :: c(ldc, *)
    end subroutine dsyr2k

    !> B = alpha A^-1 B, or what `side` and `transa` say, for a triangle A.
    subroutine dtrsm(side, uplo, transa, diag, m, n, alpha, a, lda, b, ldb)
      import :: wp
      implicit none
      character, intent(in) :: side, uplo, transa, diag
      integer, intent(in)   :: m, n, lda, ldb
      real(wp), intent(in)  :: alpha, a(lda, *)
      real(wp), intent(inout) :: b(ldb, *)
    end subroutine dtrsm
  end interface

end module blas_mod
