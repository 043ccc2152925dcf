!> Events on the load path of a *STEP, where increments end that the deck lets be cut: the kinks of
!> its amplitudes, and the instant at which contact begins where nothing pressed before.
!>
!> Without contact the displacement is linear in the fraction of the step from one kink to the next,
!> so the instant at which the first point meets its obstacle costs no solution. As soon as anything
!> presses this is no longer so, and what touches later is no event. docs/theory.md section 1.
module load_events_mod
  use kinds_mod, only: wp, i8
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t
  use increments_mod, only: increment_t, whole_increment, smallest_increment
  use kinks_mod, only: has_too_many, most_touches
  use loads_mod, only: load_step_t
  use load_response_mod, only: sum_patterns
  use turns_mod, only: rotation_at
  use interference_mod, only: has_interference, extra_gap_at
  use step_solver_mod, only: step_solver_t
  use placement_mod, only: placement_t, place_all, place_curved, place_state
  use closed_points_mod, only: stay_closed
  use transfer_mod, only: movable, rows_of_points
  implicit none
  private

  public :: no_event, first_touch, next_event

  integer(i8), parameter :: no_event = 2_i8**53 - 1 !! behind every step's end
  integer, parameter :: n_samples = 16 !! of the way before round obstacles
  integer, parameter :: n_halvings = 40

  !> A place on the load path of a *STEP, without contact.
  type :: on_path_t
    real(wp), allocatable :: u(:, :)       !! (3,n_nodes) [length]
    real(wp), allocatable :: turn(:, :)    !! (3,n_obstacles) [rad]
    real(wp), allocatable :: extra_gap(:)  !! (n_points) [length]
  end type on_path_t

contains

  !> The next kink behind `start` at which increments end; no_event where there is none, or are too
  !> many.
  pure integer(i8) function next_kink(solver, step, start) result(kink)
    type(step_solver_t), intent(in) :: solver !! prepared for the step
    type(load_step_t), intent(in) :: step
    integer(i8), intent(in) :: start           !! in parts of the deck's increments
    integer :: i

    kink = no_event
    associate (kinks => solver%response%loads%kinks)
      if (has_too_many(kinks, step)) return
      i = count(kinks < start + smallest_increment) + 1
      if (i <= size(kinks)) kink = kinks(i)
    end associate
  end function next_kink

  !> The next event behind the place of a state in a step.
  subroutine next_event(scene, points, solver, state, increment, event, is_touch, n_touches)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver  !! prepared for the step
    type(state_t), intent(in) :: state
    type(increment_t), intent(in) :: increment  !! that follows the state
    integer(i8), intent(out) :: event           !! no_event: none to the end of the step
    logical, intent(out) :: is_touch
    integer, intent(in), optional :: n_touches
    !! instants at which contact began in the step so far, one from each kink to the next counts;
    !! left out by an estimate
    integer(i8) :: touch

    associate (step => scene%steps(increment%step), start => increment%start)
      event = no_event
      is_touch = .false.
      if (solver%response%loads%n_patterns == 0 .and. .not. any(scene%obstacles%turns) &
        .and. .not. has_interference(scene)) return
      ! else nothing moves
      event = next_kink(solver, step, start)
      if (present(n_touches)) then
        if (n_touches >= most_touches(solver%response%loads%kinks, step)) return
      end if
      touch = first_touch(scene, points, solver, state, increment%step, start, &
        min(event, step%n_increments*whole_increment))
      is_touch = touch < event
      event = min(event, touch)
    end associate
  end subroutine next_event

  !> Where, from `start` to `finish` of a step, the first point meets its obstacle if nothing
  !> presses at the start; no_event where none does, or so near to where an increment ends anyway
  !> that one more would be shorter than the smallest.
  integer(i8) function first_touch(scene, points, solver, state, step, start, finish) &
    result(touch)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver  !! prepared for the step
    type(state_t), intent(in) :: state          !! at `start`
    integer, intent(in) :: step
    integer(i8), intent(in) :: start, finish    !! in parts of the deck's increments
    integer(i8) :: here, there, from_end
    integer, allocatable :: can_press(:)
    type(on_path_t) :: at_here, at_there
    real(wp) :: fraction
    integer :: i

    touch = no_event
    if (solver%body%motions%n > 0) return
    if (any(abs(state%reaction) > 0.0_wp) .or. finish <= start) return
    if (any(stay_closed(scene, points, solver%undeformed, state))) return
    can_press = points_that_can_press(scene, points, solver, state)
    if (size(can_press) == 0) return
    here = start
    at_here = on_path(here)
    i = 0
    stretches: do while (here < finish)
      there = finish
      do while (i < size(solver%response%loads%kinks))
        i = i + 1
        if (solver%response%loads%kinks(i) <= here) cycle
        there = min(finish, solver%response%loads%kinks(i))
        exit
      end do
      at_there = on_path(there)
      fraction = fraction_to_touch(scene, points, can_press, at_here, at_there, merge( &
        real(smallest_increment, wp)/real(there - here, wp), 0.0_wp, here == start))
      if (fraction <= 1.0_wp) then
        ! Just before it: what is closed then has no gap to speak of.
        touch = here + int(fraction*real(there - here, wp), i8)
        exit stretches
      end if
      here = there
      at_here = at_there
    end do stretches
    if (touch == no_event) return
    from_end = modulo(touch, whole_increment)
    if (touch - start < smallest_increment .or. finish - touch < smallest_increment .or. &
      from_end < smallest_increment .or. whole_increment - from_end < smallest_increment) then
      touch = no_event
    end if

  contains

    type(on_path_t) function on_path(position) result(at)
      integer(i8), intent(in) :: position
      real(wp), allocatable :: external(:, :)
      real(wp) :: of_step

      associate (of => scene%steps(step))
        of_step = real(position, wp)/(real(of%n_increments, wp)*real(whole_increment, wp))
        call sum_patterns(scene, solver%response, of_step, of_step*of%period, at%u, external)
        at%turn = rotation_at(scene, solver%response%loads%turns, of_step, of_step*of%period)
        at%extra_gap = extra_gap_at(scene, points, step, position)
      end associate
    end function on_path

  end function first_touch

  !> The points that would have a reaction where a state has them.
  pure function points_that_can_press(scene, points, solver, state) result(list)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    type(state_t), intent(in) :: state
    integer, allocatable :: list(:)
    type(placement_t) :: placement
    integer :: row(3, points%n), i

    call place_state(scene, points, solver%undeformed, state, placement)
    call rows_of_points(movable(scene, solver%body%prescribed), points, placement%weights, &
      placement%frame, row)
    list = pack([(i, i=1, points%n)], row(1, :) > 0)
  end function points_that_can_press

  !> The fraction of the straight way between two places on the load path at which the first point
  !> that can press enters its obstacle; 2 where none does.
  real(wp) function fraction_to_touch(scene, points, can_press, from, to, least) result(fraction)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: can_press(:)                 !! points
    type(on_path_t), intent(in) :: from, to
    real(wp), intent(in) :: least !! fraction below which it does not matter: 0 is told there
    type(contact_points_t) :: moving !! with the extra gaps of a place
    type(placement_t) :: at_here, at_there, between
    real(wp) :: before, after, gap_before, gap_after
    integer :: k

    fraction = 2.0_wp
    moving = points
    moving%extra_gap = from%extra_gap
    call place_all(scene, moving, from%u, at_here, from%turn)
    moving%extra_gap = to%extra_gap
    call place_all(scene, moving, to%u, at_there, to%turn)
    do k = 1, size(can_press)
      if (points%is_curved(can_press(k))) cycle
      associate (here => max(0.0_wp, at_here%gap(can_press(k))), &
                 there => at_there%gap(can_press(k)))
        if (there >= 0.0_wp) cycle
        fraction = min(fraction, here/(here - there))
      end associate
    end do
    if (.not. any(points%is_curved(can_press))) return
    between = at_here
    before = 0.0_wp
    gap_before = 0.0_wp
    if (least > 0.0_wp .and. least < 1.0_wp) then
      if (least_gap(least) < 0.0_wp) then
        fraction = 0.0_wp
        return
      end if
    end if
    do k = 0, n_samples
      after = real(k, wp)/real(n_samples, wp)
      if (before >= fraction) return
      gap_after = least_gap(after)
      if (gap_after < 0.0_wp) exit
      before = after
      gap_before = gap_after
      if (k == n_samples) return
    end do
    if (after > 0.0_wp) call narrow()
    fraction = min(fraction, before)

  contains

    !> Narrow the stretch in which the least gap changes sign, by the rule of Illinois: the secant,
    !> with half the value of an end that stays twice. Every fourth time by half, whatever the gap.
    subroutine narrow()
      real(wp) :: middle, gap
      integer :: i, side

      side = 0
      do i = 1, 4*n_halvings
        if (after - before <= 0.5_wp**n_halvings) exit
        middle = before + (after - before)*gap_before/(gap_before - gap_after)
        if (modulo(i, 4) == 0 .or. .not. (middle > before .and. middle < after)) then
          middle = 0.5_wp*(before + after)
        end if
        gap = least_gap(middle)
        if (gap < 0.0_wp) then
          after = middle
          gap_after = gap
          if (side < 0) gap_before = 0.5_wp*gap_before
          side = -1
        else
          before = middle
          gap_before = gap
          if (side > 0) gap_after = 0.5_wp*gap_after
          side = 1
        end if
      end do
    end subroutine narrow

    real(wp) function least_gap(s)
      real(wp), intent(in) :: s
      integer :: j

      moving%extra_gap = (1.0_wp - s)*from%extra_gap + s*to%extra_gap
      call place_curved(scene, moving, (1.0_wp - s)*from%u + s*to%u, between, &
        (1.0_wp - s)*from%turn + s*to%turn)
      least_gap = huge(1.0_wp)
      do j = 1, size(can_press)
        if (.not. points%is_curved(can_press(j))) cycle
        least_gap = min(least_gap, between%gap(can_press(j)))
      end do
    end function least_gap

  end function fraction_to_touch

end module load_events_mod
