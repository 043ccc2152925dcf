!> A file that is written beside its place, and takes it when it is complete.
!>
!> So a program that fails or is killed leaves what stood there alone.
module fresh_file_mod
  use, intrinsic :: iso_c_binding, only: c_associated, c_int, c_null_char, c_null_ptr, c_ptr
  use errors_mod, only: error_t, raise, exit_machine
  use libc_mod, only: c_closedir, c_dirfd, c_fclose, c_fileno, c_flock, c_fopen, c_fsync, &
    c_opendir, c_rename
  implicit none
  private

  public :: beginning_of, take_place, move_file, delete_file, settle
  public :: folder_lock_t, lock_folder, unlock_folder, is_locked

  !> A lock on a folder, held by at most one process at a time.
  type :: folder_lock_t
    private
    type(c_ptr) :: folder = c_null_ptr
  end type folder_lock_t

contains

  !> Where a file for `path` stands until it is complete.
  pure function beginning_of(path) result(beginning)
    character(*), intent(in) :: path
    character(:), allocatable :: beginning

    beginning = path//'.new'
  end function beginning_of

  !> Move the file to its place, which may be that of an older one.
  subroutine take_place(path, error)
    character(*), intent(in) :: path
    type(error_t), allocatable, intent(out) :: error !! the folder does not let it

    call move_file(beginning_of(path), path, error)
  end subroutine take_place

  !> Give a file another name, which may be that of an older one.
  subroutine move_file(from, to, error)
    character(*), intent(in) :: from, to
    type(error_t), allocatable, intent(out) :: error !! the folder does not let it

    if (c_rename(from//c_null_char, to//c_null_char) /= 0) call raise(error, exit_machine, &
      "cannot rename '"//from//"' to '"//to//"'")
  end subroutine move_file

  !> Wait until the disk has the file, where the file system tells: before it takes the place of
  !> what cannot be had again.
  subroutine settle(path)
    character(*), intent(in) :: path
    type(c_ptr) :: file
    integer(c_int) :: status

    file = c_fopen(path//c_null_char, 'r+'//c_null_char)
    if (.not. c_associated(file)) return
    status = c_fsync(c_fileno(file))
    status = c_fclose(file)
    if (status /= 0) return
  end subroutine settle

  !> Delete a file if it is there. That it cannot be deleted shows when its name is used again.
  subroutine delete_file(path)
    character(*), intent(in) :: path
    integer :: unit, status

    open (newunit=unit, file=path, status='old', action='readwrite', iostat=status)
    if (status /= 0) return
    close (unit, status='delete', iostat=status)
    if (status /= 0) close (unit)
  end subroutine delete_file

  !> Wait until no other process has the folder of `path` locked, and lock it; to be unlocked at
  !> once. Where the file system has no locks, or there is no such folder, nothing happens.
  type(folder_lock_t) function lock_folder(path) result(lock)
    character(*), intent(in) :: path !! of a file in it
    character(:), allocatable :: folder
    integer(c_int), parameter :: exclusive = 2
    integer(c_int) :: status

    folder = path(:index(path, '/', back=.true.))
    if (folder == '') folder = '.'
    lock%folder = c_opendir(folder//c_null_char)
    if (.not. c_associated(lock%folder)) return
    status = c_flock(c_dirfd(lock%folder), exclusive)
    if (status /= 0) return
  end function lock_folder

  !> Give the folder free.
  subroutine unlock_folder(lock)
    type(folder_lock_t), intent(inout) :: lock
    integer(c_int) :: status

    if (.not. c_associated(lock%folder)) return
    status = c_closedir(lock%folder)
    if (status == 0) lock%folder = c_null_ptr
  end subroutine unlock_folder

  !> Whether another process holds a lock on the file, be it empty yet.
  logical function is_locked(path) result(locked)
    character(*), intent(in) :: path
    type(c_ptr) :: file
    integer(c_int), parameter :: exclusive_at_once = 6
    integer(c_int) :: status

    locked = .false.
    ! For writing too: so a pipe does not wait for its other end.
    file = c_fopen(path//c_null_char, 'r+'//c_null_char)
    if (.not. c_associated(file)) return
    locked = c_flock(c_fileno(file), exclusive_at_once) /= 0
    status = c_fclose(file)
    if (status /= 0) return
  end function is_locked

end module fresh_file_mod
