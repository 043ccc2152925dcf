!> Tables of values over the time of a step.
!>
!>     *AMPLITUDE, NAME=PULSE
!>     0., 0.,  0.5, 1.,  1., 0.      time, value, any number of pairs a line
module read_amplitudes_mod
  use cards_mod, only: keep_reading, reader_t, report
  use name_table_mod, only: add_name, close_directory, name_table_t, find_named, open_directory
  use fields_mod, only: any_number, field_position, fields_t, next_data_line, real_field
  use kinds_mod, only: wp
  use loads_mod, only: amplitude_t
  use options_mod, only: allow_options, card_t, choice_option, name_option, open_card, &
    option_position
  implicit none
  private

  public :: amplitude_list_t, read_amplitudes, amplitude_option

  !> The amplitudes of a deck, found by name.
  type :: amplitude_list_t
    type(amplitude_t), allocatable :: list(:)
    type(name_table_t) :: names
  end type amplitude_list_t

contains

  !> Read all amplitudes.
  subroutine read_amplitudes(reader, amplitudes)
    type(reader_t), intent(inout) :: reader
    type(amplitude_list_t), intent(out) :: amplitudes
    type(card_t) :: card
    character(:), allocatable :: name
    integer :: k, n
    logical :: ok

    n = count(reader%cards(:reader%n_cards)%keyword == 'AMPLITUDE')
    allocate (amplitudes%list(n))
    call open_directory('amplitude', n, amplitudes%names)
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'AMPLITUDE') cycle
      call open_card(reader, k, card)
      call name_option(reader, card, 'NAME', .true., name, ok)
      call add_name(amplitudes%names, name, card%position)
      n = amplitudes%names%n
      amplitudes%list(n)%name = name
      call read_table(reader, card, amplitudes%list(n))
    end do
    call close_directory(reader, amplitudes%names)
  end subroutine read_amplitudes

  !> The pairs of one card, times ascending; continued where a line ends with half a pair.
  subroutine read_table(reader, card, amplitude)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(amplitude_t), intent(inout) :: amplitude
    type(fields_t) :: fields
    real(wp), allocatable :: numbers(:)
    integer, allocatable :: positions(:)
    integer :: n, i, choice
    logical :: found, ok, all_ok

    call allow_options(reader, card, ['NAME      ', 'TIME      ', 'VALUE     ', 'DEFINITION'])
    choice = 1
    call choice_option(reader, card, 'TIME', ['STEP TIME '], choice, ok)
    call choice_option(reader, card, 'VALUE', ['RELATIVE'], choice, ok)
    call choice_option(reader, card, 'DEFINITION', ['TABULAR'], choice, ok)
    allocate (numbers(16), positions(16))
    n = 0
    all_ok = .true.
    do
      call next_data_line(reader, card, fields, found, any_number, 'pairs of time and value')
      if (.not. found) exit
      do i = 1, fields%n
        if (.not. keep_reading(reader)) return
        if (n == size(numbers)) call make_longer(numbers, positions)
        n = n + 1
        positions(n) = field_position(reader, fields, i)
        call real_field(reader, fields, i, 'a time or a value', numbers(n), ok)
        all_ok = all_ok .and. ok
      end do
    end do
    if (n == 0) then
      call report(reader, card%position, '*AMPLITUDE needs pairs of time and value')
    else if (mod(n, 2) == 1) then
      call report(reader, positions(n), 'the last time has no value')
    end if
    n = n - mod(n, 2)
    do i = 3, n, 2
      if (.not. all_ok .or. numbers(i) > numbers(i - 2)) cycle
      call report(reader, positions(i), 'the times of an amplitude must ascend')
      exit
    end do
    amplitude%time = numbers(1:n:2)
    amplitude%value = numbers(2:n:2)
  end subroutine read_table

  subroutine make_longer(numbers, positions)
    real(wp), allocatable, intent(inout) :: numbers(:)
    integer, allocatable, intent(inout) :: positions(:)
    real(wp), allocatable :: more_numbers(:)
    integer, allocatable :: more_positions(:)
    integer :: n

    n = size(numbers)
    allocate (more_numbers(2*n), more_positions(2*n))
    more_numbers(:n) = numbers
    more_positions(:n) = positions
    call move_alloc(more_numbers, numbers)
    call move_alloc(more_positions, positions)
  end subroutine make_longer

  !> The amplitude that AMPLITUDE= names: its index; 0 without it, or where a mistake was reported.
  subroutine amplitude_option(reader, card, amplitudes, index)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(amplitude_list_t), intent(in) :: amplitudes
    integer, intent(out) :: index
    character(:), allocatable :: name
    logical :: ok

    index = 0
    call name_option(reader, card, 'AMPLITUDE', .false., name, ok)
    if (ok) call find_named(reader, amplitudes%names, option_position(card, 'AMPLITUDE'), name, &
      index)
  end subroutine amplitude_option

end module read_amplitudes_mod
