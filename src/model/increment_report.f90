!> What is told about an increment: how it was solved, how true it is, what its contact looks like.
module increment_report_mod
  use kinds_mod, only: wp
  use controls_mod, only: solver_none, stop_at_change
  use contact_points_mod, only: weights_t
  use scene_mod, only: scene_t
  implicit none
  private

  public :: increment_report_t, ending_t, has_converged, is_solved, certificate_t, &
    error_parts_t, total_error, entered_beside_mesh, energy_t, contact_fields_t
  public :: status_open, status_stick, status_slide
  public :: cycle_none, cycle_differs, cycle_settled
  public :: not_ended, ended_well, ended_at_limit, ended_stalled, ended_diverging, &
    ended_unbalanced, ended_moving, ended_out_of_reach, ended_passed, ended_inverted, &
    ended_out_of_balance, ended_indefinite
  public :: worst_entry, force_sums, largest_pressure, is_redundant_at, count_redundant, told_theory

  ! How an increment ends, or a contact solver.
  integer, parameter :: not_ended = -1       !! not yet
  integer, parameter :: ended_well = 0       !! it did converge
  integer, parameter :: ended_at_limit = 1   !! of its iterations
  integer, parameter :: ended_stalled = 2    !! no progress any more
  integer, parameter :: ended_diverging = 3  !! reactions grow without bound
  integer, parameter :: ended_unbalanced = 4 !! nothing balances a rigid motion
  integer, parameter :: ended_moving = 5     !! the closest points on curved obstacles do not settle
  integer, parameter :: ended_out_of_reach = 6 !! a point got to its obstacle that was not to
  integer, parameter :: ended_passed = 7     !! an obstacle would press a point from behind
  integer, parameter :: ended_inverted = 8   !! an element would turn inside out
  integer, parameter :: ended_out_of_balance = 9 !! forces at finite strain do not come to balance
  integer, parameter :: ended_indefinite = 10 !! a tangent at finite strain is not positive definite

  integer, parameter :: status_open = 0, status_stick = 1, status_slide = 2

  ! Whether a load cycle ends with an increment, and whether it has settled.
  integer, parameter :: cycle_none = 0, cycle_differs = 1, cycle_settled = 2

  !> How an increment has ended, and by what.
  type :: ending_t
    integer  :: cause = not_ended
    real(wp) :: how_far = 0.0_wp
    !! of points that do not settle how far they move, of forces what is out of balance [-]
    integer  :: point = 0
    !! that does not settle, was taken to be out of reach, or would be pressed from behind; 0: none
    real(wp) :: part_to_try = 1.0_wp !! of the increment: there an obstacle passes no point [-]
    integer  :: element = 0          !! that would turn inside out
    character(:), allocatable :: motions !! that nothing balances, in words
    logical  :: pulls_off = .false.  !! these close no contact, and open some
  end type ending_t

  !> The errors of a step, each relative to the scales of docs/theory.md section 6.
  type :: certificate_t
    real(wp) :: penetration = 0.0_wp
    real(wp) :: adhesion = 0.0_wp
    real(wp) :: complementarity = 0.0_wp
    real(wp) :: cone = 0.0_wp
    real(wp) :: law = 0.0_wp
    real(wp) :: equilibrium = 0.0_wp
    logical  :: certified = .false.
    !! all at most 10 times the contact tolerance, but `support`, which is a matter of rounding
    real(wp) :: balance = 0.0_wp !! forces on a whole body or obstacle
    real(wp) :: support = 0.0_wp !! displacements beside what is prescribed
    real(wp) :: energy = 0.0_wp  !! of the strains beside the work of all nodal forces
    real(wp) :: undetermined = 0.0_wp !! reactions that equilibrium says nothing of
    real(wp) :: dissipation = 0.0_wp  !! work that friction does instead of losing it
    integer  :: folded_point = 0
    !! a face of its node, or one before it, is folded: no integral over it means anything; 0: none
    integer  :: torn_point = 0
    !! it presses, or is inside, where its mean is over both faces of a step or a concave edge; 0:
    !! none
    real(wp), allocatable :: strain(:) !! (0:n_bodies) of each, at small strain [energy]
  end type certificate_t

  !> How wrong the contact resultants are, by source, each a part of the largest; negative where it
  !> is not estimated.
  type :: error_parts_t
    real(wp) :: contact = -1.0_wp    !! the worst entry of the certificate but equilibrium
    real(wp) :: load_steps = -1.0_wp !! by increments of another size
    real(wp) :: mesh = -1.0_wp       !! of the stresses by recovery, a part of the energy
    real(wp) :: geometry = -1.0_wp
    !! of faces where meshes do not match, the sum of the three that follow
    real(wp) :: between_nodes = -1.0_wp
    !! faces that are entered between their nodes, or stay flat where bodies bend
    real(wp) :: at_edges = -1.0_wp   !! edges of one side within faces of the other
    real(wp) :: of_facets = -1.0_wp  !! flat faces that stand for arcs
    real(wp) :: too_stiff = -1.0_wp
    !! of mesh, what makes bodies surely too stiff; negative where its sign is not known
    real(wp) :: too_soft = 0.0_wp
    !! of between_nodes, round obstacles that are let in: surely too soft
    real(wp) :: arithmetic = -1.0_wp !! forces out of balance, and rounding times the condition
    real(wp) :: theory = -1.0_wp
    !! what finite strain would change: in no sum; huge: not known
    logical  :: follows_theory = .false. !! it is an estimate by a shadow run, else a bound
    real(wp) :: of_law(2) = -1.0_wp
    !! the estimates with the deck's law, and where it leaves the law open with another one
    real(wp) :: law = -1.0_wp        !! how far these two laws are apart, likewise
  end type error_parts_t

  !> The energies of the run up to this increment [energy].
  type :: energy_t
    real(wp) :: external_work = 0.0_wp
    real(wp) :: strain = 0.0_wp
    real(wp) :: dissipation = 0.0_wp
    real(wp) :: balance = 0.0_wp
    !! work - strain - dissipation: of the order of the increment; in a dynamic *STEP with what
    !! follows it is what the scheme has taken
    real(wp) :: kinetic = 0.0_wp
    real(wp) :: contact = 0.0_wp     !! work of normal forces, which have none in nature
    real(wp) :: damped = 0.0_wp      !! by materials
    real(wp) :: begun = 0.0_wp       !! kinetic, that the run began with
    real(wp) :: risen = 0.0_wp
    !! what contact and scheme have given since the least that they had, of the largest energy [-]
    real(wp) :: risen_of_one = 0.0_wp !! the same of a body by itself, where that is most [-]
    integer :: risen_body = 0         !! which; 0: not known, or none
    real(wp) :: turned = 0.0_wp
    !! angular momentum of a body that no torque explains, of what the largest energy would give [-]
  end type energy_t

  !> The contact as it stands at the end of the increment, point by point, in the local frames.
  type :: contact_fields_t
    real(wp), allocatable :: frame(:, :, :)       !! (3,3,n_points) columns n, t1, t2 in x, y, z [-]
    type(weights_t) :: weights                    !! of the masters' nodes
    real(wp), allocatable :: reaction(:, :) !! (3,n_points) n, t1, t2, on the slave body [force]
    real(wp), allocatable :: gap(:)
    !! (n_points) `no_gap` where no master covers the point [length]
    real(wp), allocatable :: kept_overlap(:)
    !! (n_points) overlap from the start at points that supports keep from moving along the normal:
    !! nothing carries it. Not allocated: none [length]
    real(wp), allocatable :: covered_area(:)
    !! (n_points) of the node's area what its master covers [length^2]
    logical, allocatable :: is_partly_covered(:)
    !! (n_points) less than half of what is turned towards it: no pressure to be compared
    real(wp), allocatable :: least_gap(:)
    !! (n_points) before faces: in the faces about the node, at points of the quadrature; elsewhere
    !! the gap [length]
    real(wp), allocatable :: unplaced_gap(:)
    !! (n_points) the same of a point that faces cover a little, but not enough for it to count;
    !! elsewhere huge [length]
    real(wp), allocatable :: entered(:)
    !! (n_points) before faces: integral of the gap where it is below 0, with the node's shape
    !! function [length^3]
    real(wp), allocatable :: apart(:, :)
    !! (3,n_points) before facets of an obstacle: place of the node less that of what it faces; 0
    !! elsewhere [length]
    real(wp), allocatable :: slip_increment(:, :) !! (2,n_points) along t1, t2 [length]
    integer,  allocatable :: status(:) !! (n_points) status_open, status_stick, status_slide
    logical,  allocatable :: stays(:)
    !! (n_points) closed from the beginning of the increment: it may pull
    logical,  allocatable :: is_redundant(:)
    !! (n_points) constraints could take over what it carries: the reaction is the least, no more
  end type contact_fields_t

  !> One increment's report.
  type :: increment_report_t
    type(ending_t) :: ending
    integer  :: solver = solver_none
    integer  :: newton_raphson_iterations = 0
    integer  :: contact_iterations = 0  !! sweeps, or iterations of Newton's method
    integer  :: compliance_products = 0 !! products of W with a vector; a sweep counts as one
    integer  :: solver_stages = 0       !! solvers tried one after the other
    integer  :: force_evaluations = 0   !! of internal forces, at finite strain
    integer  :: products = 0            !! of tangents with what the factor at hand makes of vectors
    integer  :: tangents = 0            !! that were factorised, at finite strain
    integer  :: local_iterations = 0    !! summed over points and sweeps
    real(wp) :: in_time = -1.0_wp
    !! error of a dynamic increment by its length, as of error_in_time; negative: of others [-]
    real(wp) :: residual = 0.0_wp       !! scaled natural map [-]
    real(wp) :: unrefined = 0.0_wp !! out of balance before Newton-Raphson corrected it [-]
    real(wp) :: imbalance = 0.0_wp !! and at the end, of the largest nodal force [-]
    real(wp) :: without_contact = 0.0_wp
    !! largest displacement that the loads alone would make, beside the largest with contact [-]
    real(wp) :: moved = 0.0_wp !! points on curved masters, in the last iteration [-]
    integer  :: moved_point = 0 !! before a surface, that moved the most; 0: none
    real(wp) :: wall_time = 0.0_wp      !! of the whole increment [s]
    real(wp) :: contact_time = 0.0_wp   !! of it, in the contact solver [s]
    real(wp) :: certify_time = 0.0_wp   !! and in the certificate [s]
    integer  :: worst_point = 0         !! the point of the largest residual, 0 if none
    real(wp) :: largest_strain = -1.0_wp   !! principal, at the centres; negative: not computed [-]
    real(wp) :: largest_rotation = -1.0_wp !! the same [rad]
    real(wp) :: largest_stress = -1.0_wp
    !! von Mises, of *ELASTIC, as a part of Young's modulus; negative: not computed [-]
    real(wp) :: face_penetration = 0.0_wp
    !! of an obstacle into a slave face, between its nodes [length]
    real(wp) :: face_penetration_on_way = 0.0_wp
    !! before the increment's end, where nothing touches nearby [length]
    integer  :: load_cycle = cycle_none     !! whether a load cycle ends here, and has settled
    real(wp) :: load_cycle_change = -1.0_wp
    !! from the end of the cycle before, of the changes within it; negative: none is known [-]
    integer  :: n_unheld = 0            !! rigid motions that nothing resists
    character(:), allocatable :: unheld     !! those, in words
    real(wp), allocatable :: x_free(:)
    !! (n_rows) of the last contact problem: gaps and slips without reactions [length]
    real(wp), allocatable :: mesh_error(:)
    !! (n_elements) of the stresses, squared, where it was estimated [energy]
    real(wp) :: left_over(2) = 0.0_wp
    !! along the path since an increment or two, where it is more than a tenth of the strain energy
    !! and smaller increments do not make it smaller: in these, in quarters of them [energy]
    type(certificate_t)    :: certificate
    type(energy_t)         :: energy
    type(error_parts_t)    :: errors
    type(contact_fields_t) :: contact
  end type increment_report_t

contains

  !> Whether an increment has come to an equilibrium.
  pure logical function has_converged(report)
    type(increment_report_t), intent(in) :: report

    has_converged = report%ending%cause == ended_well
  end function has_converged

  !> Whether it may stand: certified, or where the deck compares solvers (STOP=CHANGE) as it is.
  pure logical function is_solved(scene, report)
    type(scene_t), intent(in) :: scene
    type(increment_report_t), intent(in) :: report

    is_solved = has_converged(report) .and. (report%certificate%certified .or. &
      scene%contact%stop_rule == stop_at_change)
  end function is_solved

  !> The parts together but the theory's: the error of the small-strain solution. Negative where
  !> mesh, load steps or geometry are not estimated. The stress recovery that mesh is found by does
  !> not see the geometry, nor the other way round: signs are as often opposite as equal. Where they
  !> are known to be opposite the difference counts. docs/theory.md section 10.
  pure real(wp) function total_error(errors) result(total)
    type(error_parts_t), intent(in) :: errors
    real(wp) :: mesh, geometry

    total = -1.0_wp
    if (min(errors%contact, errors%load_steps, errors%mesh, errors%geometry, errors%arithmetic) < &
      0.0_wp) return
    mesh = errors%mesh
    geometry = errors%geometry
    if (is_opposite(errors)) then
      mesh = left_of_both(errors)
      geometry = geometry - errors%too_soft
    end if
    total = errors%contact + errors%load_steps + norm2([mesh, geometry]) + errors%arithmetic
  end function total_error

  !> What counts of faces that are entered between their nodes beside what meshes change of the
  !> forces: where the two signs are known, what the mesh leaves of it.
  pure real(wp) function entered_beside_mesh(errors) result(entered)
    type(error_parts_t), intent(in) :: errors

    entered = errors%between_nodes
    if (is_opposite(errors)) entered = entered - errors%too_soft + min(errors%too_soft, &
      left_of_both(errors))
  end function entered_beside_mesh

  !> Whether bodies are too stiff, and obstacles let in, by what is known.
  pure logical function is_opposite(errors)
    type(error_parts_t), intent(in) :: errors

    is_opposite = errors%too_stiff >= 0.0_wp .and. errors%too_soft > 0.0_wp
  end function is_opposite

  !> What is left of both then: the difference, or a quarter of the larger, by which that may be
  !> wrong itself. docs/theory.md (10.32).
  pure real(wp) function left_of_both(errors) result(left)
    type(error_parts_t), intent(in) :: errors
    real(wp), parameter :: doubt = 0.25_wp !! of an estimate [-]

    left = max(abs(errors%too_stiff - errors%too_soft), doubt*max(errors%too_stiff, &
      errors%too_soft))
  end function left_of_both

  !> The error of small strain as users get it: a bound above 1 says nothing. Huge: not known.
  pure real(wp) function told_theory(error, is_estimate) result(told)
    real(wp), intent(in) :: error          !! as of error_parts_t [-]
    logical,  intent(in) :: is_estimate    !! else it is a bound

    told = error
    if (error > 1.0_wp .and. .not. is_estimate) told = huge(1.0_wp)
  end function told_theory

  !> The largest of the certificate's entries that are measured by the contact tolerance; huge where
  !> one of them is no number, which Fortran's MAX may pass over.
  pure real(wp) function worst_entry(certificate) result(worst)
    type(certificate_t), intent(in) :: certificate
    real(wp) :: entries(10)

    entries = [certificate%penetration, certificate%adhesion, certificate%complementarity, &
      certificate%cone, certificate%law, certificate%equilibrium, certificate%balance, &
      certificate%energy, certificate%undetermined, certificate%dissipation]
    worst = huge(worst)
    if (all(entries <= worst)) worst = maxval(entries)
  end function worst_entry

  !> The largest normal reaction over the area of its point, of some points; 0 where none presses.
  !> Points that are partly covered, and reactions that are not determined, are left out.
  pure real(wp) function largest_pressure(contact, first, last) result(largest)
    type(contact_fields_t), intent(in) :: contact
    integer, intent(in) :: first, last !! points: a pair's
    integer :: i

    largest = 0.0_wp
    do i = first, last
      if (contact%is_partly_covered(i)) cycle
      if (is_redundant_at(contact, i)) cycle
      if (contact%covered_area(i) > 0.0_wp) largest = max(largest, &
        contact%reaction(1, i)/contact%covered_area(i))
    end do
  end function largest_pressure

  !> Sums over points of the normal reactions and of the friction, x, y, z.
  pure function force_sums(contact, first, last) result(sums)
    type(contact_fields_t), intent(in) :: contact
    integer, intent(in) :: first, last !! points
    real(wp) :: sums(3, 2) !! [force]
    integer :: i

    sums = 0.0_wp
    do i = first, last
      associate (r => contact%reaction(:, i), frame => contact%frame(:, :, i))
        sums(:, 1) = sums(:, 1) + r(1)*frame(:, 1)
        sums(:, 2) = sums(:, 2) + r(2)*frame(:, 2) + r(3)*frame(:, 3)
      end associate
    end do
  end function force_sums

  !> Whether the reaction of a point is not determined.
  pure logical function is_redundant_at(contact, i) result(is_redundant)
    type(contact_fields_t), intent(in) :: contact
    integer, intent(in) :: i

    is_redundant = .false.
    if (allocated(contact%is_redundant)) is_redundant = contact%is_redundant(i)
  end function is_redundant_at

  !> How many points there are of which it is not.
  pure integer function count_redundant(contact)
    type(contact_fields_t), intent(in) :: contact

    count_redundant = 0
    if (allocated(contact%is_redundant)) count_redundant = count(contact%is_redundant)
  end function count_redundant

end module increment_report_mod
