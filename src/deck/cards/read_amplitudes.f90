!> Values over the time of a step or of the run.
!>
!>     *AMPLITUDE, NAME=PULSE[, TIME=TOTAL TIME]
!>     0., 0.,  0.5, 1.,  1., 0.      time, value, any number of pairs a line
!>     *AMPLITUDE, NAME=WAVE, DEFINITION=PERIODIC
!>     1, 6.2831853, 0., 0.           how many terms, circular frequency, where it begins, A0
!>     0., 1.                         A1, B1, A2, B2, ...
module read_amplitudes_mod
  use cards_mod, only: keep_reading, reader_t, report
  use diagnostics_mod, only: quoted
  use name_table_mod, only: add_named, close_directory, name_table_t, find_named, open_directory
  use fields_mod, only: any_number, field_position, field_text, fields_t, integer_field, &
    is_empty_field, next_data_line, real_field
  use growing_lists_mod, only: enlarge
  use kinds_mod, only: wp
  use loads_mod, only: amplitude_t
  use options_mod, only: allow_options, card_t, choice_option, has_option, name_option, open_card, &
    option_position, signed_option
  use text_mod, only: to_text
  implicit none
  private

  public :: amplitude_list_t, read_amplitudes, amplitude_option

  integer, parameter :: total_time = 2, periodic = 2, smooth_step = 3 !! of the options' choices
  character(*), parameter :: loads(5) = [character(11) :: 'BOUNDARY', 'CLOAD', 'DLOAD', 'DSLOAD', &
    'TEMPERATURE'] !! that may begin later

  !> The amplitudes of a deck, found by name.
  type :: amplitude_list_t
    type(amplitude_t), allocatable :: list(:)
    integer, allocatable :: of(:)     !! those that begin later: which of them this is; else 0
    real(wp), allocatable :: delay(:) !! and by how much [time]
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

    call open_directory(reader, 'AMPLITUDE', 'amplitude', amplitudes%names, n)
    allocate (amplitudes%list(n))
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'AMPLITUDE') cycle
      call open_card(reader, k, card)
      call add_named(reader, card, amplitudes%names, name)
      n = amplitudes%names%n
      amplitudes%list(n)%name = name
      call read_amplitude(reader, card, amplitudes%list(n))
    end do
    call close_directory(reader, amplitudes%names)
    amplitudes%of = spread(0, 1, size(amplitudes%list))
    amplitudes%delay = spread(0.0_wp, 1, size(amplitudes%list))
    do k = 1, reader%n_cards
      if (.not. any(reader%cards(k)%keyword == loads)) cycle
      call open_card(reader, k, card)
      if (has_option(card, 'TIME DELAY')) call add_delayed(reader, card, amplitudes)
    end do
  end subroutine read_amplitudes

  !> The amplitude that a card names, beginning as much later as its TIME DELAY= says.
  subroutine add_delayed(reader, card, amplitudes)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(amplitude_list_t), intent(inout) :: amplitudes
    type(amplitude_t) :: delayed
    character(:), allocatable :: name
    real(wp) :: delay
    integer :: index
    logical :: ok

    call signed_option(reader, card, 'TIME DELAY', delay, ok)
    if (delay < 0.0_wp) call report(reader, option_position(card, 'TIME DELAY'), &
      'TIME DELAY must not be negative')
    if (.not. has_option(card, 'AMPLITUDE')) call report(reader, option_position(card, &
      'TIME DELAY'), 'TIME DELAY delays an amplitude: AMPLITUDE= is missing')
    call name_option(reader, card, 'AMPLITUDE', .false., name, ok)
    if (.not. (ok .and. delay > 0.0_wp)) return
    call find_named(reader, amplitudes%names, option_position(card, 'AMPLITUDE'), name, index)
    if (index == 0) return
    if (.not. allocated(amplitudes%list(index)%time)) return
    delayed = amplitudes%list(index)
    delayed%time = delayed%time + delay
    amplitudes%list = [amplitudes%list, delayed]
    amplitudes%of = [amplitudes%of, index]
    amplitudes%delay = [amplitudes%delay, delay]
  end subroutine add_delayed

  subroutine read_amplitude(reader, card, amplitude)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(amplitude_t), intent(inout) :: amplitude
    integer :: choice
    logical :: ok

    call allow_options(reader, card)
    choice = 1
    call choice_option(reader, card, 'TIME', choice, ok)
    amplitude%total = choice == total_time
    choice = 1
    call choice_option(reader, card, 'VALUE', choice, ok)
    choice = 1
    call choice_option(reader, card, 'DEFINITION', choice, ok)
    if (has_option(card, 'SMOOTH')) then
      call signed_option(reader, card, 'SMOOTH', amplitude%rounding, ok)
      if (amplitude%rounding < 0.0_wp .or. amplitude%rounding > 0.5_wp .or. choice > 1) call &
        report(reader, option_position(card, 'SMOOTH'), 'SMOOTH is a number from 0 to 0.5, of '// &
        'DEFINITION=TABULAR')
    end if
    amplitude%is_smooth = choice == smooth_step
    if (choice == periodic) then
      call read_series(reader, card, amplitude)
    else
      call read_table(reader, card, amplitude)
    end if
  end subroutine read_amplitude

  !> A Fourier series: how many terms, the circular frequency, where it begins, its mean; then the
  !> coefficients of cosine and sine, term by term.
  subroutine read_series(reader, card, amplitude)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(amplitude_t), intent(inout) :: amplitude
    integer, parameter :: most_terms = 1000
    character(*), parameter :: what = 'how many terms, the circular frequency, the time where '// &
      'it begins, A0'
    type(fields_t) :: fields
    real(wp), allocatable :: numbers(:)
    integer, allocatable :: positions(:)
    integer :: n_terms
    logical :: found, ok

    amplitude%time = [0.0_wp]
    amplitude%value = [0.0_wp]
    allocate (amplitude%cosine(0), amplitude%sine(0))
    call next_data_line(reader, card, fields, found, 4, what)
    if (.not. found) then
      call report(reader, card%position, '*AMPLITUDE, DEFINITION=PERIODIC needs a data line: '// &
        what)
      return
    end if
    call integer_field(reader, fields, 1, 'how many terms', 1, n_terms, ok)
    if (ok .and. n_terms > most_terms) call report(reader, fields%start, &
      'a periodic amplitude has at most '//to_text(most_terms)//' terms, not '// &
      quoted(field_text(reader, fields, 1)))
    if (.not. ok .or. n_terms > most_terms) return
    call real_field(reader, fields, 2, 'the circular frequency', amplitude%frequency, ok)
    if (ok .and. amplitude%frequency <= 0.0_wp) call report(reader, field_position(reader, fields, &
      2), 'the circular frequency must be positive, not '//quoted(field_text(reader, fields, 2)))
    if (.not. is_empty_field(fields, 3)) call real_field(reader, fields, 3, &
      'the time where it begins', amplitude%time(1), ok)
    if (.not. is_empty_field(fields, 4)) call real_field(reader, fields, 4, 'A0', &
      amplitude%value(1), ok)
    call read_numbers(reader, card, fields, 'A1, B1, A2, B2, ...', 'a coefficient', numbers, &
      positions, ok)
    if (.not. keep_reading(reader)) return
    if (size(numbers) /= 2*n_terms) then
      call report(reader, card%position, 'a periodic amplitude of '//to_text(n_terms)// &
        ' terms needs '//to_text(2*n_terms)//' numbers below its first line, A1, B1, A2, B2, '// &
        '..., found '//to_text(size(numbers)))
      return
    end if
    amplitude%cosine = numbers(1::2)
    amplitude%sine = numbers(2::2)
  end subroutine read_series

  !> The pairs of one card, times ascending; continued where a line ends with half a pair.
  subroutine read_table(reader, card, amplitude)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(amplitude_t), intent(inout) :: amplitude
    type(fields_t) :: fields
    real(wp), allocatable :: numbers(:)
    integer, allocatable :: positions(:)
    integer :: n, i
    logical :: all_ok

    call read_numbers(reader, card, fields, 'pairs of time and value', 'a time or a value', &
      numbers, positions, all_ok)
    if (.not. keep_reading(reader)) return
    n = size(numbers)
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

  !> All numbers on the data lines of a card that are not read yet, and where they stand.
  subroutine read_numbers(reader, card, fields, what, one, numbers, positions, ok)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(fields_t), intent(inout) :: fields !! of the line before
    character(*), intent(in) :: what, one   !! all, and one of them, for messages
    real(wp), allocatable, intent(out) :: numbers(:)
    integer, allocatable, intent(out) :: positions(:)
    logical, intent(out) :: ok              !! false after a mistake
    integer :: n, i
    logical :: found, is_number

    allocate (numbers(16), positions(16))
    n = 0
    ok = .true.
    lines: do
      call next_data_line(reader, card, fields, found, any_number, what)
      if (.not. found) exit lines
      do i = 1, fields%n
        if (.not. keep_reading(reader)) exit lines
        if (n == size(numbers)) then
          call enlarge(numbers, n, 2*n)
          call enlarge(positions, n, 2*n)
        end if
        n = n + 1
        positions(n) = field_position(reader, fields, i)
        call real_field(reader, fields, i, one, numbers(n), is_number)
        ok = ok .and. is_number
      end do
    end do lines
    numbers = numbers(:n)
    positions = positions(:n)
  end subroutine read_numbers

  !> The amplitude that AMPLITUDE= names, with its TIME DELAY=: its index; 0 without it, or where a
  !> mistake was reported.
  subroutine amplitude_option(reader, card, amplitudes, index)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(amplitude_list_t), intent(in) :: amplitudes
    integer, intent(out) :: index
    character(:), allocatable :: name
    real(wp) :: delay
    integer :: i
    logical :: ok

    index = 0
    call name_option(reader, card, 'AMPLITUDE', .false., name, ok)
    if (ok) call find_named(reader, amplitudes%names, option_position(card, 'AMPLITUDE'), name, &
      index)
    if (index == 0 .or. .not. has_option(card, 'TIME DELAY')) return
    call signed_option(reader, card, 'TIME DELAY', delay, ok)
    if (.not. (ok .and. delay > 0.0_wp)) return
    do i = size(amplitudes%of), 1, -1
      if (amplitudes%of(i) == index .and. amplitudes%delay(i) <= delay .and. &
        amplitudes%delay(i) >= delay) exit
    end do
    index = i
  end subroutine amplitude_option

end module read_amplitudes_mod
