!> Rows of ties: of nodes, each by itself, which turn with their masters.
module tied_rows_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: solve_small
  use contact_points_mod, only: weights_t
  use mortar_rows_mod, only: mortar_t
  use weight_rows_mod, only: entries_t, append_entry, make_rows
  implicit none
  private

  public :: rows_of_nodes, take_up_shifts

contains

  !> Rows of the nodes in the middles of edges themselves, from those of their points and of the
  !> ends of the edges: u_m = (1 - 2 alpha) q_m + alpha (u_1 + u_2). An end that is not covered
  !> enough stays as it is.
  pure subroutine rows_of_nodes(nodes, number, ends, alpha, mortar)
    integer, intent(in) :: nodes(:)      !! (n) of the slave
    integer, intent(in) :: number(:)     !! (n_nodes) rows of these
    integer, intent(in) :: ends(:, :)    !! (2,n_nodes) as of find_middles
    real(wp), intent(in) :: alpha(:)     !! (n_nodes) the same [-]
    type(mortar_t), intent(inout) :: mortar
    type(entries_t) :: entries
    type(weights_t) :: weights
    real(wp) :: one(size(nodes))
    integer :: i, k

    do i = 1, size(nodes)
      associate (a => alpha(nodes(i)))
        call append_row(i, i, 1.0_wp - 2.0_wp*a, entries)
        if (.not. a > 0.0_wp) cycle
        do k = 1, 2
          associate (row => number(ends(k, nodes(i))))
            if (mortar%area(row) > mortar%least(row)*mortar%whole_area(row)) then
              call append_row(i, row, a, entries)
            else
              call append_entry(i, nodes(row), a, entries)
            end if
          end associate
        end do
      end associate
    end do
    one = merge(1.0_wp, 0.0_wp, mortar%area > 0.0_wp)
    call make_rows(one, entries, weights)
    mortar%weights = weights

  contains

    pure subroutine append_row(to, from, factor, entries)
      integer, intent(in) :: to, from
      real(wp), intent(in) :: factor
      type(entries_t), intent(inout) :: entries
      integer :: k

      associate (rows => mortar%weights)
        do k = rows%first(from), rows%first(from + 1) - 1
          call append_entry(to, rows%node(k), factor*rows%weight(k), entries)
        end do
      end associate
    end subroutine append_row

  end subroutine rows_of_nodes

  !> Weights that give the places of the slave nodes exactly as far as they lie along their master,
  !> for what is tied must turn with it: the least change relative to the weights that takes up the
  !> shift along the master's faces. What is left of `apart` is across them. Of a flat master
  !> nothing changes but rounding, which grows where little of a node is covered: what is tied goes
  !> where its master goes, however far. docs/theory.md (11.12).
  pure subroutine take_up_shifts(slave_nodes, x, mortar)
    integer, intent(in) :: slave_nodes(:) !! (n) as of `make_mortar`
    real(wp), intent(in) :: x(:, :)       !! (3,n_nodes) [length]
    type(mortar_t), intent(inout) :: mortar
    real(wp) :: middle(3), arm(3), s(3, 3), trace, shift(3), slope(3), rounding
    integer :: i, k, l, pass
    logical :: regular

    rounding = 4.0_wp*epsilon(1.0_wp)*maxval(abs(x))
    do i = 1, size(slave_nodes)
      associate (first => mortar%weights%first(i), last => mortar%weights%first(i + 1) - 1, &
                 node => mortar%weights%node, weight => mortar%weights%weight, &
                 apart => mortar%apart(:, i), normal => mortar%normal(:, i))
        if (last < first) cycle
        weight(first:last) = weight(first:last)/sum(weight(first:last))
        if (last == first) cycle
        passes: do pass = 1, 3
          if (norm2(apart - dot_product(apart, normal)*normal) <= rounding) exit passes
          middle = matmul(x(:, node(first:last)), abs(weight(first:last)))/ &
            sum(abs(weight(first:last)))
          s = 0.0_wp
          do k = first, last
            arm = x(:, node(k)) - middle
            do l = 1, 3
              s(:, l) = s(:, l) + abs(weight(k))*arm*arm(l)
            end do
          end do
          ! Nodes of flat faces say nothing across them.
          trace = s(1, 1) + s(2, 2) + s(3, 3)
          do l = 1, 3
            s(:, l) = s(:, l) + trace*normal*normal(l)
          end do
          shift = apart - dot_product(apart, normal)*normal
          call solve_small(s, shift, slope, regular)
          if (.not. regular) exit passes
          do k = first, last
            weight(k) = weight(k) + abs(weight(k))*dot_product(slope, x(:, node(k)) - middle)
          end do
          weight(first:last) = weight(first:last)/sum(weight(first:last))
          apart = x(:, slave_nodes(i)) - matmul(x(:, node(first:last)), weight(first:last))
        end do passes
      end associate
    end do
  end subroutine take_up_shifts

end module tied_rows_mod
