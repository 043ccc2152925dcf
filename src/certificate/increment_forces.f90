!> The forces of an increment, as the certificate takes them.
module increment_forces_mod
  use kinds_mod, only: wp
  use constraints_mod, only: constraints_t
  use congruent_forces_mod, only: element_sums_t
  implicit none
  private

  public :: increment_forces_t

  !> The forces of an increment, and what its supports ask for; all (3,n_nodes) in x, y, z.
  type :: increment_forces_t
    real(wp), allocatable :: internal(:, :)   !! from the stresses [force]
    real(wp), allocatable :: external(:, :)   !! loads [force]
    logical,  allocatable :: prescribed(:, :) !! degrees of freedom held by supports
    real(wp), allocatable :: displacement(:, :) !! that is prescribed, 0 elsewhere [length]
    type(constraints_t) :: constraints        !! those of the scene, whatever supports hold
    real(wp), allocatable :: rounding(:) !! (n_nodes) that the internal forces carry [force]
    real(wp), allocatable :: stiffness(:) !! (n_nodes) of each node by itself [force/length]
    real(wp) :: rounding_of_gaps = 0.0_wp     !! that the gaps carry [length]
    type(element_sums_t) :: of_elements       !! of the internal forces, body by body
  end type increment_forces_t

end module increment_forces_mod
