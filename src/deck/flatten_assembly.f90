!> Parts and their instances in an assembly, written out as one model.
!>
!>     *PART, NAME=CUBE              what stands here is a pattern
!>     *NODE                         ids are those of the part
!>     *END PART
!>     *ASSEMBLY, NAME=ALL
!>     *INSTANCE, NAME=C-1, PART=CUBE
!>     0., 0., 2.                    a translation, then
!>     0., 0., 0., 0., 0., 1., 90.   a rotation: two points of its axis, degrees
!>     *END INSTANCE
!>     *NSET, NSET=TOP, INSTANCE=C-1 ids and sets of that instance
!>     *END ASSEMBLY
!>     *CLOAD
!>     C-1.12, 3, -1.                a node of an instance; C-1.SIDE: a set of it
!>
!> The lines of a part stand once for each instance in the text that is made here. Their ids have a
!> number added, the names of their sets and surfaces begin with the name of the instance and a
!> point, their coordinates are moved. Each line keeps the file and the number of the line that it
!> was made from. So whoever reads the text knows nothing of parts, and errors have their places.
module flatten_assembly_mod
  use read_analytical_mod, only: about_axis, analytical_type
  use parts_mod, only: assembly_t, find_structure, index_of, instance_t, is_structure
  use cards_mod, only: find_cards, is_data_line, note, pieces_t, read_parameters, reader_t, &
    report, split_line
  use deck_source_mod, only: add_line, max_deck_length, source_t
  use diagnostics_mod, only: any_mistakes, guess, quoted
  use deck_table_mod, only: squeeze
  use kinds_mod, only: i8, wp
  use numbers_mod, only: number_ok, number_text, read_integer, read_real
  use options_mod, only: as_name, card_t, flag_option, has_option, name_option, open_card, &
    option_position, unquote
  use parameters_mod, only: parameter_table_t
  use substitution_mod, only: substitute
  use text_mod, only: to_text, upper
  implicit none
  private

  public :: flatten_assembly

  !> How the lines of a card change.
  type :: change_t
    integer :: instance = 0           !! whose ids and sets the lines name; 0: no instance's
    logical :: is_copy = .false.      !! the card stands in a part or an instance
    logical :: generates = .false.    !! a set with GENERATE
    integer :: sweep = 0              !! of an analytical surface: how its profile is swept
  end type change_t

contains

  !> Write parts and instances out, and find the cards of the new text. A deck without parts stays
  !> as it is.
  subroutine flatten_assembly(reader, readable)
    type(reader_t), intent(inout) :: reader !! its cards have been found, and its parameters read
    logical, intent(out) :: readable
    !! false: mistakes were reported, and all else would follow from them
    type(assembly_t) :: assembly
    type(source_t) :: flat
    type(parameter_table_t) :: parameters

    readable = .true.
    if (.not. any(is_structure(reader%cards(:reader%n_cards)%keyword))) return
    readable = .false.
    if (any_mistakes(reader%diagnostics)) return
    call find_structure(reader, assembly)
    if (.not. any_mistakes(reader%diagnostics)) call check_cards(reader, assembly)
    if (.not. any_mistakes(reader%diagnostics)) call number_instances(reader, assembly)
    if (.not. any_mistakes(reader%diagnostics)) call write_flat(reader, assembly, flat)
    if (any_mistakes(reader%diagnostics)) return
    reader%source = flat
    deallocate (reader%cards)
    reader%n_cards = 0
    call find_cards(reader)
    ! The parameters stand at other places of the new text.
    parameters = reader%parameters
    reader%parameters%n = 0
    call read_parameters(reader)
    if (parameters%n > 0) reader%parameters%list(:parameters%n)%used = &
      parameters%list(:parameters%n)%used
    readable = .true.
  end subroutine flatten_assembly

  !> Report cards that cannot be copied with a part, and blocks that would take ids of instances.
  subroutine check_cards(reader, assembly)
    type(reader_t), intent(inout) :: reader
    type(assembly_t), intent(in) :: assembly
    type(card_t) :: card
    integer :: k, last_instance

    last_instance = findloc(assembly%instance > 0, .true., dim=1, back=.true.)
    do k = 1, reader%n_cards
      associate (keyword => reader%cards(k)%keyword)
        if (is_structure(keyword)) cycle
        if (assembly%inside(k)) then
          select case (keyword)
          case ('PARAMETER', 'NODE', 'ELEMENT', 'NSET', 'ELSET', 'SURFACE', 'SOLID SECTION', &
                'RIGID BODY', 'COUPLING', 'KINEMATIC', 'DISTRIBUTING', 'TIE', 'SPRING', &
                'GAP', 'ORIENTATION')
            cycle
          case default
            call open_card(reader, k, card)
            call report(reader, card%position, '*'//card%keyword// &
              ' cannot stand in a part or an instance', &
              'below *END ASSEMBLY it can name INSTANCE.SET and INSTANCE.12')
          end select
        else if (keyword == 'BLOCK' .and. k < last_instance) then
          call open_card(reader, k, card)
          call report(reader, card%position, '*BLOCK belongs below *END ASSEMBLY')
        end if
      end associate
    end do
  end subroutine check_cards

  !> Choose what is added to the ids of each instance: multiples of the first power of ten above
  !> all ids of the deck.
  subroutine number_instances(reader, assembly)
    type(reader_t), intent(inout) :: reader
    type(assembly_t), intent(inout) :: assembly
    type(source_t) :: one
    type(pieces_t) :: pieces
    integer(i8) :: step
    integer :: k, line, i, id, status, last

    do k = 1, reader%n_cards
      select case (reader%cards(k)%keyword)
      case ('NODE', 'ELEMENT')
        do line = reader%cards(k)%first, reader%cards(k)%last
          if (.not. is_data_line(reader%source, line)) cycle
          call load_line(reader, line, one, pieces)
          last = pieces%n
          if (reader%cards(k)%keyword == 'NODE') last = 1
          do i = 1, last
            call read_integer(one%text(pieces%first(i):pieces%last(i)), id, status)
            if (status == number_ok) assembly%highest = max(assembly%highest, id)
          end do
        end do
      case default
        cycle
      end select
    end do
    step = 10
    do while (step <= assembly%highest)
      step = 10*step
    end do
    if (step*(size(assembly%instances) + 1) > huge(1)) then
      call report(reader, 0, 'the ids of nodes and elements are too large for '// &
        to_text(size(assembly%instances))//' instances: the highest is '// &
        to_text(assembly%highest), 'number the nodes and elements of the parts from 1')
      return
    end if
    do i = 1, size(assembly%instances)
      associate (instance => assembly%instances(i))
        instance%added = i*int(step)
        call note(reader, 'instance '//quoted(instance%name%text)//': its nodes and elements '// &
          'have the numbers of its part plus '//to_text(instance%added))
      end associate
    end do
  end subroutine number_instances

  !> Write the deck without parts.
  subroutine write_flat(reader, assembly, flat)
    type(reader_t), intent(inout) :: reader
    type(assembly_t), intent(in) :: assembly
    type(source_t), intent(inout) :: flat
    integer :: k, j, line, i

    flat%files = reader%source%files
    flat%n_files = reader%source%n_files
    line = 1
    do k = 1, reader%n_cards
      associate (place => reader%cards(k))
        call copy_lines(reader, line, place%header - 1, flat) ! keywords that are ignored
        line = place%last + 1
        i = assembly%instance(k)
        if (i > 0) then
          associate (instance => assembly%instances(i))
            do j = assembly%parts(instance%part)%first, assembly%parts(instance%part)%last
              call write_copy(reader, assembly, j, i, flat)
            end do
            do j = instance%first, instance%last
              call write_copy(reader, assembly, j, i, flat)
            end do
          end associate
        else if (place%keyword == 'PARAMETER') then
          call copy_lines(reader, place%header, place%last, flat)
        else if (.not. assembly%inside(k)) then
          call write_card(reader, assembly, k, flat)
        end if
      end associate
      if (any_mistakes(reader%diagnostics)) return
    end do
    call copy_lines(reader, line, reader%source%n_lines, flat)
  end subroutine write_flat

  !> Write a card of a part for one of its instances.
  subroutine write_copy(reader, assembly, k, i, flat)
    type(reader_t), intent(inout) :: reader
    type(assembly_t), intent(in) :: assembly
    integer, intent(in) :: k, i
    type(source_t), intent(inout) :: flat
    type(card_t) :: card
    type(change_t) :: change

    if (reader%cards(k)%keyword == 'PARAMETER') return ! stands once, where the part was
    call open_card(reader, k, card)
    change%instance = i
    change%is_copy = .true.
    call flag_option(reader, card, 'GENERATE', change%generates)
    if (card%keyword == 'SURFACE') change%sweep = analytical_type(reader, card)
    call write_changed(reader, assembly, k, change, flat)
  end subroutine write_copy

  !> Write a card that stands in no part.
  subroutine write_card(reader, assembly, k, flat)
    type(reader_t), intent(inout) :: reader
    type(assembly_t), intent(in) :: assembly
    integer, intent(in) :: k
    type(source_t), intent(inout) :: flat
    type(card_t) :: card
    type(change_t) :: change
    character(:), allocatable :: name
    logical :: ok

    select case (reader%cards(k)%keyword)
    case ('HEADING', 'STEP') ! their lines are titles
      call copy_lines(reader, reader%cards(k)%header, reader%cards(k)%last, flat)
      return
    case ('NSET', 'ELSET')
      call open_card(reader, k, card)
      if (has_option(card, 'INSTANCE')) then
        call name_option(reader, card, 'INSTANCE', .true., name, ok)
        if (.not. ok) return
        change%instance = index_of(name, assembly%instances%name)
        if (change%instance == 0) then
          name = local_name(assembly, name)
          change%instance = index_of(name, assembly%instances%name)
        end if
        if (change%instance == 0) then
          call report(reader, option_position(card, 'INSTANCE'), 'instance '//quoted(name)// &
            ' is not defined', guess(name, assembly%instances%name))
          return
        end if
        call flag_option(reader, card, 'GENERATE', change%generates)
      end if
    case default
      continue
    end select
    call write_changed(reader, assembly, k, change, flat)
  end subroutine write_card

  !> Write a card with its names and ids as the flat deck has them.
  subroutine write_changed(reader, assembly, k, change, flat)
    type(reader_t), intent(inout) :: reader
    type(assembly_t), intent(in) :: assembly
    integer, intent(in) :: k
    type(change_t), intent(in) :: change
    type(source_t), intent(inout) :: flat
    type(source_t) :: one
    type(pieces_t) :: pieces
    integer :: line, i, done
    character(:), allocatable :: text, piece
    logical :: is_header

    piece = ''
    associate (place => reader%cards(k))
      do line = place%header, place%last
        is_header = line < place%first
        if (.not. (line == place%header .or. is_data_line(reader%source, line))) cycle
        if (change%sweep > 0 .and. line == place%first) then
          if (assembly%instances(change%instance)%moves) call put(reader, line, moved_axes( &
            assembly%instances(change%instance), change%sweep), flat)
        end if
        call load_line(reader, line, one, pieces, keep=change%instance == 0)
        text = ''
        done = 0
        do i = 1, pieces%n
          piece = one%text(pieces%first(i):pieces%last(i))
          if (is_header) then
            if (line > place%header .or. i > 1) piece = changed_option(piece)
            if (len(piece) == 0) then ! left out, with the comma before it
              done = pieces%last(i)
              cycle
            end if
          else
            piece = changed_field(piece)
          end if
          text = text//one%text(done + 1:pieces%first(i) - 1)//piece
          done = pieces%last(i)
        end do
        text = text//one%text(done + 1:one%length - 1)
        if (place%keyword == 'NODE' .and. .not. is_header .and. change%instance > 0) then
          call move_node(assembly%instances(change%instance), text)
        else if (place%keyword == 'ORIENTATION' .and. line == place%first) then
          if (change%instance > 0) call move_axes(assembly%instances(change%instance), text)
        end if
        call put(reader, line, text, flat)
        if (any_mistakes(reader%diagnostics)) return
      end do
    end associate

  contains

    !> An option with the name that the flat deck has; INSTANCE= is left out.
    function changed_option(option) result(changed)
      character(*), intent(in) :: option
      character(:), allocatable :: changed
      character(:), allocatable :: name
      integer :: equal

      changed = option
      equal = index(option, '=')
      if (equal == 0 .or. equal == len(option)) return
      name = squeeze(option(:equal - 1))
      if (change%instance == 0) then
        changed = option(:equal)//outer_name(assembly, option(equal + 1:))
      else if (change%is_copy) then
        select case (name)
        case ('NSET', 'ELSET', 'PINNSET', 'TIENSET', 'NAME', 'SURFACE', 'CONSTRAINTNAME', &
              'ANALYTICALSURFACE', 'ORIENTATION')
          changed = option(:equal)//inner_name(option(equal + 1:))
        case ('REFNODE', 'ROTNODE')
          changed = option(:equal)//reference(option(equal + 1:))
        case default
          continue
        end select
      else if (name == 'INSTANCE') then
        changed = ''
      else if (name /= reader%cards(k)%keyword) then
        changed = option(:equal)//inner_name(option(equal + 1:))
      end if
    end function changed_option

    !> A field of a data line as the flat deck has it.
    function changed_field(field) result(changed)
      character(*), intent(in) :: field
      character(:), allocatable :: changed

      changed = field
      if (len(field) == 0) return
      if (change%instance == 0) then
        changed = outer_name(assembly, field)
        return
      end if
      select case (reader%cards(k)%keyword)
      case ('NODE')
        if (i == 1) changed = reference(field)
      case ('ELEMENT')
        changed = reference(field)
      case ('NSET', 'ELSET')
        if (.not. (change%generates .and. i > 2)) changed = reference(field)
      case ('SURFACE')
        if (i == 1 .and. change%sweep == 0) changed = reference(field)
      case ('TIE')
        changed = inner_name(field)
      case default
        continue
      end select
    end function changed_field

    !> An id, or the name of a set, of the instance.
    function reference(field) result(changed)
      character(*), intent(in) :: field
      character(:), allocatable :: changed
      integer :: id, status

      changed = trim(adjustl(field))
      if (verify(changed, '0123456789+-') > 0) then
        changed = inner_name(field)
        return
      end if
      call read_integer(changed, id, status)
      if (status /= number_ok .or. id < 1) return ! is reported by whoever reads the flat deck
      if (id > assembly%highest) then
        call report(reader, reader%source%first(line), 'no part has a node or an element '// &
          to_text(id))
      else
        changed = to_text(id + assembly%instances(change%instance)%added)
      end if
    end function reference

    !> The name of a set or a surface of the instance.
    function inner_name(name) result(changed)
      character(*), intent(in) :: name
      character(:), allocatable :: changed

      changed = as_name(assembly%instances(change%instance)%name%text//'.'//unquote(name))
    end function inner_name

  end subroutine write_changed

  !> A name outside of parts: INSTANCE.12 becomes an id, ASSEMBLY.SET becomes SET; all others stay.
  function outer_name(assembly, name) result(changed)
    type(assembly_t), intent(in) :: assembly
    character(*), intent(in) :: name
    character(:), allocatable :: changed
    character(:), allocatable :: bare, rest
    integer :: i, dot, id, status

    changed = name
    dot = index(name, '.')
    if (dot < 2 .or. index(name, '<') > 0) return
    if (verify(name, '0123456789+-.eEdD ') == 0) return
    bare = unquote(name)
    rest = local_name(assembly, bare)
    if (len(rest) /= len(bare)) changed = as_name(rest)
    do i = 1, size(assembly%instances)
      associate (instance => assembly%instances(i))
        dot = len(instance%name%text) + 1
        if (len(rest) <= dot) cycle
        if (upper(rest(:dot)) /= instance%name%text//'.') cycle
        if (verify(rest(dot + 1:), '0123456789') > 0) cycle
        call read_integer(rest(dot + 1:), id, status)
        ! An id that no part has stays: that name is not defined.
        if (status == number_ok .and. id >= 1 .and. id <= assembly%highest) then
          changed = to_text(id + instance%added)
        end if
        return
      end associate
    end do
  end function outer_name

  !> A name without the name of the assembly in front of it.
  pure function local_name(assembly, name) result(local)
    type(assembly_t), intent(in) :: assembly
    character(*), intent(in) :: name
    character(:), allocatable :: local
    integer :: dot

    local = name
    if (.not. allocated(assembly%name)) return
    dot = len(assembly%name) + 1
    if (len(name) <= dot) return
    if (upper(name(:dot)) == assembly%name//'.') local = name(dot + 1:)
  end function local_name

  !> The line with the axes of an analytical surface where an instance has moved them.
  function moved_axes(instance, sweep) result(text)
    type(instance_t), intent(in) :: instance
    integer, intent(in) :: sweep
    character(:), allocatable :: text
    real(wp) :: x(3, 3) !! the origin, points of the x axis and against the z axis, or one of it
    integer :: i, j

    x = reshape([0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, -1.0_wp], [3, 3])
    if (sweep == about_axis) x(:, 2) = [0.0_wp, 0.0_wp, 1.0_wp]
    text = ''
    do j = 1, merge(2, 3, sweep == about_axis)
      x(:, j) = x(:, j) + instance%translation
      x(:, j) = instance%point + matmul(instance%rotation, x(:, j) - instance%point)
      do i = 1, 3
        text = text//number_text(x(i, j))//', '
      end do
    end do
    text = text(:len(text) - 2)
  end function moved_axes

  !> Move the coordinates of a node's line; one that is no node's stays, and is reported later.
  subroutine move_node(instance, text)
    type(instance_t), intent(in) :: instance
    character(:), allocatable, intent(inout) :: text
    type(source_t) :: one
    type(pieces_t) :: pieces
    character(:), allocatable :: rest
    real(wp) :: x(3)
    integer :: i, status

    if (.not. instance%moves) return
    call add_line(one, text, 0, 0)
    call split_line(one, 1, pieces)
    if (pieces%n < 1) return
    x = 0.0_wp ! what is left out
    do i = 1, min(3, pieces%n - 1)
      if (pieces%last(i + 1) < pieces%first(i + 1)) cycle
      call read_real(text(pieces%first(i + 1):pieces%last(i + 1)), x(i), status)
      if (status /= number_ok) return
    end do
    x = x + instance%translation
    x = instance%point + matmul(instance%rotation, x - instance%point)
    rest = ''
    if (pieces%n > 4) rest = text(pieces%last(4) + 1:)
    text = text(:pieces%last(1))//', '//number_text(x(1))//', '//number_text(x(2))//', '// &
      number_text(x(3))//rest
  end subroutine move_node

  !> Move the points of an *ORIENTATION, the origin with them. A line that is none stays, and is
  !> reported later.
  subroutine move_axes(instance, text)
    type(instance_t), intent(in) :: instance
    character(:), allocatable, intent(inout) :: text
    type(source_t) :: one
    type(pieces_t) :: pieces
    integer :: j, first

    if (.not. instance%moves) return
    call add_line(one, text, 0, 0)
    call split_line(one, 1, pieces)
    if (pieces%n < 6 .or. pieces%n > 9) return
    call add_line(one, text//repeat(',', 9 - pieces%n), 0, 0)
    call split_line(one, 2, pieces)
    text = ''
    do j = 1, 3
      first = pieces%first(3*j - 2)
      call move_point(one%text(first:pieces%last(3*j)))
    end do

  contains

    !> Add a moved point to the line.
    subroutine move_point(point)
      character(*), intent(in) :: point
      character(:), allocatable :: line

      line = '1, '//point
      call move_node(instance, line)
      if (len(text) > 0) text = text//', '
      text = text//line(index(line, ',') + 1:)
    end subroutine move_point

  end subroutine move_axes

  !> Take one line of the deck, with the values of its parameters, and cut it into pieces.
  subroutine load_line(reader, line, one, pieces, keep)
    type(reader_t), intent(inout) :: reader
    integer, intent(in) :: line
    type(source_t), intent(inout) :: one
    type(pieces_t), intent(inout) :: pieces
    logical, intent(in), optional :: keep !! the parameters stay as they are
    character(:), allocatable :: replaced, problem
    integer :: first, last, at
    logical :: replace

    first = reader%source%first(line)
    last = reader%source%first(line + 1) - 2
    one%length = 0
    one%n_lines = 0
    replace = index(reader%source%text(first:last), '<') > 0
    if (present(keep)) replace = replace .and. .not. keep
    if (replace) then
      call substitute(reader%source%text(first:last), first, reader%parameters, replaced, &
        problem, at)
      if (allocated(problem)) then
        call report(reader, first + at - 1, problem)
        replaced = ''
      end if
      call add_line(one, replaced, 0, 0)
    else
      call add_line(one, reader%source%text(first:last), 0, 0)
    end if
    call split_line(one, 1, pieces)
  end subroutine load_line

  !> Copy lines as they are.
  subroutine copy_lines(reader, first, last, flat)
    type(reader_t), intent(inout) :: reader
    integer, intent(in) :: first, last
    type(source_t), intent(inout) :: flat
    integer :: line

    do line = first, last
      call put(reader, line, &
        reader%source%text(reader%source%first(line):reader%source%first(line + 1) - 2), flat)
    end do
  end subroutine copy_lines

  !> Add a line that was made from line `line` of the deck.
  subroutine put(reader, line, text, flat)
    type(reader_t), intent(inout) :: reader
    integer, intent(in) :: line
    character(*), intent(in) :: text
    type(source_t), intent(inout) :: flat

    if (flat%length > max_deck_length - len(text) - 1) then
      call report(reader, reader%source%first(line), 'with all instances the deck is larger '// &
        'than '//to_text(max_deck_length/1000000)//' MB')
    else
      call add_line(flat, text, reader%source%file(line), reader%source%number(line))
    end if
  end subroutine put

end module flatten_assembly_mod
