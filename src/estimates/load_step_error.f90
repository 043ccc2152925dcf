!> What the size of the increments does to the contact resultants.
!>
!> Beside the run goes a coarse one, in increments of twice the size. Friction makes both
!> first-order accurate in the increment, so their difference is the error of the finer one. Where a
!> *STEP has few increments, the run beside has halves of them instead, along the whole path: in the
!> first ones after contact or a reversal the error is not of first order yet, and increments twice
!> as large have about the same.
!>
!> Neither sees what lies between ends that increments of both sizes have: a kink of an amplitude,
!> or contact that begins. So where there is such an event the run beside ends at it, and goes from
!> one to the next in halves. Where they are too many to end at, nothing is said.
!>
!> Where nothing remembers the path, increments of any size end in the same place: there is no
!> error, and no run beside.
!> docs/theory.md section 10.
module load_step_error_mod
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t
  use controls_mod, only: accuracy_of_energy
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use mesh_forces_mod, only: force_rounding
  use bodies_mod, only: is_linear
  use interference_mod, only: extra_gap_at
  use step_contact_mod, only: changes_at, most_friction
  use state_mod, only: state_t
  use increment_report_mod, only: increment_report_t, has_converged, energy_t
  use increments_mod, only: next_increment, ends_step, smallest_increment, &
    whole_increment
  use follow_points_mod, only: rounding_of_places
  use placement_mod, only: placement_t, place_state
  use transfer_mod, only: relative_motion
  use step_solver_mod, only: step_solver_t
  use kinks_mod, only: has_too_many, most_touches
  use load_events_mod, only: next_event
  use load_response_mod, only: sum_patterns
  use trial_mod, only: goal_t, contact_alone, from_before, near_its_end
  use advance_mod, only: advance
  use closed_points_mod, only: may_stay_closed
  use path_balance_mod, only: work_left_over, largest_switch_energy
  implicit none
  private

  public :: coarse_run_t, start_coarse, follow_coarsely, try_increment, resultant_change, &
    begins_with_jump, have_switched

  real(wp), parameter :: doubtful = 0.1_wp
  !! of the strain energy: a balance of energy to look into [-]
  real(wp), parameter :: noise = 1.0e-6_wp
  !! of work and dissipation: what residuals of contact leave of them is less [-]
  real(wp), parameter :: halved = 0.75_wp
  !! of the energy left over: no more with half the increment, as an error of its size is, half of
  !! the first order and a quarter of the second [-]
  real(wp), parameter :: as_much = 0.9_wp
  !! the same with a quarter: what is lost where contact opens in a jump has been seen to leave 0.66
  integer, parameter :: few = 8
  !! increments of a *STEP: with fewer a run in doubles has been seen to tell 0.1 to 0.5 times the
  !! true error (7 of 14 decks of studies/data/scenes), with so many no less than 0.4 times
  real(wp), parameter :: sharp_enough = 1.0e-6_wp !! residual of what only an estimate needs [-]

  !> The run beside the run, in coarser increments or in halves.
  type :: coarse_run_t
    type(state_t) :: state
    integer :: n_behind = 0 !! increments that the run is ahead of it
    type(energy_t) :: energy !! of the run there
    real(wp) :: most_strained = 0.0_wp !! largest strain energy of the run from there on [energy]
  end type coarse_run_t

contains

  !> Where the run begins, or goes on after something that the coarse one cannot follow.
  subroutine start_coarse(state, coarse)
    type(state_t), intent(in) :: state
    type(coarse_run_t), intent(out) :: coarse

    coarse%state = state
  end subroutine start_coarse

  !> After an increment of the run, from `old` to `new`: let the run beside it catch up where it is
  !> due, and say how far apart they are.
  subroutine follow_coarsely(scene, points, solver, old, new, coarse, report)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(inout) :: solver
    type(state_t), intent(in) :: old, new
    type(coarse_run_t), intent(inout) :: coarse
    type(increment_report_t), intent(inout) :: report
    !! of the increment; gets errors%load_steps, negative where there is none
    type(state_t) :: middle, other, from_here
    integer :: n_run !! increments of the run that the coarse one has to catch up
    real(wp) :: left, left_beside !! energy left over along the path, of the run and beside it
    real(wp) :: least_doubtful !! energy left over that is to be looked into
    integer(i8) :: event !! the next that the coarse one comes to, its end where there is none
    logical :: ok, is_doubtful, in_halves, is_split

    report%errors%load_steps = 0.0_wp
    if (forgets_path(scene, points, solver)) then
      ! There is no other path to this place; a *STEP that remembers its own begins here.
      call begin_again()
      return
    end if
    report%errors%load_steps = -1.0_wp
    in_halves = minval(scene%steps%n_increments) < few
    coarse%n_behind = coarse%n_behind + 1
    coarse%most_strained = max(coarse%most_strained, report%energy%strain)
    if (coarse%n_behind < 2 .and. .not. ends_step(scene%steps, new)) return
    n_run = coarse%n_behind
    coarse%n_behind = 0
    if (has_too_many(solver%response%loads%kinks, scene%steps(new%step))) then
      call begin_again()
      return
    end if
    left_beside = 0.0_wp
    left = report%energy%balance - coarse%energy%balance
    least_doubtful = max(doubtful*report%energy%strain, doubtful*coarse%energy%strain, &
      noise*coarse%most_strained, noise*abs(report%energy%external_work), &
      noise*report%energy%dissipation, dot_product(force_rounding(scene%mesh, &
      solver%body%of_elements, new%displacement), norm2(new%displacement, dim=1)))
    is_doubtful = abs(left) > least_doubtful .and. is_linear(scene) .and. .not. &
      any(scene%obstacles%turns)
    coarse%most_strained = report%energy%strain
    coarse%energy = report%energy
    from_here = coarse%state
    is_split = in_halves
    event = new%position
    if (.not. is_split) event = event_before(scene, points, solver, coarse%state, event)
    is_split = is_split .or. event < new%position
    if (is_split) then
      call follow_events(n_run)
    else if (is_at(coarse%state, old)) then
      call follow_finely(2*n_run)
    else
      call try_increment(scene, points, solver, coarse%state, &
        new%position - beginning(coarse%state, new%step), other, ok, new)
      call add_left_over(coarse%state, other)
      if (ok) then
        report%errors%load_steps = change()
        if (is_doubtful .and. n_run > 1) is_doubtful = abs(left) > halved*abs(left_beside)
        coarse%state = other
      else
        call follow_finely(2*n_run)
      end if
    end if
    if (is_doubtful .and. from_here%step /= new%step) is_doubtful = .not. begins_with_jump(scene, &
      points, solver, from_here)
    if (is_doubtful) is_doubtful = .not. jumps_within(scene, points, solver, &
      beginning(from_here, new%step), new)
    if (is_doubtful) call look_closer()

  contains

    !> Take the run beside this one to where this one is.
    subroutine begin_again()
      call start_coarse(new, coarse)
      coarse%energy = report%energy
      coarse%most_strained = report%energy%strain
    end subroutine begin_again

    !> In increments of half the size, where those of twice the size lead nowhere.
    subroutine follow_finely(n_pieces)
      integer, intent(in) :: n_pieces
      integer(i8) :: start
      integer :: i

      other = coarse%state
      start = beginning(other, new%step)
      do i = 1, n_pieces
        middle = other
        call try_increment(scene, points, solver, middle, start + (i*(new%position - start))/ &
          n_pieces - beginning(middle, new%step), other, ok)
        if (.not. ok) exit
      end do
      if (ok) report%errors%load_steps = of_halves()*change()
      coarse%state = new
    end subroutine follow_finely

    !> Look whether the same in quarters of the increments leaves less over.
    subroutine look_closer()
      integer, parameter :: parts = 4
      type(state_t) :: kept, as_before
      integer(i8) :: ends(0:2), length
      real(wp) :: switched, allowed
      !! what is lost as points become ones by themselves, or are no more, and at most [energy]
      integer :: i, k

      left_beside = 0.0_wp
      switched = 0.0_wp
      allowed = 0.0_wp
      ends(0) = beginning(from_here, new%step)
      ends(1) = beginning(old, new%step)
      ends(n_run) = new%position
      other = from_here
      do i = 1, n_run
        do k = 1, parts
          length = ends(i - 1) + (ends(i) - ends(i - 1))*k/parts - beginning(other, new%step)
          call try_increment(scene, points, solver, other, length, middle, ok)
          if (.not. ok) return
          if (have_switched(other, middle)) then
            ! With the points as they were, and then at once, under the same loads.
            as_before = middle
            as_before%alone = other%alone
            call try_increment(scene, points, solver, other, length, kept, ok, as_before)
            if (.not. ok) return
            call add_left_over(other, kept)
            switched = switched + work_left_over(scene, points, solver%undeformed, &
              solver%first_gap, kept, middle)
            allowed = allowed + largest_switch_energy(scene, points, solver%undeformed, kept, &
              middle)
          else
            call add_left_over(other, middle)
          end if
          other = middle
        end do
      end do
      if (abs(switched) <= allowed) then
        left = left - switched
      else
        left_beside = left_beside + switched
      end if
      if (.not. abs(left) > least_doubtful) return
      ! More of it would be a path that the increments do not follow.
      if (abs(left_beside) > as_much*abs(left) .and. abs(left_beside) < abs(left)/as_much) then
        report%left_over = abs([left, left_beside])
      end if
    end subroutine look_closer

    !> Add what an increment beside the run leaves over, where that is asked for.
    subroutine add_left_over(from, to)
      type(state_t), intent(in) :: from, to

      if (ok .and. is_doubtful) left_beside = left_beside + work_left_over(scene, points, &
        solver%undeformed, solver%first_gap, from, to)
    end subroutine add_left_over

    !> In halves of increments, or of what is between two events.
    subroutine follow_events(n_run)
      integer, intent(in) :: n_run
      integer(i8) :: start, finish, behind
      integer :: n_pieces, most_pieces
      type(state_t) :: half_way

      ! A piece ends where an increment of the run does, at a kink or where contact begins.
      most_pieces = n_run + size(solver%response%loads%kinks) + most_touches( &
        solver%response%loads%kinks, scene%steps(new%step))
      behind = beginning(old, new%step)
      other = coarse%state
      ok = .false.
      pieces: do n_pieces = 1, most_pieces
        start = beginning(other, new%step)
        finish = new%position
        if (in_halves .and. start < behind) finish = behind
        if (in_halves .or. n_pieces > 1) event = event_before(scene, points, solver, other, finish)
        finish = event
        if (finish < new%position) then
          call try_increment(scene, points, solver, other, (finish - start)/2, middle, ok)
        else
          half_way = other
          half_way%displacement = 0.5_wp*(other%displacement + new%displacement)
          half_way%reaction = 0.5_wp*(other%reaction + new%reaction)
          call try_increment(scene, points, solver, other, (finish - start)/2, middle, ok, half_way)
        end if
        if (.not. ok) exit pieces
        call add_left_over(other, middle)
        if (finish < new%position) then
          call try_increment(scene, points, solver, middle, finish - middle%position, other, ok)
        else
          call try_increment(scene, points, solver, middle, finish - middle%position, other, ok, &
            new)
        end if
        call add_left_over(middle, other)
        if (.not. ok .or. finish == new%position) exit pieces
      end do pieces
      ok = ok .and. n_pieces <= most_pieces
      if (is_doubtful .and. ok) is_doubtful = abs(left_beside) > halved*abs(left)
      ! Where the run has ended at the events too, half the size leaves half of the error.
      if (ok) report%errors%load_steps = merge(of_halves(), 1.0_wp, n_pieces <= n_run)*change()
      if (.not. ok) other = new
      coarse%state = other
    end subroutine follow_events

    !> The error of an increment over what halves of it change: of first order, and squared in the
    !> energy of a difference.
    pure real(wp) function of_halves()
      of_halves = merge(4.0_wp, 2.0_wp, scene%accuracy%of == accuracy_of_energy)
    end function of_halves

    real(wp) function change()
      type(placement_t) :: placement

      if (scene%accuracy%of == accuracy_of_energy) then
        call place_state(scene, points, solver%undeformed, new, placement)
        change = energy_change(points, placement, other, new, report%energy%strain)
      else
        change = resultant_change(points, other%reaction, new%reaction, force_rounding( &
          scene%mesh, solver%body%of_elements, max(abs(old%displacement), abs(new%displacement))))
      end if
    end function change

  end subroutine follow_coarsely

  !> Whether a state follows from the loads at its end alone, wherever they came from: elastic
  !> bodies that supports hold, before flat obstacles without friction that they may part from, are
  !> where their energy is least.
  pure logical function forgets_path(scene, points, solver)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver

    forgets_path = is_linear(scene) .and. solver%body%motions%n == 0 .and. .not. &
      (any(most_friction(scene) > 0.0_wp) .or. any(points%is_curved) .or. may_stay_closed(scene))
  end function forgets_path

  !> Whether points in the middle of edges have become points by themselves, or are no more.
  pure logical function have_switched(from, to)
    type(state_t), intent(in) :: from, to

    have_switched = .false.
    if (allocated(from%alone) .and. allocated(to%alone)) have_switched = any(from%alone .neqv. &
      to%alone)
  end function have_switched

  !> Whether the coarse run is where the run is: where it began anew there.
  pure logical function is_at(state, of_run)
    type(state_t), intent(in) :: state, of_run

    is_at = state%step == of_run%step .and. state%position == of_run%position
    if (is_at) is_at = .not. any(abs(state%reaction - of_run%reaction) > 0.0_wp)
  end function is_at

  !> Whether loads or supports jump as a *STEP begins, or overlaps are removed there: no increment
  !> is small enough for their work.
  logical function begins_with_jump(scene, points, solver, state) result(jumps)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    type(state_t), intent(in) :: state  !! at the end of the *STEP before
    real(wp), allocatable :: u(:, :), force(:, :)
    real(wp), parameter :: continuous = 1.0e-9_wp !! of the largest: a difference that is none [-]

    call sum_patterns(scene, solver%response, 0.0_wp, 0.0_wp, u, force)
    associate (prescribed => solver%body%prescribed, support => state%support_force)
      jumps = maxval(abs(force - state%external_force)) > continuous*max(maxval(abs(force)), &
        maxval(abs(state%external_force))) .or. maxval(abs(u - state%displacement), &
        mask=prescribed) > continuous*max(maxval(abs(u)), maxval(abs(state%displacement))) .or. &
        maxval(abs(support), mask=.not. prescribed) > continuous*maxval(abs(support))
    end associate
    associate (rounding => rounding_of_places(scene, state%displacement))
      if (state%increments_done == 0) then
        jumps = jumps .or. any(solver%first_gap < -rounding)
      else
        jumps = jumps .or. changes_at(scene, state%step + 1) .or. any(abs(extra_gap_at(scene, &
          points, state%step + 1, 0_i8) - extra_gap_at(scene, points, state%step, &
          state%position)) > rounding)
      end if
    end associate
  end function begins_with_jump

  !> Whether loads, supports or what may overlap go more than half of their way in one of 16 parts
  !> of the time between two places of a *STEP: a jump, which smaller increments do not divide.
  logical function jumps_within(scene, points, solver, start, to) result(jumps)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    integer(i8), intent(in) :: start   !! in parts of the deck's increments
    type(state_t), intent(in) :: to
    integer, parameter :: parts = 16
    real(wp), parameter :: rounded = 1.0e-9_wp !! of the largest: a difference that is none [-]
    real(wp), dimension(:, :), allocatable :: u, force, u_before, force_before
    real(wp), dimension(points%n) :: gap, gap_before
    real(wp), dimension(3) :: way, longest, whole
    integer :: k

    whole = 0.0_wp
    longest = 0.0_wp
    call be_at(0, u_before, force_before, gap_before)
    do k = 1, parts
      call be_at(k, u, force, gap)
      way = [maxval(abs(u - u_before), mask=solver%body%prescribed), maxval(abs(force - &
        force_before)), maxval([abs(gap - gap_before), 0.0_wp])]
      where (way <= rounded*[maxval(abs(u)), maxval(abs(force)), maxval([abs(gap), 0.0_wp])]) &
        way = 0.0_wp
      whole = whole + way
      longest = max(longest, way)
      u_before = u
      force_before = force
      gap_before = gap
    end do
    jumps = any(longest > 0.5_wp*whole)

  contains

    subroutine be_at(part, u, force, gap)
      integer, intent(in) :: part
      real(wp), allocatable, intent(out) :: u(:, :), force(:, :)
      real(wp), intent(out) :: gap(:)
      real(wp) :: fraction
      integer(i8) :: position

      position = start + (part*(to%position - start))/parts
      associate (step => scene%steps(to%step))
        fraction = real(position, wp)/(real(step%n_increments, wp)*real(whole_increment, wp))
        call sum_patterns(scene, solver%response, fraction, fraction*step%period, u, force)
      end associate
      gap = extra_gap_at(scene, points, to%step, position)
    end subroutine be_at

  end function jumps_within

  !> The next event behind a state, or `finish` where there is none before it.
  integer(i8) function event_before(scene, points, solver, state, finish) result(event)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    type(state_t), intent(in) :: state
    integer(i8), intent(in) :: finish !! in parts of the deck's increments
    logical :: is_touch

    call next_event(scene, points, solver, state, next_increment(scene%steps, state), &
      event, is_touch)
    if (event > finish - smallest_increment) event = finish
  end function event_before

  !> Where a state is in a step that it has just entered, or is in.
  pure integer(i8) function beginning(state, step)
    type(state_t), intent(in) :: state
    integer, intent(in) :: step

    beginning = 0
    if (state%step == step) beginning = state%position
  end function beginning

  !> An increment that only an estimate needs, as far as its contact goes.
  subroutine try_increment(scene, points, solver, from, length, to, ok, near)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(inout) :: solver
    type(state_t), intent(in) :: from
    integer(i8), intent(in) :: length  !! in parts of the deck's increments
    type(state_t), intent(out) :: to   !! reactions and what contact sees of the displacement
    logical, intent(out) :: ok         !! it was solved
    type(state_t), intent(in), optional :: near !! to where it ends: reactions, and which are alone
    type(increment_report_t) :: report
    type(error_t), allocatable :: error

    if (present(near)) to = near
    call advance(scene, points, solver, from, goal_t(next_increment(scene%steps, from, length), &
      solver%choices%tolerance, sharp_enough, wanted=contact_alone, &
      start=merge(near_its_end, from_before, present(near))), to, report, error)
    ok = .not. allocated(error)
    if (ok) ok = has_converged(report)
  end subroutine try_increment

  !> The energy of the difference of two states under the same loads, beside that of the bodies:
  !> what their reactions' difference does on their motions' difference.
  pure function energy_change(points, placement, one, other, strain) result(change)
    type(contact_points_t), intent(in) :: points
    type(placement_t), intent(in) :: placement !! of either
    type(state_t), intent(in) :: one, other
    real(wp), intent(in) :: strain !! energy of the bodies [energy]
    real(wp) :: change             !! 0 where there is no energy [-]
    integer :: i

    change = 0.0_wp
    do i = 1, points%n
      change = change + 0.5_wp*dot_product(one%reaction(:, i) - other%reaction(:, i), &
        relative_motion(points, placement%weights, i, one%displacement) - &
        relative_motion(points, placement%weights, i, other%displacement))
    end do
    change = abs(change)
    if (strain > 0.0_wp) change = change/strain
  end function energy_change

  !> The largest change of a pair's resultant, beside the largest resultant.
  pure function resultant_change(points, one, other, rounding) result(change)
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: one(:, :), other(:, :) !! (3,n_points) reactions in x, y, z [force]
    real(wp), intent(in), optional :: rounding(:)  !! (n_nodes) of nodal forces [force]
    real(wp) :: change                             !! 0 where there are no forces but rounding [-]
    real(wp) :: largest, of_slaves
    integer :: i

    change = 0.0_wp
    largest = 0.0_wp
    of_slaves = 0.0_wp
    do i = 1, size(points%first) - 1
      associate (a => points%first(i), b => points%first(i + 1) - 1)
        change = max(change, norm2(sum(one(:, a:b) - other(:, a:b), dim=2)))
        largest = max(largest, norm2(sum(one(:, a:b), dim=2)), norm2(sum(other(:, a:b), dim=2)))
        if (present(rounding)) of_slaves = max(of_slaves, sum(rounding(points%node(a:b))))
      end associate
    end do
    if (largest > 0.0_wp) change = change/largest
    if (largest <= of_slaves) change = 0.0_wp
  end function resultant_change

end module load_step_error_mod
