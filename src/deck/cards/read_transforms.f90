!> Local directions at the nodes of a set.
!>
!>     *TRANSFORM, NSET=SLOPE             TYPE=R, as without TYPE: rectangular
!>     0.8, 0.6, 0.,  -0.6, 0.8, 0.       a point along local x, one in the local x-y plane
!>     *TRANSFORM, NSET=RING, TYPE=C      cylindrical
!>     0., 0., 0.,  0., 0., 1.            two points of the axis
module read_transforms_mod
  use cards_mod, only: reader_t, report
  use fields_mod, only: end_data, fields_t, next_data_line, real_field
  use kinds_mod, only: wp
  use local_axes_mod, only: gives_directions, transform_t, transforms_t
  use mesh_draft_mod, only: solids
  use options_mod, only: allow_options, card_t, choice_option, name_option, open_card, &
    option_position
  use sets_mod, only: find_set, model_t, report_unknown
  use text_mod, only: to_text
  implicit none
  private

  public :: read_transforms

contains

  !> Read all *TRANSFORM cards.
  subroutine read_transforms(reader, model, transforms)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(transforms_t), intent(out) :: transforms
    type(card_t) :: card
    type(transform_t) :: transform
    integer, allocatable :: nodes(:)
    integer :: k
    logical :: ok

    allocate (transforms%list(0))
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'TRANSFORM') cycle
      if (.not. allocated(transforms%of_node)) then
        allocate (transforms%of_node(model%mesh%n_nodes), source=0)
      end if
      call open_card(reader, k, card)
      call read_options(reader, card, model, transform, nodes)
      call read_points(reader, card, transform, ok)
      if (.not. ok) cycle
      if (model%mesh%plane /= solids .and. .not. is_in_plane(transform)) then
        call report(reader, card%position, 'with elements of a plane local z is z: two points '// &
          'with z = 0, with TYPE=C an axis along z')
        cycle
      end if
      if (transform%cylindrical) then
        transform%a = transform%a - model%mesh%origin
        transform%b = transform%b - model%mesh%origin
      end if
      transforms%list = [transforms%list, transform]
      call give_directions(reader, card, model, nodes, size(transforms%list), transforms%of_node)
    end do
  end subroutine read_transforms

  !> Whether local z is z, with elements of a plane.
  pure logical function is_in_plane(transform)
    type(transform_t), intent(in) :: transform

    is_in_plane = all(abs([transform%a(3), transform%b(3)]) <= 0.0_wp)
    if (transform%cylindrical) is_in_plane = all(abs(transform%a(:2) - transform%b(:2)) <= 0.0_wp)
  end function is_in_plane

  !> NSET= and TYPE=.
  subroutine read_options(reader, card, model, transform, nodes)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(model_t), intent(in) :: model
    type(transform_t), intent(out) :: transform
    integer, allocatable, intent(out) :: nodes(:) !! none after a mistake
    character(:), allocatable :: name
    integer :: choice, found
    logical :: ok

    call allow_options(reader, card)
    transform%position = card%position
    choice = 1
    call choice_option(reader, card, 'TYPE', choice, ok)
    transform%cylindrical = choice == 2
    allocate (nodes(0))
    call name_option(reader, card, 'NSET', .true., name, ok)
    if (.not. ok) return
    found = find_set(model%node_sets, name)
    if (found == 0) then
      call report_unknown(reader, model%node_sets, option_position(card, 'NSET'), name)
    else if (allocated(model%node_sets%list(found)%members)) then
      nodes = model%node_sets%list(found)%members
    end if
  end subroutine read_options

  !> The line of two points.
  subroutine read_points(reader, card, transform, ok)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(transform_t), intent(inout) :: transform
    logical, intent(out) :: ok !! false: a mistake was reported
    character(*), parameter :: form = 'x, y, z of two points'
    type(fields_t) :: fields
    real(wp) :: place(3, 2)
    integer :: i, k
    logical :: found, each

    call next_data_line(reader, card, fields, found, 6, form)
    ok = found
    if (.not. found) then
      call report(reader, card%position, '*TRANSFORM needs a line with '//form)
      return
    end if
    do k = 1, 2
      do i = 1, 3
        call real_field(reader, fields, 3*k - 3 + i, form, place(i, k), each)
        ok = ok .and. each
      end do
    end do
    if (.not. ok) return
    transform%a = place(:, 1)
    transform%b = place(:, 2)
    ok = gives_directions(transform)
    if (.not. ok .and. transform%cylindrical) then
      call report(reader, fields%start, 'the two points are one: they give no axis')
    else if (.not. ok) then
      call report(reader, fields%start, 'the two points lie on a line with the origin: the '// &
        'first gives local x, and the second, beside it, the plane of local x and y')
    end if
    call end_data(reader, card, fields, '*TRANSFORM has one data line')
  end subroutine read_points

  !> Enter the nodes of a card; report those that have local directions already, or cannot have any.
  subroutine give_directions(reader, card, model, nodes, number, of_node)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(model_t), intent(in) :: model
    integer, intent(in) :: nodes(:)
    integer, intent(in) :: number        !! of the card's transform
    integer, intent(inout) :: of_node(:) !! (n_nodes)
    integer :: i

    do i = 1, size(nodes)
      if (model%turned(nodes(i)) > 0) then
        if (any(nodes == model%turned(nodes(i)))) cycle
        call report(reader, option_position(card, 'NSET'), 'node '//to_text(model%mesh%node_id( &
          nodes(i)))//' is the ROT NODE of a rigid body: its directions are those of the REF '// &
          'NODE, which is not in the set')
        return
      else if (model%reference(nodes(i))) then
        call report(reader, option_position(card, 'NSET'), 'node '//to_text(model%mesh%node_id( &
          nodes(i)))//' is the reference node of an obstacle, which moves along x, y, z: it '// &
          'cannot have local directions')
        return
      else if (of_node(nodes(i)) > 0) then
        call report(reader, option_position(card, 'NSET'), 'node '//to_text(model%mesh%node_id( &
          nodes(i)))//' of this set has local directions already, of another *TRANSFORM')
        return
      end if
      of_node(nodes(i)) = number
    end do
  end subroutine give_directions

end module read_transforms_mod
