!> What the deck prescribes over its steps: displacements, forces, pressures, amplitudes.
module loads_mod
  use friction_laws_mod, only: friction_law_t
  use kinds_mod, only: wp
  implicit none
  private

  public :: amplitude_t, nodal_value_t, pressure_t, gravity_t, interference_t, friction_t, &
    pair_change_t, load_step_t, following_t, amplitude_value, amplitude_rate, amplitude_range, &
    start_of_step

  !> Values over time: a table, linear between its points and constant outside; or a Fourier series
  !>
  !>     value(1) + sum over n of cosine(n) cos(n frequency s) + sine(n) sin(n frequency s),
  !>
  !> s = time - time(1), from time(1) on, and value(1) before.
  type :: amplitude_t
    character(:), allocatable :: name
    real(wp), allocatable :: time(:)   !! ascending; of a series where it begins
    real(wp), allocatable :: value(:)  !! the same number; of a series what it begins with
    logical  :: total = .false.        !! over the time of the run, not of each step
    real(wp) :: frequency = 0.0_wp     !! of a series, circular [rad/time]
    logical  :: is_smooth = .false. !! SMOOTH STEP: between points in a curve that is level at them
    real(wp) :: rounding = 0.0_wp
    !! of a table: corners are parabolas, as far as this part of the shorter interval beside each
    real(wp), allocatable :: cosine(:), sine(:) !! (n) of a series; not allocated: a table
    ! Of prescribed velocities and accelerations:
    integer  :: integrals = 0        !! over time, 1 or 2, that make the value; 0: none
    real(wp) :: begin = 0.0_wp       !! where they begin
    real(wp) :: end = huge(1.0_wp)   !! behind which the integrand is what it is there
    real(wp) :: drift = 0.0_wp       !! rate of the value at their beginning, if they are 2 [1/time]
    real(wp) :: horizon = 0.0_wp     !! of the run: no later time is asked for
  end type amplitude_t

  !> A displacement or a force of one degree of freedom.
  type :: nodal_value_t
    integer  :: node = 0            !! node number
    integer  :: dof = 0             !! 1, 2, 3
    real(wp) :: value = 0.0_wp      !! at the end of the step, or times the amplitude
    integer  :: amplitude = 0 !! index into the scene's amplitudes; 0: ramp from the last value
    logical  :: fixed = .false. !! of a displacement: it stays what it is as the step begins
    logical  :: is_way = .false. !! of a displacement: a dynamic step takes it there evenly, too
    integer  :: rate = 0
    !! as the deck is read: the value is a velocity, 1, or an acceleration, 2, of a displacement
    real(wp) :: from = 0.0_wp !! of a displacement with an amplitude: what that is added to
  end type nodal_value_t

  !> A pressure on a surface of faces, positive into the body.
  type :: pressure_t
    integer  :: surface = 0         !! index into the scene's surfaces
    real(wp) :: value = 0.0_wp      !! [force/length^2]
    integer  :: amplitude = 0       !! as above
  end type pressure_t

  !> The weight of some elements: density times acceleration a unit of volume, at x in the mesh
  !> acceleration + gradient x.
  type :: gravity_t
    integer  :: region = 0               !! index into the scene's regions
    real(wp) :: acceleration(3) = 0.0_wp !! [length/time^2]
    integer  :: amplitude = 0            !! as above
    real(wp) :: gradient(3, 3) = 0.0_wp  !! [1/time^2]
  end type gravity_t

  !> *CONTACT INTERFERENCE: how far the points of a pair may overlap.
  type :: interference_t
    integer  :: pair = 0             !! index into the scene's pairs
    real(wp) :: value = 0.0_wp       !! times the amplitude [length]
    integer  :: amplitude = 0
    !! index into the scene's amplitudes; 0: from 1 at the beginning of the step to 0 at its end
    logical  :: shrinks = .false.    !! in place of the value each point has its overlap of the mesh
  end type interference_t

  !> *CHANGE FRICTION: the coefficient of a pair from the beginning of the step on.
  type :: friction_t
    integer  :: pair = 0         !! index into the scene's pairs
    real(wp) :: mu = 0.0_wp      !! the largest coefficient [-]
    type(friction_law_t) :: law = friction_law_t() !! what pressure makes of it
  end type friction_t

  !> *MODEL CHANGE, TYPE=CONTACT PAIR: whether there is a pair from the beginning of the step on.
  type :: pair_change_t
    integer :: pair = 0              !! index into the scene's pairs
    logical :: is_removed = .false.  !! else it is added again
  end type pair_change_t

  !> One *STEP: its increments, and what it changes. What it does not name stays as it was.
  type :: load_step_t
    real(wp) :: period = 1.0_wp
    real(wp) :: increment = 1.0_wp
    integer  :: n_increments = 1
    real(wp) :: largest = huge(1.0_wp)          !! increment that they grow to, without DIRECT
    real(wp) :: smallest = 0.0_wp
    !! that those of a dynamic step are cut to for their error in time; 0: the program's own
    logical  :: direct = .false.                !! keep the increments as they are
    logical  :: is_dynamic = .false. !! *DYNAMIC: inertia counts, and loads without amplitude jump
    real(wp) :: alpha = 0.0_wp       !! of the scheme of a dynamic step, -1/2 to 0 [-]
    logical  :: ends_at_all_kinks = .false.     !! increments do, however many there are
    logical  :: replace_boundary = .false.      !! OP=NEW: earlier ones end here, rotations too
    logical  :: replace_forces = .false.
    logical  :: replace_pressures = .false.
    logical  :: replace_element_loads = .false. !! OP=NEW of *DLOAD
    logical  :: replace_temperatures = .false.  !! OP=NEW: others go back to the first ones
    type(nodal_value_t), allocatable :: boundary(:)  !! of one node and dof the last counts
    type(nodal_value_t), allocatable :: rotations(:)
    !! of reference nodes: dof 1, 2, 3 are the components of a rotation vector [rad]
    type(nodal_value_t), allocatable :: forces(:)    !! of one node and dof they add up
    type(pressure_t),    allocatable :: pressures(:) !! *DSLOAD; of one surface they add up
    type(pressure_t),    allocatable :: face_pressures(:) !! *DLOAD P1..P6; they add up as well
    type(gravity_t),     allocatable :: gravity(:)   !! *DLOAD GRAV, CENTRIF; likewise
    type(nodal_value_t), allocatable :: temperatures(:)
    !! of one node the last counts; dof is 1; not allocated: none
    logical :: replace_interferences = .false.       !! OP=NEW of *CONTACT INTERFERENCE
    type(interference_t), allocatable :: interferences(:) !! one a pair; not allocated: none
    type(friction_t), allocatable :: frictions(:) !! one a pair; not allocated: none
    type(pair_change_t), allocatable :: pair_changes(:) !! the same
  end type load_step_t

  !> Loads that change with where bodies are.
  type :: following_t
    real(wp), allocatable :: pressure(:)
    !! (n_surfaces) on surfaces where they are now [force/length^2]
    real(wp), allocatable :: gradient(:, :, :)
    !! (3,3,n_regions) what the acceleration grows by with the displacement [1/time^2]
  end type following_t

contains

  !> The time of the run at which a step begins.
  pure real(wp) function start_of_step(steps, step) result(start)
    type(load_step_t), intent(in) :: steps(:)
    integer, intent(in) :: step

    start = sum(steps(:step - 1)%period)
  end function start_of_step

  !> The value of `amplitude` at a time of a step.
  pure real(wp) function amplitude_value(amplitude, step_time, step_start) result(value)
    type(amplitude_t), intent(in) :: amplitude
    real(wp), intent(in) :: step_time            !! from the start of the step
    real(wp), intent(in), optional :: step_start !! where the step begins; 0 if left out
    real(wp) :: time

    time = step_time
    if (present(step_start) .and. amplitude%total) time = step_start + step_time
    if (amplitude%integrals == 0) then
      value = given_value(amplitude, time)
    else
      value = integral(amplitude, amplitude%integrals, time)
      if (amplitude%integrals == 2) value = value + amplitude%drift*max(0.0_wp, time - &
        amplitude%begin)
    end if
  end function amplitude_value

  !> A derivative of `amplitude` over time, of the piece that another time is in: at a point of a
  !> table there are two.
  pure real(wp) function amplitude_rate(amplitude, order, step_time, inside, step_start) &
    result(rate)
    type(amplitude_t), intent(in) :: amplitude
    integer, intent(in) :: order                 !! 1 or 2
    real(wp), intent(in) :: step_time, inside    !! from the start of the step; the other time
    real(wp), intent(in) :: step_start           !! where the step begins
    real(wp) :: start, time

    start = merge(step_start, 0.0_wp, amplitude%total)
    time = start + step_time
    rate = 0.0_wp
    associate (left => order - amplitude%integrals, piece => start + inside)
      if (amplitude%integrals > 0 .and. piece < amplitude%begin) return
      if (left < 0) then
        rate = amplitude%drift + integral(amplitude, 1, time)
      else if (left == 0) then
        rate = given_value(amplitude, min(time, amplitude%end), min(piece, amplitude%end))
      else if (piece <= amplitude%end) then
        rate = given_rate(amplitude, left, time, piece)
      end if
    end associate
  end function amplitude_rate

  !> What the deck gives at a time, by the piece of a table that another time is in, or this.
  pure real(wp) function given_value(amplitude, time, inside) result(value)
    type(amplitude_t), intent(in) :: amplitude
    real(wp), intent(in) :: time
    real(wp), intent(in), optional :: inside
    real(wp) :: angle
    integer :: i

    if (allocated(amplitude%cosine)) then
      value = amplitude%value(1)
      if (time < amplitude%time(1)) return
      angle = amplitude%frequency*(time - amplitude%time(1))
      do i = 1, size(amplitude%cosine)
        value = value + amplitude%cosine(i)*cos(i*angle) + amplitude%sine(i)*sin(i*angle)
      end do
      return
    end if
    if (present(inside)) then
      value = value_between(amplitude, piece_of(amplitude, inside), time)
    else
      value = value_between(amplitude, piece_of(amplitude, time), time)
    end if
  end function given_value

  !> The first or the second derivative of that.
  pure real(wp) function given_rate(amplitude, order, time, inside) result(rate)
    type(amplitude_t), intent(in) :: amplitude
    integer, intent(in) :: order
    real(wp), intent(in) :: time, inside
    real(wp) :: part, length
    integer :: i

    rate = 0.0_wp
    if (allocated(amplitude%cosine)) then
      if (inside < amplitude%time(1)) return
      do i = 1, size(amplitude%cosine)
        associate (w => i*amplitude%frequency, c => amplitude%cosine(i), s => amplitude%sine(i))
          associate (angle => w*(time - amplitude%time(1)))
            rate = rate + merge(w*(s*cos(angle) - c*sin(angle)), -w**2*(c*cos(angle) + &
              s*sin(angle)), order == 1)
          end associate
        end associate
      end do
      return
    end if
    i = piece_of(amplitude, inside)
    if (i == 0 .or. i == size(amplitude%time)) return
    length = amplitude%time(i + 1) - amplitude%time(i)
    associate (rise => amplitude%value(i + 1) - amplitude%value(i))
      if (amplitude%is_smooth) then
        part = (time - amplitude%time(i))/length
        rate = merge(30.0_wp*(part*(1.0_wp - part))**2*rise/length, 60.0_wp*part*(1.0_wp - part)* &
          (1.0_wp - 2.0_wp*part)*rise/length**2, order == 1)
      else if (order == 1) then
        rate = rise/length
      end if
    end associate
    call add_corner(i, 1.0_wp)
    call add_corner(i + 1, -1.0_wp)

  contains

    !> What the parabola at point `k` adds, of the piece behind it, 1, or before it, -1.
    pure subroutine add_corner(k, side)
      integer, intent(in) :: k
      real(wp), intent(in) :: side
      real(wp) :: reach, bend

      reach = reach_of_corner(amplitude, k)
      if (.not. reach > 0.0_wp .or. abs(inside - amplitude%time(k)) >= reach) return
      bend = bend_of_corner(amplitude, k)
      rate = rate + merge(0.5_wp*bend*(time - amplitude%time(k) - side*reach), 0.5_wp*bend, &
        order == 1)/reach
    end subroutine add_corner

  end function given_rate

  !> The last point of a table that is not behind a time, and before it of the first; 0: none.
  pure integer function piece_of(amplitude, time) result(piece)
    type(amplitude_t), intent(in) :: amplitude
    real(wp), intent(in) :: time

    do piece = 0, size(amplitude%time) - 1
      if (time < amplitude%time(piece + 1) .or. (piece == 0 .and. time <= amplitude%time(1))) return
    end do
  end function piece_of

  !> The value of a table between two of its points, or outside of all.
  pure real(wp) function value_between(amplitude, i, time) result(value)
    type(amplitude_t), intent(in) :: amplitude
    integer, intent(in) :: i                     !! the first of them; 0: before all
    real(wp), intent(in) :: time
    real(wp) :: fraction

    if (i == 0 .or. i == size(amplitude%time)) then
      value = amplitude%value(max(1, i))
      return
    end if
    fraction = (time - amplitude%time(i))/(amplitude%time(i + 1) - amplitude%time(i))
    if (amplitude%is_smooth) fraction = fraction**3*(10.0_wp + fraction*(-15.0_wp + &
      6.0_wp*fraction))
    value = (1.0_wp - fraction)*amplitude%value(i) + fraction*amplitude%value(i + 1)
    value = value + rounded(i) + rounded(i + 1)

  contains

    !> What the parabola at point `k` adds to the straight lines beside it.
    pure real(wp) function rounded(k)
      integer, intent(in) :: k
      real(wp) :: reach

      rounded = 0.0_wp
      reach = reach_of_corner(amplitude, k)
      if (.not. reach > 0.0_wp .or. abs(time - amplitude%time(k)) >= reach) return
      rounded = bend_of_corner(amplitude, k)*(reach - abs(time - amplitude%time(k)))**2/ &
        (4.0_wp*reach)
    end function rounded

  end function value_between

  !> How far the parabola at a point of a table reaches on each side [time].
  pure real(wp) function reach_of_corner(amplitude, k) result(reach)
    type(amplitude_t), intent(in) :: amplitude
    integer, intent(in) :: k

    reach = 0.0_wp
    if (k > 1 .and. k < size(amplitude%time)) reach = amplitude%rounding*min(amplitude%time(k) - &
      amplitude%time(k - 1), amplitude%time(k + 1) - amplitude%time(k))
  end function reach_of_corner

  !> How much steeper a table is behind a point than before it [1/time].
  pure real(wp) function bend_of_corner(amplitude, k) result(bend)
    type(amplitude_t), intent(in) :: amplitude
    integer, intent(in) :: k !! not the first or the last

    associate (t => amplitude%time(k - 1:k + 1), v => amplitude%value(k - 1:k + 1))
      bend = (v(3) - v(2))/(t(3) - t(2)) - (v(2) - v(1))/(t(2) - t(1))
    end associate
  end function bend_of_corner

  !> What the deck gives, integrated `n` times from where that begins: int (time - s)^(n-1) ds of
  !> the value at s. Exact, of tables too: these are polynomials of degree 5 at most.
  pure real(wp) function integral(amplitude, n, time) result(value)
    type(amplitude_t), intent(in) :: amplitude
    integer, intent(in) :: n              !! 1 or 2
    real(wp), intent(in) :: time
    real(wp) :: start, stop, from
    integer :: i

    value = 0.0_wp
    start = amplitude%begin
    if (time <= start) return
    stop = min(time, amplitude%end)
    if (time > stop) value = given_value(amplitude, stop)*(time - stop)**n/n
    if (allocated(amplitude%cosine)) then
      value = value + amplitude%value(1)*((time - start)**n - (time - stop)**n)/n
      from = max(start, amplitude%time(1))
      if (stop > from) value = value + of_series(stop) - of_series(from)
      return
    end if
    from = start
    associate (t => amplitude%time)
      do i = 0, size(t)
        if (i > 0) call add_piece(i, t(i) + reach_of_corner(amplitude, i), &
          from, value)
        if (i == size(t)) then
          call add_piece(i, stop, from, value)
        else
          call add_piece(i, t(i + 1) - reach_of_corner(amplitude, i + 1), from, value)
          call add_piece(i, t(i + 1), from, value)
        end if
      end do
    end associate

  contains

    !> From where the pieces before it end to a place between two points, by Gauss's formula.
    pure subroutine add_piece(i, to, from, sum)
      integer, intent(in) :: i
      real(wp), intent(in) :: to
      real(wp), intent(inout) :: from, sum
      real(wp), parameter :: place(4) = [-0.861136311594052575_wp, -0.339981043584856265_wp, &
        0.339981043584856265_wp, 0.861136311594052575_wp]
      real(wp), parameter :: weight(4) = [0.347854845137453857_wp, 0.652145154862546143_wp, &
        0.652145154862546143_wp, 0.347854845137453857_wp]
      real(wp) :: s
      integer :: g

      associate (length => min(to, stop) - from)
        if (.not. length > 0.0_wp) return
        do g = 1, 4
          s = from + 0.5_wp*length*(1.0_wp + place(g))
          sum = sum + 0.5_wp*length*weight(g)*value_between(amplitude, i, s)*(time - s)**(n - 1)
        end do
        from = min(to, stop)
      end associate
    end subroutine add_piece

    !> An antiderivative of what the terms of the series add, times (time - s)^(n-1), at s.
    pure real(wp) function of_series(s)
      real(wp), intent(in) :: s
      real(wp) :: angle, first, second
      integer :: k

      first = 0.0_wp
      second = 0.0_wp
      do k = 1, size(amplitude%cosine)
        associate (w => k*amplitude%frequency)
          angle = w*(s - amplitude%time(1))
          first = first + (amplitude%cosine(k)*sin(angle) - amplitude%sine(k)*cos(angle))/w
          second = second - (amplitude%cosine(k)*cos(angle) + amplitude%sine(k)*sin(angle))/w**2
        end associate
      end do
      of_series = first
      if (n == 2) of_series = (time - s)*first + second
    end function of_series

  end function integral

  !> Bounds of the values of `amplitude`: of a table the least and the largest.
  pure function amplitude_range(amplitude) result(bounds)
    type(amplitude_t), intent(in) :: amplitude
    real(wp) :: bounds(2)
    integer, parameter :: n = 1000 !! places at which an integral is looked at
    real(wp) :: swing, values(0:n)
    integer :: i

    if (amplitude%integrals > 0) then
      values = [(amplitude_value(amplitude, amplitude%begin + i*(amplitude%horizon - &
        amplitude%begin)/n), i=0, n)]
      swing = maxval(abs(values(1:) - values(:n - 1)))
      bounds = [minval(values), maxval(values)] + [-swing, swing]
      return
    end if
    bounds = [minval(amplitude%value), maxval(amplitude%value)]
    if (.not. allocated(amplitude%cosine)) return
    swing = sum(hypot(amplitude%cosine, amplitude%sine))
    bounds = bounds + [-swing, swing]
  end function amplitude_range

end module loads_mod
