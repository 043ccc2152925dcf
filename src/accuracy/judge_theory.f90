!> Whether small strain does for what is asked of a run, or finite strain is to take its place.
!>
!> docs/theory-error.md
module judge_theory_mod
  use kinds_mod, only: wp
  use text_mod, only: percent
  use controls_mod, only: allowed_error
  use increment_report_mod, only: told_theory
  use mesh_sequence_mod, only: mesh_sequence_t, theory_counts, theory_tried, theory_of_last, &
    is_spoiled_by_theory, set_theory_aside
  use theory_of_runs_mod, only: run_theory_t, may_spoil, is_more_than_its_part, &
    leaves_too_little, is_known_at_finite_strain
  use next_run_mod, only: choice_t, is_reached, is_beginning
  implicit none
  private

  public :: judge_theory, why_kept, off_in_words
  public :: theory_stands, theory_is_followed, finite_strain_follows, theory_is_set_aside

  ! What comes of it.
  integer, parameter :: theory_stands = 1         !! nothing changes
  integer, parameter :: theory_is_followed = 2    !! runs from here on estimate its error
  integer, parameter :: finite_strain_follows = 3 !! the runs begin again
  integer, parameter :: theory_is_set_aside = 4
  !! the accuracy cannot be reached: runs go on for the small-strain solution

contains

  !> What the runs on several meshes say of the theory.
  !>
  !> A bound needs an estimate where it could spoil the accuracy. An estimate is believed from the
  !> mesh on by which increments are tried.
  subroutine judge_theory(sequence, choice, can_follow, verdict)
    type(mesh_sequence_t), intent(inout) :: sequence !! with a run at least
    type(choice_t), intent(in) :: choice !! what follows these, if it were not for the theory
    logical, intent(in) :: can_follow    !! runs at finite strain can go beside them
    integer, intent(out) :: verdict
    logical :: is_too_large

    verdict = theory_stands
    if (all(sequence%theory /= [theory_counts, theory_tried])) return
    if (choice%outcome == is_reached .and. .not. is_spoiled_by_theory(sequence)) return
    associate (theory => theory_of_last(sequence), wanted => sequence%asked)
      if (can_follow .and. .not. sequence%follows_theory) then
        if (.not. may_spoil(theory, allowed_error(wanted))) return
        sequence%follows_theory = .true.
        ! What the estimate will leave is not known.
        sequence%wanted = wanted
        verdict = theory_is_followed
        return
      end if
      if (is_beginning(sequence)) return
      is_too_large = theory%error > allowed_error(wanted)
      if (wanted > 0.0_wp) is_too_large = is_more_than_its_part(theory, wanted)
      if (.not. is_too_large) return
      if (sequence%theory == theory_counts .and. is_known_at_finite_strain(theory, &
        allowed_error(wanted))) then
        verdict = finite_strain_follows
      else if (leaves_too_little(theory, allowed_error(wanted))) then
        call set_theory_aside(sequence)
        verdict = theory_is_set_aside
      end if
    end associate
  end subroutine judge_theory

  !> Why small strain stays though it is off by more than is allowed, in words.
  function why_kept(theory, allowed, tried) result(why)
    type(run_theory_t), intent(in) :: theory
    real(wp), intent(in) :: allowed     !! [-]
    character(*), intent(in) :: tried   !! what came of finite strain; '': it was not tried
    character(:), allocatable :: why, decided

    if (tried /= '') then
      why = 'small strain '//off_in_words(theory)//', and at finite strain '//tried
    else if (.not. is_known_at_finite_strain(theory, allowed)) then
      decided = 'as much'
      if (theory%law > allowed) decided = 'more than '//percent(allowed)
      why = 'which law holds at finite strain decides '//decided//', and *ELASTIC does not say '// &
        'which: small strain is off by '//or_unknown(theory%of_law(1))//' with St Venant and '// &
        'Kirchhoff''s, by '//or_unknown(theory%of_law(2))//' with neo-Hooke''s. *HYPERELASTIC, '// &
        'NEO HOOKE or *ELASTIC, LAW=SVK says it'
    else
      why = 'small strain '//off_in_words(theory)
    end if
  end function why_kept

  !> is off by 2.2 %; may be off by up to 5.7 %.
  function off_in_words(theory) result(words)
    type(run_theory_t), intent(in) :: theory
    character(:), allocatable :: words

    associate (told => told_theory(theory%error, theory%is_estimate))
      words = trim(merge('is off by          ', 'may be off by up to', theory%is_estimate .or. &
        .not. told < huge(told)))//' '//or_unknown(told)
    end associate
  end function off_in_words

  pure function or_unknown(error) result(words)
    real(wp), intent(in) :: error !! [-]
    character(:), allocatable :: words

    words = 'an unknown amount'
    if (error < huge(1.0_wp)) words = percent(error)
  end function or_unknown

end module judge_theory_mod
