!> Faces of 3, 4, 6 and 8 nodes: their area vectors, for pressures and for the part of each node.
module faces_mod
  use kinds_mod, only: wp
  use face_shapes_mod, only: face_rule_t, rule_of, face_functions, face_gradients
  use small_matrix_mod, only: cross
  implicit none
  private

  public :: face_area_vectors, face_node_areas, face_node_moments

contains

  !> int N_a n dA for each node (n outward when the nodes turn anticlockwise seen from outside).
  !>
  !> Exact for any face, warped and curved ones included.
  pure function face_area_vectors(x) result(vectors)
    real(wp), intent(in) :: x(:, :)          !! (3,n) nodes as of all_nodes_of_face [length]
    real(wp) :: vectors(3, size(x, 2))       !! [length^2]
    type(face_rule_t) :: rule
    real(wp) :: n(size(x, 2)), normal(3)
    integer :: g, a

    if (size(x, 2) == 3) then
      vectors = spread(cross(x(:, 2) - x(:, 1), x(:, 3) - x(:, 1))/6.0_wp, 2, 3)
      return
    end if
    vectors = 0.0_wp
    rule = rule_of(size(x, 2))
    do g = 1, rule%n
      call shape_and_normal(x, rule%point(:, g), n, normal)
      do a = 1, size(n)
        vectors(:, a) = vectors(:, a) + rule%weight(g)*n(a)*normal
      end do
    end do
  end function face_area_vectors

  !> int N_a dA for each node. Those of the corners of faces with mid-side nodes are 0 or negative.
  pure function face_node_areas(x) result(areas)
    real(wp), intent(in) :: x(:, :)     !! (3,n) nodes as of all_nodes_of_face [length]
    real(wp) :: areas(size(x, 2))       !! [length^2]
    type(face_rule_t) :: rule
    real(wp) :: n(size(x, 2)), normal(3)
    integer :: g

    if (size(x, 2) == 3) then
      areas = norm2(cross(x(:, 2) - x(:, 1), x(:, 3) - x(:, 1)))/6.0_wp
      return
    end if
    areas = 0.0_wp
    rule = rule_of(size(x, 2))
    do g = 1, rule%n
      call shape_and_normal(x, rule%point(:, g), n, normal)
      areas = areas + rule%weight(g)*n*norm2(normal)
    end do
  end function face_node_areas

  !> int N_a x dA for each node: exact for flat faces.
  pure function face_node_moments(x) result(moments)
    real(wp), intent(in) :: x(:, :)           !! (3,n) nodes as of all_nodes_of_face [length]
    real(wp) :: moments(3, size(x, 2))        !! [length^3]
    type(face_rule_t) :: rule
    real(wp) :: n(size(x, 2)), normal(3), place(3)
    integer :: g, a

    moments = 0.0_wp
    rule = rule_of(size(x, 2))
    do g = 1, rule%n
      call shape_and_normal(x, rule%point(:, g), n, normal)
      place = rule%weight(g)*norm2(normal)*matmul(x, n)
      do a = 1, size(n)
        moments(:, a) = moments(:, a) + n(a)*place
      end do
    end do
  end function face_node_moments

  !> Shape functions and normal, as long as the area is for that of the natural coordinates.
  pure subroutine shape_and_normal(x, place, n, normal)
    real(wp), intent(in)  :: x(:, :)
    real(wp), intent(in)  :: place(2)
    real(wp), intent(out) :: n(:), normal(3)
    real(wp) :: tangent(3, 2)

    n = face_functions(size(x, 2), place)
    tangent = matmul(x, transpose(face_gradients(size(x, 2), place)))
    normal = cross(tangent(:, 1), tangent(:, 2))
  end subroutine shape_and_normal

end module faces_mod
