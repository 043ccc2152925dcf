!> The displacement at which the forces of an iteration are asked for, by Anderson's acceleration,
!> and these forces. docs/theory.md (8.21).
module extrapolate_mod
  use kinds_mod, only: wp
  use constraints_mod, only: follow_masters
  use scene_mod, only: scene_t
  use state_mod, only: state_t
  use increment_report_mod, only: increment_report_t
  use bodies_mod, only: find_internal_force
  use anderson_mod, only: new_anderson, accelerate, forget
  use rigid_modes_mod, only: free_motions_t, add_motions
  use dof_map_mod, only: dof_map_t, to_nodes, unknowns_of
  use follow_bodies_mod, only: largest_deformation
  use following_loads_mod, only: let_loads_follow
  use step_solver_mod, only: step_solver_t
  use inertia_mod, only: force_of_inertia
  use trial_mod, only: trial_t
  use place_and_solve_mod, only: newton_raphson_t
  use displace_mod, only: settle
  implicit none
  private

  public :: update_forces

  real(wp), parameter :: nearby = 1.0e-2_wp
  !! of the way of an increment: so near the modes of the last iteration lead to the next [-]

contains

  !> The internal forces of the displacement, which is accelerated first where they are not linear,
  !> those of inertia among them, and pressures on surfaces where it takes them.
  subroutine update_forces(scene, solver, old, trial, new, loop, report, inverted)
    type(scene_t), intent(in) :: scene
    type(step_solver_t), intent(in) :: solver
    type(state_t), intent(in) :: old
    type(trial_t), intent(inout) :: trial             !! gets the forces
    type(state_t), intent(inout) :: new               !! its displacement, as of `extrapolate`
    type(newton_raphson_t), intent(inout) :: loop
    type(increment_report_t), intent(inout) :: report !! counts
    integer, intent(out) :: inverted                  !! element that is inside out; 0: none

    if (.not. loop%is_linear) then
      call extrapolate(scene, solver%body%inverse%map, solver%body%motions, old, trial, new, loop)
      ! Iterations far away may find modes of no use to the next.
      if (.not. loop%apart < nearby) new%modes = loop%modes
      report%force_evaluations = report%force_evaluations + 1
    end if
    call find_internal_force(scene, trial%free, new%displacement, new%modes, &
      trial%forces%internal, inverted)
    if (allocated(solver%body%inertia)) then
      trial%in_motion%force = force_of_inertia(scene%mesh, solver%body%inertia, trial%in_motion, &
        new%displacement)
      trial%forces%internal = trial%forces%internal + trial%in_motion%force
    end if
    call let_loads_follow(scene, new%displacement, trial%forces%imposed_t)
  end subroutine update_forces

  !> The displacement at which forces are asked for next. With a factor of another
  !> place an iteration is a map from displacements to displacements, whose fixed point Anderson's
  !> acceleration finds; with the tangent of each iteration, where no pressures follow, it keeps
  !> nothing, and changes nothing.
  !> docs/theory.md (8.21).
  subroutine extrapolate(scene, map, motions, old, trial, new, loop)
    type(scene_t), intent(in) :: scene
    type(dof_map_t), intent(in) :: map
    type(free_motions_t), intent(in) :: motions
    type(state_t), intent(in) :: old
    type(trial_t), intent(inout) :: trial  !! its u_free and motion take the difference
    type(state_t), intent(inout) :: new    !! gets displacement
    type(newton_raphson_t), intent(inout) :: loop
    real(wp), dimension(map%n_free + motions%n) :: image, next
    real(wp) :: step(3, size(new%displacement, 2)), way
    integer :: j

    image = [unknowns_of(map, new%displacement), trial%motion]
    if (.not. allocated(loop%at)) then
      loop%memory = new_anderson(size(image), loop%depth)
      loop%apart = huge(1.0_wp)
    else
      way = max(maxval(abs(new%displacement - old%displacement)), &
        largest_deformation(scene%mesh, new%displacement))
      associate (before => loop%last_apart)
        loop%apart = 0.0_wp
        if (way > 0.0_wp) loop%apart = maxval(abs(image - loop%at))/way
        if (0.5_wp*loop%apart > before) call forget(loop%memory)
        before = loop%apart
      end associate
      call accelerate(loop%memory, loop%at, image, next)
      if (way > 0.0_wp) loop%mixed = maxval(abs(next - image))/way
      call to_nodes(map, next(:map%n_free) - image(:map%n_free), step)
      associate (further => next(map%n_free + 1:) - image(map%n_free + 1:))
        do j = 1, motions%n
          step(motions%dof(j), motions%node(j)) = further(j)
        end do
        ! Nodes may go with a pin.
        if (map%constraints%n > 0) call follow_masters(map%constraints, step)
        new%displacement = new%displacement + step
        trial%motion = trial%motion + further
        call add_motions(motions, scene%mesh, -further, step)
      end associate
      trial%u_free = trial%u_free + step
      call settle(scene, motions, trial, new%displacement)
      image = next
    end if
    loop%at = image
  end subroutine extrapolate

end module extrapolate_mod
