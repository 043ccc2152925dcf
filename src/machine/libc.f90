!> The C library and the system's own procedures, declared once: only files of this folder may call
!> them, and the main program its `exit`.
!>
!> Where C returns a status, 0 says that it worked, unless a line here says otherwise; a text ends
!> in a null character. Numbers of signals are those of Linux.
module libc_mod
  use, intrinsic :: iso_c_binding, only: c_char, c_funptr, c_int, c_int64_t, c_intptr_t, c_long, &
    c_ptr, c_size_t
  implicit none
  private

  public :: c_exit, c_exit_at_once, c_errno_location, c_setenv, c_gethostname, c_isatty, c_usleep
  public :: c_signal, c_raise, c_alarm, sig_dfl, sig_ign
  public :: sigabrt, sigalrm, sigbus, sigfpe, sigill, sigint, sigpipe, sigsegv, sigterm, sigxcpu
  public :: sigxfsz
  public :: c_fork, c_waitpid, c_execv, c_pipe, c_getrlimit, c_setrlimit
  public :: real_malloc, real_realloc, real_calloc, c_free, c_malloc_trim
  public :: c_madvise, c_strlen, c_dlsym
  public :: c_read, c_write, c_close, c_fopen, c_fileno, c_fsync, c_fclose
  public :: c_opendir, c_readdir, c_dirfd, c_closedir, c_flock, c_rename, c_unlink, c_readlink
  public :: c_statvfs

  integer(c_int), parameter :: sigint = 2, sigill = 4, sigabrt = 6, sigbus = 7, sigfpe = 8
  integer(c_int), parameter :: sigsegv = 11, sigpipe = 13, sigalrm = 14, sigterm = 15
  integer(c_int), parameter :: sigxcpu = 24, sigxfsz = 25
  integer(c_intptr_t), parameter :: sig_dfl = 0 !! what a signal does where nobody handles it
  integer(c_intptr_t), parameter :: sig_ign = 1 !! the handler of a signal that is ignored

  ! ------------------------------------------------------------------ the process

  interface
    subroutine c_exit(status) bind(c, name='exit')
      import :: c_int
      implicit none
      integer(c_int), value :: status
    end subroutine c_exit

    !> End the process without cleaning up, which would need memory; a signal handler may call it.
    subroutine c_exit_at_once(status) bind(c, name='_exit')
      import :: c_int
      implicit none
      integer(c_int), value :: status
    end subroutine c_exit_at_once

    !> Where the C library on Linux keeps the number of the last error.
    function c_errno_location() result(address) bind(c, name='__errno_location')
      import :: c_ptr
      implicit none
      type(c_ptr) :: address
    end function c_errno_location

    function c_setenv(name, value, overwrite) result(status) bind(c, name='setenv')
      import :: c_char, c_int
      implicit none
      character(c_char), intent(in) :: name(*), value(*)
      integer(c_int), value :: overwrite
      integer(c_int) :: status
    end function c_setenv

    !> The name of the machine.
    function c_gethostname(name, room) result(status) bind(c, name='gethostname')
      import :: c_int, c_ptr, c_size_t
      implicit none
      type(c_ptr), value :: name
      integer(c_size_t), value :: room
      integer(c_int) :: status
    end function c_gethostname

    !> 1 when the file descriptor is a terminal.
    function c_isatty(descriptor) result(answer) bind(c, name='isatty')
      import :: c_int
      implicit none
      integer(c_int), value :: descriptor
      integer(c_int) :: answer
    end function c_isatty

    !> Sleep; at most a second.
    function c_usleep(microseconds) result(status) bind(c, name='usleep')
      import :: c_int
      implicit none
      integer(c_int), value :: microseconds
      integer(c_int) :: status
    end function c_usleep

    !> Set what a signal does, the handler as an address; gives what it did before. The handler
    !> stays set, and what the signal interrupts goes on (BSD's semantics; the argument of SIGACTION
    !> has a layout of its own on every system).
    function c_signal(number, handler) result(before) bind(c, name='signal')
      import :: c_int, c_intptr_t
      implicit none
      integer(c_int), value :: number
      integer(c_intptr_t), value :: handler
      integer(c_intptr_t) :: before
    end function c_signal

    !> Send the process a signal.
    function c_raise(number) result(status) bind(c, name='raise')
      import :: c_int
      implicit none
      integer(c_int), value :: number
      integer(c_int) :: status
    end function c_raise

    !> Send the process a SIGALRM in so many seconds, with 0 none any more; gives those that were
    !> left of another one.
    function c_alarm(seconds) result(left) bind(c, name='alarm')
      import :: c_int
      implicit none
      integer(c_int), value :: seconds
      integer(c_int) :: left
    end function c_alarm

    function c_fork() result(process) bind(c, name='fork')
      import :: c_int
      implicit none
      integer(c_int) :: process
    end function c_fork

    function c_waitpid(process, status, options) result(found) bind(c, name='waitpid')
      import :: c_int
      implicit none
      integer(c_int), value :: process, options
      integer(c_int), intent(out) :: status
      integer(c_int) :: found
    end function c_waitpid

    function c_execv(path, arguments) result(status) bind(c, name='execv')
      import :: c_char, c_int, c_ptr
      implicit none
      character(c_char), intent(in) :: path(*)
      type(c_ptr), intent(in) :: arguments(*)
      integer(c_int) :: status
    end function c_execv

    function c_pipe(ends) result(status) bind(c, name='pipe')
      import :: c_int
      implicit none
      integer(c_int), intent(out) :: ends(2)
      integer(c_int) :: status
    end function c_pipe

    !> A limit of the process, now and at most.
    function c_getrlimit(resource, limits) result(status) bind(c, name='getrlimit')
      import :: c_int, c_int64_t
      implicit none
      integer(c_int), value :: resource
      integer(c_int64_t), intent(out) :: limits(2)
      integer(c_int) :: status
    end function c_getrlimit

    function c_setrlimit(resource, limits) result(status) bind(c, name='setrlimit')
      import :: c_int, c_int64_t
      implicit none
      integer(c_int), value :: resource
      integer(c_int64_t), intent(in) :: limits(2)
      integer(c_int) :: status
    end function c_setrlimit
  end interface

  ! ------------------------------------------------------------------ memory

  interface
    ! Null where there is no memory: the library's own, past src/machine/runtime_failures.f90.

    function real_malloc(bytes) result(address) bind(c, name='__real_malloc')
      import :: c_ptr, c_size_t
      implicit none
      integer(c_size_t), value :: bytes
      type(c_ptr) :: address
    end function real_malloc

    function real_realloc(old, bytes) result(address) bind(c, name='__real_realloc')
      import :: c_ptr, c_size_t
      implicit none
      type(c_ptr), value :: old
      integer(c_size_t), value :: bytes
      type(c_ptr) :: address
    end function real_realloc

    function real_calloc(n, bytes) result(address) bind(c, name='__real_calloc')
      import :: c_ptr, c_size_t
      implicit none
      integer(c_size_t), value :: n, bytes
      type(c_ptr) :: address
    end function real_calloc

    subroutine c_free(address) bind(c, name='free')
      import :: c_ptr
      implicit none
      type(c_ptr), value :: address
    end subroutine c_free

    !> Give what was freed back to the system, but `kept` bytes: 1 where that was anything, else 0.
    function c_malloc_trim(kept) result(released) bind(c, name='malloc_trim')
      import :: c_int, c_size_t
      implicit none
      integer(c_size_t), value :: kept
      integer(c_int) :: released
    end function c_malloc_trim

    !> Say what a stretch of memory will be used for.
    function c_madvise(address, bytes, advice) result(status) bind(c, name='madvise')
      import :: c_int, c_intptr_t, c_size_t
      implicit none
      integer(c_intptr_t), value :: address
      integer(c_size_t), value :: bytes
      integer(c_int), value :: advice
      integer(c_int) :: status
    end function c_madvise

    function c_strlen(text) result(length) bind(c, name='strlen')
      import :: c_ptr, c_size_t
      implicit none
      type(c_ptr), value :: text
      integer(c_size_t) :: length
    end function c_strlen

    !> The address of a procedure of a loaded library; null where there is none.
    function c_dlsym(handle, symbol) result(address) bind(c, name='dlsym')
      import :: c_ptr, c_funptr, c_char
      implicit none
      type(c_ptr), value :: handle
      character(c_char), intent(in) :: symbol(*)
      type(c_funptr) :: address
    end function c_dlsym
  end interface

  ! ------------------------------------------------------------------ files

  interface
    function c_read(descriptor, bytes, length) result(got) bind(c, name='read')
      import :: c_int, c_intptr_t, c_ptr, c_size_t
      implicit none
      integer(c_int), value :: descriptor
      type(c_ptr), value :: bytes
      integer(c_size_t), value :: length
      integer(c_intptr_t) :: got
    end function c_read

    function c_write(descriptor, bytes, length) result(written) bind(c, name='write')
      import :: c_int, c_char, c_size_t, c_intptr_t
      implicit none
      integer(c_int), value :: descriptor
      character(c_char), intent(in) :: bytes(*)
      integer(c_size_t), value :: length
      integer(c_intptr_t) :: written
    end function c_write

    function c_close(descriptor) result(status) bind(c, name='close')
      import :: c_int
      implicit none
      integer(c_int), value :: descriptor
      integer(c_int) :: status
    end function c_close

    function c_fopen(path, mode) result(file) bind(c, name='fopen')
      import :: c_char, c_ptr
      implicit none
      character(c_char), intent(in) :: path(*), mode(*)
      type(c_ptr) :: file
    end function c_fopen

    function c_fileno(file) result(descriptor) bind(c, name='fileno')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: file
      integer(c_int) :: descriptor
    end function c_fileno

    !> Wait until the disk has the file.
    function c_fsync(descriptor) result(status) bind(c, name='fsync')
      import :: c_int
      implicit none
      integer(c_int), value :: descriptor
      integer(c_int) :: status
    end function c_fsync

    function c_fclose(file) result(status) bind(c, name='fclose')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: file
      integer(c_int) :: status
    end function c_fclose

    function c_opendir(path) result(folder) bind(c, name='opendir')
      import :: c_char, c_ptr
      implicit none
      character(c_char), intent(in) :: path(*)
      type(c_ptr) :: folder
    end function c_opendir

    !> The next entry of a folder, null behind the last.
    function c_readdir(folder) result(entry) bind(c, name='readdir')
      import :: c_ptr
      implicit none
      type(c_ptr), value :: folder
      type(c_ptr) :: entry
    end function c_readdir

    function c_dirfd(folder) result(descriptor) bind(c, name='dirfd')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: folder
      integer(c_int) :: descriptor
    end function c_dirfd

    function c_closedir(folder) result(status) bind(c, name='closedir')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: folder
      integer(c_int) :: status
    end function c_closedir

    !> Lock an open file or folder; gone when it is closed.
    function c_flock(descriptor, operation) result(status) bind(c, name='flock')
      import :: c_int
      implicit none
      integer(c_int), value :: descriptor, operation
      integer(c_int) :: status
    end function c_flock

    function c_rename(old, new) result(status) bind(c, name='rename')
      import :: c_char, c_int
      implicit none
      character(c_char), intent(in) :: old(*), new(*)
      integer(c_int) :: status
    end function c_rename

    function c_unlink(path) result(status) bind(c, name='unlink')
      import :: c_char, c_int
      implicit none
      character(c_char), intent(in) :: path(*)
      integer(c_int) :: status
    end function c_unlink

    !> Where a link leads: the length of the text.
    function c_readlink(path, target, room) result(length) bind(c, name='readlink')
      import :: c_char, c_intptr_t, c_ptr, c_size_t
      implicit none
      character(c_char), intent(in) :: path(*)
      type(c_ptr), value :: target
      integer(c_size_t), value :: room
      integer(c_intptr_t) :: length
    end function c_readlink

    !> What the file system of a path holds.
    function c_statvfs(path, buffer) result(status) bind(c, name='statvfs')
      import :: c_int, c_long, c_char
      implicit none
      character(c_char), intent(in) :: path(*)
      integer(c_long), intent(inout) :: buffer(*)
      integer(c_int) :: status
    end function c_statvfs
  end interface

end module libc_mod
