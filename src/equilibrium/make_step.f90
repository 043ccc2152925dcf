!> The step of an iteration of the equilibrium.
!>
!> The factor that is there, of the bodies' stiffness at another place, serves: with the law of the
!> points as they stand now, and rigid motions of what nothing holds, its solutions are steps, and
!> the last few of them are combined. As long as they lead fast enough, or no farther away while
!> points change what they do, no tangent is asked for. Where they do not they precondition GMRES on
!> the matrix of now. Where there is no such factor, or it is too far away, the matrix of now is
!> factorised.
!> docs/theory.md (4.27), (4.28).
module make_step_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t
  use dense_mod, only: factorise_general
  use anderson_mod, only: new_anderson, accelerate
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use dof_map_mod, only: unknowns_of, to_nodes
  use assembly_mod, only: triplets_t
  use sparse_factor_mod, only: solve_unsymmetric
  use gmres_mod, only: solve_by_gmres
  use iterate_mod, only: task_t, iterate_t
  use point_rows_mod, only: make_rows
  use linearise_mod, only: unknowns_t, number_unknowns, find_bodies_stiffness, set_t, step_t, &
    system_t, linearise, holding
  use kept_factor_mod, only: step_maker_t, kept_t, keep_points, solution_of
  use settle_points_mod, only: settle_points
  implicit none
  private

  public :: prepare_step, make_step

  real(wp), parameter :: fast = 0.5_wp
  !! what a step leaves of the error where that is enough: GMRES with its tangent costs some five of
  !! them [-]
  real(wp), parameter :: closely = 1.0e-3_wp !! solutions by GMRES, beside the right-hand side [-]
  integer, parameter :: most_products = 30 !! of GMRES: beyond, a factor costs less
  integer, parameter :: few_products = 6
  !! of GMRES: its solutions, and those of the factor alone, are much the same
  integer, parameter :: depth = 5          !! steps that are combined

contains

  !> What is asked of the bodies before it is said what the points do: their stiffness, unless the
  !> factor that is there says enough of it.
  subroutine prepare_step(scene, task, now, maker)
    type(scene_t), intent(in) :: scene
    type(task_t), intent(in) :: task
    type(iterate_t), intent(in) :: now
    type(step_maker_t), intent(inout) :: maker !! gets the diagonal

    if (maker%has_factor) return
    if (allocated(task%turned_from)) call number_unknowns(scene, task, now, maker%unknowns)
    call find_bodies_stiffness(scene, task, now, maker%unknowns%map, maker%stiffness)
    maker%diagonal = maker%stiffness%diagonal
  end subroutine prepare_step

  !> The step of an iteration.
  subroutine make_step(scene, points, task, now, set, maker, step, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(task_t), intent(in) :: task
    type(iterate_t), intent(in) :: now
    type(set_t), intent(inout) :: set
    !! what the points are taken to do; what they do in the step, where the factor says so
    type(step_maker_t), target, intent(inout) :: maker !! prepared
    type(step_t), intent(out) :: step
    type(error_t), allocatable, intent(out) :: error !! singular, or no memory
    type(set_t) :: settled
    real(wp), allocatable :: x(:)
    logical :: is_settled

    maker%led = maker%has_factor .and. maker%leads .and. .not. set%lands .and. &
      maker%last_products <= few_products .and. set%error <= merge(fast, 1.0_wp, repeats(maker, &
      set))*maker%error
    maker%error = set%error
    maker%on_bodies = set%on_bodies
    maker%held = set%on_bodies*holding(scene, task, maker%unknowns%map, maker%diagonal)
    if (maker%has_factor .and. .not. set%lands) then
      settled = set
      call settle_points(scene, points, task, now, maker, settled, x, is_settled)
      maker%led = maker%led .and. is_settled
      if (maker%led) then
        set = settled
      else if (is_settled) then
        ! How motions slip that points hardly hold is not known without the matrix of now.
        set%slides = set%presses .and. set%slides .or. .not. set%presses .and. settled%slides
        set%presses = settled%presses
        set%slides = set%slides .and. set%presses
      end if
    end if
    if (.not. maker%led) call solve_here(scene, points, task, now, set, maker, x, error)
    maker%presses = set%presses
    maker%slides = set%slides
    if (allocated(error)) return
    call take_apart(now, maker%unknowns, maker%system, x, step)
    if (maker%led .and. .not. any(abs(maker%system%known) > 0.0_wp)) then
      call look_back(now, set%rho, maker, step)
    else
      maker%memory = new_anderson(0, 0)
    end if
  end subroutine make_step

  !> A combination of the last steps by the factor alone, by Anderson's acceleration: they map
  !> displacements, and reactions with them, to displacements.
  subroutine look_back(now, rho, maker, step)
    type(iterate_t), intent(in) :: now
    real(wp), intent(in) :: rho(:)           !! (n_points) [force/length]
    type(step_maker_t), intent(inout) :: maker
    type(step_t), intent(inout) :: step
    real(wp), dimension(maker%unknowns%map%n_free + size(now%reaction)) :: at, image, next
    real(wp) :: more(3, size(now%u, 2)), soft(3, size(now%reaction, 2))

    if (maker%memory%depth == 0) then
      maker%memory = new_anderson(size(at), depth)
      maker%softness = 1.0_wp/rho
    end if
    soft = spread(maker%softness, 1, 3)
    associate (n => maker%unknowns%map%n_free)
      at = [unknowns_of(maker%unknowns%map, now%u), soft*now%reaction]
      image = at + [unknowns_of(maker%unknowns%map, step%u), soft*step%r]
      call accelerate(maker%memory, at, image, next)
      call to_nodes(maker%unknowns%map, next(:n) - image(:n), more)
      step%u = step%u + more
      step%r = step%r + reshape(next(n + 1:) - image(n + 1:), shape(soft))/soft
    end associate
  end subroutine look_back

  !> By the matrix of now: by GMRES, or its factor.
  subroutine solve_here(scene, points, task, now, set, maker, x, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(task_t), intent(in) :: task
    type(iterate_t), intent(in) :: now
    type(set_t), intent(in) :: set
    type(step_maker_t), target, intent(inout) :: maker
    real(wp), allocatable, intent(out) :: x(:)
    type(error_t), allocatable, intent(out) :: error !! singular, or no memory
    type(kept_t) :: kept
    logical :: is_solved

    if (maker%has_factor) call find_bodies_stiffness(scene, task, now, maker%unknowns%map, &
      maker%stiffness)
    associate (system => maker%system)
      call make_rows(scene, points, task, now, set%presses, .true., maker%changes, system%rows)
      system%is_whole = .true.
      call linearise(scene, points, task, now, maker%unknowns, set, maker%stiffness, system)
    end associate
    is_solved = .false.
    if (maker%has_factor) then
      call keep_points(maker, kept, is_solved)
      if (is_solved) call factorise_general(kept%schur, kept%pivot, is_solved)
      if (is_solved) then
        call solve_closely(kept, maker%system%b, maker%last_products, x, is_solved)
        maker%products = maker%products + maker%last_products
      end if
    end if
    if (is_solved) return
    call factorise_now(maker%system, maker, x, error)
    maker%n_factors = maker%n_factors + 1
  end subroutine solve_here

  !> Whether the points do what they did in the last step.
  pure logical function repeats(maker, set)
    type(step_maker_t), intent(in) :: maker
    type(set_t), intent(in) :: set

    repeats = allocated(maker%presses)
    if (repeats) repeats = all(maker%presses .eqv. set%presses) .and. all(maker%slides .eqv. &
      set%slides)
  end function repeats

  !> By a factor of the matrix of now.
  subroutine factorise_now(system, maker, x, error)
    type(system_t), intent(in) :: system
    type(step_maker_t), intent(in) :: maker
    real(wp), allocatable, intent(out) :: x(:)
    type(error_t), allocatable, intent(out) :: error !! singular, or no memory
    type(triplets_t) :: whole
    integer, allocatable :: mirrored(:)
    real(wp) :: b(system%a%n, 1)
    integer :: i

    whole%n = system%a%n
    associate (k => maker%stiffness%k, a => system%a, all_of => [(i, i=1, system%n_free)])
      mirrored = pack([(i, i=1, size(k%row))], k%row /= k%column)
      whole%row = [k%row, k%column(mirrored), all_of, a%row]
      whole%column = [k%column, k%row(mirrored), all_of, a%column]
      whole%value = [k%value, k%value(mirrored), maker%held, a%value]
    end associate
    b(:, 1) = system%b
    call solve_unsymmetric(whole, b, error)
    x = b(:, 1)
  end subroutine factorise_now

  !> By GMRES on the matrix of now.
  subroutine solve_closely(kept, b, products, x, is_solved)
    type(kept_t), intent(in) :: kept
    real(wp), intent(in) :: b(:)
    integer, intent(out) :: products
    real(wp), allocatable, intent(out) :: x(:)
    logical, intent(out) :: is_solved
    real(wp) :: y(size(b))

    call solve_by_gmres(kept, b, closely, most_products, y, products, is_solved)
    if (is_solved) x = solution_of(kept, y)
    is_solved = is_solved .and. .not. allocated(kept%maker%inverse%failure)
  end subroutine solve_closely

  !> Displacements and reactions of a solution.
  subroutine take_apart(now, unknowns, system, x, step)
    type(iterate_t), intent(in) :: now
    type(unknowns_t), intent(in) :: unknowns
    type(system_t), intent(in) :: system
    real(wp), intent(in) :: x(:)
    type(step_t), intent(out) :: step
    integer :: i, k

    allocate (step%u(3, size(now%u, 2)))
    call to_nodes(unknowns%map, x(:system%n_free), step%u)
    step%u = step%u + system%known
    step%r = -now%reaction
    do i = 1, size(step%r, 2)
      do k = 1, 3
        if (system%row(k, i) > 0) step%r(k, i) = x(system%row(k, i))
      end do
    end do
  end subroutine take_apart

end module make_step_mod
