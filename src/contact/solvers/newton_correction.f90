!> The correction of Newton's method on all contact points at once: J dr = -Z by GMRES, as a band
!> where W is sparse, or dense.
!>
!> J = (I - P') + P' diag(rho) W with two rho a point: sqrt(S_nn/W_nn) and sqrt(tr S_tt/tr W_tt), S
!> the Schur complement at the point. docs/theory.md section 4.
module newton_correction_mod
  use kinds_mod, only: wp
  use dense_mod, only: solve_dense
  use banded_mod, only: solve_band
  use controls_mod, only: contact_controls_t
  use near_stiffness_mod, only: times_near
  use problem_mod, only: contact_problem_t, rough_product_with_w, pack_rows, unpack_rows
  use compliance_mod, only: block_of, get_column, is_map
  use gmres_mod, only: linear_map_t, solve_by_gmres
  use newton_iterate_mod, only: iterate_t, start_at
  implicit none
  private

  public :: find_corrections, linearise, largest_dense

  integer,  parameter :: small_dense = 100      !! rows up to which a factorisation is cheaper
  integer,  parameter :: small_floating = 300
  !! the same where bodies move freely: what is near a point says little of that
  real(wp), parameter :: products_saved = 30.0_wp
  !! so is that of m among n rows where m^3 is up to so many n^2
  integer,  parameter :: largest_dense = 3000   !! rows up to which it replaces GMRES that fails
  integer,  parameter :: widths_worth_it = 3     !! rows beside the width of a band that is worth it
  integer,  parameter :: max_products = 400     !! largest Krylov space

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

  !> Newton corrections J dr = -Z, of one residual or several.
  subroutine find_corrections(problem, now, z, controls, inexact, gmres_failed, dr, products)
    type(contact_problem_t), target, intent(in) :: problem
    type(iterate_t), target, intent(in) :: now  !! where J is taken
    real(wp), intent(in) :: z(:, :)             !! (n_rows,m) [force]
    type(contact_controls_t), intent(in) :: controls
    real(wp), intent(in) :: inexact             !! how exactly GMRES has to solve [-]
    logical, intent(inout) :: gmres_failed
    !! earlier in this problem, to solve a system or to make Newton's method converge: those that
    !! follow are factorised
    real(wp), intent(out) :: dr(:, :)           !! (n_rows,m) [force]
    integer, intent(inout) :: products          !! with W, summed
    integer, allocatable :: moving(:)
    type(preconditioned_t) :: near
    integer :: k, first, inner
    logical :: reached, needs_gmres, may_factorise

    if (allocated(problem%couplings%order)) then
      reached = .false.
      do k = 1, size(z, 2)
        call solve_as_band(problem, now, z(:, k), dr(:, k), reached)
        if (.not. reached) exit
      end do
      if (reached) return
    end if
    call find_moving(problem, now, moving)
    needs_gmres = is_map(problem%compliance)
    may_factorise = .not. needs_gmres .and. problem%n_rows <= largest_dense
    first = 1
    if (needs_gmres .or. .not. (controls%factorises .or. (gmres_failed .and. may_factorise) .or. &
      is_cheap(problem, size(moving), size(z, 2)))) then
      near%problem => problem
      near%at => now
      near%held = held_directions(problem, now)
      do first = 1, size(z, 2)
        call solve_by_gmres(near, -z(:, first), inexact, merge(worth_trying(size(moving), &
          problem%n_rows), max_products, may_factorise), dr(:, first), inner, reached)
        dr(:, first) = near%precondition(dr(:, first))
        products = products + inner
        if (reached .or. .not. may_factorise) cycle
        ! A system that GMRES does not solve is factorised, as far as that can be paid for.
        gmres_failed = .true.
        exit
      end do
    end if
    if (first > size(z, 2)) return
    call factorise_and_solve(problem, now, moving, z(:, first:), dr(:, first:), products)
  end subroutine find_corrections

  !> Corrections by the dense system of the rows that move: the residual of the others does not
  !> depend on x, and says dr = -Z at once.
  subroutine factorise_and_solve(problem, now, moving, z, dr, products)
    type(contact_problem_t), target, intent(in) :: problem
    type(iterate_t), target, intent(in) :: now
    integer, intent(in) :: moving(:)
    real(wp), intent(in) :: z(:, :)    !! (n_rows,m) [force]
    real(wp), intent(out) :: dr(:, :)  !! (n_rows,m) [force]
    integer, intent(inout) :: products
    type(jacobian_t) :: map
    real(wp) :: b(size(moving), size(z, 2)), of_others(problem%n_rows)
    real(wp), allocatable :: j(:, :)
    integer :: k

    map%problem => problem
    map%at => now
    dr = -z
    dr(moving, :) = 0.0_wp
    do k = 1, size(z, 2)
      call map%apply(dr(:, k), of_others)
      b(:, k) = -z(moving, k) - of_others(moving)
    end do
    products = products + size(z, 2)
    call form_jacobian(problem, now, moving, j)
    call solve_dense(j, b)
    dr(moving, :) = b
  end subroutine factorise_and_solve

  !> How many products with W GMRES may take, of `n` rows, where `m` of them may be factorised
  !> instead: as many as take about as long.
  pure integer function worth_trying(m, n) result(most)
    integer, intent(in) :: m, n
    real(wp), parameter :: faster = 10.0_wp !! factorisation than products, an operation [-]

    most = nint(max(products_saved, real(m, wp)**3/(faster*real(n, wp)**2)))
    most = min(max_products, most)
  end function worth_trying

  !> The Newton correction where W is sparse: the moving rows, in the order of the couplings, make a
  !> banded system.
  subroutine solve_as_band(problem, now, z, dr, solved)
    type(contact_problem_t), intent(in) :: problem
    type(iterate_t), intent(in) :: now
    real(wp), intent(in) :: z(:)         !! (n_rows) [force]
    real(wp), intent(inout) :: dr(:)     !! (n_rows) [force]
    logical, intent(out) :: solved       !! not where the band is wide, or the system singular
    real(wp), allocatable :: j(:, :), b(:)
    integer :: position(problem%n_rows), points(problem%n_points), m, n, width, i, k, a, column, c
    real(wp) :: of_point(3), block(3, 3)

    call place_moving(problem, now, position, points, m, n, width)
    solved = widths_worth_it*width <= m
    if (.not. solved) return
    allocate (j(3*width + 1, m), b(m))
    j = 0.0_wp
    ! Rows whose residual does not depend on x say dr = -Z at once.
    dr = -z
    do i = 1, n
      associate (row => problem%row(:, points(i)), p => now%dz_dx(:, :, points(i)))
        of_point = 0.0_wp
        do k = problem%couplings%start(points(i)), problem%couplings%start(points(i) + 1) - 1
          associate (other => problem%row(:, problem%couplings%other(k)))
            block = block_of(problem%compliance, row, other)
            do c = 1, 3
              if (other(c) == 0) cycle
              if (position(other(c)) == 0) of_point = of_point + block(:, c)*dr(other(c))
            end do
            if (position(other(1)) == 0) cycle
            block = matmul(p, block)
            if (problem%couplings%other(k) == points(i)) then
              block = block + now%dz_dr(:, :, points(i))
            end if
            do c = 1, 3
              if (other(c) == 0) cycle
              column = position(other(c))
              do a = 1, 3
                if (row(a) > 0) j(2*width + 1 + position(row(a)) - column, column) = block(a, c)
              end do
            end do
          end associate
        end do
        of_point = matmul(p, of_point)
        do a = 1, 3
          if (row(a) > 0) b(position(row(a))) = -z(row(a)) - of_point(a)
        end do
      end associate
    end do
    call solve_band(j, width, b, solved)
    do i = 1, problem%n_rows
      if (position(i) > 0) dr(i) = b(position(i))
    end do
  end subroutine solve_as_band

  !> Where the moving rows stand in the order of the couplings, and how wide the band is.
  subroutine place_moving(problem, now, position, points, m, n, width)
    type(contact_problem_t), intent(in) :: problem
    type(iterate_t), intent(in) :: now
    integer, intent(out) :: position(:)    !! (n_rows) 0 where the point projects to 0
    integer, intent(out) :: points(:)   !! (n_points) the first n of them move
    integer, intent(out) :: m, n, width !! rows, points, largest distance of coupled rows
    integer :: i, k, a

    position = 0
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
          position(problem%row(a, point)) = m
        end do
      end associate
    end do
    width = 0
    do i = 1, n
      do k = problem%couplings%start(points(i)), problem%couplings%start(points(i) + 1) - 1
        associate (row => problem%row(:, points(i)), &
                   other => problem%row(:, problem%couplings%other(k)))
          if (position(other(1)) == 0) cycle
          ! The normal stands first, and a point has three rows at most.
          width = max(width, abs(position(row(1)) - position(other(1))) + 2)
        end associate
      end do
    end do
  end subroutine place_moving

  !> Whether the dense system of m rows costs less than a few products with W for each residual.
  pure logical function is_cheap(problem, m, n_residuals)
    type(contact_problem_t), intent(in) :: problem
    integer, intent(in) :: m, n_residuals

    is_cheap = m <= merge(small_floating, small_dense, problem%is_proximal) .or. &
      real(m, wp)**3 <= products_saved*n_residuals*real(problem%n_rows, wp)**2
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
    integer :: position(problem%n_rows), i, a, b, column

    position = 0
    do i = 1, size(moving)
      position(moving(i)) = i
    end do
    allocate (j(size(moving), size(moving)), source=0.0_wp)
    do column = 1, size(moving)
      call get_column(problem%compliance, moving(column), w)
      do i = 1, problem%n_points
        associate (row => problem%row(:, i), d => now%dz_dx(:, :, i))
          if (position(row(1)) == 0) cycle
          do b = 1, 3
            if (row(b) == 0) cycle
            do a = 1, 3
              if (row(a) > 0) j(position(row(a)), column) = j(position(row(a)), column) + &
                d(a, b)*w(row(b))
            end do
          end do
        end associate
      end do
    end do
    do i = 1, problem%n_points
      associate (row => problem%row(:, i))
        if (position(row(1)) == 0) cycle
        do b = 1, 3
          if (row(b) == 0) cycle
          do a = 1, 3
            if (row(a) > 0) then
              j(position(row(a)), position(row(b))) = j(position(row(a)), &
                position(row(b))) + now%dz_dr(a, b, i)
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
        ! rho P'_tt is I, or the part of it that holds times the projection across the slip.
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

end module newton_correction_mod
