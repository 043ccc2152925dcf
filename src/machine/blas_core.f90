!> OpenBLAS's kernels: the right ones for this processor, chosen without the user knowing.
!>
!> OpenBLAS picks its kernels once, when the library loads, and on processors it does not know it
!> may pick those of an old one, several times slower. `OPENBLAS_CORETYPE` in the environment
!> decides at that moment, so the program looks at what was picked, and if the processor can do
!> better it starts itself again with the variable set.
module blas_core_mod
  use, intrinsic :: iso_c_binding, only: c_int, c_size_t, c_ptr, c_funptr, &
    c_null_ptr, c_null_char, c_associated, c_f_procpointer, c_loc
  use kinds_mod, only: i8
  use c_text_mod, only: text_at
  use libc_mod, only: c_dlsym, c_execv, c_readlink
  use errors_mod, only: error_t, raise, exit_machine
  use text_mod, only: string_t, upper, to_text
  use system_mod, only: set_environment, processor_flags
  use resource_limits_mod, only: address_space_left, data_left
  implicit none
  private

  public :: choose_blas_core, check_blas_room, blas_core_name, blas_version, wanted_core, &
    use_threads, threads_are_given

  character(*), parameter :: core_variable = 'OPENBLAS_CORETYPE'
  ! Set before the second start: there is never a third.
  character(*), parameter :: guard_variable = 'BIPOT_BLAS_CORE'
  integer(c_int), parameter :: with_own_threads = 1 !! of openblas_get_parallel: not OpenMP's
  character(*), parameter :: thread_variables(2) = &
    [character(20) :: 'OPENBLAS_NUM_THREADS', 'OMP_NUM_THREADS']

  abstract interface
    function text_function() result(text) bind(c)
      import :: c_ptr
      implicit none
      type(c_ptr) :: text
    end function text_function

    function number_function() result(number) bind(c)
      import :: c_int
      implicit none
      integer(c_int) :: number
    end function number_function

    subroutine set_threads_function(n) bind(c)
      import :: c_int
      implicit none
      integer(c_int), value :: n
    end subroutine set_threads_function
  end interface

contains

  !> Refuse to begin where a limit on addresses or data (ulimit -v, ulimit -d) leaves OpenBLAS no
  !> room for its buffer: it would ask for it again and again, for ever.
  subroutine check_blas_room(error)
    type(error_t), allocatable, intent(out) :: error !! too little memory may be reserved

    call check(address_space_left(''), 'addresses (ulimit -v)')
    if (.not. allocated(error)) call check(data_left(''), 'data (ulimit -d)')

  contains

    subroutine check(left, limit)
      integer(i8), intent(in) :: left      !! [byte]
      character(*), intent(in) :: limit
      integer(i8), parameter :: megabyte = 1000000_i8, reserved = 140_i8*megabyte

      if (left < reserved) call raise(error, exit_machine, 'bipot: error: the limit on '// &
        limit//' leaves '//to_text(left/megabyte)//' MB; the linear algebra library alone '// &
        'reserves '//to_text(reserved/megabyte)//' MB before it computes anything')
    end subroutine check

  end subroutine check_blas_room

  !> Take care of OpenBLAS's kernels and threads. Returns, or does not: then the program starts
  !> again.
  !>
  !> What the user has set in the environment wins. The program does not start again under valgrind
  !> or a sanitizer, or with another BLAS. Under MPI every rank does so for its own processor:
  !> before it has joined the others it is a process like any.
  subroutine choose_blas_core()
    character(:), allocatable :: core
    type(error_t), allocatable :: no_room
    logical :: worked

    if (.not. threads_are_given()) then
      call use_threads(1)
      ! A thread without room for its buffer asks for ever: nobody may wait for its end.
      call check_blas_room(no_room)
      if (.not. allocated(no_room)) call end_threads()
    end if
    core = blas_core_name()
    if (core == '') return
    if (any_set([character(20) :: guard_variable, core_variable])) return
    if (watched()) return
    core = wanted_core(core, processor_flags())
    if (core == '') return
    call set_environment(guard_variable, 'chosen', .true., worked)
    if (.not. worked) return
    call set_environment(core_variable, core, .true., worked)
    if (.not. worked) return
    call start_again()
  end subroutine choose_blas_core

  !> The kernels in use, by OpenBLAS's name; empty with another BLAS.
  function blas_core_name() result(name)
    character(:), allocatable :: name

    name = told_by('openblas_get_corename')
  end function blas_core_name

  !> As in "OpenBLAS 0.3.21"; empty with another BLAS.
  function blas_version() result(name)
    character(:), allocatable :: name
    integer :: first_blank

    name = told_by('openblas_get_config')
    first_blank = index(name, ' ')
    name = name(:first_blank + index(name(first_blank + 1:)//' ', ' ') - 1)
  end function blas_version

  !> What a function of OpenBLAS without arguments tells; empty with another BLAS.
  function told_by(function_name) result(told)
    character(*), intent(in) :: function_name
    character(:), allocatable :: told
    type(c_funptr) :: address
    type(c_ptr) :: text
    procedure(text_function), pointer :: get_text

    told = ''
    address = c_dlsym(c_null_ptr, c_text(function_name))
    if (.not. c_associated(address)) return
    call c_f_procpointer(address, get_text)
    text = get_text()
    if (.not. c_associated(text)) return
    told = text_at(text)
  end function told_by

  !> The core to ask for: empty when `current` already uses what the processor offers, or is not
  !> OpenBLAS's.
  pure function wanted_core(current, flags) result(core)
    character(*), intent(in) :: current !! OpenBLAS's name of the kernels in use
    character(*), intent(in) :: flags
    !! the processor's flags as in /proc/cpuinfo, blanks around each
    character(:), allocatable :: core
    logical :: avx2, avx512

    core = ''
    if (current == '') return
    avx2 = has('avx2') .and. has('fma')
    avx512 = avx2 .and. has('avx512f') .and. has('avx512cd') .and. has('avx512bw') .and. &
      has('avx512dq') &
      .and. has('avx512vl')
    select case (upper(current))
    case ('SKYLAKEX', 'COOPERLAKE', 'SAPPHIRERAPIDS')
      return
    case ('HASWELL', 'ZEN')
      if (avx512) core = 'SKYLAKEX'
    case default
      if (avx512) then
        core = 'SKYLAKEX'
      else if (avx2) then
        core = 'HASWELL'
      else if (upper(current) == 'PRESCOTT' .and. has('sse4_2')) then
        ! What OpenBLAS takes for processors that it does not know. Its product of a symmetric
        ! matrix with a vector reads beyond the vector's end (0.3.21), maybe the end of memory.
        core = merge('SANDYBRIDGE', 'NEHALEM    ', has('avx'))
      end if
    end select
    core = trim(core)

  contains

    pure logical function has(flag)
      character(*), intent(in) :: flag

      has = index(flags, ' '//flag//' ') > 0
    end function has

  end function wanted_core

  !> Whether the user has said how many threads there are to be.
  logical function threads_are_given() result(answer)
    answer = any_set(thread_variables)
  end function threads_are_given

  !> From now on so many threads work in OpenBLAS; with another BLAS nothing happens.
  subroutine use_threads(n)
    integer, intent(in) :: n
    type(c_funptr) :: address
    procedure(set_threads_function), pointer :: set_threads

    address = c_dlsym(c_null_ptr, c_text('openblas_set_num_threads'))
    if (.not. c_associated(address)) return
    call c_f_procpointer(address, set_threads)
    call set_threads(int(n, c_int))
  end subroutine use_threads

  !> End the threads that OpenBLAS makes when it is loaded, and that would wait in a loop for work.
  !> It makes them anew where more than one is to work. Those of OpenMP are not there yet.
  subroutine end_threads()
    type(c_funptr) :: address, parallel
    procedure(number_function), pointer :: number_of
    integer(c_int) :: ignored

    parallel = c_dlsym(c_null_ptr, c_text('openblas_get_parallel'))
    address = c_dlsym(c_null_ptr, c_text('blas_thread_shutdown_'))
    if (.not. (c_associated(parallel) .and. c_associated(address))) return
    call c_f_procpointer(parallel, number_of)
    if (number_of() /= with_own_threads) return
    call c_f_procpointer(address, number_of)
    ignored = number_of()
  end subroutine end_threads

  !> Whether valgrind (which does not know all instructions) or a sanitizer watches.
  logical function watched() result(answer)
    character(4096) :: preload
    type(c_funptr) :: address

    call get_environment_variable('LD_PRELOAD', preload)
    answer = index(preload, 'vgpreload') > 0
    address = c_dlsym(c_null_ptr, c_text('__asan_init'))
    answer = answer .or. c_associated(address)
    address = c_dlsym(c_null_ptr, c_text('__tsan_init'))
    answer = answer .or. c_associated(address)
  end function watched

  !> Replace the process by itself, with the same arguments. Returns only if that fails: then all
  !> goes on as it is.
  subroutine start_again()
    type(string_t), allocatable, target :: arguments(:)
    type(c_ptr), allocatable :: pointers(:)
    integer :: i, length
    integer(c_int) :: status
    character(:), allocatable :: argument
    character(4096), target :: path

    allocate (arguments(0:command_argument_count()), pointers(0:command_argument_count() + 1))
    do i = 0, command_argument_count()
      call get_command_argument(i, length=length)
      if (allocated(argument)) deallocate (argument)
      allocate (character(length) :: argument)
      call get_command_argument(i, argument)
      arguments(i)%text = argument//c_null_char
      pointers(i) = c_loc(arguments(i)%text(1:1))
    end do
    pointers(command_argument_count() + 1) = c_null_ptr
    ! By its own path, not by /proc/self/exe: the process keeps its name in lists of processes.
    length = int(c_readlink(c_text('/proc/self/exe'), c_loc(path(1:1)), &
      int(len(path), c_size_t)))
    if (length <= 0 .or. length >= len(path)) return
    status = c_execv(path(:length)//c_null_char, pointers)
    if (status /= 0) return
  end subroutine start_again

  !> Whether one of these environment variables has a value.
  logical function any_set(names) result(answer)
    character(*), intent(in) :: names(:)
    integer :: i, length

    answer = .false.
    do i = 1, size(names)
      call get_environment_variable(trim(names(i)), length=length)
      answer = answer .or. length > 0
    end do
  end function any_set

  pure function c_text(text) result(terminated)
    character(*), intent(in) :: text
    character(len(text) + 1) :: terminated

    terminated = text//c_null_char
  end function c_text

end module blas_core_mod
