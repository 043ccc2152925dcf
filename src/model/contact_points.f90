!> The contact points of a run: which node faces which master, which can reach it, and the weights
!> by which the nodes of the master make up what a point faces.
module contact_points_mod
  use kinds_mod, only: wp
  implicit none
  private

  public :: contact_points_t, weights_t, master_nodes, contact_nodes, is_covered, is_across, &
    face_one

  !> All points of all pairs, one pair after the other, the nodes of a pair ascending: what holds
  !> before anything is placed.
  type :: contact_points_t
    integer :: n = 0
    integer,  allocatable :: pair(:)  !! (n) index into the scene's pairs
    integer,  allocatable :: node(:)  !! (n) slave node
    logical,  allocatable :: is_curved(:)
    !! (n) the master is, or turns: normals are not fixed, and points are placed anew in every
    !! iteration
    logical,  allocatable :: on_surface(:)
    !! (n) the master consists of faces, a body's or an obstacle's: it may not cover the point
    logical,  allocatable :: across(:, :)
    !! (3,n) before such a master: a plane of symmetry across this axis holds the node
    real(wp), allocatable :: mu(:)    !! (n) friction coefficient [-]
    real(wp), allocatable :: area(:)
    !! (n) the node's tributary area of the slave surface, 0 where no face of it is [length^2]
    real(wp), allocatable :: extra_gap(:) !! (n) of *CONTACT GAP, and `uncarried` [length]
    real(wp), allocatable :: uncarried(:)
    !! (n) overlap of the undeformed mesh that constraints keep as it is, in the extra gap;
    !! allocated where there is any [length]
    logical,  allocatable :: is_joined(:)
    !! (n) before a surface: constraints join it to what it faces. It keeps the place of the
    !! undeformed mesh for as long as it faces nearly the same there, one node where that is nearly
    !! all; allocated where any does
    logical,  allocatable :: in_reach(:)
    !! (n) candidates; the others stay out of the interface, their gaps are watched
    integer,  allocatable :: first(:) !! (n_pairs+1) first point of each pair
    integer,  allocatable :: first_master(:) !! (n_pairs+1) first in `master_node` of each pair
    integer,  allocatable :: master_node(:)
    !! nodes of each pair's master that a placement may give weights to: of an obstacle its
    !! reference node, none where it is at rest; of a surface those of its faces
  end type contact_points_t

  !> What the contact points face, a sparse row a point: a displacement of the master there is the
  !> sum of weight times displacement of the nodes of the row.
  !>
  !> An obstacle that moves with a reference node is a row with that node and weight 1, an obstacle
  !> at rest an empty row; so is a master of faces that does not cover the point. Weights may be
  !> negative; those of a row add up to 1.
  type :: weights_t
    integer,  allocatable :: first(:)  !! (n_points+1) where the row of each point begins
    integer,  allocatable :: node(:)   !! (n_entries) master node
    real(wp), allocatable :: weight(:) !! (n_entries) [-]
    logical,  allocatable :: covers(:) !! (n_points) whether a master of faces covers the point
  end type weights_t

contains

  !> The nodes of a pair's master that may get weights.
  pure function master_nodes(points, pair) result(nodes)
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair
    integer, allocatable :: nodes(:)

    nodes = points%master_node(points%first_master(pair):points%first_master(pair + 1) - 1)
  end function master_nodes

  !> All nodes that contact may press, slave nodes before master nodes; repeated where they have
  !> several points.
  pure function contact_nodes(points) result(nodes)
    type(contact_points_t), intent(in) :: points
    integer, allocatable :: nodes(:)

    nodes = [points%node, points%master_node]
  end function contact_nodes

  !> Whether a point faces its master at all: one of faces where it covers the point, others always.
  pure logical function is_covered(points, weights, i)
    type(contact_points_t), intent(in) :: points
    type(weights_t), intent(in) :: weights
    integer, intent(in) :: i

    is_covered = .true.
    if (.not. allocated(points%on_surface)) return
    if (points%on_surface(i)) is_covered = weights%covers(i)
  end function is_covered

  !> Have a point face one node alone where that has nearly all of its weights: nodes opposite to
  !> each other but for the digits of a mesh.
  pure subroutine face_one(weight)
    real(wp), intent(inout) :: weight(:) !! of the point [-]
    real(wp), parameter :: nearly_all = 0.95_wp !! of the sum of magnitudes [-]
    integer :: k

    if (size(weight) == 0) return
    k = maxloc(weight, dim=1)
    if (weight(k) < nearly_all*sum(abs(weight))) return
    weight = 0.0_wp
    weight(k) = 1.0_wp
  end subroutine face_one

  !> The axes across which planes of symmetry hold a point before a surface.
  pure function is_across(points, i) result(across)
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: i
    logical :: across(3)

    across = .false.
    if (allocated(points%across)) across = points%across(:, i)
  end function is_across

end module contact_points_mod
