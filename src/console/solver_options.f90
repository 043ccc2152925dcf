!> The options of the command line that say how a contact problem is solved; as *CONTACT SOLVER in a
!> deck.
!>
!>     --solver auto|sweeps|global-newton  --formulation bipotential|pseudopotential
!>     --local uzawa|newton|newton6|exact  --rho X --relaxation X --acceleration
!>     --tolerance X --max-sweeps N
module solver_options_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t, raise, exit_wrong_input
  use text_mod, only: as_list, string_t, to_text, upper, nearest_word
  use numbers_mod, only: read_integer, read_real, number_ok
  use controls_mod, only: contact_controls_t, solver_auto, solver_sweeps, solver_global_newton, &
    formulation_bipotential, formulation_pseudopotential, local_uzawa, local_newton, &
    local_newton6, local_exact
  implicit none
  private

  public :: take_real, is_solver_option, set_solver_option, settle_solver

contains

  !> Say whether an option of the command line is one of these; all take a value.
  pure function is_solver_option(word) result(yes)
    character(*), intent(in) :: word
    logical :: yes

    select case (word)
    case ('--solver', '--formulation', '--local', '--rho', '--relaxation', '--tolerance', &
      '--max-sweeps')
      yes = .true.
    case default
      yes = .false.
    end select
  end function is_solver_option

  !> Take the value of an option.
  subroutine set_solver_option(option, value, controls, error)
    character(*), intent(in) :: option, value
    type(contact_controls_t), intent(inout) :: controls
    type(error_t), allocatable, intent(out) :: error !! no such value
    integer, parameter :: solvers(3) = [solver_auto, solver_sweeps, solver_global_newton]
    integer, parameter :: formulations(2) = [formulation_bipotential, formulation_pseudopotential]
    integer, parameter :: locals(4) = [local_uzawa, local_newton, local_newton6, local_exact]
    integer :: choice

    select case (option)
    case ('--solver')
      call choose(option, value, as_list([character(13) :: 'auto', 'sweeps', &
        'global-newton']), choice, error)
      if (.not. allocated(error)) controls%solver = solvers(choice)
    case ('--formulation')
      call choose(option, value, as_list([character(15) :: 'bipotential', &
        'pseudopotential']), choice, &
        error)
      if (.not. allocated(error)) controls%formulation = formulations(choice)
    case ('--local')
      call choose(option, value, as_list([character(7) :: 'uzawa', 'newton', 'newton6', &
        'exact']), choice, error)
      if (.not. allocated(error)) controls%local = locals(choice)
    case ('--rho')
      call take_real(option, value, 1.0e6_wp, controls%rho, error)
    case ('--relaxation')
      call take_real(option, value, 2.0_wp, controls%relaxation, error)
    case ('--tolerance')
      call take_real(option, value, 1.0_wp, controls%tolerance, error)
    case default ! --max-sweeps
      call take_integer(option, value, controls%max_sweeps, error)
    end select
  end subroutine set_solver_option

  !> What only sweeps know means SWEEPS, and beside global Newton it is a mistake.
  subroutine settle_solver(sweeps_option, controls, error)
    character(*), intent(in) :: sweeps_option !! the one given of those, empty for none
    type(contact_controls_t), intent(inout) :: controls
    type(error_t), allocatable, intent(out) :: error

    if (sweeps_option == '') return
    if (controls%solver == solver_global_newton) then
      call raise(error, exit_wrong_input, 'bipot: error: '//sweeps_option// &
        ' belongs to the sweeps, not to --solver global-newton')
    else
      controls%solver = solver_sweeps
    end if
  end subroutine settle_solver

  !> One of several words, in any case; a blank or an underline is as good as a hyphen.
  subroutine choose(option, value, words, choice, error)
    character(*), intent(in) :: option, value
    type(string_t), intent(in) :: words(:)
    integer, intent(out) :: choice
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: list, wanted
    integer :: i

    wanted = upper(value)
    do i = 1, len(wanted)
      if (scan(wanted(i:i), ' _') > 0) wanted(i:i) = '-'
    end do
    list = ''
    do choice = 1, size(words)
      if (upper(words(choice)%text) == wanted) return
      list = list//', '//words(choice)%text
    end do
    choice = 0
    i = nearest_word(value, words)
    if (i > 0) then
      call raise(error, exit_wrong_input, 'bipot: error: '//option//" has no '"//value// &
        "', did you mean '"//words(i)%text//"'?")
    else
      call raise(error, exit_wrong_input, 'bipot: error: '//option//" has no '"//value// &
        "', only"//list(2:))
    end if
  end subroutine choose

  subroutine take_real(option, text, below, value, error)
    character(*), intent(in) :: option, text
    real(wp), intent(in) :: below
    real(wp), intent(inout) :: value
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: number
    integer :: status

    call read_real(text, number, status)
    if (status == number_ok .and. number > 0.0_wp .and. number < below) then
      value = number
    else
      call raise(error, exit_wrong_input, 'bipot: error: '//option//' wants a number above 0 '// &
        'and below '//to_text(below)//", found '"//text//"'")
    end if
  end subroutine take_real

  subroutine take_integer(option, text, value, error)
    character(*), intent(in) :: option, text
    integer, intent(inout) :: value
    type(error_t), allocatable, intent(out) :: error
    integer :: number, status

    call read_integer(text, number, status)
    if (status == number_ok .and. number > 0) then
      value = number
    else
      call raise(error, exit_wrong_input, 'bipot: error: '//option// &
        " wants a whole number above 0, found '"//text//"'")
    end if
  end subroutine take_integer

end module solver_options_mod
