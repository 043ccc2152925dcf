!> What refusals have in common: the increment, and the node of a contact point.
module name_refusal_mod
  use errors_mod, only: error_t, raise, exit_not_solved
  use text_mod, only: to_text
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use increments_mod, only: increment_t, increment_name
  implicit none
  private

  public :: raise_at, node_name

contains

  !> An error that says in which increment it is.
  pure subroutine raise_at(increment, error, words)
    type(increment_t), intent(in) :: increment
    type(error_t), allocatable, intent(out) :: error
    character(*), intent(in) :: words

    call raise(error, exit_not_solved, increment_name(increment)//': '//words)
  end subroutine raise_at

  !> "node 17", of a contact point.
  pure function node_name(scene, points, point) result(name)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: point
    character(:), allocatable :: name

    name = 'node '//to_text(scene%mesh%node_id(points%node(point)))
  end function node_name

end module name_refusal_mod
