!> Surfaces that are tied to each other, whatever their meshes.
!>
!>     *TIE, NAME=GLUE, POSITION TOLERANCE=0.01
!>     LID-ZMIN, BASE-ZMAX            slave surface, master surface; more lines are more pairs
!>
!> So are the surfaces of a *CONTACT PAIR whose *SURFACE BEHAVIOR ties them.
module read_ties_mod
  use cards_mod, only: note, reader_t, report
  use diagnostics_mod, only: any_mistakes, quoted
  use fields_mod, only: field_position, fields_t, name_field, next_data_line
  use kinds_mod, only: wp
  use lookup_mod, only: find_name
  use name_table_mod, only: name_table_t
  use options_mod, only: allow_options, card_t, choice_option, has_option, name_option, &
    open_card, real_option
  use read_surface_behavior_mod, only: is_tied
  use sets_mod, only: find_set, model_t
  use surface_list_mod, only: find_faces_of_nodes, find_surface, find_surface_or_set, &
    has_facets, surface_list_t
  use surfaces_mod, only: bare_nodes
  use ties_mod, only: check_tie, tie_t
  implicit none
  private

  public :: read_ties

contains

  !> Read all *TIE cards, and contact pairs that are tied.
  subroutine read_ties(reader, model, surfaces, obstacles, ties)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(surface_list_t), intent(inout) :: surfaces
    type(name_table_t), intent(in) :: obstacles !! names of the obstacles
    type(tie_t), allocatable, intent(out) :: ties(:)
    type(card_t) :: card
    type(tie_t) :: tie
    character(:), allocatable :: name
    integer :: k
    logical :: ok

    allocate (ties(0))
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword == 'TIE') then
        call open_card(reader, k, card)
        call read_tie(reader, model, surfaces, obstacles, card, ties)
      else if (reader%cards(k)%keyword == 'CONTACT PAIR') then
        call open_card(reader, k, card)
        call name_option(reader, card, 'INTERACTION', .true., name, ok)
        if (.not. ok) cycle
        if (has_option(card, 'TIED')) then
          call note(reader, 'a *CONTACT PAIR that is TIED is taken as a *TIE: *FRICTION is ignored')
        else if (is_tied(reader, name)) then
          call note(reader, 'surfaces that *SURFACE BEHAVIOR ties become a *TIE: its '// &
            'stiffness and *FRICTION are ignored')
        else
          cycle
        end if
        tie%name = ''
        call read_tied_pairs(reader, model, surfaces, obstacles, card, tie, ties)
      end if
    end do
  end subroutine read_ties

  !> *TIE, NAME=, POSITION TOLERANCE=, ADJUST=
  subroutine read_tie(reader, model, surfaces, obstacles, card, ties)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(surface_list_t), intent(inout) :: surfaces
    type(name_table_t), intent(in) :: obstacles
    type(card_t), intent(inout) :: card
    type(tie_t), allocatable, intent(inout) :: ties(:)
    type(tie_t) :: tie
    integer :: choice
    logical :: ok

    call allow_options(reader, card)
    if (has_option(card, 'CYCLIC SYMMETRY')) return ! its surfaces do not lie on each other
    call name_option(reader, card, 'NAME', .false., tie%name, ok)
    call real_option(reader, card, 'POSITION TOLERANCE', huge(1.0_wp), tie%tolerance, ok)
    choice = 1
    call choice_option(reader, card, 'ADJUST', choice, ok)
    tie%adjust = choice == 1
    call read_tied_pairs(reader, model, surfaces, obstacles, card, tie, ties)
  end subroutine read_tie

  !> The data lines of a card: a slave surface and a master surface each.
  subroutine read_tied_pairs(reader, model, surfaces, obstacles, card, tie, ties)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(surface_list_t), intent(inout) :: surfaces
    type(name_table_t), intent(in) :: obstacles
    type(card_t), intent(inout) :: card
    type(tie_t), intent(in) :: tie !! what all of them are like; name: '' where it has none
    type(tie_t), allocatable, intent(inout) :: ties(:)
    type(fields_t) :: fields
    type(tie_t) :: next
    logical :: found, ok, is_first

    is_first = .true.
    do
      call next_data_line(reader, card, fields, found, 2, 'a slave surface and a master surface')
      if (.not. found) exit
      is_first = .false.
      next = tie
      next%position = fields%start
      call find_side(1, 'the slave surface', next%slave)
      call find_side(2, 'the master surface', next%master)
      if (next%slave == 0 .or. next%master == 0) cycle
      if (tie%name == '') next%name = surfaces%list(next%slave)%name//':'// &
        surfaces%list(next%master)%name
      call check_tie(reader, model, surfaces%list(:surfaces%n), next, ok)
      if (ok) ties = [ties, next]
    end do
    if (is_first) call report(reader, card%position, &
      '*'//card%keyword//' needs a data line: slave surface, master surface')

  contains

    !> A surface of faces, with all of its nodes on them.
    subroutine find_side(i, what, index)
      integer, intent(in) :: i
      character(*), intent(in) :: what
      integer, intent(out) :: index
      character(:), allocatable :: word

      index = 0
      call name_field(reader, fields, i, what, word, ok)
      if (.not. ok) return
      if (find_name(obstacles%lookup, obstacles%names, word) > 0 .and. max(find_surface(surfaces, &
        word), find_set(model%node_sets, word)) == 0) then
        call report(reader, field_position(reader, fields, i), what//' '//quoted(word)// &
          ' of a tie is an obstacle: only surfaces of elements can be tied', &
          'put *BOUNDARY on the nodes to hold them')
        return
      end if
      call find_surface_or_set(reader, model, field_position(reader, fields, i), word, surfaces, &
        index)
      if (index == 0) return
      if (has_facets(surfaces, index)) then
        call report(reader, field_position(reader, fields, i), what//' '//quoted(word)// &
          ' of a tie consists of facets of a rigid body: only surfaces of elements can be tied', &
          'TIE NSET= of the *RIGID BODY joins a set of nodes to it')
        index = 0
        return
      end if
      call find_faces_of_nodes(reader, model, surfaces, index)
      if (surfaces%flawed(index) .or. any_mistakes(reader%diagnostics)) then
        index = 0
        return
      end if
      associate (surface => surfaces%list(index))
        if (size(surface%faces, 2) > 0 .and. size(bare_nodes(surface, model%mesh%connectivity, &
          model%mesh%n_nodes)) == 0) return
      end associate
      call report(reader, field_position(reader, fields, i), what//' '//quoted(word)// &
        ' of a tie has nodes without faces: it must consist of faces (*SURFACE, TYPE=ELEMENT)')
      index = 0
    end subroutine find_side

  end subroutine read_tied_pairs

end module read_ties_mod
