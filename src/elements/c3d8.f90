!> C3D8: the element with full integration. Stiff in bending and where it is nearly incompressible.
module c3d8_mod
  use kinds_mod, only: wp
  use elasticity_mod, only: elasticity_t
  use hexahedron8_mod, only: shape_gradients, elastic_stiffness
  implicit none
  private

  public :: stiffness

contains

  !> Stiffness of the element.
  pure function stiffness(x, elastic) result(k)
    real(wp), intent(in) :: x(3, 8)       !! nodes [length]
    type(elasticity_t), intent(in) :: elastic(:) !! one, or one a point
    real(wp) :: k(24, 24)                 !! node by node, x y z [force/length]
    real(wp) :: gradient(3, 8, 8), weight(8)

    call shape_gradients(x, gradient, weight)
    k = elastic_stiffness(8, 8, gradient, weight, elastic)
  end function stiffness

end module c3d8_mod
