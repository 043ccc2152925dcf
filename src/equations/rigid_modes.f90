!> The rigid motions that supports leave free, and the degrees of freedom that stand for them.
!>
!> A body that its supports do not hold has up to six rigid motions, an obstacle under force its
!> free translations. Every motion is scaled so that it moves one degree of freedom, its pin, by 1
!> and the other pins of the body not at all: the displacement of the pin is how far the motion has
!> gone. The stiffness is factorised with the pins held (statically determinate, so that nothing
!> is held too much); docs/theory.md section 9.
module rigid_modes_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t, raise, exit_machine
  use constraints_mod, only: constraints_t
  use mesh_mod, only: mesh_t
  use small_matrix_mod, only: cross
  use dense_mod, only: singular_values, symmetric_eigenvectors, invert_general
  implicit none
  private

  public :: free_motions_t, find_free_motions, motion_at, hold_pins, generalised_loads, &
    add_motions

  ! of the largest singular value: sines of 1e-8 count as held, as at the edge of a thin plate
  real(wp), parameter :: rank_tolerance = 1.0e-9_wp

  real(wp), parameter :: alike = 1.0e-9_wp !! of two numbers: equal but for rounding

  !> Motions u(x) = translation + rotation x (x - centre).
  type :: free_motions_t
    integer :: n = 0
    integer,  allocatable :: body(:)           !! (n) body that moves; 0: an obstacle
    integer,  allocatable :: node(:), dof(:)   !! (n) the pin
    real(wp), allocatable :: translation(:, :) !! (3,n) [-]
    real(wp), allocatable :: rotation(:, :)    !! (3,n) [1/length]
    real(wp), allocatable :: centre(:, :)      !! (3,n) of the body [length]
    real(wp), allocatable :: extent(:)         !! (n) of the body, 0 of an obstacle [length]
  end type free_motions_t

  !> The size of a body, for motions that compare.
  type :: extents_t
    real(wp) :: centre(3) = 0.0_wp    !! of its box [length]
    real(wp) :: largest = 0.0_wp      !! side of its box [length]
    real(wp) :: turn(3, 3) = 0.0_wp
    !! columns: rotation about each principal axis that moves no node by more than 1 [1/length]
  end type extents_t

contains

  !> All free motions: of the bodies first, then of the reference nodes.
  subroutine find_free_motions(mesh, prescribed, ref_nodes, contact_nodes, motions, error, &
    constraints)
    type(mesh_t), intent(in) :: mesh
    logical, intent(in) :: prescribed(:, :)  !! (3,n_nodes)
    integer, intent(in) :: ref_nodes(:)      !! of obstacles, each once
    integer, intent(in) :: contact_nodes(:)  !! less preferred as pins
    type(free_motions_t), intent(out) :: motions
    type(error_t), allocatable, intent(out) :: error !! LAPACK failed
    type(constraints_t), intent(in), optional :: constraints
    !! those of the scene, none where left out: what depends is no pin
    logical :: preferred(mesh%n_nodes), barred(3, mesh%n_nodes)
    integer :: body, i, k
    integer, allocatable :: first(:), nodes(:)

    ! Room for all there can be; what is not used is given back at the end.
    k = 6*mesh%n_bodies + 3*size(ref_nodes)
    allocate (motions%body(k), motions%node(k), motions%dof(k), motions%extent(k))
    allocate (motions%translation(3, k), motions%rotation(3, k), motions%centre(3, k), &
      source=0.0_wp)
    preferred = .true.
    preferred(contact_nodes) = .false.
    barred = prescribed(:, :mesh%n_nodes)
    if (present(constraints)) then
      do k = 1, constraints%n
        barred(constraints%dof(k), constraints%node(k)) = .true.
      end do
    end if
    call list_nodes(mesh, first, nodes)
    do body = 1, mesh%n_bodies
      call find_body_motions(mesh, nodes(first(body):first(body + 1) - 1), prescribed, barred, &
        preferred, motions, error)
      if (allocated(error)) return
    end do
    do k = 1, size(ref_nodes)
      do i = 1, 3
        if (prescribed(i, ref_nodes(k))) cycle
        call add_motion(motions, 0, ref_nodes(k), i, mesh%coordinates(:, ref_nodes(k)), 0.0_wp)
        motions%translation(i, motions%n) = 1.0_wp
      end do
    end do
    k = motions%n
    motions%body = motions%body(:k)
    motions%node = motions%node(:k)
    motions%dof = motions%dof(:k)
    motions%extent = motions%extent(:k)
    motions%translation = motions%translation(:, :k)
    motions%rotation = motions%rotation(:, :k)
    motions%centre = motions%centre(:, :k)
  end subroutine find_free_motions

  !> The nodes of every body, ascending.
  pure subroutine list_nodes(mesh, first, nodes)
    type(mesh_t), intent(in) :: mesh
    integer, allocatable, intent(out) :: first(:) !! (n_bodies+1) where the nodes of each begin
    integer, allocatable, intent(out) :: nodes(:) !! one body after the other
    integer :: next(mesh%n_bodies), node, body

    allocate (first(mesh%n_bodies + 1), source=0)
    do node = 1, mesh%n_nodes
      body = mesh%body(node)
      if (body > 0) first(body + 1) = first(body + 1) + 1
    end do
    first(1) = 1
    do body = 1, mesh%n_bodies
      first(body + 1) = first(body) + first(body + 1)
    end do
    next = first(:mesh%n_bodies)
    allocate (nodes(first(mesh%n_bodies + 1) - 1))
    do node = 1, mesh%n_nodes
      body = mesh%body(node)
      if (body == 0) cycle
      nodes(next(body)) = node
      next(body) = next(body) + 1
    end do
  end subroutine list_nodes

  !> The motions of one body.
  !>
  !> Rotations are taken about the principal axes through the body's centre, each scaled so that it
  !> moves the farthest node by 1: turning a needle about its length compares with shifting it. What
  !> the prescribed degrees of freedom do not see is free.
  subroutine find_body_motions(mesh, nodes, prescribed, barred, preferred, motions, error)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: nodes(:)          !! of the body
    logical, intent(in) :: prescribed(:, :)
    logical, intent(in) :: barred(:, :), preferred(:) !! from being pins
    type(free_motions_t), intent(inout) :: motions
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: seen(:, :), z(:, :)
    real(wp) :: s(6), v(6, 6)
    type(extents_t) :: extents
    integer :: pin_node(6), pin_dof(6), node, i, j, k, m
    logical :: ok

    call measure_body(mesh, nodes, extents, ok)
    if (.not. ok) then
      call raise(error, exit_machine, 'LAPACK failed on the principal axes of a body')
      return
    end if
    allocate (seen(count(prescribed(:, nodes)), 6))
    k = 0
    do m = 1, size(nodes)
      node = nodes(m)
      do i = 1, 3
        if (.not. prescribed(i, node)) cycle
        k = k + 1
        seen(k, :) = rigid_mode(extents, mesh%coordinates(:, node), i)
      end do
    end do
    call singular_values(seen, s, v, ok)
    k = count(s <= rank_tolerance*max(s(1), tiny(1.0_wp)))
    if (ok .and. k == 0) return
    if (ok) then
      allocate (z(6, k))
      z = v(:, 7 - k:) ! singular values descend
      call choose_pins(mesh, nodes, extents, barred, preferred, z, pin_node, pin_dof)
      call scale_to_pins(mesh, extents, pin_node(:k), pin_dof(:k), z, ok)
    end if
    if (.not. ok) then
      call raise(error, exit_machine, 'LAPACK failed on the rigid motions of a body')
      return
    end if
    do j = 1, k
      call add_motion(motions, mesh%body(nodes(1)), pin_node(j), pin_dof(j), extents%centre, &
        extents%largest)
      motions%translation(:, motions%n) = z(:3, j)
      motions%rotation(:, motions%n) = matmul(extents%turn, z(4:, j))
    end do
  end subroutine find_body_motions

  !> Centre, largest side and principal axes of a body, with how far its nodes reach from each axis.
  subroutine measure_body(mesh, nodes, extents, ok)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: nodes(:) !! of the body
    type(extents_t), intent(out) :: extents
    logical, intent(out) :: ok !! false: LAPACK did not converge
    real(wp) :: low(3), high(3), axis(3, 3), spread_of_axis(3), arm(3), reach(3)
    integer :: node, k, m

    low = huge(1.0_wp)
    high = -huge(1.0_wp)
    do m = 1, size(nodes)
      node = nodes(m)
      low = min(low, mesh%coordinates(:, node))
      high = max(high, mesh%coordinates(:, node))
    end do
    extents%centre = 0.5_wp*(low + high)
    extents%largest = maxval(high - low)
    axis = 0.0_wp
    do m = 1, size(nodes)
      node = nodes(m)
      arm = (mesh%coordinates(:, node) - extents%centre)/extents%largest
      axis = axis + spread(arm, 2, 3)*spread(arm, 1, 3)
    end do
    ! Rounding must not turn the axes of a body that has no preferred ones.
    where (abs(axis) <= alike*maxval(abs(axis))) axis = 0.0_wp
    call symmetric_eigenvectors(axis, spread_of_axis, ok)
    if (.not. ok) return
    reach = 0.0_wp
    do m = 1, size(nodes)
      node = nodes(m)
      arm = mesh%coordinates(:, node) - extents%centre
      do k = 1, 3
        reach(k) = max(reach(k), norm2(cross(axis(:, k), arm)))
      end do
    end do
    do k = 1, 3
      extents%turn(:, k) = axis(:, k)/reach(k)
    end do
  end subroutine measure_body

  !> What the six rigid motions (translations along x, y, z; rotations about the principal axes,
  !> each of at most 1) do to degree of freedom `i` of a point of the body.
  pure function rigid_mode(extents, x, i) result(mode)
    type(extents_t), intent(in) :: extents
    real(wp), intent(in) :: x(3) !! [length]
    integer, intent(in) :: i     !! 1, 2, 3
    real(wp) :: mode(6), moved(3)
    integer :: k

    mode = 0.0_wp
    mode(i) = 1.0_wp
    do k = 1, 3
      moved = cross(extents%turn(:, k), x - extents%centre)
      mode(3 + k) = moved(i)
    end do
  end function rigid_mode

  !> Choose as many degrees of freedom as there are motions, one after the other the one that the
  !> motions not yet pinned move most.
  pure subroutine choose_pins(mesh, nodes, extents, barred, preferred, z, pin_node, pin_dof)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: nodes(:)                    !! of the body
    type(extents_t), intent(in) :: extents
    logical, intent(in) :: barred(:, :), preferred(:)
    real(wp), intent(in) :: z(:, :)                    !! (6,k) the free motions, orthonormal
    integer, intent(out) :: pin_node(:), pin_dof(:)    !! (6) the first k are set
    real(wp), parameter :: reluctance = 0.1_wp         ! weight of nodes that are less preferred
    real(wp), dimension(size(z, 2), size(z, 2)) :: chosen
    real(wp) :: row(size(z, 2)), best_row(size(z, 2)), weight, best
    integer :: j, l, m, node, i

    pin_node = 0
    pin_dof = 0
    do j = 1, size(z, 2)
      best = -1.0_wp
      best_row = 0.0_wp
      do m = 1, size(nodes)
        node = nodes(m)
        do i = 1, 3
          if (barred(i, node)) cycle
          row = matmul(rigid_mode(extents, mesh%coordinates(:, node), i), z)
          do l = 1, j - 1
            row = row - dot_product(row, chosen(:, l))*chosen(:, l)
          end do
          weight = norm2(row)
          if (.not. preferred(node)) weight = reluctance*weight
          if (weight <= (1.0_wp + alike)*best) cycle ! of equal ones the first
          best = weight
          best_row = row
          pin_node(j) = node
          pin_dof(j) = i
        end do
      end do
      chosen(:, j) = best_row/max(norm2(best_row), tiny(1.0_wp))
    end do
  end subroutine choose_pins

  !> Combine the motions so that each moves its own pin by 1 and the others not at all.
  subroutine scale_to_pins(mesh, extents, pin_node, pin_dof, z, ok)
    type(mesh_t), intent(in) :: mesh
    type(extents_t), intent(in) :: extents
    integer, intent(in) :: pin_node(:), pin_dof(:) !! (k)
    real(wp), intent(inout) :: z(:, :)             !! (6,k)
    logical, intent(out) :: ok                     !! false: the pins do not hold the body
    real(wp) :: p(size(z, 2), size(z, 2))
    integer :: j

    do j = 1, size(z, 2)
      p(j, :) = matmul(rigid_mode(extents, mesh%coordinates(:, pin_node(j)), pin_dof(j)), z)
    end do
    call invert_general(p, ok)
    if (ok) z = matmul(z, p)
  end subroutine scale_to_pins

  !> One more motion, which does not move yet.
  pure subroutine add_motion(motions, body, node, dof, centre, extent)
    type(free_motions_t), intent(inout) :: motions !! with room for it
    integer, intent(in) :: body, node, dof
    real(wp), intent(in) :: centre(3), extent

    motions%n = motions%n + 1
    motions%body(motions%n) = body
    motions%node(motions%n) = node
    motions%dof(motions%n) = dof
    motions%extent(motions%n) = extent
    motions%centre(:, motions%n) = centre
  end subroutine add_motion

  !> The prescribed degrees of freedom and the pins of the bodies.
  pure function hold_pins(motions, prescribed) result(held)
    type(free_motions_t), intent(in) :: motions
    logical, intent(in) :: prescribed(:, :)                         !! (3,n_nodes)
    logical :: held(3, size(prescribed, 2))
    integer :: j

    held = prescribed
    do j = 1, motions%n
      held(motions%dof(j), motions%node(j)) = .true.
    end do
  end function hold_pins

  !> What motion `j` does to a node.
  pure function motion_at(motions, mesh, j, node) result(u)
    type(free_motions_t), intent(in) :: motions
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: j, node
    real(wp) :: u(3) !! displacement a unit of the motion [-]

    u = 0.0_wp
    if (motions%body(j) == 0) then
      if (node == motions%node(j)) u = motions%translation(:, j)
    else if (mesh%body(node) == motions%body(j)) then
      u = motions%translation(:, j) + cross(motions%rotation(:, j), &
        mesh%coordinates(:, node) - motions%centre(:, j))
    end if
  end function motion_at

  !> The work that nodal forces do on a unit of every motion, and what rounding may be of it: forces
  !> that cancel, or act across a motion, leave no more.
  pure subroutine generalised_loads(motions, mesh, force, load, rounding)
    type(free_motions_t), intent(in) :: motions
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: force(:, :)                !! (3,n_nodes) [force]
    real(wp), allocatable, intent(out) :: load(:)      !! (n) [force]
    real(wp), allocatable, intent(out) :: rounding(:)  !! (n) [force]
    real(wp), parameter :: operations = 45.0_wp ! rounded ones that add up
    real(wp) :: motion(3)
    integer :: j, node

    allocate (load(motions%n), rounding(motions%n), source=0.0_wp)
    do node = 1, mesh%n_nodes
      do j = 1, motions%n
        motion = motion_at(motions, mesh, j, node)
        load(j) = load(j) + dot_product(motion, force(:, node))
        rounding(j) = rounding(j) + operations*epsilon(1.0_wp)*norm2(motion)*norm2(force(:, node))
      end do
    end do
  end subroutine generalised_loads

  !> Add the motions, gone as far as `a` says, to a displacement.
  pure subroutine add_motions(motions, mesh, a, u)
    type(free_motions_t), intent(in) :: motions
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: a(:)        !! (n) [length]
    real(wp), intent(inout) :: u(:, :)  !! (3,n_nodes) [length]
    integer :: j, node

    do node = 1, mesh%n_nodes
      do j = 1, motions%n
        u(:, node) = u(:, node) + a(j)*motion_at(motions, mesh, j, node)
      end do
    end do
  end subroutine add_motions

end module rigid_modes_mod
