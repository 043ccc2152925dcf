!> The group /history of a result file: a row an increment, of numbers that concern the whole body.
module result_history_mod
  use kinds_mod, only: i1, i4, i8
  use errors_mod, only: error_t
  use hdf5_files_mod, only: hdf5_file_t
  use hdf5_attributes_mod, only: write_attribute, write_and_flush, describe_group
  use hdf5_rows_mod, only: rows_t, create_rows, keep_rows, append_row
  use hdf5_types_mod, only: of_real, of_integer, of_byte
  use state_mod, only: state_t
  use increments_mod, only: is_extra
  use step_report_mod, only: step_report_t, total_error
  implicit none
  private

  public :: history_t, create_history, append_history, finish_row

  !> The open datasets of the group.
  type :: history_t
    type(rows_t) :: step, increment, time, extra, certified
    type(rows_t) :: contact_iterations, local_iterations, newton_raphson_iterations
    type(rows_t) :: compliance_products, solver_stages, free_motions
    type(rows_t) :: solver, residual, worst_node, wall_time, contact_time
    type(rows_t) :: penetration, adhesion, complementarity, cone, law, equilibrium
    type(rows_t) :: body_balance, support
    type(rows_t) :: face_penetration, face_penetration_on_way
    type(rows_t) :: external_work, strain, dissipation, balance
    type(rows_t) :: error_contact, error_load_steps, error_mesh, error_arithmetic, error_total
  end type history_t

contains

  subroutine create_history(file, n_rows, history, error)
    type(hdf5_file_t), intent(in) :: file
    integer, intent(in) :: n_rows !! that the file has already, of a run that is continued
    type(history_t), intent(out) :: history
    type(error_t), allocatable, intent(out) :: error

    call describe_group(file, '/history', &
      'a row an increment; rows beyond "finished" do not count', &
      error)
    call write_attribute(file, '/history', 'finished', int(n_rows, i8), error)
    call integers('step', 'ordinal of the *STEP', history%step)
    call integers('increment', 'number of the increment within its step', history%increment)
    call reals('time', 'time from the start of the run, at the end of the increment', 'time', &
               history%time)
    call bytes('extra', '1: the increment ends where none of the deck does', history%extra)
    call bytes('certified', '1: every entry of the certificate is small enough', history%certified)
    call integers('contact_iterations', 'sweeps over all points, or iterations of the global '// &
                  'Newton method', history%contact_iterations)
    call integers('local_iterations', 'iterations of the local solver, summed over points and '// &
                  'sweeps', history%local_iterations)
    call integers('compliance_products', &
      'products of the compliance with a vector; a sweep counts '// &
                  'as one', history%compliance_products)
    call integers('solver_stages', &
      'solvers that were tried one after the other: 1 when the first '// &
                  'reached the tolerance', history%solver_stages)
    call integers('free_motions', 'rigid motions of bodies and obstacles that nothing holds', &
                  history%free_motions)
    call integers('newton_raphson_iterations', 'equilibrium iterations', &
                  history%newton_raphson_iterations)
    call bytes('solver', '0: none was needed, 1: sweeps, 2: global Newton', history%solver)
    call reals('residual', 'scaled natural map at the end of the contact solver', 'ratio', &
               history%residual)
    call integers('worst_node', 'index into Points, from 0, of the point with the largest '// &
                  'residual; -1: none', history%worst_node)
    call reals('wall_time', 'time the increment took', 'seconds', history%wall_time)
    call reals('contact_time', 'of it, in the contact solver', 'seconds', history%contact_time)

    call reals('face_penetration', 'deepest penetration of an obstacle into a slave face '// &
               'between its nodes, at the end of the increment', 'length', &
               history%face_penetration)
    call reals('face_penetration_on_way', 'the same before the end of the increment, where no '// &
               'node touches nearby', 'length', history%face_penetration_on_way)

    call describe_group(file, '/history/certificate', &
      'errors found by a check that shares nothing with the solvers', error)
    call reals('certificate/penetration', 'deepest penetration', 'ratio', history%penetration)
    call reals('certificate/adhesion', 'largest tension between the bodies', 'ratio', &
               history%adhesion)
    call reals('certificate/complementarity', 'largest product of gap and normal reaction', &
               'ratio', history%complementarity)
    call reals('certificate/cone', 'largest friction force beyond the cone', 'ratio', history%cone)
    call reals('certificate/law', 'largest departure from the direction and size of sliding '// &
               'friction', 'ratio', history%law)
    call reals('certificate/equilibrium', 'largest force out of balance', 'ratio', &
               history%equilibrium)
    call reals('certificate/balance', 'largest force or moment left over on a whole body or '// &
               'obstacle', 'ratio', history%body_balance)
    call reals('certificate/support', 'largest departure from a prescribed displacement', &
               'ratio', history%support)

    call describe_group(file, '/history/energy', 'energies from the start of the run', error)
    call reals('energy/external_work', 'work of loads and supports', 'energy', &
               history%external_work)
    call reals('energy/strain', 'elastic energy of the bodies', 'energy', history%strain)
    call reals('energy/dissipation', 'work lost to friction', 'energy', history%dissipation)
    call reals('energy/balance', 'work less strain less dissipation: of the order of the '// &
               'increment', 'energy', history%balance)

    call describe_group(file, '/history/error', &
      'estimated errors; -1 where there is no estimate', error)
    call reals('error/contact', 'largest entry of the certificate but equilibrium', 'ratio', &
               history%error_contact)
    call reals('error/load_steps', 'difference of the contact resultants from those with '// &
               'increments of another size', 'ratio', history%error_load_steps)
    call reals('error/mesh', 'error of the stresses by recovery, squared, over the energy of '// &
               'the stresses', 'ratio', history%error_mesh)
    call reals('error/arithmetic', 'forces out of balance, and rounding times the condition', &
               'ratio', history%error_arithmetic)
    call reals('error/total', 'sum of the parts', 'ratio', history%error_total)

  contains

    subroutine reals(name, description, quantity, rows)
      character(*), intent(in) :: name, description, quantity
      type(rows_t), intent(out) :: rows

      call create_rows(file, '/history/'//name, of_real, [integer ::], description, quantity, &
                       rows, error)
      call keep_rows(rows, n_rows, error)
    end subroutine reals

    subroutine integers(name, description, rows)
      character(*), intent(in) :: name, description
      type(rows_t), intent(out) :: rows

      call create_rows(file, '/history/'//name, of_integer, [integer ::], description, 'number', &
                       rows, error)
      call keep_rows(rows, n_rows, error)
    end subroutine integers

    subroutine bytes(name, description, rows)
      character(*), intent(in) :: name, description
      type(rows_t), intent(out) :: rows

      call create_rows(file, '/history/'//name, of_byte, [integer ::], description, 'code', &
                       rows, error)
      call keep_rows(rows, n_rows, error)
    end subroutine bytes

  end subroutine create_history

  subroutine append_history(history, state, report, worst_node, checksum, error)
    type(history_t), intent(inout) :: history
    type(state_t), intent(in) :: state
    type(step_report_t), intent(in) :: report
    integer, intent(in) :: worst_node !! from 1, 0: none
    integer(i8), intent(inout) :: checksum !! of the increment, to which that of every row is added
    type(error_t), allocatable, intent(inout) :: error

    call append_row(history%step, int(state%step, i4), checksum, error)
    call append_row(history%increment, int(state%increment, i4), checksum, error)
    call append_row(history%time, state%time, checksum, error)
    call append_row(history%extra, merge(1_i1, 0_i1, is_extra(state%position)), checksum, error)
    call append_row(history%certified, merge(1_i1, 0_i1, report%certificate%certified), &
      checksum, error)
    call append_row(history%contact_iterations, int(report%contact_iterations, i4), checksum, error)
    call append_row(history%local_iterations, int(report%local_iterations, i4), checksum, error)
    call append_row(history%compliance_products, int(report%compliance_products, i4), &
      checksum, error)
    call append_row(history%solver_stages, int(report%solver_stages, i4), checksum, error)
    call append_row(history%free_motions, int(report%n_unheld, i4), checksum, error)
    call append_row(history%newton_raphson_iterations, &
                    int(report%newton_raphson_iterations, i4), checksum, error)
    call append_row(history%solver, int(report%solver, i1), checksum, error)
    call append_row(history%residual, report%residual, checksum, error)
    call append_row(history%worst_node, int(worst_node - 1, i4), checksum, error)
    call append_row(history%wall_time, report%wall_time, checksum, error)
    call append_row(history%contact_time, report%contact_time, checksum, error)

    call append_row(history%face_penetration, report%face_penetration, checksum, error)
    call append_row(history%face_penetration_on_way, report%face_penetration_on_way, checksum, &
      error)

    associate (certificate => report%certificate, energy => report%energy)
      call append_row(history%penetration, certificate%penetration, checksum, error)
      call append_row(history%adhesion, certificate%adhesion, checksum, error)
      call append_row(history%complementarity, certificate%complementarity, checksum, error)
      call append_row(history%cone, certificate%cone, checksum, error)
      call append_row(history%law, certificate%law, checksum, error)
      call append_row(history%equilibrium, certificate%equilibrium, checksum, error)
      call append_row(history%body_balance, certificate%balance, checksum, error)
      call append_row(history%support, certificate%support, checksum, error)
      call append_row(history%external_work, energy%external_work, checksum, error)
      call append_row(history%strain, energy%strain, checksum, error)
      call append_row(history%dissipation, energy%dissipation, checksum, error)
      call append_row(history%balance, energy%balance, checksum, error)
      call append_row(history%error_contact, report%errors%contact, checksum, error)
      call append_row(history%error_load_steps, report%errors%load_steps, checksum, error)
      call append_row(history%error_mesh, report%errors%mesh, checksum, error)
      call append_row(history%error_arithmetic, report%errors%arithmetic, checksum, error)
      call append_row(history%error_total, total_error(report%errors), checksum, error)
    end associate
  end subroutine append_history

  !> Tell readers that they may read this many rows: to be called when they are on disk.
  subroutine finish_row(file, n_rows, error)
    type(hdf5_file_t), intent(in) :: file
    integer, intent(in) :: n_rows
    type(error_t), allocatable, intent(inout) :: error

    call write_and_flush(file, '/history', 'finished', int(n_rows, i8), error)
  end subroutine finish_row

end module result_history_mod
