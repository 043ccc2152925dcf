!> MUMPS in double precision: its structure and its one procedure.
module mumps_double_mod
  implicit none
  private

  public :: dmumps_struc, dmumps, arithmetic, remedy

  include 'dmumps_struc.h'

  character(*), parameter :: arithmetic = 'double precision'
  character(*), parameter :: remedy = '' !! for a matrix that this arithmetic does not hold

  interface
    subroutine dmumps(id)
      import :: dmumps_struc
      implicit none
      type(dmumps_struc), intent(inout) :: id
    end subroutine dmumps
  end interface

end module mumps_double_mod
