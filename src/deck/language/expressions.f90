!> Arithmetic with parameters.
!>
!>     0.4*cos(theta*pi/180)
!>
!> Grammar, all numbers real (5/50 is 0.1):
!>
!>     sum     = product { (+|-) product }
!>     product = factor { (*|/) factor }
!>     factor  = { + | - } ( number | name | function ( sum ) | ( sum ) )
!>
!> A name means a parameter defined above the place of its use, so no value can lead back to itself.
module expressions_mod
  use kinds_mod, only: wp
  use numbers_mod, only: largest_number, number_ok, number_token, number_too_large, read_real
  use parameters_mod, only: find_parameter, is_name_part, is_name_start, parameter_table_t
  use text_mod, only: string_t, upper
  use diagnostics_mod, only: guess, quoted
  implicit none
  private

  public :: evaluate, is_function

  integer, parameter :: max_nesting = 100  !! parentheses within parentheses

contains

  !> The value of an arithmetic expression.
  subroutine evaluate(text, position, table, value, problem, at)
    character(*), intent(in) :: text
    integer, intent(in) :: position  !! place of its use; parameters defined later do not exist yet
    type(parameter_table_t), intent(inout) :: table !! only marks what was used
    real(wp), intent(out) :: value
    character(:), allocatable, intent(out) :: problem !! allocated when there is no value
    integer, intent(out) :: at       !! the letter of `text` where the problem is
    integer :: depth

    at = 1
    depth = 0
    call read_sum(value)
    if (allocated(problem)) return
    call skip_blanks()
    if (at <= len(text)) problem = 'unexpected '//quoted(one_letter(text(at:)))// &
      ' in an expression'

  contains

    recursive subroutine read_sum(value)
      real(wp), intent(out) :: value
      real(wp) :: term
      character :: sign
      integer :: place

      call read_product(value)
      do
        call take_operator('+-', sign, place)
        if (place == 0) return
        call read_product(term)
        if (allocated(problem)) return
        if (sign == '-') term = -term
        value = value + term
        call check_size(value, place)
      end do
    end subroutine read_sum

    recursive subroutine read_product(value)
      real(wp), intent(out) :: value
      real(wp) :: factor
      character :: sign
      integer :: place

      call read_factor(value)
      do
        call take_operator('*/', sign, place)
        if (place == 0) return
        call read_factor(factor)
        if (allocated(problem)) return
        if (sign == '*') then
          value = value*factor
        else if (abs(factor) <= 0.0_wp) then
          problem = 'division by zero'
          at = place
        else if (exponent(value) - exponent(factor) > exponent(largest_number)) then
          problem = 'the result is too large'
          at = place
        else
          value = value/factor
        end if
        call check_size(value, place)
      end do
    end subroutine read_product

    !> The operator that goes on with a sum or a product.
    subroutine take_operator(operators, found, place)
      character(*), intent(in) :: operators
      character, intent(out) :: found
      integer, intent(out) :: place !! 0: none follows, or there is a problem

      found = ' '
      place = 0
      if (allocated(problem)) return
      call skip_blanks()
      if (scan(text(at:), operators) /= 1) return
      found = text(at:at)
      place = at
      at = at + 1
    end subroutine take_operator

    recursive subroutine read_factor(value)
      real(wp), intent(out) :: value
      logical :: negative

      value = 0.0_wp
      negative = .false.
      call skip_blanks()
      do while (at <= len(text))
        if (text(at:at) /= '+' .and. text(at:at) /= '-') exit
        if (text(at:at) == '-') negative = .not. negative
        at = at + 1
        call skip_blanks()
      end do
      if (at > len(text)) then
        problem = 'the expression is incomplete'
        at = max(1, len(text))
      else if (text(at:at) == '(') then
        call read_parentheses(value)
      else if (is_name_start(text(at:at))) then
        call read_name(value)
      else
        call read_number(value)
      end if
      if (negative) value = -value
    end subroutine read_factor

    recursive subroutine read_parentheses(value)
      real(wp), intent(out) :: value
      integer :: place

      value = 0.0_wp
      place = at
      if (depth == max_nesting) then
        problem = 'parentheses are nested too deeply'
        return
      end if
      depth = depth + 1
      at = at + 1
      call read_sum(value)
      depth = depth - 1
      if (allocated(problem)) return
      call skip_blanks()
      if (at <= len(text)) then
        if (text(at:at) == ')') then
          at = at + 1
          return
        end if
      end if
      problem = 'unmatched ('
      at = place
    end subroutine read_parentheses

    !> A parameter, a function with its argument, or pi.
    recursive subroutine read_name(value)
      real(wp), intent(out) :: value
      character(:), allocatable :: name
      integer :: first, found, place

      value = 0.0_wp
      first = at
      do while (at <= len(text))
        if (.not. is_name_part(text(at:at))) exit
        at = at + 1
      end do
      place = at
      name = upper(text(first:at - 1))
      call skip_blanks()
      if (at <= len(text)) then
        if (text(at:at) == '(' .and. is_function(name)) then
          call read_parentheses(value)
          if (.not. allocated(problem)) call apply(name, value, first)
          return
        end if
      end if
      at = first
      found = find_parameter(table, name)
      if (found > 0) then
        if (table%list(found)%position > position) then
          problem = 'parameter '//quoted(name)//' is defined below this place'
        else if (.not. table%list(found)%is_number) then
          problem = 'parameter '//quoted(name)//' is the word '//quoted(table%list(found)%text)// &
            ', not a number'
        else
          value = table%list(found)%number
          table%list(found)%used = .true.
        end if
      else if (name == 'PI') then
        value = acos(-1.0_wp)
      else
        problem = 'unknown parameter '//quoted(text(first:place - 1))//guess_parameter(name, table)
      end if
      if (.not. allocated(problem)) at = place
    end subroutine read_name

    subroutine apply(name, value, place)
      character(*), intent(in) :: name       !! one of those of is_function
      real(wp), intent(inout) :: value
      integer, intent(in) :: place

      select case (name)
      case ('SQRT')
        if (value < 0.0_wp) then
          problem = 'square root of a negative number'
          at = place
        else
          value = sqrt(value)
        end if
      case ('SIN')
        value = sin(value)
      case ('COS')
        value = cos(value)
      case default
        value = tan(value)
      end select
    end subroutine apply

    subroutine read_number(value)
      real(wp), intent(out) :: value
      integer :: length, status

      length = number_token(text(at:))
      call read_real(text(at:at + length - 1), value, status)
      if (length == 0) then
        problem = 'expected a number, a parameter or a function, found '// &
          quoted(one_letter(text(at:)))
      else if (status == number_too_large) then
        problem = 'the number '//quoted(text(at:at + length - 1))//' is too large'
      else if (status /= number_ok) then
        problem = quoted(text(at:at + length - 1))//' is not a number'
      else
        at = at + length
      end if
    end subroutine read_number

    subroutine check_size(value, place)
      real(wp), intent(in) :: value
      integer, intent(in) :: place

      if (allocated(problem) .or. abs(value) <= largest_number) return
      problem = 'the result is too large'
      at = place
    end subroutine check_size

    subroutine skip_blanks()
      do while (at <= len(text))
        if (text(at:at) /= ' ' .and. text(at:at) /= achar(9)) exit
        at = at + 1
      end do
    end subroutine skip_blanks

  end subroutine evaluate

  !> The first character of a text, which may have several bytes.
  pure function one_letter(text) result(letter)
    character(*), intent(in) :: text !! UTF-8, not empty
    character(:), allocatable :: letter
    integer :: last

    last = 1
    do while (last < len(text))
      if (iand(iachar(text(last + 1:last + 1)), 192) /= 128) exit
      last = last + 1
    end do
    letter = text(:last)
  end function one_letter

  pure logical function is_function(name) result(is)
    character(*), intent(in) :: name !! upper case

    is = name == 'SQRT' .or. name == 'SIN' .or. name == 'COS' .or. name == 'TAN'
  end function is_function

  !> The end of a message on an unknown parameter.
  function guess_parameter(name, table) result(hint)
    character(*), intent(in) :: name
    type(parameter_table_t), intent(in) :: table
    character(:), allocatable :: hint
    type(string_t), allocatable :: words(:)
    integer :: i

    allocate (words(table%n))
    do i = 1, table%n
      words(i)%text = table%list(i)%name
    end do
    hint = guess(name, words)
    if (len(hint) > 0) hint = '; '//hint
  end function guess_parameter

end module expressions_mod
