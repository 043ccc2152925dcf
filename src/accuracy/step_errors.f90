!> What load steps make of a result, by runs on one mesh whose increments are divided; how that
!> differs from mesh to mesh.
!>
!> docs/theory.md section 10, (10.21).
module step_errors_mod
  use kinds_mod, only: wp
  use mesh_size_mod, only: relative_size
  use measured_quantities_mod, only: error_scales
  use mesh_sequence_mod, only: mesh_sequence_t, mesh_run_t, family_t, has_bound, mesh_runs, &
    change, step_runs, runs_on_mesh, runs_up_to, sizes_of, values_in
  use cut_runs_mod, only: cuts_for_trials
  use convergence_mod, only: convergence_t, about_twice, order_of_elements, order_of_increments
  use follow_sizes_mod, only: follow_sizes
  use step_limits_mod, only: corrects_steps, error_of_corrected, growth_of_error, &
    error_of_difference, size_of
  implicit none
  private

  public :: error_by_steps, error_on_mesh, errors_on_mesh, later_step_runs, runs_for_steps, &
    error_by_transfer, with_inferred, change_is_known, part_for_steps

  real(wp), parameter :: part_for_steps = 0.5_wp !! of the accuracy, that load steps may use up
  real(wp), parameter :: least_change = 0.2_wp
  !! of what divisions change, however alike on two meshes: 0.24 are missed on the finer one where
  !! the block of studies/data/scenes/again.inp is pressed again (n = 14, 32 parts) [-]
  real(wp), parameter :: later_size = 0.5_wp
  !! elements with which increments are tried again that the first trial wants divided, over its own

contains

  !> The error that load steps make with a family's divisions of the deck's increments, as the runs
  !> on its coarsest mesh say, where there are three, or on the first mesh of all; negative where
  !> they do not.
  real(wp) function error_by_steps(sequence, family) result(error)
    type(mesh_sequence_t), intent(in) :: sequence
    type(family_t), intent(in) :: family
    integer, allocatable :: runs(:)

    error = -1.0_wp
    runs = runs_for_steps(sequence, family)
    if (size(runs) >= 3) error = error_on_mesh(sequence, runs, family%divisions)
  end function error_by_steps

  !> The runs on one mesh that say what load steps make in those of a family, the fewest divisions
  !> first.
  pure function runs_for_steps(sequence, family) result(runs)
    type(mesh_sequence_t), intent(in) :: sequence
    type(family_t), intent(in) :: family
    integer, allocatable :: runs(:)

    runs = step_runs(sequence, cuts_for_trials(sequence, family%cuts))
    if (family%cuts > 0 .and. size(runs) >= 3) return
    runs = later_step_runs(sequence)
    if (size(runs) < 3) runs = step_runs(sequence, 0)
  end function runs_for_steps

  !> The runs on the mesh on which increments are tried again, the fewest divisions first: the one
  !> where they were; else the first that is fine enough for it, or for the accuracy. Its undivided
  !> run was made: what is inferred tells nothing new of increments.
  pure function later_step_runs(sequence) result(runs)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, allocatable :: runs(:)
    integer, allocatable :: undivided(:), finer(:)
    real(wp), parameter :: less = 1.0_wp - 1.0e-6_wp
    integer :: i

    undivided = mesh_runs(sequence, family_t())
    undivided = pack(undivided, sequence%runs(undivided)%inferred_from == 0)
    finer = runs_up_to(sequence, undivided, less*relative_size(sequence%trial))
    runs = pack(finer, [(size(runs_on_mesh(sequence, finer(i))) > 1, i=1, size(finer))])
    if (size(runs) == 0) runs = runs_up_to(sequence, finer, later_size*relative_size( &
      sequence%trial))
    if (size(runs) == 0 .and. size(finer) > 0) then
      if (is_mesh_enough()) runs = finer(size(finer):)
    end if
    if (size(runs) > 0) runs = runs_on_mesh(sequence, runs(1))

  contains

    !> Whether undivided runs say that their last mesh leaves as much for load steps as they may
    !> make.
    pure logical function is_mesh_enough()
      type(convergence_t) :: observed
      integer, allocatable :: meshes(:)
      real(wp) :: scales(size(sequence%list))
      integer :: k, n_rising

      meshes = mesh_runs(sequence, family_t())
      is_mesh_enough = size(meshes) > 2
      if (.not. is_mesh_enough) return
      scales = error_scales(sequence%list, sequence%runs(meshes(size(meshes)))%values)
      do k = 1, size(scales)
        call follow_sizes(sequence, meshes, sizes_of(sequence, meshes), order_of_elements, k, &
          scales(k), observed, n_rising)
        is_mesh_enough = is_mesh_enough .and. observed%error <= (1.0_wp - part_for_steps)* &
          sequence%wanted
      end do
    end function is_mesh_enough

  end function later_step_runs

  !> The error by load steps with so many divisions, as three runs and more on one mesh say: of the
  !> worst quantity; negative where none has these.
  real(wp) function error_on_mesh(sequence, runs, divisions) result(error)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: runs(:) !! the fewest divisions first
    integer, intent(in) :: divisions

    error = maxval([errors_on_mesh(sequence, runs, divisions)])
    if (size(sequence%list) == 0) error = merge(0.0_wp, -1.0_wp, any(sequence%runs( &
      runs)%divisions == divisions))
  end function error_on_mesh

  !> The same of each quantity.
  function errors_on_mesh(sequence, runs, divisions) result(errors)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: runs(:) !! the fewest divisions first
    integer, intent(in) :: divisions
    real(wp) :: errors(size(sequence%list)) !! as parts of the scales [-]
    type(convergence_t) :: observed
    real(wp) :: scales(size(sequence%list))
    integer :: k, n, mine, n_rising

    errors = -1.0_wp
    n = size(runs)
    mine = findloc(sequence%runs(runs)%divisions, divisions, dim=1)
    if (mine == 0) return
    scales = error_scales(sequence%list, sequence%runs(runs(n))%values)
    do k = 1, size(sequence%list)
      if (corrects_steps(sequence, runs)) then
        errors(k) = error_of_corrected(sequence, runs, k, mine, scales(k))
        cycle
      end if
      call follow_sizes(sequence, runs, 1.0_wp/real(sequence%runs(runs)%divisions, wp), &
        order_of_increments, k, scales(k), observed, n_rising)
      errors(k) = observed%error
      if (mine < n) errors(k) = errors(k) + change(sequence, k, scales(k), runs(mine), runs(n))
      errors(k) = errors(k)*growth_of_error(sequence, runs)
    end do
  end function errors_on_mesh

  !> The error that a mesh makes in what the divisions of increments change, where it is undivided
  !> ones that say what it makes in all else: what these change on it differs from what they change
  !> on a coarser mesh. 0 for a run with divided increments or cuts, and for a mesh that is no finer
  !> than the one on which increments are tried, or on which they are not divided.
  pure real(wp) function error_by_transfer(sequence, k, scale, run) result(error)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: k      !! the quantity
    real(wp), intent(in) :: scale
    integer, intent(in) :: run    !! the last of those that say what the mesh makes
    integer, allocatable :: alike(:)
    real(wp), allocatable :: h(:)
    integer :: i, n

    error = 0.0_wp
    if (.not. sequence%list(k)%is_compared) return
    if (sequence%runs(run)%divisions > 1 .or. sequence%runs(run)%mesh_size%zone%times > 0) return
    associate (tried => runs_for_steps(sequence, family_t()))
      if (size(tried) == 0) return
      if (.not. is_larger(tried(1))) return
    end associate
    if (sequence%runs(run)%inferred_from > 0) then
      error = error_of_inferred(sequence, k, scale, sequence%runs(run)%inferred_from)
      return
    end if
    alike = divided_alike()
    n = size(alike)
    if (n < 2) return
    h = sizes_of(sequence, alike)
    i = minloc(h(:n - 1), dim=1, mask=h(:n - 1) >= about_twice*h(n), back=.true.)
    if (i == 0) i = maxloc(h(:n - 1), dim=1, back=.true.)
    error = max(error_of_difference(h([i, n]), size_of(changed(alike(i)) - changed(alike(n)), &
      scale)), least_change*size_of(changed(alike(n)), scale))

  contains

    !> What the divisions of a run change on its mesh.
    pure function changed(i) result(values)
      integer, intent(in) :: i
      real(wp), allocatable :: values(:, :)

      values = values_in(sequence, i, k) - values_in(sequence, undivided_beside(i), k)
    end function changed

    !> The run with the most divisions on the mesh, and before it those on coarser ones with as many
    !> and an undivided one beside them, as they were made; none where there is not such a run.
    pure function divided_alike() result(alike)
      integer, allocatable :: alike(:)
      integer :: i, divided

      divided = 0
      associate (here => runs_on_mesh(sequence, run))
        if (size(here) > 1) divided = here(size(here))
      end associate
      alike = [integer ::]
      if (divided == 0) return
      alike = mesh_runs(sequence, family_t(0, sequence%runs(divided)%divisions))
      alike = [pack(alike, [(is_larger(alike(i)) .and. undivided_beside(alike(i)) > 0, i=1, &
        size(alike))]), divided]
    end function divided_alike

    !> The undivided run on the mesh of another one; 0: there is none.
    pure integer function undivided_beside(i) result(beside)
      integer, intent(in) :: i

      associate (there => runs_on_mesh(sequence, i))
        beside = there(1)
      end associate
      associate (run => sequence%runs(beside))
        if (run%divisions > 1 .or. run%inferred_from > 0) beside = 0
      end associate
    end function undivided_beside

    pure logical function is_larger(i)
      integer, intent(in) :: i
      real(wp), parameter :: rounding = 1.0e-6_wp

      is_larger = size_of_run(i) > (1.0_wp + rounding)*size_of_run(run)
    end function is_larger

    pure real(wp) function size_of_run(i)
      integer, intent(in) :: i

      size_of_run = relative_size(sequence%runs(i)%mesh_size)
    end function size_of_run

  end function error_by_transfer

  !> The runs and, on meshes where increments are divided alone, what undivided ones would give:
  !> what the divisions change is taken from the finest mesh that has both. docs/theory.md (10.30).
  pure type(mesh_sequence_t) function with_inferred(sequence) result(with)
    type(mesh_sequence_t), intent(in) :: sequence
    type(mesh_run_t) :: undivided
    integer, allocatable :: pairs(:, :)
    integer :: i, n

    with = sequence
    if (.not. sequence%divides .or. has_bound(sequence)) return
    n = 0
    do i = 1, size(sequence%runs)
      n = n + 1
      associate (here => runs_on_mesh(sequence, i))
        if (here(1) /= i .or. sequence%runs(i)%mesh_size%zone%times > 0) cycle
      end associate
      pairs = tried_pairs(sequence, sequence%runs(i)%divisions)
      if (size(pairs) == 0) cycle
      undivided = sequence%runs(i)
      undivided%inferred_from = undivided%divisions
      undivided%divisions = 1
      undivided%values = undivided%values - (sequence%runs(pairs(2, 1))%values - sequence%runs( &
        pairs(1, 1))%values)
      with%runs = [with%runs(:n - 1), undivided, with%runs(n:)]
      n = n + 1
    end do
  end function with_inferred

  !> Whether what so many divisions change on a finer mesh is known to within a part of the scales.
  pure logical function change_is_known(sequence, divisions, allowed) result(is_known)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: divisions
    real(wp), intent(in) :: allowed !! [-]
    real(wp) :: scales(size(sequence%list))
    integer :: k

    scales = error_scales(sequence%list, sequence%runs(size(sequence%runs))%values)
    is_known = all([(error_of_inferred(sequence, k, scales(k), divisions) <= allowed, k=1, &
      size(scales))])
  end function change_is_known

  !> An undivided run and one with so many divisions, on each mesh where increments were tried, the
  !> finest first.
  pure function tried_pairs(sequence, divisions) result(pairs)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: divisions
    integer, allocatable :: pairs(:, :) !! (2,n)

    pairs = reshape([pair_of(later_step_runs(sequence)), pair_of(step_runs(sequence, 0))], [2, &
      count([size(pair_of(later_step_runs(sequence))), size(pair_of(step_runs(sequence, 0)))] > &
      0)])

  contains

    pure function pair_of(tried) result(pair)
      integer, intent(in) :: tried(:) !! on one mesh, the fewest divisions first
      integer, allocatable :: pair(:)
      integer :: i

      i = findloc(sequence%runs(tried)%divisions, divisions, dim=1)
      pair = [integer ::]
      if (i < 2) return
      if (sequence%runs(tried(1))%divisions == 1) pair = [tried(1), tried(i)]
    end function pair_of

  end function tried_pairs

  !> The error of a quantity that is inferred: what the divisions change may differ on a finer mesh
  !> by as much as what load steps make may, or as it differs from what they change on a coarser
  !> mesh, if that is less.
  pure real(wp) function error_of_inferred(sequence, k, scale, divisions) result(error)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: k         !! the quantity
    real(wp), intent(in) :: scale
    integer, intent(in) :: divisions !! of the run that it is inferred from
    integer, allocatable :: pairs(:, :)

    error = 0.0_wp
    if (.not. sequence%list(k)%is_compared) return
    pairs = tried_pairs(sequence, divisions)
    error = huge(1.0_wp)
    if (size(pairs) == 0) return
    associate (here => size_of(changed(1), scale))
      error = (growth_of_error(sequence, pairs(:, 1)) - 1.0_wp)*here
      if (size(pairs, 2) == 2) error = min(error, max(least_change*here, error_of_difference( &
        sizes_of(sequence, pairs(1, [2, 1])), size_of(changed(1) - changed(2), scale))))
    end associate

  contains

    !> What the divisions change on one of the meshes.
    pure function changed(i) result(values)
      integer, intent(in) :: i
      real(wp) :: values(sequence%list(k)%n, sequence%n_increments)

      values = values_in(sequence, pairs(2, i), k) - values_in(sequence, pairs(1, i), k)
    end function changed

  end function error_of_inferred

end module step_errors_mod
