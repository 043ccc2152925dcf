!> The options of a keyword line: `*KEYWORD, NAME=VALUE, FLAG`.
module options_mod
  use cards_mod, only: card_place_t, is_data_line, keep_reading, note, pieces_t, reader_t, report, &
    report_in_field, split_line
  use diagnostics_mod, only: guess, quoted
  use deck_table_mod, only: fitted, item_t, rule_of, rule_t, same_word, split_at, split_items, &
    squeeze
  use kinds_mod, only: wp
  use numbers_mod, only: number_ok, read_integer, read_real, take_positive
  use substitution_mod, only: substitute
  use text_mod, only: one_of, string_t, to_text, upper
  implicit none
  private

  public :: card_t, open_card, open_only_card, allow_options, has_option, option_position
  public :: flag_option, name_option, text_option, integer_option, real_option, choice_option
  public :: signed_option, look_for_finite_strain
  public :: allow_no_data, unquote, as_name, checked_name, max_name

  integer, parameter :: max_name = 80 !! longest name of a set, a surface, a material [byte]
  integer, parameter :: max_options = 100

  type :: option_t
    character(:), allocatable :: name   !! upper case, without blanks
    character(:), allocatable :: value  !! with parameters put in, without quotes
    logical :: has_value = .false.
    integer :: position = 0
    integer :: value_position = 0
  end type option_t

  !> A card whose keyword line has been read.
  type :: card_t
    type(card_place_t) :: place
    character(:), allocatable :: keyword
    integer :: position = 0 !! of its star
    type(option_t), allocatable :: options(:)
    integer :: n_options = 0
  end type card_t

contains

  !> Read the keyword line of card `k`.
  subroutine open_card(reader, k, card)
    type(reader_t), intent(inout) :: reader
    integer, intent(in) :: k !! 1 .. reader%n_cards
    type(card_t), intent(out) :: card
    type(pieces_t) :: pieces
    integer :: line, i, first_piece, n

    card%place = reader%cards(k)
    card%keyword = trim(card%place%keyword)
    n = 0
    do line = card%place%header, card%place%first - 1
      call split_line(reader%source, line, pieces)
      n = n + pieces%n
    end do
    allocate (card%options(min(n, max_options)))
    do line = card%place%header, card%place%first - 1
      first_piece = 1
      if (line == card%place%header) then
        call split_line(reader%source, line, pieces)
        card%position = pieces%first(1)
        first_piece = 2
      else if (is_data_line(reader%source, line)) then
        call split_line(reader%source, line, pieces)
      else
        cycle
      end if
      do i = first_piece, pieces%n
        if (.not. keep_reading(reader)) return
        call add_option(reader, card, pieces%first(i), pieces%last(i))
      end do
    end do
  end subroutine open_card

  !> Whether a *STEP of the deck, or the command line, asks for finite strain.
  subroutine look_for_finite_strain(reader, is_asked)
    type(reader_t), intent(inout) :: reader
    logical, intent(out) :: is_asked
    type(card_t) :: card
    integer :: k

    is_asked = reader%reading%nlgeom == 'YES' .or. reader%reading%nlgeom == 'AUTO'
    if (reader%reading%nlgeom /= '') return
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'STEP') cycle
      call open_card(reader, k, card)
      is_asked = is_asked .or. has_option(card, 'NLGEOM')
    end do
  end subroutine look_for_finite_strain

  !> Open the only card of a keyword; every further one is a mistake.
  subroutine open_only_card(reader, keyword, card, found)
    type(reader_t), intent(inout) :: reader
    character(*), intent(in) :: keyword !! upper case, without star
    type(card_t), intent(out) :: card   !! the first one
    logical, intent(out) :: found       !! false: there is none
    type(card_t) :: further
    integer :: k

    found = .false.
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= keyword) cycle
      if (found) then
        call open_card(reader, k, further)
        call report(reader, further%position, 'a second *'//keyword)
      else
        call open_card(reader, k, card)
        found = .true.
      end if
    end do
  end subroutine open_only_card

  !> Take apart the option at first..last.
  subroutine add_option(reader, card, first, last)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(inout) :: card
    integer, intent(in) :: first, last
    type(option_t) :: option
    character(:), allocatable :: problem
    integer :: equal, start, at, i

    if (last < first) return
    equal = index(reader%source%text(first:last), '=')
    option%position = first
    option%value = ''
    if (equal == 0) then
      option%name = squeeze(reader%source%text(first:last))
    else
      option%name = squeeze(reader%source%text(first:first + equal - 2))
      start = first + equal
      do while (start <= last)
        if (scan(reader%source%text(start:start), ' '//achar(9)) == 0) exit
        start = start + 1
      end do
      option%value_position = min(start, last)
      option%has_value = .true.
      if (start > last) then
        call report(reader, first, quoted(option%name)//' has no value after its equal sign')
      else if (index(reader%source%text(start:last), '<') > 0) then
        call substitute(reader%source%text(start:last), start, reader%parameters, option%value, &
          problem, at)
        if (allocated(problem)) then
          call report(reader, start + at - 1, problem)
          option%value = ''
        end if
        option%value = unquote(option%value)
      else
        option%value = unquote(reader%source%text(start:last))
      end if
    end if
    call lengthen(reader, card%keyword, option%name)
    do i = 1, card%n_options
      if (card%options(i)%name /= option%name) cycle
      call report(reader, first, 'duplicate parameter '//quoted(option%name))
      return
    end do
    if (card%n_options == max_options) then
      call report(reader, first, 'too many parameters on a keyword line')
      return
    end if
    card%n_options = card%n_options + 1
    card%options(card%n_options) = option
  end subroutine add_option

  !> The whole name of an option that is shortened, as Abaqus lets decks do: to three letters or
  !> more, with which one option of the card begins.
  subroutine lengthen(reader, keyword, name)
    type(reader_t), intent(inout) :: reader
    character(*), intent(in) :: keyword
    character(:), allocatable, intent(inout) :: name !! upper case, without blanks
    type(rule_t) :: rule
    type(item_t), allocatable :: read(:), ignored(:)
    character(:), allocatable :: whole !! as `name`
    character(:), allocatable :: words !! as the table has it
    integer :: i

    rule = rule_of(keyword)
    if (len(name) < 3) return
    call split_items(rule%options, read)
    call split_items(rule%ignored, ignored)
    do i = 1, size(read) + size(ignored)
      if (i <= size(read)) then
        call compare(read(i)%name)
      else
        call compare(ignored(i - size(read))%name)
      end if
      if (allocated(whole)) then
        if (whole == '') return
      end if
    end do
    if (.not. allocated(whole)) return
    if (whole /= name) call note(reader, name//' of *'//keyword//' is read as '//words)
    name = whole

  contains

    !> Take an option that begins with the name; of two the one that begins the other (FREQUENCY of
    !> FREQUENCYF), none where neither does.
    subroutine compare(option)
      character(*), intent(in) :: option
      character(:), allocatable :: candidate

      candidate = squeeze(option)
      if (index(candidate, name) /= 1) return
      if (.not. allocated(whole)) then
        whole = candidate
        words = option
      else if (index(whole, candidate) == 1) then
        whole = candidate
        words = option
      else if (index(candidate, whole) /= 1) then
        whole = ''
      end if
    end subroutine compare

  end subroutine lengthen

  !> Report the options that the table of the deck does not give to the card's keyword; note those
  !> that it ignores.
  subroutine allow_options(reader, card, taken)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    character(*), intent(in), optional :: taken !! an option of which the caller says more
    type(rule_t) :: rule
    type(item_t), allocatable :: allowed(:), ignored(:)
    integer :: i, j

    rule = rule_of(card%keyword)
    call split_items(rule%options, allowed)
    call split_items(rule%ignored, ignored)
    options: do i = 1, card%n_options
      if (present(taken)) then
        if (same_word(card%options(i)%name, taken)) cycle options
      end if
      do j = 1, size(allowed)
        if (same_word(card%options(i)%name, allowed(j)%name)) cycle options
      end do
      do j = 1, size(ignored)
        if (.not. same_word(card%options(i)%name, ignored(j)%name)) cycle
        call note(reader, ignored(j)%name//' of *'//card%keyword//' is ignored')
        cycle options
      end do
      call report_in_field(reader, card%options(i)%position, 'unknown parameter '// &
        quoted(card%options(i)%name)//' of *'//card%keyword, instead_of(card%keyword, &
        card%options(i)%name, allowed))
      call doubt_lines(reader, card)
    end do options
  end subroutine allow_options

  !> What to write in the place of an option that a card has elsewhere, or what may be meant by it.
  pure function instead_of(keyword, option, allowed) result(hint)
    character(*), intent(in) :: keyword, option
    type(item_t), intent(in) :: allowed(:) !! options of the card
    character(:), allocatable :: hint
    type(string_t) :: known(size(allowed))
    integer :: i

    if (keyword == 'STATIC' .and. same_word(option, 'RIKS')) then
      hint = 'where the load falls on its way prescribe displacements: *BOUNDARY'
    else if (same_word(option, 'TEST DATA INPUT')) then
      hint = fitted
    else if (keyword == 'RIGID BODY' .and. same_word(option, 'POSITION')) then
      hint = 'the reference node stays where its coordinates are'
    else if (keyword == 'CYCLIC SYMMETRY MODEL' .and. same_word(option, 'CONTACT')) then
      hint = 'sectors do not touch each other: their sides move alike'
    else
      do i = 1, size(allowed)
        known(i)%text = allowed(i)%name
      end do
      hint = guess(option, known)
    end if
  end function instead_of

  !> The words that an option takes, by the table of the deck.
  pure subroutine find_words(keyword, name, words)
    character(*), intent(in) :: keyword, name
    type(string_t), allocatable, intent(out) :: words(:)
    type(rule_t) :: rule
    type(item_t), allocatable :: items(:)
    integer :: i

    rule = rule_of(keyword)
    call split_items(rule%options, items)
    do i = 1, size(items)
      if (items(i)%name == name) exit
    end do
    call split_at(items(i)%value, '|', words)
  end subroutine find_words

  pure integer function find_option(card, name) result(found)
    type(card_t), intent(in) :: card
    character(*), intent(in) :: name

    do found = card%n_options, 1, -1
      if (same_word(card%options(found)%name, name)) return
    end do
  end function find_option

  pure logical function has_option(card, name) result(has)
    type(card_t), intent(in) :: card
    character(*), intent(in) :: name

    has = find_option(card, name) > 0
  end function has_option

  !> The place of an option's value (or name); of the card when it has no such option.
  pure function option_position(card, name) result(position)
    type(card_t), intent(in) :: card
    character(*), intent(in) :: name
    integer :: position, i

    position = card%position
    i = find_option(card, name)
    if (i == 0) return
    position = card%options(i)%position
    if (card%options(i)%has_value) position = card%options(i)%value_position
  end function option_position

  !> A flag: set where it stands alone or with the value YES, not set with NO.
  subroutine flag_option(reader, card, name, set, other, is_other)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    character(*), intent(in) :: name
    logical, intent(inout) :: set !! unchanged when the option is absent, wrong or another word
    character(*), intent(in), optional :: other !! a word beside YES and NO
    logical, intent(out), optional :: is_other  !! there with it: it is that word
    character(:), allocatable :: words
    integer :: i

    words = 'YES or NO'
    if (present(other)) words = 'YES, NO or '//other
    if (present(other)) is_other = .false.
    i = find_option(card, name)
    if (i == 0) return
    if (present(other)) then
      is_other = card%options(i)%has_value .and. same_word(card%options(i)%value, other)
      if (is_other) return
    end if
    if (.not. card%options(i)%has_value) then
      set = .true.
    else if (same_word(card%options(i)%value, 'YES')) then
      set = .true.
    else if (same_word(card%options(i)%value, 'NO')) then
      set = .false.
    else if (len(card%options(i)%value) > 0) then ! else it was reported when it was read
      call report(reader, card%options(i)%value_position, name//' takes no value but '//words// &
        ', found '//quoted(card%options(i)%value))
    end if
  end subroutine flag_option

  !> The name that option `name` gives, in upper case.
  subroutine name_option(reader, card, name, required, value, ok)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    character(*), intent(in) :: name
    logical, intent(in) :: required   !! its absence is a mistake
    character(:), allocatable, intent(out) :: value
    logical, intent(out) :: ok        !! false: absent, or a mistake was reported

    integer :: i

    value = ''
    call value_option(reader, card, name, required, i)
    ok = i > 0
    if (.not. ok) return
    call checked_name(reader, card%options(i)%value_position, card%options(i)%value, value, ok)
  end subroutine name_option

  !> The value of option `name` as it stands.
  subroutine text_option(reader, card, name, value, ok)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    character(*), intent(in) :: name
    character(:), allocatable, intent(out) :: value
    logical, intent(out) :: ok !! false: absent, or a mistake was reported
    integer :: i

    value = ''
    call value_option(reader, card, name, .false., i)
    ok = i > 0
    if (ok) value = card%options(i)%value
  end subroutine text_option

  !> Find an option that has a value; `found` is 0 when there is none.
  subroutine value_option(reader, card, name, required, found)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    character(*), intent(in) :: name
    logical, intent(in) :: required
    integer, intent(out) :: found

    found = find_option(card, name)
    if (found == 0) then
      if (required) call report(reader, card%position, '*'//card%keyword//' needs '//name//'=')
    else if (.not. card%options(found)%has_value) then
      call report(reader, card%options(found)%position, name//' needs a value: '//name//'=')
      found = 0
    else if (len(card%options(found)%value) == 0) then
      found = 0 ! was reported when it was read
    end if
  end subroutine value_option

  !> A whole number from `lowest` to `highest`.
  subroutine integer_option(reader, card, name, lowest, highest, value, ok)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    character(*), intent(in) :: name
    integer, intent(in) :: lowest, highest
    integer, intent(inout) :: value !! unchanged when the option is absent
    logical, intent(out) :: ok      !! false: absent, or a mistake was reported
    integer :: i, number, status

    call value_option(reader, card, name, .false., i)
    ok = .false.
    if (i == 0) return
    call read_integer(card%options(i)%value, number, status)
    ok = status == number_ok .and. number >= lowest .and. number <= highest
    if (ok) then
      value = number
    else
      call report(reader, card%options(i)%value_position, name//' must be a whole number from '// &
        to_text(lowest)//' to '//to_text(highest)//', not '//quoted(card%options(i)%value))
    end if
  end subroutine integer_option

  !> A number between 0 and `below`, neither included.
  subroutine real_option(reader, card, name, below, value, ok)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    character(*), intent(in) :: name
    real(wp), intent(in) :: below
    real(wp), intent(inout) :: value     !! unchanged when the option is absent
    logical, intent(out) :: ok           !! false: absent, or a mistake was reported
    character(:), allocatable :: wanted
    integer :: i

    call value_option(reader, card, name, .false., i)
    ok = i > 0
    if (.not. ok) return
    call take_positive(card%options(i)%value, below, value, wanted)
    ok = .not. allocated(wanted)
    if (.not. ok) call report(reader, card%options(i)%value_position, name//' must be '//wanted// &
      ', not '//quoted(card%options(i)%value))
  end subroutine real_option

  !> A number of either sign that an option must have.
  subroutine signed_option(reader, card, name, value, ok)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    character(*), intent(in) :: name
    real(wp), intent(out) :: value       !! 0 where not ok
    logical, intent(out) :: ok           !! false: an error was reported
    integer :: i, status

    value = 0.0_wp
    call value_option(reader, card, name, .true., i)
    ok = i > 0
    if (.not. ok) return
    call read_real(card%options(i)%value, value, status)
    ok = status == number_ok
    if (.not. ok) call report(reader, card%options(i)%value_position, name// &
      ' must be a number, not '//quoted(card%options(i)%value))
  end subroutine signed_option

  !> One of the words that the table of the deck gives the option; `choice` is its place there.
  subroutine choice_option(reader, card, name, choice, ok)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    character(*), intent(in) :: name
    integer, intent(inout) :: choice      !! unchanged when the option is absent or wrong
    logical, intent(out) :: ok            !! false: absent, or a mistake was reported
    type(string_t), allocatable :: words(:)
    integer :: i, j

    call value_option(reader, card, name, .false., i)
    ok = .false.
    if (i == 0) return
    call find_words(card%keyword, name, words)
    do j = 1, size(words)
      if (.not. same_word(card%options(i)%value, words(j)%text)) cycle
      choice = j
      ok = .true.
      return
    end do
    call report(reader, card%options(i)%value_position, name//' must be '//one_of(words)// &
      ', not '//quoted(card%options(i)%value), guess(upper(card%options(i)%value), words))
    call doubt_lines(reader, card)
  end subroutine choice_option

  !> Say of the lines of a card that an option of it is not understood, with which they may mean
  !> something else.
  subroutine doubt_lines(reader, card)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card

    reader%doubted = reader%source%first([card%place%first, card%place%last + 1]) - [0, 1]
  end subroutine doubt_lines

  !> Report data lines below a keyword that takes none.
  subroutine allow_no_data(reader, card)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(pieces_t) :: pieces
    integer :: line

    do line = card%place%first, card%place%last
      if (.not. is_data_line(reader%source, line)) cycle
      call split_line(reader%source, line, pieces)
      call report(reader, pieces%first(1), '*'//card%keyword//' has no data lines')
      return
    end do
  end subroutine allow_no_data

  !> A name in upper case, of a length that the result file can hold.
  subroutine checked_name(reader, position, text, name, ok)
    type(reader_t), intent(inout) :: reader
    integer, intent(in) :: position
    character(*), intent(in) :: text
    character(:), allocatable, intent(out) :: name
    logical, intent(out) :: ok

    ok = len(text) >= 1 .and. len(text) <= max_name
    name = ''
    if (ok) then
      name = upper(text)
    else if (len(text) == 0) then
      call report(reader, position, 'expected a name')
    else
      call report(reader, position, 'a name has at most 80 letters: '//quoted(text))
    end if
  end subroutine checked_name

  !> `text` without the quotes and blanks around it.
  pure function unquote(text) result(bare)
    character(*), intent(in) :: text
    character(:), allocatable :: bare
    integer :: n

    bare = trim(adjustl(text))
    n = len(bare)
    if (n < 2) return
    if (scan(bare(1:1), '"''') == 1 .and. bare(1:1) == bare(n:n)) bare = bare(2:n - 1)
  end function unquote

  !> A name in quotes where it has letters that mean something else in a line.
  pure function as_name(name) result(text)
    character(*), intent(in) :: name
    character(:), allocatable :: text

    text = name
    if (scan(name, ' ,=''') > 0) text = '"'//name//'"'
  end function as_name

end module options_mod
