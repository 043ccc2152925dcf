!> How the deck's increments are to be divided: tried on one mesh with three sizes and more.
!>
!> docs/theory.md section 10.
module choose_divisions_mod
  use kinds_mod, only: wp
  use mesh_size_mod, only: mesh_size_t
  use mesh_sequence_mod, only: mesh_sequence_t, family_t, has_bound, step_runs
  use convergence_mod, only: growth_of_cost, growth_with_parts
  use cut_runs_mod, only: cuts_for_trials
  use step_errors_mod, only: error_on_mesh, later_step_runs, part_for_steps
  use sequence_error_mod, only: sequence_error_t, estimate_sequence, take_steps, is_enough, &
    by_elements
  implicit none
  private

  public :: choose_divisions, waits_with_steps, waits_for_mesh, mesh_for_steps, most_divisions

  integer, parameter :: always_tried = 64 !! divisions, however many increments the deck has
  integer, parameter :: most_increments = 1024 !! of a run with more divisions than these
  integer, parameter :: few = 2 !! divisions, that are taken as the first mesh wants them
  integer, parameter :: many = 8
  !! divisions, from which on it is looked whether the mesh makes more: fewer take less than a mesh

contains

  !> How the deck's increments are to be divided: tried on the coarsest mesh of a family with three
  !> sizes and more, from what it has on. More divisions take as many times the time, fewer leave
  !> less of the accuracy for the mesh.
  subroutine choose_divisions(sequence, family, found)
    type(mesh_sequence_t), intent(in) :: sequence
    type(family_t), intent(inout) :: family !! gets the divisions
    logical, intent(out) :: found           !! else a run with these is to be made there

    found = .not. sequence%divides
    if (found) return
    call divisions_by(sequence, trial_runs(sequence, family%cuts), family%cuts, &
      family%divisions, found)
  end subroutine choose_divisions

  !> The runs on the mesh where increments are tried, the fewest divisions first.
  function trial_runs(sequence, cuts) result(runs)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: cuts !! at contact, of the runs that are to have the divisions
    integer, allocatable :: runs(:)

    if (cuts > 0) then
      runs = step_runs(sequence, cuts_for_trials(sequence, cuts))
    else if (waits_with_steps(sequence)) then
      runs = later_step_runs(sequence)
    else
      runs = step_runs(sequence, 0)
    end if
  end function trial_runs

  !> The divisions of increments that runs on one mesh ask for.
  subroutine divisions_by(sequence, runs, cuts, divisions, found)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: runs(:)
    integer, intent(in) :: cuts       !! of the runs that are to have these
    integer, intent(out) :: divisions !! those, or the next to be tried
    logical, intent(out) :: found
    type(sequence_error_t) :: errors
    integer :: fewest, most

    found = .false.
    fewest = minval(sequence%runs(runs)%divisions)
    most = maxval(sequence%runs(runs)%divisions)
    divisions = 2*most
    if (most < 4*fewest) return
    if (sequence%keeps_steps) then
      divisions = fewest
      found = .true.
      return
    end if
    ! The run that was made last may be in the file.
    associate (last => sequence%runs(size(sequence%runs)))
      if (last%mesh_size%zone%times == cuts .and. last%is_kept) then
        call estimate_sequence(sequence, errors)
        divisions = last%divisions
        found = are_enough(divisions)
        if (found) return
      end if
    end associate
    ! On a mesh that is there already they may be enough.
    divisions = fewest
    do while (divisions <= most)
      call estimate_sequence(sequence, errors, family_t(cuts, merge(divisions, fewest, &
        has_bound(sequence))))
      found = are_enough(divisions)
      if (found) return
      divisions = 2*divisions
    end do
    call estimate_sequence(sequence, errors, family_t(cuts, fewest))
    call cheapest_divisions(sequence, runs, errors, divisions, found)

  contains

    !> Whether these and the mesh whose errors are known are accurate enough together.
    logical function are_enough(divisions)
      integer, intent(in) :: divisions

      call take_steps(sequence, runs, divisions, errors)
      are_enough = errors%load_steps >= 0.0_wp .and. is_enough(sequence, errors)
    end function are_enough

  end subroutine divisions_by

  !> The divisions by which an accuracy is foreseen to be reached in the least time, if any leave
  !> enough for the mesh; else the next to be tried.
  subroutine cheapest_divisions(sequence, runs, errors, divisions, found)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: runs(:) !! on one mesh, the fewest divisions first
    type(sequence_error_t), intent(in) :: errors !! by the mesh that is there, if known
    integer, intent(out) :: divisions
    logical, intent(out) :: found
    real(wp) :: least, cost, left, mesh
    integer :: tried, most

    most = maxval(sequence%runs(runs)%divisions)
    divisions = 2*most
    least = huge(1.0_wp)
    mesh = sequence%wanted
    if (errors%mesh >= 0.0_wp) mesh = by_elements(errors)
    tried = minval(sequence%runs(runs)%divisions)
    do while (tried <= most)
      left = sequence%wanted - error_on_mesh(sequence, runs, tried)
      if (left >= min(mesh, (1.0_wp - part_for_steps)*sequence%wanted)) then
        cost = real(tried, wp)**growth_with_parts*max(1.0_wp, mesh/left)**growth_of_cost
        if (cost < least) then
          least = cost
          divisions = tried
        end if
      end if
      tried = 2*tried
    end do
    found = least < huge(1.0_wp)
  end subroutine cheapest_divisions

  !> The most divisions that are tried.
  pure integer function most_divisions(sequence)
    type(mesh_sequence_t), intent(in) :: sequence

    most_divisions = max(always_tried, most_increments/max(1, sequence%n_stretches))
  end function most_divisions

  !> Whether increments are tried out on a finer mesh than the first, where few points touch: it
  !> wants them divided, and each division takes as many times the time.
  logical function waits_with_steps(sequence)
    type(mesh_sequence_t), intent(in) :: sequence
    type(sequence_error_t) :: errors
    type(family_t) :: family
    logical :: found

    waits_with_steps = .false.
    if (.not. sequence%divides .or. has_bound(sequence)) return
    associate (first => step_runs(sequence, 0))
      if (maxval(sequence%runs(first)%divisions) < 4) return
    end associate
    call estimate_sequence(sequence, errors, family)
    call cheapest_divisions(sequence, step_runs(sequence, 0), errors, family%divisions, found)
    waits_with_steps = .not. found .or. family%divisions > merge(1, few, sequence%keeps_steps)
  end function waits_with_steps

  !> Whether increments are divided no further before there are finer meshes: what the mesh makes is
  !> more than what is asked for, and more than what load steps make where they were tried; or it is
  !> not known, and a mesh that has to come in any case tells.
  logical function waits_for_mesh(sequence, family)
    type(mesh_sequence_t), intent(in) :: sequence
    type(family_t), intent(in) :: family !! undivided, of the meshes that are to be finer
    type(sequence_error_t) :: errors
    integer :: most

    waits_for_mesh = .false.
    if (has_bound(sequence)) return
    associate (runs => trial_runs(sequence, family%cuts))
      most = maxval(sequence%runs(runs)%divisions)
      if (most < many) return
      call estimate_sequence(sequence, errors, family)
      waits_for_mesh = errors%mesh > max(sequence%wanted, error_on_mesh(sequence, runs, most)) &
        .or. (errors%mesh < 0.0_wp .and. family%cuts == 0)
    end associate
  end function waits_for_mesh

  !> Where increments are tried out.
  type(mesh_size_t) function mesh_for_steps(sequence) result(mesh_size)
    type(mesh_sequence_t), intent(in) :: sequence

    associate (first => step_runs(sequence, 0), later => later_step_runs(sequence))
      mesh_size = sequence%runs(first(1))%mesh_size
      if (waits_with_steps(sequence)) mesh_size = sequence%runs(later(1))%mesh_size
    end associate
  end function mesh_for_steps

end module choose_divisions_mod
