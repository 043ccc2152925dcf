!> An iterative body by the library that the build has; the only file that depends on which it is.
module new_iterative_body_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t, raise, exit_wrong_input
  use parallel_mod, only: n_ranks
  use assembly_mod, only: triplets_t
  use iterative_body_mod, only: iterative_body_t, numbering_t
#ifdef BIPOT_PETSC
  use petsc_body_mod, only: make_petsc_body
#endif
  implicit none
  private

  public :: new_iterative_body, has_iterative_body, check_iterative_body

#ifdef BIPOT_PETSC
  logical, parameter :: has_library = .true.
#else
  logical, parameter :: has_library = .false.
#endif

contains

  !> Whether this program, on as many ranks as it runs on, can solve for bodies by iteration.
  logical function has_iterative_body()
    has_iterative_body = has_library
    if (has_library) has_iterative_body = n_ranks() == 1
  end function has_iterative_body

  !> The same as an error.
  subroutine check_iterative_body(error)
    type(error_t), allocatable, intent(out) :: error

    if (.not. has_library) then
      call raise(error, exit_wrong_input, 'bipot: error: *BODY SOLVER, TYPE=ITERATIVE: this '// &
        'build has no iterative solver; scripts/run --iterative builds one')
    else if (n_ranks() > 1) then
      call raise(error, exit_wrong_input, 'bipot: error: *BODY SOLVER, TYPE=ITERATIVE runs on '// &
        'one rank; on several TYPE=FACTOR does')
    end if
  end subroutine check_iterative_body

  !> A body of its stiffness; where the build has none it was refused before.
  subroutine new_iterative_body(k, numbering, coordinates, start, neighbours, body, error)
    type(triplets_t), intent(in) :: k             !! with its values, not distributed
    type(numbering_t), intent(in) :: numbering
    real(wp), intent(in) :: coordinates(:, :)     !! (3,n_nodes) [length]
    integer, intent(in) :: start(:), neighbours(:) !! of the nodes, as of coupled_nodes
    class(iterative_body_t), allocatable, intent(out) :: body
    type(error_t), allocatable, intent(out) :: error !! the library failed; there is none

    call check_iterative_body(error)
    if (allocated(error)) return
#ifdef BIPOT_PETSC
    call make_petsc_body(k, numbering, coordinates, start, neighbours, body, error)
#endif
  end subroutine new_iterative_body

end module new_iterative_body_mod
