!> Dense linear algebra by LAPACK: inverse, solution, least squares.
module dense_mod
  use kinds_mod, only: wp
  implicit none
  private

  public :: invert_spd, solve_dense, solve_least_squares

  real(wp), parameter :: singular = 1.0e-14_wp !! reciprocal condition taken for 0 [-]

  interface
    !> LAPACK: Cholesky factor of a symmetric positive definite matrix.
    subroutine dpotrf(uplo, n, a, lda, info)
      import :: wp
      implicit none
      character, intent(in) :: uplo
      integer, intent(in) :: n, lda
      real(wp), intent(inout) :: a(lda, *)
      integer, intent(out) :: info
    end subroutine dpotrf

    !> LAPACK: inverse from the Cholesky factor.
    subroutine dpotri(uplo, n, a, lda, info)
      import :: wp
      implicit none
      character, intent(in) :: uplo
      integer, intent(in) :: n, lda
      real(wp), intent(inout) :: a(lda, *)
      integer, intent(out) :: info
    end subroutine dpotri

    !> LAPACK: LU factors of a general matrix.
    subroutine dgetrf(m, n, a, lda, ipiv, info)
      import :: wp
      implicit none
      integer, intent(in) :: m, n, lda
      real(wp), intent(inout) :: a(lda, *)
      integer, intent(out) :: ipiv(*), info
    end subroutine dgetrf

    !> LAPACK: reciprocal of the condition number, from the factors.
    subroutine dgecon(norm, n, a, lda, anorm, rcond, work, iwork, info)
      import :: wp
      implicit none
      character, intent(in) :: norm
      integer, intent(in) :: n, lda
      real(wp), intent(in) :: a(lda, *), anorm
      real(wp), intent(out) :: rcond, work(*)
      integer, intent(out) :: iwork(*), info
    end subroutine dgecon

    !> LAPACK: solution from the factors.
    subroutine dgetrs(trans, n, nrhs, a, lda, ipiv, b, ldb, info)
      import :: wp
      implicit none
      character, intent(in) :: trans
      integer, intent(in) :: n, nrhs, lda, ldb, ipiv(*)
      real(wp), intent(in) :: a(lda, *)
      real(wp), intent(inout) :: b(ldb, *)
      integer, intent(out) :: info
    end subroutine dgetrs

    !> LAPACK: solution of least norm by a complete orthogonal factorisation.
    subroutine dgelsy(m, n, nrhs, a, lda, b, ldb, jpvt, rcond, rank, work, lwork, info)
      import :: wp
      implicit none
      integer, intent(in) :: m, n, nrhs, lda, ldb, lwork
      real(wp), intent(inout) :: a(lda, *), b(ldb, *)
      integer, intent(inout) :: jpvt(*)
      real(wp), intent(in) :: rcond
      integer, intent(out) :: rank, info
      real(wp), intent(out) :: work(*)
    end subroutine dgelsy
  end interface

contains

  !> Replace a matrix by its inverse, both triangles; only the lower one is read.
  subroutine invert_spd(a, positive_definite)
    real(wp), intent(inout) :: a(:, :)        !! (n,n); destroyed where not positive definite
    logical, intent(out) :: positive_definite !! to working precision
    integer, parameter :: tile = 64
    integer :: n, info, i, j, first

    n = size(a, 1)
    info = 0
    if (n > 0) call dpotrf('L', n, a, n, info)
    if (info == 0 .and. n > 0) call dpotri('L', n, a, n, info)
    positive_definite = info == 0
    if (.not. positive_definite) return
    ! Tile by tile: a whole row at once would touch a page of memory an entry.
    do first = 1, n, tile
      do j = 1, n
        do i = first, min(first + tile - 1, j - 1)
          a(i, j) = a(j, i)
        end do
      end do
    end do
  end subroutine invert_spd

  !> Solve J x = b; where J is singular to working precision, the x of least norm.
  subroutine solve_dense(j, b)
    real(wp), intent(inout) :: j(:, :) !! (n,n), destroyed
    real(wp), intent(inout) :: b(:)    !! (n) right-hand side in, solution out
    real(wp) :: copy(size(b), size(b)), x(size(b)), size_j, rcond
    real(wp), allocatable :: work(:)
    integer :: pivot(size(b)), integers(size(b)), n, info, rank

    n = size(b)
    if (n == 0) return
    copy = j
    x = b
    size_j = maxval(sum(abs(j), dim=1))
    allocate (work(max(4*n, 64*(n + 1))))
    call dgetrf(n, n, j, n, pivot, info)
    rcond = 0.0_wp
    if (info == 0) call dgecon('1', n, j, n, size_j, rcond, work, integers, info)
    if (rcond > singular) then
      call dgetrs('N', n, 1, j, n, pivot, b, n, info)
      return
    end if
    pivot = 0
    call dgelsy(n, n, 1, copy, n, x, n, pivot, singular, rank, work, size(work), info)
    b = x
  end subroutine solve_dense

  !> The x of least norm among those for which |A x - b| is least.
  function solve_least_squares(a, b) result(x)
    real(wp), intent(in) :: a(:, :) !! (m,n)
    real(wp), intent(in) :: b(:)    !! (m)
    real(wp) :: x(size(a, 2))
    real(wp), parameter :: dependent = 1.0e-10_wp ! columns closer than this count as one
    real(wp) :: copy(size(a, 1), size(a, 2)), rhs(max(size(b), size(a, 2)))
    real(wp) :: work(65*(size(a, 2) + size(b) + 1))
    integer :: pivot(size(a, 2)), rank, info

    copy = a
    rhs(:size(b)) = b
    pivot = 0
    call dgelsy(size(a, 1), size(a, 2), 1, copy, size(a, 1), rhs, size(rhs), pivot, dependent, &
      rank, work, size(work), info)
    x = rhs(:size(a, 2))
  end function solve_least_squares

end module dense_mod
