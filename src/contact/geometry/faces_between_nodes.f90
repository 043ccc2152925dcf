!> Obstacles between the nodes: contact is a matter of nodes, so an obstacle may enter a slave face
!> where there is none. docs/theory.md section 10, (10.6) to (10.8).
module faces_between_nodes_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: cross
  use cells_mod, only: face_corners
  use connectivity_mod, only: corners_in
  use face_overlap_mod, only: doubled_area
  use obstacles_mod, only: obstacle_t
  use obstacle_shapes_mod, only: enters_faces, has_round_master, get_core, shift_of, turned
  use local_refinement_mod, only: parents_of
  use local_frame_mod, only: transport_tangent
  use rotations_mod, only: turn_between
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t
  use placement_mod, only: placement_t, place_undeformed, place
  use follow_points_mod, only: rounding_of_places
  use smooth_faces_mod, only: smooth_faces_t, make_smooth_faces, no_faces, bulge_at, shape_at, &
    find_closest
  implicit none
  private

  public :: face_entry_t, entries_t, list_faces, find_entries, deepest_untouched, take_passed
  public :: entered_at_end, entered_on_way, entered_and_left

  integer, parameter :: entered_at_end = 1   !! and the step ends with that
  integer, parameter :: entered_on_way = 2   !! and out again within the increment
  integer, parameter :: entered_and_left = 3 !! entered when the increment began

  !> How deep an obstacle is in a slave face.
  type :: face_entry_t
    real(wp) :: depth = 0.0_wp !! 0: it is not [length]
    integer  :: pair = 0
    integer  :: nodes(face_corners) = 0
    !! of the face; the fourth of a triangle is 0, or the third again
  end type face_entry_t

  !> What one increment's faces show.
  type :: entries_t
    type(face_entry_t) :: at_end  !! the deepest at the end of the increment
    type(face_entry_t) :: on_way  !! the deepest before that, of faces that nothing touches nearby
    type(face_entry_t) :: missed  !! a contact that no node has seen; depth 0: none
    integer  :: how = 0           !! it was missed: entered_at_end and so on
    type(face_entry_t) :: passed  !! of what smaller increments may meet; depth 0: none
    real(wp) :: work = 0.0_wp     !! |sum int p g^- dA| [energy]
  end type entries_t

  !> What one obstacle does to faces, until it is judged.
  type :: of_obstacle_t
    type(face_entry_t) :: untouched  !! the deepest at the end where nothing touches nearby
    type(face_entry_t) :: before     !! the same at the beginning
    type(face_entry_t) :: on_way     !! the deepest between, the same
    type(face_entry_t) :: swept      !! the same, near what touches too, by one that ends off all
    type(face_entry_t) :: through    !! the same, of an obstacle whose middle goes through the face
    logical  :: creeps = .false.     !! through, by less than its radius in the increment
    real(wp) :: deepest_at_ends = 0.0_wp !! touched or not [length]
    logical  :: presses_before = .false. !! when the increment begins
    logical  :: touches_before = .false., touches = .false.
  end type of_obstacle_t

  !> One face relative to an obstacle, in whose middle or axis the origin is.
  type :: face_t
    real(wp) :: x(3, face_corners) = 0.0_wp    !! its nodes when the increment begins [length]
    real(wp) :: way(3, face_corners) = 0.0_wp  !! how far they go [length]
    real(wp) :: normal(3, 2) = 0.0_wp !! outward, at both ends of the increment; of any length
    real(wp) :: extra(face_corners) = 0.0_wp   !! *CONTACT GAP [length]
    real(wp) :: radius = 0.0_wp     !! of the obstacle [length]
    real(wp) :: axis(3) = 0.0_wp    !! of a cylinder, 0 for a sphere [-]
  end type face_t

  real(wp), parameter :: at_three(3) = [-1, 0, 1]
  real(wp), parameter :: simpson(3) = [1.0_wp/3.0_wp, 4.0_wp/3.0_wp, 1.0_wp/3.0_wp]
  real(wp), parameter :: part_of_radius = 0.5_wp !! that an obstacle never comes deep by pressing
  real(wp), parameter :: all_but = 0.01_wp  !! of a depth: a gap beside which it is that of contact
  real(wp), parameter :: known_to = 0.05_wp !! part of its bulge that a smooth surface may be off

contains

  !> The faces of every pair that an obstacle can enter between their nodes.
  pure subroutine list_faces(scene, faces)
    type(scene_t), intent(in) :: scene
    type(smooth_faces_t), allocatable, intent(out) :: faces(:) !! (n_pairs)
    integer :: pair

    allocate (faces(size(scene%pairs)))
    do pair = 1, size(scene%pairs)
      if (has_round_master(scene, pair)) then
        faces(pair) = make_smooth_faces(scene%mesh, scene%surfaces(scene%pairs(pair)%surface))
      else
        faces(pair) = no_faces()
      end if
    end do
  end subroutine list_faces

  !> Look at all slave faces at the end of an increment and along the way to it.
  subroutine find_entries(scene, points, faces, tolerance, old, new, last_of_step, entries)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(smooth_faces_t), intent(in) :: faces(:) !! of list_faces
    real(wp), intent(in) :: tolerance            !! of contact [-]
    type(state_t), intent(in) :: old, new        !! the increment's beginning and end
    logical, intent(in) :: last_of_step
    type(entries_t), intent(out) :: entries
    type(of_obstacle_t) :: found
    type(obstacle_t) :: at_old, at_new    !! the obstacle as it stands at `old` and `new`
    real(wp) :: bend                      !! of its middle's way from the chord [length]
    type(placement_t) :: before, after    !! of what obstacles can enter, at `old` and `new`
    real(wp), allocatable :: extra(:), pressure(:)    !! (n_nodes) [length], [force/length^2]
    logical, allocatable :: near_before(:), near(:)   !! (n_nodes) of faces with a touching node
    logical, allocatable :: pressed(:)  !! (n_nodes) of faces with a node that pressed before
    type(face_entry_t), allocatable :: dents(:)       !! all faces that the obstacle is in
    real(wp) :: allowed
    logical :: begins
    integer :: obstacle, pair

    if (.not. any([(size(faces(pair)%nodes) > 0, pair=1, size(faces))])) return
    allowed = 10.0_wp*tolerance*max(maxval(abs(new%displacement)), &
      maxval(abs(old%displacement))) + rounding_of_places(scene, new%displacement)
    call place_undeformed(scene, points, before)
    after = before
    do pair = 1, size(scene%pairs)
      if (.not. has_round_master(scene, pair)) cycle
      call place(scene, points, pair, old%displacement, before, old%rotation)
      call place(scene, points, pair, new%displacement, after, new%rotation)
    end do
    ! Where the deck has its obstacles nothing needs to touch yet.
    begins = old%increments_done == 0
    do obstacle = 1, size(scene%obstacles)
      if (.not. enters_faces(scene%obstacles(obstacle))) cycle
      found = of_obstacle_t()
      call turn_obstacle(scene, obstacle, old, new, at_old, at_new, bend)
      call mark_touching(scene, points, faces, obstacle, before, old%reaction, allowed, near_before)
      call mark_touching(scene, points, faces, obstacle, before, old%reaction, -huge(allowed), &
        pressed)
      call mark_touching(scene, points, faces, obstacle, after, new%reaction, allowed, near)
      found%presses_before = any(pressed)
      found%touches_before = any(near_before)
      found%touches = any(near)
      call spread_points(scene, points, obstacle, after, new%reaction, extra, pressure)
      allocate (dents(0))
      do pair = 1, size(scene%pairs)
        if (scene%pairs(pair)%master /= obstacle) cycle
        call look_at_pair(pair)
      end do
      found%untouched = deepest_untouched(dents, near)
      if (found%untouched%depth > 0.0_wp) then
        ! How deep it is where nodes all but touch is a matter of the mesh, as where they do.
        call mark_touching(scene, points, faces, obstacle, after, new%reaction, max(allowed, &
          all_but*found%untouched%depth), near)
        found%touches = any(near)
        found%untouched = deepest_untouched(dents, near)
      end if
      deallocate (dents)
      call judge(found, allowed, last_of_step, entries)
    end do
    entries%work = abs(entries%work)

  contains

    !> The faces of one pair.
    subroutine look_at_pair(pair)
      integer, intent(in) :: pair
      type(face_t) :: face
      integer :: f
      logical :: is_near, was_near
      real(wp) :: gap, least, middle(2)

      do f = 1, size(faces(pair)%nodes, 2)
        associate (nodes => faces(pair)%nodes(:, f))
          call set_face(at_old, at_new, scene%mesh%coordinates(:, nodes), &
            extra(nodes), old, new, nodes, face)
          if (is_far(face)) cycle
          was_near = any(near_before(nodes))
          is_near = any(near(nodes))
          call find_least_gap(faces(pair), f, face, [1.0_wp, 1.0_wp], gap, middle)
          found%deepest_at_ends = max(found%deepest_at_ends, -gap)
          if (-gap > allowed) call keep_deeper(-gap, pair, nodes, entries%at_end)
          if (-gap > allowed) dents = [dents, face_entry_t(-gap, pair, nodes)]
          if (any(pressure(nodes) > 0.0_wp)) entries%work = entries%work + work_of_face( &
            faces(pair), f, face, scene%mesh%coordinates(:, nodes), pressure(nodes))
          if (is_near .or. any(pressed(nodes))) then
            ! What touches goes deep nowhere, unless its middle passes the face.
            least = part_of_radius*face%radius
            if (found%presses_before .and. .not. found%touches) then
              least = allowed
            else if (-gap < least .and. maxval(norm2(face%way, dim=1)) < least) then
              cycle
            end if
          else
            call find_least_gap(faces(pair), f, face, [0.0_wp, 0.0_wp], gap, middle)
            found%deepest_at_ends = max(found%deepest_at_ends, -gap)
            if (-gap > allowed .and. .not. (begins .or. was_near)) call keep_deeper(-gap, pair, &
              nodes, found%before)
            least = allowed
          end if
          call find_least_gap(faces(pair), f, face, [0.0_wp, 1.0_wp], gap, middle)
          gap = gap + bend
          if (.not. -gap > least) cycle
          call keep_deeper(-gap, pair, nodes, found%swept)
          if (goes_through(face, middle) .and. .not. ((is_near .or. any(pressed(nodes))) .and. &
            -gap < part_of_radius*face%radius)) then
            if (-gap > found%through%depth) found%creeps = maxval(norm2(face%way, dim=1)) < &
              part_of_radius*face%radius
            call keep_deeper(-gap, pair, nodes, found%through)
          end if
          if (.not. (is_near .or. any(pressed(nodes)))) call keep_deeper(-gap, pair, nodes, &
            found%on_way)
        end associate
      end do
    end subroutine look_at_pair

  end subroutine find_entries

  !> Which entries of an obstacle are a contact that no node has seen.
  !>
  !> At the end of an increment within a step an obstacle may be on its way to the nodes. In what it
  !> sweeps between two touches it may seem deep: the way of large increments is no straight line.
  subroutine judge(found, allowed, last_of_step, entries)
    type(of_obstacle_t), intent(in) :: found
    real(wp), intent(in) :: allowed    !! [length]
    logical, intent(in) :: last_of_step
    type(entries_t), intent(inout) :: entries
    logical :: crosses

    crosses = is_across(found%on_way)
    if (crosses .and. found%on_way%depth > entries%on_way%depth) entries%on_way = found%on_way
    if (found%through%depth > 0.0_wp) then
      call take(found%through, entered_on_way)
    else if (crosses .and. .not. (found%touches .or. found%presses_before)) then
      call take(found%on_way, entered_on_way)
    else if (found%untouched%depth > 0.0_wp) then
      if (last_of_step) call take(found%untouched, entered_at_end)
    else if (.not. (found%touches .or. found%touches_before)) then
      call take(found%before, entered_and_left)
    end if
    ! What pressed and has left all may have gone over an edge that it would be held by.
    if (found%presses_before .and. .not. found%touches .and. is_across(found%swept)) then
      if (found%swept%depth > entries%on_way%depth) entries%on_way = found%swept
      if (.not. entries%missed%depth > 0.0_wp) entries%passed = found%swept
    end if

  contains

    !> Whether it is much deeper on the way than at its ends.
    pure logical function is_across(entry)
      type(face_entry_t), intent(in) :: entry

      is_across = entry%depth > 2.0_wp*found%deepest_at_ends + allowed
    end function is_across

    subroutine take(entry, how)
      type(face_entry_t), intent(in) :: entry
      integer, intent(in) :: how

      if (.not. entry%depth > entries%missed%depth) return
      entries%missed = entry
      entries%how = how
      ! What is between the nodes already passes by them in smaller increments, too.
      entries%passed = face_entry_t()
      if (how /= entered_on_way .or. found%before%depth > 0.0_wp .or. found%creeps) return
      entries%passed = entry
    end subroutine take

  end subroutine judge

  !> Take in what is passed on the way by other means: contact that is missed, or not.
  pure subroutine take_passed(entry, is_missed, entries)
    type(face_entry_t), intent(in) :: entry
    logical, intent(in) :: is_missed
    type(entries_t), intent(inout) :: entries

    if (entry%depth > entries%on_way%depth) entries%on_way = entry
    if (.not. entries%missed%depth > 0.0_wp) entries%passed = entry
    if (.not. is_missed .or. entries%missed%depth > 0.0_wp) return
    entries%missed = entry
    entries%how = entered_on_way
  end subroutine take_passed

  !> The deepest entry that no touching node excuses.
  !>
  !> A dent may reach over several faces: a node that touches near one of them is near all of it.
  pure function deepest_untouched(dents, near) result(deepest)
    type(face_entry_t), intent(in) :: dents(:)
    logical, intent(in) :: near(:) !! (n_nodes) of faces with a touching node
    type(face_entry_t) :: deepest
    logical :: reached(size(near)), grows
    integer :: i

    reached = near
    grows = .true.
    do while (grows)
      grows = .false.
      do i = 1, size(dents)
        associate (nodes => dents(i)%nodes(:corners_in(dents(i)%nodes)))
          if (.not. any(reached(nodes)) .or. all(reached(nodes))) cycle
          reached(nodes) = .true.
        end associate
        grows = .true.
      end do
    end do
    do i = 1, size(dents)
      if (any(reached(dents(i)%nodes(:corners_in(dents(i)%nodes))))) cycle
      call keep_deeper(dents(i)%depth, dents(i)%pair, dents(i)%nodes, deepest)
    end do
  end function deepest_untouched

  pure subroutine keep_deeper(depth, pair, nodes, deepest)
    real(wp), intent(in) :: depth !! [length]
    integer, intent(in) :: pair, nodes(face_corners)
    type(face_entry_t), intent(inout) :: deepest

    if (depth > deepest%depth) deepest = face_entry_t(depth, pair, nodes)
  end subroutine keep_deeper

  !> The nodes of all faces that have a node on the obstacle.
  pure subroutine mark_touching(scene, points, faces, obstacle, placement, reaction, allowed, &
    near)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(smooth_faces_t), intent(in) :: faces(:)
    integer, intent(in) :: obstacle
    type(placement_t), intent(in) :: placement
    real(wp), intent(in) :: reaction(:, :)           !! (3,n_points) [force]
    real(wp), intent(in) :: allowed                  !! gap of a node that touches [length]
    logical, allocatable, intent(out) :: near(:)     !! (n_nodes) none where no node is on it
    logical :: on_it(scene%mesh%n_nodes)
    integer :: i, f, pair

    on_it = .false.
    do i = 1, points%n
      if (scene%pairs(points%pair(i))%master /= obstacle) cycle
      ! On it without a force: about to touch, or held there.
      if (any(abs(reaction(:, i)) > 0.0_wp) .or. placement%gap(i) <= allowed) then
        on_it(points%node(i)) = .true.
      end if
    end do
    near = on_it
    if (.not. any(on_it)) return
    do pair = 1, size(faces)
      if (scene%pairs(pair)%master /= obstacle) cycle
      do f = 1, size(faces(pair)%nodes, 2)
        if (any(on_it(faces(pair)%nodes(:, f)))) near(faces(pair)%nodes(:, f)) = .true.
      end do
    end do
  end subroutine mark_touching

  !> What the points of an obstacle know, as fields over the nodes.
  pure subroutine spread_points(scene, points, obstacle, placement, reaction, extra, pressure)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: obstacle
    type(placement_t), intent(in) :: placement
    real(wp), intent(in) :: reaction(:, :)            !! (3,n_points) x, y, z [force]
    real(wp), allocatable, intent(out) :: extra(:)    !! (n_nodes) *CONTACT GAP [length]
    real(wp), allocatable, intent(out) :: pressure(:) !! (n_nodes) [force/length^2]
    integer :: i

    allocate (extra(scene%mesh%n_nodes), pressure(scene%mesh%n_nodes), source=0.0_wp)
    do i = 1, points%n
      if (scene%pairs(points%pair(i))%master /= obstacle) cycle
      extra(points%node(i)) = points%extra_gap(i)
      if (.not. (points%area(i) > 0.0_wp .and. any(abs(reaction(:, i)) > 0.0_wp))) cycle
      pressure(points%node(i)) = max(0.0_wp, dot_product(reaction(:, i), &
        placement%frame(:, 1, i)))/points%area(i)
    end do
    if (.not. allocated(scene%mesh%hangs)) return
    do i = 1, size(scene%mesh%between, 2)
      if (.not. scene%mesh%hangs(scene%mesh%n_given + i)) cycle
      associate (node => scene%mesh%n_given + i, parents => parents_of(scene%mesh%between(:, i)))
        extra(node) = sum(extra(parents))/real(size(parents), wp)
        pressure(node) = sum(pressure(parents))/real(size(parents), wp)
      end associate
    end do
  end subroutine spread_points

  !> A face as the obstacle sees it.
  pure subroutine set_face(at_old, at_new, coordinates, extra, old, new, nodes, face)
    type(obstacle_t), intent(in) :: at_old, at_new      !! the obstacle at `old` and `new`
    real(wp), intent(in) :: coordinates(3, face_corners), extra(face_corners) !! [length]
    type(state_t), intent(in) :: old, new
    integer, intent(in) :: nodes(face_corners)
    type(face_t), intent(out) :: face
    real(wp) :: core(3), old_core(3), old_axis(3), shift(3)
    integer :: k

    face%extra = extra
    face%normal(:, 1) = doubled_area(coordinates + old%displacement(:, nodes))
    face%normal(:, 2) = doubled_area(coordinates + new%displacement(:, nodes))
    call get_core(at_old, old_core, old_axis, face%radius)
    call get_core(at_new, core, face%axis, face%radius)
    face%x = coordinates + old%displacement(:, nodes) - spread(old_core, 2, face_corners)
    face%way = new%displacement(:, nodes) - old%displacement(:, nodes)
    shift = shift_of(at_old, old%displacement)
    face%x = face%x - spread(shift, 2, face_corners)
    shift = shift_of(at_new, new%displacement) - shift
    face%way = face%way - spread(shift + (core - old_core), 2, face_corners)
    if (at_new%turns) call follow_axis(old_axis, face)
    do k = 1, face_corners
      face%x(:, k) = across(face, face%x(:, k))
      face%way(:, k) = across(face, face%way(:, k))
    end do

  end subroutine set_face

  !> The face as it stood when the increment began, seen from a cylinder whose axis has turned.
  pure subroutine follow_axis(old_axis, face)
    real(wp), intent(in) :: old_axis(3) !! unit vector, 0 of a sphere
    type(face_t), intent(inout) :: face
    real(wp) :: ends(3, face_corners)
    integer :: k

    if (.not. any(abs(old_axis - face%axis) > 0.0_wp)) return
    ends = face%x + face%way
    do k = 1, face_corners
      face%x(:, k) = face%x(:, k) - dot_product(old_axis, face%x(:, k))*old_axis
      face%x(:, k) = transport_tangent(face%x(:, k), old_axis, face%axis)
    end do
    face%way = ends - face%x
  end subroutine follow_axis

  !> An obstacle as it stands at both ends of an increment, and how far its middle leaves the chord
  !> between: what is swept along the chord and not along the arc is no contact.
  pure subroutine turn_obstacle(scene, number, old, new, at_old, at_new, bend)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: number
    type(state_t), intent(in) :: old, new
    type(obstacle_t), intent(out) :: at_old, at_new
    real(wp), intent(out) :: bend  !! [length]
    real(wp) :: arm(3), axis(3), half

    at_old = scene%obstacles(number)
    at_new = at_old
    bend = 0.0_wp
    if (.not. at_new%turns) return
    associate (pivot => scene%mesh%coordinates(:, at_new%ref_node))
      at_old = turned(scene%obstacles(number), old%rotation(:, number), pivot)
      at_new = turned(scene%obstacles(number), new%rotation(:, number), pivot)
      axis = turn_between(old%rotation(:, number), new%rotation(:, number))
      half = 0.5_wp*norm2(axis)
      if (half <= 0.0_wp) return
      axis = axis/(2.0_wp*half)
      arm = at_new%point - pivot
      arm = arm - dot_product(arm, axis)*axis
      bend = 2.0_wp*sin(0.5_wp*half)**2*norm2(arm)
    end associate
  end subroutine turn_obstacle

  !> The part of a vector that a cylinder's distance is measured along.
  pure function across(face, v)
    type(face_t), intent(in) :: face
    real(wp), intent(in) :: v(3)
    real(wp) :: across(3)

    across = v - dot_product(face%axis, v)*face%axis
  end function across

  !> Whether no point of a face can be in the obstacle during the increment.
  pure logical function is_far(face)
    type(face_t), intent(in) :: face
    real(wp) :: x(3), way(3), s, extent

    x = sum(face%x, dim=2)/real(face_corners, wp)
    way = sum(face%way, dim=2)/real(face_corners, wp)
    extent = maxval(norm2(face%x - spread(x, 2, face_corners), dim=1)) + &
      maxval(norm2(face%way - spread(way, 2, face_corners), dim=1))
    s = 0.0_wp
    if (dot_product(way, way) > 0.0_wp) s = min(1.0_wp, max(0.0_wp, -dot_product(x, way)/ &
      dot_product(way, way)))
    is_far = norm2(x + s*way) - extent + minval(face%extra) > face%radius
  end function is_far

  !> The least gap of a face: at 3 x 3 points, and where the flat face comes closest.
  subroutine find_least_gap(faces, f, face, s_range, least, xi_eta)
    type(smooth_faces_t), intent(in) :: faces
    integer, intent(in) :: f
    type(face_t), intent(in) :: face
    real(wp), intent(in) :: s_range(2) !! part of the way, 0 to 1
    real(wp), intent(out) :: least     !! [length]
    real(wp), intent(out) :: xi_eta(2)  !! where on the face it is
    real(wp) :: xi, eta, s, start(3), distance, closest, gap
    integer :: i, j

    least = huge(1.0_wp)
    closest = huge(1.0_wp)
    xi_eta = 0.0_wp
    start = 0.0_wp
    do j = 1, 3
      do i = 1, 3
        xi = at_three(i)
        eta = at_three(j)
        s = s_of(shape_at(xi, eta))
        call look(xi, eta, s)
        if (distance >= closest) cycle
        closest = distance
        start = [xi, eta, s]
      end do
    end do
    call find_closest(face%x, face%way, s_range, start(1), start(2), start(3))
    call look(start(1), start(2), start(3))

  contains

    subroutine look(xi, eta, s)
      real(wp), intent(in) :: xi, eta, s

      call gap_at(faces, f, face, xi, eta, s, distance, gap)
      if (gap >= least) return
      least = gap
      xi_eta = [xi, eta]
    end subroutine look

    !> Where a point of the face comes closest on its way.
    pure real(wp) function s_of(n)
      real(wp), intent(in) :: n(face_corners)
      real(wp) :: x(3), way(3)

      x = matmul(face%x, n)
      way = matmul(face%way, n)
      s_of = s_range(2)
      if (dot_product(way, way) > 0.0_wp) s_of = min(s_range(2), max(s_range(1), &
        -dot_product(x, way)/dot_product(way, way)))
    end function s_of

  end subroutine find_least_gap

  !> Gap of a point of a face: the larger of that of the flat face and that of the smooth one.
  !> docs/theory.md (10.6).
  pure subroutine gap_at(faces, f, face, xi, eta, s, distance, gap)
    type(smooth_faces_t), intent(in) :: faces
    integer, intent(in) :: f
    type(face_t), intent(in) :: face
    real(wp), intent(in) :: xi, eta, s
    real(wp), intent(out) :: distance !! of the flat face from the middle or axis [length]
    real(wp), intent(out) :: gap      !! [length]
    real(wp) :: n(face_corners), x(3), bulge(3)

    n = shape_at(xi, eta)
    x = matmul(face%x + s*face%way, n)
    bulge = bulge_at(faces, f, xi, eta)
    distance = norm2(x)
    gap = max(distance, norm2(x + across(face, bulge)) + known_to*norm2(bulge)) - face%radius + &
      dot_product(n, face%extra)
  end subroutine gap_at

  !> Whether the middle of an obstacle goes from the outer side of a face to the inner.
  pure logical function goes_through(face, xi_eta)
    type(face_t), intent(in) :: face
    real(wp), intent(in) :: xi_eta(2)
    real(wp) :: n(face_corners)

    n = shape_at(xi_eta(1), xi_eta(2))
    goes_through = dot_product(matmul(face%x, n), face%normal(:, 1)) < 0.0_wp .and. &
      dot_product(matmul(face%x + face%way, n), face%normal(:, 2)) > 0.0_wp
  end function goes_through

  !> int p g^- dA over a face at the end of the increment, by Simpson's rule. docs/theory.md (10.8).
  pure function work_of_face(faces, f, face, coordinates, pressure) result(work)
    type(smooth_faces_t), intent(in) :: faces
    integer, intent(in) :: f
    type(face_t), intent(in) :: face
    real(wp), intent(in) :: coordinates(3, face_corners) !! [length]
    real(wp), intent(in) :: pressure(face_corners)       !! of the nodes [force/length^2]
    real(wp) :: work                          !! not positive [energy]
    real(wp) :: gap, distance, one(3), other(3)
    integer :: i, j

    work = 0.0_wp
    do j = 1, 3
      do i = 1, 3
        call gap_at(faces, f, face, at_three(i), at_three(j), 1.0_wp, distance, gap)
        if (gap >= 0.0_wp) cycle
        one = 0.5_wp*matmul(coordinates, shape_at(1.0_wp, at_three(j)) - &
          shape_at(-1.0_wp, at_three(j)))
        other = 0.5_wp*matmul(coordinates, shape_at(at_three(i), 1.0_wp) - &
          shape_at(at_three(i), -1.0_wp))
        work = work + simpson(i)*simpson(j)*norm2(cross(one, other))*gap* &
          dot_product(shape_at(at_three(i), at_three(j)), pressure)
      end do
    end do
  end function work_of_face

end module faces_between_nodes_mod
