!> The increments of a run, one after the other.
module increments_mod
  use kinds_mod, only: wp
  use loads_mod, only: load_step_t
  use state_mod, only: state_t
  implicit none
  private

  public :: increment_t, next_increment, count_increments, mark_end

  !> One increment of one *STEP.
  type :: increment_t
    integer  :: row = 0               !! number within the run, from 1; 0: the run is over
    integer  :: step = 0              !! ordinal of its *STEP
    integer  :: number = 0            !! within the step, from 1
    logical  :: first_of_step = .false.
    logical  :: last_of_step = .false.
    real(wp) :: share = 0.0_wp        !! of the step's period, at its end, 0 < share <= 1 [-]
    real(wp) :: step_time = 0.0_wp    !! at its end, from the start of the step
    real(wp) :: time = 0.0_wp         !! at its end, from the start of the run
  end type increment_t

contains

  !> The increment that follows `state`; its row is 0 when there is none.
  pure function next_increment(steps, state) result(increment)
    type(load_step_t), intent(in) :: steps(:)
    type(state_t), intent(in) :: state
    type(increment_t) :: increment

    increment%step = max(1, state%step)
    increment%number = state%increment + 1
    if (increment%number > steps(increment%step)%n_increments) then
      increment%step = increment%step + 1
      increment%number = 1
    end if
    if (increment%step > size(steps)) return
    increment%row = state%row + 1
    increment%first_of_step = increment%number == 1
    associate (step => steps(increment%step))
      increment%last_of_step = increment%number == step%n_increments
      increment%share = real(increment%number, wp)/real(step%n_increments, wp)
      increment%step_time = increment%share*step%period
    end associate
    ! From the start of the run each time, so that rounding does not add up.
    increment%time = sum(steps(:increment%step - 1)%period) + increment%step_time
  end function next_increment

  !> Mark a state as the end of an increment.
  pure subroutine mark_end(increment, state)
    type(increment_t), intent(in) :: increment
    type(state_t), intent(inout) :: state

    state%row = increment%row
    state%step = increment%step
    state%increment = increment%number
    state%time = increment%time
  end subroutine mark_end

  !> The number of increments of all steps.
  pure function count_increments(steps) result(n)
    type(load_step_t), intent(in) :: steps(:)
    integer :: n

    n = sum(steps%n_increments)
  end function count_increments

end module increments_mod
