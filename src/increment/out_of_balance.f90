!> The forces that are out of balance at the nodes, and which of them reactions take.
module out_of_balance_mod
  use kinds_mod, only: wp
  use constraints_mod, only: constraints_t, active_constraints
  use mesh_mod, only: mesh_t
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t, law_at
  use friction_laws_mod, only: bound_friction
  use turning_couplings_mod, only: turned_constraints, turn_moments
  use placement_mod, only: placement_t
  use force_balance_mod, only: out_of_balance
  use trial_mod, only: trial_t
  use place_and_solve_mod, only: newton_raphson_t
  implicit none
  private

  public :: find_residual, leave_to_reactions

contains

  !> What is out of balance, as of `out_of_balance`, by the constraints where the bodies are.
  subroutine find_residual(scene, active, pressed, u, trial, closely, residual, loop)
    type(scene_t), intent(in) :: scene
    type(constraints_t), intent(in) :: active !! those of the factor, chains substituted
    real(wp), intent(in) :: pressed(:, :)     !! (3,n_nodes) by contact [force]
    real(wp), intent(in) :: u(:, :)           !! (3,n_nodes) [length]
    type(trial_t), intent(in) :: trial        !! its forces
    logical, intent(in) :: closely            !! as of `out_of_balance`
    real(wp), intent(out) :: residual(:, :)   !! (3,n_nodes) [force]
    type(newton_raphson_t), intent(inout) :: loop !! gets its imbalance, and what is left
    type(constraints_t) :: here

    associate (forces => trial%forces)
      here = active
      residual = forces%external
      if (allocated(trial%turned_from)) then
        here = active_constraints(turned_constraints(scene, forces%prescribed, u), &
          forces%prescribed)
        call turn_moments(scene, forces%prescribed, u, residual)
      end if
      residual = residual + pressed - forces%internal
      call out_of_balance(scene%mesh, here, forces, closely, residual, loop%imbalance, loop%left)
    end associate
  end subroutine find_residual

  !> Leave what displacements cannot balance any closer to the reactions at the same nodes, where
  !> these press a fixed obstacle and do not slide: internal forces of displacements that are what
  !> they should be are known better than reactions from a compliance.
  pure subroutine leave_to_reactions(mesh, points, placement, residual, reaction)
    type(mesh_t), intent(in) :: mesh
    type(contact_points_t), intent(in) :: points
    type(placement_t), intent(in) :: placement
    real(wp), intent(in) :: residual(:, :)       !! (3,n_nodes) [force]
    real(wp), intent(inout) :: reaction(:, :)    !! (3,n_points) x, y, z [force]
    real(wp) :: r(3), part(3), bound, slope
    integer :: i, n_pressed(mesh%n_nodes)

    if (allocated(points%alpha)) return ! forces on edges are of several points
    n_pressed = 0
    do i = 1, points%n
      if (any(abs(reaction(:, i)) > 0.0_wp)) n_pressed(points%node(i)) = n_pressed(points%node(i)) &
        + 1
    end do
    do i = 1, points%n
      if (points%on_surface(i) .or. n_pressed(points%node(i)) /= 1) cycle
      r = matmul(reaction(:, i), placement%frame(:, :, i))
      part = matmul(residual(:, points%node(i)), placement%frame(:, :, i))
      if (points%mu(i) <= 0.0_wp) part(2:) = 0.0_wp
      r = r - part
      call bound_friction(law_at(points, i, placement%covered_area(i)), r(1), bound, slope)
      if (.not. r(1) > 0.0_wp .or. norm2(r(2:)) > points%mu(i)*bound) cycle
      reaction(:, i) = matmul(placement%frame(:, :, i), r)
    end do
  end subroutine leave_to_reactions

end module out_of_balance_mod
