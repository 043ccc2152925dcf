!> What does not change between increments: unknowns, factor, compliance, contact problem, responses
!> to the loads.
module operators_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t, raise, exit_wrong_input
  use text_mod, only: to_text
  use system_mod, only: wall_seconds
  use mesh_mod, only: node_neighbours
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t
  use mesh_forces_mod, only: internal_force
  use dof_map_mod, only: dof_map_t, make_dof_map
  use assembly_mod, only: triplets_t, assemble_stiffness
  use ordering_mod, only: order_equations
  use sparse_factor_mod, only: sparse_factor_t, factorise
  use rigid_modes_mod, only: count_free_motions
  use search_mod, only: locate
  use compliance_mod, only: invert_schur, point_stiffness, rows_of_points, compliance_of_rows
  use problem_mod, only: contact_problem_t, make_problem
  use step_loads_mod, only: step_loads_t, resolve_loads, prescribed_dofs
  implicit none
  private

  public :: operators_t, make_operators, prepare_step, apply_inverse

  !> Wall time of the phases [s].
  type :: phase_seconds_t
    real(wp) :: assemble = 0.0_wp
    real(wp) :: order = 0.0_wp
    real(wp) :: factorise = 0.0_wp !! Schur complement included
    real(wp) :: condense = 0.0_wp  !! inverse, rows
    real(wp) :: loads = 0.0_wp     !! responses to the load patterns
  end type phase_seconds_t

  !> Made once for as long as the same degrees of freedom are prescribed.
  type :: operators_t
    logical, allocatable :: prescribed(:, :)      !! (3,n_nodes)
    type(dof_map_t) :: map
    type(sparse_factor_t) :: factor
    real(wp), allocatable :: compliance(:, :)     !! (n_interface,n_interface) [length/force]
    real(wp), allocatable :: frame(:, :, :)       !! (3,3,n_points) columns n, t1, t2
    real(wp), allocatable :: initial_gap(:)       !! (n_points) of the undeformed mesh [length]
    integer, allocatable :: active(:) !! points that have rows, in the order of the problem
    logical, allocatable :: has_friction(:, :)    !! (2,n_points) tangents along which the law acts
    type(contact_problem_t) :: problem            !! over the active points
    type(step_loads_t) :: loads                   !! of the present *STEP
    real(wp), allocatable :: response(:, :, :)
    !! (3,n_nodes,n_patterns) displacements under each pattern [length]
    type(phase_seconds_t) :: seconds              !! summed over the run
    integer :: n_factorisations = 0
  end type operators_t

contains

  !> Make everything that depends only on which degrees of freedom are prescribed.
  subroutine make_operators(scene, points, prescribed, operators, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    logical, intent(in) :: prescribed(:, :)  !! (3,n_nodes)
    type(operators_t), intent(inout) :: operators
    type(error_t), allocatable, intent(out) :: error
    !! a body that is not held; a singular matrix; no memory
    type(triplets_t) :: k
    integer, allocatable :: start(:), neighbours(:), place(:)
    real(wp), allocatable :: stiffness(:, :, :)
    real(wp) :: clock

    call check_held(scene, prescribed, error)
    if (allocated(error)) return
    operators%prescribed = prescribed
    operators%map = make_dof_map(scene%mesh%body, prescribed, points%node)

    clock = wall_seconds()
    call node_neighbours(scene%mesh, start, neighbours)
    call assemble_stiffness(scene%mesh, scene%materials, operators%map, start, neighbours, k)
    call lap(clock, operators%seconds%assemble)
    call order_equations(operators%map, start, neighbours, place, error)
    if (allocated(error)) return
    call lap(clock, operators%seconds%order)
    call factorise(k, place, operators%map%n_interface, operators%factor, operators%compliance, &
      error)
    if (allocated(error)) return
    operators%n_factorisations = operators%n_factorisations + 1
    call lap(clock, operators%seconds%factorise)
    call locate_points(scene, points, operators)
    stiffness = point_stiffness(operators%map, points, operators%frame, operators%compliance)
    call invert_schur(operators%compliance, error)
    if (allocated(error)) return
    call make_contact(points, stiffness, operators)
    call lap(clock, operators%seconds%condense)
  end subroutine make_operators

  !> Frames and gaps of the contact points on the undeformed mesh.
  subroutine locate_points(scene, points, operators)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(operators_t), intent(inout) :: operators
    integer :: i

    if (allocated(operators%frame)) deallocate (operators%frame, operators%initial_gap)
    allocate (operators%frame(3, 3, points%n), operators%initial_gap(points%n))
    do i = 1, points%n
      associate (pair => scene%pairs(points%pair(i)))
        call locate(scene%obstacles(pair%obstacle), scene%mesh%coordinates(:, points%node(i)), &
                    operators%initial_gap(i), operators%frame(:, :, i))
      end associate
    end do
  end subroutine locate_points

  !> Rows of the contact points, and the contact problem over those that have any.
  subroutine make_contact(points, stiffness, operators)
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: stiffness(:, :, :)
    !! (3,3,n_points) of the Schur complement at the points
    type(operators_t), intent(inout) :: operators
    real(wp), allocatable :: w(:, :)
    integer :: row(3, points%n), i

    call rows_of_points(operators%map, points, operators%frame, row)
    call compliance_of_rows(operators%map, points, operators%frame, row, operators%compliance, w)
    operators%active = pack([(i, i=1, points%n)], row(1, :) > 0)
    operators%has_friction = row(2:, :) > 0
    if (count(row > 0) == operators%map%n_interface .and. all(row > 0)) then
      call make_problem(row, points%mu, w, operators%problem, stiffness)
    else
      call make_problem(row(:, operators%active), points%mu(operators%active), w, operators%problem)
    end if
  end subroutine make_contact

  !> Every body must be held by its supports: contact alone cannot hold one yet.
  subroutine check_held(scene, prescribed, error)
    type(scene_t), intent(in) :: scene
    logical, intent(in) :: prescribed(:, :)
    type(error_t), allocatable, intent(out) :: error
    integer :: body, n_free, first

    do body = 1, scene%mesh%n_bodies
      call count_free_motions(scene%mesh, body, prescribed, n_free, error)
      if (allocated(error)) return
      if (n_free == 0) cycle
      first = findloc_first(scene%mesh%body, body)
      call raise(error, exit_wrong_input, 'the body of node '// &
        to_text(scene%mesh%node_id(first))// &
        ' is not held: its prescribed displacements leave '//to_text(n_free)// &
        ' of its 6 rigid motions free, '// &
        'and contact alone cannot hold a body')
      return
    end do
  end subroutine check_held

  pure function findloc_first(list, value) result(first)
    integer, intent(in) :: list(:), value
    integer :: first

    do first = 1, size(list)
      if (list(first) == value) return
    end do
  end function findloc_first

  !> At the start of a *STEP: its load patterns and the displacements they cause without contact.
  subroutine prepare_step(scene, step, state, operators, error)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    type(state_t), intent(in) :: state
    type(operators_t), intent(inout) :: operators
    type(error_t), allocatable, intent(out) :: error !! MUMPS failed
    real(wp), allocatable :: load(:, :, :)
    real(wp) :: clock
    integer :: g

    clock = wall_seconds()
    call resolve_loads(scene, step, state%displacement, operators%loads)
    associate (loads => operators%loads)
      load = loads%force
      do g = 1, loads%n_patterns
        ! Prescribed displacements act through the forces they cause in an otherwise undeformed
        ! body.
        call internal_force(scene%mesh, scene%materials, loads%displacement(:, :, g), load(:, :, g))
        load(:, :, g) = loads%force(:, :, g) - load(:, :, g)
      end do
      call apply_inverse(operators, load, operators%response, error)
      if (allocated(error)) return
      operators%response = operators%response + loads%displacement
    end associate
    call lap(clock, operators%seconds%loads)
  end subroutine prepare_step

  !> K^-1 f for nodal forces f, several at once; prescribed degrees of freedom stay 0.
  subroutine apply_inverse(operators, force, displacement, error)
    type(operators_t), intent(inout) :: operators
    real(wp), intent(in) :: force(:, :, :)                    !! (3,n_nodes,m) [force]
    real(wp), allocatable, intent(out) :: displacement(:, :, :) !! (3,n_nodes,m) [length]
    type(error_t), allocatable, intent(out) :: error          !! MUMPS failed
    real(wp), allocatable :: b(:, :), reduced(:, :)
    integer :: g, node, i

    associate (map => operators%map)
      allocate (b(map%n_free, size(force, 3)), reduced(map%n_interface, size(force, 3)))
      do g = 1, size(force, 3)
        do node = 1, size(force, 2)
          do i = 1, 3
            if (map%equation(i, node) > 0) b(map%equation(i, node), g) = force(i, node, g)
          end do
        end do
      end do
      if (map%n_interface == 0) then
        call operators%factor%solve(b, error)
      else
        call operators%factor%condense(b, reduced, error)
        if (allocated(error)) return
        reduced = matmul(operators%compliance, reduced)
        call operators%factor%expand(reduced, b, error)
      end if
      if (allocated(error)) return
      allocate (displacement(3, size(force, 2), size(force, 3)), source=0.0_wp)
      do g = 1, size(force, 3)
        do node = 1, size(force, 2)
          do i = 1, 3
            if (map%equation(i, node) > 0) displacement(i, node, g) = b(map%equation(i, node), g)
          end do
        end do
      end do
    end associate
  end subroutine apply_inverse

  !> Add the time since `clock` to `total` and start the clock again.
  subroutine lap(clock, total)
    real(wp), intent(inout) :: clock, total
    real(wp) :: now

    now = wall_seconds()
    total = total + now - clock
    clock = now
  end subroutine lap

end module operators_mod
