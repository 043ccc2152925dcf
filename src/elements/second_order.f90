!> Elements of second order: cells with nodes in the middles of their edges, where these are,
!> straight or not. C3D10, C3D15, C3D20, C3D20R.
!>
!> All of them are isoparametric, from the table of cells: x = sum N_a x_a with the shape functions
!> of the cell, integrals by its quadrature. Derivatives are of vectors less that of the first node,
!> so that an element far from the origin and one that has moved far as a whole lose no digits.
!> docs/theory.md, section 8.
module second_order_mod
  use kinds_mod, only: wp
  use cells_mod, only: cells, most_nodes, most_points
  use cell_shapes_mod, only: shape_functions, shape_gradients_at
  use elasticity_mod, only: elasticity_t, stress_of
  use hexahedron8_mod, only: elastic_stiffness
  use small_matrix_mod, only: determinant, inverse, solve_small
  implicit none
  private

  public :: second_order_t, second_order, make_at_points, find_jacobians_at_nodes, &
    displacement_gradients, strain_of, stiffness, nodal_force, stiffness_length, &
    extrapolate_to_nodes

  !> An element: what its integrals need of its shape functions.
  type :: second_order_t
    integer :: cell = 0                !! row of the table of cells
    logical :: is_of_table = .false.   !! its points are those of the table
    integer :: n_nodes = 0, n_points = 0
    real(wp) :: gradient(3, most_nodes, most_points) !! dN_a/dx_i at point g: (i,a,g) [1/length]
    real(wp) :: weight(most_points)    !! volume that a point stands for [length^3]
    real(wp) :: natural(3, most_nodes, most_points) !! dN_a/dxi_i at point g: (i,a,g) [-]
    logical :: has_nodes = .false.     !! these of the nodes are known, too
    real(wp) :: at_nodes(3, most_nodes, most_nodes) !! likewise, at node g [-]
  end type second_order_t

contains

  !> An element of a cell. What it has of another element of this cell stays.
  pure subroutine second_order(cell, x, element)
    integer,  intent(in) :: cell     !! row of the table of cells
    real(wp), intent(in) :: x(:, :)  !! (3,n_nodes) [length]
    type(second_order_t), intent(inout) :: element !! another one, or none

    associate (n => cells(cell)%n_points)
      if (.not. (element%cell == cell .and. element%is_of_table)) then
        call find_natural(cell, cells(cell)%point(:, :n), element)
        element%is_of_table = .true.
      end if
      call find_gradients(x, cells(cell)%weight(:n), element)
    end associate
  end subroutine second_order

  !> An element of a cell, with points of another quadrature.
  pure subroutine make_at_points(cell, x, point, weight, element)
    integer,  intent(in) :: cell        !! row of the table of cells
    real(wp), intent(in) :: x(:, :)     !! (3,n_nodes) [length]
    real(wp), intent(in) :: point(:, :) !! (3,n_points) natural coordinates [-]
    real(wp), intent(in) :: weight(:)   !! (n_points) [-]
    type(second_order_t), intent(out) :: element

    call find_natural(cell, point, element)
    call find_gradients(x, weight, element)
  end subroutine make_at_points

  !> The gradients of the shape functions of a cell along its natural coordinates.
  pure subroutine find_natural(cell, point, element)
    integer,  intent(in) :: cell        !! row of the table of cells
    real(wp), intent(in) :: point(:, :) !! (3,n_points) natural coordinates [-]
    type(second_order_t), intent(inout) :: element
    integer :: g

    element%cell = cell
    element%has_nodes = .false.
    element%n_nodes = cells(cell)%n_nodes
    element%n_points = size(point, 2)
    do g = 1, element%n_points
      element%natural(:, :element%n_nodes, g) = shape_gradients_at(cells(cell), point(:, g))
    end do
  end subroutine find_natural

  pure subroutine find_gradients(x, weight, element)
    real(wp), intent(in) :: x(:, :)     !! (3,n_nodes) [length]
    real(wp), intent(in) :: weight(:)   !! (n_points) [-]
    type(second_order_t), intent(inout) :: element
    real(wp) :: from_first(3, size(x, 2)), jacobian(3, 3), back(3, 3)
    integer :: g, a

    from_first = x - spread(x(:, 1), 2, size(x, 2))
    do g = 1, element%n_points
      jacobian = slope_of(from_first, element%natural(:, :element%n_nodes, g))
      element%weight(g) = weight(g)*determinant(jacobian)
      back = transpose(inverse(jacobian))
      do a = 1, element%n_nodes
        associate (d => element%natural(:, a, g))
          element%gradient(:, a, g) = back(:, 1)*d(1) + back(:, 2)*d(2) + back(:, 3)*d(3)
        end associate
      end do
    end do
  end subroutine find_gradients

  !> sum over the nodes of v_a g_a^T.
  pure function slope_of(v, gradient) result(slope)
    real(wp), intent(in) :: v(:, :)        !! (3,n_nodes) [length]
    real(wp), intent(in) :: gradient(:, :) !! (3,n_nodes)
    real(wp) :: slope(3, 3)
    integer :: a, j

    slope = 0.0_wp
    do a = 1, size(v, 2)
      do j = 1, 3
        slope(:, j) = slope(:, j) + v(:, a)*gradient(j, a)
      end do
    end do
  end function slope_of

  !> The determinants of the Jacobian dx_i/dxi_j at the nodes, of places that are not the element's.
  pure subroutine find_jacobians_at_nodes(place, element, determinants)
    real(wp), intent(in) :: place(:, :)            !! (3,n_nodes) [length]
    type(second_order_t), intent(inout) :: element !! an element of the cell
    real(wp), intent(out) :: determinants(:)       !! (n_nodes) [length^3]
    real(wp) :: from_first(3, size(place, 2))
    integer :: g

    if (.not. element%has_nodes) then
      do g = 1, element%n_nodes
        element%at_nodes(:, :element%n_nodes, g) = shape_gradients_at(cells(element%cell), &
          cells(element%cell)%place(:, g))
      end do
      element%has_nodes = .true.
    end if
    from_first = place - spread(place(:, 1), 2, size(place, 2))
    do g = 1, element%n_nodes
      determinants(g) = determinant(slope_of(from_first, element%at_nodes(:, :element%n_nodes, g)))
    end do
  end subroutine find_jacobians_at_nodes

  !> du_i/dx_j at the points.
  pure function displacement_gradients(element, u) result(h)
    type(second_order_t), intent(in) :: element
    real(wp), intent(in) :: u(:, :)          !! (3,n_nodes) [length]
    real(wp) :: h(3, 3, element%n_points)    !! (i,j,g) [-]
    real(wp) :: from_first(3, size(u, 2))
    integer :: g

    from_first = u - spread(u(:, 1), 2, size(u, 2))
    do g = 1, element%n_points
      h(:, :, g) = slope_of(from_first, element%gradient(:, :size(u, 2), g))
    end do
  end function displacement_gradients

  !> Strain at the points.
  pure function strain_of(element, u) result(strain)
    type(second_order_t), intent(in) :: element
    real(wp), intent(in) :: u(:, :)           !! (3,n_nodes) [length]
    real(wp) :: strain(6, element%n_points)   !! XX YY ZZ XY YZ XZ, shear as tensor [-]
    real(wp) :: h(3, 3, element%n_points)
    integer :: g

    h = displacement_gradients(element, u)
    do g = 1, element%n_points
      strain(:, g) = [h(1, 1, g), h(2, 2, g), h(3, 3, g), 0.5_wp*(h(1, 2, g) + h(2, 1, g)), &
        0.5_wp*(h(2, 3, g) + h(3, 2, g)), 0.5_wp*(h(1, 3, g) + h(3, 1, g))]
    end do
  end function strain_of

  !> int sigma g_a, the forces that stresses at the points exert on the nodes.
  pure function force_of(element, stress) result(f)
    type(second_order_t), intent(in) :: element
    real(wp), intent(in) :: stress(:, :)     !! (6,n_points) [force/length^2]
    real(wp) :: f(3, element%n_nodes)        !! [force]
    real(wp) :: s(3, 3)
    integer :: g

    f = 0.0_wp
    do g = 1, element%n_points
      s = element%weight(g)*reshape(stress([1, 4, 6, 4, 2, 5, 6, 5, 3], g), [3, 3])
      f = f + matmul(s, element%gradient(:, :element%n_nodes, g))
    end do
  end function force_of

  !> K_ab = int lambda g_a g_b^T + G (g_b g_a^T + g_a.g_b I).
  pure function stiffness(cell, x, elastic) result(k)
    integer,  intent(in) :: cell      !! row of the table of cells
    real(wp), intent(in) :: x(:, :)   !! (3,n_nodes) [length]
    type(elasticity_t), intent(in) :: elastic(:) !! one, or one a point
    real(wp) :: k(3*size(x, 2), 3*size(x, 2)) !! node by node, x y z [force/length]
    type(second_order_t) :: element

    call second_order(cell, x, element)
    associate (n => element%n_nodes, points => element%n_points)
      k = elastic_stiffness(n, points, reshape(element%gradient(:, :n, :points), [3*n, points]), &
        element%weight(:points), elastic)
    end associate
  end function stiffness

  !> Internal force, from the displacements themselves (no stiffness matrix).
  pure function nodal_force(cell, x, u, elastic) result(f)
    integer,  intent(in) :: cell               !! row of the table of cells
    real(wp), intent(in) :: x(:, :), u(:, :)   !! (3,n_nodes) nodes, their displacements [length]
    type(elasticity_t), intent(in) :: elastic(:) !! one, or one a point
    real(wp) :: f(3, size(x, 2))               !! [force]
    type(second_order_t) :: element

    call second_order(cell, x, element)
    f = force_of(element, stress_of(strain_of(element, u), elastic))
  end function nodal_force

  !> How large a nodal stiffness of the element is beside its elastic constants: int |g_a|^2 dV, the
  !> mean over the nodes.
  pure real(wp) function stiffness_length(cell, x) result(length)
    integer,  intent(in) :: cell     !! row of the table of cells
    real(wp), intent(in) :: x(:, :)  !! (3,n_nodes) [length]
    type(second_order_t) :: element
    integer :: g

    call second_order(cell, x, element)
    length = 0.0_wp
    do g = 1, element%n_points
      length = length + element%weight(g)*sum(element%gradient(:, :element%n_nodes, g)**2)
    end do
    length = length/real(element%n_nodes, wp)
  end function stiffness_length

  !> Values at the nodes, from those at the points: the function of the cell without mid-side nodes
  !> that is closest to them, at mid-side nodes the mean of two corners.
  pure function extrapolate_to_nodes(cell, values) result(at_nodes)
    integer,  intent(in) :: cell           !! row of the table of cells
    real(wp), intent(in) :: values(:, :)   !! (m,n_points)
    real(wp) :: at_nodes(size(values, 1), cells(cell)%n_nodes)
    real(wp) :: n(cells(cell)%n_corners, cells(cell)%n_points)
    real(wp) :: normal(cells(cell)%n_corners, cells(cell)%n_corners)
    logical :: is_regular
    integer :: g, i

    associate (of => cells(cell))
      do g = 1, of%n_points
        n(:, g) = corner_functions(cell, of%point(:, g))
      end do
      normal = matmul(n, transpose(n))
      do i = 1, size(values, 1)
        call solve_small(normal, matmul(n, values(i, :)), at_nodes(i, :of%n_corners), is_regular)
      end do
      do i = 1, of%n_nodes - of%n_corners
        at_nodes(:, of%n_corners + i) = 0.5_wp*(at_nodes(:, of%edge(1, i)) + &
          at_nodes(:, of%edge(2, i)))
      end do
    end associate
  end function extrapolate_to_nodes

  !> The shape functions of the corners where there are no mid-side nodes: a corner's own and half
  !> of those of its edges.
  pure function corner_functions(cell, place) result(n)
    integer,  intent(in) :: cell      !! row of the table of cells
    real(wp), intent(in) :: place(3)  !! natural coordinates [-]
    real(wp) :: n(cells(cell)%n_corners)
    real(wp) :: all_nodes(cells(cell)%n_nodes)
    integer :: i

    associate (of => cells(cell))
      all_nodes = shape_functions(of, place)
      n = all_nodes(:of%n_corners)
      do i = 1, of%n_nodes - of%n_corners
        n(of%edge(:, i)) = n(of%edge(:, i)) + 0.5_wp*all_nodes(of%n_corners + i)
      end do
    end associate
  end function corner_functions

end module second_order_mod
