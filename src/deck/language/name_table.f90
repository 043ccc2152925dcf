!> Lists of named things - obstacles, materials, amplitudes - found by name.
module name_table_mod
  use cards_mod, only: reader_t, report
  use diagnostics_mod, only: guess, quoted
  use lookup_mod, only: find_name, make_name_lookup, name_lookup_t
  use options_mod, only: card_t, name_option
  use text_mod, only: string_t
  implicit none
  private

  public :: name_table_t, open_directory, add_named, close_directory, find_named, find_owner

  !> The names of things of one kind, in the order of the deck.
  type :: name_table_t
    character(:), allocatable :: keyword !! of the card that names one, without star
    character(:), allocatable :: what    !! a name names, for the messages
    type(string_t), allocatable :: names(:)
    integer, allocatable :: position(:) !! of the card
    type(name_lookup_t) :: lookup
    integer :: n = 0
  end type name_table_t

contains

  !> Begin a list, with room for the cards of a keyword and for `others`.
  subroutine open_directory(reader, keyword, what, directory, n, others)
    type(reader_t), intent(in) :: reader
    character(*), intent(in) :: keyword, what
    type(name_table_t), intent(out) :: directory
    integer, intent(out) :: n !! how many there may be
    integer, intent(in), optional :: others

    n = count(reader%cards(:reader%n_cards)%keyword == keyword)
    if (present(others)) n = n + others
    directory%keyword = keyword
    directory%what = what
    allocate (directory%names(n), directory%position(n))
  end subroutine open_directory

  !> Add the thing that NAME= of a card names; one of no letters was reported and is not looked at.
  subroutine add_named(reader, card, directory, name)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(name_table_t), intent(inout) :: directory
    character(:), allocatable, intent(out) :: name !! upper case
    logical :: ok

    call name_option(reader, card, 'NAME', .true., name, ok)
    directory%n = directory%n + 1
    directory%names(directory%n)%text = name
    directory%position(directory%n) = card%position
  end subroutine add_named

  !> Whose property `card` gives: that of the last thing named above it, which may have it once.
  subroutine find_owner(reader, directory, card, given, owner)
    type(reader_t), intent(inout) :: reader
    type(name_table_t), intent(in) :: directory
    type(card_t), intent(in) :: card
    logical, intent(inout) :: given(:)     !! which things have the property
    integer, intent(out) :: owner          !! index of the thing; 0: a mistake was reported

    owner = directory%n
    if (owner == 0) then
      call report(reader, card%position, '*'//card%keyword//' belongs below a *'// &
        directory%keyword)
    else if (given(owner)) then
      call report(reader, card%position, directory%what//' '// &
        quoted(directory%names(owner)%text)//' already has its *'//card%keyword)
      owner = 0
    else
      given(owner) = .true.
    end if
  end subroutine find_owner

  !> Make the look-up, and report repeated names.
  subroutine close_directory(reader, directory)
    type(reader_t), intent(inout) :: reader
    type(name_table_t), intent(inout) :: directory
    integer :: k

    call make_name_lookup(directory%names, directory%n, directory%lookup)
    do k = 1, directory%n
      if (len(directory%names(k)%text) == 0) cycle
      if (find_name(directory%lookup, directory%names, directory%names(k)%text) == k) cycle
      call report(reader, directory%position(k), 'duplicate '//directory%what//' '// &
        quoted(directory%names(k)%text))
    end do
  end subroutine close_directory

  !> Find `name`; a mistake is reported where there is none.
  subroutine find_named(reader, directory, position, name, found)
    type(reader_t), intent(inout) :: reader
    type(name_table_t), intent(in) :: directory
    integer, intent(in) :: position     !! where the deck uses the name
    character(*), intent(in) :: name    !! upper case
    integer, intent(out) :: found       !! its index; 0: there is none

    found = find_name(directory%lookup, directory%names, name)
    if (found == 0) call report(reader, position, directory%what//' '//quoted(name)// &
      ' is not defined', guess(name, directory%names(:directory%n)))
  end subroutine find_named

end module name_table_mod
