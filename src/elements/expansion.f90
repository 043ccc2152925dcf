!> Thermal expansion: the stress that would hold a brick in its shape, which its nodes' forces
!> answer and its stresses lack. docs/theory.md section 8.
module expansion_mod
  use kinds_mod, only: wp, i8
  use mesh_mod, only: mesh_t
  use scene_mod, only: scene_t, material_t
  use warming_mod, only: warms, warming_at
  use brick8_mod, only: lame_constants, shape_gradients, volume
  implicit none
  private

  public :: find_thermal_stress, thermal_stress, thermal_force, thermal_energy

contains

  !> These stresses at a place in a step; not allocated where nothing warms.
  pure subroutine find_thermal_stress(scene, step, position, stress)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    integer(i8), intent(in) :: position  !! in parts of the deck's increments
    real(wp), allocatable, intent(out) :: stress(:) !! (n_elements) [force/length^2]

    if (warms(scene)) stress = thermal_stress(scene%mesh, scene%materials, &
      warming_at(scene, step, position))
  end subroutine find_thermal_stress

  !> Of each brick (3 lambda + 2 G) alpha dT, dT the mean over its nodes. docs/theory.md (8.12).
  pure function thermal_stress(mesh, materials, rise) result(stress)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: rise(:)      !! (n_nodes) of the temperature
    real(wp) :: stress(mesh%n_elements)  !! [force/length^2]
    real(wp) :: lambda, shear
    integer :: e

    do e = 1, mesh%n_elements
      associate (material => materials(mesh%material(e)))
        call lame_constants(material%young, material%poisson, lambda, shear)
        stress(e) = (3.0_wp*lambda + 2.0_wp*shear)*material%expansion* &
          sum(rise(mesh%connectivity(:, e)))/8.0_wp
      end associate
    end do
  end function thermal_stress

  !> Add the nodal forces of these stresses, int g_a dV times each. They balance in every brick.
  pure subroutine thermal_force(mesh, stress, f)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: stress(:)   !! (n_elements) [force/length^2]
    real(wp), intent(inout) :: f(:, :)  !! (3,n_nodes) [force]
    real(wp) :: gradient(3, 8, 8), weight(8)
    integer :: e, g, nodes(8)

    do e = 1, mesh%n_elements
      if (.not. abs(stress(e)) > 0.0_wp) cycle
      nodes = mesh%connectivity(:, e)
      call shape_gradients(mesh%coordinates(:, nodes), gradient, weight)
      do g = 1, 8
        f(:, nodes) = f(:, nodes) + stress(e)*weight(g)*gradient(:, :, g)
      end do
    end do
  end subroutine thermal_force

  !> The energy of these stresses in bricks that cannot expand, 1/2 int 3 stress alpha dT dV.
  pure real(wp) function thermal_energy(mesh, materials, stress) result(energy)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: stress(:)    !! (n_elements) [force/length^2]
    real(wp) :: lambda, shear
    integer :: e

    energy = 0.0_wp
    do e = 1, mesh%n_elements
      if (.not. abs(stress(e)) > 0.0_wp) cycle
      associate (material => materials(mesh%material(e)))
        call lame_constants(material%young, material%poisson, lambda, shear)
      end associate
      energy = energy + 1.5_wp*stress(e)**2/(3.0_wp*lambda + 2.0_wp*shear)* &
        volume(mesh%coordinates(:, mesh%connectivity(:, e)))
    end do
  end function thermal_energy

end module expansion_mod
