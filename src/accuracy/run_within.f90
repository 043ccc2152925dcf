!> Which run comes next where processor time or memory have a bound: the mesh and the increments
!> that are foreseen to be most accurate within it.
!>
!> docs/theory.md section 10.
module run_within_mod
  use kinds_mod, only: wp
  use mesh_size_mod, only: mesh_size_t, relative_size, is_same_size
  use convergence_mod, only: least_order, safety, safety_of_two, size_for_error
  use foreseen_costs_mod, only: fits, seconds_to_run, memory_to_run
  use mesh_sequence_mod, only: mesh_sequence_t, has_bound, mesh_runs, family_t, family_of
  use step_errors_mod, only: error_by_steps
  use step_limits_mod, only: on_coarse_mesh
  use sequence_error_mod, only: sequence_error_t, estimate_sequence
  use finest_mesh_mod, only: find_run, find_finest, go_back
  use choose_divisions_mod, only: most_divisions
  use finer_meshes_mod, only: finer, odd_finer, least_step
  use next_run_mod, only: choice_t, choose_run, to_run, is_finest, time_is_over, beyond_machine
  implicit none
  private

  public :: choose_next, judge_plan

  ! Of the time that is left, what a run may take as it is foreseen: the last one, and one that
  ! tries the increments out.
  real(wp), parameter :: part_for_run = 0.8_wp
  real(wp), parameter :: part_for_trial = 0.06_wp

  real(wp), parameter :: largest_jump = 2.2_wp
  !! from size to size: the mesh before the last then takes a few parts in a hundred of its time
  real(wp), parameter :: nearly_last = 1.5_wp !! finer than the only one by no more: at once
  real(wp), parameter :: worth_another_plan = 1.08_wp
  !! elements so many times smaller: an error smaller by a twelfth, for the time of a plan
  real(wp), parameter :: worth_the_rest = 0.5_wp
  !! of the time, that is to be used: up to it another mesh need be finer by no more than that
  real(wp), parameter :: worth_dividing = 0.8_wp !! error left, of that without
  integer, parameter :: most_plans = 3 !! of one run, before it is begun
  integer, parameter :: first_trials = 4 !! divisions that are tried on the first mesh

contains

  !> The next run, or why there is none: with a bound the one that is foreseen to be within it.
  subroutine choose_next(sequence, room, errors, choice)
    type(mesh_sequence_t), intent(in) :: sequence
    real(wp), intent(in) :: room !! memory that a run may take beside what the process has [bytes]
    type(sequence_error_t), intent(out) :: errors
    type(choice_t), intent(out) :: choice

    if (sequence%wanted <= 0.0_wp) then
      call choose_finest(sequence, room, errors, choice)
      return
    end if
    call choose_run(sequence, room, errors, choice)
    if (has_bound(sequence) .and. size(sequence%runs) > 0 .and. (choice%outcome == to_run .or. &
      choice%outcome == beyond_machine)) call keep_within(sequence, room, errors, choice)
  end subroutine choose_next

  !> What comes of a choice whose plan is made: whether it is run, or else what is to be planned
  !> instead.
  !>
  !> Without a bound a mesh that does not fit ends the search. Where nothing is to be run at all,
  !> the finest mesh within the bounds is looked for by plans alone.
  subroutine judge_plan(sequence, room, only_plans, choice)
    type(mesh_sequence_t), intent(in) :: sequence !! knows the plan
    real(wp), intent(in) :: room !! as of choose_next; huge: whatever it takes [bytes]
    logical, intent(in) :: only_plans
    type(choice_t), intent(inout) :: choice !! gets what is foreseen, or is another
    type(sequence_error_t) :: errors
    type(choice_t) :: other
    logical :: is_within

    choice%is_replaced = .false.
    choice%n_plans = choice%n_plans + 1
    if (.not. has_bound(sequence)) then
      if (size(sequence%runs) == 0 .or. sequence%repeated > 0.0_wp) return
      choice%memory = memory_to_run(sequence, relative_size(choice%mesh_size))
      if (choice%memory <= room) return
      choice%outcome = beyond_machine
      choice%finer = relative_size(sequence%runs(size(sequence%runs))%mesh_size)/ &
        relative_size(choice%mesh_size)
      choice%is_replaced = .true.
      return
    end if
    if (sequence%repeated > 0.0_wp) then
      ! To be kept it is made again, and was within the bounds before.
      choice%seconds = sequence%spent + sequence%repeated
      return
    end if
    if (size(sequence%runs) == 0) then
      if (only_plans .and. sequence%wanted <= 0.0_wp) call foresee_finest(sequence, room, choice)
      return
    end if
    is_within = fits(sequence, choice%mesh_size, choice%divisions, room, part_for_run, &
      is_planned=.true.)
    if (.not. is_within) then
      call choose_next(sequence, room, errors, other)
      other%n_plans = choice%n_plans
      other%is_replaced = .true.
      choice = other
      return
    end if
    if (choice%may_be_last .and. sequence%wanted <= 0.0_wp .and. choice%n_plans < most_plans) then
      call try_finer(sequence, room, choice)
    end if
    if (choice%is_replaced) return
    choice%seconds = sequence%spent + seconds_to_run(sequence, relative_size(choice%mesh_size), &
      choice%divisions, is_planned=.true.)
    call estimate_sequence(sequence, errors)
    choice%error = expected_error(sequence, errors, relative_size(choice%mesh_size), &
      choice%divisions)
  end subroutine judge_plan

  !> Without a run: another mesh in place of a planned one that is not the finest within the bounds.
  subroutine foresee_finest(sequence, room, choice)
    type(mesh_sequence_t), intent(in) :: sequence
    real(wp), intent(in) :: room
    type(choice_t), intent(inout) :: choice
    type(mesh_size_t) :: finest
    integer, parameter :: most = 8 !! plans
    logical :: found

    if (choice%n_plans >= most) return
    call find_finest(sequence, sequence%first, 1, room, part_for_run, finest, found)
    choice%is_replaced = .not. is_same_size(finest, choice%mesh_size)
    choice%mesh_size = finest
  end subroutine foresee_finest

  !> Take another mesh in place of a planned one that would leave much of the bounds unused.
  subroutine try_finer(sequence, room, choice)
    type(mesh_sequence_t), intent(in) :: sequence
    real(wp), intent(in) :: room
    type(choice_t), intent(inout) :: choice
    type(mesh_size_t) :: from, finest
    integer :: n
    logical :: found

    call find_run(sequence, choice%divisions, from, n)
    call find_finest(sequence, choice%mesh_size, choice%divisions, room, part_for_run, finest, &
      found)
    if (.not. found .or. n < 2) return
    do while (relative_size(from) > largest_jump*relative_size(finest) .and. .not. &
      is_same_size(finest, choice%mesh_size))
      call go_back(sequence, choice%mesh_size, finest)
    end do
    if (relative_size(choice%mesh_size) < worth_another_plan*relative_size(finest)) return
    choice%mesh_size = finest
    choice%is_replaced = .true.
  end subroutine try_finer

  !> Without an accuracy: the larger error first, of mesh or increments, as far as the bounds reach.
  subroutine choose_finest(sequence, room, errors, choice)
    type(mesh_sequence_t), intent(in) :: sequence
    real(wp), intent(in) :: room
    type(sequence_error_t), intent(out) :: errors
    type(choice_t), intent(out) :: choice
    integer :: most

    choice%mesh_size = sequence%first
    if (size(sequence%runs) == 0) return
    call estimate_sequence(sequence, errors)
    most = maxval(sequence%runs%divisions)
    if (sequence%divides .and. most < first_trials .and. .not. is_beyond_first(sequence)) then
      choice%divisions = 2*most
      if (is_brief(sequence) .and. fits(sequence, sequence%first, choice%divisions, room, &
        part_for_trial)) return
    end if
    choice%divisions = divisions_in_use(sequence)
    if (errors%mesh > 0.0_wp .and. errors%load_steps > 0.0_wp .and. sequence%divides) call &
      divide_further(sequence, room, errors, choice%divisions)
    if (choice%divisions > most) return
    if (is_exact(sequence, errors, choice%divisions)) then
      choice%outcome = is_finest
      return
    end if
    call choose_size(sequence, room, choice)
  end subroutine choose_finest

  !> Whether the last run took no more time than one that tries increments out may take.
  pure logical function is_brief(sequence)
    type(mesh_sequence_t), intent(in) :: sequence

    is_brief = sequence%time <= 0.0_wp .or. sequence%runs(size(sequence%runs))%seconds <= &
      part_for_trial*(sequence%time - sequence%spent)
  end function is_brief

  !> Whether there is a run on a finer mesh than the first.
  pure logical function is_beyond_first(sequence)
    type(mesh_sequence_t), intent(in) :: sequence
    integer :: i

    is_beyond_first = any([(relative_size(sequence%runs(i)%mesh_size), i=1, &
      size(sequence%runs))] < relative_size(sequence%runs(1)%mesh_size))
  end function is_beyond_first

  !> The divisions that finer meshes have: of those tried on the first mesh alone none is in use
  !> yet, but one that goes beyond the trials.
  pure integer function divisions_in_use(sequence) result(divisions)
    type(mesh_sequence_t), intent(in) :: sequence
    integer :: i

    divisions = 1
    do i = 1, size(sequence%runs)
      associate (run => sequence%runs(i))
        if (run%divisions > first_trials .or. relative_size(run%mesh_size) < &
          relative_size(sequence%runs(1)%mesh_size)) divisions = max(divisions, run%divisions)
      end associate
    end do
  end function divisions_in_use

  !> Whether three meshes make no more than contact and arithmetic: finer ones gain nothing.
  pure logical function is_exact(sequence, errors, divisions)
    type(mesh_sequence_t), intent(in) :: sequence
    type(sequence_error_t), intent(in) :: errors
    integer, intent(in) :: divisions

    is_exact = .false.
    if (size(sequence%list) == 0 .or. errors%mesh < 0.0_wp) return
    if (.not. allocated(errors%n_rising)) return
    is_exact = count(sequence%runs%divisions == divisions) > 2 .and. errors%mesh <= errors%others
  end function is_exact

  !> More divisions, where on the finest mesh that they leave time for less error is foreseen.
  subroutine divide_further(sequence, room, errors, divisions)
    type(mesh_sequence_t), intent(in) :: sequence
    real(wp), intent(in) :: room
    type(sequence_error_t), intent(in) :: errors !! of the last run
    integer, intent(inout) :: divisions          !! in use
    integer :: more, best
    real(wp) :: error, least

    best = divisions
    least = worth_dividing*error_with(divisions)
    more = 2*divisions
    do while (more <= min(most_divisions(sequence), 2*max(first_trials, maxval( &
      sequence%runs%divisions))))
      error = error_with(more)
      if (error < least) then
        least = error
        best = more
      end if
      more = 2*more
    end do
    divisions = best

  contains

    !> What is expected with so many on the finest mesh within the bounds.
    real(wp) function error_with(n) result(error)
      integer, intent(in) :: n
      type(mesh_size_t) :: finest
      logical :: found

      call find_finest(sequence, sequence%first, n, room, part_for_run, finest, found)
      error = huge(1.0_wp)
      if (n == divisions) then
        ! The mesh of the last run is there already.
        associate (last => sequence%runs(size(sequence%runs)))
          if (.not. found .or. relative_size(finest) > relative_size(last%mesh_size)) then
            finest = last%mesh_size
          end if
        end associate
        found = .true.
      end if
      ! What is likely counts here, not what finer meshes may make of it.
      if (found) error = expected_error(sequence, errors, relative_size(finest), n, &
        1.0_wp/on_coarse_mesh)
    end function error_with

  end subroutine divide_further

  !> The error that a run is expected to have; negative where nothing is known.
  real(wp) function expected_error(sequence, errors, h, divisions, of_steps) result(error)
    type(mesh_sequence_t), intent(in) :: sequence
    type(sequence_error_t), intent(in) :: errors !! of the last run
    real(wp), intent(in) :: h                    !! size of its elements [-]
    integer, intent(in) :: divisions
    real(wp), intent(in), optional :: of_steps   !! what of their error counts (all) [-]
    real(wp) :: order, steps
    integer :: tried

    error = -1.0_wp
    if (errors%mesh < 0.0_wp .or. errors%worst == 0) return
    order = errors%of_mesh(errors%worst)%order
    associate (last => sequence%runs(size(sequence%runs)))
      error = errors%mesh*(h/relative_size(last%mesh_size))**order
      ! Of two meshes more is held to be possible than is likely.
      if (size(mesh_runs(sequence, family_of(last))) == 2) error = error*safety/safety_of_two
      steps = errors%load_steps
      if (sequence%divides) then
        tried = min(divisions, maxval(sequence%runs%divisions))
        steps = error_by_steps(sequence, family_t(divisions=tried))
        if (steps < 0.0_wp) then
          tried = last%divisions
          steps = errors%load_steps
        end if
        steps = steps*(real(tried, wp)/real(divisions, wp))**least_order
      end if
    end associate
    steps = max(0.0_wp, steps)
    if (present(of_steps)) steps = of_steps*steps
    error = error + steps + errors%others
  end function expected_error

  !> The next mesh with the divisions that are chosen: the finest within the bounds where the one
  !> before is near enough to it, else one between.
  subroutine choose_size(sequence, room, choice)
    type(mesh_sequence_t), intent(in) :: sequence
    real(wp), intent(in) :: room
    type(choice_t), intent(inout) :: choice
    type(mesh_size_t) :: from, finest
    real(wp) :: ratio, least
    integer :: n
    logical :: found, few

    call find_run(sequence, choice%divisions, from, n)
    call find_finest(sequence, from, choice%divisions, room, part_for_run, finest, found)
    ratio = relative_size(from)/relative_size(finest)
    least = least_step
    if (sequence%spent < worth_the_rest*sequence%time) least = worth_another_plan
    if (.not. found .or. (n > 1 .and. ratio < least)) then
      choice%outcome = is_finest
      finest = odd_finer(sequence, from)
      if (relative_size(from) < least_step*relative_size(finest)) finest = finer(sequence, from, &
        least_step)
      choice%finer = relative_size(from)/relative_size(finest)
      choice%seconds = sequence%spent + seconds_to_run(sequence, relative_size(finest), &
        choice%divisions)
      choice%memory = memory_to_run(sequence, relative_size(finest))
      return
    end if
    choice%mesh_size = finest
    choice%may_be_last = .true.
    ! Where only memory has a bound a mesh more takes nothing that counts.
    few = n == 1 .or. (n == 2 .and. sequence%time <= 0.0_wp)
    if (ratio <= largest_jump .and. .not. (few .and. ratio > nearly_last)) return
    from = finer(sequence, from, ratio/largest_jump)
    if (relative_size(from) <= relative_size(finest)) return
    choice%mesh_size = from
    choice%may_be_last = .false.
  end subroutine choose_size

  !> With an accuracy: where the run that it takes goes beyond the bounds, the finest mesh within
  !> them that has its increments; where these are still tried out, those tried last.
  subroutine keep_within(sequence, room, errors, choice)
    type(mesh_sequence_t), intent(in) :: sequence
    real(wp), intent(in) :: room
    type(sequence_error_t), intent(inout) :: errors
    type(choice_t), intent(inout) :: choice !! a run, or that the machine does not hold it
    type(choice_t) :: needed
    logical :: is_trial

    is_trial = choice%divisions > maxval(sequence%runs%divisions)
    if (choice%outcome == to_run) then
      if (fits(sequence, choice%mesh_size, choice%divisions, room, merge(part_for_trial, &
        part_for_run, is_trial))) return
    end if
    call estimate_sequence(sequence, errors)
    needed = choice
    choice%outcome = to_run
    if (is_trial) choice%divisions = maxval(sequence%runs%divisions)
    call choose_size(sequence, room, choice)
    if (choice%outcome == to_run) return
    call tell_needs(sequence, errors, needed)
    choice = needed
    choice%outcome = time_is_over
  end subroutine keep_within

  !> What a run that would reach the accuracy takes.
  subroutine tell_needs(sequence, errors, choice)
    type(mesh_sequence_t), intent(in) :: sequence
    type(sequence_error_t), intent(in) :: errors
    type(choice_t), intent(inout) :: choice !! gets finer, seconds and memory
    real(wp) :: enough !! size of elements [-]

    enough = relative_size(choice%mesh_size)
    associate (last => sequence%runs(size(sequence%runs)))
      if (errors%mesh > 0.0_wp .and. errors%worst > 0) enough = min(enough, size_for_error( &
        relative_size(last%mesh_size), errors%mesh, sequence%wanted, &
        max(1.0_wp, errors%of_mesh(errors%worst)%order)))
      choice%finer = relative_size(last%mesh_size)/enough
    end associate
    choice%seconds = sequence%spent + seconds_to_run(sequence, enough, choice%divisions)
    choice%memory = memory_to_run(sequence, enough)
  end subroutine tell_needs

end module run_within_mod
