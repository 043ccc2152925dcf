!> Boxes of elements.
!>
!>     *BLOCK, NAME=BODY, NX=4, NY=4, NZ=4, TYPE=C3D8, ELSET=STEEL
!>     0., 0., 0.,  1., 1., 1.        corner and size
!>     Z, 3.                          along z the last element is 3 times the first
!>     X, 4., MIDDLE                  along x the outermost elements are 4 times those in the middle
!>
!> Makes the sets of nodes and elements BODY, and for each side, BODY-XMIN to BODY-ZMAX, the set of
!> its nodes and the surface of its faces.
module read_block_mod
  use block_mesh_mod, only: block_connectivity, block_coordinates, face_xmin, face_zmax, &
    graded_from_middle, graded_positions
  use cells_mod, only: hexahedron_8
  use cards_mod, only: reader_t, report
  use connectivity_mod, only: add_elements
  use diagnostics_mod, only: quoted
  use fields_mod, only: field_position, field_text, fields_t, is_empty_field, name_field, &
    next_data_line, real_field
  use deck_table_mod, only: same_word
  use kinds_mod, only: i8, wp
  use mesh_draft_mod, only: add_block, add_early_set, block_t, early_set_t, max_nodes, &
    mesh_draft_t, reserve_elements, reserve_nodes, set_of_elements, set_of_nodes
  use mesh_size_mod, only: common_divisor
  use options_mod, only: allow_options, card_t, has_option, integer_option, max_name, name_option, &
    option_position
  use read_mesh_mod, only: check_element_type
  use text_mod, only: to_text
  implicit none
  private

  public :: read_block, side_name

  real(wp), parameter :: largest_ratio = 1.0e6_wp !! of the sizes of two elements of a row

  !> What the data lines say.
  type :: box_t
    real(wp) :: corner(3) = 0.0_wp       !! smallest x, y, z [length]
    real(wp) :: length(3) = 1.0_wp       !! edges [length]
    real(wp) :: ratio(3) = 1.0_wp        !! along each axis: last element's size over the first's,
    logical  :: middle(3) = .false.      !! or the outermost over those in the middle
  end type box_t

contains

  !> *BLOCK, NAME=name, NX=n, NY=n, NZ=n[, TYPE=type][, ELSET=name]
  subroutine read_block(reader, card, draft)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(mesh_draft_t), intent(inout) :: draft
    type(block_t) :: block
    type(box_t) :: box
    integer :: axis, kind, cell
    logical :: ok, data_ok

    call allow_options(reader, card)
    call check_element_type(reader, card, .false., kind, cell)
    if (cell /= hexahedron_8) call report(reader, option_position(card, 'TYPE'), &
      'a *BLOCK consists of hexahedra: TYPE=C3D8, C3D8I or C3D8B')
    call name_option(reader, card, 'NAME', .true., block%name, ok)
    block%position = card%position
    if (ok .and. len(block%name) > max_name - 5) then
      ok = .false.
      call report(reader, option_position(card, 'NAME'), 'the name of a block has at most '// &
        to_text(max_name - 5)//' letters')
    end if
    do axis = 1, 3
      call read_count(reader, card, 'N'//'XYZ'(axis:axis), block%n(axis), data_ok)
      ok = ok .and. data_ok
    end do
    call read_box(reader, card, box, data_ok)
    ok = ok .and. data_ok
    if (ok) call scale_counts(draft, block%n)
    if (ok) then
      if (product(real(block%n, wp) + 1.0_wp) + draft%n_nodes > max_nodes) then
        ok = .false.
        call report(reader, card%position, 'with this block the mesh has more than '// &
          to_text(max_nodes)//' nodes')
      end if
    end if
    ! Its sets exist even where it could not be made, so that their uses are not mistakes as well.
    block%first_node = draft%n_nodes + 1
    block%first_element = draft%n_elements + 1
    if (ok) call make_elements(reader, card, block, box, draft, ok)
    if (ok) draft%element_kind(block%first_element:draft%n_elements) = kind
    call make_sets(reader, card, block, ok, draft)
  end subroutine read_block

  !> The counts of a block as the mesh is to have them.
  pure subroutine scale_counts(draft, n)
    type(mesh_draft_t), intent(inout) :: draft
    integer, intent(inout) :: n(3)

    draft%counts%common = common_divisor(draft%counts%common, n)
    draft%counts%longest = max(draft%counts%longest, n)
    associate (times => draft%scale(1), over => draft%scale(2), cut => [1, 2, 3] /= draft%across)
      if (all(mod(n, over) == 0 .or. .not. cut) .and. all(n/over <= max_nodes/times)) then
        n = merge(n/over*times, n, cut)
      end if
    end associate
  end subroutine scale_counts

  !> NX=, NY= or NZ=.
  subroutine read_count(reader, card, name, n, ok)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    character(*), intent(in) :: name
    integer, intent(inout) :: n
    logical, intent(out) :: ok

    if (has_option(card, name)) then
      call integer_option(reader, card, name, 1, max_nodes, n, ok)
    else
      call report(reader, card%position, '*BLOCK needs '//name//'=')
      ok = .false.
    end if
  end subroutine read_count

  !> The data lines: x, y, z of the corner, then of the size; axis, ratio[, MIDDLE].
  subroutine read_box(reader, card, box, ok)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(box_t), intent(out) :: box
    logical, intent(out) :: ok
    type(fields_t) :: fields
    real(wp) :: value(6)
    integer :: i
    logical :: found, field_ok, given(3)

    given = .false.
    value = 1.0_wp
    call next_data_line(reader, card, fields, ok, 6, 'a corner and a size: six numbers')
    if (.not. ok) then
      call report(reader, card%position, &
        '*BLOCK needs a data line: x, y, z of its corner, then its size along x, y, z')
    else
      do i = 1, 6
        call real_field(reader, fields, i, 'x, y, z of the corner, then the size', value(i), &
          field_ok)
        ok = ok .and. field_ok
        if (i <= 3 .or. .not. field_ok .or. value(i) > 0.0_wp) cycle
        call report(reader, field_position(reader, fields, i), 'the size must be positive, not '// &
          quoted(field_text(reader, fields, i)))
        ok = .false.
      end do
    end if
    box%corner = value(:3)
    box%length = value(4:)
    do
      call next_data_line(reader, card, fields, found, 3, 'X, Y or Z, a ratio and MIDDLE')
      if (.not. found) exit
      call read_grading(reader, fields, box, given, field_ok)
      ok = ok .and. field_ok
    end do
  end subroutine read_box

  !> A line `axis, ratio[, MIDDLE]`.
  subroutine read_grading(reader, fields, box, given, ok)
    type(reader_t), intent(inout) :: reader
    type(fields_t), intent(in) :: fields
    type(box_t), intent(inout) :: box
    logical, intent(inout) :: given(3) !! axes that had a line before
    logical, intent(out) :: ok
    character(:), allocatable :: name
    integer :: axis
    real(wp) :: ratio

    call name_field(reader, fields, 1, 'X, Y or Z', name, ok)
    if (.not. ok) return
    axis = 0
    if (len(name) == 1) axis = index('XYZ', name)
    if (axis == 0) then
      ok = .false.
      call report(reader, fields%start, 'expected X, Y or Z, found '//quoted(name))
      return
    end if
    if (given(axis)) call report(reader, fields%start, 'a second ratio for '//name)
    given(axis) = .true.
    ratio = 1.0_wp
    call real_field(reader, fields, 2, 'the ratio of two sizes', ratio, ok)
    if (ok .and. (ratio < 1.0_wp/largest_ratio .or. ratio > largest_ratio)) then
      call report(reader, field_position(reader, fields, 2), &
        'a ratio must lie between 1e-6 and 1e6, not '//quoted(field_text(reader, fields, 2)))
      ok = .false.
    end if
    box%ratio(axis) = ratio
    if (is_empty_field(fields, 3)) return
    box%middle(axis) = same_word(field_text(reader, fields, 3), 'MIDDLE')
    if (box%middle(axis)) return
    call report(reader, field_position(reader, fields, 3), &
      'expected MIDDLE or nothing, found '//quoted(field_text(reader, fields, 3)))
    ok = .false.
  end subroutine read_grading

  !> Positions 0..1 of the planes between the elements along one axis.
  pure function positions(box, axis, n) result(position)
    type(box_t), intent(in) :: box
    integer, intent(in) :: axis
    integer, intent(in) :: n        !! elements
    real(wp) :: position(0:n)

    position = graded_positions(n, box%ratio(axis))
    if (box%middle(axis)) position = graded_from_middle(n, box%ratio(axis))
  end function positions

  !> Add the nodes and elements of the box, with ids that follow the highest so far.
  subroutine make_elements(reader, card, block, box, draft, ok)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(block_t), intent(in) :: block
    type(box_t), intent(in) :: box
    type(mesh_draft_t), intent(inout) :: draft
    logical, intent(out) :: ok
    integer :: n_nodes, n_elements, i, k
    logical :: room

    n_nodes = product(block%n + 1)
    n_elements = product(block%n)
    ok = int(draft%highest_node, i8) + n_nodes <= huge(n_nodes) .and. &
      int(draft%highest_element, i8) + n_elements <= huge(n_nodes)
    if (.not. ok) then
      call report(reader, card%position, 'the ids of this block, which follow the highest '// &
        'before it, would exceed '//to_text(huge(n_nodes)))
      return
    end if
    call reserve_nodes(draft, n_nodes, ok)
    call reserve_elements(draft, n_elements, room)
    ok = ok .and. room
    if (.not. ok) then
      call report(reader, card%position, 'not enough memory for the nodes of this block')
      return
    end if
    k = draft%n_nodes
    draft%coordinates(:, k + 1:k + n_nodes) = block_coordinates(box%corner, box%length, &
      positions(box, 1, block%n(1)), positions(box, 2, block%n(2)), positions(box, 3, block%n(3)))
    do i = 1, n_nodes
      draft%node_id(k + i) = draft%highest_node + i
      draft%node_position(k + i) = card%position
    end do
    k = draft%n_elements
    call add_elements(draft%connectivity, k, hexahedron_8, block_connectivity(block%n) + &
      draft%highest_node)
    do i = 1, n_elements
      draft%element_id(k + i) = draft%highest_element + i
      draft%element_position(k + i) = card%position
    end do
    draft%n_nodes = draft%n_nodes + n_nodes
    draft%n_elements = draft%n_elements + n_elements
    draft%highest_node = draft%highest_node + n_nodes
    draft%highest_element = draft%highest_element + n_elements
  end subroutine make_elements

  !> Register the block and its sets; `made` is false when it has no elements.
  subroutine make_sets(reader, card, block, made, draft)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(block_t), intent(in) :: block
    logical, intent(in) :: made
    type(mesh_draft_t), intent(inout) :: draft
    type(early_set_t) :: set
    character(:), allocatable :: other
    integer :: side
    logical :: ok

    set%position = card%position
    set%flawed = .not. made
    set%kind = set_of_elements
    set%first = block%first_element
    set%last = draft%n_elements
    call name_option(reader, card, 'ELSET', .false., other, ok)
    if (ok) then
      set%name = other
      call add_early_set(draft, set)
    end if
    if (len(block%name) == 0) return
    if (ok) ok = other == block%name
    if (.not. ok) then
      set%name = block%name
      call add_early_set(draft, set)
    end if
    set%kind = set_of_nodes
    set%name = block%name
    set%first = block%first_node
    set%last = draft%n_nodes
    call add_early_set(draft, set)
    call add_block(draft, block)
    if (.not. made) draft%blocks(draft%n_blocks)%n = 0
    set%block = draft%n_blocks
    do side = face_xmin, face_zmax
      set%name = side_name(block%name, side)
      set%side = side
      call add_early_set(draft, set)
    end do
  end subroutine make_sets

  !> The name of one side of a block: NAME-XMIN .. NAME-ZMAX.
  pure function side_name(block, side) result(name)
    character(*), intent(in) :: block
    integer, intent(in) :: side !! face_xmin .. face_zmax
    character(:), allocatable :: name
    character(5), parameter :: endings(face_xmin:face_zmax) = &
      ['-XMIN', '-XMAX', '-YMIN', '-YMAX', '-ZMIN', '-ZMAX']

    name = block//endings(side)
  end function side_name

end module read_block_mod
