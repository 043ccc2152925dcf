!> Obstacles that press on faces from inside the body: what presses there would pull.
!> docs/theory.md section 6 and (9.10).
module inner_sides_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: cross
  use surfaces_mod, only: split_faces
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use increment_report_mod, only: contact_fields_t
  use obstacle_gaps_mod, only: has_closest_point
  implicit none
  private

  public :: turn_inner_sides

  real(wp), parameter :: from_inside = 0.2_wp
  !! cosine of a contact normal and the outward normal of the faces that it presses, at most: those
  !! of the rim of a block come to 0, in a coarse mesh to a little more [-]

contains

  !> Give normal reactions the other sign where the normal of a plane, sphere or cylinder points out
  !> of the faces: what presses there from inside is adhesion.
  pure subroutine turn_inner_sides(scene, points, u, contact)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: u(:, :)              !! (3,n_nodes) displacements [length]
    type(contact_fields_t), intent(inout) :: contact
    !! its frames; reactions lose their sign, and what is inside does not stay closed
    real(wp), allocatable :: outward(:, :)       !! (3,n_nodes) of a pair's nodes [length^2]
    integer, allocatable :: parts(:, :), whole(:)
    integer :: pair, i

    allocate (outward(3, size(u, 2)))
    do pair = 1, size(scene%pairs)
      if (scene%pairs(pair)%master == 0) cycle
      if (.not. has_closest_point(scene%obstacles(scene%pairs(pair)%master))) cycle
      associate (surface => scene%surfaces(scene%pairs(pair)%surface))
        if (.not. allocated(surface%faces)) cycle
        outward(:, surface%nodes) = 0.0_wp
        call split_faces(surface%faces, scene%mesh%connectivity, parts, whole)
        call add_faces(parts, scene%mesh%coordinates, u, outward)
      end associate
      do i = points%first(pair), points%first(pair + 1) - 1
        associate (out => outward(:, points%node(i)))
          if (dot_product(contact%frame(:, 1, i), out) > from_inside*norm2(out)) then
            contact%reaction(1, i) = -contact%reaction(1, i)
            contact%stays(i) = .false.
          end if
        end associate
      end do
    end do
  end subroutine turn_inner_sides

  !> Add the outward areas of faces where they are displaced to, times two, to their nodes.
  pure subroutine add_faces(faces, x, u, outward)
    integer, intent(in) :: faces(:, :)           !! (4,n) anticlockwise from outside; 0: none
    real(wp), intent(in) :: x(:, :), u(:, :)     !! (3,n_nodes) places, displacements [length]
    real(wp), intent(inout) :: outward(:, :)     !! (3,n_nodes) [length^2]
    real(wp) :: area(3), place(3, size(faces, 1))
    integer :: f, k, n

    do f = 1, size(faces, 2)
      n = count(faces(:, f) > 0)
      associate (nodes => faces(:n, f))
        place(:, :n) = x(:, nodes) + u(:, nodes)
        area = 0.0_wp
        do k = 2, n - 1
          area = area + cross(place(:, k) - place(:, 1), place(:, k + 1) - place(:, 1))
        end do
        outward(:, nodes) = outward(:, nodes) + spread(area, 2, n)
      end associate
    end do
  end subroutine add_faces

end module inner_sides_mod
