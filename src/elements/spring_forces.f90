!> What the springs of a mesh add to the forces of its nodes, to their tangent and to the energy.
module spring_forces_mod
  use kinds_mod, only: wp
  use mesh_mod, only: mesh_t
  use spring_elements_mod, only: spring_state_t, spring_state, spring_ends
  implicit none
  private

  public :: add_spring_forces, add_spring_rounding, spring_energy, spring_tangent, &
    add_tangent_forces

contains

  !> Add the forces with which springs resist displacements.
  pure subroutine add_spring_forces(mesh, u, is_finite, f)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: u(:, :)     !! (3,n_nodes) [length]
    logical, intent(in) :: is_finite    !! strain
    real(wp), intent(inout) :: f(:, :)  !! (3,n_nodes) [force]
    type(spring_state_t) :: state
    integer :: s, k

    do s = 1, mesh%springs%n
      state = spring_state(mesh%springs, s, mesh%coordinates, u, is_finite)
      associate (ends => spring_ends(mesh%springs, s))
        do k = 1, size(ends)
          f(:, ends(k)) = f(:, ends(k)) + state%pull*state%direction(:, k)
        end do
      end associate
    end do
  end subroutine add_spring_forces

  !> Add what the last bits of displacements make of these forces, docs/theory.md (6.2).
  pure subroutine add_spring_rounding(mesh, u, operations, rounding)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: u(:, :)           !! (3,n_nodes) [length]
    real(wp), intent(in) :: operations        !! rounded ones that add up in a nodal force
    real(wp), intent(inout) :: rounding(:)    !! (n_nodes) [force]
    type(spring_state_t) :: state
    integer :: s

    do s = 1, mesh%springs%n
      state = spring_state(mesh%springs, s, mesh%coordinates, u, .false.)
      associate (ends => spring_ends(mesh%springs, s))
        rounding(ends) = rounding(ends) + operations*epsilon(1.0_wp)*state%stiffness* &
          sum(state%direction**2)*maxval(abs(u(:, ends)))
      end associate
    end do
  end subroutine add_spring_rounding

  !> The energy of all springs.
  pure real(wp) function spring_energy(mesh, u, is_finite) result(energy)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: u(:, :)   !! (3,n_nodes) [length]
    logical, intent(in) :: is_finite  !! strain
    type(spring_state_t) :: state
    integer :: s

    energy = 0.0_wp
    do s = 1, mesh%springs%n
      state = spring_state(mesh%springs, s, mesh%coordinates, u, is_finite)
      energy = energy + state%energy
    end do
  end function spring_energy

  !> The tangent of a spring: k b b^T, and of an axial one that turns also N (I - b b^T)/l between
  !> its ends. `projection` of what is negative is left out.
  pure function spring_tangent(mesh, s, u, is_finite, projection) result(k)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: s
    real(wp), intent(in) :: u(:, :)       !! (3,n_nodes) [length]
    logical, intent(in) :: is_finite      !! strain
    real(wp), intent(in) :: projection    !! [-]
    real(wp), allocatable :: k(:, :)      !! node by node, x y z [force/length]
    type(spring_state_t) :: state
    real(wp), allocatable :: b(:)
    real(wp) :: across(3, 3), turning
    integer :: n, i

    state = spring_state(mesh%springs, s, mesh%coordinates, u, is_finite)
    n = size(state%direction)
    b = reshape(state%direction, [n])
    if (state%stiffness < 0.0_wp) state%stiffness = (1.0_wp - projection)*state%stiffness
    allocate (k(n, n), source=state%stiffness*spread(b, 2, n)*spread(b, 1, n))
    if (.not. state%length > 0.0_wp) return
    turning = state%pull/state%length
    if (turning < 0.0_wp) turning = (1.0_wp - projection)*turning
    across = -turning*spread(b(:3), 2, 3)*spread(b(:3), 1, 3)
    do i = 1, 3
      across(i, i) = across(i, i) + turning
    end do
    k(:3, :3) = k(:3, :3) + across
    k(4:, 4:) = k(4:, 4:) + across
    k(4:, :3) = k(4:, :3) - across
    k(:3, 4:) = k(:3, 4:) - across
  end function spring_tangent

  !> Add what several displacements change the forces of springs by, by the tangents of another one.
  pure subroutine add_tangent_forces(mesh, at, projection, u, f)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: at(:, :)       !! (3,n_nodes) where tangents are taken [length]
    real(wp), intent(in) :: projection     !! as of spring_tangent [-]
    real(wp), intent(in) :: u(:, :, :)     !! (3,n_nodes,n) of several displacements [length]
    real(wp), intent(inout) :: f(:, :, :)  !! (3,n_nodes,n) [force]
    integer :: s, g

    do s = 1, mesh%springs%n
      associate (ends => spring_ends(mesh%springs, s), &
                 k => spring_tangent(mesh, s, at, .true., projection))
        do g = 1, size(u, 3)
          f(:, ends, g) = f(:, ends, g) + reshape(matmul(k, reshape(u(:, ends, g), &
            [size(k, 1)])), [3, size(ends)])
        end do
      end associate
    end do
  end subroutine add_tangent_forces

end module spring_forces_mod
