!> A factor in single precision.
module single_factor_mod
  use, intrinsic :: iso_c_binding, only: c_loc
  use kinds_mod, only: wp, i8, mp => sp
  use errors_mod, only: error_t, raise, exit_not_solved, exit_machine
  use resource_limits_mod, only: check_library_room
  use text_mod, only: to_text
  use controls_mod, only: precision_controls_t
  use parallel_mod, only: n_ranks, communicator, announce, all_ranks, broadcast_text, &
    task => task_single
  use assembly_mod, only: triplets_t, scales_of
  use mumps_single_mod, only: mumps_struc => smumps_struc, mumps => smumps, arithmetic, remedy
  implicit none
  private

  public :: mumps_factor_t, participate

  include 'mumps_factor.inc'

end module single_factor_mod
