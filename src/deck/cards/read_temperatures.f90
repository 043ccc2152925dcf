!> Temperatures of the nodes: where nothing has expanded, and what a step makes of them.
!>
!>     *INITIAL CONDITIONS, TYPE=TEMPERATURE
!>     ALL, 20.                       set or node, temperature; 0 where nothing is said
!>     *TEMPERATURE[, AMPLITUDE=name][, OP=MOD|NEW]
!>     SHAFT, -180.                   set or node, temperature
module read_temperatures_mod
  use cards_mod, only: note, reader_t, report, report_in_field
  use cells_mod, only: cells, has_middles
  use connectivity_mod, only: nodes_of_element
  use diagnostics_mod, only: quoted
  use fields_mod, only: fields_t, next_data_line, real_field, reference_field, reference_t
  use kinds_mod, only: i8, wp
  use loads_mod, only: load_step_t, nodal_value_t
  use options_mod, only: allow_options, card_t, has_option, name_option, open_card, &
    option_position
  use read_amplitudes_mod, only: amplitude_list_t, amplitude_option
  use read_loads_mod, only: read_op
  use sets_mod, only: model_t, referenced_nodes, with_twins
  use text_mod, only: to_text
  implicit none
  private

  public :: temperature_draft_t, read_first_temperatures, start_temperatures, close_temperatures, &
    read_temperature

  !> Values set by all lines of a deck together, each node of a set counted: more than any real deck
  !> needs.
  integer(i8), parameter :: max_work = 200000000

  !> The temperatures of the step that is being read.
  type :: temperature_draft_t
    type(nodal_value_t), allocatable :: of_node(:) !! (n_nodes) `node` is 0 where nothing is said
    integer(i8) :: work = 0
  end type temperature_draft_t

contains

  !> *INITIAL CONDITIONS, TYPE=TEMPERATURE: set or node, temperature. Of one node the last counts.
  subroutine read_first_temperatures(reader, model, first)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    real(wp), allocatable, intent(out) :: first(:) !! (n_nodes) [temperature]
    type(card_t) :: card
    integer, allocatable :: nodes(:)
    integer(i8) :: work
    real(wp) :: value
    character(:), allocatable :: kind
    integer :: k
    logical :: ok, found, is_named(model%mesh%n_nodes)

    allocate (first(model%mesh%n_nodes), source=0.0_wp)
    is_named = .false.
    work = 0
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'INITIAL CONDITIONS') cycle
      call open_card(reader, k, card)
      call allow_options(reader, card)
      call name_option(reader, card, 'TYPE', .false., kind, ok)
      if (.not. has_option(card, 'TYPE')) call report(reader, card%position, &
        '*INITIAL CONDITIONS needs TYPE=TEMPERATURE or VELOCITY')
      if (.not. ok) cycle
      if (kind == 'TEMPERATURE') then
        call read_lines()
      else if (kind /= 'VELOCITY') then
        call report_in_field(reader, option_position(card, 'TYPE'), &
          'TYPE must be TEMPERATURE or VELOCITY, not '//quoted(kind))
      end if
    end do
    call note_unnamed_middles(reader, model, is_named, '*INITIAL CONDITIONS')

  contains

    subroutine read_lines()
      type(fields_t) :: fields

      fields%line = 0
      do
        call next_line(reader, card, model, fields, nodes, value, found, work)
        if (.not. found) return
        first(nodes) = value
        is_named(nodes) = .true.
      end do
    end subroutine read_lines

  end subroutine read_first_temperatures

  !> Begin a step that says nothing of temperatures.
  subroutine start_temperatures(draft, n_nodes)
    type(temperature_draft_t), intent(inout) :: draft
    integer, intent(in) :: n_nodes

    if (.not. allocated(draft%of_node)) allocate (draft%of_node(n_nodes))
    draft%of_node%node = 0
  end subroutine start_temperatures

  !> Hand the temperatures of the step over.
  subroutine close_temperatures(reader, model, draft, step)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(temperature_draft_t), intent(in) :: draft
    type(load_step_t), intent(inout) :: step

    call note_unnamed_middles(reader, model, draft%of_node%node > 0, '*TEMPERATURE')
    step%temperatures = pack(draft%of_node, draft%of_node%node > 0)
  end subroutine close_temperatures

  !> *TEMPERATURE: set or node, temperature.
  subroutine read_temperature(reader, card, model, amplitudes, draft, replace)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(model_t), intent(in) :: model
    type(amplitude_list_t), intent(in) :: amplitudes
    type(temperature_draft_t), intent(inout) :: draft
    logical, intent(inout) :: replace !! set by OP=NEW
    type(fields_t) :: fields
    integer, allocatable :: nodes(:)
    real(wp) :: value
    integer :: amplitude, i
    logical :: found

    call allow_options(reader, card)
    call read_op(reader, card, replace)
    call amplitude_option(reader, card, amplitudes, amplitude)
    do
      call next_line(reader, card, model, fields, nodes, value, found, draft%work)
      if (.not. found) exit
      do i = 1, size(nodes)
        draft%of_node(nodes(i)) = nodal_value_t(node=nodes(i), dof=1, value=value, &
          amplitude=amplitude)
      end do
    end do
  end subroutine read_temperature

  !> Note elements all of whose corners are named and not all of their mid-side nodes: sets of
  !> corners alone, which make the mean over an element's nodes another.
  subroutine note_unnamed_middles(reader, model, is_named, card)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    logical, intent(in) :: is_named(:)   !! (n_nodes)
    character(*), intent(in) :: card
    integer :: e, n, first_element, first_node

    if (.not. any(is_named)) return
    n = 0
    first_element = 0
    first_node = 0
    do e = 1, model%mesh%n_elements
      associate (cell => model%mesh%connectivity%cell(e), &
                 nodes => nodes_of_element(model%mesh%connectivity, e))
        if (.not. has_middles(cell)) cycle
        if (.not. all(is_named(nodes(:cells(cell)%n_corners))) .or. all(is_named(nodes))) cycle
        n = n + 1
        if (n > 1) cycle
        first_element = e
        first_node = nodes(findloc(is_named(nodes), .false., dim=1))
      end associate
    end do
    if (n == 0) return
    call note(reader, card//' gives temperatures to all corners of '//to_text(n)// &
      ' elements and not to all of their mid-side nodes (node '// &
      to_text(model%mesh%node_id(first_node))//' of element '// &
      to_text(model%mesh%element_id(first_element))//', for one): the mean over all nodes of '// &
      'an element counts')
  end subroutine note_unnamed_middles

  !> The next line of a set or node and its temperature.
  subroutine next_line(reader, card, model, fields, nodes, value, found, work)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(model_t), intent(in) :: model
    type(fields_t), intent(inout) :: fields
    integer, allocatable, intent(out) :: nodes(:) !! those that elements have; none after a mistake
    real(wp), intent(out) :: value
    logical, intent(out) :: found         !! there is a line
    integer(i8), intent(inout) :: work
    type(reference_t) :: reference
    logical :: is_known, ok

    allocate (nodes(0))
    value = 0.0_wp
    call next_data_line(reader, card, fields, found, 2, 'a set or node, a temperature')
    if (.not. found) return
    call reference_field(reader, fields, 1, 'a node or a set of nodes', reference, is_known)
    call real_field(reader, fields, 2, 'the temperature', value, ok)
    if (is_known) call referenced_nodes(reader, model, reference, nodes)
    work = work + size(nodes)
    if (work > max_work) then
      call report(reader, fields%start, 'the deck sets too many temperatures')
      found = .false.
      return
    end if
    if (size(nodes) > 0 .and. .not. any(model%used(nodes))) call note(reader, &
      'temperatures of nodes that belong to no element are ignored')
    nodes = pack(nodes, model%used(nodes) .and. ok)
    nodes = with_twins(model, nodes)
  end subroutine next_line

end module read_temperatures_mod
