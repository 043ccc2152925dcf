!> The certificate: how true a step is, from its reactions and displacements alone.
!>
!> Nothing here is shared with the solvers: no compliance, no projection, no x_free. docs/theory.md
!> section 6.
module certificate_mod
  use kinds_mod, only: wp
  use mesh_mod, only: mesh_t
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t
  use step_report_mod, only: certificate_t, energy_t, contact_fields_t, worst_entry
  implicit none
  private

  public :: certify, judge_contact, energy_balance, step_forces_t

  !> Of numbers that are none.
  type(certificate_t), parameter :: nothing_true = certificate_t(huge(1.0_wp), huge(1.0_wp), &
    huge(1.0_wp), huge(1.0_wp), huge(1.0_wp), huge(1.0_wp), .false.)

  !> The forces of a step, all (3,n_nodes) in x, y, z.
  type :: step_forces_t
    real(wp), allocatable :: internal(:, :)   !! from the stresses [force]
    real(wp), allocatable :: external(:, :)   !! loads [force]
    logical,  allocatable :: prescribed(:, :) !! degrees of freedom held by supports
    real(wp) :: rounding = 0.0_wp             !! that the internal forces carry [force]
    real(wp) :: rounding_of_gaps = 0.0_wp     !! that the gaps carry [length]
  end type step_forces_t

contains

  !> Judge a step.
  !>
  !> Scales: F the largest nodal force (reactions, supports, loads, internal), U the largest
  !> displacement increment or deformation of a body. 0/0 = 0.
  pure function certify(mesh, points, contact, has_friction, old, new, forces, &
    tolerance) result(certificate)
    type(mesh_t), intent(in) :: mesh
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(in) :: contact
    !! frames, local reactions, gaps and slip increments
    logical, intent(in) :: has_friction(:, :)      !! (2,n_points) tangents along which the law acts
    type(state_t), intent(in) :: old, new          !! before and after the step
    type(step_forces_t), intent(in) :: forces
    real(wp), intent(in) :: tolerance              !! contact tolerance [-]
    type(certificate_t) :: certificate
    real(wp) :: f, u, x(3, points%n)
    real(wp), dimension(3, mesh%n_nodes) :: pressed, residual, support
    logical :: is_mesh(mesh%n_nodes)
    integer :: i

    pressed = 0.0_wp
    do i = 1, points%n
      pressed(:, points%node(i)) = pressed(:, points%node(i)) + new%reaction(:, i)
      if (points%ref_node(i) == 0) cycle
      pressed(:, points%ref_node(i)) = pressed(:, points%ref_node(i)) - new%reaction(:, i)
    end do
    residual = forces%internal - forces%external - pressed
    support = merge(residual, 0.0_wp, forces%prescribed)
    residual = residual - support
    ! Of an obstacle's reference node the forces are resultants, not those of a node. Reactions of
    ! several obstacles on one node may be any size and cancel: what counts is their sum.
    is_mesh = mesh%body > 0
    f = max(largest(pressed, is_mesh), largest(support, is_mesh), largest(forces%external, &
      is_mesh), &
      largest(forces%internal))
    if (f <= 0.0_wp) f = largest(forces%external)
    u = max(largest(new%displacement - old%displacement), largest_spread(mesh, new%displacement))

    x(1, :) = contact%gap
    ! Where nothing moves by more than places are rounded, neither does a gap.
    if (u <= forces%rounding_of_gaps) then
      where (x(1, :) < 0.0_wp) x(1, :) = min(0.0_wp, x(1, :) + forces%rounding_of_gaps)
    end if
    x(2:, :) = merge(contact%slip_increment, 0.0_wp, has_friction)
    certificate = judge_contact(points%mu, contact%reaction, x, f, u)
    ! A body that moves as a whole has forces of rounding alone: they are no imbalance. Beside
    ! forces that are more than that an imbalance counts, whatever it comes from.
    if (f > forces%rounding) certificate%equilibrium = ratio(largest(residual), f)
    certificate%certified = worst_entry(certificate) <= 10.0_wp*tolerance
    if (are_finite(new%displacement) .and. are_finite(new%reaction) .and. &
        are_finite(contact%slip_increment) .and. are_finite(forces%internal) .and. &
        are_finite(forces%external)) return
    certificate = nothing_true
  end function certify

  !> The five entries that concern contact, of reactions and the gaps and slips that belong to them.
  pure function judge_contact(mu, r, x, f, u) result(certificate)
    real(wp), intent(in) :: mu(:)    !! (n_points) [-]
    real(wp), intent(in) :: r(:, :)  !! (3,n_points) n, t1, t2 [force]
    real(wp), intent(in) :: x(:, :)  !! (3,n_points) [length]
    real(wp), intent(in) :: f, u     !! scales of force and length
    type(certificate_t) :: certificate !! equilibrium is 0 in it
    real(wp) :: defect, total
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
      defect = defect + abs(mu(i)*r(1, i)*norm2(x(2:, i)) + dot_product(x(:, i), r(:, i)))
      ! A point that sticks under much friction slips by rounding: beside the force that could hold
      ! it.
      total = total + max(norm2(r(:, i)), mu(i)*r(1, i))
    end do
    certificate%penetration = ratio(certificate%penetration, u)
    certificate%adhesion = ratio(certificate%adhesion, f)
    certificate%complementarity = ratio(ratio(certificate%complementarity, f), u)
    certificate%cone = ratio(certificate%cone, f)
    certificate%law = ratio(ratio(defect, total), u)
  end function judge_contact

  !> Work, strain energy and dissipation up to the end of the step, and what is left over.
  !>
  !> External work by the trapezoidal rule on loads and supports; the reaction of the end dissipates
  !> over the slip.
  pure subroutine energy_balance(contact, old, new, internal_force, energy)
    type(contact_fields_t), intent(in) :: contact
    type(state_t), intent(in) :: old
    type(state_t), intent(inout) :: new            !! gets external_work and dissipation
    real(wp), intent(in) :: internal_force(:, :)   !! (3,n_nodes) [force]
    type(energy_t), intent(out) :: energy

    new%external_work = old%external_work + 0.5_wp*sum((new%displacement - old%displacement)* &
      (old%external_force + old%support_force + new%external_force + new%support_force))
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
