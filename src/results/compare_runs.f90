!> Whether two runs are of the same deck with the same parameters, and how they differ, in words.
module compare_runs_mod
  use text_mod, only: to_text, upper
  implicit none
  private

  public :: same_overrides, with_parameters, first_difference

contains

  !> "with --set n=1 --accuracy 0.01", or "without --set".
  pure function with_parameters(overrides) result(words)
    character(*), intent(in) :: overrides !! one a line
    character(:), allocatable :: words, line
    integer :: first

    words = 'without --set'
    if (overrides == '') return
    words = 'with'
    first = 1
    do while (first <= len(overrides))
      call take_line(overrides, first, line)
      if (index(line, '--') /= 1) line = '--set '//line
      words = words//' '//line
    end do
  end function with_parameters

  !> Whether two lists of overrides mean the same: in any order, of one name the last counts.
  pure logical function same_overrides(a, b)
    character(*), intent(in) :: a, b !! one a line

    same_overrides = all_in(a, b)
    if (same_overrides) same_overrides = all_in(b, a)

  contains

    !> Whether all names of one list have the same value in the other.
    pure logical function all_in(list, other)
      character(*), intent(in) :: list, other
      character(:), allocatable :: line
      integer :: first

      all_in = .true.
      first = 1
      do while (first <= len(list) .and. all_in)
        call take_line(list, first, line)
        all_in = value_of(list, name_in(line)) == value_of(other, name_in(line))
      end do
    end function all_in

    !> `=value` of the last line with this name, empty where there is none.
    pure function value_of(list, name) result(value)
      character(*), intent(in) :: list, name
      character(:), allocatable :: value, line
      integer :: first

      value = ''
      first = 1
      do while (first <= len(list))
        call take_line(list, first, line)
        if (name_in(line) == name) value = '='//trim(adjustl(line(split(line) + 1:)))
      end do
    end function value_of

    !> NAME in `name=value` or `--name value`.
    pure function name_in(line) result(name)
      character(*), intent(in) :: line
      character(:), allocatable :: name

      name = trim(adjustl(upper(line(:split(line) - 1))))
    end function name_in

    pure integer function split(line)
      character(*), intent(in) :: line

      split = index(line, '=')
      if (index(line, '--') == 1) split = index(line, ' ')
      if (split == 0) split = len(line) + 1
    end function split

  end function same_overrides

  !> The line of a text that begins at `first`, which moves to the one behind it.
  pure subroutine take_line(text, first, line)
    character(*), intent(in) :: text
    integer, intent(inout) :: first
    character(:), allocatable, intent(out) :: line

    line = text(first:first + index(text(first:)//new_line('a'), new_line('a')) - 2)
    first = first + len(line) + 1
  end subroutine take_line

  !> In which line two texts first differ, and how.
  pure function first_difference(then, now) result(words)
    character(*), intent(in) :: then, now
    character(:), allocatable :: words
    character, parameter :: nl = new_line('a')
    integer :: i, line, first

    line = 1
    first = 1
    do i = 1, min(len(then), len(now)) + 1
      if (character_at(then) /= character_at(now)) exit
      if (character_at(then) /= nl) cycle
      line = line + 1
      first = i + 1
    end do
    words = 'line '//to_text(line)//" was '"//line_at(then)//"', is '"//line_at(now)//"'"

  contains

    !> The last line ends like the others.
    pure character function character_at(text)
      character(*), intent(in) :: text

      character_at = nl
      if (i <= len(text)) character_at = text(i:i)
    end function character_at

    pure function line_at(text) result(found)
      character(*), intent(in) :: text
      character(:), allocatable :: found

      found = text(min(first, len(text) + 1):)
      found = found(:index(found//nl, nl) - 1)
    end function line_at

  end function first_difference

end module compare_runs_mod
