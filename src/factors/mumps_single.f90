!> MUMPS in single precision: its structure and its one procedure.
module mumps_single_mod
  implicit none
  private

  public :: smumps_struc, smumps, arithmetic, remedy

  include 'smumps_struc.h'

  character(*), parameter :: arithmetic = 'single precision'
  character(*), parameter :: remedy = '; *PRECISION, FACTOR=DOUBLE holds more'
  !! for a matrix that this arithmetic does not hold

  interface
    subroutine smumps(id)
      import :: smumps_struc
      implicit none
      type(smumps_struc), intent(inout) :: id
    end subroutine smumps
  end interface

end module mumps_single_mod
