!> Contact of nodes that many pairs face: solved for the few of their points that may press.
!>
!> Where a hundred planes face a node its hundred points share three displacements. W over all of
!> them is large and singular, while few of them press. The problem of some of the points alone is
!> solved; what it leaves open is looked at, and of each node the point that is deepest inside
!> joins them. A solution over some points that leaves no other one inside solves the problem of
!> all: open points have no reactions. docs/theory.md (4.23).
module crowded_nodes_mod
  use kinds_mod, only: wp
  use controls_mod, only: contact_controls_t
  use compliance_mod, only: is_map, get_column, get_rows
  use increment_report_mod, only: not_ended
  use problem_mod, only: contact_problem_t, contact_report_t, make_problem, copy_laws, &
    pack_rows, unpack_rows, measure
  use solve_mod, only: solve_contact
  implicit none
  private

  public :: has_crowded_nodes, solve_on_crowded_nodes

  integer, parameter :: most_independent = 3 !! points of a node whose normals can be independent

contains

  !> Whether W is known, and a node has more points than directions to move in.
  pure logical function has_crowded_nodes(problem, node) result(has)
    type(contact_problem_t), intent(in) :: problem
    integer, intent(in) :: node(:)       !! (n_points) of each

    has = .false.
    if (is_map(problem%compliance)) return
    has = any(points_at(node, maxval([0, node])) > most_independent)
  end function has_crowded_nodes

  !> Solve over a growing set of points until the residual of the whole problem is at the tolerance.
  !>
  !> Not converging is no error: the report says so, and r is as it came.
  subroutine solve_on_crowded_nodes(problem, node, x_free, controls, r, report)
    type(contact_problem_t), intent(in) :: problem
    integer, intent(in) :: node(:)       !! (n_points) of each
    real(wp), intent(in) :: x_free(:)    !! (n_rows) [length]
    type(contact_controls_t), intent(in) :: controls
    real(wp), intent(inout) :: r(:, :)   !! (3,n_points) warm start in, solution out [force]
    type(contact_report_t), intent(out) :: report
    type(contact_report_t) :: of_some
    real(wp), dimension(3, problem%n_points) :: trial, gaps
    real(wp) :: x(problem%n_rows)
    logical :: is_in(problem%n_points)
    integer :: n_in

    ! What presses, all points of other nodes, and of a node where none presses the nearest.
    is_in = r(1, :) > 0.0_wp .or. problem%stays
    associate (n_at => points_at(node, maxval(node)))
      where (n_at(node) <= most_independent) is_in = .true.
    end associate
    gaps = unpack_rows(problem, x_free)
    associate (begins => points_at(pack(node, is_in), maxval(node)) > 0)
      where (begins(node)) gaps(1, :) = huge(1.0_wp)
    end associate
    call add_deepest(node, gaps(1, :), huge(1.0_wp), is_in)
    trial = r
    do
      n_in = count(is_in)
      call solve_some(problem, is_in, x_free, controls, trial, x, of_some)
      call measure(problem, x_free, x, pack_rows(problem, trial), r, of_some)
      of_some%iterations = of_some%iterations + report%iterations
      of_some%local_iterations = of_some%local_iterations + report%local_iterations
      of_some%products = of_some%products + report%products
      of_some%stages = max(of_some%stages, report%stages)
      report = of_some
      if (.not. report%converged()) return
      if (report%residual <= controls%tolerance) exit
      report%ending = not_ended
      gaps = unpack_rows(problem, x)
      call add_deepest(node, gaps(1, :), 0.0_wp, is_in)
      if (count(is_in) == n_in) return
    end do
    r = trial
  end subroutine solve_on_crowded_nodes

  !> The problem of some of the points, and the gaps and slips of all that its solution leaves.
  subroutine solve_some(problem, is_in, x_free, controls, r, x, report)
    type(contact_problem_t), intent(in) :: problem
    logical, intent(in) :: is_in(:)        !! (n_points)
    real(wp), intent(in) :: x_free(:)      !! (n_rows) [length]
    type(contact_controls_t), intent(in) :: controls
    real(wp), intent(inout) :: r(:, :)     !! (3,n_points) 0 at the others [force]
    real(wp), intent(out) :: x(:)          !! (n_rows) [length]
    type(contact_report_t), intent(out) :: report
    type(contact_problem_t) :: some
    integer, allocatable :: those(:), rows(:)
    real(wp), allocatable :: w(:, :), r_some(:, :), packed(:)
    real(wp) :: column(problem%n_rows)
    integer :: row(3, count(is_in)), i, k, a

    those = pack([(i, i=1, problem%n_points)], is_in)
    allocate (rows(count(problem%row(:, those) > 0)))
    row = 0
    i = 0
    do k = 1, size(those)
      do a = 1, 3
        if (problem%row(a, those(k)) == 0) cycle
        i = i + 1
        row(a, k) = i
        rows(i) = problem%row(a, those(k))
      end do
    end do
    call get_rows(problem%compliance, rows, w)
    call make_problem(row, problem%mu(those), w, some)
    call copy_laws(problem, those, some)
    allocate (r_some, source=r(:, those))
    call solve_contact(some, x_free(rows), controls, r_some, report)
    r = 0.0_wp
    r(:, those) = r_some
    packed = pack_rows(some, r_some)
    x = x_free
    do i = 1, size(rows)
      if (.not. abs(packed(i)) > 0.0_wp) cycle
      call get_column(problem%compliance, rows(i), column)
      x = x + packed(i)*column
    end do
  end subroutine solve_some

  !> Let of each node the point join that is deepest inside, if its gap is below a limit.
  pure subroutine add_deepest(node, gap, limit, is_in)
    integer, intent(in) :: node(:)         !! (n_points) of each
    real(wp), intent(in) :: gap(:)         !! (n_points) [length]
    real(wp), intent(in) :: limit          !! [length]
    logical, intent(inout) :: is_in(:)     !! (n_points)
    integer :: deepest(maxval([0, node])), i

    deepest = 0
    do i = 1, size(node)
      if (is_in(i) .or. .not. gap(i) < limit) cycle
      associate (here => deepest(node(i)))
        if (here == 0) then
          here = i
        else if (gap(i) < gap(here)) then
          here = i
        end if
      end associate
    end do
    do i = 1, size(deepest)
      if (deepest(i) > 0) is_in(deepest(i)) = .true.
    end do
  end subroutine add_deepest

  !> How many points each node has.
  pure function points_at(node, n_nodes) result(n)
    integer, intent(in) :: node(:)   !! of each point
    integer, intent(in) :: n_nodes
    integer :: n(n_nodes)
    integer :: k

    n = 0
    do k = 1, size(node)
      n(node(k)) = n(node(k)) + 1
    end do
  end function points_at

end module crowded_nodes_mod
