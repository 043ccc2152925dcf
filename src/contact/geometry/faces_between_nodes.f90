!> Obstacles between the nodes: contact is a matter of nodes, so an obstacle may enter a slave face
!> where there is none. docs/theory.md section 10, (10.6) to (10.8).
module faces_between_nodes_mod
  use kinds_mod, only: wp
  use cells_mod, only: face_corners
  use connectivity_mod, only: corners_in
  use obstacles_mod, only: obstacle_t
  use obstacle_shapes_mod, only: enters_faces, has_round_master, turned
  use local_refinement_mod, only: parents_of
  use rotations_mod, only: turn_between
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t, is_pair_removed
  use state_mod, only: state_t
  use placement_mod, only: placement_t, place_undeformed, place
  use follow_points_mod, only: rounding_of_places
  use smooth_faces_mod, only: smooth_faces_t, make_smooth_faces, no_faces, shape_at
  use moving_faces_mod, only: moving_face_t, set_face, is_far, find_least_gap, goes_through, &
    work_of_face, mean_depth
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
    type(face_entry_t) :: at_end = face_entry_t() !! the deepest at the end of the increment
    type(face_entry_t) :: on_way = face_entry_t()
    !! the deepest before that, of faces that nothing touches nearby
    type(face_entry_t) :: missed = face_entry_t() !! a contact no node has seen; depth 0: none
    integer  :: how = 0           !! it was missed: entered_at_end and so on
    type(face_entry_t) :: passed = face_entry_t()
    !! of what smaller increments may meet; depth 0: none
    real(wp) :: work = 0.0_wp     !! |sum int p g^- dA| [energy]
    real(wp), allocatable :: depth(:)
    !! (n_points) how deep the faces about a point that presses are in a round obstacle at the end:
    !! the deepest place, or of faces all of whose nodes press the mean [length]
    real(wp), allocatable :: towards(:, :)
    !! (3,n_points) from the obstacle's middle or axis to that place; 0 of a mean [length]
    logical, allocatable :: is_seen(:)
    !! (n_obstacles) nodes have touched the obstacle since it got into the faces that it is in
  end type entries_t

  !> What one obstacle does to faces, until it is judged.
  type :: of_obstacle_t
    type(face_entry_t) :: untouched = face_entry_t()
    !! the deepest at the end where nothing touches nearby
    type(face_entry_t) :: before = face_entry_t() !! the same at the beginning
    type(face_entry_t) :: on_way = face_entry_t() !! the deepest between, the same
    type(face_entry_t) :: swept = face_entry_t()
    !! the same, near what touches too, by one that ends off all
    type(face_entry_t) :: through = face_entry_t()
    !! the same, of an obstacle whose middle goes through the face
    logical  :: creeps = .false.     !! through, by less than its radius in the increment
    real(wp) :: deepest_at_ends = 0.0_wp !! touched or not [length]
    logical  :: presses_before = .false. !! when the increment begins
    logical  :: touches_before = .false., touches = .false.
  end type of_obstacle_t

  real(wp), parameter :: part_of_radius = 0.5_wp !! that an obstacle never comes deep by pressing
  real(wp), parameter :: all_but = 0.01_wp  !! of a depth: a gap beside which it is that of contact

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
  !>
  !> What nodes have seen and let go leaves the faces between them a little later.
  subroutine find_entries(scene, points, faces, tolerance, old, new, last_of_step, entries)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(smooth_faces_t), intent(in) :: faces(:) !! of list_faces
    real(wp), intent(in) :: tolerance            !! of contact [-]
    type(state_t), intent(in) :: old, new        !! the increment's beginning and end
    logical, intent(in) :: last_of_step
    type(entries_t), intent(inout) :: entries
    !! comes with `is_seen` of the increment's beginning (not allocated: nothing is), goes with that
    !! of its end
    type(of_obstacle_t) :: found
    type(obstacle_t) :: at_old, at_new    !! the obstacle as it stands at `old` and `new`
    real(wp) :: bend                      !! of its middle's way from the chord [length]
    type(placement_t) :: before, after    !! of what obstacles can enter, at `old` and `new`
    real(wp), allocatable :: extra(:), pressure(:)    !! (n_nodes) [length], [force/length^2]
    real(wp) :: depth(scene%mesh%n_nodes)             !! of the faces about a node [length]
    real(wp) :: towards(3, scene%mesh%n_nodes)        !! likewise, as of entries_t [length]
    logical, allocatable :: near_before(:), near(:)   !! (n_nodes) of faces with a touching node
    logical, allocatable :: pressed(:)  !! (n_nodes) of faces with a node that pressed before
    type(face_entry_t), allocatable :: dents(:)       !! all faces that the obstacle is in
    real(wp) :: allowed, rounding
    logical :: begins
    integer :: obstacle, pair, i

    if (.not. allocated(entries%is_seen)) allocate (entries%is_seen(size(scene%obstacles)), &
      source=.false.)
    entries = entries_t(is_seen=entries%is_seen, depth=[(0.0_wp, i=1, points%n)], &
      towards=reshape([(0.0_wp, i=1, 3*points%n)], [3, points%n]))
    if (.not. any([(size(faces(pair)%nodes) > 0, pair=1, size(faces))])) return
    rounding = rounding_of_places(scene, new%displacement)
    allowed = 10.0_wp*tolerance*max(maxval(abs(new%displacement)), &
      maxval(abs(old%displacement))) + rounding
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
      found%touches_before = any(near_before) .or. entries%is_seen(obstacle)
      found%touches = any(near)
      call spread_points(scene, points, obstacle, after, new%reaction, extra, pressure)
      allocate (dents(0))
      depth = 0.0_wp
      towards = 0.0_wp
      do pair = 1, size(scene%pairs)
        if (scene%pairs(pair)%master /= obstacle) cycle
        if (is_pair_removed(points, pair)) cycle
        call look_at_pair(pair)
        do i = points%first(pair), points%first(pair + 1) - 1
          if (.not. pressure(points%node(i)) > 0.0_wp) cycle
          entries%depth(i) = depth(points%node(i))
          entries%towards(:, i) = towards(:, points%node(i))
        end do
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
      entries%is_seen(obstacle) = found%touches .or. (found%touches_before .and. &
        found%untouched%depth > 0.0_wp)
      call judge(found, allowed, last_of_step, entries)
    end do
    entries%work = abs(entries%work)

  contains

    !> The faces of one pair.
    subroutine look_at_pair(pair)
      integer, intent(in) :: pair
      type(moving_face_t) :: face
      integer :: f, k
      logical :: is_near, was_near, is_mean
      real(wp) :: gap, least, middle(2), deep

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
          is_mean = all(pressure(nodes) > 0.0_wp)
          deep = -gap
          if (is_mean) deep = mean_depth(faces(pair), f, face, scene%mesh%coordinates(:, nodes))
          do k = 1, size(nodes)
            if (.not. (-gap > rounding .and. deep > depth(nodes(k)))) cycle
            depth(nodes(k)) = deep
            towards(:, nodes(k)) = 0.0_wp
            if (.not. is_mean) towards(:, nodes(k)) = matmul(face%x + face%way, shape_at( &
              middle(1), middle(2)))
          end do
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
  pure type(face_entry_t) function deepest_untouched(dents, near, counts) result(deepest)
    type(face_entry_t), intent(in) :: dents(:)
    logical, intent(in) :: near(:) !! (n_nodes) of faces with a touching node
    logical, intent(in), optional :: counts(:) !! (n) which may be the deepest; left out: all
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
      if (present(counts)) then
        if (.not. counts(i)) cycle
      end if
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

end module faces_between_nodes_mod
