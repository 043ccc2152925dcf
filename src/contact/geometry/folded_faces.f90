!> Faces of contact surfaces that have folded: seen along its normal a corner points inwards. What
!> is integrated over faces is nothing there: shape functions have no inverse, and overlaps are of
!> convex faces. docs/theory.md section 11.
module folded_faces_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: cross
  use cells_mod, only: face_corners
  use connectivity_mod, only: corners_in
  use scene_mod, only: scene_t
  use surfaces_mod, only: nodes_of
  use contact_points_mod, only: contact_points_t
  use increment_report_mod, only: contact_fields_t
  use obstacle_shapes_mod, only: is_before_faces
  use face_overlap_mod, only: outward_normal
  implicit none
  private

  public :: find_folded

contains

  !> The first face that has folded and takes part in contact, of all pairs that are placed anew.
  pure subroutine find_folded(scene, points, contact, u, surface, nodes)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(in) :: contact !! at the end of an increment
    real(wp), intent(in) :: u(:, :)               !! (3,n_nodes) [length]
    integer, intent(out) :: surface               !! 0: none has
    integer, intent(out) :: nodes(face_corners)   !! of the face; the fourth of a triangle is 0
    logical :: takes_part(scene%mesh%n_nodes)
    integer :: pair, i

    nodes = 0
    do pair = 1, size(scene%pairs)
      associate (of => scene%pairs(pair), weights => contact%weights)
        if (of%small_sliding .or. .not. is_before_faces(of, scene%obstacles)) cycle
        takes_part = .false.
        do i = points%first(pair), points%first(pair + 1) - 1
          if (.not. contact%covered_area(i) > 0.0_wp) cycle
          takes_part(points%node(i)) = .true.
          if (of%master > 0) cycle
          takes_part(weights%node(weights%first(i):weights%first(i + 1) - 1)) = .true.
        end do
        if (.not. any(takes_part)) cycle
        surface = of%surface
        call look_at(scene, u, surface, takes_part, nodes)
        if (nodes(1) > 0) return
        surface = of%master_surface
        if (surface > 0) call look_at(scene, u, surface, takes_part, nodes)
        if (nodes(1) > 0) return
      end associate
    end do
    surface = 0
  end subroutine find_folded

  !> The first folded face of a surface.
  pure subroutine look_at(scene, u, surface, takes_part, nodes)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: u(:, :)           !! (3,n_nodes) [length]
    integer, intent(in) :: surface
    logical, intent(in) :: takes_part(:)      !! (n_nodes)
    integer, intent(inout) :: nodes(face_corners) !! unchanged where there is none
    integer :: faces(face_corners, size(scene%surfaces(surface)%faces, 2)), f

    faces = nodes_of(scene%surfaces(surface)%faces, scene%mesh%connectivity)
    do f = 1, size(faces, 2)
      associate (corners => faces(:corners_in(faces(:, f)), f))
        if (.not. any(takes_part(corners))) cycle
        if (.not. is_folded(scene%mesh%coordinates(:, corners) + u(:, corners))) cycle
      end associate
      nodes = faces(:, f)
      return
    end do
  end subroutine look_at

  !> Whether the Jacobian of a face, seen along its normal, is not positive at a corner.
  pure logical function is_folded(x)
    real(wp), intent(in) :: x(:, :) !! (3,3) or (3,4) corners, anticlockwise from outside [length]
    real(wp) :: normal(3)
    integer :: k, n

    normal = outward_normal(x)
    n = size(x, 2)
    is_folded = .false.
    do k = 1, n
      is_folded = is_folded .or. .not. dot_product(normal, cross(x(:, mod(k, n) + 1) - x(:, k), &
        x(:, mod(k + n - 2, n) + 1) - x(:, k))) > 0.0_wp
    end do
  end function is_folded

end module folded_faces_mod
