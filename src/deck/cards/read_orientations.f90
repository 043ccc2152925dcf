!> The axes of materials that are not isotropic.
!>
!>     *ORIENTATION, NAME=GRAIN           rectangular, as without SYSTEM
!>     1., 1., 0.,  -1., 1., 0.           a point of axis 1, one in the plane of axes 1 and 2 (and
!>     3, 20.                             the origin); turned about axis 3 by 20 degrees
!>     *ORIENTATION, NAME=RINGS, SYSTEM=CYLINDRICAL
!>     0., 0., 0.,  0., 0., 1.            two points of the axis: radial, tangential, axial
!>     *SOLID SECTION, ELSET=BODY, MATERIAL=WOOD, ORIENTATION=GRAIN
!>
!> A card that nothing refers to is not looked at.
module read_orientations_mod
  use cards_mod, only: reader_t, report
  use diagnostics_mod, only: quoted
  use fields_mod, only: end_data, field_text, fields_t, integer_field, &
    is_empty_field, next_data_line, real_field
  use kinds_mod, only: wp
  use mesh_draft_mod, only: axisymmetric, solids
  use name_table_mod, only: add_named, close_directory, find_named, name_table_t, open_directory
  use options_mod, only: allow_options, card_t, choice_option, open_card
  use orientations_mod, only: cylindrical, has_directions, orientation_t, rectangular
  implicit none
  private

  public :: orientations_t, list_orientations, take_orientation

  !> The cards of a deck.
  type :: orientations_t
    type(name_table_t) :: names
    integer, allocatable :: card(:)
    type(orientation_t), allocatable :: list(:) !! of those that something refers to
    logical, allocatable :: is_read(:)
    integer, allocatable :: of(:, :) !! (2,n) materials with axes: material and orientation
  end type orientations_t

contains

  !> The names of all *ORIENTATION cards.
  subroutine list_orientations(reader, orientations)
    type(reader_t), intent(inout) :: reader
    type(orientations_t), intent(out) :: orientations
    type(card_t) :: card
    character(:), allocatable :: name
    integer :: k, n

    call open_directory(reader, 'ORIENTATION', 'orientation', orientations%names, n)
    allocate (orientations%card(n), orientations%list(n), orientations%is_read(n))
    orientations%is_read = .false.
    allocate (orientations%of(2, 0))
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'ORIENTATION') cycle
      call open_card(reader, k, card)
      call add_named(reader, card, orientations%names, name)
      orientations%card(orientations%names%n) = k
    end do
    call close_directory(reader, orientations%names)
  end subroutine list_orientations

  !> The orientation of a name.
  subroutine take_orientation(reader, orientations, plane, position, name, found)
    type(reader_t), intent(inout) :: reader
    type(orientations_t), intent(inout) :: orientations
    integer, intent(in) :: plane     !! solids, plane_strain and its kin
    integer, intent(in) :: position  !! where the deck uses the name
    character(*), intent(in) :: name !! upper case
    integer, intent(out) :: found    !! its index; 0: a mistake was reported

    call find_named(reader, orientations%names, position, name, found)
    if (found == 0) return
    if (orientations%is_read(found)) return
    orientations%is_read(found) = .true.
    call read_orientation(reader, orientations%card(found), plane, orientations%list(found))
  end subroutine take_orientation

  subroutine read_orientation(reader, k, plane, orientation)
    type(reader_t), intent(inout) :: reader
    integer, intent(in) :: k     !! its card
    integer, intent(in) :: plane
    type(orientation_t), intent(out) :: orientation
    character(*), parameter :: form = 'x, y, z of two points (and the origin)'
    type(card_t) :: card
    type(fields_t) :: fields
    real(wp) :: place(9)
    integer :: i, kind
    logical :: found, ok, each

    call open_card(reader, k, card)
    call allow_options(reader, card)
    kind = 1
    call choice_option(reader, card, 'SYSTEM', kind, ok)
    orientation%kind = merge(rectangular, cylindrical, kind == 1)
    kind = 1
    call choice_option(reader, card, 'DEFINITION', kind, ok)
    call next_data_line(reader, card, fields, found, 9, form)
    if (.not. found) then
      call report(reader, card%position, '*ORIENTATION needs a line with '//form)
      orientation%kind = 0
      return
    end if
    place = 0.0_wp
    ok = .true.
    do i = 1, 9
      if (i > 6 .and. is_empty_field(fields, i)) cycle
      call real_field(reader, fields, i, form, place(i), each)
      ok = ok .and. each
    end do
    orientation%a = place(:3)
    orientation%b = place(4:6)
    if (orientation%kind == rectangular) orientation%origin = place(7:)
    if (ok) call check_points(reader, fields, plane, orientation, ok)
    call next_data_line(reader, card, fields, found, 2, 'an axis (1 to 3) and an angle in degrees')
    if (found) call read_turn(reader, fields, plane, orientation, ok)
    call end_data(reader, card, fields, '*ORIENTATION has two data lines at most')
    if (.not. ok) orientation = orientation_t()
  end subroutine read_orientation

  !> Points that give no directions, or none in a plane.
  subroutine check_points(reader, fields, plane, orientation, ok)
    type(reader_t), intent(inout) :: reader
    type(fields_t), intent(in) :: fields
    integer, intent(in) :: plane
    type(orientation_t), intent(in) :: orientation
    logical, intent(inout) :: ok

    ok = has_directions(orientation)
    if (.not. ok) then
      if (orientation%kind == cylindrical) then
        call report(reader, fields%start, 'the two points are one: they give no axis')
      else
        call report(reader, fields%start, 'the two points lie on a line with the origin: the '// &
          'first gives axis 1, and the second, beside it, the plane of axes 1 and 2')
      end if
      return
    end if
    if (plane == solids) return
    associate (a => orientation%a, b => orientation%b, origin => orientation%origin)
      if (orientation%kind == rectangular) then
        ok = all(abs([a(3), b(3)] - origin(3)) <= 0.0_wp)
      else
        ok = all(abs(a(:2) - b(:2)) <= 0.0_wp) .and. plane /= axisymmetric
      end if
    end associate
    if (ok) return
    if (plane == axisymmetric) then
      call report(reader, fields%start, 'with axisymmetric elements axes 1 and 2 lie in the '// &
        'plane of the elements, and axis 3 goes around: rectangular, with points in this plane')
    else
      call report(reader, fields%start, 'with elements of a plane axis 3 is z: points with one '// &
        'z, with SYSTEM=CYLINDRICAL an axis along z')
    end if
  end subroutine check_points

  !> The axis and the angle of the second line.
  subroutine read_turn(reader, fields, plane, orientation, ok)
    type(reader_t), intent(inout) :: reader
    type(fields_t), intent(in) :: fields
    integer, intent(in) :: plane
    type(orientation_t), intent(inout) :: orientation
    logical, intent(inout) :: ok
    real(wp), parameter :: degree = acos(-1.0_wp)/180.0_wp
    real(wp) :: angle
    integer :: axis
    logical :: each

    axis = 3
    call integer_field(reader, fields, 1, 'an axis, 1 to 3', 1, axis, each)
    ok = ok .and. each
    if (each .and. axis > 3) then
      call report(reader, fields%start, 'an axis is 1, 2 or 3, not '//quoted(field_text(reader, &
        fields, 1)))
      ok = .false.
    end if
    angle = 0.0_wp
    if (.not. is_empty_field(fields, 2)) then
      call real_field(reader, fields, 2, 'an angle in degrees', angle, each)
      ok = ok .and. each
    end if
    if (.not. ok) return
    orientation%turned_about = axis
    orientation%angle = degree*angle
    if (plane == solids .or. axis == 3 .or. .not. abs(angle) > 0.0_wp) return
    call report(reader, fields%start, 'with elements of a plane axes can be turned about axis '// &
      '3 only')
    ok = .false.
  end subroutine read_turn

end module read_orientations_mod
