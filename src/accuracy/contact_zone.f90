!> Where a run's contact acted: what an accuracy refines about.
module contact_zone_mod
  use kinds_mod, only: wp
  use connectivity_mod, only: nodes_of_element
  use mesh_mod, only: mesh_t
  use mesh_size_mod, only: zone_t, is_near
  use contact_points_mod, only: contact_points_t
  use increment_report_mod, only: contact_fields_t
  use sorting_mod, only: order_of_columns
  implicit none
  private

  public :: mark_touched, balls_about, share_near

  integer, parameter :: most_balls = 400

contains

  !> Mark the nodes through which contact presses, of both sides; none where slave faces have
  !> mid-side nodes, for on those none may hang.
  pure subroutine mark_touched(points, contact, touched)
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(in) :: contact
    real(wp), intent(inout) :: touched(:, :) !! (1,n_nodes) 1 where marked, else 0 [-]
    integer :: i

    if (allocated(points%alpha)) return
    do i = 1, points%n
      if (.not. contact%reaction(1, i) > 0.0_wp) cycle
      touched(1, points%node(i)) = 1.0_wp
      associate (first => contact%weights%first(i), last => contact%weights%first(i + 1) - 1)
        touched(1, contact%weights%node(first:last)) = 1.0_wp
      end associate
    end do
  end subroutine mark_touched

  !> Balls that hold the marked nodes of elements, and reach half-way to their neighbours.
  pure function balls_about(mesh, touched, across) result(balls)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: touched(:, :)   !! (1,n_nodes) of mark_touched
    integer, intent(in) :: across           !! axis along which elements stay as they are; 0: none
    real(wp), allocatable :: balls(:, :)    !! (4,n) centre, radius [length]
    real(wp) :: radius(mesh%n_nodes), low(3), cell, half
    integer, allocatable :: nodes(:), cells(:, :), order(:)
    integer :: e, i, n, pass
    logical :: cut(3)
    logical, allocatable :: is_first(:)
    real(wp), parameter :: smallest = 1.0e-9_wp, coarser = 1.25_wp !! cells, of all; one by one [-]
    integer, parameter :: most_passes = 100 !! after that one cell holds all

    cut = [1, 2, 3] /= across
    radius = 0.0_wp
    do e = 1, mesh%n_elements
      associate (nodes => nodes_of_element(mesh%connectivity, e))
        ! Half an edge of a cube with this diagonal; of a square in a slice.
        half = 0.5_wp/sqrt(real(count(cut), wp))*norm2(pack(maxval(mesh%coordinates(:, nodes), &
          2) - minval(mesh%coordinates(:, nodes), 2), cut))
        radius(nodes) = max(radius(nodes), half)
      end associate
    end do
    nodes = pack([(i, i=1, mesh%n_nodes)], touched(1, :) > 0.0_wp .and. radius > 0.0_wp)
    balls = reshape([real(wp) ::], [4, 0])
    if (size(nodes) == 0) return
    if (size(nodes) <= most_balls) then
      balls = reshape([(mesh%coordinates(:, nodes(i)), radius(nodes(i)), i=1, size(nodes))], &
        [4, size(nodes)])
      return
    end if
    ! Too many: one for all in a cell of a grid, which gets coarser until they are few.
    low = minval(mesh%coordinates(:, nodes), 2)
    cell = max(2.0_wp*minval(radius(nodes)), smallest*maxval(maxval(mesh%coordinates(:, nodes), &
      2) - low))
    do pass = 1, most_passes
      cells = floor((mesh%coordinates(:, nodes) - spread(low, 2, size(nodes)))/cell)
      call order_of_columns(cells, order)
      is_first = [(.true., i=1, size(nodes))]
      do i = 2, size(nodes)
        is_first(i) = any(cells(:, order(i)) /= cells(:, order(i - 1)))
      end do
      if (count(is_first) <= most_balls) exit
      cell = coarser*cell
    end do
    deallocate (balls)
    allocate (balls(4, count(is_first)))
    n = 0
    do i = 1, size(nodes)
      associate (node => nodes(order(i)))
        if (is_first(i)) then
          n = n + 1
          balls(:3, n) = low + cell*(real(cells(:, order(i)), wp) + 0.5_wp)
          balls(4, n) = 0.0_wp
        end if
        balls(4, n) = max(balls(4, n), radius(node) + norm2(mesh%coordinates(:, node) - &
          balls(:3, n)))
      end associate
    end do
  end function balls_about

  !> The part of the elements that are in a zone, or in the ring around it [-].
  pure real(wp) function share_near(mesh, balls, across) result(share)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: balls(:, :) !! (4,n)
    integer, intent(in) :: across       !! as of balls_about
    type(zone_t) :: zone
    integer :: e, n

    zone = zone_t(1, balls)
    n = 0
    do e = 1, mesh%n_elements
      associate (nodes => nodes_of_element(mesh%connectivity, e))
        if (is_near(zone, mesh%coordinates(:, nodes), across)) n = n + 1
      end associate
    end do
    share = real(n, wp)/real(max(1, mesh%n_elements), wp)
  end function share_near

end module contact_zone_mod
