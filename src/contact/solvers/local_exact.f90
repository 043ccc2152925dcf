!> The exact solution of one contact point: open, stick, or the one root of the slide.
module local_exact_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: solve_small
  use local_point_mod, only: local_point_t, find_radius, find_coefficient
  implicit none
  private

  public :: solve_exact

  integer, parameter :: max_evaluations = 2200
  !! bisection over the whole range of exponents ends before

  !> The point with x_n = 0 eliminated: (A + s I) r_t = -c, r_n = r_free - slope . r_t.
  type :: slide_t
    real(wp) :: a(2, 2)  !! W_tt - w_tn w_nt/W_nn [length/force]
    real(wp) :: c(2)     !! x_loc_t - w_tn x_loc_n/W_nn [length]
    real(wp) :: r_free   !! -x_loc_n/W_nn [force]
    real(wp) :: slope(2) !! w_nt/W_nn [-]
    type(local_point_t) :: point !! its friction
  end type slide_t

contains

  !> Solve the point whatever its data: test open (or pulled), then stick, then find the slide.
  !> Docs/theory.md (4.8).
  pure subroutine solve_exact(point, r, iterations, converged)
    type(local_point_t), intent(in) :: point
    real(wp), intent(inout) :: r(3)       !! reaction; its value on entry does not matter [force]
    integer,  intent(out)   :: iterations !! evaluations of the law
    logical,  intent(out)   :: converged
    !! false only for a W_nn that is not positive; r is kept then. Along a tangent that is driven
    !! W_ii is 0, and the point does not stick
    real(wp) :: stick(3), radius, change
    type(slide_t) :: slide
    logical :: regular

    iterations = 1
    converged = .true.
    associate (w => point%w, x => point%x_loc, mu => point%mu)
      if (x(1) >= 0.0_wp) then
        converged = .not. point%stays .or. w(1, 1) > 0.0_wp
        if (.not. converged) return
        r = 0.0_wp
        if (point%stays) r(1) = -x(1)/w(1, 1)
        return
      end if
      call solve_small(w, -x, stick, regular)
      call find_radius(point, stick(1), radius, change)
      if (regular .and. stick(1) >= 0.0_wp .and. norm2(stick(2:)) <= radius) then
        r = stick
        return
      end if
      converged = w(1, 1) > 0.0_wp
      if (.not. converged) return
      if (mu <= 0.0_wp) then
        r = [-x(1)/w(1, 1), 0.0_wp, 0.0_wp]
        return
      end if
      slide%slope = w(1, 2:)/w(1, 1)
      slide%a(:, 1) = w(2:, 2) - w(2:, 1)*slide%slope(1)
      slide%a(:, 2) = w(2:, 3) - w(2:, 1)*slide%slope(2)
      slide%c = x(2:) - w(2:, 1)*x(1)/w(1, 1)
      slide%r_free = -x(1)/w(1, 1)
      slide%point = point
      call solve_along(slide, r, regular)
      if (.not. regular) call find_slide(slide, r, iterations)
    end associate
  end subroutine solve_exact

  !> A point that moves along one tangent only, aslant perhaps, as a support leaves it, and that
  !> nothing drives across it: it sticks, or slides one way or the other.
  pure subroutine solve_along(slide, r, found)
    type(slide_t), intent(in) :: slide
    real(wp), intent(inout) :: r(3)    !! kept where not found [force]
    logical, intent(out) :: found      !! false: it moves along both, or is driven across
    real(wp), parameter :: rounding = 64.0_wp*epsilon(1.0_wp)
    integer, parameter :: most_steps = 100
    real(wp) :: a(2, 2), along(2), trace, c, r_t, r_n, share, mu, change, before, radius
    integer :: k

    found = .false.
    trace = slide%a(1, 1) + slide%a(2, 2)
    if (.not. trace > 0.0_wp) return
    a = slide%a/trace
    if (a(1, 1)*a(2, 2) - a(1, 2)*a(2, 1) > rounding) return
    along = a(:, maxloc([a(1, 1), a(2, 2)], dim=1))
    along = along/norm2(along)
    c = dot_product(slide%c, along)
    if (norm2(slide%c - c*along) > rounding*norm2(slide%c)) return
    r_t = -c/trace
    r_n = slide%r_free - r_t*dot_product(slide%slope, along)
    call find_radius(slide%point, r_n, radius, change)
    found = abs(r_t) <= radius
    if (.not. found) then
      r_n = slide%r_free
      do k = 1, most_steps
        before = r_n
        call find_coefficient(slide%point, r_n, mu, change)
        share = 1.0_wp + sign(mu, r_t)*dot_product(slide%slope, along)
        if (.not. share > 0.0_wp) exit
        r_n = slide%r_free/share
        found = abs(r_n - before) <= 2.0_wp*epsilon(1.0_wp)*r_n .or. .not. abs(change) > 0.0_wp
        if (found) exit
      end do
      r_t = sign(mu*r_n, r_t)
    end if
    found = found .and. r_n > 0.0_wp
    if (found) r = [r_n, r_t*along]
  end subroutine solve_along

  !> The s > 0 with x_t = -s r_t and |r_t| the largest friction at r_n, by Newton kept inside a
  !> bracket.
  !>
  !> h(s), the former less the latter, is positive at s = 0, where stick has failed, and negative
  !> far out, where r_t vanishes.
  pure subroutine find_slide(slide, r, evaluations)
    type(slide_t), intent(in) :: slide
    real(wp), intent(out) :: r(3)         !! [force]
    integer, intent(inout) :: evaluations
    real(wp) :: low, high, s, next, h, dh, radius, slope, mu, change

    low = 0.0_wp
    high = slide%a(1, 1) + slide%a(2, 2)
    ! Driven along both tangents there is nothing to find: r_t = -c/s.
    if (high <= 0.0_wp) then
      call find_radius(slide%point, slide%r_free, radius, slope)
      if (radius <= 0.0_wp) then
        ! A table of friction without any at this pressure.
        r = [slide%r_free, 0.0_wp, 0.0_wp]
        return
      end if
      high = norm2(slide%c)/radius
    end if
    do
      call evaluate(slide, high, r, h, dh)
      evaluations = evaluations + 1
      if (h <= 0.0_wp .or. evaluations > max_evaluations .or. high > 0.1_wp*huge(high)) exit
      low = high
      high = 4.0_wp*high
    end do
    s = high
    root: do while (evaluations <= max_evaluations)
      call evaluate(slide, s, r, h, dh)
      evaluations = evaluations + 1
      call find_radius(slide%point, r(1), radius, slope)
      if (abs(h) <= 2.0_wp*epsilon(1.0_wp)*radius) exit root
      if (h > 0.0_wp) then
        low = s
      else
        high = s
      end if
      next = high
      if (dh < 0.0_wp) next = s - h/dh
      if (.not. (next > low .and. next < high)) then
        if (low > 0.0_wp) then ! the middle of the exponents: the bracket may span many decades
          next = sqrt(low)*sqrt(high)
        else
          next = 0.0625_wp*high
        end if
      end if
      if (abs(next - s) <= 2.0_wp*epsilon(1.0_wp)*s) exit root
      s = next
    end do root
    ! On the cone to rounding, from the component that has lost nothing in a difference.
    call find_coefficient(slide%point, r(1), mu, change)
    if (mu > 1.0_wp .and. .not. abs(change) > 0.0_wp) then
      r(1) = norm2(r(2:))/mu
    else
      r(1) = max(r(1), 0.0_wp)
      call find_radius(slide%point, r(1), radius, slope)
      if (norm2(r(2:)) > 0.0_wp) r(2:) = (radius/norm2(r(2:)))*r(2:)
    end if
  end subroutine find_slide

  !> The reaction at s, and h(s) with its derivative.
  pure subroutine evaluate(slide, s, r, h, dh)
    type(slide_t), intent(in) :: slide
    real(wp), intent(in)  :: s     !! [length/force]
    real(wp), intent(out) :: r(3)  !! [force]
    real(wp), intent(out) :: h     !! |r_t| less the largest friction [force]
    real(wp), intent(out) :: dh    !! dh/ds
    real(wp) :: m(2, 2), dr(2), size_t, radius, change

    m = slide%a
    m(1, 1) = m(1, 1) + s
    m(2, 2) = m(2, 2) + s
    r(2:) = -solve_2x2(m, slide%c, s)
    r(1) = slide%r_free - dot_product(slide%slope, r(2:))
    dr = -solve_2x2(m, r(2:), s)
    size_t = norm2(r(2:))
    call find_radius(slide%point, r(1), radius, change)
    if (r(1) < 0.0_wp) radius = change*r(1) ! goes on straight: no kink near the root for a large mu
    h = size_t - radius
    dh = change*dot_product(slide%slope, dr)
    if (size_t > 0.0_wp) dh = dh + dot_product(r(2:)/size_t, dr)
  end subroutine evaluate

  !> Cramer's rule on the matrix beside its largest entry: s may be near the end of the range.
  !>
  !> Where the point moves along one tangent only, what is left of the determinant may be rounding.
  !> It is at least s times the largest entry then: neither eigenvalue is below s.
  pure function solve_2x2(m, b, s) result(x)
    real(wp), intent(in) :: m(2, 2), b(2) !! m symmetric, its eigenvalues not below s
    real(wp), intent(in) :: s             !! > 0
    real(wp) :: x(2), n(2, 2), scale, determinant
    real(wp), parameter :: rounding = 4.0_wp*epsilon(1.0_wp)

    scale = max(m(1, 1), m(2, 2))
    n = m/scale
    determinant = n(1, 1)*n(2, 2) - n(1, 2)*n(2, 1)
    if (abs(determinant) < rounding) determinant = max(determinant, s/scale, rounding**2)
    x = [n(2, 2)*b(1) - n(1, 2)*b(2), n(1, 1)*b(2) - n(2, 1)*b(1)]/determinant
    x = x/scale
  end function solve_2x2

end module local_exact_mod
