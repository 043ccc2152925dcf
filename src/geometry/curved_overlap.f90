!> What two faces share where either has nodes in the middles of its edges: overlaps of parts
!> between their nodes, and integrals over these with the shape functions of the whole faces where
!> their points lie.
!>
!> docs/theory.md section 11.
module curved_overlap_mod
  use kinds_mod, only: wp
  use cells_mod, only: face_nodes
  use face_shapes_mod, only: evaluate_face, places_of_nodes, is_triangle
  use small_matrix_mod, only: cross
  use face_overlap_mod, only: overlap_t, plane_t, polygon_t, in_plane, area_of, few_points, &
    few_weights, some_points, some_weights, many_points, many_weights, evenness, &
    even_enough, speck, halves_of, most_halvings
  implicit none
  private

  public :: whole_face_t, find_curved_overlap, whole_face, patch_t, make_patch, values_at_nodes

  !> A face with all of its nodes.
  type :: whole_face_t
    integer :: n = 0                            !! nodes
    real(wp) :: x(3, face_nodes) = 0.0_wp       !! where they are [length]
    real(wp) :: moved(3, face_nodes) = 0.0_wp   !! how far from there they are, for gaps [length]
    real(wp) :: flat(2, face_nodes) = 0.0_wp    !! the same in a plane [length]
    logical :: is_affine = .false.
    !! shape functions are nearly polynomials in the plane: edges are nearly straight, and opposite
    !! ones of four nearly parallel
  end type whole_face_t

  !> What is covered of a face, in coordinates of its own: with its middle at 0, about as long as
  !> wide.
  type :: patch_t
    real(wp) :: middle(2) = 0.0_wp     !! natural coordinates [-]
    real(wp) :: scale(2, 2) = 0.0_wp   !! its coordinates from natural ones less the middle [-]
  end type patch_t

contains

  !> A face from its nodes.
  pure type(whole_face_t) function whole_face(x, moved) result(face)
    real(wp), intent(in) :: x(:, :) !! (3,n) corners, then the middles of edges [length]
    real(wp), intent(in), optional :: moved(:, :) !! (3,n) of the face; left out: 0 [length]
    ! Of an edge. Rules for polynomials then give weights to 1e-6 [-]
    real(wp), parameter :: straight = 1.0e-2_wp
    integer :: k, next, corners

    face%n = size(x, 2)
    face%x(:, :face%n) = x
    if (present(moved)) face%moved(:, :face%n) = moved
    face%is_affine = is_triangle(face%n)
    if (.not. face%is_affine) face%is_affine = norm2(x(:, 1) - x(:, 2) + x(:, 3) - x(:, 4)) <= &
      straight*min(norm2(x(:, 2) - x(:, 1)), norm2(x(:, 3) - x(:, 2)))
    if (face%n <= 4) return
    corners = face%n/2
    do k = 1, corners
      next = 1 + modulo(k, corners)
      face%is_affine = face%is_affine .and. norm2(x(:, corners + k) - 0.5_wp*(x(:, k) + &
        x(:, next))) <= straight*norm2(x(:, next) - x(:, k))
    end do
  end function whole_face

  !> The patch with the moments of an overlap, as of `overlap_t`.
  !>
  !> Polynomials of the patch's coordinates are those of the face: of a triangle in any direction,
  !> of a quadrilateral along its own coordinates.
  pure type(patch_t) function make_patch(n, moments) result(patch)
    integer, intent(in) :: n            !! nodes of the face, 6 or 8
    real(wp), intent(in) :: moments(6)  !! [length^2]
    real(wp) :: spread(3), length(2), lean

    patch%middle = moments(2:3)/moments(1)
    spread = moments(4:6)/moments(1) - patch%middle([1, 1, 2])*patch%middle([1, 2, 2])
    length(1) = sqrt(max(tiny(1.0_wp), spread(1)))
    lean = merge(spread(2)/length(1), 0.0_wp, is_triangle(n))
    length(2) = sqrt(max(tiny(1.0_wp), spread(3) - lean**2))
    patch%scale(1, 1) = 1.0_wp/length(1)
    patch%scale(2, 1) = -lean/product(length)
    patch%scale(2, 2) = 1.0_wp/length(2)
  end function make_patch

  !> The polynomials that shape functions of a face of second order consist of, in the coordinates
  !> of a patch.
  pure function polynomials(n, patch, xi) result(p)
    integer, intent(in) :: n             !! nodes of the face, 6 or 8
    type(patch_t), intent(in) :: patch
    real(wp), intent(in) :: xi(2)        !! natural coordinates [-]
    real(wp) :: p(n), all_of_them(face_nodes), t(2)

    t = matmul(patch%scale, xi - patch%middle)
    all_of_them = [1.0_wp, t(1), t(2), t(1)**2, t(1)*t(2), t(2)**2, t(1)**2*t(2), t(1)*t(2)**2]
    p = all_of_them(:n)
  end function polynomials

  !> The same at the nodes of the face, a column a node.
  pure function values_at_nodes(n, patch) result(values)
    integer, intent(in) :: n             !! nodes of the face, 6 or 8
    type(patch_t), intent(in) :: patch
    real(wp) :: values(n, n), place(2, n)
    integer :: a

    place = places_of_nodes(n)
    do a = 1, n
      values(:, a) = polynomials(n, patch, place(:, a))
    end do
  end function values_at_nodes

  !> The integrals over what parts of a slave face and of a master face see of each other. With a
  !> `patch` of a slave face with mid-side nodes its polynomials take the place of the slave's shape
  !> functions in `mass` and `mixed`.
  pure function find_curved_overlap(plane, of_slave, of_master, seen, patch, roughly) &
    result(overlap)
    type(plane_t), intent(in) :: plane        !! of the part of the slave face
    type(whole_face_t), intent(in) :: of_slave, of_master
    type(polygon_t), intent(in) :: seen(:)    !! parts of the plane
    type(patch_t), intent(in), optional :: patch
    logical, intent(in), optional :: roughly
    !! by the rule of parallelograms, for derivatives: no rest of it that leaps
    type(overlap_t) :: overlap
    real(wp) :: from(2), corner(2, 3), whole
    type(whole_face_t) :: slave, master
    logical :: is_affine
    integer :: i, k, left

    slave = of_slave
    slave%flat(:, :slave%n) = in_plane(plane, slave%x(:, :slave%n))
    master = of_master
    master%flat(:, :master%n) = in_plane(plane, master%x(:, :master%n))
    whole = abs(area_of(slave%flat(:, :merge(slave%n, slave%n/2, slave%n <= 4))))
    left = merge(0, most_halvings, .not. whole > 0.0_wp .or. is_folded(slave) .or. &
      is_folded(master))
    ! What no rule is exact for is cut into smaller triangles.
    is_affine = slave%is_affine .and. master%is_affine
    if (present(roughly)) is_affine = is_affine .or. roughly
    do k = 1, size(seen)
      associate (n => seen(k)%n, polygon => seen(k)%corner(:, :seen(k)%n))
        overlap%area = overlap%area + area_of(polygon)
        overlap%nearest = min(overlap%nearest, least_at(slave, master, polygon))
        from = merge(polygon(:, 1), sum(polygon, 2)/real(n, wp), is_affine)
        do i = 1, n
          corner = reshape([from, polygon(:, i), polygon(:, merge(1, i + 1, i == n))], [2, 3])
          if (.not. area_of(corner) > 0.0_wp) cycle
          if (.not. is_affine) then
            call add_halved(plane, slave, master, corner, speck*whole, left, patch, overlap)
          else if (is_triangle(slave%n) .and. is_triangle(master%n)) then
            call add_points(plane, slave, master, corner, few_points, few_weights, patch, overlap)
          else
            call add_points(plane, slave, master, corner, some_points, some_weights, patch, overlap)
          end if
        end do
      end associate
    end do
    overlap%least_gap = min(overlap%least_gap, overlap%nearest)
  end function find_curved_overlap

  !> The least gap at some places of the plane.
  pure real(wp) function least_at(slave, master, x) result(least)
    type(whole_face_t), intent(in) :: slave, master !! with their nodes in the plane
    real(wp), intent(in) :: x(:, :)                 !! (2,n) [length]
    real(wp) :: n(slave%n), m(master%n), normal(3), xi(2), unused(2, 2)
    integer :: i

    least = huge(least)
    do i = 1, size(x, 2)
      xi = middle_of(slave)
      call locate(slave, x(:, i), xi, n, normal, unused)
      xi = middle_of(master)
      call locate(master, x(:, i), xi, m, normal, unused)
      least = min(least, gap_between(slave, master, n, m, normal/norm2(normal)))
    end do
  end function least_at

  !> How far a place of a slave face is before one of a master face, along a normal.
  pure real(wp) function gap_between(slave, master, n, m, normal) result(gap)
    type(whole_face_t), intent(in) :: slave, master
    real(wp), intent(in) :: n(:), m(:)  !! shape functions there [-]
    real(wp), intent(in) :: normal(3)
    real(wp) :: arm(3)
    integer :: k

    arm = 0.0_wp
    do k = 1, slave%n
      arm = arm + n(k)*(slave%x(:, k) + slave%moved(:, k))
    end do
    do k = 1, master%n
      arm = arm - m(k)*(master%x(:, k) + master%moved(:, k))
    end do
    gap = dot_product(normal, arm)
  end function gap_between

  !> Add the integrals over one triangle of an overlap, halved where the Jacobians change much.
  pure recursive subroutine add_halved(plane, slave, master, corner, least, left, patch, overlap)
    type(plane_t), intent(in) :: plane
    type(whole_face_t), intent(in) :: slave, master !! with their nodes in the plane
    real(wp), intent(in) :: corner(2, 3)  !! of the triangle [length]
    real(wp), intent(in) :: least         !! area that is not halved [length^2]
    integer, intent(in) :: left           !! so often it may be
    type(patch_t), intent(in), optional :: patch
    type(overlap_t), intent(inout) :: overlap
    real(wp) :: halves(2, 3, 2)
    logical :: is_small

    is_small = left == 0 .or. area_of(corner) < least
    if (.not. is_small) is_small = min(evenness_of(slave), evenness_of(master)) > even_enough
    if (is_small) then
      call add_points(plane, slave, master, corner, many_points, many_weights, patch, overlap)
      return
    end if
    halves = halves_of(corner)
    call add_halved(plane, slave, master, halves(:, :, 1), least, left - 1, patch, overlap)
    call add_halved(plane, slave, master, halves(:, :, 2), least, left - 1, patch, overlap)

  contains

    !> That of the Jacobians of a face at the corners.
    pure real(wp) function evenness_of(face)
      type(whole_face_t), intent(in) :: face
      real(wp) :: n(face%n), normal(3), slope(2, 2), xi(2), jacobian(3)
      integer :: i

      do i = 1, 3
        xi = middle_of(face)
        call locate(face, corner(:, i), xi, n, normal, slope)
        jacobian(i) = norm2(normal)
      end do
      evenness_of = evenness(jacobian)
    end function evenness_of
  end subroutine add_halved

  !> Add the integrals over one triangle of an overlap, over the area of the slave face that lies
  !> above it.
  pure subroutine add_points(plane, slave, master, corner, point, weight, patch, overlap)
    type(plane_t), intent(in) :: plane
    type(whole_face_t), intent(in) :: slave, master !! with their nodes in the plane
    real(wp), intent(in) :: corner(2, 3)  !! of the triangle [length]
    real(wp), intent(in) :: point(:, :), weight(:) !! (2,n), (n) of the rule [-]
    type(patch_t), intent(in), optional :: patch
    type(overlap_t), intent(inout) :: overlap
    real(wp), dimension(slave%n) :: n, part, f
    real(wp) :: x(2), m(master%n), normal(3), gap, area, here, xi(2), eta(2)
    real(wp), dimension(2) :: middle, xi_there, eta_there
    real(wp), dimension(2, 2) :: slope, master_slope, unused
    integer :: i, b

    area = area_of(corner)
    middle = sum(corner, 2)/3.0_wp
    xi_there = middle_of(slave)
    eta_there = middle_of(master)
    call locate(slave, middle, xi_there, n, normal, slope)
    call locate(master, middle, eta_there, m, normal, master_slope)
    do i = 1, size(weight)
      x = corner(:, 1) + point(1, i)*(corner(:, 2) - corner(:, 1)) + &
        point(2, i)*(corner(:, 3) - corner(:, 1))
      xi = xi_there + matmul(slope, x - middle)
      eta = eta_there + matmul(master_slope, x - middle)
      call locate(slave, x, xi, n, normal, unused)
      here = area*weight(i)*norm2(normal)/abs(dot_product(normal, plane%axis(:, 3)))
      part = here*n
      f = n
      if (present(patch)) f = polynomials(slave%n, patch, xi)
      overlap%moments = overlap%moments + here*[1.0_wp, xi, xi(1)*xi, xi(2)**2]
      call locate(master, x, eta, m, normal, unused)
      normal = normal/norm2(normal)
      gap = gap_between(slave, master, n, m, normal)
      overlap%least_gap = min(overlap%least_gap, gap)
      associate (s => slave%n)
        overlap%lumped(:s) = overlap%lumped(:s) + part
        if (gap < 0.0_wp) overlap%entered(:s) = overlap%entered(:s) + part*gap
        do b = 1, s
          overlap%mass(:s, b) = overlap%mass(:s, b) + here*f(b)*f
          overlap%facing(:, b) = overlap%facing(:, b) + part(b)*normal
        end do
        do b = 1, master%n
          overlap%mixed(:s, b) = overlap%mixed(:s, b) + here*m(b)*f
        end do
      end associate
    end do
  end subroutine add_points

  !> Whether a face is folded in the plane: seen from behind at a node, and not just turned into a
  !> point there. Places between are of several parts of it, and no parts of it are even. No
  !> increment ends with such a face before or on a slave.
  pure logical function is_folded(face)
    type(whole_face_t), intent(in) :: face  !! with its nodes in the plane
    real(wp), parameter :: rounding = 1.0e-3_wp !! of the largest Jacobian [-]
    real(wp) :: place(2, face%n), n(face_nodes), gradient(2, face_nodes), slope(2, 2)
    real(wp) :: jacobian(face%n)
    integer :: a

    place = places_of_nodes(face%n)
    do a = 1, face%n
      call evaluate_face(face%n, place(:, a), n, gradient)
      slope = matmul(face%flat(:, :face%n), transpose(gradient(:, :face%n)))
      jacobian(a) = slope(1, 1)*slope(2, 2) - slope(1, 2)*slope(2, 1)
    end do
    is_folded = minval(jacobian) < -rounding*maxval(abs(jacobian)) .and. &
      maxval(jacobian) > rounding*maxval(abs(jacobian))
  end function is_folded

  !> Natural coordinates of the middle of a face.
  pure function middle_of(face) result(xi)
    type(whole_face_t), intent(in) :: face
    real(wp) :: xi(2) !! [-]

    xi = merge(1.0_wp/3.0_wp, 0.0_wp, is_triangle(face%n))
  end function middle_of

  !> The place of a face that is seen at a point of the plane, by Newton's method: its shape
  !> functions and the normal there.
  pure subroutine locate(face, x, xi, n, normal, slope)
    type(whole_face_t), intent(in) :: face  !! with its nodes in the plane
    real(wp), intent(in) :: x(2)            !! [length]
    real(wp), intent(inout) :: xi(2)        !! natural coordinates, first where to begin [-]
    real(wp), intent(out) :: n(:)           !! [-]
    real(wp), intent(out) :: normal(3)      !! not of unit length
    real(wp), intent(out) :: slope(2, 2)    !! of xi along x, close to there [1/length]
    ! Newton's method squares what is left: behind a step of this nothing is but rounding, and a
    ! step below that is none.
    real(wp), parameter :: settled = 1.0e-8_wp, rounding = 4.0_wp*epsilon(1.0_wp)
    integer,  parameter :: max_newton = 30
    real(wp), dimension(face_nodes) :: functions
    real(wp) :: step(2), left(2), a(2), b(2), gradient(2, face_nodes), tangent(3, 2), det
    integer :: i, k

    slope = 0.0_wp
    step = 1.0_wp
    do i = 1, max_newton
      call evaluate_face(face%n, xi, functions, gradient)
      if (maxval(abs(step)) < settled) exit
      left = x
      a = 0.0_wp
      b = 0.0_wp
      do k = 1, face%n
        left = left - functions(k)*face%flat(:, k)
        a = a + gradient(1, k)*face%flat(:, k)
        b = b + gradient(2, k)*face%flat(:, k)
      end do
      det = a(1)*b(2) - a(2)*b(1)
      if (.not. abs(det) > 0.0_wp) exit
      slope(:, 1) = [b(2), -a(2)]/det
      slope(:, 2) = [-b(1), a(1)]/det
      step = matmul(slope, left)
      if (maxval(abs(step)) < rounding) exit
      xi = xi + step
    end do
    n = functions(:face%n)
    tangent = 0.0_wp
    do k = 1, face%n
      tangent(:, 1) = tangent(:, 1) + gradient(1, k)*face%x(:, k)
      tangent(:, 2) = tangent(:, 2) + gradient(2, k)*face%x(:, k)
    end do
    normal = cross(tangent(:, 1), tangent(:, 2))
  end subroutine locate

end module curved_overlap_mod
