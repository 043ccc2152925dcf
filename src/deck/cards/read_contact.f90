!> What may touch what.
!>
!>     *CONTACT PAIR, INTERACTION=DRY
!>     BODY-ZMIN, GROUND              slave surface (or set of nodes), obstacle
!>     *CONTACT PAIR, INTERACTION=DRY, SMALL SLIDING
!>     BODY-ZMAX, LID-ZMIN            slave surface, master surface
module read_contact_mod
  use adjust_mod, only: adjust_t, read_adjust
  use cards_mod, only: note, reader_t, report, report_missing_element
  use diagnostics_mod, only: any_mistakes, quoted
  use name_table_mod, only: find_named, name_table_t
  use fields_mod, only: field_position, field_text, fields_t, is_empty_field, name_field, &
    next_data_line
  use friction_laws_mod, only: friction_law_t
  use kinds_mod, only: wp
  use lookup_mod, only: find_name, make_name_lookup, name_lookup_t
  use options_mod, only: allow_options, card_t, flag_option, has_option, look_for_finite_strain, &
    name_option, open_card, option_position
  use obstacles_mod, only: obstacle_t
  use read_interactions_mod, only: interactions_t, take_interaction
  use read_surface_behavior_mod, only: is_tied
  use surface_list_mod, only: find_faces_of_nodes, find_surface, find_surface_or_set, has_facets, &
    surface_list_t
  use surface_pairs_mod, only: check_obstacle_pair, check_surface_pair, check_self_pair
  use scene_mod, only: contact_pair_t
  use sets_mod, only: find_set, model_t
  use text_mod, only: counted, string_t, to_text
  implicit none
  private

  public :: read_contact

contains

  !> *CONTACT PAIR, INTERACTION=name: slave surface, obstacle or master surface; a line a pair.
  subroutine read_contact(reader, model, surfaces, shapes, obstacles, interactions, pairs, adjusts)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(surface_list_t), intent(inout) :: surfaces !! sets of nodes named as slaves are added
    type(obstacle_t), intent(in) :: shapes(:)       !! the obstacles, those of *OBSTACLE first
    type(name_table_t), intent(in) :: obstacles     !! names of these
    type(interactions_t), intent(in) :: interactions
    type(contact_pair_t), allocatable, intent(out) :: pairs(:)
    type(adjust_t), allocatable, intent(out) :: adjusts(:) !! ADJUST= of each pair
    type(contact_pair_t), allocatable :: found_pairs(:)
    type(adjust_t), allocatable :: found_adjusts(:)
    integer, allocatable :: position(:)
    type(card_t) :: card
    type(fields_t) :: fields
    type(contact_pair_t) :: pair
    character(:), allocatable :: name
    type(adjust_t) :: adjust
    integer :: k, n, n_lines, interaction
    logical :: ok, found, is_sound

    is_sound = .not. any_mistakes(reader%diagnostics)
    associate (cards => reader%cards(:reader%n_cards))
      n = sum(cards%last - cards%first + 1, mask=cards%keyword == 'CONTACT PAIR')
    end associate
    allocate (found_pairs(n), found_adjusts(n), position(n))
    n = 0
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'CONTACT PAIR') cycle
      call open_card(reader, k, card)
      call allow_options(reader, card)
      call read_adjust(reader, card, model, adjust)
      pair%mu = 0.0_wp
      pair%law = friction_law_t()
      pair%no_separation = .false.
      pair%small_sliding = .false.
      call flag_option(reader, card, 'SMALL SLIDING', pair%small_sliding)
      call name_option(reader, card, 'INTERACTION', .true., name, ok)
      if (ok) then
        call find_named(reader, interactions%names, option_position(card, 'INTERACTION'), name, &
          interaction)
        pair%interaction = name
        if (interaction > 0 .and. .not. has_option(card, 'TIED')) call take_interaction(reader, &
          interactions, interaction, pair)
      end if
      if (is_tied(reader, name) .or. has_option(card, 'TIED')) cycle
      fields%line = 0 ! other cards may lie between two pairs
      n_lines = 0
      do
        call next_data_line(reader, card, fields, found, 2, 'a slave and its master')
        if (.not. found) exit
        n_lines = n_lines + 1
        call read_pair()
      end do
      if (n_lines == 0) call report(reader, card%position, &
        '*CONTACT PAIR needs a data line: slave, master')
    end do
    allocate (pairs(n))
    do k = 1, n
      pairs(k) = found_pairs(k)
    end do
    adjusts = found_adjusts(:n)
    call report_repeated_pairs(reader, pairs, position)
    call note_shared_slaves(reader, model, pairs, surfaces)

  contains

    !> The pair of a data line, with the options of its card.
    subroutine read_pair()
      integer :: other
      logical :: may_fold

      if (allocated(pair%left_open)) deallocate (pair%left_open)
      call find_slave(reader, model, fields, surfaces, obstacles, pair)
      call find_master(reader, model, fields, surfaces, obstacles, pair)
      if (pair%surface > 0 .and. pair%surface == pair%master_surface) then
        call look_for_finite_strain(reader, may_fold)
        if (is_sound) call check_self_pair(reader, model, surfaces, fields%start, may_fold, pair)
      else if (is_sound .and. pair%surface > 0 .and. pair%master_surface > 0) then
        call check_surface_pair(reader, model, surfaces, fields%start, field_position(reader, &
          fields, 2), pair)
      end if
      if (is_sound .and. pair%surface > 0 .and. pair%master > 0) call check_obstacle_pair(reader, &
        model, surfaces, shapes(pair%master), fields%start, field_position(reader, fields, 2), pair)
      if (pair%surface == 0 .or. pair%master + pair%master_surface == 0) return
      if (pair%master > 0) then
        pair%name = surfaces%list(pair%surface)%name//':'//shapes(pair%master)%name
      else
        pair%name = surfaces%list(pair%surface)%name//':'// &
          surfaces%list(pair%master_surface)%name
      end if
      if (.not. allocated(pair%interaction)) return ! reported
      if (reader%cards(k)%step > 0) then
        ! A step may name again what it goes on with.
        do other = 1, n
          if (.not. (found_pairs(other)%surface == pair%surface .and. found_pairs(other)%master == &
            pair%master .and. found_pairs(other)%master_surface == pair%master_surface .and. &
            found_pairs(other)%interaction == pair%interaction)) cycle
          call note(reader, 'the contact pair '//quoted(pair%name)//' is there already')
          return
        end do
      end if
      if (allocated(pair%left_open)) then
        ! Its surface is that of no other pair.
        do other = 1, n
          if (found_pairs(other)%name == pair%name) call report(reader, fields%start, &
            'duplicate contact pair '//quoted(pair%name))
        end do
      end if
      n = n + 1
      found_pairs(n) = pair
      found_adjusts(n) = adjust
      found_adjusts(n)%pair = n
      if (adjust%wanted .and. pair%surface == pair%master_surface) then
        found_adjusts(n)%wanted = .false.
        call note(reader, 'ADJUST moves no node of the contact pair '//quoted(pair%name)// &
          ', of a surface with itself')
      end if
      position(n) = fields%start
    end subroutine read_pair

  end subroutine read_contact

  !> The slave: a surface, or else a set of nodes.
  subroutine find_slave(reader, model, fields, surfaces, obstacles, pair)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(fields_t), intent(in) :: fields
    type(surface_list_t), intent(inout) :: surfaces
    type(name_table_t), intent(in) :: obstacles
    type(contact_pair_t), intent(inout) :: pair
    character(:), allocatable :: name
    logical :: ok

    pair%surface = 0
    call name_field(reader, fields, 1, 'the slave surface', name, ok)
    if (.not. ok) return
    if (find_name(obstacles%lookup, obstacles%names, name) > 0 .and. find_surface(surfaces, &
      name) == 0 .and. find_set(model%node_sets, name) == 0) then
      call report(reader, fields%start, quoted(name)//' is an obstacle: it can only be a master', &
        'the surface of the body, the slave, comes first, then the obstacle')
      return
    end if
    call find_surface_or_set(reader, model, fields%start, name, surfaces, pair%surface)
    if (pair%surface == 0) return
    if (has_facets(surfaces, pair%surface)) then
      ! Of other elements that are no solids an error was reported.
      if (surfaces%obstacle(pair%surface) > 0) call report(reader, fields%start, 'the slave '// &
        'surface '//quoted(name)//' consists of facets of a rigid body: it can only be a master')
      pair%surface = 0
      return
    end if
    call find_faces_of_nodes(reader, model, surfaces, pair%surface)
    if (size(surfaces%list(pair%surface)%nodes) > 0) return
    if (.not. surfaces%flawed(pair%surface)) then
      call report_missing_element(reader, fields%start, 'the slave surface '//quoted(name)// &
        ' is empty')
    end if
    pair%surface = 0
  end subroutine find_slave

  !> The master: an obstacle, or else a surface of faces, or else a set of nodes.
  subroutine find_master(reader, model, fields, surfaces, obstacles, pair)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(fields_t), intent(in) :: fields
    type(surface_list_t), intent(inout) :: surfaces
    type(name_table_t), intent(in) :: obstacles
    type(contact_pair_t), intent(inout) :: pair
    character(:), allocatable :: name
    logical :: ok, is_self

    pair%master = 0
    pair%master_surface = 0
    pair%overlap = 0.0_wp
    is_self = is_empty_field(fields, 2)
    if (.not. is_self) is_self = field_text(reader, fields, 1) == field_text(reader, fields, 2)
    if (is_self) then
      pair%master_surface = pair%surface
      return
    end if
    call name_field(reader, fields, 2, 'an obstacle or a surface', name, ok)
    if (.not. ok) return
    if (find_name(obstacles%lookup, obstacles%names, name) == 0 .and. max(find_surface(surfaces, &
      name), find_set(model%node_sets, name)) > 0) then
      call find_surface_or_set(reader, model, field_position(reader, fields, 2), name, surfaces, &
        pair%master_surface)
    end if
    if (has_facets(surfaces, pair%master_surface)) then
      pair%master = surfaces%obstacle(pair%master_surface)
      pair%master_surface = 0
      call forget_small_sliding()
      return
    end if
    if (pair%master_surface == 0) then
      call find_named(reader, obstacles, field_position(reader, fields, 2), name, pair%master)
      call forget_small_sliding()
    end if

  contains

    subroutine forget_small_sliding()
      if (pair%small_sliding) call note(reader, &
        'SMALL SLIDING of *CONTACT PAIR is ignored before an obstacle')
      pair%small_sliding = .false.
    end subroutine forget_small_sliding

  end subroutine find_master

  !> Say of pairs before one master that they share slave nodes: each gets a part of the force.
  subroutine note_shared_slaves(reader, model, pairs, surfaces)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(contact_pair_t), intent(in) :: pairs(:)
    type(surface_list_t), intent(in) :: surfaces
    logical :: is_slave(model%mesh%n_nodes)
    integer :: k, other, n

    if (any_mistakes(reader%diagnostics)) return
    do k = 2, size(pairs)
      is_slave = .false.
      is_slave(surfaces%list(pairs(k)%surface)%nodes) = .true.
      do other = 1, k - 1
        if (pairs(other)%master /= pairs(k)%master .or. pairs(other)%master_surface /= &
          pairs(k)%master_surface) cycle
        n = count(is_slave(surfaces%list(pairs(other)%surface)%nodes))
        if (n > 0) call note(reader, 'the contact pairs '//quoted(pairs(other)%name)//' and '// &
          quoted(pairs(k)%name)//' share '//counted(n, 'slave node')//' before one master: '// &
          'they divide the force there, and only their sum is determined')
      end do
    end do
  end subroutine note_shared_slaves

  !> Report pairs of the same surface and master, and of the same surfaces the other way round.
  subroutine report_repeated_pairs(reader, pairs, position)
    type(reader_t), intent(inout) :: reader
    type(contact_pair_t), intent(in) :: pairs(:)
    integer, intent(in) :: position(:)
    type(string_t), allocatable :: keys(:)
    type(name_lookup_t) :: lookup
    integer :: k, other

    allocate (keys(size(pairs)))
    do k = 1, size(pairs)
      keys(k)%text = key(pairs(k)%surface, pairs(k)%master, pairs(k)%master_surface)
    end do
    call make_name_lookup(keys, size(keys), lookup)
    do k = 1, size(pairs)
      if (find_name(lookup, keys, keys(k)%text) /= k) call report(reader, position(k), &
        'duplicate contact pair '//quoted(pairs(k)%name))
      if (pairs(k)%master > 0) cycle
      other = find_name(lookup, keys, key(pairs(k)%master_surface, 0, pairs(k)%surface))
      if (other > 0 .and. other < k) call report(reader, position(k), 'the surfaces of contact '// &
        'pair '//quoted(pairs(other)%name)//' the other way round: one of both is enough')
    end do

  contains

    pure function key(surface, obstacle, master_surface) result(text)
      integer, intent(in) :: surface, obstacle, master_surface
      character(:), allocatable :: text

      text = to_text(surface)//':'//to_text(obstacle)//':'//to_text(master_surface)
    end function key

  end subroutine report_repeated_pairs

end module read_contact_mod
