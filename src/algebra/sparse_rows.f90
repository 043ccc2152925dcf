!> A sparse matrix by its rows.
module sparse_rows_mod
  use kinds_mod, only: wp
  use sorting_mod, only: count_below
  implicit none
  private

  public :: rows_t, find_entry, times, sum_of_rows

  !> Rows of a sparse matrix.
  type :: rows_t
    integer,  allocatable :: first(:)   !! (n+1)
    integer,  allocatable :: column(:)  !! ascending in each row where entries are looked for
    real(wp), allocatable :: value(:)
  end type rows_t

contains

  !> Where the entry of a row and a column stands, which is there.
  pure integer function find_entry(rows, row, column) result(entry)
    type(rows_t), intent(in) :: rows
    integer, intent(in) :: row, column

    associate (first => rows%first(row), last => rows%first(row + 1) - 1)
      entry = first + count_below(column, rows%column(first:last))
    end associate
  end function find_entry

  !> The product with a vector.
  pure function times(rows, v) result(product)
    type(rows_t), intent(in) :: rows
    real(wp), intent(in) :: v(:)
    real(wp) :: product(size(rows%first) - 1)
    integer :: i, k

    product = 0.0_wp
    do i = 1, size(product)
      do k = rows%first(i), rows%first(i + 1) - 1
        product(i) = product(i) + rows%value(k)*v(rows%column(k))
      end do
    end do
  end function times

  !> The rows, each times its number, added up: the product of the transposed matrix with a vector.
  pure function sum_of_rows(rows, v, n) result(product)
    type(rows_t), intent(in) :: rows
    real(wp), intent(in) :: v(:)
    integer, intent(in) :: n            !! columns
    real(wp) :: product(n)
    integer :: i, k

    product = 0.0_wp
    do i = 1, size(v)
      do k = rows%first(i), rows%first(i + 1) - 1
        product(rows%column(k)) = product(rows%column(k)) + rows%value(k)*v(i)
      end do
    end do
  end function sum_of_rows

end module sparse_rows_mod
