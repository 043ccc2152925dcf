!> Where prescribed velocities take nodes: displacements at the ends of steps.
!>
!>     *BOUNDARY, TYPE=VELOCITY
!>     RIGHT, 1, 1, 1.043             on from where the step before ends, and so in later ones
module follow_velocities_mod
  use cards_mod, only: reader_t, report
  use kinds_mod, only: wp
  use loads_mod, only: amplitude_t, amplitude_value, load_step_t, nodal_value_t, start_of_step
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
    integer,  allocatable :: total(:, :)
    !! (3,n_nodes) amplitude over the time of the run, which it follows; 0: none
    real(wp), allocatable :: factor(:, :)   !! (3,n_nodes) times that amplitude
  end type places_t

contains

  !> Put displacements at the ends of steps in the place of velocities, which go on in later steps
  !> until these name the degree of freedom or say OP=NEW. Report those that begin where no
  !> *BOUNDARY says where the node is.
  subroutine follow_velocities(reader, model, amplitudes, position, steps)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(amplitude_t), intent(in) :: amplitudes(:)
    integer, intent(in) :: position(:) !! (n_steps) of a card with TYPE=VELOCITY in each step; 0
    type(load_step_t), intent(inout) :: steps(:)
    type(places_t) :: displacements, turns
    integer :: s, lost(2)

    if (all(position == 0)) return
    call start_at_0(model%mesh%n_nodes, displacements)
    call start_at_0(model%mesh%n_nodes, turns)
    do s = 1, size(steps)
      if (.not. (allocated(steps(s)%boundary) .and. allocated(steps(s)%rotations))) return
      call end_step(amplitudes, steps, s, displacements, steps(s)%boundary, lost)
      if (lost(1) > 0 .and. allocated(model%rotation_of)) then
        associate (reference => findloc(model%rotation_of(2, :), lost(1), dim=1))
          if (reference > 0) lost = [model%rotation_of(1, reference), 3 + lost(2)]
        end associate
      end if
      if (lost(1) == 0) then
        call end_step(amplitudes, steps, s, turns, steps(s)%rotations, lost)
        lost(2) = 3 + lost(2)
      end if
      if (lost(1) == 0) cycle
      call report(reader, position(s), 'node '//to_text(model%mesh%node_id(lost(1)))// &
        ' was free along direction '//to_text(lost(2))//' in the step before, and '// &
        'TYPE=VELOCITY goes on from a displacement that *BOUNDARY prescribes', &
        'prescribe one in that step, or the displacement at the end of this one')
      return
    end do
  end subroutine follow_velocities

  !> Before the first step all are at 0.
  pure subroutine start_at_0(n_nodes, places)
    integer, intent(in) :: n_nodes
    type(places_t), intent(out) :: places

    allocate (places%is_held(3, n_nodes), source=.false.)
    allocate (places%is_known(3, n_nodes), source=.true.)
    allocate (places%value(3, n_nodes), places%rate(3, n_nodes), places%factor(3, n_nodes), &
      source=0.0_wp)
    allocate (places%total(3, n_nodes), source=0)
  end subroutine start_at_0

  !> The values of a step at its end, with those that earlier velocities go on to.
  pure subroutine end_step(amplitudes, steps, s, places, values, lost)
    type(amplitude_t), intent(in) :: amplitudes(:)
    type(load_step_t), intent(in) :: steps(:)
    integer, intent(in) :: s
    type(places_t), intent(inout) :: places
    type(nodal_value_t), allocatable, intent(inout) :: values(:)
    integer, intent(out) :: lost(2) !! node and dof of a velocity from a place unknown; 0: none
    logical, allocatable :: is_named(:, :)
    real(wp) :: start
    integer :: i, node, dof

    lost = 0
    start = start_of_step(steps, s)
    if (s > 1) places%is_known = places%is_known .and. places%is_held
    if (steps(s)%replace_boundary) places%is_held = .false.
    allocate (is_named, mold=places%is_held)
    is_named = .false.
    do i = 1, size(values)
      associate (of => values(i), known => places%is_known(values(i)%dof, values(i)%node), &
                 value => places%value(values(i)%dof, values(i)%node), rate => &
                 places%rate(values(i)%dof, values(i)%node), total => places%total(values(i)%dof, &
                 values(i)%node), factor => places%factor(values(i)%dof, values(i)%node))
        is_named(of%dof, of%node) = .true.
        rate = 0.0_wp
        total = 0
        if (of%is_way) then
          if (.not. known) lost = [of%node, of%dof]
          rate = of%value
          of%value = value + rate*steps(s)%period
          value = of%value
        else if (of%amplitude > 0) then
          known = .true.
          if (amplitudes(of%amplitude)%total) total = of%amplitude
          factor = of%value
          value = factor*amplitude_value(amplitudes(of%amplitude), steps(s)%period, start)
        else if (.not. of%fixed) then
          known = .true.
          value = of%value
        end if
      end associate
    end do
    do node = 1, size(is_named, 2)
      do dof = 1, 3
        if (is_named(dof, node) .or. .not. places%is_held(dof, node)) cycle
        associate (value => places%value(dof, node), rate => places%rate(dof, node), total => &
                   places%total(dof, node))
          if (total > 0) then
            value = places%factor(dof, node)*amplitude_value(amplitudes(total), steps(s)%period, &
              start)
          else if (abs(rate) > 0.0_wp) then
            value = value + rate*steps(s)%period
            values = [values, nodal_value_t(node=node, dof=dof, value=value, is_way=.true.)]
          end if
        end associate
      end do
    end do
    places%is_held = places%is_held .or. is_named
  end subroutine end_step

end module follow_velocities_mod
