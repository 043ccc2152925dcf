!> Limits of what the runs of a sequence give, as their elements get smaller.
module sequence_limits_mod
  use kinds_mod, only: wp
  use mesh_sequence_mod, only: mesh_sequence_t, sizes_of, values_in
  use extrapolation_mod, only: extrapolate, error_after_turn, fewest_meshes
  implicit none
  private

  public :: has_limit, error_of_turn, find_limit

contains

  !> Whether there are enough meshes for a limit. Elements at contact that are cut ahead of the
  !> others have sizes of their own.
  pure logical function has_limit(sequence, runs)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: runs(:) !! the coarsest first

    has_limit = size(runs) >= fewest_meshes
    if (has_limit) has_limit = sequence%runs(runs(size(runs)))%mesh_size%zone%times == 0
  end function has_limit

  !> A quantity with elements without size, by many meshes.
  pure subroutine find_limit(sequence, runs, k, scale, limit, error)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: runs(:) !! the coarsest first
    integer, intent(in) :: k       !! the quantity
    real(wp), intent(in) :: scale
    real(wp), intent(out) :: limit(:, :) !! (n,n_increments)
    real(wp), intent(out) :: error !! relative to the scale

    associate (h => sizes_of(sequence, runs), values => values_of(sequence, runs, k), &
      unit => merge(scale, 1.0_wp, scale > 0.0_wp))
      call extrapolate(h, values, unit, limit, error)
      error = max(error, error_after_turn(h, values, unit, limit))
    end associate
    if (.not. sequence%list(k)%is_compared) error = 0.0_wp
  end subroutine find_limit

  !> How wrong the last mesh is where the course of a quantity over the meshes turns; else 0.
  pure real(wp) function error_of_turn(sequence, runs, k, scale) result(error)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: runs(:) !! the coarsest first
    integer, intent(in) :: k       !! the quantity
    real(wp), intent(in) :: scale

    error = 0.0_wp
    if (.not. sequence%list(k)%is_compared) return
    associate (values => values_of(sequence, runs, k))
      error = error_after_turn(sizes_of(sequence, runs), values, merge(scale, 1.0_wp, scale > &
        0.0_wp), values(:, :, size(runs)))
    end associate
  end function error_of_turn

  !> What the runs have for a quantity.
  pure function values_of(sequence, runs, k) result(values)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: runs(:)
    integer, intent(in) :: k !! the quantity
    real(wp) :: values(sequence%list(k)%n, sequence%n_increments, size(runs))
    integer :: i

    do i = 1, size(runs)
      values(:, :, i) = values_in(sequence, runs(i), k)
    end do
  end function values_of

end module sequence_limits_mod
