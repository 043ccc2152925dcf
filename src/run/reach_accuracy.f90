!> The runs that it takes to reach an accuracy, or to use the time and memory that are allowed:
!> coarse ones first, from which it is known what a finer one brings. Each takes the place of the
!> one before in the result file; the last one is the result.
!>
!> docs/theory.md section 10.
module reach_accuracy_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t, raise, exit_not_solved, exit_machine
  use text_mod, only: to_text, percent
  use resource_limits_mod, only: memory_left, release_freed_memory
  use system_mod, only: cpu_seconds
  use mesh_size_mod, only: blocks_t, relative_size, is_same_size
  use controls_mod, only: accuracy_controls_t, accuracy_of_resultants, &
    subject_in_words, allowed_error
  use scene_mod, only: scene_t
  use choices_mod, only: choices_t
  use slice_axis_mod, only: axis_across
  use mesh_sequence_mod, only: mesh_sequence_t, mesh_run_t, has_bound, &
    theory_beside, theory_tried, theory_spoils, is_counted, theory_of_last
  use increment_report_mod, only: told_theory
  use theory_of_runs_mod, only: run_theory_t
  use shadow_run_mod, only: has_no_shadow
  use judge_theory_mod, only: judge_theory, why_kept, theory_is_followed, &
    finite_strain_follows, theory_is_set_aside
  use sequence_error_mod, only: sequence_error_t, estimate_sequence
  use finer_meshes_mod, only: begin_sequence, skip_mesh
  use next_run_mod, only: choice_t, is_beginning, to_run, is_reached, steps_too_coarse, &
    not_convergent, beyond_machine, is_finest, time_is_over, facets_too_coarse
  use run_within_mod, only: choose_next
  use end_with_run_mod, only: end_with_run
  use amounts_mod, only: bytes_in_words, time_in_words, bounds_in_words
  use estimate_memory_mod, only: room_within
  use result_claims_mod, only: take_mesh_size, theory_in_file
  use command_line_mod, only: options_t, refuse_option
  use tally_mod, only: tally_t
  use name_knob_mod, only: geometry_in_words
  use close_run_mod, only: close_run
  use console_mod, only: console_t, say, seconds_in_words, theory_in_words, &
    theory_worth_naming, theory_part
  use prepare_scene_mod, only: prepare_scene, result_path
  use run_mesh_mod, only: run_mesh, goes_on
  use print_summary_mod, only: print_summary
  implicit none
  private

  public :: reach_accuracy, search_t

  integer, parameter :: most_skipped = 5 !! coarse meshes that are not solved
  integer, parameter :: most_tried = 1000 !! plans and runs

  !> How the runs of an accuracy ended.
  type :: search_t
    logical :: is_complete = .false.
    !! all of them were made: there is a result, whether or not it is as accurate
    logical :: leaves_small_strain = .false.
    !! they ended early, for finite strain is to take the place of small strain
    type(run_theory_t) :: theory !! what small strain leaves out, if so
  end type search_t

contains

  !> Run the deck on finer and finer meshes until its error is what is wanted.
  subroutine reach_accuracy(options, deck, console, tried, search, error)
    type(options_t), intent(in) :: options
    type(scene_t), intent(in) :: deck           !! as written
    type(console_t), intent(in) :: console
    character(*), intent(in) :: tried !! what came of finite strain; '': it was not tried
    type(search_t), intent(out) :: search
    type(error_t), allocatable, intent(out) :: error
    !! wrong options; a run that failed; the accuracy not reached
    type(options_t) :: of_run
    type(scene_t) :: scene
    type(choices_t) :: choices
    type(mesh_sequence_t) :: sequence
    type(sequence_error_t) :: errors
    type(choice_t) :: choice
    type(console_t) :: of_console
    type(tally_t) :: tally
    type(run_theory_t) :: spoiling !! what small strain leaves out, where that is too much
    integer :: n_tried, n_skipped, n_alike, across, verdict
    logical :: continues, is_again, can_follow

    call check_options(options, error)
    if (allocated(error)) return
    across = axis_across(deck)
    can_follow = has_no_shadow(deck) == ''
    call begin()
    of_run = options
    n_skipped = 0
    n_alike = 0
    continues = goes_on(options, deck)
    runs: do n_tried = 1, most_tried
      call release_freed_memory()
      if (.not. choice%is_replaced) then
        call choose_next(sequence, memory_for(deck%accuracy, sequence), errors, choice)
        call follow_theory(verdict)
        if (verdict == finite_strain_follows) return
      end if
      if (choice%outcome /= to_run) then
        call end_with_run(sequence, choice)
        if (choice%outcome /= to_run) exit runs
      end if
      sequence%spent = sequence%earlier + cpu_seconds()
      if (continues) then
        call take_up(result_path(options, deck), choice, of_run)
        if (of_run%continues .and. sequence%theory /= theory_beside) then
          if (theory_in_file(result_path(options, deck)) == 'estimate') then
            sequence%follows_theory = .true.
          end if
        end if
      end if
      choices = choices_t(mesh_size=choice%mesh_size, divisions=choice%divisions, &
        runs_before=size(sequence%runs))
      call prepare_scene(of_run, scene, choices, error, sequence%follows_theory)
      if (allocated(error)) then
        if (sequence%blocks%common == 0) return
        ! Its blocks cannot have other elements after all: numbers of nodes meet, say.
        deallocate (error)
        call begin(spread(blocks_t(), 1, 3))
        choice%is_replaced = .false.
        cycle runs
      end if
      choices%precision%keeps_double = any(sequence%runs%in_double > 0)
      of_console = console_of(console, options, choice)
      is_again = sequence%repeated > 0.0_wp
      call run_mesh(of_run, scene, choices, of_console, error, sequence, choice, tally)
      if (choice%is_replaced .and. .not. allocated(error)) cycle runs
      if (options%plan) return
      continues = .false.
      of_run%continues = .false.
      of_run%overwrite = .true. ! what stands there is a run of ours
      if (allocated(error)) then
        if (error%exit_status == exit_not_solved .and. .not. (sequence%writes .or. &
          choice%may_be_last) .and. .not. may_skip()) then
          ! The increments before it are to be kept.
          deallocate (error)
          choice%may_be_last = .true.
          choice%is_replaced = .true.
          cycle runs
        end if
        if (size(sequence%runs) > 0 .and. .not. may_skip()) call tell_earlier(deck, sequence, &
          scene%mesh%n_elements, error)
        if (.not. may_skip()) return
        if (.not. console%quiet) call say('note: '//to_text(scene%mesh%n_elements)// &
          ' elements are too few: '//error%message)
        n_alike = merge(n_alike + 1, 0, error%n_meshes > 0)
        deallocate (error)
        n_skipped = n_skipped + 1
        call skip_mesh(sequence, choice%mesh_size)
        cycle runs
      end if
      call print_run(console, deck, sequence, is_again)
    end do runs
    if (n_tried > most_tried) then
      call raise(error, exit_not_solved, to_text(most_tried)//' plans and runs did not find '// &
        'the mesh of this accuracy; --refine 0 computes that of the deck')
      return
    end if
    call print_summary(result_path(options, deck), deck, console, sequence)
    call close_run(scene, console, tally, result_path(options, deck))
    search%is_complete = .true.
    call tell_outcome(deck, sequence, errors, choice, spoiling, tried, error)

  contains

    !> A sequence without runs.
    subroutine begin(blocks)
      type(blocks_t), intent(in), optional :: blocks(3) !! in place of the deck's

      if (present(blocks)) then
        call begin_sequence(deck, blocks, across, sequence)
      else
        call begin_sequence(deck, deck%blocks, across, sequence)
      end if
      if (tried /= '' .and. sequence%theory /= theory_beside) sequence%theory = theory_tried
    end subroutine begin

    !> Look at what the theory leaves of the accuracy, and choose again where that changes.
    subroutine follow_theory(verdict)
      integer, intent(out) :: verdict
      type(run_theory_t) :: theory

      verdict = 0
      if (size(sequence%runs) == 0) return
      theory = theory_of_last(sequence)
      if (sequence%theory == theory_spoils .and. .not. spoiling%error > 0.0_wp) spoiling = theory
      call judge_theory(sequence, choice, can_follow, verdict)
      search%leaves_small_strain = verdict == finite_strain_follows
      search%theory = theory
      if (verdict == theory_is_set_aside) then
        spoiling = theory
        if (.not. console%quiet) call say('note: '//why_kept(theory, allowed_error( &
          sequence%asked), tried)//'. The runs go on for the small-strain solution')
      end if
      if (any(verdict == [theory_is_followed, theory_is_set_aside])) call choose_next(sequence, &
        memory_for(deck%accuracy, sequence), errors, choice)
      ! The last run may be good for all but what is not known of its theory.
      if (verdict == theory_is_followed .and. choice%outcome == is_reached) call repeat_last()
    end subroutine follow_theory

    !> Make the last run again, with an estimate of the theory's error.
    subroutine repeat_last()
      integer :: n

      n = size(sequence%runs)
      choice = choice_t(mesh_size=sequence%runs(n)%mesh_size, &
        divisions=sequence%runs(n)%divisions, may_be_last=.true.)
      sequence%repeated = sequence%runs(n)%seconds
      sequence%runs = sequence%runs(:n - 1)
    end subroutine repeat_last

    !> Whether a mesh that is not solved is only too coarse, as far as is known; one that is refused
    !> for its elements is where it is coarser than that of the deck.
    logical function may_skip()
      may_skip = n_skipped < most_skipped .and. is_beginning(sequence) .and. &
        (error%n_meshes == 0 .or. n_alike + 1 < error%n_meshes) .and. (error%exit_status == &
        exit_not_solved .or. (error%is_of_mesh .and. relative_size(choice%mesh_size) > 1.0_wp))
    end function may_skip

  end subroutine reach_accuracy

  !> Memory that a run may take beside what the process has.
  real(wp) function memory_for(accuracy, sequence) result(bytes)
    type(accuracy_controls_t), intent(in) :: accuracy
    type(mesh_sequence_t), intent(in) :: sequence

    bytes = real(memory_left(), wp)
    if (accuracy%memory > 0.0_wp) bytes = min(bytes, real(room_within(accuracy%memory, 0), wp))
    ! What comes next was decided with this one when the last run ended, and kept in its file.
    if (has_bound(sequence) .and. sequence%room > 0.0_wp) bytes = sequence%room
  end function memory_for

  !> Go on with the run that a file is of, which knows those before it. Where it is done, and the
  !> one that was to follow has not begun, nothing is known of them: they begin anew.
  subroutine take_up(path, choice, of_run)
    character(*), intent(in) :: path
    type(choice_t), intent(inout) :: choice
    type(options_t), intent(inout) :: of_run
    type(choice_t) :: found
    logical :: is_done

    found = choice
    call take_mesh_size(path, found%mesh_size, found%divisions, is_done)
    if (is_done) then
      of_run%continues = .false.
    else
      choice = found
    end if
  end subroutine take_up

  !> Refuse options that mean one mesh.
  subroutine check_options(options, error)
    type(options_t), intent(in) :: options
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: what

    what = 'an accuracy tries several'
    if (options%memory > 0.0_wp) what = '--memory tries several'
    if (options%time > 0.0_wp) what = '--time tries several'
    if (options%exported /= '') then
      call refuse_option('--export-fclib writes the contact problems of one mesh, and '//what// &
        ': --refine 0 keeps the deck''s mesh', error)
    end if
  end subroutine check_options

  !> Runs that are not expected to be the last one have no more than a line of the table.
  type(console_t) function console_of(console, options, choice) result(of_run)
    type(console_t), intent(in) :: console
    type(options_t), intent(in) :: options
    type(choice_t), intent(in) :: choice

    of_run = console
    of_run%is_one_of = .true.
    if (.not. options%plan) of_run%quiet = console%quiet .or. .not. choice%may_be_last
  end function console_of

  !> The last run's line of the table of all runs, below its head where it is the first or where the
  !> run has printed lines of its own.
  subroutine print_run(console, deck, sequence, is_again)
    type(console_t), intent(in) :: console
    type(scene_t), intent(in) :: deck
    type(mesh_sequence_t), intent(in) :: sequence
    logical, intent(in) :: is_again !! its result had not been kept, and now is
    type(sequence_error_t) :: errors
    character(90) :: line

    if (console%quiet) return
    if (console%verbose .or. size(sequence%runs) == 1) then
      call say('estimated error of '//subject_in_words(deck%accuracy)//', run by run '// &
        '(edges: over those of the deck)')
      call say(' run  elements      edges  increments    CPU time      mesh  load steps'// &
        trim(merge('  small strain', '              ', sequence%theory /= theory_beside)))
    end if
    call estimate_sequence(sequence, errors)
    associate (run => sequence%runs(size(sequence%runs)))
      write (line, '(i4, i10, a11, i12, a12, a10, a12)') size(sequence%runs), run%n_elements, &
        edges_in_words(run), sequence%n_increments*run%divisions, seconds_in_words(run%seconds), &
        known(errors%mesh), known(errors%load_steps)
      if (sequence%theory /= theory_beside) write (line(72:85), '(a14)') theory_in_short( &
        run%theory)
    end associate
    call say(trim(line)//trim(merge('  again, to keep it', repeat(' ', 19), is_again)))
  end subroutine print_run

  !> 2.2 %; <5.7 % of a bound.
  function theory_in_short(theory) result(words)
    type(run_theory_t), intent(in) :: theory
    character(:), allocatable :: words

    words = 'not known'
    if (.not. told_theory(theory%error, theory%is_estimate) < huge(1.0_wp)) return
    words = percent(theory%error)
    if (.not. theory%is_estimate) words = '<'//words
  end function theory_in_short

  !> An error, or that it is not known.
  function known(error) result(words)
    real(wp), intent(in) :: error !! negative: not known [-]
    character(:), allocatable :: words

    words = '-'
    if (error >= 0.0_wp) words = percent(error)
  end function known

  !> 0.5, or at contact a quarter of that: 0.5/4.
  function edges_in_words(run) result(words)
    type(mesh_run_t), intent(in) :: run
    character(:), allocatable :: words

    words = to_text(relative_size(run%mesh_size), 3)
    if (run%mesh_size%zone%times > 0) words = words//'/'//to_text(2**run%mesh_size%zone%times)
  end function edges_in_words

  !> 64 elements of 0.5 times the deck's edges, increments in 2
  function settings_in_words(run) result(words)
    type(mesh_run_t), intent(in) :: run
    character(:), allocatable :: words

    words = to_text(run%n_elements)//' elements of '//edges_in_words(run)// &
      ' times the deck''s edges'
    if (run%divisions > 1) words = words//', increments in '//to_text(run%divisions)
  end function settings_in_words

  !> Mesh 3.1 % (BODY:TOOL/friction_force), load steps 0.2 %, small strain 1 %.
  function errors_in_words(sequence, errors) result(words)
    type(mesh_sequence_t), intent(in) :: sequence
    type(sequence_error_t), intent(in) :: errors
    character(:), allocatable :: words

    words = ''
    if (errors%mesh >= 0.0_wp) words = 'mesh '//percent(errors%mesh)
    if (errors%worst > 0) words = words//' ('//sequence%list(errors%worst)%name//')'
    if (errors%geometry + errors%facets > 0.0_wp) then
      if (words /= '') words = words//', '
      words = words//'geometry '//percent(errors%geometry + errors%facets)
    end if
    if (errors%load_steps >= 0.0_wp) then
      if (words /= '') words = words//', '
      words = words//'load steps '//percent(errors%load_steps)
      if (errors%mesh >= 0.0_wp .and. percent(errors%together) /= percent(errors%mesh + &
        errors%load_steps)) words = words//', together '//percent(errors%together)
    end if
    if (.not. is_counted(sequence) .or. size(sequence%runs) == 0) return
    associate (theory => theory_of_last(sequence))
      if (words /= '') words = words//', '
      words = words//'small strain '
      words = words//theory_part(theory%error, theory%is_estimate)
    end associate
  end function errors_in_words

  !> Say how far it was before a run that failed, where it was not stopped.
  subroutine tell_earlier(deck, sequence, n_elements, error)
    type(scene_t), intent(in) :: deck
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: n_elements !! of the run that failed
    type(error_t), intent(inout) :: error
    type(sequence_error_t) :: errors
    character(:), allocatable :: so_far

    if (error%exit_status /= exit_not_solved .and. error%exit_status /= exit_machine) return
    call estimate_sequence(sequence, errors)
    so_far = errors_in_words(sequence, errors)
    if (so_far /= '') so_far = ' ('//so_far//')'
    if (sequence%asked > 0.0_wp) then
      error%message = 'accuracy '//percent(sequence%asked)//' of '// &
        subject_in_words(deck%accuracy)//' was not reached'//so_far//'; then, on '// &
        to_text(n_elements)//' elements: '//error%message
    else
      error%message = 'after '//to_text(size(sequence%runs))//' runs'//so_far//', on '// &
        to_text(n_elements)//' elements: '//error%message
    end if
  end subroutine tell_earlier

  !> How many meshes there are runs on.
  pure integer function n_meshes(sequence)
    type(mesh_sequence_t), intent(in) :: sequence
    integer :: i, first

    n_meshes = 0
    do i = 1, size(sequence%runs)
      associate (cuts => sequence%runs(i)%mesh_size%zone%times)
        do first = 1, i
          if (sequence%runs(first)%mesh_size%zone%times == cuts .and. is_same_size(sequence%runs( &
            first)%mesh_size, sequence%runs(i)%mesh_size)) exit
        end do
      end associate
      if (first == i) n_meshes = n_meshes + 1
    end do
  end function n_meshes

  !> Say how it ended, and what it took.
  subroutine tell_outcome(deck, sequence, errors, choice, spoiling, tried, error)
    type(scene_t), intent(in) :: deck
    type(mesh_sequence_t), intent(in) :: sequence
    type(sequence_error_t), intent(in) :: errors
    type(choice_t), intent(in) :: choice
    type(run_theory_t), intent(in) :: spoiling !! what small strain leaves out, if that is too much
    character(*), intent(in) :: tried          !! as of reach_accuracy
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: words, runs, reason, theory, why
    type(sequence_error_t) :: of_result
    type(run_theory_t) :: of_theory

    words = percent(sequence%asked)//' of '//subject_in_words(deck%accuracy)
    runs = '; '//to_text(size(sequence%runs))//trim(merge(' run ', ' runs', &
      size(sequence%runs) == 1))//', '//seconds_in_words(merge(sequence%spent, &
      sum(sequence%runs%seconds), choice%outcome == is_finest))//' of CPU time'
    of_theory = sequence%runs(size(sequence%runs))%theory
    if (spoiling%error > 0.0_wp) of_theory = spoiling
    theory = theory_in_words(theory_worth_naming(of_theory%error, sequence%asked), &
      of_theory%is_estimate)
    if (is_counted(sequence)) theory = ''
    why = ''
    if (sequence%theory == theory_spoils .and. sequence%asked > 0.0_wp) why = why_kept(spoiling, &
      sequence%asked, tried)
    if (choice%outcome == is_reached .and. why == '') then
      call say('estimated error of '//subject_in_words(deck%accuracy)//': '//errors_in_words( &
        sequence, errors)//'; '//percent(sequence%asked)//' is reached'//theory//runs)
      return
    end if
    if (choice%outcome == is_finest) then
      words = errors_in_words(sequence, errors)
      if (words == '') words = 'not known, it takes two meshes'
      words = words//theory//unused_in_words(sequence, choice)
      call say('estimated error of '//subject_in_words(deck%accuracy)//' within '// &
        bounds_in_words(deck%accuracy)//': '//words//runs)
      return
    end if
    select case (choice%outcome)
    case (is_reached)
      reason = 'beside that '//errors_in_words(sequence, errors)
    case (steps_too_coarse)
      reason = 'the load steps make '//percent(errors%load_steps)
      if (errors%load_steps < 0.0_wp) then
        reason = 'what the load steps make is not known'
        if (sequence%divides) reason = 'the load steps make more, in '// &
          to_text(maxval(sequence%runs%divisions))//' parts of each increment too'
      end if
      if (any(deck%steps%direct)) reason = reason//', and DIRECT keeps them as they are'
      if (errors%mesh > max(sequence%wanted, errors%load_steps)) reason = reason// &
        ', and the mesh '//percent(errors%mesh)
    case (facets_too_coarse)
      reason = 'flat faces that stand for arcs make '//percent(errors%facets)//', and so they '// &
        'do on finer meshes of the same faces; ADJUST=0 of *CONTACT PAIR closes what they '// &
        'gape or overlap by, and more faces along the arcs, or elements of second order, lessen it'
    case (not_convergent)
      reason = sequence%list(errors%worst)%name//' does not converge: '// &
        to_text(n_meshes(sequence))//' meshes change it again and again'
      if (deck%accuracy%of /= accuracy_of_resultants) reason = reason//'; a quantity at a '// &
        'sharp edge or beneath a force on a node has no limit'
    case (time_is_over)
      reason = 'within '//bounds_in_words(deck%accuracy)//' too few runs say how wrong it is'
      if (errors%mesh >= 0.0_wp) reason = 'within '//bounds_in_words(deck%accuracy)//' it is '// &
        errors_in_words(sequence, errors)
      reason = reason//'; the next run'
      if (choice%finer > 1.0_wp) reason = reason//', of elements '//to_text(choice%finer, 2)// &
        ' times as small,'
      reason = reason//' takes it to some '//time_in_words(choice%seconds)//' of CPU '// &
        'time and '//bytes_in_words(choice%memory)//' of memory'
    case default
      call estimate_sequence(sequence, of_result)
      reason = errors_in_words(sequence, of_result)
      if (choice%memory > 0.0_wp) reason = reason//'; it takes elements '// &
        to_text(choice%finer, 2)//' times as small, some '//bytes_in_words(choice%memory)// &
        ' of memory'
    end select
    reason = reason//cause_in_words(sequence)
    if (why /= '') reason = why//'; NLGEOM=NO (--nlgeom no) asks for the small-strain solution '// &
      'alone; '//reason
    call raise(error, merge(exit_machine, exit_not_solved, choice%outcome == beyond_machine), &
      'accuracy '//words//' was not reached: '//reason//runs// &
      '; the result is that of '//settings_in_words(sequence%runs(size(sequence%runs)))// &
      ', and otherwise complete')
  end subroutine tell_outcome

  !> What the next mesh would take, where less than half of the time is used; else ''.
  function unused_in_words(sequence, choice) result(words)
    type(mesh_sequence_t), intent(in) :: sequence
    type(choice_t), intent(in) :: choice
    character(:), allocatable :: words
    real(wp), parameter :: much = 0.5_wp !! of the time, that a run is to use

    words = ''
    if (choice%finer <= 1.0_wp .or. sequence%spent >= much*sequence%time) return
    words = '; the rest of the time is too little for the next mesh: elements '//to_text( &
      choice%finer, 2)//' times as small take it to some '//time_in_words(choice%seconds)// &
      ' of CPU time and '//bytes_in_words(choice%memory)//' of memory'
    if (sequence%blocks%common == 0) words = words//'; a coarser mesh in the deck leaves time '// &
      'for several'
  end function unused_in_words

  !> Why finer meshes gain little, and what to do, where the last run shows it; else ''.
  function cause_in_words(sequence) result(words)
    type(mesh_sequence_t), intent(in) :: sequence
    character(:), allocatable :: words

    ! Of facets the outcome itself speaks.
    words = geometry_in_words(min(1.0_wp, sequence%runs(size(sequence%runs))%geometry)* &
      [1.0_wp, 1.0_wp, 0.0_wp], 0.5_wp*sequence%asked)
    if (words /= '') words = '; '//words
  end function cause_in_words

end module reach_accuracy_mod
