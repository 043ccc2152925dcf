!> Free bodies that nothing resists: where they come to rest, or that nothing balances them.
!> docs/theory.md section 4, "Displacements and reactions together".
module loose_bodies_mod
  use kinds_mod, only: wp
  use dense_mod, only: null_space
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use rigid_modes_mod, only: free_motions_t, motion_at, add_motions, generalised_loads
  use way_to_rest_mod, only: way_to_rest
  use dof_map_mod, only: dof_map_t, to_equations, unknowns_of
  use transfer_mod, only: nodal_forces, relative_motion, motion_of_point
  use iterate_mod, only: task_t, iterate_t, world_reactions
  use point_rows_mod, only: point_row_t
  use linearise_mod, only: set_t, step_t
  implicit none
  private

  public :: loose_t, begin_loose, note_pressed, stay_unseen, is_held_back, follow_loose

  integer, parameter :: most_alike = 5        !! steps in a row of a body that goes on and on
  real(wp), parameter :: alike = 1.0e-2_wp    !! that differ by less [-]
  real(wp), parameter :: rounding = 1.0e-9_wp !! of a step: closes nothing [-]

  !> What iterations leave to each other of bodies that nothing resists.
  type :: loose_t
    logical, allocatable :: lands(:)      !! (n_points) that a body comes to next
    logical, allocatable :: is_pressed(:) !! (0:n_bodies) by any point
    integer :: adrift = 0                 !! steps in a row that were as the one before
    real(wp), allocatable :: went(:, :)   !! (3,n_nodes) that one [length]
  end type loose_t

contains

  pure type(loose_t) function begin_loose(n_points, n_nodes, n_bodies) result(loose)
    integer, intent(in) :: n_points, n_nodes, n_bodies

    allocate (loose%lands(n_points), source=.false.)
    allocate (loose%is_pressed(0:n_bodies), source=.false.)
    allocate (loose%went(3, n_nodes), source=0.0_wp)
  end function begin_loose

  !> Note which bodies any point presses.
  pure subroutine note_pressed(scene, points, now, set, loose)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(iterate_t), intent(in) :: now
    type(set_t), intent(in) :: set
    type(loose_t), intent(inout) :: loose
    integer :: i

    loose%is_pressed = .false.
    do i = 1, points%n
      if (set%presses(i)) loose%is_pressed(bodies_of(scene, points, now, i)) = .true.
    end do
  end subroutine note_pressed

  !> The bodies of a point.
  pure function bodies_of(scene, points, now, i) result(bodies)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(iterate_t), intent(in) :: now
    integer, intent(in) :: i
    integer, allocatable :: bodies(:) !! some of them more than once

    associate (weights => now%placement%weights)
      bodies = scene%mesh%body([points%node(i), weights%node(weights%first(i): &
        weights%first(i + 1) - 1)])
    end associate
  end function bodies_of

  !> Take from a step what goes along motions that no point which presses sees, that turn no normal
  !> there and that nothing drives: what is known of them is rounding over the little that holds
  !> them back. docs/theory.md (9.6a).
  subroutine stay_unseen(scene, points, task, now, rows, motions, step)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(task_t), intent(in) :: task
    type(iterate_t), intent(in) :: now
    type(point_row_t), intent(in) :: rows(:)  !! of the points that press
    type(free_motions_t), intent(in) :: motions
    type(step_t), intent(inout) :: step
    real(wp), parameter :: not_seen = 1.0e-10_wp !! beside what is seen most [-]
    real(wp), parameter :: still = 1.0e-6_wp  !! beside the normal that turns most [-]
    type(free_motions_t) :: here
    real(wp), allocatable :: seen(:, :), turned(:, :), turns(:, :), load(:), rounding(:), &
      unseen(:, :)
    integer :: j

    if (motions%n == 0) return
    here = motions
    here%place = scene%mesh%coordinates + now%u
    call move_points(scene, points, task, now, rows, here, seen, turned)
    unseen = null_space(seen, not_seen)
    if (size(unseen, 2) == 0) return
    call generalised_loads(here, scene%mesh, now%residual, abs(now%residual), load, rounding)
    if (norm2(matmul(load, unseen)) > task%tolerance*maxval(now%scale(here%body))) return
    turns = matmul(turned, unseen)
    where (abs(turns) <= still*maxval(abs(turned))) turns = 0.0_wp
    unseen = matmul(unseen, null_space(turns, still))
    call add_motions(here, scene%mesh, way_to_rest(scene%mesh, here, [(j, j=1, here%n)], unseen, &
      step%u), step%u)
  end subroutine stay_unseen

  !> What motions do at points that press, and at the supports of the bodies that they move.
  subroutine move_points(scene, points, task, now, rows, motions, seen, turned)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(task_t), intent(in) :: task
    type(iterate_t), intent(in) :: now
    type(point_row_t), intent(in) :: rows(:)             !! of the points
    type(free_motions_t), intent(in) :: motions
    real(wp), allocatable, intent(out) :: seen(:, :)     !! (m,n_motions) gaps, slips, supports [-]
    real(wp), allocatable, intent(out) :: turned(:, :)   !! (3 n_rows,n_motions) normals [1/length]
    real(wp) :: at(3, motions%n)
    logical :: supported(3, scene%mesh%n_nodes)
    integer :: i, j, k, n, q

    supported = task%forces%prescribed .and. spread(task%is_free(scene%mesh%body), 1, 3)
    allocate (seen(3*size(rows) + count(supported), motions%n))
    allocate (turned(3*size(rows), motions%n), source=0.0_wp)
    n = 0
    do i = 1, size(rows)
      associate (point => rows(i)%point, turns => turned(3*i - 2:3*i, :))
        do j = 1, motions%n
          at(:, j) = motion_of_point(scene%mesh, points, now%placement%weights, motions, point, j)
          do q = 1, size(rows(i)%node)
            turns(:, j) = turns(:, j) + matmul(rows(i)%normal(:, :, q), motion_at(motions, &
              scene%mesh, j, rows(i)%node(q)))
          end do
        end do
        ! Friction may do along any of its directions.
        k = merge(3, 1, points%mu(point) > 0.0_wp)
        seen(n + 1:n + k, :) = matmul(transpose(now%frame(:, :k, point)), at)
      end associate
      n = n + k
    end do
    do i = 1, scene%mesh%n_nodes
      if (.not. any(supported(:, i))) cycle
      do j = 1, motions%n
        at(:, j) = motion_at(motions, scene%mesh, j, i)
      end do
      do k = 1, 3
        if (.not. supported(k, i)) cycle
        n = n + 1
        seen(n, :) = at(k, :)
      end do
    end do
    seen = seen(:n, :)
  end subroutine move_points

  !> Whether most of the work that a step does on a body goes into what holds it back.
  pure function is_held_back(scene, points, now, map, holds, step) result(is)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(iterate_t), intent(in) :: now
    type(dof_map_t), intent(in) :: map
    real(wp), intent(in) :: holds(:)         !! (n_free) each unknown back [force/length]
    type(step_t), intent(in) :: step
    logical :: is(0:scene%mesh%n_bodies)
    real(wp), dimension(0:scene%mesh%n_bodies) :: work, held
    real(wp), dimension(map%n_free) :: moved, force
    type(iterate_t) :: change
    integer :: i

    change%reaction = step%r
    change%frame = now%frame
    moved = unknowns_of(map, step%u)
    call to_equations(map, now%residual + nodal_forces(points, now%placement%weights, &
      world_reactions(change), size(now%u, 2)), force)
    work = 0.0_wp
    held = 0.0_wp
    do i = 1, map%n_free
      associate (body => scene%mesh%body(map%node(i)))
        work(body) = work(body) + force(i)*moved(i)
        held(body) = held(body) + holds(i)*moved(i)**2
      end associate
    end do
    is = held > 0.5_wp*abs(work)
  end function is_held_back

  !> Bodies that nothing resists but what holds them back, where nothing presses them, or they go on
  !> and on: they go in the right direction, not as far as they would, so what they come to first
  !> presses next. Where nothing is on the way of any nothing balances them.
  subroutine follow_loose(scene, points, now, set, step, is_held, loose, is_loose)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(iterate_t), intent(in) :: now
    type(set_t), intent(in) :: set
    type(step_t), intent(in) :: step
    logical, intent(in) :: is_held(0:)       !! (0:n_bodies) as of is_held_back
    type(loose_t), intent(inout) :: loose
    logical, intent(out) :: is_loose(0:)     !! (0:n_bodies) nothing balances it
    logical :: flies(0:scene%mesh%n_bodies)
    real(wp) :: closes(points%n)             !! where, in parts of the step [-]
    real(wp) :: speed, first
    integer :: i

    is_loose = .false.
    loose%adrift = merge(loose%adrift + 1, 0, any(is_held) .and. norm2(step%u - loose%went) <= &
      alike*norm2(step%u))
    loose%went = step%u
    flies = is_held .and. (.not. loose%is_pressed .or. loose%adrift == most_alike)
    if (.not. any(flies)) return
    closes = huge(1.0_wp)
    do i = 1, points%n
      if (.not. now%has(1, i) .or. set%presses(i)) cycle
      if (.not. any(flies(bodies_of(scene, points, now, i)))) cycle
      speed = -dot_product(now%frame(:, 1, i), relative_motion(points, now%placement%weights, i, &
        step%u))
      if (speed > rounding*maxval(abs(step%u))) closes(i) = max(0.0_wp, now%x(1, i))/speed
    end do
    if (.not. any(closes < huge(1.0_wp))) is_loose = flies
    do i = 0, scene%mesh%n_bodies
      if (.not. flies(i)) cycle
      first = minval(closes, mask=is_of(i))
      if (first < huge(1.0_wp)) loose%lands = loose%lands .or. (is_of(i) .and. closes <= &
        1.001_wp*first)
    end do

  contains

    !> The points of one body.
    function is_of(body) result(is)
      integer, intent(in) :: body
      logical :: is(points%n)
      integer :: k

      is = [(any(bodies_of(scene, points, now, k) == body), k=1, points%n)]
    end function is_of

  end subroutine follow_loose

end module loose_bodies_mod
