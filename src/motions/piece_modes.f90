!> Rigid motions of the pieces of a body, and what they do to its degrees of freedom.
!>
!> A body is one piece, unless equations or springs join it: then each piece of its elements has six
!> motions of its own, and a node without elements three.
module piece_modes_mod
  use kinds_mod, only: wp
  use constraints_mod, only: constraints_t
  use spring_elements_mod, only: spring_direction, spring_ends
  use mesh_mod, only: mesh_t
  use small_matrix_mod, only: cross
  use dense_mod, only: symmetric_eigenvectors, singular_values
  implicit none
  private

  public :: pieces_t, one_piece, several_pieces, moving_columns, leave_free, modes_of, alike, &
    rank_tolerance

  real(wp), parameter :: alike = 1.0e-9_wp !! of two numbers: equal but for rounding

  ! of the largest singular value: sines of 1e-8 count as held, as at the edge of a thin plate
  real(wp), parameter :: rank_tolerance = 1.0e-9_wp

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

  !> The motions of the pieces but those of single nodes that supports hold: many of these are.
  pure function moving_columns(mesh, nodes, pieces, prescribed) result(columns)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: nodes(:)          !! of the body
    type(pieces_t), intent(in) :: pieces
    logical, intent(in) :: prescribed(:, :)
    integer, allocatable :: columns(:)
    logical :: moves(count_columns(pieces))
    integer :: m, c

    moves = .true.
    do m = 1, size(nodes)
      if (mesh%piece(nodes(m)) > 0) cycle
      c = pieces%column(pieces%of_node(nodes(m)))
      moves(c:c + 2) = .not. prescribed(:, nodes(m))
    end do
    columns = pack([(c, c=1, size(moves))], moves)
  end function moving_columns

  !> The combinations of the motions of the pieces that neither supports nor springs see, and that
  !> satisfy all constraints.
  subroutine leave_free(mesh, nodes, pieces, prescribed, constraints, z, ok, n_free)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: nodes(:)          !! of the body
    type(pieces_t), intent(in) :: pieces
    logical, intent(in) :: prescribed(:, :)
    type(constraints_t), intent(in) :: constraints !! of the scene
    real(wp), allocatable, intent(out) :: z(:, :)  !! (columns,k) orthonormal
    logical, intent(out) :: ok                     !! false: LAPACK did not converge
    integer, intent(in), optional :: n_free        !! how many there are; left out: is found
    real(wp), allocatable :: seen(:, :), each(:, :), v(:, :), s(:), row(:)
    integer, allocatable :: columns(:)
    real(wp) :: total
    integer :: n, n_seen, i, k, m, c

    columns = moving_columns(mesh, nodes, pieces, prescribed)
    n = size(columns)
    allocate (seen(8*n + 256, n), each(count_columns(pieces), n), v(n, n), s(n), row(n))
    each = 0.0_wp
    do k = 1, n
      each(columns(k), k) = 1.0_wp
    end do
    ok = .true.
    n_seen = 0
    do m = 1, size(nodes)
      do i = 1, 3
        if (ok .and. prescribed(i, nodes(m))) call add(modes_of(pieces, mesh, nodes(m), i, each))
      end do
    end do
    do c = 1, constraints%n
      associate (first => constraints%first(c), last => constraints%first(c + 1) - 1)
        if (mesh%body(constraints%node(c)) /= mesh%body(nodes(1))) cycle
        if (.not. ok .or. prescribed(constraints%dof(c), constraints%node(c))) cycle
        row = modes_of(pieces, mesh, constraints%node(c), constraints%dof(c), each)
        total = 1.0_wp
        do k = first, last
          if (prescribed(constraints%master_dof(k), constraints%master(k))) cycle
          row = row - constraints%weight(k)*modes_of(pieces, mesh, constraints%master(k), &
            constraints%master_dof(k), each)
          total = total + abs(constraints%weight(k))
        end do
        ! Beside what is added up: what rounding leaves of a motion that satisfies it is none.
        call add(row/total)
      end associate
    end do
    do c = 1, mesh%springs%n
      if (.not. ok .or. mesh%body(mesh%springs%node(mesh%springs%first(c))) /= &
        mesh%body(nodes(1))) cycle
      call add(elongation_of(c))
    end do
    if (ok) call singular_values(seen(:n_seen, :), s, v, ok)
    k = 0
    if (ok) k = count(s <= rank_tolerance*max(s(1), tiny(1.0_wp)))
    if (ok .and. present(n_free)) k = n_free
    allocate (z(count_columns(pieces), k), source=0.0_wp)
    z(columns, :) = v(:, n - k + 1:)

  contains

    !> What motions change the length of a spring by, as part of what they move its ends by.
    pure function elongation_of(spring) result(of_motions)
      integer, intent(in) :: spring
      real(wp) :: of_motions(n)
      integer :: i, m

      of_motions = 0.0_wp
      associate (ends => spring_ends(mesh%springs, spring), &
                 direction => spring_direction(mesh%springs, spring, mesh%coordinates))
        do m = 1, size(ends)
          do i = 1, 3
            if (prescribed(i, ends(m))) cycle
            of_motions = of_motions + direction(i, m)*modes_of(pieces, mesh, ends(m), i, each)
          end do
        end do
        of_motions = of_motions/max(sum(abs(direction)), tiny(1.0_wp))
      end associate
    end function elongation_of

    !> One more of what is seen. When there is no more room, what all see together takes its place.
    subroutine add(of_motions)
      real(wp), intent(in) :: of_motions(:)
      integer :: l

      if (.not. any(abs(of_motions) > 0.0_wp)) return
      if (n_seen == size(seen, 1)) then
        call singular_values(seen, s, v, ok)
        if (.not. ok) return
        do l = 1, n
          seen(l, :) = s(l)*v(:, l)
        end do
        n_seen = n
      end if
      n_seen = n_seen + 1
      seen(n_seen, :) = of_motions
    end subroutine add

  end subroutine leave_free

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
