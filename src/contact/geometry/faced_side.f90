!> What the points before one side of a master face: its weights, normals and areas, and which of
!> them have two sides that cannot move apart.
!>
!> Weights are found once, a second time where some points have no multiplier, and again until no
!> more are found. docs/theory.md (11.1) to (11.4), (11.17).
module faced_side_mod
  use kinds_mod, only: wp
  use obstacles_mod, only: obstacle_t
  use obstacle_shapes_mod, only: shift_of, rounding_at_rest
  use mesh_mod, only: plane_strain, plane_stress
  use scene_mod, only: scene_t
  use local_refinement_mod, only: hanging_of
  use pair_faces_mod, only: master_faces, slave_faces, touches_itself
  use surfaces_mod, only: all_nodes_of
  use contact_points_mod, only: contact_points_t, weights_t, is_across, faces_of_side, &
    find_side_points, face_one, n_sides
  use local_frame_mod, only: local_frame, straight
  use surface_reach_mod, only: reach_of_faces, reach_of_all, deep_in
  use mortar_rows_mod, only: mortar_t, asked_t, slave_t, lifted_gap, without_rounding
  use mortar_mod, only: make_mortar
  use fixed_points_mod, only: find_fixed, are_held
  use facet_mortar_mod, only: facet_pair_t, join_facets, corners_of, face_facets, near_facets, &
    reach_of_facets, reach_of_all_facets
  implicit none
  private

  public :: faced_side_t, face_surface, face_obstacle, keep_joined, turn_into_plane, replace_rows

  !> What the points face on one side of a master.
  type :: faced_side_t
    type(mortar_t) :: mortar
    logical, allocatable :: is_fixed(:)   !! (n) the two sides cannot move apart along the normal
    real(wp), allocatable :: driven_in(:)
    !! (n) how deep prescribed motion took such a point into its master [length]
    logical, allocatable :: still(:, :)
    !! (3,n) axes that are tangents along which the sides cannot move apart
  end type faced_side_t

  ! By how much of the sum of its weights those of a joined point may differ from the ones that it
  ! keeps. Between sheets that slide on each other by a twentieth of an element those of the sheets
  ! differ by as much.
  real(wp), parameter :: joined = 0.05_wp !! [-]

contains

  !> What the nodes of a slave surface face of one side of a surface where `u` takes them, or with
  !> small sliding where they are in the mesh.
  pure subroutine face_surface(scene, points, pair, side, u, faced, asked)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair, side
    real(wp), intent(in) :: u(:, :)       !! (3,n_nodes) [length]
    type(faced_side_t), intent(out) :: faced
    type(asked_t), intent(in), optional :: asked !! of its mortar, of all points
    real(wp) :: x(3, scene%mesh%n_nodes), reach, far, behind
    type(slave_t) :: slave
    integer, allocatable :: master(:, :), s(:), m(:) !! s, m: nodes of both sides
    integer :: first, last, i

    call find_side_points(points, pair, side, first, last)
    associate (of => scene%pairs(pair), mesh => scene%mesh, &
               slave_nodes => points%node(first:last))
      slave = slave_t(all_nodes_of(slave_faces(scene, points, pair), mesh%connectivity), &
        slave_nodes, hanging_of(mesh%hangs, mesh%between, mesh%n_given, slave_nodes))
      allocate (master, source=all_nodes_of(master_faces(scene, points, pair, side), &
        mesh%connectivity))
      s = scene%surfaces(of%surface)%nodes
      m = scene%surfaces(of%master_surface)%nodes
      if (touches_itself(points, pair)) then
        ! One of both may be empty.
        if (size(slave%faces) > 0) s = corners_of(slave%faces)
        if (size(master) > 0) m = corners_of(master)
      else if (n_sides(points, pair) > 1) then
        m = corners_of(master)
      end if
      slave%rounding = rounding_at_rest(scene)
      x = mesh%coordinates
      if (allocated(mesh%skin)) then
        slave%skin = mesh%skin
        slave%piece = mesh%piece
      end if
      reach = reach_of_faces(slave%faces, master, x) + of%overlap
      behind = deep_in(of%overlap, reach)
      slave%overlap = behind
      if (of%small_sliding) then
        slave%moved = u
      else
        ! What came to overlap has moved as far.
        associate (way => norm2(max(maxval(u(:, s), 2) - minval(u(:, m), 2), maxval(u(:, m), 2) - &
                   minval(u(:, s), 2))))
          reach = reach + way
          behind = deep_in(of%overlap + way, reach)
        end associate
        x = x + u
        slave%mesh = mesh%coordinates
        slave%u = u
      end if
      if (allocated(points%freedom)) then
        slave%asks = points%freedom%is_bound(slave_nodes)
        if (allocated(mesh%hangs)) slave%asks = slave%asks .and. .not. mesh%hangs(slave_nodes)
        if (.not. any(slave%asks)) deallocate (slave%asks)
      end if
      if (present(asked)) slave%asked = part_of(asked, first, last)
      if (any(mesh%plane == [plane_strain, plane_stress])) then
        associate (z => mesh%coordinates(3, :))
          slave%breadth = min(1.0_wp, (maxval(z(m)) - minval(z(m)))/(maxval(z(s)) - minval(z(s))))
        end associate
      end if
      far = reach + reach_of_all(s, m, x)
      allocate (faced%is_fixed(last - first + 1), faced%still(3, last - first + 1), source=.false.)
      allocate (faced%driven_in(last - first + 1), source=0.0_wp)
      call face_faces(slave, master, x, [reach, far, behind], of%small_sliding, faced%mortar)
      if (.not. allocated(faced%mortar%opposite)) return
      call find_fixed_points(scene, points, first, u, faced)
      deallocate (slave%asks)
      allocate (slave%is_fixed(last - first + 1), source=.false.)
      ! With what neighbours get of others they may have nearly all weights on what is held.
      do i = first, last + 1
        if (any(faced%is_fixed .neqv. slave%is_fixed)) then
          slave%is_fixed = faced%is_fixed
          call face_faces(slave, master, x, [reach, far, behind], of%small_sliding, faced%mortar)
        end if
        call find_held_rows(scene, points, first, u, faced)
        if (all(faced%is_fixed .eqv. slave%is_fixed)) exit
      end do
    end associate
  end subroutine face_surface

  !> What is asked of the points before one side.
  pure type(asked_t) function part_of(asked, first, last) result(part)
    type(asked_t), intent(in) :: asked
    integer, intent(in) :: first, last !! of the points

    part%changes = asked%changes
    if (allocated(asked%is_far)) part%is_far = asked%is_far(first:last)
  end function part_of

  !> The faces that are seen within reach. Surfaces that are placed once face whatever lies
  !> opposite, and so do bodies that are apart: a free body may move in any direction.
  pure subroutine face_faces(slave, master, x, reach, is_placed_once, mortar)
    type(slave_t), intent(in) :: slave
    integer, intent(in) :: master(:, :)  !! (4,n_master)
    real(wp), intent(in) :: x(:, :)      !! (3,n_nodes) [length]
    real(wp), intent(in) :: reach(3)     !! near, of everything, and into the master [length]
    logical, intent(in) :: is_placed_once
    type(mortar_t), intent(out) :: mortar

    if (.not. is_placed_once) then
      call make_mortar(slave, master, x, reach(1), mortar, reach(3))
      if (any(mortar%area > 0.0_wp) .or. allocated(slave%asked%is_far)) return
    end if
    call make_mortar(slave, master, x, reach(2), mortar, reach(3))
  end subroutine face_faces

  !> Which points before a surface have two sides that cannot move apart, along the normal or along
  !> an axis across it, by what lies opposite.
  pure subroutine find_fixed_points(scene, points, first, u, faced)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: first          !! of the points
    real(wp), intent(in) :: u(:, :)       !! (3,n_nodes) [length]
    type(faced_side_t), intent(inout) :: faced
    real(wp) :: normal(3), frame(3, 3)
    logical :: still(3), counts
    integer :: i

    do i = 1, size(faced%is_fixed)
      associate (opposite => faced%mortar%opposite(i), n => faced%mortar%opposite(i)%n, &
                 point => first + i - 1)
        if (n == 0) cycle
        call find_normal(points, point, faced%mortar, i, normal, counts)
        if (.not. counts) cycle
        call find_fixed(points%freedom, points%node(point), opposite, undeformed_normal(points, &
          point, normal), still, faced%is_fixed(i))
        if (faced%is_fixed(i)) then
          faced%driven_in(i) = depth_of_motion(scene, points, point, u, opposite%node(:n), &
            opposite%weight(:n), undeformed_normal(points, point, normal))
          faced%driven_in(i) = max(0.0_wp, -lifted_gap(faced%mortar, i, -faced%driven_in(i)))
        else
          ! An axis that is a tangent.
          frame = local_frame(normal)
          faced%still(:, i) = still .and. abs(normal) <= straight .and. &
            maxval(abs(frame(:, 2:)), dim=2) >= 1.0_wp - straight
          ! The half planes of a body of revolution have the axis alone in common.
          if (scene%mesh%sector_angle > 0.0_wp) faced%still(1:3:2, i) = .false.
        end if
      end associate
    end do
  end subroutine find_fixed_points

  !> Add the points whose node and nearly all of whose weights are held along the normal: what would
  !> press there acts on supports and constraints alone, but for a lever that makes it large.
  pure subroutine find_held_rows(scene, points, first, u, faced)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: first          !! of the points
    real(wp), intent(in) :: u(:, :)       !! (3,n_nodes) [length]
    type(faced_side_t), intent(inout) :: faced
    real(wp) :: normal(3)
    logical :: counts
    integer :: i

    do i = 1, size(faced%is_fixed)
      associate (point => first + i - 1, rows => faced%mortar%weights)
        if (faced%is_fixed(i) .or. .not. points%freedom%is_bound(points%node(point))) cycle
        call find_normal(points, point, faced%mortar, i, normal, counts)
        if (.not. counts) cycle
        normal = undeformed_normal(points, point, normal)
        associate (masters => rows%node(rows%first(i):rows%first(i + 1) - 1), &
                   weight => rows%weight(rows%first(i):rows%first(i + 1) - 1))
          if (.not. are_held(points%freedom, points%node(point), masters, weight, normal)) cycle
          faced%is_fixed(i) = .true.
          faced%driven_in(i) = depth_of_motion(scene, points, point, u, masters, weight, normal)
          faced%driven_in(i) = max(0.0_wp, -lifted_gap(faced%mortar, i, -faced%driven_in(i)))
          faced%still(:, i) = .false.
        end associate
      end associate
    end do
  end subroutine find_held_rows

  !> The normal of a point that is covered; of others there is none.
  pure subroutine find_normal(points, point, mortar, i, normal, is_covered)
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: point         !! of all
    type(mortar_t), intent(in) :: mortar
    integer, intent(in) :: i             !! its number in the mortar
    real(wp), intent(out) :: normal(3)
    logical, intent(out) :: is_covered

    normal = mortar%normal(:, i)
    is_covered = mortar%area(i) > 0.0_wp
    if (is_covered) call turn_into_plane(is_across(points, point), normal, is_covered)
  end subroutine find_normal

  !> The normal of a point in the undeformed mesh, where that of now is nearly the same:
  !> inclination that deformation makes of flat faces is none, for it would come and go.
  pure function undeformed_normal(points, i, now) result(normal)
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: i
    real(wp), intent(in) :: now(3)
    real(wp) :: normal(3)
    real(wp), parameter :: same_faces = 0.995_wp
    !! cosine of normals then and now: 6 degrees, what strains of a tenth turn faces by

    normal = now
    if (dot_product(now, points%freedom%normal(:, i)) > same_faces) normal = &
      points%freedom%normal(:, i)
  end function undeformed_normal

  !> How deep prescribed motion takes a point that is fixed into its master, beyond what it is in
  !> there from the start [length].
  pure real(wp) function depth_of_motion(scene, points, i, u, masters, weight, normal) result(depth)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: i, masters(:)  !! the point; the nodes that it faces
    real(wp), intent(in) :: u(:, :)       !! (3,n_nodes) [length]
    real(wp), intent(in) :: weight(:)     !! of the masters [-]
    real(wp), intent(in) :: normal(3)
    real(wp) :: apart(3), moved(3)
    integer :: k

    associate (node => points%node(i), can_move => points%freedom%can_move)
      apart = scene%mesh%coordinates(:, node)
      moved = 0.0_wp
      do k = 1, size(masters)
        apart = apart - weight(k)*scene%mesh%coordinates(:, masters(k))
        where (.not. can_move(:, masters(k))) moved = moved + weight(k)*(u(:, node) - &
          u(:, masters(k)))
      end do
      where (can_move(:, node)) moved = 0.0_wp
      depth = max(0.0_wp, -dot_product(normal, moved) - max(0.0_wp, dot_product(normal, apart) + &
        points%extra_gap(i)))
    end associate
  end function depth_of_motion

  !> Have points that constraints join to what they face stay as they are in the undeformed mesh,
  !> where weights are nearly those of there.
  !>
  !> What joins them is linear in the displacements, with coefficients of the undeformed mesh. Were
  !> their weights and normals not, contact would contradict it by what these change: by forces of
  !> any size. docs/theory.md (11.20).
  pure subroutine keep_joined(scene, points, pair, side, u, mortar)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair, side
    real(wp), intent(in) :: u(:, :)          !! (3,n_nodes) [length]
    type(mortar_t), intent(inout) :: mortar  !! of the points before the side, as u has them
    type(faced_side_t) :: at_rest
    type(mortar_t) :: undeformed
    integer, allocatable :: old(:), new(:)
    real(wp), dimension(3, size(u, 2)) :: nothing, moved
    real(wp), allocatable :: weights(:)
    real(wp) :: weight(size(u, 2)), changed
    integer :: i, k, first, last

    allocate (old(0), new(0))
    call find_side_points(points, pair, side, first, last)
    nothing = 0.0_wp
    weight = 0.0_wp
    if (scene%pairs(pair)%small_sliding) then
      undeformed = mortar
      moved = nothing
    else
      call face_surface(scene, points, pair, side, nothing, at_rest)
      undeformed = at_rest%mortar
      moved = u
    end if
    do i = first, last
      if (.not. points%is_joined(i)) cycle
      associate (here => i - first + 1, before => undeformed%weights, &
                 now => mortar%weights)
        if (undeformed%area(here) <= undeformed%least(here)*undeformed%whole_area(here)) cycle
        old = [(k, k=before%first(here), before%first(here + 1) - 1)]
        new = [(k, k=now%first(here), now%first(here + 1) - 1)]
        weight(now%node(new)) = now%weight(new)
        changed = sum(abs(before%weight(old) - weight(before%node(old))))
        weight(now%node(new)) = 0.0_wp
        if (changed > joined*sum(abs(before%weight(old)))) cycle
        mortar%normal(:, here) = undeformed%normal(:, here)
        mortar%area(here) = undeformed%area(here)
        weights = before%weight(old)
        call face_one(weights)
        ! Apart from each other places that are far from the origin, and motions, keep their digits.
        associate (x => scene%mesh%coordinates, node => points%node(i), masters => before%node(old))
          mortar%apart(:, here) = without_rounding(x(:, node) - matmul(x(:, masters), weights), &
            mortar%normal(:, here), rounding_at_rest(scene)*sum(abs(weights))) + &
            (moved(:, node) - matmul(moved(:, masters), weights))
        end associate
        call replace_rows(now, here, [1, size(old) + 1], before%node(old), weights)
      end associate
    end do
  end subroutine keep_joined

  !> What the nodes of a slave surface face of one side of an obstacle of facets where it stands.
  pure subroutine face_obstacle(scene, points, pair, side, u, obstacle, mortar, asked)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair, side
    real(wp), intent(in) :: u(:, :)       !! (3,n_nodes) [length]
    type(obstacle_t), intent(in) :: obstacle !! as it has turned
    type(mortar_t), intent(out) :: mortar !! of the points before the side
    type(asked_t), intent(in), optional :: asked
    !! of it, of all points; nodes of changes by their place among those of the points
    real(wp) :: x(3, scene%mesh%n_nodes), shift(3), reach
    real(wp), allocatable :: way(:, :)    !! (3,n) of the corners of the side [length]
    integer, allocatable :: facets(:)     !! of the side; not allocated: all
    type(facet_pair_t) :: now
    integer :: first, last

    call find_side_points(points, pair, side, first, last)
    call faces_of_side(points, pair, side, facets)
    shift = shift_of(obstacle, u)
    associate (of => scene%pairs(pair), mesh => scene%mesh, s => points%node(first:last))
      way = obstacle%corner + spread(shift, 2, size(obstacle%corner, 2)) - &
        scene%obstacles(of%master)%corner
      if (allocated(facets)) way = way(:, corners_of(obstacle%facet(:, facets)))
      ! What came to overlap has moved as far.
      x = 0.0_wp
      x(:, s) = mesh%coordinates(:, s) + u(:, s)
      now = join_facets(slave_t(all_nodes_of(scene%surfaces(of%surface)%faces, &
        mesh%connectivity), s, hanging_of(mesh%hangs, mesh%between, mesh%n_given, s)), x, &
        obstacle, shift, facets)
      if (present(asked)) now%slave%asked = part_of(asked, first, last)
      reach = reach_of_facets(now) + of%overlap + &
        norm2(max(maxval(u(:, s), 2) - minval(way, 2), maxval(way, 2) - minval(u(:, s), 2)))
      call face_facets(near_facets(now, reach), reach, mortar)
      ! What moves freely may fall any way.
      if (any(mortar%area > 0.0_wp) .or. allocated(now%slave%asked%is_far)) return
      call face_facets(now, reach + reach_of_all_facets(now), mortar, behind=reach)
    end associate
  end subroutine face_obstacle

  !> A normal on planes of symmetry lies in them. One that does not has no direction there.
  pure subroutine turn_into_plane(across, normal, is_in_plane)
    logical, intent(in) :: across(3)
    real(wp), intent(inout) :: normal(3)
    logical, intent(out) :: is_in_plane
    real(wp) :: length

    is_in_plane = .true.
    if (.not. any(across)) return
    where (across) normal = 0.0_wp
    length = norm2(normal)
    is_in_plane = length > 0.0_wp
    if (is_in_plane) normal = normal/length
  end subroutine turn_into_plane

  !> Put other rows in the place of those of some points that stand together.
  pure subroutine replace_rows(weights, point, first, node, weight)
    type(weights_t), intent(inout) :: weights
    integer, intent(in) :: point              !! the first of them
    integer, intent(in) :: first(:)           !! (n+1) where each row begins, from 1
    integer, intent(in) :: node(:)            !! (n_entries)
    real(wp), intent(in) :: weight(:)         !! (n_entries) [-]
    integer :: before, n_old, behind

    behind = point + size(first) - 1 ! the first point behind them
    before = weights%first(point) - 1
    n_old = weights%first(behind) - 1 - before
    if (n_old /= size(node)) then
      weights%node = [weights%node(:before), node, weights%node(before + n_old + 1:)]
      weights%weight = [weights%weight(:before), weight, weights%weight(before + n_old + 1:)]
      weights%first(behind + 1:) = weights%first(behind + 1:) + size(node) - n_old
    else
      weights%node(before + 1:before + n_old) = node
      weights%weight(before + 1:before + n_old) = weight
    end if
    weights%first(point:behind) = before + first
  end subroutine replace_rows

end module faced_side_mod
