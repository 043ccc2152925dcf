!> The forces of pressures on surfaces where bodies have taken them, by another formula than the
!> solver's quadrature: x = c + xi a + eta b + xi eta d on a face, so that
!>
!>     int N_k x,xi x x,eta dxi deta = a x b + xi_k/3 a x d + eta_k/3 d x b
!>
!> in closed form. With nodes in the middles of the edges they are, of the shape functions alone,
!>
!>     sum over b < c of x_b x x_c int N_a (N_b,xi N_c,eta - N_c,xi N_b,eta) dxi deta
!>
!> docs/theory.md (8.30).
module pressed_surfaces_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: cross
  use cells_mod, only: face_nodes
  use connectivity_mod, only: all_nodes_of_face
  use face_shapes_mod, only: face_functions, face_gradients, is_triangle
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
    real(wp) :: of_six(6, 6, 6), of_eight(8, 8, 8)
    integer :: i, k, nodes(face_nodes)

    if (.not. allocated(imposed%following%pressure)) return
    imposed%external = imposed%dead_load
    of_six = products_of(6)
    of_eight = products_of(8)
    do i = 1, size(scene%surfaces)
      if (.not. abs(imposed%following%pressure(i)) > 0.0_wp) cycle
      associate (faces => scene%surfaces(i)%faces, pressure => imposed%following%pressure(i))
        do k = 1, size(faces, 2)
          nodes = all_nodes_of_face(scene%mesh%connectivity, faces(1, k), faces(2, k))
          associate (of_face => nodes(:count(nodes > 0)))
            associate (x => scene%mesh%coordinates(:, of_face) + u(:, of_face), &
                       force => imposed%external)
              select case (size(of_face))
              case (6)
                force(:, of_face) = force(:, of_face) - pressure*area_by(of_six, x)
              case (8)
                force(:, of_face) = force(:, of_face) - pressure*area_by(of_eight, x)
              case default
                force(:, of_face) = force(:, of_face) - pressure*area_of_nodes(x)
              end select
            end associate
          end associate
        end do
      end associate
    end do
  end subroutine press_deformed_surfaces

  !> int N_a (N_b,xi N_c,eta - N_c,xi N_b,eta) dxi deta: Gauss's 4 x 4 points, of a triangle in the
  !> square that it is where two corners are one.
  pure function products_of(n) result(products)
    integer, intent(in) :: n               !! nodes of the face: 6 or 8
    real(wp) :: products(n, n, n)          !! (a,b,c) [-]
    real(wp), parameter :: inner = sqrt(3.0_wp/7.0_wp - 2.0_wp/7.0_wp*sqrt(1.2_wp)), &
      outer = sqrt(3.0_wp/7.0_wp + 2.0_wp/7.0_wp*sqrt(1.2_wp)), part = sqrt(30.0_wp)/36.0_wp
    real(wp), parameter :: line(4) = [-outer, -inner, inner, outer]
    real(wp), parameter :: weights(4) = [0.5_wp - part, 0.5_wp + part, 0.5_wp + part, 0.5_wp - part]
    real(wp) :: place(2), weight, slope(2, n)
    integer :: i, j, b, c

    products = 0.0_wp
    do i = 1, 4
      do j = 1, 4
        place = [line(i), line(j)]
        weight = weights(i)*weights(j)
        if (is_triangle(n)) then
          place(1) = 0.5_wp*(1.0_wp + line(i))
          place(2) = 0.5_wp*(1.0_wp + line(j))*(1.0_wp - place(1))
          weight = 0.25_wp*weight*(1.0_wp - place(1))
        end if
        slope = face_gradients(n, place)
        do c = 1, n
          do b = 1, n
            products(:, b, c) = products(:, b, c) + weight*(slope(1, b)*slope(2, c) - &
              slope(1, c)*slope(2, b))*face_functions(n, place)
          end do
        end do
      end do
    end do
  end function products_of

  !> int N n da of each node, by these.
  pure function area_by(products, x) result(area)
    real(wp), intent(in) :: products(:, :, :) !! (n,n,n) as of products_of [-]
    real(wp), intent(in) :: x(:, :)           !! (3,n) [length]
    real(wp) :: area(3, size(x, 2))           !! [length^2]
    integer :: b, c

    area = 0.0_wp
    do c = 1, size(x, 2)
      do b = 1, c - 1
        area = area + spread(cross(x(:, b) - x(:, 1), x(:, c) - x(:, 1)), 2, size(x, 2))* &
          spread(products(:, b, c), 1, 3)
      end do
    end do
  end function area_by

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
