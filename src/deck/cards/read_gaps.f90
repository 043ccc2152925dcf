!> Gaps beside those of the mesh, a curved profile without a curved mesh; and in place of them.
!>
!>     *CONTACT GAP
!>     BODY-ZMIN, 0.01                          node or set, gap
!>     BODY-ZMIN, PARABOLA, 0., 0., 0., 50.     node or set, centre, radius
!>     *CONTACT GAP, PARABOLA
!>     BODY-ZMIN, 0., 0., 0., 50.               the same
!>     *CLEARANCE, SLAVE=LID-ZMIN, MASTER=BODY-ZMAX, VALUE=0.002
module read_gaps_mod
  use cards_mod, only: note, reader_t, report
  use diagnostics_mod, only: any_mistakes, quoted
  use fields_mod, only: field_position, field_text, fields_t, limit_fields, next_data_line, &
    real_field, reference_field, reference_t
  use deck_table_mod, only: same_word
  use kinds_mod, only: i8, wp
  use mesh_draft_mod, only: axisymmetric, plane_strain, plane_stress
  use options_mod, only: allow_no_data, allow_options, card_t, flag_option, name_option, &
    open_card, option_position, signed_option
  use surface_list_mod, only: surface_list_t
  use scene_mod, only: contact_gap_t, contact_pair_t
  use sets_mod, only: model_t, referenced_nodes
  use text_mod, only: to_text
  implicit none
  private

  public :: read_gaps, read_clearances, find_pair

  !> Nodes named by all lines of a deck together: more than any real deck needs.
  integer(i8), parameter :: max_work = 50000000

contains

  !> *CONTACT GAP[, PARABOLA]
  subroutine read_gaps(reader, model, surfaces, pairs, gaps)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(surface_list_t), intent(in) :: surfaces
    type(contact_pair_t), intent(in) :: pairs(:)
    type(contact_gap_t), allocatable, intent(out) :: gaps(:)
    type(card_t) :: card
    type(contact_gap_t), allocatable :: room(:)
    logical, allocatable :: slave(:)
    integer(i8) :: work
    integer :: k, n

    allocate (slave(model%mesh%n_nodes))
    slave = .false.
    do k = 1, size(pairs)
      slave(surfaces%list(pairs(k)%surface)%nodes) = .true.
    end do
    associate (cards => reader%cards(:reader%n_cards))
      n = sum(cards%last - cards%first + 1, mask=cards%keyword == 'CONTACT GAP')
    end associate
    allocate (room(n), source=contact_gap_t(nodes=[integer ::]))
    n = 0
    work = 0
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'CONTACT GAP') cycle
      call open_card(reader, k, card)
      call read_card(reader, card, model, slave, room, n, work)
    end do
    gaps = room(:n)
  end subroutine read_gaps

  !> *CLEARANCE, SLAVE=surface, MASTER=surface, VALUE=gap: of all slave nodes of a pair.
  subroutine read_clearances(reader, pairs)
    type(reader_t), intent(inout) :: reader
    type(contact_pair_t), intent(inout) :: pairs(:)
    type(card_t) :: card
    character(:), allocatable :: slave, master
    real(wp) :: gap
    integer :: k, p
    logical :: ok(3)

    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'CLEARANCE') cycle
      call open_card(reader, k, card)
      call allow_options(reader, card)
      call allow_no_data(reader, card)
      call name_option(reader, card, 'SLAVE', .true., slave, ok(1))
      call name_option(reader, card, 'MASTER', .true., master, ok(2))
      call signed_option(reader, card, 'VALUE', gap, ok(3))
      if (.not. all(ok)) cycle
      call find_pair(reader, pairs, slave, master, option_position(card, 'SLAVE'), p)
      if (p == 0) cycle
      if (pairs(p)%has_clearance) then
        call report(reader, card%position, 'contact pair '//quoted(pairs(p)%name)// &
          ' has a *CLEARANCE already')
      else
        pairs(p)%has_clearance = .true.
        pairs(p)%clearance = gap
      end if
    end do
  end subroutine read_clearances

  !> The pair of a slave and a master.
  subroutine find_pair(reader, pairs, slave, master, position, pair)
    type(reader_t), intent(inout) :: reader
    type(contact_pair_t), intent(in) :: pairs(:)
    character(*), intent(in) :: slave, master
    integer, intent(in) :: position  !! where the deck names them
    integer, intent(out) :: pair     !! 0: there is none, which is reported

    do pair = size(pairs), 1, -1
      if (pairs(pair)%name == slave//':'//master) return
    end do
    pair = 0
    ! Pairs of a deck with errors may be missing.
    if (.not. any_mistakes(reader%diagnostics)) call report(reader, position, 'no *CONTACT '// &
      'PAIR has the slave '//quoted(slave)//' and the master '//quoted(master))
  end subroutine find_pair

  !> Lines `node or set, gap` or `node or set[, PARABOLA], x, y, z, R`.
  subroutine read_card(reader, card, model, slave, list, n, work)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(model_t), intent(in) :: model
    logical, intent(in) :: slave(:)        !! (n_nodes) whether the node may touch an obstacle
    type(contact_gap_t), intent(inout) :: list(:) !! with room for a gap a line
    integer, intent(inout) :: n            !! gaps so far
    integer(i8), intent(inout) :: work     !! nodes named so far
    type(fields_t) :: fields
    type(reference_t) :: reference
    type(contact_gap_t) :: gap
    logical :: found, ok, named, parabola
    character(*), parameter :: form = 'a node or a set of nodes, PARABOLA, a centre and a radius'

    call allow_options(reader, card)
    parabola = .false.
    call flag_option(reader, card, 'PARABOLA', parabola)
    do
      call next_data_line(reader, card, fields, found, 6, form)
      if (.not. found) exit
      call reference_field(reader, fields, 1, 'a node or a set of nodes', reference, named)
      call read_gap(reader, fields, parabola, gap, ok)
      if (gap%parabola .and. ok) call check_plane(reader, fields, model%mesh%plane, gap%centre, ok)
      if (gap%parabola) gap%centre = gap%centre - model%mesh%origin
      if (.not. named) cycle
      call referenced_nodes(reader, model, reference, gap%nodes)
      if (size(gap%nodes) == 0 .or. .not. ok) cycle
      work = work + size(gap%nodes)
      if (work > max_work) then
        call report(reader, fields%start, 'the gaps name too many nodes')
        return
      end if
      if (.not. any(slave(gap%nodes))) call note(reader, '*CONTACT GAP of '//name_of(reference)// &
        ' changes nothing: none of its nodes is on a slave surface')
      n = n + 1
      list(n) = gap
    end do
  end subroutine read_card

  !> Report paraboloids that are none of what elements of a plane stand for.
  subroutine check_plane(reader, fields, plane, centre, ok)
    type(reader_t), intent(inout) :: reader
    type(fields_t), intent(in) :: fields
    integer, intent(in) :: plane         !! solids, plane_strain and its kin
    real(wp), intent(in) :: centre(3)    !! [length]
    logical, intent(inout) :: ok         !! false: a mistake was reported

    if (plane == plane_strain .or. plane == plane_stress) then
      call report(reader, fields%start, 'a paraboloid is not the same all along the thickness '// &
        'of plane elements: give the gaps of nodes, or mesh the profile')
      ok = .false.
    else if (plane == axisymmetric .and. any(abs(centre([1, 3])) > 0.0_wp)) then
      call report(reader, fields%start, 'with axisymmetric elements the centre of a paraboloid '// &
        'is on the axis, x = z = 0')
      ok = .false.
    end if
  end subroutine check_plane

  !> What stands behind the node or set.
  subroutine read_gap(reader, fields, parabola, gap, ok)
    type(reader_t), intent(inout) :: reader
    type(fields_t), intent(in) :: fields
    logical, intent(in) :: parabola      !! the card says so
    type(contact_gap_t), intent(inout) :: gap
    logical, intent(out) :: ok           !! false: a mistake was reported
    integer :: first, i
    logical :: field_ok

    first = 2
    gap%parabola = parabola
    if (same_word(field_text(reader, fields, 2), 'PARABOLA')) then
      gap%parabola = .true.
      first = 3
    end if
    if (.not. gap%parabola) then
      call limit_fields(reader, fields, 2, 'a node or a set of nodes, and a gap')
      call real_field(reader, fields, 2, 'the gap', gap%value, ok)
      return
    end if
    call limit_fields(reader, fields, first + 3, 'a node or a set of nodes, a centre and a radius')
    ok = .true.
    do i = 1, 3
      call real_field(reader, fields, first + i - 1, 'x, y, z of the centre', gap%centre(i), &
        field_ok)
      ok = ok .and. field_ok
    end do
    call real_field(reader, fields, first + 3, 'the radius', gap%radius, field_ok)
    ok = ok .and. field_ok
    if (field_ok .and. abs(gap%radius) <= 0.0_wp) then
      call report(reader, field_position(reader, fields, first + 3), &
        'the radius of a parabola must not be zero')
      ok = .false.
    end if
  end subroutine read_gap

  pure function name_of(reference) result(name)
    type(reference_t), intent(in) :: reference
    character(:), allocatable :: name

    name = 'node '//to_text(reference%id)
    if (reference%id <= 0) name = quoted(reference%name)
  end function name_of

end module read_gaps_mod
