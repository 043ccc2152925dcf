!> Whether a load cycle has settled: how far displacements, contact forces and slips at its end are
!> from those at the end of the cycle before, beside how far they go within it. docs/theory.md
!> (1.4), (1.5).
module settled_cycles_mod
  use kinds_mod, only: wp
  use number_list_mod, only: number_list_t, archive
  use mesh_mod, only: mesh_t
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t
  use increments_mod, only: asked_number
  use scene_mod, only: scene_t
  use increment_report_mod, only: increment_report_t, cycle_none, cycle_differs, cycle_settled
  use load_cycles_mod, only: load_cycles_t, cycles_done
  implicit none
  private

  public :: followed_cycle_t, carry_cycle, follow_cycle, settled_share

  real(wp), parameter :: settled_share = 1.0e-3_wp
  !! what is left to change in a cycle that has settled, of what changes within it: the definition

  !> Where the last cycle ended, and how far things went since. Groups are the bodies
  !> (displacements), then the pairs (forces of points), then the pairs again (slips that they gain
  !> in a cycle).
  type :: followed_cycle_t
    integer :: first = -1 !! of the cycles that are followed, as of load_cycles_t; -1: none
    integer :: n_ends = 0 !! ends of cycles after that
    integer :: settled = 0 !! the first of them at which the cycle had settled; 0: none
    real(wp), allocatable :: displacement(:, :) !! (3,n_nodes) at the last one [length]
    real(wp), allocatable :: reaction(:, :)     !! (3,n_points) the same [force]
    real(wp), allocatable :: slip(:, :)         !! (2,n_points) the same, a sum [length]
    real(wp), allocatable :: gain(:, :)
    !! (2,n_points) of slip in the last cycle; not allocated: no cycle is done [length]
    real(wp), allocatable :: swing(:, :)  !! (1,n_groups) the farthest from there since
    real(wp), allocatable :: change(:, :)
    !! (1,n_groups) from end to end in the last cycle; not allocated: no cycle is done
  end type followed_cycle_t

contains

  !> Put it into the list, or take it out.
  subroutine carry_cycle(list, cycle)
    type(number_list_t), intent(inout) :: list
    type(followed_cycle_t), intent(inout) :: cycle

    call archive(list, cycle%first)
    if (cycle%first < 0) return
    call archive(list, cycle%n_ends)
    call archive(list, cycle%settled)
    call archive(list, cycle%displacement)
    call archive(list, cycle%reaction)
    call archive(list, cycle%slip)
    call archive(list, cycle%gain)
    call archive(list, cycle%swing)
    call archive(list, cycle%change)
  end subroutine carry_cycle

  !> Follow an increment from `old` to `new`.
  !>
  !> A group has settled where the change from the end of the last cycle is no more than the
  !> tolerance leaves; or where it is smaller than that of the cycle before, and as small that
  !> neither all cycles that are left would change more than `settled_share` of the swing, should
  !> each change as much, nor endless ones, should changes shrink at the rate of the last two:
  !>
  !>     n_left c <= share s,   c q/(1 - q) <= share s,   q = c/c_before.
  pure subroutine follow_cycle(scene, points, cycles, tolerance, old, new, cycle, report)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(load_cycles_t), intent(in) :: cycles !! that the *STEP is part of, or has
    real(wp), intent(in) :: tolerance !! of contact [-]
    type(state_t), intent(in) :: old, new
    type(followed_cycle_t), intent(inout) :: cycle
    type(increment_report_t), intent(inout) :: report
    !! gets the kind of the end, and the largest change of a group, of its swing
    real(wp), allocatable :: gain(:, :), change(:, :)
    real(wp), dimension(size_of(scene%mesh, points)) :: moved, least

    report%load_cycle = cycle_none
    report%load_cycle_change = -1.0_wp
    if (cycles%length == 0) return
    if (cycle%first /= cycles%first) then
      cycle%first = -1
      if (deck_increments(scene, old) /= cycles%first) return
      cycle = followed_cycle_t(first=cycles%first)
      call begin_cycle(old, size(least), cycle)
    end if
    moved = distances(scene%mesh, points, new%displacement - cycle%displacement, new%reaction - &
      cycle%reaction, new%slip - cycle%slip)
    cycle%swing(1, :) = max(cycle%swing(1, :), moved)
    if (cycles_done(cycles, deck_increments(scene, new)) < 1) return
    cycle%n_ends = cycle%n_ends + 1
    allocate (gain, source=new%slip - cycle%slip)
    if (allocated(cycle%gain)) then
      allocate (change(1, size(moved)))
      change(1, :) = distances(scene%mesh, points, new%displacement - cycle%displacement, &
        new%reaction - cycle%reaction, gain - cycle%gain)
      least = 10.0_wp*tolerance*scales(scene%mesh, points, new, cycle%swing(1, :))
      report%load_cycle_change = maxval([0.0_wp, pack(change(1, :)/max(cycle%swing(1, :), &
        change(1, :), least, tiny(1.0_wp)), change(1, :) > least)])
      report%load_cycle = cycle_differs
      if (all(is_settled(change(1, :), least))) report%load_cycle = cycle_settled
      if (report%load_cycle == cycle_settled .and. cycle%settled == 0) cycle%settled = cycle%n_ends
      call move_alloc(change, cycle%change)
    end if
    call move_alloc(gain, cycle%gain)
    call begin_cycle(new, size(least), cycle)

  contains

    pure function is_settled(c, least) result(settled)
      real(wp), intent(in) :: c(:)     !! changes
      real(wp), intent(in) :: least(:) !! that are seen
      logical :: settled(size(c))
      real(wp) :: n_left

      settled = .not. c > least
      if (.not. allocated(cycle%change)) return
      n_left = ceiling(real(cycles%last - deck_increments(scene, new), wp)/cycles%length)
      associate (before => cycle%change(1, :), enough => settled_share*cycle%swing(1, :))
        settled = settled .or. (n_left*c <= enough .and. c**2 <= enough*(before - c))
      end associate
    end function is_settled

  end subroutine follow_cycle

  !> Increments of the deck that are done at a state, over the run; -1: one has begun.
  pure integer function deck_increments(scene, state) result(done)
    type(scene_t), intent(in) :: scene
    type(state_t), intent(in) :: state

    done = asked_number(state%position)
    if (done >= 0) done = done + sum(scene%steps(:state%step - 1)%n_increments)
  end function deck_increments

  !> What a cycle begins with.
  pure subroutine begin_cycle(state, n_groups, cycle)
    type(state_t), intent(in) :: state
    integer, intent(in) :: n_groups
    type(followed_cycle_t), intent(inout) :: cycle

    cycle%displacement = state%displacement
    cycle%reaction = state%reaction
    cycle%slip = state%slip
    if (.not. allocated(cycle%swing)) allocate (cycle%swing(1, n_groups))
    cycle%swing = 0.0_wp
  end subroutine begin_cycle

  pure integer function size_of(mesh, points) result(n_groups)
    type(mesh_t), intent(in) :: mesh
    type(contact_points_t), intent(in) :: points

    n_groups = mesh%n_bodies
    if (points%n > 0) n_groups = n_groups + 2*maxval(points%pair)
  end function size_of

  !> The largest length of a vector in each group.
  pure function distances(mesh, points, u, r, slip) result(largest)
    type(mesh_t), intent(in) :: mesh
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: u(:, :)    !! (3,n_nodes) [length]
    real(wp), intent(in) :: r(:, :)    !! (3,n_points) [force]
    real(wp), intent(in) :: slip(:, :) !! (2,n_points) [length]
    real(wp) :: largest(size_of(mesh, points))
    integer :: i, g, n_pairs

    largest = 0.0_wp
    do i = 1, size(u, 2)
      g = mesh%body(i)
      if (g > 0) largest(g) = max(largest(g), sum(u(:, i)**2))
    end do
    n_pairs = (size(largest) - mesh%n_bodies)/2
    do i = 1, points%n
      g = mesh%n_bodies + points%pair(i)
      largest(g) = max(largest(g), sum(r(:, i)**2))
      g = g + n_pairs
      largest(g) = max(largest(g), sum(slip(:, i)**2))
    end do
    largest = sqrt(largest)
  end function distances

  !> What the tolerance of contact is of: lengths of the largest displacement and its swing, forces
  !> of the largest force of a point, of all groups together.
  pure function scales(mesh, points, state, swing) result(scale)
    type(mesh_t), intent(in) :: mesh
    type(contact_points_t), intent(in) :: points
    type(state_t), intent(in) :: state
    real(wp), intent(in) :: swing(:) !! (n_groups)
    real(wp) :: scale(size(swing))
    real(wp) :: reach(size(swing))
    integer :: n, n_pairs

    reach = max(swing, distances(mesh, points, state%displacement, state%reaction, state%slip))
    n = mesh%n_bodies
    n_pairs = (size(swing) - n)/2
    scale = maxval([0.0_wp, reach(:n)])
    scale(n + 1:n + n_pairs) = maxval([0.0_wp, reach(n + 1:n + n_pairs)])
  end function scales

end module settled_cycles_mod
