!> The forces of pressures on surfaces where bodies have taken them, by another formula than the
!> solver's quadrature: x = c + xi a + eta b + xi eta d on a face, so that
!>
!>     int N_k x,xi x x,eta dxi deta = a x b + xi_k/3 a x d + eta_k/3 d x b
!>
!> in closed form. docs/theory.md (8.30).
module pressed_surfaces_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: cross
  use cells_mod, only: face_corners
  use connectivity_mod, only: corners_in, nodes_of_face
  use scene_mod, only: scene_t
  use increment_forces_mod, only: imposed_t
  implicit none
  private

  public :: press_deformed_surfaces

  real(wp), parameter :: xi(4) = [-1, 1, 1, -1], eta(4) = [-1, -1, 1, 1]

contains

  !> The loads of displaced bodies: those that do not follow, and pressures.
  pure subroutine press_deformed_surfaces(scene, u, imposed)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: u(:, :)           !! (3,n_nodes) [length]
    type(imposed_t), intent(inout) :: imposed !! gets external
    integer :: i, k, nodes(face_corners)

    if (.not. allocated(imposed%pressure)) return
    imposed%external = imposed%dead_load
    do i = 1, size(scene%surfaces)
      if (.not. abs(imposed%pressure(i)) > 0.0_wp) cycle
      associate (faces => scene%surfaces(i)%faces)
        do k = 1, size(faces, 2)
          nodes = nodes_of_face(scene%mesh%connectivity, faces(1, k), faces(2, k))
          associate (corners => nodes(:corners_in(nodes)))
            imposed%external(:, corners) = imposed%external(:, corners) - imposed%pressure(i)* &
              area_of_nodes(scene%mesh%coordinates(:, corners) + u(:, corners))
          end associate
        end do
      end associate
    end do
  end subroutine press_deformed_surfaces

  !> int N n da of each node of a face of three or four corners.
  pure function area_of_nodes(x) result(area)
    real(wp), intent(in) :: x(:, :)      !! (3,3) or (3,4) [length]
    real(wp) :: area(3, size(x, 2))      !! [length^2]
    real(wp), dimension(3) :: a, b, d
    integer :: k

    if (size(x, 2) == 3) then
      a = x(:, 1) - x(:, 3)
      b = x(:, 2) - x(:, 3)
      area = spread(cross(a, b)/6.0_wp, 2, 3)
      return
    end if
    ! From differences along edges: faces far from the origin lose no digits.
    a = 0.25_wp*((x(:, 2) - x(:, 1)) + (x(:, 3) - x(:, 4)))
    b = 0.25_wp*((x(:, 4) - x(:, 1)) + (x(:, 3) - x(:, 2)))
    d = 0.25_wp*((x(:, 1) - x(:, 2)) + (x(:, 3) - x(:, 4)))
    do k = 1, 4
      area(:, k) = cross(a, b) + (xi(k)*cross(a, d) + eta(k)*cross(d, b))/3.0_wp
    end do
  end function area_of_nodes

end module pressed_surfaces_mod
