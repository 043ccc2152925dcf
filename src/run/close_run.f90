!> How a run says how it went.
module close_run_mod
  use kinds_mod, only: wp
  use text_mod, only: string_t, to_text, percent
  use system_mod, only: peak_memory_bytes
  use parallel_mod, only: usage_t, usage_of_others
  use scene_mod, only: scene_t
  use controls_mod, only: precision_in_words
  use linearisation_mod, only: sum_of
  use increment_report_mod, only: told_theory
  use shadow_run_mod, only: has_no_shadow
  use tally_mod, only: tally_t
  use console_mod, only: console_t, say, print_lines, print_warning, seconds_in_words, &
    theory_in_words, theory_worth_naming
  implicit none
  private

  public :: close_run

contains

  !> The one sentence that says how it went, behind warnings and notes.
  subroutine close_run(scene, console, tally, path)
    type(scene_t), intent(in) :: scene
    type(console_t), intent(in) :: console
    type(tally_t), intent(in) :: tally
    character(*), intent(in) :: path
    real(wp) :: theory
    real(wp), parameter :: elastic = 0.01_wp !! of Young's modulus: no metal yields later [-]
    real(wp), parameter :: small = 1.0e-3_wp !! below it finite strain is rarely needed [-]
    logical :: is_followed

    if (console%verbose) call print_costs(console, tally)
    theory = theory_worth_naming(tally%theory, scene%accuracy%wanted)
    is_followed = tally%follows_theory > 0
    call tell_theory(scene, console, theory, is_followed, tally)
    if (scene%finite_strain .and. .not. scene%accuracy%chooses_theory .and. max( &
      tally%largest_strain, tally%largest_rotation) < small) call print_lines(console, &
      [string_t('strains up to '//percent(tally%largest_strain)//' and rotations up to '// &
      to_text(tally%largest_rotation, 2)//' rad are small: --nlgeom auto computes small strain '// &
      'where that is enough, in less time')], 'note: ')
    if (tally%largest_stress > elastic) call print_lines(console, [string_t( &
      'von Mises'' stress gets to '//percent(tally%largest_stress)//' of Young''s modulus: '// &
      'no metal stays elastic there')], 'note: ')
    if (tally%certified < tally%increments) then
      call print_warning(console, to_text(tally%increments - tally%certified)//' of '// &
        to_text(tally%increments)// &
        ' increments are not certified (STOP=CHANGE continues past them)')
    end if
    call say(to_text(tally%certified)//' of '//to_text(tally%increments)// &
      ' increments certified to '// &
             to_text(tally%allowed, 3)//theory_in_words(theory, is_followed)// &
             ', worst error '//to_text(tally%worst, 2)// &
             ' (increment '// &
             to_text(tally%worst_increment)//'), '//seconds_in_words(tally%total_time)//': '//path)
  end subroutine close_run

  !> Phases, the linear solver and memory.
  subroutine print_costs(console, tally)
    type(console_t), intent(in) :: console
    type(tally_t), intent(in) :: tally
    type(usage_t) :: others
    type(string_t) :: lines(4)

    others = usage_of_others()
    associate (s => sum_of(tally%work, tally%on_tangents))
      lines(1)%text = 'time            read '//seconds(tally%read_time)//', assemble '// &
        seconds(s%assemble)//', order '//seconds(s%order)//', factorise '// &
        seconds(s%factorise)//', condense '//seconds(s%condense)//', loads '// &
        seconds(s%loads)//','
      lines(2)%text = '                contact '//seconds(tally%contact_time)// &
        ', displacements '//seconds(tally%step_time - tally%contact_time - &
        tally%certify_time)//', certificate '//seconds(tally%certify_time)//', estimate '// &
        seconds(tally%estimate_time)//', write '//seconds(tally%write_time)
      lines(3)%text = 'linear solver   '//precision_in_words(tally%precision)//': residual '// &
        or_rounding(tally%unrefined)//', '//or_rounding(tally%imbalance)//' after refinement'
      lines(4)%text = 'memory          at most '//to_text(real(peak_memory_bytes() + others%peak, &
        wp)/1.0e6_wp, 3)//' MB'
    end associate
    call print_lines(console, lines)
  end subroutine print_costs

  !> How far strains and rotations went where the error of small strain is named. docs/theory.md
  !> (8.11).
  subroutine tell_theory(scene, console, error, is_followed, tally)
    type(scene_t), intent(in) :: scene
    type(console_t), intent(in) :: console
    real(wp), intent(in) :: error !! as of theory_worth_naming [-]
    logical, intent(in) :: is_followed !! it is an estimate
    type(tally_t), intent(in) :: tally
    type(string_t) :: line(1)
    character(:), allocatable :: far, cure

    if (.not. error > 0.0_wp) return
    far = 'strains up to '//percent(tally%largest_strain)//', rotations up to '// &
      to_text(tally%largest_rotation, 2)//' rad'
    cure = '--nlgeom yes includes it'
    if (told_theory(error, is_followed) < huge(1.0_wp)) then
      line(1)%text = far//': finite strain '//trim(merge('changes   ', 'may change', &
        is_followed))//' forces by '//percent(error)
    else
      line(1)%text = 'small strain: '//far//' change forces by an unknown amount'
      if (.not. (scene%accuracy%follows_theory .or. has_no_shadow(scene) /= '')) cure = &
        '--theory estimates it'
    end if
    line(1)%text = 'note: '//line(1)%text//'; '//cure
    call print_lines(console, line)
  end subroutine tell_theory

  pure function or_rounding(imbalance) result(text)
    real(wp), intent(in) :: imbalance
    !! largest out-of-balance force, of the largest force; 0 where it is no more than rounding [-]
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
