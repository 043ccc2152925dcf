!> The sides of surfaces that touch themselves, where nodes are: found before a run begins, and anew
!> where its increments begin. docs/theory.md section 11.
module own_sides_mod
  use contact_points_mod, only: contact_points_t, own_sides_t
  use kinds_mod, only: wp
  use pair_faces_mod, only: touches_itself
  use scene_mod, only: scene_t
  use self_contact_mod, only: divide_surface
  use surfaces_mod, only: nodes_of
  implicit none
  private

  public :: find_own_sides, renew_own_sides, list_own_sides, take_own_sides

contains

  !> The sides in the mesh.
  subroutine find_own_sides(scene, points)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(inout) :: points !! gets its `own_sides` where there are any
    integer :: pair

    if (.not. any(is_one_surface(scene))) return
    allocate (points%own_sides(size(scene%pairs)))
    do pair = 1, size(scene%pairs)
      associate (of => scene%pairs(pair))
        if (of%surface /= of%master_surface) cycle
        call divide_surface(nodes_of(scene%surfaces(of%surface)%faces, scene%mesh%connectivity), &
          scene%mesh%coordinates, points%own_sides(pair)%of_face)
      end associate
    end do
  end subroutine find_own_sides

  !> Which pairs are of one surface.
  pure function is_one_surface(scene) result(is_one)
    type(scene_t), intent(in) :: scene
    logical :: is_one(size(scene%pairs))

    is_one = scene%pairs%surface == scene%pairs%master_surface
  end function is_one_surface

  !> The sides where an increment begins: faces that press keep theirs. Rows that stay those of the
  !> mesh keep its sides.
  subroutine renew_own_sides(scene, points, u, reaction, are_others)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(inout) :: points
    real(wp), intent(in) :: u(:, :)        !! (3,n_nodes) [length]
    real(wp), intent(in) :: reaction(:, :) !! (3,n_points) [force]
    logical, intent(out) :: are_others     !! than before
    type(own_sides_t) :: before
    logical :: touches(scene%mesh%n_nodes)
    integer :: pair, i

    are_others = .false.
    do pair = 1, size(scene%pairs)
      if (.not. touches_itself(points, pair) .or. scene%pairs(pair)%small_sliding) cycle
      touches = .false.
      do i = points%first(pair), points%first(pair + 1) - 1
        if (any(abs(reaction(:, i)) > 0.0_wp)) touches(points%node(i)) = .true.
      end do
      before = points%own_sides(pair)
      call divide_surface(nodes_of(scene%surfaces(scene%pairs(pair)%surface)%faces, &
        scene%mesh%connectivity), scene%mesh%coordinates + u, points%own_sides(pair)%of_face, &
        touches=touches)
      are_others = are_others .or. any(points%own_sides(pair)%of_face /= &
        before%of_face)
    end do
  end subroutine renew_own_sides

  !> The sides of all such pairs, one after the other, for a run to be continued.
  pure function list_own_sides(points) result(sides)
    type(contact_points_t), intent(in) :: points
    real(wp), allocatable :: sides(:, :) !! (1,n)
    integer :: pair

    allocate (sides(1, 0))
    if (.not. allocated(points%own_sides)) return
    do pair = 1, size(points%own_sides)
      if (touches_itself(points, pair)) sides = reshape([sides, real(points%own_sides(pair)% &
        of_face, wp)], [1, size(sides) + size(points%own_sides(pair)%of_face)])
    end do
  end function list_own_sides

  !> Put them back.
  pure subroutine take_own_sides(sides, points)
    real(wp), intent(in) :: sides(:, :) !! as of list_own_sides
    type(contact_points_t), intent(inout) :: points
    integer :: pair, n

    if (.not. allocated(points%own_sides)) return
    n = 0
    do pair = 1, size(points%own_sides)
      if (.not. touches_itself(points, pair)) cycle
      associate (of_face => points%own_sides(pair)%of_face)
        of_face = nint(sides(1, n + 1:n + size(of_face)))
        n = n + size(of_face)
      end associate
    end do
  end subroutine take_own_sides

end module own_sides_mod
