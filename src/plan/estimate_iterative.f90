!> What a run takes whose bodies are solved for by iteration, and what it does not cover.
!>
!> Numbers an equation, measured on cubes (docs/plan.md).
module estimate_iterative_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t, raise, exit_wrong_input
  use text_mod, only: to_text
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use controls_mod, only: compliance_dense, solver_sweeps, stop_at_change
  use new_iterative_body_mod, only: check_iterative_body
  use rigid_modes_mod, only: free_motions_t
  use count_sizes_mod, only: sizes_t
  implicit none
  private

  public :: check_iterative, iterative_bytes

  real(wp), parameter :: bytes_of_equation = 3.0e3_wp
  !! the matrix as it is summed up and by rows, what it is coarsened to, vectors of GMRES [bytes]

contains

  !> Refuse what iteration does not cover.
  subroutine check_iterative(scene, compliance, points, motions, error)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: compliance !! as of choices_t
    type(contact_points_t), intent(in) :: points
    type(free_motions_t), intent(in) :: motions !! that the supports of a step leave
    type(error_t), allocatable, intent(out) :: error
    logical :: is_taken(scene%mesh%n_nodes)
    integer :: i

    call check_iterative_body(error)
    if (allocated(error)) return
    if (scene%contact%solver == solver_sweeps) call refuse('SOLVER=SWEEPS of *CONTACT SOLVER')
    if (compliance == compliance_dense) call refuse( &
      'COMPLIANCE=DENSE of *CONTACT SOLVER')
    if (scene%contact%stop_rule == stop_at_change) call refuse('STOP=CHANGE of *CONTACT SOLVER')
    if (any(motions%body == 0)) call refuse('obstacles that move freely')
    if (motions%n > 0 .and. allocated(motions%piece)) call refuse( &
      'bodies that equations join and supports do not hold')
    if (allocated(points%alpha)) call refuse('slave faces with mid-side nodes')
    is_taken = .false.
    do i = 1, points%n
      if (.not. points%in_reach(i)) cycle
      if (is_taken(points%node(i))) call refuse('nodes that two obstacles may touch (node '// &
        to_text(scene%mesh%node_id(points%node(i)))//')')
      if (allocated(error)) return
      is_taken(points%node(i)) = .true.
    end do

  contains

    subroutine refuse(what)
      character(*), intent(in) :: what

      if (allocated(error)) return
      call raise(error, exit_wrong_input, 'bipot: error: *BODY SOLVER, TYPE=ITERATIVE does not '// &
        'cover '//what//new_line('a')//'  TYPE=FACTOR does')
    end subroutine refuse

  end subroutine check_iterative

  !> Memory of the bodies and of solving for them.
  pure real(wp) function iterative_bytes(sizes) result(bytes)
    type(sizes_t), intent(in) :: sizes

    bytes = bytes_of_equation*sizes%equations
  end function iterative_bytes

end module estimate_iterative_mod
