!> The sides of a master: what concave edges and steps divide it into, each with integrals of its
!> own.
!>
!> Normals and gaps before faces are means over what a node faces. Across a concave edge such a mean
!> bars neither face: of a floor and a wall it has one normal between both. Across a step the mean,
!> of weights of both signs, is below 0 where all is apart. docs/theory.md (11.16).
module master_sides_mod
  use kinds_mod, only: wp
  use growing_lists_mod, only: append
  use small_matrix_mod, only: cross
  use equal_columns_mod, only: number_columns
  use sorting_mod, only: order_of
  use face_grid_mod, only: face_grid_t, make_face_grid, faces_near
  use face_overlap_mod, only: outward_normal
  implicit none
  private

  public :: find_sides, area_of_face

  !> Pairs of faces that meet at an edge.
  type :: joints_t
    integer :: n = 0
    integer, allocatable :: joint(:, :)
    !! (3,n) two faces, the angle between their normals in degrees, or `concave`, `step`
  end type joints_t

  !> Faces that are joined: trees with one root each, and the concave edges at every tree.
  type :: forest_t
    integer, allocatable :: parent(:) !! (n_faces) 0: a root
    integer, allocatable :: n_faces(:), n(:) !! (n_faces) faces and concave edges of a root's tree
    integer, allocatable :: first(:), last(:) !! (n_faces) of the list of these; 0: there are none
    integer, allocatable :: next(:)   !! (2*n_concave) the list goes on here
    integer, allocatable :: beyond(:) !! (2*n_concave) the face on the other side of the edge
  end type forest_t

  real(wp), parameter :: pi = acos(-1.0_wp)
  ! Polygons of twelve edges stand for a circle, in single precision too.
  real(wp), parameter :: sharp = cos(30.01_wp*pi/180.0_wp)
  real(wp), parameter :: folded = 1.0e-3_wp !! sine of an angle: of the two sides of a sheet [-]
  real(wp), parameter :: flush = 1.0e-4_wp
  !! of an edge: further apart no deck's digits put edges that are one [-]
  integer,  parameter :: concave = -1, step = -2 !! in place of an angle

contains

  !> The side that each face of a master belongs to, from 1; all to one where no edge is concave by
  !> more than 30 degrees, and no step is within a slave's face.
  !>
  !> Faces are joined across edges, the flattest first, unless this would join both faces of a
  !> concave edge. So an edge that ends within a surface divides it too, along other edges as sharp
  !> as can be. What is joined then gets the lowest number that nothing beyond a concave edge has:
  !> there are as few sides as that takes, and sides need not be connected. A piece that is smaller
  !> than a slave's face is no side, but behind a step: rows of its own would be means over what
  !> nodes hardly see.
  subroutine find_sides(faces, x, side, least, longest)
    integer, intent(in) :: faces(:, :)          !! (4,n_faces) nodes; the fourth is 0 in a triangle
    real(wp), intent(in) :: x(:, :)             !! (3,n_nodes) [length]
    integer, allocatable, intent(out) :: side(:) !! (n_faces)
    real(wp), intent(in), optional :: least     !! area of a slave's face; default: 0 [length^2]
    real(wp), intent(in), optional :: longest
    !! of the slave's faces, between two corners; left out: steps divide nothing [length]
    type(joints_t) :: joints
    type(forest_t) :: forest

    allocate (side(size(faces, 2)), source=1)
    call find_joints(faces, x, joints)
    if (present(longest)) call add_steps(faces, x, longest, joints)
    if (.not. any(joints%joint(3, :joints%n) < 0)) return
    call join_faces(size(faces, 2), joints, forest)
    if (present(least)) call absorb_small(faces, x, joints, least, forest)
    call number_sides(forest, side)
  end subroutine find_sides

  !> Find all pairs of faces that meet: at an edge of both, or where an edge of one is on the other.
  subroutine find_joints(faces, x, joints)
    integer, intent(in) :: faces(:, :)
    real(wp), intent(in) :: x(:, :)       !! [length]
    type(joints_t), intent(out) :: joints
    integer, allocatable :: edge(:, :)    !! (4,n_edges) its ends, the face, its place there
    integer, allocatable :: first(:)      !! (n_edges) the first one that has the same ends
    integer, allocatable :: last(:), before(:) !! (n_edges) of the first: the last such; one before
    real(wp), allocatable :: normal(:, :) !! (3,n_faces) outward [-]
    logical, allocatable :: is_open(:)    !! (n_edges) no other face has it
    integer :: i, k, f

    call list_edges(faces, x, edge)
    call number_columns(edge(:2, :), first)
    allocate (normal(3, size(faces, 2)))
    do f = 1, size(faces, 2)
      normal(:, f) = outward_normal(x(:, faces(:count(faces(:, f) > 0), f)))
    end do
    allocate (joints%joint(3, size(edge, 2)), before(size(first)))
    allocate (is_open(size(first)), source=.true.)
    allocate (last, source=first)
    do i = 1, size(first)
      before(i) = merge(last(first(i)), 0, i > first(i))
      last(first(i)) = i
      k = before(i)
      do while (k > 0)
        is_open([i, k]) = .false.
        call append(joints%joint, joints%n, [edge(3, k), edge(3, i), angle_between(normal(:, &
          edge(3, k)), normal(:, edge(3, i)))])
        if (joints%joint(3, joints%n) >= 30) then
          if (turn_in(edge(3:, k), edge(3:, i))) joints%joint(3, joints%n) = concave
        end if
        k = before(k)
      end do
    end do
    call join_open_edges(faces, x, normal, edge(3:, pack([(i, i=1, size(first))], is_open)), joints)

  contains

    !> Whether two faces with an edge of both are turned towards each other by more than 30 degrees.
    pure logical function turn_in(one, other)
      integer, intent(in), dimension(2) :: one, other !! a face, the place of the edge there

      associate (n => normal(:, one(1)), m => normal(:, other(1)))
        turn_in = dot_product(n, m) < sharp .and. &
          dot_product(m, inward_from(faces, x, n, one)) > folded .and. &
          dot_product(n, inward_from(faces, x, m, other)) > folded
      end associate
    end function turn_in

  end subroutine find_joints

  !> Add faces that look the same way and lie behind each other, near enough for a slave's face to
  !> see both: borders of what is joined across edges of 30 degrees or less.
  subroutine add_steps(faces, x, longest, joints)
    integer, intent(in) :: faces(:, :)
    real(wp), intent(in) :: x(:, :)       !! [length]
    real(wp), intent(in) :: longest       !! as of find_sides [length]
    type(joints_t), intent(inout) :: joints
    type(forest_t) :: patches
    type(face_grid_t) :: grid
    integer, allocatable :: near(:), root(:)
    integer, dimension(size(faces, 2)) :: n_joined, last
    integer :: f, i
    real(wp), parameter :: alike = 0.5_wp !! cosine of normals
    real(wp) :: normal(3, size(faces, 2)), far

    allocate (patches%parent(size(faces, 2)), patches%n(size(faces, 2)), source=0)
    allocate (patches%n_faces(size(faces, 2)), source=1)
    n_joined = 0
    do i = 1, joints%n
      associate (joint => joints%joint(:, i))
        if (joint(3) < 0 .or. joint(3) > 30) cycle
        n_joined(joint(:2)) = n_joined(joint(:2)) + 1
        root = [root_of(patches, joint(1)), root_of(patches, joint(2))]
        if (root(1) /= root(2)) call unite(root(1), root(2), patches)
      end associate
    end do
    root = [(root_of(patches, f), f=1, size(faces, 2))]
    if (all(root == root(1))) return
    do f = 1, size(faces, 2)
      normal(:, f) = outward_normal(x(:, faces(:count(faces(:, f) > 0), f)))
    end do
    grid = make_face_grid(faces, x)
    last = 0
    do f = 1, size(faces, 2)
      if (n_joined(f) >= count(faces(:, f) > 0)) cycle
      associate (box => grid%box(:, :, f))
        ! Both ends of that face, and how far before it faces are looked for.
        far = 1.5_wp*longest + 0.5_wp*norm2(box(:, 2) - box(:, 1))
        call faces_near(grid, box(:, 1) - far, box(:, 2) + far, near)
      end associate
      do i = 1, size(near)
        associate (g => near(i))
          if (g <= f .or. root(g) == root(f) .or. n_joined(g) >= count(faces(:, g) > 0)) cycle
          ! One of a patch is enough.
          if (last(root(g)) == f .or. dot_product(normal(:, f), normal(:, g)) < alike) cycle
          if (min(height_over(f, g), height_over(g, f)) <= flush*longest) cycle
          call append(joints%joint, joints%n, [f, g, step])
          last(root(g)) = f
        end associate
      end do
    end do

  contains

    !> How far the nearest corner of a face is from the plane of another.
    pure real(wp) function height_over(one, other) result(height)
      integer, intent(in) :: one, other

      height = minval(abs(matmul(normal(:, one), x(:, faces(:count(faces(:, other) > 0), other)) - &
        spread(middle_of(faces, x, one), 2, count(faces(:, other) > 0)))))
    end function height_over

  end subroutine add_steps

  !> The edges of all faces, by places: nodes at one place are one.
  pure subroutine list_edges(faces, x, edge)
    integer, intent(in) :: faces(:, :)
    real(wp), intent(in) :: x(:, :)       !! [length]
    integer, allocatable, intent(out) :: edge(:, :) !! (4,n_edges) as in `find_joints`
    integer :: number(size(x, 2)), f, k, m, n, ends(2)
    integer, allocatable :: used(:), place(:)

    number = 0
    do f = 1, size(faces, 2)
      number(faces(:count(faces(:, f) > 0), f)) = 1
    end do
    used = pack([(k, k=1, size(number))], number > 0)
    call number_columns(x(:, used), place)
    number(used) = place
    allocate (edge(4, count(faces > 0)))
    n = 0
    do f = 1, size(faces, 2)
      m = count(faces(:, f) > 0)
      do k = 1, m
        ends = number(faces([k, 1 + mod(k, m)], f))
        n = n + 1
        edge(:, n) = [minval(ends), maxval(ends), f, k]
      end do
    end do
  end subroutine list_edges

  !> Add faces with an edge that is no other's, and those on which its middle lies: meshes on both
  !> sides of an edge may differ, and a wall may stand on the middle of a face.
  pure subroutine join_open_edges(faces, x, normal, open, joints)
    integer, intent(in) :: faces(:, :)
    real(wp), intent(in) :: x(:, :)       !! [length]
    real(wp), intent(in) :: normal(:, :)  !! (3,n_faces) outward [-]
    integer, intent(in) :: open(:, :)     !! (2,n) a face, the place of the edge there
    type(joints_t), intent(inout) :: joints
    type(face_grid_t) :: grid
    integer, allocatable :: near(:)
    real(wp) :: ends(3, 2), middle(3), close_by, arm(3)
    integer :: i, k
    logical :: is_on, is_at_rim, turns_in

    if (size(open, 2) < 2) return
    grid = make_face_grid(faces, x)
    do i = 1, size(open, 2)
      ends = ends_of(faces, x, open(:, i))
      middle = 0.5_wp*(ends(:, 1) + ends(:, 2))
      close_by = flush*norm2(ends(:, 2) - ends(:, 1))
      call faces_near(grid, middle - close_by, middle + close_by, near)
      do k = 1, size(near)
        if (near(k) == open(1, i)) cycle
        call find_place(faces, x, normal(:, near(k)), near(k), middle, is_on, is_at_rim, &
          close_by)
        if (.not. is_on) cycle
        associate (n => normal(:, open(1, i)), m => normal(:, near(k)))
          turns_in = dot_product(n, m) < sharp .and. &
            dot_product(m, inward_from(faces, x, n, open(:, i))) > folded
          ! A wall at the rim of a floor may be turned away from it.
          arm = middle_of(faces, x, near(k)) - middle
          if (is_at_rim) turns_in = turns_in .and. dot_product(n, arm) > folded*norm2(arm)
          call append(joints%joint, joints%n, [open(1, i), near(k), merge(concave, &
            angle_between(n, m), turns_in)])
        end associate
      end do
    end do
  end subroutine join_open_edges

  !> Whether a place lies on a face, and whether at one of its edges.
  pure subroutine find_place(faces, x, normal, f, place, is_on, is_at_rim, close_by)
    integer, intent(in) :: faces(:, :)
    real(wp), intent(in) :: x(:, :)       !! [length]
    real(wp), intent(in) :: normal(3)     !! of the face [-]
    integer, intent(in) :: f
    real(wp), intent(in) :: place(3)      !! [length]
    logical, intent(out) :: is_on, is_at_rim
    real(wp), intent(in) :: close_by      !! how far off it may be [length]
    real(wp) :: ends(3, 2), along(3), arm(3), t
    integer :: k

    is_on = abs(dot_product(normal, place - middle_of(faces, x, f))) <= close_by
    is_at_rim = .false.
    do k = 1, count(faces(:, f) > 0)
      ends = ends_of(faces, x, [f, k])
      along = ends(:, 2) - ends(:, 1)
      arm = place - ends(:, 1)
      t = max(0.0_wp, min(1.0_wp, dot_product(arm, along)/max(sum(along**2), tiny(1.0_wp))))
      is_at_rim = is_at_rim .or. norm2(arm - t*along) <= close_by
      is_on = is_on .and. dot_product(cross(along, arm), normal) >= 0.0_wp
    end do
    is_on = is_on .or. is_at_rim
  end subroutine find_place

  !> The angle between two normals in degrees.
  pure integer function angle_between(n, m) result(angle)
    real(wp), intent(in) :: n(3), m(3)

    angle = nint(atan2(norm2(cross(n, m)), dot_product(n, m))*180.0_wp/pi)
  end function angle_between

  pure function middle_of(faces, x, f) result(middle)
    integer, intent(in) :: faces(:, :), f
    real(wp), intent(in) :: x(:, :)
    real(wp) :: middle(3)

    associate (n => count(faces(:, f) > 0))
      middle = sum(x(:, faces(:n, f)), dim=2)/real(n, wp)
    end associate
  end function middle_of

  !> The ends of an edge: a face, its place there.
  pure function ends_of(faces, x, edge) result(ends)
    integer, intent(in) :: faces(:, :), edge(2)
    real(wp), intent(in) :: x(:, :)
    real(wp) :: ends(3, 2)

    ends = x(:, faces([edge(2), 1 + mod(edge(2), count(faces(:, edge(1)) > 0))], edge(1)))
  end function ends_of

  !> The unit vector from an edge into its face, across the edge.
  pure function inward_from(faces, x, normal, edge) result(inward)
    integer, intent(in) :: faces(:, :), edge(2)
    real(wp), intent(in) :: x(:, :)
    real(wp), intent(in) :: normal(3) !! of the face
    real(wp) :: inward(3)
    real(wp) :: ends(3, 2)

    ends = ends_of(faces, x, edge)
    inward = cross(normal, ends(:, 2) - ends(:, 1))
    inward = inward/max(norm2(inward), tiny(1.0_wp))
  end function inward_from

  !> Join faces across edges, the flattest first, where no concave edge is between what is joined.
  subroutine join_faces(n_faces, joints, forest)
    integer, intent(in) :: n_faces
    type(joints_t), intent(in) :: joints
    type(forest_t), intent(out) :: forest
    integer, allocatable :: order(:)
    integer :: i, k

    allocate (forest%parent(n_faces), forest%n(n_faces), forest%first(n_faces), source=0)
    allocate (forest%last(n_faces), source=0)
    allocate (forest%n_faces(n_faces), source=1)
    associate (angle => joints%joint(3, :joints%n), face => joints%joint(:2, :joints%n))
      allocate (forest%next(2*count(angle < 0)), source=0)
      allocate (forest%beyond(size(forest%next)), source=0)
      k = 0
      do i = 1, joints%n
        if (angle(i) >= 0) cycle
        call add_barrier(face(1, i), face(2, i))
        call add_barrier(face(2, i), face(1, i))
      end do
      call order_of(angle, order)
      do i = 1, joints%n
        if (angle(order(i)) < 0) cycle
        call join_two(root_of(forest, face(1, order(i))), root_of(forest, face(2, order(i))))
      end do
    end associate

  contains

    subroutine add_barrier(one, other)
      integer, intent(in) :: one, other !! faces

      k = k + 1
      forest%beyond(k) = other
      forest%next(k) = forest%first(one)
      forest%first(one) = k
      if (forest%last(one) == 0) forest%last(one) = k
      forest%n(one) = forest%n(one) + 1
    end subroutine add_barrier

    subroutine join_two(one, other)
      integer, intent(in) :: one, other !! roots
      integer :: entry, opposite

      if (one == other) return
      ! The shorter list tells as well whether a concave edge is between them.
      entry = forest%first(merge(one, other, forest%n(one) <= forest%n(other)))
      opposite = merge(other, one, forest%n(one) <= forest%n(other))
      do while (entry > 0)
        if (root_of(forest, forest%beyond(entry)) == opposite) return
        entry = forest%next(entry)
      end do
      call unite(one, other, forest)
    end subroutine join_two

  end subroutine join_faces

  !> Make one tree of two.
  pure subroutine unite(one, other, forest)
    integer, intent(in) :: one, other !! roots
    type(forest_t), intent(inout) :: forest
    integer :: small, large

    small = merge(one, other, forest%n_faces(one) <= forest%n_faces(other))
    large = one + other - small
    forest%parent(small) = large
    forest%n_faces(large) = forest%n_faces(large) + forest%n_faces(small)
    if (forest%n(small) == 0) return
    forest%next(forest%last(small)) = forest%first(large)
    forest%first(large) = forest%first(small)
    if (forest%last(large) == 0) forest%last(large) = forest%last(small)
    forest%n(large) = forest%n(large) + forest%n(small)
  end subroutine unite

  !> Join trees that are smaller than a slave's face with what they meet at concave edges.
  pure subroutine absorb_small(faces, x, joints, least, forest)
    integer, intent(in) :: faces(:, :)
    real(wp), intent(in) :: x(:, :)       !! [length]
    type(joints_t), intent(in) :: joints
    real(wp), intent(in) :: least         !! area of a slave's face [length^2]
    type(forest_t), intent(inout) :: forest
    real(wp) :: area(size(faces, 2)), total !! of each root's tree [length^2]
    integer :: f, i, one, other

    area = 0.0_wp
    do f = 1, size(faces, 2)
      one = root_of(forest, f)
      area(one) = area(one) + area_of_face(x(:, faces(:count(faces(:, f) > 0), f)))
    end do
    do i = 1, joints%n
      if (joints%joint(3, i) /= step) cycle
      do f = 1, 2
        one = root_of(forest, joints%joint(f, i))
        area(one) = max(area(one), least)
      end do
    end do
    do i = 1, joints%n
      if (joints%joint(3, i) /= concave) cycle
      one = root_of(forest, joints%joint(1, i))
      other = root_of(forest, joints%joint(2, i))
      if (one == other .or. min(area(one), area(other)) >= least) cycle
      total = area(one) + area(other)
      call unite(one, other, forest)
      area(root_of(forest, one)) = total
    end do
  end subroutine absorb_small

  !> The area of a triangle or quadrilateral, by its diagonals.
  pure real(wp) function area_of_face(x) result(area)
    real(wp), intent(in) :: x(:, :) !! (3,3) or (3,4) [length]

    associate (last => size(x, 2))
      area = 0.5_wp*norm2(cross(x(:, last - 1) - x(:, 1), x(:, last) - x(:, last - 2)))
    end associate
  end function area_of_face

  pure integer function root_of(forest, face) result(root)
    type(forest_t), intent(in) :: forest
    integer, intent(in) :: face

    root = face
    do while (forest%parent(root) > 0)
      root = forest%parent(root)
    end do
  end function root_of

  !> Give each tree the lowest number that no tree beyond its concave edges has, in the order of
  !> their first faces.
  pure subroutine number_sides(forest, side)
    type(forest_t), intent(in) :: forest
    integer, intent(inout) :: side(:) !! (n_faces)
    integer :: of_root(size(side)), f, root, entry
    logical, allocatable :: taken(:)

    of_root = 0
    do f = 1, size(side)
      root = root_of(forest, f)
      if (of_root(root) == 0) then
        allocate (taken(0:maxval(of_root) + 1), source=.false.)
        entry = forest%first(root)
        do while (entry > 0)
          ! Of a tree that took in a small one the edge between both is within: number 0 as yet.
          taken(of_root(root_of(forest, forest%beyond(entry)))) = .true.
          entry = forest%next(entry)
        end do
        of_root(root) = findloc(taken(1:), .false., dim=1)
        deallocate (taken)
      end if
      side(f) = of_root(root)
    end do
  end subroutine number_sides

end module master_sides_mod
