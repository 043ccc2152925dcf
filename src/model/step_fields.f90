!> Tensor fields, and when fields are written.
module step_fields_mod
  use kinds_mod, only: wp
  implicit none
  private

  public :: tensor_field_t, fields_due

  !> A symmetric tensor over the bodies, XX YY ZZ XY YZ XZ. What is not asked for is not allocated.
  type :: tensor_field_t
    real(wp), allocatable :: at_centroids(:, :)       !! (6, n_elements) mean of each element
    real(wp), allocatable :: at_gauss_points(:, :)    !! (6, points) element by element
    real(wp), allocatable :: at_nodes(:, :)           !! (6, n_nodes) averaged over the elements
  end type tensor_field_t

contains

  !> Say whether the fields of an increment reach the result file.
  pure logical function fields_due(frequency, increment, is_last) result(due)
    integer, intent(in) :: frequency    !! every so many increments, and the last; below 1: never
    integer, intent(in) :: increment
    !! its number among the deck's of its step, from 1; -1 for extra ones, written with every one
    logical, intent(in) :: is_last      !! of its step

    due = frequency > 0
    if (due) due = mod(increment, frequency) == 0 .or. is_last
  end function fields_due

end module step_fields_mod
