!> What two faces share: their overlap, seen along the normal of one of them, and integrals over it.
!>
!> docs/theory.md (11.1), (11.2).
module face_overlap_mod
  use kinds_mod, only: wp
  use cells_mod, only: face_corners, face_nodes
  use small_matrix_mod, only: cross
  implicit none
  private

  public :: overlap_t, plane_t, polygon_t, plane_of_face, outward_normal, doubled_area, &
    find_overlap, opposite_weights, weigh
  public :: areas_of_nodes, in_plane, seen_from, find_common, keep_positive, area_of
  public :: few_points, few_weights, some_points, some_weights, more_points, more_weights, &
    many_points, many_weights
  public :: max_corners, smallest, evenness, even_enough, speck, halves_of, most_halvings

  !> The plane of a slave face, in which overlaps are found.
  type :: plane_t
    real(wp) :: origin(3) = 0.0_wp    !! the mean of the face's nodes [length]
    real(wp) :: axis(3, 3) = 0.0_wp
    !! columns: two unit vectors in the plane, the outward normal [-]
    integer  :: n = 0                 !! corners of the face
    real(wp) :: corner(2, face_corners) = 0.0_wp !! the face in it, anticlockwise [length]
    real(wp) :: area = 0.0_wp         !! [length^2]
    real(wp) :: warp = 0.0_wp         !! how far the face's corners are from it [length]
  end type plane_t

  !> Integrals over an overlap, of the slave's shape functions N and the master's.
  type :: overlap_t
    real(wp) :: area = 0.0_wp            !! 0: nothing is shared [length^2]
    real(wp) :: lumped(face_nodes) = 0.0_wp            !! int N_a [length^2]
    real(wp) :: mass(face_nodes, face_nodes) = 0.0_wp  !! int N_a N_b [length^2]
    real(wp) :: mixed(face_nodes, face_nodes) = 0.0_wp
    !! int N_a N_k, k of the master's nodes [length^2]
    real(wp) :: facing(3, face_nodes) = 0.0_wp
    !! int N_a n, n of the master face, outward [length^2]
    real(wp) :: entered(face_nodes) = 0.0_wp
    !! int N_a g where the gap g is below 0 [length^3]
    real(wp) :: least_gap = huge(1.0_wp) !! at its corners and the points of the quadrature [length]
    real(wp) :: nearest = huge(1.0_wp)   !! the same at its corners alone [length]
    real(wp) :: moments(6) = 0.0_wp
    !! int 1, xi, eta, xi xi, xi eta, eta eta, natural coordinates of a slave face with mid-side
    !! nodes [length^2]
  end type overlap_t

  !> A slave face and a master face in the plane of the slave's.
  type :: two_faces_t
    real(wp) :: slave(2, 4) = 0.0_wp, master(2, 4) = 0.0_wp !! their maps [length]
    logical :: slave_is_triangle = .false., master_is_triangle = .false.
    real(wp) :: slave_jacobian(face_corners) = 1.0_wp, master_jacobian(face_corners) = 1.0_wp
    !! of their maps at the corners: as linear as shape functions are [length^2]
    real(wp) :: slave_height(face_corners) = 0.0_wp, master_height(face_corners) = 0.0_wp
    !! of their nodes, along the master's normal [length]
  end type two_faces_t

  ! Those of two faces, and what three edges and three heights cut off.
  integer,  parameter :: max_corners = 2*face_corners + 6

  !> A convex polygon in a plane.
  type :: polygon_t
    integer :: n = 0                                !! corners; 0: nothing is left
    real(wp) :: corner(2, max_corners) = 0.0_wp     !! anticlockwise [length]
  end type polygon_t

  real(wp), parameter :: smallest = 1.0e-12_wp !! overlap of a face that counts [-]
  ! Over less than this of a face shape functions are nearly linear, however distorted it is.
  real(wp), parameter :: little = 1.0e-2_wp    !! [-]
  ! Where a face is nearly a triangle its shape functions are fractions with a pole close by: a
  ! triangle is halved where the least over the largest Jacobian at its corners is less than this.
  ! That ends by itself where no Jacobian of the faces is 0, however small, at parts that do not
  ! count; else at this part.
  real(wp), parameter :: even_enough = 0.7_wp, speck = 1.0e-6_wp !! [-]
  integer, parameter :: most_halvings = 60
  !! of a triangle: it is a speck of any face then, however large beside it it was

  ! What a rule leaves of integrals of two shape functions over a face, beside its area, by how far
  ! the face is from a parallelogram: seven points of_few d^2, twelve of_some d^3, measured with
  ! random faces up to d = 0.1 at which both faces are the same. d: 1 - evenness.
  real(wp), parameter :: of_few = 4.0e-4_wp, of_some = 1.0e-5_wp !! [-]
  real(wp), parameter :: negligible = 1.0e-12_wp                 !! such a rest [-]

  ! Seven points on a triangle, exact to degree 5 (Radon): what faces that are parallelograms need.
  integer,  parameter :: n_few = 7
  real(wp), parameter :: near = (6.0_wp - sqrt(15.0_wp))/21.0_wp
  real(wp), parameter :: far = (6.0_wp + sqrt(15.0_wp))/21.0_wp
  real(wp), parameter :: of_near = (155.0_wp - sqrt(15.0_wp))/1200.0_wp
  real(wp), parameter :: of_far = (155.0_wp + sqrt(15.0_wp))/1200.0_wp
  real(wp), parameter :: few_points(2, n_few) = reshape([ &
    1.0_wp/3.0_wp, 1.0_wp/3.0_wp, &
    near, near, 1.0_wp - 2.0_wp*near, near, near, 1.0_wp - 2.0_wp*near, &
    far, far, 1.0_wp - 2.0_wp*far, far, far, 1.0_wp - 2.0_wp*far], [2, n_few])
  real(wp), parameter :: few_weights(n_few) = [9.0_wp/40.0_wp, of_near, of_near, of_near, &
    of_far, of_far, of_far]

  ! Twelve points, exact to degree 6 (Strang and Fix): what products of shape functions of second
  ! order on parallelograms need.
  integer,  parameter :: n_some = 12
  real(wp), parameter :: p = 0.24928674517091041_wp, q = 0.06308901449150223_wp, &
    s = 0.05314504984481694_wp, t = 0.31035245103378441_wp, u = 1.0_wp - s - t
  real(wp), parameter :: some_points(2, n_some) = reshape([ &
    p, p, p, 1.0_wp - 2.0_wp*p, 1.0_wp - 2.0_wp*p, p, q, q, q, 1.0_wp - 2.0_wp*q, &
    1.0_wp - 2.0_wp*q, q, s, t, t, s, s, u, u, s, t, u, u, t], [2, n_some])
  real(wp), parameter :: some_weights(n_some) = [spread(0.11678627572637938_wp, 1, 3), &
    spread(0.05084490637020682_wp, 1, 3), spread(0.08285107561837357_wp, 1, 6)]

  ! Sixteen points, exact to degree 8 (Dunavant): what faces that bow need.
  integer,  parameter :: n_more = 16
  real(wp), parameter :: c = 0.081414823414554_wp, d = 0.459292588292723_wp, &
    e = 0.658861384496480_wp, f = 0.170569307751760_wp, g = 0.898905543365938_wp, &
    h = 0.050547228317031_wp, k = 0.008394777409958_wp, l = 0.263112829634638_wp, &
    m = 1.0_wp - k - l
  real(wp), parameter :: more_points(2, n_more) = reshape([1.0_wp/3.0_wp, 1.0_wp/3.0_wp, &
    c, d, d, c, d, d, e, f, f, e, f, f, g, h, h, g, h, h, k, l, l, k, k, m, m, k, l, m, m, l], &
    [2, n_more])
  real(wp), parameter :: more_weights(n_more) = [0.144315607677787_wp, &
    spread(0.095091634267285_wp, 1, 3), spread(0.103217370534718_wp, 1, 3), &
    spread(0.032458497623198_wp, 1, 3), spread(0.027230314174435_wp, 1, 6)]

  ! Gauss and Jacobi, five points each, on the unit interval: their product on a triangle is exact
  ! to degree 9.
  integer,  parameter :: n_line = 5
  real(wp), parameter :: jacobi(n_line) = [0.03980985705146894_wp, 0.198013417873608_wp, &
    0.43797481024738616_wp, 0.695464273353636_wp, 0.9014649142011736_wp]
  real(wp), parameter :: jacobi_weight(n_line) = [0.19356318045330273_wp, 0.33434927618873944_wp, &
    0.29277397416933926_wp, 0.14781774014523327_wp, 0.03149582904338454_wp]
  real(wp), parameter :: gauss(n_line) = [0.04691007703066802_wp, 0.23076534494715845_wp, &
    0.5_wp, 0.7692346550528415_wp, 0.9530899229693319_wp]
  real(wp), parameter :: gauss_weight(n_line) = [0.11846344252809471_wp, 0.2393143352496831_wp, &
    0.2844444444444445_wp, 0.2393143352496831_wp, 0.11846344252809471_wp]
  real(wp), parameter :: of_jacobi(n_line**2) = reshape(spread(jacobi, 1, n_line), [n_line**2])
  real(wp), parameter :: of_gauss(n_line**2) = reshape(spread(gauss, 2, n_line), [n_line**2])
  real(wp), parameter :: many_points(2, n_line**2) = transpose(reshape([of_jacobi, &
    (1.0_wp - of_jacobi)*of_gauss], [n_line**2, 2]))
  real(wp), parameter :: many_weights(n_line**2) = reshape(spread(jacobi_weight, 1, n_line), &
    [n_line**2])*reshape(spread(gauss_weight, 2, n_line), [n_line**2]) !! they add up to 1

contains

  !> The outward unit normal of a face: of its diagonals, or of a triangle's edges.
  pure function outward_normal(x) result(n)
    real(wp), intent(in) :: x(:, :) !! (3,3) or (3,4) anticlockwise from outside [length]
    real(wp) :: n(3)

    n = doubled_area(x)
    n = n/max(norm2(n), tiny(1.0_wp))
  end function outward_normal

  !> Twice the area of a face along its outward normal.
  pure function doubled_area(x) result(n)
    real(wp), intent(in) :: x(:, :) !! (3,3) or (3,4) anticlockwise from outside [length]
    real(wp) :: n(3)                !! [length^2]

    if (size(x, 2) == 3) then
      n = cross(x(:, 2) - x(:, 1), x(:, 3) - x(:, 1))
    else
      n = cross(x(:, 3) - x(:, 1), x(:, 4) - x(:, 2))
    end if
  end function doubled_area

  !> The plane through a slave face's centre, across the normal of its diagonals.
  pure type(plane_t) function plane_of_face(x) result(plane)
    real(wp), intent(in) :: x(:, :) !! (3,3) or (3,4) anticlockwise from outside [length]
    real(wp) :: n(3), along(3)
    integer :: i

    n = outward_normal(x)
    along = x(:, 2) - x(:, 1)
    along = along - dot_product(along, n)*n
    along = along/max(norm2(along), tiny(1.0_wp))
    plane%n = size(x, 2)
    plane%origin = sum(x, 2)/real(plane%n, wp)
    plane%axis = reshape([along, cross(n, along), n], [3, 3])
    plane%corner(:, :plane%n) = in_plane(plane, x)
    plane%area = area_of(plane%corner(:, :plane%n))
    do i = 1, plane%n
      plane%warp = max(plane%warp, abs(dot_product(n, x(:, i) - plane%origin)))
    end do
  end function plane_of_face

  !> int N_a over a slave face: a sixth of the sum of two areas, of the face and of the triangle of
  !> the corner and its neighbours.
  pure function areas_of_nodes(plane) result(area)
    type(plane_t), intent(in) :: plane
    real(wp) :: area(plane%n) !! [length^2]

    area = plane%area/3.0_wp
    if (plane%n > 3) area = (plane%area + 0.5_wp*jacobians(plane%corner(:, :plane%n)))/6.0_wp
  end function areas_of_nodes

  pure function in_plane(plane, x) result(flat)
    type(plane_t), intent(in) :: plane
    real(wp), intent(in) :: x(:, :)     !! (3,n) [length]
    real(wp) :: flat(2, size(x, 2))     !! [length]
    real(wp) :: place(3)
    integer :: i

    do i = 1, size(x, 2)
      place = seen_from(plane, x(:, i))
      flat(:, i) = place(:2)
    end do
  end function in_plane

  !> A place in a plane, and above it.
  pure function seen_from(plane, x) result(place)
    type(plane_t), intent(in) :: plane
    real(wp), intent(in) :: x(3)        !! [length]
    real(wp) :: place(3)                !! [length]
    real(wp) :: arm(3)

    arm = x - plane%origin
    associate (axis => plane%axis)
      place = [arm(1)*axis(1, 1) + arm(2)*axis(2, 1) + arm(3)*axis(3, 1), &
        arm(1)*axis(1, 2) + arm(2)*axis(2, 2) + arm(3)*axis(3, 2), &
        arm(1)*axis(1, 3) + arm(2)*axis(2, 3) + arm(3)*axis(3, 3)]
    end associate
  end function seen_from

  !> The polygon that a slave face and one that faces it have in common, in the plane of the slave;
  !> it has no corners where that is next to nothing.
  pure type(polygon_t) function find_common(plane, flat) result(shared)
    type(plane_t), intent(in) :: plane     !! of the slave face
    real(wp), intent(in) :: flat(:, :)     !! (2,3) or (2,4) corners of the other [length]
    integer :: k

    do k = 1, 2
      if (minval(flat(k, :)) >= maxval(plane%corner(k, :plane%n)) - smallest*sqrt(plane%area) &
        .or. maxval(flat(k, :)) <= minval(plane%corner(k, :plane%n)) + smallest*sqrt( &
        plane%area)) return
    end do
    shared%n = size(flat, 2)
    shared%corner(:, :shared%n) = flat(:, shared%n:1:-1) ! from the slave it is clockwise
    call clip(plane%corner(:, :plane%n), shared)
    if (area_of(shared%corner(:, :shared%n)) < smallest*plane%area) shared%n = 0
  end function find_common

  !> The integrals over what a slave face and a master face see of each other.
  pure type(overlap_t) function find_overlap(plane, slave, master, seen, moved, roughly) &
    result(overlap)
    type(plane_t), intent(in) :: plane     !! of the slave face
    real(wp), intent(in) :: slave(:, :)    !! (3,3) or (3,4) its nodes, for gaps [length]
    real(wp), intent(in) :: master(:, :)   !! (3,3) or (3,4) anticlockwise from outside [length]
    type(polygon_t), intent(in) :: seen(:) !! parts of the plane
    real(wp), intent(in), optional :: moved(:, :)
    !! (3,3) or (3,4) how far from there its nodes are, for gaps; left out: not [length]
    logical, intent(in), optional :: roughly
    !! by the rule of parallelograms, for derivatives: no rest of it that leaps
    type(two_faces_t) :: faces
    real(wp) :: flat(2, size(master, 2)), centre(2), corner(2, 3)
    real(wp) :: normal(3), even, defect, share
    real(wp), parameter :: folded = 1.0e-3_wp !! of the largest Jacobian, turned over [-]
    integer :: i, k, left

    flat = in_plane(plane, master)
    normal = outward_normal(master)
    faces%slave = map_of_face(plane%corner(:, :plane%n))
    faces%master = map_of_face(flat)
    faces%slave_is_triangle = plane%n == 3
    faces%master_is_triangle = size(master, 2) == 3
    do i = 1, plane%n
      faces%slave_height(i) = dot_product(normal, slave(:, i) - plane%origin)
    end do
    do i = 1, size(master, 2)
      faces%master_height(i) = dot_product(normal, master(:, i) - plane%origin)
      if (present(moved)) faces%master_height(i) = faces%master_height(i) + dot_product(normal, &
        moved(:, i))
    end do
    faces%slave_jacobian = jacobians(plane%corner(:, :plane%n))
    faces%master_jacobian = jacobians(flat)
    even = min(evenness(faces%slave_jacobian), evenness(faces%master_jacobian))
    defect = 1.0_wp - even
    if (present(roughly)) defect = merge(0.0_wp, defect, roughly)
    ! Places of a folded face are of several parts of it, and no parts are even along the fold. No
    ! increment ends with one.
    left = merge(0, most_halvings, even < -folded)
    do k = 1, size(seen)
      associate (n => seen(k)%n, polygon => seen(k)%corner(:, :seen(k)%n))
        ! Of flat faces what is nearest is a corner.
        do i = 1, n
          overlap%nearest = min(overlap%nearest, gap_at(faces, polygon(:, i)))
        end do
        share = area_of(polygon)
        overlap%area = overlap%area + share
        share = share/plane%area
        if (of_few*defect**2*share <= negligible .or. (size(master, 2) == 3 .and. share < little)) &
          then
          call add_fan(faces, polygon, few_points, few_weights, overlap)
        else if (of_some*defect**3*share <= negligible) then
          call add_fan(faces, polygon, some_points, some_weights, overlap)
        else
          centre = sum(polygon, 2)/real(n, wp)
          do i = 1, n
            corner(:, 1) = centre
            corner(:, 2) = polygon(:, i)
            corner(:, 3) = polygon(:, merge(1, i + 1, i == n))
            if (area_of(corner) > 0.0_wp) call add_halved(faces, corner, merge(smallest, &
              speck, even > 0.0_wp)*plane%area, left, overlap)
          end do
        end if
      end associate
    end do
    overlap%least_gap = min(overlap%least_gap, overlap%nearest)
    call turn_towards(normal, overlap)
  end function find_overlap

  !> Take a share of the integrals over an overlap, all of them the same: what rows are divided by
  !> has it, too.
  pure subroutine weigh(share, overlap)
    real(wp), intent(in) :: share    !! [-]
    type(overlap_t), intent(inout) :: overlap

    if (share >= 1.0_wp) return
    overlap%area = share*overlap%area
    overlap%lumped = share*overlap%lumped
    overlap%mass = share*overlap%mass
    overlap%mixed = share*overlap%mixed
    overlap%facing = share*overlap%facing
    overlap%entered = share*overlap%entered
    overlap%moments = share*overlap%moments
  end subroutine weigh

  !> The gap between two faces at a point of the plane.
  pure real(wp) function gap_at(faces, x) result(gap)
    type(two_faces_t), intent(in) :: faces
    real(wp), intent(in) :: x(2)           !! [length]

    gap = dot_product(faces%slave_height, shape_at(faces%slave, faces%slave_is_triangle, x)) - &
      dot_product(faces%master_height, shape_at(faces%master, faces%master_is_triangle, x))
  end function gap_at

  !> Everywhere a flat master has one normal.
  pure subroutine turn_towards(normal, overlap)
    real(wp), intent(in) :: normal(3)
    type(overlap_t), intent(inout) :: overlap
    integer :: a

    do a = 1, face_corners
      overlap%facing(:, a) = overlap%lumped(a)*normal
    end do
  end subroutine turn_towards

  !> The shape functions of a master face at the place opposite a corner of the slave face; below 0
  !> where that is beyond its edges.
  pure function opposite_weights(plane, corner, master) result(n)
    type(plane_t), intent(in) :: plane     !! of the slave face
    integer, intent(in) :: corner          !! its number
    real(wp), intent(in) :: master(:, :)   !! (3,3) or (3,4) its nodes [length]
    real(wp) :: n(face_corners)
    real(wp), parameter :: rounding = 1.0e-9_wp !! of the face
    real(wp) :: seen(2, size(master, 2)), left(2)

    seen = in_plane(plane, master)
    n = shape_at(map_of_face(seen), size(master, 2) == 3, plane%corner(:, corner))
    ! Beyond some line in the plane a face's map reaches nothing: Newton's method ends anywhere.
    left = matmul(seen, n(:size(seen, 2))) - plane%corner(:, corner)
    if (.not. norm2(left) <= rounding*norm2(seen(:, 3) - seen(:, 1))) n = -1.0_wp
  end function opposite_weights

  !> Add the integrals over an overlap, cut into triangles from its first corner.
  pure subroutine add_fan(faces, polygon, point, weight, overlap)
    type(two_faces_t), intent(in) :: faces
    real(wp), intent(in) :: polygon(:, :)          !! (2,n) corners [length]
    real(wp), intent(in) :: point(:, :), weight(:) !! as of add_points
    type(overlap_t), intent(inout) :: overlap
    integer :: i

    do i = 2, size(polygon, 2) - 1
      if (area_of(polygon(:, [1, i, i + 1])) > 0.0_wp) call add_points(faces, &
        polygon(:, [1, i, i + 1]), point, weight, overlap)
    end do
  end subroutine add_fan

  !> Add the integrals over one triangle of an overlap, halved where the Jacobians change much.
  pure recursive subroutine add_halved(faces, corner, least, left, overlap)
    type(two_faces_t), intent(in) :: faces
    real(wp), intent(in) :: corner(2, 3)  !! of the triangle [length]
    real(wp), intent(in) :: least         !! area that is not halved [length^2]
    integer, intent(in) :: left           !! so often it may be
    type(overlap_t), intent(inout) :: overlap
    real(wp) :: of_slave(3), of_master(3), halves(2, 3, 2)
    integer :: k

    do k = 1, 3
      of_slave(k) = dot_product(faces%slave_jacobian, shape_at(faces%slave, &
        faces%slave_is_triangle, corner(:, k)))
      of_master(k) = dot_product(faces%master_jacobian, shape_at(faces%master, &
        faces%master_is_triangle, corner(:, k)))
    end do
    if (left == 0 .or. area_of(corner) < least .or. min(evenness(of_slave), evenness(of_master)) > &
      even_enough) then
      call add_points(faces, corner, many_points, many_weights, overlap)
      return
    end if
    halves = halves_of(corner)
    call add_halved(faces, halves(:, :, 1), least, left - 1, overlap)
    call add_halved(faces, halves(:, :, 2), least, left - 1, overlap)
  end subroutine add_halved

  !> The halves of a triangle, cut across its longest edge. Cut in four, one that comes down to a
  !> narrow end, as on the axis of a body of revolution, would be millions there.
  pure function halves_of(corner) result(halves)
    real(wp), intent(in) :: corner(2, 3) !! [length]
    real(wp) :: halves(2, 3, 2)          !! [length]
    integer :: longest

    longest = maxloc(norm2(cshift(corner, 1, dim=2) - corner, dim=1), 1)
    halves = spread(cshift(corner, longest - 1, dim=2), 3, 2)
    halves(:, 2, 1) = 0.5_wp*(halves(:, 1, 2) + halves(:, 2, 2))
    halves(:, 1, 2) = halves(:, 2, 1)
  end function halves_of

  !> The Jacobians at the corners of a flat face, either way round; 1 of a triangle, below 0 where
  !> a face is folded.
  pure function jacobians(corner) result(jacobian)
    real(wp), intent(in) :: corner(:, :) !! (2,3) or (2,4) [length]
    real(wp) :: jacobian(face_corners)   !! [length^2]
    integer, parameter :: next(4) = [2, 3, 4, 1], last(4) = [4, 1, 2, 3]
    real(wp) :: along(2, 4), back(2, 4)

    jacobian = 1.0_wp
    if (size(corner, 2) == 3) return
    along = corner(:, next) - corner
    back = corner(:, last) - corner
    jacobian = along(1, :)*back(2, :) - along(2, :)*back(1, :)
    jacobian = jacobian*sign(1.0_wp, sum(jacobian))
  end function jacobians

  !> The least over the largest Jacobian: 1 of a parallelogram, 0 of what is a triangle.
  pure real(wp) function evenness(jacobian)
    real(wp), intent(in) :: jacobian(:) !! [length^2]

    evenness = minval(jacobian)/max(maxval(jacobian), tiny(1.0_wp))
  end function evenness

  !> Add the integrals over one triangle of an overlap, by the points of a rule.
  pure subroutine add_points(faces, corner, point, weight, overlap)
    type(two_faces_t), intent(in) :: faces
    real(wp), intent(in) :: corner(2, 3)  !! of the triangle [length]
    real(wp), intent(in) :: point(:, :), weight(:) !! (2,n), (n) of the rule [-]
    type(overlap_t), intent(inout) :: overlap
    real(wp) :: x(2), n(face_corners), m(face_corners), area, gap
    integer :: i, b

    area = area_of(corner)
    do i = 1, size(weight)
      x = corner(:, 1) + point(1, i)*(corner(:, 2) - corner(:, 1)) + &
        point(2, i)*(corner(:, 3) - corner(:, 1))
      n = shape_at(faces%slave, faces%slave_is_triangle, x)
      m = shape_at(faces%master, faces%master_is_triangle, x)
      gap = dot_product(faces%slave_height, n) - dot_product(faces%master_height, m)
      overlap%least_gap = min(overlap%least_gap, gap)
      associate (part => area*weight(i)*n)
        overlap%lumped(:4) = overlap%lumped(:4) + part
        if (gap < 0.0_wp) overlap%entered(:4) = overlap%entered(:4) + part*gap
        do b = 1, face_corners
          overlap%mass(:4, b) = overlap%mass(:4, b) + part*n(b)
          overlap%mixed(:4, b) = overlap%mixed(:4, b) + part*m(b)
        end do
      end associate
    end do
  end subroutine add_points

  !> The part of a convex polygon that lies in another one, both anticlockwise: edge by edge of the
  !> window what is outside is cut off (Sutherland and Hodgman).
  pure subroutine clip(window, polygon)
    real(wp), intent(in) :: window(:, :)         !! (2,m) [length]
    type(polygon_t), intent(inout) :: polygon
    real(wp) :: edge(2), f(max_corners)
    integer :: e, k

    do e = 1, size(window, 2)
      edge = window(:, merge(1, e + 1, e == size(window, 2))) - window(:, e)
      do k = 1, polygon%n
        f(k) = edge(1)*(polygon%corner(2, k) - window(2, e)) - edge(2)*(polygon%corner(1, k) - &
          window(1, e))
      end do
      if (all(f(:polygon%n) > 0.0_wp)) cycle
      call keep_positive(f(:polygon%n), polygon)
    end do
  end subroutine clip

  !> The part of a convex polygon where a linear function is above 0.
  pure subroutine keep_positive(f, polygon)
    real(wp), intent(in) :: f(:)                 !! at the corners
    type(polygon_t), intent(inout) :: polygon
    type(polygon_t) :: before
    integer :: i, j

    before = polygon
    polygon%n = 0
    do i = 1, before%n
      j = merge(1, i + 1, i == before%n)
      if (f(i) >= 0.0_wp) call append(before%corner(:, i), polygon)
      if (f(i) > 0.0_wp .neqv. f(j) > 0.0_wp) then
        if (abs(f(i)) > 0.0_wp .and. abs(f(j)) > 0.0_wp) call append(before%corner(:, i) + &
          f(i)/(f(i) - f(j))*(before%corner(:, j) - before%corner(:, i)), polygon)
      end if
    end do
    if (polygon%n < 3) polygon%n = 0
  end subroutine keep_positive

  !> Rounding makes no more corners.
  pure subroutine append(x, polygon)
    real(wp), intent(in) :: x(2)
    type(polygon_t), intent(inout) :: polygon

    if (polygon%n == max_corners) return
    polygon%n = polygon%n + 1
    polygon%corner(:, polygon%n) = x
  end subroutine append

  pure real(wp) function area_of(corner)
    real(wp), intent(in) :: corner(:, :) !! (2,n) anticlockwise [length]
    integer :: i, n

    n = size(corner, 2)
    area_of = 0.0_wp
    do i = 2, n - 1
      area_of = area_of + 0.5_wp*((corner(1, i) - corner(1, 1))*(corner(2, i + 1) - corner(2, 1)) &
        - (corner(2, i) - corner(2, 1))*(corner(1, i + 1) - corner(1, 1)))
    end do
  end function area_of

  !> The map of a flat face from its own coordinates: a plane's place is
  !> map(:, 1) + map(:, 2)*xi + map(:, 3)*eta + map(:, 4)*xi*eta.
  pure function map_of_face(corner) result(map)
    real(wp), intent(in) :: corner(:, :) !! (2,3) or (2,4) [length]
    real(wp) :: map(2, 4)                !! [length]

    if (size(corner, 2) == 3) then
      map(:, 1) = corner(:, 1)
      map(:, 2) = corner(:, 2) - corner(:, 1)
      map(:, 3) = corner(:, 3) - corner(:, 1)
      map(:, 4) = 0.0_wp
    else
      map(:, 1) = 0.25_wp*(corner(:, 1) + corner(:, 2) + corner(:, 3) + corner(:, 4))
      map(:, 2) = 0.25_wp*(corner(:, 2) - corner(:, 1) + corner(:, 3) - corner(:, 4))
      map(:, 3) = 0.25_wp*(corner(:, 4) - corner(:, 1) + corner(:, 3) - corner(:, 2))
      map(:, 4) = 0.25_wp*(corner(:, 1) - corner(:, 2) + corner(:, 3) - corner(:, 4))
    end if
  end function map_of_face

  !> The shape functions of a flat face at a point of its plane; the fourth of a triangle is 0.
  pure function shape_at(map, is_triangle, x) result(n)
    real(wp), intent(in) :: map(2, 4)      !! of the face [length]
    logical, intent(in) :: is_triangle
    real(wp), intent(in) :: x(2)           !! [length]
    real(wp) :: n(4)
    ! Newton's method squares what is left: behind a step of this nothing is but rounding.
    real(wp), parameter :: settled = 1.0e-9_wp
    integer,  parameter :: max_newton = 30
    real(wp) :: xi(2), step(2), left(2), a(2), b(2), det
    integer :: i

    xi = 0.0_wp
    do i = 1, max_newton
      left = x - map(:, 1) - map(:, 2)*xi(1) - map(:, 3)*xi(2) - map(:, 4)*xi(1)*xi(2)
      a = map(:, 2) + map(:, 4)*xi(2)
      b = map(:, 3) + map(:, 4)*xi(1)
      det = a(1)*b(2) - a(2)*b(1)
      if (.not. abs(det) > 0.0_wp) exit
      step(1) = (left(1)*b(2) - left(2)*b(1))/det
      step(2) = (a(1)*left(2) - a(2)*left(1))/det
      xi = xi + step
      if (is_triangle .or. max(abs(step(1)), abs(step(2))) < settled) exit
    end do
    if (is_triangle) then
      n = [1.0_wp - xi(1) - xi(2), xi(1), xi(2), 0.0_wp]
    else
      n(1) = 0.25_wp*(1.0_wp - xi(1))*(1.0_wp - xi(2))
      n(2) = 0.25_wp*(1.0_wp + xi(1))*(1.0_wp - xi(2))
      n(3) = 0.25_wp*(1.0_wp + xi(1))*(1.0_wp + xi(2))
      n(4) = 0.25_wp*(1.0_wp - xi(1))*(1.0_wp + xi(2))
    end if
  end function shape_at

end module face_overlap_mod
