!> Rigid obstacles: what a body may touch and cannot enter. What the kinds are like is said by
!> `obstacle_shapes_mod` alone.
module obstacles_mod
  use equal_columns_mod, only: number_columns
  use kinds_mod, only: wp, i8
  implicit none
  private

  public :: obstacle_t, obstacle_plane, obstacle_sphere, obstacle_cylinder, obstacle_facets, &
    obstacle_of_facets, ref_nodes

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
    logical  :: turns = .false.      !! a step prescribes rotations other than 0
    real(wp), allocatable :: corner(:, :) !! (3,n_corners) facets: where their corners are [length]
    integer,  allocatable :: facet(:, :)
    !! (4,n_facets) facets: corners of each, anticlockwise from the side of the body; the fourth is
    !! 0 in a triangle
    character(:), allocatable :: file     !! facets: path of the file that they come from
    integer(i8) :: checksum = 0           !! of that file
  end type obstacle_t

contains

  !> An obstacle of facets. Of those that have the same corners in the same order, whichever is the
  !> first, the first is kept; turned round, a facet is the other side of a sheet.
  pure function obstacle_of_facets(name, corner, facet, ref_node) result(obstacle)
    character(*), intent(in) :: name
    real(wp), intent(in) :: corner(:, :) !! (3,n_corners) [length]
    integer, intent(in) :: facet(:, :)   !! (4,n_facets) as of `obstacle_t`
    integer, intent(in) :: ref_node      !! 0: it is at rest
    type(obstacle_t) :: obstacle
    integer, allocatable :: place(:), number(:)
    integer :: key(4, size(facet, 2)), f, n

    obstacle%name = name
    obstacle%kind = obstacle_facets
    obstacle%ref_node = ref_node
    allocate (obstacle%corner, source=corner)
    call number_columns(corner, place)
    key = 0
    do f = 1, size(facet, 2)
      n = count(facet(:, f) > 0)
      key(:n, f) = place(facet(:n, f))
      key(:n, f) = cshift(key(:n, f), minloc(key(:n, f), dim=1) - 1)
    end do
    call number_columns(key, number)
    obstacle%facet = facet(:, pack([(f, f=1, size(number))], number == [(f, f=1, size(number))]))
  end function obstacle_of_facets

  !> The reference nodes of all obstacles, each once.
  pure function ref_nodes(obstacles) result(nodes)
    type(obstacle_t), intent(in) :: obstacles(:)
    integer, allocatable :: nodes(:)
    integer :: i

    allocate (nodes(0))
    do i = 1, size(obstacles)
      if (obstacles(i)%ref_node == 0 .or. any(nodes == obstacles(i)%ref_node)) cycle
      nodes = [nodes, obstacles(i)%ref_node]
    end do
  end function ref_nodes

end module obstacles_mod
