!> Every choice the user can make, with its default.
module controls_mod
  use kinds_mod, only: wp
  use text_mod, only: to_text
  implicit none
  private

  public :: contact_controls_t, output_controls_t, print_t, precision_controls_t, &
    accuracy_controls_t, is_exact, take_double, precision_in_words, subjects, &
    subject_in_words, is_bounded, chooses_mesh, allowed_error
  public :: solver_none, solver_auto, solver_sweeps, solver_global_newton
  public :: formulation_bipotential, formulation_pseudopotential
  public :: local_uzawa, local_newton, local_newton6, local_exact
  public :: stop_at_residual, stop_at_change
  public :: accuracy_of_resultants, accuracy_of_energy, accuracy_of_pressure, accuracy_of_slip, &
    accuracy_of_displacement, accuracy_of_mises, accuracy_of_reaction, accuracy_of_contact_force
  public :: compliance_auto, compliance_dense, compliance_products

  ! The first three are what /history/solver stores.
  integer, parameter :: solver_none = 0
  integer, parameter :: solver_sweeps = 1
  integer, parameter :: solver_global_newton = 2
  integer, parameter :: solver_auto = -1

  integer, parameter :: formulation_bipotential = 1
  integer, parameter :: formulation_pseudopotential = 2

  integer, parameter :: local_uzawa = 1
  integer, parameter :: local_newton = 2   !! 3x3: x eliminated
  integer, parameter :: local_newton6 = 3  !! 6x6: as in [13]
  integer, parameter :: local_exact = 4

  integer, parameter :: stop_at_residual = 1 !! scaled natural map
  integer, parameter :: stop_at_change = 2   !! relative change of r in a sweep

  ! The last two are what /run says of a result.
  integer, parameter :: compliance_auto = 0     !! the plan chooses
  integer, parameter :: compliance_dense = 1    !! W, by the Schur complement
  integer, parameter :: compliance_products = 2 !! each product with W a solution with the factor

  ! What an accuracy is of.
  integer, parameter :: accuracy_of_resultants = 1   !! of the pairs, normal and friction
  integer, parameter :: accuracy_of_energy = 2       !! elastic, of the bodies
  integer, parameter :: accuracy_of_pressure = 3     !! the largest of a pair
  integer, parameter :: accuracy_of_slip = 4         !! the longest of a pair
  integer, parameter :: accuracy_of_displacement = 5 !! the largest
  integer, parameter :: accuracy_of_mises = 6        !! the largest mean of an element
  integer, parameter :: accuracy_of_reaction = 7      !! of the supports, the sum over a set
  integer, parameter :: accuracy_of_contact_force = 8 !! the sum over a set

  !> What an accuracy may be of.
  type :: subject_t
    character(14) :: name                  !! in decks
    character(29) :: of_all                !! in words; blank: it takes a set
    character(22) :: of_set                !! in words; blank: it takes none
    logical :: is_vector = .false.         !! of a set: DIRECTION takes one component
    logical :: is_sum = .false.            !! over the set, else of each of its nodes
    logical :: is_of_contact = .false.     !! meshes on which nothing touches say nothing of it
    logical :: is_recovered = .false.      !! one mesh says how wrong it is, by recovery
  end type subject_t

  !> By accuracy_of_resultants and its kin.
  type(subject_t), parameter :: subjects(*) = [ &
    subject_t('RESULTANTS', 'the contact forces', '', is_of_contact=.true., is_recovered=.true.), &
    subject_t('ENERGY', 'the energies', '', is_recovered=.true.), &
    subject_t('PRESSURE', 'the largest contact pressures', 'the contact pressures', &
      is_of_contact=.true.), &
    subject_t('SLIP', 'the longest slips', 'the slips', is_of_contact=.true.), &
    subject_t('DISPLACEMENT', 'the largest displacement', 'the displacements', is_vector=.true.), &
    subject_t('MISES', 'the largest von Mises stress', 'the von Mises stresses'), &
    subject_t('REACTION FORCE', '', 'the reaction force', is_vector=.true., is_sum=.true.), &
    subject_t('CONTACT FORCE', '', 'the contact force', is_vector=.true., is_sum=.true., &
      is_of_contact=.true.)]

  !> *CONTACT SOLVER.
  type :: contact_controls_t
    integer  :: solver = solver_auto
    integer  :: formulation = formulation_bipotential
    integer  :: local = local_newton
    real(wp) :: rho = 1.0_wp          !! factor of its natural scale, > 0 [-]
    real(wp) :: relaxation = 1.0_wp   !! fraction of the new value, 0 < relaxation < 2 [-]
    real(wp) :: tolerance = 1.0e-8_wp !! > 0 [-]
    integer  :: stop_rule = stop_at_residual
    integer  :: max_sweeps = 20000
    integer  :: compliance = compliance_auto !! of the contact rows
    ! What the solver decides.
    logical  :: acceleration = .false. !! Anderson's, of the sweeps
    logical  :: factorises = .false.
    !! the linear systems of the global Newton, where W is an array; else GMRES is tried first
    logical  :: shows_progress = .false. !! on a terminal: the iterations of the first increment
  end type contact_controls_t

  !> *PRECISION and *BODY SOLVER: residuals, forces and displacements are double whatever is chosen.
  type :: precision_controls_t
    logical  :: iterative = .false.         !! no factor: solutions for the bodies by iteration
    logical  :: renews_tangent = .false.
    !! at finite strain: each iteration has its own tangent, with SOLVER=AUTO displacements and
    !! reactions are found together; else one factor serves many iterations
    logical  :: single_factor = .false.     !! of the stiffness
    real(wp) :: block_low_rank = 0.0_wp
    !! what compression may drop from the factor, beside a pivot near 1; 0: full rank [-]
    logical  :: out_of_core = .false.       !! the factor lives on the disk
    ! What the deck says and the plan must keep to.
    logical  :: body_is_given = .false.     !! iterative
    logical  :: factor_is_given = .false.   !! single_factor
    logical  :: low_rank_is_given = .false. !! block_low_rank
    logical  :: tangent_is_given = .false.  !! renews_tangent
    logical  :: core_is_given = .false.     !! out_of_core
    ! What the plan says.
    integer  :: threads = 1
    !! of the linear algebra library while the stiffness is factorised; 1: as many as elsewhere
    logical  :: saves_time = .false.
    !! single_factor was chosen to save time: what it does not hold, double precision does
    logical  :: keeps_double = .false.
    !! single precision did not hold a coarser mesh: finer ones are conditioned worse
    character(:), allocatable :: scratch
    !! folder of a factor out of core, with its last slash; not allocated: MUMPS's own choice
  end type precision_controls_t

  !> *ACCURACY: how wrong the results may be.
  type :: accuracy_controls_t
    real(wp) :: wanted = 0.0_wp      !! of the largest, below 1; 0: not asked for [-]
    integer  :: of = accuracy_of_resultants
    logical  :: extrapolates = .false. !! it is that of values extrapolated from several meshes
    logical  :: keeps_mesh = .false. !! the mesh is not chosen: estimates by recovery are told
    logical  :: estimates = .true.   !! errors of mesh and load steps are estimated
    logical  :: follows_theory = .false.
    !! that of the theory is estimated, by a shadow run; else it is bounded
    logical  :: chooses_theory = .false. !! NLGEOM=AUTO: small strain where that is enough
    logical  :: keeps_small_strain = .false. !! NLGEOM=NO: it is that of the small-strain solution
    real(wp) :: time = 0.0_wp        !! of the processor that a run may take; 0: any [s]
    real(wp) :: memory = 0.0_wp      !! at the peak, that it may take; 0: what there is [bytes]
    character(:), allocatable :: set !! of nodes that it is of; not allocated: of all there is
    integer, allocatable :: nodes(:)
    !! node numbers of the set, ascending: of a force that is summed all; else those of the deck,
    !! which are the same on every mesh, that have the quantity
    integer  :: direction = 0        !! of a set's vectors 1, 2, 3: x, y, z alone; 0: all
  end type accuracy_controls_t

  !> *NODE PRINT, *EL PRINT: what is written of a set, as a table of text too.
  type :: print_t
    character(:), allocatable :: set
    logical :: of_elements = .false.        !! else of nodes
    logical :: of_springs = .false.         !! of elements: of those that are springs
    integer, allocatable :: members(:)      !! numbers of nodes, elements or springs, ascending
    integer :: frequency = 1                !! lines of every so many increments, and of the last
    logical :: each = .true.                !! of nodes: a line for each
    logical :: totals = .false.             !! of nodes: a line for their forces together
    integer, allocatable :: summed(:)
    !! of nodes: those whose forces these are, the set's new ones on a finer mesh among them
    logical :: at_gauss_points = .true.     !! of elements; else the mean of each
    logical :: displacement = .false., reaction = .false., loads = .false. !! of nodes
    logical :: stress = .false., strain = .false., mises = .false. !! of elements
    logical :: principal_stress = .false., principal_strain = .false.
  end type print_t

  !> *NODE FILE, *EL FILE, *CONTACT FILE: which fields the result file holds at each increment.
  type :: output_controls_t
    logical :: displacement = .true.
    logical :: reaction = .true.      !! reaction_force of the supports; a deck always has it
    logical :: contact = .true.       !! contact_force, contact_pressure, contact_status; likewise
    logical :: stress = .false.       !! *EL FILE, S
    logical :: strain = .false.       !! *EL FILE, E
    logical :: mesh_error = .false.   !! *EL FILE, ERR
    logical :: mises = .false.            !! *EL FILE, MISES or S
    logical :: principal_stress = .false. !! *EL FILE, SP
    logical :: principal_strain = .false. !! *EL FILE, EP
    logical :: green_strain = .false.     !! *EL FILE, EG: at finite strain
    logical :: pk2_stress = .false.       !! *EL FILE, PK2: likewise
    logical :: loads = .false.            !! *NODE FILE, CF: applied_force
    logical :: penetration = .false.      !! *CONTACT FILE, COPEN: contact_penetration
    logical :: contact_table = .false.    !! *CONTACT PRINT: totals of the pairs, also as a table
    logical :: at_centroids = .true.  !! of stress and strain: the mean of an element
    logical :: at_nodes = .false.     !! extrapolated from the Gauss points, averaged over elements
    logical :: at_gauss_points = .false. !! eight tensors an element
    integer :: frequency = 1          !! every so many increments, and the last of a step
    type(print_t), allocatable :: prints(:) !! not allocated: none
  end type output_controls_t

contains

  !> Whether solutions for the bodies are good to double precision as they come.
  pure logical function is_exact(precision)
    type(precision_controls_t), intent(in) :: precision

    is_exact = .not. precision%single_factor .and. precision%block_low_rank <= 0.0_wp .and. &
      .not. precision%iterative
  end function is_exact

  !> Double precision where single was chosen to save time.
  pure subroutine take_double(precision)
    type(precision_controls_t), intent(inout) :: precision

    if (.not. precision%saves_time) return
    precision%saves_time = .false.
    precision%single_factor = .false.
  end subroutine take_double

  !> Whether time or memory of a run have a bound beside the machine's.
  pure logical function is_bounded(accuracy)
    type(accuracy_controls_t), intent(in) :: accuracy

    is_bounded = accuracy%time > 0.0_wp .or. accuracy%memory > 0.0_wp
  end function is_bounded

  !> The error that is allowed: the accuracy, or 1 % where none is asked for.
  pure real(wp) function allowed_error(wanted)
    real(wp), intent(in) :: wanted !! accuracy; 0: none [-]
    real(wp), parameter :: usual = 0.01_wp

    allowed_error = merge(wanted, usual, wanted > 0.0_wp)
  end function allowed_error

  !> Whether the program is to find a mesh: one that an accuracy takes, or that time and memory
  !> allow.
  pure logical function chooses_mesh(accuracy)
    type(accuracy_controls_t), intent(in) :: accuracy

    chooses_mesh = (accuracy%wanted > 0.0_wp .or. is_bounded(accuracy)) .and. &
      .not. accuracy%keeps_mesh
  end function chooses_mesh

  !> What an accuracy is of.
  function subject_in_words(accuracy) result(words)
    type(accuracy_controls_t), intent(in) :: accuracy
    character(:), allocatable :: words

    words = trim(subjects(accuracy%of)%of_all)
    if (allocated(accuracy%set)) then
      words = trim(subjects(accuracy%of)%of_set)//' of '//accuracy%set
      if (accuracy%direction > 0) words = words//' along '//'xyz'(accuracy%direction: &
        accuracy%direction)
    end if
    if (accuracy%extrapolates) words = 'the extrapolated '//words(len('the ') + 1:)
  end function subject_in_words

  !> double precision; single precision, block low rank 1e-6.
  function precision_in_words(precision) result(words)
    type(precision_controls_t), intent(in) :: precision
    character(:), allocatable :: words

    words = 'double precision'
    if (precision%iterative) words = 'by iteration'
    if (precision%single_factor) words = 'single precision'
    if (precision%block_low_rank > 0.0_wp) words = words//', block low rank '// &
      to_text(precision%block_low_rank, 3)
  end function precision_in_words

end module controls_mod
