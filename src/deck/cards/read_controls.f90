!> How contact is solved, and what is written.
!>
!>     *CONTACT SOLVER, SOLVER=SWEEPS, FORMULATION=BIPOTENTIAL, LOCAL=NEWTON, RHO=1, RELAXATION=1,
!>     TOLERANCE=1e-8, STOP=RESIDUAL, MAX SWEEPS=20000
!>     *NODE FILE, FREQUENCY=1        in a step
!>     U, RF
!>     *EL FILE, POSITION=CENTROIDAL
!>     S, E
!>     *CONTACT FILE
module read_controls_mod
  use cards_mod, only: note, reader_t, report
  use controls_mod, only: contact_controls_t, output_controls_t, solver_auto, &
    solver_global_newton, solver_sweeps, stop_at_change
  use diagnostics_mod, only: guess, quoted
  use fields_mod, only: any_number, fields_t, is_empty_field, name_field, next_data_line
  use options_mod, only: allow_no_data, allow_options, card_t, choice_option, &
    has_option, integer_option, open_card, open_only_card, option_position, text_option
  use solver_options_mod, only: set_solver_option, solver_options
  use text_mod, only: string_t, to_text, upper
  implicit none
  private

  public :: read_contact_controls, read_output_controls

contains

  !> *CONTACT SOLVER
  subroutine read_contact_controls(reader, controls)
    type(reader_t), intent(inout) :: reader
    type(contact_controls_t), intent(out) :: controls
    type(card_t) :: card
    character(:), allocatable :: name, value, wanted
    type(string_t), allocatable :: words(:)
    integer :: i
    logical :: found, of_sweeps

    call open_only_card(reader, 'CONTACT SOLVER', card, found)
    if (.not. found) return
    call allow_options(reader, card)
    call allow_no_data(reader, card)
    of_sweeps = .false.
    do i = 1, size(solver_options)
      name = trim(solver_options(i))
      call text_option(reader, card, name, value, found)
      if (.not. found) cycle
      call set_solver_option(name, value, controls, of_sweeps, wanted, words)
      if (allocated(wanted)) call report(reader, option_position(card, name), name// &
        ' must be '//wanted//', not '//quoted(value), guess(upper(value), words))
    end do
    if (of_sweeps) call choose_sweeps(reader, card, controls%solver)
    call note_unused(reader, controls)
  end subroutine read_contact_controls

  !> LOCAL and RELAXATION say that sweeps are meant.
  subroutine choose_sweeps(reader, card, solver)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    integer, intent(inout) :: solver !! as SOLVER= says it

    if (solver == solver_global_newton) then
      call report(reader, option_position(card, 'SOLVER'), &
        'LOCAL and RELAXATION apply to SWEEPS, not to GLOBAL NEWTON')
    else if (solver == solver_auto .and. has_option(card, 'SOLVER')) then
      call note(reader, 'SOLVER=AUTO with LOCAL or RELAXATION: sweeps are used')
    end if
    solver = solver_sweeps
  end subroutine choose_sweeps

  !> Note what the solver that runs does not look at.
  subroutine note_unused(reader, controls)
    type(reader_t), intent(inout) :: reader
    type(contact_controls_t), intent(in) :: controls

    if (controls%solver /= solver_sweeps .and. controls%stop_rule == stop_at_change) call note( &
      reader, 'STOP=CHANGE of *CONTACT SOLVER is ignored: it applies to SOLVER=SWEEPS only')
  end subroutine note_unused

  !> *NODE FILE, *EL FILE, *CONTACT FILE of all steps together. Only displacements may be left out,
  !> by a *NODE FILE or a *CONTACT FILE that does not name them: forces of the supports and of
  !> contact are 0 at most nodes, and take next to nothing. With stresses von Mises' is written.
  subroutine read_output_controls(reader, controls)
    type(reader_t), intent(inout) :: reader
    type(output_controls_t), intent(out) :: controls
    type(output_controls_t) :: named
    type(card_t) :: card
    integer :: k, before
    logical :: nodal, frequency_given, ok

    named%displacement = .false.
    named%at_centroids = .false.
    nodal = .false.
    frequency_given = .false.
    do k = 1, reader%n_cards
      select case (reader%cards(k)%keyword)
      case ('NODE FILE', 'EL FILE', 'CONTACT FILE')
        call open_card(reader, k, card)
        call allow_options(reader, card)
        before = named%frequency
        call integer_option(reader, card, 'FREQUENCY', 1, huge(1), named%frequency, ok)
        if (ok .and. frequency_given .and. named%frequency /= before) call note(reader, &
          'FREQUENCY='//to_text(named%frequency)//', the last in the deck, applies to all results')
        frequency_given = frequency_given .or. ok
        if (card%keyword == 'EL FILE') call read_position(reader, card, named)
        nodal = nodal .or. card%keyword /= 'EL FILE'
        call read_variables(reader, card, named)
      case ('CONTACT PRINT')
        call open_card(reader, k, card)
        call allow_options(reader, card)
        named%contact_table = .true.
        call read_variables(reader, card, named)
      case default
        cycle
      end select
    end do
    named%displacement = named%displacement .or. .not. nodal
    named%mises = named%mises .or. named%stress
    controls = named
    if (named%stress .or. named%strain .or. named%mises .or. named%principal_stress .or. &
      named%principal_strain .or. named%green_strain .or. named%pk2_stress) return
    if (named%at_gauss_points .or. named%at_nodes) call note(reader, &
      'POSITION of *EL FILE is ignored: neither S nor E nor what follows from them is written')
    ! Without stresses and strains it does not matter where they are.
    controls%at_centroids = .true.
  end subroutine read_output_controls

  !> Where the stresses and strains of an *EL FILE are written; several cards add up.
  subroutine read_position(reader, card, controls)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(output_controls_t), intent(inout) :: controls
    integer :: choice
    logical :: ok

    choice = 1
    call choice_option(reader, card, 'POSITION', choice, ok)
    if (choice == 4) call note(reader, &
      'POSITION=NODES of *EL FILE: the values of the elements around a node are averaged')
    select case (choice)
    case (1)
      controls%at_centroids = .true.
    case (2)
      controls%at_gauss_points = .true.
    case default
      controls%at_nodes = .true.
    end select
  end subroutine read_position

  !> The names of what is to be written.
  subroutine read_variables(reader, card, controls)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(output_controls_t), intent(inout) :: controls
    type(fields_t) :: fields
    character(:), allocatable :: name
    integer :: i
    logical :: found, ok

    do
      call next_data_line(reader, card, fields, found, any_number, 'names of results')
      if (.not. found) exit
      do i = 1, fields%n
        if (is_empty_field(fields, i)) cycle
        call name_field(reader, fields, i, 'the name of a result', name, ok)
        if (.not. ok) return
        select case (card%keyword//' '//name)
        case ('NODE FILE U')
          controls%displacement = .true.
        case ('NODE FILE RF')
          continue ! always
        case ('EL FILE S')
          controls%stress = .true.
        case ('EL FILE E')
          controls%strain = .true.
        case ('EL FILE ERR')
          controls%mesh_error = .true.
        case ('EL FILE MISES')
          controls%mises = .true.
        case ('EL FILE SP')
          controls%principal_stress = .true.
        case ('EL FILE EP')
          controls%principal_strain = .true.
        case ('EL FILE EG')
          controls%green_strain = .true.
        case ('EL FILE PK2')
          controls%pk2_stress = .true.
        case ('NODE FILE CF')
          controls%loads = .true.
        case ('CONTACT FILE COPEN')
          controls%penetration = .true.
        case ('CONTACT FILE CDIS', 'CONTACT FILE CSTR', 'CONTACT FILE CDISP', &
          'CONTACT FILE CSTRESS', 'CONTACT FILE CFORCE', 'CONTACT FILE CSTATUS')
          continue ! gaps, slips, forces, pressures and states: the contact results, all of them
        case ('CONTACT PRINT CF', 'CONTACT PRINT CFN', 'CONTACT PRINT CFS', &
          'CONTACT PRINT CSTR', 'CONTACT PRINT CDIS', 'CONTACT PRINT CSTRESS', &
          'CONTACT PRINT CDISP')
          continue ! the table has all columns, whatever is named
        case ('NODE FILE V', 'NODE FILE A')
          if (.not. any(reader%cards(:reader%n_cards)%keyword == 'DYNAMIC')) call note(reader, &
            '*NODE FILE: '//quoted(name)//' is not written, for no step is a *DYNAMIC')
        case default
          call note(reader, '*'//card%keyword//': '//quoted(name)//' is not written')
        end select
      end do
    end do
  end subroutine read_variables

end module read_controls_mod
