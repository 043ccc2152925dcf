!> HDF5 files and their groups. Only hdf5_*.f90 see the library, each in typed procedures.
!>
!> All procedures that work inside an open file share one rule, so that a layout reads as a list:
!> their `error` is `intent(inout)`, and they do nothing once it is set. One check after the list
!> is enough. Extents are Fortran's, first index fastest; C and h5py see them reversed.
!>
!> Files are of the classic format: it survives a kill at any moment without being repaired.
module hdf5_files_mod
  use, intrinsic :: iso_c_binding, only: c_int, c_int64_t
  use hdf5, only: hid_t, size_t, h5dont_atexit_f, h5eset_auto_f, h5fclose_f, h5fcreate_f, &
    h5fflush_f, h5fis_hdf5_f, h5fopen_f, h5gclose_f, h5gcreate_f, h5get_libversion_f, &
    h5gget_obj_info_idx_f, h5gn_members_f, h5iis_valid_f, h5lexists_f, h5ocopy_f, &
    h5open_f, h5pclose_f, h5pcreate_f, h5pset_cache_f, h5pset_fclose_degree_f, &
    h5pset_istore_k_f, H5F_ACC_EXCL_F, H5F_ACC_RDONLY_F, H5F_ACC_RDWR_F, H5F_CLOSE_STRONG_F, &
    H5F_SCOPE_LOCAL_F, H5P_FILE_ACCESS_F, H5P_FILE_CREATE_F, H5T_STD_I32LE
  use errors_mod, only: error_t, raise, exit_machine, exit_wrong_input
  use hdf5_failures_mod, only: fail, reason_t, why
  use hdf5_types_mod, only: no_id
  use kinds_mod, only: i8, sp
  use text_mod, only: string_t, to_text
  implicit none
  private

  public :: hdf5_file_t
  public :: file_absent, file_readable, file_locked, file_foreign, file_damaged
  public :: look_at_file, create_file, open_file, flush_file, flush_object, &
    close_file, is_open, hdf5_version
  public :: create_group, exists, copy_object, list_members
  public :: fail_to_write, fail_to_read, fail_to_hold

  ! What `look_at_file` finds.
  integer, parameter :: file_absent = 0
  integer, parameter :: file_readable = 1
  integer, parameter :: file_locked = 2   !! another program writes it
  integer, parameter :: file_foreign = 3  !! not HDF5
  integer, parameter :: file_damaged = 4  !! HDF5, but cannot be opened

  !> An open file.
  type :: hdf5_file_t
    integer(hid_t) :: id = no_id !! for the other hdf5_ files alone
    character(:), allocatable :: path
  end type hdf5_file_t

  interface
    !> Hand all that belongs to an open object to the operating system. The library's Fortran has no
    !> procedure for this.
    function c_flush_object(id) result(status) bind(c, name='H5Oflush')
      import :: c_int, c_int64_t
      implicit none
      integer(c_int64_t), value :: id
      integer(c_int) :: status
    end function c_flush_object
  end interface

contains

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
  subroutine create_file(path, n_rows, file, error)
    character(*), intent(in) :: path
    integer, intent(in) :: n_rows !! that its datasets will have at most, if it is to survive a kill
    type(hdf5_file_t), intent(out) :: file
    type(error_t), allocatable, intent(out) :: error
    integer, parameter :: least = 128, most = 32767 ! half of the chunks of a B-tree node
    integer(hid_t) :: creation, access
    integer :: status, ignored

    call start_library()
    file%path = path
    access = strong_access()
    call h5pcreate_f(H5P_FILE_CREATE_F, creation, status)
    ! All chunks of a dataset in one node of its B-tree: when a node splits and the program is
    ! killed at that moment, old rows are lost.
    if (status >= 0) call h5pset_istore_k_f(creation, min(most, max(least, (n_rows + 1)/2)), status)
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
  !>
  !> A dataset keeps chunks in memory, by default up to a megabyte of them. What is written here is
  !> not looked at again: with less a run of many increments takes no more memory than a short one.
  integer(hid_t) function strong_access() result(access)
    integer(size_t), parameter :: slots = 521, chunk_cache = 65536 !! [byte]
    real(sp), parameter :: preference = 0.75_sp !! for chunks written in full, HDF5's default
    integer :: status

    call h5pcreate_f(H5P_FILE_ACCESS_F, access, status)
    call h5pset_fclose_degree_f(access, H5F_CLOSE_STRONG_F, status)
    call h5pset_cache_f(access, 0, slots, chunk_cache, preference, status)
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

  !> Hand all that belongs to an open group or dataset to the operating system: much less work than
  !> a flush of the file, and enough where the file has not become longer.
  subroutine flush_object(file, path, id, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path !! for messages
    integer(hid_t), intent(in) :: id
    type(error_t), allocatable, intent(inout) :: error

    if (allocated(error)) return
    if (c_flush_object(id) < 0) call fail_to_write(error, file, path)
  end subroutine flush_object

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

  pure logical function is_open(file) result(open)
    type(hdf5_file_t), intent(in) :: file

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
  logical function exists(file, path) result(found)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path !! '/a/b', not '/' alone
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

  !> Copy a group with all in it, or a dataset, to the same path of another file.
  subroutine copy_object(from, path, to, error)
    type(hdf5_file_t), intent(in) :: from, to
    character(*), intent(in) :: path
    type(error_t), allocatable, intent(inout) :: error
    integer :: status

    if (allocated(error)) return
    call h5ocopy_f(from%id, path, to%id, path, status)
    if (status < 0) call fail_to_write(error, to, path)
  end subroutine copy_object

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
    if (status < 0) call fail(error, "cannot list '"//group//"' in '"//file%path//"'", &
      exit_wrong_input)
  end subroutine list_members

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
        file%path//"'", exit_wrong_input)
    else
      call fail(error, "cannot read '"//path//"' in '"//file%path//"'", exit_wrong_input)
    end if
  end subroutine fail_to_read

  subroutine fail_to_hold(error, file, path)
    type(error_t), allocatable, intent(inout) :: error
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path

    call raise(error, exit_machine, "not enough memory to read '"//path//"' in '"//file%path//"'")
  end subroutine fail_to_hold

end module hdf5_files_mod
