!> Weights of tied nodes in whose rows there are nodes of the slave itself.
!>
!> Beside nodes that hang the row of a slave node i says where a mean of slave nodes is. In terms of
!> the master alone, docs/theory.md (11.15b),
!>
!>     u_i = sum over the master of w_ik u_k + sum over the slave of c_ij u_j:   (I - C) U = W.
module own_weights_mod
  use contact_points_mod, only: weights_t
  use dense_mod, only: solve_dense
  use growing_lists_mod, only: append
  use kinds_mod, only: wp
  implicit none
  private

  public :: solve_for_own

  !> Weights of one node.
  type :: row_t
    integer, allocatable :: node(:)    !! each once
    real(wp), allocatable :: weight(:) !! [-]
  end type row_t

contains

  !> Replace tied nodes, and nodes that hang from them, in the rows of a slave surface.
  !>
  !> Nodes of the slave that are not tied stay in the rows: they move by themselves.
  subroutine solve_for_own(nodes, tied, hanging, n_nodes, weights)
    integer, intent(in) :: nodes(:)      !! (n) of the slave
    logical, intent(in) :: tied(:)       !! (n) the node follows its master
    integer, intent(in) :: hanging(:, :) !! (5,m) as of slave_t
    integer, intent(in) :: n_nodes       !! of the mesh
    type(weights_t), intent(inout) :: weights !! a row for each slave node
    type(row_t) :: rows(size(nodes))
    integer :: number(n_nodes)      !! rows of tied nodes
    integer :: between(4, n_nodes)  !! what nodes that hang lie between
    integer, allocatable :: cluster(:)
    integer :: i

    number = 0
    between = 0
    do i = 1, size(hanging, 2)
      between(:, hanging(1, i)) = hanging(2:, i)
    end do
    do i = 1, size(nodes)
      if (tied(i)) number(nodes(i)) = i
      associate (first => weights%first(i), last => weights%first(i + 1) - 1)
        rows(i) = without_hanging(weights%node(first:last), weights%weight(first:last), between)
      end associate
    end do
    allocate (cluster(0))
    do i = 1, size(nodes)
      if (.not. tied(i)) cycle
      if (all(number(rows(i)%node) == 0)) cycle
      cluster = cluster_of(i, rows, number)
      call solve_cluster(cluster, number, rows)
    end do
    deallocate (weights%node, weights%weight)
    weights%first(1) = 1
    do i = 1, size(nodes)
      weights%first(i + 1) = weights%first(i) + size(rows(i)%node)
    end do
    weights%node = [(rows(i)%node, i=1, size(nodes))]
    weights%weight = [(rows(i)%weight, i=1, size(nodes))]
  end subroutine solve_for_own

  !> A row with the means in the place of nodes that hang; each node once.
  pure type(row_t) function without_hanging(node, weight, between) result(row)
    integer, intent(in) :: node(:)
    real(wp), intent(in) :: weight(:)
    integer, intent(in) :: between(:, :) !! (4,n_nodes)
    integer :: i, k, m

    allocate (row%node(0), row%weight(0))
    do i = 1, size(node)
      m = count(between(:, node(i)) > 0)
      if (m == 0) call add(node(i), weight(i), row)
      do k = 1, m
        call add(between(k, node(i)), weight(i)/real(m, wp), row)
      end do
    end do

  contains

    pure subroutine add(node, weight, row)
      integer, intent(in) :: node
      real(wp), intent(in) :: weight
      type(row_t), intent(inout) :: row
      integer :: at

      at = findloc(row%node, node, dim=1)
      if (at > 0) then
        row%weight(at) = row%weight(at) + weight
      else
        row%node = [row%node, node]
        row%weight = [row%weight, weight]
      end if
    end subroutine add

  end function without_hanging

  !> A row and those that it needs, directly or through others.
  pure function cluster_of(start, rows, number) result(cluster)
    integer, intent(in) :: start
    type(row_t), intent(in) :: rows(:)
    integer, intent(in) :: number(:) !! (n_nodes)
    integer, allocatable :: cluster(:)
    logical :: seen(size(rows))
    integer :: n, at, k

    allocate (cluster(64))
    n = 0
    seen = .false.
    seen(start) = .true.
    call append(cluster, n, start)
    at = 0
    do while (at < n)
      at = at + 1
      associate (row => rows(cluster(at)))
        do k = 1, size(row%node)
          associate (needed => number(row%node(k)))
            if (needed == 0) cycle
            if (seen(needed)) cycle
            seen(needed) = .true.
            call append(cluster, n, needed)
          end associate
        end do
      end associate
    end do
    cluster = cluster(:n)
  end function cluster_of

  !> Solve for the rows of a cluster. Those that were solved before stay as they are.
  subroutine solve_cluster(cluster, number, rows)
    integer, intent(in) :: cluster(:) !! (m) rows
    integer, intent(in) :: number(:)  !! (n_nodes) rows of tied nodes
    type(row_t), intent(inout) :: rows(:)
    real(wp) :: left(size(cluster), size(cluster)), inverse(size(cluster), size(cluster))
    real(wp) :: sums(size(number))
    type(row_t) :: outside(size(cluster))
    integer :: at(size(rows)), touched(size(number)), place(size(number)), i, j, k, n

    at = 0
    at(cluster) = [(i, i=1, size(cluster))]
    left = 0.0_wp
    inverse = 0.0_wp
    do i = 1, size(cluster)
      left(i, i) = 1.0_wp
      inverse(i, i) = 1.0_wp
      associate (row => rows(cluster(i)))
        do k = 1, size(row%node)
          j = number(row%node(k))
          if (j > 0) left(i, at(j)) = left(i, at(j)) - row%weight(k)
        end do
        outside(i)%node = pack(row%node, number(row%node) == 0)
        outside(i)%weight = pack(row%weight, number(row%node) == 0)
      end associate
    end do
    call solve_dense(left, inverse)
    place = 0
    do i = 1, size(cluster)
      n = 0
      do j = 1, size(cluster)
        if (abs(inverse(i, j)) <= epsilon(1.0_wp)) cycle ! what is far has no part
        do k = 1, size(outside(j)%node)
          associate (node => outside(j)%node(k))
            if (place(node) == 0) then
              n = n + 1
              place(node) = n
              touched(n) = node
              sums(n) = 0.0_wp
            end if
            sums(place(node)) = sums(place(node)) + inverse(i, j)*outside(j)%weight(k)
          end associate
        end do
      end do
      rows(cluster(i))%node = touched(:n)
      rows(cluster(i))%weight = sums(:n)
      place(touched(:n)) = 0
    end do
  end subroutine solve_cluster

end module own_weights_mod
