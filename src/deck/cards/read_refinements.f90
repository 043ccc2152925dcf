!> Elements that the deck cuts into smaller ones.
!>
!>     *REFINE, NSET=EDGE, TIMES=2        the elements at the nodes of a set
!>     *REFINE, ELSET=CORE                those of a set
!>     *REFINE, TIMES=3                   those about balls
!>     0., 0., 0., 1.5                    centre and radius, a line a ball
module read_refinements_mod
  use cards_mod, only: reader_t, report
  use diagnostics_mod, only: quoted
  use fields_mod, only: field_position, fields_t, next_data_line, real_field
  use kinds_mod, only: wp
  use mesh_size_mod, only: zone_t
  use options_mod, only: allow_no_data, allow_options, card_t, has_option, integer_option, &
    name_option, open_card, option_position
  use refine_locally_mod, only: most_times, refinement_t
  use sets_mod, only: find_set, model_t, report_unknown, set_list_t
  implicit none
  private

  public :: read_refinements

contains

  !> All *REFINE cards; sets have been read.
  subroutine read_refinements(reader, model, refinements)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(refinement_t), allocatable, intent(out) :: refinements(:)
    type(refinement_t) :: refinement
    type(card_t) :: card
    integer :: k
    logical :: ok

    allocate (refinements(0))
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'REFINE') cycle
      call open_card(reader, k, card)
      call allow_options(reader, card)
      refinement = refinement_t(position=card%position)
      call integer_option(reader, card, 'TIMES', 1, most_times, refinement%times, ok)
      if (has_option(card, 'NSET') .and. has_option(card, 'ELSET')) then
        call report(reader, option_position(card, 'ELSET'), '*REFINE cuts elements of one set: '// &
          'NSET= or ELSET=')
      else if (has_option(card, 'NSET')) then
        call read_set(reader, card, 'NSET', model%node_sets, model%used, refinement%node_set)
      else if (has_option(card, 'ELSET')) then
        call read_set(reader, card, 'ELSET', model%element_sets, &
          spread(.true., 1, model%mesh%n_elements), refinement%element_set)
      else
        call read_balls(reader, card, model%mesh%origin, refinement%zone)
        refinement%zone%times = refinement%times
      end if
      refinements = [refinements, refinement]
    end do
  end subroutine read_refinements

  !> The set of a card, which must have elements or nodes of elements.
  subroutine read_set(reader, card, option, sets, counts, found)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    character(*), intent(in) :: option
    type(set_list_t), intent(in) :: sets
    logical, intent(in) :: counts(:) !! which members there may be are such
    integer, intent(out) :: found    !! 0 after a mistake
    character(:), allocatable :: name
    logical :: ok

    found = 0
    call allow_no_data(reader, card)
    call name_option(reader, card, option, .true., name, ok)
    if (.not. ok) return
    found = find_set(sets, name)
    if (found == 0) then
      call report_unknown(reader, sets, option_position(card, option), name)
      return
    end if
    associate (set => sets%list(found))
      ok = set%flawed ! and that was told
      if (allocated(set%members)) ok = ok .or. any(counts(set%members))
    end associate
    if (ok) return
    call report(reader, option_position(card, option), 'there is no element to be cut: set '// &
      quoted(name)//' has none')
    found = 0
  end subroutine read_set

  !> Lines of a centre and a radius.
  subroutine read_balls(reader, card, origin, zone)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    real(wp), intent(in) :: origin(3) !! of the mesh [length]
    type(zone_t), intent(inout) :: zone
    character(*), parameter :: what(4) = [character(22) :: 'x of the centre', &
      'y of the centre', 'z of the centre', 'the radius of the ball']
    character(*), parameter :: form = 'x, y, z and radius of a ball'
    type(fields_t) :: fields
    real(wp) :: ball(4)
    integer :: i
    logical :: found, ok(4), is_first

    allocate (zone%balls(4, 0))
    is_first = .true.
    do
      call next_data_line(reader, card, fields, found, 4, form)
      if (.not. found) exit
      is_first = .false.
      do i = 1, 4
        call real_field(reader, fields, i, trim(what(i)), ball(i), ok(i))
      end do
      if (.not. all(ok)) cycle
      if (ball(4) < 0.0_wp) call report(reader, field_position(reader, fields, 4), &
        'the radius must not be negative')
      ball(:3) = ball(:3) - origin
      zone%balls = reshape([zone%balls, ball], [4, size(zone%balls, 2) + 1])
    end do
    if (is_first) call report(reader, card%position, '*REFINE needs NSET=, '// &
      'ELSET= or data lines: '//form)
  end subroutine read_balls

end module read_refinements_mod
