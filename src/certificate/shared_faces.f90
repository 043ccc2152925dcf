!> Faces of a pair where they are at the end of an increment, and the integrals over what they
!> share, for the certificate. docs/theory.md (11.1) to (11.3).
module shared_faces_mod
  use kinds_mod, only: wp
  use lists_mod, only: lists_t, lists_by_key
  use small_matrix_mod, only: cross, solve_small
  use sorting_mod, only: order_of
  use surfaces_mod, only: nodes_of
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t, faces_of_side, find_side_points
  use state_mod, only: state_t
  use turned_slips_mod, only: orientation
  use face_integrals_mod, only: shared_t, integrate_shared
  implicit none
  private

  public :: two_sides_t, rows_t, put_together, integrate

  real(wp), parameter :: against = -0.2_wp !! cosine of normals that face each other, at most

  !> A slave surface and a master where both are.
  type :: two_sides_t
    integer :: pair = 0
    integer :: first = 0, last = 0       !! points
    integer, allocatable :: slave(:, :)
    !! (4,n) rows, the points of a side from 1; the fourth is 0 in a triangle
    integer, allocatable :: master(:, :) !! (4,n) places; the same
    integer, allocatable :: node(:)      !! of places, where they are nodes; else not allocated
    logical :: stays = .false.           !! both are where they are in the mesh
    real(wp), allocatable :: x(:, :)     !! (3,n_rows) [length]
    real(wp), allocatable :: y(:, :)     !! (3,n_places) [length]
    real(wp) :: before = 0.0_wp, behind = 0.0_wp
    !! how far masters may be before and behind the plane of a slave face [length]
    real(wp), allocatable :: low(:, :), high(:, :) !! (3,n) box of each master face [length]
    real(wp), allocatable :: normal(:, :)          !! (3,n) and its outward normal [-]
    integer, allocatable :: sorted(:)    !! master faces by the lowest coordinate along `axis`
    integer, allocatable :: key(:)       !! of the sorted faces, as of `key_of`
    integer :: axis = 1
    real(wp) :: lowest = 0.0_wp, extent = 0.0_wp !! of the master along it [length]
    real(wp) :: widest = 0.0_wp          !! of the boxes along it [length]
    real(wp) :: largest = 0.0_wp         !! diagonal of the boxes [length]
  end type two_sides_t

  !> What a master's place has in a row, not yet divided by the row's area.
  type :: entry_t
    integer :: row = 0, place = 0
    real(wp) :: part = 0.0_wp      !! [length^2]
  end type entry_t

  !> What the rows of a side come to.
  type :: rows_t
    real(wp), allocatable :: area(:), whole(:)  !! (n) covered, and of the node [length^2]
    real(wp), allocatable :: normal(:, :)       !! (3,n) not of unit length [length^2]
    integer :: n = 0                            !! entries
    type(entry_t), allocatable :: entry(:)      !! room for more than n
    type(lists_t) :: of_row                     !! the entries of each row
  end type rows_t

  !> What a slave face shares with a master face.
  type :: part_t
    integer :: master = 0
    real(wp) :: away = 0.0_wp      !! from the slave's plane [length]
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
    real(wp) :: reach, axes(3, 3)

    sides%pair = pair
    call find_side_points(points, pair, side, sides%first, sides%last)
    call faces_of_side(points, pair, side, faces)
    associate (mesh => scene%mesh, of => scene%pairs(pair), &
               node => points%node(sides%first:sides%last))
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
    sides%lowest = minval(sides%low(sides%axis, :))
    sides%extent = maxval(sides%high(sides%axis, :)) - sides%lowest
    sides%key = key_of(sides, sides%low(sides%axis, :))
    call order_of(sides%key, sides%sorted)
    sides%key = sides%key(sides%sorted)
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

  !> The integrals (11.2) and (11.3) of all faces. Where nothing is near, whatever lies opposite
  !> counts: bodies that are apart may fall any way.
  pure subroutine integrate(sides, rows)
    type(two_sides_t), intent(inout) :: sides
    type(rows_t), intent(out) :: rows
    type(part_t), allocatable :: parts(:)
    integer :: f, n

    n = size(sides%x, 2)
    allocate (parts(16), rows%entry(64))
    allocate (rows%area(n), rows%whole(n), rows%normal(3, n))
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
    rows%of_row = lists_by_key(rows%entry(:rows%n)%row, n)
  end subroutine integrate

  !> Find what a slave face shares with the masters before it.
  pure subroutine find_parts(sides, x, axes, area, parts, n)
    type(two_sides_t), intent(in) :: sides
    real(wp), intent(in) :: x(:, :)  !! (3,3) or (3,4) corners of the face [length]
    real(wp), intent(in) :: axes(3, 3), area !! unit vectors, the third its normal; [length^2]
    type(part_t), allocatable, intent(inout) :: parts(:) !! room for more than n
    integer, intent(out) :: n        !! how many there are
    real(wp), dimension(3) :: middle, low, high
    real(wp) :: flat(2, size(x, 2)), place(2, 4), height(4), along, aside
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
    n = 0
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
      if (n == size(parts)) parts = [parts, parts]
      n = n + 1
      parts(n) = part_t(f, abs(sum(height(:k)))/real(k, wp), shared)
    end do
    ! Of a master behind another nothing is faced.
    do while (n > 0)
      if (sum(parts(:n)%shared%area) <= (1.0_wp + 1.0e-6_wp)*area) exit
      parts(maxloc(parts(:n)%away, dim=1)) = parts(n)
      n = n - 1
    end do
  end subroutine find_parts

  !> Add what a slave face and the masters before it share.
  pure subroutine add_face(sides, row, parts, rows)
    type(two_sides_t), intent(in) :: sides
    integer, intent(in) :: row(:)         !! of its corners
    type(part_t), allocatable, intent(inout) :: parts(:) !! to work with
    type(rows_t), intent(inout) :: rows
    real(wp), dimension(size(row), size(row)) :: dual, mass
    real(wp), dimension(size(row)) :: lumped, unit
    real(wp) :: x(3, size(row)), axes(3, 3), area
    integer :: i, k, a, n, n_parts
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
    call find_parts(sides, x, axes, area, parts, n_parts)
    if (n_parts == 0) return
    mass = 0.0_wp
    lumped = 0.0_wp
    do i = 1, n_parts
      mass = mass + parts(i)%shared%mass(:n, :n)
      lumped = lumped + parts(i)%shared%lumped(:n)
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
    do i = 1, n_parts
      associate (master => sides%master(:, parts(i)%master), shared => parts(i)%shared)
        do a = 1, n
          rows%normal(:, row(a)) = rows%normal(:, row(a)) + shared%lumped(a)* &
            sides%normal(:, parts(i)%master)
          do k = 1, count(master > 0)
            call append(entry_t(row(a), master(k), dot_product(dual(a, :), shared%mixed(:n, k))), &
              rows)
          end do
        end do
      end associate
    end do
  end subroutine add_face

  !> Where a coordinate lies along the master, in parts of its extent.
  pure elemental integer function key_of(sides, coordinate) result(key)
    type(two_sides_t), intent(in) :: sides
    real(wp), intent(in) :: coordinate !! [length]
    real(wp), parameter :: parts = 1.0e9_wp

    key = 0
    if (sides%extent > 0.0_wp) key = int(parts*max(0.0_wp, min(1.0_wp, (coordinate - &
      sides%lowest)/sides%extent)))
  end function key_of

  !> A place among the sorted master faces; before it all lowest coordinates are below a value.
  pure integer function first_from(sides, value) result(first)
    type(two_sides_t), intent(in) :: sides
    real(wp), intent(in) :: value !! [length]
    integer :: high, middle, key

    key = key_of(sides, value)
    first = 1
    high = size(sides%key) + 1
    do while (first < high)
      middle = (first + high)/2
      if (sides%key(middle) < key) then
        first = middle + 1
      else
        high = middle
      end if
    end do
  end function first_from

  pure subroutine append(entry, rows)
    type(entry_t), intent(in) :: entry
    type(rows_t), intent(inout) :: rows

    if (rows%n == size(rows%entry)) rows%entry = [rows%entry, rows%entry]
    rows%n = rows%n + 1
    rows%entry(rows%n) = entry
  end subroutine append

end module shared_faces_mod
