!> The contact points of a run: which node faces which master, which can reach it, and the weights
!> by which the nodes of the master make up what a point faces.
module contact_points_mod
  use kinds_mod, only: wp
  use friction_laws_mod, only: friction_law_t, of_area
  use node_freedom_mod, only: node_freedom_t
  implicit none
  private

  public :: contact_points_t, is_pair_removed, weights_t, master_sides_t, own_sides_t, &
    master_nodes, contact_nodes, is_covered, is_across, is_still, n_sides, faces_of_side, &
    find_side_points, face_one
  public :: laws_of_points, law_at, is_in_middle, is_before_faces, list_slave, of_slave, of_row, &
    add_to_slave

  !> What concave edges divide a master of faces into: each side has integrals and points of its
  !> own, as if it were the master of a pair.
  type :: master_sides_t
    integer :: n = 1
    integer, allocatable :: of_face(:) !! the side of each face; not allocated where there is one
  end type master_sides_t

  !> Of a surface that touches itself: the sides that its faces have now.
  type :: own_sides_t
    integer, allocatable :: of_face(:)
    !! (n_faces) 1: slaves, 2: masters, 0: neither; not allocated: the pair has two surfaces
  end type own_sides_t

  !> All points of all pairs, one pair after the other, side after side of its master, the nodes of
  !> the slave surface ascending: what holds before anything is placed.
  type :: contact_points_t
    integer :: n = 0
    integer,  allocatable :: pair(:)  !! (n) index into the scene's pairs
    integer,  allocatable :: node(:)  !! (n) slave node
    logical,  allocatable :: turns(:)
    !! (n) normals are not fixed: the master is curved, or turns, or the point is on a bent edge
    logical,  allocatable :: is_curved(:)
    !! (n) these, of pairs that have points in reach: they are placed anew in every iteration, the
    !! others where an increment ends
    logical,  allocatable :: on_surface(:)
    !! (n) the master consists of faces, a body's or an obstacle's: it may not cover the point
    logical,  allocatable :: across(:, :)
    !! (3,n) before such a master: a plane of symmetry across this axis holds the node
    integer,  allocatable :: end_point(:, :)
    !! (2,n) of a node in the middle of an edge of a slave face the points at the ends of the edge,
    !! 0 of others; not allocated: there are none
    real(wp), allocatable :: alpha(:)
    !! (n) of such a node: the part of these two in its own point, (9.11), 0 of others; allocated
    !! with it [-]
    logical,  allocatable :: is_held(:)
    !! (n) such a node that supports of the *STEP hold along the normal; allocated with it
    real(wp), allocatable :: mu(:)    !! (n) friction coefficient, the largest [-]
    type(friction_law_t), allocatable :: laws(:)
    !! (n_pairs) what pressure makes of it; not allocated: nothing in any *STEP
    real(wp), allocatable :: area(:)
    !! (n) the node's tributary area of the slave surface, 0 where no face of it is [length^2]
    real(wp), allocatable :: extra_gap(:)
    !! (n) of *CONTACT GAP and *CLEARANCE, `uncarried`, and the interference that is allowed at the
    !! time that was set last (interference_mod) [length]
    real(wp), allocatable :: constant_gap(:)
    !! (n) what of it does not change; allocated where anything does [length]
    real(wp), allocatable :: overlap(:)
    !! (n) how deep the points are in their masters in the undeformed mesh, with the constant gap;
    !! allocated with it [length]
    real(wp), allocatable :: uncarried(:)
    !! (n) overlap of the undeformed mesh that constraints keep as it is, in the extra gap;
    !! allocated where there is any [length]
    logical,  allocatable :: is_joined(:)
    !! (n) before a surface: constraints join it to what it faces. It keeps the place of the
    !! undeformed mesh for as long as it faces nearly the same there, one node where that is nearly
    !! all; allocated where any does
    logical,  allocatable :: in_reach(:)
    !! (n) candidates; the others stay out of the interface, their gaps are watched
    logical,  allocatable :: is_removed(:)
    !! (n_pairs) pairs that there are not in a *STEP: their points face nothing; allocated where a
    !! step removes any
    type(node_freedom_t), allocatable :: freedom
    !! of all nodes in a *STEP; not allocated: no support or constraint takes a point
    integer,  allocatable :: first(:) !! (n_pairs+1) first point of each pair
    type(master_sides_t), allocatable :: sides(:)
    !! (n_pairs) of the masters; not allocated: all have one
    type(own_sides_t), allocatable :: own_sides(:)
    !! (n_pairs) found anew where increments begin; not allocated: no surface touches itself
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
    integer,  allocatable :: node(:)
    !! (n_entries) of the master; of the slave, where the row stands for their places, too
    real(wp), allocatable :: weight(:) !! (n_entries) [-]
    logical,  allocatable :: covers(:) !! (n_points) whether a master of faces covers the point
    logical,  allocatable :: alone(:)
    !! (n_points) in the middle of an edge: the ends have no part in the point, for supports hold
    !! the node or the ends are not touched; allocated where points have `alpha`
    logical,  allocatable :: still(:, :)
    !! (3,n_points) axes across the normal along which the two sides move against each other as
    !! prescribed alone; not allocated: there are none
  end type weights_t

contains

  !> The laws of friction of some points; not allocated where pressure changes nothing.
  pure subroutine laws_of_points(points, those, area, laws)
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: those(:)   !! (m) points
    real(wp), intent(in) :: area(:)   !! (n) of all points [length^2]
    type(friction_law_t), allocatable, intent(inout) :: laws(:) !! (m)
    integer :: k

    if (allocated(laws)) deallocate (laws)
    if (.not. allocated(points%laws)) return
    allocate (laws(size(those)))
    do k = 1, size(those)
      laws(k) = law_at(points, those(k), area(those(k)))
    end do
  end subroutine laws_of_points

  !> The law of friction of a point.
  pure type(friction_law_t) function law_at(points, i, area) result(law)
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: i
    real(wp), intent(in) :: area      !! of the point [length^2]

    if (allocated(points%laws)) law = of_area(points%laws(points%pair(i)), area)
  end function law_at

  !> Whether a point is that of a node in the middle of an edge of a slave face, and its ends have
  !> part in it. docs/theory.md (9.11).
  pure logical function is_in_middle(points, weights, i)
    type(contact_points_t), intent(in) :: points
    type(weights_t), intent(in) :: weights
    integer, intent(in) :: i

    is_in_middle = .false.
    if (allocated(points%alpha)) is_in_middle = points%alpha(i) > 0.0_wp .and. &
      .not. weights%alone(i)
  end function is_in_middle

  !> The nodes on the slave's side of a point, and what the displacement of each counts for there:
  !> its own node with 1, or in the middle of an edge q = (u_m - alpha (u_1 + u_2))/(1 - 2 alpha).
  pure subroutine list_slave(points, weights, i, n, node, factor)
    type(contact_points_t), intent(in) :: points
    type(weights_t), intent(in) :: weights
    integer, intent(in) :: i
    integer, intent(out) :: n           !! 1 or 3: of the following
    integer, intent(out) :: node(3)
    real(wp), intent(out) :: factor(3)  !! they add up to 1 [-]

    n = 1
    node = points%node(i)
    factor = [1.0_wp, 0.0_wp, 0.0_wp]
    if (.not. is_in_middle(points, weights, i)) return
    n = 3
    node(2:) = points%node(points%end_point(:, i))
    factor = [1.0_wp, -points%alpha(i), -points%alpha(i)]/(1.0_wp - 2.0_wp*points%alpha(i))
  end subroutine list_slave

  !> Displacement, or place, on the slave's side of a point.
  pure function of_slave(points, weights, i, u) result(q)
    type(contact_points_t), intent(in) :: points
    type(weights_t), intent(in) :: weights
    integer, intent(in) :: i
    real(wp), intent(in) :: u(:, :) !! (3,n_nodes) [length]
    real(wp) :: q(3)                !! [length]
    integer :: node(3), n, k
    real(wp) :: factor(3)

    q = u(:, points%node(i))
    if (.not. is_in_middle(points, weights, i)) return
    call list_slave(points, weights, i, n, node, factor)
    q = 0.0_wp
    do k = 1, n
      q = q + factor(k)*u(:, node(k))
    end do
  end function of_slave

  !> The same on the slave's side of its row, which may have other nodes of the slave, too.
  pure function of_row(points, weights, i, is_own, u) result(q)
    type(contact_points_t), intent(in) :: points
    type(weights_t), intent(in) :: weights
    integer, intent(in) :: i
    logical, intent(in) :: is_own(:) !! (n_nodes) nodes of the slave
    real(wp), intent(in) :: u(:, :)  !! (3,n_nodes) [length]
    real(wp) :: q(3)                 !! [length]
    integer :: k

    q = of_slave(points, weights, i, u)
    do k = weights%first(i), weights%first(i + 1) - 1
      if (is_own(weights%node(k))) q = q - weights%weight(k)*u(:, weights%node(k))
    end do
  end function of_row

  !> Add the reaction of a point to the forces on the slave's nodes.
  pure subroutine add_to_slave(points, weights, i, reaction, force)
    type(contact_points_t), intent(in) :: points
    type(weights_t), intent(in) :: weights
    integer, intent(in) :: i
    real(wp), intent(in) :: reaction(3)       !! [force]
    real(wp), intent(inout) :: force(:, :)    !! (3,n_nodes) [force]
    integer :: node(3), n, k
    real(wp) :: factor(3)

    call list_slave(points, weights, i, n, node, factor)
    do k = 1, n
      force(:, node(k)) = force(:, node(k)) + factor(k)*reaction
    end do
  end subroutine add_to_slave

  !> How many sides a pair's master has.
  pure integer function n_sides(points, pair) result(n)
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair

    n = 1
    if (allocated(points%sides)) n = points%sides(pair)%n
  end function n_sides

  !> The faces of one side of a pair's master; not allocated where it is the only one.
  pure subroutine faces_of_side(points, pair, side, faces)
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair, side
    integer, allocatable, intent(out) :: faces(:)
    integer :: f

    if (n_sides(points, pair) == 1) return
    associate (of_face => points%sides(pair)%of_face)
      faces = pack([(f, f=1, size(of_face))], of_face == side)
    end associate
  end subroutine faces_of_side

  !> The points before one side of a pair's master: a run of them, a point a slave node.
  pure subroutine find_side_points(points, pair, side, first, last)
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair, side
    integer, intent(out) :: first, last
    integer :: n

    n = (points%first(pair + 1) - points%first(pair))/n_sides(points, pair)
    last = points%first(pair) + n*side - 1
    first = last - n + 1
  end subroutine find_side_points

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

  !> Whether the master of a point consists of faces.
  pure logical function is_before_faces(points, i)
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: i

    is_before_faces = .false.
    if (allocated(points%on_surface)) is_before_faces = points%on_surface(i)
  end function is_before_faces

  !> Whether a *STEP has removed a pair.
  pure logical function is_pair_removed(points, pair) result(is_removed)
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair

    is_removed = .false.
    if (allocated(points%is_removed)) is_removed = points%is_removed(pair)
  end function is_pair_removed

  !> Whether a point faces its master at all: one of faces where it covers the point, others always,
  !> but of pairs that are removed none.
  pure logical function is_covered(points, weights, i)
    type(contact_points_t), intent(in) :: points
    type(weights_t), intent(in) :: weights
    integer, intent(in) :: i

    is_covered = .true.
    if (allocated(points%is_removed)) is_covered = .not. points%is_removed(points%pair(i))
    if (is_before_faces(points, i)) is_covered = is_covered .and. weights%covers(i)
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

  !> The axes across the normal of a point along which supports and constraints hold both sides.
  pure function is_still(weights, i) result(still)
    type(weights_t), intent(in) :: weights
    integer, intent(in) :: i
    logical :: still(3)

    still = .false.
    if (allocated(weights%still)) still = weights%still(:, i)
  end function is_still

end module contact_points_mod
