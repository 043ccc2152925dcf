!> The fields at the Gauss points of elements, a group for each type of element: entries, and how
!> each is computed.
module gauss_fields_mod
  use kinds_mod, only: wp
  use dataset_kinds_mod, only: of_long, of_real
  use text_mod, only: string_t
  use cells_mod, only: cells, computed_as
  use scene_mod, only: scene_t
  use gauss_types_mod, only: list_gauss_types, elements_of_type
  use tensor_fields_mod, only: add_tensor_fields, asked_tensors, at_gauss_points
  use output_field_mod, only: field_t, field_list_t, field_source_t, add_field, get_fields, &
    compute_field, at_start
  implicit none
  private

  public :: list_gauss_fields

contains

  !> The fields that the deck asks for, named TYPE/NAME; none where it asks for none.
  subroutine list_gauss_fields(scene, fields)
    type(scene_t), intent(in) :: scene
    type(field_t), allocatable, intent(out) :: fields(:)
    type(field_list_t) :: list
    type(string_t), allocatable :: names(:)
    integer, allocatable :: of_element(:)
    integer :: k, n, n_points

    associate (asked => scene%output, mesh => scene%mesh)
      if (asked%at_gauss_points .and. any(asked_tensors(asked))) then
        call list_gauss_types(mesh, names, of_element)
      else
        allocate (names(0))
      end if
      do k = 1, size(names)
        n = count(of_element == k)
        n_points = cells(computed_as(mesh%connectivity%cell(findloc(of_element, k, dim=1))))% &
          n_points
        call add('element_id', of_long, [n], 'number', 'ids of the elements in the deck', &
          element_id)
        call add('natural_coordinates', of_real, [3, n_points], 'number', &
          'of the points; those of a hexahedron where a linear element is computed as one', &
          natural_coordinates)
        call add_tensor_fields(list, asked_tensors(asked), names(k)%text//'/', [n_points, n], &
          at_gauss_points, [' ', ' '], k)
      end do
    end associate
    call get_fields(list, fields)

  contains

    !> One of them. (gfortran 12 does not free a text that stands in a constructor of a type, if it
    !> has no name.)
    subroutine add(name, kind, extents, quantity, description, compute)
      character(*), intent(in) :: name, quantity, description
      integer, intent(in) :: kind, extents(:)
      procedure(compute_field) :: compute
      character(:), allocatable :: path

      path = names(k)%text//'/'//name
      call add_field(list, field_t(path, kind, extents, quantity, description, at_start, &
        element_type=k, compute=compute))
    end subroutine add

  end subroutine list_gauss_fields

  subroutine element_id(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (1, elements of the type)

    associate (mesh => source%scene%mesh)
      values(1, :) = mesh%element_id(elements_of_type(mesh, source%element_type))
    end associate
  end subroutine element_id

  subroutine natural_coordinates(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (3, n_points)
    integer, allocatable :: elements(:)

    associate (mesh => source%scene%mesh)
      elements = elements_of_type(mesh, source%element_type)
      associate (cell => cells(computed_as(mesh%connectivity%cell(elements(1)))))
        values = cell%point(:, :cell%n_points)
      end associate
    end associate
  end subroutine natural_coordinates

end module gauss_fields_mod
