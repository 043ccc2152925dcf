!> Columns that are equal, found by hashing: the work grows with their number alone.
module equal_columns_mod
  use kinds_mod, only: i8, wp
  implicit none
  private

  public :: number_columns

  !> Number columns by their entries: equal ones have the index of the first of them.
  interface number_columns
    module procedure number_integers, number_reals
  end interface number_columns

contains

  pure subroutine number_integers(key, number)
    integer, intent(in) :: key(:, :)
    integer, allocatable, intent(out) :: number(:) !! (size(key, 2))
    integer, allocatable :: slot(:) !! (2^k) indices of columns, 0: free
    integer(i8), parameter :: bits = 2_i8**32 - 1
    integer(i8) :: hash
    integer :: i, j, at

    allocate (number(size(key, 2)))
    at = 1
    do while (at < 2*size(number))
      at = 2*at
    end do
    allocate (slot(0:at - 1), source=0)
    do i = 1, size(number)
      hash = 2166136261_i8
      do j = 1, size(key, 1)
        hash = iand(ieor(hash, iand(int(key(j, i), i8), bits))*16777619_i8, bits)
      end do
      ! The high bits hold what low bits of reals do not have.
      at = int(modulo(ieor(hash, ishft(hash, -15)), size(slot, kind=i8)))
      do while (slot(at) > 0)
        if (all(key(:, slot(at)) == key(:, i))) exit
        at = modulo(at + 1, size(slot))
      end do
      if (slot(at) == 0) slot(at) = i
      number(i) = slot(at)
    end do
  end subroutine number_integers

  pure subroutine number_reals(x, number)
    real(wp), intent(in) :: x(:, :)
    integer, allocatable, intent(out) :: number(:) !! (size(x, 2))
    integer :: key(storage_size(x)/storage_size(1)*size(x, 1), size(x, 2))
    integer :: i

    ! Bits tell reals apart, once there is one zero.
    do i = 1, size(x, 2)
      key(:, i) = transfer(x(:, i) + 0.0_wp, key(:, i))
    end do
    call number_integers(key, number)
  end subroutine number_reals

end module equal_columns_mod
