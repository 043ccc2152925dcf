!> What fuzzers call over and over: a deck, from its text to a plan.
module read_deck_target_mod
  use, intrinsic :: iso_c_binding, only: c_char, c_int
  use errors_mod, only: error_t, exit_ok
  use text_mod, only: string_t
  use scene_mod, only: scene_t
  use choices_mod, only: choices_t
  use plan_mod, only: plan_t
  use read_deck_mod, only: read_deck_text
  use make_plan_mod, only: make_plan
  implicit none
  private

  public :: try_deck

contains

  !> Read a deck and plan its run. Returns the exit status that the program would end with, and what
  !> it would say: its mistakes, or its notes and the lines of its plan that do not depend on the
  !> machine.
  function try_deck(bytes, n, said, room, length) result(status) bind(c, name='try_deck')
    integer(c_int), value :: n, room
    character(c_char), intent(in) :: bytes(n)
    character(c_char), intent(inout) :: said(room) !! out: the first `length` of them
    integer(c_int), intent(out) :: length
    integer(c_int) :: status
    integer, parameter :: largest = 20000 !! nodes of a mesh that is worth a plan here
    type(string_t) :: overrides(0)
    type(scene_t) :: scene
    type(choices_t) :: choices
    type(plan_t) :: plan
    type(error_t), allocatable :: error
    character(:), allocatable :: text
    integer :: i

    allocate (character(n) :: text)
    do i = 1, n
      text(i:i) = bytes(i)
    end do
    call read_deck_text(text, 'deck.inp', overrides, scene, error)
    status = exit_ok
    text = ''
    if (.not. allocated(error)) then
      choices = choices_t(tolerance=scene%contact%tolerance, &
        compliance=scene%contact%compliance, precision=scene%precision)
      if (scene%mesh%n_nodes <= largest) call make_plan(scene, choices, plan, error)
    end if
    if (allocated(error)) then
      status = error%exit_status
      text = error%message
    else
      do i = 1, size(scene%notes)
        text = text//'note: '//scene%notes(i)%text//new_line('a')
      end do
      if (allocated(plan%lines)) then
        do i = 1, size(plan%lines)
          text = text//plan%lines(i)%text//new_line('a')
        end do
      end if
    end if
    length = min(len(text), room)
    do i = 1, length
      said(i) = text(i:i)
    end do
  end function try_deck

end module read_deck_target_mod
