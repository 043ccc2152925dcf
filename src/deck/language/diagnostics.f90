!> Mistakes and notes, collected while the deck is read.
!>
!>     block.inp:12:9: error: unknown parameter 'NU'
!>       *BLOCK, NU=4, NY=4, NZ=4
!>               ^
!>       did you mean NX?
module diagnostics_mod
  use deck_source_mod, only: place_of, place_t, line_at, source_t
  use errors_mod, only: error_t, exit_wrong_input, raise
  use text_mod, only: nearest_word, string_t, to_text
  implicit none
  private

  public :: diagnostics_t, add_mistake, add_plain_mistake, add_note, any_mistakes
  public :: wants_more, mistakes_as_error, mistakes_in_lines, notes_as_list, quoted, guess

  integer, parameter :: max_collected = 500  !! then reading ends
  integer, parameter :: max_printed = 10  !! --check prints all
  integer, parameter :: max_notes = 100
  integer, parameter :: excerpt_width = 96   !! longest piece of a source line shown [character]
  integer, parameter :: max_quoted = 60      !! longest piece of the deck in a message [byte]
  integer, parameter :: max_candidates = 2000 !! words compared for "did you mean"

  !> One mistake, as it will be printed.
  type :: mistake_t
    integer :: position = 0 !! place in the deck; 0: before all others
    character(:), allocatable :: text
    character(:), allocatable :: hint !! the last line of the text; not allocated: none
  end type mistake_t

  !> What was found so far.
  type :: diagnostics_t
    type(mistake_t), allocatable :: mistakes(:)
    integer :: n_mistakes = 0
    type(string_t), allocatable :: notes(:)
    integer :: n_notes = 0
    integer :: n_notes_dropped = 0
  end type diagnostics_t

contains

  !> Record a mistake at `position`.
  subroutine add_mistake(diagnostics, source, position, message, hint)
    type(diagnostics_t), intent(inout) :: diagnostics
    type(source_t), intent(in) :: source
    integer, intent(in) :: position       !! place in the deck; 0: no place
    character(*), intent(in) :: message   !! one sentence without capital and full stop
    character(*), intent(in), optional :: hint !! what would have been right; may be empty
    character(:), allocatable :: text
    type(place_t) :: place
    integer :: before
    logical :: is_told

    if (.not. wants_more(diagnostics)) return
    before = diagnostics%n_mistakes
    if (position < 1 .or. position > source%length) then
      text = 'error: '//message
      if (source%n_files > 0) text = source%files(1)%text//': '//text
    else
      place = place_of(source, position)
      text = place%file//':'//to_text(place%line)//':'//to_text(place%column)//': error: '// &
        message//new_line('a')//excerpt(source, position)
    end if
    if (present(hint)) then
      if (len(hint) > 0) text = text//new_line('a')//'  '//hint
    end if
    call drop_later(diagnostics, message, position, is_told)
    if (is_told) return
    call add_plain_mistake(diagnostics, text, position)
    if (.not. present(hint) .or. diagnostics%n_mistakes == before) return
    if (len(hint) > 0) diagnostics%mistakes(diagnostics%n_mistakes)%hint = hint
  end subroutine add_mistake

  !> What is not defined is told where it is named first, and not at each place.
  subroutine drop_later(diagnostics, message, position, is_told)
    type(diagnostics_t), intent(inout) :: diagnostics
    character(*), intent(in) :: message
    integer, intent(in) :: position
    logical, intent(out) :: is_told !! before this place
    integer :: i

    is_told = .false.
    if (.not. ends_with(message, ' is not defined')) return
    do i = 1, diagnostics%n_mistakes
      if (.not. ends_with(first_line(diagnostics%mistakes(i)%text), ': error: '//message)) cycle
      is_told = diagnostics%mistakes(i)%position <= position
      if (is_told) return
      diagnostics%mistakes(i:diagnostics%n_mistakes - 1) = &
        diagnostics%mistakes(i + 1:diagnostics%n_mistakes)
      diagnostics%n_mistakes = diagnostics%n_mistakes - 1
      return
    end do
  end subroutine drop_later

  !> Record a mistake whose text is complete.
  subroutine add_plain_mistake(diagnostics, text, position)
    type(diagnostics_t), intent(inout) :: diagnostics
    character(*), intent(in) :: text
    integer, intent(in) :: position !! orders the mistakes
    integer :: i

    if (.not. wants_more(diagnostics)) return
    if (.not. allocated(diagnostics%mistakes)) allocate (diagnostics%mistakes(max_collected))
    ! A card that is looked at twice has its mistakes once, and so has the line of a part that has
    ! several instances.
    do i = 1, diagnostics%n_mistakes
      if (first_line(diagnostics%mistakes(i)%text) == first_line(text)) return
    end do
    diagnostics%n_mistakes = diagnostics%n_mistakes + 1
    diagnostics%mistakes(diagnostics%n_mistakes)%position = position
    diagnostics%mistakes(diagnostics%n_mistakes)%text = text
  end subroutine add_plain_mistake

  pure logical function ends_with(text, end)
    character(*), intent(in) :: text, end

    ends_with = len(text) >= len(end)
    if (ends_with) ends_with = text(len(text) - len(end) + 1:) == end
  end function ends_with

  pure function first_line(text) result(line)
    character(*), intent(in) :: text
    character(:), allocatable :: line

    line = text(:index(text//new_line('a'), new_line('a')) - 1)
  end function first_line

  !> Record a note; the same sentence is kept once.
  subroutine add_note(diagnostics, text)
    type(diagnostics_t), intent(inout) :: diagnostics
    character(*), intent(in) :: text
    integer :: i

    if (.not. allocated(diagnostics%notes)) allocate (diagnostics%notes(max_notes))
    do i = 1, diagnostics%n_notes
      if (diagnostics%notes(i)%text == text) return
    end do
    if (diagnostics%n_notes == max_notes) then
      diagnostics%n_notes_dropped = diagnostics%n_notes_dropped + 1
      return
    end if
    diagnostics%n_notes = diagnostics%n_notes + 1
    diagnostics%notes(diagnostics%n_notes)%text = text
  end subroutine add_note

  pure logical function any_mistakes(diagnostics) result(found)
    type(diagnostics_t), intent(in) :: diagnostics

    found = diagnostics%n_mistakes > 0
  end function any_mistakes

  !> Whether it makes sense to look for further mistakes.
  pure logical function wants_more(diagnostics) result(wanted)
    type(diagnostics_t), intent(in) :: diagnostics

    wanted = diagnostics%n_mistakes < max_collected
  end function wants_more

  !> Mistakes in the order of the deck as one error, as people read them; not allocated when there
  !> are none.
  subroutine mistakes_as_error(diagnostics, error)
    type(diagnostics_t), intent(in) :: diagnostics
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: text
    integer, allocatable :: order(:)
    integer :: k

    if (diagnostics%n_mistakes == 0) return
    allocate (order, source=order_of(diagnostics))
    text = diagnostics%mistakes(order(1))%text
    do k = 2, min(size(order), max_printed)
      text = text//new_line('a')//diagnostics%mistakes(order(k))%text
    end do
    if (size(order) >= max_collected) then
      text = text//new_line('a')//'and more: stopped after '//to_text(size(order))// &
        ' errors; --check lists them'
    else if (size(order) > max_printed) then
      text = text//new_line('a')//'and '//to_text(size(order) - max_printed)// &
        ' more errors; --check lists all'
    end if
    call raise(error, exit_wrong_input, text)
  end subroutine mistakes_as_error

  !> All mistakes in the order of the deck as one error, a line each, as editors read them; not
  !> allocated when there are none.
  subroutine mistakes_in_lines(diagnostics, deck, error)
    type(diagnostics_t), intent(in) :: diagnostics
    character(*), intent(in) :: deck !! path
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: text
    integer, allocatable :: order(:)
    integer :: k

    if (diagnostics%n_mistakes == 0) return
    allocate (order, source=order_of(diagnostics))
    text = in_one_line(diagnostics%mistakes(order(1)), deck)
    do k = 2, size(order)
      text = text//new_line('a')//in_one_line(diagnostics%mistakes(order(k)), deck)
    end do
    call raise(error, exit_wrong_input, text)
  end subroutine mistakes_in_lines

  !> The mistakes by their places in the deck; those of one place in the order they were found.
  pure function order_of(diagnostics) result(order)
    type(diagnostics_t), intent(in) :: diagnostics
    integer :: order(diagnostics%n_mistakes)
    integer :: i, j

    do i = 1, size(order)
      j = i - 1
      do while (j >= 1)
        if (diagnostics%mistakes(order(j))%position <= diagnostics%mistakes(i)%position) exit
        order(j + 1) = order(j)
        j = j - 1
      end do
      order(j + 1) = i
    end do
  end function order_of

  !> A mistake as compilers write theirs: path:line:column: error: what is wrong; the hint. What has
  !> no place is told at the first letter.
  pure function in_one_line(mistake, deck) result(line)
    type(mistake_t), intent(in) :: mistake
    character(*), intent(in) :: deck !! path
    character(:), allocatable :: line
    character(*), parameter :: mark = 'error: '
    integer :: last, at

    last = index(mistake%text, new_line('a')) - 1
    if (last < 0) last = len(mistake%text)
    at = index(mistake%text(:last), mark)
    if (at == 1) then
      line = deck//':1:1: '//mistake%text(:last)
    else if (has_place(mistake%text(:at - 3))) then
      line = mistake%text(:last)
    else
      line = mistake%text(:at - 3)//':1:1: '//mistake%text(at:last)
    end if
    if (allocated(mistake%hint)) line = line//'; '//mistake%hint
  end function in_one_line

  !> Whether a text ends like path:line:column.
  pure logical function has_place(text)
    character(*), intent(in) :: text
    integer :: column, line

    has_place = .false.
    column = verify(text, '0123456789', back=.true.)
    if (column < 2 .or. column == len(text)) return
    if (text(column:column) /= ':') return
    line = verify(text(:column - 1), '0123456789', back=.true.)
    if (line < 1 .or. line == column - 1) return
    has_place = text(line:line) == ':'
  end function has_place

  !> The notes, in the order they were made.
  subroutine notes_as_list(diagnostics, notes)
    type(diagnostics_t), intent(in) :: diagnostics
    type(string_t), allocatable, intent(out) :: notes(:)
    integer :: i, n

    n = diagnostics%n_notes
    if (diagnostics%n_notes_dropped > 0) n = n + 1
    allocate (notes(n))
    do i = 1, diagnostics%n_notes
      notes(i)%text = diagnostics%notes(i)%text
    end do
    if (n > diagnostics%n_notes) notes(n)%text = 'and '// &
      to_text(diagnostics%n_notes_dropped)//' more notes'
  end subroutine notes_as_list

  !> `text` in quotes, shortened where it is long.
  pure function quoted(text) result(short)
    character(*), intent(in) :: text
    character(:), allocatable :: short
    integer :: last

    last = len(text)
    if (last > max_quoted) then
      last = max_quoted - 3
      ! Not in the middle of a UTF-8 character.
      do while (last > 1 .and. iand(iachar(text(last + 1:last + 1)), 192) == 128)
        last = last - 1
      end do
      short = "'"//text(:last)//"...'"
    else
      short = "'"//text//"'"
    end if
  end function quoted

  !> "did you mean X?" for the word of `words` nearest to `word`, or nothing.
  pure function guess(word, words) result(hint)
    character(*), intent(in) :: word
    type(string_t), intent(in) :: words(:)
    character(:), allocatable :: hint
    integer :: nearest

    hint = ''
    if (len(word) < 2 .or. len(word) > max_quoted .or. size(words) > max_candidates) return
    nearest = nearest_word(word, words)
    if (nearest == 0) return
    if (len(words(nearest)%text) > 0) hint = 'did you mean '//words(nearest)%text//'?'
  end function guess

  !> The source line around `position` and a caret under it, indented by two blanks.
  pure function excerpt(source, position) result(text)
    type(source_t), intent(in) :: source
    integer, intent(in) :: position
    character(:), allocatable :: text
    integer :: line, first, last, i, n_before, code

    line = line_at(source, position)
    first = source%first(line)
    last = source%first(line + 1) - 2
    if (position - first > excerpt_width/2) first = position - excerpt_width/2
    last = min(last, first + excerpt_width)
    ! Whole UTF-8 characters only.
    do while (first < position .and. iand(iachar(source%text(first:first)), 192) == 128)
      first = first + 1
    end do
    do while (last < source%first(line + 1) - 2 .and. &
              iand(iachar(source%text(last + 1:last + 1)), 192) == 128)
      last = last + 1
    end do
    text = '  '
    if (first > source%first(line)) text = '  ...'
    n_before = len(text)
    do i = first, last
      code = iachar(source%text(i:i))
      if (i < position .and. iand(code, 192) /= 128) n_before = n_before + 1
      if (code == 9) then
        text = text//' '
      else
        text = text//source%text(i:i)
      end if
    end do
    if (last < source%first(line + 1) - 2) text = text//'...'
    text = text//new_line('a')//repeat(' ', n_before)//'^'
  end function excerpt

end module diagnostics_mod
