!> Bodies that their supports turn: an increment begins where they have turned to, and solutions are
!> with the factor of where they stood, turned with them. docs/theory.md (8.36).
!>
!> The law is objective: a body that turns as a whole has the tangent R K R^T. So one factor serves
!> for turns of any size. The turn of a body is that of the nodes that supports hold.
module turned_bodies_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t
  use rotations_mod, only: fit_motion, rotation_matrix
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t, modes_t
  use increment_forces_mod, only: increment_forces_t
  use bodies_mod, only: is_linear, find_internal_force, find_tangent_force
  use dof_map_mod, only: can_turn, turn_nodes, stop_turning, is_turned
  use rigid_modes_mod, only: free_motions_t, add_motions
  use following_loads_mod, only: let_loads_follow
  use transfer_mod, only: nodal_forces
  use stiffness_inverse_mod, only: apply_inverse, moved_by
  use condense_contact_mod, only: condense_contact
  use placement_mod, only: placement_t
  use step_solver_mod, only: step_solver_t
  use trial_mod, only: trial_t
  implicit none
  private

  public :: begin_turned, end_turned, begin_where_turned, condense_flat

  real(wp), parameter :: negligible = 1.0e-9_wp !! turn that rounding may make [rad]

contains

  !> Turn what supports turn, and begin the increment there: with the forces of the displacements
  !> that are turned, and by the turned tangent what supports and loads do beside that. Nothing is
  !> changed where nothing turns.
  subroutine begin_turned(scene, points, solver, old, trial, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(inout) :: solver     !! its factor and contact, turned
    type(state_t), intent(in) :: old
    type(trial_t), intent(inout) :: trial            !! its displacements and applied reactions
    type(error_t), allocatable, intent(out) :: error !! MUMPS failed
    real(wp), dimension(3, 3, 0:scene%mesh%n_bodies) :: now, since !! turns [-]
    real(wp), dimension(3, scene%mesh%n_nodes) :: u, moved, held
    real(wp), allocatable :: back(:, :, :), added(:, :, :), correction(:, :, :)
    type(modes_t) :: modes
    integer :: i, inverted

    if (is_linear(scene) .or. solver%choices%precision%renews_tangent) return
    if (.not. solver%body%inverse%is_condensed .or. allocated(solver%body%inverse%iterative)) return
    u = old%displacement
    call turn_supported(scene, trial, solver, u, now, since)
    if (.not. is_turned(solver%body%inverse%map)) return
    trial%has_turned = .true.
    call let_loads_follow(scene, u, trial%forces%imposed_t)
    modes = old%modes
    call find_internal_force(scene, trial%free, u, modes, held, inverted)
    do i = 1, points%n
      trial%applied_reaction(:, i) = matmul(now(:, :, scene%mesh%body(points%node(i))), &
        old%reaction(:, i))
    end do
    associate (body => solver%body, mesh => scene%mesh)
      trial%applied_force = nodal_forces(points, trial%began%weights, trial%applied_reaction, &
        mesh%n_nodes)
      moved = 0.0_wp
      where (trial%forces%prescribed) moved = trial%forces%displacement - u
      back = turned_back(mesh%body, since, moved)
      allocate (added, mold=back)
      call find_tangent_force(scene, back, added, body%tangent)
      do i = 1, mesh%n_nodes
        held(:, i) = held(:, i) + matmul(since(:, :, mesh%body(i)), added(:, i, 1))
      end do
      call apply_inverse(body%inverse, reshape(trial%forces%external + trial%applied_force - held, &
        shape(added)), correction, error)
      if (allocated(error)) return
      ! On the interface u_free must be what the contact problem adds W r to.
      trial%u_contact = moved_by(body%inverse, trial%applied_force)
      trial%u_free = u + moved + correction(:, :, 1) - trial%u_contact
      call add_motions(body%motions, mesh, -trial%motion, trial%u_free)
    end associate
    trial%placed_at = u + moved
    call condense_flat(scene, points, solver)
  end subroutine begin_turned

  !> Take the factor, and contact with it, as they stand.
  subroutine end_turned(scene, points, solver)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(inout) :: solver

    if (.not. is_turned(solver%body%inverse%map)) return
    call stop_turning(solver%body%inverse%map)
    call condense_flat(scene, points, solver)
  end subroutine end_turned

  !> The contact problem before flat obstacles, which placements do not make anew.
  subroutine condense_flat(scene, points, solver)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(inout) :: solver
    type(placement_t) :: first

    if (all(points%is_curved)) return
    first = solver%undeformed
    first%gap = solver%first_gap
    call condense_contact(scene, solver%choices%tolerance, points, solver%body, first, first, &
      solver%contact)
  end subroutine condense_flat

  !> The turns of bodies that all supports of a body together make, and their displacements turned.
  subroutine turn_supported(scene, trial, solver, u, now, since)
    type(scene_t), intent(in) :: scene
    type(trial_t), intent(in) :: trial           !! its prescribed displacements
    type(step_solver_t), intent(inout) :: solver !! its factor is turned
    real(wp), intent(inout) :: u(:, :)
    !! (3,n_nodes) displacement as the increment begins; turned [length]
    real(wp), intent(out) :: now(:, :, 0:)       !! (3,3,0:n_bodies) turns in this increment [-]
    real(wp), intent(out) :: since(:, :, 0:)     !! and since the factor was made [-]
    real(wp), dimension(3, 3) :: rotation, all_of_it
    real(wp) :: shift(3), unused(3), at(3, scene%mesh%n_nodes), goal(3, scene%mesh%n_nodes)
    integer, allocatable :: nodes(:), held(:)
    integer :: b
    logical :: is_found, is_known

    now = spread(rotation_matrix([0.0_wp, 0.0_wp, 0.0_wp]), 3, size(now, 3))
    since = now
    at = scene%mesh%coordinates
    if (allocated(solver%body%tangent)) at = at + solver%body%tangent%at
    goal = scene%mesh%coordinates + trial%forces%displacement
    do b = 1, scene%mesh%n_bodies
      call list_supported(scene, trial%forces%prescribed, solver%body%motions, b, nodes, held)
      if (size(held) < 3 .or. .not. can_turn(solver%body%inverse%map, nodes)) cycle
      call fit_motion(scene%mesh%coordinates(:, held) + u(:, held), goal(:, held), rotation, &
        shift, is_found)
      call fit_motion(at(:, held), goal(:, held), all_of_it, unused, is_known)
      if (.not. (is_found .and. is_known)) cycle
      if (.not. any(abs([rotation, all_of_it] - [now(:, :, 0), now(:, :, 0)]) > negligible)) cycle
      now(:, :, b) = rotation
      since(:, :, b) = all_of_it
      call turn_nodes(solver%body%inverse%map, nodes, all_of_it)
      call move(scene, nodes, rotation, shift, u)
    end do
  end subroutine turn_supported

  !> Begin where supports have turned bodies to, with their displacements and reactions turned.
  subroutine begin_where_turned(scene, points, forces, motions, new, has_turned)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(increment_forces_t), intent(in) :: forces
    type(free_motions_t), intent(in) :: motions
    type(state_t), intent(inout) :: new
    logical, intent(out) :: has_turned
    real(wp) :: turn(3, 3), none(3, 3), shift(3)
    integer, allocatable :: nodes(:), held(:)
    integer :: b, i
    logical :: is_found

    none = rotation_matrix([0.0_wp, 0.0_wp, 0.0_wp])
    has_turned = .false.
    do b = 1, scene%mesh%n_bodies
      call list_supported(scene, forces%prescribed, motions, b, nodes, held)
      associate (x => scene%mesh%coordinates, u => new%displacement)
        call fit_motion(x(:, held) + u(:, held), x(:, held) + forces%displacement(:, held), turn, &
          shift, is_found)
        if (.not. (is_found .and. any(abs(turn - none) > negligible))) cycle
        call move(scene, nodes, turn, shift, u)
      end associate
      has_turned = .true.
      do i = 1, points%n
        if (scene%mesh%body(points%node(i)) == b) new%reaction(:, i) = matmul(turn, &
          new%reaction(:, i))
      end do
    end do
  end subroutine begin_where_turned

  !> The nodes of a body that supports hold, and those that they hold wholly.
  pure subroutine list_supported(scene, prescribed, motions, b, nodes, held)
    type(scene_t), intent(in) :: scene
    logical, intent(in) :: prescribed(:, :)        !! (3,n_nodes)
    type(free_motions_t), intent(in) :: motions
    integer, intent(in) :: b                       !! the body
    integer, allocatable, intent(out) :: nodes(:), held(:) !! empty where it is free
    integer :: i

    nodes = pack([(i, i=1, scene%mesh%n_nodes)], scene%mesh%body == b .and. .not. any( &
      motions%body == b))
    held = pack(nodes, all(prescribed(:, nodes), dim=1))
  end subroutine list_supported

  !> Move nodes as a whole, beside their displacements.
  pure subroutine move(scene, nodes, rotation, shift, u)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: nodes(:)
    real(wp), intent(in) :: rotation(3, 3), shift(3) !! [-], [length]
    real(wp), intent(inout) :: u(:, :)             !! (3,n_nodes) [length]
    integer :: i

    do i = 1, size(nodes)
      associate (x => scene%mesh%coordinates(:, nodes(i)))
        u(:, nodes(i)) = matmul(rotation, x + u(:, nodes(i))) + shift - x
      end associate
    end do
  end subroutine move

  !> Nodal values along axes that have not turned.
  pure function turned_back(body, turn, nodal) result(back)
    integer, intent(in) :: body(:)            !! (n_nodes)
    real(wp), intent(in) :: turn(:, :, 0:)    !! (3,3,0:n_bodies) [-]
    real(wp), intent(in) :: nodal(:, :)       !! (3,n_nodes)
    real(wp) :: back(3, size(nodal, 2), 1)
    integer :: i

    do i = 1, size(nodal, 2)
      back(:, i, 1) = matmul(nodal(:, i), turn(:, :, body(i)))
    end do
  end function turned_back

end module turned_bodies_mod
