!> Materials, and which element is made of which.
!>
!>     *MATERIAL, NAME=STEEL
!>     *ELASTIC
!>     210000., 0.3                  Young's modulus > 0, Poisson's ratio between -1 and 0.5
!>     *DENSITY
!>     7.8e-9
!>     *SOLID SECTION, ELSET=BODY, MATERIAL=STEEL
module read_properties_mod
  use cards_mod, only: note, reader_t, report
  use diagnostics_mod, only: guess, quoted
  use fields_mod, only: field_position, field_text, fields_t, limit_fields, next_data_line, &
    real_field
  use kinds_mod, only: wp
  use lookup_mod, only: find_name, make_name_lookup, name_lookup_t
  use options_mod, only: allow_no_data, allow_options, card_t, choice_option, name_option, &
    open_card, option_position
  use scene_mod, only: material_t
  use sets_mod, only: find_set, model_t, report_unknown
  use text_mod, only: string_t, to_text
  implicit none
  private

  public :: read_materials, read_sections

contains

  !> *MATERIAL with the *ELASTIC and *DENSITY below it.
  subroutine read_materials(reader, materials, names, lookup)
    type(reader_t), intent(inout) :: reader
    type(material_t), allocatable, intent(out) :: materials(:)
    type(string_t), allocatable, intent(out) :: names(:) !! their names, for the look-up
    type(name_lookup_t), intent(out) :: lookup
    type(card_t) :: card
    integer, allocatable :: position(:)
    logical, allocatable :: elastic(:)
    integer :: k, n, most
    logical :: ok

    most = count(reader%cards(:reader%n_cards)%keyword == 'MATERIAL')
    allocate (materials(most), names(most), position(most), elastic(most))
    elastic = .false.
    n = 0
    do k = 1, reader%n_cards
      select case (reader%cards(k)%keyword)
      case ('MATERIAL')
        call open_card(reader, k, card)
        call allow_options(reader, card, ['NAME'])
        call allow_no_data(reader, card)
        n = n + 1
        call name_option(reader, card, 'NAME', .true., names(n)%text, ok)
        materials(n)%name = names(n)%text
        position(n) = card%position
      case ('ELASTIC', 'DENSITY')
        call open_card(reader, k, card)
        if (n == 0) then
          call report(reader, card%position, '*'//card%keyword//' belongs below a *MATERIAL')
        else if (card%keyword == 'DENSITY') then
          call read_density(reader, card)
        else if (elastic(n)) then
          call report(reader, card%position, 'material '//quoted(names(n)%text)// &
            ' has its *ELASTIC already')
        else
          elastic(n) = .true.
          call read_elastic(reader, card, materials(n))
        end if
      case default
        cycle
      end select
    end do
    call make_name_lookup(names, n, lookup)
    do k = 1, n
      if (len(names(k)%text) == 0) cycle ! was reported
      if (find_name(lookup, names, names(k)%text) /= k) call report(reader, position(k), &
        'duplicate material '//quoted(names(k)%text))
      if (.not. elastic(k)) call report(reader, position(k), 'material '//quoted(names(k)%text)// &
        ' has no *ELASTIC')
    end do
  end subroutine read_materials

  !> *ELASTIC[, TYPE=ISOTROPIC]: E, nu
  subroutine read_elastic(reader, card, material)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(material_t), intent(inout) :: material
    type(fields_t) :: fields
    integer :: kind
    real(wp) :: temperature
    logical :: found, ok

    call allow_options(reader, card, ['TYPE'])
    kind = 1
    call choice_option(reader, card, 'TYPE', ['ISOTROPIC', 'ISO      '], kind, ok)
    call next_data_line(reader, card, fields, found)
    if (.not. found) then
      call report(reader, card%position, '*ELASTIC needs a data line: E, nu')
      return
    end if
    call limit_fields(reader, fields, 3, 'E and nu')
    call real_field(reader, fields, 1, "Young's modulus", material%young, ok)
    if (ok .and. material%young <= 0.0_wp) call report(reader, fields%start, &
      "Young's modulus must be positive, not "//quoted(field_text(reader, fields, 1)))
    call real_field(reader, fields, 2, "Poisson's ratio", material%poisson, ok)
    if (ok .and. (material%poisson <= -1.0_wp .or. material%poisson >= 0.5_wp)) then
      call report(reader, field_position(reader, fields, 2), &
      "Poisson's ratio must lie between -1 and 0.5, not "//quoted(field_text(reader, fields, 2)))
    end if
    if (fields%n >= 3) call real_field(reader, fields, 3, 'the temperature', temperature, ok)
    call next_data_line(reader, card, fields, found)
    if (found) call report(reader, fields%start, &
      'properties that depend on temperature are not available: one line E, nu')
  end subroutine read_elastic

  !> *DENSITY: a number. Nothing uses it while there is no gravity.
  subroutine read_density(reader, card)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(fields_t) :: fields
    real(wp) :: density, temperature
    logical :: found, ok

    call allow_options(reader, card, [character(1) ::])
    call next_data_line(reader, card, fields, found)
    if (.not. found) then
      call report(reader, card%position, '*DENSITY needs a data line')
      return
    end if
    call limit_fields(reader, fields, 2, 'the density')
    call real_field(reader, fields, 1, 'the density', density, ok)
    if (ok .and. density <= 0.0_wp) call report(reader, fields%start, &
      'the density must be positive, not '//quoted(field_text(reader, fields, 1)))
    if (fields%n >= 2) call real_field(reader, fields, 2, 'the temperature', temperature, ok)
    call note(reader, '*DENSITY is not used: no load depends on it')
  end subroutine read_density

  !> *SOLID SECTION, ELSET=set, MATERIAL=name: the material of every element.
  subroutine read_sections(reader, model, names, lookup, material)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(string_t), intent(in) :: names(:) !! of the materials
    type(name_lookup_t), intent(in) :: lookup
    integer, allocatable, intent(out) :: material(:) !! (n_elements) index, 0 where there is none
    type(card_t) :: card
    integer :: k, e, first, without
    logical :: any_unknown

    allocate (material(model%mesh%n_elements), source=0)
    any_unknown = .false.
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'SOLID SECTION') cycle
      call open_card(reader, k, card)
      call read_section(reader, model, card, names, lookup, material, any_unknown)
    end do
    ! Where a section names no known set, its elements are not the mistake.
    if (any_unknown) return
    first = 0
    without = 0
    do e = 1, size(material)
      if (material(e) /= 0) cycle
      without = without + 1
      if (first == 0) first = e
    end do
    if (without == 1) then
      call report(reader, model%mesh%element_position(first), 'element '// &
        to_text(model%mesh%element_id(first))//' has no *SOLID SECTION')
    else if (without > 1) then
      call report(reader, model%mesh%element_position(first), to_text(without)// &
        ' elements have no *SOLID SECTION, the first is element '// &
        to_text(model%mesh%element_id(first)))
    end if
  end subroutine read_sections

  subroutine read_section(reader, model, card, names, lookup, material, any_unknown)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(card_t), intent(in) :: card
    type(string_t), intent(in) :: names(:)
    type(name_lookup_t), intent(in) :: lookup
    integer, intent(inout) :: material(:)
    logical, intent(inout) :: any_unknown !! set where the section's elements are not known
    character(:), allocatable :: name
    type(fields_t) :: fields
    integer :: set, this, i, e
    real(wp) :: thickness
    logical :: ok, found

    call allow_options(reader, card, ['ELSET   ', 'MATERIAL'], ['CONTROLS   ', 'ORIENTATION'])
    call next_data_line(reader, card, fields, found)
    if (found) then
      call real_field(reader, fields, 1, 'the thickness', thickness, ok)
      call next_data_line(reader, card, fields, found)
      if (found) call report(reader, fields%start, '*SOLID SECTION takes one data line at most')
    end if
    call name_option(reader, card, 'ELSET', .true., name, ok)
    set = 0
    if (ok) then
      set = find_set(model%element_sets, name)
      if (set == 0) call report_unknown(reader, model%element_sets, &
        option_position(card, 'ELSET'), name)
    end if
    if (set == 0) any_unknown = .true.
    call name_option(reader, card, 'MATERIAL', .true., name, ok)
    this = -1 ! so that the elements count as having a section
    if (ok) then
      this = find_name(lookup, names, name)
      if (this == 0) then
        call report(reader, option_position(card, 'MATERIAL'), 'material '//quoted(name)// &
          ' is not defined', guess(name, names))
        this = -1
      end if
    end if
    if (set == 0) return
    if (.not. allocated(model%element_sets%list(set)%members)) return
    do i = 1, model%element_sets%list(set)%n
      e = model%element_sets%list(set)%members(i)
      if (material(e) > 0 .and. this > 0 .and. material(e) /= this) then
        call report(reader, card%position, 'element '//to_text(model%mesh%element_id(e))// &
          ' has a section with another material already')
        return
      end if
      material(e) = this
    end do
  end subroutine read_section

end module read_properties_mod
