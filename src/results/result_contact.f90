!> The groups /contact/<pair> of a result file.
module result_contact_mod
  use kinds_mod, only: i8
  use errors_mod, only: error_t
  use text_mod, only: string_t
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use output_field_mod, only: field_t, field_source_t
  use pair_fields_mod, only: list_pair_fields
  use hdf5_files_mod, only: hdf5_file_t
  use hdf5_attributes_mod, only: write_attribute, describe_group
  use result_fields_mod, only: open_field_t, open_group, append_fields, free_path
  implicit none
  private

  public :: pair_rows_t, create_contact, append_contact, pair_groups, groups_of_pairs

  !> The open datasets of a pair.
  type :: pair_rows_t
    private
    character(:), allocatable :: path
    integer :: first = 1, last = 0    !! its points
    type(open_field_t), allocatable :: fields(:)
  end type pair_rows_t

contains

  !> Make a group for each pair, in their order, and write what does not change.
  subroutine create_contact(file, scene, points, n_rows, pairs, error)
    type(hdf5_file_t), intent(in) :: file
    type(scene_t), intent(in), target :: scene
    type(contact_points_t), intent(in), target :: points
    integer, intent(in) :: n_rows !! that the file has already, of a run that is continued
    type(pair_rows_t), allocatable, intent(out) :: pairs(:)
    type(error_t), allocatable, intent(out) :: error
    type(field_source_t) :: source
    type(field_t), allocatable :: fields(:)
    type(string_t), allocatable :: groups(:)
    integer :: i

    allocate (groups(0))
    groups = groups_of_pairs(scene)
    allocate (pairs(size(groups)))
    call describe_group(file, '/contact', 'a group a contact pair, named '// &
                        '<slave surface>:<master>', error)
    source%scene => scene
    source%points => points
    do i = 1, size(pairs)
      if (allocated(error)) return
      if (points%n > 0) then
        pairs(i)%first = points%first(i)
        pairs(i)%last = points%first(i + 1) - 1
      end if
      pairs(i)%path = groups(i)%text
      source%pair = i
      source%first = pairs(i)%first
      source%last = pairs(i)%last
      call list_pair_fields(scene, i, source%last - source%first + 1, fields)
      call describe_group(file, pairs(i)%path, 'a row an increment; local components are '// &
        'along n, t1, t2', error)
      call open_group(file, pairs(i)%path, fields, source, n_rows, pairs(i)%fields, error)
      call write_attribute(file, pairs(i)%path, 'friction_coefficient', scene%pairs(i)%mu, error)
    end do
  end subroutine create_contact

  !> The paths of the groups of a scene's pairs, in their order.
  pure function groups_of_pairs(scene) result(groups)
    type(scene_t), intent(in) :: scene
    type(string_t), allocatable :: groups(:)
    integer :: i, n_pairs

    n_pairs = 0
    if (allocated(scene%pairs)) n_pairs = size(scene%pairs)
    allocate (groups(n_pairs))
    do i = 1, n_pairs
      groups(i)%text = free_path('/contact/', scene%pairs(i)%name, groups(:i - 1))
    end do
  end function groups_of_pairs

  !> The paths of the pairs' groups.
  pure subroutine pair_groups(pairs, groups)
    type(pair_rows_t), intent(in) :: pairs(:)
    type(string_t), allocatable, intent(out) :: groups(:)
    integer :: i

    allocate (groups(size(pairs)))
    do i = 1, size(pairs)
      groups(i)%text = pairs(i)%path
    end do
  end subroutine pair_groups

  !> Append a row to every pair.
  subroutine append_contact(pairs, source, checksum, error)
    type(pair_rows_t), intent(inout) :: pairs(:)
    type(field_source_t), intent(inout) :: source !! of the increment
    integer(i8), intent(inout) :: checksum !! of the increment, to which that of every row is added
    type(error_t), allocatable, intent(inout) :: error
    integer :: i

    do i = 1, size(pairs)
      source%pair = i
      source%first = pairs(i)%first
      source%last = pairs(i)%last
      call append_fields(pairs(i)%fields, source, checksum, error)
    end do
  end subroutine append_contact

end module result_contact_mod
