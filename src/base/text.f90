!> Small text helpers: case, numbers as text, the nearest of several words.
module text_mod
  use kinds_mod, only: wp, i8
  implicit none
  private

  public :: printable, upper, to_text, counted, in_known_digits, percent, nearest_word, string_t, &
    as_list, one_of, digits_where_unknown

  !> A text of its own length, for lists of texts.
  type :: string_t
    character(:), allocatable :: text
  end type string_t

  !> A number as text without blanks.
  interface to_text
    module procedure integer_to_text, long_to_text, real_to_text
  end interface to_text

  !> "A, B or C".
  interface one_of
    module procedure one_of_list, one_of_words
  end interface one_of

  !> How many digits are printed of a number whose error is not known.
  integer, parameter :: digits_where_unknown = 3

contains

  !> A text that may hold anything, for a message: what is not ASCII shows as question marks.
  pure function printable(text) result(shown)
    character(*), intent(in) :: text
    character(len(text)) :: shown
    integer :: i

    shown = text
    do i = 1, len(text)
      if (text(i:i) < ' ' .or. text(i:i) > '~') shown(i:i) = '?'
    end do
  end function printable

  !> Words of one length as a list of texts without the blanks behind them. (An array constructor
  !> of `string_t` leaks with gfortran 12.)
  pure function as_list(words) result(list)
    character(*), intent(in) :: words(:)
    type(string_t), allocatable :: list(:)
    integer :: i

    allocate (list(size(words)))
    do i = 1, size(words)
      list(i)%text = trim(words(i))
    end do
  end function as_list

  !> "A, B or C".
  pure function one_of_list(words) result(text)
    type(string_t), intent(in) :: words(:)
    character(:), allocatable :: text
    integer :: i

    text = words(1)%text
    do i = 2, size(words)
      if (i < size(words)) then
        text = text//', '//words(i)%text
      else
        text = text//' or '//words(i)%text
      end if
    end do
  end function one_of_list

  !> "A, B or C", of words of one length.
  pure function one_of_words(words) result(text)
    character(*), intent(in) :: words(:)
    character(:), allocatable :: text

    text = one_of_list(as_list(words))
  end function one_of_words

  !> `text` in upper case (ASCII letters only; other bytes stay).
  pure function upper(text) result(converted)
    character(*), intent(in) :: text
    character(len(text)) :: converted
    integer :: i, code

    do i = 1, len(text)
      code = iachar(text(i:i))
      if (code >= iachar('a') .and. code <= iachar('z')) code = code - 32
      converted(i:i) = achar(code)
    end do
  end function upper

  !> "1 point", "3 points".
  pure function counted(n, noun) result(text)
    integer, intent(in) :: n
    character(*), intent(in) :: noun
    character(:), allocatable :: text

    text = to_text(n)//' '//noun
    if (n /= 1) text = text//'s'
  end function counted

  pure function integer_to_text(number) result(text)
    integer, intent(in) :: number
    character(:), allocatable :: text

    text = long_to_text(int(number, i8))
  end function integer_to_text

  pure function long_to_text(number) result(text)
    integer(i8), intent(in) :: number
    character(:), allocatable :: text
    character(24) :: buffer

    write (buffer, '(i0)') number
    text = trim(buffer)
  end function long_to_text

  !> `number` rounded to `digits` significant digits, without trailing zeros; plain from 1e-4 to
  !> 1e7, where whole numbers keep all their digits.
  pure function real_to_text(number, digits) result(text)
    real(wp), intent(in) :: number
    integer, intent(in), optional :: digits !! 1 to 17 (default 6)
    character(:), allocatable :: text
    character(40) :: buffer
    integer :: wanted, mark, power

    wanted = 6
    if (present(digits)) wanted = digits
    write (buffer, '(es40.'//integer_to_text(wanted - 1)//'e3)') number
    text = trim(adjustl(buffer))
    mark = scan(text, 'E')
    if (mark == 0) return ! NaN or infinite
    read (text(mark + 1:), *) power
    if (power >= -4 .and. power <= 6) then
      write (buffer, '(f40.'//integer_to_text(max(0, wanted - 1 - power))//')') number
      text = without_zeros(trim(adjustl(buffer)))
    else
      text = without_zeros(text(:mark - 1))//'e'//integer_to_text(power)
    end if
  end function real_to_text

  !> A decimal fraction without its trailing zeros and, if nothing is left behind it, its point.
  pure function without_zeros(number) result(text)
    character(*), intent(in) :: number
    character(:), allocatable :: text
    integer :: last

    last = len(number)
    if (index(number, '.') > 0) last = verify(number, '0', back=.true.)
    if (number(last:last) == '.') last = last - 1
    text = number(:last)
    if (text(1:1) == '.') text = '0'//text
  end function without_zeros

  !> The index of the word of `words` nearest to `word` by edit distance; 0 when none is near.
  !>
  !> Near means: at most a third of the longer word's letters differ (at least one may).
  pure function nearest_word(word, words) result(nearest)
    character(*), intent(in) :: word
    type(string_t), intent(in) :: words(:)
    integer :: nearest, i, distance, best

    nearest = 0
    best = huge(best)
    do i = 1, size(words)
      distance = edit_distance(word, words(i)%text)
      if (distance > max(1, max(len(word), len(words(i)%text))/3)) cycle
      if (distance < best) then
        best = distance
        nearest = i
      end if
    end do
  end function nearest_word

  !> Levenshtein's distance: the fewest insertions, deletions and substitutions from `a` to `b`.
  pure function edit_distance(a, b) result(distance)
    character(*), intent(in) :: a, b
    integer :: distance, i, j, diagonal, above
    integer :: row(0:len(b))

    row = [(j, j = 0, len(b))]
    do i = 1, len(a)
      diagonal = row(0)
      row(0) = i
      do j = 1, len(b)
        above = row(j)
        row(j) = min(row(j) + 1, row(j - 1) + 1, diagonal + merge(0, 1, a(i:i) == b(j:j)))
        diagonal = above
      end do
    end do
    distance = row(len(b))
  end function edit_distance

  !> 0.62 %; what is too small for that, as a plain number.
  pure function percent(part) result(words)
    real(wp), intent(in) :: part !! [-]
    character(:), allocatable :: words

    words = to_text(part, 2)
    if (part >= 1.0e-5_wp) words = to_text(100.0_wp*part, 2)//' %'
  end function percent

  !> `number` in the digits that are known: down to the first one of its error, with zeros where
  !> they are known to be there, 0 where all are below. At most six digits.
  pure function in_known_digits(number, error) result(text)
    real(wp), intent(in) :: number
    real(wp), intent(in) :: error !! of the number; negative: not known
    character(:), allocatable :: text
    integer, parameter :: most = 6
    character(40) :: buffer
    integer :: power, last, mark

    if (.not. abs(number) <= huge(number)) then
      text = to_text(number)
      return
    end if
    text = '0'
    if (.not. abs(number) > 0.0_wp) return
    power = power_of_ten(number)
    last = power - most + 1
    if (error < 0.0_wp) last = power - digits_where_unknown + 1
    if (error > 0.0_wp) last = max(last, power_of_ten(error))
    if (power < last) return
    ! To so many digits, which may make it a digit longer.
    write (buffer, '(es40.'//to_text(power - last)//'e3)') number
    text = trim(adjustl(buffer))
    mark = scan(text, 'E')
    read (text(mark + 1:), *) power
    if (power >= -4 .and. power <= most) then
      associate (rounded => anint(number/10.0_wp**last)*10.0_wp**last)
        write (buffer, '(f40.'//to_text(max(0, -last))//')') rounded
      end associate
      text = trim(adjustl(buffer))
      if (text(len(text):) == '.') text = text(:len(text) - 1)
    else
      text = text(:mark - 1)//'e'//to_text(power)
    end if
  end function in_known_digits

  !> The place of the first digit of a number of seven: 2 for 123.
  pure integer function power_of_ten(number) result(power)
    real(wp), intent(in) :: number !! finite, not 0
    character(40) :: buffer

    write (buffer, '(es40.6e3)') number
    read (buffer(scan(buffer, 'E') + 1:), *) power
  end function power_of_ten

end module text_mod
