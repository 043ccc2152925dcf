!> One triangle of a symmetric matrix in single precision, laid out for products with vectors.
!>
!> A product is as fast as memory is read: a triangle in single precision is a quarter of the matrix
!> in double. Panels of four columns lie one after the other, eight rows of a panel together, so
!> that memory is read from one end to the other, and an entry, once read, serves its row and its
!> column.
module single_panels_mod
  use kinds_mod, only: wp, sp
  implicit none
  private

  public :: single_panels_t, make_panels, times_panels

  integer, parameter :: columns = 4, rows = 8

  !> The lower triangle, the blocks on the diagonal whole, over `unit`.
  type :: single_panels_t
    integer :: n = 0
    real(wp) :: unit = 1.0_wp                  !! power of two near the largest entry
    integer,  allocatable :: first(:)          !! (n_panels+1) where the groups of each panel begin
    real(sp), allocatable :: diagonal(:, :, :) !! (columns,columns,n_panels)
    real(sp), allocatable :: below(:, :, :)    !! (rows,columns,n_groups) under the diagonal blocks
  end type single_panels_t

contains

  !> Round a symmetric matrix.
  pure subroutine make_panels(a, panels)
    real(wp), intent(in) :: a(:, :)        !! (n,n) the lower triangle is read
    type(single_panels_t), intent(out) :: panels
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
    allocate (panels%diagonal(columns, columns, n_panels), panels%below(rows, columns, g - 1), &
      source=0.0_sp)
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
    integer :: p, c

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
      y(c + 1:c + columns) = y(c + 1:c + columns) + matmul(panels%diagonal(:, :, p), &
        x(c + 1:c + columns))
      call add_panel(panels%first(p + 1) - panels%first(p), panels%below(:, :, panels%first(p):), &
        x(c + 1:), x(c + columns + 1:), y(c + 1:), y(c + columns + 1:))
    end do
    product = panels%unit*size_v*real(y(:panels%n), wp)
  end function times_panels

  !> Add the products of a panel and of its transpose.
  pure subroutine add_panel(n_groups, a, x_columns, x, y_columns, y)
    integer, intent(in) :: n_groups
    real(sp), intent(in) :: a(rows, columns, *)    !! (rows,columns,n_groups)
    real(sp), intent(in) :: x_columns(columns), x(rows, *)
    real(sp), intent(inout) :: y_columns(columns), y(rows, *)
    real(sp) :: total(rows, columns), x1, x2, x3, x4
    integer :: g, i

    x1 = x_columns(1)
    x2 = x_columns(2)
    x3 = x_columns(3)
    x4 = x_columns(4)
    total = 0.0_sp
    do g = 1, n_groups
      ! Eight rows side by side: compilers keep them and the sums of the columns in registers.
      do i = 1, rows
        y(i, g) = y(i, g) + ((a(i, 1, g)*x1 + a(i, 2, g)*x2) + (a(i, 3, g)*x3 + a(i, 4, g)*x4))
        total(i, 1) = total(i, 1) + a(i, 1, g)*x(i, g)
        total(i, 2) = total(i, 2) + a(i, 2, g)*x(i, g)
        total(i, 3) = total(i, 3) + a(i, 3, g)*x(i, g)
        total(i, 4) = total(i, 4) + a(i, 4, g)*x(i, g)
      end do
    end do
    y_columns = y_columns + sum(total, dim=1)
  end subroutine add_panel

end module single_panels_mod
