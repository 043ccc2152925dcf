!> Springs between nodes: of each the motion d = sum_k B_k u_k of its ends, whatever stiffness it
!> has.
module springs_mod
  use kinds_mod, only: wp
  use growing_lists_mod, only: append
  use sorting_mod, only: sort_unique
  implicit none
  private

  public :: springs_t, add_spring, trim_springs, some_springs, are_same, ends_of, joined_pairs

  type :: springs_t
    integer :: n = 0
    integer, allocatable :: first(:)        !! (n+1) where the ends of each begin
    integer, allocatable :: at(:)           !! (n_ends) the node of each end, or its row
    real(wp), allocatable :: share(:, :, :) !! (3,3,n_ends) B_k [-]
  end type springs_t

contains

  !> One more spring; behind the last one of all `trim_springs` gives back what is too much.
  pure subroutine add_spring(springs, at, share)
    type(springs_t), intent(inout) :: springs
    integer, intent(in) :: at(:)           !! (m) its ends, distinct
    real(wp), intent(in) :: share(:, :, :) !! (3,3,m) B_k [-]
    real(wp), allocatable :: larger(:, :, :)
    integer :: n, used

    if (springs%n == 0) then
      springs%first = [1]
      allocate (springs%at(0), springs%share(3, 3, 0))
    end if
    n = springs%n + 1
    used = springs%first(n) - 1
    if (used + size(at) > size(springs%share, 3)) then
      allocate (larger(3, 3, 2*(used + size(at))))
      larger(:, :, :used) = springs%share(:, :, :used)
      call move_alloc(larger, springs%share)
    end if
    springs%share(:, :, used + 1:used + size(at)) = share
    call append(springs%at, used, at)
    springs%n = n
    call append(springs%first, n, used + 1)
  end subroutine add_spring

  pure subroutine trim_springs(springs)
    type(springs_t), intent(inout) :: springs
    integer :: n

    if (springs%n == 0) return
    n = springs%first(springs%n + 1) - 1
    springs%first = springs%first(:springs%n + 1)
    springs%at = springs%at(:n)
    springs%share = springs%share(:, :, :n)
  end subroutine trim_springs

  !> Those that have an end that is kept, with these ends alone.
  pure type(springs_t) function some_springs(springs, at) result(some)
    type(springs_t), intent(in) :: springs
    integer, intent(in) :: at(:) !! (n_ends) what each end is now, 0 where it is not kept
    integer :: i, k, n

    some%n = springs%n
    allocate (some%first(springs%n + 1), some%at(count(at > 0)))
    allocate (some%share(3, 3, size(some%at)))
    n = 0
    some%first(1) = 1
    do i = 1, springs%n
      do k = springs%first(i), springs%first(i + 1) - 1
        if (at(k) == 0) cycle
        n = n + 1
        some%at(n) = at(k)
        some%share(:, :, n) = springs%share(:, :, k)
      end do
      some%first(i + 1) = n + 1
    end do
  end function some_springs

  !> Whether they are the same ones.
  pure logical function are_same(one, other)
    type(springs_t), intent(in) :: one, other

    are_same = one%n == other%n
    if (.not. are_same .or. one%n == 0) return
    are_same = size(one%at) == size(other%at)
    if (are_same) are_same = all(one%first == other%first) .and. all(one%at == other%at) .and. &
      .not. any(abs(one%share - other%share) > 0.0_wp)
  end function are_same

  !> The nodes, or rows, of all ends, ascending.
  pure function ends_of(springs) result(ends)
    type(springs_t), intent(in) :: springs
    integer, allocatable :: ends(:)

    allocate (ends(0))
    if (springs%n == 0) return
    ends = springs%at
    call sort_unique(ends)
  end function ends_of

  !> Two ends of one spring, each pair of them; repeated where springs share both.
  pure subroutine joined_pairs(springs, higher, lower)
    type(springs_t), intent(in) :: springs
    integer, allocatable, intent(out) :: higher(:), lower(:) !! (n_pairs) nodes, or rows
    integer :: i, k, l, n, pass

    allocate (higher(0), lower(0))
    if (springs%n == 0) return
    do pass = 1, 2
      n = 0
      do i = 1, springs%n
        do k = springs%first(i), springs%first(i + 1) - 1
          do l = springs%first(i), k - 1
            if (springs%at(k) == springs%at(l)) cycle
            n = n + 1
            if (pass == 1) cycle
            higher(n) = max(springs%at(k), springs%at(l))
            lower(n) = min(springs%at(k), springs%at(l))
          end do
        end do
      end do
      if (pass == 2) exit
      deallocate (higher, lower)
      allocate (higher(n), lower(n))
    end do
  end subroutine joined_pairs

end module springs_mod
