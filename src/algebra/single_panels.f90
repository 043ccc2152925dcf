!> One triangle of a symmetric matrix in single precision, laid out for products with vectors.
!>
!> A product is as fast as memory is read: a triangle in single precision is a quarter of the matrix
!> in double. Panels of eight columns lie one after the other, sixteen rows of a panel together, so
!> that memory is read from one end to the other, and an entry, once read, serves its row and its
!> column. BLAS has no such layout: its SSYMV reads along columns, each of another length, which
!> takes longer.
module single_panels_mod
  use kinds_mod, only: wp, sp
  use system_mod, only: processor_flags
  use huge_pages_mod, only: prefer_huge_pages
  use panels_plain_mod, only: columns, rows, add_plain => add_panel
  use panels_avx2_mod, only: add_avx2 => add_panel
  implicit none
  private

  public :: single_panels_t, make_panels, times_panels

  !> The lower triangle, the blocks on the diagonal whole, over `unit`.
  type :: single_panels_t
    integer :: n = 0
    logical :: has_avx2 = .false.              !! the processor: AVX2 and FMA
    real(wp) :: unit = 1.0_wp                  !! power of two near the largest entry
    integer,  allocatable :: first(:)          !! (n_panels+1) where the groups of each panel begin
    real(sp), allocatable :: diagonal(:, :, :) !! (columns,columns,n_panels)
    real(sp), allocatable :: below(:, :, :)    !! (rows,columns,n_groups) under the diagonal blocks
  end type single_panels_t

contains

  !> Round a symmetric matrix.
  subroutine make_panels(a, panels)
    real(wp), intent(in) :: a(:, :)        !! (n,n) the lower triangle is read
    type(single_panels_t), intent(out) :: panels
    character(:), allocatable :: flags
    integer :: n, p, g, i, j, last, n_panels

    n = size(a, 1)
    panels%n = n
    n_panels = (n + columns - 1)/columns
    allocate (panels%first(n_panels + 1))
    g = 1
    do p = 1, n_panels
      panels%first(p) = g
      g = g + (max(0, n - columns*p) + rows - 1)/rows
      do j = columns*(p - 1) + 1, min(n, columns*p)
        panels%unit = max(panels%unit*merge(0.0_wp, 1.0_wp, p == 1), maxval(abs(a(j:, j))))
      end do
    end do
    panels%first(n_panels + 1) = g
    if (panels%unit > 0.0_wp) panels%unit = scale(1.0_wp, exponent(panels%unit))
    if (panels%unit <= 0.0_wp) panels%unit = 1.0_wp
    allocate (panels%diagonal(columns, columns, n_panels), panels%below(rows, columns, g - 1))
    call prefer_huge_pages(panels%below)
    panels%diagonal = 0.0_sp
    panels%below = 0.0_sp
    flags = processor_flags()
    panels%has_avx2 = index(flags, ' avx2 ') > 0 .and. index(flags, ' fma ') > 0
    do p = 1, n_panels
      do j = 1, min(columns, n - columns*(p - 1))
        associate (column => columns*(p - 1) + j)
          do i = j, min(columns, n - columns*(p - 1))
            panels%diagonal(i, j, p) = real(a(columns*(p - 1) + i, column)/panels%unit, sp)
            panels%diagonal(j, i, p) = panels%diagonal(i, j, p)
          end do
          do g = panels%first(p), panels%first(p + 1) - 1
            i = columns*p + rows*(g - panels%first(p))
            last = min(rows, n - i)
            panels%below(:last, j, g) = real(a(i + 1:i + last, column)/panels%unit, sp)
          end do
        end associate
      end do
    end do
  end subroutine make_panels

  !> The product with a vector, to the digits of single precision, in any unit.
  pure function times_panels(panels, v) result(product)
    type(single_panels_t), intent(in) :: panels
    real(wp), intent(in) :: v(:)            !! (n)
    real(wp) :: product(size(v))
    real(sp), dimension(panels%n + columns + rows) :: x, y !! padded: whole groups at the end
    real(wp) :: size_v
    integer :: p, c, j, n_groups
    procedure(add_plain), pointer :: add_panel

    add_panel => add_plain
    if (panels%has_avx2) add_panel => add_avx2
    product = 0.0_wp
    if (panels%n == 0) return
    size_v = maxval(abs(v))
    if (.not. size_v > 0.0_wp) return
    size_v = scale(1.0_wp, exponent(size_v))
    x(:panels%n) = real(v/size_v, sp)
    x(panels%n + 1:) = 0.0_sp
    y = 0.0_sp
    do p = 1, size(panels%first) - 1
      c = columns*(p - 1)
      do j = 1, columns
        y(c + 1:c + columns) = y(c + 1:c + columns) + panels%diagonal(:, j, p)*x(c + j)
      end do
      n_groups = panels%first(p + 1) - panels%first(p)
      if (n_groups > 0) call add_panel(n_groups, panels%below(1, 1, panels%first(p)), x(c + 1), &
        x(c + columns + 1), y(c + 1), y(c + columns + 1))
    end do
    product = panels%unit*size_v*real(y(:panels%n), wp)
  end function times_panels

end module single_panels_mod
