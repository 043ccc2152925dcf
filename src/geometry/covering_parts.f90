!> The parts of a master that a slave face sees: faces with nodes in the middles of their edges are
!> cut into parts between all of their nodes.
module covering_parts_mod
  use kinds_mod, only: wp
  use cells_mod, only: face_corners, face_nodes
  use connectivity_mod, only: corners_in
  use surfaces_mod, only: cut_at_middles
  use face_grid_mod, only: face_grid_t, make_face_grid, faces_near
  use face_overlap_mod, only: overlap_t, plane_t, polygon_t, plane_of_face, in_plane, &
    outward_normal, find_common, find_overlap, area_of, opposite_weights
  use curved_overlap_mod, only: whole_face_t, whole_face, find_curved_overlap
  use surface_reach_mod, only: largest_face, against
  use sight_mod, only: screen_t, cover_t, find_covers, leave_seen, has_way_out, height_of, &
    touching
  use mortar_rows_mod, only: opposite_t
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

    master%face = faces
    call cut_at_middles(faces, master%part, master%whole)
    master%grid = make_face_grid(master%part, x)
    master%largest = largest_face(master%part, x)
  end function cut_master

  !> The parts of the master that a part of a slave face sees, and the integrals over that.
  pure subroutine find_parts(master, x, face, plane, screen, parts, trapped, u)
    type(master_t), intent(in) :: master
    real(wp), intent(in) :: x(:, :)       !! (3,n_nodes) [length]
    type(face_t), intent(in) :: face      !! the whole of it
    type(plane_t), intent(in) :: plane    !! of the part
    type(screen_t), intent(in) :: screen
    type(part_t), allocatable, intent(out) :: parts(:)
    real(wp), intent(inout) :: trapped    !! as of mortar_t [length]
    real(wp), intent(in), optional :: u(:, :) !! (3,n_nodes) as of slave_t [length]
    real(wp), allocatable :: whole(:) !! [length^2]
    integer, allocatable :: near(:)
    type(cover_t), allocatable :: covers(:)
    type(polygon_t) :: common
    real(wp) :: low(3), high(3), height(face_corners), range(2), cosine, rounding
    integer :: i, k, n

    ! What the face may see lies in the prism over it.
    rounding = touching*sqrt(plane%area)
    associate (along => (maxval(screen%reach)/(-against) + master%largest)*abs(plane%axis(:, 3)) + &
               1.0e-6_wp*sqrt(plane%area))
      low = minval(face%x(:, :face%n), 2) - along
      high = maxval(face%x(:, :face%n), 2) + along
    end associate
    call faces_near(master%grid, low, high, near)
    allocate (parts(size(near)))
    n = 0
    range = 0.0_wp
    do i = 1, size(near)
      k = corners_in(master%part(:, near(i)))
      associate (corner => x(:, master%part(:k, near(i))))
        cosine = dot_product(outward_normal(corner), plane%axis(:, 3))
        if (cosine > against) cycle
        height(:k) = matmul(plane%axis(:, 3), corner) - dot_product(plane%axis(:, 3), plane%origin)
        if (minval(height(:k)) > screen%reach(1) .or. maxval(height(:k))*cosine > &
          screen%reach(2)) cycle
        common = find_common(plane, in_plane(plane, corner))
      end associate
      if (common%n == 0) cycle
      n = n + 1
      range = [min(range(1), minval(height(:k))), max(range(2), maxval(height(:k)))]
      parts(n)%of = near(i)
      parts(n)%corner = master%part(:, near(i))
      associate (of => master%face(:, master%whole(near(i))))
        parts(n)%n = count(of > 0)
        parts(n)%node(:size(of)) = of
      end associate
      parts(n)%plane = plane
      parts(n)%seen = [common]
    end do
    parts = parts(:n)
    whole = seen_areas(parts)
    if (range(1) < -rounding .or. range(2) > rounding) then
      call find_covers(screen, x, plane, range, covers)
      do i = 1, n
        associate (part => parts(i))
          call leave_seen(covers, plane, x(:, part%corner(:corners_in(part%corner))), &
            [face%node(:face%n), part%node(:part%n)], part%seen)
        end associate
      end do
      if (screen%asks_way_out) call leave_ways_out(x, screen, rounding, parts, trapped)
    end if
    parts%is_cut = seen_areas(parts) < (1.0_wp - touching)*whole
    parts = pack(parts, [(size(parts(i)%seen) > 0, i=1, n)])
    call add_integrals(x, face, parts, u)
  end subroutine find_parts

  !> The area of what is seen of each part.
  pure function seen_areas(parts) result(area)
    type(part_t), intent(in) :: parts(:)
    real(wp) :: area(size(parts)) !! [length^2]
    integer :: i, k

    area = 0.0_wp
    do i = 1, size(parts)
      do k = 1, size(parts(i)%seen)
        associate (polygon => parts(i)%seen(k))
          area(i) = area(i) + area_of(polygon%corner(:, :polygon%n))
        end associate
      end do
    end do
  end function seen_areas

  !> Of what is seen behind the slave's plane keep that along which places can leave the other body.
  pure subroutine leave_ways_out(x, screen, rounding, parts, trapped)
    real(wp), intent(in) :: x(:, :)       !! (3,n_nodes) [length]
    type(screen_t), intent(in) :: screen
    real(wp), intent(in) :: rounding      !! [length]
    type(part_t), intent(inout) :: parts(:)
    real(wp), intent(inout) :: trapped    !! as of mortar_t [length]
    ! Heights that are compared with a rounding leave strips along edges, of slopes above 1e-3
    ! narrower than this of a face: there nothing is seen.
    real(wp), parameter :: sliver = 1.0e-6_wp !! [-]
    real(wp) :: middle(2), place(3), plane_height(3), height, depth
    logical, allocatable :: is_kept(:)
    integer :: i, k

    do i = 1, size(parts)
      associate (part => parts(i), axis => parts(i)%plane%axis)
        associate (corner => x(:, part%corner(:corners_in(part%corner))))
          plane_height = height_of(part%plane, corner)
          is_kept = [(.true., k=1, size(part%seen))]
          do k = 1, size(part%seen)
            associate (polygon => part%seen(k)%corner(:, :part%seen(k)%n))
              middle = sum(polygon, 2)/real(part%seen(k)%n, wp)
              height = plane_height(1) + dot_product(plane_height(2:), middle)
              if (height > -rounding) cycle
              is_kept(k) = area_of(polygon) > sliver*sqrt(part%plane%area)*norm2(maxval(polygon, &
                2) - minval(polygon, 2))
            end associate
            if (.not. is_kept(k)) cycle
            place = part%plane%origin + matmul(axis(:, :2), middle)
            depth = height*dot_product(outward_normal(corner), axis(:, 3))
            is_kept(k) = has_way_out(screen, x, screen%of_master, place, depth) .and. &
              has_way_out(screen, x, screen%of_slave, place + height*axis(:, 3), depth)
            if (.not. is_kept(k)) trapped = min(trapped, depth)
          end do
        end associate
        part%seen = pack(part%seen, is_kept)
      end associate
    end do
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
      end associate
    end do
  end subroutine add_integrals

  !> What a part covers of a slave face where nodes have moved a little since it was found: what
  !> there is of it is not looked for again, and what other faces cut out of it is held.
  pure subroutine cover_again(x, face, part)
    real(wp), intent(in) :: x(:, :)       !! (3,n_nodes) [length]
    type(face_t), intent(in) :: face      !! where it is now
    type(part_t), intent(inout) :: part   !! gets plane and overlap

    if (part%is_cut) return
    associate (mine => part%slave_corner(:corners_in(part%slave_corner)), &
               corner => part%corner(:corners_in(part%corner)), of => part%node(:part%n))
      part%plane = plane_of_face(x(:, mine))
      part%seen = [find_common(part%plane, in_plane(part%plane, x(:, corner)))]
      if (max(face%n, part%n) <= face_corners) then
        part%overlap = find_overlap(part%plane, face%x(:, :face%n), x(:, corner), part%seen)
      else
        part%overlap = find_curved_overlap(part%plane, whole_face(face%x(:, :face%n)), &
          whole_face(x(:, of)), part%seen)
      end if
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
