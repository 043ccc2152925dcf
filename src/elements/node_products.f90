!> int N_a N_b dV of an element's nodes, exactly: what weight and mass are made of.
!>
!> A cell is the image of a cube, some of whose corners may be one, by x = sum H_k p_k with the
!> trilinear H_k and the natural coordinates p_k of the cell's corners. Over the cube the integrand
!> N_a N_b det(dx/dxi) is a polynomial in each coordinate: of degree 4 where elements have no
!> mid-side nodes, of degree 9 at most where they have. Gauss's 3 and 5 points a line integrate
!> these exactly, of straight and of curved elements. The quadrature of an element's stiffness is
!> of a lower degree: nodal forces by it depend on the order of the nodes of tetrahedra, wedges and
!> pyramids. docs/theory.md, section 8.
module node_products_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: determinant
  use cells_mod, only: cells, hexahedron_8, has_middles
  use cell_shapes_mod, only: shape_functions, shape_gradients_at
  implicit none
  private

  public :: cell_functions_t, find_node_products

  real(wp), parameter :: line_3(3) = sqrt(0.6_wp)*[-1, 0, 1]
  real(wp), parameter :: weight_3(3) = [5, 8, 5]/9.0_wp
  real(wp), parameter :: inner = sqrt(5.0_wp - 2.0_wp*sqrt(10.0_wp/7.0_wp))/3.0_wp
  real(wp), parameter :: outer = sqrt(5.0_wp + 2.0_wp*sqrt(10.0_wp/7.0_wp))/3.0_wp
  real(wp), parameter :: line_5(5) = [-outer, -inner, 0.0_wp, inner, outer]
  real(wp), parameter :: of_inner = (322.0_wp + 13.0_wp*sqrt(70.0_wp))/900.0_wp
  real(wp), parameter :: of_outer = (322.0_wp - 13.0_wp*sqrt(70.0_wp))/900.0_wp
  real(wp), parameter :: weight_5(5) = [of_outer, of_inner, 128.0_wp/225.0_wp, of_inner, of_outer]

  !> The shape functions of a cell at the points of this quadrature.
  type :: cell_functions_t
    integer :: cell = 0                    !! row of the table of cells; 0: none yet
    real(wp), allocatable :: value(:, :)    !! (n_points,n_nodes) [-]
    real(wp), allocatable :: slope(:, :, :) !! (3,n_nodes,n_points) by natural coordinates [-]
    real(wp), allocatable :: weight(:)      !! (n_points) [-]
  end type cell_functions_t

contains

  !> The products of the nodes of an element, each node once.
  pure subroutine find_node_products(cell, x, functions, products)
    integer,  intent(in) :: cell     !! row of the table of cells
    real(wp), intent(in) :: x(:, :)  !! (3,n_nodes) [length]
    type(cell_functions_t), intent(inout) :: functions !! of the last element; become its cell's
    real(wp), intent(out) :: products(:, :) !! (n_nodes,n_nodes) symmetric to the bit [length^3]
    real(wp) :: from_first(3, size(x, 2)), volume(size(x, 2))
    real(wp), allocatable :: weighted(:)
    integer :: g, a, b

    if (functions%cell /= cell) call evaluate(cell, functions)
    from_first = x - spread(x(:, 1), 2, size(x, 2))
    allocate (weighted, source=functions%weight)
    do g = 1, size(weighted)
      weighted(g) = weighted(g)*determinant(matmul(from_first, transpose( &
        functions%slope(:, :, g))))
    end do
    do b = 1, size(x, 2)
      volume(:b) = matmul(weighted*functions%value(:, b), functions%value(:, :b))
      do a = 1, b
        products(a, b) = volume(a)
        products(b, a) = volume(a)
      end do
    end do
  end subroutine find_node_products

  pure subroutine evaluate(cell, functions)
    integer, intent(in) :: cell
    type(cell_functions_t), intent(out) :: functions

    if (has_middles(cell)) then
      call evaluate_on_lines(cell, line_5, weight_5, functions)
    else
      call evaluate_on_lines(cell, line_3, weight_3, functions)
    end if
  end subroutine evaluate

  !> At the points of the cube that have a line's as coordinates.
  pure subroutine evaluate_on_lines(cell, line, weight, functions)
    integer,  intent(in) :: cell
    real(wp), intent(in) :: line(:), weight(:) !! of an integral from -1 to 1
    type(cell_functions_t), intent(inout) :: functions
    real(wp) :: corners(3, 8), in_cube(3), place(3)
    integer :: g, i, j, k, n

    associate (of => cells(cell))
      n = size(line)**3
      functions%cell = cell
      allocate (functions%value(n, of%n_nodes), functions%slope(3, of%n_nodes, n), &
        functions%weight(n))
      corners = of%place(:, of%as_hexahedron)
      g = 0
      do k = 1, size(line)
        do j = 1, size(line)
          do i = 1, size(line)
            g = g + 1
            in_cube = [line(i), line(j), line(k)]
            place = matmul(corners, shape_functions(cells(hexahedron_8), in_cube))
            functions%value(g, :) = shape_functions(of, place)
            functions%slope(:, :, g) = shape_gradients_at(of, place)
            functions%weight(g) = weight(i)*weight(j)*weight(k)*determinant(matmul(corners, &
              transpose(shape_gradients_at(cells(hexahedron_8), in_cube))))
          end do
        end do
      end do
    end associate
  end subroutine evaluate_on_lines

end module node_products_mod
