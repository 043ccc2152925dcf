!> Where free motions come to rest that contact does not hold: neutral ones by turned normals, those
!> that nothing which presses sees where their bodies were.
module motions_at_rest_mod
  use kinds_mod, only: wp
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t
  use rigid_modes_mod, only: add_motions
  use way_to_rest_mod, only: way_to_rest
  use transfer_mod, only: gap_at
  use condensed_contact_mod, only: contact_group_t, neutral_motions, unpressed_motions
  use step_solver_mod, only: step_solver_t
  use neutral_motions_mod, only: neutral_step, unturned_motions
  use trial_mod, only: trial_t
  use place_and_solve_mod, only: newton_raphson_t
  use displace_mod, only: settle
  implicit none
  private

  public :: is_turned, lead, rest

  real(wp), parameter :: closely = 100.0_wp
  !! times the tolerance: points that move by no more may be where rounding takes them [-]

contains

  !> Whether turned normals leave forces along neutral motions, beside the largest reaction.
  pure logical function is_turned(trial, reaction, allowed)
    type(trial_t), intent(in) :: trial
    real(wp), intent(in) :: reaction(:, :) !! (3,n_points) [force]
    real(wp), intent(in) :: allowed        !! [-]

    is_turned = .false.
    if (size(trial%motion) > 0) is_turned = any(abs(trial%neutral_residual) > &
      allowed*maxval(abs(reaction)))
  end function is_turned

  !> Take in what turned normals leave along neutral motions.
  subroutine lead(scene, points, solver, trial, new, loop)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    type(trial_t), intent(inout) :: trial  !! gets the way along them
    type(state_t), intent(inout) :: new    !! likewise
    type(newton_raphson_t), intent(inout) :: loop
    logical :: is_led

    loop%idle = merge(loop%idle + 1, 0, loop%moved > 0.9_wp*loop%least_moved .and. &
      loop%moved <= closely*trial%tolerance)
    loop%last_moved = loop%moved
    loop%least_moved = min(loop%least_moved, loop%moved)
    is_led = is_turned(trial, new%reaction, trial%tolerance)
    ! What a placement that still moves leaves on them says nothing.
    if (size(loop%follow%node) > 0) is_led = is_led .and. is_turned(trial, new%reaction, loop%moved)
    if (.not. is_led) return
    call neutral_step(scene, points, solver%body%motions, neutral_motions(solver%contact, &
      solver%body%motions%n), trial%placement, new, trial%neutral_residual, loop%last_led)
    associate (step => loop%last_led%step)
      loop%led = loop%led + step
      trial%motion = trial%motion + step
      call add_motions(solver%body%motions, scene%mesh, step, new%displacement)
    end associate
  end subroutine lead

  !> Let motions that nothing which presses sees go where their bodies were when the increment
  !> began, but for what turned normals led them; neutral ones alone where others would close a gap,
  !> and where nothing presses as far as to where the first gap closes.
  !> Before round obstacles alone these are restricted to motions that turn no normal at a pressing
  !> point: turned normals decide where the others come to rest.
  subroutine rest(scene, points, solver, old, loop, trial, new)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    type(state_t), intent(in) :: old
    type(newton_raphson_t), intent(in) :: loop
    type(trial_t), intent(inout) :: trial !! gets its motion
    type(state_t), intent(inout) :: new   !! gets displacement
    real(wp) :: moved(3, scene%mesh%n_nodes), way(size(loop%led))
    integer :: i

    associate (motions => solver%body%motions)
      if (motions%n == 0) return
      moved = new%displacement - old%displacement
      call add_motions(motions, scene%mesh, -loop%led, moved)
      way = 0.0_wp
      do i = 1, size(solver%contact%group)
        if (size(solver%contact%group(i)%motion) > 0) call rest_group(solver%contact%group(i))
      end do
      if (all(abs(way) <= 0.0_wp)) return
      trial%motion = trial%motion + way
      call add_motions(motions, scene%mesh, way, new%displacement)
      call settle(scene, motions, trial, new%displacement)
    end associate

  contains

    subroutine rest_group(group)
      type(contact_group_t), intent(in) :: group
      real(wp), allocatable :: unpressed(:, :), neutral(:, :)
      real(wp) :: part

      allocate (unpressed(0, 0), neutral(0, 0))
      associate (motions => solver%body%motions, list => group%motion)
        unpressed = unpressed_motions(group, new%reaction)
        neutral = group%floating%neutral
        if (size(loop%follow%node) == 0 .and. any(points%is_curved)) then
          unpressed = unturned_motions(scene, points, motions, list, unpressed, trial%placement, &
            new)
          neutral = unturned_motions(scene, points, motions, list, neutral, trial%placement, new)
        end if
        if (size(unpressed, 2) == 0) return
        way(list) = way_to_rest(scene%mesh, motions, list, unpressed, moved)
        if (size(unpressed, 2) == size(neutral, 2)) return
        part = part_of_way(group, way(list))
        if (.not. part < 1.0_wp) return
        if (size(unpressed, 2) == size(list)) then
          way(list) = part*way(list)
        else
          way(list) = way_to_rest(scene%mesh, motions, list, neutral, moved)
        end if
      end associate
    end subroutine rest_group

    !> How much of a way the motions can go until a gap closes, 1 if they can go all of it.
    pure real(wp) function part_of_way(group, way) result(part)
      type(contact_group_t), intent(in) :: group
      real(wp), intent(in) :: way(:) !! of the group's motions [length]
      real(wp) :: change, gap
      integer :: k

      part = 1.0_wp
      do k = 1, size(group%active)
        if (group%problem%row(1, k) == 0) cycle
        change = dot_product(group%floating%g(group%problem%row(1, k), :), way)
        if (.not. change < 0.0_wp) cycle
        gap = gap_at(trial%placement, points, group%active(k), new%displacement)
        if (gap + change < 0.0_wp) part = min(part, max(0.0_wp, -gap/change))
      end do
    end function part_of_way

  end subroutine rest

end module motions_at_rest_mod
