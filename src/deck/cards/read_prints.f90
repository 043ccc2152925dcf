!> Sets whose nodes or elements are written as tables.
!>
!>     *NODE PRINT, NSET=GRIP, TOTALS=YES, FREQUENCY=5      in a step
!>     U, RF
!>     *EL PRINT, ELSET=CORE, POSITION=CENTROIDAL
!>     S, MISES
module read_prints_mod
  use cards_mod, only: note, reader_t, report
  use controls_mod, only: print_t
  use diagnostics_mod, only: quoted
  use fields_mod, only: any_number, fields_t, is_empty_field, name_field, next_data_line
  use mesh_draft_mod, only: given_nodes
  use options_mod, only: allow_options, card_t, choice_option, has_option, integer_option, &
    name_option, open_card, option_position
  use spring_elements_mod, only: spring_elements_t
  use sets_mod, only: find_set, model_t, report_unknown, set_list_t
  use text_mod, only: to_text
  implicit none
  private

  public :: read_prints

  integer, parameter :: totals_only = 3
  integer, parameter :: most = 1000 !! tables: more than any real deck needs

contains

  !> *NODE PRINT and *EL PRINT of all steps together: of a set, or a set and a position of its
  !> elements, there is one table, with all that any card names and the last FREQUENCY; of its
  !> springs another one. A card with a FREQUENCY of 0 asks for nothing.
  subroutine read_prints(reader, model, springs, prints)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(spring_elements_t), intent(in) :: springs
    type(print_t), allocatable, intent(out) :: prints(:) !! not allocated: none
    type(print_t), allocatable :: list(:)
    type(print_t) :: print
    type(card_t) :: card
    integer :: k
    integer, allocatable :: chosen(:) !! springs
    logical :: ok, any_name

    allocate (list(0))
    do k = 1, reader%n_cards
      if (.not. any(reader%cards(k)%keyword == ['NODE PRINT', 'EL PRINT  '])) cycle
      call open_card(reader, k, card)
      print = print_t(of_elements=card%keyword == 'EL PRINT')
      call allow_options(reader, card)
      call integer_option(reader, card, 'FREQUENCY', 0, huge(1), print%frequency, ok)
      if (print%frequency == 0) cycle
      if (print%of_elements) then
        call read_element_options(reader, card, print)
        call read_set(reader, card, model, model%element_sets, springs, print, chosen, ok)
      else
        call read_node_options(reader, card, print)
        call read_set(reader, card, model, model%node_sets, springs, print, chosen, ok)
      end if
      call read_variables(reader, card, print, any_name)
      if (.not. any_name) cycle
      if (ok) call add_table(print)
      if (size(chosen) == 0 .or. .not. (print%stress .or. print%strain)) cycle
      print%of_springs = .true.
      print%at_gauss_points = .false.
      print%members = chosen
      call add_table(print)
    end do
    if (size(list) > 0) call move_alloc(list, prints)

  contains

    subroutine add_table(print)
      type(print_t), intent(in) :: print
      integer :: same

      same = find_same(list, print)
      if (same > 0) then
        call add_to(list(same), print)
      else if (size(list) == most) then
        call report(reader, card%position, 'the deck prints more than '//to_text(most)//' sets')
      else
        list = [list, print]
      end if
    end subroutine add_table

  end subroutine read_prints

  subroutine read_node_options(reader, card, print)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(print_t), intent(inout) :: print
    integer :: choice
    logical :: ok

    choice = 1
    call choice_option(reader, card, 'TOTALS', choice, ok)
    print%totals = choice > 1
    print%each = choice /= totals_only
  end subroutine read_node_options

  subroutine read_element_options(reader, card, print)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(print_t), intent(inout) :: print
    integer :: choice
    logical :: ok

    choice = 1
    call choice_option(reader, card, 'POSITION', choice, ok)
    print%at_gauss_points = choice == 1
  end subroutine read_element_options

  !> The set of a card and what is in it.
  subroutine read_set(reader, card, model, sets, springs, print, chosen, ok)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(model_t), intent(in) :: model
    type(set_list_t), intent(in) :: sets !! of the model: of nodes, or of elements
    type(spring_elements_t), intent(in) :: springs
    type(print_t), intent(inout) :: print
    integer, allocatable, intent(out) :: chosen(:) !! springs of a set of elements, ascending
    logical, intent(out) :: ok !! false: a mistake was reported, or there is nothing else to write
    character(:), allocatable :: option
    logical :: is_in(springs%n)
    integer :: found, i

    option = trim(merge('ELSET', 'NSET ', print%of_elements))
    allocate (chosen(0))
    if (.not. has_option(card, option)) then
      print%set = 'ALL'
      if (print%of_elements) then
        print%members = [(i, i=1, model%mesh%n_elements)]
        chosen = [(i, i=1, springs%n)]
      else
        print%members = pack([(i, i=1, size(model%used))], model%used)
        print%summed = print%members
        print%members = given_nodes(model%mesh, print%members)
      end if
      ok = size(print%members) > 0
      return
    end if
    call name_option(reader, card, option, .true., print%set, ok)
    if (.not. ok) return
    found = find_set(sets, print%set)
    ok = .false.
    if (found == 0) then
      call report_unknown(reader, sets, option_position(card, option), print%set)
      return
    end if
    if (allocated(sets%list(found)%members)) then
      print%members = sets%list(found)%members
      if (.not. print%of_elements) then
        if (any(model%turned(print%members) > 0)) then
          call note(reader, '*NODE PRINT of '//quoted(print%set)//' leaves out ROT NODEs: '// &
            '/reference_nodes of the result file has rotations and moments')
          print%members = pack(print%members, model%turned(print%members) == 0)
        end if
        print%summed = print%members
        print%members = given_nodes(model%mesh, print%members)
      end if
      ok = size(print%members) > 0
    end if
    associate (of => sets%list(found))
      is_in = .false.
      if (of%n_skipped > 0 .and. springs%n > 0) is_in = [(any(model%mesh%skipped_id( &
        of%skipped(:of%n_skipped)) == springs%id(i)), i=1, springs%n)]
      chosen = pack([(i, i=1, springs%n)], is_in)
    end associate
    if (.not. (ok .or. size(chosen) > 0 .or. sets%list(found)%flawed)) call note(reader, '*'// &
      card%keyword//' of '//quoted(print%set)//' writes nothing: the set is empty')
  end subroutine read_set

  !> The names of what is to be written.
  subroutine read_variables(reader, card, print, any_name)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(print_t), intent(inout) :: print
    logical, intent(out) :: any_name !! else nothing is printed
    type(fields_t) :: fields
    character(:), allocatable :: name
    integer :: i
    logical :: found, ok

    any_name = .false.
    do
      call next_data_line(reader, card, fields, found, any_number, 'names of results')
      if (.not. found) exit
      do i = 1, fields%n
        if (is_empty_field(fields, i)) cycle
        call name_field(reader, fields, i, 'the name of a result', name, ok)
        if (.not. ok) return
        any_name = .true.
        select case (card%keyword//' '//name)
        case ('NODE PRINT U')
          print%displacement = .true.
        case ('NODE PRINT RF')
          print%reaction = .true.
        case ('NODE PRINT CF')
          print%loads = .true.
        case ('EL PRINT S')
          print%stress = .true.
        case ('EL PRINT E')
          print%strain = .true.
        case ('EL PRINT MISES')
          print%mises = .true.
        case ('EL PRINT SP')
          print%principal_stress = .true.
        case ('EL PRINT EP')
          print%principal_strain = .true.
        case default
          call note(reader, '*'//card%keyword//': '//quoted(name)//' is not written')
        end select
      end do
    end do
    if (.not. any_name) call note(reader, '*'//card%keyword//' without names of results, as '// &
      trim(merge('S, E ', 'U, RF', print%of_elements))//', writes nothing')
  end subroutine read_variables

  !> The table of the same set, and of elements of the same places; 0: there is none yet.
  pure integer function find_same(list, print) result(same)
    type(print_t), intent(in) :: list(:), print

    do same = 1, size(list)
      if ((list(same)%of_elements .eqv. print%of_elements) .and. (list(same)%of_springs .eqv. &
        print%of_springs) .and. list(same)%set == print%set .and. (list(same)%at_gauss_points &
        .eqv. print%at_gauss_points)) return
    end do
    same = 0
  end function find_same

  !> What another card of the same table adds.
  pure subroutine add_to(table, print)
    type(print_t), intent(inout) :: table
    type(print_t), intent(in) :: print

    table%frequency = print%frequency
    table%each = table%each .or. print%each
    table%totals = table%totals .or. print%totals
    table%displacement = table%displacement .or. print%displacement
    table%reaction = table%reaction .or. print%reaction
    table%loads = table%loads .or. print%loads
    table%stress = table%stress .or. print%stress
    table%strain = table%strain .or. print%strain
    table%mises = table%mises .or. print%mises
    table%principal_stress = table%principal_stress .or. print%principal_stress
    table%principal_strain = table%principal_strain .or. print%principal_strain
  end subroutine add_to

end module read_prints_mod
