!> How a run says how it went.
module close_run_mod
  use kinds_mod, only: wp
  use text_mod, only: string_t, to_text, percent
  use system_mod, only: peak_memory_bytes
  use parallel_mod, only: usage_t, usage_of_others
  use scene_mod, only: scene_t
  use controls_mod, only: precision_controls_t, precision_in_words
  use tally_mod, only: tally_t
  use console_mod, only: console_t, say, print_lines, print_warning, seconds_in_words
  implicit none
  private

  public :: close_run

  real(wp), parameter :: linear = 0.05_wp !! strains and rotations up to here are small

contains

  !> Phases and memory, then the one sentence that says how it went.
  subroutine close_run(scene, console, tally, path)
    type(scene_t), intent(in) :: scene
    type(console_t), intent(in) :: console
    type(tally_t), intent(in) :: tally
    character(*), intent(in) :: path
    type(usage_t) :: others
    type(string_t) :: lines(4)

    if (console%silent) return
    others = usage_of_others()
    associate (s => tally%work)
      lines(1)%text = 'time            read '//seconds(tally%read_time)//', assemble '// &
        seconds(s%assemble)//', order '//seconds(s%order)//', factorise '// &
        seconds(s%factorise)//', condense '//seconds(s%condense)//', loads '// &
        seconds(s%loads)//','
      lines(2)%text = '                contact '//seconds(tally%contact_time)//', recover '// &
        seconds(tally%step_time - tally%contact_time)//', estimate '// &
        seconds(tally%estimate_time)//', write '//seconds(tally%write_time)
      lines(3)%text = 'accuracy        '//accuracy_in_words(scene%precision, tally%unrefined, &
        tally%imbalance)
      lines(4)%text = 'memory          at most '//to_text(real(peak_memory_bytes() + others%peak, &
        wp)/1.0e6_wp, 3)//' MB'
      call print_lines(console, lines)
    end associate
    call tell_theory(console, tally)
    if (tally%certified < tally%increments) then
      call print_warning(console, to_text(tally%increments - tally%certified)//' of '// &
        to_text(tally%increments)// &
        ' increments are not certified (STOP=CHANGE continues past them)')
    end if
    call say(to_text(tally%certified)//' of '//to_text(tally%increments)// &
      ' increments certified to '// &
             to_text(tally%allowed, 3)//', worst error '//to_text(tally%worst, 2)// &
             ' (increment '// &
             to_text(tally%worst_increment)//'), '//seconds_in_words(tally%total_time)//': '//path)
  end subroutine close_run

  !> Say where strains or rotations are too large for the theory. docs/theory.md (8.11).
  subroutine tell_theory(console, tally)
    type(console_t), intent(in) :: console
    type(tally_t), intent(in) :: tally
    character(:), allocatable :: words
    type(string_t) :: line(1)

    words = ''
    if (tally%largest_strain > linear) words = 'strains up to '//percent(tally%largest_strain)
    if (tally%largest_rotation > linear) then
      if (words /= '') words = words//', '
      words = words//'rotations up to '//to_text(tally%largest_rotation, 2)//' rad'
    end if
    line(1)%text = 'note: '//words//': beyond linear theory'
    if (words /= '') call print_lines(console, line)
  end subroutine tell_theory

  !> In which arithmetic, and what was out of balance before and after Newton-Raphson.
  function accuracy_in_words(precision, before, after) result(words)
    type(precision_controls_t), intent(in) :: precision
    real(wp), intent(in) :: before, after !! largest out-of-balance force, of the largest force [-]
    character(:), allocatable :: words

    words = 'factor in '//precision_in_words(precision)
    if (precision%iterative) words = 'solutions '//precision_in_words(precision)
    words = words//': forces balance to '// &
      or_rounding(before)//' as solved, to '//or_rounding(after)//' as refined'
  end function accuracy_in_words

  pure function or_rounding(imbalance) result(text)
    real(wp), intent(in) :: imbalance !! 0 where it is no more than internal forces round [-]
    character(:), allocatable :: text

    text = 'rounding'
    if (imbalance > 0.0_wp) text = to_text(imbalance, 2)
  end function or_rounding

  pure function seconds(time) result(text)
    real(wp), intent(in) :: time
    character(:), allocatable :: text

    text = to_text(max(0.0_wp, time), 3)//' s'
  end function seconds

end module close_run_mod
