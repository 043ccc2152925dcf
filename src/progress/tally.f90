!> What a run adds up to: the counters of its result file.
module tally_mod
  use kinds_mod, only: wp, i8
  use text_mod, only: string_t
  use number_list_mod, only: number_list_t, archive
  use system_mod, only: cpu_seconds, peak_memory_bytes
  use parallel_mod, only: usage_t, usage_of_others
  use controls_mod, only: precision_controls_t
  use increments_mod, only: increment_t
  use increment_report_mod, only: increment_report_t, worst_entry, total_error, told_theory
  use theory_of_runs_mod, only: run_theory_t
  use block_diagonal_mod, only: count_entries
  use linearisation_mod, only: solver_work_t, sum_of
  use condensed_contact_mod, only: count_points, count_rows, count_matrix_entries
  use step_solver_mod, only: step_solver_t
  implicit none
  private

  public :: tally_t, add_increment, note_sizes, list_counters, carry_tally, theory_of

  !> What the run as a whole adds up to.
  type :: tally_t
    integer  :: increments = 0          !! in the file
    integer  :: outputs = 0             !! of them, with fields
    integer  :: certified = 0
    integer  :: cuts = 0                !! of increments that were not solved
    integer  :: at_events = 0           !! increments that end at events, where the deck's do not
    integer  :: kinks_inside = 0        !! of amplitudes, inside increments
    integer  :: touches_inside = 0      !! contact began from none inside an increment
    integer  :: missed = 0              !! steps whose end is not as accurate as wanted
    integer  :: plan_revisions = 0      !! points that reached what the plan held out of reach
    integer  :: contact_iterations = 0
    integer  :: products = 0            !! of the compliance with a vector
    integer  :: fallbacks = 0           !! increments that AUTO's first choice did not solve
    integer  :: local_iterations = 0
    integer  :: newton_raphson = 0
    integer  :: worst_increment = 0
    integer  :: equations = 0           !! the most at any time, as all of these
    integer  :: interface_equations = 0
    integer  :: contact_points = 0      !! that have rows
    integer  :: contact_rows = 0
    real(wp) :: compliance_bytes = 0.0_wp     !! of the interface
    real(wp) :: contact_matrix_bytes = 0.0_wp !! W
    real(wp) :: factor_entries = 0.0_wp
    integer(i8) :: solutions = 0        !! for the bodies, of this session
    integer(i8) :: body_iterations = 0  !! on all their unknowns, of this session
    type(solver_work_t) :: work         !! of this session
    type(solver_work_t) :: on_tangents  !! likewise, of tangents at finite strain
    type(precision_controls_t) :: precision !! of its last increment
    real(wp) :: file_bytes = 0.0_wp     !! of the result, when it is complete but for the counters
    real(wp) :: allowed = 0.0_wp        !! the most that a certificate entry was allowed [-]
    real(wp) :: worst = 0.0_wp          !! certificate entry [-]
    real(wp) :: unrefined = 0.0_wp      !! largest out-of-balance force before correction [-]
    real(wp) :: imbalance = 0.0_wp      !! and at the end of increments [-]
    real(wp) :: largest_strain = 0.0_wp   !! where it was computed [-]
    real(wp) :: largest_rotation = 0.0_wp !! the same [rad]
    real(wp) :: theory = 0.0_wp           !! the largest error of small strain, at ends of steps [-]
    real(wp) :: largest_stress = 0.0_wp   !! of *ELASTIC, of Young's modulus, likewise [-]
    real(wp) :: of_law(2) = 0.0_wp        !! with the deck's law, and with another one [-]
    real(wp) :: law = 0.0_wp              !! and by a law that the deck leaves open [-]
    integer  :: follows_theory = 0        !! ends of steps where these are estimates, not bounds
    real(wp) :: with_theory = 0.0_wp      !! the largest error of all sources, where it is known [-]
    real(wp) :: mesh = 0.0_wp             !! the largest error by the mesh, at ends of steps [-]
    real(wp) :: load_steps = 0.0_wp       !! and by load steps, where it is known [-]
    real(wp) :: read_time = 0.0_wp      !! plan included [s], as all below
    real(wp) :: contact_time = 0.0_wp
    real(wp) :: step_time = 0.0_wp      !! advancing, contact included
    real(wp) :: write_time = 0.0_wp
    real(wp) :: certify_time = 0.0_wp   !! of it, in the certificate
    real(wp) :: estimate_time = 0.0_wp  !! of errors
    real(wp) :: total_time = 0.0_wp
    real(wp) :: earlier_time = 0.0_wp   !! of it, in sessions that this one continues
  end type tally_t

  integer, parameter :: most_counters = 64

  !> Counters with their names.
  type :: counters_t
    integer :: n = 0
    type(string_t) :: names(most_counters)
    real(wp) :: values(most_counters) = 0.0_wp
  end type counters_t

contains

  !> Count an increment that is in the file.
  subroutine add_increment(increment, report, has_fields, tally)
    type(increment_t), intent(in) :: increment
    type(increment_report_t), intent(in) :: report
    logical, intent(in) :: has_fields
    type(tally_t), intent(inout) :: tally

    tally%increments = increment%index
    if (has_fields) tally%outputs = tally%outputs + 1
    if (report%certificate%certified) tally%certified = tally%certified + 1
    if (worst_entry(report%certificate) >= tally%worst) then
      tally%worst = worst_entry(report%certificate)
      tally%worst_increment = increment%index
    end if
    tally%unrefined = max(tally%unrefined, report%unrefined)
    tally%imbalance = max(tally%imbalance, report%imbalance)
    tally%largest_strain = max(tally%largest_strain, report%largest_strain)
    tally%largest_rotation = max(tally%largest_rotation, report%largest_rotation)
    tally%theory = max(tally%theory, report%errors%theory)
    tally%largest_stress = max(tally%largest_stress, report%largest_stress)
    if (increment%last_of_step) then
      tally%mesh = max(tally%mesh, report%errors%mesh)
      tally%load_steps = max(tally%load_steps, report%errors%load_steps)
    end if
    tally%of_law = max(tally%of_law, report%errors%of_law)
    tally%law = max(tally%law, report%errors%law)
    if (total_error(report%errors) >= 0.0_wp) tally%with_theory = max(tally%with_theory, &
      total_error(report%errors) + max(0.0_wp, report%errors%theory))
    if (report%errors%follows_theory) tally%follows_theory = tally%follows_theory + 1
    tally%contact_iterations = tally%contact_iterations + report%contact_iterations
    tally%products = tally%products + report%compliance_products
    if (report%solver_stages > 1) tally%fallbacks = tally%fallbacks + 1
    tally%local_iterations = tally%local_iterations + report%local_iterations
    tally%newton_raphson = tally%newton_raphson + report%newton_raphson_iterations
    tally%contact_time = tally%contact_time + report%contact_time
    tally%step_time = tally%step_time + report%wall_time
    tally%certify_time = tally%certify_time + report%certify_time
  end subroutine add_increment

  !> What small strain leaves out of the run.
  pure type(run_theory_t) function theory_of(tally)
    type(tally_t), intent(in) :: tally

    theory_of = run_theory_t(tally%theory, tally%follows_theory > 0, tally%of_law, tally%law)
  end function theory_of

  !> Keep the largest sizes that the solver has had.
  subroutine note_sizes(solver, tally)
    type(step_solver_t), intent(in) :: solver
    type(tally_t), intent(inout) :: tally

    associate (inverse => solver%body%inverse)
      tally%equations = max(tally%equations, inverse%map%n_free)
      tally%interface_equations = max(tally%interface_equations, inverse%map%n_interface)
      tally%factor_entries = max(tally%factor_entries, real(inverse%factor%entries, wp))
      tally%solutions = inverse%factor%solutions
      tally%on_tangents = solver%on_tangents
      tally%compliance_bytes = max(tally%compliance_bytes, &
        8.0_wp*count_entries(inverse%compliance))
      if (allocated(inverse%iterative)) then
        tally%solutions = tally%solutions + inverse%iterative%solutions
        tally%body_iterations = inverse%iterative%iterations
      end if
    end associate
    ! A stiffness that could not be factorised has left no contact problem.
    if (.not. allocated(solver%contact%group)) return
    tally%contact_points = max(tally%contact_points, count_points(solver%contact))
    tally%contact_rows = max(tally%contact_rows, count_rows(solver%contact))
    tally%contact_matrix_bytes = max(tally%contact_matrix_bytes, &
      8.0_wp*count_matrix_entries(solver%contact))
  end subroutine note_sizes

  !> Put what the sessions of a run add up to into the list, or take it out. The memory, the time of
  !> the processor and the work of the solver are those of one session.
  subroutine carry_tally(list, tally)
    type(number_list_t), intent(inout) :: list
    type(tally_t), intent(inout) :: tally

    call go_over(tally, list=list)
  end subroutine carry_tally

  !> Names and values of what /run/counters holds. What the plan counts has the plan's names.
  subroutine list_counters(tally, names, values)
    type(tally_t), intent(in) :: tally
    type(string_t), allocatable, intent(out) :: names(:)
    real(wp), allocatable, intent(out) :: values(:)
    type(tally_t) :: copy
    type(counters_t) :: counters

    copy = tally
    call go_over(copy, counters=counters)
    names = counters%names(:counters%n)
    values = counters%values(:counters%n)
  end subroutine list_counters

  !> Go over all that a run adds up to, a line each: archive it, or list it under its name.
  subroutine go_over(tally, list, counters)
    type(tally_t), intent(inout) :: tally
    type(number_list_t), intent(inout), optional :: list     !! to archive it
    type(counters_t), intent(inout), optional :: counters    !! to list it
    type(usage_t) :: others
    type(solver_work_t) :: work
    logical :: lists

    lists = present(counters)
    ! Counted, from session to session.
    call whole('increments', tally%increments)
    call whole('increments_with_fields', tally%outputs)
    call whole('equations', tally%equations)
    call whole('interface_equations', tally%interface_equations)
    call whole('contact_points', tally%contact_points)
    call whole('contact_rows', tally%contact_rows)
    work = sum_of(tally%work, tally%on_tangents)
    if (lists) call add('factorisations', real(work%n_factorisations, wp))
    call amount('factor_entries', tally%factor_entries)
    if (lists) call add('solutions', real(tally%solutions, wp))
    if (lists) call add('body_iterations', real(tally%body_iterations, wp))
    call whole('newton_raphson_iterations', tally%newton_raphson)
    call whole('contact_iterations', tally%contact_iterations)
    call whole('compliance_products', tally%products)
    call whole('increments_cut', tally%cuts)
    call whole('increments_at_events', tally%at_events)
    call whole('kinks_inside_increments', tally%kinks_inside)
    call whole('first_touches_inside_increments', tally%touches_inside)
    call whole('plan_revisions', tally%plan_revisions)
    if (lists) call add('element_stiffnesses', real(work%n_stiffnesses, wp))
    call whole('solver_fallbacks', tally%fallbacks)
    call whole('local_iterations', tally%local_iterations)
    call amount('unrefined_imbalance', tally%unrefined)
    call amount('imbalance', tally%imbalance)
    call amount('largest_strain', tally%largest_strain)
    call amount('largest_rotation', tally%largest_rotation)
    if (present(list)) call archive(list, tally%theory)
    if (lists) call add('largest_small_strain_error', told_theory(tally%theory, &
      tally%follows_theory > 0))
    call amount('largest_law_error', tally%law)
    call amount('certificate_tolerance', tally%allowed)
    call amount('compliance_bytes', tally%compliance_bytes)
    call amount('contact_matrix_bytes', tally%contact_matrix_bytes)
    if (lists) then
      others = usage_of_others()
      call add('peak_memory_bytes', real(peak_memory_bytes() + others%peak, wp))
      call add('file_bytes', tally%file_bytes)
      call add('cpu_seconds', cpu_seconds() + others%cpu)
    end if
    call amount('seconds_read', tally%read_time)
    if (lists) then
      call add('seconds_assemble', work%assemble)
      call add('seconds_order', work%order)
      call add('seconds_factorise', work%factorise)
      call add('seconds_condense', work%condense)
      call add('seconds_loads', work%loads)
    end if
    call amount('seconds_contact', tally%contact_time)
    if (lists) call add('seconds_recover', tally%step_time - tally%contact_time - &
      tally%certify_time)
    call amount('seconds_certify', tally%certify_time)
    call amount('seconds_write', tally%write_time)
    call amount('seconds_estimate', tally%estimate_time)
    call amount('seconds_total', tally%total_time)
    ! Not counted.
    if (.not. present(list)) return
    call archive(list, tally%certified)
    call archive(list, tally%missed)
    call archive(list, tally%follows_theory)
    call archive(list, tally%with_theory)
    call archive(list, tally%mesh)
    call archive(list, tally%load_steps)
    call archive(list, tally%largest_stress)
    call archive(list, tally%of_law(1))
    call archive(list, tally%of_law(2))
    call archive(list, tally%worst)
    call archive(list, tally%worst_increment)
    call archive(list, tally%step_time)

  contains

    subroutine whole(name, value)
      character(*), intent(in) :: name
      integer, intent(inout) :: value

      if (present(list)) call archive(list, value)
      if (lists) call add(name, real(value, wp))
    end subroutine whole

    subroutine amount(name, value)
      character(*), intent(in) :: name
      real(wp), intent(inout) :: value

      if (present(list)) call archive(list, value)
      if (lists) call add(name, value)
    end subroutine amount

    subroutine add(name, value)
      character(*), intent(in) :: name
      real(wp), intent(in) :: value

      counters%n = counters%n + 1
      counters%names(counters%n)%text = name
      counters%values(counters%n) = value
    end subroutine add

  end subroutine go_over

end module tally_mod
