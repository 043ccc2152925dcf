!> How accurate the user wants the results.
!>
!>     *ACCURACY, OF=RESULTANTS, MESH=REFINE
!>     0.01                           of the largest of what it is of
!>     *ACCURACY, ESTIMATE=NO         errors of mesh and load steps are not estimated
module read_accuracy_mod
  use cards_mod, only: reader_t, report
  use controls_mod, only: accuracy_controls_t, accuracy_names, accuracy_of_energy
  use diagnostics_mod, only: quoted
  use fields_mod, only: end_data, field_position, field_text, fields_t, next_data_line, real_field
  use kinds_mod, only: wp
  use options_mod, only: allow_options, card_t, choice_option, has_option, open_only_card, &
    option_position
  implicit none
  private

  public :: read_accuracy

contains

  !> *ACCURACY
  subroutine read_accuracy(reader, accuracy)
    type(reader_t), intent(inout) :: reader
    type(accuracy_controls_t), intent(out) :: accuracy
    type(card_t) :: card
    type(fields_t) :: fields
    integer :: choice, estimate, mesh
    logical :: found, ok

    call open_only_card(reader, 'ACCURACY', card, found)
    if (.not. found) return
    call allow_options(reader, card, ['OF      ', 'MESH    ', 'ESTIMATE'])
    estimate = 1
    call choice_option(reader, card, 'ESTIMATE', ['YES', 'NO '], estimate, ok)
    accuracy%estimates = estimate == 1
    call choice_option(reader, card, 'OF', accuracy_names, choice, ok)
    if (ok) accuracy%of = choice
    mesh = 1
    call choice_option(reader, card, 'MESH', ['REFINE', 'KEEP  '], mesh, ok)
    accuracy%keeps_mesh = mesh == 2
    if (accuracy%keeps_mesh .and. accuracy%of > accuracy_of_energy) call report(reader, &
      option_position(card, 'OF'), 'on one mesh the errors of RESULTANTS and ENERGY are '// &
      'estimated, others take several: MESH=REFINE')
    if (.not. accuracy%estimates) then
      if (has_option(card, 'MESH')) call report(reader, option_position(card, 'MESH'), &
        'MESH says whether an accuracy may choose the mesh, and with ESTIMATE=NO none is asked for')
      if (has_option(card, 'OF')) call report(reader, option_position(card, 'OF'), &
        'OF says what an accuracy is of, and with ESTIMATE=NO none is asked for')
      call next_data_line(reader, card, fields, found, 1, 'no data')
      if (found) call report(reader, fields%start, &
        'with ESTIMATE=NO nobody knows whether an accuracy is reached: none can be asked for')
      return
    end if
    call read_wanted(reader, card, accuracy%wanted)
  end subroutine read_accuracy

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
    call end_data(reader, card, fields, '*ACCURACY takes one data line')
  end subroutine read_wanted

end module read_accuracy_mod
