!> How much memory and disk this process may still take.
!>
!> What a Linux system says in /proc and /sys, or when asked; where it says nothing there is no
!> limit.
module resource_limits_mod
  use, intrinsic :: iso_c_binding, only: c_associated, c_int, c_int64_t, c_long, &
    c_null_char, c_ptr, c_size_t
  use errors_mod, only: error_t, raise, exit_machine
  use kinds_mod, only: i8
  use libc_mod, only: c_free, c_getrlimit, c_malloc_trim, c_statvfs, real_malloc
  use text_mod, only: string_t, to_text
  use control_groups_mod, only: list_groups
  implicit none
  private

  public :: has_memory, check_library_room, check_stack_room, memory_left, address_space_left, &
    data_left, disk_left, file_limit, resident_bytes, release_freed_memory, no_limit

  integer(i8), parameter :: no_limit = huge(1_i8)

contains

  !> Whether so many bytes can be had and the machine has them: to be asked before an ALLOCATE whose
  !> failure can be told better than by the end of the program.
  logical function has_memory(bytes)
    integer(i8), intent(in) :: bytes
    integer(i8), parameter :: little = 1000000_i8 !! not worth the time it takes to ask the machine

    has_memory = bytes <= little
    if (.not. has_memory) has_memory = bytes <= memory_left()
    if (has_memory) has_memory = is_granted(bytes)
  end function has_memory

  !> Refuse to go on where a limit (ulimit -v, ulimit -d) leaves a library no memory to work in:
  !> not every one survives an allocation of its own that fails.
  subroutine check_library_room(bytes, task, error)
    integer(i8), intent(in) :: bytes      !! that it may ask for in small pieces
    character(*), intent(in) :: task      !! what it is to do, as "write the result file"
    type(error_t), allocatable, intent(out) :: error !! no memory
    integer(i8), parameter :: megabyte = 1000000_i8

    if (.not. is_granted(bytes)) call raise(error, exit_machine, 'bipot: error: not enough '// &
      'memory to '//task//': it may take '//to_text(max(1_i8, bytes/megabyte))//' MB and '// &
      to_text(memory_left()/megabyte)//' MB are left to the process (ulimit -v, ulimit -d)')
  end subroutine check_library_room

  !> Refuse to begin where the limit on the stack (ulimit -s) is too low for the program and its
  !> libraries: a stack that overflows is the end of a process, without a word.
  subroutine check_stack_room(error)
    type(error_t), allocatable, intent(out) :: error !! too little stack
    integer(c_int), parameter :: stack_size = 3 !! RLIMIT_STACK
    integer(i8), parameter :: needed = 1024_i8*1024_i8
    !! eight times what the decks of input/ take [byte]
    integer(c_int64_t) :: limits(2)
    integer(i8) :: stack

    stack = no_limit
    if (c_getrlimit(stack_size, limits) == 0) call lower(stack, 1_i8, limits(1), 0_i8)
    if (stack < needed) call raise(error, exit_machine, 'bipot: error: the limit on the stack '// &
      '(ulimit -s) is '//to_text(stack/1024_i8)//' kB; the program and its libraries need '// &
      to_text(needed/1024_i8)//' kB')
  end subroutine check_stack_room

  !> Whether the system grants so many bytes; it need not have them.
  logical function is_granted(bytes)
    integer(i8), intent(in) :: bytes
    type(c_ptr) :: probe

    is_granted = bytes >= 0
    if (.not. is_granted) return
    probe = real_malloc(int(max(bytes, 1_i8), c_size_t))
    is_granted = c_associated(probe)
    if (is_granted) call c_free(probe)
  end function is_granted

  !> Bytes of memory that this process can still get: the least of what the machine has free, what
  !> its control groups leave, and what its own limits (ulimit -v, ulimit -d) leave.
  integer(i8) function memory_left(root) result(bytes)
    character(*), intent(in), optional :: root !! above /proc and /sys (default: none)
    character(:), allocatable :: at

    at = ''
    if (present(root)) at = root
    bytes = no_limit
    call lower(bytes, 1024_i8, number_after(at//'/proc/meminfo', 'MemAvailable:'), 0_i8)
    bytes = min(bytes, address_space_left(at), data_left(at))
    call look_at_groups(at, bytes)
  end function memory_left

  !> Bytes of addresses that this process can still reserve, touched or not (ulimit -v).
  integer(i8) function address_space_left(root) result(bytes)
    character(*), intent(in) :: root !! above /proc

    bytes = left_of(root, 'Max address space', 'VmSize:')
  end function address_space_left

  !> Bytes of its own that this process can still reserve, touched or not (ulimit -d).
  integer(i8) function data_left(root) result(bytes)
    character(*), intent(in) :: root !! above /proc

    bytes = left_of(root, 'Max data size', 'VmData:')
  end function data_left

  !> What a limit of the process leaves [bytes].
  integer(i8) function left_of(root, limit, used) result(bytes)
    character(*), intent(in) :: root, limit, used !! as the system calls limit and use

    bytes = no_limit
    call lower(bytes, 1_i8, number_after(root//'/proc/self/limits', limit), &
      1024_i8*number_after(root//'/proc/self/status', used))
  end function left_of

  !> Bytes that can still be written to the folder of `path`.
  integer(i8) function disk_left(path) result(bytes)
    character(*), intent(in) :: path !! of a file, which need not exist
    integer(c_long) :: buffer(32)
    character(:), allocatable :: folder

    folder = path(:index(path, '/', back=.true.))//'.'
    bytes = no_limit
    ! f_bsize, f_frsize, f_blocks, f_bfree, f_bavail: longs on every 64-bit Linux. What has no
    ! blocks at all (/proc, /sys) says nothing of its room.
    if (number_after('/proc/self/status', 'VmSize:') >= 0) then
      buffer = 0
      if (c_statvfs(folder//c_null_char, buffer) == 0 .and. buffer(3) > 0) then
        bytes = buffer(2)*buffer(5)
      end if
    end if
    bytes = min(bytes, file_limit())
  end function disk_left

  !> How long a file may become (ulimit -f) [bytes].
  integer(i8) function file_limit() result(bytes)
    integer(c_int), parameter :: file_size = 1 !! RLIMIT_FSIZE
    integer(c_int64_t) :: limits(2)

    bytes = no_limit
    ! Unlimited is the largest number without a sign, which is negative here.
    if (c_getrlimit(file_size, limits) == 0) call lower(bytes, 1_i8, limits(1), 0_i8)
  end function file_limit

  !> The memory of the process that is in the machine now; 0 where the system does not tell.
  integer(i8) function resident_bytes() result(bytes)

    bytes = 1024_i8*max(0_i8, number_after('/proc/self/status', 'VmRSS:'))
  end function resident_bytes

  !> Return memory that the process has freed to the system. The allocator keeps some of it, how
  !> much depends on its version and settings: the memory that is left would depend on them as well.
  subroutine release_freed_memory()
    integer(c_int) :: released

    released = c_malloc_trim(0_c_size_t)
  end subroutine release_freed_memory

  !> The memory of the process's control groups.
  subroutine look_at_groups(root, bytes)
    character(*), intent(in) :: root
    integer(i8), intent(inout) :: bytes
    type(string_t), allocatable :: of_version_2(:), of_version_1(:)
    integer :: i

    call list_groups(root, 'memory', of_version_2, of_version_1)
    do i = 1, size(of_version_2)
      call look_at_group(of_version_2(i)%text, 'memory.max', 'memory.current', 'inactive_file', &
        bytes)
    end do
    do i = 1, size(of_version_1)
      call look_at_group(of_version_1(i)%text, 'memory.limit_in_bytes', 'memory.usage_in_bytes', &
        'total_inactive_file', bytes)
    end do
  end subroutine look_at_groups

  !> One group: what it may have less what it has, files apart that can be dropped.
  subroutine look_at_group(folder, limit, usage, droppable, bytes)
    character(*), intent(in) :: folder, limit, usage, droppable
    integer(i8), intent(inout) :: bytes

    call lower(bytes, 1_i8, number_after(folder//limit, ''), number_after(folder//usage, '') - &
      max(0_i8, number_after(folder//'memory.stat', droppable//' ')))
  end subroutine look_at_group

  !> Take `limit` units less `used` bytes for `bytes` where that is less; a negative limit is none.
  pure subroutine lower(bytes, unit, limit, used)
    integer(i8), intent(inout) :: bytes
    integer(i8), intent(in) :: unit, limit, used

    if (limit < 0) return
    bytes = min(bytes, max(0_i8, unit*limit - max(0_i8, used)))
  end subroutine lower

  !> The number behind `label` at the start of a line of a file; -1 where there is none.
  integer(i8) function number_after(path, label) result(number)
    character(*), intent(in) :: path, label
    integer :: unit, status
    character(256) :: line

    number = -1
    open (newunit=unit, file=path, action='read', status='old', iostat=status)
    if (status /= 0) return
    do
      read (unit, '(a)', iostat=status) line
      if (status /= 0) exit
      if (line(:len(label)) /= label) cycle
      read (line(len(label) + 1:), *, iostat=status) number
      if (status /= 0) number = -1 ! "max", "unlimited"
      exit
    end do
    close (unit)
  end function number_after

end module resource_limits_mod
