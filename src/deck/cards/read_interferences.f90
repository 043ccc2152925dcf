!> Overlaps that pairs may have for a time.
!>
!>     *CONTACT INTERFERENCE[, AMPLITUDE=name][, OP=MOD|NEW]
!>     RING-IN, HUB-OUT, 0.02         slave, master, interference
!>     *CONTACT INTERFERENCE, SHRINK
!>     RING-IN, HUB-OUT               slave, master
module read_interferences_mod
  use cards_mod, only: note, reader_t, report
  use diagnostics_mod, only: quoted
  use fields_mod, only: field_position, fields_t, is_empty_field, name_field, next_data_line, &
    real_field
  use loads_mod, only: interference_t, load_step_t
  use options_mod, only: allow_options, card_t, choice_option, flag_option, has_option, &
    option_position
  use read_amplitudes_mod, only: amplitude_list_t, amplitude_option
  use read_gaps_mod, only: find_pair
  use read_loads_mod, only: read_op
  use scene_mod, only: contact_pair_t
  implicit none
  private

  public :: read_interference

contains

  !> *CONTACT INTERFERENCE of a step.
  subroutine read_interference(reader, card, amplitudes, pairs, is_first, step)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(amplitude_list_t), intent(in) :: amplitudes
    type(contact_pair_t), intent(in) :: pairs(:)
    logical, intent(in) :: is_first            !! of the steps
    type(load_step_t), intent(inout) :: step
    type(fields_t) :: fields
    type(interference_t) :: read
    character(:), allocatable :: slave, master
    logical :: found, ok(3)
    integer :: choice

    call allow_options(reader, card)
    choice = 1
    call choice_option(reader, card, 'TYPE', choice, ok(1))
    call read_op(reader, card, step%replace_interferences)
    call amplitude_option(reader, card, amplitudes, read%amplitude)
    call flag_option(reader, card, 'SHRINK', read%shrinks)
    if (read%shrinks .and. .not. is_first) call report(reader, option_position(card, 'SHRINK'), &
      'SHRINK belongs in the first *STEP: later ones begin with overlaps that are gone')
    if (read%shrinks .and. has_option(card, 'AMPLITUDE')) then
      call note(reader, 'AMPLITUDE of *CONTACT INTERFERENCE, SHRINK is ignored: overlaps go '// &
        'linearly over the step')
      read%amplitude = 0
    end if
    if (.not. allocated(step%interferences)) allocate (step%interferences(0))
    do
      call next_data_line(reader, card, fields, found, 6, 'a slave surface, a master, and how '// &
        'far they may overlap')
      if (.not. found) exit
      call name_field(reader, fields, 1, 'a slave surface', slave, ok(1))
      call name_field(reader, fields, 2, 'a master', master, ok(2))
      ok(3) = .true.
      if (.not. read%shrinks) then
        call real_field(reader, fields, 3, 'how far they may overlap (or SHRINK)', read%value, &
          ok(3))
      else if (.not. is_empty_field(fields, 3)) then
        call note(reader, 'the value of *CONTACT INTERFERENCE, SHRINK is ignored: each node '// &
          'has the overlap of the mesh (*CLEARANCE with a negative VALUE= gives one)')
      end if
      if (.not. all([is_empty_field(fields, 4), is_empty_field(fields, 5), is_empty_field(fields, &
        6)])) call report(reader, field_position(reader, fields, 4), 'a direction of the '// &
        'interference is not available: it acts along the contact normal; leave x, y, z out')
      if (.not. all(ok)) cycle
      call find_pair(reader, pairs, slave, master, field_position(reader, fields, 1), read%pair)
      if (read%pair == 0) cycle
      if (any(step%interferences%pair == read%pair)) then
        call report(reader, fields%start, 'contact pair '//quoted(pairs(read%pair)%name)// &
          ' has a *CONTACT INTERFERENCE in this step already')
        cycle
      end if
      step%interferences = [step%interferences, read]
    end do
  end subroutine read_interference

end module read_interferences_mod
