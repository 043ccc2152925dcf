!> What a run at finite strain (*STEP, NLGEOM) does not cover.
module finite_strain_limits_mod
  use kinds_mod, only: wp
  use cells_mod, only: hexahedron_8
  use mesh_mod, only: kind_c3d8
  use controls_mod, only: compliance_products, is_exact, is_bounded
  use scene_mod, only: scene_t
  implicit none
  private

  public :: beyond_finite_strain

contains

  !> The first thing in the scene that finite strain does not cover, in words; empty: there is none.
  pure function beyond_finite_strain(scene) result(what)
    type(scene_t), intent(in) :: scene
    character(:), allocatable :: what

    what = ''
    if (any(scene%mesh%element_kind /= kind_c3d8) .or. any(scene%mesh%connectivity%cell /= &
      hexahedron_8)) then
      what = 'elements other than C3D8'
    else if (scene%mesh%n_bodies > 1) then
      what = 'several bodies'
    else if (scene%constraints%n > 0) then
      what = 'ties, equations, couplings, local directions or hanging nodes'
    else if (any(scene%pairs%master == 0)) then
      what = 'contact between surfaces of elements'
    else if (presses(scene)) then
      what = 'pressures (*DSLOAD, *DLOAD)'
    else if (warms_up(scene)) then
      what = 'temperatures'
    else if (scene%precision%iterative) then
      what = '*BODY SOLVER, TYPE=ITERATIVE'
    else if (.not. is_exact(scene%precision)) then
      what = 'a factor in single precision or of low rank (*PRECISION)'
    else if (scene%contact%compliance == compliance_products) then
      what = 'COMPLIANCE=PRODUCTS'
    else if (scene%output%mesh_error) then
      what = 'the field of errors by the mesh'
    else if (scene%accuracy%wanted > 0.0_wp .or. is_bounded(scene%accuracy)) then
      what = 'an accuracy, a time or a memory that is asked for'
    end if
  end function beyond_finite_strain

  pure logical function presses(scene)
    type(scene_t), intent(in) :: scene
    integer :: k

    presses = .false.
    do k = 1, size(scene%steps)
      presses = presses .or. size(scene%steps(k)%pressures) > 0 .or. &
        size(scene%steps(k)%face_pressures) > 0
    end do
  end function presses

  pure logical function warms_up(scene)
    type(scene_t), intent(in) :: scene
    integer :: k

    warms_up = .false.
    if (.not. any(abs(scene%materials%expansion) > 0.0_wp)) return
    do k = 1, size(scene%steps)
      if (allocated(scene%steps(k)%temperatures)) warms_up = warms_up .or. &
        size(scene%steps(k)%temperatures) > 0
    end do
  end function warms_up

end module finite_strain_limits_mod
