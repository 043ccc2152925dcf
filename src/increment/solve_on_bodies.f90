!> The reactions of a group of contact points together with the displacement of the bodies, by
!> iteration. docs/theory.md, "Without a factor".
module solve_on_bodies_mod
  use kinds_mod, only: wp
  use controls_mod, only: contact_controls_t
  use mesh_mod, only: mesh_t
  use state_mod, only: state_t
  use increment_report_mod, only: ended_unbalanced, ended_stalled
  use problem_mod, only: contact_report_t, pack_rows
  use rigid_modes_mod, only: add_motions
  use whole_newton_mod, only: bodies_t
  use contact_in_parts_mod, only: solve_in_parts
  use floating_mod, only: floating_t
  use floating_centre_mod, only: drift_t, excusable
  use condensed_contact_mod, only: contact_group_t
  use formed_compliance_mod, only: form_floating
  use dof_map_mod, only: to_nodes, unknowns_of
  use step_solver_mod, only: step_solver_t
  use trial_mod, only: trial_t
  implicit none
  private

  public :: group_answer_t, solve_on_bodies

  integer, parameter :: most_formed = 600 !! rows of a compliance that is formed by iteration

  !> A contact problem and what answers it.
  type :: group_answer_t
    real(wp), allocatable :: x_free(:) !! (n_rows) gaps and slips without contact [length]
    real(wp), allocatable :: r(:, :)   !! (3,n_active) reactions, n, t1, t2 [force]
    real(wp), allocatable :: gaps(:)   !! (n_rows) gaps and slips with them [length]
    type(contact_report_t) :: report
  end type group_answer_t

contains

  !> The reactions of a group together with the displacement that they and what was left out of
  !> balance cause, free motions included.
  !>
  !> Where that does not converge for bodies that move freely, the compliance is formed if it is
  !> small: the search for their motions finds more, and knows when there is nothing to be found.
  !> `by_compliance` of the trial says so, and nothing is changed but the group's problem.
  subroutine solve_on_bodies(mesh, solver, old, group, controls, trial, drift, answer)
    type(mesh_t), intent(in) :: mesh
    type(step_solver_t), intent(in) :: solver
    type(state_t), intent(in) :: old
    type(contact_group_t), intent(inout) :: group
    type(contact_controls_t), intent(in) :: controls
    type(trial_t), intent(inout) :: trial         !! gets u_contact
    type(drift_t), intent(inout) :: drift         !! start of the motions in, how far they go out
    type(group_answer_t), intent(inout) :: answer !! x_free and a guess of r in, all of it out
    type(bodies_t) :: bodies
    real(wp) :: start(3, size(answer%r, 2))
    integer :: j

    start = answer%r
    associate (map => solver%body%inverse%map, motions => solver%body%motions)
      call add_motions(motions, mesh, trial%motion, trial%by_iteration%start)
      bodies%v = [unknowns_of(map, trial%by_iteration%start), &
        (trial%by_iteration%start(motions%dof(j), motions%node(j)), j=1, motions%n)]
      bodies%load = trial%by_iteration%load_left
      bodies%largest = max(maxval(norm2(trial%forces%external, dim=1)), &
        maxval(norm2(old%support_force, dim=1)))
      if (motions%n > 0) then
        bodies%motions = group%floating%g
      else
        allocate (bodies%motions(size(answer%x_free), 0))
      end if
      bodies%driven = bodies%load(map%n_free + 1:)
      call group%body%relate(bodies%v, bodies%load)
      call solve_in_parts(group%problem, group%body, answer%x_free, controls, bodies, &
        answer%r, answer%report)
      call group%body%unrelate(bodies%v, bodies%remains)
      trial%by_iteration%unsolved = bodies%remains
      call to_nodes(map, bodies%v(:map%n_free), trial%u_contact)
      answer%gaps = bodies%gaps
      if (motions%n > 0) then
        call part_motions(mesh, solver, group%floating, bodies, trial, drift)
        if (answer%report%converged()) call ask_for_balance(group, drift, answer)
        ! What nothing acts on has no stresses, not even those of rounding.
        associate (load_left => trial%by_iteration%load_left)
          if (all(abs(answer%r) <= 0.0_wp) .and. all(abs(load_left) <= 0.0_wp)) then
            trial%u_contact = 0.0_wp
          end if
        end associate
      end if
      trial%by_iteration%start = trial%u_contact
      if (motions%n == 0 .or. answer%report%converged() .or. answer%report%ending == &
        ended_unbalanced .or. size(answer%x_free) > most_formed) return
      call form_floating(group, trial%by_compliance)
      if (.not. trial%by_compliance) return
      trial%u_contact = 0.0_wp
      trial%applied_reaction = 0.0_wp
      trial%applied_force = 0.0_wp
      answer%r = start
      deallocate (drift%turned)
      drift%a = trial%motion
    end associate
  end subroutine solve_on_bodies

  !> Reactions that grow without bound do not make their own balance small: what a load does along a
  !> motion is to be balanced, whatever else presses.
  subroutine ask_for_balance(group, drift, answer)
    type(contact_group_t), intent(in) :: group
    type(drift_t), intent(in) :: drift
    type(group_answer_t), intent(inout) :: answer
    real(wp) :: packed(size(answer%x_free)), small(size(drift%load))

    packed = pack_rows(group%problem, answer%r)
    small = max(excusable*abs(drift%load), drift%rounding, 1.0e-14_wp*sum(abs(packed)))
    if (all(abs(matmul(packed, group%floating%g) + drift%load) <= small .or. abs(drift%load) <= &
      drift%rounding)) return
    answer%report%ending = ended_stalled
  end subroutine ask_for_balance

  !> Free motions apart from the displacement with the pins held; those that contact cannot see
  !> stay where they were.
  subroutine part_motions(mesh, solver, floating, bodies, trial, drift)
    type(mesh_t), intent(in) :: mesh
    type(step_solver_t), intent(in) :: solver
    type(floating_t), intent(in) :: floating
    type(bodies_t), intent(in) :: bodies
    type(trial_t), intent(inout) :: trial         !! u_contact loses them
    type(drift_t), intent(inout) :: drift
    integer :: j

    associate (motions => solver%body%motions, &
               a => bodies%v(solver%body%inverse%map%n_free + 1:))
      do j = 1, motions%n
        trial%u_contact(motions%dof(j), motions%node(j)) = a(j)
      end do
      call add_motions(motions, mesh, -a, trial%u_contact)
      drift%a = a + matmul(floating%neutral, matmul(drift%a - a, floating%neutral))
    end associate
    allocate (drift%turned(0))
    drift%unbalanced = bodies%unbalanced
  end subroutine part_motions

end module solve_on_bodies_mod
