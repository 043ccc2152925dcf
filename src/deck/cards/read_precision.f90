!> In which arithmetic the stiffness is factorised.
!>
!>     *PRECISION, FACTOR=DOUBLE, BLOCK LOW RANK=1e-8, OUT OF CORE=NO
!>
!> What it does not say is chosen by the plan, as memory requires.
module read_precision_mod
  use cards_mod, only: reader_t
  use controls_mod, only: precision_controls_t
  use kinds_mod, only: wp
  use options_mod, only: allow_no_data, allow_options, card_t, choice_option, open_only_card, &
    real_option
  implicit none
  private

  public :: read_precision

contains

  !> *PRECISION
  subroutine read_precision(reader, precision)
    type(reader_t), intent(inout) :: reader
    type(precision_controls_t), intent(out) :: precision
    type(card_t) :: card
    integer :: choice
    logical :: found, ok

    call open_only_card(reader, 'PRECISION', card, found)
    if (.not. found) return
    call allow_options(reader, card)
    call allow_no_data(reader, card)
    call choice_option(reader, card, 'FACTOR', choice, ok)
    if (ok) precision%single_factor = choice == 2
    if (ok) precision%factor_is_given = choice < 3
    call real_option(reader, card, 'BLOCK LOW RANK', 1.0_wp, precision%block_low_rank, &
      precision%low_rank_is_given)
    call choice_option(reader, card, 'OUT OF CORE', choice, ok)
    if (ok) precision%out_of_core = choice == 2
    if (ok) precision%core_is_given = choice < 3
  end subroutine read_precision

end module read_precision_mod
