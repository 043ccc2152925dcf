!> Faces of a pair where they are at the end of an increment, and the integrals over what they
!> share, for the certificate. docs/theory.md (11.1) to (11.3).
module shared_faces_mod
  use kinds_mod, only: wp
  use lists_mod, only: lists_t, lists_by_key
  use small_matrix_mod, only: cross, solve_small
  use sorting_mod, only: order_of, count_below
  use surfaces_mod, only: all_nodes_of
  use mesh_mod, only: plane_strain, plane_stress
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t, faces_of_side, find_side_points
  use pair_faces_mod, only: master_faces, slave_faces
  use state_mod, only: state_t
  use turned_slips_mod, only: orientation
  use veils_mod, only: veil_t
  use face_integrals_mod, only: shared_t, integrate_shared, integrate_nodes, nearest_of
  use seen_borders_mod, only: view_t, have_common, sees_step, is_concave
  implicit none
  private

  public :: two_sides_t, rows_t, put_together, integrate, place_of_entry

  real(wp), parameter :: against = -0.2_wp
  !! cosine of normals that face each other, at most, as in (11.37) [-]
  real(wp), parameter :: cos_15 = 0.966_wp, cos_30 = 0.866_wp !! of normals, (11.35) [-]
  real(wp), parameter :: touching = 1.0e-9_wp
  !! of the size of a face: heights that are one; 370 random decks end alike with 1e-10 to 1e-8 [-]

  !> Boxes in the order of their lowest coordinates along the longest axis of all.
  type :: boxes_t
    real(wp), allocatable :: low(:, :), high(:, :) !! (3,n) [length]
    integer, allocatable :: sorted(:)
    integer, allocatable :: key(:)       !! of the sorted ones, as of `key_of`
    integer :: axis = 1
    real(wp) :: lowest = 0.0_wp, extent = 0.0_wp !! of all along it [length]
    real(wp) :: widest = 0.0_wp          !! of a box along it [length]
  end type boxes_t

  !> A slave surface and a master where both are.
  type :: two_sides_t
    integer :: pair = 0
    integer :: first = 0, last = 0       !! points
    integer, allocatable :: slave(:, :)
    !! (8,n) rows, the points of a side from 1: corners, then those in the middles of edges; zeros
    !! behind them
    integer, allocatable :: master(:, :) !! (4,n) or (8,n) places; the same
    integer, allocatable :: piece(:, :)  !! (4,n) places of what master faces are cut into
    integer, allocatable :: of(:)        !! (n) the face that each piece is of
    integer, allocatable :: ends(:, :)
    !! (2,n_rows) of nodes in the middles of edges the rows at its ends, else 0
    real(wp), allocatable :: a(:)        !! (n_rows) 1/4 where a quadrilateral has it, else 1/5
    integer, allocatable :: node(:)      !! of places, where they are nodes; else not allocated
    logical :: stays = .false.           !! both are where they are in the mesh
    real(wp), allocatable :: x(:, :)     !! (3,n_rows) [length]
    real(wp), allocatable :: q(:, :)     !! (3,n_rows) of the points, docs/theory.md (9.11) [length]
    real(wp), allocatable :: y(:, :)     !! (3,n_places) [length]
    real(wp) :: before = 0.0_wp, behind = 0.0_wp
    !! how far masters may be before and behind the plane of a slave face [length]
    type(boxes_t) :: boxes               !! of each piece
    real(wp), allocatable :: normal(:, :)          !! (3,n) and its outward normal [-]
    real(wp), allocatable :: at_rest(:, :) !! (3,n_places) places in the mesh [length]
    real(wp), allocatable :: rows_at_rest(:, :) !! (3,n_rows) the same of the slave's nodes [length]
    real(wp) :: at_most = huge(1.0_wp)
    !! how deep they are in each other there; huge: bodies are not known [length]
    integer, allocatable :: skin(:, :)   !! (4,n) corners of what may lie between
    integer, allocatable :: body(:)      !! (n) of these corners; where it is not known all alike
    type(boxes_t) :: skin_boxes
    real(wp), allocatable :: z(:, :)     !! (3,n) of these corners [length]
    integer, allocatable :: corner_of_row(:), corner_of_place(:) !! what these are of them
    real(wp) :: largest = 0.0_wp         !! diagonal of the boxes [length]
    real(wp) :: breadth = 1.0_wp
    !! how much of the slave the master can cover: of slices, what it is thick beside it [-]
  end type two_sides_t

  !> What a master's place has in a row, not yet divided by the row's area.
  type :: entry_t
    integer :: row = 0
    integer :: place = 0           !! below 0: the point of that row of the slave
    real(wp) :: part = 0.0_wp      !! [length^2]
  end type entry_t

  !> What the rows of a side come to.
  type :: rows_t
    real(wp), allocatable :: area(:), whole(:)  !! (n) covered, and of the node [length^2]
    real(wp), allocatable :: normal(:, :)       !! (3,n) not of unit length [length^2]
    real(wp), allocatable :: straight(:) !! (n) covered by what is turned to it [length^2]
    real(wp), allocatable :: nearest(:) !! (n) least gap at corners of what is seen [length]
    logical, allocatable :: folds(:) !! (n) a face of the node is folded, or one that it shares with
    logical, allocatable :: is_torn(:) !! (n) it sees both sides of a step, or of a concave edge
    integer :: n_seen = 0
    integer, allocatable :: seen(:, :) !! (2,n_seen) a row, a piece that it sees; room for more
    integer :: n = 0                            !! entries
    type(entry_t), allocatable :: entry(:)      !! room for more than n
    type(lists_t) :: of_row                     !! the entries of each row
  end type rows_t

  !> What a slave face shares with a master face.
  type :: part_t
    integer :: master = 0
    real(wp) :: counts = 1.0_wp
    !! share of its integrals: all where the faces are turned to each other within 45 degrees [-]
    real(wp) :: nearest = 0.0_wp   !! least gap at its corners [length]
    real(wp) :: straight = 0.0_wp
    !! how much of it counts as turned to the slave: all up to 30 degrees, nothing at 45, what leans
    !! by more as it rises, below 0 [-]
    integer :: piece = 0           !! of the slave face
    integer :: seen = 0            !! piece of the master
    real(wp) :: plane(3) = 0.0_wp  !! height above the plane of the slave, and slopes [length, -]
    type(shared_t) :: shared
  end type part_t

contains

  !> Where the faces of a pair are; with small sliding where they are in the mesh.
  pure subroutine put_together(scene, points, pair, side, new, sides)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair, side
    type(state_t), intent(in) :: new
    type(two_sides_t), intent(out) :: sides
    integer :: row_of(0:scene%mesh%n_nodes), i, k
    integer, allocatable :: faces(:), place_of(:)
    real(wp), allocatable :: way(:, :)  !! of the places [length]
    real(wp) :: reach, axes(3, 3), moved

    sides%pair = pair
    call find_side_points(points, pair, side, sides%first, sides%last)
    associate (mesh => scene%mesh, of => scene%pairs(pair), &
               node => points%node(sides%first:sides%last))
      row_of(0) = 0
      row_of(node) = [(i, i=1, size(node))]
      sides%slave = all_nodes_of(slave_faces(scene, points, pair), mesh%connectivity)
      do i = 1, size(sides%slave, 2)
        sides%slave(:, i) = row_of(sides%slave(:, i))
      end do
      sides%x = mesh%coordinates(:, node)
      call find_ends(sides)
      if (of%master == 0) then
        sides%master = all_nodes_of(master_faces(scene, points, pair, side), mesh%connectivity)
      else
        call faces_of_side(points, pair, side, faces)
        sides%master = scene%obstacles(of%master)%facet
        if (allocated(faces)) sides%master = sides%master(:, faces)
      end if
      ! Places are what these faces have, each once.
      allocate (place_of(0:maxval(sides%master)), source=0)
      do i = 1, size(sides%master, 2)
        place_of(sides%master(:, i)) = 1
      end do
      place_of(0) = 0
      sides%node = pack([(i, i=1, size(place_of) - 1)], place_of(1:) > 0)
      place_of(sides%node) = [(i, i=1, size(sides%node))]
      do i = 1, size(sides%master, 2)
        sides%master(:, i) = place_of(sides%master(:, i))
      end do
      if (of%master == 0) then
        sides%y = mesh%coordinates(:, sides%node)
        way = new%displacement(:, sides%node)
      else
        associate (obstacle => scene%obstacles(of%master))
          sides%y = obstacle%corner(:, sides%node)
          way = 0.0_wp*sides%y
          if (obstacle%ref_node > 0) then
            if (any(abs(new%rotation(:, of%master)) > 0.0_wp)) then
              axes = orientation(new%rotation(:, of%master))
              do k = 1, size(way, 2)
                associate (arm => sides%y(:, k) - mesh%coordinates(:, obstacle%ref_node))
                  way(:, k) = matmul(axes, arm) - arm
                end associate
              end do
            end if
            way = way + spread(new%displacement(:, obstacle%ref_node), 2, size(way, 2))
          end if
        end associate
        deallocate (sides%node)
      end if
      sides%at_rest = sides%y
      sides%rows_at_rest = sides%x
      if (any(mesh%plane == [plane_strain, plane_stress]) .and. of%master == 0) then
        associate (there => sides%y(3, :), here => sides%x(3, :))
          sides%breadth = min(1.0_wp, (maxval(there) - minval(there))/(maxval(here) - minval(here)))
        end associate
      end if
      moved = 0.0_wp
      reach = 0.5_wp*max(largest_face(sides%slave, sides%x), largest_face(sides%master, sides%y))
      sides%stays = of%small_sliding .and. of%master == 0
      if (.not. sides%stays) then
        sides%x = sides%x + new%displacement(:, node)
        sides%y = sides%y + way
        if (of%master > 0) reach = 0.5_wp*max(largest_face(sides%slave, sides%x), &
          largest_face(sides%master, sides%y))
        associate (u => new%displacement(:, node))
          moved = norm2(max(maxval(u, 2) - minval(way, 2), maxval(way, 2) - minval(u, 2)))
        end associate
      end if
      sides%q = sides%x
      do i = 1, size(node)
        if (sides%ends(1, i) == 0) cycle
        associate (one => sides%x(:, sides%ends(1, i)), other => sides%x(:, sides%ends(2, i)))
          sides%q(:, i) = (sides%x(:, i) - sides%a(i)*(one + other))/(1.0_wp - 2.0_wp*sides%a(i))
        end associate
      end do
      sides%before = reach + moved + of%overlap
      ! Across slanted faces what overlaps seems deeper than it is.
      sides%behind = 2.0_wp*(moved + of%overlap) + 1.0e-6_wp*sides%before
      if (of%master > 0) sides%behind = sides%before
      if (sides%stays) sides%before = huge(1.0_wp)
    end associate
    call note_masters(sides)
    if (scene%pairs(pair)%master == 0 .and. allocated(scene%mesh%skin)) then
      sides%skin = scene%mesh%skin
      sides%body = scene%mesh%piece
      sides%z = scene%mesh%coordinates
      if (.not. sides%stays) sides%z = sides%z + new%displacement
      sides%corner_of_row = points%node(sides%first:sides%last)
      sides%corner_of_place = sides%node
      sides%at_most = 2.0_wp*scene%pairs(pair)%overlap + 1.0e-6_wp*sides%before
    else
      call note_own_faces(sides)
    end if
    call put_in_boxes(sides%skin, sides%z, sides%skin_boxes)
  end subroutine put_together

  !> The ends of the edges of slave faces with nodes in their middles.
  pure subroutine find_ends(sides)
    type(two_sides_t), intent(inout) :: sides
    integer :: f, k, n

    allocate (sides%ends(2, size(sides%x, 2)), source=0)
    allocate (sides%a(size(sides%x, 2)), source=0.0_wp)
    do f = 1, size(sides%slave, 2)
      n = corners_of(sides%slave(:, f))
      if (count(sides%slave(:, f) > 0) == n) cycle
      do k = 1, n
        associate (row => sides%slave(n + k, f))
          sides%ends(:, row) = [sides%slave(k, f), sides%slave(1 + mod(k, n), f)]
          sides%a(row) = max(sides%a(row), merge(0.25_wp, 0.2_wp, n == 4))
        end associate
      end do
    end do
  end subroutine find_ends

  pure integer function corners_of(face) result(n)
    integer, intent(in) :: face(:) !! (4) or (8) 0 behind its nodes

    n = count(face > 0)
    if (n > 4) n = n/2
  end function corners_of

  !> What a face is cut into along lines between its nodes: nothing where it has corners alone.
  pure subroutine cut(face, piece, n)
    integer, intent(in) :: face(:)       !! (4) or (8)
    integer, intent(out) :: piece(4, 5)  !! the fourth is 0 in a triangle
    integer, intent(out) :: n            !! how many
    integer :: corners, k, before

    piece = 0
    n = 1
    corners = corners_of(face)
    if (count(face > 0) == corners) then
      piece(:, 1) = face(:4)
      return
    end if
    do k = 1, corners
      before = merge(2*corners, corners + k - 1, k == 1)
      piece(:3, k) = [face(k), face(corners + k), face(before)]
    end do
    n = corners + 1
    piece(:corners, n) = face(corners + 1:2*corners)
  end subroutine cut

  !> The longest diagonal of the boxes of faces, by their corners.
  pure real(wp) function largest_face(faces, x) result(length)
    integer, intent(in) :: faces(:, :)   !! (4,n_faces)
    real(wp), intent(in) :: x(:, :)      !! (3,n) [length]
    integer :: f, n

    length = 0.0_wp
    do f = 1, size(faces, 2)
      n = corners_of(faces(:, f))
      length = max(length, norm2(maxval(x(:, faces(:n, f)), 2) - minval(x(:, faces(:n, f)), 2)))
    end do
  end function largest_face

  !> Boxes and normals of the master's faces, and their order along the longest axis.
  pure subroutine note_masters(sides)
    type(two_sides_t), intent(inout) :: sides
    integer :: f, k, n, pieces(4, 5), n_pieces

    n = 0
    do f = 1, size(sides%master, 2)
      call cut(sides%master(:, f), pieces, n_pieces)
      n = n + n_pieces
    end do
    allocate (sides%piece(4, n), sides%of(n), source=0)
    allocate (sides%normal(3, n))
    n = 0
    do f = 1, size(sides%master, 2)
      call cut(sides%master(:, f), pieces, n_pieces)
      sides%piece(:, n + 1:n + n_pieces) = pieces(:, :n_pieces)
      sides%of(n + 1:n + n_pieces) = f
      n = n + n_pieces
    end do
    do f = 1, n
      k = count(sides%piece(:, f) > 0)
      sides%normal(:, f) = along(area_vector(sides%y(:, sides%piece(:k, f))))
    end do
    sides%largest = largest_face(sides%piece, sides%y)
    call put_in_boxes(sides%piece, sides%y, sides%boxes)
  end subroutine note_masters

  !> The unit vector along a vector that may be none.
  pure function along(vector) result(unit)
    real(wp), intent(in) :: vector(3)
    real(wp) :: unit(3)

    unit = vector/max(norm2(vector), tiny(1.0_wp))
  end function along

  !> What may lie between a slave surface and a master of which there are only these faces.
  pure subroutine note_own_faces(sides)
    type(two_sides_t), intent(inout) :: sides
    integer :: f, k, n, pieces(4, 5), n_pieces
    integer, allocatable :: skin(:, :)

    n = size(sides%x, 2)
    sides%corner_of_row = [(k, k=1, n)]
    sides%corner_of_place = [(n + k, k=1, size(sides%y, 2))]
    sides%z = reshape([sides%x, sides%y], [3, n + size(sides%y, 2)])
    allocate (sides%body(size(sides%z, 2)), source=0)
    allocate (skin(4, 5*size(sides%slave, 2)))
    n = 0
    do f = 1, size(sides%slave, 2)
      call cut(sides%slave(:, f), pieces, n_pieces)
      skin(:, n + 1:n + n_pieces) = pieces(:, :n_pieces)
      n = n + n_pieces
    end do
    sides%skin = reshape([skin(:, :n), merge(sides%piece + size(sides%x, 2), 0, sides%piece > 0)], &
      [4, n + size(sides%piece, 2)])
  end subroutine note_own_faces

  !> Boxes of faces, and their order along the longest axis.
  pure subroutine put_in_boxes(faces, x, boxes)
    integer, intent(in) :: faces(:, :)   !! (4,n) 0 behind the corners
    real(wp), intent(in) :: x(:, :)      !! (3,n_places) [length]
    type(boxes_t), intent(out) :: boxes
    integer :: f

    allocate (boxes%low(3, size(faces, 2)), boxes%high(3, size(faces, 2)))
    do f = 1, size(faces, 2)
      associate (corner => x(:, faces(:count(faces(:, f) > 0), f)))
        boxes%low(:, f) = minval(corner, 2)
        boxes%high(:, f) = maxval(corner, 2)
      end associate
    end do
    boxes%axis = maxloc(maxval(boxes%high, 2) - minval(boxes%low, 2), dim=1)
    associate (low => boxes%low(boxes%axis, :), high => boxes%high(boxes%axis, :))
      boxes%widest = maxval(high - low)
      boxes%lowest = minval(low)
      boxes%extent = maxval(high) - boxes%lowest
      boxes%key = key_of(boxes, low)
    end associate
    call order_of(boxes%key, boxes%sorted)
    boxes%key = boxes%key(boxes%sorted)
  end subroutine put_in_boxes

  !> The boxes that meet another.
  pure subroutine find_met(boxes, low, high, met)
    type(boxes_t), intent(in) :: boxes
    real(wp), intent(in) :: low(3), high(3) !! [length]
    integer, allocatable, intent(out) :: met(:)
    integer :: first, last, i

    ! Before the first of these all lowest coordinates are below what could be near.
    first = 1 + count_below(key_of(boxes, low(boxes%axis) - boxes%widest), boxes%key)
    last = count_below(key_of(boxes, high(boxes%axis)) + 1, boxes%key)
    associate (near => boxes%sorted(first:last))
      met = pack(near, [(all(boxes%low(:, near(i)) <= high) .and. all(boxes%high(:, near(i)) >= &
        low), i=1, size(near))])
    end associate
  end subroutine find_met

  !> The area of a face along its outward normal: of the diagonals, or of a triangle's edges.
  pure function area_vector(x) result(vector)
    real(wp), intent(in) :: x(:, :) !! (3,3) or (3,4) anticlockwise from outside [length]
    real(wp) :: vector(3)           !! [length^2]

    if (size(x, 2) == 3) then
      vector = 0.5_wp*cross(x(:, 2) - x(:, 1), x(:, 3) - x(:, 1))
    else
      vector = 0.5_wp*cross(x(:, 3) - x(:, 1), x(:, 4) - x(:, 2))
    end if
  end function area_vector

  !> The integrals (11.2) and (11.3) of all faces. Where nothing is near, whatever lies opposite
  !> counts: bodies that are apart may fall any way.
  pure subroutine integrate(sides, rows)
    type(two_sides_t), intent(inout) :: sides
    type(rows_t), intent(out) :: rows
    type(part_t), allocatable :: parts(:)
    integer :: f, n

    n = size(sides%x, 2)
    allocate (parts(16), rows%entry(64))
    allocate (rows%area(n), rows%whole(n), rows%normal(3, n), rows%folds(n), rows%nearest(n))
    allocate (rows%straight(n), rows%is_torn(n), rows%seen(2, 64))
    do
      rows%n = 0
      rows%area = 0.0_wp
      rows%whole = 0.0_wp
      rows%normal = 0.0_wp
      rows%folds = .false.
      rows%nearest = huge(1.0_wp)
      rows%straight = 0.0_wp
      rows%is_torn = .false.
      rows%n_seen = 0
      do f = 1, size(sides%slave, 2)
        call add_face(sides, sides%slave(:count(sides%slave(:, f) > 0), f), parts, rows)
      end do
      if (any(rows%area > 0.0_wp) .or. sides%before > 0.5_wp*huge(1.0_wp)) exit
      sides%before = huge(1.0_wp)
    end do
    rows%of_row = lists_by_key(rows%entry(:rows%n)%row, n)
    call find_concave(sides, rows)
  end subroutine integrate

  !> Find what a piece of a slave face and the masters see of each other.
  pure subroutine find_parts(sides, piece, mine, row, axes, area, parts, n)
    type(two_sides_t), intent(in) :: sides
    integer, intent(in) :: piece     !! which of the face it is
    integer, intent(in) :: mine(:)   !! (3) or (4) rows of its corners
    integer, intent(in) :: row(:)    !! of all nodes of the face
    real(wp), intent(in) :: axes(3, 3), area !! unit vectors, the third its normal; [length^2]
    type(part_t), allocatable, intent(inout) :: parts(:) !! room for more than n
    integer, intent(inout) :: n      !! how many there are, those of pieces before it among them
    real(wp), dimension(3) :: middle, low, high
    real(wp) :: x(3, size(mine))     !! of its corners [length]
    real(wp) :: flat(2, size(mine)), place(2, 4), height(4), range(2), plane(3), along, aside
    type(shared_t) :: shared
    type(veil_t), allocatable :: veils(:), between(:)
    integer, allocatable :: met(:)
    logical, allocatable :: may_see(:)
    real(wp), parameter :: cos_45 = 0.707_wp !! of the angles of `straight` and `counts`
    real(wp) :: nearest, facing
    integer :: i, k, f, a

    x = sides%x(:, mine)
    middle = sum(x, dim=2)/real(size(x, 2), wp)
    do a = 1, size(x, 2)
      flat(:, a) = matmul(x(:, a) - middle, axes(:, :2))
    end do
    ! What the face may see lies in the prism over it.
    aside = 1.0e-6_wp*sqrt(area)
    along = max(sides%before, -sides%behind/against) + sides%largest
    if (along > 0.5_wp*huge(1.0_wp)) along = sum(max(maxval(sides%boxes%high, 2), middle) - &
      min(minval(sides%boxes%low, 2), middle))
    low = minval(x, 2) - along*abs(axes(:, 3)) - aside
    high = maxval(x, 2) + along*abs(axes(:, 3)) + aside
    call find_met(sides%boxes, low, high, met)
    allocate (may_see(size(met)))
    range = 0.0_wp
    nearest = huge(nearest)
    do i = 1, size(met)
      f = met(i)
      associate (cosine => dot_product(sides%normal(:, f), axes(:, 3)))
        may_see(i) = .not. cosine > against
        if (.not. may_see(i)) cycle
        call look_at(sides, f, middle, axes, place, height, k)
        may_see(i) = .not. (minval(height(:k)) > sides%before .or. maxval(height(:k))*cosine > &
          sides%behind)
      end associate
      may_see(i) = may_see(i) .and. .not. (any(maxval(place(:, :k), 2) < minval(flat, 2)) .or. &
        any(minval(place(:, :k), 2) > maxval(flat, 2)))
      if (may_see(i) .and. maxval(height(:k)) < -touching*sqrt(area)) may_see(i) = .not. &
        is_its_back(sides, mine, f, sum(height(:k))/k)
      if (may_see(i)) range = [min(range(1), minval(height(:k))), max(range(2), &
        maxval(height(:k)))]
    end do
    met = pack(met, may_see)
    allocate (veils(0))
    if (range(1) < -touching*sqrt(area) .or. range(2) > touching*sqrt(area)) then
      call find_veils(sides, x, flat, middle, axes, range, area, veils)
    end if
    do i = 1, size(met)
      f = met(i)
      call look_at(sides, f, middle, axes, place, height, k)
      associate (master => sides%master(:count(sides%master(:, sides%of(f)) > 0), sides%of(f)), &
                 up => matmul(transpose(axes), reshape(sides%normal(:, f), [3, 1])))
        ! Of a face, its mean plane.
        plane(2:) = -up(:2, 1)/up(3, 1)
        plane(1) = sum(height(:k))/real(k, wp) - dot_product(plane(2:), sum(place(:, :k), 2)/ &
          real(k, wp))
        between = pack(veils, [(may_hide(sides, veils(a), place(:, :k), row, master), a=1, &
          size(veils))])
        associate (body => sides%body(sides%skin(1, between%of)))
          between%is_of_slave = body == sides%body(sides%corner_of_row(row(1)))
          between%is_of_master = body == sides%body(sides%corner_of_place(master(1)))
        end associate
        do a = 1, size(between)
          if (corners_with(sides, between(a), row, master) > 0) between(a)%warp = max( &
            maxval(abs(matmul(axes(:, 3), x - spread(middle, 2, size(x, 2))))), &
            maxval(abs(height(:k) - plane(1) - matmul(plane(2:), place(:, :k)))))
        end do
        if (max(size(master), size(row)) > 4) then
          associate (slave_face => matmul(transpose(axes), sides%x(:, row) - spread(middle, 2, &
                     size(row))), master_face => matmul(transpose(axes), sides%y(:, master) - &
                     spread(middle, 2, size(master))))
            shared = integrate_shared(flat, place(:, :k), slave_face, master_face, between, plane, &
              touching*sqrt(area))
            if (shared%area > 0.0_wp) nearest = nearest_of(shared%outline, slave_face, &
              master_face, sides%x(:, row), sides%y(:, master), axes)
          end associate
          do a = 1, size(row)
            shared%facing(:, a) = matmul(axes, shared%facing(:, a))
          end do
        else
          shared = integrate_shared(flat, place(:, :k), flat, place(:, :k), between, plane, &
            touching*sqrt(area))
          if (shared%area > 0.0_wp) nearest = nearest_of(shared%outline, flat, place(:, :k), &
            sides%x(:, row), sides%y(:, sides%piece(:k, f)), sides%normal(:, f:f))
          do a = 1, 4
            shared%facing(:, a) = shared%lumped(a)*sides%normal(:, f)
          end do
        end if
      end associate
      if (.not. shared%area > 1.0e-12_wp*area) cycle
      if (n == size(parts)) parts = [parts, parts]
      n = n + 1
      facing = -dot_product(sides%normal(:, f), axes(:, 3))
      parts(n) = part_t(sides%of(f), min(1.0_wp, max(0.0_wp, (facing + against)/(cos_45 + &
        against))), nearest, min(1.0_wp, (facing - cos_45)/(cos_30 - cos_45)), piece, f, plane, &
        shared)
      if (facing < cos_45) parts(n)%straight = min(0.0_wp, 1.0_wp - sqrt(max(0.0_wp, 1.0_wp - &
        facing**2))/facing)
    end do
  end subroutine find_parts

  !> Whether what is behind a piece of a face is the other side of a wall of one body: it was right
  !> there in the mesh, deeper than the two sides are in each other, and is no less than half as
  !> deep now.
  pure logical function is_its_back(sides, mine, f, height) result(is)
    type(two_sides_t), intent(in) :: sides
    integer, intent(in) :: mine(:), f    !! rows of the piece's corners; the master's piece
    real(wp), intent(in) :: height       !! of that above the piece [length]
    real(wp) :: way(3), outward(3), middle(3), before, room
    integer :: k

    is = .false.
    if (sides%stays .or. .not. allocated(sides%node)) return
    associate (corner => sides%piece(:count(sides%piece(:, f) > 0), f))
      if (sides%body(sides%corner_of_row(mine(1))) /= sides%body(sides%corner_of_place( &
        corner(1)))) return
      middle = sum(sides%rows_at_rest(:, mine), 2)/size(mine)
      way = sum(sides%at_rest(:, corner), 2)/size(corner) - middle
      room = 0.0_wp
      do k = 1, size(corner)
        room = max(room, norm2(sides%at_rest(:, corner(k)) - middle - way))
      end do
    end associate
    room = room + maxval(norm2(sides%rows_at_rest(:, mine) - spread(middle, 2, size(mine)), dim=1))
    outward = area_vector(sides%rows_at_rest(:, mine))
    outward = outward/max(tiny(1.0_wp), norm2(outward))
    before = dot_product(way, outward)
    is = before < -sides%at_most .and. height < 0.5_wp*before .and. norm2(way - before*outward) <= &
      room - before
  end function is_its_back

  !> A piece of the master in a plane, and above it.
  pure subroutine look_at(sides, f, origin, axes, place, height, k)
    type(two_sides_t), intent(in) :: sides
    integer, intent(in) :: f
    real(wp), intent(in) :: origin(3), axes(3, 3)      !! [length], [-]
    real(wp), intent(out) :: place(2, 4), height(4)    !! [length]
    integer, intent(out) :: k                          !! corners
    integer :: a

    place = 0.0_wp
    height = 0.0_wp
    k = count(sides%piece(:, f) > 0)
    do a = 1, k
      associate (arm => sides%y(:, sides%piece(a, f)) - origin)
        place(1, a) = dot_product(arm, axes(:, 1))
        place(2, a) = dot_product(arm, axes(:, 2))
        height(a) = dot_product(arm, axes(:, 3))
      end associate
    end do
  end subroutine look_at

  !> How many corners of a veil's face are nodes of a slave face or of a master's.
  pure integer function corners_with(sides, veil, row, master) result(n)
    type(two_sides_t), intent(in) :: sides
    type(veil_t), intent(in) :: veil
    integer, intent(in) :: row(:), master(:) !! their nodes: rows, places
    integer :: k

    associate (node => sides%skin(:count(sides%skin(:, veil%of) > 0), veil%of))
      n = count([(any(sides%corner_of_row(row) == node(k)) .or. &
        any(sides%corner_of_place(master) == node(k)), k=1, size(node))])
    end associate
  end function corners_with

  !> Whether a veil is neither beside what it is to hide nor a part of either face.
  pure logical function may_hide(sides, veil, place, row, master)
    type(two_sides_t), intent(in) :: sides
    type(veil_t), intent(in) :: veil
    real(wp), intent(in) :: place(:, :)      !! (2,n) corners of the master's piece [length]
    integer, intent(in) :: row(:), master(:) !! as of corners_with
    integer :: k

    may_hide = .false.
    do k = 1, 2
      if (maxval(veil%seen%x(k, :)) <= minval(place(k, :)) .or. minval(veil%seen%x(k, :)) >= &
        maxval(place(k, :))) return
    end do
    may_hide = corners_with(sides, veil, row, master) < count(sides%skin(:, veil%of) > 0)
  end function may_hide

  !> The triangles that lie over or under a piece of a slave face, within two heights.
  pure subroutine find_veils(sides, x, flat, origin, axes, range, area, veils)
    type(two_sides_t), intent(in) :: sides
    real(wp), intent(in) :: x(:, :), flat(:, :)    !! (3,n), (2,n) corners of the piece [length]
    real(wp), intent(in) :: origin(3), axes(3, 3)  !! [length], [-]
    real(wp), intent(in) :: range(2), area         !! [length], [length^2]
    type(veil_t), allocatable, intent(inout) :: veils(:)
    integer, allocatable :: met(:)
    type(veil_t) :: veil
    real(wp) :: arm(3, 3), twice, whole
    integer :: i, k, n

    associate (up => axes(:, 3))
      call find_met(sides%skin_boxes, minval(x, 2) + min(range(1)*up, range(2)*up), &
        maxval(x, 2) + max(range(1)*up, range(2)*up), met)
    end associate
    do i = 1, size(met)
      n = count(sides%skin(:, met(i)) > 0)
      veil%of = met(i)
      ! Of four corners the four triangles about their mean.
      do k = n, merge(3, 1, n == 3), -1
        arm = sides%z(:, sides%skin([k, 1 + mod(k, n), 2], met(i)))
        if (n == 4) arm(:, 3) = sum(sides%z(:, sides%skin(:, met(i))), 2)/4.0_wp
        arm = matmul(transpose(axes), arm - spread(origin, 2, 3))
        veil%seen%x = arm(:2, :)
        veil%height = arm(3, :)
        twice = (arm(1, 2) - arm(1, 1))*(arm(2, 3) - arm(2, 1)) - (arm(2, 2) - arm(2, 1))* &
          (arm(1, 3) - arm(1, 1))
        veil%is_turned_here = twice < 0.0_wp
        if (any(maxval(arm(:2, :), 2) <= minval(flat, 2)) .or. any(minval(arm(:2, :), 2) >= &
          maxval(flat, 2))) cycle
        if (maxval(veil%height) < range(1) .or. minval(veil%height) > range(2)) cycle
        whole = norm2(cross(arm(:, 2) - arm(:, 1), arm(:, 3) - arm(:, 1)))
        veil%leans = .not. abs(twice) > -against*whole
        if (abs(twice) > max(1.0e-12_wp*area, touching*whole)) veils = [veils, veil]
      end do
    end do
  end subroutine find_veils

  !> Add what a slave face and the masters before it share.
  pure subroutine add_face(sides, row, parts, rows)
    type(two_sides_t), intent(in) :: sides
    integer, intent(in) :: row(:)         !! of its nodes
    type(part_t), allocatable, intent(inout) :: parts(:) !! to work with
    type(rows_t), intent(inout) :: rows
    real(wp), dimension(size(row), size(row)) :: dual, mass, basis
    real(wp), dimension(size(row)) :: lumped, unit, whole
    real(wp) :: axes(3, 3), area, size_of_piece, normal(3)
    real(wp) :: bare, plain !! of the face: not covered, with shape functions [-]
    real(wp) :: aslant      !! of what is covered [-]
    integer :: piece(4, 5), i, k, a, n, n_parts, n_pieces
    logical :: regular

    n = size(row)
    call cut([row, spread(0, 1, 8 - n)], piece, n_pieces)
    area = 0.0_wp
    n_parts = 0
    do i = 1, n_pieces
      associate (x => sides%x(:, piece(:count(piece(:, i) > 0), i)))
        axes(:, 3) = area_vector(x)
        size_of_piece = norm2(axes(:, 3))
        if (.not. size_of_piece > 0.0_wp) return
        area = area + size_of_piece
        axes(:, 3) = axes(:, 3)/size_of_piece
        ! A diagonal, or an edge of a triangle, less what of it is not in the plane.
        axes(:, 1) = x(:, 3) - x(:, 1) - dot_product(axes(:, 3), x(:, 3) - x(:, 1))*axes(:, 3)
        axes(:, 1) = axes(:, 1)/norm2(axes(:, 1))
        axes(:, 2) = cross(axes(:, 3), axes(:, 1))
        call find_parts(sides, i, piece(:count(piece(:, i) > 0), i), row, axes, size_of_piece, &
          parts, n_parts)
      end associate
    end do
    call find_basis(sides, row, basis)
    ! Of corners alone it is what of the face lies in its mean plane.
    normal = 0.0_wp
    if (n <= 4) normal = axes(:, 3)
    call integrate_nodes(sides%x(:, row), normal, whole)
    rows%whole(row) = rows%whole(row) + matmul(basis, whole)
    if (n_parts == 0) return
    rows%folds(row) = rows%folds(row) .or. any(parts(:n_parts)%shared%folds)
    call note_seen(sides, row, parts(:n_parts), sqrt(area), rows)
    mass = 0.0_wp
    lumped = 0.0_wp
    do i = 1, n_parts
      associate (counts => parts(i)%counts, shared => parts(i)%shared)
        shared%lumped = counts*shared%lumped
        shared%mixed = counts*shared%mixed
        shared%facing = counts*shared%facing
        mass = mass + counts*shared%mass(:n, :n)
        lumped = lumped + shared%lumped(:n)
      end associate
    end do
    if (sum(lumped) < 1.0e-9_wp*area) return
    if (n > 4) then
      mass = matmul(basis, matmul(mass, transpose(basis)))
      lumped = matmul(basis, lumped)
    end if
    bare = 1.0_wp - sum(lumped)/(sides%breadth*sum(whole))
    ! Functions of faces of eight nodes are below 0 over half of the face.
    if (n > 4 .and. corners_of(row) == 4) then
      parts(:n_parts)%straight = min(parts(:n_parts)%straight, (1.0_wp - bare)* &
        parts(:n_parts)%straight)
      bare = 0.0_wp
    end if
    aslant = 1.0_wp
    do i = 1, n_parts
      aslant = aslant - parts(i)%straight*sum(parts(i)%shared%lumped(:n))/sum(lumped)
    end do
    plain = max(0.0_wp, min(1.0_wp, (bare - 0.02_wp)/0.08_wp))*max(0.0_wp, min(1.0_wp, (1.0_wp &
      - 20.0_wp*aslant)/0.9_wp))
    dual = 0.0_wp
    do a = 1, n
      unit = 0.0_wp
      unit(a) = 1.0_wp
      if (plain < 1.0_wp) then
        call solve_small(mass, unit, dual(a, :), regular)
        if (.not. regular) return
      end if
      dual(a, :) = plain*unit + (1.0_wp - plain)*lumped(a)*dual(a, :)
      do i = 1, n
        if (i == a .or. .not. plain > 0.0_wp) cycle
        ! The row is of the places of the other nodes, too.
        call append(entry_t(row(a), -row(i), -plain*mass(a, i)), rows)
        call append(entry_t(row(a), -row(a), plain*mass(a, i)), rows)
      end do
    end do
    if (n > 4) dual = matmul(dual, basis)
    rows%area(row) = rows%area(row) + lumped
    rows%nearest(row) = min(rows%nearest(row), minval(parts(:n_parts)%nearest))
    do i = 1, n_parts
      associate (master => sides%master(:, parts(i)%master), shared => parts(i)%shared)
        rows%straight(row) = rows%straight(row) + parts(i)%straight*matmul(basis, shared%lumped(:n))
        do a = 1, n
          rows%normal(:, row(a)) = rows%normal(:, row(a)) + matmul(shared%facing(:, :n), &
            basis(a, :))
          do k = 1, count(master > 0)
            call append(entry_t(row(a), master(k), dot_product(dual(a, :), shared%mixed(:n, k))), &
              rows)
          end do
        end do
      end associate
    end do
  end subroutine add_face

  !> Note what pieces of the master the rows of a slave face see, and where it sees a step.
  pure subroutine note_seen(sides, row, parts, extent, rows)
    type(two_sides_t), intent(in) :: sides
    integer, intent(in) :: row(:)         !! of its nodes
    type(part_t), intent(in) :: parts(:)
    real(wp), intent(in) :: extent        !! of the face [length]
    type(rows_t), intent(inout) :: rows
    real(wp) :: low(2, size(parts)), high(2, size(parts))
    integer :: patch(size(parts)), i, j, k !! what common corners connect has one number

    patch = [(i, i=1, size(parts))]
    do i = 2, size(parts)
      do j = 1, i - 1
        if (patch(i) /= patch(j) .and. have_common(sides%piece(:, parts(i)%seen), &
          sides%piece(:, parts(j)%seen))) patch = merge(patch(j), patch, patch == patch(i))
      end do
    end do
    do i = 1, size(parts)
      do k = 1, size(row)
        if (rows%n_seen == size(rows%seen, 2)) rows%seen = reshape([rows%seen, rows%seen], [2, &
          2*rows%n_seen])
        rows%n_seen = rows%n_seen + 1
        rows%seen(:, rows%n_seen) = [row(k), parts(i)%seen]
      end do
      low(:, i) = minval(parts(i)%shared%outline, 2) - 0.03_wp*extent
      high(:, i) = maxval(parts(i)%shared%outline, 2) + 0.03_wp*extent
      do j = 1, i - 1
        if (all(rows%is_torn(row))) exit
        if (parts(i)%piece /= parts(j)%piece .or. patch(i) == patch(j)) cycle
        if (any(low(:, i) > high(:, j)) .or. any(low(:, j) > high(:, i))) cycle
        rows%is_torn(row) = rows%is_torn(row) .or. sees_step(view_of(sides, parts(i)), &
          view_of(sides, parts(j)), extent)
      end do
    end do
  end subroutine note_seen

  !> The rows that see both faces of a concave edge of the mesh, of which neither is of a patch
  !> smaller than a face of the slave.
  pure subroutine find_concave(sides, rows)
    type(two_sides_t), intent(in) :: sides
    type(rows_t), intent(inout) :: rows
    type(lists_t) :: of_row
    real(wp) :: normal(3, size(sides%of))
    integer :: f, i, j, row

    do f = 1, size(sides%of)
      normal(:, f) = along(area_vector(at_rest(f)))
    end do
    of_row = lists_by_key(rows%seen(1, :rows%n_seen), size(rows%is_torn))
    do row = 1, size(rows%is_torn)
      associate (seen => rows%seen(2, of_row%item(of_row%first(row):of_row%first(row + 1) - 1)))
        if (size(seen) < 2) cycle
        if (all(matmul(normal(:, seen(1)), normal(:, seen)) > cos_15)) cycle
        do i = 2, size(seen)
          do j = 1, i - 1
            if (rows%is_torn(row) .or. seen(i) == seen(j)) cycle
            if (.not. is_concave(at_rest(seen(i)), at_rest(seen(j)), normal(:, seen(i)), &
              normal(:, seen(j)))) cycle
            rows%is_torn(row) = .not. (is_small(sides, seen(i)) .or. is_small(sides, seen(j)))
          end do
        end do
      end associate
    end do

  contains

    pure function at_rest(f) result(x)
      integer, intent(in) :: f
      real(wp), allocatable :: x(:, :)

      x = sides%at_rest(:, sides%piece(:count(sides%piece(:, f) > 0), f))
    end function at_rest
  end subroutine find_concave

  pure type(view_t) function view_of(sides, part) result(view)
    type(two_sides_t), intent(in) :: sides
    type(part_t), intent(in) :: part

    view = view_t(part%shared%seen, part%plane, sides%normal(:, part%seen))
  end function view_of

  !> Whether a piece of the master is of a patch that is smaller than a face of the slave: of pieces
  !> with two corners of both that look the same way as it does, within 30 degrees.
  pure logical function is_small(sides, piece)
    type(two_sides_t), intent(in) :: sides
    integer, intent(in) :: piece
    logical :: is_in(size(sides%of))
    integer, allocatable :: met(:)
    integer :: patch(size(sides%of)), n, i, k, a
    real(wp) :: area, least

    least = 0.0_wp
    do i = 1, size(sides%slave, 2)
      associate (corners => sides%slave(:corners_of(sides%slave(:, i)), i))
        least = least + norm2(area_vector(sides%x(:, corners)))/real(size(sides%slave, 2), wp)
      end associate
    end do
    is_in = .false.
    is_in(piece) = .true.
    patch(1) = piece
    n = 1
    area = 0.0_wp
    i = 0
    do while (i < n .and. area < least)
      i = i + 1
      associate (here => sides%piece(:count(sides%piece(:, patch(i)) > 0), patch(i)))
        area = area + norm2(area_vector(sides%y(:, here)))
        call find_met(sides%boxes, minval(sides%y(:, here), 2), maxval(sides%y(:, here), 2), met)
        do k = 1, size(met)
          associate (there => sides%piece(:count(sides%piece(:, met(k)) > 0), met(k)))
            if (is_in(met(k)) .or. count([(any(there == here(a)), a=1, size(here))]) < 2) cycle
            if (dot_product(sides%normal(:, piece), sides%normal(:, met(k))) < cos_30) cycle
          end associate
          is_in(met(k)) = .true.
          n = n + 1
          patch(n) = met(k)
        end do
      end associate
    end do
    is_small = area < least
  end function is_small

  !> The functions of the points of a face as sums of shape functions: these of a node in the middle
  !> of an edge count for the ends of the edge, too.
  pure subroutine find_basis(sides, row, basis)
    type(two_sides_t), intent(in) :: sides
    integer, intent(in) :: row(:)           !! of the nodes of the face
    real(wp), intent(out) :: basis(:, :)    !! (n,n) [-]
    integer :: i

    basis = 0.0_wp
    do i = 1, size(row)
      basis(i, i) = 1.0_wp - 2.0_wp*sides%a(row(i))
      if (sides%ends(1, row(i)) == 0) cycle
      where (row == sides%ends(1, row(i)) .or. row == sides%ends(2, row(i))) basis(:, i) = &
        sides%a(row(i))
    end do
  end subroutine find_basis

  !> Where a coordinate lies along all boxes, in parts of their extent.
  pure elemental integer function key_of(boxes, coordinate) result(key)
    type(boxes_t), intent(in) :: boxes
    real(wp), intent(in) :: coordinate !! [length]
    real(wp), parameter :: parts = 1.0e9_wp

    key = 0
    if (boxes%extent > 0.0_wp) key = int(parts*max(0.0_wp, min(1.0_wp, (coordinate - &
      boxes%lowest)/boxes%extent)))
  end function key_of

  !> Where an entry of a row is.
  pure function place_of_entry(sides, entry) result(place)
    type(two_sides_t), intent(in) :: sides
    type(entry_t), intent(in) :: entry
    real(wp) :: place(3) !! [length]

    if (entry%place > 0) then
      place = sides%y(:, entry%place)
    else
      place = sides%q(:, -entry%place)
    end if
  end function place_of_entry

  pure subroutine append(entry, rows)
    type(entry_t), intent(in) :: entry
    type(rows_t), intent(inout) :: rows

    if (rows%n == size(rows%entry)) rows%entry = [rows%entry, rows%entry]
    rows%n = rows%n + 1
    rows%entry(rows%n) = entry
  end subroutine append

end module shared_faces_mod
