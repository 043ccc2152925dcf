!> Several increments at once, as far as their contact goes, and one solution with the factor for
!> all of them.
!>
!> Where obstacles are flat and the factor is exact, the next increment needs of the one before only
!> its reactions and what its interface does, and both come from the contact problem. So contact is
!> solved some increments ahead, and what the interiors do follows from one solution with as many
!> right-hand sides, which costs little more than one. Then `advance` goes on with each of them in
!> turn: internal forces, certificate, energies. Where it corrects one, those after it are forgotten
!> and done anew.
!>
!> Every increment of a *STEP has a column of its own among the right-hand sides, whose number the
!> step alone decides; so how far one looks ahead changes no bit of a result. How far that is
!> follows from the work that is counted, not from a clock, and a continued run ends where the first
!> session would have: on any machine, under any load, the same is computed.
module look_ahead_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t
  use system_mod, only: wall_seconds
  use scene_mod, only: scene_t
  use controls_mod, only: is_exact, solver_global_newton
  use contact_points_mod, only: contact_points_t
  use bodies_mod, only: is_linear
  use increments_mod, only: increment_t, next_increment, mark_end
  use number_list_mod, only: number_list_t, archive
  use interference_mod, only: has_interference
  use closed_points_mod, only: may_stay_closed
  use state_mod, only: state_t
  use increment_report_mod, only: increment_report_t, has_converged
  use transfer_mod, only: nodal_forces
  use stiffness_inverse_mod, only: answer_of_interface, at_interface, recover_columns, at_nodes
  use condensed_contact_mod, only: count_rows, neutral_motions, unpressed_motions
  use step_solver_mod, only: step_solver_t
  use trial_mod, only: goal_t, trial_t, begin_trial, displacement_of, expected_reactions, trend_of
  use friction_by_rate_mod, only: depends_on_rate
  use solve_reactions_mod, only: solve_reactions
  implicit none
  private

  public :: most_ahead, ahead_t, can_look_ahead, is_ahead, look_ahead, take_foreseen, &
    forget_ahead, &
    carry_ahead, step_on_interface

  integer,  parameter :: most_ahead = 16          !! increments
  real(wp), parameter :: most_work = 1.0e10_wp
  !! that a crash may lose: a few seconds of products with a vector [operations]

  !> An increment whose contact is solved.
  type :: foreseen_t
    real(wp), allocatable :: reaction(:, :)  !! (3,n_points) x, y, z [force]
    real(wp), allocatable :: motion(:), neutral_residual(:) !! as of trial_t
    type(increment_report_t) :: report            !! what the contact solver said
  end type foreseen_t

  !> The increments that lie ahead.
  type :: ahead_t
    private
    integer :: first = 1                     !! row within the run of the first of them
    integer :: n = 0                         !! how many there are
    integer :: reach = most_ahead            !! how many to look for
    integer :: found = 0                     !! how many there were when they were looked for
    integer :: last = 0                      !! row of the last of those
    type(foreseen_t) :: of(most_ahead)
    real(wp), allocatable :: columns(:, :)
    !! (n_free,columns) what their reactions do to the body [length]
  end type ahead_t

contains

  !> Whether the interface is all that an increment needs of the one before. Where a body stays that
  !> contact leaves free is a matter of all of its nodes.
  pure logical function can_look_ahead(scene, points, solver)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver

    can_look_ahead = is_linear(scene) .and. is_exact(solver%choices%precision) .and. .not. &
      (has_interference(scene) .or. may_stay_closed(scene) .or. any(points%is_curved) .or. &
      depends_on_rate(points)) .and. &
      solver%body%inverse%map%n_interface > 0 .and. solver%body%inverse%is_condensed .and. &
      size(neutral_motions(solver%contact, solver%body%motions%n), 2) == 0 .and. .not. &
      allocated(solver%body%inertia)
  end function can_look_ahead

  !> Whether an increment of the run is among those that were foreseen.
  pure logical function is_ahead(ahead, increment)
    type(ahead_t), intent(in) :: ahead
    type(increment_t), intent(in) :: increment

    is_ahead = increment%index >= ahead%first .and. increment%index < ahead%first + ahead%n
  end function is_ahead

  !> Solve the contact of the increments that follow `old`, to the end of their *STEP, as many and
  !> for as long as allowed.
  subroutine look_ahead(scene, points, solver, old, ahead, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(inout) :: solver
    type(state_t), intent(in) :: old
    type(ahead_t), intent(inout) :: ahead
    type(error_t), allocatable, intent(out) :: error !! MUMPS failed
    type(state_t) :: there !! an increment on; its displacement is right on the interface alone
    type(increment_t) :: increment
    type(trial_t) :: trial
    real(wp), allocatable :: answers(:, :) !! (n_interface,columns) [length]
    real(wp) :: work, began
    integer :: n_columns, column
    logical :: goes_on

    increment = next_increment(scene%steps, old)
    if (is_ahead(ahead, increment)) return
    ! What an earlier session had begun is ended where it would have ended it.
    goes_on = ahead%last >= increment%index
    ! All that was asked for last time was of use: more.
    if (.not. goes_on .and. ahead%found == ahead%reach) ahead%reach = min(most_ahead, &
      2*ahead%reach)
    n_columns = min(most_ahead, scene%steps(increment%step)%n_increments)
    allocate (answers(solver%body%inverse%map%n_interface, n_columns), source=0.0_wp)
    there = old
    ahead%first = increment%index
    ahead%n = 0
    work = 0.0_wp
    increments: do while (ahead%n < ahead%reach)
      increment = next_increment(scene%steps, there)
      if (increment%index == 0 .or. (ahead%n > 0 .and. increment%first_of_step)) exit increments
      began = wall_seconds()
      ahead%n = ahead%n + 1
      column = column_of(increment, n_columns)
      associate (foreseen => ahead%of(ahead%n), answer => answers(:, column))
        call begin_trial(scene, points, solver, there, goal_t(increment, solver%choices%tolerance, &
          shows_progress=solver%choices%shows_progress), trial)
        foreseen%reaction = expected_reactions(scene, points, solver, there, increment)
        call step_on_interface(scene, points, solver, trial, there, foreseen%reaction, &
          foreseen%report, answer)
        foreseen%motion = trial%motion
        if (allocated(trial%neutral_residual)) foreseen%neutral_residual = trial%neutral_residual
        foreseen%report%wall_time = wall_seconds() - began
        if (.not. has_converged(foreseen%report)) exit increments
        if (leaves_free(foreseen%reaction)) exit increments
      end associate
      if (goes_on .and. increment%index == ahead%last) exit increments
      work = work + work_of(ahead%of(ahead%n)%report, count_rows(solver%contact))
      if (.not. goes_on .and. work > most_work) exit increments
    end do increments
    if (.not. goes_on) then
      ahead%found = ahead%n
      ahead%last = ahead%first + ahead%n - 1
    end if

    began = wall_seconds()
    if (allocated(ahead%columns)) deallocate (ahead%columns)
    allocate (ahead%columns(solver%body%inverse%map%n_free, n_columns), source=0.0_wp)
    if (any(abs(answers) > 0.0_wp)) then
      call recover_columns(solver%body%inverse, answers, ahead%columns, error)
    end if
    do column = 1, ahead%n
      associate (time => ahead%of(column)%report%wall_time)
        time = time + (wall_seconds() - began)/real(ahead%n, wp)
      end associate
    end do

  contains

    !> Whether motions are left that no point which presses sees: where these end what comes next
    !> begins.
    logical function leaves_free(reaction)
      real(wp), intent(in) :: reaction(:, :) !! (3,n_points) [force]
      integer :: i

      leaves_free = .false.
      do i = 1, size(solver%contact%group)
        if (leaves_free .or. size(solver%contact%group(i)%motion) == 0) cycle
        leaves_free = size(unpressed_motions(solver%contact%group(i), reaction), 2) > 0
      end do
    end function leaves_free

  end subroutine look_ahead

  !> One increment as far as the interface goes: its reactions and what they do there.
  subroutine step_on_interface(scene, points, solver, trial, state, reaction, report, answer)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(inout) :: solver
    type(trial_t), intent(inout) :: trial     !! of begin_trial
    type(state_t), intent(inout) :: state
    !! its beginning, then its end; of the displacement what contact sees, the rest is wrong
    real(wp), intent(inout) :: reaction(:, :) !! (3,n_points) to start from; its own [force]
    type(increment_report_t), intent(out) :: report
    real(wp), intent(out) :: answer(:)        !! (n_interface) to the reactions [length]

    call solve_reactions(scene, points, solver, state, trial%tolerance, trial, reaction, report)
    answer = answer_of_interface(solver%body%inverse, nodal_forces(points, &
      trial%placement%weights, reaction, scene%mesh%n_nodes))
    state%displacement = displacement_of(scene, solver, trial, at_interface(solver%body%inverse, &
      answer, scene%mesh%n_nodes))
    state%trend = trend_of(trial%goal%increment, state%reaction, reaction)
    state%reaction = reaction
    state%rotation = trial%rotation
    if (allocated(trial%placement%weights%alone)) state%alone = trial%placement%weights%alone
    call mark_end(trial%goal%increment, state)
  end subroutine step_on_interface

  !> The column of an increment: those of a *STEP take turns.
  pure integer function column_of(increment, n_columns)
    type(increment_t), intent(in) :: increment
    integer, intent(in) :: n_columns

    column_of = 1 + mod(increment%number - 1, n_columns)
  end function column_of

  !> Begin an increment with what was foreseen of it.
  subroutine take_foreseen(points, ahead, increment, solver, trial, reaction, report)
    type(contact_points_t), intent(in) :: points
    type(ahead_t), intent(in) :: ahead
    type(increment_t), intent(in) :: increment  !! one that is ahead
    type(step_solver_t), intent(in) :: solver
    type(trial_t), intent(inout) :: trial
    real(wp), intent(out) :: reaction(:, :)     !! (3,n_points) x, y, z [force]
    type(increment_report_t), intent(out) :: report

    associate (foreseen => ahead%of(increment%index - ahead%first + 1))
      reaction = foreseen%reaction
      report = foreseen%report
      trial%applied_reaction = foreseen%reaction
      trial%applied_force = nodal_forces(points, trial%placement%weights, foreseen%reaction, &
        size(trial%u_free, 2))
      trial%motion = foreseen%motion
      if (allocated(foreseen%neutral_residual)) trial%neutral_residual = foreseen%neutral_residual
      trial%u_contact = at_nodes(solver%body%inverse, &
        ahead%columns(:, column_of(increment, size(ahead%columns, 2))), size(trial%u_free, 2))
      trial%is_foreseen = .true.
    end associate
  end subroutine take_foreseen

  !> What the contact of an increment took [operations].
  pure real(wp) function work_of(report, n_rows)
    type(increment_report_t), intent(in) :: report
    integer, intent(in) :: n_rows
    integer, parameter :: most_dense = 1000 !! rows of a dense system, of global_newton
    real(wp), parameter :: of_local = 500.0_wp, gain = 10.0_wp !! of work on blocks over vectors

    work_of = 2.0_wp*report%compliance_products*real(n_rows, wp)**2 + &
      of_local*report%local_iterations
    if (report%solver == solver_global_newton) work_of = work_of + &
      report%contact_iterations*real(min(n_rows, most_dense), wp)**3/gain
  end function work_of

  !> Forget what lies ahead, and look less far the next time.
  pure subroutine forget_ahead(ahead)
    type(ahead_t), intent(inout) :: ahead

    ahead%n = 0
    ahead%found = 0
    ahead%last = 0
    ahead%reach = 1
  end subroutine forget_ahead

  !> Put how far one looks ahead into the list, or take it out; what was foreseen is found again.
  subroutine carry_ahead(list, ahead)
    type(number_list_t), intent(inout) :: list
    type(ahead_t), intent(inout) :: ahead

    call archive(list, ahead%reach)
    call archive(list, ahead%found)
    call archive(list, ahead%last)
  end subroutine carry_ahead

end module look_ahead_mod
