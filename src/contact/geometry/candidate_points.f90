!> The candidate contact points of a scene: every node of every slave surface, once an obstacle.
!>
!> Work and memory grow with the points and the nodes, not with their product with pairs or cards.
module candidate_points_mod
  use kinds_mod, only: wp
  use obstacle_shapes_mod, only: has_fixed_normal, locate_point
  use scene_mod, only: scene_t, contact_gap_t
  use contact_points_mod, only: contact_points_t
  use mesh_forces_mod, only: add_nodal_areas
  implicit none
  private

  public :: find_points

contains

  !> All points, pair by pair, with their areas and extra gaps.
  !>
  !> A node that several pairs bring before the same obstacle belongs to the first of them.
  subroutine find_points(scene, points)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(out) :: points
    real(wp) :: area(scene%mesh%n_nodes)
    logical, allocatable :: is_new(:)
    integer :: pair, i, k, slot

    allocate (points%first(size(scene%pairs) + 1))
    call list_master_nodes(scene, points)
    call find_new(scene, is_new)
    points%n = count(is_new)
    allocate (points%pair(points%n), points%node(points%n))
    allocate (points%mu(points%n), points%area(points%n), points%is_curved(points%n))
    area = 0.0_wp
    k = 0
    slot = 0
    do pair = 1, size(scene%pairs)
      points%first(pair) = k + 1
      associate (surface => scene%surfaces(scene%pairs(pair)%surface))
        call add_nodal_areas(scene%mesh, surface, area)
        do i = 1, size(surface%nodes)
          slot = slot + 1
          if (.not. is_new(slot)) cycle
          k = k + 1
          points%pair(k) = pair
          points%node(k) = surface%nodes(i)
          points%area(k) = area(surface%nodes(i))
          points%mu(k) = scene%pairs(pair)%mu
          points%is_curved(k) = .not. has_fixed_normal(scene%obstacles(scene%pairs(pair)%master))
        end do
        area(surface%nodes) = 0.0_wp
      end associate
    end do
    points%first(size(scene%pairs) + 1) = k + 1
    call find_extra_gaps(scene, points)
  end subroutine find_points

  !> The nodes of every pair's master that may get weights.
  pure subroutine list_master_nodes(scene, points)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(inout) :: points
    integer :: pair, n

    allocate (points%first_master(size(scene%pairs) + 1))
    allocate (points%master_node(size(scene%pairs)))
    n = 0
    do pair = 1, size(scene%pairs)
      points%first_master(pair) = n + 1
      associate (ref_node => scene%obstacles(scene%pairs(pair)%master)%ref_node)
        if (ref_node == 0) cycle
        n = n + 1
        points%master_node(n) = ref_node
      end associate
    end do
    points%first_master(size(scene%pairs) + 1) = n + 1
    points%master_node = points%master_node(:n)
  end subroutine list_master_nodes

  !> Which slots (the nodes of the first pair's surface, then those of the second, ...) are points.
  !>
  !> Obstacle by obstacle, so that one mark a node is enough.
  pure subroutine find_new(scene, is_new)
    type(scene_t), intent(in) :: scene
    logical, allocatable, intent(out) :: is_new(:) !! (slots of all pairs)
    integer, dimension(size(scene%pairs)) :: first, next
    integer :: head(size(scene%obstacles)), marked(scene%mesh%n_nodes)
    integer :: pair, obstacle, i, n

    ! Lists of each obstacle's pairs, ascending.
    n = 0
    do pair = 1, size(scene%pairs)
      first(pair) = n
      n = n + size(scene%surfaces(scene%pairs(pair)%surface)%nodes)
    end do
    allocate (is_new(n), source=.false.)
    head = 0
    do pair = size(scene%pairs), 1, -1
      next(pair) = head(scene%pairs(pair)%master)
      head(scene%pairs(pair)%master) = pair
    end do

    marked = 0
    do obstacle = 1, size(scene%obstacles)
      pair = head(obstacle)
      do while (pair > 0)
        associate (nodes => scene%surfaces(scene%pairs(pair)%surface)%nodes)
          do i = 1, size(nodes)
            is_new(first(pair) + i) = marked(nodes(i)) /= obstacle
            marked(nodes(i)) = obstacle
          end do
        end associate
        pair = next(pair)
      end do
    end do
  end subroutine find_new

  !> *CONTACT GAP: what each point is further away than the mesh says.
  !>
  !> Constant gaps are the same before every obstacle: summed over the nodes, then handed out.
  subroutine find_extra_gaps(scene, points)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(inout) :: points
    integer :: head(scene%mesh%n_nodes), next(points%n), marked(scene%mesh%n_nodes)
    real(wp) :: constant(scene%mesh%n_nodes)
    integer :: card, i, j

    ! Lists of each node's points.
    head = 0
    do i = points%n, 1, -1
      next(i) = head(points%node(i))
      head(points%node(i)) = i
    end do
    allocate (points%extra_gap(points%n), source=0.0_wp)
    constant = 0.0_wp
    marked = 0
    do card = 1, size(scene%gaps)
      associate (given => scene%gaps(card))
        do j = 1, size(given%nodes)
          associate (node => given%nodes(j))
            if (marked(node) == card) cycle ! named twice by one card
            marked(node) = card
            if (.not. given%parabola) constant(node) = constant(node) + given%value
            i = 0
            if (given%parabola) i = head(node)
          end associate
          do while (i > 0)
            points%extra_gap(i) = points%extra_gap(i) + paraboloid(scene, points, i, given)
            i = next(i)
          end do
        end do
      end associate
    end do
    points%extra_gap = points%extra_gap + constant(points%node)
  end subroutine find_extra_gaps

  !> Distance of a point from a paraboloid's apex plane, measured along its obstacle's normal.
  function paraboloid(scene, points, i, card) result(height)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: i
    type(contact_gap_t), intent(in) :: card
    real(wp) :: height !! [length]
    real(wp) :: x(3), normal(3), gap

    x = scene%mesh%coordinates(:, points%node(i))
    call locate_point(scene%obstacles(scene%pairs(points%pair(i))%master), &
      [0.0_wp, 0.0_wp, 0.0_wp], x, gap, normal)
    x = x - card%centre
    x = x - dot_product(x, normal)*normal
    height = sum(x**2)/(2.0_wp*card%radius)
  end function paraboloid

end module candidate_points_mod
