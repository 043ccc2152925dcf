!> What load steps make of a result: by runs on one mesh whose increments are divided.
!>
!> docs/theory.md section 10, (10.19).
module step_errors_mod
  use kinds_mod, only: wp
  use mesh_size_mod, only: relative_size
  use measured_quantities_mod, only: error_scales
  use mesh_sequence_mod, only: mesh_sequence_t, family_t, has_bound, mesh_runs, change, &
    step_runs, runs_on_mesh, runs_up_to, sizes_of
  use cut_runs_mod, only: cuts_for_trials
  use convergence_mod, only: convergence_t
  use follow_sizes_mod, only: follow_sizes
  implicit none
  private

  public :: error_by_steps, error_on_mesh, later_step_runs, runs_for_steps, corrects_steps, &
    step_correction, on_coarse_mesh, part_for_steps

  real(wp), parameter :: on_coarse_mesh = 2.0_wp
  !! times what load steps make there, where few points slide, they make on finer ones at most
  real(wp), parameter :: on_finer_mesh = 1.25_wp !! likewise, of a finer one
  real(wp), parameter :: left_of_error = 0.5_wp !! of values that it is taken off [-]
  real(wp), parameter :: part_for_steps = 0.5_wp !! of the accuracy, that load steps may use up
  real(wp), parameter :: later_size = 0.5_wp
  !! bricks with which increments are tried again that the first trial wants divided, over its own

contains

  !> The error that load steps make with a family's divisions of the deck's increments, as the runs
  !> on its coarsest mesh say, where there are three, or on the first mesh of all; negative where
  !> they do not.
  function error_by_steps(sequence, family) result(error)
    type(mesh_sequence_t), intent(in) :: sequence
    type(family_t), intent(in) :: family
    real(wp) :: error
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
  !> where they were; else the first that is fine enough for it, or for the accuracy.
  pure function later_step_runs(sequence) result(runs)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, allocatable :: runs(:)
    integer, allocatable :: finer(:)
    real(wp), parameter :: less = 1.0_wp - 1.0e-6_wp
    integer :: i

    finer = runs_up_to(sequence, [(i, i=1, size(sequence%runs))], less*relative_size( &
      sequence%trial))
    runs = pack(finer, sequence%runs(finer)%divisions > 1 .and. &
      sequence%runs(finer)%mesh_size%zone%times == 0)
    if (size(runs) == 0) runs = runs_up_to(sequence, mesh_runs(sequence, family_t()), later_size* &
      relative_size(sequence%trial))
    if (size(runs) == 0 .and. size(finer) > 0) then
      if (is_mesh_enough()) runs = pack(finer, finer == maxval(mesh_runs(sequence, family_t())))
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
        call follow_sizes(sequence, meshes, sizes_of(sequence, meshes), k, scales(k), observed, &
          n_rising)
        is_mesh_enough = is_mesh_enough .and. observed%error <= (1.0_wp - part_for_steps)* &
          sequence%wanted
      end do
    end function is_mesh_enough

  end function later_step_runs

  !> The error by load steps with so many divisions, as three runs and more on one mesh say;
  !> negative where none has these.
  function error_on_mesh(sequence, runs, divisions) result(error)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: runs(:) !! the fewest divisions first
    integer, intent(in) :: divisions
    real(wp) :: error
    type(convergence_t) :: observed
    real(wp), allocatable :: scales(:)
    real(wp) :: of_quantity
    integer :: k, n, mine, n_rising

    error = -1.0_wp
    n = size(runs)
    mine = findloc(sequence%runs(runs)%divisions, divisions, dim=1)
    if (mine == 0) return
    scales = error_scales(sequence%list, sequence%runs(runs(n))%values)
    error = 0.0_wp
    do k = 1, size(sequence%list)
      call follow_sizes(sequence, runs, 1.0_wp/real(sequence%runs(runs)%divisions, wp), k, &
        scales(k), observed, n_rising)
      of_quantity = observed%error
      if (corrects_steps(sequence)) then
        of_quantity = left_of_error*observed%error + (growth_of_error(sequence, runs) - 1.0_wp)* &
          size_of(step_correction(sequence, runs, k, mine), scales(k))
      else
        if (mine < n) of_quantity = of_quantity + change(sequence, k, scales(k), runs(mine), &
          runs(n))
        of_quantity = of_quantity*growth_of_error(sequence, runs)
      end if
      error = max(error, of_quantity)
    end do
  end function error_on_mesh

  !> What load steps make on finer meshes, at most, over what they make on that of some runs.
  pure real(wp) function growth_of_error(sequence, runs) result(growth)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: runs(:)
    real(wp), parameter :: less = 1.0_wp - 1.0e-6_wp

    growth = on_finer_mesh
    associate (mesh => sequence%runs(runs(1))%mesh_size)
      if (mesh%zone%times > 0) then
        if (.not. corrects_steps(sequence)) growth = 1.0_wp
      else if (relative_size(mesh) >= less*relative_size(sequence%trial)) then
        growth = on_coarse_mesh
      end if
    end associate
  end function growth_of_error

  !> Whether what load steps make is taken off: they are then as wrong as that differs from mesh to
  !> mesh, and as increments without size are.
  pure logical function corrects_steps(sequence)
    type(mesh_sequence_t), intent(in) :: sequence

    corrects_steps = sequence%extrapolates .and. sequence%divides .and. .not. has_bound(sequence)
  end function corrects_steps

  !> What a quantity would change with increments without size, as three runs and more on one mesh
  !> say: from one of them to the last, and from there to the limit.
  pure function step_correction(sequence, runs, k, mine) result(correction)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: runs(:) !! the fewest divisions first
    integer, intent(in) :: k       !! the quantity
    integer, intent(in) :: mine    !! which of them
    real(wp) :: correction(sequence%list(k)%n, sequence%n_increments)
    type(convergence_t) :: observed
    integer :: n, n_rising

    n = size(runs)
    call follow_sizes(sequence, runs, 1.0_wp/real(sequence%runs(runs)%divisions, wp), k, 1.0_wp, &
      observed, n_rising)
    associate (a => sequence%list(k)%first, b => sequence%list(k)%first + sequence%list(k)%n - 1, &
      all => sequence%runs)
      correction = all(runs(n))%values(a:b, :) - all(runs(mine))%values(a:b, :)
      correction = correction + observed%weight*(all(runs(n))%values(a:b, :) - &
        all(runs(n - 1))%values(a:b, :))
    end associate
  end function step_correction

  !> The largest of a quantity's differences over the increments, as a part of its scale.
  pure real(wp) function size_of(difference, scale)
    real(wp), intent(in) :: difference(:, :) !! (n,n_increments)
    real(wp), intent(in) :: scale

    size_of = maxval(norm2(difference, dim=1))
    if (scale > 0.0_wp) size_of = size_of/scale
  end function size_of

end module step_errors_mod
