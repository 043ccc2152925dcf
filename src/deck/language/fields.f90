!> The data lines of a card, field by field.
!>
!> Every field that is not what it should be is reported at its own column, and so is a field too
!> many: whoever takes a line says how many fields it can have.
module fields_mod
  use cards_mod, only: is_data_line, keep_reading, pieces_t, reader_t, report, split_line
  use diagnostics_mod, only: quoted
  use kinds_mod, only: wp
  use numbers_mod, only: largest_number, number_not_finite, number_ok, number_too_large, &
    read_integer, read_real
  use options_mod, only: card_t, checked_name, has_option, integer_option, name_option, open_card, &
    option_position, text_option, unquote
  use substitution_mod, only: substitute
  use text_mod, only: string_t, to_text
  implicit none
  private

  public :: fields_t, next_data_line, end_data, any_number, field_position, field_text
  public :: is_empty_field
  public :: integer_field, real_field, name_field, limit_fields, looks_like_id
  public :: reference_t, reference_field, node_option

  integer, parameter :: max_substituted = 10000 !! fields of a line with parameters in it
  integer, parameter :: any_number = huge(1)    !! of fields: the line is a list

  !> One data line.
  type :: fields_t
    type(pieces_t) :: pieces = pieces_t()
    integer :: n = 0       !! number of fields
    integer :: line = 0    !! index of the line in the source
    integer :: start = 0   !! position of the first field
    type(string_t), allocatable :: text(:) !! (n) with parameters put in; only where there are any
  end type fields_t

  !> What a field names: an id, or a set or surface.
  type :: reference_t
    integer :: id = 0                  !! > 0: an id
    character(:), allocatable :: name  !! else a name, in upper case
    integer :: position = 0
  end type reference_t

contains

  !> Go on to the next data line of `card`; begin with fields%line = 0. Fields beyond the `most`
  !> that it can have are reported.
  subroutine next_data_line(reader, card, fields, found, most, form)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(fields_t), intent(inout) :: fields
    logical, intent(out) :: found     !! false: there is none
    integer, intent(in) :: most       !! any_number where the line is a list
    character(*), intent(in) :: form  !! the line as it should be, for the message

    call go_to_next_line(reader, card, fields, found)
    if (found) call limit_fields(reader, fields, most, form)
  end subroutine next_data_line

  !> Report a data line behind the last that the card can have.
  subroutine end_data(reader, card, fields, message)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(fields_t), intent(inout) :: fields !! the line before
    character(*), intent(in) :: message     !! as "*FRICTION has one data line"
    logical :: found

    call go_to_next_line(reader, card, fields, found)
    if (found) call report(reader, fields%start, message)
  end subroutine end_data

  subroutine go_to_next_line(reader, card, fields, found)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(fields_t), intent(inout) :: fields
    logical, intent(out) :: found !! false: there is none

    if (fields%line == 0) fields%line = card%place%first - 1
    found = .false.
    do
      fields%line = fields%line + 1
      if (fields%line > card%place%last .or. .not. keep_reading(reader)) return
      if (is_data_line(reader%source, fields%line)) exit
    end do
    found = .true.
    call split_line(reader%source, fields%line, fields%pieces)
    fields%n = fields%pieces%n
    fields%start = fields%pieces%first(1)
    if (allocated(fields%text)) deallocate (fields%text)
    if (fields%pieces%has_parameters) call put_in_parameters(reader, fields)
  end subroutine go_to_next_line

  subroutine put_in_parameters(reader, fields)
    type(reader_t), intent(inout) :: reader
    type(fields_t), intent(inout) :: fields
    character(:), allocatable :: problem
    integer :: i, first, last, at

    if (fields%n > max_substituted) then
      call report(reader, fields%start, 'a line with parameters <...> has too many entries')
      fields%n = max_substituted
    end if
    allocate (fields%text(fields%n))
    do i = 1, fields%n
      first = fields%pieces%first(i)
      last = fields%pieces%last(i)
      if (index(reader%source%text(first:last), '<') == 0) then
        fields%text(i)%text = reader%source%text(first:last)
        cycle
      end if
      call substitute(reader%source%text(first:last), first, reader%parameters, &
        fields%text(i)%text, problem, at)
      if (.not. allocated(problem)) cycle
      call report(reader, first + at - 1, problem)
      fields%text(i)%text = '1' ! so that nothing more is said of this field
    end do
  end subroutine put_in_parameters

  !> The place of field `i`; of the end of the line when there are fewer fields.
  pure integer function field_position(reader, fields, i) result(position)
    type(reader_t), intent(in) :: reader
    type(fields_t), intent(in) :: fields
    integer, intent(in) :: i

    if (i <= fields%n) then
      position = fields%pieces%first(i)
    else
      position = max(fields%start, reader%source%first(fields%line + 1) - 2)
    end if
  end function field_position

  !> Field `i` as text.
  pure function field_text(reader, fields, i) result(text)
    type(reader_t), intent(in) :: reader
    type(fields_t), intent(in) :: fields
    integer, intent(in) :: i
    character(:), allocatable :: text

    if (i > fields%n) then
      text = ''
    else if (allocated(fields%text)) then
      text = trim(adjustl(fields%text(i)%text))
    else
      text = reader%source%text(fields%pieces%first(i):fields%pieces%last(i))
    end if
  end function field_text

  pure logical function is_empty_field(fields, i) result(empty)
    type(fields_t), intent(in) :: fields
    integer, intent(in) :: i

    empty = .true.
    if (i <= fields%n) empty = fields%pieces%last(i) < fields%pieces%first(i)
  end function is_empty_field

  !> Read field `i` as a whole number from `lowest` to the largest of its kind.
  subroutine integer_field(reader, fields, i, what, lowest, value, ok)
    type(reader_t), intent(inout) :: reader
    type(fields_t), intent(in) :: fields
    integer, intent(in) :: i
    character(*), intent(in) :: what  !! what the field says, for the message
    integer, intent(in) :: lowest
    integer, intent(out) :: value     !! 0 where not ok
    logical, intent(out) :: ok        !! false: a mistake was reported
    integer :: status

    value = 0
    status = -1
    if (i <= fields%n) then
      if (allocated(fields%text)) then
        call read_integer(field_text(reader, fields, i), value, status)
      else
        call read_integer(reader%source%text(fields%pieces%first(i):fields%pieces%last(i)), &
          value, status)
      end if
    end if
    ok = status == number_ok .and. value >= lowest
    if (ok) return
    call report_number(reader, fields, i, what, status, to_text(huge(value)), &
      'a whole number from '//to_text(lowest))
    value = 0
  end subroutine integer_field

  !> Read field `i` as a finite number.
  subroutine real_field(reader, fields, i, what, value, ok)
    type(reader_t), intent(inout) :: reader
    type(fields_t), intent(in) :: fields
    integer, intent(in) :: i
    character(*), intent(in) :: what  !! what the field says, for the message
    real(wp), intent(out) :: value    !! 0 where not ok
    logical, intent(out) :: ok        !! false: a mistake was reported
    integer :: status

    value = 0.0_wp
    status = -1
    if (i <= fields%n) then
      if (allocated(fields%text)) then
        call read_real(field_text(reader, fields, i), value, status)
      else
        call read_real(reader%source%text(fields%pieces%first(i):fields%pieces%last(i)), &
          value, status)
      end if
    end if
    ok = status == number_ok
    if (ok) return
    call report_number(reader, fields, i, what, status, to_text(largest_number), 'a number')
  end subroutine real_field

  !> Report a field that is not the number it should be.
  subroutine report_number(reader, fields, i, what, status, largest, form)
    type(reader_t), intent(inout) :: reader
    type(fields_t), intent(in) :: fields
    integer, intent(in) :: i, status
    character(*), intent(in) :: what, largest
    character(*), intent(in) :: form !! as "a whole number from 1"
    character(:), allocatable :: words, found

    found = quoted(field_text(reader, fields, i))
    if (is_empty_field(fields, i)) then
      words = 'expected '//what
    else if (status == number_too_large) then
      words = what//' is too large: '//found//' (at most '//largest//')'
    else if (status == number_not_finite) then
      words = what//' must be finite, not '//found
    else
      words = 'expected '//what//' ('//form//'), found '//found
    end if
    call report(reader, field_position(reader, fields, i), words)
  end subroutine report_number

  !> Read field `i` as a name, in upper case.
  subroutine name_field(reader, fields, i, what, name, ok)
    type(reader_t), intent(inout) :: reader
    type(fields_t), intent(in) :: fields
    integer, intent(in) :: i
    character(*), intent(in) :: what  !! what the field says, for the message
    character(:), allocatable, intent(out) :: name
    logical, intent(out) :: ok        !! false: a mistake was reported

    name = ''
    ok = .not. is_empty_field(fields, i)
    if (ok) then
      call checked_name(reader, field_position(reader, fields, i), &
        unquote(field_text(reader, fields, i)), name, ok)
    else
      call report(reader, field_position(reader, fields, i), 'expected '//what)
    end if
  end subroutine name_field

  !> Read field `i` as an id or a name.
  subroutine reference_field(reader, fields, i, what, reference, ok)
    type(reader_t), intent(inout) :: reader
    type(fields_t), intent(in) :: fields
    integer, intent(in) :: i
    character(*), intent(in) :: what
    type(reference_t), intent(out) :: reference
    logical, intent(out) :: ok        !! false: a mistake was reported

    reference%position = field_position(reader, fields, i)
    reference%name = ''
    if (looks_like_id(reader, fields, i)) then
      call integer_field(reader, fields, i, what, 1, reference%id, ok)
    else
      call name_field(reader, fields, i, what, reference%name, ok)
    end if
  end subroutine reference_field

  !> The id of the node that option `name` gives: by itself, or as the only one of a set.
  subroutine node_option(reader, card, name, id, ok)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    character(*), intent(in) :: name
    integer, intent(inout) :: id     !! unchanged when the option is absent
    logical, intent(out) :: ok       !! false: absent, or a mistake was reported
    character(:), allocatable :: set

    call text_option(reader, card, name, set, ok)
    if (.not. ok .or. verify(set, '0123456789+-.') == 0) then
      call integer_option(reader, card, name, 1, huge(id), id, ok)
    else
      call name_option(reader, card, name, .true., set, ok)
      if (ok) call find_only_node(reader, option_position(card, name), set, id, ok)
    end if
  end subroutine node_option

  !> The only node of a set that is made by its id below *NSET or *NODE, once or again.
  subroutine find_only_node(reader, position, set, id, ok)
    type(reader_t), intent(inout) :: reader
    integer, intent(in) :: position    !! where the deck names the set
    character(*), intent(in) :: set    !! upper case
    integer, intent(inout) :: id
    logical, intent(out) :: ok
    type(card_t) :: card
    type(fields_t) :: fields
    character(:), allocatable :: name
    integer :: k, n, last, i, before
    logical :: found, defined, plain

    n = 0
    defined = .false.
    plain = .true.
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'NSET' .and. reader%cards(k)%keyword /= 'NODE') cycle
      call open_card(reader, k, card)
      if (.not. has_option(card, 'NSET')) cycle
      call name_option(reader, card, 'NSET', .true., name, ok)
      if (name /= set) cycle
      defined = .true.
      plain = plain .and. .not. (has_option(card, 'GENERATE') .or. has_option(card, 'ELSET'))
      fields%line = 0
      do
        call next_data_line(reader, card, fields, found, any_number, '')
        if (.not. found) exit
        last = fields%n
        if (card%keyword == 'NODE') last = 1
        do i = 1, last
          if (is_empty_field(fields, i)) cycle
          before = id
          plain = plain .and. looks_like_id(reader, fields, i)
          if (plain) call integer_field(reader, fields, i, 'the id of a node', 1, id, ok)
          if (n == 0 .or. id /= before) n = n + 1
        end do
      end do
    end do
    ok = defined .and. plain .and. n == 1
    if (ok) return
    if (defined) then
      call report(reader, position, 'node set '//quoted(set)//' cannot be a reference node: it '// &
        'must have one node, named by its number')
    else
      call report(reader, position, 'node set '//quoted(set)//' is not defined')
    end if
  end subroutine find_only_node

  !> Whether field `i` holds digits only (a sign aside), so that it cannot be a name.
  pure logical function looks_like_id(reader, fields, i) result(looks)
    type(reader_t), intent(in) :: reader
    type(fields_t), intent(in) :: fields
    integer, intent(in) :: i

    looks = .not. is_empty_field(fields, i)
    if (.not. looks) return
    if (allocated(fields%text)) then
      looks = verify(fields%text(i)%text, '0123456789+- ') == 0
    else
      looks = verify(reader%source%text(fields%pieces%first(i):fields%pieces%last(i)), &
        '0123456789+-') == 0
    end if
  end function looks_like_id

  !> Report the first field beyond the `most` that the line can have; empty ones do no harm.
  subroutine limit_fields(reader, fields, most, what)
    type(reader_t), intent(inout) :: reader
    type(fields_t), intent(in) :: fields
    integer, intent(in) :: most
    character(*), intent(in) :: what !! the line as it should be
    character(:), allocatable :: hint
    integer :: i

    if (fields%n <= most) return
    do i = most + 1, fields%n
      if (.not. is_empty_field(fields, i)) exit
    end do
    if (i > fields%n) return
    hint = ''
    if (looks_like_id(reader, fields, i)) hint = 'use a decimal point, not a comma: 0.3'
    call report(reader, field_position(reader, fields, i), 'unexpected '// &
      quoted(field_text(reader, fields, i))//': the line has '//what, hint)
  end subroutine limit_fields

end module fields_mod
