!> What load steps make of a result, by runs on one mesh whose increments are divided; how that
!> differs from mesh to mesh.
!>
!> docs/theory.md section 10, (10.19), (10.21).
module step_errors_mod
  use kinds_mod, only: wp
  use mesh_size_mod, only: relative_size
  use measured_quantities_mod, only: error_scales
  use mesh_sequence_mod, only: mesh_sequence_t, family_t, has_bound, mesh_runs, change, &
    step_runs, runs_on_mesh, runs_up_to, sizes_of
  use cut_runs_mod, only: cuts_for_trials
  use convergence_mod, only: convergence_t, safety, about_twice, order_of_bricks, &
    order_of_increments, error_at_least
  use follow_sizes_mod, only: follow_sizes
  implicit none
  private

  public :: error_by_steps, error_on_mesh, later_step_runs, runs_for_steps, corrects_steps, &
    step_correction, error_by_transfer, change_by_divisions, on_coarse_mesh, part_for_steps

  real(wp), parameter :: on_coarse_mesh = 2.0_wp
  !! times what load steps make there, where few points slide, they make on finer ones at most
  real(wp), parameter :: on_finer_mesh = 1.5_wp !! likewise, of a finer one
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
        call follow_sizes(sequence, meshes, sizes_of(sequence, meshes), order_of_bricks, k, &
          scales(k), observed, n_rising)
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
      call follow_sizes(sequence, runs, 1.0_wp/real(sequence%runs(runs)%divisions, wp), &
        order_of_increments, k, scales(k), observed, n_rising)
      of_quantity = observed%error
      if (corrects_steps(sequence, runs)) then
        of_quantity = error_of_corrected(sequence, runs, k, mine, scales(k), observed, n_rising)
      else
        if (mine < n) of_quantity = of_quantity + change(sequence, k, scales(k), runs(mine), &
          runs(n))
        of_quantity = of_quantity*growth_of_error(sequence, runs)
      end if
      error = max(error, of_quantity)
    end do
  end function error_on_mesh

  !> The error of a quantity from which is taken off what load steps make, of each increment by
  !> itself, the largest of them. docs/theory.md (10.19).
  function error_of_corrected(sequence, runs, k, mine, scale, observed, n_rising) result(error)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: runs(:)   !! on one mesh, the fewest divisions first
    integer, intent(in) :: k         !! the quantity
    integer, intent(in) :: mine      !! which of the runs has the divisions
    real(wp), intent(in) :: scale
    type(convergence_t), intent(in) :: observed !! of these runs
    integer, intent(in) :: n_rising             !! likewise
    real(wp) :: error
    real(wp) :: left(sequence%n_increments), off(sequence%n_increments)
    integer :: n

    n = size(runs)
    left = observed%error
    ! Sizes that do not converge say less of what is taken off, and where the last change is small
    ! by accident, little is.
    if (n_rising == 0) then
      left = errors_of_increments(sequence, runs, k, scale, observed)
      left = max(left_of_error*left, left - sizes_of_each(step_correction(sequence, runs, k, n), &
        scale))
    end if
    off = sizes_of_each(step_correction(sequence, runs, k, mine), scale)
    left = left + max((growth_of_error(sequence, runs) - 1.0_wp)*max(left, off), &
      from_coarse_mesh(sequence, runs, k, mine, scale))
    if (n > 3 .and. mine < n) left = left + sizes_of_each(step_correction(sequence, runs, k, &
      mine) - step_correction(sequence, runs(:n - 1), k, mine), scale)
    error = maxval(left)
  end function error_of_corrected

  !> How what is taken off of each increment differs from what would be on the mesh where increments
  !> are tried first, with the most divisions up to those wanted that both meshes have, and from
  !> there with the first order; 0 where it is less than what is taken off, and where that mesh does
  !> not have three runs.
  pure function from_coarse_mesh(sequence, runs, k, mine, scale) result(sizes)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: runs(:)   !! on one mesh, the fewest divisions first
    integer, intent(in) :: k         !! the quantity
    integer, intent(in) :: mine      !! which of the runs has the divisions wanted
    real(wp), intent(in) :: scale
    real(wp) :: sizes(sequence%n_increments)
    integer, allocatable :: coarse(:)
    integer :: here, there

    sizes = 0.0_wp
    coarse = step_runs(sequence, 0)
    if (size(coarse) < 3) return
    if (.not. is_coarse(sequence, coarse)) return
    do here = mine, 1, -1
      there = findloc(sequence%runs(coarse)%divisions, sequence%runs(runs(here))%divisions, dim=1)
      if (there > 0) exit
    end do
    if (here == 0) return
    associate (of_fine => step_correction(sequence, runs, k, here), &
      of_coarse => step_correction(sequence, coarse, k, there))
      sizes = sizes_of_each(of_fine - of_coarse, scale)
      where (sizes <= sizes_of_each(of_fine, scale)) sizes = 0.0_wp
    end associate
    sizes = sizes*real(sequence%runs(runs(here))%divisions, wp)/real(sequence%runs(runs( &
      mine))%divisions, wp)
  end function from_coarse_mesh

  !> The errors of each increment, with the most divisions, from its own changes over the last three
  !> runs, with the order that is observed of all, and no more than the largest error is.
  pure function errors_of_increments(sequence, runs, k, scale, observed) result(errors)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: runs(:) !! three and more on one mesh, the fewest divisions first
    integer, intent(in) :: k       !! the quantity
    real(wp), intent(in) :: scale
    type(convergence_t), intent(in) :: observed !! of these runs
    real(wp) :: errors(sequence%n_increments)
    real(wp) :: h(size(runs))
    integer :: i, j, n

    n = size(runs)
    h = 1.0_wp/real(sequence%runs(runs)%divisions, wp)
    associate (a => sequence%list(k)%first, b => sequence%list(k)%first + sequence%list(k)%n - 1, &
      all => sequence%runs)
      errors = safety*abs(observed%weight)*sizes_of_each(all(runs(n))%values(a:b, :) - &
        all(runs(n - 1))%values(a:b, :), scale)
      do i = n - 2, n - 1
        do j = i + 1, n
          errors = max(errors, error_at_least(h([i, j]), 1.0_wp, h(n), order_of_increments)* &
            sizes_of_each(all(runs(j))%values(a:b, :) - all(runs(i))%values(a:b, :), scale))
        end do
      end do
    end associate
    errors = min(errors, observed%error)
  end function errors_of_increments

  !> What load steps make on finer meshes, at most, over what they make on that of some runs.
  pure real(wp) function growth_of_error(sequence, runs) result(growth)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: runs(:)

    growth = on_finer_mesh
    if (is_coarse(sequence, runs)) then
      growth = on_coarse_mesh
    else if (sequence%runs(runs(1))%mesh_size%zone%times > 0) then
      if (.not. corrects_steps(sequence, runs)) growth = 1.0_wp
    end if
  end function growth_of_error

  !> Whether what load steps make is taken off: they are then as wrong as that differs from mesh to
  !> mesh, and as increments without size are. Not so what they make on the mesh where they are
  !> tried first: a finer one may have it of the other sign.
  pure logical function corrects_steps(sequence, runs)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: runs(:) !! on one mesh, that say it

    corrects_steps = sequence%extrapolates .and. sequence%divides .and. .not. has_bound(sequence)
    if (corrects_steps) corrects_steps = .not. is_coarse(sequence, runs)
  end function corrects_steps

  !> Whether runs are on a mesh no finer than the one on which increments are tried first.
  pure logical function is_coarse(sequence, runs)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: runs(:) !! on one mesh
    real(wp), parameter :: less = 1.0_wp - 1.0e-6_wp

    associate (mesh => sequence%runs(runs(1))%mesh_size)
      is_coarse = mesh%zone%times == 0 .and. relative_size(mesh) >= less*relative_size( &
        sequence%trial)
    end associate
  end function is_coarse

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
    call follow_sizes(sequence, runs, 1.0_wp/real(sequence%runs(runs)%divisions, wp), &
      order_of_increments, k, 1.0_wp, observed, n_rising)
    associate (a => sequence%list(k)%first, b => sequence%list(k)%first + sequence%list(k)%n - 1, &
      all => sequence%runs)
      correction = all(runs(n))%values(a:b, :) - all(runs(mine))%values(a:b, :)
      correction = correction + observed%weight*(all(runs(n))%values(a:b, :) - &
        all(runs(n - 1))%values(a:b, :))
    end associate
  end function step_correction

  !> The error that a mesh makes in what the divisions of increments change, where it is undivided
  !> ones that say what it makes in all else: what these change on it differs from what they change
  !> on a coarser mesh. 0 for a run with divided increments or cuts, and for a mesh that is no finer
  !> than the one on which increments are tried, or on which they are not divided.
  pure real(wp) function error_by_transfer(sequence, k, scale, run) result(error)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: k      !! the quantity
    real(wp), intent(in) :: scale
    integer, intent(in) :: run    !! the last of those that say what the mesh makes
    real(wp), parameter :: most_weight = 1.5_wp !! of what near meshes differ by, which is scatter
    real(wp), parameter :: least_part = 0.1_wp !! of what they change, however alike on both meshes
    integer :: divided, coarse(2)
    real(wp) :: weight

    error = 0.0_wp
    if (.not. sequence%list(k)%is_compared) return
    if (sequence%runs(run)%divisions > 1 .or. sequence%runs(run)%mesh_size%zone%times > 0) return
    associate (tried => runs_for_steps(sequence, family_t()))
      if (size(tried) == 0) return
      if (.not. is_larger(tried(1))) return
    end associate
    call find_runs(divided, coarse)
    if (divided == 0 .or. any(coarse == 0)) return
    weight = 1.0_wp/(sqrt(size_of_run(coarse(1))/size_of_run(run)) - 1.0_wp)
    associate (here => values(divided) - values(run), there => values(coarse(2)) - &
      values(coarse(1)))
      error = max(safety*min(most_weight, weight)*size_of(there - here, scale), &
        least_part*size_of(here, scale))
    end associate

  contains

    !> The run with the most divisions on the mesh, and on a coarser one the undivided run and that
    !> with as many: the finest of those whose bricks are about twice as large, else the coarsest.
    pure subroutine find_runs(divided, coarse)
      integer, intent(out) :: divided, coarse(2)
      integer, allocatable :: alike(:)
      integer :: i

      divided = 0
      coarse = 0
      associate (here => runs_on_mesh(sequence, run))
        if (size(here) > 1) divided = here(size(here))
      end associate
      if (divided == 0) return
      alike = mesh_runs(sequence, family_t(0, sequence%runs(divided)%divisions))
      alike = pack(alike, [(is_larger(alike(i)) .and. undivided_beside(alike(i)) > 0, i=1, &
        size(alike))])
      if (size(alike) == 0) return
      associate (h => sizes_of(sequence, alike))
        i = minloc(h, dim=1, mask=h >= about_twice*size_of_run(run), back=.true.)
        if (i == 0) i = maxloc(h, dim=1, back=.true.)
      end associate
      coarse = [undivided_beside(alike(i)), alike(i)]
    end subroutine find_runs

    !> The undivided run on the mesh of another one; 0: there is none.
    pure integer function undivided_beside(i) result(beside)
      integer, intent(in) :: i

      associate (there => runs_on_mesh(sequence, i))
        beside = there(1)
      end associate
      if (sequence%runs(beside)%divisions > 1) beside = 0
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

    pure function values(i)
      integer, intent(in) :: i
      real(wp) :: values(sequence%list(k)%n, sequence%n_increments)

      associate (a => sequence%list(k)%first)
        values = sequence%runs(i)%values(a:a + sequence%list(k)%n - 1, :)
      end associate
    end function values

  end function error_by_transfer

  !> The most that the divisions of a run change of any quantity, beside the undivided run on its
  !> mesh, as a part of its scale; 0 where there is none.
  pure real(wp) function change_by_divisions(sequence, run) result(most)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: run
    real(wp) :: scales(size(sequence%list))
    integer :: k

    most = 0.0_wp
    scales = error_scales(sequence%list, sequence%runs(run)%values)
    associate (here => runs_on_mesh(sequence, run))
      if (sequence%runs(here(1))%divisions > 1) return
      do k = 1, size(scales)
        if (sequence%list(k)%is_compared) most = max(most, change(sequence, k, scales(k), &
          here(1), run))
      end do
    end associate
  end function change_by_divisions

  !> The largest of a quantity's differences over the increments, as a part of its scale.
  pure real(wp) function size_of(difference, scale)
    real(wp), intent(in) :: difference(:, :) !! (n,n_increments)
    real(wp), intent(in) :: scale

    size_of = maxval(sizes_of_each(difference, scale))
  end function size_of

  !> A quantity's differences in each increment, as parts of its scale.
  pure function sizes_of_each(difference, scale) result(sizes)
    real(wp), intent(in) :: difference(:, :) !! (n,n_increments)
    real(wp), intent(in) :: scale
    real(wp) :: sizes(size(difference, 2))

    sizes = norm2(difference, dim=1)
    if (scale > 0.0_wp) sizes = sizes/scale
  end function sizes_of_each

end module step_errors_mod
