!> The scene: everything a deck says, validated, with every name resolved to a number.
module scene_mod
  use kinds_mod, only: wp
  use text_mod, only: string_t
  use material_law_mod, only: law_t
  use constraints_mod, only: constraints_t
  use mesh_mod, only: mesh_t, kind_c3d8i, shown_nodes, joined_nodes
  use mesh_size_mod, only: blocks_t
  use spring_elements_mod, only: foundation_t
  use surfaces_mod, only: surface_t
  use obstacles_mod, only: obstacle_t, ref_nodes
  use friction_laws_mod, only: friction_law_t
  use loads_mod, only: amplitude_t, load_step_t
  use orientations_mod, only: orientation_t
  use controls_mod, only: contact_controls_t, output_controls_t, precision_controls_t, &
    accuracy_controls_t
  implicit none
  private

  public :: scene_t, material_t, contact_pair_t, contact_gap_t, region_t, coupled_rotation_t, &
    local_axes_t, named_set_t, elements_with_modes, master_name, pair_turns, &
    reference_nodes, has_rotations, turn_local

  !> A law, and what warmth and gravity need beside it.
  type :: material_t
    character(:), allocatable :: name
    type(law_t) :: law
    type(orientation_t) :: orientation !! of its axes, where the law is not isotropic
    real(wp) :: mass_damping = 0.0_wp      !! ALPHA of *DAMPING, >= 0 [1/time]
    real(wp) :: stiffness_damping = 0.0_wp !! BETA of *DAMPING, >= 0 [time]
    real(wp) :: density = 0.0_wp   !! > 0 where gravity acts, 0 where not given [mass/length^3]
    real(wp) :: expansion = 0.0_wp !! coefficient of thermal expansion [1/temperature]
    real(wp) :: yield = 0.0_wp
    !! first yield stress, with which stresses are compared; 0: none [force/length^2]
  end type material_t

  !> A named set of the deck, of nodes or of elements.
  type :: named_set_t
    character(:), allocatable :: name   !! upper case
    integer, allocatable :: members(:)  !! node or element numbers, ascending, each once
  end type named_set_t

  !> Elements that a load names.
  type :: region_t
    integer, allocatable :: elements(:) !! element numbers, ascending, each once
    logical :: by_volume = .false.      !! loads are of volume, not of mass
  end type region_t

  !> *CONTACT GAP: nodes that are further from every obstacle than the mesh says.
  !>
  !> Constant, or a paraboloid: distance^2/(2 radius), the distance from `centre` measured across
  !> the obstacle's normal. Gaps of several cards add up.
  type :: contact_gap_t
    integer, allocatable :: nodes(:)   !! node numbers
    logical  :: parabola = .false.
    real(wp) :: value = 0.0_wp         !! where constant [length]
    real(wp) :: centre(3) = 0.0_wp     !! of the paraboloid [length]
    real(wp) :: radius = 1.0_wp        !! of its curvature, not 0 [length]
  end type contact_gap_t

  !> A slave surface that may touch a master: an obstacle, or another surface of faces.
  type :: contact_pair_t
    character(:), allocatable :: name !! "<slave surface>:<master>", as in the result file
    integer  :: surface = 0           !! index into the scene's surfaces
    integer  :: master = 0            !! index into the scene's obstacles; 0: a surface
    real(wp) :: mu = 0.0_wp           !! friction coefficient, the largest, mu >= 0 [-]
    type(friction_law_t) :: law = friction_law_t() !! what pressure makes of it
    logical  :: no_separation = .false. !! what has touched stays closed: its normal force may pull
    integer  :: master_surface = 0    !! index into the scene's surfaces; 0: an obstacle
    logical  :: small_sliding = .false.
    !! before a surface: weights and normals stay those of the undeformed mesh
    real(wp) :: overlap = 0.0_wp
    !! before a surface: how deep in it slave faces are in the deck, at most [length]
    logical  :: has_clearance = .false.
    real(wp) :: clearance = 0.0_wp
    !! of *CLEARANCE: in place of the gaps of the mesh; below 0 an overlap [length]
    character(:), allocatable :: interaction !! name of the surface interaction
    logical :: is_general = .false.   !! general contact made it
    integer, allocatable :: left_open(:)
    !! nodes on faces of the slave that are no slaves, and stay open; not allocated: none
  end type contact_pair_t

  !> A reference node of couplings, and the node whose displacement is its rotation times a length.
  !> By *DISTRIBUTING both are means over a surface.
  type :: coupled_rotation_t
    integer  :: node = 0
    integer  :: rotation_node = 0
    real(wp) :: length = 1.0_wp
    integer,  allocatable :: surface_nodes(:) !! (n) of the mean; not allocated: it is none
    real(wp), allocatable :: share(:)         !! (n) int N_a dA of the area [-]
    real(wp), allocatable :: moment(:, :)     !! (3,n) int N_a (x - x_m) dA of it [length]
    logical :: is_mean(6) = .false.           !! dofs that are means
  end type coupled_rotation_t

  !> Local directions at a node that has values along these.
  type :: local_axes_t
    integer  :: node = 0
    integer  :: stand_in = 0
    !! the node that has them: what supports prescribe and loads put on it, and the forces of the
    !! supports; or the node itself, which nothing else moves
    real(wp) :: direction(3, 3) = 0.0_wp  !! rows: unit vectors in x, y, z [-]
  end type local_axes_t

  !> A validated scene: nothing below this type needs to doubt it, and nothing but its readers, of
  !> the deck and of the options, changes it.
  type :: scene_t
    character(:), allocatable :: title
    character(:), allocatable :: units      !! names for labels, as "N, mm"; '' where not given
    character(:), allocatable :: name       !! the deck's file name without folder and ending
    character(:), allocatable :: deck       !! the deck as read, includes put in
    type(string_t), allocatable :: files(:) !! paths of the deck and of what it includes
    character(:), allocatable :: overrides
    !! of the command line, one a line: name=value, --accuracy value, --refine times
    logical :: finite_strain = .false.      !! *STEP, NLGEOM
    logical :: stops_when_steady = .false.  !! --until-steady
    type(mesh_t) :: mesh
    type(blocks_t) :: blocks(3)             !! NX, NY and NZ of those that may have others
    type(constraints_t) :: constraints      !! of *TIE, *EQUATION, *COUPLING; no cycles
    type(material_t),     allocatable :: materials(:)
    type(surface_t),      allocatable :: surfaces(:)
    integer :: n_named_surfaces = 0         !! the first so many: of *SURFACE and *BLOCK
    type(named_set_t),    allocatable :: node_sets(:)
    !! those that have members, surfaces of nodes among them
    type(named_set_t),    allocatable :: element_sets(:)  !! likewise
    type(obstacle_t),     allocatable :: obstacles(:)
    type(contact_pair_t), allocatable :: pairs(:)
    integer, allocatable :: may_overlap(:, :)
    !! (2,n) pieces of the mesh, the lower first, that general contact of everything leaves out; not
    !! allocated: there is no such contact
    type(contact_gap_t),  allocatable :: gaps(:)
    type(coupled_rotation_t), allocatable :: rotations(:) !! not allocated: none
    type(local_axes_t),   allocatable :: local_axes(:)    !! not allocated: none
    type(foundation_t),   allocatable :: foundations(:) !! not allocated: none
    type(region_t),       allocatable :: regions(:)
    type(amplitude_t),    allocatable :: amplitudes(:)
    type(load_step_t),    allocatable :: steps(:)
    real(wp), allocatable :: first_temperature(:) !! (n_nodes) where nothing expands; else 0
    real(wp), allocatable :: first_velocity(:, :)
    !! (3,n_nodes) as the run begins; not allocated: 0 [length/time]
    type(contact_controls_t) :: contact
    type(output_controls_t)  :: output
    type(precision_controls_t) :: precision
    type(accuracy_controls_t) :: accuracy
    type(string_t), allocatable :: notes(:) !! what was ignored or noticed, one sentence each
  end type scene_t

contains

  !> How many elements have modes that are part of a state: those of C3D8I at finite strain.
  pure integer function elements_with_modes(scene) result(n)
    type(scene_t), intent(in) :: scene

    n = 0
    if (scene%finite_strain) n = count(scene%mesh%element_kind == kind_c3d8i)
  end function elements_with_modes

  !> The name of a pair's master.
  pure function master_name(scene, pair) result(name)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: pair
    character(:), allocatable :: name

    associate (of => scene%pairs(pair))
      if (of%master > 0) then
        name = scene%obstacles(of%master)%name
      else
        name = scene%surfaces(of%master_surface)%name
      end if
    end associate
  end function master_name

  !> Nodes of the deck that move or carry forces beside the elements, ascending: reference nodes of
  !> obstacles and couplings (these even if an element has them: they have rotations), and nodes
  !> that equations alone name.
  pure function reference_nodes(scene) result(nodes)
    type(scene_t), intent(in) :: scene
    integer, allocatable :: nodes(:)
    logical :: is_one(scene%mesh%n_nodes)
    integer :: node

    is_one = joined_nodes(scene%mesh)
    is_one(shown_nodes(scene%mesh) + 1:) = .false.
    if (allocated(scene%obstacles)) is_one(ref_nodes(scene%obstacles)) = .true.
    if (allocated(scene%rotations)) then
      is_one(scene%rotations%node) = .true.
      is_one(scene%rotations%rotation_node) = .false.
    end if
    nodes = pack([(node, node=1, size(is_one))], is_one)
  end function reference_nodes

  !> Whether reference nodes turn: of obstacles as the steps prescribe, of couplings.
  pure logical function has_rotations(scene)
    type(scene_t), intent(in) :: scene

    has_rotations = allocated(scene%rotations)
    if (allocated(scene%obstacles)) has_rotations = has_rotations .or. any(scene%obstacles%turns)
  end function has_rotations

  !> Whether a pair faces an obstacle that turns.
  pure logical function pair_turns(scene, pair)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: pair

    pair_turns = .false.
    associate (master => scene%pairs(pair)%master)
      if (master > 0) pair_turns = scene%obstacles(master)%turns
    end associate
  end function pair_turns

  !> Put what nodes have along local directions into x, y, z: in their place, or what stands at the
  !> nodes that stand in for them beside it.
  pure subroutine turn_local(scene, of_nodes, in_place, values)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: of_nodes(:, :)  !! (3,n_nodes) of the state
    logical, intent(in) :: in_place         !! only what is in its place
    real(wp), intent(inout) :: values(:, :) !! (3, nodes of the deck) the same, and turned
    integer :: k

    if (.not. allocated(scene%local_axes)) return
    do k = 1, size(scene%local_axes)
      associate (of => scene%local_axes(k))
        if (of%stand_in == of%node) then
          values(:, of%node) = matmul(of_nodes(:, of%node), of%direction)
        else if (.not. in_place) then
          values(:, of%node) = values(:, of%node) + matmul(of_nodes(:, of%stand_in), of%direction)
        end if
      end associate
    end do
  end subroutine turn_local

end module scene_mod
