!> How near to the speed of memory the products with the compliance are.
!>
!>     compliance_products [ROWS ...]
!>
!> For matrices of so many rows (867, 1875, 3267: the block with n = 16, 24, 32): how fast memory of
!> the size of a triangle is read, by scalar products, which do nothing else; and how fast the
!> triangle is in a product in double precision, and in one in single precision from panels. All in
!> bytes of the triangle a second, in turns, the best of many: what else the machine does disturbs
!> them alike. A triangle that fits in a cache is read from there.
program compliance_products
  use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
  use kinds_mod, only: wp
  use errors_mod, only: error_t, raise, exit_wrong_input
  use blas_mod, only: ddot
  use blas_core_mod, only: choose_blas_core, blas_core_name
  use dense_mod, only: times_symmetric
  use single_panels_mod, only: single_panels_t, make_panels, times_panels
  use system_mod, only: cpu_seconds
  implicit none

  integer, parameter :: repeats = 40
  integer, parameter :: block_rows(3) = [867, 1875, 3267]
  type(error_t), allocatable :: error
  integer, allocatable :: rows(:)
  integer :: i

  call choose_blas_core()
  call read_rows(rows, error)
  if (allocated(error)) then
    write (error_unit, '(a)') 'compliance_products: '//error%message
    stop 1
  end if
  write (output_unit, '(a)') 'kernels: '//blas_core_name()
  write (output_unit, '(a)') '  rows   triangle, MB   read, GB/s   double, GB/s   share   '// &
    'single, MB   read, GB/s   single, GB/s   share   double over single, time'
  do i = 1, size(rows)
    call measure(rows(i))
  end do

contains

  !> Time the reading and the products in turns.
  subroutine measure(n)
    integer, intent(in) :: n
    real(wp), allocatable :: a(:, :), v(:), product(:)
    type(single_panels_t) :: panels
    real(wp) :: best(4), bytes, start, total
    integer :: i, half

    allocate (a(n, n), v(n))
    call random_number(a)
    call random_number(v)
    a = a + transpose(a)
    call make_panels(a, panels)
    bytes = 4.0_wp*real(n, wp)*real(n + 1, wp)
    half = n*(n + 1)/4 ! two streams are one triangle
    best = huge(1.0_wp)
    total = 0.0_wp
    do i = 1, repeats
      start = cpu_seconds()
      total = total + ddot(half, a, 1, a(1, n/2), 1)
      call keep(start, best(1))
      start = cpu_seconds()
      product = times_symmetric(a, v)
      call keep(start, best(2))
      total = total + product(n)
      start = cpu_seconds()
      total = total + ddot(half/2, a, 1, a(1, n/2), 1)
      call keep(start, best(3))
      start = cpu_seconds()
      product = times_panels(panels, v)
      call keep(start, best(4))
      total = total + product(n)
    end do
    ! `total` is used, so that no compiler leaves anything out.
    if (.not. total > 0.0_wp) error stop 'sums of positive numbers are positive'
    associate (rate => bytes/best/1.0e9_wp)
      write (output_unit, '(i6, f15.1, f13.1, f15.1, f8.2, f13.1, f13.1, f15.1, f8.2, f17.2)') n, &
        bytes/1.0e6_wp, rate(1), rate(2), rate(2)/rate(1), 0.5_wp*bytes/1.0e6_wp, 0.5_wp*rate(3), &
        0.5_wp*rate(4), rate(4)/rate(3), best(2)/best(4)
    end associate

  end subroutine measure

  !> Keep the time since `start` where it is the least yet.
  subroutine keep(start, best)
    real(wp), intent(in) :: start
    real(wp), intent(inout) :: best

    best = min(best, cpu_seconds() - start)
  end subroutine keep

  !> The sizes on the command line, or those of the block.
  subroutine read_rows(rows, error)
    integer, allocatable, intent(out) :: rows(:)
    type(error_t), allocatable, intent(out) :: error !! an argument that is no size
    character(20) :: argument
    integer :: i, status

    rows = block_rows
    if (command_argument_count() == 0) return
    deallocate (rows)
    allocate (rows(command_argument_count()))
    do i = 1, size(rows)
      call get_command_argument(i, argument)
      read (argument, *, iostat=status) rows(i)
      if (status /= 0) rows(i) = 0
      if (rows(i) < 8 .or. rows(i) > 20000) then
        call raise(error, exit_wrong_input, "'"//trim(argument)// &
          "' is not a number of rows; expected are whole numbers from 8 to 20000")
        return
      end if
    end do
  end subroutine read_rows

end program compliance_products
