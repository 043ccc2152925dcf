!> How near to the speed of memory the products with the compliance are.
!>
!>     compliance_products [ROWS ...]
!>
!> For matrices of so many rows (867, 1875, 3267, 7203: the block with n = 16, 24, 32, 48): how fast
!> memory is read, by scalar products, which do nothing else, in ordinary pages and in huge ones
!> (src/machine/huge_pages.f90); how fast one triangle of the matrix is read in a product in double
!> precision, and in one in single, whose triangle has half the bytes. The stretches that are read
!> have the size of the triangle. All in bytes a second of the processor, in turns, the best of
!> many: what else the machine does disturbs them alike. What fits in a cache is read from there.
!> A table in CSV, for studies/run speed.
program compliance_products
  use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
  use kinds_mod, only: wp
  use errors_mod, only: error_t, raise, exit_wrong_input
  use blas_mod, only: ddot
  use blas_core_mod, only: choose_blas_core, blas_core_name
  use dense_mod, only: times_symmetric
  use huge_pages_mod, only: prefer_huge_pages
  use single_panels_mod, only: single_panels_t, make_panels, times_panels
  use system_mod, only: cpu_seconds
  implicit none

  integer, parameter :: repeats = 40
  integer, parameter :: block_rows(4) = [867, 1875, 3267, 7203]
  type(error_t), allocatable :: error
  integer, allocatable :: rows(:)
  integer :: i

  call choose_blas_core()
  call read_rows(rows, error)
  if (allocated(error)) then
    write (error_unit, '(a)') 'compliance_products: '//error%message
    stop 1
  end if
  write (output_unit, '(a)') 'rows,kernels,read_double,read_double_huge,double,read_single,'// &
    'read_single_huge,single'
  do i = 1, size(rows)
    call measure(rows(i))
  end do

contains

  !> Time the reading and the products in turns.
  subroutine measure(n)
    integer, intent(in) :: n
    real(wp), allocatable :: a(:, :), pages(:, :), huge_pages(:, :), v(:), product(:)
    type(single_panels_t) :: panels
    real(wp) :: best(6), rate(6), start, total
    integer :: i, half

    allocate (a(n, n), v(n), pages(n, n/2 + 1), huge_pages(n, n/2 + 1))
    call prefer_huge_pages(a)
    call prefer_huge_pages(huge_pages)
    call random_number(a)
    call random_number(v)
    a = a + transpose(a)
    pages = a(:, :size(pages, 2))
    huge_pages = pages
    call make_panels(a, panels)
    half = n*(n + 1)/4 ! two streams are one triangle
    best = huge(1.0_wp)
    total = 0.0_wp
    do i = 1, repeats
      call read_it(pages, half, best(1))
      call read_it(huge_pages, half, best(2))
      start = cpu_seconds()
      product = times_symmetric(a, v)
      call keep(start, best(3))
      total = total + product(n)
      call read_it(pages, half/2, best(4))
      call read_it(huge_pages, half/2, best(5))
      start = cpu_seconds()
      product = times_panels(panels, v)
      call keep(start, best(6))
      total = total + product(n)
    end do
    ! `total` is used, so that no compiler leaves anything out.
    if (.not. total > 0.0_wp) error stop 'sums of positive numbers are positive'
    rate = 4.0_wp*real(n, wp)*real(n + 1, wp)/best
    rate(4:) = 0.5_wp*rate(4:)
    write (output_unit, '(i0, 2a, 6(",", es10.4))') n, ',', blas_core_name(), rate
  end subroutine measure

  !> Read a matrix as two streams of so many numbers.
  subroutine read_it(a, half, best)
    real(wp), intent(in) :: a(*)
    integer, intent(in) :: half
    real(wp), intent(inout) :: best
    real(wp) :: start, total

    start = cpu_seconds()
    total = ddot(half, a, 1, a(half + 1), 1)
    call keep(start, best)
    if (.not. total > 0.0_wp) error stop 'sums of positive numbers are positive'
  end subroutine read_it

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
