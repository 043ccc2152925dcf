!> The members of a set as far as the cards above one define it: *NGEN and its kin need them before
!> all sets are read.
module sets_above_mod
  use cards_mod, only: keep_reading, reader_t, report
  use diagnostics_mod, only: quoted
  use fields_mod, only: any_number, fields_t, integer_field, is_empty_field, next_data_line, &
    reference_field, reference_t
  use growing_lists_mod, only: append
  use kinds_mod, only: i8
  use lookup_mod, only: find_id, id_lookup_t
  use mesh_draft_mod, only: max_nodes, mesh_draft_t, set_of_elements, set_of_nodes
  use options_mod, only: card_t, flag_option, name_option, open_card
  use sorting_mod, only: sort_unique
  use text_mod, only: to_text
  implicit none
  private

  public :: above_t, max_work, members_above, read_step

  !> Ids looked at by all cards together: more than any real deck needs.
  integer(i8), parameter :: max_work = 1000000000_i8
  integer, parameter :: max_depth = 16 !! sets of sets

  !> The cards above the one that is read, and what they have defined.
  type :: above_t
    integer :: last = 0                 !! card that is above
    integer :: kind = set_of_nodes      !! what the sets have, set_of_elements else
    type(id_lookup_t) :: lookup         !! of nodes or elements
    integer(i8) :: work = 0             !! ids looked at so far
  end type above_t

contains

  !> A whole number from 1; 1 where it is left out.
  subroutine read_step(reader, fields, i, what, step, ok)
    type(reader_t), intent(inout) :: reader
    type(fields_t), intent(in) :: fields
    integer, intent(in) :: i
    character(*), intent(in) :: what
    integer, intent(out) :: step
    logical, intent(out) :: ok

    step = 1
    ok = .true.
    if (.not. is_empty_field(fields, i)) call integer_field(reader, fields, i, what, 1, step, ok)
  end subroutine read_step

  !> The numbers of the members of a set, as far as the cards above make it, by ascending id.
  subroutine members_above(reader, draft, reference, above, members, ok)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(in) :: draft
    type(reference_t), intent(in) :: reference
    type(above_t), intent(inout) :: above
    integer, allocatable, intent(out) :: members(:)
    logical, intent(out) :: ok
    integer, allocatable :: ids(:)
    integer :: n, i

    n = 0
    allocate (ids(0))
    if (reference%id > 0) then
      ids = [reference%id]
      n = 1
    else
      call add_members(reader, draft, reference%name, 1, above, ids, n)
    end if
    ids = ids(:n)
    call sort_unique(ids)
    allocate (members(size(ids)))
    do i = 1, size(ids)
      if (above%kind == set_of_nodes) then
        members(i) = find_id(above%lookup, draft%node_id, ids(i))
      else
        members(i) = find_id(above%lookup, draft%element_id, ids(i))
      end if
    end do
    ok = size(members) > 0 .and. all(members > 0)
    if (ok) return
    if (size(members) == 0) then
      call report(reader, reference%position, 'set '//quoted(reference%name)// &
        ' has no members above')
    else
      call report(reader, reference%position, trim(merge('node   ', 'element', above%kind == &
        set_of_nodes))//' '//to_text(ids(findloc(members, 0, dim=1)))//' is not defined above')
    end if
  end subroutine members_above

  !> Add the ids of a set's members to a list.
  recursive subroutine add_members(reader, draft, name, depth, above, ids, n)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(in) :: draft
    character(*), intent(in) :: name
    integer, intent(in) :: depth
    type(above_t), intent(inout) :: above
    integer, allocatable, intent(inout) :: ids(:)
    integer, intent(inout) :: n
    type(card_t) :: card
    type(fields_t) :: fields
    type(reference_t) :: reference
    character(:), allocatable :: keyword, its_name
    integer :: i, j, first, last, step
    logical :: found, ok, generated, read_well(3)

    if (depth > max_depth .or. above%work > max_work) return
    do i = 1, draft%n_sets
      associate (set => draft%sets(i))
        if (set%kind /= above%kind .or. set%block > 0 .or. set%name /= name) cycle
        if (above%kind == set_of_nodes) call append(ids, n, draft%node_id(set%first:set%last))
        if (above%kind == set_of_elements) call append(ids, n, draft%element_id(set%first:set%last))
      end associate
    end do
    above%work = above%work + draft%n_sets + n
    keyword = merge('NSET ', 'ELSET', above%kind == set_of_nodes)
    do i = 1, above%last
      if (reader%cards(i)%keyword /= keyword) cycle
      call open_card(reader, i, card)
      call name_option(reader, card, trim(keyword), .false., its_name, ok)
      if (.not. ok) cycle
      if (its_name /= name) cycle
      generated = .false.
      call flag_option(reader, card, 'GENERATE', generated)
      fields = fields_t()
      do
        call next_data_line(reader, card, fields, found, any_number, '')
        if (.not. found .or. above%work > max_work .or. .not. keep_reading(reader)) exit
        above%work = above%work + fields%n
        if (generated) then
          call integer_field(reader, fields, 1, 'the first id', 1, first, read_well(1))
          call integer_field(reader, fields, 2, 'the last id', 1, last, read_well(2))
          call read_step(reader, fields, 3, 'a step', step, read_well(3))
          if (.not. all(read_well)) cycle
          if ((last - int(first, i8))/step > max_nodes) cycle
          above%work = above%work + (last - int(first, i8))/step
          call append(ids, n, [(j, j=first, last, step)])
          cycle
        end if
        call add_line(fields)
      end do
    end do

  contains

    !> The ids and sets of a line.
    recursive subroutine add_line(fields)
      type(fields_t), intent(in) :: fields
      integer :: j

      do j = 1, fields%n
        if (is_empty_field(fields, j)) cycle
        call reference_field(reader, fields, j, 'an id or a set', reference, ok)
        if (.not. ok) cycle
        if (reference%id > 0) then
          call append(ids, n, reference%id)
        else
          call add_members(reader, draft, reference%name, depth + 1, above, ids, n)
        end if
      end do
    end subroutine add_line
  end subroutine add_members

end module sets_above_mod
