!> What the runs of a sequence say of the error of one of them.
!>
!> docs/theory.md section 10.
module sequence_error_mod
  use kinds_mod, only: wp
  use mesh_size_mod, only: relative_size, is_of_deck
  use measured_quantities_mod, only: error_scales
  use mesh_sequence_mod, only: mesh_sequence_t, family_t, mesh_runs, change, family_of, &
    fewest_divisions, sizes_of, values_in
  use cut_runs_mod, only: find_base, runs_on_base
  use convergence_mod, only: convergence_t, assume_first_order, safety, safety_of_two, &
    about_twice, order_of_elements
  use sequence_limits_mod, only: has_limit, error_of_turn, find_limit
  use follow_sizes_mod, only: follow_sizes
  use step_errors_mod, only: errors_on_mesh, runs_for_steps, error_by_transfer, with_inferred
  use step_limits_mod, only: corrects_steps, is_coarse, step_correction, error_of_corrected, &
    size_of
  implicit none
  private

  public :: sequence_error_t, estimate_sequence, speaks_alone, says_of_steps, take_steps, &
    total_error, by_elements, is_enough, is_enough_but_steps, extrapolated, extrapolated_error, &
    estimate_cuts

  !> Where finer meshes lead.
  type :: course_t
    real(wp), allocatable :: off(:, :)
    !! (n_components,n_increments) from the last mesh to there, as parts of the scale [-]
    real(wp) :: error = 0.0_wp !! of that [-]
  end type course_t

  !> What is known of the last run's error.
  type :: sequence_error_t
    real(wp) :: mesh = -1.0_wp
    !! of the worst quantity, of its extrapolated value where that is what the accuracy is of;
    !! negative: not known [-]
    real(wp) :: load_steps = -1.0_wp !! the largest of all quantities [-]
    real(wp) :: together = -1.0_wp
    !! of the worst quantity by both, added as vectors where their directions are known [-]
    real(wp) :: others = 0.0_wp      !! contact and arithmetic [-]
    real(wp) :: geometry = 0.0_wp
    !! faces that are entered between nodes, and edges within faces, as the run says it [-]
    real(wp) :: facets = 0.0_wp
    !! flat faces that stand for arcs, which finer meshes of the same faces leave as they are [-]
    integer  :: worst = 0            !! the quantity whose error by both is the largest
    real(wp) :: least = 0.0_wp       !! that another witness leaves to the mesh [-]
    real(wp), allocatable :: scales(:)   !! (n_quantities)
    real(wp), allocatable :: of_steps(:) !! (n_quantities) negative: not known [-]
    type(course_t), allocatable :: courses(:, :)
    !! (2,n_quantities) by (10.10) and by (10.18), where they are known
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
  subroutine estimate_sequence(made, errors, family)
    type(mesh_sequence_t), intent(in) :: made !! a run at least
    type(sequence_error_t), intent(out) :: errors
    type(family_t), intent(in), optional :: family
    !! of the last run of it; left out: of the last run
    type(mesh_sequence_t) :: sequence
    type(family_t) :: mine
    integer, allocatable :: runs(:), divided(:)
    integer :: n

    sequence = with_inferred(made)
    mine = family_of(sequence%runs(size(sequence%runs)))
    if (present(family)) mine = family
    runs = mesh_runs(sequence, mine)
    if (size(runs) == 0) return
    divided = runs
    call take_undivided(sequence, runs)
    n = size(runs)
    associate (last => sequence%runs(runs(n)))
      errors%others = last%others
      ! What is not known may be all of it.
      errors%geometry = sum(min(last%geometry(:2), 1.0_wp))
      errors%facets = min(last%geometry(3), 1.0_wp)
      errors%scales = error_scales(sequence%list, last%values)
    end associate
    if (are_enough(sequence, runs)) then
      call compare_meshes(sequence, runs, divided, errors)
      call add_up(sequence, errors)
      call take_cuts(sequence, runs(n), errors)
    else
      call take_cuts(sequence, runs(n), errors)
      if (speaks_alone(sequence, 1)) call take_alone(sequence, errors)
    end if
    call take_steps_of(sequence, mine, runs(n), errors)
  end subroutine estimate_sequence

  !> Whether meshes say something of each other: two do where another witness agrees, on elements
  !> that are not too few for it.
  pure logical function are_enough(sequence, runs)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: runs(:) !! of a family, the coarsest first

    are_enough = size(runs) > 2
    if (size(runs) == 2) are_enough = sequence%recovers .and. relative_size(sequence%runs( &
      runs(2))%mesh_size) <= relative_size(sequence%trial)
  end function are_enough

  !> The error of each quantity on the last of several meshes, by what it changed from mesh to mesh.
  subroutine compare_meshes(sequence, runs, divided, errors)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: runs(:)    !! of a family, the coarsest first
    integer, intent(in) :: divided(:) !! likewise, with divided increments where there are such
    type(sequence_error_t), intent(inout) :: errors !! its scales are known
    real(wp) :: scales(size(errors%scales))
    integer :: k, n

    n = size(runs)
    scales = errors%scales
    allocate (errors%of_mesh(size(sequence%list)))
    allocate (errors%of_limit(size(sequence%list)), source=-1.0_wp)
    allocate (errors%n_rising(size(sequence%list)), source=0)
    allocate (errors%turns(size(sequence%list)), source=.false.)
    allocate (errors%courses(2, size(sequence%list)))
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
        call follow_limit(k, more)
      end associate
      if (has_limit(sequence, runs)) then
        associate (turned => error_of_turn(sequence, runs, k, scales(k)))
          errors%turns(k) = turned > errors%of_mesh(k)%error
          errors%of_mesh(k)%error = max(errors%of_mesh(k)%error, turned)
        end associate
      end if
      call follow_order(k)
    end do
    associate (beside => errors_beside(sequence, runs(n), scales))
      errors%of_mesh%error = max(errors%of_mesh%error, beside)
      where (errors%of_limit >= 0.0_wp) errors%of_limit = max(errors%of_limit, beside)
      errors%courses%error = max(errors%courses%error, spread(beside, 1, 2))
    end associate
    if (.not. sequence%extrapolates) then
      do k = 1, size(sequence%list)
        call follow_no_farther(errors%courses(2, k), errors%of_mesh(k)%error)
      end do
    end if
    ! Two meshes may be alike by accident, and so may those that are finer in some places: another
    ! witness must say so.
    associate (last => sequence%runs(runs(n)))
      if (n == 2 .or. last%mesh_size%zone%times > 0) errors%least = last%recovery
    end associate

  contains

    !> The limit of a quantity, where there are enough meshes for one.
    subroutine follow_limit(k, more)
      integer, intent(in) :: k
      real(wp), intent(in) :: more !! error in what divisions of increments change on the mesh [-]
      real(wp) :: limit(sequence%list(k)%n, sequence%n_increments), error

      if (.not. has_limit(sequence, runs)) return
      call find_limit(sequence, runs, k, scales(k), limit, error)
      errors%of_limit(k) = error + more
      if (.not. sequence%list(k)%is_compared) return
      errors%courses(2, k) = course_t((limit - values_in(sequence, runs(n), k))/unit(scales(k)), &
        errors%of_limit(k))
    end subroutine follow_limit

    !> Where the order that is observed leads; a course to which the error leaves no margin is
    !> followed less far.
    subroutine follow_order(k)
      integer, intent(in) :: k
      real(wp) :: far

      if (.not. sequence%list(k)%is_compared) return
      associate (observed => errors%of_mesh(k), course => errors%courses(1, k))
        course%off = observed%weight*(values_in(sequence, runs(n), k) - values_in(sequence, &
          runs(n - 1), k))/unit(scales(k))
        far = size_of(course%off, 1.0_wp)
        if (safety*far > observed%error) course%off = course%off*observed%error/(safety*far)
        course%error = observed%error - size_of(course%off, 1.0_wp)
      end associate
    end subroutine follow_order

    !> The last mesh is no farther off than a limit, and what is not known of that. docs/theory.md
    !> (10.27).
    subroutine follow_no_farther(course, of_mesh)
      type(course_t), intent(in) :: course
      real(wp), intent(inout) :: of_mesh

      if (allocated(course%off)) of_mesh = min(of_mesh, size_of(course%off, 1.0_wp) + course%error)
    end subroutine follow_no_farther

  end subroutine compare_meshes

  !> All that is known of a run's error; negative where that by the mesh is not known. What meshes
  !> change and what the last one says of its geometry do not see the same, as in the error of a
  !> run alone: the root of the squares counts. docs/theory.md section 10.
  pure real(wp) function total_error(errors) result(error)
    type(sequence_error_t), intent(in) :: errors

    error = -1.0_wp
    if (errors%mesh >= 0.0_wp) error = errors%together - errors%mesh + errors%others + &
      by_elements(errors)
  end function total_error

  !> What smaller elements make smaller, and facets.
  pure real(wp) function by_elements(errors) result(error)
    type(sequence_error_t), intent(in) :: errors !! that by the mesh is known

    error = norm2([errors%mesh, errors%geometry + errors%facets])
  end function by_elements

  !> Whether there are no more than so many runs, on the mesh that the deck writes down: it is no
  !> coarse one that leads to others, and its first run says by itself how wrong it is.
  pure logical function speaks_alone(sequence, n_runs)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: n_runs

    speaks_alone = size(sequence%runs) == n_runs .and. sequence%recovers .and. sequence%wanted > &
      0.0_wp .and. is_of_deck(sequence%first) .and. all(sequence%runs%alone >= 0.0_wp)
  end function speaks_alone

  !> Whether the next run estimates its load steps itself: what they make is found by runs of
  !> several sizes of them, but where the first may do.
  pure logical function says_of_steps(sequence)
    type(mesh_sequence_t), intent(in) :: sequence

    says_of_steps = .not. (sequence%divides .and. sequence%asked > 0.0_wp) .or. &
      speaks_alone(sequence, 0)
  end function says_of_steps

  !> Take what the only run says of its mesh: a part of the largest force, and as much more of what
  !> presses less.
  pure subroutine take_alone(sequence, errors)
    type(mesh_sequence_t), intent(in) :: sequence
    type(sequence_error_t), intent(inout) :: errors
    real(wp), dimension(size(sequence%list)) :: force, error
    integer :: k

    force = errors%scales/sequence%list%factor
    error = safety_of_two*sequence%runs(1)%alone
    where (force > 0.0_wp .and. .not. sequence%list%is_share) error = error*maxval(force, &
      mask=.not. sequence%list%is_share)/force
    errors%of_mesh = [(convergence_t(error=error(k)), k=1, size(force))]
    errors%of_limit = spread(-1.0_wp, 1, size(force))
    errors%n_rising = spread(0, 1, size(force))
    errors%turns = spread(.false., 1, size(force))
  end subroutine take_alone

  !> Take what load steps make in a family.
  subroutine take_steps_of(sequence, family, run, errors)
    type(mesh_sequence_t), intent(in) :: sequence
    type(family_t), intent(in) :: family
    integer, intent(in) :: run !! of it, that says of its load steps itself
    type(sequence_error_t), intent(inout) :: errors

    associate (last => sequence%runs(run))
      if (sequence%divides .and. .not. speaks_alone(sequence, 1)) then
        call take_steps(sequence, runs_for_steps(sequence, family), family%divisions, errors)
        ! Too little time to divide increments leaves what the run itself says of them.
        if (sequence%wanted > 0.0_wp .or. maxval([errors%of_steps, -1.0_wp]) >= 0.0_wp) return
        errors%of_steps = last%load_steps
      else
        ! A run says it as a part of the largest resultant, and it may be in the friction alone.
        errors%of_steps = spread(last%load_steps/minval([1.0_wp, sequence%list%factor]), 1, &
          size(sequence%list))
      end if
    end associate
    call add_up(sequence, errors)
  end subroutine take_steps_of

  !> Take what load steps make with some divisions of increments, as runs on one mesh say.
  subroutine take_steps(sequence, runs, divisions, errors)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: runs(:) !! the fewest divisions first; less than three say nothing
    integer, intent(in) :: divisions
    type(sequence_error_t), intent(inout) :: errors
    integer :: mine, k

    errors%of_steps = spread(-1.0_wp, 1, size(sequence%list))
    mine = 0
    if (size(runs) >= 3) mine = findloc(sequence%runs(runs)%divisions, divisions, dim=1)
    if (mine > 0) errors%of_steps = errors_on_mesh(sequence, runs, divisions)
    call add_up(sequence, errors)
    if (mine == 0 .or. .not. allocated(errors%courses) .or. sequence%extrapolates) return
    ! What few points do on the mesh of the first trials may have the other sign on a finer one.
    if (is_coarse(sequence, runs) .or. sequence%runs(runs(1))%mesh_size%zone%times > 0) return
    call add_up(sequence, errors, [(course_t(step_correction(sequence, runs, k, mine)/unit( &
      errors%scales(k)), error_of_corrected(sequence, runs, k, mine, errors%scales(k))), k=1, &
      size(sequence%list))])
  end subroutine take_steps

  !> Add up what mesh and load steps make of each quantity, and find the worst.
  !>
  !> Where both are known with their directions the sum is that of the vectors, and of what is not
  !> known of each. docs/theory.md (10.28).
  pure subroutine add_up(sequence, errors, steps)
    type(mesh_sequence_t), intent(in) :: sequence
    type(sequence_error_t), intent(inout) :: errors
    type(course_t), intent(in), optional :: steps(:)
    !! (n_quantities) from the last run to increments without size
    real(wp) :: mesh(size(sequence%list)), both(size(sequence%list))
    integer :: k, i

    if (allocated(errors%of_steps)) errors%load_steps = maxval([errors%of_steps, merge(-1.0_wp, &
      0.0_wp, size(both) > 0)])
    if (.not. allocated(errors%of_mesh)) return
    errors%mesh = 0.0_wp
    errors%together = 0.0_wp
    if (size(both) == 0) return
    do k = 1, size(mesh)
      mesh(k) = max(errors%least, error_that_counts(sequence, errors, k))
      both(k) = mesh(k)
      if (allocated(errors%of_steps)) both(k) = mesh(k) + max(0.0_wp, errors%of_steps(k))
      if (.not. present(steps)) cycle
      do i = 1, 2
        associate (course => errors%courses(i, k))
          if (allocated(course%off)) both(k) = min(both(k), max(errors%least, size_of(course%off + &
            steps(k)%off, 1.0_wp) + course%error + steps(k)%error))
        end associate
      end do
    end do
    errors%worst = maxloc(both, dim=1)
    errors%mesh = mesh(errors%worst)
    errors%together = both(errors%worst)
  end subroutine add_up

  pure real(wp) function unit(scale)
    real(wp), intent(in) :: scale

    unit = merge(scale, 1.0_wp, scale > 0.0_wp)
  end function unit

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

    is_enough = errors%mesh >= 0.0_wp .and. total_error(errors) <= sequence%wanted
  end function is_enough_but_steps

  !> Where there are more meshes with undivided increments up to that of the last run, these say how
  !> wrong its mesh is: that is not a matter of the increments.
  pure subroutine take_undivided(sequence, runs)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, allocatable, intent(inout) :: runs(:) !! of a family
    integer, allocatable :: others(:)

    associate (last => sequence%runs(runs(size(runs))))
      others = mesh_runs(sequence, family_t(last%mesh_size%zone%times, 1))
      others = pack(others, sizes_of(sequence, others) >= relative_size(last%mesh_size))
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

  !> The least that the errors of largest values are: what they change by to the next one, across
  !> an element. Where coarse meshes agree by accident on what grows without end, at an edge
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
  pure subroutine take_cuts(sequence, run, errors)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: run
    type(sequence_error_t), intent(inout) :: errors
    type(convergence_t), allocatable :: near(:)
    real(wp), allocatable :: far(:)
    integer, allocatable :: n_rising(:)
    real(wp) :: mesh
    integer :: worst

    call estimate_cuts(sequence, run, errors%scales, near, far, n_rising)
    if (size(near) == 0) return
    near%error = near%error + far
    near%error = max(near%error, errors_beside(sequence, run, errors%scales))
    worst = maxloc(near%error, dim=1)
    mesh = max(near(worst)%error, sequence%runs(run)%recovery)
    if (errors%mesh >= 0.0_wp .and. errors%mesh <= mesh) return
    errors%least = sequence%runs(run)%recovery
    errors%of_mesh = near
    errors%of_mesh%weight = 0.0_wp
    if (allocated(errors%courses)) deallocate (errors%courses)
    errors%of_limit = spread(-1.0_wp, 1, size(near))
    errors%n_rising = n_rising
    errors%turns = spread(.false., 1, size(near))
    call add_up(sequence, errors)
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
  pure function extrapolated(made, errors, k) result(values)
    type(mesh_sequence_t), intent(in) :: made
    type(sequence_error_t), intent(in) :: errors
    integer, intent(in) :: k !! the quantity
    real(wp), allocatable :: values(:, :) !! (n,n_increments)
    integer, allocatable :: runs(:), of_steps(:)
    real(wp), allocatable :: limit(:, :)
    real(wp) :: scales(size(made%list)), error
    type(mesh_sequence_t) :: sequence

    sequence = with_inferred(made)
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
