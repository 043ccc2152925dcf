!> The elements by their kind: each procedure asks the element's own.
!>
!> Another kind of element is a file like c3d8.f90, a constant in mesh_mod and a case in each
!> procedure here.
module elements_mod
  use kinds_mod, only: wp
  use elasticity_mod, only: elasticity_t
  use mesh_mod, only: kind_c3d8i, kind_c3d8b
  use c3d8_mod, only: c3d8_stiffness => stiffness, c3d8_force => nodal_force, &
    c3d8_strain => gauss_strain
  use c3d8i_mod, only: c3d8i_stiffness => stiffness, c3d8i_force => nodal_force, &
    c3d8i_strain => gauss_strain
  use c3d8b_mod, only: c3d8b_stiffness => stiffness, c3d8b_force => nodal_force, &
    c3d8b_strain => gauss_strain
  implicit none
  private

  public :: stiffness, nodal_force, gauss_strain

contains

  !> Stiffness of an element.
  pure function stiffness(kind, x, elastic) result(k)
    integer,  intent(in) :: kind          !! kind_c3d8 or its kin
    real(wp), intent(in) :: x(3, 8)       !! nodes [length]
    type(elasticity_t), intent(in) :: elastic
    real(wp) :: k(24, 24)                 !! node by node, x y z [force/length]

    select case (kind)
    case (kind_c3d8i)
      k = c3d8i_stiffness(x, elastic)
    case (kind_c3d8b)
      k = c3d8b_stiffness(x, elastic)
    case default
      k = c3d8_stiffness(x, elastic)
    end select
  end function stiffness

  !> Internal force of an element, f_a = int sigma g_a.
  pure function nodal_force(kind, x, u, elastic) result(f)
    integer,  intent(in) :: kind             !! kind_c3d8 or its kin
    real(wp), intent(in) :: x(3, 8), u(3, 8) !! nodes and their displacements [length]
    type(elasticity_t), intent(in) :: elastic
    real(wp) :: f(3, 8)                      !! [force]

    select case (kind)
    case (kind_c3d8i)
      f = c3d8i_force(x, u, elastic)
    case (kind_c3d8b)
      f = c3d8b_force(x, u, elastic)
    case default
      f = c3d8_force(x, u, elastic)
    end select
  end function nodal_force

  !> Strain of an element at its Gauss points.
  pure function gauss_strain(kind, x, u, elastic) result(strain)
    integer,  intent(in) :: kind             !! kind_c3d8 or its kin
    real(wp), intent(in) :: x(3, 8), u(3, 8) !! nodes and their displacements [length]
    type(elasticity_t), intent(in) :: elastic
    real(wp) :: strain(6, 8)                 !! XX YY ZZ XY YZ XZ, shear as tensor [-]

    select case (kind)
    case (kind_c3d8i)
      strain = c3d8i_strain(x, u, elastic)
    case (kind_c3d8b)
      strain = c3d8b_strain(x, u)
    case default
      strain = c3d8_strain(x, u)
    end select
  end function gauss_strain

end module elements_mod
