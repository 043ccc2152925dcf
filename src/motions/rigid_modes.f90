!> The rigid motions that supports leave free, and the degrees of freedom that stand for them.
!>
!> A body that its supports do not hold has up to six rigid motions, an obstacle under force its
!> free translations. Every motion is scaled so that it moves one degree of freedom, its pin, by 1
!> and the other pins of the body not at all: the displacement of the pin is how far the motion has
!> gone. The stiffness is factorised with the pins held (statically determinate, so that nothing
!> is held too much); docs/theory.md section 9.
!>
!> A body that equations or springs join has the motions of its pieces that satisfy these, and leave
!> springs as long as they are: any number, in each of which every piece goes its own way.
!> docs/theory.md section 11.
module rigid_modes_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t, raise, exit_machine, exit_not_solved
  use lists_mod, only: lists_t, lists_by_key
  use constraints_mod, only: constraints_t
  use mesh_mod, only: mesh_t, joined_nodes, moved_mesh
  use small_matrix_mod, only: cross
  use dense_mod, only: singular_values, invert_general
  use text_mod, only: to_text
  use piece_modes_mod, only: pieces_t, one_piece, several_pieces, moving_columns, leave_free, &
    modes_of, alike, rank_tolerance
  implicit none
  private

  public :: free_motions_t, find_free_motions, motion_at, hold_pins, &
    generalised_loads, add_motions, is_joined, follow_turns, place_of

  real(wp), parameter :: weakly = 1.0e-2_wp
  !! by supports of deformed bodies: the resistance that is left to iteration is 1e-4 of others [-]
  integer, parameter :: most = 900 !! motions of a joined body: whose singular values take seconds

  !> Motions u(x) = translation + rotation x (x - centre).
  type :: free_motions_t
    integer :: n = 0
    logical :: are_finite = .false.
    !! rotations of bodies: motions are about where these are, which they follow
    integer,  allocatable :: body(:)           !! (n) body that moves; 0: an obstacle
    integer,  allocatable :: node(:), dof(:)   !! (n) the pin
    real(wp), allocatable :: translation(:, :) !! (3,n) [-]
    real(wp), allocatable :: rotation(:, :)    !! (3,n) [1/length]
    real(wp), allocatable :: centre(:, :)      !! (3,n) of the body [length]
    real(wp), allocatable :: extent(:)         !! (n) of the body, 0 of an obstacle [length]
    real(wp), allocatable :: place(:, :)
    !! (3,n_nodes) at finite strain: where the nodes are that motions turn; not allocated: where the
    !! mesh has them [length]
    logical,  allocatable :: is_joined(:)
    !! (n_bodies) whether equations or springs join it: then its pieces have translations and
    !! rotations
    integer,  allocatable :: piece(:)
    !! (n_nodes) piece of joined bodies that the node belongs to, else 0; not allocated: none
    real(wp), allocatable :: piece_translation(:, :, :) !! (3,n_pieces,n) [-]
    real(wp), allocatable :: piece_rotation(:, :, :)    !! (3,n_pieces,n) [1/length]
    real(wp), allocatable :: piece_centre(:, :)         !! (3,n_pieces) [length]
    real(wp), allocatable :: piece_extent(:)            !! (n_pieces) [length]
  end type free_motions_t

contains

  !> All free motions: of the bodies first, then of the reference nodes.
  !> Of deformed bodies those that are free to undeformed ones are free, too, where supports see
  !> them but a little: their resistance goes as the square of it.
  subroutine find_free_motions(mesh, prescribed, ref_nodes, contact_nodes, motions, error, &
    constraints, undeformed)
    type(mesh_t), intent(in) :: mesh
    logical, intent(in) :: prescribed(:, :)  !! (3,n_nodes)
    integer, intent(in) :: ref_nodes(:)      !! of obstacles, each once
    integer, intent(in) :: contact_nodes(:)  !! less preferred as pins
    type(free_motions_t), intent(out) :: motions
    type(error_t), allocatable, intent(out) :: error !! LAPACK failed
    type(constraints_t), intent(in), optional :: constraints
    !! those of the scene, none where left out: what depends is no pin
    type(free_motions_t), intent(in), optional :: undeformed
    !! the motions of the undeformed bodies, where these are not
    type(constraints_t) :: all_constraints
    logical :: preferred(mesh%n_nodes), barred(3, mesh%n_nodes)
    integer :: body, i, k
    type(lists_t) :: nodes                   !! of each body

    ! Room for all there can be; what is not used is given back at the end.
    k = 6*max(mesh%n_bodies, mesh%n_pieces) + 3*size(ref_nodes)
    all_constraints = constraints_t()
    if (present(constraints)) all_constraints = constraints
    if (all_constraints%n_equations > 0 .or. mesh%springs%n > 0) k = k + min(most*mesh%n_bodies, &
      count(spread(joined_nodes(mesh), 1, 3) .and. .not. prescribed(:, :mesh%n_nodes)))
    allocate (motions%body(k), motions%node(k), motions%dof(k), motions%extent(k))
    allocate (motions%translation(3, k), motions%rotation(3, k), motions%centre(3, k), &
      source=0.0_wp)
    preferred = .true.
    preferred(contact_nodes) = .false.
    barred = prescribed(:, :mesh%n_nodes)
    do k = 1, all_constraints%n
      barred(all_constraints%dof(k), all_constraints%node(k)) = .true.
    end do
    allocate (motions%is_joined(mesh%n_bodies), source=.false.)
    do k = all_constraints%n - all_constraints%n_equations + 1, all_constraints%n
      motions%is_joined(mesh%body(all_constraints%node(k))) = .true.
    end do
    do k = 1, mesh%springs%n
      motions%is_joined(mesh%body(mesh%springs%node(mesh%springs%first(k)))) = .true.
    end do
    if (any(motions%is_joined)) call begin_pieces(mesh, motions)
    nodes = lists_by_key(mesh%body, mesh%n_bodies)
    do body = 1, mesh%n_bodies
      associate (of_body => nodes%item(nodes%first(body):nodes%first(body + 1) - 1))
        if (motions%is_joined(body)) then
          call find_joined_motions(mesh, of_body, prescribed, barred, preferred, &
            all_constraints, motions, error)
        else
          k = 0
          if (present(undeformed)) k = count(undeformed%body == body)
          call find_body_motions(mesh, of_body, prescribed, barred, preferred, k, motions, error)
        end if
      end associate
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
    if (.not. allocated(motions%piece)) return
    motions%piece_translation = motions%piece_translation(:, :, :k)
    motions%piece_rotation = motions%piece_rotation(:, :, :k)
  end subroutine find_free_motions

  !> Number the pieces of joined bodies, single nodes among them, and make room for what motions do
  !> to them.
  pure subroutine begin_pieces(mesh, motions)
    type(mesh_t), intent(in) :: mesh
    type(free_motions_t), intent(inout) :: motions
    integer :: index_of(mesh%n_pieces), node, n

    allocate (motions%piece(mesh%n_nodes), source=0)
    index_of = 0
    n = 0
    do node = 1, mesh%n_nodes
      if (mesh%body(node) == 0) cycle
      if (.not. motions%is_joined(mesh%body(node))) cycle
      associate (p => mesh%piece(node))
        if (p > 0) motions%piece(node) = index_of(p)
        if (motions%piece(node) > 0) cycle
        n = n + 1
        motions%piece(node) = n
        if (p > 0) index_of(p) = n
      end associate
    end do
    allocate (motions%piece_translation(3, n, size(motions%body)), motions%piece_rotation(3, n, &
      size(motions%body)), motions%piece_centre(3, n), motions%piece_extent(n), source=0.0_wp)
  end subroutine begin_pieces

  !> The motions of one body.
  !>
  !> Rotations are taken about the principal axes through the body's centre, each scaled so that it
  !> moves the farthest node by 1: turning a needle about its length compares with shifting it. What
  !> the prescribed degrees of freedom do not see is free.
  subroutine find_body_motions(mesh, nodes, prescribed, barred, preferred, n_undeformed, motions, &
    error)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: nodes(:)          !! of the body
    logical, intent(in) :: prescribed(:, :)
    logical, intent(in) :: barred(:, :), preferred(:) !! from being pins
    integer, intent(in) :: n_undeformed      !! how many the undeformed body has, where it is not
    type(free_motions_t), intent(inout) :: motions
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: z(:, :)
    type(pieces_t) :: pieces
    integer :: pin_node(6), pin_dof(6), j, k
    logical :: ok

    call find_unseen(mesh, nodes, prescribed, pieces, z, ok, at_most=n_undeformed)
    k = size(z, 2)
    if (ok .and. k == 0) return
    if (ok) then
      call choose_pins(mesh, nodes, pieces, barred, preferred, z, pin_node, pin_dof)
      call scale_to_pins(mesh, pieces, pin_node(:k), pin_dof(:k), z, ok)
    end if
    if (.not. ok) then
      call raise(error, exit_machine, 'LAPACK failed on the rigid motions of a body')
      return
    end if
    associate (extents => pieces%extents(1))
      do j = 1, k
        call add_motion(motions, mesh%body(nodes(1)), pin_node(j), pin_dof(j), extents%centre, &
          extents%largest)
        motions%translation(:, motions%n) = z(:3, j)
        motions%rotation(:, motions%n) = matmul(extents%turn, z(4:, j))
      end do
    end associate
  end subroutine find_body_motions

  !> Take the motions of bodies that turn with these about where they are now, with the pins that
  !> they have.
  subroutine follow_turns(undeformed, u, prescribed, constraints, motions, ok)
    type(mesh_t), intent(in) :: undeformed
    real(wp), intent(in) :: u(:, :)          !! (3,n_nodes) displacement [length]
    logical, intent(in) :: prescribed(:, :)  !! (3,n_nodes)
    type(constraints_t), intent(in) :: constraints !! of the scene, about displaced places
    type(free_motions_t), intent(inout) :: motions
    logical, intent(out) :: ok !! false: the pins hold a body no more, or LAPACK failed
    type(mesh_t) :: mesh
    type(pieces_t) :: pieces
    type(lists_t) :: nodes
    real(wp), allocatable :: z(:, :)
    integer :: body, j, k

    ok = .true.
    if (.not. (motions%are_finite .and. any(motions%body > 0))) return
    mesh = moved_mesh(undeformed, u)
    motions%place = mesh%coordinates
    nodes = lists_by_key(mesh%body, mesh%n_bodies)
    do body = 1, mesh%n_bodies
      k = count(motions%body == body)
      if (k == 0) cycle
      associate (of_body => nodes%item(nodes%first(body):nodes%first(body + 1) - 1), &
                 of => pack([(j, j=1, motions%n)], motions%body(:motions%n) == body))
        if (motions%is_joined(body)) then
          call several_pieces(mesh, of_body, pieces, ok)
          if (ok) call leave_free(mesh, of_body, pieces, prescribed, constraints, z, ok, k)
          if (ok) call scale_to_pins(mesh, pieces, motions%node(of), motions%dof(of), z, ok)
          if (.not. ok) return
          call keep_joined_motions(of_body, pieces, z, of, motions)
          cycle
        end if
        call find_unseen(mesh, of_body, prescribed, pieces, z, ok, k)
        if (ok) call scale_to_pins(mesh, pieces, motions%node(of), motions%dof(of), z, ok)
        if (.not. ok) return
        motions%centre(:, of) = spread(pieces%extents(1)%centre, 2, k)
        motions%translation(:, of) = z(:3, :)
        motions%rotation(:, of) = matmul(pieces%extents(1)%turn, z(4:, :))
      end associate
    end do
  end subroutine follow_turns

  !> The rigid motions of a body that prescribed degrees of freedom do not see.
  subroutine find_unseen(mesh, nodes, prescribed, pieces, z, ok, n, at_most)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: nodes(:)             !! of the body
    logical, intent(in) :: prescribed(:, :)     !! (3,n_nodes)
    type(pieces_t), intent(out) :: pieces
    real(wp), allocatable, intent(out) :: z(:, :) !! (6,k) orthonormal
    logical, intent(out) :: ok                  !! false: LAPACK failed
    integer, intent(in), optional :: n          !! how many there are; left out: is found
    integer, intent(in), optional :: at_most    !! how many may be that are seen weakly; default: 0
    real(wp), allocatable :: seen(:, :)
    real(wp) :: s(6), v(6, 6), each(6, 6)
    integer :: i, k, m

    allocate (z(6, 0))
    call one_piece(mesh, nodes, pieces, ok)
    if (.not. ok) return
    allocate (seen(count(prescribed(:, nodes)), 6))
    each = 0.0_wp
    do k = 1, 6
      each(k, k) = 1.0_wp
    end do
    k = 0
    do m = 1, size(nodes)
      do i = 1, 3
        if (.not. prescribed(i, nodes(m))) cycle
        k = k + 1
        seen(k, :) = modes_of(pieces, mesh, nodes(m), i, each)
      end do
    end do
    call singular_values(seen, s, v, ok)
    if (.not. ok) return
    k = count(s <= rank_tolerance*max(s(1), tiny(1.0_wp)))
    if (present(at_most)) k = max(k, min(at_most, count(s <= weakly*s(1))))
    if (present(n)) k = n
    z = v(:, 7 - k:) ! singular values descend
  end subroutine find_unseen

  !> The motions of a body that equations or springs join: those of its pieces that neither supports
  !> nor springs see, and that satisfy all constraints.
  subroutine find_joined_motions(mesh, nodes, prescribed, barred, preferred, constraints, motions, &
    error)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: nodes(:)          !! of the body
    logical, intent(in) :: prescribed(:, :)
    logical, intent(in) :: barred(:, :), preferred(:) !! from being pins
    type(constraints_t), intent(in) :: constraints !! of the scene
    type(free_motions_t), intent(inout) :: motions
    type(error_t), allocatable, intent(out) :: error !! too many pieces; LAPACK failed
    type(pieces_t) :: pieces
    real(wp), allocatable :: z(:, :)
    integer, allocatable :: pin_node(:), pin_dof(:), columns(:)
    integer :: j, k
    logical :: ok

    call several_pieces(mesh, nodes, pieces, ok)
    columns = moving_columns(mesh, nodes, pieces, prescribed)
    if (ok .and. size(columns) > most) then
      call raise(error, exit_not_solved, 'equations or springs join '// &
        to_text(size(pieces%extents))//' bodies and single nodes to one, with '// &
        to_text(size(columns))//' motions: at most '//to_text(most)//' can be looked through')
      return
    end if
    if (ok) call leave_free(mesh, nodes, pieces, prescribed, constraints, z, ok)
    k = 0
    if (ok) k = size(z, 2)
    if (ok .and. k == 0) return
    if (ok) then
      allocate (pin_node(k), pin_dof(k))
      call choose_pins(mesh, nodes, pieces, barred, preferred, z, pin_node, pin_dof)
      call scale_to_pins(mesh, pieces, pin_node, pin_dof, z, ok)
      if (.not. ok) then
        call raise(error, exit_not_solved, 'the coefficients of equations that join node '// &
          to_text(mesh%node_id(nodes(1)))//' to others are too far apart: a motion that they '// &
          'leave free moves nothing but what depends, as far as rounding lets see')
        return
      end if
    end if
    if (.not. ok) then
      call raise(error, exit_machine, 'LAPACK failed on the motions of bodies that equations '// &
        'or springs join')
      return
    end if
    do j = 1, k
      call add_motion(motions, mesh%body(nodes(1)), pin_node(j), pin_dof(j), &
        mesh%coordinates(:, pin_node(j)), 0.0_wp)
    end do
    call keep_joined_motions(nodes, pieces, z, [(motions%n - k + j, j=1, k)], motions)
  end subroutine find_joined_motions

  !> Keep what the motions of a joined body do to its pieces.
  pure subroutine keep_joined_motions(nodes, pieces, motion, of, motions)
    integer, intent(in) :: nodes(:)          !! of the body
    type(pieces_t), intent(in) :: pieces
    real(wp), intent(in) :: motion(:, :)     !! (columns,k)
    integer, intent(in) :: of(:)             !! (k) among the motions
    type(free_motions_t), intent(inout) :: motions
    real(wp), parameter :: nothing = 1.0e-13_wp !! of the largest part of a motion [-]
    real(wp) :: z(size(motion, 1), size(motion, 2))
    integer :: m, p, j

    ! Beside what goes far, rounding would be a motion of what stays.
    do j = 1, size(of)
      z(:, j) = merge(0.0_wp, motion(:, j), abs(motion(:, j)) <= nothing*maxval(abs(motion(:, j))))
    end do

    do m = 1, size(nodes)
      p = pieces%of_node(nodes(m))
      associate (piece => motions%piece(nodes(m)), last => pieces%column(p + 1) - 1, &
                 first => pieces%column(p), extents => pieces%extents(p))
        motions%piece_centre(:, piece) = extents%centre
        motions%piece_extent(piece) = extents%largest
        do j = 1, size(of)
          motions%piece_translation(:, piece, of(j)) = z(first:first + 2, j)
          if (last > first + 2) motions%piece_rotation(:, piece, of(j)) = &
            matmul(extents%turn, z(first + 3:last, j))
        end do
      end associate
    end do
  end subroutine keep_joined_motions

  !> Choose as many degrees of freedom as there are motions, one after the other the one that the
  !> motions not yet pinned move most.
  pure subroutine choose_pins(mesh, nodes, pieces, barred, preferred, z, pin_node, pin_dof)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: nodes(:)                    !! of the body
    type(pieces_t), intent(in) :: pieces
    logical, intent(in) :: barred(:, :), preferred(:)
    real(wp), intent(in) :: z(:, :)                    !! (columns,k) the free motions, orthonormal
    integer, intent(out) :: pin_node(:), pin_dof(:)    !! the first k are set
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
          row = modes_of(pieces, mesh, node, i, z)
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
  subroutine scale_to_pins(mesh, pieces, pin_node, pin_dof, z, ok)
    type(mesh_t), intent(in) :: mesh
    type(pieces_t), intent(in) :: pieces
    integer, intent(in) :: pin_node(:), pin_dof(:) !! (k)
    real(wp), intent(inout) :: z(:, :)             !! (columns,k)
    logical, intent(out) :: ok                     !! false: the pins do not hold the body
    real(wp) :: p(size(z, 2), size(z, 2))
    integer :: j

    do j = 1, size(z, 2)
      p(j, :) = modes_of(pieces, mesh, pin_node(j), pin_dof(j), z)
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

  !> Whether equations join a body, so that its pieces move by themselves.
  pure logical function is_joined(motions, body)
    type(free_motions_t), intent(in) :: motions
    integer, intent(in) :: body

    is_joined = .false.
    if (body > 0 .and. allocated(motions%is_joined)) is_joined = motions%is_joined(body)
  end function is_joined

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
      if (allocated(motions%piece)) then
        associate (piece => motions%piece(node))
          if (piece > 0) u = motions%piece_translation(:, piece, j) + &
            cross(motions%piece_rotation(:, piece, j), place_of(motions, mesh, node) - &
            motions%piece_centre(:, piece))
          if (piece > 0) return
        end associate
      end if
      u = motions%translation(:, j) + cross(motions%rotation(:, j), place_of(motions, mesh, &
        node) - motions%centre(:, j))
    end if
  end function motion_at

  !> Where a node is that motions turn.
  pure function place_of(motions, mesh, node) result(place)
    type(free_motions_t), intent(in) :: motions
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: node
    real(wp) :: place(3) !! [length]

    if (allocated(motions%place)) then
      place = motions%place(:, node)
    else
      place = mesh%coordinates(:, node)
    end if
  end function place_of

  !> The work that nodal forces do on a unit of every motion, and what rounding may be of it: forces
  !> that cancel, at a node or from node to node, or act across a motion, leave no more.
  pure subroutine generalised_loads(motions, mesh, force, summed, load, rounding)
    type(free_motions_t), intent(in) :: motions
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: force(:, :)                !! (3,n_nodes) [force]
    real(wp), intent(in) :: summed(:, :)
    !! (3,n_nodes) the magnitudes that force sums up at each node [force]
    real(wp), allocatable, intent(out) :: load(:)      !! (n) [force]
    real(wp), allocatable, intent(out) :: rounding(:)  !! (n) [force]
    real(wp), parameter :: operations = 45.0_wp ! rounded ones that add up
    real(wp) :: motion(3), largest, magnitude
    integer :: j, node

    allocate (load(motions%n), rounding(motions%n), source=0.0_wp)
    do j = 1, motions%n
      largest = 0.0_wp
      magnitude = 0.0_wp
      do node = 1, mesh%n_nodes
        if (motions%body(j) > 0 .and. motions%body(j) /= mesh%body(node)) cycle
        motion = motion_at(motions, mesh, j, node)
        load(j) = load(j) + dot_product(motion, force(:, node))
        rounding(j) = rounding(j) + operations*epsilon(1.0_wp)*norm2(motion)* &
          norm2(summed(:, node))
        largest = max(largest, norm2(motion))
        magnitude = magnitude + norm2(summed(:, node))
      end do
      ! Where a motion leaves a node at rest it is known no better than elsewhere.
      rounding(j) = rounding(j) + epsilon(1.0_wp)*largest*magnitude
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
        if (motions%body(j) > 0 .and. motions%body(j) /= mesh%body(node)) cycle
        u(:, node) = u(:, node) + a(j)*motion_at(motions, mesh, j, node)
      end do
    end do
  end subroutine add_motions

end module rigid_modes_mod
