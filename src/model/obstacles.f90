!> Rigid obstacles: what a body may touch and cannot enter.
module obstacles_mod
  use kinds_mod, only: wp
  implicit none
  private

  public :: obstacle_t, obstacle_plane, obstacle_sphere, obstacle_cylinder, locate_point, is_flat, &
    ref_nodes

  integer, parameter :: obstacle_plane = 1
  integer, parameter :: obstacle_sphere = 2
  integer, parameter :: obstacle_cylinder = 3 !! without ends

  !> A rigid obstacle, as the deck places it. It moves with its reference node and does not turn.
  type :: obstacle_t
    character(:), allocatable :: name
    integer  :: kind = obstacle_plane
    real(wp) :: point(3) = 0.0_wp
    !! plane: any point of it; sphere: its centre; cylinder: any point of its axis [length]
    real(wp) :: normal(3) = 0.0_wp
    !! plane: unit normal, from the obstacle to the body; cylinder: unit vector of its axis [-]
    real(wp) :: radius = 0.0_wp      !! sphere and cylinder, > 0 [length]
    logical  :: inner = .false.      !! sphere and cylinder: the body lies inside
    integer  :: ref_node = 0         !! node that the obstacle moves with; 0: it is at rest
  end type obstacle_t

contains

  !> Whether the normal is the same everywhere.
  pure function is_flat(obstacle) result(flat)
    type(obstacle_t), intent(in) :: obstacle
    logical :: flat

    flat = obstacle%kind == obstacle_plane
  end function is_flat

  !> The reference nodes of all obstacles, each once.
  pure function ref_nodes(obstacles) result(nodes)
    type(obstacle_t), intent(in) :: obstacles(:)
    integer, allocatable :: nodes(:)
    integer :: i

    allocate (nodes(0))
    do i = 1, size(obstacles)
      if (obstacles(i)%ref_node == 0 .or. any(nodes == obstacles(i)%ref_node)) cycle
      nodes = [nodes, obstacles(i)%ref_node]
    end do
  end function ref_nodes

  !> Distance of a point in space from the obstacle, and the normal at the closest point of it.
  !>
  !> At the centre of a sphere, or on the axis of a cylinder, every normal is as good as any other.
  pure subroutine locate_point(obstacle, shift, x, gap, normal)
    type(obstacle_t), intent(in) :: obstacle
    real(wp), intent(in)  :: shift(3)  !! how far the obstacle has moved [length]
    real(wp), intent(in)  :: x(3)      !! the point [length]
    real(wp), intent(out) :: gap       !! signed distance, negative inside the obstacle [length]
    real(wp), intent(out) :: normal(3) !! unit vector from the obstacle to the body [-]
    real(wp) :: arm(3), distance

    arm = x - obstacle%point - shift
    if (obstacle%kind == obstacle_plane) then
      gap = dot_product(obstacle%normal, arm)
      normal = obstacle%normal
      return
    end if
    if (obstacle%kind == obstacle_cylinder) then
      arm = arm - dot_product(arm, obstacle%normal)*obstacle%normal
    end if
    distance = norm2(arm)
    if (distance > 0.0_wp) then
      normal = arm/distance
    else
      normal = any_perpendicular(obstacle%normal)
    end if
    gap = distance - obstacle%radius
    if (.not. obstacle%inner) return
    gap = -gap
    normal = -normal
  end subroutine locate_point

  !> A unit vector perpendicular to `axis`, whatever that is.
  pure function any_perpendicular(axis) result(normal)
    real(wp), intent(in) :: axis(3)
    real(wp) :: normal(3)
    integer :: i

    i = minloc(abs(axis), dim=1)
    normal = -axis(i)*axis
    normal(i) = normal(i) + 1.0_wp
    normal = normal/norm2(normal)
  end function any_perpendicular

end module obstacles_mod
