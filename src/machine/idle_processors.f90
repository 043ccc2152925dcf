!> How many processors stand idle that the process may use.
module idle_processors_mod
  use kinds_mod, only: wp, i8
  use text_mod, only: string_t
  use control_groups_mod, only: list_groups
  implicit none
  private

  public :: processor_time_t, processor_time, idle_processors

  integer, parameter :: most_processors = 4096
  real(wp), parameter :: least_time = 0.05_wp !! in which idleness can be seen [s]
  real(wp), parameter :: ticks = 100.0_wp     !! of the system's clock [1/s]
  real(wp), parameter :: little = 0.15_wp     !! of a processor that others may use

  !> What the processors have done since the machine began.
  type :: processor_time_t
    integer :: n = 0                   !! that the process may use; 0: the system does not tell
    integer(i8) :: idle = 0, total = 0 !! of these together [tick]
  end type processor_time_t

contains

  !> What the processors that the process may use have done so far.
  type(processor_time_t) function processor_time(root) result(time)
    character(*), intent(in), optional :: root !! above /proc (default: none)
    character(:), allocatable :: at
    character(512) :: line
    logical :: is_allowed(0:most_processors - 1)
    integer(i8) :: parts(8) !! user, nice, system, idle, iowait, irq, softirq, steal
    integer :: unit, status, number

    at = ''
    if (present(root)) at = root
    call find_allowed(at//'/proc/self/status', is_allowed)
    open (newunit=unit, file=at//'/proc/stat', action='read', status='old', iostat=status)
    if (status /= 0) return
    do
      read (unit, '(a)', iostat=status) line
      if (status /= 0) exit
      if (line(:3) /= 'cpu' .or. line(4:4) == ' ') cycle
      read (line(4:), *, iostat=status) number, parts
      if (status /= 0) exit
      if (number < 0 .or. number >= most_processors) cycle
      if (.not. is_allowed(number)) cycle
      time%n = time%n + 1
      time%idle = time%idle + parts(4) + parts(5)
      time%total = time%total + sum(parts)
    end do
    close (unit)
  end function processor_time

  !> Processors that were idle between two looks, beside the one that the process itself used; 0
  !> where the time between them is too short to tell.
  integer function idle_processors(before, now, root) result(n)
    type(processor_time_t), intent(in) :: before, now
    character(*), intent(in), optional :: root !! above /proc and /sys (default: none)
    character(:), allocatable :: at

    at = ''
    if (present(root)) at = root
    n = 0
    if (now%n < 2 .or. before%n /= now%n) return
    if (real(now%total - before%total, wp) < least_time*ticks*now%n) return
    n = floor(now%n*real(now%idle - before%idle, wp)/real(now%total - before%total, wp) + little)
    n = max(0, min(n, now%n - 1, granted(at) - 1))
  end function idle_processors

  !> Which processors the process may use: "0-3,8" behind a label; all where there is none.
  subroutine find_allowed(path, is_allowed)
    character(*), intent(in) :: path
    logical, intent(out) :: is_allowed(0:)
    character(*), parameter :: label = 'Cpus_allowed_list:'
    character(4096) :: line
    integer :: unit, status, begin, length, dash, first, last

    is_allowed = .true.
    open (newunit=unit, file=path, action='read', status='old', iostat=status)
    if (status /= 0) return
    do
      read (unit, '(a)', iostat=status) line
      if (status /= 0) exit
      if (line(:len(label)) /= label) cycle
      is_allowed = .false.
      begin = len(label) + 1
      do while (begin <= len_trim(line))
        length = index(line(begin:)//',', ',') - 1
        dash = index(line(begin:begin + length - 1), '-')
        if (dash == 0) dash = length + 1
        read (line(begin:begin + dash - 2), *, iostat=status) first
        if (status /= 0) exit
        last = first
        if (dash <= length) read (line(begin + dash:begin + length - 1), *, iostat=status) last
        if (status /= 0) exit
        is_allowed(max(0, first):min(ubound(is_allowed, 1), last)) = .true.
        begin = begin + length + 1
      end do
      exit
    end do
    close (unit)
  end subroutine find_allowed

  !> Whole processors whose time the control groups grant.
  integer function granted(root) result(n)
    character(*), intent(in) :: root
    type(string_t), allocatable :: of_version_2(:), of_version_1(:)
    integer :: i

    n = most_processors
    call list_groups(root, 'cpu', of_version_2, of_version_1)
    do i = 1, size(of_version_2)
      call lower(numbers_of(of_version_2(i)%text//'cpu.max', 2))
    end do
    do i = 1, size(of_version_1)
      call lower([numbers_of(of_version_1(i)%text//'cpu.cfs_quota_us', 1), &
        numbers_of(of_version_1(i)%text//'cpu.cfs_period_us', 1)])
    end do

  contains

    !> A quota in every period; without one it is no number, or negative.
    subroutine lower(quota)
      integer(i8), intent(in) :: quota(2) !! and its period [1e-6 s]

      if (any(quota <= 0)) return
      n = int(min(int(n, i8), quota(1)/quota(2)))
    end subroutine lower

  end function granted

  !> The numbers of a file's first line; -1 where they are not there.
  function numbers_of(path, n) result(numbers)
    character(*), intent(in) :: path
    integer, intent(in) :: n
    integer(i8) :: numbers(n)
    integer :: unit, status

    numbers = -1
    open (newunit=unit, file=path, action='read', status='old', iostat=status)
    if (status /= 0) return
    read (unit, *, iostat=status) numbers
    if (status /= 0) numbers = -1 ! "max"
    close (unit)
  end function numbers_of

end module idle_processors_mod
