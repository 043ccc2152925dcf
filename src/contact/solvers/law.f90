!> Coulomb's and Signorini's laws as projections, for one contact point.
!>
!> Local frame (n, t1, t2), n from the obstacle to the body; r the reaction on the body (r_n >= 0
!> pushes), x the gap and the slip increment. docs/theory.md section 3; [JFT07] equations (3) to
!> (10), with the corrections listed there. A point that stays closed may be pulled, too: (3.10).
module law_mod
  use kinds_mod, only: wp
  use increment_report_mod, only: status_open, status_stick, status_slide
  implicit none
  private

  public :: project_on_cone, project_prediction, cone_derivative, pull_derivative, &
    project_normal, project_on_disc, project_beside_driven, driven_friction, augmented_gap, &
    change_with_coefficient

  integer, parameter :: most_newton = 100 !! steps to the one root of (3.9)

contains

  !> Euclidean projection of `y` on the Coulomb cone K(mu).
  !>
  !> Three cases, by where y lies: in the polar cone (apex, open), in the cone (unchanged, stick),
  !> elsewhere (closest point of the boundary, slide). Source: [JFT07] eq. (10), open first and "<="
  !> in both tests; docs/theory.md (3.3).
  pure subroutine project_on_cone(mu, y, p, status)
    real(wp), intent(in)  :: mu      !! friction coefficient, mu >= 0 [-]
    real(wp), intent(in)  :: y(3)    !! any vector [force]
    real(wp), intent(out) :: p(3)    !! its projection [force]
    integer,  intent(out) :: status  !! status_open, status_stick or status_slide
    real(wp) :: y_t, p_n

    y_t = norm2(y(2:))
    if (mu*y_t <= -y(1)) then
      p = 0.0_wp
      status = status_open
    else if (y_t <= mu*y(1)) then
      p = y
      status = status_stick
    else
      ! The printed form in terms of p_n: no cancellation at large mu, and |p_t| = mu p_n to
      ! rounding.
      p_n = (y(1) + mu*y_t)/(1.0_wp + mu**2)
      p(1) = p_n
      p(2:) = (mu*p_n/y_t)*y(2:)
      status = status_slide
    end if
  end subroutine project_on_cone

  !> Projection of the bi-potential's prediction r - rho x* on the Coulomb cone, accurate to the
  !> rounding of r and rho x_n however far the point slides.
  !>
  !> With y = r - rho x* the normal part is p_n = (y_n + mu |y_t|)/(1 + mu^2), where mu rho |x_t|
  !> cancels: y_n + mu |y_t| = r_n - rho x_n + mu (|y_t| - rho |x_t|), and the bracket is r_t.(r_t -
  !> 2 rho x_t)/(|y_t| + rho |x_t|). So a point that slides far under a small reaction, or none, is
  !> judged by that reaction. docs/theory.md (3.4).
  !>
  !> Of a point that stays closed what is beyond the cone's apex is no reaction of 0, but one that
  !> pulls, without friction: docs/theory.md (3.11).
  pure subroutine project_prediction(mu, stays, rho, r, x, p, status)
    real(wp), intent(in)  :: mu      !! friction coefficient, mu >= 0 [-]
    logical,  intent(in)  :: stays   !! closed
    real(wp), intent(in)  :: rho     !! rho > 0 [force/length]
    real(wp), intent(in)  :: r(3)    !! reaction [force]
    real(wp), intent(in)  :: x(3)    !! gap and slip increment [length]
    real(wp), intent(out) :: p(3)    !! projection of r - rho x* [force]
    integer,  intent(out) :: status  !! status_open (it does not press), status_stick, status_slide
    real(wp) :: y_t(2), size_y, size_x, y_n, lift

    y_t = r(2:) - rho*x(2:)
    size_y = norm2(y_t)
    size_x = rho*norm2(x(2:))
    y_n = r(1) - rho*x(1)
    lift = size_y - size_x
    if (size_x > norm2(r(2:))) lift = dot_product(r(2:)/(size_y + size_x), y_t - rho*x(2:))
    if (y_n + mu*lift <= 0.0_wp) then
      p = 0.0_wp
      if (stays) p(1) = y_n + mu*lift
      status = status_open
    else if (size_y <= mu*(y_n - mu*size_x)) then
      p = [y_n - mu*size_x, y_t(1), y_t(2)]
      status = status_stick
    else
      p(1) = (y_n + mu*lift)/(1.0_wp + mu**2)
      p(2:) = (mu*p(1)/size_y)*y_t
      status = status_slide
    end if
  end subroutine project_prediction

  !> Derivative of the projection on the cone at `y` (symmetric; in the branch that the projection
  !> takes).
  !>
  !> Slide: with t = y_t/|y_t|, v = t - mu n and c = |y_t| - mu y_n,
  !> P' = I - (v v^T + c (I_t - t t^T)/|y_t|)/(1 + mu^2). Source: docs/theory.md (4.5).
  pure function cone_derivative(mu, y, status) result(d)
    real(wp), intent(in) :: mu     !! friction coefficient, mu >= 0 [-]
    real(wp), intent(in) :: y(3)   !! the projected vector [force]
    integer,  intent(in) :: status !! of its projection
    real(wp) :: d(3, 3), t(2), v(3), y_t, fraction
    integer :: i, j

    d = 0.0_wp
    if (status == status_open) return
    do i = 1, 3
      d(i, i) = 1.0_wp
    end do
    if (status == status_stick) return
    y_t = norm2(y(2:))
    t = y(2:)/y_t
    v = [-mu, t(1), t(2)]
    fraction = (y_t - mu*y(1))/y_t
    do j = 1, 3
      do i = 1, 3
        d(i, j) = d(i, j) - v(i)*v(j)/(1.0_wp + mu**2)
      end do
    end do
    do j = 1, 2
      do i = 1, 2
        d(i + 1, j + 1) = d(i + 1, j + 1) + fraction*t(i)*t(j)/(1.0_wp + mu**2)
      end do
      d(j + 1, j + 1) = d(j + 1, j + 1) - fraction/(1.0_wp + mu**2)
    end do
  end function cone_derivative

  !> Derivative of what a point that stays closed pulls by, (y_n + mu |y_t|, 0, 0), at `y`.
  !> docs/theory.md (3.11).
  pure function pull_derivative(mu, y) result(d)
    real(wp), intent(in) :: mu     !! friction coefficient, mu >= 0 [-]
    real(wp), intent(in) :: y(3)   !! the projected vector [force]
    real(wp) :: d(3, 3)

    d = 0.0_wp
    d(1, 1) = 1.0_wp
    if (norm2(y(2:)) > 0.0_wp) d(1, 2:) = mu*y(2:)/norm2(y(2:))
  end function pull_derivative

  !> What the projection of the prediction r - rho x* changes by with the coefficient of friction.
  !> docs/theory.md (4.7).
  pure function change_with_coefficient(mu, stays, rho, r, x, p, status) result(d)
    real(wp), intent(in) :: mu      !! friction coefficient, mu >= 0 [-]
    logical,  intent(in) :: stays   !! closed
    real(wp), intent(in) :: rho     !! rho > 0 [force/length]
    real(wp), intent(in) :: r(3)    !! reaction [force]
    real(wp), intent(in) :: x(3)    !! gap and slip increment [length]
    real(wp), intent(in) :: p(3)    !! the projection [force]
    integer,  intent(in) :: status  !! of it
    real(wp) :: d(3)                !! [force]
    real(wp) :: y_t(2), size_y, size_x

    y_t = r(2:) - rho*x(2:)
    size_y = norm2(y_t)
    size_x = rho*norm2(x(2:))
    d = 0.0_wp
    select case (status)
    case (status_stick)
      d(1) = -size_x
    case (status_slide)
      d(1) = (size_y - size_x - 2.0_wp*mu*p(1))/(1.0_wp + mu**2)
      d(2:) = (p(1) + mu*d(1))*(y_t/size_y)
    case default
      if (stays) d(1) = size_y - size_x
    end select
  end function change_with_coefficient

  !> The normal reaction of a prediction: what presses, and of a point that stays closed what pulls.
  !> docs/theory.md (3.5) and (3.10).
  pure elemental real(wp) function project_normal(stays, y) result(p)
    logical,  intent(in) :: stays !! closed
    real(wp), intent(in) :: y     !! r_n - rho_n x_n [force]

    p = merge(y, max(0.0_wp, y), stays)
  end function project_normal

  !> Projection of a tangential vector on the disc of the given radius.
  !>
  !> Source: [JFT07] eq. (8) with the sign and the direction corrected; docs/theory.md (3.6).
  pure subroutine project_on_disc(radius, y, p, inside)
    real(wp), intent(in)  :: radius !! radius >= 0 [force]
    real(wp), intent(in)  :: y(2)   !! any vector [force]
    real(wp), intent(out) :: p(2)   !! its projection [force]
    logical,  intent(out) :: inside !! y lies in the disc
    real(wp) :: y_t

    y_t = norm2(y)
    inside = y_t <= radius
    p = y
    if (.not. inside) p = (radius/y_t)*y
  end subroutine project_on_disc

  !> Friction along one of the tangents of a point that slips: -mu r_n x_a/|x_t|.
  !> docs/theory.md (3.8).
  pure function driven_friction(mu, r_n, x_t, a) result(r_a)
    real(wp), intent(in) :: mu     !! friction coefficient, mu >= 0 [-]
    real(wp), intent(in) :: r_n    !! normal reaction [force]
    real(wp), intent(in) :: x_t(2) !! slip increment, not 0 [length]
    integer, intent(in) :: a       !! 1: along t1, 2: along t2
    real(wp) :: r_a                !! [force]

    r_a = -mu*max(0.0_wp, r_n)*(x_t(a)/norm2(x_t))
  end function driven_friction

  !> Projection of the prediction y = r - rho x along one tangent, where the point is driven along
  !> the other by a slip s: the p with |p| < radius and p + pull p/sqrt(radius^2 - p^2) = y,
  !> pull = rho |s|.
  !>
  !> It is what the projection of (y, y_s) on the disc leaves along the first tangent where y_s is
  !> such that the second keeps its friction; as the drive vanishes, that on [-radius, radius].
  !> With w = x/|s| and u = p/radius = w/sqrt(1 + w^2) the equation is radius u + pull w = y, its
  !> left side concave for w >= 0, so that Newton's method from below cannot overshoot.
  !> docs/theory.md (3.9).
  pure subroutine project_beside_driven(radius, pull, y, p, dp_dy, dp_dradius)
    real(wp), intent(in)  :: radius     !! radius >= 0 [force]
    real(wp), intent(in)  :: pull       !! pull > 0 [force]
    real(wp), intent(in)  :: y          !! any number [force]
    real(wp), intent(out) :: p          !! its projection [force]
    real(wp), intent(out) :: dp_dy      !! [-]
    real(wp), intent(out) :: dp_dradius !! [-]
    real(wp) :: w, root, slope, step
    integer :: i

    w = max(abs(y)/(radius + pull), (abs(y) - radius)/pull)
    do i = 1, most_newton
      root = hypot(1.0_wp, w)
      slope = radius*(1.0_wp/root)**3
      step = (abs(y) - radius*w/root - pull*w)/(slope + pull)
      w = w + step
      if (step <= 4.0_wp*epsilon(1.0_wp)*w) exit
    end do
    root = hypot(1.0_wp, w)
    slope = radius*(1.0_wp/root)**3
    p = sign(radius*(w/root), y)
    dp_dy = slope/(slope + pull)
    dp_dradius = sign((w/root)*pull/(slope + pull), y)
  end subroutine project_beside_driven

  !> x* = x + mu |x_t| n, the gap that the bi-potential works with. [JFT07] eq. (9), docs/theory.md
  !> (3.2).
  pure function augmented_gap(mu, x) result(x_star)
    real(wp), intent(in) :: mu   !! friction coefficient [-]
    real(wp), intent(in) :: x(3) !! gap and slip increment [length]
    real(wp) :: x_star(3)        !! [length]

    x_star = [x(1) + mu*norm2(x(2:)), x(2), x(3)]
  end function augmented_gap

end module law_mod
