!> The forces of inertia of the certificate, and the energies of a dynamic *STEP.
!>
!> Accelerations come from the displacements of the increment and the velocities and accelerations
!> that it began with, which were judged with the increment before. docs/theory.md, section 13.
module own_inertia_mod
  use kinds_mod, only: wp
  use scene_mod, only: scene_t, material_t
  use stress_forces_mod, only: find_stress_forces
  use contact_points_mod, only: contact_points_t
  use loads_mod, only: load_step_t
  use increments_mod, only: whole_increment
  use state_mod, only: state_t
  use increment_report_mod, only: contact_fields_t, energy_t
  use increment_forces_mod, only: increment_forces_t
  use edge_middles_mod, only: edge_middles_t, find_edge_middles
  use constrained_forces_mod, only: hand_over, hand_down, mark_masters
  use error_measures_mod, only: ratio, rounded
  use support_speeds_mod, only: speeds_of_supports
  use turned_slips_mod, only: ways_of_turns
  use own_mass_mod, only: own_mass_t, nodal_masses, weigh, momentum_about_centres
  implicit none
  private

  public :: expect_energies, add_inertia, balance_in_time, balance_bodies, keep_strains

  !> Rows of the energies of a body: of its strains; what contact and scheme have given it, and the
  !> least of that; work of loads, supports and damping; work of contact; the largest that was there
  !> or was turned over.
  integer, parameter :: of_strain = 1, of_gifts = 2, least_gift = 3, of_loads = 4, of_contact = 5, &
    largest_of_body = 6

contains

  !> Add the forces of inertia to the loads; and how far the velocities and accelerations of the
  !> state are from those of its displacements, and what it says that inertia answers from that.
  !>
  !> Where they leave nothing of the loads but rounding a body falls freely: nothing acts on it.
  pure subroutine add_inertia(scene, own, old, new, forces, wrong)
    type(scene_t), intent(in) :: scene
    type(own_mass_t), intent(in) :: own
    type(state_t), intent(in) :: old, new             !! before and after the increment
    type(increment_forces_t), intent(inout) :: forces !! internal ones are known
    real(wp), intent(out) :: wrong                    !! [-]
    real(wp), dimension(3, scene%mesh%n_nodes) :: a, v, f, handed, damping, u, speed
    real(wp), dimension(scene%mesh%n_nodes) :: mass, rounding, none
    real(wp) :: alpha, beta, gamma, dt, scale(0:scene%mesh%n_bodies), of_places
    real(wp) :: added_up
    logical :: has_mass(3, scene%mesh%n_nodes), is_rounding(0:scene%mesh%n_bodies)
    real(wp) :: of_mass
    integer :: node

    u = new%displacement - old%displacement
    associate (step => scene%steps(own%step))
      dt = time_between(step, old, new)
      alpha = step%alpha
      beta = (1.0_wp - alpha)*(1.0_wp - alpha)/4.0_wp
      gamma = (1.0_wp - 2.0_wp*alpha)/2.0_wp
      mass = nodal_masses(scene%mesh, own)
      has_mass = spread(mass > 0.0_wp, 1, 3)
      call mark_masters(forces%constraints, forces%prescribed, has_mass)
      speed = speeds_of_supports(scene, dt, old, new)
      where (forces%prescribed)
        v = speed
        a = (v - old%velocity)/dt
      else where (has_mass)
        a = ((u/dt - old%velocity)/dt - (0.5_wp - beta)*old%acceleration)/beta
        v = old%velocity + dt*(1.0_wp - gamma)*old%acceleration + dt*gamma*a
      else where
        v = u/dt
        a = 0.0_wp
      end where
      where (.not. has_mass) a = 0.0_wp
      call hand_down(forces%constraints, forces%prescribed, a)
      call hand_down(forces%constraints, forces%prescribed, v)
    end associate
    f = (weigh(scene%mesh, own, a) - alpha*old%unopposed)/(1.0_wp + alpha)
    call find_damping(scene, own, old, u, dt, damping, rounding)
    wrong = max(ratio(maxval(abs(new%damping_force - damping)), maxval(abs(damping)) + &
      maxval(abs(forces%internal))), ratio(maxval(abs(new%mean_velocity - u/dt)), &
      maxval(abs(u/dt)) + 8.0_wp*epsilon(1.0_wp)*maxval(abs(new%displacement))/dt))
    forces%rounding = forces%rounding + rounding
    of_places = 8.0_wp*epsilon(1.0_wp)*maxval(abs(new%displacement))/(beta*dt*dt)
    rounding = mass*of_places/(1.0_wp + alpha)
    ! Velocities are sums, of as many increments as there were.
    added_up = sqrt(real(max(1, new%increments_done), wp))
    ! Two ways to weigh a body agree no better than sums of so many elements.
    of_mass = rounded + 4.0_wp*epsilon(1.0_wp)*scene%mesh%n_elements
    scale = 0.0_wp
    is_rounding = .true.
    do node = 1, scene%mesh%n_nodes
      associate (body => scene%mesh%body(node))
        scale(body) = max(scale(body), norm2(f(:, node)), norm2(forces%internal(:, node)), &
          norm2(forces%external(:, node)))
      end associate
    end do
    do node = 1, scene%mesh%n_nodes
      associate (body => scene%mesh%body(node))
        is_rounding(body) = is_rounding(body) .and. norm2(forces%external(:, node) - damping(:, &
          node) - f(:, node)) <= added_up*rounding(node) + forces%rounding(node) + &
          of_mass*scale(body)
      end associate
    end do
    handed = f
    none = rounding
    call hand_over(forces%constraints, forces%prescribed, handed, none)
    handed = handed + new%unopposed
    wrong = max(wrong, ratio(max(0.0_wp, maxval(abs(new%acceleration - a)) - of_places), &
      maxval(abs(a))), ratio(max(0.0_wp, maxval(abs(new%velocity - v)) - of_places*dt), &
      maxval(abs(v))))
    do node = 1, scene%mesh%n_nodes
      associate (body => scene%mesh%body(node))
        wrong = max(wrong, ratio(max(0.0_wp, norm2(handed(:, node)) - rounding(node) - &
          forces%rounding(node)), scale(body)))
        if (is_rounding(body)) f(:, node) = forces%external(:, node) - damping(:, node)
      end associate
    end do
    if (.not. allocated(forces%applied)) forces%applied = forces%external
    forces%external = forces%external - f - damping
    where (is_rounding(scene%mesh%body)) rounding = added_up*rounding + of_mass*scale( &
      scene%mesh%body)
    forces%rounding = forces%rounding + rounding
  end subroutine add_inertia

  !> The forces by which materials damp, of the velocities at the end by the last two means.
  pure subroutine find_damping(scene, own, old, u, dt, force, rounding)
    type(scene_t), intent(in) :: scene
    type(own_mass_t), intent(in) :: own
    type(state_t), intent(in) :: old
    real(wp), intent(in) :: u(:, :)        !! (3,n_nodes) of the increment [length]
    real(wp), intent(in) :: dt             !! [time]
    real(wp), intent(out) :: force(:, :)   !! (3,n_nodes) [force]
    real(wp), intent(out) :: rounding(:)   !! (n_nodes) that they carry [force]
    type(material_t) :: softer(size(scene%materials))
    type(increment_forces_t) :: viscous
    real(wp) :: v(3, scene%mesh%n_nodes), least
    real(wp) :: alpha(0:scene%mesh%n_pieces) !! of each piece [1/time]
    integer :: e, m

    force = 0.0_wp
    rounding = 0.0_wp
    v = u/dt + 0.5_wp*(u/dt - old%mean_velocity)
    least = 1.0e-14_wp*maxval(scene%materials%stiffness_damping)
    if (least > 0.0_wp) then
      softer = scene%materials
      do m = 1, size(softer)
        associate (law => softer(m)%law, by => max(least, softer(m)%stiffness_damping))
          law%elastic%shear = by*law%elastic%shear
          law%elastic%lambda = by*law%elastic%lambda
          law%elastic%c = by*law%elastic%c
        end associate
      end do
      call find_stress_forces(scene%mesh, softer, v, old%displacement/dt, viscous)
      force = viscous%internal
      rounding = viscous%rounding
    end if
    if (.not. any(scene%materials%mass_damping > 0.0_wp)) return
    v = weigh(scene%mesh, own, v)
    alpha = 0.0_wp
    associate (mesh => scene%mesh)
      do e = 1, mesh%n_elements
        alpha(mesh%piece(mesh%connectivity%node(mesh%connectivity%first(e)))) = &
          scene%materials(mesh%material(e))%mass_damping
      end do
      force = force + spread(alpha(mesh%piece), 1, 3)*v
    end associate
  end subroutine find_damping

  !> The time from one state to the next, of a *STEP.
  pure real(wp) function time_between(step, old, new) result(dt)
    type(load_step_t), intent(in) :: step
    type(state_t), intent(in) :: old, new

    dt = real(new%position, wp)
    if (new%increment > 1) dt = dt - real(old%position, wp)
    dt = dt/real(whole_increment, wp)*step%period/step%n_increments
  end function time_between

  !> The energies at the end of an increment of a dynamic *STEP: all work by the mean of the forces
  !> of its beginning and its end, kinetic energy by the mass of the certificate.
  !>
  !> Normal forces do no work in nature. What they do here, and what the scheme takes, is the energy
  !> that the bodies have lost or gained, beside the largest that was there or was turned over.
  pure subroutine balance_in_time(scene, points, own, contact, old, new, energy)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(own_mass_t), intent(in) :: own
    type(contact_fields_t), intent(in) :: contact
    type(state_t), intent(in) :: old
    type(state_t), intent(inout) :: new             !! gets its energies
    type(energy_t), intent(inout) :: energy
    !! strain in, and as external work that of others than loads and supports in the increment
    type(edge_middles_t) :: middles
    real(wp), parameter :: nothing = 1.0e-12_wp
    !! of the energy of bodies that went all their way in an increment: rounding of places [-]
    real(wp) :: u(3, scene%mesh%n_nodes), turned(3, points%n), way(3), before(3), gain, rounding
    integer :: i, k

    call find_edge_middles(scene, points, contact%weights, middles)
    turned = ways_of_turns(scene, points, middles, contact%weights, old, new)
    u = new%displacement - old%displacement
    new%external_work = old%external_work + energy%external_work + 0.5_wp*sum(u* &
      (old%external_force + old%support_force + new%external_force + new%support_force))
    new%strain_energy = energy%strain
    new%momentum = weigh(scene%mesh, own, new%velocity)
    new%kinetic_energy = 0.5_wp*sum(new%velocity*new%momentum)
    new%dissipation = old%dissipation
    new%contact_work = old%contact_work
    new%damped = old%damped + 0.5_wp*sum(u*(old%damping_force + new%damping_force))
    do i = 1, points%n
      way = u(:, points%node(i))
      if (middles%is_any) then
        associate (part => middles%a(i))
          if (part > 0.0_wp) way = (way - part*(u(:, middles%nodes(1, i)) + &
            u(:, middles%nodes(2, i))))/(1.0_wp - 2.0_wp*part)
        end associate
      end if
      do k = contact%weights%first(i), contact%weights%first(i + 1) - 1
        way = way - contact%weights%weight(k)*u(:, contact%weights%node(k))
      end do
      way = way - turned(:, i)
      before = matmul(old%reaction(:, i), contact%frame(:, :, i))
      associate (mean => 0.5_wp*(before + contact%reaction(:, i)))
        new%dissipation = new%dissipation - dot_product(mean(2:), contact%slip_increment(:, i))
        new%contact_work = new%contact_work + mean(1)*dot_product(contact%frame(:, 1, i), way)
      end associate
    end do
    if (scene%finite_strain) call follow_turning(scene, own, old, new)
    rounding = nothing*sum(nodal_masses(scene%mesh, own))*(maxval(abs(new%displacement))/ &
      time_between(scene%steps(own%step), old, new))**2
    gain = new%kinetic_energy + energy%strain + new%dissipation + new%damped - &
      new%external_work - new%begun_energy
    new%largest_energy = max(old%largest_energy, new%kinetic_energy + energy%strain, &
      abs(new%dissipation) + abs(new%damped) + abs(new%external_work))
    new%least_gain = min(old%least_gain, gain)
    energy = energy_t(external_work=new%external_work, strain=energy%strain, &
      dissipation=new%dissipation, kinetic=new%kinetic_energy, contact=new%contact_work, &
      damped=new%damped, begun=new%begun_energy, balance=new%contact_work - gain, &
      risen=ratio(gain - new%least_gain, max(new%largest_energy, rounding)), &
      turned=maxval([0.0_wp, (ratio(norm2(new%twist(:, i)), sqrt(2.0_wp*max(new%largest_energy, &
      rounding)*mean_inertia(own, i))), i=1, scene%mesh%n_pieces)]))
  end subroutine balance_in_time

  !> What contact and scheme give each body by itself, beside what it has: the energy of a large one
  !> hides what a small one gets. Of bodies that press on each other the larger counts for both.
  !>
  !> Not where springs join bodies, nor where points act on several nodes of a slave face: energies
  !> of these are not known by body.
  pure subroutine balance_bodies(scene, points, own, contact, strain, old, new, energy)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(own_mass_t), intent(in) :: own
    type(contact_fields_t), intent(in) :: contact
    real(wp), intent(in) :: strain(0:)              !! (0:n_bodies) [energy]
    type(state_t), intent(in) :: old
    type(state_t), intent(inout) :: new             !! gets the energies of its bodies
    type(energy_t), intent(inout) :: energy         !! gets the body that was given most
    real(wp), parameter :: counts = 1.0e-6_wp
    !! of the largest energy of all: what is less does not matter [-]
    real(wp), dimension(0:scene%mesh%n_bodies) :: kinetic, loads, pressed, along_gaps, largest
    real(wp), dimension(3, scene%mesh%n_nodes) :: u, before
    type(edge_middles_t) :: middles
    real(wp) :: force(3), normal
    integer :: i, k, node, b

    call find_edge_middles(scene, points, contact%weights, middles)
    if (scene%mesh%springs%n > 0 .or. middles%is_any) return
    if (allocated(scene%foundations)) return
    u = new%displacement - old%displacement
    before = momentum_of(scene, own, old)
    kinetic = 0.0_wp
    loads = 0.0_wp
    pressed = 0.0_wp
    along_gaps = 0.0_wp
    largest = 0.0_wp
    if (.not. allocated(new%by_body)) allocate (new%by_body(6, scene%mesh%n_bodies), source=0.0_wp)
    associate (body => scene%mesh%body, bodies => new%by_body)
      do node = 1, scene%mesh%n_nodes
        b = body(node)
        associate (has => 0.5_wp*dot_product(new%velocity(:, node), new%momentum(:, &
            node)))
          kinetic(b) = kinetic(b) + has - 0.5_wp*dot_product(old%velocity(:, node), &
            before(:, node))
          largest(b) = largest(b) + has
        end associate
        loads(b) = loads(b) + 0.5_wp*dot_product(u(:, node), old%external_force(:, node) + &
          old%support_force(:, node) + new%external_force(:, node) + new%support_force(:, node) - &
          old%damping_force(:, node) - new%damping_force(:, node))
      end do
      largest = largest + strain
      do i = 1, points%n
        force = 0.5_wp*(old%reaction(:, i) + new%reaction(:, i))
        if (.not. maxval(abs(force)) > 0.0_wp) cycle
        normal = dot_product(force, contact%frame(:, 1, i))
        b = body(points%node(i))
        pressed(b) = pressed(b) + dot_product(force, u(:, points%node(i)))
        along_gaps(b) = along_gaps(b) + normal*dot_product(contact%frame(:, 1, i), &
          u(:, points%node(i)))
        do k = contact%weights%first(i), contact%weights%first(i + 1) - 1
          associate (other => contact%weights%node(k), weight => contact%weights%weight(k))
            pressed(body(other)) = pressed(body(other)) - weight*dot_product(force, u(:, other))
            along_gaps(b) = along_gaps(b) - weight*normal*dot_product(contact%frame(:, 1, i), &
              u(:, other))
            if (body(other) > 0 .and. b > 0) largest([b, body(other)]) = max(largest(b), &
              largest(body(other)), bodies(largest_of_body, b), bodies(largest_of_body, &
              body(other)))
          end associate
        end do
      end do
      do b = 1, scene%mesh%n_bodies
        associate (of => bodies(:, b))
          of(of_gifts) = of(of_gifts) + kinetic(b) + strain(b) - of(of_strain) - loads(b) - &
            pressed(b) + along_gaps(b)
          of(of_strain) = strain(b)
          of(least_gift) = min(of(least_gift), of(of_gifts))
          of(of_loads) = of(of_loads) + loads(b)
          of(of_contact) = of(of_contact) + pressed(b)
          of(largest_of_body) = max(of(largest_of_body), largest(b), abs(of(of_loads)) + &
            abs(of(of_contact)))
          if (.not. of(largest_of_body) > counts*new%largest_energy) cycle
          associate (risen => (of(of_gifts) - of(least_gift))/of(largest_of_body))
            if (risen > energy%risen_of_one) energy%risen_body = b
            energy%risen_of_one = max(energy%risen_of_one, risen)
          end associate
        end associate
      end do
    end associate
  end subroutine balance_bodies

  !> Judge what bodies gain beside energies that they are to have, too.
  pure subroutine expect_energies(energies, state)
    real(wp), intent(in) :: energies(0:)       !! (0:n_bodies) [energy]
    type(state_t), intent(inout) :: state

    if (.not. allocated(state%by_body)) allocate (state%by_body(6, ubound(energies, 1)), &
      source=0.0_wp)
    state%by_body(largest_of_body, :) = max(state%by_body(largest_of_body, :), energies(1:))
  end subroutine expect_energies

  !> The momentum that a state has kept, or that of its velocities.
  pure function momentum_of(scene, own, state) result(momentum)
    type(scene_t), intent(in) :: scene
    type(own_mass_t), intent(in) :: own
    type(state_t), intent(in) :: state
    real(wp) :: momentum(3, scene%mesh%n_nodes) !! [mass length/time]

    if (allocated(state%momentum)) then
      momentum = state%momentum
    else
      momentum = weigh(scene%mesh, own, state%velocity)
    end if
  end function momentum_of

  !> What the strains of bodies have as static increments end.
  pure subroutine keep_strains(strain, state)
    real(wp), intent(in) :: strain(0:)        !! (0:n_bodies) [energy]
    type(state_t), intent(inout) :: state

    if (.not. allocated(state%by_body)) allocate (state%by_body(6, ubound(strain, 1)), &
      source=0.0_wp)
    state%by_body(of_strain, :) = strain(1:)
  end subroutine keep_strains

  !> Add the angular momentum that pieces get in an increment, and no torque explains.
  pure subroutine follow_turning(scene, own, old, new)
    type(scene_t), intent(in) :: scene
    type(own_mass_t), intent(in) :: own
    type(state_t), intent(in) :: old
    type(state_t), intent(inout) :: new
    real(wp), dimension(3, scene%mesh%n_nodes) :: first, last

    associate (mesh => scene%mesh, alpha => scene%steps(own%step)%alpha)
      first = mesh%coordinates + old%displacement
      last = mesh%coordinates + new%displacement
      new%twist = old%twist + momentum_about_centres(mesh, own, last, new%momentum) - &
        momentum_about_centres(mesh, own, first, momentum_of(scene, own, old)) + &
        time_between(scene%steps(own%step), old, new)*((0.5_wp + alpha)*momentum_about_centres( &
        mesh, own, first, old%unopposed) + (0.5_wp - alpha)*momentum_about_centres(mesh, own, &
        last, new%unopposed))
    end associate
  end subroutine follow_turning

  !> The mean of the moments of inertia of a piece.
  pure real(wp) function mean_inertia(own, piece)
    type(own_mass_t), intent(in) :: own
    integer, intent(in) :: piece

    mean_inertia = (own%inertia(4, 4, piece) + own%inertia(5, 5, piece) + own%inertia(6, 6, &
      piece))/3.0_wp*own%reach(piece)**2
  end function mean_inertia

end module own_inertia_mod
