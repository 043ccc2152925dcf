!> Loads on elements: pressure on one face of each, and weight.
!>
!>     *DLOAD[, AMPLITUDE=name][, OP=MOD|NEW]
!>     TOP, P2, 12.5                  set or element, face, pressure
!>     BODY, GRAV, 9810., 0., 0., -1. set or element, acceleration, its direction
!>     , GRAV, 9810., 0., 0., -1.     the weight of all elements
!>
!> A later step that names the same set and face changes the load; so each set with a face is one
!> surface of the scene, and each set with GRAV one region.
module read_element_loads_mod
  use cards_mod, only: note, reader_t, report, report_missing_element
  use diagnostics_mod, only: quoted
  use fields_mod, only: any_number, field_position, fields_t, is_empty_field, limit_fields, &
    name_field, next_data_line, real_field, reference_field, reference_t
  use kinds_mod, only: i8, wp
  use loads_mod, only: gravity_t, load_step_t, pressure_t
  use mesh_draft_mod, only: axisymmetric, face_of_label, solids
  use options_mod, only: allow_options, card_t
  use read_amplitudes_mod, only: amplitude_list_t, amplitude_option
  use read_loads_mod, only: add_pressure, read_op
  use surface_list_mod, only: add_surface_of_sides, check_side, surface_list_t
  use scene_mod, only: region_t
  use sets_mod, only: find_set, model_t, referenced_elements
  use text_mod, only: to_text
  implicit none
  private

  public :: element_load_draft_t, start_element_loads, close_element_loads, read_dload

  !> Faces and elements named by all lines of a deck together: more than any real deck needs.
  integer(i8), parameter :: max_work = 100000000
  integer, parameter :: grav = 7 !! behind the six faces

  !> The element loads of the step that is being read, and the regions of the whole deck.
  type :: element_load_draft_t
    type(pressure_t), allocatable :: pressures(:)
    integer :: n_pressures = 0
    type(gravity_t), allocatable :: gravity(:)
    integer :: n_gravity = 0
    type(region_t), allocatable :: regions(:)
    integer :: n_regions = 0
    integer, allocatable :: of_set(:, :)
    !! (7, 0:n_sets) surface of the set and each face, region of the set; 0: none yet; set 0: all
    integer, allocatable :: of_element(:, :)
    !! (7, n_elements) as above for single elements; not allocated before there is one
    integer(i8) :: work = 0
  end type element_load_draft_t

contains

  !> Begin a step without loads.
  subroutine start_element_loads(draft, model)
    type(element_load_draft_t), intent(inout) :: draft
    type(model_t), intent(in) :: model

    if (.not. allocated(draft%pressures)) then
      allocate (draft%pressures(4), draft%gravity(4), draft%regions(4))
      allocate (draft%of_set(grav, 0:model%element_sets%n), source=0)
    end if
    draft%n_pressures = 0
    draft%n_gravity = 0
  end subroutine start_element_loads

  !> Hand the loads of the step over.
  subroutine close_element_loads(draft, step)
    type(element_load_draft_t), intent(in) :: draft
    type(load_step_t), intent(inout) :: step

    step%face_pressures = draft%pressures(:draft%n_pressures)
    step%gravity = draft%gravity(:draft%n_gravity)
  end subroutine close_element_loads

  !> *DLOAD: set or element, P1..P6, pressure, or set or element, GRAV, acceleration, direction
  subroutine read_dload(reader, card, model, amplitudes, surfaces, draft, replace)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(model_t), intent(in) :: model
    type(amplitude_list_t), intent(in) :: amplitudes
    type(surface_list_t), intent(inout) :: surfaces !! those of loaded faces are added
    type(element_load_draft_t), intent(inout) :: draft
    logical, intent(inout) :: replace !! set by OP=NEW
    type(fields_t) :: fields
    integer, allocatable :: elements(:)
    integer :: label, slot(2), amplitude, index
    real(wp) :: value, direction(3)
    logical :: found, ok(3)

    call allow_options(reader, card, ['AMPLITUDE ', 'TIME DELAY', 'OP        '])
    call read_op(reader, card, replace)
    call amplitude_option(reader, card, amplitudes, amplitude)
    do
      call next_data_line(reader, card, fields, found, any_number, '')
      if (.not. found) exit
      call read_label(reader, fields, model%mesh%plane /= solids, label)
      if (label > 0 .and. label /= grav) label = face_of_label(model%mesh, label)
      call read_target(reader, model, fields, label, elements, slot, ok(1))
      if (label == 0) cycle
      ok(3) = .true.
      if (label == grav) then
        call limit_fields(reader, fields, 6, 'a set or element, GRAV, g and a direction')
        call real_field(reader, fields, 3, 'the acceleration', value, ok(2))
        call read_direction(reader, fields, direction, ok(3))
        if (ok(3)) call check_direction(reader, fields, model%mesh%plane, direction, ok(3))
        if (ok(1) .and. known_index(draft, label, slot) == 0) then
          call check_density(reader, model, fields, elements)
        end if
      else
        call limit_fields(reader, fields, 3, 'a set or element, P1 to P6, a pressure')
        call real_field(reader, fields, 3, 'the pressure', value, ok(2))
      end if
      if (.not. all(ok)) cycle
      if (label /= grav .and. known_index(draft, label, slot) == 0) then
        call check_side(reader, model%mesh, elements, label, field_position(reader, fields, 2), &
          ok(1))
        if (.not. ok(1)) cycle
      end if
      call find_index(model, elements, label, slot, surfaces, draft, index)
      if (label == grav) then
        call add_gravity(draft, gravity_t(region=index, acceleration=value*direction, &
          amplitude=amplitude))
      else
        call add_pressure(draft%pressures, draft%n_pressures, pressure_t(surface=index, &
          value=value, amplitude=amplitude))
      end if
      if (draft%work > max_work) then
        call report(reader, fields%start, 'the deck loads too many elements')
        return
      end if
    end do
  end subroutine read_dload

  !> P1..P6 or GRAV in the second field: 1..6, grav; 0 after a mistake.
  subroutine read_label(reader, fields, of_plane, label)
    type(reader_t), intent(inout) :: reader
    type(fields_t), intent(in) :: fields
    logical, intent(in) :: of_plane !! elements have edges in the place of faces
    integer, intent(out) :: label
    character(:), allocatable :: word, message
    logical :: ok

    label = 0
    call name_field(reader, fields, 2, 'P1 to P6 or GRAV', word, ok)
    if (.not. ok) return
    if (word == 'GRAV') then
      label = grav
    else if (len(word) == 2) then
      if (word(1:1) == 'P') label = index('123456', word(2:2))
    end if
    if (of_plane .and. label > 4 .and. label < grav) then
      call report(reader, field_position(reader, fields, 2), 'elements of a plane have the '// &
        'edges P1 to P4')
      label = 0
      return
    end if
    if (label > 0) return
    message = 'only P1 to P6 (pressure on a face) and GRAV (weight) are available, not '// &
      quoted(word)
    ! Pressures have other names on elements that were refused, shells for instance.
    if (word(1:1) == 'P') then
      call report_missing_element(reader, field_position(reader, fields, 2), message)
    else
      call report(reader, field_position(reader, fields, 2), message)
    end if
  end subroutine read_label

  !> The elements that the first field means, and where their surface or region is kept.
  subroutine read_target(reader, model, fields, label, elements, slot, ok)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(fields_t), intent(in) :: fields
    integer, intent(in) :: label
    integer, allocatable, intent(out) :: elements(:)
    integer, intent(out) :: slot(2)      !! set (0: all elements), element (0: none)
    logical, intent(out) :: ok           !! false: nothing is loaded
    type(reference_t) :: reference
    logical :: flawed
    integer :: i, before

    slot = 0
    if (label == grav .and. is_empty_field(fields, 1)) then
      elements = [(i, i=1, model%mesh%n_elements)]
      ok = size(elements) > 0
      return
    end if
    call reference_field(reader, fields, 1, 'an element or a set of elements', reference, ok)
    allocate (elements(0))
    if (.not. ok) return
    before = reader%diagnostics%n_mistakes
    flawed = .false.
    call referenced_elements(reader, model, reference, elements, flawed)
    ok = size(elements) > 0
    if (ok .and. reference%id > 0) then
      slot(2) = elements(1)
    else if (ok) then
      slot(1) = find_set(model%element_sets, reference%name)
    else if (reader%diagnostics%n_mistakes > before .or. flawed) then
      return
    else if (model%mesh%taken_out) then
      call note(reader, 'loads on elements that are not in the deck are ignored')
    else if (reference%id > 0) then
      call report_missing_element(reader, reference%position, 'element '//to_text(reference%id)// &
        ' is skipped: only solid elements are loaded')
    else
      call report_missing_element(reader, reference%position, 'set '//quoted(reference%name)// &
        ' holds no solid elements')
    end if
  end subroutine read_target

  !> The direction of GRAV as a unit vector; components that are left out are 0.
  subroutine read_direction(reader, fields, direction, ok)
    type(reader_t), intent(inout) :: reader
    type(fields_t), intent(in) :: fields
    real(wp), intent(out) :: direction(3)
    logical, intent(out) :: ok
    integer :: i
    real(wp) :: largest
    logical :: field_ok

    direction = 0.0_wp
    ok = .true.
    do i = 1, 3
      if (is_empty_field(fields, 3 + i)) cycle
      call real_field(reader, fields, 3 + i, 'a component of the direction', direction(i), field_ok)
      ok = ok .and. field_ok
    end do
    if (.not. ok) return
    largest = maxval(abs(direction))
    ok = largest > 0.0_wp
    if (ok) then
      direction = direction/largest
      direction = direction/norm2(direction)
    else
      call report(reader, field_position(reader, fields, 4), &
        'GRAV needs a direction (x, y, z) that is not zero')
    end if
  end subroutine read_direction

  !> Report weight that would leave the plane of plane elements, or no body of revolution.
  subroutine check_direction(reader, fields, plane, direction, ok)
    type(reader_t), intent(inout) :: reader
    type(fields_t), intent(in) :: fields
    integer, intent(in) :: plane          !! solids, plane_strain and its kin
    real(wp), intent(in) :: direction(3)
    logical, intent(out) :: ok

    ok = plane == solids .or. .not. abs(direction(3)) > 0.0_wp
    if (plane == axisymmetric) ok = ok .and. .not. abs(direction(1)) > 0.0_wp
    if (ok) return
    call report(reader, field_position(reader, fields, 4), 'weight acts within the plane of '// &
      'CPE and CPS elements, and along y on CAX elements')
  end subroutine check_direction

  !> Report the first element without a density.
  subroutine check_density(reader, model, fields, elements)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(fields_t), intent(in) :: fields
    integer, intent(in) :: elements(:)
    integer :: i

    do i = 1, size(elements)
      if (model%weighs(elements(i))) cycle
      call report(reader, fields%start, 'element '//to_text(model%mesh%element_id(elements(i)))// &
        ' has no weight: its material has no *DENSITY')
      return
    end do
  end subroutine check_density

  !> The surface or region of a load, made where it is the first.
  subroutine find_index(model, elements, label, slot, surfaces, draft, index)
    type(model_t), intent(in) :: model
    integer, intent(in) :: elements(:)
    integer, intent(in) :: label
    integer, intent(in) :: slot(2)
    type(surface_list_t), intent(inout) :: surfaces
    type(element_load_draft_t), intent(inout) :: draft
    integer, intent(out) :: index

    index = known_index(draft, label, slot)
    if (index > 0) return
    draft%work = draft%work + size(elements)
    if (draft%work > max_work) return
    if (label == grav) then
      call add_region(draft, elements)
      index = draft%n_regions
    else
      call add_surface_of_sides(model%mesh, elements, label, surfaces, index)
    end if
    if (slot(2) > 0) then
      if (.not. allocated(draft%of_element)) then
        allocate (draft%of_element(grav, model%mesh%n_elements), source=0)
      end if
      draft%of_element(label, slot(2)) = index
    else
      draft%of_set(label, slot(1)) = index
    end if
  end subroutine find_index

  !> The surface or region of a load that was there before; 0 without one.
  pure integer function known_index(draft, label, slot) result(index)
    type(element_load_draft_t), intent(in) :: draft
    integer, intent(in) :: label
    integer, intent(in) :: slot(2)

    index = 0
    if (slot(2) == 0) then
      index = draft%of_set(label, slot(1))
    else if (allocated(draft%of_element)) then
      index = draft%of_element(label, slot(2))
    end if
  end function known_index

  subroutine add_region(draft, elements)
    type(element_load_draft_t), intent(inout) :: draft
    integer, intent(in) :: elements(:)
    type(region_t), allocatable :: larger(:)
    integer :: i

    if (draft%n_regions == size(draft%regions)) then
      allocate (larger(2*draft%n_regions))
      do i = 1, draft%n_regions
        call move_alloc(draft%regions(i)%elements, larger(i)%elements)
      end do
      call move_alloc(larger, draft%regions)
    end if
    draft%n_regions = draft%n_regions + 1
    draft%regions(draft%n_regions)%elements = elements
  end subroutine add_region

  subroutine add_gravity(draft, gravity)
    type(element_load_draft_t), intent(inout) :: draft
    type(gravity_t), intent(in) :: gravity

    if (draft%n_gravity == size(draft%gravity)) draft%gravity = [draft%gravity, draft%gravity]
    draft%n_gravity = draft%n_gravity + 1
    draft%gravity(draft%n_gravity) = gravity
  end subroutine add_gravity

end module read_element_loads_mod
