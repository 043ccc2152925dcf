!> Bodies of revolution, of which a wedge about the y axis is computed, and bodies in plane strain
!> and plates, of which a slice is: what forces and motions mean.
!> docs/theory.md section 8.
module sectors_mod
  use kinds_mod, only: wp
  use mesh_mod, only: mesh_t, plane_strain, plane_stress
  implicit none
  private

  public :: no_slip_along, without_turn, turn_into_plane, turn_sum_into_plane

contains

  !> The unit vector along which nothing slips at a node, or halfway through the wedge: around the
  !> axis, or across a slice; 0 of other bodies.
  pure function no_slip_along(mesh, node, halfway) result(around)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: node
    logical, intent(in) :: halfway
    real(wp) :: around(3), x(3)

    around = merge([0.0_wp, 0.0_wp, 1.0_wp], 0.0_wp, any(mesh%plane == &
      [plane_strain, plane_stress]))
    if (.not. mesh%sector_angle > 0.0_wp) return
    x = mesh%coordinates(:, node) + mesh%origin
    if (halfway) x = [cos(0.5_wp*mesh%sector_angle), 0.0_wp, sin(0.5_wp*mesh%sector_angle)]
    around = [-x(3), 0.0_wp, x(1)]/hypot(x(1), x(3))
  end function no_slip_along

  !> A motion without its part along which nothing slips: what weights make of nodes on both sides
  !> is none.
  pure function without_turn(mesh, node, halfway, motion) result(left)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: node
    logical, intent(in) :: halfway
    real(wp), intent(in) :: motion(3)
    real(wp) :: left(3), around(3)

    around = no_slip_along(mesh, node, halfway)
    left = motion - dot_product(motion, around)*around
  end function without_turn

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
