!> The certificate: how true an increment is, from its reactions and displacements alone.
!>
!> Nothing here is shared with the solvers: no compliance, no projection, no x_free. docs/theory.md
!> section 6.
module certificate_mod
  use kinds_mod, only: wp
  use connectivity_mod, only: nodes_of_element
  use mesh_mod, only: mesh_t
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t
  use increment_report_mod, only: certificate_t, energy_t, contact_fields_t, worst_entry
  use body_balance_mod, only: acting_t, worst_balance
  use increment_forces_mod, only: increment_forces_t
  use bodies_at_rest_mod, only: are_at_rest, spread_of_row
  use edge_middles_mod, only: edge_middles_t, spread_reaction
  use constrained_forces_mod, only: hand_over, torn
  use rigid_patterns_mod, only: broken, along_free_turns
  use turning_means_mod, only: misplaced
  use error_measures_mod, only: are_finite, excusable, ratio, rounded
  use certificate_scales_mod, only: scales_t, find_scales
  use undetermined_forces_mod, only: largest_undetermined
  use turned_slips_mod, only: turned_slips_t
  implicit none
  private

  public :: certify, judge_contact, energy_balance

  !> Of numbers that are none.
  type(certificate_t), parameter :: nothing_true = certificate_t(huge(1.0_wp), huge(1.0_wp), &
    huge(1.0_wp), huge(1.0_wp), huge(1.0_wp), huge(1.0_wp), .false., huge(1.0_wp), huge(1.0_wp), &
    huge(1.0_wp), huge(1.0_wp), huge(1.0_wp))

  real(wp), parameter :: held = 16.0_wp*epsilon(1.0_wp)
  !! what is prescribed is kept to this, (6.1): 370 random decks end alike with 2 to 128 eps [-]
  real(wp), parameter :: of_displacements = 8.0_wp*epsilon(1.0_wp)
  !! of the largest: the rounding of their differences; 370 random decks end alike with 1 to 64 eps
  !! [-]
  real(wp), parameter :: same_energy = 1.0e-9_wp
  !! of the largest term: strain energy and half the work, but for what forces out of balance do. In
  !! the runs of input/ they differ by 4e-12 at most [-]
  real(wp), parameter :: last_bits = 1.0_wp/8.0_wp
  !! of the rounding of forces: (6.2) has 32 eps, of which 4 are the displacements' own [-]

contains

  !> Judge an increment, by scales of forces and lengths that come from no reaction.
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
    type(scales_t) :: scales
    type(acting_t) :: acting
    real(wp), dimension(3, points%n) :: x, reaction
    real(wp) :: pressed(3, mesh%n_nodes, 2)         !! before and after the increment [force]
    real(wp), dimension(3, mesh%n_nodes) :: residual, support
    real(wp), dimension(3, mesh%n_nodes) :: joining !! forces of constraints
    real(wp) :: rounding(mesh%n_nodes), way(points%n)
    real(wp) :: of_gap, of_slip                     !! rounding [length]
    real(wp) :: unexplained                         !! of the energy [-]
    logical :: at_rest(0:mesh%n_bodies)
    integer :: i

    certificate = nothing_true
    if (.not. (are_finite(new%displacement) .and. are_finite(new%reaction) .and. &
      are_finite(contact%slip_increment) .and. are_finite(forces%internal) .and. &
      are_finite(forces%external))) return
    pressed(:, :, 1) = forces_on_nodes(mesh, points, contact, forces%middles, old%reaction)
    pressed(:, :, 2) = forces_on_nodes(mesh, points, contact, forces%middles, new%reaction)
    residual = forces%internal - forces%external - pressed(:, :, 2)
    rounding = forces%rounding
    joining = residual
    call hand_over(forces%constraints, forces%prescribed, residual, rounding)
    joining = joining - residual
    call along_free_turns(forces%patterns, new%displacement, forces%prescribed, residual)
    support = merge(residual, 0.0_wp, forces%prescribed)
    residual = residual - support
    call find_scales(mesh, points, contact, old, new, forces, pressed, scales)

    x(1, :) = contact%gap
    if (allocated(contact%kept_overlap)) then
      where (x(1, :) < 0.0_wp) x(1, :) = min(0.0_wp, x(1, :) + contact%kept_overlap)
    end if
    x(2:, :) = contact%slip_increment
    if (present(turned)) then
      where (spread(turned%is_turned, 1, 2)) x(2:, :) = turned%slip
    end if
    ! Where what moves is so little that rounding is more than is allowed of it, gaps and slips are
    ! no better known: as displacements are what is made of these alone, else as places. Where
    ! supports carry the loads displacements are rounding of those that these would make.
    do i = 1, points%n
      of_gap = forces%rounding_of_gaps
      if (allocated(forces%touches)) then
        if (forces%touches(i)) then
          of_gap = maxval(abs(new%displacement))
          associate (k => forces%stiffness(points%node(i)))
            if (k > 0.0_wp) of_gap = max(of_gap, scales%force(i)/k)
          end associate
          of_gap = of_displacements*of_gap
        end if
      end if
      of_slip = merge(forces%rounding_of_gaps, of_gap, forces%is_finite)
      associate (spread => spread_of_row(contact, forces%middles, i), &
                 allowed => 10.0_wp*tolerance*scales%length(i))
        if (of_gap*spread >= allowed) x(1, i) = sign(max(0.0_wp, abs(x(1, i)) - of_gap*spread), &
          x(1, i))
        if (of_slip*spread >= max(allowed, norm2(x(2:, i)))) x(2:, i) = 0.0_wp
      end associate
    end do
    at_rest = are_at_rest(mesh, points, contact, new%displacement, forces, pressed(:, :, 2))
    ! Of bodies whose forces are all rounding the reactions say nothing, but where they are said to
    ! hold what slips.
    reaction = contact%reaction
    do i = 1, points%n
      if (norm2(x(2:, i)) > tolerance*scales%length(i)) cycle
      if (at_rest(mesh%body(points%node(i)))) reaction(:, i) = 0.0_wp
    end do
    ! A turn may take the obstacle further past a point than anything is displaced.
    way = scales%length
    if (present(turned)) way = max(way, norm2(turned%slip, dim=1))
    if (allocated(contact%stays)) then
      certificate = judge_contact(points%mu, reaction, x, scales%force, scales%length, way, &
        contact%stays)
    else
      certificate = judge_contact(points%mu, reaction, x, scales%force, scales%length, way)
    end if
    certificate%support = max(departure(mesh, new%displacement, forces), torn(mesh, &
      new%displacement, forces%constraints, forces%prescribed, forces%patterns, forces%means), &
      broken(forces%patterns, mesh%coordinates, new%displacement, forces%prescribed), &
      misplaced(forces%means, mesh%coordinates, new%displacement))
    acting = acting_t(forces%external, pressed(:, :, 2), support)
    if (allocated(forces%applied)) then
      ! What springs pull and inertia takes balances loads, as contact does.
      acting%load = forces%applied
      acting%contact = acting%contact + (forces%external - forces%applied)
    end if
    if (allocated(forces%dead_load)) acting%dead = forces%dead_load
    if (forces%constraints%n_equations > 0) acting%contact = acting%contact + joining
    ! What acts on bodies at rest is rounding, and has no sum that means anything.
    do i = 1, mesh%n_nodes
      if (.not. at_rest(mesh%body(i))) cycle
      acting%load(:, i) = 0.0_wp
      acting%contact(:, i) = 0.0_wp
      acting%support(:, i) = 0.0_wp
    end do
    if (forces%constraints%n_equations == 0) then
      certificate%balance = worst_balance(shape_of(mesh, new%displacement, forces%is_finite), &
        acting, forces%prescribed, rounding, scales%of_body)
    else
      certificate%balance = balance_of_pieces(mesh, new%displacement, forces, acting, rounding, &
        scales%of_body)
    end if
    certificate%equilibrium = worst_imbalance(mesh, residual, forces, rounding, at_rest .or. &
      scales%is_carried, scales%of_body, 10.0_wp*tolerance)
    call find_energy_errors(mesh, scales%strained, forces, acting_t(forces%external, &
      pressed(:, :, 2) + joining, support), residual, at_rest, certificate%energy, unexplained)
    if (forces%is_finite) then
      do i = 1, mesh%n_bodies
        certificate%equilibrium = max(certificate%equilibrium, &
          ratio(forces%of_elements%on_modes(i), scales%of_body(i)))
      end do
      certificate%energy = 0.0_wp
      unexplained = 0.0_wp
    end if
    certificate%undetermined = largest_undetermined(mesh, points, contact, forces, scales%force, &
      10.0_wp*tolerance)
    certificate%certified = worst_entry(certificate) <= 10.0_wp*tolerance .and. &
      certificate%support <= held .and. unexplained <= same_energy
  end function certify

  !> The mesh about whose places moments balance: at finite strain the deformed one.
  pure type(mesh_t) function shape_of(mesh, u, is_finite) result(shape)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: u(:, :)  !! (3,n_nodes) [length]
    logical, intent(in) :: is_finite !! strain

    shape%n_nodes = mesh%n_nodes
    shape%n_bodies = mesh%n_bodies
    shape%body = mesh%body
    shape%coordinates = mesh%coordinates
    if (is_finite) shape%coordinates = shape%coordinates + u
  end function shape_of

  !> The forces of contact on nodes: each reaction on its slave node, less its weights on masters.
  pure function forces_on_nodes(mesh, points, contact, middles, reaction) result(pressed)
    type(mesh_t), intent(in) :: mesh
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(in) :: contact   !! its weights
    type(edge_middles_t), intent(in) :: middles
    real(wp), intent(in) :: reaction(:, :)          !! (3,n_points) x, y, z [force]
    real(wp) :: pressed(3, mesh%n_nodes)            !! [force]
    integer :: i, k

    pressed = 0.0_wp
    do i = 1, points%n
      call spread_reaction(middles, points%node(i), i, reaction(:, i), pressed)
      do k = contact%weights%first(i), contact%weights%first(i + 1) - 1
        associate (node => contact%weights%node(k), weight => contact%weights%weight(k))
          pressed(:, node) = pressed(:, node) - weight*reaction(:, i)
        end associate
      end do
    end do
  end function forces_on_nodes

  !> The strain energy of each body beside half the work of all forces on its nodes at the same
  !> state, less what rounding excuses; and what is left of that without the work of the forces out
  !> of balance, which are as large as the tolerance lets them be. docs/theory.md (6.4).
  !>
  !> Along rigid motions forces have no work: that is their balance.
  pure subroutine find_energy_errors(mesh, strained, forces, acting, residual, at_rest, worst, &
    unexplained)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: strained(:, :) !! (3,n_nodes) displacement without rigid motion [length]
    type(increment_forces_t), intent(in) :: forces
    type(acting_t), intent(in) :: acting   !! contact with the forces of constraints
    real(wp), intent(in) :: residual(:, :) !! (3,n_nodes) forces out of balance [force]
    logical, intent(in) :: at_rest(0:)     !! (0:n_bodies)
    real(wp), intent(out) :: worst, unexplained !! of the largest term of the body [-]
    real(wp) :: work(4, 0:mesh%n_bodies)   !! half, of loads, contact, supports, and out of balance
    real(wp) :: rounding(0:mesh%n_bodies), left, largest
    integer :: node, body

    work = 0.0_wp
    rounding = 0.0_wp
    do node = 1, mesh%n_nodes
      body = mesh%body(node)
      associate (load => acting%load(:, node), contact => acting%contact(:, node), &
        held_by => acting%support(:, node), way => strained(:, node))
        work(:, body) = work(:, body) + 0.5_wp*[dot_product(way, load), dot_product(way, contact), &
          dot_product(way, held_by), dot_product(way, residual(:, node))]
        rounding(body) = rounding(body) + norm2(way)*(forces%rounding(node) + rounded* &
          (norm2(load) + norm2(contact) + norm2(held_by)))
      end associate
    end do
    worst = 0.0_wp
    unexplained = 0.0_wp
    do body = 1, mesh%n_bodies
      if (at_rest(body)) cycle
      associate (energy => forces%of_elements%energy(body))
        left = max(0.0_wp, abs(energy - sum(work(:3, body))) - rounding(body))
        largest = max(energy, maxval(abs(work(:3, body))))
        worst = max(worst, ratio(left, largest))
        unexplained = max(unexplained, ratio(left - abs(work(4, body)), largest))
      end associate
    end do
  end subroutine find_energy_errors

  !> The worst balance of what elements alone connect, forces of constraints among those that act.
  !>
  !> Equations need not leave action equal to reaction, as ties do: what they join does not balance
  !> as a whole, each piece does.
  pure real(wp) function balance_of_pieces(mesh, u, forces, acting, rounding, f) result(worst)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: u(:, :)           !! (3,n_nodes) [length]
    type(increment_forces_t), intent(in) :: forces
    type(acting_t), intent(in) :: acting      !! contact with the forces of constraints
    real(wp), intent(in) :: rounding(:)       !! (n_nodes) those of constraints too [force]
    real(wp), intent(in) :: f(0:)             !! (0:n_bodies) of each body [force]
    type(mesh_t) :: apart                     !! pieces for bodies, where they are
    logical :: carries(3, mesh%n_nodes)       !! rounding
    real(wp) :: f_of_piece(0:mesh%n_pieces)
    integer :: c, k, node

    apart = shape_of(mesh, u, forces%is_finite)
    apart%body = mesh%piece
    apart%n_bodies = mesh%n_pieces
    carries = forces%prescribed
    associate (all => forces%constraints)
      do c = 1, all%n
        carries(all%dof(c), all%node(c)) = .true.
        do k = all%first(c), all%first(c + 1) - 1
          carries(all%master_dof(k), all%master(k)) = .true.
        end do
      end do
    end associate
    f_of_piece = f(0)
    do node = 1, mesh%n_nodes
      if (mesh%piece(node) > 0) f_of_piece(mesh%piece(node)) = f(mesh%body(node))
      ! Nodes without elements balance by themselves: that is equilibrium.
      if (mesh%piece(node) == 0 .and. mesh%body(node) > 0) carries(:, node) = .true.
    end do
    worst = worst_balance(apart, acting, carries, max(rounding, forces%rounding), f_of_piece)
  end function balance_of_pieces

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

  !> The largest force out of balance at a node, beside the largest of its body; where that is not
  !> allowed, less what rounding excuses.
  !>
  !> Rounding excuses at most a thousandth of the largest force, but all of it on a body at rest:
  !> there that of displacements alone, as rounding of places moves no node against another. Support
  !> forces are internal forces, known as well as others of the body are seen to balance: where
  !> these need their rounding, and where displacements are prescribed that differ, the last bits of
  !> displacements count at supports, if they are worth more than is allowed. docs/theory.md (6.2).
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
    logical :: is_excused(0:mesh%n_bodies), is_rounded(mesh%n_nodes)
    integer :: node

    worst = 0.0_wp
    is_excused = .false.
    do node = 1, mesh%n_nodes
      associate (largest_here => f(mesh%body(node)), rounding => rounding_of_nodes(node))
        if (at_rest(mesh%body(node))) then
          worst = max(worst, ratio(max(0.0_wp, norm2(residual(:, node)) - rounding), largest_here))
          cycle
        end if
        here = ratio(norm2(residual(:, node)), largest_here)
        if (here > allowed) then
          is_excused(mesh%body(node)) = .true.
          here = ratio(norm2(residual(:, node)) - min(rounding, excusable*largest_here), &
            largest_here)
        end if
        worst = max(worst, here)
      end associate
    end do
    is_rounded = any(forces%prescribed, dim=1) .and. .not. at_rest(mesh%body) .and. &
      last_bits*rounding_of_nodes > allowed*f(mesh%body)
    if (.not. any(is_rounded)) return
    is_rounded = is_rounded .and. (is_excused(mesh%body) .or. is_prescribed_apart(mesh, forces))
    do node = 1, mesh%n_nodes
      if (is_rounded(node)) worst = max(worst, ratio(last_bits*rounding_of_nodes(node), &
        f(mesh%body(node))))
    end do
  end function worst_imbalance

  !> Nodes of elements that supports deform by displacements of several sizes, each rounded by
  !> itself. One size alone, beside 0, is rounded as the whole.
  pure function is_prescribed_apart(mesh, forces) result(is_apart)
    type(mesh_t), intent(in) :: mesh
    type(increment_forces_t), intent(in) :: forces
    logical :: is_apart(mesh%n_nodes)
    real(wp) :: first
    integer :: e, i, a

    is_apart = .false.
    do e = 1, mesh%n_elements
      associate (nodes => nodes_of_element(mesh%connectivity, e))
        if (count(forces%prescribed(:, nodes)) < 2) cycle
        directions: do i = 1, 3
          first = 0.0_wp
          do a = 1, size(nodes)
            associate (wanted => forces%displacement(i, nodes(a)))
              if (.not. (forces%prescribed(i, nodes(a)) .and. abs(wanted) > 0.0_wp)) cycle
              if (abs(first) > 0.0_wp .and. abs(wanted - first) > 0.0_wp) then
                is_apart(nodes) = .true.
                exit directions
              end if
              first = wanted
            end associate
          end do
        end do directions
      end associate
    end do
  end function is_prescribed_apart

  !> The six entries that concern contact, of reactions and the gaps and slips that belong to them.
  !>
  !> In the law points count as their reactions, none for more than the scale of forces: one that is
  !> larger would hide the others. Friction does no work at any point: the law, a mean
  !> over the points, sees what it does at all of them together, but little of one among many.
  pure function judge_contact(mu, r, x, f, u, way, stays) result(certificate)
    real(wp), intent(in) :: mu(:)    !! (n_points) [-]
    real(wp), intent(in) :: r(:, :)  !! (3,n_points) n, t1, t2 [force]
    real(wp), intent(in) :: x(:, :)  !! (3,n_points) [length]
    real(wp), intent(in) :: f(:), u(:) !! (n_points) scales of force and length
    real(wp), intent(in), optional :: way(:) !! scales of slips, `u` where left out [length]
    logical, intent(in), optional :: stays(:) !! (n_points) closed; none where left out
    type(certificate_t) :: certificate !! equilibrium is 0 in it
    real(wp) :: defect, total, weight, longest(size(u)), pressing
    logical :: is_closed(size(mu))
    integer :: i

    certificate = nothing_true
    if (.not. (are_finite(r) .and. are_finite(x))) return ! max() would forget NaN
    certificate = certificate_t()
    longest = u
    if (present(way)) longest = way
    is_closed = .false.
    if (present(stays)) is_closed = stays
    defect = 0.0_wp
    total = 0.0_wp
    do i = 1, size(mu)
      associate (c => certificate, normal => r(1, i), force => norm2(r(:, i)))
        pressing = normal
        if (is_closed(i)) then
          ! It may pull, without friction, and must not open.
          pressing = max(0.0_wp, normal)
          c%penetration = max(c%penetration, ratio(abs(x(1, i)), u(i)))
        else
          c%penetration = max(c%penetration, ratio(-x(1, i), u(i)))
          c%adhesion = max(c%adhesion, ratio(-normal, f(i)))
        end if
        c%complementarity = max(c%complementarity, ratio(ratio(abs(x(1, i)*normal), f(i)), u(i)))
        c%cone = max(c%cone, ratio(norm2(r(2:, i)) - mu(i)*pressing, f(i)))
        ! What is rounding of other forces has no law.
        if (force <= rounded*f(i)) cycle
        weight = min(1.0_wp, f(i)/force)
        defect = defect + weight*ratio(abs(mu(i)*pressing*norm2(x(2:, i)) + dot_product(x(:, i), &
          r(:, i))), longest(i))
        ! A point that sticks under much friction slips by rounding: beside the force that could
        ! hold it.
        total = total + weight*max(force, mu(i)*pressing)
        c%dissipation = max(c%dissipation, ratio(ratio(weight*dot_product(r(2:, i), x(2:, i)), &
          f(i)), longest(i)))
      end associate
    end do
    certificate%law = ratio(defect, total)
  end function judge_contact

  !> Work, strain energy and dissipation up to the end of the increment, and what is left over.
  !>
  !> External work by the trapezoidal rule on loads and supports, and what else works: the torques
  !> that turn obstacles, overlaps that contact removes. The reaction of the end dissipates over the
  !> slip. What the forces of thermal
  !> expansion do is in the work of the loads, and so far also in the strain energy, that of the
  !> total strain: both lose what the two differ by from work and energy of the stresses.
  pure subroutine energy_balance(contact, old, new, strain_energy, energy, of_others, of_heat)
    type(contact_fields_t), intent(in) :: contact
    type(state_t), intent(in) :: old
    type(state_t), intent(inout) :: new            !! gets its energies
    real(wp), intent(in) :: strain_energy          !! of the total strain [energy]
    type(energy_t), intent(out) :: energy
    real(wp), intent(in), optional :: of_others    !! in the increment, 0 where left out [energy]
    real(wp), intent(in), optional :: of_heat      !! what both lose, 0 where left out [energy]

    new%external_work = old%external_work + 0.5_wp*sum((new%displacement - old%displacement)* &
      (old%external_force + old%support_force + new%external_force + new%support_force))
    if (present(of_others)) new%external_work = new%external_work + of_others
    new%strain_energy = strain_energy
    new%dissipation = old%dissipation - sum(contact%reaction(2:, :)*contact%slip_increment)
    energy%external_work = new%external_work
    energy%strain = strain_energy
    if (present(of_heat)) then
      energy%external_work = energy%external_work - of_heat
      energy%strain = energy%strain - of_heat
    end if
    energy%dissipation = new%dissipation
    energy%balance = energy%external_work - energy%strain - energy%dissipation
  end subroutine energy_balance

end module certificate_mod
