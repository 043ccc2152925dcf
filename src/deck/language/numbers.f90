!> Numbers as decks write them: `12`, `-1.`, `.5`, `1e-3`, `2.1D+05`, `2.1+5`.
module numbers_mod
  use, intrinsic :: iso_c_binding, only: c_char, c_double, c_null_char, c_null_ptr, c_ptr
  use kinds_mod, only: i8, wp
  use text_mod, only: to_text, upper
  implicit none
  private

  public :: read_integer, read_real, take_positive, number_text, number_token, largest_number
  public :: number_ok, number_malformed, number_too_large, number_not_finite

  integer, parameter :: number_ok = 0
  integer, parameter :: number_malformed = 1
  integer, parameter :: number_too_large = 2
  integer, parameter :: number_not_finite = 3 !! a NaN or an infinity, spelled out

  !> Larger numbers are refused, so that no product of a few of them can overflow.
  real(wp), parameter :: largest_number = 1.0e60_wp
  integer, parameter :: largest_exponent = 60
  integer, parameter :: smallest_exponent = -290 !! smaller numbers become 0
  integer, parameter :: max_digits = 40          !! digits that can matter; later ones are dropped

  interface
    !> The number that a text ended by a null character begins with.
    pure function c_strtod(text, ending) result(number) bind(c, name='strtod')
      import :: c_char, c_double, c_ptr
      implicit none
      character(kind=c_char), intent(in) :: text(*)
      type(c_ptr), value, intent(in) :: ending !! null: where the number ends is not asked for
      real(c_double) :: number
    end function c_strtod
  end interface

contains

  !> Read a whole number.
  pure subroutine read_integer(text, value, status)
    character(*), intent(in) :: text  !! without blanks around
    integer, intent(out) :: value     !! 0 where the status is not number_ok
    integer, intent(out) :: status    !! number_ok, number_malformed or number_too_large
    integer(i8) :: sum
    integer :: i, first, digit

    value = 0
    status = number_malformed
    first = 1
    if (len(text) == 0) return
    if (text(1:1) == '+' .or. text(1:1) == '-') first = 2
    if (first > len(text)) return
    sum = 0
    do i = first, len(text)
      digit = iachar(text(i:i)) - iachar('0')
      if (digit < 0 .or. digit > 9) return
      if (sum <= huge(value)) sum = 10*sum + digit
    end do
    if (sum > huge(value)) then
      status = number_too_large
      return
    end if
    status = number_ok
    value = int(sum)
    if (text(1:1) == '-') value = -value
  end subroutine read_integer

  !> Read a number, correctly rounded.
  pure subroutine read_real(text, value, status)
    character(*), intent(in) :: text  !! without blanks around
    real(wp), intent(out) :: value    !! 0 where the status is not number_ok
    integer, intent(out) :: status
    ! Exact powers of ten: with a mantissa below 2**53, one product or quotient rounds correctly.
    real(wp), parameter :: power(0:22) = [1e0_wp, 1e1_wp, 1e2_wp, 1e3_wp, 1e4_wp, 1e5_wp, &
      1e6_wp, 1e7_wp, 1e8_wp, 1e9_wp, 1e10_wp, 1e11_wp, 1e12_wp, 1e13_wp, 1e14_wp, 1e15_wp, &
      1e16_wp, 1e17_wp, 1e18_wp, 1e19_wp, 1e20_wp, 1e21_wp, 1e22_wp]
    character(max_digits) :: digits
    integer(i8) :: mantissa
    integer :: n_digits, exponent
    logical :: negative

    value = 0.0_wp
    call take_apart(text, digits, n_digits, exponent, negative, status)
    if (status /= number_ok .or. n_digits == 0) return
    if (n_digits + exponent > largest_exponent + 1) then
      status = number_too_large
      return
    end if
    if (n_digits + exponent < smallest_exponent) return
    if (n_digits <= 15 .and. abs(exponent) <= 22) then
      call read_digits(digits(:n_digits), mantissa)
      if (exponent >= 0) then
        value = real(mantissa, wp)*power(exponent)
      else
        value = real(mantissa, wp)/power(-exponent)
      end if
    else
      value = convert(digits(:n_digits), exponent)
    end if
    if (value > largest_number) then
      status = number_too_large
      value = 0.0_wp
    end if
    if (negative) value = -value
  end subroutine read_real

  !> Take a number between 0 and `below`, neither included; no number is above the largest.
  pure subroutine take_positive(text, below, value, wanted)
    character(*), intent(in) :: text
    real(wp), intent(in) :: below
    real(wp), intent(inout) :: value !! unchanged where there is no such number
    character(:), allocatable, intent(out) :: wanted
    !! allocated where there is none: what there should be, in words
    real(wp) :: number
    integer :: status

    call read_real(text, number, status)
    if (status == number_ok .and. number > 0.0_wp .and. number < below) then
      value = number
    else
      wanted = 'a number above 0 and below '//to_text(min(below, largest_number))
    end if
  end subroutine take_positive

  !> Split a number into its significant digits and the power of ten of the last of them.
  pure subroutine take_apart(text, digits, n_digits, exponent, negative, status)
    character(*), intent(in) :: text
    character(max_digits), intent(out) :: digits
    integer, intent(out) :: n_digits  !! 0 for the number 0
    integer, intent(out) :: exponent
    logical, intent(out) :: negative
    integer, intent(out) :: status
    integer, parameter :: enough = 100000000
    integer :: i, shift
    logical :: after_point, any_digit

    digits = ''
    n_digits = 0
    exponent = 0
    status = number_malformed
    i = 1
    negative = .false.
    if (len(text) == 0) return
    if (text(1:1) == '+' .or. text(1:1) == '-') then
      negative = text(1:1) == '-'
      i = 2
    end if
    if (spells_no_number(text(i:))) status = number_not_finite
    after_point = .false.
    any_digit = .false.
    shift = 0
    mantissa: do while (i <= len(text))
      select case (text(i:i))
      case ('0':'9')
        any_digit = .true.
        if (n_digits < max_digits) then
          if (n_digits > 0 .or. text(i:i) /= '0') then
            n_digits = n_digits + 1
            digits(n_digits:n_digits) = text(i:i)
          end if
          if (after_point) shift = shift - 1
        else if (.not. after_point) then
          shift = shift + 1
        end if
      case ('.')
        if (after_point) return
        after_point = .true.
      case default
        exit mantissa
      end select
      i = i + 1
    end do mantissa
    if (.not. any_digit) return
    if (i <= len(text)) then
      if (scan(text(i:i), 'eEdDqQ') == 1) then
        i = i + 1
      else if (scan(text(i:i), '+-') == 0) then
        return
      end if
      call read_integer(text(i:), exponent, status)
      if (status == number_malformed) return
      if (status == number_too_large) exponent = enough
      if (status == number_too_large .and. text(i:i) == '-') exponent = -enough
    end if
    exponent = max(-enough, min(enough, exponent)) + shift
    status = number_ok
  end subroutine take_apart

  pure subroutine read_digits(digits, mantissa)
    character(*), intent(in) :: digits !! at most 18
    integer(i8), intent(out) :: mantissa
    integer :: i

    mantissa = 0
    do i = 1, len(digits)
      mantissa = 10*mantissa + iachar(digits(i:i)) - iachar('0')
    end do
  end subroutine read_digits

  !> digits * 10**exponent by the C library, which rounds correctly and is quick.
  pure real(wp) function convert(digits, exponent) result(value)
    character(*), intent(in) :: digits  !! at most max_digits
    integer, intent(in) :: exponent     !! |exponent| < 1000
    character(kind=c_char) :: buffer(max_digits + 6)
    integer :: i, n

    n = len(digits)
    do i = 1, n
      buffer(i) = digits(i:i)
    end do
    buffer(n + 1) = 'e'
    buffer(n + 2) = '+'
    if (exponent < 0) buffer(n + 2) = '-'
    buffer(n + 3) = achar(iachar('0') + abs(exponent)/100)
    buffer(n + 4) = achar(iachar('0') + mod(abs(exponent)/10, 10))
    buffer(n + 5) = achar(iachar('0') + mod(abs(exponent), 10))
    buffer(n + 6) = c_null_char
    value = c_strtod(buffer, c_null_ptr)
  end function convert

  pure logical function spells_no_number(text) result(spells)
    character(*), intent(in) :: text

    spells = .false.
    if (len(text) > 8) return
    spells = upper(text) == 'NAN' .or. upper(text) == 'INF' .or. upper(text) == 'INFINITY'
  end function spells_no_number

  !> `value` as the shortest text that reads back to the same bits.
  pure function number_text(value) result(text)
    real(wp), intent(in) :: value !! |value| <= largest_number
    character(:), allocatable :: text
    real(wp) :: again
    integer :: digits

    do digits = 15, 17
      text = to_text(value, digits)
      read (text, *) again
      if (abs(again - value) <= 0.0_wp) return
    end do
  end function number_text

  !> The length of the number without sign at the beginning of `text`; 0: there is none.
  pure function number_token(text) result(length)
    character(*), intent(in) :: text
    character(*), parameter :: digits = '0123456789'
    integer :: length, first, n

    length = verify(text//' ', digits//'.') - 1
    if (scan(text(:length), digits) == 0) length = 0
    if (length == 0 .or. scan(text(length + 1:), 'eEdD') /= 1) return
    first = length + 2 ! of the exponent
    if (scan(text(first:), '+-') == 1) first = first + 1
    n = verify(text(first:)//' ', digits) - 1
    if (n > 0) length = first + n - 1
  end function number_token

end module numbers_mod
