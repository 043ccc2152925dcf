!> Lists that grow while they are filled: their first `n` entries count, and a full list at least
!> doubles.
module growing_lists_mod
  use kinds_mod, only: wp
  implicit none
  private

  public :: append, enlarge

  !> Put entries behind the first `n` of a list: `append(list, n, values)`; `n` counts them too.
  interface append
    module procedure append_integer, append_integers, append_column
  end interface append

  !> Make a list longer, keeping its first entries: `enlarge(list, used, want)`.
  interface enlarge
    module procedure enlarge_integers, enlarge_reals, enlarge_columns, enlarge_real_columns
  end interface enlarge

contains

  pure subroutine append_integer(list, n, value)
    integer, allocatable, intent(inout) :: list(:)
    integer, intent(inout) :: n
    integer, intent(in) :: value

    if (.not. allocated(list)) allocate (list(64))
    if (n == size(list)) call enlarge(list, n, max(64, 2*n))
    n = n + 1
    list(n) = value
  end subroutine append_integer

  pure subroutine append_integers(list, n, values)
    integer, allocatable, intent(inout) :: list(:) !! not allocated: empty
    integer, intent(inout) :: n
    integer, intent(in) :: values(:)

    if (.not. allocated(list)) allocate (list(size(values)))
    if (n + size(values) > size(list)) call enlarge(list, n, max(n + size(values), 2*size(list)))
    list(n + 1:n + size(values)) = values
    n = n + size(values)
  end subroutine append_integers

  pure subroutine append_column(list, n, column)
    integer, allocatable, intent(inout) :: list(:, :)
    integer, intent(inout) :: n
    integer, intent(in) :: column(:)

    if (n == size(list, 2)) call enlarge(list, n, max(64, 2*n))
    n = n + 1
    list(:, n) = column
  end subroutine append_column

  pure subroutine enlarge_integers(list, used, want)
    integer, allocatable, intent(inout) :: list(:)
    integer, intent(in) :: used  !! entries to keep
    integer, intent(in) :: want  !! entries to have
    integer, allocatable :: larger(:)

    allocate (larger(want))
    larger(:used) = list(:used)
    call move_alloc(larger, list)
  end subroutine enlarge_integers

  pure subroutine enlarge_reals(list, used, want)
    real(wp), allocatable, intent(inout) :: list(:)
    integer, intent(in) :: used, want
    real(wp), allocatable :: larger(:)

    allocate (larger(want))
    larger(:used) = list(:used)
    call move_alloc(larger, list)
  end subroutine enlarge_reals

  pure subroutine enlarge_columns(list, used, want)
    integer, allocatable, intent(inout) :: list(:, :)
    integer, intent(in) :: used, want !! columns
    integer, allocatable :: larger(:, :)

    allocate (larger(size(list, 1), want))
    larger(:, :used) = list(:, :used)
    call move_alloc(larger, list)
  end subroutine enlarge_columns

  pure subroutine enlarge_real_columns(list, used, want)
    real(wp), allocatable, intent(inout) :: list(:, :)
    integer, intent(in) :: used, want
    real(wp), allocatable :: larger(:, :)

    allocate (larger(size(list, 1), want))
    larger(:, :used) = list(:, :used)
    call move_alloc(larger, list)
  end subroutine enlarge_real_columns

end module growing_lists_mod
