!> Parameters: their definition, and `<...>` in the text that follows.
!>
!>     *PARAMETER
!>     n = 4                         a number
!>     theta = 60.
!>     ux = 0.4*cos(theta*pi/180)    arithmetic with the names above
!>     element = C3D8                a word, put in as it stands
!>     *NODE
!>     1, <ux/n>, 0., 0.
module substitution_mod
  use diagnostics_mod, only: quoted
  use expressions_mod, only: evaluate, is_function
  use deck_table_mod, only: without_tabs
  use kinds_mod, only: wp
  use numbers_mod, only: number_ok, number_text, read_real
  use parameters_mod, only: add_parameter, find_override, find_parameter, is_name_part, &
    is_name_start, max_parameters, parameter_table_t
  use text_mod, only: to_text, upper
  implicit none
  private

  public :: substitute, define_parameter

  integer, parameter :: max_value = 1000   !! longest value of a parameter [byte]
  integer, parameter :: max_name = 80      !! longest name of one [byte]

contains

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
        problem = "unmatched '<'"
        return
      end if
      call value_of(text(opening + 1:closing - 1), position, table, value, problem, at)
      if (allocated(problem)) then
        at = at + opening
        return
      end if
      if (len(replaced) + len(value) > 2*max_value + len(text)) then
        problem = 'this is too long once its parameters are substituted'
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
    if (len_trim(expression) > 0 .and. len_trim(expression) <= max_value) then
      found = find_parameter(table, upper(trim(adjustl(expression))))
    end if
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
    if (equal > 1) name = upper(trim(adjustl(without_tabs(line(:equal - 1)))))
    if (len(name) == 0) then
      problem = 'expected name = value'
      return
    end if
    if (len(name) > max_name) then
      problem = 'a name has at most '//to_text(max_name)//' letters: '//quoted(name)
      return
    end if
    do i = 1, len(name)
      if (.not. (is_name_part(name(i:i)) .and. is_name_start(name(1:1)))) then
        problem = "a parameter's name has letters, digits and _ only, not "//quoted(name)
        return
      end if
    end do
    if (find_parameter(table, name) > 0) then
      problem = 'duplicate parameter '//quoted(name)//' (upper and lower case are the same)'
    else if (name == 'PI' .or. is_function(name)) then
      problem = quoted(name)//' is a reserved name'
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
  pure logical function is_word(value, table) result(is)
    character(*), intent(in) :: value
    type(parameter_table_t), intent(in) :: table
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

end module substitution_mod
