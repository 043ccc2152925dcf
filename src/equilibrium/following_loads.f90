!> Loads that follow bodies.
module following_loads_mod
  use kinds_mod, only: wp
  use scene_mod, only: scene_t
  use mesh_forces_mod, only: pressure_force, gravity_force
  use increment_forces_mod, only: imposed_t
  implicit none
  private

  public :: let_loads_follow

contains

  !> The loads of bodies that are displaced further, where loads follow bodies: pressures go with
  !> their surfaces, and what turns about an axis is where its distance from this is now.
  !> docs/theory.md (8.30), (8.40).
  pure subroutine let_loads_follow(scene, u, imposed)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: u(:, :)              !! (3,n_nodes) [length]
    type(imposed_t), intent(inout) :: imposed    !! gets external
    integer :: i

    if (.not. allocated(imposed%dead_load)) return
    imposed%external = imposed%dead_load
    associate (following => imposed%following)
      do i = 1, size(scene%surfaces)
        if (abs(following%pressure(i)) > 0.0_wp) call pressure_force(scene%mesh, &
          scene%surfaces(i), following%pressure(i), imposed%external, u)
      end do
      do i = 1, size(scene%regions)
        if (any(abs(following%gradient(:, :, i)) > 0.0_wp)) call gravity_force(scene%mesh, &
          scene%materials%density, scene%regions(i)%elements, [0.0_wp, 0.0_wp, 0.0_wp], &
          following%gradient(:, :, i), u, imposed%external)
      end do
    end associate
  end subroutine let_loads_follow

end module following_loads_mod
