!> Inverse of a dense symmetric positive definite matrix, by LAPACK.
module spd_inverse_mod
  use kinds_mod, only: wp
  implicit none
  private

  public :: invert_spd

  interface
    !> LAPACK: Cholesky factor of a symmetric positive definite matrix.
    subroutine dpotrf(uplo, n, a, lda, info)
      import :: wp
      character, intent(in) :: uplo
      integer, intent(in) :: n, lda
      real(wp), intent(inout) :: a(lda, *)
      integer, intent(out) :: info
    end subroutine dpotrf

    !> LAPACK: inverse from the Cholesky factor.
    subroutine dpotri(uplo, n, a, lda, info)
      import :: wp
      character, intent(in) :: uplo
      integer, intent(in) :: n, lda
      real(wp), intent(inout) :: a(lda, *)
      integer, intent(out) :: info
    end subroutine dpotri
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

end module spd_inverse_mod
