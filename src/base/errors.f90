!> The error that a procedure hands to its caller; only the main program prints it and stops.
!>
!> Every procedure that can fail ends with `type(error_t), allocatable, intent(out) :: error`;
!> its caller continues with `if (allocated(error)) return`.
module errors_mod
  implicit none
  private

  public :: error_t, raise, exit_ok, exit_wrong_input, exit_not_solved, exit_machine, exit_signal

  integer, parameter :: exit_ok = 0           !! every step certified
  integer, parameter :: exit_wrong_input = 1  !! command line or deck
  integer, parameter :: exit_not_solved = 2   !! a step did not converge or certify
  integer, parameter :: exit_machine = 3      !! memory, disk, a library
  integer, parameter :: exit_signal = 128     !! and the number of the signal that stopped the run

  !> What went wrong, in words for the user, and the exit status it leads to.
  type :: error_t
    character(:), allocatable :: message !! one or more lines, no trailing newline
    character(:), allocatable :: kept    !! a line more: what is left of the run; need not be there
    integer :: exit_status = exit_wrong_input
    logical :: is_of_mesh = .false. !! smaller elements may not have it
    integer :: n_meshes = 0
    !! in turn, each finer, that have to show it until all finer ones are taken to; 0: no number
  end type error_t

contains

  !> Make `error` say `message` and lead to `exit_status`.
  pure subroutine raise(error, exit_status, message)
    type(error_t), allocatable, intent(out) :: error
    integer, intent(in) :: exit_status      !! exit_wrong_input, exit_not_solved, ...
    character(*), intent(in) :: message

    allocate (error)
    error%message = message
    error%exit_status = exit_status
  end subroutine raise

end module errors_mod
