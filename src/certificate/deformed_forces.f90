!> Internal forces at finite strain by another formula than the solver's: about the deformed places.
!>
!>     x = X + u,   F = (dX/dx)^-1,   tau = P F^T,   f_a = sum over points of w tau grad_x N_a
!>
!> w are the undeformed volumes. docs/theory.md (8.22).
module deformed_forces_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: inverse
  use connectivity_mod, only: nodes_of_hexahedron
  use mesh_mod, only: mesh_t
  use scene_mod, only: material_t
  use material_law_mod, only: finite_stress
  use increment_forces_mod, only: increment_forces_t
  implicit none
  private

  public :: find_deformed_forces

  real(wp), parameter :: place = 1.0_wp/sqrt(3.0_wp) !! of Gauss points, each of weight 1

contains

  !> Internal forces and the largest of an element of each body, in the place of those of small
  !> strain, whose stiffness and rounding stay.
  pure subroutine find_deformed_forces(mesh, materials, u, forces)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: u(:, :)        !! (3,n_nodes) displacement, J > 0 [length]
    type(increment_forces_t), intent(inout) :: forces
    real(wp), dimension(3, 8) :: corner, before, after, local, gradient, of_element
    real(wp), dimension(3, 3) :: jacobian_before, jacobian_after, deformation, tau
    real(wp) :: point(3), volume
    integer :: e, g, a, i, nodes(8)

    forces%is_finite = .true.
    forces%internal = 0.0_wp
    forces%of_elements%largest = 0.0_wp
    corner(1, :) = [-1, 1, 1, -1, -1, 1, 1, -1]
    corner(2, :) = [-1, -1, 1, 1, -1, -1, 1, 1]
    corner(3, :) = [-1, -1, -1, -1, 1, 1, 1, 1]
    do e = 1, mesh%n_elements
      nodes = nodes_of_hexahedron(mesh%connectivity, e)
      ! From the first node: elements far from the origin, or that have moved far, lose no digits.
      before = mesh%coordinates(:, nodes) - spread(mesh%coordinates(:, nodes(1)), 2, 8)
      after = before + (u(:, nodes) - spread(u(:, nodes(1)), 2, 8))
      of_element = 0.0_wp
      do g = 1, 8
        point = place*corner(:, g)
        do a = 1, 8
          do i = 1, 3
            local(i, a) = 0.125_wp*corner(i, a)*product(1.0_wp + point*corner(:, a), &
              mask=[1, 2, 3] /= i)
          end do
        end do
        jacobian_before = matmul(before, transpose(local))
        jacobian_after = matmul(after, transpose(local))
        ! Lines that are xi, eta, zeta in turns: F = dx/dxi dxi/dX.
        deformation = matmul(jacobian_after, inverse(jacobian_before))
        volume = triple(jacobian_before)
        gradient = matmul(transpose(inverse(jacobian_after)), local)
        do i = 1, 3
          deformation(i, i) = deformation(i, i) - 1.0_wp
        end do
        tau = finite_stress(materials(mesh%material(e))%law, deformation)
        do i = 1, 3
          deformation(i, i) = deformation(i, i) + 1.0_wp
        end do
        tau = matmul(tau, transpose(deformation))
        of_element = of_element + volume*matmul(tau, gradient)
      end do
      do a = 1, 8
        forces%internal(:, nodes(a)) = forces%internal(:, nodes(a)) + of_element(:, a)
      end do
      associate (largest => forces%of_elements%largest(mesh%body(nodes(1))))
        largest = max(largest, maxval(norm2(of_element, dim=1)))
      end associate
    end do
  end subroutine find_deformed_forces

  !> The volume that three columns span.
  pure real(wp) function triple(a)
    real(wp), intent(in) :: a(3, 3)

    triple = a(1, 1)*(a(2, 2)*a(3, 3) - a(3, 2)*a(2, 3)) + a(2, 1)*(a(3, 2)*a(1, 3) - a(1, 2)* &
      a(3, 3)) + a(3, 1)*(a(1, 2)*a(2, 3) - a(2, 2)*a(1, 3))
  end function triple

end module deformed_forces_mod
