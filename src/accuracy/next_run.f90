!> Which run comes next on the way to an accuracy, or why there is none.
!>
!> docs/theory.md section 10.
module next_run_mod
  use kinds_mod, only: wp
  use mesh_size_mod, only: mesh_size_t, zone_t, relative_size, is_same_size
  use choose_cuts_mod, only: choose_cuts
  use convergence_mod, only: size_for_error, least_order
  use mesh_sequence_mod, only: mesh_sequence_t, family_t, has_bound, mesh_runs, step_runs, &
    runs_up_to, sizes_of
  use foreseen_costs_mod, only: memory_when_finer
  use finer_meshes_mod, only: finer, mesh_before, least_step, largest_step, second_step
  use cut_runs_mod, only: cuts_for_trials, waits_for_half, is_all_but_cut
  use step_errors_mod, only: runs_for_steps, later_step_runs, change_is_known, with_inferred
  use sequence_error_mod, only: sequence_error_t, estimate_sequence, take_steps, is_enough, &
    is_enough_but_steps, speaks_alone, total_error, by_elements
  use choose_divisions_mod, only: choose_divisions, waits_with_steps, waits_for_mesh, &
    mesh_for_steps, most_divisions
  implicit none
  private

  public :: choice_t, choose_run, is_beginning
  public :: to_run, is_reached, steps_too_coarse, not_convergent, beyond_machine, is_finest, &
    time_is_over, facets_too_coarse

  ! What comes next.
  integer, parameter :: to_run = 1
  integer, parameter :: is_reached = 2
  integer, parameter :: steps_too_coarse = 3 !! load steps make too much, however small
  integer, parameter :: not_convergent = 4   !! finer meshes change it as much as before, or more
  integer, parameter :: beyond_machine = 5   !! the mesh that it takes does not fit
  integer, parameter :: is_finest = 6        !! nothing finer fits the time and memory allowed
  integer, parameter :: time_is_over = 7     !! and the accuracy takes more
  integer, parameter :: facets_too_coarse = 8 !! flat faces that stand for arcs make too much

  real(wp), parameter :: aimed_at = 0.8_wp !! of what is left for the mesh
  real(wp), parameter :: wary_step = 1.5_wp
  !! from size to size: estimates are high on coarse meshes, and elements of half the size take
  !! thirty times as long
  real(wp), parameter :: worth_a_try = 1.5_wp
  !! times smaller that all elements must get, from which on cuts at contact are tried
  real(wp), parameter :: far_off = 4.0_wp
  !! times smaller that elements must get, from which on it is looked whether that helps: two meshes
  !! of half the size each, of which the last takes a thousand times as long
  integer, parameter :: most_parts = 64
  real(wp), parameter :: rounding = 1.0e-9_wp
  real(wp), parameter :: small = 0.02_wp !! of the machine's memory [-]
  real(wp), parameter :: most_too_large = 10.0_wp
  !! times what it is: an error as coarse meshes have told it (docs/studies/effectivity.md) [-]
  real(wp), parameter :: hoped_order = 1.0_wp
  !! of finer meshes: on coarse ones the order is often less than what it becomes

  !> What to do next.
  type :: choice_t
    integer :: outcome = to_run
    type(mesh_size_t) :: mesh_size = mesh_size_t()
    integer :: divisions = 1
    logical :: may_be_last = .false. !! it is expected to reach the accuracy
    integer :: of_run = 0            !! the run that reaches it; 0: none does
    real(wp) :: finer = 1.0_wp
    !! how many times smaller the elements of the last run would have to be; 1: not known [-]
    real(wp) :: memory = 0.0_wp      !! and what that would take [bytes]
    real(wp) :: seconds = 0.0_wp     !! foreseen up to its end, all runs; 0: not known [s]
    real(wp) :: error = -1.0_wp      !! foreseen; negative: not known [-]
    integer :: n_plans = 0           !! that were made of this run so far
    logical :: is_replaced = .false. !! the plan of another run led to this one
  end type choice_t

contains

  !> Whether all runs so far are on meshes that are coarser than that on which increments are tried
  !> first: one more that is not solved is skipped then.
  pure logical function is_beginning(sequence)
    type(mesh_sequence_t), intent(in) :: sequence

    is_beginning = size(step_runs(sequence, 0)) == 0
  end function is_beginning

  !> The next run, or why there is none.
  subroutine choose_run(sequence, memory_left, errors, choice)
    type(mesh_sequence_t), intent(in) :: sequence
    real(wp), intent(in) :: memory_left !! on this machine, before a run [bytes]
    type(sequence_error_t), intent(out) :: errors !! of the run that the next one follows
    type(choice_t), intent(out) :: choice
    type(mesh_sequence_t) :: with

    choice%mesh_size = sequence%first
    if (size(sequence%runs) == 0) then
      choice%may_be_last = speaks_alone(sequence, 0)
      return
    end if
    with = with_inferred(sequence)
    call follow_runs(with, memory_left, errors, choice)
    ! What is inferred from a run stands before it.
    choice%of_run = choice%of_run - count(with%runs(:choice%of_run - 1)%inferred_from > 0)
    if (choice%mesh_size%parts > most_parts) choice%outcome = beyond_machine
  end subroutine choose_run

  !> Increments on the first mesh, then all elements, those at contact, increments there.
  subroutine follow_runs(sequence, memory_left, errors, choice)
    type(mesh_sequence_t), intent(in) :: sequence
    real(wp), intent(in) :: memory_left
    type(sequence_error_t), intent(out) :: errors
    type(choice_t), intent(inout) :: choice
    type(family_t) :: family
    integer :: next, base, fewest
    logical :: found

    call estimate_sequence(sequence, errors)
    if (speaks_alone(sequence, 1) .and. is_enough(sequence, errors)) then
      choice%outcome = is_reached
      choice%of_run = 1
      return
    end if
    if (sequence%asked > 0.0_wp .and. errors%facets > sequence%wanted) then
      ! Finer meshes of the same faces have as much.
      choice%outcome = facets_too_coarse
      return
    end if
    if (sequence%divides) then
      if (.not. is_trial_mesh_there()) then
        choice%mesh_size = mesh_before(sequence)
        return
      end if
    end if
    call choose_divisions(sequence, family, found)
    choice%divisions = family%divisions
    if (found) then
      call follow_meshes(sequence, family, memory_left, errors, choice)
    else if (waits_for_mesh(sequence, family_t())) then
      call refine_first(sequence, family_t(), memory_left, errors, choice)
    else
      choice%mesh_size = mesh_for_steps(sequence)
      if (family%divisions > most_divisions(sequence)) choice%outcome = steps_too_coarse
      return
    end if
    if (choice%outcome == is_reached .or. choice%outcome == steps_too_coarse) return
    ! The cost of cuts is not predicted, and waves need elements of one size.
    if (has_bound(sequence) .or. sequence%is_in_time .or. size(mesh_runs(sequence, family_t())) < &
      3) return
    if (choice%outcome == to_run .and. (.not. is_finer_than_all() .or. (choice%finer > 1.0_wp &
      .and. choice%finer < worth_a_try))) return
    fewest = minval(sequence%runs%divisions)
    base = waits_for_half(sequence, fewest)
    ! Contact on few elements says little of how it converges.
    if (base > 0 .and. choice%outcome == not_convergent) choice%outcome = to_run
    if (base > 0 .and. choice%outcome == to_run) call go_no_further(finer(sequence, &
      sequence%runs(base)%mesh_size, largest_step), choice)
    call choose_cuts(sequence, fewest, family%cuts, next, base)
    if (next == 0 .and. family%cuts == 0) return
    if (next > 0) then
      call cut_again(sequence, family_t(next, fewest), base, choice)
      return
    end if
    family%divisions = fewest
    call follow_cuts(sequence, family, memory_left, errors, choice)

  contains

    !> Whether the mesh that is chosen is finer than all without cuts that there are.
    pure logical function is_finer_than_all()
      associate (runs => mesh_runs(sequence, family_t()))
        is_finer_than_all = relative_size(choice%mesh_size) < relative_size(sequence%runs(runs( &
          size(runs)))%mesh_size)
      end associate
    end function is_finer_than_all

    !> Whether there is a run on the mesh where increments are tried next.
    logical function is_trial_mesh_there() result(is_there)
      is_there = size(step_runs(sequence, 0)) > 0
      if (.not. is_there) return
      if (waits_with_steps(sequence)) is_there = size(later_step_runs(sequence)) > 0
    end function is_trial_mesh_there

  end subroutine follow_runs

  !> What follows where the mesh is to be finer before increments are divided any further: what load
  !> steps make counts for nothing until then.
  subroutine refine_first(sequence, family, memory_left, errors, choice)
    type(mesh_sequence_t), intent(in) :: sequence
    type(family_t), intent(in) :: family
    real(wp), intent(in) :: memory_left
    type(sequence_error_t), intent(out) :: errors
    type(choice_t), intent(out) :: choice

    choice%divisions = family%divisions
    call estimate_sequence(sequence, errors, family)
    errors%load_steps = 0.0_wp
    errors%together = errors%mesh
    call refine_all(sequence, family, memory_left, errors, choice)
    choice%may_be_last = .false.
  end subroutine refine_first

  !> Another cut at contact; before that, where it is to be the last for all that is known,
  !> increments are tried out with one cut less: so its result is that of the last run.
  subroutine cut_again(sequence, family, base, choice)
    type(mesh_sequence_t), intent(in) :: sequence
    type(family_t), intent(in) :: family !! with that cut
    integer, intent(in) :: base          !! on the mesh of this run
    type(choice_t), intent(out) :: choice
    type(family_t) :: tried
    logical :: found

    if (sequence%divides .and. is_all_but_cut(sequence, family, base)) then
      tried = family_t(family%cuts - 1, family%divisions)
      call choose_divisions(sequence, tried, found)
      if (.not. found .and. tried%divisions <= most_divisions(sequence)) then
        associate (runs => step_runs(sequence, cuts_for_trials(sequence, tried%cuts)))
          choice = choice_t(mesh_size=sequence%runs(runs(1))%mesh_size, divisions=tried%divisions)
        end associate
        return
      end if
    end if
    choice = choice_t(mesh_size=sequence%runs(base)%mesh_size, divisions=family%divisions)
    choice%mesh_size%zone = zone_t(family%cuts, sequence%runs(size(sequence%runs))%balls)
  end subroutine cut_again

  !> What follows without cuts at contact: finer meshes with the increments that are chosen, as far
  !> as it is known what these change; else with undivided ones, until a mesh is enough, and then
  !> that one with those that are chosen. Within bounds all have these.
  subroutine follow_meshes(sequence, family, memory_left, errors, choice)
    type(mesh_sequence_t), intent(in) :: sequence
    type(family_t), intent(in) :: family !! with the divisions that are chosen
    real(wp), intent(in) :: memory_left
    type(sequence_error_t), intent(inout) :: errors
    type(choice_t), intent(inout) :: choice
    integer, allocatable :: divided(:)
    type(mesh_size_t) :: finest
    logical :: is_divided

    call estimate_sequence(sequence, errors, family)
    if (family%divisions == 1 .or. has_bound(sequence)) then
      call refine_all(sequence, family, memory_left, errors, choice)
      return
    end if
    associate (undivided => mesh_runs(sequence, family_t()))
      finest = sequence%runs(undivided(size(undivided)))%mesh_size
    end associate
    divided = mesh_runs(sequence, family)
    is_divided = size(divided) > 0
    if (is_divided) is_divided = is_same_size(sequence%runs(divided(size(divided)))%mesh_size, &
      finest)
    if (.not. is_divided) then
      call estimate_sequence(sequence, errors, family_t())
      call take_steps(sequence, runs_for_steps(sequence, family), family%divisions, errors)
    end if
    call refine_all(sequence, family_t(), memory_left, errors, choice)
    if (choice%outcome == is_reached .and. is_divided) then
      choice%of_run = divided(size(divided))
    else if (choice%outcome == is_reached) then
      choice = choice_t(mesh_size=finest, divisions=family%divisions, may_be_last=.true.)
    else if (choice%outcome == to_run) then
      ! A mesh takes several times what all before it took, and an undivided run beside a divided
      ! one as much again.
      choice%divisions = merge(family%divisions, 1, change_is_known(sequence, family%divisions, &
        (1.0_wp - aimed_at)*(sequence%wanted - max(0.0_wp, errors%load_steps))))
      choice%may_be_last = choice%may_be_last .and. choice%divisions > 1
    end if
  end subroutine follow_meshes

  !> A mesh by which cuts at contact can be judged comes before a finer one.
  pure subroutine go_no_further(enough, choice)
    type(mesh_size_t), intent(in) :: enough
    type(choice_t), intent(inout) :: choice

    if (relative_size(choice%mesh_size) >= relative_size(enough)) return
    choice%mesh_size = enough
    choice%may_be_last = .false.
  end subroutine go_no_further

  !> What follows where elements at contact are cut: increments there, then all elements.
  subroutine follow_cuts(sequence, family, memory_left, errors, choice)
    type(mesh_sequence_t), intent(in) :: sequence
    type(family_t), intent(in) :: family !! its divisions are those that cuts were tried with
    real(wp), intent(in) :: memory_left
    type(sequence_error_t), intent(inout) :: errors
    type(choice_t), intent(inout) :: choice
    type(family_t) :: divided
    type(mesh_size_t) :: coarsest
    logical :: found

    choice = choice_t(divisions=family%divisions)
    call estimate_sequence(sequence, errors, family)
    call refine_all(sequence, family, memory_left, errors, choice)
    ! Few points touch on the first mesh: what load steps make of them is known better here. It is
    ! worth knowing where the mesh is about right.
    if (.not. (sequence%divides .and. is_near_goal(sequence, family, errors, choice))) return
    divided = family
    associate (tried => step_runs(sequence, cuts_for_trials(sequence, family%cuts)), &
      runs => mesh_runs(sequence, family))
      coarsest = sequence%runs(runs(1))%mesh_size
      choice = choice_t(mesh_size=sequence%runs(tried(1))%mesh_size)
    end associate
    call choose_divisions(sequence, divided, found)
    if (.not. found) then
      if (waits_for_mesh(sequence, family)) then
        call refine_first(sequence, family, memory_left, errors, choice)
        return
      end if
    end if
    choice%divisions = divided%divisions
    if (divided%divisions > most_divisions(sequence)) choice%outcome = steps_too_coarse
    if (.not. found) return
    if (size(mesh_runs(sequence, divided)) == 0) then
      choice%mesh_size = coarsest
      choice%may_be_last = .true.
      return
    end if
    call estimate_sequence(sequence, errors, divided)
    call refine_all(sequence, divided, memory_left, errors, choice)
  end subroutine follow_cuts

  !> Whether the meshes of a family all but reach the accuracy, or their increments were tried.
  pure logical function is_near_goal(sequence, family, errors, choice)
    type(mesh_sequence_t), intent(in) :: sequence
    type(family_t), intent(in) :: family
    type(sequence_error_t), intent(in) :: errors !! of the last of its runs
    type(choice_t), intent(in) :: choice !! what follows on its runs

    associate (runs => mesh_runs(sequence, family), tried => step_runs(sequence, &
      cuts_for_trials(sequence, family%cuts)))
      is_near_goal = size(tried) > 1 .or. any(choice%outcome == [is_reached, steps_too_coarse]) &
        .or. size(runs) > 2 .or. (sequence%runs(runs(size(runs)))%recovery <= sequence%wanted &
        .and. errors%mesh >= 0.0_wp .and. errors%mesh <= sequence%wanted)
    end associate
  end function is_near_goal

  !> What follows on the runs of a family: enough, or as fine as it takes.
  subroutine refine_all(sequence, family, memory_left, errors, choice)
    type(mesh_sequence_t), intent(in) :: sequence
    type(family_t), intent(in) :: family
    real(wp), intent(in) :: memory_left
    type(sequence_error_t), intent(in) :: errors !! of the last of them
    type(choice_t), intent(inout) :: choice
    integer, allocatable :: runs(:)
    real(wp) :: left, order, needed, least_needed

    runs = mesh_runs(sequence, family)
    associate (last => sequence%runs(runs(size(runs))))
      left = sequence%wanted - max(0.0_wp, errors%load_steps) - errors%others
      if (errors%mesh >= 0.0_wp) left = sequence%wanted - (total_error(errors) - &
        by_elements(errors)) - errors%facets
      if (is_enough(sequence, errors)) then
        choice%outcome = is_reached
        choice%of_run = runs(size(runs))
        return
      end if
      if (is_enough_but_steps(sequence, errors)) then
        choice%outcome = steps_too_coarse
        return
      end if
      if (size(runs) == 1) then
        choice%mesh_size = finer(sequence, last%mesh_size, second_step)
        ! Two meshes are enough where recovery agrees.
        choice%may_be_last = sequence%recovers .and. last%recovery <= sequence%wanted
        return
      end if
      if (left <= 0.1_wp*sequence%wanted) then
        choice%outcome = steps_too_coarse
        return
      end if
      if (size(runs) < 3) then
        choice%mesh_size = finer(sequence, last%mesh_size, least_step)
        choice%may_be_last = .true.
        return
      end if
      if (errors%turns(errors%worst)) then
        ! The next mesh shows whether they do.
        choice%mesh_size = finer(sequence, last%mesh_size, least_step)
        return
      end if
      if (errors%n_rising(errors%worst) > 0) then
        ! What it takes is not known: a finer mesh may tell.
        choice%mesh_size = finer(sequence, last%mesh_size, least_step)
        associate (n => size(runs_up_to(sequence, runs, relative_size(sequence%trial))))
          if (n > 6 .or. (n > 3 .and. errors%n_rising(errors%worst) > 1)) then
            ! Pressures may grow for ever at an edge. All else has a limit, but where forces act on
            ! nodes, and grows on coarse meshes as these lock less.
            if (sequence%list(errors%worst)%kind == 'pressure') choice%outcome = not_convergent
            if (is_as_wrong_as_before()) choice%outcome = not_convergent
          end if
        end associate
        return
      end if
      order = max(hoped_order, errors%of_mesh(errors%worst)%order)
      needed = 1.0_wp/size_for_error(1.0_wp, by_elements(errors), aimed_at*left, order)
      choice%mesh_size = finer(sequence, last%mesh_size, merge(least_step, min(needed, &
        wary_step), errors%of_mesh(errors%worst)%order <= least_order + rounding))
      choice%may_be_last = needed <= largest_step
      if (needed > far_off) then
        if (is_as_wrong_as_before()) choice%outcome = not_convergent
      end if
      choice%finer = needed
      choice%memory = memory_when_finer(sequence, last%memory, needed)
      ! Refused is what no machine of this size does for all that estimates may be too large. Else
      ! the next mesh replaces the forecast by a fact, as long as its plan fits; what is small yet
      ! is no measure of what is not, and another mesh is cheap.
      least_needed = 1.0_wp/size_for_error(1.0_wp, by_elements(errors)/most_too_large, left, &
        order)
      if (last%memory > small*memory_left) then
        if (memory_when_finer(sequence, last%memory, max(1.0_wp, least_needed)) > memory_left) then
          choice%outcome = beyond_machine
        end if
      end if
    end associate

  contains

    !> Whether, of six meshes and more, the error is about what it was with elements of twice the
    !> size: that of the last mesh and of the one before, for scatter may make one of them so large.
    !> Of resultants and the energy three times the size: they scatter where contact goes on from
    !> node to node, and resultants have a limit, and so has the energy without forces on nodes.
    logical function is_as_wrong_as_before() result(is_so)
      real(wp), parameter :: about = 0.9_wp
      real(wp) :: before, distant
      integer :: i, n

      is_so = .false.
      n = size(runs)
      if (n < 6) return
      distant = merge(3.0_wp, 2.0_wp, sequence%recovers) - rounding
      i = count(sizes_of(sequence, runs) >= distant*relative_size(sequence%runs(runs( &
        n))%mesh_size))
      if (i < 3) return
      before = error_up_to(i)
      if (before < 0.0_wp) return
      is_so = min(error_up_to(n - 1), errors%of_mesh(errors%worst)%error) >= about*before
    end function is_as_wrong_as_before

    !> The error of the quantity that is the worst now, as an earlier mesh had it; negative where it
    !> was not known.
    real(wp) function error_up_to(m) result(error)
      integer, intent(in) :: m !! which of the meshes
      type(mesh_sequence_t) :: earlier
      type(sequence_error_t) :: of_earlier

      earlier = sequence
      earlier%runs = sequence%runs(:runs(m))
      call estimate_sequence(earlier, of_earlier, family)
      error = -1.0_wp
      if (allocated(of_earlier%of_mesh)) error = of_earlier%of_mesh(errors%worst)%error
    end function error_up_to

  end subroutine refine_all

end module next_run_mod
