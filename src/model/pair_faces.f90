!> The faces of the two sides of a pair: of two surfaces, or what of one that touches itself is
!> slave and what is master now.
module pair_faces_mod
  use contact_points_mod, only: contact_points_t
  use scene_mod, only: scene_t
  use surfaces_mod, only: all_nodes_of
  implicit none
  private

  public :: touches_itself, slave_faces, master_faces, is_of_slave

  integer, parameter :: slave = 1, master = 2 !! as of own_sides_t

contains

  !> Whether a pair is of one surface with itself.
  pure logical function touches_itself(points, pair)
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair

    touches_itself = .false.
    if (allocated(points%own_sides)) touches_itself = allocated(points%own_sides(pair)%of_face)
  end function touches_itself

  !> The slave faces of a pair.
  pure function slave_faces(scene, points, pair) result(faces)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair
    integer, allocatable :: faces(:, :) !! (2,n) element, face
    integer :: f

    associate (all => scene%surfaces(scene%pairs(pair)%surface)%faces)
      faces = all
      if (touches_itself(points, pair)) faces = all(:, pack([(f, f=1, size(all, 2))], &
        points%own_sides(pair)%of_face == slave))
    end associate
  end function slave_faces

  !> The faces of a master surface: all, or of one of the sides that concave edges divide it into.
  pure function master_faces(scene, points, pair, side) result(faces)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair
    integer, intent(in), optional :: side !! left out: all
    integer, allocatable :: faces(:, :)   !! (2,n) element, face
    logical, allocatable :: is_one(:)
    integer :: f

    associate (all => scene%surfaces(scene%pairs(pair)%master_surface)%faces)
      allocate (is_one(size(all, 2)), source=.true.)
      if (touches_itself(points, pair)) is_one = points%own_sides(pair)%of_face == master
      if (present(side) .and. allocated(points%sides)) then
        if (points%sides(pair)%n > 1) is_one = is_one .and. points%sides(pair)%of_face == side
      end if
      faces = all(:, pack([(f, f=1, size(all, 2))], is_one))
    end associate
  end function master_faces

  !> Which nodes are of the slave side of a pair, and not of its master.
  pure function is_of_slave(scene, points, pair) result(is_of)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair
    logical :: is_of(scene%mesh%n_nodes)
    logical :: has(0:scene%mesh%n_nodes)
    integer, allocatable :: nodes(:, :)

    is_of = .false.
    associate (of => scene%pairs(pair))
      if (touches_itself(points, pair)) then
        has = .false.
        nodes = all_nodes_of(slave_faces(scene, points, pair), scene%mesh%connectivity)
        has([nodes]) = .true.
        nodes = all_nodes_of(master_faces(scene, points, pair), scene%mesh%connectivity)
        has([nodes]) = .false.
        is_of = has(1:)
        return
      end if
      is_of(scene%surfaces(of%surface)%nodes) = .true.
      if (of%master == 0) is_of(scene%surfaces(of%master_surface)%nodes) = .false.
    end associate
  end function is_of_slave

end module pair_faces_mod
