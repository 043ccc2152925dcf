!> The parts of a master that a slave face sees: faces with nodes in the middles of their edges are
!> cut into parts between all of their nodes.
module covering_parts_mod
  use kinds_mod, only: wp
  use cells_mod, only: face_corners, face_nodes
  use connectivity_mod, only: corners_in
  use surfaces_mod, only: cut_at_middles
  use face_grid_mod, only: face_grid_t, make_face_grid, faces_near
  use face_overlap_mod, only: overlap_t, plane_t, polygon_t, plane_of_face, in_plane, &
    seen_from, outward_normal, find_common, find_overlap, area_of, opposite_weights, weigh
  use curved_overlap_mod, only: whole_face_t, whole_face, find_curved_overlap
  use surface_reach_mod, only: largest_face, against, share_of_sight
  use sight_mod, only: screen_t, cover_t, find_covers, leave_seen, has_way_out, height_of, &
    touching
  use mortar_rows_mod, only: opposite_t, slave_t
  use slave_face_mod, only: face_t
  implicit none
  private

  public :: master_t, part_t, cut_master, find_parts, cover_again, look_opposite

  !> What a part of a slave face and one of the master see of each other.
  type :: part_t
    integer :: node(face_nodes) = 0 !! of the master face
    integer :: n = 0              !! how many there are
    integer :: of = 0             !! which part of the master it is
    integer :: corner(face_corners) = 0 !! of that part, 0 behind them
    integer :: slave_corner(face_corners) = 0 !! of the part of the slave face, 0 behind them
    type(plane_t) :: plane        !! of the part of the slave face
    real(wp) :: cosine = -1.0_wp  !! of the normals of both parts [-]
    type(polygon_t), allocatable :: seen(:) !! in it
    logical :: is_cut = .false.   !! whether other faces hide some of it
    type(overlap_t) :: overlap
  end type part_t

  !> A master, its faces cut into parts.
  type :: master_t
    integer, allocatable :: face(:, :)             !! (4,n_master) or (8,n_master) all nodes
    type(face_grid_t) :: grid                      !! of the parts
    integer, allocatable :: part(:, :)             !! (4,n) as of nodes_of_face
    integer, allocatable :: whole(:)               !! (n) the face of each
    real(wp) :: largest = 0.0_wp                   !! part [length]
  end type master_t

contains

  !> A master in parts, where its nodes are at `x`.
  pure type(master_t) function cut_master(faces, x) result(master)
    integer, intent(in) :: faces(:, :) !! as of `face`
    real(wp), intent(in) :: x(:, :)    !! (3,n_nodes) [length]

    allocate (master%face, source=faces)
    call cut_at_middles(faces, master%part, master%whole)
    master%grid = make_face_grid(master%part, x)
    master%largest = largest_face(master%part, x)
  end function cut_master

  !> The parts of the master that a part of a slave face sees, and the integrals over that.
  pure subroutine find_parts(master, x, face, plane, screen, slave, parts, trapped)
    type(master_t), intent(in) :: master
    real(wp), intent(in) :: x(:, :)       !! (3,n_nodes) [length]
    type(face_t), intent(in) :: face      !! the whole of it, and which part
    type(plane_t), intent(in) :: plane    !! of the part
    type(screen_t), intent(in) :: screen
    type(slave_t), intent(in) :: slave    !! how it has moved
    type(part_t), allocatable, intent(out) :: parts(:)
    real(wp), intent(inout) :: trapped    !! as of mortar_t [length]
    integer, allocatable :: near(:)
    type(cover_t), allocatable :: covers(:)
    type(polygon_t), allocatable :: common(:)
    real(wp) :: low(3), high(3), corner(3, face_corners), place(3, face_corners), range(2)
    real(wp) :: rounding
    real(wp), allocatable :: cosine(:)
    integer :: i, j, k, n

    ! What the face may see lies in the prism over it.
    rounding = touching*sqrt(plane%area)
    associate (along => (max(screen%reach(1), screen%reach(2)/(-against)) + master%largest)* &
               abs(plane%axis(:, 3)) + 1.0e-6_wp*sqrt(plane%area))
      low = minval(face%x(:, :face%n), 2) - along
      high = maxval(face%x(:, :face%n), 2) + along
    end associate
    call faces_near(master%grid, low, high, near)
    allocate (common(size(near)), cosine(size(near)))
    n = 0
    range = 0.0_wp
    do i = 1, size(near)
      k = corners_in(master%part(:, near(i)))
      corner(:, :k) = x(:, master%part(:k, near(i)))
      cosine(n + 1) = dot_product(outward_normal(corner(:, :k)), plane%axis(:, 3))
      if (cosine(n + 1) > against) cycle
      do j = 1, k
        place(:, j) = seen_from(plane, corner(:, j))
      end do
      associate (height => place(3, :k), flat => place(:2, :k))
        if (minval(height) > screen%reach(1) .or. maxval(height)*cosine(n + 1) > &
          screen%reach(2)) cycle
        associate (mine => face%part(:corners_in(face%part)), other => master%part(:k, near(i)))
          if (maxval(height) < -rounding .and. screen%piece(mine(1)) > 0 .and. &
            screen%piece(mine(1)) == screen%piece(other(1))) then
            if (is_own_back(slave, mine, other, sum(height)/real(k, wp))) cycle
          end if
        end associate
        common(n + 1) = find_common(plane, flat)
        if (common(n + 1)%n == 0) cycle
        n = n + 1
        near(n) = near(i)
        range = [min(range(1), minval(height)), max(range(2), maxval(height))]
      end associate
    end do
    if (range(1) < -rounding .or. range(2) > rounding) call find_covers(screen, x, plane, &
      face%node(:face%n), range, covers)
    allocate (parts(n))
    n = 0
    do i = 1, size(parts)
      associate (part => parts(n + 1))
        part%of = near(i)
        part%corner = master%part(:, near(i))
        associate (of => master%face(:, master%whole(near(i))))
          part%n = count(of > 0)
          part%node(:size(of)) = of
        end associate
        part%plane = plane
        part%cosine = cosine(i)
        part%seen = common(i:i)
        if (allocated(covers)) then
          call leave_seen(covers, plane, x(:, part%corner(:corners_in(part%corner))), &
            [face%node(:face%n), part%node(:part%n)], screen%piece([face%node(1), part%node(1)]), &
            part%seen)
          if (screen%asks_way_out) call leave_ways_out(x, screen, rounding, part, trapped)
          part%is_cut = seen_area(part%seen) < (1.0_wp - touching)*seen_area(common(i:i))
        end if
        if (size(part%seen) > 0) n = n + 1
      end associate
    end do
    if (n < size(parts)) parts = parts(:n)
    call add_integrals(x, face, parts, slave%moved)
  end subroutine find_parts

  !> Whether a face behind another one of its body is its back, the other side of a wall: it was
  !> right behind it in the mesh, where no body is in itself, and has come no nearer than half of
  !> that.
  pure logical function is_own_back(slave, mine, other, height) result(is)
    type(slave_t), intent(in) :: slave
    integer, intent(in) :: mine(:), other(:) !! corners
    real(wp), intent(in) :: height           !! of the other face now, below 0 [length]
    real(wp) :: at_rest, aside               !! in the mesh [length]
    real(wp) :: centre(3), way(3), normal(3)
    integer :: k

    is = .false.
    if (.not. allocated(slave%mesh)) return
    associate (x => slave%mesh)
      centre = sum(x(:, mine), 2)/size(mine)
      way = sum(x(:, other), 2)/size(other) - centre
      normal = outward_normal(x(:, mine))
      at_rest = dot_product(normal, way)
      ! As far as both faces reach, and a wall may be sheared.
      aside = norm2(way - at_rest*normal) + at_rest - maxval([(norm2(x(:, mine(k)) - centre), k=1, &
        size(mine))]) - maxval([(norm2(x(:, other(k)) - centre - way), k=1, size(other))])
    end associate
    is = at_rest < -slave%overlap .and. aside <= 0.0_wp .and. height < 0.5_wp*at_rest
  end function is_own_back

  !> The area of what is seen.
  pure real(wp) function seen_area(seen) result(area)
    type(polygon_t), intent(in) :: seen(:)
    integer :: k

    area = 0.0_wp
    do k = 1, size(seen)
      area = area + area_of(seen(k)%corner(:, :seen(k)%n))
    end do
  end function seen_area

  !> Of what is seen behind the slave's plane keep that along which places can leave the other body.
  pure subroutine leave_ways_out(x, screen, rounding, part, trapped)
    real(wp), intent(in) :: x(:, :)       !! (3,n_nodes) [length]
    type(screen_t), intent(in) :: screen
    real(wp), intent(in) :: rounding      !! [length]
    type(part_t), intent(inout) :: part
    real(wp), intent(inout) :: trapped    !! as of mortar_t [length]
    ! Heights that are compared with a rounding leave strips along edges, of slopes above 1e-3
    ! narrower than this of a face: there nothing is seen.
    real(wp), parameter :: sliver = 1.0e-6_wp !! [-]
    real(wp) :: middle(2), place(3), plane_height(3), height, depth
    logical :: is_kept(size(part%seen))
    integer :: k

    associate (corner => x(:, part%corner(:corners_in(part%corner))), axis => part%plane%axis)
      plane_height = height_of(part%plane, corner)
      is_kept = .true.
      do k = 1, size(part%seen)
        associate (polygon => part%seen(k)%corner(:, :part%seen(k)%n))
          middle = sum(polygon, 2)/real(part%seen(k)%n, wp)
          height = plane_height(1) + dot_product(plane_height(2:), middle)
          if (height > -rounding) cycle
          is_kept(k) = area_of(polygon) > sliver*sqrt(part%plane%area)*norm2(maxval(polygon, 2) - &
            minval(polygon, 2))
        end associate
        if (.not. is_kept(k)) cycle
        place = part%plane%origin + matmul(axis(:, :2), middle)
        depth = height*dot_product(outward_normal(corner), axis(:, 3))
        is_kept(k) = has_way_out(screen, x, screen%of_master, place, depth) .and. &
          has_way_out(screen, x, screen%of_slave, place + height*axis(:, 3), depth)
        if (.not. is_kept(k)) trapped = min(trapped, depth)
      end do
    end associate
    if (.not. all(is_kept)) part%seen = pack(part%seen, is_kept)
  end subroutine leave_ways_out

  !> The integrals over what a part of a slave face and parts of the master see of each other.
  pure subroutine add_integrals(x, face, parts, u)
    real(wp), intent(in) :: x(:, :)       !! (3,n_nodes) [length]
    type(face_t), intent(in) :: face      !! the whole of it
    type(part_t), intent(inout) :: parts(:)
    real(wp), intent(in), optional :: u(:, :) !! (3,n_nodes) as of slave_t [length]
    type(whole_face_t) :: slave
    real(wp), dimension(3, face_nodes) :: by_slave, by_master !! [length]
    integer :: i, k

    by_slave = 0.0_wp
    by_master = 0.0_wp
    if (present(u)) by_slave(:, :face%n) = u(:, face%node(:face%n))
    if (face%n > face_corners) slave = whole_face(face%x(:, :face%n), by_slave(:, :face%n))
    do i = 1, size(parts)
      associate (part => parts(i))
        k = corners_in(part%corner)
        if (max(face%n, part%n) <= face_corners) then
          if (present(u)) by_master(:, :k) = u(:, part%corner(:k))
          part%overlap = find_overlap(part%plane, face%x(:, :face%n) + by_slave(:, :face%n), &
            x(:, part%corner(:k)), part%seen, by_master(:, :k))
        else
          if (slave%n == 0) slave = whole_face(face%x(:, :face%n), by_slave(:, :face%n))
          if (present(u)) by_master(:, :part%n) = u(:, part%node(:part%n))
          part%overlap = find_curved_overlap(part%plane, slave, whole_face(x(:, &
            part%node(:part%n)), by_master(:, :part%n)), part%seen)
        end if
        call weigh(share_of_sight(part%cosine), part%overlap)
      end associate
    end do
  end subroutine add_integrals

  !> What a part covers of a slave face where nodes have moved a little since it was found: what
  !> there is of it is not looked for again, and what other faces cut out of it is held. What of an
  !> integral a rule leaves does not leap, for differences.
  pure subroutine cover_again(x, face, part)
    real(wp), intent(in) :: x(:, :)       !! (3,n_nodes) [length]
    type(face_t), intent(in) :: face      !! where it is now
    type(part_t), intent(inout) :: part   !! gets plane and overlap

    if (part%is_cut) return
    associate (mine => part%slave_corner(:corners_in(part%slave_corner)), &
               corner => part%corner(:corners_in(part%corner)), of => part%node(:part%n))
      part%plane = plane_of_face(x(:, mine))
      part%cosine = dot_product(outward_normal(x(:, corner)), part%plane%axis(:, 3))
      part%seen = [find_common(part%plane, in_plane(part%plane, x(:, corner)))]
      if (max(face%n, part%n) <= face_corners) then
        part%overlap = find_overlap(part%plane, face%x(:, :face%n), x(:, corner), part%seen, &
          roughly=.true.)
      else
        part%overlap = find_curved_overlap(part%plane, whole_face(face%x(:, :face%n)), &
          whole_face(x(:, of)), part%seen, roughly=.true.)
      end if
      call weigh(share_of_sight(part%cosine), part%overlap)
    end associate
  end subroutine cover_again

  !> Find the places of the master opposite the nodes of a slave face that ask for it: among the
  !> corners of the master's parts.
  pure subroutine look_opposite(asks, plane, x, master, parts, row, opposite)
    logical, intent(in) :: asks(:)
    type(plane_t), intent(in) :: plane    !! of the slave face
    real(wp), intent(in) :: x(:, :)       !! (3,n_nodes) [length]
    type(master_t), intent(in) :: master
    type(part_t), intent(in) :: parts(:)
    integer, intent(in) :: row(:)         !! of the face's nodes
    type(opposite_t), intent(inout) :: opposite(:)
    real(wp) :: weight(face_corners)
    integer :: a, i, k

    do i = 1, size(parts)
      k = corners_in(master%part(:, parts(i)%of))
      do a = 1, size(row)
        if (.not. asks(a)) cycle
        associate (found => opposite(row(a)), node => master%part(:k, parts(i)%of))
          weight = opposite_weights(plane, a, x(:, node))
          if (-minval(weight) >= found%beyond) cycle
          found%n = k
          found%node(:found%n) = node
          found%beyond = -minval(weight)
          found%weight = max(0.0_wp, weight)/sum(max(0.0_wp, weight))
        end associate
      end do
    end do
  end subroutine look_opposite

end module covering_parts_mod
