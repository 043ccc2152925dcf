!> Bolts that are cut at a surface of their elements.
!>
!>     *PRE-TENSION SECTION, SURFACE=CUT, NODE=900
!>     0., 0., 1.                     normal; no line: the mean of the surface
module read_pretension_mod
  use cards_mod, only: reader_t, report
  use diagnostics_mod, only: any_mistakes, quoted
  use fields_mod, only: end_data, fields_t, next_data_line, node_option, real_field
  use kinds_mod, only: wp
  use lookup_mod, only: find_id
  use options_mod, only: allow_options, card_t, has_option, name_option, open_card, &
    option_position
  use pretension_mod, only: cut_at_section, section_t
  use read_surfaces_mod, only: read_surfaces
  use sets_mod, only: model_t
  use surface_list_mod, only: find_surface, surface_list_t
  use text_mod, only: to_text
  implicit none
  private

  public :: read_sections_of_bolts, cut_bolts

contains

  !> Read all *PRE-TENSION SECTION cards; their reference nodes are joined to the bolts.
  subroutine read_sections_of_bolts(reader, model, sections)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(inout) :: model
    type(section_t), allocatable, intent(out) :: sections(:)
    type(section_t) :: section
    type(card_t) :: card
    integer :: k

    allocate (sections(0))
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'PRE-TENSION SECTION') cycle
      call open_card(reader, k, card)
      call read_section(reader, card, model, section)
      if (section%node == 0 .or. any_mistakes(reader%diagnostics)) cycle
      if (any(sections%node == section%node)) then
        call report(reader, section%node_position, 'node '//to_text(model%mesh%node_id( &
          section%node))//' is the reference node of another *PRE-TENSION SECTION')
        cycle
      end if
      sections = [sections, section]
    end do
  end subroutine read_sections_of_bolts

  !> *PRE-TENSION SECTION, SURFACE=, NODE= and the normal.
  subroutine read_section(reader, card, model, section)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(model_t), intent(inout) :: model
    type(section_t), intent(out) :: section
    type(fields_t) :: fields
    integer :: id, i
    logical :: ok, found, each(3)

    section%surface_name = ''
    section%position = card%position
    section%surface_position = option_position(card, 'SURFACE')
    section%node_position = option_position(card, 'NODE')
    id = 0
    if (.not. has_option(card, 'NODE')) then
      call report(reader, card%position, '*PRE-TENSION SECTION needs NODE=, a node whose dof 1 '// &
        'is the shortening of the bolt')
      return
    end if
    call node_option(reader, card, 'NODE', id, ok)
    if (.not. ok) return
    i = find_id(model%mesh%nodes, model%mesh%node_id, id)
    if (i == 0) then
      call report(reader, section%node_position, 'node '//to_text(id)//' is not defined')
      return
    else if (model%used(i) .or. model%reference(i) .or. model%rigid(i) .or. &
      model%rotation_node(i) > 0) then
      call report(reader, section%node_position, 'node '//to_text(id)// &
        ' belongs to an element, an obstacle or a coupling: a *PRE-TENSION SECTION needs a '// &
        'node of its own')
      return
    end if
    ! Whatever else is wrong, the node is one that may be loaded.
    model%joined(i) = .true.
    section%node = i
    if (has_option(card, 'ELEMENT') .and. .not. has_option(card, 'SURFACE')) then
      call report(reader, option_position(card, 'ELEMENT'), '*PRE-TENSION SECTION of a beam '// &
        'element is not available: cut solid elements by SURFACE=')
      return
    end if
    call allow_options(reader, card)
    call name_option(reader, card, 'SURFACE', .true., section%surface_name, ok)
    call next_data_line(reader, card, fields, found, 3, 'the normal of the section: x, y, z')
    if (found) then
      do i = 1, 3
        call real_field(reader, fields, i, 'a component of the normal', section%normal(i), &
          each(i))
      end do
      if (.not. all(each)) return
      if (.not. norm2(section%normal) > 0.0_wp) then
        call report(reader, fields%start, 'the normal of the section has no length')
        return
      end if
      call end_data(reader, card, fields, '*PRE-TENSION SECTION has one data line at most')
    end if
  end subroutine read_section

  !> Cut the mesh at all sections, before anything is made of surfaces.
  subroutine cut_bolts(reader, model, sections)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(inout) :: model
    type(section_t), intent(inout) :: sections(:)
    type(reader_t) :: scratch !! what is wrong with surfaces is reported when they are read to stay
    type(surface_list_t) :: surfaces
    integer :: k, found, before

    do k = 1, size(sections)
      if (any_mistakes(reader%diagnostics)) return
      associate (of => sections(k))
        ! Anew for each: the section before has other nodes now.
        scratch = reader
        before = scratch%diagnostics%n_mistakes
        call read_surfaces(scratch, model, surfaces)
        if (scratch%diagnostics%n_mistakes > before) return
        found = find_surface(surfaces, of%surface_name)
        if (found == 0) then
          call report(reader, of%surface_position, 'surface '//quoted(of%surface_name)// &
            ' is not defined')
          cycle
        end if
        of%faces = surfaces%list(found)%faces
        if (surfaces%of_nodes(found) .or. size(of%faces, 2) == 0) then
          call report(reader, of%surface_position, 'surface '//quoted(of%surface_name)// &
            ' has no faces of solid elements: a *PRE-TENSION SECTION needs TYPE=ELEMENT')
          cycle
        end if
        call cut_at_section(reader, model, of)
      end associate
    end do
  end subroutine cut_bolts

end module read_pretension_mod
