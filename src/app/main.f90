!> bipot: reads the command line, runs, prints the error if there is one, and stops with the exit
!> status.
program bipot
  use, intrinsic :: iso_c_binding, only: c_int
  use kinds_mod, only: i8
  use errors_mod, only: error_t, exit_ok
  use libc_mod, only: c_exit, c_exit_at_once
  use standard_streams_mod, only: open_standard_streams, write_to, standard_error
  use runtime_failures_mod, only: meet_runtime_failures
  use blas_core_mod, only: blas_core_name, blas_version, choose_blas_core, check_blas_room
  use dense_mod, only: begin_blas
  use resource_limits_mod, only: check_library_room, check_stack_room
  use system_mod, only: catch_signals
  use parallel_mod, only: start_ranks, end_ranks, is_host
  use worker_loop_mod, only: worker_loop
  use fclib_mod, only: is_fclib_path
  use card_index_mod, only: cards_as_json
  use command_line_mod, only: options_t, read_command_line, check_kind, help_text
  use console_mod, only: say
  use run_mod, only: run_deck
  use solve_problem_mod, only: run_problem
  use version_mod, only: version
  implicit none

  type(options_t) :: options
  type(error_t), allocatable :: error, no_room
  integer :: exit_status

  call open_standard_streams()
  call meet_runtime_failures()
  call choose_blas_core()
  call check_blas_room(no_room)
  exit_status = exit_ok
  call start_ranks(error)
  if (.not. allocated(error)) then
    if (is_host()) then
      call read_and_run()
    else
      ! The host alone decides when to stop.
      call catch_signals()
      call check_room(error)
      if (.not. allocated(error)) call worker_loop(error)
    end if
  end if
  if (allocated(error)) then
    call write_to(standard_error, error%message//new_line('a'))
    if (allocated(error%kept)) call write_to(standard_error, error%kept//new_line('a'))
    exit_status = error%exit_status
  end if
  call end_ranks(exit_status)
  ! Fortran 2008 takes no variable behind STOP. A thread of OpenBLAS without room for its buffer
  ! asks for ever: an ordinary end would wait for it.
  if (.not. allocated(no_room)) call c_exit(int(exit_status, c_int))
  call c_exit_at_once(int(exit_status, c_int))

contains

  subroutine read_and_run()
    integer(i8), parameter :: to_look = 8000000_i8 !! what HDF5 takes to open a file [bytes]
    character(:), allocatable :: core

    call read_command_line(options, error)
    if (allocated(error)) return
    if (options%help) then
      call say(help_text())
    else if (options%cards) then
      call say(cards_as_json())
    else if (options%version) then
      call say('bipot '//version)
      if (options%verbose) then
        core = blas_core_name()
        if (core /= '') call say(blas_version()//', '//core//' kernels')
      end if
    else
      call check_library_room(to_look, 'look at the deck', error)
      if (.not. allocated(error)) call run(is_fclib_path(options%deck))
    end if
  end subroutine read_and_run

  subroutine run(is_problem)
    logical, intent(in) :: is_problem

    call check_kind(options, is_problem, error)
    if (allocated(error)) return
    call check_room(error)
    if (allocated(error)) return
    if (is_problem) then
      call run_problem(options, error)
    else
      call run_deck(options, error)
    end if
  end subroutine run

  !> Limits of the process under which a library would crash or hang.
  subroutine check_room(error)
    type(error_t), allocatable, intent(out) :: error

    call check_stack_room(error)
    if (.not. allocated(error)) call check_blas_room(error)
    if (.not. allocated(error)) call begin_blas()
  end subroutine check_room

end program bipot
