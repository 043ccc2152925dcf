!> The fields at the Gauss points of elements, a group for each type of element: entries, and how
!> each is computed.
module gauss_fields_mod
  use kinds_mod, only: wp
  use dataset_kinds_mod, only: of_long, of_real
  use text_mod, only: string_t, to_text
  use cells_mod, only: cells, computed_as, hexahedron_20_of_14
  use connectivity_mod, only: first_points
  use mesh_mod, only: mesh_t
  use element_types_mod, only: name_of_type
  use scene_mod, only: scene_t
  use invariants_mod, only: von_mises, principal_values
  use state_tensors_mod, only: make_tensors, make_undeformed_tensors
  use output_field_mod, only: field_t, field_list_t, field_source_t, add_field, get_fields, &
    compute_field, every_time, at_start
  implicit none
  private

  public :: list_gauss_fields, list_gauss_types

  character(*), parameter :: tensor_order = 'XX, YY, ZZ, XY, YZ, XZ'
  character(*), parameter :: as_components = ' as tensor components'
  character(*), parameter :: largest_first = 'the largest first'

contains

  !> The names of the types of elements that a mesh has, in the order of the deck. Elements C3D20R
  !> of 14 points, which the program chooses itself, are a type of their own.
  pure subroutine list_gauss_types(mesh, names, of_element)
    type(mesh_t), intent(in) :: mesh
    type(string_t), allocatable, intent(out) :: names(:)
    integer, allocatable, intent(out) :: of_element(:) !! (n_elements) index into `names`
    integer :: e, k, n
    integer, allocatable :: kind(:), cell(:)

    n = 0
    allocate (kind(0), cell(0), of_element(mesh%n_elements))
    do e = 1, mesh%n_elements
      associate (its_kind => mesh%element_kind(e), its_cell => mesh%connectivity%cell(e))
        do k = 1, n
          if (kind(k) == its_kind .and. cell(k) == its_cell) exit
        end do
        if (k > n) then
          kind = [kind, its_kind]
          cell = [cell, its_cell]
          n = k
        end if
        of_element(e) = k
      end associate
    end do
    allocate (names(n))
    do k = 1, n
      names(k)%text = name_of_type(kind(k), cell(k))
      if (cell(k) == hexahedron_20_of_14) names(k)%text = names(k)%text//'_'// &
        to_text(cells(cell(k))%n_points)
    end do
  end subroutine list_gauss_types

  !> The fields that the deck asks for, named TYPE/NAME; none where it asks for none.
  subroutine list_gauss_fields(scene, fields)
    type(scene_t), intent(in) :: scene
    type(field_t), allocatable, intent(out) :: fields(:)
    type(field_list_t) :: list
    type(string_t), allocatable :: names(:)
    integer, allocatable :: of_element(:)
    integer :: k, n, n_points

    associate (asked => scene%output, mesh => scene%mesh)
      if (asked%at_gauss_points .and. any([asked%stress, asked%strain, asked%pk2_stress, &
        asked%green_strain, asked%mises, asked%principal_stress, asked%principal_strain])) then
        call list_gauss_types(mesh, names, of_element)
      else
        allocate (names(0))
      end if
      do k = 1, size(names)
        n = count(of_element == k)
        n_points = cells(computed_as(mesh%connectivity%cell(findloc(of_element, k, dim=1))))% &
          n_points
        call add('element_id', of_long, [n], 'number', 'ids of the elements in the deck', &
          at_start, element_id)
        call add('natural_coordinates', of_real, [3, n_points], 'number', &
          'of the points; those of a hexahedron where a linear element is computed as one', &
          at_start, natural_coordinates)
        if (asked%stress) call at_points('stress', 6, 'pressure', tensor_order, stress)
        if (asked%strain) call at_points('strain', 6, 'strain', tensor_order//as_components, &
          strain)
        if (asked%pk2_stress) call at_points('pk2_stress', 6, 'pressure', &
          'second Piola-Kirchhoff, '//tensor_order, pk2_stress)
        if (asked%green_strain) call at_points('green_strain', 6, 'strain', &
          tensor_order//as_components, green_strain)
        if (asked%mises) call at_points('von_mises', 1, 'pressure', 'von Mises stress', mises)
        if (asked%principal_stress) call at_points('principal_stress', 3, 'pressure', &
          largest_first, principal_stress)
        if (asked%principal_strain) call at_points('principal_strain', 3, 'strain', &
          largest_first, principal_strain)
      end do
    end associate
    call get_fields(list, fields)

  contains

    !> A field at the points, of m numbers each.
    subroutine at_points(name, m, quantity, description, compute)
      character(*), intent(in) :: name, quantity, description
      integer, intent(in) :: m
      procedure(compute_field) :: compute
      integer, allocatable :: extents(:)

      extents = [n_points, n]
      if (m > 1) extents = [m, n_points, n]
      call add(name, of_real, extents, quantity, description, every_time, compute)
    end subroutine at_points

    !> One of them. (gfortran 12 does not free a text that stands in a constructor of a type, if it
    !> has no name.)
    subroutine add(name, kind, extents, quantity, description, written, compute)
      character(*), intent(in) :: name, quantity, description
      integer, intent(in) :: kind, extents(:), written
      procedure(compute_field) :: compute
      character(:), allocatable :: path

      path = names(k)%text//'/'//name
      call add_field(list, field_t(path, kind, extents, quantity, description, written, &
        element_type=k, compute=compute))
    end subroutine add

  end subroutine list_gauss_fields

  subroutine element_id(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (1, elements of the type)

    values(1, :) = source%scene%mesh%element_id(elements_of(source))
  end subroutine element_id

  subroutine natural_coordinates(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (3, n_points)
    integer, allocatable :: elements(:)

    elements = elements_of(source)
    associate (cell => cells(computed_as(source%scene%mesh%connectivity%cell(elements(1)))))
      values = cell%point(:, :cell%n_points)
    end associate
  end subroutine natural_coordinates

  subroutine stress(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (6 n_points, elements of the type)

    call make_tensors(source)
    values = reshape(source%stress%at_gauss_points(:, points_of(source)), shape(values))
  end subroutine stress

  subroutine strain(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (6 n_points, elements of the type)

    call make_tensors(source)
    values = reshape(source%strain%at_gauss_points(:, points_of(source)), shape(values))
  end subroutine strain

  subroutine pk2_stress(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (6 n_points, elements of the type)

    call make_undeformed_tensors(source)
    values = reshape(source%pk2%at_gauss_points(:, points_of(source)), shape(values))
  end subroutine pk2_stress

  subroutine green_strain(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (6 n_points, elements of the type)

    call make_undeformed_tensors(source)
    values = reshape(source%green%at_gauss_points(:, points_of(source)), shape(values))
  end subroutine green_strain

  subroutine mises(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (n_points, elements of the type)

    call make_tensors(source)
    values = reshape(von_mises(source%stress%at_gauss_points(:, points_of(source))), &
      shape(values))
  end subroutine mises

  subroutine principal_stress(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (3 n_points, elements of the type)

    call make_tensors(source)
    call fill_principal(source%stress%at_gauss_points(:, points_of(source)), values)
  end subroutine principal_stress

  subroutine principal_strain(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (3 n_points, elements of the type)

    call make_tensors(source)
    call fill_principal(source%strain%at_gauss_points(:, points_of(source)), values)
  end subroutine principal_strain

  subroutine fill_principal(tensor, values)
    real(wp), intent(in) :: tensor(:, :)    !! (6, places)
    real(wp), intent(inout) :: values(:, :)
    real(wp), allocatable :: principal(:, :)

    allocate (principal(3, size(tensor, 2)))
    call principal_values(tensor, principal)
    values = reshape(principal, shape(values))
  end subroutine fill_principal

  !> The elements of the type whose fields are computed.
  pure function elements_of(source) result(elements)
    type(field_source_t), intent(in) :: source
    integer, allocatable :: elements(:)
    type(string_t), allocatable :: names(:)
    integer, allocatable :: of_element(:)
    integer :: e

    call list_gauss_types(source%scene%mesh, names, of_element)
    elements = pack([(e, e=1, size(of_element))], of_element == source%element_type)
  end function elements_of

  !> Their Gauss points among those of all elements.
  pure function points_of(source) result(points)
    type(field_source_t), intent(in) :: source
    integer, allocatable :: points(:)
    integer :: first(source%scene%mesh%n_elements + 1), e, i, n
    integer, allocatable :: elements(:)

    elements = elements_of(source)
    first = first_points(source%scene%mesh%connectivity)
    allocate (points(sum(first(elements + 1) - first(elements))))
    n = 0
    do e = 1, size(elements)
      do i = first(elements(e)), first(elements(e) + 1) - 1
        n = n + 1
        points(n) = i
      end do
    end do
  end function points_of

end module gauss_fields_mod
