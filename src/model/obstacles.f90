!> Rigid obstacles, which a body may touch and cannot enter. Only `obstacle_shapes_mod` knows the
!> geometry of each kind.
module obstacles_mod
  use equal_columns_mod, only: number_columns
  use kinds_mod, only: wp, i8
  implicit none
  private

  public :: obstacle_t, obstacle_plane, obstacle_sphere, obstacle_cylinder, obstacle_facets, &
    obstacle_of_facets, on_axis, ref_nodes

  integer, parameter :: obstacle_plane = 1
  integer, parameter :: obstacle_sphere = 2
  integer, parameter :: obstacle_cylinder = 3 !! without ends
  integer, parameter :: obstacle_facets = 4   !! a mesh of triangles and quadrilaterals

  !> A rigid obstacle, as the deck places it. It moves with its reference node, and turns about it
  !> as rotations of that node are prescribed.
  type :: obstacle_t
    character(:), allocatable :: name
    integer  :: kind = obstacle_plane
    real(wp) :: point(3) = 0.0_wp
    !! plane: any point of it; sphere: its centre; cylinder: any point of its axis [length]
    real(wp) :: normal(3) = 0.0_wp
    !! plane: unit normal, from the obstacle to the body; cylinder: unit vector of its axis [-]
    real(wp) :: radius = 0.0_wp      !! sphere and cylinder, > 0 [length]
    logical  :: inner = .false.      !! sphere and cylinder: the body lies inside
    integer  :: ref_node = 0         !! node that the obstacle moves with; 0: it is at rest
    logical  :: is_on_body = .false. !! its reference node is one of a body, as of a gap
    logical  :: is_of_gap = .false.  !! it stops one node, all others may pass it
    logical  :: turns = .false.      !! a step prescribes rotations other than 0
    real(wp), allocatable :: corner(:, :) !! (3,n_corners) facets: where their corners are [length]
    integer,  allocatable :: facet(:, :)
    !! (4,n_facets) facets: corners of each, anticlockwise from the side of the body; the fourth is
    !! 0 in a triangle
    character(:), allocatable :: file     !! facets: path of the file that they come from
    integer(i8) :: checksum = 0           !! of that file
  end type obstacle_t

contains

  !> An obstacle of facets. Corners at the same place are merged. Of facets with the same corners in
  !> the same cyclic order one is kept; in the reverse order it is the other side of a sheet.
  pure type(obstacle_t) function obstacle_of_facets(name, corner, facet, ref_node) result(obstacle)
    character(*), intent(in) :: name
    real(wp), intent(in) :: corner(:, :) !! (3,n_corners) [length]
    integer, intent(in) :: facet(:, :)   !! (4,n_facets) as of `obstacle_t`
    integer, intent(in) :: ref_node      !! 0: it is at rest
    integer, allocatable :: first(:)
    integer :: joined(4, size(facet, 2)), key(4, size(facet, 2)), place(size(corner, 2)), i, n

    obstacle%name = name
    obstacle%kind = obstacle_facets
    obstacle%ref_node = ref_node
    call number_columns(corner, first)
    n = 0
    do i = 1, size(first)
      if (first(i) == i) then
        n = n + 1
        place(i) = n
      else
        place(i) = place(first(i))
      end if
    end do
    allocate (obstacle%corner(3, n))
    do i = 1, size(first)
      obstacle%corner(:, place(i)) = corner(:, i)
    end do
    joined = 0
    key = 0
    do i = 1, size(facet, 2)
      n = count(facet(:, i) > 0)
      joined(:n, i) = place(facet(:n, i))
      key(:n, i) = cshift(joined(:n, i), minloc(joined(:n, i), dim=1) - 1)
    end do
    call number_columns(key, first)
    n = count(first == [(i, i=1, size(first))])
    allocate (obstacle%facet(4, n))
    obstacle%facet(:, :) = joined(:, pack([(i, i=1, size(first))], first == [(i, i=1, &
      size(first))]))
  end function obstacle_of_facets

  !> The reference nodes of all obstacles, each once, but for those that bodies have.
  pure function ref_nodes(obstacles) result(nodes)
    type(obstacle_t), intent(in) :: obstacles(:)
    integer, allocatable :: nodes(:)
    integer :: i

    allocate (nodes(0))
    do i = 1, size(obstacles)
      if (obstacles(i)%ref_node == 0 .or. obstacles(i)%is_on_body .or. any(nodes == &
        obstacles(i)%ref_node)) cycle
      nodes = [nodes, obstacles(i)%ref_node]
    end do
  end function ref_nodes

  !> The nearest point of a cylinder's axis; before another obstacle the point itself.
  pure function on_axis(obstacle, x) result(nearest)
    type(obstacle_t), intent(in) :: obstacle
    real(wp), intent(in) :: x(3) !! [length]
    real(wp) :: nearest(3)

    nearest = x
    if (obstacle%kind == obstacle_cylinder) nearest = obstacle%point + &
      dot_product(obstacle%normal, x - obstacle%point)*obstacle%normal
  end function on_axis

end module obstacles_mod
