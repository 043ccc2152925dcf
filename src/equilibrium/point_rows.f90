!> The rows of contact points at a displacement, with what they change by as nodes move: gap, slip
!> and the direction of reactions. docs/theory.md (4.26).
module point_rows_mod
  use kinds_mod, only: wp
  use rotations_mod, only: rotation_matrix, turn_between
  use obstacles_mod, only: obstacle_t
  use obstacle_shapes_mod, only: bend_of_gap, shift_of, has_meshed_master
  use mesh_mod, only: mesh_t
  use scene_mod, only: scene_t, pair_turns
  use contact_points_mod, only: contact_points_t, is_across, is_still, is_in_middle, list_slave, &
    is_covered, n_sides, find_side_points
  use mortar_rows_mod, only: mortar_t, asked_t
  use faced_side_mod, only: faced_side_t, face_surface, face_obstacle
  use placement_mod, only: placement_t, as_turned
  use carried_frames_mod, only: turn_of_tangents, slips_around, outer
  use iterate_mod, only: task_t, iterate_t
  implicit none
  private

  public :: point_row_t, kept_changes_t, make_rows

  !> One point's row: how it depends on nodes.
  type :: point_row_t
    integer :: point = 0
    integer, allocatable :: node(:)          !! (n)
    real(wp), allocatable :: part(:)
    !! (n) of the reaction that acts on the node; 0: on it none does [-]
    real(wp), allocatable :: gap(:, :)       !! (3,n) the gap's derivatives [-]
    real(wp), allocatable :: slip(:, :, :)   !! (3,3,n) those of the slip, in x, y, z [-]
    real(wp), allocatable :: normal(:, :, :) !! (3,3,n) those of the normal [1/length]
    integer, allocatable :: master(:)        !! (m) nodes whose weights change
    real(wp), allocatable :: weight(:, :, :) !! (3,m,n) their derivatives [1/length]
    real(wp) :: of_tangent(3, 3, 2) = 0.0_wp !! derivatives of t1, t2 by the normal
  end type point_row_t

  !> What the rows of one side of a pair change by, kept as long as its nodes are near.
  type :: kept_changes_t
    private
    type(mortar_t) :: mortar               !! with its changes
    real(wp), allocatable :: u(:, :)       !! (3,n_nodes) where they were found [length]
  end type kept_changes_t

  real(wp), parameter :: near = 0.003_wp
  !! way of a node beside the size of a face: normals and weights change by about as much, and an
  !! iteration leaves about this part of the error. With 0.01 ironing took 9 iterations for 8 [-]

contains

  !> The rows of some points.
  pure subroutine make_rows(scene, points, task, now, which, renews, kept, rows)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(task_t), intent(in) :: task
    type(iterate_t), intent(in) :: now
    logical, intent(in) :: which(:)          !! (n_points) that face something
    logical, intent(in) :: renews
    !! what sides of pairs change by where that is not near; else what there is of it serves
    type(kept_changes_t), allocatable, intent(inout) :: kept(:, :) !! (n_sides,n_pairs)
    type(point_row_t), allocatable, intent(out) :: rows(:) !! of these, in their order
    real(wp) :: half(3, 3)
    type(obstacle_t) :: obstacle
    integer :: pair, side, first, last, i, j, k

    allocate (rows(count(which)))
    if (.not. allocated(kept)) allocate (kept(maxval([(n_sides(points, pair), pair=1, &
      size(scene%pairs))]), size(scene%pairs)))
    k = 0
    do pair = 1, size(scene%pairs)
      associate (master => scene%pairs(pair)%master)
        half = rotation_matrix([0.0_wp, 0.0_wp, 0.0_wp])
        if (pair_turns(scene, pair)) half = rotation_matrix(0.5_wp*turn_between( &
          task%old%rotation(:, master), task%rotation(:, master)))
        do side = 1, n_sides(points, pair)
          call find_side_points(points, pair, side, first, last)
          if (.not. any(which(first:last))) cycle
          j = k
          do i = first, last
            if (.not. which(i)) cycle
            j = j + 1
            call begin_row(points, i, now%placement, transpose(half), rows(j))
            rows(j)%of_tangent = turn_of_tangents(task%began%frame(:, :, i), &
              now%frame(:, 1, i), slips_around(scene%mesh, points, i))
          end do
          associate (its => rows(k + 1:k + count(which(first:last))))
            if (has_meshed_master(scene, pair)) then
              obstacle = as_turned(scene, master, task%rotation)
              if (renews) call renew(scene, points, pair, side, now%u, kept(side, pair), obstacle)
              call add_facets(points, pair, side, now, obstacle, kept(side, pair), its)
            else if (master > 0) then
              obstacle = as_turned(scene, master, task%rotation)
              call add_obstacle(scene%mesh, points, now%u, obstacle, now%placement, &
                its)
            else if (.not. scene%pairs(pair)%small_sliding) then
              if (renews) call renew(scene, points, pair, side, now%u, kept(side, pair))
              call add_surface(points, pair, side, now, task%began, kept(side, pair), its)
            end if
            k = k + size(its)
          end associate
        end do
      end associate
    end do
  end subroutine make_rows

  !> The row of a point as if its weights and its normal stayed.
  pure subroutine begin_row(points, i, placement, half, row)
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: i
    type(placement_t), intent(in) :: placement
    real(wp), intent(in) :: half(3, 3) !! turns slips back by half of the obstacle's turn
    type(point_row_t), intent(inout) :: row
    integer :: n, node(3), k, a
    real(wp) :: factor(3)

    row%point = i
    call list_slave(points, placement%weights, i, n, node, factor)
    associate (w => placement%weights)
      row%node = [node(:n), w%node(w%first(i):w%first(i + 1) - 1)]
      row%part = [factor(:n), -w%weight(w%first(i):w%first(i + 1) - 1)]
      row%gap = outer(placement%frame(:, 1, i), row%part)
      allocate (row%slip(3, 3, size(row%node)), row%normal(3, 3, size(row%node)), &
        row%weight(3, 0, size(row%node)), source=0.0_wp)
      allocate (row%master(0))
      do k = 1, size(row%node)
        row%slip(:, :, k) = row%part(k)*half
        do a = 1, 3
          ! What a mean makes of nodes beside a plane of symmetry is no motion of the point.
          if (is_across_or_still(points, placement, i, a)) row%slip(a, a, k) = row%slip(a, a, k) - &
            row%part(k)
        end do
      end do
    end associate
  end subroutine begin_row

  pure logical function is_across_or_still(points, placement, i, axis) result(is)
    type(contact_points_t), intent(in) :: points
    type(placement_t), intent(in) :: placement
    integer, intent(in) :: i, axis
    logical :: of(3)

    of = is_across(points, i) .or. is_still(placement%weights, i)
    is = of(axis)
  end function is_across_or_still

  !> Normals of round obstacles, and gaps along edges, each along the normal of its own node.
  pure subroutine add_obstacle(mesh, points, u, obstacle, placement, rows)
    type(mesh_t), intent(in) :: mesh
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: u(:, :)           !! (3,n_nodes) [length]
    type(obstacle_t), intent(in) :: obstacle  !! as it has turned
    type(placement_t), intent(in) :: placement
    type(point_row_t), intent(inout) :: rows(:)
    real(wp) :: bend(3, 3), shift(3)
    integer :: k, e, i

    shift = shift_of(obstacle, u)
    do k = 1, size(rows)
      i = rows(k)%point
      associate (row => rows(k), node => points%node(i), n => placement%frame(:, 1, i))
        if (is_in_middle(points, placement%weights, i)) then
          do e = 1, 2
            row%gap(:, e + 1) = row%part(e + 1)*placement%frame(:, 1, points%end_point(e, i))
          end do
          if (size(row%node) > 3) row%gap(:, 4) = -sum(row%gap(:, :3), dim=2)
        end if
        bend = bend_of_gap(obstacle, shift, mesh%coordinates(:, node) + u(:, node))
        bend = turned_into_plane(is_across(points, i), n, bend)
        row%normal(:, :, 1) = bend
        if (obstacle%ref_node > 0) row%normal(:, :, size(row%node)) = -bend
      end associate
    end do
  end subroutine add_obstacle

  !> What a normal changes by that is turned into planes of symmetry.
  pure function turned_into_plane(across, n, change) result(of)
    logical, intent(in) :: across(3)
    real(wp), intent(in) :: n(3), change(3, 3) !! the turned one [-]; of the other one [1/length]
    real(wp) :: of(3, 3)

    of = change
    if (.not. any(across)) return
    where (spread(across, 2, 3)) of = 0.0_wp
    of = of - outer(n, matmul(n, of))
  end function turned_into_plane

  !> What rows before facets change by: gaps and normals of integrals over the slave's faces.
  pure subroutine add_facets(points, pair, side, now, obstacle, kept, rows)
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair, side
    type(iterate_t), intent(in) :: now
    type(obstacle_t), intent(in) :: obstacle  !! as it has turned
    type(kept_changes_t), intent(in) :: kept
    type(point_row_t), intent(inout) :: rows(:)
    integer, allocatable :: at(:)
    integer :: k, c, first, last, here, n, m, m_first

    if (.not. allocated(kept%mortar%changes)) return
    call find_side_points(points, pair, side, first, last)
    do k = 1, size(rows)
      here = rows(k)%point - first + 1
      associate (row => rows(k), mortar => kept%mortar, changes => kept%mortar%changes, &
                 from => kept%mortar%changes%first(here), &
                 to => kept%mortar%changes%first(here + 1) - 1)
        if (to < from) cycle
        n = size(row%node)
        call widen(points%node(first - 1 + changes%node(from:to)), row, at)
        row%gap = 0.0_wp
        m_first = changes%first_master(here)
        m = changes%first_master(here + 1) - m_first
        row%master = points%node(first - 1 + changes%master(m_first:m_first + m - 1))
        deallocate (row%weight)
        allocate (row%weight(3, m, size(row%node)), source=0.0_wp)
        do c = from, to
          associate (gap => row%gap(:, at(c - from + 1)))
            call add_normal(points, mortar, here, changes%normal(:, :, c), at(c - from + 1), row)
            gap = gap - matmul(mortar%normal(:, here), changes%faced(:, :, c))
            row%weight(:, :, at(c - from + 1)) = changes%weight(:, changes%first_weight(c): &
              changes%first_weight(c) + m - 1)
          end associate
        end do
        call add_lift(points, now, row)
        if (obstacle%ref_node == 0) cycle
        ! A motion of both changes nothing.
        row%gap(:, n) = -sum(row%gap, dim=2)
        row%normal(:, :, n) = -sum(row%normal, dim=3)
        row%weight(:, :, n) = -sum(row%weight, dim=3)
      end associate
    end do
  end subroutine add_facets

  !> What a node in the middle of an edge adds to its gap where it is a point by itself, as of
  !> placements.
  pure subroutine add_lift(points, now, row)
    type(contact_points_t), intent(in) :: points
    type(iterate_t), intent(in) :: now
    type(point_row_t), intent(inout) :: row
    integer, allocatable :: at(:)

    if (.not. allocated(points%alpha)) return
    associate (i => row%point, alpha => points%alpha(row%point))
      if (.not. (alpha > 0.0_wp .and. now%placement%weights%alone(i))) return
      call widen([points%node(points%end_point(:, i)), points%node(i)], row, at)
      row%gap(:, at) = row%gap(:, at) + outer(now%placement%frame(:, 1, i), &
        alpha/(1.0_wp - 2.0_wp*alpha)*[1.0_wp, 1.0_wp, -2.0_wp])
    end associate
  end subroutine add_lift

  !> What rows before surfaces of bodies change by: (11.24), and the slip of (11.18).
  pure subroutine add_surface(points, pair, side, now, began, kept, rows)
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair, side
    type(iterate_t), intent(in) :: now
    type(placement_t), intent(in) :: began
    type(kept_changes_t), intent(in) :: kept
    type(point_row_t), intent(inout) :: rows(:)
    integer, allocatable :: at(:)
    integer :: k, c, i, a, j, first, last, here, m
    logical :: has_slipped

    if (.not. allocated(kept%mortar%changes)) return
    call find_side_points(points, pair, side, first, last)
    do k = 1, size(rows)
      i = rows(k)%point
      here = i - first + 1
      if (allocated(points%is_joined)) then
        if (points%is_joined(i)) cycle
      end if
      associate (row => rows(k), changes => kept%mortar%changes, &
                 from => kept%mortar%changes%first(here), &
                 to => kept%mortar%changes%first(here + 1) - 1, &
                 m_first => kept%mortar%changes%first_master(here), w0 => began%weights)
        if (to < from) cycle
        has_slipped = is_covered(points, w0, i)
        if (has_slipped) then
          ! The slip is (P - P_0) x_m: no part of it is the motion of the node.
          row%slip = -row%slip
          row%slip(:, :, :n_slaves(points, now%placement, i)) = 0.0_wp
        end if
        call widen(changes%node(from:to), row, at)
        m = kept%mortar%changes%first_master(here + 1) - m_first
        row%master = changes%master(m_first:m_first + m - 1)
        deallocate (row%weight)
        allocate (row%weight(3, m, size(row%node)), source=0.0_wp)
        do c = from, to
          associate (n => at(c - from + 1))
            call add_normal(points, kept%mortar, here, changes%normal(:, :, c), n, row)
            row%gap(:, n) = row%gap(:, n) - matmul(now%placement%frame(:, 1, i), &
              changes%faced(:, :, c))
            row%weight(:, :, n) = changes%weight(:, changes%first_weight(c): &
              changes%first_weight(c) + m - 1)
            if (has_slipped) row%slip(:, :, n) = row%slip(:, :, n) + changes%faced(:, :, c)
          end associate
        end do
        if (.not. has_slipped) cycle
        call widen(w0%node(w0%first(i):w0%first(i + 1) - 1), row, at)
        do j = 1, size(at)
          do a = 1, 3
            associate (slip => row%slip(a, a, at(j)))
              slip = slip - w0%weight(w0%first(i) + j - 1)
            end associate
          end do
        end do
        do a = 1, 3
          if (is_across_or_still(points, now%placement, i, a)) row%slip(a, :, :) = 0.0_wp
        end do
      end associate
    end do
  end subroutine add_surface

  !> Find what a side changes by, unless that still holds.
  pure subroutine renew(scene, points, pair, side, u, kept, obstacle)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair, side
    real(wp), intent(in) :: u(:, :)           !! (3,n_nodes) [length]
    type(kept_changes_t), intent(inout) :: kept
    type(obstacle_t), intent(in), optional :: obstacle !! the master, as it has turned
    type(faced_side_t) :: faced
    type(asked_t) :: asked

    if (is_near(kept, u)) return
    asked%changes = .true.
    if (present(obstacle)) then
      call face_obstacle(scene, points, pair, side, u, obstacle, kept%mortar, asked)
    else
      call face_surface(scene, points, pair, side, u, faced, asked)
      kept%mortar = faced%mortar
    end if
    kept%u = u
  end subroutine renew

  !> Whether what a side changes by still holds.
  pure logical function is_near(kept, u)
    type(kept_changes_t), intent(in) :: kept
    real(wp), intent(in) :: u(:, :)        !! (3,n_nodes) [length]

    is_near = allocated(kept%mortar%changes)
    if (.not. is_near) return
    associate (area => kept%mortar%area, nodes => kept%mortar%changes%node)
      is_near = all(norm2(u(:, nodes) - kept%u(:, nodes), dim=1) <= near*sqrt(minval(area, &
        mask=area > 0.0_wp)))
    end associate
  end function is_near

  !> How many nodes are on the slave's side of a point.
  pure integer function n_slaves(points, placement, i) result(n)
    type(contact_points_t), intent(in) :: points
    type(placement_t), intent(in) :: placement
    integer, intent(in) :: i

    n = merge(3, 1, is_in_middle(points, placement%weights, i))
  end function n_slaves

  !> What the normal of a mortar, turned into planes of symmetry, changes by as a node moves, and
  !> the gap with it.
  pure subroutine add_normal(points, mortar, here, change, at, row)
    type(contact_points_t), intent(in) :: points
    type(mortar_t), intent(in) :: mortar
    integer, intent(in) :: here           !! of the mortar's rows
    real(wp), intent(in) :: change(3, 3)  !! of its normal [1/length]
    integer, intent(in) :: at             !! of the row's nodes
    type(point_row_t), intent(inout) :: row
    real(wp) :: n(3), turn(3, 3)

    n = mortar%normal(:, here)
    where (is_across(points, row%point)) n = 0.0_wp
    turn = turned_into_plane(is_across(points, row%point), n/norm2(n), change/norm2(n))
    row%normal(:, :, at) = row%normal(:, :, at) + turn
    row%gap(:, at) = row%gap(:, at) + matmul(mortar%apart(:, here), turn)
  end subroutine add_normal

  !> Find nodes in a row. What it does not have it gets; on these no reaction acts.
  pure subroutine widen(nodes, row, at)
    integer, intent(in) :: nodes(:)
    type(point_row_t), intent(inout) :: row
    integer, allocatable, intent(out) :: at(:) !! (size(nodes)) where they are in it
    real(wp), allocatable :: gap(:, :), slip(:, :, :), normal(:, :, :), weight(:, :, :)
    integer :: i, n

    n = size(row%node)
    allocate (at(size(nodes)))
    do i = 1, size(nodes)
      at(i) = findloc(row%node, nodes(i), dim=1)
      if (at(i) > 0) cycle
      row%node = [row%node, nodes(i)]
      at(i) = size(row%node)
    end do
    associate (all => size(row%node))
      if (all == n) return
      row%part = [row%part, spread(0.0_wp, 1, all - n)]
      allocate (gap(3, all), slip(3, 3, all), normal(3, 3, all), weight(3, size(row%master), all), &
        source=0.0_wp)
    end associate
    gap(:, :n) = row%gap
    slip(:, :, :n) = row%slip
    normal(:, :, :n) = row%normal
    weight(:, :, :n) = row%weight
    call move_alloc(gap, row%gap)
    call move_alloc(slip, row%slip)
    call move_alloc(normal, row%normal)
    call move_alloc(weight, row%weight)
  end subroutine widen

end module point_rows_mod
