!> How fast this machine is at what a run spends its time on, measured in a few hundredths of a
!> second.
module machine_speed_mod
  use kinds_mod, only: wp, i8
  use blas_mod, only: dgemm, dsymv, dasum
  use system_mod, only: cpu_seconds
  implicit none
  private

  public :: machine_speed_t, measure_speed

  !> What the machine does in a second.
  type :: machine_speed_t
    real(wp) :: flops = 0.0_wp      !! of the product of two dense matrices [1/s]
    real(wp) :: entries = 0.0_wp    !! of a symmetric matrix in its product with a vector [1/s]
    real(wp) :: bytes = 0.0_wp      !! read one after the other [1/s]
  end type machine_speed_t

  real(wp), parameter :: long_enough = 0.006_wp !! of one measurement [s]
  integer, parameter :: most_often = 100000     !! where a clock is too coarse for that

contains

  !> Measure on arrays as large as those of the run, and no larger: caches matter, and the memory of
  !> a small run must not be that of its measurement.
  subroutine measure_speed(front, rows, bytes, speed)
    integer, intent(in) :: front     !! order of the matrices that are multiplied
    integer, intent(in) :: rows      !! of the symmetric matrix
    integer(i8), intent(in) :: bytes !! that are read one after the other
    type(machine_speed_t), intent(out) :: speed
    integer, parameter :: smallest = 32, largest_front = 384, largest_symmetric = 1000
    integer(i8), parameter :: most_bytes = 24000000_i8

    speed%flops = product_rate(max(smallest, min(front, largest_front)))
    speed%entries = symmetric_rate(max(smallest, min(rows, largest_symmetric)))
    speed%bytes = reading_rate(int(max(100000_i8, min(bytes, most_bytes))/8))
  end subroutine measure_speed

  real(wp) function product_rate(n) result(rate)
    integer, intent(in) :: n
    real(wp), allocatable :: a(:, :), b(:, :), c(:, :)
    real(wp) :: start
    integer :: count

    allocate (a(n, n), b(n, n), c(n, n), source=1.0_wp/n)
    call dgemm('N', 'N', n, n, n, 1.0_wp, a, n, b, n, 0.0_wp, c, n)
    start = cpu_seconds()
    do count = 1, most_often
      call dgemm('N', 'N', n, n, n, 1.0_wp, a, n, b, n, 0.0_wp, c, n)
      if (cpu_seconds() - start > long_enough) exit
    end do
    rate = 2.0_wp*real(n, wp)**3*min(count, most_often)/seconds_since(start)
  end function product_rate

  real(wp) function symmetric_rate(n) result(rate)
    integer, intent(in) :: n
    real(wp), allocatable :: a(:, :), x(:), y(:)
    real(wp) :: start
    integer :: count

    allocate (a(n, n), source=1.0_wp/n)
    allocate (x(n), y(n), source=1.0_wp)
    call dsymv('L', n, 1.0_wp, a, n, x, 1, 0.0_wp, y, 1)
    start = cpu_seconds()
    do count = 1, most_often
      call dsymv('L', n, 1.0_wp, a, n, x, 1, 0.0_wp, y, 1)
      if (cpu_seconds() - start > long_enough) exit
    end do
    rate = real(n, wp)**2*min(count, most_often)/seconds_since(start)
  end function symmetric_rate

  real(wp) function reading_rate(n) result(rate)
    integer, intent(in) :: n !! numbers
    real(wp), allocatable :: x(:)
    real(wp) :: start, total
    integer :: count

    allocate (x(n), source=1.0_wp)
    total = 0.0_wp
    start = cpu_seconds()
    do count = 1, most_often
      total = total + dasum(n, x, 1)
      if (cpu_seconds() - start > long_enough) exit
    end do
    ! `total` is n*count; used, so that no compiler leaves the sums out.
    rate = 8.0_wp*total/seconds_since(start)
  end function reading_rate

  !> Never none.
  real(wp) function seconds_since(start) result(seconds)
    real(wp), intent(in) :: start !! [s]

    seconds = max(cpu_seconds() - start, long_enough)
  end function seconds_since

end module machine_speed_mod
