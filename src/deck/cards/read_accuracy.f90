!> How accurate the user wants the results.
!>
!>     *ACCURACY, OF=RESULTANTS, MESH=REFINE
!>     0.01                           of the largest of what it is of
!>     *ACCURACY, OF=DISPLACEMENT, NSET=TIP, DIRECTION=3
!>     0.02                           of the largest in the set
!>     *ACCURACY, VALUE=EXTRAPOLATED
!>     0.001                          of values extrapolated from several meshes
!>     *ACCURACY, ESTIMATE=NO         errors of mesh and load steps are not estimated
module read_accuracy_mod
  use cards_mod, only: reader_t, report
  use controls_mod, only: accuracy_controls_t, accuracy_of_contact_force, &
    accuracy_of_displacement, accuracy_of_mises, accuracy_of_reaction, subjects
  use diagnostics_mod, only: quoted
  use fields_mod, only: end_data, field_position, field_text, fields_t, next_data_line, real_field
  use kinds_mod, only: wp
  use mesh_draft_mod, only: given_nodes, is_of_block
  use options_mod, only: allow_options, card_t, choice_option, has_option, integer_option, &
    name_option, open_only_card, option_position
  use scene_mod, only: contact_pair_t
  use sets_mod, only: find_set, model_t, report_unknown
  use surfaces_mod, only: surface_t
  use text_mod, only: to_text
  implicit none
  private

  public :: read_accuracy

  integer, parameter :: most_nodes = 100
  !! whose values are followed one by one: each has a name of its own in the result

contains

  !> *ACCURACY
  subroutine read_accuracy(reader, model, surfaces, pairs, accuracy)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(surface_t), intent(in) :: surfaces(:)
    type(contact_pair_t), intent(in) :: pairs(:)
    type(accuracy_controls_t), intent(out) :: accuracy
    type(card_t) :: card
    type(fields_t) :: fields
    integer :: choice, estimate, mesh, value, theory
    logical :: found, ok

    call open_only_card(reader, 'ACCURACY', card, found)
    if (.not. found) return
    call allow_options(reader, card)
    estimate = 1
    call choice_option(reader, card, 'ESTIMATE', estimate, ok)
    accuracy%estimates = estimate == 1
    theory = 1
    call choice_option(reader, card, 'THEORY', theory, ok)
    accuracy%follows_theory = theory == 2
    call choice_option(reader, card, 'OF', choice, ok)
    if (ok) accuracy%of = choice
    mesh = 1
    call choice_option(reader, card, 'MESH', mesh, ok)
    accuracy%keeps_mesh = mesh == 2
    if (accuracy%keeps_mesh .and. .not. subjects(accuracy%of)%is_recovered) call report(reader, &
      option_position(card, 'OF'), 'on one mesh the errors of RESULTANTS and ENERGY are '// &
      'estimated, others take several: MESH=REFINE')
    value = 1
    call choice_option(reader, card, 'VALUE', value, ok)
    accuracy%extrapolates = value == 2
    if (accuracy%keeps_mesh .and. accuracy%extrapolates) call report(reader, &
      option_position(card, 'VALUE'), 'values are extrapolated from several meshes, and '// &
      'MESH=KEEP keeps one')
    if (.not. accuracy%estimates) then
      if (has_option(card, 'MESH')) call report(reader, option_position(card, 'MESH'), &
        'MESH says whether an accuracy may choose the mesh, and with ESTIMATE=NO none is asked for')
      call refuse_subject('OF')
      call refuse_subject('VALUE')
      call refuse_subject('NSET')
      call refuse_subject('DIRECTION')
      call next_data_line(reader, card, fields, found, 1, 'no data')
      if (found) call report(reader, fields%start, &
        'with ESTIMATE=NO nobody knows whether an accuracy is reached: none can be asked for')
      return
    end if
    call read_subject(reader, card, model, surfaces, pairs, accuracy)
    call read_wanted(reader, card, accuracy%wanted)

  contains

    subroutine refuse_subject(option)
      character(*), intent(in) :: option

      if (has_option(card, option)) call report(reader, option_position(card, option), option// &
        ' says what an accuracy is of, and with ESTIMATE=NO none is asked for')
    end subroutine refuse_subject

  end subroutine read_accuracy

  !> The set of nodes that it is of, where it is not of the whole.
  subroutine read_subject(reader, card, model, surfaces, pairs, accuracy)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(model_t), intent(in) :: model
    type(surface_t), intent(in) :: surfaces(:)
    type(contact_pair_t), intent(in) :: pairs(:)
    type(accuracy_controls_t), intent(inout) :: accuracy !! knows what it is of
    character(:), allocatable :: set, what
    integer :: found
    logical :: ok

    what = trim(subjects(accuracy%of)%name)
    call integer_option(reader, card, 'DIRECTION', 1, 3, accuracy%direction, ok)
    if (ok .and. .not. subjects(accuracy%of)%is_vector) then
      call report(reader, option_position(card, 'DIRECTION'), 'DIRECTION is of vectors: OF='// &
        'DISPLACEMENT, REACTION FORCE or CONTACT FORCE of a set, not '//what)
    else if (ok .and. .not. has_option(card, 'NSET')) then
      call report(reader, option_position(card, 'DIRECTION'), &
        'DIRECTION is of the nodes of a set: NSET= is missing')
    end if
    if (.not. has_option(card, 'NSET')) then
      if (subjects(accuracy%of)%of_all == '') call report(reader, option_position(card, 'OF'), &
        'a '//what//' is compared for a set of nodes: NSET= is missing')
      return
    end if
    call name_option(reader, card, 'NSET', .true., set, ok)
    if (.not. ok) return
    if (subjects(accuracy%of)%of_set == '') then
      call report(reader, option_position(card, 'NSET'), 'NSET takes OF=DISPLACEMENT, '// &
        'PRESSURE, SLIP, MISES, REACTION FORCE or CONTACT FORCE, not '//what)
      return
    end if
    found = find_set(model%node_sets, set)
    if (found == 0) then
      call report_unknown(reader, model%node_sets, option_position(card, 'NSET'), set)
    else if (allocated(model%node_sets%list(found)%members) .and. &
      .not. model%node_sets%list(found)%flawed) then
      accuracy%set = set
      call take_nodes(reader, option_position(card, 'NSET'), model, surfaces, pairs, &
        model%node_sets%list(found)%members, accuracy)
    end if
  end subroutine read_subject

  !> The nodes of the set that have the quantity.
  subroutine take_nodes(reader, position, model, surfaces, pairs, members, accuracy)
    type(reader_t), intent(inout) :: reader
    integer, intent(in) :: position
    type(model_t), intent(in) :: model
    type(surface_t), intent(in) :: surfaces(:)
    type(contact_pair_t), intent(in) :: pairs(:)
    integer, intent(in) :: members(:) !! of the set
    type(accuracy_controls_t), intent(inout) :: accuracy !! gets them
    character(:), allocatable :: which
    logical, allocatable :: has(:)
    integer :: i

    accuracy%nodes = members
    select case (accuracy%of)
    case (accuracy_of_displacement, accuracy_of_reaction)
      has = model%used .or. model%reference .or. model%joined
      which = 'that moves: they belong to no element, and nothing moves with them'
    case (accuracy_of_mises)
      has = model%used
      which = 'of an element, which stresses are in'
    case default
      has = in_contact(accuracy%of == accuracy_of_contact_force)
      which = 'of contact: a '//trim(subjects(accuracy%of)%name)//' is that of nodes of slave '// &
        'surfaces'
      if (accuracy%of == accuracy_of_contact_force) which = which//', or of masters that are bodies'
    end select
    if (.not. subjects(accuracy%of)%is_sum) then
      accuracy%nodes = given_nodes(model%mesh, accuracy%nodes)
      accuracy%nodes = pack(accuracy%nodes, has(accuracy%nodes))
      ! The same nodes are there only in elements that are cut.
      do i = 1, size(accuracy%nodes)
        if (is_of_block(model%mesh, accuracy%nodes(i))) reader%numbers_block = .true.
      end do
    end if
    if (.not. any(has(accuracy%nodes))) then
      call report(reader, position, quoted(accuracy%set)//' has no node '//which)
    else if (.not. subjects(accuracy%of)%is_sum .and. size(accuracy%nodes) > most_nodes) then
      call report(reader, position, 'an accuracy follows at most '//to_text(most_nodes)// &
        ' nodes one by one, and '//quoted(accuracy%set)//' has '// &
        to_text(size(accuracy%nodes))//': name some of them in a set of their own')
    end if

  contains

    !> Which nodes may touch.
    function in_contact(with_masters) result(touch)
      logical, intent(in) :: with_masters
      logical, allocatable :: touch(:)
      integer :: p

      allocate (touch(model%mesh%n_nodes), source=.false.)
      do p = 1, size(pairs)
        touch(surfaces(pairs(p)%surface)%nodes) = .true.
        if (with_masters .and. pairs(p)%master_surface > 0) touch(surfaces(pairs(p)% &
          master_surface)%nodes) = .true.
      end do
    end function in_contact

  end subroutine take_nodes

  !> The one data line.
  subroutine read_wanted(reader, card, wanted)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    real(wp), intent(inout) :: wanted
    type(fields_t) :: fields
    real(wp) :: value
    logical :: found, ok

    call next_data_line(reader, card, fields, found, 1, 'an accuracy')
    if (.not. found) then
      ! That the theory's error is estimated may be all there is to say.
      if (has_option(card, 'THEORY') .and. .not. any([has_option(card, 'OF'), has_option(card, &
        'NSET'), has_option(card, 'MESH'), has_option(card, 'VALUE')])) return
      call report(reader, card%position, '*ACCURACY needs a data line: an accuracy, as 0.01')
      return
    end if
    call real_field(reader, fields, 1, 'an accuracy between 0 and 1', value, ok)
    if (ok .and. (value <= 0.0_wp .or. value >= 1.0_wp)) then
      call report(reader, field_position(reader, fields, 1), 'an accuracy is above 0 and below '// &
        '1, found '//quoted(field_text(reader, fields, 1)))
    else if (ok) then
      wanted = value
    end if
    call end_data(reader, card, fields, '*ACCURACY has one data line')
  end subroutine read_wanted

end module read_accuracy_mod
