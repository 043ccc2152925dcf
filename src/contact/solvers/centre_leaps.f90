!> Leaps of the search for free rigid motions, from a centre to the next (floating_search_mod).
!> docs/theory.md section 9.
module centre_leaps_mod
  use kinds_mod, only: wp
  use dense_mod, only: solve_dense, singular_values
  use increment_report_mod, only: status_slide
  use problem_mod, only: contact_problem_t, unpack_rows, natural_map
  implicit none
  private

  public :: leap_of, add_sliding

contains

  !> A Newton step on e(c) = 0, damped: (R + d I)^-1 e, along each singular direction of the matrix
  !> at most as far as given. What nothing resists does not shorten the way of what is resisted.
  function leap_of(resistance, e, damping, longest) result(leap)
    real(wp), intent(in) :: resistance(:, :)  !! (n,n) -de/dc [force/length]
    real(wp), intent(in) :: e(:)              !! (n) out of balance [force]
    real(wp), intent(in) :: damping           !! [force/length]
    real(wp), intent(in) :: longest           !! [length]
    real(wp) :: leap(size(e))                 !! [length]
    real(wp), dimension(size(e), size(e)) :: damped, v, u
    real(wp), dimension(size(e)) :: s, along
    integer :: i
    logical :: ok

    damped = resistance
    do i = 1, size(e)
      damped(i, i) = damped(i, i) + damping
    end do
    u = damped
    leap = e
    call solve_dense(u, leap)
    if (norm2(leap) <= longest) return
    call singular_values(damped, s, v, ok, u)
    if (.not. ok) return
    along = matmul(e, u)
    where (abs(along) <= s*longest)
      along = along/max(s, tiny(1.0_wp))
    else where
      along = sign(longest, along)
    end where
    leap = matmul(v, along)
  end function leap_of

  !> Add what resists motions along which points slide: by the secant of their friction f along the
  !> slip s, |f|/(|s| + |f| w), with w of the point. Friction is constant there, so that its
  !> derivative of 0 does not say how far the motions may go; by the secant they go as far as takes
  !> the slips back, which is never beyond where it does (that of a sum of |s|, Weiszfeld's).
  pure subroutine add_sliding(problem, q, x, r, resistance)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: q(:, :)              !! (n_rows,n) what the motions do at the rows [-]
    real(wp), intent(in) :: x(:)                 !! (n_rows) gaps and slips [length]
    real(wp), intent(in) :: r(:, :)              !! (3,n_points) [force]
    real(wp), intent(inout) :: resistance(:, :)  !! (n,n) [force/length]
    real(wp), dimension(3, problem%n_points) :: slip, z
    real(wp) :: along(size(q, 2)), friction, length
    integer :: status(problem%n_points), i, a

    slip = unpack_rows(problem, x)
    call natural_map(problem, slip, r, z, status)
    do i = 1, problem%n_points
      friction = norm2(r(2:, i))
      length = norm2(slip(2:, i))
      if (status(i) /= status_slide .or. .not. (friction > 0.0_wp .and. length > 0.0_wp)) cycle
      along = 0.0_wp
      do a = 2, 3
        if (problem%row(a, i) > 0) along = along + slip(a, i)/length*q(problem%row(a, i), :)
      end do
      along = along*sqrt(friction/(length + friction/problem%rho_global(2, i)))
      do a = 1, size(along)
        resistance(:, a) = resistance(:, a) + along*along(a)
      end do
    end do
  end subroutine add_sliding

end module centre_leaps_mod
