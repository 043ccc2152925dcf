!> What increments without size would give, as runs on one mesh say whose increments are divided,
!> and how wrong that is.
!>
!> docs/theory.md section 10, (10.19).
module step_limits_mod
  use kinds_mod, only: wp
  use mesh_size_mod, only: relative_size
  use mesh_sequence_mod, only: mesh_sequence_t, has_bound, step_runs, sizes_of, values_in
  use convergence_mod, only: convergence_t, safety, order_of_increments, error_at_least, &
    observe_convergence
  use follow_sizes_mod, only: follow_sizes
  implicit none
  private

  public :: corrects_steps, is_coarse, step_correction, error_of_corrected, growth_of_error, &
    on_coarse_mesh, error_of_difference, size_of

  real(wp), parameter :: on_coarse_mesh = 2.0_wp
  !! times what load steps make there, where few points slide, they make on finer ones at most
  real(wp), parameter :: on_finer_mesh = 1.5_wp !! likewise, of a finer one
  real(wp), parameter :: left_of_error = 0.5_wp !! of values that it is taken off [-]
  integer, parameter :: fewest_runs = 5 !! whose limits of the first order are believed
  real(wp), parameter :: order_of_limits = 2.0_wp !! the highest of these
  real(wp), parameter :: least_part = 0.1_wp
  !! of what they change, however alike on two meshes: these may be so by accident, as least_change

contains

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

  !> What a quantity would change with increments without size, as three runs and more on one mesh
  !> say: from one of them to the limit.
  pure function step_correction(sequence, runs, k, mine) result(correction)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: runs(:) !! the fewest divisions first
    integer, intent(in) :: k       !! the quantity
    integer, intent(in) :: mine    !! which of them
    real(wp) :: correction(sequence%list(k)%n, sequence%n_increments)
    real(wp) :: limit(sequence%list(k)%n, sequence%n_increments), errors(sequence%n_increments)

    call find_step_limit(sequence, runs, k, 1.0_wp, limit, errors)
    correction = limit - values_in(sequence, runs(mine), k)
  end function step_correction

  !> A quantity with increments without size, by three runs and more on one mesh, and the error of
  !> that in each increment: what the order of the last three leaves, or, with five and more, what
  !> limits of the first order do, where that is less.
  pure subroutine find_step_limit(sequence, runs, k, scale, limit, errors)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: runs(:) !! the fewest divisions first
    integer, intent(in) :: k       !! the quantity
    real(wp), intent(in) :: scale
    real(wp), intent(out) :: limit(:, :) !! (n,n_increments)
    real(wp), intent(out) :: errors(:)   !! (n_increments) relative to the scale
    type(convergence_t) :: observed
    real(wp) :: other(size(limit, 1), size(limit, 2)), error
    integer :: n, n_rising

    n = size(runs)
    call follow_sizes(sequence, runs, 1.0_wp/real(sequence%runs(runs)%divisions, wp), &
      order_of_increments, k, scale, observed, n_rising)
    associate (last => values_in(sequence, runs(n), k))
      limit = last + observed%weight*(last - values_in(sequence, runs(n - 1), k))
      errors = observed%error
      ! Sizes that do not converge say less of what is taken off, and where the last change is small
      ! by accident, little is.
      if (n_rising == 0) then
        errors = errors_of_increments(sequence, runs, k, scale, observed)
        errors = max(left_of_error*errors, errors - sizes_of_each(limit - last, scale))
      end if
    end associate
    if (n < fewest_runs) return
    call limit_of_first_order(sequence, runs(n - fewest_runs + 1:), k, scale, other, error)
    if (error < 0.0_wp .or. error >= maxval(errors)) return
    limit = other
    errors = error
  end subroutine find_step_limit

  !> The limit that the last two of five runs have with the first order. Those of two runs each
  !> converge themselves, with a higher order, where the first is the right one: its error is what
  !> (10.10) makes of the last three of them; negative where they do not.
  pure subroutine limit_of_first_order(sequence, runs, k, scale, limit, error)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: runs(fewest_runs) !! the fewest divisions first
    integer, intent(in) :: k                 !! the quantity
    real(wp), intent(in) :: scale
    real(wp), intent(out) :: limit(:, :) !! (n,n_increments)
    real(wp), intent(out) :: error       !! relative to the scale
    type(convergence_t) :: observed
    real(wp) :: h(fewest_runs), limits(size(limit, 1), size(limit, 2), 2:fewest_runs)
    real(wp) :: changes(3:fewest_runs)
    integer :: i

    h = 1.0_wp/real(sequence%runs(runs)%divisions, wp)
    do i = 2, fewest_runs
      associate (last => values_in(sequence, runs(i), k), before => values_in(sequence, &
        runs(i - 1), k))
        limits(:, :, i) = last + h(i)/(h(i - 1) - h(i))*(last - before)
      end associate
    end do
    limit = limits(:, :, fewest_runs)
    error = -1.0_wp
    do i = 3, fewest_runs
      changes(i) = size_of(limits(:, :, i) - limits(:, :, i - 1), scale)
    end do
    do i = 4, fewest_runs
      observed = observe_convergence(h(i - 2:i), changes(i - 1:i), order_of_limits)
      if (.not. observed%converges) return
    end do
    error = observed%error
  end subroutine limit_of_first_order

  !> The error of a quantity from which is taken off what load steps make, the largest of the
  !> increments. docs/theory.md (10.19).
  real(wp) function error_of_corrected(sequence, runs, k, mine, scale) result(error)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: runs(:)   !! on one mesh, the fewest divisions first
    integer, intent(in) :: k         !! the quantity
    integer, intent(in) :: mine      !! which of the runs has the divisions
    real(wp), intent(in) :: scale
    real(wp) :: limit(sequence%list(k)%n, sequence%n_increments)
    real(wp) :: left(sequence%n_increments), off(sequence%n_increments)
    integer :: n

    n = size(runs)
    call find_step_limit(sequence, runs, k, scale, limit, left)
    off = sizes_of_each(limit - values_in(sequence, runs(mine), k), scale)
    left = left + max(part_on_finer_mesh(sequence, runs, k)*max(left, off), &
      from_coarse_mesh(sequence, runs, k, mine, scale))
    if (n > 3 .and. mine < n) left = left + sizes_of_each(step_correction(sequence, runs, k, &
      mine) - step_correction(sequence, runs(:n - 1), k, mine), scale)
    error = maxval(left)
  end function error_of_corrected

  !> By what part of it what is taken off may differ on a finer mesh: where it is known on the mesh
  !> where increments are tried first, too, as that differs, with as many divisions on both.
  pure real(wp) function part_on_finer_mesh(sequence, runs, k) result(part)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: runs(:)   !! on one mesh, the fewest divisions first
    integer, intent(in) :: k         !! the quantity
    integer, allocatable :: coarse(:)
    real(wp) :: here, apart
    integer :: m, n

    part = growth_of_error(sequence, runs) - 1.0_wp
    coarse = step_runs(sequence, 0)
    n = min(size(coarse), size(runs))
    if (n < 3 .or. sequence%runs(runs(1))%mesh_size%zone%times > 0) return
    m = 0
    do while (m < n)
      if (sequence%runs(coarse(m + 1))%divisions /= sequence%runs(runs(m + 1))%divisions) exit
      m = m + 1
    end do
    if (m < 3) return
    associate (h => sizes_of(sequence, [coarse(1), runs(1)]), &
      correction => step_correction(sequence, runs(:m), k, m))
      if (.not. h(1) > h(2)) return
      here = size_of(correction, 1.0_wp)
      apart = size_of(correction - step_correction(sequence, coarse(:m), k, m), 1.0_wp)
      if (here > 0.0_wp) part = min(1.0_wp, max(least_part, error_of_difference(h, apart)/here))
    end associate
  end function part_on_finer_mesh

  !> The error on the finer of two meshes in what increments change, from what that differs by.
  !> docs/theory.md (10.21).
  pure real(wp) function error_of_difference(h, difference) result(error)
    real(wp), intent(in) :: h(2) !! sizes of the elements, descending [-]
    real(wp), intent(in) :: difference
    real(wp), parameter :: most_weight = 1.5_wp !! of what near meshes differ by, which is scatter

    error = safety*min(most_weight, 1.0_wp/(sqrt(h(1)/h(2)) - 1.0_wp))*difference
  end function error_of_difference

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
    errors = safety*abs(observed%weight)*sizes_of_each(values_in(sequence, runs(n), k) - &
      values_in(sequence, runs(n - 1), k), scale)
    do i = n - 2, n - 1
      do j = i + 1, n
        errors = max(errors, error_at_least(h([i, j]), 1.0_wp, h(n), order_of_increments)* &
          sizes_of_each(values_in(sequence, runs(j), k) - values_in(sequence, runs(i), k), scale))
      end do
    end do
    errors = min(errors, observed%error)
  end function errors_of_increments

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

end module step_limits_mod
