!> Named sets of nodes or elements, and what they belong to.
module sets_mod
  use cards_mod, only: note, reader_t, report
  use diagnostics_mod, only: guess, quoted
  use fields_mod, only: reference_t
  use kinds_mod, only: wp
  use lookup_mod, only: find_id, find_name, name_lookup_t
  use mesh_draft_mod, only: find_elements, is_of_block, mesh_draft_t, set_of_nodes, with_copies
  use options_mod, only: card_t, name_option, option_position
  use sorting_mod, only: sort_unique
  use text_mod, only: string_t, to_text
  implicit none
  private

  public :: set_t, set_list_t, model_t, find_set, find_elset, report_unknown, referenced_nodes
  public :: referenced_elements, finish, with_twins, extend_marks

  !> A set. Only the first card of a name holds it; later ones add to that.
  type :: set_t
    integer, allocatable :: members(:)  !! node or element numbers; when all is read, ascending
    integer :: n = 0
    integer :: position = 0             !! of the card
    integer, allocatable :: skipped(:)  !! elements of types that are not computed
    integer :: n_skipped = 0
    integer :: gone = 0                 !! id of the first member that is not in the deck, if any
    logical :: flawed = .false.         !! members are missing because of mistakes
  end type set_t

  !> All sets of one kind.
  type :: set_list_t
    integer :: kind = set_of_nodes
    type(set_t), allocatable :: list(:)
    type(string_t), allocatable :: names(:)
    integer :: n = 0
    type(name_lookup_t) :: lookup
    integer, allocatable :: card(:)     !! (n) card of the entry; 0: an early set
    integer, allocatable :: early(:)    !! (n) early set of the entry; 0: a card
  end type set_list_t

  !> The mesh with its sets: what the rest of the deck refers to.
  type :: model_t
    type(mesh_draft_t) :: mesh
    type(set_list_t) :: node_sets
    type(set_list_t) :: element_sets
    logical, allocatable :: used(:) !! (n_nodes) whether an element has the node
    logical, allocatable :: reference(:) !! (n_nodes) whether an obstacle moves with the node
    logical, allocatable :: rigid(:)
    !! (n_nodes) whether a facet has the node that a rigid body may take
    integer, allocatable :: rotation_of(:, :)
    !! (2,k) reference nodes of couplings, and the nodes that stand for their rotations
    integer, allocatable :: rotation_node(:) !! (n_nodes) the same of each node, 0 of others
    real(wp), allocatable :: rotation_arm(:)
    !! (n_nodes) by which rotations of reference nodes are multiplied [length]
    logical, allocatable :: joined(:)
    !! (n_nodes) nodes that no element has and an equation or a coupling names
    integer, allocatable :: turned(:)
    !! (n_nodes) of the ROT NODE of a rigid body its reference node, 0 of others
    integer :: n_added = 0 !! nodes that stand for rotations or reference nodes, not of the deck
    logical, allocatable :: named(:, :) !! (3,n_nodes) degrees of freedom that equations name
    integer, allocatable :: twins(:, :)
    !! (2,k) nodes that cuts of bolts made, and those beside them; not allocated: none
    logical, allocatable :: weighs(:)    !! (n_elements) whether its material has a density
  end type model_t

contains

  !> The numbers of the nodes that a reference means; a mistake is reported where it means none.
  subroutine referenced_nodes(reader, model, reference, nodes, flawed)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(reference_t), intent(in) :: reference
    integer, allocatable, intent(out) :: nodes(:)
    logical, intent(inout), optional :: flawed !! set where the set is flawed
    integer :: found

    if (reference%id > 0) then
      found = find_id(model%mesh%nodes, model%mesh%node_id, reference%id)
      if (found == 0) call report(reader, reference%position, 'node '//to_text(reference%id)// &
        ' is not defined')
      if (found > 0) then
        nodes = with_copies(model%mesh, [found])
        if (is_of_block(model%mesh, found)) reader%numbers_block = .true.
      end if
    else
      found = find_set(model%node_sets, reference%name)
      if (found == 0) call report_unknown(reader, model%node_sets, reference%position, &
        reference%name)
      if (found > 0) then
        if (present(flawed)) flawed = flawed .or. model%node_sets%list(found)%flawed
        if (allocated(model%node_sets%list(found)%members)) then
          nodes = model%node_sets%list(found)%members
          if (size(nodes) == 0 .and. .not. model%node_sets%list(found)%flawed) then
            call note(reader, 'node set '//quoted(reference%name)//' is empty')
          end if
        end if
      end if
    end if
    if (.not. allocated(nodes)) allocate (nodes(0))
  end subroutine referenced_nodes

  !> The numbers of the elements that a reference means; a mistake is reported where it means none.
  subroutine referenced_elements(reader, model, reference, elements, flawed)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(reference_t), intent(in) :: reference
    integer, allocatable, intent(out) :: elements(:)
    logical, intent(inout) :: flawed !! set where the set is flawed
    integer :: found

    if (reference%id > 0) then
      elements = find_elements(model%mesh, reference%id)
      if (size(elements) > 0) then
        reader%numbers_block = .true.
      else if (find_id(model%mesh%skipped, model%mesh%skipped_id, reference%id) > 0) then
        continue
      else if (model%mesh%taken_out) then
        call note(reader, 'surfaces and loads name elements that are not in the deck')
      else
        call report(reader, reference%position, 'element '//to_text(reference%id)// &
          ' is not defined')
      end if
    else
      found = find_set(model%element_sets, reference%name)
      if (found == 0) call report_unknown(reader, model%element_sets, reference%position, &
        reference%name)
      if (found > 0) then
        if (model%element_sets%list(found)%flawed) flawed = .true.
        if (allocated(model%element_sets%list(found)%members)) then
          elements = model%element_sets%list(found)%members
        end if
      end if
    end if
    if (.not. allocated(elements)) allocate (elements(0))
  end subroutine referenced_elements

  !> What is said of nodes one by one, said of new ones behind them.
  subroutine extend_marks(model, more, of_elements)
    type(model_t), intent(inout) :: model
    integer, intent(in) :: more
    logical, intent(in) :: of_elements !! whether elements have them

    model%used = [model%used, spread(of_elements, 1, more)]
    model%reference = [model%reference, spread(.false., 1, more)]
    model%rigid = [model%rigid, spread(.false., 1, more)]
    model%joined = [model%joined, spread(.false., 1, more)]
    model%turned = [model%turned, spread(0, 1, more)]
    model%rotation_node = [model%rotation_node, spread(0, 1, more)]
    model%rotation_arm = [model%rotation_arm, spread(1.0_wp, 1, more)]
  end subroutine extend_marks

  !> Nodes, behind them those that cuts of bolts put in their places.
  pure function with_twins(model, nodes) result(all_nodes)
    type(model_t), intent(in) :: model
    integer, intent(in) :: nodes(:)
    integer, allocatable :: all_nodes(:)
    logical :: named(model%mesh%n_nodes)

    all_nodes = nodes
    if (.not. allocated(model%twins)) return
    named = .false.
    named(nodes) = .true.
    all_nodes = [nodes, pack(model%twins(1, :), named(model%twins(2, :)))]
  end function with_twins

  !> The set `name`: its index, 0 when there is none.
  pure integer function find_set(sets, name) result(found)
    type(set_list_t), intent(in) :: sets
    character(*), intent(in) :: name !! upper case

    found = find_name(sets%lookup, sets%names, name)
  end function find_set

  !> The element set that ELSET= of a card names; 0: a mistake was reported.
  subroutine find_elset(reader, card, sets, name, set)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(set_list_t), intent(in) :: sets
    character(:), allocatable, intent(out) :: name
    integer, intent(out) :: set
    logical :: ok

    set = 0
    call name_option(reader, card, 'ELSET', .true., name, ok)
    if (.not. ok) return
    set = find_set(sets, name)
    if (set == 0) call report_unknown(reader, sets, option_position(card, 'ELSET'), name)
  end subroutine find_elset

  !> Report that there is no set `name`, with the nearest name there is.
  subroutine report_unknown(reader, sets, position, name)
    type(reader_t), intent(inout) :: reader
    type(set_list_t), intent(in) :: sets
    integer, intent(in) :: position
    character(*), intent(in) :: name

    if (sets%kind == set_of_nodes) then
      call report(reader, position, 'node set '//quoted(name)//' is not defined', &
        guess(name, sets%names(:sets%n)))
    else
      call report(reader, position, 'element set '//quoted(name)//' is not defined', &
        guess(name, sets%names(:sets%n)))
    end if
  end subroutine report_unknown

  !> Bring the members into ascending order, each once.
  subroutine finish(set)
    type(set_t), intent(inout) :: set

    if (.not. allocated(set%members)) allocate (set%members(0))
    if (size(set%members) /= set%n) set%members = set%members(:set%n)
    call sort_unique(set%members)
    set%n = size(set%members)
  end subroutine finish

end module sets_mod
