!> A deck cut into cards: a keyword line, lines that continue it, and the data lines below.
!>
!>     *NSET, NSET=TOP,      keyword line: the keyword and its options
!>     GENERATE              continued, because the line above ends with a comma
!>     ** a comment
!>     1, 9, 2               data lines: fields between commas
module cards_mod
  use deck_source_mod, only: place_of, place_t, source_t
  use diagnostics_mod, only: add_mistake, add_note, diagnostics_t, guess, quoted, wants_more
  use deck_table_mod, only: find_rule, in_model, in_model_or_first_step, in_step, is_ignored, &
    is_missing, is_outside, is_other_step, is_procedure, item_t, keyword_names, max_keyword, &
    rule_of, rule_t, same_word, says, split_items
  use parameters_mod, only: parameter_table_t
  use substitution_mod, only: define_parameter
  use text_mod, only: to_text
  implicit none
  private

  public :: reader_t, reading_t, card_place_t, pieces_t, find_cards, read_parameters
  public :: report, report_missing_element, report_in_field, note, keep_reading, split_line
  public :: is_data_line, is_keyword_line

  character, parameter :: tab = achar(9)

  integer, parameter :: blank_line = 0, keyword_line = 1, data_line = 2

  !> Where the lines of a card are, and in which step it stands.
  type :: card_place_t
    character(max_keyword) :: keyword = '' !! upper case, without star
    integer :: header = 0   !! line of the keyword
    integer :: first = 0    !! first line below the keyword line and its continuation
    integer :: last = 0     !! last line before the next card
    integer :: step = 0     !! number of the step it stands in; 0: before the first
    logical :: is_refused = .false. !! an error was reported, and nothing of it is read
  end type card_place_t

  !> How the command line wants a deck to be read.
  type :: reading_t
    character(4) :: nlgeom = ''     !! NO, YES or AUTO in place of the deck's (--nlgeom)
    logical :: elastic = .false.      !! *PLASTIC is a yield stress that is compared (--elastic)
    logical :: static_steps = .false. !! the static steps that it begins with (--static-steps)
  end type reading_t

  !> Everything the readers of the keywords share.
  type :: reader_t
    type(source_t) :: source
    type(diagnostics_t) :: diagnostics
    type(parameter_table_t) :: parameters
    type(card_place_t), allocatable :: cards(:)
    integer :: n_cards = 0
    integer :: n_steps = 0
    logical :: lacks_elements = .false.
    !! elements of the deck, or what else its nodes belong to, were refused
    logical :: other_field = .false.    !! a keyword or an element of another field was refused
    integer :: doubted(2) = 0
    !! first and last place of the lines of a card with an option that is not understood
    type(reading_t) :: reading
    logical :: chooses_theory = .false. !! AUTO, of the deck or of the option
    logical :: keeps_small_strain = .false. !! NO likewise
    logical :: numbers_block = .false. !! a node or element of a *BLOCK is meant by its number
  end type reader_t

  !> The pieces between the commas of a line: positions without the blanks around.
  type :: pieces_t
    integer :: n = 0
    integer, allocatable :: first(:)
    integer, allocatable :: last(:)     !! first - 1 for an empty piece
    logical :: ends_with_comma = .false.
    logical :: has_parameters = .false. !! a `<` is somewhere in the line
  end type pieces_t

contains

  !> Record a mistake at a place of the deck, but for lines in doubt.
  subroutine report(reader, position, message, hint)
    type(reader_t), intent(inout) :: reader
    integer, intent(in) :: position
    character(*), intent(in) :: message
    character(*), intent(in), optional :: hint

    if (position > 0 .and. position >= reader%doubted(1) .and. position <= reader%doubted(2)) return
    call add_mistake(reader%diagnostics, reader%source, position, message, hint)
  end subroutine report

  !> Record an error that only says that elements are missing: not where their type was refused, or
  !> a keyword of another field.
  subroutine report_missing_element(reader, position, message, hint)
    type(reader_t), intent(inout) :: reader
    integer, intent(in) :: position
    character(*), intent(in) :: message
    character(*), intent(in), optional :: hint

    if (.not. (reader%lacks_elements .or. reader%other_field)) call report(reader, position, &
      message, hint)
  end subroutine report_missing_element

  !> Record an error that a deck of another field has: dofs of temperatures and rotations, materials
  !> that are not elastic, its options. Not where a keyword or element of that field was refused.
  subroutine report_in_field(reader, position, message, hint)
    type(reader_t), intent(inout) :: reader
    integer, intent(in) :: position
    character(*), intent(in) :: message
    character(*), intent(in), optional :: hint

    if (.not. reader%other_field) call report(reader, position, message, hint)
  end subroutine report_in_field

  !> Record a note, one sentence.
  subroutine note(reader, text)
    type(reader_t), intent(inout) :: reader
    character(*), intent(in) :: text

    call add_note(reader%diagnostics, text)
  end subroutine note

  !> False once so many mistakes are known that reading on makes no sense.
  pure logical function keep_reading(reader) result(keep)
    type(reader_t), intent(in) :: reader

    keep = wants_more(reader%diagnostics)
  end function keep_reading

  !> Find the cards of the source: those to be read, each at a place where it may stand.
  subroutine find_cards(reader)
    type(reader_t), intent(inout) :: reader
    type(card_place_t) :: card
    type(pieces_t) :: pieces
    type(place_t) :: place
    integer :: line, kind, step, open_step
    logical :: inside

    step = 0
    open_step = 0
    inside = .false.
    card%last = 0
    allocate (reader%cards(64))
    lines: do line = 1, reader%source%n_lines
      kind = kind_of_line(reader%source, line)
      if (kind == keyword_line) then
        call close_card(line - 1)
        call open_keyword(line)
      else if (kind == data_line .and. .not. inside) then
        call split_line(reader%source, line, pieces)
        associate (text => reader%source%text(pieces%first(1):reader%source%first(line + 1) - 2))
          if (index(text, '**') > 0) then
            place = place_of(reader%source, pieces%first(1))
            call note(reader, 'line '//to_text(place%line)//' of '//place%file//' is taken for '// &
              'a comment, as "**" stands in it: it belongs to no keyword')
            cycle lines
          end if
        end associate
        call report(reader, pieces%first(1), 'this line belongs to no keyword', &
          other_format(reader%source%text(pieces%first(1):reader%source%first(line + 1) - 2)))
        inside = .true. ! say it once
      end if
      if (.not. keep_reading(reader)) return
    end do lines
    call close_card(reader%source%n_lines)
    if (open_step > 0) call report(reader, first_letter(reader%source, open_step), &
      '*STEP without *END STEP: is the deck complete?')
    reader%n_steps = step

  contains

    subroutine open_keyword(line)
      integer, intent(in) :: line
      type(rule_t) :: keyword
      integer :: star, first, last
      logical :: found

      inside = .true.
      call split_line(reader%source, line, pieces)
      star = pieces%first(1)
      first = star + 1
      last = pieces%last(1)
      card = card_place_t(header=line, first=line + 1)
      call find_rule(reader%source%text(first:last), keyword, found)
      if (.not. found) then
        associate (word => reader%source%text(star:last))
          call report(reader, star, 'unknown keyword '//quoted(word), guess(word, keyword_names()))
        end associate
      else if (keyword%name == 'DYNAMIC' .and. says_quasi_static()) then
        call note(reader, '*DYNAMIC, APPLICATION=QUASI-STATIC is read as *STATIC: inertia is '// &
          'left out')
        call enter(rule_of('STATIC'), star, line)
      else if (reader%reading%elastic .and. any(keyword%name == [character(max_keyword) :: &
        'PLASTIC', 'CYCLIC HARDENING', 'RATE DEPENDENT'])) then
        call enter(keyword, star, line)
        if (keyword%name /= 'PLASTIC') call note(reader, '*'//trim(keyword%name)// &
          ' is left out: --elastic')
      else if (keyword%reading == is_missing) then
        call refuse(keyword, star, '*'//trim(keyword%name)//' is not available in this version', &
          trim(keyword%remark))
      else if (any(keyword%reading == [is_outside, is_procedure])) then
        reader%other_field = .true.
        call refuse(keyword, star, '*'//trim(keyword%name)// &
          ': bipot solves static frictional contact of elastic solids', trim(keyword%remark)// &
          steps_before(keyword%name))
      else if (keyword%reading == is_ignored) then
        call note(reader, '*'//trim(keyword%name)//' is ignored'//why(keyword%remark))
      else
        call enter(keyword, star, line)
      end if
    end subroutine open_keyword

    !> Whether an option of the keyword line says APPLICATION=QUASI-STATIC.
    pure logical function says_quasi_static()
      integer :: i

      says_quasi_static = any([(says(reader%source%text(pieces%first(i):pieces%last(i)), &
        'APPLICATION', 'QUASI-STATIC'), i=2, pieces%n)])
    end function says_quasi_static

    !> That the static steps before another one could run.
    pure function steps_before(name) result(words)
      character(*), intent(in) :: name
      character(:), allocatable :: words

      words = ''
      if (step > 1 .and. is_other_step(name)) words = '; --static-steps runs the steps before it'
    end function steps_before

    !> Report a keyword that is not read, where it stands first. Readers of other cards see that it
    !> was there, and report nothing that only follows from it.
    subroutine refuse(keyword, star, message, hint)
      type(rule_t), intent(in) :: keyword
      integer, intent(in) :: star
      character(*), intent(in) :: message
      character(*), intent(in), optional :: hint

      associate (before => reader%cards(:reader%n_cards))
        if (.not. any(before%is_refused .and. before%keyword == keyword%name)) call report( &
          reader, star, message, hint)
      end associate
      card%keyword = keyword%name
      card%step = step
      card%is_refused = .true.
      reader%lacks_elements = reader%lacks_elements .or. any(keyword%name == [character( &
        max_keyword) :: 'SHELL SECTION', 'BEAM SECTION', 'BEAM GENERAL SECTION', &
        'MEMBRANE SECTION', 'FLUID SECTION', 'USER ELEMENT', 'MPC'])
    end subroutine refuse

    !> Check that the keyword may stand here, and keep track of the steps.
    subroutine enter(keyword, star, line)
      type(rule_t), intent(in) :: keyword
      integer, intent(in) :: star, line

      card%keyword = keyword%name
      card%step = step
      if (keyword%name == 'STEP') then
        if (open_step > 0) call report(reader, star, 'the step before this one has no *END STEP')
        step = step + 1
        open_step = line
        card%step = step
      else if (keyword%place == in_step .and. open_step == 0) then
        call report(reader, star, '*'//trim(keyword%name)//' belongs between *STEP and *END STEP')
        card%keyword = ''
      else if (keyword%name == 'FRICTION' .and. step > 0 .and. is_below_change_friction()) then
        continue
      else if (keyword%place == in_model .and. step > 0) then
        if (.not. follows_change()) call report(reader, star, '*'//trim(keyword%name)// &
          ' belongs before the first *STEP')
        card%keyword = ''
      else if (keyword%name == 'BOUNDARY' .and. step > 0 .and. open_step == 0) then
        call report(reader, star, '*BOUNDARY belongs before the first *STEP or in a step')
        card%keyword = ''
      else if (keyword%place == in_model_or_first_step .and. (step > 1 .or. (step == 1 .and. &
        open_step == 0))) then
        if (.not. follows_change()) call report(reader, star, '*'//trim(keyword%name)// &
          ' belongs before the first *STEP or into it', when_later(keyword%name))
        card%keyword = ''
      else if (keyword%name == 'END STEP') then
        open_step = 0
      end if
    end subroutine enter

    !> How what a card makes can begin with a later step; empty where it cannot.
    pure function when_later(name) result(hint)
      character(*), intent(in) :: name
      character(:), allocatable :: hint

      hint = ''
      if (name == 'CONTACT PAIR') hint = 'define it there; *MODEL CHANGE, TYPE=CONTACT PAIR '// &
        'with REMOVE takes it out of the first step, and with ADD puts it into a later one'
      if (name == 'FRICTION') hint = 'in a later step it belongs below a *CHANGE FRICTION'
    end function when_later

    !> Whether the card before is a *CHANGE FRICTION, to which a *FRICTION in a step belongs.
    logical function is_below_change_friction()
      is_below_change_friction = .false.
      if (reader%n_cards > 0) is_below_change_friction = reader%cards(reader%n_cards)%keyword == &
        'CHANGE FRICTION'
    end function is_below_change_friction

    !> Whether the card before changes something from step to step, which was refused: this one
    !> says to what.
    logical function follows_change()
      follows_change = .false.
      if (reader%n_cards == 0) return
      associate (before => reader%cards(reader%n_cards))
        follows_change = before%is_refused .and. index(before%keyword, 'CHANGE ') == 1
      end associate
    end function follows_change

    subroutine close_card(last)
      integer, intent(in) :: last

      if (card%keyword == '') return
      card%last = last
      call skip_continuation(reader%source, card)
      if (reader%n_cards == size(reader%cards)) reader%cards = [reader%cards, reader%cards]
      reader%n_cards = reader%n_cards + 1
      reader%cards(reader%n_cards) = card
    end subroutine close_card

  end subroutine find_cards

  !> Behind a note, the reason; may be empty.
  pure function why(remark) result(text)
    character(*), intent(in) :: remark
    character(:), allocatable :: text

    text = trim(remark)
    if (text /= '') text = ': '//text
  end function why

  !> What a file is whose first line begins like this, where it is no deck; may be empty.
  pure function other_format(line) result(hint)
    character(*), intent(in) :: line
    character(:), allocatable :: hint

    hint = ''
    if (index(line, '$MeshFormat') == 1) then
      hint = "this is Gmsh's own format: gmsh -3 -format inp writes a mesh that a deck can include"
    else if (index(line, '# vtk DataFile') == 1 .or. index(line, '<VTKFile') == 1) then
      hint = 'this is a file of VTK, not a deck'
    else if (index(line, '<?xml') == 1 .or. index(line, '<Xdmf') == 1) then
      hint = 'this is XML, as the .xdmf beside a result, not a deck'
    else if (index(line, 'solid ') == 1) then
      hint = 'this is an STL file: *OBSTACLE, TYPE=STL, INPUT= takes it into a deck'
    end if
  end function other_format

  !> Move card%first over the lines that continue the keyword line.
  !>
  !> A keyword line that ends with a comma goes on in the next line that is not a comment, if that
  !> holds an option: NAME=VALUE, or a word that can be one by itself.
  subroutine skip_continuation(source, card)
    type(source_t), intent(in) :: source
    type(card_place_t), intent(inout) :: card
    type(pieces_t) :: pieces
    integer :: line

    if (card%keyword == 'PARAMETER') return ! a definition may look like an option
    call split_line(source, card%header, pieces)
    line = card%header
    do while (pieces%ends_with_comma)
      do
        line = line + 1
        if (line > card%last) return
        if (kind_of_line(source, line) == data_line) exit
      end do
      call split_line(source, line, pieces)
      if (.not. is_option(card%keyword, source%text(pieces%first(1):pieces%last(1)))) return
      card%first = line + 1
    end do
  end subroutine skip_continuation

  !> Whether a word below a keyword line that ends with a comma is an option of the keyword.
  pure logical function is_option(keyword, text) result(is)
    character(*), intent(in) :: keyword, text
    type(rule_t) :: rule
    type(item_t), allocatable :: items(:)
    integer :: i

    is = index(text, '=') > 0
    if (is) return
    rule = rule_of(keyword)
    call split_items(trim(rule%options)//merge(',', ' ', rule%options /= '' .and. &
      rule%ignored /= '')//rule%ignored, items)
    is = any([(same_word(text, items(i)%name) .and. items(i)%may_stand_alone, i=1, size(items))])
  end function is_option

  !> Put the parameters of all *PARAMETER cards into the table, in the order of the deck.
  subroutine read_parameters(reader)
    type(reader_t), intent(inout) :: reader
    type(pieces_t) :: pieces
    character(:), allocatable :: problem
    integer :: k, line, first, last, at

    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'PARAMETER') cycle
      call split_line(reader%source, reader%cards(k)%header, pieces)
      if (pieces%n > 1) call report(reader, pieces%first(2), '*PARAMETER has no options')
      do line = reader%cards(k)%first, reader%cards(k)%last
        if (.not. is_data_line(reader%source, line)) cycle
        if (.not. keep_reading(reader)) return
        first = first_letter(reader%source, line)
        last = first - 1 + without_remark(reader%source%text(first:reader%source%first(line + 1) &
          - 2))
        if (last < first) cycle
        call define_parameter(reader%source%text(first:last), first, reader%parameters, problem, at)
        if (allocated(problem)) call report(reader, first + at - 1, problem)
      end do
    end do
  end subroutine read_parameters

  !> How many letters of a line below *PARAMETER stand before a remark, which Python begins with a
  !> # that is not in quotes.
  pure integer function without_remark(line) result(n)
    character(*), intent(in) :: line
    character :: quote
    integer :: i

    quote = ' '
    n = len(line)
    do i = 1, len(line)
      if (quote /= ' ') then
        if (line(i:i) == quote) quote = ' '
      else if (line(i:i) == '"' .or. line(i:i) == "'") then
        quote = line(i:i)
      else if (line(i:i) == '#') then
        n = i - 1
        return
      end if
    end do
  end function without_remark

  !> Cut a line at its commas; those in quotes or between < and > do not count.
  pure subroutine split_line(source, line, pieces)
    type(source_t), intent(in) :: source
    integer, intent(in) :: line
    type(pieces_t), intent(inout) :: pieces
    integer :: i, last, start
    character :: letter, quote
    logical :: between, fresh

    if (.not. allocated(pieces%first)) allocate (pieces%first(16), pieces%last(16))
    pieces%n = 0
    pieces%ends_with_comma = .false.
    pieces%has_parameters = .false.
    start = source%first(line)
    last = source%first(line + 1) - 2
    do while (last >= start)
      if (source%text(last:last) /= ' ' .and. source%text(last:last) /= tab) exit
      last = last - 1
    end do
    if (last < start) return
    quote = ' '
    between = .false.
    fresh = .true. ! nothing yet in this piece, or behind its equal sign: a quote may open
    do i = start, last
      letter = source%text(i:i)
      select case (letter)
      case (',')
        if (quote /= ' ' .or. between) cycle
        call add_piece(source%text, start, i - 1, pieces)
        start = i + 1
        fresh = .true.
      case ('<')
        between = .true.
        pieces%has_parameters = .true.
        fresh = .false.
      case ('>')
        between = .false.
      case ('"', '''')
        if (quote == letter) then
          quote = ' '
        else if (quote == ' ' .and. fresh) then
          quote = letter
        end if
        fresh = .false.
      case ('=')
        if (quote == ' ') fresh = .true.
      case (' ', tab)
      case default
        fresh = .false.
      end select
    end do
    if (start > last) then
      pieces%ends_with_comma = .true.
    else
      call add_piece(source%text, start, last, pieces)
    end if
  end subroutine split_line

  !> Add the piece first..last without the blanks around it.
  pure subroutine add_piece(text, first, last, pieces)
    character(*), intent(in) :: text
    integer, intent(in) :: first, last
    type(pieces_t), intent(inout) :: pieces
    integer :: a, b, n

    a = first
    b = last
    do while (a <= b)
      if (text(a:a) /= ' ' .and. text(a:a) /= tab) exit
      a = a + 1
    end do
    do while (b >= a)
      if (text(b:b) /= ' ' .and. text(b:b) /= tab) exit
      b = b - 1
    end do
    n = pieces%n + 1
    if (n > size(pieces%first)) then
      pieces%first = [pieces%first, pieces%first]
      pieces%last = [pieces%last, pieces%last]
    end if
    pieces%first(n) = a
    pieces%last(n) = b
    pieces%n = n
  end subroutine add_piece

  !> Position of the first letter of a line that is not blank; its end when there is none.
  pure integer function first_letter(source, line) result(position)
    type(source_t), intent(in) :: source
    integer, intent(in) :: line

    position = source%first(line)
    do while (source%text(position:position) == ' ' .or. source%text(position:position) == tab)
      position = position + 1
    end do
  end function first_letter

  pure function kind_of_line(source, line) result(kind)
    type(source_t), intent(in) :: source
    integer, intent(in) :: line
    integer :: kind, first

    first = first_letter(source, line)
    if (first > source%first(line + 1) - 2) then
      kind = blank_line
    else if (source%text(first:first) /= '*') then
      kind = data_line
    else if (source%text(first + 1:first + 1) == '*') then
      kind = blank_line
    else
      kind = keyword_line
    end if
  end function kind_of_line

  !> Whether a line is neither blank, nor a comment, nor a keyword.
  pure logical function is_data_line(source, line) result(is)
    type(source_t), intent(in) :: source
    integer, intent(in) :: line

    is = kind_of_line(source, line) == data_line
  end function is_data_line

  pure logical function is_keyword_line(source, line) result(is)
    type(source_t), intent(in) :: source
    integer, intent(in) :: line

    is = kind_of_line(source, line) == keyword_line
  end function is_keyword_line

end module cards_mod
