!> Elements of a plane: whether a deck computes them, how thick they are, and what is not available
!> with them.
!>
!>     *ELEMENT, TYPE=CPE4, ELSET=BODY
!>     1,  1, 2, 4, 3                    counterclockwise, nodes in the plane z = 0
!>     *SOLID SECTION, ELSET=BODY, MATERIAL=STEEL
!>     10.                               thickness; 1 where there is no line
module read_plane_mod
  use cards_mod, only: note, reader_t, report
  use cells_mod, only: cells, has_middles
  use connectivity_mod, only: nodes_of_element
  use diagnostics_mod, only: any_mistakes, quoted
  use element_types_mod, only: plane_type_called, taken_as
  use fields_mod, only: field_position, fields_t, is_empty_field, next_data_line, real_field
  use kinds_mod, only: wp
  use mesh_draft_mod, only: axisymmetric, mesh_draft_t, names_of_planes, plane_strain, &
    plane_stress, solids
  use obstacles_mod, only: obstacle_t
  use options_mod, only: allow_no_data, allow_options, card_t, choice_option, has_option, &
    name_option, open_card, option_position
  use plane_mesh_mod, only: expand_plane, uneven_obstacle
  use sets_mod, only: find_elset, model_t
  use text_mod, only: to_text
  implicit none
  private

  public :: find_plane, read_plane, give_thickness, check_even

  !> Keywords that are not available beside axisymmetric elements, and what to do instead.
  type :: unavailable_t
    character(19) :: keyword
    character(84) :: instead
  end type unavailable_t

  type(unavailable_t), parameter :: unavailable(*) = [ &
    unavailable_t('RIGID BODY', 'an obstacle is a plane, a cylinder or a sphere (*OBSTACLE), '// &
    'or a body that is stiff'), &
    unavailable_t('COUPLING', 'join degrees of freedom 2 to that of a node by *EQUATION'), &
    unavailable_t('TRANSFORM', 'degrees of freedom 1 and 2 are along the radius and the axis')]

contains

  !> Elements of a plane are computed where the deck has no solid elements, and sections.
  subroutine find_plane(reader, draft)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(inout) :: draft
    type(card_t) :: card
    character(:), allocatable :: name
    integer :: k, kind, asked
    logical :: ok

    asked = solids
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'PLANE ELEMENTS') cycle
      call open_card(reader, k, card)
      call allow_options(reader, card)
      call allow_no_data(reader, card)
      call choice_option(reader, card, 'TYPE', asked, ok)
      if (.not. has_option(card, 'TYPE')) call report(reader, card%position, &
        '*PLANE ELEMENTS needs TYPE=CPE, CPS or CAX')
    end do
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
      kind = findloc(index(name, names_of_planes), 1, dim=1)
      if (kind == 0) cycle
      if (plane_type_called(taken_as(name)) == 0) then
        call report(reader, option_position(card, 'TYPE'), 'element type '//quoted(name)// &
          ' is not available; use one of 3, 4, 6 or 8 nodes, or with 8 nodes and reduced '// &
          'integration')
        reader%lacks_elements = .true.
        cycle
      end if
      if (asked /= solids) kind = asked
      if (draft%plane /= solids .and. draft%plane /= kind) call report(reader, &
        option_position(card, 'TYPE'), 'plane strain (CPE), plane stress (CPS) and '// &
        'axisymmetric (CAX) elements exclude each other in one deck')
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
  subroutine read_plane(reader, draft)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(inout) :: draft
    real(wp), parameter :: of_edge = 0.03_wp !! that of a plate which is computed [-]
    type(card_t) :: card
    real(wp) :: shortest, longest
    integer :: k, i
    logical :: ok

    if (draft%plane == solids) return
    do k = 1, reader%n_cards
      i = findloc(unavailable%keyword == reader%cards(k)%keyword, .true., dim=1)
      if (i == 0 .or. draft%plane /= axisymmetric) cycle
      call open_card(reader, k, card)
      if (has_option(card, 'ANALYTICAL SURFACE')) cycle
      call report(reader, card%position, '*'//trim(reader%cards(k)%keyword)// &
        ' is not available with axisymmetric elements: '//trim(unavailable(i)%instead))
    end do
    call check_places(reader, draft, ok)
    if (.not. ok) return
    call read_thicknesses(reader, draft, ok)
    if (.not. ok) draft%thickness = 1.0_wp
    if (draft%plane == plane_stress) then
      ! So little of a plate is computed that strains across it cost no shear, and what friction
      ! acts along it is none. docs/theory.md section 8.
      call find_edges(draft, shortest, longest)
      draft%parts = draft%thickness(2)/merge(of_edge*shortest, draft%thickness(2), longest > 0.0_wp)
    end if
    call expand_plane(draft, draft%thickness(2)/draft%parts, 0, ok)
    if (.not. ok) call report(reader, 0, 'there is no room for the nodes of the other side of '// &
      'the slice')
  end subroutine read_plane

  !> Report obstacles that are not the same all along the thickness.
  subroutine check_even(reader, draft, obstacles)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(in) :: draft
    type(obstacle_t), intent(in) :: obstacles(:)
    type(card_t) :: card
    character(:), allocatable :: name
    logical :: ok
    integer :: k, uneven

    if (.not. allocated(draft%copies) .or. any_mistakes(reader%diagnostics)) return
    uneven = uneven_obstacle(draft, obstacles)
    if (uneven == 0) return
    do k = 1, reader%n_cards
      if (all(reader%cards(k)%keyword /= [character(8) :: 'OBSTACLE', 'SURFACE'])) cycle
      call open_card(reader, k, card)
      call name_option(reader, card, 'NAME', .false., name, ok)
      if (name == obstacles(uneven)%name) exit
    end do
    if (draft%plane == axisymmetric) then
      call report(reader, card%position, 'before axisymmetric elements an obstacle is a body '// &
        'of revolution about the y axis: a plane across it, a cylinder along it, a sphere on it')
    else
      call report(reader, card%position, 'before plane elements an obstacle is the same '// &
        'all along z: a plane or a cylinder along z')
    end if
  end subroutine check_even

  !> Put a plane z = constant at z = 0. Report nodes that are not in it, or at negative radii.
  subroutine check_places(reader, draft, ok)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(inout) :: draft
    logical, intent(out) :: ok
    logical :: used(0:draft%n_nodes)
    real(wp) :: height
    integer :: node

    used = .false.
    ok = draft%n_elements > 0
    if (.not. ok) return
    used(draft%connectivity%node(:draft%connectivity%first(draft%n_elements + 1) - 1)) = .true.
    height = draft%coordinates(3, findloc(used(1:), .true., dim=1))
    if (abs(height) > 0.0_wp) then
      call note(reader, 'the plane elements at z = '//to_text(height)//' are taken to z = 0')
      where (used(1:)) draft%coordinates(3, :draft%n_nodes) = draft%coordinates(3, &
        :draft%n_nodes) - height
    end if
    do node = 1, draft%n_nodes
      if (.not. used(node)) cycle
      if (abs(draft%coordinates(3, node)) > 0.0_wp) then
        call report(reader, draft%node_position(node), 'node '//to_text(draft%node_id(node))// &
          ' of plane elements is not in their plane, z = '//to_text(height))
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

  !> The least and the largest thickness of the sections.
  subroutine read_thicknesses(reader, draft, ok)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(inout) :: draft
    logical, intent(out) :: ok
    type(card_t) :: card
    real(wp) :: one
    integer :: k
    logical :: is_found

    draft%thickness = [huge(1.0_wp), 0.0_wp]
    draft%is_thickness_given = .false.
    ok = .true.
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'SOLID SECTION') cycle
      call open_card(reader, k, card)
      call read_line(reader, card, one, is_found, ok)
      if (.not. ok) return
      draft%is_thickness_given = draft%is_thickness_given .or. is_found
      draft%thickness = [min(draft%thickness(1), one), max(draft%thickness(2), one)]
      call check_thickness(reader, draft, card, one)
    end do
  end subroutine read_thicknesses

  !> Give the elements of each section its thickness, where sections have unlike ones, about the
  !> middle of the widest: what presses on the middle of a slice bends it to neither side.
  subroutine give_thickness(reader, model)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(inout) :: model
    type(card_t) :: card
    character(:), allocatable :: name
    real(wp) :: part(model%mesh%n_nodes) !! of the largest thickness; 0: not known yet [-]
    real(wp) :: one, middle
    integer :: k, i, set, other
    logical :: ok, is_found

    associate (mesh => model%mesh)
      if (.not. allocated(mesh%copies) .or. any_mistakes(reader%diagnostics) .or. &
        mesh%thickness(2) <= mesh%thickness(1)) return
      part = 0.0_wp
      do k = 1, reader%n_cards
        if (reader%cards(k)%keyword /= 'SOLID SECTION') cycle
        call open_card(reader, k, card)
        call read_line(reader, card, one, is_found, ok)
        call find_elset(reader, card, model%element_sets, name, set)
        if (set == 0) return
        do i = 1, model%element_sets%list(set)%n
          associate (e => model%element_sets%list(set)%members(i))
            if (has_middles(mesh%connectivity%cell(e))) then
              call report(reader, card%position, 'sections of unlike thickness take elements '// &
                'of first order', 'mesh with '//names_of_planes(mesh%plane)//'4I or '// &
                names_of_planes(mesh%plane)//'3, or give all sections one thickness')
              return
            end if
            associate (nodes => nodes_of_element(mesh%connectivity, e))
              other = findloc(part(nodes) > 0.0_wp .and. abs(part(nodes)*mesh%thickness(2) - one) &
                > 0.0_wp, .true., dim=1)
              if (other > 0) then
                call report(reader, card%position, 'node '//to_text(mesh%node_id(nodes(other)))// &
                  ' has elements of thickness '//to_text(one, 6)//' and '// &
                  to_text(part(nodes(other))*mesh%thickness(2), 6), 'parts of unlike thickness '// &
                  'have nodes of their own, which a *TIE may join')
                return
              end if
              part(nodes) = one/mesh%thickness(2)
            end associate
          end associate
        end do
      end do
      middle = 0.5_wp*mesh%thickness(2)/mesh%parts
      associate (z => mesh%coordinates(3, :mesh%n_nodes))
        where (part > 0.0_wp) z = middle + part*(z - middle)
      end associate
    end associate
  end subroutine give_thickness

  !> Report a thickness that is far from the edges of the elements: displacements lose the square of
  !> the ratio of their digits. With a ratio of 2e6 they are off by 1e-5 (CPE4) and 1e-4 (CPE8R),
  !> with 2e4 some runs are not certified, with 2e3 they are right to 1e-8.
  subroutine check_thickness(reader, draft, card, thickness)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(in) :: draft
    type(card_t), intent(in) :: card  !! that says so
    real(wp), intent(in) :: thickness !! [length]
    real(wp), parameter :: most = 1.0e4_wp !! of a thickness over an edge, or the reverse [-]
    real(wp) :: edge, shortest, longest

    if (draft%plane /= plane_strain) return
    call find_edges(draft, shortest, longest)
    if (thickness <= most*shortest .and. longest <= most*thickness) return
    edge = merge(longest, shortest, longest > most*thickness)
    call report(reader, card%position, 'a thickness of '//to_text(thickness, 4)// &
      ' beside edges of '//to_text(edge, 4)//' takes the digits of displacements: give one '// &
      'within 1e4 times the edges (forces are in proportion to it)')
  end subroutine check_thickness

  !> The shortest and the longest edge of the elements in the plane, but for those of no length.
  pure subroutine find_edges(draft, shortest, longest)
    type(mesh_draft_t), intent(in) :: draft
    real(wp), intent(out) :: shortest, longest !! [length]
    real(wp) :: edge
    integer :: e, k, n

    shortest = huge(shortest)
    longest = 0.0_wp
    do e = 1, draft%n_elements
      associate (nodes => nodes_of_element(draft%connectivity, e), x => draft%coordinates)
        n = cells(draft%connectivity%cell(e))%n_corners/2
        do k = 1, n
          edge = norm2(x(:, nodes(k)) - x(:, nodes(mod(k, n) + 1)))
          if (edge > 0.0_wp) shortest = min(shortest, edge)
          longest = max(longest, edge)
        end do
      end associate
    end do
  end subroutine find_edges

  !> The data line of a section: a thickness, 1 where there is none.
  subroutine read_line(reader, card, thickness, found, ok)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    real(wp), intent(out) :: thickness
    logical, intent(out) :: found, ok
    type(fields_t) :: fields

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
