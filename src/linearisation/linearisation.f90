!> The bodies at one displacement with the supports of a *STEP: their tangent, its factor or an
!> iterative solver, the compliance of the interface, and the rigid-body modes left free.
!>
!> It is made as a whole by `make_linearisation`, and serves until `invalidate`: of bodies whose
!> forces are linear as long as the same degrees of freedom are prescribed, of others as long as
!> iterations with it are few. Supports of obstacles alone change nothing but the motions.
module linearisation_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t, raise, exit_not_solved
  use text_mod, only: to_text
  use system_mod, only: wall_seconds
  use block_diagonal_mod, only: block_diagonal_t, take_blocks, invert_blocks, norm_of_blocks
  use norm_estimate_mod, only: norm_estimate_t
  use near_stiffness_mod, only: near_stiffness_t, find_near
  use constraints_mod, only: constraints_t, active_constraints
  use linked_nodes_mod, only: coupled_nodes, node_neighbours
  use mesh_mod, only: moved_mesh
  use obstacles_mod, only: ref_nodes
  use contact_points_mod, only: contact_points_t, contact_nodes, master_nodes
  use controls_mod, only: is_exact, precision_in_words, compliance_products
  use scene_mod, only: scene_t
  use choices_mod, only: choices_t
  use dof_map_mod, only: dof_map_t, make_dof_map, interface_equations_of, to_nodes, unknowns_of
  use bodies_mod, only: is_linear, find_internal_force
  use mesh_forces_mod, only: stiffness_of_elements
  use turning_couplings_mod, only: has_turning, turned_constraints
  use stiffen_couplings_mod, only: stiffen_couplings
  use inertia_mod, only: inertia_t, mass_factors
  use damping_mod, only: stiffened
  use state_mod, only: modes_t
  use finite_forces_mod, only: tangent_t
  use assembly_mod, only: triplets_t, add_mass, diagonal_of, diagonal_ratio, assemble_stiffness
  use mesh_parts_mod, only: assemble_parts
  use node_parts_mod, only: assemble_node_parts, node_part_t
  use ordering_mod, only: order_equations
  use sparse_factor_mod, only: factorise, is_analysed, analysed_order
  use stiffness_inverse_mod, only: stiffness_inverse_t, add_rank, solve_equations, abandon_inverse
  use iterative_body_mod, only: numbering_t
  use new_iterative_body_mod, only: new_iterative_body
  use near_schur_mod, only: near_schur_t, probe_schur, blocks_nearby
  use tied_pieces_mod, only: check_pieces
  use rigid_modes_mod, only: free_motions_t, find_free_motions, hold_pins
  implicit none
  private

  public :: linearisation_t, solver_work_t, begin_linearisation, make_linearisation, invalidate, &
    change_obstacle_supports, invert_schur, point_stiffness, lap, sum_of, seconds_of

  real(wp), parameter :: left_alone = 0.5_wp
  !! of the diagonal of the stiffness, in that of the condensed one: about, where none is found [-]
  real(wp), parameter :: few = 3.0_wp !! times its diagonal: a row of the condensed stiffness [-]

  type :: linearisation_t
    ! What it is made for:
    logical, allocatable :: prescribed(:, :)
    !! (3,n_nodes) reference nodes included; not allocated: it serves for nothing
    type(tangent_t), allocatable :: tangent
    !! with the displacement it is made at; not allocated: undeformed bodies at small strain
    type(inertia_t), allocatable :: inertia       !! of a dynamic *STEP
    integer :: made_after = 0                     !! increments done there, tangent_of of state_t
    ! What is made:
    type(constraints_t) :: constraints            !! those that hold with these supports
    type(free_motions_t) :: motions               !! rigid motions that supports leave free
    type(stiffness_inverse_t), pointer :: inverse => null()
    !! with the motions pinned; a pointer, for compliances that are products solve with it
    type(near_stiffness_t) :: stiffness           !! of the Schur complement at the points, x, y, z
    real(wp), allocatable :: diagonal(:, :)
    !! (3,n_nodes) of the stiffness, where there is a factor [force/length]
    real(wp), allocatable :: flexibility(:)
    !! (n_interface) of the unknowns of the interface, each alone, where nothing is condensed
    !! [length/force]
    real(wp), allocatable :: pin_flexibility(:)
    !! (n) the same of the pins, where solutions are by iteration [length/force]
    real(wp), allocatable :: of_elements(:)
    !! (n_elements) as of stiffness_of_elements, for the rounding of forces [force/length]
  contains
    final :: release_inverse
  end type linearisation_t

  !> What solving for bodies and loads has taken, summed over a run.
  type :: solver_work_t
    real(wp) :: assemble = 0.0_wp  !! wall time [s]
    real(wp) :: order = 0.0_wp     !! wall time [s]
    real(wp) :: factorise = 0.0_wp !! wall time, Schur complement included [s]
    real(wp) :: condense = 0.0_wp  !! wall time of the inverse and the contact rows [s]
    real(wp) :: loads = 0.0_wp     !! wall time of the responses to load patterns [s]
    integer  :: n_factorisations = 0
    integer  :: n_stiffnesses = 0  !! stiffness matrices of elements that were computed
  end type solver_work_t

contains

  !> Find the free motions, factorise the stiffness and condense it to the interface.
  subroutine make_linearisation(scene, choices, points, interface, body, work, error)
    type(scene_t), intent(in) :: scene
    type(choices_t), intent(in) :: choices     !! their precision and compliance
    type(contact_points_t), intent(in) :: points
    logical, intent(in) :: interface(:, :)     !! (3,n_nodes) what is condensed to
    type(linearisation_t), intent(inout) :: body
    !! what it is made for in; its factor may hold the analysis of the plan
    type(solver_work_t), intent(inout) :: work
    type(error_t), allocatable, intent(out) :: error
    !! a singular matrix; pieces that ties do not hold; no memory
    type(triplets_t) :: k
    integer, allocatable :: start(:), neighbours(:), order(:)
    real(wp), allocatable :: schur(:, :)
    real(wp) :: clock, condensed
    integer :: n_stiffnesses, n_schur

    if (.not. associated(body%inverse)) call begin_linearisation(body)
    body%of_elements = stiffness_of_elements(scene%mesh, scene%materials)
    body%inverse%factor%precision = choices%precision
    call hold_bodies(scene, points, body, error)
    if (allocated(error)) return
    clock = wall_seconds()
    associate (inverse => body%inverse)
      inverse%map = make_dof_map(scene%mesh%body, hold_pins(body%motions, body%prescribed), &
        interface, body%constraints)
      inverse%is_condensed = choices%compliance /= compliance_products
      if (choices%precision%iterative) then
        call make_iterative(scene, points, interface, body, work, error)
        return
      end if
      call coupled_nodes(scene%mesh, body%constraints, start, neighbours)
      n_schur = merge(inverse%map%n_interface, 0, inverse%is_condensed)
      if (allocated(body%inertia)) then
        call assemble_stiffness(scene%mesh, stiffened(body%inertia%damping, scene%materials, &
          body%inertia%slope), inverse%map, start, neighbours, k, n_stiffnesses, body%tangent)
        call add_mass(scene%mesh, body%inertia, inverse%map, start, neighbours, k)
      else
        call assemble_parts(scene%mesh, scene%materials, inverse%map, start, neighbours, k, &
          n_stiffnesses, body%tangent)
      end if
      call add_couplings(scene, body, k)
      work%n_stiffnesses = work%n_stiffnesses + n_stiffnesses
      if (allocated(body%diagonal)) deallocate (body%diagonal)
      allocate (body%diagonal(3, scene%mesh%n_nodes))
      call to_nodes(inverse%map, abs(diagonal_of(k)), body%diagonal)
      call lap(clock, work%assemble)
      if (is_analysed(inverse%factor, k, n_schur)) then
        order = analysed_order(inverse%factor) ! by the plan
      else
        call order_equations(inverse%map, start, neighbours, order, error, n_schur)
        if (allocated(error)) return
      end if
      call lap(clock, work%order)
      if (.not. inverse%is_condensed) then
        ! Before the factor of the whole, so that one is there at a time.
        call look_nearby(scene, points, start, neighbours, order, k, body, error)
        if (allocated(error)) return
        ! Ranks give up their parts with every factor.
        if (k%is_distributed) call assemble_parts(scene%mesh, scene%materials, inverse%map, start, &
          neighbours, k, n_stiffnesses)
        call lap(clock, work%condense)
      end if
      call factorise(k, order, n_schur, inverse%factor, schur, error)
      if (allocated(error)) return
      work%n_factorisations = work%n_factorisations + 1
      call lap(clock, work%factorise)
      if (.not. inverse%is_condensed) then
        call add_rigid_inertia(scene, body, error)
        if (allocated(error)) return
        call estimate_condition(scene, k, body, error)
        call lap(clock, work%condense)
        return
      end if
      body%stiffness = point_stiffness(inverse%map, points%node, schur)
      inverse%condition = diagonal_ratio(k)
      ! Not beside the copies of the blocks.
      deallocate (k%row, k%column, k%value)
      call take_blocks(schur, inverse%map%body_first, inverse%compliance)
      condensed = norm_of_blocks(inverse%compliance)
      call invert_schur(inverse%compliance, error)
      if (allocated(error)) then
        if (.not. is_exact(choices%precision)) error%message = error%message//'; the factor ('// &
          precision_in_words(choices%precision)//') is not exact: full rank and '// &
          'FACTOR=DOUBLE of *PRECISION hold more'
        return
      end if
      inverse%condition = max(inverse%condition, condensed*norm_of_blocks(inverse%compliance))
    end associate
    call add_rigid_inertia(scene, body, error)
    call lap(clock, work%condense)
  end subroutine make_linearisation

  !> Have the inverse know what puts right the inertia of pieces along their rigid motions.
  subroutine add_rigid_inertia(scene, body, error)
    type(scene_t), intent(in) :: scene
    type(linearisation_t), intent(inout) :: body
    type(error_t), allocatable, intent(out) :: error !! MUMPS failed
    real(wp), allocatable :: pattern(:, :, :), strength(:, :, :)
    real(wp) :: factor(scene%mesh%n_nodes)
    integer :: place(scene%mesh%n_pieces) !! of a piece in its body
    integer :: body_of(scene%mesh%n_pieces), node, piece, k

    if (.not. allocated(body%inertia)) return
    factor = mass_factors(body%inertia)
    associate (mesh => scene%mesh, mass => body%inertia%mass)
      body_of = 0
      do node = 1, mesh%n_nodes
        if (mesh%piece(node) > 0) body_of(mesh%piece(node)) = mesh%body(node)
      end do
      do piece = 1, mesh%n_pieces
        place(piece) = count(body_of(:piece) == body_of(piece))
      end do
      allocate (pattern(3, mesh%n_nodes, 6*maxval(place)), strength(6*maxval(place), &
        6*maxval(place), mesh%n_bodies), source=0.0_wp)
      do node = 1, mesh%n_nodes
        piece = mesh%piece(node)
        if (piece == 0) cycle
        do k = 1, 6
          pattern(:, node, 6*place(piece) - 6 + k) = mass%pattern(:, k, node)
        end do
      end do
      do piece = 1, mesh%n_pieces
        associate (last => 6*place(piece))
          strength(last - 5:last, last - 5:last, body_of(piece)) = factor(findloc(mesh%piece, &
            piece, dim=1))*mass%missing(:, :, piece)
        end associate
      end do
      call add_rank(body%inverse, pattern, strength, mesh%body, error)
    end associate
  end subroutine add_rigid_inertia

  !> What supports and constraints hold of the bodies, and the motions that they leave free.
  subroutine hold_bodies(scene, points, body, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(linearisation_t), intent(inout) :: body
    type(error_t), allocatable, intent(out) :: error
    !! pieces that ties do not hold; motions that iteration does not cover; LAPACK failed

    call find_motions(scene, points, body, error)
    if (allocated(error)) return
    if (body%inverse%factor%precision%iterative) call check_motions(body%motions, error)
    if (allocated(error)) return
    body%constraints = active_constraints(turned_constraints(scene, body%prescribed, &
      place_of_tangent(scene, body)), body%prescribed)
    ! Inertia holds what nothing else does.
    if (.not. allocated(body%inertia)) call check_pieces(scene%mesh, body%constraints, &
      body%prescribed, body%motions, error)
  end subroutine hold_bodies

  !> An iterative solver in the place of a factor, of bodies whose supports and motions are known.
  subroutine make_iterative(scene, points, interface, body, work, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    logical, intent(in) :: interface(:, :)     !! (3,n_nodes) as of make_linearisation
    type(linearisation_t), intent(inout) :: body
    type(solver_work_t), intent(inout) :: work
    type(error_t), allocatable, intent(out) :: error !! METIS or the library failed; no memory
    type(numbering_t) :: numbering
    type(node_part_t) :: summed
    integer, allocatable :: row(:), start(:), neighbours(:)
    real(wp) :: clock
    integer :: n_stiffnesses

    clock = wall_seconds()
    associate (inverse => body%inverse)
      numbering = numbering_t(make_dof_map(scene%mesh%body, body%prescribed, interface, &
        body%constraints), inverse%map, body%motions%node, body%motions%dof, &
        facing_nodes(scene, points, body%constraints))
      call coupled_nodes(scene%mesh, body%constraints, start, neighbours)
      call assemble_node_parts(scene%mesh, scene%materials, numbering%whole, start, neighbours, &
        row, summed, n_stiffnesses, error)
      if (allocated(error)) return
      work%n_stiffnesses = work%n_stiffnesses + n_stiffnesses
      call lap(clock, work%assemble)
      call stand_alone(scene%mesh%n_nodes, points, summed%k, numbering%whole, body)
      if (allocated(inverse%iterative)) deallocate (inverse%iterative)
      call new_iterative_body(summed, row, numbering, inverse%iterative, error)
      if (allocated(error)) return
      call lap(clock, work%factorise)
      call estimate_condition(scene, summed%k, body, error)
      call lap(clock, work%condense)
    end associate
  end subroutine make_iterative

  !> The nodes of surfaces of bodies before each other, and what they depend on, ascending.
  pure function facing_nodes(scene, points, constraints) result(nodes)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(constraints_t), intent(in) :: constraints !! active ones
    integer, allocatable :: nodes(:)
    integer :: pair, c
    logical :: is_facing(scene%mesh%n_nodes)

    is_facing = .false.
    do pair = 1, size(scene%pairs)
      associate (masters => master_nodes(points, pair))
        if (.not. any(scene%mesh%body(masters) > 0)) cycle
        is_facing(masters) = .true.
        is_facing(points%node(points%first(pair):points%first(pair + 1) - 1)) = .true.
      end associate
    end do
    do c = 1, constraints%n
      if (is_facing(constraints%node(c))) is_facing(constraints%master(constraints%first(c): &
        constraints%first(c + 1) - 1)) = .true.
    end do
    nodes = pack([(c, c=1, size(is_facing))], is_facing)
  end function facing_nodes

  !> Refuse free motions that iteration does not cover.
  subroutine check_motions(motions, error)
    type(free_motions_t), intent(in) :: motions
    type(error_t), allocatable, intent(out) :: error

    if (any(motions%body == 0)) then
      call raise(error, exit_not_solved, '*BODY SOLVER, TYPE=ITERATIVE does not cover '// &
        'obstacles that move freely; TYPE=FACTOR does')
    else if (allocated(motions%piece)) then
      call raise(error, exit_not_solved, '*BODY SOLVER, TYPE=ITERATIVE does not cover bodies '// &
        'that equations join and supports do not hold; TYPE=FACTOR does')
    end if
  end subroutine check_motions

  !> An inverse for the factor to be in, once.
  subroutine begin_linearisation(body)
    type(linearisation_t), intent(inout) :: body

    allocate (body%inverse)
  end subroutine begin_linearisation

  !> Have the next use make all of it anew, but for the analysis of the factor.
  subroutine invalidate(body)
    type(linearisation_t), intent(inout) :: body

    if (allocated(body%prescribed)) deallocate (body%prescribed)
    if (allocated(body%tangent)) deallocate (body%tangent)
    if (allocated(body%diagonal)) deallocate (body%diagonal)
    if (allocated(body%inertia)) deallocate (body%inertia)
    body%made_after = 0
    if (.not. associated(body%inverse)) return
    if (allocated(body%inverse%failure)) deallocate (body%inverse%failure)
    if (allocated(body%inverse%added)) deallocate (body%inverse%added)
    call abandon_inverse(body%inverse)
  end subroutine invalidate

  !> Give the inverse back, and the factor with it.
  subroutine release_inverse(body)
    type(linearisation_t), intent(inout) :: body

    if (associated(body%inverse)) deallocate (body%inverse)
  end subroutine release_inverse

  !> The stiffness near the points, without a Schur complement.
  subroutine look_nearby(scene, points, start, neighbours, order, k, body, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: start(:), neighbours(:) !! of the nodes, as of coupled_nodes
    integer, intent(in) :: order(:)                !! (n_free) of elimination
    type(triplets_t), intent(in) :: k              !! with its values; made anew where it is shared
    type(linearisation_t), intent(inout) :: body
    type(error_t), allocatable, intent(out) :: error !! MUMPS failed
    type(triplets_t) :: whole
    type(near_schur_t) :: schur
    integer, allocatable :: first(:), sharing(:)
    integer :: index(3, points%n), i

    ! Constraints couple what may be far apart, a whole face to one node.
    call node_neighbours(scene%mesh, first, sharing)
    associate (map => body%inverse%map, precision => body%inverse%factor%precision)
      if (k%is_distributed) then
        call assemble_stiffness(scene%mesh, scene%materials, map, start, neighbours, whole)
        call probe_schur(whole, map, order, first, sharing, precision, schur, error)
      else
        call probe_schur(k, map, order, first, sharing, precision, schur, error)
      end if
      if (allocated(error)) return
      do i = 1, points%n
        index(:, i) = interface_equations_of(map, points%node(i))
      end do
      call blocks_nearby(schur, index, body%stiffness, body%flexibility)
    end associate
  end subroutine look_nearby

  !> The stiffness of the points, and how far the interface gives way, as their own unknowns say
  !> alone.
  subroutine stand_alone(n_nodes, points, k, whole, body)
    integer, intent(in) :: n_nodes
    type(contact_points_t), intent(in) :: points
    type(triplets_t), intent(in) :: k     !! with its values
    type(dof_map_t), intent(in) :: whole  !! of k
    type(linearisation_t), intent(inout) :: body
    real(wp) :: diagonal(k%n), of_nodes(3, n_nodes)
    integer :: index(3), i, a

    diagonal = left_alone*diagonal_of(k)
    call to_nodes(whole, diagonal, of_nodes)
    associate (map => body%inverse%map, near => body%stiffness)
      diagonal(:map%n_free) = unknowns_of(map, of_nodes)
      body%flexibility = 1.0_wp/diagonal(map%n_free - map%n_interface + 1:map%n_free)
      body%pin_flexibility = [(1.0_wp/of_nodes(body%motions%dof(i), body%motions%node(i)), &
        i=1, body%motions%n)]
      near%start = [(i, i=1, points%n + 1)]
      near%other = [(i, i=1, points%n)]
      if (allocated(near%block)) deallocate (near%block)
      allocate (near%block(3, 3, points%n), source=0.0_wp)
      do i = 1, points%n
        index = interface_equations_of(map, points%node(i))
        do a = 1, 3
          if (index(a) > 0) near%block(a, a, i) = 1.0_wp/body%flexibility(index(a))
        end do
      end do
    end associate
  end subroutine stand_alone

  !> The condition of the whole without a Schur complement, by some solutions.
  subroutine estimate_condition(scene, k, body, error)
    type(scene_t), intent(in) :: scene
    type(triplets_t), intent(in) :: k     !! with its values
    type(linearisation_t), intent(inout) :: body
    type(error_t), allocatable, intent(out) :: error !! MUMPS failed
    type(norm_estimate_t) :: norm
    real(wp), allocatable :: x(:), b(:, :)

    associate (inverse => body%inverse, n => body%inverse%map%n_interface)
      if (is_linear(scene) .and. .not. is_exact(inverse%factor%precision)) then
        inverse%mesh = scene%mesh
        inverse%materials = scene%materials
      end if
      allocate (x(n), b(inverse%map%n_free, 1))
      do while (n > 0)
        if (.not. norm%goes_on(x)) exit
        b = 0.0_wp
        b(size(b, 1) - n + 1:, 1) = x
        call solve_equations(inverse, b, .true., error)
        if (allocated(error)) return
        x = b(size(b, 1) - n + 1:, 1)
      end do
      ! A row of the condensed stiffness has at most some times its diagonal.
      inverse%condition = diagonal_ratio(k)
      if (n > 0) inverse%condition = max(inverse%condition, few*norm%estimate/ &
        minval(body%flexibility))
    end associate
  end subroutine estimate_condition

  !> Other supports of obstacles alone: the factor stays, the free motions do not.
  subroutine change_obstacle_supports(scene, points, prescribed, body, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    logical, intent(in) :: prescribed(:, :)    !! (3,n_nodes)
    type(linearisation_t), intent(inout) :: body
    type(error_t), allocatable, intent(out) :: error !! LAPACK failed

    body%prescribed = prescribed
    call find_motions(scene, points, body, error)
  end subroutine change_obstacle_supports

  !> The motions that supports leave free, with pins that hold bodies where the stiffness is of.
  subroutine find_motions(scene, points, body, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(linearisation_t), intent(inout) :: body !! gets them
    type(error_t), allocatable, intent(out) :: error
    !! LAPACK failed
    real(wp) :: at(3, scene%mesh%n_nodes)
    type(free_motions_t) :: undeformed

    at = place_of_tangent(scene, body)
    allocate (undeformed%body(0))
    if (allocated(body%tangent)) call find_free_motions(scene%mesh, body%prescribed, &
      ref_nodes(scene%obstacles), contact_nodes(points), undeformed, error, scene%constraints)
    if (allocated(error)) return
    call find_free_motions(moved_mesh(scene%mesh, at), body%prescribed, &
      ref_nodes(scene%obstacles), contact_nodes(points), body%motions, error, &
      turned_constraints(scene, body%prescribed, at), undeformed)
    body%motions%are_finite = .not. is_linear(scene)
    if (.not. allocated(body%inertia)) return
    ! What mass a tool of a free reference node has nothing says; bodies need no pins.
    if (any(body%motions%body == 0)) then
      call raise(error, exit_not_solved, '*DYNAMIC: reference node '//to_text( &
        scene%mesh%node_id(body%motions%node(findloc(body%motions%body, 0, dim=1))))// &
        ' of an obstacle is free, and an obstacle has no mass: *BOUNDARY must hold it or move it')
      return
    end if
    call find_free_motions(scene%mesh, spread(spread(.true., 1, 3), 2, scene%mesh%n_nodes), &
      ref_nodes(scene%obstacles), contact_nodes(points), body%motions, error)
  end subroutine find_motions

  !> The displacement that a linearisation is made at [length].
  pure function place_of_tangent(scene, body) result(at)
    type(scene_t), intent(in) :: scene
    type(linearisation_t), intent(in) :: body
    real(wp) :: at(3, scene%mesh%n_nodes)

    at = 0.0_wp
    if (allocated(body%tangent)) at = body%tangent%at
  end function place_of_tangent

  !> Add what forces on the nodes of turning couplings do to the tangent as these turn, as far as it
  !> leaves nothing out that is negative; of forces that stresses alone answer with.
  subroutine add_couplings(scene, body, k)
    type(scene_t), intent(in) :: scene
    type(linearisation_t), intent(in) :: body
    type(triplets_t), intent(inout) :: k
    type(modes_t) :: modes
    real(wp) :: f(3, scene%mesh%n_nodes)
    integer :: inverted

    if (.not. has_turning(scene) .or. .not. allocated(body%tangent)) return
    associate (tangent => body%tangent)
      call find_internal_force(scene, tangent%free, tangent%at, modes, f, inverted)
      call stiffen_couplings(scene, body%prescribed, tangent%at, f, 1.0_wp - tangent%projection, &
        body%inverse%map, k)
    end associate
  end subroutine add_couplings

  !> Replace the Schur complement by its inverse, body by body.
  subroutine invert_schur(s, error)
    type(block_diagonal_t), intent(inout) :: s
    !! stiffness [force/length], compliance out [length/force]
    type(error_t), allocatable, intent(out) :: error !! not positive definite
    logical :: positive_definite

    call invert_blocks(s, positive_definite)
    if (.not. positive_definite) call raise(error, exit_not_solved, &
      'the stiffness condensed to the contact nodes is not positive definite: a body is not '// &
      'held, or flat elements or the material are at the limit of what double precision holds')
  end subroutine invert_schur

  !> The blocks of the Schur complement at the slave nodes, as far as they matter.
  pure function point_stiffness(map, contact_node, s) result(near)
    type(dof_map_t), intent(in) :: map
    integer, intent(in) :: contact_node(:) !! (n_points)
    real(wp), intent(in) :: s(:, :)       !! (n_interface,n_interface) [force/length]
    type(near_stiffness_t) :: near        !! x, y, z; 0 along prescribed directions
    integer :: index(3, size(contact_node)), i

    do i = 1, size(contact_node)
      index(:, i) = interface_equations_of(map, contact_node(i))
    end do
    call find_near(index, s, near)
  end function point_stiffness

  !> The sum of two records.
  pure type(solver_work_t) function sum_of(one, other) result(both)
    type(solver_work_t), intent(in) :: one, other

    both = solver_work_t(one%assemble + other%assemble, one%order + other%order, &
      one%factorise + other%factorise, one%condense + other%condense, one%loads + other%loads, &
      one%n_factorisations + other%n_factorisations, one%n_stiffnesses + other%n_stiffnesses)
  end function sum_of

  !> Total wall time [s].
  pure real(wp) function seconds_of(work)
    type(solver_work_t), intent(in) :: work

    seconds_of = work%assemble + work%order + work%factorise + work%condense + work%loads
  end function seconds_of

  !> Add the time since `clock` to `total` and start the clock again.
  subroutine lap(clock, total)
    real(wp), intent(inout) :: clock, total !! [s]
    real(wp) :: now

    now = wall_seconds()
    total = total + now - clock
    clock = now
  end subroutine lap

end module linearisation_mod
