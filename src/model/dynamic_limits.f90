!> What dynamic steps do not cover.
module dynamic_limits_mod
  use kinds_mod, only: wp
  use controls_mod, only: is_exact, is_bounded, solver_auto
  use scene_mod, only: scene_t
  implicit none
  private

  public :: beyond_dynamics

contains

  !> The first thing in a scene with *DYNAMIC that this does not cover, in words; empty: none.
  pure function beyond_dynamics(scene) result(what)
    type(scene_t), intent(in) :: scene
    character(:), allocatable :: what

    what = ''
    if (.not. any(scene%steps%is_dynamic)) return
    if (scene%finite_strain .and. allocated(scene%rotations)) then
      what = 'couplings that turn at finite strain'
    else if (scene%finite_strain .and. any(scene%materials%stiffness_damping > 0.0_wp)) then
      what = 'BETA of *DAMPING at finite strain'
    else if (scene%finite_strain .and. scene%precision%renews_tangent .and. &
        scene%contact%solver /= solver_auto) then
      what = 'TANGENT=NEWTON with a SOLVER of *CONTACT SOLVER'
    else if (scene%accuracy%chooses_theory) then
      what = 'NLGEOM=AUTO'
    else if (scene%precision%iterative) then
      what = '*BODY SOLVER, TYPE=ITERATIVE'
    else if (.not. is_exact(scene%precision)) then
      what = 'a factor that is not exact (*PRECISION)'
    else if (is_bounded(scene%accuracy)) then
      what = 'bounds of time and memory'
    else if (scene%accuracy%wanted > 0.0_wp .and. scene%accuracy%keeps_mesh) then
      what = 'an accuracy on a mesh that is kept'
    else if (scene%accuracy%follows_theory) then
      what = 'estimates of the error of small strain'
    else if (scene%stops_when_steady) then
      what = '--until-steady'
    else if (warms(scene)) then
      what = '*TEMPERATURE'
    end if
  end function beyond_dynamics

  !> Whether temperatures strain anything.
  pure logical function warms(scene)
    type(scene_t), intent(in) :: scene
    integer :: step

    warms = .false.
    if (.not. any(abs(scene%materials%expansion) > 0.0_wp)) return
    do step = 1, size(scene%steps)
      if (allocated(scene%steps(step)%temperatures)) warms = warms .or. size( &
        scene%steps(step)%temperatures) > 0
    end do
  end function warms

end module dynamic_limits_mod
