!> How long the increments of a dynamic *STEP are, where the deck leaves that to the program (no
!> DIRECT): by their error in time, halved and doubled. docs/theory.md, section 13.
module increments_in_time_mod
  use kinds_mod, only: wp, i8
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use loads_mod, only: load_step_t
  use increments_mod, only: largest_length, whole_increment, smallest_increment
  use step_solver_mod, only: step_solver_t
  use dynamic_step_mod, only: crossing_time
  implicit none
  private

  public :: next_jump, end_in_time, shortest_in_time, is_too_long, longer

  real(wp), parameter :: tolerable = 0.03_wp
  !! error, as of error_in_time: 0.01 follows the ringing of the mesh (docs/theory/inertia.md) [-]
  real(wp), parameter :: small = tolerable/8.0_wp
  !! with which increments grow: the error is of the third order, in twice the time eight times [-]
  real(wp), parameter :: crossing = 1.0_wp/16.0_wp
  !! of the time that sound takes across an element: shorter increments resolve its mesh's ringing

contains

  !> The first jump of an amplitude behind a place of the *STEP; behind its end where there is none.
  pure integer(i8) function next_jump(solver, start) result(jump)
    type(step_solver_t), intent(in) :: solver !! prepared for the step
    integer(i8), intent(in) :: start

    jump = minval(solver%response%loads%jumps, mask=solver%response%loads%jumps >= start + &
      smallest_increment)
  end function next_jump

  !> Where the next increment ends: after a length that fits where lengths are counted from, or at a
  !> place where one must.
  pure subroutine end_in_time(step, divisions, start, stop, base, length, finish)
    type(load_step_t), intent(in) :: step
    integer, intent(in) :: divisions       !! as of choices_t
    integer(i8), intent(in) :: start, stop !! of the *STEP; the next place at which one ends
    integer(i8), intent(inout) :: base     !! where lengths are counted from
    integer(i8), intent(inout) :: length   !! wanted; taken
    integer(i8), intent(out) :: finish

    if (modulo(start - base, smallest_increment) /= 0) base = start
    length = min(length, largest_length(step)/divisions)
    do while (length > smallest_increment .and. modulo(start - base, length) /= 0)
      length = length/2
    end do
    finish = start + length
    if (finish > stop - smallest_increment) finish = stop
  end subroutine end_in_time

  !> The shortest increment that the error in time makes, in parts of the deck's.
  pure integer(i8) function shortest_in_time(scene, points, step, divisions) result(shortest)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: step
    integer, intent(in) :: divisions !! as of choices_t
    real(wp) :: time

    associate (s => scene%steps(step))
      time = s%smallest
      if (.not. time > 0.0_wp) time = crossing*crossing_time(scene, points)
      time = time/divisions
      shortest = smallest_increment
      do while (real(shortest, wp)/real(whole_increment, wp)*s%period < time*s%n_increments .and. &
        shortest < largest_length(s))
        shortest = 2*shortest
      end do
    end associate
  end function shortest_in_time

  !> Whether the error of an increment is more than is tolerable: of increments that are divided
  !> what leaves them so many times as short, for the error is of second order.
  pure logical function is_too_long(error, divisions)
    real(wp), intent(in) :: error    !! as of error_in_time [-]
    integer, intent(in) :: divisions !! as of choices_t

    is_too_long = error*real(divisions, wp)**2 > tolerable
  end function is_too_long

  !> The length of the increment that follows one.
  pure integer(i8) function longer(error, divisions, length)
    real(wp), intent(in) :: error    !! as of error_in_time [-]
    integer, intent(in) :: divisions !! as of choices_t
    integer(i8), intent(in) :: length

    longer = length
    if (error*real(divisions, wp)**2 < small) longer = 2*length
  end function longer

end module increments_in_time_mod
