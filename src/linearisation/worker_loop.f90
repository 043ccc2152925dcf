!> What the ranks do that do not run the program: their part of assembly and factor, as the host
!> announces it.
module worker_loop_mod
  use kinds_mod, only: i8
  use errors_mod, only: error_t, exit_machine, raise
  use parallel_mod, only: next_task, task_length, task_usage, task_pattern, &
    task_stiffness, task_double, task_single, task_rows, task_iterative, task_end, tell_usage
  use assembly_mod, only: triplets_t
  use mesh_parts_mod, only: list_own_part, assemble_own_part
  use node_parts_mod, only: assemble_own_nodes
  use new_iterative_body_mod, only: iterative_share_t, participate_iterative
  use double_factor_mod, only: double_factor_t => mumps_factor_t, participate_double => participate
  use single_factor_mod, only: single_factor_t => mumps_factor_t, participate_single => participate
  implicit none
  private

  public :: worker_loop

contains

  !> Do one task after the other until the host has no more.
  subroutine worker_loop(error)
    type(error_t), allocatable, intent(out) :: error !! no memory on this rank
    type(triplets_t) :: k !! part of the matrix that the host is about to analyse or factorise
    type(double_factor_t), allocatable :: double(:)
    type(single_factor_t), allocatable :: single(:)
    type(iterative_share_t), allocatable :: iterative
    integer(i8) :: task(task_length)

    allocate (iterative)

    do
      call next_task(task)
      select case (task(1))
      case (task_usage)
        call tell_usage()
      case (task_pattern)
        call list_own_part(k)
      case (task_stiffness)
        call assemble_own_part(k)
      case (task_double)
        call participate_double(double, task, k, error)
      case (task_single)
        call participate_single(single, task, k, error)
      case (task_rows)
        call assemble_own_nodes(iterative%summed)
      case (task_iterative)
        call participate_iterative(task, iterative, error)
      case (task_end)
        exit
      case default
        call raise(error, exit_machine, 'internal error: a task that no rank knows')
      end select
      if (allocated(error)) return
    end do
  end subroutine worker_loop

end module worker_loop_mod
