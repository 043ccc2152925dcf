!> Rotations by rotation vectors: along the axis, as long as the angle [rad].
module rotations_mod
  use kinds_mod, only: wp
  implicit none
  private

  public :: rotation_matrix, turn_between

contains

  !> The matrix of a rotation, by Rodrigues' formula. docs/theory.md (9.7).
  pure function rotation_matrix(vector) result(r)
    real(wp), intent(in) :: vector(3)  !! [rad]
    real(wp) :: r(3, 3)
    real(wp) :: k(3, 3), angle
    integer :: i

    r = 0.0_wp
    do i = 1, 3
      r(i, i) = 1.0_wp
    end do
    angle = norm2(vector)
    if (angle <= 0.0_wp) return
    k = reshape([0.0_wp, vector(3), -vector(2), -vector(3), 0.0_wp, vector(1), vector(2), &
      -vector(1), 0.0_wp], [3, 3])/angle
    r = r + sin(angle)*k + 2.0_wp*sin(0.5_wp*angle)**2*matmul(k, k)
  end function rotation_matrix

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

  pure function quaternion(vector) result(q)
    real(wp), intent(in) :: vector(3)  !! [rad]
    real(wp) :: q(0:3)
    real(wp) :: angle

    angle = norm2(vector)
    q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
    if (angle > 0.0_wp) q = [cos(0.5_wp*angle), sin(0.5_wp*angle)/angle*vector]
  end function quaternion

end module rotations_mod
