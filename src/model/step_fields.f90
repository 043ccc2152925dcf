!> The fields of an increment that are not part of its state: made only when they are written.
module step_fields_mod
  use kinds_mod, only: wp
  implicit none
  private

  public :: step_fields_t, tensor_field_t, fields_due

  !> A symmetric tensor over the bodies, XX YY ZZ XY YZ XZ. What is not asked for is not allocated.
  type :: tensor_field_t
    real(wp), allocatable :: at_centroids(:, :)       !! (6, n_elements) mean of each brick
    real(wp), allocatable :: at_gauss_points(:, :, :) !! (6, 8, n_elements) points as the nodes
    real(wp), allocatable :: at_nodes(:, :)           !! (6, n_nodes) averaged over the bricks
  end type tensor_field_t

  !> What is not asked for is not allocated.
  type :: step_fields_t
    real(wp), allocatable :: reaction_force(:, :) !! (3, n_nodes) of the supports [force]
    type(tensor_field_t)  :: stress               !! [force/length^2]
    type(tensor_field_t)  :: strain               !! shear as tensor components [-]
    real(wp), allocatable :: mesh_error(:)        !! (n_elements) of the stresses [energy]
  end type step_fields_t

contains

  !> Say whether the fields of an increment reach the result file.
  pure function fields_due(frequency, increment, is_last) result(due)
    integer, intent(in) :: frequency    !! every so many increments, and the last; below 1: never
    integer, intent(in) :: increment
    !! its number among the deck's of its step, from 1; -1 for extra ones, written with every one
    logical, intent(in) :: is_last      !! of its step
    logical :: due

    due = frequency > 0
    if (due) due = mod(increment, frequency) == 0 .or. is_last
  end function fields_due

end module step_fields_mod
