!> The types of elements that a mesh has, each of which has Gauss points of its own in the file.
module gauss_types_mod
  use text_mod, only: string_t, to_text
  use cells_mod, only: cells, computed_as, hexahedron_20_of_14
  use connectivity_mod, only: first_points
  use mesh_mod, only: mesh_t
  use element_types_mod, only: name_of_type
  implicit none
  private

  public :: list_gauss_types, elements_of_type, points_of_type, gauss_points_of

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

  !> The elements of a type.
  pure function elements_of_type(mesh, element_type) result(elements)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: element_type !! index into the names of list_gauss_types
    integer, allocatable :: elements(:)
    type(string_t), allocatable :: names(:)
    integer, allocatable :: of_element(:)
    integer :: e

    call list_gauss_types(mesh, names, of_element)
    elements = pack([(e, e=1, size(of_element))], of_element == element_type)
  end function elements_of_type

  !> Their Gauss points among those of all elements.
  pure function points_of_type(mesh, element_type) result(points)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: element_type !! index into the names of list_gauss_types
    integer, allocatable :: points(:)
    integer :: first(mesh%n_elements + 1), e, i, n
    integer, allocatable :: elements(:)

    elements = elements_of_type(mesh, element_type)
    first = first_points(mesh%connectivity)
    allocate (points(sum(first(elements + 1) - first(elements))))
    n = 0
    do e = 1, size(elements)
      do i = first(elements(e)), first(elements(e) + 1) - 1
        n = n + 1
        points(n) = i
      end do
    end do
  end function points_of_type

  !> Gauss points of each of some elements.
  pure function gauss_points_of(mesh, elements) result(n)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: elements(:)
    integer :: n(size(elements))

    n = cells(computed_as(mesh%connectivity%cell(elements)))%n_points
  end function gauss_points_of

end module gauss_types_mod
