!> Friction: what *SURFACE INTERACTION and *FRICTION say, and what a pair takes from them.
!>
!>     *SURFACE INTERACTION, NAME=DRY
!>     *FRICTION
!>     0.3
module read_interactions_mod
  use cards_mod, only: note, reader_t, report
  use diagnostics_mod, only: quoted
  use name_table_mod, only: add_named, close_directory, name_table_t, find_owner, open_directory
  use fields_mod, only: end_data, field_position, field_text, fields_t, is_empty_field, &
    next_data_line, real_field
  use friction_laws_mod, only: friction_law_t
  use kinds_mod, only: wp
  use options_mod, only: allow_no_data, allow_options, card_t, flag_option, has_option, open_card, &
    option_position, real_option
  use read_surface_behavior_mod, only: is_tied, stays_closed
  use scene_mod, only: contact_pair_t
  use text_mod, only: to_text
  implicit none
  private

  public :: interactions_t, read_interactions, read_friction, take_interaction

  !> The *SURFACE INTERACTIONs.
  type :: interactions_t
    type(name_table_t) :: names
    real(wp), allocatable :: mu(:) !! friction coefficient of each, the largest [-]
    type(friction_law_t), allocatable :: law(:) !! of each, what pressure makes of it
  end type interactions_t

  real(wp), parameter :: mu_of_rough = 1.0e3_wp !! [-]

contains

  !> *SURFACE INTERACTION, NAME=name with the *FRICTION below it: mu.
  subroutine read_interactions(reader, interactions)
    type(reader_t), intent(inout) :: reader
    type(interactions_t), intent(out) :: interactions
    type(card_t) :: card
    logical, allocatable :: has_friction(:)
    character(:), allocatable :: name
    integer :: k, n

    call open_directory(reader, 'SURFACE INTERACTION', 'surface interaction', interactions%names, n)
    allocate (interactions%mu(n), source=0.0_wp)
    allocate (interactions%law(n))
    allocate (has_friction(n), source=.false.)
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword == 'SURFACE INTERACTION') then
        call open_card(reader, k, card)
        call allow_options(reader, card)
        call add_named(reader, card, interactions%names, name)
        call skip_thickness(reader, card)
      else if (reader%cards(k)%keyword == 'FRICTION') then
        if (k > 1) then
          if (reader%cards(k - 1)%keyword == 'CHANGE FRICTION') cycle
        end if
        call open_card(reader, k, card)
        call find_owner(reader, interactions%names, card, has_friction, n)
        if (n > 0) call read_friction(reader, card, interactions%mu(n), interactions%law(n))
      end if
    end do
    call close_directory(reader, interactions%names)
  end subroutine read_interactions

  !> What a pair takes from its interaction.
  subroutine take_interaction(reader, interactions, interaction, pair)
    type(reader_t), intent(inout) :: reader
    type(interactions_t), intent(in) :: interactions
    integer, intent(in) :: interaction       !! its index
    type(contact_pair_t), intent(inout) :: pair

    pair%mu = interactions%mu(interaction)
    pair%law = interactions%law(interaction)
    pair%interaction = interactions%names%names(interaction)%text
    pair%no_separation = stays_closed(reader, pair%interaction)
    if (is_tied(reader, pair%interaction)) return
    if (pair%no_separation .and. pair%mu >= mu_of_rough) call note(reader, &
      '*FRICTION, ROUGH holds what presses; if NO SEPARATION lets it pull a surface '// &
      'slides. *TIE holds both')
  end subroutine take_interaction

  !> Abaqus writes a line with a thickness below *SURFACE INTERACTION.
  subroutine skip_thickness(reader, card)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(fields_t) :: fields
    real(wp) :: thickness
    logical :: found, ok

    call next_data_line(reader, card, fields, found, 1, 'a thickness, which is ignored')
    if (.not. found) return
    if (.not. is_empty_field(fields, 1)) then
      call real_field(reader, fields, 1, 'a thickness, which is ignored', thickness, ok)
      call note(reader, 'the thickness of *SURFACE INTERACTION is ignored')
    end if
    call end_data(reader, card, fields, '*SURFACE INTERACTION has one data line at most')
  end subroutine skip_thickness

  !> *FRICTION[, TAUMAX=stress]: mu[, stick slope]; or a line a pressure, mu, , pressure; with
  !> EXPONENTIAL DECAY mu at rest, mu of fast slip, decay.
  subroutine read_friction(reader, card, mu, law)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    real(wp), intent(inout) :: mu             !! the largest [-]
    type(friction_law_t), intent(out) :: law  !! what pressure makes of it
    type(fields_t) :: fields
    real(wp), allocatable :: coefficient(:), pressure(:)
    real(wp) :: most
    logical :: found, ok, is_rough, has_most, falls

    call allow_options(reader, card, 'USER')
    if (has_option(card, 'USER')) then
      call report(reader, option_position(card, 'USER'), '*FRICTION, USER is not available', &
        'friction is Coulomb''s: mu on a line of its own, *CHANGE FRICTION for later steps')
      return
    end if
    is_rough = .false.
    call flag_option(reader, card, 'ROUGH', is_rough)
    call real_option(reader, card, 'TAUMAX', huge(1.0_wp), most, has_most)
    if (is_rough) then
      if (has_most) call report(reader, option_position(card, 'TAUMAX'), &
        'what is ROUGH has no largest friction: leave out ROUGH or TAUMAX')
      mu = mu_of_rough
      call note(reader, '*FRICTION, ROUGH is a friction coefficient of '//to_text(mu)// &
        ': what touches sticks')
      call allow_no_data(reader, card)
      return
    end if
    falls = .false.
    call flag_option(reader, card, 'EXPONENTIAL DECAY', falls)
    if (falls) then
      if (has_most) call report(reader, option_position(card, 'TAUMAX'), 'TAUMAX and '// &
        'EXPONENTIAL DECAY of *FRICTION are not available together')
      call read_decay(reader, card, mu, law)
      return
    end if
    allocate (coefficient(0), pressure(0))
    do
      call next_data_line(reader, card, fields, found, 4, 'mu (and a stick slope, which is '// &
        'ignored), a pressure where mu depends on it, and a temperature, which is ignored')
      if (.not. found) exit
      call read_coefficient(reader, fields, coefficient, pressure, ok)
      if (.not. ok) return
    end do
    if (size(coefficient) == 0) then
      call report(reader, card%position, '*FRICTION needs a data line: mu')
      return
    end if
    mu = maxval(coefficient)
    if (.not. mu > 0.0_wp) return
    if (has_most .and. most < huge(1.0_wp)*min(1.0_wp, mu)) law%most = most/mu
    if (size(coefficient) == 1) return
    law%pressure = pressure
    law%share = coefficient/mu
    if (falls_off(coefficient, pressure)) call note(reader, 'the coefficients of *FRICTION '// &
      'fall so steeply that friction gets smaller where the pressure grows: there may be more '// &
      'than one solution')
  end subroutine read_friction

  !> The line of *FRICTION, EXPONENTIAL DECAY.
  subroutine read_decay(reader, card, mu, law)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    real(wp), intent(inout) :: mu             !! at rest [-]
    type(friction_law_t), intent(inout) :: law
    character(*), parameter :: form = 'mu at rest, mu of fast slip, decay over the rate of slip'
    type(fields_t) :: fields
    real(wp) :: numbers(3)
    logical :: found, ok, each
    integer :: i

    call next_data_line(reader, card, fields, found, 3, form)
    if (.not. found) then
      call report(reader, card%position, '*FRICTION, EXPONENTIAL DECAY needs a data line: '// &
        form)
      return
    end if
    ok = .true.
    do i = 1, 3
      call real_field(reader, fields, i, form, numbers(i), each)
      if (each .and. numbers(i) < 0.0_wp) then
        call report(reader, field_position(reader, fields, i), 'the numbers of *FRICTION must '// &
          'not be negative: '//quoted(field_text(reader, fields, i)))
        each = .false.
      end if
      ok = ok .and. each
    end do
    call end_data(reader, card, fields, '*FRICTION, EXPONENTIAL DECAY has one data line')
    if (.not. ok) return
    if (numbers(2) > numbers(1)) then
      call report(reader, field_position(reader, fields, 2), 'mu of fast slip must not be more '// &
        'than mu at rest, '//quoted(field_text(reader, fields, 1)))
      return
    end if
    mu = numbers(1)
    if (.not. mu > 0.0_wp) return
    law%kinetic = numbers(2)/mu
    law%decay = numbers(3)
    call note(reader, 'EXPONENTIAL DECAY of *FRICTION: the rate of slip is that of an '// &
      'increment over its part of the time of the *STEP, 1 where *STATIC gives none')
  end subroutine read_decay

  !> A line of *FRICTION, the next of a table.
  subroutine read_coefficient(reader, fields, coefficient, pressure, ok)
    type(reader_t), intent(inout) :: reader
    type(fields_t), intent(in) :: fields
    real(wp), allocatable, intent(inout) :: coefficient(:) !! [-]
    real(wp), allocatable, intent(inout) :: pressure(:)    !! [force/length^2]
    logical, intent(out) :: ok
    real(wp) :: mu, p, other
    logical :: is_number

    mu = 0.0_wp
    p = 0.0_wp
    call real_field(reader, fields, 1, 'the friction coefficient', mu, ok)
    if (mu < 0.0_wp) then
      call report(reader, fields%start, 'the friction coefficient must not be negative: '// &
        quoted(field_text(reader, fields, 1)))
      ok = .false.
    end if
    if (.not. is_empty_field(fields, 2)) then
      if (ok .and. abs(mu) <= 0.0_wp) call report(reader, field_position(reader, fields, 2), &
        'a stick slope without friction: '//quoted(field_text(reader, fields, 2)), &
        'use a decimal point, not a comma: 0.3')
      call real_field(reader, fields, 2, 'the stick slope', other, is_number)
      call note(reader, 'the stick slope of *FRICTION is ignored: sticking is exact')
    end if
    if (.not. is_empty_field(fields, 3)) then
      call real_field(reader, fields, 3, 'a pressure', p, is_number)
      ok = ok .and. is_number
      if (is_number .and. p < 0.0_wp) then
        call report(reader, field_position(reader, fields, 3), 'the pressure must not be '// &
          'negative: '//quoted(field_text(reader, fields, 3)))
        ok = .false.
      end if
    else if (size(coefficient) > 0) then
      call report(reader, fields%start, 'a second line of *FRICTION needs a pressure: mu, '// &
        'nothing, pressure')
      ok = .false.
    end if
    if (.not. is_empty_field(fields, 4)) then
      call real_field(reader, fields, 4, 'a temperature, which is ignored', other, is_number)
      call note(reader, 'the temperature of *FRICTION is ignored: friction does not depend on it')
    end if
    if (ok .and. size(pressure) > 0) then
      ok = p > pressure(size(pressure))
      if (.not. ok) call report(reader, field_position(reader, fields, 3), 'the pressures of '// &
        '*FRICTION must rise from line to line: '//quoted(field_text(reader, fields, 3)))
    end if
    if (.not. ok) return
    coefficient = [coefficient, mu]
    pressure = [pressure, p]
  end subroutine read_coefficient

  !> Whether mu p gets smaller somewhere as p grows: what is straight in mu falls most at the end of
  !> a piece.
  pure logical function falls_off(mu, p)
    real(wp), intent(in) :: mu(:), p(:) !! (n) [-], [force/length^2]
    integer :: i

    falls_off = .false.
    do i = 2, size(mu)
      falls_off = falls_off .or. mu(i) + p(i)*(mu(i) - mu(i - 1))/(p(i) - p(i - 1)) < 0.0_wp
    end do
  end function falls_off

end module read_interactions_mod
