!> Weights of a master's nodes for the nodes of a slave surface: a mortar with dual multipliers,
!> over the part of each slave face that the master covers.
!>
!> docs/theory.md (11.1) to (11.4).
module mortar_mod
  use kinds_mod, only: wp
  use growing_lists_mod, only: enlarge
  use lists_mod, only: lists_t, lists_by_key
  use cells_mod, only: face_corners
  use connectivity_mod, only: corners_in
  use small_matrix_mod, only: solve_small
  use contact_points_mod, only: weights_t
  use face_grid_mod, only: face_grid_t, make_face_grid, faces_near
  use face_overlap_mod, only: overlap_t, plane_t, plane_of_face, outward_normal, find_overlap, &
    opposite_weights
  implicit none
  private

  public :: mortar_t, slave_t, opposite_t, make_mortar, take_up_shifts, reach_of_faces, &
    reach_of_all, face_each_other, enough

  !> The place of the master that lies opposite a slave node.
  type :: opposite_t
    integer :: n = 0                !! 0: none does
    integer :: node(face_corners) = 0          !! of the master's face
    real(wp) :: weight(face_corners) = 0.0_wp  !! its shape functions there [-]
    real(wp) :: beyond = 0.1_wp
    !! how far beyond its edges, beside the face; further away is not opposite: strains do not move
    !! an edge so far [-]
  end type opposite_t

  !> What the nodes of a slave surface face.
  type :: mortar_t
    type(weights_t) :: weights              !! a row a slave node; empty where nothing covers it
    real(wp), allocatable :: area(:)        !! (n) of the node, as far as it is covered [length^2]
    real(wp), allocatable :: whole_area(:)  !! (n) of the node [length^2]
    real(wp), allocatable :: faced_area(:)
    !! (n) of that what is turned towards the master: as seen along the normal, 0: not covered
    !! [length^2]
    real(wp), allocatable :: normal(:, :)   !! (3,n) from master to slave, 0: not covered [-]
    real(wp), allocatable :: outward(:, :) !! (3,n) of the slave surface, the mean of its faces [-]
    real(wp), allocatable :: apart(:, :)
    !! (3,n) place of the node less that of what it faces, 0: not covered [length]
    real(wp), allocatable :: entered(:)
    !! (n) integral of the gap over the node's faces where it is below 0, with the node's shape
    !! function [length^3]
    real(wp), allocatable :: least_gap(:)
    !! (n) at the points of the quadrature on the node's faces, huge where there are none [length]
    type(opposite_t), allocatable :: opposite(:)
    !! (n) where the slave asks for it, else not allocated
  end type mortar_t

  !> A slave surface.
  type :: slave_t
    integer, allocatable :: faces(:, :)
    !! (4,n_slave) nodes, anticlockwise from outside; the fourth is 0 in a triangle
    integer, allocatable :: nodes(:)      !! (n) each once, in the order of the rows
    integer, allocatable :: hanging(:, :)
    !! (5,m) of these the nodes that hang, with the two or four that they lie between: these get
    !! what they have, and they are not covered
    logical, allocatable :: asks(:)     !! (n) for what lies opposite; not allocated: none does
    logical, allocatable :: is_fixed(:)
    !! (n) the node has no multiplier: its neighbours get what it has; not allocated: none
  end type slave_t

  !> Contributions to rows, in any order. There may be more room in the arrays.
  type :: entries_t
    integer :: n = 0
    integer, allocatable :: row(:), node(:)
    real(wp), allocatable :: weight(:) !! not yet divided by the node's area [length^2]
  end type entries_t

  !> A covered part of a slave face.
  type :: part_t
    integer :: node(face_corners) = 0 !! of the master face
    integer :: n = 0              !! how many there are
    real(wp) :: distance = 0.0_wp !! of its middle from the slave's plane [length]
    type(overlap_t) :: overlap
  end type part_t

  !> A slave face. What its last corner would have is 0 in a triangle.
  type :: face_t
    integer :: n = 0                               !! corners
    integer :: node(face_corners) = 0
    integer :: row(face_corners) = 0               !! of the nodes
    real(wp) :: x(3, face_corners) = 0.0_wp        !! where they are [length]
    real(wp) :: area = 0.0_wp                      !! [length^2]
    real(wp) :: given(face_corners, face_corners) = 0.0_wp !! as of `what_neighbours_get` [-]
  end type face_t

  real(wp), parameter :: against = -0.2_wp      !! cosine of normals that face each other, at most
  real(wp), parameter :: enough = 1.0e-3_wp     !! of a node's area: less covered is no contact [-]
  real(wp), parameter :: least_cover = 1.0e-9_wp !! of a face; less has lost its digits [-]

contains

  !> The weights of the master's nodes where nodes are at `x`.
  !>
  !> Rows add up to 1, and give places on a flat master exactly, to rounding.
  pure subroutine make_mortar(slave, master, x, reach, mortar, behind, is_rigid, is_tie)
    type(slave_t), intent(in) :: slave
    integer, intent(in) :: master(:, :)  !! (4,n_master) the same; the fourth is 0 in a triangle
    real(wp), intent(in) :: x(:, :)      !! (3,n_nodes) [length]
    real(wp), intent(in) :: reach        !! how far apart faces may be, along their normals [length]
    type(mortar_t), intent(out) :: mortar
    real(wp), intent(in), optional :: behind
    !! how far a master may be behind the slave, where that is another distance [length]
    logical, intent(in), optional :: is_rigid
    !! the master moves as one: its nodes need no weights, and the rows stay empty
    logical, intent(in), optional :: is_tie
    !! `take_up_shifts` follows, which gives rows the places of their nodes: they need none of the
    !! slave's own
    type(face_grid_t) :: grid
    type(part_t), allocatable :: parts(:)
    type(entries_t) :: entries
    type(plane_t) :: plane
    type(face_t) :: face
    real(wp) :: length, size_of_master, reaches(2), share
    integer :: number(size(x, 2)), n, f, i, k
    logical :: makes_rows, has_own

    makes_rows = .true.
    if (present(is_rigid)) makes_rows = .not. is_rigid
    n = size(slave%nodes)
    number(slave%nodes) = [(i, i=1, n)]
    allocate (mortar%area(n), mortar%whole_area(n), mortar%faced_area(n), source=0.0_wp)
    allocate (mortar%normal(3, n), mortar%outward(3, n), mortar%apart(3, n), source=0.0_wp)
    allocate (mortar%entered(n), source=0.0_wp)
    allocate (mortar%least_gap(n), source=huge(1.0_wp))
    if (allocated(slave%asks)) allocate (mortar%opposite(n))
    allocate (entries%row(64), entries%node(64), entries%weight(64))
    grid = make_face_grid(master, x)
    size_of_master = largest_face(master, x)
    reaches = reach
    if (present(behind)) reaches(2) = behind
    do f = 1, size(slave%faces, 2)
      face%n = corners_in(slave%faces(:, f))
      face%node = slave%faces(:, f)
      associate (n => face%n, nodes => face%node(:face%n), row => face%row(:face%n))
        row = number(nodes)
        face%x(:, :n) = x(:, nodes)
        plane = plane_of_face(face%x(:, :n))
        face%area = plane%area
        face%given = what_neighbours_get(slave, row)
        share = plane%area/real(n, wp)
        mortar%whole_area(row) = mortar%whole_area(row) + share*sum(face%given(:n, :n), dim=2)
        do i = 1, n
          associate (outward => mortar%outward(:, row(i)))
            outward = outward + share*plane%axis(:, 3)
          end associate
        end do
        call find_parts(grid, master, x, face%x(:, :n), plane, reaches, size_of_master, parts)
        if (allocated(slave%asks)) call look_opposite(slave%asks(row), plane, x, parts, row, &
          mortar%opposite)
        call add_face(face, x, parts, makes_rows, mortar, entries)
      end associate
    end do
    has_own = makes_rows
    if (present(is_tie)) has_own = .not. is_tie
    if (allocated(slave%hanging)) call fold_rows(slave, number, has_own, mortar, entries)
    if (allocated(slave%is_fixed)) then
      where (slave%is_fixed) mortar%area = 0.0_wp
    end if
    do i = 1, n
      length = norm2(mortar%normal(:, i))
      if (length > 0.0_wp) mortar%normal(:, i) = mortar%normal(:, i)/length
      mortar%faced_area(i) = -dot_product(mortar%normal(:, i), mortar%outward(:, i))
      length = norm2(mortar%outward(:, i))
      if (length > 0.0_wp) mortar%outward(:, i) = mortar%outward(:, i)/length
    end do
    associate (n_all => entries%n)
      call make_rows(mortar%area, entries%row(:n_all), entries%node(:n_all), &
        entries%weight(:n_all), mortar%weights)
    end associate
    do i = 1, n
      if (.not. mortar%area(i) > 0.0_wp) cycle
      if (.not. makes_rows) then
        mortar%apart(:, i) = mortar%apart(:, i)/mortar%area(i)
        cycle
      end if
      mortar%apart(:, i) = x(:, slave%nodes(i))
      do k = mortar%weights%first(i), mortar%weights%first(i + 1) - 1
        mortar%apart(:, i) = mortar%apart(:, i) - mortar%weights%weight(k)* &
          x(:, mortar%weights%node(k))
      end do
    end do
  end subroutine make_mortar

  !> Weights that give the places of the slave nodes exactly as far as they lie along their master,
  !> for what is tied must turn with it: the least change of the weights that takes up the shift
  !> along the master's faces. What is left of `apart` is across them. Of a flat master nothing
  !> changes but rounding, which grows where little of a node is covered: what is tied goes where
  !> its master goes, however far. docs/theory.md (11.12).
  pure subroutine take_up_shifts(slave_nodes, x, mortar)
    integer, intent(in) :: slave_nodes(:) !! (n) as of `make_mortar`
    real(wp), intent(in) :: x(:, :)       !! (3,n_nodes) [length]
    type(mortar_t), intent(inout) :: mortar
    real(wp) :: middle(3), arm(3), s(3, 3), trace, shift(3), slope(3), rounding
    integer :: i, k, l, pass
    logical :: regular

    rounding = 4.0_wp*epsilon(1.0_wp)*maxval(abs(x))
    do i = 1, size(slave_nodes)
      associate (first => mortar%weights%first(i), last => mortar%weights%first(i + 1) - 1, &
                 node => mortar%weights%node, weight => mortar%weights%weight, &
                 apart => mortar%apart(:, i), normal => mortar%normal(:, i))
        if (last < first) cycle
        weight(first:last) = weight(first:last)/sum(weight(first:last))
        if (last == first) cycle
        passes: do pass = 1, 3
          if (norm2(apart - dot_product(apart, normal)*normal) <= rounding) exit passes
          middle = sum(x(:, node(first:last)), dim=2)/real(last - first + 1, wp)
          s = 0.0_wp
          do k = first, last
            arm = x(:, node(k)) - middle
            do l = 1, 3
              s(:, l) = s(:, l) + arm*arm(l)
            end do
          end do
          ! Nodes of flat faces say nothing across them.
          trace = s(1, 1) + s(2, 2) + s(3, 3)
          do l = 1, 3
            s(:, l) = s(:, l) + trace*normal*normal(l)
          end do
          shift = apart - dot_product(apart, normal)*normal
          call solve_small(s, shift, slope, regular)
          if (.not. regular) exit passes
          do k = first, last
            weight(k) = weight(k) + dot_product(slope, x(:, node(k)) - middle)
          end do
          weight(first:last) = weight(first:last)/sum(weight(first:last))
          apart = x(:, slave_nodes(i)) - matmul(x(:, node(first:last)), weight(first:last))
        end do passes
      end associate
    end do
  end subroutine take_up_shifts

  !> Half the largest face: how far apart the faces of two surfaces at rest are looked for.
  pure real(wp) function reach_of_faces(slave, master, x) result(reach)
    integer, intent(in) :: slave(:, :), master(:, :) !! (4,n) the fourth is 0 in a triangle
    real(wp), intent(in) :: x(:, :)      !! (3,n_nodes) [length]

    reach = 0.5_wp*max(largest_face(slave, x), largest_face(master, x))
  end function reach_of_faces

  !> How far apart the farthest places of two surfaces are, at most.
  pure real(wp) function reach_of_all(slave_nodes, master_nodes, x) result(reach)
    integer, intent(in) :: slave_nodes(:), master_nodes(:)
    real(wp), intent(in) :: x(:, :)      !! (3,n_nodes) [length]

    associate (s => x(:, slave_nodes), m => x(:, master_nodes))
      reach = norm2(max(maxval(s, 2), maxval(m, 2)) - min(minval(s, 2), minval(m, 2)))
    end associate
  end function reach_of_all

  !> The longest diagonal of the boxes of faces.
  pure real(wp) function largest_face(faces, x) result(length)
    integer, intent(in) :: faces(:, :)   !! (4,n_faces)
    real(wp), intent(in) :: x(:, :)      !! (3,n_nodes) [length]
    real(wp) :: low(3), high(3)
    integer :: f, k

    length = 0.0_wp
    do f = 1, size(faces, 2)
      low = x(:, faces(1, f))
      high = low
      do k = 2, corners_in(faces(:, f))
        low = min(low, x(:, faces(k, f)))
        high = max(high, x(:, faces(k, f)))
      end do
      length = max(length, sum((high - low)**2))
    end do
    length = sqrt(length)
  end function largest_face

  !> Whether any face of one surface is turned towards any of the other: if not they never touch.
  pure logical function face_each_other(slave, master, x) result(they_do)
    integer, intent(in) :: slave(:, :), master(:, :) !! (4,n) the fourth is 0 in a triangle
    real(wp), intent(in) :: x(:, :)      !! (3,n_nodes) [length]
    real(wp) :: normal(3, size(master, 2)), n(3)
    integer :: f, k

    do f = 1, size(master, 2)
      normal(:, f) = outward_normal(x(:, master(:corners_in(master(:, f)), f)))
    end do
    they_do = .true.
    do f = 1, size(slave, 2)
      n = outward_normal(x(:, slave(:corners_in(slave(:, f)), f)))
      do k = 1, size(master, 2)
        if (dot_product(n, normal(:, k)) <= against) return
      end do
    end do
    they_do = .false.
  end function face_each_other

  !> The master faces that cover a slave face, and what they cover of it.
  pure subroutine find_parts(grid, master, x, slave, plane, reach, size_of_master, parts)
    type(face_grid_t), intent(in) :: grid
    integer, intent(in) :: master(:, :)   !! (4,n_master)
    real(wp), intent(in) :: x(:, :)       !! (3,n_nodes) [length]
    real(wp), intent(in) :: slave(:, :)   !! nodes of the slave face [length]
    type(plane_t), intent(in) :: plane
    real(wp), intent(in) :: reach(2)      !! before the slave's plane, and behind it [length]
    real(wp), intent(in) :: size_of_master !! the largest face's [length]
    type(part_t), allocatable, intent(out) :: parts(:)
    integer, allocatable :: near(:)
    type(part_t) :: part
    type(part_t), allocatable :: larger(:)
    real(wp) :: low(3), high(3), height(face_corners), sideways, along
    integer :: i, k, n

    ! What covers the face lies in the prism over it.
    sideways = 1.0e-6_wp*sqrt(plane%area)
    along = maxval(reach) + size_of_master
    low = minval(slave, 2) - along*abs(plane%axis(:, 3)) - sideways
    high = maxval(slave, 2) + along*abs(plane%axis(:, 3)) + sideways
    call faces_near(grid, low, high, near)
    allocate (parts(face_corners))
    n = 0
    do i = 1, size(near)
      k = count(master(:, near(i)) > 0)
      associate (corner => x(:, master(:k, near(i))))
        if (dot_product(outward_normal(corner), plane%axis(:, 3)) > against) cycle
        height(:k) = matmul(plane%axis(:, 3), corner) - dot_product(plane%axis(:, 3), plane%origin)
        if (minval(height(:k)) > reach(1) .or. maxval(height(:k)) < -reach(2)) cycle
        part%node(:k) = master(:k, near(i))
        part%n = k
        part%distance = abs(sum(height(:k)))/real(k, wp)
        part%overlap = find_overlap(plane, slave, corner)
      end associate
      if (.not. part%overlap%area > 0.0_wp) cycle
      if (n == size(parts)) then
        allocate (larger(2*n))
        larger(:n) = parts
        call move_alloc(larger, parts)
      end if
      n = n + 1
      parts(n) = part
    end do
    parts = parts(:n)
    call keep_nearest(plane%area, parts)
  end subroutine find_parts

  !> Leave out the farthest parts where more is covered than there is: of a master that lies behind
  !> another.
  pure subroutine keep_nearest(area, parts)
    real(wp), intent(in) :: area !! of the slave face [length^2]
    type(part_t), allocatable, intent(inout) :: parts(:)
    logical :: kept(size(parts))
    integer :: i

    kept = .true.
    do i = 1, size(parts)
      if (sum(parts%overlap%area, mask=kept) <= (1.0_wp + 1.0e-6_wp)*area) exit
      kept(maxloc(parts%distance, dim=1, mask=kept)) = .false.
    end do
    if (.not. all(kept)) parts = pack(parts, kept)
  end subroutine keep_nearest

  !> What each node of a face gets of the multipliers: its own, and those of neighbours that have
  !> none. All then still add up to 1 all over the face, so that a uniform pressure reaches its
  !> edge. docs/theory.md (11.17).
  pure function what_neighbours_get(slave, row) result(given)
    type(slave_t), intent(in) :: slave
    integer, intent(in) :: row(:)         !! of the face's nodes
    real(wp) :: given(face_corners, face_corners)
    !! (by, of); columns add up to 1, or 0: there is nobody
    logical :: has_none(size(row)), is_taker(size(row))
    integer :: a

    has_none = .false.
    if (allocated(slave%is_fixed)) has_none = slave%is_fixed(row)
    given = 0.0_wp
    do a = 1, size(row)
      is_taker = .false.
      is_taker(a) = .true.
      if (has_none(a)) then
        is_taker = cshift(is_taker, 1) .or. cshift(is_taker, -1)
        if (all(has_none .or. .not. is_taker)) is_taker = .true.
        is_taker = is_taker .and. .not. has_none
      end if
      where (is_taker) given(:size(row), a) = 1.0_wp/real(count(is_taker), wp)
    end do
  end function what_neighbours_get

  !> Find the places of the master opposite the nodes of a slave face that ask for it.
  pure subroutine look_opposite(asks, plane, x, parts, row, opposite)
    logical, intent(in) :: asks(:)
    type(plane_t), intent(in) :: plane    !! of the slave face
    real(wp), intent(in) :: x(:, :)       !! (3,n_nodes) [length]
    type(part_t), intent(in) :: parts(:)
    integer, intent(in) :: row(:)         !! of the face's nodes
    type(opposite_t), intent(inout) :: opposite(:)
    real(wp) :: weight(face_corners)
    integer :: a, i

    do i = 1, size(parts)
      do a = 1, size(row)
        if (.not. asks(a)) cycle
        associate (found => opposite(row(a)), node => parts(i)%node(:parts(i)%n))
          weight = opposite_weights(plane, a, x(:, node))
          if (-minval(weight) >= found%beyond) cycle
          found%n = parts(i)%n
          found%node(:found%n) = node
          found%beyond = -minval(weight)
          found%weight = max(0.0_wp, weight)/sum(max(0.0_wp, weight))
        end associate
      end do
    end do
  end subroutine look_opposite

  !> Add what covers a slave face to the rows of its nodes, or to what they are apart from it, not
  !> yet divided by their areas.
  pure subroutine add_face(face, x, parts, makes_rows, mortar, entries)
    type(face_t), intent(in) :: face
    real(wp), intent(in) :: x(:, :)       !! (3,n_nodes) [length]
    type(part_t), intent(in) :: parts(:)
    logical, intent(in) :: makes_rows
    type(mortar_t), intent(inout) :: mortar
    type(entries_t), intent(inout) :: entries
    real(wp), dimension(face_corners) :: lumped, shared, unit
    real(wp), dimension(face_corners, face_corners) :: mass, dual, part_of
    integer :: a, b, i, k
    logical :: regular

    if (size(parts) == 0) return
    lumped = 0.0_wp
    mass = 0.0_wp
    do i = 1, size(parts)
      lumped = lumped + parts(i)%overlap%lumped
      mass = mass + parts(i)%overlap%mass
    end do
    if (sum(lumped) < least_cover*face%area) return
    do a = face%n + 1, face_corners
      mass(a, a) = 1.0_wp ! a corner that is not there has no part in the others
    end do
    do a = 1, face_corners
      unit = 0.0_wp
      unit(a) = 1.0_wp
      call solve_small(mass, unit, dual(:, a), regular) ! symmetric: columns are rows
      if (.not. regular) return
      dual(:, a) = lumped(a)*dual(:, a)
    end do
    associate (n => face%n, row => face%row(:face%n))
      dual = matmul(dual, transpose(face%given))
      shared = matmul(face%given, lumped)
      mortar%area(row) = mortar%area(row) + shared(:n)
      do a = 1, n
        do b = 1, n
          if (a == b .or. .not. makes_rows .or. .not. face%given(b, a) > 0.0_wp) cycle
          ! The row of `b` stands for the place of `a`, too.
          call append_entry(row(b), face%node(b), face%given(b, a)*lumped(a), entries)
          call append_entry(row(b), face%node(a), -face%given(b, a)*lumped(a), entries)
        end do
      end do
      do i = 1, size(parts)
        associate (overlap => parts(i)%overlap)
          part_of = matmul(transpose(dual), overlap%mixed)
          mortar%least_gap(row) = min(mortar%least_gap(row), overlap%least_gap)
          mortar%entered(row) = mortar%entered(row) + overlap%entered(:n)
          do a = 1, n
            mortar%normal(:, row(a)) = mortar%normal(:, row(a)) + dot_product(face%given(a, :), &
              overlap%lumped)*overlap%normal
          end do
        end associate
        do k = 1, parts(i)%n
          do a = 1, n
            if (makes_rows) then
              call append_entry(row(a), parts(i)%node(k), part_of(a, k), entries)
            else
              mortar%apart(:, row(a)) = mortar%apart(:, row(a)) + part_of(a, k)* &
                (face%x(:, a) - x(:, parts(i)%node(k)))
            end if
          end do
        end do
      end do
    end associate
  end subroutine add_face

  !> Give what nodes have that hang to those that they lie between, in equal parts: each of these
  !> then stands for its own place and for theirs, by what it has of both.
  pure subroutine fold_rows(slave, number, has_own, mortar, entries)
    type(slave_t), intent(in) :: slave   !! with nodes that hang
    integer, intent(in) :: number(:)     !! (n_nodes) rows of the surface's
    logical, intent(in) :: has_own       !! rows get what they stand for of the slave's own
    type(mortar_t), intent(inout) :: mortar
    type(entries_t), intent(inout) :: entries
    integer, dimension(face_corners, size(mortar%area)) :: rows, between
    !! those nodes, and their numbers
    integer :: n(size(mortar%area)), n_entries, own, node, h, i, k
    logical :: takes(face_corners)
    real(wp) :: part

    n = 0
    do h = 1, size(slave%hanging, 2)
      associate (nodes => slave%hanging(2:, h))
        own = number(slave%hanging(1, h))
        takes = nodes > 0
        if (allocated(slave%is_fixed)) takes = takes .and. .not. slave%is_fixed(number(max(1, &
          nodes)))
        ! Where none has a multiplier what the node has is left out with theirs.
        if (.not. any(takes)) takes = nodes > 0
        n(own) = count(takes)
        between(:n(own), own) = pack(nodes, takes)
        rows(:n(own), own) = number(between(:n(own), own))
      end associate
    end do
    n_entries = entries%n
    do i = 1, n_entries
      own = entries%row(i)
      if (n(own) == 0) cycle
      node = entries%node(i)
      part = entries%weight(i)/real(n(own), wp)
      entries%weight(i) = part
      entries%row(i) = rows(1, own)
      do k = 2, n(own)
        call append_entry(rows(k, own), node, part, entries)
      end do
    end do
    do h = 1, size(slave%hanging, 2)
      own = number(slave%hanging(1, h))
      part = 1.0_wp/real(n(own), wp)
      do k = 1, n(own)
        associate (row => rows(k, own))
          mortar%outward(:, row) = mortar%outward(:, row) + part*mortar%outward(:, own)
          mortar%whole_area(row) = mortar%whole_area(row) + part*mortar%whole_area(own)
          mortar%area(row) = mortar%area(row) + part*mortar%area(own)
          mortar%normal(:, row) = mortar%normal(:, row) + part*mortar%normal(:, own)
          mortar%apart(:, row) = mortar%apart(:, row) + part*mortar%apart(:, own)
          mortar%least_gap(row) = min(mortar%least_gap(row), mortar%least_gap(own))
          mortar%entered(row) = mortar%entered(row) + part*mortar%entered(own)
          if (.not. has_own .or. .not. mortar%area(own) > 0.0_wp) cycle
          call append_entry(row, between(k, own), part*mortar%area(own), entries)
          call append_entry(row, slave%hanging(1, h), -part*mortar%area(own), entries)
        end associate
      end do
      mortar%area(own) = 0.0_wp
      mortar%whole_area(own) = 0.0_wp
      mortar%normal(:, own) = 0.0_wp
      mortar%apart(:, own) = 0.0_wp
      mortar%least_gap(own) = huge(1.0_wp)
      mortar%entered(own) = 0.0_wp
    end do
  end subroutine fold_rows

  !> One more contribution.
  pure subroutine append_entry(row, node, weight, entries)
    integer, intent(in) :: row, node
    real(wp), intent(in) :: weight !! [length^2]
    type(entries_t), intent(inout) :: entries

    associate (n => entries%n)
      if (n == size(entries%row)) then
        call enlarge(entries%row, n, 2*n)
        call enlarge(entries%node, n, 2*n)
        call enlarge(entries%weight, n, 2*n)
      end if
    end associate
    entries%n = entries%n + 1
    entries%row(entries%n) = row
    entries%node(entries%n) = node
    entries%weight(entries%n) = weight
  end subroutine append_entry

  !> Contributions as sparse rows, each node of a row once, divided by the areas.
  pure subroutine make_rows(area, row, node, weight, weights)
    real(wp), intent(in) :: area(:)     !! (n) [length^2]
    integer, intent(in) :: row(:), node(:)
    real(wp), intent(in) :: weight(:)   !! [length^2]
    type(weights_t), intent(out) :: weights
    type(lists_t) :: of_row !! contributions to each row
    integer :: i, k, m, n_entries

    of_row = lists_by_key(merge(row, 0, area(row) > 0.0_wp), size(area))
    allocate (weights%first(size(area) + 1), weights%node(size(row)), weights%weight(size(row)))
    n_entries = 0
    do i = 1, size(area)
      weights%first(i) = n_entries + 1
      do k = of_row%first(i), of_row%first(i + 1) - 1
        associate (entry => of_row%item(k))
          do m = weights%first(i), n_entries
            if (weights%node(m) == node(entry)) exit
          end do
          if (m > n_entries) then
            n_entries = m
            weights%node(m) = node(entry)
            weights%weight(m) = 0.0_wp
          end if
          weights%weight(m) = weights%weight(m) + weight(entry)/area(i)
        end associate
      end do
    end do
    weights%first(size(area) + 1) = n_entries + 1
    weights%node = weights%node(:n_entries)
    weights%weight = weights%weight(:n_entries)
  end subroutine make_rows

end module mortar_mod
