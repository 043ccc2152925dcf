!> Surfaces that are tied to each other, whatever their meshes.
!>
!>     *TIE, NAME=GLUE, POSITION TOLERANCE=0.01
!>     LID-ZMIN, BASE-ZMAX            slave surface, master surface; more lines are more pairs
module read_ties_mod
  use cards_mod, only: reader_t, report
  use diagnostics_mod, only: any_mistakes, quoted
  use fields_mod, only: field_position, fields_t, name_field, next_data_line
  use kinds_mod, only: wp
  use options_mod, only: allow_options, card_t, choice_option, has_option, name_option, &
    open_card, real_option
  use sets_mod, only: model_t
  use surface_list_mod, only: find_faces_of_nodes, find_surface_or_set, surface_list_t
  use surfaces_mod, only: bare_nodes
  use ties_mod, only: check_tie, tie_t
  implicit none
  private

  public :: read_ties

contains

  !> Read all *TIE cards.
  subroutine read_ties(reader, model, surfaces, ties)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(surface_list_t), intent(inout) :: surfaces
    type(tie_t), allocatable, intent(out) :: ties(:)
    integer :: k

    allocate (ties(0))
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword == 'TIE') call read_tie(reader, k, model, surfaces, ties)
    end do
  end subroutine read_ties

  !> *TIE, NAME=, POSITION TOLERANCE=, ADJUST=
  subroutine read_tie(reader, k, model, surfaces, ties)
    type(reader_t), intent(inout) :: reader
    integer, intent(in) :: k !! number of the card
    type(model_t), intent(in) :: model
    type(surface_list_t), intent(inout) :: surfaces
    type(tie_t), allocatable, intent(inout) :: ties(:)
    character(3), parameter :: answers(2) = ['YES', 'NO ']
    type(card_t) :: card
    type(fields_t) :: fields
    type(tie_t) :: tie, next
    character(:), allocatable :: name
    integer :: choice
    logical :: found, ok, has_name, is_first

    call open_card(reader, k, card)
    call allow_options(reader, card, ['NAME              ', 'POSITION TOLERANCE', &
      'ADJUST            '], ['TYPE       ', 'NO ROTATION'])
    if (has_option(card, 'CYCLIC SYMMETRY')) return ! its surfaces do not lie on each other
    call name_option(reader, card, 'NAME', .false., name, has_name)
    call real_option(reader, card, 'POSITION TOLERANCE', huge(1.0_wp), tie%tolerance, ok)
    choice = 1
    call choice_option(reader, card, 'ADJUST', answers, choice, ok)
    tie%adjust = choice == 1
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
      if (has_name) then
        next%name = name
      else
        next%name = surfaces%list(next%slave)%name//':'//surfaces%list(next%master)%name
      end if
      call check_tie(reader, model, surfaces%list(:surfaces%n), next, ok)
      if (ok) ties = [ties, next]
    end do
    if (is_first) call report(reader, card%position, &
      '*TIE needs a data line: slave surface, master surface')

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
      call find_surface_or_set(reader, model, field_position(reader, fields, i), word, surfaces, &
        index)
      if (index == 0) return
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

  end subroutine read_tie

end module read_ties_mod
