!> An increment's equilibrium as it stands at one displacement and one set of reactions: where the
!> points are placed, and what is out of balance of forces and of the law.
module iterate_mod
  use kinds_mod, only: wp
  use constraints_mod, only: constraints_t, active_constraints, follow_masters
  use scene_mod, only: scene_t
  use candidate_points_mod, only: take_deformed_areas
  use contact_points_mod, only: contact_points_t, is_covered, laws_of_points
  use friction_laws_mod, only: friction_law_t, largest_friction
  use state_mod, only: state_t, modes_t
  use increment_forces_mod, only: increment_forces_t
  use bodies_mod, only: find_internal_force
  use mesh_forces_mod, only: force_rounding
  use inertia_mod, only: inertia_t, in_motion_t, force_of_inertia, rounding_of_inertia
  use turning_couplings_mod, only: turned_constraints, turn_moments, settle_couplings
  use placement_mod, only: placement_t, place_curved
  use drag_points_mod, only: drag_points
  use surface_drag_mod, only: drag_along_surfaces
  use follow_points_mod, only: rounding_of_places
  use transfer_mod, only: relative_motion, nodal_forces, gap_at, rows_of_points
  use following_loads_mod, only: let_loads_follow
  use force_balance_mod, only: out_of_balance, scale_of_forces
  use carried_frames_mod, only: carried_frame, slips_around
  implicit none
  private

  public :: task_t, iterate_t, look_at, world_reactions, local_reactions, set_reactions, &
    is_closed, is_beyond, law_error, outside_of_cone

  !> What an increment's equilibrium is sought for; nothing changes it.
  type :: task_t
    type(increment_forces_t) :: forces !! what is imposed at the end of the increment
    real(wp), allocatable :: free(:)   !! (n_elements) strain by free expansion [-]
    real(wp), allocatable :: rotation(:, :) !! (3,n_obstacles) at the end [rad]
    real(wp), allocatable :: turned_from(:, :)
    !! (3,n) rotations of couplings where the increment begins; not allocated: none turns [length]
    type(inertia_t), allocatable :: inertia !! of a dynamic *STEP
    type(in_motion_t) :: in_motion          !! what it begins with there
    real(wp), allocatable :: of_elements(:) !! (n_elements) as of linearisation_t [force/length]
    type(state_t) :: old               !! where it begins
    logical, allocatable :: stays(:)   !! (n_points) closed, and may pull
    logical, allocatable :: is_free(:) !! (0:n_bodies) supports do not hold it; 0: any
    type(placement_t) :: began         !! the points there
    logical, allocatable :: can_move(:, :) !! (3,n_nodes) what supports leave
    real(wp) :: tolerance = 0.0_wp     !! [-]
    real(wp) :: asked = 0.0_wp         !! the increment's, which `tolerance` may be below [-]
  end type task_t

  !> All of one place. Reactions are in the frames of the place.
  type :: iterate_t
    real(wp), allocatable :: u(:, :)          !! (3,n_nodes) [length]
    real(wp), allocatable :: reaction(:, :)   !! (3,n_points) n, t1, t2; 0 without a row [force]
    type(modes_t) :: modes
    type(placement_t) :: placement
    real(wp), allocatable :: frame(:, :, :)   !! (3,3,n_points) as of carried_frame
    logical, allocatable :: has(:, :)         !! (3,n_points) rows n, t1, t2 of the law
    logical, allocatable :: is_driven(:)
    !! (n_points) supports make it slip along a tangent that cannot move
    type(friction_law_t), allocatable :: law(:)
    !! (n_points) what normal reactions make of friction here; not allocated: nothing
    real(wp), allocatable :: x(:, :)          !! (3,n_points) gap and slip [length]
    real(wp), allocatable :: slip(:, :)       !! (3,n_points) the slip in x, y, z [length]
    type(constraints_t) :: constraints        !! active, about this place
    type(increment_forces_t) :: forces
    real(wp), allocatable :: unbalanced(:, :) !! (3,n_nodes) f_ext + B^T r - f_int [force]
    real(wp), allocatable :: residual(:, :)   !! (3,n_nodes) of what can move, masters' [force]
    real(wp), allocatable :: scale(:)         !! (0:n_bodies) largest force of each body [force]
    real(wp) :: imbalance = 0.0_wp            !! of the residual beside them [-]
    integer :: inverted = 0                   !! element that is inside out; 0: none
    real(wp), allocatable :: falls(:, :)
    !! (3,n_nodes) how bodies move from here that nothing balances; not allocated: all has balance
    !! [length]
  end type iterate_t

contains

  !> Look at one place. What depends on others is put where it belongs. With an element inside out
  !> nothing is known but that.
  subroutine look_at(scene, points, task, start, u, reaction, now)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(task_t), intent(in) :: task
    type(iterate_t), intent(in) :: start      !! its placement and modes lead here
    real(wp), intent(in) :: u(:, :)           !! (3,n_nodes) [length]
    real(wp), intent(in) :: reaction(:, :)    !! (3,n_points) in the frames here [force]
    type(iterate_t), intent(out) :: now
    integer :: i, row(3, points%n)

    now%u = u
    now%modes = start%modes
    now%forces = task%forces
    call follow_masters(start%constraints, now%u)
    if (allocated(task%turned_from)) call settle_couplings(scene, task%forces%prescribed, &
      task%turned_from, now%u)
    call find_internal_force(scene, task%free, now%u, now%modes, now%forces%internal, now%inverted)
    if (now%inverted > 0) return
    if (allocated(task%inertia)) now%forces%internal = now%forces%internal + force_of_inertia( &
      scene%mesh, task%inertia, task%in_motion, now%u)
    call let_loads_follow(scene, now%u, now%forces%imposed_t)

    now%placement = start%placement
    call place_curved(scene, points, now%u, now%placement, task%rotation, stay=.true.)
    call drag_points(scene, points, task%old, now%u, task%rotation, now%placement)
    call drag_along_surfaces(scene, points, task%began, task%old, now%u, now%placement)
    call take_deformed_areas(scene, points, now%u, now%placement)
    call laws_of_points(points, [(i, i=1, points%n)], now%placement%covered_area, now%law)
    now%frame = now%placement%frame
    allocate (now%x(3, points%n), now%slip(3, points%n), source=0.0_wp)
    call rows_of_points(task%can_move, points, now%placement%weights, now%frame, row)
    do i = 1, points%n
      now%frame(:, :, i) = carried_frame(task%began%frame(:, :, i), now%frame(:, 1, i), &
        slips_around(scene%mesh, points, i))
      if (.not. is_covered(points, now%placement%weights, i)) cycle
      associate (weights => now%placement%weights)
        now%slip(:, i) = relative_motion(points, weights, i, now%u) - relative_motion(points, &
          weights, i, task%old%displacement) + now%placement%drag(:, i)
      end associate
      now%x(:, i) = [gap_at(now%placement, points, i, now%u), matmul(now%slip(:, i), &
        now%frame(:, 2:, i))]
    end do
    now%has = row > 0
    call find_driven(scene, points, task, now)
    call set_reactions(scene, points, task, reaction, now)
  end subroutine look_at

  !> The points that supports make slip: friction acts along tangents that have no row, too.
  !> docs/theory.md (3.8).
  pure subroutine find_driven(scene, points, task, now)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(task_t), intent(in) :: task
    type(iterate_t), intent(inout) :: now
    real(wp) :: least
    integer :: i

    allocate (now%is_driven(points%n), source=.false.)
    least = max(rounding_of_places(scene, now%u), task%asked*maxval(abs(now%u - &
      task%old%displacement)))
    do i = 1, points%n
      if (.not. now%has(1, i) .or. points%mu(i) <= 0.0_wp) cycle
      now%is_driven(i) = norm2(merge(0.0_wp, now%x(2:, i), now%has(2:, i))) > least
      if (now%is_driven(i)) now%has(:, i) = .true.
    end do
  end subroutine find_driven

  !> The same place with other reactions.
  subroutine set_reactions(scene, points, task, reaction, now)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(task_t), intent(in) :: task
    real(wp), intent(in) :: reaction(:, :)    !! (3,n_points) in the frames here [force]
    type(iterate_t), intent(inout) :: now
    real(wp) :: pressed(3, size(now%u, 2)), left
    integer :: node

    now%reaction = merge(reaction, 0.0_wp, now%has)
    pressed = nodal_forces(points, now%placement%weights, world_reactions(now), size(now%u, 2))
    now%forces%rounding = force_rounding(scene%mesh, task%of_elements, &
      max(abs(now%u), abs(task%old%displacement)))
    if (allocated(task%inertia)) now%forces%rounding = now%forces%rounding + rounding_of_inertia( &
      task%inertia, now%u)
    now%unbalanced = now%forces%external + pressed - now%forces%internal
    now%residual = now%forces%external
    now%constraints = active_constraints(turned_constraints(scene, task%forces%prescribed, &
      now%u, task%turned_from), task%forces%prescribed)
    call turn_moments(scene, task%forces%prescribed, now%u, now%residual, task%turned_from)
    now%residual = now%residual + pressed - now%forces%internal
    call out_of_balance(scene%mesh, now%constraints, now%forces, task%tolerance < task%asked, &
      now%residual, now%imbalance, left)
    if (.not. allocated(now%scale)) allocate (now%scale(0:scene%mesh%n_bodies))
    now%scale(0:) = scale_of_forces(scene%mesh, now%forces)
    do node = 1, size(pressed, 2)
      associate (of_body => now%scale(scene%mesh%body(node)))
        of_body = max(of_body, norm2(pressed(:, node)))
      end associate
    end do
    now%scale(0) = maxval(now%scale)
  end subroutine set_reactions

  !> The reactions in x, y, z.
  pure function world_reactions(now) result(reaction)
    type(iterate_t), intent(in) :: now
    real(wp) :: reaction(3, size(now%reaction, 2)) !! [force]
    integer :: i

    do i = 1, size(reaction, 2)
      reaction(:, i) = matmul(now%frame(:, :, i), now%reaction(:, i))
    end do
  end function world_reactions

  !> Reactions in x, y, z in the frames of a place.
  pure function local_reactions(now, world) result(reaction)
    type(iterate_t), intent(in) :: now
    real(wp), intent(in) :: world(:, :)            !! (3,n_points) [force]
    real(wp) :: reaction(3, size(world, 2))        !! [force]
    integer :: i

    do i = 1, size(reaction, 2)
      reaction(:, i) = matmul(world(:, i), now%frame(:, :, i))
    end do
  end function local_reactions

  !> Whether a point with the normal prediction `y` has a reaction: it presses, or stays closed.
  pure logical function is_closed(task, now, i, y)
    type(task_t), intent(in) :: task
    type(iterate_t), intent(in) :: now
    integer, intent(in) :: i
    real(wp), intent(in) :: y          !! r_n - rho x_n [force]

    is_closed = now%has(1, i) .and. (task%stays(i) .or. y > 0.0_wp)
  end function is_closed

  !> Whether friction does not hold a prediction. Where it pulls there is none.
  pure logical function is_beyond(mu, now, i, y)
    real(wp), intent(in) :: mu         !! [-]
    type(iterate_t), intent(in) :: now
    integer, intent(in) :: i           !! point
    real(wp), intent(in) :: y(3)       !! [force]
    real(wp) :: radius, slope

    call largest_friction(mu, now%law, i, y(1), radius, slope)
    is_beyond = y(1) < 0.0_wp .or. norm2(y(2:)) > radius
  end function is_beyond

  !> What a point's reaction is off the law by: r - P(r - rho x), P on the friction of its own
  !> normal reaction; where it is driven the friction is against its slip. One that stays closed may
  !> be pulled. docs/theory.md (4.24).
  pure function law_error(mu, stays, rho, now, i) result(z)
    real(wp), intent(in) :: mu         !! [-]
    logical, intent(in) :: stays       !! closed
    real(wp), intent(in) :: rho        !! [force/length]
    type(iterate_t), intent(in) :: now
    integer, intent(in) :: i           !! point
    real(wp) :: z(3), y(3), size_y, radius, slope

    associate (r => now%reaction(:, i), x => now%x(:, i), has => now%has(:, i), &
               is_driven => now%is_driven(i))
      y = merge(r - rho*x, 0.0_wp, has)
      call largest_friction(mu, now%law, i, y(1), radius, slope)
      if (.not. stays) y(1) = max(0.0_wp, y(1))
      if (is_driven) y(2:) = -x(2:)
      size_y = norm2(y(2:))
      if (is_driven .or. size_y > radius) y(2:) = y(2:)*(radius/size_y)
      z = merge(r - y, 0.0_wp, has)
    end associate
  end function law_error

  !> What a reaction is outside of its cone, wherever the point is.
  pure real(wp) function outside_of_cone(mu, stays, now, i) result(outside)
    real(wp), intent(in) :: mu         !! [-]
    logical, intent(in) :: stays       !! closed: it may be pulled
    type(iterate_t), intent(in) :: now
    integer, intent(in) :: i           !! point
    real(wp) :: radius, slope

    associate (r => now%reaction(:, i))
      call largest_friction(mu, now%law, i, r(1), radius, slope)
      outside = max(0.0_wp, norm2(r(2:)) - radius)
      if (.not. stays) outside = max(outside, -r(1))
    end associate
  end function outside_of_cone

end module iterate_mod
