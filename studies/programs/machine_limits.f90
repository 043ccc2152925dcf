!> What this machine can do at most, with the BLAS that the program uses and its kernels.
!>
!>     machine_limits
!>
!> Prints names and values, a line each: the rate of the product of two large dense matrices
!> [operations/s], of reading memory [bytes/s], and of a symmetric matrix beyond the caches in its
!> product with a vector [bytes/s of the triangle that is read]. The best of several, by processor
!> time; with more than one thread (OPENBLAS_NUM_THREADS) by the wall clock.
program machine_limits
  use kinds_mod, only: wp
  use system_mod, only: wall_seconds, cpu_seconds
  use blas_core_mod, only: choose_blas_core
  use blas_mod, only: dgemm, dsymv, ddot
  implicit none

  integer, parameter :: rounds = 5

  call choose_blas_core()
  print '(a, es12.4)', 'dgemm', product_rate(1500)
  print '(a, es12.4)', 'read', reading_rate(16000000)
  print '(a, es12.4)', 'dsymv', symmetric_rate(4000)

contains

  !> Processor time where there is one thread, wall time where there are more [s].
  function clock() result(seconds)
    real(wp) :: seconds
    character(8) :: threads
    integer :: status

    call get_environment_variable('OPENBLAS_NUM_THREADS', threads, status=status)
    seconds = cpu_seconds()
    if (status == 0 .and. threads /= '1') seconds = wall_seconds()
  end function clock

  function product_rate(n) result(rate)
    integer, intent(in) :: n
    real(wp) :: rate, start
    real(wp), allocatable :: a(:, :), b(:, :), c(:, :)
    integer :: i

    allocate (a(n, n), b(n, n), c(n, n), source=1.0_wp/n)
    rate = 0.0_wp
    do i = 1, rounds
      start = clock()
      call dgemm('N', 'N', n, n, n, 1.0_wp, a, n, b, n, 0.0_wp, c, n)
      rate = max(rate, 2.0_wp*real(n, wp)**3/(clock() - start))
    end do
  end function product_rate

  function reading_rate(n) result(rate)
    integer, intent(in) :: n !! numbers of each of two vectors
    real(wp) :: rate, start, total
    real(wp), allocatable :: x(:), y(:)
    integer :: i

    allocate (x(n), y(n), source=1.0_wp)
    rate = 0.0_wp
    do i = 1, rounds
      start = clock()
      total = ddot(n, x, 1, y, 1)
      ! `total` is n; used, so that no compiler leaves the product out.
      rate = max(rate, 16.0_wp*total/(clock() - start))
    end do
  end function reading_rate

  function symmetric_rate(n) result(rate)
    integer, intent(in) :: n
    real(wp) :: rate, start
    real(wp), allocatable :: a(:, :), x(:), y(:)
    integer :: i

    allocate (a(n, n), source=1.0_wp/n)
    allocate (x(n), y(n), source=1.0_wp)
    rate = 0.0_wp
    do i = 1, rounds
      start = clock()
      call dsymv('L', n, 1.0_wp, a, n, x, 1, 0.0_wp, y, 1)
      rate = max(rate, 4.0_wp*real(n, wp)**2/(clock() - start))
    end do
  end function symmetric_rate

end program machine_limits
