!> How obstacles turn in a *STEP: rotation vectors that the deck alone decides. docs/theory.md
!> section 9.
module turns_mod
  use kinds_mod, only: wp, i8
  use loads_mod, only: amplitude_value, start_of_step
  use increments_mod, only: whole_increment, smallest_increment
  use scene_mod, only: scene_t
  implicit none
  private

  public :: turns_t, turns_of_step, rotation_at, turn_within, largest_turn, count_cuts
  public :: most_turn, turn_allowed

  real(wp), parameter :: rounded = 1.0_wp + 1.0e-9_wp
  real(wp), parameter :: degree = acos(-1.0_wp)/180.0_wp
  real(wp), parameter :: most_turn = 10.0_wp*degree*rounded
  !! of an obstacle in an increment that may be cut further [rad]
  real(wp), parameter :: most_direct_turn = 90.0_wp*degree*rounded !! and in any other [rad]

  !> The rotation vectors of the obstacles in one *STEP, as its loads are made up. Not allocated
  !> where no obstacle turns.
  type :: turns_t
    real(wp) :: start = 0.0_wp !! of the step, in the time of the run
    real(wp), allocatable :: held(:, :)            !! (3,n_obstacles) [rad]
    real(wp), allocatable :: ramp(:, :)            !! (3,n_obstacles) times the fraction [rad]
    real(wp), allocatable :: by_amplitude(:, :, :) !! (3,n_obstacles,n_amplitudes) [rad]
  end type turns_t

contains

  !> The rotations of a step. Each step starts where the one before it ended.
  pure type(turns_t) function turns_of_step(scene, step) result(turns)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    real(wp), allocatable :: now(:, :) !! (3,n_obstacles) as a step begins [rad]
    integer :: n, k, i, o

    if (.not. any(scene%obstacles%turns)) return
    n = size(scene%obstacles)
    allocate (turns%held(3, n), turns%ramp(3, n), source=0.0_wp)
    allocate (turns%by_amplitude(3, n, size(scene%amplitudes)), source=0.0_wp)
    allocate (now(3, n), source=0.0_wp)
    do k = 1, step
      if (k > 1) then
        now = rotation_at(scene, turns, 1.0_wp, scene%steps(k - 1)%period)
        turns%held = now
        turns%ramp = 0.0_wp
        turns%start = start_of_step(scene%steps, k)
        do i = 1, size(scene%amplitudes)
          if (scene%amplitudes(i)%total) then
            ! Rotations by an amplitude of the total time go on in the next step.
            turns%held = turns%held - amplitude_value(scene%amplitudes(i), 0.0_wp, turns%start)* &
              turns%by_amplitude(:, :, i)
          else
            turns%by_amplitude(:, :, i) = 0.0_wp
          end if
        end do
      end if
      if (.not. allocated(scene%steps(k)%rotations)) cycle
      do i = 1, size(scene%steps(k)%rotations)
        associate (r => scene%steps(k)%rotations(i))
          do o = 1, n
            if (r%node /= scene%obstacles(o)%ref_node) cycle
            turns%by_amplitude(r%dof, o, :) = 0.0_wp
            turns%held(r%dof, o) = now(r%dof, o)
            if (r%amplitude > 0) then
              turns%held(r%dof, o) = r%from
              turns%by_amplitude(r%dof, o, r%amplitude) = r%value
            else if (.not. r%fixed) then
              turns%ramp(r%dof, o) = r%value - now(r%dof, o)
            end if
          end do
        end associate
      end do
    end do
  end function turns_of_step

  !> The rotation vectors at a fraction of the step.
  pure function rotation_at(scene, turns, fraction, step_time) result(rotation)
    type(scene_t), intent(in) :: scene
    type(turns_t), intent(in) :: turns
    real(wp), intent(in) :: fraction      !! of the step's period, 0 to 1 [-]
    real(wp), intent(in) :: step_time  !! from the start of the step
    real(wp) :: rotation(3, size(scene%obstacles)) !! [rad]
    integer :: g

    rotation = 0.0_wp
    if (.not. allocated(turns%held)) return
    rotation = turns%held + fraction*turns%ramp
    do g = 1, size(turns%by_amplitude, 3)
      if (.not. any(abs(turns%by_amplitude(:, :, g)) > 0.0_wp)) cycle
      rotation = rotation + amplitude_value(scene%amplitudes(g), step_time, turns%start)* &
        turns%by_amplitude(:, :, g)
    end do
  end function rotation_at

  !> The farthest that an obstacle turns from one place in a step to another; where its axis
  !> changes, a bound of that.
  pure real(wp) function turn_within(scene, turns, step, start, finish) result(turn)
    type(scene_t), intent(in) :: scene
    type(turns_t), intent(in) :: turns        !! of the step
    integer, intent(in) :: step
    integer(i8), intent(in) :: start, finish  !! in parts of the deck's increments

    turn = 0.0_wp
    if (allocated(turns%held)) turn = maxval(norm2(at(finish) - at(start), dim=1))

  contains

    pure function at(position) result(rotation)
      integer(i8), intent(in) :: position
      real(wp) :: rotation(3, size(scene%obstacles))
      real(wp) :: fraction

      fraction = real(position, wp)/(real(scene%steps(step)%n_increments, wp)* &
        real(whole_increment, wp))
      rotation = rotation_at(scene, turns, fraction, fraction*scene%steps(step)%period)
    end function at

  end function turn_within

  !> The farthest that an obstacle may turn in one of the deck's increments of a step.
  pure real(wp) function turn_allowed(scene, step)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step

    turn_allowed = most_direct_turn
    if (.not. scene%steps(step)%direct) turn_allowed = most_turn* &
      real(whole_increment/smallest_increment, wp)
  end function turn_allowed

  !> The farthest that an obstacle turns in one of the deck's increments of a step.
  pure real(wp) function largest_turn(scene, step) result(turn)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    type(turns_t) :: turns
    integer :: k

    turns = turns_of_step(scene, step)
    turn = 0.0_wp
    if (.not. allocated(turns%held)) return
    do k = 1, scene%steps(step)%n_increments
      turn = max(turn, turn_within(scene, turns, step, (k - 1)*whole_increment, k*whole_increment))
    end do
  end function largest_turn

  !> How many more increments a step gets by halving those in which an obstacle would turn too far.
  pure integer function count_cuts(scene, step) result(n)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    type(turns_t) :: turns
    integer(i8) :: length, start
    integer :: k

    n = 0
    if (scene%steps(step)%direct) return
    turns = turns_of_step(scene, step)
    if (.not. allocated(turns%held)) return
    do k = 1, scene%steps(step)%n_increments
      length = whole_increment
      start = (k - 1)*whole_increment
      do while (length > smallest_increment .and. &
        turn_within(scene, turns, step, start, start + length) > most_turn)
        length = length/2
      end do
      n = n + int(whole_increment/length) - 1
    end do
  end function count_cuts

end module turns_mod
