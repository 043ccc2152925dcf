!> What bodies that turn about an axis weigh where they are displaced, for the certificate:
!>
!>     f_a = int density N_a gradient u dV,    u = sum N_b u_b
!>
!> over the undeformed element, exactly, by points of the certificate's own: a cell is a product of
!> simplices, and a point of a simplex divides what earlier coordinates leave of it.
!> docs/theory.md (8.40).
module turning_weights_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: determinant
  use cells_mod, only: cells, has_middles
  use cell_shapes_mod, only: shape_functions, shape_gradients_at
  use connectivity_mod, only: nodes_of_element
  use scene_mod, only: scene_t
  implicit none
  private

  public :: add_turning_weights, points_t, find_points

  !> Points in a cell, and its shape functions there.
  type :: points_t
    real(wp), allocatable :: weight(:)      !! (n_points) [-]
    real(wp), allocatable :: value(:, :)    !! (n_nodes,n_points) [-]
    real(wp), allocatable :: slope(:, :, :) !! (3,n_nodes,n_points) [-]
  end type points_t

contains

  !> Add what the displacement adds to the weights of all regions.
  pure subroutine add_turning_weights(scene, gradient, u, f)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: gradient(:, :, :) !! (3,3,n_regions) as of following_t [1/time^2]
    real(wp), intent(in) :: u(:, :)           !! (3,n_nodes) [length]
    real(wp), intent(inout) :: f(:, :)        !! (3,n_nodes) [force]
    type(points_t) :: of_cell(size(cells))   !! those that are needed
    integer :: r, i

    do r = 1, size(gradient, 3)
      if (.not. any(abs(gradient(:, :, r)) > 0.0_wp)) cycle
      do i = 1, size(scene%regions(r)%elements)
        associate (cell => scene%mesh%connectivity%cell(scene%regions(r)%elements(i)))
          if (.not. allocated(of_cell(cell)%weight)) call find_points(cell, of_cell(cell))
          call add_element(scene, scene%regions(r)%elements(i), of_cell(cell), gradient(:, :, r), &
            u, f)
        end associate
      end do
    end do
  end subroutine add_turning_weights

  pure subroutine add_element(scene, e, points, gradient, u, f)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: e
    type(points_t), intent(in) :: points   !! of its cell
    real(wp), intent(in) :: gradient(3, 3), u(:, :)
    real(wp), intent(inout) :: f(:, :)
    real(wp) :: weight(3), volume
    integer :: g, a

    associate (nodes => nodes_of_element(scene%mesh%connectivity, e), &
               density => scene%materials(scene%mesh%material(e))%density)
      associate (x => scene%mesh%coordinates(:, nodes) - spread(scene%mesh%coordinates(:, &
                 nodes(1)), 2, size(nodes)))
        do g = 1, size(points%weight)
          volume = points%weight(g)*determinant(matmul(x, transpose(points%slope(:, :, g))))
          weight = density*volume*matmul(gradient, matmul(u(:, nodes), points%value(:, g)))
          do a = 1, size(nodes)
            f(:, nodes(a)) = f(:, nodes(a)) + points%value(a, g)*weight
          end do
        end do
      end associate
    end associate
  end subroutine add_element

  !> Points by which the integral is exact: of polynomials that have degree 9 along each line where
  !> there are mid-side nodes, and degree 4 where there are none.
  pure subroutine find_points(cell, points)
    integer, intent(in) :: cell          !! row of the table of cells
    type(points_t), intent(out) :: points
    real(wp), allocatable :: line(:), part(:)
    real(wp) :: place(3)
    integer :: i, j, k, g

    allocate (line(merge(5, 3, has_middles(cell))))
    allocate (part, mold=line)
    call divide_line(line, part)
    associate (n => size(line)**3, n_nodes => cells(cell)%n_nodes)
      allocate (points%weight(n), points%value(n_nodes, n), points%slope(3, n_nodes, n))
    end associate
    g = 0
    do k = 1, size(line)
      do j = 1, size(line)
        do i = 1, size(line)
          g = g + 1
          call place_in_cell(cells(cell)%factor, line([i, j, k]), place, points%weight(g))
          points%weight(g) = points%weight(g)*product(part([i, j, k]))
          points%value(:, g) = shape_functions(cells(cell), place)
          points%slope(:, :, g) = shape_gradients_at(cells(cell), place)
        end do
      end do
    end do
  end subroutine find_points

  !> The natural coordinates of a point of the unit cube, and the volume that a unit there has.
  pure subroutine place_in_cell(factor, t, place, volume)
    integer,  intent(in)  :: factor(3) !! as of cell_t
    real(wp), intent(in)  :: t(3)      !! from 0 to 1
    real(wp), intent(out) :: place(3), volume
    real(wp) :: left
    integer :: f, i

    place = t
    volume = 1.0_wp
    do f = 1, maxval(factor)
      if (count(factor == f) == 1) then
        where (factor == f) place = 2.0_wp*t - 1.0_wp
        volume = 2.0_wp*volume
        cycle
      end if
      left = 1.0_wp
      do i = 1, 3
        if (factor(i) /= f) cycle
        place(i) = t(i)*left
        volume = volume*left
        left = left - place(i)
      end do
    end do
    if (all(factor > 0)) return
    where (factor > 0) place = place*(1.0_wp - t(3)) ! a cone, narrower towards its apex
    volume = volume*(1.0_wp - t(3))**2
  end subroutine place_in_cell

  !> Gauss's points between 0 and 1 and their weights: the roots of Legendre's polynomial.
  pure subroutine divide_line(line, part)
    real(wp), intent(out) :: line(:), part(:) !! (n), their sum 1
    real(wp), parameter :: pi = acos(-1.0_wp)
    real(wp) :: x, p, slope, before(2)
    integer :: i, k, n, step

    n = size(line)
    do i = 1, n
      x = cos(pi*(real(i, wp) - 0.25_wp)/(real(n, wp) + 0.5_wp))
      do step = 1, 8 ! Newton's converge in 4
        p = x
        before = [1.0_wp, 0.0_wp]
        do k = 2, n
          before = [p, before(1)]
          p = (real(2*k - 1, wp)*x*before(1) - real(k - 1, wp)*before(2))/real(k, wp)
        end do
        slope = real(n, wp)*(before(1) - x*p)/(1.0_wp - x**2)
        x = x - p/slope
      end do
      line(i) = 0.5_wp*(1.0_wp + x)
      part(i) = 1.0_wp/((1.0_wp - x**2)*slope**2)
    end do
  end subroutine divide_line

end module turning_weights_mod
