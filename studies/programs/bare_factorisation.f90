!> The least that a finite-element program does for a body without contact: METIS and MUMPS alone.
!>
!>     bare_factorisation DECK DISPLACEMENTS
!>
!> Assembles the stiffness of the deck's first *STEP as a run would, contact left out. Then, and
!> this is timed, METIS orders it, and MUMPS as it comes for symmetric positive definite matrices
!> factorises it and solves for the loads at the end of the step. The order is the run's, so the
!> factor is too, and what a run takes more is not work of METIS and MUMPS. Debian's MUMPS has no
!> METIS within; it gets the order from outside.
!>
!> Prints names and values, a line each: seconds of the processor, sizes, and the peak of the
!> process in bytes. The file gets the displacements, x, y and z of each node as 8-byte numbers.
program bare_factorisation
  use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t, raise, exit_wrong_input, exit_not_solved, exit_machine
  use text_mod, only: string_t, to_text
  use system_mod, only: cpu_seconds, peak_memory_bytes
  use blas_core_mod, only: choose_blas_core
  use linked_nodes_mod, only: node_neighbours
  use obstacles_mod, only: ref_nodes
  use scene_mod, only: scene_t
  use read_deck_mod, only: read_deck
  use mesh_forces_mod, only: internal_force
  use dof_map_mod, only: dof_map_t, make_dof_map, to_equations, to_nodes
  use assembly_mod, only: triplets_t, assemble_stiffness
  use ordering_mod, only: order_equations
  use rigid_modes_mod, only: free_motions_t, find_free_motions
  use step_loads_mod, only: step_loads_t, resolve_loads, prescribed_dofs, pattern_factors
  implicit none

  include 'dmumps_struc.h'

  interface
    subroutine dmumps(id)
      import :: dmumps_struc
      implicit none
      type(dmumps_struc), intent(inout) :: id
    end subroutine dmumps
  end interface

  !> Seconds of the processor.
  type :: seconds_t
    real(wp) :: order = 0.0_wp
    real(wp) :: analyse = 0.0_wp   !! MUMPS's symbolic factorisation
    real(wp) :: factorise = 0.0_wp
    real(wp) :: solve = 0.0_wp
  end type seconds_t

  type(scene_t) :: scene
  type(dof_map_t) :: map
  type(triplets_t) :: k
  type(seconds_t) :: seconds
  type(error_t), allocatable :: error
  real(wp), allocatable :: u(:, :) !! (3,n_nodes) displacement [length]
  real(wp), allocatable :: free(:, :) !! (3,n_nodes) the part of it that is solved for [length]
  real(wp), allocatable :: x(:)    !! (n_free) right-hand side, then solution
  integer, allocatable :: start(:), neighbours(:) !! lists of neighbours of the nodes
  integer, allocatable :: place(:) !! (n_free) of every equation in the order of elimination
  integer(i8) :: factor_entries

  call choose_blas_core()
  if (command_argument_count() /= 2) then
    call raise(error, exit_wrong_input, 'usage: bare_factorisation DECK DISPLACEMENTS; '// &
      to_text(command_argument_count())//' arguments found')
    call stop_at(error)
  end if
  call read_deck(argument(1), [string_t ::], scene, error)
  call stop_at(error)
  call node_neighbours(scene%mesh, start, neighbours)
  call refuse_free_bodies(scene, error)
  call stop_at(error)
  call make_system(scene, start, neighbours, map, k, u, x)
  seconds%order = cpu_seconds()
  call order_equations(map, start, neighbours, place, error)
  call stop_at(error)
  seconds%order = cpu_seconds() - seconds%order
  call solve_system(k, place, x, seconds, factor_entries, error)
  call stop_at(error)
  allocate (free, mold=u)
  call to_nodes(map, x, free)
  u = u + free
  call write_displacements(argument(2), u, error)
  call stop_at(error)

  call print_value('equations', real(k%n, wp))
  call print_value('factor_entries', real(factor_entries, wp))
  call print_value('seconds_order', seconds%order)
  call print_value('seconds_analyse', seconds%analyse)
  call print_value('seconds_factorise', seconds%factorise)
  call print_value('seconds_solve', seconds%solve)
  call print_value('cpu_seconds', seconds%order + seconds%analyse + seconds%factorise + &
    seconds%solve)
  call print_value('peak_memory_bytes', real(peak_memory_bytes(), wp))

contains

  !> Refuse what contact would have to hold: its matrix is singular, and rounding hides that.
  subroutine refuse_free_bodies(scene, error)
    type(scene_t), intent(in) :: scene
    type(error_t), allocatable, intent(out) :: error !! supports leave rigid motions
    type(free_motions_t) :: motions

    call find_free_motions(scene%mesh, prescribed_dofs(scene, 1), ref_nodes(scene%obstacles), &
      [integer ::], motions, error)
    if (allocated(error)) return
    if (any(motions%body > 0)) call raise(error, exit_not_solved, 'the supports of the first '// &
      'step leave '//to_text(count(motions%body > 0))//' rigid motions; they must hold the bodies')
  end subroutine refuse_free_bodies

  !> The stiffness of all free degrees of freedom and the loads at the end of the first step.
  subroutine make_system(scene, start, neighbours, map, k, u, b)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: start(:)      !! (n_nodes+1) lists of neighbours, as from node_neighbours
    integer, intent(in) :: neighbours(:)
    type(dof_map_t), intent(out) :: map
    type(triplets_t), intent(out) :: k
    real(wp), allocatable, intent(out) :: u(:, :) !! (3,n_nodes) prescribed, else 0 [length]
    real(wp), allocatable, intent(out) :: b(:)    !! (n_free) [force]
    type(step_loads_t) :: loads
    real(wp), allocatable :: force(:, :), internal(:, :), factor(:)
    integer :: g

    map = make_dof_map(scene%mesh%body, prescribed_dofs(scene, 1), [integer ::])
    call assemble_stiffness(scene%mesh, scene%materials, map, start, neighbours, k)

    allocate (u(3, scene%mesh%n_nodes), force(3, scene%mesh%n_nodes), source=0.0_wp)
    call resolve_loads(scene, 1, u, loads)
    factor = pattern_factors(scene, loads, 1.0_wp, scene%steps(1)%period)
    do g = 1, loads%n_patterns
      u = u + factor(g)*loads%displacement(:, :, g)
      force = force + factor(g)*loads%force(:, :, g)
    end do
    ! What is prescribed acts through the forces that it causes in an otherwise undeformed body.
    allocate (internal, mold=force)
    call internal_force(scene%mesh, scene%materials, u, internal)
    force = force - internal
    allocate (b(map%n_free), source=0.0_wp)
    call to_equations(map, force, b)
  end subroutine make_system

  !> Analyse, factorise, solve. Nothing is set but the kind of matrix, the order and silence.
  subroutine solve_system(k, place, x, seconds, factor_entries, error)
    type(triplets_t), target, intent(inout) :: k
    integer, target, intent(inout) :: place(:)       !! (n) in the order of elimination
    real(wp), target, intent(inout) :: x(:)          !! (n) right-hand side in, solution out
    type(seconds_t), intent(inout) :: seconds
    integer(i8), intent(out) :: factor_entries
    type(error_t), allocatable, intent(out) :: error
    !! no memory, or a matrix that is not positive definite
    integer, parameter :: symmetric_positive_definite = 1
    integer, parameter :: job_init = -1, job_end = -2, job_analyse = 1, job_factorise = 2, &
      job_solve = 3
    integer, parameter :: icntl_ordering = 7, ordering_given = 1
    ! Static storage begins as zeros: MUMPS looks at parts of its structure before it sets them.
    type(dmumps_struc), save, target :: id

    factor_entries = 0
    id%comm = 0 ! any number will do in the sequential library
    id%par = 1
    id%sym = symmetric_positive_definite
    id%job = job_init
    call dmumps(id)
    id%icntl(1:4) = 0 ! no messages
    id%icntl(icntl_ordering) = ordering_given
    id%n = k%n
    id%nnz = size(k%row, kind=i8)
    id%irn => k%row
    id%jcn => k%column
    id%a => k%value
    id%perm_in => place
    id%rhs => x
    call run_job(id, job_analyse, seconds%analyse, error)
    if (.not. allocated(error)) call run_job(id, job_factorise, seconds%factorise, error)
    if (.not. allocated(error)) call run_job(id, job_solve, seconds%solve, error)
    factor_entries = int(id%infog(20), i8)
    if (factor_entries < 0) factor_entries = -1000000_i8*factor_entries ! then it is in millions
    nullify (id%irn, id%jcn, id%a, id%perm_in, id%rhs)
    id%job = job_end
    call dmumps(id)
  end subroutine solve_system

  !> One of MUMPS's jobs, timed.
  subroutine run_job(id, job, spent, error)
    type(dmumps_struc), intent(inout) :: id
    integer, intent(in) :: job
    real(wp), intent(out) :: spent                   !! [s]
    type(error_t), allocatable, intent(out) :: error !! MUMPS failed, or a pivot is negative

    spent = cpu_seconds()
    id%job = job
    call dmumps(id)
    spent = cpu_seconds() - spent
    if (id%infog(1) < 0) then
      call raise(error, exit_machine, 'MUMPS failed in its job '//to_text(job)// &
        ' (INFOG(1:2) = '//to_text(id%infog(1))//', '//to_text(id%infog(2))//')')
    else if (id%infog(12) > 0) then
      call raise(error, exit_not_solved, 'the stiffness is not positive definite ('// &
        to_text(id%infog(12))//' negative pivots): a body is not held')
    end if
  end subroutine run_job

  subroutine write_displacements(path, u, error)
    character(*), intent(in) :: path
    real(wp), intent(in) :: u(:, :)                  !! (3,n_nodes)
    type(error_t), allocatable, intent(out) :: error !! the file cannot be written
    character(200) :: reason
    integer :: unit, status

    open (newunit=unit, file=path, access='stream', form='unformatted', status='replace', &
      action='write', iostat=status, iomsg=reason)
    if (status == 0) write (unit, iostat=status, iomsg=reason) u
    if (status == 0) close (unit, iostat=status, iomsg=reason)
    if (status /= 0) call raise(error, exit_machine, path//': '//trim(reason))
  end subroutine write_displacements

  subroutine print_value(name, value)
    character(*), intent(in) :: name
    real(wp), intent(in) :: value

    write (output_unit, '(a, 1x, es23.16)') name, value
  end subroutine print_value

  !> An argument of the command line.
  function argument(i)
    integer, intent(in) :: i
    character(:), allocatable :: argument
    integer :: length

    call get_command_argument(i, length=length)
    allocate (character(length) :: argument)
    call get_command_argument(i, argument)
  end function argument

  !> Print the error, if there is one, and stop.
  subroutine stop_at(error)
    type(error_t), allocatable, intent(in) :: error

    if (.not. allocated(error)) return
    write (error_unit, '(a)') 'bare_factorisation: '//error%message
    stop 1
  end subroutine stop_at

end program bare_factorisation
