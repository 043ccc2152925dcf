!> Integrals over what two faces share, for the certificate.
!>
!> Corners of the overlap are collected (corners of either face inside the other, crossings of
!> edges) and put in order about their mean; each triangle between the mean and two of them has
!> products of Gauss points. docs/theory.md (11.1), (11.2).
module face_integrals_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: cross
  use veils_mod, only: veil_t, triangle_t, draw
  implicit none
  private

  public :: shared_t, integrate_shared, integrate_nodes, nearest_of

  !> Integrals of the slave's shape functions N and the master's over what two faces share.
  type :: shared_t
    real(wp) :: area = 0.0_wp        !! in the plane [length^2]
    real(wp), allocatable :: outline(:, :) !! (2,n) corners in the plane [length]
    type(triangle_t), allocatable :: seen(:) !! what it is made of
    logical :: folds = .false.       !! a corner of either face points inwards in the plane
    real(wp) :: lumped(8) = 0.0_wp   !! int N_a [length^2]
    real(wp) :: mass(8, 8) = 0.0_wp  !! int N_a N_b [length^2]
    real(wp) :: mixed(8, 8) = 0.0_wp !! int N_a N_k, k of the master's nodes [length^2]
    real(wp) :: facing(3, 8) = 0.0_wp
    !! int N_a n, n of the master; of faces with mid-side nodes alone [length^2]
  end type shared_t

  integer, parameter :: most = 16 !! corners that are collected
  real(wp), parameter :: speck = 1.0e-6_wp
  !! of a face: a triangle that is not cut any more, but where cutting ends by itself: what it adds
  !! is a tenth of what quadratures may differ by [-]
  integer, parameter :: most_halvings = 60 !! of a triangle: then it is a speck, however large
  real(wp), parameter :: rounding = 1.0e-12_wp
  !! of the size of a face; 370 random decks end alike with 1e-13 to 1e-11 [-]
  ! Gauss points on the unit interval: 3 for what is a polynomial, of degree 4; 6 for fractions, 4
  ! where a Jacobian hardly changes.
  real(wp), parameter :: point_3(3) = 0.5_wp + 0.5_wp*sqrt(0.6_wp)*[-1, 0, 1]
  real(wp), parameter :: weight_3(3) = [5, 8, 5]/18.0_wp
  real(wp), parameter :: half_4(2) = 0.5_wp*[0.3399810435848563_wp, 0.8611363115940526_wp]
  real(wp), parameter :: weights_4(2) = 0.5_wp*[0.6521451548625461_wp, 0.3478548451374538_wp]
  real(wp), parameter :: point_4(4) = [0.5_wp - half_4, 0.5_wp + half_4]
  real(wp), parameter :: weight_4(4) = [weights_4, weights_4]
  real(wp), parameter :: half_6(3) = 0.5_wp*[0.2386191860831969_wp, 0.6612093864662645_wp, &
    0.9324695142031521_wp]
  real(wp), parameter :: weights_6(3) = 0.5_wp*[0.4679139345726910_wp, 0.3607615730481386_wp, &
    0.1713244923791704_wp]
  real(wp), parameter :: point_6(6) = [0.5_wp - half_6, 0.5_wp + half_6]
  real(wp), parameter :: weight_6(6) = [weights_6, weights_6]

contains

  !> The integrals over what parts of two faces share and see of each other; all 0 where they share
  !> nothing. Where either has mid-side nodes: over the slave where it lies above the plane, with
  !> the shape functions of the faces there.
  pure function integrate_shared(slave_part, master_part, slave, master, veils, height, rounding) &
    result(shared)
    real(wp), intent(in) :: slave_part(:, :), master_part(:, :)
    !! (2,3) or (2,4) corners in a plane, one after the other, either way round [length]
    real(wp), intent(in) :: slave(:, :), master(:, :)
    !! (3,n) all nodes of the faces, corners first: in the plane, and above it; or (2,n) flat faces
    !! in the plane [length]
    type(veil_t), intent(in), optional :: veils(:) !! left out: none
    real(wp), intent(in), optional :: height(3)    !! of the master, as of draw
    real(wp), intent(in), optional :: rounding     !! likewise [length]
    type(shared_t) :: shared
    real(wp) :: corner(2, most), mean(2), least, negligible
    logical :: is_polynomial
    integer :: n, i, k, n_corners

    call collect_corners(slave_part, master_part, corner, n)
    if (n < 3) return
    shared%folds = .not. (opens(slave) .and. opens(master))
    n_corners = corners_of(slave)
    least = area_of(slave(:2, 1), slave(:2, 2), slave(:2, 3)) + area_of(slave(:2, 1), &
      slave(:2, 3), slave(:2, n_corners))
    negligible = 1.0e-12_wp*least
    least = merge(speck, epsilon(1.0_wp), size(slave, 1) == 3)*least
    ! Folded faces end the run: what they share is no matter.
    if (shared%folds) least = huge(least)
    mean = sum(corner(:, :n), dim=2)/real(n, wp)
    call put_in_order(mean, corner(:, :n))
    shared%outline = corner(:, :n)
    is_polynomial = has_one_jacobian(slave) .and. has_one_jacobian(master)
    shared%seen = [(triangle_t(reshape([mean, corner(:, i), corner(:, 1 + mod(i, n))], [2, 3])), &
      i=1, n)]
    if (present(veils)) then
      call draw(veils, height, rounding, negligible, shared%seen)
      associate (corners => 3*size(shared%seen))
        if (size(veils) > 0) then
          shared%outline = reshape([(shared%seen(i)%x, i=1, size(shared%seen))], [2, corners])
          shared%outline = shared%outline(:, pack([(i, i=1, corners)], any(abs(shared%outline - &
            spread(mean, 2, corners)) > 0.0_wp, 1)))
        end if
      end associate
    end if
    do k = 1, size(shared%seen)
      associate (x => shared%seen(k)%x)
        if (is_polynomial) then
          call add_triangle(slave, master, x(:, 1), x(:, 2), x(:, 3), point_3, weight_3, shared)
        else
          call add_parts(slave, master, x(:, 1), x(:, 2), x(:, 3), least, most_halvings, shared)
        end if
      end associate
    end do
  end function integrate_shared

  !> What of a face its nodes have, int N_a over it, or over what of it lies in a plane.
  pure subroutine integrate_nodes(x, normal, area)
    real(wp), intent(in) :: x(:, :)        !! (3,n) its nodes, corners first [length]
    real(wp), intent(in) :: normal(3)      !! of that plane, or 0 [-]
    real(wp), intent(out) :: area(:)       !! (n) [length^2]
    real(wp) :: n(size(x, 2)), slope(size(x, 2), 2), t(3, 2), vector(3), part
    integer :: i, j

    area = 0.0_wp
    do i = 1, size(point_6)
      do j = 1, size(point_6)
        part = weight_6(i)*weight_6(j)
        associate (s => point_6(i), r => point_6(j))
          if (modulo(size(n), 3) == 0) then
            part = part*s
            call evaluate([s*(1.0_wp - r), s*r], n, slope)
          else
            call evaluate([s, r], n, slope)
          end if
        end associate
        t = matmul(x, slope)
        vector = part*cross(t(:, 1), t(:, 2))
        area = area + merge(dot_product(normal, vector), norm2(vector), norm2(normal) > 0.0_wp)*n
      end do
    end do
  end subroutine integrate_nodes

  !> The least gap at the corners of what two faces share.
  pure real(wp) function nearest_of(outline, slave, master, apart, other, normal) result(nearest)
    real(wp), intent(in) :: outline(:, :)              !! (2,n) [length]
    real(wp), intent(in) :: slave(:, :), master(:, :)  !! as of `integrate_shared` [length]
    real(wp), intent(in) :: apart(:, :), other(:, :)
    !! (3,n) where all nodes of the slave face and of the master's are [length]
    real(wp), intent(in) :: normal(:, :)
    !! (3,1) the master's; (3,3) axes, the third across the plane: it follows from the face [-]
    real(wp) :: n(size(slave, 2)), m(size(master, 2)), unused(3), up(3)
    logical :: is_affine(2)
    integer :: i

    nearest = huge(nearest)
    is_affine = [has_one_jacobian(slave), has_one_jacobian(master)]
    do i = 1, size(outline, 2)
      call find_place(slave, is_affine(1), outline(:, i), n, unused)
      call find_place(master, is_affine(2), outline(:, i), m, up)
      if (size(normal, 2) == 3) then
        up = matmul(normal, up)
        up = up/norm2(up)
      else
        up = normal(:, 1)
      end if
      nearest = min(nearest, dot_product(up, matmul(apart, n) - matmul(other, m)))
    end do
  end function nearest_of

  !> Whether a face is a triangle with edges that are straight, or a flat parallelogram.
  pure logical function has_one_jacobian(x) result(is)
    real(wp), intent(in) :: x(:, :)         !! as of `integrate_shared` [length]
    real(wp), parameter :: off = 1.0e-2_wp  !! of an edge [-]

    is = size(x, 2) == 3
    if (size(x, 1) == 2 .and. size(x, 2) == 4) is = is_parallelogram(x)
    if (size(x, 2) /= 6) return
    associate (bow => x(:, 4:6) - 0.5_wp*(x(:, 1:3) + cshift(x(:, 1:3), 1, dim=2)))
      is = maxval(abs(bow)) <= off*maxval(abs(x(:, 2:3) - spread(x(:, 1), 2, 2)))
    end associate
  end function has_one_jacobian

  pure integer function corners_of(x) result(n)
    real(wp), intent(in) :: x(:, :)     !! as of `integrate_shared` [length]

    n = merge(size(x, 2), size(x, 2)/2, size(x, 2) <= 4)
  end function corners_of

  !> Whether all corners of a face point outwards.
  pure logical function opens(x)
    real(wp), intent(in) :: x(:, :)     !! as of `integrate_shared` [length]
    real(wp), dimension(2, corners_of(x)) :: to, from
    real(wp) :: turn(corners_of(x))

    associate (corner => x(:2, :corners_of(x)))
      from = corner - cshift(corner, -1, dim=2)
      to = cshift(corner, 1, dim=2) - corner
    end associate
    turn = from(1, :)*to(2, :) - from(2, :)*to(1, :)
    opens = minval(turn) > 0.0_wp .or. maxval(turn) < 0.0_wp
  end function opens

  pure logical function is_parallelogram(x)
    real(wp), intent(in) :: x(:, :) !! (2,4) [length]

    is_parallelogram = maxval(abs(x(:, 3) - x(:, 4) - (x(:, 2) - x(:, 1)))) <= &
      rounding*max(maxval(abs(x(:, 2) - x(:, 1))), maxval(abs(x(:, 4) - x(:, 1))))
  end function is_parallelogram

  !> Add the integrals over a triangle of the plane, in halves of its longest edge where a Jacobian
  !> changes much between its corners.
  pure recursive subroutine add_parts(slave, master, a, b, c, least, left, shared)
    real(wp), intent(in) :: slave(:, :), master(:, :)  !! as of `integrate_shared` [length]
    real(wp), intent(in) :: a(2), b(2), c(2)           !! its corners [length]
    real(wp), intent(in) :: least             !! area that is not halved [length^2]
    integer, intent(in) :: left               !! so often it may be
    type(shared_t), intent(inout) :: shared
    real(wp), parameter :: hardly = 1.1_wp !! then four points leave less than 1e-9 of an integral
    real(wp) :: change

    change = max(change_of(slave), change_of(master))
    if (left == 0 .or. area_of(a, b, c) < least .or. change <= 1.6_wp) then
      if (change <= hardly) then
        call add_triangle(slave, master, a, b, c, point_4, weight_4, shared)
      else
        call add_triangle(slave, master, a, b, c, point_6, weight_6, shared)
      end if
      return
    end if
    select case (maxloc([norm2(c - b), norm2(a - c), norm2(b - a)], 1))
    case (1)
      call add_parts(slave, master, a, b, 0.5_wp*(b + c), least, left - 1, shared)
      call add_parts(slave, master, a, 0.5_wp*(b + c), c, least, left - 1, shared)
    case (2)
      call add_parts(slave, master, a, b, 0.5_wp*(c + a), least, left - 1, shared)
      call add_parts(slave, master, 0.5_wp*(c + a), b, c, least, left - 1, shared)
    case default
      call add_parts(slave, master, a, 0.5_wp*(a + b), c, least, left - 1, shared)
      call add_parts(slave, master, 0.5_wp*(a + b), b, c, least, left - 1, shared)
    end select

  contains

    !> The largest over the least Jacobian at the corners.
    pure real(wp) function change_of(face)
      real(wp), intent(in) :: face(:, :)
      real(wp) :: corner(2, 3), n(size(face, 2)), normal(3), size_of(3)
      logical :: is_affine
      integer :: i

      corner = reshape([a, b, c], [2, 3])
      is_affine = has_one_jacobian(face)
      do i = 1, 3
        call find_place(face, is_affine, corner(:, i), n, normal)
        size_of(i) = norm2(normal)
      end do
      change_of = maxval(size_of)/max(minval(size_of), tiny(1.0_wp))
    end function change_of
  end subroutine add_parts

  !> Add the integrals over a triangle of the plane.
  pure subroutine add_triangle(slave, master, mean, one, other, point, weight, shared)
    real(wp), intent(in) :: slave(:, :), master(:, :)  !! as of `integrate_shared` [length]
    real(wp), intent(in) :: mean(2), one(2), other(2)  !! its corners [length]
    real(wp), intent(in) :: point(:), weight(:)        !! on the unit interval
    type(shared_t), intent(inout) :: shared
    real(wp) :: p(2), q(2), n(size(slave, 2)), m(size(master, 2)), normal(3), twice, part
    logical :: is_affine(2)
    integer :: i, j, b

    p = one - mean
    q = other - mean
    twice = abs(p(1)*q(2) - p(2)*q(1))
    if (.not. twice > 0.0_wp) return
    is_affine = [has_one_jacobian(slave), has_one_jacobian(master)]
    do i = 1, size(point)
      do j = 1, size(point)
        associate (x => mean + point(i)*((1.0_wp - point(j))*p + point(j)*q))
          call find_place(slave, is_affine(1), x, n, normal)
          part = twice*weight(i)*weight(j)*point(i)*norm2(normal)/abs(normal(3))
          call find_place(master, is_affine(2), x, m, normal)
        end associate
        normal = normal/norm2(normal)
        shared%area = shared%area + twice*weight(i)*weight(j)*point(i)
        shared%lumped(:size(n)) = shared%lumped(:size(n)) + part*n
        do b = 1, size(n)
          shared%mass(:size(n), b) = shared%mass(:size(n), b) + part*n(b)*n
          shared%facing(:, b) = shared%facing(:, b) + part*n(b)*normal
        end do
        do b = 1, size(m)
          shared%mixed(:size(n), b) = shared%mixed(:size(n), b) + part*m(b)*n
        end do
      end do
    end do
  end subroutine add_triangle

  !> Shape functions of a face at the place that is seen at `x`, and the vector of its area there.
  pure subroutine find_place(face, is_affine, x, n, normal)
    real(wp), intent(in) :: face(:, :)      !! as of `integrate_shared` [length]
    logical, intent(in) :: is_affine        !! as of `has_one_jacobian`
    real(wp), intent(in) :: x(2)            !! [length]
    real(wp), intent(out) :: n(:), normal(3)
    real(wp) :: slopes(8, 2), t(3, 2), s(2), step(2), left(2), det
    integer :: i

    if (size(face, 1) == 2) then
      call find_in_plane(face, is_affine, x, n, normal)
      return
    end if
    s = merge(1.0_wp/3.0_wp, 0.5_wp, modulo(size(n), 3) == 0)
    associate (slope => slopes(:size(n), :))
      do i = 1, 30
        call evaluate(s, n, slope)
        t = matmul(face, slope)
        left = x - matmul(face(:2, :), n)
        det = t(1, 1)*t(2, 2) - t(1, 2)*t(2, 1)
        if (.not. abs(det) > 0.0_wp) exit
        step = [left(1)*t(2, 2) - left(2)*t(1, 2), t(1, 1)*left(2) - t(2, 1)*left(1)]/det
        s = s + step
        if (maxval(abs(step)) < 1.0e-9_wp) exit
      end do
      call evaluate(s, n, slope)
      t = matmul(face, slope)
    end associate
    normal = cross(t(:, 1), t(:, 2))
  end subroutine find_place

  !> The same of a flat face in the plane: x = c_1 + c_2 s_1 + c_3 s_2 + c_4 s_1 s_2.
  pure subroutine find_in_plane(face, is_affine, x, n, normal)
    real(wp), intent(in) :: face(:, :)      !! (2,3) or (2,4) [length]
    logical, intent(in) :: is_affine        !! it is a triangle or a parallelogram
    real(wp), intent(in) :: x(2)            !! [length]
    real(wp), intent(out) :: n(:), normal(3)
    real(wp) :: c_2(2), c_3(2), c_4(2), s(2), step(2), left(2), a(2), b(2), det
    integer :: i

    c_2 = face(:, 2) - face(:, 1)
    c_3 = face(:, size(n)) - face(:, 1)
    c_4 = 0.0_wp
    if (size(n) == 4) c_4 = (face(:, 3) - face(:, 4)) - c_2
    s = merge(0.0_wp, 0.5_wp, is_affine)
    a = c_2 + s(2)*c_4
    b = c_3 + s(1)*c_4
    do i = 1, 30
      left = x - face(:, 1) - s(1)*c_2 - s(2)*b
      det = a(1)*b(2) - a(2)*b(1)
      if (.not. abs(det) > 0.0_wp) exit
      step = [left(1)*b(2) - left(2)*b(1), a(1)*left(2) - a(2)*left(1)]/det
      s = s + step
      a = c_2 + s(2)*c_4
      b = c_3 + s(1)*c_4
      if (is_affine .or. maxval(abs(step)) < 1.0e-9_wp) exit
    end do
    if (size(n) == 3) then
      n = [1.0_wp - s(1) - s(2), s(1), s(2)]
    else
      n = [(1.0_wp - s(1))*(1.0_wp - s(2)), s(1)*(1.0_wp - s(2)), s(1)*s(2), (1.0_wp - s(1))*s(2)]
    end if
    normal = [0.0_wp, 0.0_wp, a(1)*b(2) - a(2)*b(1)]
  end subroutine find_in_plane

  !> Shape functions and slopes along coordinates from 0 to 1, of triangles and quadrilaterals.
  pure subroutine evaluate(s, n, slope)
    real(wp), intent(in) :: s(2)
    real(wp), intent(out) :: n(:), slope(:, :) !! (n), (n,2)
    real(wp) :: l(3), along(3, 2), a(2), at(2)
    integer :: k, i, j

    if (modulo(size(n), 3) == 0) then
      l = [1.0_wp - s(1) - s(2), s(1), s(2)]
      along = reshape([-1, 1, 0, -1, 0, 1]*1.0_wp, [3, 2])
      if (size(n) == 3) then
        n = l
        slope = along
        return
      end if
      n(:3) = l*(2.0_wp*l - 1.0_wp)
      n(4:) = 4.0_wp*l*cshift(l, 1)
      do k = 1, 2
        slope(:3, k) = (4.0_wp*l - 1.0_wp)*along(:, k)
        slope(4:, k) = 4.0_wp*(l*cshift(along(:, k), 1) + along(:, k)*cshift(l, 1))
      end do
      return
    end if
    do k = 1, size(n)
      ! Corners anticlockwise from the origin, then the middles from that of the first two.
      select case (k)
      case (1:4)
        at = [merge(1, 0, k == 2 .or. k == 3), merge(1, 0, k > 2)]
      case default
        at = 0.5_wp*[merge(2, merge(0, 1, k == 8), k == 6), merge(2, merge(0, 1, k == 5), k == 7)]
      end select
      ! From 1 at the node to 0 across from it, of a middle along its edge 1 in the middle.
      a = merge(4.0_wp*s*(1.0_wp - s), merge(s, 1.0_wp - s, at > 0.75_wp), abs(at - 0.5_wp) < &
        0.25_wp)
      n(k) = a(1)*a(2)
      do i = 1, 2
        j = 3 - i
        slope(k, i) = a(j)*merge(4.0_wp - 8.0_wp*s(i), merge(1.0_wp, -1.0_wp, at(i) > 0.75_wp), &
          abs(at(i) - 0.5_wp) < 0.25_wp)
      end do
    end do
    if (size(n) == 4) return
    ! Half of the middles beside them corners give up.
    n(:4) = n(:4) - 0.5_wp*(n(5:8) + cshift(n(5:8), -1))
    slope(:4, :) = slope(:4, :) - 0.5_wp*(slope(5:8, :) + cshift(slope(5:8, :), -1, dim=1))
  end subroutine evaluate

  !> Corners of either face inside the other, and where edges cross. Some may be there twice.
  !>
  !> Edges cross where both ends of each lie on either side of the other, not by where their lines
  !> meet: of edges that nearly coincide that place may be off by far more than rounding, and beyond
  !> the end of one.
  pure subroutine collect_corners(a, b, corner, n)
    real(wp), intent(in) :: a(:, :), b(:, :)   !! (2,n) [length]
    real(wp), intent(out) :: corner(2, most)   !! [length]
    integer, intent(out) :: n
    real(wp) :: of_a(2), of_b(2)
    integer :: i, j, i_next, j_next

    corner = 0.0_wp
    n = 0
    do i = 1, size(a, 2)
      if (is_inside(a(:, i), b)) call append(a(:, i), corner, n)
    end do
    do i = 1, size(b, 2)
      if (is_inside(b(:, i), a)) call append(b(:, i), corner, n)
    end do
    do i = 1, size(a, 2)
      i_next = 1 + mod(i, size(a, 2))
      do j = 1, size(b, 2)
        j_next = 1 + mod(j, size(b, 2))
        of_a = [side(a(:, i), b(:, j), b(:, j_next)), side(a(:, i_next), b(:, j), b(:, j_next))]
        of_b = [side(b(:, j), a(:, i), a(:, i_next)), side(b(:, j_next), a(:, i), a(:, i_next))]
        if (max(minval(of_a), minval(of_b)) < 0.0_wp .and. min(maxval(of_a), maxval(of_b)) > &
          0.0_wp) call append(a(:, i) + of_a(1)/(of_a(1) - of_a(2))*(a(:, i_next) - a(:, i)), &
          corner, n)
      end do
    end do
  end subroutine collect_corners

  pure subroutine append(x, corner, n)
    real(wp), intent(in) :: x(2)
    real(wp), intent(inout) :: corner(2, most)
    integer, intent(inout) :: n

    if (n == most) return
    n = n + 1
    corner(:, n) = x
  end subroutine append

  !> Whether a point lies in a convex face, or on its edge but for rounding.
  pure logical function is_inside(x, face)
    real(wp), intent(in) :: x(2)
    real(wp), intent(in) :: face(:, :)  !! (2,n) [length]
    real(wp) :: sides(size(face, 2))
    integer :: i

    do i = 1, size(sides)
      sides(i) = side(x, face(:, i), face(:, 1 + mod(i, size(sides))))
    end do
    is_inside = minval(sides) >= 0.0_wp .or. maxval(sides) <= 0.0_wp
  end function is_inside

  !> On which side of an edge a point lies, and how far, times the edge; 0 on its line but for
  !> rounding.
  pure real(wp) function side(x, first, last)
    real(wp), intent(in) :: x(2), first(2), last(2) !! the edge's ends [length]
    real(wp) :: edge(2), arm(2)

    edge = last - first
    arm = x - first
    side = edge(1)*arm(2) - edge(2)*arm(1)
    if (abs(side) <= rounding*norm2(edge)*(norm2(edge) + norm2(arm))) side = 0.0_wp
  end function side

  !> Sort corners by the angle at which they are seen from their mean.
  pure subroutine put_in_order(mean, corner)
    real(wp), intent(in) :: mean(2)
    real(wp), intent(inout) :: corner(:, :) !! (2,n) [length]
    real(wp) :: angle(size(corner, 2)), here(2), at
    integer :: i, j

    angle = atan2(corner(2, :) - mean(2), corner(1, :) - mean(1))
    do i = 2, size(angle)
      here = corner(:, i)
      at = angle(i)
      do j = i - 1, 1, -1
        if (angle(j) <= at) exit
        angle(j + 1) = angle(j)
        corner(:, j + 1) = corner(:, j)
      end do
      angle(j + 1) = at
      corner(:, j + 1) = here
    end do
  end subroutine put_in_order

  pure real(wp) function area_of(a, b, c)
    real(wp), intent(in) :: a(2), b(2), c(2) !! corners of a triangle [length]

    area_of = 0.5_wp*abs((b(1) - a(1))*(c(2) - a(2)) - (b(2) - a(2))*(c(1) - a(1)))
  end function area_of

end module face_integrals_mod
