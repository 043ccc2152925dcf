!> Slave nodes that lie inside their obstacle before anything has moved.
module initial_overlaps_mod
  use kinds_mod, only: wp, i8
  use cells_mod, only: face_nodes
  use connectivity_mod, only: all_nodes_of_face, nodes_of_hexahedron
  use text_mod, only: counted, string_t, to_text
  use mesh_mod, only: mesh_t, deck_rounding
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t, is_pair_removed
  use increment_report_mod, only: contact_fields_t, status_open
  use surfaces_mod, only: surface_t
  use faces_mod, only: face_area_vectors
  use interference_mod, only: has_interference, set_extra_gap
  use placement_mod, only: placement_t, place_undeformed
  implicit none
  private

  public :: overlaps, begin_interference, find_deep_overlap

  real(wp), parameter :: rounding = 1.0e-12_wp !! of the size of the coordinates: no overlap

contains

  !> A line a pair whose nodes overlap: how many, how far and where.
  pure function overlaps(scene, points) result(lines)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(string_t), allocatable :: lines(:)
    type(string_t) :: line
    type(placement_t) :: placement
    type(contact_points_t) :: nodes
    character(:), allocatable :: remedy
    real(wp) :: depth(points%n), deepest, least
    integer :: pair, i, n, node

    allocate (lines(0))
    remedy = ''
    nodes = points
    if (allocated(nodes%is_held)) nodes%is_held = .true. ! each by itself
    call place_undeformed(scene, nodes, placement)
    depth = -placement%gap
    if (allocated(points%overlap)) depth = points%overlap
    least = max(rounding*maxval(abs(scene%mesh%coordinates)), 16.0_wp*deck_rounding( &
      scene%mesh%coordinates, scene%mesh%origin))
    do pair = 1, size(scene%pairs)
      if (is_pair_removed(points, pair)) cycle
      n = 0
      node = 0
      deepest = least
      do i = points%first(pair), points%first(pair + 1) - 1
        if (depth(i) <= least) cycle
        n = n + 1
        if (depth(i) <= deepest) cycle
        deepest = depth(i)
        node = points%node(i)
      end do
      if (n == 0) cycle
      remedy = 'the first increment presses them out'
      ! General contact has removed what it could.
      if (.not. scene%pairs(pair)%is_general) remedy = remedy//'; ADJUST=0 of *CONTACT PAIR '// &
        'removes them without strain'
      if (is_asked_for(pair)) remedy = 'the deck asks for it, and the first increment presses '// &
        'them out'
      if (allocated(points%overlap)) then
        associate (here => [(i, i=points%first(pair), points%first(pair + 1) - 1)])
          if (any(points%extra_gap(here) > points%constant_gap(here))) remedy = 'at first '// &
            '*CONTACT INTERFERENCE allows '//to_text(maxval(points%extra_gap(here) - &
            points%constant_gap(here)), 4)//' of it'
        end associate
      end if
      line%text = counted(n, 'node')//' of '//scene%pairs(pair)%name// &
        trim(merge(' overlaps', ' overlap ', n == 1))//' before the first step, by up to '// &
        to_text(deepest, 4)//' at node '//to_text(scene%mesh%node_id(node))//'; '//remedy
      lines = [lines, line]
    end do

  contains

    !> Whether *CLEARANCE, or gaps of *CONTACT GAP beside a mesh without overlap, make it: ADJUST
    !> does not change these.
    pure logical function is_asked_for(pair)
      integer, intent(in) :: pair

      associate (of => scene%pairs(pair), first => points%first(pair), &
                 last => points%first(pair + 1) - 1)
        is_asked_for = of%has_clearance .and. of%clearance < 0.0_wp
        if (.not. is_asked_for) is_asked_for = .not. any(depth(first:last) + &
          points%extra_gap(first:last) > least)
      end associate
    end function is_asked_for

  end function overlaps

  !> Where *CONTACT INTERFERENCE changes extra gaps: keep what does not change of them and the
  !> overlaps of the mesh, and set them as the run begins.
  pure subroutine begin_interference(scene, points)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(inout) :: points !! with its constant extra gaps
    type(placement_t) :: placement

    if (.not. has_interference(scene)) return
    call place_undeformed(scene, points, placement)
    points%constant_gap = points%extra_gap
    points%overlap = max(0.0_wp, -placement%gap)
    call set_extra_gap(scene, 1, 0_i8, points)
  end subroutine begin_interference

  !> The closed point that began deepest in its master for the thickness of the elements there, if
  !> it was deeper than the thickest element behind its own faces and those of the master's nodes,
  !> as the deck has them: finer meshes change nothing.
  pure subroutine find_deep_overlap(scene, points, contact, gap, relative_size, point, element)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(in) :: contact !! of the first increment
    real(wp), intent(in) :: gap(:)                !! (n_points) of the undeformed mesh [length]
    real(wp), intent(in) :: relative_size         !! of the elements at contact over the deck's [-]
    integer, intent(out) :: point                 !! 0: there is none
    integer, intent(out) :: element               !! behind its face
    real(wp) :: thickness(scene%mesh%n_nodes)     !! of elements behind faces, 0 elsewhere [length]
    integer :: behind(scene%mesh%n_nodes)         !! these elements, 0 elsewhere
    real(wp) :: allowed, deepest
    integer :: pair, i

    point = 0
    element = 0
    if (points%n == 0) return
    if (.not. any(gap < 0.0_wp .and. contact%status /= status_open)) return
    deepest = 1.0_wp
    do pair = 1, size(scene%pairs)
      thickness = 0.0_wp
      behind = 0
      associate (of => scene%pairs(pair))
        call add_thickness(scene%mesh, scene%surfaces(of%surface), thickness, behind)
        if (of%master_surface > 0) call add_thickness(scene%mesh, &
          scene%surfaces(of%master_surface), thickness, behind)
      end associate
      do i = points%first(pair), points%first(pair + 1) - 1
        if (contact%status(i) == status_open .or. behind(points%node(i)) == 0) cycle
        allowed = thickness(points%node(i))
        if (scene%pairs(pair)%master_surface > 0) then
          associate (weights => contact%weights)
            allowed = max(allowed, maxval(thickness(weights%node(weights%first(i): &
              weights%first(i + 1) - 1))))
          end associate
        end if
        allowed = allowed/relative_size
        if (-gap(i) <= deepest*allowed) cycle
        deepest = -gap(i)/allowed
        point = i
        element = behind(points%node(i))
      end do
    end do
  end subroutine find_deep_overlap

  !> Note of each node of a surface the thickest element behind a face there: as thick as its
  !> farthest corner is high above the face.
  pure subroutine add_thickness(mesh, surface, thickness, behind)
    type(mesh_t), intent(in) :: mesh
    type(surface_t), intent(in) :: surface
    real(wp), intent(inout) :: thickness(:) !! (n_nodes) [length]
    integer, intent(inout) :: behind(:)     !! (n_nodes) the element
    real(wp) :: height, normal(3)
    integer :: f, k, e, nodes(face_nodes)

    do f = 1, size(surface%faces, 2)
      e = surface%faces(1, f)
      nodes = all_nodes_of_face(mesh%connectivity, e, surface%faces(2, f))
      associate (x => mesh%coordinates(:, nodes_of_hexahedron(mesh%connectivity, e)), &
        of_face => mesh%coordinates(:, nodes(:count(nodes > 0))))
        normal = sum(face_area_vectors(of_face), dim=2)
        height = maxval(abs(matmul(normal, x - spread(of_face(:, 1), 2, size(x, 2)))))/norm2(normal)
      end associate
      do k = 1, count(nodes > 0)
        if (height <= thickness(nodes(k))) cycle
        thickness(nodes(k)) = height
        behind(nodes(k)) = e
      end do
    end do
  end subroutine add_thickness

end module initial_overlaps_mod
