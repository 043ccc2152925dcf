!> Surfaces that touch themselves: the two sides that their faces take. docs/theory.md section 11.
module self_contact_mod
  use cells_mod, only: face_corners
  use connectivity_mod, only: corners_in
  use face_grid_mod, only: face_grid_t, faces_near, make_face_grid
  use face_overlap_mod, only: outward_normal
  use kinds_mod, only: wp
  use lists_mod, only: columns_with, lists_by_key, lists_t
  use small_matrix_mod, only: cross
  use sorting_mod, only: order_of
  use surface_reach_mod, only: against, largest_face
  implicit none
  private

  public :: divide_surface, look_along_normals

  real(wp), parameter :: flat = 0.5_wp !! cosine between faces that continue each other, at least

contains

  !> Give each face of a surface a side, 1 or 2, so that faces that see each other have two.
  !>
  !> From the middle of a face, and from near its corners, rays along its normal meet the first face
  !> that is turned towards it and shares no node with it. From the nearest two on, faces get the
  !> other side than what they see, and that of their own back: a wall between two gaps would be
  !> taken for an overlap of its sides. What begins anew gets the side of a face beside it that has
  !> one. Faces that see nothing get the side of neighbours that they continue; around an edge they
  !> get none, and touch nothing.
  !>
  !> Sides that were found before stay as they are where no two faces of one side see each other.
  !> Else those of faces that touch stay, with what these see, and all others are found anew.
  subroutine divide_surface(corner, x, side, kind, may_touch, touches)
    integer, intent(in) :: corner(:, :)           !! (4,n) the fourth is 0 in a triangle
    real(wp), intent(in) :: x(:, :)               !! (3,n_nodes) [length]
    integer, allocatable, intent(inout) :: side(:)
    !! (n) 0: no face sees another; not allocated before: none is known yet
    integer, intent(in), optional :: kind(:)      !! (n) of each face; left out: all are alike
    logical, intent(in), optional :: may_touch(:, :) !! (n_kinds,n_kinds) whether kinds touch
    logical, intent(in), optional :: touches(:)   !! (n_nodes) left out: none does
    integer :: f, k
    real(wp) :: normal(3, size(corner, 2))
    integer, allocatable :: seen(:, :), order(:)  !! (2,n_seen) faces that see each other
    integer :: back(size(corner, 2))              !! what is behind each through the body; 0: none
    real(wp) :: thickness(size(corner, 2))        !! how far [length]
    integer, allocatable :: thinnest(:)           !! faces in its order
    real(wp), allocatable :: distance(:)          !! (n_seen) [length]
    logical, allocatable :: counts(:)

    do f = 1, size(corner, 2)
      normal(:, f) = outward_normal(x(:, corner(:corners_in(corner(:, f)), f)))
    end do
    call look_along_normals(x, corner, normal, seen, distance, back, thickness)
    if (present(kind) .and. present(may_touch)) then
      counts = [(may_touch(kind(seen(1, k)), kind(seen(2, k))), k=1, size(distance))]
      seen = seen(:, pack([(k, k=1, size(counts))], counts))
      distance = pack(distance, counts)
    end if
    if (allocated(side)) then
      if (are_two(side, seen)) return
      call keep_touching(corner, seen, touches, side)
    else
      allocate (side(size(corner, 2)), source=0)
    end if
    if (size(distance) == 0) return
    ! Alike but for a millionth are in the order of the faces.
    call order_of(nint(distance*(1.0e6_wp/max(maxval(distance), 1.0e-300_wp))), order)
    thickness = min(thickness, largest_face(corner, x)*size(side))
    call order_of(nint(thickness*(1.0e6_wp/max(maxval(thickness), 1.0e-300_wp))), thinnest)
    call colour(size(x, 2), corner, normal, seen(:, order), distance(order), thinnest, &
      back(thinnest), side)
  end subroutine divide_surface

  !> Whether all faces that see each other have two sides.
  pure logical function are_two(side, seen)
    integer, intent(in) :: side(:), seen(:, :)
    integer :: k

    are_two = .false.
    do k = 1, size(seen, 2)
      if (side(seen(1, k)) + side(seen(2, k)) /= 3) return
    end do
    are_two = .true.
  end function are_two

  !> Leave those faces their sides that have a node that touches, and what these see.
  pure subroutine keep_touching(corner, seen, touches, side)
    integer, intent(in) :: corner(:, :), seen(:, :)
    logical, intent(in), optional :: touches(:)
    integer, intent(inout) :: side(:)
    logical :: presses(size(side)), stays(size(side))
    integer :: f, k

    presses = .false.
    if (present(touches)) presses = [(any(touches(corner(:corners_in(corner(:, f)), f))), f=1, &
      size(side))]
    stays = presses
    do k = 1, size(seen, 2)
      if (any(presses(seen(:, k)))) stays(seen(:, k)) = .true.
    end do
    where (.not. stays) side = 0
  end subroutine keep_touching

  !> Which faces see each other, and how far apart, and the back of each.
  subroutine look_along_normals(x, corner, normal, seen, distance, back, thickness)
    real(wp), intent(in) :: x(:, :)           !! (3,n_nodes) [length]
    integer, intent(in) :: corner(:, :)       !! (4,n) the fourth is 0 in a triangle
    real(wp), intent(in) :: normal(:, :)      !! (3,n)
    integer, allocatable, intent(out) :: seen(:, :)    !! (2,n_seen)
    real(wp), allocatable, intent(out) :: distance(:)  !! (n_seen) [length]
    integer, intent(out), optional :: back(:)       !! (n) 0: none
    real(wp), intent(out), optional :: thickness(:) !! (n) as far as that is, with `back` [length]
    real(wp), parameter :: inwards = 0.1_wp   !! of a ray near a corner, towards the middle [-]
    type(face_grid_t) :: grid
    real(wp) :: from(3, face_corners + 1), middle(3), low(3), high(3), way
    integer :: f, k, n, first, n_seen

    allocate (seen(2, 5*size(corner, 2)), distance(5*size(corner, 2)))
    n_seen = 0
    if (size(corner, 2) > 0) then
      grid = make_face_grid(corner, x)
      low = minval(grid%box(:, 1, :), 2)
      high = maxval(grid%box(:, 2, :), 2)
    end if
    do f = 1, size(corner, 2)
      n = corners_in(corner(:, f))
      middle = sum(x(:, corner(:n, f)), 2)/n
      from(:, n + 1) = middle
      do k = 1, n
        from(:, k) = middle + (1.0_wp - inwards)*(x(:, corner(k, f)) - middle)
      end do
      do k = 1, n + 1
        call find_first(from(:, k), normal(:, f), 1, first, way)
        if (first == 0) cycle
        if (share_a_node(corner(:, f), corner(:, first))) cycle
        n_seen = n_seen + 1
        seen(:, n_seen) = [f, first]
        distance(n_seen) = max(0.0_wp, way)
      end do
      if (present(back)) call find_first(middle, -normal(:, f), -1, back(f), thickness(f))
    end do
    seen = seen(:, :n_seen)
    distance = distance(:n_seen)

  contains

    !> The first face that is turned towards a place before it (1), or away from it (-1): parts of
    !> the way twice as long as the one before are looked at until one has a face, or the way has
    !> left the surface's box.
    subroutine find_first(place, along, turned, first, way)
      real(wp), intent(in) :: place(3), along(3) !! [length], [-]
      integer, intent(in) :: turned
      integer, intent(out) :: first              !! 0: none
      real(wp), intent(out) :: way               !! how far away it is [length]
      integer, allocatable :: near(:)
      real(wp) :: begin, end, last, t
      integer :: g, i

      first = 0
      way = huge(1.0_wp)
      last = leaves_box(place, along, low, high)
      begin = 0.0_wp
      end = norm2(grid%size)
      do
        call faces_near(grid, place + min(begin*along, end*along), place + max(begin*along, &
          end*along), near)
        do i = 1, size(near)
          g = near(i)
          if (turned*dot_product(along, normal(:, g)) > against) cycle
          associate (node => corner(:corners_in(corner(:, g)), g))
            t = way_to(x(:, merge(node, node(size(node):1:-1), turned > 0)), place, &
              along)
          end associate
          if (t >= way) cycle
          way = t
          first = g
        end do
        if (way <= end .or. end >= last) exit
        t = end - begin
        begin = end
        end = end + 2.0_wp*t
      end do
    end subroutine find_first

  end subroutine look_along_normals

  !> How far along a direction a place in a box leaves it.
  pure real(wp) function leaves_box(place, along, low, high) result(way)
    real(wp), intent(in) :: place(3), along(3), low(3), high(3) !! [length], [-], [length]
    integer :: i

    way = huge(1.0_wp)
    do i = 1, 3
      if (along(i) > 0.0_wp) way = min(way, (high(i) - place(i))/along(i))
      if (along(i) < 0.0_wp) way = min(way, (low(i) - place(i))/along(i))
    end do
  end function leaves_box

  !> Whether two faces have a corner in common.
  pure logical function share_a_node(one, other) result(share)
    integer, intent(in) :: one(:), other(:) !! corners; the fourth is 0 in a triangle
    integer :: k

    share = .false.
    do k = 1, corners_in(one)
      share = share .or. any(other == one(k))
    end do
  end function share_a_node

  !> How far along a direction a face lies before a place, or on it; huge where it does not.
  pure real(wp) function way_to(corner, from, along) result(way)
    real(wp), intent(in) :: corner(:, :)  !! (3,3) or (3,4) [length]
    real(wp), intent(in) :: from(3), along(3)
    real(wp), parameter :: touching = 1.0e-9_wp !! of the size of the face: nearer is there [-]
    real(wp) :: normal(3), middle(3), slope
    integer :: k, n
    logical :: is_in

    n = size(corner, 2)
    middle = sum(corner, 2)/n
    normal = outward_normal(corner)
    slope = dot_product(normal, along)
    way = huge(1.0_wp)
    if (.not. slope < 0.0_wp) return
    is_in = .true.
    do k = 1, n
      associate (a => corner(:, k), b => corner(:, 1 + mod(k, n)))
        ! The edge seen along the ray, anticlockwise from the place.
        is_in = is_in .and. dot_product(along, cross(a - from, b - from)) <= 0.0_wp
      end associate
    end do
    if (.not. is_in) return
    way = dot_product(normal, middle - from)/slope
    if (way < -touching*norm2(corner(:, 2) - corner(:, 1))) way = huge(1.0_wp)
  end function way_to

  !> Give faces their sides, from the nearest two that see each other on: first what sees another
  !> nearer than twice the least distance, then twice as far, and so on.
  subroutine colour(n_nodes, corner, normal, seen, distance, thinnest, back, side)
    integer, intent(in) :: n_nodes
    integer, intent(in) :: corner(:, :)   !! (4,n)
    real(wp), intent(in) :: normal(:, :)  !! (3,n)
    integer, intent(in) :: seen(:, :)     !! (2,n_seen) the nearest first
    real(wp), intent(in) :: distance(:)   !! (n_seen) [length]
    integer, intent(in) :: thinnest(:)    !! (n) faces, the one that is nearest to its back first
    integer, intent(in) :: back(:)        !! (n) of these; 0: none
    integer, intent(inout) :: side(:)     !! (n) those that some have stay
    type(lists_t) :: about                !! of each node the faces that have it
    type(lists_t) :: sight                !! of each face those that it sees or is seen by
    integer :: queue(size(side))          !! faces that have a side, in the order of getting it
    logical :: counts(size(side))         !! faces that may get one now
    logical :: gave
    real(wp) :: far                       !! [length]
    integer :: place(size(side))          !! of each face in `thinnest`
    integer :: next                       !! of them: none before it can give a side to its back
    integer :: n_queued, n_across, n_beside, k, first

    about = columns_with(corner, n_nodes)
    place(thinnest) = [(k, k=1, size(side))]
    next = 1
    n_queued = 0
    do k = 1, size(side)
      if (side(k) > 0) call give(k, side(k))
    end do
    first = 1
    do while (first <= size(seen, 2))
      far = 2.0_wp*distance(first)
      do k = first, size(seen, 2)
        if (distance(k) > far) exit
      end do
      first = k
      associate (one => [seen(1, :first - 1), seen(2, :first - 1)], &
                 other => [seen(2, :first - 1), seen(1, :first - 1)])
        sight = lists_by_key(one, size(side))
        sight%item = other(sight%item)
        counts = .false.
        counts(one) = .true.
      end associate
      n_across = 0
      n_beside = 0
      next = 1
      do k = 1, first
        if (k > 1 .and. k < first) then
          if (side(seen(1, k)) > 0) cycle
        end if
        do
          ! What is seen from a side, then what lies beside one, then what is behind one.
          if (n_across < n_queued) then
            n_across = n_across + 1
            call go_across(queue(n_across))
          else if (n_beside < n_queued) then
            call go_on(queue(n_beside + 1), -1.0_wp, gave)
            if (.not. gave) n_beside = n_beside + 1
          else
            call go_behind(gave)
            if (.not. gave) exit
          end if
        end do
        if (k == first) exit
        if (side(seen(1, k)) == 0) call give(seen(1, k), 1)
      end do
    end do
    counts = .true.
    n_beside = 0
    do while (n_beside < n_queued)
      call go_on(queue(n_beside + 1), flat, gave)
      if (.not. gave) n_beside = n_beside + 1
    end do

  contains

    subroutine give(face, its)
      integer, intent(in) :: face, its

      side(face) = its
      n_queued = n_queued + 1
      queue(n_queued) = face
      next = min(next, place(face))
    end subroutine give

    !> What a face sees gets the other side.
    subroutine go_across(face)
      integer, intent(in) :: face
      integer :: i

      do i = sight%first(face), sight%first(face + 1) - 1
        if (side(sight%item(i)) == 0) call give(sight%item(i), 3 - side(face))
      end do
    end subroutine go_across

    !> The back of a face gets its side, the nearest first.
    subroutine go_behind(gave)
      logical, intent(out) :: gave     !! false: there is none without a side
      integer :: i

      gave = .false.
      do i = next, size(thinnest)
        next = i
        if (side(thinnest(i)) == 0 .or. back(i) == 0) cycle
        if (side(back(i)) > 0 .or. .not. counts(back(i))) cycle
        call give(back(i), side(thinnest(i)))
        gave = .true.
        return
      end do
    end subroutine go_behind

    !> A neighbour of a face gets its side, if it continues it so far.
    subroutine go_on(face, cosine, gave)
      integer, intent(in) :: face
      real(wp), intent(in) :: cosine   !! of the normals, at least
      logical, intent(out) :: gave     !! false: there is none without a side
      integer :: c, i

      gave = .false.
      do c = 1, corners_in(corner(:, face))
        do i = about%first(corner(c, face)), about%first(corner(c, face) + 1) - 1
          associate (other => about%item(i))
            if (side(other) > 0 .or. .not. counts(other)) cycle
            if (dot_product(normal(:, face), normal(:, other)) < cosine) cycle
            call give(other, side(face))
          end associate
          gave = .true.
          return
        end do
      end do
    end subroutine go_on

  end subroutine colour

end module self_contact_mod
