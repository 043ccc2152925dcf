!> What a run adds up to: the counters of its result file.
module tally_mod
  use kinds_mod, only: wp, i8
  use text_mod, only: string_t
  use number_list_mod, only: number_list_t, carry
  use system_mod, only: cpu_seconds, peak_memory_bytes
  use parallel_mod, only: usage_t, usage_of_others
  use increments_mod, only: increment_t
  use step_report_mod, only: step_report_t, worst_entry
  use body_solver_mod, only: solver_work_t
  use condensed_contact_mod, only: count_points, count_rows, count_matrix_entries
  use step_solver_mod, only: step_solver_t
  implicit none
  private

  public :: tally_t, add_increment, note_sizes, list_counters, carry_tally

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
    integer  :: worst_row = 0
    integer  :: equations = 0           !! the most at any time, as all of these
    integer  :: interface_equations = 0
    integer  :: contact_points = 0      !! that have rows
    integer  :: contact_rows = 0
    real(wp) :: compliance_bytes = 0.0_wp     !! of the interface
    real(wp) :: contact_matrix_bytes = 0.0_wp !! W
    real(wp) :: factor_entries = 0.0_wp
    integer(i8) :: solutions = 0        !! with the factor, of this session
    type(solver_work_t) :: work         !! of this session
    real(wp) :: file_bytes = 0.0_wp     !! of the result, when it is complete but for the counters
    real(wp) :: allowed = 0.0_wp        !! the most that a certificate entry was allowed [-]
    real(wp) :: worst = 0.0_wp          !! certificate entry [-]
    real(wp) :: unrefined = 0.0_wp      !! largest out-of-balance force before correction [-]
    real(wp) :: imbalance = 0.0_wp      !! and at the end of increments [-]
    real(wp) :: largest_strain = 0.0_wp   !! where it was computed [-]
    real(wp) :: largest_rotation = 0.0_wp !! the same [rad]
    real(wp) :: read_time = 0.0_wp      !! plan included [s], as all below
    real(wp) :: contact_time = 0.0_wp
    real(wp) :: step_time = 0.0_wp      !! advancing, contact included
    real(wp) :: write_time = 0.0_wp
    real(wp) :: estimate_time = 0.0_wp  !! of errors
    real(wp) :: total_time = 0.0_wp
    real(wp) :: earlier_time = 0.0_wp   !! of it, in sessions that this one continues
  end type tally_t

contains

  !> Count an increment that is in the file.
  subroutine add_increment(increment, report, has_fields, tally)
    type(increment_t), intent(in) :: increment
    type(step_report_t), intent(in) :: report
    logical, intent(in) :: has_fields
    type(tally_t), intent(inout) :: tally

    tally%increments = increment%row
    if (has_fields) tally%outputs = tally%outputs + 1
    if (report%certificate%certified) tally%certified = tally%certified + 1
    if (worst_entry(report%certificate) >= tally%worst) then
      tally%worst = worst_entry(report%certificate)
      tally%worst_row = increment%row
    end if
    tally%unrefined = max(tally%unrefined, report%unrefined)
    tally%imbalance = max(tally%imbalance, report%imbalance)
    tally%largest_strain = max(tally%largest_strain, report%largest_strain)
    tally%largest_rotation = max(tally%largest_rotation, report%largest_rotation)
    tally%contact_iterations = tally%contact_iterations + report%contact_iterations
    tally%products = tally%products + report%compliance_products
    if (report%solver_stages > 1) tally%fallbacks = tally%fallbacks + 1
    tally%local_iterations = tally%local_iterations + report%local_iterations
    tally%newton_raphson = tally%newton_raphson + report%newton_raphson_iterations
    tally%contact_time = tally%contact_time + report%contact_time
    tally%step_time = tally%step_time + report%wall_time
  end subroutine add_increment

  !> Keep the largest sizes that the solver has had.
  subroutine note_sizes(solver, tally)
    type(step_solver_t), intent(in) :: solver
    type(tally_t), intent(inout) :: tally

    associate (inverse => solver%body%inverse)
      tally%equations = max(tally%equations, inverse%map%n_free)
      tally%interface_equations = max(tally%interface_equations, inverse%map%n_interface)
      tally%contact_points = max(tally%contact_points, count_points(solver%contact))
      tally%contact_rows = max(tally%contact_rows, count_rows(solver%contact))
      tally%factor_entries = max(tally%factor_entries, real(inverse%factor%entries, wp))
      tally%solutions = inverse%factor%solutions
      if (allocated(inverse%compliance)) tally%compliance_bytes = max(tally%compliance_bytes, &
        8.0_wp*real(size(inverse%compliance, 1), wp)**2)
      tally%contact_matrix_bytes = max(tally%contact_matrix_bytes, &
        8.0_wp*count_matrix_entries(solver%contact))
    end associate
  end subroutine note_sizes

  !> Put what the sessions of a run add up to into the list, or take it out. The memory, the time of
  !> the processor and the work of the solver are those of one session.
  subroutine carry_tally(list, tally)
    type(number_list_t), intent(inout) :: list
    type(tally_t), intent(inout) :: tally

    call carry(list, tally%increments)
    call carry(list, tally%outputs)
    call carry(list, tally%certified)
    call carry(list, tally%cuts)
    call carry(list, tally%at_events)
    call carry(list, tally%kinks_inside)
    call carry(list, tally%touches_inside)
    call carry(list, tally%missed)
    call carry(list, tally%plan_revisions)
    call carry(list, tally%contact_iterations)
    call carry(list, tally%products)
    call carry(list, tally%fallbacks)
    call carry(list, tally%local_iterations)
    call carry(list, tally%newton_raphson)
    call carry(list, tally%worst_row)
    call carry(list, tally%equations)
    call carry(list, tally%interface_equations)
    call carry(list, tally%contact_points)
    call carry(list, tally%contact_rows)
    call carry(list, tally%compliance_bytes)
    call carry(list, tally%contact_matrix_bytes)
    call carry(list, tally%factor_entries)
    call carry(list, tally%allowed)
    call carry(list, tally%worst)
    call carry(list, tally%unrefined)
    call carry(list, tally%imbalance)
    call carry(list, tally%largest_strain)
    call carry(list, tally%largest_rotation)
    call carry(list, tally%read_time)
    call carry(list, tally%contact_time)
    call carry(list, tally%step_time)
    call carry(list, tally%write_time)
    call carry(list, tally%estimate_time)
    call carry(list, tally%total_time)
  end subroutine carry_tally

  !> Names and values of what /run/counters holds. What the plan counts has the plan's names.
  subroutine list_counters(tally, names, values)
    type(tally_t), intent(in) :: tally
    type(string_t), allocatable, intent(out) :: names(:)
    real(wp), allocatable, intent(out) :: values(:)
    integer, parameter :: room = 48
    type(string_t) :: all_names(room)
    real(wp) :: all_values(room)
    type(usage_t) :: others
    integer :: n

    n = 0
    others = usage_of_others()
    call count('increments', real(tally%increments, wp))
    call count('increments_with_fields', real(tally%outputs, wp))
    call count('equations', real(tally%equations, wp))
    call count('interface_equations', real(tally%interface_equations, wp))
    call count('contact_points', real(tally%contact_points, wp))
    call count('contact_rows', real(tally%contact_rows, wp))
    call count('factorisations', real(tally%work%n_factorisations, wp))
    call count('factor_entries', tally%factor_entries)
    call count('solutions', real(tally%solutions, wp))
    call count('newton_raphson_iterations', real(tally%newton_raphson, wp))
    call count('contact_iterations', real(tally%contact_iterations, wp))
    call count('compliance_products', real(tally%products, wp))
    call count('increments_cut', real(tally%cuts, wp))
    call count('increments_at_events', real(tally%at_events, wp))
    call count('kinks_inside_increments', real(tally%kinks_inside, wp))
    call count('first_touches_inside_increments', real(tally%touches_inside, wp))
    call count('plan_revisions', real(tally%plan_revisions, wp))
    call count('brick_stiffnesses', real(tally%work%n_stiffnesses, wp))
    call count('solver_fallbacks', real(tally%fallbacks, wp))
    call count('local_iterations', real(tally%local_iterations, wp))
    call count('unrefined_imbalance', tally%unrefined)
    call count('imbalance', tally%imbalance)
    call count('largest_strain', tally%largest_strain)
    call count('largest_rotation', tally%largest_rotation)
    call count('compliance_bytes', tally%compliance_bytes)
    call count('contact_matrix_bytes', tally%contact_matrix_bytes)
    call count('peak_memory_bytes', real(peak_memory_bytes() + others%peak, wp))
    call count('file_bytes', tally%file_bytes)
    call count('cpu_seconds', cpu_seconds() + others%cpu)
    call count('seconds_read', tally%read_time)
    associate (s => tally%work)
      call count('seconds_assemble', s%assemble)
      call count('seconds_order', s%order)
      call count('seconds_factorise', s%factorise)
      call count('seconds_condense', s%condense)
      call count('seconds_loads', s%loads)
    end associate
    call count('seconds_contact', tally%contact_time)
    call count('seconds_recover', tally%step_time - tally%contact_time)
    call count('seconds_write', tally%write_time)
    call count('seconds_estimate', tally%estimate_time)
    call count('seconds_total', tally%total_time)
    names = all_names(:n)
    values = all_values(:n)

  contains

    subroutine count(name, value)
      character(*), intent(in) :: name
      real(wp), intent(in) :: value

      n = n + 1
      all_names(n)%text = name
      all_values(n) = value
    end subroutine count

  end subroutine list_counters

end module tally_mod
