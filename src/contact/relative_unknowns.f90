!> Unknowns in which a slave node before a body has, in the place of its displacement, that relative
!> to its master:
!>
!>     u_own = d_own + sum_k w_k u_k,      u = T d
!>
!> one line a direction of a point; forces go the other way, T^T f. docs/theory.md (4.20).
module relative_unknowns_mod
  use kinds_mod, only: wp
  use growing_lists_mod, only: append, enlarge
  implicit none
  private

  public :: relative_unknowns_t, add_line, order_lines, add_masters, take_off_masters, &
    give_to_masters, take_from_masters, give_diagonal

  type :: relative_unknowns_t
    integer :: n = 0                       !! lines
    integer,  allocatable :: own(:)        !! (n) the slave's unknown
    integer,  allocatable :: first(:)      !! (n+1) where each line begins
    integer,  allocatable :: other(:)      !! (n_entries) what the master moves with
    real(wp), allocatable :: weight(:)     !! (n_entries) [-]
  end type relative_unknowns_t

contains

  !> One more line.
  pure subroutine add_line(relative, own, other, weight)
    type(relative_unknowns_t), intent(inout) :: relative
    integer, intent(in) :: own
    integer, intent(in) :: other(:)    !! (m) not `own`
    real(wp), intent(in) :: weight(:)  !! (m) [-]
    integer :: n, used

    if (.not. allocated(relative%first)) then
      allocate (relative%own(0), relative%first(1), relative%other(0), relative%weight(0))
      relative%first = 1
    end if
    n = relative%n
    used = relative%first(n + 1) - 1
    call append(relative%own, relative%n, own)
    if (used + size(weight) > size(relative%weight)) call enlarge(relative%weight, used, &
      2*(used + size(weight)))
    relative%weight(used + 1:used + size(weight)) = weight
    call append(relative%other, used, other)
    n = n + 1
    call append(relative%first, n, used + 1)
  end subroutine add_line

  !> Put every line behind those of its master, whose nodes may be slaves of others; false where a
  !> slave is its own master in the end.
  pure subroutine order_lines(relative, n_unknowns, is_ordered)
    type(relative_unknowns_t), intent(inout) :: relative
    integer, intent(in) :: n_unknowns
    logical, intent(out) :: is_ordered
    type(relative_unknowns_t) :: ordered
    logical :: waits(n_unknowns), is_placed(relative%n)
    integer :: l, before

    waits = .false.
    if (relative%n > 0) waits(relative%own(:relative%n)) = .true.
    is_placed = .false.
    do
      before = ordered%n
      do l = 1, relative%n
        associate (of_line => relative%other(relative%first(l):relative%first(l + 1) - 1))
          if (is_placed(l) .or. any(waits(of_line))) cycle
          call add_line(ordered, relative%own(l), of_line, relative%weight(relative%first(l): &
            relative%first(l + 1) - 1))
        end associate
        waits(relative%own(l)) = .false.
        is_placed(l) = .true.
      end do
      if (ordered%n == before) exit
    end do
    is_ordered = ordered%n == relative%n
    relative = ordered
  end subroutine order_lines

  !> From relative displacements to displacements: T v.
  pure subroutine add_masters(relative, v)
    type(relative_unknowns_t), intent(in) :: relative
    real(wp), intent(inout) :: v(:) !! (n_unknowns) [length]
    integer :: l, k

    do l = 1, relative%n
      do k = relative%first(l), relative%first(l + 1) - 1
        v(relative%own(l)) = v(relative%own(l)) + relative%weight(k)*v(relative%other(k))
      end do
    end do
  end subroutine add_masters

  !> From displacements to relative displacements: T^-1 v.
  pure subroutine take_off_masters(relative, v)
    type(relative_unknowns_t), intent(in) :: relative
    real(wp), intent(inout) :: v(:) !! (n_unknowns) [length]
    integer :: l, k

    do l = relative%n, 1, -1
      do k = relative%first(l), relative%first(l + 1) - 1
        v(relative%own(l)) = v(relative%own(l)) - relative%weight(k)*v(relative%other(k))
      end do
    end do
  end subroutine take_off_masters

  !> Forces of displacements as those of relative ones: T^T f.
  pure subroutine give_to_masters(relative, f)
    type(relative_unknowns_t), intent(in) :: relative
    real(wp), intent(inout) :: f(:) !! (n_unknowns) [force]
    integer :: l, k

    do l = relative%n, 1, -1
      do k = relative%first(l), relative%first(l + 1) - 1
        f(relative%other(k)) = f(relative%other(k)) + relative%weight(k)*f(relative%own(l))
      end do
    end do
  end subroutine give_to_masters

  !> And back: T^-T f.
  pure subroutine take_from_masters(relative, f)
    type(relative_unknowns_t), intent(in) :: relative
    real(wp), intent(inout) :: f(:) !! (n_unknowns) [force]
    integer :: l, k

    do l = 1, relative%n
      do k = relative%first(l), relative%first(l + 1) - 1
        f(relative%other(k)) = f(relative%other(k)) - relative%weight(k)*f(relative%own(l))
      end do
    end do
  end subroutine take_from_masters

  !> The diagonal of T^T K T, about: without what joins unknowns.
  pure subroutine give_diagonal(relative, diagonal)
    type(relative_unknowns_t), intent(in) :: relative
    real(wp), intent(inout) :: diagonal(:) !! (n_unknowns) that of K in [force/length]
    integer :: l, k

    do l = relative%n, 1, -1
      do k = relative%first(l), relative%first(l + 1) - 1
        diagonal(relative%other(k)) = diagonal(relative%other(k)) + relative%weight(k)**2* &
          diagonal(relative%own(l))
      end do
    end do
  end subroutine give_diagonal

end module relative_unknowns_mod
