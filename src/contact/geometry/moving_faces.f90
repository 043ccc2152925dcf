!> A slave face as a round obstacle sees it during an increment: how it moves, its least gap, and
!> the work of pressure in it. docs/theory.md section 10, (10.6) to (10.8).
module moving_faces_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: cross
  use cells_mod, only: face_corners
  use face_overlap_mod, only: doubled_area
  use obstacles_mod, only: obstacle_t
  use obstacle_shapes_mod, only: get_core, shift_of
  use local_frame_mod, only: transport_tangent
  use state_mod, only: state_t
  use smooth_faces_mod, only: smooth_faces_t, bulge_at, shape_at, find_closest
  implicit none
  private

  public :: moving_face_t, set_face, is_far, find_least_gap, goes_through, work_of_face, mean_depth

  !> One face relative to an obstacle: the origin is its centre, or on its axis.
  type :: moving_face_t
    real(wp) :: x(3, face_corners) = 0.0_wp    !! its nodes when the increment begins [length]
    real(wp) :: way(3, face_corners) = 0.0_wp  !! how far they go [length]
    real(wp) :: normal(3, 2) = 0.0_wp !! outward, at both ends of the increment; of any length
    real(wp) :: extra(face_corners) = 0.0_wp   !! *CONTACT GAP [length]
    real(wp) :: radius = 0.0_wp     !! of the obstacle [length]
    real(wp) :: axis(3) = 0.0_wp    !! of a cylinder, 0 for a sphere [-]
  end type moving_face_t

  real(wp), parameter :: at_three(3) = [-1, 0, 1]
  real(wp), parameter :: simpson(3) = [1.0_wp/3.0_wp, 4.0_wp/3.0_wp, 1.0_wp/3.0_wp]
  real(wp), parameter :: known_to = 0.05_wp !! part of its bulge that a smooth surface may be off

contains

  !> A face as the obstacle sees it.
  pure subroutine set_face(at_old, at_new, coordinates, extra, old, new, nodes, face)
    type(obstacle_t), intent(in) :: at_old, at_new      !! the obstacle at `old` and `new`
    real(wp), intent(in) :: coordinates(3, face_corners), extra(face_corners) !! [length]
    type(state_t), intent(in) :: old, new
    integer, intent(in) :: nodes(face_corners)
    type(moving_face_t), intent(out) :: face
    real(wp) :: core(3), old_core(3), old_axis(3), shift(3)
    integer :: k

    face%extra = extra
    face%normal(:, 1) = doubled_area(coordinates + old%displacement(:, nodes))
    face%normal(:, 2) = doubled_area(coordinates + new%displacement(:, nodes))
    call get_core(at_old, old_core, old_axis, face%radius)
    call get_core(at_new, core, face%axis, face%radius)
    face%x = coordinates + old%displacement(:, nodes) - spread(old_core, 2, face_corners)
    face%way = new%displacement(:, nodes) - old%displacement(:, nodes)
    shift = shift_of(at_old, old%displacement)
    face%x = face%x - spread(shift, 2, face_corners)
    shift = shift_of(at_new, new%displacement) - shift
    face%way = face%way - spread(shift + (core - old_core), 2, face_corners)
    if (at_new%turns) call follow_axis(old_axis, face)
    do k = 1, face_corners
      face%x(:, k) = across(face, face%x(:, k))
      face%way(:, k) = across(face, face%way(:, k))
    end do
  end subroutine set_face

  !> The face as it stood when the increment began, seen from a cylinder whose axis has turned.
  pure subroutine follow_axis(old_axis, face)
    real(wp), intent(in) :: old_axis(3) !! unit vector, 0 of a sphere
    type(moving_face_t), intent(inout) :: face
    real(wp) :: ends(3, face_corners)
    integer :: k

    if (.not. any(abs(old_axis - face%axis) > 0.0_wp)) return
    ends = face%x + face%way
    do k = 1, face_corners
      face%x(:, k) = face%x(:, k) - dot_product(old_axis, face%x(:, k))*old_axis
      face%x(:, k) = transport_tangent(face%x(:, k), old_axis, face%axis)
    end do
    face%way = ends - face%x
  end subroutine follow_axis

  !> The part of a vector that a cylinder's distance is measured along.
  pure function across(face, v)
    type(moving_face_t), intent(in) :: face
    real(wp), intent(in) :: v(3)
    real(wp) :: across(3)

    across = v - dot_product(face%axis, v)*face%axis
  end function across

  !> Whether no point of a face can be in the obstacle during the increment.
  pure logical function is_far(face)
    type(moving_face_t), intent(in) :: face
    real(wp) :: x(3), way(3), s, extent

    x = sum(face%x, dim=2)/real(face_corners, wp)
    way = sum(face%way, dim=2)/real(face_corners, wp)
    extent = maxval(norm2(face%x - spread(x, 2, face_corners), dim=1)) + &
      maxval(norm2(face%way - spread(way, 2, face_corners), dim=1))
    s = 0.0_wp
    if (dot_product(way, way) > 0.0_wp) s = min(1.0_wp, max(0.0_wp, -dot_product(x, way)/ &
      dot_product(way, way)))
    is_far = norm2(x + s*way) - extent + minval(face%extra) > face%radius
  end function is_far

  !> The least gap of a face: at 3 x 3 points, and where the flat face comes closest.
  subroutine find_least_gap(faces, f, face, s_range, least, xi_eta)
    type(smooth_faces_t), intent(in) :: faces
    integer, intent(in) :: f
    type(moving_face_t), intent(in) :: face
    real(wp), intent(in) :: s_range(2) !! part of the way, 0 to 1
    real(wp), intent(out) :: least     !! [length]
    real(wp), intent(out) :: xi_eta(2)  !! where on the face it is
    real(wp) :: xi, eta, s, start(3), distance, closest, gap
    integer :: i, j

    least = huge(1.0_wp)
    closest = huge(1.0_wp)
    xi_eta = 0.0_wp
    start = 0.0_wp
    do j = 1, 3
      do i = 1, 3
        xi = at_three(i)
        eta = at_three(j)
        s = s_of(shape_at(xi, eta))
        call look(xi, eta, s)
        if (distance >= closest) cycle
        closest = distance
        start = [xi, eta, s]
      end do
    end do
    call find_closest(face%x, face%way, s_range, start(1), start(2), start(3))
    call look(start(1), start(2), start(3))

  contains

    subroutine look(xi, eta, s)
      real(wp), intent(in) :: xi, eta, s

      call gap_at(faces, f, face, xi, eta, s, distance, gap)
      if (gap >= least) return
      least = gap
      xi_eta = [xi, eta]
    end subroutine look

    !> Where a point of the face comes closest on its way.
    pure real(wp) function s_of(n)
      real(wp), intent(in) :: n(face_corners)
      real(wp) :: x(3), way(3)

      x = matmul(face%x, n)
      way = matmul(face%way, n)
      s_of = s_range(2)
      if (dot_product(way, way) > 0.0_wp) s_of = min(s_range(2), max(s_range(1), &
        -dot_product(x, way)/dot_product(way, way)))
    end function s_of

  end subroutine find_least_gap

  !> Gap of a point of a face: the larger of that of the flat face and that of the smooth one.
  !> docs/theory.md (10.6).
  pure subroutine gap_at(faces, f, face, xi, eta, s, distance, gap)
    type(smooth_faces_t), intent(in) :: faces
    integer, intent(in) :: f
    type(moving_face_t), intent(in) :: face
    real(wp), intent(in) :: xi, eta, s
    real(wp), intent(out) :: distance !! of the flat face from the middle or axis [length]
    real(wp), intent(out) :: gap      !! [length]
    real(wp) :: n(face_corners), x(3), bulge(3)

    n = shape_at(xi, eta)
    x = matmul(face%x + s*face%way, n)
    bulge = bulge_at(faces, f, xi, eta)
    distance = norm2(x)
    gap = max(distance, norm2(x + across(face, bulge)) + known_to*norm2(bulge)) - face%radius + &
      dot_product(n, face%extra)
  end subroutine gap_at

  !> Whether the middle of an obstacle goes from the outer side of a face to the inner.
  pure logical function goes_through(face, xi_eta)
    type(moving_face_t), intent(in) :: face
    real(wp), intent(in) :: xi_eta(2)
    real(wp) :: n(face_corners)

    n = shape_at(xi_eta(1), xi_eta(2))
    goes_through = dot_product(matmul(face%x, n), face%normal(:, 1)) < 0.0_wp .and. &
      dot_product(matmul(face%x + face%way, n), face%normal(:, 2)) > 0.0_wp
  end function goes_through

  !> int p g^- dA over a face at the end of the increment, by Simpson's rule. docs/theory.md (10.8).
  pure function work_of_face(faces, f, face, coordinates, pressure) result(work)
    type(smooth_faces_t), intent(in) :: faces
    integer, intent(in) :: f
    type(moving_face_t), intent(in) :: face
    real(wp), intent(in) :: coordinates(3, face_corners) !! [length]
    real(wp), intent(in) :: pressure(face_corners)       !! of the nodes [force/length^2]
    real(wp) :: work                          !! not positive [energy]
    real(wp) :: gap, distance, one(3), other(3)
    integer :: i, j

    work = 0.0_wp
    do j = 1, 3
      do i = 1, 3
        call gap_at(faces, f, face, at_three(i), at_three(j), 1.0_wp, distance, gap)
        if (gap >= 0.0_wp) cycle
        one = 0.5_wp*matmul(coordinates, shape_at(1.0_wp, at_three(j)) - &
          shape_at(-1.0_wp, at_three(j)))
        other = 0.5_wp*matmul(coordinates, shape_at(at_three(i), 1.0_wp) - &
          shape_at(at_three(i), -1.0_wp))
        work = work + simpson(i)*simpson(j)*norm2(cross(one, other))*gap* &
          dot_product(shape_at(at_three(i), at_three(j)), pressure)
      end do
    end do
  end function work_of_face

  !> The mean of max(0, -g) over a face at the end of the increment, likewise.
  pure real(wp) function mean_depth(faces, f, face, coordinates) result(depth)
    type(smooth_faces_t), intent(in) :: faces
    integer, intent(in) :: f
    type(moving_face_t), intent(in) :: face
    real(wp), intent(in) :: coordinates(3, face_corners) !! [length]
    real(wp), parameter :: unit(face_corners) = 1.0_wp

    depth = -2.0_wp*work_of_face(faces, f, face, coordinates, unit)/ &
      norm2(doubled_area(coordinates))
  end function mean_depth

end module moving_faces_mod
