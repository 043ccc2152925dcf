!> What the run solves for its bodies with: a factor or iteration, and whether W is formed.
module choose_body_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t
  use text_mod, only: to_text
  use obstacles_mod, only: ref_nodes
  use contact_points_mod, only: contact_nodes
  use scene_mod, only: scene_t
  use controls_mod, only: precision_controls_t, compliance_auto, compliance_dense, &
    compliance_products
  use plan_mod, only: plan_t
  use new_iterative_body_mod, only: has_iterative_body
  use sparse_factor_mod, only: sparse_factor_t
  use rigid_modes_mod, only: free_motions_t, find_free_motions
  use step_loads_mod, only: prescribed_dofs
  use count_sizes_mod, only: sizes_t
  use estimate_iterative_mod, only: check_iterative, iterative_bytes
  use estimate_file_mod, only: file_size_t
  use estimate_memory_mod, only: take_precision, needed_memory, enough
  use estimate_time_mod, only: seconds_at_fixed_rates
  use make_plan_mod, only: forget_compliance
  use analyse_pattern_mod, only: look_at_pattern
  use amounts_mod, only: bytes_in_words
  use plan_table_mod, only: describe_products, describe_iterative
  implicit none
  private

  public :: choose_body

  real(wp), parameter :: least_interface = 1000.0_wp !! numbers of it from which on W has a price
  real(wp), parameter :: iteration_pays = 0.5_wp
  !! of the time with a factor, up to which bodies are solved for by iteration: a factor has more
  !! solvers of contact to fall back on
  real(wp), parameter :: least_factor = 0.7_wp !! of that with the interface last: the least without

contains

  !> Whether there is a factor: where the deck leaves it open and the build has the choice, as long
  !> as it fits and iteration does not take much less time.
  subroutine choose_body(scene, file, plan, factor, sizes, reasons, error)
    type(scene_t), intent(in) :: scene
    type(file_size_t), intent(in) :: file
    type(plan_t), intent(inout) :: plan    !! gets precision and compliance
    type(sparse_factor_t), intent(inout) :: factor
    type(sizes_t), intent(inout) :: sizes
    character(:), allocatable, intent(out) :: reasons
    type(error_t), allocatable, intent(out) :: error
    type(free_motions_t) :: motions
    type(precision_controls_t) :: iterated
    type(error_t), allocatable :: refusal
    type(sizes_t) :: bare
    real(wp) :: need, by_factor, by_iteration
    logical :: fits

    bare = sizes
    bare%is_dense = .false.
    reasons = ''
    need = 0.0_wp
    fits = .false.
    if (.not. plan%choices%precision%iterative) then
      call choose_compliance(scene, file, plan, factor, sizes, reasons, error)
      if (allocated(error)) return
      if (plan%choices%precision%body_is_given .or. .not. has_iterative_body()) return
      need = needed_memory(sizes, file)
      fits = need <= enough*real(plan%memory_left, wp)
      if (fits .and. .not. plan%is_analysed) return
    end if
    call find_free_motions(scene%mesh, prescribed_dofs(scene, 1), ref_nodes(scene%obstacles), &
      contact_nodes(plan%points), motions, error, scene%constraints)
    if (allocated(error)) return
    bare%motions = motions%n
    if (plan%choices%precision%iterative) then
      call check_iterative(scene, plan%choices%compliance, plan%points, motions, error)
      if (allocated(error)) return
    else
      call check_iterative(scene, compliance_products, plan%points, motions, refusal)
      if (allocated(refusal)) return
      iterated = plan%choices%precision
      iterated%iterative = .true.
      iterated%single_factor = .false.
      iterated%block_low_rank = 0.0_wp
      iterated%out_of_core = .false.
      call size_iterated(iterated, bare)
      if (needed_memory(bare, file) > merge(enough*real(plan%memory_left, wp), need, fits)) return
      if (fits) then
        by_factor = seconds_at_fixed_rates(sizes)
        by_iteration = seconds_at_fixed_rates(bare)
        if (by_iteration > iteration_pays*by_factor) return
        reasons = 'a share of '//to_text(by_iteration/by_factor, 2)//' of the time with a factor'
      else
        reasons = 'with a factor the run needs '//bytes_in_words(need)
      end if
      plan%choices%precision = iterated
    end if
    plan%choices%compliance = compliance_products
    call size_iterated(plan%choices%precision, bare)
    sizes = bare
    plan%is_analysed = .true.
    call forget_compliance(plan)
    call describe_iterative(plan)
  end subroutine choose_body

  !> The sizes of a run without a factor.
  pure subroutine size_iterated(precision, sizes)
    type(precision_controls_t), intent(in) :: precision !! iterative
    type(sizes_t), intent(inout) :: sizes

    sizes%factor = 0.0_wp
    call take_precision(precision, sizes)
    sizes%workspace = iterative_bytes(sizes)
  end subroutine size_iterated

  !> Whether W is formed: where the deck leaves it open, as its figures say.
  !>
  !> A product by the factor cannot cost less than the factor of the interior alone takes to read:
  !> where so many readings already take longer than all that W costs, that is the answer, and the
  !> other order of elimination is not looked for.
  subroutine choose_compliance(scene, file, plan, factor, sizes, reasons, error)
    type(scene_t), intent(in) :: scene
    type(file_size_t), intent(in) :: file
    type(plan_t), intent(inout) :: plan    !! gets precision and compliance
    type(sparse_factor_t), intent(inout) :: factor
    type(sizes_t), intent(inout) :: sizes
    character(:), allocatable, intent(out) :: reasons
    type(error_t), allocatable, intent(out) :: error
    type(precision_controls_t) :: given
    type(sizes_t) :: of_dense, bare
    real(wp) :: by_dense, by_products
    character(:), allocatable :: why

    bare = sizes
    why = 'as the deck asks for'
    if (plan%choices%compliance == compliance_auto .and. sizes%interface < least_interface) then
      plan%choices%compliance = compliance_dense
    else if (plan%choices%compliance == compliance_auto) then
      plan%choices%compliance = compliance_dense
      if (8.0_wp*(sizes%squares + sizes%rows**2) > enough*real(plan%memory_left, wp)) then
        plan%choices%compliance = compliance_products
        why = 'dense it does not fit'
      else
        given = plan%choices%precision
        call look_at_pattern(scene, file, plan, factor, sizes, reasons, error)
        if (allocated(error) .or. .not. plan%is_analysed) return
        by_dense = seconds_at_fixed_rates(sizes)
        of_dense = sizes
        sizes%is_dense = .false.
        ! Without numbers yet: the factor of the interior, which is the least of it.
        sizes%factor = least_factor*sizes%factor
        sizes%flops = 0.0_wp
        by_products = seconds_at_fixed_rates(sizes)
        sizes = of_dense
        if (by_products >= by_dense) return
        plan%choices%precision = given
        plan%choices%compliance = compliance_products
        sizes = bare
        call look_at_pattern(scene, file, plan, factor, sizes, reasons, error)
        if (allocated(error)) return
        by_products = seconds_at_fixed_rates(sizes)
        sizes%ordering = sizes%ordering + of_dense%ordering
        if (by_products < by_dense) then
          call forget_compliance(plan)
          call describe_products(plan, 'a share of '//to_text(by_products/by_dense, 2)// &
            ' of the time that it takes dense')
          return
        end if
        plan%choices%precision = given
        plan%choices%compliance = compliance_dense
        sizes = bare
      end if
    end if
    call look_at_pattern(scene, file, plan, factor, sizes, reasons, error)
    if (plan%choices%compliance /= compliance_products) return
    call forget_compliance(plan)
    call describe_products(plan, why)
  end subroutine choose_compliance

end module choose_body_mod
