!> *BLOCK: a box of elements, x fastest, with its six faces.
module block_mesh_mod
  use kinds_mod, only: wp
  implicit none
  private

  public :: block_coordinates, block_connectivity, block_face, block_side_nodes
  public :: graded_positions, graded_from_middle
  public :: face_xmin, face_xmax, face_ymin, face_ymax, face_zmin, face_zmax

  integer, parameter :: face_xmin = 1, face_xmax = 2, face_ymin = 3, face_ymax = 4, &
                        face_zmin = 5, face_zmax = 6

contains

  !> Positions 0..1 of n+1 planes whose spacing grows geometrically, the last `ratio` times the
  !> first.
  pure function graded_positions(n, ratio) result(position)
    integer, intent(in) :: n       !! intervals, n >= 1
    real(wp), intent(in) :: ratio  !! last interval over the first, > 0 [-]
    real(wp) :: position(0:n), step, total
    integer :: i

    position(0) = 0.0_wp
    do i = 1, n
      step = ratio**(real(i - 1, wp)/real(max(n - 1, 1), wp))
      position(i) = position(i - 1) + step
    end do
    total = position(n)
    position = position/total
    if (abs(ratio - 1.0_wp) <= 0.0_wp) position = [(real(i, wp)/real(n, wp), i=0, n)]
    position(n) = 1.0_wp
  end function graded_positions

  !> Positions 0..1 of n+1 planes, the same from both ends, whose spacing grows geometrically from
  !> the middle, the outermost `ratio` times that in the middle.
  !>
  !> In the middle are one interval when n is odd, two when it is even.
  pure function graded_from_middle(n, ratio) result(position)
    integer, intent(in) :: n       !! intervals, n >= 1
    real(wp), intent(in) :: ratio  !! outermost interval over the one in the middle, > 0 [-]
    real(wp) :: position(0:n), total
    real(wp) :: half(0:(n + 1)/2)
    integer :: i, m

    ! From an end to the middle; of an odd number the last interval is cut in half.
    m = (n + 1)/2
    half = graded_positions(m, 1.0_wp/ratio)
    if (mod(n, 2) == 1) half(m) = 0.5_wp*(half(m - 1) + half(m))
    total = 2.0_wp*half(m)
    do i = 0, m - 1
      position(i) = half(i)/total
      position(n - i) = 1.0_wp - position(i)
    end do
    if (mod(n, 2) == 0) position(m) = 0.5_wp
  end function graded_from_middle

  !> Nodes of the box, x fastest, then y, then z.
  pure function block_coordinates(corner, length, x, y, z) result(coordinates)
    real(wp), intent(in) :: corner(3)           !! smallest x, y, z [length]
    real(wp), intent(in) :: length(3)           !! edges [length]
    real(wp), intent(in) :: x(0:), y(0:), z(0:) !! positions 0..1 of the planes
    real(wp), allocatable :: coordinates(:, :)  !! (3, n_nodes)
    integer :: i, j, k, node

    allocate (coordinates(3, size(x)*size(y)*size(z)))
    node = 0
    do k = 0, ubound(z, 1)
      do j = 0, ubound(y, 1)
        do i = 0, ubound(x, 1)
          node = node + 1
          coordinates(:, node) = corner + length*[x(i), y(j), z(k)]
        end do
      end do
    end do
  end function block_coordinates

  !> Elements of the box, x fastest; node numbers from 1 as in `block_coordinates`.
  pure function block_connectivity(n) result(connectivity)
    integer, intent(in) :: n(3)               !! elements along x, y, z
    integer, allocatable :: connectivity(:, :) !! (8, n_elements)
    integer :: i, j, k, e, base, row, layer

    row = n(1) + 1
    layer = row*(n(2) + 1)
    allocate (connectivity(8, n(1)*n(2)*n(3)))
    e = 0
    do k = 0, n(3) - 1
      do j = 0, n(2) - 1
        do i = 0, n(1) - 1
          e = e + 1
          base = 1 + i + row*j + layer*k
          connectivity(:4, e) = [base, base + 1, base + 1 + row, base + row]
          connectivity(5:, e) = connectivity(:4, e) + layer
        end do
      end do
    end do
  end function block_connectivity

  !> The faces (element, face 1..6) on one side of the box, in the order of the elements.
  pure function block_face(n, side) result(faces)
    integer, intent(in) :: n(3)       !! elements along x, y, z
    integer, intent(in) :: side       !! face_xmin .. face_zmax
    integer, allocatable :: faces(:, :) !! (2, n_faces)
    integer, parameter :: element_face(6) = [6, 4, 3, 5, 1, 2] ! of each side, as in surfaces
    integer :: first(3), last(3), i, j, k, m

    call find_layer(n, side, first, last)
    allocate (faces(2, product(last - first + 1)))
    m = 0
    do k = first(3), last(3)
      do j = first(2), last(2)
        do i = first(1), last(1)
          m = m + 1
          faces(:, m) = [1 + i + n(1)*(j + n(2)*k), element_face(side)]
        end do
      end do
    end do
  end function block_face

  !> The nodes on one side of a block, ascending.
  pure function block_side_nodes(n, side) result(nodes)
    integer, intent(in) :: n(3)  !! elements along x, y, z; none at all where one is 0
    integer, intent(in) :: side  !! face_xmin .. face_zmax
    integer, allocatable :: nodes(:)
    integer :: first(3), last(3), i, j, k, m

    if (any(n == 0)) then
      allocate (nodes(0))
      return
    end if
    call find_layer(n + 1, side, first, last)
    allocate (nodes(product(last - first + 1)))
    m = 0
    do k = first(3), last(3)
      do j = first(2), last(2)
        do i = first(1), last(1)
          m = m + 1
          nodes(m) = 1 + i + (n(1) + 1)*(j + (n(2) + 1)*k)
        end do
      end do
    end do
  end function block_side_nodes

  !> The outermost layer on one side of a grid of elements or nodes, which count from 0.
  pure subroutine find_layer(n, side, first, last)
    integer, intent(in) :: n(3)  !! along x, y, z
    integer, intent(in) :: side  !! face_xmin .. face_zmax
    integer, intent(out) :: first(3), last(3)
    integer :: axis

    axis = (side + 1)/2
    first = 0
    last = n - 1
    if (mod(side, 2) == 1) then
      last(axis) = 0
    else
      first(axis) = last(axis)
    end if
  end subroutine find_layer

end module block_mesh_mod
