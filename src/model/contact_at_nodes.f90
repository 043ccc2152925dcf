!> Nodal contact forces and pressures, from those of the contact points.
module contact_at_nodes_mod
  use kinds_mod, only: wp
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t, add_to_slave
  use state_mod, only: state_t
  use increment_report_mod, only: contact_fields_t, is_redundant_at
  implicit none
  private

  public :: add_contact_forces, add_contact_pressures

contains

  !> Add the forces of contact to those of the nodes: points that share a node add up; nodes of a
  !> master that is a body have the opposite forces.
  pure subroutine add_contact_forces(scene, points, state, contact, forces)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(state_t), intent(in) :: state
    type(contact_fields_t), intent(in) :: contact
    real(wp), intent(inout) :: forces(:, :) !! (3,n_nodes) [force]
    integer :: i, k, ref_node

    do i = 1, points%n
      call add_to_slave(points, contact%weights, i, state%reaction(:, i), forces)
      associate (weights => contact%weights, master => scene%pairs(points%pair(i))%master)
        ref_node = 0
        if (master > 0) ref_node = scene%obstacles(master)%ref_node
        do k = weights%first(i), weights%first(i + 1) - 1
          associate (node => weights%node(k))
            ! What is on an obstacle is its own.
            if (node == ref_node) cycle
            forces(:, node) = forces(:, node) - weights%weight(k)*state%reaction(:, i)
          end associate
        end do
      end associate
    end do
  end subroutine add_contact_forces

  !> Add the normal reactions over the areas of their points to the pressures of the nodes, as far
  !> as they are determined.
  pure subroutine add_contact_pressures(points, contact, pressures, all_points)
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(in) :: contact
    real(wp), intent(inout) :: pressures(:) !! (n_nodes) [force/length^2]
    logical, intent(in) :: all_points !! false: those that are partly covered are left out
    integer :: i

    do i = 1, points%n
      if (contact%is_partly_covered(i) .and. .not. all_points) cycle
      if (is_redundant_at(contact, i)) cycle
      associate (node => points%node(i), area => contact%covered_area(i))
        if (area > 0.0_wp) pressures(node) = pressures(node) + contact%reaction(1, i)/area
      end associate
    end do
  end subroutine add_contact_pressures

end module contact_at_nodes_mod
