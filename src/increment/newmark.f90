!> Velocities and accelerations of an increment, and what those of its beginning make of its loads.
!> docs/theory.md, section 13.
module newmark_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t
  use constraints_mod, only: follow_masters, give_to_masters
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use increments_mod, only: increment_t
  use state_mod, only: state_t
  use bodies_mod, only: find_internal_force
  use expansion_mod, only: find_free_strain
  use mass_matrix_mod, only: times_mass, diagonal_of
  use inertia_mod, only: inertial_force
  use placement_mod, only: placement_t, place_state
  use transfer_mod, only: nodal_forces
  use stiffness_inverse_mod, only: apply_inverse
  use load_response_mod, only: sum_patterns, prescribed_displacement
  use step_solver_mod, only: step_solver_t
  implicit none
  private

  public :: begin_motion, begin_inertia, inertia_at, rounding_of_inertia, end_inertia, &
    begin_again, come_to_rest

contains

  !> The state where a dynamic *STEP begins: what its loads, and the contact forces that are there,
  !> make of the bodies. Nodes without mass are in balance.
  subroutine begin_motion(scene, points, solver, increment, state)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    type(increment_t), intent(in) :: increment !! the first of its *STEP
    type(state_t), intent(inout) :: state
    type(placement_t) :: began
    real(wp), allocatable :: u_free(:, :), loads(:, :)
    real(wp) :: free(scene%mesh%n_elements), kinetic
    integer :: inverted

    if (.not. allocated(solver%body%inertia)) return
    if (.not. allocated(state%velocity)) allocate (state%velocity(3, scene%mesh%n_nodes), &
      source=0.0_wp)
    if (.not. allocated(state%acceleration)) allocate (state%acceleration, state%unopposed, &
      mold=state%velocity)
    associate (mass => solver%body%inertia%mass, held => solver%body%prescribed)
      ! Given velocities are those of free nodes.
      where (held .and. state%increments_done == 0) state%velocity = 0.0_wp
      call follow_masters(solver%body%constraints, state%velocity)
      call strike(scene, solver, increment, state%velocity)
      call sum_patterns(scene, solver%response, increment%begin, 0.0_wp, u_free, loads)
      state%external_force = loads
      call find_free_strain(scene, increment%step, increment%start, free)
      call find_internal_force(scene, free, state%displacement, state%modes, state%unopposed, &
        inverted)
      call place_state(scene, points, solver%undeformed, state, began, everywhere=.true.)
      state%unopposed = state%unopposed - loads - nodal_forces(points, began%weights, &
        state%reaction, scene%mesh%n_nodes)
      call give_to_masters(solver%body%constraints, state%unopposed)
      call clear_dependent(solver, state%unopposed)
      where (held .or. .not. have_inertia(solver)) state%unopposed = 0.0_wp
      call accelerate(solver, -state%unopposed, state%acceleration)
      kinetic = 0.5_wp*sum(state%velocity*times_mass(mass, state%velocity))
    end associate
    state%begun_energy = state%begun_energy + (kinetic - state%kinetic_energy)
    state%kinetic_energy = kinetic
    state%least_gain = kinetic + state%strain_energy + state%dissipation - state%external_work - &
      state%begun_energy
  end subroutine begin_motion

  !> Supports that begin to move at once: the velocities that their impulse leaves.
  subroutine strike(scene, solver, increment, velocity)
    type(scene_t), intent(in) :: scene
    type(step_solver_t), intent(in) :: solver
    type(increment_t), intent(in) :: increment    !! that begins
    real(wp), intent(inout) :: velocity(:, :)     !! (3,n_nodes) [length/time]
    real(wp), dimension(3, size(velocity, 2)) :: impulse, change
    type(increment_t) :: beginning

    beginning = increment
    beginning%fraction = increment%begin
    beginning%step_time = increment%begin*scene%steps(increment%step)%period
    associate (body => solver%body, loads => solver%response%loads)
      change = (prescribed_displacement(scene, loads, increment) - prescribed_displacement(scene, &
        loads, beginning))/body%inertia%dt - velocity
      where (.not. body%prescribed) change = 0.0_wp
      call follow_masters(body%constraints, change)
      if (.not. maxval(abs(change)) > 0.0_wp) return
      impulse = -times_mass(body%inertia%mass, change)
      call give_to_masters(body%constraints, impulse)
      velocity = velocity + change
      call accelerate(solver, impulse, change)
      velocity = velocity + change
    end associate
  end subroutine strike

  !> Which degrees of freedom accelerate by forces: those of nodes that have mass, and what these
  !> depend on.
  pure function have_inertia(solver) result(have)
    type(step_solver_t), intent(in) :: solver
    logical, allocatable :: have(:, :) !! (3,n_nodes)
    integer :: c, k

    have = spread(solver%body%inertia%mass%carries, 1, 3)
    associate (all => solver%body%constraints)
      do c = 1, all%n
        if (.not. have(all%dof(c), all%node(c))) cycle
        do k = all%first(c), all%first(c + 1) - 1
          have(all%master_dof(k), all%master(k)) = .true.
        end do
      end do
    end associate
  end function have_inertia

  !> The accelerations that forces make of what has mass and is free: by conjugate gradients, for
  !> the condition of a mass beside its diagonal is no more than some tens.
  subroutine accelerate(solver, force, a)
    type(step_solver_t), intent(in) :: solver
    real(wp), intent(in) :: force(:, :)  !! (3,n_nodes) [force]
    real(wp), intent(out) :: a(:, :)     !! (3,n_nodes) [length/time^2]
    real(wp), parameter :: enough = 1.0e-14_wp !! left of the force [-]
    integer, parameter :: most = 1000
    real(wp), dimension(3, size(a, 2)) :: left, way, answer, scaled, diagonal
    real(wp) :: product, next, first
    logical :: moves(3, size(a, 2))
    integer :: i, k

    a = 0.0_wp
    associate (mass => solver%body%inertia%mass, constraints => solver%body%constraints)
      moves = have_inertia(solver) .and. .not. solver%body%prescribed
      do i = 1, constraints%n
        moves(constraints%dof(i), constraints%node(i)) = .false.
      end do
      diagonal = spread(diagonal_of(mass), 1, 3)
      do i = 1, constraints%n
        do k = constraints%first(i), constraints%first(i + 1) - 1
          associate (at => diagonal(constraints%master_dof(k), constraints%master(k)))
            at = at + constraints%weight(k)**2*diagonal(constraints%dof(i), constraints%node(i))
          end associate
        end do
      end do
      left = merge(force, 0.0_wp, moves)
      first = maxval(abs(left))
      where (.not. diagonal > 0.0_wp) diagonal = 1.0_wp
      scaled = left/diagonal
      way = scaled
      product = sum(left*scaled)
      do i = 1, most
        if (.not. maxval(abs(left)) > enough*first) exit
        call follow_masters(constraints, way)
        answer = times_mass(mass, way)
        call give_to_masters(constraints, answer)
        answer = merge(answer, 0.0_wp, moves)
        next = product/sum(way*answer, mask=moves)
        a = a + next*way
        left = left - next*answer
        scaled = left/diagonal
        next = sum(left*scaled)
        way = scaled + next/product*way
        product = next
      end do
      call follow_masters(constraints, a)
    end associate
  end subroutine accelerate

  pure subroutine clear_dependent(solver, f)
    type(step_solver_t), intent(in) :: solver
    real(wp), intent(inout) :: f(:, :)
    integer :: c

    associate (all => solver%body%constraints)
      do c = 1, all%n
        f(all%dof(c), all%node(c)) = 0.0_wp
      end do
    end associate
  end subroutine clear_dependent

  !> Where the increment would go without forces, what is left of those of its beginning, and the
  !> displacement that both make.
  subroutine begin_inertia(scene, solver, old, increment, error)
    type(scene_t), intent(in) :: scene
    type(step_solver_t), intent(inout) :: solver
    type(state_t), intent(in) :: old
    type(increment_t), intent(in) :: increment
    type(error_t), allocatable, intent(out) :: error !! MUMPS failed
    real(wp), dimension(3, scene%mesh%n_nodes) :: u
    real(wp), allocatable :: answer(:, :, :)

    if (.not. allocated(solver%body%inertia)) return
    associate (inertia => solver%body%inertia)
      u = prescribed_displacement(scene, solver%response%loads, increment)
      solver%predictor = old%displacement + inertia%dt*(old%velocity + inertia%dt*(0.5_wp - &
        inertia%beta)*old%acceleration)
      ! What supports move has the accelerations of its mean velocities.
      where (solver%body%prescribed) solver%predictor = u - inertia%beta*(u - old%displacement - &
        inertia%dt*old%velocity)
      call follow_masters(solver%body%constraints, solver%predictor)
      solver%left_over = inertia%alpha/(1.0_wp + inertia%alpha)*old%unopposed
      call apply_inverse(solver%body%inverse, reshape(solver%left_over + inertia%factor* &
        times_mass(inertia%mass, solver%predictor), [3, size(u, 2), 1]), answer, error)
      if (.not. allocated(error)) solver%by_inertia = answer(:, :, 1)
    end associate
  end subroutine begin_inertia

  !> The force of inertia, less what is left of the beginning's, as a part of the internal force.
  pure function inertia_at(solver, u) result(f)
    type(step_solver_t), intent(in) :: solver
    real(wp), intent(in) :: u(:, :)       !! (3,n_nodes) [length]
    real(wp) :: f(3, size(u, 2))          !! [force]

    f = inertial_force(solver%body%inertia, u, solver%predictor) - solver%left_over
  end function inertia_at

  !> How well it is known, of places that are rounded.
  pure function rounding_of_inertia(solver, u) result(rounding)
    type(step_solver_t), intent(in) :: solver
    real(wp), intent(in) :: u(:, :)       !! (3,n_nodes) [length]
    real(wp) :: rounding(size(u, 2))      !! [force]

    rounding = 8.0_wp*epsilon(1.0_wp)*solver%body%inertia%factor*maxval(abs(u))* &
      diagonal_of(solver%body%inertia%mass)
  end function rounding_of_inertia

  !> Velocities and accelerations at the end of the increment, and the forces that they answer.
  subroutine end_inertia(solver, old, internal, pressed, external, new)
    type(step_solver_t), intent(in) :: solver
    type(state_t), intent(in) :: old
    real(wp), dimension(:, :), intent(in) :: internal, pressed, external
    !! (3,n_nodes) of the end, inertia among the internal forces [force]
    type(state_t), intent(inout) :: new    !! its displacement in
    real(wp), dimension(3, size(internal, 2)) :: of_inertia
    logical :: has_inertia(3, size(internal, 2))

    associate (inertia => solver%body%inertia, u => new%displacement)
      has_inertia = have_inertia(solver)
      new%acceleration = (u - solver%predictor)/(inertia%beta*inertia%dt**2)
      where (.not. has_inertia) new%acceleration = 0.0_wp
      call follow_masters(solver%body%constraints, new%acceleration)
      new%velocity = old%velocity + inertia%dt*((1.0_wp - inertia%gamma)*old%acceleration + &
        inertia%gamma*new%acceleration)
      where (solver%body%prescribed .or. .not. has_inertia) new%velocity = &
        (u - old%displacement)/inertia%dt
      call follow_masters(solver%body%constraints, new%velocity)
      of_inertia = times_mass(inertia%mass, new%acceleration)
      new%unopposed = internal - inertia_at(solver, u) - external - pressed
      call give_to_masters(solver%body%constraints, new%unopposed)
      call clear_dependent(solver, new%unopposed)
      call give_to_masters(solver%body%constraints, of_inertia)
      where (solver%body%prescribed) new%unopposed = (inertia%alpha*old%unopposed - of_inertia)/ &
        (1.0_wp + inertia%alpha)
    end associate
  end subroutine end_inertia

  !> Where a *STEP begins its loads may jump: have the first increment begin with the accelerations
  !> and the forces that it ended with.
  subroutine begin_again(solver, new, old)
    type(step_solver_t), intent(in) :: solver
    type(state_t), intent(in) :: new
    type(state_t), intent(inout) :: old

    associate (mass => solver%body%inertia%mass)
      old%acceleration = merge(0.0_wp, new%acceleration, solver%body%prescribed)
      call follow_masters(solver%body%constraints, old%acceleration)
      old%unopposed = -times_mass(mass, old%acceleration)
      call give_to_masters(solver%body%constraints, old%unopposed)
      call clear_dependent(solver, old%unopposed)
    end associate
    old%reaction = new%reaction
    old%support_force = new%support_force
  end subroutine begin_again

  !> In a static *STEP bodies are at rest, and what they had of kinetic energy is lost.
  pure subroutine come_to_rest(state)
    type(state_t), intent(inout) :: state

    if (allocated(state%velocity)) deallocate (state%velocity)
    if (allocated(state%acceleration)) deallocate (state%acceleration, state%unopposed)
    state%begun_energy = state%begun_energy - state%kinetic_energy
    state%kinetic_energy = 0.0_wp
  end subroutine come_to_rest

end module newmark_mod
