!> Semi-smooth Newton on all contact points at once, with a line search on the residual.
!>
!> 1. Residual Z of the pseudo-potential at every point, branch and derivative of every projection.
!>   2. Points that project to 0: their correction is -r. The others: J dr = -Z.
!>   3. Line search: halve the step until |Z| decreases.
!>
!> J = (I - P') + P' diag(rho) W with two rho a point: sqrt(S_nn/W_nn) and sqrt(tr S_tt/tr W_tt), S
!> the Schur complement at the point. docs/theory.md section 4.
module global_newton_mod
  use kinds_mod, only: wp
  use dense_mod, only: solve_dense
  use banded_mod, only: solve_band
  use controls_mod, only: contact_controls_t, solver_global_newton, linear_auto, linear_gmres, &
    linear_direct
  use increment_report_mod, only: ended_at_limit, ended_stalled
  use near_stiffness_mod, only: times_near
  use problem_mod, only: contact_problem_t, contact_report_t, relative_gaps, product_with_w, &
                         rough_product_with_w, &
                         pack_rows, unpack_rows, measure
  use compliance_mod, only: block_of, get_column
  use local_point_mod, only: local_point_t
  use pseudopotential_mod, only: pseudopotential_residual, residual_beside_driven
  use gmres_mod, only: linear_map_t, solve_by_gmres
  implicit none
  private

  public :: solve_by_global_newton, response_to_shifts, linearise, residual_at

  integer,  parameter :: max_iterations = 60
  integer,  parameter :: small_dense = 100      !! rows up to which a factorisation is cheaper
  real(wp), parameter :: products_saved = 30.0_wp
  !! so is that of m among n rows where m^3 is up to so many n^2
  integer,  parameter :: largest_dense = 3000   !! rows up to which it replaces GMRES that fails
  integer,  parameter :: band_share = 3         !! rows beside the width of a band that is worth it
  integer,  parameter :: exact_response = 1000  !! rows up to which responses are factorised
  integer,  parameter :: max_products = 400     !! largest Krylov space
  real(wp), parameter :: tightest_inner = 1.0e-3_wp  !! residuals of GMRES, relative [-]
  real(wp), parameter :: loosest_inner = 1.0e-1_wp
  real(wp), parameter :: shortest_step = 1.0e-3_wp
  integer,  parameter :: max_stalled = 12       !! iterations without a tenth of progress

  !> An iterate: reactions, gaps, residual and its derivative at every point.
  type :: iterate_t
    real(wp), allocatable :: r(:), x(:)            !! (n_rows) [force], [length]
    real(wp), allocatable :: z(:)                  !! (n_rows) [force]
    real(wp), allocatable :: dz_dr(:, :, :)        !! (3,3,n_points) [-]
    real(wp), allocatable :: dz_dx(:, :, :)        !! (3,3,n_points) [force/length]
    real(wp) :: merit = 0.0_wp                     !! |Z|
  end type iterate_t

  !> J as a linear map: dz_dr + dz_dx W.
  type, extends(linear_map_t) :: jacobian_t
    type(contact_problem_t), pointer :: problem => null()
    type(iterate_t), pointer :: at => null()
  contains
    procedure :: apply => apply_jacobian
  end type jacobian_t

  !> J M^-1, M^-1 an approximate inverse by the stiffness near each point.
  type, extends(jacobian_t) :: preconditioned_t
    real(wp), allocatable :: held(:, :, :) !! (3,3,n_points) projection on what cannot move [-]
  contains
    procedure :: apply => apply_preconditioned
    procedure :: precondition
  end type preconditioned_t

contains

  !> Iterate from the warm start until the scaled natural map is at the tolerance.
  !>
  !> Not converging is no error: the report says so and r is the best iterate.
  subroutine solve_by_global_newton(problem, x_free, controls, r, report)
    type(contact_problem_t), target, intent(in) :: problem
    real(wp), intent(in) :: x_free(:)       !! (n_rows) [length]
    type(contact_controls_t), intent(in) :: controls
    real(wp), intent(inout) :: r(:, :)      !! (3,n_points) warm start in, solution out [force]
    type(contact_report_t), intent(out) :: report
    type(iterate_t), target :: now, trial
    type(contact_report_t) :: here
    real(wp) :: r_start(3, problem%n_points), projected(problem%n_rows)
    real(wp), allocatable :: dr(:)
    real(wp) :: forcing, last_merit
    integer :: stalled

    last_merit = 0.0_wp
    r_start = r
    now = start_at(problem, x_free, r)
    trial = now
    report%residual = huge(report%residual)
    stalled = 0
    newton: do
      ! Judged is what is returned: the projections, on the cone to rounding, 0 where open.
      projected = now%r - now%z
      call measure(problem, x_free, relative_gaps(problem, x_free, projected), projected, &
        r_start, here)
      report%products = report%products + 1
      stalled = stalled + 1
      if (here%residual < 0.9_wp*report%residual) stalled = 0
      if (here%residual < report%residual) then
        report%residual = here%residual
        report%worst_point = here%worst_point
        r = unpack_rows(problem, projected)
      end if
      report%converged = report%residual <= controls%tolerance
      if (report%converged .or. stalled > max_stalled .or. &
        report%iterations >= max_iterations) exit newton

      forcing = forcing_term(now%merit, last_merit, controls%tolerance/report%residual)
      last_merit = now%merit
      call find_correction(problem, now, controls, forcing, dr, report%products)
      call search_line(problem, now, dr, trial)
      report%products = report%products + 1
      report%iterations = report%iterations + 1
      now%r = trial%r
      now%x = trial%x
      call evaluate(problem, now)
    end do newton
    if (.not. report%converged) report%ending = ended_stalled
    if (.not. report%converged .and. report%iterations >= max_iterations) report%ending = &
      ended_at_limit
    report%solver = solver_global_newton
  end subroutine solve_by_global_newton

  !> How exactly the next linear system has to be solved: as Newton's method has converged lately
  !> (Eisenstat and Walker, their second choice), no tighter than the tolerance needs.
  pure real(wp) function forcing_term(merit, last_merit, left)
    real(wp), intent(in) :: merit, last_merit !! |Z| now and an iteration before, 0 at first [force]
    real(wp), intent(in) :: left              !! tolerance over residual [-]
    real(wp), parameter :: share = 0.9_wp

    forcing_term = loosest_inner
    if (last_merit > 0.0_wp) forcing_term = share*min(1.0_wp, merit/last_merit)**2
    forcing_term = min(loosest_inner, max(tightest_inner, forcing_term, 0.3_wp*left))
  end function forcing_term

  !> How the reactions of a solved problem answer small changes of x_free: dr/dx_free times `q`.
  subroutine response_to_shifts(problem, x_free, controls, r, q, response)
    type(contact_problem_t), target, intent(in) :: problem
    real(wp), intent(in) :: x_free(:)           !! (n_rows) [length]
    type(contact_controls_t), intent(in) :: controls
    real(wp), intent(in) :: r(:, :)             !! (3,n_points) the solution [force]
    real(wp), intent(in) :: q(:, :)             !! (n_rows,m) changes [-]
    real(wp), intent(out) :: response(:, :)     !! (n_rows,m) [force/length]
    type(iterate_t), target :: at

    at = start_at(problem, x_free, r)
    call find_responses(problem, at, exact_controls(problem, controls), q, response)
  end subroutine response_to_shifts

  !> The residual Z at any reactions and its derivatives, by all of them and by x_free along `q`.
  subroutine linearise(problem, x_free, r, q, z, by_r, by_q)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: x_free(:)           !! (n_rows) [length]
    real(wp), intent(in) :: r(:, :)             !! (3,n_points) [force]
    real(wp), intent(in) :: q(:, :)             !! (n_rows,m) changes of x_free [-]
    real(wp), intent(out) :: z(:)               !! (n_rows) [force]
    real(wp), intent(out) :: by_r(:, :)         !! (n_rows,n_rows) [-]
    real(wp), intent(out) :: by_q(:, :)         !! (n_rows,m) [force/length]
    type(iterate_t) :: at
    real(wp), allocatable :: j(:, :)
    real(wp), dimension(3, problem%n_points) :: change
    integer :: i, k

    at = start_at(problem, x_free, r)
    z = at%z
    call form_jacobian(problem, at, [(i, i=1, problem%n_rows)], j)
    by_r = j
    do k = 1, size(q, 2)
      change = unpack_rows(problem, q(:, k))
      do i = 1, problem%n_points
        change(:, i) = matmul(at%dz_dx(:, :, i), change(:, i))
      end do
      by_q(:, k) = pack_rows(problem, change)
    end do
  end subroutine linearise

  !> How the Newton step there answers changes of x_free.
  subroutine find_responses(problem, at, controls, q, response)
    type(contact_problem_t), target, intent(in) :: problem
    type(iterate_t), target, intent(inout) :: at  !! its residual is lost
    type(contact_controls_t), intent(in) :: controls
    real(wp), intent(in) :: q(:, :)             !! (n_rows,m) changes [-]
    real(wp), intent(out) :: response(:, :)     !! (n_rows,m) [force/length]
    real(wp), dimension(3, problem%n_points) :: change
    real(wp), allocatable :: dr(:)
    integer :: i, j, products

    products = 0
    do j = 1, size(q, 2)
      change = unpack_rows(problem, q(:, j))
      do i = 1, problem%n_points
        change(:, i) = matmul(at%dz_dx(:, :, i), change(:, i))
      end do
      at%z = pack_rows(problem, change)
      call find_correction(problem, at, controls, tightest_inner, dr, products)
      response(:, j) = dr
    end do
  end subroutine find_responses

  !> The same controls, with factorised responses where these can be paid for.
  pure function exact_controls(problem, controls) result(exactly)
    type(contact_problem_t), intent(in) :: problem
    type(contact_controls_t), intent(in) :: controls
    type(contact_controls_t) :: exactly

    exactly = controls
    if (problem%n_rows <= exact_response) exactly%linear = linear_direct
  end function exact_controls

  !> The residual Z at any reactions.
  function residual_at(problem, x_free, r) result(z)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: x_free(:)           !! (n_rows) [length]
    real(wp), intent(in) :: r(:, :)             !! (3,n_points) [force]
    real(wp) :: z(problem%n_rows)               !! [force]
    type(iterate_t) :: at

    at = start_at(problem, x_free, r)
    z = at%z
  end function residual_at

  !> The iterate at given reactions.
  function start_at(problem, x_free, r) result(at)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: x_free(:), r(:, :)
    type(iterate_t) :: at

    allocate (at%r(problem%n_rows), at%x(problem%n_rows), at%z(problem%n_rows))
    allocate (at%dz_dr(3, 3, problem%n_points), at%dz_dx(3, 3, problem%n_points))
    at%r = pack_rows(problem, r)
    at%x = relative_gaps(problem, x_free, at%r)
    call evaluate(problem, at)
  end function start_at

  !> Halve the step until |Z| decreases.
  subroutine search_line(problem, now, dr, trial)
    type(contact_problem_t), intent(in) :: problem
    type(iterate_t), intent(in) :: now
    real(wp), intent(in) :: dr(:)            !! (n_rows) full step [force]
    type(iterate_t), intent(inout) :: trial
    real(wp) :: dx(problem%n_rows), step

    dx = product_with_w(problem, dr)
    step = 1.0_wp
    do
      trial%r = now%r + step*dr
      trial%x = now%x + step*dx
      call evaluate(problem, trial)
      if (trial%merit <= (1.0_wp - 1.0e-4_wp*step)*now%merit .or. step < shortest_step) exit
      step = 0.5_wp*step
    end do
  end subroutine search_line

  !> Residual of the pseudo-potential at every point, and its derivatives.
  subroutine evaluate(problem, at)
    type(contact_problem_t), intent(in) :: problem
    type(iterate_t), intent(inout) :: at
    real(wp), dimension(3, problem%n_points) :: r, x, z
    type(local_point_t) :: point
    integer :: i

    r = unpack_rows(problem, at%r)
    x = unpack_rows(problem, at%x)
    do i = 1, problem%n_points
      point%mu = problem%mu(i)
      point%rho_n = problem%rho_global(1, i)
      point%rho_t = problem%rho_global(2, i)
      if (any(abs(problem%driven(:, i)) > 0.0_wp)) then
        call residual_beside_driven(point, problem%driven(:, i), r(:, i), x(:, i), z(:, i), &
          at%dz_dr(:, :, i), at%dz_dx(:, :, i))
      else
        call pseudopotential_residual(point, r(:, i), x(:, i), z(:, i), at%dz_dr(:, :, i), &
          at%dz_dx(:, :, i))
      end if
    end do
    at%z = pack_rows(problem, z)
    at%merit = norm2(at%z)
  end subroutine evaluate

  !> The Newton correction J dr = -Z.
  subroutine find_correction(problem, now, controls, inexact, dr, products)
    type(contact_problem_t), target, intent(in) :: problem
    type(iterate_t), target, intent(in) :: now
    type(contact_controls_t), intent(in) :: controls
    real(wp), intent(in) :: inexact             !! how exactly GMRES has to solve [-]
    real(wp), allocatable, intent(out) :: dr(:) !! (n_rows) [force]
    integer, intent(inout) :: products          !! with W, summed
    integer, allocatable :: moving(:)
    real(wp), allocatable :: j(:, :), b(:)
    type(jacobian_t) :: map
    type(preconditioned_t) :: near
    integer :: inner
    logical :: reached

    allocate (dr(problem%n_rows))
    if (allocated(problem%couplings%order) .and. controls%linear /= linear_gmres) then
      call solve_as_band(problem, now, dr, reached)
      if (reached) return
    end if
    call find_moving(problem, now, moving)
    if (controls%linear == linear_gmres .or. &
        (controls%linear == linear_auto .and. .not. is_cheap(size(moving), problem%n_rows))) then
      near%problem => problem
      near%at => now
      near%held = held_directions(problem, now)
      call solve_by_gmres(near, -now%z, inexact, max_products, dr, inner, reached)
      dr = near%precondition(dr)
      products = products + inner
      ! A system that GMRES does not solve is factorised, as far as that can be paid for.
      if (reached .or. controls%linear == linear_gmres) return
      if (problem%n_rows > largest_dense) return
    end if
    map%problem => problem
    map%at => now
    ! Rows whose residual does not depend on x say dr = -Z at once; the others make a dense system.
    dr = -now%z
    dr(moving) = 0.0_wp
    allocate (b(problem%n_rows))
    call map%apply(dr, b)
    products = products + 1
    b = -now%z - b
    b = b(moving)
    call form_jacobian(problem, now, moving, j)
    call solve_dense(j, b)
    dr(moving) = b
  end subroutine find_correction

  !> The Newton correction where W is sparse: the moving rows, in the order of the couplings, make a
  !> banded system.
  subroutine solve_as_band(problem, now, dr, solved)
    type(contact_problem_t), intent(in) :: problem
    type(iterate_t), intent(in) :: now
    real(wp), intent(inout) :: dr(:)     !! (n_rows) [force]
    logical, intent(out) :: solved       !! not where the band is wide, or the system singular
    real(wp), allocatable :: j(:, :), b(:)
    integer :: place(problem%n_rows), points(problem%n_points), m, n, width, i, k, a, column, c
    real(wp) :: of_point(3), block(3, 3)

    call place_moving(problem, now, place, points, m, n, width)
    solved = band_share*width <= m
    if (.not. solved) return
    allocate (j(3*width + 1, m), b(m))
    j = 0.0_wp
    ! Rows whose residual does not depend on x say dr = -Z at once.
    dr = -now%z
    do i = 1, n
      associate (row => problem%row(:, points(i)), p => now%dz_dx(:, :, points(i)))
        of_point = 0.0_wp
        do k = problem%couplings%start(points(i)), problem%couplings%start(points(i) + 1) - 1
          associate (other => problem%row(:, problem%couplings%other(k)))
            block = block_of(problem%compliance, row, other)
            do c = 1, 3
              if (other(c) == 0) cycle
              if (place(other(c)) == 0) of_point = of_point + block(:, c)*dr(other(c))
            end do
            if (place(other(1)) == 0) cycle
            block = matmul(p, block)
            if (problem%couplings%other(k) == points(i)) then
              block = block + now%dz_dr(:, :, points(i))
            end if
            do c = 1, 3
              if (other(c) == 0) cycle
              column = place(other(c))
              do a = 1, 3
                if (row(a) > 0) j(2*width + 1 + place(row(a)) - column, column) = block(a, c)
              end do
            end do
          end associate
        end do
        of_point = matmul(p, of_point)
        do a = 1, 3
          if (row(a) > 0) b(place(row(a))) = -now%z(row(a)) - of_point(a)
        end do
      end associate
    end do
    call solve_band(j, width, b, solved)
    do i = 1, problem%n_rows
      if (place(i) > 0) dr(i) = b(place(i))
    end do
  end subroutine solve_as_band

  !> Where the moving rows stand in the order of the couplings, and how wide the band is.
  subroutine place_moving(problem, now, place, points, m, n, width)
    type(contact_problem_t), intent(in) :: problem
    type(iterate_t), intent(in) :: now
    integer, intent(out) :: place(:)    !! (n_rows) 0 where the point projects to 0
    integer, intent(out) :: points(:)   !! (n_points) the first n of them move
    integer, intent(out) :: m, n, width !! rows, points, largest distance of coupled rows
    integer :: i, k, a

    place = 0
    m = 0
    n = 0
    do i = 1, problem%n_points
      associate (point => problem%couplings%order(i))
        if (.not. any(abs(now%dz_dx(:, :, point)) > 0.0_wp)) cycle
        n = n + 1
        points(n) = point
        do a = 1, 3
          if (problem%row(a, point) == 0) cycle
          m = m + 1
          place(problem%row(a, point)) = m
        end do
      end associate
    end do
    width = 0
    do i = 1, n
      do k = problem%couplings%start(points(i)), problem%couplings%start(points(i) + 1) - 1
        associate (row => problem%row(:, points(i)), &
                   other => problem%row(:, problem%couplings%other(k)))
          if (place(other(1)) == 0) cycle
          ! The normal stands first, and a point has three rows at most.
          width = max(width, abs(place(row(1)) - place(other(1))) + 2)
        end associate
      end do
    end do
  end subroutine place_moving

  !> Whether the dense system of m among n rows costs less than a few products with W.
  pure logical function is_cheap(m, n)
    integer, intent(in) :: m, n

    is_cheap = m <= small_dense .or. real(m, wp)**3 <= products_saved*real(n, wp)**2
  end function is_cheap

  !> The rows of the points that do not project to 0.
  subroutine find_moving(problem, now, moving)
    type(contact_problem_t), intent(in) :: problem
    type(iterate_t), intent(in) :: now
    integer, allocatable, intent(out) :: moving(:)
    logical :: moves(problem%n_rows)
    integer :: i, a

    do i = 1, problem%n_points
      do a = 1, 3
        if (problem%row(a, i) > 0) then
          moves(problem%row(a, i)) = any(abs(now%dz_dx(:, :, i)) > 0.0_wp)
        end if
      end do
    end do
    moving = pack([(i, i=1, problem%n_rows)], moves)
  end subroutine find_moving

  !> J over the moving rows.
  subroutine form_jacobian(problem, now, moving, j)
    type(contact_problem_t), intent(in) :: problem
    type(iterate_t), intent(in) :: now
    integer, intent(in) :: moving(:)
    real(wp), allocatable, intent(out) :: j(:, :)
    real(wp) :: w(problem%n_rows) !! a column [length/force]
    integer :: place(problem%n_rows), i, a, b, column

    place = 0
    do i = 1, size(moving)
      place(moving(i)) = i
    end do
    allocate (j(size(moving), size(moving)), source=0.0_wp)
    do column = 1, size(moving)
      call get_column(problem%compliance, moving(column), w)
      do i = 1, problem%n_points
        associate (row => problem%row(:, i), d => now%dz_dx(:, :, i))
          if (place(row(1)) == 0) cycle
          do b = 1, 3
            if (row(b) == 0) cycle
            do a = 1, 3
              if (row(a) > 0) j(place(row(a)), column) = j(place(row(a)), column) + &
                d(a, b)*w(row(b))
            end do
          end do
        end associate
      end do
    end do
    do i = 1, problem%n_points
      associate (row => problem%row(:, i))
        if (place(row(1)) == 0) cycle
        do b = 1, 3
          if (row(b) == 0) cycle
          do a = 1, 3
            if (row(a) > 0) then
              j(place(row(a)), place(row(b))) = j(place(row(a)), place(row(b))) + now%dz_dr(a, b, i)
            end if
          end do
        end do
      end associate
    end do
  end subroutine form_jacobian

  subroutine apply_jacobian(map, v, product)
    class(jacobian_t), intent(in) :: map
    real(wp), intent(in)  :: v(:)       !! (n_rows)
    real(wp), intent(out) :: product(:) !! (n_rows)
    real(wp), dimension(3, map%problem%n_points) :: r, x
    integer :: i

    r = unpack_rows(map%problem, v)
    x = unpack_rows(map%problem, rough_product_with_w(map%problem, v))
    do i = 1, map%problem%n_points
      r(:, i) = matmul(map%at%dz_dr(:, :, i), r(:, i)) + matmul(map%at%dz_dx(:, :, i), x(:, i))
    end do
    product = pack_rows(map%problem, r)
  end subroutine apply_jacobian

  subroutine apply_preconditioned(map, v, product)
    class(preconditioned_t), intent(in) :: map
    real(wp), intent(in)  :: v(:)       !! (n_rows)
    real(wp), intent(out) :: product(:) !! (n_rows)

    call apply_jacobian(map, map%precondition(v), product)
  end subroutine apply_preconditioned

  !> The directions in which a point is held, a projection: the normal of a point that presses, the
  !> tangents of one that sticks; of one that slides the tangent across, as long as it is held there
  !> more than it is free.
  pure function held_directions(problem, at) result(held)
    type(contact_problem_t), intent(in) :: problem
    type(iterate_t), intent(in) :: at
    real(wp) :: held(3, 3, problem%n_points)
    real(wp) :: across
    integer :: i

    held = 0.0_wp
    do i = 1, problem%n_points
      associate (rho => problem%rho_global(:, i), p => at%dz_dx(:, :, i))
        if (p(1, 1) > 0.0_wp) held(1, 1, i) = 1.0_wp
        ! rho P'_tt is I, or its share that holds times the projection across the slip.
        across = (p(2, 2) + p(3, 3))/rho(2)
        if (across > 1.5_wp) then
          held(2, 2, i) = 1.0_wp
          held(3, 3, i) = 1.0_wp
        else if (across > 0.5_wp) then
          held(2:, 2:, i) = p(2:, 2:)/(rho(2)*across)
        end if
      end associate
    end do
  end function held_directions

  !> About J^-1 v: what is held takes the reactions that the stiffness near it says, then the others
  !> what their own rows say. docs/theory.md (4.11).
  function precondition(map, v) result(dr)
    class(preconditioned_t), intent(in) :: map
    real(wp), intent(in) :: v(:)        !! (n_rows) [force]
    real(wp) :: dr(size(v))             !! [force]
    real(wp), dimension(3, map%problem%n_points) :: x, z, r
    real(wp) :: rest(3), rho(3)
    integer :: i

    if (.not. allocated(map%problem%near%block)) then
      dr = v
      return
    end if
    z = unpack_rows(map%problem, v)
    do i = 1, map%problem%n_points
      rho = map%problem%rho_global([1, 2, 2], i)
      x(:, i) = matmul(map%held(:, :, i), z(:, i)/rho)
    end do
    r = times_near(map%problem%near, x)
    do i = 1, map%problem%n_points
      r(:, i) = matmul(map%held(:, :, i), r(:, i))
      ! I - dz_dr = P'
      rest = r(:, i) - matmul(map%held(:, :, i), z(:, i))
      rest = z(:, i) + rest - matmul(map%at%dz_dr(:, :, i), rest)
      r(:, i) = r(:, i) + rest - matmul(map%held(:, :, i), rest)
    end do
    dr = pack_rows(map%problem, r)
  end function precondition

end module global_newton_mod
