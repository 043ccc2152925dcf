!> Surfaces that a *KINEMATIC coupling joins to a reference node along all three axes: at finite
!> strain their nodes go where a turn of any size takes them. Those of grips are prescribed: motion
!> and rotation of the reference node are, in all steps. Those of turning couplings depend on both.
!> docs/theory.md (8.37), (8.38).
module grips_mod
  use kinds_mod, only: wp
  use mesh_mod, only: solids
  use scene_mod, only: scene_t, coupled_rotation_t
  implicit none
  private

  public :: is_grip, nodes_of_grip, gripped_nodes, is_turning, is_turning_mean, is_held_at_0

  real(wp), parameter :: nothing = 1.0e-10_wp !! of the largest in an equation: rounding [-]

contains

  !> Whether a coupled rotation is that of a grip at finite strain: what goes with it goes along all
  !> three axes, and its motion is prescribed in all steps.
  pure logical function is_grip(scene, rotation)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: rotation !! among the scene's

    is_grip = .false.
    if (.not. scene%finite_strain) return
    associate (of => scene%rotations(rotation), joints => scene%constraints)
      if (.not. (is_prescribed(scene, of%node) .and. is_prescribed(scene, of%rotation_node))) return
      if (any(joints%node(:joints%n) == of%node)) return
    end associate
    is_grip = is_rigid(scene, rotation)
  end function is_grip

  !> Whether a coupled rotation is that of a turning coupling at finite strain: what goes with it
  !> goes along all three axes, it is not held at 0 throughout, and it is that of no grip.
  pure logical function is_turning(scene, rotation)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: rotation !! among the scene's

    is_turning = .false.
    if (.not. scene%finite_strain) return
    if (is_held_at_0(scene, scene%rotations(rotation)%rotation_node)) return
    is_turning = is_rigid(scene, rotation) .and. .not. is_grip(scene, rotation)
  end function is_turning

  !> Whether a reference node and its rotation are means over a surface that turns at finite strain,
  !> by a *DISTRIBUTING of all rotations or of none: nothing goes with the rotation, and all is
  !> along x, y, z.
  pure logical function is_turning_mean(scene, rotation) result(is_mean)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: rotation !! among the scene's
    integer :: c

    is_mean = .false.
    if (.not. scene%finite_strain) return
    associate (of => scene%rotations(rotation), joints => scene%constraints)
      if (.not. allocated(of%surface_nodes)) return
      if (scene%mesh%plane == solids .and. any(of%is_mean(4:) .neqv. of%is_mean(4))) return
      if (has_local_axes(scene, of)) return
      do c = 1, joints%n
        if (any(joints%master(joints%first(c):joints%first(c + 1) - 1) == of%rotation_node)) return
      end do
    end associate
    is_mean = .true.
  end function is_turning_mean

  !> Whether the displacement or the rotation of a reference node is along local directions.
  pure logical function has_local_axes(scene, of) result(has)
    type(scene_t), intent(in) :: scene
    type(coupled_rotation_t), intent(in) :: of

    has = .false.
    if (allocated(scene%local_axes)) has = any(scene%local_axes%node == of%node .or. &
      scene%local_axes%node == of%rotation_node)
  end function has_local_axes

  !> Whether all that depends on a rotation goes with it along all three axes, and the rotation
  !> depends on nothing.
  pure logical function is_rigid(scene, rotation)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: rotation !! among the scene's
    integer :: c

    is_rigid = .false.
    associate (of => scene%rotations(rotation), joints => scene%constraints, lines => &
               lines_of_grip(scene, rotation))
      if (has_local_axes(scene, of)) return
      do c = 1, joints%n
        if (joints%node(c) == of%rotation_node) return
        if (any(joints%master(joints%first(c):joints%first(c + 1) - 1) == of%rotation_node) .and. &
          lines(joints%node(c)) /= 3) return
      end do
      is_rigid = any(lines == 3)
    end associate
  end function is_rigid

  !> Whether a constraint says u = u_ref + theta x (X - X_ref), along one axis.
  pure logical function goes_with(scene, c, rotation)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: c        !! constraint
    integer, intent(in) :: rotation !! among the scene's
    real(wp) :: arm(3), by_rotation(3), expected(3)
    integer :: k

    associate (of => scene%rotations(rotation), joints => scene%constraints, x => &
               scene%mesh%coordinates)
      goes_with = .false.
      by_rotation = 0.0_wp
      do k = joints%first(c), joints%first(c + 1) - 1
        if (joints%master(k) == of%rotation_node) then
          by_rotation(joints%master_dof(k)) = joints%weight(k)
        else if (joints%master(k) /= of%node .or. joints%master_dof(k) /= joints%dof(c) .or. &
          abs(joints%weight(k) - 1.0_wp) > nothing) then
          return
        else
          goes_with = .true.
        end if
      end do
      arm = x(:, joints%node(c)) - x(:, of%node)
      select case (joints%dof(c))
      case (1)
        expected = [0.0_wp, arm(3), -arm(2)]
      case (2)
        expected = [-arm(3), 0.0_wp, arm(1)]
      case default
        expected = [arm(2), -arm(1), 0.0_wp]
      end select
      goes_with = goes_with .and. all(abs(by_rotation*of%length - expected) <= &
        nothing*maxval(abs(x)))
    end associate
  end function goes_with

  !> Whether all steps prescribe the motion of a node.
  pure logical function is_prescribed(scene, node)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: node
    logical :: held(3)
    integer :: k, i

    held = .false.
    is_prescribed = size(scene%steps) > 0
    do k = 1, size(scene%steps)
      if (scene%steps(k)%replace_boundary) held = .false.
      do i = 1, size(scene%steps(k)%boundary)
        associate (b => scene%steps(k)%boundary(i))
          if (b%node == node) held(b%dof) = .true.
        end associate
      end do
      is_prescribed = is_prescribed .and. all(held)
    end do
  end function is_prescribed

  !> Whether all steps hold a node at 0.
  pure logical function is_held_at_0(scene, node) result(is_held)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: node
    integer :: k

    is_held = is_prescribed(scene, node) .or. size(scene%steps) == 0
    do k = 1, size(scene%steps)
      associate (b => scene%steps(k)%boundary)
        is_held = is_held .and. .not. any(b%node == node .and. abs(b%value) > 0.0_wp)
      end associate
    end do
  end function is_held_at_0

  !> Along how many axes each node goes with a reference node and its rotation.
  pure function lines_of_grip(scene, rotation) result(lines)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: rotation   !! among the scene's
    integer :: lines(scene%mesh%n_nodes)
    integer :: c

    lines = 0
    do c = 1, scene%constraints%n
      associate (line => lines(scene%constraints%node(c)))
        if (goes_with(scene, c, rotation)) line = line + 1
      end associate
    end do
  end function lines_of_grip

  !> The nodes that a grip takes along, at the reference node too.
  pure function nodes_of_grip(scene, rotation) result(nodes)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: rotation   !! of a grip, among the scene's
    integer, allocatable :: nodes(:)
    integer :: node

    associate (lines => lines_of_grip(scene, rotation))
      nodes = pack([(node, node=1, size(lines))], lines == 3)
    end associate
  end function nodes_of_grip

  !> Which nodes grips take along.
  pure function gripped_nodes(scene) result(gripped)
    type(scene_t), intent(in) :: scene
    logical :: gripped(scene%mesh%n_nodes)
    integer :: i

    gripped = .false.
    if (.not. scene%finite_strain .or. .not. allocated(scene%rotations)) return
    do i = 1, size(scene%rotations)
      if (is_grip(scene, i)) gripped(nodes_of_grip(scene, i)) = .true.
    end do
  end function gripped_nodes

end module grips_mod
