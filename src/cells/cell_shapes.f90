!> The shape functions of the cells, from their table.
!>
!> A corner's linear function is the product of its barycentric coordinates in the simplices that
!> the cell is made of. A mid-side node of an edge between corners i and j, which differ in one
!> simplex, has 4 times the product of both in that simplex, and a corner of a cell with mid-side
!> nodes its linear function less half of those of its edges (serendipity). The cone over a square
!> has the functions of the square, smaller towards the apex; with mid-side nodes they contain all
!> polynomials of second degree (G. Bedrosian, Shape functions and integration formulas for
!> three-dimensional finite element analysis, Int. J. Numer. Meth. Eng. 35, 1992).
!> docs/theory.md, section 8.
module cell_shapes_mod
  use kinds_mod, only: wp
  use cells_mod, only: cell_t
  implicit none
  private

  public :: shape_functions, shape_gradients_at

contains

  !> The shape functions of all nodes at a place in a cell.
  pure function shape_functions(cell, place) result(n)
    type(cell_t), intent(in) :: cell
    real(wp), intent(in) :: place(3)  !! natural coordinates [-]
    real(wp) :: n(cell%n_nodes)       !! they add up to 1 [-]
    real(wp) :: gradient(3, cell%n_nodes)

    call evaluate(cell, place, n, gradient)
  end function shape_functions

  !> Their gradients along the natural coordinates.
  pure function shape_gradients_at(cell, place) result(gradient)
    type(cell_t), intent(in) :: cell
    real(wp), intent(in) :: place(3)          !! natural coordinates [-]
    real(wp) :: gradient(3, cell%n_nodes)     !! dN_a/dxi_i: (i,a) [-]
    real(wp) :: n(cell%n_nodes)

    call evaluate(cell, place, n, gradient)
  end function shape_gradients_at

  pure subroutine evaluate(cell, place, n, gradient)
    type(cell_t), intent(in) :: cell
    real(wp), intent(in)  :: place(3)
    real(wp), intent(out) :: n(:), gradient(:, :)
    integer :: i, k, node

    if (any(cell%factor == 0)) then
      call evaluate_cone(cell, place, n, gradient)
    else
      call evaluate_product(cell, place, n, gradient)
    end if
    do i = 1, cell%n_nodes - cell%n_corners
      node = cell%n_corners + i
      do k = 1, 2
        associate (corner => cell%edge(k, i))
          n(corner) = n(corner) - 0.5_wp*n(node)
          gradient(:, corner) = gradient(:, corner) - 0.5_wp*gradient(:, node)
        end associate
      end do
    end do
  end subroutine evaluate

  !> Of a product of simplices: the linear functions of the corners, and those of the middles.
  pure subroutine evaluate_product(cell, place, n, gradient)
    type(cell_t), intent(in) :: cell
    real(wp), intent(in)  :: place(3)
    real(wp), intent(out) :: n(:), gradient(:, :)
    real(wp) :: value(3, cell%n_corners), slope(3, cell%n_corners)
    integer :: a, i, node

    do a = 1, cell%n_corners
      call find_barycentric(cell, cell%place(:, a), place, value(:, a), slope(:, a))
      call multiply(cell%factor, value(:, a), slope(:, a), n(a), gradient(:, a))
    end do
    do i = 1, cell%n_nodes - cell%n_corners
      node = cell%n_corners + i
      associate (one => cell%edge(1, i), other => cell%edge(2, i))
        call multiply_along_edge(cell%factor, value(:, [one, other]), slope(:, [one, other]), &
          differs(cell%place(:, one), cell%place(:, other)), n(node), gradient(:, node))
      end associate
    end do

  contains

    !> The simplex in which two corners differ.
    pure integer function differs(one, other)
      real(wp), intent(in) :: one(3), other(3)

      differs = cell%factor(maxloc(abs(one - other), dim=1))
    end function differs

  end subroutine evaluate_product

  !> Likewise of the cone over a square, whose last corner is the apex. With s = 1 - zeta and the
  !> bilinear B_a of the square, that of a corner is s B_a(xi/s, eta/s), of the middle of an edge to
  !> the apex 4 zeta times that, and of an edge of the square s^2 times the square's own. At the
  !> apex gradients depend on the direction: they are those on the axis.
  pure subroutine evaluate_cone(cell, place, n, gradient)
    type(cell_t), intent(in) :: cell
    real(wp), intent(in)  :: place(3)
    real(wp), intent(out) :: n(:), gradient(:, :)
    real(wp) :: s, below(2), line(2, cell%n_corners - 1), along, across
    integer :: a, i, k, node

    s = 1.0_wp - place(3)
    below = 0.0_wp
    if (abs(s) > 0.0_wp) below = place(:2)/s
    do a = 1, cell%n_corners - 1
      associate (corner => cell%place(:2, a))
        line(:, a) = 0.5_wp*(1.0_wp + below*corner)
        n(a) = s*product(line(:, a))
        gradient(:2, a) = 0.5_wp*corner*line([2, 1], a)
      end associate
      gradient(3, a) = dot_product(below, gradient(:2, a)) - product(line(:, a))
    end do
    n(cell%n_corners) = place(3)
    gradient(:, cell%n_corners) = [0.0_wp, 0.0_wp, 1.0_wp]
    do i = 1, cell%n_nodes - cell%n_corners
      node = cell%n_corners + i
      associate (one => cell%edge(1, i), other => cell%edge(2, i))
        if (other == cell%n_corners) then
          n(node) = 4.0_wp*place(3)*n(one)
          gradient(:, node) = 4.0_wp*place(3)*gradient(:, one)
          gradient(3, node) = gradient(3, node) + 4.0_wp*n(one)
          cycle
        end if
        ! The edge is along coordinate k: a parabola along it, a line across.
        k = maxloc(abs(cell%place(:2, one) - cell%place(:2, other)), dim=1)
        along = 4.0_wp*line(k, one)*line(k, other)
        across = line(3 - k, one)
        n(node) = s**2*along*across
        gradient(k, node) = -2.0_wp*s*below(k)*across
        gradient(3 - k, node) = 0.5_wp*s*along*cell%place(3 - k, one)
        gradient(3, node) = dot_product(below, gradient(:2, node)) - 2.0_wp*s*along*across
      end associate
    end do
  end subroutine evaluate_cone

  !> The barycentric coordinate of a corner in each simplex, and its slope along each coordinate.
  pure subroutine find_barycentric(cell, corner, place, value, slope)
    type(cell_t), intent(in) :: cell
    real(wp), intent(in)  :: corner(3), place(3) !! natural coordinates [-]
    real(wp), intent(out) :: value(3)            !! of a simplex; 1 where there is none [-]
    real(wp), intent(out) :: slope(3)            !! along a coordinate, of its own simplex [-]
    integer :: f

    value = 1.0_wp
    do f = 1, maxval(cell%factor)
      associate (mine => cell%factor == f)
        if (count(mine) == 1) then
          value(f) = 0.5_wp*(1.0_wp + sum(place*corner, mask=mine))
          where (mine) slope = 0.5_wp*corner
        else if (any(mine .and. corner > 0.0_wp)) then
          value(f) = sum(place*corner, mask=mine)
          where (mine) slope = corner
        else
          value(f) = 1.0_wp - sum(place, mask=mine)
          where (mine) slope = -1.0_wp
        end if
      end associate
    end do
  end subroutine find_barycentric

  !> The product of what functions are in each simplex, and its gradient.
  pure subroutine multiply(factor, value, slope, n, gradient)
    integer,  intent(in)  :: factor(3)
    real(wp), intent(in)  :: value(3)     !! of a simplex [-]
    real(wp), intent(in)  :: slope(3)     !! along a coordinate, of its own simplex [-]
    real(wp), intent(out) :: n, gradient(3)
    logical :: is_other(3)
    integer :: i

    n = product(value)
    do i = 1, 3
      is_other = .true.
      is_other(factor(i)) = .false.
      gradient(i) = slope(i)*product(value, mask=is_other)
    end do
  end subroutine multiply

  !> The function of the mid-side node between two corners, and its gradient.
  pure subroutine multiply_along_edge(factor, value, slope, along, n, gradient)
    integer,  intent(in)  :: factor(3)
    real(wp), intent(in)  :: value(3, 2), slope(3, 2) !! of the corners [-]
    integer,  intent(in)  :: along !! the simplex in which they differ
    real(wp), intent(out) :: n, gradient(3)
    real(wp) :: both(3), rise(3)

    both = value(:, 1)
    both(along) = 4.0_wp*value(along, 1)*value(along, 2)
    rise = slope(:, 1)
    where (factor == along) rise = 4.0_wp*(slope(:, 1)*value(along, 2) + &
      value(along, 1)*slope(:, 2))
    call multiply(factor, both, rise, n, gradient)
  end subroutine multiply_along_edge

end module cell_shapes_mod
