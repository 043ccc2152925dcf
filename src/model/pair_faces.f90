!> The faces of the two sides of a pair: of two surfaces, or what of one that touches itself is
!> slave and what is master now.
module pair_faces_mod
  use cells_mod, only: face_nodes
  use sorting_mod, only: sort_unique
  use contact_points_mod, only: contact_points_t
  use scene_mod, only: scene_t
  use surfaces_mod, only: all_nodes_of
  implicit none
  private

  public :: touches_itself, can_touch, slave_faces, master_faces, slave_nodes, master_nodes, &
    is_of_slave, nodes_of_faces

  integer, parameter :: slave = 1, master = 2 !! as of own_sides_t

contains

  !> Whether a pair is of one surface with itself.
  pure logical function touches_itself(points, pair)
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair

    touches_itself = .false.
    if (allocated(points%own_sides)) touches_itself = allocated(points%own_sides(pair)%of_face)
  end function touches_itself

  !> Whether two faces of a surface that touches itself are of its two sides.
  pure logical function can_touch(points, pair, one, other)
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair, one, other !! of the surface

    can_touch = sum(points%own_sides(pair)%of_face([one, other])) == slave + master
  end function can_touch

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

  !> The nodes of the slave side of a pair of bodies, each once.
  pure function slave_nodes(scene, points, pair) result(nodes)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair
    integer, allocatable :: nodes(:)

    nodes = scene%surfaces(scene%pairs(pair)%surface)%nodes
    if (touches_itself(points, pair)) nodes = nodes_of_faces(scene, slave_faces(scene, points, &
      pair))
  end function slave_nodes

  !> The same of its master side.
  pure function master_nodes(scene, points, pair) result(nodes)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair
    integer, allocatable :: nodes(:)

    nodes = scene%surfaces(scene%pairs(pair)%master_surface)%nodes
    if (touches_itself(points, pair)) nodes = nodes_of_faces(scene, master_faces(scene, points, &
      pair))
  end function master_nodes

  !> The nodes of faces, ascending, each once.
  pure function nodes_of_faces(scene, faces) result(nodes)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: faces(:, :)   !! (2,n) element, face
    integer, allocatable :: nodes(:)

    nodes = reshape(all_nodes_of(faces, scene%mesh%connectivity), [face_nodes*size(faces, 2)])
    nodes = pack(nodes, nodes > 0)
    call sort_unique(nodes)
  end function nodes_of_faces

  !> Which nodes are of the slave side of a pair, and not of its master.
  pure function is_of_slave(scene, points, pair) result(is_of)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair
    logical :: is_of(scene%mesh%n_nodes)

    is_of = .false.
    is_of(slave_nodes(scene, points, pair)) = .true.
    if (scene%pairs(pair)%master == 0) is_of(master_nodes(scene, points, pair)) = .false.
  end function is_of_slave

end module pair_faces_mod
