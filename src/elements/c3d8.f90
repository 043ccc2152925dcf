!> C3D8: the element with full integration. Stiff in bending and where it is nearly incompressible.
module c3d8_mod
  use kinds_mod, only: wp
  use elasticity_mod, only: elasticity_t, stress_of
  use hexahedron8_mod, only: shape_gradients, strain_of, force_of, isotropic_stiffness
  implicit none
  private

  public :: stiffness, nodal_force, gauss_strain

contains

  !> Stiffness of the element.
  pure function stiffness(x, elastic) result(k)
    real(wp), intent(in) :: x(3, 8)       !! nodes [length]
    type(elasticity_t), intent(in) :: elastic
    real(wp) :: k(24, 24)                 !! node by node, x y z [force/length]
    real(wp) :: gradient(3, 8, 8), weight(8)

    call shape_gradients(x, gradient, weight)
    k = isotropic_stiffness(8, 8, gradient, weight, elastic)
  end function stiffness

  !> Internal force of the element, from the displacements themselves (no stiffness matrix).
  pure function nodal_force(x, u, elastic) result(f)
    real(wp), intent(in) :: x(3, 8), u(3, 8) !! nodes and their displacements [length]
    type(elasticity_t), intent(in) :: elastic
    real(wp) :: f(3, 8)                      !! [force]
    real(wp) :: gradient(3, 8, 8), weight(8), inverse_jacobian(3, 3, 8)

    call shape_gradients(x, gradient, weight, inverse_jacobian)
    f = force_of(8, gradient, weight, stress_of(strain_of(inverse_jacobian, u), elastic))
  end function nodal_force

  !> Strain at the Gauss points.
  pure function gauss_strain(x, u) result(strain)
    real(wp), intent(in) :: x(3, 8), u(3, 8) !! nodes and their displacements [length]
    real(wp) :: strain(6, 8)                 !! XX YY ZZ XY YZ XZ [-]
    real(wp) :: gradient(3, 8, 8), weight(8), inverse_jacobian(3, 3, 8)

    call shape_gradients(x, gradient, weight, inverse_jacobian)
    strain = strain_of(inverse_jacobian, u)
  end function gauss_strain

end module c3d8_mod
