!> Contact rows that constraints make dependent: reactions that no body feels.
!>
!> What joins both sides of a pair beside or within its contact (a weld, a mean of displacements, a
!> coupling) can carry what contact carries. With B the rows of the points in the unknowns that are
!> left once supports and constraints are put in, reactions N c with B^T N = 0 go from contact to
!> the constraints and back, and move nothing: they are not determined. docs/theory.md (11.20).
!>
!> N follows from the rows alone, from weights, frames and constraints, never from a stiffness.
module dependent_rows_mod
  use kinds_mod, only: wp
  use dense_mod, only: null_space
  use constraints_mod, only: constraints_t, constraint_of
  use contact_points_mod, only: contact_points_t, weights_t, list_slave
  implicit none
  private

  public :: find_dependent_rows, points_of_rows, redundant_points, uncarried_overlaps

  real(wp), parameter :: rounding = 1.0e-12_wp
  !! of the largest that coefficients of a point are summed from [-]
  real(wp), parameter :: dependent = 1.0e-9_wp
  !! of the largest singular value: nothing. Weights are rounded by 1e-15 to 1e-12 of 1; an obstacle
  !! that leans by 1e-4 against a guide is determined [-]
  integer,  parameter :: most_rows = 1500
  !! that hang together: a singular value decomposition takes a second. More of them stay as they
  !! are, singular, with proximal steps

  !> The rows of the points in the unknowns: three components a point and unknown.
  type :: unknown_rows_t
    integer,  allocatable :: point(:)     !! (m) points that have rows
    logical,  allocatable :: is_joined(:) !! (m) a constraint has a part in it
    integer,  allocatable :: first(:)     !! (m+1) where the entries of each begin
    integer,  allocatable :: unknown(:)   !! (n_entries) 3 (node - 1) + dof
    real(wp), allocatable :: value(:, :)  !! (3,n_entries) n, t1, t2; 0 where there is no row [-]
  end type unknown_rows_t

contains

  !> The reactions N that no body feels, orthonormal; none where nothing is constrained.
  !>
  !> A point one of whose unknowns is that of no other point has its share in it for itself: where
  !> these alone make its rows independent it is in no such combination, and others that share
  !> unknowns with it alone are not either. What is left over is decomposed.
  subroutine find_dependent_rows(points, weights, frame, row, is_unknown, active, basis)
    type(contact_points_t), intent(in) :: points
    type(weights_t), intent(in) :: weights
    real(wp), intent(in) :: frame(:, :, :)     !! (3,3,n_points) columns n, t1, t2
    integer, intent(in) :: row(:, :)           !! (3,n_points) 0 where there is none
    logical, intent(in) :: is_unknown(:, :)    !! (3,n_nodes) that may move, pins of motions too
    type(constraints_t), intent(in) :: active  !! chains substituted
    real(wp), allocatable, intent(out) :: basis(:, :) !! (n_rows,k) N [-]
    type(unknown_rows_t) :: rows
    integer, allocatable :: part(:), those(:)
    integer :: i, k

    allocate (basis(count(row > 0), 0))
    if (active%n == 0 .or. size(basis, 1) == 0) return
    call rows_in_unknowns(points, weights, frame, row, is_unknown, active, rows)
    if (.not. any(rows%is_joined)) return
    call split(rows, 3*size(is_unknown, 2), row, part)
    do i = 1, maxval([0, part])
      those = pack([(k, k=1, size(part))], part == i)
      if (.not. any(rows%is_joined(those))) cycle
      if (count(row(:, rows%point(those)) > 0) > most_rows) cycle
      call add_null_space(rows, those, row, basis)
    end do
  end subroutine find_dependent_rows

  !> The points in whose rows some reactions have a part.
  pure function points_of_rows(row, basis) result(has_part)
    integer, intent(in) :: row(:, :)      !! (3,n_points) 0 where there is none
    real(wp), intent(in) :: basis(:, :)    !! (n_rows,k)
    logical :: has_part(size(row, 2))
    integer :: i, a

    has_part = .false.
    do i = 1, size(row, 2)
      do a = 1, 3
        if (row(a, i) > 0) has_part(i) = has_part(i) .or. any(abs(basis(row(a, i), :)) > 0.0_wp)
      end do
    end do
  end function points_of_rows

  !> The points whose reactions are not determined: those in which combinations of points that
  !> touch have a part. What is apart has none.
  function redundant_points(row, basis, touches) result(redundant)
    integer, intent(in) :: row(:, :)      !! (3,n_points) 0 where there is none
    real(wp), intent(in) :: basis(:, :)    !! (n_rows,k) N [-]
    logical, intent(in) :: touches(:)     !! (n_points)
    logical :: redundant(size(row, 2))
    real(wp), allocatable :: apart(:, :), left(:, :)
    integer, allocatable :: those(:), own(:)
    integer :: i

    redundant = .false.
    if (size(basis, 2) == 0) return
    redundant = points_of_rows(row, basis)
    those = pack([(i, i=1, size(touches))], redundant .and. .not. touches)
    if (size(those) == 0) return
    own = pack(row(:, those), row(:, those) > 0)
    allocate (apart, source=basis(own, :))
    left = matmul(basis, null_space(apart, dependent))
    where (abs(left) <= dependent) left = 0.0_wp
    redundant = points_of_rows(row, left)
  end function redundant_points

  !> By how much points overlap that no motion can part, for what adds up in N^T x stays as it is:
  !> the least that has to be added to gaps for some to be there that are nowhere negative.
  pure function uncarried_overlaps(row, basis, gap) result(depth)
    integer, intent(in) :: row(:, :)      !! (3,n_points) 0 where there is none
    real(wp), intent(in) :: basis(:, :)    !! (n_rows,k) N [-]
    real(wp), intent(in) :: gap(:)        !! (n_points) [length]
    real(wp) :: depth(size(gap))          !! at least 0 [length]
    integer,  parameter :: most_rounds = 1000
    real(wp), parameter :: settled = 1.0e-12_wp !! of the gaps [-]
    real(wp) :: x(size(basis, 1)), left(size(basis, 2)), step, longest
    logical :: is_normal(size(basis, 1))
    integer :: i, round

    depth = 0.0_wp
    if (size(basis, 2) == 0) return
    x = 0.0_wp
    is_normal = .false.
    do i = 1, size(gap)
      if (row(1, i) == 0) cycle
      x(row(1, i)) = gap(i)
      is_normal(row(1, i)) = .true.
    end do
    if (all(x >= 0.0_wp .or. all(abs(basis) <= 0.0_wp, dim=2))) return
    left = matmul(x, basis)
    where (is_normal) x = max(0.0_wp, x)
    left = left - matmul(x, basis)
    ! |N^T x - N^T gap| by one row after the other.
    do round = 1, most_rounds
      longest = 0.0_wp
      do i = 1, size(x)
        if (.not. any(abs(basis(i, :)) > 0.0_wp)) cycle
        step = dot_product(left, basis(i, :))/dot_product(basis(i, :), basis(i, :))
        if (is_normal(i)) step = max(step, -x(i))
        x(i) = x(i) + step
        left = left - step*basis(i, :)
        longest = max(longest, abs(step))
      end do
      if (longest <= settled*maxval(abs(gap), mask=row(1, :) > 0)) exit
    end do
    do i = 1, size(gap)
      if (row(1, i) > 0) depth(i) = max(0.0_wp, -dot_product(left, basis(row(1, i), :)))
    end do
  end function uncarried_overlaps

  !> B of the points that have rows, constraints put in.
  subroutine rows_in_unknowns(points, weights, frame, row, is_unknown, active, rows)
    type(contact_points_t), intent(in) :: points
    type(weights_t), intent(in) :: weights
    real(wp), intent(in) :: frame(:, :, :)     !! (3,3,n_points)
    integer, intent(in) :: row(:, :)           !! (3,n_points)
    logical, intent(in) :: is_unknown(:, :)    !! (3,n_nodes)
    type(constraints_t), intent(in) :: active
    type(unknown_rows_t), intent(out) :: rows
    integer :: number(3, size(is_unknown, 2)), at(3*size(is_unknown, 2))
    logical :: is_master(3, size(is_unknown, 2))
    integer,  allocatable :: unknown(:)
    real(wp), allocatable :: value(:, :), sizes(:)
    integer :: i, k, l, m, n, n_entries, c, n_slaves, slave(3)
    real(wp) :: factor(3)

    number = constraint_of(active, size(is_unknown, 2))
    is_master = .false.
    do k = 1, active%first(active%n + 1) - 1
      is_master(active%master_dof(k), active%master(k)) = .true.
    end do
    m = count(row(1, :) > 0)
    rows%point = pack([(i, i=1, size(row, 2))], row(1, :) > 0)
    allocate (rows%is_joined(m), source=.false.)
    allocate (rows%first(m + 1), source=1)
    allocate (rows%unknown(16*m), rows%value(3, 16*m))
    allocate (unknown(64), value(3, 64), sizes(64))
    at = 0
    n_entries = 0
    do l = 1, m
      i = rows%point(l)
      n = 0
      call list_slave(points, weights, i, n_slaves, slave, factor)
      do k = 1, n_slaves
        call add_node(slave(k), factor(k))
      end do
      do k = weights%first(i), weights%first(i + 1) - 1
        call add_node(weights%node(k), -weights%weight(k))
      end do
      at(unknown(:n)) = 0
      do c = 1, n
        value(:, c) = matmul(value(:, c), frame(:, :, i))
        where (row(:, i) == 0 .or. abs(value(:, c)) <= rounding*maxval(sizes(:n))) value(:, c) = &
          0.0_wp
        if (.not. any(abs(value(:, c)) > 0.0_wp)) cycle
        n_entries = n_entries + 1
        call make_room()
        rows%unknown(n_entries) = unknown(c)
        rows%value(:, n_entries) = value(:, c)
      end do
      rows%first(l + 1) = n_entries + 1
    end do

  contains

    subroutine add_node(node, weight)
      integer, intent(in) :: node
      real(wp), intent(in) :: weight
      integer :: dof, j

      do dof = 1, 3
        associate (own => number(dof, node))
          if (own > 0) then
            rows%is_joined(l) = .true.
            do j = active%first(own), active%first(own + 1) - 1
              call add_entry(active%master(j), active%master_dof(j), dof, weight*active%weight(j))
            end do
          else
            if (is_master(dof, node)) rows%is_joined(l) = .true.
            call add_entry(node, dof, dof, weight)
          end if
        end associate
      end do
    end subroutine add_node

    !> What an unknown does along a direction of the point.
    subroutine add_entry(node, dof, along, coefficient)
      integer, intent(in) :: node, dof, along
      real(wp), intent(in) :: coefficient

      if (.not. is_unknown(dof, node)) return
      associate (here => 3*(node - 1) + dof)
        if (at(here) == 0) then
          if (n == size(unknown)) then
            unknown = [unknown, unknown]
            sizes = [sizes, sizes]
            value = reshape([value, value], [3, 2*n])
          end if
          n = n + 1
          at(here) = n
          unknown(n) = here
          value(:, n) = 0.0_wp
          sizes(n) = 0.0_wp
        end if
        value(along, at(here)) = value(along, at(here)) + coefficient
        sizes(at(here)) = sizes(at(here)) + abs(coefficient)
      end associate
    end subroutine add_entry

    subroutine make_room()
      if (n_entries <= size(rows%unknown)) return
      rows%unknown = [rows%unknown, rows%unknown]
      rows%value = reshape([rows%value, rows%value], [3, size(rows%unknown)])
    end subroutine make_room

  end subroutine rows_in_unknowns

  !> Leave out the points that are in no combination, and split the others into those that hang
  !> together by unknowns.
  pure subroutine split(rows, n_unknowns, row, part)
    type(unknown_rows_t), intent(in) :: rows
    integer, intent(in) :: n_unknowns, row(:, :)
    integer, allocatable, intent(out) :: part(:)  !! (m) 0 of those left out
    logical :: stays(size(rows%point)), goes_on
    integer :: n_at(n_unknowns), root(n_unknowns), n_parts, root_here, i, k, one, other

    n_at = 0
    do k = 1, rows%first(size(rows%point) + 1) - 1
      n_at(rows%unknown(k)) = n_at(rows%unknown(k)) + 1
    end do
    stays = .true.
    goes_on = .true.
    do while (goes_on)
      goes_on = .false.
      do i = 1, size(stays)
        if (.not. stays(i)) cycle
        associate (entries => [(k, k=rows%first(i), rows%first(i + 1) - 1)])
          if (rank_of(rows%value(:, pack(entries, n_at(rows%unknown(entries)) == 1))) < &
            count(row(:, rows%point(i)) > 0)) cycle
          n_at(rows%unknown(entries)) = n_at(rows%unknown(entries)) - 1
        end associate
        stays(i) = .false.
        goes_on = .true.
      end do
    end do
    ! An unknown of several points joins them; each part is named by the least of its unknowns.
    root = [(k, k=1, n_unknowns)]
    do i = 1, size(stays)
      if (.not. stays(i)) cycle
      do k = rows%first(i) + 1, rows%first(i + 1) - 1
        one = top(rows%unknown(rows%first(i)))
        other = top(rows%unknown(k))
        root(max(one, other)) = min(one, other)
      end do
    end do
    allocate (part(size(stays)), source=0)
    n_at = 0
    n_parts = 0
    do i = 1, size(stays)
      if (.not. stays(i)) cycle
      if (rows%first(i) == rows%first(i + 1)) then
        ! Nothing of it can move.
        n_parts = n_parts + 1
        part(i) = n_parts
        cycle
      end if
      root_here = top(rows%unknown(rows%first(i)))
      associate (number => n_at(root_here))
        if (number == 0) then
          n_parts = n_parts + 1
          number = n_parts
        end if
        part(i) = number
      end associate
    end do

  contains

    pure integer function top(unknown)
      integer, intent(in) :: unknown

      top = unknown
      do while (root(top) /= top)
        top = root(top)
      end do
    end function top

  end subroutine split

  !> How many of up to three rows are independent.
  pure integer function rank_of(value)
    real(wp), intent(in) :: value(:, :)   !! (3,n) [-]
    real(wp) :: left(3, size(value, 2)), largest, here
    integer :: a, b, k

    rank_of = 0
    if (size(value, 2) == 0) return
    left = value
    largest = maxval(abs(value))
    do k = 1, 3
      a = maxloc(sum(left**2, dim=2), dim=1)
      here = norm2(left(a, :))
      if (here <= dependent*largest) return
      rank_of = rank_of + 1
      left(a, :) = left(a, :)/here
      do b = 1, 3
        if (b /= a) left(b, :) = left(b, :) - dot_product(left(b, :), left(a, :))*left(a, :)
      end do
      left(a, :) = 0.0_wp
    end do
  end function rank_of

  !> The combinations of some points' rows that are 0, beside those found before.
  subroutine add_null_space(rows, those, row, basis)
    type(unknown_rows_t), intent(in) :: rows
    integer, intent(in) :: those(:)           !! of the rows' points
    integer, intent(in) :: row(:, :)          !! (3,n_points)
    real(wp), allocatable, intent(inout) :: basis(:, :)
    real(wp), allocatable :: across(:, :), found(:, :), all(:, :)
    integer, allocatable :: own(:)
    integer :: at(maxval([1, rows%unknown(:rows%first(size(rows%point) + 1) - 1)])), i, k, a, m

    own = pack(row(:, rows%point(those)), row(:, rows%point(those)) > 0)
    at = 0
    m = 0
    do i = 1, size(those)
      do k = rows%first(those(i)), rows%first(those(i) + 1) - 1
        if (at(rows%unknown(k)) > 0) cycle
        m = m + 1
        at(rows%unknown(k)) = m
      end do
    end do
    allocate (across(max(1, m), size(own)), source=0.0_wp)
    m = 0
    do i = 1, size(those)
      do a = 1, 3
        if (row(a, rows%point(those(i))) == 0) cycle
        m = m + 1
        do k = rows%first(those(i)), rows%first(those(i) + 1) - 1
          across(at(rows%unknown(k)), m) = rows%value(a, k)
        end do
      end do
    end do
    ! Unknowns have units of their own.
    do k = 1, size(across, 1)
      if (any(abs(across(k, :)) > 0.0_wp)) across(k, :) = across(k, :)/maxval(abs(across(k, :)))
    end do
    found = null_space(across, dependent)
    where (abs(found) <= dependent) found = 0.0_wp
    allocate (all(size(basis, 1), size(basis, 2) + size(found, 2)), source=0.0_wp)
    all(:, :size(basis, 2)) = basis
    all(own, size(basis, 2) + 1:) = found
    call move_alloc(all, basis)
  end subroutine add_null_space

end module dependent_rows_mod
