!> The measures of the certificate: sizes of what is wrong, beside the sizes of what is there.
module error_measures_mod
  use kinds_mod, only: wp
  use mesh_mod, only: mesh_t, shown_nodes
  implicit none
  private

  public :: are_finite, largest, largest_alone, largest_spread, ratio, rounded, excusable

  real(wp), parameter :: rounded = 32.0_wp*epsilon(1.0_wp) !! of what is added up: lost in a sum [-]
  real(wp), parameter :: excusable = 1.0e-3_wp !! of a force: the most that rounding may excuse [-]

contains

  !> a/b with 0/0 = 0; something over nothing is infinitely wrong.
  pure function ratio(a, b) result(quotient)
    real(wp), intent(in) :: a, b !! a >= 0, b >= 0
    real(wp) :: quotient

    if (a <= 0.0_wp) then
      quotient = 0.0_wp
    else if (b > 0.0_wp .and. a < b*1.0e100_wp) then
      quotient = a/b
    else
      quotient = huge(1.0_wp)
    end if
  end function ratio

  pure logical function are_finite(v)
    real(wp), intent(in) :: v(:, :)

    are_finite = all(abs(v) <= huge(v))
  end function are_finite

  !> The largest vector of a list.
  pure function largest(v, among) result(size_of_largest)
    real(wp), intent(in) :: v(:, :) !! (3,n)
    logical, intent(in), optional :: among(:) !! (n) those that count
    real(wp) :: size_of_largest
    integer :: i

    size_of_largest = 0.0_wp
    do i = 1, size(v, 2)
      if (present(among)) then
        if (.not. among(i)) cycle
      end if
      size_of_largest = max(size_of_largest, sum(v(:, i)**2))
    end do
    size_of_largest = sqrt(size_of_largest)
  end function largest

  !> The farthest that forces would move their node while all others are held.
  !>
  !> Where loads act on the very nodes that contact holds nothing moves but by rounding, and
  !> displacements are no measure.
  pure real(wp) function largest_alone(force, stiffness) result(way)
    real(wp), intent(in) :: force(:, :)   !! (3,n_nodes) [force]
    real(wp), intent(in) :: stiffness(:)  !! (n_nodes), 0 of nodes without a brick [force/length]
    integer :: node

    way = 0.0_wp
    do node = 1, size(stiffness)
      if (stiffness(node) > 0.0_wp) way = max(way, norm2(force(:, node))/stiffness(node))
    end do
  end function largest_alone

  !> Largest minus smallest of a displacement component over a body: its deformation, free of
  !> translation.
  pure function largest_spread(mesh, u) result(spread)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: u(:, :) !! (3,n_nodes)
    real(wp) :: spread, low(3, mesh%n_bodies), high(3, mesh%n_bodies)
    integer :: node, body

    low = huge(1.0_wp)
    high = -huge(1.0_wp)
    do node = 1, shown_nodes(mesh)
      body = mesh%body(node)
      if (body == 0) cycle
      low(:, body) = min(low(:, body), u(:, node))
      high(:, body) = max(high(:, body), u(:, node))
    end do
    spread = 0.0_wp
    if (mesh%n_bodies > 0) spread = maxval(high - low)
  end function largest_spread

end module error_measures_mod
