!> Semi-smooth Newton on the displacements of the bodies and the reactions together, its linear
!> systems solved by iteration on the displacements.
!>
!>     K v - C^T r = f,      Z(r, x_free + C v) = 0,      docs/theory.md (4.16)
!>
!> Of a point that is held the displacement is known and its reaction is what is left out of
!> balance there; of the others the reaction is known, or follows the normal one. So the reactions
!> are eliminated, and the systems are those of the bodies with these directions held.
!>
!> Free motions of bodies are among the displacements. Those that no held point resists are sprung
!> in a step (loose_motions_mod), and the step is not shortened.
module whole_newton_mod
  use kinds_mod, only: wp
  use progress_line_mod, only: show_progress
  use controls_mod, only: contact_controls_t, solver_global_newton
  use increment_report_mod, only: ended_well, ended_at_limit, ended_stalled, ended_unbalanced
  use problem_mod, only: contact_problem_t, contact_report_t, pack_rows, unpack_rows, measure
  use newton_iterate_mod, only: iterate_t, evaluate, forcing_term
  use held_points_mod, only: held_points_t, expect, expect_sticking, find_held
  use loose_motions_mod, only: loose_motions_t, find_loose, spring_forces
  use gmres_mod, only: linear_map_t, solve_by_gmres
  use body_map_mod, only: body_map_t
  implicit none
  private

  public :: bodies_t, solve_with_body

  integer,  parameter :: max_iterations = 40
  integer,  parameter :: max_stalled = 8        !! iterations without a tenth of progress
  integer,  parameter :: max_products = 80      !! largest Krylov space
  integer,  parameter :: most_settling = 6      !! steps in which all friction is taken to stick
  real(wp), parameter :: tightest_inner = 1.0e-4_wp !! residuals of GMRES, relative [-]
  real(wp), parameter :: loosest_inner = 1.0e-2_wp
  real(wp), parameter :: at_most = 50.0_wp         !! forces to close gaps, beside the merit [-]
  real(wp), parameter :: far = 0.1_wp
  !! residual of a start whose gaps say less of what is held than its reactions [-]
  real(wp), parameter :: shortest_step = 0.2_wp
  integer,  parameter :: remembered = 4         !! places that the line search looks back at

  !> What contact does to the bodies, and what else.
  type :: bodies_t
    real(wp), allocatable :: v(:)       !! (n) a guess in, displacement out [length]
    real(wp), allocatable :: load(:)    !! (n) f, beside that of x_free [force]
    real(wp), allocatable :: remains(:) !! (n) out: K v - C^T r - f, as found [force]
    real(wp), allocatable :: gaps(:)    !! (n_rows) out: gaps and slips [length]
    real(wp), allocatable :: motions(:, :)
    !! (n_rows,m) what free motions do there; their pins are among the unknowns [-]
    real(wp), allocatable :: driven(:)  !! (m) what the load does along them [force]
    real(wp), allocatable :: unbalanced(:)
    !! (m) out: what the forces do along motions that nothing resists, where it ends so [force]
    real(wp) :: largest = 0.0_wp        !! force at a node, so far [force]
  end type bodies_t

  !> A step: of displacements, of what they leave, of reactions.
  type :: step_t
    real(wp), allocatable :: v(:), g(:) !! (n) [length], [force]
    real(wp), allocatable :: r(:, :)    !! (3,n_points) [force]
  end type step_t

  !> Displacements and reactions on the way, and what they leave.
  type :: place_t
    real(wp), allocatable :: v(:)  !! (n) displacement of the bodies [length]
    real(wp), allocatable :: g(:)  !! (n) K v - C^T r - f [force]
    type(iterate_t) :: at          !! reactions and gaps
    real(wp) :: merit = 0.0_wp     !! of both residuals [force]
    logical :: is_idle = .false.   !! bodies move freely, and nothing has acted on any so far
    real(wp) :: scale = 0.0_wp     !! the largest force at a node at the start [force]
    real(wp) :: allowed(remembered) = 0.0_wp
    !! those of the last places: one of them may be come up to [force]
  end type place_t

  !> Bodies that have come a way slide everywhere, which holds nothing and says little of what
  !> friction would hold: it sticks until the points that press are known.
  type :: settling_t
    logical :: is_on = .false.
    integer :: n = 0                     !! steps so far
    logical, allocatable :: pressed(:)   !! (n_points) in the last one
  end type settling_t

  !> The system over the inverse: L M.
  type, extends(linear_map_t) :: eliminated_t
    class(body_map_t), pointer :: body => null()
    type(contact_problem_t), pointer :: problem => null()
    type(held_points_t), pointer :: held => null()
    type(loose_motions_t), pointer :: loose => null()
  contains
    procedure :: apply => apply_eliminated
  end type eliminated_t

contains

  !> Iterate until the scaled natural map is at the tolerance, and the forces of the bodies balance
  !> to it.
  !>
  !> Not converging is no error: the report says so.
  subroutine solve_with_body(problem, body, x_free, controls, bodies, r, report)
    type(contact_problem_t), target, intent(in) :: problem
    class(body_map_t), target, intent(inout) :: body
    real(wp), intent(in) :: x_free(:)       !! (n_rows) without reactions and load [length]
    type(contact_controls_t), intent(in) :: controls
    type(bodies_t), intent(inout) :: bodies
    real(wp), intent(inout) :: r(:, :)      !! (3,n_points) warm start in, solution out [force]
    type(contact_report_t), intent(out) :: report
    type(place_t) :: now
    type(held_points_t), target :: held
    type(loose_motions_t), target :: loose
    type(contact_report_t) :: here
    type(step_t) :: step
    real(wp) :: r_start(3, problem%n_points), unsolved(size(bodies%v))
    real(wp) :: forcing, loosest, last_merit, left, scale
    type(settling_t) :: settling
    integer :: stalled
    logical :: is_known !! by the reactions to start from: what is held

    r_start = r
    is_known = any(abs(r) > 0.0_wp)
    bodies%remains = 0.0_wp*bodies%v
    allocate (bodies%unbalanced(size(bodies%motions, 2)), source=0.0_wp)
    call begin(problem, body, x_free, bodies, r, now)
    ! Where reactions vanish what is left of those to start from is beside what they were.
    scale = max(bodies%largest, maxval(abs(now%g)))
    now%scale = scale
    last_merit = 0.0_wp
    loosest = loosest_inner
    report%residual = huge(report%residual)
    stalled = 0
    allocate (settling%pressed(problem%n_points), source=.false.)
    settling%is_on = .not. is_known .and. any(problem%mu > 0.0_wp)
    newton: do
      call judge(problem, body, x_free, now, scale, r_start, unsolved, here)
      if (controls%shows_progress) call show_progress('contact iteration', report%iterations, &
        here%residual)
      stalled = stalled + 1
      if (here%residual < 0.9_wp*report%residual) stalled = 0
      if (here%residual < report%residual) then
        report%residual = here%residual
        report%worst_point = here%worst_point
        r = unpack_rows(problem, now%at%r - now%at%z)
        if (.not. here%residual > 0.0_wp) r = 0.0_wp
        bodies%v = now%v
        bodies%remains = unsolved
        bodies%gaps = now%at%x
      end if
      if (report%residual <= controls%tolerance) report%ending = ended_well
      if (report%converged() .or. stalled > max_stalled .or. &
        report%iterations >= max_iterations) exit newton
      left = controls%tolerance/report%residual
      ! What a loose solution leaves can send points to and fro between their states.
      if (last_merit > 0.0_wp) loosest = merge(max(tightest_inner, 0.1_wp*loosest), &
        min(loosest_inner, 10.0_wp*loosest), now%merit > 0.5_wp*last_merit)
      forcing = forcing_term(now%merit, last_merit, left, tightest_inner, loosest)
      last_merit = now%merit
      is_known = is_known .and. here%residual > far
      if (is_known) call expect(problem, now%at)
      call prepare_step(problem, body, bodies, now, held, loose, settling)
      bodies%unbalanced = loose%unbalanced
      if (any(abs(bodies%unbalanced) > 0.0_wp)) exit newton
      if (loose%n > 0) stalled = 0
      ! A loose answer would leave points beyond their cones that stick.
      if (settling%is_on) forcing = tightest_inner
      call find_step(problem, body, held, loose, now, forcing, step, report%products)
      is_known = .false.
      call search_line(problem, now, step, body)
      report%iterations = report%iterations + 1
    end do newton
    if (.not. report%converged()) then
      report%ending = merge(ended_at_limit, ended_stalled, report%iterations >= max_iterations)
      if (any(abs(bodies%unbalanced) > 0.0_wp)) report%ending = ended_unbalanced
    end if
    report%solver = solver_global_newton
  end subroutine solve_with_body

  !> What is held in the next step, and which motions are loose in it; how far the residuals may
  !> rise where these are others than before.
  subroutine prepare_step(problem, body, bodies, now, held, loose, settling)
    type(contact_problem_t), intent(in) :: problem
    class(body_map_t), intent(inout) :: body
    type(bodies_t), intent(in) :: bodies
    type(place_t), intent(inout) :: now
    type(held_points_t), intent(inout) :: held
    type(loose_motions_t), intent(inout) :: loose !! of the step before in
    type(settling_t), intent(inout) :: settling
    logical :: presses(problem%n_points), was_on
    integer :: was_loose
    real(wp) :: scale

    was_loose = loose%n
    was_on = settling%is_on
    scale = max(now%scale, norm2(bodies%load))
    call find_held(problem, now%at, held)
    call find_loose(problem, held, bodies%motions, bodies%driven, scale, now%at, loose)
    presses = held%along(1, 1, :) > 0.0_wp
    if (max(loose%n, was_loose) > 0) then
      settling%is_on = any(presses .and. problem%mu > 0.0_wp)
    else if (was_on) then
      settling%is_on = any(presses .neqv. settling%pressed)
    end if
    settling%is_on = settling%is_on .and. settling%n < most_settling
    if (settling%is_on) then
      settling%n = settling%n + 1
      call expect_sticking(problem, now%at)
      call find_held(problem, now%at, held)
      call find_loose(problem, held, bodies%motions, bodies%driven, scale, now%at, loose)
    end if
    settling%pressed = presses
    call body%hold(held%along, held%across)
    if (loose%n > 0 .or. settling%is_on) then
      now%allowed = huge(1.0_wp)
    else if (was_loose > 0 .or. was_on) then
      now%allowed = now%merit
    end if
  end subroutine prepare_step

  !> The place to start from: of the guess as much as the reactions to start from ask for.
  subroutine begin(problem, body, x_free, bodies, r, now)
    type(contact_problem_t), intent(in) :: problem
    class(body_map_t), intent(in) :: body
    real(wp), intent(in) :: x_free(:), r(:, :)
    type(bodies_t), intent(in) :: bodies
    type(place_t), intent(out) :: now
    real(wp), dimension(3, problem%n_points) :: x
    real(wp) :: forces(size(bodies%v)), share, energy

    allocate (now%g, mold=bodies%v)
    allocate (now%at%r(problem%n_rows), now%at%x(problem%n_rows), now%at%z(problem%n_rows))
    allocate (now%at%dz_dr(3, 3, problem%n_points), now%at%dz_dx(3, 3, problem%n_points))
    forces = bodies%load
    call body%add_from_points(r, forces)
    call body%product(bodies%v, now%g)
    energy = dot_product(bodies%v, now%g)
    share = 0.0_wp
    if (energy > 0.0_wp) share = dot_product(bodies%v, forces)/energy
    if (size(bodies%motions, 2) > 0) share = 1.0_wp ! what moves freely has come a way
    now%is_idle = size(bodies%motions, 2) > 0 .and. bodies%largest <= 0.0_wp
    now%v = share*bodies%v
    now%g = share*now%g - forces
    now%at%r = pack_rows(problem, r)
    call body%at_points(now%v, x)
    now%at%x = x_free + pack_rows(problem, x)
    call evaluate(problem, now%at)
    now%merit = norm2([now%at%merit, norm2(now%g)])
  end subroutine begin

  !> How good a place is: its natural map once reactions are projected, and the forces that are then
  !> out of balance at an unknown, beside the largest.
  subroutine judge(problem, body, x_free, now, largest, r_start, left, here)
    type(contact_problem_t), intent(in) :: problem
    class(body_map_t), intent(in) :: body
    real(wp), intent(in) :: x_free(:)
    type(place_t), intent(in) :: now
    real(wp), intent(in) :: largest, r_start(:, :)
    real(wp), intent(out) :: left(:)  !! (n) those forces [force]
    type(contact_report_t), intent(inout) :: here
    real(wp), parameter :: many = 100.0_wp ! operations
    real(wp) :: scale, rounding

    call measure(problem, x_free, now%at%x, now%at%r - now%at%z, r_start, here)
    left = now%g
    call body%add_from_points(unpack_rows(problem, now%at%z), left)
    if (now%is_idle) then
      ! Bodies that nothing presses are in balance but for what their stiffness rounds.
      rounding = many*epsilon(1.0_wp)*maxval(problem%rho_global)*maxval(abs(now%v))
      if (max(maxval(abs(left)), maxval(abs(now%at%r - now%at%z))) <= rounding) then
        here%residual = 0.0_wp
        return
      end if
    end if
    scale = max(largest, maxval(abs(now%at%r), dim=1))
    if (.not. scale > 0.0_wp) scale = maxval(abs(left)) ! nothing acts yet but what is left
    if (maxval(abs(left)) > 0.0_wp) here%residual = max(here%residual, maxval(abs(left))/scale)
  end subroutine judge

  !> The Newton step: its displacement, what it does to the balance of forces, its reactions.
  subroutine find_step(problem, body, held, loose, now, forcing, step, products)
    type(contact_problem_t), target, intent(in) :: problem
    class(body_map_t), target, intent(in) :: body
    type(held_points_t), target, intent(in) :: held
    type(loose_motions_t), target, intent(in) :: loose
    type(place_t), intent(in) :: now
    real(wp), intent(in) :: forcing
    type(step_t), intent(out) :: step
    integer, intent(inout) :: products  !! of the system, summed
    type(eliminated_t) :: map
    real(wp), dimension(size(now%v)) :: f, w
    real(wp), dimension(3, problem%n_points) :: of_points, x, z
    real(wp) :: tolerance
    integer :: i, inner
    logical :: reached

    allocate (step%v(size(now%v)), step%g(size(now%v)), source=0.0_wp)
    allocate (step%r(3, problem%n_points))
    z = unpack_rows(problem, now%at%z)
    do i = 1, problem%n_points
      x(:, i) = -matmul(held%along(:, :, i), z(:, i)/problem%rho_global([1, 2, 2], i))
    end do
    call body%add_from_points(x, step%v)
    if (any(abs(step%v) > 0.0_wp)) call body%product(step%v, step%g)
    f = now%g + step%g
    if (loose%n > 0) call body%add_at_pins(spring_forces(loose, body%at_pins(step%v)), f)
    call body%at_points(f, of_points)
    call eliminate(problem, held, body, of_points, 0.0_wp*x, f, with_own=.true.)
    map%body => body
    map%problem => problem
    map%held => held
    map%loose => loose
    ! The forces that it takes to close gaps may be large beside what is out of balance.
    tolerance = forcing
    if (norm2(f) > at_most*now%merit) tolerance = forcing*at_most*now%merit/norm2(f)
    call solve_by_gmres(map, -body%scale*f, tolerance, max_products, w, inner, reached)
    products = products + inner
    w = w/body%scale
    call body%precondition(w, f)
    step%v = step%v + f
    call body%product(f, w)
    step%g = step%g + w
    ! What is held takes what is out of balance there, the others what the law says.
    call body%at_points(now%g + step%g, of_points)
    call body%at_points(step%v, x)
    do i = 1, problem%n_points
      step%r(:, i) = matmul(held%along(:, :, i), of_points(:, i))
      of_points(:, i) = held%own(:, i) + held%follows(:, i)*of_points(1, i) - &
        matmul(held%across(:, :, i), x(:, i))
      step%r(:, i) = step%r(:, i) + of_points(:, i) - matmul(held%along(:, :, i), of_points(:, i))
    end do
    where (problem%row == 0) step%r = 0.0_wp
    call body%add_from_points(-step%r, step%g)
  end subroutine find_step

  !> From forces of the bodies to the residual of the system: at the points reactions are taken off,
  !> 0 along what is held.
  subroutine eliminate(problem, held, body, of_points, x, f, with_own)
    type(contact_problem_t), intent(in) :: problem
    type(held_points_t), intent(in) :: held
    class(body_map_t), intent(in) :: body
    real(wp), intent(in) :: of_points(:, :)  !! (3,n_points) C f [force]
    real(wp), intent(in) :: x(:, :)          !! (3,n_points) displacement there [length]
    real(wp), intent(inout) :: f(:)          !! (n) [force]
    logical, intent(in) :: with_own          !! what reactions are without the step too
    real(wp) :: reaction(3, problem%n_points), change(3)
    integer :: i

    do i = 1, problem%n_points
      reaction(:, i) = held%follows(:, i)*of_points(1, i) - matmul(held%across(:, :, i), &
        x(:, i))
      if (with_own) reaction(:, i) = reaction(:, i) + held%own(:, i)
      change = reaction(:, i) - of_points(:, i)
      reaction(:, i) = reaction(:, i) - matmul(held%along(:, :, i), change)
    end do
    where (problem%row == 0) reaction = 0.0_wp
    call body%add_from_points(-reaction, f)
  end subroutine eliminate

  !> The system's matrix times the approximate inverse times v.
  subroutine apply_eliminated(map, v, product)
    class(eliminated_t), intent(in) :: map
    real(wp), intent(in)  :: v(:)       !! (n)
    real(wp), intent(out) :: product(:) !! (n)
    real(wp), dimension(3, map%problem%n_points) :: of_points, x
    real(wp) :: w(size(v))

    call map%body%precondition(v/map%body%scale, w)
    call map%body%product(w, product)
    if (map%loose%n > 0) call map%body%add_at_pins(spring_forces(map%loose, &
      map%body%at_pins(w)), product)
    call map%body%at_points(product, of_points)
    call map%body%at_points(w, x)
    call eliminate(map%problem, map%held, map%body, of_points, x, product, with_own=.false.)
    product = map%body%scale*product
  end subroutine apply_eliminated

  !> Halve the step until the residuals decrease.
  subroutine search_line(problem, now, full, body)
    type(contact_problem_t), intent(in) :: problem
    type(place_t), intent(inout) :: now
    type(step_t), intent(in) :: full
    class(body_map_t), intent(in) :: body
    type(iterate_t) :: trial
    real(wp), dimension(3, problem%n_points) :: x
    real(wp) :: step, merit

    now%allowed = [now%allowed(2:), now%merit]
    call body%at_points(full%v, x)
    trial = now%at
    step = 1.0_wp
    do
      trial%r = now%at%r + step*pack_rows(problem, full%r)
      trial%x = now%at%x + step*pack_rows(problem, x)
      call evaluate(problem, trial)
      merit = norm2([trial%merit, norm2(now%g + step*full%g)])
      if (merit <= (1.0_wp - 1.0e-4_wp*step)*maxval(now%allowed) .or. step < shortest_step) exit
      step = 0.5_wp*step
    end do
    now%at = trial
    now%v = now%v + step*full%v
    now%g = now%g + step*full%g
    now%merit = merit
  end subroutine search_line

end module whole_newton_mod
