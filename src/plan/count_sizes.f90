!> What the costs of a run are made of: sizes of the scene and of its equations, and how often what
!> is done with them.
module count_sizes_mod
  use kinds_mod, only: wp
  use cells_mod, only: cells, has_middles
  use obstacle_shapes_mod, only: is_before_faces
  use scene_mod, only: scene_t
  use step_contact_mod, only: most_friction
  use controls_mod, only: solver_sweeps
  use plan_mod, only: plan_t
  use look_ahead_mod, only: most_ahead
  use shadow_run_mod, only: count_shadows, laws_at_finite_strain
  implicit none
  private

  public :: sizes_t, count_sizes, iterations_of_increment, &
    solutions_of_increment, products_of_increment, newton_of_increment, solutions, &
    solutions_of_product, flops_of_run

  ! Typical counts of an increment (docs/studies/solvers.md).
  real(wp), parameter :: products_with_friction = 30.0_wp !! of W with a vector, by global Newton
  real(wp), parameter :: products_without = 10.0_wp
  real(wp), parameter :: solves_for_motions = 3.0_wp      !! contact problems where bodies are free
  real(wp), parameter :: motions_of_problem = 6.0_wp
  !! whose answers, how reactions follow them, take as many products as a contact problem: where W
  !! is not formed they are not factorised
  real(wp), parameter :: newton_raphson_curved = 3.0_wp   !! before round obstacles
  real(wp), parameter :: equilibria_curved = 1.6_wp
  !! of them, in which forces are to balance too where W is formed: points settle before that
  real(wp), parameter :: equilibria_finite = 16.0_wp
  !! of an increment at finite strain, those among them by which its errors are estimated
  real(wp), parameter :: newton_of_curved = 25.0_wp
  !! of an increment with friction before what is curved, with its estimate of errors: Jacobians of
  !! contact that are factorised
  real(wp), parameter :: newton_raphson_refined = 2.0_wp
  !! times as many where the factor is not exact
  real(wp), parameter :: roughest_unrefined = 1.0e-4_wp
  !! tolerance from which on forces balance well enough by a factor that is not exact [-]
  real(wp), parameter :: refinements = 4.0_wp             !! of a load's response, then
  real(wp), parameter :: solutions_beside = 6.0_wp !! of a factor without W: the condition
  real(wp), parameter :: sweeps_a_digit = 1.3_wp          !! and a point along the surface's side

  !> Sizes that costs are made of.
  type :: sizes_t
    real(wp) :: nodes, elements, equations, interface, rows, points, entries, factor
    real(wp) :: element_work !! that internal forces are, in those of hexahedra of first order
    real(wp) :: squares, cubes   !! sums over the blocks of the compliance, one a body
    real(wp) :: pairs = 0.0_wp
    real(wp) :: front, workspace, flops
    real(wp) :: increments, outputs, steps, factorisations, motions
    real(wp) :: written = 0.0_wp !! increments, if they do not grow
    real(wp) :: shadows = 0.0_wp !! runs at finite strain beside this one
    real(wp) :: laws = 1.0_wp    !! that finite strain may have: as many runs it would take
    real(wp) :: neighbours
    real(wp) :: columns = 0.0_wp !! increments that are recovered at once, 0: one by one
    real(wp) :: most_columns = 0.0_wp !! the same with an exact factor
    real(wp) :: ranks = 1.0_wp !! on this machine
    real(wp) :: fraction_here = 1.0_wp !! of all ranks, that run on this machine
    real(wp) :: word = 8.0_wp !! of the factor, a number [bytes]
    real(wp) :: scratch = 0.0_wp !! of the factor, on the disk [bytes]
    logical :: has_twins = .false. !! nodes may be pressed by more obstacles than they can move
    logical :: is_dense = .true. !! W is formed; else its products are solutions with the factor
    real(wp) :: tolerance = 0.0_wp !! of contact [-]
    real(wp) :: ordering = 0.0_wp  !! time that the plan took to order the equations [s]
    logical :: has_friction = .false., is_finite = .false. !! strain
    logical :: has_middles = .false. !! of faces: of second order
    logical :: is_curved = .false., follows_faces = .false. !! there are points that turn, so before
    logical :: by_sweeps = .false.
    logical :: is_exact = .true., by_iteration = .false. !! as of precision_controls_t
    logical :: keeps_scratch = .false. !! the system has memory for it beside the run
  end type sizes_t

contains

  !> Sizes that the scene tells; of those of the elimination the least they can be. What depends on
  !> the arithmetic is left to whoever chooses that.
  subroutine count_sizes(scene, plan, sizes)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(sizes_t), intent(inout) :: sizes !! its ranks are known
    integer :: i

    sizes%nodes = scene%mesh%n_nodes
    sizes%elements = scene%mesh%n_elements
    sizes%element_work = work_of_elements(scene)
    sizes%is_finite = scene%finite_strain
    sizes%equations = plan%n_equations
    sizes%interface = plan%n_interface
    sizes%squares = sum(real(plan%blocks, wp)**2)
    sizes%cubes = sum(real(plan%blocks, wp)**3)
    sizes%rows = sum(real(plan%rows, wp))
    sizes%points = plan%points%n
    sizes%pairs = size(scene%pairs)
    sizes%has_twins = has_twins(plan)
    ! A node of a large mesh of hexahedra has 27 neighbours, half of them in one triangle.
    sizes%neighbours = 27.0_wp*sizes%nodes
    sizes%entries = 40.0_wp*sizes%equations
    sizes%factor = sizes%entries
    sizes%front = 0.0_wp
    sizes%flops = 0.0_wp
    sizes%increments = plan%n_fewest + plan%n_cuts
    sizes%written = plan%n_increments + plan%n_cuts
    sizes%outputs = plan%n_outputs
    sizes%steps = size(scene%steps)
    sizes%shadows = count_shadows(scene)
    sizes%laws = size(laws_at_finite_strain(scene%materials), 2)
    sizes%most_columns = min(most_ahead, maxval(scene%steps%n_increments))
    if (plan%n_interface == 0) sizes%most_columns = 0.0_wp
    do i = 1, size(scene%pairs)
      associate (first => plan%points%first(i), last => plan%points%first(i + 1) - 1)
        if (.not. any(plan%points%is_curved(first:last))) cycle
      end associate
      sizes%is_curved = .true.
      sizes%most_columns = 0.0_wp
      if (is_before_faces(scene%pairs(i), scene%obstacles)) sizes%follows_faces = .true.
    end do
    sizes%has_middles = any(has_middles(scene%mesh%connectivity%cell))
    sizes%has_friction = any(most_friction(scene) > 0.0_wp)
    sizes%by_sweeps = scene%contact%solver == solver_sweeps
    sizes%factorisations = plan%n_factorisations + plan%n_tangents
    sizes%motions = 0.0_wp
    sizes%tolerance = plan%choices%tolerance
  end subroutine count_sizes

  !> What internal forces of all elements are, in those of hexahedra of first order at small strain:
  !> products of points and nodes, and at finite strain twice as much.
  pure real(wp) function work_of_elements(scene) result(work)
    type(scene_t), intent(in) :: scene
    real(wp), parameter :: of_finite = 2.0_wp
    integer :: e

    work = 0.0_wp
    do e = 1, scene%mesh%n_elements
      associate (cell => cells(scene%mesh%connectivity%cell(e)))
        work = work + merge(real(cell%n_points*cell%n_nodes, wp)/64.0_wp, 1.0_wp, &
          has_middles(scene%mesh%connectivity%cell(e)))
      end associate
    end do
    if (scene%finite_strain) work = of_finite*work
  end function work_of_elements

  !> Whether points before obstacles give a node more rows than it has ways to move.
  pure logical function has_twins(plan)
    type(plan_t), intent(in) :: plan
    integer :: i, of_node(maxval([0, plan%points%node]))

    of_node = 0
    do i = 1, plan%points%n
      if (plan%points%on_surface(i)) cycle
      associate (n => of_node(plan%points%node(i)))
        n = n + plan%rows(i)
      end associate
    end do
    has_twins = any(of_node > 3)
  end function has_twins

  !> Newton-Raphson iterations of an increment, each with a contact problem.
  pure real(wp) function iterations_of_increment(sizes) result(n)
    type(sizes_t), intent(in) :: sizes

    n = refined_times(sizes)*merge(newton_raphson_curved, 1.0_wp, sizes%is_curved)
  end function iterations_of_increment

  !> Those of them with a solution, and with the forces of all elements: contact alone settles the
  !> points where W is formed.
  pure real(wp) function solutions_of_increment(sizes) result(n)
    type(sizes_t), intent(in) :: sizes

    n = iterations_of_increment(sizes)
    if (sizes%is_dense .and. sizes%is_curved) n = refined_times(sizes)*equilibria_curved
    if (sizes%is_finite) n = equilibria_finite
  end function solutions_of_increment

  !> How many times as many iterations the arithmetic of the factor takes.
  pure real(wp) function refined_times(sizes) result(times)
    type(sizes_t), intent(in) :: sizes

    times = newton_raphson_refined
    if (sizes%is_exact .or. sizes%tolerance >= roughest_unrefined) times = 1.0_wp
  end function refined_times

  !> Products of W with a vector in an increment; a sweep is one.
  pure real(wp) function products_of_increment(sizes) result(n)
    type(sizes_t), intent(in) :: sizes

    n = products_without
    if (sizes%has_friction) n = products_with_friction
    if (sizes%by_sweeps) n = -sweeps_a_digit*sqrt(sizes%points)* &
      log10(sizes%tolerance)
    if (sizes%motions > 0.0_wp) n = n*solves_for_motions
    if (.not. sizes%is_dense) n = n*(1.0_wp + sizes%motions/motions_of_problem)
    n = n*iterations_of_increment(sizes)
    if (sizes%rows <= 0.0_wp) n = 0.0_wp
  end function products_of_increment

  !> Operations on Jacobians of contact in an increment: before what is curved each iteration has
  !> another matrix W, and products do not pay.
  pure real(wp) function newton_of_increment(sizes) result(flops)
    type(sizes_t), intent(in) :: sizes

    flops = 0.0_wp
    if (sizes%is_dense .and. sizes%is_curved .and. sizes%has_friction) flops = &
      newton_of_curved*2.0_wp/3.0_wp*sizes%rows**3
  end function newton_of_increment

  !> Solutions with the factor in the whole run: two load patterns a step, and those of increments.
  pure real(wp) function solutions(sizes) result(n)
    type(sizes_t), intent(in) :: sizes

    n = 2.0_wp*sizes%steps + sizes%increments*solutions_of_increment(sizes)
    if (.not. sizes%is_dense) n = n + sizes%increments*products_of_increment(sizes)* &
      solutions_of_product(sizes) + sizes%factorisations*solutions_beside
    if (.not. sizes%is_exact) n = n + 2.0_wp*refinements*sizes%steps
  end function solutions

  !> Elimination, inverse of the Schur complement, solutions, products with W.
  pure real(wp) function flops_of_run(sizes) result(flops)
    type(sizes_t), intent(in) :: sizes

    if (.not. sizes%is_dense) then
      flops = sizes%factorisations*sizes%flops + solutions(sizes)*4.0_wp*sizes%factor
      return
    end if
    flops = sizes%factorisations*(sizes%flops + sizes%cubes) + &
      solutions(sizes)*(4.0_wp*sizes%factor + 2.0_wp*sizes%squares) + &
      2.0_wp*sizes%increments*products_of_increment(sizes)*sizes%rows**2
  end function flops_of_run

  !> Solutions that a product with the compliance takes where W is not formed: most are for
  !> directions and need no refinement.
  pure real(wp) function solutions_of_product(sizes) result(n)
    type(sizes_t), intent(in) :: sizes
    real(wp), parameter :: refined = 1.6_wp

    n = 1.0_wp
    if (.not. sizes%is_exact) n = refined
  end function solutions_of_product

end module count_sizes_mod
