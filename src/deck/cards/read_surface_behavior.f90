!> What *SURFACE BEHAVIOR asks of contact. Contact is hard, and may open unless NO SEPARATION says
!> that it does not: where the card means something else it is a mistake, where it means a stiffness
!> of the contact it is ignored. Pairs that it ties are ties (read_ties_mod).
!>
!>     *SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD
!>     *CHANGE SURFACE BEHAVIOR, INTERACTION=DRY
!>     *SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR
module read_surface_behavior_mod
  use cards_mod, only: note, reader_t, report
  use diagnostics_mod, only: quoted
  use options_mod, only: allow_no_data, allow_options, card_t, choice_option, flag_option, &
    name_option, open_card, option_position
  implicit none
  private

  public :: read_surface_behavior, is_tied, stays_closed

  character(*), parameter :: only_hard = 'contact here is hard; without *SURFACE BEHAVIOR it '// &
    'is taken so'
  integer, parameter :: hard = 1, tied = 4, tabular = 5, exponential = 6

contains

  !> Whether a *SURFACE BEHAVIOR below a *SURFACE INTERACTION ties the surfaces of its pairs.
  logical function is_tied(reader, interaction)
    type(reader_t), intent(inout) :: reader
    character(*), intent(in) :: interaction !! its name
    logical :: stays

    call find_behavior(reader, interaction, is_tied, stays)
  end function is_tied

  !> Whether one below a *SURFACE INTERACTION keeps what has touched closed, and does not tie it.
  logical function stays_closed(reader, interaction)
    type(reader_t), intent(inout) :: reader
    character(*), intent(in) :: interaction !! its name
    logical :: ties

    call find_behavior(reader, interaction, ties, stays_closed)
    stays_closed = stays_closed .and. .not. ties
  end function stays_closed

  !> What the *SURFACE BEHAVIOR below a *SURFACE INTERACTION says.
  subroutine find_behavior(reader, interaction, ties, stays)
    type(reader_t), intent(inout) :: reader
    character(*), intent(in) :: interaction !! its name
    logical, intent(out) :: ties            !! PRESSURE-OVERCLOSURE=TIED
    logical, intent(out) :: stays           !! NO SEPARATION
    character(:), allocatable :: name
    type(card_t) :: card
    integer :: k, law
    logical :: ok, is_below

    ties = .false.
    stays = .false.
    is_below = .false.
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword == 'SURFACE INTERACTION') then
        call open_card(reader, k, card)
        call name_option(reader, card, 'NAME', .true., name, ok)
        is_below = ok .and. name == interaction
      else if (reader%cards(k)%keyword == 'CHANGE SURFACE BEHAVIOR') then
        is_below = .false.
      else if (reader%cards(k)%keyword == 'SURFACE BEHAVIOR' .and. is_below) then
        call open_card(reader, k, card)
        law = hard
        call choice_option(reader, card, 'PRESSURE-OVERCLOSURE', law, ok)
        ties = law == tied
        call flag_option(reader, card, 'NO SEPARATION', stays)
      end if
    end do
  end subroutine find_behavior

  !> *SURFACE BEHAVIOR[, PRESSURE-OVERCLOSURE=law][, NO SEPARATION]; data lines are not read.
  subroutine read_surface_behavior(reader)
    type(reader_t), intent(inout) :: reader
    type(card_t) :: card
    integer :: k, law
    logical :: ok, stays, is_change

    is_change = .false.
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword == 'CHANGE SURFACE BEHAVIOR') call read_change(reader, k)
      if (reader%cards(k)%keyword /= 'SURFACE BEHAVIOR') cycle
      if (k > 1) is_change = reader%cards(k - 1)%keyword == 'CHANGE SURFACE BEHAVIOR'
      call open_card(reader, k, card)
      call allow_options(reader, card)
      law = hard
      call choice_option(reader, card, 'PRESSURE-OVERCLOSURE', law, ok)
      if (law == tied .and. is_change) call report(reader, option_position(card, &
        'PRESSURE-OVERCLOSURE'), 'surfaces are tied from the beginning, or not at all')
      if (law == tied) cycle
      if (law == tabular) then
        call report(reader, option_position(card, 'PRESSURE-OVERCLOSURE'), &
          'PRESSURE-OVERCLOSURE=TABULAR is not available: '//only_hard)
      else if (law == exponential) then
        call note(reader, 'PRESSURE-OVERCLOSURE=EXPONENTIAL of *SURFACE BEHAVIOR is ignored: '// &
          'contact is hard, and nothing presses before it touches')
      else if (law /= hard) then
        call note(reader, '*SURFACE BEHAVIOR is ignored')
      end if
      stays = .false.
      call flag_option(reader, card, 'NO SEPARATION', stays)
      if (stays .and. is_change) call report(reader, option_position(card, 'NO SEPARATION'), &
        'surfaces are without separation from the beginning, or not at all')
    end do
  end subroutine read_surface_behavior

  !> *CHANGE SURFACE BEHAVIOR, which is card `k`: it needs a *SURFACE BEHAVIOR below it.
  subroutine read_change(reader, k)
    type(reader_t), intent(inout) :: reader
    integer, intent(in) :: k
    type(card_t) :: card, other
    character(:), allocatable :: name, named
    logical :: ok, is_there
    integer :: i

    call open_card(reader, k, card)
    call allow_options(reader, card)
    call allow_no_data(reader, card)
    call name_option(reader, card, 'INTERACTION', .true., name, ok)
    is_there = .false.
    if (k < reader%n_cards) is_there = reader%cards(k + 1)%keyword == 'SURFACE BEHAVIOR'
    if (.not. is_there) call report(reader, card%position, &
      '*CHANGE SURFACE BEHAVIOR needs a *SURFACE BEHAVIOR below it')
    if (.not. ok) return
    if (is_tied(reader, name)) then
      call report(reader, card%position, 'surface interaction '//quoted(name)//' ties its '// &
        'surfaces: a tie does not end')
      return
    end if
    if (stays_closed(reader, name)) then
      call report(reader, card%position, 'surface interaction '//quoted(name)//' is without '// &
        'separation: that does not end')
      return
    end if
    do i = 1, k - 1
      if (reader%cards(i)%keyword /= 'SURFACE INTERACTION') cycle
      call open_card(reader, i, other)
      call name_option(reader, other, 'NAME', .true., named, ok)
      if (ok .and. name == named) return
    end do
    call report(reader, option_position(card, 'INTERACTION'), 'surface interaction '// &
      quoted(name)//' is not defined')
  end subroutine read_change

end module read_surface_behavior_mod
