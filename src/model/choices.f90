!> What the program chose, beside the scene, which is what the user said.
module choices_mod
  use kinds_mod, only: wp
  use mesh_size_mod, only: mesh_size_t
  use controls_mod, only: precision_controls_t, compliance_auto
  implicit none
  private

  public :: choices_t

  !> An accuracy chooses mesh, divisions and tolerance, the plan compliance and precision, each
  !> within what the deck says of it: what solves reads it here alone.
  type :: choices_t
    type(mesh_size_t) :: mesh_size    !! that the scene is read with
    integer :: divisions = 1
    !! increments of the deck are cut in so many at least, where they may be cut: a power of 2
    integer :: runs_before = 0        !! of the process, with other meshes or divisions
    real(wp) :: tolerance = 0.0_wp    !! of contact; follows the errors of each *STEP [-]
    logical :: shows_progress = .false. !! iterations, on a terminal: of the first increment
    integer :: compliance = compliance_auto !! of the contact rows; once planned no longer AUTO
    type(precision_controls_t) :: precision !! becomes double where single does not do
  end type choices_t

end module choices_mod
