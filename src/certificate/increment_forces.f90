!> The forces of an increment: what is imposed on it, and what its stresses answer.
module increment_forces_mod
  use kinds_mod, only: wp
  use constraints_mod, only: constraints_t
  use loads_mod, only: following_t
  use edge_middles_mod, only: edge_middles_t
  use rigid_patterns_mod, only: rigid_patterns_t
  use turning_means_mod, only: turning_means_t
  implicit none
  private

  public :: imposed_t, increment_forces_t, element_sums_t

  !> Of the elements of each body, before their forces are summed at nodes.
  type :: element_sums_t
    real(wp), allocatable :: largest(:) !! (0:n_bodies) force of an element at a node [force]
    real(wp), allocatable :: energy(:)  !! (0:n_bodies) of the strains [energy]
    real(wp), allocatable :: on_modes(:)
    !! (0:n_bodies) largest force of a C3D8I's mode beyond rounding; at finite strain [force]
  end type element_sums_t

  !> Loads, and what supports and constraints ask for; all (3,n_nodes) in x, y, z.
  type :: imposed_t
    real(wp), allocatable :: external(:, :)   !! loads [force]
    real(wp), allocatable :: dead_load(:, :)
    !! those that do not follow bodies; not allocated: none does [force]
    type(following_t) :: following            !! the others
    logical,  allocatable :: prescribed(:, :) !! degrees of freedom held by supports
    real(wp), allocatable :: displacement(:, :) !! that is prescribed, 0 elsewhere [length]
    type(constraints_t) :: constraints        !! those of the scene, whatever supports hold
    type(rigid_patterns_t) :: patterns        !! couplings that turn, whose constraints are no lines
    type(turning_means_t) :: means            !! over surfaces that turn, likewise
  end type imposed_t

  !> The same, with the forces from the stresses.
  type, extends(imposed_t) :: increment_forces_t
    real(wp), allocatable :: internal(:, :) !! (3,n_nodes) from the stresses [force]
    real(wp), allocatable :: applied(:, :)
    !! (3,n_nodes) the loads without what springs pull and inertia takes, which may cancel them; not
    !! allocated: there is neither [force]
    real(wp), allocatable :: rounding(:) !! (n_nodes) that the internal forces carry [force]
    real(wp), allocatable :: stiffness(:) !! (n_nodes) of each node by itself [force/length]
    real(wp) :: rounding_of_gaps = 0.0_wp     !! that the gaps carry [length]
    logical, allocatable :: touches(:)
    !! (n_points) in the mesh: their gaps are displacements alone; not allocated: none
    logical :: is_finite = .false.            !! strain
    type(edge_middles_t) :: middles           !! points that act on several nodes of a slave face
    type(element_sums_t) :: of_elements       !! of the internal forces, body by body
  end type increment_forces_t

end module increment_forces_mod
