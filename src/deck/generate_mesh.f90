!> Nodes and elements that cards make from others.
!>
!>     *NGEN, NSET=EDGE                  nodes 1, 2, ... 11 on the line from node 1 to node 11
!>     1, 11, 1
!>     *NFILL, NSET=PLATE                between the nodes of two sets, 10 intervals, ids by 11
!>     EDGE, TOP, 10, 11
!>     *NCOPY, CHANGE NUMBER=200, OLD SET=PLATE, NEW SET=LID, SHIFT
!>     0., 0., 1.                        a translation, then a rotation
!>     *ELGEN, ELSET=PLATE               element 1 ten times, ids of nodes and elements by 1
!>     1, 10, 1, 1
!>     *ELCOPY, ELEMENT SHIFT=100, SHIFT NODES=200, OLD SET=PLATE, NEW SET=LID
!>
!> They make what is there when they are read: nodes, elements and sets that stand above them.
module generate_mesh_mod
  use cards_mod, only: reader_t, report, report_missing_element
  use cells_mod, only: cells
  use connectivity_mod, only: nodes_of_element
  use fields_mod, only: field_position, fields_t, integer_field, is_empty_field, &
    next_data_line, real_field, reference_field, reference_t
  use kinds_mod, only: i8, wp
  use lookup_mod, only: find_id, id_lookup_t, make_id_lookup
  use mesh_draft_mod, only: add_early_set, add_element, add_node, early_set_t, max_nodes, &
    mesh_draft_t, reserve_elements, reserve_nodes, set_of_elements, set_of_nodes, solids
  use numbers_mod, only: largest_number
  use options_mod, only: allow_no_data, allow_options, card_t, choice_option, flag_option, &
    has_option, integer_option, name_option, option_position
  use read_system_mod, only: read_point
  use rotations_mod, only: rotation_matrix
  use sets_above_mod, only: above_t, max_work, members_above, read_step
  use small_matrix_mod, only: cross
  use sorting_mod, only: sort_unique
  use text_mod, only: to_text
  implicit none
  private

  public :: generate_mesh

  integer, parameter :: straight = 1, parabola = 2, circle = 3 !! LINE=
  integer(i8), parameter :: looking_up = 5 !! ids looked at: what sorting one takes
  integer, parameter :: by_line = 1, by_plane = 2, by_point = 3 !! REFLECT=

  !> How nodes are moved when they are copied.
  type :: motion_t
    real(wp) :: matrix(3, 3) = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, &
      0.0_wp, 1.0_wp], [3, 3])
    real(wp) :: shift(3) = 0.0_wp !! [length]
  end type motion_t

contains

  !> Read card k, one that makes nodes or elements.
  subroutine generate_mesh(reader, k, card, draft, work)
    type(reader_t), intent(inout) :: reader
    integer, intent(in) :: k            !! its number
    type(card_t), intent(in) :: card
    type(mesh_draft_t), intent(inout) :: draft
    integer(i8), intent(inout) :: work  !! ids looked at so far
    type(above_t) :: above
    logical :: ok

    call allow_options(reader, card)
    if (work > max_work) then
      call report(reader, card%position, 'the deck makes too many nodes and elements from others')
      return
    end if
    ! Where there are none, their lists exist all the same.
    call reserve_nodes(draft, 1, ok)
    call reserve_elements(draft, 1, ok)
    above%last = k - 1
    above%work = work + looking_up*(int(draft%n_nodes, i8) + draft%n_elements)
    if (card%keyword(1:1) == 'N') then
      call make_id_lookup(draft%node_id(:draft%n_nodes), above%lookup)
    else
      above%kind = set_of_elements
      call make_id_lookup(draft%element_id(:draft%n_elements), above%lookup)
    end if
    select case (card%keyword)
    case ('NGEN')
      call read_ngen(reader, card, above%lookup, draft)
    case ('NFILL')
      call read_nfill(reader, card, above, draft)
    case ('NCOPY')
      call read_ncopy(reader, card, above, draft)
    case ('ELGEN')
      call read_elgen(reader, card, above%lookup, draft)
    case default
      call read_elcopy(reader, card, above, draft)
    end select
    work = above%work
  end subroutine generate_mesh

  !> A node that is defined above.
  subroutine read_node(reader, fields, i, lookup, draft, node, ok)
    type(reader_t), intent(inout) :: reader
    type(fields_t), intent(in) :: fields
    integer, intent(in) :: i
    type(id_lookup_t), intent(in) :: lookup
    type(mesh_draft_t), intent(in) :: draft
    integer, intent(out) :: node !! its number
    logical, intent(out) :: ok
    integer :: id

    node = 0
    call integer_field(reader, fields, i, 'the id of a node', 1, id, ok)
    if (.not. ok) return
    node = find_id(lookup, draft%node_id, id)
    ok = node > 0
    if (.not. ok) call report(reader, field_position(reader, fields, i), 'node '//to_text(id)// &
      ' is not defined above')
  end subroutine read_node

  !> *NGEN[, NSET=name][, LINE=P|C]: first node, last node, step, third node or its coordinates
  subroutine read_ngen(reader, card, lookup, draft)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(id_lookup_t), intent(in) :: lookup
    type(mesh_draft_t), intent(inout) :: draft
    type(fields_t) :: fields
    real(wp) :: x(3, 3), normal(3), part
    integer :: line, ends(2), step, third, i, n, first
    logical :: found, ok(4)

    line = straight
    call choice_option(reader, card, 'LINE', line, ok(1))
    if (has_option(card, 'LINE')) then
      if (.not. ok(1)) return
      line = line + 1
    end if
    do
      call next_data_line(reader, card, fields, found, merge(3, 10, line == straight), 'two '// &
        'nodes, a step of ids; with LINE= a third node or its coordinates, a normal')
      if (.not. found) return
      call read_node(reader, fields, 1, lookup, draft, ends(1), ok(1))
      call read_node(reader, fields, 2, lookup, draft, ends(2), ok(2))
      call read_step(reader, fields, 3, 'the step of ids', step, ok(3))
      if (.not. all(ok(:3))) cycle
      x(:, 1:2) = draft%coordinates(:, ends)
      x(:, 3) = 0.0_wp
      normal = 0.0_wp
      if (line /= straight) then
        if (is_empty_field(fields, 4)) then
          call read_point(reader, fields, 5, x(:, 3), ok(4))
        else
          call read_node(reader, fields, 4, lookup, draft, third, ok(4))
          if (ok(4)) x(:, 3) = draft%coordinates(:, third)
        end if
        if (ok(4)) call read_point(reader, fields, 8, normal, ok(4))
        if (.not. ok(4)) cycle
      end if
      associate (id => draft%node_id(ends))
        n = abs(id(2) - id(1))/step ! both are above 0
        if (mod(abs(id(2) - id(1)), step) /= 0) then
          call report(reader, field_position(reader, fields, 3), 'steps of '//to_text(step)// &
            ' from '//to_text(id(1))//' do not lead to '//to_text(id(2)))
          cycle
        end if
        step = sign(step, id(2) - id(1))
      end associate
      first = draft%n_nodes + 1
      do i = 1, n - 1
        part = real(i, wp)/real(n, wp)
        call put_node(reader, draft, draft%node_id(ends(1)) + i*int(step, i8), on_line(line, x, &
          normal, part), fields%start, ok(1))
        if (.not. ok(1)) return
      end do
      call add_to_set(reader, card, 'NSET', draft, [ends, [(i, i=first, draft%n_nodes)]])
    end do
  end subroutine read_ngen

  !> A point of a line between two, by a part of its parameter or its angle.
  pure function on_line(line, x, normal, part) result(point)
    integer, intent(in) :: line
    real(wp), intent(in) :: x(3, 3)   !! both ends; the middle of a parabola, the centre of a circle
    real(wp), intent(in) :: normal(3) !! about which a circle is gone along, 0: the shorter way
    real(wp), intent(in) :: part
    real(wp) :: point(3), axis(3), arm(3, 2), angle

    select case (line)
    case (parabola)
      point = (1.0_wp - part)*(1.0_wp - 2.0_wp*part)*x(:, 1) + part*(2.0_wp*part - 1.0_wp)*x(:, 2) &
        + 4.0_wp*part*(1.0_wp - part)*x(:, 3)
    case (circle)
      arm = x(:, 1:2) - spread(x(:, 3), 2, 2)
      axis = cross(arm(:, 1), arm(:, 2))
      angle = atan2(norm2(axis), dot_product(arm(:, 1), arm(:, 2)))
      if (norm2(normal) > 0.0_wp) then
        if (dot_product(axis, normal) < 0.0_wp) angle = 2.0_wp*acos(-1.0_wp) - angle
        axis = normal
      end if
      point = matmul(rotation_matrix(part*angle*axis/max(norm2(axis), tiny(1.0_wp))), arm(:, 1))
      point = x(:, 3) + point*(1.0_wp + part*(norm2(arm(:, 2))/max(norm2(arm(:, 1)), &
        tiny(1.0_wp)) - 1.0_wp))
    case default
      point = (1.0_wp - part)*x(:, 1) + part*x(:, 2)
    end select
  end function on_line

  !> *NFILL[, NSET=name]: set, set, intervals, step of ids
  subroutine read_nfill(reader, card, above, draft)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(above_t), intent(inout) :: above
    type(mesh_draft_t), intent(inout) :: draft
    type(fields_t) :: fields
    type(reference_t) :: reference
    integer, allocatable :: from(:), to(:)
    real(wp) :: part
    integer :: intervals, step, i, j, first
    logical :: found, ok(2)

    do
      call next_data_line(reader, card, fields, found, 4, 'two sets of nodes, the number of '// &
        'intervals, a step of ids')
      if (.not. found) return
      call reference_field(reader, fields, 1, 'a set of nodes', reference, ok(1))
      if (ok(1)) call members_above(reader, draft, reference, above, from, ok(1))
      call reference_field(reader, fields, 2, 'a set of nodes', reference, ok(2))
      if (ok(2)) call members_above(reader, draft, reference, above, to, ok(2))
      if (.not. all(ok)) cycle
      call read_step(reader, fields, 3, 'the number of intervals', intervals, ok(1))
      call read_step(reader, fields, 4, 'the step of ids', step, ok(2))
      if (.not. all(ok)) cycle
      if (size(from) /= size(to)) then
        call report(reader, fields%start, 'the sets of *NFILL have as many nodes, here '// &
          to_text(size(from))//' and '//to_text(size(to)))
        cycle
      end if
      first = draft%n_nodes + 1
      do j = 1, size(from)
        do i = 1, intervals - 1
          part = real(i, wp)/real(intervals, wp)
          call put_node(reader, draft, draft%node_id(from(j)) + i*int(step, i8), (1.0_wp - part)* &
            draft%coordinates(:, from(j)) + part*draft%coordinates(:, to(j)), fields%start, ok(1))
          if (.not. ok(1)) return
        end do
      end do
      call add_to_set(reader, card, 'NSET', draft, [from, to, [(i, i=first, draft%n_nodes)]])
    end do
  end subroutine read_nfill

  !> *NCOPY, CHANGE NUMBER=n, OLD SET=name, NEW SET=name, SHIFT or REFLECT=LINE|MIRROR|POINT
  subroutine read_ncopy(reader, card, above, draft)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(above_t), intent(inout) :: above
    type(mesh_draft_t), intent(inout) :: draft
    type(motion_t) :: motion
    integer, allocatable :: old(:)
    real(wp) :: x(3)
    integer :: change, times, i, j, first
    logical :: ok

    call old_set(reader, card, draft, above, old, ok)
    if (.not. ok) return
    change = 0
    call integer_option(reader, card, 'CHANGE NUMBER', 1, max_nodes, change, ok)
    if (.not. ok) then
      if (.not. has_option(card, 'CHANGE NUMBER')) call report(reader, card%position, &
        '*NCOPY needs CHANGE NUMBER=, which is added to the ids')
      return
    end if
    times = 1
    call integer_option(reader, card, 'MULTIPLE', 1, max_nodes, times, ok)
    call read_motion(reader, card, motion, ok)
    if (.not. ok) return
    first = draft%n_nodes + 1
    do j = 1, size(old)
      x = draft%coordinates(:, old(j))
      do i = 1, times
        x = matmul(motion%matrix, x) + motion%shift
        call put_node(reader, draft, draft%node_id(old(j)) + i*int(change, i8), x, card%position, &
          ok)
        if (.not. ok) return
      end do
    end do
    call add_to_set(reader, card, 'NEW SET', draft, [(i, i=first, draft%n_nodes)])
  end subroutine read_ncopy

  !> The lines of *NCOPY: what a node is moved by.
  subroutine read_motion(reader, card, motion, ok)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(motion_t), intent(out) :: motion
    logical, intent(out) :: ok
    type(fields_t) :: fields
    real(wp) :: x(3, 3), degrees, unit(3)
    real(wp), parameter :: degree = acos(-1.0_wp)/180.0_wp
    integer :: kind, i
    logical :: shifts, found

    kind = 0
    shifts = .false.
    call choice_option(reader, card, 'REFLECT', kind, ok)
    call flag_option(reader, card, 'SHIFT', shifts)
    if (shifts .eqv. kind > 0) then
      if (ok .or. .not. has_option(card, 'REFLECT')) call report(reader, card%position, &
        '*NCOPY needs one of SHIFT and REFLECT=')
      ok = .false.
      return
    end if
    x = 0.0_wp
    if (shifts) then
      call next_data_line(reader, card, fields, found, 3, 'a translation')
      ok = .true.
      if (found) call read_point(reader, fields, 1, motion%shift, ok)
      if (found .and. ok) call next_data_line(reader, card, fields, found, 7, &
        'two points of an axis, an angle in degrees')
      if (.not. found .or. .not. ok) return
      if (all([(is_empty_field(fields, i), i=1, 7)])) return
      call read_point(reader, fields, 1, x(:, 1), ok)
      if (ok) call read_point(reader, fields, 4, x(:, 2), ok)
      if (ok) call real_field(reader, fields, 7, 'an angle in degrees', degrees, ok)
      if (.not. ok) return
      call take_unit(x(:, 2) - x(:, 1))
      if (.not. ok) return
      ! About its axis, behind the translation.
      motion%matrix = rotation_matrix(degrees*degree*unit)
      motion%shift = x(:, 1) + matmul(motion%matrix, motion%shift - x(:, 1))
      return
    end if
    call next_data_line(reader, card, fields, found, 6, 'points')
    ok = found
    if (.not. found) then
      call report(reader, card%position, 'REFLECT needs a line with its points')
      return
    end if
    call read_point(reader, fields, 1, x(:, 1), ok)
    if (ok) call read_point(reader, fields, 4, x(:, 2), ok)
    select case (kind)
    case (by_point)
      motion%matrix = -motion%matrix
    case (by_line)
      if (ok) call take_unit(x(:, 2) - x(:, 1))
      if (.not. ok) return
      motion%matrix = 2.0_wp*spread(unit, 2, 3)*spread(unit, 1, 3) - motion%matrix
    case (by_plane)
      call next_data_line(reader, card, fields, found, 3, 'the third point of the plane')
      if (found .and. ok) call read_point(reader, fields, 1, x(:, 3), ok)
      if (.not. found) call report(reader, card%position, 'REFLECT=MIRROR needs a second line '// &
        'with the third point of the plane')
      ok = ok .and. found
      if (ok) call take_unit(cross(x(:, 2) - x(:, 1), x(:, 3) - x(:, 1)))
      if (.not. ok) return
      motion%matrix = motion%matrix - 2.0_wp*spread(unit, 2, 3)*spread(unit, 1, 3)
    case default
      continue
    end select
    motion%shift = x(:, 1) - matmul(motion%matrix, x(:, 1))

  contains

    subroutine take_unit(vector)
      real(wp), intent(in) :: vector(3)

      ok = norm2(vector) > 0.0_wp
      unit = 0.0_wp
      if (ok) unit = vector/norm2(vector)
      if (.not. ok) call report(reader, fields%start, 'the points of *NCOPY are in one place '// &
        'or on a line')
    end subroutine take_unit
  end subroutine read_motion

  !> *ELGEN[, ELSET=name]: element; three times how many, step of nodes, step of elements
  subroutine read_elgen(reader, card, lookup, draft)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(id_lookup_t), intent(in) :: lookup
    type(mesh_draft_t), intent(inout) :: draft
    type(fields_t) :: fields
    integer :: id, master, numbers(3, 3), i, j, k, l, first
    logical :: found, ok, read_well

    do
      call next_data_line(reader, card, fields, found, 10, 'an element, and up to three times '// &
        'how many, steps of nodes and of elements')
      if (.not. found) return
      call integer_field(reader, fields, 1, 'the id of an element', 1, id, ok)
      if (.not. ok) cycle
      master = find_id(lookup, draft%element_id, id)
      if (master == 0) then
        call report_missing_element(reader, fields%start, 'element '//to_text(id)// &
          ' is not defined above')
        cycle
      end if
      do j = 1, 3
        do i = 1, 3
          call read_step(reader, fields, 1 + i + 3*(j - 1), 'a number of *ELGEN', numbers(i, j), &
            read_well)
          ok = ok .and. read_well
        end do
      end do
      if (.not. ok) cycle
      if (product(real(numbers(1, :), wp)) > max_nodes) then
        call report(reader, fields%start, 'too many elements (at most '//to_text(max_nodes)//')')
        return
      end if
      first = draft%n_elements + 1
      do l = 0, numbers(1, 3) - 1
        do k = 0, numbers(1, 2) - 1
          do j = 0, numbers(1, 1) - 1
            if (j + k + l == 0) cycle
            associate (by_node => sum(int(numbers(2, :), i8)*[j, k, l]), &
                       by_element => sum(int(numbers(3, :), i8)*[j, k, l]))
              call put_element(reader, draft, master, by_element, by_node, fields%start, ok)
            end associate
            if (.not. ok) return
          end do
        end do
      end do
      call add_to_set(reader, card, 'ELSET', draft, [master, [(i, i=first, draft%n_elements)]])
    end do
  end subroutine read_elgen

  !> *ELCOPY, ELEMENT SHIFT=n, SHIFT NODES=n, OLD SET=name, NEW SET=name[, REFLECT]
  subroutine read_elcopy(reader, card, above, draft)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(above_t), intent(inout) :: above
    type(mesh_draft_t), intent(inout) :: draft
    integer, allocatable :: old(:)
    integer :: by_element, by_node, i, first
    logical :: ok, reflects

    call allow_no_data(reader, card)
    call old_set(reader, card, draft, above, old, ok)
    if (.not. ok) return
    by_element = 0
    by_node = 0
    call integer_option(reader, card, 'ELEMENT SHIFT', 1, max_nodes, by_element, ok)
    call integer_option(reader, card, 'SHIFT NODES', 0, max_nodes, by_node, ok)
    reflects = .false.
    call flag_option(reader, card, 'REFLECT', reflects)
    if (.not. has_option(card, 'ELEMENT SHIFT')) call report(reader, card%position, &
      '*ELCOPY needs ELEMENT SHIFT=, which is added to the ids')
    if (by_element == 0) return
    first = draft%n_elements + 1
    do i = 1, size(old)
      call put_element(reader, draft, old(i), int(by_element, i8), int(by_node, i8), &
        card%position, ok, reflects)
      if (.not. ok) return
    end do
    call add_to_set(reader, card, 'NEW SET', draft, [(i, i=first, draft%n_elements)])
  end subroutine read_elcopy

  !> The members of OLD SET=.
  subroutine old_set(reader, card, draft, above, old, ok)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(mesh_draft_t), intent(in) :: draft
    type(above_t), intent(inout) :: above
    integer, allocatable, intent(out) :: old(:)
    logical, intent(out) :: ok
    type(reference_t) :: reference
    character(:), allocatable :: name

    call name_option(reader, card, 'OLD SET', .true., name, ok)
    if (.not. ok) return
    reference%name = name
    reference%id = 0
    reference%position = option_position(card, 'OLD SET')
    call members_above(reader, draft, reference, above, old, ok)
  end subroutine old_set

  !> One more node.
  subroutine put_node(reader, draft, id, x, position, ok)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(inout) :: draft
    integer(i8), intent(in) :: id
    real(wp), intent(in) :: x(3)
    integer, intent(in) :: position
    logical, intent(out) :: ok

    ok = id > 0 .and. id <= huge(1)
    if (.not. ok) call report(reader, position, 'this card makes a node with an id that is not '// &
      'between 1 and '//to_text(huge(1)))
    if (.not. ok) return
    ok = all(abs(x) <= largest_number)
    if (.not. ok) call report(reader, position, 'this card makes a node at a place that is no '// &
      'number')
    if (.not. ok) return
    call reserve_nodes(draft, 1, ok)
    if (.not. ok) call report(reader, position, 'too many nodes (at most '//to_text(max_nodes)// &
      ', memory permitting)')
    if (ok) call add_node(draft, int(id), x, position)
  end subroutine put_node

  !> A copy of an element, with other ids.
  subroutine put_element(reader, draft, master, by_element, by_node, position, ok, reflects)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(inout) :: draft
    integer, intent(in) :: master
    integer(i8), intent(in) :: by_element, by_node !! what is added to ids
    integer, intent(in) :: position
    logical, intent(out) :: ok
    logical, intent(in), optional :: reflects !! its nodes are the image of the others in a mirror
    integer, allocatable :: nodes(:)
    integer :: id, kind, cell

    nodes = nodes_of_element(draft%connectivity, master)
    id = draft%element_id(master)
    kind = draft%element_kind(master)
    cell = draft%connectivity%cell(master)
    if (present(reflects)) then
      if (reflects) nodes = nodes(order_in_mirror(cell, draft%plane /= solids, size(nodes)))
    end if
    ok = maxval(nodes) + by_node <= huge(1) .and. id + by_element <= huge(1)
    if (.not. ok) call report(reader, position, 'this card makes an element with ids above '// &
      to_text(huge(1)))
    if (.not. ok) return
    call reserve_elements(draft, 1, ok)
    if (.not. ok) call report(reader, position, 'too many elements (at most '// &
      to_text(max_nodes)//', memory permitting)')
    if (ok) call add_element(draft, id + int(by_element), kind, cell, nodes + int(by_node), &
      position)
  end subroutine put_element

  !> The order of the nodes of an element that is seen in a mirror, else it would be inside out:
  !> around a plane element or the base of a pyramid the other way, tetrahedra with two corners
  !> exchanged, others upside down.
  pure function order_in_mirror(cell, is_plane, n) result(order)
    integer, intent(in) :: cell
    logical, intent(in) :: is_plane !! its nodes have places for their copies, as of expand_plane
    integer, intent(in) :: n        !! nodes
    integer :: order(n)
    integer :: i, k

    associate (c => cells(cell)%n_corners, edge => cells(cell)%edge)
      if (is_plane) then
        order(:c/2) = [1, (c/2 + 2 - i, i=2, c/2)]
        order(c/2 + 1:c) = c/2 + order(:c/2)
      else
        order(:c) = [(modulo(i + c/2 - 1, c) + 1, i=1, c)]
        if (c == 4) order(:c) = [2, 1, 3, 4]
        if (c == 5) order(:c) = [1, 4, 3, 2, 5]
      end if
      do i = c + 1, n
        do k = 1, n - c
          if (is_same(edge(:, k), order(edge(:, i - c)))) order(i) = c + k
        end do
      end do
    end associate

  contains

    !> Whether two edges have the same ends.
    pure logical function is_same(one, other)
      integer, intent(in) :: one(2), other(2)

      is_same = all(one == other) .or. all(one == other([2, 1]))
    end function is_same

  end function order_in_mirror

  !> Put numbers of nodes or elements into the set that an option names, if it does.
  subroutine add_to_set(reader, card, option, draft, members)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    character(*), intent(in) :: option
    type(mesh_draft_t), intent(inout) :: draft
    integer, intent(in) :: members(:)
    type(early_set_t) :: set
    integer, allocatable :: sorted(:)
    integer :: i
    logical :: ok

    call name_option(reader, card, option, .false., set%name, ok)
    if (.not. ok .or. size(members) == 0) return
    set%kind = merge(set_of_elements, set_of_nodes, card%keyword(1:1) == 'E')
    set%position = card%position
    sorted = members
    call sort_unique(sorted)
    set%first = sorted(1)
    do i = 1, size(sorted)
      set%last = sorted(i)
      if (i < size(sorted)) then
        if (sorted(i + 1) == sorted(i) + 1) cycle
      end if
      call add_early_set(draft, set)
      if (i < size(sorted)) set%first = sorted(i + 1)
    end do
  end subroutine add_to_set

end module generate_mesh_mod
