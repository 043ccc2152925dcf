!> Rotations by rotation vectors: along the axis, as long as the angle [rad].
module rotations_mod
  use kinds_mod, only: wp
  use dense_mod, only: symmetric_eigenvectors
  implicit none
  private

  public :: rotation_matrix, change_of_place, turn_between, fit_motion, best_turn, spin_matrix, &
    compose_turns

contains

  !> The matrix of a rotation. docs/theory.md (9.7).
  pure function rotation_matrix(vector) result(r)
    real(wp), intent(in) :: vector(3)  !! [rad]
    real(wp) :: r(3, 3)
    integer :: i

    r = change_of_place(vector)
    do i = 1, 3
      r(i, i) = r(i, i) + 1.0_wp
    end do
  end function rotation_matrix

  !> What a rotation changes arms by, R - 1 by Rodrigues' formula: rounded as the change is, not as
  !> the arm is.
  pure function change_of_place(vector) result(change)
    real(wp), intent(in) :: vector(3)  !! [rad]
    real(wp) :: change(3, 3)
    real(wp) :: k(3, 3), angle

    change = 0.0_wp
    angle = norm2(vector)
    if (angle <= 0.0_wp) return
    k = reshape([0.0_wp, vector(3), -vector(2), -vector(3), 0.0_wp, vector(1), vector(2), &
      -vector(1), 0.0_wp], [3, 3])/angle
    change = sin(angle)*k + 2.0_wp*sin(0.5_wp*angle)**2*matmul(k, k)
  end function change_of_place

  !> The rotation vector, in space, that takes one orientation to another.
  !>
  !> By quaternions, whose signs tell a turn from its complement: where both vectors lie along one
  !> axis it is their difference.
  pure function turn_between(from, to) result(turn)
    real(wp), intent(in) :: from(3), to(3) !! rotation vectors, less than pi apart [rad]
    real(wp) :: turn(3)                    !! [rad]
    real(wp) :: p(0:3), q(0:3), part(3), length

    p = quaternion(from)
    q = quaternion(to)
    part = p(0)*q(1:) - q(0)*p(1:) - [q(2)*p(3) - q(3)*p(2), q(3)*p(1) - q(1)*p(3), &
      q(1)*p(2) - q(2)*p(1)]
    length = norm2(part)
    turn = 0.0_wp
    if (length > 0.0_wp) turn = 2.0_wp*atan2(length, dot_product(p, q))/length*part
  end function turn_between

  !> What takes the change of a rotation vector to the spin, dR = (S dvector) x R. docs/theory.md
  !> (8.38).
  pure function spin_matrix(vector) result(s)
    real(wp), intent(in) :: vector(3)  !! [rad]
    real(wp) :: s(3, 3)
    real(wp), parameter :: small = 1.0e-3_wp !! angle below which a series is as exact [rad]
    real(wp) :: k(3, 3), angle, first, second
    integer :: i

    angle = norm2(vector)
    k = reshape([0.0_wp, vector(3), -vector(2), -vector(3), 0.0_wp, vector(1), vector(2), &
      -vector(1), 0.0_wp], [3, 3])
    first = 0.5_wp - angle**2/24.0_wp
    second = 1.0_wp/6.0_wp - angle**2/120.0_wp + angle**4/5040.0_wp
    if (angle > small) then
      first = 2.0_wp*(sin(0.5_wp*angle)/angle)**2
      second = (angle - sin(angle))/angle**3
    end if
    s = first*k + second*matmul(k, k)
    do i = 1, 3
      s(i, i) = s(i, i) + 1.0_wp
    end do
  end function spin_matrix

  !> The rotation vector of one turn and another after it: of those of the whole turn, the one
  !> nearest to the first.
  pure function compose_turns(first, then) result(turn)
    real(wp), intent(in) :: first(3), then(3) !! rotation vectors in space [rad]
    real(wp) :: turn(3)                       !! [rad]
    real(wp) :: p(0:3), q(0:3)

    p = quaternion(first)
    q = quaternion(then)
    turn = vector_of([p(0)*q(0) - dot_product(p(1:), q(1:)), q(0)*p(1:) + p(0)*q(1:) + &
      [q(2)*p(3) - q(3)*p(2), q(3)*p(1) - q(1)*p(3), q(1)*p(2) - q(2)*p(1)]], first)
  end function compose_turns

  !> Of the rotation vectors of a quaternion, which differ by whole turns about its axis, the one
  !> nearest to another vector.
  pure function vector_of(q, near) result(vector)
    real(wp), intent(in) :: q(0:3)    !! of length 1
    real(wp), intent(in) :: near(3)   !! [rad]
    real(wp) :: vector(3)             !! [rad]
    real(wp), parameter :: whole = 8.0_wp*atan(1.0_wp)
    real(wp) :: axis(3), angle, length

    length = norm2(q(1:))
    angle = 2.0_wp*atan2(length, q(0))
    if (length > epsilon(1.0_wp)) then
      axis = q(1:)/length
    else
      ! The identity has no axis: the vector nearest to `near` is along it.
      angle = 0.0_wp
      axis = near/max(norm2(near), tiny(1.0_wp))
    end if
    vector = (angle + whole*anint((dot_product(near, axis) - angle)/whole))*axis
  end function vector_of

  !> The rotation vector of the R for which sum R m_i . x_i is the largest: of those of R, the one
  !> nearest to another. docs/theory.md (8.47).
  pure function best_turn(moments, places, near) result(vector)
    real(wp), intent(in) :: moments(:, :), places(:, :) !! (3,n) m_i [length], x_i [length]
    real(wp), intent(in) :: near(3)                     !! [rad]
    real(wp) :: vector(3)
    !! [rad]; `near` where moments and places on a line leave the rotation open
    real(wp) :: q(0:3)
    logical :: is_found

    vector = near
    call best_quaternion(matmul(moments, transpose(places)), q, is_found)
    if (is_found) vector = vector_of(q, near)
  end function best_turn

  !> The rigid motion that takes places nearest to others, x -> R x + t; none where places on a line
  !> leave the rotation open.
  pure subroutine fit_motion(from, to, rotation, shift, is_found)
    real(wp), intent(in) :: from(:, :), to(:, :)     !! (3,n) [length]
    real(wp), intent(out) :: rotation(3, 3), shift(3) !! [-], [length]
    logical, intent(out) :: is_found
    real(wp) :: m(3, 3), q(0:3), centre(3), goal(3)
    integer :: n

    rotation = rotation_matrix([0.0_wp, 0.0_wp, 0.0_wp])
    shift = 0.0_wp
    is_found = .false.
    n = size(from, 2)
    if (n < 3) return
    centre = sum(from, dim=2)/real(n, wp)
    goal = sum(to, dim=2)/real(n, wp)
    call best_quaternion(matmul(from - spread(centre, 2, n), transpose(to - spread(goal, 2, n))), &
      q, is_found)
    if (.not. is_found) return
    m = reshape([0.0_wp, q(3), -q(2), -q(3), 0.0_wp, q(1), q(2), -q(1), 0.0_wp], [3, 3])
    rotation = rotation + 2.0_wp*(q(0)*m + matmul(m, m))
    shift = goal - matmul(rotation, centre)
  end subroutine fit_motion

  !> The quaternion of the R for which the trace of R m is the largest, by the largest eigenvalue of
  !> Horn's matrix; none where that is two times there.
  pure subroutine best_quaternion(m, q, is_found)
    real(wp), intent(in) :: m(3, 3)  !! sum of a_i b_i^T, R a_i to be near b_i
    real(wp), intent(out) :: q(0:3)  !! of length 1
    logical, intent(out) :: is_found
    real(wp), parameter :: open = 1.0e-6_wp
    !! of the largest eigenvalue: the second as near to it, for places on a line [-]
    real(wp) :: horn(0:3, 0:3), values(4)
    integer :: i

    horn(0, 0) = m(1, 1) + m(2, 2) + m(3, 3)
    horn(0, 1:) = [m(2, 3) - m(3, 2), m(3, 1) - m(1, 3), m(1, 2) - m(2, 1)]
    horn(1:, 0) = horn(0, 1:)
    horn(1:, 1:) = m + transpose(m)
    do i = 1, 3
      horn(i, i) = horn(i, i) - horn(0, 0)
    end do
    call symmetric_eigenvectors(horn, values, is_found)
    is_found = is_found .and. values(4) - values(3) > open*values(4)
    q = horn(:, 3)
  end subroutine best_quaternion

  pure function quaternion(vector) result(q)
    real(wp), intent(in) :: vector(3)  !! [rad]
    real(wp) :: q(0:3)
    real(wp) :: angle

    angle = norm2(vector)
    q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
    if (angle > 0.0_wp) q = [cos(0.5_wp*angle), sin(0.5_wp*angle)/angle*vector]
  end function quaternion

end module rotations_mod
