!> Pyramids of 13 nodes, of whose mid-side nodes two orders are in use: that of VTK and of the table
!> of cells, and that of decks that Gmsh writes. In the right one they are nearer to the middles of
!> the edges.
module order_middles_mod
  use cells_mod, only: cells, pyramid_13
  use kinds_mod, only: wp
  use mesh_draft_mod, only: mesh_draft_t, not_a_coordinate
  implicit none
  private

  public :: order_middles

  integer, parameter :: n_middles = cells(pyramid_13)%n_edges
  !> Where Gmsh has the nodes of the table's edges.
  integer, parameter :: of_gmsh(n_middles) = [1, 4, 6, 2, 3, 5, 7, 8]

contains

  !> Put the mid-side nodes of pyramids in the table's order.
  pure subroutine order_middles(draft)
    type(mesh_draft_t), intent(inout) :: draft !! elements are in numbers of nodes
    integer :: e, first, last, middles(n_middles)

    do e = 1, draft%n_elements
      if (draft%connectivity%cell(e) /= pyramid_13) cycle
      last = draft%connectivity%first(e + 1) - 1
      first = last - n_middles + 1
      middles = draft%connectivity%node(first:last)
      if (distance(draft, e, middles(of_gmsh)) < distance(draft, e, middles)) then
        draft%connectivity%node(first:last) = middles(of_gmsh)
      end if
    end do
  end subroutine order_middles

  !> How far nodes are from the middles of the edges of a pyramid: the sum of squares.
  pure real(wp) function distance(draft, e, middles)
    type(mesh_draft_t), intent(in) :: draft
    integer, intent(in) :: e
    integer, intent(in) :: middles(n_middles)
    integer :: ends(2), k

    distance = 0.0_wp
    do k = 1, n_middles
      ends = draft%connectivity%node(draft%connectivity%first(e) - 1 + &
        cells(pyramid_13)%edge(:, k))
      associate (x => draft%coordinates(:, [ends, middles(k)]))
        if (all(x < not_a_coordinate)) distance = distance + sum((x(:, 3) - 0.5_wp*(x(:, 1) + &
          x(:, 2)))**2)
      end associate
    end do
  end function distance

end module order_middles_mod
