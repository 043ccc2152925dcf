!> What dynamic steps take beside loads.
!>
!>     *INITIAL CONDITIONS, TYPE=VELOCITY
!>     BODY, 1, 2.5                   set or node, dof, velocity as the run begins; 0 elsewhere
!>     *DYNAMIC, DIRECT, ALPHA=-0.05
!>     0.01, 1.                       increment, period
module read_dynamics_mod
  use cards_mod, only: note, reader_t, report
  use dynamic_limits_mod, only: beyond_dynamics
  use fields_mod, only: fields_t, integer_field, next_data_line, real_field, reference_field, &
    reference_t, field_position
  use kinds_mod, only: i8, wp
  use loads_mod, only: load_step_t
  use options_mod, only: card_t, choice_option, flag_option, has_option, &
    name_option, open_card, option_position, signed_option
  use scene_mod, only: scene_t
  use sets_mod, only: model_t, referenced_nodes, with_twins
  use text_mod, only: to_text
  implicit none
  private

  public :: read_scheme, read_first_velocities, check_dynamics

  integer(i8), parameter :: max_work = 200000000
  !! values of all lines together, each node of a set counted: more than any real deck needs
  real(wp), parameter :: little = -0.05_wp       !! ALPHA where nothing is said, and there [-]
  real(wp), parameter :: moderate = -0.41421_wp  !! of MODERATE DISSIPATION, likewise [-]

contains

  !> The options of *DYNAMIC.
  subroutine read_scheme(reader, card, has_pairs, step)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    logical, intent(in) :: has_pairs  !! contact pairs
    type(load_step_t), intent(inout) :: step
    integer :: choice
    logical :: ok, is_explicit

    step%is_dynamic = .true.
    call flag_option(reader, card, 'DIRECT', step%direct)
    is_explicit = .false.
    call flag_option(reader, card, 'EXPLICIT', is_explicit)
    choice = 1
    call choice_option(reader, card, 'APPLICATION', choice, ok)
    step%alpha = merge(moderate, little, choice == 2)
    if (has_option(card, 'ALPHA')) then
      call signed_option(reader, card, 'ALPHA', step%alpha, ok)
      if (ok .and. .not. (step%alpha >= -0.5_wp .and. step%alpha <= 0.0_wp)) then
        call report(reader, option_position(card, 'ALPHA'), 'ALPHA must be from -0.5 to 0')
        step%alpha = little
      end if
    else if (has_pairs .and. .not. has_option(card, 'APPLICATION') .and. .not. is_explicit) then
      call note(reader, '*DYNAMIC: ALPHA is '//to_text(little)//', by which little energy is '// &
        'lost; in Abaqus the default of models with contact is APPLICATION=MODERATE '// &
        'DISSIPATION, '//to_text(moderate))
    end if
    if (is_explicit) call note(reader, '*DYNAMIC, EXPLICIT is solved implicitly: increments '// &
      'are as long as their error in time allows, and the largest on its line')
  end subroutine read_scheme

  !> *INITIAL CONDITIONS, TYPE=VELOCITY: set or node, dof, velocity. Of one node and dof the last
  !> counts.
  subroutine read_first_velocities(reader, model, velocity)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    real(wp), allocatable, intent(out) :: velocity(:, :)
    !! (3,n_nodes) not allocated: none is given [length/time]
    type(card_t) :: card
    character(:), allocatable :: kind
    integer(i8) :: work
    integer :: k
    logical :: ok

    work = 0
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'INITIAL CONDITIONS') cycle
      call open_card(reader, k, card)
      call name_option(reader, card, 'TYPE', .false., kind, ok)
      if (.not. ok .or. kind /= 'VELOCITY') cycle
      if (.not. allocated(velocity)) allocate (velocity(3, model%mesh%n_nodes), source=0.0_wp)
      call read_lines()
    end do

  contains

    subroutine read_lines()
      type(fields_t) :: fields
      type(reference_t) :: reference
      integer, allocatable :: nodes(:)
      real(wp) :: value
      integer :: dof
      logical :: found, is_known, is_dof, is_value

      fields%line = 0
      do
        call next_data_line(reader, card, fields, found, 3, 'a set or node, a dof, a velocity')
        if (.not. found) return
        call reference_field(reader, fields, 1, 'a node or a set of nodes', reference, is_known)
        call integer_field(reader, fields, 2, 'the dof', 1, dof, is_dof)
        if (is_dof .and. dof > 3) then
          call report(reader, field_position(reader, fields, 2), 'velocities are along dofs 1 to 3')
          is_dof = .false.
        end if
        call real_field(reader, fields, 3, 'the velocity', value, is_value)
        if (.not. (is_known .and. is_dof .and. is_value)) cycle
        call referenced_nodes(reader, model, reference, nodes)
        work = work + size(nodes)
        if (work > max_work) then
          call report(reader, fields%start, 'the deck sets too many velocities')
          return
        end if
        nodes = pack(nodes, model%used(nodes))
        velocity(dof, with_twins(model, nodes)) = value
      end do
    end subroutine read_lines

  end subroutine read_first_velocities

  !> Refuse what dynamic steps do not cover, elements without mass among it.
  subroutine check_dynamics(reader, scene)
    type(reader_t), intent(inout) :: reader
    type(scene_t), intent(in) :: scene
    type(card_t) :: card
    character(:), allocatable :: beyond
    integer :: step, k, e, first(scene%mesh%n_pieces) !! material of a piece
    logical :: jumps

    if (.not. any(scene%steps%is_dynamic)) then
      if (allocated(scene%first_velocity)) call note(reader, '*INITIAL CONDITIONS, '// &
        'TYPE=VELOCITY is ignored: no step is a *DYNAMIC')
      if (any(reader%cards(:reader%n_cards)%keyword == 'DAMPING')) call note(reader, '*DAMPING '// &
        'is ignored: no step is a *DYNAMIC')
      return
    end if
    step = findloc(scene%steps%is_dynamic, .true., dim=1)
    k = findloc(reader%cards(:reader%n_cards)%keyword == 'DYNAMIC', .true., dim=1)
    call open_card(reader, k, card)
    if (allocated(scene%first_velocity) .and. step > 1) call report(reader, card%position, &
      '*INITIAL CONDITIONS, TYPE=VELOCITY takes a first step that is a *DYNAMIC: at the end of '// &
      'a static one bodies are at rest')
    beyond = beyond_dynamics(scene)
    if (beyond == '' .and. any(reader%cards(:reader%n_cards)%keyword == &
      'CYCLIC SYMMETRY MODEL')) beyond = '*CYCLIC SYMMETRY MODEL'
    if (beyond /= '') call report(reader, card%position, '*DYNAMIC does not cover '//beyond)
    do e = 1, scene%mesh%n_elements
      associate (material => scene%materials(scene%mesh%material(e)))
        if (material%density > 0.0_wp) cycle
        call report(reader, card%position, '*DYNAMIC takes the mass of bodies, and material '// &
          material%name//' of element '//to_text(scene%mesh%element_id(e))//' has no *DENSITY')
        exit
      end associate
    end do
    first = 0
    do e = 1, scene%mesh%n_elements
      associate (piece => scene%mesh%piece(scene%mesh%connectivity%node( &
          scene%mesh%connectivity%first(e))), material => scene%mesh%material, all => &
          scene%materials)
        if (first(piece) == 0) first(piece) = material(e)
        associate (apart => all(material(e))%mass_damping - all(first(piece))%mass_damping)
          if (.not. abs(apart) > 0.0_wp) cycle
        end associate
        call report(reader, card%position, 'materials '//all(first(piece))%name//' and '// &
          all(material(e))%name//' of one body have different values of ALPHA (*DAMPING)', &
          'give them the same')
        exit
      end associate
    end do
    jumps = .false.
    do step = 1, size(scene%steps)
      if (scene%steps(step)%is_dynamic) jumps = jumps .or. any_jumps(scene%steps(step))
    end do
    if (jumps) call note(reader, '*DYNAMIC: loads and displacements without AMPLITUDE act at '// &
      'once as the step begins')
  end subroutine check_dynamics

  !> Whether loads or motions of a step follow no amplitude.
  pure logical function any_jumps(step)
    type(load_step_t), intent(in) :: step

    any_jumps = any(step%forces%amplitude == 0 .and. abs(step%forces%value) > 0.0_wp) .or. &
      any(step%pressures%amplitude == 0 .and. abs(step%pressures%value) > 0.0_wp) .or. &
      any(step%face_pressures%amplitude == 0 .and. abs(step%face_pressures%value) > 0.0_wp) .or. &
      any(step%boundary%amplitude == 0 .and. abs(step%boundary%value) > 0.0_wp .and. .not. &
      step%boundary%is_way)
  end function any_jumps

end module read_dynamics_mod
