!> Motions that contact does not see until normals have turned. docs/theory.md section 9.
module neutral_motions_mod
  use kinds_mod, only: wp
  use dense_mod, only: solve_least_squares
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use rigid_modes_mod, only: free_motions_t, add_motions
  use state_mod, only: state_t
  use placement_mod, only: placement_t, place_curved
  use transfer_mod, only: motion_of_point
  implicit none
  private

  public :: neutral_step, way_to_rest

  real(wp), parameter :: difference = 1.0e-4_wp !! of the size of the mesh

contains

  !> How far the neutral motions go until what turned normals leave on them is 0: a Newton step, the
  !> derivative by a difference. Nothing where normals do not turn.
  function neutral_step(scene, points, motions, neutral, placement, state, residual) result(a)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(free_motions_t), intent(in) :: motions
    real(wp), intent(in) :: neutral(:, :)   !! (n,k) orthonormal [-]
    type(placement_t), intent(in) :: placement !! in which the reactions were found
    type(state_t), intent(in) :: state      !! its reactions, displacement and rotations
    real(wp), intent(in) :: residual(:)     !! (k) what turned normals leave on them [force]
    real(wp) :: a(motions%n)      !! [length]
    real(wp) :: stiffness(size(residual), size(residual)), moved(3, scene%mesh%n_nodes)
    type(placement_t) :: turned
    real(wp) :: local(3), force(3), motion(3), step
    integer :: i, j, k

    step = difference*maxval(maxval(scene%mesh%coordinates, dim=2) - minval( &
      scene%mesh%coordinates, dim=2))
    stiffness = 0.0_wp
    turned = placement
    do k = 1, size(residual)
      moved = state%displacement
      call add_motions(motions, scene%mesh, step*neutral(:, k), moved)
      call place_curved(scene, points, moved, turned, state%rotation)
      do i = 1, points%n
        if (.not. points%is_curved(i) .or. .not. any(abs(state%reaction(:, i)) > 0.0_wp)) cycle
        local = matmul(state%reaction(:, i), placement%frame(:, :, i))
        force = (matmul(turned%frame(:, :, i), local) - state%reaction(:, i))/step
        do j = 1, motions%n
          motion = motion_of_point(scene%mesh, points, turned%weights, motions, i, j)
          ! As normals turn, so may the weights change.
          stiffness(:, k) = stiffness(:, k) - (dot_product(force, motion) + &
            dot_product(state%reaction(:, i), motion - motion_of_point(scene%mesh, points, &
            placement%weights, motions, i, j))/step)*neutral(j, :)
        end do
      end do
    end do
    a = matmul(neutral, solve_least_squares(stiffness, residual))
  end function neutral_step

  !> How far the neutral motions go until bodies are, on the average of their nodes, where they
  !> were: deformed about one pin, a body that is pressed in its middle would no longer lie there.
  function way_to_rest(scene, motions, neutral, moved) result(a)
    type(scene_t), intent(in) :: scene
    type(free_motions_t), intent(in) :: motions
    real(wp), intent(in) :: neutral(:, :)   !! (n,k) orthonormal [-]
    real(wp), intent(in) :: moved(:, :)     !! (3,n_nodes) since bodies were there [length]
    real(wp) :: a(motions%n)                !! [length]
    real(wp) :: field(3, scene%mesh%n_nodes, size(neutral, 2))
    real(wp) :: product(size(neutral, 2), size(neutral, 2)), along(size(neutral, 2))
    integer :: k, l

    field = 0.0_wp
    do k = 1, size(neutral, 2)
      call add_motions(motions, scene%mesh, neutral(:, k), field(:, :, k))
      along(k) = -sum(field(:, :, k)*moved)
      do l = 1, k
        product(k, l) = sum(field(:, :, k)*field(:, :, l))
        product(l, k) = product(k, l)
      end do
    end do
    a = matmul(neutral, solve_least_squares(product, along))
  end function way_to_rest

end module neutral_motions_mod
