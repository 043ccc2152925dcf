!> What the runs of a sequence say of the error of one of them.
!>
!> docs/theory.md section 10.
module sequence_error_mod
  use kinds_mod, only: wp
  use mesh_size_mod, only: relative_size
  use measured_quantities_mod, only: error_scales
  use mesh_sequence_mod, only: mesh_sequence_t, family_t, mesh_runs, change, family_of, &
    fewest_divisions, sizes_of
  use cut_runs_mod, only: find_base, runs_on_base
  use convergence_mod, only: convergence_t, assume_first_order, safety_of_two, about_twice, &
    order_of_elements
  use sequence_limits_mod, only: has_limit, error_of_limit, error_of_turn, find_limit
  use follow_sizes_mod, only: follow_sizes
  use step_errors_mod, only: error_by_steps, runs_for_steps, error_by_transfer
  use step_limits_mod, only: corrects_steps, step_correction
  implicit none
  private

  public :: sequence_error_t, estimate_sequence, total_error, is_enough, is_enough_but_steps, &
    extrapolated, extrapolated_error, estimate_cuts

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
    logical, allocatable :: turns(:)
    !! (n_quantities) whether its error is that of values that turn
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
    integer, allocatable :: runs(:), divided(:)
    integer :: k, n

    if (present(family)) then
      runs = mesh_runs(sequence, family)
    else
      runs = mesh_runs(sequence, family_of(sequence%runs(size(sequence%runs))))
    end if
    n = size(runs)
    if (n == 0) return
    mine = family_of(sequence%runs(runs(n)))
    divided = runs
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
    allocate (errors%turns(size(sequence%list)), source=.false.)
    do k = 1, size(sequence%list)
      if (n == 2) then
        errors%of_mesh(k) = assume_first_order(sizes_of(sequence, runs), change(sequence, k, &
          scales(k), runs(1), runs(2)))
        cycle
      end if
      call follow_sizes(sequence, runs, sizes_of(sequence, runs), order_of_elements, k, scales(k), &
        errors%of_mesh(k), errors%n_rising(k))
      associate (more => error_by_transfer(sequence, k, scales(k), runs(n)))
        errors%of_mesh(k)%error = min(errors%of_mesh(k)%error + more, error_by_divided(sequence, &
          divided, k, scales(k)))
        if (.not. has_limit(sequence, runs)) cycle
        errors%of_limit(k) = error_of_limit(sequence, runs, k, scales(k)) + more
      end associate
      associate (turned => error_of_turn(sequence, runs, k, scales(k)))
        errors%turns(k) = turned > errors%of_mesh(k)%error
        errors%of_mesh(k)%error = max(errors%of_mesh(k)%error, turned)
      end associate
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

    !> Whether two meshes say something: another witness does, on elements that are not too few for
    !> it.
    pure logical function two_are_enough(last)
      integer, intent(in) :: last

      two_are_enough = sequence%recovers .and. relative_size(sequence%runs(last)%mesh_size) <= &
        relative_size(sequence%trial)
    end function two_are_enough

  end subroutine estimate_sequence

  !> All that is known of a run's error; negative where that by the mesh is not known.
  pure real(wp) function total_error(errors) result(error)
    type(sequence_error_t), intent(in) :: errors

    error = -1.0_wp
    if (errors%mesh >= 0.0_wp) error = errors%mesh + max(0.0_wp, errors%load_steps) + errors%others
  end function total_error

  !> Whether the errors of a run are no more than the accuracy, and all are known.
  pure logical function is_enough(sequence, errors)
    type(mesh_sequence_t), intent(in) :: sequence
    type(sequence_error_t), intent(in) :: errors

    is_enough = is_enough_but_steps(sequence, errors) .and. (errors%load_steps >= 0.0_wp .or. &
      .not. sequence%remembers)
  end function is_enough

  !> The same, whether or not what load steps make is known.
  pure logical function is_enough_but_steps(sequence, errors) result(is_enough)
    type(mesh_sequence_t), intent(in) :: sequence
    type(sequence_error_t), intent(in) :: errors

    associate (error => total_error(errors))
      is_enough = error >= 0.0_wp .and. error <= sequence%wanted
    end associate
  end function is_enough_but_steps

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

  !> The error that meshes with the same divisions of increments show by themselves, where there are
  !> three sizes that are far enough apart; else a huge one.
  pure real(wp) function error_by_divided(sequence, runs, k, scale) result(error)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: runs(:) !! of a family, the coarsest first
    integer, intent(in) :: k       !! the quantity
    real(wp), intent(in) :: scale
    type(convergence_t) :: observed
    integer :: n, n_rising

    error = huge(1.0_wp)
    n = size(runs)
    if (n < 3 .or. sequence%runs(runs(n))%divisions == 1) return
    associate (h => sizes_of(sequence, runs))
      if (h(1) < about_twice*h(n)) return
      call follow_sizes(sequence, runs, h, order_of_elements, k, scale, observed, n_rising)
    end associate
    error = observed%error
  end function error_by_divided

  !> The least that the errors of largest values are: what they change by to the next one, across a
  !> element. Where coarse meshes agree by accident on what grows without end, at an edge
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
        errors(k) = maxval(abs(values(sequence%list(k)%first, :) - values(next, :)))/scales(k)
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
    errors%turns = spread(.false., 1, size(near))
  end subroutine take_cuts

  !> What is wrong with a run whose elements at contact were cut again and again on one mesh: of
  !> these elements by how it converged with their size, of all others by what half their size
  !> changed where those at contact were alike.
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
      call follow_sizes(sequence, runs, [(0.5_wp**i, i=0, size(runs) - 1)], &
        order_of_elements, k, scales(k), near(k), n_rising(k))
      far(k) = (1.0_wp + safety_of_two*half_size/(1.0_wp - half_size))*change(sequence, k, &
        scales(k), runs(2), half)
    end do
  end subroutine estimate_cuts

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

  !> The values of a quantity's components, extrapolated to elements without size; those of the last
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
      of_steps = runs_for_steps(sequence, family_of(last))
      if (size(of_steps) >= 3) then
        associate (mine => findloc(sequence%runs(of_steps)%divisions, last%divisions, dim=1))
          if (mine > 0 .and. corrects_steps(sequence, of_steps)) values = values + &
            step_correction(sequence, of_steps, k, mine)
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
