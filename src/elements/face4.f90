!> Faces of 3 and 4 nodes: their area vectors, for pressures and for the part of each node.
module face4_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: cross
  implicit none
  private

  public :: face_area_vectors, face_node_areas

  real(wp), parameter :: xi_node(4) = [-1, 1, 1, -1]
  real(wp), parameter :: eta_node(4) = [-1, -1, 1, 1]
  real(wp), parameter :: gauss = 1.0_wp/sqrt(3.0_wp)

contains

  !> int N_a n dA for each node (n outward when the nodes turn anticlockwise seen from outside).
  !>
  !> 2x2 Gauss points integrate this exactly for any quadrilateral, warped ones included.
  pure function face_area_vectors(x) result(vectors)
    real(wp), intent(in) :: x(:, :)          !! (3,3) or (3,4) nodes [length]
    real(wp) :: vectors(3, size(x, 2))       !! [length^2]
    real(wp) :: n(4), normal(3)
    integer :: g, a

    if (size(x, 2) == 3) then
      vectors = spread(cross(x(:, 2) - x(:, 1), x(:, 3) - x(:, 1))/6.0_wp, 2, 3)
      return
    end if
    vectors = 0.0_wp
    do g = 1, 4
      call shape_and_normal(x, g, n, normal)
      do a = 1, 4
        vectors(:, a) = vectors(:, a) + n(a)*normal
      end do
    end do
  end function face_area_vectors

  !> int N_a dA for each node.
  pure function face_node_areas(x) result(areas)
    real(wp), intent(in) :: x(:, :)     !! (3,3) or (3,4) nodes [length]
    real(wp) :: areas(size(x, 2))       !! [length^2]
    real(wp) :: n(4), normal(3)
    integer :: g

    if (size(x, 2) == 3) then
      areas = norm2(cross(x(:, 2) - x(:, 1), x(:, 3) - x(:, 1)))/6.0_wp
      return
    end if
    areas = 0.0_wp
    do g = 1, 4
      call shape_and_normal(x, g, n, normal)
      areas = areas + n*norm2(normal)
    end do
  end function face_node_areas

  !> Shape functions and area-weighted normal at Gauss point `g`.
  pure subroutine shape_and_normal(x, g, n, normal)
    real(wp), intent(in)  :: x(3, 4)
    integer,  intent(in)  :: g
    real(wp), intent(out) :: n(4), normal(3)
    real(wp) :: a(4), b(4)

    a = 1.0_wp + gauss*xi_node(g)*xi_node
    b = 1.0_wp + gauss*eta_node(g)*eta_node
    n = 0.25_wp*a*b
    normal = cross(matmul(x, 0.25_wp*xi_node*b), matmul(x, 0.25_wp*a*eta_node))
  end subroutine shape_and_normal

end module face4_mod
