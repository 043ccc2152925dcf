!> Where prescribed velocities and accelerations take nodes: displacements at the ends of steps, or
!> by integrals of amplitudes over the time of the run.
!>
!>     *BOUNDARY, TYPE=VELOCITY[, AMPLITUDE=name]
!>     RIGHT, 1, 1, 1.043             on from where the step before ends, and so in later ones
module follow_velocities_mod
  use cards_mod, only: reader_t, report
  use kinds_mod, only: wp
  use loads_mod, only: amplitude_t, amplitude_rate, amplitude_value, load_step_t, nodal_value_t, &
    start_of_step
  use options_mod, only: card_t, choice_option, open_card
  use sets_mod, only: model_t
  use text_mod, only: to_text
  implicit none
  private

  public :: follow_velocities

  !> What is prescribed of each degree of freedom as a step ends.
  type :: places_t
    logical,  allocatable :: is_held(:, :)  !! (3,n_nodes) in the step
    logical,  allocatable :: is_known(:, :) !! (3,n_nodes) where the step ends
    real(wp), allocatable :: value(:, :)    !! (3,n_nodes) there [length] or [rad]
    real(wp), allocatable :: rate(:, :)     !! (3,n_nodes) at which it goes on [1/time of that]
    logical,  allocatable :: knows_speed(:, :) !! (3,n_nodes) and at the end of the step
    real(wp), allocatable :: speed(:, :)    !! (3,n_nodes) its rate there, likewise
    integer,  allocatable :: total(:, :)
    !! (3,n_nodes) amplitude over the time of the run, which it follows; 0: none
    real(wp), allocatable :: factor(:, :)   !! (3,n_nodes) times that amplitude
    real(wp), allocatable :: from(:, :)     !! (3,n_nodes) and what that is added to
  end type places_t

  integer, parameter :: of_place = 1, of_speed = 2 !! what is not known

contains

  !> Put displacements in the place of velocities and accelerations, which go on in later steps
  !> until these name the degree of freedom or say OP=NEW. Report those that begin where nothing
  !> says where the node is, or how fast.
  subroutine follow_velocities(reader, model, first_velocity, amplitudes, steps)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    real(wp), allocatable, intent(in) :: first_velocity(:, :)
    !! (3,n_nodes) along the directions that cards name; not allocated: 0 [length/time]
    type(amplitude_t), allocatable, intent(inout) :: amplitudes(:) !! gets their integrals
    type(load_step_t), intent(inout) :: steps(:)
    type(places_t) :: displacements, turns
    integer :: s, lost(3)

    if (.not. any([(prescribes_rates(steps(s)), s=1, size(steps))])) return
    call start_at_0(model%mesh%n_nodes, displacements)
    call start_at_0(model%mesh%n_nodes, turns)
    if (allocated(first_velocity)) displacements%speed(:, :size(first_velocity, 2)) = first_velocity
    do s = 1, size(steps)
      if (.not. (allocated(steps(s)%boundary) .and. allocated(steps(s)%rotations))) return
      call end_step(steps, s, amplitudes, displacements, steps(s)%boundary, lost)
      if (lost(1) > 0 .and. allocated(model%rotation_of)) then
        associate (reference => findloc(model%rotation_of(2, :), lost(1), dim=1))
          if (reference > 0) lost(:2) = [model%rotation_of(1, reference), 3 + lost(2)]
        end associate
      end if
      if (lost(1) == 0) then
        call end_step(steps, s, amplitudes, turns, steps(s)%rotations, lost)
        lost(2) = 3 + lost(2)
      end if
      if (lost(1) == 0) cycle
      associate (what => 'node '//to_text(model%mesh%node_id(lost(1))))
        if (lost(3) == of_speed) then
          call report(reader, position_of_rates(reader, s), what//' follows an amplitude along '// &
            'direction '//to_text(lost(2))//' in the step before, and TYPE=ACCELERATION goes '// &
            'on from a velocity', 'prescribe a velocity or an acceleration in that step, or '// &
            'begin with this')
        else
          call report(reader, position_of_rates(reader, s), what//' was free along direction '// &
            to_text(lost(2))//' in the step before, and TYPE=VELOCITY or ACCELERATION goes on '// &
            'from a displacement that *BOUNDARY prescribes', &
            'prescribe one in that step, or the displacement at the end of this one')
        end if
      end associate
      return
    end do
  end subroutine follow_velocities

  pure logical function prescribes_rates(step)
    type(load_step_t), intent(in) :: step

    prescribes_rates = .false.
    if (allocated(step%boundary)) prescribes_rates = any(step%boundary%rate > 0)
    if (allocated(step%rotations)) prescribes_rates = prescribes_rates .or. any( &
      step%rotations%rate > 0)
  end function prescribes_rates

  !> The last *BOUNDARY of a step that prescribes velocities or accelerations.
  integer function position_of_rates(reader, step) result(position)
    type(reader_t), intent(inout) :: reader
    integer, intent(in) :: step
    type(card_t) :: card
    integer :: k, choice
    logical :: ok

    position = 0
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'BOUNDARY' .or. reader%cards(k)%step /= step) cycle
      call open_card(reader, k, card)
      choice = 1
      call choice_option(reader, card, 'TYPE', choice, ok)
      if (choice > 1) position = card%position
    end do
  end function position_of_rates

  !> Before the first step all are at 0.
  pure subroutine start_at_0(n_nodes, places)
    integer, intent(in) :: n_nodes
    type(places_t), intent(out) :: places

    allocate (places%is_held(3, n_nodes), source=.false.)
    allocate (places%is_known(3, n_nodes), places%knows_speed(3, n_nodes), source=.true.)
    allocate (places%value(3, n_nodes), places%rate(3, n_nodes), places%factor(3, n_nodes), &
      places%speed(3, n_nodes), places%from(3, n_nodes), source=0.0_wp)
    allocate (places%total(3, n_nodes), source=0)
  end subroutine start_at_0

  !> The values of a step at its end, with those that earlier velocities go on to.
  subroutine end_step(steps, s, amplitudes, places, values, lost)
    type(load_step_t), intent(in) :: steps(:)
    integer, intent(in) :: s
    type(amplitude_t), allocatable, intent(inout) :: amplitudes(:)
    type(places_t), intent(inout) :: places
    type(nodal_value_t), allocatable, intent(inout) :: values(:)
    integer, intent(out) :: lost(3)
    !! node and dof of a motion from a place or at a speed unknown, and of what; 0: none
    logical, allocatable :: is_named(:, :)
    real(wp) :: start
    integer :: i, node, dof

    lost = 0
    start = start_of_step(steps, s)
    if (s > 1) then
      places%is_known = places%is_known .and. places%is_held
      places%knows_speed = places%knows_speed .and. places%is_held
    end if
    if (steps(s)%replace_boundary) places%is_held = .false.
    allocate (is_named, mold=places%is_held)
    is_named = .false.
    do i = 1, size(values)
      is_named(values(i)%dof, values(i)%node) = .true.
      call begin_with(values(i))
    end do
    places%is_held = places%is_held .or. is_named
    do node = 1, size(is_named, 2)
      do dof = 1, 3
        if (.not. places%is_held(dof, node)) cycle
        if (is_named(dof, node) .or. places%total(dof, node) > 0 .or. .not. &
          abs(places%rate(dof, node)) > 0.0_wp) cycle
        values = [values, nodal_value_t(node=node, dof=dof, value=places%value(dof, node) + &
          places%rate(dof, node)*steps(s)%period, is_way=.true.)]
      end do
    end do
    where (places%total == 0) places%value = places%value + places%rate*steps(s)%period
    do node = 1, size(is_named, 2)
      do dof = 1, 3
        if (places%is_held(dof, node)) call end_with(places%rate(dof, node), &
          places%total(dof, node), places%factor(dof, node), places%from(dof, node), &
          places%value(dof, node), places%speed(dof, node), places%knows_speed(dof, node))
      end do
    end do

  contains

    !> What the step prescribes, of a velocity or an acceleration as a displacement.
    subroutine begin_with(of)
      type(nodal_value_t), intent(inout) :: of
      real(wp) :: speed

      associate (known => places%is_known(of%dof, of%node), &
          value => places%value(of%dof, of%node), rate => places%rate(of%dof, of%node), &
          total => places%total(of%dof, of%node), factor => places%factor(of%dof, of%node), &
          from => places%from(of%dof, of%node))
        rate = 0.0_wp
        total = 0
        if (of%rate > 0) then
          if (.not. known) lost = [of%node, of%dof, of_place]
          speed = places%speed(of%dof, of%node)
          if (of%rate == 2 .and. .not. places%knows_speed(of%dof, of%node)) lost = [of%node, &
            of%dof, of_speed]
          if (abs(of%value) > 0.0_wp .and. (of%rate == 2 .or. of%amplitude > 0)) then
            call add_integral(of%rate, speed/of%value, of%amplitude)
            of%from = value
            total = of%amplitude
            factor = of%value
            from = of%from
          else
            rate = of%value
            if (of%rate == 2) rate = speed
            of%value = value + rate*steps(s)%period
            of%amplitude = 0
            of%is_way = .true.
          end if
          of%rate = 0
        else if (of%amplitude > 0) then
          known = .true.
          total = of%amplitude
          factor = of%value
          from = 0.0_wp
        else if (.not. of%fixed) then
          known = .true.
          value = of%value
        end if
      end associate
    end subroutine begin_with

    !> The amplitude that is another one, from the beginning of the step on, integrated over time.
    subroutine add_integral(n, drift, amplitude)
      integer, intent(in) :: n
      real(wp), intent(in) :: drift       !! [1/time]
      integer, intent(inout) :: amplitude !! 0: 1 throughout; its integral
      type(amplitude_t) :: sum
      integer :: k

      if (amplitude == 0) then
        sum%name = 'of TYPE=ACCELERATION'
        sum%time = [start]
        sum%value = [1.0_wp]
      else
        sum = amplitudes(amplitude)
        if (.not. sum%total) then
          sum%time = sum%time + start
          sum%end = start + steps(s)%period
        end if
      end if
      sum%total = .true.
      sum%integrals = n
      sum%begin = start
      if (n == 2) sum%drift = drift
      sum%horizon = start_of_step(steps, size(steps) + 1)
      do k = size(amplitudes), 1, -1
        if (.not. are_same(amplitudes(k), sum)) cycle
        amplitude = k
        return
      end do
      amplitudes = [amplitudes, sum]
      amplitude = size(amplitudes)
    end subroutine add_integral

    pure logical function are_same(one, other)
      type(amplitude_t), intent(in) :: one, other

      are_same = one%integrals == other%integrals .and. one%name == other%name .and. &
        size(one%time) == size(other%time)
      if (are_same) are_same = .not. (any(abs(one%time - other%time) > 0.0_wp) .or. &
        abs(one%begin - other%begin) > 0.0_wp .or. abs(one%drift - other%drift) > 0.0_wp)
    end function are_same

    !> Where the step ends, and how fast.
    subroutine end_with(rate, total, factor, from, value, speed, knows_speed)
      real(wp), intent(in) :: rate
      integer, intent(inout) :: total
      real(wp), intent(in) :: factor, from
      real(wp), intent(inout) :: value
      real(wp), intent(out) :: speed
      logical, intent(out) :: knows_speed

      knows_speed = .true.
      speed = 0.0_wp
      if (steps(s)%is_dynamic) speed = rate
      if (total == 0) return
      value = from + factor*amplitude_value(amplitudes(total), steps(s)%period, start)
      knows_speed = amplitudes(total)%integrals > 0 .or. .not. steps(s)%is_dynamic
      if (amplitudes(total)%integrals > 0 .and. steps(s)%is_dynamic) speed = factor* &
        amplitude_rate(amplitudes(total), 1, steps(s)%period, steps(s)%period, start)
      if (.not. amplitudes(total)%total) total = 0
    end subroutine end_with

  end subroutine end_step

end module follow_velocities_mod
