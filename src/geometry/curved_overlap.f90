!> What two faces share where either has nodes in the middles of its edges: overlaps of parts
!> between their nodes, and integrals over these with the shape functions of the whole faces where
!> their points lie.
!>
!> docs/theory.md section 11.
module curved_overlap_mod
  use kinds_mod, only: wp
  use cells_mod, only: face_corners, face_nodes
  use face_shapes_mod, only: terms_of_functions, find_monomials, find_values, &
    slopes_of, places_of_nodes, is_triangle
  use small_matrix_mod, only: cross
  use face_overlap_mod, only: overlap_t, plane_t, polygon_t, in_plane, area_of, outward_normal, &
    few_points, few_weights, some_points, some_weights, more_points, more_weights, many_points, &
    many_weights, evenness, even_enough, speck, halves_of, most_halvings
  implicit none
  private

  public :: whole_face_t, find_curved_overlap, whole_face, patch_t, make_patch, values_at_nodes

  !> A face with all of its nodes.
  type :: whole_face_t
    integer :: n = 0                            !! nodes
    real(wp) :: x(3, face_nodes) = 0.0_wp       !! where they are [length]
    real(wp) :: functions(face_nodes, face_nodes) = 0.0_wp !! as of `terms_of_functions`
    real(wp) :: place(face_nodes, 3) = 0.0_wp   !! where its points are, as polynomials [length]
    real(wp) :: for_gaps(face_nodes, 3) = 0.0_wp !! the same, moved, for gaps [length]
    real(wp) :: slope(face_nodes, 2, 3) = 0.0_wp      !! of `place` along natural coordinates
    real(wp) :: flat(face_nodes, 2) = 0.0_wp          !! `place` in a plane [length]
    real(wp) :: flat_slope(face_nodes, 2, 2) = 0.0_wp !! the same of that
    logical :: is_affine = .true.
    !! shape functions are nearly polynomials in the plane: edges are nearly straight, and opposite
    !! ones of four nearly parallel
    logical :: is_gentle = .true.
    !! they are so seen from before the face, which may bow
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
    real(wp) :: normal(3)
    integer :: k, next, corners

    face%n = size(x, 2)
    face%x(:, :face%n) = x
    face%functions = terms_of_functions(face%n)
    face%place = matmul(transpose(face%functions), transpose(face%x))
    face%slope = slopes_of(face%place)
    face%for_gaps = face%place
    if (present(moved)) face%for_gaps = face%place + matmul(transpose(face%functions(:face%n, :)), &
      transpose(moved))
    corners = merge(3, face_corners, is_triangle(face%n))
    normal = outward_normal(x(:, :corners))
    if (corners == face_corners) call judge(x(:, 1) - x(:, 2) + x(:, 3) - x(:, 4), &
      min(norm2(x(:, 2) - x(:, 1)), norm2(x(:, 3) - x(:, 2))))
    if (face%n == corners) return
    do k = 1, corners
      next = 1 + modulo(k, corners)
      call judge(x(:, corners + k) - 0.5_wp*(x(:, k) + x(:, next)), norm2(x(:, next) - x(:, k)))
    end do

  contains

    !> What an arm that a parallelogram with straight edges has not makes of the face.
    pure subroutine judge(arm, edge)
      real(wp), intent(in) :: arm(3), edge !! [length]
      ! Of an edge [-]. Rules for polynomials then give weights to 1e-6; that of degree 8 to 1e-11,
      ! where what is across the face alone bows, by an arc of 30 degrees.
      real(wp), parameter :: straight = 1.0e-2_wp, arc = 7.0e-2_wp
      real(wp) :: height

      height = dot_product(normal, arm)
      face%is_affine = face%is_affine .and. norm2(arm) <= straight*edge
      face%is_gentle = face%is_gentle .and. abs(height) <= arc*edge .and. &
        norm2(arm - height*normal) <= straight*edge
    end subroutine judge
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
    real(wp) :: p(n), all_of_them(face_nodes)

    call find_monomials(1, matmul(patch%scale, xi - patch%middle), all_of_them)
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
    logical :: is_affine, is_gentle
    integer :: i, k, left

    slave = of_slave
    call lay_in_plane(plane, slave)
    master = of_master
    call lay_in_plane(plane, master)
    whole = abs(area_of(in_plane(plane, slave%x(:, :merge(slave%n, slave%n/2, slave%n <= 4)))))
    left = merge(0, most_halvings, .not. whole > 0.0_wp .or. is_folded(slave) .or. &
      is_folded(master))
    ! What no rule is exact for is cut into smaller triangles.
    is_affine = slave%is_affine .and. master%is_affine
    if (present(roughly)) is_affine = is_affine .or. roughly
    is_gentle = slave%is_gentle .and. master%is_gentle
    do k = 1, size(seen)
      if (seen(k)%n == 0) cycle
      associate (n => seen(k)%n, polygon => seen(k)%corner(:, :seen(k)%n))
        overlap%area = overlap%area + area_of(polygon)
        overlap%nearest = min(overlap%nearest, least_at(slave, master, polygon))
        from = merge(polygon(:, 1), sum(polygon, 2)/real(n, wp), is_affine .or. is_gentle)
        do i = 1, n
          corner = reshape([from, polygon(:, i), polygon(:, merge(1, i + 1, i == n))], [2, 3])
          if (.not. area_of(corner) > 0.0_wp) cycle
          if (.not. (is_affine .or. is_gentle)) then
            call add_halved(plane, slave, master, corner, speck*whole, left, patch, overlap)
          else if (.not. is_affine) then
            call add_points(plane, slave, master, corner, more_points, more_weights, patch, overlap)
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

  !> Find the places of a face in a plane.
  pure subroutine lay_in_plane(plane, face)
    type(plane_t), intent(in) :: plane
    type(whole_face_t), intent(inout) :: face

    face%flat = matmul(face%place, plane%axis(:, :2))
    face%flat(1, :) = face%flat(1, :) - matmul(plane%origin, plane%axis(:, :2))
    face%flat_slope = slopes_of(face%flat)
  end subroutine lay_in_plane

  !> The least gap at some places of the plane.
  pure real(wp) function least_at(slave, master, x) result(least)
    type(whole_face_t), intent(in) :: slave, master !! with their places in the plane
    real(wp), intent(in) :: x(:, :)                 !! (2,n) [length]
    real(wp), dimension(size(x, 2), face_nodes) :: p, q
    real(wp), dimension(size(x, 2), 2) :: xi, eta
    real(wp) :: normal(size(x, 2), 3)

    xi = spread(middle_of(slave), 1, size(x, 2))
    call locate(size(x, 2), slave, transpose(x), xi, p)
    eta = spread(middle_of(master), 1, size(x, 2))
    call locate(size(x, 2), master, transpose(x), eta, q)
    normal = normals_at(size(x, 2), master, q)
    normal = normal/spread(norm2(normal, 2), 2, 3)
    least = minval(gaps_between(size(x, 2), slave, master, p, q, normal))
  end function least_at

  !> How far places of a slave face are before those of a master face, along normals.
  pure function gaps_between(n, slave, master, p, q, normal) result(gap)
    integer, intent(in) :: n
    type(whole_face_t), intent(in) :: slave, master
    real(wp), dimension(n, face_nodes), intent(in) :: p, q !! monomials of the slave's, master's [-]
    real(wp), intent(in) :: normal(n, 3)
    real(wp), dimension(n) :: gap, before, behind
    integer :: i

    gap = 0.0_wp
    do i = 1, 3
      call find_values(n, slave%for_gaps(:, i), p, before)
      call find_values(n, master%for_gaps(:, i), q, behind)
      gap = gap + normal(:, i)*(before - behind)
    end do
  end function gaps_between

  !> Add the integrals over one triangle of an overlap, halved where the Jacobians change much.
  pure recursive subroutine add_halved(plane, slave, master, corner, least, left, patch, overlap)
    type(plane_t), intent(in) :: plane
    type(whole_face_t), intent(in) :: slave, master !! with their places in the plane
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
      real(wp) :: xi(3, 2), p(3, face_nodes)

      xi = spread(middle_of(face), 1, 3)
      call locate(3, face, transpose(corner), xi, p)
      evenness_of = evenness(norm2(normals_at(3, face, p), 2))
    end function evenness_of
  end subroutine add_halved

  !> Add the integrals over one triangle of an overlap, over the area of the slave face that lies
  !> above it.
  pure subroutine add_points(plane, slave, master, corner, point, weight, patch, overlap)
    type(plane_t), intent(in) :: plane
    type(whole_face_t), intent(in) :: slave, master !! with their places in the plane
    real(wp), intent(in) :: corner(2, 3)  !! of the triangle [length]
    real(wp), intent(in) :: point(:, :), weight(:) !! (2,n), (n) of the rule [-]
    type(patch_t), intent(in), optional :: patch
    type(overlap_t), intent(inout) :: overlap
    real(wp), dimension(size(weight)) :: here, gap
    real(wp), dimension(size(weight), 2) :: x, xi, eta
    real(wp), dimension(size(weight), 3) :: normal
    real(wp), dimension(size(weight), face_nodes) :: p, q
    real(wp), dimension(face_nodes) :: n, m, f, part
    integer :: i, b, k

    do i = 1, 2
      x(:, i) = corner(i, 1) + point(1, :)*(corner(i, 2) - corner(i, 1)) + &
        point(2, :)*(corner(i, 3) - corner(i, 1))
    end do
    xi = places_near(slave, sum(corner, 2)/3.0_wp, x)
    call locate(size(weight), slave, x, xi, p)
    normal = normals_at(size(weight), slave, p)
    here = area_of(corner)*weight*norm2(normal, 2)/abs(matmul(normal, plane%axis(:, 3)))
    eta = places_near(master, sum(corner, 2)/3.0_wp, x)
    call locate(size(weight), master, x, eta, q)
    normal = normals_at(size(weight), master, q)
    normal = normal/spread(norm2(normal, 2), 2, 3)
    gap = gaps_between(size(weight), slave, master, p, q, normal)
    overlap%least_gap = min(overlap%least_gap, minval(gap))
    do i = 1, size(weight)
      n = 0.0_wp
      m = 0.0_wp
      do k = 1, face_nodes
        n = n + slave%functions(:, k)*p(i, k)
        m = m + master%functions(:, k)*q(i, k)
      end do
      part = here(i)*n
      f = n
      if (present(patch)) f(:slave%n) = polynomials(slave%n, patch, xi(i, :))
      overlap%moments = overlap%moments + here(i)*[1.0_wp, xi(i, 1), xi(i, 2), xi(i, 1)*xi(i, 1), &
        xi(i, 1)*xi(i, 2), xi(i, 2)**2]
      overlap%lumped = overlap%lumped + part
      if (gap(i) < 0.0_wp) overlap%entered = overlap%entered + part*gap(i)
      do b = 1, face_nodes
        overlap%mass(:, b) = overlap%mass(:, b) + here(i)*f(b)*f
        overlap%mixed(:, b) = overlap%mixed(:, b) + here(i)*m(b)*f
        overlap%facing(:, b) = overlap%facing(:, b) + part(b)*normal(i, :)
      end do
    end do
  end subroutine add_points

  !> Whether a face is folded in the plane: seen from behind at a node, and not just turned into a
  !> point there. Places between are of several parts of it, and no parts of it are even. No
  !> increment ends with such a face before or on a slave.
  pure logical function is_folded(face)
    type(whole_face_t), intent(in) :: face  !! with its places in the plane
    real(wp), parameter :: rounding = 1.0e-3_wp !! of the largest Jacobian [-]
    real(wp) :: place(2, face%n), slope(2, 2), jacobian(face%n)
    integer :: a

    place = places_of_nodes(face%n)
    do a = 1, face%n
      slope = slope_at(face, place(:, a))
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

  !> About where a face is seen at points of the plane that are close to one of them: where it would
  !> be seen were it flat and even.
  pure function places_near(face, middle, x) result(xi)
    type(whole_face_t), intent(in) :: face  !! with its places in the plane
    real(wp), intent(in) :: middle(2)       !! of the points [length]
    real(wp), intent(in) :: x(:, :)         !! (n,2) [length]
    real(wp) :: xi(size(x, 1), 2)           !! natural coordinates [-]
    real(wp) :: there(1, 2), unused(1, face_nodes), slope(2, 2), det, left(size(x, 1), 2)

    there(1, :) = middle_of(face)
    call locate(1, face, reshape(middle, [1, 2]), there, unused)
    slope = slope_at(face, there(1, :))
    det = slope(1, 1)*slope(2, 2) - slope(1, 2)*slope(2, 1)
    xi = spread(there(1, :), 1, size(x, 1))
    if (.not. abs(det) > 0.0_wp) return
    left = x - spread(middle, 1, size(x, 1))
    xi(:, 1) = xi(:, 1) + (left(:, 1)*slope(2, 2) - left(:, 2)*slope(1, 2))/det
    xi(:, 2) = xi(:, 2) + (left(:, 2)*slope(1, 1) - left(:, 1)*slope(2, 1))/det
  end function places_near

  !> The places of a face that are seen at points of the plane, by Newton's method, of all points at
  !> once.
  pure subroutine locate(n, face, x, xi, p)
    integer, intent(in) :: n
    type(whole_face_t), intent(in) :: face    !! with its places in the plane
    real(wp), intent(in) :: x(n, 2)           !! [length]
    real(wp), intent(inout) :: xi(n, 2)       !! natural coordinates, first where to begin [-]
    real(wp), intent(out) :: p(n, face_nodes) !! monomials there [-]
    ! Newton's method squares what is left: behind a step of this nothing is but rounding. No part
    ! of a face is as far from it as the last.
    real(wp), parameter :: settled = 1.0e-8_wp, far = 1.0e3_wp
    integer,  parameter :: max_newton = 30
    real(wp), dimension(n, 2) :: place, a, b, step
    real(wp) :: det
    integer :: i, k

    do i = 1, max_newton + 1
      call find_monomials(n, xi, p)
      if (i > max_newton) exit
      if (i > 1) then
        if (maxval(abs(step)) < settled) exit
      end if
      do k = 1, 2
        call find_values(n, face%flat(:, k), p, place(:, k))
        call find_values(n, face%flat_slope(:, 1, k), p, a(:, k))
        call find_values(n, face%flat_slope(:, 2, k), p, b(:, k))
      end do
      do k = 1, n
        det = a(k, 1)*b(k, 2) - a(k, 2)*b(k, 1)
        det = merge(1.0_wp/merge(det, 1.0_wp, abs(det) > tiny(det)), 0.0_wp, abs(det) > tiny(det))
        step(k, 1) = ((x(k, 1) - place(k, 1))*b(k, 2) - (x(k, 2) - place(k, 2))*b(k, 1))*det
        step(k, 2) = (a(k, 1)*(x(k, 2) - place(k, 2)) - a(k, 2)*(x(k, 1) - place(k, 1)))*det
      end do
      xi = xi + step
      if (any(abs(xi) > far)) xi = max(-far, min(far, xi))
    end do
  end subroutine locate

  !> The normals of a face at places, not of unit length.
  pure function normals_at(n, face, p) result(normal)
    integer, intent(in) :: n
    type(whole_face_t), intent(in) :: face
    real(wp), intent(in) :: p(n, face_nodes)  !! monomials there [-]
    real(wp) :: normal(n, 3), tangent(n, 3, 2)
    integer :: i, k

    do i = 1, 3
      do k = 1, 2
        call find_values(n, face%slope(:, k, i), p, tangent(:, i, k))
      end do
    end do
    do i = 1, n
      normal(i, :) = cross(tangent(i, :, 1), tangent(i, :, 2))
    end do
  end function normals_at

  !> How the places of a face in the plane change along its natural coordinates.
  pure function slope_at(face, xi) result(slope)
    type(whole_face_t), intent(in) :: face  !! with its places in the plane
    real(wp), intent(in) :: xi(2)           !! natural coordinates [-]
    real(wp) :: p(face_nodes)
    real(wp) :: slope(2, 2)                 !! (i,k) of place i along coordinate k [length]
    integer :: k

    call find_monomials(1, xi, p)
    do k = 1, 2
      slope(:, k) = matmul(p, face%flat_slope(:, k, :))
    end do
  end function slope_at

end module curved_overlap_mod
