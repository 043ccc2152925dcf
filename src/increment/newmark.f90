!> Velocities and accelerations of an increment, and what those of its beginning make of its loads.
!> docs/theory.md, section 13.
module newmark_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t
  use constraints_mod, only: follow_masters, give_to_masters
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use increments_mod, only: increment_t, smallest_increment, duration_of
  use state_mod, only: state_t
  use bodies_mod, only: find_internal_force, is_linear
  use expansion_mod, only: find_free_strain
  use mass_matrix_mod, only: times_mass, diagonal_of
  use inertia_mod, only: in_motion_t, earlier_part
  use own_inertia_mod, only: expect_energies
  use damping_mod, only: damping_force
  use placement_mod, only: placement_t, place_state
  use transfer_mod, only: nodal_forces
  use stiffness_inverse_mod, only: apply_inverse, begin_inverse
  use increment_forces_mod, only: imposed_t
  use load_response_mod, only: sum_patterns, impose_loads, prescribed_displacement, prescribed_rate
  use dynamic_step_mod, only: goes_on
  use step_solver_mod, only: step_solver_t
  implicit none
  private

  public :: by_inertia_t, begins_anew, begin_motion, error_in_time, watch_inertia, begin_inertia, &
    end_inertia, come_to_rest

  !> What inertia makes of an increment's beginning.
  type :: by_inertia_t
    type(in_motion_t) :: in_motion
    real(wp), allocatable :: u(:, :)
    !! (3,n_nodes) displacement by its predictor and what is left over; not allocated at finite
    !! strain, where iterations begin as the increment does [length]
    real(wp), allocatable :: on_interface(:)
    !! (n_interface) the same, where the solution has been begun on the interface alone [length]
  end type by_inertia_t

contains

  !> Whether accelerations jump where an increment of a dynamic *STEP begins: as the *STEP does,
  !> unless it goes on as the one before it, and behind a jump of an amplitude.
  logical function begins_anew(scene, solver, old, increment)
    type(scene_t), intent(in) :: scene
    type(step_solver_t), intent(in) :: solver  !! for increments of this length
    type(state_t), intent(in) :: old
    type(increment_t), intent(in) :: increment
    real(wp), parameter :: rounded = 1.0e-9_wp !! loads and velocities that are the same [-]
    real(wp), dimension(3, scene%mesh%n_nodes) :: first, last, loads
    type(increment_t) :: beginning

    begins_anew = allocated(solver%body%inertia)
    if (.not. begins_anew) return
    if (.not. increment%first_of_step) then
      begins_anew = any(abs(solver%response%loads%jumps - increment%start) < smallest_increment)
      return
    end if
    if (.not. (goes_on(scene, increment%step, solver%body%prescribed) .and. &
      allocated(old%acceleration))) return
    beginning = beginning_of(scene, solver, increment)
    loads = loads_at(scene, solver, beginning, old%displacement)
    call find_speeds(scene, solver, increment, first, last)
    begins_anew = differ(loads, old%external_force) .or. differ(first, merge(old%velocity, 0.0_wp, &
      solver%body%prescribed))

  contains

    pure logical function differ(one, other)
      real(wp), intent(in) :: one(:, :), other(:, :)

      differ = maxval(abs(one - other)) > rounded*max(maxval(abs(one)), maxval(abs(other)))
    end function differ

  end function begins_anew

  !> The loads at an end of an increment, on bodies that are displaced.
  function loads_at(scene, solver, increment, u) result(loads)
    type(scene_t), intent(in) :: scene
    type(step_solver_t), intent(in) :: solver
    type(increment_t), intent(in) :: increment
    real(wp), intent(in) :: u(:, :)            !! (3,n_nodes) [length]
    real(wp) :: loads(3, scene%mesh%n_nodes)   !! [force]
    real(wp), allocatable :: u_free(:, :)
    type(imposed_t) :: imposed

    call sum_patterns(scene, solver%response, increment%fraction, increment%step_time, u_free, &
      imposed%external)
    call impose_loads(scene, solver%response%loads, increment%fraction, increment%step_time, u, &
      imposed)
    loads = imposed%external
  end function loads_at

  !> The beginning of an increment, as an end: behind the jumps that are there.
  pure type(increment_t) function beginning_of(scene, solver, increment) result(beginning)
    type(scene_t), intent(in) :: scene
    type(step_solver_t), intent(in) :: solver
    type(increment_t), intent(in) :: increment
    integer :: i

    beginning = increment
    beginning%fraction = increment%begin
    beginning%step_time = increment%begin*scene%steps(increment%step)%period
    associate (loads => solver%response%loads)
      do i = 1, size(loads%jumps)
        if (abs(loads%jumps(i) - increment%start) < smallest_increment) beginning%step_time = &
          max(beginning%step_time, loads%over(i))
      end do
    end associate
  end function beginning_of

  !> The velocities of supports where an increment begins and ends, and their acceleration at its
  !> beginning: those within the increment, of amplitudes that have a kink there.
  pure subroutine find_speeds(scene, solver, increment, first, last, acceleration)
    type(scene_t), intent(in) :: scene
    type(step_solver_t), intent(in) :: solver
    type(increment_t), intent(in) :: increment
    real(wp), dimension(3, scene%mesh%n_nodes), intent(out) :: first, last !! [length/time]
    real(wp), intent(out), optional :: acceleration(3, scene%mesh%n_nodes) !! [length/time^2]
    type(increment_t) :: beginning

    beginning = beginning_of(scene, solver, increment)
    associate (start => beginning%step_time, stop => increment%step_time)
      first = rate_at(1, start, start + margin_of(scene, increment%step))
      last = rate_at(1, stop, stop - margin_of(scene, increment%step))
      if (present(acceleration)) acceleration = rate_at(2, start, start + margin_of(scene, &
        increment%step))
    end associate

  contains

    pure function rate_at(order, time, inside) result(rate)
      integer, intent(in) :: order
      real(wp), intent(in) :: time, inside
      real(wp) :: rate(3, scene%mesh%n_nodes)

      rate = merge(prescribed_rate(scene, solver%response%loads, order, &
        scene%steps(increment%step)%period, time, inside), 0.0_wp, solver%body%prescribed)
    end function rate_at

  end subroutine find_speeds

  !> How far ends of increments may be from kinks of amplitudes that they are meant to meet: half of
  !> the shortest increment, so that its middle is inside.
  pure real(wp) function margin_of(scene, step) result(margin)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step

    margin = 0.5_wp*duration_of(scene%steps(step), smallest_increment)
  end function margin_of

  !> The kinetic energies that bodies have when the fastest of their supports takes them along, of
  !> the whole *STEP: a motion that begins at rest has little beside which errors count.
  pure function energies_of_supports(scene, solver, step) result(energy)
    type(scene_t), intent(in) :: scene
    type(step_solver_t), intent(in) :: solver
    integer, intent(in) :: step
    real(wp) :: energy(0:scene%mesh%n_bodies)
    integer, parameter :: n = 128 !! places of the *STEP that are looked at
    real(wp) :: rate(3, scene%mesh%n_nodes), speed(0:scene%mesh%n_pieces), time
    integer :: body(0:scene%mesh%n_pieces), i, node

    speed = 0.0_wp
    body = 0
    body(scene%mesh%piece) = scene%mesh%body
    do i = 1, n
      time = real(i, wp)/n*scene%steps(step)%period
      rate = prescribed_rate(scene, solver%response%loads, 1, scene%steps(step)%period, time, &
        time - margin_of(scene, step))
      do node = 1, scene%mesh%n_nodes
        associate (of_piece => speed(scene%mesh%piece(node)))
          of_piece = max(of_piece, norm2(rate(:, node)))
        end associate
      end do
    end do
    energy = 0.0_wp
    do i = 1, scene%mesh%n_pieces
      energy(body(i)) = energy(body(i)) + 0.5_wp*solver%body%inertia%mass%whole(1, 1, i)* &
        speed(i)**2
    end do
  end function energies_of_supports

  !> The state where accelerations jump: what loads, and the contact forces that are there, make of
  !> the bodies. Nodes without mass are in balance.
  subroutine begin_motion(scene, points, solver, increment, state)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    type(increment_t), intent(in) :: increment !! that begins there
    type(state_t), intent(inout) :: state
    type(placement_t) :: began
    real(wp), dimension(3, scene%mesh%n_nodes) :: loads, first, last, of_supports, of_inertia
    real(wp) :: free(scene%mesh%n_elements), kinetic, of_bodies(0:scene%mesh%n_bodies)
    integer :: inverted
    type(increment_t) :: beginning
    logical :: was_at_rest

    was_at_rest = .not. allocated(state%acceleration)
    beginning = beginning_of(scene, solver, increment)
    if (.not. allocated(state%velocity)) allocate (state%velocity(3, scene%mesh%n_nodes), &
      source=0.0_wp)
    if (allocated(state%momentum)) deallocate (state%momentum)
    if (was_at_rest) allocate (state%acceleration, state%unopposed, &
      mold=state%velocity)
    if (.not. allocated(state%twist)) allocate (state%twist(3, scene%mesh%n_pieces), source=0.0_wp)
    associate (mass => solver%body%inertia%mass, held => solver%body%prescribed)
      ! Given velocities are those of free nodes.
      where (held .and. state%increments_done == 0) state%velocity = 0.0_wp
      call follow_masters(solver%body%constraints, state%velocity)
      call find_speeds(scene, solver, increment, first, last, of_supports)
      call strike(solver, first, state%velocity)
      loads = loads_at(scene, solver, beginning, state%displacement)
      state%external_force = loads
      call find_free_strain(scene, increment%step, increment%start, free)
      call find_internal_force(scene, free, state%displacement, state%modes, state%unopposed, &
        inverted)
      call place_state(scene, points, solver%undeformed, state, began, everywhere=.true.)
      state%mean_velocity = state%velocity
      state%damping_force = damping_by(scene, solver, state%velocity)
      state%unopposed = state%unopposed + state%damping_force - loads - nodal_forces(points, &
        began%weights, state%reaction, scene%mesh%n_nodes)
      call give_to_masters(solver%body%constraints, state%unopposed)
      call clear_dependent(solver, state%unopposed)
      state%support_force = merge(state%unopposed, 0.0_wp, held)
      where (held .or. .not. have_inertia(solver)) state%unopposed = 0.0_wp
      of_inertia = inertia_of(solver, of_supports)
      call accelerate(solver, -state%unopposed - of_inertia, state%acceleration)
      where (held) state%acceleration = of_supports
      of_inertia = inertia_of(solver, state%acceleration)
      where (held)
        state%unopposed = -of_inertia
        state%support_force = state%support_force + of_inertia
      end where
      kinetic = 0.5_wp*sum(state%velocity*times_mass(mass, state%velocity))
    end associate
    state%begun_energy = state%begun_energy + (kinetic - state%kinetic_energy)
    state%kinetic_energy = kinetic
    ! What static increments leave of work is none of its errors.
    if (was_at_rest) state%least_gain = given(state)
    of_bodies = energies_of_supports(scene, solver, increment%step)
    state%largest_energy = max(state%largest_energy, kinetic + state%strain_energy, sum(of_bodies))
    call expect_energies(of_bodies, state)
  end subroutine begin_motion

  !> Supports that begin to move at once: the velocities that their impulse leaves.
  subroutine strike(solver, speed, velocity)
    type(step_solver_t), intent(in) :: solver
    real(wp), intent(in) :: speed(:, :)           !! (3,n_nodes) of supports [length/time]
    real(wp), intent(inout) :: velocity(:, :)     !! (3,n_nodes) [length/time]
    real(wp), dimension(3, size(velocity, 2)) :: change

    associate (body => solver%body)
      change = merge(speed - velocity, 0.0_wp, body%prescribed)
      call follow_masters(body%constraints, change)
      if (.not. maxval(abs(change)) > 0.0_wp) return
      velocity = velocity + change
      call accelerate(solver, -inertia_of(solver, change), change)
      velocity = velocity + change
    end associate
  end subroutine strike

  !> The forces of inertia of accelerations, or the momentum of velocities, where they act.
  pure function inertia_of(solver, a) result(f)
    type(step_solver_t), intent(in) :: solver
    real(wp), intent(in) :: a(:, :)  !! (3,n_nodes)
    real(wp) :: f(3, size(a, 2)), moved(3, size(a, 2))

    moved = a
    call follow_masters(solver%body%constraints, moved)
    f = times_mass(solver%body%inertia%mass, moved)
    call give_to_masters(solver%body%constraints, f)
  end function inertia_of

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
  !> displacement that both make: before flat obstacles that of the interface is enough for contact.
  subroutine begin_inertia(scene, points, solver, old, increment, by_inertia, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(inout) :: solver !! solutions with its factor
    type(state_t), intent(in) :: old
    type(increment_t), intent(in) :: increment
    type(by_inertia_t), allocatable, intent(out) :: by_inertia !! not allocated in a static *STEP
    type(error_t), allocatable, intent(out) :: error !! MUMPS failed
    real(wp), dimension(3, scene%mesh%n_nodes) :: u, first, force
    real(wp), allocatable :: answer(:, :, :)

    if (.not. allocated(solver%body%inertia)) return
    allocate (by_inertia)
    associate (inertia => solver%body%inertia, in_motion => by_inertia%in_motion)
      allocate (in_motion%speed, mold=u)
      call find_speeds(scene, solver, increment, first, in_motion%speed)
      in_motion%predictor = old%displacement + inertia%dt*(old%velocity + inertia%dt*(0.5_wp - &
        inertia%beta)*old%acceleration)
      ! Supports have the mean acceleration of the increment.
      u = prescribed_displacement(scene, solver%response%loads, increment)
      where (solver%body%prescribed) in_motion%predictor = u - inertia%beta*inertia%dt* &
        (in_motion%speed - old%velocity)
      call follow_masters(solver%body%constraints, in_motion%predictor)
      in_motion%earlier = earlier_part(inertia, old%displacement, old%mean_velocity)
      in_motion%left_over = inertia%alpha/(1.0_wp + inertia%alpha)*old%unopposed
      ! At finite strain iterations begin where the increment does.
      if (.not. is_linear(scene)) return
      force = in_motion%left_over + inertia%factor*times_mass(inertia%mass, in_motion%predictor) + &
        damping_by(scene, solver, in_motion%earlier)
    end associate
    if (any(points%is_curved)) then
      call apply_inverse(solver%body%inverse, reshape(force, [3, size(u, 2), 1]), answer, error)
      if (.not. allocated(error)) by_inertia%u = answer(:, :, 1)
    else
      call begin_inverse(solver%body%inverse, force, by_inertia%on_interface, u, error)
      if (.not. allocated(error)) by_inertia%u = u
    end if
  end subroutine begin_inertia

  !> The forces of damping by velocities.
  pure function damping_by(scene, solver, v) result(f)
    type(scene_t), intent(in) :: scene
    type(step_solver_t), intent(in) :: solver
    real(wp), intent(in) :: v(:, :)       !! (3,n_nodes) [length/time]
    real(wp) :: f(3, size(v, 2))          !! [force]

    f = damping_force(solver%body%inertia%damping, scene%mesh, solver%body%inertia%mass, v)
  end function damping_by

  !> Velocities and accelerations at the end of the increment, and the forces that they answer.
  subroutine end_inertia(scene, solver, old, in_motion, internal, pressed, external, new)
    type(scene_t), intent(in) :: scene
    type(step_solver_t), intent(in) :: solver
    type(state_t), intent(in) :: old
    type(in_motion_t), intent(in) :: in_motion !! its force is among the internal ones
    real(wp), dimension(:, :), intent(in) :: internal, pressed, external
    !! (3,n_nodes) of the end [force]
    type(state_t), intent(inout) :: new    !! its displacement in
    real(wp), dimension(3, size(internal, 2)) :: momentum_rate
    logical :: has_inertia(3, size(internal, 2))

    associate (inertia => solver%body%inertia, u => new%displacement)
      has_inertia = have_inertia(solver)
      new%acceleration = (u - in_motion%predictor)/(inertia%beta*inertia%dt**2)
      where (.not. has_inertia) new%acceleration = 0.0_wp
      call follow_masters(solver%body%constraints, new%acceleration)
      new%velocity = old%velocity + inertia%dt*((1.0_wp - inertia%gamma)*old%acceleration + &
        inertia%gamma*new%acceleration)
      where (.not. has_inertia) new%velocity = (u - old%displacement)/inertia%dt
      where (solver%body%prescribed) new%velocity = in_motion%speed
      call follow_masters(solver%body%constraints, new%velocity)
      new%mean_velocity = (u - old%displacement)/inertia%dt
      new%damping_force = damping_by(scene, solver, inertia%slope*u - in_motion%earlier)
      new%unopposed = internal - in_motion%force + new%damping_force - external - pressed
      call give_to_masters(solver%body%constraints, new%unopposed)
      call clear_dependent(solver, new%unopposed)
      momentum_rate = accelerating(solver, in_motion, new)
      call give_to_masters(solver%body%constraints, momentum_rate)
      where (solver%body%prescribed) new%unopposed = (inertia%alpha*old%unopposed - &
        momentum_rate)/(1.0_wp + inertia%alpha)
    end associate
  end subroutine end_inertia

  !> Of what force_of_inertia says the mass times the accelerations at the end of the increment.
  pure function accelerating(solver, in_motion, new) result(f)
    type(step_solver_t), intent(in) :: solver
    type(in_motion_t), intent(in) :: in_motion
    type(state_t), intent(in) :: new          !! its damping force
    real(wp) :: f(3, size(in_motion%force, 2)) !! [force]

    f = (1.0_wp + solver%body%inertia%alpha)*(in_motion%force + in_motion%left_over - &
      new%damping_force)
  end function accelerating

  !> How far an increment is from the motion between its ends, beside the energy of the bodies: with
  !> the third derivative of places, (beta - 1/6) dt^2 (a_1 - a_0); where contact begins or ends
  !> within it the work of normal forces; and what energy comes from nowhere. docs/theory.md,
  !> section 13.
  pure real(wp) function error_in_time(solver, old, new) result(error)
    type(step_solver_t), intent(in) :: solver
    type(state_t), intent(in) :: old, new !! before and after it; of these the largest energy
    real(wp) :: e(3, size(new%displacement, 2))

    error = 0.0_wp
    if (.not. new%largest_energy > 0.0_wp) return
    associate (inertia => solver%body%inertia)
      e = merge(0.0_wp, new%acceleration - old%acceleration, solver%body%prescribed)
      call follow_masters(solver%body%constraints, e)
      error = (inertia%beta - 1.0_wp/6.0_wp)*inertia%dt*sqrt(max(0.0_wp, sum(e*times_mass( &
        inertia%mass, e)))/(2.0_wp*new%largest_energy))
    end associate
    error = max(error, max(abs(new%contact_work - old%contact_work), given(new) - given(old))/ &
      new%largest_energy)
  end function error_in_time

  !> The energy that contact and the scheme have given.
  pure real(wp) function given(state)
    type(state_t), intent(in) :: state

    given = state%kinetic_energy + state%strain_energy + state%dissipation + state%damped - &
      state%external_work - state%begun_energy
  end function given

  !> Keep how large the forces of inertia get in a *STEP, beside the others.
  pure subroutine watch_inertia(solver, in_motion, internal, new)
    type(step_solver_t), intent(in) :: solver
    type(in_motion_t), intent(in) :: in_motion
    real(wp), intent(in) :: internal(:, :)   !! (3,n_nodes) with those of inertia [force]
    type(state_t), intent(inout) :: new

    if (new%increment == 1) then
      new%most_inertia = 0.0_wp
      new%most_force = 0.0_wp
    end if
    new%most_inertia = max(new%most_inertia, maxval(abs(accelerating(solver, in_motion, &
      new))))
    new%most_force = max(new%most_force, maxval(abs(internal - in_motion%force)), &
      maxval(abs(new%external_force)), &
      maxval(abs(new%support_force)))
  end subroutine watch_inertia

  !> In a static *STEP bodies are at rest, and what they had of kinetic energy is lost.
  pure subroutine come_to_rest(state)
    type(state_t), intent(inout) :: state

    if (allocated(state%velocity)) deallocate (state%velocity)
    if (allocated(state%momentum)) deallocate (state%momentum)
    if (allocated(state%acceleration)) deallocate (state%acceleration, state%unopposed, &
      state%mean_velocity, state%damping_force)
    state%begun_energy = state%begun_energy - state%kinetic_energy
    state%kinetic_energy = 0.0_wp
  end subroutine come_to_rest

end module newmark_mod
