!> What the user calls the units of forces and lengths.
!>
!>     *UNITS
!>     N, mm
!>
!> They are names for labels. No number of the deck is converted.
module read_units_mod
  use cards_mod, only: reader_t, report
  use diagnostics_mod, only: quoted
  use fields_mod, only: end_data, field_position, field_text, fields_t, next_data_line
  use options_mod, only: allow_options, card_t, open_only_card
  implicit none
  private

  public :: read_units

  character(*), parameter :: form = 'the units of force and length, as in "N, mm"'
  integer, parameter :: max_unit = 20 !! longest name of a unit [byte]
  !> Lengths, so that "mm, N" is seen to be the wrong way round.
  character(2), parameter :: lengths(7) = ['m ', 'mm', 'cm', 'um', 'nm', 'km', 'ft']

contains

  !> *UNITS
  subroutine read_units(reader, units)
    type(reader_t), intent(inout) :: reader
    character(:), allocatable, intent(out) :: units !! as "N, mm"; '' where not given
    character(:), allocatable :: force, length
    type(card_t) :: card
    type(fields_t) :: fields
    logical :: found, ok

    units = ''
    call open_only_card(reader, 'UNITS', card, found)
    if (.not. found) return
    call allow_options(reader, card)
    call next_data_line(reader, card, fields, found, 2, form)
    if (.not. found) then
      call report(reader, card%position, '*UNITS needs a data line: '//form)
      return
    end if
    force = field_text(reader, fields, 1)
    length = field_text(reader, fields, 2)
    if (any(lengths == force)) then
      call report(reader, field_position(reader, fields, 1), &
        'the unit of force comes first, then that of length; found '//quoted(force))
    else
      call check_unit(reader, fields, 1, 'force', ok)
      if (ok) call check_unit(reader, fields, 2, 'length', ok)
      if (ok) units = force//', '//length
    end if
    call end_data(reader, card, fields, '*UNITS has one data line')
  end subroutine read_units

  !> Report field `i` where it names no unit: it begins with a letter, and has no blanks.
  subroutine check_unit(reader, fields, i, what, ok)
    type(reader_t), intent(inout) :: reader
    type(fields_t), intent(in) :: fields
    integer, intent(in) :: i
    character(*), intent(in) :: what !! force or length
    logical, intent(out) :: ok       !! false: an error was reported
    character(*), parameter :: no_first = '0123456789.+-*/^'
    character(:), allocatable :: unit

    unit = field_text(reader, fields, i)
    ok = len(unit) > 0 .and. len(unit) <= max_unit
    if (ok) ok = scan(unit(1:1), no_first) == 0 .and. scan(unit, ' '//achar(9)//'[]()"') == 0
    if (ok) return
    call report(reader, field_position(reader, fields, i), 'expected the name of a unit of '// &
      what//', as in "N, mm", found '//quoted(unit))
  end subroutine check_unit

end module read_units_mod
