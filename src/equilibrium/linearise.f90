!> The matrix of an iteration of the equilibrium, on displacements and reactions together.
!> docs/theory.md (4.25).
module linearise_mod
  use kinds_mod, only: wp
  use growing_lists_mod, only: enlarge
  use constraints_mod, only: follow_masters
  use linked_nodes_mod, only: coupled_nodes
  use obstacles_mod, only: ref_nodes
  use grips_mod, only: is_turning
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t, list_slave
  use finite_forces_mod, only: tangent_t
  use bodies_mod, only: find_tangent_force
  use turning_couplings_mod, only: coupling_stiffness
  use dof_map_mod, only: dof_map_t, make_dof_map, interface_terms_of, to_equations, to_nodes
  use assembly_mod, only: triplets_t, assemble_stiffness, add_mass, diagonal_of
  use inertia_mod, only: change_of_inertia
  use load_stiffness_mod, only: load_stiffness_t, load_stiffnesses, &
    mean_stiffnesses
  use point_rows_mod, only: point_row_t
  use transfer_mod, only: nodal_forces
  use friction_laws_mod, only: largest_friction
  use iterate_mod, only: task_t, iterate_t, world_reactions
  implicit none
  private

  public :: unknowns_t, number_unknowns, bodies_stiffness_t, find_bodies_stiffness, find_scales, &
    set_t, step_t, system_t, linearise, holding, derive_law, derive_driven

  !> What is sought of the bodies.
  type :: unknowns_t
    type(dof_map_t) :: map                  !! of all that can move, nothing pinned
    integer, allocatable :: first(:)
    !! (3 n_nodes+1) what each degree of freedom is of unknowns: where these begin
    integer, allocatable :: equation(:)
    real(wp), allocatable :: factor(:)
  end type unknowns_t

  !> The tangent of the bodies at one place.
  type :: bodies_stiffness_t
    type(triplets_t) :: k                   !! lower triangle
    real(wp), allocatable :: diagonal(:, :) !! (3,n_nodes) [force/length]
  end type bodies_stiffness_t

  !> What the points are taken to do, and how much holds back what nothing holds.
  type :: set_t
    logical, allocatable :: presses(:), slides(:) !! (n_points)
    real(wp), allocatable :: rho(:)         !! (n_points) [force/length]
    real(wp), allocatable :: y(:, :)
    !! (3,n_points) r - rho x that friction is linearised about; not allocated: that of now [force]
    logical :: sticks = .false.             !! nothing slides before it is known what presses
    logical :: lands = .false.              !! a body comes to points, which are not to open
    real(wp) :: on_bodies = 0.0_wp          !! of what `holding` says [-]
    real(wp) :: on_reactions = 0.0_wp       !! of 1/rho [-]
    real(wp) :: error = 1.0_wp              !! how far all is from balance and law there [-]
  end type set_t

  !> The step of an iteration.
  type :: step_t
    real(wp), allocatable :: u(:, :) !! (3,n_nodes) what is prescribed goes its whole way [length]
    real(wp), allocatable :: r(:, :) !! (3,n_points) in the frames of the place [force]
  end type step_t

  !> The equations of a step. What is prescribed goes its whole way.
  type :: system_t
    type(point_row_t), allocatable :: rows(:) !! of the points that press
    type(triplets_t) :: a
    !! what points and loads add to the tangent of the bodies; entries of one place add up
    integer :: n_free = 0                   !! equations of the bodies; those of points follow
    integer, allocatable :: row(:, :)       !! (3,n_points) of the points that press, 0: none
    real(wp), allocatable :: b(:)           !! (n) right-hand side [force]
    real(wp), allocatable :: known(:, :)    !! (3,n_nodes) prescribed changes [length]
    logical :: is_whole = .true.
    !! else without what the forces of loads and reactions change by, as of (4.27)
    integer, private :: n_entries = 0       !! while it is put together
    real(wp), allocatable, private :: force(:, :) !! (3,n_nodes) right-hand side [force]
  end type system_t

contains

  !> Number what can move.
  subroutine number_unknowns(scene, task, now, of)
    type(scene_t), intent(in) :: scene
    type(task_t), intent(in) :: task
    type(iterate_t), intent(in) :: now
    type(unknowns_t), intent(out) :: of
    integer, allocatable :: equations(:)
    real(wp), allocatable :: coefficients(:)
    integer :: body(scene%mesh%n_nodes), node, i, n, pass
    logical :: all_of(3, scene%mesh%n_nodes)

    body = scene%mesh%body
    ! Reference nodes of obstacles move as bodies of their own.
    associate (nodes => ref_nodes(scene%obstacles))
      body(nodes) = max(body(nodes), [(scene%mesh%n_bodies + i, i=1, size(nodes))])
    end associate
    all_of = .true.
    of%map = make_dof_map(body, task%forces%prescribed, all_of, now%constraints)
    allocate (of%first(3*scene%mesh%n_nodes + 1))
    do pass = 1, 2
      n = 0
      do node = 1, scene%mesh%n_nodes
        do i = 1, 3
          of%first(3*node - 3 + i) = n + 1
          call interface_terms_of(of%map, node, i, equations, coefficients)
          if (pass == 2) of%equation(n + 1:n + size(equations)) = equations
          if (pass == 2) of%factor(n + 1:n + size(equations)) = coefficients
          n = n + size(equations)
        end do
      end do
      of%first(3*scene%mesh%n_nodes + 1) = n + 1
      if (pass == 1) allocate (of%equation(n), of%factor(n))
    end do
  end subroutine number_unknowns

  !> The tangent at a place.
  subroutine find_bodies_stiffness(scene, task, now, map, of)
    type(scene_t), intent(in) :: scene
    type(task_t), intent(in) :: task
    type(iterate_t), intent(in) :: now
    type(dof_map_t), intent(in) :: map      !! of `number_unknowns`
    type(bodies_stiffness_t), intent(out) :: of
    integer, allocatable :: start(:), neighbours(:)

    call coupled_nodes(scene%mesh, now%constraints, start, neighbours)
    call assemble_stiffness(scene%mesh, scene%materials, map, start, neighbours, of%k, &
      tangent=tangent_here(task, now))
    if (allocated(task%inertia)) call add_mass(scene%mesh, task%inertia, map, start, neighbours, &
      of%k)
    allocate (of%diagonal(3, scene%mesh%n_nodes))
    call to_nodes(map, abs(diagonal_of(of%k)), of%diagonal)
  end subroutine find_bodies_stiffness

  !> Where the bodies' tangent is taken.
  pure type(tangent_t) function tangent_here(task, now) result(tangent)
    type(task_t), intent(in) :: task
    type(iterate_t), intent(in) :: now

    tangent = tangent_t(now%u, task%free, projection=0.0_wp, modes=now%modes)
  end function tangent_here

  !> How stiff each point's nodes are against its reaction, of the diagonal of the stiffness.
  pure function find_scales(points, diagonal, now) result(rho)
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: diagonal(:, :) !! (3,n_nodes) of the stiffness [force/length]
    type(iterate_t), intent(in) :: now
    real(wp) :: rho(points%n) !! [force/length]
    integer :: i, k, n, node(3)
    real(wp) :: factor(3)

    do i = 1, points%n
      rho(i) = 0.0_wp
      call list_slave(points, now%placement%weights, i, n, node, factor)
      do k = 1, n
        rho(i) = max(rho(i), abs(factor(k))*maxval(diagonal(:, node(k))))
      end do
      do k = now%placement%weights%first(i), now%placement%weights%first(i + 1) - 1
        rho(i) = max(rho(i), abs(now%placement%weights%weight(k))*maxval(diagonal(:, &
          now%placement%weights%node(k))))
      end do
      if (.not. rho(i) > 0.0_wp) rho(i) = sum(diagonal)/max(1, count(diagonal > 0.0_wp))
    end do
  end function find_scales

  !> The equations of an iteration, without the tangent of the bodies and what holds them back.
  subroutine linearise(scene, points, task, now, unknowns, set, stiffness, system)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(task_t), intent(in) :: task
    type(iterate_t), intent(in) :: now
    type(unknowns_t), intent(in) :: unknowns
    type(set_t), intent(in) :: set
    type(bodies_stiffness_t), intent(in) :: stiffness !! of now, or before
    type(system_t), intent(inout) :: system !! its rows and `is_whole` are there, the rest is made
    type(point_row_t), allocatable :: rows(:)
    real(wp), allocatable :: added(:, :, :)
    integer :: i, k, n

    n = unknowns%map%n_free
    system%n_free = n
    system%row = spread([0, 0, 0], 2, points%n)
    do i = 1, points%n
      if (.not. set%presses(i)) cycle
      do k = 1, 3
        if (.not. now%has(k, i)) cycle
        n = n + 1
        system%row(k, i) = n
      end do
    end do
    system%a%n = n
    system%b = [(0.0_wp, i=1, n)]
    ! What does not press lets go of what it has.
    system%force = now%residual - nodal_forces(points, now%placement%weights, merge( &
      world_reactions(now), 0.0_wp, spread(.not. set%presses, 1, 3)), scene%mesh%n_nodes)
    system%known = merge(task%forces%displacement - now%u, 0.0_wp, task%forces%prescribed)
    call follow_masters(now%constraints, system%known)
    if (any(abs(system%known) > 0.0_wp)) then
      allocate (added(3, scene%mesh%n_nodes, 1))
      call find_tangent_force(scene, reshape(system%known, shape(added)), added, &
        tangent_here(task, now))
      if (allocated(task%inertia)) added(:, :, 1) = added(:, :, 1) + change_of_inertia( &
        task%inertia, system%known)
      system%force = system%force - added(:, :, 1)
    end if
    system%a%row = [integer ::]
    system%a%column = [integer ::]
    system%a%value = [real(wp) ::]
    system%n_entries = 0
    if (system%is_whole) call add_loads(scene, task, now, unknowns, stiffness, system)
    call move_alloc(system%rows, rows)
    do k = 1, size(rows)
      call add_point(points%mu(rows(k)%point), now, unknowns, set, rows(k), &
        system%row(:, rows(k)%point), system)
    end do
    call move_alloc(rows, system%rows)
    associate (a => system%a, n_entries => system%n_entries)
      a%row = a%row(:n_entries)
      a%column = a%column(:n_entries)
      a%value = a%value(:n_entries)
    end associate
    ! What is prescribed has no equation.
    call to_equations(unknowns%map, system%force, system%b(:system%n_free))
  end subroutine linearise

  !> What holds back each unknown of bodies that nothing holds, where all of it does: the mean
  !> diagonal of each body over the number of its nodes, so that all of them together hold it as one
  !> does and a slender body bends freely; of all bodies, for what has no elements.
  pure function holding(scene, task, map, diagonal) result(held)
    type(scene_t), intent(in) :: scene
    type(task_t), intent(in) :: task
    type(dof_map_t), intent(in) :: map
    real(wp), intent(in) :: diagonal(:, :) !! (3,n_nodes) of the stiffness [force/length]
    real(wp) :: held(map%n_free)           !! [force/length]
    real(wp) :: total(0:scene%mesh%n_bodies), share(0:scene%mesh%n_bodies)
    integer :: body, number(0:scene%mesh%n_bodies), node

    total = 0.0_wp
    number = 0
    do node = 1, size(diagonal, 2)
      body = scene%mesh%body(node)
      total(body) = total(body) + sum(diagonal(:, node))
      number(body) = number(body) + count(diagonal(:, node) > 0.0_wp)
    end do
    total(0) = sum(total)
    number(0) = sum(number)
    share = 3.0_wp/max(3, number)
    associate (its => scene%mesh%body(map%node))
      held = merge(total(its)/max(1, number(its))*share(its), 0.0_wp, task%is_free(its))
    end associate
  end function holding

  !> What loads that follow bodies, and moments of forces on turning couplings, change by.
  subroutine add_loads(scene, task, now, unknowns, stiffness, system)
    type(scene_t), intent(in) :: scene
    type(task_t), intent(in) :: task
    type(iterate_t), intent(in) :: now
    type(unknowns_t), intent(in) :: unknowns
    type(bodies_stiffness_t), intent(in) :: stiffness
    type(system_t), intent(inout) :: system
    type(load_stiffness_t), allocatable :: of(:)
    real(wp) :: k(3, 3)
    integer :: l, p, q, i, j

    allocate (of(0))
    if (allocated(task%turned_from) .and. allocated(stiffness%k%row)) of = mean_stiffnesses( &
      scene, now%u, now%unbalanced, size(stiffness%k%row))
    if (allocated(now%forces%dead_load)) of = [of, load_stiffnesses(scene, &
      now%forces%following, now%u)]
    do l = 1, size(of)
      do q = 1, size(of(l)%node)
        do p = 1, size(of(l)%node)
          call add_block(unknowns, of(l)%node(p), of(l)%node(q), &
            of(l)%k(3*p - 2:3*p, 3*q - 2:3*q), system)
        end do
      end do
    end do
    if (.not. allocated(task%turned_from)) return
    do i = 1, size(scene%rotations)
      if (.not. is_turning(scene, i)) cycle
      k = coupling_stiffness(scene, task%forces%prescribed, now%u, -now%unbalanced, i, &
        task%turned_from)
      j = scene%rotations(i)%rotation_node
      call add_block(unknowns, j, j, k, system)
    end do
  end subroutine add_loads

  !> One point: B^T r with what it changes by, and its rows of the law.
  subroutine add_point(mu, now, unknowns, set, of, row, system)
    real(wp), intent(in) :: mu              !! [-]
    type(iterate_t), intent(in) :: now
    type(unknowns_t), intent(in) :: unknowns
    type(set_t), intent(in) :: set
    type(point_row_t), intent(in) :: of
    integer, intent(in) :: row(3)           !! of the matrix, 0: none
    type(system_t), intent(inout) :: system
    real(wp) :: x_by(3, 3), by_r(3, 3), by_x(3, 3), off(3), turns(3, 3), y(3), p_y(3)
    integer :: p, q, a, i

    i = of%point
    associate (r => now%reaction(:, i), frame => now%frame(:, :, i), rho => set%rho(i))
      if (now%is_driven(i)) then
        call derive_driven(mu, rho, now, i, by_r, by_x, off)
      else
        y = merge(r - rho*now%x(:, i), 0.0_wp, now%has(:, i))
        off = y
        if (allocated(set%y)) y = set%y(:, i)
        call derive_law(mu, now, i, set%slides(i), y, by_x, p_y)
        off = r - p_y + matmul(by_x, y - off)
        by_r = -by_x
        do a = 1, 3
          by_r(a, a) = 1.0_wp + by_r(a, a)
        end do
      end if
      do a = 1, 3
        by_r(a, a) = by_r(a, a) + set%on_reactions
      end do
      do a = 1, 3
        if (row(a) == 0) cycle
        system%b(row(a)) = system%b(row(a)) + off(a)
        do p = 1, 3
          if (row(p) > 0) call add(system, row(a), row(p), -by_r(a, p))
        end do
      end do
      turns = r(1)*reshape([1, 0, 0, 0, 1, 0, 0, 0, 1], [3, 3]) + r(2)*of%of_tangent(:, :, 1) + &
        r(3)*of%of_tangent(:, :, 2)
      do q = 1, size(of%node)
        x_by(1, :) = of%gap(:, q)
        do a = 2, 3
          x_by(a, :) = matmul(frame(:, a), of%slip(:, :, q)) + matmul(matmul(now%slip(:, i), &
            of%of_tangent(:, :, a - 1)), of%normal(:, :, q))
        end do
        x_by = rho*matmul(by_x, x_by)
        do a = 1, 3
          if (row(a) > 0) call add_law(unknowns, row(a), of%node(q), -x_by(a, :), system)
        end do
        if (abs(of%part(q)) > 0.0_wp) then
          do a = 1, 3
            if (row(a) > 0) call add_reaction(unknowns, of%node(q), row(a), &
              -of%part(q)*frame(:, a), system)
          end do
        end if
        if (system%is_whole) call add_turns(unknowns, of, q, matmul(frame, r), turns, system)
      end do
    end associate
  end subroutine add_point

  !> What the forces of a point's reaction change by as one of its nodes moves.
  subroutine add_turns(unknowns, of, q, reaction, turns, system)
    type(unknowns_t), intent(in) :: unknowns
    type(point_row_t), intent(in) :: of
    integer, intent(in) :: q                !! of its nodes
    real(wp), intent(in) :: reaction(3)     !! in x, y, z [force]
    real(wp), intent(in) :: turns(3, 3)     !! what that changes by with the normal [force]
    type(system_t), intent(inout) :: system
    real(wp) :: turned(3, 3), k(3, 3)
    integer :: m(size(of%node)), p, a

    m = 0
    do p = 1, size(of%master)
      if (any(abs(of%weight(:, p, q)) > 0.0_wp)) m(findloc(of%node, of%master(p), dim=1)) = p
    end do
    turned = matmul(turns, of%normal(:, :, q))
    do p = 1, size(of%node)
      if (m(p) == 0 .and. .not. (abs(of%part(p)) > 0.0_wp .and. any(abs(turned) > 0.0_wp))) cycle
      k = -of%part(p)*turned
      if (m(p) > 0) then
        do a = 1, 3
          k(:, a) = k(:, a) + reaction*of%weight(a, m(p), q)
        end do
      end if
      call add_block(unknowns, of%node(p), of%node(q), k, system)
    end do
  end subroutine add_turns

  !> The law P(y) of a point at y = r - rho x, and its derivative, in the branch that is taken.
  pure subroutine derive_law(mu, now, i, slides, y, j, p)
    real(wp), intent(in) :: mu              !! [-]
    type(iterate_t), intent(in) :: now
    integer, intent(in) :: i                !! point
    logical, intent(in) :: slides
    real(wp), intent(in) :: y(3)            !! [force]
    real(wp), intent(out) :: j(3, 3), p(3)  !! [-], [force]
    real(wp) :: t(2), size_y, part, radius, slope
    integer :: a, b

    j = 0.0_wp
    do a = 1, 3
      if (now%has(a, i)) j(a, a) = 1.0_wp
    end do
    p = y
    if (.not. slides) return
    call largest_friction(mu, now%law, i, y(1), radius, slope)
    size_y = norm2(y(2:))
    t = 0.0_wp
    if (size_y > 0.0_wp) t = y(2:)/size_y
    part = 0.0_wp
    if (size_y > 0.0_wp) part = radius/size_y
    do b = 1, 2
      do a = 1, 2
        j(a + 1, b + 1) = part*(j(a + 1, b + 1) - t(a)*t(b))
      end do
    end do
    if (.not. y(1) < 0.0_wp) j(2:, 1) = slope*t
    p(2:) = part*y(2:)
  end subroutine derive_law

  !> Derivatives of what a driven point is off the law by: of its reaction, and over rho of its gap
  !> and slip.
  pure subroutine derive_driven(mu, rho, now, i, by_r, by_x, off)
    real(wp), intent(in) :: mu, rho         !! [-], [force/length]
    type(iterate_t), intent(in) :: now
    integer, intent(in) :: i                !! point
    real(wp), intent(out) :: by_r(3, 3), by_x(3, 3), off(3) !! [-], [-], [force]
    real(wp) :: t(2), length, radius, slope
    integer :: a

    associate (r => now%reaction(:, i), x => now%x(:, i))
      call largest_friction(mu, now%law, i, r(1), radius, slope)
      length = norm2(x(2:))
      t = x(2:)/length
      by_r = 0.0_wp
      by_x = 0.0_wp
      by_x(1, 1) = 1.0_wp
      off(1) = rho*x(1)
      off(2:) = r(2:) + radius*t
      if (.not. r(1) < 0.0_wp) by_r(2:, 1) = slope*t
      by_x(2:, 2:) = -spread(t, 2, 2)*spread(t, 1, 2)
      do a = 2, 3
        by_r(a, a) = 1.0_wp
        by_x(a, a) = by_x(a, a) + 1.0_wp
      end do
      by_x(2:, 2:) = by_x(2:, 2:)*(radius/(rho*length))
    end associate
  end subroutine derive_driven

  !> A block of the stiffness between two nodes, and what it makes of known changes.
  subroutine add_block(unknowns, of, by, k, system)
    type(unknowns_t), intent(in) :: unknowns
    integer, intent(in) :: of, by           !! nodes
    real(wp), intent(in) :: k(3, 3)         !! [force/length]
    type(system_t), intent(inout) :: system
    integer :: a, p, i

    do a = 1, 3
      do i = 1, 3
        do p = unknowns%first(3*of - 3 + i), unknowns%first(3*of - 2 + i) - 1
          call add_terms(unknowns, unknowns%equation(p), by, a, unknowns%factor(p)*k(i, a), &
            system)
        end do
      end do
      system%force(:, of) = system%force(:, of) - k(:, a)*system%known(a, by)
    end do
  end subroutine add_block

  !> Derivatives of a row of the law by a node's place.
  subroutine add_law(unknowns, row, by, of, system)
    type(unknowns_t), intent(in) :: unknowns
    integer, intent(in) :: row, by          !! of the matrix; node
    real(wp), intent(in) :: of(3)           !! [force/length]
    type(system_t), intent(inout) :: system
    integer :: a

    do a = 1, 3
      call add_terms(unknowns, row, by, a, of(a), system)
    end do
    system%b(row) = system%b(row) - dot_product(of, system%known(:, by))
  end subroutine add_law

  !> The force of a reaction on a node.
  subroutine add_reaction(unknowns, node, column, force, system)
    type(unknowns_t), intent(in) :: unknowns
    integer, intent(in) :: node, column     !! the latter of the matrix
    real(wp), intent(in) :: force(3)        !! [-]
    type(system_t), intent(inout) :: system
    integer :: i, p

    do i = 1, 3
      do p = unknowns%first(3*node - 3 + i), unknowns%first(3*node - 2 + i) - 1
        call add(system, unknowns%equation(p), column, unknowns%factor(p)*force(i))
      end do
    end do
  end subroutine add_reaction

  !> One row by one degree of freedom.
  subroutine add_terms(unknowns, row, node, dof, value, system)
    type(unknowns_t), intent(in) :: unknowns
    integer, intent(in) :: row, node, dof
    real(wp), intent(in) :: value
    type(system_t), intent(inout) :: system
    integer :: q

    if (.not. abs(value) > 0.0_wp) return
    do q = unknowns%first(3*node - 3 + dof), unknowns%first(3*node - 2 + dof) - 1
      call add(system, row, unknowns%equation(q), value*unknowns%factor(q))
    end do
  end subroutine add_terms

  !> One entry.
  subroutine add(system, row, column, value)
    type(system_t), intent(inout) :: system
    integer, intent(in) :: row, column
    real(wp), intent(in) :: value

    associate (a => system%a, n => system%n_entries)
      if (n == size(a%row)) then
        call enlarge(a%row, n, 2*n + 64)
        call enlarge(a%column, n, 2*n + 64)
        call enlarge(a%value, n, 2*n + 64)
      end if
      n = n + 1
      a%row(n) = row
      a%column(n) = column
      a%value(n) = value
    end associate
  end subroutine add

end module linearise_mod
