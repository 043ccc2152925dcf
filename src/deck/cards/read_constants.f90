!> The constants of a material, eight on a line, and one temperature behind them.
module read_constants_mod
  use cards_mod, only: note, reader_t, report
  use diagnostics_mod, only: quoted
  use fields_mod, only: end_data, field_position, field_text, fields_t, is_empty_field, &
    next_data_line, real_field
  use kinds_mod, only: wp
  use options_mod, only: card_t
  implicit none
  private

  public :: read_constants, skip_temperature

contains

  !> The constants of a law, eight on a line. Those that may be left out are 0.
  subroutine read_constants(reader, card, symbols, n_needed, fields, constants, is_read, &
      position)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    character(*), intent(in) :: symbols(:)
    integer, intent(in) :: n_needed           !! of them
    type(fields_t), intent(out) :: fields     !! of the first line
    real(wp), intent(out) :: constants(:)     !! one for each symbol
    logical, intent(out) :: is_read           !! all of them are numbers, and 0 where they must be
    integer, intent(out), optional :: position(:) !! in the deck, of each symbol
    integer, parameter :: most = 8            ! numbers on a line
    type(fields_t) :: line
    character(:), allocatable :: names
    integer :: i, at
    logical :: found, ok

    constants = 0.0_wp
    if (present(position)) position = card%position
    names = trim(symbols(1))
    do i = 2, n_needed
      names = names//', '//trim(symbols(i))
    end do
    is_read = .true.
    do i = 1, size(symbols) + 1
      at = mod(i - 1, most) + 1
      if (at == 1) then
        call next_data_line(reader, card, line, found, min(most, size(symbols) + 2 - i), names// &
          ' (and one temperature)')
        if (i == 1) then
          fields = line
          if (.not. found) call report(reader, card%position, '*'//card%keyword// &
            ' needs a data line: '//names)
          is_read = found
        else if (.not. found .and. i <= n_needed) then
          call report(reader, fields%start, '*'//card%keyword//' needs '//trim(symbols(i))// &
            ' on its next line: '//names)
          is_read = .false.
        end if
        if (.not. found) return
      end if
      if (present(position) .and. i <= size(symbols)) position(i) = field_position(reader, line, at)
      if (i > size(symbols)) then
        call skip_temperature(reader, line, at)
      else if (i <= n_needed .or. .not. is_empty_field(line, at)) then
        call real_field(reader, line, at, trim(symbols(i)), constants(i), ok)
        is_read = is_read .and. ok
        if (ok .and. i > n_needed .and. abs(constants(i)) > 0.0_wp) call report(reader, &
          field_position(reader, line, at), trim(symbols(i))//' must be 0 or left out, not '// &
          quoted(field_text(reader, line, at)))
      end if
    end do
    call end_data(reader, card, line, &
      'properties that depend on temperature are not available: one line '//names)
  end subroutine read_constants

  !> One temperature behind a constant changes nothing. Behind a number without a point it may be
  !> the fraction of a decimal comma, as in 7,85e-9.
  subroutine skip_temperature(reader, fields, i)
    type(reader_t), intent(inout) :: reader
    type(fields_t), intent(in) :: fields
    integer, intent(in) :: i !! where it stands
    real(wp) :: temperature
    logical :: ok

    if (is_empty_field(fields, i)) return
    call real_field(reader, fields, i, 'a temperature, which is ignored', temperature, ok)
    if (.not. ok .or. is_empty_field(fields, i - 1)) return
    if (verify(field_text(reader, fields, i - 1), '+-0123456789') == 0) then
      call report(reader, field_position(reader, fields, i - 1), quoted(field_text(reader, &
        fields, i - 1))//' and '//quoted(field_text(reader, fields, i))//': a number with a '// &
        'decimal comma, or a number and a temperature?', 'use a decimal point: 0.3, or 1. for 1')
    else
      call note(reader, 'temperatures behind constants of materials are ignored: one line '// &
        'holds at all temperatures')
    end if
  end subroutine skip_temperature

end module read_constants_mod
