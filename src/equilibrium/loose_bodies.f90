!> Free bodies that nothing resists: where they come to rest, or that nothing balances them.
!> docs/theory.md section 4, "Displacements and reactions together".
module loose_bodies_mod
  use kinds_mod, only: wp
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use dof_map_mod, only: dof_map_t, to_equations, unknowns_of
  use transfer_mod, only: nodal_forces, relative_motion
  use iterate_mod, only: iterate_t, world_reactions
  use linearise_mod, only: set_t, step_t
  implicit none
  private

  public :: loose_t, begin_loose, bodies_of, is_held_back, follow_loose

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
