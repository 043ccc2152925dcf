!> Products with a panel of a matrix, for processors with AVX2 and FMA: src/CMakeLists.txt compiles
!> this file for them.
module panels_avx2_mod
  use kinds_mod, only: sp
  implicit none
  private

  public :: add_panel, columns, rows

  include 'add_panel.inc'

end module panels_avx2_mod
