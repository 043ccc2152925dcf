!> Several ranks: the only file that sees MPI.
!>
!> Rank 0, the host, runs the program; the other ranks serve it. The host announces a task to all,
!> and then all of them take part in it. A program for one process is linked with the empty MPI
!> that MUMPS's sequential library brings along: it has one rank, and nothing here is ever sent.
!>
!> MPI's own errors, a lost rank for one, end all ranks with a message: that is MPI's default.
module parallel_mod
  use, intrinsic :: iso_c_binding, only: c_int, c_ptr, c_loc, c_size_t, c_null_char
  use kinds_mod, only: wp, i8
  use libc_mod, only: c_gethostname
  use errors_mod, only: error_t, raise, exit_ok, exit_wrong_input
  use text_mod, only: to_text
  use system_mod, only: wall_seconds, cpu_seconds, peak_memory_bytes, sleep_for, set_environment
  use resource_limits_mod, only: resident_bytes
  use standard_streams_mod, only: write_to, standard_error
  implicit none
  private

  public :: start_ranks, end_ranks, n_ranks, is_host, communicator, has_launcher
  public :: announce, next_task, task_length, task_end, task_usage, task_pattern, task_stiffness, &
    task_double, task_single, task_rows, task_iterative
  public :: send_integers, send_reals, receive_integers, receive_reals, sum_over_ranks, all_ranks, &
    broadcast_text, end_all_ranks
  public :: usage_t, usage_of_others, tell_usage

  ! The one form in which the empty library has MPI's constants too.
  ! allow(deprecated-mpi-include)
  include 'mpif.h'

  ! What the host asks for; behind it stand numbers that the task explains.
  integer, parameter :: task_length = 3
  integer(i8), parameter :: task_end = 0       !! no task comes any more
  integer(i8), parameter :: task_usage = 1     !! memory and processor time so far
  integer(i8), parameter :: task_pattern = 2   !! take a part of the elements, list its entries
  integer(i8), parameter :: task_stiffness = 3 !! and sum their stiffness
  integer(i8), parameter :: task_double = 4    !! MUMPS in double precision
  integer(i8), parameter :: task_single = 5    !! and in single precision
  integer(i8), parameter :: task_rows = 6      !! take the elements at a part of the nodes, sum them
  integer(i8), parameter :: task_iterative = 7 !! solutions by iteration

  integer(c_int), parameter :: host = 0, tag_task = 1, tag_data = 2

  !> What the other ranks have used.
  type :: usage_t
    integer :: ranks_here = 1        !! ranks on the host's machine, the host too
    integer(i8) :: resident = 0      !! memory of the others on it now [bytes]
    integer(i8) :: peak = 0          !! and at most so far [bytes]
    real(wp) :: cpu = 0.0_wp         !! processor time of the others, wherever they are [s]
  end type usage_t

  ! By the names that MUMPS's own Fortran calls: both the real and the empty library have them.
  interface
    subroutine mpi_init(status) bind(c, name='mpi_init_')
      import :: c_int
      implicit none
      integer(c_int), intent(out) :: status
    end subroutine mpi_init

    subroutine mpi_initialized(flag, status) bind(c, name='mpi_initialized_')
      import :: c_int
      implicit none
      integer(c_int), intent(out) :: flag, status !! a Fortran logical, 0 for false
    end subroutine mpi_initialized

    subroutine mpi_finalize(status) bind(c, name='mpi_finalize_')
      import :: c_int
      implicit none
      integer(c_int), intent(out) :: status
    end subroutine mpi_finalize

    subroutine mpi_abort(comm, exit_status, status) bind(c, name='mpi_abort_')
      import :: c_int
      implicit none
      integer(c_int), intent(in) :: comm, exit_status
      integer(c_int), intent(out) :: status
    end subroutine mpi_abort

    subroutine mpi_comm_size(comm, number, status) bind(c, name='mpi_comm_size_')
      import :: c_int
      implicit none
      integer(c_int), intent(in) :: comm
      integer(c_int), intent(out) :: number, status
    end subroutine mpi_comm_size

    subroutine mpi_comm_rank(comm, rank, status) bind(c, name='mpi_comm_rank_')
      import :: c_int
      implicit none
      integer(c_int), intent(in) :: comm
      integer(c_int), intent(out) :: rank, status
    end subroutine mpi_comm_rank

    subroutine mpi_send(buffer, n, type, rank, tag, comm, status) bind(c, name='mpi_send_')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: buffer
      integer(c_int), intent(in) :: n, type, rank, tag, comm
      integer(c_int), intent(out) :: status
    end subroutine mpi_send

    subroutine mpi_recv(buffer, n, type, rank, tag, comm, envelope, status) &
      bind(c, name='mpi_recv_')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: buffer
      integer(c_int), intent(in) :: n, type, rank, tag, comm
      integer(c_int), intent(out) :: envelope(*), status
    end subroutine mpi_recv

    subroutine mpi_iprobe(rank, tag, comm, flag, envelope, status) bind(c, name='mpi_iprobe_')
      import :: c_int
      implicit none
      integer(c_int), intent(in) :: rank, tag, comm
      integer(c_int), intent(out) :: flag, envelope(*), status !! a Fortran logical, 0 for false
    end subroutine mpi_iprobe

    subroutine mpi_bcast(buffer, n, type, root, comm, status) bind(c, name='mpi_bcast_')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: buffer
      integer(c_int), intent(in) :: n, type, root, comm
      integer(c_int), intent(out) :: status
    end subroutine mpi_bcast

    subroutine mpi_reduce(buffer, total, n, type, operation, root, comm, status) &
      bind(c, name='mpi_reduce_')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: buffer, total
      integer(c_int), intent(in) :: n, type, operation, root, comm
      integer(c_int), intent(out) :: status
    end subroutine mpi_reduce
  end interface

contains

  ! ------------------------------------------------------------------ all ranks

  !> Join the ranks that were started together.
  subroutine start_ranks(error)
    type(error_t), allocatable, intent(out) :: error
    !! several processes of a program that is made for one
    character(16) :: wanted
    integer(c_int) :: status
    integer :: number, length, unread
    logical :: worked

    number = 1
    call get_environment_variable('OMPI_COMM_WORLD_SIZE', wanted, length)
    if (length > 0) then
      read (wanted, *, iostat=unread) number
      if (unread /= 0) number = 1
    end if
    ! A rank that waits lets others have its processor, which on a busy machine makes a run several
    ! times faster; on a machine of its own it costs nothing. A single process waits for no other,
    ! and would give its processor away at each call. What the user has set stays.
    if (number > 1) call set_environment('OMPI_MCA_mpi_yield_when_idle', '1', .false., worked)
    call mpi_init(status)
    if (length == 0) return
    if (number == n_ranks()) return
    call raise(error, exit_wrong_input, 'bipot: error: mpirun has started '//to_text(number)// &
      ' processes, and this program is built for one'//new_line('a')// &
      '  `scripts/run --mpi '//to_text(number)//' DECK` builds and runs the one for several; '// &
      'where each process is to run by itself, unset OMPI_COMM_WORLD_SIZE')
  end subroutine start_ranks

  !> Leave the ranks, and let the others go: the last call of all. A rank that fails where the host
  !> does not takes all with it, for they would wait for it for ever.
  subroutine end_ranks(exit_status)
    integer, intent(in) :: exit_status !! of this rank
    integer(c_int) :: status

    if (is_host()) then
      call announce(task_end)
    else if (exit_status /= exit_ok) then
      call mpi_abort(mpi_comm_world, int(exit_status, c_int), status)
    end if
    call mpi_finalize(status)
  end subroutine end_ranks

  !> End all ranks from one of them, with a message: where the others wait for it.
  subroutine end_all_ranks(message, exit_status)
    character(*), intent(in) :: message
    integer, intent(in) :: exit_status
    integer(c_int) :: status

    call write_to(standard_error, message//new_line('a'))
    call mpi_abort(mpi_comm_world, int(exit_status, c_int), status)
  end subroutine end_all_ranks

  !> How many ranks there are; 1 before `start_ranks`.
  integer function n_ranks() result(number)
    integer(c_int) :: flag, status

    number = 1
    call mpi_initialized(flag, status)
    if (flag /= 0) call mpi_comm_size(mpi_comm_world, number, status)
  end function n_ranks

  !> Whether this is the rank that runs the program.
  logical function is_host()
    integer(c_int) :: rank, status

    is_host = .true.
    if (n_ranks() == 1) return
    call mpi_comm_rank(mpi_comm_world, rank, status)
    is_host = rank == host
  end function is_host

  !> The handle of all ranks, for libraries that communicate themselves.
  pure integer function communicator()
    communicator = mpi_comm_world
  end function communicator

  !> Whether mpirun has started the program: what is printed then passes through its hands.
  logical function has_launcher()
    integer :: length

    has_launcher = n_ranks() > 1
    if (has_launcher) return
    call get_environment_variable('OMPI_COMM_WORLD_SIZE', length=length)
    has_launcher = length > 0
  end function has_launcher

  !> The sum over the ranks, the same to the last bit on each of them: all must call it.
  subroutine sum_over_ranks(x)
    real(wp), contiguous, target, intent(inout) :: x(:)
    real(wp), allocatable, target :: total(:)
    integer(c_int) :: status

    if (n_ranks() == 1 .or. size(x) == 0) return
    allocate (total(size(x)))
    ! An MPI_Allreduce may round differently on different ranks.
    call mpi_reduce(c_loc(x), c_loc(total), size(x), mpi_double_precision, mpi_sum, host, &
      mpi_comm_world, status)
    call mpi_bcast(c_loc(total), size(x), mpi_double_precision, host, mpi_comm_world, status)
    x = total
  end subroutine sum_over_ranks

  !> Give all ranks the host's text: all must call it, with texts of one length.
  subroutine broadcast_text(n, text)
    integer, intent(in) :: n
    character(n), target, intent(inout) :: text
    integer(c_int) :: status

    if (n_ranks() == 1) return
    call mpi_bcast(c_loc(text(1:1)), n, mpi_character, host, mpi_comm_world, status)
  end subroutine broadcast_text

  !> Whether it is true on every rank: all must call it.
  logical function all_ranks(condition)
    logical, intent(in) :: condition
    real(wp) :: failures(1)

    failures = merge(0.0_wp, 1.0_wp, condition)
    call sum_over_ranks(failures)
    all_ranks = failures(1) < 0.5_wp
  end function all_ranks

  ! ------------------------------------------------------------------ host

  !> Tell the other ranks what comes next; nothing where there are none.
  subroutine announce(task, first, second)
    integer(i8), intent(in) :: task                   !! task_end and its kin
    integer(i8), intent(in), optional :: first, second !! what the task explains
    integer(i8), target :: message(task_length)
    integer(c_int) :: rank, status

    message = [task, 0_i8, 0_i8]
    if (present(first)) message(2) = first
    if (present(second)) message(3) = second
    do rank = 1, n_ranks() - 1
      call mpi_send(c_loc(message), task_length, mpi_integer8, rank, tag_task, mpi_comm_world, &
        status)
    end do
  end subroutine announce

  !> Send integers to a rank, which must be receiving them.
  subroutine send_integers(n, x, rank)
    integer, intent(in) :: n
    integer, target, intent(in) :: x(n)
    integer, intent(in) :: rank
    integer(c_int) :: status

    if (n > 0) call mpi_send(c_loc(x), n, mpi_integer, rank, tag_data, mpi_comm_world, status)
  end subroutine send_integers

  !> Send numbers to a rank, which must be receiving them.
  subroutine send_reals(n, x, rank)
    integer, intent(in) :: n
    real(wp), target, intent(in) :: x(n)
    integer, intent(in) :: rank
    integer(c_int) :: status

    if (n > 0) call mpi_send(c_loc(x), n, mpi_double_precision, rank, tag_data, mpi_comm_world, &
      status)
  end subroutine send_reals

  !> What the other ranks have used so far.
  type(usage_t) function usage_of_others() result(usage)
    real(wp) :: sums(4)

    if (n_ranks() == 1) return
    call announce(task_usage)
    call add_usage(sums)
    usage%ranks_here = 1 + nint(sums(1))
    usage%resident = nint(sums(2), i8)
    usage%peak = nint(sums(3), i8)
    usage%cpu = sums(4)
  end function usage_of_others

  ! ------------------------------------------------------------------ other ranks

  !> Wait for the next task without taking much of the processor from those who work.
  subroutine next_task(task)
    integer(i8), target, intent(out) :: task(task_length)
    real(wp), parameter :: longest = 1.0e-3_wp !! nap [s]
    integer(c_int) :: flag, status, envelope(mpi_status_size)
    real(wp) :: started

    started = wall_seconds()
    do
      call mpi_iprobe(host, tag_task, mpi_comm_world, flag, envelope, status)
      if (flag /= 0) exit
      ! A task is late by at most a tenth of the time it was waited for.
      call sleep_for(min(longest, 0.1_wp*(wall_seconds() - started)))
    end do
    call mpi_recv(c_loc(task), task_length, mpi_integer8, host, tag_task, mpi_comm_world, &
      envelope, status)
  end subroutine next_task

  !> Receive integers from the host.
  subroutine receive_integers(n, x)
    integer, intent(in) :: n
    integer, target, intent(out) :: x(n)
    integer(c_int) :: status, envelope(mpi_status_size)

    if (n > 0) call mpi_recv(c_loc(x), n, mpi_integer, host, tag_data, mpi_comm_world, envelope, &
      status)
  end subroutine receive_integers

  !> Receive numbers from the host.
  subroutine receive_reals(n, x)
    integer, intent(in) :: n
    real(wp), target, intent(out) :: x(n)
    integer(c_int) :: status, envelope(mpi_status_size)

    if (n > 0) call mpi_recv(c_loc(x), n, mpi_double_precision, host, tag_data, mpi_comm_world, &
      envelope, status)
  end subroutine receive_reals

  !> Answer task_usage.
  subroutine tell_usage()
    real(wp) :: sums(4)

    call add_usage(sums)
  end subroutine tell_usage

  !> Sum what the ranks but the host have used; of their memory what is on the host's machine.
  subroutine add_usage(sums)
    real(wp), intent(out) :: sums(4) !! ranks there, their memory now and at most, processor time
    integer, parameter :: room = 256
    character(room), target :: name
    character(room) :: name_of_host
    integer(c_int) :: status

    name = repeat(c_null_char, room)
    status = c_gethostname(c_loc(name(1:1)), int(room - 1, c_size_t))
    name_of_host = name
    call broadcast_text(room, name_of_host)
    sums = 0.0_wp
    if (.not. is_host()) then
      if (name == name_of_host) sums(:3) = [1.0_wp, real(resident_bytes(), wp), &
        real(peak_memory_bytes(), wp)]
      sums(4) = cpu_seconds()
    end if
    call sum_over_ranks(sums)
  end subroutine add_usage

end module parallel_mod
