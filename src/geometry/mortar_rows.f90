!> What the nodes of a slave surface face: what a mortar is asked of, and what it finds.
module mortar_rows_mod
  use kinds_mod, only: wp
  use cells_mod, only: face_corners
  use contact_points_mod, only: weights_t
  implicit none
  private

  public :: mortar_t, asked_t, slave_t, opposite_t, changes_t, new_mortar, without_rounding, &
    lifted_gap, enough_of_second_order, aslant

  !> The place of the master that lies opposite a slave node.
  type :: opposite_t
    integer :: n = 0                !! 0: none does
    integer :: node(face_corners) = 0          !! of the master's face
    real(wp) :: weight(face_corners) = 0.0_wp  !! its shape functions there [-]
    real(wp) :: beyond = 0.1_wp
    !! how far beyond its edges, beside the face; further away is not opposite: strains do not move
    !! an edge so far [-]
  end type opposite_t

  !> What the rows change by as nodes move: the derivatives by the places of the nodes that each
  !> depends on. docs/theory.md (11.24).
  type :: changes_t
    integer, allocatable :: first(:)       !! (n+1) where the nodes of each row begin
    integer, allocatable :: node(:)        !! (n_entries)
    real(wp), allocatable :: normal(:, :, :)
    !! (3,3,n_entries) component of the normal, direction in which the node moves [1/length]
    real(wp), allocatable :: faced(:, :, :)
    !! (3,3,n_entries) the same of the place that the row faces, by what its weights change; before
    !! facets as it is seen from the node [-]
    integer, allocatable :: first_master(:) !! (n+1) where the nodes with weights of each row begin
    integer, allocatable :: master(:)      !! (n_masters)
    integer, allocatable :: first_weight(:) !! (n_entries+1) where those of each entry begin
    real(wp), allocatable :: weight(:, :)
    !! (3,n_weights) of each node with a weight, by direction; none before facets [1/length]
  end type changes_t

  !> What the nodes of a slave surface face.
  type :: mortar_t
    type(weights_t) :: weights              !! a row a slave node; empty where nothing covers it
    real(wp), allocatable :: area(:)        !! (n) of the node, as far as it is covered [length^2]
    real(wp), allocatable :: whole_area(:)  !! (n) of the node [length^2]
    real(wp), allocatable :: least(:)
    !! (n) how much of its area counts as contact where it is covered [-]
    real(wp), allocatable :: faced_area(:)
    !! (n) of that what is turned towards the master: as seen along the normal, 0: not covered
    !! [length^2]
    real(wp), allocatable :: opposed_area(:)
    !! (n) of its area what is covered by faces that are turned straight towards it [length^2]
    real(wp), allocatable :: normal(:, :)   !! (3,n) from master to slave, 0: not covered [-]
    real(wp), allocatable :: outward(:, :) !! (3,n) of the slave surface, the mean of its faces [-]
    real(wp), allocatable :: apart(:, :)
    !! (3,n) place of the node less that of what it faces, 0: not covered [length]
    real(wp), allocatable :: entered(:)
    !! (n) integral of the gap over the node's faces where it is below 0, with the node's shape
    !! function [length^3]
    real(wp), allocatable :: least_gap(:)
    !! (n) at corners of overlaps and the points of the quadrature on the node's faces, huge where
    !! there are none [length]
    real(wp), allocatable :: nearest(:)
    !! (n) the same at the corners of what is seen alone [length]
    real(wp) :: trapped = huge(1.0_wp)
    !! the least depth of places that overlap along no way out; huge: none do [length]
    logical :: has_middles = .false.        !! faces of the slave have mid-side nodes
    type(opposite_t), allocatable :: opposite(:)
    !! (n) where the slave asks for it, else not allocated
    type(changes_t), allocatable :: changes !! where the slave asks for them, else not allocated
  end type mortar_t

  !> What is asked of a mortar beside its rows.
  type :: asked_t
    logical :: changes = .false.          !! of the rows; not where nodes hang
    logical, allocatable :: is_far(:)
    !! (n) the row is not asked for: what it gets is not all of it; not allocated: all are
  end type asked_t

  !> A slave surface.
  type :: slave_t
    integer, allocatable :: faces(:, :)
    !! (4,n_slave) corners, anticlockwise from outside; the fourth is 0 in a triangle. Or
    !! (8,n_slave) all nodes as of all_nodes_of
    integer, allocatable :: nodes(:)      !! (n) each once, in the order of the rows
    integer, allocatable :: hanging(:, :)
    !! (5,m) of these the nodes that hang, with the two or four that they lie between: these get
    !! what they have, and they are not covered
    logical, allocatable :: asks(:)     !! (n) for what lies opposite; not allocated: none does
    type(asked_t) :: asked
    logical, allocatable :: is_fixed(:)
    !! (n) the node has no multiplier: its neighbours get what it has; not allocated: none
    real(wp), allocatable :: moved(:, :)
    !! (3,n_nodes) how far nodes of both sides have moved since what lies opposite was found, for
    !! the gaps between them; not allocated: they have not [length]
    integer, allocatable :: skin(:, :)
    !! (4,n) corners of all faces that may lie between; not allocated: those of both surfaces
    integer, allocatable :: piece(:)
    !! (n_nodes) the body of each; not allocated: not known, as `skin` is
    real(wp) :: breadth = 1.0_wp
    !! how much of its faces the master can cover: of slices, what it is thick beside them [-]
    logical :: is_dual = .false.
    !! functions are dual where a part of a face is bare, too: each point stands for its own place
    logical :: asks_way_out = .false. !! what overlaps counts along ways out alone, has_way_out
    real(wp), allocatable :: mesh(:, :), u(:, :)
    !! (3,n_nodes) places and displacements, whose sums the nodes are at: what is apart then has the
    !! digits of small displacements, but from a rigid master; not allocated: they have not moved
    !! [length]
    real(wp) :: rounding = 0.0_wp
    !! of places: what is no further apart along the normal before anything moves touches [length]
    real(wp) :: overlap = 0.0_wp
    !! how deep the two sides are in each other in the mesh: within one body what is deeper there is
    !! its own back [length]
  end type slave_t

  ! Less of a node's area than that is no contact: its row is nearly that of its neighbours. Dual
  ! functions of a part of a face, of ties and of what leans, have weights of at most 170 at larger
  ! shares, with mid-side nodes from the second.
  real(wp), parameter :: enough = 1.0e-3_wp, enough_of_second_order = 0.05_wp !! [-]

  real(wp), parameter :: aslant = 0.05_wp
  !! of what is covered: where as much of it leans, what that changes is changed all the way [-]

contains

  !> A mortar of which nothing is covered yet.
  pure type(mortar_t) function new_mortar(slave) result(mortar)
    type(slave_t), intent(in) :: slave
    integer :: n

    n = size(slave%nodes)
    allocate (mortar%area(n), mortar%whole_area(n), mortar%faced_area(n), source=0.0_wp)
    allocate (mortar%normal(3, n), mortar%outward(3, n), mortar%apart(3, n), source=0.0_wp)
    allocate (mortar%entered(n), source=0.0_wp)
    allocate (mortar%least(n), source=enough)
    allocate (mortar%opposed_area(n), source=0.0_wp)
    allocate (mortar%least_gap(n), mortar%nearest(n), source=huge(1.0_wp))
    if (allocated(slave%asks)) allocate (mortar%opposite(n))
  end function new_mortar

  !> The gap of a node. Where what covers it leans against its faces the mean gap is a guess, and
  !> none below the least of what these see.
  !> docs/theory.md (11.35).
  pure real(wp) function lifted_gap(mortar, i, gap) result(lifted)
    type(mortar_t), intent(in) :: mortar
    integer, intent(in) :: i
    real(wp), intent(in) :: gap           !! the mean [length]

    lifted = gap
    if (.not. mortar%area(i) > 0.0_wp) return
    lifted = gap + max(0.0_wp, mortar%nearest(i) - gap)*max(0.0_wp, min(1.0_wp, (1.0_wp - &
      mortar%opposed_area(i)/mortar%area(i))/aslant))
  end function lifted_gap

  !> What lies between two places of the undeformed mesh, without what rounding makes of a distance
  !> along the normal that is none. docs/theory.md (12.4).
  pure function without_rounding(apart, normal, rounding) result(rest)
    real(wp), intent(in) :: apart(3)  !! [length]
    real(wp), intent(in) :: normal(3) !! [-]
    real(wp), intent(in) :: rounding  !! of such distances [length]
    real(wp) :: rest(3)               !! [length]

    rest = apart
    associate (height => dot_product(normal, apart))
      if (abs(height) <= rounding) rest = apart - height*normal
    end associate
  end function without_rounding

end module mortar_rows_mod
