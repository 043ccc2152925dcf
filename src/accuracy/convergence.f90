!> What the values of a quantity on three meshes, or with increments of three sizes, say of its
!> error: Richardson's extrapolation with the order that is observed; of two, with the first order.
!>
!> docs/theory.md (10.9) to (10.11).
module convergence_mod
  use kinds_mod, only: wp
  implicit none
  private

  public :: growth_of_cost, growth_with_parts, least_order, most_order, order_of_elements, &
    order_of_increments, safety, safety_of_two, about_twice, convergence_t, &
    observe_convergence, assume_first_order, fitted_order, error_at_least, &
    error_by_differences, size_for_error

  real(wp), parameter :: growth_of_cost = 4.0_wp
  !! a mesh whose error is to be so many times smaller takes that to this power of the time: errors
  !! of the first order, and sparse factors that take h^-4.8 (10.12)
  real(wp), parameter :: growth_with_parts = 0.6_wp
  !! increments in so many parts take that to this power of the time: two 1.2 to 1.8 times, four 1.5
  !! to 3.3 times on the scenes of docs/studies/asked-accuracy.md [-]
  real(wp), parameter :: least_order = 0.5_wp, most_order = 1.5_wp
  !! that are believed: a higher one makes more estimates too small, (10.9)
  real(wp), parameter :: order_of_elements = 2.0_wp, order_of_increments = 1.0_wp
  !! the highest that any part of an error has in the size of elements, and of increments, each of
  !! which has one direction of slip
  real(wp), parameter :: safety = 1.4_wp, safety_of_two = 3.0_wp
  !! of an error with three meshes and with two: Roache's index has 1.25 and 3; with 1.25 one
  !! of twenty errors of random scenes was estimated too small [-]
  real(wp), parameter :: about_twice = 1.9_wp
  !! a size over another that is distant enough: twice, but for whole numbers of elements [-]

  !> How a quantity converges.
  type :: convergence_t
    real(wp) :: order = 0.0_wp  !! observed, between the least and the most that are believed [-]
    real(wp) :: error = 0.0_wp  !! of the finest value, in its own unit, with the factor of safety
    real(wp) :: weight = 0.0_wp
    !! extrapolated = finest + weight (finest - next coarser) [-]
    logical  :: converges = .true. !! changes get smaller with the size
  end type convergence_t

contains

  !> From the changes between three sizes, the coarsest first.
  !>
  !> Of an order p they are as h1^p - h2^p and h2^p - h3^p. Where the later change is accidentally
  !> small, the earlier one still says how large the error may be with the highest order.
  pure type(convergence_t) function observe_convergence(h, changes, highest_order) result(observed)
    real(wp), intent(in) :: h(3)          !! descending [-]
    real(wp), intent(in) :: changes(2)    !! sizes of the differences, 1 to 2 and 2 to 3
    real(wp), intent(in) :: highest_order !! that an error in these sizes has [-]
    real(wp) :: low, high, middle
    integer :: i

    observed%order = min(most_order, highest_order)
    if (.not. maxval(changes) > 0.0_wp) return
    ! As if the order were above 0.
    observed%converges = changes(2)*log(h(1)/h(2)) < changes(1)*log(h(2)/h(3))
    low = least_order
    high = observed%order
    if (changes(2) >= changes(1)*falls_by(low)) then
      high = low
    else if (changes(2) <= changes(1)*falls_by(high)) then
      low = high
    end if
    do i = 1, 50
      middle = 0.5_wp*(low + high)
      if (changes(2) > changes(1)*falls_by(middle)) then
        high = middle
      else
        low = middle
      end if
    end do
    observed%order = 0.5_wp*(low + high)
    associate (p => observed%order)
      observed%weight = h(3)**p/(h(2)**p - h(3)**p)
      observed%error = safety*max(changes(2)*observed%weight, &
        changes(1)*h(3)**p/(h(1)**p - h(2)**p))
    end associate

  contains

    !> The second change over the first with an order: it falls as the order grows.
    pure real(wp) function falls_by(p)
      real(wp), intent(in) :: p

      falls_by = (h(2)**p - h(3)**p)/(h(1)**p - h(2)**p)
    end function falls_by

  end function observe_convergence

  !> The order of values q + c h^p that are nearest to those given, in the sum of squares over all
  !> components. docs/theory.md (10.15).
  pure real(wp) function fitted_order(h, values) result(order)
    real(wp), intent(in) :: h(:)         !! (n) sizes, three and more [-]
    real(wp), intent(in) :: values(:, :) !! (n_components,n) of any unit
    real(wp), parameter :: lowest = 0.25_wp, step = 0.05_wp !! of the orders that are tried [-]
    real(wp) :: x(size(h)), far(size(values, 1), size(h)), least, left
    integer :: i

    order = lowest
    least = huge(1.0_wp)
    far = values - spread(sum(values, 2)/size(h), 2, size(h))
    do i = 0, nint((order_of_elements - lowest)/step)
      x = h**(lowest + i*step)
      x = x - sum(x)/size(x)
      left = sum((far - spread(matmul(far, x), 2, size(h))*spread(x, 1, size(values, 1))/ &
        dot_product(x, x))**2)
      if (left >= least) cycle
      least = left
      order = lowest + i*step
    end do
  end function fitted_order

  !> The error of the last size that is possible after a change between two sizes, the coarser
  !> first: none falls faster than with the highest order.
  pure real(wp) function error_at_least(h, change, last, highest_order) result(error)
    real(wp), intent(in) :: h(2)          !! descending [-]
    real(wp), intent(in) :: change        !! between them
    real(wp), intent(in) :: last          !! no larger than these [-]
    real(wp), intent(in) :: highest_order !! [-]

    error = safety*change*last**highest_order/(h(1)**highest_order - h(2)**highest_order)
  end function error_at_least

  !> The error of the last size from what coarser ones differ from it, with a given order. Where
  !> values scatter about their limit that is steadier than the change of the last two.
  pure real(wp) function error_by_differences(h, changes, order) result(error)
    real(wp), intent(in) :: h(:)       !! (n) descending [-]
    real(wp), intent(in) :: changes(:) !! (n-1) of each but the last, from it
    real(wp), intent(in) :: order      !! > 0 [-]

    associate (last => h(size(h))**order, before => h(:size(h) - 1)**order)
      error = safety*maxval(changes*last/(before - last))
    end associate
  end function error_by_differences

  !> From the change between two sizes, the coarser first.
  pure type(convergence_t) function assume_first_order(h, change) result(assumed)
    real(wp), intent(in) :: h(2)   !! descending [-]
    real(wp), intent(in) :: change !! size of the difference

    assumed%order = 1.0_wp
    assumed%error = safety_of_two*change*h(2)/(h(1) - h(2))
  end function assume_first_order

  !> The size at which the error is what it is to be.
  pure real(wp) function size_for_error(h, error, wanted, order)
    real(wp), intent(in) :: h, error  !! size, and error there
    real(wp), intent(in) :: wanted    !! > 0
    real(wp), intent(in) :: order     !! > 0 [-]

    size_for_error = h
    if (error > 0.0_wp) size_for_error = h*(wanted/error)**(1.0_wp/order)
  end function size_for_error

end module convergence_mod
