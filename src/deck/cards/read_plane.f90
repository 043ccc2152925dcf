!> Elements of a plane: whether a deck computes them, how thick they are, and what is not available
!> with them.
!>
!>     *ELEMENT, TYPE=CPE4, ELSET=BODY
!>     1,  1, 2, 4, 3                    counterclockwise, nodes in the plane z = 0
!>     *SOLID SECTION, ELSET=BODY, MATERIAL=STEEL
!>     10.                               thickness; 1 where there is no line
module read_plane_mod
  use cards_mod, only: reader_t, report
  use diagnostics_mod, only: any_mistakes, quoted
  use element_types_mod, only: is_axisymmetric, plane_type_called
  use fields_mod, only: field_position, fields_t, is_empty_field, next_data_line, real_field
  use kinds_mod, only: wp
  use mesh_draft_mod, only: axisymmetric, mesh_draft_t, plane_strain, solids
  use mesh_size_mod, only: mesh_size_t
  use obstacles_mod, only: obstacle_t
  use options_mod, only: card_t, name_option, open_card, option_position
  use plane_mesh_mod, only: expand_plane, uneven_obstacle
  use scene_mod, only: contact_pair_t
  use surfaces_mod, only: surface_t
  use text_mod, only: to_text
  implicit none
  private

  public :: find_plane, read_plane, check_even, check_pairs

  !> Keywords that are not available yet beside elements of a plane.
  character(*), parameter :: unavailable(*) = [character(19) :: 'ACCURACY', 'CONTACT GAP', &
    'COUPLING', 'DISTRIBUTING', 'EQUATION', 'KINEMATIC', 'PRE-TENSION SECTION', 'REFINE', &
    'RIGID BODY', 'TIE', 'TRANSFORM']

contains

  !> Elements of a plane are computed where the deck has no solid elements, and sections.
  subroutine find_plane(reader, draft)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(inout) :: draft
    type(card_t) :: card
    character(:), allocatable :: name
    integer :: k, row, kind
    logical :: ok

    associate (keyword => reader%cards(:reader%n_cards)%keyword)
      if (.not. any(keyword == 'SOLID SECTION') .or. any(keyword == 'BLOCK')) return
    end associate
    do k = 1, reader%n_cards
      call open_elements()
      if (index(name, 'C3D') == 1) return
    end do
    do k = 1, reader%n_cards
      call open_elements()
      if (name == '') cycle
      row = plane_type_called(name(:merge(4, len(name), name == 'CPE4R' .or. name == 'CAX4R')))
      if (row == 0) then
        if (index(name, 'CPE') == 1 .or. index(name, 'CAX') == 1) call report(reader, &
          option_position(card, 'TYPE'), 'element type '//quoted(name)//' is not available; '// &
          'use one of 3, 4, 6 or 8 nodes, or with 8 nodes and reduced integration')
        cycle
      end if
      kind = merge(axisymmetric, plane_strain, is_axisymmetric(row))
      if (draft%plane /= solids .and. draft%plane /= kind) call report(reader, &
        option_position(card, 'TYPE'), 'plane strain (CPE) and axisymmetric (CAX) elements '// &
        'exclude each other in one deck')
      draft%plane = kind
    end do

  contains

    !> Open card k if it is an *ELEMENT: its type, empty of other cards.
    subroutine open_elements()
      name = ''
      if (reader%cards(k)%keyword /= 'ELEMENT') return
      call open_card(reader, k, card)
      call name_option(reader, card, 'TYPE', .false., name, ok)
    end subroutine open_elements

  end subroutine find_plane

  !> Expand elements of a plane, as read, to solids.
  subroutine read_plane(reader, mesh_size, is_flat, draft)
    type(reader_t), intent(inout) :: reader
    type(mesh_size_t), intent(in) :: mesh_size
    logical, intent(in) :: is_flat !! the deck is to be written without parameters and blocks
    type(mesh_draft_t), intent(inout) :: draft
    type(card_t) :: card
    real(wp) :: thickness
    integer :: k
    logical :: ok

    if (draft%plane == solids) return
    do k = 1, reader%n_cards
      if (.not. (any(unavailable == reader%cards(k)%keyword) .or. (draft%plane == axisymmetric &
        .and. reader%cards(k)%keyword == 'CHANGE FRICTION'))) cycle
      call open_card(reader, k, card)
      call report(reader, card%position, '*'//trim(reader%cards(k)%keyword)// &
        ' is not available with plane or axisymmetric elements')
    end do
    if (is_flat) call report(reader, 0, '--flat does not write plane or axisymmetric elements yet')
    if (mesh_size%parts > 1 .or. mesh_size%zone%times > 0) call report(reader, 0, 'plane and '// &
      'axisymmetric elements are not refined yet: leave out --refine and --accuracy')
    call check_places(reader, draft, ok)
    if (.not. ok) return
    call read_thickness(reader, thickness, ok)
    if (.not. ok) return
    call expand_plane(draft, thickness, 0, ok)
    if (.not. ok) call report(reader, 0, 'there is no room for the nodes of the other side of '// &
      'the slice')
  end subroutine read_plane

  !> Report obstacles that are not the same all along the thickness.
  subroutine check_even(reader, draft, obstacles)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(in) :: draft
    type(obstacle_t), intent(in) :: obstacles(:)
    type(card_t) :: card
    integer :: k, uneven

    if (.not. allocated(draft%copies) .or. any_mistakes(reader%diagnostics)) return
    uneven = uneven_obstacle(draft, obstacles)
    if (uneven == 0) return
    k = findloc([(count(reader%cards(:k)%keyword == 'OBSTACLE'), k=1, reader%n_cards)], uneven, &
      dim=1)
    call open_card(reader, k, card)
    if (draft%plane == axisymmetric) then
      call report(reader, card%position, 'before axisymmetric elements an obstacle is a body '// &
        'of revolution about the y axis: a plane across it, a cylinder along it, a sphere on it')
    else
      call report(reader, card%position, 'before plane strain elements an obstacle is the same '// &
        'all along z: a plane or a cylinder along z')
    end if
  end subroutine check_even

  !> Report contact of axisymmetric elements that is not available: with friction, and of slave
  !> nodes on the axis.
  subroutine check_pairs(reader, draft, surfaces, pairs)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(in) :: draft
    type(surface_t), intent(in) :: surfaces(:)
    type(contact_pair_t), intent(in) :: pairs(:)
    type(card_t) :: card
    integer :: i

    if (.not. allocated(draft%on_axis) .or. any_mistakes(reader%diagnostics)) return
    if (size(pairs) == 0) return
    call open_card(reader, findloc(reader%cards(:reader%n_cards)%keyword == 'CONTACT PAIR', &
      .true., dim=1), card)
    do i = 1, size(pairs)
      associate (surface => surfaces(pairs(i)%surface))
        if (pairs(i)%mu > 0.0_wp) call report(reader, card%position, 'friction is not '// &
          'available with axisymmetric elements: slave surface '//quoted(surface%name)// &
          ' has mu = '//to_text(pairs(i)%mu, 3))
        if (any(draft%on_axis(pack(surface%nodes, surface%nodes <= size(draft%on_axis))))) then
          call report(reader, card%position, 'slave surface '//quoted(surface%name)// &
            ' has a node on the axis: contact of axisymmetric elements is not available there')
        end if
      end associate
    end do
  end subroutine check_pairs

  !> Report nodes that are not in the plane z = 0, or at negative radii.
  subroutine check_places(reader, draft, ok)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(in) :: draft
    logical, intent(out) :: ok
    logical :: used(0:draft%n_nodes)
    integer :: node

    used = .false.
    ok = draft%n_elements > 0
    if (.not. ok) return
    used(draft%connectivity%node(:draft%connectivity%first(draft%n_elements + 1) - 1)) = .true.
    do node = 1, draft%n_nodes
      if (.not. used(node)) cycle
      if (abs(draft%coordinates(3, node)) > 0.0_wp) then
        call report(reader, draft%node_position(node), 'node '//to_text(draft%node_id(node))// &
          ' of plane elements is not in their plane, z = 0')
        ok = .false.
        return
      end if
      if (draft%plane == axisymmetric .and. draft%coordinates(1, node) < 0.0_wp) then
        call report(reader, draft%node_position(node), 'node '//to_text(draft%node_id(node))// &
          ' of axisymmetric elements has a negative radius (x)')
        ok = .false.
        return
      end if
    end do
  end subroutine check_places

  !> The thickness of the sections, which all have the same.
  subroutine read_thickness(reader, thickness, ok)
    type(reader_t), intent(inout) :: reader
    real(wp), intent(out) :: thickness
    logical, intent(out) :: ok
    type(card_t) :: card
    real(wp) :: one
    integer :: k
    logical :: is_first

    thickness = 1.0_wp
    ok = .true.
    is_first = .true.
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'SOLID SECTION') cycle
      call open_card(reader, k, card)
      call read_line(reader, card, one, ok)
      if (ok .and. .not. is_first .and. abs(one - thickness) > 0.0_wp) then
        call report(reader, card%position, 'all sections of plane strain have the same '// &
          'thickness, here '//to_text(one, 6)//' and '//to_text(thickness, 6))
        ok = .false.
      end if
      if (.not. ok) return
      thickness = one
      is_first = .false.
    end do
  end subroutine read_thickness

  !> The data line of a section: a thickness, 1 where there is none.
  subroutine read_line(reader, card, thickness, ok)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    real(wp), intent(out) :: thickness
    logical, intent(out) :: ok
    type(fields_t) :: fields
    logical :: found

    thickness = 1.0_wp
    ok = .true.
    call next_data_line(reader, card, fields, found, 1, 'a thickness')
    if (found) found = .not. is_empty_field(fields, 1)
    if (.not. found) return
    call real_field(reader, fields, 1, 'a thickness', thickness, ok)
    if (.not. ok .or. thickness > 0.0_wp) return
    call report(reader, field_position(reader, fields, 1), 'a thickness is above 0')
    ok = .false.
  end subroutine read_line

end module read_plane_mod
