!> The fields of /history: a number an increment, of what concerns the whole body.
!>
!> Each is one entry here. Its number stands in it, as an expression of the increment.
module history_fields_mod
  use kinds_mod, only: wp
  use dataset_kinds_mod, only: of_real, of_integer, of_byte
  use mesh_mod, only: mesh_t
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t
  use increments_mod, only: is_extra
  use increment_report_mod, only: increment_report_t, total_error, count_redundant, told_theory
  use output_field_mod, only: field_t, field_list_t, add_field, get_fields
  implicit none
  private

  public :: list_history_fields, plan_history_fields

contains

  !> The histories before there is an increment: their numbers mean nothing.
  subroutine plan_history_fields(fields, moves)
    type(field_t), allocatable, intent(out) :: fields(:)
    logical, intent(in) :: moves !! as of list_history_fields
    type(state_t) :: state
    type(increment_report_t) :: report
    type(mesh_t) :: mesh
    type(contact_points_t) :: points

    call list_history_fields(state, report, mesh, points, fields, moves)
  end subroutine plan_history_fields

  !> The histories, with the numbers of an increment.
  subroutine list_history_fields(state, report, mesh, points, fields, moves)
    type(state_t), intent(in) :: state !! at the end of the increment
    type(increment_report_t), intent(in) :: report
    type(mesh_t), intent(in) :: mesh
    type(contact_points_t), intent(in) :: points
    type(field_t), allocatable, intent(out) :: fields(:)
    logical, intent(in) :: moves !! a *STEP is dynamic
    type(field_list_t) :: list
    integer :: one_number(0) ! extents; gfortran 12 does not allocate them from a constant
    integer :: worst_node

    worst_node = 0
    if (report%worst_point > 0) worst_node = count(mesh%element_nodes <= &
      points%node(report%worst_point))

    call whole('step', 'ordinal of the *STEP', state%step)
    call whole('increment', 'number of the increment within its step', state%increment)
    call real_number('time', 'time from the start of the run, at the end of the increment', &
      'time', state%time)
    call code('extra', '1: the increment ends where none of the deck does', &
      merge(1, 0, is_extra(state%position)))
    call code('certified', '1: every entry of the certificate is small enough', &
      merge(1, 0, report%certificate%certified))
    call whole('contact_iterations', 'sweeps over all points, or iterations of Newton''s '// &
      'method', report%contact_iterations)
    call whole('local_iterations', 'iterations of the local solver, summed over points and '// &
      'sweeps', report%local_iterations)
    call whole('compliance_products', 'products of the compliance with a vector; a sweep '// &
      'counts as one', report%compliance_products)
    call whole('solver_stages', 'solvers that were tried one after the other: 1 when the first '// &
      'reached the tolerance', report%solver_stages)
    call whole('free_motions', 'rigid motions of bodies and obstacles that nothing holds', &
      report%n_unheld)
    call whole('redundant_points', 'contact points whose reactions are not determined, for '// &
      'constraints can carry them', count_redundant(report%contact))
    call whole('newton_raphson_iterations', 'equilibrium iterations', &
      report%newton_raphson_iterations)
    call whole('tangents', 'tangents at finite strain that were factorised for the increment, '// &
      'attempts that failed included', report%tangents)
    call code('solver', '0: none was needed, 1: sweeps, 2: global Newton', report%solver)
    call real_number('residual', 'scaled natural map at the end of the contact solver', 'ratio', &
      report%residual)
    call whole('worst_node', 'index into Points, from 0, of the point with the largest '// &
      'residual; -1: none', worst_node - 1)
    call real_number('wall_time', 'time the increment took, but for factorisations', 'seconds', &
      report%wall_time)
    call real_number('contact_time', 'of it, in the contact solver', 'seconds', &
      report%contact_time)
    call real_number('face_penetration', 'deepest penetration of a master into a slave face '// &
      'between its nodes, at the end of the increment', 'length', report%face_penetration)
    call real_number('face_penetration_on_way', 'the same before the end of the increment, '// &
      'where no node touches nearby, or the master leaves', 'length', &
      report%face_penetration_on_way)
    call code('load_cycle', '0: no load cycle ends here that is compared, 1: one does, and '// &
      'differs from the cycle before, 2: one does, and has settled', report%load_cycle)
    call real_number('load_cycle_change', 'largest change of displacements, contact forces and '// &
      'slips from the end of the cycle before, of their change within the cycle; negative: no '// &
      'cycle is compared', 'ratio', report%load_cycle_change)

    associate (c => report%certificate)
      call ratio('certificate/penetration', 'deepest penetration', c%penetration)
      call ratio('certificate/adhesion', 'largest tension between the bodies', c%adhesion)
      call ratio('certificate/complementarity', 'largest product of gap and normal reaction', &
        c%complementarity)
      call ratio('certificate/cone', 'largest friction force beyond the cone', c%cone)
      call ratio('certificate/law', 'largest departure from the direction and size of sliding '// &
        'friction', c%law)
      call ratio('certificate/equilibrium', 'largest force out of balance', c%equilibrium)
      call ratio('certificate/balance', 'largest force or moment left over on a whole body or '// &
        'obstacle', c%balance)
      call ratio('certificate/support', 'largest departure from a prescribed displacement', &
        c%support)
      call ratio('certificate/energy', 'strain energy less half the work of all nodal forces '// &
        'at the same state, of the largest term', c%energy)
      call ratio('certificate/undetermined', 'largest reaction that equilibrium does not '// &
        'determine, of the largest load or force of an element', c%undetermined)
      call ratio('certificate/dissipation', 'largest work that friction does instead of losing '// &
        'it', c%dissipation)
    end associate

    associate (e => report%energy, parts => mesh%parts)
      call real_number('energy/external_work', 'work of loads and supports', 'energy', &
        parts*e%external_work)
      call real_number('energy/strain', 'elastic energy of the bodies', 'energy', parts*e%strain)
      call real_number('energy/dissipation', 'work lost to friction', 'energy', &
        parts*e%dissipation)
      if (moves) then
        call real_number('energy/kinetic', 'kinetic energy of the bodies', 'energy', &
          parts*e%kinetic)
        call real_number('energy/contact', 'work of normal forces along gaps that change: none '// &
          'in nature', 'energy', parts*e%contact)
        call real_number('energy/damped', 'work lost to *DAMPING', 'energy', parts*e%damped)
        call real_number('energy/balance', 'energy that the scheme in time has taken: kinetic '// &
          'energy at the beginning, work of loads, supports and contact, minus kinetic and '// &
          'elastic energy and what friction and damping have taken', 'energy', parts*e%balance)
        call ratio('error/in_time', 'error of the increment by its length, beside the energy; '// &
          '-1: no dynamic increment', report%in_time)
        call ratio('error/angular_momentum', 'angular momentum of a body that no torque '// &
          'explains, of what the largest energy would give it', e%turned)
      else
        call real_number('energy/balance', 'work less strain less dissipation: of the order of '// &
          'the increment', 'energy', parts*e%balance)
      end if
    end associate

    associate (e => report%errors)
      call ratio('error/contact', 'largest entry of the certificate but equilibrium', e%contact)
      call ratio('error/load_steps', 'difference of the contact resultants from those with '// &
        'increments of another size', e%load_steps)
      call ratio('error/mesh', 'error of the stresses by recovery, squared, over the energy of '// &
        'the stresses', e%mesh)
      call ratio('error/geometry', 'change of the contact resultants by the geometry of faces '// &
        'where meshes do not match, at the end of a step: the sum of the next three', e%geometry)
      call ratio('error/between_nodes', 'of it by faces that are entered between their nodes, '// &
        'or stay flat where bodies bend', e%between_nodes)
      call ratio('error/at_edges', 'of it by edges of one side within faces of the other', &
        e%at_edges)
      call ratio('error/of_facets', 'of it by flat faces that stand for arcs', e%of_facets)
      call ratio('error/arithmetic', 'forces out of balance, and rounding times the condition', &
        e%arithmetic)
      call ratio('error/small_strain', 'what finite strain would change, at the end of a '// &
        'step: a bound or an estimate, as small_strain_is of the group says; above 1e300: not '// &
        'known', told_theory(e%theory, e%follows_theory))
      call ratio('error/small_strain_deck_law', 'the estimate with the deck''s law, which of '// &
        '*ELASTIC is St Venant-Kirchhoff''s', e%of_law(1))
      call ratio('error/small_strain_other_law', 'the estimate where *ELASTIC is neo-Hooke''s '// &
        'law', e%of_law(2))
      call ratio('error/law', 'what the law that *ELASTIC leaves open makes at finite strain', &
        e%law)
      call ratio('error/total', 'contact, load steps, arithmetic, and the root of the '// &
        'squares of mesh and geometry, or what is left where these have opposite signs', &
        total_error(e))
    end associate
    call get_fields(list, fields)

  contains

    subroutine real_number(name, description, quantity, value)
      character(*), intent(in) :: name, description, quantity
      real(wp), intent(in) :: value

      call add_field(list, field_t(name, of_real, one_number, quantity, description, value=value))
    end subroutine real_number

    subroutine ratio(name, description, value)
      character(*), intent(in) :: name, description
      real(wp), intent(in) :: value

      call real_number(name, description, 'ratio', value)
    end subroutine ratio

    subroutine whole(name, description, value)
      character(*), intent(in) :: name, description
      integer, intent(in) :: value

      call add_field(list, field_t(name, of_integer, one_number, 'number', description, &
        value=real(value, wp)))
    end subroutine whole

    subroutine code(name, description, value)
      character(*), intent(in) :: name, description
      integer, intent(in) :: value

      call add_field(list, field_t(name, of_byte, one_number, 'code', description, &
        value=real(value, wp)))
    end subroutine code

  end subroutine list_history_fields

end module history_fields_mod
