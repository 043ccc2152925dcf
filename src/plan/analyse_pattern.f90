!> The symbolic analysis of the stiffness, ordering and elimination without a number, in the
!> arithmetic that fits.
module analyse_pattern_mod
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t
  use text_mod, only: to_text
  use system_mod, only: cpu_seconds
  use constraints_mod, only: constraints_t, active_constraints
  use linked_nodes_mod, only: coupled_nodes
  use obstacles_mod, only: ref_nodes
  use contact_points_mod, only: contact_nodes
  use scene_mod, only: scene_t
  use controls_mod, only: is_exact, precision_controls_t, compliance_products
  use plan_mod, only: plan_t
  use dof_map_mod, only: dof_map_t, make_dof_map
  use assembly_mod, only: triplets_t
  use mesh_parts_mod, only: list_parts
  use ordering_mod, only: order_equations
  use sparse_factor_mod, only: sparse_factor_t, analyse
  use rigid_modes_mod, only: free_motions_t, find_free_motions, hold_pins
  use contact_interface_mod, only: interface_dofs
  use step_loads_mod, only: prescribed_dofs
  use dynamic_step_mod, only: are_alike
  use alternatives_mod, only: alternatives, where_in_words
  use count_sizes_mod, only: sizes_t
  use estimate_file_mod, only: file_size_t
  use estimate_memory_mod, only: take_precision, needed_memory, enough
  use estimate_time_mod, only: seconds_at_fixed_rates
  use amounts_mod, only: bytes_in_words
  implicit none
  private

  public :: look_at_pattern, look_at_later_steps

  ! From what time in double precision on [s], and for what share of it, single precision is chosen.
  real(wp), parameter :: least_to_save = 0.2_wp, worthwhile = 0.85_wp

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

  !> Order the equations of the first step and analyse their elimination, in the first arithmetic
  !> that fits; where none does, in the one that needs least.
  subroutine look_at_pattern(scene, file, plan, factor, sizes, reasons, error)
    type(scene_t), intent(in) :: scene
    type(file_size_t), intent(in) :: file
    type(plan_t), intent(inout) :: plan    !! gets the precision
    type(sparse_factor_t), intent(inout) :: factor
    type(sizes_t), intent(inout) :: sizes  !! what the analysis tells
    character(:), allocatable, intent(out) :: reasons !! why nothing better was chosen
    type(error_t), allocatable, intent(out) :: error
    type(pattern_t) :: first
    type(precision_controls_t), allocatable :: list(:)
    integer, allocatable :: start(:), neighbours(:)
    real(wp), allocatable :: need(:)
    logical, allocatable :: has_disk(:)
    integer :: i, best

    sizes%ordering = 0.0_wp
    reasons = ''
    sizes%is_dense = plan%choices%compliance /= compliance_products
    list = alternatives(plan%choices%precision)
    ! The least that any of them needs.
    call take_precision(list(size(list)), sizes)
    if (needed_memory(sizes, file_size_t()) > real(plan%memory_left, wp)) return
    call make_pattern(scene, plan, 1, start, neighbours, first, error)
    if (allocated(error)) return
    sizes%ordering = first%ordering
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
      need(i) = needed_memory(sizes, file)
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
    plan%choices%precision = list(i)
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

      if (plan%choices%precision%keeps_double) return
      if (.not. (is_exact(list(1)) .and. single%single_factor .and. sizes%is_dense)) return
      if (sizes%is_curved) return
      seconds_in_double = seconds_at_fixed_rates(sizes)
      if (seconds_in_double < least_to_save) return
      in_double = sizes
      call take_precision(single, sizes)
      seconds_in_single = seconds_at_fixed_rates(sizes)
      if (seconds_in_single > worthwhile*seconds_in_double) then
        sizes = in_double
        return
      end if
      call analyse_in(single)
      plan%choices%precision = single
      plan%choices%precision%saves_time = .true.
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
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan      !! its precision is chosen
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
      if (.not. any((prescribed .neqv. before) .and. spread(scene%mesh%body > 0, 1, 3)) .and. &
        are_alike(scene, step - 1, step)) cycle
      call make_pattern(scene, plan, step, start, neighbours, pattern, error)
      if (allocated(error)) return
      factor%precision = plan%choices%precision
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
    if (plan%choices%precision%out_of_core) sizes%scratch = sizes%fraction_here*sizes%word* &
      sizes%factor
  end subroutine look_at_later_steps

  !> The equations with the supports of a *STEP, in their order.
  subroutine make_pattern(scene, plan, step, start, neighbours, pattern, error)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    integer, intent(in) :: step
    integer, allocatable, intent(inout) :: start(:), neighbours(:)
    !! of the nodes, as of coupled_nodes: made where supports change them, or they are not there
    type(pattern_t), intent(out) :: pattern
    type(error_t), allocatable, intent(out) :: error !! METIS or LAPACK failed
    type(free_motions_t) :: motions
    type(dof_map_t) :: map
    type(constraints_t) :: active
    logical :: prescribed(3, scene%mesh%n_nodes)

    prescribed = prescribed_dofs(scene, step)
    active = active_constraints(scene%constraints, prescribed)
    ! Inertia holds what supports leave free.
    call find_free_motions(scene%mesh, prescribed .or. scene%steps(step)%is_dynamic, &
      ref_nodes(scene%obstacles), contact_nodes(plan%points), motions, error, scene%constraints)
    if (allocated(error)) return
    pattern%motions = motions%n
    map = make_dof_map(scene%mesh%body, hold_pins(motions, prescribed), &
      interface_dofs(scene, plan%points), active)
    if (active%n > 0 .or. .not. allocated(start)) call coupled_nodes(scene%mesh, active, start, &
      neighbours)
    pattern%n_interface = map%n_interface
    pattern%n_schur = map%n_interface
    if (plan%choices%compliance == compliance_products) pattern%n_schur = 0
    pattern%ordering = cpu_seconds()
    call order_equations(map, start, neighbours, pattern%position, error, pattern%n_schur)
    if (allocated(error)) return
    pattern%ordering = cpu_seconds() - pattern%ordering
    call list_parts(scene%mesh, scene%materials, map, start, neighbours, pattern%k)
  end subroutine make_pattern

end module analyse_pattern_mod
