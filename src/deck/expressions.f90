!> Arithmetic between `<` and `>`, and the values of `*PARAMETER`.
!>
!>     *PARAMETER
!>     n = 4                         a number
!>     theta = 60.
!>     ux = 0.4*cos(theta*pi/180)    arithmetic with the names above
!>     element = C3D8                a word, put in as it stands
!>     *NODE
!>     1, <ux/n>, 0., 0.
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
  use numbers_mod, only: largest_number, number_ok, number_text, number_token, number_too_large, &
    read_real
  use parameters_mod, only: add_parameter, find_override, find_parameter, is_name_part, &
    is_name_start, max_parameters, parameter_table_t
  use text_mod, only: string_t, upper
  use diagnostics_mod, only: guess, quoted
  implicit none
  private

  public :: evaluate, substitute, define_parameter

  integer, parameter :: max_nesting = 100  !! parentheses within parentheses
  integer, parameter :: max_value = 1000   !! longest value of a parameter [byte]

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
    if (at <= len(text)) problem = 'unexpected '//quoted(text(at:at))//' in an expression'

  contains

    recursive subroutine read_sum(value)
      real(wp), intent(out) :: value
      real(wp) :: term
      character :: sign
      integer :: place

      call read_product(value)
      do
        if (allocated(problem)) return
        call skip_blanks()
        if (at > len(text)) return
        sign = text(at:at)
        if (sign /= '+' .and. sign /= '-') return
        place = at
        at = at + 1
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
        if (allocated(problem)) return
        call skip_blanks()
        if (at > len(text)) return
        sign = text(at:at)
        if (sign /= '*' .and. sign /= '/') return
        place = at
        at = at + 1
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
        problem = 'an expression ends too soon'
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
        problem = 'too many parentheses within each other'
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
      problem = 'this ( has no )'
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
      character(*), intent(in) :: name
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
      case ('TAN')
        value = tan(value)
      end select
    end subroutine apply

    subroutine read_number(value)
      real(wp), intent(out) :: value
      integer :: length, status

      length = number_token(text(at:))
      call read_real(text(at:at + length - 1), value, status)
      if (length == 0) then
        problem = 'expected a number, a parameter or a function, found '//quoted(text(at:at))
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

  pure function is_function(name) result(is)
    character(*), intent(in) :: name !! upper case
    logical :: is

    is = name == 'SQRT' .or. name == 'SIN' .or. name == 'COS' .or. name == 'TAN'
  end function is_function

  !> `text` with the value of every `<...>` in its place.
  subroutine substitute(text, position, table, replaced, problem, at)
    character(*), intent(in) :: text
    integer, intent(in) :: position !! place of the text in the deck
    type(parameter_table_t), intent(inout) :: table
    character(:), allocatable, intent(out) :: replaced
    character(:), allocatable, intent(out) :: problem !! allocated when it cannot be done
    integer, intent(out) :: at      !! the letter of `text` where the problem is
    character(:), allocatable :: value
    integer :: done, opening, closing

    replaced = ''
    at = 1
    done = 0
    do
      opening = index(text(done + 1:), '<') + done
      if (opening == done) exit
      closing = index(text(opening:), '>') + opening - 1
      at = opening
      if (closing < opening) then
        problem = "this '<' has no '>'"
        return
      end if
      call value_of(text(opening + 1:closing - 1), position, table, value, problem, at)
      if (allocated(problem)) then
        at = at + opening
        return
      end if
      if (len(replaced) + len(value) > 2*max_value + len(text)) then
        problem = 'with its parameters put in this becomes too long'
        return
      end if
      replaced = replaced//text(done + 1:opening - 1)//value
      done = closing
    end do
    replaced = replaced//text(done + 1:)
  end subroutine substitute

  !> What `<expression>` stands for: a parameter alone as it was written, else a number.
  subroutine value_of(expression, position, table, value, problem, at)
    character(*), intent(in) :: expression
    integer, intent(in) :: position
    type(parameter_table_t), intent(inout) :: table
    character(:), allocatable, intent(out) :: value
    character(:), allocatable, intent(out) :: problem
    integer, intent(out) :: at
    real(wp) :: number
    integer :: found

    at = 1
    value = ''
    found = 0
    if (len_trim(expression) > 0 .and. len_trim(expression) <= max_value) &
      found = find_parameter(table, upper(trim(adjustl(expression))))
    if (found > 0) then
      if (table%list(found)%position > position) then
        problem = 'parameter '//quoted(trim(adjustl(expression)))//' is defined below this place'
      else
        value = table%list(found)%text
        table%list(found)%used = .true.
      end if
    else
      call evaluate(expression, position, table, number, problem, at)
      if (.not. allocated(problem)) value = number_text(number)
    end if
  end subroutine value_of

  !> Define the parameter of a line `name = value`; the command line's value counts more.
  subroutine define_parameter(line, position, table, problem, at)
    character(*), intent(in) :: line
    integer, intent(in) :: position !! place of its first letter in the deck
    type(parameter_table_t), intent(inout) :: table
    character(:), allocatable, intent(out) :: problem
    integer, intent(out) :: at      !! the letter of `line` where the problem is
    character(:), allocatable :: name, value
    integer :: equal, first, last, i, override

    at = 1
    equal = index(line, '=')
    name = ''
    if (equal > 1) name = upper(trim(adjustl(no_tabs(line(:equal - 1)))))
    if (len(name) == 0) then
      problem = 'expected name = value'
      return
    end if
    do i = 1, len(name)
      if (.not. (is_name_part(name(i:i)) .and. is_name_start(name(1:1)))) then
        problem = "a parameter's name has letters, digits and _ only, not "//quoted(name)
        return
      end if
    end do
    if (find_parameter(table, name) > 0) then
      problem = 'duplicate parameter '//quoted(name)
    else if (name == 'PI' .or. is_function(name)) then
      problem = quoted(name)//' has a meaning of its own'
    else if (table%n == max_parameters) then
      problem = 'too many parameters'
    end if
    if (allocated(problem)) return

    first = equal + 1
    last = len(line)
    do while (first <= last)
      if (scan(line(first:first), ' '//achar(9)) == 0) exit
      first = first + 1
    end do
    do while (first <= last)
      if (scan(line(last:last), ' ,'//achar(9)) == 0) exit
      last = last - 1
    end do
    override = find_override(table, name)
    if (override > 0) then
      value = table%overrides(override)%value
    else
      value = line(first:last)
    end if
    call add_value(name, value, position, table, problem, at)
    if (.not. allocated(problem)) return
    at = at + first - 1
    if (override > 0) then
      problem = 'on the command line, '//name//'='//value//': '//problem
      at = 1
    end if
    ! It is defined nevertheless, so that its uses are not mistakes as well.
    call add_parameter(table, name, position, '1')
    table%list(table%n)%is_number = .true.
    table%list(table%n)%number = 1.0_wp
  end subroutine define_parameter

  !> Add parameter `name` with a value: a quoted text, a number, a word or an expression.
  subroutine add_value(name, written, position, table, problem, at)
    character(*), intent(in) :: name
    character(*), intent(in) :: written
    integer, intent(in) :: position
    type(parameter_table_t), intent(inout) :: table
    character(:), allocatable, intent(out) :: problem
    integer, intent(out) :: at
    character(:), allocatable :: value
    real(wp) :: number
    integer :: n, status

    n = len(written)
    at = 1
    if (n == 0 .or. n > max_value) then
      problem = 'a value has 1 to 1000 letters'
      return
    end if
    if (n >= 2 .and. scan(written(1:1), '"''') == 1 .and. written(n:n) == written(1:1)) then
      call add_parameter(table, name, position, written(2:n - 1))
      return
    end if
    value = written
    if (index(written, '<') > 0) then
      call substitute(written, position, table, value, problem, at)
      if (allocated(problem)) return
    end if
    call read_real(value, number, status)
    if (status /= number_ok) then
      if (is_word(value, table)) then
        call add_parameter(table, name, position, value)
        return
      end if
      call evaluate(value, position, table, number, problem, at)
      if (allocated(problem)) return
      value = number_text(number)
    end if
    call add_parameter(table, name, position, value)
    table%list(table%n)%is_number = .true.
    table%list(table%n)%number = number
  end subroutine add_value

  !> Whether a value is a word (STEEL, BODY-ZMIN, GLOBAL NEWTON), not an expression.
  !>
  !> It is one when it begins with a name that means nothing else, and could not be arithmetic but
  !> for hyphens.
  pure function is_word(value, table) result(is)
    character(*), intent(in) :: value
    type(parameter_table_t), intent(in) :: table
    logical :: is
    character(:), allocatable :: name
    integer :: i

    is = .false.
    if (len(value) == 0) return
    if (.not. is_name_start(value(1:1))) return
    do i = 1, len(value)
      if (.not. (is_name_part(value(i:i)) .or. scan(value(i:i), ' -.') == 1)) return
    end do
    do i = 1, len(value)
      if (.not. is_name_part(value(i:i))) exit
    end do
    name = upper(value(:i - 1))
    is = find_parameter(table, name) == 0 .and. name /= 'PI' .and. .not. is_function(name)
  end function is_word

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

  pure function no_tabs(text) result(plain)
    character(*), intent(in) :: text
    character(:), allocatable :: plain
    integer :: i

    plain = text
    do i = 1, len(plain)
      if (plain(i:i) == achar(9)) plain(i:i) = ' '
    end do
  end function no_tabs

end module expressions_mod
