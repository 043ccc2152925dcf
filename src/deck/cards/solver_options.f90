!> How a contact problem is solved: the options of *CONTACT SOLVER in a deck, and those of the
!> command line for problems that have no deck. One list serves both.
!>
!>     *CONTACT SOLVER, SOLVER=SWEEPS, MAX SWEEPS=100
!>     bipot PROBLEM.hdf5 --solver sweeps --max-sweeps 100
module solver_options_mod
  use controls_mod, only: compliance_auto, compliance_dense, compliance_products, &
    contact_controls_t, formulation_bipotential, &
    formulation_pseudopotential, local_exact, &
    local_newton, local_newton6, local_uzawa, solver_auto, solver_global_newton, solver_sweeps, &
    stop_at_change, stop_at_residual
  use deck_table_mod, only: same_word
  use kinds_mod, only: wp
  use numbers_mod, only: number_ok, read_integer, take_positive
  use text_mod, only: as_list, one_of, string_t
  implicit none
  private

  public :: solver_options, set_solver_option

  !> Options that take a value, by their names in decks. The last two are known in decks only.
  character(*), parameter :: solver_options(9) = [character(11) :: 'SOLVER', 'FORMULATION', &
    'LOCAL', 'RHO', 'RELAXATION', 'TOLERANCE', 'MAX SWEEPS', 'STOP', 'COMPLIANCE']

contains

  !> Give an option a value.
  subroutine set_solver_option(name, value, controls, of_sweeps, wanted, words)
    character(*), intent(in) :: name    !! one of solver_options
    character(*), intent(in) :: value
    !! in any case; in words blanks, hyphens and underlines do not count
    type(contact_controls_t), intent(inout) :: controls
    logical, intent(inout) :: of_sweeps !! set where only sweeps know the option
    character(:), allocatable, intent(out) :: wanted
    !! allocated where there is no such value: what there is, "a number above 0 and below 1"
    type(string_t), allocatable, intent(out) :: words(:) !! to choose from; none for a number
    integer :: i

    allocate (words(0))
    select case (name)
    case ('SOLVER')
      call choose([character(13) :: 'AUTO', 'SWEEPS', 'GLOBAL NEWTON'], &
        [solver_auto, solver_sweeps, solver_global_newton], controls%solver)
    case ('FORMULATION')
      call choose([character(15) :: 'BIPOTENTIAL', 'PSEUDOPOTENTIAL'], &
        [formulation_bipotential, formulation_pseudopotential], controls%formulation)
    case ('LOCAL')
      i = 0 ! AUTO leaves the default, and the choice of the solver
      call choose([character(7) :: 'UZAWA', 'NEWTON', 'NEWTON6', 'EXACT', 'AUTO'], &
        [local_uzawa, local_newton, local_newton6, local_exact, 0], i)
      if (i /= 0) controls%local = i
      if (i /= 0) of_sweeps = .true.
    case ('COMPLIANCE')
      call choose([character(8) :: 'AUTO', 'DENSE', 'PRODUCTS'], &
        [compliance_auto, compliance_dense, compliance_products], controls%compliance)
    case ('STOP')
      call choose([character(8) :: 'RESIDUAL', 'CHANGE'], [stop_at_residual, stop_at_change], &
        controls%stop_rule)
    case ('RHO')
      call take_positive(value, 1.0e15_wp, controls%rho, wanted)
    case ('RELAXATION')
      call take_positive(value, 2.0_wp, controls%relaxation, wanted)
      of_sweeps = .true.
    case ('TOLERANCE')
      call take_positive(value, 1.0_wp, controls%tolerance, wanted)
    case default
      call take_count(controls%max_sweeps)
    end select

  contains

    subroutine choose(names, codes, code)
      character(*), intent(in) :: names(:)
      integer, intent(in) :: codes(:)
      integer, intent(inout) :: code
      character(len(value)) :: word
      integer :: j

      words = as_list(names)
      word = value
      do j = 1, len(word)
        if (scan(word(j:j), '-_') > 0) word(j:j) = ' '
      end do
      do j = 1, size(names)
        if (.not. same_word(word, names(j))) cycle
        code = codes(j)
        return
      end do
      wanted = one_of(names)
    end subroutine choose

    subroutine take_count(count)
      integer, intent(inout) :: count
      integer :: number, status

      call read_integer(value, number, status)
      if (status == number_ok .and. number > 0) then
        count = number
      else
        wanted = 'a whole number above 0'
      end if
    end subroutine take_count

  end subroutine set_solver_option

end module solver_options_mod
