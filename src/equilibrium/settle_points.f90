!> What the points do in a step by the factor that is there. docs/theory.md (4.28).
module settle_points_mod
  use kinds_mod, only: wp
  use dense_mod, only: factorise_general, solve_factorised
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use dof_map_mod, only: to_nodes
  use transfer_mod, only: relative_motion
  use iterate_mod, only: task_t, iterate_t, is_closed, is_beyond
  use point_rows_mod, only: make_rows
  use linearise_mod, only: set_t, linearise, derive_law, derive_driven
  use kept_factor_mod, only: step_maker_t, kept_t, keep_points, give_way, subtract_law, find_step
  implicit none
  private

  public :: settle_points

  integer, parameter :: most_rounds = 5 !! in which the step passes points
  integer, parameter :: most_sets = 30  !! of what the points do

contains

  !> What the points do in the step by the factor that is there, and that step: their law is solved
  !> with what bodies and rigid motions give way by, from what they are taken to do; what the step
  !> would pass presses, too.
  subroutine settle_points(scene, points, task, now, maker, set, x, ok)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(task_t), intent(in) :: task
    type(iterate_t), intent(in) :: now
    type(step_maker_t), target, intent(inout) :: maker !! gets the system
    type(set_t), intent(inout) :: set        !! its end, where there is one
    real(wp), allocatable, intent(out) :: x(:)
    logical, intent(out) :: ok               !! an end was found
    type(set_t) :: closed, settled
    type(kept_t) :: kept
    real(wp), allocatable :: of_bodies(:, :), moved(:), both(:)
    real(wp) :: u(3, size(now%u, 2))
    logical :: passed(points%n)
    integer :: round, i

    associate (system => maker%system)
      closed = set
      closed%slides = [(.false., i=1, points%n)]
      system%is_whole = .false.
      do round = 1, most_rounds
        call make_rows(scene, points, task, now, closed%presses, .false., maker%changes, &
          system%rows)
        call linearise(scene, points, task, now, maker%unknowns, closed, maker%stiffness, system)
        call keep_points(maker, kept, ok)
        if (.not. ok) return
        settled = set
        call give_way(maker, system%b, of_bodies, moved, ok)
        if (ok) call solve_law(points, task, now, kept, moved, settled, both, ok)
        if (.not. ok) return
        call find_step(kept, both, moved, of_bodies, x)
        ok = .not. allocated(maker%inverse%failure)
        if (.not. ok) return
        call to_nodes(maker%unknowns%map, x(:system%n_free), u)
        u = u + system%known
        passed = .false.
        do i = 1, points%n
          if (closed%presses(i) .or. .not. now%has(1, i)) cycle
          passed(i) = now%x(1, i) + dot_product(now%frame(:, 1, i), relative_motion(points, &
            now%placement%weights, i, u)) < 0.0_wp
        end do
        if (.not. any(passed)) exit
        closed%presses = closed%presses .or. passed
      end do
      set = settled
      ! Those that open have no part in it.
      system%rows = system%rows(pack([(i, i=1, size(system%rows))], set%presses( &
        system%rows%point)))
    end associate
  end subroutine settle_points

  !> The law of points with what bodies and motions give way by: Newton's method for it.
  subroutine solve_law(points, task, now, kept, moved, set, both, ok)
    type(contact_points_t), intent(in) :: points
    type(task_t), intent(in) :: task
    type(iterate_t), intent(in) :: now
    type(kept_t), intent(in) :: kept         !! where all its points stick; not factorised
    real(wp), intent(in) :: moved(:)         !! by all but points [length]
    type(set_t), intent(inout) :: set        !! where to begin; the end
    real(wp), allocatable, intent(out) :: both(:) !! changes of reactions; motions
    logical, intent(out) :: ok
    real(wp), allocatable :: s(:, :), q(:)
    real(wp) :: free(3, points%n)
    integer, allocatable :: pivot(:)
    logical :: presses(points%n), slides(points%n), sticks
    integer :: i, a, n, m, attempt

    associate (system => kept%maker%system)
      n = system%n_free
      m = size(system%b) - n
      ! r - rho x with what all but points move: y = free + dr - rho X du.
      q = system%b(n + 1:)
      call subtract_law(kept, moved, q)
      allocate (set%y(3, points%n), source=0.0_wp)
      free = 0.0_wp
      do i = 1, points%n
        do a = 1, 3
          if (system%row(a, i) == 0) cycle
          free(a, i) = now%reaction(a, i) - q(system%row(a, i) - n)
          set%y(a, i) = now%reaction(a, i) - system%b(system%row(a, i))
        end do
      end do
      sticks = set%sticks
      do attempt = 1, most_sets
        s = kept%schur
        both = [q, matmul(system%b(:n), kept%maker%motion)]
        do i = 1, points%n
          if (any(system%row(:, i) > 0)) call write_law(points%mu(i), now, kept, set, free(:, i), &
            i, s, both)
        end do
        call factorise_general(s, pivot, ok)
        if (.not. ok) return
        call solve_factorised(s, pivot, both)
        q = matmul(kept%schur(:m, :), both) + (1.0_wp + set%on_reactions)*both(:m)
        presses = .false.
        slides = .false.
        do i = 1, points%n
          if (.not. any(system%row(:, i) > 0)) cycle
          do a = 1, 3
            if (system%row(a, i) > 0) set%y(a, i) = free(a, i) + q(system%row(a, i) - n)
          end do
          associate (y => set%y(:, i))
            presses(i) = is_closed(task, now, i, y(1))
            slides(i) = presses(i) .and. (now%is_driven(i) .or. is_beyond(points%mu(i), now, i, y))
          end associate
          if (sticks) slides(i) = slides(i) .and. (now%is_driven(i) .or. .not. points%mu(i) > &
            0.0_wp)
        end do
        ok = all(presses .eqv. set%presses) .and. all(slides .eqv. set%slides)
        if (ok .and. .not. sticks) exit
        sticks = sticks .and. .not. ok
        set%presses = presses
        set%slides = slides
      end do
    end associate
  end subroutine solve_law

  !> The rows of one point in its branch of the law.
  subroutine write_law(mu, now, kept, set, free, i, s, both)
    real(wp), intent(in) :: mu               !! [-]
    type(iterate_t), intent(in) :: now
    type(kept_t), intent(in) :: kept         !! where all its points stick
    type(set_t), intent(in) :: set           !! its y is there
    real(wp), intent(in) :: free(3)          !! of y, without changes of reactions [force]
    integer, intent(in) :: i
    real(wp), intent(inout) :: s(:, :), both(:) !! matrix and right-hand side
    real(wp) :: by_r(3, 3), by_x(3, 3), off(3), p(3)
    integer :: a, b, row(3)

    associate (r => now%reaction(:, i))
      by_r = 0.0_wp
      do a = 1, 3
        by_r(a, a) = 1.0_wp
      end do
      by_x = 0.0_wp
      off = r
      if (set%presses(i) .and. now%is_driven(i)) then
        call derive_driven(mu, set%rho(i), now, i, by_r, by_x, off)
        off = off + matmul(by_x, r - free - set%rho(i)*now%x(:, i))
      else if (set%presses(i)) then
        call derive_law(mu, now, i, set%slides(i), set%y(:, i), by_x, p)
        by_r = by_r - by_x
        off = r - p + matmul(by_x, set%y(:, i) - free)
      end if
    end associate
    row = kept%maker%system%row(:, i) - kept%maker%system%n_free
    do a = 1, 3
      if (row(a) <= 0) cycle
      both(row(a)) = off(a)
      s(row(a), :) = 0.0_wp
      do b = 1, 3
        if (row(b) <= 0) cycle
        if (abs(by_x(a, b)) > 0.0_wp) s(row(a), :) = s(row(a), :) + by_x(a, b)* &
          kept%schur(row(b), :)
        s(row(a), row(b)) = s(row(a), row(b)) - by_r(a, b) + by_x(a, b)*set%on_reactions
      end do
      s(row(a), row(a)) = s(row(a), row(a)) - set%on_reactions
    end do
  end subroutine write_law

end module settle_points_mod
