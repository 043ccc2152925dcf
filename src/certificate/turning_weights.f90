!> What bodies that turn about an axis weigh where they are displaced, for the certificate:
!>
!>     f_a = sum of w density N_a gradient u
!>
!> over the points of an element, u there and w the undeformed volumes of the points. An element of
!> first order is the hexahedron some of whose nodes are one. docs/theory.md (8.40).
module turning_weights_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: determinant
  use cells_mod, only: cells, has_middles
  use cell_shapes_mod, only: shape_functions, shape_gradients_at
  use connectivity_mod, only: nodes_of_element, nodes_of_hexahedron
  use scene_mod, only: scene_t
  use deformed_forces_mod, only: gauss, corner, local_gradients
  implicit none
  private

  public :: add_turning_weights

contains

  !> Add what the displacement adds to the weights of all regions.
  pure subroutine add_turning_weights(scene, gradient, u, f)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: gradient(:, :, :) !! (3,3,n_regions) as of following_t [1/time^2]
    real(wp), intent(in) :: u(:, :)           !! (3,n_nodes) [length]
    real(wp), intent(inout) :: f(:, :)        !! (3,n_nodes) [force]
    integer :: r, i

    do r = 1, size(gradient, 3)
      if (.not. any(abs(gradient(:, :, r)) > 0.0_wp)) cycle
      do i = 1, size(scene%regions(r)%elements)
        call add_element(scene, scene%regions(r)%elements(i), gradient(:, :, r), u, f)
      end do
    end do
  end subroutine add_turning_weights

  pure subroutine add_element(scene, e, gradient, u, f)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: e
    real(wp), intent(in) :: gradient(3, 3), u(:, :)
    real(wp), intent(inout) :: f(:, :)
    real(wp) :: n(8), volume
    integer :: g, a, nodes(8)

    associate (density => scene%materials(scene%mesh%material(e))%density, &
               cell => cells(scene%mesh%connectivity%cell(e)), x => scene%mesh%coordinates)
      if (has_middles(scene%mesh%connectivity%cell(e))) then
        associate (all => nodes_of_element(scene%mesh%connectivity, e))
          do g = 1, cell%n_points
            volume = cell%weight(g)*determinant(matmul(x(:, all), &
              transpose(shape_gradients_at(cell, cell%point(:, g)))))
            associate (n => shape_functions(cell, cell%point(:, g)))
              f(:, all) = f(:, all) + spread(matmul(gradient, matmul(u(:, all), n)), 2, &
                size(all))*spread(density*volume*n, 1, 3)
            end associate
          end do
        end associate
        return
      end if
      nodes = nodes_of_hexahedron(scene%mesh%connectivity, e)
      do g = 1, 8
        n = [(product(1.0_wp + gauss*corner(:, a)*corner(:, g))/8.0_wp, a=1, 8)]
        volume = determinant(matmul(x(:, nodes) - spread(x(:, nodes(1)), 2, 8), &
          transpose(local_gradients(gauss*corner(:, g)))))
        do a = 1, 8
          f(:, nodes(a)) = f(:, nodes(a)) + density*volume*n(a)*matmul(gradient, matmul(u(:, &
            nodes), n))
        end do
      end do
    end associate
  end subroutine add_element

end module turning_weights_mod
