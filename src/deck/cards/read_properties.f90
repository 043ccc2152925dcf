!> Materials, and which element is made of which.
!>
!>     *MATERIAL, NAME=STEEL
!>     *ELASTIC
!>     210000., 0.3                  Young's modulus > 0, Poisson's ratio between -1 and 0.5
!>     *ELASTIC, TYPE=ENGINEERING CONSTANTS
!>     11000., 900., 500., 0.4, 0.4, 0.5, 800., 700., 90.
!>     *DENSITY
!>     7.8e-9
!>     *EXPANSION
!>     1.2e-5
!>     *SOLID SECTION, ELSET=BODY, MATERIAL=STEEL
module read_properties_mod
  use cards_mod, only: note, reader_t, report, report_in_field, report_missing_element
  use diagnostics_mod, only: quoted
  use name_table_mod, only: add_named, close_directory, name_table_t, find_named, find_owner, &
    open_directory
  use fields_mod, only: any_number, end_data, field_position, field_text, fields_t, &
    is_empty_field, next_data_line, real_field
  use kinds_mod, only: wp
  use connectivity_mod, only: nodes_of_element
  use mesh_draft_mod, only: refused_element, solids
  use element_types_mod, only: element_types
  use options_mod, only: allow_no_data, allow_options, card_t, choice_option, flag_option, &
    has_option, integer_option, name_option, open_card, option_position, signed_option
  use new_law_mod, only: new_law, other_law
  use orientations_mod, only: directions_at, no_orientation, orientation_t
  use read_anisotropic_mod, only: read_anisotropic
  use read_constants_mod, only: read_constants, skip_temperature
  use read_orientations_mod, only: list_orientations, orientations_t, take_orientation
  use scene_mod, only: material_t
  use sets_mod, only: find_elset, model_t
  use text_mod, only: one_of, to_text
  implicit none
  private

  public :: read_materials, read_sections, find_weights

  !> A law of *HYPERELASTIC, and its constants as Abaqus orders them.
  type :: hyperelastic_law_t
    character(18) :: name     !! its flag
    integer :: most_terms     !! the largest N; 0: it has no N
    character(13) :: computed !! the word of `new_law`
  end type hyperelastic_law_t

  type(hyperelastic_law_t), parameter :: hyperelastic_laws(*) = [ &
    hyperelastic_law_t('NEO HOOKE', 0, 'NEO HOOKE'), &
    hyperelastic_law_t('MOONEY-RIVLIN', 0, 'MOONEY-RIVLIN'), &
    hyperelastic_law_t('YEOH', 0, 'YEOH'), &
    hyperelastic_law_t('OGDEN', 3, 'OGDEN'), &
    hyperelastic_law_t('POLYNOMIAL', 1, 'MOONEY-RIVLIN'), &
    hyperelastic_law_t('REDUCED POLYNOMIAL', 3, 'YEOH')]

  !> The constants of such a law on its lines: those of the shear modulus, D1, and at most two
  !> behind it, which are 0.
  type :: constants_of_law_t
    character(6), allocatable :: symbols(:)
    integer :: last = 1, every = 1 !! those up to `last`, in steps of `every`, have the sum
    character(:), allocatable :: sum !! which is so called
    integer :: n_needed = 0 !! up to D1
  end type constants_of_law_t

contains

  !> *MATERIAL with the *ELASTIC, *HYPERELASTIC or *HYPERFOAM, the *DENSITY and *EXPANSION below it.
  subroutine read_materials(reader, materials, names)
    type(reader_t), intent(inout) :: reader
    type(material_t), allocatable, intent(out) :: materials(:)
    type(name_table_t), intent(out) :: names
    type(card_t) :: card
    character(:), allocatable :: name
    logical, allocatable :: elastic(:), dense(:), expands(:), yields(:), damps(:)
    integer :: k, n

    call open_directory(reader, 'MATERIAL', 'material', names, n)
    allocate (materials(n), elastic(n), dense(n), expands(n), yields(n), damps(n))
    yields = .false.
    elastic = .false.
    dense = .false.
    expands = .false.
    damps = .false.
    do k = 1, reader%n_cards
      select case (reader%cards(k)%keyword)
      case ('MATERIAL')
        call open_card(reader, k, card)
        call allow_options(reader, card)
        call allow_no_data(reader, card)
        call add_named(reader, card, names, name)
        materials(names%n)%name = name
      case ('ELASTIC')
        call open_card(reader, k, card)
        call find_owner(reader, names, card, elastic, n)
        if (n > 0) call read_elastic(reader, card, materials(n))
      case ('HYPERELASTIC')
        call open_card(reader, k, card)
        call find_owner(reader, names, card, elastic, n)
        if (n > 0) call read_hyperelastic(reader, card, materials(n))
      case ('HYPERFOAM')
        call open_card(reader, k, card)
        call find_owner(reader, names, card, elastic, n)
        if (n > 0) call read_hyperfoam(reader, card, materials(n))
      case ('ANISOTROPIC HYPERELASTIC', 'USER MATERIAL', 'DEFORMATION PLASTICITY')
        ! Refused: the material has a law, though not one that is read.
        if (names%n > 0) elastic(names%n) = .true.
      case ('PLASTIC')
        if (reader%cards(k)%is_refused) cycle
        call open_card(reader, k, card)
        call find_owner(reader, names, card, yields, n)
        if (n > 0) call read_yield(reader, card, materials(n))
      case ('DENSITY')
        call open_card(reader, k, card)
        call find_owner(reader, names, card, dense, n)
        if (n > 0) call read_density(reader, card, materials(n)%density)
      case ('DAMPING')
        call open_card(reader, k, card)
        call find_owner(reader, names, card, damps, n)
        if (n > 0) call read_damping(reader, card, materials(n))
      case ('EXPANSION')
        call open_card(reader, k, card)
        call find_owner(reader, names, card, expands, n)
        if (n > 0) call read_expansion(reader, card, materials(n)%expansion)
      case default
        cycle
      end select
    end do
    call close_directory(reader, names)
    do k = 1, names%n
      if (elastic(k) .or. len(names%names(k)%text) == 0) cycle
      call report_in_field(reader, names%position(k), 'material '//quoted(names%names(k)%text)// &
        ' has no *ELASTIC, *HYPERELASTIC or *HYPERFOAM')
    end do
  end subroutine read_materials

  !> The first yield stress of *PLASTIC, which is not exceeded where the material is elastic: of
  !> several temperatures the least.
  subroutine read_yield(reader, card, material)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(material_t), intent(inout) :: material
    type(fields_t) :: fields
    real(wp) :: stress, strain
    logical :: found, ok, is_first

    is_first = .true.
    do
      call next_data_line(reader, card, fields, found, any_number, '')
      if (.not. found) exit
      call real_field(reader, fields, 1, 'a yield stress', stress, ok)
      if (.not. ok) return
      strain = 0.0_wp
      if (.not. is_empty_field(fields, 2)) call real_field(reader, fields, 2, 'a plastic strain', &
        strain, ok)
      if (.not. ok) return
      if (.not. is_first .and. abs(strain) > 0.0_wp) cycle
      if (.not. stress > 0.0_wp) then
        call report(reader, fields%start, 'a yield stress must be positive, not '// &
          quoted(field_text(reader, fields, 1)))
        return
      end if
      if (is_first) material%yield = stress
      material%yield = min(material%yield, stress)
      is_first = .false.
    end do
    if (is_first) call report(reader, card%position, '*PLASTIC needs data lines: yield stress, '// &
      'plastic strain')
    call note(reader, 'material '//quoted(material%name)//' is elastic beyond its yield stress '// &
      'of '//to_text(material%yield, 4)//': --elastic')
  end subroutine read_yield

  !> *ELASTIC[, TYPE=ISOTROPIC][, LAW=SVK|NEO HOOKE]: E, nu; other types have more constants.
  subroutine read_elastic(reader, card, material)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(material_t), intent(inout) :: material
    type(fields_t) :: fields
    real(wp) :: young, poisson
    integer :: kind, law
    logical :: found, ok
    character(:), allocatable :: hint

    young = 0.0_wp
    poisson = 0.0_wp
    call allow_options(reader, card)
    law = 1
    call choice_option(reader, card, 'LAW', law, ok)
    kind = 1
    call choice_option(reader, card, 'TYPE', kind, ok)
    if (has_option(card, 'TYPE') .and. .not. ok) return ! its lines have other constants
    if (kind > 2) then
      if (has_option(card, 'LAW')) call report(reader, option_position(card, 'LAW'), 'LAW '// &
        'applies to isotropic materials: others have one law, linear between their strain and '// &
        'stress')
      call read_anisotropic(reader, card, kind/2, material%law)
      return
    end if
    call next_data_line(reader, card, fields, found, 3, 'E and nu (and one temperature)')
    if (.not. found) then
      call report(reader, card%position, '*ELASTIC needs a data line: E, nu')
      return
    end if
    call real_field(reader, fields, 1, "Young's modulus", young, ok)
    if (ok .and. young <= 0.0_wp) call report(reader, fields%start, &
      "Young's modulus must be positive, not "//quoted(field_text(reader, fields, 1)))
    call real_field(reader, fields, 2, "Poisson's ratio", poisson, ok)
    hint = ''
    if (abs(poisson - 0.5_wp) < 0.01_wp) hint = 'nearly incompressible: 0.499 or 0.4999, with '// &
      'elements of TYPE=C3D8B'
    if (ok .and. (poisson <= -1.0_wp .or. poisson >= 0.5_wp)) then
      call report(reader, field_position(reader, fields, 2), &
      "Poisson's ratio must lie between -1 and 0.5, not "//quoted(field_text(reader, fields, 2)), &
      hint)
    end if
    call skip_temperature(reader, fields, 3)
    call end_data(reader, card, fields, &
      'properties that depend on temperature are not available: one line E, nu')
    if (young > 0.0_wp .and. poisson > -1.0_wp .and. poisson < 0.5_wp) material%law = &
      new_law('ELASTIC', [young, poisson])
    if (law == 2 .and. material%law%elastic%shear > 0.0_wp) material%law = other_law(material%law)
    if (has_option(card, 'LAW')) material%law%is_open = .false.
  end subroutine read_elastic

  !> *HYPERELASTIC, law[, N=number of terms]: its constants
  subroutine read_hyperelastic(reader, card, material)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(material_t), intent(inout) :: material
    type(hyperelastic_law_t) :: law
    type(constants_of_law_t) :: of
    real(wp), allocatable :: constants(:)
    type(fields_t) :: fields
    real(wp) :: shear
    logical :: is_named(size(hyperelastic_laws)), is_read
    integer :: i, n

    is_named = .false.
    do i = 1, size(hyperelastic_laws)
      call flag_option(reader, card, trim(hyperelastic_laws(i)%name), is_named(i))
    end do
    if (card%n_options == count([has_option(card, 'N'), has_option(card, 'TEST DATA INPUT')])) then
      is_named = hyperelastic_laws%name == 'POLYNOMIAL'
    end if
    if (count(is_named) /= 1) then
      ! Options that are not known are meant for it.
      call report(reader, card%position, '*HYPERELASTIC needs one law: '// &
        one_of(hyperelastic_laws%name))
      return
    end if
    call allow_options(reader, card)
    if (has_option(card, 'TEST DATA INPUT')) return ! there are no constants, which is reported
    law = hyperelastic_laws(findloc(is_named, .true., dim=1))
    n = 1
    call integer_option(reader, card, 'N', 1, huge(1), n, is_read)
    if (has_option(card, 'N') .and. law%most_terms == 0) then
      call report(reader, option_position(card, 'N'), '*HYPERELASTIC, '//trim(law%name)// &
        ' has no N')
      return
    else if (has_option(card, 'N') .and. n > law%most_terms) then
      call report(reader, option_position(card, 'N'), '*HYPERELASTIC, '//trim(law%name)// &
        ' is available up to N='//to_text(law%most_terms))
      return
    end if
    of = constants_of(law, n)
    allocate (constants(size(of%symbols)))
    call read_constants(reader, card, of%symbols, of%n_needed, fields, constants, is_read)
    if (.not. is_read) return
    n = of%n_needed
    shear = sum(constants(:of%last:of%every))
    if (shear <= 0.0_wp .and. of%last <= of%every) then
      call report(reader, fields%start, trim(of%symbols(1))//' must be positive, not '// &
        quoted(field_text(reader, fields, 1)), 'it is '//of%sum)
    else if (shear <= 0.0_wp) then
      call report(reader, fields%start, with_plus(of%symbols(:of%last:of%every))// &
        ' must be positive, not '//to_text(shear, 3), 'it is '//of%sum)
    end if
    if (constants(n) <= 0.0_wp) call report(reader, field_position(reader, fields, n), &
      'D1 must be positive, not '//quoted(field_text(reader, fields, n)), '2/D1 is the bulk '// &
      'modulus K: an incompressible material is approached by a small D1'//as_elsewhere(shear, of))
    if (.not. (shear > 0.0_wp .and. constants(n) > 0.0_wp)) return
    if (law%computed == 'YEOH') then
      material%law = new_law('YEOH', [constants(:n - 1), spread(0.0_wp, 1, 4 - n), constants(n)])
    else
      material%law = new_law(trim(law%computed), constants(:n))
    end if
  end subroutine read_hyperelastic

  !> The constants of a law with a number of terms.
  pure type(constants_of_law_t) function constants_of(law, n_terms) result(of)
    type(hyperelastic_law_t), intent(in) :: law
    integer, intent(in) :: n_terms !! N, where the law has one
    character(6), parameter :: of_ogden(6) = ['mu1   ', 'alpha1', 'mu2   ', 'alpha2', 'mu3   ', &
      'alpha3'], of_yeoh(3) = ['C10   ', 'C20   ', 'C30   '], bulk(3) = ['D1    ', 'D2    ', &
      'D3    ']
    integer :: n

    n = n_terms
    of%sum = 'half of the shear modulus'
    select case (law%name)
    case ('NEO HOOKE')
      of%symbols = [of_yeoh(:1), bulk(:1)]
    case ('MOONEY-RIVLIN', 'POLYNOMIAL')
      of%symbols = ['C10   ', 'C01   ', 'D1    ']
      of%last = 2
    case ('OGDEN')
      of%symbols = [of_ogden(:2*n), bulk(:n)]
      of%last = 2*n
      of%every = 2
      of%sum = 'the shear modulus'
    case default
      if (law%most_terms == 0) n = 3
      of%symbols = [of_yeoh(:n), bulk(:n)]
    end select
    of%n_needed = findloc(of%symbols, bulk(1), dim=1)
  end function constants_of

  !> What CalculiX (nu = 0.475) and explicit steps of Abaqus take D1 = 0 for: K of about twenty
  !> shear moduli.
  pure function as_elsewhere(sum_of_law, of) result(text)
    real(wp), intent(in) :: sum_of_law !! of its constants, as `of%sum` says
    type(constants_of_law_t), intent(in) :: of
    character(:), allocatable :: text

    text = ''
    if (sum_of_law <= 0.0_wp) return
    text = '; D1 = '//to_text(0.1_wp/(sum_of_law*merge(1.0_wp, 2.0_wp, of%every == 2)), 3)// &
      ' makes K twenty times the shear modulus, about what CalculiX takes in place of 0'
  end function as_elsewhere

  !> "C10 + C01".
  pure function with_plus(symbols) result(text)
    character(*), intent(in) :: symbols(:)
    character(:), allocatable :: text
    integer :: i

    text = trim(symbols(1))
    do i = 2, size(symbols)
      text = text//' + '//trim(symbols(i))
    end do
  end function with_plus

  !> *HYPERFOAM[, N=1]: mu, alpha = -2, nu = 0.25
  subroutine read_hyperfoam(reader, card, material)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(material_t), intent(inout) :: material
    character(*), parameter :: taken = '*HYPERFOAM is available with N=1, alpha = -2 and nu = '// &
      "0.25: Blatz and Ko's law"
    real(wp), parameter :: rounding = 1.0e-12_wp
    type(fields_t) :: fields
    real(wp) :: constants(3)
    integer :: n
    logical :: ok

    call allow_options(reader, card)
    n = 1
    call integer_option(reader, card, 'N', 1, huge(1), n, ok)
    if (n > 1) then
      call report(reader, option_position(card, 'N'), taken)
      return
    end if
    call read_constants(reader, card, ['mu   ', 'alpha', 'nu   '], 3, fields, constants, ok)
    if (.not. ok) return
    if (abs(constants(2) + 2.0_wp) > rounding) then
      call report(reader, field_position(reader, fields, 2), taken//', not with alpha = '// &
        field_text(reader, fields, 2))
    else if (abs(constants(3) - 0.25_wp) > rounding) then
      call report(reader, field_position(reader, fields, 3), taken//', not with nu = '// &
        field_text(reader, fields, 3))
    end if
    if (constants(1) > 0.0_wp) then
      material%law = new_law('BLATZ-KO', constants(:1))
    else
      call report(reader, fields%start, 'mu must be positive, not '// &
        quoted(field_text(reader, fields, 1)), 'it is the shear modulus')
    end if
  end subroutine read_hyperfoam

  !> *DENSITY: a number greater than 0.
  subroutine read_density(reader, card, density)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    real(wp), intent(inout) :: density !! [mass/length^3]
    type(fields_t) :: fields
    logical :: found, ok

    call allow_options(reader, card)
    call next_data_line(reader, card, fields, found, 2, 'the density (and one temperature)')
    if (.not. found) then
      call report(reader, card%position, '*DENSITY needs a data line')
      return
    end if
    call real_field(reader, fields, 1, 'the density', density, ok)
    if (ok .and. density <= 0.0_wp) call report(reader, fields%start, &
      'the density must be positive, not '//quoted(field_text(reader, fields, 1)))
    call skip_temperature(reader, fields, 2)
    call end_data(reader, card, fields, &
      'a density that depends on temperature is not available: one line')
  end subroutine read_density

  !> *DAMPING[, ALPHA=number][, BETA=number]: forces by velocities, as mass and stiffness are.
  subroutine read_damping(reader, card, material)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(material_t), intent(inout) :: material

    call allow_options(reader, card)
    call allow_no_data(reader, card)
    call read_part('ALPHA', material%mass_damping)
    call read_part('BETA', material%stiffness_damping)

  contains

    subroutine read_part(name, value)
      character(*), intent(in) :: name
      real(wp), intent(inout) :: value
      logical :: ok

      if (.not. has_option(card, name)) return
      call signed_option(reader, card, name, value, ok)
      if (ok .and. value >= 0.0_wp) return
      if (ok) call report(reader, option_position(card, name), name//' of *DAMPING must not be '// &
        'negative')
      value = 0.0_wp
    end subroutine read_part

  end subroutine read_damping

  !> *EXPANSION[, TYPE=ISO][, ZERO=temperature]: a coefficient, which does not depend on the
  !> temperature: so what it counts from does not matter.
  subroutine read_expansion(reader, card, expansion)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    real(wp), intent(inout) :: expansion !! [1/temperature]
    type(fields_t) :: fields
    integer :: kind
    logical :: found, ok

    call allow_options(reader, card)
    kind = 1
    call choice_option(reader, card, 'TYPE', kind, ok)
    if (has_option(card, 'TYPE') .and. .not. ok) return ! its lines have other constants
    call next_data_line(reader, card, fields, found, 2, 'the coefficient of thermal expansion '// &
      '(and one temperature)')
    if (.not. found) then
      call report(reader, card%position, '*EXPANSION needs a data line')
      return
    end if
    call real_field(reader, fields, 1, 'the coefficient of thermal expansion', expansion, ok)
    call skip_temperature(reader, fields, 2)
    call end_data(reader, card, fields, &
      'an expansion that depends on temperature is not available: one line')
  end subroutine read_expansion

  !> *SOLID SECTION, ELSET=set, MATERIAL=name: the material of every element.
  subroutine read_sections(reader, model, names, materials, material)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(name_table_t), intent(in) :: names !! of the materials
    type(material_t), allocatable, intent(inout) :: materials(:)
    !! one with axes follows for each orientation that it has
    integer, allocatable, intent(out) :: material(:) !! (n_elements) index, 0 where there is none
    type(card_t) :: card
    type(orientations_t) :: orientations
    integer :: k, e, first, without
    logical :: any_unknown

    allocate (material(model%mesh%n_elements), source=0)
    any_unknown = .false.
    call list_orientations(reader, orientations)
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'SOLID SECTION') cycle
      call open_card(reader, k, card)
      call read_section(reader, model, card, names, materials, orientations, material, &
        any_unknown)
    end do
    associate (of => orientations%of)
      materials = [materials(:names%n), (with_axes(materials(of(1, e)), orientations%list( &
        of(2, e))), e=1, size(of, 2))]
    end associate
    call refuse_without_directions(reader, model, materials, material)
    if (orientations%names%n > 0 .and. .not. any(orientations%is_read)) call note(reader, &
      '*ORIENTATION is ignored: materials are isotropic, and stresses are written in x, y, z')
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

  !> A material along axes of its own.
  pure type(material_t) function with_axes(material, orientation)
    type(material_t), intent(in) :: material
    type(orientation_t), intent(in) :: orientation

    with_axes = material
    with_axes%orientation = orientation
  end function with_axes

  !> Report elements in whose middle no direction is radial.
  subroutine refuse_without_directions(reader, model, materials, material)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(material_t), intent(in) :: materials(:)
    integer, intent(in) :: material(:)
    integer :: e

    do e = 1, size(material)
      if (material(e) < 1) cycle
      associate (of => materials(material(e)), its => nodes_of_element( &
        model%mesh%connectivity, e))
        if (of%orientation%kind == no_orientation) cycle
        if (norm2(directions_at(of%orientation, model%mesh%origin + sum(model%mesh%coordinates(:, &
          its), dim=2)/real(size(its), wp))) > 0.0_wp) cycle
      end associate
      call report(reader, model%mesh%element_position(e), 'the middle of element '// &
        to_text(model%mesh%element_id(e))//' lies on the axis of its ORIENTATION: there no '// &
        'direction is radial')
      return
    end do
  end subroutine refuse_without_directions

  subroutine read_section(reader, model, card, names, materials, orientations, material, &
      any_unknown)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(card_t), intent(in) :: card
    type(name_table_t), intent(in) :: names
    type(material_t), intent(in) :: materials(:)
    type(orientations_t), intent(inout) :: orientations
    integer, intent(inout) :: material(:)
    logical, intent(inout) :: any_unknown !! set where the section's elements are not known
    character(:), allocatable :: name, name_of_set
    type(fields_t) :: fields
    integer :: set, this, i, e, first, n_again
    real(wp) :: thickness
    logical :: ok, found

    call allow_options(reader, card)
    call next_data_line(reader, card, fields, found, 1, 'a thickness, which is ignored')
    if (found) then
      if (.not. is_empty_field(fields, 1)) then
        call real_field(reader, fields, 1, 'a thickness, which is ignored', thickness, ok)
        if (model%mesh%plane == solids) call note(reader, 'the thickness of *SOLID SECTION '// &
          'is ignored: elements have their own')
      end if
      call end_data(reader, card, fields, '*SOLID SECTION has one data line at most')
    end if
    call find_elset(reader, card, model%element_sets, name, set)
    name_of_set = name
    if (set == 0) any_unknown = .true.
    call name_option(reader, card, 'MATERIAL', .true., name, ok)
    this = -1 ! so that the elements count as having a section
    if (ok) then
      call find_named(reader, names, option_position(card, 'MATERIAL'), name, this)
      if (this == 0) this = -1
    end if
    if (this > 0) call take_axes(reader, model, card, materials, orientations, this)
    if (set == 0) return
    if (.not. allocated(model%element_sets%list(set)%members)) return
    if (model%element_sets%list(set)%n == 0 .and. has_others(model, set)) then
      ! Lines and faces without a section are what mesh generators write beside the elements; those
      ! with one carry forces.
      call report_missing_element(reader, option_position(card, 'ELSET'), &
        'the elements of '//quoted(name_of_set)//' are bars, plates or plane elements, which '// &
        'are not available; use '//one_of(element_types%name))
      reader%lacks_elements = .true.
      any_unknown = .true.
    else if (model%element_sets%list(set)%n == 0 .and. .not. &
      model%element_sets%list(set)%flawed) then
      call note(reader, '*SOLID SECTION of the set '//quoted(name_of_set)// &
        ', which holds no solid elements')
    end if
    n_again = 0
    first = 0
    do i = 1, model%element_sets%list(set)%n
      e = model%element_sets%list(set)%members(i)
      if (material(e) > 0 .and. this > 0 .and. material(e) /= this) then
        n_again = n_again + 1
        if (n_again == 1) first = e
      end if
      material(e) = this
    end do
    if (n_again > 0) call note(reader, '*SOLID SECTION of the set '//quoted(name_of_set)// &
      ' gives elements another material than a section before, '//to_text(n_again)// &
      ', the first is element '//to_text(model%mesh%element_id(first))//': the last section counts')
  end subroutine read_section

  !> The axes of a section's material: its number becomes that of the material along them.
  subroutine take_axes(reader, model, card, materials, orientations, this)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(card_t), intent(in) :: card
    type(material_t), intent(in) :: materials(:)
    type(orientations_t), intent(inout) :: orientations
    integer, intent(inout) :: this
    character(:), allocatable :: name
    integer :: orientation, i
    logical :: ok

    if (.not. has_option(card, 'ORIENTATION')) then
      if (.not. materials(this)%law%elastic%is_isotropic) call note(reader, 'the axes 1, 2, 3 '// &
        'of material '//quoted(materials(this)%name)//' are x, y, z: its *SOLID SECTION has no '// &
        'ORIENTATION')
      return
    end if
    if (materials(this)%law%elastic%is_isotropic) then
      call note(reader, 'ORIENTATION of *SOLID SECTION is ignored: material '// &
        quoted(materials(this)%name)//' is isotropic')
      return
    end if
    call name_option(reader, card, 'ORIENTATION', .true., name, ok)
    if (.not. ok) return
    call take_orientation(reader, orientations, model%mesh%plane, option_position(card, &
      'ORIENTATION'), name, orientation)
    if (orientation == 0) return
    associate (of => orientations%of)
      do i = 1, size(of, 2)
        if (all(of(:, i) == [this, orientation])) exit
      end do
    end associate
    if (i > size(orientations%of, 2)) orientations%of = reshape([orientations%of, &
      [this, orientation]], [2, i])
    this = size(materials) + i
  end subroutine take_axes

  !> Whether a set has elements that are skipped, but for those of types that were refused.
  pure logical function has_others(model, set)
    type(model_t), intent(in) :: model
    integer, intent(in) :: set

    associate (of => model%element_sets%list(set))
      has_others = of%n_skipped > 0
      if (has_others) has_others = any(model%mesh%skipped_kind(of%skipped(:of%n_skipped)) /= &
        refused_element)
    end associate
  end function has_others

  !> Which elements have a density; one whose material is not known counts as having it.
  subroutine find_weights(materials, material, weighs)
    type(material_t), intent(in) :: materials(:)
    integer, intent(in) :: material(:)           !! (n_elements) index; < 1: not known
    logical, allocatable, intent(out) :: weighs(:)
    integer :: e

    allocate (weighs(size(material)))
    weighs = .true.
    do e = 1, size(material)
      if (material(e) > 0) weighs(e) = materials(material(e))%density > 0.0_wp
    end do
  end subroutine find_weights

end module read_properties_mod
