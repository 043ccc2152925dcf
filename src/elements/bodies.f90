!> What the bodies of a scene answer, whichever theory holds: internal forces, tangent, strain
!> energy and the part of heat in it. Above this file `is_linear` alone tells the theories apart.
!>
!>                          small strain                      finite strain (NLGEOM)
!>     internal force       K u, heat is a load               int P g_a dV, heat is in P
!>     tangent              K everywhere                      of a displacement
!>     strain energy        f . u/2                           int W dV
module bodies_mod
  use kinds_mod, only: wp, i8
  use scene_mod, only: scene_t
  use state_mod, only: state_t, modes_t
  use mesh_forces_mod, only: internal_force
  use finite_forces_mod, only: tangent_t, finite_internal_force, finite_strain_energy, &
    finite_strain_energies, tangent_force, work_of_heat
  use expansion_mod, only: find_free_strain, thermal_force, thermal_energy, largest_thermal_forces
  implicit none
  private

  public :: is_linear, find_internal_force, tangent_at, find_tangent_force, strain_energy, &
    strain_energies, find_heat, forces_of_heat

contains

  !> Whether internal forces are linear in the displacement: one tangent serves everywhere, and
  !> solutions may be superposed.
  pure logical function is_linear(scene)
    type(scene_t), intent(in) :: scene

    is_linear = .not. scene%finite_strain
  end function is_linear

  !> The internal forces at a displacement.
  pure subroutine find_internal_force(scene, free, u, modes, f, inverted)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: free(:)       !! (n_elements) strain by free expansion [-]
    real(wp), intent(in) :: u(:, :)       !! (3,n_nodes) [length]
    type(modes_t), intent(inout) :: modes !! as of finite_internal_force
    real(wp), intent(out) :: f(:, :)      !! (3,n_nodes) [force]
    integer, intent(out) :: inverted      !! element without an answer: forces are 0; 0: none is

    if (is_linear(scene)) then
      inverted = 0
      call internal_force(scene%mesh, scene%materials, u, f)
    else
      call finite_internal_force(scene%mesh, scene%materials, free, u, modes, f, inverted)
    end if
  end subroutine find_internal_force

  !> The tangent at a displacement, as of tangent_t, with the heat of a place in a *STEP.
  pure function tangent_at(scene, u, step, position, projection, modes) result(tangent)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: u(:, :)         !! (3,n_nodes) [length]
    integer, intent(in) :: step             !! 0: before the first
    integer(i8), intent(in) :: position     !! in parts of the deck's increments
    real(wp), intent(in) :: projection      !! as of tangent_t [-]
    type(modes_t), intent(in), optional :: modes !! at `u`, or none
    type(tangent_t) :: tangent

    tangent%at = u
    allocate (tangent%free(scene%mesh%n_elements))
    call find_free_strain(scene, max(1, step), position, tangent%free)
    tangent%projection = projection
    if (present(modes)) tangent%modes = modes
  end function tangent_at

  !> What displacements change internal forces by: of small strain where there is no tangent.
  subroutine find_tangent_force(scene, u, f, tangent)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: u(:, :, :)    !! (3,n_nodes,n) of several displacements [length]
    real(wp), intent(out) :: f(:, :, :)   !! (3,n_nodes,n) [force]
    type(tangent_t), intent(in), optional :: tangent
    integer :: g

    if (present(tangent)) then
      call tangent_force(scene%mesh, scene%materials, tangent, u, f)
      return
    end if
    do g = 1, size(u, 3)
      call internal_force(scene%mesh, scene%materials, u(:, :, g), f(:, :, g))
    end do
  end subroutine find_tangent_force

  !> The strain energy of a state [energy].
  pure real(wp) function strain_energy(scene, free, state, f) result(energy)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: free(:)       !! (n_elements) strain by free expansion [-]
    type(state_t), intent(in) :: state
    real(wp), intent(in) :: f(:, :)       !! (3,n_nodes) its internal forces [force]

    if (is_linear(scene)) then
      energy = 0.5_wp*sum(f*state%displacement)
    else
      energy = finite_strain_energy(scene%mesh, scene%materials, free, state%displacement, &
        state%modes)
    end if
  end function strain_energy

  !> The strain energy of each body; of what is none first.
  pure function strain_energies(scene, free, state, of_small_strain) result(energy)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: free(:)             !! (n_elements) strain by free expansion [-]
    type(state_t), intent(in) :: state
    real(wp), intent(in) :: of_small_strain(0:) !! (0:n_bodies) if the strain is small [energy]
    real(wp) :: energy(0:scene%mesh%n_bodies)   !! [energy]

    if (is_linear(scene)) then
      energy = of_small_strain
    else
      energy = finite_strain_energies(scene%mesh, scene%materials, free, state%displacement, &
        state%modes)
    end if
  end function strain_energies

  !> The part of heat in the energy of an increment.
  pure subroutine find_heat(scene, free, old, new, work, surplus)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: free(:)       !! (n_elements) strain by free expansion of `new` [-]
    type(state_t), intent(in) :: old, new
    real(wp), intent(out) :: work
    !! at finite strain: what the strain energy changes by as elements expand [energy]
    real(wp), intent(out) :: surplus
    !! at small strain: by how much the energy of the total strain of `new` is more than that of
    !! its stresses: f . u - C, f the forces of thermal expansion, C their energy in elements that
    !! cannot expand. docs/theory.md (8.35). [energy]
    real(wp) :: before(scene%mesh%n_elements), f(3, scene%mesh%n_nodes)

    work = 0.0_wp
    surplus = 0.0_wp
    if (.not. is_linear(scene)) then
      call find_free_strain(scene, max(1, old%step), old%position, before)
      work = 0.5_wp*(work_of_heat(scene%mesh, scene%materials, before, old%displacement, free - &
        before) + work_of_heat(scene%mesh, scene%materials, free, new%displacement, free - before))
    else if (any(abs(free) > 0.0_wp)) then
      f = 0.0_wp
      call thermal_force(scene%mesh, scene%materials, free, f)
      surplus = sum(f*new%displacement) - thermal_energy(scene%mesh, scene%materials, free)
    end if
  end subroutine find_heat

  !> The largest force of an element that would keep its shape as it warms, of each body; 0 where
  !> such forces are loads.
  pure function forces_of_heat(scene, free) result(largest)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: free(:)       !! (n_elements) strain by free expansion [-]
    real(wp) :: largest(0:scene%mesh%n_bodies) !! [force]

    largest = 0.0_wp
    if (.not. is_linear(scene)) largest = largest_thermal_forces(scene%mesh, scene%materials, free)
  end function forces_of_heat

end module bodies_mod
