!> What a run will cost: memory, operations, time, file.
!>
!> Sizes come from the scene and from the symbolic analysis of the stiffness: ordering and
!> elimination without a number. Each cost is a sum over the arrays and loops of the run, named
!> where it is made: the memory below, the file in estimate_file, the time in estimate_time. The few
!> constants are measured once and documented in docs/plan.md.
module estimate_costs_mod
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t, raise, exit_wrong_input
  use text_mod, only: to_text
  use system_mod, only: cpu_seconds
  use resource_limits_mod, only: resident_bytes, memory_left, disk_left
  use parallel_mod, only: n_ranks, usage_t, usage_of_others
  use constraints_mod, only: constraints_t, active_constraints
  use linked_nodes_mod, only: coupled_nodes
  use obstacles_mod, only: ref_nodes
  use obstacle_shapes_mod, only: has_fixed_normals
  use contact_points_mod, only: contact_nodes
  use scene_mod, only: scene_t
  use controls_mod, only: is_exact, accuracy_controls_t, precision_controls_t, solver_sweeps, &
    compliance_auto, compliance_dense, compliance_products
  use plan_mod, only: plan_t, add_figure, bound_fixed, bound_at_most, bound_about
  use dof_map_mod, only: dof_map_t, make_dof_map
  use assembly_mod, only: triplets_t
  use mesh_parts_mod, only: list_parts
  use ordering_mod, only: order_equations
  use new_iterative_body_mod, only: has_iterative_body
  use sparse_factor_mod, only: sparse_factor_t, analyse
  use rigid_modes_mod, only: free_motions_t, find_free_motions, hold_pins
  use contact_interface_mod, only: interface_dofs
  use step_loads_mod, only: prescribed_dofs
  use alternatives_mod, only: alternatives, where_in_words
  use count_sizes_mod, only: sizes_t, count_sizes, products_of_increment, solutions, flops_of_run
  use estimate_iterative_mod, only: check_iterative, iterative_bytes
  use estimate_file_mod, only: file_size_t, size_of_file
  use estimate_time_mod, only: seconds_t, seconds_of_run, seconds_at_fixed_rates, &
    total_seconds
  use make_plan_mod, only: forget_compliance
  use amounts_mod, only: bytes_in_words, time_in_words
  use plan_table_mod, only: add_line, describe_choice, describe_products, describe_iterative
  implicit none
  private

  public :: estimate_costs, room_within

  ! Memory that no array of the run explains [bytes]: pages of the libraries' code that are first
  ! touched by a solution and by writing, HDF5's own tables, the heap's unused parts.
  real(wp), parameter :: libraries = 15.0e6_wp
  ! What must be left whenever a library is called (resource_limits_mod) [bytes].
  real(wp), parameter :: granted = 32.0e6_wp

  real(wp), parameter :: near_interface = 3.0e3_wp
  !! a number of the interface, where W is not formed [bytes]

  real(wp), parameter :: least_interface = 1000.0_wp !! numbers of it from which on W has a price
  real(wp), parameter :: least_factor = 0.7_wp !! of that with the interface last: the least without

  ! From what time in double precision on [s], and for what share of it, single precision is chosen.
  real(wp), parameter :: least_to_save = 0.2_wp, worthwhile = 0.85_wp

  ! Of the memory that is left, what a plan with an alternative may take: estimates are that good.
  real(wp), parameter :: enough = 0.9_wp

  !> Equations without numbers.
  type :: pattern_t
    type(triplets_t) :: k             !! rows and columns of one triangle
    integer, allocatable :: position(:)  !! of every equation in the elimination
    integer :: n_interface = 0        !! equations on contact nodes
    integer :: n_schur = 0            !! of them, those that are condensed to: all or none
    integer :: motions = 0            !! rigid motions that the supports leave
    real(wp) :: ordering = 0.0_wp     !! time it took to order [s]
  end type pattern_t

contains

  !> Foresee the costs of a planned run and add them to its table; choose, of what *PRECISION leaves
  !> open, what fits the machine.
  !>
  !> `factor` keeps the symbolic analysis for the first factorisation. Where even the analysis has
  !> no room the memory is a lower bound, and the plan has no time.
  subroutine estimate_costs(scene, path, needs_matrix, plan, factor, error)
    type(scene_t), intent(inout) :: scene !! its precision and compliance as they are chosen
    character(*), intent(in) :: path !! of the result file
    logical, intent(in) :: needs_matrix !! W itself is wanted, for a file say
    type(plan_t), intent(inout) :: plan
    type(sparse_factor_t), intent(inout) :: factor
    type(error_t), allocatable, intent(out) :: error !! METIS, LAPACK or MUMPS failed
    type(sizes_t) :: sizes
    type(file_size_t) :: file
    type(seconds_t) :: seconds
    type(usage_t) :: others
    real(wp) :: base, memory, ordering
    character(:), allocatable :: reasons

    others = usage_of_others()
    base = taken_already(scene%accuracy)
    plan%memory_left = memory_left()
    if (scene%accuracy%memory > 0.0_wp) plan%memory_left = min(plan%memory_left, &
      room_within(scene%accuracy))
    plan%disk_left = disk_left(path)
    scene%precision%scratch = path(:index(path, '/', back=.true.))
    if (scene%precision%scratch == '') scene%precision%scratch = './'
    sizes%ranks = others%ranks_here
    sizes%fraction_here = sizes%ranks/real(n_ranks(), wp)
    call count_sizes(scene, plan, sizes)
    file = size_of_file(scene, plan, sizes)
    if (scene%contact%compliance /= compliance_dense .and. .not. scene%precision%iterative .and. &
      (needs_matrix .or. sizes%rows <= 0.0_wp .or. scene%contact%solver == solver_sweeps)) then
      scene%contact%compliance = compliance_dense
    end if
    if (needs_matrix .and. scene%precision%iterative) then
      call raise(error, exit_wrong_input, 'bipot: error: *BODY SOLVER, TYPE=ITERATIVE does not '// &
        'cover --export, which writes the compliance of the contact; TYPE=FACTOR does')
      return
    end if
    if (needs_matrix) scene%precision%body_is_given = .true.
    call choose_body(scene, file, plan, factor, sizes, ordering, reasons, error)
    if (allocated(error)) return
    if (plan%is_analysed .and. .not. scene%precision%iterative) call look_at_later_steps(scene, &
      plan, sizes, error)
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
      plan%seconds = total_seconds(seconds)
      plan%start_seconds = seconds%prepare + seconds%factorise + seconds%condense
      if (.not. scene%precision%iterative) then
        call add_figure(plan, 'factor_entries', sizes%factor, merge(bound_fixed, bound_at_most, &
          plan%n_factorisations == 1 .and. scene%precision%block_low_rank <= 0.0_wp))
        call add_figure(plan, 'solutions', solutions(scene, sizes), bound_about)
        call add_figure(plan, 'compliance_products', sizes%increments* &
          products_of_increment(scene, sizes), bound_about)
        call add_figure(plan, 'operations', flops_of_run(scene, sizes), bound_about)
      end if
      call add_figure(plan, 'cpu_seconds', cpu_seconds() + plan%seconds, bound_about)
    end if
    call describe_costs(plan, sizes, file, memory, seconds)
    if (reasons /= '') call describe_choice(scene, reasons, plan)
  end subroutine estimate_costs

  !> Memory that the process has and does not get again: what runs before this one have touched of
  !> the libraries is counted with those.
  function taken_already(accuracy) result(bytes)
    type(accuracy_controls_t), intent(in) :: accuracy
    real(wp) :: bytes !! [bytes]
    type(usage_t) :: others

    others = usage_of_others()
    bytes = real(resident_bytes() + others%resident, wp)
    if (accuracy%runs_before > 0) bytes = bytes - others%ranks_here*libraries
  end function taken_already

  !> What a run may take beside that for its peak to stay below a bound: what must be left whenever
  !> a library is called need not be used.
  function room_within(accuracy) result(bytes)
    type(accuracy_controls_t), intent(in) :: accuracy !! with a bound of the memory
    integer(i8) :: bytes

    bytes = int(max(0.0_wp, accuracy%memory + granted - taken_already(accuracy)), i8)
  end function room_within

  !> Whether there is a factor: where the deck leaves it open and the build has the choice, as long
  !> as it fits.
  subroutine choose_body(scene, file, plan, factor, sizes, ordering, reasons, error)
    type(scene_t), intent(inout) :: scene  !! its precision and compliance as they are chosen
    type(file_size_t), intent(in) :: file
    type(plan_t), intent(inout) :: plan
    type(sparse_factor_t), intent(inout) :: factor
    type(sizes_t), intent(inout) :: sizes
    real(wp), intent(out) :: ordering      !! [s]
    character(:), allocatable, intent(out) :: reasons
    type(error_t), allocatable, intent(out) :: error
    type(free_motions_t) :: motions
    type(scene_t) :: iterated
    type(error_t), allocatable :: refusal
    type(sizes_t) :: bare
    real(wp) :: need

    bare = sizes
    reasons = ''
    need = 0.0_wp
    if (.not. scene%precision%iterative) then
      call choose_compliance(scene, file, plan, factor, sizes, ordering, reasons, error)
      if (allocated(error)) return
      need = peak_memory(sizes, file) + granted
      if (scene%precision%body_is_given .or. need <= enough*real(plan%memory_left, wp)) return
      if (.not. has_iterative_body()) return
    end if
    ordering = 0.0_wp
    call find_free_motions(scene%mesh, prescribed_dofs(scene, 1), ref_nodes(scene%obstacles), &
      contact_nodes(plan%points), motions, error, scene%constraints)
    if (allocated(error)) return
    if (scene%precision%iterative) then
      call check_iterative(scene, plan%points, motions%n, error)
      if (allocated(error)) return
    else
      iterated = scene
      iterated%contact%compliance = compliance_products
      call check_iterative(iterated, plan%points, motions%n, refusal)
      if (allocated(refusal)) return
      scene%precision%iterative = .true.
      scene%precision%single_factor = .false.
      scene%precision%block_low_rank = 0.0_wp
      scene%precision%out_of_core = .false.
      reasons = 'with a factor the run needs '//bytes_in_words(need)
    end if
    scene%contact%compliance = compliance_products
    sizes = bare
    sizes%is_dense = .false.
    sizes%factor = 0.0_wp
    call take_precision(scene%precision, sizes)
    sizes%workspace = iterative_bytes(sizes)
    plan%is_analysed = .true.
    call forget_compliance(plan)
    call describe_iterative(scene, plan)
  end subroutine choose_body

  !> Whether W is formed: where the deck leaves it open, as its figures say.
  !>
  !> A product by the factor cannot cost less than the factor of the interior alone takes to read:
  !> where so many readings already take longer than all that W costs, that is the answer, and the
  !> other order of elimination is not looked for.
  subroutine choose_compliance(scene, file, plan, factor, sizes, ordering, reasons, error)
    type(scene_t), intent(inout) :: scene  !! its precision and compliance as they are chosen
    type(file_size_t), intent(in) :: file
    type(plan_t), intent(inout) :: plan
    type(sparse_factor_t), intent(inout) :: factor
    type(sizes_t), intent(inout) :: sizes
    real(wp), intent(out) :: ordering      !! [s]
    character(:), allocatable, intent(out) :: reasons
    type(error_t), allocatable, intent(out) :: error
    type(precision_controls_t) :: given
    type(sizes_t) :: of_dense, bare
    real(wp) :: by_dense, by_products, spent
    character(:), allocatable :: why

    bare = sizes
    why = 'as the deck asks for'
    if (scene%contact%compliance == compliance_auto .and. sizes%interface < least_interface) then
      scene%contact%compliance = compliance_dense
    else if (scene%contact%compliance == compliance_auto) then
      scene%contact%compliance = compliance_dense
      if (8.0_wp*(sizes%squares + sizes%rows**2) > enough*real(plan%memory_left, wp)) then
        scene%contact%compliance = compliance_products
        why = 'dense it does not fit'
      else
        given = scene%precision
        call look_at_pattern(scene, file, plan, factor, sizes, ordering, reasons, error)
        if (allocated(error) .or. .not. plan%is_analysed) return
        by_dense = seconds_at_fixed_rates(scene, sizes)
        of_dense = sizes
        sizes%is_dense = .false.
        ! Without numbers yet: the factor of the interior, which is the least of it.
        sizes%factor = least_factor*sizes%factor
        sizes%flops = 0.0_wp
        by_products = seconds_at_fixed_rates(scene, sizes)
        sizes = of_dense
        if (by_products >= by_dense) return
        spent = ordering
        scene%precision = given
        scene%contact%compliance = compliance_products
        sizes = bare
        call look_at_pattern(scene, file, plan, factor, sizes, ordering, reasons, error)
        if (allocated(error)) return
        by_products = seconds_at_fixed_rates(scene, sizes)
        ordering = ordering + spent
        if (by_products < by_dense) then
          call forget_compliance(plan)
          call describe_products(plan, 'a share of '//to_text(by_products/by_dense, 2)// &
            ' of the time that it takes dense')
          return
        end if
        scene%precision = given
        scene%contact%compliance = compliance_dense
        sizes = bare
      end if
    end if
    call look_at_pattern(scene, file, plan, factor, sizes, ordering, reasons, error)
    if (scene%contact%compliance /= compliance_products) return
    call forget_compliance(plan)
    call describe_products(plan, why)
  end subroutine choose_compliance

  !> Order the equations of the first step and analyse their elimination, in the first arithmetic
  !> that fits; where none does, in the one that needs least.
  subroutine look_at_pattern(scene, file, plan, factor, sizes, ordering, reasons, error)
    type(scene_t), intent(inout) :: scene  !! its precision as it is chosen
    type(file_size_t), intent(in) :: file
    type(plan_t), intent(inout) :: plan
    type(sparse_factor_t), intent(inout) :: factor
    type(sizes_t), intent(inout) :: sizes  !! what the analysis tells
    real(wp), intent(out) :: ordering      !! time it took to order [s]
    character(:), allocatable, intent(out) :: reasons !! why nothing better was chosen
    type(error_t), allocatable, intent(out) :: error
    type(pattern_t) :: first
    type(precision_controls_t), allocatable :: list(:)
    integer, allocatable :: start(:), neighbours(:)
    real(wp), allocatable :: need(:)
    logical, allocatable :: has_disk(:)
    integer :: i, best

    ordering = 0.0_wp
    reasons = ''
    sizes%is_dense = scene%contact%compliance /= compliance_products
    list = alternatives(scene%precision)
    ! The least that any of them needs.
    call take_precision(list(size(list)), sizes)
    if (peak_memory(sizes, file_size_t()) + granted > real(plan%memory_left, wp)) return
    call make_pattern(scene, plan, prescribed_dofs(scene, 1), start, neighbours, first, error)
    if (allocated(error)) return
    ordering = first%ordering
    plan%is_analysed = .true.
    sizes%motions = first%motions
    sizes%neighbours = size(neighbours)
    sizes%entries = size(first%k%row, kind=i8)
    if (first%k%is_distributed) sizes%entries = sizes%ranks*sizes%entries

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
    if (i == 1 .and. size(list) > 1) call take_single_if_faster(list(2))
    if (allocated(error)) return
    if (sizes%scratch < real(plan%memory_left, wp) - need(i)) sizes%keeps_scratch = .true.

  contains

    !> The analysis and the sizes in one of the arithmetics.
    subroutine analyse_in(precision)
      type(precision_controls_t), intent(in) :: precision

      factor%precision = precision
      call analyse(first%k, first%position, first%n_schur, factor, error)
      if (allocated(error)) return
      call take_precision(precision, sizes)
      sizes%factor = real(factor%predicted%entries, wp)
      sizes%front = factor%predicted%largest_front
      sizes%workspace = sizes%fraction_here*real(factor%predicted%bytes, wp)
      sizes%flops = factor%predicted%flops
      sizes%scratch = 0.0_wp
      if (precision%out_of_core) sizes%scratch = sizes%fraction_here*sizes%word*sizes%factor
    end subroutine analyse_in

    !> Single precision where double precision fits and takes longer: few increments, that is, of
    !> many equations. Not before round obstacles and other bodies, where each placement of the
    !> points would be refined.
    subroutine take_single_if_faster(single)
      type(precision_controls_t), intent(in) :: single !! the alternative to double precision
      type(sizes_t) :: in_double
      real(wp) :: seconds_in_double, seconds_in_single
      integer :: pair

      if (.not. (is_exact(scene%precision) .and. single%single_factor .and. sizes%is_dense)) return
      if (.not. all([(has_fixed_normals(scene, pair), pair=1, size(scene%pairs))])) return
      seconds_in_double = seconds_at_fixed_rates(scene, sizes)
      if (seconds_in_double < least_to_save) return
      in_double = sizes
      scene%precision = single
      call take_precision(single, sizes)
      seconds_in_single = seconds_at_fixed_rates(scene, sizes)
      if (seconds_in_single > worthwhile*seconds_in_double) then
        scene%precision = list(1)
        sizes = in_double
        return
      end if
      call analyse_in(single)
      scene%precision%saves_time = .true.
      reasons = 'a share of '//to_text(seconds_in_single/seconds_in_double, 2)// &
        ' of the time that double precision takes'
    end subroutine take_single_if_faster

    !> Why the choice does not do, in words.
    function reason_against(choice) result(words)
      integer, intent(in) :: choice
      character(:), allocatable :: words

      words = where_in_words(list(choice))//', needs '//bytes_in_words(need(choice))
      if (.not. has_disk(choice)) words = words//' and '//bytes_in_words(sizes%scratch)//' of disk'
    end function reason_against

  end subroutine look_at_pattern

  !> Where a later step prescribes other degrees of freedom of a body its factor is another, in an
  !> order of its own: with fewer equations it may still have more entries. The sizes are those of
  !> the largest.
  subroutine look_at_later_steps(scene, plan, sizes, error)
    type(scene_t), intent(in) :: scene    !! its precision is chosen
    type(plan_t), intent(in) :: plan
    type(sizes_t), intent(inout) :: sizes !! of the first step
    type(error_t), allocatable, intent(out) :: error !! as of estimate_costs
    type(pattern_t) :: pattern
    type(sparse_factor_t) :: factor
    integer, allocatable :: start(:), neighbours(:)
    logical, dimension(3, scene%mesh%n_nodes) :: prescribed, before
    real(wp) :: entries
    integer :: step

    if (plan%n_factorisations <= 1) return
    prescribed = prescribed_dofs(scene, 1)
    do step = 2, size(scene%steps)
      before = prescribed
      prescribed = prescribed_dofs(scene, step)
      if (.not. any((prescribed .neqv. before) .and. spread(scene%mesh%body > 0, 1, 3))) cycle
      call make_pattern(scene, plan, prescribed, start, neighbours, pattern, error)
      if (allocated(error)) return
      factor%precision = scene%precision
      call analyse(pattern%k, pattern%position, pattern%n_schur, factor, error)
      if (allocated(error)) return
      entries = size(pattern%k%row, kind=i8)
      if (pattern%k%is_distributed) entries = sizes%ranks*entries
      sizes%entries = max(sizes%entries, entries)
      associate (predicted => factor%predicted)
        sizes%factor = max(sizes%factor, real(predicted%entries, wp))
        sizes%front = max(sizes%front, real(predicted%largest_front, wp))
        sizes%workspace = max(sizes%workspace, sizes%fraction_here*real(predicted%bytes, wp))
        sizes%flops = max(sizes%flops, predicted%flops)
      end associate
    end do
    if (scene%precision%out_of_core) sizes%scratch = sizes%fraction_here*sizes%word*sizes%factor
  end subroutine look_at_later_steps

  !> The equations with these supports, in their order.
  subroutine make_pattern(scene, plan, prescribed, start, neighbours, pattern, error)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    logical, intent(in) :: prescribed(:, :)         !! (3,n_nodes)
    integer, allocatable, intent(inout) :: start(:), neighbours(:)
    !! of the nodes, as of coupled_nodes: made where supports change them, or they are not there
    type(pattern_t), intent(out) :: pattern
    type(error_t), allocatable, intent(out) :: error !! METIS or LAPACK failed
    type(free_motions_t) :: motions
    type(dof_map_t) :: map
    type(constraints_t) :: active

    active = active_constraints(scene%constraints, prescribed)
    call find_free_motions(scene%mesh, prescribed, ref_nodes(scene%obstacles), &
      contact_nodes(plan%points), motions, error, scene%constraints)
    if (allocated(error)) return
    pattern%motions = motions%n
    map = make_dof_map(scene%mesh%body, hold_pins(motions, prescribed), &
      interface_dofs(scene, plan%points), active)
    if (active%n > 0 .or. .not. allocated(start)) call coupled_nodes(scene%mesh, active, start, &
      neighbours)
    pattern%n_interface = map%n_interface
    pattern%n_schur = map%n_interface
    if (scene%contact%compliance == compliance_products) pattern%n_schur = 0
    pattern%ordering = cpu_seconds()
    call order_equations(map, start, neighbours, pattern%position, error, pattern%n_schur)
    if (allocated(error)) return
    pattern%ordering = cpu_seconds() - pattern%ordering
    call list_parts(scene%mesh, scene%materials, map, start, neighbours, pattern%k)
  end subroutine make_pattern

  !> Sizes of numbers in an arithmetic, and the least that the factor takes.
  pure subroutine take_precision(precision, sizes)
    type(precision_controls_t), intent(in) :: precision
    type(sizes_t), intent(inout) :: sizes

    sizes%word = merge(4.0_wp, 8.0_wp, precision%single_factor)
    sizes%copy = 2.0_wp + merge(4.0_wp, 0.0_wp, precision%single_compliance) ! panels, and rows
    sizes%columns = 0.0_wp
    if (is_exact(precision) .and. sizes%is_dense) sizes%columns = sizes%most_columns
    sizes%workspace = sizes%fraction_here*sizes%word*sizes%factor
    if (precision%out_of_core) sizes%workspace = 0.0_wp
  end subroutine take_precision

  !> What the run takes beside what the process has already, at the peak: while it factorises, or
  !> afterwards.
  pure function peak_memory(sizes, file) result(bytes)
    type(sizes_t), intent(in) :: sizes
    type(file_size_t), intent(in) :: file
    real(wp) :: bytes                   !! [bytes]
    real(wp) :: matrix, mesh, factorising, running, copying, square

    ! Row, column and value of every entry, ours and MUMPS's copy; neighbours, numbers of the
    ! unknowns, their order.
    matrix = (24.0_wp + sizes%word)*sizes%entries
    mesh = 4.0_wp*sizes%neighbours + 24.0_wp*sizes%nodes + 12.0_wp*sizes%equations
    ! The Schur complement beside MUMPS's fronts.
    square = merge(1.0_wp, 0.0_wp, sizes%is_dense)
    factorising = matrix + mesh + sizes%workspace + square*sizes%word*sizes%interface**2
    ! What is near the points, and their blocks of it.
    if (.not. sizes%is_dense) factorising = factorising + near_interface*sizes%interface
    ! The factor stays; compliance and W; responses and loads of two patterns, old and new state,
    ! forces and fields of a step: some thirty vectors over the nodes; the columns of the increments
    ! ahead, ours and MUMPS's; HDF5's chunks.
    running = sizes%workspace + square*(8.0_wp*sizes%squares + &
      (8.0_wp + sizes%copy)*sizes%rows**2) + (1.0_wp - square)*near_interface*sizes%interface + &
      30.0_wp*24.0_wp*sizes%nodes + 16.0_wp*sizes%equations*sizes%columns + krylov_bytes(sizes) + &
      file%cache
    ! The Schur complement beside its blocks, which are copied out of it where there are several.
    copying = 0.0_wp
    if (sizes%squares < sizes%interface**2) copying = mesh + sizes%workspace + &
      square*8.0_wp*(sizes%interface**2 + sizes%squares)
    bytes = sizes%ranks*libraries + max(factorising, running, copying)
  end function peak_memory

  !> The vectors of GMRES that are used; where bodies are free the dense system of the response to
  !> their motions, and LAPACK's copy.
  pure function krylov_bytes(sizes) result(bytes)
    type(sizes_t), intent(in) :: sizes
    real(wp) :: bytes
    real(wp), parameter :: most_dense = 1000.0_wp ! rows, of global_newton

    bytes = 8.0_wp*40.0_wp*sizes%rows + 1.3e6_wp*min(1.0_wp, sizes%rows/100.0_wp)
    if (sizes%motions > 0.0_wp .and. sizes%rows <= most_dense .and. sizes%is_dense) bytes = &
      bytes + 16.0_wp*sizes%rows**2
  end function krylov_bytes

  !> The costs in the table.
  subroutine describe_costs(plan, sizes, file, memory, seconds)
    type(plan_t), intent(inout) :: plan
    type(sizes_t), intent(in) :: sizes
    type(file_size_t), intent(in) :: file
    real(wp), intent(in) :: memory           !! [bytes]
    type(seconds_t), intent(in) :: seconds   !! where the plan is analysed
    character(:), allocatable :: least

    least = 'more than '
    if (plan%is_analysed) least = ''
    if (plan%is_analysed .and. sizes%factor > 0.0_wp) call add_line(plan, 'factor', &
      bound_at_most, to_text(sizes%factor/1.0e6_wp, 3)//' million entries, '// &
      to_text(sizes%flops/1.0e9_wp, 3)//' Gflop per factorisation')
    if (sizes%ranks > 1.0_wp .or. sizes%fraction_here < 1.0_wp) call add_line(plan, 'ranks', &
      bound_fixed, to_text(nint(sizes%ranks/sizes%fraction_here))//', '// &
      to_text(nint(sizes%ranks))//' of them on this machine, whose memory follows')
    call add_line(plan, 'memory', bound_about, least//bytes_in_words(memory)// &
      left_in_words(plan%memory_left))
    if (plan%is_analysed) call add_line(plan, 'time', bound_about, &
      time_in_words(cpu_seconds() + total_seconds(seconds))//' of one processor: factorise '// &
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
