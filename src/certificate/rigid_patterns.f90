!> What the certificate knows of couplings that turn at finite strain: whether their nodes are where
!> the rotation takes them, what moments forces on these have, and which turns supports leave.
!>
!> Rotations are its own, by quaternions. Which nodes belong to a coupling is read off the scene's
!> constraints. docs/theory.md (8.38).
module rigid_patterns_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: cross
  use constraints_mod, only: constraints_t, add_constraint
  use grips_mod, only: is_turning
  use scene_mod, only: scene_t
  use error_measures_mod, only: ratio, rounded
  implicit none
  private

  public :: rigid_patterns_t, find_patterns, take_moments, broken, along_free_turns

  !> Of each coupling: its reference node, the node of its rotation with the length that makes this
  !> a displacement, and its nodes.
  type :: rigid_patterns_t
    integer :: n = 0
    integer,  allocatable :: node(:), rotation_node(:) !! (n)
    real(wp), allocatable :: length(:)                 !! (n)
    integer,  allocatable :: of_node(:)                !! (n_nodes) coupling that takes it along; 0
  end type rigid_patterns_t

contains

  !> The couplings that turn.
  pure type(rigid_patterns_t) function find_patterns(scene) result(patterns)
    type(scene_t), intent(in) :: scene
    integer :: i, c

    allocate (patterns%of_node(scene%mesh%n_nodes), source=0)
    allocate (patterns%node(0), patterns%rotation_node(0), patterns%length(0))
    if (.not. scene%finite_strain .or. .not. allocated(scene%rotations)) return
    associate (all => scene%constraints)
      do i = 1, size(scene%rotations)
        if (.not. is_turning(scene, i)) cycle
        patterns%n = patterns%n + 1
        patterns%node = [patterns%node, scene%rotations(i)%node]
        patterns%rotation_node = [patterns%rotation_node, scene%rotations(i)%rotation_node]
        patterns%length = [patterns%length, scene%rotations(i)%length]
        do c = 1, all%n
          if (any(all%master(all%first(c):all%first(c + 1) - 1) == scene%rotations( &
            i)%rotation_node)) patterns%of_node(all%node(c)) = patterns%n
        end do
      end do
    end associate
  end function find_patterns

  !> Put in the place of the couplings' constraints, which are those of small rotations, that a
  !> force on one of their nodes is one on the reference node, and a moment about where that is.
  pure subroutine take_moments(patterns, x, constraints)
    type(rigid_patterns_t), intent(in) :: patterns
    real(wp), intent(in) :: x(:, :)  !! (3,n_nodes) where nodes are [length]
    type(constraints_t), intent(inout) :: constraints
    type(constraints_t) :: before
    real(wp) :: axis(3)
    integer :: c

    if (patterns%n == 0) return
    before = constraints
    constraints = constraints_t(n_equations=before%n_equations)
    do c = 1, before%n
      associate (node => before%node(c), p => patterns%of_node(before%node(c)), first => &
                 before%first(c), last => before%first(c + 1) - 1)
        if (p == 0) then
          call add_constraint(constraints, node, before%dof(c), before%master(first:last), &
            before%master_dof(first:last), before%weight(first:last))
          cycle
        end if
        axis = 0.0_wp
        axis(before%dof(c)) = 1.0_wp
        associate (ref => patterns%node(p), turned => patterns%rotation_node(p))
          call add_constraint(constraints, node, before%dof(c), [ref, turned, turned, turned], &
            [before%dof(c), 1, 2, 3], [1.0_wp, cross(x(:, node) - x(:, ref), axis)/ &
            patterns%length(p)])
        end associate
      end associate
    end do
  end subroutine take_moments

  !> How far nodes are from where the rotation takes them, less what rounding makes of that, beside
  !> the size of the mesh.
  pure real(wp) function broken(patterns, x, u, prescribed)
    type(rigid_patterns_t), intent(in) :: patterns
    real(wp), intent(in) :: x(:, :)  !! (3,n_nodes) undeformed [length]
    real(wp), intent(in) :: u(:, :)  !! (3,n_nodes) [length]
    logical, intent(in) :: prescribed(:, :) !! (3,n_nodes) by supports, which come first
    real(wp) :: q(0:3), arm(3), off(3), size_of_mesh
    integer :: i

    broken = 0.0_wp
    if (patterns%n == 0) return
    size_of_mesh = maxval(maxval(x, dim=2) - minval(x, dim=2))
    do i = 1, size(x, 2)
      associate (p => patterns%of_node(i))
        if (p == 0) cycle
        associate (ref => patterns%node(p), theta => u(:, patterns%rotation_node(p))/ &
                   patterns%length(p))
          q = quaternion(theta)
          arm = x(:, i) - x(:, ref)
          off = u(:, i) - u(:, ref) - 2.0_wp*cross(q(1:), q(0)*arm + cross(q(1:), arm))
          where (prescribed(:, i)) off = 0.0_wp
          broken = max(broken, ratio(norm2(off) - rounded*((1.0_wp + norm2(theta))*norm2(arm) + &
            norm2(u(:, ref))), size_of_mesh))
        end associate
      end associate
    end do
  end function broken

  !> Moments that are left on the rotations, along the turns that supports leave: all where they
  !> hold no component of the rotation vector; else what the others turn the nodes by.
  pure subroutine along_free_turns(patterns, u, prescribed, residual)
    type(rigid_patterns_t), intent(in) :: patterns
    real(wp), intent(in) :: u(:, :)           !! (3,n_nodes) [length]
    logical, intent(in) :: prescribed(:, :)   !! (3,n_nodes)
    real(wp), intent(inout) :: residual(:, :) !! (3,n_nodes) [force]
    real(wp) :: along(3)
    integer :: p, i

    do p = 1, patterns%n
      associate (node => patterns%rotation_node(p))
        if (.not. any(prescribed(:, node))) cycle
        do i = 1, 3
          along(i) = dot_product(spin_along(u(:, node)/patterns%length(p), i), residual(:, node))
        end do
        residual(:, node) = along
      end associate
    end do
  end subroutine along_free_turns

  !> The spin as one component of a rotation vector grows, 2 dq q*, in closed form.
  pure function spin_along(theta, i) result(spin)
    real(wp), intent(in) :: theta(3)  !! [rad]
    integer, intent(in) :: i
    real(wp) :: spin(3)
    real(wp) :: q(0:3), dq(0:3), angle, slope

    angle = norm2(theta)
    q = quaternion(theta)
    ! q = (cos(t/2), s theta) with s = sin(t/2)/t; slope = s'/t.
    slope = -1.0_wp/24.0_wp + angle**2/960.0_wp - angle**4/107520.0_wp
    if (angle > 1.0e-2_wp) slope = (0.5_wp*cos(0.5_wp*angle) - sin(0.5_wp*angle)/angle)/angle**2
    dq(0) = -0.5_wp*q(i)
    dq(1:) = slope*theta(i)*theta
    dq(i) = dq(i) + half_sine(angle)
    spin = 2.0_wp*(q(0)*dq(1:) - dq(0)*q(1:) - cross(dq(1:), q(1:)))
  end function spin_along

  pure function quaternion(theta) result(q)
    real(wp), intent(in) :: theta(3)  !! [rad]
    real(wp) :: q(0:3)

    q(0) = cos(0.5_wp*norm2(theta))
    q(1:) = half_sine(norm2(theta))*theta
  end function quaternion

  !> sin(t/2)/t.
  pure real(wp) function half_sine(angle)
    real(wp), intent(in) :: angle !! [rad]

    half_sine = 0.5_wp
    if (angle > 0.0_wp) half_sine = sin(0.5_wp*angle)/angle
  end function half_sine

end module rigid_patterns_mod
