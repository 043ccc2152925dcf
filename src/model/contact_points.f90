!> The contact points of a run: which node faces which obstacle, and which can reach it.
module contact_points_mod
  use kinds_mod, only: wp
  implicit none
  private

  public :: contact_points_t

  !> All points of all pairs, one pair after the other, the nodes of a pair ascending.
  type :: contact_points_t
    integer :: n = 0
    integer,  allocatable :: pair(:)  !! (n) index into the scene's pairs
    integer,  allocatable :: node(:)  !! (n) slave node
    integer,  allocatable :: ref_node(:) !! (n) reference node of the obstacle; 0: it is at rest
    logical,  allocatable :: is_curved(:) !! (n) the obstacle is, so that normals turn
    real(wp), allocatable :: mu(:)    !! (n) friction coefficient [-]
    real(wp), allocatable :: area(:)
    !! (n) the node's share of the slave surface, 0 where no face of it is [length^2]
    real(wp), allocatable :: extra_gap(:) !! (n) of *CONTACT GAP [length]
    logical,  allocatable :: in_reach(:)
    !! (n) candidates; the others stay out of the interface, their gaps are watched
    integer,  allocatable :: first(:) !! (n_pairs+1) first point of each pair
  end type contact_points_t

end module contact_points_mod
