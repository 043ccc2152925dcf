!> Elements that a displacement turns inside out: det(I + grad u) <= 0 at a Gauss point.
module inverted_elements_mod
  use kinds_mod, only: wp
  use cells_mod, only: cells, hexahedron_8
  use cell_shapes_mod, only: shape_gradients_at
  use connectivity_mod, only: connectivity_t, nodes_of_element, nodes_of_hexahedron
  use mesh_mod, only: mesh_t
  use hexahedron8_mod, only: shape_gradients, along_edges, jacobian_determinants
  use small_matrix_mod, only: determinant
  implicit none
  private

  public :: find_reach, gradient_bound, find_inverted, jacobians_of

contains

  !> The determinants of the Jacobian that must be positive: at the Gauss points, and at the corners
  !> along the natural coordinates of the cell. Along those of a hexahedron that is collapsed they
  !> are 0 at some.
  pure function jacobians_of(coordinates, connectivity, e) result(determinants)
    real(wp), intent(in) :: coordinates(:, :) !! (3,n_nodes) [length]
    type(connectivity_t), intent(in) :: connectivity
    integer, intent(in) :: e
    real(wp), allocatable :: determinants(:)  !! of the lengths along the coordinates [length^3]
    integer :: a, n

    allocate (determinants, source=jacobian_determinants(coordinates(:, &
      nodes_of_hexahedron(connectivity, e))))
    if (connectivity%cell(e) == hexahedron_8) return
    associate (cell => cells(connectivity%cell(e)), &
               x => coordinates(:, nodes_of_element(connectivity, e)))
      n = merge(0, cell%n_corners, cell%n_points == 1) ! then it is the same everywhere
      do a = 1, n
        determinants(8 + a) = determinant(matmul(x, transpose(shape_gradients_at(cell, &
          cell%place(:, a)))))
      end do
    end associate
    determinants = determinants(:8 + n)
  end function jacobians_of

  !> The most that an edge of each element adds to grad u at its Gauss points, per change of the
  !> edge.
  pure function find_reach(mesh) result(reach)
    type(mesh_t), intent(in) :: mesh
    real(wp) :: reach(3, mesh%n_elements) !! max |dxi_j/dx|/2 at the Gauss points [1/length]
    real(wp) :: gradient(3, 8, 8), weight(8), inverse_jacobian(3, 3, 8)
    integer :: e

    do e = 1, mesh%n_elements
      call shape_gradients(mesh%coordinates(:, nodes_of_hexahedron(mesh%connectivity, e)), &
        gradient, weight, inverse_jacobian)
      reach(:, e) = 0.5_wp*maxval(norm2(inverse_jacobian, dim=2), dim=2)
    end do
  end function find_reach

  !> What |grad u| is at most at the Gauss points of an element, as a matrix: the sum of what an
  !> edge of each direction adds. docs/theory.md (8.33).
  pure real(wp) function gradient_bound(reach, u) result(bound)
    real(wp), intent(in) :: reach(3)  !! as of find_reach [1/length]
    real(wp), intent(in) :: u(3, 8)   !! displacements of its nodes [length]
    real(wp) :: along(3, 4, 3)
    integer :: j

    along = along_edges(u)
    bound = 0.0_wp
    do j = 1, 3
      bound = bound + reach(j)**2*max(sum(along(:, 1, j)**2), sum(along(:, 2, j)**2), &
        sum(along(:, 3, j)**2), sum(along(:, 4, j)**2))
    end do
    bound = sqrt(3.0_wp*bound)
  end function gradient_bound

  !> The element with the least det(I + grad u) that is not above 0; 0: there is none. I + H is
  !> regular where |H| < 1, so that most elements need no determinant.
  pure subroutine find_inverted(mesh, reach, u, element, least)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: reach(:, :)  !! (3,n_elements) as of find_reach [1/length]
    real(wp), intent(in) :: u(:, :)      !! (3,n_nodes) displacement [length]
    integer, intent(out) :: element
    real(wp), intent(out) :: least       !! its determinant [-]
    real(wp) :: before(16), after(16)
    integer :: e, nodes(8)

    element = 0
    least = 0.0_wp
    do e = 1, mesh%n_elements
      nodes = nodes_of_hexahedron(mesh%connectivity, e)
      if (gradient_bound(reach(:, e), u(:, nodes)) < 1.0_wp) cycle
      before = jacobian_determinants(mesh%coordinates(:, nodes))
      after = jacobian_determinants(mesh%coordinates(:, nodes) + u(:, nodes))
      if (minval(after(:8)/before(:8)) > least) cycle
      element = e
      least = minval(after(:8)/before(:8))
    end do
  end subroutine find_inverted

end module inverted_elements_mod
