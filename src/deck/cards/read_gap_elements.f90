!> Gaps: elements of type GAPUNI, of two nodes that may come as close as a clearance along a
!> direction and then press each other. Each becomes a contact pair of one point: its slave is one
!> of the nodes, its master a plane that moves with the other one.
!>
!>     *ELEMENT, TYPE=GAPUNI, ELSET=STOPS
!>     201, 17, 4                          the first and the second node
!>     *GAP, ELSET=STOPS
!>     0.1, 1., 0., 0.                     clearance, direction from the first to the second
module read_gap_elements_mod
  use cards_mod, only: reader_t, report
  use diagnostics_mod, only: quoted
  use fields_mod, only: end_data, fields_t, is_empty_field, next_data_line, real_field
  use kinds_mod, only: wp
  use lookup_mod, only: find_id
  use mesh_draft_mod, only: gap_uni, is_of_block, solids
  use obstacles_mod, only: obstacle_plane, obstacle_t
  use options_mod, only: allow_options, card_t, open_card, option_position
  use scene_mod, only: contact_pair_t
  use sets_mod, only: find_elset, model_t
  use surface_list_mod, only: add_surface_of_node, surface_list_t
  use text_mod, only: to_text
  implicit none
  private

  public :: gap_element_t, read_gap_elements, make_gap_pairs

  !> One gap.
  type :: gap_element_t
    character(:), allocatable :: name !! of its set
    integer  :: id = 0                !! of the element
    integer  :: slave = 0             !! node of a body
    integer  :: master = 0            !! the other node
    real(wp) :: normal(3) = 0.0_wp    !! from the master to the slave [-]
    real(wp) :: clearance = 0.0_wp    !! below 0: an overlap [length]
  end type gap_element_t

contains

  !> All *GAP cards, and the elements that they are for. Masters that no body has are marked: they
  !> are reference nodes of obstacles.
  subroutine read_gap_elements(reader, model, gaps)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(inout) :: model
    type(gap_element_t), allocatable, intent(out) :: gaps(:)
    logical :: is_said(model%mesh%n_skipped)
    type(card_t) :: card
    type(gap_element_t) :: gap
    integer, allocatable :: members(:)
    integer :: k, i
    logical :: ok

    allocate (gaps(0))
    is_said = .false.
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'GAP') cycle
      call open_card(reader, k, card)
      if (model%mesh%plane /= solids) then
        call report(reader, card%position, '*GAP is not available with elements of a plane: '// &
          'use solid elements one element thick')
        return
      end if
      call find_members(reader, card, model, gap%name, members, ok)
      call read_gap(reader, card, gap, ok)
      if (.not. ok) cycle
      do i = 1, size(members)
        if (is_said(members(i))) then
          call report(reader, option_position(card, 'ELSET'), 'element '// &
            to_text(model%mesh%skipped_id(members(i)))//' has a *GAP already')
          exit
        end if
        is_said(members(i)) = .true.
        call add_gap(reader, model, members(i), gap, gaps)
      end do
    end do
    do i = 1, model%mesh%n_skipped
      if (is_said(i) .or. model%mesh%skipped_kind(i) /= gap_uni) cycle
      if (any(reader%cards(:reader%n_cards)%keyword == 'GAP') .and. &
        reader%diagnostics%n_mistakes > 0) return
      call report(reader, model%mesh%skipped_position(i), 'gap element '// &
        to_text(model%mesh%skipped_id(i))//' has no *GAP: it says how far its nodes may come')
      return
    end do
  end subroutine read_gap_elements

  !> The elements of ELSET=, each once.
  subroutine find_members(reader, card, model, name, members, ok)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(model_t), intent(in) :: model
    character(:), allocatable, intent(out) :: name
    integer, allocatable, intent(out) :: members(:)
    logical, intent(out) :: ok    !! false: a mistake was reported
    integer :: set, i

    allocate (members(0))
    call allow_options(reader, card)
    call find_elset(reader, card, model%element_sets, name, set)
    ok = set > 0
    if (.not. ok) return
    associate (of => model%element_sets%list(set))
      ok = of%n == 0 .and. of%n_skipped > 0
      if (ok) ok = all(model%mesh%skipped_kind(of%skipped(:of%n_skipped)) == gap_uni)
      if (.not. ok .and. .not. of%flawed) call report(reader, option_position(card, 'ELSET'), &
        'the set '//quoted(name)//' of a *GAP must consist of elements of the type GAPUNI')
      if (.not. ok) return
      do i = 1, of%n_skipped
        if (.not. any(members == of%skipped(i))) members = [members, of%skipped(i)]
      end do
    end associate
  end subroutine find_members

  !> The data line: clearance and direction; without one it is that from node to node.
  subroutine read_gap(reader, card, gap, ok)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(gap_element_t), intent(inout) :: gap
    logical, intent(inout) :: ok !! false: a mistake was reported
    type(fields_t) :: fields
    integer :: i
    logical :: found, each

    if (.not. ok) return
    gap%clearance = 0.0_wp
    gap%normal = 0.0_wp
    call next_data_line(reader, card, fields, found, 4, 'a clearance, and the direction from '// &
      'the first node to the second')
    if (.not. found) then
      call report(reader, card%position, '*GAP needs a data line: clearance, and the direction '// &
        'from the first node to the second')
      ok = .false.
      return
    end if
    if (.not. is_empty_field(fields, 1)) call real_field(reader, fields, 1, 'the clearance', &
      gap%clearance, ok)
    do i = 1, 3
      if (is_empty_field(fields, 1 + i)) cycle
      call real_field(reader, fields, 1 + i, 'a component of the direction', gap%normal(i), each)
      ok = ok .and. each
    end do
    if (ok .and. maxval(abs(gap%normal)) > 0.0_wp) then
      gap%normal = gap%normal/maxval(abs(gap%normal))
      gap%normal = gap%normal/norm2(gap%normal)
    end if
    call end_data(reader, card, fields, '*GAP has one data line')
  end subroutine read_gap

  !> One more gap. The slave is the second node, if a body has it, else the first.
  subroutine add_gap(reader, model, element, of_card, gaps)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(inout) :: model
    integer, intent(in) :: element !! among the skipped ones
    type(gap_element_t), intent(in) :: of_card
    type(gap_element_t), allocatable, intent(inout) :: gaps(:)
    type(gap_element_t) :: gap
    integer :: node(2), i, last
    logical :: is_turned

    gap = of_card
    associate (mesh => model%mesh, position => model%mesh%skipped_position(element))
      gap%id = mesh%skipped_id(element)
      last = mesh%n_skipped_nodes
      if (element < mesh%n_skipped) last = mesh%skipped_first(element + 1) - 1
      if (last - mesh%skipped_first(element) /= 1) then
        call report(reader, position, 'gap element '//to_text(gap%id)//' has '//to_text(last - &
          mesh%skipped_first(element) + 1)//' nodes, not 2')
        return
      end if
      do i = 1, 2
        node(i) = find_id(mesh%nodes, mesh%node_id, &
          mesh%skipped_nodes(mesh%skipped_first(element) + i - 1))
        if (node(i) > 0) then
          if (is_of_block(mesh, node(i))) reader%numbers_block = .true.
          cycle
        end if
        call report(reader, position, 'element '//to_text(gap%id)//' names node '//to_text( &
          mesh%skipped_nodes(mesh%skipped_first(element) + i - 1))//', which is not defined')
        return
      end do
      if (node(1) == node(2)) then
        call report(reader, position, 'element '//to_text(gap%id)//' names node '// &
          to_text(mesh%node_id(node(1)))//' twice')
        return
      end if
      if (.not. norm2(gap%normal) > 0.0_wp) then
        gap%normal = mesh%coordinates(:, node(2)) - mesh%coordinates(:, node(1))
        if (.not. maxval(abs(gap%normal)) > 0.0_wp) then
          call report(reader, position, 'the nodes of gap element '//to_text(gap%id)//' lie at '// &
            'one place: *GAP must give the direction from the first to the second')
          return
        end if
        gap%normal = gap%normal/norm2(gap%normal)
      end if
      is_turned = .not. model%used(node(2))
      gap%master = node(merge(2, 1, is_turned))
      gap%slave = node(merge(1, 2, is_turned))
      if (is_turned) gap%normal = -gap%normal
      if (.not. model%used(gap%slave)) then
        call report(reader, position, 'neither node of gap element '//to_text(gap%id)// &
          ' belongs to a solid element')
        return
      end if
      if (any(model%turned([gap%master]) > 0)) then
        call report(reader, position, 'node '//to_text(mesh%node_id(gap%master))//' of gap '// &
          'element '//to_text(gap%id)//' is the ROT NODE of a rigid body: it has no place')
        return
      end if
      if (.not. (model%used(gap%master) .or. model%joined(gap%master) .or. &
        model%rigid(gap%master))) model%reference(gap%master) = .true.
    end associate
    gaps = [gaps, gap]
  end subroutine add_gap

  !> A pair for each gap: the slave node before a plane that moves with the master.
  subroutine make_gap_pairs(model, gaps, surfaces, obstacles, pairs)
    type(model_t), intent(in) :: model
    type(gap_element_t), intent(in) :: gaps(:)
    type(surface_list_t), intent(inout) :: surfaces
    type(obstacle_t), allocatable, intent(inout) :: obstacles(:)
    type(contact_pair_t), allocatable, intent(inout) :: pairs(:)
    type(obstacle_t), allocatable :: all_obstacles(:)
    type(contact_pair_t), allocatable :: all_pairs(:)
    integer :: i

    if (size(gaps) == 0) return
    allocate (all_obstacles(size(obstacles) + size(gaps)), all_pairs(size(pairs) + size(gaps)))
    all_obstacles(:size(obstacles)) = obstacles
    all_pairs(:size(pairs)) = pairs
    do i = 1, size(gaps)
      associate (gap => gaps(i), plane => all_obstacles(size(obstacles) + i), &
                 pair => all_pairs(size(pairs) + i))
        plane%name = to_text(model%mesh%node_id(gap%master))
        plane%kind = obstacle_plane
        plane%is_of_gap = .true.
        plane%ref_node = gap%master
        plane%normal = gap%normal
        plane%point = model%mesh%coordinates(:, gap%slave) - gap%clearance*gap%normal
        pair%name = gap%name//'-'//to_text(gap%id)//':'//plane%name
        pair%interaction = ''
        call add_surface_of_node(surfaces, gap%name//'-'//to_text(gap%id), gap%slave, pair%surface)
        pair%master = size(obstacles) + i
      end associate
    end do
    call move_alloc(all_obstacles, obstacles)
    call move_alloc(all_pairs, pairs)
  end subroutine make_gap_pairs

end module read_gap_elements_mod
