!> What a run will cost: memory, operations, time, file.
!>
!> Sizes come from the scene and from the symbolic analysis of the stiffness: ordering and
!> elimination without a number. Each cost is a sum over the arrays and loops of the run, named
!> below; the few constants are measured once and documented in docs/plan.md.
module estimate_costs_mod
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t
  use text_mod, only: to_text
  use system_mod, only: cpu_seconds
  use machine_room_mod, only: resident_bytes, memory_left, disk_left
  use parallel_mod, only: n_ranks, usage_t, usage_of_others
  use machine_speed_mod, only: machine_speed_t, measure_speed
  use mesh_mod, only: node_neighbours
  use obstacles_mod, only: is_flat, ref_nodes
  use scene_mod, only: scene_t
  use controls_mod, only: solver_sweeps, is_exact, precision_controls_t
  use plan_mod, only: plan_t, add_figure, bound_fixed, bound_at_most, bound_about
  use brick8_mod, only: lame_constants
  use elements_mod, only: stiffness, nodal_force
  use dof_map_mod, only: dof_map_t, make_dof_map
  use assembly_mod, only: triplets_t
  use shares_mod, only: list_shares
  use ordering_mod, only: order_equations
  use sparse_factor_mod, only: sparse_factor_t, analyse
  use rigid_modes_mod, only: free_motions_t, find_free_motions, hold_pins
  use contact_interface_mod, only: interface_dofs
  use step_loads_mod, only: prescribed_dofs
  use look_ahead_mod, only: most_ahead
  use alternatives_mod, only: alternatives, where_in_words
  use plan_table_mod, only: add_line, describe_choice, bytes_in_words, time_in_words
  implicit none
  private

  public :: estimate_costs

  ! Memory that no array of the run explains [bytes]: pages of the libraries' code that are first
  ! touched by a solution and by writing, HDF5's own tables, the heap's unused parts.
  real(wp), parameter :: libraries = 15.0e6_wp
  ! What must be left whenever a library is called (machine_room's check) [bytes].
  real(wp), parameter :: granted = 32.0e6_wp
  real(wp), parameter :: chunk_cache = 65536.0_wp !! of HDF5, a dataset at most [bytes]

  ! The file [bytes]: what a dataset that grows takes empty, and the share of its numbers that is
  ! left where HDF5 squeezes them.
  real(wp), parameter :: growing_dataset = 41000.0_wp
  real(wp), parameter :: squeezed = 0.8_wp
  integer, parameter :: history_datasets = 32, datasets_of_a_pair = 8

  ! Passes over the factor, in memory, while it is made: fronts are cleared, assembled, eliminated
  ! panel by panel, and copied.
  real(wp), parameter :: passes_to_factorise = 50.0_wp
  real(wp), parameter :: cached = 24.0e6_wp       !! that caches may hold [bytes]
  real(wp), parameter :: passes_to_solve = 2.5_wp !! forward, backward, and the vectors
  real(wp), parameter :: passes_ahead = 1.0_wp    !! backward alone, many columns at once
  ! Of a factor that is written and read: from the disk, and where the system keeps it in memory
  ! that nobody needs [bytes/s].
  real(wp), parameter :: disk_rate = 0.5e9_wp, kept_rate = 2.0e9_wp

  ! Typical counts of an increment (docs/solvers.md).
  real(wp), parameter :: products_with_friction = 30.0_wp !! of W with a vector, by global Newton
  real(wp), parameter :: products_without = 10.0_wp
  real(wp), parameter :: solves_for_motions = 3.0_wp      !! contact problems where bodies are free
  real(wp), parameter :: newton_raphson_curved = 3.0_wp   !! before round obstacles
  real(wp), parameter :: newton_raphson_refined = 2.0_wp  !! where the factor is not exact
  real(wp), parameter :: refinements = 4.0_wp             !! of a load's response, then
  real(wp), parameter :: sweeps_a_digit = 1.3_wp          !! and a point along the surface's side

  ! Seconds on a machine that makes a brick's internal force in 1e-6 s [s].
  real(wp), parameter :: reference_brick = 1.0e-6_wp
  real(wp), parameter :: start_of_run = 0.01_wp      !! opening the file, loading code
  real(wp), parameter :: start_of_increment = 0.25e-3_wp
  real(wp), parameter :: write_of_increment = 0.7e-3_wp !! some 50 small datasets, two flushes
  real(wp), parameter :: squeeze_rate = 60.0e6_wp    !! of numbers that vary [bytes/s]
  real(wp), parameter :: squeeze_zeros = 400.0e6_wp  !! of zeros [bytes/s]
  real(wp), parameter :: visit_of_sweep = 0.5_wp     !! of a point, in internal forces of a brick

  ! Of the memory that is left, what a plan with an alternative may take: estimates are that good.
  real(wp), parameter :: enough = 0.9_wp

  !> Sizes that costs are made of.
  type :: sizes_t
    real(wp) :: nodes, bricks, equations, interface, rows, points, entries, factor
    real(wp) :: front, workspace, flops
    real(wp) :: increments, outputs, steps, factorisations, motions
    real(wp) :: neighbours
    real(wp) :: columns = 0.0_wp !! increments that are recovered at once, 0: one by one
    real(wp) :: most_columns = 0.0_wp !! the same with an exact factor
    real(wp) :: ranks = 1.0_wp !! on this machine
    real(wp) :: share = 1.0_wp !! of all ranks
    real(wp) :: word = 8.0_wp !! of the factor, a number [bytes]
    real(wp) :: copy = 0.0_wp !! of W in single precision, a number [bytes]
    real(wp) :: scratch = 0.0_wp !! of the factor, on the disk [bytes]
    real(wp) :: scratch_rate = disk_rate !! [bytes/s]
  end type sizes_t

  !> What the result file takes [bytes].
  type :: file_t
    real(wp) :: size = 0.0_wp
    real(wp) :: most = 0.0_wp
    real(wp) :: fields = 0.0_wp   !! of its size
    integer  :: datasets = 0      !! that grow
    real(wp) :: varying = 0.0_wp  !! numbers that are not 0 throughout
    real(wp) :: zeros = 0.0_wp
    real(wp) :: cache = 0.0_wp    !! memory in which HDF5 keeps chunks
  end type file_t

  !> Seconds of the phases of a run.
  type :: seconds_t
    real(wp) :: prepare, factorise, condense, contact, recover, write
  end type seconds_t

contains

  !> Foresee the costs of a planned run and add them to its table; choose, of what *PRECISION leaves
  !> open, what fits the machine.
  !>
  !> `factor` keeps the symbolic analysis for the first factorisation. Where even the analysis has
  !> no room the memory is a lower bound, and the plan has no time.
  subroutine estimate_costs(scene, path, plan, factor, error)
    type(scene_t), intent(inout) :: scene !! its precision as it is chosen
    character(*), intent(in) :: path !! of the result file
    type(plan_t), intent(inout) :: plan
    type(sparse_factor_t), intent(inout) :: factor
    type(error_t), allocatable, intent(out) :: error !! METIS, LAPACK or MUMPS failed
    type(sizes_t) :: sizes
    type(file_t) :: file
    type(seconds_t) :: seconds
    type(usage_t) :: others
    real(wp) :: base, memory, ordering
    character(:), allocatable :: reasons

    others = usage_of_others()
    base = real(resident_bytes() + others%resident, wp)
    plan%memory_left = memory_left()
    plan%disk_left = disk_left(path)
    scene%precision%scratch = path(:index(path, '/', back=.true.))
    if (scene%precision%scratch == '') scene%precision%scratch = './'
    sizes%ranks = others%ranks_here
    sizes%share = sizes%ranks/real(n_ranks(), wp)
    call count_sizes(scene, plan, sizes)
    file = size_of_file(scene, plan, sizes)
    call look_at_pattern(scene, file, plan, factor, sizes, ordering, reasons, error)
    if (allocated(error)) return
    plan%more_memory = peak_memory(sizes, file) + granted
    plan%file_size = file%size
    plan%fields_size = file%fields
    plan%scratch_size = sizes%scratch
    memory = base + peak_memory(sizes, file)
    call add_figure(plan, 'peak_memory_bytes', memory, bound_about)
    call add_figure(plan, 'file_bytes', file%most, bound_at_most)
    call add_figure(plan, 'likely_file_bytes', file%size, bound_about)
    if (plan%is_analysed) then
      seconds = seconds_of_run(scene, sizes, file, ordering)
      call add_figure(plan, 'factor_entries', sizes%factor, merge(bound_fixed, bound_at_most, &
        plan%n_factorisations == 1 .and. scene%precision%block_low_rank <= 0.0_wp))
      call add_figure(plan, 'solutions', solutions(scene, sizes), bound_about)
      call add_figure(plan, 'compliance_products', sizes%increments* &
        products_of_increment(scene, sizes), bound_about)
      call add_figure(plan, 'operations', flops_of_run(scene, sizes), bound_about)
      call add_figure(plan, 'cpu_seconds', cpu_seconds() + total(seconds), bound_about)
    end if
    call describe_costs(plan, sizes, file, memory, seconds)
    if (reasons /= '') call describe_choice(scene, reasons, plan)
  end subroutine estimate_costs

  !> Order the equations of the first step and analyse their elimination, in the first arithmetic
  !> that fits; where none does, in the one that needs least.
  subroutine look_at_pattern(scene, file, plan, factor, sizes, ordering, reasons, error)
    type(scene_t), intent(inout) :: scene  !! its precision as it is chosen
    type(file_t), intent(in) :: file
    type(plan_t), intent(inout) :: plan
    type(sparse_factor_t), intent(inout) :: factor
    type(sizes_t), intent(inout) :: sizes  !! what the analysis tells
    real(wp), intent(out) :: ordering      !! time it took to order [s]
    character(:), allocatable, intent(out) :: reasons !! why nothing better was chosen
    type(error_t), allocatable, intent(out) :: error
    type(free_motions_t) :: motions
    type(dof_map_t) :: map
    type(triplets_t) :: pattern
    type(precision_controls_t), allocatable :: list(:)
    integer, allocatable :: start(:), neighbours(:), place(:)
    real(wp), allocatable :: need(:)
    logical, allocatable :: has_disk(:)
    logical :: prescribed(3, scene%mesh%n_nodes)
    integer :: i, best

    ordering = 0.0_wp
    reasons = ''
    list = alternatives(scene%precision)
    ! The least that any of them needs.
    call take_precision(list(size(list)), sizes)
    if (peak_memory(sizes, file_t()) + granted > real(plan%memory_left, wp)) return
    prescribed = prescribed_dofs(scene, 1)
    call find_free_motions(scene%mesh, prescribed, ref_nodes(scene%obstacles), plan%points%node, &
      motions, error)
    if (allocated(error)) return
    map = make_dof_map(scene%mesh%body, hold_pins(motions, prescribed), &
      interface_dofs(scene, plan%points))
    call node_neighbours(scene%mesh, start, neighbours)
    ordering = cpu_seconds()
    call order_equations(map, start, neighbours, place, error)
    if (allocated(error)) return
    ordering = cpu_seconds() - ordering
    call list_shares(scene%mesh, scene%materials, map, start, neighbours, pattern)
    plan%is_analysed = .true.
    sizes%motions = motions%n
    sizes%neighbours = size(neighbours)
    sizes%entries = size(pattern%row, kind=i8)
    if (pattern%is_shared) sizes%entries = sizes%ranks*sizes%entries

    allocate (need(size(list)), has_disk(size(list)))
    best = 0
    do i = 1, size(list)
      call analyse_in(list(i))
      if (allocated(error)) return
      need(i) = peak_memory(sizes, file) + granted
      has_disk(i) = file%size + sizes%scratch <= real(plan%disk_left, wp)
      if (need(i) <= enough*real(plan%memory_left, wp) .and. has_disk(i)) exit
      if (best == 0) best = i
      if (need(i) < need(best) .and. has_disk(i)) best = i
      if (i > 1) reasons = reasons//', '
      reasons = reasons//reason_against(i)
    end do
    if (i > size(list)) then
      ! None is sure to fit: the one that needs least, which may just do.
      reasons = 'which needs least'
      if (best < size(list)) call analyse_in(list(best))
      if (best == 1) reasons = ''
      i = best
    end if
    scene%precision = list(i)
    if (sizes%scratch < real(plan%memory_left, wp) - need(i)) sizes%scratch_rate = kept_rate

  contains

    !> The analysis and the sizes in one of the arithmetics.
    subroutine analyse_in(precision)
      type(precision_controls_t), intent(in) :: precision

      factor%precision = precision
      call analyse(pattern, place, map%n_interface, factor, error)
      if (allocated(error)) return
      call take_precision(precision, sizes)
      sizes%factor = real(factor%foretold%entries, wp)
      sizes%front = factor%foretold%largest_front
      sizes%workspace = sizes%share*real(factor%foretold%bytes, wp)
      sizes%flops = factor%foretold%flops
      sizes%scratch = 0.0_wp
      if (precision%out_of_core) sizes%scratch = sizes%share*sizes%word*sizes%factor
    end subroutine analyse_in

    !> Why the choice does not do, in words.
    function reason_against(choice) result(words)
      integer, intent(in) :: choice
      character(:), allocatable :: words

      words = where_in_words(list(choice))//', needs '//bytes_in_words(need(choice))
      if (.not. has_disk(choice)) words = words//' and '//bytes_in_words(sizes%scratch)//' of disk'
    end function reason_against

  end subroutine look_at_pattern

  !> Sizes of numbers in an arithmetic, and the least that the factor takes.
  pure subroutine take_precision(precision, sizes)
    type(precision_controls_t), intent(in) :: precision
    type(sizes_t), intent(inout) :: sizes

    sizes%word = merge(4.0_wp, 8.0_wp, precision%single_factor)
    sizes%copy = 4.0_wp ! W again in single precision
    sizes%columns = 0.0_wp
    if (is_exact(precision)) sizes%columns = sizes%most_columns
    sizes%workspace = sizes%share*sizes%word*sizes%factor
    if (precision%out_of_core) sizes%workspace = 0.0_wp
  end subroutine take_precision

  !> Sizes that the scene tells; of those of the elimination the least they can be.
  pure subroutine count_sizes(scene, plan, sizes)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(sizes_t), intent(inout) :: sizes !! its ranks are known
    integer :: i

    sizes%nodes = scene%mesh%n_nodes
    sizes%bricks = scene%mesh%n_elements
    sizes%equations = plan%n_equations
    sizes%interface = plan%n_interface
    sizes%rows = sum(real(plan%rows, wp))
    sizes%points = plan%points%n
    ! A node of a large mesh of bricks has 27 neighbours, half of them in one triangle.
    sizes%neighbours = 27.0_wp*sizes%nodes
    sizes%entries = 40.0_wp*sizes%equations
    sizes%factor = sizes%entries
    sizes%front = 0.0_wp
    call take_precision(scene%precision, sizes)
    sizes%flops = 0.0_wp
    sizes%increments = plan%n_increments
    sizes%outputs = plan%n_outputs
    sizes%steps = size(scene%steps)
    sizes%most_columns = max(0, min(most_ahead, maxval(scene%steps%n_increments)))
    if (plan%n_interface == 0) sizes%most_columns = 0.0_wp
    do i = 1, size(scene%pairs)
      if (.not. is_flat(scene%obstacles(scene%pairs(i)%obstacle))) sizes%most_columns = 0.0_wp
    end do
    sizes%factorisations = plan%n_factorisations
    sizes%motions = 0.0_wp
  end subroutine count_sizes

  !> What the run takes beside what the process has already, at the peak: while it factorises, or
  !> afterwards.
  pure function peak_memory(sizes, file) result(bytes)
    type(sizes_t), intent(in) :: sizes
    type(file_t), intent(in) :: file
    real(wp) :: bytes                   !! [bytes]
    real(wp) :: matrix, mesh, factorising, running

    ! Row, column and value of every entry, ours and MUMPS's copy; neighbours, numbers of the
    ! unknowns, their order.
    matrix = (24.0_wp + sizes%word)*sizes%entries
    mesh = 4.0_wp*sizes%neighbours + 24.0_wp*sizes%nodes + 12.0_wp*sizes%equations
    ! The Schur complement beside MUMPS's fronts.
    factorising = matrix + mesh + sizes%workspace + sizes%word*sizes%interface**2
    ! The factor stays; compliance and W; responses and loads of two patterns, old and new state,
    ! forces and fields of a step: some thirty vectors over the nodes; the columns of the increments
    ! ahead, ours and MUMPS's; HDF5's chunks.
    running = sizes%workspace + 8.0_wp*sizes%interface**2 + (8.0_wp + sizes%copy)*sizes%rows**2 + &
      30.0_wp*24.0_wp*sizes%nodes + 16.0_wp*sizes%equations*sizes%columns + krylov_bytes(sizes) + &
      file%cache
    bytes = sizes%ranks*libraries + max(factorising, running)
  end function peak_memory

  !> The vectors of GMRES that are used; where bodies are free the dense system of the response to
  !> their motions, and LAPACK's copy.
  pure function krylov_bytes(sizes) result(bytes)
    type(sizes_t), intent(in) :: sizes
    real(wp) :: bytes
    real(wp), parameter :: most_dense = 1000.0_wp ! rows, of global_newton

    bytes = 8.0_wp*40.0_wp*sizes%rows + 1.3e6_wp*min(1.0_wp, sizes%rows/100.0_wp)
    if (sizes%motions > 0.0_wp .and. sizes%rows <= most_dense) bytes = bytes + &
      16.0_wp*sizes%rows**2
  end function krylov_bytes

  !> The result file: fields of the outputs, contact of every increment, what grows empty.
  pure function size_of_file(scene, plan, sizes) result(file)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(sizes_t), intent(in) :: sizes
    type(file_t) :: file
    real(wp) :: held, once, contact, table
    integer :: i

    held = count(prescribed_nodes(scene))
    file%datasets = history_datasets + datasets_of_a_pair*size(scene%pairs)
    contact = 0.0_wp
    associate (output => scene%output)
      if (output%displacement) call add_field(24.0_wp*sizes%nodes, 24.0_wp*sizes%nodes, sizes, file)
      if (output%reaction) call add_field(24.0_wp*sizes%nodes, 24.0_wp*held, sizes, file)
      if (output%contact .and. plan%points%n > 0) then
        call add_field(24.0_wp*sizes%nodes, 24.0_wp*sizes%points, sizes, file)
        call add_field(8.0_wp*sizes%nodes, 8.0_wp*sizes%points, sizes, file)
        call add_field(sizes%nodes, 0.0_wp, sizes, file)
      end if
      if (output%mesh_error) call add_field(8.0_wp*sizes%bricks, 8.0_wp*sizes%bricks, sizes, file)
      do i = 1, count([output%stress, output%strain])
        if (output%at_centroids) call add_field(48.0_wp*sizes%bricks, 48.0_wp*sizes%bricks, &
          sizes, file)
        if (output%at_nodes) call add_field(48.0_wp*sizes%nodes, 48.0_wp*sizes%nodes, sizes, file)
        if (output%at_gauss_points) call add_field(384.0_wp*sizes%bricks, 384.0_wp*sizes%bricks, &
          sizes, file)
      end do
    end associate
    ! Reactions, gaps, slips and status; frames where they turn.
    do i = 1, plan%points%n
      contact = contact + 65.0_wp
      if (is_flat(scene%obstacles(scene%pairs(plan%points%pair(i))%obstacle))) cycle
      contact = contact + 72.0_wp
    end do
    file%cache = file%cache + min(5.0_wp*chunk_cache, sizes%increments*contact)
    file%fields = squeezed*file%varying + file%zeros/200.0_wp
    file%varying = file%varying + sizes%increments*contact
    ! The mesh and its ids; nodes, places, areas and frames of the points.
    once = 32.0_wp*sizes%nodes + 81.0_wp*sizes%bricks + 112.0_wp*sizes%points + &
      real(len(scene%deck), wp)
    ! A table of a dataset has room for the increments, twice; the state is there in two slots, and
    ! of the forces in it few are not 0.
    table = growing_dataset*min(64.0_wp, max(1.0_wp, sizes%increments/512.0_wp))
    file%datasets = file%datasets + 2
    file%size = once + table*file%datasets + squeezed*file%varying + file%zeros/200.0_wp + &
      100.0_wp*sizes%nodes
    ! Nothing squeezed, and room to spare in the tables.
    file%most = once + 1.0e6_wp + 2.0_wp*table*file%datasets + file%varying + file%zeros + &
      340.0_wp*sizes%nodes
  end function size_of_file

  !> A field: all its numbers in an output, and those of them that are not 0 throughout.
  pure subroutine add_field(all, varying, sizes, file)
    real(wp), intent(in) :: all, varying !! [bytes]
    type(sizes_t), intent(in) :: sizes
    type(file_t), intent(inout) :: file

    file%datasets = file%datasets + 2 ! with its offsets
    file%varying = file%varying + sizes%outputs*min(all, varying)
    file%zeros = file%zeros + sizes%outputs*max(0.0_wp, all - varying)
    if (all <= chunk_cache) file%cache = file%cache + min(chunk_cache, sizes%outputs*all)
  end subroutine add_field

  !> The nodes that any step holds.
  pure function prescribed_nodes(scene) result(held)
    type(scene_t), intent(in) :: scene
    logical :: held(scene%mesh%n_nodes)
    integer :: step

    held = .false.
    do step = 1, size(scene%steps)
      held(scene%steps(step)%boundary%node) = .true.
    end do
  end function prescribed_nodes

  !> Newton-Raphson iterations of an increment, each with one solution.
  pure function iterations_of_increment(scene) result(n)
    type(scene_t), intent(in) :: scene
    real(wp) :: n
    integer :: i

    n = 1.0_wp
    if (.not. is_exact(scene%precision)) n = newton_raphson_refined
    do i = 1, size(scene%pairs)
      if (.not. is_flat(scene%obstacles(scene%pairs(i)%obstacle))) n = newton_raphson_curved
    end do
  end function iterations_of_increment

  !> Products of W with a vector in an increment; a sweep is one.
  pure function products_of_increment(scene, sizes) result(n)
    type(scene_t), intent(in) :: scene
    type(sizes_t), intent(in) :: sizes
    real(wp) :: n

    n = products_without
    if (any(scene%pairs%mu > 0.0_wp)) n = products_with_friction
    if (scene%contact%solver == solver_sweeps) n = -sweeps_a_digit*sqrt(sizes%points)* &
      log10(scene%contact%tolerance)
    if (sizes%motions > 0.0_wp) n = n*solves_for_motions
    n = n*iterations_of_increment(scene)
    if (sizes%rows <= 0.0_wp) n = 0.0_wp
  end function products_of_increment

  !> Solutions with the factor in the whole run: two load patterns a step, and those of increments.
  pure function solutions(scene, sizes) result(n)
    type(scene_t), intent(in) :: scene
    type(sizes_t), intent(in) :: sizes
    real(wp) :: n

    n = 2.0_wp*sizes%steps + sizes%increments*iterations_of_increment(scene)
    if (.not. is_exact(scene%precision)) n = n + 2.0_wp*refinements*sizes%steps
  end function solutions

  !> Elimination, inverse of the Schur complement, solutions, products with W.
  pure function flops_of_run(scene, sizes) result(flops)
    type(scene_t), intent(in) :: scene
    type(sizes_t), intent(in) :: sizes
    real(wp) :: flops

    flops = sizes%factorisations*(sizes%flops + sizes%interface**3) + &
      solutions(scene, sizes)*(4.0_wp*sizes%factor + 2.0_wp*sizes%interface**2) + &
      2.0_wp*sizes%increments*products_of_increment(scene, sizes)*sizes%rows**2
  end function flops_of_run

  !> Seconds from now to the end, by phase.
  function seconds_of_run(scene, sizes, file, ordering) result(seconds)
    type(scene_t), intent(in) :: scene
    type(sizes_t), intent(in) :: sizes
    type(file_t), intent(in) :: file
    real(wp), intent(in) :: ordering !! [s]
    type(seconds_t) :: seconds
    type(machine_speed_t) :: speed
    real(wp) :: stiffness_time, force_time, product, plain, passes

    call measure_speed(nint(sizes%front), nint(sizes%rows), int(sizes%word*sizes%factor, i8), speed)
    call time_brick(scene, stiffness_time, force_time)
    plain = force_time/reference_brick

    ! The first order is the plan's, which is spent already.
    seconds%prepare = start_of_run*plain + (sizes%factorisations - 1.0_wp)*ordering + &
      sizes%factorisations*sizes%bricks*(1.5_wp*stiffness_time + force_time)
    ! Numbers of half the size are worked on twice as fast.
    seconds%factorise = sizes%factorisations*sizes%word/8.0_wp*(sizes%flops/speed%flops + &
      passes_to_factorise*8.0_wp*sizes%factor/speed%bytes) + sizes%scratch/sizes%scratch_rate
    seconds%condense = sizes%factorisations*(sizes%interface**3/speed%flops + &
      40.0_wp*sizes%interface**2/speed%bytes)
    product = sizes%rows**2/speed%entries
    ! A triangle beyond the caches comes from memory every time.
    if (4.0_wp*sizes%rows**2 > cached) product = max(product, 4.0_wp*sizes%rows**2/speed%bytes)
    product = product + 400.0_wp*sizes%rows/speed%bytes
    if (scene%contact%solver == solver_sweeps) product = 8.0_wp*sizes%rows**2/speed%bytes + &
      sizes%points*visit_of_sweep*force_time
    seconds%contact = sizes%increments*products_of_increment(scene, sizes)*product
    passes = passes_to_solve
    if (sizes%columns > 1.0_wp) passes = passes_ahead
    seconds%recover = solutions(scene, sizes)*(passes*sizes%word*sizes%factor + &
      8.0_wp*sizes%interface**2)/speed%bytes + 2.0_wp*solutions(scene, sizes)*sizes%scratch/ &
      sizes%scratch_rate + sizes%increments*(start_of_increment*plain + &
      2.0_wp*iterations_of_increment(scene)*sizes%bricks*force_time)
    seconds%write = plain*(sizes%increments*write_of_increment + file%varying/squeeze_rate + &
      file%zeros/squeeze_zeros)
  end function seconds_of_run

  !> How long a brick of the scene takes: its stiffness, and its internal force.
  subroutine time_brick(scene, stiffness_time, force_time)
    type(scene_t), intent(in) :: scene
    real(wp), intent(out) :: stiffness_time, force_time !! [s]
    integer, parameter :: least = 100
    real(wp), parameter :: long_enough = 0.003_wp
    real(wp) :: lambda, shear, start, spent, u(3, 8), f(3, 8), k(24, 24)
    integer :: n

    stiffness_time = 0.0_wp
    force_time = 0.0_wp
    if (scene%mesh%n_elements == 0) return
    associate (mesh => scene%mesh, material => scene%materials(scene%mesh%material(1)))
      call lame_constants(material%young, material%poisson, lambda, shear)
      u = 0.0_wp
      n = 0
      start = cpu_seconds()
      do
        n = n + 1
        k = stiffness(mesh%element_kind(1), mesh%coordinates(:, mesh%connectivity(:, 1)), lambda, &
          shear)
        u(1, 1) = u(1, 1) + sign(1.0e-6_wp, k(1, 1))
        spent = cpu_seconds() - start
        if (n >= least .and. spent > long_enough) exit
      end do
      stiffness_time = spent/n
      n = 0
      start = cpu_seconds()
      do
        n = n + 1
        f = nodal_force(mesh%element_kind(1), mesh%coordinates(:, mesh%connectivity(:, 1)), u, &
          lambda, shear)
        u(1, 1) = u(1, 1) + sign(1.0e-6_wp, f(1, 1))
        spent = cpu_seconds() - start
        if (n >= least .and. spent > long_enough) exit
      end do
      force_time = spent/n
    end associate
  end subroutine time_brick

  pure function total(seconds)
    type(seconds_t), intent(in) :: seconds
    real(wp) :: total !! [s]

    total = seconds%prepare + seconds%factorise + seconds%condense + seconds%contact + &
      seconds%recover + seconds%write
  end function total

  !> The costs in the table.
  subroutine describe_costs(plan, sizes, file, memory, seconds)
    type(plan_t), intent(inout) :: plan
    type(sizes_t), intent(in) :: sizes
    type(file_t), intent(in) :: file
    real(wp), intent(in) :: memory           !! [bytes]
    type(seconds_t), intent(in) :: seconds   !! where the plan is analysed
    character(:), allocatable :: least

    least = 'more than '
    if (plan%is_analysed) least = ''
    if (plan%is_analysed .and. sizes%factor > 0.0_wp) call add_line(plan, 'factor', &
      bound_at_most, to_text(sizes%factor/1.0e6_wp, 3)//' million entries, '// &
      to_text(sizes%flops/1.0e9_wp, 3)//' Gflop each time')
    if (sizes%ranks > 1.0_wp .or. sizes%share < 1.0_wp) call add_line(plan, 'ranks', bound_fixed, &
      to_text(nint(sizes%ranks/sizes%share))//', of them '//to_text(nint(sizes%ranks))// &
      ' on this machine, whose memory follows')
    call add_line(plan, 'memory', bound_about, least//bytes_in_words(memory)// &
      left_in_words(plan%memory_left))
    if (plan%is_analysed) call add_line(plan, 'time', bound_about, &
      time_in_words(cpu_seconds() + total(seconds))//' of one processor: factorise '// &
      time_in_words(seconds%prepare + seconds%factorise + seconds%condense)//', contact '// &
      time_in_words(seconds%contact)//', recover '//time_in_words(seconds%recover)//', write '// &
      time_in_words(seconds%write))
    call add_line(plan, 'file', bound_about, bytes_in_words(file%size)//', at most '// &
      bytes_in_words(file%most)//left_in_words(plan%disk_left))
  end subroutine describe_costs

  !> What the machine has left, where it says so.
  pure function left_in_words(left) result(words)
    integer(i8), intent(in) :: left !! [bytes]
    character(:), allocatable :: words

    words = ''
    if (left < huge(left)) words = ' ('//bytes_in_words(real(left, wp))//' free)'
  end function left_in_words

end module estimate_costs_mod
