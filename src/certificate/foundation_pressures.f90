!> The forces of foundations by the certificate's own code: pressures on the faces that they hold.
!>
!> Of the displacement along the normal at each point of the face's quadrature, which is what a
!> foundation is on a mesh.
module foundation_pressures_mod
  use kinds_mod, only: wp
  use cells_mod, only: face_nodes
  use connectivity_mod, only: all_nodes_of_face
  use face_shapes_mod, only: face_functions, face_gradients, face_rule_t, rule_of
  use scene_mod, only: scene_t
  use increment_forces_mod, only: increment_forces_t
  implicit none
  private

  public :: add_foundation_pressures

contains

  !> Add what foundations press at the nodes of their faces, and the rounding of that.
  pure subroutine add_foundation_pressures(scene, u, forces)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: u(:, :)                   !! (3,n_nodes) [length]
    type(increment_forces_t), intent(inout) :: forces
    real(wp), parameter :: operations = 32.0_wp ! rounded ones that add up, as of (6.2)
    type(face_rule_t) :: rule
    real(wp) :: along_xi(3), along_eta(3), area(3), moved(3), force(3), size_of_force, shape
    real(wp) :: slope(2, face_nodes), functions(face_nodes)
    integer :: nodes(face_nodes), i, f, g, a, n

    if (.not. allocated(scene%foundations)) return
    do i = 1, size(scene%foundations)
      associate (faces => scene%surfaces(scene%foundations(i)%surface)%faces)
        do f = 1, size(faces, 2)
          nodes = all_nodes_of_face(scene%mesh%connectivity, faces(1, f), faces(2, f))
          n = count(nodes > 0)
          rule = rule_of(n)
          do g = 1, rule%n
            slope(:, :n) = face_gradients(n, rule%point(:, g))
            functions(:n) = face_functions(n, rule%point(:, g))
            along_xi = 0.0_wp
            along_eta = 0.0_wp
            moved = 0.0_wp
            do a = 1, n
              along_xi = along_xi + slope(1, a)*scene%mesh%coordinates(:, nodes(a))
              along_eta = along_eta + slope(2, a)*scene%mesh%coordinates(:, nodes(a))
              moved = moved + functions(a)*u(:, nodes(a))
            end do
            area = [along_xi(2)*along_eta(3) - along_xi(3)*along_eta(2), along_xi(3)* &
              along_eta(1) - along_xi(1)*along_eta(3), along_xi(1)*along_eta(2) - along_xi(2)* &
              along_eta(1)]
            ! (a . u) a/|a| is the area times the displacement along the normal, along it.
            shape = rule%weight(g)*scene%foundations(i)%stiffness/sqrt(sum(area**2))
            force = shape*dot_product(area, moved)*area
            size_of_force = shape*sum(area**2)*maxval(abs(u(:, nodes(:n))))
            do a = 1, n
              forces%external(:, nodes(a)) = forces%external(:, nodes(a)) - functions(a)*force
              forces%rounding(nodes(a)) = forces%rounding(nodes(a)) + operations* &
                epsilon(1.0_wp)*abs(functions(a))*size_of_force
            end do
          end do
        end do
      end associate
    end do
  end subroutine add_foundation_pressures

end module foundation_pressures_mod
