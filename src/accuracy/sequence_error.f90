!> What the runs of a sequence say of the error of one of them.
!>
!> docs/theory.md section 10.
module sequence_error_mod
  use kinds_mod, only: wp
  use mesh_size_mod, only: relative_size
  use measured_quantities_mod, only: error_scales
  use mesh_sequence_mod, only: mesh_sequence_t, family_t, has_bound, mesh_runs, change, family_of, &
    step_runs, runs_on_mesh, runs_up_to, fewest_divisions, sizes_of
  use cut_runs_mod, only: find_base, runs_on_base, cuts_for_trials
  use convergence_mod, only: convergence_t, observe_convergence, assume_first_order, &
    fitted_order, error_at_least, error_by_differences, least_order, safety, safety_of_two
  use sequence_limits_mod, only: has_limit, error_of_limit, find_limit
  implicit none
  private

  public :: sequence_error_t, estimate_sequence, error_by_steps, error_on_mesh, extrapolated, &
    extrapolated_error, estimate_cuts, later_step_runs, on_coarse_mesh, part_for_steps

  real(wp), parameter :: on_coarse_mesh = 2.0_wp
  !! times what load steps make there, where few points slide, they make on finer ones at most
  real(wp), parameter :: on_finer_mesh = 1.25_wp !! likewise, of a finer one
  real(wp), parameter :: left_of_error = 0.5_wp !! of values that it is taken off [-]
  real(wp), parameter :: part_for_steps = 0.5_wp !! of the accuracy, that load steps may use up
  real(wp), parameter :: later_size = 0.5_wp
  !! bricks with which increments are tried again that the first trial wants divided, over its own

  !> What is known of the last run's error.
  type :: sequence_error_t
    real(wp) :: mesh = -1.0_wp
    !! of the worst quantity, of its extrapolated value where that is what the accuracy is of;
    !! negative: not known [-]
    real(wp) :: load_steps = -1.0_wp !! likewise [-]
    real(wp) :: others = 0.0_wp      !! contact and arithmetic [-]
    integer  :: worst = 0            !! the quantity whose error by the mesh is the largest
    type(convergence_t), allocatable :: of_mesh(:) !! (n_quantities), error relative to its scale
    real(wp), allocatable :: of_limit(:)
    !! (n_quantities) likewise, of their limits by several meshes; negative: not known. There is
    !! one where there is of_mesh
    integer, allocatable :: n_rising(:)
    !! (n_quantities) how often in a row three meshes did not converge, up to the last
  end type sequence_error_t

contains

  !> What the runs say of the error of one of them.
  subroutine estimate_sequence(sequence, errors, family)
    type(mesh_sequence_t), intent(in) :: sequence !! with a run at least
    type(sequence_error_t), intent(out) :: errors
    type(family_t), intent(in), optional :: family
    !! of the last run of it; left out: of the last run
    type(family_t) :: mine
    real(wp) :: scales(size(sequence%list))
    integer, allocatable :: runs(:)
    integer :: k, n

    if (present(family)) then
      runs = mesh_runs(sequence, family)
    else
      runs = mesh_runs(sequence, family_of(sequence%runs(size(sequence%runs))))
    end if
    n = size(runs)
    if (n == 0) return
    mine = family_of(sequence%runs(runs(n)))
    call take_undivided(sequence, runs)
    n = size(runs)
    associate (last => sequence%runs(runs(n)))
      errors%others = last%others
      scales = error_scales(sequence%list, last%values)
      ! A run says it as a part of the largest resultant, and it may be in the friction alone.
      errors%load_steps = last%load_steps/minval([1.0_wp, sequence%list%factor])
      if (sequence%divides) errors%load_steps = error_by_steps(sequence, mine)
      ! Too little time to divide increments leaves what the run itself says of them.
      if (errors%load_steps < 0.0_wp .and. sequence%wanted <= 0.0_wp) errors%load_steps = &
        last%load_steps
    end associate
    if (n < 2 .or. (n == 2 .and. .not. two_are_enough(runs(max(1, n))))) then
      call take_cuts(sequence, runs(n), scales, errors)
      return
    end if
    allocate (errors%of_mesh(size(sequence%list)))
    allocate (errors%of_limit(size(sequence%list)), source=-1.0_wp)
    allocate (errors%n_rising(size(sequence%list)), source=0)
    do k = 1, size(sequence%list)
      if (n == 2) then
        errors%of_mesh(k) = assume_first_order(sizes_of(sequence, runs), change(sequence, k, &
          scales(k), runs(1), runs(2)))
        cycle
      end if
      call follow_sizes(sequence, runs, sizes_of(sequence, runs), k, scales(k), &
        errors%of_mesh(k), errors%n_rising(k))
      if (has_limit(sequence, runs)) errors%of_limit(k) = error_of_limit(sequence, runs, k, &
        scales(k))
    end do
    errors%mesh = 0.0_wp
    if (size(sequence%list) == 0) return
    associate (beside => errors_beside(sequence, runs(n), scales))
      errors%of_mesh%error = max(errors%of_mesh%error, beside)
      where (errors%of_limit >= 0.0_wp) errors%of_limit = max(errors%of_limit, beside)
    end associate
    errors%worst = maxloc([(error_that_counts(sequence, errors, k), k=1, size(sequence%list))], &
      dim=1)
    errors%mesh = error_that_counts(sequence, errors, errors%worst)
    ! Two meshes may be alike by accident, and so may those that are finer in some places: another
    ! witness must say so.
    associate (last => sequence%runs(runs(n)))
      if (n == 2 .or. last%mesh_size%zone%times > 0) errors%mesh = max(errors%mesh, last%recovery)
    end associate
    call take_cuts(sequence, runs(n), scales, errors)

  contains

    !> Whether two meshes say something: another witness does, on bricks that are not too few for
    !> it.
    pure logical function two_are_enough(last)
      integer, intent(in) :: last

      two_are_enough = sequence%recovers .and. relative_size(sequence%runs(last)%mesh_size) <= &
        relative_size(sequence%trial)
    end function two_are_enough

  end subroutine estimate_sequence

  !> Where there are more meshes with undivided increments up to that of the last run, these say how
  !> wrong its mesh is: that is not a matter of the increments.
  pure subroutine take_undivided(sequence, runs)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, allocatable, intent(inout) :: runs(:) !! of a family
    integer, allocatable :: others(:)
    integer :: i

    associate (last => sequence%runs(runs(size(runs))))
      others = mesh_runs(sequence, family_t(last%mesh_size%zone%times, 1))
      others = pack(others, [(relative_size(sequence%runs(others(i))%mesh_size) >= &
        relative_size(last%mesh_size), i=1, size(others))])
      if (size(others) <= size(runs) .and. size(others) < 3) return
      if (size(others) == 0) return
      if (relative_size(sequence%runs(others(size(others)))%mesh_size) > &
        relative_size(last%mesh_size)) return
    end associate
    runs = others
  end subroutine take_undivided

  !> The least that the errors of largest values are: half of what they change by to the next one,
  !> across a brick. Where coarse meshes agree by accident on what grows without end, at an edge
  !> say, or on what is the largest there alone, that is much.
  pure function errors_beside(sequence, run, scales) result(errors)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: run
    real(wp), intent(in) :: scales(:)
    real(wp) :: errors(size(scales)) !! 0 for quantities that are no largest values
    integer :: k

    errors = 0.0_wp
    do k = 1, size(sequence%list)
      associate (next => sequence%list(k)%beside, values => sequence%runs(run)%values)
        if (next == 0 .or. .not. scales(k) > 0.0_wp) cycle
        errors(k) = 0.5_wp*maxval(abs(values(sequence%list(k)%first, :) - values(next, :)))/ &
          scales(k)
      end associate
    end do
  end function errors_beside

  !> Take what cuts at contact say of a run, where that is less than what other meshes say.
  pure subroutine take_cuts(sequence, run, scales, errors)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: run
    real(wp), intent(in) :: scales(:)
    type(sequence_error_t), intent(inout) :: errors
    type(convergence_t), allocatable :: near(:)
    real(wp), allocatable :: far(:)
    integer, allocatable :: n_rising(:)
    real(wp) :: mesh
    integer :: worst

    call estimate_cuts(sequence, run, scales, near, far, n_rising)
    if (size(near) == 0) return
    near%error = near%error + far
    near%error = max(near%error, errors_beside(sequence, run, scales))
    worst = maxloc(near%error, dim=1)
    mesh = max(near(worst)%error, sequence%runs(run)%recovery)
    if (errors%mesh >= 0.0_wp .and. errors%mesh <= mesh) return
    errors%mesh = mesh
    errors%worst = worst
    errors%of_mesh = near
    errors%of_mesh%weight = 0.0_wp
    errors%of_limit = spread(-1.0_wp, 1, size(near))
    errors%n_rising = n_rising
  end subroutine take_cuts

  !> What is wrong with a run whose bricks at contact were cut again and again on one mesh: of these
  !> bricks by how it converged with their size, of all others by what half their size changed where
  !> those at contact were alike.
  pure subroutine estimate_cuts(sequence, run, scales, near, far, n_rising)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: run
    real(wp), intent(in) :: scales(:) !! of the quantities
    type(convergence_t), allocatable, intent(out) :: near(:)
    !! (n_quantities) relative to the scales; none where the runs say nothing
    real(wp), allocatable, intent(out) :: far(:)
    integer, allocatable, intent(out) :: n_rising(:) !! as of sequence_error_t
    real(wp) :: half_size
    integer, allocatable :: runs(:)
    integer :: base, half, divisions, k, i

    allocate (near(0), far(0), n_rising(0))
    associate (cuts => sequence%runs(run)%mesh_size%zone%times)
      if (cuts < 2) return
      ! What the mesh makes is not a matter of the increments.
      divisions = fewest_divisions(sequence, cuts)
      call find_base(sequence, divisions, base, half)
      if (base == 0) return
      if (relative_size(sequence%runs(run)%mesh_size) < relative_size(sequence%runs( &
        base)%mesh_size)) return
      runs = runs_on_base(sequence, divisions, base, cuts)
      if (size(runs) <= cuts) return
    end associate
    deallocate (near, far, n_rising)
    allocate (near(size(scales)), far(size(scales)), n_rising(size(scales)))
    half_size = relative_size(sequence%runs(half)%mesh_size)/relative_size(sequence%runs( &
      base)%mesh_size)
    do k = 1, size(scales)
      call follow_sizes(sequence, runs, [(0.5_wp**i, i=0, size(runs) - 1)], k, scales(k), &
        near(k), n_rising(k))
      far(k) = (1.0_wp + safety_of_two*half_size/(1.0_wp - half_size))*change(sequence, k, &
        scales(k), runs(2), half)
    end do
  end subroutine estimate_cuts

  !> What three sizes and more, of bricks or of increments, say of the error of the last one: of the
  !> finest as many as span twice its size, and three at least.
  pure subroutine follow_sizes(sequence, all_runs, all_sizes, k, scale, observed, n_rising)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: all_runs(:)   !! the coarsest first
    real(wp), intent(in) :: all_sizes(:) !! theirs [-]
    integer, intent(in) :: k       !! the quantity
    real(wp), intent(in) :: scale
    type(convergence_t), intent(out) :: observed
    integer, intent(out) :: n_rising !! as of sequence_error_t
    integer, parameter :: fitted_to = 4 !! sizes is an order, where there are so many
    real(wp), parameter :: most_fitted = 1.25_wp !! of such an order that is believed
    real(wp), parameter :: widest = 2.0_wp
    !! sizes over the last, beyond which coarser ones are forgotten: what they miss is of its own
    integer, allocatable :: runs(:)
    real(wp), allocatable :: h(:)
    real(wp) :: order, error
    integer :: i, j, n, first

    n = size(all_runs)
    first = max(1, n - 2)
    do while (first > 1 .and. all_sizes(first) < widest*all_sizes(n))
      first = first - 1
    end do
    runs = all_runs(first:)
    h = all_sizes(first:)
    n_rising = 0
    do i = 3, n
      observed = observe_convergence(all_sizes(i - 2:i), [change(sequence, k, scale, &
        all_runs(i - 2), all_runs(i - 1)), change(sequence, k, scale, all_runs(i - 1), &
        all_runs(i))])
      n_rising = merge(0, n_rising + 1, observed%converges)
    end do
    n = size(runs)
    if (size(all_runs) >= fitted_to) then
      first = size(all_runs) - fitted_to + 1
      order = min(most_fitted, fitted_order(all_sizes(first:), all_values(all_runs(first:))))
      if (order > least_order) then
        error = error_by_differences(all_sizes(first:), [(change(sequence, k, scale, &
          all_runs(i), runs(n)), i=first, size(all_runs) - 1)], order)
        if (error < observed%error) observed = convergence_t(order, error, &
          h(n)**order/(h(n - 1)**order - h(n)**order))
        n_rising = 0
      end if
    end if
    ! One that seems to fall faster was met by accident.
    do i = 1, n - 1
      do j = i + 1, n
        observed%error = max(observed%error, error_at_least(h([i, j]), change(sequence, k, scale, &
          runs(i), runs(j)), h(n)))
      end do
    end do
    if (size(all_runs) >= fitted_to) observed%error = min(observed%error, by_distant_sizes())

  contains

    !> The same of four sizes and more, the first of which is about twice the last: what those
    !> differ by that are near each other is how far values scatter, and does not grow beyond that.
    pure real(wp) function by_distant_sizes() result(error)
      real(wp), parameter :: distant = 1.9_wp !! a size over another
      real(wp), allocatable :: sizes(:)
      integer, allocatable :: those(:)
      real(wp) :: order, times
      integer :: first, m, i, j

      error = huge(1.0_wp)
      m = size(all_runs)
      first = m - fitted_to + 1
      do while (first > 1 .and. all_sizes(first) < distant*all_sizes(m))
        first = first - 1
      end do
      if (all_sizes(first) < distant*all_sizes(m)) return
      sizes = all_sizes(first:)
      those = all_runs(first:)
      m = size(those)
      order = min(most_fitted, fitted_order(sizes, all_values(those)))
      if (order <= least_order) return
      error = 0.0_wp
      do i = 1, m - 1
        do j = i + 1, m
          times = error_at_least(sizes([i, j]), 1.0_wp, sizes(m))
          if (j == m) times = max(times, error_by_differences(sizes([i, j]), [1.0_wp], order))
          if (sizes(i) < distant*sizes(j)) times = min(times, safety)
          error = max(error, times*change(sequence, k, scale, those(i), those(j)))
        end do
      end do
    end function by_distant_sizes

    !> The quantity's values over the increments, a run a column.
    pure function all_values(runs) result(values)
      integer, intent(in) :: runs(:)
      real(wp) :: values(sequence%list(k)%n*sequence%n_increments, size(runs))
      integer :: i

      associate (a => sequence%list(k)%first, b => sequence%list(k)%first + sequence%list(k)%n - 1)
        do i = 1, size(runs)
          values(:, i) = reshape(sequence%runs(runs(i))%values(a:b, :), [size(values, 1)])
        end do
      end associate
    end function all_values

  end subroutine follow_sizes

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

  !> The error of a quantity that the accuracy is of.
  pure real(wp) function error_that_counts(sequence, errors, k) result(error)
    type(mesh_sequence_t), intent(in) :: sequence
    type(sequence_error_t), intent(in) :: errors !! of its meshes
    integer, intent(in) :: k                     !! the quantity

    error = errors%of_mesh(k)%error
    if (sequence%extrapolates .and. is_limit_better(errors, k)) error = errors%of_limit(k)
  end function error_that_counts

  !> Whether the limit of a quantity is known better than the last mesh has it.
  pure logical function is_limit_better(errors, k)
    type(sequence_error_t), intent(in) :: errors
    integer, intent(in) :: k !! the quantity

    is_limit_better = errors%of_limit(k) >= 0.0_wp .and. errors%of_limit(k) < &
      errors%of_mesh(k)%error
  end function is_limit_better

  !> The values of a quantity's components, extrapolated to bricks without size; those of the last
  !> mesh where an accuracy of extrapolated values knows these better.
  pure function extrapolated(sequence, errors, k) result(values)
    type(mesh_sequence_t), intent(in) :: sequence
    type(sequence_error_t), intent(in) :: errors
    integer, intent(in) :: k !! the quantity
    real(wp), allocatable :: values(:, :) !! (n,n_increments)
    integer, allocatable :: runs(:), of_steps(:)
    real(wp), allocatable :: limit(:, :)
    real(wp) :: scales(size(sequence%list)), error

    associate (a => sequence%list(k)%first, b => sequence%list(k)%first + sequence%list(k)%n - 1, &
      last => sequence%runs(size(sequence%runs)))
      values = last%values(a:b, :)
      if (corrects_steps(sequence)) then
        of_steps = runs_for_steps(sequence, family_of(last))
        associate (mine => findloc(sequence%runs(of_steps)%divisions, last%divisions, dim=1))
          if (size(of_steps) >= 3 .and. mine > 0) values = values + step_correction(sequence, &
            of_steps, k, mine)
        end associate
      end if
      runs = mesh_runs(sequence, family_of(last))
      call take_undivided(sequence, runs)
      if (.not. allocated(errors%of_mesh) .or. size(runs) < 2) return
      associate (undivided => sequence%runs(runs(size(runs)))%values(a:b, :), &
        coarser => sequence%runs(runs(size(runs) - 1))%values(a:b, :))
        if (is_limit_better(errors, k)) then
          scales = error_scales(sequence%list, last%values)
          limit = values
          call find_limit(sequence, runs, k, scales(k), limit, error)
          values = values + (limit - undivided)
        else if (.not. sequence%extrapolates) then
          values = values + errors%of_mesh(k)%weight*(undivided - coarser)
        end if
      end associate
    end associate
  end function extrapolated

  !> The error of these values by the mesh, as a part of the scale; negative where it is not known.
  pure real(wp) function extrapolated_error(sequence, errors, k) result(error)
    type(mesh_sequence_t), intent(in) :: sequence
    type(sequence_error_t), intent(in) :: errors
    integer, intent(in) :: k !! the quantity

    error = -1.0_wp
    if (.not. allocated(errors%of_mesh)) return
    if (is_limit_better(errors, k)) then
      error = errors%of_limit(k)
    else if (sequence%extrapolates) then
      error = errors%of_mesh(k)%error
    end if
  end function extrapolated_error

end module sequence_error_mod
