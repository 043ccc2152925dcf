!> The elements by their kind: each procedure asks the element's own.
!>
!> Another kind of element is a file like c3d8.f90, a constant in mesh_mod and a case in each
!> procedure here.
module elements_mod
  use kinds_mod, only: wp
  use undefined_mod, only: undefined
  use elasticity_mod, only: elasticity_t, stress_of
  use mesh_mod, only: kind_c3d8, kind_c3d8i, kind_c3d8b
  use hexahedron8_mod, only: shape_gradients, strain_of, force_of
  use c3d8_mod, only: c3d8_stiffness => stiffness
  use c3d8i_mod, only: c3d8i_stiffness => stiffness, relaxed_strain
  use c3d8b_mod, only: c3d8b_stiffness => stiffness, mean_dilatation_strain, mean_dilatation_force
  implicit none
  private

  public :: stiffness, nodal_force, gauss_strain

contains

  !> Stiffness of an element.
  pure function stiffness(kind, x, elastic) result(k)
    integer,  intent(in) :: kind          !! kind_c3d8 or its kin
    real(wp), intent(in) :: x(3, 8)       !! nodes [length]
    type(elasticity_t), intent(in) :: elastic(:) !! one, or one a point
    real(wp) :: k(24, 24)                 !! node by node, x y z [force/length]

    select case (kind)
    case (kind_c3d8i)
      k = c3d8i_stiffness(x, elastic)
    case (kind_c3d8b)
      k = c3d8b_stiffness(x, elastic)
    case (kind_c3d8)
      k = c3d8_stiffness(x, elastic)
    case default
      k = undefined
    end select
  end function stiffness

  !> Internal force of an element, f_a = int sigma g_a, from the displacements themselves (no
  !> stiffness matrix).
  pure function nodal_force(kind, x, u, elastic) result(f)
    integer,  intent(in) :: kind             !! kind_c3d8 or its kin
    real(wp), intent(in) :: x(3, 8), u(3, 8) !! nodes and their displacements [length]
    type(elasticity_t), intent(in) :: elastic(:) !! one, or one a point
    real(wp) :: f(3, 8)                      !! [force]
    real(wp) :: gradient(3, 8, 8), weight(8), inverse_jacobian(3, 3, 8), stress(6, 8)

    call shape_gradients(x, gradient, weight, inverse_jacobian)
    stress = stress_of(strain_at_points(kind, x, inverse_jacobian, weight, u, elastic), elastic)
    if (kind == kind_c3d8b) then
      f = mean_dilatation_force(gradient, weight, stress)
    else
      f = force_of(8, gradient, weight, stress)
    end if
  end function nodal_force

  !> Strain of an element at its Gauss points.
  pure function gauss_strain(kind, x, u, elastic) result(strain)
    integer,  intent(in) :: kind             !! kind_c3d8 or its kin
    real(wp), intent(in) :: x(3, 8), u(3, 8) !! nodes and their displacements [length]
    type(elasticity_t), intent(in) :: elastic(:) !! one, or one a point
    real(wp) :: strain(6, 8)                 !! XX YY ZZ XY YZ XZ, shear as tensor [-]
    real(wp) :: gradient(3, 8, 8), weight(8), inverse_jacobian(3, 3, 8)

    call shape_gradients(x, gradient, weight, inverse_jacobian)
    strain = strain_at_points(kind, x, inverse_jacobian, weight, u, elastic)
  end function gauss_strain

  !> The same with the inverse Jacobians at the Gauss points, and their weights.
  pure function strain_at_points(kind, x, inverse_jacobian, weight, u, elastic) result(strain)
    integer,  intent(in) :: kind
    real(wp), intent(in) :: x(3, 8), inverse_jacobian(3, 3, 8), weight(8), u(3, 8)
    type(elasticity_t), intent(in) :: elastic(:) !! one, or one a point
    real(wp) :: strain(6, 8)

    select case (kind)
    case (kind_c3d8i)
      strain = relaxed_strain(x, inverse_jacobian, weight, u, elastic)
    case (kind_c3d8b)
      strain = mean_dilatation_strain(inverse_jacobian, weight, u)
    case (kind_c3d8)
      strain = strain_of(inverse_jacobian, u)
    case default
      strain = undefined
    end select
  end function strain_at_points

end module elements_mod
