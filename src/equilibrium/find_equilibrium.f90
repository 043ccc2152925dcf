!> The equilibrium of an increment: displacements and reactions by one semismooth Newton method on
!> the sparse equations of the bodies. docs/theory.md section 4, "Displacements and reactions
!> together".
module find_equilibrium_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t, exit_not_solved
  use linearisation_mod, only: linearisation_t
  use scene_mod, only: scene_t
  use state_mod, only: state_t
  use contact_points_mod, only: contact_points_t
  use increment_report_mod, only: increment_report_t, ending_t, not_ended, ended_well, &
    ended_inverted, &
    ended_out_of_balance, ended_unbalanced
  use placement_mod, only: join_ends
  use follow_points_mod, only: rounding_of_places
  use iterate_mod, only: task_t, iterate_t, look_at, world_reactions, local_reactions, &
    set_reactions, is_closed, is_beyond, law_error, outside_of_cone
  use linearise_mod, only: find_scales, set_t, step_t
  use kept_factor_mod, only: step_maker_t, begin_steps
  use make_step_mod, only: prepare_step, make_step
  use loose_bodies_mod, only: loose_t, begin_loose, note_pressed, stay_unseen, is_held_back, &
    follow_loose
  implicit none
  private

  public :: find_equilibrium

  integer, parameter :: most_iterations = 40
  integer, parameter :: most_sticking = 6  !! iterations in which all that presses sticks
  real(wp), parameter :: least_part = 1.0_wp/16.0_wp
  real(wp), parameter :: of_stiffness = 0.1_wp
  !! penalty of the law, of the nodes' own stiffness: less of what is stiff presses where it should
  !! not, more of what is soft lets go [-]
  ! How much nothing is held back by, where all is out of balance [-]
  real(wp), parameter :: on_bodies = 1.0e-4_wp, on_reactions = 1.0e-2_wp
  real(wp), parameter :: least_on_reactions = 1.0e-8_wp !! where all is in balance [-]
  real(wp), parameter :: most_caution = 1.0e4_wp !! times that [-]
  real(wp), parameter :: slides_on = 1.0e-3_wp !! of the limit of friction [-]
  integer, parameter :: most_stalled = 5
  !! iterations that do not halve the error: points alternate between states. Of 36 rings of rubber
  !! 33, 34, 35 and 35 were solved with 3, 4, 5 and 8 [-]
  integer, parameter :: most_idle = 5      !! of the least steps, one after the other

  !> What the iterations leave to each other.
  type :: search_t
    real(wp) :: caution = 1.0_wp            !! how much more than usual is held back [-]
    integer :: sticking = 0                 !! iterations left in which all sticks
    real(wp) :: least = huge(1.0_wp)        !! error so far [-]
    integer :: stalled = 0                  !! iterations that have not halved it
    integer :: idle = 0                     !! steps in a row that were the least
    logical :: has_turned = .false.         !! a point sticks as it has turned back
    logical, allocatable :: pressed(:)      !! (n_points) in the one before
    real(wp), allocatable :: friction(:, :)
    !! (2,n_points) predicted there of what slid, 0 of others [force]
    type(loose_t) :: loose
  end type search_t

contains

  !> Bring the bodies and their contact into balance.
  subroutine find_equilibrium(scene, points, task, body, new, found, report, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(task_t), intent(in) :: task
    type(linearisation_t), intent(in) :: body !! its factor leads, as far as it goes
    type(state_t), intent(inout) :: new
    !! where to start from, in displacement, modes and reaction; the end
    type(iterate_t), intent(out) :: found    !! that end
    type(increment_report_t), intent(inout) :: report
    type(error_t), allocatable, intent(out) :: error !! no memory
    type(iterate_t) :: now, next
    type(step_maker_t) :: maker
    type(set_t) :: set
    type(search_t) :: search
    type(step_t) :: step
    real(wp) :: part, error_now, way
    logical :: has_joined, arrives
    logical, dimension(0:scene%mesh%n_bodies) :: is_held, is_loose
    integer :: i

    call look_from(scene, points, task, new, now)
    report%ending = ending_t(not_ended)
    search = begin_search(points, now, scene%mesh%n_bodies)
    call begin_steps(scene, task, now, body, maker)
    iterations: do i = 1, most_iterations
      call prepare_step(scene, task, now, maker)
      set%rho = of_stiffness*find_scales(points, maker%diagonal, now)
      way = how_far(task, now)
      error_now = max(now%imbalance, worst_of_law(scene, points, task, set%rho, now))
      if (i == 1) error_now = 1.0_wp
      call watch_error(error_now, search)
      report%residual = error_now
      if (i > 1 .and. .not. way > 0.0_wp .and. max(now%imbalance, worst_of_law(scene, points, &
        task, set%rho/of_stiffness, now)) <= task%tolerance) then
        has_joined = .false.
        if (allocated(now%placement%weights%alone)) call join_ends(points, world_reactions(now), &
          now%placement%weights%alone, has_joined)
        if (.not. has_joined) then
          report%ending = ending_t(ended_well)
          exit iterations
        end if
        new%alone = now%placement%weights%alone
        call again(now)
        cycle iterations
      end if
      call choose_set(scene, points, task, now, error_now, i == 1, search, set)
      set%sticks = i == 1 .and. search%sticking > 0
      call make_step(scene, points, task, now, set, maker, step, error)
      if (allocated(set%y)) then
        ! The law has been solved in it.
        search%sticking = 0
        search%has_turned = .false.
        search%friction = merge(set%y(2:, :), 0.0_wp, spread(set%slides, 1, 2))
        search%pressed = set%presses
        call note_pressed(scene, points, now, set, search%loose)
      end if
      report%newton_raphson_iterations = report%newton_raphson_iterations + 1
      report%contact_iterations = report%contact_iterations + 1
      if (allocated(error)) then
        if (error%exit_status /= exit_not_solved) return
        deallocate (error)
        if (search%caution >= most_caution) exit iterations
        search%caution = min(most_caution, 100.0_wp*search%caution)
        cycle iterations
      end if
      call stay_unseen(scene, points, task, now, maker%system%rows, body%motions, step)
      if (.not. way > 0.0_wp) then
        is_held = task%is_free .and. is_held_back(scene, points, now, maker%unknowns%map, &
          maker%held, step)
        call follow_loose(scene, points, now, set, step, is_held, search%loose, is_loose)
        if (any(is_loose)) then
          report%ending = ending_t(ended_unbalanced)
          now%falls = merge(step%u, 0.0_wp, spread(is_loose(scene%mesh%body), 1, 3))
          exit iterations
        end if
        if (any(search%loose%lands)) cycle iterations
      end if

      ! The first of 1, 1/2, 1/4, ... that takes it nearer.
      part = 1.0_wp
      arrives = way > 0.0_wp .or. search%sticking > 0 .or. search%has_turned .or. set%lands
      do
        call look_at(scene, points, task, now, moved(task, now, step%u, part), now%reaction + &
          part*step%r, next)
        report%force_evaluations = report%force_evaluations + 1
        if (next%inverted == 0) then
          if (arrives .or. part <= least_part) exit
          if (.not. maker%led .and. is_same(points, task, now, next, set)) exit
          if (merit(scene, points, task, now%scale, set%rho, next) < merit(scene, points, task, &
            now%scale, set%rho, now)) exit
        else if (part < 0.01_wp) then
          report%ending = ending_t(ended_inverted, element=next%inverted)
          exit iterations
        end if
        if (maker%led) then
          ! What is not taken whole the matrix of now may make better; so it will the next ones.
          maker%leads = .false.
          cycle iterations
        end if
        part = 0.5_wp*part
      end do
      if (part <= 0.25_wp) search%caution = min(most_caution, 10.0_wp*search%caution)
      if (part >= 1.0_wp .and. search%stalled < most_stalled) search%caution = max(1.0_wp, &
        0.1_wp*search%caution)
      now = next
      search%idle = merge(search%idle + 1, 0, part <= least_part .and. .not. arrives)
      if (search%idle == most_idle) exit iterations
    end do iterations
    if (report%ending%cause == not_ended) report%ending = ending_t(ended_out_of_balance, &
      report%residual)
    report%products = report%products + maker%products
    report%tangents = report%tangents + maker%n_factors
    report%imbalance = now%imbalance
    new%displacement = now%u
    new%modes = now%modes
    ! What does not press has no reaction, down to the last bit.
    call release_points(task, points, set%rho, now)
    new%reaction = world_reactions(now)
    found = now

  contains

    !> Look at the same place once more, with points that have changed.
    subroutine again(now)
      type(iterate_t), intent(inout) :: now

      call look_at(scene, points, task, now, now%u, now%reaction, next)
      now = next
    end subroutine again

  end subroutine find_equilibrium

  !> The place that an increment is sought from: that of `new`, or where the increment begins if an
  !> element would be inside out there.
  subroutine look_from(scene, points, task, new, now)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(task_t), intent(in) :: task
    type(state_t), intent(in) :: new
    type(iterate_t), intent(out) :: now
    type(iterate_t) :: start
    real(wp) :: none(3, points%n)

    start%modes = new%modes
    start%placement = task%began
    none = 0.0_wp
    call look_at(scene, points, task, start, new%displacement, none, now)
    if (now%inverted > 0) call look_at(scene, points, task, start, task%old%displacement, none, now)
    call set_reactions(scene, points, task, local_reactions(now, new%reaction), now)
  end subroutine look_from

  type(search_t) function begin_search(points, now, n_bodies) result(search)
    type(contact_points_t), intent(in) :: points
    type(iterate_t), intent(in) :: now
    integer, intent(in) :: n_bodies

    allocate (search%pressed(points%n), source=.false.)
    search%loose = begin_loose(points%n, size(now%u, 2), n_bodies)
    allocate (search%friction(2, points%n), source=0.0_wp)
    if (.not. any(abs(now%reaction) > 0.0_wp)) search%sticking = most_sticking
  end function begin_search

  !> More is held back where the error does not fall: steps that points limit may come round.
  pure subroutine watch_error(error_now, search)
    real(wp), intent(in) :: error_now        !! [-]
    type(search_t), intent(inout) :: search

    search%stalled = search%stalled + 1
    if (error_now < 0.5_wp*search%least) then
      search%least = error_now
      search%stalled = 0
    else if (mod(search%stalled, most_stalled) == 0) then
      search%caution = min(most_caution, 10.0_wp*search%caution)
    end if
  end subroutine watch_error

  !> How far what is prescribed is from its end.
  pure real(wp) function how_far(task, now)
    type(task_t), intent(in) :: task
    type(iterate_t), intent(in) :: now

    how_far = maxval(abs(task%forces%displacement - now%u), mask=task%forces%prescribed)
    how_far = max(0.0_wp, how_far)
  end function how_far

  !> A part of the step from a place; the whole of it arrives at what is prescribed to the last bit.
  pure function moved(task, now, du, step) result(u)
    type(task_t), intent(in) :: task
    type(iterate_t), intent(in) :: now
    real(wp), intent(in) :: du(:, :)         !! (3,n_nodes) [length]
    real(wp), intent(in) :: step             !! [-]
    real(wp) :: u(3, size(du, 2))            !! [length]

    u = now%u + step*du
    if (step >= 1.0_wp) then
      where (task%forces%prescribed) u = task%forces%displacement
    end if
  end function moved

  !> What the points' reactions are off the law by.
  pure function law_errors(points, task, rho, now) result(z)
    type(contact_points_t), intent(in) :: points
    type(task_t), intent(in) :: task
    real(wp), intent(in) :: rho(:)           !! (n_points) [force/length]
    type(iterate_t), intent(in) :: now
    real(wp) :: z(3, points%n)               !! [force]
    integer :: i

    do i = 1, points%n
      z(:, i) = law_error(points%mu(i), task%stays(i), rho(i), now, i)
    end do
  end function law_errors

  !> The worst of these beside the forces of its body.
  pure real(wp) function worst_of_law(scene, points, task, rho, now) result(worst)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(task_t), intent(in) :: task
    real(wp), intent(in) :: rho(:)           !! (n_points) that they are of [force/length]
    type(iterate_t), intent(in) :: now
    real(wp) :: rounding, z(3, points%n)
    integer :: i

    worst = 0.0_wp
    z = law_errors(points, task, rho, now)
    rounding = rounding_of_places(scene, now%u)
    do i = 1, points%n
      ! Places are rounded, reactions are not.
      worst = max(worst, max(norm2(z(:, i)) - rho(i)*rounding, outside_of_cone(points%mu(i), &
        task%stays(i), now, i))/now%scale(scene%mesh%body(points%node(i))))
    end do
  end function worst_of_law

  !> How far all is from balance and law, in parts of the forces of each body.
  pure real(wp) function merit(scene, points, task, scale, rho, now)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(task_t), intent(in) :: task
    real(wp), intent(in) :: scale(0:)        !! (0:n_bodies) [force]
    real(wp), intent(in) :: rho(:)           !! (n_points) [force/length]
    type(iterate_t), intent(in) :: now
    real(wp) :: z(3, points%n)
    integer :: i

    z = law_errors(points, task, rho, now)
    merit = 0.0_wp
    do i = 1, size(now%u, 2)
      merit = merit + sum((now%residual(:, i)/scale(scene%mesh%body(i)))**2)
    end do
    do i = 1, points%n
      merit = merit + sum((z(:, i)/scale(scene%mesh%body(points%node(i))))**2)
    end do
  end function merit

  !> Whether the points do at a place what they were taken to do: between such places all is smooth,
  !> and forces that rise for a step, as those along a slender body that bends, fall with the next.
  pure logical function is_same(points, task, now, next, set)
    type(contact_points_t), intent(in) :: points
    type(task_t), intent(in) :: task
    type(iterate_t), intent(in) :: now, next
    type(set_t), intent(in) :: set           !! of the former
    real(wp) :: y(3), friction(2)
    integer :: i

    is_same = .true.
    do i = 1, points%n
      y = prediction(set%rho(i), next, i)
      is_same = is_same .and. (is_closed(task, next, i, y(1)) .eqv. set%presses(i))
      if (.not. set%presses(i) .or. next%is_driven(i)) cycle
      is_same = is_same .and. (is_beyond(points%mu(i), next, i, y) .eqv. set%slides(i))
      if (.not. set%slides(i)) cycle
      ! What slides does not turn back.
      friction = y(2:)
      y = prediction(set%rho(i), now, i)
      is_same = is_same .and. .not. dot_product(friction, y(2:)) < 0.0_wp
    end do
  end function is_same

  !> What says what a point does: r - rho x.
  pure function prediction(rho, now, i) result(y)
    real(wp), intent(in) :: rho        !! [force/length]
    type(iterate_t), intent(in) :: now
    integer, intent(in) :: i
    real(wp) :: y(3)                   !! [force]

    y = merge(now%reaction(:, i) - rho*now%x(:, i), 0.0_wp, now%has(:, i))
  end function prediction

  !> What the points do in the next step: by r - rho x; without reactions to begin with by gaps, and
  !> all of them stick until those that press repeat.
  subroutine choose_set(scene, points, task, now, error_now, is_first, search, set)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(task_t), intent(in) :: task
    type(iterate_t), intent(in) :: now
    real(wp), intent(in) :: error_now        !! [-]
    logical, intent(in) :: is_first
    type(search_t), intent(inout) :: search
    type(set_t), intent(inout) :: set        !! its rho is there
    real(wp) :: y(3)
    real(wp) :: touching !! gap that counts as none [length]
    integer :: i

    if (allocated(set%y)) deallocate (set%y)
    set%presses = [(.false., i=1, points%n)]
    set%slides = set%presses
    search%has_turned = .false.
    touching = rounding_of_places(scene, now%u)
    do i = 1, points%n
      if (.not. now%has(1, i)) cycle
      y = prediction(set%rho(i), now, i)
      set%presses(i) = is_closed(task, now, i, y(1))
      if (is_first .and. search%sticking > 0) set%presses(i) = task%stays(i) .or. now%x(1, i) <= &
        touching
      set%presses(i) = set%presses(i) .or. search%loose%lands(i)
      ! What slid in the increment before is at the limit but for rounding, and slides on.
      set%slides(i) = set%presses(i) .and. (now%is_driven(i) .or. is_beyond(points%mu(i)* &
        merge(1.0_wp - slides_on, 1.0_wp, is_first), now, i, y))
      ! What turns back has stuck on the way.
      if (.not. now%is_driven(i) .and. dot_product(y(2:), search%friction(:, i)) < 0.0_wp) then
        search%has_turned = search%has_turned .or. set%slides(i)
        set%slides(i) = .false.
      end if
      search%friction(:, i) = merge(y(2:), 0.0_wp, set%slides(i) .and. points%mu(i) > 0.0_wp)
    end do
    call note_pressed(scene, points, now, set, search%loose)
    set%lands = any(search%loose%lands)
    search%loose%lands = .false.
    if (search%sticking > 0) then
      search%sticking = search%sticking - 1
      if (all(set%presses .eqv. search%pressed) .and. .not. is_first) search%sticking = 0
      if (search%sticking > 0) set%slides = set%slides .and. (now%is_driven .or. .not. points%mu > &
        0.0_wp)
    end if
    search%pressed = set%presses
    set%on_bodies = on_bodies*min(1.0_wp, error_now)*search%caution
    set%error = error_now
    set%on_reactions = max(least_on_reactions, on_reactions*min(1.0_wp, search%caution*error_now))
  end subroutine choose_set

  !> Take the last bits of reactions from points that do not press.
  pure subroutine release_points(task, points, rho, now)
    type(task_t), intent(in) :: task
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: rho(:)           !! (n_points) [force/length]
    type(iterate_t), intent(inout) :: now
    integer :: i

    do i = 1, points%n
      associate (r => now%reaction(:, i))
        if (.not. is_closed(task, now, i, r(1) - rho(i)*now%x(1, i))) r = 0.0_wp
      end associate
    end do
  end subroutine release_points

end module find_equilibrium_mod
