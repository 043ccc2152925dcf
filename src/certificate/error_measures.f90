!> The measures of the certificate: sizes of what is wrong, beside the sizes of what is there.
module error_measures_mod
  use kinds_mod, only: wp
  use mesh_mod, only: mesh_t, shown_nodes
  implicit none
  private

  public :: are_finite, largest_spread, ratio, rounded, excusable

  real(wp), parameter :: rounded = 32.0_wp*epsilon(1.0_wp)
  !! of what is added up: lost in a sum; 370 random decks end alike with 4 to 256 eps [-]
  real(wp), parameter :: excusable = 1.0e-3_wp
  !! of a force: the most that rounding may excuse, so that what nothing holds, off by 1, never
  !! passes; 370 random decks end alike with 1e-4 to 1e-2 [-]

contains

  !> a/b with 0/0 = 0; something over nothing is infinitely wrong.
  pure real(wp) function ratio(a, b) result(quotient)
    real(wp), intent(in) :: a, b !! a >= 0, b >= 0

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

  !> Largest minus smallest of a displacement component over each body, free of translation.
  pure function largest_spread(mesh, u) result(spread)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: u(:, :) !! (3,n_nodes)
    real(wp) :: spread(mesh%n_bodies), low(3, mesh%n_bodies), high(3, mesh%n_bodies)
    integer :: node, body

    low = huge(1.0_wp)
    high = -huge(1.0_wp)
    do node = 1, shown_nodes(mesh)
      body = mesh%body(node)
      if (body == 0) cycle
      low(:, body) = min(low(:, body), u(:, node))
      high(:, body) = max(high(:, body), u(:, node))
    end do
    spread = maxval(high - low, dim=1)
  end function largest_spread

end module error_measures_mod
