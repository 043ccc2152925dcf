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
  real(wp), parameter :: least_part = 1.0_wp/32.0_wp
  !! of a step: parts down to 1/16 were taken in a bracket under a bolt head and led on [-]

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
      ! What turns of obstacles' normals make of reactions holds rigid motions, a pendulum's alone.
      system%is_whole = size(maker%motion, 2) > 0
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

  !> The law of points with what bodies and motions give way by: Newton's method for it. After the
  !> first step motions are in balance, and of each further step that part is taken
  !> which brings the points nearer to the law.
  subroutine solve_law(points, task, now, kept, moved, set, both, ok)
    type(contact_points_t), intent(in) :: points
    type(task_t), intent(in) :: task
    type(iterate_t), intent(in) :: now
    type(kept_t), intent(in) :: kept         !! where all its points stick; not factorised
    real(wp), intent(in) :: moved(:)         !! by all but points [length]
    type(set_t), intent(inout) :: set        !! where to begin; the end
    real(wp), allocatable, intent(out) :: both(:) !! changes of reactions; motions
    logical, intent(out) :: ok
    real(wp), allocatable :: s(:, :)
    real(wp), dimension(size(kept%maker%system%b) - kept%maker%system%n_free) :: q, q_way
    real(wp) :: way(size(kept%schur, 1)), free(3, points%n), off, off_next, part
    type(set_t) :: next
    logical :: sticks, acts(size(kept%schur, 1))
    integer :: i, a, n, m, attempt

    associate (system => kept%maker%system)
      n = system%n_free
      m = size(q)
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
      q = 0.0_wp
      allocate (both(size(kept%schur, 1)), source=0.0_wp)
      sticks = set%sticks
      do attempt = 1, most_sets
        way = [q, matmul(system%b(:n), kept%maker%motion)]
        call write_law(points, now, kept, set, free, s, way)
        acts = .true.
        do i = 1, points%n
          do a = 1, 3
            if (system%row(a, i) > 0) acts(system%row(a, i) - n) = set%presses(i)
          end do
        end do
        call solve_acting(s, acts, way, ok)
        if (.not. ok) return
        way = way - both
        q_way = matmul(kept%schur(:m, :), way) + (1.0_wp + set%on_reactions)*way(:m)
        part = 1.0_wp
        do
          call find_set(q + part*q_way, both + part*way, next, off_next)
          if (attempt == 1 .or. off_next < off .or. part <= least_part) exit
          if (all(next%presses .eqv. set%presses) .and. all(next%slides .eqv. set%slides)) exit
          part = 0.5_wp*part
        end do
        q = q + part*q_way
        both = both + part*way
        ok = .not. part < 1.0_wp .and. all(next%presses .eqv. set%presses) .and. &
          all(next%slides .eqv. set%slides)
        set = next
        off = off_next
        if (ok .and. .not. sticks) exit
        if (sticks .and. (ok .or. part < 1.0_wp)) then
          ! It is known well enough what presses.
          sticks = .false.
          call find_set(q, both, next, off)
          set = next
        end if
      end do
    end associate

  contains

    !> What points do at a place, and how far that is from their law.
    subroutine find_set(q, both, at, off)
      real(wp), intent(in) :: q(:), both(:)
      type(set_t), intent(out) :: at
      real(wp), intent(out) :: off         !! [force^2]
      real(wp) :: by_r(3, 3), by_x(3, 3), rest(3), dr(3), dq(3)
      integer :: i, a

      at = set
      at%presses = .false.
      at%slides = .false.
      off = 0.0_wp
      associate (row => kept%maker%system%row, n => kept%maker%system%n_free)
        do i = 1, points%n
          if (.not. any(row(:, i) > 0)) cycle
          dr = 0.0_wp
          dq = 0.0_wp
          do a = 1, 3
            if (row(a, i) == 0) cycle
            dr(a) = both(row(a, i) - n)
            dq(a) = q(row(a, i) - n)
          end do
          at%y(:, i) = free(:, i) + dq
          at%presses(i) = is_closed(task, now, i, at%y(1, i))
          at%slides(i) = at%presses(i) .and. (now%is_driven(i) .or. is_beyond(points%mu(i), now, &
            i, at%y(:, i)))
          if (sticks) at%slides(i) = at%slides(i) .and. (now%is_driven(i) .or. .not. &
            points%mu(i) > 0.0_wp)
          call find_branch(points%mu(i), now, at, free(:, i), i, by_r, by_x, rest)
          rest = matmul(by_x, dq - dr) - matmul(by_r, dr) - set%on_reactions*dr - rest
          off = off + sum(rest**2, mask=row(:, i) > 0)
        end do
      end associate
    end subroutine find_set

  end subroutine solve_law

  !> Solve where some rows have their diagonal alone: what does not press loses its reaction,
  !> whatever the others do.
  subroutine solve_acting(s, acts, both, ok)
    real(wp), intent(in) :: s(:, :)        !! (n,n)
    logical, intent(in) :: acts(:)         !! (n) false: of the row the diagonal alone is there
    real(wp), intent(inout) :: both(:)     !! (n) right-hand side in, solution out
    logical, intent(out) :: ok             !! regular
    real(wp), allocatable :: part(:, :), solution(:)
    integer, allocatable :: pivot(:)
    integer :: its(count(acts)), others(size(acts) - count(acts)), i

    its = pack([(i, i=1, size(acts))], acts)
    others = pack([(i, i=1, size(acts))], .not. acts)
    do i = 1, size(others)
      both(others(i)) = both(others(i))/s(others(i), others(i))
    end do
    allocate (part, source=s(its, its))
    allocate (solution, source=both(its) - matmul(s(its, others), both(others)))
    call factorise_general(part, pivot, ok)
    if (.not. ok) return
    call solve_factorised(part, pivot, solution)
    both(its) = solution
  end subroutine solve_acting

  !> The matrix and the right-hand side with each point in its branch of the law.
  subroutine write_law(points, now, kept, set, free, s, both)
    type(contact_points_t), intent(in) :: points
    type(iterate_t), intent(in) :: now
    type(kept_t), intent(in) :: kept         !! where all its points stick
    type(set_t), intent(in) :: set           !! its y is there
    real(wp), intent(in) :: free(:, :)       !! (3,n_points) y without changes of reactions [force]
    real(wp), allocatable, intent(out) :: s(:, :)
    real(wp), intent(inout) :: both(:)       !! those of points are set
    real(wp), dimension(3, 3, points%n) :: by_r, by_x
    real(wp) :: off(3)
    integer :: a, b, i, l, row(3, points%n)

    row = kept%maker%system%row - kept%maker%system%n_free
    do i = 1, points%n
      if (.not. any(row(:, i) > 0)) cycle
      call find_branch(points%mu(i), now, set, free(:, i), i, by_r(:, :, i), by_x(:, :, i), off)
      do a = 1, 3
        if (row(a, i) > 0) both(row(a, i)) = off(a)
      end do
    end do
    s = kept%schur
    do l = 1, size(s, 2)
      do i = 1, points%n
        do a = 1, 3
          if (row(a, i) <= 0) cycle
          s(row(a, i), l) = 0.0_wp
          do b = 1, 3
            if (row(b, i) > 0) s(row(a, i), l) = s(row(a, i), l) + by_x(a, b, i)* &
              kept%schur(row(b, i), l)
          end do
        end do
      end do
    end do
    do i = 1, points%n
      do a = 1, 3
        if (row(a, i) <= 0) cycle
        do b = 1, 3
          if (row(b, i) <= 0) cycle
          associate (of => s(row(a, i), row(b, i)))
            of = of - by_r(a, b, i) + by_x(a, b, i)*set%on_reactions
          end associate
        end do
        associate (of => s(row(a, i), row(a, i)))
          of = of - set%on_reactions
        end associate
      end do
    end do
  end subroutine write_law

  !> Derivatives of what a point is off the law by, of its reaction and of y, and what it is off by.
  pure subroutine find_branch(mu, now, set, free, i, by_r, by_x, off)
    real(wp), intent(in) :: mu               !! [-]
    type(iterate_t), intent(in) :: now
    type(set_t), intent(in) :: set           !! its y is there
    real(wp), intent(in) :: free(3)          !! of y, without changes of reactions [force]
    integer, intent(in) :: i                 !! point
    real(wp), intent(out) :: by_r(3, 3), by_x(3, 3), off(3) !! [-], [-], [force]
    real(wp) :: p(3)
    integer :: a

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
  end subroutine find_branch

end module settle_points_mod
