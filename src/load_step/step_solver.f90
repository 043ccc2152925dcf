!> What the increments of a *STEP are solved with. Each part has its own lifetime:
!>
!>     choices     the run, which changes them between increments
!>     body        as long as the linearisation serves
!>     undeformed  as long, but for gaps that change: these are placed by every trial
!>     response    a *STEP
!>     contact     before flat obstacles as long as `body`; before curved ones until points are
!>                 placed anew, which every trial does before it reads it
!>
!> So a trial that is discarded leaves nothing behind that another reads.
module step_solver_mod
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t, raise, exit_not_solved
  use system_mod, only: wall_seconds
  use blas_core_mod, only: use_threads
  use controls_mod, only: solver_auto
  use scene_mod, only: scene_t
  use choices_mod, only: choices_t
  use contact_points_mod, only: contact_points_t, is_pair_removed
  use interference_mod, only: set_extra_gap
  use state_mod, only: state_t
  use linearisation_mod, only: linearisation_t, solver_work_t, make_linearisation, &
    invalidate, change_obstacle_supports, lap
  use finite_forces_mod, only: tangent_t
  use bodies_mod, only: tangent_at
  use mass_matrix_mod, only: mass_t
  use inertia_mod, only: inertia_t, new_inertia
  use own_mass_mod, only: own_mass_t, own_mass_of
  use dynamic_step_mod, only: make_inertia, are_alike
  use contact_interface_mod, only: interface_dofs
  use placement_mod, only: placement_t, place_undeformed
  use condensed_contact_mod, only: condensed_contact_t, find_groups
  use condense_contact_mod, only: condense_contact
  use step_loads_mod, only: resolve_loads
  use load_response_mod, only: load_response_t, respond_to_loads
  implicit none
  private

  public :: step_solver_t, set_supports, prepare_step, place_first, widen_interface, &
    linearise_at, take_tangent, take_duration

  type :: step_solver_t
    type(choices_t) :: choices
    type(linearisation_t) :: body
    type(placement_t) :: undeformed
    !! of all points; where extra gaps change, at the end of the last increment tried
    real(wp), allocatable :: first_gap(:)
    !! (n_points) gaps of the undeformed mesh as the run begins [length]
    type(load_response_t) :: response
    type(condensed_contact_t) :: contact   !! a trial's own where points are placed anew
    real(wp), allocatable :: mu(:)         !! (n_points) coefficients that it was made with [-]
    logical, allocatable :: is_removed(:)  !! (n_points) of pairs that it was made without
    integer :: dynamic_of = 0              !! *STEP whose inertia is in the factor; 0: none
    type(mass_t), allocatable :: mass      !! by which bodies weigh, if any *STEP is dynamic
    type(own_mass_t), allocatable :: own_mass !! the certificate's, of that *STEP
    type(solver_work_t) :: on_tangents     !! work of the run on factors of tangents
  end type step_solver_t

contains

  !> Make what depends on the supports alone. What still holds is kept: all of it where nothing has
  !> changed, the factor where only the supports of obstacles have.
  subroutine set_supports(scene, points, step, prescribed, solver, work, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: step              !! whose inertia counts
    logical, intent(in) :: prescribed(:, :)  !! (3,n_nodes)
    type(step_solver_t), intent(inout) :: solver
    type(solver_work_t), intent(inout) :: work
    type(error_t), allocatable, intent(out) :: error
    !! a singular matrix; no memory; no node that could have the mass of another
    type(inertia_t), allocatable :: inertia
    logical :: changed(3, size(prescribed, 2)), is_same
    integer :: now

    ! Responses to loads are those of small strain, whatever tangent there was: a run that is
    ! continued has none.
    now = merge(step, 0, scene%steps(step)%is_dynamic)
    is_same = (now == 0) .eqv. (solver%dynamic_of == 0)
    if (now > 0 .and. solver%dynamic_of > 0) is_same = are_alike(scene, now, solver%dynamic_of)
    if (allocated(solver%body%prescribed) .and. .not. allocated(solver%body%tangent) .and. &
      is_same) then
      changed = prescribed .neqv. solver%body%prescribed
      if (.not. any(changed)) then
        if (any(abs(points%mu - solver%mu) > 0.0_wp) .or. any(are_removed(points) .neqv. &
          solver%is_removed)) call make_contact(scene, points, solver, work)
        return
      end if
      if (.not. any(changed .and. spread(scene%mesh%body > 0, 1, 3))) then
        call change_obstacle_supports(scene, points, prescribed, solver%body, error)
        if (allocated(error)) return
        call make_contact(scene, points, solver, work)
        return
      end if
    end if
    if (any(scene%steps%is_dynamic)) then
      allocate (inertia)
      call make_inertia(scene, points, step, solver%choices%divisions, prescribed, inertia, &
        error)
      if (allocated(error)) return
      solver%mass = inertia%mass
    end if
    if (allocated(solver%own_mass)) deallocate (solver%own_mass)
    if (now > 0) then
      solver%own_mass = own_mass_of(scene, points, now, prescribed)
    else if (allocated(inertia)) then
      deallocate (inertia)
    end if
    call move_alloc(inertia, solver%body%inertia)
    solver%dynamic_of = now
    call make_all(scene, points, prescribed, solver, work, error)
  end subroutine set_supports

  !> The linearisation at a tangent, and contact with it.
  subroutine linearise_at(scene, points, tangent, solver, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(tangent_t), intent(in), optional :: tangent !! of the undeformed bodies where left out
    type(step_solver_t), intent(inout) :: solver
    type(error_t), allocatable, intent(out) :: error !! as of set_supports
    type(solver_work_t) :: work
    type(placement_t) :: first
    real(wp) :: clock
    logical :: prescribed(3, scene%mesh%n_nodes)

    prescribed = solver%body%prescribed
    work = solver%on_tangents
    call make_body(scene, points, prescribed, solver, work, error, tangent)
    if (.not. allocated(error)) then
      clock = wall_seconds()
      ! Supports may hold motions of deformed bodies that they leave free to undeformed ones.
      if (.not. is_same(solver%contact%motion_body, solver%body%motions%body)) call find_groups( &
        scene, points, solver%body%motions, solver%choices%precision%iterative, solver%contact)
      first = solver%undeformed
      first%gap = solver%first_gap
      call condense_contact(scene, solver%choices%tolerance, points, solver%body, first, first, &
        solver%contact)
      call lap(clock, work%condense)
    end if
    solver%on_tangents = work

  contains

    pure logical function is_same(one, other)
      integer, intent(in) :: one(:), other(:)

      is_same = size(one) == size(other)
      if (is_same) is_same = all(one == other)
    end function is_same

  end subroutine linearise_at

  !> At finite strain: the factor of the tangent that a state says, and what loads do by it; where
  !> that is not positive definite, with so much left out of what is negative in the elements' that
  !> it is. Where nothing helps, as in elements that are all but flat, the one before stays. A body
  !> that has turned answers to its loads as it stands. With inertia what has to be left out depends
  !> on the length of increments: a run that is continued begins with the one that it had.
  subroutine take_tangent(scene, points, state, solver, is_taken, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(state_t), intent(inout) :: state !! its tangent
    type(step_solver_t), intent(inout) :: solver
    logical, intent(out) :: is_taken
    type(error_t), allocatable, intent(out) :: error !! as of set_supports
    type(tangent_t), allocatable :: tangent, before
    integer :: before_of

    if (allocated(solver%body%tangent)) before = solver%body%tangent
    before_of = solver%body%made_after
    if (allocated(solver%body%inertia)) then
      associate (inertia => solver%body%inertia, dt => state%tangent_dt)
        if (dt > 0.0_wp) inertia = new_inertia(inertia%mass, inertia%damping, inertia%alpha, dt)
        dt = inertia%dt
      end associate
    end if
    call find_tangent(scene, state, tangent)
    call linearise_definite(scene, points, tangent, solver, is_taken, error)
    if (allocated(tangent)) state%tangent_projection = tangent%projection
    if (allocated(error)) return
    if (.not. is_taken) then
      state%tangent_of = before_of
      deallocate (state%tangent_at)
      if (allocated(before)) then
        state%tangent_at = before%at
        state%tangent_projection = before%projection
      end if
      call linearise_at(scene, points, before, solver, error)
      if (allocated(error)) return
    end if
    solver%body%made_after = state%tangent_of
    call respond_to_loads(scene, solver%choices%tolerance, solver%body, solver%response, &
      solver%on_tangents, error)
  end subroutine take_tangent

  !> The tangent that a state says; none of undeformed bodies.
  pure subroutine find_tangent(scene, state, tangent)
    type(scene_t), intent(in) :: scene
    type(state_t), intent(in) :: state
    type(tangent_t), allocatable, intent(out) :: tangent

    if (allocated(state%tangent_at)) tangent = tangent_at(scene, state%tangent_at, &
      state%tangent_step, state%tangent_position, state%tangent_projection)
  end subroutine find_tangent

  !> The linearisation at a tangent, with so much left out of what is negative in the elements' that
  !> the whole is positive definite; where nothing helps there is none.
  subroutine linearise_definite(scene, points, tangent, solver, is_definite, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(tangent_t), allocatable, intent(inout) :: tangent
    !! of undeformed bodies where there is none
    type(step_solver_t), intent(inout) :: solver
    logical, intent(out) :: is_definite
    type(error_t), allocatable, intent(out) :: error !! as of set_supports
    real(wp), parameter :: more = 0.5_wp !! that is left out at a time [-]

    do
      call linearise_at(scene, points, tangent, solver, error)
      is_definite = .not. allocated(error)
      if (is_definite) return
      if (error%exit_status /= exit_not_solved .or. .not. allocated(tangent)) return
      if (.not. tangent%projection < 1.0_wp) exit
      tangent%projection = tangent%projection + more
    end do
    deallocate (error)
  end subroutine linearise_definite

  !> In a dynamic *STEP: the factor for increments of a length, and what loads do by it. A tangent
  !> that is not positive definite with the inertia of these is treated as take_tangent does, and
  !> where nothing helps the factor is that of undeformed bodies.
  subroutine take_duration(scene, points, state, dt, solver, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(state_t), intent(in) :: state               !! its tangent is the solver's
    real(wp), intent(in) :: dt                       !! [time]
    type(step_solver_t), intent(inout) :: solver     !! prepared for the step
    type(error_t), allocatable, intent(out) :: error !! as of set_supports and prepare_step
    type(solver_work_t) :: work
    type(tangent_t), allocatable :: tangent
    integer :: after
    logical :: prescribed(3, scene%mesh%n_nodes), is_definite

    associate (inertia => solver%body%inertia)
      if (.not. abs(inertia%dt - dt) > 0.0_wp) return
      inertia = new_inertia(inertia%mass, inertia%damping, inertia%alpha, dt)
    end associate
    prescribed = solver%body%prescribed
    after = solver%body%made_after
    call find_tangent(scene, state, tangent)
    is_definite = allocated(tangent)
    if (is_definite) call linearise_definite(scene, points, tangent, solver, is_definite, error)
    work = solver%on_tangents
    if (.not. (is_definite .or. allocated(error))) call make_all(scene, points, prescribed, &
      solver, work, error)
    if (.not. allocated(error)) call respond_to_loads(scene, solver%choices%tolerance, &
      solver%body, solver%response, work, error)
    solver%body%made_after = after
    solver%on_tangents = work
    ! No length has a factor now.
    if (allocated(error) .and. allocated(solver%body%inertia)) solver%body%inertia%dt = 0.0_wp
  end subroutine take_duration

  !> Take the whole of the slave surfaces into the interface, in the middle of a *STEP.
  subroutine widen_interface(scene, points, solver, work, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points !! all of them in reach
    type(step_solver_t), intent(inout) :: solver
    type(solver_work_t), intent(inout) :: work
    type(error_t), allocatable, intent(out) :: error !! as of set_supports and prepare_step
    logical :: prescribed(3, scene%mesh%n_nodes)

    prescribed = solver%body%prescribed
    call make_all(scene, points, prescribed, solver, work, error)
    if (allocated(error)) return
    call respond_to_loads(scene, solver%choices%tolerance, solver%body, solver%response, work, &
      error)
  end subroutine widen_interface

  !> At the start of a *STEP: its load patterns and the displacements they cause without contact.
  subroutine prepare_step(scene, step, state, solver, work, error)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    type(state_t), intent(in) :: state        !! at the start of the *STEP
    type(step_solver_t), intent(inout) :: solver
    type(solver_work_t), intent(inout) :: work
    type(error_t), allocatable, intent(out) :: error
    !! MUMPS failed; the factor is too far from the stiffness

    if (allocated(solver%mass)) then
      call resolve_loads(scene, step, state%displacement, solver%response%loads, solver%mass)
    else
      call resolve_loads(scene, step, state%displacement, solver%response%loads)
    end if
    call respond_to_loads(scene, solver%choices%tolerance, solver%body, solver%response, work, &
      error)
  end subroutine prepare_step

  subroutine make_all(scene, points, prescribed, solver, work, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    logical, intent(in) :: prescribed(:, :)
    type(step_solver_t), intent(inout) :: solver
    type(solver_work_t), intent(inout) :: work
    type(error_t), allocatable, intent(out) :: error

    call make_body(scene, points, prescribed, solver, work, error)
    if (.not. allocated(error)) call make_contact(scene, points, solver, work)
  end subroutine make_all

  !> The linearisation, of small strain unless there is a tangent.
  subroutine make_body(scene, points, prescribed, solver, work, error, tangent)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    logical, intent(in) :: prescribed(:, :)
    type(step_solver_t), intent(inout) :: solver
    type(solver_work_t), intent(inout) :: work
    type(error_t), allocatable, intent(out) :: error
    type(tangent_t), intent(in), optional :: tangent !! as of linearisation_t
    type(inertia_t), allocatable :: inertia

    call move_alloc(solver%body%inertia, inertia)
    call invalidate(solver%body)
    call move_alloc(inertia, solver%body%inertia)
    solver%body%prescribed = prescribed
    if (present(tangent)) solver%body%tangent = tangent
    if (solver%choices%precision%threads > 1) call use_threads(solver%choices%precision%threads)
    call make_linearisation(scene, solver%choices, points, interface_dofs(scene, points), &
      solver%body, work, error)
    if (solver%choices%precision%threads > 1) call use_threads(1)
    if (allocated(error)) return
    if (solver%choices%precision%renews_tangent .and. solver%body%motions%n > 0 .and. &
      scene%contact%solver /= solver_auto) call raise(error, exit_not_solved, 'TANGENT=NEWTON '// &
      'with a SOLVER of *CONTACT SOLVER does not cover bodies or obstacles that supports do '// &
      'not hold; SOLVER=AUTO does')
  end subroutine make_body

  !> Where points are in the undeformed mesh.
  subroutine place_first(scene, points, solver)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(inout) :: solver
    type(contact_points_t) :: first

    first = points
    call set_extra_gap(scene, 1, 0_i8, first)
    call place_undeformed(scene, first, solver%undeformed)
    solver%first_gap = solver%undeformed%gap
  end subroutine place_first

  !> The contact problem of the undeformed mesh.
  subroutine make_contact(scene, points, solver, work)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(inout) :: solver
    type(solver_work_t), intent(inout) :: work
    real(wp) :: clock

    clock = wall_seconds()
    call place_first(scene, points, solver)
    call find_groups(scene, points, solver%body%motions, solver%choices%precision%iterative, &
      solver%contact)
    call condense_contact(scene, solver%choices%tolerance, points, solver%body, solver%undeformed, &
      solver%undeformed, solver%contact)
    solver%mu = points%mu
    solver%is_removed = are_removed(points)
    call lap(clock, work%condense)
  end subroutine make_contact

  !> Which points are of pairs that are removed.
  pure function are_removed(points)
    type(contact_points_t), intent(in) :: points
    logical :: are_removed(points%n)
    integer :: i

    are_removed = [(is_pair_removed(points, points%pair(i)), i=1, points%n)]
  end function are_removed

end module step_solver_mod
