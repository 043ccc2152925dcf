!> Springs: elements of type SPRING1, SPRING2 and SPRINGA, and what they resist with.
!>
!>     *ELEMENT, TYPE=SPRINGA, ELSET=STRUTS      two nodes; along the line between them
!>     101, 12, 900
!>     *SPRING, ELSET=STRUTS
!>     2000.                                     stiffness
!>     *SPRING, ELSET=PADS                       of SPRING1: one node, to the ground
!>     3                                         dof; of SPRING2 two, of its nodes
!>     500.
!>     *SPRING, ELSET=STOPS, NONLINEAR          with NLGEOM: force, elongation
!>     -100., -0.1
!>     0., 0.
!>     50., 1.
module read_springs_mod
  use cards_mod, only: keep_reading, note, reader_t, report
  use diagnostics_mod, only: quoted
  use fields_mod, only: field_position, field_text, fields_t, integer_field, is_empty_field, &
    next_data_line, real_field
  use kinds_mod, only: wp
  use lookup_mod, only: find_id
  use mesh_draft_mod, only: is_of_block, is_spring, mesh_draft_t, solids, spring_1, spring_2, &
    spring_a
  use mesh_mod, only: mesh_t
  use options_mod, only: allow_options, card_t, flag_option, open_card, option_position
  use sets_mod, only: find_elset, model_t
  use spring_elements_mod, only: add_spring_element, force_table_t, spring_elements_t
  use text_mod, only: to_text
  implicit none
  private

  public :: read_springs, refuse_loose_springs, refuse_tables, scale_turned_springs

  !> A *SPRING.
  type :: law_t
    integer :: dof(2) = 0            !! 1 to 6; 0: none is said
    real(wp) :: stiffness = 0.0_wp   !! of a table the largest [force/length]
    integer :: table = 0             !! index into the tables of springs; 0: none
  end type law_t

contains

  !> All *SPRING cards, and the elements that they are for. Nodes that no element has are joined to
  !> what springs join them to.
  subroutine read_springs(reader, model, springs)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(inout) :: model
    type(spring_elements_t), intent(out) :: springs
    integer :: owner(model%mesh%n_skipped) !! of skipped elements; 0: no card yet
    type(card_t) :: card
    type(law_t) :: law
    integer, allocatable :: members(:)
    integer :: k, i, kind
    logical :: ok

    owner = 0
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'SPRING') cycle
      call open_card(reader, k, card)
      if (model%mesh%plane /= solids) then
        call report(reader, card%position, '*SPRING is not available with elements of a plane: '// &
          'use solid elements one element thick')
        return
      end if
      call find_members(reader, card, model, members, kind, ok)
      call read_law(reader, card, kind, law, springs, ok)
      if (.not. ok) cycle
      do i = 1, size(members)
        if (owner(members(i)) == k) cycle ! the set names it twice
        if (owner(members(i)) > 0) then
          call report(reader, option_position(card, 'ELSET'), 'element '// &
            to_text(model%mesh%skipped_id(members(i)))//' has a *SPRING already')
          exit
        end if
        owner(members(i)) = k
        call add_element(reader, model, members(i), law, springs)
      end do
    end do
    do i = 1, size(owner)
      if (owner(i) > 0 .or. .not. is_spring(model%mesh%skipped_kind(i))) cycle
      if (any(reader%cards(:reader%n_cards)%keyword == 'SPRING') .and. &
        reader%diagnostics%n_mistakes > 0) return
      call report(reader, model%mesh%skipped_position(i), 'spring element '// &
        to_text(model%mesh%skipped_id(i))//' has no *SPRING: it says how stiff it is')
      return
    end do
  end subroutine read_springs

  !> The spring elements of ELSET=, all of one type.
  subroutine find_members(reader, card, model, members, kind, ok)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(model_t), intent(in) :: model
    integer, allocatable, intent(out) :: members(:)
    integer, intent(out) :: kind  !! spring_1 and its kin, 0: not known
    logical, intent(out) :: ok    !! false: a mistake was reported
    character(:), allocatable :: name
    integer :: set

    allocate (members(0))
    kind = 0
    call allow_options(reader, card)
    call find_elset(reader, card, model%element_sets, name, set)
    ok = set > 0
    if (.not. ok) return
    associate (of => model%element_sets%list(set))
      if (of%n_skipped > 0) members = of%skipped(:of%n_skipped)
      ok = of%n == 0 .and. size(members) > 0
      if (ok) then
        kind = model%mesh%skipped_kind(members(1))
        ok = is_spring(kind) .and. all(model%mesh%skipped_kind(members) == kind)
      end if
      if (.not. ok .and. .not. of%flawed) call report(reader, option_position(card, 'ELSET'), &
        'the set '//quoted(name)//' of a *SPRING must consist of elements of one of the types '// &
        'SPRING1, SPRING2 and SPRINGA')
    end associate
  end subroutine find_members

  !> The data lines: dofs, but of SPRINGA, then the stiffness.
  subroutine read_law(reader, card, kind, law, springs, ok)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    integer, intent(in) :: kind
    type(law_t), intent(out) :: law
    type(spring_elements_t), intent(inout) :: springs !! gets a table
    logical, intent(inout) :: ok !! false: a mistake was reported
    type(fields_t) :: fields
    integer :: n, i
    logical :: found, each, is_table

    if (.not. ok) return
    n = findloc([spring_a, spring_1, spring_2], kind, dim=1) - 1
    if (n > 0) then
      call next_data_line(reader, card, fields, found, 2, 'a dof for each node')
      if (found) then
        do i = 1, n
          call integer_field(reader, fields, i, 'the dof of node '//to_text(i), 1, law%dof(i), &
            each)
          if (each .and. law%dof(i) > 6) then
            call report(reader, field_position(reader, fields, i), 'the dof must be 1 to 6, '// &
              'not '//quoted(field_text(reader, fields, i)))
            each = .false.
          end if
          ok = ok .and. each
        end do
        if (n == 1 .and. .not. is_empty_field(fields, 2)) then
          call report(reader, field_position(reader, fields, 2), &
            'SPRING1 has one node, and one dof')
          ok = .false.
        end if
      end if
    end if
    is_table = .false.
    call flag_option(reader, card, 'NONLINEAR', is_table)
    if (is_table) then
      if (ok) call read_forces(reader, card, fields, law, springs, ok)
      return
    end if
    call next_data_line(reader, card, fields, found, 3, 'the stiffness')
    if (.not. found) then
      call report(reader, card%position, '*SPRING needs a line with the stiffness, behind one '// &
        'with the dofs, which SPRINGA has not')
      ok = .false.
      return
    end if
    call real_field(reader, fields, 1, 'the stiffness', law%stiffness, each)
    if (each .and. .not. law%stiffness > 0.0_wp) then
      call report(reader, fields%start, 'the stiffness of a spring must be positive, not '// &
        quoted(field_text(reader, fields, 1)), 'a table of forces and elongations is a '// &
        '*SPRING, NONLINEAR')
      each = .false.
    end if
    ok = ok .and. each
    if (.not. ok) return
    if (.not. (is_empty_field(fields, 2) .and. is_empty_field(fields, 3))) call note(reader, &
      'a frequency or temperature behind the stiffness of *SPRING is ignored')
    call next_data_line(reader, card, fields, found, 3, 'the stiffness')
    if (found) then
      call report(reader, fields%start, '*SPRING has one stiffness: it depends neither on '// &
        'frequency nor on temperature')
      ok = .false.
    end if
  end subroutine read_law

  !> The lines of a table: force, elongation, temperature.
  subroutine read_forces(reader, card, fields, law, springs, ok)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(fields_t), intent(inout) :: fields !! the line before
    type(law_t), intent(inout) :: law
    type(spring_elements_t), intent(inout) :: springs
    logical, intent(out) :: ok !! false: a mistake was reported
    type(force_table_t) :: table
    real(wp) :: force, elongation
    logical :: found, each(2)
    integer :: n, i

    ok = .false.
    allocate (table%elongation(0), table%force(0))
    n = 0
    do
      call next_data_line(reader, card, fields, found, 3, 'a force and an elongation')
      if (.not. found) exit
      ! SPRINGA has no dofs: the line for these may be blank.
      if (n == 0 .and. all([(is_empty_field(fields, i), i=1, 3)])) cycle
      call real_field(reader, fields, 1, 'the force', force, each(1))
      call real_field(reader, fields, 2, 'the elongation', elongation, each(2))
      if (.not. all(each)) return
      if (n > 0) then
        if (.not. elongation > table%elongation(n)) then
          call report(reader, field_position(reader, fields, 2), 'the elongations of *SPRING, '// &
            'NONLINEAR must rise from line to line: '//quoted(field_text(reader, fields, 2)))
          return
        end if
      end if
      if (.not. is_empty_field(fields, 3)) call note(reader, 'a frequency or temperature '// &
        'behind the stiffness of *SPRING is ignored')
      n = n + 1
      table%elongation = [table%elongation, elongation]
      table%force = [table%force, force]
    end do
    if (n < 2) then
      call report(reader, card%position, '*SPRING, NONLINEAR needs two lines at least: force, '// &
        'elongation')
      return
    end if
    i = count(table%elongation <= 0.0_wp)
    force = table%force(max(1, i))
    if (i > 0 .and. i < n) force = force - table%elongation(i)*(table%force(i + 1) - &
      table%force(i))/(table%elongation(i + 1) - table%elongation(i))
    if (abs(force) > 4.0_wp*epsilon(1.0_wp)*maxval(abs(table%force))) then
      call report(reader, card%position, 'the table of *SPRING, NONLINEAR has a force of '// &
        to_text(force)//' at elongation 0: it must be 0 there', 'load the nodes, or move their '// &
        'ends by *BOUNDARY, to prestress a spring')
      return
    end if
    law%stiffness = maxval((table%force(2:) - table%force(:n - 1))/(table%elongation(2:) - &
      table%elongation(:n - 1)))
    if (.not. law%stiffness > 0.0_wp) then
      call report(reader, card%position, 'the forces of *SPRING, NONLINEAR never rise with the '// &
        'elongation: such a spring holds nothing')
      return
    end if
    if (.not. allocated(springs%tables)) allocate (springs%tables(0))
    springs%tables = [springs%tables, table]
    law%table = size(springs%tables)
    ok = .true.
  end subroutine read_forces

  !> Report tables where springs are linear.
  subroutine refuse_tables(reader, springs, finite_strain)
    type(reader_t), intent(inout) :: reader
    type(spring_elements_t), intent(in) :: springs
    logical, intent(in) :: finite_strain
    type(card_t) :: card
    logical :: is_table
    integer :: k

    if (finite_strain .or. .not. allocated(springs%tables)) return
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'SPRING') cycle
      call open_card(reader, k, card)
      is_table = .false.
      call flag_option(reader, card, 'NONLINEAR', is_table)
      if (.not. is_table) cycle
      call report(reader, option_position(card, 'NONLINEAR'), 'a table of *SPRING needs *STEP, '// &
        'NLGEOM: at small strain all springs are linear')
      return
    end do
  end subroutine refuse_tables

  !> One more spring.
  subroutine add_element(reader, model, element, law, springs)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(inout) :: model
    integer, intent(in) :: element !! among the skipped ones
    type(law_t), intent(in) :: law
    type(spring_elements_t), intent(inout) :: springs
    integer, allocatable :: node(:)
    real(wp), allocatable :: direction(:, :)
    integer :: i, n
    logical :: ok

    call find_ends(reader, model, element, node, ok)
    if (.not. ok) return
    n = size(node)
    allocate (direction(3, n), source=0.0_wp)
    if (model%mesh%skipped_kind(element) == spring_a) then
      if (.not. norm2(model%mesh%coordinates(:, node(2)) - model%mesh%coordinates(:, node(1))) > &
        0.0_wp) then
        call report(reader, model%mesh%skipped_position(element), 'the nodes of element '// &
          to_text(model%mesh%skipped_id(element))//' lie at one place: a SPRINGA acts along '// &
          'the line between them; use SPRING2')
        return
      end if
    end if
    do i = 1, n
      call mark_end(reader, model, element, node(i), law%dof(i), ok)
      if (.not. ok) return
      if (law%dof(i) == 0) cycle
      direction(mod(law%dof(i) - 1, 3) + 1, i) = merge(1.0_wp, -1.0_wp, i == 1)
      if (law%dof(i) <= 3) cycle
      node(i) = model%rotation_node(node(i))
    end do
    call add_spring_element(springs, model%mesh%skipped_id(element), node, direction, &
      law%stiffness, law%table)
  end subroutine add_element

  !> Report springs none of whose nodes is of an element, or joined to one.
  subroutine refuse_loose_springs(reader, draft, mesh)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(in) :: draft
    type(mesh_t), intent(in) :: mesh
    integer :: s

    do s = 1, mesh%springs%n
      if (mesh%body(mesh%springs%node(mesh%springs%first(s))) > 0) cycle
      call report(reader, draft%skipped_position(findloc(draft%skipped_id(:draft%n_skipped), &
        mesh%springs%id(s), dim=1)), 'spring element '//to_text(mesh%springs%id(s))//' joins '// &
        'nodes that belong to no element and are joined to none')
      return
    end do
  end subroutine refuse_loose_springs

  !> Springs speak of rotations, the nodes that stand for these of rotations times lengths, which
  !> are known when couplings have been made.
  pure subroutine scale_turned_springs(model, springs)
    type(model_t), intent(in) :: model
    type(spring_elements_t), intent(inout) :: springs
    integer :: k, i

    if (.not. allocated(model%rotation_of) .or. springs%n == 0) return
    do k = 1, springs%first(springs%n + 1) - 1
      i = findloc(model%rotation_of(2, :), springs%node(k), dim=1)
      if (i > 0) springs%direction(:, k) = springs%direction(:, k)/ &
        model%rotation_arm(model%rotation_of(1, i))
    end do
  end subroutine scale_turned_springs

  !> The nodes of an element.
  subroutine find_ends(reader, model, element, node, ok)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    integer, intent(in) :: element !! among the skipped ones
    integer, allocatable, intent(out) :: node(:)
    logical, intent(out) :: ok !! false: a mistake was reported
    integer :: first, last, n, i

    associate (mesh => model%mesh)
      first = mesh%skipped_first(element)
      last = mesh%n_skipped_nodes
      if (element < mesh%n_skipped) last = mesh%skipped_first(element + 1) - 1
      n = merge(1, 2, mesh%skipped_kind(element) == spring_1)
      ok = last - first + 1 == n
      allocate (node(n), source=0)
      if (.not. ok) then
        call report(reader, mesh%skipped_position(element), 'spring element '// &
          to_text(mesh%skipped_id(element))//' has '//to_text(last - first + 1)//' nodes, not '// &
          to_text(n))
        return
      end if
      do i = 1, n
        node(i) = find_id(mesh%nodes, mesh%node_id, mesh%skipped_nodes(first + i - 1))
        if (node(i) > 0) then
          if (is_of_block(mesh, node(i))) reader%numbers_block = .true.
          cycle
        end if
        call report(reader, mesh%skipped_position(element), 'element '// &
          to_text(mesh%skipped_id(element))//' names node '// &
          to_text(mesh%skipped_nodes(first + i - 1))//', which is not defined')
        ok = .false.
        return
      end do
      if (n == 1) return
      ok = node(1) /= node(2)
      if (.not. ok) call report(reader, mesh%skipped_position(element), 'element '// &
        to_text(mesh%skipped_id(element))//' names node '//to_text(mesh%node_id(node(1)))//' twice')
    end associate
  end subroutine find_ends

  !> Mark an end as joined; report where no spring can be.
  subroutine mark_end(reader, model, element, node, dof, ok)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(inout) :: model
    integer, intent(in) :: element, node, dof
    logical, intent(out) :: ok !! false: a mistake was reported
    character(:), allocatable :: words

    ok = .false.
    words = 'node '//to_text(model%mesh%node_id(node))//' of spring element '// &
      to_text(model%mesh%skipped_id(element))
    associate (position => model%mesh%skipped_position(element))
      if (.not. keep_reading(reader)) return
      if (model%reference(node)) then
        call report(reader, position, words//' is the reference node of an obstacle, which '// &
          'springs cannot join', 'join the spring to a node with a *BOUNDARY')
      else if (model%turned(node) > 0) then
        call report(reader, position, words//' is the ROT NODE of a rigid body: name its REF '// &
          'NODE and dofs 4 to 6')
      else if (dof > 3 .and. model%rotation_node(node) == 0) then
        call report(reader, position, words//' has no rotations: dofs 4 to 6 belong to '// &
          'reference nodes of couplings')
      else
        ok = .true.
        if (.not. model%used(node)) model%joined(node) = .true.
      end if
    end associate
  end subroutine mark_end

end module read_springs_mod
