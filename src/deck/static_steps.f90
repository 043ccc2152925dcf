!> The static steps that a deck begins with, where it is to run without the others (--static-steps).
module static_steps_mod
  use cards_mod, only: is_keyword_line, note, pieces_t, reader_t, report, split_line
  use deck_table_mod, only: is_other_step, rule_of, rule_t, says, squeeze
  use text_mod, only: counted, to_text
  implicit none
  private

  public :: leave_out_steps

contains

  !> Take the first step that is not static, and all that follows it, out of the source.
  subroutine leave_out_steps(reader)
    type(reader_t), intent(inout) :: reader !! its cards have not been found yet
    type(pieces_t) :: pieces
    type(rule_t) :: rule
    character(:), allocatable :: name, other, what
    integer :: line, step, begins, n_left, of_other

    step = 0
    begins = 0
    of_other = 0
    n_left = 0
    other = ''
    do line = 1, reader%source%n_lines
      call open_keyword(line, name)
      if (name == '') cycle
      if (name == 'STEP') then
        if (of_other > 0) n_left = n_left + 1
        if (of_other > 0) cycle
        step = step + 1
        begins = line
        if (has_option('PERTURBATION', 'YES')) call leave_out('PERTURBATION')
      else if (of_other == 0 .and. step > 0) then
        rule = rule_of(name)
        if (is_other_step(name) .and. .not. has_option('APPLICATION', 'QUASI-STATIC')) call &
          leave_out('*'//trim(rule%name))
      end if
    end do
    if (of_other == 0) return
    if (step == 1) then
      call report(reader, reader%source%first(begins), 'the first step is not static ('//other// &
        '): --static-steps has nothing to run')
      return
    end if
    what = 'step '//to_text(step)//' ('//other//') is left out'
    if (n_left > 0) what = what//', and '//counted(n_left, 'step')//' behind it'
    call note(reader, what//': --static-steps runs those before it')
    reader%source%n_lines = of_other - 1

  contains

    subroutine leave_out(what)
      character(*), intent(in) :: what

      of_other = begins
      other = what
    end subroutine leave_out

    !> The keyword of a line, without blanks; empty where it is another line.
    subroutine open_keyword(line, name)
      integer, intent(in) :: line
      character(:), allocatable, intent(out) :: name

      name = ''
      if (.not. is_keyword_line(reader%source, line)) return
      call split_line(reader%source, line, pieces)
      name = squeeze(reader%source%text(pieces%first(1) + 1:pieces%last(1)))
    end subroutine open_keyword

    !> Whether the line that is open has an option, as a flag or with a value but NO.
    pure logical function has_option(option, value)
      character(*), intent(in) :: option, value
      integer :: i

      has_option = any([(says(reader%source%text(pieces%first(i):pieces%last(i)), option, value), &
        i=2, pieces%n)])
    end function has_option

  end subroutine leave_out_steps

end module static_steps_mod
