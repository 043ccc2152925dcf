!> Errors of contact forces that recovery of stresses cannot see: what supports may carry in the
!> place of contact. docs/theory.md (10.29).
module unseen_contact_mod
  use kinds_mod, only: wp
  use contact_points_mod, only: contact_points_t
  use increment_report_mod, only: contact_fields_t
  implicit none
  private

  public :: share_of_supports

contains

  !> The part of the normal forces that supports may carry where they hold the normals of points
  !> which would press: the area of points that touch and carry nothing, beside others that press,
  !> under the largest pressure of the pair. Of the pair with the largest such force, over the
  !> largest force of a pair. docs/theory.md (10.29).
  pure real(wp) function share_of_supports(points, contact, u) result(share)
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(in) :: contact
    real(wp), intent(in) :: u(:, :) !! (3,n_nodes) displacement [length]
    real(wp), parameter :: rounding = 1.0e-9_wp !! of the largest displacement: a gap of nothing [-]
    real(wp) :: touches, largest
    integer :: p

    share = 0.0_wp
    largest = 0.0_wp
    touches = rounding*maxval(abs(u))
    do p = 1, size(points%first) - 1
      associate (a => points%first(p), b => points%first(p + 1) - 1)
        if (a > b) cycle
        associate (force => contact%reaction(1, a:b), area => points%area(a:b))
          largest = max(largest, sum(force))
          if (.not. any(force > 0.0_wp .and. area > 0.0_wp)) cycle
          share = max(share, maxval(force/max(area, tiny(1.0_wp)), mask=area > 0.0_wp)*sum(area, &
            mask=.not. force > 0.0_wp .and. abs(contact%gap(a:b)) <= touches))
        end associate
      end associate
    end do
    if (largest > 0.0_wp) share = share/largest
  end function share_of_supports

end module unseen_contact_mod
