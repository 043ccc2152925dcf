!> General contact: all outer faces may touch each other, but for what is excluded.
!>
!>     *CONTACT
!>     *CONTACT INCLUSIONS, ALL EXTERIOR     or lines: surface, surface
!>     *CONTACT EXCLUSIONS
!>     LID-TOP, CASE-FLOOR                   blank: all outer faces, or the first again
!>     *CONTACT PROPERTY ASSIGNMENT
!>     , , DRY                               the last line that fits wins
!>
!> Ordinary contact pairs are made of it (general_pairs_mod). *CONTACT PAIRs win for their faces.
module read_general_contact_mod
  use adjust_mod, only: adjust_t
  use cards_mod, only: note, reader_t, report
  use diagnostics_mod, only: any_mistakes, guess, quoted
  use elasticity_mod, only: young_modulus
  use fields_mod, only: field_position, fields_t, is_empty_field, name_field, &
    next_data_line
  use general_pairs_mod, only: everything, find_general_pairs, find_left_out, &
    general_contact_t, general_pair_t, is_by_hand, may_touch, never_touch, touch_by, touch_rule_t
  use name_table_mod, only: find_named
  use obstacles_mod, only: obstacle_t
  use options_mod, only: allow_no_data, allow_options, card_t, has_option, look_for_finite_strain, &
    open_card, option_position
  use read_interactions_mod, only: interactions_t, take_interaction
  use read_rigid_bodies_mod, only: rigid_bodies_t
  use read_surface_behavior_mod, only: is_tied
  use scene_mod, only: contact_pair_t, material_t
  use sets_mod, only: find_set, model_t
  use surface_list_mod, only: find_faces_of_nodes, find_surface, find_surface_or_set, has_facets, &
    surface_list_t
  use surface_pairs_mod, only: check_general_pair
  implicit none
  private

  public :: read_general_contact, is_general_contact, bodies_in_contact

contains

  !> Whether a deck has general contact of all outer faces.
  pure logical function is_general_contact(reader)
    type(reader_t), intent(in) :: reader

    is_general_contact = any(reader%cards(:reader%n_cards)%keyword == 'CONTACT INCLUSIONS')
  end function is_general_contact

  !> What the roles of bodies in general contact follow from.
  type(general_contact_t) function bodies_in_contact(model, material, bodies, tied) result(contact)
    type(model_t), intent(in) :: model
    type(material_t), intent(in) :: material(:) !! (n_elements) of each
    type(rigid_bodies_t), intent(in) :: bodies
    integer, intent(in) :: tied(:)              !! slave surfaces of ties

    allocate (contact%young, source=young_modulus(material%law%elastic))
    allocate (contact%is_rigid, source=rigid_pieces(model, bodies))
    allocate (contact%tied, source=tied)
  end function bodies_in_contact

  !> Read general contact, and append the pairs that follow from it to those of *CONTACT PAIR.
  subroutine read_general_contact(reader, model, contact, shapes, interactions, surfaces, pairs, &
    adjusts)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(general_contact_t), intent(inout) :: contact !! gets its rules and what they leave out
    type(obstacle_t), intent(in) :: shapes(:)
    type(interactions_t), intent(in) :: interactions
    type(surface_list_t), intent(inout) :: surfaces
    type(contact_pair_t), allocatable, intent(inout) :: pairs(:)
    type(adjust_t), allocatable, intent(inout) :: adjusts(:)
    type(general_pair_t), allocatable :: found(:)
    integer :: position, i

    call read_rules(reader, model, shapes, interactions, surfaces, contact%rules, position)
    if (position == 0 .or. any_mistakes(reader%diagnostics)) return
    if (.not. allocated(contact%young)) return ! no elements, which is reported
    call find_left_out(model, surfaces, contact)
    do i = 1, size(pairs)
      associate (master => merge(-pairs(i)%master, pairs(i)%master_surface, pairs(i)%master > 0))
        contact%rules = [contact%rules, touch_rule_t(is_by_hand, [pairs(i)%surface, master])]
      end associate
    end do
    call look_for_finite_strain(reader, contact%may_turn)
    ! Slave nodes have no mass: faces that may turn towards an obstacle would take that of the skin.
    contact%may_turn = contact%may_turn .and. .not. any(reader%cards(:reader%n_cards)%keyword == &
      'DYNAMIC')
    call find_general_pairs(model, contact, shapes, surfaces, found)
    call add_pairs()

  contains

    !> Make contact pairs of what was found, without those whose surfaces are on the wrong side of
    !> each other.
    subroutine add_pairs()
      type(contact_pair_t), allocatable :: all(:)
      type(contact_pair_t) :: pair
      type(adjust_t) :: adjust
      logical :: is_bare
      integer :: k, n, old

      old = size(pairs)
      allocate (all(old + size(found)))
      do k = 1, old
        all(k) = pairs(k)
      end do
      is_bare = .false.
      adjust%is_general = .true.
      adjust%position = position
      n = old
      do k = 1, size(found)
        pair = contact_pair_t()
        pair%is_general = .true.
        pair%surface = found(k)%surface
        pair%master = found(k)%master
        pair%master_surface = found(k)%master_surface
        call check_general_pair(reader, model, surfaces, shapes, position, pair, adjust%wanted)
        if (pair%master + pair%master_surface == 0) cycle
        n = n + 1
        all(n) = pair
        if (found(k)%interaction > 0) then
          call take_interaction(reader, interactions, found(k)%interaction, all(n))
        else
          all(n)%interaction = ''
          is_bare = .true.
        end if
        if (pair%master > 0) then
          all(n)%name = surfaces%list(pair%surface)%name//':'//shapes(pair%master)%name
        else
          all(n)%name = surfaces%list(pair%surface)%name//':'// &
            surfaces%list(pair%master_surface)%name
        end if
        adjust%pair = n
        adjusts = [adjusts, adjust]
      end do
      call move_alloc(all, pairs)
      pairs = pairs(:n)
      if (n == old .and. .not. any_mistakes(reader%diagnostics)) call note(reader, &
        'general contact makes no pair: no two bodies can meet, and no body an obstacle')
      if (is_bare) call note(reader, 'general contact without a *CONTACT PROPERTY ASSIGNMENT '// &
        'that fits is frictionless')
    end subroutine add_pairs

  end subroutine read_general_contact

  !> Which bodies *RIGID BODY makes rigid.
  function rigid_pieces(model, bodies) result(is_rigid)
    type(model_t), intent(in) :: model
    type(rigid_bodies_t), intent(in) :: bodies
    logical, allocatable :: is_rigid(:) !! (n_pieces)
    integer :: b, set, i

    allocate (is_rigid(maxval(model%mesh%piece)), source=.false.)
    do b = 1, size(bodies%list)
      associate (body => bodies%list(b), connectivity => model%mesh%connectivity)
        if (.not. body%is_solid) cycle
        if (body%of_nodes) then
          set = find_set(model%node_sets, body%set)
          if (set == 0) cycle
          associate (nodes => model%node_sets%list(set)%members)
            do i = 1, size(nodes)
              if (model%mesh%piece(nodes(i)) > 0) is_rigid(model%mesh%piece(nodes(i))) = .true.
            end do
          end associate
        else
          set = find_set(model%element_sets, body%set)
          if (set == 0) cycle
          associate (elements => model%element_sets%list(set)%members)
            do i = 1, model%element_sets%list(set)%n
              is_rigid(model%mesh%piece(connectivity%node(connectivity%first(elements(i))))) = &
                .true.
            end do
          end associate
        end if
      end associate
    end do
  end function rigid_pieces

  !> All lines, in the order of the deck.
  subroutine read_rules(reader, model, shapes, interactions, surfaces, rules, position)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(obstacle_t), intent(in) :: shapes(:)
    type(interactions_t), intent(in) :: interactions
    type(surface_list_t), intent(inout) :: surfaces
    type(touch_rule_t), allocatable, intent(out) :: rules(:)
    integer, intent(out) :: position !! of *CONTACT INCLUSIONS in the deck; 0: there is none
    type(card_t) :: card
    integer :: k
    logical :: is_open

    allocate (rules(0))
    position = 0
    is_open = .false.
    do k = 1, reader%n_cards
      select case (reader%cards(k)%keyword)
      case ('CONTACT')
        call open_card(reader, k, card)
        call allow_options(reader, card)
        call allow_no_data(reader, card)
        is_open = .true.
        if (.not. is_general_contact(reader)) call report(reader, card%position, '*CONTACT '// &
          'needs a *CONTACT INCLUSIONS: with ALL EXTERIOR, or lines of two surfaces')
      case ('CONTACT INCLUSIONS')
        call open_card(reader, k, card)
        call allow_options(reader, card)
        position = card%position
        if (has_option(card, 'ALL EXTERIOR')) then
          call allow_no_data(reader, card)
          rules = [rules, touch_rule_t(may_touch)]
        else
          call read_lines(may_touch)
        end if
      case ('CONTACT EXCLUSIONS')
        call open_card(reader, k, card)
        call allow_options(reader, card)
        call read_lines(never_touch)
      case ('CONTACT PROPERTY ASSIGNMENT')
        call open_card(reader, k, card)
        call allow_options(reader, card)
        call read_lines(touch_by)
      case ('CONTACT INITIALIZATION DATA')
        call open_card(reader, k, card)
        call allow_options(reader, card)
        call refuse_initial()
        cycle
      case default
        cycle
      end select
      if (.not. is_open) call report(reader, card%position, '*'//card%keyword//' belongs '// &
        'below *CONTACT')
    end do

  contains

    !> What else than overlaps removed without strain general contact may begin with.
    subroutine refuse_initial()
      if (has_option(card, 'INTERFERENCE FIT')) call report(reader, option_position(card, &
        'INTERFERENCE FIT'), 'INTERFERENCE FIT of *CONTACT INITIALIZATION DATA is not available', &
        'a *CONTACT PAIR presses out what overlaps in the mesh; *CLEARANCE says by how much')
      if (has_option(card, 'INITIAL CLEARANCE')) call report(reader, option_position(card, &
        'INITIAL CLEARANCE'), 'INITIAL CLEARANCE of *CONTACT INITIALIZATION DATA is not '// &
        'available', 'a *CONTACT PAIR with a *CLEARANCE')
      if (has_option(card, 'SEARCH ABOVE')) call report(reader, option_position(card, &
        'SEARCH ABOVE'), 'SEARCH ABOVE of *CONTACT INITIALIZATION DATA is not available', &
        'a *CONTACT PAIR with ADJUST=distance closes gaps')
    end subroutine refuse_initial

    !> The data lines of a card.
    subroutine read_lines(says)
      integer, intent(in) :: says
      type(fields_t) :: fields
      type(touch_rule_t) :: rule
      character(:), allocatable :: name
      character(:), allocatable :: form
      logical :: found, ok
      integer :: n

      n = 0
      form = 'two surfaces, blank for all outer faces'
      if (says == touch_by) form = form//', and an interaction'
      do
        call next_data_line(reader, card, fields, found, merge(3, 2, says == touch_by), form)
        if (.not. found) exit
        n = n + 1
        rule = touch_rule_t(says)
        call find_side(fields, 1, rule%side(1), ok)
        if (.not. ok) cycle
        rule%side(2) = rule%side(1)
        if (.not. is_empty_field(fields, 2)) call find_side(fields, 2, rule%side(2), ok)
        if (.not. ok) cycle
        if (says == touch_by) then
          call name_field(reader, fields, 3, 'a surface interaction', name, ok)
          if (.not. ok) cycle
          call find_named(reader, interactions%names, field_position(reader, fields, 3), name, &
            rule%interaction)
          if (rule%interaction == 0) cycle
          if (is_tied(reader, name)) then
            call report(reader, field_position(reader, fields, 3), 'surface interaction '// &
              quoted(name)//' ties surfaces: general contact cannot', 'join them by *TIE')
            cycle
          end if
        end if
        rules = [rules, rule]
      end do
      if (n > 0) return
      if (says == may_touch) form = form//'; or the option ALL EXTERIOR'
      call report(reader, card%position, '*'//card%keyword//' needs data lines: '//form)
    end subroutine read_lines

    !> A surface or an obstacle; blank is everything.
    subroutine find_side(fields, i, side, ok)
      type(fields_t), intent(in) :: fields
      integer, intent(in) :: i
      integer, intent(out) :: side
      logical, intent(out) :: ok
      character(:), allocatable :: name
      integer :: k

      side = everything
      ok = .true.
      if (is_empty_field(fields, i)) return
      call name_field(reader, fields, i, 'a surface', name, ok)
      if (.not. ok) return
      if (find_surface(surfaces, name) + find_set(model%node_sets, name) == 0) then
        side = -findloc([(shapes(k)%name == name, k=1, size(shapes))], .true., dim=1)
        ok = side < 0
        if (.not. ok) call report(reader, field_position(reader, fields, i), 'surface '// &
          quoted(name)//' is not defined', guess(name, surfaces%names(:surfaces%n_named)))
        return
      end if
      call find_surface_or_set(reader, model, field_position(reader, fields, i), name, surfaces, &
        side)
      ok = side > 0
      if (.not. ok) return
      if (has_facets(surfaces, side)) then
        side = -surfaces%obstacle(side)
        ok = side < 0
        return
      end if
      call find_faces_of_nodes(reader, model, surfaces, side)
      ok = size(surfaces%list(side)%faces, 2) > 0 .or. surfaces%flawed(side)
      if (.not. ok) call report(reader, field_position(reader, fields, i), quoted(name)//' has '// &
        'no faces: general contact is of surfaces of faces (*SURFACE, TYPE=ELEMENT)')
    end subroutine find_side

  end subroutine read_rules

end module read_general_contact_mod
