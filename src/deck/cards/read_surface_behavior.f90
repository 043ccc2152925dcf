!> What *SURFACE BEHAVIOR asks of contact. Contact is hard and may open: where the card means
!> something else it is a mistake, where it means a stiffness of the contact it is ignored.
!>
!>     *SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD
module read_surface_behavior_mod
  use cards_mod, only: note, reader_t, report
  use options_mod, only: card_t, choice_option, flag_option, open_card, option_position
  implicit none
  private

  public :: read_surface_behavior

  character(*), parameter :: only_hard = 'contact here is hard and may open; without '// &
    '*SURFACE BEHAVIOR it is taken so'

contains

  !> *SURFACE BEHAVIOR[, PRESSURE-OVERCLOSURE=law][, NO SEPARATION]; data lines are not read.
  subroutine read_surface_behavior(reader)
    type(reader_t), intent(inout) :: reader
    character(12), parameter :: laws(6) = [character(12) :: 'HARD', 'LINEAR', 'SCALE FACTOR', &
      'TIED', 'TABULAR', 'EXPONENTIAL']
    integer, parameter :: hard = 1, tied = 4
    type(card_t) :: card
    integer :: k, law
    logical :: ok, stays_closed

    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'SURFACE BEHAVIOR') cycle
      call open_card(reader, k, card)
      law = hard
      call choice_option(reader, card, 'PRESSURE-OVERCLOSURE', laws, law, ok)
      if (law == tied) then
        call report(reader, option_position(card, 'PRESSURE-OVERCLOSURE'), &
          'PRESSURE-OVERCLOSURE=TIED is not available: *TIE in place of *CONTACT PAIR ties '// &
          'two surfaces')
      else if (law > tied) then
        call report(reader, option_position(card, 'PRESSURE-OVERCLOSURE'), &
          'PRESSURE-OVERCLOSURE='//trim(laws(law))//' is not available: '//only_hard)
      else if (law /= hard) then
        call note(reader, '*SURFACE BEHAVIOR is ignored')
      end if
      stays_closed = .false.
      call flag_option(reader, card, 'NO SEPARATION', stays_closed)
      if (stays_closed) call report(reader, option_position(card, 'NO SEPARATION'), &
        'NO SEPARATION is not available: '//only_hard)
    end do
  end subroutine read_surface_behavior

end module read_surface_behavior_mod
