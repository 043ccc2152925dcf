!> A scene without some of its elements. Nodes stay, and keep their numbers; those that no element
!> has any more are in no set, surface or output, and carry neither supports nor loads.
module part_of_scene_mod
  use connectivity_mod, only: some_elements, all_nodes_of_face, corners_in
  use mesh_mod, only: find_bodies
  use surfaces_mod, only: surface_t, bare_nodes
  use obstacles_mod, only: ref_nodes
  use loads_mod, only: load_step_t, nodal_value_t
  use controls_mod, only: print_t
  use scene_mod, only: scene_t, named_set_t
  implicit none
  private

  public :: leave_out_elements

contains

  !> Leave out all elements but some. What constraints join must be left out or kept together.
  subroutine leave_out_elements(scene, kept)
    type(scene_t), intent(inout) :: scene
    logical, intent(in) :: kept(:) !! (n_elements)
    integer :: number(size(kept)) !! of the elements from now on; 0: left out
    logical :: had(scene%mesh%n_nodes), is_left_out(scene%mesh%n_nodes)
    integer :: e, i

    number = 0
    number(pack([(e, e=1, size(kept))], kept)) = [(e, e=1, count(kept))]
    had = scene%mesh%piece > 0
    ! Of the faces as they are numbered so far.
    do i = 1, size(scene%surfaces)
      call keep_surface(scene, kept, scene%surfaces(i))
    end do
    associate (mesh => scene%mesh)
      mesh%connectivity = some_elements(mesh%connectivity, pack([(e, e=1, size(kept))], kept))
      mesh%element_id = pack(mesh%element_id, kept)
      mesh%element_kind = pack(mesh%element_kind, kept)
      mesh%material = pack(mesh%material, kept)
      mesh%n_elements = count(kept)
      call find_bodies(mesh, scene%constraints)
      is_left_out = had .and. mesh%piece == 0
      if (allocated(mesh%skin)) mesh%skin = mesh%skin(:, pack([(i, i=1, size(mesh%skin, 2))], &
        [(all(mesh%piece(mesh%skin(:corners_in(mesh%skin(:, i)), i)) > 0), i=1, &
        size(mesh%skin, 2))]))
      is_left_out(ref_nodes(scene%obstacles)) = .false.
    end associate
    do i = 1, size(scene%surfaces)
      associate (surface => scene%surfaces(i))
        surface%faces(1, :) = number(surface%faces(1, :))
        surface%nodes = pack(surface%nodes, .not. is_left_out(surface%nodes))
      end associate
    end do
    do i = 1, size(scene%regions)
      scene%regions(i)%elements = left_of(scene%regions(i)%elements, number)
    end do
    do i = 1, size(scene%gaps)
      scene%gaps(i)%nodes = pack(scene%gaps(i)%nodes, .not. is_left_out(scene%gaps(i)%nodes))
    end do
    do i = 1, size(scene%element_sets)
      scene%element_sets(i)%members = left_of(scene%element_sets(i)%members, number)
    end do
    do i = 1, size(scene%node_sets)
      associate (set => scene%node_sets(i))
        set%members = pack(set%members, .not. is_left_out(set%members))
      end associate
    end do
    call drop_empty(scene%element_sets)
    call drop_empty(scene%node_sets)
    if (allocated(scene%output%prints)) call keep_prints(number, is_left_out, scene%output%prints)
    do i = 1, size(scene%steps)
      call keep_loads(is_left_out, scene%steps(i))
    end do
  end subroutine leave_out_elements

  !> The faces of a surface that elements keep, with their nodes and those that had no face before.
  pure subroutine keep_surface(scene, kept, surface)
    type(scene_t), intent(in) :: scene
    logical, intent(in) :: kept(:)
    type(surface_t), intent(inout) :: surface
    logical :: has(0:scene%mesh%n_nodes)
    integer, allocatable :: left(:)
    integer :: f, i

    has = .false.
    has(bare_nodes(surface, scene%mesh%connectivity, scene%mesh%n_nodes)) = .true.
    left = pack([(f, f=1, size(surface%faces, 2))], kept(surface%faces(1, :)))
    surface%faces = surface%faces(:, left)
    do f = 1, size(left)
      has(all_nodes_of_face(scene%mesh%connectivity, surface%faces(1, f), surface%faces(2, f))) &
        = .true.
    end do
    has(0) = .false.
    surface%nodes = pack([(i, i=1, scene%mesh%n_nodes)], has(1:))
  end subroutine keep_surface

  !> Numbers of the elements of a list that are kept.
  pure function left_of(elements, number) result(left)
    integer, intent(in) :: elements(:)
    integer, intent(in) :: number(:) !! (n_elements) from now on; 0: left out
    integer, allocatable :: left(:)

    left = pack(number(elements), number(elements) > 0)
  end function left_of

  subroutine drop_empty(sets)
    type(named_set_t), allocatable, intent(inout) :: sets(:)
    integer :: i

    sets = sets(pack([(i, i=1, size(sets))], [(size(sets(i)%members) > 0, i=1, size(sets))]))
  end subroutine drop_empty

  !> What is printed of what is kept.
  subroutine keep_prints(number, is_left_out, prints)
    integer, intent(in) :: number(:)
    logical, intent(in) :: is_left_out(:) !! (n_nodes)
    type(print_t), allocatable, intent(inout) :: prints(:)
    integer :: i

    do i = 1, size(prints)
      if (prints(i)%of_springs) cycle ! all are kept
      if (prints(i)%of_elements) then
        prints(i)%members = left_of(prints(i)%members, number)
      else
        prints(i)%members = pack(prints(i)%members, .not. is_left_out(prints(i)%members))
        prints(i)%summed = pack(prints(i)%summed, .not. is_left_out(prints(i)%summed))
      end if
    end do
    prints = prints(pack([(i, i=1, size(prints))], [(size(prints(i)%members) > 0, &
      i=1, size(prints))]))
  end subroutine keep_prints

  !> Supports, forces and temperatures of nodes that are kept.
  pure subroutine keep_loads(is_left_out, step)
    logical, intent(in) :: is_left_out(:) !! (n_nodes)
    type(load_step_t), intent(inout) :: step

    call keep(step%boundary)
    call keep(step%forces)
    call keep(step%temperatures)

  contains

    pure subroutine keep(values)
      type(nodal_value_t), allocatable, intent(inout) :: values(:)

      if (allocated(values)) values = pack(values, .not. is_left_out(values%node))
    end subroutine keep

  end subroutine keep_loads

end module part_of_scene_mod
