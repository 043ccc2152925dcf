!> What forces on the nodes of turning couplings add to the tangent as these turn.
module stiffen_couplings_mod
  use kinds_mod, only: wp
  use scene_mod, only: scene_t
  use grips_mod, only: is_turning
  use turning_couplings_mod, only: coupling_stiffness
  use dof_map_mod, only: dof_map_t, equations_of
  use assembly_mod, only: triplets_t
  implicit none
  private

  public :: stiffen_couplings

contains

  !> Add a share of (8.38)'s stiffness to the lower triangle. The entries are there: nodes of a
  !> coupling depend on all components of its rotation.
  pure subroutine stiffen_couplings(scene, prescribed, u, f, share, map, k)
    type(scene_t), intent(in) :: scene
    logical, intent(in) :: prescribed(:, :)  !! (3,n_nodes)
    real(wp), intent(in) :: u(:, :)          !! (3,n_nodes) displacement [length]
    real(wp), intent(in) :: f(:, :)          !! (3,n_nodes) that nodes answer with [force]
    real(wp), intent(in) :: share            !! [-]
    type(dof_map_t), intent(in) :: map
    type(triplets_t), intent(inout) :: k
    real(wp) :: added(3, 3)
    integer :: equations(3), i, p, q, entry

    do i = 1, size(scene%rotations)
      if (.not. is_turning(scene, i)) cycle
      added = share*coupling_stiffness(scene, prescribed, u, f, i)
      equations = equations_of(map, scene%rotations(i)%rotation_node)
      do p = 1, 3
        do q = 1, 3
          if (equations(p) == 0 .or. equations(q) == 0 .or. equations(q) > equations(p)) cycle
          entry = findloc(k%row == equations(p) .and. k%column == equations(q), .true., dim=1)
          if (entry > 0) k%value(entry) = k%value(entry) + added(p, q)
        end do
      end do
    end do
  end subroutine stiffen_couplings

end module stiffen_couplings_mod
