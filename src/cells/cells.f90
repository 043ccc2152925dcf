!> The cells that a mesh may consist of, as a table of constants: nodes, edges, faces, natural
!> coordinates and quadrature. What an element does with them (full integration, mean dilatation,
!> incompatible modes) is another matter.
!>
!> A cell is a product of simplices: a hexahedron that of three lines, a wedge that of a triangle
!> and a line, a tetrahedron is one itself. A pyramid is the cone over a product of two lines.
!> Natural coordinates go from -1 to 1 along a line, and from 0 to 1 along the edges of a triangle
!> or a tetrahedron and from the base of a cone to its apex. Nodes, edges and faces are numbered as
!> in CalculiX, Abaqus and VTK: the corners, then the middles of the edges in their order.
!> docs/theory.md, section 8.
!>
!>        8-------7              6                 4                   5
!>       /|      /|             /|\              / | \               // \ \
!>      5-------6 |            4---5            /  3  \             /4---\--3
!>      | 4-----|-3            | 3 |           / /   \ \           //     \ /
!>      |/      |/             |/ \|          1---------2         1--------2
!>      1-------2              1---2
module cells_mod
  use kinds_mod, only: wp
  implicit none
  private

  public :: cell_t, cells, face_corners, face_nodes, most_nodes, most_faces, most_points, &
    has_middles, computed_as
  public :: hexahedron_nodes, hexahedron_points
  public :: hexahedron_8, hexahedron_20, tetrahedron_4, tetrahedron_10, wedge_6, wedge_15, &
    pyramid_5, pyramid_13, hexahedron_20_reduced, hexahedron_20_of_14

  ! The room of lists is what a hexahedron with mid-side nodes takes. Rows of the table that have
  ! another do not compile.
  integer, parameter :: most_corners = 8, most_edges = 12, most_faces = 6
  integer, parameter :: most_nodes = most_corners + most_edges
  integer, parameter :: most_points = 3**3          !! Gauss's, 3 along each line
  integer, parameter :: face_corners = 4            !! of a face, at most
  integer, parameter :: face_nodes = 2*face_corners !! of a face, at most

  !> A cell with its quadrature: elements that differ in this alone are rows of their own. Lists
  !> that are shorter than their room end with zeros.
  type :: cell_t
    character(22) :: name              !! for messages
    integer :: vtk_type                !! in files of VTK
    integer :: n_nodes, n_corners, n_edges, n_faces, n_points
    integer :: factor(3)
    !! the simplex that each natural coordinate belongs to; 0: it goes to the apex of a cone
    integer :: degree                  !! of polynomials that the quadrature integrates exactly
    real(wp) :: place(3, most_nodes)   !! natural coordinates of the nodes [-]
    integer :: edge(2, most_edges)
    !! its corners; where there are mid-side nodes that of edge i is node n_corners + i
    integer :: n_face_corners(most_faces) !! 3 or 4
    integer :: face(face_nodes, most_faces)
    !! corners, anticlockwise from outside, then the mid-side nodes, that of corners 1 and 2 first
    integer :: as_hexahedron(most_corners)
    !! the corners of the 8-node hexahedron that it is where some of these are one; of a cell with
    !! mid-side nodes, that it is where edges are straight
    real(wp) :: point(3, most_points)  !! of the quadrature, natural coordinates [-]
    real(wp) :: weight(most_points)    !! their sum is the volume in natural coordinates [-]
  end type cell_t

  ! Rows of the table.
  integer, parameter :: hexahedron_8 = 1, hexahedron_20 = 2
  integer, parameter :: tetrahedron_4 = 3, tetrahedron_10 = 4
  integer, parameter :: wedge_6 = 5, wedge_15 = 6, pyramid_5 = 7
  integer, parameter :: hexahedron_20_reduced = 8, hexahedron_20_of_14 = 9
  integer, parameter :: pyramid_13 = 10

  real(wp), parameter :: none(1) = 0.0_wp
  real(wp), parameter :: half = 0.5_wp

  ! Edges and faces. Faces without mid-side nodes are the corners of those that have them.
  integer, parameter :: edges_of_hexahedron(2, 12) = reshape([1, 2, 2, 3, 3, 4, 4, 1, &
    5, 6, 6, 7, 7, 8, 8, 5, 1, 5, 2, 6, 3, 7, 4, 8], [2, 12])
  integer, parameter :: edges_of_tetrahedron(2, 12) = reshape([1, 2, 2, 3, 3, 1, 1, 4, 2, 4, 3, 4],&
    [2, 12], pad=[0])
  integer, parameter :: edges_of_wedge(2, 12) = reshape([1, 2, 2, 3, 3, 1, 4, 5, 5, 6, 6, 4, &
    1, 4, 2, 5, 3, 6], [2, 12], pad=[0])
  integer, parameter :: edges_of_pyramid(2, 12) = reshape([1, 2, 2, 3, 3, 4, 4, 1, 1, 5, 2, 5, &
    3, 5, 4, 5], [2, 12], pad=[0])
  integer, parameter :: faces_of_hexahedron(8, 6) = reshape([ &
    1, 4, 3, 2, 12, 11, 10, 9,   5, 6, 7, 8, 13, 14, 15, 16,  1, 2, 6, 5, 9, 18, 13, 17, &
    2, 3, 7, 6, 10, 19, 14, 18,  3, 4, 8, 7, 11, 20, 15, 19,  4, 1, 5, 8, 12, 17, 16, 20], [8, 6])
  integer, parameter :: faces_of_tetrahedron(8, 6) = reshape([ &
    1, 3, 2, 7, 6, 5, 0, 0,   1, 2, 4, 5, 9, 8, 0, 0,   2, 3, 4, 6, 10, 9, 0, 0, &
    3, 1, 4, 7, 8, 10, 0, 0], [8, 6], pad=[0])
  integer, parameter :: faces_of_wedge(8, 6) = reshape([ &
    1, 3, 2, 9, 8, 7, 0, 0,   4, 5, 6, 10, 11, 12, 0, 0,   1, 2, 5, 4, 7, 14, 10, 13, &
    2, 3, 6, 5, 8, 15, 11, 14,  3, 1, 4, 6, 9, 13, 12, 15], [8, 6], pad=[0])
  integer, parameter :: faces_of_pyramid(8, 6) = reshape([1, 4, 3, 2, 9, 8, 7, 6, &
    1, 2, 5, 6, 11, 10, 0, 0,  2, 3, 5, 7, 12, 11, 0, 0,  3, 4, 5, 8, 13, 12, 0, 0, &
    4, 1, 5, 9, 10, 13, 0, 0], [8, 6], pad=[0])

  ! Natural coordinates of the corners, and of all nodes: each middle is the mean of two corners.
  real(wp), parameter :: corners_of_hexahedron(3, 8) = reshape([real(wp) :: &
    -1, -1, -1,  1, -1, -1,  1, 1, -1,  -1, 1, -1, &
    -1, -1, 1,  1, -1, 1,  1, 1, 1,  -1, 1, 1], [3, 8])
  real(wp), parameter :: corners_of_tetrahedron(3, 4) = reshape([real(wp) :: 0, 0, 0,  1, 0, 0, &
    0, 1, 0,  0, 0, 1], [3, 4])
  real(wp), parameter :: corners_of_wedge(3, 6) = reshape([real(wp) :: 0, 0, -1,  1, 0, -1, &
    0, 1, -1,  0, 0, 1,  1, 0, 1,  0, 1, 1], [3, 6])
  real(wp), parameter :: corners_of_pyramid(3, 5) = reshape([real(wp) :: -1, -1, 0,  1, -1, 0, &
    1, 1, 0,  -1, 1, 0,  0, 0, 1], [3, 5])
  real(wp), parameter :: places_of_hexahedron(3, 20) = reshape([corners_of_hexahedron, &
    half*(corners_of_hexahedron(:, edges_of_hexahedron(1, :)) + &
    corners_of_hexahedron(:, edges_of_hexahedron(2, :)))], [3, 20])
  real(wp), parameter :: places_of_tetrahedron(3, 20) = reshape([corners_of_tetrahedron, &
    half*(corners_of_tetrahedron(:, edges_of_tetrahedron(1, :6)) + &
    corners_of_tetrahedron(:, edges_of_tetrahedron(2, :6)))], [3, 20], pad=none)
  real(wp), parameter :: places_of_wedge(3, 20) = reshape([corners_of_wedge, &
    half*(corners_of_wedge(:, edges_of_wedge(1, :9)) + &
    corners_of_wedge(:, edges_of_wedge(2, :9)))], [3, 20], pad=none)
  real(wp), parameter :: places_of_pyramid(3, 20) = reshape([corners_of_pyramid, &
    half*(corners_of_pyramid(:, edges_of_pyramid(1, :8)) + &
    corners_of_pyramid(:, edges_of_pyramid(2, :8)))], [3, 20], pad=none)

  ! Quadrature: Gauss's on lines, 3 or 6 points on triangles, 1 or 4 in a tetrahedron.
  ! Only rigid motions have no strain at these; at two points of the 6-node wedge another has none,
  ! and at 8 of the 20-node hexahedron six others, which elements around it may hold.
  ! Pyramids of 5 nodes have the points of the hexahedron that they are where its upper nodes are
  ! one, those of 13 Gauss's on the square and on the way to the apex, there with s^2 in the
  ! integral, s = 1 - zeta: the roots of s^2 - 4/3 s + 2/5.
  real(wp), parameter :: gauss_2 = 1.0_wp/sqrt(3.0_wp)
  real(wp), parameter :: gauss_3 = sqrt(0.6_wp)
  real(wp), parameter :: line_3(3) = [-gauss_3, 0.0_wp, gauss_3]
  real(wp), parameter :: line_weight_3(3) = [5.0_wp, 8.0_wp, 5.0_wp]/9.0_wp
  real(wp), parameter :: points_27(3, 27) = transpose(reshape([spread(line_3, 2, 9), &
    spread(spread(line_3, 1, 3), 3, 3), spread(line_3, 1, 9)], [27, 3]))
  real(wp), parameter :: weights_27(27) = [spread(line_weight_3, 2, 9)]* &
    [spread(spread(line_weight_3, 1, 3), 3, 3)]*[spread(line_weight_3, 1, 9)]
  ! Irons's rule of 14 points: 6 on the axes, 8 on the diagonals.
  real(wp), parameter :: on_axis = sqrt(19.0_wp/30.0_wp), on_diagonal = sqrt(19.0_wp/33.0_wp)
  real(wp), parameter :: axes(3, 6) = reshape([real(wp) :: -1, 0, 0,  1, 0, 0,  0, -1, 0, &
    0, 1, 0,  0, 0, -1,  0, 0, 1], [3, 6])
  real(wp), parameter :: points_14(3, 14) = reshape([on_diagonal*corners_of_hexahedron, &
    on_axis*axes], [3, 14])
  real(wp), parameter :: weights_14(14) = [spread(121.0_wp, 1, 8), spread(320.0_wp, 1, 6)]/361.0_wp
  real(wp), parameter :: sixth = 1.0_wp/6.0_wp
  real(wp), parameter :: triangle_3(2, 3) = reshape([ &
    sixth, sixth, 4.0_wp*sixth, sixth, sixth, 4.0_wp*sixth], [2, 3])
  real(wp), parameter :: points_6(3, 6) = transpose(reshape([spread(triangle_3(1, :), 2, 2), &
    spread(triangle_3(2, :), 2, 2), spread([-gauss_2, gauss_2], 1, 3)], [6, 3]))
  ! The rule of degree 4 with 6 points: two groups of three, the roots and weights in closed form.
  real(wp), parameter :: root_10 = sqrt(10.0_wp), part_of_10 = sqrt(38.0_wp - 44.0_wp*sqrt(0.4_wp))
  real(wp), parameter :: inside = (8.0_wp - root_10 + part_of_10)/18.0_wp
  real(wp), parameter :: outside = (8.0_wp - root_10 - part_of_10)/18.0_wp
  real(wp), parameter :: weight_part = sqrt(213125.0_wp - 53320.0_wp*root_10)
  real(wp), parameter :: triangle_weight_6(6) = 0.5_wp*[spread((620.0_wp + weight_part)/3720.0_wp, &
    1, 3), spread((620.0_wp - weight_part)/3720.0_wp, 1, 3)]
  real(wp), parameter :: triangle_6(2, 6) = reshape([inside, inside, 1.0_wp - 2.0_wp*inside, &
    inside, inside, 1.0_wp - 2.0_wp*inside, outside, outside, 1.0_wp - 2.0_wp*outside, outside, &
    outside, 1.0_wp - 2.0_wp*outside], [2, 6])
  real(wp), parameter :: points_18(3, 18) = transpose(reshape([spread(triangle_6(1, :), 2, 3), &
    spread(triangle_6(2, :), 2, 3), spread(line_3, 1, 6)], [18, 3]))
  real(wp), parameter :: weights_18(18) = [spread(triangle_weight_6, 2, 3)]* &
    [spread(line_weight_3, 1, 6)]
  real(wp), parameter :: height_8(8) = half*(1.0_wp + gauss_2*corners_of_hexahedron(3, :))
  real(wp), parameter :: points_8(3, 8) = transpose(reshape([ &
    gauss_2*corners_of_hexahedron(1, :)*(1.0_wp - height_8), &
    gauss_2*corners_of_hexahedron(2, :)*(1.0_wp - height_8), height_8], [8, 3]))
  real(wp), parameter :: root_of_cone = sqrt(2.0_wp/45.0_wp)
  real(wp), parameter :: shrinks(18) = [spread(2.0_wp/3.0_wp + root_of_cone*[1, -1], 1, 9)]
  real(wp), parameter :: points_of_cone(3, 18) = transpose(reshape([ &
    shrinks*[spread(line_3, 2, 6)], shrinks*[spread(spread(line_3, 1, 3), 3, 2)], &
    1.0_wp - shrinks], [18, 3]))
  real(wp), parameter :: weights_of_cone(18) = [spread(line_weight_3, 2, 6)]* &
    [spread(spread(line_weight_3, 1, 3), 3, 2)]* &
    [spread(sixth + [1, -1]/(72.0_wp*root_of_cone), 1, 9)]
  real(wp), parameter :: near = (5.0_wp - sqrt(5.0_wp))/20.0_wp, far = 1.0_wp - 3.0_wp*near

  !> The table.
  type(cell_t), parameter :: cells(10) = [ &
    cell_t('8-node hexahedron', 12, 8, 8, 12, 6, 8, [1, 2, 3], 3, &
      reshape(corners_of_hexahedron, [3, 20], pad=none), edges_of_hexahedron, spread(4, 1, 6), &
      merge(faces_of_hexahedron, 0, faces_of_hexahedron <= 8), &
      [1, 2, 3, 4, 5, 6, 7, 8], &
      reshape(gauss_2*corners_of_hexahedron, [3, 27], pad=none), &
      reshape(spread(1.0_wp, 1, 8), [27], pad=none)), &
    cell_t('20-node hexahedron', 25, 20, 8, 12, 6, 27, [1, 2, 3], 5, &
      places_of_hexahedron, edges_of_hexahedron, spread(4, 1, 6), &
      faces_of_hexahedron, [1, 2, 3, 4, 5, 6, 7, 8], points_27, weights_27), &
    cell_t('4-node tetrahedron', 10, 4, 4, 6, 4, 1, [1, 1, 1], 1, &
      reshape(corners_of_tetrahedron, [3, 20], pad=none), edges_of_tetrahedron, &
      [3, 3, 3, 3, 0, 0], merge(faces_of_tetrahedron, 0, faces_of_tetrahedron <= 4), &
      [1, 2, 3, 3, 4, 4, 4, 4], &
      reshape(spread(0.25_wp, 1, 3), [3, 27], pad=none), reshape([sixth], [27], pad=none)), &
    cell_t('10-node tetrahedron', 24, 10, 4, 6, 4, 4, [1, 1, 1], 2, &
      places_of_tetrahedron, edges_of_tetrahedron, [3, 3, 3, 3, 0, 0], faces_of_tetrahedron, &
      [1, 2, 3, 3, 4, 4, 4, 4], &
      reshape(near + (far - near)*corners_of_tetrahedron, [3, 27], pad=none), &
      reshape(spread(0.25_wp*sixth, 1, 4), [27], pad=none)), &
    cell_t('6-node wedge', 13, 6, 6, 9, 5, 6, [1, 1, 2], 2, &
      reshape(corners_of_wedge, [3, 20], pad=none), edges_of_wedge, [3, 3, 4, 4, 4, 0], &
      merge(faces_of_wedge, 0, faces_of_wedge <= 6), [1, 2, 3, 3, 4, 5, 6, 6], &
      reshape(points_6, [3, 27], pad=none), reshape(spread(sixth, 1, 6), [27], pad=none)), &
    cell_t('15-node wedge', 26, 15, 6, 9, 5, 18, [1, 1, 2], 4, &
      places_of_wedge, edges_of_wedge, [3, 3, 4, 4, 4, 0], faces_of_wedge, &
      [1, 2, 3, 3, 4, 5, 6, 6], &
      reshape(points_18, [3, 27], pad=none), reshape(weights_18, [27], pad=none)), &
    cell_t('5-node pyramid', 14, 5, 5, 8, 5, 8, [1, 2, 0], 1, &
      reshape(corners_of_pyramid, [3, 20], pad=none), edges_of_pyramid, [4, 3, 3, 3, 3, 0], &
      merge(faces_of_pyramid, 0, faces_of_pyramid <= 5), [1, 2, 3, 4, 5, 5, 5, 5], &
      reshape(points_8, [3, 27], pad=none), &
      reshape(half*(1.0_wp - height_8)**2, [27], pad=none)), &
    cell_t('20-node hexahedron', 25, 20, 8, 12, 6, 8, [1, 2, 3], 3, &
      places_of_hexahedron, edges_of_hexahedron, spread(4, 1, 6), &
      faces_of_hexahedron, [1, 2, 3, 4, 5, 6, 7, 8], &
      reshape(gauss_2*corners_of_hexahedron, [3, 27], pad=none), &
      reshape(spread(1.0_wp, 1, 8), [27], pad=none)), &
    cell_t('20-node hexahedron', 25, 20, 8, 12, 6, 14, [1, 2, 3], 5, &
      places_of_hexahedron, edges_of_hexahedron, spread(4, 1, 6), &
      faces_of_hexahedron, [1, 2, 3, 4, 5, 6, 7, 8], reshape(points_14, [3, 27], pad=none), &
      reshape(weights_14, [27], pad=none)), &
    cell_t('13-node pyramid', 27, 13, 5, 8, 5, 18, [1, 2, 0], 3, &
      places_of_pyramid, edges_of_pyramid, [4, 3, 3, 3, 3, 0], faces_of_pyramid, &
      [1, 2, 3, 4, 5, 5, 5, 5], &
      reshape(points_of_cone, [3, 27], pad=none), reshape(weights_of_cone, [27], pad=none))]

  ! What elements are computed as.
  integer, parameter :: hexahedron_nodes = cells(hexahedron_8)%n_nodes
  integer, parameter :: hexahedron_points = cells(hexahedron_8)%n_points

contains

  !> Whether there are nodes in the middles of the edges: the cell is of second order.
  pure elemental logical function has_middles(cell)
    integer, intent(in) :: cell !! row of the table

    has_middles = cells(cell)%n_nodes > cells(cell)%n_corners
  end function has_middles

  !> The row whose shape functions and quadrature an element has: those without mid-side nodes are
  !> computed as hexahedra.
  pure elemental integer function computed_as(cell) result(row)
    integer, intent(in) :: cell !! row of the table

    row = merge(cell, hexahedron_8, has_middles(cell))
  end function computed_as

end module cells_mod
