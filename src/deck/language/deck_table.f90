!> The table of the deck: its keywords, where they may stand, their options and data lines, and what
!> is ignored or refused.
!>
!> It is the only place that says so: readers check a card's options by it and take the words of an
!> option from it, messages suggest its words, `bipot --cards` prints it, and the card index of
!> docs/deck.md is made from that.
!>
!> Options are written as in a deck, `NAME=value` or a flag, between commas. The value is words in
!> capitals, one of which the option takes, the first where it is left out; or a word in small
!> letters, for what it is, with a colon and the default where there is one. `!` follows an option
!> that the card must have.
module deck_table_mod
  use text_mod, only: string_t, upper
  implicit none
  private

  public :: rule_t, item_t, deck_table, find_rule, rule_of, keyword_names, split_items, split_at
  public :: in_model, in_step, in_model_or_first_step, anywhere
  public :: is_read, is_ignored, is_missing, is_outside, is_checked, is_procedure
  public :: fitted
  public :: max_keyword, is_other_step, squeeze, same_word, says, without_tabs

  integer, parameter :: max_keyword = 36

  integer, parameter :: in_model = 1 !! before the first *STEP
  integer, parameter :: in_step = 2
  integer, parameter :: anywhere = 3
  integer, parameter :: in_model_or_first_step = 4

  integer, parameter :: is_read = 1
  integer, parameter :: is_ignored = 2 !! with a note: it changes nothing here
  integer, parameter :: is_missing = 3 !! it would change the result: an error
  integer, parameter :: is_outside = 4 !! likewise, of a field that the program is not made for
  integer, parameter :: is_checked = 5 !! some options would, others are ignored, and so are data
  integer, parameter :: is_procedure = 6 !! as is_outside; it says what a step computes

  !> A keyword, in upper case, without its star, and what belongs to it.
  type :: rule_t
    character(max_keyword) :: name
    integer :: place                  !! in_model, in_step, in_model_or_first_step, anywhere
    integer :: reading                !! is_read, is_ignored, is_missing, ...
    character(280) :: options = ''    !! that are read
    character(140) :: ignored = ''    !! options that are ignored with a note, without values
    character(120) :: data = ''       !! the data lines, one behind the other: blank for none
    character(150) :: remark = ''     !! why it changes nothing; what to write instead of it
  end type rule_t

  !> An option as the table has it.
  type :: item_t
    character(:), allocatable :: name
    character(:), allocatable :: value   !! words between bars, or what the value is; empty: a flag
    character(:), allocatable :: default !! of a value that is no word; may be empty
    logical :: required = .false.
    logical :: may_stand_alone = .false. !! a flag, or one that takes words, too
    logical :: has_words = .false.       !! the value is one of words
  end type item_t

  character(*), parameter :: output_ignored = 'NSET, ELSET, OUTPUT, GLOBAL, TIME POINTS, '// &
    'CONTACT ELEMENT, LAST ITERATIONS'
  character(*), parameter :: print_ignored = 'FREQUENCYF, GLOBAL, TIME POINTS, SUMMARY, OUTPUT'
  character(*), parameter :: load_options = 'AMPLITUDE=name, TIME DELAY=time, OP=MOD|NEW'
  character(*), parameter :: as_solids = 'mesh the part with solid elements: C3D20R or C3D10, '// &
    'or two C3D8I across a plate that bends'
  character(*), parameter :: elastic_only = 'materials are elastic'
  character(*), parameter :: fitted = 'a law takes its constants: Abaqus prints those that it '// &
    'fits to test data'
  character(*), parameter :: static_only = 'steps are *STATIC or *DYNAMIC'
  character(*), parameter :: no_heat = 'a known temperature acts by *EXPANSION and *TEMPERATURE'

  type(rule_t), parameter :: cards_read(*) = [ &
    rule_t('HEADING', anywhere, is_read, data='title'), &
    rule_t('PARAMETER', anywhere, is_read, data='name = value'), &
    rule_t('UNITS', in_model, is_read, data='force, length'), &
    rule_t('INCLUDE', anywhere, is_read, 'INPUT=path!'), &
    rule_t('NODE', in_model, is_read, 'NSET=name, SYSTEM=R|C', data='id, x, y, z'), &
    rule_t('SYSTEM', in_model, is_read, data='origin, point of the x axis; point of the plane'), &
    rule_t('NGEN', in_model, is_read, 'NSET=name, LINE=P|C', &
    data='first node, last node, step, third node, its x, y, z, normal x, y, z'), &
    rule_t('NFILL', in_model, is_read, 'NSET=name', data='set, set, intervals, step'), &
    rule_t('NCOPY', in_model, is_read, 'CHANGE NUMBER=count!, OLD SET=name!, NEW SET=name, '// &
    'SHIFT, REFLECT=LINE|MIRROR|POINT, MULTIPLE=count:1', &
    data='x, y, z; xa, ya, za, xb, yb, zb, degrees; or points'), &
    rule_t('ELEMENT', in_model, is_read, 'TYPE=type!, ELSET=name', data='id, node, node, ...'), &
    rule_t('ELGEN', in_model, is_read, 'ELSET=name', data='element, count, step of nodes, '// &
    'step of elements, ... three times'), &
    rule_t('ELCOPY', in_model, is_read, 'ELEMENT SHIFT=count!, SHIFT NODES=count!, '// &
    'OLD SET=name!, NEW SET=name, REFLECT'), &
    rule_t('PLANE ELEMENTS', in_model, is_read, 'TYPE=CPE|CPS|CAX!'), &
    rule_t('BLOCK', in_model, is_read, 'NAME=name!, NX=count!, NY=count!, NZ=count!, '// &
    'TYPE=type:C3D8, ELSET=name', data='x, y, z, size along x, along y, along z; '// &
    'axis, ratio of sizes, MIDDLE'), &
    rule_t('PART', in_model, is_read, 'NAME=name!'), &
    rule_t('END PART', in_model, is_read), &
    rule_t('ASSEMBLY', in_model, is_read, 'NAME=name'), &
    rule_t('INSTANCE', in_model, is_read, 'NAME=name!, PART=name!', &
    data='x, y, z; xa, ya, za, xb, yb, zb, degrees'), &
    rule_t('END INSTANCE', in_model, is_read), &
    rule_t('END ASSEMBLY', in_model, is_read), &
    rule_t('NSET', anywhere, is_read, 'NSET=name!, GENERATE, ELSET=name, INSTANCE=name', &
    'UNSORTED, INTERNAL, FREQUENCY', 'id or set, ...'), &
    rule_t('ELSET', anywhere, is_read, 'ELSET=name!, GENERATE, INSTANCE=name', &
    'UNSORTED, INTERNAL, FREQUENCY', 'id or set, ...'), &
    rule_t('SURFACE', in_model, is_read, 'NAME=name!, '// &
    'TYPE=ELEMENT|NODE|CYLINDER|REVOLUTION|SEGMENTS, COMBINE=UNION', 'INTERNAL, TRIM', &
    'element or set, face; or node or set; or surface, ...; or START, LINE, CIRCL and numbers'), &
    rule_t('OBSTACLE', in_model, is_read, 'NAME=name!, TYPE=PLANE|SPHERE|CYLINDER|CONE|STL!, '// &
    'INNER, FACETS=count:180, INPUT=path, REF NODE=id', data='numbers of the shape'), &
    rule_t('RIGID BODY', in_model, is_read, 'ELSET=name, NSET=name, PIN NSET=name, '// &
    'TIE NSET=name, ANALYTICAL SURFACE=name, REF NODE=id, ROT NODE=id', 'ISOTHERMAL'), &
    rule_t('MATERIAL', in_model, is_read, 'NAME=name!'), &
    rule_t('ELASTIC', in_model, is_read, 'TYPE=ISOTROPIC|ISO|ENGINEERING CONSTANTS|'// &
    'ORTHOTROPIC|ORTHO|ANISOTROPIC|ANISO, LAW=SVK|NEO HOOKE', &
    data='modulus, ratio, temperature; or 9 or 21 constants, 8 on a line'), &
    rule_t('ORIENTATION', in_model, is_read, 'NAME=name!, SYSTEM=RECTANGULAR|CYLINDRICAL, '// &
    'DEFINITION=COORDINATES', 'LOCAL DIRECTIONS', 'xa, ya, za, xb, yb, zb, xc, yc, zc; axis, '// &
    'degrees'), &
    rule_t('HYPERELASTIC', in_model, is_read, 'NEO HOOKE, MOONEY-RIVLIN, YEOH, OGDEN, '// &
    'POLYNOMIAL, REDUCED POLYNOMIAL, N=count:1', data='constants of the law'), &
    rule_t('HYPERFOAM', in_model, is_read, 'N=count:1', data='mu, alpha, nu'), &
    rule_t('REFINE', in_model, is_read, 'NSET=name, ELSET=name, TIMES=count:1', &
    data='x, y, z, radius'), &
    rule_t('DENSITY', in_model, is_read, data='density, temperature'), &
    rule_t('DAMPING', in_model, is_read, 'ALPHA=number, BETA=number'), &
    rule_t('EXPANSION', in_model, is_read, 'TYPE=ISO|ISOTROPIC', 'ZERO', &
    'coefficient, temperature'), &
    rule_t('SOLID SECTION', in_model, is_read, 'ELSET=name!, MATERIAL=name!, ORIENTATION=name', &
    'CONTROLS', 'thickness'), &
    rule_t('SURFACE INTERACTION', in_model_or_first_step, is_read, 'NAME=name!', &
    data='thickness'), &
    rule_t('FRICTION', in_model_or_first_step, is_read, 'ROUGH, TAUMAX=stress, EXPONENTIAL DECAY', &
    ignored='SLIP TOLERANCE, ELASTIC SLIP, LAGRANGE', &
    data='mu, stick slope, pressure, temperature; or mu at rest, mu of fast slip, decay'), &
    rule_t('CONTACT PAIR', in_model_or_first_step, is_read, 'INTERACTION=name!, '// &
    'ADJUST=distance or set, SMALL SLIDING, TIED', 'TYPE, MECHANICAL CONSTRAINT, CPSET, OP, '// &
    'NO THICKNESS, TRACKING, GEOMETRIC CORRECTION, SUPPLEMENTARY CONSTRAINTS, SMOOTH, '// &
    'EXTENSION ZONE', 'slave, master'), &
    rule_t('CONTACT', in_model_or_first_step, is_read, ignored='OP'), &
    rule_t('CONTACT INCLUSIONS', in_model_or_first_step, is_read, 'ALL EXTERIOR', &
    data='surface, surface'), &
    rule_t('CONTACT EXCLUSIONS', in_model_or_first_step, is_read, data='surface, surface'), &
    rule_t('CONTACT PROPERTY ASSIGNMENT', in_model_or_first_step, is_read, &
    data='surface, surface, interaction'), &
    rule_t('CONTACT INITIALIZATION DATA', in_model_or_first_step, is_checked, &
    'NAME=name, INTERFERENCE FIT, INITIAL CLEARANCE=gap, SEARCH ABOVE=distance', &
    'SEARCH BELOW'), &
    rule_t('TIE', in_model, is_read, 'NAME=name, POSITION TOLERANCE=distance, ADJUST=YES|NO, '// &
    'CYCLIC SYMMETRY', &
    'TYPE, NO ROTATION, CONSTRAINT RATIO, NO THICKNESS', 'slave, master'), &
    rule_t('CYCLIC SYMMETRY MODEL', in_model, is_read, 'N=count!, TIE=name', &
    'ELSET, NGRAPH, CHECK', 'two points of the axis'), &
    rule_t('EQUATION', in_model, is_read, data='count; node, dof, factor, ...'), &
    rule_t('SPRING', in_model, is_read, 'ELSET=name!, NONLINEAR', 'RTOL, COMPLEX STIFFNESS', &
    'dof of the first node, of the second node; stiffness, frequency, temperature; or force, '// &
    'elongation, temperature'), &
    rule_t('GAP', in_model, is_read, 'ELSET=name!', &
    data='clearance, direction: x, y, z'), &
    rule_t('FOUNDATION', in_model, is_read, data='element or set, F1 to F6, stiffness per area'), &
    rule_t('COUPLING', in_model, is_read, &
    'CONSTRAINT NAME=name, REF NODE=id!, SURFACE=name!'), &
    rule_t('KINEMATIC COUPLING', in_model, is_read, 'REF NODE=id!', &
    data='set of nodes, first dof, last dof'), &
    rule_t('DISTRIBUTING COUPLING', in_model, is_read, 'ELSET=name!', &
    data='set of nodes, weight'), &
    rule_t('MPC', in_model, is_read, &
    data='BEAM, set of nodes, reference node; TIE, PIN or LINK, node or set, node or set'), &
    rule_t('KINEMATIC', in_model, is_read, data='first dof, last dof'), &
    rule_t('DISTRIBUTING', in_model, is_read, 'WEIGHTING METHOD=UNIFORM', &
    data='first dof, last dof'), &
    rule_t('PRE-TENSION SECTION', in_model, is_read, 'SURFACE=name!, NODE=id!', &
    data='normal: x, y, z'), &
    rule_t('TRANSFORM', in_model, is_read, 'NSET=name!, TYPE=R|C', &
    data='xa, ya, za, xb, yb, zb'), &
    rule_t('CONTACT GAP', in_model, is_read, 'PARABOLA', data='node or set, gap'), &
    rule_t('CLEARANCE', in_model, is_read, 'SLAVE=name!, MASTER=name!, VALUE=gap!'), &
    rule_t('CONTACT SOLVER', in_model, is_read, 'SOLVER=AUTO|SWEEPS|GLOBAL NEWTON, '// &
    'FORMULATION=BIPOTENTIAL|PSEUDOPOTENTIAL, LOCAL=AUTO|UZAWA|NEWTON|NEWTON6|EXACT, '// &
    'RHO=number, RELAXATION=number, TOLERANCE=number, STOP=RESIDUAL|CHANGE, '// &
    'MAX SWEEPS=count, COMPLIANCE=AUTO|DENSE|PRODUCTS'), &
    rule_t('PRECISION', in_model, is_read, 'FACTOR=DOUBLE|SINGLE|AUTO, '// &
    'BLOCK LOW RANK=number, OUT OF CORE=NO|YES|AUTO'), &
    rule_t('BODY SOLVER', in_model, is_read, 'TYPE=FACTOR|ITERATIVE|AUTO, '// &
      'TANGENT=KEPT|NEWTON|AUTO'), &
    rule_t('ACCURACY', in_model, is_read, 'OF=RESULTANTS|ENERGY|PRESSURE|SLIP|DISPLACEMENT|'// &
    'MISES|REACTION FORCE|CONTACT FORCE, NSET=name, DIRECTION=1 to 3, '// &
    'MESH=REFINE|KEEP, VALUE=FINEST|EXTRAPOLATED, ESTIMATE=YES|NO, THEORY=BOUND|ESTIMATE', &
    data='accuracy'), &
    rule_t('AMPLITUDE', anywhere, is_read, 'NAME=name!, TIME=STEP TIME|TOTAL TIME, '// &
    'VALUE=RELATIVE, DEFINITION=TABULAR|PERIODIC|SMOOTH STEP, SMOOTH=0 to 0.5', &
    data='time, value, ...'), &
    rule_t('INITIAL CONDITIONS', in_model, is_read, 'TYPE=TEMPERATURE|VELOCITY!', &
    data='node or set, temperature; or node or set, dof, velocity'), &
    rule_t('STEP', anywhere, is_read, 'NLGEOM[=YES|NO|AUTO], PERTURBATION, AMPLITUDE=RAMP|STEP', &
    'INC, NAME, UNSYMM, EXTRAPOLATION, CONVERT SDI', 'title'), &
    rule_t('STATIC', in_step, is_read, 'DIRECT', &
    'SOLVER, STABILIZE, FACTOR, ALLSDTOL, CONTINUE, APPLICATION, INITIAL, ALPHA, NOHAF', &
    'increment, period, smallest, largest'), &
    rule_t('DYNAMIC', in_step, is_read, 'DIRECT, EXPLICIT, ALPHA=number, '// &
    'APPLICATION=TRANSIENT FIDELITY|MODERATE DISSIPATION', 'SOLVER, RELATIVE TO ABSOLUTE, '// &
    'NOHAF, HAFTOL, HALFTOL, INITIAL, FULLY', 'increment, period, smallest, largest'), &
    rule_t('END STEP', in_step, is_read), &
    rule_t('BOUNDARY', anywhere, is_read, load_options//', FIXED, '// &
    'TYPE=DISPLACEMENT|VELOCITY|ACCELERATION', data='node or set, first dof, last dof, value'), &
    rule_t('CLOAD', in_step, is_read, load_options//', FOLLOWER', data='node or set, dof, force'), &
    rule_t('DLOAD', in_step, is_read, load_options, &
    data='element or set, face, pressure; element or set, kind, value, direction'), &
    rule_t('DSLOAD', in_step, is_read, load_options, data='surface, P, pressure'), &
    rule_t('TEMPERATURE', in_step, is_read, load_options, data='node or set, temperature'), &
    rule_t('CONTACT INTERFERENCE', in_step, is_read, &
    'TYPE=CONTACT PAIR, AMPLITUDE=name, OP=MOD|NEW, SHRINK', &
    data='slave, master, interference'), &
    rule_t('CHANGE FRICTION', in_step, is_read, 'INTERACTION=name!'), &
    rule_t('MODEL CHANGE', in_step, is_read, 'TYPE=CONTACT PAIR|ELEMENT!, ADD, REMOVE', &
    data='slave, master'), &
    rule_t('NODE FILE', in_step, is_read, 'FREQUENCY=count:1', output_ignored, 'result, ...'), &
    rule_t('EL FILE', in_step, is_read, 'FREQUENCY=count:1, '// &
    'POSITION=CENTROIDAL|INTEGRATION POINTS|AVERAGED AT NODES|NODES', output_ignored, &
    'result, ...'), &
    rule_t('CONTACT FILE', in_step, is_read, 'FREQUENCY=count:1', output_ignored, 'result, ...'), &
    rule_t('CONTACT PRINT', in_step, is_read, ignored='FREQUENCY, FREQUENCYF, SLAVE, MASTER, '// &
    'NSET, ELSET, SET, TOTALS, TIME POINTS, SUMMARY', data='result, ...'), &
    rule_t('NODE PRINT', in_step, is_read, 'NSET=name, FREQUENCY=count:1, TOTALS=NO|YES|ONLY', &
    print_ignored, 'result, ...'), &
    rule_t('EL PRINT', in_step, is_read, 'ELSET=name, FREQUENCY=count:1, '// &
    'POSITION=INTEGRATION POINTS|CENTROIDAL', print_ignored//', TOTALS', 'result, ...'), &
    rule_t('SURFACE BEHAVIOR', anywhere, is_checked, &
    'PRESSURE-OVERCLOSURE=HARD|LINEAR|SCALE FACTOR|TIED|TABULAR|EXPONENTIAL, NO SEPARATION', &
    'AUGMENTED LAGRANGE, DIRECT, PENALTY'), &
    rule_t('CHANGE SURFACE BEHAVIOR', in_step, is_checked, 'INTERACTION=name!')]

  type(rule_t), parameter :: cards_ignored(*) = [ &
    rule_t('CONTROLS', anywhere, is_ignored), &
    rule_t('CONTACT CONTROLS', anywhere, is_ignored, &
    remark='contact is exact here, and needs no stabilization'), &
    rule_t('CONTACT STABILIZATION', anywhere, is_ignored, &
    remark='bodies are found in equilibrium without artificial damping'), &
    rule_t('CONTACT INITIALIZATION ASSIGNMENT', anywhere, is_ignored, &
    remark='overlaps of the mesh are removed without strain'), &
    rule_t('CONTACT FORMULATION', anywhere, is_ignored, &
    remark='of two bodies the finer mesh is the slave'), &
    rule_t('CONTACT CONTROLS ASSIGNMENT', anywhere, is_ignored, &
    remark='contact is exact here, and needs no stabilization'), &
    rule_t('CHANGE CONTACT TYPE', anywhere, is_ignored, &
    remark='contact is of one type'), &
    rule_t('BULK VISCOSITY', anywhere, is_ignored, &
    remark='explicit steps alone need it, and none is solved so'), &
    rule_t('FIXED MASS SCALING', anywhere, is_ignored, &
    remark='increments are as long as their error allows, and masses those of the deck'), &
    rule_t('VARIABLE MASS SCALING', anywhere, is_ignored, &
    remark='increments are as long as their error allows, and masses those of the deck'), &
    rule_t('SOLUTION TECHNIQUE', anywhere, is_ignored), &
    rule_t('SECTION CONTROLS', anywhere, is_ignored, &
    remark='no element here has hourglass modes'), &
    rule_t('ENERGY PRINT', anywhere, is_ignored), &
    rule_t('SECTION PRINT', anywhere, is_ignored), &
    rule_t('ENERGY FILE', anywhere, is_ignored), &
    rule_t('FILE FORMAT', anywhere, is_ignored), &
    rule_t('FILE OUTPUT', anywhere, is_ignored), &
    rule_t('INCREMENTATION OUTPUT', anywhere, is_ignored), &
    rule_t('DIAGNOSTICS', anywhere, is_ignored), &
    rule_t('OUTPUT', anywhere, is_ignored), &
    rule_t('NODE OUTPUT', anywhere, is_ignored), &
    rule_t('ELEMENT OUTPUT', anywhere, is_ignored), &
    rule_t('CONTACT OUTPUT', anywhere, is_ignored), &
    rule_t('ENERGY OUTPUT', anywhere, is_ignored), &
    rule_t('INTEGRATED OUTPUT', anywhere, is_ignored), &
    rule_t('INTEGRATED OUTPUT SECTION', anywhere, is_ignored), &
    rule_t('PREPRINT', anywhere, is_ignored), &
    rule_t('PRINT', anywhere, is_ignored), &
    rule_t('MONITOR', anywhere, is_ignored), &
    rule_t('TIME POINTS', anywhere, is_ignored), &
    rule_t('RESTART', anywhere, is_ignored), &
    rule_t('CONDUCTIVITY', anywhere, is_ignored), &
    rule_t('SPECIFIC HEAT', anywhere, is_ignored), &
    rule_t('GAP CONDUCTANCE', anywhere, is_ignored), &
    rule_t('FLUID CONSTANTS', anywhere, is_ignored), &
    rule_t('SPECIFIC GAS CONSTANT', anywhere, is_ignored), &
    rule_t('PHYSICAL CONSTANTS', anywhere, is_ignored), &
    rule_t('MAGNETIC PERMEABILITY', anywhere, is_ignored), &
    rule_t('ELECTRICAL CONDUCTIVITY', anywhere, is_ignored)]

  type(rule_t), parameter :: cards_missing(*) = [ &
    rule_t('NO ANALYSIS', anywhere, is_missing, &
    remark='bipot DECK --plan reads a deck and computes nothing'), &
    rule_t('REFINE MESH', anywhere, is_missing, remark='*REFINE and --refine cut elements'), &
    rule_t('SUBMODEL', anywhere, is_missing), &
    rule_t('NORMAL', anywhere, is_missing), &
    rule_t('DISTRIBUTION', anywhere, is_missing), &
    rule_t('CHANGE SOLID SECTION', anywhere, is_missing), &
    rule_t('CHANGE MATERIAL', anywhere, is_missing), &
    rule_t('ANISOTROPIC HYPERELASTIC', anywhere, is_missing, &
    remark='the laws of *HYPERELASTIC and *HYPERFOAM are isotropic'), &
    rule_t('UNIAXIAL TEST DATA', anywhere, is_missing, remark=fitted), &
    rule_t('BIAXIAL TEST DATA', anywhere, is_missing, remark=fitted), &
    rule_t('PLANAR TEST DATA', anywhere, is_missing, remark=fitted), &
    rule_t('SIMPLE SHEAR TEST DATA', anywhere, is_missing, remark=fitted), &
    rule_t('VOLUMETRIC TEST DATA', anywhere, is_missing, remark=fitted), &
    rule_t('NMAP', anywhere, is_missing, remark='write the coordinates as they are'), &
    rule_t('SURFACE PROPERTY ASSIGNMENT', anywhere, is_missing, &
    remark='surfaces are those of their elements'), &
    rule_t('EMBEDDED ELEMENT', anywhere, is_missing, remark='*TIE joins surfaces'), &
    rule_t('IMPERFECTION', anywhere, is_missing, &
    remark='write the coordinates of the nodes as they are'), &
    rule_t('MAP SOLUTION', anywhere, is_missing), &
    rule_t('IMPORT', anywhere, is_missing)]

  type(rule_t), parameter :: cards_outside(*) = [ &
    rule_t('PLASTIC', anywhere, is_outside, &
    remark=elastic_only//'; --elastic runs the deck so, and says how much is above the yield '// &
    'stress'), &
    rule_t('CYCLIC HARDENING', anywhere, is_outside, remark=elastic_only), &
    rule_t('RATE DEPENDENT', anywhere, is_outside, remark=elastic_only), &
    rule_t('CHANGE PLASTIC', anywhere, is_outside, remark=elastic_only), &
    rule_t('POTENTIAL', anywhere, is_outside, remark=elastic_only), &
    rule_t('CAST IRON PLASTICITY', anywhere, is_outside, remark=elastic_only), &
    rule_t('CREEP', anywhere, is_outside, remark=elastic_only), &
    rule_t('VISCOELASTIC', anywhere, is_outside, remark=elastic_only), &
    rule_t('DEFORMATION PLASTICITY', anywhere, is_outside, remark=elastic_only), &
    rule_t('MOHR COULOMB', anywhere, is_outside, remark=elastic_only), &
    rule_t('DRUCKER PRAGER', anywhere, is_outside, remark=elastic_only), &
    rule_t('CAP PLASTICITY', anywhere, is_outside, remark=elastic_only), &
    rule_t('CRUSHABLE FOAM', anywhere, is_outside, remark=elastic_only), &
    rule_t('CONCRETE DAMAGED PLASTICITY', anywhere, is_outside, remark=elastic_only), &
    rule_t('DAMAGE INITIATION', anywhere, is_outside, remark=elastic_only), &
    rule_t('DAMAGE EVOLUTION', anywhere, is_outside, remark=elastic_only), &
    rule_t('SWELLING', anywhere, is_outside, remark=elastic_only), &
    rule_t('MULLINS EFFECT', anywhere, is_outside, remark=elastic_only), &
    rule_t('USER MATERIAL', anywhere, is_outside, remark=elastic_only), &
    rule_t('DEPVAR', anywhere, is_outside, remark=elastic_only), &
    rule_t('USER DEFINED FIELD', anywhere, is_outside, remark=elastic_only), &
    rule_t('SHELL SECTION', anywhere, is_outside, remark=as_solids), &
    rule_t('SHELL GENERAL SECTION', anywhere, is_outside, remark=as_solids), &
    rule_t('BEAM SECTION', anywhere, is_outside, remark=as_solids), &
    rule_t('BEAM GENERAL SECTION', anywhere, is_outside, remark=as_solids), &
    rule_t('MEMBRANE SECTION', anywhere, is_outside, remark=as_solids), &
    rule_t('NODAL THICKNESS', anywhere, is_outside, remark=as_solids), &
    rule_t('COHESIVE SECTION', anywhere, is_outside, remark='a *TIE joins surfaces for good'), &
    rule_t('CONNECTOR SECTION', anywhere, is_outside, &
    remark='*COUPLING, *EQUATION and *TIE join bodies, *TRANSFORM turns the directions'), &
    rule_t('CONNECTOR BEHAVIOR', anywhere, is_outside, &
    remark='*COUPLING, *EQUATION and *TIE join bodies'), &
    rule_t('CONNECTOR ELASTICITY', anywhere, is_outside, &
    remark='*COUPLING, *EQUATION and *TIE join bodies'), &
    rule_t('CONNECTOR MOTION', anywhere, is_outside, &
    remark='*BOUNDARY moves the reference node of a *COUPLING or *RIGID BODY'), &
    rule_t('CONNECTOR LOAD', anywhere, is_outside, &
    remark='*PRE-TENSION SECTION tightens a bolt, *CLOAD loads the reference node of a '// &
    '*COUPLING'), &
    rule_t('COHESIVE BEHAVIOR', anywhere, is_outside, &
    remark='surfaces that stay joined are a *TIE; those that may part, a *CONTACT PAIR'), &
    rule_t('FLUID SECTION', anywhere, is_outside), &
    rule_t('DASHPOT', anywhere, is_outside, remark=static_only), &
    rule_t('MASS', anywhere, is_outside, remark='*DENSITY gives bodies weight'), &
    rule_t('ROTARY INERTIA', anywhere, is_outside, remark=static_only), &
    rule_t('POINT MASS', anywhere, is_outside, remark='*DENSITY gives bodies weight'), &
    rule_t('VISCO', anywhere, is_procedure, remark=static_only), &
    rule_t('FREQUENCY', anywhere, is_procedure, remark=static_only), &
    rule_t('COMPLEX FREQUENCY', anywhere, is_procedure, remark=static_only), &
    rule_t('BUCKLE', anywhere, is_procedure, remark=static_only), &
    rule_t('MODAL DYNAMIC', anywhere, is_procedure, remark=static_only), &
    rule_t('STEADY STATE DYNAMICS', anywhere, is_procedure, remark=static_only), &
    rule_t('RANDOM RESPONSE', anywhere, is_procedure, remark=static_only), &
    rule_t('RESPONSE SPECTRUM', anywhere, is_procedure, remark=static_only), &
    rule_t('SUBSTRUCTURE GENERATE', anywhere, is_procedure, remark=static_only), &
    rule_t('SUBSTRUCTURE PROPERTY', anywhere, is_outside), &
    rule_t('BASE MOTION', anywhere, is_outside, remark=static_only), &
    rule_t('MODAL DAMPING', anywhere, is_outside, remark=static_only), &
    rule_t('GREEN', anywhere, is_procedure, remark=static_only), &
    rule_t('IMPEDANCE', anywhere, is_outside, remark=static_only), &
    rule_t('SELECT EIGENMODES', anywhere, is_outside, remark=static_only), &
    rule_t('COMPLEX MODAL DYNAMIC', anywhere, is_procedure, remark=static_only), &
    rule_t('HEAT TRANSFER', anywhere, is_procedure, remark=no_heat), &
    rule_t('COUPLED TEMPERATURE-DISPLACEMENT', anywhere, is_procedure, remark=no_heat), &
    rule_t('UNCOUPLED TEMPERATURE-DISPLACEMENT', anywhere, is_procedure, remark=no_heat), &
    rule_t('CFLUX', anywhere, is_outside, remark=no_heat), &
    rule_t('DFLUX', anywhere, is_outside, remark=no_heat), &
    rule_t('DSFLUX', anywhere, is_outside, remark=no_heat), &
    rule_t('FILM', anywhere, is_outside, remark=no_heat), &
    rule_t('SFILM', anywhere, is_outside, remark=no_heat), &
    rule_t('RADIATE', anywhere, is_outside, remark=no_heat), &
    rule_t('SRADIATE', anywhere, is_outside, remark=no_heat), &
    rule_t('GAP HEAT GENERATION', anywhere, is_outside, remark=no_heat), &
    rule_t('GAP RADIATION', anywhere, is_outside, remark=no_heat), &
    rule_t('VIEWFACTOR', anywhere, is_outside, remark=no_heat), &
    rule_t('GEOSTATIC', anywhere, is_procedure, remark=static_only), &
    rule_t('SOILS', anywhere, is_procedure), &
    rule_t('PERMEABILITY', anywhere, is_outside), &
    rule_t('ELECTROMAGNETICS', anywhere, is_procedure), &
    rule_t('CFD', anywhere, is_procedure), &
    rule_t('SENSITIVITY', anywhere, is_procedure), &
    rule_t('SELECT CYCLIC SYMMETRY MODES', anywhere, is_outside), &
    rule_t('CONTACT DAMPING', anywhere, is_outside, remark=static_only), &
    rule_t('DESIGN VARIABLES', anywhere, is_outside), &
    rule_t('DESIGN RESPONSE', anywhere, is_outside), &
    rule_t('ROBUST DESIGN', anywhere, is_procedure), &
    rule_t('OBJECTIVE', anywhere, is_outside), &
    rule_t('CONSTRAINT', anywhere, is_outside), &
    rule_t('FEASIBLE DIRECTION', anywhere, is_procedure), &
    rule_t('FILTER', anywhere, is_outside), &
    rule_t('USER ELEMENT', anywhere, is_outside), &
    rule_t('UEL PROPERTY', anywhere, is_outside), &
    rule_t('USER SECTION', anywhere, is_outside), &
    rule_t('CRACK PROPAGATION', anywhere, is_procedure), &
    rule_t('VALUES AT INFINITY', anywhere, is_outside), &
    rule_t('BOUNDARYF', anywhere, is_outside), &
    rule_t('TRANSFORMF', anywhere, is_outside), &
    rule_t('EQUATIONF', anywhere, is_outside), &
    rule_t('MASS FLOW', anywhere, is_outside), &
    rule_t('NETWORK MPC', anywhere, is_outside)]

  type(rule_t), parameter :: deck_table(*) = [cards_read, cards_ignored, cards_missing, &
    cards_outside]

contains

  !> The keyword `name`, blanks and case aside; `found` is false when there is none.
  pure subroutine find_rule(name, rule, found)
    character(*), intent(in) :: name !! without its star
    type(rule_t), intent(out) :: rule
    logical, intent(out) :: found
    integer :: i

    found = .false.
    rule = rule_t('', anywhere, is_missing)
    do i = 1, size(deck_table)
      ! *INITIAL CONDITION is *INITIAL CONDITIONS, too.
      if (.not. (same_word(name, deck_table(i)%name) .or. same_word(trim(name)//'S', &
        deck_table(i)%name))) cycle
      rule = deck_table(i)
      found = .true.
      return
    end do
  end subroutine find_rule

  !> Whether a keyword says what a step computes, something else than a static equilibrium.
  pure logical function is_other_step(name)
    character(*), intent(in) :: name !! without its star
    type(rule_t) :: rule

    call find_rule(name, rule, is_other_step)
    is_other_step = is_other_step .and. rule%reading == is_procedure
  end function is_other_step

  !> What the table says of a keyword that it has.
  pure type(rule_t) function rule_of(name) result(rule)
    character(*), intent(in) :: name
    logical :: found

    call find_rule(name, rule, found)
  end function rule_of

  !> The keywords that are read, for "did you mean".
  function keyword_names() result(names)
    type(string_t), allocatable :: names(:)
    integer :: i, n

    allocate (names(count(deck_table%reading == is_read)))
    n = 0
    do i = 1, size(deck_table)
      if (deck_table(i)%reading /= is_read) cycle
      n = n + 1
      names(n)%text = '*'//trim(deck_table(i)%name)
    end do
  end function keyword_names

  !> The options of a rule, or those that it ignores.
  pure subroutine split_items(options, items)
    character(*), intent(in) :: options
    type(item_t), allocatable, intent(out) :: items(:)
    type(string_t), allocatable :: parts(:)
    character(:), allocatable :: part
    integer :: i, equal, n

    call split_at(options, ',', parts)
    allocate (items(size(parts)))
    do i = 1, size(parts)
      part = parts(i)%text
      n = len(part)
      items(i)%required = part(n:n) == '!'
      if (items(i)%required) part = part(:n - 1)
      n = len(part)
      items(i)%may_stand_alone = part(n:n) == ']'
      if (items(i)%may_stand_alone) part = part(:index(part, '[') - 1)// &
        part(index(part, '[') + 1:n - 1)
      equal = index(part, '=')
      items(i)%default = ''
      items(i)%value = ''
      items(i)%name = part
      if (equal == 0) then
        items(i)%may_stand_alone = .true.
        cycle
      end if
      items(i)%name = part(:equal - 1)
      items(i)%value = part(equal + 1:)
      items(i)%has_words = verify(part(equal + 1:equal + 1), 'ABCDEFGHIJKLMNOPQRSTUVWXYZ') == 0
      n = index(items(i)%value, ':')
      if (n == 0) cycle
      items(i)%default = items(i)%value(n + 1:)
      items(i)%value = items(i)%value(:n - 1)
    end do
  end subroutine split_items

  !> The parts of a text between separators, without the blanks around them.
  pure subroutine split_at(text, separator, parts)
    character(*), intent(in) :: text
    character, intent(in) :: separator
    type(string_t), allocatable, intent(out) :: parts(:)
    integer :: first, next, n, i

    n = 0
    if (text /= '') n = 1 + count([(text(i:i) == separator, i=1, len(text))])
    allocate (parts(n))
    first = 1
    do i = 1, n
      next = index(text(first:)//separator, separator)
      parts(i)%text = trim(adjustl(text(first:first + next - 2)))
      first = first + next
    end do
  end subroutine split_at

  !> `text` in upper case without blanks and tabs: how keywords and parameters are compared.
  pure function squeeze(text) result(squeezed)
    character(*), intent(in) :: text
    character(:), allocatable :: squeezed
    integer :: i, n

    squeezed = upper(text)
    n = 0
    do i = 1, len(squeezed)
      if (squeezed(i:i) == ' ' .or. squeezed(i:i) == achar(9)) cycle
      n = n + 1
      squeezed(n:n) = squeezed(i:i)
    end do
    squeezed = squeezed(:n)
  end function squeeze

  !> `text` with blanks in place of tabs.
  pure function without_tabs(text) result(plain)
    character(*), intent(in) :: text
    character(:), allocatable :: plain
    integer :: i

    plain = text
    do i = 1, len(plain)
      if (plain(i:i) == achar(9)) plain(i:i) = ' '
    end do
  end function without_tabs

  !> Whether two words are the same, blanks, tabs and case aside.
  pure logical function same_word(a, b) result(same)
    character(*), intent(in) :: a, b
    integer :: i, j

    i = 0
    j = 0
    do
      call next_letter(a, i)
      call next_letter(b, j)
      if (i > len(a) .or. j > len(b)) exit
      if (upper(a(i:i)) /= upper(b(j:j))) exit
    end do
    same = i > len(a) .and. j > len(b)
  end function same_word

  !> Whether a word of a keyword line is an option, of which three letters are enough, as a flag or
  !> with this value.
  pure logical function says(word, option, value)
    character(*), intent(in) :: word, option, value
    character(:), allocatable :: given
    integer :: equal

    given = squeeze(word)//'='
    equal = index(given, '=')
    says = equal > 3 .and. index(option, given(:equal - 1)) == 1
    if (says) says = given(equal + 1:) == value//'=' .or. (value == 'YES' .and. equal == len(given))
  end function says

  !> Move `i` to the next letter that is not blank; len(text) + 1 when there is none.
  pure subroutine next_letter(text, i)
    character(*), intent(in) :: text
    integer, intent(inout) :: i

    i = i + 1
    do while (i <= len(text))
      if (text(i:i) /= ' ' .and. text(i:i) /= achar(9)) exit
      i = i + 1
    end do
  end subroutine next_letter

end module deck_table_mod
