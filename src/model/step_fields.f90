!> The fields of an increment that are not part of its state: made only when they are written.
module step_fields_mod
  use kinds_mod, only: wp
  implicit none
  private

  public :: step_fields_t, fields_due

  !> What is not asked for is not allocated.
  type :: step_fields_t
    real(wp), allocatable :: reaction_force(:, :) !! (3, n_nodes) of the supports [force]
    real(wp), allocatable :: stress(:, :) !! (6, n_elements) XX YY ZZ XY YZ XZ [force/length^2]
  end type step_fields_t

contains

  !> Say whether the fields of an increment reach the result file.
  pure function fields_due(frequency, increment, n_increments) result(due)
    integer, intent(in) :: frequency    !! every so many increments, and the last; below 1: never
    integer, intent(in) :: increment    !! number within its step, from 1
    integer, intent(in) :: n_increments !! of the step
    logical :: due

    due = frequency > 0
    if (due) due = mod(increment, frequency) == 0 .or. increment >= n_increments
  end function fields_due

end module step_fields_mod
