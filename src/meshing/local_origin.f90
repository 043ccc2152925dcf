!> Where coordinates are counted from. docs/theory.md (12.3).
!>
!> Far from the deck's origin coordinates are rounded by more than what is computed from their
!> differences can bear. There they are counted from a place in the middle of the mesh.
module local_origin_mod
  use kinds_mod, only: wp
  use mesh_draft_mod, only: mesh_draft_t, not_a_coordinate
  implicit none
  private

  public :: move_origin

  ! Differences to a place inside a mesh that is farther away than this are exact. [-]
  real(wp), parameter :: far = 2.0_wp

contains

  !> Count the coordinates of nodes from a place in the middle of the mesh, along axes along which
  !> all of the mesh is farther from the origin than twice its size.
  !>
  !> The place is a multiple of a power of two not below the size of the mesh: differences to it are
  !> exact for nodes of elements and correctly rounded for others.
  pure subroutine move_origin(mesh, used)
    type(mesh_draft_t), intent(inout) :: mesh !! its nodes are moved, and origin set
    logical, intent(in) :: used(:)            !! (n_nodes) whether elements have the node
    real(wp) :: low(3), high(3), extent, grid
    integer :: node, i

    if (.not. any(used(:mesh%n_nodes))) return
    low = huge(low)
    high = -huge(high)
    do node = 1, mesh%n_nodes
      if (.not. used(node)) cycle
      low = min(low, mesh%coordinates(:, node))
      high = max(high, mesh%coordinates(:, node))
    end do
    extent = maxval(high - low)
    ! After a mistake nothing is computed.
    if (.not. (extent > 0.0_wp .and. maxval(high) < not_a_coordinate)) return
    grid = scale(1.0_wp, exponent(extent))
    where (max(low, -high) > far*extent) mesh%origin = grid*anint((0.5_wp*low + 0.5_wp*high)/grid)
    do i = 1, 3
      mesh%coordinates(i, :mesh%n_nodes) = mesh%coordinates(i, :mesh%n_nodes) - mesh%origin(i)
    end do
  end subroutine move_origin

end module local_origin_mod
