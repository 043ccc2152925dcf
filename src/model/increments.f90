!> The increments of a run, one after the other.
!>
!> The deck says how many a *STEP has. Where it lets them be cut (no DIRECT), an increment may end
!> within one of the deck's: at a binary fraction of it, or where the load path has an event. Ends
!> within a step are counted in whole parts of the deck's increments, so no rounding adds up.
module increments_mod
  use kinds_mod, only: wp, i8
  use loads_mod, only: load_step_t
  use state_mod, only: state_t
  use text_mod, only: to_text
  implicit none
  private

  public :: increment_t, next_increment, count_increments, done_of_deck, ends_step, mark_end, &
    is_extra, asked_number, increment_name, largest_length, rounded_up, duration_of
  public :: whole_increment, smallest_increment

  integer(i8), parameter :: whole_increment = 2_i8**32 !! parts in an increment of the deck
  integer(i8), parameter :: smallest_increment = 2_i8**20 !! nothing is cut below 1/4096
  integer, parameter :: least_of_step = 8
  !! increments that a *STEP keeps as they grow: with fewer the error by load steps is not seen

  !> One increment of one *STEP.
  type :: increment_t
    integer  :: index = 0             !! within the run, from 1; 0: the run is over
    integer  :: step = 0              !! ordinal of its *STEP
    integer  :: number = 0            !! within the step, from 1
    logical  :: first_of_step = .false.
    logical  :: last_of_step = .false.
    integer(i8) :: start = 0          !! its beginning within the step, as its end
    integer(i8) :: position = 0       !! its end, in parts of the deck's increments
    real(wp) :: begin = 0.0_wp        !! fraction of the step's period where it begins [-]
    real(wp) :: fraction = 0.0_wp        !! and at its end, 0 < fraction <= 1 [-]
    real(wp) :: step_time = 0.0_wp    !! at its end, from the start of the step
    real(wp) :: time = 0.0_wp         !! at its end, from the start of the run
  end type increment_t

contains

  !> The largest size that increments of a *STEP may grow to: a power of 2 of the deck's.
  pure integer(i8) function largest_length(step) result(length)
    type(load_step_t), intent(in) :: step
    real(wp) :: most !! of the deck's

    length = whole_increment
    if (step%direct) return
    most = step%n_increments*(min(step%largest, step%period/least_of_step)/step%period)
    do while (2*length <= most*whole_increment)
      length = 2*length
    end do
  end function largest_length

  !> How long so many parts are: of as many the same to the last bit.
  pure real(wp) function duration_of(step, parts) result(duration)
    type(load_step_t), intent(in) :: step
    integer(i8), intent(in) :: parts

    duration = real(parts, wp)/(real(step%n_increments, wp)*real(whole_increment, wp))*step%period
  end function duration_of

  !> The first end of the deck's increments at a position or behind it.
  pure integer(i8) function rounded_up(position)
    integer(i8), intent(in) :: position !! in parts of the deck's increments

    rounded_up = position + modulo(-position, whole_increment)
  end function rounded_up

  !> The increment that follows `state`; its index is 0 when there is none.
  pure type(increment_t) function next_increment(steps, state, length) result(increment)
    type(load_step_t), intent(in) :: steps(:)
    type(state_t), intent(in) :: state
    integer(i8), intent(in), optional :: length
    !! in parts; up to the next end of the deck's where it is left out
    integer(i8) :: start, parts

    increment%step = max(1, state%step)
    increment%number = state%increment + 1
    start = state%position
    if (state%step > 0 .and. ends_step(steps, state)) then
      increment%step = increment%step + 1
      increment%number = 1
      start = 0
    end if
    if (increment%step > size(steps)) return
    increment%index = state%increments_done + 1
    increment%first_of_step = start == 0
    increment%start = start
    parts = whole_increment - modulo(start, whole_increment)
    if (present(length)) parts = length
    associate (step => steps(increment%step))
      increment%position = min(start + parts, step%n_increments*whole_increment)
      increment%last_of_step = increment%position == step%n_increments*whole_increment
      increment%begin = fraction_of(step, start)
      increment%fraction = fraction_of(step, increment%position)
      increment%step_time = increment%fraction*step%period
    end associate
    ! From the start of the run each time, so that rounding does not add up.
    increment%time = sum(steps(:increment%step - 1)%period) + increment%step_time
  end function next_increment

  !> The fraction of the step's period at a position; that of uncut increments to the last bit.
  pure real(wp) function fraction_of(step, position)
    type(load_step_t), intent(in) :: step
    integer(i8), intent(in) :: position

    fraction_of = real(position, wp)/(real(step%n_increments, wp)*real(whole_increment, wp))
  end function fraction_of

  !> Whether a state is that at the end of its *STEP, or where the run ends within it.
  pure logical function ends_step(steps, state)
    type(load_step_t), intent(in) :: steps(:)
    type(state_t), intent(in) :: state

    ends_step = state%ends_run .or. &
      state%position >= steps(max(1, state%step))%n_increments*whole_increment
  end function ends_step

  !> Whether an increment ends where none of the deck's does.
  pure logical function is_extra(position)
    integer(i8), intent(in) :: position

    is_extra = modulo(position, whole_increment) /= 0
  end function is_extra

  !> The number of an increment among the deck's of its *STEP, from 1; -1: it is an extra one.
  pure integer function asked_number(position)
    integer(i8), intent(in) :: position !! of its end

    asked_number = int(position/whole_increment)
    if (is_extra(position)) asked_number = -1
  end function asked_number

  !> "step 2, increment 17".
  pure function increment_name(increment) result(name)
    type(increment_t), intent(in) :: increment
    character(:), allocatable :: name

    name = 'step '//to_text(increment%step)//', increment '//to_text(increment%number)
  end function increment_name

  !> Mark a state as the end of an increment.
  pure subroutine mark_end(increment, state)
    type(increment_t), intent(in) :: increment
    type(state_t), intent(inout) :: state

    state%increments_done = increment%index
    state%step = increment%step
    state%increment = increment%number
    state%position = increment%position
    state%time = increment%time
  end subroutine mark_end

  !> The number of increments of all steps, uncut.
  pure integer function count_increments(steps) result(n)
    type(load_step_t), intent(in) :: steps(:)

    n = sum(steps%n_increments)
  end function count_increments

  !> Increments of the deck that are done at a position in a *STEP, over the run; of one that has
  !> begun a part [-].
  pure real(wp) function done_of_deck(steps, step, position)
    type(load_step_t), intent(in) :: steps(:)
    integer, intent(in) :: step         !! 0: before the first
    integer(i8), intent(in) :: position !! in parts of the deck's increments

    done_of_deck = real(sum(steps(:step - 1)%n_increments), wp) + &
      real(position, wp)/real(whole_increment, wp)
  end function done_of_deck

end module increments_mod
