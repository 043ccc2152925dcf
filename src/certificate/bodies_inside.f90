!> Nodes of bodies that are inside other bodies where no contact pair would keep them out.
!>
!> By code of its own: a ray from the node through the outer faces of the other body, moved places
!> alone. docs/theory.md section 6.
module bodies_inside_mod
  use kinds_mod, only: wp
  use connectivity_mod, only: corners_in
  use scene_mod, only: scene_t
  use small_matrix_mod, only: cross
  use contact_points_mod, only: contact_points_t, is_pair_removed
  implicit none
  private

  public :: inside_t, find_inside

  !> A node inside a body.
  type :: inside_t
    integer :: node = 0            !! 0: there is none
    integer :: piece = 0           !! of the mesh, that it is in
    real(wp) :: depth = 0.0_wp     !! to the nearest outer face [length]
  end type inside_t

  !> The outer faces of a piece of the mesh in triangles, and which of them rays along x meet.
  type :: hull_t
    real(wp), allocatable :: corner(:, :, :) !! (3,3,n) [length]
    integer :: cells = 1                     !! along y and along z
    real(wp) :: low(2) = 0.0_wp, width(2) = 1.0_wp !! of the cells in y and z [length]
    integer, allocatable :: first(:)         !! (cells**2+1)
    integer, allocatable :: triangle(:)      !! of each cell
  end type hull_t

contains

  !> The node that is deepest inside another body, of those on outer faces that no pair has before
  !> this body. Bodies that constraints join do not count, nor do those that overlap there in the
  !> mesh of the deck or may by *CONTACT EXCLUSIONS, nor those whose pair a *STEP has removed.
  type(inside_t) function find_inside(scene, points, u, least) result(deepest)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: u(:, :)   !! (3,n_nodes) [length]
    real(wp), intent(in) :: least     !! depth that rounding and tolerance leave [length]
    real(wp), parameter :: beside = 1.0e-6_wp !! of the mesh: rays begin beside their nodes [-]
    real(wp) :: x(3, size(u, 2)), low(3, scene%mesh%n_pieces), high(3, scene%mesh%n_pieces)
    logical :: of_slave(scene%mesh%n_pieces, size(scene%pairs))
    logical :: of_master(scene%mesh%n_pieces, size(scene%pairs))
    integer :: body(scene%mesh%n_pieces), node(size(u, 2)), start(scene%mesh%n_pieces + 1)
    type(hull_t) :: hull, at_rest
    integer, allocatable :: found(:)
    integer :: piece, other, k, i
    logical :: has_hull
    real(wp) :: depth, allowed

    if (.not. allocated(scene%mesh%skin) .or. scene%mesh%n_pieces < 2) return
    x = scene%mesh%coordinates + u
    allowed = least + beside*norm2(maxval(x, 2) - minval(x, 2))
    call list_nodes()
    call list_pairs()
    do piece = 1, scene%mesh%n_pieces
      has_hull = .false.
      do other = 1, scene%mesh%n_pieces
        if (body(other) == body(piece) .or. may_overlap(piece, other)) cycle
        if (any(low(:, piece) + allowed >= high(:, other) .or. high(:, piece) - allowed <= &
          low(:, other))) cycle
        call candidates(piece, other, found)
        if (size(found) == 0) cycle
        if (.not. has_hull) hull = hull_of(scene, piece, x)
        has_hull = .true.
        if (.not. is_closed(hull)) exit
        do k = 1, size(found)
          i = found(k)
          if (.not. is_in(hull, x(:, i))) cycle
          depth = depth_in(hull, x(:, i))
          if (depth <= max(allowed, deepest%depth)) cycle
          if (.not. allocated(at_rest%corner)) at_rest = hull_of(scene, piece, &
            scene%mesh%coordinates)
          if (is_in(at_rest, scene%mesh%coordinates(:, i))) exit
          deepest = inside_t(i, piece, depth)
        end do
      end do
      if (allocated(at_rest%corner)) deallocate (at_rest%corner)
    end do

  contains

    !> The nodes on outer faces by their pieces, the boxes of these, and the bodies they are of.
    subroutine list_nodes()
      logical :: is_outer(0:size(u, 2))
      integer :: next(scene%mesh%n_pieces), j, p

      is_outer = .false.
      do j = 1, size(scene%mesh%skin, 2)
        is_outer(scene%mesh%skin(:, j)) = .true.
      end do
      start = 0
      low = huge(1.0_wp)
      high = -huge(1.0_wp)
      body = 0
      do j = 1, size(u, 2)
        if (.not. is_outer(j)) cycle
        p = scene%mesh%piece(j)
        start(p + 1) = start(p + 1) + 1
        low(:, p) = min(low(:, p), x(:, j))
        high(:, p) = max(high(:, p), x(:, j))
        body(p) = scene%mesh%body(j)
      end do
      start(1) = 1
      do p = 2, size(start)
        start(p) = start(p) + start(p - 1)
      end do
      next = start(:scene%mesh%n_pieces)
      do j = 1, size(u, 2)
        if (.not. is_outer(j)) cycle
        p = scene%mesh%piece(j)
        node(next(p)) = j
        next(p) = next(p) + 1
      end do
    end subroutine list_nodes

    !> Which pieces each pair of two surfaces has.
    subroutine list_pairs()
      integer :: p

      of_slave = .false.
      of_master = .false.
      do p = 1, size(scene%pairs)
        if (scene%pairs(p)%master_surface == 0) cycle
        of_slave(scene%mesh%piece(scene%surfaces(scene%pairs(p)%surface)%nodes), p) = .true.
        of_master(scene%mesh%piece(scene%surfaces(scene%pairs(p)%master_surface)%nodes), p) = &
          .true.
      end do
    end subroutine list_pairs

    !> Whether the deck lets two pieces overlap.
    pure logical function may_overlap(one, two)
      integer, intent(in) :: one, two
      integer :: j

      may_overlap = .false.
      if (.not. allocated(scene%may_overlap)) return
      do j = 1, size(scene%may_overlap, 2)
        may_overlap = may_overlap .or. all(scene%may_overlap(:, j) == [min(one, two), max(one, &
          two)])
      end do
    end function may_overlap

    !> The nodes of a piece in the box of another that no pair of both has; none where such a pair
    !> is removed.
    pure subroutine candidates(piece, other, found)
      integer, intent(in) :: piece, other
      integer, allocatable, intent(out) :: found(:)
      logical :: is_one(start(other):start(other + 1) - 1)
      integer :: j, p

      do j = start(other), start(other + 1) - 1
        is_one(j) = all(x(:, node(j)) > low(:, piece) + allowed .and. x(:, node(j)) < &
          high(:, piece) - allowed)
      end do
      do p = 1, size(scene%pairs)
        if (.not. any(is_one)) exit
        if (.not. ((of_slave(piece, p) .and. of_master(other, p)) .or. (of_slave(other, p) .and. &
          of_master(piece, p)))) cycle
        if (is_pair_removed(points, p)) is_one = .false.
        is_one = is_one .and. .not. are_of(node(start(other):start(other + 1) - 1), &
          scene%surfaces(scene%pairs(p)%surface)%nodes)
        is_one = is_one .and. .not. are_of(node(start(other):start(other + 1) - 1), &
          scene%surfaces(scene%pairs(p)%master_surface)%nodes)
      end do
      found = pack(node(start(other):start(other + 1) - 1), is_one)
    end subroutine candidates

  end function find_inside

  !> Which nodes are in a list; both ascend.
  pure function are_of(nodes, list) result(are)
    integer, intent(in) :: nodes(:), list(:)
    logical :: are(size(nodes))
    integer :: i, k

    k = 1
    do i = 1, size(nodes)
      do while (k < size(list))
        if (list(k) >= nodes(i)) exit
        k = k + 1
      end do
      are(i) = .false.
      if (size(list) > 0) are(i) = list(k) == nodes(i)
    end do
  end function are_of

  !> The outer faces of a piece, quadrilaterals cut about their middle.
  pure type(hull_t) function hull_of(scene, piece, x) result(hull)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: piece
    real(wp), intent(in) :: x(:, :)  !! (3,n_nodes) [length]
    integer :: f, k, n, m, pass, y, z, range(2, 2)
    real(wp) :: middle(3)

    n = 0
    do f = 1, size(scene%mesh%skin, 2)
      if (scene%mesh%piece(scene%mesh%skin(1, f)) /= piece) cycle
      n = n + merge(1, 4, corners_in(scene%mesh%skin(:, f)) == 3)
    end do
    allocate (hull%corner(3, 3, n))
    n = 0
    do f = 1, size(scene%mesh%skin, 2)
      associate (node => scene%mesh%skin(:, f))
        if (scene%mesh%piece(node(1)) /= piece) cycle
        m = corners_in(node)
        if (m == 3) then
          n = n + 1
          hull%corner(:, :, n) = x(:, node(:3))
          cycle
        end if
        middle = 0.25_wp*(x(:, node(1)) + x(:, node(2)) + x(:, node(3)) + x(:, node(4)))
        do k = 1, 4
          n = n + 1
          hull%corner(:, 1, n) = x(:, node(k))
          hull%corner(:, 2, n) = x(:, node(1 + mod(k, 4)))
          hull%corner(:, 3, n) = middle
        end do
      end associate
    end do
    hull%cells = max(1, int(sqrt(real(n, wp))))
    do k = 1, 2
      hull%low(k) = minval(hull%corner(1 + k, :, :))
      hull%width(k) = max((maxval(hull%corner(1 + k, :, :)) - hull%low(k))/hull%cells, &
        tiny(1.0_wp))
    end do
    allocate (hull%first(hull%cells**2 + 1), source=0)
    do pass = 1, 2
      do f = 1, n
        do k = 1, 2
          range(1, k) = cell_of(hull, minval(hull%corner(1 + k, :, f)), k)
          range(2, k) = cell_of(hull, maxval(hull%corner(1 + k, :, f)), k)
        end do
        do z = range(1, 2), range(2, 2)
          do y = range(1, 1), range(2, 1)
            m = y + hull%cells*(z - 1)
            if (pass == 1) then
              hull%first(m + 1) = hull%first(m + 1) + 1
            else
              hull%triangle(hull%first(m)) = f
              hull%first(m) = hull%first(m) + 1
            end if
          end do
        end do
      end do
      if (pass == 1) then
        hull%first(1) = 1
        do m = 2, size(hull%first)
          hull%first(m) = hull%first(m) + hull%first(m - 1)
        end do
        allocate (hull%triangle(hull%first(size(hull%first)) - 1))
      else
        hull%first(2:) = hull%first(:hull%cells**2)
        hull%first(1) = 1
      end if
    end do
  end function hull_of

  !> Whether faces enclose something: their area vectors add up to none. Of a part of a scene the
  !> face that it is cut at is missing.
  pure logical function is_closed(hull)
    type(hull_t), intent(in) :: hull
    real(wp), parameter :: rounding = 1.0e-6_wp !! and hanging nodes, of the whole area [-]
    real(wp) :: area(3), total, one(3)
    integer :: f

    area = 0.0_wp
    total = 0.0_wp
    do f = 1, size(hull%corner, 3)
      associate (c => hull%corner(:, :, f))
        one = cross(c(:, 2) - c(:, 1), c(:, 3) - c(:, 1))
      end associate
      area = area + one
      total = total + norm2(one)
    end do
    is_closed = norm2(area) <= rounding*total
  end function is_closed

  !> The cell along y or z that a place is in.
  pure integer function cell_of(hull, place, k) result(cell)
    type(hull_t), intent(in) :: hull
    real(wp), intent(in) :: place  !! [length]
    integer, intent(in) :: k       !! 1: y, 2: z

    cell = 1 + int(max(0.0_wp, min(real(hull%cells, wp) - 0.5_wp, (place - hull%low(k))/ &
      hull%width(k))))
  end function cell_of

  !> Whether a place is inside: a ray along x crosses an odd number of faces. It begins a little
  !> beside the place, so that it meets no edge of meshes that are alike.
  pure logical function is_in(hull, place)
    type(hull_t), intent(in) :: hull
    real(wp), intent(in) :: place(3)   !! [length]
    real(wp), parameter :: beside(2) = [1.7320508e-7_wp, 2.2360680e-7_wp] !! of the body [-]
    real(wp) :: at(2), area(3)
    integer :: i, k, cell

    is_in = .false.
    at = place(2:) + beside*hull%cells*hull%width
    cell = cell_of(hull, at(1), 1) + hull%cells*(cell_of(hull, at(2), 2) - 1)
    do i = hull%first(cell), hull%first(cell + 1) - 1
      associate (c => hull%corner(:, :, hull%triangle(i)))
        do k = 1, 3
          associate (a => c(2:, 1 + mod(k, 3)) - at, b => c(2:, 1 + mod(k + 1, 3)) - at)
            area(k) = a(1)*b(2) - a(2)*b(1)
          end associate
        end do
        if (.not. (all(area > 0.0_wp) .or. all(area < 0.0_wp))) cycle
        if (dot_product(area, c(1, :))/sum(area) > place(1)) is_in = .not. is_in
      end associate
    end do
  end function is_in

  !> How far a place is from the nearest face [length].
  pure real(wp) function depth_in(hull, place) result(depth)
    type(hull_t), intent(in) :: hull
    real(wp), intent(in) :: place(3)   !! [length]
    integer :: f

    depth = huge(1.0_wp)
    do f = 1, size(hull%corner, 3)
      depth = min(depth, distance(hull%corner(:, :, f), place))
    end do
  end function depth_in

  !> The distance of a place from a triangle [length].
  pure real(wp) function distance(corner, place)
    real(wp), intent(in) :: corner(3, 3), place(3) !! [length]
    real(wp) :: normal(3), share(3), size_of, along
    integer :: k

    normal = cross(corner(:, 2) - corner(:, 1), corner(:, 3) - corner(:, 1))
    size_of = norm2(normal)
    if (size_of > 0.0_wp) then
      normal = normal/size_of
      do k = 1, 3
        share(k) = dot_product(normal, cross(corner(:, 1 + mod(k, 3)) - place, &
          corner(:, 1 + mod(k + 1, 3)) - place))
      end do
      distance = abs(dot_product(normal, place - corner(:, 1)))
      if (all(share >= 0.0_wp)) return
    end if
    distance = huge(1.0_wp)
    do k = 1, 3
      associate (a => corner(:, k), b => corner(:, 1 + mod(k, 3)))
        along = dot_product(place - a, b - a)/max(dot_product(b - a, b - a), tiny(1.0_wp))
        distance = min(distance, norm2(place - a - max(0.0_wp, min(1.0_wp, along))*(b - a)))
      end associate
    end do
  end function distance

end module bodies_inside_mod
