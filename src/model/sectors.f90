!> Bodies of revolution, of which a wedge about the y axis is computed: what its forces mean.
!> docs/theory.md section 8.
module sectors_mod
  use kinds_mod, only: wp
  use mesh_mod, only: mesh_t
  implicit none
  private

  public :: around_axis, n_sectors, turn_into_plane, turn_sum_into_plane

contains

  !> How many wedges have the volume and the faces of the body; 1 of other bodies.
  !>
  !> An element between two half planes has chords in the place of arcs, and so sin(alpha)/alpha of
  !> the volume, and of the work of pressures along radii: 2 pi/sin(alpha) are as the whole body.
  pure real(wp) function n_sectors(angle)
    real(wp), intent(in) :: angle !! of the wedge; 0: there is none [rad]

    n_sectors = 1.0_wp
    if (angle > 0.0_wp) n_sectors = 2.0_wp*acos(-1.0_wp)/sin(angle)
  end function n_sectors

  !> The unit vector around the axis at a node, or halfway through the wedge; 0 where there is none.
  pure function around_axis(mesh, node, halfway) result(around)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: node
    logical, intent(in) :: halfway
    real(wp) :: around(3), x(3)

    around = 0.0_wp
    if (.not. mesh%sector_angle > 0.0_wp) return
    x = mesh%coordinates(:, node) + mesh%origin
    if (halfway) x = [cos(0.5_wp*mesh%sector_angle), 0.0_wp, sin(0.5_wp*mesh%sector_angle)]
    around = [-x(3), 0.0_wp, x(1)]/hypot(x(1), x(3))
  end function around_axis

  !> Turn forces on nodes into the plane of the deck: their parts along the radius and the axis.
  !> What acts across half planes only holds these, and is left out; on the axis there is no radius.
  pure subroutine turn_into_plane(mesh, forces)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(inout) :: forces(:, :) !! (3,n) of the first nodes
    real(wp) :: x(3)
    integer :: node

    if (.not. mesh%sector_angle > 0.0_wp) return
    do node = 1, size(forces, 2)
      x = mesh%coordinates(:, node) + mesh%origin
      x(2) = 0.0_wp
      if (norm2(x) > 0.0_wp) x = x/norm2(x)
      forces(:, node) = [dot_product(x, forces(:, node)), forces(2, node), 0.0_wp]
    end do
  end subroutine turn_into_plane

  !> The same of a sum over both half planes, equal parts of it on each.
  pure function turn_sum_into_plane(mesh, force) result(turned)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: force(3)
    real(wp) :: turned(3)

    turned = force
    if (.not. mesh%sector_angle > 0.0_wp) return
    associate (middle => 0.5_wp*mesh%sector_angle)
      turned = [force(1)*cos(middle) + force(3)*sin(middle), force(2), 0.0_wp]
    end associate
  end function turn_sum_into_plane

end module sectors_mod
