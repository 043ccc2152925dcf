!> For the certificate: how fast supports move as an increment of a dynamic *STEP ends, by the
!> cards. docs/theory.md, section 13.
module support_speeds_mod
  use kinds_mod, only: wp
  use loads_mod, only: amplitude_t, amplitude_value, start_of_step
  use increments_mod, only: smallest_increment, whole_increment
  use scene_mod, only: scene_t
  use state_mod, only: state_t
  implicit none
  private

  public :: speeds_of_supports

contains

  !> The velocities that cards prescribe, along the degrees of freedom that they name; 0 elsewhere.
  !> Where an amplitude has a kink at the end its way there counts.
  pure function speeds_of_supports(scene, dt, old, new) result(speed)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: dt                !! length of the increment [time]
    type(state_t), intent(in) :: old, new     !! before and after it
    real(wp) :: speed(3, scene%mesh%n_nodes)  !! [length/time]
    real(wp) :: time, short
    integer :: k, card

    associate (now => scene%steps(new%step))
      short = 0.5_wp*real(smallest_increment, wp)/real(whole_increment, wp)*now%period/ &
        now%n_increments
      time = real(new%position, wp)/real(whole_increment, wp)*now%period/now%n_increments
    end associate
    speed = 0.0_wp
    do k = 1, new%step
      if (scene%steps(k)%replace_boundary) speed = 0.0_wp
      do card = 1, size(scene%steps(k)%boundary)
        associate (of => scene%steps(k)%boundary(card))
          associate (here => speed(of%dof, of%node))
            here = 0.0_wp
            if (of%amplitude > 0) then
              if (k == new%step) here = of%value*slope(scene%amplitudes(of%amplitude))
              if (k < new%step .and. scene%amplitudes(of%amplitude)%total) here = of%value*slope( &
                scene%amplitudes(of%amplitude))
            else if (k == new%step .and. of%is_way .and. .not. of%fixed) then
              here = (new%displacement(of%dof, of%node) - old%displacement(of%dof, of%node))/dt
            end if
          end associate
        end associate
      end do
    end do

  contains

    pure real(wp) function slope(amplitude)
      type(amplitude_t), intent(in) :: amplitude

      slope = slope_before(amplitude, merge(start_of_step(scene%steps, new%step), 0.0_wp, &
        amplitude%total) + time, short)
    end function slope

  end function speeds_of_supports

  !> How steep an amplitude is at a time, by its way in a short time before.
  pure real(wp) function slope_before(amplitude, time, short) result(slope)
    type(amplitude_t), intent(in) :: amplitude
    real(wp), intent(in) :: time  !! of the run, or of the step
    real(wp), intent(in) :: short !! [time]
    type(amplitude_t) :: given

    if (amplitude%integrals == 0) then
      slope = slope_of_given(amplitude, time, short)
      return
    end if
    slope = 0.0_wp
    if (time - short < amplitude%begin) return
    given = amplitude
    given%integrals = amplitude%integrals - 1
    associate (last => min(time, amplitude%end))
      if (given%integrals == 1) then
        slope = amplitude%drift + amplitude_value(given, time)
      else
        ! From a place before a jump there.
        slope = amplitude_value(given, last - short) + short*slope_of_given(given, last - &
          0.5_wp*short, 0.5_wp*short)
      end if
    end associate
  end function slope_before

  !> The same of what the deck gives.
  pure real(wp) function slope_of_given(given, time, short) result(slope)
    type(amplitude_t), intent(in) :: given
    real(wp), intent(in) :: time, short
    real(wp) :: part, reach
    integer :: last, n, corner

    slope = 0.0_wp
    last = count(given%time <= time - short)
    n = size(given%time)
    if (last == 0) return
    if (allocated(given%cosine)) then
      do n = 1, size(given%cosine)
        associate (w => n*given%frequency)
          part = w*(time - given%time(1))
          slope = slope - w*given%cosine(n)*sin(part) + w*given%sine(n)*cos(part)
        end associate
      end do
      return
    end if
    if (last == n) return
    slope = between(last)
    if (given%is_smooth) then
      part = (time - given%time(last))/(given%time(last + 1) - given%time(last))
      slope = slope*part*part*(30.0_wp + part*(30.0_wp*part - 60.0_wp))
    end if
    if (.not. given%rounding > 0.0_wp) return
    ! Along a parabola the slope goes evenly from that before the corner to that behind it.
    do corner = max(2, last), min(n - 1, last + 1)
      reach = given%rounding*min(given%time(corner) - given%time(corner - 1), &
        given%time(corner + 1) - given%time(corner))
      if (abs(time - short - given%time(corner)) < reach) slope = 0.5_wp*(between(corner - 1) + &
        between(corner) + (between(corner) - between(corner - 1))*(time - given%time(corner))/reach)
    end do

  contains

    !> The slope of the straight line behind a point.
    pure real(wp) function between(k)
      integer, intent(in) :: k

      between = (given%value(k + 1) - given%value(k))/(given%time(k + 1) - given%time(k))
    end function between

  end function slope_of_given

end module support_speeds_mod
