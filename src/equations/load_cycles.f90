!> Load cycles: where a deck prescribes the same path of loads again and again.
!>
!> Either within a *STEP, by amplitudes; or in *STEPs that repeat, one by one or several in turn.
!> docs/theory.md section 1.
module load_cycles_mod
  use friction_laws_mod, only: are_same_laws
  use kinds_mod, only: wp, i8
  use loads_mod, only: amplitude_t, nodal_value_t, pressure_t, load_step_t, amplitude_value
  use kinks_mod, only: followed_amplitudes, has_too_many
  use increments_mod, only: whole_increment, smallest_increment
  use scene_mod, only: scene_t
  use step_loads_mod, only: step_loads_t, ramps
  implicit none
  private

  public :: load_cycles_t, cycles_of_step, cycles_done

  integer, parameter :: least = 3 !! cycles that are some: fewer are over when they are compared
  real(wp), parameter :: rounded = 1.0e-9_wp !! of decimal times and values, relative [-]
  real(wp), parameter :: bent = 1.0e-6_wp !! of values at kinks, whose places are rounded [-]

  !> Equal cycles in a row. Ends are counted in the deck's increments, over the run.
  type :: load_cycles_t
    integer :: first = 0  !! where the first of them begins
    integer :: length = 0 !! of a cycle; 0: there are none
    integer :: last = 0   !! up to where the loads go on in this way, perhaps within a cycle
  end type load_cycles_t

contains

  !> The cycles that a *STEP is part of, or has.
  pure type(load_cycles_t) function cycles_of_step(scene, step, loads) result(cycles)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    type(step_loads_t), intent(in) :: loads !! of the step

    cycles = equal_steps(scene, step)
    if (cycles%length == 0) cycles = cycles_within(scene, step, loads)
  end function cycles_of_step

  !> How many cycles end with an increment of the deck that is done; -1: none does.
  pure integer function cycles_done(cycles, done)
    type(load_cycles_t), intent(in) :: cycles
    integer, intent(in) :: done !! increments of the deck, over the run

    cycles_done = -1
    if (cycles%length == 0 .or. done < cycles%first .or. done > cycles%last) return
    if (mod(done - cycles%first, cycles%length) == 0) cycles_done = &
      (done - cycles%first)/cycles%length
  end function cycles_done

  !> *STEPs with equal cards, in turn. The first cycle may begin with other loads than those that
  !> follow, which begin where it ends: it is left out.
  pure type(load_cycles_t) function equal_steps(scene, step) result(cycles)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    integer :: from, period, last

    from = 1
    runs: do while (from <= step)
      do period = 1, (size(scene%steps) - from + 1)/least
        last = from + period - 1
        do while (last < size(scene%steps))
          if (.not. repeats(scene, last + 1 - period, last + 1)) exit
          last = last + 1
        end do
        if (last - from + 1 < least*period) cycle
        if (step > last) then
          from = last + 1
          cycle runs
        end if
        cycles%length = sum(scene%steps(from:from + period - 1)%n_increments)
        cycles%first = sum(scene%steps(:from - 1)%n_increments) + cycles%length
        cycles%last = sum(scene%steps(:last)%n_increments)
        return
      end do
      from = from + 1
    end do runs
  end function equal_steps

  !> Whether one *STEP is another one again, by its cards.
  pure logical function repeats(scene, one, other)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: one, other

    associate (a => scene%steps(one), b => scene%steps(other))
      repeats = a%n_increments == b%n_increments .and. (a%direct .eqv. b%direct) .and. &
        .not. abs(a%period - b%period) > 0.0_wp .and. &
        (a%replace_boundary .eqv. b%replace_boundary) .and. &
        (a%replace_forces .eqv. b%replace_forces) .and. &
        (a%replace_pressures .eqv. b%replace_pressures) .and. &
        (a%replace_element_loads .eqv. b%replace_element_loads) .and. &
        (a%replace_temperatures .eqv. b%replace_temperatures) .and. &
        (a%replace_interferences .eqv. b%replace_interferences)
      if (repeats) repeats = same_values(a%boundary, b%boundary) .and. &
        same_values(a%rotations, b%rotations) .and. same_values(a%forces, b%forces) .and. &
        same_values(a%temperatures, b%temperatures) .and. &
        same_pressures(a%pressures, b%pressures) .and. &
        same_pressures(a%face_pressures, b%face_pressures) .and. same_gravity(a, b)
      if (repeats) repeats = same_contact(a, b)
      ! What follows the time of the run is not the same again.
      if (repeats) repeats = .not. any(scene%amplitudes%total .and. followed_amplitudes( &
        scene%amplitudes, scene%steps, other))
    end associate
  end function repeats

  pure logical function same_values(a, b) result(same)
    type(nodal_value_t), allocatable, intent(in) :: a(:), b(:)

    same = allocated(a) .eqv. allocated(b)
    if (.not. (same .and. allocated(a))) return
    same = size(a) == size(b)
    if (same) same = all(a%node == b%node .and. a%dof == b%dof .and. a%amplitude == b%amplitude &
      .and. (a%fixed .eqv. b%fixed) .and. .not. abs(a%value - b%value) > 0.0_wp)
  end function same_values

  pure logical function same_pressures(a, b) result(same)
    type(pressure_t), allocatable, intent(in) :: a(:), b(:)

    same = allocated(a) .eqv. allocated(b)
    if (.not. (same .and. allocated(a))) return
    same = size(a) == size(b)
    if (same) same = all(a%surface == b%surface .and. a%amplitude == b%amplitude .and. .not. &
      abs(a%value - b%value) > 0.0_wp)
  end function same_pressures

  pure logical function same_gravity(a, b) result(same)
    type(load_step_t), intent(in) :: a, b
    integer :: k

    same = allocated(a%gravity) .eqv. allocated(b%gravity)
    if (.not. (same .and. allocated(a%gravity))) return
    same = size(a%gravity) == size(b%gravity)
    if (same) same = all(a%gravity%region == b%gravity%region .and. a%gravity%amplitude == &
      b%gravity%amplitude)
    if (.not. same) return
    do k = 1, size(a%gravity)
      same = same .and. .not. (any(abs(a%gravity(k)%acceleration - b%gravity(k)%acceleration) > &
        0.0_wp) .or. any(abs(a%gravity(k)%gradient - b%gravity(k)%gradient) > 0.0_wp))
    end do
  end function same_gravity

  !> The same of what a *STEP says of pairs.
  pure logical function same_contact(a, b) result(same)
    type(load_step_t), intent(in) :: a, b

    same = (allocated(a%frictions) .eqv. allocated(b%frictions)) .and. &
      (allocated(a%pair_changes) .eqv. allocated(b%pair_changes)) .and. &
      (allocated(a%interferences) .eqv. allocated(b%interferences))
    if (same .and. allocated(a%frictions)) then
      same = size(a%frictions) == size(b%frictions)
      if (same) same = all(a%frictions%pair == b%frictions%pair .and. .not. &
        abs(a%frictions%mu - b%frictions%mu) > 0.0_wp)
      if (same) same = all(are_same_laws(a%frictions%law, b%frictions%law))
    end if
    if (same .and. allocated(a%pair_changes)) then
      same = size(a%pair_changes) == size(b%pair_changes)
      if (same) same = all(a%pair_changes%pair == b%pair_changes%pair .and. &
        (a%pair_changes%is_removed .eqv. b%pair_changes%is_removed))
    end if
    if (same .and. allocated(a%interferences)) then
      same = size(a%interferences) == size(b%interferences)
      if (same) same = all(a%interferences%pair == b%interferences%pair .and. &
        a%interferences%amplitude == b%interferences%amplitude .and. &
        (a%interferences%shrinks .eqv. b%interferences%shrinks) .and. .not. &
        abs(a%interferences%value - b%interferences%value) > 0.0_wp)
    end if
  end function same_contact

  !> Cycles of the amplitudes that a *STEP follows, to its end, where nothing ramps beside them: the
  !> shortest, from as early as it goes.
  pure type(load_cycles_t) function cycles_within(scene, step, loads) result(cycles)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    type(step_loads_t), intent(in) :: loads !! of the step
    type(amplitude_t), allocatable :: followed(:)
    real(wp), allocatable :: paths(:, :) !! (values,n_increments) [-]
    real(wp), allocatable :: largest(:)  !! (n_followed) values
    integer :: n, period, from

    associate (this => scene%steps(step))
      n = this%n_increments
      if (n < least .or. ramps(loads) .or. has_too_many(loads%kinks, this)) return
      if (allocated(this%interferences)) then
        if (any(this%interferences%amplitude == 0)) return
      end if
      followed = pack(scene%amplitudes, followed_amplitudes(scene%amplitudes, scene%steps, step))
      if (size(followed) == 0) return
      call follow_paths(followed, this, loads%start, paths, largest)
      if (.not. any(maxval(paths, dim=2) - minval(paths, dim=2) > rounded) .and. &
        size(loads%kinks) == 0) return
      do period = 1, n/least
        from = n - period
        do while (from > 0)
          if (.not. same_path(from, from + period)) exit
          from = from - 1
        end do
        if (n - from < least*period) cycle
        cycles%length = period
        cycles%first = sum(scene%steps(:step - 1)%n_increments) + from
        cycles%last = sum(scene%steps(:step)%n_increments)
        return
      end do
    end associate

  contains

    !> Whether the loads of two increments go the same way: at places within them, and where
    !> amplitudes bend.
    pure logical function same_path(one, other) result(same)
      integer, intent(in) :: one, other !! increments of the step
      integer(i8), allocatable :: a(:), b(:)
      integer :: i, k

      same = .not. any(abs(paths(:, one) - paths(:, other)) > rounded)
      if (.not. same) return
      a = kinks_inside(loads%kinks, one)
      b = kinks_inside(loads%kinks, other)
      same = size(a) == size(b)
      if (.not. same) return
      do i = 1, size(a)
        same = same .and. abs((a(i) - b(i)) - (one - other)*whole_increment) < smallest_increment &
          .and. all([(.not. abs(value_at(k, a(i)) - value_at(k, b(i))) > bent*largest(k), k=1, &
          size(followed))])
      end do
    end function same_path

    !> Of an amplitude that is followed.
    pure real(wp) function value_at(k, position)
      integer, intent(in) :: k
      integer(i8), intent(in) :: position

      value_at = amplitude_value(followed(k), real(position, wp)/(real(n, wp)*real( &
        whole_increment, wp))*scene%steps(step)%period, loads%start)
    end function value_at

  end function cycles_within

  !> The values of amplitudes at some places of each increment, of their largest.
  pure subroutine follow_paths(followed, step, start, paths, largest)
    type(amplitude_t), intent(in) :: followed(:)
    type(load_step_t), intent(in) :: step
    real(wp), intent(in) :: start  !! of the step, in the time of the run
    real(wp), allocatable, intent(out) :: paths(:, :) !! (values,n_increments) [-]
    real(wp), allocatable, intent(out) :: largest(:)  !! (n_followed)
    ! Beginning and end, and between them no simple fractions, where series might meet.
    real(wp), parameter :: places(*) = [0.0_wp, 0.1371_wp, 0.2893_wp, 0.4409_wp, 0.5717_wp, &
      0.7129_wp, 0.8641_wp, 1.0_wp]
    integer :: n, i, k, p

    n = step%n_increments
    allocate (paths(size(places)*size(followed), n), largest(size(followed)))
    do k = 1, size(followed)
      associate (path => paths((k - 1)*size(places) + 1:k*size(places), :))
        do i = 1, n
          do p = 1, size(places)
            path(p, i) = amplitude_value(followed(k), (i - 1 + places(p))/n*step%period, start)
          end do
        end do
        largest(k) = maxval(abs(path))
        if (largest(k) > 0.0_wp) path = path/largest(k)
      end associate
    end do
  end subroutine follow_paths

  !> Those of the kinks of a step that are inside an increment of the deck.
  pure function kinks_inside(kinks, increment) result(inside)
    integer(i8), intent(in) :: kinks(:)
    integer, intent(in) :: increment !! of the step
    integer(i8), allocatable :: inside(:)

    inside = pack(kinks, kinks > (increment - 1)*whole_increment .and. kinks < &
      increment*whole_increment)
  end function kinks_inside

end module load_cycles_mod
