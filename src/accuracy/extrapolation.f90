!> What a quantity would be with elements without size, as its values on five meshes and more say,
!> and how wrong that may be.
!>
!> docs/theory.md (10.18), (10.22).
module extrapolation_mod
  use kinds_mod, only: wp
  use convergence_mod, only: fitted_order, least_order, about_twice
  implicit none
  private

  public :: extrapolate, error_after_turn, fewest_meshes

  integer, parameter :: fewest_meshes = 5 !! that it takes
  integer, parameter :: fitted_to = 4     !! meshes is a limit
  real(wp), parameter :: safety = 1.5_wp  !! of the error of a limit [-]
  real(wp), parameter :: least_doubt = 0.15_wp, most_doubt = 0.5_wp !! of an order [-]
  real(wp), parameter :: lowest = 0.4_wp !! order that is thought possible [-]
  real(wp), parameter :: usual = 1.0_wp
  !! order: coarse meshes may show a lower one by accident, whose limit is far off [-]

contains

  !> The limit of values as the sizes go to 0, and its error.
  !>
  !> The limit is that of q + c h^p fitted to the last four sizes. Its error is, with a factor of
  !> safety, how far it is at most from those of other orders, of three sizes, of the four one
  !> before, and of the last two alone.
  pure subroutine extrapolate(h, values, scale, limit, error)
    real(wp), intent(in) :: h(:)            !! (n) sizes, descending, five and more [-]
    real(wp), intent(in) :: values(:, :, :) !! (n_components,n_increments,n) of any unit
    real(wp), intent(in) :: scale           !! > 0, of their unit
    real(wp), intent(out) :: limit(:, :)    !! (n_components,n_increments)
    real(wp), intent(out) :: error
    !! norm over the components, the largest of the increments, as a part of the scale
    real(wp) :: order, doubt, of_three, of_earlier
    integer :: n

    n = size(h)
    order = order_of(n - fitted_to + 1, n)
    of_three = order_of(n - 2, n)
    of_earlier = order_of(n - fitted_to, n - 1)
    doubt = min(max(abs(order - of_three), abs(order - of_earlier), least_doubt), most_doubt)
    limit = limit_of(n - fitted_to + 1, n, order)
    error = safety*max(distance_to(limit_of(n - fitted_to + 1, n, max(usual, order + doubt))), &
      distance_to(limit_of(n - fitted_to + 1, n, max(lowest, order - doubt))), &
      distance_to(limit_of(n - 2, n, of_three)), distance_to(limit_of(n - 1, n, order)), &
      distance_to(limit_of(n - fitted_to, n - 1, of_earlier)))

  contains

    !> The order that fits some of the sizes.
    pure real(wp) function order_of(first, last) result(order)
      integer, intent(in) :: first, last

      order = max(least_order, fitted_order(h(first:last), reshape(values(:, :, first:last), &
        [size(limit), last - first + 1])))
    end function order_of

    !> The limit that some of the sizes have with an order.
    pure function limit_of(first, last, order) result(q)
      integer, intent(in) :: first, last
      real(wp), intent(in) :: order
      real(wp) :: q(size(limit, 1), size(limit, 2))
      real(wp) :: x(first:last), weight(first:last), mean
      integer :: i

      ! Of the straight line that is nearest to the values over h^p, at h = 0.
      x = h(first:last)**order
      mean = sum(x)/size(x)
      x = x - mean
      weight = 1.0_wp/size(x) - mean*x/sum(x**2)
      q = 0.0_wp
      do i = first, last
        q = q + weight(i)*values(:, :, i)
      end do
    end function limit_of

    pure real(wp) function distance_to(other) result(distance)
      real(wp), intent(in) :: other(:, :)

      distance = maxval(norm2(other - limit, dim=1))/scale
    end function distance_to

  end subroutine extrapolate

  !> The error of values whose course over the sizes turns: changes fall faster than with the order
  !> 2, or have turned round, and bend the same way over the last five sizes, as values that scatter
  !> about a limit do not. Such values are as far off as the parabola through three of them goes on.
  pure real(wp) function error_after_turn(h, values, scale, found) result(error)
    real(wp), intent(in) :: h(:)            !! (n) sizes, descending, five and more [-]
    real(wp), intent(in) :: values(:, :, :) !! (n_components,n_increments,n) of any unit
    real(wp), intent(in) :: scale           !! > 0, of their unit
    real(wp), intent(in) :: found(:, :)     !! (n_components,n_increments) what the error is of
    real(wp), parameter :: rapid = 0.5_wp   !! over the fall of the order 2 [-]
    real(wp) :: slope(size(found, 1), size(found, 2), 4), bend(size(found, 1), size(found, 2), 3)
    real(wp) :: off(size(found, 1), size(found, 2)), middle(4)
    integer :: n, i

    n = size(h)
    do i = 1, 4
      associate (a => n - 5 + i, b => n - 4 + i)
        slope(:, :, i) = (values(:, :, b) - values(:, :, a))/scale/(h(a) - h(b))
        middle(i) = 0.5_wp*(h(a) + h(b))
      end associate
    end do
    bend = slope(:, :, 2:) - slope(:, :, :3)
    off = 0.0_wp
    where (abs(sum(sign(1.0_wp, bend), dim=3)) > 2.5_wp .and. (slope(:, :, 4)*slope(:, :, 3) < &
      rapid*middle(4)/middle(3)*slope(:, :, 3)**2 .or. slope(:, :, 4)*slope(:, :, 2) < 0.0_wp)) &
      off = of_parabola() - found
    error = maxval(norm2(off, dim=1))/scale

  contains

    !> What elements without size have on the parabola through the last size, one about twice as
    !> large, and one between.
    pure function of_parabola() result(q)
      real(wp) :: q(size(found, 1), size(found, 2))
      integer :: those(3), i, j
      real(wp) :: weight

      those(3) = n
      those(1) = max(1, count(h(:n - 2) >= about_twice*h(n)))
      those(2) = those(1) + minloc(abs(log(h(those(1) + 1:n - 1)**2/(h(those(1))*h(n)))), dim=1)
      q = 0.0_wp
      do i = 1, 3
        weight = 1.0_wp
        do j = 1, 3
          if (j /= i) weight = weight*h(those(j))/(h(those(j)) - h(those(i)))
        end do
        q = q + weight*values(:, :, those(i))
      end do
    end function of_parabola

  end function error_after_turn

end module extrapolation_mod
