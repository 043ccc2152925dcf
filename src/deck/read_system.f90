!> The axes in which the lines of *NODE are written.
!>
!>     *SYSTEM                           until the next one; without a line: x, y, z again
!>     0., 0., 0.,  1., 1., 0.           origin, a point of its x axis
module read_system_mod
  use cards_mod, only: reader_t, report
  use fields_mod, only: end_data, fields_t, is_empty_field, next_data_line, real_field
  use kinds_mod, only: wp
  use options_mod, only: allow_options, card_t
  use read_mesh_mod, only: system_t
  use small_matrix_mod, only: cross
  implicit none
  private

  public :: read_system, read_point

contains

  !> *SYSTEM: origin, a point of the x axis; a point of the half plane of x and y
  subroutine read_system(reader, card, system)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(system_t), intent(out) :: system
    type(fields_t) :: fields
    real(wp) :: origin(3), along(3), beside(3), axis(3, 3)
    logical :: found, ok

    call allow_options(reader, card)
    call next_data_line(reader, card, fields, found, 6, 'an origin and a point of the x axis')
    if (.not. found) return
    call read_point(reader, fields, 1, origin, ok)
    if (.not. ok) return
    system%origin = origin
    system%is_set = .true.
    if (fields%n < 4) return
    call read_point(reader, fields, 4, along, ok)
    if (.not. ok) return
    axis(:, 1) = along - origin
    beside = cross([0.0_wp, 0.0_wp, 1.0_wp], axis(:, 1))
    call next_data_line(reader, card, fields, found, 3, 'a point of the half plane of x and y')
    if (found) then
      call read_point(reader, fields, 1, beside, ok)
      if (.not. ok) return
      beside = beside - origin
      call end_data(reader, card, fields, '*SYSTEM has two data lines')
    else if (abs(along(3) - origin(3)) > 0.0_wp) then
      call report(reader, card%position, '*SYSTEM whose x axis leaves the xy plane needs a '// &
        'second line: a point of its half plane of x and y')
      return
    end if
    axis(:, 3) = cross(axis(:, 1), beside)
    axis(:, 2) = cross(axis(:, 3), axis(:, 1))
    if (.not. all(norm2(axis, dim=1) > 0.0_wp)) then
      call report(reader, card%position, 'the points of *SYSTEM are on a line')
      return
    end if
    system%axis = axis/spread(norm2(axis, dim=1), 1, 3)
  end subroutine read_system

  !> Three coordinates; what is left out is 0.
  subroutine read_point(reader, fields, first, x, ok)
    type(reader_t), intent(inout) :: reader
    type(fields_t), intent(in) :: fields
    integer, intent(in) :: first !! field
    real(wp), intent(out) :: x(3)
    logical, intent(out) :: ok
    integer :: i
    logical :: read_well

    x = 0.0_wp
    ok = .true.
    do i = 1, 3
      if (is_empty_field(fields, first + i - 1)) cycle
      call real_field(reader, fields, first + i - 1, 'a coordinate', x(i), read_well)
      ok = ok .and. read_well
    end do
  end subroutine read_point

end module read_system_mod
