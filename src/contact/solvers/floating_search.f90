!> How far free rigid motions go, and the reactions with them (floating_mod has the problem,
!> floating_centre_mod its solution at one centre).
!>
!> The motions are found by a proximal iteration,
!>
!>     b = c + theta (Q^T r + q),      so that x = (W_c + theta Q Q^T) r + x' + Q (c + theta q),
!>
!> a contact problem like any other, whose solution r(c) leaves e(c) = Q^T r(c) + q out of balance.
!> The centre c takes Newton steps on e(c) = 0 with the derivative of the solved contact problem,
!> damped (Levenberg-Marquardt) from the best centre so far until they balance more; fully damped
!> they are the plain proximal step c + theta e. After one that gained little friction of points
!> that slide resists by its secant. Where none of these leaves less out of balance the
!> centre goes along e, as far as it takes: e(c) falls along a line, so that a change of its sign
!> brackets the place. Free gaps are closed so, however small the load is. A motion that nothing
!> drives stays where it is. Where no centre leaves less out of balance, Newton's method on
!> reactions and motions together has its turn, from the start, from the best centre, from no
!> reactions and from no friction; then plain proximal steps from the start; then nothing balances
!> it. What contact leaves on a neutral motion is given back.
!> docs/theory.md section 9.
module floating_search_mod
  use kinds_mod, only: wp
  use controls_mod, only: contact_controls_t, solver_auto
  use increment_report_mod, only: ended_unbalanced, ended_stalled
  use compliance_mod, only: is_map
  use problem_mod, only: contact_problem_t, contact_report_t, pack_rows, unpack_rows, relative_gaps
  use floating_mod, only: floating_t, part_points, shift_of
  use newton_iterate_mod, only: residual_at
  use floating_centre_mod, only: drift_t, centre_t, solve_at_centre, sees_nothing, find_resistance
  use centre_leaps_mod, only: leap_of, add_sliding
  use closest_balance_mod, only: find_closest_balance, most_wedged
  use growing_friction_mod, only: friction_shares
  use joint_newton_mod, only: solve_jointly
  implicit none
  private

  public :: solve_floating

  real(wp), parameter :: nearly = 10.0_wp      !! of what counts as balance: no drift yet
  integer,  parameter :: max_recentrings = 200
  integer,  parameter :: max_worse = 3         !! leaps out of free flight
  integer,  parameter :: patience = 40         !! trials that balance nothing
  integer,  parameter :: max_idle = 10         !! the same of plain steps
  real(wp), parameter :: progress = 0.99_wp    !! what is out of balance then, of what was
  real(wp), parameter :: longest_leap = 1000.0_wp   !! of the way and a plain step
  real(wp), parameter :: least_damping = 1.0e-12_wp !! of the resistance of the proximal term
  real(wp), parameter :: most_damping = 1.0_wp
  real(wp), parameter :: far_off = 100.0_wp         !! times as much out of balance as at the best
  ! How many times more the next leap is damped after one that gained nothing, one that led far off,
  ! and one that led where contact is not solved either.
  real(wp), parameter :: more = 10.0_wp, much_more = 1.0e3_wp, most_more = 1.0e6_wp
  real(wp), parameter :: another = 0.1_wp           !! leap: differs by so much from the last [-]
  integer,  parameter :: max_lines = 30             !! searches along e
  integer,  parameter :: max_on_line = 80           !! centres on one of them
  integer,  parameter :: largest_joint = 150        !! rows up to which all starts are tried then
  integer,  parameter :: most_joint = 3000
  !! rows up to which motions join the reactions at all: a step takes a second
  integer,  parameter :: many = 20
  !! centres after which that is tried with more rows: on slopes whose friction holds by 1e-6, of
  !! 1000 rows and more, the search ends nowhere
  real(wp), parameter :: scalings(5) = [0.0_wp, 3.0_wp, 1.0_wp, 1.0_wp/3.0_wp, 1.0_wp/9.0_wp]
  !! of the natural map's, for the laws in Newton's method then; 0: its own [-]
  real(wp), parameter :: promising = 1.0e-4_wp      !! of what that leaves over: worth a trial [-]
  real(wp), parameter :: vanished = 1.0e-3_wp
  !! reactions, of those it began with: wedges that lock (mu = 1 and 5) keep more [-]
  real(wp), parameter :: halved = 0.5_wp            !! of e: found along a line, or gained by a leap
  real(wp), parameter :: gaps_away = 10.0_wp        !! of the largest gap: as far as places allow
  real(wp), parameter :: spoilt = 0.1_wp !! of the tolerance: by the rounding of a far centre

  !> The search for the centre that balances.
  type :: search_t
    type(centre_t) :: now, best
    real(wp), allocatable :: x_start(:)        !! (n_rows) gaps and slips at centre 0 [length]
    real(wp), allocatable :: first(:)          !! (n_seen) centre where it began [length]
    real(wp), allocatable :: r_first(:, :)     !! (3,n_points) reactions there [force]
    real(wp), allocatable :: load(:)           !! (n_seen) of the loads on the motions [force]
    real(wp), allocatable :: response(:, :)    !! (n_rows,n_seen) dr/dc at the best [force/length]
    real(wp), allocatable :: resistance(:, :)  !! (n_seen,n_seen) -de/dc at the best [force/length]
    real(wp), allocatable :: leap(:)           !! (n_seen) from the best, the last one [length]
    real(wp) :: furthest = 0.0_wp              !! where contact is still resolved [length]
    real(wp) :: damping = least_damping        !! of the resistance of the proximal term [-]
    integer  :: since_best = 0                 !! trials
    integer  :: idle = 0                       !! trials without progress
    real(wp) :: left = 0.0_wp                  !! of |e| at the best before, at the best [-]
    logical  :: is_flying = .false.            !! nothing resists at the best
    real(wp) :: unsolved = 0.0_wp              !! residual of the last trial that was not solved [-]
  end type search_t

contains

  !> Reactions and motions together.
  !>
  !> Where nothing balances a motion the report says ended_unbalanced, and `drift` along what.
  subroutine solve_floating(problem, floating, x_free, controls, drift, r, report)
    type(contact_problem_t), intent(in) :: problem
    type(floating_t), intent(in) :: floating
    real(wp), intent(inout) :: x_free(:)
    !! (n_rows) at a = 0, in; that of the proximal problem r solves, out [length]
    type(contact_controls_t), intent(in) :: controls
    type(drift_t), intent(inout) :: drift   !! load and start in, the motions out
    real(wp), intent(inout) :: r(:, :)      !! (3,n_points) warm start in, solution out [force]
    type(contact_report_t), intent(out) :: report
    type(search_t) :: search
    integer :: i, n_lines
    logical :: found, may_part, is_hopeless

    search%load = matmul(drift%load, floating%back)
    search%x_start = x_free + matmul(floating%g, drift%a) - matmul(floating%w_q, search%load) + &
      floating%theta*matmul(floating%q, search%load)
    search%first = shift_of(floating, pack_rows(problem, r))
    search%now%centre = search%first
    search%r_first = r
    search%now%r = r
    allocate (search%leap(floating%n_seen), source=0.0_wp)
    n_lines = 0
    is_hopeless = .false.
    may_part = .not. any(abs(drift%load) > drift%rounding) .and. any(abs(r) > 0.0_wp)
    recentre: do i = 1, max_recentrings
      x_free = search%x_start + matmul(floating%q, search%now%centre)
      call try_centre(problem, floating, x_free, controls, drift, search, report)
      if (report%converged() .or. .not. search%best%is_solved) exit recentre
      if (search%now%is_solved .and. sees_nothing(search%now)) exit recentre
      if (i == 1) call ask_for_hope(problem, floating, search, is_hopeless)
      if (is_hopeless) exit recentre
      if (may_part) then
        if (maxval(abs(search%best%r)) <= vanished*maxval(abs(search%r_first))) then
          call part_bodies(problem, floating, controls, drift, search, x_free, report)
          if (report%converged()) exit recentre
          may_part = .false.
        end if
      end if
      if (search%idle >= patience .or. (search%since_best > 0 .and. &
        search%damping >= most_damping)) then
        n_lines = n_lines + 1
        if (n_lines > max_lines) exit recentre
        call follow_line(problem, floating, controls, drift, search, x_free, report, found)
        if (report%converged() .or. .not. found) exit recentre
      end if
      if (i == many .and. problem%n_rows > largest_joint .and. problem%n_rows <= most_joint .and. &
        .not. is_map(problem%compliance)) then
        call try_jointly(problem, floating, controls, drift, search, x_free, report)
        if (report%converged()) exit recentre
      end if
      call choose_centre(problem, floating, x_free, controls, search)
    end do recentre
    if (.not. (report%converged() .or. is_hopeless) .and. problem%n_rows <= largest_joint .and. &
      .not. is_map(problem%compliance) .and. &
      .not. (search%now%is_solved .and. sees_nothing(search%now))) call try_jointly(problem, &
      floating, controls, drift, search, x_free, report)
    if (.not. (report%converged() .or. is_hopeless) .and. search%now%is_solved) then
      if (.not. sees_nothing(search%now)) call go_plainly(problem, floating, controls, drift, &
        search, x_free, report)
    end if

    if (.not. report%converged() .and. search%now%is_solved) then
      ! What contact does not see it cannot balance; what it sees it has not balanced anywhere.
      search%now = search%best
      report%ending = ended_unbalanced
      if (all(abs(search%now%left) <= nearly*search%now%small)) report%ending = ended_stalled
      if (search%unsolved > 0.0_wp .and. controls%solver /= solver_auto) then
        ! The deck's own solver may have missed the place.
        report%ending = ended_stalled
        report%residual = search%unsolved
      end if
    end if
    x_free = search%x_start + matmul(floating%q, search%now%centre)
    r = search%now%r
    associate (now => search%now)
      drift%turned = now%turned
      drift%unbalanced = now%left - now%left_seen
      if (all(abs(drift%unbalanced) <= now%small)) drift%unbalanced = matmul(floating%back, now%e)
      drift%a = drift%a + matmul(floating%back, now%centre + floating%theta*now%e - &
        shift_of(floating, pack_rows(problem, r)))
    end associate
  end subroutine solve_floating

  !> Whether no reactions at all balance the loads, wherever the motions go. What the closest ones
  !> leave over is then all that there is to say.
  subroutine ask_for_hope(problem, floating, search, is_hopeless)
    type(contact_problem_t), intent(in) :: problem
    type(floating_t), intent(in) :: floating
    type(search_t), intent(inout) :: search
    logical, intent(out) :: is_hopeless
    real(wp) :: e(floating%n_seen), left(floating%n)

    is_hopeless = .false.
    if (floating%n_seen > largest_joint) return
    call find_closest_balance(problem, floating%q, search%load, e, is_hopeless)
    left = matmul(matmul(floating%q, e), floating%g)
    is_hopeless = is_hopeless .and. any(abs(left) > nearly*search%best%small)
    if (.not. is_hopeless) return
    associate (best => search%best)
      best%e = e
      best%left = best%left - best%left_seen + left
      best%left_seen = left
    end associate
  end subroutine ask_for_hope

  !> Try a place near the best centre at which no point touches: where no load drives the motions,
  !> that is a solution. Near it reactions fall as fast as the imbalance, and the search alone would
  !> never end. This waits until reactions have all but vanished, for a body that friction locks
  !> must stay locked.
  subroutine part_bodies(problem, floating, controls, drift, search, x_free, report)
    type(contact_problem_t), intent(in) :: problem
    type(floating_t), intent(in) :: floating
    type(contact_controls_t), intent(in) :: controls
    type(drift_t), intent(in) :: drift
    type(search_t), intent(inout) :: search
    real(wp), intent(inout) :: x_free(:)           !! (n_rows) at the last centre [length]
    type(contact_report_t), intent(inout) :: report
    type(search_t) :: before
    integer, allocatable :: normal(:) !! rows
    logical :: is_parted

    before = search
    search%now%centre = search%best%centre
    search%now%r = 0.0_wp
    normal = pack(problem%row(1, :), problem%row(1, :) > 0)
    call part_points(search%x_start(normal), floating%q(normal, :), search%now%centre, is_parted)
    if (is_parted) then
      x_free = search%x_start + matmul(floating%q, search%now%centre)
      call solve_at_centre(problem, floating, x_free, controls, drift, .true., search%now, report)
    end if
    if (.not. report%converged()) search = before
  end subroutine part_bodies

  !> Newton's method on reactions and motions together, with one scaling of the laws after another,
  !> each from where the search began, from the best centre and from no reactions at all; then from
  !> no friction to more and more of it; with many rows only the first of these. What it comes to is
  !> a centre to try like any other.
  subroutine try_jointly(problem, floating, controls, drift, search, x_free, report)
    type(contact_problem_t), intent(in) :: problem
    type(floating_t), intent(in) :: floating
    type(contact_controls_t), intent(in) :: controls
    type(drift_t), intent(in) :: drift             !! its load and what that is rounded by
    type(search_t), intent(inout) :: search
    real(wp), intent(inout) :: x_free(:)           !! (n_rows) at the last centre [length]
    type(contact_report_t), intent(inout) :: report
    type(contact_problem_t) :: scaled
    type(contact_report_t) :: before
    type(centre_t) :: last
    real(wp) :: left
    integer :: i, k

    before = report
    last = search%now
    scaled = problem
    scale: do k = 1, size(scalings)
      if (k > 1) scaled%rho_global = spread(scalings(k)*problem%rho_map, 1, 2)
      do i = 1, 3
        search%now%centre = search%first
        search%now%r = search%r_first
        if (i == 2) search%now = search%best
        if (i == 3) search%now%r = 0.0_wp
        call go_on(scaled)
        if (k > 1) call go_on(problem)
        call try_it()
        if (report%converged()) return
      end do
      if (problem%n_rows > largest_joint) exit scale
    end do scale
    if (problem%n_rows <= largest_joint) call raise_friction()
    if (report%converged()) return
    call say_as_before(before, report)
    search%now = last

  contains

    !> From no friction to more and more of it.
    subroutine raise_friction()
      scaled = problem
      search%now%centre = search%first
      search%now%r = 0.0_wp
      do k = lbound(friction_shares, 1), ubound(friction_shares, 1)
        scaled%mu = friction_shares(k)*problem%mu
        call go_on(scaled)
      end do
      call try_it()
    end subroutine raise_friction

    !> Newton's method from the present reactions and centre.
    subroutine go_on(law)
      type(contact_problem_t), intent(in) :: law

      call solve_jointly(law, floating%q, search%load, search%x_start, search%now%r, &
        search%now%centre, left)
    end subroutine go_on

    !> See what the centre that came out says, if anything.
    subroutine try_it()
      if (left > promising .or. is_out_of_scale(search)) return
      x_free = search%x_start + matmul(floating%q, search%now%centre)
      call try_centre(problem, floating, x_free, controls, drift, search, report)
    end subroutine try_it

  end subroutine try_jointly

  !> Plain proximal steps from where the search began, for as long as they balance more.
  !>
  !> Where all points slide at first, nothing resists, and leaps end in another place from which all
  !> slide on. These steps are too short to miss the one at which friction holds.
  subroutine go_plainly(problem, floating, controls, drift, search, x_free, report)
    type(contact_problem_t), intent(in) :: problem
    type(floating_t), intent(in) :: floating
    type(contact_controls_t), intent(in) :: controls
    type(drift_t), intent(in) :: drift             !! its load and what that is rounded by
    type(search_t), intent(inout) :: search        !! as it was, where they lead nowhere
    real(wp), intent(inout) :: x_free(:)           !! (n_rows) at the last centre [length]
    type(contact_report_t), intent(inout) :: report
    type(search_t) :: plain
    type(contact_report_t) :: before
    integer :: i

    before = report
    plain = search
    plain%best = centre_t()
    plain%damping = most_damping
    plain%now%centre = search%first
    plain%now%r = search%r_first
    steps: do i = 1, max_recentrings
      x_free = search%x_start + matmul(floating%q, plain%now%centre)
      call try_centre(problem, floating, x_free, controls, drift, plain, report)
      if (report%converged()) search = plain
      if (report%converged()) return
      if (.not. plain%now%is_solved .or. plain%idle >= max_idle) exit steps
      plain%now%centre = plain%now%centre + floating%theta*plain%now%e
    end do steps
    call say_as_before(before, report)
  end subroutine go_plainly

  !> What was said before stands, but for the counts.
  pure subroutine say_as_before(before, report)
    type(contact_report_t), intent(in) :: before
    type(contact_report_t), intent(inout) :: report

    report%residual = before%residual
    report%worst_point = before%worst_point
    report%solver = before%solver
    report%ending = before%ending
  end subroutine say_as_before

  !> Go along what is out of balance at the best centre, further and further until it changes its
  !> sign, then between, until half of it is gone. The best centre is where that is.
  subroutine follow_line(problem, floating, controls, drift, search, x_free, report, found)
    type(contact_problem_t), intent(in) :: problem
    type(floating_t), intent(in) :: floating
    type(contact_controls_t), intent(in) :: controls
    type(drift_t), intent(in) :: drift
    type(search_t), intent(inout) :: search
    real(wp), intent(out) :: x_free(:)             !! (n_rows) at the last centre [length]
    type(contact_report_t), intent(inout) :: report
    logical, intent(out) :: found                  !! false: nothing changes as far as places allow
    real(wp) :: direction(floating%n_seen), size_e, low, high, far, way, along
    integer :: i

    found = .false.
    size_e = norm2(search%best%e)
    if (.not. size_e > 0.0_wp) return
    direction = search%best%e/size_e
    far = farthest(search)
    low = 0.0_wp
    high = huge(high)
    way = floating%theta*size_e
    line: do i = 1, max_on_line
      search%now%centre = search%best%centre + way*direction
      search%now%r = search%best%r
      x_free = search%x_start + matmul(floating%q, search%now%centre)
      call solve_here(problem, floating, x_free, controls, drift, search, report)
      if (report%converged()) return
      along = -1.0_wp ! so deep in an obstacle that its contact is not solved
      if (search%now%is_solved) along = dot_product(search%now%e, direction)/size_e
      if (abs(along) <= halved) then
        found = .true.
        search%best = search%now
        search%since_best = 0
        search%idle = 0
        search%damping = least_damping
        return
      end if
      if (along > 0.0_wp) low = way
      if (along < 0.0_wp) high = way
      if (high > far) then
        if (low >= far) return
        way = min(far, 10.0_wp*way)
      else if (low <= 0.0_wp) then
        way = 0.1_wp*high
      else if (high > 4.0_wp*low) then
        way = sqrt(low)*sqrt(high)
      else
        way = 0.5_wp*(low + high)
      end if
    end do line
  end subroutine follow_line

  !> Whether Newton's method has gone off: a centre beyond what places allow, or reactions beside
  !> which the loads would not be seen.
  pure logical function is_out_of_scale(search)
    type(search_t), intent(in) :: search

    is_out_of_scale = norm2(search%now%centre - search%first) > farthest(search) .or. &
      norm2(search%now%r) > most_wedged*max(norm2(search%load), norm2(search%best%r), &
      norm2(search%r_first))
  end function is_out_of_scale

  !> As far as places allow.
  pure real(wp) function farthest(search)
    type(search_t), intent(in) :: search

    farthest = max(search%furthest, gaps_away*maxval(abs(search%x_start)))
  end function farthest

  !> Solve the proximal problem at a centre, and see whether it leaves less out of balance than any
  !> before.
  subroutine try_centre(problem, floating, x_free, controls, drift, search, report)
    type(contact_problem_t), intent(in) :: problem
    type(floating_t), intent(in) :: floating
    real(wp), intent(in) :: x_free(:)              !! (n_rows) there [length]
    type(contact_controls_t), intent(in) :: controls
    type(drift_t), intent(in) :: drift             !! its load and what that is rounded by
    type(search_t), intent(inout) :: search
    type(contact_report_t), intent(inout) :: report

    call solve_here(problem, floating, x_free, controls, drift, search, report)
    associate (now => search%now)
      search%idle = search%idle + 1
      search%since_best = search%since_best + 1
      if (.not. allocated(search%best%e)) then
        if (problem%n_points > 0) search%furthest = spoilt*controls%tolerance* &
          max(norm2(now%r), norm2(now%e))/(epsilon(1.0_wp)*maxval(problem%rho_map))
        search%idle = 0
      else if (.not. now%is_solved .or. norm2(now%e) >= norm2(search%best%e)) then
        return
      else if (norm2(now%e) < progress*norm2(search%best%e)) then
        search%idle = 0
      end if
      search%left = 0.0_wp
      if (allocated(search%best%e)) search%left = norm2(now%e)/max(norm2(search%best%e), &
        tiny(1.0_wp))
      search%best = now
      search%since_best = 0
    end associate
  end subroutine try_centre

  !> Solve the proximal problem at the present centre, and see what it leaves out of balance.
  subroutine solve_here(problem, floating, x_free, controls, drift, search, report)
    type(contact_problem_t), intent(in) :: problem
    type(floating_t), intent(in) :: floating
    real(wp), intent(in) :: x_free(:)              !! (n_rows) there [length]
    type(contact_controls_t), intent(in) :: controls
    type(drift_t), intent(in) :: drift             !! its load and what that is rounded by
    type(search_t), intent(inout) :: search        !! gets what it is there
    type(contact_report_t), intent(inout) :: report
    logical :: is_leap

    ! A leap may fail. The first trial must not, nor a plain step, the last there is: other solvers
    ! follow there.
    is_leap = allocated(search%best%e) .and. search%damping < most_damping
    call solve_at_centre(problem, floating, x_free, controls, drift, is_leap, search%now, report)
    if (.not. search%now%is_solved) search%unsolved = report%residual
  end subroutine solve_here

  !> The next centre to try.
  subroutine choose_centre(problem, floating, x_free, controls, search)
    type(contact_problem_t), intent(in) :: problem
    type(floating_t), intent(in) :: floating
    real(wp), intent(in) :: x_free(:)              !! (n_rows) of the last trial [length]
    type(contact_controls_t), intent(in) :: controls
    type(search_t), intent(inout) :: search
    real(wp) :: resistance(floating%n_seen, floating%n_seen), far
    real(wp) :: response(problem%n_rows, floating%n_seen)
    real(wp), dimension(floating%n_seen) :: way, leap

    associate (now => search%now, best => search%best)
      resistance = 0.0_wp
      if (search%since_best == 0) then
        search%damping = max(least_damping, search%damping/30.0_wp)
        call find_resistance(problem, floating, x_free, controls, now%r, response, resistance)
        search%response = response
        search%is_flying = all(abs(resistance)*floating%theta <= 100.0_wp*least_damping)
        if (search%left > halved) call add_sliding(problem, floating%q, relative_gaps(problem, &
          x_free, pack_rows(problem, now%r)), now%r, resistance)
        search%resistance = resistance
      end if
      if (search%is_flying .and. search%since_best < max_worse .and. now%is_solved) then
        ! From free flight the first leap goes too far into an obstacle; the next bring it back.
        if (search%since_best > 0) call find_resistance(problem, floating, x_free, controls, &
          now%r, response, resistance)
        way = now%centre - search%first
        far = longest_leap*norm2(way + floating%theta*now%e)
        way = way + leap_of(resistance, now%e, least_damping/floating%theta, far)
        if (norm2(way) > far) way = way*(far/norm2(way))
        now%centre = search%first + way
        return
      end if
      if (search%since_best > 0) search%damping = min(most_damping, search%damping*more_damping())
      way = best%centre - search%first
      far = max(search%furthest, norm2(way) + floating%theta*norm2(best%e))
      damp: do
        leap = leap_of(search%resistance, best%e, search%damping/floating%theta, far)
        if (search%since_best == 0 .or. search%damping >= most_damping) exit damp
        ! Another damping that leaves the leap as it was comes to the same.
        if (norm2(leap - search%leap) > another*norm2(search%leap)) exit damp
        search%damping = min(most_damping, more*search%damping)
      end do damp
      search%leap = leap
      way = way + leap
      if (norm2(way) > far) way = way*(far/norm2(way))
      now%centre = search%first + way
      call foresee(search%x_start + matmul(floating%q, now%centre), now%centre - best%centre)
    end associate

  contains

    !> The reactions to start from there: those of the best centre, or what they become by their
    !> derivative, whichever leave less of the laws.
    subroutine foresee(x, change)
      real(wp), intent(in) :: x(:)      !! (n_rows) gaps and slips without reactions [length]
      real(wp), intent(in) :: change(:) !! (n_seen) of the centre [length]
      real(wp) :: foreseen(3, problem%n_points)

      search%now%r = search%best%r
      foreseen = search%best%r + unpack_rows(problem, matmul(search%response, change))
      if (norm2(residual_at(problem, x, foreseen)) < norm2(residual_at(problem, x, &
        search%best%r))) search%now%r = foreseen
    end subroutine foresee

    !> How many times more the next leap is damped.
    pure real(wp) function more_damping()
      more_damping = more
      if (norm2(search%now%e) > far_off*norm2(search%best%e)) more_damping = merge(much_more, &
        most_more, search%now%is_solved)
    end function more_damping

  end subroutine choose_centre

end module floating_search_mod
