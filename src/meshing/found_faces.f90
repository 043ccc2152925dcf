!> Elastic foundations: faces that resist displacements along their normals, by a stiffness per
!> area.
!>
!> Each point of a face's quadrature is a spring between its nodes and the ground,
!>
!>     q = sum over the nodes of N_a n . u_a,      k w |x,xi x x,eta|
!>
!> with n the normal of the undeformed face there, w the point's weight. docs/theory.md, section 11.
module found_faces_mod
  use kinds_mod, only: wp
  use cells_mod, only: face_nodes
  use connectivity_mod, only: all_nodes_of_face
  use face_shapes_mod, only: face_functions, face_gradients, face_rule_t, rule_of
  use mesh_mod, only: mesh_t
  use small_matrix_mod, only: cross
  use spring_elements_mod, only: add_spring_element
  implicit none
  private

  public :: found_faces

contains

  !> Add the springs of a foundation, whose id is 0.
  pure subroutine found_faces(mesh, faces, stiffness)
    type(mesh_t), intent(inout) :: mesh
    integer, intent(in) :: faces(:, :)      !! (2,n) element, face
    real(wp), intent(in) :: stiffness       !! [force/length^3]
    type(face_rule_t) :: rule
    integer :: nodes(face_nodes), f, g, n
    real(wp) :: tangent(3, 2), normal(3)

    do f = 1, size(faces, 2)
      nodes = all_nodes_of_face(mesh%connectivity, faces(1, f), faces(2, f))
      n = count(nodes > 0)
      rule = rule_of(n)
      do g = 1, rule%n
        associate (place => rule%point(:, g), of_face => nodes(:n))
          tangent = matmul(mesh%coordinates(:, of_face), transpose(face_gradients(n, place)))
          normal = cross(tangent(:, 1), tangent(:, 2))
          call add_spring_element(mesh%springs, 0, of_face, spread(normal/norm2(normal), 2, n)* &
            spread(face_functions(n, place), 1, 3), stiffness*rule%weight(g)*norm2(normal))
        end associate
      end do
    end do
  end subroutine found_faces

end module found_faces_mod
