!> The types of elements that a deck may have.
module element_types_mod
  use cells_mod, only: hexahedron_8, hexahedron_20, hexahedron_20_of_14, hexahedron_20_reduced, &
    pyramid_13, pyramid_5, tetrahedron_4, tetrahedron_10, wedge_6, wedge_15
  use mesh_mod, only: kind_c3d8, kind_c3d8b, kind_c3d8i
  implicit none
  private

  public :: element_types, plane_types, type_called, plane_type_called, taken_as, name_of_type

  type :: element_type_t
    character(6) :: name !! in decks
    integer :: kind      !! of element
    integer :: cell      !! row of the table of cells
  end type element_type_t

  type(element_type_t), parameter :: element_types(*) = [ &
    element_type_t('C3D8', kind_c3d8, hexahedron_8), &
    element_type_t('C3D8I', kind_c3d8i, hexahedron_8), &
    element_type_t('C3D8B', kind_c3d8b, hexahedron_8), &
    element_type_t('C3D6', kind_c3d8, wedge_6), &
    element_type_t('C3D5', kind_c3d8, pyramid_5), &
    element_type_t('C3D4', kind_c3d8, tetrahedron_4), &
    element_type_t('C3D10', kind_c3d8, tetrahedron_10), &
    element_type_t('C3D13', kind_c3d8, pyramid_13), &
    element_type_t('C3D15', kind_c3d8, wedge_15), &
    element_type_t('C3D20', kind_c3d8, hexahedron_20), &
    element_type_t('C3D20R', kind_c3d8, hexahedron_20_reduced)]

  !> Elements of a plane, and the solid elements that they are expanded to.
  type(element_type_t), parameter :: plane_types(*) = [ &
    element_type_t('CPE3', kind_c3d8, wedge_6), &
    element_type_t('CPE4', kind_c3d8, hexahedron_8), &
    element_type_t('CPE4I', kind_c3d8i, hexahedron_8), &
    element_type_t('CPE4B', kind_c3d8b, hexahedron_8), &
    element_type_t('CPE6', kind_c3d8, wedge_15), &
    element_type_t('CPE8', kind_c3d8, hexahedron_20), &
    element_type_t('CPE8R', kind_c3d8, hexahedron_20_reduced), &
    element_type_t('CPS3', kind_c3d8, wedge_6), &
    element_type_t('CPS4', kind_c3d8, hexahedron_8), &
    element_type_t('CPS4I', kind_c3d8i, hexahedron_8), &
    element_type_t('CPS6', kind_c3d8, wedge_15), &
    element_type_t('CPS8', kind_c3d8, hexahedron_20), &
    element_type_t('CPS8R', kind_c3d8, hexahedron_20_reduced), &
    element_type_t('CAX3', kind_c3d8, wedge_6), &
    element_type_t('CAX4', kind_c3d8, hexahedron_8), &
    element_type_t('CAX4I', kind_c3d8i, hexahedron_8), &
    element_type_t('CAX4B', kind_c3d8b, hexahedron_8), &
    element_type_t('CAX6', kind_c3d8, wedge_15), &
    element_type_t('CAX8', kind_c3d8, hexahedron_20), &
    element_type_t('CAX8R', kind_c3d8, hexahedron_20_reduced)]

contains

  !> The row of the plane type of a name; 0: there is none.
  pure integer function plane_type_called(name) result(row)
    character(*), intent(in) :: name !! upper case

    do row = size(plane_types), 1, -1
      if (plane_types(row)%name == name) return
    end do
  end function plane_type_called

  !> The row of the type of a name; 0: there is none.
  pure integer function type_called(name) result(row)
    character(*), intent(in) :: name !! upper case

    do row = size(element_types), 1, -1
      if (element_types(row)%name == name) return
    end do
  end function type_called

  !> The type that one of other programs with the same nodes is taken as, its own name where there
  !> is none: full integration in the place of one point; displacements alone in the place of hybrid
  !> and modified elements, with a mean dilatation where these have a constant pressure.
  pure function taken_as(name) result(plain)
    character(*), intent(in) :: name !! upper case
    character(:), allocatable :: plain
    integer :: last

    last = len_trim(name)
    if (last > 2) then
      if (name(last - 1:last) == 'HS') last = last - 1
    end if
    plain = name(:last)
    if (last < 4) return
    if (name(last:last) == 'H') plain = name(:last - 1)
    select case (plain)
    case ('C3D8', 'C3D8R', 'CPE4', 'CPE4R', 'CAX4', 'CAX4R')
      ! C3D8RH is what meshio writes for any hexahedron.
      if (len(plain) < last .and. name /= 'C3D8RH') then
        plain = plain(:4)//'B'
      else
        plain = plain(:4)
      end if
    case ('CPS4R')
      plain = 'CPS4'
    case ('C3D10M', 'C3D10I')
      plain = 'C3D10'
    case ('CPE6M', 'CPS6M', 'CAX6M')
      plain = plain(:4)
    case default
      continue
    end select
    if (type_called(plain) == 0 .and. plane_type_called(plain) == 0) plain = name
  end function taken_as

  !> The name of the type of an element, the first where it has several.
  pure function name_of_type(kind, cell) result(name)
    integer, intent(in) :: kind, cell
    character(:), allocatable :: name
    integer :: row, as_read

    name = ''
    as_read = merge(hexahedron_20_reduced, cell, cell == hexahedron_20_of_14)
    do row = size(element_types), 1, -1
      if (element_types(row)%kind == kind .and. element_types(row)%cell == as_read) name = &
        trim(element_types(row)%name)
    end do
  end function name_of_type

end module element_types_mod
