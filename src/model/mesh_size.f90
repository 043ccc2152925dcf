!> How fine the mesh of a deck is made, beside what the deck says.
module mesh_size_mod
  use kinds_mod, only: wp
  implicit none
  private

  public :: mesh_size_t, relative_size, blocks_t

  !> A mesh of the deck: that which it writes down, of other blocks, refined.
  type :: mesh_size_t
    integer :: blocks(2) = [1, 1]
    !! of the bricks along each axis of each *BLOCK there are blocks(1)/blocks(2) times as many
    integer :: parts = 1 !! into which every edge of a brick is cut
  end type mesh_size_t

  !> The blocks of a deck that may have more or fewer bricks without its saying something else.
  type :: blocks_t
    integer :: common = 0  !! divides their NX, NY and NZ, the largest number; 0: none may
    integer :: longest = 0 !! the largest of their NX, NY and NZ
  end type blocks_t

contains

  !> The edge of a brick over that of the deck's.
  pure real(wp) function relative_size(mesh_size)
    type(mesh_size_t), intent(in) :: mesh_size

    relative_size = real(mesh_size%blocks(2), wp)/(real(mesh_size%blocks(1), wp)* &
      real(mesh_size%parts, wp))
  end function relative_size

end module mesh_size_mod
