!> Stresses and strains in the table of fields, and what follows from them: a row of a table each,
!> and one procedure that computes them all wherever they are asked for.
module tensor_fields_mod
  use kinds_mod, only: wp
  use dataset_kinds_mod, only: of_real
  use controls_mod, only: output_controls_t
  use invariants_mod, only: von_mises, principal_values
  use step_fields_mod, only: tensor_field_t
  use gauss_types_mod, only: points_of_type
  use state_tensors_mod, only: make_tensors, make_undeformed_tensors, make_set_tensors
  use output_field_mod, only: field_t, field_list_t, field_source_t, add_field
  implicit none
  private

  public :: add_tensor_fields, asked_tensors
  public :: at_nodes, at_centroids, at_gauss_points, in_set

  ! Where numbers are asked for.
  integer, parameter :: at_nodes = 1, at_centroids = 2, at_gauss_points = 3, in_set = 4

  ! The tensors.
  integer, parameter :: stress = 1, strain = 2, pk2_stress = 3, green_strain = 4

  character(*), parameter :: order = 'XX, YY, ZZ, XY, YZ, XZ'
  character(*), parameter :: largest_first = 'the largest first'

  !> What is written of a tensor at a place: 6 components, 3 principal values, or 1 stress of von
  !> Mises.
  type :: tensor_row_t
    character(16) :: name
    integer :: tensor
    integer :: n !! numbers
    character(8) :: quantity
    character(50) :: description
  end type tensor_row_t

  integer, parameter :: n_rows = 7
  type(tensor_row_t), parameter :: rows(n_rows) = [ &
    tensor_row_t('stress', stress, 6, 'pressure', order), &
    tensor_row_t('strain', strain, 6, 'strain', order//' as tensor components'), &
    tensor_row_t('pk2_stress', pk2_stress, 6, 'pressure', 'second Piola-Kirchhoff, '//order), &
    tensor_row_t('green_strain', green_strain, 6, 'strain', order//' as tensor components'), &
    tensor_row_t('von_mises', stress, 1, 'pressure', 'von Mises stress'), &
    tensor_row_t('principal_stress', stress, 3, 'pressure', largest_first), &
    tensor_row_t('principal_strain', strain, 3, 'strain', largest_first)]

contains

  !> Which rows the deck asks for over the mesh.
  pure function asked_tensors(output) result(asked)
    type(output_controls_t), intent(in) :: output
    logical :: asked(n_rows)

    asked = [output%stress, output%strain, output%pk2_stress, output%green_strain, output%mises, &
      output%principal_stress, output%principal_strain]
  end function asked_tensors

  !> Add the fields of the rows asked for.
  subroutine add_tensor_fields(list, asked, group, extents, place, words, element_type)
    type(field_list_t), intent(inout) :: list
    logical, intent(in) :: asked(:)        !! (n_rows)
    character(*), intent(in) :: group      !! before the names
    integer, intent(in) :: extents(:)      !! of one number at each place
    integer, intent(in) :: place           !! at_nodes, ...
    character(*), intent(in) :: words(2)
    !! where components are, and what follows from them; or ' '
    integer, intent(in) :: element_type    !! of gauss_types, or 0
    type(tensor_row_t) :: row
    integer, allocatable :: of_row(:)
    character(:), allocatable :: name, quantity, description
    ! (gfortran 12 does not free a text that stands in a constructor of a type, if it has no name.)
    integer :: k

    do k = 1, n_rows
      if (.not. asked(k)) cycle
      row = rows(k)
      of_row = extents
      if (row%n > 1) of_row = [row%n, extents]
      name = group//trim(row%name)
      quantity = trim(row%quantity)
      ! (UBSan reports a trimmed blank text as a null pointer.)
      description = trim(trim(row%description)//words(merge(1, 2, row%n == 6)))
      call add_field(list, field_t(name, of_real, of_row, quantity, description, &
        element_type=element_type, tensor_row=k, place=place, compute=compute_tensor))
    end do
  end subroutine add_tensor_fields

  subroutine compute_tensor(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :)

    select case (rows(source%tensor_row)%tensor)
    case (stress)
      if (source%place == in_set) then
        call make_set_tensors(source)
        call fill(source%set_stress, values)
      else
        call make_tensors(source)
        call fill_at_place(source%stress)
      end if
    case (strain)
      if (source%place == in_set) then
        call make_set_tensors(source)
        call fill(source%set_strain, values)
      else
        call make_tensors(source)
        call fill_at_place(source%strain)
      end if
    case (pk2_stress)
      call make_undeformed_tensors(source)
      call fill_at_place(source%pk2)
    case (green_strain)
      call make_undeformed_tensors(source)
      call fill_at_place(source%green)
    case default
      continue
    end select

  contains

    subroutine fill_at_place(field)
      type(tensor_field_t), intent(in) :: field

      select case (source%place)
      case (at_nodes)
        call fill(field%at_nodes(:, :size(values, 2)), values)
      case (at_centroids)
        call fill(field%at_centroids, values)
      case default
        call fill(field%at_gauss_points(:, points_of_type(source%scene%mesh, &
          source%element_type)), values)
      end select
    end subroutine fill_at_place

    !> The numbers of the row, of each tensor, whatever the shape of what is filled.
    subroutine fill(tensor, numbers)
      real(wp), intent(in) :: tensor(:, :) !! (6, places)
      real(wp), intent(inout) :: numbers(rows(source%tensor_row)%n, size(tensor, 2))

      select case (size(numbers, 1))
      case (6)
        numbers = tensor
      case (3)
        call principal_values(tensor, numbers)
      case default
        numbers(1, :) = von_mises(tensor)
      end select
    end subroutine fill

  end subroutine compute_tensor

end module tensor_fields_mod
