!> Attributes of the groups and datasets of an open file.
module hdf5_attributes_mod
  use, intrinsic :: iso_c_binding, only: c_ptr, c_loc, c_char
  use hdf5, only: hid_t, hsize_t, size_t, h5aclose_f, h5acreate_f, h5aexists_f, h5aget_space_f, &
    h5aget_type_f, h5aopen_f, h5aread_f, h5awrite_f, h5oclose_f, h5oopen_f, h5sclose_f, &
    h5sget_simple_extent_npoints_f, h5tclose_f, h5tget_size_f, h5tis_variable_str_f
  use dataset_kinds_mod, only: of_real, of_long
  use errors_mod, only: error_t
  use hdf5_failures_mod, only: fail, text_of
  use hdf5_files_mod, only: hdf5_file_t, create_group, exists, fail_to_read, flush_object
  use hdf5_types_mod, only: no_id, type_in_file, type_in_memory, text_type, is_text, &
    new_space
  use kinds_mod, only: wp, i8
  use text_mod, only: string_t
  implicit none
  private

  public :: write_attribute, write_attributes, write_and_flush, read_attribute, describe, &
    describe_group

  integer, parameter :: longest_attribute = 60000 !! the classic format ends at 64 KiB

  !> Write an attribute, or write it again: `write_attribute(file, object, name, value, error)`.
  interface write_attribute
    module procedure write_text_attribute, write_long_attribute, write_longs_attribute, &
                     write_real_attribute, write_texts_attribute
  end interface write_attribute

  !> Read an attribute: `read_attribute(file, object, name, value, error)`.
  interface read_attribute
    module procedure read_text_attribute, read_long_attribute, read_real_attribute
  end interface read_attribute

contains

  !> A text is stored with its own length; written again, it is cut or padded to the first one's.
  subroutine write_text_attribute(file, object, name, value, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: object !! path of a group or dataset
    character(*), intent(in) :: name
    character(*), intent(in) :: value  !! ASCII
    type(error_t), allocatable, intent(inout) :: error
    integer :: length
    character(c_char), target :: bytes(max(1, min(len(value), longest_attribute)))

    if (allocated(error)) return
    length = min(len(value), longest_attribute)
    bytes = achar(0)
    bytes(:length) = transfer(value(:length), bytes, length)
    call put_text(file, object, name, c_loc(bytes), [size(bytes)], error)
  end subroutine write_text_attribute

  !> Texts of one common length, padded with blanks.
  subroutine write_texts_attribute(file, object, name, value, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: object
    character(*), intent(in) :: name
    type(string_t), intent(in) :: value(:)
    type(error_t), allocatable, intent(inout) :: error
    character(c_char), allocatable, target :: bytes(:, :)
    integer :: i, k, width

    if (allocated(error)) return
    width = 1
    do i = 1, size(value)
      width = max(width, len(value(i)%text))
    end do
    allocate (bytes(width, max(1, size(value))), source=achar(0))
    do i = 1, size(value)
      do k = 1, len(value(i)%text)
        bytes(k, i) = value(i)%text(k:k)
      end do
    end do
    call put_text(file, object, name, c_loc(bytes), [width, size(value)], error)
  end subroutine write_texts_attribute

  subroutine write_long_attribute(file, object, name, value, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: object, name
    integer(i8), intent(in), target :: value
    type(error_t), allocatable, intent(inout) :: error

    call put_attribute(file, object, name, of_long, c_loc(value), [integer ::], error)
  end subroutine write_long_attribute

  !> Write a whole number again and hand it, it alone, to the operating system.
  subroutine write_and_flush(file, object, name, value, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: object, name
    integer(i8), intent(in) :: value
    type(error_t), allocatable, intent(inout) :: error
    integer(i8), target :: copy

    if (allocated(error)) return
    copy = value
    call put(file, object, name, [type_in_file(of_long), type_in_memory(of_long)], c_loc(copy), &
      [integer ::], error, flushed=.true.)
  end subroutine write_and_flush

  !> Write several whole numbers of an object, each an attribute of its own.
  subroutine write_attributes(file, object, names, values, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: object, names(:)
    integer(i8), intent(in) :: values(:)
    type(error_t), allocatable, intent(inout) :: error
    integer(i8), target :: copy(size(values))
    integer(hid_t) :: object_id
    integer :: i, status, ignored

    if (allocated(error)) return
    copy = values
    call h5oopen_f(file%id, object, object_id, status)
    if (status < 0) object_id = no_id
    do i = 1, size(values)
      call put_in(object_id, trim(names(i)), [type_in_file(of_long), type_in_memory(of_long)], &
        c_loc(copy(i)), [integer ::], status)
      if (status < 0) call fail_to_put(error, file, object, trim(names(i)))
      if (allocated(error)) exit
    end do
    if (object_id /= no_id) call h5oclose_f(object_id, ignored)
  end subroutine write_attributes

  subroutine write_longs_attribute(file, object, name, value, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: object, name
    integer(i8), intent(in), contiguous, target :: value(:)
    type(error_t), allocatable, intent(inout) :: error

    call put_attribute(file, object, name, of_long, c_loc(value), shape(value), error)
  end subroutine write_longs_attribute

  subroutine write_real_attribute(file, object, name, value, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: object, name
    real(wp), intent(in), target :: value
    type(error_t), allocatable, intent(inout) :: error

    call put_attribute(file, object, name, of_real, c_loc(value), [integer ::], error)
  end subroutine write_real_attribute

  subroutine put_text(file, object, name, address, extents, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: object, name
    type(c_ptr), intent(in) :: address
    integer, intent(in) :: extents(:) !! length of a text[, number of texts]
    type(error_t), allocatable, intent(inout) :: error
    integer(hid_t) :: type_id
    integer :: ignored

    type_id = text_type(extents(1), ascii=.true.)
    call put(file, object, name, [type_id, type_id], address, extents(2:), error, &
      flushed=.false.)
    call h5tclose_f(type_id, ignored)
  end subroutine put_text

  subroutine put_attribute(file, object, name, kind, address, extents, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: object, name
    integer, intent(in) :: kind       !! of_real, ...
    type(c_ptr), intent(in) :: address
    integer, intent(in) :: extents(:) !! none: a scalar
    type(error_t), allocatable, intent(inout) :: error

    if (allocated(error)) return
    call put(file, object, name, [type_in_file(kind), type_in_memory(kind)], address, extents, &
      error, flushed=.false.)
  end subroutine put_attribute

  subroutine put(file, object, name, types, address, extents, error, flushed)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: object, name
    integer(hid_t), intent(in) :: types(2) !! in the file, in memory
    type(c_ptr), intent(in) :: address
    integer, intent(in) :: extents(:)
    type(error_t), allocatable, intent(inout) :: error
    logical, intent(in) :: flushed !! at once, with all of the object
    integer(hid_t) :: object_id
    integer :: status, ignored

    if (allocated(error)) return
    ! The object first, then its attribute: h5aopen_by_name_f fails for writing.
    call h5oopen_f(file%id, object, object_id, status)
    if (status < 0) object_id = no_id
    call put_in(object_id, name, types, address, extents, status)
    if (status < 0) call fail_to_put(error, file, object, name)
    if (flushed) call flush_object(file, object, object_id, error)
    if (object_id /= no_id) call h5oclose_f(object_id, ignored)
  end subroutine put

  !> An attribute of an object that is open.
  subroutine put_in(object_id, name, types, address, extents, status)
    integer(hid_t), intent(in) :: object_id !! no_id: nothing is done
    character(*), intent(in) :: name
    integer(hid_t), intent(in) :: types(2)  !! in the file, in memory
    type(c_ptr), intent(in) :: address
    integer, intent(in) :: extents(:)
    integer, intent(out) :: status          !! negative: not written
    integer(hid_t) :: attribute
    integer :: ignored
    logical :: there

    status = -1
    if (object_id == no_id) return
    attribute = no_id
    call h5aexists_f(object_id, name, there, status)
    if (status >= 0 .and. there) call h5aopen_f(object_id, name, attribute, status)
    if (status >= 0 .and. .not. there) then
      call new_attribute(object_id, name, types(1), extents, attribute, status)
    end if
    if (status >= 0) call h5awrite_f(attribute, types(2), address, status)
    if (attribute /= no_id) call h5aclose_f(attribute, ignored)
  end subroutine put_in

  subroutine fail_to_put(error, file, object, name)
    type(error_t), allocatable, intent(inout) :: error
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: object, name

    call fail(error, "cannot write the attribute '"//name//"' of '"//object//"' in '"// &
      file%path//"'")
  end subroutine fail_to_put

  subroutine new_attribute(object, name, type_id, extents, attribute, status)
    integer(hid_t), intent(in) :: object, type_id
    character(*), intent(in) :: name
    integer, intent(in) :: extents(:)
    integer(hid_t), intent(out) :: attribute
    integer, intent(out) :: status
    integer(hid_t) :: space
    integer :: ignored

    attribute = no_id
    space = new_space(int(extents, hsize_t))
    call h5acreate_f(object, name, type_id, space, attribute, status)
    if (status < 0) attribute = no_id
    ! The space stays open after a failure: closing it would clear the reason.
    if (status >= 0) call h5sclose_f(space, ignored)
  end subroutine new_attribute

  subroutine read_text_attribute(file, object, name, value, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: object, name
    character(:), allocatable, intent(out) :: value !! without what it was padded with
    type(error_t), allocatable, intent(inout) :: error
    character(c_char), allocatable, target :: bytes(:)
    integer(hid_t) :: attribute, type_id, object_id
    integer(size_t) :: length
    integer :: status, ignored
    logical :: variable, single
    type(c_ptr) :: address

    value = ''
    if (allocated(error)) return
    call open_attribute(file, object, name, object_id, attribute, status)
    type_id = no_id
    if (status >= 0) call h5aget_type_f(attribute, type_id, status)
    if (status >= 0) call h5tis_variable_str_f(type_id, variable, status)
    if (status >= 0) then
      single = is_single(attribute)
      if (.not. is_text(type_id) .or. variable .or. .not. single) status = -1
    end if
    if (status >= 0) call h5tget_size_f(type_id, length, status)
    if (status >= 0) then
      allocate (bytes(length))
      address = c_loc(bytes)
      call h5aread_f(attribute, type_id, address, status)
      if (status >= 0) value = text_of(bytes)
    end if
    if (status < 0) call fail_to_read(error, file, object, name)
    if (type_id /= no_id) call h5tclose_f(type_id, ignored)
    call close_attribute(object_id, attribute)
  end subroutine read_text_attribute

  subroutine read_long_attribute(file, object, name, value, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: object, name
    integer(i8), intent(out), target :: value
    type(error_t), allocatable, intent(inout) :: error

    value = 0
    call get_attribute(file, object, name, of_long, c_loc(value), error)
  end subroutine read_long_attribute

  subroutine read_real_attribute(file, object, name, value, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: object, name
    real(wp), intent(out), target :: value
    type(error_t), allocatable, intent(inout) :: error

    value = 0.0_wp
    call get_attribute(file, object, name, of_real, c_loc(value), error)
  end subroutine read_real_attribute

  subroutine get_attribute(file, object, name, kind, address, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: object, name
    integer, intent(in) :: kind
    type(c_ptr), intent(in) :: address
    type(error_t), allocatable, intent(inout) :: error
    integer(hid_t) :: attribute, object_id
    integer :: status
    type(c_ptr) :: buffer

    if (allocated(error)) return
    call open_attribute(file, object, name, object_id, attribute, status)
    if (status >= 0) then
      if (.not. is_single(attribute)) status = -1
    end if
    buffer = address
    if (status >= 0) call h5aread_f(attribute, type_in_memory(kind), buffer, status)
    if (status < 0) call fail_to_read(error, file, object, name)
    call close_attribute(object_id, attribute)
  end subroutine get_attribute

  subroutine open_attribute(file, object, name, object_id, attribute, status)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: object, name
    integer(hid_t), intent(out) :: object_id, attribute
    integer, intent(out) :: status

    attribute = no_id
    call h5oopen_f(file%id, object, object_id, status)
    if (status < 0) object_id = no_id
    if (status >= 0) call h5aopen_f(object_id, name, attribute, status)
    if (status < 0) attribute = no_id
  end subroutine open_attribute

  subroutine close_attribute(object_id, attribute)
    integer(hid_t), intent(in) :: object_id, attribute
    integer :: ignored

    if (attribute /= no_id) call h5aclose_f(attribute, ignored)
    if (object_id /= no_id) call h5oclose_f(object_id, ignored)
  end subroutine close_attribute

  !> Say whether the attribute holds exactly one value, so that it fits where it is read to.
  logical function is_single(attribute) result(single)
    integer(hid_t), intent(in) :: attribute
    integer(hid_t) :: space
    integer(hsize_t) :: n
    integer :: status, ignored

    single = .false.
    call h5aget_space_f(attribute, space, status)
    if (status < 0) return
    call h5sget_simple_extent_npoints_f(space, n, status)
    single = status >= 0 .and. n == 1
    call h5sclose_f(space, ignored)
  end function is_single

  !> Say what a dataset is and what kind of number it holds, in two attributes.
  subroutine describe(file, path, description, quantity, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path, description, quantity
    type(error_t), allocatable, intent(inout) :: error

    call write_attribute(file, path, 'description', description, error)
    call write_attribute(file, path, 'quantity', quantity, error)
  end subroutine describe

  !> Make a group that says what it is, unless the file has it.
  subroutine describe_group(file, path, description, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path, description
    type(error_t), allocatable, intent(inout) :: error

    if (allocated(error)) return
    if (exists(file, path)) return
    call create_group(file, path, error)
    call write_attribute(file, path, 'description', description, error)
  end subroutine describe_group

end module hdf5_attributes_mod
