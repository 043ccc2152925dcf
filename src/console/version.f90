!> The program's version, as in CMakeLists.txt (a test compares them).
module version_mod
  implicit none
  private

  public :: version

  character(*), parameter :: version = '0.2.0'

end module version_mod
