!> Number kinds used everywhere.
module kinds_mod
  use, intrinsic :: iso_fortran_env, only: int8, int32, int64, real32, real64
  implicit none
  private

  public :: wp, sp, i1, i4, i8

  integer, parameter :: wp = real64 !! working precision
  integer, parameter :: sp = real32 !! single precision, where a deck asks for it
  integer, parameter :: i1 = int8   !! flags in files
  integer, parameter :: i4 = int32  !! counts in files
  integer, parameter :: i8 = int64  !! sizes that may pass 2**31

end module kinds_mod
