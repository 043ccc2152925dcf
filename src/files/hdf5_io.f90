!> HDF5 files in a few typed procedures; the only file that sees the library.
!>
!> All procedures that work inside an open file share one rule, so that a layout reads as a list:
!> their `error` is `intent(inout)`, and they do nothing once it is set. One check after the list
!> is enough. Extents are Fortran's, first index fastest; C and h5py see them reversed.
!>
!> Files are of the classic format: it survives a kill at any moment without being repaired.
module hdf5_io_mod
  use, intrinsic :: iso_c_binding, only: c_ptr, c_loc, c_char, c_int, c_size_t, &
                                         c_int64_t, c_funptr, c_funloc, c_f_pointer, c_associated
  use hdf5, only: hid_t, hsize_t, size_t, h5kind_to_type, h5aclose_f, h5acreate_f, h5aexists_f, &
                  h5aget_space_f, h5aget_type_f, h5aopen_by_name_f, h5aopen_f, h5aread_f, &
                  h5awrite_f, h5dclose_f, h5dcreate_f, h5dget_space_f, h5dget_type_f, &
                  h5dont_atexit_f, h5dopen_f, h5dread_f, h5dset_extent_f, h5dwrite_f, &
                  h5eset_auto_f, h5fclose_f, h5fcreate_f, h5fflush_f, h5fis_hdf5_f, h5fopen_f, &
                  h5gclose_f, h5gcreate_f, h5get_libversion_f, h5gget_obj_info_idx_f, &
                  h5gn_members_f, h5iis_valid_f, h5ldelete_f, h5lexists_f, h5oclose_f, h5oopen_f, &
                  h5open_f, h5pclose_f, h5pcreate_f, h5pset_chunk_f, h5pset_deflate_f, &
                  h5pset_fclose_degree_f, h5pset_istore_k_f, h5pset_shuffle_f, h5sclose_f, &
                  h5screate_f, h5screate_simple_f, h5sget_simple_extent_dims_f, &
                  h5sget_simple_extent_ndims_f, h5sget_simple_extent_npoints_f, &
                  h5sselect_hyperslab_f, h5tclose_f, h5tcopy_f, h5tequal_f, h5tget_class_f, &
                  h5tget_size_f, h5tis_variable_str_f, h5tset_cset_f, h5tset_size_f, &
                  h5tset_strpad_f, H5F_ACC_EXCL_F, H5F_ACC_RDONLY_F, H5F_ACC_RDWR_F, &
                  H5F_CLOSE_STRONG_F, H5F_SCOPE_LOCAL_F, H5P_DATASET_CREATE_F, H5P_FILE_ACCESS_F, &
                  H5P_FILE_CREATE_F, H5S_SCALAR_F, H5S_SELECT_SET_F, H5S_UNLIMITED_F, &
                  H5T_CSET_UTF8_F, H5T_C_S1, H5T_IEEE_F64LE, H5T_STD_I32LE, H5T_STD_I64LE, &
                  H5T_STD_I8LE, H5T_STD_U8LE, H5T_STRING_F, H5T_STR_NULLPAD_F, H5_INTEGER_KIND, &
                  H5_REAL_KIND
  use kinds_mod, only: wp, i1, i4, i8
  use errors_mod, only: error_t, raise, exit_machine
  use text_mod, only: string_t, to_text
  implicit none
  private

  public :: hdf5_file_t, rows_t
  public :: of_real, of_integer, of_long, of_byte, of_unsigned_byte
  public :: file_absent, file_readable, file_locked, file_foreign, file_damaged
  public :: look_at_file, create_file, open_file, flush_file, close_file, is_open, hdf5_version
  public :: create_group, exists, delete_object, list_members
  public :: write_attribute, read_attribute, write_dataset, write_text
  public :: dataset_extents, dataset_kind, read_dataset, read_text
  public :: create_rows, create_stack, append_row

  ! What the numbers of a dataset are in the file.
  integer, parameter :: of_real = 1          !! float64
  integer, parameter :: of_integer = 2       !! int32
  integer, parameter :: of_long = 3          !! int64
  integer, parameter :: of_byte = 4          !! int8
  integer, parameter :: of_unsigned_byte = 5 !! uint8
  integer, parameter :: bytes_of(5) = [8, 4, 8, 1, 1]

  ! What `look_at_file` finds.
  integer, parameter :: file_absent = 0
  integer, parameter :: file_readable = 1
  integer, parameter :: file_locked = 2   !! another program writes it
  integer, parameter :: file_foreign = 3  !! not HDF5
  integer, parameter :: file_damaged = 4  !! HDF5, but cannot be opened

  integer(hid_t), parameter :: no_id = -1
  integer, parameter :: longest_attribute = 60000 !! the classic format ends at 64 KiB

  !> An open file.
  type :: hdf5_file_t
    integer(hid_t), private :: id = no_id
    character(:), allocatable :: path
  end type hdf5_file_t

  !> An open dataset that grows by one row at a time along its last extent.
  type :: rows_t
    private
    integer(hid_t) :: id = no_id
    integer(hsize_t), allocatable :: fixed(:) !! extents before the one that grows
    integer(hsize_t) :: step = 1              !! how far a row reaches along the one that grows
    integer(hsize_t) :: length = 0            !! how far it has grown
    character(:), allocatable :: name         !! for messages
  end type rows_t

  !> Write an attribute, or write it again: `write_attribute(file, object, name, value, error)`.
  interface write_attribute
    module procedure write_text_attribute, write_long_attribute, write_longs_attribute, &
                     write_real_attribute, write_texts_attribute
  end interface write_attribute

  !> Read an attribute: `read_attribute(file, object, name, value, error)`.
  interface read_attribute
    module procedure read_text_attribute, read_long_attribute, read_real_attribute
  end interface read_attribute

  !> Write a dataset of fixed extents:
  !> `write_dataset(file, path, values, description, quantity, error)`.
  interface write_dataset
    module procedure write_reals_1, write_reals_2, write_integers, write_longs, write_bytes
  end interface write_dataset

  !> Read a whole dataset, flat, first index fastest: `read_dataset(file, path, values, error)`.
  interface read_dataset
    module procedure read_reals, read_integers, read_longs
  end interface read_dataset

  !> Append a row: `append_row(rows, values, error)`.
  interface append_row
    module procedure append_real, append_reals_1, append_reals_2, append_reals_3, &
                     append_integer, append_long, append_byte, append_bytes
  end interface append_row

  !> One entry of HDF5's error stack, as H5Epublic.h lays it out.
  type, bind(c) :: stack_entry_t
    integer(c_int64_t) :: class_id, major, minor
    integer(c_int)     :: line
    type(c_ptr)        :: function_name, file_name, description
  end type stack_entry_t

  !> The operating system's words in an error stack.
  type, bind(c) :: reason_t
    character(c_char) :: text(200)
    integer(c_int)    :: length  !! 0: it said nothing
    integer(c_int)    :: locked  !! 1: a lock was refused
  end type reason_t

  interface
    function walk_error_stack(stack, direction, visit, client) bind(c, name='H5Ewalk2')
      import :: c_int, c_int64_t, c_funptr, c_ptr
      implicit none
      integer(c_int64_t), value :: stack
      integer(c_int), value :: direction
      type(c_funptr), value :: visit
      type(c_ptr), value :: client
      integer(c_int) :: walk_error_stack
    end function walk_error_stack

    pure function c_length(text) bind(c, name='strlen')
      import :: c_ptr, c_size_t
      implicit none
      type(c_ptr), value, intent(in) :: text
      integer(c_size_t) :: c_length
    end function c_length
  end interface

contains

  ! ------------------------------------------------------------------ files

  !> Start the library, once, without its own error messages and without its cleaning up at exit:
  !> that crashes when a disk was full. Whoever opens a file closes it.
  subroutine start_library()
    logical :: running
    integer :: status

    ! First of all: any other call starts the library as a whole.
    call h5dont_atexit_f(status)
    ! Its type numbers are 0 before it runs. Starting again would leak a set of them.
    call h5iis_valid_f(H5T_STD_I32LE, running, status)
    if (status == 0 .and. running) return
    call h5open_f(status)
    call h5eset_auto_f(0, status)
  end subroutine start_library

  !> Say what stands at `path`.
  function look_at_file(path) result(found)
    character(*), intent(in) :: path
    integer :: found, status
    logical :: there, is_hdf5
    integer(hid_t) :: id
    integer(i8) :: bytes
    type(reason_t) :: reason

    found = file_absent
    inquire (file=path, exist=there, size=bytes)
    if (.not. there) return
    ! HDF5 would wait for ever at the end of a pipe.
    found = file_foreign
    if (bytes <= 0) return
    call start_library()
    call open_strongly(path, H5F_ACC_RDONLY_F, id, status)
    if (status >= 0) then
      found = file_readable
      call h5fclose_f(id, status)
      return
    end if
    ! The lock is asked for before the signature is read, so a file of which nothing is
    ! written yet is known as locked too.
    reason = why()
    found = file_locked
    if (reason%locked == 1) return
    call h5fis_hdf5_f(path, is_hdf5, status)
    found = merge(file_damaged, file_foreign, status >= 0 .and. is_hdf5)
  end function look_at_file

  !> Make a new file; one that exists is an error.
  subroutine create_file(path, file, error)
    character(*), intent(in) :: path
    type(hdf5_file_t), intent(out) :: file
    type(error_t), allocatable, intent(out) :: error
    integer(hid_t) :: creation, access
    integer :: status, ignored

    call start_library()
    file%path = path
    access = strong_access()
    call h5pcreate_f(H5P_FILE_CREATE_F, creation, status)
    ! 1024 chunks a B-tree node: a node that splits while the program is killed loses old rows.
    if (status >= 0) call h5pset_istore_k_f(creation, 512, status)
    if (status >= 0) then
      call h5fcreate_f(path, H5F_ACC_EXCL_F, file%id, status, creation, access)
    end if
    if (status < 0) then
      file%id = no_id
      call fail(error, "cannot create '"//path//"'")
    end if
    call h5pclose_f(creation, ignored)
    call h5pclose_f(access, ignored)
  end subroutine create_file

  !> Open an existing file.
  subroutine open_file(path, writable, file, error)
    character(*), intent(in) :: path
    logical, intent(in) :: writable
    type(hdf5_file_t), intent(out) :: file
    type(error_t), allocatable, intent(out) :: error
    integer :: status

    call start_library()
    file%path = path
    call open_strongly(path, merge(H5F_ACC_RDWR_F, H5F_ACC_RDONLY_F, writable), file%id, status)
    if (status >= 0) return
    file%id = no_id
    call fail(error, "cannot open '"//path//"'")
  end subroutine open_file

  subroutine open_strongly(path, flags, id, status)
    character(*), intent(in) :: path
    integer, intent(in) :: flags
    integer(hid_t), intent(out) :: id
    integer, intent(out) :: status
    integer(hid_t) :: access

    ! The list of properties stays open after a failure: closing it would clear the reason.
    access = strong_access()
    call h5fopen_f(path, flags, id, status, access)
    if (status >= 0) call h5pclose_f(access, status)
  end subroutine open_strongly

  !> Properties of an open file that closes its datasets with itself; to be closed.
  function strong_access() result(access)
    integer(hid_t) :: access
    integer :: status

    call h5pcreate_f(H5P_FILE_ACCESS_F, access, status)
    call h5pset_fclose_degree_f(access, H5F_CLOSE_STRONG_F, status)
  end function strong_access

  !> Hand everything written so far to the operating system.
  subroutine flush_file(file, error)
    type(hdf5_file_t), intent(in) :: file
    type(error_t), allocatable, intent(inout) :: error
    integer :: status

    if (allocated(error)) return
    call h5fflush_f(file%id, H5F_SCOPE_LOCAL_F, status)
    if (status < 0) call fail(error, "cannot write '"//file%path//"'")
  end subroutine flush_file

  !> Close the file and every dataset of it; also after an error, which is then kept.
  subroutine close_file(file, error)
    type(hdf5_file_t), intent(inout) :: file
    type(error_t), allocatable, intent(inout) :: error
    integer :: status

    if (file%id == no_id) return
    call h5fclose_f(file%id, status)
    file%id = no_id
    if (status < 0 .and. .not. allocated(error)) call fail(error, "cannot close '"//file%path//"'")
  end subroutine close_file

  pure function is_open(file) result(open)
    type(hdf5_file_t), intent(in) :: file
    logical :: open

    open = file%id /= no_id
  end function is_open

  !> The library's version, as in "1.10.8".
  function hdf5_version() result(version)
    character(:), allocatable :: version
    integer :: major, minor, release, status

    call start_library()
    call h5get_libversion_f(major, minor, release, status)
    version = to_text(major)//'.'//to_text(minor)//'.'//to_text(release)
  end function hdf5_version

  ! ------------------------------------------------------------------ groups and links

  subroutine create_group(file, path, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    type(error_t), allocatable, intent(inout) :: error
    integer(hid_t) :: id
    integer :: status

    if (allocated(error)) return
    call h5gcreate_f(file%id, path, id, status)
    if (status < 0) then
      call fail(error, "cannot create the group '"//path//"' in '"//file%path//"'")
      return
    end if
    call h5gclose_f(id, status)
  end subroutine create_group

  !> Say whether a group or dataset of this path exists (each of its parents is looked at too).
  function exists(file, path) result(found)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path !! '/a/b', not '/' alone
    logical :: found
    integer :: last, next, status

    found = .true.
    last = 1
    do while (found .and. last <= len(path))
      next = index(path(last + 1:), '/')
      last = merge(last + next - 1, len(path), next > 0)
      call h5lexists_f(file%id, path(:last), found, status)
      found = found .and. status >= 0
      last = last + 1
    end do
  end function exists

  subroutine delete_object(file, path, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    type(error_t), allocatable, intent(inout) :: error
    integer :: status

    if (allocated(error)) return
    call h5ldelete_f(file%id, path, status)
    if (status < 0) call fail(error, "cannot delete '"//path//"' in '"//file%path//"'")
  end subroutine delete_object

  !> The names in a group, in alphabetical order.
  subroutine list_members(file, group, names, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: group
    type(string_t), allocatable, intent(out) :: names(:)
    type(error_t), allocatable, intent(inout) :: error
    character(1024) :: name
    integer :: i, n, kind, status

    allocate (names(0))
    if (allocated(error)) return
    call h5gn_members_f(file%id, group, n, status)
    if (status >= 0) then
      deallocate (names)
      allocate (names(n))
      do i = 1, n
        call h5gget_obj_info_idx_f(file%id, group, i - 1, name, kind, status)
        if (status < 0) exit
        names(i)%text = trim(name)
      end do
    end if
    if (status < 0) call fail(error, "cannot list '"//group//"' in '"//file%path//"'")
  end subroutine list_members

  ! ------------------------------------------------------------------ attributes

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
    integer(i8), intent(in) :: value
    type(error_t), allocatable, intent(inout) :: error
    integer(i8), target :: copy

    copy = value
    call put_attribute(file, object, name, of_long, c_loc(copy), [integer ::], error)
  end subroutine write_long_attribute

  subroutine write_longs_attribute(file, object, name, value, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: object, name
    integer(i8), intent(in) :: value(:)
    type(error_t), allocatable, intent(inout) :: error
    integer(i8), target :: copy(size(value))

    copy = value
    call put_attribute(file, object, name, of_long, c_loc(copy), shape(value), error)
  end subroutine write_longs_attribute

  subroutine write_real_attribute(file, object, name, value, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: object, name
    real(wp), intent(in) :: value
    type(error_t), allocatable, intent(inout) :: error
    real(wp), target :: copy

    copy = value
    call put_attribute(file, object, name, of_real, c_loc(copy), [integer ::], error)
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
    call put(file, object, name, [type_id, type_id], address, extents(2:), error)
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
             error)
  end subroutine put_attribute

  subroutine put(file, object, name, types, address, extents, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: object, name
    integer(hid_t), intent(in) :: types(2) !! in the file, in memory
    type(c_ptr), intent(in) :: address
    integer, intent(in) :: extents(:)
    type(error_t), allocatable, intent(inout) :: error
    integer(hid_t) :: object_id, attribute
    integer :: status, ignored
    logical :: there

    if (allocated(error)) return
    attribute = no_id
    ! The object first, then its attribute: h5aopen_by_name_f fails for writing.
    call h5oopen_f(file%id, object, object_id, status)
    if (status < 0) object_id = no_id
    if (status >= 0) then
      call h5aexists_f(object_id, name, there, status)
      if (status >= 0 .and. there) call h5aopen_f(object_id, name, attribute, status)
      if (status >= 0 .and. .not. there) then
        call new_attribute(object_id, name, types(1), extents, attribute, status)
      end if
      if (status >= 0) call h5awrite_f(attribute, types(2), address, status)
    end if
    if (status < 0) then
      call fail(error, "cannot write the attribute '"//name//"' of '"//object//"' in '"// &
                file%path//"'")
    end if
    if (attribute /= no_id) call h5aclose_f(attribute, ignored)
    if (object_id /= no_id) call h5oclose_f(object_id, ignored)
  end subroutine put

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
    call h5sclose_f(space, ignored)
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
    integer(i8), intent(out) :: value
    type(error_t), allocatable, intent(inout) :: error
    integer(i8), target :: copy

    copy = 0
    call get_attribute(file, object, name, of_long, c_loc(copy), error)
    value = copy
  end subroutine read_long_attribute

  subroutine read_real_attribute(file, object, name, value, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: object, name
    real(wp), intent(out) :: value
    type(error_t), allocatable, intent(inout) :: error
    real(wp), target :: copy

    copy = 0.0_wp
    call get_attribute(file, object, name, of_real, c_loc(copy), error)
    value = copy
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

  function is_text(type_id) result(text)
    integer(hid_t), intent(in) :: type_id
    logical :: text
    integer :: class, status

    call h5tget_class_f(type_id, class, status)
    text = status >= 0 .and. class == H5T_STRING_F
  end function is_text

  !> Say whether the attribute holds exactly one value, so that it fits where it is read to.
  function is_single(attribute) result(single)
    integer(hid_t), intent(in) :: attribute
    logical :: single
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

  ! ------------------------------------------------------------------ datasets of fixed extents

  subroutine write_reals_1(file, path, values, description, quantity, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    real(wp), intent(in), contiguous, target :: values(:)
    character(*), intent(in) :: description, quantity
    type(error_t), allocatable, intent(inout) :: error

    call create_fixed(file, path, of_real, shape(values), c_loc(values), error)
    call describe(file, path, description, quantity, error)
  end subroutine write_reals_1

  subroutine write_reals_2(file, path, values, description, quantity, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    real(wp), intent(in), contiguous, target :: values(:, :)
    character(*), intent(in) :: description, quantity
    type(error_t), allocatable, intent(inout) :: error

    call create_fixed(file, path, of_real, shape(values), c_loc(values), error)
    call describe(file, path, description, quantity, error)
  end subroutine write_reals_2

  subroutine write_integers(file, path, values, description, quantity, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer(i4), intent(in), contiguous, target :: values(:)
    character(*), intent(in) :: description, quantity
    type(error_t), allocatable, intent(inout) :: error

    call create_fixed(file, path, of_integer, shape(values), c_loc(values), error)
    call describe(file, path, description, quantity, error)
  end subroutine write_integers

  subroutine write_longs(file, path, values, description, quantity, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer(i8), intent(in), contiguous, target :: values(:)
    character(*), intent(in) :: description, quantity
    type(error_t), allocatable, intent(inout) :: error

    call create_fixed(file, path, of_long, shape(values), c_loc(values), error)
    call describe(file, path, description, quantity, error)
  end subroutine write_longs

  !> Bytes are unsigned in the file: VTK wants its cell types so.
  subroutine write_bytes(file, path, values, description, quantity, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer(i1), intent(in), contiguous, target :: values(:) !! 0 to 127
    character(*), intent(in) :: description, quantity
    type(error_t), allocatable, intent(inout) :: error

    call create_fixed(file, path, of_unsigned_byte, shape(values), c_loc(values), error)
    call describe(file, path, description, quantity, error)
  end subroutine write_bytes

  !> A whole text as one value, UTF-8.
  subroutine write_text(file, path, text, description, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    character(*), intent(in) :: text
    character(*), intent(in) :: description
    type(error_t), allocatable, intent(inout) :: error
    character(c_char), allocatable, target :: bytes(:)
    integer(hid_t) :: type_id
    integer :: i, ignored

    if (allocated(error)) return
    allocate (bytes(max(1, len(text))), source=achar(0))
    do i = 1, len(text)
      bytes(i) = text(i:i)
    end do
    type_id = text_type(size(bytes), ascii=.false.)
    call put_dataset(file, path, [type_id, type_id], [integer ::], c_loc(bytes), error)
    call h5tclose_f(type_id, ignored)
    call describe(file, path, description, 'text', error)
  end subroutine write_text

  subroutine create_fixed(file, path, kind, extents, address, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer, intent(in) :: kind
    integer, intent(in) :: extents(:)
    type(c_ptr), intent(in) :: address
    type(error_t), allocatable, intent(inout) :: error

    if (allocated(error)) return
    call put_dataset(file, path, [type_in_file(kind), type_in_memory(kind)], extents, address, &
                     error)
  end subroutine create_fixed

  subroutine put_dataset(file, path, types, extents, address, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer(hid_t), intent(in) :: types(2) !! in the file, in memory
    integer, intent(in) :: extents(:)      !! none: a scalar
    type(c_ptr), intent(in) :: address
    type(error_t), allocatable, intent(inout) :: error
    integer(hid_t) :: space, dataset
    integer :: status, ignored

    space = new_space(int(extents, hsize_t))
    call h5dcreate_f(file%id, path, types(1), space, dataset, status)
    if (status >= 0) then
      if (all(extents > 0)) call h5dwrite_f(dataset, types(2), address, status)
      if (status < 0) call fail_to_write(error, file, path)
      call h5dclose_f(dataset, ignored)
    else
      call fail_to_write(error, file, path)
    end if
    call h5sclose_f(space, ignored)
  end subroutine put_dataset

  subroutine describe(file, path, description, quantity, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path, description, quantity
    type(error_t), allocatable, intent(inout) :: error

    call write_attribute(file, path, 'description', description, error)
    call write_attribute(file, path, 'quantity', quantity, error)
  end subroutine describe

  ! ------------------------------------------------------------------ reading datasets

  !> The extents of a dataset, Fortran's way round; none for a scalar.
  subroutine dataset_extents(file, path, extents, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer(i8), allocatable, intent(out) :: extents(:)
    type(error_t), allocatable, intent(inout) :: error
    integer(hid_t) :: dataset

    call open_dataset(file, path, dataset, extents, error)
    call close_dataset(dataset)
  end subroutine dataset_extents

  !> What the numbers of a dataset are: of_real, ...; 0 for anything else.
  function dataset_kind(file, path) result(kind)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer :: kind, status, ignored
    integer(hid_t) :: dataset, type_id
    logical :: same

    call h5dopen_f(file%id, path, dataset, status)
    if (status >= 0) then
      call h5dget_type_f(dataset, type_id, status)
      do kind = size(bytes_of), 1, -1
        call h5tequal_f(type_id, type_in_file(kind), same, status)
        if (status >= 0 .and. same) exit
      end do
      call h5tclose_f(type_id, ignored)
      call h5dclose_f(dataset, ignored)
    else
      kind = 0
    end if
  end function dataset_kind

  subroutine read_reals(file, path, values, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    real(wp), allocatable, intent(out), target :: values(:)
    type(error_t), allocatable, intent(inout) :: error
    integer(hid_t) :: dataset
    integer(i8), allocatable :: extents(:)
    integer :: status

    call open_dataset(file, path, dataset, extents, error)
    allocate (values(product(extents)), stat=status)
    if (status /= 0) call fail_to_hold(error, file, path)
    if (status /= 0) allocate (values(0))
    call get_values(file, path, dataset, of_real, c_loc(values), error)
  end subroutine read_reals

  subroutine read_integers(file, path, values, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer(i4), allocatable, intent(out), target :: values(:)
    type(error_t), allocatable, intent(inout) :: error
    integer(hid_t) :: dataset
    integer(i8), allocatable :: extents(:)
    integer :: status

    call open_dataset(file, path, dataset, extents, error)
    allocate (values(product(extents)), stat=status)
    if (status /= 0) call fail_to_hold(error, file, path)
    if (status /= 0) allocate (values(0))
    call get_values(file, path, dataset, of_integer, c_loc(values), error)
  end subroutine read_integers

  subroutine read_longs(file, path, values, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer(i8), allocatable, intent(out), target :: values(:)
    type(error_t), allocatable, intent(inout) :: error
    integer(hid_t) :: dataset
    integer(i8), allocatable :: extents(:)
    integer :: status

    call open_dataset(file, path, dataset, extents, error)
    allocate (values(product(extents)), stat=status)
    if (status /= 0) call fail_to_hold(error, file, path)
    if (status /= 0) allocate (values(0))
    call get_values(file, path, dataset, of_long, c_loc(values), error)
  end subroutine read_longs

  !> Read a text written by `write_text`.
  subroutine read_text(file, path, text, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    character(:), allocatable, intent(out) :: text
    type(error_t), allocatable, intent(inout) :: error
    character(c_char), allocatable, target :: bytes(:)
    integer(hid_t) :: dataset, type_id
    integer(i8), allocatable :: extents(:)
    integer(size_t) :: length
    integer :: status, ignored
    logical :: variable
    type(c_ptr) :: address

    text = ''
    call open_dataset(file, path, dataset, extents, error)
    if (allocated(error)) return
    call h5dget_type_f(dataset, type_id, status)
    call h5tis_variable_str_f(type_id, variable, status)
    if (is_text(type_id) .and. .not. variable .and. product(extents) == 1) then
      call h5tget_size_f(type_id, length, status)
      if (status >= 0) allocate (bytes(length), stat=status)
      if (status == 0) address = c_loc(bytes)
      if (status == 0) call h5dread_f(dataset, type_id, address, status)
      if (status == 0) text = text_of(bytes)
    else
      status = -1
    end if
    if (status /= 0) call fail_to_read(error, file, path)
    call h5tclose_f(type_id, ignored)
    call close_dataset(dataset)
  end subroutine read_text

  !> Open a dataset; what it holds is `extents` values a direction, none after an error.
  subroutine open_dataset(file, path, dataset, extents, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer(hid_t), intent(out) :: dataset
    integer(i8), allocatable, intent(out) :: extents(:)
    type(error_t), allocatable, intent(inout) :: error
    integer(hid_t) :: space
    integer(hsize_t), allocatable :: limits(:), found(:)
    integer :: rank, status, ignored

    dataset = no_id
    extents = [0_i8]
    if (allocated(error)) return
    call h5dopen_f(file%id, path, dataset, status)
    if (status < 0) then
      dataset = no_id
      call fail_to_read(error, file, path)
      return
    end if
    call h5dget_space_f(dataset, space, status)
    call h5sget_simple_extent_ndims_f(space, rank, status)
    allocate (found(rank), limits(rank))
    if (rank > 0) call h5sget_simple_extent_dims_f(space, found, limits, status)
    call h5sclose_f(space, ignored)
    extents = found
  end subroutine open_dataset

  subroutine get_values(file, path, dataset, kind, address, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer(hid_t), intent(in) :: dataset
    integer, intent(in) :: kind
    type(c_ptr), intent(in) :: address
    type(error_t), allocatable, intent(inout) :: error
    integer :: status
    type(c_ptr) :: buffer

    buffer = address
    if (.not. allocated(error)) then
      call h5dread_f(dataset, type_in_memory(kind), buffer, status)
      if (status < 0) call fail_to_read(error, file, path)
    end if
    call close_dataset(dataset)
  end subroutine get_values

  subroutine close_dataset(dataset)
    integer(hid_t), intent(in) :: dataset
    integer :: ignored

    if (dataset /= no_id) call h5dclose_f(dataset, ignored)
  end subroutine close_dataset

  ! ------------------------------------------------------------------ datasets that grow

  !> Make a dataset whose rows are arrays of `row` extents: it grows along one more extent.
  subroutine create_rows(file, path, kind, row, description, quantity, rows, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer, intent(in) :: kind   !! of_real, of_integer, of_long or of_byte
    integer, intent(in) :: row(:) !! extents of a row, none for one number
    character(*), intent(in) :: description, quantity
    type(rows_t), intent(out) :: rows
    type(error_t), allocatable, intent(inout) :: error

    rows%fixed = int(row, hsize_t)
    rows%step = 1
    call create_growing(file, path, kind, rows, error)
    call describe(file, path, description, quantity, error)
  end subroutine create_rows

  !> Make a dataset whose rows are stacked along their own last extent, as VTKHDF wants fields.
  subroutine create_stack(file, path, kind, row, description, quantity, rows, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer, intent(in) :: kind   !! as above
    integer, intent(in) :: row(:) !! extents of a row, one at least
    character(*), intent(in) :: description, quantity
    type(rows_t), intent(out) :: rows
    type(error_t), allocatable, intent(inout) :: error

    rows%fixed = int(row(:size(row) - 1), hsize_t)
    rows%step = row(size(row))
    call create_growing(file, path, kind, rows, error)
    call describe(file, path, description, quantity, error)
  end subroutine create_stack

  !> One row is one chunk, shuffled and deflated. Rows of a few bytes share a chunk of 4 KB: it is
  !> not filtered, so that it is always written again in its own place.
  subroutine create_growing(file, path, kind, rows, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    integer, intent(in) :: kind
    type(rows_t), intent(inout) :: rows
    type(error_t), allocatable, intent(inout) :: error
    integer, parameter :: small_row = 64, small_chunk = 4096 ! bytes
    integer(hid_t) :: space, creation
    integer(hsize_t) :: start(size(rows%fixed) + 1), chunk(size(rows%fixed) + 1)
    integer(hsize_t) :: limit(size(rows%fixed) + 1), row_bytes
    integer :: rank, status, ignored

    if (allocated(error)) return
    rows%name = path
    rank = size(start)
    start = [rows%fixed, 0_hsize_t]
    chunk = max(1_hsize_t, [rows%fixed, rows%step])
    ! A chunk may not be larger than a fixed extent, and not be 0: what is empty may grow.
    limit = merge(start, H5S_UNLIMITED_F, start > 0)
    row_bytes = product(chunk)*bytes_of(kind)
    if (row_bytes <= small_row) chunk(rank) = chunk(rank)*(small_chunk/row_bytes)
    call h5screate_simple_f(rank, start, space, status, limit)
    call h5pcreate_f(H5P_DATASET_CREATE_F, creation, status)
    call h5pset_chunk_f(creation, rank, chunk, status)
    if (row_bytes > small_row) then
      if (bytes_of(kind) > 1) call h5pset_shuffle_f(creation, status)
      call h5pset_deflate_f(creation, 1, status)
    end if
    call h5dcreate_f(file%id, path, type_in_file(kind), space, rows%id, status, creation)
    if (status < 0) then
      rows%id = no_id
      call fail_to_write(error, file, path)
    end if
    call h5pclose_f(creation, ignored)
    call h5sclose_f(space, ignored)
  end subroutine create_growing

  subroutine append_real(rows, values, error)
    type(rows_t), intent(inout) :: rows
    real(wp), intent(in), target :: values
    type(error_t), allocatable, intent(inout) :: error

    call append(rows, of_real, c_loc(values), 1, error)
  end subroutine append_real

  subroutine append_reals_1(rows, values, error)
    type(rows_t), intent(inout) :: rows
    real(wp), intent(in), contiguous, target :: values(:)
    type(error_t), allocatable, intent(inout) :: error

    call append(rows, of_real, c_loc(values), size(values), error)
  end subroutine append_reals_1

  subroutine append_reals_2(rows, values, error)
    type(rows_t), intent(inout) :: rows
    real(wp), intent(in), contiguous, target :: values(:, :)
    type(error_t), allocatable, intent(inout) :: error

    call append(rows, of_real, c_loc(values), size(values), error)
  end subroutine append_reals_2

  subroutine append_reals_3(rows, values, error)
    type(rows_t), intent(inout) :: rows
    real(wp), intent(in), contiguous, target :: values(:, :, :)
    type(error_t), allocatable, intent(inout) :: error

    call append(rows, of_real, c_loc(values), size(values), error)
  end subroutine append_reals_3

  subroutine append_integer(rows, values, error)
    type(rows_t), intent(inout) :: rows
    integer(i4), intent(in), target :: values
    type(error_t), allocatable, intent(inout) :: error

    call append(rows, of_integer, c_loc(values), 1, error)
  end subroutine append_integer

  subroutine append_long(rows, values, error)
    type(rows_t), intent(inout) :: rows
    integer(i8), intent(in), target :: values
    type(error_t), allocatable, intent(inout) :: error

    call append(rows, of_long, c_loc(values), 1, error)
  end subroutine append_long

  subroutine append_byte(rows, values, error)
    type(rows_t), intent(inout) :: rows
    integer(i1), intent(in), target :: values
    type(error_t), allocatable, intent(inout) :: error

    call append(rows, of_byte, c_loc(values), 1, error)
  end subroutine append_byte

  subroutine append_bytes(rows, values, error)
    type(rows_t), intent(inout) :: rows
    integer(i1), intent(in), contiguous, target :: values(:)
    type(error_t), allocatable, intent(inout) :: error

    call append(rows, of_byte, c_loc(values), size(values), error)
  end subroutine append_bytes

  subroutine append(rows, kind, address, n, error)
    type(rows_t), intent(inout) :: rows
    integer, intent(in) :: kind
    type(c_ptr), intent(in) :: address
    integer, intent(in) :: n !! numbers at the address
    type(error_t), allocatable, intent(inout) :: error
    integer(hid_t) :: memory, space
    integer(hsize_t) :: start(size(rows%fixed) + 1), count(size(rows%fixed) + 1)
    integer :: status, ignored

    if (allocated(error)) return
    memory = no_id
    count = [rows%fixed, rows%step]
    start = 0
    start(size(start)) = rows%length
    if (product(count) /= n) then
      call raise(error, exit_machine, "internal error: a row of '"//rows%name//"' has "// &
                 to_text(product(count))//' numbers, not '//to_text(n))
      return
    end if
    call h5dset_extent_f(rows%id, [rows%fixed, rows%length + rows%step], status)
    if (status >= 0 .and. n > 0) then
      memory = new_space(count)
      call h5dget_space_f(rows%id, space, status)
      call h5sselect_hyperslab_f(space, H5S_SELECT_SET_F, start, count, status)
      call h5dwrite_f(rows%id, type_in_memory(kind), address, status, memory, space)
    end if
    if (status < 0) call fail(error, "cannot write '"//rows%name//"'")
    if (memory /= no_id) then
      call h5sclose_f(space, ignored)
      call h5sclose_f(memory, ignored)
    end if
    rows%length = rows%length + rows%step
  end subroutine append

  ! ------------------------------------------------------------------ types and spaces

  function type_in_file(kind) result(type_id)
    integer, intent(in) :: kind
    integer(hid_t) :: type_id

    select case (kind)
    case (of_real)
      type_id = H5T_IEEE_F64LE
    case (of_integer)
      type_id = H5T_STD_I32LE
    case (of_long)
      type_id = H5T_STD_I64LE
    case (of_byte)
      type_id = H5T_STD_I8LE
    case default
      type_id = H5T_STD_U8LE
    end select
  end function type_in_file

  function type_in_memory(kind) result(type_id)
    integer, intent(in) :: kind
    integer(hid_t) :: type_id

    select case (kind)
    case (of_real)
      type_id = h5kind_to_type(wp, H5_REAL_KIND)
    case (of_integer)
      type_id = h5kind_to_type(i4, H5_INTEGER_KIND)
    case (of_long)
      type_id = h5kind_to_type(i8, H5_INTEGER_KIND)
    case default
      type_id = h5kind_to_type(i1, H5_INTEGER_KIND)
    end select
  end function type_in_memory

  !> A text type of `length` bytes, padded with NUL; to be closed.
  function text_type(length, ascii) result(type_id)
    integer, intent(in) :: length !! bytes, at least 1
    logical, intent(in) :: ascii  !! as VTK wants it; else UTF-8
    integer(hid_t) :: type_id
    integer :: status

    call h5tcopy_f(H5T_C_S1, type_id, status)
    call h5tset_size_f(type_id, int(length, size_t), status)
    call h5tset_strpad_f(type_id, H5T_STR_NULLPAD_F, status)
    if (.not. ascii) call h5tset_cset_f(type_id, H5T_CSET_UTF8_F, status)
  end function text_type

  !> A space of fixed extents, a scalar where there are none; to be closed.
  function new_space(extents) result(space)
    integer(hsize_t), intent(in) :: extents(:)
    integer(hid_t) :: space
    integer :: status

    if (size(extents) == 0) then
      call h5screate_f(H5S_SCALAR_F, space, status)
    else
      call h5screate_simple_f(size(extents), extents, space, status)
    end if
  end function new_space

  !> The bytes as a text, without the NULs and blanks that pad it.
  pure function text_of(bytes) result(text)
    character(c_char), intent(in) :: bytes(:)
    character(:), allocatable :: text
    integer :: i, n

    do n = size(bytes), 1, -1
      if (bytes(n) /= achar(0) .and. bytes(n) /= ' ') exit
    end do
    allocate (character(n) :: text)
    do i = 1, n
      text(i:i) = bytes(i)
    end do
  end function text_of

  ! ------------------------------------------------------------------ failures

  subroutine fail_to_write(error, file, path)
    type(error_t), allocatable, intent(inout) :: error
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path

    call fail(error, "cannot write '"//path//"' to '"//file%path//"'")
  end subroutine fail_to_write

  subroutine fail_to_read(error, file, path, attribute)
    type(error_t), allocatable, intent(inout) :: error
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    character(*), intent(in), optional :: attribute

    if (present(attribute)) then
      call fail(error, "cannot read the attribute '"//attribute//"' of '"//path//"' in '"// &
                file%path//"'")
    else
      call fail(error, "cannot read '"//path//"' in '"//file%path//"'")
    end if
  end subroutine fail_to_read

  subroutine fail_to_hold(error, file, path)
    type(error_t), allocatable, intent(inout) :: error
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path

    call raise(error, exit_machine, "not enough memory to read '"//path//"' in '"//file%path//"'")
  end subroutine fail_to_hold

  !> Raise a machine error with the operating system's reason, if it gave one.
  !>
  !> To be called before any other call of the library: each of them clears the reason.
  subroutine fail(error, message)
    type(error_t), allocatable, intent(inout) :: error
    character(*), intent(in) :: message
    type(reason_t) :: reason

    reason = why()
    if (reason%locked == 1) then
      call raise(error, exit_machine, message//': another program has the file open')
    else if (reason%length > 0) then
      call raise(error, exit_machine, message//': '//text_of(reason%text(:reason%length)))
    else
      call raise(error, exit_machine, message)
    end if
  end subroutine fail

  !> What the operating system said about the last failed call.
  function why() result(reason)
    type(reason_t), target :: reason
    integer(c_int64_t), parameter :: default_stack = 0
    integer(c_int), parameter :: from_the_cause = 0
    integer(c_int) :: ignored

    reason%length = 0
    reason%locked = 0
    reason%text = ' '
    ignored = walk_error_stack(default_stack, from_the_cause, c_funloc(find_reason), c_loc(reason))
  end function why

  !> Keep the system's words of one entry of the error stack: "..., error message = '<words>', ...".
  function find_reason(depth, entry_address, client) result(status) bind(c)
    integer(c_int), value :: depth
    type(c_ptr), value :: entry_address, client
    integer(c_int) :: status
    character(*), parameter :: mark = "error message = '"
    type(stack_entry_t), pointer :: entry
    type(reason_t), pointer :: reason
    character(c_char), pointer :: bytes(:)
    character(:), allocatable :: description
    integer :: first, n

    status = 0
    call c_f_pointer(client, reason)
    call c_f_pointer(entry_address, entry)
    if (depth < 0 .or. .not. c_associated(entry%description)) return
    call c_f_pointer(entry%description, bytes, [c_length(entry%description)])
    description = text_of(bytes)
    if (index(description, 'unable to lock file') > 0) reason%locked = 1
    first = index(description, mark)
    if (first == 0 .or. reason%length > 0) return
    description = description(first + len(mark):)
    n = min(index(description//"'", "'") - 1, size(reason%text))
    reason%text(:n) = transfer(description(:n), reason%text, n)
    reason%length = n
  end function find_reason

end module hdf5_io_mod
