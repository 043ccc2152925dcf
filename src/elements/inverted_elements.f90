!> Elements that a displacement turns inside out: det(I + grad u) <= 0 at a Gauss point.
module inverted_elements_mod
  use kinds_mod, only: wp
  use cells_mod, only: cells, has_middles, hexahedron_8
  use cell_shapes_mod, only: shape_gradients_at
  use connectivity_mod, only: connectivity_t, nodes_of_element, nodes_of_hexahedron
  use mesh_mod, only: mesh_t
  use hexahedron8_mod, only: shape_gradients, along_edges, jacobian_determinants
  use second_order_mod, only: second_order_t, second_order, displacement_gradients
  use strain_measures_mod, only: growth_of
  use small_matrix_mod, only: determinant
  implicit none
  private

  public :: find_reach, gradient_bound, find_inverted, jacobians_of, first_inverted

contains

  !> The determinants of the Jacobian that must be positive: at the Gauss points, and at the nodes
  !> along the natural coordinates of the cell. Along those of a hexahedron that is collapsed they
  !> are 0 at some.
  pure function jacobians_of(coordinates, connectivity, e) result(determinants)
    real(wp), intent(in) :: coordinates(:, :) !! (3,n_nodes) [length]
    type(connectivity_t), intent(in) :: connectivity
    integer, intent(in) :: e
    real(wp), allocatable :: determinants(:)  !! of the lengths along the coordinates [length^3]
    integer :: a, n

    if (has_middles(connectivity%cell(e))) then
      associate (cell => cells(connectivity%cell(e)), &
                 x => coordinates(:, nodes_of_element(connectivity, e)))
        allocate (determinants(cell%n_points + cell%n_nodes))
        do a = 1, cell%n_points
          determinants(a) = determinant(matmul(x, transpose(shape_gradients_at(cell, &
            cell%point(:, a)))))
        end do
        do a = 1, cell%n_nodes
          determinants(cell%n_points + a) = determinant(matmul(x, transpose(shape_gradients_at( &
            cell, cell%place(:, a)))))
        end do
      end associate
      return
    end if
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

  !> The first element that each of those who move nodes of a mesh turned inside out, 0: none.
  pure function first_inverted(coordinates, connectivity, n_elements, mover, n) result(first)
    real(wp), intent(in) :: coordinates(:, :) !! (3,n_nodes) [length]
    type(connectivity_t), intent(in) :: connectivity
    integer, intent(in) :: n_elements
    integer, intent(in) :: mover(:)           !! (n_nodes) 1 to n who moved the node, else 0
    integer, intent(in) :: n
    integer :: first(n)
    integer :: e, m

    first = 0
    do e = n_elements, 1, -1
      m = maxval(mover(nodes_of_element(connectivity, e)))
      if (m == 0) cycle
      if (.not. all(jacobians_of(coordinates, connectivity, e) > 0.0_wp)) first(m) = e
    end do
  end function first_inverted

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
    real(wp) :: before(16), after(16), growth
    integer :: e, nodes(8)

    element = 0
    least = 0.0_wp
    do e = 1, mesh%n_elements
      if (has_middles(mesh%connectivity%cell(e))) then
        growth = least_growth(mesh, e, u(:, nodes_of_element(mesh%connectivity, e)))
        if (1.0_wp + growth > least) cycle
        element = e
        least = 1.0_wp + growth
        cycle
      end if
      nodes = nodes_of_hexahedron(mesh%connectivity, e)
      if (gradient_bound(reach(:, e), u(:, nodes)) < 1.0_wp) cycle
      before = jacobian_determinants(mesh%coordinates(:, nodes))
      after = jacobian_determinants(mesh%coordinates(:, nodes) + u(:, nodes))
      if (minval(after(:8)/before(:8)) > least) cycle
      element = e
      least = minval(after(:8)/before(:8))
    end do
  end subroutine find_inverted

  !> The least det(I + grad u) - 1 at the points of an element of second order.
  pure real(wp) function least_growth(mesh, e, u) result(least)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: e
    real(wp), intent(in) :: u(:, :)  !! displacements of its nodes [length]
    type(second_order_t) :: element
    real(wp) :: h(3, 3, cells(mesh%connectivity%cell(e))%n_points)
    integer :: g

    call second_order(mesh%connectivity%cell(e), mesh%coordinates(:, nodes_of_element( &
      mesh%connectivity, e)), element)
    h = displacement_gradients(element, u)
    least = huge(least)
    do g = 1, element%n_points
      least = min(least, growth_of(h(:, :, g)))
    end do
  end function least_growth

end module inverted_elements_mod
