!> An iterative body by the library that the build has; the only file that depends on which it is.
module new_iterative_body_mod
  use kinds_mod, only: i8
  use errors_mod, only: error_t, raise, exit_wrong_input
  use parallel_mod, only: task_length
  use iterative_body_mod, only: iterative_body_t, numbering_t
  use node_parts_mod, only: node_part_t
#ifdef BIPOT_PETSC
  use petsc_body_mod, only: make_petsc_body, participate, petsc_share_t
#endif
  implicit none
  private

  public :: new_iterative_body, has_iterative_body, check_iterative_body
  public :: iterative_share_t, participate_iterative

#ifdef BIPOT_PETSC
  logical, parameter :: has_library = .true.
#else
  logical, parameter :: has_library = .false.
#endif

  !> What a rank that is not the host has of a body. It is the same type with every library: builds
  !> with and without one may share the files that use it.
  type :: iterative_share_t
    private
    type(node_part_t), public :: summed     !! until the body is made of it
    class(*), allocatable :: of_the_library !! its share
  end type iterative_share_t

contains

  !> Whether this program can solve for bodies by iteration.
  pure logical function has_iterative_body()
    has_iterative_body = has_library
  end function has_iterative_body

  !> The same as an error.
  subroutine check_iterative_body(error)
    type(error_t), allocatable, intent(out) :: error

    if (.not. has_library) call raise(error, exit_wrong_input, 'bipot: error: *BODY SOLVER, '// &
      'TYPE=ITERATIVE: this build has no iterative solver; scripts/run --iterative builds one')
  end subroutine check_iterative_body

  !> A body of its stiffness, on all ranks; where the build has none it was refused before.
  subroutine new_iterative_body(summed, row, numbering, body, error)
    type(node_part_t), intent(in) :: summed !! of the host; the other ranks have their own
    integer, intent(in) :: row(:)           !! (n_nodes) of each node, 0 without unknowns
    type(numbering_t), intent(in) :: numbering
    class(iterative_body_t), allocatable, intent(out) :: body
    type(error_t), allocatable, intent(out) :: error !! the library failed; there is none

    call check_iterative_body(error)
    if (allocated(error)) return
#ifdef BIPOT_PETSC
    call make_petsc_body(summed, row, numbering, body, error)
#endif
  end subroutine new_iterative_body

  !> What the host asks of the other ranks.
  subroutine participate_iterative(task, share, error)
    integer(i8), intent(in) :: task(task_length)
    type(iterative_share_t), intent(inout) :: share
    type(error_t), allocatable, intent(out) :: error !! the library failed; there is none

    call check_iterative_body(error)
    if (allocated(error)) return
#ifdef BIPOT_PETSC
    if (.not. allocated(share%of_the_library)) allocate (petsc_share_t :: share%of_the_library)
    select type (mine => share%of_the_library)
    type is (petsc_share_t)
      call participate(task, share%summed, mine, error)
    end select
#endif
  end subroutine participate_iterative

end module new_iterative_body_mod
