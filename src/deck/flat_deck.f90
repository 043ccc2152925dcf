!> A deck as one flat text: included files in their place, parameters replaced by their values, and
!> blocks by their nodes, elements, sets and surfaces. Everything else stands as it was written.
!>
!>     *PARAMETER
!>     n = 2
!>     *BLOCK, NAME=A, NX=<n>, ...       *NODE, NSET=A, then *ELEMENT, *NSET and *SURFACE
!>     *CLOAD                            *CLOAD
!>     A, 3, <-10/n>                     A, 3, -5
!>
!> Read again it is the same scene. Programs that know the dialect, but neither parameters nor
!> blocks, find ids and numbers in it. Files of STL obstacles stay files of their own.
module flat_deck_mod
  use block_mesh_mod, only: block_face, block_side_nodes, face_xmin, face_zmax
  use cards_mod, only: is_data_line, reader_t
  use connectivity_mod, only: nodes_of_element
  use deck_source_mod, only: add_line, source_t
  use diagnostics_mod, only: any_mistakes
  use element_types_mod, only: name_of_type
  use deck_table_mod, only: same_word
  use mesh_draft_mod, only: block_t, mesh_draft_t
  use numbers_mod, only: number_text
  use options_mod, only: as_name, card_t, name_option, open_card
  use read_block_mod, only: side_name
  use substitution_mod, only: substitute
  use text_mod, only: string_t, to_text
  implicit none
  private

  public :: flat_deck

  integer, parameter :: ids_a_line = 8

contains

  !> The flat text of a deck whose nodes and elements have been read, and nothing more.
  subroutine flat_deck(reader, draft, text)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(in) :: draft          !! its elements name nodes by their ids
    type(string_t), intent(out) :: text              !! lines; empty where the deck has mistakes
    type(source_t) :: flat
    integer :: k, line

    text%text = ''
    if (any_mistakes(reader%diagnostics)) return
    line = 1
    do k = 1, reader%n_cards
      associate (card => reader%cards(k))
        select case (card%keyword)
        case ('PARAMETER', 'BLOCK')
          call add_lines(reader, line, card%header - 1, flat)
          if (card%keyword == 'BLOCK') call add_block(reader, k, draft, flat)
          line = card%last + 1
        case ('HEADING') ! its lines are text, whatever is in them
          call add_lines(reader, line, card%header, flat)
          call copy_lines(reader%source, card%header + 1, card%last, flat)
          line = card%last + 1
        case default
          cycle
        end select
      end associate
    end do
    call add_lines(reader, line, reader%source%n_lines, flat)
    text%text = flat%text(:flat%length)
  end subroutine flat_deck

  !> Add lines as they are, without comments.
  subroutine copy_lines(source, first, last, flat)
    type(source_t), intent(in) :: source
    integer, intent(in) :: first, last
    type(source_t), intent(inout) :: flat
    integer :: line

    do line = first, last
      if (.not. is_data_line(source, line)) cycle
      call put(flat, source%text(source%first(line):source%first(line + 1) - 2))
    end do
  end subroutine copy_lines

  !> Add lines with the values of their parameters; comments and blank lines are left out.
  subroutine add_lines(reader, first, last, flat)
    type(reader_t), intent(inout) :: reader
    integer, intent(in) :: first, last
    type(source_t), intent(inout) :: flat
    character(:), allocatable :: replaced, problem
    integer :: line, start, end_, at

    do line = first, last
      start = reader%source%first(line)
      end_ = reader%source%first(line + 1) - 2
      associate (written => reader%source%text(start:end_))
        if (.not. (is_data_line(reader%source, line) .or. is_keyword(written))) cycle
        if (index(written, '<') > 0) then
          call substitute(written, start, reader%parameters, replaced, problem, at)
          ! What cannot be replaced stands below a keyword that is ignored.
          if (.not. allocated(problem)) then
            call put(flat, replaced)
            cycle
          end if
        end if
        call put(flat, written)
      end associate
    end do
  end subroutine add_lines

  !> Whether a line begins with a star, and with one only.
  pure logical function is_keyword(line)
    character(*), intent(in) :: line
    character(:), allocatable :: words

    words = adjustl(line)//'  '
    is_keyword = words(1:1) == '*' .and. words(2:2) /= '*'
  end function is_keyword

  !> Add what card `k`, a *BLOCK, stands for.
  subroutine add_block(reader, k, draft, flat)
    type(reader_t), intent(inout) :: reader
    integer, intent(in) :: k
    type(mesh_draft_t), intent(in) :: draft
    type(source_t), intent(inout) :: flat
    type(card_t) :: card
    character(:), allocatable :: others
    integer :: b, side
    logical :: ok

    call open_card(reader, k, card)
    do b = 1, draft%n_blocks
      if (draft%blocks(b)%position == card%position) exit
    end do
    associate (block => draft%blocks(b))
      call add_nodes(draft, block, flat)
      call add_elements(draft, block, flat)
      call name_option(reader, card, 'ELSET', .false., others, ok)
      if (ok .and. .not. same_word(others, block%name)) then
        call put(flat, '*ELSET, ELSET='//as_name(others))
        call put(flat, as_name(block%name))
      end if
      do side = face_xmin, face_zmax
        call put(flat, '*NSET, NSET='//as_name(side_name(block%name, side)))
        call add_ids(draft%node_id(block%first_node - 1 + block_side_nodes(block%n, side)), flat)
      end do
      do side = face_xmin, face_zmax
        call add_side(draft, block, side, flat)
      end do
    end associate
  end subroutine add_block

  !> The nodes of a block and the set of them.
  subroutine add_nodes(draft, block, flat)
    type(mesh_draft_t), intent(in) :: draft
    type(block_t), intent(in) :: block
    type(source_t), intent(inout) :: flat
    integer :: node

    call put(flat, '*NODE, NSET='//as_name(block%name))
    do node = block%first_node, block%first_node + product(block%n + 1) - 1
      call put(flat, to_text(draft%node_id(node))//', '//number_text(draft%coordinates(1, node))// &
        ', '//number_text(draft%coordinates(2, node))//', '// &
        number_text(draft%coordinates(3, node)))
    end do
  end subroutine add_nodes

  !> The elements of a block and the set of them.
  subroutine add_elements(draft, block, flat)
    type(mesh_draft_t), intent(in) :: draft
    type(block_t), intent(in) :: block
    type(source_t), intent(inout) :: flat
    character(:), allocatable :: type_name
    integer :: element

    type_name = name_of_type(draft%element_kind(block%first_element), &
      draft%connectivity%cell(block%first_element))
    call put(flat, '*ELEMENT, TYPE='//type_name//', ELSET='//as_name(block%name))
    do element = block%first_element, block%first_element + product(block%n) - 1
      call add_ids([draft%element_id(element), nodes_of_element(draft%connectivity, element)], &
        flat, a_line=9)
    end do
  end subroutine add_elements

  !> The surface of one side of a block.
  subroutine add_side(draft, block, side, flat)
    type(mesh_draft_t), intent(in) :: draft
    type(block_t), intent(in) :: block
    integer, intent(in) :: side
    type(source_t), intent(inout) :: flat
    integer, allocatable :: faces(:, :)
    integer :: i

    call put(flat, '*SURFACE, NAME='//as_name(side_name(block%name, side)))
    allocate (faces, source=block_face(block%n, side))
    do i = 1, size(faces, 2)
      call put(flat, to_text(draft%element_id(block%first_element - 1 + faces(1, i)))//', S'// &
        to_text(faces(2, i)))
    end do
  end subroutine add_side

  !> Add ids, several a line.
  subroutine add_ids(ids, flat, a_line)
    integer, intent(in) :: ids(:)
    type(source_t), intent(inout) :: flat
    integer, intent(in), optional :: a_line
    character(:), allocatable :: line
    integer :: i, most

    most = ids_a_line
    if (present(a_line)) most = a_line
    line = ''
    do i = 1, size(ids)
      line = line//to_text(ids(i))
      if (i == size(ids) .or. modulo(i, most) == 0) then
        call put(flat, line)
        line = ''
      else
        line = line//', '
      end if
    end do
  end subroutine add_ids

  subroutine put(flat, line)
    type(source_t), intent(inout) :: flat
    character(*), intent(in) :: line

    call add_line(flat, line, 0, 0)
  end subroutine put

end module flat_deck_mod
