!> The plan of a run, from its scene alone: what exists in it.
!>
!> What the run will cost is foreseen apart (estimate_costs); the table of both is plan_table's.
module make_plan_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t
  use obstacles_mod, only: ref_nodes
  use obstacle_shapes_mod, only: check_shapes
  use constraints_mod, only: active_constraints
  use scene_mod, only: scene_t
  use choices_mod, only: choices_t
  use contact_points_mod, only: contact_nodes, master_nodes
  use increments_mod, only: count_increments
  use choose_increment_mod, only: fewest_increments
  use step_fields_mod, only: fields_due
  use kinks_mod, only: most_events
  use turns_mod, only: count_cuts
  use controls_mod, only: compliance_products, solver_auto
  use plan_mod, only: plan_t, add_figure, change_figure, bound_fixed, bound_at_most, &
    bound_about
  use dof_map_mod, only: dof_map_t, make_dof_map
  use rigid_modes_mod, only: free_motions_t, find_free_motions, hold_pins
  use placement_mod, only: placement_t, place_undeformed
  use dynamic_step_mod, only: are_alike
  use node_freedom_mod, only: node_freedom_t
  use transfer_mod, only: movable, note_freedom, rows_of_points
  use condense_contact_mod, only: few_rows
  use candidate_points_mod, only: find_points, check_removed, check_areas
  use contact_interface_mod, only: find_reach, interface_dofs, reach_everything
  use initial_overlaps_mod, only: begin_interference
  use step_loads_mod, only: prescribed_dofs
  use plan_table_mod, only: describe, bound_of_increments
  implicit none
  private

  public :: make_plan, revise_plan, forget_compliance

  integer, parameter :: newton_raphson = 4
  !! iterations of an increment with the tangent of each, those of the run in coarser increments
  !! counted in: of the paper's block 3.4 to 3.9

contains

  !> Decide what the run consists of.
  subroutine make_plan(scene, choices, plan, error)
    type(scene_t), intent(in) :: scene
    type(choices_t), intent(in) :: choices !! before the plan's own
    type(plan_t), intent(out) :: plan
    type(error_t), allocatable, intent(out) :: error
    !! an obstacle of no known kind; LAPACK failed
    type(free_motions_t) :: motions
    integer :: step

    call check_shapes(scene%obstacles, error)
    if (allocated(error)) return
    plan%choices = choices
    call check_removed(scene, error)
    if (allocated(error)) return
    call find_points(scene, plan%points)
    call check_areas(scene, plan%points, error)
    if (allocated(error)) return
    call find_reach(scene, plan%points, error)
    if (allocated(error)) return
    ! How far inertia takes bodies nobody knows before, and which nodes have mass must not change.
    if (any(scene%steps%is_dynamic)) call reach_everything(scene, plan%points)
    call begin_interference(scene, plan%points)
    plan%n_increments = count_increments(scene%steps)
    plan%n_fewest = fewest_increments(scene)
    plan%n_events = count_events(scene)
    plan%n_cuts = sum([(count_cuts(scene, step), step=1, size(scene%steps))])
    plan%n_cuts = plan%n_cuts + (choices%divisions - 1)*sum(scene%steps%n_increments, &
      mask=scene%steps%is_dynamic .or. .not. scene%steps%direct)
    if (choices%precision%renews_tangent .and. scene%contact%solver /= solver_auto) then
      plan%n_tangents = newton_raphson*plan%n_increments
    end if
    plan%n_outputs = count_outputs(scene)
    if (scene%output%frequency == 1) plan%n_outputs = plan%n_outputs + plan%n_cuts
    call count_unknowns(scene, plan, motions, error)
    if (allocated(error)) return
    ! Contact alone holds them: what it does and how they bend are one question.
    if (scene%finite_strain .and. scene%contact%solver == solver_auto .and. .not. ( &
      choices%precision%tangent_is_given .or. any(scene%steps%is_dynamic))) then
      associate (renews => plan%choices%precision%renews_tangent)
        renews = renews .or. any(motions%body(:motions%n) > 0)
      end associate
    end if
    call list_figures(scene, plan)
    call describe(scene, motions, plan)
  end subroutine make_plan

  !> Count again when a run has taken other points for candidates than were planned, which costs a
  !> factorisation more.
  subroutine revise_plan(scene, plan, error)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(inout) :: plan !! its points as they are now
    type(error_t), allocatable, intent(out) :: error !! LAPACK failed
    type(free_motions_t) :: motions

    call count_unknowns(scene, plan, motions, error)
    if (allocated(error)) return
    plan%n_factorisations = plan%n_factorisations + 1
    plan%is_constant = .false.
    if (allocated(plan%figures)) deallocate (plan%figures)
    call list_figures(scene, plan)
  end subroutine revise_plan

  !> Unknowns, rows and factorisations, step by step.
  subroutine count_unknowns(scene, plan, first_motions, error)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(inout) :: plan
    type(free_motions_t), intent(out) :: first_motions !! that the supports of the first step leave
    type(error_t), allocatable, intent(out) :: error   !! LAPACK failed
    logical :: prescribed(3, scene%mesh%n_nodes), before(3, scene%mesh%n_nodes)
    type(dof_map_t) :: map
    type(free_motions_t) :: motions
    type(node_freedom_t), allocatable :: of_run !! in the *STEP that a run is in
    integer, allocatable :: blocks(:)
    integer :: step

    call move_alloc(plan%points%freedom, of_run)
    plan%rows = spread(0, 1, plan%points%n)
    plan%n_equations = 0
    plan%n_interface = 0
    plan%blocks = [integer ::]
    plan%n_factorisations = 0
    do step = 1, size(scene%steps)
      if (step > 1) before = prescribed
      prescribed = prescribed_dofs(scene, step)
      if (step > 1) then
        if (all(prescribed .eqv. before) .and. are_alike(scene, step - 1, step)) cycle
      end if
      call count_rows(scene, prescribed, plan)
      if (step > 1) then
        if (.not. any((prescribed .neqv. before) .and. spread(scene%mesh%body > 0, 1, 3)) .and. &
          are_alike(scene, step - 1, step)) cycle
      end if
      plan%n_factorisations = plan%n_factorisations + 1
      ! Inertia holds what supports leave free.
      call find_free_motions(scene%mesh, prescribed .or. scene%steps(step)%is_dynamic, &
        ref_nodes(scene%obstacles), contact_nodes(plan%points), motions, error, scene%constraints)
      if (allocated(error)) return
      if (step == 1) first_motions = motions
      map = make_dof_map(scene%mesh%body, hold_pins(motions, prescribed), &
        interface_dofs(scene, plan%points), active_constraints(scene%constraints, prescribed))
      blocks = map%body_first(2:) - map%body_first(:size(map%body_first) - 1)
      if (step > 1) plan%is_constant = plan%is_constant .and. map%n_free == plan%n_equations &
        .and. size(blocks) == size(plan%blocks)
      if (step > 1 .and. plan%is_constant) plan%is_constant = all(blocks == plan%blocks)
      if (entries_of(blocks) > entries_of(plan%blocks)) plan%blocks = blocks
      plan%n_equations = max(plan%n_equations, map%n_free)
      plan%n_interface = max(plan%n_interface, map%n_interface)
    end do
    call move_alloc(of_run, plan%points%freedom)
  end subroutine count_unknowns

  !> Entries of square blocks of these orders.
  pure real(wp) function entries_of(orders)
    integer, intent(in) :: orders(:)

    entries_of = sum(real(orders, wp)**2)
  end function entries_of

  !> Increments at most that end at kinks and first touches, beside the deck's.
  pure integer function count_events(scene)
    type(scene_t), intent(in) :: scene
    integer :: step

    count_events = 0
    do step = 1, size(scene%steps)
      count_events = count_events + most_events(scene%amplitudes, scene%steps, step, &
        size(scene%pairs) > 0)
    end do
  end function count_events

  !> The increments whose fields reach the result file.
  pure function count_outputs(scene) result(n)
    type(scene_t), intent(in) :: scene
    integer :: n, step, i

    n = 0
    do step = 1, size(scene%steps)
      do i = 1, scene%steps(step)%n_increments
        if (fields_due(scene%output%frequency, i, i == scene%steps(step)%n_increments)) n = n + 1
      end do
    end do
  end function count_outputs

  !> The rows that the points have with these supports, where that is more than before.
  !>
  !> Before a plane they are those of the undeformed mesh; before a round obstacle the frames turn,
  !> and every row is possible that some free direction can feed.
  subroutine count_rows(scene, prescribed, plan)
    type(scene_t), intent(in) :: scene
    logical, intent(in) :: prescribed(:, :) !! (3,n_nodes)
    type(plan_t), intent(inout) :: plan
    type(placement_t) :: placement
    integer :: row(3, plan%points%n), i, n
    logical :: can_move(3, scene%mesh%n_nodes), free_masters(size(scene%pairs))

    can_move = movable(scene, prescribed)
    call note_freedom(scene, prescribed, plan%points)
    associate (points => plan%points)
      free_masters = [(any(can_move(:, master_nodes(points, i))), i=1, size(scene%pairs))]
      call place_undeformed(scene, points, placement)
      call rows_of_points(can_move, points, placement%weights, placement%frame, row)
      do i = 1, points%n
        n = count(row(:, i) > 0)
        if (points%is_curved(i)) then
          if (points%in_reach(i) .and. (any(can_move(:, points%node(i))) .or. &
            free_masters(points%pair(i)))) n = merge(3, 1, points%mu(i) > 0.0_wp)
        end if
        plan%rows(i) = max(plan%rows(i), n)
      end do
    end associate
  end subroutine count_rows

  !> No compliance is formed, but for W of a few points near surfaces that move or are round.
  pure subroutine forget_compliance(plan)
    type(plan_t), intent(inout) :: plan
    integer :: n

    n = min(sum(plan%rows), few_rows)
    if (plan%choices%precision%iterative) n = 0
    if (.not. any(plan%points%is_curved)) n = 0
    call change_figure(plan, 'compliance_bytes', 0.0_wp)
    call change_figure(plan, 'contact_matrix_bytes', 8.0_wp*real(n, wp)**2)
  end subroutine forget_compliance

  !> What the run is held against.
  subroutine list_figures(scene, plan)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(inout) :: plan
    integer :: bound, of_increments

    bound = bound_at_most
    if (plan%is_constant) bound = bound_fixed
    of_increments = bound_of_increments(scene, plan)
    call add_figure(plan, 'increments', real(plan%n_fewest, wp), of_increments)
    if (.not. all(scene%steps%direct)) call add_figure(plan, 'increments_at_events', &
      real(plan%n_events, wp), bound_at_most)
    call add_figure(plan, 'increments_with_fields', real(plan%n_outputs, wp), of_increments)
    call add_figure(plan, 'equations', real(plan%n_equations, wp), bound)
    call add_figure(plan, 'interface_equations', real(plan%n_interface, wp), bound)
    call add_figure(plan, 'factorisations', real(plan%n_factorisations + plan%n_tangents, wp), &
      merge(bound_about, bound_at_most, scene%finite_strain .or. any(scene%steps%is_dynamic .and. &
      .not. scene%steps%direct)))
    call add_figure(plan, 'contact_points', real(count(plan%rows > 0), wp), bound_at_most)
    call add_figure(plan, 'contact_rows', real(sum(plan%rows), wp), bound_at_most)
    call add_figure(plan, 'compliance_bytes', 8.0_wp*entries_of(plan%blocks), bound)
    call add_figure(plan, 'contact_matrix_bytes', 8.0_wp*real(sum(plan%rows), wp)**2, &
      bound_at_most)
    if (plan%choices%compliance == compliance_products) call forget_compliance(plan)
  end subroutine list_figures

end module make_plan_mod
