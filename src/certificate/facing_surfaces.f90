!> Weights, normals and gaps before surfaces and facets, from where nodes are, held against those of
!> the increment. docs/theory.md sections 6 and 11.
!>
!> Where they differ by more than rules of quadrature do, those computed here take the place of what
!> was said, and reactions and displacements are judged by them.
module facing_surfaces_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: cross, solve_small
  use surfaces_mod, only: nodes_of
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t, weights_t, is_covered, is_across, n_sides, &
    faces_of_side, find_side_points
  use state_mod, only: state_t
  use increment_report_mod, only: contact_fields_t
  use turned_slips_mod, only: orientation
  use obstacle_gaps_mod, only: frame_of
  use face_integrals_mod, only: shared_t, integrate_shared
  implicit none
  private

  public :: face_surfaces

  real(wp), parameter :: of_quadrature = 1.0e-5_wp
  !! what weights and normals may differ by, and gaps beside the width of a node; quadratures in
  !! distorted faces differ by 1e-6 [-]
  real(wp), parameter :: against = -0.2_wp !! cosine of normals that face each other, at most
  real(wp), parameter :: compared = 0.05_wp
  !! of a node's area: where less is covered the mass of a face has lost digits [-]
  real(wp), parameter :: uncovered = 1.0e30_wp !! gap of a point that nothing faces [length]

  !> A slave surface and a master where both are.
  type :: two_sides_t
    integer, allocatable :: slave(:, :)
    !! (4,n) rows, the points of a side from 1; the fourth is 0 in a triangle
    integer, allocatable :: master(:, :) !! (4,n) places; the same
    integer, allocatable :: node(:)      !! of places, where they are nodes; else not allocated
    logical :: stays = .false.           !! both are where they are in the mesh
    real(wp), allocatable :: x(:, :)     !! (3,n_rows) [length]
    real(wp), allocatable :: y(:, :)     !! (3,n_places) [length]
    real(wp) :: before = 0.0_wp, behind = 0.0_wp
    !! how far masters may be before and behind the plane of a slave face [length]
    ! Of a master face: its box, its outward normal.
    real(wp), allocatable :: low(:, :), high(:, :), normal(:, :)
    integer, allocatable :: sorted(:)    !! master faces by the lowest coordinate along `axis`
    integer :: axis = 1
    real(wp) :: widest = 0.0_wp          !! of the boxes along it [length]
    real(wp) :: largest = 0.0_wp         !! diagonal of the boxes [length]
  end type two_sides_t

  !> What the rows of a side come to.
  type :: rows_t
    real(wp), allocatable :: area(:), whole(:)  !! (n) covered, and of the node [length^2]
    real(wp), allocatable :: normal(:, :)       !! (3,n) not of unit length [length^2]
    integer :: n = 0                            !! entries
    integer, allocatable :: row(:), place(:)
    real(wp), allocatable :: part(:)            !! not yet divided by the row's area [length^2]
    integer, allocatable :: first(:), entry(:)  !! (n+1), (entries) those of each row
  end type rows_t

  !> What a slave face shares with master faces.
  type :: parts_t
    integer :: n = 0
    integer, allocatable :: master(:)
    real(wp), allocatable :: away(:)     !! from the slave's plane [length]
    type(shared_t), allocatable :: shared(:)
  end type parts_t

contains

  !> Hold all points before surfaces and facets against places.
  pure subroutine face_surfaces(scene, points, old, new, contact)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(state_t), intent(in) :: old, new
    type(contact_fields_t), intent(inout) :: contact
    type(two_sides_t) :: sides
    type(rows_t) :: rows
    integer :: pair, side

    do pair = 1, size(scene%pairs)
      if (points%first(pair + 1) == points%first(pair)) cycle
      if (.not. points%on_surface(points%first(pair))) cycle
      if (size(scene%surfaces(scene%pairs(pair)%surface)%faces, 2) == 0) cycle
      do side = 1, n_sides(points, pair)
        call put_together(scene, points, pair, side, new, sides)
        call integrate(sides, rows)
        call compare(scene, points, pair, side, old, new, sides, rows, contact)
      end do
    end do
  end subroutine face_surfaces

  !> Where the faces of a pair are; with small sliding where they are in the mesh.
  pure subroutine put_together(scene, points, pair, side, new, sides)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair, side
    type(state_t), intent(in) :: new
    type(two_sides_t), intent(out) :: sides
    integer :: row_of(0:scene%mesh%n_nodes), first, last, i, k
    integer, allocatable :: faces(:), place_of(:)
    real(wp), allocatable :: way(:, :)  !! of the places [length]
    real(wp) :: reach, axes(3, 3)

    call find_side_points(points, pair, side, first, last)
    call faces_of_side(points, pair, side, faces)
    associate (mesh => scene%mesh, of => scene%pairs(pair), node => points%node(first:last))
      row_of(0) = 0
      row_of(node) = [(i, i=1, size(node))]
      sides%slave = nodes_of(scene%surfaces(of%surface)%faces, mesh%connectivity)
      do i = 1, size(sides%slave, 2)
        sides%slave(:, i) = row_of(sides%slave(:, i))
      end do
      sides%x = mesh%coordinates(:, node)
      if (of%master == 0) then
        sides%master = nodes_of(scene%surfaces(of%master_surface)%faces, mesh%connectivity)
      else
        sides%master = scene%obstacles(of%master)%facet
      end if
      if (allocated(faces)) sides%master = sides%master(:, faces)
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
      reach = 0.5_wp*max(largest_face(sides%slave, sides%x), largest_face(sides%master, sides%y))
      sides%stays = of%small_sliding .and. of%master == 0
      if (.not. sides%stays) then
        sides%x = sides%x + new%displacement(:, node)
        sides%y = sides%y + way
        if (of%master > 0) reach = 0.5_wp*max(largest_face(sides%slave, sides%x), &
          largest_face(sides%master, sides%y))
        associate (u => new%displacement(:, node))
          reach = reach + norm2(max(maxval(u, 2) - minval(way, 2), maxval(way, 2) - minval(u, 2)))
        end associate
      end if
      sides%behind = reach + of%overlap
      sides%before = sides%behind
      if (sides%stays) sides%before = huge(1.0_wp)
    end associate
    call note_masters(sides)
  end subroutine put_together

  !> The longest diagonal of the boxes of faces.
  pure real(wp) function largest_face(faces, x) result(length)
    integer, intent(in) :: faces(:, :)   !! (4,n_faces)
    real(wp), intent(in) :: x(:, :)      !! (3,n) [length]
    integer :: f, n

    length = 0.0_wp
    do f = 1, size(faces, 2)
      n = count(faces(:, f) > 0)
      length = max(length, norm2(maxval(x(:, faces(:n, f)), 2) - minval(x(:, faces(:n, f)), 2)))
    end do
  end function largest_face

  !> Boxes and normals of the master's faces, and their order along the longest axis.
  pure subroutine note_masters(sides)
    type(two_sides_t), intent(inout) :: sides
    integer :: f, k, n

    n = size(sides%master, 2)
    allocate (sides%low(3, n), sides%high(3, n), sides%normal(3, n))
    do f = 1, n
      k = count(sides%master(:, f) > 0)
      associate (y => sides%y(:, sides%master(:k, f)))
        sides%low(:, f) = minval(y, 2)
        sides%high(:, f) = maxval(y, 2)
        sides%normal(:, f) = area_vector(y)
        sides%normal(:, f) = sides%normal(:, f)/max(norm2(sides%normal(:, f)), tiny(1.0_wp))
      end associate
    end do
    sides%axis = maxloc(maxval(sides%high, 2) - minval(sides%low, 2), dim=1)
    sides%largest = largest_face(sides%master, sides%y)
    sides%widest = maxval(sides%high(sides%axis, :) - sides%low(sides%axis, :))
    sides%sorted = [(f, f=1, n)]
    call sort_by(sides%low(sides%axis, :), sides%sorted)
  end subroutine note_masters

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

  !> Order numbers by keys, runs merged from the bottom up.
  pure subroutine sort_by(key, number)
    real(wp), intent(in) :: key(:)
    integer, intent(inout) :: number(:)
    integer :: merged(size(number)), width, low, middle, high, i, j, k

    width = 1
    do while (width < size(number))
      do low = 1, size(number), 2*width
        middle = min(low + width, size(number) + 1)
        high = min(low + 2*width, size(number) + 1)
        i = low
        j = middle
        do k = low, high - 1
          if (i < middle) then
            if (j >= high) then
              merged(k) = number(i)
              i = i + 1
              cycle
            else if (key(number(i)) <= key(number(j))) then
              merged(k) = number(i)
              i = i + 1
              cycle
            end if
          end if
          merged(k) = number(j)
          j = j + 1
        end do
      end do
      number = merged
      width = 2*width
    end do
  end subroutine sort_by

  !> The integrals (11.2) and (11.3) of all faces. Where nothing is near, whatever lies opposite
  !> counts: bodies that are apart may fall any way.
  pure subroutine integrate(sides, rows)
    type(two_sides_t), intent(inout) :: sides
    type(rows_t), intent(out) :: rows
    type(parts_t) :: parts
    integer :: f, n, k

    n = size(sides%x, 2)
    allocate (parts%master(16), parts%away(16), parts%shared(16))
    allocate (rows%area(n), rows%whole(n), rows%normal(3, n))
    allocate (rows%row(64), rows%place(64), rows%part(64))
    do
      rows%n = 0
      rows%area = 0.0_wp
      rows%whole = 0.0_wp
      rows%normal = 0.0_wp
      do f = 1, size(sides%slave, 2)
        call add_face(sides, sides%slave(:count(sides%slave(:, f) > 0), f), parts, rows)
      end do
      if (any(rows%area > 0.0_wp) .or. sides%before > 0.5_wp*huge(1.0_wp)) exit
      sides%before = huge(1.0_wp)
    end do
    allocate (rows%first(n + 1), rows%entry(rows%n), source=0)
    do k = 1, rows%n
      rows%first(rows%row(k)) = rows%first(rows%row(k)) + 1
    end do
    ! From where each row ends back to where it begins.
    do k = 2, n + 1
      rows%first(k) = rows%first(k) + rows%first(k - 1)
    end do
    rows%first = rows%first + 1
    do k = rows%n, 1, -1
      rows%first(rows%row(k)) = rows%first(rows%row(k)) - 1
      rows%entry(rows%first(rows%row(k))) = k
    end do
  end subroutine integrate

  !> Find what a slave face shares with the masters before it.
  pure subroutine find_parts(sides, x, axes, area, parts)
    type(two_sides_t), intent(in) :: sides
    real(wp), intent(in) :: x(:, :)  !! (3,3) or (3,4) corners of the face [length]
    real(wp), intent(in) :: axes(3, 3), area !! unit vectors, the third its normal; [length^2]
    type(parts_t), intent(inout) :: parts
    real(wp) :: middle(3), flat(2, size(x, 2)), place(2, 4), height(4), low(3), high(3), along, aside
    type(shared_t) :: shared
    integer :: i, k, f, a

    middle = sum(x, dim=2)/real(size(x, 2), wp)
    do a = 1, size(x, 2)
      flat(:, a) = matmul(x(:, a) - middle, axes(:, :2))
    end do
    ! What covers the face lies in the prism over it.
    aside = 1.0e-6_wp*sqrt(area)
    along = max(sides%before, sides%behind) + sides%largest
    if (along > 0.5_wp*huge(1.0_wp)) along = sum(max(maxval(sides%high, 2), middle) - &
      min(minval(sides%low, 2), middle))
    low = minval(x, 2) - along*abs(axes(:, 3)) - aside
    high = maxval(x, 2) + along*abs(axes(:, 3)) + aside
    parts%n = 0
    do i = first_from(sides, low(sides%axis) - sides%widest), size(sides%sorted)
      f = sides%sorted(i)
      if (sides%low(sides%axis, f) > high(sides%axis)) exit
      if (any(sides%low(:, f) > high) .or. any(sides%high(:, f) < low)) cycle
      if (dot_product(sides%normal(:, f), axes(:, 3)) > against) cycle
      k = count(sides%master(:, f) > 0)
      do a = 1, k
        associate (arm => sides%y(:, sides%master(a, f)) - middle)
          place(:, a) = matmul(arm, axes(:, :2))
          height(a) = dot_product(arm, axes(:, 3))
        end associate
      end do
      if (minval(height(:k)) > sides%before .or. maxval(height(:k)) < -sides%behind) cycle
      if (any(maxval(place(:, :k), 2) < minval(flat, 2)) .or. any(minval(place(:, :k), 2) > &
        maxval(flat, 2))) cycle
      shared = integrate_shared(flat, place(:, :k))
      if (.not. shared%area > 1.0e-12_wp*area) cycle
      if (parts%n == size(parts%master)) then
        parts%master = [parts%master, parts%master]
        parts%away = [parts%away, parts%away]
        parts%shared = [parts%shared, parts%shared]
      end if
      parts%n = parts%n + 1
      parts%master(parts%n) = f
      parts%away(parts%n) = abs(sum(height(:k)))/real(k, wp)
      parts%shared(parts%n) = shared
    end do
    ! Of a master behind another nothing is faced.
    do while (parts%n > 0)
      if (sum(parts%shared(:parts%n)%area) <= (1.0_wp + 1.0e-6_wp)*area) exit
      k = maxloc(parts%away(:parts%n), dim=1)
      parts%master(k) = parts%master(parts%n)
      parts%away(k) = parts%away(parts%n)
      parts%shared(k) = parts%shared(parts%n)
      parts%n = parts%n - 1
    end do
  end subroutine find_parts

  !> Add what a slave face and the masters before it share.
  pure subroutine add_face(sides, row, parts, rows)
    type(two_sides_t), intent(in) :: sides
    integer, intent(in) :: row(:)         !! of its corners
    type(parts_t), intent(inout) :: parts !! to work with
    type(rows_t), intent(inout) :: rows
    real(wp), dimension(size(row), size(row)) :: dual, mass
    real(wp), dimension(size(row)) :: lumped, unit
    real(wp) :: x(3, size(row)), axes(3, 3), area
    integer :: i, k, a, n
    logical :: regular

    n = size(row)
    x = sides%x(:, row)
    axes(:, 3) = area_vector(x)
    area = norm2(axes(:, 3))
    if (.not. area > 0.0_wp) return
    axes(:, 3) = axes(:, 3)/area
    ! A diagonal, or an edge of a triangle, less what of it is not in the plane.
    axes(:, 1) = x(:, 3) - x(:, 1) - dot_product(axes(:, 3), x(:, 3) - x(:, 1))*axes(:, 3)
    axes(:, 1) = axes(:, 1)/norm2(axes(:, 1))
    axes(:, 2) = cross(axes(:, 3), axes(:, 1))
    rows%whole(row) = rows%whole(row) + area/real(n, wp)
    call find_parts(sides, x, axes, area, parts)
    if (parts%n == 0) return
    mass = 0.0_wp
    lumped = 0.0_wp
    do i = 1, parts%n
      mass = mass + parts%shared(i)%mass(:n, :n)
      lumped = lumped + parts%shared(i)%lumped(:n)
    end do
    if (sum(lumped) < 1.0e-9_wp*area) return
    do a = 1, n
      unit = 0.0_wp
      unit(a) = 1.0_wp
      call solve_small(mass, unit, dual(a, :), regular)
      if (.not. regular) return
      dual(a, :) = lumped(a)*dual(a, :)
    end do
    rows%area(row) = rows%area(row) + lumped
    do i = 1, parts%n
      associate (master => sides%master(:, parts%master(i)), shared => parts%shared(i))
        do a = 1, n
          rows%normal(:, row(a)) = rows%normal(:, row(a)) + shared%lumped(a)* &
            sides%normal(:, parts%master(i))
          do k = 1, count(master > 0)
            call append(row(a), master(k), dot_product(dual(a, :), shared%mixed(:n, k)), rows)
          end do
        end do
      end associate
    end do
  end subroutine add_face

  !> The first of the sorted master faces whose lowest coordinate is not below a value.
  pure integer function first_from(sides, value) result(first)
    type(two_sides_t), intent(in) :: sides
    real(wp), intent(in) :: value !! [length]
    integer :: high, middle

    first = 1
    high = size(sides%sorted) + 1
    do while (first < high)
      middle = (first + high)/2
      if (sides%low(sides%axis, sides%sorted(middle)) < value) then
        first = middle + 1
      else
        high = middle
      end if
    end do
  end function first_from

  pure subroutine append(row, place, part, rows)
    integer, intent(in) :: row, place
    real(wp), intent(in) :: part !! [length^2]
    type(rows_t), intent(inout) :: rows

    if (rows%n == size(rows%row)) then
      rows%row = [rows%row, rows%row]
      rows%place = [rows%place, rows%place]
      rows%part = [rows%part, rows%part]
    end if
    rows%n = rows%n + 1
    rows%row(rows%n) = row
    rows%place(rows%n) = place
    rows%part(rows%n) = part
  end subroutine append

  !> Points that are left as they are: by nodes that hang, by sides that cannot move apart, and by
  !> constraints rows are others than (11.2).
  pure function is_left(scene, points, first, sides, contact) result(left)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: first
    type(two_sides_t), intent(in) :: sides
    type(contact_fields_t), intent(in) :: contact
    logical :: left(size(sides%x, 2)), is_other(size(sides%x, 2))
    integer :: i, f

    is_other = .false.
    left = .false.
    do i = 1, size(left)
      associate (point => first + i - 1)
        if (allocated(points%is_joined)) left(i) = points%is_joined(point)
        if (allocated(scene%mesh%hangs)) is_other(i) = scene%mesh%hangs(points%node(point))
        if (.not. allocated(points%freedom) .or. contact%weights%covers(point)) cycle
        is_other(i) = is_other(i) .or. points%freedom%is_bound(points%node(point))
      end associate
    end do
    do f = 1, size(sides%slave, 2)
      associate (row => sides%slave(:count(sides%slave(:, f) > 0), f))
        if (any(is_other(row))) left(row) = .true.
      end associate
    end do
    if (allocated(scene%mesh%hangs)) then
      ! What a node has that hangs goes to nodes that other faces have, too.
      do i = 1, size(left)
        associate (node => points%node(first + i - 1))
          if (scene%mesh%hangs(node)) then
            do f = 1, size(left)
              left(f) = left(f) .or. any(scene%mesh%between(:, node - scene%mesh%n_given) == &
                points%node(first + f - 1))
            end do
          end if
        end associate
      end do
    end if
  end function is_left

  !> Hold the rows of a side against those of the increment.
  pure subroutine compare(scene, points, pair, side, old, new, sides, rows, contact)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair, side
    type(state_t), intent(in) :: old, new
    type(two_sides_t), intent(in) :: sides
    type(rows_t), intent(in) :: rows
    type(contact_fields_t), intent(inout) :: contact
    type(weights_t) :: found
    real(wp) :: normal(3), arm(3), motion(3), gap, area, sum_of_weights, changed, &
      weight(scene%mesh%n_nodes)
    logical :: left(size(sides%x, 2)), differs(size(sides%x, 2))
    integer :: first, last, i, k, n

    call find_side_points(points, pair, side, first, last)
    left = is_left(scene, points, first, sides, contact)
    differs = .false.
    weight = 0.0_wp
    allocate (found%first(size(left) + 1), found%node(rows%n + size(left)), &
      found%weight(rows%n + size(left)))
    n = 0
    do i = first, last
      associate (here => i - first + 1, whole => rows%whole(i - first + 1))
        found%first(here) = n + 1
        area = rows%area(here)
        if (left(here) .or. .not. whole > 0.0_wp) cycle
        normal = rows%normal(:, here)
        where (is_across(points, i)) normal = 0.0_wp
        if (is_covered(points, contact%weights, i)) then
          differs(here) = abs(area - contact%covered_area(i)) > of_quadrature*whole
        else
          differs(here) = area > compared*whole .and. norm2(normal) > compared*area
        end if
        if (differs(here) .and. .not. norm2(normal) > 0.0_wp) then
          contact%gap(i) = uncovered
          differs(here) = .false.
          cycle
        end if
        if (.not. differs(here) .and. (area <= compared*whole .or. .not. is_covered(points, &
          contact%weights, i))) cycle
        normal = normal/norm2(normal)
        call find_row(scene, pair, sides, rows, here, found, n)
        found%first(here + 1) = n + 1
        arm = matmul(sides%y(:, rows%place(rows%entry(rows%first(here):rows%first(here + 1) - 1))), &
          rows%part(rows%entry(rows%first(here):rows%first(here + 1) - 1)))/area
        arm = sides%x(:, here) - arm
        motion = relative_motion(found, here, points%node(i), new%displacement)
        if (sides%stays) arm = arm + motion
        gap = dot_product(normal, arm) + points%extra_gap(i)
        sum_of_weights = 0.0_wp
        do k = found%first(here), n
          weight(found%node(k)) = weight(found%node(k)) + found%weight(k)
          sum_of_weights = sum_of_weights + abs(found%weight(k))
        end do
        do k = contact%weights%first(i), contact%weights%first(i + 1) - 1
          weight(contact%weights%node(k)) = weight(contact%weights%node(k)) - &
            contact%weights%weight(k)
        end do
        changed = 0.0_wp
        call take_out(found%node(found%first(here):n), weight, changed)
        call take_out(contact%weights%node(contact%weights%first(i):contact%weights%first(i + 1) - &
          1), weight, changed)
        differs(here) = differs(here) .or. norm2(normal - contact%frame(:, 1, i)) > of_quadrature &
          .or. abs(gap - contact%gap(i)) > of_quadrature*sqrt(area) .or. &
          changed > of_quadrature*max(1.0_wp, sum_of_weights)
        if (.not. differs(here)) cycle
        motion = motion - relative_motion(found, here, points%node(i), old%displacement)
        contact%frame(:, :, i) = frame_of(normal)
        contact%gap(i) = gap
        contact%reaction(:, i) = matmul(new%reaction(:, i), contact%frame(:, :, i))
        contact%slip_increment(:, i) = matmul(motion, contact%frame(:, 2:, i))
      end associate
    end do
    found%first(size(left) + 1) = n + 1
    if (any(differs)) call put_rows(first, differs, found, contact%weights)
  end subroutine compare

  !> Add up what is left in `weight` at nodes, and take it out.
  pure subroutine take_out(nodes, weight, total)
    integer, intent(in) :: nodes(:)
    real(wp), intent(inout) :: weight(:) !! (n_nodes) [-]
    real(wp), intent(inout) :: total
    integer :: l

    do l = 1, size(nodes)
      total = total + abs(weight(nodes(l)))
      weight(nodes(l)) = 0.0_wp
    end do
  end subroutine take_out

  !> The weights of a row: of the master's nodes, or of the reference node that facets move with.
  pure subroutine find_row(scene, pair, sides, rows, here, found, n)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: pair
    type(two_sides_t), intent(in) :: sides
    type(rows_t), intent(in) :: rows
    integer, intent(in) :: here
    type(weights_t), intent(inout) :: found
    integer, intent(inout) :: n !! entries so far
    integer :: k, l, node

    if (scene%pairs(pair)%master > 0) then
      associate (ref_node => scene%obstacles(scene%pairs(pair)%master)%ref_node)
        if (ref_node == 0) return
        n = n + 1
        found%node(n) = ref_node
        found%weight(n) = 1.0_wp
      end associate
      return
    end if
    do k = rows%first(here), rows%first(here + 1) - 1
      node = sides%node(rows%place(rows%entry(k)))
      do l = found%first(here), n
        if (found%node(l) == node) exit
      end do
      if (l > n) then
        n = l
        found%node(n) = node
        found%weight(n) = 0.0_wp
      end if
      found%weight(l) = found%weight(l) + rows%part(rows%entry(k))/rows%area(here)
    end do
  end subroutine find_row

  !> Displacement of a node less that of what it faces.
  pure function relative_motion(rows, here, node, u) result(motion)
    type(weights_t), intent(in) :: rows
    integer, intent(in) :: here, node
    real(wp), intent(in) :: u(:, :)  !! (3,n_nodes) [length]
    real(wp) :: motion(3)            !! [length]
    integer :: k

    motion = u(:, node)
    do k = rows%first(here), rows%first(here + 1) - 1
      motion = motion - rows%weight(k)*u(:, rows%node(k))
    end do
  end function relative_motion

  !> Put rows that differ in the place of those that were said.
  pure subroutine put_rows(first, differs, found, weights)
    integer, intent(in) :: first              !! point
    logical, intent(in) :: differs(:)         !! (n) of the points from there
    type(weights_t), intent(in) :: found      !! (n) rows
    type(weights_t), intent(inout) :: weights !! of all points
    type(weights_t) :: before
    integer :: i, here, n
    logical :: is_found

    before = weights
    deallocate (weights%node, weights%weight)
    allocate (weights%node(size(before%node) + size(found%node)), &
      weights%weight(size(before%node) + size(found%node)))
    n = 0
    do i = 1, size(before%first) - 1
      here = i - first + 1
      weights%first(i) = n + 1
      is_found = here >= 1 .and. here <= size(differs)
      if (is_found) is_found = differs(here)
      if (is_found) then
        call copy_row(found, here, weights, n)
        weights%covers(i) = .true.
      else
        call copy_row(before, i, weights, n)
      end if
    end do
    weights%first(size(before%first)) = n + 1
  end subroutine put_rows

  !> Put a row behind `n` entries.
  pure subroutine copy_row(from, row, to, n)
    type(weights_t), intent(in) :: from
    integer, intent(in) :: row
    type(weights_t), intent(inout) :: to
    integer, intent(inout) :: n

    associate (first => from%first(row), last => from%first(row + 1) - 1)
      to%node(n + 1:n + last - first + 1) = from%node(first:last)
      to%weight(n + 1:n + last - first + 1) = from%weight(first:last)
      n = n + last - first + 1
    end associate
  end subroutine copy_row

end module facing_surfaces_mod
