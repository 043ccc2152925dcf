!> A checksum of all in an open file that does not change while the file is written to: its names,
!> descriptions, types and extents, and the numbers of datasets that do not grow.
module hdf5_contents_mod
  use, intrinsic :: iso_c_binding, only: c_loc, c_ptr
  use hdf5, only: hid_t, hsize_t, size_t, h5aclose_f, h5aget_name_f, h5aget_num_attrs_f, &
    h5aget_space_f, h5aget_type_f, h5aopen_by_idx_f, h5aread_f, h5dget_create_plist_f, &
    h5dget_space_f, h5dget_type_f, h5dread_f, h5gget_obj_info_idx_f, h5gn_members_f, h5oclose_f, &
    h5oopen_f, h5pclose_f, h5pfill_value_defined_f, h5pget_chunk_f, h5pget_filter_f, &
    h5pget_layout_f, h5pget_nfilters_f, h5sclose_f, h5sget_simple_extent_dims_f, &
    h5sget_simple_extent_ndims_f, h5sget_simple_extent_npoints_f, h5tclose_f, h5tget_class_f, &
    h5tget_cset_f, h5tget_size_f, h5tget_strpad_f, h5tis_variable_str_f, H5D_CHUNKED_F, &
    H5G_DATASET_F, H5G_GROUP_F, H5S_UNLIMITED_F, H5T_STRING_F, H5_INDEX_NAME_F, H5_ITER_INC_F
  use checksum_mod, only: checksum_of, extended
  use errors_mod, only: error_t, raise, exit_wrong_input
  use hdf5_files_mod, only: hdf5_file_t, fail_to_hold
  use hdf5_types_mod, only: no_id, kind_of_type
  use kinds_mod, only: i1, i8
  use resource_limits_mod, only: has_memory
  use text_mod, only: printable
  implicit none
  private

  public :: checksum_of_contents

contains

  !> The sum over all groups, datasets and attributes of their checksums. What changes, or is not
  !> known yet, is named in `changing`, a line each: the path of a dataset, or object@attribute,
  !> whose values do not count. They must be readable all the same.
  subroutine checksum_of_contents(file, changing, sum, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: changing
    integer(i8), intent(out) :: sum
    type(error_t), allocatable, intent(inout) :: error !! something cannot be read
    integer, parameter :: deepest = 8
    character, parameter :: nl = new_line('a')
    integer :: n_left
    integer(i8) :: file_bytes

    sum = 0
    inquire (file=file%path, size=file_bytes)
    n_left = 20000 ! more than any file has; one that holds itself has no end
    if (allocated(error)) return
    call add_group('', 0)

  contains

    recursive subroutine add_group(path, depth)
      character(*), intent(in) :: path !! empty: the root
      integer, intent(in) :: depth
      character(1024) :: name
      integer :: i, n, kind, status

      if (depth > deepest) call refuse(path)
      if (allocated(error)) return
      call h5gn_members_f(file%id, path//'/', n, status)
      do i = 0, n - 1
        if (status < 0) exit
        n_left = n_left - 1
        if (n_left < 0) call refuse(path)
        if (allocated(error)) return
        name = ''
        call h5gget_obj_info_idx_f(file%id, path//'/', i, name, kind, status)
        if (status < 0) exit
        call add_object(path//'/'//trim(name), kind, depth)
        if (allocated(error)) return
      end do
      if (status < 0) call refuse(path//'/')
    end subroutine add_group

    recursive subroutine add_object(path, kind, depth)
      character(*), intent(in) :: path
      integer, intent(in) :: kind, depth
      integer(hid_t) :: object
      integer :: status, ignored

      object = no_id
      sum = sum + checksum_of(path)
      status = -1
      ! A link that is none of the file's own objects leads out of what is checked.
      if (kind == H5G_GROUP_F .or. kind == H5G_DATASET_F) call h5oopen_f(file%id, path, object, &
        status)
      if (status < 0) object = no_id
      if (status >= 0) call add_attributes(path, object, status)
      if (status >= 0 .and. kind == H5G_DATASET_F) call add_values(path, object, &
        .false., status)
      if (status < 0 .and. .not. allocated(error)) call refuse(path)
      if (object /= no_id) call h5oclose_f(object, ignored)
      if (.not. allocated(error) .and. kind == H5G_GROUP_F) call add_group(path, depth + 1)
    end subroutine add_object

    subroutine add_attributes(path, object, status)
      character(*), intent(in) :: path
      integer(hid_t), intent(in) :: object
      integer, intent(out) :: status
      integer, parameter :: longest_name = 256
      character(longest_name) :: name
      integer(hid_t) :: attribute
      integer :: i, n, ignored

      call h5aget_num_attrs_f(object, n, status)
      do i = 1, n
        if (status < 0) return
        call h5aopen_by_idx_f(object, '.', H5_INDEX_NAME_F, H5_ITER_INC_F, int(i - 1, hsize_t), &
          attribute, status)
        if (status < 0) return
        name = ''
        call h5aget_name_f(attribute, int(longest_name, size_t), name, status)
        if (status >= 0) call add_values(path//'@'//trim(name), attribute, &
          .true., status)
        call h5aclose_f(attribute, ignored)
      end do
    end subroutine add_attributes

    !> Add the values of a dataset, unless it grows, or of an attribute, unless they are changing.
    subroutine add_values(path, owner, is_attribute, status)
      character(*), intent(in) :: path
      integer(hid_t), intent(in) :: owner !! the dataset or attribute
      logical, intent(in) :: is_attribute
      integer, intent(out) :: status
      integer(hid_t) :: type_id, space
      integer(i8) :: checksum
      integer(i1), allocatable, target :: bytes(:)
      logical :: grows
      integer :: ignored
      type(c_ptr) :: address

      checksum = checksum_of(path)
      if (is_attribute) then
        call h5aget_type_f(owner, type_id, status)
        if (status < 0) return
        call h5aget_space_f(owner, space, status)
      else
        call h5dget_type_f(owner, type_id, status)
        if (status < 0) return
        call h5dget_space_f(owner, space, status)
      end if
      if (status >= 0) then
        call extend_by_type(type_id, checksum, status)
        if (status >= 0 .and. .not. is_attribute) call extend_by_layout(owner, space, checksum, &
          status)
        grows = .false.
        if (status >= 0) call extend_by_extents(space, checksum, status, grows)
        allocate (bytes(0))
        if (status >= 0 .and. .not. grows) call make_room(path, type_id, space, bytes, status)
        if (status >= 0 .and. size(bytes) > 0) then
          address = c_loc(bytes)
          if (is_attribute) then
            call h5aread_f(owner, type_id, address, status)
          else
            call h5dread_f(owner, type_id, address, status)
          end if
          if (.not. is_changing(path)) checksum = extended(checksum, address, size(bytes, kind=i8))
        end if
        call h5sclose_f(space, ignored)
      end if
      call h5tclose_f(type_id, ignored)
      sum = sum + checksum
    end subroutine add_values

    !> Bytes for all values of a dataset or an attribute.
    subroutine make_room(path, type_id, space, bytes, status)
      character(*), intent(in) :: path
      integer(hid_t), intent(in) :: type_id, space
      integer(i1), allocatable, target, intent(inout) :: bytes(:)
      integer, intent(out) :: status
      integer(hsize_t) :: n
      integer(size_t) :: one

      call h5sget_simple_extent_npoints_f(space, n, status)
      if (status < 0) n = 0 ! what the library's Fortran says of no points at all
      call h5tget_size_f(type_id, one, status)
      if (status < 0) return
      status = -1
      ! Nothing of this kind is compressed but sets, and these are smaller than the mesh.
      if (n < 0 .or. one < 1 .or. one > file_bytes/max(1_hsize_t, n)) return
      if (.not. has_memory(n*one)) then
        call fail_to_hold(error, file, path)
        return
      end if
      deallocate (bytes)
      allocate (bytes(n*one))
      status = 0
    end subroutine make_room

    subroutine refuse(path)
      character(*), intent(in) :: path

      call raise(error, exit_wrong_input, "'"//file%path//"' is damaged: cannot read '"// &
        printable(path)//"'")
    end subroutine refuse

    pure logical function is_changing(path)
      character(*), intent(in) :: path

      is_changing = index(nl//changing//nl, nl//path//nl) > 0
    end function is_changing

  end subroutine checksum_of_contents

  !> What a type is: text of fixed length, or numbers as the program writes them. A type that
  !> differs from those in a single bit is none of either.
  subroutine extend_by_type(type_id, checksum, status)
    integer(hid_t), intent(in) :: type_id
    integer(i8), intent(inout) :: checksum
    integer, intent(out) :: status
    integer :: class, first, second
    integer(size_t) :: bytes
    logical :: varies

    first = 0
    second = 0
    call h5tget_class_f(type_id, class, status)
    if (status >= 0) call h5tget_size_f(type_id, bytes, status)
    if (status < 0) return
    if (class == H5T_STRING_F) then
      call h5tis_variable_str_f(type_id, varies, status)
      if (varies) status = -1
      if (status >= 0) call h5tget_strpad_f(type_id, first, status)
      if (status >= 0) call h5tget_cset_f(type_id, second, status)
    else
      first = kind_of_type(type_id)
      if (first == 0) status = -1
    end if
    checksum = extended(checksum, [int(class, i8), int(bytes, i8), int(first, i8), &
      int(second, i8)])
  end subroutine extend_by_type

  !> The extents, but those that grow.
  subroutine extend_by_extents(space, checksum, status, grows)
    integer(hid_t), intent(in) :: space
    integer(i8), intent(inout) :: checksum
    integer, intent(out) :: status
    logical, intent(out) :: grows !! along one of them
    integer(hsize_t), allocatable :: extents(:), limits(:)
    integer :: rank

    grows = .false.
    call h5sget_simple_extent_ndims_f(space, rank, status)
    if (status < 0) return
    allocate (extents(rank), limits(rank))
    if (rank > 0) call h5sget_simple_extent_dims_f(space, extents, limits, status)
    if (status < 0) return
    where (limits == H5S_UNLIMITED_F) extents = -1
    grows = any(limits == H5S_UNLIMITED_F)
    checksum = extended(checksum, [int(extents, i8), int(limits, i8)])
  end subroutine extend_by_extents

  !> How the numbers are stored: chunks, filters, what fills them.
  subroutine extend_by_layout(dataset, space, checksum, status)
    integer(hid_t), intent(in) :: dataset, space
    integer(i8), intent(inout) :: checksum
    integer, intent(out) :: status
    integer, parameter :: most_values = 20
    integer(hid_t) :: creation
    integer(hsize_t), allocatable :: chunk(:)
    integer(size_t) :: n_values
    integer :: layout, fill, rank, n, i, flags, filter, values(most_values), ignored
    character(64) :: name

    call h5sget_simple_extent_ndims_f(space, rank, status)
    if (status < 0) return
    call h5dget_create_plist_f(dataset, creation, status)
    if (status < 0) return
    allocate (chunk(rank), source=0_hsize_t)
    call h5pget_layout_f(creation, layout, status)
    ! Whether there is one is told otherwise before a file is closed than after.
    if (status >= 0) call h5pfill_value_defined_f(creation, fill, status)
    if (status >= 0) checksum = extended(checksum, [int(layout, i8)])
    if (status >= 0 .and. layout == H5D_CHUNKED_F) then
      call h5pget_chunk_f(creation, rank, chunk, status) ! the rank, or -1
      if (status /= rank) status = -1
      if (status >= 0) checksum = extended(checksum, int(chunk, i8))
      if (status >= 0) call h5pget_nfilters_f(creation, n, status)
      do i = 0, n - 1
        if (status < 0) exit
        values = 0
        n_values = most_values
        call h5pget_filter_f(creation, i, flags, n_values, values, len(name, size_t), name, &
          filter, status)
        if (status >= 0) checksum = extended(checksum, int([filter, flags, values], i8))
      end do
    end if
    call h5pclose_f(creation, ignored)
  end subroutine extend_by_layout

end module hdf5_contents_mod
