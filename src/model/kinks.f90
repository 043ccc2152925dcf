!> Where the load path of a *STEP turns: the kinks and jumps of the amplitudes that it follows.
!>
!> An increment takes its loads in a straight line from its beginning to its end. One that goes
!> across a kink takes another way than the deck's, and friction remembers ways. A Fourier series
!> and a table with rounded corners have a kink wherever they turn round: between these they go one
!> way, and how fast is no matter.
!> docs/theory.md section 1.
module kinks_mod
  use kinds_mod, only: wp, i8
  use loads_mod, only: amplitude_t, load_step_t, amplitude_value, start_of_step
  use increments_mod, only: largest_length, rounded_up, smallest_increment, whole_increment
  implicit none
  private

  public :: find_kinks, find_jumps, used_amplitudes, followed_amplitudes, has_too_many, &
    most_touches, most_events, count_between

  integer,  parameter :: most_kinks = 10
  !! in an increment, on the average, unless the step asks for all of them
  integer,  parameter :: most_of_all = int(whole_increment/smallest_increment)
  !! in an increment: more cannot be ends of increments
  real(wp), parameter :: straight = 1.0e-9_wp    !! departure of a line's point, of its values [-]

contains

  !> The kinks of some amplitudes inside a step, in parts of the deck's increments: ascending, at
  !> least the smallest increment apart, and as far from the ends of the deck's increments. What is
  !> nearer to such an end is there if increments may grow past it, and else none.
  !>
  !> Points on the line through their neighbours are none. At a jump there are two: the smallest
  !> increment before it, as far as the way there goes, and the jump itself.
  !> A Fourier series has one where it begins, and one at each of its extremes.
  pure subroutine find_kinks(amplitudes, step, kinks, step_start, missed)
    type(amplitude_t), intent(in) :: amplitudes(:)   !! that the step follows
    type(load_step_t), intent(in) :: step
    integer(i8), allocatable, intent(out) :: kinks(:) !! (n)
    real(wp), intent(in), optional :: step_start     !! time of the run; 0 if left out
    real(wp), intent(out), optional :: missed
    !! how far an amplitude goes at most, between ends that increments could have, beyond what it
    !! is at these, as a part of its range: turns that are too near to each other [-]
    integer(i8), allocatable :: positions(:)
    integer(i8) :: position
    real(wp), allocatable :: times(:) !! of the step
    real(wp) :: least !! departure from a line that counts
    real(wp) :: begin !! of the amplitude's time, in that of the step
    real(wp) :: time  !! of the step
    integer :: k, i, n

    allocate (positions(0), times(0))
    do k = 1, size(amplitudes)
      associate (a => amplitudes(k))
        begin = 0.0_wp
        if (present(step_start) .and. a%total) begin = -step_start
        if (allocated(a%cosine)) then
          times = extremes(a, begin, step)
          positions = [positions, [(position_of(step, times(i)), i=1, size(times))]]
        end if
        n = size(positions)
        positions = [positions, spread(0_i8, 1, 2*size(a%time))]
        least = straight*maxval(abs(a%value))
        do i = 1, size(a%time)
          time = turn_beside(a, i) + begin
          if (time <= 0.0_wp .or. time > step%period) cycle
          if (jumps_at(a, i, least)) then
            position = position_of(step, time)
            ! At the jump itself the later value counts.
            do while (time_at(step, position) < time .and. modulo(position, &
              whole_increment) /= 0)
              position = position + 1
            end do
            positions(n + 1:n + 2) = [position - smallest_increment, position]
            n = n + 2
          else if (turns_at(a, i, least)) then
            n = n + 1
            positions(n) = position_of(step, time)
          end if
        end do
        positions = positions(:n)
      end associate
    end do
    call sort(positions)
    kinks = apart(positions, step)
    if (.not. present(missed)) return
    missed = 0.0_wp
    do k = 1, size(amplitudes)
      missed = max(missed, beyond_ends(amplitudes(k), step, positions, kinks, step_start))
    end do
  end subroutine find_kinks

  !> Where tables jump inside a step, or rise in less than the smallest increment: where increments
  !> end, and the time at which the jump is over.
  pure subroutine find_jumps(amplitudes, step, step_start, jumps, over)
    type(amplitude_t), intent(in) :: amplitudes(:)    !! that the step follows
    type(load_step_t), intent(in) :: step
    real(wp), intent(in) :: step_start                !! time of the run
    integer(i8), allocatable, intent(out) :: jumps(:) !! (n) in parts of the deck's increments
    real(wp), allocatable, intent(out) :: over(:)     !! (n) of the step [time]
    real(wp) :: begin, shortest
    integer :: k, i

    allocate (jumps(0), over(0))
    shortest = step%period/step%n_increments*real(smallest_increment, wp)/real(whole_increment, wp)
    do k = 1, size(amplitudes)
      associate (a => amplitudes(k))
        begin = merge(-step_start, 0.0_wp, a%total)
        do i = 1, size(a%time)
          if (allocated(a%cosine)) then
            ! Where a series begins; its value there is behind the jump, but of its integral.
            if (a%integrals == 0 .or. .not. jumps_at(a, i, 0.0_wp)) cycle
          else
            if (i == 1) cycle
            if (a%time(i) - a%time(i - 1) > shortest) cycle
            if (.not. abs(a%value(i) - a%value(i - 1)) > straight*maxval(abs(a%value))) cycle
          end if
          associate (at => a%time(max(1, i - 1)) + begin)
            if (at < shortest .or. at > step%period - shortest) cycle
            jumps = [jumps, position_of(step, at)]
            over = [over, a%time(i) + begin]
          end associate
        end do
      end associate
    end do
  end subroutine find_jumps

  !> The times of a step at which a Fourier series turns round: where its derivative
  !>
  !>     sum over n of n frequency (sine(n) cos(n angle) - cosine(n) sin(n angle))
  !>
  !> changes its sign; no more of them than increments could end at.
  pure function extremes(a, begin, step) result(times)
    type(amplitude_t), intent(in) :: a
    real(wp), intent(in) :: begin !! of its time, in that of the step
    type(load_step_t), intent(in) :: step
    real(wp), allocatable :: times(:)
    real(wp), parameter :: whole_turn = 2.0_wp*acos(-1.0_wp)
    integer, parameter :: samples = 8 !! in a period of the shortest term; it turns twice
    integer, parameter :: halvings = 40
    real(wp), allocatable :: angles(:)
    real(wp) :: before, here, low, high, of_low, of_high
    integer :: n_terms, n, i, k, first, last

    allocate (times(0), angles(0))
    n_terms = findloc(abs(a%cosine) + abs(a%sine) > 0.0_wp, .true., dim=1, back=.true.)
    if (n_terms == 0 .or. .not. a%frequency > 0.0_wp) return
    n = samples*n_terms
    ! Samples off the places where plain sines and cosines turn.
    before = 0.1234567_wp*whole_turn/n
    of_low = slope(before)
    do i = 1, n
      here = before + whole_turn/n
      of_high = slope(here)
      if (of_low*of_high < 0.0_wp) then
        low = before
        high = here
        do k = 1, halvings
          if (slope(0.5_wp*(low + high))*of_low > 0.0_wp) then
            low = 0.5_wp*(low + high)
          else
            high = 0.5_wp*(low + high)
          end if
        end do
        angles = [angles, 0.5_wp*(low + high)]
      end if
      before = here
      if (abs(of_high) > 0.0_wp) of_low = of_high
    end do
    if (size(angles) == 0) return
    associate (origin => a%time(1) + begin, period => whole_turn/a%frequency)
      first = max(0, floor(min(-origin/period, 1.0e9_wp)) - 1)
      last = first + int(min((step%period - max(origin, 0.0_wp))/period + 2.0_wp, &
        2.0_wp + real(most_of_all, wp)*step%n_increments/size(angles)))
      times = [(origin + period*(i + angles/whole_turn), i=first, last)]
    end associate
    times = pack(times, times > 0.0_wp .and. times <= step%period)

  contains

    !> A multiple of the derivative.
    pure real(wp) function slope(angle)
      real(wp), intent(in) :: angle
      complex(wp) :: turn, power
      integer :: j

      turn = cmplx(cos(angle), sin(angle), wp)
      power = 1.0_wp
      slope = 0.0_wp
      do j = 1, n_terms
        power = power*turn
        slope = slope + j*(a%sine(j)*real(power, wp) - a%cosine(j)*aimag(power))
      end do
    end function slope

  end function extremes

  !> How far an amplitude goes, at places that are no ends of increments, beyond what it is at the
  !> ends about them, as a part of its range.
  pure real(wp) function beyond_ends(a, step, positions, kinks, step_start) result(beyond)
    type(amplitude_t), intent(in) :: a
    type(load_step_t), intent(in) :: step
    integer(i8), intent(in) :: positions(:) !! ascending
    integer(i8), intent(in) :: kinks(:)     !! those of them at which increments end
    real(wp), intent(in), optional :: step_start
    integer(i8) :: first, last
    real(wp) :: one, other, here, low, high
    integer :: i, k

    beyond = 0.0_wp
    low = huge(1.0_wp)
    high = -huge(1.0_wp)
    k = 0
    do i = 1, size(positions)
      do while (k < size(kinks))
        if (kinks(k + 1) > positions(i)) exit
        k = k + 1
      end do
      first = positions(i) - modulo(positions(i), whole_increment)
      last = min(first + whole_increment, end_of(step))
      if (k > 0) first = max(first, kinks(k))
      if (k < size(kinks)) last = min(last, kinks(k + 1))
      one = value_at(first)
      other = value_at(last)
      here = value_at(positions(i))
      low = min(low, one, other, here)
      high = max(high, one, other, here)
      beyond = max(beyond, here - max(one, other), min(one, other) - here)
    end do
    if (high > low) beyond = beyond/(high - low)

  contains

    pure real(wp) function value_at(position)
      integer(i8), intent(in) :: position

      value_at = amplitude_value(a, time_at(step, position), step_start)
    end function value_at

  end function beyond_ends

  !> Of the scene's amplitudes those that a step's cards name.
  pure function used_amplitudes(amplitudes, step) result(is_used)
    type(amplitude_t), intent(in) :: amplitudes(:)
    type(load_step_t), intent(in) :: step
    logical :: is_used(size(amplitudes))
    integer :: k

    do k = 1, size(amplitudes)
      is_used(k) = any(step%boundary%amplitude == k .and. abs(step%boundary%value) > 0.0_wp) .or. &
        any(step%forces%amplitude == k .and. abs(step%forces%value) > 0.0_wp) .or. &
        any(step%pressures%amplitude == k .and. abs(step%pressures%value) > 0.0_wp) .or. &
        any(step%face_pressures%amplitude == k .and. &
            abs(step%face_pressures%value) > 0.0_wp) .or. &
        any(step%gravity%amplitude == k)
      if (allocated(step%temperatures)) is_used(k) = is_used(k) .or. &
        any(step%temperatures%amplitude == k)
      if (allocated(step%interferences)) is_used(k) = is_used(k) .or. any( &
        step%interferences%amplitude == k .and. abs(step%interferences%value) > 0.0_wp)
      if (.not. allocated(step%rotations)) cycle
      is_used(k) = is_used(k) .or. any(step%rotations%amplitude == k .and. &
        abs(step%rotations%value) > 0.0_wp)
    end do
  end function used_amplitudes

  !> Of the scene's amplitudes those that a step follows: what its cards name, and what an earlier
  !> step has named over the time of the run.
  pure function followed_amplitudes(amplitudes, steps, step) result(is_followed)
    type(amplitude_t), intent(in) :: amplitudes(:)
    type(load_step_t), intent(in) :: steps(:)
    integer, intent(in) :: step
    logical :: is_followed(size(amplitudes))
    integer :: k

    is_followed = used_amplitudes(amplitudes, steps(step))
    do k = 1, step - 1
      is_followed = is_followed .or. (amplitudes%total .and. used_amplitudes(amplitudes, steps(k)))
    end do
  end function followed_amplitudes

  !> Whether a step has so many kinks that its increments do not end at them.
  pure logical function has_too_many(kinks, step)
    integer(i8), intent(in) :: kinks(:)
    type(load_step_t), intent(in) :: step

    has_too_many = count(.not. is_near_end(kinks), kind=i8) > int(most_kinks, i8)* &
      step%n_increments .and. .not. step%ends_at_all_kinks
  end function has_too_many

  !> At how many instants within a step contact may begin so that an increment ends there: one from
  !> each kink to the next.
  pure integer function most_touches(kinks, step)
    integer(i8), intent(in) :: kinks(:)
    type(load_step_t), intent(in) :: step

    most_touches = 1
    if (.not. has_too_many(kinks, step)) most_touches = size(kinks) + 1
  end function most_touches

  !> How many increments at most end at events of a step, beside the deck's.
  pure integer function most_events(amplitudes, steps, step, has_contact)
    type(amplitude_t), intent(in) :: amplitudes(:) !! of the scene
    type(load_step_t), intent(in) :: steps(:)
    integer, intent(in) :: step
    logical, intent(in) :: has_contact
    integer(i8), allocatable :: kinks(:)
    real(wp), allocatable :: over(:)

    most_events = 0
    if (steps(step)%direct) return
    if (steps(step)%is_dynamic) then
      call find_jumps(pack(amplitudes, followed_amplitudes(amplitudes, steps, step)), &
        steps(step), start_of_step(steps, step), kinks, over)
      most_events = size(kinks)
      return
    end if
    call find_kinks(pack(amplitudes, followed_amplitudes(amplitudes, steps, step)), steps(step), &
      kinks, start_of_step(steps, step))
    if (.not. has_too_many(kinks, steps(step))) most_events = count(.not. is_near_end(kinks))
    if (has_contact) most_events = most_events + most_touches(kinks, steps(step))
  end function most_events

  !> How many of ascending positions are after `first` and before `last`.
  pure integer function count_between(positions, first, last) result(n)
    integer(i8), intent(in) :: positions(:)
    integer(i8), intent(in) :: first, last

    n = count(positions > first .and. positions < last)
  end function count_between

  !> Whether the last of several points at one time is point i, and their values differ.
  pure logical function jumps_at(a, i, least)
    type(amplitude_t), intent(in) :: a
    integer, intent(in) :: i
    real(wp), intent(in) :: least
    integer :: first

    jumps_at = .false.
    if (allocated(a%cosine)) then
      jumps_at = abs(sum(a%cosine)) > straight*sum(abs(a%cosine))
      return
    end if
    if (i == 1) return
    if (i < size(a%time)) then
      if (a%time(i + 1) <= a%time(i)) return
    end if
    first = i
    do while (first > 1)
      if (a%time(first - 1) < a%time(i)) exit
      first = first - 1
    end do
    jumps_at = abs(a%value(i) - a%value(first)) > least
  end function jumps_at

  !> Whether point i is off the line through its neighbours; outside its points an amplitude is
  !> constant.
  pure logical function turns_at(a, i, least)
    type(amplitude_t), intent(in) :: a
    integer, intent(in) :: i
    real(wp), intent(in) :: least
    real(wp) :: chord, fraction
    integer :: before, after

    turns_at = allocated(a%cosine)
    if (turns_at) return
    before = i
    do while (before > 1 .and. a%time(before) >= a%time(i))
      before = before - 1
    end do
    after = min(i + 1, size(a%time))
    ! Of several points at one time the last counts.
    if (after > i .and. a%time(after) <= a%time(i)) return
    if (after == i) then
      chord = a%value(before)
    else if (a%time(before) >= a%time(i)) then
      chord = a%value(after)
    else
      fraction = (a%time(i) - a%time(before))/(a%time(after) - a%time(before))
      chord = (1.0_wp - fraction)*a%value(before) + fraction*a%value(after)
    end if
    turns_at = abs(a%value(i) - chord) > least
  end function turns_at

  !> The time of point i, or where the parabola there turns round: between straight lines up and
  !> down it does so beside the point, on the side of the line that is less steep.
  pure real(wp) function turn_beside(a, i) result(time)
    type(amplitude_t), intent(in) :: a
    integer, intent(in) :: i
    real(wp) :: slope(2), reach

    time = a%time(i)
    if (.not. a%rounding > 0.0_wp .or. i == 1 .or. i == size(a%time)) return
    associate (t => a%time(i - 1:i + 1), v => a%value(i - 1:i + 1))
      reach = a%rounding*min(t(2) - t(1), t(3) - t(2))
      if (.not. reach > 0.0_wp) return
      slope = [(v(2) - v(1))/(t(2) - t(1)), (v(3) - v(2))/(t(3) - t(2))]
    end associate
    if (slope(1)*slope(2) < 0.0_wp) time = time + reach*sum(slope)/(slope(1) - slope(2))
  end function turn_beside

  !> The nearest position to a time of the step.
  pure integer(i8) function position_of(step, time)
    type(load_step_t), intent(in) :: step
    real(wp), intent(in) :: time   !! 0 to the period

    position_of = min(end_of(step), nint(time/step%period*real(end_of(step), wp), i8))
  end function position_of

  !> The time of the step at a position.
  pure real(wp) function time_at(step, position)
    type(load_step_t), intent(in) :: step
    integer(i8), intent(in) :: position

    time_at = real(position, wp)/real(end_of(step), wp)*step%period
  end function time_at

  !> Where the step ends.
  pure integer(i8) function end_of(step)
    type(load_step_t), intent(in) :: step

    end_of = step%n_increments*whole_increment
  end function end_of

  !> Those of sorted positions that make no increment shorter than the smallest.
  pure function apart(positions, step) result(kept)
    integer(i8), intent(in) :: positions(:)
    type(load_step_t), intent(in) :: step
    integer(i8), allocatable :: kept(:)
    integer(i8) :: here, last
    logical :: may_pass !! increments may go past ends of the deck's
    integer :: i, n

    may_pass = largest_length(step) > whole_increment
    allocate (kept(size(positions)))
    last = 0
    n = 0
    do i = 1, size(positions)
      here = positions(i)
      if (is_near_end(here)) then
        if (.not. may_pass) cycle
        here = rounded_up(here - smallest_increment)
      end if
      if (here - last < smallest_increment .or. here >= end_of(step)) cycle
      n = n + 1
      kept(n) = here
      last = here
    end do
    kept = kept(:n)
  end function apart

  !> Whether a position is nearer to an end of the deck's increments than the smallest increment.
  elemental logical function is_near_end(position)
    integer(i8), intent(in) :: position

    associate (from_end => modulo(position, whole_increment))
      is_near_end = min(from_end, whole_increment - from_end) < smallest_increment
    end associate
  end function is_near_end

  !> Shell's sort: amplitudes come sorted but for being several.
  pure subroutine sort(list)
    integer(i8), intent(inout) :: list(:)
    integer(i8) :: value
    integer :: gap, i, j

    gap = size(list)/2
    do while (gap > 0)
      do i = gap + 1, size(list)
        value = list(i)
        j = i
        do while (j > gap)
          if (list(j - gap) <= value) exit
          list(j) = list(j - gap)
          j = j - gap
        end do
        list(j) = value
      end do
      gap = gap/2
    end do
  end subroutine sort

end module kinks_mod
