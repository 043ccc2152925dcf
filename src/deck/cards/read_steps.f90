!> The steps of a deck.
!>
!>     *STEP
!>     *STATIC, DIRECT
!>     0.1, 1.                        increment, period
!>     *BOUNDARY
!>     BODY-ZMAX, 3, 3, -0.1
!>     *END STEP
!>
!> A *BOUNDARY before the first step holds from the beginning: it becomes part of the first step.
module read_steps_mod
  use cards_mod, only: keep_reading, note, reader_t, report
  use diagnostics_mod, only: quoted
  use fields_mod, only: end_data, field_position, field_text, fields_t, is_empty_field, &
    next_data_line, real_field
  use kinds_mod, only: wp
  use kinks_mod, only: used_amplitudes
  use loads_mod, only: load_step_t
  use options_mod, only: allow_no_data, allow_options, card_t, choice_option, flag_option, &
    has_option, open_card, option_position
  use read_amplitudes_mod, only: amplitude_list_t
  use read_element_loads_mod, only: close_element_loads, element_load_draft_t, read_dload, &
    start_element_loads
  use read_loads_mod, only: close_step, load_draft_t, read_boundary, read_cload, read_dsload, &
    start_step
  use read_temperatures_mod, only: close_temperatures, read_temperature, start_temperatures, &
    temperature_draft_t
  use read_contact_changes_mod, only: read_change_friction, read_model_change
  use read_dynamics_mod, only: read_scheme
  use read_interferences_mod, only: read_interference
  use surface_list_mod, only: surface_list_t
  use scene_mod, only: contact_pair_t, region_t
  use sets_mod, only: model_t
  use text_mod, only: to_text
  implicit none
  private

  public :: read_steps

  integer, parameter :: max_increments = 1000000 !! of one step

contains

  !> Read all steps.
  subroutine read_steps(reader, model, amplitudes, pairs, surfaces, steps, regions, finite_strain)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(amplitude_list_t), intent(in) :: amplitudes
    type(contact_pair_t), intent(in) :: pairs(:)
    type(surface_list_t), intent(inout) :: surfaces !! those of loaded faces are added
    type(load_step_t), allocatable, intent(out) :: steps(:)
    type(region_t), allocatable, intent(out) :: regions(:) !! elements whose weight counts
    logical, intent(out) :: finite_strain !! NLGEOM: from the first step on, or not at all
    type(load_draft_t) :: draft
    type(element_load_draft_t) :: element_draft
    type(temperature_draft_t) :: temperatures
    type(card_t) :: card
    integer :: k, s, static_of, position
    type(card_t) :: of_step
    integer :: renewed(reader%n_steps) !! where a step says *BOUNDARY, OP=NEW first, or 0
    logical :: forget
    character(*), parameter :: second = 'a second *STATIC or *DYNAMIC in this step'

    finite_strain = .false.
    allocate (steps(reader%n_steps))
    s = 0
    static_of = 0
    renewed = 0
    position = 0
    call start_step(draft, model%mesh%n_nodes)
    call start_element_loads(element_draft, model)
    call start_temperatures(temperatures, model%mesh%n_nodes)
    do k = 1, reader%n_cards
      if (.not. keep_reading(reader)) exit
      call open_if_needed(k)
      select case (reader%cards(k)%keyword)
      case ('STEP')
        call finish_step()
        s = reader%cards(k)%step
        of_step = card
        position = card%position
        call read_step_options(reader, card, s == 1, finite_strain)
        if (s == 1) then
          call forget_initial(reader, forget)
          if (forget) call start_step(draft, model%mesh%n_nodes)
        else
          call start_step(draft, model%mesh%n_nodes)
          call start_element_loads(element_draft, model)
          call start_temperatures(temperatures, model%mesh%n_nodes)
        end if
      case ('STATIC')
        if (static_of == s) call report(reader, card%position, second)
        static_of = s
        ! Equilibrium takes no artificial damping, of which STABILIZE and those beside it are.
        call allow_options(reader, card)
        call flag_option(reader, card, 'DIRECT', steps(s)%direct)
        call check_amplitude(reader, of_step, 1, 'loads ramp over a step')
        call read_times(reader, card, steps(s))
      case ('DYNAMIC')
        if (static_of == s) call report(reader, card%position, second)
        static_of = s
        call allow_options(reader, card)
        call read_scheme(reader, card, size(pairs) > 0, steps(s))
        call check_amplitude(reader, of_step, 2, &
          'loads of *DYNAMIC act at once as the step begins')
        call read_times(reader, card, steps(s))
      case ('END STEP')
        call allow_options(reader, card)
        call allow_no_data(reader, card)
      case ('BOUNDARY')
        if (s == 0) then
          forget = .false.
          call read_boundary(reader, card, model, amplitudes, draft, forget)
        else
          call read_boundary(reader, card, model, amplitudes, draft, steps(s)%replace_boundary, &
            static_of == s, steps(s)%is_dynamic)
          if (steps(s)%replace_boundary .and. renewed(s) == 0) renewed(s) = card%position
        end if
      case ('CLOAD')
        call read_cload(reader, card, model, amplitudes, draft, steps(s)%replace_forces)
      case ('DSLOAD')
        call read_dsload(reader, card, model, amplitudes, surfaces, draft, &
          steps(s)%replace_pressures)
      case ('TEMPERATURE')
        call read_temperature(reader, card, model, amplitudes, temperatures, &
          steps(s)%replace_temperatures)
      case ('CONTACT INTERFERENCE')
        call read_interference(reader, card, amplitudes, pairs, s == 1, steps(s))
      case ('CHANGE FRICTION')
        call read_change_friction(reader, card, k, pairs, steps(s))
      case ('MODEL CHANGE')
        call read_model_change(reader, card, pairs, steps(:s))
      case ('DLOAD')
        call read_dload(reader, card, model, amplitudes, surfaces, element_draft, &
          steps(s)%replace_element_loads)
      case default
        cycle
      end select
    end do
    call finish_step()
    call check_released(reader, model, steps, renewed)
    do s = 1, size(steps)
      call note_fast_series(reader, amplitudes, steps(s))
    end do
    regions = element_draft%regions(:element_draft%n_regions)

  contains

    subroutine open_if_needed(k)
      integer, intent(in) :: k

      select case (reader%cards(k)%keyword)
      case ('STEP', 'STATIC', 'DYNAMIC', 'END STEP', 'BOUNDARY', 'CLOAD', 'DLOAD', 'DSLOAD', &
            'TEMPERATURE', 'CONTACT INTERFERENCE', 'CHANGE FRICTION', 'MODEL CHANGE')
        call open_card(reader, k, card)
      case default
        return
      end select
    end subroutine open_if_needed

    subroutine finish_step()
      if (s == 0) return
      call close_step(draft, steps(s))
      call close_element_loads(element_draft, steps(s))
      call close_temperatures(reader, model, temperatures, steps(s))
      associate (cards => reader%cards(:reader%n_cards))
        ! Another procedure was refused.
        if (any(cards%is_refused .and. cards%step == s)) return
      end associate
      if (static_of /= s) call report(reader, position, 'this step has no *STATIC or *DYNAMIC')
    end subroutine finish_step

  end subroutine read_steps

  !> Note Fourier series that the increments of a step cannot follow: each takes its loads in a
  !> straight line. Without DIRECT they end where a series turns round.
  subroutine note_fast_series(reader, amplitudes, step)
    type(reader_t), intent(inout) :: reader
    type(amplitude_list_t), intent(in) :: amplitudes
    type(load_step_t), intent(in) :: step
    real(wp), parameter :: whole_turn = 2.0_wp*acos(-1.0_wp)
    real(wp), parameter :: enough = 8.0_wp !! increments a period
    logical :: is_used(size(amplitudes%list))
    real(wp) :: period
    integer :: k, i, last

    if (.not. (allocated(step%boundary) .and. step%direct)) return
    is_used = used_amplitudes(amplitudes%list, step)
    do k = 1, size(is_used)
      associate (a => amplitudes%list(k))
        if (.not. is_used(k) .or. .not. allocated(a%cosine)) cycle
        last = 0
        do i = 1, size(a%cosine)
          if (abs(a%cosine(i)) + abs(a%sine(i)) > 0.0_wp) last = i
        end do
        if (last == 0 .or. .not. a%frequency > 0.0_wp) cycle
        period = whole_turn/(last*a%frequency)
        if (period >= enough*step%increment*(1.0_wp - 1.0e-9_wp)) cycle
        call note(reader, 'amplitude '//quoted(a%name)//' has a period of '//to_text(period, 3)// &
          ' and the increments of the step are '//to_text(step%increment, 3)//': they take '// &
          'loads in straight lines, and fewer than 8 a period miss much of it; without DIRECT '// &
          'they would end where it turns round')
      end associate
    end do
  end subroutine note_fast_series

  !> Report obstacles that have turned and whose rotation a step lets go of: none turns freely.
  subroutine check_released(reader, model, steps, renewed)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(load_step_t), intent(in) :: steps(:)
    integer, intent(in) :: renewed(:) !! (n_steps) where *BOUNDARY says OP=NEW, or 0
    logical :: held
    integer :: s, k, i

    do s = 2, size(steps)
      if (renewed(s) == 0 .or. .not. allocated(steps(s)%rotations)) cycle
      do k = s - 1, 1, -1
        if (.not. allocated(steps(k)%rotations)) exit
        do i = 1, size(steps(k)%rotations)
          associate (earlier => steps(k)%rotations(i), now => steps(s)%rotations)
            if (.not. abs(earlier%value) > 0.0_wp) cycle
            held = any(now%node == earlier%node .and. now%dof == earlier%dof)
            if (held) cycle
            call report(reader, renewed(s), 'OP=NEW leaves dof '//to_text(3 + earlier%dof)// &
              ' of reference node '//to_text(model%mesh%node_id(earlier%node))// &
              ' free: an obstacle that has turned must be held, it does not turn freely')
            return
          end associate
        end do
        if (renewed(k) > 0) exit
      end do
    end do
  end subroutine check_released

  !> Whether the first step ends what was prescribed before it (*BOUNDARY, OP=NEW).
  subroutine forget_initial(reader, forget)
    type(reader_t), intent(inout) :: reader
    logical, intent(out) :: forget
    type(card_t) :: card
    integer :: k, choice
    logical :: ok

    forget = .false.
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'BOUNDARY' .or. reader%cards(k)%step /= 1) cycle
      call open_card(reader, k, card)
      choice = 1
      call choice_option(reader, card, 'OP', choice, ok)
      forget = forget .or. choice == 2
    end do
  end subroutine forget_initial

  !> *STEP[, INC=n][, NLGEOM[=YES|NO|AUTO]]; data lines are a title.
  !>
  !> Finite strain holds from a step on: one that says nothing goes on as the one before it.
  subroutine read_step_options(reader, card, is_first, finite_strain)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    logical, intent(in) :: is_first
    logical, intent(inout) :: finite_strain !! of the step before; of this one
    logical :: nonlinear, perturbation, is_auto
    character(:), allocatable :: hint

    call allow_options(reader, card)
    nonlinear = .true.
    call flag_option(reader, card, 'NLGEOM', nonlinear, 'AUTO', is_auto)
    reader%keeps_small_strain = reader%reading%nlgeom == 'NO' .or. (reader%reading%nlgeom == '' &
      .and. (reader%keeps_small_strain .or. .not. nonlinear))
    if (is_auto .or. .not. has_option(card, 'NLGEOM')) nonlinear = finite_strain
    if (is_auto .and. .not. (is_first .or. reader%chooses_theory .or. reader%reading%nlgeom /= &
      '')) call report(reader, option_position(card, 'NLGEOM'), 'NLGEOM=AUTO begins with the '// &
      'first *STEP, or not at all')
    if (reader%reading%nlgeom == '' .and. is_auto .and. is_first) reader%chooses_theory = .true.
    if (reader%reading%nlgeom == 'NO' .and. nonlinear) then
      call note(reader, 'NLGEOM is set aside by --nlgeom no: strains and rotations are '// &
        'taken as small')
    else if (reader%reading%nlgeom /= '') then
      reader%chooses_theory = reader%reading%nlgeom == 'AUTO'
      finite_strain = reader%reading%nlgeom == 'YES'
    else if (nonlinear .and. .not. (is_first .or. finite_strain)) then
      call report(reader, option_position(card, 'NLGEOM'), &
        'NLGEOM begins with the first *STEP, or not at all', '--nlgeom no runs the deck by '// &
        'small strain')
    else if (finite_strain .and. .not. nonlinear) then
      call report(reader, option_position(card, 'NLGEOM'), &
        'NLGEOM=NO after a step with NLGEOM: finite strain stays once it has begun')
    else
      finite_strain = nonlinear
    end if
    perturbation = .false.
    call flag_option(reader, card, 'PERTURBATION', perturbation)
    hint = ''
    if (.not. is_first) hint = '--static-steps runs the steps before it'
    if (perturbation) call report(reader, option_position(card, 'PERTURBATION'), &
      'PERTURBATION steps are not available', hint)
  end subroutine read_step_options

  !> Refuse an AMPLITUDE of *STEP, 1: RAMP, 2: STEP, that is not what its loads do.
  subroutine check_amplitude(reader, card, does, words)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card    !! *STEP
    integer, intent(in) :: does
    character(*), intent(in) :: words   !! what they do
    integer :: choice
    logical :: ok

    choice = does
    call choice_option(reader, card, 'AMPLITUDE', choice, ok)
    if (choice /= does) call report(reader, option_position(card, 'AMPLITUDE'), &
      words//'; for anything else use *AMPLITUDE')
  end subroutine check_amplitude

  !> The line of *STATIC or *DYNAMIC: increment, period, smallest and largest increment
  subroutine read_times(reader, card, step)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(load_step_t), intent(inout) :: step
    type(fields_t) :: fields
    integer :: position
    real(wp), parameter :: part = 0.01_wp !! of the period, where no increment is given [-]
    real(wp) :: smallest
    logical :: found, ok(4)

    call next_data_line(reader, card, fields, found, 4, &
      'an increment, a period (and a smallest increment, which is ignored, and a largest one)')
    if (step%is_dynamic) then
      step%increment = step%period*part
      step%n_increments = nint(1.0_wp/part)
    end if
    if (.not. found) return
    position = fields%start
    call read_time(2, 'the period', 1.0_wp, step%period)
    call read_time(1, 'the increment', merge(part, 1.0_wp, step%is_dynamic)*step%period, &
      step%increment)
    call read_time(3, 'the smallest increment', 0.0_wp, smallest)
    if (step%is_dynamic) then
      step%smallest = smallest
    else if (smallest > 0.0_wp) then
      call note(reader, 'the smallest increment of *STATIC is ignored')
    end if
    call read_time(4, 'the largest increment', huge(1.0_wp), step%largest)
    if (step%is_dynamic) then
      step%increment = min(step%increment, step%largest)
    else if (step%largest < huge(1.0_wp) .and. step%direct) then
      call note(reader, 'the largest increment of *STATIC is ignored: DIRECT keeps increments '// &
        'as they are')
    end if
    if (all(ok)) then
      if (step%increment > step%period*(1.0_wp + 1.0e-12_wp)) then
        call report(reader, position, 'the increment is larger than the period')
      else
        if (.not. step%direct) step%increment = min(step%increment, step%largest)
        if (step%period > max_increments*step%increment) then
          call report(reader, position, 'the step has more than '//to_text(max_increments)// &
            ' increments')
        else
          step%n_increments = nint(step%period/step%increment)
        end if
      end if
    end if
    call end_data(reader, card, fields, '*'//card%keyword//' has one data line')

  contains

    !> A time of the line. As Abaqus has it, 0 stands for what is left out.
    subroutine read_time(i, what, default, time)
      integer, intent(in) :: i
      character(*), intent(in) :: what
      real(wp), intent(in) :: default
      real(wp), intent(out) :: time

      time = 0.0_wp
      ok(i) = .true.
      if (.not. is_empty_field(fields, i)) call real_field(reader, fields, i, what, time, ok(i))
      if (ok(i) .and. time < 0.0_wp) then
        call report(reader, field_position(reader, fields, i), what//' must be positive, not '// &
          quoted(field_text(reader, fields, i)))
        ok(i) = .false.
      end if
      if (.not. time > 0.0_wp) time = default
    end subroutine read_time

  end subroutine read_times

end module read_steps_mod
