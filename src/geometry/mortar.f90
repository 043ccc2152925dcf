!> Weights of a master's nodes for the nodes of a slave surface: a mortar with dual multipliers,
!> over the part of each slave face that the master covers.
!>
!> docs/theory.md (11.1) to (11.4).
module mortar_mod
  use kinds_mod, only: wp
  use growing_lists_mod, only: enlarge
  use lists_mod, only: lists_t, lists_by_key
  use cells_mod, only: face_corners, face_nodes
  use face_shapes_mod, only: face_rule_t, rule_of, face_functions, face_gradients
  use connectivity_mod, only: corners_in
  use small_matrix_mod, only: cross, solve_small
  use surfaces_mod, only: cut_at_middles, find_middles
  use contact_points_mod, only: weights_t
  use face_grid_mod, only: face_grid_t, make_face_grid, faces_near
  use face_overlap_mod, only: overlap_t, plane_t, plane_of_face, outward_normal, find_overlap, &
    opposite_weights
  use curved_overlap_mod, only: whole_face_t, whole_face, find_curved_overlap, patch_t, &
    make_patch, values_at_nodes
  implicit none
  private

  public :: mortar_t, slave_t, opposite_t, make_mortar, take_up_shifts, reach_of_faces, &
    reach_of_all, face_each_other

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
    real(wp), allocatable :: least(:)
    !! (n) how much of its area counts as contact where it is covered [-]
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
    logical :: has_middles = .false.        !! faces of the slave have mid-side nodes
    type(opposite_t), allocatable :: opposite(:)
    !! (n) where the slave asks for it, else not allocated
  end type mortar_t

  !> A slave surface.
  type :: slave_t
    integer, allocatable :: faces(:, :)
    !! (4,n_slave) corners, anticlockwise from outside; the fourth is 0 in a triangle. Or
    !! (8,n_slave) all nodes as of all_nodes_of
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
    integer :: node(face_nodes) = 0 !! of the master face
    integer :: n = 0              !! how many there are
    integer :: of = 0             !! which part of the master it is
    integer :: corner(face_corners) = 0 !! of that part, 0 behind them
    type(plane_t) :: plane        !! of the part of the slave face
    real(wp) :: distance = 0.0_wp !! of its middle from the slave's plane [length]
    type(overlap_t) :: overlap
  end type part_t

  !> A slave face.
  type :: face_t
    integer :: n = 0                               !! nodes
    integer :: node(face_nodes) = 0
    integer :: row(face_nodes) = 0                 !! of the nodes
    real(wp) :: x(3, face_nodes) = 0.0_wp          !! where they are [length]
    real(wp) :: alpha(face_nodes) = 0.0_wp
    !! of a node in the middle of an edge the part of the ends in its point, (9.11); else 0 [-]
    real(wp) :: area = 0.0_wp                      !! [length^2]
    real(wp) :: given(face_nodes, face_nodes) = 0.0_wp !! as of `what_neighbours_get` [-]
  end type face_t

  !> A master, its faces cut into parts.
  type :: master_t
    type(face_grid_t) :: grid                      !! of the parts
    integer, allocatable :: part(:, :)             !! (4,n) as of nodes_of_face
    integer, allocatable :: whole(:)               !! (n) the face of each
    real(wp) :: largest = 0.0_wp                   !! part [length]
  end type master_t

  real(wp), parameter :: against = -0.2_wp      !! cosine of normals that face each other, at most
  ! Less of a node's area than that is no contact. Shares above it have weights of at most 170, with
  ! mid-side nodes of 170, too: their functions have two signs.
  real(wp), parameter :: enough = 1.0e-3_wp, enough_of_second_order = 0.05_wp !! [-]
  ! By how much more of a slave face is covered than there is before something lies behind something
  ! else. Parts of curved faces lean, and seem to overlap a little: by 0.3 % on faces of 45 degrees.
  real(wp), parameter :: overlap_of_flat = 1.0e-6_wp, overlap_of_curved = 0.05_wp !! [-]
  real(wp), parameter :: half = 0.5_wp !! of a face: with less functions are hard to tell apart [-]
  real(wp), parameter :: least_cover = 1.0e-9_wp !! of a face; less has lost its digits [-]

contains

  !> The weights of the master's nodes where nodes are at `x`.
  !>
  !> Rows add up to 1, and give places on a flat master exactly, to rounding.
  pure subroutine make_mortar(slave, master, x, reach, mortar, behind, is_rigid, is_tie)
    type(slave_t), intent(in) :: slave
    integer, intent(in) :: master(:, :)  !! (4,n_master) or (8,n_master) the same
    real(wp), intent(in) :: x(:, :)      !! (3,n_nodes) [length]
    real(wp), intent(in) :: reach        !! how far apart faces may be, along their normals [length]
    type(mortar_t), intent(out) :: mortar
    real(wp), intent(in), optional :: behind
    !! how far a master may be behind the slave, where that is another distance [length]
    logical, intent(in), optional :: is_rigid
    !! the master moves as one: its nodes need no weights, and the rows stay empty
    logical, intent(in), optional :: is_tie
    !! rows are of nodes, each by itself; those beside nodes that hang have some of the slave's own
    type(master_t) :: in_parts
    type(part_t), allocatable :: parts(:), more(:)
    type(entries_t) :: entries
    type(plane_t) :: plane
    type(face_t) :: face
    real(wp) :: length, reaches(2), alpha(size(x, 2)), q(3)
    integer, allocatable :: corners(:, :), whole(:)
    integer :: number(size(x, 2)), ends(2, size(x, 2)), n, f, i, k, s
    logical :: makes_rows, of_nodes

    makes_rows = .true.
    if (present(is_rigid)) makes_rows = .not. is_rigid
    n = size(slave%nodes)
    number(slave%nodes) = [(i, i=1, n)]
    allocate (mortar%area(n), mortar%whole_area(n), mortar%faced_area(n), source=0.0_wp)
    allocate (mortar%normal(3, n), mortar%outward(3, n), mortar%apart(3, n), source=0.0_wp)
    allocate (mortar%entered(n), source=0.0_wp)
    allocate (mortar%least(n), source=enough)
    allocate (mortar%least_gap(n), source=huge(1.0_wp))
    if (allocated(slave%asks)) allocate (mortar%opposite(n))
    allocate (entries%row(64), entries%node(64), entries%weight(64))
    allocate (parts(0))
    call cut_at_middles(master, in_parts%part, in_parts%whole)
    in_parts%grid = make_face_grid(in_parts%part, x)
    in_parts%largest = largest_face(in_parts%part, x)
    call cut_at_middles(slave%faces, corners, whole)
    alpha = 0.0_wp
    ends = 0
    call find_middles(slave%faces, ends, alpha)
    mortar%has_middles = any(alpha(slave%nodes) > 0.0_wp)
    reaches = reach
    if (present(behind)) reaches(2) = behind
    s = 0
    do f = 1, size(slave%faces, 2)
      face%n = count(slave%faces(:, f) > 0)
      face%node(:size(slave%faces, 1)) = slave%faces(:, f)
      associate (n => face%n, nodes => face%node(:face%n), row => face%row(:face%n))
        row = number(nodes)
        face%x(:, :n) = x(:, nodes)
        face%alpha(:n) = alpha(nodes)
        face%given = what_neighbours_get(slave, row)
        face%area = 0.0_wp
        parts = parts(:0)
        do
          s = s + 1
          associate (mine => corners(:corners_in(corners(:, s)), s))
            plane = plane_of_face(x(:, mine))
            face%area = face%area + plane%area
            call find_parts(in_parts, master, x, face, plane, reaches, more)
            if (allocated(slave%asks)) call look_opposite(slave%asks(number(mine)), plane, x, &
              in_parts, more, number(mine), mortar%opposite)
          end associate
          if (size(parts) == 0) then
            call move_alloc(more, parts)
          else
            parts = [parts, more]
          end if
          if (s == size(whole)) exit
          if (whole(s + 1) > f) exit
        end do
        call add_whole(face, plane, mortar)
        call add_face(face, x, parts, makes_rows, mortar, entries)
      end associate
    end do
    if (allocated(slave%hanging)) call fold_rows(slave, number, makes_rows, mortar, entries)
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
    ! A tie is of nodes, each by itself.
    of_nodes = .false.
    if (present(is_tie)) of_nodes = is_tie
    if (of_nodes .and. mortar%has_middles) then
      call rows_of_nodes(slave%nodes, number, ends, alpha, mortar)
      alpha = 0.0_wp
    end if
    do i = 1, n
      if (.not. mortar%area(i) > 0.0_wp) cycle
      if (.not. makes_rows) then
        mortar%apart(:, i) = mortar%apart(:, i)/mortar%area(i)
        cycle
      end if
      q = x(:, slave%nodes(i))
      associate (a => alpha(slave%nodes(i)))
        if (a > 0.0_wp) q = (q - a*(x(:, ends(1, slave%nodes(i))) + x(:, ends(2, &
          slave%nodes(i)))))/(1.0_wp - 2.0_wp*a)
      end associate
      mortar%apart(:, i) = q
      do k = mortar%weights%first(i), mortar%weights%first(i + 1) - 1
        mortar%apart(:, i) = mortar%apart(:, i) - mortar%weights%weight(k)* &
          x(:, mortar%weights%node(k))
      end do
    end do
  end subroutine make_mortar

  !> Weights that give the places of the slave nodes exactly as far as they lie along their master,
  !> for what is tied must turn with it: the least change relative to the weights that takes up the
  !> shift along the master's faces. What is left of `apart` is across them. Of a flat master
  !> nothing changes but rounding, which grows where little of a node is covered: what is tied goes
  !> where its master goes, however far. docs/theory.md (11.12).
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
          middle = matmul(x(:, node(first:last)), abs(weight(first:last)))/ &
            sum(abs(weight(first:last)))
          s = 0.0_wp
          do k = first, last
            arm = x(:, node(k)) - middle
            do l = 1, 3
              s(:, l) = s(:, l) + abs(weight(k))*arm*arm(l)
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
            weight(k) = weight(k) + abs(weight(k))*dot_product(slope, x(:, node(k)) - middle)
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

  !> Add a slave face to the whole areas and the normals of its nodes.
  pure subroutine add_whole(face, plane, mortar)
    type(face_t), intent(in) :: face
    type(plane_t), intent(in) :: plane    !! of a face without mid-side nodes
    type(mortar_t), intent(inout) :: mortar
    type(face_rule_t) :: rule
    real(wp) :: outward(3, face%n), area(face%n), tangent(3, 2), normal(3), share
    integer :: i, a

    associate (n => face%n, row => face%row(:face%n))
      if (n > face_corners) mortar%least(row) = enough_of_second_order
      if (n <= face_corners) then
        share = plane%area/real(n, wp)
        mortar%whole_area(row) = mortar%whole_area(row) + share*sum(face%given(:n, :n), dim=2)
        do i = 1, n
          associate (outward => mortar%outward(:, row(i)))
            outward = outward + share*plane%axis(:, 3)
          end associate
        end do
        return
      end if
      outward = 0.0_wp
      area = 0.0_wp
      rule = rule_of(n)
      do i = 1, rule%n
        tangent = matmul(face%x(:, :n), transpose(face_gradients(n, rule%point(:, i))))
        normal = rule%weight(i)*cross(tangent(:, 1), tangent(:, 2))
        associate (functions => face_functions(n, rule%point(:, i)))
          area = area + norm2(normal)*functions
          do a = 1, n
            outward(:, a) = outward(:, a) + functions(a)*normal
          end do
        end associate
      end do
      call share_with_ends(face, area)
      mortar%whole_area(row) = mortar%whole_area(row) + matmul(face%given(:n, :n), area)
      do i = 1, 3
        call share_with_ends(face, outward(i, :))
      end do
      mortar%outward(:, row) = mortar%outward(:, row) + outward
    end associate
  end subroutine add_whole

  !> What shape functions have becomes what those of the points have: a node in the middle of an
  !> edge gives alpha of its own to each end. docs/theory.md (9.12).
  pure subroutine share_with_ends(face, of_functions)
    type(face_t), intent(in) :: face
    real(wp), intent(inout) :: of_functions(:) !! (n) of the nodes of the face
    integer :: k, corners

    corners = face%n/2
    if (face%n <= face_corners) return
    do k = 1, corners
      associate (middle => of_functions(corners + k), ends => [k, 1 + modulo(k, corners)], &
                 alpha => face%alpha(corners + k))
        of_functions(ends) = of_functions(ends) + alpha*middle
        middle = (1.0_wp - 2.0_wp*alpha)*middle
      end associate
    end do
  end subroutine share_with_ends

  !> The parts of the master that cover a part of a slave face, and what they cover of it.
  pure subroutine find_parts(in_parts, master, x, face, plane, reach, parts)
    type(master_t), intent(in) :: in_parts
    integer, intent(in) :: master(:, :)   !! (4,n_master) or (8,n_master) all nodes
    real(wp), intent(in) :: x(:, :)       !! (3,n_nodes) [length]
    type(face_t), intent(in) :: face      !! the whole of it
    type(plane_t), intent(in) :: plane    !! of the part
    real(wp), intent(in) :: reach(2)      !! before the slave's plane, and behind it [length]
    type(part_t), allocatable, intent(out) :: parts(:)
    integer, allocatable :: near(:)
    type(part_t) :: part
    type(part_t), allocatable :: larger(:)
    type(whole_face_t) :: slave
    real(wp) :: low(3), high(3), height(face_corners), sideways, along
    integer :: i, k, n

    ! What covers the face lies in the prism over it.
    sideways = 1.0e-6_wp*sqrt(plane%area)
    along = maxval(reach) + in_parts%largest
    low = minval(face%x(:, :face%n), 2) - along*abs(plane%axis(:, 3)) - sideways
    high = maxval(face%x(:, :face%n), 2) + along*abs(plane%axis(:, 3)) + sideways
    call faces_near(in_parts%grid, low, high, near)
    if (face%n > face_corners) slave = whole_face(face%x(:, :face%n))
    allocate (parts(face_corners))
    n = 0
    do i = 1, size(near)
      k = corners_in(in_parts%part(:, near(i)))
      associate (corner => x(:, in_parts%part(:k, near(i))), of => master(:, &
                 in_parts%whole(near(i))))
        if (dot_product(outward_normal(corner), plane%axis(:, 3)) > against) cycle
        height(:k) = matmul(plane%axis(:, 3), corner) - dot_product(plane%axis(:, 3), plane%origin)
        if (minval(height(:k)) > reach(1) .or. maxval(height(:k)) < -reach(2)) cycle
        part%of = near(i)
        part%n = count(of > 0)
        part%node(:size(of)) = of
        part%corner = in_parts%part(:, near(i))
        part%plane = plane
        part%distance = abs(sum(height(:k)))/real(k, wp)
        if (max(face%n, part%n) <= face_corners) then
          part%overlap = find_overlap(plane, face%x(:, :face%n), corner)
        else
          if (slave%n == 0) slave = whole_face(face%x(:, :face%n))
          part%overlap = find_curved_overlap(plane, slave, corner, whole_face(x(:, &
            of(:part%n))))
        end if
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
    call keep_nearest(plane%area, merge(overlap_of_curved, overlap_of_flat, max(face%n, &
      maxval(parts%n)) > face_corners), parts)
  end subroutine find_parts

  !> Leave out the farthest parts where more is covered than there is: of a master that lies behind
  !> another.
  pure subroutine keep_nearest(area, rounding, parts)
    real(wp), intent(in) :: area     !! of the part of the slave face [length^2]
    real(wp), intent(in) :: rounding !! of this area [-]
    type(part_t), allocatable, intent(inout) :: parts(:)
    logical :: kept(size(parts))
    integer :: i

    kept = .true.
    do i = 1, size(parts)
      if (sum(parts%overlap%area, mask=kept) <= (1.0_wp + rounding)*area) exit
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
    real(wp) :: given(face_nodes, face_nodes)
    !! (by, of); columns add up to 1, or 0: there is nobody
    logical :: has_none(size(row)), is_taker(size(row))
    integer :: around(size(row)), a, k, n

    n = size(row)
    around = [(a, a=1, n)]
    ! Along the edges from corner to corner.
    if (n > face_corners) around = [((a + n/2*(k - 1), k=1, 2), a=1, n/2)]
    has_none = .false.
    if (allocated(slave%is_fixed)) has_none = slave%is_fixed(row(around))
    given = 0.0_wp
    do a = 1, n
      is_taker = .false.
      is_taker(a) = .true.
      if (has_none(a)) then
        is_taker = cshift(is_taker, 1) .or. cshift(is_taker, -1)
        if (all(has_none .or. .not. is_taker)) is_taker = .true.
        is_taker = is_taker .and. .not. has_none
      end if
      given(around, around(a)) = merge(1.0_wp/real(max(1, count(is_taker)), wp), 0.0_wp, is_taker)
    end do
  end function what_neighbours_get

  !> Find the places of the master opposite the nodes of a slave face that ask for it: among the
  !> corners of the master's parts.
  pure subroutine look_opposite(asks, plane, x, in_parts, parts, row, opposite)
    logical, intent(in) :: asks(:)
    type(plane_t), intent(in) :: plane    !! of the slave face
    real(wp), intent(in) :: x(:, :)       !! (3,n_nodes) [length]
    type(master_t), intent(in) :: in_parts
    type(part_t), intent(in) :: parts(:)
    integer, intent(in) :: row(:)         !! of the face's nodes
    type(opposite_t), intent(inout) :: opposite(:)
    real(wp) :: weight(face_corners)
    integer :: a, i, k

    do i = 1, size(parts)
      k = corners_in(in_parts%part(:, parts(i)%of))
      do a = 1, size(row)
        if (.not. asks(a)) cycle
        associate (found => opposite(row(a)), node => in_parts%part(:k, parts(i)%of))
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

  !> Add what covers a slave face to the rows of its nodes, or to what they are apart from it, not
  !> yet divided by their areas.
  pure subroutine add_face(face, x, parts, makes_rows, mortar, entries)
    type(face_t), intent(in) :: face
    real(wp), intent(in) :: x(:, :)       !! (3,n_nodes) [length]
    type(part_t), intent(in) :: parts(:)
    logical, intent(in) :: makes_rows
    type(mortar_t), intent(inout) :: mortar
    type(entries_t), intent(inout) :: entries
    type(overlap_t) :: overlap
    real(wp), dimension(face%n) :: lumped, shared, unit
    real(wp), dimension(face%n, face%n) :: mass, dual, given
    real(wp) :: part_of(face%n, face_nodes), q(3, face%n), values(face%n, face_nodes, size(parts))
    integer :: a, b, i, k
    logical :: regular, is_extrapolated

    if (size(parts) == 0) return
    lumped = 0.0_wp
    mass = 0.0_wp
    associate (n => face%n)
      do i = 1, size(parts)
        lumped = lumped + parts(i)%overlap%lumped(:n)
        mass = mass + parts(i)%overlap%mass(:n, :n)
      end do
      if (sum(lumped) < least_cover*face%area) return
      is_extrapolated = n > face_corners .and. sum(lumped) < half*face%area
      call share_with_ends(face, lumped)
      dual = 0.0_wp
      if (is_extrapolated) then
        call extrapolate(face, x, parts, values, regular)
        if (.not. regular) return
      else
        do a = 1, n
          call share_with_ends(face, mass(:, a))
        end do
        do a = 1, n
          call share_with_ends(face, mass(a, :))
        end do
        do a = 1, n
          unit = 0.0_wp
          unit(a) = 1.0_wp
          call solve_small(mass, unit, dual(:, a), regular) ! symmetric: columns are rows
          if (.not. regular) return
          dual(:, a) = lumped(a)*dual(:, a)
        end do
      end if
    end associate
    call find_places(face, q)
    associate (n => face%n, row => face%row(:face%n))
      given = face%given(:n, :n)
      dual = matmul(dual, transpose(given))
      shared = matmul(given, lumped)
      mortar%area(row) = mortar%area(row) + shared
      do a = 1, n
        do b = 1, n
          if (a == b .or. .not. makes_rows .or. .not. given(b, a) > 0.0_wp) cycle
          ! The row of `b` stands for the place of `a`, too.
          call append_place(face, row(b), b, given(b, a)*lumped(a), entries)
          call append_place(face, row(b), a, -given(b, a)*lumped(a), entries)
        end do
      end do
      do i = 1, size(parts)
        overlap = parts(i)%overlap
        if (n > face_corners) then
          call share_with_ends(face, overlap%entered(:n))
          do k = 1, 3
            call share_with_ends(face, overlap%facing(k, :n))
          end do
          do k = 1, parts(i)%n
            call share_with_ends(face, overlap%mixed(:n, k))
          end do
        end if
        if (is_extrapolated) then
          do k = 1, parts(i)%n
            part_of(:, k) = matmul(given, lumped*values(:, k, i))
          end do
        else
          part_of(:, :parts(i)%n) = matmul(transpose(dual), overlap%mixed(:n, :parts(i)%n))
        end if
        mortar%least_gap(row) = min(mortar%least_gap(row), overlap%least_gap)
        mortar%entered(row) = mortar%entered(row) + overlap%entered(:n)
        mortar%normal(:, row) = mortar%normal(:, row) + matmul(overlap%facing(:, :n), &
          transpose(given))
        do k = 1, parts(i)%n
          do a = 1, n
            if (makes_rows) then
              call append_entry(row(a), parts(i)%node(k), part_of(a, k), entries)
            else
              mortar%apart(:, row(a)) = mortar%apart(:, row(a)) + part_of(a, k)* &
                (q(:, a) - x(:, parts(i)%node(k)))
            end if
          end do
        end do
      end do
    end associate
  end subroutine add_face

  !> Where the points of a face are.
  pure subroutine find_places(face, q)
    type(face_t), intent(in) :: face
    real(wp), intent(out) :: q(:, :) !! (3,n) [length]

    q = face%x(:, :face%n)
    call take_from_ends(face, q)
  end subroutine find_places

  !> What nodes have becomes what the points have. docs/theory.md (9.11).
  pure subroutine take_from_ends(face, values)
    type(face_t), intent(in) :: face
    real(wp), intent(inout) :: values(:, :) !! (m,n) of the nodes of the face
    integer :: k, corners

    if (face%n <= face_corners) return
    corners = face%n/2
    do k = 1, corners
      associate (alpha => face%alpha(corners + k), of_middle => values(:, corners + k))
        of_middle = (of_middle - alpha*(values(:, k) + values(:, 1 + modulo(k, corners))))/ &
          (1.0_wp - 2.0_wp*alpha)
      end associate
    end do
  end subroutine take_from_ends

  !> M^-1 int N~ N_k of (11.21), where less than half of the face is covered: values at its points
  !> of the polynomial that comes closest to the master's function over what is covered.
  !>
  !> Shape functions of the whole face nearly depend on each other over a narrow strip; polynomials
  !> in the strip's own coordinates do not.
  pure subroutine extrapolate(face, x, parts, values, regular)
    type(face_t), intent(in) :: face
    real(wp), intent(in) :: x(:, :)             !! (3,n_nodes) [length]
    type(part_t), intent(in) :: parts(:)
    real(wp), intent(out) :: values(:, :, :)    !! (n,8,n_parts) [-]
    logical, intent(out) :: regular             !! false: the strip is too narrow even for these
    type(patch_t) :: patch
    type(overlap_t) :: overlap(size(parts))
    type(whole_face_t) :: slave
    real(wp), dimension(face%n, face%n) :: mass, at_points, fit
    real(wp) :: moments(6)
    integer :: i, a, k

    values = 0.0_wp
    moments = 0.0_wp
    do i = 1, size(parts)
      moments = moments + parts(i)%overlap%moments
    end do
    slave = whole_face(face%x(:, :face%n))
    patch = make_patch(face%n, moments)
    mass = 0.0_wp
    do i = 1, size(parts)
      associate (part => parts(i))
        k = corners_in(part%corner)
        overlap(i) = find_curved_overlap(part%plane, slave, x(:, part%corner(:k)), whole_face( &
          x(:, part%node(:part%n))), patch)
      end associate
      mass = mass + overlap(i)%mass(:face%n, :face%n)
    end do
    at_points = values_at_nodes(face%n, patch)
    call take_from_ends(face, at_points)
    do a = 1, face%n
      call solve_small(mass, at_points(:, a), fit(:, a), regular)
      if (.not. regular) return
    end do
    do i = 1, size(parts)
      values(:, :parts(i)%n, i) = matmul(transpose(fit), overlap(i)%mixed(:face%n, :parts(i)%n))
    end do
  end subroutine extrapolate

  !> Append the place of a point of a face: of one in the middle of an edge that of three nodes.
  pure subroutine append_place(face, row, a, weight, entries)
    type(face_t), intent(in) :: face
    integer, intent(in) :: row
    integer, intent(in) :: a         !! number of its node in the face
    real(wp), intent(in) :: weight   !! [length^2]
    type(entries_t), intent(inout) :: entries
    real(wp) :: own
    integer :: corners

    own = weight/(1.0_wp - 2.0_wp*face%alpha(a))
    call append_entry(row, face%node(a), own, entries)
    if (.not. face%alpha(a) > 0.0_wp) return
    corners = face%n/2
    call append_entry(row, face%node(a - corners), -face%alpha(a)*own, entries)
    call append_entry(row, face%node(1 + modulo(a - corners, corners)), -face%alpha(a)*own, entries)
  end subroutine append_place

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

  !> Rows of the nodes in the middles of edges themselves, from those of their points and of the
  !> ends of the edges: u_m = (1 - 2 alpha) q_m + alpha (u_1 + u_2). An end that is not covered
  !> enough stays as it is.
  pure subroutine rows_of_nodes(nodes, number, ends, alpha, mortar)
    integer, intent(in) :: nodes(:)      !! (n) of the slave
    integer, intent(in) :: number(:)     !! (n_nodes) rows of these
    integer, intent(in) :: ends(:, :)    !! (2,n_nodes) as of find_middles
    real(wp), intent(in) :: alpha(:)     !! (n_nodes) the same [-]
    type(mortar_t), intent(inout) :: mortar
    type(entries_t) :: entries
    type(weights_t) :: weights
    real(wp) :: one(size(nodes))
    integer :: i, k

    allocate (entries%row(64), entries%node(64), entries%weight(64))
    do i = 1, size(nodes)
      associate (a => alpha(nodes(i)))
        call append_row(i, i, 1.0_wp - 2.0_wp*a, entries)
        if (.not. a > 0.0_wp) cycle
        do k = 1, 2
          associate (row => number(ends(k, nodes(i))))
            if (mortar%area(row) > mortar%least(row)*mortar%whole_area(row)) then
              call append_row(i, row, a, entries)
            else
              call append_entry(i, nodes(row), a, entries)
            end if
          end associate
        end do
      end associate
    end do
    one = merge(1.0_wp, 0.0_wp, mortar%area > 0.0_wp)
    call make_rows(one, entries%row(:entries%n), entries%node(:entries%n), &
      entries%weight(:entries%n), weights)
    mortar%weights = weights

  contains

    pure subroutine append_row(to, from, factor, entries)
      integer, intent(in) :: to, from
      real(wp), intent(in) :: factor
      type(entries_t), intent(inout) :: entries
      integer :: k

      associate (rows => mortar%weights)
        do k = rows%first(from), rows%first(from + 1) - 1
          call append_entry(to, rows%node(k), factor*rows%weight(k), entries)
        end do
      end associate
    end subroutine append_row

  end subroutine rows_of_nodes

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
