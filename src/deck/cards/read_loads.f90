!> What a step prescribes.
!>
!>     *BOUNDARY[, AMPLITUDE=name][, OP=MOD|NEW][, FIXED][, TYPE=VELOCITY|ACCELERATION]
!>     BODY-ZMAX, 1, 2, 0.            set or node, first dof, last dof, displacement
!>     BODY-XMIN, XSYMM               or XSYMM, YSYMM, ZSYMM, PINNED, ENCASTRE
!>     900, 5, 5, 0.17                dofs 4 to 6: rotation vector of a reference node
!>     901, 2, 2, 0.17                the same by dofs 1 to 3 of a ROT NODE
!>     *CLOAD[, AMPLITUDE=name][, OP=MOD|NEW]
!>     17, 3, -5.                     set or node, dof, force on each node
!>     *DSLOAD[, AMPLITUDE=name][, OP=MOD|NEW]
!>     BODY-ZMAX, P, 2.5              surface, P, pressure
module read_loads_mod
  use cards_mod, only: keep_reading, note, reader_t, report, report_in_field, &
    report_missing_element
  use diagnostics_mod, only: quoted
  use equation_list_mod, only: dof_in_words
  use fields_mod, only: field_position, field_text, fields_t, integer_field, is_empty_field, &
    limit_fields, looks_like_id, name_field, next_data_line, real_field, reference_field, &
    reference_t
  use kinds_mod, only: i8, wp
  use loads_mod, only: load_step_t, nodal_value_t, pressure_t
  use mesh_draft_mod, only: axisymmetric, given_nodes, solids
  use options_mod, only: allow_options, card_t, choice_option, flag_option, has_option, &
    option_position
  use read_amplitudes_mod, only: amplitude_list_t, amplitude_option
  use surface_list_mod, only: find_faces_of_nodes, find_surface_or_set, surface_list_t
  use sets_mod, only: model_t, referenced_nodes
  use text_mod, only: to_text
  implicit none
  private

  public :: load_draft_t, start_step, close_step, read_boundary, read_cload, read_dsload
  public :: add_pressure, read_op

  !> Values prescribed by all lines of a deck together, each node of a set counted: more than any
  !> real deck needs.
  integer(i8), parameter :: max_work = 200000000
  integer, parameter :: op_new = 2
  integer, parameter :: max_dof = 6 !! 4 to 6 are rotations, which obstacles alone have
  !> Words for supports, and the displacements that each prescribes.
  character(*), parameter :: supports(*) = ['ENCASTRE', 'PINNED  ', 'XSYMM   ', 'YSYMM   ', &
    'ZSYMM   ', 'XASYMM  ', 'YASYMM  ', 'ZASYMM  ']
  character(*), parameter :: held(*) = ['xyz', 'xyz', 'x  ', 'y  ', 'z  ', 'yz ', 'xz ', 'xy ']

  !> Prescribed values, and where in the list each node's are.
  type :: value_list_t
    type(nodal_value_t), allocatable :: values(:)
    integer :: n = 0
    integer, allocatable :: slot(:, :) !! (3, n_nodes) index into values; may be out of date
  end type value_list_t

  !> The loads of the step that is being read.
  type :: load_draft_t
    type(value_list_t) :: boundary, rotations, forces
    type(pressure_t), allocatable :: pressures(:)
    integer :: n_pressures = 0
    integer(i8) :: work = 0
  end type load_draft_t

contains

  !> Begin a step without loads.
  subroutine start_step(draft, n_nodes)
    type(load_draft_t), intent(inout) :: draft
    integer, intent(in) :: n_nodes

    if (.not. allocated(draft%pressures)) then
      allocate (draft%pressures(4), draft%boundary%values(64), draft%forces%values(64))
      allocate (draft%rotations%values(4), draft%rotations%slot(3, n_nodes))
      allocate (draft%boundary%slot(3, n_nodes), draft%forces%slot(3, n_nodes))
      draft%boundary%slot = 0
      draft%forces%slot = 0
      draft%rotations%slot = 0
    end if
    draft%boundary%n = 0
    draft%rotations%n = 0
    draft%forces%n = 0
    draft%n_pressures = 0
  end subroutine start_step

  !> Hand the loads of the step over.
  subroutine close_step(draft, step)
    type(load_draft_t), intent(in) :: draft
    type(load_step_t), intent(inout) :: step

    step%boundary = draft%boundary%values(:draft%boundary%n)
    step%rotations = draft%rotations%values(:draft%rotations%n)
    step%forces = draft%forces%values(:draft%forces%n)
    step%pressures = draft%pressures(:draft%n_pressures)
  end subroutine close_step

  !> *BOUNDARY: set or node, first dof[, last dof[, value]], or set or node, XSYMM and its kin
  subroutine read_boundary(reader, card, model, amplitudes, draft, replace, has_time, is_dynamic)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(model_t), intent(in) :: model
    type(amplitude_list_t), intent(in) :: amplitudes
    type(load_draft_t), intent(inout) :: draft
    logical, intent(inout) :: replace !! set by OP=NEW
    logical, intent(in), optional :: has_time   !! whether the period of the step was read
    logical, intent(in), optional :: is_dynamic !! whether it is a *DYNAMIC
    type(fields_t) :: fields
    type(reference_t) :: reference
    type(nodal_value_t) :: value
    integer, allocatable :: nodes(:), turned(:)
    integer :: i, choice
    logical :: found, ok, with(max_dof)

    call allow_options(reader, card)
    call flag_option(reader, card, 'FIXED', value%fixed)
    choice = 1
    call choice_option(reader, card, 'TYPE', choice, ok)
    value%rate = choice - 1
    if (value%rate > 0) call check_rate(reader, card, value%rate, has_time, is_dynamic)
    call read_op(reader, card, replace)
    call amplitude_option(reader, card, amplitudes, value%amplitude)
    if (value%fixed .and. has_option(card, 'AMPLITUDE')) call report(reader, &
      option_position(card, 'AMPLITUDE'), 'FIXED holds displacements where they are: there is '// &
      'nothing that an AMPLITUDE could lead')
    lines: do
      call next_data_line(reader, card, fields, found, 4, &
        'a set or node, first dof, last dof, value')
      if (.not. found) exit lines
      call reference_field(reader, fields, 1, 'a node or a set of nodes', reference, found)
      call read_dofs(reader, fields, with, ok)
      value%value = 0.0_wp
      if (.not. is_empty_field(fields, 4)) then
        call real_field(reader, fields, 4, 'the displacement', value%value, ok)
        if (value%fixed .and. abs(value%value) > 0.0_wp) then
          call note(reader, 'the values of *BOUNDARY, FIXED are ignored: displacements stay '// &
            'what they are')
          value%value = 0.0_wp
        end if
      end if
      if (.not. found) cycle lines
      call referenced_nodes(reader, model, reference, nodes)
      call split_rotations(model, nodes, turned)
      if (size(turned) > 0 .and. any(with(4:)) .and. abs(value%value) > 0.0_wp) then
        call report(reader, field_position(reader, fields, 4), 'dofs 1 to 3 of the ROT NODE of '// &
          'a rigid body are its rotation: it has no others')
        cycle lines
      end if
      call check_moves(reader, model, reference, nodes, value%value, .false.)
      call check_rotations(reader, model, fields, nodes, with, value%value)
      call check_plane(reader, model, fields, nodes, turned, with, value%value)
      do i = 1, 3
        ! What is held across a plane hold_plane says.
        if (with(i) .and. (i < 3 .or. model%mesh%plane == solids)) call add_values(reader, &
          model, nodes, i, value, draft%boundary, draft%work, sum_up=.false.)
        if (with(3 + i)) call add_rotations(reader, model, nodes, i, value, draft)
        if (with(i)) call add_rotations(reader, model, turned, i, value, draft)
      end do
      if (draft%work > max_work) then
        call report(reader, fields%start, 'the deck prescribes too many values')
        return
      end if
    end do lines
  end subroutine read_boundary

  !> Report a velocity or an acceleration that no displacement follows from.
  subroutine check_rate(reader, card, rate, has_time, is_dynamic)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    integer, intent(in) :: rate                           !! as of nodal_value_t
    logical, intent(in), optional :: has_time, is_dynamic !! as of read_boundary
    character(*), parameter :: hint = 'write the displacements at the end of each step'
    character(:), allocatable :: name
    logical :: is_below, inertia_counts

    name = 'TYPE=VELOCITY'
    if (rate == 2) name = 'TYPE=ACCELERATION'
    is_below = .false.
    if (present(has_time)) is_below = has_time
    inertia_counts = .false.
    if (present(is_dynamic)) inertia_counts = is_dynamic
    if (has_option(card, 'FIXED')) then
      call report(reader, option_position(card, 'TYPE'), name//' does not go with FIXED', hint)
    else if (.not. is_below) then
      call report(reader, option_position(card, 'TYPE'), &
        name//' must follow the *STATIC or *DYNAMIC of a step', hint)
    else if (rate == 2 .and. .not. inertia_counts) then
      call report(reader, option_position(card, 'TYPE'), name//' takes a *DYNAMIC step', hint)
    else if (has_option(card, 'AMPLITUDE') .and. .not. inertia_counts) then
      call report(reader, option_position(card, 'TYPE'), &
        name//' with AMPLITUDE takes a *DYNAMIC step', hint)
    end if
  end subroutine check_rate

  !> Take the ROT NODEs of rigid bodies out of a list of nodes.
  pure subroutine split_rotations(model, nodes, turned)
    type(model_t), intent(in) :: model
    integer, allocatable, intent(inout) :: nodes(:)
    integer, allocatable, intent(out) :: turned(:) !! the reference nodes whose rotations they are

    turned = model%turned(pack(nodes, model%turned(nodes) > 0))
    nodes = pack(nodes, model%turned(nodes) == 0)
  end subroutine split_rotations

  !> Prescribe a rotation of reference nodes: of obstacles, or of couplings, of which it is a
  !> displacement of the nodes that stand for it.
  subroutine add_rotations(reader, model, nodes, dof, value, draft)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    integer, intent(in) :: nodes(:)
    integer, intent(in) :: dof                !! 1, 2, 3: about x, y, z
    type(nodal_value_t), intent(in) :: value  !! [rad]
    type(load_draft_t), intent(inout) :: draft
    type(nodal_value_t) :: of_node
    integer :: i

    call add_values(reader, model, pack(nodes, .not. (model%used(nodes) .or. &
      model%rotation_node(nodes) > 0)), dof, value, draft%rotations, draft%work, sum_up=.false.)
    do i = 1, size(nodes)
      if (model%rotation_node(nodes(i)) == 0) cycle
      of_node = value
      of_node%value = value%value*model%rotation_arm(nodes(i))
      call add_values(reader, model, [model%rotation_node(nodes(i))], dof, of_node, &
        draft%boundary, draft%work, sum_up=.false.)
    end do
  end subroutine add_rotations

  !> Which dofs a line of *BOUNDARY means.
  subroutine read_dofs(reader, fields, with, ok)
    type(reader_t), intent(inout) :: reader
    type(fields_t), intent(in) :: fields
    logical, intent(out) :: with(max_dof) !! all false after a mistake
    logical, intent(out) :: ok
    character(:), allocatable :: word
    integer :: first, last, i

    with = .false.
    if (.not. is_empty_field(fields, 2) .and. .not. looks_like_id(reader, fields, 2)) then
      call name_field(reader, fields, 2, 'a dof', word, ok)
      call limit_fields(reader, fields, 2, 'a set or node and '//word)
      do i = 1, size(supports)
        if (word == supports(i)) with(:3) = [index(held(i), 'x'), index(held(i), 'y'), &
          index(held(i), 'z')] > 0
      end do
      if (.not. any(with)) then
        ok = .false.
        call report(reader, field_position(reader, fields, 2), &
          'expected a dof (1, 2 or 3), found '//quoted(field_text(reader, fields, 2)))
      end if
      return
    end if
    call read_dof(reader, fields, 2, 'the first dof', max_dof, first, ok)
    if (.not. ok) return
    last = first
    if (.not. is_empty_field(fields, 3)) then
      call read_dof(reader, fields, 3, 'the last dof', max_dof, last, ok)
      if (.not. ok) return
    end if
    ok = last >= first
    if (ok) then
      with(first:last) = .true.
    else
      call report(reader, field_position(reader, fields, 3), 'the last dof is below the first')
    end if
  end subroutine read_dofs

  subroutine read_dof(reader, fields, i, what, highest, dof, ok)
    type(reader_t), intent(inout) :: reader
    type(fields_t), intent(in) :: fields
    integer, intent(in) :: i
    character(*), intent(in) :: what
    integer, intent(in) :: highest
    integer, intent(out) :: dof
    logical, intent(out) :: ok

    call integer_field(reader, fields, i, what, merge(0, 1, reader%other_field), dof, ok)
    if (.not. ok .or. (dof >= 1 .and. dof <= highest)) return
    ok = .false.
    if (highest == max_dof) then
      call report_in_field(reader, field_position(reader, fields, i), what// &
        ' must be 1, 2 or 3 (4 to 6 on reference nodes of obstacles and couplings), not '// &
        quoted(field_text(reader, fields, i)))
    else
      call report_in_field(reader, field_position(reader, fields, i), what// &
        ' must be 1, 2 or 3 (moments turn nothing: *BOUNDARY turns obstacles), not '// &
        quoted(field_text(reader, fields, i)))
    end if
  end subroutine read_dof

  !> Report motions that leave the plane of plane elements, or are none of a body of revolution.
  subroutine check_plane(reader, model, fields, nodes, turned, with, value)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(fields_t), intent(in) :: fields
    integer, intent(in) :: nodes(:)
    integer, intent(in) :: turned(:) !! as of split_rotations
    logical, intent(in) :: with(max_dof)
    real(wp), intent(in) :: value

    if (.not. abs(value) > 0.0_wp .or. model%mesh%plane == solids) return
    if (model%mesh%plane == axisymmetric) then
      if (any(with(3:6)) .or. (with(1) .and. any(model%reference(nodes)))) call report(reader, &
        field_position(reader, fields, 4), 'with axisymmetric elements dofs 3 to 6 are 0, and '// &
        'obstacles move along y alone')
    else if ((size(nodes) > 0 .and. any(with(3:5))) .or. (size(turned) > 0 .and. any( &
      with(:2)))) then
      call report(reader, field_position(reader, fields, 4), 'with plane elements dofs 3 to 5 '// &
        'are 0 (1 and 2 of the ROT NODE of a rigid body): nothing moves across the plane')
    end if
  end subroutine check_plane

  !> Reference nodes may rotate. On nodes of elements rotations may be held at 0, as those of
  !> clamped sets and symmetry planes of other programs are; else they are a mistake.
  subroutine check_rotations(reader, model, fields, nodes, with, value)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(fields_t), intent(in) :: fields
    integer, intent(in) :: nodes(:)
    logical, intent(in) :: with(max_dof)
    real(wp), intent(in) :: value
    logical :: of_elements

    if (.not. any(with(4:))) return
    of_elements = any(model%used(nodes) .and. model%rotation_node(nodes) == 0)
    if (of_elements .and. abs(value) > 0.0_wp) then
      call report(reader, field_position(reader, fields, 4), &
        'the nodes of elements do not rotate: dofs 4 to 6 can only be held at 0')
    else if (of_elements) then
      call note(reader, 'dofs 4 to 6 of *BOUNDARY are ignored on nodes of elements, '// &
        'which have none')
    end if
  end subroutine check_rotations

  !> *CLOAD: set or node, dof, force
  subroutine read_cload(reader, card, model, amplitudes, draft, replace)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(model_t), intent(in) :: model
    type(amplitude_list_t), intent(in) :: amplitudes
    type(load_draft_t), intent(inout) :: draft
    logical, intent(inout) :: replace !! set by OP=NEW
    type(fields_t) :: fields
    type(reference_t) :: reference
    type(nodal_value_t) :: value
    integer, allocatable :: nodes(:), turned(:)
    integer :: dof, most
    logical :: found, ok(3), follows

    call allow_options(reader, card)
    call read_op(reader, card, replace)
    call amplitude_option(reader, card, amplitudes, value%amplitude)
    follows = .false.
    call flag_option(reader, card, 'FOLLOWER', follows)
    if (follows) call note(reader, 'FOLLOWER of *CLOAD is ignored: nodes of elements do not turn')
    do
      call next_data_line(reader, card, fields, found, 3, 'a set or node, dof, force')
      if (.not. found) exit
      call reference_field(reader, fields, 1, 'a node or a set of nodes', reference, ok(1))
      if (ok(1)) call referenced_nodes(reader, model, reference, nodes)
      if (follows .and. ok(1)) then
        if (any(model%rotation_node(nodes) > 0)) call report(reader, option_position(card, &
          'FOLLOWER'), 'FOLLOWER is not available for the reference node of a coupling or a '// &
          'rigid body', '*DSLOAD presses on a surface and follows it')
      end if
      ! What a force means stays on the deck's nodes: on more of them it would be more.
      if (ok(1)) nodes = given_nodes(model%mesh, nodes)
      most = max_dof
      if (ok(1)) then
        call split_rotations(model, nodes, turned)
        ! Of nodes that are not there nothing is known.
        if (size(turned) > 0 .or. any(model%rotation_node(nodes) == 0)) most = 3
      end if
      call read_dof(reader, fields, 2, 'the dof', most, dof, ok(2))
      call real_field(reader, fields, 3, 'the force', value%value, ok(3))
      if (.not. all(ok)) cycle
      call check_moves(reader, model, reference, nodes, value%value, model%mesh%empty_card)
      call note_singular(reader, model, nodes, value%value)
      if (dof > 3) then
        call add_moments(reader, model, reference, nodes, dof - 3, value, draft)
      else
        call add_moments(reader, model, reference, turned, dof, value, draft)
        call check_named(reader, model, reference, nodes, dof, value%value)
        call add_values(reader, model, nodes, dof, value, draft%forces, draft%work, sum_up=.true.)
      end if
      if (draft%work > max_work) then
        call report(reader, fields%start, 'the deck prescribes too many values')
        return
      end if
    end do
  end subroutine read_cload

  !> A moment on each of some reference nodes: a force at the arm by which its rotation is
  !> multiplied.
  subroutine add_moments(reader, model, reference, nodes, axis, value, draft)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(reference_t), intent(in) :: reference
    integer, intent(in) :: nodes(:)
    integer, intent(in) :: axis             !! 1, 2, 3: about x, y, z
    type(nodal_value_t), intent(in) :: value !! [force x length]
    type(load_draft_t), intent(inout) :: draft
    type(nodal_value_t) :: moment
    integer :: i

    do i = 1, size(nodes)
      if (model%rotation_node(nodes(i)) == 0) then
        if (model%reference(nodes(i)) .and. abs(value%value) > 0.0_wp) call report(reader, &
          reference%position, 'a moment on a rigid body of facets turns nothing: *BOUNDARY '// &
          'turns it')
        cycle
      end if
      moment = value
      moment%value = value%value/model%rotation_arm(nodes(i))
      associate (stand_in => [model%rotation_node(nodes(i))])
        call check_named(reader, model, reference, stand_in, axis, value%value)
        call add_values(reader, model, stand_in, axis, moment, draft%forces, draft%work, &
          sum_up=.true.)
      end associate
    end do
  end subroutine add_moments

  !> Say of forces on nodes of elements that are cut that there is no limit near them.
  subroutine note_singular(reader, model, nodes, value)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    integer, intent(in) :: nodes(:)
    real(wp), intent(in) :: value !! [force]
    logical :: is_of_cut(0:size(model%used))

    if (.not. allocated(model%mesh%between) .or. .not. abs(value) > 0.0_wp) return
    is_of_cut = .false.
    is_of_cut(reshape(model%mesh%between, [size(model%mesh%between)])) = .true.
    if (any(is_of_cut(nodes))) call note(reader, 'forces of *CLOAD stay on the nodes of the '// &
      'deck: near them displacements and stresses, and the energy, grow without end as '// &
      'elements get smaller; a pressure (*DSLOAD) or a *COUPLING spreads them')
  end subroutine note_singular

  !> *DSLOAD: surface, P, pressure
  subroutine read_dsload(reader, card, model, amplitudes, surfaces, draft, replace)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(model_t), intent(in) :: model
    type(amplitude_list_t), intent(in) :: amplitudes
    type(surface_list_t), intent(inout) :: surfaces !! sets of nodes named here are added
    type(load_draft_t), intent(inout) :: draft
    logical, intent(inout) :: replace !! set by OP=NEW
    type(fields_t) :: fields
    type(pressure_t) :: pressure
    character(:), allocatable :: name, label
    logical :: found, ok(3)

    call allow_options(reader, card)
    call read_op(reader, card, replace)
    call amplitude_option(reader, card, amplitudes, pressure%amplitude)
    do
      call next_data_line(reader, card, fields, found, 3, 'a surface, P, a pressure')
      if (.not. found) exit
      call name_field(reader, fields, 1, 'a surface', name, ok(1))
      call name_field(reader, fields, 2, 'P', label, ok(2))
      if (ok(2) .and. label /= 'P') call report(reader, field_position(reader, fields, 2), &
        'only P (pressure) is available, not '//quoted(label))
      call real_field(reader, fields, 3, 'the pressure', pressure%value, ok(3))
      if (.not. ok(1)) cycle
      call find_surface_or_set(reader, model, fields%start, name, surfaces, pressure%surface)
      if (pressure%surface == 0) cycle
      call find_faces_of_nodes(reader, model, surfaces, pressure%surface)
      if (size(surfaces%list(pressure%surface)%faces, 2) == 0) then
        if (surfaces%flawed(pressure%surface)) cycle
        if (model%mesh%taken_out) then
          call note(reader, 'surface '//quoted(name)//' has no faces: its pressure is ignored')
        else
          call report(reader, fields%start, 'surface '//quoted(name)//' has no faces')
        end if
      else if (all(ok)) then
        call add_pressure(draft%pressures, draft%n_pressures, pressure)
      end if
    end do
  end subroutine read_dsload

  !> OP=MOD (what is not named stays) or OP=NEW (what earlier steps prescribed ends).
  subroutine read_op(reader, card, replace)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    logical, intent(inout) :: replace
    integer :: choice
    logical :: ok

    choice = 1
    call choice_option(reader, card, 'OP', choice, ok)
    if (choice == op_new) replace = .true.
  end subroutine read_op

  !> Report a motion or a force on nodes that carry nothing, as a node does where the REF NODE= of
  !> an obstacle was forgotten. What is held at 0 there changes nothing, which is noted.
  subroutine check_moves(reader, model, reference, nodes, value, left_over)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(reference_t), intent(in) :: reference
    integer, intent(in) :: nodes(:)
    real(wp), intent(in) :: value    !! prescribed [length or force]
    logical, intent(in) :: left_over !! it may be of elements that were taken out
    character(:), allocatable :: what

    if (abs(value) <= 0.0_wp .or. size(nodes) == 0 .or. left_over) return
    if (any(model%used(nodes) .or. model%reference(nodes) .or. model%joined(nodes))) return
    what = 'node '//to_text(reference%id)//' belongs to no element and is'
    if (reference%id <= 0) what = 'the nodes of set '//quoted(reference%name)// &
      ' belong to no element and are'
    call report_missing_element(reader, reference%position, what// &
      ' not the reference node of an obstacle: '// &
      'this moves nothing', 'an obstacle is moved through the node named by its REF NODE=')
  end subroutine check_moves

  !> Report a force on nodes without elements along what no equation names: nothing carries it.
  subroutine check_named(reader, model, reference, nodes, dof, value)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(reference_t), intent(in) :: reference
    integer, intent(in) :: nodes(:)
    integer, intent(in) :: dof       !! 1, 2, 3
    real(wp), intent(in) :: value    !! [force]
    integer :: i

    if (.not. abs(value) > 0.0_wp) return
    do i = 1, size(nodes)
      if (.not. model%joined(nodes(i)) .or. model%named(dof, nodes(i))) cycle
      call report(reader, reference%position, 'no equation and no coupling has '// &
        dof_in_words(model, nodes(i), dof)//', which belongs to no element: nothing carries a '// &
        'force along it')
      return
    end do
  end subroutine check_named

  !> Prescribe a value on one dof of several nodes.
  !>
  !> Of one node and dof the list has one entry: a displacement takes the place of an earlier one,
  !> forces under the same amplitude add up.
  subroutine add_values(reader, model, nodes, dof, value, list, work, sum_up)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    integer, intent(in) :: nodes(:)
    integer, intent(in) :: dof
    type(nodal_value_t), intent(in) :: value  !! its value and amplitude
    type(value_list_t), intent(inout) :: list
    integer(i8), intent(inout) :: work
    logical, intent(in) :: sum_up
    integer :: i, node, at

    work = work + size(nodes)
    if (work > max_work .or. .not. keep_reading(reader)) return
    do i = 1, size(nodes)
      node = nodes(i)
      if (.not. (model%used(node) .or. model%reference(node) .or. model%joined(node))) then
        call note(reader, 'values prescribed on nodes that belong to no element are ignored')
        cycle
      end if
      at = list%slot(dof, node)
      if (at >= 1 .and. at <= list%n) then
        if (list%values(at)%node == node .and. list%values(at)%dof == dof) then
          if (.not. sum_up) then
            list%values(at) = value
            list%values(at)%node = node
            list%values(at)%dof = dof
            cycle
          else if (list%values(at)%amplitude == value%amplitude) then
            list%values(at)%value = list%values(at)%value + value%value
            cycle
          end if
        end if
      end if
      if (list%n == size(list%values)) list%values = [list%values, list%values]
      list%n = list%n + 1
      list%values(list%n) = value
      list%values(list%n)%node = node
      list%values(list%n)%dof = dof
      list%slot(dof, node) = list%n
    end do
  end subroutine add_values

  !> Add a pressure behind the first `n` of a list; a full list doubles, as all lists of loads do.
  subroutine add_pressure(list, n, pressure)
    type(pressure_t), allocatable, intent(inout) :: list(:)
    integer, intent(inout) :: n
    type(pressure_t), intent(in) :: pressure

    if (n == size(list)) list = [list, list]
    n = n + 1
    list(n) = pressure
  end subroutine add_pressure

end module read_loads_mod
