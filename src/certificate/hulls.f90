!> The outer faces of all bodies as triangles: how often a place is within a body, how deep, and
!> where lines pierce them. docs/theory.md section 6.
module hulls_mod
  use kinds_mod, only: wp
  use box_tree_mod, only: box_tree_t, list_meeting, make_box_tree
  use connectivity_mod, only: corners_in
  use mesh_mod, only: mesh_t
  use small_matrix_mod, only: cross
  implicit none
  private

  public :: hulls_t, make_hulls, n_triangles, triangle, middle_of, normal_of, times_inside, &
    depth_below, find_piercing

  !> Quadrilaterals are cut about their middles.
  type :: hulls_t
    integer,  allocatable :: face(:, :)    !! (4,n) nodes; the fourth is 0 in a triangle
    integer,  allocatable :: piece(:)      !! (n) of the mesh
    real(wp), allocatable :: x(:, :)       !! (3,n_nodes) [length]
    type(box_tree_t) :: tree               !! of the faces' boxes
    logical,  allocatable :: is_closed(:)  !! (n_pieces)
    integer,  allocatable :: body(:)       !! (n_pieces) what constraints join is one
    real(wp), allocatable :: low(:, :), high(:, :) !! (3,n_pieces) their boxes [length]
    real(wp) :: extent = 0.0_wp            !! diagonal of the box of all [length]
  end type hulls_t

contains

  !> The outer faces where places are; the mesh knows its skin.
  pure subroutine make_hulls(mesh, x, hulls)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: x(:, :) !! (3,n_nodes) [length]
    type(hulls_t), intent(out) :: hulls
    real(wp) :: box(6, size(mesh%skin, 2)), normal(3, size(mesh%skin, 2))
    integer :: f

    hulls%face = mesh%skin
    hulls%piece = mesh%piece(mesh%skin(1, :))
    hulls%x = x
    allocate (hulls%body(mesh%n_pieces), source=0)
    allocate (hulls%low(3, mesh%n_pieces), source=huge(1.0_wp))
    allocate (hulls%high(3, mesh%n_pieces), source=-huge(1.0_wp))
    do f = 1, size(box, 2)
      associate (place => x(:, mesh%skin(:corners_in(mesh%skin(:, f)), f)), p => hulls%piece(f))
        box(:, f) = [minval(place, 2), maxval(place, 2)]
        hulls%body(p) = mesh%body(mesh%skin(1, f))
        hulls%low(:, p) = min(hulls%low(:, p), box(:3, f))
        hulls%high(:, p) = max(hulls%high(:, p), box(4:, f))
      end associate
    end do
    hulls%extent = norm2(maxval(box(4:, :), 2) - minval(box(:3, :), 2))
    do f = 1, size(box, 2)
      normal(:, f) = normal_of(hulls, f)
    end do
    call make_box_tree(box, normal, hulls%piece, hulls%tree)
    hulls%is_closed = are_closed(hulls, mesh%n_pieces, mesh%sector_angle > 0.0_wp)
  end subroutine make_hulls

  !> Whether the faces of each piece enclose something: their area vectors add up to none. Of a part
  !> of a scene the face that it is cut at is missing. Wedges are open at both sides: areas in parts
  !> of the radius are what sections enclose, but for the axis.
  pure function are_closed(hulls, n_pieces, is_wedge) result(are)
    type(hulls_t), intent(in) :: hulls
    integer, intent(in) :: n_pieces
    logical, intent(in) :: is_wedge
    logical :: are(n_pieces)
    real(wp), parameter :: rounding = 1.0e-6_wp
    !! and hanging nodes, of the whole area: decks have six digits and more, a
    !! missing one of n faces leaves 1/n [-]
    real(wp) :: area(3, n_pieces), total(n_pieces), one(3), c(3, 3)
    integer :: f, k

    area = 0.0_wp
    total = 0.0_wp
    do f = 1, size(hulls%piece)
      one = 0.0_wp
      do k = 1, n_triangles(hulls, f)
        c = triangle(hulls, f, k)
        one = one + cross(c(:, 2) - c(:, 1), c(:, 3) - c(:, 1))
      end do
      if (is_wedge) one = [0.0_wp, one(2), 0.0_wp]/max(tiny(1.0_wp), norm2(middle_of(hulls, f)* &
        [1.0_wp, 0.0_wp, 1.0_wp]))
      area(:, hulls%piece(f)) = area(:, hulls%piece(f)) + one
      total(hulls%piece(f)) = total(hulls%piece(f)) + norm2(one)
    end do
    are = norm2(area, dim=1) <= rounding*total
  end function are_closed

  !> How many triangles a face is cut into.
  pure integer function n_triangles(hulls, f) result(n)
    type(hulls_t), intent(in) :: hulls
    integer, intent(in) :: f

    n = merge(1, 4, hulls%face(4, f) == 0)
  end function n_triangles

  !> The corners of a triangle of a face, anticlockwise from outside [length].
  pure function triangle(hulls, f, k) result(corner)
    type(hulls_t), intent(in) :: hulls
    integer, intent(in) :: f, k
    real(wp) :: corner(3, 3)

    if (hulls%face(4, f) == 0) then
      corner = hulls%x(:, hulls%face(:3, f))
    else
      corner(:, 1) = hulls%x(:, hulls%face(k, f))
      corner(:, 2) = hulls%x(:, hulls%face(1 + mod(k, 4), f))
      corner(:, 3) = middle_of(hulls, f)
    end if
  end function triangle

  !> The middle of a face [length].
  pure function middle_of(hulls, f) result(middle)
    type(hulls_t), intent(in) :: hulls
    integer, intent(in) :: f
    real(wp) :: middle(3)
    integer :: n

    n = merge(3, 4, hulls%face(4, f) == 0)
    middle = sum(hulls%x(:, hulls%face(:n, f)), 2)/n
  end function middle_of

  !> The unit normal of a face, outwards; 0 of one without an area [-].
  pure function normal_of(hulls, f) result(normal)
    type(hulls_t), intent(in) :: hulls
    integer, intent(in) :: f
    real(wp) :: normal(3)

    associate (x => hulls%x, node => hulls%face(:, f))
      if (node(4) == 0) then
        normal = cross(x(:, node(2)) - x(:, node(1)), x(:, node(3)) - x(:, node(1)))
      else
        normal = cross(x(:, node(3)) - x(:, node(1)), x(:, node(4)) - x(:, node(2)))
      end if
    end associate
    normal = normal/max(tiny(1.0_wp), norm2(normal))
  end function normal_of

  !> How many times a place is inside a piece: from there along x its faces are crossed outwards
  !> that many times more than inwards. The ray begins a little beside the place, so that it meets
  !> no edge of meshes that are alike. It counts the faces of all pieces at once.
  pure subroutine times_inside(hulls, place, times)
    type(hulls_t), intent(in) :: hulls
    real(wp), intent(in) :: place(3)     !! [length]
    integer, intent(out) :: times(:)     !! (n_pieces)
    real(wp), parameter :: beside(2) = [1.7320508e-7_wp, 2.2360680e-7_wp]
    !! of the whole: roots, whose ratio is that of no edge between places with few digits [-]
    real(wp) :: at(2), area(3), c(3, 3)
    integer, allocatable :: found(:)
    integer :: i, k, m, n

    times = 0
    at = place(2:) + beside*hulls%extent
    call list_meeting(hulls%tree, [place(1), at, huge(1.0_wp), at], n, found)
    do i = 1, n
      do k = 1, n_triangles(hulls, found(i))
        c = triangle(hulls, found(i), k)
        do m = 1, 3
          associate (a => c(2:, 1 + mod(m, 3)) - at, b => c(2:, 1 + mod(m + 1, 3)) - at)
            area(m) = a(1)*b(2) - a(2)*b(1)
          end associate
        end do
        if (.not. (all(area > 0.0_wp) .or. all(area < 0.0_wp))) cycle
        if (dot_product(area, c(1, :))/sum(area) > place(1)) times(hulls%piece(found(i))) = &
          times(hulls%piece(found(i))) + merge(1, -1, area(1) > 0.0_wp)
      end do
    end do
  end subroutine times_inside

  !> How far a place is from the nearest outer face of a piece, of those that have none of some
  !> nodes; 0 where that is at most `least` [length].
  pure real(wp) function depth_below(hulls, piece, place, without, least) result(depth)
    type(hulls_t), intent(in) :: hulls
    integer, intent(in) :: piece, without(:)
    real(wp), intent(in) :: place(3), least !! [length]
    real(wp) :: about
    integer, allocatable :: found(:)
    integer :: i, k, n

    depth = 0.0_wp
    about = least
    do
      call list_meeting(hulls%tree, [place - about, place + about], n, found)
      depth = huge(1.0_wp)
      do i = 1, n
        if (hulls%piece(found(i)) /= piece) cycle
        if (any([(any(hulls%face(:, found(i)) == without(k)), k=1, size(without))])) cycle
        do k = 1, n_triangles(hulls, found(i))
          depth = min(depth, distance(triangle(hulls, found(i), k), place))
        end do
      end do
      if (depth <= about .or. .not. about < hulls%extent) exit
      about = max(2.0_wp*about, epsilon(1.0_wp)*hulls%extent)
    end do
    if (depth <= least .or. .not. depth < huge(1.0_wp)) depth = 0.0_wp
  end function depth_below

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

  !> The faces that a line between two places pierces, and where: in parts of the line.
  pure subroutine find_piercing(hulls, ends, without, n, face, part)
    type(hulls_t), intent(in) :: hulls
    real(wp), intent(in) :: ends(3, 2)  !! [length]
    integer, intent(in) :: without(:)   !! nodes whose faces do not count
    integer, intent(out) :: n           !! so many
    integer, allocatable, intent(inout) :: face(:)  !! and room behind them
    real(wp), allocatable, intent(inout) :: part(:) !! [-]
    integer, allocatable :: found(:)
    real(wp) :: c(3, 3), at
    integer :: i, k, m

    n = 0
    call list_meeting(hulls%tree, [minval(ends, 2), maxval(ends, 2)], m, found)
    do i = 1, m
      if (any([(any(hulls%face(:, found(i)) == without(k)), k=1, size(without))])) cycle
      do k = 1, n_triangles(hulls, found(i))
        c = triangle(hulls, found(i), k)
        at = part_of_line(c, ends)
        if (at < 0.0_wp) cycle
        if (.not. allocated(face)) allocate (face(8), part(8))
        if (n == size(face)) then
          face = [face, face]
          part = [part, part]
        end if
        n = n + 1
        face(n) = found(i)
        part(n) = at
      end do
    end do
  end subroutine find_piercing

  !> Where a line pierces a triangle, in parts of the line; -1: it does not.
  pure real(wp) function part_of_line(c, ends) result(part)
    real(wp), intent(in) :: c(3, 3), ends(3, 2) !! [length]
    real(wp) :: volume(3), way(3), area(3), from, to
    integer :: k

    part = -1.0_wp
    area = cross(c(:, 2) - c(:, 1), c(:, 3) - c(:, 1))
    from = dot_product(area, ends(:, 1) - c(:, 1))
    to = dot_product(area, ends(:, 2) - c(:, 1))
    if ((from > 0.0_wp) .eqv. (to > 0.0_wp)) return
    way = ends(:, 2) - ends(:, 1)
    do k = 1, 3
      volume(k) = dot_product(way, cross(c(:, k) - ends(:, 1), c(:, 1 + mod(k, 3)) - ends(:, 1)))
    end do
    if (.not. (all(volume >= 0.0_wp) .or. all(volume <= 0.0_wp))) return
    part = from/(from - to)
  end function part_of_line

end module hulls_mod
