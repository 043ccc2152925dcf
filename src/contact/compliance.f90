!> The compliance of the interface: what its nodes move under unit forces on them, the body
!> condensed.
module compliance_mod
  use kinds_mod, only: wp
  use huge_pages_mod, only: prefer_huge_pages
  use dof_map_mod, only: dof_map_t, interface_equations_of
  use contact_points_mod, only: contact_points_t
  implicit none
  private

  public :: rows_of_points, compliance_of_rows, straight

  real(wp), parameter :: straight = 1.0e-12_wp !! a direction cosine below this is 0

contains

  !> The 3x3 block of a matrix over the interface at two nodes, 0 where a direction is prescribed.
  pure function interface_block(map, a, node_i, node_j) result(block)
    type(dof_map_t), intent(in) :: map
    real(wp), intent(in) :: a(:, :)  !! (n_interface,n_interface)
    integer, intent(in) :: node_i, node_j
    real(wp) :: block(3, 3)
    integer :: p, q, eq_i(3), eq_j(3)

    eq_i = interface_equations_of(map, node_i)
    eq_j = interface_equations_of(map, node_j)
    block = 0.0_wp
    do q = 1, 3
      do p = 1, 3
        if (eq_i(p) > 0 .and. eq_j(q) > 0) block(p, q) = a(eq_i(p), eq_j(q))
      end do
    end do
  end function interface_block

  !> Number the rows of every point: a row wherever the point can move along its frame and the law
  !> has a reaction.
  !>
  !> A direction that is prescribed, of the node as of the obstacle, has no compliance and no row;
  !> without friction there are no tangential rows; a point whose normal is prescribed, or that is
  !> out of reach of its obstacle, has none at all (docs/theory.md section 2).
  pure subroutine rows_of_points(prescribed, points, frame, row)
    logical, intent(in) :: prescribed(:, :)       !! (3,n_nodes) reference nodes included
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: frame(:, :, :)        !! (3,3,n_points) columns n, t1, t2
    integer, intent(out) :: row(:, :)             !! (3,n_points) 0 where there is none
    integer :: i, a, n
    logical :: free(3)

    row = 0
    n = 0
    do i = 1, points%n
      if (.not. points%in_reach(i)) cycle
      free = .not. prescribed(:, points%node(i))
      if (points%ref_node(i) > 0) free = free .or. .not. prescribed(:, points%ref_node(i))
      do a = 1, 3
        if (a > 1 .and. (row(1, i) == 0 .or. points%mu(i) <= 0.0_wp)) exit
        if (.not. any(free .and. abs(frame(:, a, i)) > straight)) cycle
        n = n + 1
        row(a, i) = n
      end do
    end do
  end subroutine rows_of_points

  !> W = B C B^T, B the rows of the points over the interface.
  subroutine compliance_of_rows(map, points, frame, row, c, w)
    type(dof_map_t), intent(in) :: map
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: frame(:, :, :)  !! (3,3,n_points) columns n, t1, t2
    integer, intent(in)  :: row(:, :)       !! (3,n_points)
    real(wp), intent(in) :: c(:, :)
    !! (n_interface,n_interface) compliance of the interface [length/force]
    real(wp), allocatable, intent(out) :: w(:, :) !! (n_rows,n_rows) [length/force]
    real(wp) :: block(3, 3)
    integer :: i, j, a, b

    allocate (w(count(row > 0), count(row > 0)))
    call prefer_huge_pages(w)
    do j = 1, points%n
      if (row(1, j) == 0) cycle
      do i = j, points%n
        if (row(1, i) == 0) cycle
        block = matmul(transpose(frame(:, :, i)), matmul( &
          interface_block(map, c, points%node(i), points%node(j)), frame(:, :, j)))
        do b = 1, 3
          do a = 1, 3
            if (row(a, i) == 0 .or. row(b, j) == 0) cycle
            w(row(a, i), row(b, j)) = block(a, b)
            w(row(b, j), row(a, i)) = block(a, b)
          end do
        end do
      end do
    end do
  end subroutine compliance_of_rows

end module compliance_mod
