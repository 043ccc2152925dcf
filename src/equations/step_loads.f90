!> What a *STEP prescribes, as a few fixed patterns whose factors change with time.
!>
!> At a fraction s of the step the prescribed displacements and the loads are the sum over g of
!> factor_g(s) pattern_g: what holds still (factor 1), what ramps (factor s), and one pattern an
!> amplitude. The responses to the patterns are solved for once a step, so that an increment needs
!> no solution for x_free.
module step_loads_mod
  use kinds_mod, only: wp, i8
  use loads_mod, only: following_t, amplitude_value, amplitude_rate, start_of_step
  use kinks_mod, only: find_kinks, find_jumps, followed_amplitudes
  use grips_mod, only: gripped_nodes
  use turns_mod, only: turns_t, turns_of_step
  use turning_couplings_mod, only: turned_constraints
  use constraints_mod, only: constraints_t, active_constraints, follow_masters
  use mesh_mod, only: axisymmetric, joined_nodes
  use spring_elements_mod, only: spring_direction, spring_ends
  use scene_mod, only: scene_t
  use warming_mod, only: warming_t, warms, warming_of_step
  use mesh_forces_mod, only: pressure_force, gravity_force
  use mass_matrix_mod, only: mass_t, times_mass
  use bodies_mod, only: is_linear
  use expansion_mod, only: free_strain, thermal_force
  implicit none
  private

  public :: step_loads_t, resolve_loads, prescribed_dofs, pattern_factors, pattern_rates, &
    following_at, any_follows, ramps

  integer, parameter :: pattern_hold = -1, pattern_ramp = 0 !! > 0: index of an amplitude

  !> The patterns of one *STEP; those that are zero throughout are left out.
  type :: step_loads_t
    integer :: n_patterns = 0
    real(wp) :: start = 0.0_wp       !! of the step, in the time of the run
    integer,  allocatable :: kind(:) !! (n_patterns) pattern_hold, pattern_ramp or an amplitude
    real(wp), allocatable :: displacement(:, :, :)
    !! (3,n_nodes,n_patterns) prescribed, and of what depends on such alone or among others [length]
    real(wp), allocatable :: force(:, :, :)        !! (3,n_nodes,n_patterns) [force]
    real(wp), allocatable :: dead_force(:, :, :)
    !! (3,n_nodes,n_patterns) those that do not follow bodies; not allocated: none does [force]
    real(wp), allocatable :: pressure(:, :)
    !! (n_surfaces,n_patterns) the others: on surfaces, which they follow [force/length^2]
    real(wp), allocatable :: gradient(:, :, :, :)
    !! (3,3,n_regions,n_patterns) and what accelerations grow by with displacements [1/time^2]
    type(turns_t) :: turns                         !! rotations of obstacles
    integer(i8), allocatable :: kinks(:)           !! of its amplitudes, as of find_kinks
    integer(i8), allocatable :: jumps(:)           !! of a dynamic step, as of find_jumps
    real(wp), allocatable :: over(:)               !! likewise [time]
  end type step_loads_t

contains

  !> The degrees of freedom that supports hold during a step, and those of nodes without elements
  !> that no equation names: nothing moves these.
  pure function prescribed_dofs(scene, step) result(prescribed)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    logical :: prescribed(3, scene%mesh%n_nodes)
    integer :: k, i

    prescribed = .false.
    do k = 1, step
      if (scene%steps(k)%replace_boundary) prescribed = .false.
      do i = 1, size(scene%steps(k)%boundary)
        associate (b => scene%steps(k)%boundary(i))
          prescribed(b%dof, b%node) = .true.
        end associate
      end do
    end do
    if (scene%constraints%n_equations > 0 .or. scene%mesh%springs%n > 0) call hold_idle(scene, &
      prescribed)
    prescribed = prescribed .or. spread(gripped_nodes(scene), 1, 3)
  end function prescribed_dofs

  !> Hold what no equation names, and no spring sees, of nodes that these alone join to a body.
  pure subroutine hold_idle(scene, prescribed)
    type(scene_t), intent(in) :: scene
    logical, intent(inout) :: prescribed(:, :) !! (3,n_nodes)
    logical :: is_idle(3, scene%mesh%n_nodes)
    integer :: c, k, s

    is_idle = spread(joined_nodes(scene%mesh), 1, 3)
    associate (all => scene%constraints)
      do c = 1, all%n
        is_idle(all%dof(c), all%node(c)) = .false.
        do k = all%first(c), all%first(c + 1) - 1
          is_idle(all%master_dof(k), all%master(k)) = .false.
        end do
      end do
    end associate
    associate (springs => scene%mesh%springs)
      do s = 1, springs%n
        associate (ends => spring_ends(springs, s))
          if (springs%is_axial(s) .and. scene%finite_strain) then
            is_idle(:, ends) = .false.
          else
            is_idle(:, ends) = is_idle(:, ends) .and. .not. abs(spring_direction(springs, s, &
              scene%mesh%coordinates)) > 0.0_wp
          end if
        end associate
      end do
    end associate
    prescribed = prescribed .or. is_idle
  end subroutine hold_idle

  !> The patterns of a step that starts from displacement `u`.
  pure subroutine resolve_loads(scene, step, u, loads, mass)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    real(wp), intent(in) :: u(:, :)          !! (3,n_nodes) at the start of the step [length]
    type(step_loads_t), intent(out) :: loads
    type(mass_t), intent(in), optional :: mass !! of the bodies, if any step is dynamic
    real(wp), allocatable :: displacement(:, :, :), force(:, :, :)
    real(wp), allocatable :: pressure(:, :), gradient(:, :, :, :)
    logical, allocatable :: used(:), followed(:)
    integer :: g, n

    n = size(scene%amplitudes)
    allocate (displacement(3, scene%mesh%n_nodes, pattern_hold:n), source=0.0_wp)
    allocate (force(3, scene%mesh%n_nodes, pattern_hold:n), source=0.0_wp)
    call resolve_boundary(scene, step, u, displacement)
    allocate (pressure(size(scene%surfaces), pattern_hold:n), source=0.0_wp)
    call resolve_forces(scene, step, force, pressure, gradient, mass)
    if (scene%steps(step)%is_dynamic) then
      ! At once.
      force(:, :, pattern_hold) = force(:, :, pattern_hold) + force(:, :, pattern_ramp)
      force(:, :, pattern_ramp) = 0.0_wp
      pressure(:, pattern_hold) = pressure(:, pattern_hold) + pressure(:, pattern_ramp)
      pressure(:, pattern_ramp) = 0.0_wp
    end if
    call turn_local_forces(scene, force)
    if (.not. is_linear(scene)) then
      allocate (loads%dead_force(3, scene%mesh%n_nodes, size(force, 3)))
      loads%dead_force = force
    end if
    call press_surfaces(scene, pressure, force)
    if (warms(scene)) call resolve_warming(scene, step, force)
    loads%turns = turns_of_step(scene, step)
    loads%start = start_of_step(scene%steps, step)
    allocate (used(pattern_hold:n))
    do g = pattern_hold, n
      used(g) = any(abs(displacement(:, :, g)) > 0.0_wp) .or. any(abs(force(:, :, g)) > 0.0_wp)
    end do
    loads%kind = pack([(g, g=pattern_hold, n)], used)
    loads%n_patterns = size(loads%kind)
    followed = followed_amplitudes(scene%amplitudes, scene%steps, step)
    do g = 1, n
      if (.not. scene%amplitudes(g)%total .or. .not. followed(g)) cycle
      ! Unless all that an earlier step named is named again.
      followed(g) = used(g)
      if (allocated(loads%turns%by_amplitude)) followed(g) = followed(g) .or. &
        any(abs(loads%turns%by_amplitude(:, :, g)) > 0.0_wp)
    end do
    call find_kinks(pack(scene%amplitudes, followed), scene%steps(step), loads%kinks, loads%start)
    if (scene%steps(step)%is_dynamic) call find_jumps(pack(scene%amplitudes, followed), &
      scene%steps(step), loads%start, loads%jumps, loads%over)
    loads%displacement = displacement(:, :, loads%kind)
    loads%force = force(:, :, loads%kind)
    if (.not. allocated(loads%dead_force)) return
    loads%dead_force = loads%dead_force(:, :, loads%kind - pattern_hold + 1)
    loads%pressure = pressure(:, loads%kind)
    loads%gradient = gradient(:, :, :, loads%kind - pattern_hold + 1)
  end subroutine resolve_loads

  !> What follows bodies at a fraction of the *STEP: at small strain nothing does.
  pure type(following_t) function following_at(scene, loads, fraction, step_time) result(following)
    type(scene_t), intent(in) :: scene
    type(step_loads_t), intent(in) :: loads
    real(wp), intent(in) :: fraction, step_time  !! as of increment_t [-], [time]
    real(wp) :: factor(loads%n_patterns)
    integer :: g

    allocate (following%pressure(size(scene%surfaces)), source=0.0_wp)
    allocate (following%gradient(3, 3, size(scene%regions)), source=0.0_wp)
    if (.not. allocated(loads%dead_force)) return
    factor = pattern_factors(scene, loads, fraction, step_time)
    do g = 1, loads%n_patterns
      following%pressure = following%pressure + factor(g)*loads%pressure(:, g)
      following%gradient = following%gradient + factor(g)*loads%gradient(:, :, :, g)
    end do
  end function following_at

  !> Whether anything follows bodies in the step.
  pure logical function any_follows(loads)
    type(step_loads_t), intent(in) :: loads

    any_follows = allocated(loads%dead_force)
    if (any_follows) any_follows = any(abs(loads%pressure) > 0.0_wp) .or. any(abs(loads%gradient) &
      > 0.0_wp)
  end function any_follows

  !> The factor of every pattern at fraction `s` of the step.
  pure function pattern_factors(scene, loads, fraction, step_time) result(factor)
    type(scene_t), intent(in) :: scene
    type(step_loads_t), intent(in) :: loads
    real(wp), intent(in) :: fraction      !! of the step's period, 0 to 1 [-]
    real(wp), intent(in) :: step_time  !! from the start of the step
    real(wp) :: factor(loads%n_patterns)
    integer :: g

    do g = 1, loads%n_patterns
      select case (loads%kind(g))
      case (pattern_hold)
        factor(g) = 1.0_wp
      case (pattern_ramp)
        factor(g) = fraction
      case default
        factor(g) = amplitude_value(scene%amplitudes(loads%kind(g)), step_time, loads%start)
      end select
    end do
  end function pattern_factors

  !> A derivative of these factors over time, of the piece of an amplitude that another time is in.
  pure function pattern_rates(scene, loads, order, period, step_time, inside) result(rate)
    type(scene_t), intent(in) :: scene
    type(step_loads_t), intent(in) :: loads
    integer, intent(in) :: order              !! 1 or 2
    real(wp), intent(in) :: period            !! of the step [time]
    real(wp), intent(in) :: step_time, inside !! from the start of the step; the other time
    real(wp) :: rate(loads%n_patterns)
    integer :: g

    rate = 0.0_wp
    do g = 1, loads%n_patterns
      if (loads%kind(g) > 0) then
        rate(g) = amplitude_rate(scene%amplitudes(loads%kind(g)), order, step_time, inside, &
          loads%start)
      else if (loads%kind(g) == pattern_ramp .and. order == 1) then
        rate(g) = 1.0_wp/period
      end if
    end do
  end function pattern_rates

  !> Whether something grows with the time of the step, by more than rounding.
  pure logical function ramps(loads)
    type(step_loads_t), intent(in) :: loads
    real(wp), parameter :: rounded = 64.0_wp*epsilon(1.0_wp)
    integer :: g

    ramps = .false.
    if (allocated(loads%turns%ramp)) ramps = any(abs(loads%turns%ramp) > 0.0_wp)
    g = findloc(loads%kind, pattern_ramp, dim=1)
    if (g == 0) return
    ramps = ramps .or. maxval(abs(loads%displacement(:, :, g))) > &
      rounded*maxval(abs(loads%displacement)) .or. maxval(abs(loads%force(:, :, g))) > &
      rounded*maxval(abs(loads%force))
  end function ramps

  !> Prescribed displacements: held where they are, unless this step names them, or an earlier one
  !> has named them with an amplitude over the time of the run.
  pure subroutine resolve_boundary(scene, step, u, displacement)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    real(wp), intent(in) :: u(:, :)
    real(wp), intent(inout) :: displacement(:, :, pattern_hold:)
    logical, dimension(3, scene%mesh%n_nodes) :: prescribed, gripped
    real(wp) :: by_small_turns(3, scene%mesh%n_nodes) !! [length]
    type(constraints_t) :: active
    integer :: g, i, k, first

    prescribed = prescribed_dofs(scene, step)
    displacement(:, :, pattern_hold) = merge(u, 0.0_wp, prescribed)
    first = step
    if (any(scene%amplitudes%total)) first = 1
    do k = first, step
      if (k > 1 .and. scene%steps(k)%replace_boundary) then
        displacement = 0.0_wp
        displacement(:, :, pattern_hold) = merge(u, 0.0_wp, prescribed)
      end if
      do i = 1, size(scene%steps(k)%boundary)
        associate (b => scene%steps(k)%boundary(i))
          displacement(b%dof, b%node, :) = 0.0_wp ! of several values the last counts
          if (b%amplitude > 0 .and. (k == step .or. follows_on(scene, b%amplitude))) then
            displacement(b%dof, b%node, b%amplitude) = b%value
            displacement(b%dof, b%node, pattern_hold) = b%from
          else
            displacement(b%dof, b%node, pattern_hold) = u(b%dof, b%node)
            if (k /= step .or. b%fixed) cycle
            if (scene%steps(step)%is_dynamic .and. .not. b%is_way) then
              displacement(b%dof, b%node, pattern_hold) = b%value
            else
              displacement(b%dof, b%node, pattern_ramp) = b%value - u(b%dof, b%node)
            end if
          end if
        end associate
      end do
    end do
    ! Nodes in grips go on from where they are as turns that are small would take them.
    gripped = spread(gripped_nodes(scene), 1, 3)
    active = active_constraints(turned_constraints(scene, prescribed, u), prescribed .and. .not. &
      gripped)
    do g = pattern_hold, ubound(displacement, 3)
      call follow_masters(active, displacement(:, :, g))
    end do
    by_small_turns = u
    call follow_masters(active, by_small_turns)
    where (gripped) displacement(:, :, pattern_hold) = displacement(:, :, pattern_hold) + &
      (u - by_small_turns)
  end subroutine resolve_boundary

  !> Forces along local directions, from the nodes that stand in for these.
  pure subroutine turn_local_forces(scene, force)
    type(scene_t), intent(in) :: scene
    real(wp), intent(inout) :: force(:, :, pattern_hold:) !! (3,n_nodes,patterns) [force]
    integer :: k, g

    if (.not. allocated(scene%local_axes)) return
    do k = 1, size(scene%local_axes)
      associate (of => scene%local_axes(k))
        if (of%stand_in == of%node) cycle
        do g = pattern_hold, ubound(force, 3)
          force(:, of%node, g) = force(:, of%node, g) + matmul(force(:, of%stand_in, g), &
            of%direction)
          force(:, of%stand_in, g) = 0.0_wp
        end do
      end associate
    end do
  end subroutine turn_local_forces

  !> Whether what follows an amplitude goes on doing so in later steps.
  pure logical function follows_on(scene, amplitude)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: amplitude !! 0: none

    follows_on = .false.
    if (amplitude > 0) follows_on = scene%amplitudes(amplitude)%total
  end function follows_on

  !> The nodal forces of the step, concentrated ones and weights, and the pressures on surfaces.
  pure subroutine resolve_forces(scene, step, force, pressure, gradient, mass)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    real(wp), intent(inout) :: force(:, :, pattern_hold:) !! (3,n_nodes,patterns) [force]
    real(wp), intent(inout) :: pressure(:, pattern_hold:)
    !! (n_surfaces,patterns) 0 on entry [force/length^2]
    real(wp), allocatable, intent(out) :: gradient(:, :, :, :)
    !! (3,3,n_regions,patterns) of the weights [1/time^2]
    type(mass_t), intent(in), optional :: mass !! as of resolve_loads
    real(wp), allocatable, dimension(:, :) :: concentrated, face_pressure, gravity
    real(wp) :: now(size(scene%amplitudes)) !! values as step k begins, of those that follow on
    real(wp) :: density(size(scene%materials))
    integer :: k, g, i, j, n

    ! Level by level from the first step: what a step starts from is what the one before it ended
    ! with.
    n = size(scene%amplitudes)
    allocate (concentrated(3*scene%mesh%n_nodes, pattern_hold:n), source=0.0_wp)
    allocate (face_pressure(size(scene%surfaces), pattern_hold:n), source=0.0_wp)
    allocate (gravity(12*size(scene%regions), pattern_hold:n), source=0.0_wp)
    do k = 1, step
      associate (s => scene%steps(k))
        if (k > 1) then
          call settle(scene, k - 1, concentrated)
          call settle(scene, k - 1, pressure)
          call settle(scene, k - 1, face_pressure)
          call settle(scene, k - 1, gravity)
        end if
        do g = 1, n
          now(g) = amplitude_value(scene%amplitudes(g), 0.0_wp, start_of_step(scene%steps, k))
        end do
        call change_levels([(3*s%forces(i)%node - 3 + s%forces(i)%dof, i=1, size(s%forces))], &
                           s%forces%value, s%forces%amplitude, s%replace_forces, now, concentrated)
        call change_levels(s%pressures%surface, s%pressures%value, s%pressures%amplitude, &
          s%replace_pressures, now, pressure)
        call change_levels(s%face_pressures%surface, s%face_pressures%value, &
          s%face_pressures%amplitude, s%replace_element_loads, now, face_pressure)
        call change_levels([((12*s%gravity(j)%region - 12 + i, i=1, 12), j=1, size(s%gravity))], &
          [(s%gravity(j)%acceleration, s%gravity(j)%gradient, j=1, size(s%gravity))], &
          [((s%gravity(j)%amplitude, i=1, 12), j=1, size(s%gravity))], s%replace_element_loads, &
          now, gravity)
      end associate
    end do
    pressure = pressure + face_pressure
    do g = pattern_hold, n
      force(:, :, g) = reshape(concentrated(:, g), [3, scene%mesh%n_nodes])
      do i = 1, size(scene%regions)
        associate (of_region => gravity(12*i - 11:12*i, g))
          density = scene%materials%density
          if (scene%regions(i)%by_volume) density = 1.0_wp
          if (any(abs(of_region) > 0.0_wp)) call gravity_force(scene%mesh, density, &
            scene%regions(i)%elements, of_region(:3), reshape(of_region(4:), [3, 3]), &
            scene%mesh%coordinates, force(:, :, g), scene%regions(i)%by_volume .and. &
            scene%mesh%plane == axisymmetric)
        end associate
      end do
      if (present(mass)) call weigh_where_mass_is(scene, mass, gravity(:, g), force(:, :, g))
    end do
    gravity = reshape(gravity, [12, size(scene%regions)*(n - pattern_hold + 1)])
    gradient = reshape(gravity(4:, :), [3, 3, size(scene%regions), n - pattern_hold + 1])
  end subroutine resolve_forces

  !> Have pieces whose elements all weigh alike weigh where their mass is: in free fall nothing
  !> strains them.
  pure subroutine weigh_where_mass_is(scene, mass, gravity, force)
    type(scene_t), intent(in) :: scene
    type(mass_t), intent(in) :: mass
    real(wp), intent(in) :: gravity(:)       !! (12*n_regions) as of load_step_t
    real(wp), intent(inout) :: force(:, :)   !! (3,n_nodes) with their weight [force]
    real(wp) :: of_element(3, scene%mesh%n_elements), of_piece(3, scene%mesh%n_pieces)
    real(wp) :: at_node(3, scene%mesh%n_nodes), consistent(3, scene%mesh%n_nodes)
    logical :: is_alike(0:scene%mesh%n_pieces), is_first(scene%mesh%n_pieces)
    integer :: piece_of(scene%mesh%n_elements), i, e

    piece_of = scene%mesh%piece(scene%mesh%connectivity%node(scene%mesh%connectivity%first( &
      :scene%mesh%n_elements)))
    of_element = 0.0_wp
    is_alike = .true.
    is_alike(0) = .false.
    do i = 1, size(scene%regions)
      associate (elements => scene%regions(i)%elements, g => gravity(12*i - 11:12*i))
        ! Forces per volume are no weight.
        if (scene%regions(i)%by_volume) cycle
        of_element(:, elements) = of_element(:, elements) + spread(g(:3), 2, size(elements))
        if (any(abs(g(4:)) > 0.0_wp)) is_alike(piece_of(elements)) = .false.
      end associate
    end do
    is_first = .true.
    do e = 1, scene%mesh%n_elements
      associate (p => piece_of(e))
        if (is_first(p)) of_piece(:, p) = of_element(:, e)
        is_first(p) = .false.
        is_alike(p) = is_alike(p) .and. .not. any(abs(of_element(:, e) - of_piece(:, p)) > 0.0_wp)
      end associate
    end do
    do e = 1, scene%mesh%n_elements
      if (.not. is_alike(piece_of(e))) of_element(:, e) = 0.0_wp
    end do
    at_node = 0.0_wp
    consistent = 0.0_wp
    do i = 1, scene%mesh%n_nodes
      associate (p => scene%mesh%piece(i))
        if (is_alike(p)) at_node(:, i) = of_piece(:, max(1, p))
      end associate
    end do
    do i = 1, size(scene%regions)
      associate (elements => scene%regions(i)%elements, g => gravity(12*i - 11:12*i))
        if (scene%regions(i)%by_volume) cycle
        if (any(abs(g(:3)) > 0.0_wp)) call gravity_force(scene%mesh, scene%materials%density, &
          pack(elements, is_alike(piece_of(elements))), g(:3), spread(spread(0.0_wp, 1, 3), 2, 3), &
          scene%mesh%coordinates, consistent)
      end associate
    end do
    force = force - consistent + times_mass(mass, at_node)
  end subroutine weigh_where_mass_is

  !> Add the nodal forces of pressures on the undeformed surfaces.
  pure subroutine press_surfaces(scene, pressure, force)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: pressure(:, pattern_hold:)    !! (n_surfaces,patterns)
    real(wp), intent(inout) :: force(:, :, pattern_hold:) !! (3,n_nodes,patterns) [force]
    integer :: i, g

    do g = pattern_hold, ubound(force, 3)
      do i = 1, size(scene%surfaces)
        if (abs(pressure(i, g)) > 0.0_wp) call pressure_force(scene%mesh, scene%surfaces(i), &
          pressure(i, g), force(:, :, g))
      end do
    end do
  end subroutine press_surfaces

  !> Add the forces by which warmer bodies expand.
  pure subroutine resolve_warming(scene, step, force)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    real(wp), intent(inout) :: force(:, :, pattern_hold:) !! (3,n_nodes,patterns) [force]
    type(warming_t) :: warming
    integer :: g

    warming = warming_of_step(scene, step)
    call add(warming%held, force(:, :, pattern_hold))
    call add(warming%ramp, force(:, :, pattern_ramp))
    do g = 1, ubound(force, 3)
      call add(warming%by_amplitude(:, g), force(:, :, g))
    end do

  contains

    pure subroutine add(rise, f)
      real(wp), intent(in) :: rise(:)
      real(wp), intent(inout) :: f(:, :)

      if (any(abs(rise) > 0.0_wp)) call thermal_force(scene%mesh, scene%materials, &
        free_strain(scene%mesh, scene%materials, rise), f)
    end subroutine add

  end subroutine resolve_warming

  !> Bring the levels of a step to its end and hold them there, but for those that follow on.
  pure subroutine settle(scene, step, level)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    real(wp), intent(inout) :: level(:, pattern_hold:) !! (loads,patterns)
    integer :: g

    level(:, pattern_hold) = level(:, pattern_hold) + level(:, pattern_ramp)
    level(:, pattern_ramp) = 0.0_wp
    do g = 1, ubound(level, 2)
      if (follows_on(scene, g)) cycle
      level(:, pattern_hold) = level(:, pattern_hold) &
        + amplitude_value(scene%amplitudes(g), scene%steps(step)%period)*level(:, g)
      level(:, g) = 0.0_wp
    end do
  end subroutine settle

  !> What a step's cards change: loads they name go to their new value, several of one load adding
  !> up.
  !>
  !> With `replace` (OP=NEW) the loads that are not named ramp to 0.
  pure subroutine change_levels(load, value, amplitude, replace, now, level)
    integer,  intent(in) :: load(:)      !! which load each card names
    real(wp), intent(in) :: value(:)
    integer,  intent(in) :: amplitude(:)  !! 0: ramp
    logical,  intent(in) :: replace
    real(wp), intent(in) :: now(:)       !! value of each amplitude as the step begins [-]
    real(wp), intent(inout) :: level(:, pattern_hold:)
    !! (loads,patterns), on entry held, or following on
    logical :: named(size(level, 1)), ramped(size(level, 1))
    integer :: i, g

    named = .false.
    ramped = .false.
    do i = 1, size(load)
      named(load(i)) = .true.
      ramped(load(i)) = ramped(load(i)) .or. amplitude(i) == 0
    end do
    if (replace) ramped = ramped .or. .not. named
    named = named .or. replace
    ! What followed an amplitude so far begins where that is.
    do g = 1, size(now)
      where (named)
        level(:, pattern_hold) = level(:, pattern_hold) + now(g)*level(:, g)
        level(:, g) = 0.0_wp
      end where
    end do
    where (named .and. ramped) level(:, pattern_ramp) = -level(:, pattern_hold)
    ! amplitudes alone are followed at once
    where (named .and. .not. ramped) level(:, pattern_hold) = 0.0_wp
    do i = 1, size(load)
      level(load(i), amplitude(i)) = level(load(i), amplitude(i)) + value(i)
    end do
  end subroutine change_levels

end module step_loads_mod
