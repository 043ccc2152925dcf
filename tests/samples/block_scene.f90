!> Scenes of a block on a rigid plane for the tests of this folder, and their run.
module block_scene
  use kinds_mod, only: wp
  use new_law_mod, only: new_law
  use connectivity_mod, only: make_hexahedra
  use errors_mod, only: error_t
  use mesh_mod, only: find_bodies, kind_c3d8
  use block_mesh_mod, only: block_coordinates, block_connectivity, block_face, graded_positions, &
    face_zmin, face_zmax
  use loads_mod, only: nodal_value_t, load_step_t
  use scene_mod, only: scene_t
  use choices_mod, only: choices_t
  use plan_mod, only: plan_t
  use state_mod, only: state_t, initial_state
  use increments_mod, only: increment_t, next_increment
  use increment_report_mod, only: increment_report_t, has_converged
  use make_plan_mod, only: make_plan
  use step_loads_mod, only: prescribed_dofs
  use linearisation_mod, only: solver_work_t
  use step_solver_mod, only: step_solver_t, set_supports, prepare_step
  use trial_mod, only: goal_t
  use advance_mod, only: advance
  use sample_meshes, only: nodes_of_faces
  implicit none
  private

  public :: run_t, new_scene, add_step, hold_nodes, paper_block, side_nodes
  public :: run_scene, start_run, next_step, first_choices

  integer, parameter, public :: bottom = 1, top = 2 !! surfaces of every scene

  !> A run under way: everything that goes from increment to increment.
  type :: run_t
    type(plan_t) :: plan
    type(step_solver_t) :: solver
    type(solver_work_t) :: work
    type(state_t) :: state
    type(increment_report_t) :: report
    type(error_t), allocatable :: error
  end type run_t

contains

  !> A block of n(1) x n(2) x n(3) elements, E = 210000, its bottom at z = 0 before the plane z = 0;
  !> no steps yet.
  function new_scene(n, length, nu, mu) result(scene)
    integer, intent(in) :: n(3)
    real(wp), intent(in) :: length(3), nu, mu
    type(scene_t) :: scene

    allocate (scene%mesh%coordinates(3, product(n + 1)))
    scene%mesh%coordinates = block_coordinates([0.0_wp, 0.0_wp, 0.0_wp], length, &
                                               graded_positions(n(1), 1.0_wp), &
                                               graded_positions(n(2), 1.0_wp), &
                                               graded_positions(n(3), 1.0_wp))
    scene%mesh%connectivity = make_hexahedra(block_connectivity(n))
    scene%mesh%n_nodes = size(scene%mesh%coordinates, 2)
    scene%mesh%n_elements = product(n)
    scene%mesh%node_id = numbers(scene%mesh%n_nodes)
    scene%mesh%element_id = numbers(scene%mesh%n_elements)
    scene%mesh%element_kind = spread(kind_c3d8, 1, scene%mesh%n_elements)
    scene%mesh%material = spread(1, 1, scene%mesh%n_elements)
    call find_bodies(scene%mesh)

    allocate (scene%materials(1), scene%surfaces(2), scene%obstacles(1), scene%pairs(1))
    allocate (scene%amplitudes(0), scene%steps(0), scene%notes(0), scene%gaps(0), scene%regions(0))
    scene%title = 'block'
    scene%name = 'block'
    scene%deck = ''
    scene%overrides = ''
    scene%materials(1)%name = 'steel'
    scene%materials(1)%law = new_law('ELASTIC', [210000.0_wp, nu])
    scene%surfaces(bottom)%name = 'bottom'
    scene%surfaces(bottom)%faces = block_face(n, face_zmin)
    scene%surfaces(bottom)%nodes = nodes_of_faces(scene%mesh%connectivity, scene%mesh%n_nodes, &
                                                  scene%surfaces(bottom)%faces)
    scene%surfaces(top)%name = 'top'
    scene%surfaces(top)%faces = block_face(n, face_zmax)
    scene%surfaces(top)%nodes = nodes_of_faces(scene%mesh%connectivity, scene%mesh%n_nodes, &
                                               scene%surfaces(top)%faces)
    scene%obstacles(1)%name = 'plane'
    scene%obstacles(1)%normal = [0.0_wp, 0.0_wp, 1.0_wp]
    scene%pairs(1)%name = 'bottom:plane'
    scene%pairs(1)%surface = bottom
    scene%pairs(1)%master = 1
    scene%pairs(1)%mu = mu
    scene%contact%tolerance = 1.0e-12_wp
  end function new_scene

  !> Another *STEP of a period of 1, without loads.
  subroutine add_step(scene, n_increments)
    type(scene_t), intent(inout) :: scene
    integer, intent(in) :: n_increments
    type(load_step_t) :: step

    step%n_increments = n_increments
    step%direct = .true.
    step%increment = 1.0_wp/n_increments
    allocate (step%boundary(0), step%forces(0), step%pressures(0), step%face_pressures(0), &
      step%gravity(0))
    scene%steps = [scene%steps, step]
  end subroutine add_step

  !> In the last *STEP, prescribe a displacement of `nodes`.
  subroutine hold_nodes(scene, nodes, dof, value)
    type(scene_t), intent(inout) :: scene
    integer, intent(in) :: nodes(:), dof
    real(wp), intent(in) :: value
    integer :: i

    associate (step => scene%steps(size(scene%steps)))
      do i = 1, size(nodes)
        step%boundary = [step%boundary, nodal_value_t(nodes(i), dof, value, 0)]
      end do
    end associate
  end subroutine hold_nodes

  !> The paper's block: a cube of 1, down by 0.1 in 10 increments, then 0.4 along 60 degrees in 40.
  function paper_block(n, nu) result(scene)
    integer, intent(in) :: n
    real(wp), intent(in) :: nu
    type(scene_t) :: scene
    real(wp), parameter :: angle = acos(-1.0_wp)/3.0_wp

    scene = new_scene([n, n, n], [1.0_wp, 1.0_wp, 1.0_wp], nu, 0.3_wp)
    associate (nodes => scene%surfaces(top)%nodes)
      call add_step(scene, 10)
      call hold_nodes(scene, nodes, 1, 0.0_wp)
      call hold_nodes(scene, nodes, 2, 0.0_wp)
      call hold_nodes(scene, nodes, 3, -0.1_wp)
      call add_step(scene, 40)
      call hold_nodes(scene, nodes, 1, 0.4_wp*cos(angle))
      call hold_nodes(scene, nodes, 2, 0.4_wp*sin(angle))
    end associate
  end function paper_block

  !> The nodes whose coordinate `axis` is `value`.
  function side_nodes(scene, axis, value) result(nodes)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: axis
    real(wp), intent(in) :: value
    integer, allocatable :: nodes(:)

    nodes = pack(scene%mesh%node_id, abs(scene%mesh%coordinates(axis, :) - value) < 1.0e-9_wp)
  end function side_nodes

  !> Plan, solver and undeformed state.
  subroutine start_run(scene, run)
    type(scene_t), intent(in) :: scene
    type(run_t), intent(inout) :: run

    call make_plan(scene, first_choices(scene), run%plan, run%error)
    if (allocated(run%error)) return
    run%solver%choices = run%plan%choices
    run%state = initial_state(scene%mesh%n_nodes, run%plan%points%n, 0)
    ! What was solved before may have been another scene with the same supports.
    if (allocated(run%solver%body%prescribed)) deallocate (run%solver%body%prescribed)
    call set_supports(scene, run%plan%points, 1, prescribed_dofs(scene, 1), run%solver, run%work, &
      run%error)
  end subroutine start_run

  !> What the deck says, on its own mesh.
  pure type(choices_t) function first_choices(scene)
    type(scene_t), intent(in) :: scene

    first_choices = choices_t(tolerance=scene%contact%tolerance, &
      compliance=scene%contact%compliance, precision=scene%precision)
  end function first_choices

  !> One increment of the run.
  subroutine next_step(scene, run)
    type(scene_t), intent(in) :: scene
    type(run_t), intent(inout) :: run
    type(increment_t) :: increment
    type(state_t) :: new

    increment = next_increment(scene%steps, run%state)
    if (increment%first_of_step) then
      call set_supports(scene, run%plan%points, increment%step, prescribed_dofs(scene, &
        increment%step), run%solver, run%work, run%error)
      if (allocated(run%error)) return
      call prepare_step(scene, increment%step, run%state, run%solver, run%work, run%error)
      if (allocated(run%error)) return
    end if
    call advance(scene, run%plan%points, run%solver, run%state, goal_t(increment, &
      run%solver%choices%tolerance), new, run%report, run%error)
    if (.not. allocated(run%error)) run%state = new
  end subroutine next_step

  !> The first `n_increments` of a scene, all of them certified or `certified` is false.
  subroutine run_scene(scene, n_increments, run, certified)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: n_increments
    type(run_t), intent(inout) :: run
    logical, intent(out) :: certified
    integer :: i

    certified = .true.
    call start_run(scene, run)
    do i = 1, n_increments
      if (.not. allocated(run%error)) call next_step(scene, run)
      certified = certified .and. .not. allocated(run%error)
      certified = certified .and. has_converged(run%report) .and. run%report%certificate%certified
    end do
  end subroutine run_scene

  pure function numbers(n) result(list)
    integer, intent(in) :: n
    integer :: list(n), i

    list = [(i, i=1, n)]
  end function numbers

end module block_scene
