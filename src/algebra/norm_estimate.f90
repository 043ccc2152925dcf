!> The 1-norm of a matrix that is known by its products, estimated from below by some of them.
!>
!> LAPACK's estimate (Higham 1988): seldom less than a third of the norm.
module norm_estimate_mod
  use kinds_mod, only: wp
  implicit none
  private

  public :: norm_estimate_t

  interface
    !> LAPACK: the next vector whose product is wanted.
    subroutine dlacn2(n, v, x, isgn, est, kase, isave)
      import :: wp
      implicit none
      integer, intent(in) :: n
      real(wp), intent(inout) :: v(*), x(*), est
      integer, intent(inout) :: isgn(*), kase, isave(3)
    end subroutine dlacn2
  end interface

  !> An estimate under way, of a symmetric matrix: `do while (norm%goes_on(x))`, `x = A x`.
  type :: norm_estimate_t
    real(wp) :: estimate = 0.0_wp
    integer, private :: wanted = 0, saved(3) = 0
    real(wp), allocatable, private :: v(:)
    integer, allocatable, private :: signs(:)
  contains
    procedure :: goes_on
  end type norm_estimate_t

contains

  !> Whether another product is wanted: that of the vector which takes the place of the last one.
  logical function goes_on(norm, x)
    class(norm_estimate_t), intent(inout) :: norm
    real(wp), intent(inout) :: x(:) !! (n) the last product in, the next vector out

    if (.not. allocated(norm%v)) allocate (norm%v(size(x)), norm%signs(size(x)))
    call dlacn2(size(x), norm%v, x, norm%signs, norm%estimate, norm%wanted, norm%saved)
    goes_on = norm%wanted /= 0
  end function goes_on

end module norm_estimate_mod
