!> What the coverage-guided fuzzer calls over and over: a deck, from its text to a plan.
module read_deck_target_mod
  use, intrinsic :: iso_c_binding, only: c_char, c_int
  use errors_mod, only: error_t, exit_wrong_input
  use text_mod, only: string_t
  use scene_mod, only: scene_t
  use plan_mod, only: plan_t
  use read_deck_mod, only: read_deck_text
  use make_plan_mod, only: make_plan
  implicit none
  private

  public :: try_deck

contains

  !> Read a deck and plan its run; 1 when it was refused in order, 0 when it was accepted, and no
  !> return where the program is at fault.
  function try_deck(bytes, n) result(refused) bind(c, name='try_deck')
    integer(c_int), value :: n
    character(c_char), intent(in) :: bytes(n)
    integer(c_int) :: refused
    integer, parameter :: largest = 20000 !! nodes of a mesh that is worth a plan here
    type(string_t) :: overrides(0)
    type(scene_t) :: scene
    type(plan_t) :: plan
    type(error_t), allocatable :: error
    character(n) :: text
    integer :: i

    do i = 1, n
      text(i:i) = bytes(i)
    end do
    call read_deck_text(text, 'deck.inp', overrides, scene, error)
    refused = 1
    if (allocated(error)) then
      if (error%exit_status /= exit_wrong_input .or. index(error%message, 'error: ') == 0) &
        error stop 'a refused deck without a proper message'
      return
    end if
    if (scene%mesh%n_nodes > largest) return
    call make_plan(scene, plan, error)
    if (.not. allocated(error)) refused = 0
  end function try_deck

end module read_deck_target_mod
