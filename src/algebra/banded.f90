!> Linear algebra of banded matrices by LAPACK.
module banded_mod
  use kinds_mod, only: wp
  use blas_mod, only: dsbmv
  implicit none
  private

  public :: solve_band, invert_band

  real(wp), parameter :: singular = 1.0e-14_wp !! smallest beside largest pivot, taken for 0 [-]

  interface
    !> LAPACK: LU factors of a banded matrix.
    subroutine dgbtrf(m, n, kl, ku, ab, ldab, ipiv, info)
      import :: wp
      implicit none
      integer, intent(in) :: m, n, kl, ku, ldab
      real(wp), intent(inout) :: ab(ldab, *)
      integer, intent(out) :: ipiv(*), info
    end subroutine dgbtrf

    !> LAPACK: solution from the factors.
    subroutine dgbtrs(trans, n, kl, ku, nrhs, ab, ldab, ipiv, b, ldb, info)
      import :: wp
      implicit none
      character, intent(in) :: trans
      integer, intent(in) :: n, kl, ku, nrhs, ldab, ldb, ipiv(*)
      real(wp), intent(in) :: ab(ldab, *)
      real(wp), intent(inout) :: b(ldb, *)
      integer, intent(out) :: info
    end subroutine dgbtrs

    !> LAPACK: Cholesky factor of a banded symmetric positive definite matrix.
    subroutine dpbtrf(uplo, n, kd, ab, ldab, info)
      import :: wp
      implicit none
      character, intent(in) :: uplo
      integer, intent(in) :: n, kd, ldab
      real(wp), intent(inout) :: ab(ldab, *)
      integer, intent(out) :: info
    end subroutine dpbtrf
  end interface

contains

  !> Solve A x = b by LU factors; b is kept where A is singular to working precision.
  subroutine solve_band(a, width, b, regular)
    real(wp), intent(inout) :: a(:, :)
    !! (3*width+1,n), A_ij at (2*width+1+i-j,j), the first `width` rows free; destroyed
    integer, intent(in) :: width        !! largest |i - j| of an entry
    real(wp), intent(inout) :: b(:)     !! (n) right-hand side in, solution out
    logical, intent(out) :: regular
    real(wp) :: x(size(b), 1)
    integer :: pivot(size(b)), n, info

    n = size(b)
    regular = n == 0
    if (regular) return
    call dgbtrf(n, n, width, width, a, size(a, 1), pivot, info)
    if (info /= 0) return
    associate (u => abs(a(2*width + 1, :)))
      regular = minval(u) > singular*maxval(u)
    end associate
    if (.not. regular) return
    x(:, 1) = b
    call dgbtrs('N', n, width, width, 1, a, size(a, 1), pivot, x, n, info)
    b = x(:, 1)
  end subroutine solve_band

  !> Replace a symmetric positive definite matrix by the entries of its inverse within the band.
  !>
  !> With A = L D L^T the inverse Z has Z = D^-1 L^-1 + (I - L^T) Z: from the last column to the
  !> first each entry within the band needs those within it alone. Source: K. Takahashi, J. Fagan,
  !> M.-S. Chin (1973), Formation of a sparse bus impedance matrix and its application to short
  !> circuit study, 8th PICA conference, pp. 63-69.
  subroutine invert_band(a, positive_definite)
    real(wp), intent(inout) :: a(:, :)
    !! (width+1,n), A_ij at (1+i-j,j), i >= j; destroyed where not positive definite
    logical, intent(out) :: positive_definite !! to working precision
    real(wp) :: l(size(a, 1)), z(size(a, 1)), d
    integer :: width, n, info, j, m

    width = size(a, 1) - 1
    n = size(a, 2)
    info = 0
    if (n > 0) call dpbtrf('L', n, width, a, width + 1, info)
    positive_definite = info == 0
    if (.not. positive_definite) return
    do j = n, 1, -1
      m = min(width, n - j)
      d = a(1, j)**2
      l(:m) = a(2:m + 1, j)/a(1, j)
      z(:m) = 0.0_wp
      if (m > 0) call dsbmv('L', m, m - 1, -1.0_wp, a(:, j + 1:j + m), width + 1, l, 1, 1.0_wp, &
        z, 1)
      a(1, j) = 1.0_wp/d - dot_product(l(:m), z(:m))
      a(2:m + 1, j) = z(:m)
    end do
  end subroutine invert_band

end module banded_mod
