!> The plan: what exists in this run, decided from the scene before any number is computed.
module plan_mod
  use contact_points_mod, only: contact_points_t
  use text_mod, only: string_t
  implicit none
  private

  public :: plan_t

  !> What a run will do. Lower layers never see it: they get arguments.
  type :: plan_t
    type(contact_points_t) :: points          !! candidate contact points
    integer :: n_increments = 0               !! increments of the whole run
    integer :: n_equations = 0                !! free degrees of freedom in the first step
    integer :: n_interface = 0                !! of them, on slave nodes
    integer :: n_factorisations = 0 !! one, and one more whenever other dofs are prescribed
    type(string_t), allocatable :: lines(:)   !! the table as printed and stored
  end type plan_t

end module plan_mod
