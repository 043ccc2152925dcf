!> How large the next increment may be, where the deck leaves that to the program (no DIRECT).
!>
!> An increment of the deck is cut in halves, quarters, ... as often as the accuracy wants it, or as
!> an increment that was not solved. Whether it wants it is tried out on the interface alone: two
!> increments of a size, and one of twice that size, differ by the error of the two.
module choose_increment_mod
  use kinds_mod, only: wp, i8
  use number_list_mod, only: number_list_t, carry
  use scene_mod, only: scene_t
  use plan_mod, only: plan_t
  use state_mod, only: state_t
  use increments_mod, only: increment_t, next_increment, whole_increment, &
    smallest_increment
  use operators_mod, only: operators_t
  use load_step_error_mod, only: try_increment, resultant_change
  implicit none
  private

  public :: increment_size_t, choose_increment, cut_increment, carry_size

  real(wp), parameter :: share_of_steps = 0.25_wp !! of the accuracy, that load steps may use up

  !> The size that holds.
  type :: increment_size_t
    integer(i8) :: length = whole_increment !! in parts of the deck's increments
    integer :: granted = 0                  !! increments of that size before it is chosen anew
  end type increment_size_t

contains

  !> The increment that follows `old`.
  subroutine choose_increment(scene, plan, operators, old, size, increment)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(operators_t), intent(inout) :: operators  !! as of `advance`
    type(state_t), intent(in) :: old
    type(increment_size_t), intent(inout) :: size
    type(increment_t), intent(out) :: increment

    increment = next_increment(scene%steps, old)
    if (scene%steps(increment%step)%direct) then
      size = increment_size_t()
      return
    end if
    if (size%granted == 0) then
      size%length = fitting(old, increment, size%length)
      if (scene%accuracy%wanted > 0.0_wp) then
        call try_sizes(scene, plan, operators, old, increment, size)
      else
        size%granted = 1
      end if
    end if
    size%granted = size%granted - 1
    increment = next_increment(scene%steps, old, size%length)
  end subroutine choose_increment

  !> The largest size up to twice `length` that begins and ends where one of its kind may.
  pure integer(i8) function fitting(old, increment, length)
    type(state_t), intent(in) :: old
    type(increment_t), intent(in) :: increment  !! uncut
    integer(i8), intent(in) :: length
    integer(i8) :: start

    start = 0
    if (.not. increment%first_of_step) start = old%position
    fitting = min(whole_increment, 2*length)
    do while (mod(start, fitting) /= 0)
      fitting = fitting/2
    end do
  end function fitting

  !> Find a size of which two in a row are accurate enough; the smallest there is in any case.
  subroutine try_sizes(scene, plan, operators, old, increment, size)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(operators_t), intent(inout) :: operators
    type(state_t), intent(in) :: old
    type(increment_t), intent(in) :: increment  !! uncut
    type(increment_size_t), intent(inout) :: size
    type(state_t) :: coarse, middle, fine
    integer(i8) :: left
    logical :: has_coarse, ok, fine_ok
    real(wp) :: change

    left = scene%steps(increment%step)%n_increments*whole_increment
    if (.not. increment%first_of_step) left = left - old%position
    if (2*size%length > left) size%length = size%length/2
    size%granted = 2
    call try_increment(scene, plan, operators, old, 2*size%length, coarse, has_coarse)
    do while (size%length > smallest_increment)
      call try_increment(scene, plan, operators, old, size%length, middle, ok)
      fine_ok = ok
      if (ok) call try_increment(scene, plan, operators, middle, size%length, fine, fine_ok)
      if (has_coarse .and. fine_ok) then
        change = resultant_change(plan%points, coarse%reaction, fine%reaction)
        if (change <= share_of_steps*scene%accuracy%wanted) exit
      end if
      size%length = size%length/2
      coarse = middle
      has_coarse = ok
    end do
  end subroutine try_sizes

  !> After an increment that was not solved: half of it, where the deck allows that and it is large
  !> enough.
  subroutine cut_increment(scene, increment, size, is_cut)
    type(scene_t), intent(in) :: scene
    type(increment_t), intent(in) :: increment   !! that was not solved
    type(increment_size_t), intent(inout) :: size
    logical, intent(out) :: is_cut

    is_cut = .not. scene%steps(increment%step)%direct .and. size%length > smallest_increment
    if (.not. is_cut) return
    size%length = size%length/2
    size%granted = 2
  end subroutine cut_increment

  !> Put a size into the list, or take it out.
  subroutine carry_size(list, size)
    type(number_list_t), intent(inout) :: list
    type(increment_size_t), intent(inout) :: size

    call carry(list, size%length)
    call carry(list, size%granted)
  end subroutine carry_size

end module choose_increment_mod
