!> Facets of what a profile sweeps: a polygon in a plane, moved along an axis or turned about it.
!>
!> The body is to the left of the profile, as it is walked along.
module swept_profile_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: cross, perpendicular_to
  implicit none
  private

  public :: facets_t, sweep_along, turn_about_axis, add_arc, frustum

  real(wp), parameter :: pi = acos(-1.0_wp)

  !> Corners and facets as `obstacle_of_facets` wants them.
  type :: facets_t
    real(wp), allocatable :: corner(:, :) !! (3,n_corners) [length]
    integer, allocatable :: facet(:, :)   !! (4,n_facets) the fourth is 0 in a triangle
  end type facets_t

contains

  !> What a polygon in the plane of two axes sweeps along the third.
  pure type(facets_t) function sweep_along(polygon, origin, axes, from, to) result(swept)
    real(wp), intent(in) :: polygon(:, :) !! (2,n) along the first two axes [length]
    real(wp), intent(in) :: origin(3)     !! [length]
    real(wp), intent(in) :: axes(3, 3)    !! columns, unit vectors [-]
    real(wp), intent(in) :: from, to      !! along the third axis [length]
    integer :: i, n

    n = size(polygon, 2)
    allocate (swept%corner(3, 2*n), swept%facet(4, n - 1))
    do i = 1, n
      swept%corner(:, i) = origin + matmul(axes, [polygon(:, i), from])
      swept%corner(:, n + i) = origin + matmul(axes, [polygon(:, i), to])
    end do
    do i = 1, n - 1
      swept%facet(:, i) = [i, n + i, n + i + 1, i + 1]
    end do
  end function sweep_along

  !> What a polygon of distances from an axis and places along it sweeps about that.
  !>
  !> Corners are as far out that chords are at the distance of the polygon in the mean: of a circle
  !> their error is (pi/n)^2/3 of the radius at the corners, half of it at the middles.
  pure type(facets_t) function turn_about_axis(polygon, origin, axis, n) result(turned)
    real(wp), intent(in) :: polygon(:, :) !! (2,m) distance from the axis, >= 0; place [length]
    real(wp), intent(in) :: origin(3)     !! [length]
    real(wp), intent(in) :: axis(3)       !! unit vector [-]
    integer, intent(in) :: n              !! facets about the axis
    real(wp) :: out(3), beside(3)
    integer :: i, k, next, m, used

    m = size(polygon, 2)
    allocate (turned%corner(3, n*m), turned%facet(4, n*(m - 1)))
    out = perpendicular_to(axis)
    beside = cross(axis, out)
    do k = 1, n
      do i = 1, m
        turned%corner(:, m*(k - 1) + i) = origin + polygon(2, i)*axis + (1.0_wp + (pi/n)**2/3)* &
          polygon(1, i)*(cosine(k - 1, n)*out + cosine(4*(k - 1) - n, 4*n)*beside)
      end do
    end do
    used = 0
    do k = 1, n
      next = m*modulo(k, n)
      do i = 1, m - 1
        associate (here => m*(k - 1) + i, there => next + i, on_axis => polygon(1, i:i + 1) <= &
                   0.0_wp)
          if (all(on_axis)) cycle
          used = used + 1
          turned%facet(:, used) = [here, here + 1, there + 1, there]
          if (on_axis(1)) turned%facet(:, used) = [here, here + 1, there + 1, 0]
          if (on_axis(2)) turned%facet(:, used) = [here, here + 1, there, 0]
        end associate
      end do
    end do
    turned%facet = turned%facet(:, :used)
  end function turn_about_axis

  !> The cosine of k/n of a full turn, exactly the same in all four quarters.
  pure real(wp) function cosine(k, n)
    integer, intent(in) :: k, n
    integer :: at

    at = modulo(k, n)
    if (2*at > n) at = n - at
    if (4*at == n) then
      cosine = 0.0_wp
    else if (4*at < n) then
      cosine = cos(2.0_wp*pi*at/n)
    else
      cosine = -cos(pi*(n - 2*at)/n)
    end if
  end function cosine

  !> Points on an arc behind the last point of a polygon, its end the last of them.
  pure subroutine add_arc(polygon, centre, last, widest)
    real(wp), allocatable, intent(inout) :: polygon(:, :) !! (2,n) [length]
    real(wp), intent(in) :: centre(2), last(2)            !! of an arc below a full turn [length]
    real(wp), intent(in) :: widest                        !! angle of a chord [rad]
    real(wp) :: first(2), angle, c, s
    real(wp), allocatable :: arc(:, :)
    integer :: i, n

    first = polygon(:, size(polygon, 2)) - centre
    associate (b => last - centre)
      angle = atan2(first(1)*b(2) - first(2)*b(1), dot_product(first, b))
    end associate
    n = max(1, ceiling(abs(angle)/widest - 1.0e-9_wp))
    allocate (arc(2, n))
    do i = 1, n - 1
      c = cos(angle*i/n)
      s = sin(angle*i/n)
      arc(:, i) = centre + [c*first(1) - s*first(2), s*first(1) + c*first(2)]
    end do
    arc(:, n) = last
    polygon = reshape([polygon, arc], [2, size(polygon, 2) + n])
  end subroutine add_arc

  !> The profile of a truncated cone: with its ends, seen from outside; or the hollow one without.
  pure function frustum(radius, height, inner) result(polygon)
    real(wp), intent(in) :: radius(2) !! where it begins, and at the height [length]
    real(wp), intent(in) :: height    !! [length]
    logical, intent(in) :: inner      !! the body is inside
    real(wp), allocatable :: polygon(:, :) !! (2,n) as of turn_about_axis

    if (inner) then
      polygon = reshape([radius(1), 0.0_wp, radius(2), height], [2, 2])
    else
      polygon = reshape([0.0_wp, height, radius(2), height, radius(1), 0.0_wp, 0.0_wp, 0.0_wp], &
        [2, 4])
      if (.not. radius(2) > 0.0_wp) polygon = polygon(:, 2:)
      if (.not. radius(1) > 0.0_wp) polygon = polygon(:, :size(polygon, 2) - 1)
    end if
  end function frustum

end module swept_profile_mod
