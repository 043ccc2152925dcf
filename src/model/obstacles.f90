!> Rigid obstacles: what a body may touch and cannot enter.
module obstacles_mod
  use kinds_mod, only: wp
  implicit none
  private

  public :: obstacle_t, obstacle_plane

  integer, parameter :: obstacle_plane = 1

  !> A rigid obstacle at rest.
  type :: obstacle_t
    character(:), allocatable :: name
    integer  :: kind = obstacle_plane
    real(wp) :: point(3) = 0.0_wp   !! plane: any point of it [length]
    real(wp) :: normal(3) = 0.0_wp  !! plane: unit normal, from the obstacle to the body [-]
  end type obstacle_t

end module obstacles_mod
