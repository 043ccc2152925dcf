!> How much warmer the bodies are than at first, which the deck alone decides: temperatures at the
!> nodes, and of each element the mean of its nodes. docs/theory.md section 8.
module warming_mod
  use kinds_mod, only: wp, i8
  use loads_mod, only: amplitude_value, start_of_step
  use increments_mod, only: whole_increment
  use refine_elements_mod, only: fill_between
  use scene_mod, only: scene_t
  implicit none
  private

  public :: warming_t, warms, warming_of_step, warming_at

  !> The rise of the nodes' temperatures in one *STEP, as its loads are made up. Not allocated where
  !> nothing warms.
  type :: warming_t
    real(wp) :: start = 0.0_wp !! of the step, in the time of the run
    real(wp), allocatable :: held(:)            !! (n_nodes) [temperature]
    real(wp), allocatable :: ramp(:)            !! (n_nodes) times the fraction [temperature]
    real(wp), allocatable :: by_amplitude(:, :) !! (n_nodes,n_amplitudes) [temperature]
  end type warming_t

contains

  !> Whether temperatures change, and a material expands with them.
  pure logical function warms(scene)
    type(scene_t), intent(in) :: scene
    integer :: k

    warms = .false.
    if (.not. any(abs(scene%materials%expansion) > 0.0_wp)) return
    do k = 1, size(scene%steps)
      if (allocated(scene%steps(k)%temperatures)) warms = warms .or. &
        size(scene%steps(k)%temperatures) > 0
    end do
  end function warms

  !> Level by level from the first step: what a step starts from is what the one before it ended
  !> with. OP=NEW lets the nodes that are not named go back to their first temperature.
  pure type(warming_t) function warming_of_step(scene, step) result(warming)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    real(wp), allocatable :: first(:) !! (n_nodes) where nothing has expanded [temperature]
    real(wp), allocatable :: now(:)   !! (n_nodes) the rise as a step begins [temperature]
    integer :: n, k, i, g

    if (.not. warms(scene)) return
    n = scene%mesh%n_nodes
    allocate (first(n), now(n), source=0.0_wp)
    if (allocated(scene%first_temperature)) first = scene%first_temperature
    allocate (warming%held(n), warming%ramp(n), source=0.0_wp)
    allocate (warming%by_amplitude(n, size(scene%amplitudes)), source=0.0_wp)
    do k = 1, step
      if (k > 1) then
        now = rise_at(scene, warming, 1.0_wp, scene%steps(k - 1)%period)
        warming%start = start_of_step(scene%steps, k)
        warming%held = warming%held + warming%ramp
        warming%ramp = 0.0_wp
        do g = 1, size(scene%amplitudes)
          ! What follows an amplitude over the time of the run goes on doing so.
          if (scene%amplitudes(g)%total) cycle
          warming%held = warming%held + amplitude_value(scene%amplitudes(g), &
            scene%steps(k - 1)%period)*warming%by_amplitude(:, g)
          warming%by_amplitude(:, g) = 0.0_wp
        end do
      end if
      if (scene%steps(k)%replace_temperatures) then
        warming%held = now
        warming%ramp = -now
        warming%by_amplitude = 0.0_wp
      end if
      if (.not. allocated(scene%steps(k)%temperatures)) cycle
      do i = 1, size(scene%steps(k)%temperatures)
        associate (t => scene%steps(k)%temperatures(i))
          warming%by_amplitude(t%node, :) = 0.0_wp
          if (t%amplitude > 0) then
            warming%held(t%node) = -first(t%node)
            warming%ramp(t%node) = 0.0_wp
            warming%by_amplitude(t%node, t%amplitude) = t%value
          else
            warming%held(t%node) = now(t%node)
            warming%ramp(t%node) = t%value - first(t%node) - now(t%node)
          end if
        end associate
      end do
      ! All of it is linear in the temperatures of the nodes.
      call fill_between(scene%mesh, warming%held)
      call fill_between(scene%mesh, warming%ramp)
      do g = 1, size(scene%amplitudes)
        call fill_between(scene%mesh, warming%by_amplitude(:, g))
      end do
    end do
  end function warming_of_step

  !> The rise at the nodes at a fraction of the step.
  pure function rise_at(scene, warming, fraction, step_time) result(rise)
    type(scene_t), intent(in) :: scene
    type(warming_t), intent(in) :: warming
    real(wp), intent(in) :: fraction, step_time !! as of increment_t [-], [time]
    real(wp) :: rise(size(warming%held))        !! [temperature]
    integer :: g

    rise = warming%held + fraction*warming%ramp
    do g = 1, size(warming%by_amplitude, 2)
      rise = rise + amplitude_value(scene%amplitudes(g), step_time, warming%start)* &
        warming%by_amplitude(:, g)
    end do
  end function rise_at

  !> The rise at the nodes at a place in a step; empty where nothing warms.
  pure function warming_at(scene, step, position) result(rise)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    integer(i8), intent(in) :: position !! in parts of the deck's increments
    real(wp), allocatable :: rise(:)    !! (n_nodes) [temperature]
    real(wp) :: fraction

    if (warms(scene)) then
      fraction = real(position, wp)/(real(scene%steps(step)%n_increments, wp)* &
        real(whole_increment, wp))
      rise = rise_at(scene, warming_of_step(scene, step), fraction, &
        fraction*scene%steps(step)%period)
    else
      allocate (rise(0))
    end if
  end function warming_at

end module warming_mod
