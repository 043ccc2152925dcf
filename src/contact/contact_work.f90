!> What reactions do on what they move themselves.
module contact_work_mod
  use kinds_mod, only: wp
  use increment_report_mod, only: contact_fields_t
  use problem_mod, only: pack_rows
  use condensed_contact_mod, only: condensed_contact_t, count_rows
  implicit none
  private

  public :: least_contact_work

contains

  !> r.W r = r.(x - x_free) of the group of points where it is least, of those that press; 0 where
  !> none does. Gaps and slips x are those of the end, x_free those without any reaction.
  pure real(wp) function least_contact_work(condensed, x_free, contact) result(least)
    type(condensed_contact_t), intent(in) :: condensed
    real(wp), intent(in) :: x_free(:)             !! (n_rows) one group after the other [length]
    type(contact_fields_t), intent(in) :: contact
    real(wp), allocatable :: r(:), x(:), x_of_points(:, :)
    real(wp) :: work
    integer :: i, k

    least = 0.0_wp
    allocate (r(0), x(0))
    if (count_rows(condensed) /= size(x_free)) return
    k = 0
    do i = 1, size(condensed%group)
      associate (group => condensed%group(i))
        allocate (x_of_points(3, size(group%active)))
        x_of_points(1, :) = contact%gap(group%active)
        x_of_points(2:, :) = contact%slip_increment(:, group%active)
        x = pack_rows(group%problem, x_of_points)
        r = pack_rows(group%problem, contact%reaction(:, group%active))
        work = dot_product(r, x - x_free(k + 1:k + size(r)))
        k = k + size(r)
        deallocate (x_of_points)
      end associate
      if (.not. work > 0.0_wp) cycle
      if (least > 0.0_wp) work = min(least, work)
      least = work
    end do
  end function least_contact_work

end module contact_work_mod
