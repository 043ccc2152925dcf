!> Rows of weights from contributions in any order.
module weight_rows_mod
  use kinds_mod, only: wp
  use lists_mod, only: lists_t, lists_by_key
  use contact_points_mod, only: weights_t
  implicit none
  private

  public :: entries_t, append_entry, make_rows

  !> A contribution to a row.
  type :: entry_t
    integer :: row = 0, node = 0
    real(wp) :: weight = 0.0_wp !! not yet divided by the node's area [length^2]
  end type entry_t

  !> Contributions to rows, in any order.
  type :: entries_t
    integer :: n = 0
    type(entry_t), allocatable :: list(:) !! room for more than n
  end type entries_t

contains

  !> One more contribution.
  pure subroutine append_entry(row, node, weight, entries)
    integer, intent(in) :: row, node
    real(wp), intent(in) :: weight !! [length^2]
    type(entries_t), intent(inout) :: entries

    if (.not. allocated(entries%list)) allocate (entries%list(64))
    if (entries%n == size(entries%list)) entries%list = [entries%list, entries%list]
    entries%n = entries%n + 1
    entries%list(entries%n) = entry_t(row, node, weight)
  end subroutine append_entry

  !> Contributions as sparse rows, each node of a row once, divided by the areas.
  pure subroutine make_rows(area, entries, weights)
    real(wp), intent(in) :: area(:)     !! (n) [length^2]
    type(entries_t), intent(in) :: entries
    type(weights_t), intent(out) :: weights
    type(lists_t) :: of_row !! contributions to each row
    integer, allocatable :: row(:)
    integer :: i, k, m, n

    allocate (row(0))
    if (entries%n > 0) row = entries%list(:entries%n)%row
    of_row = lists_by_key(merge(row, 0, area(row) > 0.0_wp), size(area))
    allocate (weights%first(size(area) + 1), weights%node(size(row)), weights%weight(size(row)))
    n = 0
    do i = 1, size(area)
      weights%first(i) = n + 1
      do k = of_row%first(i), of_row%first(i + 1) - 1
        associate (entry => entries%list(of_row%item(k)))
          m = findloc(weights%node(weights%first(i):n), entry%node, dim=1) + weights%first(i) - 1
          if (m < weights%first(i)) then
            n = n + 1
            m = n
            weights%node(m) = entry%node
            weights%weight(m) = 0.0_wp
          end if
          weights%weight(m) = weights%weight(m) + entry%weight/area(i)
        end associate
      end do
    end do
    weights%first(size(area) + 1) = n + 1
    weights%node = weights%node(:n)
    weights%weight = weights%weight(:n)
  end subroutine make_rows

end module weight_rows_mod
