!> The stiffness of the contact points as far as it is near, without a Schur complement.
!>
!> Of the interior i the unknowns beside the interface c are eliminated as if each stood alone,
!>
!>     S ~ K_cc - K_ci D^-1 K_ic,      D the diagonal of K_ii,
!>
!> which is sparse. docs/theory.md (4.13).
module near_elimination_mod
  use kinds_mod, only: wp, i8
  use near_stiffness_mod, only: near_stiffness_t, keep_near
  use assembly_mod, only: triplets_t, diagonal_of
  implicit none
  private

  public :: eliminate_nearby

  real(wp), parameter :: least_left = 0.05_wp !! of the diagonal of K_cc, in that of S [-]

  !> Rows of a sparse matrix.
  type :: rows_t
    integer,  allocatable :: first(:)   !! (n+1)
    integer,  allocatable :: column(:)
    real(wp), allocatable :: value(:)
  end type rows_t

  !> The parts of K, and of S the row that is made at the moment.
  type :: elimination_t
    type(rows_t) :: cc, ci, ic         !! K_cc, K_ci and its transpose
    real(wp), allocatable :: d(:)      !! (n_interior)
    real(wp), allocatable :: row(:)    !! (n_interface) 0 where it is not listed
    logical,  allocatable :: is_listed(:) !! (n_interface)
    integer,  allocatable :: listed(:)    !! (n_interface) the first n of them
    integer :: n = 0
  end type elimination_t

contains

  !> The blocks of S at the points, and how far each unknown of the interface gives way alone.
  subroutine eliminate_nearby(k, n_interface, index, near, flexibility)
    type(triplets_t), intent(in) :: k          !! the whole matrix
    integer, intent(in) :: n_interface         !! the last unknowns
    integer, intent(in) :: index(:, :)
    !! (3,n_points) unknowns of the points, counted from the first of the interface, or 0
    type(near_stiffness_t), intent(out) :: near
    real(wp), allocatable, intent(out) :: flexibility(:) !! (n_interface) 1/S_ee [length/force]
    type(elimination_t) :: work
    type(near_stiffness_t) :: all
    integer :: i, a, n, n_points
    integer, allocatable :: head(:, :), next(:, :), place(:)

    n_points = size(index, 2)
    call split(k, n_interface, work)
    allocate (flexibility(n_interface))
    do i = 1, n_interface
      call make_row(work, i)
      flexibility(i) = 1.0_wp/work%row(i)
      call clear_row(work)
    end do
    ! The points that have an unknown as their first, second or third.
    allocate (head(n_interface, 3), source=0)
    allocate (next(3, n_points), source=0)
    allocate (place(n_points), source=0)
    do i = n_points, 1, -1
      do a = 1, 3
        if (index(a, i) == 0) cycle
        next(a, i) = head(index(a, i), a)
        head(index(a, i), a) = i
      end do
    end do
    allocate (all%start(n_points + 1), all%other(30*n_points + 1), all%block(3, 3, &
      30*n_points + 1))
    n = 0
    do i = 1, n_points
      call add_point(i)
    end do
    all%start(n_points + 1) = n + 1
    call keep_near(all, near)

  contains

    subroutine add_point(point)
      integer, intent(in) :: point
      integer :: b, c, e, other

      all%start(point) = n + 1
      call take_block(point)
      do b = 1, 3
        if (index(b, point) == 0) cycle
        call make_row(work, index(b, point))
        do e = 1, work%n
          do c = 1, 3
            other = head(work%listed(e), c)
            do while (other > 0)
              ! Points that share unknowns hold each other in a way that no block says.
              if (other == point .or. .not. any(index(:, other) > 0 .and. &
                index(:, other) == index(:, point))) then
                if (place(other) < all%start(point)) call take_block(other)
                all%block(b, c, place(other)) = work%row(work%listed(e))
              end if
              other = next(c, other)
            end do
          end do
        end do
        call clear_row(work)
      end do
    end subroutine add_point

    !> One more block of the point.
    subroutine take_block(other)
      integer, intent(in) :: other
      integer, allocatable :: longer(:)
      real(wp), allocatable :: more(:, :, :)

      if (n == size(all%other)) then
        allocate (longer(2*n), more(3, 3, 2*n))
        longer(:n) = all%other
        more(:, :, :n) = all%block
        call move_alloc(longer, all%other)
        call move_alloc(more, all%block)
      end if
      n = n + 1
      all%other(n) = other
      all%block(:, :, n) = 0.0_wp
      place(other) = n
    end subroutine take_block

  end subroutine eliminate_nearby

  !> What of K touches the interface.
  subroutine split(k, n_interface, work)
    type(triplets_t), intent(in) :: k
    integer, intent(in) :: n_interface
    type(elimination_t), intent(out) :: work
    real(wp) :: diagonal(k%n)
    integer :: n_interior, pass, c, other, i
    integer(i8) :: entry

    n_interior = k%n - n_interface
    diagonal = diagonal_of(k)
    allocate (work%d(n_interior), source=diagonal(:n_interior))
    allocate (work%row(n_interface), source=0.0_wp)
    allocate (work%listed(n_interface), source=0)
    allocate (work%is_listed(n_interface), source=.false.)
    allocate (work%cc%first(n_interface + 1), work%ci%first(n_interface + 1), &
      work%ic%first(n_interior + 1), source=0)
    do pass = 1, 2
      do entry = 1, size(k%row, kind=i8)
        c = k%row(entry) - n_interior
        if (c <= 0) cycle
        other = k%column(entry)
        if (other <= n_interior) then
          call add(work%ci, c, other)
          call add(work%ic, other, c)
        else
          other = other - n_interior
          call add(work%cc, c, other)
          if (other /= c) call add(work%cc, other, c)
        end if
      end do
      if (pass == 1) then
        call begin(work%cc)
        call begin(work%ci)
        call begin(work%ic)
      end if
    end do
    ! The second pass has moved each beginning to the end of its row.
    do i = n_interface, 1, -1
      work%cc%first(i + 1) = work%cc%first(i)
      work%ci%first(i + 1) = work%ci%first(i)
    end do
    do i = n_interior, 1, -1
      work%ic%first(i + 1) = work%ic%first(i)
    end do
    work%cc%first(1) = 1
    work%ci%first(1) = 1
    work%ic%first(1) = 1

  contains

    !> Count an entry, then put it in its place.
    subroutine add(rows, row, column)
      type(rows_t), intent(inout) :: rows
      integer, intent(in) :: row, column

      if (pass == 2) then
        rows%column(rows%first(row)) = column
        rows%value(rows%first(row)) = k%value(entry)
      end if
      rows%first(row) = rows%first(row) + 1
    end subroutine add

    !> From counts to the beginnings of rows.
    subroutine begin(rows)
      type(rows_t), intent(inout) :: rows
      integer :: position, n, j

      position = 1
      do j = 1, size(rows%first)
        n = rows%first(j)
        rows%first(j) = position
        position = position + n
      end do
      allocate (rows%column(position - 1), rows%value(position - 1))
    end subroutine begin

  end subroutine split

  !> A row of S.
  subroutine make_row(work, c)
    type(elimination_t), intent(inout) :: work
    integer, intent(in) :: c
    integer :: k, l, j
    real(wp) :: of_diagonal

    call add(c, 0.0_wp)
    do k = work%cc%first(c), work%cc%first(c + 1) - 1
      call add(work%cc%column(k), work%cc%value(k))
    end do
    of_diagonal = work%row(c)
    do k = work%ci%first(c), work%ci%first(c + 1) - 1
      j = work%ci%column(k)
      do l = work%ic%first(j), work%ic%first(j + 1) - 1
        call add(work%ic%column(l), -work%ci%value(k)*work%ic%value(l)/work%d(j))
      end do
    end do
    ! D may be softer than what it stands for.
    work%row(c) = max(work%row(c), least_left*of_diagonal)

  contains

    subroutine add(column, value)
      integer, intent(in) :: column
      real(wp), intent(in) :: value

      if (.not. work%is_listed(column)) then
        work%n = work%n + 1
        work%listed(work%n) = column
        work%is_listed(column) = .true.
      end if
      work%row(column) = work%row(column) + value
    end subroutine add

  end subroutine make_row

  subroutine clear_row(work)
    type(elimination_t), intent(inout) :: work

    work%row(work%listed(:work%n)) = 0.0_wp
    work%is_listed(work%listed(:work%n)) = .false.
    work%n = 0
  end subroutine clear_row

end module near_elimination_mod
