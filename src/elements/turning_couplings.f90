!> What the nodes of couplings do that turn at finite strain, and what these make of forces.
!>
!>     x_i = x_ref + R (X_i - X_ref),    du_i = du_ref + (S dtheta) x a_i,    a_i = x_i - x_ref
!>
!> theta is the rotation vector of the reference node, R its matrix. Where a *STEP prescribes any of
!> its components they are those of the deck, and S is what takes changes of theta to spins. Where
!> all three are free the unknowns are spins, S = 1, and R is the rotation at the beginning of the
!> increment, turned further: no angle is singular. docs/theory.md (8.38).
!>
!> Reference nodes of *DISTRIBUTING go where the mean and the best rotation of their surface take
!> them; their lines are spins, as of rotations that are free. docs/theory.md (8.47).
module turning_couplings_mod
  use kinds_mod, only: wp
  use rotations_mod, only: best_turn, change_of_place, rotation_matrix, spin_matrix, turn_between, &
    compose_turns
  use small_matrix_mod, only: cross, determinant, inverse
  use constraints_mod, only: constraints_t, add_constraint
  use scene_mod, only: scene_t
  use grips_mod, only: is_turning, is_turning_mean, nodes_of_grip
  implicit none
  private

  public :: has_turning, has_turning_unknowns, turned_constraints, settle_couplings, end_turns
  public :: turn_moments, moments_on_constraints, work_of_turns, coupling_stiffness, mean_stiffness

  real(wp), parameter :: in_the_middle = 1.0e-10_wp !! of the farthest node: rounding of an arm [-]

  !> The surface of a *DISTRIBUTING as it is.
  type :: mean_t
    real(wp) :: vector(3)               !! of its rotation R [rad]
    real(wp) :: arm(3)                  !! R (X_ref - X_m) [length]
    real(wp), allocatable :: moment(:, :) !! (3,n) R m_i [length]
    real(wp) :: middle(3)               !! displacement of the middle [length]
    real(wp) :: by_moment(3, 3)         !! spin by the moment of displacements [1/length^2]
  end type mean_t

contains

  !> Whether the scene has couplings that turn at finite strain.
  pure logical function has_turning(scene)
    type(scene_t), intent(in) :: scene
    integer :: i

    has_turning = .false.
    if (.not. scene%finite_strain .or. .not. allocated(scene%rotations)) return
    has_turning = has_turning_unknowns(scene)
    do i = 1, size(scene%rotations)
      has_turning = has_turning .or. is_turning_mean(scene, i)
    end do
  end function has_turning

  !> Whether rotations of such couplings are unknowns: means over surfaces are none.
  pure logical function has_turning_unknowns(scene) result(has)
    type(scene_t), intent(in) :: scene
    integer :: i

    has = .false.
    if (.not. scene%finite_strain .or. .not. allocated(scene%rotations)) return
    do i = 1, size(scene%rotations)
      has = has .or. is_turning(scene, i)
    end do
  end function has_turning_unknowns

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
      if (is_turning_mean(scene, i)) call turn_mean(scene, i, u, turned)
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

  !> Put the lines of a mean about displaced places; as they are if its surface has become a line.
  pure subroutine turn_mean(scene, rotation, u, constraints)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: rotation
    real(wp), intent(in) :: u(:, :)          !! (3,n_nodes) [length]
    type(constraints_t), intent(inout) :: constraints
    type(constraints_t) :: before
    type(mean_t) :: mean
    real(wp), allocatable :: spin(:, :, :), moved(:, :, :) !! (3,3,n) by node and axis
    real(wp) :: axis(3)
    integer, allocatable :: nodes(:), dofs(:)
    integer :: c, i, a, n
    logical :: is_known

    associate (of => scene%rotations(rotation))
      call find_mean(scene, rotation, u, u(:, of%rotation_node)/of%length, mean, is_known)
      if (.not. is_known) return
      n = size(of%surface_nodes)
      allocate (spin(3, 3, n), moved(3, 3, n))
      do i = 1, n
        do a = 1, 3
          axis = 0.0_wp
          axis(a) = 1.0_wp
          spin(:, a, i) = matmul(mean%by_moment, cross(mean%moment(:, i), axis))
          moved(:, a, i) = of%share(i)*axis + cross(spin(:, a, i), mean%arm)
        end do
      end do
      nodes = reshape(spread(of%surface_nodes, 1, 3), [3*n])
      dofs = [(modulo(i, 3) + 1, i=0, 3*n - 1)]
      before = constraints
      constraints = constraints_t(n_equations=before%n_equations)
      do c = 1, before%n
        associate (node => before%node(c), dof => before%dof(c), first => before%first(c), &
                   last => before%first(c + 1) - 1)
          if (node == of%node .and. of%is_mean(dof)) then
            call add_constraint(constraints, node, dof, nodes, dofs, reshape(moved(dof, :, :), &
              [3*n]))
          else if (node == of%rotation_node .and. of%is_mean(3 + dof)) then
            call add_constraint(constraints, node, dof, nodes, dofs, of%length*reshape( &
              spin(dof, :, :), [3*n]))
          else
            call add_constraint(constraints, node, dof, before%master(first:last), &
              before%master_dof(first:last), before%weight(first:last))
          end if
        end associate
      end do
    end associate
  end subroutine turn_mean

  !> Where a mean and its rotation are. docs/theory.md (8.47).
  pure subroutine find_mean(scene, rotation, u, near, mean, is_known)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: rotation
    real(wp), intent(in) :: u(:, :)          !! (3,n_nodes) [length]
    real(wp), intent(in) :: near(3)          !! a rotation vector that its own is near to [rad]
    type(mean_t), intent(out) :: mean
    logical, intent(out) :: is_known         !! false: the surface has become a line
    real(wp) :: inertia(3, 3), middle(3), turn(3, 3)
    real(wp), allocatable :: place(:, :)     !! (3,n) from the middle [length]
    integer :: i, k

    associate (of => scene%rotations(rotation), x => scene%mesh%coordinates)
      middle = matmul(x(:, of%surface_nodes), of%share)
      mean%middle = matmul(u(:, of%surface_nodes), of%share)
      place = x(:, of%surface_nodes) + u(:, of%surface_nodes)
      do i = 1, size(place, 2)
        place(:, i) = place(:, i) - middle - mean%middle
      end do
      mean%vector = best_turn(of%moment, place, near)
      turn = rotation_matrix(mean%vector)
      mean%moment = matmul(turn, of%moment)
      mean%arm = matmul(turn, x(:, of%node) - middle)
    end associate
    inertia = -matmul(mean%moment, transpose(place))
    do i = 1, 3
      inertia(i, i) = inertia(i, i) + sum([(dot_product(mean%moment(:, k), place(:, k)), k=1, &
        size(place, 2))])
    end do
    is_known = abs(determinant(inertia)) > epsilon(1.0_wp)*maxval(abs(inertia))**3
    if (is_known) mean%by_moment = inverse(inertia)
  end subroutine find_mean

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
    logical :: is_placed(3, scene%mesh%n_nodes), moves
    real(wp) :: arm(3), change(3, 3), first(3, 3), here
    integer, allocatable :: nodes(:)
    integer :: i, k, c, round

    if (.not. has_turning(scene)) return
    is_placed = .false.
    allocate (nodes(0))
    associate (x => scene%mesh%coordinates, joints => scene%constraints)
      ! No chain is longer than there are constraints.
      do round = 1, joints%n
        moves = .false.
        do i = 1, size(scene%rotations)
          if (is_turning_mean(scene, i)) call place_mean(scene, i, began(:, i), u, is_placed, moves)
          if (.not. is_turning(scene, i)) cycle
          nodes = nodes_of_grip(scene, i)
          is_placed(:, nodes) = .true.
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
          if (is_placed(joints%dof(c), joints%node(c)) .or. prescribed(joints%dof(c), &
            joints%node(c))) cycle
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

  !> Put a mean where its surface has it.
  pure subroutine place_mean(scene, rotation, began, u, is_placed, moves)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: rotation
    real(wp), intent(in) :: began(3)                 !! its rotation as the increment began [length]
    real(wp), intent(inout) :: u(:, :)               !! (3,n_nodes) [length]
    logical, intent(inout) :: is_placed(:, :), moves !! (3,n_nodes); whether it is elsewhere now
    type(mean_t) :: mean
    real(wp) :: here(3, 2)
    integer :: node(2), k
    logical :: is_known

    associate (of => scene%rotations(rotation), x => scene%mesh%coordinates)
      call find_mean(scene, rotation, u, began/of%length, mean, is_known)
      here(:, 1) = mean%middle + matmul(change_of_place(mean%vector), x(:, of%node) - &
        matmul(x(:, of%surface_nodes), of%share))
      here(:, 2) = of%length*mean%vector
      node = [of%node, of%rotation_node]
      do k = 1, 2
        associate (is_mean => of%is_mean(3*k - 2:3*k), at => u(:, node(k)))
          moves = moves .or. any(is_mean .and. abs(here(:, k) - at) > 0.0_wp)
          where (is_mean) at = here(:, k)
          is_placed(:, node(k)) = is_placed(:, node(k)) .or. is_mean
        end associate
      end do
    end associate
  end subroutine place_mean

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
      if (.not. (is_turning(scene, i) .or. is_turning_mean(scene, i))) cycle
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

  !> What the forces on the nodes of a surface, of a force and a moment on its mean, change by as
  !> the surface turns and strains: -df/du, symmetric without a moment. docs/theory.md (8.47).
  pure function mean_stiffness(scene, rotation, u, f) result(k)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: rotation          !! of a mean, among the scene's
    real(wp), intent(in) :: u(:, :)          !! (3,n_nodes) [length]
    real(wp), intent(in) :: f(:, :)          !! (3,n_nodes) that acts on nodes [force]
    real(wp), allocatable :: k(:, :)         !! (3n,3n); (0,0) where it is 0 [force/length]
    type(mean_t) :: mean
    real(wp), dimension(3) :: p, axis, spin, change, strained
    integer :: i, j, a
    logical :: is_known, has_moment

    allocate (k(0, 0))
    associate (of => scene%rotations(rotation))
      call find_mean(scene, rotation, u, u(:, of%rotation_node)/of%length, mean, is_known)
      if (.not. is_known) return
      p = matmul(mean%by_moment, of%length*f(:, of%rotation_node) + cross(mean%arm, f(:, of%node)))
      has_moment = any(abs(f(:, of%rotation_node)) > 0.0_wp)
      if (.not. has_moment .and. norm2(mean%arm) <= in_the_middle*of%length) return
      ! sum m_i (y_i . p): the middle has no part in it, for sum m_i = 0
      strained = 0.0_wp
      do i = 1, size(of%surface_nodes)
        associate (node => of%surface_nodes(i), x => scene%mesh%coordinates)
          strained = strained + mean%moment(:, i)*dot_product(x(:, node) + u(:, node), p)
        end associate
      end do
      deallocate (k)
      allocate (k(3*size(of%surface_nodes), 3*size(of%surface_nodes)))
      do j = 1, size(of%surface_nodes)
        do a = 1, 3
          axis = 0.0_wp
          axis(a) = 1.0_wp
          spin = matmul(mean%by_moment, cross(mean%moment(:, j), axis))
          change = matmul(mean%by_moment, cross(cross(spin, mean%arm), f(:, of%node)) + &
            cross(spin, strained) + mean%moment(:, j)*p(a) - p*mean%moment(a, j))
          do i = 1, size(of%surface_nodes)
            k(3*i - 2:3*i, 3*j - 3 + a) = -cross(change, mean%moment(:, i)) - cross(p, cross(spin, &
              mean%moment(:, i)))
          end do
        end do
      end do
    end associate
    ! A force has an energy, -F . u_ref: what is not symmetric is rounding.
    if (.not. has_moment) k = 0.5_wp*(k + transpose(k))
  end function mean_stiffness

end module turning_couplings_mod
