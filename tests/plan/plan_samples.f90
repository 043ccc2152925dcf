!> What the tests of this folder read from a plan.
module plan_samples
  use kinds_mod, only: wp
  use plan_mod, only: plan_t
  implicit none
  private

  public :: figure_of

contains

  !> The planned number of that name; 0 where there is none.
  pure function figure_of(plan, name) result(value)
    type(plan_t), intent(in) :: plan
    character(*), intent(in) :: name
    real(wp) :: value
    integer :: i

    value = 0.0_wp
    if (.not. allocated(plan%figures)) return
    do i = 1, size(plan%figures)
      if (plan%figures(i)%name == name) value = plan%figures(i)%value
    end do
  end function figure_of

end module plan_samples
