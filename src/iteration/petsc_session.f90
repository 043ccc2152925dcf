!> PETSc's start, and how it fails.
module petsc_session_mod
  use, intrinsic :: iso_c_binding, only: c_char, c_funloc, c_int, c_loc, c_null_char, c_null_ptr, &
    c_ptr
  use errors_mod, only: error_t, raise, exit_machine
  use text_mod, only: to_text
  use parallel_mod, only: communicator, end_all_ranks, n_ranks
  use petsc_calls_mod, only: get_ranks, no, pc_create, petsc_initialize, petsc_initialized, &
    petsc_push_error_handler, petsc_return_error_handler
  implicit none
  private

  public :: begin_petsc, note

contains

  !> PETSc's own start, once a run; a preconditioner, and the handle of its ranks.
  subroutine begin_petsc(inverse, ranks, failure)
    type(c_ptr), intent(inout) :: inverse, ranks !! a new preconditioner; the handle
    type(error_t), allocatable, intent(inout) :: failure
    character(*), parameter :: argument(*) = [character(18) :: 'bipot', '-skip_petscrc', &
      '-no_signal_handler', '-options_left']
    integer(c_int) :: flag, n, status
    character(c_char), target :: words(20, 4)
    type(c_ptr), target :: arguments(5)
    integer :: i

    call note(failure, petsc_initialized(flag))
    if (flag == no) then
      ! Signals are the program's, and no file of somebody's home says how it solves.
      do i = 1, 4
        words(:, i) = c_text(trim(argument(i)))
        arguments(i) = c_loc(words(1, i))
      end do
      arguments(5) = c_null_ptr
      n = 4
      block
        type(c_ptr), target :: list

        list = c_loc(arguments)
        call note(failure, petsc_initialize(n, list, c_null_ptr, c_null_ptr))
      end block
      call note(failure, petsc_push_error_handler(c_funloc(petsc_return_error_handler), c_null_ptr))
    end if
    call pc_create(int(communicator(), c_int), inverse, status)
    call note(failure, status)
    if (.not. allocated(failure)) call note(failure, get_ranks(inverse, ranks))

  contains

    pure function c_text(text)
      character(*), intent(in) :: text
      character(c_char) :: c_text(20)
      integer :: j

      c_text = c_null_char
      do j = 1, len(text)
        c_text(j) = text(j:j)
      end do
    end function c_text

  end subroutine begin_petsc

  !> Keep the first failure of PETSc. With several ranks it ends all of them here.
  subroutine note(failure, status)
    type(error_t), allocatable, intent(inout) :: failure
    integer(c_int), intent(in) :: status
    integer(c_int), parameter :: no_memory = 55, too_many = 84

    if (status == 0 .or. allocated(failure)) return
    if (status == no_memory) then
      call raise(failure, exit_machine, 'bipot: error: no memory for the iterative solver')
    else if (status == too_many) then
      call raise(failure, exit_machine, 'bipot: error: this build of PETSc counts up to '// &
        to_text(huge(1))//' entries of a matrix on a rank, and there are more'// &
        new_line('a')//'  more ranks (scripts/run --iterative --mpi N) have fewer each')
    else
      call raise(failure, exit_machine, 'bipot: error: PETSc failed with its error '// &
        to_text(int(status)))
    end if
    ! The others would wait for this rank.
    if (n_ranks() > 1) call end_all_ranks(failure%message, failure%exit_status)
  end subroutine note

end module petsc_session_mod
