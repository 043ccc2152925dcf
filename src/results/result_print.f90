!> The groups /print/<number> of a result file: what *NODE PRINT and *EL PRINT name.
module result_print_mod
  use kinds_mod, only: i8
  use errors_mod, only: error_t
  use text_mod, only: to_text
  use controls_mod, only: print_t
  use scene_mod, only: scene_t
  use output_field_mod, only: field_t, field_source_t
  use print_fields_mod, only: list_print_fields
  use hdf5_files_mod, only: hdf5_file_t
  use hdf5_attributes_mod, only: write_attribute, describe_group
  use result_fields_mod, only: open_field_t, open_group, append_fields
  implicit none
  private

  public :: print_rows_t, create_prints, append_prints

  character(*), parameter :: print_group = '/print'

  !> The open datasets of a set.
  type :: print_rows_t
    character(:), allocatable :: path !! of its group
    type(print_t) :: asked
    type(open_field_t), allocatable, private :: fields(:)
  end type print_rows_t

contains

  !> Make a group for each set, in the order of the deck, and write what does not change.
  subroutine create_prints(file, scene, n_rows, prints, error)
    type(hdf5_file_t), intent(in) :: file
    type(scene_t), intent(in), target :: scene
    integer, intent(in) :: n_rows !! that the file has already, of a run that is continued
    type(print_rows_t), allocatable, intent(out) :: prints(:)
    type(error_t), allocatable, intent(inout) :: error
    type(field_source_t) :: source
    type(field_t), allocatable :: fields(:)
    integer :: k

    if (.not. allocated(scene%output%prints)) then
      allocate (prints(0))
      return
    end if
    allocate (prints(size(scene%output%prints)))
    call describe_group(file, print_group, 'a group a set of nodes or elements', error)
    source%scene => scene
    do k = 1, size(prints)
      if (allocated(error)) return
      prints(k)%path = print_group//'/'//to_text(k)
      prints(k)%asked = scene%output%prints(k)
      source%print = k
      call describe_group(file, prints(k)%path, 'a row an increment', error)
      call write_attribute(file, prints(k)%path, 'set', prints(k)%asked%set, error)
      call list_print_fields(scene, k, fields)
      call open_group(file, prints(k)%path, fields, source, n_rows, prints(k)%fields, error)
    end do
  end subroutine create_prints

  !> Append a row to every set.
  subroutine append_prints(prints, source, checksum, error)
    type(print_rows_t), intent(inout) :: prints(:)
    type(field_source_t), intent(inout) :: source !! of the increment
    integer(i8), intent(inout) :: checksum !! of the increment, to which that of every row is added
    type(error_t), allocatable, intent(inout) :: error
    integer :: k

    do k = 1, size(prints)
      source%print = k
      call append_fields(prints(k)%fields, source, checksum, error)
    end do
  end subroutine append_prints

end module result_print_mod
