!> What the nodes of couplings do that turn at finite strain, and what these make of forces.
!>
!>     x_i = x_ref + R (X_i - X_ref),    du_i = du_ref + (S dtheta) x a_i,    a_i = x_i - x_ref
!>
!> theta is the rotation vector of the reference node, R its matrix. Where a *STEP prescribes any of
!> its components they are those of the deck, and S is what takes changes of theta to spins. Where
!> all three are free the unknowns are spins, S = 1, and R is the rotation at the beginning of the
!> increment, turned further: no angle is singular. docs/theory.md (8.38).
module turning_couplings_mod
  use kinds_mod, only: wp
  use rotations_mod, only: change_of_place, spin_matrix, turn_between, compose_turns
  use small_matrix_mod, only: cross
  use constraints_mod, only: constraints_t, add_constraint
  use scene_mod, only: scene_t
  use grips_mod, only: is_turning, nodes_of_grip
  implicit none
  private

  public :: has_turning, turned_constraints, settle_couplings, end_turns, turn_moments
  public :: moments_on_constraints, work_of_turns, coupling_stiffness

contains

  !> Whether the scene has couplings that turn at finite strain.
  pure logical function has_turning(scene)
    type(scene_t), intent(in) :: scene
    integer :: i

    has_turning = .false.
    if (.not. scene%finite_strain .or. .not. allocated(scene%rotations)) return
    do i = 1, size(scene%rotations)
      has_turning = has_turning .or. is_turning(scene, i)
    end do
  end function has_turning

  !> The constraints of the scene, those of turning couplings about displaced places: what small
  !> motions from there do, and the moments that forces have there.
  pure type(constraints_t) function turned_constraints(scene, prescribed, u, began) result(turned)
    type(scene_t), intent(in) :: scene
    logical, intent(in) :: prescribed(:, :)  !! (3,n_nodes)
    real(wp), intent(in) :: u(:, :)          !! (3,n_nodes) [length]
    real(wp), intent(in), optional :: began(:, :) !! as of spin_of
    integer :: i

    turned = scene%constraints
    if (.not. has_turning(scene)) return
    do i = 1, size(scene%rotations)
      if (is_turning(scene, i)) call turn_lines(scene, i, spin_of(scene, prescribed, u, i, began), &
        u, turned)
    end do
  end function turned_constraints

  !> The same with spins for all rotations: forces on them are moments, whatever supports hold.
  pure type(constraints_t) function moments_on_constraints(scene, u) result(turned)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: u(:, :)          !! (3,n_nodes) [length]
    logical :: nothing(3, size(u, 2))

    nothing = .false.
    turned = turned_constraints(scene, nothing, u)
  end function moments_on_constraints

  !> Put the lines of a coupling about displaced places.
  pure subroutine turn_lines(scene, rotation, spin, u, constraints)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: rotation
    real(wp), intent(in) :: spin(3, 3)
    real(wp), intent(in) :: u(:, :)          !! (3,n_nodes) [length]
    type(constraints_t), intent(inout) :: constraints
    type(constraints_t) :: before
    logical :: goes_along(scene%mesh%n_nodes)
    real(wp) :: lines(3, 3)
    integer :: c, b

    before = constraints
    constraints = constraints_t(n_equations=before%n_equations)
    goes_along = .false.
    goes_along(nodes_of_grip(scene, rotation)) = .true.
    associate (of => scene%rotations(rotation), x => scene%mesh%coordinates)
      do c = 1, before%n
        associate (node => before%node(c), first => before%first(c), last => before%first(c + 1) &
                   - 1)
          if (goes_along(node)) then
            do b = 1, 3
              lines(:, b) = cross(spin(:, b), x(:, node) + u(:, node) - x(:, of%node) - &
                u(:, of%node))/of%length
            end do
            call add_constraint(constraints, node, before%dof(c), [of%node, &
              spread(of%rotation_node, 1, 3)], [before%dof(c), 1, 2, 3], [1.0_wp, &
              lines(before%dof(c), :)])
          else
            call add_constraint(constraints, node, before%dof(c), before%master(first:last), &
              before%master_dof(first:last), before%weight(first:last))
          end if
        end associate
      end do
    end associate
  end subroutine turn_lines

  !> What takes changes of a rotation's unknowns to spins.
  pure function spin_of(scene, prescribed, u, rotation, began) result(spin)
    type(scene_t), intent(in) :: scene
    logical, intent(in) :: prescribed(:, :)  !! (3,n_nodes)
    real(wp), intent(in) :: u(:, :)          !! (3,n_nodes) [length]
    integer, intent(in) :: rotation
    real(wp), intent(in), optional :: began(:, :)
    !! (3,n_rotations) where those are turned on from that are free; default: from `u` [length]
    real(wp) :: spin(3, 3)

    associate (of => scene%rotations(rotation))
      spin = spin_matrix([0.0_wp, 0.0_wp, 0.0_wp])
      if (any(prescribed(:, of%rotation_node))) then
        spin = spin_matrix(u(:, of%rotation_node)/of%length)
      else if (present(began)) then
        spin = spin_matrix((u(:, of%rotation_node) - began(:, rotation))/of%length)
      end if
    end associate
  end function spin_of

  !> Put what depends where it is, once its masters are: nodes of turning couplings by the rotation,
  !> all else by its constraint.
  pure subroutine settle_couplings(scene, prescribed, began, u)
    type(scene_t), intent(in) :: scene
    logical, intent(in) :: prescribed(:, :)  !! (3,n_nodes)
    real(wp), intent(in) :: began(:, :)
    !! (3,n_rotations) of rotations that are free, where the increment began [length]
    real(wp), intent(inout) :: u(:, :)       !! (3,n_nodes) [length]
    logical :: goes_along(scene%mesh%n_nodes), moves
    real(wp) :: arm(3), change(3, 3), first(3, 3), here
    integer, allocatable :: nodes(:)
    integer :: i, k, c, round

    if (.not. has_turning(scene)) return
    goes_along = .false.
    allocate (nodes(0))
    associate (x => scene%mesh%coordinates, joints => scene%constraints)
      ! No chain is longer than there are constraints.
      do round = 1, joints%n
        moves = .false.
        do i = 1, size(scene%rotations)
          if (.not. is_turning(scene, i)) cycle
          nodes = nodes_of_grip(scene, i)
          goes_along(nodes) = .true.
          associate (of => scene%rotations(i))
            change = change_of_place(u(:, of%rotation_node)/of%length)
            if (.not. any(prescribed(:, of%rotation_node))) then
              first = change_of_place(began(:, i)/of%length)
              change = change_of_place((u(:, of%rotation_node) - began(:, i))/of%length)
              change = change + first + matmul(change, first)
            end if
            do k = 1, size(nodes)
              arm = x(:, nodes(k)) - x(:, of%node)
              arm = u(:, of%node) + matmul(change, arm)
              moves = moves .or. any(abs(arm - u(:, nodes(k))) > 0.0_wp)
              u(:, nodes(k)) = arm
            end do
          end associate
        end do
        do c = 1, joints%n
          if (goes_along(joints%node(c)) .or. prescribed(joints%dof(c), joints%node(c))) cycle
          here = 0.0_wp
          do k = joints%first(c), joints%first(c + 1) - 1
            here = here + joints%weight(k)*u(joints%master_dof(k), joints%master(k))
          end do
          associate (at => u(joints%dof(c), joints%node(c)))
            moves = moves .or. abs(here - at) > 0.0_wp
            at = here
          end associate
        end do
        if (.not. moves) exit
      end do
    end associate
  end subroutine settle_couplings

  !> As an increment ends: rotation vectors of the whole turn where rotations are free, and what
  !> depends by these.
  pure subroutine end_turns(scene, prescribed, began, u)
    type(scene_t), intent(in) :: scene
    logical, intent(in) :: prescribed(:, :)  !! (3,n_nodes)
    real(wp), intent(in) :: began(:, :)      !! (3,n_rotations) as of settle_couplings
    real(wp), intent(inout) :: u(:, :)       !! (3,n_nodes) [length]
    real(wp) :: ended(3, size(began, 2))
    integer :: i

    if (.not. has_turning(scene)) return
    ended = began
    do i = 1, size(scene%rotations)
      associate (of => scene%rotations(i))
        if (.not. is_turning(scene, i) .or. any(prescribed(:, of%rotation_node))) cycle
        associate (vector => u(:, of%rotation_node))
          vector = of%length*compose_turns(began(:, i)/of%length, (vector - began(:, i))/of%length)
          ended(:, i) = vector
        end associate
      end associate
    end do
    call settle_couplings(scene, prescribed, ended, u)
  end subroutine end_turns

  !> Moments on rotations, which keep their direction in space, as forces on the unknowns.
  pure subroutine turn_moments(scene, prescribed, u, f, began)
    type(scene_t), intent(in) :: scene
    logical, intent(in) :: prescribed(:, :)  !! (3,n_nodes)
    real(wp), intent(in) :: u(:, :)          !! (3,n_nodes) [length]
    real(wp), intent(inout) :: f(:, :)       !! (3,n_nodes) [force]
    real(wp), intent(in), optional :: began(:, :) !! as of spin_of
    integer :: i

    if (.not. has_turning(scene)) return
    do i = 1, size(scene%rotations)
      if (.not. is_turning(scene, i)) cycle
      associate (at => f(:, scene%rotations(i)%rotation_node))
        at = matmul(at, spin_of(scene, prescribed, u, i, began))
      end associate
    end do
  end subroutine turn_moments

  !> What moments of loads and supports do along turns in an increment, beyond what they would along
  !> the change of the rotation vectors. docs/theory.md (8.39).
  pure real(wp) function work_of_turns(scene, from, to, force) result(work)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: from(:, :), to(:, :) !! (3,n_nodes) displacements [length]
    real(wp), intent(in) :: force(:, :)          !! (3,n_nodes) mean of the increment [force]
    integer :: i

    work = 0.0_wp
    if (.not. has_turning(scene)) return
    do i = 1, size(scene%rotations)
      if (.not. is_turning(scene, i)) cycle
      associate (of => scene%rotations(i), node => scene%rotations(i)%rotation_node)
        work = work + dot_product(force(:, node), of%length*turn_between(from(:, node)/of%length, &
          to(:, node)/of%length) - (to(:, node) - from(:, node)))
      end associate
    end do
  end function work_of_turns

  !> What forces on the nodes of a coupling add to the stiffness of its rotation as these turn, in
  !> its unknowns: the symmetric part, or, with `began`, the whole. The other part is half the
  !> moment.
  pure function coupling_stiffness(scene, prescribed, u, f, rotation, began) result(k)
    type(scene_t), intent(in) :: scene
    logical, intent(in) :: prescribed(:, :)  !! (3,n_nodes)
    real(wp), intent(in) :: u(:, :)          !! (3,n_nodes) [length]
    real(wp), intent(in) :: f(:, :)          !! (3,n_nodes) that nodes answer with [force]
    integer, intent(in) :: rotation
    real(wp), intent(in), optional :: began(:, :) !! as of spin_of
    real(wp) :: k(3, 3)                      !! [force/length]
    real(wp) :: arm(3), spin(3, 3), skew
    integer, allocatable :: nodes(:)
    integer :: i, a

    k = 0.0_wp
    skew = merge(0.5_wp, 0.0_wp, present(began))
    allocate (nodes(0))
    nodes = nodes_of_grip(scene, rotation)
    associate (of => scene%rotations(rotation), x => scene%mesh%coordinates)
      do i = 1, size(nodes)
        arm = x(:, nodes(i)) + u(:, nodes(i)) - x(:, of%node) - u(:, of%node)
        associate (force => f(:, nodes(i)))
          do a = 1, 3
            k(:, a) = k(:, a) + (0.5_wp + skew)*arm*force(a) + (0.5_wp - skew)*force*arm(a)
            k(a, a) = k(a, a) - dot_product(arm, force)
          end do
        end associate
      end do
      spin = spin_of(scene, prescribed, u, rotation, began)
      k = matmul(transpose(spin), matmul(k, spin))/of%length**2
    end associate
  end function coupling_stiffness

end module turning_couplings_mod
