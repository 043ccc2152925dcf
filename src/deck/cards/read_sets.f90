!> Sets of nodes or elements, from *NSET, *ELSET and what *NODE, *ELEMENT and *BLOCK make.
!>
!>     *NSET, NSET=TOP                 ids, or names of sets defined above
!>     1, 2, 3
!>     *NSET, NSET=ROW, GENERATE       first, last, step
!>     10, 90, 10
!>     *NSET, NSET=SKIN, ELSET=BODY    the nodes of a set of elements
!>     *ELSET, ELSET=BODY
!>     1, CORE
!>
!> A second card with the same name adds to the set. A set may name only sets defined above it, so
!> no set can hold itself.
module read_sets_mod
  use block_mesh_mod, only: block_side_nodes
  use cards_mod, only: keep_reading, note, reader_t, report
  use connectivity_mod, only: nodes_of_element
  use diagnostics_mod, only: quoted
  use fields_mod, only: any_number, field_position, fields_t, integer_field, limit_fields, &
    next_data_line, reference_field, reference_t
  use growing_lists_mod, only: append
  use kinds_mod, only: i8
  use lookup_mod, only: find_id, find_name, make_name_lookup
  use mesh_draft_mod, only: early_set_t, is_of_block, mesh_draft_t, set_of_elements, &
    set_of_nodes, with_copies
  use options_mod, only: allow_no_data, allow_options, card_t, flag_option, has_option, &
    name_option, open_card, option_position
  use sets_mod, only: find_set, finish, model_t, &
    report_unknown, set_list_t, set_t
  use text_mod, only: to_text, upper
  implicit none
  private

  public :: read_sets

  !> Members of all sets together, and ids looked up on the way: more than any real deck needs.
  integer(i8), parameter :: max_work = 400000000
  integer, parameter :: max_wrong = 5 !! undefined ids of one card that are told
  character(*), parameter :: of_gmsh = 'GMSH:' !! begins names of meshio's tables of Gmsh's model

contains

  !> Read all sets, in the order of the deck; connect_mesh comes before.
  subroutine read_sets(reader, model)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(inout) :: model
    integer(i8) :: work

    model%node_sets%kind = set_of_nodes
    model%element_sets%kind = set_of_elements
    call list_entries(reader, model%mesh, 'NSET', model%node_sets)
    call list_entries(reader, model%mesh, 'ELSET', model%element_sets)
    work = 0
    call fill_sets(reader, model%mesh, model%element_sets, work)
    call fill_sets(reader, model%mesh, model%node_sets, work, model%element_sets)
    call add_copies(model)
  end subroutine read_sets

  !> Add to sets of nodes of a plane those that its elements have beside them.
  subroutine add_copies(model)
    type(model_t), intent(inout) :: model
    integer :: i

    if (.not. allocated(model%mesh%copies)) return
    do i = 1, model%node_sets%n
      associate (set => model%node_sets%list(i))
        if (.not. allocated(set%members)) cycle
        set%members = with_copies(model%mesh, set%members)
        set%n = size(set%members)
        call finish(set)
      end associate
    end do
  end subroutine add_copies

  !> List the early sets and the cards `keyword`, by place, with their names.
  subroutine list_entries(reader, draft, keyword, sets)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(in) :: draft
    character(*), intent(in) :: keyword
    type(set_list_t), intent(inout) :: sets
    type(card_t) :: card
    character(:), allocatable :: name
    integer :: k, e, most, place
    logical :: ok

    most = draft%n_sets + count(reader%cards(:reader%n_cards)%keyword == keyword)
    allocate (sets%list(most), sets%names(most), sets%card(most), sets%early(most))
    e = 1
    do k = 1, reader%n_cards + 1
      place = huge(place)
      if (k <= reader%n_cards) place = reader%source%first(reader%cards(k)%header)
      do while (e <= draft%n_sets)
        if (draft%sets(e)%position > place) exit
        if (draft%sets(e)%kind == sets%kind) then
          call add(draft%sets(e)%name, draft%sets(e)%position, 0, e)
        end if
        e = e + 1
      end do
      if (k > reader%n_cards) exit
      if (reader%cards(k)%keyword /= keyword) cycle
      call open_card(reader, k, card)
      call allow_options(reader, card)
      if (has_option(card, 'INSTANCE')) call report(reader, option_position(card, 'INSTANCE'), &
        'INSTANCE= belongs between *ASSEMBLY and *END ASSEMBLY')
      call name_option(reader, card, keyword, .true., name, ok)
      if (.not. ok) cycle
      if (index(name, of_gmsh) == 1) then
        call note(reader, 'set '//quoted(name)//' is skipped: meshio writes numbers of '// &
          'entities there, not ids')
      else
        call add(name, card%position, k, 0)
      end if
    end do
    call make_name_lookup(sets%names, sets%n, sets%lookup)

  contains

    subroutine add(name, position, card_number, early)
      character(*), intent(in) :: name
      integer, intent(in) :: position, card_number, early

      sets%n = sets%n + 1
      sets%names(sets%n)%text = name
      sets%list(sets%n)%position = position
      sets%card(sets%n) = card_number
      sets%early(sets%n) = early
    end subroutine add

  end subroutine list_entries

  !> Fill the sets of one kind, entry by entry.
  subroutine fill_sets(reader, draft, sets, work, elements)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(in) :: draft
    type(set_list_t), intent(inout) :: sets
    integer(i8), intent(inout) :: work                 !! members and look-ups so far
    type(set_list_t), intent(in), optional :: elements !! the sets of elements, for sets of nodes
    integer :: entry, home, before, had

    do entry = 1, sets%n
      home = find_name(sets%lookup, sets%names, sets%names(entry)%text)
      if (.not. keep_reading(reader)) return
      had = sets%list(home)%n
      if (sets%early(entry) > 0) then
        call fill_early(reader, draft, sets, entry, home)
      else
        before = reader%diagnostics%n_mistakes
        call fill_from_card(reader, draft, sets, entry, work, elements)
        if (reader%diagnostics%n_mistakes > before) sets%list(home)%flawed = .true.
      end if
      work = work + max(1, sets%list(home)%n - had)
      if (work > max_work) then
        call report(reader, sets%list(entry)%position, 'the sets have too many members')
        exit
      end if
    end do
    do entry = 1, sets%n
      call finish(sets%list(entry))
      if (sets%list(entry)%gone > 0) call note(reader, 'set '// &
        quoted(sets%names(entry)%text)//' names '//of_kind(sets%kind)//'s that are not in the '// &
        'deck (the first: '//of_kind(sets%kind)//' '//to_text(sets%list(entry)%gone)//')')
    end do
  end subroutine fill_sets

  !> The members of a set made beside nodes, elements or a block.
  subroutine fill_early(reader, draft, sets, entry, home)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(in) :: draft
    type(set_list_t), intent(inout) :: sets
    integer, intent(in) :: entry, home
    type(early_set_t) :: set
    integer :: i

    set = draft%sets(sets%early(entry))
    if (set%flawed) sets%list(home)%flawed = .true.
    if (set%block == 0) then
      if (sets%kind == set_of_nodes .and. allocated(draft%nodes%instead)) then
        call append(sets%list(home)%members, sets%list(home)%n, &
          draft%nodes%instead(set%first:set%last))
      else
        call append(sets%list(home)%members, sets%list(home)%n, [(i, i = set%first, set%last)])
      end if
      call append(sets%list(home)%skipped, sets%list(home)%n_skipped, &
        [(i, i = set%skipped(1), set%skipped(2))])
      return
    end if
    if (home < entry .and. set%side == 1) then
      if (sets%early(home) > 0) then
        if (draft%sets(sets%early(home))%block > 0) call report(reader, set%position, &
          'duplicate block '//quoted(draft%blocks(set%block)%name))
      end if
    end if
    associate (block => draft%blocks(set%block))
      call append(sets%list(home)%members, sets%list(home)%n, block%first_node - 1 + &
        block_side_nodes(block%n, set%side))
    end associate
  end subroutine fill_early

  !> The members that a *NSET or *ELSET card names.
  subroutine fill_from_card(reader, draft, sets, entry, work, elements)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(in) :: draft
    type(set_list_t), intent(inout) :: sets
    integer, intent(in) :: entry
    integer(i8), intent(inout) :: work
    type(set_list_t), intent(in), optional :: elements
    type(card_t) :: card
    type(fields_t) :: fields
    type(reference_t) :: reference
    integer :: i, home, n_wrong
    logical :: found, ok, generated

    call open_card(reader, sets%card(entry), card)
    home = find_name(sets%lookup, sets%names, sets%names(entry)%text)
    generated = .false.
    call flag_option(reader, card, 'GENERATE', generated)
    if (present(elements) .and. has_option(card, 'ELSET')) then
      if (generated) call report(reader, option_position(card, 'GENERATE'), &
        'GENERATE and ELSET= exclude each other: ids from lines, or the nodes of elements')
      call add_nodes_of_elements(reader, draft, elements, card, sets%list(home), work)
      return
    end if
    n_wrong = 0
    lines: do
      call next_data_line(reader, card, fields, found, any_number, 'ids and names of sets')
      if (.not. found) exit lines
      if (generated) then
        call generate(reader, draft, fields, sets, home, work)
        cycle lines
      end if
      do i = 1, fields%n
        call reference_field(reader, fields, i, 'an id or the name of a set', reference, ok)
        if (.not. ok) then
          if (.not. keep_reading(reader)) return
        else if (reference%id > 0) then
          call add_id(reader, draft, sets, home, reference%id, reference%position, work, ok)
          if (.not. ok) n_wrong = n_wrong + 1
          if (n_wrong == max_wrong) return ! the same mistake over and over, most likely
        else
          call add_set(reader, sets, reference, entry, home, work)
        end if
        if (work > max_work) return
      end do
    end do lines
  end subroutine fill_from_card

  !> Add the node or element `id`.
  subroutine add_id(reader, draft, sets, home, id, position, work, ok)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(in) :: draft
    type(set_list_t), intent(inout) :: sets
    integer, intent(in) :: home        !! of the set
    integer, intent(in) :: id, position
    integer(i8), intent(inout) :: work
    logical, intent(out) :: ok         !! false: there is no such id
    integer :: number

    associate (set => sets%list(home))
      if (sets%kind == set_of_nodes) then
        number = find_id(draft%nodes, draft%node_id, id)
      else
        number = find_id(draft%elements, draft%element_id, id)
        if (number == 0) then
          ok = .true.
          number = find_id(draft%skipped, draft%skipped_id, id)
          if (number > 0) then
            call append(set%skipped, set%n_skipped, number)
            return
          else if (draft%taken_out) then
            call mark_gone(set, id)
            return
          end if
        end if
      end if
      ok = number > 0
      if (ok) then
        call append(set%members, set%n, number)
        if (sets%kind == set_of_elements .or. is_of_block(draft, number)) reader%numbers_block = &
          .true.
        return
      end if
      work = work + reader%source%length
      if (is_idle(reader, sets, home)) then
        call mark_gone(set, id)
      else
        call report(reader, position, of_kind(sets%kind)//' '//to_text(id)//' is not defined')
      end if
    end associate
  end subroutine add_id

  !> Whether the deck has the name of a set nowhere but where cards define it, not even as a part of
  !> another name or in a comment: what is missing in it changes nothing.
  pure logical function is_idle(reader, sets, home)
    type(reader_t), intent(in) :: reader
    type(set_list_t), intent(in) :: sets
    integer, intent(in) :: home
    character(:), allocatable :: text
    integer :: i, next, left

    associate (name => sets%names(home)%text)
      left = count([(sets%names(i)%text == name, i=1, sets%n)])
      text = upper(reader%source%text(:reader%source%length))
      i = 1
      do
        next = index(text(i:), name)
        is_idle = left >= 0 .and. next == 0
        if (left < 0 .or. next == 0) return
        left = left - 1
        i = i + next - 1 + len(name)
      end do
    end associate
  end function is_idle

  !> What sets of a kind hold, in words.
  pure function of_kind(kind) result(word)
    integer, intent(in) :: kind
    character(:), allocatable :: word

    word = trim(merge('node   ', 'element', kind == set_of_nodes))
  end function of_kind

  !> Remember that a set names what is not in the deck.
  subroutine mark_gone(set, id)
    type(set_t), intent(inout) :: set
    integer, intent(in) :: id

    if (set%gone == 0) set%gone = id
  end subroutine mark_gone

  !> Add the members of another set.
  subroutine add_set(reader, sets, reference, entry, home, work)
    type(reader_t), intent(inout) :: reader
    type(set_list_t), intent(inout) :: sets
    type(reference_t), intent(in) :: reference
    integer, intent(in) :: entry, home
    integer(i8), intent(inout) :: work
    integer, allocatable :: members(:)
    integer :: other

    other = find_set(sets, reference%name)
    if (other == 0) then
      call report_unknown(reader, sets, reference%position, reference%name)
    else if (other >= entry .or. other == home) then
      call report(reader, reference%position, 'set '//quoted(reference%name)// &
        ' is not complete here: a set may only name sets defined above it')
    else
      call finish(sets%list(other))
      work = work + sets%list(other)%n
      if (work > max_work) return
      members = sets%list(other)%members(:sets%list(other)%n)
      call append(sets%list(home)%members, sets%list(home)%n, members)
      work = work + sets%list(other)%n_skipped
      if (sets%list(other)%n_skipped > 0 .and. work <= max_work) then
        members = sets%list(other)%skipped(:sets%list(other)%n_skipped)
        call append(sets%list(home)%skipped, sets%list(home)%n_skipped, members)
      end if
      if (sets%list(home)%gone == 0) sets%list(home)%gone = sets%list(other)%gone
      if (sets%list(other)%flawed) sets%list(home)%flawed = .true.
    end if
  end subroutine add_set

  !> Add first, first + step, ... last.
  subroutine generate(reader, draft, fields, sets, home, work)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(in) :: draft
    type(fields_t), intent(in) :: fields
    type(set_list_t), intent(inout) :: sets
    integer, intent(in) :: home        !! of the set
    integer(i8), intent(inout) :: work
    integer :: first, last, step
    integer(i8) :: id
    logical :: ok(3)

    call limit_fields(reader, fields, 3, 'first, last and step')
    call integer_field(reader, fields, 1, 'the first id', 1, first, ok(1))
    call integer_field(reader, fields, 2, 'the last id', 1, last, ok(2))
    step = 1
    ok(3) = .true.
    if (fields%n >= 3) call integer_field(reader, fields, 3, 'the step', 1, step, ok(3))
    if (.not. all(ok)) return
    if (last < first) then
      call report(reader, fields%start, 'the last id is below the first')
      return
    else if (mod(int(last, i8) - first, int(step, i8)) /= 0) then
      call report(reader, field_position(reader, fields, 2), 'steps of '//to_text(step)// &
        ' from '//to_text(first)//' do not lead to '//to_text(last))
      return
    end if
    if (sets%kind == set_of_elements .and. draft%taken_out .and. &
        (last - first)/step > draft%n_elements) then
      call pick_elements(draft, first, last, step, sets%list(home))
      work = work + draft%n_elements
      return
    end if
    ! Ends at the first id that does not exist, so it takes no longer than there are ids.
    do id = first, last, step
      work = work + 1
      call add_id(reader, draft, sets, home, int(id), fields%start, work, ok(1))
      if (.not. ok(1) .or. work > max_work) return
    end do
  end subroutine generate

  !> Add first, first + step, ... last where most of them do not exist.
  subroutine pick_elements(draft, first, last, step, set)
    type(mesh_draft_t), intent(in) :: draft
    integer, intent(in) :: first, last, step
    type(set_t), intent(inout) :: set
    integer :: e, id

    id = first
    do while (find_id(draft%elements, draft%element_id, id) > 0)
      id = id + step
    end do
    call mark_gone(set, id)
    do e = 1, draft%n_elements
      if (draft%element_id(e) < first .or. draft%element_id(e) > last) cycle
      if (mod(draft%element_id(e) - first, step) == 0) call append(set%members, set%n, e)
    end do
  end subroutine pick_elements

  !> Add the nodes of the elements in the set that ELSET= names.
  subroutine add_nodes_of_elements(reader, draft, elements, card, set, work)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(in) :: draft
    type(set_list_t), intent(in) :: elements
    type(card_t), intent(in) :: card
    type(set_t), intent(inout) :: set
    integer(i8), intent(inout) :: work
    character(:), allocatable :: name
    integer :: other, i
    logical :: ok

    call allow_no_data(reader, card)
    call name_option(reader, card, 'ELSET', .true., name, ok)
    if (.not. ok) return
    other = find_set(elements, name)
    if (other == 0) then
      call report_unknown(reader, elements, option_position(card, 'ELSET'), name)
      return
    end if
    if (elements%list(other)%flawed) set%flawed = .true.
    work = work + set%n + 8_i8*elements%list(other)%n + 8_i8*elements%list(other)%n_skipped
    if (work > max_work) return
    do i = 1, elements%list(other)%n
      call append(set%members, set%n, &
        nodes_of_element(draft%connectivity, elements%list(other)%members(i)))
    end do
    do i = 1, elements%list(other)%n_skipped
      call add_nodes_of_skipped(draft, elements%list(other)%skipped(i), set)
    end do
    call finish(set)
  end subroutine add_nodes_of_elements

  !> Add the nodes of an element of a line or a face, as far as they exist.
  subroutine add_nodes_of_skipped(draft, element, set)
    type(mesh_draft_t), intent(in) :: draft
    integer, intent(in) :: element
    type(set_t), intent(inout) :: set
    integer :: i, last, node

    last = draft%n_skipped_nodes
    if (element < draft%n_skipped) last = draft%skipped_first(element + 1) - 1
    do i = draft%skipped_first(element), last
      node = find_id(draft%nodes, draft%node_id, draft%skipped_nodes(i))
      if (node > 0) call append(set%members, set%n, node)
    end do
  end subroutine add_nodes_of_skipped

end module read_sets_mod
