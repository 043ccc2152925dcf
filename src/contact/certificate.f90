!> The certificate: how true an increment is, from its reactions and displacements alone.
!>
!> Nothing here is shared with the solvers: no compliance, no projection, no x_free. docs/theory.md
!> section 6.
module certificate_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: cross
  use constraints_mod, only: constraints_t
  use mesh_mod, only: mesh_t
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t
  use increment_report_mod, only: certificate_t, energy_t, contact_fields_t, worst_entry
  use turned_slips_mod, only: turned_slips_t
  implicit none
  private

  public :: certify, judge_contact, energy_balance, increment_forces_t

  !> Of numbers that are none.
  type(certificate_t), parameter :: nothing_true = certificate_t(huge(1.0_wp), huge(1.0_wp), &
    huge(1.0_wp), huge(1.0_wp), huge(1.0_wp), huge(1.0_wp), .false., huge(1.0_wp), huge(1.0_wp))

  real(wp), parameter :: rounded = 32.0_wp*epsilon(1.0_wp) !! of what is added up: lost in a sum [-]
  real(wp), parameter :: held = 16.0_wp*epsilon(1.0_wp)    !! what is prescribed is kept to this [-]
  real(wp), parameter :: last_bits = 1.0_wp/8.0_wp
  !! of the rounding of forces: what the last bits of displacements are worth [-]
  real(wp), parameter :: excusable = 1.0e-3_wp !! of a force: the most that rounding may excuse [-]
  real(wp), parameter :: let_go = 1.0e-3_wp
  !! of the reactions before an increment: forces at its end are measured by no less [-]
  real(wp), parameter :: nothing = 1.0e-8_wp
  !! of the largest rounding of a force: forces are measured by no less [-]

  !> The forces of an increment, and what its supports ask for; all (3,n_nodes) in x, y, z.
  type :: increment_forces_t
    real(wp), allocatable :: internal(:, :)   !! from the stresses [force]
    real(wp), allocatable :: external(:, :)   !! loads [force]
    logical,  allocatable :: prescribed(:, :) !! degrees of freedom held by supports
    real(wp), allocatable :: displacement(:, :) !! that is prescribed, 0 elsewhere [length]
    type(constraints_t) :: constraints        !! those of the scene, whatever supports hold
    real(wp), allocatable :: rounding(:) !! (n_nodes) that the internal forces carry [force]
    real(wp), allocatable :: stiffness(:) !! (n_nodes) of each node by itself [force/length]
    real(wp) :: rounding_of_gaps = 0.0_wp     !! that the gaps carry [length]
  end type increment_forces_t

  !> What acts on a body along one of its rigid motions, or on an obstacle along one of its
  !> translations.
  type :: along_motion_t
    real(wp) :: total = 0.0_wp      !! of all forces [force]
    real(wp) :: weight = 0.0_wp     !! of their magnitudes along the motion [force]
    real(wp) :: magnitude = 0.0_wp  !! of their magnitudes, wherever they point [force]
    real(wp) :: load = 0.0_wp       !! of the magnitudes of the loads along the motion [force]
    real(wp) :: load_magnitude = 0.0_wp !! and wherever they point [force]
    real(wp) :: rounding = 0.0_wp   !! that support forces carry along the motion [force]
    real(wp) :: arm = 0.0_wp        !! the farthest that a unit of the motion moves a node [-]
  end type along_motion_t

contains

  !> Judge an increment.
  !>
  !> Scales: F the largest nodal force (reactions, supports, loads, internal, a thousandth of the
  !> reactions before the increment), U the largest displacement increment, deformation of a body,
  !> or way that contact forces alone would move their node. 0/0 = 0.
  !>
  !> What depends on others by constraints is in equilibrium where its masters are: the forces on it
  !> act on them. Its supports, if any, come before its constraint.
  pure function certify(mesh, points, contact, old, new, forces, tolerance, turned) &
    result(certificate)
    type(mesh_t), intent(in) :: mesh
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(in) :: contact
    !! frames, weights, local reactions, gaps and slip increments
    type(state_t), intent(in) :: old, new          !! before and after it
    type(increment_forces_t), intent(in) :: forces
    real(wp), intent(in) :: tolerance              !! contact tolerance [-]
    type(turned_slips_t), intent(in), optional :: turned !! take the place of those of `contact`
    type(certificate_t) :: certificate
    real(wp) :: f, u, way, x(3, points%n), reaction(3, points%n), scale(0:mesh%n_bodies)
    real(wp), dimension(3, mesh%n_nodes) :: pressed, pressed_before, residual, support
    real(wp) :: rounding(mesh%n_nodes)
    logical :: is_mesh(mesh%n_nodes), at_rest(0:mesh%n_bodies)
    integer :: i, k

    certificate = nothing_true
    if (.not. (are_finite(new%displacement) .and. are_finite(new%reaction) .and. &
      are_finite(contact%slip_increment) .and. are_finite(forces%internal) .and. &
      are_finite(forces%external))) return
    pressed = 0.0_wp
    pressed_before = 0.0_wp
    do i = 1, points%n
      pressed(:, points%node(i)) = pressed(:, points%node(i)) + new%reaction(:, i)
      pressed_before(:, points%node(i)) = pressed_before(:, points%node(i)) + old%reaction(:, i)
      do k = contact%weights%first(i), contact%weights%first(i + 1) - 1
        associate (node => contact%weights%node(k), weight => contact%weights%weight(k))
          pressed(:, node) = pressed(:, node) - weight*new%reaction(:, i)
          pressed_before(:, node) = pressed_before(:, node) - weight*old%reaction(:, i)
        end associate
      end do
    end do
    residual = forces%internal - forces%external - pressed
    call hand_over(forces, residual, rounding)
    support = merge(residual, 0.0_wp, forces%prescribed)
    residual = residual - support
    ! Of an obstacle's reference node the forces are resultants, not those of a node. Reactions of
    ! several obstacles on one node may be any size and cancel: what counts is their sum.
    is_mesh = mesh%body > 0
    ! What contact lets go of counts, too: the forces that are left are as good as those were large.
    pressed_before = let_go*pressed_before
    f = max(largest(pressed, is_mesh), largest(pressed_before, is_mesh), largest(support, &
      is_mesh), largest(forces%external, is_mesh), largest(forces%internal))
    if (f <= 0.0_wp) f = largest(forces%external)
    u = max(largest(new%displacement - old%displacement), largest_spread(mesh, new%displacement), &
      largest_alone(pressed, forces%stiffness))

    x(1, :) = contact%gap
    x(2:, :) = contact%slip_increment
    if (present(turned)) then
      where (spread(turned%is_turned, 1, 2)) x(2:, :) = turned%slip
    end if
    ! Where nothing moves by more than places are rounded gaps and slips are no better known.
    do i = 1, points%n
      associate (rounding_here => forces%rounding_of_gaps*spread_of_row(contact, i))
        if (u > rounding_here) cycle
        x(1, i) = sign(max(0.0_wp, abs(x(1, i)) - rounding_here), x(1, i))
        if (norm2(x(2:, i)) <= rounding_here) x(2:, i) = 0.0_wp
      end associate
    end do
    at_rest = is_at_rest(mesh, forces, pressed)
    ! Of bodies whose forces are all rounding the reactions say nothing, but where they are said to
    ! hold what slips.
    reaction = contact%reaction
    do i = 1, points%n
      if (norm2(x(2:, i)) > tolerance*u) cycle
      if (at_rest(mesh%body(points%node(i)))) reaction(:, i) = 0.0_wp
    end do
    ! A turn may take the obstacle further past a point than anything is displaced.
    way = u
    if (present(turned)) way = max(u, maxval(norm2(turned%slip, dim=1)))
    certificate = judge_contact(points%mu, reaction, x, f, u, way)
    certificate%support = max(departure(mesh, new%displacement, forces), torn(mesh, &
      new%displacement, forces))
    ! A body that was let go may be left with forces below the range of single precision.
    f = max(f, nothing*maxval(forces%rounding))
    scale = max(forces_of_bodies(mesh, forces, pressed, pressed_before, support), nothing* &
      maxval(forces%rounding))
    scale(0) = f
    certificate%balance = worst_balance(mesh, forces, rounding, pressed, support, scale)
    certificate%equilibrium = worst_imbalance(mesh, residual, forces, rounding, at_rest, scale, &
      10.0_wp*tolerance)
    certificate%certified = worst_entry(certificate) <= 10.0_wp*tolerance .and. &
      certificate%support <= held
  end function certify

  !> By what rounding of places grows in the gap of a point: before an obstacle by nothing, before a
  !> surface by what its weights add up to, and by the integrals that they are made of.
  pure real(wp) function spread_of_row(contact, i) result(factor)
    type(contact_fields_t), intent(in) :: contact
    integer, intent(in) :: i !! point

    factor = 1.0_wp
    associate (first => contact%weights%first(i), last => contact%weights%first(i + 1) - 1)
      if (last > first) factor = 4.0_wp*(1.0_wp + sum(abs(contact%weights%weight(first:last))))
    end associate
  end function spread_of_row

  !> How far displacements are from what is prescribed, beside that and the size of the mesh.
  !> docs/theory.md (6.1).
  pure real(wp) function departure(mesh, u, forces)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: u(:, :)  !! (3,n_nodes) [length]
    type(increment_forces_t), intent(in) :: forces
    real(wp) :: size_of_mesh
    integer :: node, i

    departure = 0.0_wp
    size_of_mesh = maxval(maxval(mesh%coordinates, dim=2) - minval(mesh%coordinates, dim=2))
    do node = 1, mesh%n_nodes
      do i = 1, 3
        if (.not. forces%prescribed(i, node)) cycle
        associate (wanted => forces%displacement(i, node))
          departure = max(departure, ratio(abs(u(i, node) - wanted), max(abs(wanted), &
            size_of_mesh)))
        end associate
      end do
    end do
  end function departure

  !> How far what depends is from where its masters say it is, beside what they add up and the size
  !> of the mesh. docs/theory.md (11.11).
  pure real(wp) function torn(mesh, u, forces)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: u(:, :)  !! (3,n_nodes) [length]
    type(increment_forces_t), intent(in) :: forces
    real(wp) :: size_of_mesh, here, sum_of_sizes, part
    integer :: c, k

    torn = 0.0_wp
    size_of_mesh = maxval(maxval(mesh%coordinates, dim=2) - minval(mesh%coordinates, dim=2))
    associate (all => forces%constraints)
      do c = 1, all%n
        if (forces%prescribed(all%dof(c), all%node(c))) cycle
        here = u(all%dof(c), all%node(c))
        sum_of_sizes = abs(here)
        do k = all%first(c), all%first(c + 1) - 1
          part = all%weight(k)*u(all%master_dof(k), all%master(k))
          here = here - part
          sum_of_sizes = sum_of_sizes + abs(part)
        end do
        torn = max(torn, ratio(abs(here), max(sum_of_sizes, size_of_mesh)))
      end do
    end associate
  end function torn

  !> Give the forces on what depends to its masters, again and again where these depend in their
  !> turn, and the rounding of internal forces with them.
  pure subroutine hand_over(forces, residual, rounding_of_nodes)
    type(increment_forces_t), intent(in) :: forces
    real(wp), intent(inout) :: residual(:, :)          !! (3,n_nodes) [force]
    real(wp), intent(out) :: rounding_of_nodes(:)      !! (n_nodes) [force]
    real(wp) :: rounding(3, size(residual, 2))
    integer :: c, k, round

    rounding_of_nodes = forces%rounding
    if (forces%constraints%n == 0) return
    rounding = spread(forces%rounding, 1, 3)
    associate (all => forces%constraints)
      ! No chain is longer than there are constraints.
      do round = 1, all%n
        do c = 1, all%n
          associate (i => all%dof(c), node => all%node(c))
            if (forces%prescribed(i, node)) cycle
            do k = all%first(c), all%first(c + 1) - 1
              associate (to => all%master(k), j => all%master_dof(k))
                residual(j, to) = residual(j, to) + all%weight(k)*residual(i, node)
                rounding(j, to) = rounding(j, to) + abs(all%weight(k))*rounding(i, node)
              end associate
            end do
            residual(i, node) = 0.0_wp
            rounding(i, node) = 0.0_wp
          end associate
        end do
        if (.not. some_left()) exit
      end do
    end associate
    rounding_of_nodes = maxval(rounding, dim=1)

  contains

    pure logical function some_left()
      integer :: l

      some_left = .false.
      do l = 1, forces%constraints%n
        associate (i => forces%constraints%dof(l), node => forces%constraints%node(l))
          if (forces%prescribed(i, node)) cycle
          some_left = some_left .or. abs(residual(i, node)) > 0.0_wp .or. rounding(i, node) > 0.0_wp
        end associate
      end do
    end function some_left

  end subroutine hand_over

  !> The largest nodal force of each body: beside a body that is loaded more, errors of another
  !> would not be seen.
  pure function forces_of_bodies(mesh, forces, pressed, pressed_before, support) result(f)
    type(mesh_t), intent(in) :: mesh
    type(increment_forces_t), intent(in) :: forces
    real(wp), intent(in) :: pressed(:, :), pressed_before(:, :), support(:, :)
    !! (3,n_nodes) [force]
    real(wp) :: f(0:mesh%n_bodies)                       !! 0: of nodes without a body [force]
    integer :: node

    f = 0.0_wp
    do node = 1, mesh%n_nodes
      associate (of_body => f(mesh%body(node)))
        of_body = max(of_body, norm2(pressed(:, node)), norm2(pressed_before(:, node)), &
          norm2(support(:, node)), norm2(forces%external(:, node)), norm2(forces%internal(:, node)))
      end associate
    end do
  end function forces_of_bodies

  !> Whether nothing acts on a body, and it has moved as a whole: all its forces are rounding, of
  !> displacements or, where it touches something, of places.
  pure function is_at_rest(mesh, forces, pressed) result(at_rest)
    type(mesh_t), intent(in) :: mesh
    type(increment_forces_t), intent(in) :: forces
    real(wp), intent(in) :: pressed(:, :)     !! (3,n_nodes) [force]
    logical :: at_rest(0:mesh%n_bodies)       !! 0: nodes without a body, never
    integer :: node

    at_rest = .true.
    at_rest(0) = .false.
    do node = 1, mesh%n_nodes
      if (any(abs(forces%external(:, node)) > 0.0_wp) .or. max(norm2(forces%internal(:, node)), &
        norm2(pressed(:, node))) > forces%rounding(node) + forces%stiffness(node)* &
        forces%rounding_of_gaps) at_rest(mesh%body(node)) = .false.
    end do
  end function is_at_rest

  !> The largest force out of balance at a node, beside the largest of its body; where that is not
  !> allowed, less what rounding excuses.
  !>
  !> Rounding excuses at most a thousandth of the largest force. Support forces are internal forces:
  !> where the last bits of the displacements alone are worth more than is allowed, that counts as
  !> well. docs/theory.md (6.2).
  pure real(wp) function worst_imbalance(mesh, residual, forces, rounding_of_nodes, at_rest, f, &
    allowed) result(worst)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: residual(:, :)    !! (3,n_nodes) on the free degrees of freedom [force]
    type(increment_forces_t), intent(in) :: forces
    real(wp), intent(in) :: rounding_of_nodes(:) !! (n_nodes) [force]
    logical, intent(in) :: at_rest(0:)        !! (0:n_bodies)
    real(wp), intent(in) :: f(0:)             !! (0:n_bodies) of each body [force]
    real(wp), intent(in) :: allowed           !! [-]
    real(wp) :: here
    integer :: node

    worst = 0.0_wp
    do node = 1, mesh%n_nodes
      if (at_rest(mesh%body(node))) cycle
      associate (largest_here => f(mesh%body(node)), rounding => rounding_of_nodes(node))
        here = ratio(norm2(residual(:, node)), largest_here)
        if (here > allowed) here = ratio(norm2(residual(:, node)) - min(rounding, &
          excusable*largest_here), largest_here)
        worst = max(worst, here)
        if (.not. any(forces%prescribed(:, node))) cycle
        here = ratio(last_bits*rounding, largest_here)
        if (here > allowed) worst = max(worst, here)
      end associate
    end do
  end function worst_imbalance

  !> The worst balance of a whole body along its rigid motions, or of an obstacle along the
  !> translations that no support holds: loads, supports and contact alone. docs/theory.md (6.3).
  pure real(wp) function worst_balance(mesh, forces, rounding, pressed, support, f) result(worst)
    type(mesh_t), intent(in) :: mesh
    type(increment_forces_t), intent(in) :: forces
    real(wp), intent(in) :: rounding(:)                  !! (n_nodes) of internal forces [force]
    real(wp), intent(in) :: pressed(:, :), support(:, :) !! (3,n_nodes) [force]
    real(wp), intent(in) :: f(0:)                        !! (0:n_bodies) of each body [force]
    type(along_motion_t) :: along(6, mesh%n_bodies), of_obstacle
    real(wp), dimension(3, mesh%n_bodies) :: low, high
    real(wp) :: motion(3, 6)
    integer :: node, body, i

    low = huge(1.0_wp)
    high = -huge(1.0_wp)
    do node = 1, mesh%n_nodes
      body = mesh%body(node)
      if (body == 0) cycle
      low(:, body) = min(low(:, body), mesh%coordinates(:, node))
      high(:, body) = max(high(:, body), mesh%coordinates(:, node))
    end do
    worst = 0.0_wp
    do node = 1, mesh%n_nodes
      body = mesh%body(node)
      if (body == 0) then
        motion = motions_of(spread(0.0_wp, 1, 3))
        do i = 1, 3
          if (forces%prescribed(i, node)) cycle
          of_obstacle = along_motion_t()
          call add_node(node, motion(:, i), forces, rounding(node), pressed, support, of_obstacle)
          worst = max(worst, out_of_balance(of_obstacle, f(0)))
        end do
      else
        motion = motions_of(mesh%coordinates(:, node) - 0.5_wp*(low(:, body) + high(:, body)))
        do i = 1, 6
          call add_node(node, motion(:, i), forces, rounding(node), pressed, support, &
            along(i, body))
        end do
      end if
    end do
    do body = 1, mesh%n_bodies
      do i = 1, 6
        worst = max(worst, out_of_balance(along(i, body), f(body)))
      end do
    end do
  end function worst_balance

  !> What the translations along x, y, z and the rotations about them do to a point, a column each.
  pure function motions_of(arm) result(motion)
    real(wp), intent(in) :: arm(3)  !! of the point, from the centre of its body [length]
    real(wp) :: motion(3, 6)        !! [-], [length]
    integer :: i

    motion = 0.0_wp
    do i = 1, 3
      motion(i, i) = 1.0_wp
      motion(:, 3 + i) = cross(motion(:, i), arm)
    end do
  end function motions_of

  !> Add the forces on a node to what acts along a motion.
  pure subroutine add_node(node, motion, forces, rounding, pressed, support, along)
    integer, intent(in) :: node
    real(wp), intent(in) :: motion(3)                    !! of the node
    type(increment_forces_t), intent(in) :: forces
    real(wp), intent(in) :: rounding                     !! [force]
    real(wp), intent(in) :: pressed(:, :), support(:, :) !! (3,n_nodes) [force]
    type(along_motion_t), intent(inout) :: along
    real(wp) :: arm

    arm = norm2(motion)
    associate (load => forces%external(:, node), contact => pressed(:, node), &
               held_by => support(:, node))
      along%total = along%total + dot_product(load + contact + held_by, motion)
      along%weight = along%weight + abs(dot_product(load, motion)) + &
        abs(dot_product(contact, motion)) + abs(dot_product(held_by, motion))
      along%magnitude = along%magnitude + (norm2(load) + norm2(contact) + norm2(held_by))*arm
      along%load = along%load + abs(dot_product(load, motion))
      along%load_magnitude = along%load_magnitude + norm2(load)*arm
    end associate
    along%rounding = along%rounding + rounding*sum(abs(motion), &
      mask=forces%prescribed(:, node))
    along%arm = max(along%arm, arm)
  end subroutine add_node

  !> What is left of the forces along a motion, less what rounding excuses, beside their magnitudes.
  !>
  !> Support forces along the motion excuse what they carry. Where the loads have a part of their
  !> own along it, more than their rounding, that must be balanced by itself: the rounding of forces
  !> that act in other directions excuses at most a thousandth of it. Where they have none, what is
  !> left may also be small beside F.
  pure real(wp) function out_of_balance(along, f) result(left)
    type(along_motion_t), intent(in) :: along
    real(wp), intent(in) :: f  !! [force]
    real(wp) :: excuse, weight

    excuse = rounded*along%magnitude
    weight = along%weight
    if (along%load > rounded*along%load_magnitude) then
      excuse = min(excuse, excusable*along%load)
    else
      weight = max(weight, f*along%arm)
    end if
    left = ratio(abs(along%total) - excuse - along%rounding, weight)
  end function out_of_balance

  !> The five entries that concern contact, of reactions and the gaps and slips that belong to them.
  pure function judge_contact(mu, r, x, f, u, way) result(certificate)
    real(wp), intent(in) :: mu(:)    !! (n_points) [-]
    real(wp), intent(in) :: r(:, :)  !! (3,n_points) n, t1, t2 [force]
    real(wp), intent(in) :: x(:, :)  !! (3,n_points) [length]
    real(wp), intent(in) :: f, u     !! scales of force and length
    real(wp), intent(in), optional :: way !! scale of slips, `u` where left out [length]
    type(certificate_t) :: certificate !! equilibrium is 0 in it
    real(wp) :: defect, total, longest
    integer :: i

    certificate = nothing_true
    if (.not. (are_finite(r) .and. are_finite(x))) return ! max() would forget NaN
    certificate = certificate_t()
    defect = 0.0_wp
    total = 0.0_wp
    do i = 1, size(mu)
      certificate%penetration = max(certificate%penetration, -x(1, i))
      certificate%adhesion = max(certificate%adhesion, -r(1, i))
      certificate%complementarity = max(certificate%complementarity, abs(x(1, i)*r(1, i)))
      certificate%cone = max(certificate%cone, norm2(r(2:, i)) - mu(i)*r(1, i))
      ! What is rounding of other forces has no law.
      if (norm2(r(:, i)) <= rounded*f) cycle
      defect = defect + abs(mu(i)*r(1, i)*norm2(x(2:, i)) + dot_product(x(:, i), r(:, i)))
      ! A point that sticks under much friction slips by rounding: beside the force that could hold
      ! it.
      total = total + max(norm2(r(:, i)), mu(i)*r(1, i))
    end do
    certificate%penetration = ratio(certificate%penetration, u)
    certificate%adhesion = ratio(certificate%adhesion, f)
    certificate%complementarity = ratio(ratio(certificate%complementarity, f), u)
    certificate%cone = ratio(certificate%cone, f)
    longest = u
    if (present(way)) longest = way
    certificate%law = ratio(ratio(defect, total), longest)
  end function judge_contact

  !> Work, strain energy and dissipation up to the end of the increment, and what is left over.
  !>
  !> External work by the trapezoidal rule on loads and supports, and on the torques that turn
  !> obstacles; the reaction of the end dissipates over the slip.
  pure subroutine energy_balance(contact, old, new, internal_force, energy, of_torques)
    type(contact_fields_t), intent(in) :: contact
    type(state_t), intent(in) :: old
    type(state_t), intent(inout) :: new            !! gets external_work and dissipation
    real(wp), intent(in) :: internal_force(:, :)   !! (3,n_nodes) [force]
    type(energy_t), intent(out) :: energy
    real(wp), intent(in), optional :: of_torques   !! in the increment, 0 where left out [energy]

    new%external_work = old%external_work + 0.5_wp*sum((new%displacement - old%displacement)* &
      (old%external_force + old%support_force + new%external_force + new%support_force))
    if (present(of_torques)) new%external_work = new%external_work + of_torques
    new%dissipation = old%dissipation - sum(contact%reaction(2:, :)*contact%slip_increment)
    energy%external_work = new%external_work
    energy%strain = 0.5_wp*sum(internal_force*new%displacement)
    energy%dissipation = new%dissipation
    energy%balance = energy%external_work - energy%strain - energy%dissipation
  end subroutine energy_balance

  pure logical function are_finite(v)
    real(wp), intent(in) :: v(:, :)

    are_finite = all(abs(v) <= huge(v))
  end function are_finite

  !> The largest vector of a list.
  pure function largest(v, among) result(size_of_largest)
    real(wp), intent(in) :: v(:, :) !! (3,n)
    logical, intent(in), optional :: among(:) !! (n) those that count
    real(wp) :: size_of_largest
    integer :: i

    size_of_largest = 0.0_wp
    do i = 1, size(v, 2)
      if (present(among)) then
        if (.not. among(i)) cycle
      end if
      size_of_largest = max(size_of_largest, sum(v(:, i)**2))
    end do
    size_of_largest = sqrt(size_of_largest)
  end function largest

  !> The farthest that forces would move their node while all others are held.
  !>
  !> Where loads act on the very nodes that contact holds nothing moves but by rounding, and
  !> displacements are no measure.
  pure real(wp) function largest_alone(force, stiffness) result(way)
    real(wp), intent(in) :: force(:, :)   !! (3,n_nodes) [force]
    real(wp), intent(in) :: stiffness(:)  !! (n_nodes), 0 of nodes without a brick [force/length]
    integer :: node

    way = 0.0_wp
    do node = 1, size(stiffness)
      if (stiffness(node) > 0.0_wp) way = max(way, norm2(force(:, node))/stiffness(node))
    end do
  end function largest_alone

  !> Largest minus smallest of a displacement component over a body: its deformation, free of
  !> translation.
  pure function largest_spread(mesh, u) result(spread)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: u(:, :) !! (3,n_nodes)
    real(wp) :: spread, low(3, mesh%n_bodies), high(3, mesh%n_bodies)
    integer :: node, body

    low = huge(1.0_wp)
    high = -huge(1.0_wp)
    do node = 1, mesh%n_nodes
      body = mesh%body(node)
      if (body == 0) cycle
      low(:, body) = min(low(:, body), u(:, node))
      high(:, body) = max(high(:, body), u(:, node))
    end do
    spread = 0.0_wp
    if (mesh%n_bodies > 0) spread = maxval(high - low)
  end function largest_spread

  !> a/b with 0/0 = 0; something over nothing is infinitely wrong.
  pure function ratio(a, b) result(quotient)
    real(wp), intent(in) :: a, b !! a >= 0, b >= 0
    real(wp) :: quotient

    if (a <= 0.0_wp) then
      quotient = 0.0_wp
    else if (b > 0.0_wp .and. a < b*1.0e100_wp) then
      quotient = a/b
    else
      quotient = huge(1.0_wp)
    end if
  end function ratio

end module certificate_mod
