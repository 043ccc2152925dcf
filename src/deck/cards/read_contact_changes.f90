!> What steps change of contact.
!>
!>     *CHANGE FRICTION, INTERACTION=DRY
!>     *FRICTION
!>     0.5
!>     *MODEL CHANGE, TYPE=CONTACT PAIR, REMOVE|ADD
!>     RING-IN, HUB-OUT               slave, master
module read_contact_changes_mod
  use cards_mod, only: note, reader_t, report
  use diagnostics_mod, only: any_mistakes, quoted
  use fields_mod, only: fields_t, name_field, next_data_line
  use friction_laws_mod, only: friction_law_t
  use kinds_mod, only: wp
  use loads_mod, only: friction_t, load_step_t, pair_change_t
  use options_mod, only: allow_no_data, allow_options, card_t, choice_option, has_option, &
    name_option, open_card, option_position
  use read_interactions_mod, only: read_friction
  use read_gaps_mod, only: find_pair
  use scene_mod, only: contact_pair_t
  implicit none
  private

  public :: read_change_friction, read_model_change

contains

  !> *CHANGE FRICTION, which is card `k`, with the *FRICTION below it.
  subroutine read_change_friction(reader, card, k, pairs, step)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    integer, intent(in) :: k
    type(contact_pair_t), intent(in) :: pairs(:)
    type(load_step_t), intent(inout) :: step
    type(card_t) :: below
    character(:), allocatable :: name
    type(friction_law_t) :: law
    real(wp) :: mu
    integer :: p, before
    logical :: ok, is_named, has_friction

    call allow_options(reader, card)
    call allow_no_data(reader, card)
    call name_option(reader, card, 'INTERACTION', .true., name, ok)
    has_friction = .false.
    if (k < reader%n_cards) has_friction = reader%cards(k + 1)%keyword == 'FRICTION'
    if (.not. has_friction) then
      call report(reader, card%position, '*CHANGE FRICTION needs a *FRICTION below it')
      return
    end if
    mu = 0.0_wp
    before = reader%diagnostics%n_mistakes
    call open_card(reader, k + 1, below)
    call read_friction(reader, below, mu, law)
    if (.not. ok .or. reader%diagnostics%n_mistakes > before) return
    if (.not. allocated(step%frictions)) allocate (step%frictions(0))
    is_named = .false.
    do p = 1, size(pairs)
      if (pairs(p)%interaction /= name) cycle
      is_named = .true.
      if (any(step%frictions%pair == p)) then
        call report(reader, card%position, 'surface interaction '//quoted(name)// &
          ' has a *CHANGE FRICTION in this step already')
        return
      end if
      step%frictions = [step%frictions, friction_t(p, mu, law)]
    end do
    ! Pairs of a deck with errors may be missing.
    if (.not. is_named .and. .not. any_mistakes(reader%diagnostics)) call report(reader, &
      option_position(card, 'INTERACTION'), 'no contact pair has a surface interaction '// &
      quoted(name))
  end subroutine read_change_friction

  !> *MODEL CHANGE, TYPE=CONTACT PAIR of the last of the steps so far.
  subroutine read_model_change(reader, card, pairs, steps)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(contact_pair_t), intent(in) :: pairs(:)
    type(load_step_t), intent(inout) :: steps(:)
    type(fields_t) :: fields
    character(:), allocatable :: slave, master
    integer :: kind, pair, i
    logical :: found, ok(2), removes

    call allow_options(reader, card)
    kind = 0
    call choice_option(reader, card, 'TYPE', kind, ok(1))
    if (kind == 0 .and. .not. has_option(card, 'TYPE')) call report(reader, card%position, &
      '*MODEL CHANGE needs TYPE=CONTACT PAIR')
    if (kind == 2) call report(reader, option_position(card, 'TYPE'), &
      '*MODEL CHANGE, TYPE=ELEMENT is not available: elements stay for the whole run', &
      'run a deck of its own without these elements')
    removes = has_option(card, 'REMOVE')
    if (removes .eqv. has_option(card, 'ADD')) then
      call report(reader, card%position, '*MODEL CHANGE needs either ADD or REMOVE')
      return
    end if
    if (kind /= 1) return
    associate (step => steps(size(steps)))
      if (.not. allocated(step%pair_changes)) allocate (step%pair_changes(0))
      do
        call next_data_line(reader, card, fields, found, 2, 'a slave surface and its master')
        if (.not. found) exit
        call name_field(reader, fields, 1, 'a slave surface', slave, ok(1))
        call name_field(reader, fields, 2, 'a master', master, ok(2))
        if (.not. all(ok)) cycle
        if (.not. any([(pairs(i)%name == slave//':'//master, i=1, size(pairs))]) .and. &
          .not. any_mistakes(reader%diagnostics)) then
          if (is_of_tie(reader, slave, master)) then
            call report(reader, fields%start, 'the tie of '//quoted(slave)//' and '// &
              quoted(master)//' cannot end: ties hold for the whole run', &
              'a *CONTACT PAIR in its place can be removed')
            cycle
          end if
        end if
        call find_pair(reader, pairs, slave, master, fields%start, pair)
        if (pair == 0) cycle
        if (any(step%pair_changes%pair == pair)) then
          call report(reader, fields%start, 'contact pair '//quoted(pairs(pair)%name)// &
            ' has a *MODEL CHANGE in this step already')
          cycle
        end if
        if (was_removed(steps(:size(steps) - 1), pair) .eqv. removes) then
          call note(reader, '*MODEL CHANGE of contact pair '//quoted(pairs(pair)%name)// &
            ' changes nothing: it is '//trim(merge('removed', 'there  ', removes))//' already')
          cycle
        end if
        step%pair_changes = [step%pair_changes, pair_change_t(pair, removes)]
      end do
      if (size(step%pair_changes) == 0) deallocate (step%pair_changes)
    end associate
  end subroutine read_model_change

  !> Whether a pair is removed at the end of some steps.
  pure logical function was_removed(steps, pair)
    type(load_step_t), intent(in) :: steps(:)
    integer, intent(in) :: pair
    integer :: k, i

    was_removed = .false.
    do k = 1, size(steps)
      if (.not. allocated(steps(k)%pair_changes)) cycle
      do i = 1, size(steps(k)%pair_changes)
        if (steps(k)%pair_changes(i)%pair == pair) was_removed = steps(k)%pair_changes(i)%is_removed
      end do
    end do
  end function was_removed

  !> Whether a card has these two surfaces, of which there is no contact pair: that of a tie.
  logical function is_of_tie(reader, slave, master)
    type(reader_t), intent(inout) :: reader
    character(*), intent(in) :: slave, master
    type(card_t) :: tie
    type(fields_t) :: fields
    character(:), allocatable :: name, other
    logical :: found, ok(2)
    integer :: k

    is_of_tie = .false.
    do k = 1, reader%n_cards
      if (.not. any(reader%cards(k)%keyword == [character(12) :: 'TIE', 'CONTACT PAIR'])) cycle
      call open_card(reader, k, tie)
      fields = fields_t()
      do
        call next_data_line(reader, tie, fields, found, 2, 'a slave surface and a master surface')
        if (.not. found) exit
        call name_field(reader, fields, 1, 'a slave surface', name, ok(1))
        call name_field(reader, fields, 2, 'a master surface', other, ok(2))
        if (all(ok)) is_of_tie = is_of_tie .or. (name == slave .and. other == master)
      end do
    end do
  end function is_of_tie

end module read_contact_changes_mod
