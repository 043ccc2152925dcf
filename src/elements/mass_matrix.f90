!> The mass of bodies whose nodes that may touch carry none. docs/theory.md, section 13.
!>
!> Elements away from contact have their consistent mass. That of elements with nodes that may touch
!> is lumped, and the share of such a node goes to others of the element; of elements that have no
!> others to the nearest nodes of the piece. What this changes of the piece's mass, centre and
!> moments of inertia is put right by a matrix of the rank of its rigid motions.
module mass_matrix_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: cross
  use dense_mod, only: symmetric_eigenvectors
  use sorting_mod, only: count_below
  use cells_mod, only: cells
  use connectivity_mod, only: nodes_of_element
  use linked_nodes_mod, only: node_neighbours
  use mesh_mod, only: mesh_t
  use scene_mod, only: material_t
  use node_products_mod, only: cell_functions_t, find_node_products
  implicit none
  private

  public :: mass_t, make_mass, times_mass, diagonal_of

  integer, parameter :: receivers = 3  !! nodes that the mass of an element without others goes to
  real(wp), parameter :: singular = 1.0e-10_wp !! least inertia of a piece, beside the largest [-]

  !> M + S (G_whole - G) S^T, the same along x, y and z but for S: S = M P G^-1, G = P^T M P, with
  !> the rigid motions P of a piece and their inertia G_whole as it is. M has no rows of nodes that
  !> may touch.
  type :: mass_t
    integer,  allocatable :: first(:), other(:) !! lists of the nodes that share elements, ascending
    real(wp), allocatable :: value(:)           !! M of each node with these [mass]
    logical,  allocatable :: carries(:)         !! (n_nodes) a node has mass
    integer,  allocatable :: piece(:)           !! (n_nodes) as of mesh_t
    real(wp), allocatable :: pattern(:, :, :)   !! (3,6,n_nodes) S, of each motion of the piece [-]
    real(wp), allocatable :: missing(:, :, :)   !! (6,6,n_pieces) G_whole - G [mass]
    real(wp), allocatable :: whole(:, :, :)     !! (6,6,n_pieces) G_whole [mass]
    real(wp), allocatable :: centre(:, :)       !! (3,n_pieces) of mass [length]
    real(wp), allocatable :: extent(:)          !! (n_pieces) that rotations are scaled by [length]
  end type mass_t

contains

  !> The mass of a mesh.
  subroutine make_mass(mesh, materials, touches, keeps, puts_right, mass, stuck_element, &
    stuck_piece)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    logical, intent(in) :: touches(:)    !! (n_nodes) nodes that may touch
    logical, intent(in) :: keeps(:, :)
    !! (6,n_pieces) rigid motions whose inertia is put right: translations along x, y, z and
    !! rotations about them
    logical, intent(in) :: puts_right    !! else the lists' mass is all, as bodies that turn need it
    type(mass_t), intent(out) :: mass
    integer, intent(out) :: stuck_element !! no node of its piece can take its mass; 0: none
    integer, intent(out) :: stuck_piece   !! its mass is on a line; 0: none
    real(wp), allocatable :: value(:)     !! as of mass_t [mass]
    real(wp), allocatable :: whole(:)     !! consistent mass, likewise [mass]
    type(cell_functions_t) :: functions
    integer :: e

    stuck_piece = 0
    stuck_element = 0
    call node_neighbours(mesh, mass%first, mass%other)
    allocate (value(size(mass%other)), whole(size(mass%other)), source=0.0_wp)
    allocate (mass%piece, source=mesh%piece)
    do e = 1, mesh%n_elements
      associate (nodes => nodes_of_element(mesh%connectivity, e), &
                 density => materials(mesh%material(e))%density)
        call add_element(nodes, density)
      end associate
      if (stuck_element > 0) return
    end do
    call move_alloc(value, mass%value)
    mass%carries = diagonal_of(mass) > 0.0_wp
    call put_right(mesh, whole, keeps, mass, stuck_piece)
    if (.not. puts_right) mass%missing = 0.0_wp

  contains

    subroutine add_element(nodes, density)
      integer, intent(in) :: nodes(:)
      real(wp), intent(in) :: density         !! [mass/length^3]
      real(wp) :: products(size(nodes), size(nodes)), share(size(nodes))
      integer, allocatable :: others(:)
      integer :: a, b

      call find_node_products(mesh%connectivity%cell(e), mesh%coordinates(:, nodes), functions, &
        products)
      products = density*products
      do a = 1, size(nodes)
        do b = 1, size(nodes)
          call add(mass, whole, nodes(a), nodes(b), products(a, b))
        end do
      end do
      if (.not. any(touches(nodes))) then
        do a = 1, size(nodes)
          do b = 1, size(nodes)
            call add(mass, value, nodes(a), nodes(b), products(a, b))
          end do
        end do
        return
      end if
      share = [(products(a, a), a=1, size(nodes))]
      share = share*(sum(products)/sum(share))
      if (all(touches(nodes))) then
        call find_nearest(mesh, mass, nodes, touches, others)
        if (size(others) == 0) stuck_element = e
        do a = 1, size(others)
          call add(mass, value, others(a), others(a), sum(share)/size(others))
        end do
        return
      end if
      do a = 1, size(nodes)
        others = nodes(a:a)
        if (touches(nodes(a))) others = pack(nodes, takers(mesh%connectivity%cell(e), a, &
          .not. touches(nodes)))
        do b = 1, size(others)
          call add(mass, value, others(b), others(b), share(a)/size(others))
        end do
      end do
    end subroutine add_element

  end subroutine make_mass

  !> Add to an entry.
  pure subroutine add(mass, value, node, other, part)
    type(mass_t), intent(in) :: mass        !! its lists
    real(wp), intent(inout) :: value(:)
    integer, intent(in) :: node, other
    real(wp), intent(in) :: part            !! [mass]
    integer :: k

    k = entry_of(mass, node, other)
    value(k) = value(k) + part
  end subroutine add

  pure integer function entry_of(mass, node, other)
    type(mass_t), intent(in) :: mass
    integer, intent(in) :: node, other

    associate (first => mass%first(node), last => mass%first(node + 1) - 1)
      entry_of = first + count_below(other, mass%other(first:last))
    end associate
  end function entry_of

  !> Which nodes of a cell take the mass of one: those one edge away, in its middle before at its
  !> end; all that can where these cannot.
  pure function takers(cell, a, can) result(take)
    integer, intent(in) :: cell      !! row of the table of cells
    integer, intent(in) :: a         !! the node, in the cell
    logical, intent(in) :: can(:)    !! (n_nodes of the cell), one at least
    logical :: take(size(can))
    logical, dimension(size(can)) :: middle, end
    integer :: i

    middle = .false.
    end = .false.
    associate (of => cells(cell))
      do i = 1, of%n_edges
        associate (one => of%edge(1, i), other => of%edge(2, i), between => of%n_corners + i)
          if (a == one) end(other) = .true.
          if (a == other) end(one) = .true.
          if (of%n_nodes == of%n_corners) cycle
          if (a == one .or. a == other) middle(between) = .true.
          if (a == between) end([one, other]) = .true.
        end associate
      end do
    end associate
    take = middle .and. can
    if (.not. any(take)) take = end .and. can
    if (.not. any(take)) take = can
  end function takers

  !> The nodes nearest to an element that can take its mass: those that the fewest elements lie
  !> before, of these the nearest.
  pure subroutine find_nearest(mesh, mass, nodes, touches, nearest)
    type(mesh_t), intent(in) :: mesh
    type(mass_t), intent(in) :: mass              !! its lists
    integer, intent(in) :: nodes(:)               !! of the element
    logical, intent(in) :: touches(:)             !! (n_nodes)
    integer, allocatable, intent(out) :: nearest(:)
    logical :: is_reached(mesh%n_nodes), is_next(mesh%n_nodes)
    real(wp) :: centre(3), far(mesh%n_nodes)
    integer :: node, k

    is_reached = .false.
    is_reached(nodes) = .true.
    allocate (nearest(0))
    do
      is_next = .false.
      do node = 1, mesh%n_nodes
        if (is_reached(node)) is_next(mass%other(mass%first(node):mass%first(node + 1) - 1)) = &
          .true.
      end do
      is_next = is_next .and. .not. is_reached
      if (.not. any(is_next)) return
      is_reached = is_reached .or. is_next
      if (any(is_next .and. .not. touches)) exit
    end do
    is_next = is_next .and. .not. touches
    centre = sum(mesh%coordinates(:, nodes), dim=2)/size(nodes)
    far = norm2(mesh%coordinates(:, :mesh%n_nodes) - spread(centre, 2, mesh%n_nodes), dim=1)
    do k = 1, min(receivers, count(is_next))
      node = minloc(far, dim=1, mask=is_next)
      nearest = [nearest, node]
      is_next(node) = .false.
    end do
  end subroutine find_nearest

  !> The matrix of low rank that gives each piece its inertia along rigid motions.
  pure subroutine put_right(mesh, whole, keeps, mass, stuck)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: whole(:)      !! consistent mass, as `value` [mass]
    logical, intent(in) :: keeps(:, :)    !! (6,n_pieces)
    type(mass_t), intent(inout) :: mass
    integer, intent(out) :: stuck         !! piece whose mass is on a line; 0: none
    real(wp) :: moved(mesh%n_nodes), in_piece(0:mesh%n_pieces), g(6, 6, mesh%n_pieces)
    real(wp) :: all_g(6, 6, mesh%n_pieces), inverse(6, 6), p(3, 6), q(3, 6), value(6), vector(6, 6)
    real(wp) :: at_node(3, 6)
    integer :: node, k, piece, i
    logical :: ok

    allocate (mass%centre(3, mesh%n_pieces), mass%extent(mesh%n_pieces), &
      mass%missing(6, 6, mesh%n_pieces), source=0.0_wp)
    allocate (mass%pattern(3, 6, mesh%n_nodes), source=0.0_wp)
    ! The centre of mass, by the sums of the rows.
    in_piece = 0.0_wp
    moved = 0.0_wp
    do node = 1, mesh%n_nodes
      piece = mesh%piece(node)
      if (piece == 0) cycle
      moved(node) = sum(whole(mass%first(node):mass%first(node + 1) - 1))
      in_piece(piece) = in_piece(piece) + moved(node)
      mass%centre(:, piece) = mass%centre(:, piece) + moved(node)*mesh%coordinates(:, node)
    end do
    do piece = 1, mesh%n_pieces
      mass%centre(:, piece) = mass%centre(:, piece)/in_piece(piece)
    end do
    do node = 1, mesh%n_nodes
      piece = mesh%piece(node)
      if (piece > 0) mass%extent(piece) = max(mass%extent(piece), norm2( &
        mesh%coordinates(:, node) - mass%centre(:, piece)))
    end do
    g = 0.0_wp
    all_g = 0.0_wp
    do node = 1, mesh%n_nodes
      piece = mesh%piece(node)
      if (piece == 0) cycle
      p = motions_at(mesh, mass, node)
      q = 0.0_wp
      at_node = 0.0_wp
      do k = mass%first(node), mass%first(node + 1) - 1
        associate (other => motions_at(mesh, mass, mass%other(k)))
          q = q + whole(k)*other
          at_node = at_node + mass%value(k)*other
        end associate
      end do
      all_g(:, :, piece) = all_g(:, :, piece) + matmul(transpose(p), q)
      g(:, :, piece) = g(:, :, piece) + matmul(transpose(p), at_node)
      mass%pattern(:, :, node) = at_node
    end do
    stuck = 0
    allocate (mass%whole, source=all_g)
    do piece = 1, mesh%n_pieces
      inverse = g(:, :, piece)
      do i = 1, 6
        if (keeps(i, piece)) cycle
        inverse(:, i) = 0.0_wp
        inverse(i, :) = 0.0_wp
        inverse(i, i) = in_piece(piece)
      end do
      vector = 0.5_wp*(inverse + transpose(inverse))
      call symmetric_eigenvectors(vector, value, ok)
      if (ok) ok = minval(value) > singular*maxval(value)
      if (.not. ok) then
        stuck = piece
        return
      end if
      ! By its eigenvectors.
      inverse = 0.0_wp
      do i = 1, 6
        inverse = inverse + spread(vector(:, i), 2, 6)*spread(vector(:, i), 1, 6)/value(i)
      end do
      do i = 1, 6
        if (keeps(i, piece)) cycle
        inverse(:, i) = 0.0_wp
        inverse(i, :) = 0.0_wp
        all_g(:, i, piece) = g(:, i, piece)
        all_g(i, :, piece) = g(i, :, piece)
      end do
      mass%missing(:, :, piece) = all_g(:, :, piece) - g(:, :, piece)
      g(:, :, piece) = inverse
    end do
    do node = 1, mesh%n_nodes
      piece = mesh%piece(node)
      if (piece > 0) mass%pattern(:, :, node) = matmul(mass%pattern(:, :, node), g(:, :, piece))
    end do
  end subroutine put_right

  !> The rigid motions of its piece at a node: translations along x, y, z, rotations about them
  !> through the centre of mass that move the farthest node by 1.
  pure function motions_at(mesh, mass, node) result(p)
    type(mesh_t), intent(in) :: mesh
    type(mass_t), intent(in) :: mass
    integer, intent(in) :: node
    real(wp) :: p(3, 6)             !! [-]
    integer :: i

    p = 0.0_wp
    associate (piece => mesh%piece(node))
      do i = 1, 3
        p(i, i) = 1.0_wp
        p(:, 3 + i) = cross(p(:, i), mesh%coordinates(:, node) - mass%centre(:, piece))/ &
          mass%extent(piece)
      end do
    end associate
  end function motions_at

  !> The mass times accelerations, or velocities.
  pure function times_mass(mass, a) result(f)
    type(mass_t), intent(in) :: mass
    real(wp), intent(in) :: a(:, :)     !! (3,n_nodes)
    real(wp) :: f(3, size(a, 2))
    real(wp) :: along(6, size(mass%missing, 3)), of_node(3)
    integer :: node, k, i

    f = 0.0_wp
    along = 0.0_wp
    do node = 1, size(a, 2)
      if (mass%piece(node) == 0) cycle
      of_node = 0.0_wp
      do k = mass%first(node), mass%first(node + 1) - 1
        of_node = of_node + mass%value(k)*a(:, mass%other(k))
      end do
      f(:, node) = of_node
      associate (of_piece => along(:, mass%piece(node)), pattern => mass%pattern(:, :, node))
        do i = 1, 6
          of_piece(i) = of_piece(i) + dot_product(a(:, node), pattern(:, i))
        end do
      end associate
    end do
    do k = 1, size(along, 2)
      along(:, k) = matmul(mass%missing(:, :, k), along(:, k))
    end do
    do node = 1, size(a, 2)
      if (mass%piece(node) > 0) f(:, node) = f(:, node) + matmul(mass%pattern(:, :, node), &
        along(:, mass%piece(node)))
    end do
  end function times_mass

  !> The diagonal of M [mass].
  pure function diagonal_of(mass) result(diagonal)
    type(mass_t), intent(in) :: mass
    real(wp) :: diagonal(size(mass%piece))
    integer :: node

    diagonal = 0.0_wp
    do node = 1, size(diagonal)
      if (mass%piece(node) > 0) diagonal(node) = mass%value(entry_of(mass, node, node))
    end do
  end function diagonal_of

end module mass_matrix_mod
