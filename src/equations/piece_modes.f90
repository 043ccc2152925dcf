!> Rigid motions of the pieces of a body, and what they do to its degrees of freedom.
!>
!> A body is one piece, unless equations join it: then each piece of its bricks has six motions of
!> its own, and a node without bricks three.
module piece_modes_mod
  use kinds_mod, only: wp
  use mesh_mod, only: mesh_t
  use small_matrix_mod, only: cross
  use dense_mod, only: symmetric_eigenvectors
  implicit none
  private

  public :: pieces_t, extents_t, one_piece, several_pieces, count_columns, modes_of, alike

  real(wp), parameter :: alike = 1.0e-9_wp !! of two numbers: equal but for rounding

  !> The size of a body, for motions that compare.
  type :: extents_t
    real(wp) :: centre(3) = 0.0_wp    !! of its box [length]
    real(wp) :: largest = 0.0_wp      !! side of its box [length]
    real(wp) :: turn(3, 3) = 0.0_wp
    !! columns: rotation about each principal axis that moves no node by more than 1 [1/length]
  end type extents_t

  !> The pieces of a body, and the columns in which their motions stand.
  type :: pieces_t
    type(extents_t), allocatable :: extents(:) !! (n)
    integer, allocatable :: column(:)          !! (n+1) first of each piece
    integer, allocatable :: of_node(:)
    !! (n_nodes) piece of each node, 0 of other bodies; not allocated: there is one piece
  end type pieces_t

contains

  !> A body that is one piece.
  subroutine one_piece(mesh, nodes, pieces, ok)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: nodes(:) !! of the body
    type(pieces_t), intent(out) :: pieces
    logical, intent(out) :: ok      !! false: LAPACK did not converge

    allocate (pieces%extents(1))
    allocate (pieces%column(2), source=[1, 7])
    call measure_body(mesh, nodes, pieces%extents(1), ok)
  end subroutine one_piece

  !> A body that equations join: what elements connect, and each node without any, is a piece.
  subroutine several_pieces(mesh, nodes, pieces, ok)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: nodes(:) !! of the body
    type(pieces_t), intent(out) :: pieces
    logical, intent(out) :: ok      !! false: LAPACK did not converge
    integer :: index_of(mesh%n_pieces), m, n, p
    integer, allocatable :: last(:)

    allocate (pieces%of_node(mesh%n_nodes), source=0)
    index_of = 0
    n = 0
    do m = 1, size(nodes)
      p = mesh%piece(nodes(m))
      if (p == 0) then
        n = n + 1
        pieces%of_node(nodes(m)) = n
        cycle
      end if
      if (index_of(p) == 0) then
        n = n + 1
        index_of(p) = n
      end if
      pieces%of_node(nodes(m)) = index_of(p)
    end do
    allocate (pieces%extents(n))
    allocate (pieces%column(n + 1), last(n))
    ok = .true.
    last = 3
    do p = 1, mesh%n_pieces
      if (index_of(p) == 0) cycle
      last(index_of(p)) = 6
      call measure_body(mesh, pack(nodes, mesh%piece(nodes) == p), pieces%extents(index_of(p)), ok)
      if (.not. ok) return
    end do
    do m = 1, size(nodes)
      if (mesh%piece(nodes(m)) > 0) cycle
      pieces%extents(pieces%of_node(nodes(m)))%centre = mesh%coordinates(:, nodes(m))
    end do
    pieces%column(1) = 1
    do p = 1, n
      pieces%column(p + 1) = pieces%column(p) + last(p)
    end do
  end subroutine several_pieces

  !> How many motions the pieces have.
  pure integer function count_columns(pieces)
    type(pieces_t), intent(in) :: pieces

    count_columns = pieces%column(size(pieces%column)) - 1
  end function count_columns

  !> What some combinations of the motions do to a degree of freedom.
  pure function modes_of(pieces, mesh, node, i, z) result(row)
    type(pieces_t), intent(in) :: pieces
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: node, i !! dof 1, 2, 3
    real(wp), intent(in) :: z(:, :) !! (columns,k)
    real(wp) :: row(size(z, 2))    !! [-]
    real(wp) :: mode(6)
    integer :: p

    p = 1
    if (allocated(pieces%of_node)) p = pieces%of_node(node)
    mode = rigid_mode(pieces%extents(p), mesh%coordinates(:, node), i)
    associate (first => pieces%column(p), last => pieces%column(p + 1) - 1)
      row = matmul(mode(:last - first + 1), z(first:last, :))
    end associate
  end function modes_of

  !> Centre, largest side and principal axes of a body, with how far its nodes reach from each axis.
  subroutine measure_body(mesh, nodes, extents, ok)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: nodes(:) !! of the body
    type(extents_t), intent(out) :: extents
    logical, intent(out) :: ok !! false: LAPACK did not converge
    real(wp) :: low(3), high(3), axis(3, 3), spread_of_axis(3), arm(3), reach(3)
    integer :: node, k, m

    low = huge(1.0_wp)
    high = -huge(1.0_wp)
    do m = 1, size(nodes)
      node = nodes(m)
      low = min(low, mesh%coordinates(:, node))
      high = max(high, mesh%coordinates(:, node))
    end do
    extents%centre = 0.5_wp*(low + high)
    extents%largest = maxval(high - low)
    axis = 0.0_wp
    do m = 1, size(nodes)
      node = nodes(m)
      arm = (mesh%coordinates(:, node) - extents%centre)/extents%largest
      axis = axis + spread(arm, 2, 3)*spread(arm, 1, 3)
    end do
    ! Rounding must not turn the axes of a body that has no preferred ones.
    where (abs(axis) <= alike*maxval(abs(axis))) axis = 0.0_wp
    call symmetric_eigenvectors(axis, spread_of_axis, ok)
    if (.not. ok) return
    reach = 0.0_wp
    do m = 1, size(nodes)
      node = nodes(m)
      arm = mesh%coordinates(:, node) - extents%centre
      do k = 1, 3
        reach(k) = max(reach(k), norm2(cross(axis(:, k), arm)))
      end do
    end do
    do k = 1, 3
      extents%turn(:, k) = axis(:, k)/reach(k)
    end do
  end subroutine measure_body

  !> What the six rigid motions (translations along x, y, z; rotations about the principal axes,
  !> each of at most 1) do to degree of freedom `i` of a point of the body.
  pure function rigid_mode(extents, x, i) result(mode)
    type(extents_t), intent(in) :: extents
    real(wp), intent(in) :: x(3) !! [length]
    integer, intent(in) :: i     !! 1, 2, 3
    real(wp) :: mode(6), moved(3)
    integer :: k

    mode = 0.0_wp
    mode(i) = 1.0_wp
    do k = 1, 3
      moved = cross(extents%turn(:, k), x - extents%centre)
      mode(3 + k) = moved(i)
    end do
  end function rigid_mode

end module piece_modes_mod
