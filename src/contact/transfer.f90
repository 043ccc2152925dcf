!> Between the nodes and the contact points: the weights of a placement, applied for the solvers.
!>
!> B takes displacements of nodes to relative motions of the points,
!>
!>     (B u)_i = u_slave - sum_k weight_ik u_k,
!>
!> x, y, z a point; its transpose takes reactions to forces of nodes. The compliance at the rows of
!> the points is W = R^T B C B^T R, with C over the equations of the interface and the frames R, and
!> G = R^T B (motions). docs/theory.md sections 2 and 9. A row may name any nodes: reference nodes,
!> nodes of any body (the slave's own too), nodes that supports hold, nodes that depend on others by
!> constraints: B is composed with these.
module transfer_mod
  use kinds_mod, only: wp
  use block_diagonal_mod, only: block_diagonal_t, add_column, entry_of, order_of
  use dense_mod, only: mirror_lower
  use huge_pages_mod, only: prefer_huge_pages
  use constraints_mod, only: active_constraints, constraints_t
  use node_freedom_mod, only: can_move, can_move_along, freedom_of
  use mesh_mod, only: mesh_t
  use obstacles_mod, only: ref_nodes
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t, weights_t, is_covered, is_across, is_still, &
    is_in_middle, is_before_faces, list_slave, of_slave, add_to_slave
  use dof_map_mod, only: dof_map_t, interface_equations_of, interface_terms_of, is_turned
  use rigid_modes_mod, only: free_motions_t, motion_at
  use sparse_rows_mod, only: rows_t
  use local_frame_mod, only: straight
  use pair_faces_mod, only: master_nodes, slave_nodes
  use placement_mod, only: placement_t, place_undeformed
  implicit none
  private

  public :: relative_motion, nodal_forces, gap_at, movable, note_freedom, rows_of_points, &
    motion_of_point, motions_at_rows, make_transfer, compliance_of_rows, &
    stiffness_left, give_way

  real(wp), parameter :: rounding = 1.0e-12_wp !! of a motion, whose pin moves by 1: none

contains

  !> Displacement of a point's node less that of the master there; none across a plane of symmetry,
  !> where what weights make of nodes beside the plane is not motion of the plane.
  pure function relative_motion(points, weights, i, u) result(d)
    type(contact_points_t), intent(in) :: points
    type(weights_t), intent(in) :: weights
    integer, intent(in) :: i
    real(wp), intent(in) :: u(:, :) !! (3,n_nodes) [length]
    real(wp) :: d(3)
    integer :: k

    d = of_slave(points, weights, i, u)
    do k = weights%first(i), weights%first(i + 1) - 1
      d = d - weights%weight(k)*u(:, weights%node(k))
    end do
    where (is_across(points, i)) d = 0.0_wp
    if (.not. any(is_still(weights, i))) return
    ! What a mean makes of nodes beside those that are held is no motion of the point.
    where (is_still(weights, i)) d = 0.0_wp
    do k = weights%first(i), weights%first(i + 1) - 1
      where (is_still(weights, i) .and. .not. points%freedom%can_move(:, weights%node(k))) &
        d = d + weights%weight(k)*(u(:, points%node(i)) - u(:, weights%node(k)))
    end do
  end function relative_motion

  !> Reactions of the points as forces of the nodes.
  pure function nodal_forces(points, weights, reaction, n_nodes) result(force)
    type(contact_points_t), intent(in) :: points
    type(weights_t), intent(in) :: weights
    real(wp), intent(in) :: reaction(:, :) !! (3,n_points) x, y, z, on the slave node [force]
    integer, intent(in) :: n_nodes
    real(wp) :: force(3, n_nodes)          !! [force]
    integer :: i, k

    force = 0.0_wp
    do i = 1, points%n
      call add_to_slave(points, weights, i, reaction(:, i), force)
      do k = weights%first(i), weights%first(i + 1) - 1
        associate (node => weights%node(k))
          force(:, node) = force(:, node) - weights%weight(k)*reaction(:, i)
        end associate
      end do
    end do
  end function nodal_forces

  !> The gap of a point at displacement `u`, linear about the placement; none within what the
  !> displacements that make it are rounded by. docs/theory.md (12.4).
  pure real(wp) function gap_at(placement, points, i, u) result(gap)
    type(placement_t), intent(in) :: placement
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: i
    real(wp), intent(in) :: u(:, :)      !! (3,n_nodes) [length]
    real(wp), parameter :: of_displacements = 8.0_wp*epsilon(1.0_wp) !! rounding [-]
    real(wp) :: moved
    integer :: k

    gap = placement%gap(i) + dot_product(placement%frame(:, 1, i), &
      relative_motion(points, placement%weights, i, u) - placement%reference(:, i))
    moved = norm2(u(:, points%node(i)))
    associate (weights => placement%weights)
      do k = weights%first(i), weights%first(i + 1) - 1
        moved = moved + abs(weights%weight(k))*norm2(u(:, weights%node(k)))
      end do
    end associate
    if (abs(gap) <= of_displacements*moved) gap = 0.0_wp
  end function gap_at

  !> The degrees of freedom that can move: of the bodies' nodes and of obstacles, where no support
  !> holds them, nor all that they depend on. Other nodes have none.
  pure function movable(scene, prescribed)
    type(scene_t), intent(in) :: scene
    logical, intent(in) :: prescribed(:, :)      !! (3,n_nodes)
    logical :: movable(3, size(prescribed, 2))

    movable = can_move(scene%mesh%body, ref_nodes(scene%obstacles), &
      active_constraints(scene%constraints, prescribed), prescribed)
  end function movable

  !> Let the points know the freedom of the nodes in a *STEP, where it takes from any of theirs.
  pure subroutine note_freedom(scene, prescribed, points)
    type(scene_t), intent(in) :: scene
    logical, intent(in) :: prescribed(:, :)      !! (3,n_nodes)
    type(contact_points_t), intent(inout) :: points
    type(placement_t) :: undeformed
    logical :: on_slave(scene%mesh%n_nodes)
    integer :: pair

    if (allocated(points%alpha)) call find_held_middles(scene, prescribed, points)
    if (allocated(points%freedom)) deallocate (points%freedom)
    if (.not. any(scene%pairs%master == 0)) return
    allocate (points%freedom)
    points%freedom = freedom_of(scene%mesh%body, ref_nodes(scene%obstacles), scene%constraints, &
      prescribed)
    associate (is_bound => points%freedom%is_bound)
      do pair = 1, size(scene%pairs)
        if (scene%pairs(pair)%master > 0) cycle
        on_slave = .false.
        on_slave(slave_nodes(scene, points, pair)) = .true.
        associate (masters => master_nodes(scene, points, pair))
          is_bound(masters) = is_bound(masters) .or. on_slave(masters)
        end associate
      end do
    end associate
    allocate (points%freedom%normal(3, points%n), source=0.0_wp)
    call place_undeformed(scene, points, undeformed)
    points%freedom%normal = undeformed%frame(:, 1, :)
  end subroutine note_freedom

  !> Nodes in the middles of edges that supports hold along the normal: they are points by
  !> themselves, as other held nodes are, and take no part of the ends of the edge.
  pure subroutine find_held_middles(scene, prescribed, points)
    type(scene_t), intent(in) :: scene
    logical, intent(in) :: prescribed(:, :)      !! (3,n_nodes)
    type(contact_points_t), intent(inout) :: points
    type(placement_t) :: undeformed
    type(constraints_t) :: active

    points%is_held = .true.
    call place_undeformed(scene, points, undeformed)
    active = active_constraints(scene%constraints, prescribed)
    points%is_held = .not. can_move_along(active, can_move(scene%mesh%body, &
      ref_nodes(scene%obstacles), active, prescribed), points%node, undeformed%frame(:, 1, :), &
      straight)
  end subroutine find_held_middles

  !> Number the rows of every point: a row wherever the point can move along its frame and the law
  !> has a reaction.
  !>
  !> A direction along which neither the slave node nor a node of its row can move has no compliance
  !> and no row; without friction there are no tangential rows; a point whose normal cannot move, or
  !> that is out of reach of its master, or not covered by it, has none at all (docs/theory.md
  !> sections 2 and 11). A node in the middle of an edge that supports hold along the normal has
  !> none: the row would hold the ends of the edge by it. Held along the surface it has rows as far
  !> as these ends move: their slips are in its own (9.11).
  pure subroutine rows_of_points(movable, points, weights, frame, row)
    logical, intent(in) :: movable(:, :)          !! (3,n_nodes)
    type(contact_points_t), intent(in) :: points
    type(weights_t), intent(in) :: weights
    real(wp), intent(in) :: frame(:, :, :)        !! (3,3,n_points) columns n, t1, t2
    integer, intent(out) :: row(:, :)             !! (3,n_points) 0 where there is none
    integer :: i, a, k, n, n_slaves, node(3)
    logical :: free(3), along(3)
    real(wp) :: factor(3)

    row = 0
    n = 0
    do i = 1, points%n
      if (.not. points%in_reach(i)) cycle
      if (.not. is_covered(points, weights, i)) cycle
      free = movable(:, points%node(i))
      along = free
      do k = weights%first(i), weights%first(i + 1) - 1
        if (abs(weights%weight(k)) > 0.0_wp) along = along .or. movable(:, weights%node(k))
      end do
      if (is_before_faces(points, i) .or. .not. is_in_middle(points, weights, i)) free = along
      call list_slave(points, weights, i, n_slaves, node, factor)
      do k = 2, n_slaves
        along = along .or. movable(:, node(k))
      end do
      free = free .and. .not. (is_across(points, i) .or. is_still(weights, i))
      along = along .and. .not. (is_across(points, i) .or. is_still(weights, i))
      do a = 1, 3
        if (a > 1 .and. (row(1, i) == 0 .or. points%mu(i) <= 0.0_wp)) exit
        if (a == 1 .and. .not. any(free .and. abs(frame(:, a, i)) > straight)) cycle
        if (a > 1 .and. .not. any(along .and. abs(frame(:, a, i)) > straight)) cycle
        n = n + 1
        row(a, i) = n
      end do
    end do
  end subroutine rows_of_points

  !> What the free motions do at the rows of the contact points, G of docs/theory.md (9.2).
  !>
  !> A row across a motion is exactly 0: were it rounding, contact would seem to hold a body that
  !> slides along it. So is what a motion does to both sides alike.
  pure function motions_at_rows(mesh, points, placement, motions, row) result(g)
    type(mesh_t), intent(in) :: mesh
    type(contact_points_t), intent(in) :: points
    type(placement_t), intent(in) :: placement
    type(free_motions_t), intent(in) :: motions
    integer, intent(in) :: row(:, :)        !! (3,n_points) 0 where there is none
    real(wp), allocatable :: g(:, :)        !! (n_rows,n_motions) [-]
    real(wp) :: motion(3), magnitude, factor(3)
    integer :: i, j, a, n, node(3)
    integer, allocatable :: bodies(:) !! of the nodes that a point depends on

    allocate (g(count(row > 0), motions%n), source=0.0_wp)
    allocate (bodies(0))
    do i = 1, points%n
      if (row(1, i) == 0) cycle
      call list_slave(points, placement%weights, i, n, node, factor)
      associate (weights => placement%weights)
        bodies = mesh%body([node(:n), weights%node(weights%first(i):weights%first(i + 1) - 1)])
      end associate
      do j = 1, motions%n
        if (motions%body(j) > 0 .and. all(bodies /= motions%body(j))) cycle
        call move_point(mesh, points, placement%weights, motions, i, j, motion, magnitude)
        do a = 1, 3
          if (row(a, i) == 0) cycle
          g(row(a, i), j) = dot_product(placement%frame(:, a, i), motion)
          if (abs(g(row(a, i), j)) <= rounding*max(1.0_wp, magnitude)) g(row(a, i), j) = 0.0_wp
        end do
      end do
    end do
  end function motions_at_rows

  !> What free motion `j` does to a point's node, less what it does to its master there.
  pure function motion_of_point(mesh, points, weights, motions, i, j) result(motion)
    type(mesh_t), intent(in) :: mesh
    type(contact_points_t), intent(in) :: points
    type(weights_t), intent(in) :: weights
    type(free_motions_t), intent(in) :: motions
    integer, intent(in) :: i, j
    real(wp) :: motion(3) !! [-]
    real(wp) :: magnitude

    call move_point(mesh, points, weights, motions, i, j, motion, magnitude)
  end function motion_of_point

  !> The same, with how much is added up to it.
  pure subroutine move_point(mesh, points, weights, motions, i, j, motion, magnitude)
    type(mesh_t), intent(in) :: mesh
    type(contact_points_t), intent(in) :: points
    type(weights_t), intent(in) :: weights
    type(free_motions_t), intent(in) :: motions
    integer, intent(in) :: i, j
    real(wp), intent(out) :: motion(3), magnitude !! [-]
    real(wp) :: part(3), factor(3)
    integer :: k, n, node(3)

    call list_slave(points, weights, i, n, node, factor)
    motion = 0.0_wp
    magnitude = 0.0_wp
    do k = 1, n
      part = factor(k)*motion_at(motions, mesh, j, node(k))
      motion = motion + part
      magnitude = magnitude + norm2(part)
    end do
    do k = weights%first(i), weights%first(i + 1) - 1
      part = weights%weight(k)*motion_at(motions, mesh, j, weights%node(k))
      motion = motion - part
      magnitude = magnitude + norm2(part)
    end do
  end subroutine move_point

  !> B over the equations of the interface, in x, y, z: a sparse line for each direction of a point.
  subroutine make_transfer(map, points, weights, transfer)
    type(dof_map_t), intent(in) :: map
    type(contact_points_t), intent(in) :: points
    type(weights_t), intent(in) :: weights
    type(rows_t), intent(out) :: transfer
    integer :: slave(3, 3), master(3, size(weights%node)), i, a, k, n, pass
    integer :: n_slaves, node(3)
    real(wp) :: factor(3)

    do k = 1, size(weights%node)
      master(:, k) = own_equations(weights%node(k))
    end do
    allocate (transfer%first(3*points%n + 1))
    do pass = 1, 2
      n = 0
      do i = 1, points%n
        call list_slave(points, weights, i, n_slaves, node, factor)
        do k = 1, n_slaves
          slave(:, k) = own_equations(node(k))
        end do
        do a = 1, 3
          transfer%first(3*(i - 1) + a) = n + 1
          do k = 1, n_slaves
            if (slave(a, k) > 0) then
              call add(slave(a, k), factor(k))
            else if (map%constraints%n > 0 .or. is_turned(map)) then
              call add_masters(node(k), a, factor(k))
            end if
          end do
          do k = weights%first(i), weights%first(i + 1) - 1
            if (master(a, k) > 0) then
              call add(master(a, k), -weights%weight(k))
            else if (map%constraints%n > 0 .or. is_turned(map)) then
              call add_masters(weights%node(k), a, -weights%weight(k))
            end if
          end do
        end do
      end do
      transfer%first(3*points%n + 1) = n + 1
      if (pass == 1) allocate (transfer%column(n), transfer%value(n))
    end do

  contains

    !> Equations of a node along x, y, z; 0 where none is, or more than one.
    pure function own_equations(node) result(equations)
      integer, intent(in) :: node
      integer :: equations(3)

      equations = 0
      if (.not. is_turned(map, node)) equations = interface_equations_of(map, node)
    end function own_equations

    subroutine add(equation, coefficient)
      integer, intent(in) :: equation
      real(wp), intent(in) :: coefficient

      n = n + 1
      if (pass == 1) return
      transfer%column(n) = equation
      transfer%value(n) = coefficient
    end subroutine add

    !> What a degree of freedom depends on, or has turned to; nothing where it does not.
    subroutine add_masters(node, dof, weight)
      integer, intent(in) :: node, dof
      real(wp), intent(in) :: weight
      integer, allocatable :: equations(:)
      real(wp), allocatable :: coefficients(:)
      integer :: l

      call interface_terms_of(map, node, dof, equations, coefficients)
      do l = 1, size(equations)
        call add(equations(l), weight*coefficients(l))
      end do
    end subroutine add_masters

  end subroutine make_transfer

  !> W = R^T B C B^T R over the rows of the points.
  subroutine compliance_of_rows(transfer, frame, row, c, w)
    type(rows_t), intent(in) :: transfer
    real(wp), intent(in) :: frame(:, :, :)  !! (3,3,n_points) columns n, t1, t2
    integer, intent(in)  :: row(:, :)       !! (3,n_points)
    type(block_diagonal_t), intent(in) :: c !! compliance of the interface [length/force]
    real(wp), allocatable, intent(out) :: w(:, :) !! (n_rows,n_rows) [length/force]
    real(wp) :: of_point(order_of(c), 3) !! C B^T of one point [length/force]
    real(wp) :: across(3, order_of(c))   !! C B^T R of it, the three of an equation side by side
    real(wp) :: block(3, 3)
    integer :: i, j, a, b

    allocate (w(count(row > 0), count(row > 0)))
    call prefer_huge_pages(w)
    do j = 1, size(row, 2)
      if (row(1, j) == 0) cycle
      call press_point(transfer, c, j, of_point)
      across = matmul(transpose(frame(:, :, j)), transpose(of_point))
      do i = j, size(row, 2)
        if (row(1, i) == 0) cycle
        block = at_point(transfer, across, i)
        do b = 1, 3
          do a = 1, 3
            if (row(a, i) == 0 .or. row(b, j) == 0) cycle
            w(max(row(a, i), row(b, j)), min(row(a, i), row(b, j))) = &
              dot_product(frame(:, a, i), block(:, b))
          end do
        end do
      end do
    end do
    call mirror_lower(w)
  end subroutine compliance_of_rows

  !> C B^T of one point: what unit reactions along x, y, z do to the interface.
  subroutine press_point(transfer, c, j, moved)
    type(rows_t), intent(in) :: transfer
    type(block_diagonal_t), intent(in) :: c          !! of the interface [length/force]
    integer, intent(in) :: j
    real(wp), intent(out), contiguous :: moved(:, :) !! (n_interface,3) [length/force]
    integer :: b, k

    moved = 0.0_wp
    do b = 1, 3
      do k = transfer%first(3*(j - 1) + b), transfer%first(3*(j - 1) + b + 1) - 1
        call add_column(c, transfer%column(k), transfer%value(k), moved(:, b))
      end do
    end do
  end subroutine press_point

  !> B of one point, applied to three displacements of the interface.
  pure function at_point(transfer, moved, i) result(block)
    type(rows_t), intent(in) :: transfer
    real(wp), intent(in), contiguous :: moved(:, :) !! (3,n_interface)
    integer, intent(in) :: i
    real(wp) :: block(3, 3)                 !! rows along x, y, z, a column each
    real(wp) :: line(3)
    integer :: a, k

    do a = 1, 3
      line = 0.0_wp
      do k = transfer%first(3*(i - 1) + a), transfer%first(3*(i - 1) + a + 1) - 1
        line = line + transfer%value(k)*moved(:, transfer%column(k))
      end do
      block(a, :) = line
    end do
  end function at_point

  !> What is left of the stiffness of a pair's slave nodes where the master gives way beneath them:
  !> the mean over its points of tr C_ii/tr W_ii, C_ii of the slave node alone, or by what stands
  !> near. 1 where no node of the master is on the interface.
  pure function stiffness_left(map, points, transfer, c, flexibility) result(left)
    type(dof_map_t), intent(in) :: map
    type(contact_points_t), intent(in) :: points
    type(rows_t), intent(in) :: transfer
    type(block_diagonal_t), intent(in), optional :: c !! compliance of the interface [length/force]
    real(wp), intent(in), optional :: flexibility(:)
    !! (n_interface) where there is none: of what stands near [length/force]
    real(wp) :: left(size(points%first) - 1)   !! (n_pairs) [-]
    real(wp) :: of_slave, of_both
    integer :: pair, i, n, equation(3)

    left = 1.0_wp
    do pair = 1, size(left)
      n = 0
      do i = points%first(pair), points%first(pair + 1) - 1
        equation = interface_equations_of(map, points%node(i))
        if (present(flexibility)) then
          of_slave = sum(flexibility(pack(equation, equation > 0)))
          of_both = sum(flexibility_of_point(transfer, flexibility, i), mask=equation > 0)
        else
          call soften(i, equation, of_slave, of_both)
        end if
        if (.not. min(of_slave, of_both) > 0.0_wp) cycle
        if (n == 0) left(pair) = 0.0_wp
        n = n + 1
        left(pair) = left(pair) + of_slave/of_both
      end do
      if (n > 0) left(pair) = left(pair)/real(n, wp)
    end do

  contains

    !> tr C_ii and tr W_ii of a point; 0 where its rows are of the slave node alone.
    pure subroutine soften(i, equation, of_slave, of_both)
      integer, intent(in) :: i, equation(3)
      real(wp), intent(out) :: of_slave, of_both
      integer :: a, k, l

      of_slave = 0.0_wp
      of_both = 0.0_wp
      if (transfer%first(3*i + 1) - transfer%first(3*i - 2) == count(equation > 0)) return
      do a = 1, 3
        if (equation(a) == 0) cycle
        of_slave = of_slave + entry_of(c, equation(a), equation(a))
        do k = transfer%first(3*(i - 1) + a), transfer%first(3*(i - 1) + a + 1) - 1
          do l = transfer%first(3*(i - 1) + a), transfer%first(3*(i - 1) + a + 1) - 1
            of_both = of_both + transfer%value(k)*transfer%value(l)* &
              entry_of(c, transfer%column(k), transfer%column(l))
          end do
        end do
      end do
    end subroutine soften

  end function stiffness_left

  !> How far the rows of the points give way to their own unknowns alone, those of the master among
  !> them: a bound of W_ii from what stands near, in the frames.
  pure function give_way(transfer, frame, flexibility) result(block)
    type(rows_t), intent(in) :: transfer
    real(wp), intent(in) :: frame(:, :, :)     !! (3,3,n_points)
    real(wp), intent(in) :: flexibility(:)     !! (n_interface) [length/force]
    real(wp) :: block(3, 3, size(frame, 3))    !! [length/force]
    real(wp) :: along(3)
    integer :: i, a

    do i = 1, size(frame, 3)
      along = flexibility_of_point(transfer, flexibility, i)
      do a = 1, 3
        block(:, a, i) = matmul(transpose(frame(:, :, i)), along*frame(:, a, i))
      end do
    end do
  end function give_way

  !> Along x, y, z. The unknowns that a point hangs on move together, as neighbours do.
  pure function flexibility_of_point(transfer, flexibility, i) result(along)
    type(rows_t), intent(in) :: transfer
    real(wp), intent(in) :: flexibility(:)     !! (n_interface) [length/force]
    integer, intent(in) :: i
    real(wp) :: along(3)                       !! [length/force]
    integer :: a

    do a = 1, 3
      associate (first => transfer%first(3*(i - 1) + a), &
                 last => transfer%first(3*(i - 1) + a + 1) - 1)
        along(a) = sum(abs(transfer%value(first:last))* &
          flexibility(transfer%column(first:last)))
      end associate
    end do
  end function flexibility_of_point

end module transfer_mod
