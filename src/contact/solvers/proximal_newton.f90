!> Proximal point steps, each solved by the global Newton: for a compliance that is singular.
!>
!> Bodies without elasticity of their own, or more contact points than a body needs, make W
!> singular: reactions are not unique, J is singular, and Newton's line search stalls. A proximal
!> step adds alpha D (r - r_before) to the gaps. Its W + alpha D is regular; its solution is that of
!> the problem itself once r stands still.
!>
!> Where W is singular because of twins, points of a node that move alike, D is 0 at all others:
!> what is known of the stiffness near these stays.
!> docs/theory.md section 4.
module proximal_newton_mod
  use kinds_mod, only: wp
  use progress_line_mod, only: show_progress
  use controls_mod, only: contact_controls_t, solver_global_newton
  use increment_report_mod, only: ended_well, ended_stalled
  use banded_mod, only: invert_band
  use near_stiffness_mod, only: near_stiffness_t
  use problem_mod, only: contact_problem_t, contact_report_t, relative_gaps, measure, &
                         pack_rows, unpack_rows
  use compliance_mod, only: is_map, block_of, diagonal_of, get_inverse, shift_diagonal
  use global_newton_mod, only: solve_by_global_newton
  implicit none
  private

  public :: solve_by_proximal_newton, needs_proximal_steps, may_take_proximal_steps, &
    is_narrow_band

  integer,  parameter :: largest_inverse = 3000  !! rows up to which W is worth inverting anew
  integer,  parameter :: largest_copy = 10000    !! rows up to which it is worth a copy
  integer,  parameter :: max_steps = 30
  integer,  parameter :: patience = 6            !! steps without a half of progress
  real(wp), parameter :: largest_alpha = 3.0e-2_wp
  real(wp), parameter :: first_floor = 1.0e-6_wp !! of alpha, lowered where steps gain slowly
  real(wp), parameter :: floor_of_twins = 1.0e-2_wp !! the same, of twins
  real(wp), parameter :: smallest_alpha = 1.0e-8_wp
  real(wp), parameter :: least_alpha = 1.0e-9_wp
  !! of the step after one that changed nothing: below what rows of a node contradict each other by
  !! in a stiff corner, 1e-8 to 5e-8
  real(wp), parameter :: slow = 0.3_wp           !! of the residual, left by a step
  real(wp), parameter :: unchanged = 1.0e-2_wp
  !! by which a step that changed nothing changes it: from 1e-3 to 1e-1 six scenes take the same
  !! iterations within 2 %; without the last step a stiff corner takes 12,586 for 91 [-]
  real(wp), parameter :: alpha_of_residual = 0.3_wp
  real(wp), parameter :: far = 1000.0_wp         !! of alpha from where the inverse was taken [-]
  integer,  parameter :: widths_worth_it = 3  !! rows beside the width of a band that is worth it
  real(wp), parameter :: singular = 1.0e10_wp    !! S_nn W_nn of a point [-]

contains

  !> Proximal steps until the residual of the problem itself is at the tolerance.
  !>
  !> Each step solves the problem with W + alpha D and x_free - alpha D r, D = 1/rho_i at the rows
  !> of point i, alpha a third of the residual: docs/theory.md (4.12). Not converging is no error:
  !> the report says so, and r is the best that was found.
  subroutine solve_by_proximal_newton(problem, x_free, controls, r, report, briefly)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: x_free(:)       !! (n_rows) [length]
    type(contact_controls_t), intent(in) :: controls
    real(wp), intent(inout) :: r(:, :)      !! (3,n_points) warm start in, solution out [force]
    type(contact_report_t), intent(out) :: report
    logical, intent(in), optional :: briefly !! only as long as each step gains a half
    type(contact_problem_t) :: softer
    type(contact_controls_t) :: newton
    type(contact_report_t) :: here
    real(wp) :: r_start(3, problem%n_points), trial(3, problem%n_points), d(problem%n_rows)
    real(wp) :: of_point(problem%n_points) !! D there [length/force]
    real(wp) :: alpha, last, inverted_at, floor_of_alpha, caution, lowest
    integer :: step, idle, most_idle
    logical :: is_solved, is_last !! the step

    newton = controls
    if (.not. allocated(problem%twin)) newton%factorises = .true.
    of_point = 1.0_wp/problem%rho_map
    if (allocated(problem%twin)) then
      where (problem%twin == 0) of_point = 0.0_wp
    end if
    d = pack_rows(problem, spread(of_point, 1, 3))
    most_idle = patience
    if (present(briefly)) most_idle = merge(0, patience, briefly)
    r_start = r
    call judge(problem, x_free, r, r_start, controls, report)
    report%products = 1
    lowest = report%residual
    last = 0.0_wp
    inverted_at = 0.0_wp
    floor_of_alpha = merge(floor_of_twins, first_floor, allocated(problem%twin))
    caution = 1.0_wp
    idle = 0
    is_last = .false.
    steps: do step = 1, max_steps
      if (report%converged() .or. idle > most_idle) exit steps
      alpha = caution*min(largest_alpha, max(floor_of_alpha, alpha_of_residual*report%residual))
      if (is_last) alpha = least_alpha
      if (alpha > 1.0_wp) exit steps
      call soften(problem, d, alpha, last, inverted_at, softer)
      ! The step has to be solved no better than what it leaves of the problem itself.
      newton%tolerance = max(0.3_wp*controls%tolerance, &
        0.1_wp*report%residual*min(1.0_wp, 10.0_wp*alpha))
      trial = r
      call solve_by_global_newton(softer, x_free - alpha*d*pack_rows(problem, r), newton, trial, &
        here, is_patient=is_last)
      report%iterations = report%iterations + here%iterations
      report%products = report%products + here%products + 1
      is_solved = here%converged()
      call judge(problem, x_free, trial, r_start, controls, here)
      if (is_last) idle = most_idle
      is_last = is_solved .and. abs(here%residual - report%residual) <= unchanged*report%residual
      idle = idle + 1
      if (here%residual < 0.5_wp*lowest) then
        lowest = here%residual
        idle = 0
      end if
      if (here%residual < report%residual) then
        if (here%residual > slow*report%residual) floor_of_alpha = max(smallest_alpha, &
          0.1_wp*floor_of_alpha)
        r = trial
        report%residual = here%residual
        report%worst_point = here%worst_point
        report%ending = here%ending
        caution = max(1.0_wp, 0.5_wp*caution)
      else
        caution = 10.0_wp*caution
      end if
    end do steps
    report%solver = solver_global_newton
  end subroutine solve_by_proximal_newton

  !> Whether W is there, and not too large.
  pure logical function may_take_proximal_steps(problem) result(may)
    type(contact_problem_t), intent(in) :: problem

    may = .not. is_map(problem%compliance) .and. problem%n_rows <= merge(largest_copy, &
      largest_inverse, allocated(problem%twin))
  end function may_take_proximal_steps

  !> Whether W is singular as far as Newton's method can tell, and not too large. Twins make it so
  !> where both press.
  pure logical function needs_proximal_steps(problem, r)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: r(:, :)  !! (3,n_points) reactions to start from [force]
    integer :: i

    needs_proximal_steps = .false.
    if (.not. may_take_proximal_steps(problem)) return
    needs_proximal_steps = .not. allocated(problem%near%block)
    if (allocated(problem%twin)) then
      do i = 1, problem%n_points
        if (problem%twin(i) > 0) needs_proximal_steps = needs_proximal_steps .or. &
          min(r(1, i), r(1, problem%twin(i))) > 0.0_wp
      end do
    end if
    if (needs_proximal_steps) return
    ! rho_n = sqrt(S_nn/W_nn)
    needs_proximal_steps = any((problem%rho_global(1, :)*problem%block(1, 1, :))**2 > singular)
  end function needs_proximal_steps

  !> Whether the points have an order in which W is a band worth its name.
  pure logical function is_narrow_band(problem)
    type(contact_problem_t), intent(in) :: problem
    integer :: position(problem%n_rows), width

    is_narrow_band = .false.
    if (.not. allocated(problem%couplings%order)) return
    call place_rows(problem, position, width)
    is_narrow_band = widths_worth_it*width <= problem%n_rows
  end function is_narrow_band

  !> The residual of the problem itself.
  subroutine judge(problem, x_free, r, r_start, controls, report)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: x_free(:)                !! (n_rows) [length]
    real(wp), intent(in) :: r(:, :), r_start(:, :)   !! (3,n_points) [force]
    type(contact_controls_t), intent(in) :: controls
    type(contact_report_t), intent(inout) :: report
    real(wp) :: packed(problem%n_rows)

    packed = pack_rows(problem, r)
    call measure(problem, x_free, relative_gaps(problem, x_free, packed), packed, r_start, report)
    if (controls%shows_progress) call show_progress('contact iteration', report%iterations, &
      report%residual)
    report%ending = merge(ended_well, ended_stalled, report%residual <= controls%tolerance)
  end subroutine judge

  !> The problem with a larger diagonal of W.
  !>
  !> What the inverse says of rho stays as long as alpha is not far from the one it was taken at:
  !> along what W alone does not hold, S = 1/alpha. Of twins no inverse is needed: what they share
  !> is all that W does not hold.
  subroutine soften(problem, d, alpha, last, inverted_at, softer)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: d(:)              !! (n_rows) of D [length/force]
    real(wp), intent(in) :: alpha             !! [-]
    real(wp), intent(inout) :: last           !! alpha before, 0 at first [-]
    real(wp), intent(inout) :: inverted_at    !! alpha of the last inverse, 0 before the first [-]
    type(contact_problem_t), intent(inout) :: softer

    if (.not. last > 0.0_wp) then
      softer = problem
      if (.not. allocated(problem%twin)) softer%near = near_stiffness_t()
    end if
    call shift_diagonal(softer%compliance, problem%compliance, alpha*d)
    if (allocated(problem%twin)) then
      call scale_twins(problem, alpha, softer%rho_global)
    else if (alpha > far*inverted_at .or. alpha < inverted_at/far) then
      call scale_by_inverse(softer, alpha)
      inverted_at = alpha
    else
      softer%rho_global = softer%rho_global*sqrt(last/alpha)
    end if
    last = alpha
  end subroutine soften

  !> The two rho a point of the global Newton, the S of twins made larger by what holds their
  !> shares: two of them, each soft by alpha/rho_map, half of its inverse.
  pure subroutine scale_twins(problem, alpha, rho_global)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: alpha               !! [-]
    real(wp), intent(inout) :: rho_global(:, :) !! (2,n_points) [force/length]
    integer :: i

    do i = 1, problem%n_points
      if (problem%twin(i) == 0) cycle
      associate (rho => problem%rho_global(:, i), w => problem%block(:, :, i), &
                 of_share => 0.5_wp*problem%rho_map(i)/alpha)
        rho_global(1, i) = sqrt(rho(1)**2 + of_share/w(1, 1))
        rho_global(2, i) = sqrt(rho(2)**2 + 2.0_wp*of_share/(w(2, 2) + w(3, 3)))
      end associate
    end do
  end subroutine scale_twins

  !> The two rho a point of the global Newton, sqrt(S_nn/W_nn) and sqrt(tr S_tt/tr W_tt), S = W^-1.
  subroutine scale_by_inverse(problem, alpha)
    type(contact_problem_t), intent(inout) :: problem
    real(wp), intent(in) :: alpha             !! for a W that is not positive definite for all that
    real(wp), allocatable :: s(:, :)
    real(wp), dimension(3, problem%n_points) :: s_ii, w_ii
    integer :: position(problem%n_rows), width, i
    logical :: regular

    if (is_narrow_band(problem)) then
      call place_rows(problem, position, width)
      allocate (s(width + 1, problem%n_rows))
      call fill_band(problem, position, s)
      call invert_band(s, regular)
      s_ii = unpack_rows(problem, s(1, position))
    else
      call get_inverse(problem%compliance, s, regular)
      s_ii = unpack_rows(problem, [(s(i, i), i=1, problem%n_rows)])
    end if
    if (.not. regular) then
      problem%rho_global = spread(problem%rho_map, 1, 2)/sqrt(alpha)
      return
    end if
    w_ii = unpack_rows(problem, diagonal_of(problem%compliance))
    problem%rho_global(1, :) = sqrt(s_ii(1, :)/w_ii(1, :))
    problem%rho_global(2, :) = problem%rho_global(1, :)
    where (s_ii(2, :) + s_ii(3, :) > 0.0_wp) problem%rho_global(2, :) = sqrt((s_ii(2, :) + &
      s_ii(3, :))/(w_ii(2, :) + w_ii(3, :)))
  end subroutine scale_by_inverse

  !> The rows in the order of the couplings, and how wide the band is then.
  pure subroutine place_rows(problem, position, width)
    type(contact_problem_t), intent(in) :: problem
    integer, intent(out) :: position(:)          !! (n_rows)
    integer, intent(out) :: width             !! largest distance of coupled rows
    integer :: i, a, k, m

    m = 0
    do i = 1, problem%n_points
      do a = 1, 3
        associate (row => problem%row(a, problem%couplings%order(i)))
          if (row == 0) cycle
          m = m + 1
          position(row) = m
        end associate
      end do
    end do
    width = 0
    do i = 1, problem%n_points
      do k = problem%couplings%start(i), problem%couplings%start(i + 1) - 1
        ! The normal stands first, and a point has three rows at most.
        width = max(width, 2 + abs(position(problem%row(1, i)) - &
          position(problem%row(1, problem%couplings%other(k)))))
      end do
    end do
    width = min(width, max(0, problem%n_rows - 1))
  end subroutine place_rows

  !> The lower half of W as a band.
  pure subroutine fill_band(problem, position, s)
    type(contact_problem_t), intent(in) :: problem
    integer, intent(in) :: position(:)           !! (n_rows)
    real(wp), intent(out) :: s(:, :)          !! (width+1,n_rows)
    real(wp) :: block(3, 3)
    integer :: i, k, a, b

    s = 0.0_wp
    do i = 1, problem%n_points
      do k = problem%couplings%start(i), problem%couplings%start(i + 1) - 1
        block = block_of(problem%compliance, problem%row(:, problem%couplings%other(k)), &
          problem%row(:, i))
        do b = 1, 3
          do a = 1, 3
            associate (row => problem%row(a, problem%couplings%other(k)), &
                       column => problem%row(b, i))
              if (min(row, column) == 0) cycle
              if (position(row) >= position(column)) s(1 + position(row) - position(column), &
                position(column)) = block(a, b)
            end associate
          end do
        end do
      end do
    end do
  end subroutine fill_band

end module proximal_newton_mod
