!> What a kind that a procedure does not know gives: no number.
!>
!> Kinds are numbers. Where a new one is forgotten the procedure must not take it for another: what
!> follows from a NaN is neither solved nor certified.
module undefined_mod
  use kinds_mod, only: wp, i8
  implicit none
  private

  public :: undefined

  real(wp), parameter :: undefined = transfer(9221120237041090560_i8, 1.0_wp) !! a quiet NaN

end module undefined_mod
