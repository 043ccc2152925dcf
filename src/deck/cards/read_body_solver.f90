!> How solutions for the bodies are found: with a factor of their stiffness, or by iteration; at
!> finite strain, of which tangent.
!>
!>     *BODY SOLVER, TYPE=FACTOR, TANGENT=NEWTON
module read_body_solver_mod
  use cards_mod, only: reader_t
  use controls_mod, only: precision_controls_t
  use options_mod, only: allow_no_data, allow_options, card_t, choice_option, open_only_card
  implicit none
  private

  public :: read_body_solver

contains

  !> *BODY SOLVER, behind *PRECISION.
  subroutine read_body_solver(reader, precision)
    type(reader_t), intent(inout) :: reader
    type(precision_controls_t), intent(inout) :: precision
    type(card_t) :: card
    integer :: choice
    logical :: found, ok

    call open_only_card(reader, 'BODY SOLVER', card, found)
    if (.not. found) return
    call allow_options(reader, card)
    call allow_no_data(reader, card)
    call choice_option(reader, card, 'TYPE', choice, ok)
    if (ok) precision%iterative = choice == 2
    if (ok) precision%body_is_given = choice < 3
    call choice_option(reader, card, 'TANGENT', choice, ok)
    if (ok) precision%renews_tangent = choice == 2
    if (ok) precision%tangent_is_given = choice < 3
  end subroutine read_body_solver

end module read_body_solver_mod
