!> What of a stress or strain does not depend on the axes: von Mises' stress, principal values.
module invariants_mod
  use kinds_mod, only: wp
  use dense_mod, only: symmetric_eigenvectors
  implicit none
  private

  public :: von_mises, principal_values

contains

  !> sqrt(3/2 s : s), s the deviator of each stress.
  pure function von_mises(stress) result(mises)
    real(wp), intent(in) :: stress(:, :)      !! (6,n) XX, YY, ZZ, XY, YZ, XZ [force/length^2]
    real(wp) :: mises(size(stress, 2))        !! [force/length^2]
    integer :: i

    do i = 1, size(mises)
      associate (s => stress(:, i))
        mises(i) = sqrt(0.5_wp*((s(1) - s(2))**2 + (s(2) - s(3))**2 + (s(3) - s(1))**2) + &
          3.0_wp*sum(s(4:)**2))
      end associate
    end do
  end function von_mises

  !> The eigenvalues of each tensor, the largest first.
  subroutine principal_values(tensor, values)
    real(wp), intent(in) :: tensor(:, :)      !! (6,n) XX, YY, ZZ, XY, YZ, XZ
    real(wp), intent(out) :: values(:, :)     !! (3,n)
    real(wp) :: a(3, 3)
    logical :: ok
    integer :: i

    do i = 1, size(tensor, 2)
      associate (t => tensor(:, i))
        a = reshape([t(1), t(4), t(6), t(4), t(2), t(5), t(6), t(5), t(3)], [3, 3])
      end associate
      ! What is finite has eigenvalues: LAPACK's iteration on three rows always converges.
      call symmetric_eigenvectors(a, values(:, i), ok)
      values(:, i) = values(3:1:-1, i)
    end do
  end subroutine principal_values

end module invariants_mod
