!> Internal forces at finite strain by another formula than the solver's: about the deformed places.
!>
!>     x = X + u,   H = du/dxi (dX/dxi)^-1,   tau = P (I + H)^T,   f_a = sum of w tau grad_x N_a
!>
!> w are the undeformed volumes of the points. Where heat has stretched an element by 1 + c, P is
!> that of H_c = (H - c I)/(1 + c), and tau = (1 + c)^3 P (I + H_c)^T. P is that of the law, which
!> the solver asks too: what is wrong in a law is not seen. docs/theory.md (8.24), (8.26).
module deformed_forces_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: determinant, inverse
  use connectivity_mod, only: nodes_of_element, nodes_of_hexahedron
  use mesh_mod, only: mesh_t
  use scene_mod, only: material_t
  use elasticity_mod, only: thermal_stress_of
  use strain_measures_mod, only: deformation_of
  use material_law_mod, only: finite_stress
  use increment_forces_mod, only: increment_forces_t
  implicit none
  private

  public :: find_deformed_forces

  real(wp), parameter :: gauss = 1.0_wp/sqrt(3.0_wp) !! coordinate of the points, of weight 1

contains

  !> Internal forces and the largest of an element of each body, in the place of those of small
  !> strain, whose stiffness and rounding stay.
  pure subroutine find_deformed_forces(mesh, materials, rise, u, forces)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: rise(:)        !! (n_nodes) of temperatures, or (0): none [temperature]
    real(wp), intent(in) :: u(:, :)        !! (3,n_nodes) displacement, J > 0 [length]
    type(increment_forces_t), intent(inout) :: forces
    real(wp), dimension(3, 8) :: corner, place, moved, local, of_element, area
    real(wp), dimension(3, 3) :: by_xi, h, tau
    real(wp) :: point(3), c
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
      place = mesh%coordinates(:, nodes) - spread(mesh%coordinates(:, nodes(1)), 2, 8)
      moved = u(:, nodes) - spread(u(:, nodes(1)), 2, 8)
      of_element = 0.0_wp
      c = 0.0_wp
      area = 0.0_wp
      if (size(rise) > 0) then
        associate (each => nodes_of_element(mesh%connectivity, e))
          c = materials(mesh%material(e))%expansion*sum(rise(each))/real(size(each), wp)
        end associate
      end if
      do g = 1, 8
        point = gauss*corner(:, g)
        do a = 1, 8
          do i = 1, 3
            local(i, a) = 0.125_wp*corner(i, a)*product(1.0_wp + point*corner(:, a), &
              mask=[1, 2, 3] /= i)
          end do
        end do
        by_xi = matmul(place, transpose(local))
        h = matmul(matmul(moved, transpose(local)), inverse(by_xi))
        area = area + determinant(by_xi)*matmul(transpose(inverse(by_xi)), local)
        do i = 1, 3
          h(i, i) = h(i, i) - c
        end do
        h = h/(1.0_wp + c)
        tau = (1.0_wp + c)**3*matmul(finite_stress(materials(mesh%material(e))%law, h), &
          transpose(deformation_of(h)))
        of_element = of_element + determinant(by_xi)*matmul(tau, matmul(transpose(inverse( &
          matmul(place + moved, transpose(local)))), local))
      end do
      do a = 1, 8
        forces%internal(:, nodes(a)) = forces%internal(:, nodes(a)) + of_element(:, a)
      end do
      associate (largest => forces%of_elements%largest(mesh%body(nodes(1))), &
                 elastic => materials(mesh%material(e))%law%elastic)
        ! What would hold a warmer element in its shape is a measure where nothing else acts.
        largest = max(largest, maxval(norm2(of_element, dim=1)), abs(thermal_stress_of(c, &
          elastic))*maxval(norm2(area, dim=1)))
      end associate
    end do
  end subroutine find_deformed_forces

end module deformed_forces_mod
