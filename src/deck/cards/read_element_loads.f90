!> Loads on elements: pressure on one face of each, and weight.
!>
!>     *DLOAD[, AMPLITUDE=name][, OP=MOD|NEW]
!>     TOP, P2, 12.5                  set or element, face, pressure
!>     BODY, GRAV, 9810., 0., 0., -1. set or element, acceleration, its direction
!>     , GRAV, 9810., 0., 0., -1.     the weight of all elements
!>     WHEEL, CENTRIF, 1e4, 0., 0., 0., 0., 0., 1.   square of the angular velocity, axis
!>
!> A later step that names the same set and face changes the load; so each set with a face is one
!> surface of the scene, and each set with GRAV one region, and with CENTRIF another.
module read_element_loads_mod
  use cards_mod, only: note, reader_t, report, report_missing_element
  use diagnostics_mod, only: quoted
  use fields_mod, only: any_number, field_position, fields_t, is_empty_field, limit_fields, &
    name_field, next_data_line, real_field, reference_field, reference_t
  use kinds_mod, only: i8, wp
  use loads_mod, only: gravity_t, load_step_t, pressure_t
  use mesh_draft_mod, only: axisymmetric, face_of_label, mesh_draft_t, plane_strain, &
    plane_stress, solids
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
  integer, parameter :: grav = 7, centrif = 8 !! behind the six faces
  integer, parameter :: body_force = 8, along_z = 11
  !! a force per volume: body_force + 1 along x, or away from the axis, + 2 along y, + 3 along z

  !> The element loads of the step that is being read, and the regions of the whole deck.
  type :: element_load_draft_t
    type(pressure_t), allocatable :: pressures(:)
    integer :: n_pressures = 0
    type(gravity_t), allocatable :: gravity(:)
    integer :: n_gravity = 0
    type(region_t), allocatable :: regions(:)
    integer :: n_regions = 0
    integer, allocatable :: of_set(:, :)
    !! (11, 0:n_sets) surface of the set and each face, regions of the set; 0: none yet; set 0: all
    integer, allocatable :: of_element(:, :)
    !! (11, n_elements) as above for single elements; not allocated before there is one
    integer(i8) :: work = 0
  end type element_load_draft_t

contains

  !> Begin a step without loads.
  subroutine start_element_loads(draft, model)
    type(element_load_draft_t), intent(inout) :: draft
    type(model_t), intent(in) :: model

    if (.not. allocated(draft%pressures)) then
      allocate (draft%pressures(4), draft%gravity(4), draft%regions(4))
      allocate (draft%of_set(along_z, 0:model%element_sets%n), source=0)
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

  !> *DLOAD: set or element, P1..P6, pressure; GRAV, acceleration, direction; CENTRIF, square, axis
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
    type(gravity_t) :: gravity
    integer :: label, slot(2), amplitude, index
    real(wp) :: value
    logical :: found, ok(2)

    call allow_options(reader, card)
    call read_op(reader, card, replace)
    call amplitude_option(reader, card, amplitudes, amplitude)
    do
      call next_data_line(reader, card, fields, found, any_number, '')
      if (.not. found) exit
      call read_label(reader, fields, model%mesh%plane, label)
      if (label > 0 .and. label < grav) label = face_of_label(model%mesh, label)
      call read_target(reader, model, fields, label, elements, slot, ok(1))
      if (label == 0) cycle
      if (label < grav) then
        call limit_fields(reader, fields, 3, 'a set or element, P1 to P6, a pressure')
        call real_field(reader, fields, 3, 'the pressure', value, ok(2))
        if (all(ok) .and. known_index(draft, label, slot) == 0) call check_side(reader, &
          model%mesh, elements, label, field_position(reader, fields, 2), ok(1))
      else
        call read_acceleration(reader, fields, label, model%mesh, gravity, ok(2))
        if (ok(1) .and. label <= centrif .and. known_index(draft, label, slot) == 0) call &
          check_density(reader, model, fields, elements)
      end if
      if (.not. all(ok)) cycle
      call find_index(model, elements, label, slot, surfaces, draft, index)
      if (label < grav) then
        call add_pressure(draft%pressures, draft%n_pressures, pressure_t(surface=index, &
          value=value, amplitude=amplitude))
      else
        gravity%region = index
        gravity%amplitude = amplitude
        call add_gravity(draft, gravity)
      end if
      if (draft%work > max_work) then
        call report(reader, fields%start, 'the deck loads too many elements')
        return
      end if
    end do
  end subroutine read_dload

  !> P1..P6, GRAV, CENTRIF, BX, BY, BZ or BR in the second field: 1..6, grav, centrif and so on; 0
  !> after an error.
  subroutine read_label(reader, fields, plane, label)
    type(reader_t), intent(inout) :: reader
    type(fields_t), intent(in) :: fields
    integer, intent(in) :: plane !! as of mesh_t
    integer, intent(out) :: label
    character(:), allocatable :: word, message, along
    logical :: ok

    label = 0
    call name_field(reader, fields, 2, 'P1 to P6, GRAV or CENTRIF', word, ok)
    if (.not. ok) return
    ! Of bodies of revolution z is along the axis, which is y here.
    along = 'XYZ'
    if (plane == axisymmetric) along = 'RZ'
    if (any(plane == [plane_strain, plane_stress])) along = 'XY'
    if (word == 'GRAV') then
      label = grav
    else if (word == 'CENTRIF') then
      label = centrif
    else if (len(word) == 2) then
      if (word(1:1) == 'P') label = index('123456', word(2:2))
      if (word(1:1) == 'B') label = index(along, word(2:2))
      if (word(1:1) == 'B' .and. label > 0) label = body_force + label
    end if
    if (plane /= solids .and. label > 4 .and. label < grav) then
      call report(reader, field_position(reader, fields, 2), 'elements of a plane have the '// &
        'edges P1 to P4')
      label = 0
      return
    end if
    if (label > 0) return
    message = 'only P1 to P6 (pressure on a face), GRAV (weight), CENTRIF (rotation) and BX, '// &
      'BY, BZ (force per volume; of CAX elements BR and BZ) are available, not '//quoted(word)
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
    if (label >= grav .and. is_empty_field(fields, 1)) then
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

  !> The numbers of GRAV: an acceleration and its direction; of BX: a force per volume; of CENTRIF:
  !> the square of an angular velocity, a point of the axis and its direction.
  subroutine read_acceleration(reader, fields, label, mesh, gravity, ok)
    type(reader_t), intent(inout) :: reader
    type(fields_t), intent(in) :: fields
    integer, intent(in) :: label !! grav, centrif, or of a force per volume
    type(mesh_draft_t), intent(in) :: mesh
    type(gravity_t), intent(out) :: gravity
    logical, intent(out) :: ok
    real(wp) :: size, point(3), direction(3)
    logical :: is_read(3)
    integer :: i

    if (label > body_force) then
      call limit_fields(reader, fields, 3, 'a set or element, BX, BY or BZ, a force per volume')
      call real_field(reader, fields, 3, 'the force per volume', size, ok)
      gravity%acceleration(label - body_force) = size
      return
    end if
    if (label == grav) then
      call limit_fields(reader, fields, 6, 'a set or element, GRAV, g and a direction')
      call real_field(reader, fields, 3, 'the acceleration', size, is_read(1))
      call read_direction(reader, fields, 4, 'GRAV needs a direction', direction, ok)
      if (ok) call check_direction(reader, fields, mesh%plane, direction, ok)
      ok = ok .and. is_read(1)
      gravity%acceleration = size*direction
      return
    end if
    call limit_fields(reader, fields, 9, 'a set or element, CENTRIF, the square of the angular '// &
      'velocity, a point of the axis and its direction')
    call real_field(reader, fields, 3, 'the square of the angular velocity', size, is_read(1))
    if (is_read(1) .and. size < 0.0_wp) then
      call report(reader, field_position(reader, fields, 3), 'the square of the angular '// &
        'velocity must not be negative')
      is_read(1) = .false.
    end if
    call read_vector(reader, fields, 4, 'a coordinate of the axis', point, is_read(2))
    call read_direction(reader, fields, 7, 'CENTRIF needs an axis', direction, is_read(3))
    if (all(is_read(2:))) call check_axis(reader, fields, mesh%plane, point, direction, is_read(3))
    ok = all(is_read)
    if (.not. ok) return
    do i = 1, 3
      gravity%gradient(:, i) = -size*(direction(i)*direction) ! symmetric to the bit
      gravity%gradient(i, i) = gravity%gradient(i, i) + size
    end do
    gravity%acceleration = -matmul(gravity%gradient, point - mesh%origin)
  end subroutine read_acceleration

  !> Read three numbers; a number that the deck leaves out is 0.
  subroutine read_vector(reader, fields, first, what, vector, ok)
    type(reader_t), intent(inout) :: reader
    type(fields_t), intent(in) :: fields
    integer, intent(in) :: first       !! field
    character(*), intent(in) :: what   !! each of them is
    real(wp), intent(out) :: vector(3)
    logical, intent(out) :: ok
    integer :: i
    logical :: field_ok

    vector = 0.0_wp
    ok = .true.
    do i = 1, 3
      if (is_empty_field(fields, first + i - 1)) cycle
      call real_field(reader, fields, first + i - 1, what, vector(i), field_ok)
      ok = ok .and. field_ok
    end do
  end subroutine read_vector

  !> A direction as a unit vector.
  subroutine read_direction(reader, fields, first, needed, direction, ok)
    type(reader_t), intent(inout) :: reader
    type(fields_t), intent(in) :: fields
    integer, intent(in) :: first        !! field
    character(*), intent(in) :: needed  !! in words, "GRAV needs a direction"
    real(wp), intent(out) :: direction(3)
    logical, intent(out) :: ok
    real(wp) :: largest

    call read_vector(reader, fields, first, 'a component of the direction', direction, ok)
    if (.not. ok) return
    largest = maxval(abs(direction))
    ok = largest > 0.0_wp
    if (ok) then
      direction = direction/largest
      direction = direction/norm2(direction)
    else
      call report(reader, field_position(reader, fields, first), needed// &
        ' (x, y, z) that is not zero')
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

  !> Report an axis about which plane elements would leave their plane, and bodies of revolution not
  !> remain such.
  subroutine check_axis(reader, fields, plane, point, direction, ok)
    type(reader_t), intent(inout) :: reader
    type(fields_t), intent(in) :: fields
    integer, intent(in) :: plane          !! solids, plane_strain and its kin
    real(wp), intent(in) :: point(3), direction(3)
    logical, intent(out) :: ok

    ok = plane == solids .or. .not. any(abs(direction(:2)) > 0.0_wp)
    if (plane == axisymmetric) ok = .not. any(abs([direction([1, 3]), point([1, 3])]) > 0.0_wp)
    if (.not. ok) call report(reader, field_position(reader, fields, 7), 'CPE and CPS elements '// &
      'turn about an axis along z, and CAX elements about y')
  end subroutine check_axis

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
    if (label >= grav) then
      call add_region(draft, elements)
      index = draft%n_regions
      draft%regions(index)%by_volume = label > body_force
    else
      call add_surface_of_sides(model%mesh, elements, label, surfaces, index)
    end if
    if (slot(2) > 0) then
      if (.not. allocated(draft%of_element)) then
        allocate (draft%of_element(along_z, model%mesh%n_elements), source=0)
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
        larger(i)%by_volume = draft%regions(i)%by_volume
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
