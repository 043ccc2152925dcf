!> What of a master a part of a slave face sees: no other face lies between. docs/theory.md section
!> 11.
module sight_mod
  use kinds_mod, only: wp
  use connectivity_mod, only: corners_in
  use small_matrix_mod, only: cross
  use face_grid_mod, only: face_grid_t, make_face_grid, faces_near
  use face_overlap_mod, only: plane_t, polygon_t, seen_from, outward_normal, keep_positive, &
    area_of, max_corners, smallest
  use surface_reach_mod, only: against
  implicit none
  private

  public :: screen_t, cover_t, make_screen, find_covers, leave_seen, has_way_out, height_of, &
    touching

  !> Faces that may lie between others.
  type :: screen_t
    integer, allocatable :: part(:, :)  !! (4,n) their corners; the fourth is 0 in a triangle
    type(face_grid_t) :: grid
    logical, allocatable :: of_slave(:), of_master(:) !! (n) all corners are its
    integer, allocatable :: piece(:)    !! (n_nodes) the body of each; where not known all alike
    logical :: asks_way_out = .false.   !! what overlaps counts along ways out alone
    real(wp) :: reach(2) = 0.0_wp
    !! before the slave's plane; how deep a place may be in the master [length]
  end type screen_t

  !> A triangle of them over or under a part of a slave face: of four corners one of the four about
  !> their middle. A line is where f(1) + f(2) x + f(3) y
  !> is 0 in the plane of the part; the same gives heights above that plane.
  type :: cover_t
    integer :: of = 0                   !! face of the screen
    integer :: node(4) = 0              !! its corners; the fourth is 0 in a triangle
    real(wp) :: edge(3, 3) = 0.0_wp     !! above 0 inside [length^2, length, length]
    real(wp) :: height(3) = 0.0_wp      !! [length, -, -]
    real(wp) :: low(3) = 0.0_wp, high(3) = 0.0_wp !! of corners, in the plane and above [length]
    logical :: faces = .false.          !! it is turned towards the slave
    logical :: leans = .false.          !! by more than what faces the slave
    integer :: piece = 0                !! the body that it is of
  end type cover_t

  real(wp), parameter :: touching = 1.0e-9_wp !! of the size of a face: nearer is there [-]

contains

  !> The faces that meet the box of a slave and a master.
  pure subroutine make_screen(parts, slave, master, x, screen, piece)
    integer, intent(in) :: parts(:, :)          !! (4,n) the fourth is 0 in a triangle
    integer, intent(in) :: slave(:, :), master(:, :) !! the same
    real(wp), intent(in) :: x(:, :)             !! (3,n_nodes) [length]
    type(screen_t), intent(out) :: screen
    integer, intent(in), optional :: piece(:)   !! (n_nodes) as of screen_t; left out: not known
    logical :: meets(size(parts, 2)), of_slave(size(x, 2)), of_master(size(x, 2))
    real(wp) :: low(3), high(3)
    integer :: i

    of_slave = .false.
    of_slave(pack(slave, slave > 0)) = .true.
    of_master = .false.
    of_master(pack(master, master > 0)) = .true.
    do i = 1, 3
      low(i) = minval(x(i, :), of_slave .or. of_master)
      high(i) = maxval(x(i, :), of_slave .or. of_master)
    end do
    do i = 1, size(parts, 2)
      meets(i) = meets_box(x, parts(:corners_in(parts(:, i)), i), low, high)
    end do
    allocate (screen%part(size(parts, 1), count(meets)))
    screen%part = parts(:, pack([(i, i=1, size(meets))], meets))
    screen%grid = make_face_grid(screen%part, x)
    allocate (screen%piece(size(x, 2)), source=0)
    if (present(piece)) screen%piece = piece
    associate (n => count(meets))
      allocate (screen%of_slave(n), screen%of_master(n))
    end associate
    do i = 1, size(screen%part, 2)
      associate (corner => screen%part(:corners_in(screen%part(:, i)), i))
        screen%of_slave(i) = all(of_slave(corner))
        screen%of_master(i) = all(of_master(corner))
      end associate
    end do
  end subroutine make_screen

  !> Whether the box of some nodes meets another.
  pure logical function meets_box(x, node, low, high)
    real(wp), intent(in) :: x(:, :)           !! (3,n_nodes) [length]
    integer, intent(in) :: node(:)
    real(wp), intent(in) :: low(3), high(3)   !! of the other [length]
    real(wp) :: least, most
    integer :: i, k

    meets_box = .false.
    do i = 1, 3
      least = x(i, node(1))
      most = least
      do k = 2, size(node)
        least = min(least, x(i, node(k)))
        most = max(most, x(i, node(k)))
      end do
      if (least > high(i) .or. most < low(i)) return
    end do
    meets_box = .true.
  end function meets_box

  !> Find what lies over or under a part of a slave face within two heights. What leans too much to
  !> face the slave counts under it alone.
  pure subroutine find_covers(screen, x, plane, own, range, covers)
    type(screen_t), intent(in) :: screen
    real(wp), intent(in) :: x(:, :)       !! (3,n_nodes) [length]
    type(plane_t), intent(in) :: plane    !! of the part
    integer, intent(in) :: own(:)         !! nodes of the whole face: it does not hide itself
    real(wp), intent(in) :: range(2)      !! lowest and highest, one below and one above 0 [length]
    type(cover_t), allocatable, intent(out) :: covers(:)
    integer, allocatable :: near(:)
    real(wp) :: place(3, 5), corner(3, 3), low(3), high(3), along(3), twice(3), beside
    integer :: i, k, n, m

    do k = 1, plane%n
      place(:, k) = plane%origin + matmul(plane%axis(:, :2), plane%corner(:, k))
    end do
    along = plane%axis(:, 3)
    call faces_near(screen%grid, minval(place(:, :plane%n), 2) + min(range(1)*along, range(2)* &
      along), maxval(place(:, :plane%n), 2) + max(range(1)*along, range(2)*along), near)
    ! A strip of this width beside the face is next to nothing of it.
    beside = smallest*sqrt(plane%area)
    low = [minval(plane%corner(:, :plane%n), 2) + beside, range(1)]
    high = [maxval(plane%corner(:, :plane%n), 2) - beside, range(2)]
    allocate (covers(4*size(near)))
    n = 0
    do i = 1, size(near)
      associate (node => screen%part(:, near(i)))
        m = corners_in(node)
        do k = 1, m
          place(:, k) = seen_from(plane, x(:, node(k)))
        end do
        if (is_beside(place(:, :m), low, high)) cycle
        if (count_in(node(:m), own) == m) cycle
        if (m == 4) place(:, 5) = 0.25_wp*(place(:, 1) + place(:, 2) + place(:, 3) + place(:, 4))
        do k = 1, merge(1, 4, m == 3)
          corner(:, 1) = place(:, k)
          corner(:, 2) = place(:, 1 + mod(k, m))
          corner(:, 3) = place(:, merge(3, 5, m == 3))
          if (is_beside(corner, low, high)) cycle
          twice = cross(corner(:, 2) - corner(:, 1), corner(:, 3) - corner(:, 1))
          if (abs(twice(3)) < max(touching*norm2(twice), smallest*plane%area)) cycle
          n = n + 1
          covers(n) = cover_of(near(i), node(:m), corner, twice(3))
          covers(n)%piece = screen%piece(node(1))
          covers(n)%leans = abs(twice(3)) < -against*norm2(twice)
          if (covers(n)%leans .and. .not. covers(n)%low(3) < 0.0_wp) n = n - 1
        end do
      end associate
    end do
    covers = covers(:n)
  end subroutine find_covers

  !> Whether corners are beside a box along one of the first two axes, or above or below it.
  pure logical function is_beside(corner, low, high)
    real(wp), intent(in) :: corner(:, :)      !! (3,n) [length]
    real(wp), intent(in) :: low(3), high(3)   !! of the box [length]
    real(wp) :: least(3), most(3)
    integer :: k

    least = corner(:, 1)
    most = least
    do k = 2, size(corner, 2)
      least = min(least, corner(:, k))
      most = max(most, corner(:, k))
    end do
    is_beside = any(least(:2) >= high(:2) .or. most(:2) <= low(:2)) .or. least(3) > high(3) .or. &
      most(3) < low(3)
  end function is_beside

  pure type(cover_t) function cover_of(face, node, corner, twice) result(cover)
    integer, intent(in) :: face           !! of the screen
    integer, intent(in) :: node(:)        !! its corners
    real(wp), intent(in) :: corner(3, 3)  !! of the triangle, as of seen_from [length]
    real(wp), intent(in) :: twice         !! its area in the plane, below 0 clockwise [length^2]
    integer :: k

    do k = 1, 3
      associate (from => corner(:, k), to => corner(:, 1 + mod(k, 3)))
        cover%edge(:, k) = [from(1)*to(2) - from(2)*to(1), from(2) - to(2), to(1) - from(1)]
      end associate
    end do
    ! Opposite each edge is the third corner.
    cover%height = (cover%edge(:, 1)*corner(3, 3) + cover%edge(:, 2)*corner(3, 1) + &
      cover%edge(:, 3)*corner(3, 2))/twice
    cover%edge = sign(1.0_wp, twice)*cover%edge
    cover%of = face
    cover%node(:size(node)) = node
    cover%faces = twice < 0.0_wp
    cover%low = min(corner(:, 1), corner(:, 2), corner(:, 3))
    cover%high = max(corner(:, 1), corner(:, 2), corner(:, 3))
  end function cover_of

  !> How many nodes are in a list.
  pure integer function count_in(node, list) result(n)
    integer, intent(in) :: node(:), list(:)
    integer :: i, k

    n = 0
    do i = 1, size(node)
      do k = 1, size(list)
        if (node(i) /= list(k)) cycle
        n = n + 1
        exit
      end do
    end do
  end function count_in

  !> Take out of what a part of a slave face shares with a master face what others hide of it.
  !>
  !> Of faces that touch the slave or the master those hide which are turned towards it: what lies
  !> behind them is inside a body. Neighbours of the two faces hide where they are between by more
  !> than these are warped: their edges are not in the planes. Behind the slave a place is hidden
  !> that is not in the master's body, of which it sees a face before the master then, where what is
  !> opposite is not in the slave's body. Of one body either is enough, of faces that do not lean.
  pure subroutine leave_seen(covers, plane, corner, own, pieces, seen)
    type(cover_t), intent(in) :: covers(:)
    type(plane_t), intent(in) :: plane         !! of the part of the slave face
    real(wp), intent(in) :: corner(:, :)       !! (3,3) or (3,4) of the master face [length]
    integer, intent(in) :: own(:)              !! nodes of both whole faces
    integer, intent(in) :: pieces(2)           !! the slave's body and the master's
    type(polygon_t), allocatable, intent(inout) :: seen(:) !! one to begin with
    type(polygon_t), allocatable :: left(:), beyond(:), rest(:), hidden(:)
    real(wp) :: master(3), rounding, warp, least, low(3), high(3), place(3), line(3, 6)
    integer :: i, k
    logical :: hides

    if (size(seen) == 0 .or. size(covers) == 0) return
    master = height_of(plane, corner)
    rounding = touching*sqrt(plane%area)
    least = smallest*plane%area
    ! Most hide nothing: boxes of what is seen, the master's height the third of it, tell of these.
    low = huge(low)
    high = -huge(high)
    do k = 1, seen(1)%n
      place(:2) = seen(1)%corner(:, k)
      place(3) = master(1) + master(2)*place(1) + master(3)*place(2)
      low = min(low, place)
      high = max(high, place)
    end do
    low(:2) = low(:2) + smallest*sqrt(plane%area)
    high(:2) = high(:2) - smallest*sqrt(plane%area)
    warp = max(plane%warp, warp_of(plane, corner, master))
    do i = 1, size(covers)
      if (covers(i)%leans) cycle
      call look_at(covers(i), 1, line, hides)
      if (hides) call take_out(line, least, seen)
    end do
    if (.not. low(3) < -rounding) return
    left = seen
    allocate (beyond(0), hidden(0))
    do i = 1, size(covers)
      if (covers(i)%piece /= pieces(1) .or. (covers(i)%leans .and. pieces(1) == pieces(2))) cycle
      call look_at(covers(i), -1, line, hides)
      if (hides) call take_out(line, least, left, beyond)
    end do
    if (pieces(1) == pieces(2)) then
      call move_alloc(left, seen)
    else if (size(beyond) > 0) then
      ! The master lies beyond the slave's body there, and sees the slave, or not.
      rest = beyond
      do i = 1, size(covers)
        if (covers(i)%piece /= pieces(2)) cycle
        call look_at(covers(i), -1, line, hides)
        if (hides) call take_out(line, least, rest, hidden)
      end do
      if (size(hidden) > 0) seen = [left, rest]
    end if

  contains

    !> Where a face is between the slave and the master, before the slave (1) or behind it (-1).
    pure subroutine look_at(cover, side, line, hides)
      type(cover_t), intent(in) :: cover
      integer, intent(in) :: side
      real(wp), intent(out) :: line(3, 6)  !! above 0 there
      logical, intent(out) :: hides        !! some of it may be
      real(wp) :: nearer(2)
      integer :: n_own

      line = 0.0_wp
      hides = .false.
      if (any(cover%low(:2) >= high(:2) .or. cover%high(:2) <= low(:2))) return
      if (side > 0) then
        if (.not. (high(3) > 0.0_wp .and. cover%high(3) > -rounding .and. cover%low(3) < high(3) + &
          rounding)) return
      else if (.not. (cover%low(3) < -rounding .and. cover%high(3) > low(3) + rounding)) then
        return
      end if
      n_own = count_in(cover%node(:corners_in(cover%node)), own)
      hides = n_own < corners_in(cover%node)
      nearer = -rounding
      if (n_own > 0) then
        ! Behind the slave both bodies hide: no strip at their edges is left to either.
        nearer = -real(side, wp)*rounding - warp
      else if (side > 0) then
        nearer(merge(1, 2, cover%faces)) = rounding
      end if
      line(:, 1) = real(side, wp)*master
      line(:, 2) = real(side, wp)*cover%height
      line(:, 3) = line(:, 1) - line(:, 2)
      line(1, 2:3) = line(1, 2:3) + nearer
      line(:, 4:) = cover%edge
    end subroutine look_at

  end subroutine leave_seen

  !> How far the corners of a face are from its mean plane.
  pure real(wp) function warp_of(plane, corner, height) result(warp)
    type(plane_t), intent(in) :: plane
    real(wp), intent(in) :: corner(:, :) !! (3,3) or (3,4) [length]
    real(wp), intent(in) :: height(3)    !! of the mean plane, as of cover_t
    real(wp) :: place(3)
    integer :: k

    warp = 0.0_wp
    do k = 1, size(corner, 2)
      place = seen_from(plane, corner(:, k))
      warp = max(warp, abs(place(3) - height(1) - height(2)*place(1) - height(3)*place(2)))
    end do
  end function warp_of

  !> Take out of polygons what of them is where all lines are above 0.
  pure subroutine take_out(line, least, polygons, taken)
    real(wp), intent(in) :: line(:, :)         !! (3,n)
    real(wp), intent(in) :: least              !! area that counts [length^2]
    type(polygon_t), allocatable, intent(inout) :: polygons(:)
    type(polygon_t), allocatable, intent(inout), optional :: taken(:) !! gets that
    type(polygon_t), allocatable :: left(:)
    logical :: is_missed(size(polygons))
    integer :: k

    is_missed = [(misses(line, polygons(k), least), k=1, size(polygons))]
    if (all(is_missed)) return
    allocate (left(0))
    do k = 1, size(polygons)
      if (is_missed(k)) then
        left = [left, polygons(k)]
      else
        call cut(line, polygons(k), least, left, taken)
      end if
    end do
    call move_alloc(left, polygons)
  end subroutine take_out

  !> Whether next to nothing of a polygon is where all lines are above 0.
  pure logical function misses(line, polygon, least)
    real(wp), intent(in) :: line(:, :)         !! (3,n)
    type(polygon_t), intent(in) :: polygon
    real(wp), intent(in) :: least              !! area that counts [length^2]
    type(polygon_t) :: rest
    integer :: e

    misses = .true.
    ! Edges first: most faces lie beside what is seen.
    do e = size(line, 2), 1, -1
      if (is_nowhere_above(line(:, e), polygon)) return
    end do
    rest = polygon
    do e = 1, size(line, 2)
      call keep_positive(values(line(:, e), rest), rest)
    end do
    misses = area_of(rest%corner(:, :rest%n)) < least
  end function misses

  !> Append what of a polygon is not where all lines are above 0, as convex pieces, and what is.
  pure recursive subroutine cut(line, polygon, least, pieces, taken)
    real(wp), intent(in) :: line(:, :)         !! (3,n)
    type(polygon_t), intent(in) :: polygon
    real(wp), intent(in) :: least              !! area that counts [length^2]
    type(polygon_t), allocatable, intent(inout) :: pieces(:)
    type(polygon_t), allocatable, intent(inout), optional :: taken(:)
    type(polygon_t) :: rest, outside
    integer :: e, half

    if (polygon%n + size(line, 2) > max_corners) then
      ! Each line may add a corner: in halves there is room for them.
      half = polygon%n/2 + 1
      rest%n = half
      rest%corner(:, :half) = polygon%corner(:, :half)
      call cut(line, rest, least, pieces, taken)
      rest%n = polygon%n - half + 2
      rest%corner(:, :rest%n) = polygon%corner(:, [1, (e, e=half, polygon%n)])
      call cut(line, rest, least, pieces, taken)
      return
    end if
    rest = polygon
    do e = 1, size(line, 2)
      outside = rest
      call keep_positive(-values(line(:, e), rest), outside)
      if (area_of(outside%corner(:, :outside%n)) >= least) pieces = [pieces, outside]
      call keep_positive(values(line(:, e), rest), rest)
    end do
    if (.not. present(taken)) return
    if (area_of(rest%corner(:, :rest%n)) >= least) taken = [taken, rest]
  end subroutine cut

  !> Whether a line is above 0 at no corner of a polygon. Most polygons are left alone by this, so
  !> that it must cost little: `values` is an array that is allocated.
  pure logical function is_nowhere_above(line, polygon)
    real(wp), intent(in) :: line(3)
    type(polygon_t), intent(in) :: polygon
    integer :: k

    is_nowhere_above = .false.
    do k = 1, polygon%n
      if (line(1) + line(2)*polygon%corner(1, k) + line(3)*polygon%corner(2, k) > 0.0_wp) return
    end do
    is_nowhere_above = .true.
  end function is_nowhere_above

  pure function values(line, polygon) result(f)
    real(wp), intent(in) :: line(3)
    type(polygon_t), intent(in) :: polygon
    real(wp) :: f(polygon%n)

    f = line(1) + line(2)*polygon%corner(1, :polygon%n) + line(3)*polygon%corner(2, :polygon%n)
  end function values

  !> The height of a face that is turned towards the slave, as of cover_t; of four corners that of
  !> their mean plane.
  pure function height_of(plane, corner) result(height)
    type(plane_t), intent(in) :: plane
    real(wp), intent(in) :: corner(:, :) !! (3,3) or (3,4) of the face [length]
    real(wp) :: height(3)                !! [length, -, -]
    real(wp) :: normal(3)

    normal = outward_normal(corner)
    height = [dot_product(normal, sum(corner, 2)/real(size(corner, 2), wp) - plane%origin), &
      -matmul(normal, plane%axis(:, :2))]/dot_product(normal, plane%axis(:, 3))
  end function height_of

  !> Whether no face of a surface is much nearer to a place behind it than the way along which it is
  !> to leave it.
  pure logical function has_way_out(screen, x, is_of_surface, place, depth)
    type(screen_t), intent(in) :: screen
    real(wp), intent(in) :: x(:, :)           !! (3,n_nodes) [length]
    logical, intent(in) :: is_of_surface(:)   !! of the screen's faces
    real(wp), intent(in) :: place(3)          !! [length]
    real(wp), intent(in) :: depth             !! [length]
    real(wp), parameter :: much = 0.5_wp      !! of the way [-]
    integer, allocatable :: near(:)
    integer :: i, k

    has_way_out = .false.
    call faces_near(screen%grid, place - much*depth, place + much*depth, near)
    do i = 1, size(near)
      associate (corner => screen%part(:corners_in(screen%part(:, near(i))), near(i)))
        if (.not. is_of_surface(near(i))) cycle
        do k = 2, size(corner) - 1
          if (distance_to(place, x(:, corner([1, k, k + 1]))) < much*depth) return
        end do
      end associate
    end do
    has_way_out = .true.
  end function has_way_out

  !> How far a place is from a triangle.
  pure real(wp) function distance_to(place, corner) result(distance)
    real(wp), intent(in) :: place(3), corner(3, 3) !! [length]
    real(wp) :: normal(3), edge(3), arm(3)
    integer :: k

    normal = outward_normal(corner)
    distance = abs(dot_product(normal, place - corner(:, 1)))
    do k = 1, 3
      edge = corner(:, 1 + mod(k, 3)) - corner(:, k)
      arm = place - corner(:, k)
      if (dot_product(cross(edge, arm), normal) < 0.0_wp) exit
    end do
    if (k > 3) return
    distance = huge(distance)
    do k = 1, 3
      edge = corner(:, 1 + mod(k, 3)) - corner(:, k)
      arm = place - corner(:, k)
      distance = min(distance, norm2(arm - edge*max(0.0_wp, min(1.0_wp, dot_product(edge, arm)/ &
        max(dot_product(edge, edge), tiny(1.0_wp))))))
    end do
  end function distance_to

end module sight_mod
