!> The parts of a deck, their instances in its assembly, and how each instance is moved.
!>
!>     *PART, NAME=CUBE              begins a part, *END PART ends it
!>     *ASSEMBLY, NAME=ALL           begins the assembly, *END ASSEMBLY ends it
!>     *INSTANCE, NAME=C-1, PART=CUBE
!>     0., 0., 2.                    a translation, then
!>     0., 0., 0., 0., 0., 1., 90.   a rotation: two points of its axis, degrees
!>     *END INSTANCE
module parts_mod
  use cards_mod, only: note, reader_t, report
  use diagnostics_mod, only: any_mistakes, guess, quoted
  use fields_mod, only: end_data, fields_t, next_data_line, real_field
  use deck_table_mod, only: max_keyword
  use kinds_mod, only: wp
  use options_mod, only: allow_no_data, allow_options, card_t, name_option, open_card, &
    option_position
  use rotations_mod, only: rotation_matrix
  use text_mod, only: string_t
  implicit none
  private

  public :: assembly_t, instance_t, find_structure, is_structure, index_of

  !> A pattern: the cards between *PART and *END PART.
  type :: part_t
    type(string_t) :: name    !! upper case
    integer :: first = 1      !! its cards
    integer :: last = 0
    logical :: used = .false. !! it has an instance
  end type part_t

  !> A copy of a part, with cards of its own.
  type :: instance_t
    type(string_t) :: name            !! upper case
    integer :: part = 0               !! index of the part
    integer :: first = 1              !! cards between *INSTANCE and *END INSTANCE
    integer :: last = 0
    integer :: added = 0              !! to the ids of its nodes and elements
    logical :: moves = .false.
    real(wp) :: translation(3) = 0.0_wp  !! comes first [length]
    real(wp) :: point(3) = 0.0_wp        !! of the axis of the rotation [length]
    real(wp) :: rotation(3, 3) = 0.0_wp  !! [-]
  end type instance_t

  type :: assembly_t
    character(:), allocatable :: name !! upper case; not allocated: there is none
    type(part_t), allocatable :: parts(:)
    type(instance_t), allocatable :: instances(:)
    integer, allocatable :: instance(:) !! (n_cards) the instance whose *INSTANCE a card is, or 0
    logical, allocatable :: inside(:)
    !! (n_cards) the card is in a part or an instance, or begins or ends one, or the assembly
    integer :: highest = 0              !! id of a node or an element of the deck
  end type assembly_t

contains

  !> Whether a keyword begins or ends a part, an instance or the assembly.
  elemental logical function is_structure(keyword)
    character(*), intent(in) :: keyword

    select case (keyword)
    case ('PART', 'END PART', 'ASSEMBLY', 'END ASSEMBLY', 'INSTANCE', 'END INSTANCE')
      is_structure = .true.
    case default
      is_structure = .false.
    end select
  end function is_structure

  !> Find parts and instances, and the cards of each. The first card at a wrong place is reported:
  !> others follow from it.
  subroutine find_structure(reader, assembly)
    type(reader_t), intent(inout) :: reader
    type(assembly_t), intent(out) :: assembly
    type(card_t) :: card, opened, opened_assembly
    character(:), allocatable :: problem
    character(max_keyword) :: open
    integer :: k
    logical :: in_assembly

    allocate (assembly%parts(0), assembly%instances(0))
    allocate (assembly%instance(reader%n_cards), source=0)
    allocate (assembly%inside(reader%n_cards), source=.false.)
    open = ''
    in_assembly = .false.
    do k = 1, reader%n_cards
      associate (keyword => reader%cards(k)%keyword)
        assembly%inside(k) = open /= '' .or. is_structure(keyword)
        if (.not. (is_structure(keyword) .or. keyword == 'STEP')) cycle
        call open_card(reader, k, card)
        call check_place(trim(keyword), trim(open), in_assembly, allocated(assembly%name), problem)
        if (len(problem) > 0) then
          call report(reader, card%position, problem)
          return
        end if
        select case (keyword)
        case ('PART')
          call open_part(reader, card, k, assembly)
        case ('ASSEMBLY')
          call allow_options(reader, card)
          call allow_no_data(reader, card)
          call read_name(reader, card, assembly%name)
          in_assembly = .true.
          opened_assembly = card
        case ('INSTANCE')
          call open_instance(reader, card, k, assembly)
        case ('STEP')
          cycle
        case default
          call allow_options(reader, card)
          call allow_no_data(reader, card)
          if (keyword == 'END PART') assembly%parts(size(assembly%parts))%last = k - 1
          if (keyword == 'END INSTANCE') assembly%instances(size(assembly%instances))%last = k - 1
          if (keyword == 'END ASSEMBLY') in_assembly = .false.
          open = ''
          cycle
        end select
        if (any_mistakes(reader%diagnostics)) return
        opened = card
        if (keyword /= 'ASSEMBLY') open = keyword
      end associate
    end do
    if (open /= '') then
      call report(reader, opened%position, '*'//trim(open)//' has no *END '//trim(open))
    else if (in_assembly) then
      call report(reader, opened_assembly%position, '*ASSEMBLY has no *END ASSEMBLY')
    end if
    do k = 1, size(assembly%parts)
      if (.not. assembly%parts(k)%used) call note(reader, 'part '// &
        quoted(assembly%parts(k)%name%text)//' has no instance: it is not in the model')
    end do
  end subroutine find_structure

  !> Why a card may not stand where it is; empty: it may.
  pure subroutine check_place(keyword, open, in_assembly, was_assembly, problem)
    character(*), intent(in) :: keyword
    character(*), intent(in) :: open         !! PART or INSTANCE, or nothing
    logical, intent(in) :: in_assembly, was_assembly
    character(:), allocatable, intent(out) :: problem

    problem = ''
    if (keyword == 'STEP' .and. (in_assembly .or. open /= '')) then
      problem = open
      if (open == '') problem = 'ASSEMBLY'
      problem = '*STEP before *END '//problem
    else if (keyword == 'STEP') then
      return
    else if (keyword == 'END '//open .and. open /= '') then
      return
    else if (open /= '') then
      problem = '*'//keyword//' in '//article(open)//': its *END '//open//' is missing'
      if (keyword == open) problem = '*'//keyword//' in '//article(open)//': they cannot be nested'
    else if (keyword == 'END PART' .or. keyword == 'END INSTANCE') then
      problem = '*'//keyword//' without *'//keyword(5:)
    else if (keyword == 'PART' .and. was_assembly) then
      problem = '*PART belongs before *ASSEMBLY'
    else if (keyword == 'ASSEMBLY' .and. was_assembly) then
      problem = 'a second *ASSEMBLY'
    else if (keyword == 'INSTANCE' .and. .not. in_assembly) then
      problem = '*INSTANCE belongs between *ASSEMBLY and *END ASSEMBLY'
    else if (keyword == 'END ASSEMBLY' .and. .not. in_assembly) then
      problem = '*END ASSEMBLY without *ASSEMBLY'
    end if
  end subroutine check_place

  pure function article(open) result(words)
    character(*), intent(in) :: open
    character(:), allocatable :: words

    words = 'a *'//open
    if (open == 'INSTANCE') words = 'an *'//open
  end function article

  !> *PART, NAME=name
  subroutine open_part(reader, card, k, assembly)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    integer, intent(in) :: k
    type(assembly_t), intent(inout) :: assembly
    type(part_t) :: part

    call allow_options(reader, card)
    call allow_no_data(reader, card)
    call read_name(reader, card, part%name%text)
    part%first = k + 1
    if (index_of(part%name%text, assembly%parts%name) > 0) call report(reader, &
      option_position(card, 'NAME'), 'duplicate part '//quoted(part%name%text))
    assembly%parts = [assembly%parts, part]
  end subroutine open_part

  !> *INSTANCE, NAME=name, PART=name: x, y, z; xa, ya, za, xb, yb, zb, angle
  subroutine open_instance(reader, card, k, assembly)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    integer, intent(in) :: k
    type(assembly_t), intent(inout) :: assembly
    type(instance_t) :: instance
    character(:), allocatable :: name
    logical :: ok

    call allow_options(reader, card)
    call read_name(reader, card, instance%name%text)
    call name_option(reader, card, 'PART', .true., name, ok)
    if (index_of(instance%name%text, assembly%instances%name) > 0) call report(reader, &
      option_position(card, 'NAME'), 'duplicate instance '//quoted(instance%name%text))
    instance%first = k + 1
    if (ok) then
      instance%part = index_of(name, assembly%parts%name)
      if (instance%part > 0) then
        assembly%parts(instance%part)%used = .true.
      else
        call report(reader, option_position(card, 'PART'), 'part '//quoted(name)// &
          ' is not defined', guess(name, assembly%parts%name))
      end if
    end if
    call read_motion(reader, card, instance)
    assembly%instances = [assembly%instances, instance]
    assembly%instance(k) = size(assembly%instances)
  end subroutine open_instance

  !> The name of a part, an instance or the assembly.
  subroutine read_name(reader, card, name)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    character(:), allocatable, intent(out) :: name
    logical :: ok

    call name_option(reader, card, 'NAME', .true., name, ok)
    if (ok .and. index(name, '<') > 0) call report(reader, option_position(card, 'NAME'), &
      "a name cannot have '<'")
  end subroutine read_name

  !> Index of a name in a list, 0 if it is not there.
  pure integer function index_of(name, names)
    character(*), intent(in) :: name
    type(string_t), intent(in) :: names(:)

    do index_of = size(names), 1, -1
      if (names(index_of)%text == name) return
    end do
  end function index_of

  !> Read how an instance is moved: by a translation, then by a rotation about an axis that is given
  !> in the assembly.
  subroutine read_motion(reader, card, instance)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(instance_t), intent(inout) :: instance
    type(fields_t) :: fields
    real(wp) :: values(7), axis(3)
    logical :: found

    call next_data_line(reader, card, fields, found, 3, 'the translation x, y, z of the instance')
    if (.not. found) return
    call read_values('a component of the translation', 3)
    instance%translation = values(:3)
    instance%rotation = turn_about([0.0_wp, 0.0_wp, 1.0_wp], 0.0_wp)
    instance%moves = .true.
    call next_data_line(reader, card, fields, found, 7, &
      'two points of the axis of a rotation and its angle in degrees')
    if (.not. found) return
    call read_values('two points of the axis of a rotation and its angle in degrees', 7)
    if (any_mistakes(reader%diagnostics)) return
    axis = values(4:6) - values(1:3)
    if (.not. norm2(axis) > 0.0_wp) then
      call report(reader, fields%start, 'the axis of the rotation needs two different points')
      return
    end if
    instance%point = values(:3)
    instance%rotation = turn_about(axis/norm2(axis), values(7))
    call end_data(reader, card, fields, &
      '*INSTANCE has a line of a translation and one of a rotation')

  contains

    subroutine read_values(what, n)
      character(*), intent(in) :: what
      integer, intent(in) :: n
      integer :: i
      logical :: ok

      do i = 1, n
        call real_field(reader, fields, i, what, values(i), ok)
        if (.not. ok) exit
      end do
    end subroutine read_values

  end subroutine read_motion

  !> The matrix of a rotation; quarter turns about x, y and z are exact.
  pure function turn_about(axis, degrees) result(matrix)
    real(wp), intent(in) :: axis(3) !! of length 1 [-]
    real(wp), intent(in) :: degrees !! right-handed about the axis
    real(wp) :: matrix(3, 3)

    matrix = rotation_matrix(modulo(degrees, 360.0_wp)*acos(-1.0_wp)/180.0_wp*axis)
    where (abs(matrix - anint(matrix)) < 4.0_wp*epsilon(1.0_wp)) matrix = anint(matrix)
  end function turn_about

end module parts_mod
