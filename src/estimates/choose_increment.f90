!> How large the next increment may be, where the deck leaves that to the program (no DIRECT).
!>
!> An increment ends at the next event of the load path, if that comes before the deck's end
!> (load_events_mod). It is cut in halves, quarters, ... as often as the accuracy wants it, or as an
!> increment that was not solved. Whether it wants it is tried out on the interface alone: two
!> increments of a size, and one of twice that size, differ by the error of the two.
!>
!> The deck's increments are a guess, that of a *STEP's beginning and behind an event. They grow to
!> two, four, ... of them while what load steps make is small beside what the mesh makes, and shrink
!> again. They end at ends of the deck's all the same, and at all that output, or cycles of loads,
!> name.
module choose_increment_mod
  use kinds_mod, only: wp, i8
  use number_list_mod, only: number_list_t, archive
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t
  use increments_mod, only: increment_t, next_increment, whole_increment, &
    smallest_increment, is_extra, largest_length, rounded_up, count_increments
  use controls_mod, only: chooses_mesh
  use increment_report_mod, only: error_parts_t
  use load_cycles_mod, only: load_cycles_t
  use step_solver_mod, only: step_solver_t
  use load_events_mod, only: next_event, no_event
  use turns_mod, only: turn_within, most_turn
  use increments_in_time_mod, only: end_in_time, next_jump, longer
  use load_step_error_mod, only: try_increment, resultant_change
  implicit none
  private

  public :: increment_size_t, choose_increment, pass_touch, cut_increment, carry_size
  public :: may_grow, grow_increments, fewest_increments, grow_in_time

  real(wp), parameter :: part_for_steps = 0.25_wp
  !! of the accuracy, that load steps may use up by (10.2), which is 0.4 times their true error at
  !! least: 5/8
  real(wp), parameter :: beside_mesh = 1.0_wp/3.0_wp
  !! of its error, that load steps may make: finer ones would take a quarter off the sum at most
  integer, parameter :: no_touches = huge(1) !! so many have been: no increment ends at another

  !> The size that holds.
  type :: increment_size_t
    integer(i8) :: length = whole_increment !! in parts of the deck's increments
    integer(i8) :: most = whole_increment   !! that it may be, as the error by load steps has it
    integer(i8) :: failed = no_event        !! the shortest of the step that was not solved
    integer :: granted = 0                  !! increments of that size before it is chosen anew
    integer(i8) :: base = 0                 !! where in the step sizes are counted from
    integer(i8) :: event = no_event         !! the next event of the step, as of the last increment
    logical :: is_touch = .false.           !! contact begins there
    integer :: n_touches = 0                !! of the step at which an increment has ended
    integer(i8) :: passed = no_event        !! a touch at which none was solved
    integer :: passed_in = 0                !! its step
  end type increment_size_t

contains

  !> The increment that follows `old`.
  subroutine choose_increment(scene, points, solver, old, cycles, size, increment, is_plain)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(inout) :: solver  !! as of `advance`
    type(state_t), intent(in) :: old
    type(load_cycles_t), intent(in) :: cycles     !! of the *STEP
    type(increment_size_t), intent(inout) :: size
    type(increment_t), intent(out) :: increment
    logical, intent(out), optional :: is_plain
    !! it is the deck's, and so are those after it in its *STEP, as far as one can tell
    integer(i8) :: finish

    increment = next_increment(scene%steps, old)
    if (present(is_plain)) is_plain = .true.
    if (scene%steps(increment%step)%direct) then
      size = increment_size_t()
      associate (divisions => solver%choices%divisions)
        if (present(is_plain)) is_plain = divisions == 1
        if (divisions == 1 .or. .not. scene%steps(increment%step)%is_dynamic) return
        increment = next_increment(scene%steps, old, whole_increment/divisions)
      end associate
      return
    end if
    if (scene%steps(increment%step)%is_dynamic) then
      call choose_in_time(scene, solver, cycles, size, increment)
      if (present(is_plain)) is_plain = .false.
      increment = next_increment(scene%steps, old, increment%position - increment%start)
      return
    end if
    call find_event(scene, points, solver, old, increment, size)
    if (size%granted == 0) then
      size%length = fitting(increment%start - size%base, size%length, &
        longest(scene, increment%step, size, solver%choices%divisions))
      if (tries_sizes(scene)) then
        call try_sizes(scene, points, solver, old, increment, size)
      else
        size%granted = 1
      end if
    end if
    size%granted = size%granted - 1
    call limit_turn(scene, solver, increment, size)
    if (present(is_plain)) is_plain = size%length == whole_increment .and. &
      size%event == no_event .and. .not. is_extra(increment%start) .and. &
      .not. (tries_sizes(scene) .or. may_grow(scene, increment%step))
    finish = end_of(scene, cycles, increment, size)
    if (finish == size%event .or. finish - increment%start /= size%length) size%granted = 0
    increment = next_increment(scene%steps, old, finish - increment%start)
  end subroutine choose_increment

  !> The end of the next increment of a dynamic *STEP. At jumps, and as the *STEP begins, lengths
  !> begin with the deck's again.
  subroutine choose_in_time(scene, solver, cycles, size, increment)
    type(scene_t), intent(in) :: scene
    type(step_solver_t), intent(in) :: solver      !! prepared for the step
    type(load_cycles_t), intent(in) :: cycles
    type(increment_size_t), intent(inout) :: size
    type(increment_t), intent(inout) :: increment  !! uncut; gets its end

    if (size%passed_in /= increment%step) size = increment_size_t(passed_in=increment%step)
    if (increment%first_of_step .or. increment%start == size%passed) size%length = &
      min(size%length, whole_increment/solver%choices%divisions)
    size%event = min(no_event, next_jump(solver, increment%start))
    associate (stop => min(next_stop(scene, cycles, increment), size%event))
      call end_in_time(scene%steps(increment%step), solver%choices%divisions, increment%start, &
        stop, size%base, size%length, increment%position)
    end associate
    size%most = size%length
    call limit_turn(scene, solver, increment, size)
    if (size%length < size%most) increment%position = min(increment%position, increment%start + &
      size%length)
  end subroutine choose_in_time

  !> After an increment of a dynamic *STEP that is solved: the length of the next.
  pure subroutine grow_in_time(increment, error, divisions, size)
    type(increment_t), intent(in) :: increment
    real(wp), intent(in) :: error                !! as of error_in_time [-]
    integer, intent(in) :: divisions             !! as of choices_t
    type(increment_size_t), intent(inout) :: size

    size%length = longer(error, divisions, size%length)
    size%passed = merge(increment%position, no_event, increment%position == size%event)
  end subroutine grow_in_time

  !> Where an increment of this size ends.
  pure integer(i8) function end_of(scene, cycles, increment, size) result(finish)
    type(scene_t), intent(in) :: scene
    type(load_cycles_t), intent(in) :: cycles
    type(increment_t), intent(in) :: increment  !! uncut
    type(increment_size_t), intent(in) :: size
    integer(i8) :: boundary, n

    if (size%length <= whole_increment) then
      boundary = min(increment%position, size%event)
      finish = increment%start + size%length
      ! What would be left of it must not be shorter than the smallest increment.
      if (finish > boundary - smallest_increment) finish = boundary
    else
      ! Up to the boundary increments have about the same size.
      boundary = min(next_stop(scene, cycles, increment), size%event)
      associate (left => boundary - increment%start)
        n = (left + size%length - 1)/size%length
        finish = min(boundary, rounded_up(increment%start + left/n))
      end associate
    end if
  end function end_of

  !> The next place at which an increment of any size ends: that of the *STEP, what outputs name,
  !> and where a cycle of loads begins and ends.
  pure integer(i8) function next_stop(scene, cycles, increment) result(next)
    type(scene_t), intent(in) :: scene
    type(load_cycles_t), intent(in) :: cycles
    type(increment_t), intent(in) :: increment
    integer :: i

    associate (steps => scene%steps, step => increment%step, output => scene%output)
      next = steps(step)%n_increments*whole_increment
      if (output%frequency > 1) call stop_at(0, output%frequency)
      if (allocated(output%prints)) then
        do i = 1, size(output%prints)
          if (output%prints(i)%frequency > 1) call stop_at(0, output%prints(i)%frequency)
        end do
      end if
      if (cycles%length > 0) call stop_at(cycles%first - sum(steps(:step - 1)%n_increments), &
        cycles%length)
    end associate

  contains

    pure subroutine stop_at(first, every)
      integer, intent(in) :: first, every !! in increments of the deck
      integer(i8) :: length

      length = every*whole_increment
      next = min(next, increment%start + length - modulo(increment%start - &
        first*whole_increment, length))
    end subroutine stop_at

  end function next_stop

  !> Whether sizes are tried out before they are taken.
  pure logical function tries_sizes(scene)
    type(scene_t), intent(in) :: scene

    tries_sizes = scene%accuracy%wanted > 0.0_wp .and. scene%accuracy%keeps_mesh
  end function tries_sizes

  !> Whether increments of a *STEP may become larger than the deck's: where what load steps make is
  !> told, and not what several runs are compared by at ends of the deck's.
  pure logical function may_grow(scene, step)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step

    may_grow = scene%accuracy%estimates .and. .not. chooses_mesh(scene%accuracy) .and. .not. &
      scene%steps(step)%is_dynamic .and. largest_length(scene%steps(step)) > whole_increment
  end function may_grow

  !> The largest size that the next increment may have.
  pure integer(i8) function longest(scene, step, size, divisions) result(most)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    type(increment_size_t), intent(in) :: size
    integer, intent(in) :: divisions !! how many, a power of 2

    most = divided(size%base, merge(no_event, size%event, size%is_touch), divisions)
    if (.not. may_grow(scene, step)) return
    most = merge(largest_length(scene%steps(step)), size%most, tries_sizes(scene))
    do while (most > whole_increment .and. most >= size%failed)
      most = most/2
    end do
  end function longest

  !> After an increment: how large the next may be, by the error of load steps where that is known.
  !>
  !> It is of first order in the size: twice of it is looked for in one of twice the size.
  pure subroutine grow_increments(scene, step, errors, size)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    type(error_parts_t), intent(in) :: errors   !! at its end
    type(increment_size_t), intent(inout) :: size
    real(wp) :: allowed

    if (errors%load_steps < 0.0_wp .or. .not. may_grow(scene, step)) return
    allowed = beside_mesh*max(0.0_wp, errors%mesh)
    size%most = size%length
    if (2.0_wp*errors%load_steps <= allowed) size%most = 2*size%length
    if (errors%load_steps > allowed) size%most = size%length/2
    size%most = max(whole_increment, min(size%most, largest_length(scene%steps(step))))
  end subroutine grow_increments

  !> Cut increments in which an obstacle would turn too far. docs/theory.md (9.8).
  pure subroutine limit_turn(scene, solver, increment, size)
    type(scene_t), intent(in) :: scene
    type(step_solver_t), intent(in) :: solver   !! prepared for the step
    type(increment_t), intent(in) :: increment  !! uncut
    type(increment_size_t), intent(inout) :: size
    integer(i8) :: finish

    if (.not. any(scene%obstacles%turns)) return
    do while (size%length > smallest_increment)
      finish = min(increment%start + size%length, size%event, &
        scene%steps(increment%step)%n_increments*whole_increment)
      if (turn_within(scene, solver%response%loads%turns, increment%step, increment%start, &
        finish) <= most_turn) exit
      size%length = size%length/2
      size%granted = 0
    end do
  end subroutine limit_turn

  !> The next event of the step, and where sizes are counted from: the last event or end of the
  !> deck's increments.
  subroutine find_event(scene, points, solver, old, increment, size)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    type(state_t), intent(in) :: old
    type(increment_t), intent(in) :: increment  !! uncut
    type(increment_size_t), intent(inout) :: size
    integer(i8) :: reached

    reached = size%event
    if (increment%first_of_step) then
      reached = no_event
      size%n_touches = 0
      size%failed = no_event
    end if
    if (increment%start == reached .and. size%is_touch) size%n_touches = size%n_touches + 1
    if (increment%start == reached .or. .not. is_extra(increment%start)) size%base = &
      increment%start
    if (increment%first_of_step .or. increment%start == reached) then
      size%most = whole_increment
      size%length = min(size%length, whole_increment)
    end if
    call next_event(scene, points, solver, old, increment, size%event, size%is_touch, &
      size%n_touches)
    if (size%is_touch .and. size%event == size%passed .and. increment%step == size%passed_in) then
      call next_event(scene, points, solver, old, increment, size%event, size%is_touch, no_touches)
    end if
  end subroutine find_event

  !> The parts of an increment of the deck. What there is of it up to a kink, or behind an event, is
  !> divided, too, into parts of half the size where there are twice as many: else runs with few
  !> parts would have the same increments there, and be alike for that. Not so what comes before the
  !> first touch: nothing depends on increments there.
  pure integer(i8) function divided(base, kink, divisions) result(length)
    integer(i8), intent(in) :: base      !! the last event or end of the deck's increments
    integer(i8), intent(in) :: kink      !! behind it
    integer, intent(in)     :: divisions !! how many, a power of 2

    length = whole_increment/divisions
    if (divisions == 1) return
    do while (length*divisions > min(whole_increment - modulo(base, whole_increment), kink - base) &
      .and. length > smallest_increment)
      length = length/2
    end do
  end function divided

  !> The largest size up to twice `length`, and `most`, that begins and ends where one of its kind
  !> may.
  pure integer(i8) function fitting(start, length, most)
    integer(i8), intent(in) :: start  !! beside where sizes are counted from
    integer(i8), intent(in) :: length, most

    fitting = min(most, 2*length)
    do while (modulo(start, fitting) /= 0)
      fitting = fitting/2
    end do
  end function fitting

  !> Find a size of which two in a row are accurate enough; the smallest there is in any case.
  subroutine try_sizes(scene, points, solver, old, increment, size)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(inout) :: solver
    type(state_t), intent(in) :: old
    type(increment_t), intent(in) :: increment  !! uncut
    type(increment_size_t), intent(inout) :: size
    type(state_t) :: coarse, middle, fine
    integer(i8) :: left
    logical :: has_coarse, ok, fine_ok
    real(wp) :: change

    left = min(size%event, scene%steps(increment%step)%n_increments*whole_increment) - &
      increment%start
    do while (2*size%length > left .and. size%length > smallest_increment)
      size%length = size%length/2
    end do
    size%granted = 2
    if (2*size%length > left) return
    call try_increment(scene, points, solver, old, 2*size%length, coarse, has_coarse)
    do while (size%length > smallest_increment)
      call try_increment(scene, points, solver, old, size%length, middle, ok)
      fine_ok = ok
      if (ok) call try_increment(scene, points, solver, middle, size%length, fine, fine_ok)
      if (has_coarse .and. fine_ok) then
        change = resultant_change(points, coarse%reaction, fine%reaction)
        if (change <= part_for_steps*scene%accuracy%wanted) exit
      end if
      size%length = size%length/2
      coarse = middle
      has_coarse = ok
    end do
  end subroutine try_sizes

  !> After an increment that was not solved and ended where contact begins: not to end there.
  !>
  !> What is moved far, and hardly deformed by then, may have forces at a first touch that are no
  !> more than the rounding of its displacements, which cannot be certified. Further on they are.
  pure subroutine pass_touch(increment, size, is_passed)
    type(increment_t), intent(in) :: increment   !! that was not solved
    type(increment_size_t), intent(inout) :: size
    logical, intent(out) :: is_passed

    is_passed = size%is_touch .and. increment%position == size%event
    if (.not. is_passed) return
    size%passed = increment%position
    size%passed_in = increment%step
  end subroutine pass_touch

  !> After an increment that was not solved: half of it, where the deck allows that and it is large
  !> enough.
  subroutine cut_increment(scene, increment, size, is_cut)
    type(scene_t), intent(in) :: scene
    type(increment_t), intent(in) :: increment   !! that was not solved
    type(increment_size_t), intent(inout) :: size
    logical, intent(out) :: is_cut
    integer(i8) :: length

    ! It may have ended earlier, at an event.
    length = min(size%length, increment%position - increment%start)
    size%failed = min(size%failed, length)
    is_cut = .not. scene%steps(increment%step)%direct .and. length >= 2*smallest_increment
    if (.not. is_cut) return
    do while (2*size%length > length)
      size%length = size%length/2
    end do
    size%granted = 2
  end subroutine cut_increment

  !> The number of increments of a run that grow as fast as they may, without those at events.
  pure integer function fewest_increments(scene) result(n)
    type(scene_t), intent(in) :: scene
    type(increment_size_t) :: size
    type(increment_t) :: increment
    integer :: step, i

    n = count_increments(scene%steps)
    do step = 1, ubound(scene%steps, 1)
      if (.not. may_grow(scene, step)) cycle
      associate (n_deck => scene%steps(step)%n_increments)
        increment%step = step
        increment%position = 0
        size%length = whole_increment
        do i = 1, n_deck
          increment%start = increment%position
          increment%position = end_of(scene, load_cycles_t(), increment, size)
          if (increment%position == n_deck*whole_increment) exit
          ! The error of load steps is told after two of a size.
          if (modulo(i, 2) == 0) size%length = min(2*size%length, largest_length(scene%steps(step)))
        end do
        n = n - n_deck + i
      end associate
    end do
  end function fewest_increments

  !> Put a size into the list, or take it out.
  subroutine carry_size(list, size)
    type(number_list_t), intent(inout) :: list
    type(increment_size_t), intent(inout) :: size
    integer :: touch

    call archive(list, size%length)
    call archive(list, size%most)
    call archive(list, size%failed)
    call archive(list, size%granted)
    call archive(list, size%base)
    call archive(list, size%event)
    call archive(list, size%n_touches)
    call archive(list, size%passed)
    call archive(list, size%passed_in)
    touch = merge(1, 0, size%is_touch)
    call archive(list, touch)
    size%is_touch = touch == 1
  end subroutine carry_size

end module choose_increment_mod
