!> Which contact points may touch in an increment, as far as is known: only these need rows in a
!> contact problem that is made anew for every placement. docs/theory.md section 11.
module near_points_mod
  use kinds_mod, only: wp
  use contact_points_mod, only: contact_points_t
  use placement_mod, only: placement_t
  use state_mod, only: state_t
  use transfer_mod, only: relative_motion, gap_at
  implicit none
  private

  public :: near_points, is_any_missed

  real(wp), parameter :: margin = 0.2_wp
  !! gap of a near point, over how far points move: with less more points are missed, which takes
  !! another solution; with more each has more rows [-]

contains

  !> The points in reach that carry a reaction, stay closed, or whose gap at displacement `u` is
  !> small beside the longest relative motion since the increment began.
  pure function near_points(points, placement, old, u, reaction, slack) result(near)
    type(contact_points_t), intent(in) :: points
    type(placement_t), intent(in) :: placement
    type(state_t), intent(in) :: old         !! the increment's beginning
    real(wp), intent(in) :: u(:, :)          !! (3,n_nodes) [length]
    real(wp), intent(in) :: reaction(:, :)   !! (3,n_points) [force]
    real(wp), intent(in) :: slack            !! gap that counts as none [length]
    logical :: near(points%n)
    real(wp) :: longest
    integer :: i

    longest = 0.0_wp
    do i = 1, points%n
      if (points%in_reach(i)) longest = max(longest, norm2(relative_motion(points, &
        placement%weights, i, u) - relative_motion(points, placement%weights, i, &
        old%displacement) + placement%drag(:, i)))
    end do
    do i = 1, points%n
      near(i) = points%in_reach(i)
      if (near(i)) near(i) = any(abs(reaction(:, i)) > 0.0_wp) .or. gap_at(placement, points, i, &
        u) <= max(slack, margin*longest)
    end do
    if (allocated(old%closed)) near = near .or. (points%in_reach .and. old%closed)
  end function near_points

  !> Whether a point that was left out touches its master, or is inside it.
  pure logical function is_any_missed(points, placement, left_out, u, slack) result(missed)
    type(contact_points_t), intent(in) :: points
    type(placement_t), intent(in) :: placement
    logical, intent(in) :: left_out(:) !! (n_points)
    real(wp), intent(in) :: u(:, :)    !! (3,n_nodes) [length]
    real(wp), intent(in) :: slack      !! as of near_points [length]
    integer :: i

    missed = .false.
    do i = 1, points%n
      if (.not. left_out(i)) cycle
      missed = gap_at(placement, points, i, u) <= slack
      if (missed) return
    end do
  end function is_any_missed

end module near_points_mod
