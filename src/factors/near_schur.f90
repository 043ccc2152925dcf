!> The Schur complement S of the interface as far as it is near, without the whole of it.
!>
!>     S = K_cc - K_ci K_ii^-1 K_ic
!>
!> Its entries fall off with distance. So displacements of many nodes at once tell their columns
!> apart, each near its own node, if the nodes are far enough from each other [CPR74]: those of one
!> colour are more than twice as far apart as entries are kept. With the interface held the interior
!> has a factor of its own, which lives as long as the probes take. docs/theory.md (4.14).
module near_schur_mod
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t
  use controls_mod, only: precision_controls_t
  use near_stiffness_mod, only: near_stiffness_t, keep_near
  use sparse_rows_mod, only: rows_t, find_entry, times, sum_of_rows
  use dof_map_mod, only: dof_map_t
  use assembly_mod, only: triplets_t
  use near_nodes_mod, only: near_nodes_t, find_near_nodes
  use sparse_factor_mod, only: sparse_factor_t, factorise
  implicit none
  private

  public :: near_schur_t, probe_schur, blocks_nearby

  integer,  parameter :: reach = 2            !! elements away that entries are kept
  integer,  parameter :: at_once = 16         !! probes that are solved for together
  real(wp), parameter :: least_left = 0.05_wp !! of the diagonal of K_cc, in that of S [-]

  !> The entries of S between unknowns of the interface whose nodes are near; columns ascend.
  type :: near_schur_t
    private
    type(rows_t) :: s
  end type near_schur_t

contains

  !> Factorise the interior and probe the interface.
  subroutine probe_schur(k, map, order, start, neighbours, precision, schur, error)
    type(triplets_t), intent(in) :: k     !! with its values, not distributed
    type(dof_map_t), intent(in) :: map
    integer, intent(in) :: order(:)       !! (n) place of each unknown in the elimination
    integer, intent(in) :: start(:), neighbours(:) !! of the mesh nodes, by elements they share
    type(precision_controls_t), intent(in) :: precision
    type(near_schur_t), intent(out) :: schur
    type(error_t), allocatable, intent(out) :: error !! no memory; not positive definite
    type(sparse_factor_t) :: factor
    type(near_nodes_t) :: nodes
    type(triplets_t) :: ii
    type(rows_t) :: cc, ci
    real(wp), allocatable :: none(:, :), probe(:, :), x(:, :)
    integer :: n_interior, n_interface, first, last, i

    n_interface = map%n_interface
    n_interior = map%n_free - n_interface
    call split(k, n_interior, start(map%node + 1) == start(map%node), ii, cc, ci)
    call find_near_nodes(map%node(n_interior + 1:), start, neighbours, reach, nodes)
    call begin_rows(nodes, n_interface, schur%s)
    if (n_interface == 0) return
    if (n_interior > 0) then
      factor%precision = precision
      call factorise(ii, ranks_of(order(:n_interior)), 0, factor, none, error)
      if (allocated(error)) return
    end if
    do first = 1, 3*nodes%n_colours, at_once
      last = min(first + at_once - 1, 3*nodes%n_colours)
      allocate (probe(n_interface, first:last), x(n_interior, last - first + 1))
      do i = first, last
        probe(:, i) = probe_of(nodes, i, n_interface)
        x(:, i - first + 1) = sum_of_rows(ci, probe(:, i), n_interior)
      end do
      if (n_interior > 0) call factor%solve(x, error)
      if (allocated(error)) return
      do i = first, last
        call take_answer(nodes, i, times(cc, probe(:, i)) - times(ci, x(:, i - first + 1)), schur%s)
      end do
      deallocate (probe, x)
    end do
    call make_symmetric(schur%s)
    do i = 1, n_interface
      associate (s_ii => schur%s%value(find_entry(schur%s, i, i)))
        s_ii = max(s_ii, least_left*cc%value(findloc(cc%column(cc%first(i):cc%first(i + 1) - 1), &
          i, dim=1) + cc%first(i) - 1))
      end associate
    end do
  end subroutine probe_schur

  !> The blocks of S at the points, and how far each unknown of the interface gives way alone.
  subroutine blocks_nearby(schur, index, near, flexibility)
    type(near_schur_t), intent(in) :: schur
    integer, intent(in) :: index(:, :)
    !! (3,n_points) unknowns of the points, counted from the first of the interface, or 0
    type(near_stiffness_t), intent(out) :: near
    real(wp), allocatable, intent(out) :: flexibility(:) !! (n_interface) 1/S_ee [length/force]
    type(near_stiffness_t) :: all
    integer :: i, a, n, n_points, n_interface
    integer, allocatable :: head(:, :), next(:, :), position(:)

    n_points = size(index, 2)
    n_interface = size(schur%s%first) - 1
    allocate (flexibility(n_interface))
    do i = 1, n_interface
      flexibility(i) = 1.0_wp/schur%s%value(find_entry(schur%s, i, i))
    end do
    ! The points that have an unknown as their first, second or third.
    allocate (head(n_interface, 3), source=0)
    allocate (next(3, n_points), source=0)
    allocate (position(n_points), source=0)
    do i = n_points, 1, -1
      do a = 1, 3
        if (index(a, i) == 0) cycle
        next(a, i) = head(index(a, i), a)
        head(index(a, i), a) = i
      end do
    end do
    n = 30*n_points + 1
    allocate (all%start(n_points + 1), all%other(n), all%block(3, 3, n))
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
        do e = schur%s%first(index(b, point)), schur%s%first(index(b, point) + 1) - 1
          do c = 1, 3
            other = head(schur%s%column(e), c)
            do while (other > 0)
              ! Points that share unknowns hold each other in a way that no block says.
              if (other == point .or. .not. any(index(:, other) > 0 .and. &
                index(:, other) == index(:, point))) then
                if (position(other) < all%start(point)) call take_block(other)
                all%block(b, c, position(other)) = schur%s%value(e)
              end if
              other = next(c, other)
            end do
          end do
        end do
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
      position(other) = n
    end subroutine take_block

  end subroutine blocks_nearby

  !> K_ii, K_cc (both triangles) and K_ci. Nodes without elements, to which couplings tie whole
  !> faces, are held: what they do is the same everywhere, so that colours would not tell it apart.
  subroutine split(k, n_interior, is_loose, ii, cc, ci)
    type(triplets_t), intent(in) :: k
    integer, intent(in) :: n_interior
    logical, intent(in) :: is_loose(:) !! (n) whether the node of an unknown has no element
    type(triplets_t), intent(out) :: ii
    type(rows_t), intent(out) :: cc, ci
    logical, allocatable :: is_interior(:), is_kept(:)
    integer(i8) :: entry
    integer :: pass, c, other

    ! One triangle: the row is the later unknown.
    allocate (is_interior(size(k%row, kind=i8)), source=k%row <= n_interior)
    allocate (is_kept(size(k%row, kind=i8)), source=k%row == k%column .or. .not. &
      (is_loose(k%row) .or. is_loose(k%column)))
    ii%n = n_interior
    ii%row = pack(k%row, is_interior .and. is_kept)
    ii%column = pack(k%column, is_interior .and. is_kept)
    ii%value = pack(k%value, is_interior .and. is_kept)
    allocate (cc%first(k%n - n_interior + 1), source=0)
    allocate (ci%first(k%n - n_interior + 1), source=0)
    do pass = 1, 2
      do entry = 1, size(k%row, kind=i8)
        if (is_interior(entry)) cycle
        c = k%row(entry) - n_interior
        other = k%column(entry)
        if (other <= n_interior) then
          if (is_kept(entry)) call add(ci, c, other)
        else
          call add(cc, c, other - n_interior)
          if (other - n_interior /= c) call add(cc, other - n_interior, c)
        end if
      end do
      call next_pass(cc)
      call next_pass(ci)
    end do

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

    !> From counts to the beginnings of rows; from their ends to their beginnings.
    subroutine next_pass(rows)
      type(rows_t), intent(inout) :: rows
      integer :: position, n, j

      if (pass == 1) then
        position = 1
        do j = 1, size(rows%first)
          n = rows%first(j)
          rows%first(j) = position
          position = position + n
        end do
        allocate (rows%column(position - 1), rows%value(position - 1))
      else
        do j = size(rows%first), 2, -1
          rows%first(j) = rows%first(j - 1)
        end do
        rows%first(1) = 1
      end if
    end subroutine next_pass

  end subroutine split

  !> Rows of S with room for what is near.
  pure subroutine begin_rows(nodes, n_interface, s)
    type(near_nodes_t), intent(in) :: nodes
    integer, intent(in) :: n_interface
    type(rows_t), intent(out) :: s
    integer :: pass, i, j, e, f, n

    allocate (s%first(n_interface + 1))
    do pass = 1, 2
      n = 0
      do i = 1, nodes%n
        do e = nodes%first(i), nodes%first(i + 1) - 1
          s%first(e) = n + 1
          do j = nodes%start(i), nodes%start(i + 1) - 1
            do f = nodes%first(nodes%near(j)), nodes%first(nodes%near(j) + 1) - 1
              n = n + 1
              if (pass == 2) s%column(n) = f
            end do
          end do
        end do
      end do
      s%first(n_interface + 1) = n + 1
      if (pass == 1) allocate (s%column(n))
    end do
    allocate (s%value(n), source=0.0_wp)
  end subroutine begin_rows

  !> Probe 1, 2, ..: the first, second or third unknown of the nodes of a colour moves by 1.
  pure function probe_of(nodes, i, n_interface) result(probe)
    type(near_nodes_t), intent(in) :: nodes
    integer, intent(in) :: i
    integer, intent(in) :: n_interface
    real(wp) :: probe(n_interface)      !! [length]
    integer :: j

    probe = 0.0_wp
    do j = 1, nodes%n
      if (is_probed(nodes, i, j)) probe(nodes%first(j) + modulo(i - 1, 3)) = 1.0_wp
    end do
  end function probe_of

  !> Whether probe `i` moves node `j`.
  pure logical function is_probed(nodes, i, j)
    type(near_nodes_t), intent(in) :: nodes
    integer, intent(in) :: i, j

    is_probed = nodes%colour(j) == (i + 2)/3 .and. &
      nodes%first(j) + modulo(i - 1, 3) < nodes%first(j + 1)
  end function is_probed

  !> Take the columns of S from what a probe takes.
  pure subroutine take_answer(nodes, i, force, s)
    type(near_nodes_t), intent(in) :: nodes
    integer, intent(in) :: i
    real(wp), intent(in) :: force(:)    !! (n_interface) [force]
    type(rows_t), intent(inout) :: s
    integer :: j, k, e

    do j = 1, nodes%n
      if (.not. is_probed(nodes, i, j)) cycle
      do k = nodes%start(j), nodes%start(j + 1) - 1
        do e = nodes%first(nodes%near(k)), nodes%first(nodes%near(k) + 1) - 1
          s%value(find_entry(s, e, nodes%first(j) + modulo(i - 1, 3))) = force(e)
        end do
      end do
    end do
  end subroutine take_answer

  !> What is far was taken for near, and not alike from both sides.
  pure subroutine make_symmetric(s)
    type(rows_t), intent(inout) :: s
    integer :: e, k, other
    real(wp) :: mean

    do e = 1, size(s%first) - 1
      do k = s%first(e), s%first(e + 1) - 1
        if (s%column(k) <= e) cycle
        other = find_entry(s, s%column(k), e)
        mean = 0.5_wp*(s%value(k) + s%value(other))
        s%value(k) = mean
        s%value(other) = mean
      end do
    end do
  end subroutine make_symmetric

  !> The order of some unknowns among themselves.
  pure function ranks_of(position) result(rank)
    integer, intent(in) :: position(:)  !! distinct, at least 1
    integer :: rank(size(position))
    logical, allocatable :: is_there(:)
    integer, allocatable :: number(:)
    integer :: i, n

    allocate (is_there(maxval([position, 0])), source=.false.)
    allocate (number(size(is_there)))
    is_there(position) = .true.
    n = 0
    do i = 1, size(is_there)
      if (is_there(i)) n = n + 1
      number(i) = n
    end do
    rank = number(position)
  end function ranks_of

end module near_schur_mod
